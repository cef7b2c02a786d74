//! Why an SDO transfer ends: abort codes.

use profile_generic::open_code;

open_code! {
    /// Abort code. Codes without a name are kept.
    pub struct AbortCode(u32) {
        /// Toggle bit not alternated.
        TOGGLE = 0x0503_0000 => "toggle bit not alternated",
        /// SDO protocol timed out.
        TIMEOUT = 0x0504_0000 => "SDO protocol timed out",
        /// Command specifier not valid or unknown.
        COMMAND = 0x0504_0001 => "command specifier not valid or unknown",
        /// Invalid block size.
        BLOCK_SIZE = 0x0504_0002 => "invalid block size",
        /// Invalid sequence number.
        SEQUENCE = 0x0504_0003 => "invalid sequence number",
        /// CRC error.
        CRC = 0x0504_0004 => "CRC error",
        /// Out of memory.
        OUT_OF_MEMORY = 0x0504_0005 => "out of memory",
        /// Unsupported access to an object.
        ACCESS = 0x0601_0000 => "unsupported access to an object",
        /// Attempt to read a write-only object.
        WRITE_ONLY = 0x0601_0001 => "attempt to read a write-only object",
        /// Attempt to write a read-only object.
        READ_ONLY = 0x0601_0002 => "attempt to write a read-only object",
        /// Object does not exist.
        NO_OBJECT = 0x0602_0000 => "object does not exist",
        /// Object cannot be mapped to a PDO.
        NOT_MAPPABLE = 0x0604_0041 => "object cannot be mapped to a PDO",
        /// Number and length of the objects to be mapped exceed the PDO.
        PDO_LENGTH = 0x0604_0042 => "objects to be mapped exceed the length of the PDO",
        /// General parameter incompatibility.
        PARAMETER = 0x0604_0043 => "general parameter incompatibility",
        /// General internal incompatibility in the device.
        INTERNAL = 0x0604_0047 => "general internal incompatibility in the device",
        /// Access failed due to a hardware error.
        HARDWARE = 0x0606_0000 => "access failed due to a hardware error",
        /// Data type does not match: length.
        LENGTH = 0x0607_0010 => "length of the data type does not match",
        /// Data type does not match: too long.
        TOO_LONG = 0x0607_0012 => "length of the data type is too high",
        /// Data type does not match: too short.
        TOO_SHORT = 0x0607_0013 => "length of the data type is too low",
        /// Sub-index does not exist.
        NO_SUB_INDEX = 0x0609_0011 => "sub-index does not exist",
        /// Value out of range.
        VALUE = 0x0609_0030 => "value out of range",
        /// Value too high.
        TOO_HIGH = 0x0609_0031 => "value too high",
        /// Value too low.
        TOO_LOW = 0x0609_0032 => "value too low",
        /// Maximum is less than minimum.
        MAX_BELOW_MIN = 0x0609_0036 => "maximum value is less than minimum value",
        /// Resource, an SDO connection, is not available.
        RESOURCE = 0x060A_0023 => "resource not available: SDO connection",
        /// General error.
        GENERAL = 0x0800_0000 => "general error",
        /// Data cannot be transferred or stored.
        STORE = 0x0800_0020 => "data cannot be transferred or stored",
        /// The same, because of local control.
        LOCAL_CONTROL = 0x0800_0021 => "data cannot be transferred or stored: local control",
        /// The same, because of the device's state.
        DEVICE_STATE = 0x0800_0022 => "data cannot be transferred or stored: device state",
        /// There is no object dictionary.
        NO_DICTIONARY = 0x0800_0023 => "no object dictionary",
        /// No data available.
        NO_DATA = 0x0800_0024 => "no data available",
    }
}

impl AbortCode {
    /// Whether the device does not have the object or the sub-index.
    #[must_use]
    pub const fn is_absent(self) -> bool {
        matches!(self, Self::NO_OBJECT | Self::NO_SUB_INDEX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_ascend_and_print_their_names() {
        assert_eq!(AbortCode::NAMED.len(), 31);
        assert!(AbortCode::NAMED.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(AbortCode(0x0602_0000).to_string(), "object does not exist");
        // Only devices on EtherCAT send it.
        assert_eq!(AbortCode(0x0601_0003).to_string(), "0x06010003");
        let absent = AbortCode::NAMED.iter().filter(|(code, _)| code.is_absent()).count();
        assert_eq!(absent, 2);
    }
}
