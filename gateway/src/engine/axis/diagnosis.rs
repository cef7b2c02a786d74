//! What the drive says is wrong with it: its diagnostic words, read over the service channel.
//!
//! The status word of the telegram shows only that there is an error (class 1) or a warning (class 2). The words with the
//! bits are read when one of them shows, and again and again while it does, because another one may join it. Words
//! that tell of errors come first; a word is asked for only when the one before it was answered.

use arrayvec::ArrayVec;
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::fault_set::{FAULT_SET_MAX, Origin};
use profile_generic::image::StatusBits;
use profile_generic::state::Report;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use crate::mapping::Item;

use super::diagnostic_message::Reading;
use super::{AxisChannel, caused_by_controller};

/// How long the words of a drive with a fault are read without a pause for its cause.
pub(super) const CAUSE_TIME_OUT: DurationNs = DurationNs::from_millis(500);

/// How often the words are read while the drive shows an error or a warning.
const REREAD: DurationNs = DurationNs::from_millis(250);

/// An answer that has not come after this is not waited for any longer: the drive may have been lost meanwhile.
pub(super) const ANSWER_TIME_OUT: DurationNs = DurationNs::from_secs(2);

/// Where the reading stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Diagnosis {
    /// The word under way.
    asked: Option<(Item, bool, MonotonicTime)>,
    /// Place of the next word with errors, and when it may be read.
    errors: Round,
    /// Place of the next word with warnings, and when it may be read.
    warnings: Round,
    /// A word with warnings has shown one in this round.
    warning_found: bool,
}

/// Words read one after the other, from the first to the last, then again after a pause.
#[derive(Debug, Clone, Copy, Default)]
struct Round {
    place: usize,
    not_before: MonotonicTime,
}

impl AxisChannel {
    pub(super) fn shows_error(&self) -> bool {
        matches!(self.feedback.report, Report::Faulted | Report::FaultReaction)
    }

    pub(super) fn shows_warning(&self) -> bool {
        self.feedback.status.contains(StatusBits::WARNING)
    }

    /// The diagnostic word that should be read now.
    #[must_use]
    pub fn wants_word(&self, now: MonotonicTime) -> Option<Item> {
        let (program, _) = self.south.as_ref()?;
        if self.diagnosis.asked.is_some_and(|(.., since)| now.since(since) < ANSWER_TIME_OUT) {
            return None;
        }
        let due = |round: &Round| now >= round.not_before;
        if self.shows_error() && due(&self.diagnosis.errors) {
            return program.diagnostic_words(true).nth(self.diagnosis.errors.place);
        }
        if self.shows_warning() && due(&self.diagnosis.warnings) {
            return program.diagnostic_words(false).nth(self.diagnosis.warnings.place);
        }
        None
    }

    /// The word that was wanted is on its way.
    pub fn word_asked(&mut self, now: MonotonicTime, item: Item) {
        let errors = self.shows_error() && now >= self.diagnosis.errors.not_before;
        self.diagnosis.asked = Some((item, errors, now));
    }

    /// A diagnostic word of the drive has been read, or could not be.
    pub fn diagnostic_word(&mut self, now: MonotonicTime, system: SystemTime, item: Item, word: Option<u32>) {
        let Some((_, errors, _)) = self.diagnosis.asked.take_if(|(asked, ..)| *asked == item) else { return };
        let mut shown: ArrayVec<(FaultCause, Reaction), FAULT_SET_MAX> = ArrayVec::new();
        let mut last = true;
        if let Some((program, _)) = &self.south {
            let of = |(_, reaction): &(FaultCause, Reaction)| reaction.stops() == errors;
            shown.extend(program.faults(item, word.unwrap_or(0)).filter(of).take(FAULT_SET_MAX));
            let round = if errors { &self.diagnosis.errors } else { &self.diagnosis.warnings };
            last = program.diagnostic_words(errors).nth(round.place + 1).is_none();
        }
        let word = word.unwrap_or(0);
        if errors {
            self.errors_shown(now, system, word, &shown, last);
        } else {
            self.warnings_shown(now, system, word, &shown, last);
        }
    }

