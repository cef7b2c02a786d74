//! The axis and the telegrams of its drive: the program that makes them, and the words that went and came last.

use std::sync::Arc;

use profile_generic::image::{AxisCommand, AxisFeedback, StatusBits};
use profile_generic::mode::ModeSelection;
use profile_generic::program::ConversionReport;
use profile_generic::state::{Action, DriveState, Report};
use profile_generic::time::MonotonicTime;

use super::handshake::Handshake;
use super::{MODE_TIME_OUT, RESET_CYCLES};
use crate::mapping::{CachedStatus, DriveProgram, Order};

/// The way to the drive of one axis, and back.
#[derive(Debug, Default)]
pub(super) struct Link {
    south: Option<(Arc<DriveProgram>, CachedStatus)>,
    /// Counts the programs of the drive that were taken or given up.
    programs: u64,
    /// What was sent last, and what the drive showed last: words, and operating modes above them.
    control: u32,
    status: u32,
    /// Cycles for which a fault reset still stands in the control word.
    reset_cycles: u8,
    handshake: Handshake,
    /// Since when the drive is told the operating mode that it is told now.
    told_since: MonotonicTime,
    /// The operation mode that the drive shows, and whether it follows command values, whatever it carries out.
    shown: Option<ModeSelection>,
    follows: bool,
    /// Cycles without a fresh value from the drive.
    pub lost_telegrams: u32,
    /// Values that were clamped on the way from and to the drive.
    pub saturated: u32,
}

impl Link {
    /// The program of the drive, once it is commissioned.
    pub fn program(&self) -> Option<&DriveProgram> {
        self.south.as_ref().map(|(program, _)| &**program)
    }

    /// The same, to be kept.
    pub fn shared_program(&self) -> Option<Arc<DriveProgram>> {
        self.south.as_ref().map(|(program, _)| Arc::clone(program))
    }

    /// A number that is another one after the drive has got another program or is gone.
    pub fn programs(&self) -> u64 {
        self.programs
    }

    /// The status word.
    pub fn status(&self) -> u32 {
        self.status
    }

    /// The operation mode that the drive shows.
    pub fn shown(&self) -> Option<ModeSelection> {
        self.shown
    }

    /// Whether the drive follows command values.
    pub fn follows(&self) -> bool {
        self.follows
    }

    /// The drive is spoken to by this program from now on.
    pub fn connect(&mut self, program: Arc<DriveProgram>) {
        let cached = program.cached_status();
        self.south = Some((program, cached));
        self.programs += 1;
        (self.control, self.status, self.reset_cycles) = (0, 0, 0);
    }

    /// There is nobody to speak to.
    pub fn disconnect(&mut self) {
        self.south = None;
        self.programs += 1;
        (self.shown, self.follows) = (None, false);
    }

    /// The drive has given its place another position: it is what the drive says, not so many turns more.
    pub fn restart_position(&mut self) {
        if let Some((_, cached)) = &mut self.south {
            cached.restart();
        }
    }

    /// A fault reset stands in the control word of the next cycles.
    pub fn pulse_reset(&mut self) {
        self.reset_cycles = RESET_CYCLES;
    }

    /// Reads a telegram; `false`, and nothing done, for one that is no telegram of this drive. `led` is whether a procedure of the drive
    /// moves the axis, `command` what it was told last.
    pub fn decode(
        &mut self,
        data: &[u8],
        led: bool,
        command: &AxisCommand,
        feedback: &mut AxisFeedback,
    ) -> bool {
        let Some((program, cached)) = self.south.as_mut() else { return false };
        let mut conversions = ConversionReport::default();
        let Some(status) = program.decode(data, led, feedback, cached, &mut conversions) else {
            return false;
        };
        self.status = status;
        self.shown = program.mode(status);
        self.follows = program.report(status) == Report::Operating;
        if program.handshake(command.selection()).is_some() && !self.handshake.is_done(command) {
            // It has come to the target of before.
            feedback.status.remove(StatusBits::TARGET_REACHED);
        }
        self.saturated = self.saturated.saturating_add(conversions.saturated);
        true
    }

