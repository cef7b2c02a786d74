//! The Assembly object (class 0x04) of a device with assemblies: its data for those that have no connection to them.
//!
//! | instance | data (attribute 3) | size (attribute 4) |
//! |---|---|---|
//! | output assembly | what counts of the owner; zeros while there is none in run | its bytes |
//! | input assembly | as it is sent next | its bytes |
//! | configuration, heartbeats | none | 0 |
//!
//! Nothing can be set, the data of the output assembly neither while it is connected nor before: only a connection, whose loss is noticed,
//! moves axes. The fields are no objects, so there is no list of members (attributes 1 and 2).

use super::class::CLASS_ASSEMBLY;
use super::object::Answer;
use crate::assembly::Assemblies;
use crate::assembly::layout::{CONFIGURATION_POINT, INPUT_ONLY_POINT, LISTEN_ONLY_POINT};
use crate::device::motion_link::ObjectPath;
use crate::wire::status::{GeneralStatus, Service};

/// Revision of the class.
const REVISION: u16 = 2;

/// Number of the data among the attributes of an instance, and of its size.
pub const ATTRIBUTE_DATA: u16 = 3;
const ATTRIBUTE_SIZE: u16 = 4;

/// Highest attribute number of the class.
const CLASS_ATTRIBUTE_MAX: u16 = 7;

/// What comes of a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// This answer.
    Done(Answer),
    /// The data, which the motion device has.
    Data,
}

/// Runs a service of the class.
pub(crate) fn serve(assemblies: &Assemblies, service: Service, path: &ObjectPath, data: &[u8]) -> Outcome {
    match attribute(assemblies, service, path, data) {
        Ok(Some(value)) => Outcome::Done(Answer::done(value.to_le_bytes().to_vec())),
        Ok(None) => Outcome::Data,
        Err(status) => Outcome::Done(Answer::status(status)),
    }
}

/// Whether the motion device is asked for these data.
#[must_use]
pub const fn is_data(path: &ObjectPath) -> bool {
    path.class == CLASS_ASSEMBLY && matches!(path.attribute, Some(ATTRIBUTE_DATA))
}

/// A number, or `None` for data.
fn attribute(
    assemblies: &Assemblies,
    service: Service,
    path: &ObjectPath,
    data: &[u8],
) -> Result<Option<u16>, GeneralStatus> {
    if path.member.is_some() || path.connection_point.is_some() {
        return Err(GeneralStatus::PATH_SEGMENT_ERROR);
    }
    let instances = instances(assemblies);
    let len = match path.instance {
        0 => None,
        instance => {
            let one = instances.iter().find(|(number, _)| u32::from(*number) == instance);
            Some(one.ok_or(GeneralStatus::PATH_DESTINATION_UNKNOWN)?.1)
        }
    };
    let sets = match service {
        Service::GET_ATTRIBUTE_SINGLE => false,
        Service::SET_ATTRIBUTE_SINGLE => true,
        _ => return Err(GeneralStatus::SERVICE_NOT_SUPPORTED),
    };
    let number = path.attribute.ok_or(GeneralStatus::PATH_SEGMENT_ERROR)?;
    let count = u16::try_from(instances.len()).unwrap_or(u16::MAX);
    let highest = instances.iter().map(|(number, _)| *number).max().unwrap_or(0);
    let value = match (len, number) {
        (None, 1) => Some(REVISION),
        (None, 2) => Some(highest),
        (None, 3) => Some(count),
        (None, 6) => Some(CLASS_ATTRIBUTE_MAX),
        (None, 7) => Some(ATTRIBUTE_SIZE),
        (Some(len), ATTRIBUTE_SIZE) => Some(u16::try_from(len).unwrap_or(u16::MAX)),
        (Some(_), ATTRIBUTE_DATA) => None,
        _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
    };
    match (sets, data) {
        (true, _) => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
        (false, []) => Ok(value),
        (false, _) => Err(GeneralStatus::TOO_MUCH_DATA),
    }
}

/// Number and bytes of each instance.
fn instances(assemblies: &Assemblies) -> [(u16, usize); 5] {
    [
        (assemblies.output_point(), assemblies.output_len()),
        (assemblies.input_point(), assemblies.input_len()),
        (CONFIGURATION_POINT, 0),
        (INPUT_ONLY_POINT, 0),
        (LISTEN_ONLY_POINT, 0),
    ]
}
