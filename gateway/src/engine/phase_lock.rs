//! The phase lock of a bus: its cycles begin on a grid of system time.
//!
//! The grid is that of the controller, where its update period is a multiple of the cycle: then the instants of its set-points are
//! instants at which drives take values. Otherwise it is the multiples of the cycle from the epoch of system time on, and the
//! interpolator bridges the two.
//!
//! The lock moves the next cycle by a small part of the cycle at most, whatever the phase error is: [`PULL_PPM`], and ten times less
//! while an axis of the bus may have torque. So neither locking, nor another controller, nor a step of system time is a step for a
//! drive: set-points are computed for the instant at which the cycle really begins, and the drive sees its velocity off by that
//! part at most.

use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};
use profile_generic::time_base::TimeBase;

/// Fastest pull of a bus without torque, parts per million of the cycle: less than a host without a real-time kernel is late by.
pub const PULL_PPM: i64 = 3_000;

/// Fastest pull of a bus with torque: more than the crystal of an ordinary host and the network's are apart, and a third of what
/// the standard itself lets a device work off (clause 2-2.2).
pub const TORQUE_PULL_PPM: i64 = 300;

/// A phase error up to this, for [`STEADY_CYCLES`] in a row, is locked.
const LOCKED: DurationNs = DurationNs::from_micros(1);

/// A phase error beyond this is locked no longer.
const LOST: DurationNs = DurationNs::from_micros(5);

/// Cycles in a row that prove a lock.
const STEADY_CYCLES: u16 = 100;

const MILLION: i64 = 1_000_000;

/// Whether a bus follows system time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum LockState {
    /// There is no system time to follow, or the bus has no cycles: they go on by the gateway's own clock.
    #[default]
    Free,
    /// The cycles are on their way to the grid.
    Pulling,
    /// They begin on it.
    Locked,
}

impl LockState {
    /// All of them, by their codes.
    pub const ALL: [Self; 3] = [Self::Free, Self::Pulling, Self::Locked];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Pulling => "pulling",
            Self::Locked => "locked",
        }
    }

    /// Its code for programs outside.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Free => 0,
            Self::Pulling => 1,
            Self::Locked => 2,
        }
    }
}

/// The phase of a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Phase {
    /// Whether it follows.
    pub state: LockState,
    /// By how much the last cycle was later than the grid; zero while it follows nothing.
    pub error: DurationNs,
}

/// The grid of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid {
    /// An instant of it.
    pub instant: SystemTime,
    /// Time from one instant to the next.
    pub period: DurationNs,
}

/// The phase lock of one bus.
#[derive(Debug, Clone, Copy, Default)]
pub struct PhaseLock {
    phase: Phase,
    /// An instant of the grid; the epoch without a controller.
    reference: SystemTime,
    steady: u16,
}

impl PhaseLock {
    /// The phase.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Whether its state is news after `before`: a bus that is on the grid already needs no pull.
    #[must_use]
    pub fn is_news(&self, before: LockState) -> bool {
        let Phase { state, error } = self.phase;
        state != before && (state != LockState::Pulling || error.magnitude() > LOCKED.magnitude())
    }

    /// The grid of the controller of this bus, whose cycle is `span`; the last one stays when it is gone.
    pub fn refer(&mut self, grid: Grid, span: DurationNs) {
        let whole = span.0 > 0 && grid.period.0 >= span.0 && grid.period.0 % span.0 == 0;
        self.reference = if whole { grid.instant } else { SystemTime::ZERO };
    }

    /// By how much the cycle at `next` has to be moved. `time` is system time while it is to be trusted; `next` is `None` while the
    /// bus has no grid; `torque` says whether an axis of the bus may have torque.
    pub fn correct(
        &mut self,
        time: Option<&TimeBase>,
        next: Option<MonotonicTime>,
        span: DurationNs,
        torque: bool,
    ) -> DurationNs {
        let (Some(time), Some(next), true) = (time, next, span.0 > 0) else {
            (self.phase, self.steady) = (Phase::default(), 0);
            return DurationNs::ZERO;
        };
        let error = off_grid(time.system_at(next), self.reference, span);
        self.steady = if error.magnitude() <= LOCKED.magnitude() { self.steady.saturating_add(1) } else { 0 };
        let holds = self.phase.state == LockState::Locked && error.magnitude() <= LOST.magnitude();
        let state =
            if holds || self.steady >= STEADY_CYCLES { LockState::Locked } else { LockState::Pulling };
        self.phase = Phase { state, error };
        let most = (span.0 * if torque { TORQUE_PULL_PPM } else { PULL_PPM } / MILLION).max(1);
        DurationNs((-error.0).clamp(-most, most))
    }
}

