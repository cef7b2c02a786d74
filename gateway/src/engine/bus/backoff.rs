//! Pauses between vain attempts at a drive of a CAN bus.

use profile_generic::time::{DurationNs, MonotonicTime};

/// The first pause; it doubles with every vain attempt.
const PAUSE: DurationNs = DurationNs::from_secs(10);

/// The longest one.
const PAUSE_MAX: DurationNs = DurationNs::from_secs(320);

/// A pause that grows.
#[derive(Debug, Clone, Copy)]
pub struct Backoff {
    at: Option<MonotonicTime>,
    pause: DurationNs,
}

impl Backoff {
    /// Nothing was in vain.
    pub const NONE: Self = Self { at: None, pause: PAUSE };

    /// An attempt was in vain.
    pub fn begin(&mut self, now: MonotonicTime) {
        self.at = Some(now + self.pause);
        self.pause = (self.pause * 2).min(PAUSE_MAX);
    }

    /// Whether the pause is over, once.
    pub fn take(&mut self, now: MonotonicTime) -> bool {
        self.at.take_if(|at| now >= *at).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_double_up_to_the_longest_and_end_once() {
        let mut backoff = Backoff::NONE;
        assert!(!backoff.take(MonotonicTime::MAX), "nothing was tried");
        let mut now = MonotonicTime(1);
        for seconds in [10, 20, 40, 80, 160, 320, 320] {
            backoff.begin(now);
            let end = now + DurationNs::from_secs(seconds);
            assert!(!backoff.take(MonotonicTime(end.0 - 1)));
            assert!(backoff.take(end) && !backoff.take(end), "{seconds} s");
            now = end;
        }
    }
}
