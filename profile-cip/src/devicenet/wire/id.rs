//! CAN identifiers of DeviceNet: four message groups, and what the predefined master/slave connection set makes of them.
//!
//! | identifiers | bits | group |
//! |---|---|---|
//! | 000 to 3FF | `0 mmmm ssssss` | 1: message ID, source MAC ID |
//! | 400 to 5FF | `10 nnnnnn mmm` | 2: MAC ID (of either side, as the message ID says), message ID |
//! | 600 to 7BF | `11 mmm ssssss` | 3: message ID 0 to 6, source MAC ID |
//! | 7C0 to 7EF | `11111 mmmmmm` | 4: message ID 00 to 2F, no MAC ID |
//! | 7F0 to 7FF | | none |
//!
//! The lower identifier wins the bus, so of equal groups the message ID decides first in groups 1, 3 and 4, and the MAC
//! ID in group 2.

use core::fmt;

use profile_generic::can::Id;

use crate::wire::Error;

/// A node's address on DeviceNet, 0 to 63.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct MacId(u8);

impl MacId {
    /// The highest one, which a device has out of the box.
    pub const MAX: Self = Self(63);

    /// How many there are.
    pub const COUNT: usize = 64;

    /// The MAC ID with this number, if there is one.
    #[must_use]
    pub const fn new(number: u8) -> Option<Self> {
        if number <= Self::MAX.0 { Some(Self(number)) } else { None }
    }

    /// Its number, 0 to 63.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }

    /// The low six bits of a byte.
    #[must_use]
    pub const fn from_low_bits(byte: u8) -> Self {
        Self(byte & 0x3F)
    }

    const fn of(bits: u16) -> Self {
        Self((bits & 0x3F).to_le_bytes()[0])
    }
}

impl fmt::Display for MacId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// What an identifier says. `slave` is the slave's MAC ID, regardless of the sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Identifier {
    /// Group 1, message ID 0 to 11: connections that were not predefined.
    Group1 {
        /// Message ID, 0 to 11.
        message: u8,
        /// Who sends.
        source: MacId,
    },
    /// Group 1, message C: a slave's response to a multicast poll.
    MulticastPollResponse(MacId),
    /// Group 1, message D: a slave's change of state or cyclic message.
    ChangeOfState(MacId),
    /// Group 1, message E: a slave's response to a bit strobe.
    BitStrobeResponse(MacId),
    /// Group 1, message F: a slave's response to a poll, or its acknowledge of a change of state or cyclic message.
    PollResponse(MacId),
    /// Group 2, message 0: the master's bit strobe; here the MAC ID is the master's.
    BitStrobeCommand(MacId),
    /// Group 2, message 1: the master's multicast poll; the MAC ID is that of the group.
    MulticastPollCommand(MacId),
    /// Group 2, message 2: the master's acknowledge of a slave's change of state or cyclic message.
    Acknowledge(MacId),
    /// Group 2, message 3: a slave's explicit or unconnected response.
    ExplicitResponse(MacId),
    /// Group 2, message 4: the master's explicit request.
    ExplicitRequest(MacId),
    /// Group 2, message 5: the master's poll, change of state or cyclic message.
    PollCommand(MacId),
    /// Group 2, message 6: an unconnected request to a group 2 only server.
    UnconnectedRequest(MacId),
    /// Group 2, message 7: duplicate MAC ID check.
    DuplicateMacCheck(MacId),
    /// Group 3, message ID 0 to 4: connections that were not predefined.
    Group3 {
        /// Message ID, 0 to 4.
        message: u8,
        /// Who sends.
        source: MacId,
    },
    /// Group 3, message 5: response of the unconnected message manager (UCMM); the MAC ID is the sender's.
    UcmmResponse(MacId),
    /// Group 3, message 6: request to the unconnected message manager; the MAC ID is the sender's.
    UcmmRequest(MacId),
    /// Group 4, message ID 00 to 2B: reserved.
    Group4 {
        /// Message ID, 0 to 2B.
        message: u8,
    },
    /// Group 4, message 2C.
    CommunicationFaultedResponse,
    /// Group 4, message 2D.
    CommunicationFaultedRequest,
    /// Group 4, message 2E.
    OfflineOwnershipResponse,
    /// Group 4, message 2F.
    OfflineOwnershipRequest,
}

const GROUP_2: u16 = 0x400;
const GROUP_3: u16 = 0x600;
const GROUP_4: u16 = 0x7C0;
const LAST: u16 = 0x7EF;

