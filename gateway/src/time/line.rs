//! The line from the monotonic clock to the master's: its phase and rate, fitted to what PTP measures.
//!
//! ```text
//! phase = time of the master less monotonic time
//! a Sync shows           phase less the delay from the master to us
//! a delay request shows  phase plus the delay from us to the master
//! mean path delay = half of the difference, both brought to one instant
//! ```
//!
//! The line runs through the last [`WINDOW`] Syncs. A value far off it is put aside until the next ones agree with it: then the
//! master's clock has stepped, the line begins anew there, and keeps its rate. If they agree on a line of another rate, the master's
//! frequency has stepped, and the line begins anew with that. Everything is integer nanoseconds.

use arrayvec::ArrayVec;
use profile_generic::time::{MonotonicTime, SystemTime};
use profile_generic::time_base::TimeSample;

/// Syncs that the line runs through.
pub const WINDOW: usize = 16;

/// Syncs that a rate needs.
const RATE_MIN: usize = 4;

/// Path delays of which the middle one counts.
const DELAYS: usize = 9;

/// Path delays that a mean path delay needs.
const DELAYS_MIN: usize = 3;

/// A value further off the line is put aside, ns, if it is also [`ODD_SPREADS`] times as far off as the others.
const ODD_NS: u64 = 20_000;

/// See [`ODD_NS`].
const ODD_SPREADS: u64 = 8;

/// A point of the window is left out of the line if it is so many times as far off as the one in the middle, and further than
/// [`ODD_NS`]; half of the window at least is left.
const OUTSIDE: u64 = 4;

/// A value further off a line without a rate is put aside, ns: an ordinary crystal is 100 ppm off, and a Sync comes each second.
const ODD_WITHOUT_RATE_NS: u64 = 1_000_000;

/// Values put aside that agree with each other and make a step.
const STEP_VALUES: usize = 3;

/// Values put aside that do not agree, after which the line begins anew.
const PUT_ASIDE_MAX: usize = 8;

/// Largest rate that is believed, parts per thousand million.
const RATE_MAX_PPB: i64 = 1_000_000;

/// A delay request this long after the last Sync says nothing: the line may have left it.
const DELAY_AGE_NS: u64 = 10_000_000_000;

const BILLION: i128 = 1_000_000_000;

/// What a Sync has done to the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// It is the first one.
    First,
    /// It is on the line; it was this much ahead of it, ns.
    Near {
        /// Time of the master less that of the line, ns.
        offset: i64,
    },
    /// It is far off and was put aside.
    PutAside {
        /// Time of the master less that of the line, ns.
        offset: i64,
    },
    /// It confirms a step of the master; the line begins anew there.
    Stepped {
        /// The step, ns.
        by: i64,
    },
}

/// One measurement of the phase.
#[derive(Debug, Clone, Copy)]
struct Point {
    at: MonotonicTime,
    phase: i64,
}

impl Point {
    /// Time and phase from another point on, ns: small numbers, whatever the clocks say.
    fn relative_to(self, origin: Self) -> (i128, i128) {
        (i128::from(self.at.since(origin.at).0), i128::from(self.phase.saturating_sub(origin.phase)))
    }
}

/// See the module.
#[derive(Debug, Clone, Default)]
pub struct Line {
    points: ArrayVec<Point, WINDOW>,
    aside: ArrayVec<Point, PUT_ASIDE_MAX>,
    delays: ArrayVec<i64, DELAYS>,
    /// Phase at the last point, and the rate in parts per thousand million.
    phase: i64,
    rate_ppb: i64,
    rate_is_known: bool,
    /// Distance of the points from the line, the middle one, ns.
    spread: u64,
}

impl Line {
    /// A line through readings of a clock: no path leads to it.
    #[must_use]
    pub fn direct() -> Self {
        Self { delays: ArrayVec::from_iter([0; DELAYS_MIN]), ..Self::default() }
    }

    /// Another master is followed: nothing is known. The rate so far is the best guess until its own is measured; two masters may be
    /// as far apart as their crystals.
    pub fn begin_anew(&mut self) {
        *self = Self { rate_ppb: self.rate_ppb, ..Self::default() };
    }

