//! Error control: boot-up, heartbeat, and the answer to node guarding. All have the identifier 700 + node.

use core::fmt;

use super::nmt::NmtState;
use profile_generic::wire::{Error, exact};

/// Bytes of a heartbeat.
pub const HEARTBEAT_LEN: usize = 1;

/// A heartbeat, a boot-up message or an answer to node guarding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Heartbeat {
    /// State of the device, 7 bits.
    pub state: NmtState,
    /// Bit 7: alternates in answers to node guarding, clear in heartbeats.
    pub toggle: bool,
}

impl Heartbeat {
    /// A heartbeat in this state.
    #[must_use]
    pub const fn new(state: NmtState) -> Self {
        Self { state, toggle: false }
    }

    /// Whether it is the boot-up message.
    #[must_use]
    pub fn is_boot_up(&self) -> bool {
        *self == Self::new(NmtState::BOOT_UP)
    }

    /// Reads one.
    ///
    /// # Errors
    /// [`Error::length`] unless there is one byte.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let [byte] = exact::<HEARTBEAT_LEN>("heartbeat", bytes)?;
        Ok(Self { state: NmtState(byte & 0x7F), toggle: byte & 0x80 != 0 })
    }

    /// The bytes.
    #[must_use]
    pub fn emit(&self) -> [u8; HEARTBEAT_LEN] {
        [self.state.0 & 0x7F | u8::from(self.toggle) << 7]
    }
}

impl fmt::Display for Heartbeat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_boot_up() {
            return f.write_str("boot-up");
        }
        write!(f, "heartbeat {}{}", self.state, if self.toggle { " toggle" } else { "" })
    }
}

#[cfg(test)]
mod tests {
    use profile_generic::wire::check::check_vectors;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn vectors_both_ways() {
        // CO_NMT_Heartbeat.h; the last by CO_Node_Guarding.h.
        let vectors = [
            (0x00, Heartbeat::new(NmtState::BOOT_UP), "boot-up"),
            (0x04, Heartbeat::new(NmtState::STOPPED), "heartbeat stopped"),
            (0x05, Heartbeat::new(NmtState::OPERATIONAL), "heartbeat operational"),
            (0x7F, Heartbeat::new(NmtState::PRE_OPERATIONAL), "heartbeat pre-operational"),
            (0x09, Heartbeat::new(NmtState(9)), "heartbeat 0x09"),
            (0x85, Heartbeat { state: NmtState::OPERATIONAL, toggle: true }, "heartbeat operational toggle"),
        ];
        for (byte, value, text) in vectors {
            check_vectors!(&[(text, [byte], value)], Heartbeat, whole);
            assert_eq!(value.to_string(), text);
        }
    }

    proptest! {
        #[test]
        fn round_trips(byte: u8) {
            prop_assert_eq!(Heartbeat::parse(&[byte]).unwrap().emit(), [byte]);
        }
    }
}
