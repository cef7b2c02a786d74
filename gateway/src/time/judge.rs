//! Whether system time is synchronized: measured offsets against a threshold, over time.
//!
//! ```text
//!                 master                eight offsets
//!  +-----------+ followed +--------------+ within  +--------------+
//!  | Listening |--------->| Uncalibrated |-------->| Synchronized |
//!  +-----------+          +--------------+         +--------------+
//!        ^    no master    ^   ^     three offsets beyond |   | no Sync for three intervals
//!        +-----------------+   +--------------------------+   v
//!        ^                 |        bound beyond     +----------+
//!        +-----------------+-------------------------| Holdover |
//!           (bound beyond, no master)                +----------+
//! ```
//!
//! In holdover the time goes on with the last rate. Its error is bounded: what was measured last, and [`DRIFT_PPB`] of the time since
//! then. While the bound is below the threshold, the time is synchronized; the first offset that is measured again ends it either
//! way.

use std::fmt;

use profile_generic::time::MonotonicTime;

/// Offsets within the threshold that make a clock synchronized, each from one Sync, without [`BAD`] others in a row between them.
pub const GOOD: u8 = 8;

/// Offsets in a row beyond the threshold that end it.
pub const BAD: u8 = 3;

/// Intervals of Sync without one, after which the master is taken for silent.
const SILENCE: u64 = 3;

/// Interval of Sync before one has been measured, ns: the default of CIP Sync.
const INTERVAL_NS: u64 = 1_000_000_000;

/// Longest interval of Sync that is waited for, ns.
const INTERVAL_MAX_NS: u64 = 16_000_000_000;

/// How far the rate of a crystal moves while nobody measures it, parts per thousand million: some degrees of temperature.
pub const DRIFT_PPB: u64 = 500;

/// How it stands with the time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SyncPhase {
    /// No master is heard.
    #[default]
    Listening,
    /// A master is followed; that our time is its time is not shown yet, or not any more.
    Uncalibrated(Reason),
    /// The last offsets are within the threshold.
    Synchronized,
    /// The master is silent; the time goes on with the last rate, and the bound of its error is below the threshold.
    Holdover,
}

/// Why a clock that follows a master is not synchronized.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// No Sync comes from it.
    NoSync,
    /// Nobody answers the delay requests.
    NoDelay,
    /// Offsets are being measured.
    Settling,
    /// Offsets are beyond the threshold.
    Offset,
    /// The master's clock has stepped.
    Step,
    /// Another grandmaster is followed.
    Grandmaster,
    /// No daemon keeps the host's clock.
    Undisciplined,
}

impl SyncPhase {
    /// Whether controllers may be told that the time is synchronized.
    #[must_use]
    pub const fn is_synchronized(self) -> bool {
        matches!(self, Self::Synchronized | Self::Holdover)
    }
}

impl fmt::Display for SyncPhase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Listening => f.write_str("no master is heard"),
            Self::Uncalibrated(reason) => write!(f, "not synchronized: {reason}"),
            Self::Synchronized => f.write_str("synchronized"),
            Self::Holdover => f.write_str("holdover: the master is silent"),
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoSync => "the master sends no Sync",
            Self::NoDelay => "the master answers no delay request",
            Self::Settling => "offsets are being measured",
            Self::Offset => "the offset is beyond the threshold",
            Self::Step => "the master's clock has stepped",
            Self::Grandmaster => "another grandmaster is followed",
            Self::Undisciplined => "no daemon keeps the host's clock",
        })
    }
}

/// What happens to the clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// A master is followed from now on; `grandmaster` if it has another grandmaster than the one before.
    Master {
        /// The grandmaster is another one.
        grandmaster: bool,
    },
    /// No master is heard any more.
    NoMaster,
    /// A Sync has shown this offset, ns.
    Offset(i64),
    /// A Sync came, and no offset can be measured, as the path delay is not known.
    NoDelay,
    /// The master's clock has stepped.
    Step,
    /// Time passes.
    Time,
}

/// See the module.
#[derive(Debug, Clone, Copy)]
pub struct Judge {
    phase: SyncPhase,
    /// Largest offset of a synchronized clock, ns.
    threshold: u64,
    good: u8,
    bad: u8,
    followed: bool,
    /// When the last Sync came or the master was found.
    heard: MonotonicTime,
    /// A Sync of this master has come.
    has_heard: bool,
    interval: u64,
    /// What the last Sync has shown, ns; `u64::MAX` before the first one of this grandmaster.
    last_offset: u64,
}

