//! The services of the DeviceNet object (class 3, instance 1) that a master takes a slave with.
//!
//! | service | data of the request | data of the response |
//! |---|---|---|
//! | 4B Allocate_Master/Slave_Connection_Set | allocation choice, MAC ID of the allocator | message body format |
//! | 4C Release_Group_2_Identifier_Set | release choice | none |

use core::fmt;

use super::id::MacId;
use crate::wire::{Error, Reader, Writer};

/// Class code of the DeviceNet object.
pub const CLASS_DEVICENET: u8 = 0x03;

/// Service code.
pub const ALLOCATE: u8 = 0x4B;

/// Service code.
pub const RELEASE: u8 = 0x4C;

const CHOICE: &str = "allocation choice";

bitflags::bitflags! {
    /// Connections of the predefined master/slave connection set.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct AllocationChoice: u8 {
        /// Explicit messages, connection instance 1.
        const EXPLICIT = 1 << 0;
        /// Poll, connection instance 2.
        const POLL = 1 << 1;
        /// Bit strobe, connection instance 3.
        const BIT_STROBE = 1 << 2;
        /// Multicast poll, connection instance 5.
        const MULTICAST_POLL = 1 << 3;
        /// Change of state, connection instance 4.
        const CHANGE_OF_STATE = 1 << 4;
        /// Cyclic, connection instance 4.
        const CYCLIC = 1 << 5;
        /// What comes by change of state or cyclically is not acknowledged.
        const ACKNOWLEDGE_SUPPRESSION = 1 << 6;
        /// Reserved bit, kept as it came.
        const _ = !0;
    }
}

impl AllocationChoice {
    /// Either kind of connection instance 4.
    pub const CHANGE_OF_STATE_OR_CYCLIC: Self = Self::CHANGE_OF_STATE.union(Self::CYCLIC);
}

impl fmt::Display for AllocationChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const NAMES: [&str; 8] = [
            "explicit",
            "poll",
            "bit strobe",
            "multicast poll",
            "change of state",
            "cyclic",
            "acknowledge suppression",
            "reserved",
        ];
        let mut separator = "";
        for (bit, name) in NAMES.into_iter().enumerate() {
            if self.bits() & 1 << bit != 0 {
                write!(f, "{separator}{name}")?;
                separator = ", ";
            }
        }
        if self.is_empty() { f.write_str("none") } else { Ok(()) }
    }
}

/// Data of an allocation request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Allocate {
    /// What is wanted.
    pub choice: AllocationChoice,
    /// Who wants it.
    pub allocator: MacId,
}

impl Allocate {
    /// Reads the data.
    ///
    /// # Errors
    /// There are not two bytes, or the second is no MAC ID.
    pub fn parse(data: &[u8]) -> Result<Self, Error> {
        let reader = &mut Reader::new(data);
        let [choice, allocator] = reader.array(CHOICE)?;
        reader.finish(CHOICE)?;
        let allocator = MacId::new(allocator).ok_or(Error::too_large(
            "MAC ID of the allocator",
            u32::from(MacId::MAX.get()),
            u32::from(allocator),
        ))?;
        Ok(Self { choice: AllocationChoice::from_bits_retain(choice), allocator })
    }

    /// Bytes that [`Self::emit`] writes.
    #[must_use]
    pub const fn buffer_len(&self) -> usize {
        2
    }

    /// Writes the data.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, buffer: &mut [u8]) -> Result<usize, Error> {
        let writer = &mut Writer::new(buffer);
        writer.slice(CHOICE, &[self.choice.bits(), self.allocator.get()])?;
        Ok(writer.written())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use profile_generic::wire::Expected;
    use profile_generic::wire::check::check_vectors;

    /// ICP DAS CAN-8x24, 7.2.2 (07 0A); BEI MHK5, 4.1 (03 0A).
    #[test]
    fn vectors() {
        let allocator = MacId::new(10).unwrap();
        let explicit_poll = AllocationChoice::EXPLICIT | AllocationChoice::POLL;
        let vectors: [(&str, &[u8], Allocate); 2] = [
            ("explicit and poll", &[0x03, 0x0A], Allocate { choice: explicit_poll, allocator }),
            (
                "explicit, poll and bit strobe",
                &[0x07, 0x0A],
                Allocate { choice: explicit_poll | AllocationChoice::BIT_STROBE, allocator },
            ),
        ];
        check_vectors!(&vectors, Allocate);
        assert!(matches!(Allocate::parse(&[3, 10, 0]), Err(Error { expected: Expected::End, .. })));
        assert_eq!(
            Allocate::parse(&[3, 64]).map_err(|error| error.to_string()),
            Err("MAC ID of the allocator: expected at most 63, found 64".to_owned())
        );
    }

    #[test]
    fn choices_print_their_bits() {
        let names = "explicit, poll, bit strobe, multicast poll, change of state, cyclic, acknowledge suppression, reserved";
        assert_eq!(AllocationChoice::from_bits_retain(0xFF).to_string(), names);
        assert_eq!(AllocationChoice::empty().to_string(), "none");
    }

    proptest! {
        #[test]
        fn round_trip(choice: u8, mac in 0_u8..64) {
            let bytes = [choice, mac];
            let mut buffer = [0xA5; 2];
            prop_assert_eq!(Allocate::parse(&bytes).unwrap().emit(&mut buffer), Ok(2));
            prop_assert_eq!(buffer, bytes);
        }
    }
}
