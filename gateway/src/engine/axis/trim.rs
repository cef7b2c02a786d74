//! Trims: what is added to the set-points, from the update to the drive.
//!
//! The trim of the axis's own mode goes into its set-point ahead of every limit, the interpolator and the loss of updates. The
//! others are for the loops inside of the drive and go to it beside the set-point, as they came. Nothing here outlives the
//! set-points it came with: a trim counts while they lead the axis, and is zero otherwise.

use super::AxisChannel;
use profile_generic::image::{AxisCommand, CommandSet, Signal};

/// What is added in this cycle.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trims {
    /// With the newest set-points, in the order of [`Signal::OFFSETS`].
    taken: [i64; Signal::OFFSETS.len()],
    /// The part of them that counts.
    applied: [i64; Signal::OFFSETS.len()],
}

impl AxisChannel {
    /// Takes the trims of an update and puts the one of its mode into the set-point. Returns whether another position is added
    /// now than before, or `None` when a sum does not fit. Before an update that begins a motion there was none.
    pub(super) fn take_trims(&mut self, fresh: &mut AxisCommand, begins: bool) -> Option<bool> {
        let taken = Signal::OFFSETS.map(|signal| fresh.get(signal).unwrap_or(0));
        let before = std::mem::replace(&mut self.trims.taken, taken);
        let before = if begins { 0 } else { before[0] };
        fresh.add_own_offset().then_some(taken[0] != before)
    }

    /// Puts the trims of this cycle into the command; `lead` is whether set-points lead the axis. An offset goes to a drive
    /// that adds it both in the mode that it is told and in the one that it shows: between two modes none counts twice.
    pub(super) fn write_trims(&mut self, lead: bool) {
        let (told, shown) = (self.command.selection(), self.feedback.selection());
        let own = Signal::leading(told.mode).map(|(_, offset)| offset).filter(|_| lead);
        let adds = match self.south() {
            Some(program) if lead => program.carries(told) & program.carries(shown),
            _ => CommandSet::empty(),
        };
        for (at, signal) in Signal::OFFSETS.into_iter().enumerate() {
            let sent = own != Some(signal) && adds.contains(signal.command_bit());
            let trim = self.trims.taken[at];
            self.trims.applied[at] = if sent || own == Some(signal) { trim } else { 0 };
            self.command.set(signal, if sent { trim } else { 0 });
        }
    }

    /// The value of a signal: set-points as the drive got them last, trims as they count.
    #[must_use]
    pub fn signal(&self, signal: Signal) -> Option<i64> {
        match Signal::OFFSETS.iter().position(|offset| *offset == signal) {
            Some(at) => Some(self.trims.applied[at]),
            None if signal.is_command() => self.command.get(signal),
            None => self.feedback.get(signal),
        }
    }
}
