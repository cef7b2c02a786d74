//! The AC/DC Drive object (class 0x2A) of a device with assemblies of the AC/DC drive profile: which reference moves the axis, and what
//! the numbers of the assemblies count.
//!
//! | attribute | type | what it is |
//! |---|---|---|
//! | 6 `DriveMode` | USINT | 2 the speed reference moves the axis, 3 the torque reference |
//! | 7 `SpeedActual` | INT | of the input assembly, as it is sent next |
//! | 8 `SpeedRef` | INT | of the output assembly; 0 while no owner is in run |
//! | 11 `TorqueActual` | INT | as attribute 7; only with a torque in the assemblies |
//! | 12 `TorqueRef` | INT | as attribute 8; only with a torque in the assemblies |
//! | 22 `SpeedScale` | SINT | 0: speed is in rpm |
//! | 24 `TorqueScale` | SINT | torque is in Nm / 2^`TorqueScale`; only with a torque in the assemblies |
//!
//! Nothing can be set: references come on the connection, the rest is configured.

use super::assembly::Outcome;
use super::class::CLASS_AC_DC_DRIVE;
use super::object::Answer;
use crate::assembly::{Assemblies, Layout};
use crate::device::motion_link::ObjectPath;
use crate::wire::status::{GeneralStatus, Service};

/// Revision of the class.
const REVISION: u16 = 1;
/// Its one instance.
const INSTANCE: u32 = 1;
/// Highest attribute number of the class.
const CLASS_ATTRIBUTE_MAX: u16 = 7;
/// Highest attribute number of the instance.
const ATTRIBUTE_MAX: u16 = 24;

/// Bytes of a value that stands in an assembly.
pub const VALUE_LEN: usize = 2;

/// Where a value stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// In the output assembly, or else in the input assembly.
    pub output: bool,
    /// Its first byte.
    pub offset: usize,
}

/// Where the motion device finds what it is asked for; `None` when it is no such request.
#[must_use]
pub const fn place(path: &ObjectPath) -> Option<Place> {
    match (path.class, path.instance, path.attribute) {
        (CLASS_AC_DC_DRIVE, INSTANCE, Some(attribute)) => of_attribute(attribute),
        _ => None,
    }
}

const fn of_attribute(attribute: u16) -> Option<Place> {
    match attribute {
        7 => Some(Place { output: false, offset: 2 }),
        8 => Some(Place { output: true, offset: 2 }),
        11 => Some(Place { output: false, offset: 4 }),
        12 => Some(Place { output: true, offset: 4 }),
        _ => None,
    }
}

/// Runs a service of the class; `None` when the device has no such object.
pub(crate) fn serve(
    assemblies: &Assemblies,
    service: Service,
    path: &ObjectPath,
    data: &[u8],
) -> Option<Outcome> {
    let Layout::Speed { mode, torque_scale, .. } = assemblies.layout() else { return None };
    let torque = assemblies.layout().has_torque_in_nm();
    let own = [mode.code(), 0, torque_scale.to_le_bytes()[0]];
    Some(match attribute(own, torque, service, path, data) {
        Ok(Some(value)) => Outcome::Done(Answer::done(value)),
        Ok(None) => Outcome::Data,
        Err(status) => Outcome::Done(Answer::status(status)),
    })
}

/// A value, or `None` for one that stands in an assembly.
fn attribute(
    [mode, speed_scale, torque_scale]: [u8; 3],
    torque: bool,
    service: Service,
    path: &ObjectPath,
    data: &[u8],
) -> Result<Option<Vec<u8>>, GeneralStatus> {
    if path.member.is_some() || path.connection_point.is_some() {
        return Err(GeneralStatus::PATH_SEGMENT_ERROR);
    }
    if path.instance > INSTANCE {
        return Err(GeneralStatus::PATH_DESTINATION_UNKNOWN);
    }
    let sets = match service {
        Service::GET_ATTRIBUTE_SINGLE => false,
        Service::SET_ATTRIBUTE_SINGLE => true,
        _ => return Err(GeneralStatus::SERVICE_NOT_SUPPORTED),
    };
    let word = |value: u16| Some(value.to_le_bytes().to_vec());
    let number = path.attribute.ok_or(GeneralStatus::PATH_SEGMENT_ERROR)?;
    let value = match (path.instance, number) {
        (0, 1) => word(REVISION),
        (0, 2 | 3) => word(1),
        (0, 6) => word(CLASS_ATTRIBUTE_MAX),
        (0, 7) => word(ATTRIBUTE_MAX),
        (INSTANCE, 6) => Some(vec![mode]),
        (INSTANCE, 7 | 8) => None,
        (INSTANCE, 11 | 12) if torque => None,
        (INSTANCE, 22) => Some(vec![speed_scale]),
        (INSTANCE, 24) if torque => Some(vec![torque_scale]),
        _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
    };
    match (sets, data) {
        (true, _) => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
        (false, []) => Ok(value),
        (false, _) => Err(GeneralStatus::TOO_MUCH_DATA),
    }
}