/// How much later than the nearest instant of the grid a time is: from half a span before it on, to half a span behind it.
fn off_grid(time: SystemTime, reference: SystemTime, span: DurationNs) -> DurationNs {
    let cycle = span.0.unsigned_abs().max(1);
    let past = (time.0 % cycle + cycle - reference.0 % cycle) % cycle;
    let past = past.cast_signed();
    DurationNs(if past > span.0 / 2 { past - span.0 } else { past })
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::time_base::TimeSample;

    const SPAN: DurationNs = DurationNs::from_millis(1);
    const EPOCH: u64 = 1_700_000_000_000_000_000;

    /// System time that is `EPOCH` when monotonic time is zero.
    fn time() -> TimeBase {
        TimeBase::new(TimeSample { at: MonotonicTime::ZERO, system: SystemTime(EPOCH), rate_ppb: 0 })
    }

    fn at(nanos: u64) -> MonotonicTime {
        MonotonicTime(nanos)
    }

    /// Lets a grid that begins at `next` run for so many cycles; gives its last instant.
    fn run(lock: &mut PhaseLock, time: &TimeBase, mut next: MonotonicTime, cycles: u32) -> MonotonicTime {
        for _ in 0..cycles {
            let shift = lock.correct(Some(time), Some(next), SPAN, true);
            assert!(shift.magnitude() <= 300, "a small part of the cycle at most: {shift}");
            next = next + shift + SPAN;
        }
        next
    }

    #[test]
    fn error_is_the_way_to_the_nearest_instant() {
        for (later, error) in [
            (0, 0),
            (1, 1),
            (500_000, 500_000),
            (500_001, -499_999),
            (999_999, -1),
            (1_000_000, 0),
            (12_345_678, 345_678),
        ] {
            let found = off_grid(SystemTime(EPOCH + later), SystemTime(EPOCH), SPAN);
            assert_eq!(found, DurationNs(error), "{later}");
        }
        // An instant ahead, and the ends of the clock.
        assert_eq!(off_grid(SystemTime(EPOCH), SystemTime(EPOCH + 100), SPAN), DurationNs(-100));
        assert_eq!(off_grid(SystemTime::MAX, SystemTime::ZERO, SPAN), DurationNs(-448_385));
        assert_eq!(off_grid(SystemTime::ZERO, SystemTime::MAX, SPAN), DurationNs(448_385));
    }

    #[test]
    fn bus_is_pulled_to_the_grid_at_a_bounded_rate_and_stays_there() {
        let (mut lock, time) = (PhaseLock::default(), time());
        // 300 us behind an instant: 1000 cycles of 300 ns.
        let next = run(&mut lock, &time, at(300_000), 1_000);
        assert_eq!(lock.phase(), Phase { state: LockState::Pulling, error: DurationNs(300) });
        let next = run(&mut lock, &time, next, 96);
        assert_eq!(lock.phase(), Phase { state: LockState::Pulling, error: DurationNs::ZERO });
        let next = run(&mut lock, &time, next, 1);
        assert_eq!(lock.phase(), Phase { state: LockState::Locked, error: DurationNs::ZERO });
        assert_eq!(next.0 % 1_000_000, 0);
        // From the other side.
        let mut lock = PhaseLock::default();
        let next = run(&mut lock, &time, at(700_001), 1_100);
        assert_eq!((lock.phase().state, next.0 % 1_000_000), (LockState::Locked, 0));
    }

    #[test]
    fn controller_of_a_whole_ratio_has_its_instants_on_the_grid_and_another_has_not() {
        let grid =
            |micros| Grid { instant: SystemTime(EPOCH + 123_456), period: DurationNs::from_micros(micros) };
        for (period, reference) in
            [(1_000, EPOCH + 123_456), (4_000, EPOCH + 123_456), (1_500, 0), (500, 0), (0, 0)]
        {
            let mut lock = PhaseLock::default();
            lock.refer(grid(period), SPAN);
            assert_eq!(lock.reference, SystemTime(reference), "{period}");
        }
        let mut lock = PhaseLock::default();
        lock.refer(grid(2_000), SPAN);
        let next = run(&mut lock, &time(), at(0), 1_000);
        assert_eq!((lock.phase().state, next.0 % 1_000_000), (LockState::Locked, 123_456));
    }

    #[test]
    fn bus_without_torque_is_pulled_ten_times_as_fast() {
        let (mut lock, time) = (PhaseLock::default(), time());
        for (torque, later, shift) in [
            (false, 400_000, -3_000),
            (true, 400_000, -300),
            (false, 600_000, 3_000),
            (true, 600_000, 300),
            (false, 2_999, -2_999),
        ] {
            let by = lock.correct(Some(&time), Some(at(later)), SPAN, torque);
            assert_eq!(by, DurationNs(shift), "{torque} {later}");
        }
        let by = lock.correct(Some(&time), Some(at(7)), DurationNs(100), true);
        assert_eq!(by, DurationNs(-1), "never nothing");
    }

    #[test]
    fn lock_is_lost_beyond_five_microseconds_and_proven_again() {
        let (mut lock, time) = (PhaseLock::default(), time());
        let next = run(&mut lock, &time, at(0), 100);
        assert_eq!(lock.phase().state, LockState::Locked);
        lock.correct(Some(&time), Some(next + DurationNs(5_000)), SPAN, true);
        assert_eq!(lock.phase(), Phase { state: LockState::Locked, error: DurationNs(5_000) });
        let next = next + DurationNs(5_001);
        lock.correct(Some(&time), Some(next), SPAN, true);
        assert_eq!(lock.phase(), Phase { state: LockState::Pulling, error: DurationNs(5_001) });
        run(&mut lock, &time, next, 17 + 100);
        assert_eq!(lock.phase().state, LockState::Locked);
    }

    #[test]
    fn news_are_a_lock_its_end_and_a_pull_that_has_something_to_do() {
        let (mut lock, time) = (PhaseLock::default(), time());
        let next = |lock: &mut PhaseLock, at: u64, time: Option<&TimeBase>| {
            let before = lock.phase().state;
            lock.correct(time, Some(MonotonicTime(at)), SPAN, false);
            lock.is_news(before)
        };
        assert!(!next(&mut lock, 0, Some(&time)), "on the grid by chance");
        assert!((0..98).all(|_| !next(&mut lock, 0, Some(&time))));
        assert!(next(&mut lock, 0, Some(&time)), "locked");
        assert!(next(&mut lock, 6_000, Some(&time)), "off the grid");
        assert!(next(&mut lock, 0, None), "free");
        assert!(next(&mut lock, 2_000, Some(&time)), "to be pulled");
    }

    #[test]
    fn nothing_is_moved_without_system_time_or_a_grid() {
        let (mut lock, time) = (PhaseLock::default(), time());
        run(&mut lock, &time, at(0), 100);
        assert_eq!(lock.correct(None, Some(at(777)), SPAN, true), DurationNs::ZERO);
        assert_eq!(lock.phase(), Phase::default());
        lock.correct(Some(&time), Some(at(0)), SPAN, true);
        assert_eq!(lock.phase().state, LockState::Pulling, "it has to be proven again");
        assert_eq!(lock.correct(Some(&time), None, SPAN, true), DurationNs::ZERO);
        assert_eq!(lock.phase().state, LockState::Free);
    }

    #[test]
    fn system_time_of_another_rate_is_followed_without_an_error() {
        let mut lock = PhaseLock::default();
        let sample = |at: MonotonicTime, ppb: i64| TimeSample {
            at,
            system: SystemTime(EPOCH)
                + at.since(MonotonicTime::ZERO)
                + DurationNs(at.since(MonotonicTime::ZERO).0 / 1_000_000 * ppb / 1_000),
            rate_ppb: ppb,
        };
        for ppb in [40_000, -200_000] {
            let mut base = TimeBase::new(sample(MonotonicTime::ZERO, ppb));
            let mut next = at(0);
            for _ in 0..2_000 {
                base.feed(&sample(next, ppb));
                let shift = lock.correct(Some(&base), Some(next), SPAN, true);
                next = next + shift + SPAN;
            }
            // What one cycle gains is seen in the cycle itself and taken off the one after.
            let Phase { state, error } = lock.phase();
            assert_eq!((state, error.magnitude() <= 201), (LockState::Locked, true), "{ppb}: {error}");
        }
    }
}
