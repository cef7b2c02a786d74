//! Direct accesses to objects of a device: the SDO request, and what its outcome says.

use profile_cia402::sdo::request::{SdoData, SdoOutcome, SdoRequest};
use profile_cia402::wire::Mux;
use profile_generic::time::DurationNs;

use crate::engine::direct::{DirectFailure, DirectResult, DirectTask, NotBegun, Target};
use crate::parameter::command::signature;

/// Longest time for the answer to a write that stores parameters or restores the defaults: pages of a memory are erased before.
const STORE_TIME: DurationNs = DurationNs::from_secs(10);

/// The request of an access.
///
/// # Errors
/// CANopen devices do not have what is accessed.
pub fn request(task: DirectTask) -> Result<SdoRequest, NotBegun> {
    let DirectTask { target, write, data } = task;
    let Target::Object(object) = target else { return Err((DirectFailure::OtherBus, data)) };
    let mux = Mux::new(object.index, object.sub);
    if !write {
        return Ok(SdoRequest::upload_into(mux, data));
    }
    let request = SdoRequest::download(mux, SdoData::Buffer(data));
    let is_command = signature(object).is_some();
    Ok(if is_command { request.within(STORE_TIME) } else { request })
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
