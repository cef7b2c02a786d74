//! What the drive says is wrong with it: its diagnostic words, read over the service channel.
//!
//! The status word of the telegram shows only that there is an error (class 1) or a warning (class 2). The words with the
//! bits are read when one of them shows, and again and again while it does, because another one may join it. Words
//! that report errors come first; a word is asked for only when the one before it was answered.

use arrayvec::ArrayVec;
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::fault_set::FAULT_SET_MAX;
use profile_generic::image::{AxisFeedback, StatusBits};
use profile_generic::state::Report;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::mapping::{DriveProgram, Item};

use super::diagnostic_message::Reading;

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
    /// The drive shows a fault whose cause is being read since then.
    cause_wanted: Option<MonotonicTime>,
    pub message: Reading,
}

/// Words read one after the other, from the first to the last, then again after a pause.
#[derive(Debug, Clone, Copy, Default)]
struct Round {
    place: usize,
    not_before: MonotonicTime,
}

/// What the status word of a drive shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shows {
    pub error: bool,
    pub warning: bool,
}

impl Shows {
    pub fn of(feedback: &AxisFeedback) -> Self {
        Self {
            error: matches!(feedback.report, Report::Faulted | Report::FaultReaction),
            warning: feedback.status.contains(StatusBits::WARNING),
        }
    }

    /// Whether it shows anything.
    pub fn any(self) -> bool {
        self.error || self.warning
    }
}

/// What a word has shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Shown {
    /// Its bits.
    pub word: u32,
    /// What they say.
    pub causes: ArrayVec<(FaultCause, Reaction), FAULT_SET_MAX>,
    /// Of which kind they are.
    pub kind: Kind,
}

/// Errors or warnings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The drive has these errors and, in this word, no others.
    Errors,
    /// The drive warns.
    Warnings {
        /// The first word of a round: warnings that it does not show are over.
        first: bool,
        /// The last word of a round in which none has named a warning.
        nameless: bool,
    },
}

impl Diagnosis {
    /// The diagnostic word that should be read now.
    pub fn wanted(&self, now: MonotonicTime, program: &DriveProgram, shows: Shows) -> Option<Item> {
        if self.asked.is_some_and(|(.., since)| now.since(since) < ANSWER_TIME_OUT) {
            return None;
        }
        let due = |round: &Round| now >= round.not_before;
        if shows.error && due(&self.errors) {
            return program.diagnostic_words(true).nth(self.errors.place);
        }
        if shows.warning && due(&self.warnings) {
            return program.diagnostic_words(false).nth(self.warnings.place);
        }
        None
    }

    /// The word that was wanted is on its way.
    pub fn ask(&mut self, now: MonotonicTime, item: Item, shows: Shows) {
        let errors = shows.error && now >= self.errors.not_before;
        self.asked = Some((item, errors, now));
    }

    /// A word has been read, or could not be; `None` when nothing follows from it.
    pub fn take(
        &mut self,
        now: MonotonicTime,
        item: Item,
        word: Option<u32>,
        program: Option<&DriveProgram>,
        shows: Shows,
    ) -> Option<Shown> {
        let (_, errors, _) = self.asked.take_if(|(asked, ..)| *asked == item)?;
        let word = word.unwrap_or(0);
        let mut causes = ArrayVec::new();
        let mut last = true;
        if let Some(program) = program {
            let of = |(_, reaction): &(FaultCause, Reaction)| reaction.stops() == errors;
            causes.extend(program.faults(item, word).filter(of).take(FAULT_SET_MAX));
            let round = if errors { &self.errors } else { &self.warnings };
            last = program.diagnostic_words(errors).nth(round.place + 1).is_none();
        }
        let kind = if errors {
            self.go_on_with_errors(now, !causes.is_empty(), last, shows)?
        } else {
            self.go_on_with_warnings(now, !causes.is_empty(), last, shows)?
        };
        Some(Shown { word, causes, kind })
    }

