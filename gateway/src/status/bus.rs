//! The published state of one bus.

use super::PHASE_NONE;

/// Buses of one gateway: the SERCOS bus, four CANopen buses, four DeviceNet networks.
pub const BUSES_MAX: usize = 9;

/// Words of one bus in the published form.
pub(super) const BUS_WORDS: usize = 4;

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
    };

    pub(super) fn to_words(self) -> [u64; BUS_WORDS] {
        let [a, b, c, d] = self.cycle_time_ns.to_be_bytes();
        let head = u64::from_be_bytes([u8::from(self.up), self.phase, 0, 0, a, b, c, d]);
        [head, self.cycles, self.lost_telegrams, self.refused_frames]
    }

    pub(super) fn from_words(words: &[u64; BUS_WORDS]) -> Self {
        let [head, cycles, lost_telegrams, refused_frames] = *words;
        let [up, phase, _, _, a, b, c, d] = head.to_be_bytes();
        Self {
            up: up != 0,
            phase,
            cycle_time_ns: u32::from_be_bytes([a, b, c, d]),
            cycles,
            lost_telegrams,
            refused_frames,
        }
    }
}
