//! Procedure commands of drives: which of them people may execute, and what has to follow.
//!
//! A SERCOS drive has them as IDNs. A CANopen device has two objects that act in the same way when they are written: 1010h stores
//! parameters, 1011h restores their defaults, each sub-index a group of parameters.

use super::id::Id;
use crate::mapping::Object;

/// What a CANopen device wants to be written to an object before it executes the command; `None` for objects that are none.
#[must_use]
pub const fn signature(object: Object) -> Option<[u8; 4]> {
    match (object.index, object.sub) {
        (0x1010, 1..=127) => Some(*b"save"),
        (0x1011, 1..=127) => Some(*b"load"),
        _ => None,
    }
}

/// Why people do not execute a command: what it is. `None` for those that they may.
#[must_use]
pub fn belongs_to_gateway(id: Id) -> Option<&'static str> {
    let Id::Idn(idn) = id else { return None };
    match idn.block() {
        _ if idn.is_product() => None,
        127 | 128 | 420 | 422 | 1024 => Some("the gateway executes it to bring the drive into operation"),
        148 | 170 => Some("the gateway executes it for a controller"),
        146 | 149 | 152 | 190 | 223 => Some("it moves the axis"),
        _ => None,
    }
}

/// Whether the axis must not be enabled before its drive was commissioned again: the command changes what the values of the drive
/// mean, or nobody knows what it changes.
#[must_use]
pub fn recommissions(id: Id) -> bool {
    match id {
        // Reset of the diagnosis, backup of the memory as it is.
        Id::Idn(idn) => idn.is_product() || !matches!(idn.block(), 99 | 264 | 293),
        Id::Object(object) => object.index != 0x1010,
        Id::Path { .. } => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(text: &str) -> Id {
        Id::parse(text).unwrap()
    }

    #[test]
    fn a_signature_is_the_text_that_the_standard_wants() {
        let signature = |index, sub| signature(Object { index, sub });
        assert_eq!(signature(0x1010, 1).map(u32::from_le_bytes), Some(0x6576_6173));
        assert_eq!(signature(0x1011, 4).map(u32::from_le_bytes), Some(0x6461_6F6C));
        for (index, sub) in [(0x1010, 0), (0x1011, 128), (0x6081, 1), (0x1012, 1)] {
            assert_eq!(signature(index, sub), None, "{index:x}:{sub}");
        }
    }

    #[test]
    fn commands_of_the_gateway_and_commands_that_move_are_not_for_people() {
        for text in ["S-0-0127", "S-0-0128", "S-0-1024", "S-0-0148", "S-0-0170", "S-0-0152", "S-0-0149"] {
            assert!(belongs_to_gateway(id(text)).is_some(), "{text}");
        }
        for text in ["S-0-0099", "S-0-0262", "S-0-0264", "P-0-0148", "1010:01", "1011:01"] {
            assert_eq!(belongs_to_gateway(id(text)), None, "{text}");
        }
    }

    #[test]
    fn only_commands_that_change_no_value_leave_the_drive_as_it_was_commissioned() {
        for text in ["S-0-0099", "S-0-0264", "S-0-0293", "1010:01"] {
            assert!(!recommissions(id(text)), "{text}");
        }
        for text in ["S-0-0262", "S-0-0263", "S-0-0447", "P-0-0099", "1011:01"] {
            assert!(recommissions(id(text)), "{text}");
        }
    }
}