impl Judge {
    /// A clock without a master, synchronized within `threshold` ns.
    #[must_use]
    pub const fn new(threshold: u64) -> Self {
        Self {
            phase: SyncPhase::Listening,
            threshold,
            good: 0,
            bad: 0,
            followed: false,
            heard: MonotonicTime::ZERO,
            has_heard: false,
            interval: INTERVAL_NS,
            last_offset: u64::MAX,
        }
    }

    /// Offsets are judged by another threshold from the next one on, ns.
    pub const fn set_threshold(&mut self, threshold: u64) {
        self.threshold = threshold;
    }

    /// How it stands.
    #[must_use]
    pub const fn phase(&self) -> SyncPhase {
        self.phase
    }

    /// Bound of the error at an instant, ns: what the last offset was, and the drift since then. `u64::MAX` while none was measured.
    #[must_use]
    pub fn error_bound(&self, now: MonotonicTime) -> u64 {
        let silent = now.0.saturating_sub(self.heard.0);
        let drift = u128::from(silent) * u128::from(DRIFT_PPB) / 1_000_000_000;
        self.last_offset.saturating_add(u64::try_from(drift).unwrap_or(u64::MAX))
    }

    /// Takes an event. Returns the state when it is another one.
    pub fn handle(&mut self, event: Event, now: MonotonicTime) -> Option<SyncPhase> {
        let before = self.phase;
        self.phase = self.next(event, now);
        (self.phase != before).then_some(self.phase)
    }

    fn next(&mut self, event: Event, now: MonotonicTime) -> SyncPhase {
        match event {
            Event::Master { grandmaster } => {
                self.followed = true;
                if grandmaster {
                    self.start_over(now);
                    return SyncPhase::Uncalibrated(Reason::Grandmaster);
                }
                match self.phase {
                    // The same time by another way: what it shows is measured before it is believed, and nothing is wrong yet.
                    SyncPhase::Listening => {
                        self.start_over(now);
                        SyncPhase::Uncalibrated(Reason::Settling)
                    }
                    phase => phase,
                }
            }
            Event::NoMaster => {
                self.followed = false;
                match self.phase {
                    SyncPhase::Synchronized | SyncPhase::Holdover
                        if self.error_bound(now) <= self.threshold =>
                    {
                        SyncPhase::Holdover
                    }
                    _ => SyncPhase::Listening,
                }
            }
            Event::Step => {
                self.heard(now);
                (self.good, self.bad) = (0, 0);
                SyncPhase::Uncalibrated(Reason::Step)
            }
            Event::NoDelay => {
                self.heard(now);
                self.good = 0;
                if self.followed { SyncPhase::Uncalibrated(Reason::NoDelay) } else { self.phase }
            }
            Event::Offset(offset) => self.measured(offset, now),
            Event::Time => self.passed(now),
        }
    }

    fn measured(&mut self, offset: i64, now: MonotonicTime) -> SyncPhase {
        self.heard(now);
        let offset = offset.unsigned_abs();
        let is_good = offset <= self.threshold;
        self.bad = if is_good { 0 } else { self.bad.saturating_add(1) };
        // One alone may have come late, and says nothing of the clock.
        if is_good || self.bad > 1 || self.last_offset == u64::MAX {
            self.last_offset = offset;
        }
        if !is_good {
            if self.bad >= BAD {
                self.good = 0;
                return SyncPhase::Uncalibrated(Reason::Offset);
            }
            return match self.phase {
                SyncPhase::Synchronized | SyncPhase::Holdover => SyncPhase::Synchronized,
                SyncPhase::Uncalibrated(Reason::NoDelay | Reason::NoSync) => {
                    SyncPhase::Uncalibrated(Reason::Settling)
                }
                phase => phase,
            };
        }
        self.good = self.good.saturating_add(1);
        match self.phase {
            SyncPhase::Synchronized | SyncPhase::Holdover => SyncPhase::Synchronized,
            _ if self.good >= GOOD => SyncPhase::Synchronized,
            SyncPhase::Uncalibrated(reason @ (Reason::Step | Reason::Grandmaster)) => {
                SyncPhase::Uncalibrated(reason)
            }
            _ => SyncPhase::Uncalibrated(Reason::Settling),
        }
    }

