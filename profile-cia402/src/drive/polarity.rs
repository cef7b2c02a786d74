//! Polarity, object 607Eh: which data change their sign between the master and the drive.

use crate::generated::bits::polarity;
use bitflags::bitflags;

bitflags! {
    /// Polarity. Bits without a name are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct Polarity: u8 {
        /// Bit 7: positions, in pp, csp, ip and homing.
        const POSITION = polarity::POSITION_POLARITY;
        /// Bit 6: velocities, in pv, csv and vl.
        const VELOCITY = polarity::VELOCITY_POLARITY;
    }
}

impl Polarity {
    /// 1 or -1, for a position.
    #[must_use]
    pub const fn position_sign(self) -> i64 {
        if self.contains(Self::POSITION) { -1 } else { 1 }
    }

    /// 1 or -1, for a velocity.
    #[must_use]
    pub const fn velocity_sign(self) -> i64 {
        if self.contains(Self::VELOCITY) { -1 } else { 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_turn_signs() {
        let signs = |bits| {
            let polarity = Polarity::from_bits_retain(bits);
            (polarity.position_sign(), polarity.velocity_sign())
        };
        assert_eq!([0x00, 0x80, 0x40, 0xC0, 0x3F].map(signs), [(1, 1), (-1, 1), (1, -1), (-1, -1), (1, 1)]);
    }
}