impl Identifier {
    /// Reads the 11 bits of a CAN identifier.
    ///
    /// # Errors
    /// 7F0 and above are no identifiers of DeviceNet.
    // Flat: a table of ranges of identifiers.
    pub fn parse(bits: u16) -> Result<Self, Error> {
        let mac = MacId::of(bits);
        let [low, _] = bits.to_le_bytes();
        let message = (bits >> 6).to_le_bytes()[0];
        Ok(match bits {
            ..GROUP_2 => match message {
                12 => Self::MulticastPollResponse(mac),
                13 => Self::ChangeOfState(mac),
                14 => Self::BitStrobeResponse(mac),
                15 => Self::PollResponse(mac),
                _ => Self::Group1 { message, source: mac },
            },
            GROUP_2..GROUP_3 => {
                let mac = MacId::of(bits >> 3);
                match low & 7 {
                    0 => Self::BitStrobeCommand(mac),
                    1 => Self::MulticastPollCommand(mac),
                    2 => Self::Acknowledge(mac),
                    3 => Self::ExplicitResponse(mac),
                    4 => Self::ExplicitRequest(mac),
                    5 => Self::PollCommand(mac),
                    6 => Self::UnconnectedRequest(mac),
                    _ => Self::DuplicateMacCheck(mac),
                }
            }
            GROUP_3..GROUP_4 => match message & 7 {
                5 => Self::UcmmResponse(mac),
                6 => Self::UcmmRequest(mac),
                message => Self::Group3 { message, source: mac },
            },
            GROUP_4..=LAST => match low & 0x3F {
                0x2C => Self::CommunicationFaultedResponse,
                0x2D => Self::CommunicationFaultedRequest,
                0x2E => Self::OfflineOwnershipResponse,
                0x2F => Self::OfflineOwnershipRequest,
                message => Self::Group4 { message },
            },
            _ => {
                let (value, max) = (u32::from(bits), u32::from(LAST));
                return Err(Error::too_large("identifier of DeviceNet", max, value));
            }
        })
    }

    /// The 11 bits. Message IDs that the group does not have are cut to its bits.
    #[must_use]
    // Flat: one arm per message.
    pub const fn bits(self) -> u16 {
        const fn group_1(message: u8, mac: MacId) -> u16 {
            ((message & 0xF) as u16) << 6 | mac.0 as u16
        }
        const fn group_2(mac: MacId, message: u16) -> u16 {
            GROUP_2 | (mac.0 as u16) << 3 | message
        }
        const fn group_3(message: u8, mac: MacId) -> u16 {
            GROUP_3 | ((message & 7) as u16) << 6 | mac.0 as u16
        }
        match self {
            Self::Group1 { message, source } => group_1(message, source),
            Self::MulticastPollResponse(mac) => group_1(12, mac),
            Self::ChangeOfState(mac) => group_1(13, mac),
            Self::BitStrobeResponse(mac) => group_1(14, mac),
            Self::PollResponse(mac) => group_1(15, mac),
            Self::BitStrobeCommand(mac) => group_2(mac, 0),
            Self::MulticastPollCommand(mac) => group_2(mac, 1),
            Self::Acknowledge(mac) => group_2(mac, 2),
            Self::ExplicitResponse(mac) => group_2(mac, 3),
            Self::ExplicitRequest(mac) => group_2(mac, 4),
            Self::PollCommand(mac) => group_2(mac, 5),
            Self::UnconnectedRequest(mac) => group_2(mac, 6),
            Self::DuplicateMacCheck(mac) => group_2(mac, 7),
            Self::Group3 { message, source } => group_3(message, source),
            Self::UcmmResponse(mac) => group_3(5, mac),
            Self::UcmmRequest(mac) => group_3(6, mac),
            Self::Group4 { message } => GROUP_4 | (message & 0x3F) as u16,
            Self::CommunicationFaultedResponse => GROUP_4 | 0x2C,
            Self::CommunicationFaultedRequest => GROUP_4 | 0x2D,
            Self::OfflineOwnershipResponse => GROUP_4 | 0x2E,
            Self::OfflineOwnershipRequest => GROUP_4 | 0x2F,
        }
    }

    /// The CAN identifier.
    #[must_use]
    pub const fn can(self) -> Id {
        Id::Standard(self.bits())
    }

    /// Message group, 1 to 4.
    #[must_use]
    pub const fn group(self) -> u8 {
        match self.bits() {
            ..GROUP_2 => 1,
            GROUP_2..GROUP_3 => 2,
            GROUP_3..GROUP_4 => 3,
            _ => 4,
        }
    }

