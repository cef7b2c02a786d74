//! The Message Router object (class 0x02) and the way from a path to an object.

use super::class::{CLASS_AC_DC_DRIVE, CLASS_ASSEMBLY, CLASS_AXIS_PARAMETER, CLASS_MOTION_DEVICE_AXIS};
use super::file::CLASS_FILE;
use super::list::OBJECT_CLASSES;
use super::object::Object;
use crate::device::config::IdentityConfig;
use crate::device::motion_link::ObjectPath;
use crate::wire::epath::{self, Encoding, LogicalType, Segment};
use crate::wire::status::GeneralStatus;

/// Resolves the path of an explicit request: class, instance, attribute, member, connection point, each at
/// most once; an electronic key is checked; a missing instance is the class.
///
/// # Errors
/// Path segment error for anything else, key failure for a key of another device.
pub(crate) fn resolve(path: &[u8], identity: &IdentityConfig) -> Result<ObjectPath, GeneralStatus> {
    const BAD: GeneralStatus = GeneralStatus::PATH_SEGMENT_ERROR;
    let (mut class, mut instance, mut attribute, mut member, mut point) = (None, None, None, None, None);
    for segment in epath::segments(path, Encoding::Padded) {
        let (kind, value) = match segment.map_err(|_| BAD)? {
            Segment::Logical { kind, value } => (kind, value.get()),
            Segment::Key(key) => {
                identity.check_key(&key).map_err(|_| GeneralStatus::KEY_FAILURE_IN_PATH)?;
                continue;
            }
            _ => return Err(BAD),
        };
        let slot = match kind {
            LogicalType::CLASS => &mut class,
            LogicalType::INSTANCE => &mut instance,
            LogicalType::ATTRIBUTE => &mut attribute,
            LogicalType::MEMBER => &mut member,
            LogicalType::CONNECTION_POINT => &mut point,
            _ => return Err(BAD),
        };
        if slot.replace(value).is_some() {
            return Err(BAD);
        }
    }
    let narrow = |value: Option<u32>| value.map(u16::try_from).transpose().map_err(|_| BAD);
    Ok(ObjectPath {
        class: narrow(class)?.ok_or(BAD)?,
        instance: instance.unwrap_or(0),
        attribute: narrow(attribute)?,
        member,
        connection_point: narrow(point)?,
    })
}

/// The Message Router object.
pub(crate) struct MessageRouter {
    /// Connections there can be.
    pub available: u16,
    /// Connections there are.
    pub active: u16,
    /// Whether there is a file to serve.
    pub has_file: bool,
    /// Whether there is a Motion Device Axis Object, or else assemblies and an object for the parameters of drives.
    pub has_axes: bool,
    /// Whether its assemblies are those of the AC/DC drive profile, with their object.
    pub has_drive: bool,
}

impl Object for MessageRouter {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[1, 2, 3];
    const ATTRIBUTE_MAX: u16 = 3;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        match attribute {
            1 => {
                let classes = OBJECT_CLASSES.into_iter().map(|one| one.class);
                let classes = classes.filter(|class| *class != CLASS_FILE || self.has_file);
                let classes = classes.filter(|class| *class != CLASS_MOTION_DEVICE_AXIS || self.has_axes);
                let of_assemblies =
                    [CLASS_ASSEMBLY, CLASS_AXIS_PARAMETER].into_iter().filter(|_| !self.has_axes);
                let of_profile = self.has_drive.then_some(CLASS_AC_DC_DRIVE);
                let mut classes: Vec<u16> = classes.chain(of_assemblies).chain(of_profile).collect();
                classes.sort_unstable();
                out.extend(u16::try_from(classes.len()).unwrap_or(0).to_le_bytes());
                out.extend(classes.into_iter().flat_map(u16::to_le_bytes));
            }
            2 => out.extend(self.available.to_le_bytes()),
            3 => out.extend(self.active.to_le_bytes()),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }
}
