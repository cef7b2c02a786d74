//! Attributes of a drive as explicit messages ask for them, and what the answers say.
//!
//! The Motion Device Axis Object has attributes beyond 255, which only lists can name; other objects are asked for one.

use profile_cip::devicenet::master::event::{ExplicitRequest, Outcome};
use profile_cip::wire::status::{GeneralStatus, Service};

use crate::engine::access::{AccessFailure, Data, Refusal};
use crate::mapping::Attribute;
use crate::mapping::devicenet::motion;

/// Instance of every object that is asked.
const INSTANCE: u16 = 1;

/// Axis Fault Type, which is read with the code.
const AXIS_FAULT_TYPE: u16 = 662;

/// Attributes that are asked for at once, at most.
const ATTRIBUTES_MAX: usize = 2;

/// The attributes that an item is.
fn attributes(attribute: Attribute) -> ([u16; ATTRIBUTES_MAX], usize) {
    match (attribute.class, attribute.id) {
        (motion::CLASS, motion::AXIS_FAULT) => ([motion::AXIS_FAULT, AXIS_FAULT_TYPE], 2),
        (_, id) => ([id, 0], 1),
    }
}

/// The request that reads an attribute; `None` when no message can name it.
#[must_use]
pub fn read(attribute: Attribute) -> Option<ExplicitRequest> {
    if attribute.class != motion::CLASS {
        return Some(ExplicitRequest::get(attribute.class, INSTANCE, u8::try_from(attribute.id).ok()?));
    }
    let (ids, count) = attributes(attribute);
    let mut data = [0; 2 + 2 * ATTRIBUTES_MAX];
    data[0] = u8::try_from(count).ok()?;
    for (place, id) in data[2..].chunks_exact_mut(2).zip(&ids[..count]) {
        place.copy_from_slice(&id.to_le_bytes());
    }
    let service = Service::GET_ATTRIBUTE_LIST;
    ExplicitRequest::new(service, attribute.class, INSTANCE, &data[..2 + 2 * count])
}

/// The request that writes an attribute; `None` when no message can name it, or the value is too long.
#[must_use]
pub fn write(attribute: Attribute, value: &[u8]) -> Option<ExplicitRequest> {
    if attribute.class != motion::CLASS {
        let id = u8::try_from(attribute.id).ok()?;
        return ExplicitRequest::set(attribute.class, INSTANCE, id, value);
    }
    let mut data = Data::new();
    data.try_extend_from_slice(&1_u16.to_le_bytes()).ok()?;
    data.try_extend_from_slice(&attribute.id.to_le_bytes()).ok()?;
    data.try_extend_from_slice(value).ok()?;
    ExplicitRequest::new(Service::SET_ATTRIBUTE_LIST, attribute.class, INSTANCE, &data)
}

/// The value that an answer to [`read`] brings; of several attributes one behind the other.
///
/// # Errors
/// The drive refuses, does not answer, or answers something else.
pub fn value(attribute: Attribute, outcome: &Outcome) -> Result<Data, AccessFailure> {
    let mut rest = accepted(outcome)?;
    let mut value = Data::new();
    if attribute.class != motion::CLASS {
        return Data::try_from(rest).map_err(|_| AccessFailure::Unanswered);
    }
    let (ids, count) = attributes(attribute);
    let told = take(&mut rest)?;
    if usize::from(told) != count {
        return Err(AccessFailure::Unanswered);
    }
    for (place, id) in ids[..count].iter().enumerate() {
        listed(&mut rest, *id)?;
        // Behind the last one there is nothing; those in front of it are single bytes.
        let len = if place + 1 == count { rest.len() } else { 1 };
        let (bytes, behind) = rest.split_at_checked(len).ok_or(AccessFailure::Unanswered)?;
        value.try_extend_from_slice(bytes).map_err(|_| AccessFailure::Unanswered)?;
        rest = behind;
    }
    Ok(value)
}

/// Whether an answer to [`write`] says that the value was taken.
///
/// # Errors
/// The drive refuses, does not answer, or answers something else.
pub fn written(attribute: Attribute, outcome: &Outcome) -> Result<(), AccessFailure> {
    let mut rest = accepted(outcome)?;
    if attribute.class != motion::CLASS {
        return Ok(());
    }
    if take(&mut rest)? != 1 {
        return Err(AccessFailure::Unanswered);
    }
    listed(&mut rest, attribute.id)
}

/// An entry of the list of an answer: number and status.
fn listed(rest: &mut &[u8], id: u16) -> Result<(), AccessFailure> {
    if take(rest)? != id {
        return Err(AccessFailure::Unanswered);
    }
    let [status, _] = take(rest)?.to_le_bytes();
    refusal(GeneralStatus(status)).map_or(Ok(()), |refusal| Err(AccessFailure::Refused(refusal)))
}

fn take(rest: &mut &[u8]) -> Result<u16, AccessFailure> {
    let (word, behind) = rest.split_first_chunk().ok_or(AccessFailure::Unanswered)?;
    *rest = behind;
    Ok(u16::from_le_bytes(*word))
}

/// The data of an answer.
fn accepted(outcome: &Outcome) -> Result<&[u8], AccessFailure> {
    match outcome {
        Outcome::Done(data) => Ok(data),
        Outcome::Refused { status, .. } => {
            Err(AccessFailure::Refused(refusal(*status).unwrap_or(Refusal::Other)))
        }
        Outcome::NoAnswer | Outcome::NotTaken(_) | Outcome::Malformed(_) | Outcome::Lost => {
            Err(AccessFailure::Unanswered)
        }
    }
}

/// The status with which a drive refuses, of the message or of the one attribute in its list; `None` if it has not said one.
#[must_use]
pub fn refused_with(outcome: &Outcome) -> Option<GeneralStatus> {
    let status = match outcome {
        Outcome::Refused { status, .. } => *status,
        // Count, number, status and what belongs to it.
        Outcome::Done(data) => GeneralStatus(*data.get(4)?),
        Outcome::NoAnswer | Outcome::NotTaken(_) | Outcome::Malformed(_) | Outcome::Lost => return None,
    };
    (status != GeneralStatus::SUCCESS).then_some(status)
}

/// What a status is to those who do not know it; `None` of success.
pub(in crate::engine) fn refusal(status: GeneralStatus) -> Option<Refusal> {
    Some(match status {
        GeneralStatus::SUCCESS => return None,
        GeneralStatus::ATTRIBUTE_NOT_SUPPORTED | GeneralStatus::OBJECT_DOES_NOT_EXIST => Refusal::Unknown,
        GeneralStatus::ATTRIBUTE_NOT_SETTABLE => Refusal::ReadOnly,
        GeneralStatus::INVALID_ATTRIBUTE_VALUE
        | GeneralStatus::NOT_ENOUGH_DATA
        | GeneralStatus::TOO_MUCH_DATA => Refusal::Value,
        _ => Refusal::Other,
    })
}

#[cfg(test)]
mod tests;