    /// Name of the message, as the tables of the predefined master/slave connection set have it.
    #[must_use]
    // Flat: one arm per message.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Group1 { .. } => "group 1 message",
            Self::MulticastPollResponse(_) => "multicast poll response",
            Self::ChangeOfState(_) => "change of state or cyclic",
            Self::BitStrobeResponse(_) => "bit strobe response",
            Self::PollResponse(_) => "poll response",
            Self::BitStrobeCommand(_) => "bit strobe command",
            Self::MulticastPollCommand(_) => "multicast poll command",
            Self::Acknowledge(_) => "change of state or cyclic acknowledge",
            Self::ExplicitResponse(_) => "explicit response",
            Self::ExplicitRequest(_) => "explicit request",
            Self::PollCommand(_) => "poll command",
            Self::UnconnectedRequest(_) => "group 2 only unconnected request",
            Self::DuplicateMacCheck(_) => "duplicate MAC ID check",
            Self::Group3 { .. } => "group 3 message",
            Self::UcmmResponse(_) => "unconnected response",
            Self::UcmmRequest(_) => "unconnected request",
            Self::Group4 { .. } => "group 4 message",
            Self::CommunicationFaultedResponse => "communication faulted response",
            Self::CommunicationFaultedRequest => "communication faulted request",
            Self::OfflineOwnershipResponse => "offline ownership response",
            Self::OfflineOwnershipRequest => "offline ownership request",
        }
    }

    /// The MAC ID in the identifier; group 4 has none.
    #[must_use]
    pub const fn mac(self) -> Option<MacId> {
        match self {
            Self::Group1 { source: mac, .. }
            | Self::Group3 { source: mac, .. }
            | Self::MulticastPollResponse(mac)
            | Self::ChangeOfState(mac)
            | Self::BitStrobeResponse(mac)
            | Self::PollResponse(mac)
            | Self::BitStrobeCommand(mac)
            | Self::MulticastPollCommand(mac)
            | Self::Acknowledge(mac)
            | Self::ExplicitResponse(mac)
            | Self::ExplicitRequest(mac)
            | Self::PollCommand(mac)
            | Self::UnconnectedRequest(mac)
            | Self::DuplicateMacCheck(mac)
            | Self::UcmmResponse(mac)
            | Self::UcmmRequest(mac) => Some(mac),
            Self::Group4 { .. }
            | Self::CommunicationFaultedResponse
            | Self::CommunicationFaultedRequest
            | Self::OfflineOwnershipResponse
            | Self::OfflineOwnershipRequest => None,
        }
    }
}

impl fmt::Display for Identifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match *self {
            Self::Group1 { message, .. } | Self::Group3 { message, .. } | Self::Group4 { message } => {
                write!(f, " {message:X}")?;
            }
            _ => {}
        }
        self.mac().map_or(Ok(()), |mac| write!(f, ", MAC ID {mac}"))
    }
}

#[cfg(test)]
mod tests {
    use core::fmt::Write as _;

    use super::*;

    /// Frames of manuals: ICP DAS I-7242D and CAN-8x24 (master 0A, slave 09), BEI MHK5 (slave 03), Rockwell 1760-DNET
    /// (slave 03), 1404 power monitor.
    #[test]
    fn identifiers_of_manuals() {
        let mac = |number| MacId::new(number).unwrap();
        let cases = [
            (0x44E, Identifier::UnconnectedRequest(mac(9))),
            (0x44B, Identifier::ExplicitResponse(mac(9))),
            (0x44C, Identifier::ExplicitRequest(mac(9))),
            (0x44D, Identifier::PollCommand(mac(9))),
            (0x349, Identifier::ChangeOfState(mac(9))),
            (0x3C9, Identifier::PollResponse(mac(9))),
            (0x41E, Identifier::UnconnectedRequest(mac(3))),
            (0x41C, Identifier::ExplicitRequest(mac(3))),
            (0x41B, Identifier::ExplicitResponse(mac(3))),
            (0x450, Identifier::BitStrobeCommand(mac(10))),
            (0x7ED, Identifier::CommunicationFaultedRequest),
            (0x7EC, Identifier::CommunicationFaultedResponse),
            (0x7EE, Identifier::OfflineOwnershipResponse),
            (0x7EF, Identifier::OfflineOwnershipRequest),
            (0x741, Identifier::UcmmResponse(mac(1))),
            (0x7BF, Identifier::UcmmRequest(MacId::MAX)),
        ];
        for (bits, identifier) in cases {
            assert_eq!(Identifier::parse(bits), Ok(identifier), "{bits:03X}");
            assert_eq!(identifier.bits(), bits, "{identifier}");
        }
    }

    #[test]
    fn every_identifier_comes_back_and_the_last_sixteen_are_none() {
        let mut text = String::new();
        for bits in 0..0x800_u16 {
            let parsed = Identifier::parse(bits);
            assert_eq!(parsed.is_ok(), bits <= LAST, "{bits:03X}");
            let Ok(identifier) = parsed else { continue };
            assert_eq!(identifier.bits(), bits, "{identifier}");
            let group = match bits >> 9 {
                0 | 1 => 1,
                2 => 2,
                _ if bits < GROUP_4 => 3,
                _ => 4,
            };
            assert_eq!(identifier.group(), group, "{bits:03X}");
            if identifier.mac().is_none_or(|mac| mac.get() == 5) {
                writeln!(text, "{bits:03X} {identifier}").unwrap();
            }
        }
        assert_eq!(
            Identifier::parse(0x7F0).map_err(|error| error.to_string()),
            Err("identifier of DeviceNet: expected at most 2031, found 2032".to_owned())
        );
        insta::assert_snapshot!(text);
    }

    #[test]
    fn there_are_sixty_four_mac_ids() {
        assert_eq!((0..=255).filter_map(MacId::new).count(), MacId::COUNT);
        assert_eq!((MacId::new(63), MacId::new(64)), (Some(MacId::MAX), None));
        assert_eq!(MacId::from_low_bits(0xCA), MacId(10));
    }
}
