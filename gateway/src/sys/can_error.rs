//! What a CAN controller says of its bus, as Linux hands it on (`linux/can/error.h`): one error frame has one or several events.

use std::fmt;

use arrayvec::ArrayVec;
use bitflags::bitflags;
use socketcan::errors::{Location, ViolationTypes};

/// Events of one error frame at most: one for each bit of [`Classes`] and what is unknown.
const EVENTS_MAX: usize = 12;

bitflags! {
    /// Classes of events: the identifier word of an error frame.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub struct Classes: u32 {
        /// The driver gave up on a frame.
        const TRANSMIT_TIMEOUT = 0x001;
        /// Another station won the bus.
        const LOST_ARBITRATION = 0x002;
        /// The controller has changed its state.
        const CONTROLLER = 0x004;
        /// A frame broke the rules of the protocol.
        const PROTOCOL = 0x008;
        /// The transceiver complains about its lines.
        const TRANSCEIVER = 0x010;
        /// Nobody acknowledged a frame.
        const NO_ACKNOWLEDGE = 0x020;
        /// The controller is off the bus.
        const BUS_OFF = 0x040;
        /// The controller has seen an error.
        const BUS_ERROR = 0x080;
        /// The controller was started again.
        const RESTARTED = 0x100;
        /// The error counters stand in bytes 6 and 7.
        const COUNTERS = 0x200;
    }
}

bitflags! {
    /// Flags of the controller: byte 1 of an error frame.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub struct ControllerFlags: u8 {
        /// A received frame found no room.
        const RECEIVE_OVERFLOW = 0x01;
        /// A frame to be sent found no room.
        const TRANSMIT_OVERFLOW = 0x02;
        /// 96 receive errors counted.
        const RECEIVE_WARNING = 0x04;
        /// 96 transmit errors counted.
        const TRANSMIT_WARNING = 0x08;
        /// 128 receive errors counted.
        const RECEIVE_PASSIVE = 0x10;
        /// 128 transmit errors counted.
        const TRANSMIT_PASSIVE = 0x20;
        /// Error active again.
        const ACTIVE = 0x40;
    }
}

/// Error state that a controller reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BusState {
    /// Fewer than 96 errors counted.
    Active,
    /// 96 errors counted.
    Warning,
    /// 128 errors counted.
    Passive,
    /// 256 errors counted: neither sends nor receives until it is started again.
    Off,
}

impl fmt::Display for BusState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            BusState::Active => "error active",
            BusState::Warning => "error warning",
            BusState::Passive => "error passive",
            BusState::Off => "bus off",
        })
    }
}

/// What a CAN controller reports by an error frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusEvent {
    /// The controller is off the bus.
    Off,
    /// It was started again.
    Restarted,
    /// Its error state or its buffers.
    Controller(ControllerFlags),
    /// Another station won the bus; the bit of the frame at which, where the controller knows it.
    LostArbitration(Option<u8>),
    /// A frame broke the rules of the protocol.
    Protocol {
        /// How.
        types: ViolationTypes,
        /// Where in the frame.
        location: Location,
    },
    /// The transceiver complains; the byte of `linux/can/error.h`.
    Transceiver(u8),
    /// Nobody acknowledged a frame.
    NoAcknowledge,
    /// The driver gave up on a frame.
    TransmitTimeout,
    /// The controller has seen an error.
    BusError,
    /// The controller's error counters.
    Counters {
        /// Of frames it sent.
        transmit: u8,
        /// Of frames it received.
        receive: u8,
    },
    /// Classes of events that are not known here.
    Unknown(u32),
}

impl fmt::Display for BusEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BusEvent::Off => f.write_str("bus off"),
            BusEvent::Restarted => f.write_str("controller restarted"),
            BusEvent::Controller(flags) => {
                f.write_str("controller:")?;
                if flags.is_empty() {
                    f.write_str(" unspecified")?;
                }
                for (name, _) in flags.iter_names() {
                    write!(f, " {}", name.to_ascii_lowercase().replace('_', " "))?;
                }
                Ok(())
            }
            BusEvent::LostArbitration(None) => f.write_str("arbitration lost"),
            BusEvent::LostArbitration(Some(bit)) => write!(f, "arbitration lost at bit {bit}"),
            BusEvent::Protocol { types, location } => write!(f, "protocol violation: {types} at {location}"),
            BusEvent::Transceiver(byte) => write!(f, "transceiver fault {byte:02X}"),
            BusEvent::NoAcknowledge => f.write_str("no acknowledge"),
            BusEvent::TransmitTimeout => f.write_str("transmit time-out"),
            BusEvent::BusError => f.write_str("bus error"),
            BusEvent::Counters { transmit, receive } => {
                write!(f, "error counters {transmit} transmit, {receive} receive")
            }
            BusEvent::Unknown(classes) => write!(f, "unknown classes {classes:X}"),
        }
    }
}

/// An error frame of the kernel (`CAN_ERR_FLAG`): no frame of the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorFrame {
    classes: Classes,
    data: [u8; 8],
}

impl ErrorFrame {
    /// Reads identifier word and data.
    pub(super) fn read(word: u32, data: &[u8; 8]) -> Self {
        Self { classes: Classes::from_bits_retain(word & 0x1FFF_FFFF), data: *data }
    }

