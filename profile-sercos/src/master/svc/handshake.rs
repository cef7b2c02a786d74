//! The handshake of one service channel: a step goes out with the bit MHS toggled, and the slave answers with AHS equal to it.

use profile_generic::time::MonotonicTime;

use super::SvcLimits;
use super::request::SvcFailure;
use super::transfer::Step;
use crate::wire::svc::{AtSvc, Element, MdtSvc, SvcControl, SvcStatus};
use crate::wire::svc_error::SvcError;

/// What a slave's answer in this cycle says about the step on the wire.
pub(super) enum Answer {
    /// The slave is through: its info, or an error code.
    Through(Result<u32, SvcError>),
    Busy,
    Missing,
}

/// The step on the wire, and how long its answer is missing.
#[derive(Debug, Default)]
pub(super) struct Handshake {
    sent: MdtSvc,
    missing_cycles: u16,
    busy_since: Option<MonotonicTime>,
}

impl Handshake {
    /// The six bytes for the next MDT.
    pub fn outgoing(&self) -> MdtSvc {
        self.sent
    }

    /// The handshake bit on the wire.
    pub fn mhs(&self) -> bool {
        self.sent.control.mhs()
    }

    /// Sets the word to the given handshake bit and nothing else.
    pub fn rest(&mut self, mhs: bool) {
        self.sent = MdtSvc { control: SvcControl::new(mhs, Element::Close, false, false), info: 0 };
    }

    /// Toggles the handshake bit with the next step.
    pub fn put(&mut self, step: Step) {
        let control = SvcControl::new(!self.mhs(), step.element, step.write, step.last);
        self.sent = MdtSvc { control, info: step.info };
    }

    /// What the AT of this cycle says, `None` when it did not come.
    pub fn judge(&self, answer: Option<AtSvc>) -> Answer {
        let Some(answer) = answer else {
            return Answer::Missing;
        };
        let handshake = answer.status.contains(SvcStatus::AHS) == self.mhs();
        if !handshake || !answer.status.contains(SvcStatus::VALID) {
            Answer::Missing
        } else if answer.status.contains(SvcStatus::BUSY) {
            Answer::Busy
        } else if answer.status.contains(SvcStatus::ERROR) {
            Answer::Through(Err(SvcError(answer.info_word())))
        } else {
            Answer::Through(Ok(answer.info))
        }
    }

    /// Nothing is awaited any more.
    pub fn clear(&mut self) {
        self.missing_cycles = 0;
        self.busy_since = None;
    }

    /// Counts a cycle without the answer to a step; why the request ends, when that was one too many.
    pub fn wait(&mut self, now: MonotonicTime, busy: bool, limits: &SvcLimits) -> Option<SvcFailure> {
        if busy {
            self.missing_cycles = 0;
            let since = *self.busy_since.get_or_insert(now);
            let milliseconds = limits.busy_timeout.as_nanos() / 1_000_000;
            let milliseconds = u32::try_from(milliseconds).unwrap_or(u32::MAX);
            return (now - since >= limits.busy_timeout).then_some(SvcFailure::BusyTimeout { milliseconds });
        }
        self.missing_cycles = self.missing_cycles.saturating_add(1);
        let cycles = self.missing_cycles;
        (cycles >= limits.handshake_cycles).then_some(SvcFailure::HandshakeTimeout { cycles })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::time::DurationNs;

    #[test]
    fn silence_is_counted_in_cycles_and_busy_in_time() {
        let limits = SvcLimits {
            handshake_cycles: 3,
            busy_timeout: DurationNs::from_millis(5),
            ..SvcLimits::default()
        };
        let at = |millis| MonotonicTime::ZERO + DurationNs::from_millis(millis);
        let mut handshake = Handshake::default();
        let silent = |handshake: &mut Handshake| handshake.wait(at(0), false, &limits);
        assert_eq!([silent(&mut handshake), silent(&mut handshake)], [None, None]);
        assert_eq!(handshake.wait(at(1), true, &limits), None, "busy ends the silence");
        assert_eq!([silent(&mut handshake), silent(&mut handshake)], [None, None]);
        assert_eq!(silent(&mut handshake), Some(SvcFailure::HandshakeTimeout { cycles: 3 }));
        assert_eq!(handshake.wait(at(5), true, &limits), None);
        let busy = handshake.wait(at(6), true, &limits);
        assert_eq!(busy, Some(SvcFailure::BusyTimeout { milliseconds: 5 }));
        handshake.clear();
        assert_eq!(handshake.wait(at(9), true, &limits), None);
    }

    #[test]
    fn answer_counts_only_with_the_same_handshake_bit() {
        let mut handshake = Handshake::default();
        handshake.rest(true);
        let answer = |status| Some(AtSvc { status, info: 7 });
        let valid = SvcStatus::VALID | SvcStatus::AHS;
        assert!(matches!(handshake.judge(None), Answer::Missing));
        assert!(matches!(handshake.judge(answer(SvcStatus::VALID)), Answer::Missing));
        assert!(matches!(handshake.judge(answer(valid | SvcStatus::BUSY)), Answer::Busy));
        assert!(matches!(handshake.judge(answer(valid)), Answer::Through(Ok(7))));
        assert!(matches!(
            handshake.judge(answer(valid | SvcStatus::ERROR)),
            Answer::Through(Err(SvcError(7)))
        ));
    }
}