    fn passed(&self, now: MonotonicTime) -> SyncPhase {
        let silent = now.0.saturating_sub(self.heard.0) > SILENCE.saturating_mul(self.interval);
        let is_over = self.error_bound(now) > self.threshold;
        match self.phase {
            SyncPhase::Synchronized if !silent => SyncPhase::Synchronized,
            SyncPhase::Synchronized | SyncPhase::Holdover if !is_over => SyncPhase::Holdover,
            SyncPhase::Synchronized | SyncPhase::Holdover if self.followed => {
                SyncPhase::Uncalibrated(Reason::NoSync)
            }
            SyncPhase::Synchronized | SyncPhase::Holdover => SyncPhase::Listening,
            SyncPhase::Uncalibrated(_) if silent => SyncPhase::Uncalibrated(Reason::NoSync),
            phase => phase,
        }
    }

    /// A Sync came: the next one is expected as long after it as it came after the one before.
    fn heard(&mut self, now: MonotonicTime) {
        let since = now.0.saturating_sub(self.heard.0);
        self.heard = now;
        if !std::mem::replace(&mut self.has_heard, true) {
            return;
        }
        // Syncs that are left out do not make the interval of a synchronized clock longer, and one that comes late does not make it
        // short.
        if since < self.interval.saturating_mul(SILENCE) || !self.phase.is_synchronized() {
            let shorter = self.interval - self.interval / 8;
            self.interval = since.max(shorter).clamp(INTERVAL_NS / 16, INTERVAL_MAX_NS);
        }
    }

