//! The published state of the node of an axis on its bus.

use profile_cia402::master::boot::BootState;
use profile_cia402::wire::emcy::ErrorRegister;
use profile_cia402::wire::nmt::NmtState;
use profile_cip::devicenet::master::station::Phase;
use profile_sercos::master::station::Presence;
use profile_sercos::wire::device_status::DeviceStatus;

/// Numbers of the kinds in the published form.
mod kind {
    pub const UNKNOWN: u8 = 0;
    pub const SERCOS: u8 = 1;
    pub const CAN: u8 = 2;
    pub const DEVICENET: u8 = 3;
}

/// The values below are there.
mod flag {
    pub const FIRST: u8 = 1 << 0;
    pub const SECOND: u8 = 1 << 1;
}

/// Presences by their numbers in the published form.
const PRESENCES: [Presence; 5] =
    [Presence::Active, Presence::Lost, Presence::Excluded, Presence::Absent, Presence::Joining];

/// What the master of a bus knows of the node of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NodeStatus {
    /// Nothing.
    #[default]
    Unknown,
    /// A SERCOS slave.
    Sercos {
        /// Its topology address: its place in the network, from 1.
        place: u16,
        /// Whether it takes part.
        presence: Presence,
        /// S-DEV of the last cycle; `None` if its AT did not come.
        status: Option<DeviceStatus>,
    },
    /// A CANopen device.
    Can {
        /// How far its master has brought it.
        state: BootState,
        /// What its heartbeat, or its answer to node guarding, has reported last.
        nmt: Option<NmtState>,
        /// Error code and error register of its last EMCY.
        emcy: Option<(u16, ErrorRegister)>,
    },
    /// A slave on DeviceNet.
    Devicenet {
        /// How far its master has brought it.
        phase: Phase,
        /// Status word of its Identity object, once read.
        status: Option<u16>,
    },
}

impl NodeStatus {
    pub(super) fn to_word(self) -> u64 {
        let (head, first, second) = match self {
            Self::Unknown => ([kind::UNKNOWN, 0, 0, 0], 0, 0),
            Self::Sercos { place, presence, status } => {
                let flags = flags(status.is_some(), false);
                (
                    [kind::SERCOS, code(&PRESENCES, presence), 0, flags],
                    place,
                    status.map_or(0, |status| status.bits()),
                )
            }
            Self::Can { state, nmt, emcy } => {
                let flags = flags(nmt.is_some(), emcy.is_some());
                let (error, register) = emcy.unwrap_or((0, ErrorRegister::empty()));
                let nmt = nmt.map_or(0, |nmt| nmt.0);
                ([kind::CAN, code(&BootState::ALL, state), nmt, flags], error, u16::from(register.bits()))
            }
            Self::Devicenet { phase, status } => {
                let flags = flags(status.is_some(), false);
                ([kind::DEVICENET, code(&Phase::ALL, phase), 0, flags], status.unwrap_or(0), 0)
            }
        };
        let ([a, b, c, d], [e, f], [g, h]) = (head, first.to_be_bytes(), second.to_be_bytes());
        u64::from_be_bytes([a, b, c, d, e, f, g, h])
    }

    pub(super) fn from_word(word: u64) -> Self {
        let [kind, state, nmt, flags, e, f, g, h] = word.to_be_bytes();
        let (first, second) = (u16::from_be_bytes([e, f]), u16::from_be_bytes([g, h]));
        let place = usize::from(state);
        match kind {
            kind::SERCOS => PRESENCES.get(place).map_or(Self::Unknown, |presence| Self::Sercos {
                place: first,
                presence: *presence,
                status: (flags & flag::FIRST != 0).then(|| DeviceStatus::from_bits_retain(second)),
            }),
            kind::CAN => BootState::ALL.get(place).map_or(Self::Unknown, |state| Self::Can {
                state: *state,
                nmt: (flags & flag::FIRST != 0).then_some(NmtState(nmt)),
                emcy: (flags & flag::SECOND != 0).then(|| (first, ErrorRegister::from_bits_retain(h))),
            }),
            kind::DEVICENET => Phase::ALL.get(place).map_or(Self::Unknown, |phase| Self::Devicenet {
                phase: *phase,
                status: (flags & flag::FIRST != 0).then_some(first),
            }),
            _ => Self::Unknown,
        }
    }
}

/// Which of the two values are there.
fn flags(first: bool, second: bool) -> u8 {
    (if first { flag::FIRST } else { 0 }) | (if second { flag::SECOND } else { 0 })
}

fn code<T: PartialEq>(all: &[T], one: T) -> u8 {
    (0..).zip(all).find(|(_, known)| **known == one).map_or(u8::MAX, |(code, _)| code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_state_of_every_kind_crosses() {
        let mut all = vec![NodeStatus::Unknown];
        for status in [None, Some(DeviceStatus::from_bits_retain(0xA5C3)), Some(DeviceStatus::empty())] {
            all.extend(PRESENCES.map(|presence| NodeStatus::Sercos { place: 511, presence, status }));
        }
        let register = ErrorRegister::from_bits_retain(0x91);
        for (nmt, emcy) in
            [(None, None), (Some(NmtState::BOOT_UP), None), (Some(NmtState(0x7F)), Some((0x8130, register)))]
        {
            all.extend(BootState::ALL.map(|state| NodeStatus::Can { state, nmt, emcy }));
        }
        for status in [None, Some(0), Some(0xFEDC)] {
            all.extend(Phase::ALL.map(|phase| NodeStatus::Devicenet { phase, status }));
        }
        for node in all {
            assert_eq!(NodeStatus::from_word(node.to_word()), node);
        }
        for word in [u64::MAX, 0x01FF_0000_0000_0000, 0x02FF_0000_0000_0000, 0x03FF_0000_0000_0000] {
            assert_eq!(NodeStatus::from_word(word), NodeStatus::Unknown);
        }
    }
}