    /// The way to the same time is another one: its delay is not known yet.
    pub fn forget_delay(&mut self) {
        self.delays.clear();
    }

    /// Takes a Sync that came at `at`; `phase` is the time it was sent less that time, ns.
    pub fn sync(&mut self, at: MonotonicTime, phase: i64) -> Taken {
        let point = Point { at, phase };
        let Some(expected) = self.phase_at(at) else {
            self.points.push(point);
            self.fit();
            return Taken::First;
        };
        let offset = phase.saturating_sub(expected);
        if offset.unsigned_abs() <= self.odd() {
            self.aside.clear();
            self.keep(point);
            return Taken::Near { offset };
        }
        let agreed = self.aside.iter().rev().take(STEP_VALUES - 1);
        let agree = |other: &Point| {
            let there = self.phase_at(other.at).map_or(0, |line| other.phase.saturating_sub(line));
            offset.abs_diff(there) <= self.odd()
        };
        let stepped = self.aside.len() >= STEP_VALUES - 1 && agreed.into_iter().all(agree);
        let kept = if stepped {
            STEP_VALUES - 1
        } else if self.is_of_another_rate(point) {
            RATE_MIN - 1
        } else if self.aside.len() + 1 < PUT_ASIDE_MAX {
            self.aside.push(point);
            return Taken::PutAside { offset };
        } else {
            0
        };
        self.points = self.aside.iter().skip(self.aside.len().saturating_sub(kept)).copied().collect();
        self.aside.clear();
        self.rate_is_known &= stepped;
        self.keep(point);
        Taken::Stepped { by: offset }
    }

    /// Whether this value and the last ones put aside are on one line, whatever its rate.
    fn is_of_another_rate(&self, point: Point) -> bool {
        let before = self.aside.iter().rev().take(RATE_MIN - 1).rev();
        let points: ArrayVec<_, RATE_MIN> =
            before.chain([&point]).map(|other| other.relative_to(point)).collect();
        let fitted = Fit::through(&points, self.rate_ppb);
        fitted.has_rate && points.iter().all(|point| fitted.off(*point) <= self.odd())
    }

    /// Takes a delay request that left at `at`; `phase` is the time at which the master got it less that time, ns.
    pub fn delay(&mut self, at: MonotonicTime, phase: i64) {
        let Some(last) = self.points.last() else { return };
        if !self.rate_is_known || at.0.abs_diff(last.at.0) > DELAY_AGE_NS {
            return;
        }
        let Some(line) = self.phase_at(at) else { return };
        let delay = phase.saturating_sub(line) / 2;
        // No path of a plant takes that long: a step has come between Sync and request.
        if delay.unsigned_abs() > BILLION.unsigned_abs().try_into().unwrap_or(u64::MAX) {
            return;
        }
        if self.delays.is_full() {
            self.delays.remove(0);
        }
        self.delays.push(delay);
    }

    /// Mean delay of the path to the master, ns, as soon as it has been measured often enough.
    #[must_use]
    pub fn mean_path_delay(&self) -> Option<i64> {
        if self.delays.len() < DELAYS_MIN {
            return None;
        }
        let mut sorted = self.delays.clone();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }

    /// Whether the rate comes from measurements of this master.
    #[must_use]
    pub const fn rate_is_known(&self) -> bool {
        self.rate_is_known
    }

    /// Rate of the master against the monotonic clock, parts per thousand million.
    #[must_use]
    pub const fn rate_ppb(&self) -> i64 {
        self.rate_ppb
    }

    /// Distance of the last Syncs from the line, the middle one, ns.
    #[must_use]
    pub const fn spread(&self) -> u64 {
        self.spread
    }

    /// The master's time at an instant; `None` before a Sync and a path delay.
    #[must_use]
    pub fn sample(&self, at: MonotonicTime) -> Option<TimeSample> {
        let phase = self.phase_at(at)?.checked_add(self.mean_path_delay()?)?;
        let system = SystemTime(at.0.checked_add_signed(phase)?);
        Some(TimeSample { at, system, rate_ppb: self.rate_ppb })
    }