    /// The first word that names a cause ends the round: those after it are for drives that say nothing better.
    fn go_on_with_errors(
        &mut self,
        now: MonotonicTime,
        found: bool,
        last: bool,
        shows: Shows,
    ) -> Option<Kind> {
        let searching = self.is_searching();
        let round = &mut self.errors;
        *round = match (found || last, found || !searching) {
            (false, _) => Round { place: round.place + 1, ..*round },
            (true, true) => Round { place: 0, not_before: now + REREAD },
            // A drive may show the error a moment before its word.
            (true, false) => Round { place: 0, not_before: now },
        };
        (found && shows.error).then_some(Kind::Errors)
    }

    fn go_on_with_warnings(
        &mut self,
        now: MonotonicTime,
        found: bool,
        last: bool,
        shows: Shows,
    ) -> Option<Kind> {
        let round = &mut self.warnings;
        let first = round.place == 0;
        *round = match last {
            false => Round { place: round.place + 1, ..*round },
            true => Round { place: 0, not_before: now + REREAD },
        };
        if !shows.warning {
            return None;
        }
        self.warning_found = found || self.warning_found && !first;
        Some(Kind::Warnings { first, nameless: last && !self.warning_found })
    }

    /// The cause of an error is wanted from now on.
    pub fn want_cause(&mut self, now: MonotonicTime) {
        self.cause_wanted = Some(now);
    }

    /// Whether the cause of an error is still sought.
    pub fn is_searching(&self) -> bool {
        self.cause_wanted.is_some()
    }

    /// The cause is known, or is wanted no longer; whether it was.
    pub fn end_search(&mut self) -> bool {
        self.cause_wanted.take().is_some()
    }

    /// Time passes. Nothing but how often its words are read depends on how long the cause is sought.
    pub fn tick(&mut self, now: MonotonicTime) {
        self.cause_wanted.take_if(|since| now.since(*since) > CAUSE_TIME_OUT);
    }

    /// Ends what the drive no longer shows.
    pub fn follow(&mut self, shows: Shows) {
        if !shows.any() {
            self.message.end();
        }
        if !shows.error {
            self.errors = Round::default();
        }
        if !shows.warning {
            self.warnings = Round::default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: MonotonicTime = MonotonicTime(9_000_000_000);
    const ERROR: Shows = Shows { error: true, warning: false };
    const WARNING: Shows = Shows { error: false, warning: true };

    fn item() -> Item {
        Item::object(0x603F, 0)
    }

    #[test]
    fn only_the_word_that_was_asked_for_counts_and_only_once() {
        let mut diagnosis = Diagnosis::default();
        assert_eq!(diagnosis.take(NOW, item(), Some(1), None, WARNING), None, "nobody asked");
        diagnosis.ask(NOW, item(), WARNING);
        assert_eq!(diagnosis.take(NOW, Item::object(0x1001, 0), Some(1), None, WARNING), None);
        let shown = diagnosis.take(NOW, item(), Some(1), None, WARNING).expect("a warning");
        assert_eq!((shown.word, shown.kind), (1, Kind::Warnings { first: true, nameless: true }));
        assert_eq!(diagnosis.take(NOW, item(), Some(1), None, WARNING), None);
    }

    #[test]
    fn a_word_without_a_cause_is_read_again_at_once_while_the_cause_is_sought() {
        let mut diagnosis = Diagnosis::default();
        diagnosis.want_cause(NOW);
        diagnosis.ask(NOW, item(), ERROR);
        assert_eq!(diagnosis.take(NOW, item(), Some(0), None, ERROR), None);
        assert_eq!(diagnosis.errors.not_before, NOW);
        diagnosis.tick(NOW + CAUSE_TIME_OUT);
        assert!(diagnosis.cause_wanted.is_some());
        diagnosis.tick(NOW + CAUSE_TIME_OUT + DurationNs(1));
        assert!(!diagnosis.end_search());
        diagnosis.ask(NOW, item(), ERROR);
        diagnosis.take(NOW, item(), Some(0), None, ERROR);
        assert_eq!(diagnosis.errors.not_before, NOW + REREAD);
        diagnosis.follow(WARNING);
        assert_eq!(diagnosis.errors.not_before, MonotonicTime::default(), "the next error is read at once");
    }
}
