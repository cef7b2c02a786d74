//! Direct accesses to what a drive keeps: the request on the service channel, and what its outcome says.

use profile_sercos::master::svc::request::{SvcData, SvcOperation, SvcOutcome, SvcRequest};

use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun, Target};

/// Bytes of a data status.
const STATUS_LEN: usize = 2;

/// The request of an access.
///
/// # Errors
/// SERCOS drives do not have what is accessed.
pub fn request(task: DirectTask) -> Result<SvcRequest, NotBegun> {
    let DirectTask { target, write, data } = task;
    let (idn, operation) = match target {
        Target::Element(idn, element) if write => (idn, SvcOperation::Write(element)),
        Target::Element(idn, element) => (idn, SvcOperation::Read(element)),
        Target::Status(idn) if !write => (idn, SvcOperation::Status),
        _ => return Err((DirectFailure::OtherBus, data)),
    };
    Ok(SvcRequest::new(idn, operation).with_buffer(data))
}

/// What the outcome says. A data status is put into the buffer, which has room for it.
#[must_use]
pub fn result(outcome: SvcOutcome) -> DirectResult {
    let mut data = buffer(outcome.data);
    if let (SvcOperation::Status, Ok(reply)) = (outcome.operation, &outcome.result) {
        data.clear();
        // Nothing is allocated here: the cycle runs this.
        if data.capacity() >= STATUS_LEN {
            data.extend_from_slice(&reply.status.bits().to_le_bytes());
        }
    }
    DirectResult { result: outcome.result.map(|reply| reply.attribute).map_err(DirectFailure::Svc), data }
}

/// The buffer of a direct access, which is never inline.
#[must_use]
pub fn buffer(data: SvcData) -> Vec<u8> {
    match data {
        SvcData::Buffer(buffer) => buffer,
        SvcData::Inline(_) => Vec::new(),
    }
}