    fn phase_at(&self, at: MonotonicTime) -> Option<i64> {
        let last = self.points.last()?;
        let gained = i128::from(at.since(last.at).0) * i128::from(self.rate_ppb) / BILLION;
        self.phase.checked_add(i64::try_from(gained).ok()?)
    }

    /// How far off the line a value is put aside, ns.
    fn odd(&self) -> u64 {
        if self.rate_is_known {
            ODD_NS.max(self.spread.saturating_mul(ODD_SPREADS))
        } else {
            ODD_WITHOUT_RATE_NS
        }
    }

    fn keep(&mut self, point: Point) {
        if self.points.is_full() {
            self.points.remove(0);
        }
        self.points.push(point);
        self.fit();
    }

    /// Least squares through the points, without those that are far off the others; with few of them the rate stays and the phase is
    /// the mean.
    fn fit(&mut self) {
        let Some(last) = self.points.last().copied() else { return };
        let mut relative: ArrayVec<(i128, i128), WINDOW> =
            self.points.iter().map(|point| point.relative_to(last)).collect();
        loop {
            let fitted = Fit::through(&relative, self.rate_ppb);
            let off = |point: &(i128, i128)| fitted.off(*point);
            let mut sorted: ArrayVec<u64, WINDOW> = relative.iter().map(off).collect();
            sorted.sort_unstable();
            let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
            let worst = relative.iter().enumerate().max_by_key(|(_, point)| off(point));
            if let Some((place, point)) = worst
                && relative.len() > WINDOW / 2
                && off(point) > ODD_NS.max(middle.saturating_mul(OUTSIDE))
            {
                relative.remove(place);
                continue;
            }
            self.rate_is_known |= fitted.has_rate;
            self.rate_ppb = fitted.rate_ppb;
            self.phase = last.phase.saturating_add(fitted.shift);
            self.spread = middle;
            return;
        }
    }
}

/// A line through points of time and phase.
struct Fit {
    /// Phase at time 0.
    shift: i64,
    rate_ppb: i64,
    /// The rate comes from the points.
    has_rate: bool,
}

impl Fit {
    fn through(points: &[(i128, i128)], known_ppb: i64) -> Self {
        let count = i128::try_from(points.len()).unwrap_or(i128::MAX).max(1);
        let times: i128 = points.iter().map(|(time, _)| time).sum();
        let phases: i128 = points.iter().map(|(_, phase)| phase).sum();
        let (mut both, mut square) = (0_i128, 0_i128);
        for (time, phase) in points {
            let time = count * time - times;
            both = both.saturating_add(time.saturating_mul(count * phase - phases));
            square = square.saturating_add(time.saturating_mul(time));
        }
        let has_rate = points.len() >= RATE_MIN && square > 0;
        let rate_ppb = if has_rate {
            let rate = both.saturating_mul(BILLION) / square;
            let rate = i64::try_from(rate).unwrap_or(if rate < 0 { i64::MIN } else { i64::MAX });
            rate.clamp(-RATE_MAX_PPB, RATE_MAX_PPB)
        } else {
            known_ppb
        };
        let shift = (phases - times * i128::from(rate_ppb) / BILLION) / count;
        Self { shift: i64::try_from(shift).unwrap_or(0), rate_ppb, has_rate }
    }

