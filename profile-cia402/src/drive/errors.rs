//! Error codes: object 603Fh, and the first two bytes of an emergency message.
//!
//! Sources: openCANopen `cia402-error-codes.h` and Beckhoff's servo sample, which agree; CANopenNode for 81xx and 82xx.

pub use crate::generated::codes::ErrorCode;

impl ErrorCode {
    /// Whether it is of the communication profile, 81xx or 82xx.
    #[must_use]
    pub const fn is_communication(self) -> bool {
        matches!(self.0, 0x8100..=0x82FF)
    }

    /// Bits of the error register 1001h that a device sets for it: generic always, besides what it is about.
    #[must_use]
    pub const fn register(self) -> u8 {
        let [_, high] = self.0.to_le_bytes();
        let special = match (high >> 4, high) {
            (0, _) => return 0,
            (2, _) => 1 << 1,
            (3, _) => 1 << 2,
            (4, _) => 1 << 3,
            _ if self.is_communication() => 1 << 4,
            (5..=8, _) => 1 << 5,
            (_, 0xFF) => 1 << 7,
            _ => 0,
        };
        1 | special
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_there_once_and_in_order() {
        for pair in ErrorCode::NAMED.windows(2) {
            assert!(pair[0].0 < pair[1].0, "{:?} before {:?}", pair[0], pair[1]);
            assert_ne!(pair[0].1, pair[1].1);
        }
        for (code, name) in ErrorCode::NAMED {
            assert_eq!(ErrorCode::from_name(name), Some(*code), "{name} has two codes");
        }
    }

    #[test]
    fn codes_set_the_bits_of_the_error_register() {
        let cases = [
            (0x0000, 0x00),
            (0x2310, 0x03),
            (0x2FFF, 0x03),
            (0x3220, 0x05),
            (0x4310, 0x09),
            (0x6320, 0x21),
            (0x7305, 0x21),
            (0x8130, 0x11),
            (0x8210, 0x11),
            (0x8611, 0x21),
            (0x9000, 0x01),
            (0xFF01, 0x81),
        ];
        for (code, register) in cases {
            let code = ErrorCode(code);
            assert_eq!((code.register(), code.is_communication()), (register, register == 0x11), "{code:?}");
        }
        for code in 0..=u16::MAX {
            assert_eq!(ErrorCode(code).register() & 1 != 0, code >= 0x1000);
        }
    }
}
