//! Direct accesses to objects of a device: the SDO request, and what its outcome says.

use profile_cia402::sdo::request::{SdoData, SdoOutcome, SdoRequest};
use profile_cia402::wire::Mux;
use profile_generic::time::DurationNs;

use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun, Target};
use crate::mapping::Object;

/// Longest time for the answer to a write that stores parameters or restores the defaults: pages of a memory are erased before.
const STORE_TIME: DurationNs = DurationNs::from_secs(10);

/// The request of an access.
///
/// # Errors
/// CANopen devices do not have what is accessed.
pub fn request(task: DirectTask) -> Result<SdoRequest, NotBegun> {
    let DirectTask { target, write, data } = task;
    let Target::Object(Object { index, sub }) = target else { return Err((DirectFailure::OtherBus, data)) };
    let object = Mux::new(index, sub);
    Ok(match (write, index) {
        (true, 0x1010 | 0x1011) => SdoRequest::download(object, SdoData::Buffer(data)).within(STORE_TIME),
        (true, _) => SdoRequest::download(object, SdoData::Buffer(data)),
        (false, _) => SdoRequest::upload_into(object, data),
    })
}

/// What the outcome says.
#[must_use]
pub fn result(outcome: SdoOutcome) -> DirectResult {
    let result = outcome.result.map(|()| None).map_err(DirectFailure::Sdo);
    DirectResult { result, data: buffer(outcome.data) }
}

/// The buffer of a direct access, which is never inline.
#[must_use]
pub fn buffer(data: SdoData) -> Vec<u8> {
    match data {
        SdoData::Buffer(buffer) => buffer,
        SdoData::Inline(_) => Vec::new(),
    }
}