    /// How far a point is off the line, ns.
    fn off(&self, (time, phase): (i128, i128)) -> u64 {
        let line = i128::from(self.shift) + time * i128::from(self.rate_ppb) / BILLION;
        u64::try_from((phase - line).unsigned_abs()).unwrap_or(u64::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PHASE: i64 = 1_700_000_000_000_000_000;
    const SECOND: u64 = 1_000_000_000;

    /// A master that is `ppb` faster than the monotonic clock, `delay` away, with values that are `noise` off in turns.
    struct Master {
        ppb: i64,
        delay: i64,
        noise: [i64; 3],
        /// Steps so far.
        ahead: i64,
    }

    impl Master {
        fn phase(&self, at: MonotonicTime) -> i64 {
            let since = i128::from(at.0) - i128::from(10 * SECOND);
            PHASE + self.ahead + i64::try_from(since * i128::from(self.ppb) / BILLION).unwrap()
        }

        fn noise(&self, number: u64) -> i64 {
            self.noise[usize::try_from(number % 3).unwrap()]
        }

        /// Sync number `number`, and a delay request half a second later.
        fn run(&self, line: &mut Line, number: u64) -> Taken {
            let at = MonotonicTime((10 + number) * SECOND);
            let taken = line.sync(at, self.phase(at) - self.delay + self.noise(number));
            let request = MonotonicTime(at.0 + SECOND / 2);
            line.delay(request, self.phase(request) + self.delay + self.noise(number + 1));
            taken
        }
    }

    fn error(line: &Line, master: &Master, at: MonotonicTime) -> i64 {
        let sample = line.sample(at).unwrap();
        sample.system.0.cast_signed() - at.0.cast_signed() - master.phase(at)
    }

    #[test]
    fn phase_rate_and_delay_are_found() {
        for (ppb, delay) in [(0, 0), (40_000, 3_000), (-100_000, 900), (200_000, 50_000), (-200_000, 20_000)]
        {
            let master = Master { ppb, delay, noise: [0; 3], ahead: 0 };
            let mut line = Line::default();
            let taken: Vec<_> = (0..20).map(|number| master.run(&mut line, number)).collect();
            assert_eq!(taken[0], Taken::First);
            assert!(taken[1..].iter().all(|taken| matches!(taken, Taken::Near { .. })), "{ppb} {taken:?}");
            assert!((line.rate_ppb() - ppb).abs() <= 1, "{ppb} {}", line.rate_ppb());
            assert!(
                (line.mean_path_delay().unwrap() - delay).abs() <= 2,
                "{delay} {:?}",
                line.mean_path_delay()
            );
            let off = error(&line, &master, MonotonicTime(40 * SECOND));
            assert!(off.abs() < 30, "{ppb}: {off} ns, ten seconds behind the last Sync");
        }
    }

    #[test]
    fn noise_is_averaged() {
        let master = Master { ppb: 40_000, delay: 3_000, noise: [0, 3_000, -3_000], ahead: 0 };
        let mut line = Line::default();
        for number in 0..40 {
            master.run(&mut line, number);
        }
        let off = error(&line, &master, MonotonicTime(50 * SECOND));
        assert!(off.abs() < 1_500, "{off} ns");
        assert!((1_000..4_000).contains(&line.spread()), "{}", line.spread());
    }

    #[test]
    fn no_time_is_told_before_the_path_delay_is_known() {
        let master = Master { ppb: 0, delay: 5_000, noise: [0; 3], ahead: 0 };
        let mut line = Line::default();
        for number in 0..10 {
            let at = MonotonicTime((10 + number) * SECOND);
            line.sync(at, master.phase(at) - master.delay);
            assert_eq!(line.sample(at), None, "{number}");
        }
    }

    #[test]
    fn one_odd_value_moves_nothing() {
        for odd in [30_000, -30_000, 3_600_000_000_000, i64::MAX / 2] {
            let master = Master { ppb: 10_000, delay: 1_000, noise: [0; 3], ahead: 0 };
            let mut line = Line::default();
            for number in 0..20 {
                master.run(&mut line, number);
            }
            let at = MonotonicTime(30 * SECOND);
            let before = line.sample(at);
            let taken = line.sync(at, master.phase(at).saturating_add(odd));
            assert!(matches!(taken, Taken::PutAside { .. }), "{odd} {taken:?}");
            assert_eq!(line.sample(at), before, "{odd}");
            assert!(matches!(master.run(&mut line, 21), Taken::Near { .. }));
        }
    }

    #[test]
    fn a_step_is_taken_when_three_values_agree_and_the_rate_stays() {
        for step in [10_000_000, -10_000_000, 3_600_000_000_000, 50_000] {
            let mut master = Master { ppb: 40_000, delay: 3_000, noise: [0; 3], ahead: 0 };
            let mut line = Line::default();
            for number in 0..20 {
                master.run(&mut line, number);
            }
            master.ahead = step;
            assert!(matches!(master.run(&mut line, 20), Taken::PutAside { .. }));
            assert!(matches!(master.run(&mut line, 21), Taken::PutAside { .. }));
            let Taken::Stepped { by } = master.run(&mut line, 22) else { panic!("no step") };
            assert!((by - step).abs() < 100, "{by} {step}");
            assert!((line.rate_ppb() - 40_000).abs() <= 1, "{}", line.rate_ppb());
            let off = error(&line, &master, MonotonicTime(33 * SECOND));
            assert!(off.abs() < 100, "{step}: {off} ns after the step");
        }
    }

    #[test]
    fn values_that_never_agree_make_a_new_beginning_after_eight() {
        let master = Master { ppb: 0, delay: 0, noise: [0; 3], ahead: 0 };
        let mut line = Line::default();
        for number in 0..20 {
            master.run(&mut line, number);
        }
        for (number, off) in (20..).zip([1, -2, 3, -4, 5, -6, 7]) {
            let at = MonotonicTime((10 + number) * SECOND);
            let taken = line.sync(at, master.phase(at) + off * 1_000_000_000);
            assert!(matches!(taken, Taken::PutAside { .. }), "{number} {taken:?}");
        }
        let at = MonotonicTime(37 * SECOND);
        assert_eq!(line.sync(at, PHASE - 8_000_000_000), Taken::Stepped { by: -8_000_000_000 });
    }

    #[test]
    fn another_master_begins_anew_and_its_rate_is_measured() {
        for ppb in [40_000, 0, -60_000, 240_000] {
            let master = Master { ppb: 40_000, delay: 3_000, noise: [0; 3], ahead: 0 };
            let mut line = Line::default();
            for number in 0..20 {
                master.run(&mut line, number);
            }
            line.begin_anew();
            assert_eq!((line.mean_path_delay(), line.sample(MonotonicTime(30 * SECOND))), (None, None));
            assert_eq!((line.rate_is_known(), line.rate_ppb()), (false, 40_000));
            let other = Master { ahead: 300_000, ppb, ..master };
            assert_eq!(other.run(&mut line, 20), Taken::First);
            for number in 21..27 {
                assert!(matches!(other.run(&mut line, number), Taken::Near { .. }), "{ppb}: {number}");
            }
            assert!(line.rate_is_known() && (line.rate_ppb() - ppb).abs() <= 1, "{ppb}");
            let off = error(&line, &other, MonotonicTime(37 * SECOND));
            assert!(off.abs() < 30, "{ppb}: {off} ns");
        }
    }

    #[test]
    fn another_rate_of_the_same_master_is_taken_when_four_values_are_on_its_line() {
        for change in [40_000, -100_000, 200_000] {
            let mut master = Master { ppb: 40_000, delay: 3_000, noise: [0; 3], ahead: 0 };
            let mut line = Line::default();
            for number in 0..20 {
                master.run(&mut line, number);
            }
            // From number 19 on.
            master.ahead -= 19 * change;
            master.ppb += change;
            let taken: Vec<_> = (20..24).map(|number| master.run(&mut line, number)).collect();
            assert!(taken[..3].iter().all(|taken| matches!(taken, Taken::PutAside { .. })), "{taken:?}");
            let Taken::Stepped { by } = taken[3] else { panic!("{change}: {taken:?}") };
            assert!((by - 4 * change).abs() < 100, "{change}: {by}");
            assert!((line.rate_ppb() - master.ppb).abs() <= 1, "{change}: {}", line.rate_ppb());
            let off = error(&line, &master, MonotonicTime(40 * SECOND));
            assert!(off.abs() < 100, "{change}: {off} ns");
        }
    }

    proptest::proptest! {
        #[test]
        fn anything_is_survived(values in proptest::collection::vec((proptest::prelude::any::<u64>(), proptest::prelude::any::<i64>(), proptest::prelude::any::<bool>()), 1..60)) {
            let mut line = Line::default();
            for (at, phase, sync) in values {
                if sync { line.sync(MonotonicTime(at), phase); } else { line.delay(MonotonicTime(at), phase); }
                let _ = line.sample(MonotonicTime(at));
            }
        }
    }
}
