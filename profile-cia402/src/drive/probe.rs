//! Touch probes: function 60B8h and status 60B9h. Probe 2 has the bits of probe 1, eight higher.
//!
//! | bit | 60B8h | 60B9h |
//! |---|---|---|
//! | 0 | enable; taken on its rising edge | enabled |
//! | 1 | continuous: 0 takes the first edge only | a rising edge was stored |
//! | 2 | source: 0 input, 1 index pulse of the encoder | a falling edge was stored |
//! | 4 | sample on the rising edge | |
//! | 5 | sample on the falling edge | |
//!
//! Source: manuals of Panasonic and Botnana. Some drives toggle bits 6 and 7 of 60B9h with every stored edge; 60D5h to
//! 60D8h count them.

use crate::generated::bits::{probe_function, probe_status};
use bitflags::bitflags;

/// The byte of probe 1.
const fn first(word: u16) -> u8 {
    word.to_le_bytes()[0]
}

bitflags! {
    /// Function of one probe: one byte of 60B8h.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct ProbeFunction: u8 {
        /// Enable.
        const ENABLE = first(probe_function::ENABLE_TOUCH_PROBE_1);
        /// Take every edge instead of the first one.
        const CONTINUOUS = first(probe_function::CONTINUOUS_1);
        /// The index pulse of the encoder instead of the input.
        const INDEX_PULSE = 1 << probe_function::INDEX_PULSE_1.trailing_zeros();
        /// The source is that of 60D0h.
        const OTHER_SOURCE = 2 << probe_function::INDEX_PULSE_1.trailing_zeros();
        /// Sample on the rising edge.
        const RISING = first(probe_function::SAMPLE_AT_POSITIVE_EDGE_1);
        /// Sample on the falling edge.
        const FALLING = first(probe_function::SAMPLE_AT_NEGATIVE_EDGE_1);
        /// Bits 6 and 7.
        const MANUFACTURER = 3 << 6;
    }
}

bitflags! {
    /// Status of one probe: one byte of 60B9h.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct ProbeStatus: u8 {
        /// Enabled.
        const ENABLED = first(probe_status::TOUCH_PROBE_1_ENABLED);
        /// The position of a rising edge is stored.
        const RISING_STORED = first(probe_status::POSITIVE_EDGE_STORED_1);
        /// The position of a falling edge is stored.
        const FALLING_STORED = first(probe_status::NEGATIVE_EDGE_STORED_1);
        /// Bits 6 and 7.
        const MANUFACTURER = 3 << 6;
    }
}

/// The functions of probes 1 and 2 in 60B8h.
#[must_use]
pub const fn functions(word: u16) -> [ProbeFunction; 2] {
    let [first, second] = word.to_le_bytes();
    [ProbeFunction::from_bits_retain(first), ProbeFunction::from_bits_retain(second)]
}

/// 60B8h for two functions.
#[must_use]
pub const fn function_word(functions: [ProbeFunction; 2]) -> u16 {
    u16::from_le_bytes([functions[0].bits(), functions[1].bits()])
}

/// The states of probes 1 and 2 in 60B9h.
#[must_use]
pub const fn states(word: u16) -> [ProbeStatus; 2] {
    let [first, second] = word.to_le_bytes();
    [ProbeStatus::from_bits_retain(first), ProbeStatus::from_bits_retain(second)]
}

/// 60B9h for two states.
#[must_use]
pub const fn status_word(states: [ProbeStatus; 2]) -> u16 {
    u16::from_le_bytes([states[0].bits(), states[1].bits()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn words_hold_two_probes() {
        // Botnana's manual: 0013h probe 1 continuous on the rising edge, 2100h probe 2 once on the falling one.
        let [one, two] = functions(0x2113);
        assert_eq!(one, ProbeFunction::ENABLE | ProbeFunction::CONTINUOUS | ProbeFunction::RISING);
        assert_eq!(two, ProbeFunction::ENABLE | ProbeFunction::FALLING);
        let [one, two] = states(0x0503);
        assert_eq!(one, ProbeStatus::ENABLED | ProbeStatus::RISING_STORED);
        assert_eq!(two, ProbeStatus::ENABLED | ProbeStatus::FALLING_STORED);
    }

    proptest! {
        #[test]
        fn words_survive(word in any::<u16>()) {
            prop_assert_eq!(function_word(functions(word)), word);
            prop_assert_eq!(status_word(states(word)), word);
        }
    }
}
