//! The published state of one bus.

use profile_sercos::master::topology::Topology;

use super::{PHASE_NONE, pair, split};
use crate::engine::phase_lock::{LockState, Phase};
use profile_generic::time::DurationNs;

/// Buses of one gateway: the SERCOS bus, four CANopen buses, four DeviceNet networks.
pub const BUSES_MAX: usize = 9;

/// Words of one bus in the published form.
pub(super) const BUS_WORDS: usize = 7;

/// Numbers of the kinds of [`BusDetail`] in the published form.
mod kind {
    pub const NONE: u8 = 0;
    pub const SERCOS: u8 = 1;
    pub const CAN: u8 = 2;
}

/// Telegrams that did not come back on one port of a SERCOS master, although the topology gives them back there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PortLosses {
    /// MDTs since the start.
    pub mdt: u32,
    /// ATs since the start.
    pub at: u32,
}

/// What only one kind of bus has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusDetail {
    /// Nothing more is known.
    None,
    /// A SERCOS network.
    Sercos {
        /// What the network is, from the master's ports.
        topology: Topology,
        /// Telegrams that port 1 and port 2 have lost.
        lost: [PortLosses; 2],
    },
    /// A bus on CAN: how many bits its frames have occupied it for since the start, with all stuff bits that they can have.
    Can {
        /// Bits at the nominal rate.
        nominal: u64,
        /// Bits at the data rate of CAN FD.
        data: u64,
    },
}

impl BusDetail {
    /// Kind, topology, and two words.
    fn to_words(self) -> (u8, u8, [u64; 2]) {
        match self {
            Self::None => (kind::NONE, 0, [0; 2]),
            Self::Sercos { topology, lost } => {
                let code = (0..).zip(Topology::ALL).find(|(_, known)| *known == topology);
                let words = lost.map(|port| pair(port.mdt, port.at));
                (kind::SERCOS, code.map_or(0, |(code, _)| code), words)
            }
            Self::Can { nominal, data } => (kind::CAN, 0, [nominal, data]),
        }
    }

    fn from_words(kind: u8, topology: u8, words: [u64; 2]) -> Self {
        match kind {
            kind::SERCOS => Self::Sercos {
                topology: Topology::ALL.get(usize::from(topology)).copied().unwrap_or_default(),
                lost: words.map(|word| {
                    let (mdt, at) = split(word);
                    PortLosses { mdt, at }
                }),
            },
            kind::CAN => Self::Can { nominal: words[0], data: words[1] },
            _ => Self::None,
        }
    }
}

/// The state of one bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusStatus {
    /// Every drive that answers is in cyclic operation.
    pub up: bool,
    /// SERCOS communication phase 0 to 4, or [`PHASE_NONE`].
    pub phase: u8,
    /// Its cycle, ns.
    pub cycle_time_ns: u32,
    /// Cycles since the start.
    pub cycles: u64,
    /// Cyclic telegrams that were not received in time, since the start.
    pub lost_telegrams: u64,
    /// Frames that were received and refused, since the start.
    pub refused_frames: u64,
    /// How its cycles follow system time.
    pub phase_lock: Phase,
    /// What only its kind has.
    pub detail: BusDetail,
}

impl BusStatus {
    /// No bus.
    pub const NONE: Self = Self {
        up: false,
        phase: PHASE_NONE,
        cycle_time_ns: 0,
        cycles: 0,
        lost_telegrams: 0,
        refused_frames: 0,
        phase_lock: Phase { state: LockState::Free, error: DurationNs(0) },
        detail: BusDetail::None,
    };

    pub(super) fn to_words(self) -> [u64; BUS_WORDS] {
        let [a, b, c, d] = self.cycle_time_ns.to_be_bytes();
        let (kind, topology, [first, second]) = self.detail.to_words();
        let lock = self.phase_lock.state.code();
        let head = [u8::from(self.up) | lock << 1, self.phase, kind, topology, a, b, c, d];
        [
            u64::from_be_bytes(head),
            self.cycles,
            self.lost_telegrams,
            self.refused_frames,
            self.phase_lock.error.0.cast_unsigned(),
            first,
            second,
        ]
    }

    pub(super) fn from_words(words: &[u64; BUS_WORDS]) -> Self {
        let [head, cycles, lost_telegrams, refused_frames, error, detail @ ..] = *words;
        let [flags, phase, kind, topology, a, b, c, d] = head.to_be_bytes();
        let lock = LockState::ALL.get(usize::from(flags >> 1)).copied().unwrap_or_default();
        Self {
            up: flags & 1 != 0,
            phase,
            cycle_time_ns: u32::from_be_bytes([a, b, c, d]),
            cycles,
            lost_telegrams,
            refused_frames,
            phase_lock: Phase { state: lock, error: DurationNs(error.cast_signed()) },
            detail: BusDetail::from_words(kind, topology, detail),
        }
    }
}
