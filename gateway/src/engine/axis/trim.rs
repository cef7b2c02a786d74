//! Trims: what is added to the set-points, from the update to the drive.
//!
//! The trim of the axis's own mode goes into its set-point ahead of every limit, the interpolator and the loss of updates. The
//! others are for the loops inside of the drive and go to it beside the set-point, as they came. Nothing here outlives the
//! set-points it came with: a trim counts while they lead the axis, and is zero otherwise.

use crate::mapping::DriveProgram;
use profile_generic::image::{AxisCommand, CommandSet, Signal};
use profile_generic::mode::ModeSelection;

/// What is added in this cycle.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trims {
    /// With the newest set-points, in the order of [`Signal::OFFSETS`].
    taken: [i64; Signal::OFFSETS.len()],
    /// The part of them that counts.
    applied: [i64; Signal::OFFSETS.len()],
}

impl Trims {
    /// Takes the trims of an update and puts the one of its mode into the set-point. Returns whether another position is added
    /// now than before, or `None` when a sum does not fit. Before an update that begins a motion there was none.
    pub fn take(&mut self, fresh: &mut AxisCommand, begins: bool) -> Option<bool> {
        let taken = Signal::OFFSETS.map(|signal| fresh.get(signal).unwrap_or(0));
        let before = std::mem::replace(&mut self.taken, taken);
        let before = if begins { 0 } else { before[0] };
        fresh.add_own_offset().then_some(taken[0] != before)
    }

    /// Puts the trims of this cycle into the command; `lead` is whether set-points lead the axis. An offset goes to a drive
    /// that adds it both in the mode that it is told and in the one that it shows: between two modes none counts twice.
    pub fn write(
        &mut self,
        command: &mut AxisCommand,
        shown: ModeSelection,
        program: Option<&DriveProgram>,
        lead: bool,
    ) {
        let told = command.selection();
        let own = Signal::leading(told.mode).and_then(|(_, offset)| offset).filter(|_| lead);
        let adds = match program {
            Some(program) if lead => program.carries(told) & program.carries(shown),
            _ => CommandSet::empty(),
        };
        for (at, signal) in Signal::OFFSETS.into_iter().enumerate() {
            let sent = own != Some(signal) && adds.contains(signal.command_bit());
            let trim = self.taken[at];
            self.applied[at] = if sent || own == Some(signal) { trim } else { 0 };
            command.set(signal, if sent { trim } else { 0 });
        }
    }

    /// The trim of a signal as it counts; `None` for one that is none.
    pub fn applied(&self, signal: Signal) -> Option<i64> {
        let at = Signal::OFFSETS.iter().position(|offset| *offset == signal)?;
        Some(self.applied[at])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::mode::OperatingMode;
    use profile_generic::quantity::{Position, Velocity};

    fn fresh(position: i64, offset: i64, velocity_offset: i64) -> AxisCommand {
        let mut command = AxisCommand { mode: OperatingMode::Position, ..AxisCommand::default() };
        command.set(Signal::PositionCommand, position);
        command.set(Signal::PositionOffset, offset);
        command.set(Signal::VelocityOffset, velocity_offset);
        command
    }

    #[test]
    fn the_trim_of_the_own_mode_goes_into_the_set_point_and_a_changed_one_is_told() {
        let mut trims = Trims::default();
        let mut command = fresh(100, 7, 3);
        assert_eq!(trims.take(&mut command, true), Some(true), "there was none before it");
        assert_eq!(command.position, Position(107));
        assert_eq!(trims.take(&mut fresh(100, 7, 4), false), Some(false));
        assert_eq!(trims.take(&mut fresh(100, 8, 4), false), Some(true));
        assert_eq!(trims.take(&mut fresh(i64::MAX, 1, 0), false), None, "a sum that does not fit");
    }

    #[test]
    fn a_trim_counts_while_set_points_lead_and_is_sent_only_to_a_drive_that_adds_it() {
        let mut trims = Trims::default();
        let mut command = fresh(100, 7, 3);
        trims.take(&mut command, true);
        let shown = command.selection();
        trims.write(&mut command, shown, None, true);
        let counts = [Signal::PositionOffset, Signal::VelocityOffset, Signal::PositionCommand]
            .map(|signal| trims.applied(signal));
        assert_eq!(counts, [Some(7), Some(0), None]);
        assert_eq!((command.position_offset, command.velocity_offset), (Position::ZERO, Velocity::ZERO));
        trims.write(&mut command, shown, None, false);
        assert_eq!(trims.applied(Signal::PositionOffset), Some(0));
    }
}
