//! Hot-plug field: the first eight bytes of MDT0 and of AT0 in CP3 and CP4.
//!
//! | byte | size | MDT | AT |
//! |---|---|---|---|
//! | 0 | 2 | 15..12 slave index in a device, 11..0 SERCOS address | the same |
//! | 2 | 2 | control: 15 supported, 9 enabled, 8 switch to SVC, 7..0 code | status: 8 error, 7..0 code |
//! | 4 | 4 | value of the parameter | value |

use core::fmt;

use profile_generic::wire::{Error, need, put_u16, put_u32, u16_at, u32_at};

/// Bytes of the field.
pub const HOT_PLUG_LEN: usize = 8;

/// SERCOS address (bits 11..0 of the selection) that means every slave.
pub const BROADCAST_ADDRESS: u16 = 0xFFF;
/// SERCOS address in an AT that means: no more slaves.
pub const END_ADDRESS: u16 = 4093;

/// Parameter code in bits 7..0 of the control word of an MDT.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct HotPlugCode(pub u8);

impl HotPlugCode {
    /// Nothing is sent.
    pub const NONE: Self = Self(0x00);
    /// SERCOS cycle time.
    pub const CYCLE_TIME: Self = Self(0x01);
    /// Start of the unified communication channel, ns.
    pub const T6: Self = Self(0x02);
    /// End of the unified communication channel, ns.
    pub const T7: Self = Self(0x03);
    /// Requested MTU of the unified communication channel.
    pub const REQUESTED_MTU: Self = Self(0x04);
    /// Communication version.
    pub const COMMUNICATION_VERSION: Self = Self(0x05);
    /// Length of MDT0; MDT1 to MDT3 follow.
    pub const MDT_LENGTH: Self = Self(0x10);
    /// Length of AT0; AT1 to AT3 follow.
    pub const AT_LENGTH: Self = Self(0x20);
    /// Offset of the service channel in the MDTs.
    pub const SVC_OFFSET_MDT: Self = Self(0x80);
    /// Offset of the service channel in the ATs.
    pub const SVC_OFFSET_AT: Self = Self(0x81);
}

impl fmt::Display for HotPlugCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NONE => f.write_str("none"),
            Self::CYCLE_TIME => f.write_str("cycle time"),
            Self::T6 => f.write_str("t6"),
            Self::T7 => f.write_str("t7"),
            Self::REQUESTED_MTU => f.write_str("requested MTU"),
            Self::COMMUNICATION_VERSION => f.write_str("communication version"),
            Self::SVC_OFFSET_MDT => f.write_str("SVC offset in MDT"),
            Self::SVC_OFFSET_AT => f.write_str("SVC offset in AT"),
            Self(code @ 0x10..=0x13) => write!(f, "length of MDT{}", code & 3),
            Self(code @ 0x20..=0x23) => write!(f, "length of AT{}", code & 3),
            Self(code) => write!(f, "code {code:#04x}"),
        }
    }
}

impl fmt::Debug for HotPlugCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "HotPlugCode({self})")
    }
}

/// The hot-plug field of an MDT or an AT; the words are kept whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct HotPlug {
    /// Selection: whom the field is for, or who answers.
    pub selection: u16,
    /// Control word (MDT) or status word (AT).
    pub word: u16,
    /// Value of the parameter.
    pub info: u32,
}

impl HotPlug {
    /// Control bit: the master can do hot-plug.
    pub const SUPPORTED: u16 = 1 << 15;
    /// Control bit: hot-plug is going on.
    pub const ENABLED: u16 = 1 << 9;
    /// Control bit: go on over the service channel.
    pub const SWITCH_TO_SVC: u16 = 1 << 8;
    /// Status bit: the code in bits 7..0 is an error.
    pub const ERROR: u16 = 1 << 8;
    /// Status code: the slave of this index has been scanned.
    pub const SCANNED: u16 = 1;
    /// Error code: the service channel cannot be used yet.
    pub const ERROR_SWITCH: u16 = 2;
    /// Error code: the slave has no SERCOS address.
    pub const ERROR_NO_ADDRESS: u16 = 4;
    /// Error code: the scan failed.
    pub const ERROR_SCAN: u16 = 5;

    /// Reads the field from the start of `bytes`.
    pub fn parse(bytes: &[u8]) -> Result<HotPlug, Error> {
        need("hot-plug field", HOT_PLUG_LEN, bytes.len())?;
        Ok(HotPlug { selection: u16_at(bytes, 0), word: u16_at(bytes, 2), info: u32_at(bytes, 4) })
    }

    /// Bytes written by [`emit`](Self::emit).
    pub const fn buffer_len(&self) -> usize {
        HOT_PLUG_LEN
    }

    /// Writes the field to the start of `bytes`.
    pub fn emit(&self, bytes: &mut [u8]) -> Result<(), Error> {
        need("hot-plug field", HOT_PLUG_LEN, bytes.len())?;
        put_u16(bytes, 0, self.selection);
        put_u16(bytes, 2, self.word);
        put_u32(bytes, 4, self.info);
        Ok(())
    }

    /// SERCOS address of the selection.
    pub const fn address(&self) -> u16 {
        self.selection & 0xFFF
    }

    /// Slave index in its device.
    pub const fn slave_index(&self) -> u16 {
        self.selection >> 12
    }

    /// Parameter code (MDT).
    pub const fn code(&self) -> HotPlugCode {
        HotPlugCode(self.word.to_le_bytes()[0])
    }
}

impl fmt::Display for HotPlug {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.address() {
            BROADCAST_ADDRESS => f.write_str("to all")?,
            address => write!(f, "address {address} index {}", self.slave_index())?,
        }
        write!(f, ", word {:#06x} ({}), info {}", self.word, self.code(), self.info)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::wire::check::check_vectors;

    /// Recording sercos3_startup_line2: frame, bytes, value.
    const VECTORS: &[(u32, [u8; 8], HotPlug)] = &[
        (
            4985,
            [0xFF, 0x0F, 0x02, 0x80, 0xF8, 0xF2, 0x00, 0x00],
            HotPlug { selection: 0x0FFF, word: 0x8002, info: 62_200 },
        ),
        (5193, [0, 0, 0, 0x80, 0, 0, 0, 0], HotPlug { selection: 0, word: HotPlug::SUPPORTED, info: 0 }),
    ];

    #[test]
    fn vectors_both_ways_and_truncation() {
        check_vectors!(VECTORS, HotPlug, fixed);
        assert_eq!(VECTORS[0].2.to_string(), "to all, word 0x8002 (t6), info 62200");
        assert_eq!(VECTORS[1].2.to_string(), "address 0 index 0, word 0x8000 (none), info 0");
        assert_eq!(HotPlugCode(0x12).to_string(), "length of MDT2");
        assert_eq!(HotPlugCode(0x7E).to_string(), "code 0x7e");
    }
}