    /// What the drive reports: in operation it may take a moment to change the operating mode, and follows again then.
    pub fn report(&self, now: MonotonicTime, report: Report, state: DriveState) -> Report {
        let changes = report == Report::Enabling
            && now.since(self.told_since) <= MODE_TIME_OUT
            && state == DriveState::Operating
            && self.program().is_some_and(|program| program.mode_octet(self.status).is_some());
        if changes { Report::Operating } else { report }
    }

    /// Goes on with handing the target over, where the drive takes it over step by step. `leads` is whether the command leads the
    /// drive, `wanted` whether it has a target. Returns `false` when the drive has taken too long.
    pub fn hand_over(
        &mut self,
        now: MonotonicTime,
        command: &AxisCommand,
        leads: bool,
        wanted: bool,
    ) -> bool {
        let (selection, status) = (command.selection(), self.status);
        let program = self.program().filter(|program| leads && program.shows(selection, status));
        let answers = program
            .and_then(|program| program.handshake(selection))
            .map(|handshake| handshake.taken.matches(status));
        self.handshake.advance(now, answers, wanted.then_some(command))
    }

    /// The action that goes into the control word of this telegram: a fault reset is a pulse of a few of them.
    pub fn pulsed(&mut self, action: Action) -> Action {
        let pulses = action == Action::TorqueOff && self.reset_cycles > 0;
        self.reset_cycles = self.reset_cycles.saturating_sub(1);
        if pulses { Action::ResetFault } else { action }
    }

    /// Fills a telegram by the program, if there is one; returns how many values were clamped. `order` has what a procedure asks.
    pub fn encode(
        &mut self,
        now: MonotonicTime,
        command: &AxisCommand,
        order: Order,
        telegram: &mut [u8],
    ) -> u32 {
        let Some((program, _)) = self.south.as_ref() else { return 0 };
        let mut conversions = ConversionReport::default();
        let order = Order { asks: order.asks || self.handshake.is_requested(), ..order };
        let command = self.handshake.apply(command);
        let control = program.encode(&command, order, self.control, self.status, telegram, &mut conversions);
        if program.mode_octet(control) != program.mode_octet(self.control) {
            self.told_since = now;
        }
        self.control = control;
        self.saturated = self.saturated.saturating_add(conversions.saturated);
        conversions.saturated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_reset_stands_in_a_few_telegrams_and_only_beside_torque_off() {
        let mut link = Link::default();
        assert_eq!(link.pulsed(Action::TorqueOff), Action::TorqueOff);
        link.pulse_reset();
        assert_eq!(link.pulsed(Action::Enable), Action::Enable, "a drive in operation is not reset");
        let sent: Vec<_> = (0..RESET_CYCLES).map(|_| link.pulsed(Action::TorqueOff)).collect();
        let pulses = sent.iter().filter(|action| **action == Action::ResetFault).count();
        assert_eq!((pulses, sent.last()), (usize::from(RESET_CYCLES) - 1, Some(&Action::TorqueOff)));
    }

    #[test]
    fn without_a_program_nothing_is_read_or_written_and_the_number_of_programs_counts() {
        let mut link = Link::default();
        let (mut feedback, mut telegram) = (AxisFeedback::default(), [0xA5; 4]);
        assert!(!link.decode(&telegram, false, &AxisCommand::default(), &mut feedback));
        let order = Order { action: Action::Enable, told: None, asks: false };
        assert_eq!(link.encode(MonotonicTime(1), &AxisCommand::default(), order, &mut telegram), 0);
        assert_eq!((telegram, feedback), ([0xA5; 4], AxisFeedback::default()));
        link.disconnect();
        assert_eq!((link.programs(), link.shown(), link.follows()), (1, None, false));
        assert!(link.hand_over(MonotonicTime(1), &AxisCommand::default(), true, true), "nobody is asked");
    }
}
