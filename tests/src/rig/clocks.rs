//! The clocks of controller and gateway: each with offset, drift and steps against the rig's true time.
//!
//! True time is what the buses and drives run on, and what the gateway's cycle runs on: the gateway's monotonic time is
//! the time base, and its clock here makes its *system* time only. The controller has both times from its clock, so that
//! its tick period drifts with it. What matters is the difference between the two.

use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use super::{START, SYSTEM_OFFSET};

/// Parts per billion in one.
const BILLION: i128 = 1_000_000_000;

/// A clock that is set to true time when the rig starts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Clock {
    /// What it gains in a second, ns.
    drift_ppb: i64,
    /// Since when it has this drift, in true time, and its monotonic time then.
    since: (MonotonicTime, MonotonicTime),
    /// Its system time less its monotonic time.
    system_offset: DurationNs,
    /// Its steps, each with the true instant.
    steps: Vec<(MonotonicTime, DurationNs)>,
    /// When it began to follow another master last, in true time.
    followed_at: Option<MonotonicTime>,
}

impl Default for Clock {
    fn default() -> Self {
        Self {
            drift_ppb: 0,
            since: (START, START),
            system_offset: DurationNs(i64::try_from(SYSTEM_OFFSET).unwrap_or(i64::MAX)),
            steps: Vec::new(),
            followed_at: None,
        }
    }
}

impl Clock {
    /// Its monotonic time at a true instant.
    #[must_use]
    pub fn monotonic(&self, now: MonotonicTime) -> MonotonicTime {
        let passed = now.since(self.since.0);
        let gained = i128::from(passed.0) * i128::from(self.drift_ppb) / BILLION;
        self.since.1 + passed + DurationNs(i64::try_from(gained).unwrap_or(0))
    }

    /// Its system time at a true instant.
    #[must_use]
    pub fn system(&self, now: MonotonicTime) -> SystemTime {
        SystemTime(self.monotonic(now).0) + self.system_offset
    }

    /// The first true instant at which its monotonic time has come to `at`.
    #[must_use]
    pub fn when(&self, at: MonotonicTime) -> MonotonicTime {
        let ahead = i128::from(at.since(self.since.1).0);
        let rate = BILLION + i128::from(self.drift_ppb);
        // Rounded up, and then to the nanosecond in which the clock shows it.
        let mut span = (ahead * BILLION).div_euclid(rate) - 1;
        let reaches =
            |span: i128| self.monotonic(self.since.0 + DurationNs(i64::try_from(span).unwrap_or(0))) >= at;
        while !reaches(span) {
            span += 1;
        }
        self.since.0 + DurationNs(i64::try_from(span).unwrap_or(0))
    }

    /// How far its system time is ahead of true system time at a true instant.
    #[must_use]
    pub fn offset(&self, now: MonotonicTime) -> DurationNs {
        self.system(now).since(SystemTime(now.0 + SYSTEM_OFFSET))
    }

    /// What it gains in a second, ns.
    #[must_use]
    pub const fn drift_ppb(&self) -> i64 {
        self.drift_ppb
    }

    /// The steps of its system time so far, each with the true instant.
    #[must_use]
    pub fn steps(&self) -> &[(MonotonicTime, DurationNs)] {
        &self.steps
    }

    /// What all steps so far come to.
    #[must_use]
    pub fn stepped(&self) -> DurationNs {
        self.steps.iter().fold(DurationNs::ZERO, |sum, (_, by)| sum + *by)
    }

    /// Sets its system time to be ahead of true time by `offset`, as it is from the start on: no step.
    pub fn set_offset(&mut self, now: MonotonicTime, offset: DurationNs) {
        self.system_offset = self.system_offset + offset - self.offset(now);
    }

    /// Lets its system time jump ahead, or back.
    pub fn step(&mut self, now: MonotonicTime, by: DurationNs) {
        self.system_offset = self.system_offset + by;
        self.steps.push((now, by));
    }

    /// A Sync of another master has come, as CIP Sync has it: from now on this clock has the system time and the rate of that one.
    pub fn follow(&mut self, now: MonotonicTime, master: &Self) {
        let by = master.system(now).since(self.system(now));
        if by != DurationNs::ZERO {
            self.step(now, by);
        }
        self.drift(now, master.drift_ppb);
        self.followed_at = Some(now);
    }

    /// When it began to follow another master last, in true time.
    #[must_use]
    pub const fn followed_at(&self) -> Option<MonotonicTime> {
        self.followed_at
    }

    /// Lets it gain so many parts per billion from now on, or lose them: monotonic and system time alike.
    pub fn drift(&mut self, now: MonotonicTime, ppb: i64) {
        self.since = (now, self.monotonic(now));
        self.drift_ppb = ppb;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: DurationNs = DurationNs::from_millis(1);

    #[test]
    fn a_clock_shows_true_time_until_it_is_changed() {
        let clock = Clock::default();
        let now = START + MS * 1_234;
        assert_eq!((clock.monotonic(now), clock.when(now)), (now, now));
        assert_eq!(clock.system(now), SystemTime(now.0 + SYSTEM_OFFSET));
        assert_eq!(clock.offset(now), DurationNs::ZERO);
    }

    #[test]
    fn drift_offset_and_steps_add_up() {
        let mut clock = Clock::default();
        clock.set_offset(START, MS * 3);
        clock.drift(START + MS * 1_000, 2_000_000);
        let later = START + MS * 2_000;
        assert_eq!(clock.monotonic(later), later + MS * 2, "2000 ppm of a second");
        clock.step(later, -MS);
        assert_eq!(clock.offset(later), MS * 4);
        assert_eq!(clock.steps(), [(later, -MS)]);
        assert_eq!(clock.monotonic(later), later + MS * 2, "a step is one of system time alone");
        clock.drift(later, -20_000);
        assert_eq!(clock.monotonic(later), later + MS * 2, "another drift is no step");
        clock.set_offset(later, DurationNs::ZERO);
        assert_eq!(clock.offset(later), DurationNs::ZERO);
    }

    #[test]
    fn a_clock_that_follows_another_has_its_time_and_its_rate() {
        let mut master = Clock::default();
        let then = START + MS * 1_000;
        master.step(then, MS * 10);
        master.drift(then, 200_000);
        let mut clock = Clock::default();
        let now = START + MS * 2_000;
        clock.follow(now, &master);
        assert_eq!(clock.steps(), [(now, MS * 10 + DurationNs::from_micros(200))]);
        let later = now + MS * 500;
        assert_eq!((clock.system(later), clock.drift_ppb()), (master.system(later), 200_000));
        assert_eq!(clock.monotonic(now), now, "the local clock does not step");
    }

    #[test]
    fn an_instant_of_the_clock_is_reached_when_it_is_said_to_be() {
        for ppb in [-2_000_000, -20_001, 0, 1, 333_333, 2_000_000] {
            let mut clock = Clock::default();
            clock.drift(START + MS * 7, ppb);
            for number in 0..1_000_i64 {
                let at = START + MS * 7 + DurationNs(number * 4_000_003);
                let when = clock.when(at);
                assert!(clock.monotonic(when) >= at, "{ppb} {number}");
                assert!(clock.monotonic(when - DurationNs(1)) < at, "{ppb} {number}");
            }
        }
    }
}
