//! How late the gateway's cycle thread wakes up: jitter, and pauses in which it does not run at all.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::network::Random;

/// The wake-ups of the engine: on time unless something else is said.
#[derive(Debug, Clone)]
pub struct WakeUps {
    /// Longest lateness of a wake-up; each is late by a random part of it.
    pub jitter: DurationNs,
    random: Random,
    paused_from: MonotonicTime,
    paused_until: MonotonicTime,
}

impl WakeUps {
    /// Wake-ups on time; jitter follows from `seed`.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self {
            jitter: DurationNs::ZERO,
            random: Random::new(seed ^ 0x5741_4B45),
            paused_from: MonotonicTime::ZERO,
            paused_until: MonotonicTime::ZERO,
        }
    }

    /// The engine does not run before `until`; controller, buses and drives do.
    pub fn pause(&mut self, until: MonotonicTime) {
        self.pause_from(MonotonicTime::ZERO, until.max(self.paused_until));
    }

    /// The engine does not run from one instant to another: what it is to do before the first one it does.
    pub const fn pause_from(&mut self, from: MonotonicTime, until: MonotonicTime) {
        (self.paused_from, self.paused_until) = (from, until);
    }

    /// How late the next wake-up is.
    pub fn lateness(&mut self) -> DurationNs {
        let longest = u64::try_from(self.jitter.as_nanos()).unwrap_or(0);
        if longest == 0 {
            return DurationNs::ZERO;
        }
        DurationNs(i64::try_from(self.random.below(longest + 1)).unwrap_or(0))
    }

    /// When a wake-up happens that is to happen at `at`.
    #[must_use]
    pub fn after_pause(&self, at: MonotonicTime) -> MonotonicTime {
        if at < self.paused_from { at } else { at.max(self.paused_until) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wake_ups_are_late_within_the_jitter_and_never_in_a_pause() {
        let mut wake_ups = WakeUps::new(7);
        assert_eq!(wake_ups.lateness(), DurationNs::ZERO);
        wake_ups.jitter = DurationNs::from_micros(50);
        let late: Vec<_> = (0..1_000).map(|_| wake_ups.lateness()).collect();
        assert!(late.iter().all(|late| (0..=50_000).contains(&late.as_nanos())));
        assert!(
            late.iter().any(|late| late.as_nanos() < 5_000)
                && late.iter().any(|late| late.as_nanos() > 45_000)
        );
        wake_ups.pause(MonotonicTime(900));
        assert_eq!(wake_ups.after_pause(MonotonicTime(500)), MonotonicTime(900));
        assert_eq!(wake_ups.after_pause(MonotonicTime(901)), MonotonicTime(901));
        wake_ups.pause_from(MonotonicTime(2_000), MonotonicTime(3_000));
        let after = [1_999, 2_000, 3_001].map(|at| wake_ups.after_pause(MonotonicTime(at)));
        assert_eq!(after, [1_999, 3_000, 3_001].map(MonotonicTime));
    }
}