    /// Its events, the gravest first.
    pub fn events(&self) -> impl Iterator<Item = BusEvent> + use<> {
        let data = self.data;
        let mut events = ArrayVec::<BusEvent, EVENTS_MAX>::new();
        let mut tell = |class: Classes, event: BusEvent| {
            if self.classes.contains(class) {
                events.push(event);
            }
        };
        tell(Classes::BUS_OFF, BusEvent::Off);
        tell(Classes::RESTARTED, BusEvent::Restarted);
        tell(Classes::CONTROLLER, BusEvent::Controller(ControllerFlags::from_bits_retain(data[1])));
        tell(Classes::TRANSMIT_TIMEOUT, BusEvent::TransmitTimeout);
        let types = ViolationTypes::from_bits_retain(data[2]);
        tell(Classes::PROTOCOL, BusEvent::Protocol { types, location: Location::from(data[3]) });
        tell(Classes::TRANSCEIVER, BusEvent::Transceiver(data[4]));
        tell(Classes::NO_ACKNOWLEDGE, BusEvent::NoAcknowledge);
        tell(Classes::BUS_ERROR, BusEvent::BusError);
        tell(Classes::LOST_ARBITRATION, BusEvent::LostArbitration(Some(data[0]).filter(|bit| *bit != 0)));
        tell(Classes::COUNTERS, BusEvent::Counters { transmit: data[6], receive: data[7] });
        let unknown = self.classes.difference(Classes::all());
        if !unknown.is_empty() {
            events.push(BusEvent::Unknown(unknown.bits()));
        }
        events.into_iter()
    }

    /// The state that it says the controller is in; `None` when it does not say.
    #[must_use]
    pub fn state(&self) -> Option<BusState> {
        let flags = ControllerFlags::from_bits_retain(self.data[1]);
        let told = self.classes.contains(Classes::CONTROLLER);
        if self.classes.contains(Classes::BUS_OFF) {
            Some(BusState::Off)
        } else if told
            && flags.intersects(ControllerFlags::RECEIVE_PASSIVE | ControllerFlags::TRANSMIT_PASSIVE)
        {
            Some(BusState::Passive)
        } else if told
            && flags.intersects(ControllerFlags::RECEIVE_WARNING | ControllerFlags::TRANSMIT_WARNING)
        {
            Some(BusState::Warning)
        } else if self.classes.contains(Classes::RESTARTED) || told && flags.contains(ControllerFlags::ACTIVE)
        {
            Some(BusState::Active)
        } else {
            None
        }
    }
}

impl fmt::Display for ErrorFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, event) in self.events().enumerate() {
            let separator = if place == 0 { "" } else { "; " };
            write!(f, "{separator}{event}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(classes: u32, data: [u8; 8]) -> ErrorFrame {
        ErrorFrame::read(0x2000_0000 | classes, &data)
    }

    /// Values of linux/can/error.h.
    #[test]
    fn every_class_is_told_the_gravest_first() {
        let cases = [
            (0x040, [0; 8], "bus off", Some(BusState::Off)),
            (0x100, [0; 8], "controller restarted", Some(BusState::Active)),
            (
                0x004,
                [0, 0x0C, 0, 0, 0, 0, 0, 0],
                "controller: receive warning transmit warning",
                Some(BusState::Warning),
            ),
            (
                0x204,
                [0, 0x20, 0, 0, 0, 0, 128, 3],
                "controller: transmit passive; error counters 128 transmit, 3 receive",
                Some(BusState::Passive),
            ),
            (0x004, [0, 0x40, 0, 0, 0, 0, 0, 0], "controller: active", Some(BusState::Active)),
            (0x004, [0, 0x01, 0, 0, 0, 0, 0, 0], "controller: receive overflow", None),
            (0x004, [0; 8], "controller: unspecified", None),
            (0x002, [11, 0, 0, 0, 0, 0, 0, 0], "arbitration lost at bit 11", None),
            (0x002, [0; 8], "arbitration lost", None),
            (0x020, [0; 8], "no acknowledge", None),
            (0x001, [0; 8], "transmit time-out", None),
            (0x010, [0, 0, 0, 0, 0x44, 0, 0, 0], "transceiver fault 44", None),
            (0x0020_0000, [0; 8], "unknown classes 200000", None),
        ];
        for (classes, data, text, state) in cases {
            let error = frame(classes, data);
            assert_eq!((error.to_string().as_str(), error.state()), (text, state));
        }
        // A stuff error in the data, as a driver with bus error reporting tells it.
        let violation = frame(0x088, [0, 0, 0x04, 0x0A, 0, 0, 0, 0]);
        assert_eq!(violation.events().count(), 2);
        assert!(violation.to_string().starts_with("protocol violation: "), "{violation}");
        assert!(violation.to_string().ends_with("; bus error"), "{violation}");
    }

    #[test]
    fn all_classes_at_once_are_all_told() {
        let all = frame(0x1FFF_FFFF, [0xFF; 8]);
        assert_eq!(all.events().count(), 11);
        assert_eq!(all.state(), Some(BusState::Off));
        assert_eq!(frame(0, [0; 8]).events().count(), 0);
    }
}