    fn start_over(&mut self, now: MonotonicTime) {
        (self.good, self.bad, self.heard) = (0, 0, now);
        (self.interval, self.has_heard, self.last_offset) = (INTERVAL_NS, false, u64::MAX);
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;

    const THRESHOLD: u64 = 10_000;
    const SECOND: u64 = 1_000_000_000;

    fn at(seconds: u64) -> MonotonicTime {
        MonotonicTime((100 + seconds) * SECOND)
    }

    /// A clock that was synchronized at second 10.
    fn synchronized() -> Judge {
        let mut judge = Judge::new(THRESHOLD);
        judge.handle(Event::Master { grandmaster: true }, at(0));
        for second in 1..=10 {
            judge.handle(Event::Offset(500), at(second));
        }
        assert_eq!(judge.phase(), SyncPhase::Synchronized);
        judge
    }

    #[test]
    fn eight_good_offsets_make_it_synchronized_and_three_bad_ones_in_a_row_begin_the_count_anew() {
        let mut judge = Judge::new(THRESHOLD);
        assert_eq!(judge.phase(), SyncPhase::Listening);
        judge.handle(Event::Master { grandmaster: true }, at(0));
        for second in 1..=7 {
            judge.handle(Event::Offset(-9_000), at(second));
        }
        for second in 8..=10 {
            assert!(!judge.phase().is_synchronized(), "{second}");
            judge.handle(Event::Offset(10_001), at(second));
        }
        assert_eq!(judge.phase(), SyncPhase::Uncalibrated(Reason::Offset));
        for second in 11..=17 {
            judge.handle(Event::Offset(10_000), at(second));
            assert!(!judge.phase().is_synchronized(), "{second}");
        }
        judge.handle(Event::Offset(10_001), at(18));
        assert_eq!(judge.handle(Event::Offset(0), at(19)), Some(SyncPhase::Synchronized), "one came late");
    }

    #[test]
    fn three_bad_offsets_in_a_row_end_it_and_two_do_not() {
        let mut judge = synchronized();
        for (second, offset, phase) in [
            (11, 20_000, SyncPhase::Synchronized),
            (12, 20_000, SyncPhase::Synchronized),
            (13, 100, SyncPhase::Synchronized),
            (14, 20_000, SyncPhase::Synchronized),
            (15, -20_000, SyncPhase::Synchronized),
            (16, 20_000, SyncPhase::Uncalibrated(Reason::Offset)),
        ] {
            judge.handle(Event::Offset(offset), at(second));
            assert_eq!(judge.phase(), phase, "{second}");
        }
    }

    #[test]
    fn a_silent_master_is_held_over_as_long_as_the_bound_allows() {
        let mut judge = synchronized();
        assert_eq!(judge.handle(Event::Time, at(13)), None);
        assert_eq!(judge.handle(Event::Time, MonotonicTime(at(13).0 + 1)), Some(SyncPhase::Holdover));
        // 500 ns, and 500 ns each second: 10 us are reached after 19 s.
        assert_eq!(judge.error_bound(at(29)), 10_000);
        assert_eq!(judge.handle(Event::Time, at(29)), None);
        assert_eq!(judge.handle(Event::Time, at(30)), Some(SyncPhase::Uncalibrated(Reason::NoSync)));
        let mut dead = synchronized();
        assert_eq!(dead.handle(Event::NoMaster, at(16)), Some(SyncPhase::Holdover));
        assert_eq!(dead.handle(Event::Time, at(30)), Some(SyncPhase::Listening));
    }

    #[test]
    fn what_is_measured_behind_a_holdover_decides() {
        for (offset, phase) in [(2_000, SyncPhase::Synchronized), (30_000, SyncPhase::Synchronized)] {
            let mut judge = synchronized();
            judge.handle(Event::Time, at(14));
            assert_eq!(
                judge.handle(Event::Offset(offset), at(15)),
                Some(phase),
                "one value alone may be an odd one"
            );
        }
    }

    #[test]
    fn the_bound_is_what_was_measured_last() {
        assert_eq!(Judge::new(THRESHOLD).error_bound(at(1)), u64::MAX, "nothing was measured");
        let mut judge = synchronized();
        judge.handle(Event::Offset(-50_000), at(11));
        assert_eq!(judge.error_bound(at(13)), 1_500, "one alone may have come late");
        let mut held = judge;
        assert_eq!(held.handle(Event::NoMaster, at(13)), Some(SyncPhase::Holdover));
        judge.handle(Event::Offset(50_000), at(12));
        assert_eq!(judge.error_bound(at(13)), 50_500);
        assert_eq!(judge.handle(Event::NoMaster, at(13)), Some(SyncPhase::Listening), "it is not held over");
        judge.handle(Event::Master { grandmaster: true }, at(14));
        assert_eq!(judge.error_bound(at(15)), u64::MAX, "of another grandmaster nothing was measured");
    }

    #[test]
    fn slow_syncs_are_waited_for() {
        let mut judge = Judge::new(THRESHOLD);
        judge.handle(Event::Master { grandmaster: true }, at(0));
        for number in 1..=12 {
            judge.handle(Event::Offset(100), at(4 * number));
            judge.handle(Event::Time, at(4 * number + 3));
        }
        assert_eq!(judge.phase(), SyncPhase::Synchronized);
        assert_eq!(judge.handle(Event::Time, at(48 + 12)), None);
        assert_eq!(judge.handle(Event::Time, at(48 + 13)), Some(SyncPhase::Holdover));
    }

    /// Every state and every event.
    #[test]
    fn table_of_states() {
        type State = (&'static str, fn() -> Judge);
        let states: [State; 8] = [
            ("Listening", || Judge::new(THRESHOLD)),
            ("Settling", || {
                let mut judge = Judge::new(THRESHOLD);
                judge.handle(Event::Master { grandmaster: false }, at(9));
                judge
            }),
            ("Grandmaster", || {
                let mut judge = Judge::new(THRESHOLD);
                judge.handle(Event::Master { grandmaster: true }, at(9));
                judge
            }),
            ("NoDelay", || {
                let mut judge = Judge::new(THRESHOLD);
                judge.handle(Event::Master { grandmaster: true }, at(9));
                judge.handle(Event::NoDelay, at(10));
                judge
            }),
            ("Offset", || {
                let mut judge = synchronized();
                for _ in 0..3 {
                    judge.handle(Event::Offset(50_000), at(10));
                }
                judge
            }),
            ("Step", || {
                let mut judge = synchronized();
                judge.handle(Event::Step, at(10));
                judge
            }),
            ("Synchronized", synchronized),
            ("Holdover", || {
                let mut judge = synchronized();
                judge.handle(Event::NoMaster, at(10));
                judge
            }),
        ];
        let events = [
            ("same master", Event::Master { grandmaster: false }, 1),
            ("other grandmaster", Event::Master { grandmaster: true }, 1),
            ("no master", Event::NoMaster, 1),
            ("offset 1 us", Event::Offset(1_000), 1),
            ("offset 50 us", Event::Offset(50_000), 1),
            ("no delay", Event::NoDelay, 1),
            ("step", Event::Step, 1),
            ("5 s", Event::Time, 5),
            ("60 s", Event::Time, 60),
        ];
        let mut table = String::new();
        for (name, state) in states {
            for (event_name, event, seconds) in events {
                let mut judge = state();
                judge.handle(event, at(10 + seconds));
                let _ = writeln!(table, "{name:13} {event_name:18} {:?}", judge.phase());
            }
        }
        insta::assert_snapshot!(table);
    }
}