    /// The first word that names a cause ends the round: those after it are for drives that say nothing better.
    fn errors_shown(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        word: u32,
        shown: &[(FaultCause, Reaction)],
        last: bool,
    ) {
        let found = !shown.is_empty();
        let round = &mut self.diagnosis.errors;
        let searching = self.cause_wanted.is_some();
        *round = match (found || last, found || !searching) {
            (false, _) => Round { place: round.place + 1, ..*round },
            (true, true) => Round { place: 0, not_before: now + REREAD },
            // A drive may show the error a moment before its word.
            (true, false) => Round { place: 0, not_before: now },
        };
        if !found || !self.shows_error() {
            return;
        }
        self.faults.clear_all(Origin::Drive, |cause| shown.iter().any(|(known, _)| *known == cause));
        for (cause, reaction) in shown {
            self.drive_fault(now, system, *cause, *reaction, word);
        }
    }

    /// The drive shows an error, and nothing is known of it yet: the axis stops for it, and the controller is told.
    pub(super) fn undiagnosed_fault(&mut self, now: MonotonicTime, system: SystemTime) {
        let cause = FaultCause::DRIVE_SPECIFIC;
        self.drive_fault(now, system, cause, cause.default_reaction(), 0);
        self.cause_wanted = Some(now);
    }

    /// The cause of an error of the drive is known, or is not known yet.
    pub(super) fn drive_fault(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        cause: FaultCause,
        reaction: Reaction,
        word: u32,
    ) {
        let refines = self.cause_wanted.take().is_some();
        let fault = Fault::new(cause, system).with_reaction(reaction).with_vendor_code(word);
        let new = self.faults.raise(fault, Origin::Drive);
        if new {
            self.diagnostic_message.want();
        }
        // While a reset is under way the drive may still show what is being reset; what stands is found after it.
        let resetting = self.reset.is_some_and(|reset| reset.begun);
        if resetting {
            return;
        }
        let undiagnosed = |known: &Fault| refines && known.cause == FaultCause::DRIVE_SPECIFIC;
        if let Some(known) = self.fault.filter(undiagnosed) {
            // It came when the drive first showed it.
            self.fault = Some(Fault { at: known.at, ..fault });
        }
        if new || self.fault.is_none_or(|known| caused_by_controller(known.cause)) {
            self.take_fault(now, system, fault);
        }
    }

    fn warnings_shown(
        &mut self,
        now: MonotonicTime,
        system: SystemTime,
        word: u32,
        shown: &[(FaultCause, Reaction)],
        last: bool,
    ) {
        let round = &mut self.diagnosis.warnings;
        let first = round.place == 0;
        *round = match last {
            false => Round { place: round.place + 1, ..*round },
            true => Round { place: 0, not_before: now + REREAD },
        };
        if !self.shows_warning() {
            return;
        }
        if first {
            self.diagnosis.warning_found = false;
            let here = |cause: FaultCause| shown.iter().any(|(known, _)| *known == cause);
            self.faults.clear_all(Origin::Warning, here);
        }
        self.diagnosis.warning_found |= !shown.is_empty();
        for (cause, reaction) in shown {
            let fault = Fault::new(*cause, system).with_reaction(*reaction).with_vendor_code(word);
            self.warn(fault);
        }
        if last && !self.diagnosis.warning_found {
            // It warns, and no row of the tables says of what.
            self.warn(Fault::new(FaultCause::DRIVE_WARNING, system).with_vendor_code(word));
        }
    }

    fn warn(&mut self, warning: Fault) {
        if self.faults.raise(warning, Origin::Warning) {
            self.diagnostic_message.want();
        }
    }

    /// What the drive no longer shows is gone.
    pub(super) fn end_drive_faults(&mut self) {
        if !self.shows_error() && !self.shows_warning() {
            self.end_diagnostic_message();
        }
        if !self.shows_error() {
            self.faults.clear_all(Origin::Drive, |_| false);
            self.diagnosis.errors = Round::default();
        }
        if !self.shows_warning() {
            self.faults.clear_all(Origin::Warning, |_| false);
            self.diagnosis.warnings = Round::default();
        }
    }

    /// The drive is gone, and with it what it was asked.
    pub(super) fn end_diagnosis(&mut self) {
        self.diagnosis = Diagnosis::default();
        self.diagnostic_message = Reading::default();
        self.cause_wanted = None;
        self.faults.clear_all(Origin::Drive, |_| false);
        self.faults.clear_all(Origin::Warning, |_| false);
    }
}
