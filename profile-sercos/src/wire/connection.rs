//! Words of the cyclic connections.
//!
//! * [`ConnectionControl`], C-CON: the first two bytes of a connection's data in MDT or AT.
//! * [`ConnectionSetup`], S-0-1050.x.1.
//!
//! Where a connection is in the telegrams, S-0-1050.x.3, is [`super::layout::Offset`].

use crate::generated::bits::{connection_control, connection_setup};
use core::fmt;

use bitflags::bitflags;

/// Length of C-CON in bytes.
pub const CONNECTION_CONTROL_LEN: usize = 2;

const COUNTER_SHIFT: u16 = 12;

bitflags! {
    /// Connection control, C-CON. Bits without a name are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct ConnectionControl: u16 {
        /// The producer is ready; before that the data means nothing.
        const READY = connection_control::PRODUCER_READY;
        /// Toggles with every new value.
        const NEW_DATA = connection_control::NEW_DATA;
        /// The data field is delayed.
        const DELAY = connection_control::DATA_FIELD_DELAY;
        /// Flow control: the producer has stopped.
        const STOPPED = connection_control::FLOW_CONTROL;
        /// Real-time bit 1.
        const REAL_TIME_1 = connection_control::REAL_TIME_BIT_1;
        /// Real-time bit 2.
        const REAL_TIME_2 = connection_control::REAL_TIME_BIT_2;
        /// Counter, see [`ConnectionControl::counter`].
        const COUNTER = connection_control::COUNTER;
        /// Reserved bits, transmitted as 0.
        const RESERVED = connection_control::RESERVED;
    }
}

impl ConnectionControl {
    /// Counts every production, 0..=15 with wrap. A producer that does not count sends 0 for ever.
    #[must_use]
    pub const fn counter(self) -> u8 {
        (self.bits() >> COUNTER_SHIFT).to_le_bytes()[0]
    }

    /// The word which follows this one when the producer has written a new value: toggled, counted, ready.
    #[must_use]
    pub const fn produced(self) -> ConnectionControl {
        let counter = self.bits().wrapping_add(1 << COUNTER_SHIFT) & ConnectionControl::COUNTER.bits();
        let rest = self.bits() & !ConnectionControl::COUNTER.bits();
        ConnectionControl::from_bits_retain(
            (rest ^ ConnectionControl::NEW_DATA.bits()) | ConnectionControl::READY.bits() | counter,
        )
    }
}

impl fmt::Display for ConnectionControl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}{} toggle {} counter {}",
            if self.contains(ConnectionControl::READY) { "ready" } else { "not ready" },
            if self.contains(ConnectionControl::STOPPED) { ", stopped," } else { "" },
            u8::from(self.contains(ConnectionControl::NEW_DATA)),
            self.counter()
        )
    }
}

/// What a connection's data field is made of, bits 5..4 of S-0-1050.x.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum ConfigurationType {
    /// The IDNs of the list S-0-1050.x.6.
    IdnList = 0,
    /// A container.
    Container = 1,
    /// What the function specific profile says; drives: telegram type S-0-0015.
    Profile = 2,
    /// Reserved.
    Reserved = 3,
}

/// How a connection is timed, bits 1..0 of S-0-1050.x.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum ConnectionTiming {
    /// Synchronous to the communication clock.
    ClockSynchronous = 0,
    /// Asynchronous with watchdog.
    AsynchronousWatchdog = 1,
    /// Asynchronous without watchdog.
    Asynchronous = 2,
    /// Cyclic, not synchronized.
    Cyclic = 3,
}

bitflags! {
    /// Connection setup, S-0-1050.x.1. Bits without a name are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct ConnectionSetup: u16 {
        /// The connection is used.
        const ACTIVE = connection_setup::ACTIVE;
        /// The slave produces (AT); 0: the slave consumes.
        const PRODUCER = connection_setup::PRODUCER;
        /// Configuration type, see [`ConnectionSetup::configuration`].
        const CONFIGURATION = connection_setup::CONFIGURATION_TYPE;
        /// Timing, see [`ConnectionSetup::timing`].
        const TIMING = connection_setup::TIMING;
        /// Bits without a public meaning.
        const RESERVED = connection_setup::RESERVED;
    }
}

impl ConnectionSetup {
    /// The setup of an active, clock synchronous connection of an IDN list.
    #[must_use]
    pub const fn synchronous(producer: bool) -> ConnectionSetup {
        if producer {
            ConnectionSetup::ACTIVE.union(ConnectionSetup::PRODUCER)
        } else {
            ConnectionSetup::ACTIVE
        }
    }

    /// What the data field is made of.
    #[must_use]
    pub const fn configuration(self) -> ConfigurationType {
        match self.bits() >> 4 & 3 {
            0 => ConfigurationType::IdnList,
            1 => ConfigurationType::Container,
            2 => ConfigurationType::Profile,
            _ => ConfigurationType::Reserved,
        }
    }

    /// The same with another configuration type.
    #[must_use]
    pub const fn with_configuration(self, configuration: ConfigurationType) -> ConnectionSetup {
        ConnectionSetup::from_bits_retain(self.bits() & !(3 << 4) | (configuration as u16) << 4)
    }

    /// How the connection is timed.
    #[must_use]
    pub const fn timing(self) -> ConnectionTiming {
        match self.bits() & 3 {
            0 => ConnectionTiming::ClockSynchronous,
            1 => ConnectionTiming::AsynchronousWatchdog,
            2 => ConnectionTiming::Asynchronous,
            _ => ConnectionTiming::Cyclic,
        }
    }

    /// The same with another timing.
    #[must_use]
    pub const fn with_timing(self, timing: ConnectionTiming) -> ConnectionSetup {
        ConnectionSetup::from_bits_retain(self.bits() & !3 | timing as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn producer_words_of_the_recording() {
        // Startup recording, frames 5229 to 5245: 0x1003, 0x2001, 0x3003, 0x4001, 0x5003.
        let mut word = ConnectionControl::empty();
        let mut words = Vec::new();
        for _ in 0..17 {
            word = word.produced();
            words.push(word.bits());
        }
        assert_eq!(words[..5], [0x1003, 0x2001, 0x3003, 0x4001, 0x5003]);
        // The counter wraps after 15 and carries into nothing.
        assert_eq!(words[14..], [0xF003, 0x0001, 0x1003]);
        let rest = ConnectionControl::REAL_TIME_1 | ConnectionControl::DELAY;
        assert_eq!(rest.produced().bits(), 0x1047);
        assert_eq!(ConnectionControl::from_bits_retain(0x5003).to_string(), "ready toggle 1 counter 5");
    }

    #[test]
    fn setup_words() {
        // Startup recording, frames 2665 and 2721.
        assert_eq!(ConnectionSetup::synchronous(false).bits(), 0x8000);
        assert_eq!(ConnectionSetup::synchronous(true).bits(), 0xC000);
        let word = ConnectionSetup::synchronous(true)
            .with_configuration(ConfigurationType::Profile)
            .with_timing(ConnectionTiming::Cyclic);
        assert_eq!(word.bits(), 0xC023);
        for bits in 0..=u16::MAX {
            let word = ConnectionSetup::from_bits_retain(bits);
            let again = word.with_configuration(word.configuration()).with_timing(word.timing());
            assert_eq!(again.bits(), bits);
        }
    }
}
