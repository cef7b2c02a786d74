//! The set-points of one axis from cycle to cycle: what the change since the last one means, and whether it may.

use std::collections::VecDeque;

use profile_generic::cast::f64_from_i64;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::curve::{Band, Curve, Quantity, Skew};
use super::reading::{Reading, Scaling, SetPoint};
use super::statistics::Statistics;
use super::violation::Rule;

/// Cycles in which a drive is switched on: what the axis did before them is where it is held, and how fast a flying start
/// begins.
const START_CYCLES: usize = 32;

/// Update periods in which a curve still makes up for updates that were overdue: three updates behind the first one make a
/// polynomial with positions that were not sent, each is taken two periods ahead of its target and followed for one, and one
/// may be on its way.
const MAKING_UP: i64 = 7;

/// Update periods that the controller's first position may be old by: it is where the axis was when the controller planned
/// its update, some periods ahead of its time.
const BEGIN_PERIODS: f64 = 6.0;

/// Cycles in which the actual velocity may have been that at which velocity control begins, and the part of it, or of the way from
/// there to the curve, by which a polynomial of second order overshoots.
const BEGIN_CYCLES: usize = 8;
const BEGIN_OVERSHOOT: f64 = 0.25;

/// Parts of a limit to spare, as the gateway's own supervision of it has.
const SPARE: f64 = 0.1;

/// How much more than its limit the acceleration may be from one cycle to the next where there is no curve: at the corners of a profile
/// whose acceleration is a step, a polynomial between updates overshoots.
const CORNERS: f64 = 2.0;

/// Nanounits by which a conversion rounds: counts to generic units, and those to counts.
const ROUNDING: f64 = 2.0;

/// Part of a value by which a REAL rounds.
const REAL: f64 = 1e-6;

/// Nanoseconds in a second, nanounits in a unit, and parts per million in a percent.
const NANO: f64 = 1e9;
const PERCENT: f64 = 1e4;

/// What leads an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Leader {
    /// The set-points of the controller.
    Controller,
    /// A controller through assemblies, whose curve is not known: this is the limit of its acceleration, in nanounits per second squared.
    Bounded(f64),
    /// The gateway's ramp to rest, at this deceleration in nanounits per second squared.
    Ramp(f64),
    /// The gateway holds it at rest.
    Hold,
    /// Something else, on which nothing is checked: hookup tests, procedures of the drive.
    Other,
}

/// A set-point that breaks a rule: the value and what is allowed, in units or %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// The rule.
    pub rule: Rule,
    /// The value.
    pub value: f64,
    /// Least value allowed.
    pub low: f64,
    /// Largest value allowed.
    pub high: f64,
}

impl Finding {
    fn new(rule: Rule, value: f64, low: f64, high: f64, unit: f64) -> Self {
        Self { rule, value: value / unit, low: low / unit, high: high / unit }
    }
}

/// What was seen in the last cycle.
#[derive(Debug, Clone, Copy)]
struct Last {
    cycle: i64,
    set_point: SetPoint,
    /// Velocity, and the cycles that it was measured over; 0 for a commanded velocity.
    velocity: Option<(f64, f64)>,
    leader: Leader,
}

/// The controller has begun to lead the axis, or to lead it by another quantity.
#[derive(Debug, Clone, Copy)]
struct Begun {
    at: MonotonicTime,
    /// By how much its first position may be away.
    way: f64,
    /// The least and the greatest velocity that the axis had then.
    velocity: (f64, f64),
}

/// What the change since the last set-point means.
#[derive(Debug, Clone, Copy)]
struct Change {
    velocity: Option<f64>,
    /// With its resolution.
    acceleration: Option<(f64, f64)>,
    /// Of the velocity.
    resolution: f64,
    /// By how many periods updates are overdue, or were when the curve of now was made.
    overdue: f64,
}

/// When and how a set-point came.
#[derive(Debug, Clone, Copy)]
pub struct Instant {
    /// When it was sent.
    pub at: MonotonicTime,
    /// Its cycle, and the time of one.
    pub cycle: i64,
    /// Time of a cycle.
    pub cycle_time: DurationNs,
    /// What differs between controller and gateway.
    pub skew: Skew,
    /// The controller's update period.
    pub period: DurationNs,
    /// The configured limit of velocity, nanounits per second.
    pub limit: Option<f64>,
}

/// Follows the set-points of an axis.
#[derive(Debug, Clone, Default)]
pub struct Follower {
    last: Option<Last>,
    begun: Option<Begun>,
    /// Where the drive was in the last cycles, in counts, and its velocity; the newest first.
    actual: VecDeque<(i64, f64)>,
    /// By how many periods updates were overdue lately.
    overdue: VecDeque<(MonotonicTime, f64)>,
}

impl Follower {
    /// The drive is not heard.
    pub fn lose(&mut self) {
        *self = Self::default();
    }

    /// Whether it follows set-points.
    #[must_use]
    pub const fn follows(&self) -> bool {
        self.last.is_some()
    }

    /// Takes what a drive got in a cycle.
    pub fn take(
        &mut self,
        reading: &Reading,
        scaling: &Scaling,
        leader: Leader,
        curve: &Curve,
        instant: &Instant,
        statistics: &mut Statistics,
    ) -> Vec<Finding> {
        let mut found = Vec::new();
        self.actual.push_front((reading.actual_counts, reading.actual_velocity));
        self.actual.truncate(START_CYCLES);
        let overdue = self.overdue(curve, instant);
        let Some(set_point) = reading.follows else {
            (self.last, self.begun) = (None, None);
            return found;
        };
        let cycle_time = f64_from_i64(instant.cycle_time.0) / NANO;
        let count = scaling.of(set_point.quantity).abs();
        let last = self.last.take();
        if last.is_none() && set_point.quantity == Quantity::Position {
            found.extend(self.begin(set_point, scaling));
        }
        let same = last.filter(|last| last.set_point.quantity == set_point.quantity);
        let cycles = last.map_or(1, |last| (instant.cycle - last.cycle).max(1));
        let time = f64_from_i64(cycles) * cycle_time;
        let (velocity, resolution) = match set_point.quantity {
            Quantity::Position => {
                let way = same.map(|last| f64_from_i64(scaling.way(last.set_point.counts, set_point.counts)));
                (way.map(|way| way * scaling.position / time), (count + ROUNDING) / time)
            }
            Quantity::Velocity => (Some(set_point.value), count + ROUNDING),
            Quantity::Torque => (None, 0.0),
        };
        let resolution = resolution + REAL * velocity.unwrap_or(0.0).abs();
        // From the middle of one way to that of the next.
        let over = if set_point.quantity == Quantity::Position { f64_from_i64(cycles) } else { 0.0 };
        let acceleration = match (velocity, same.and_then(|last| last.velocity)) {
            (Some(velocity), Some((before, before_over))) => {
                let cycles = if over > 0.0 { (over + before_over) / 2.0 } else { f64_from_i64(cycles) };
                let time = cycles * cycle_time;
                Some(((velocity - before) / time, 2.0 * resolution / time))
            }
            _ => None,
        };
        let other =
            last.is_none_or(|last| last.leader != leader || last.set_point.quantity != set_point.quantity);
        match leader {
            Leader::Controller => {
                if other {
                    let way = self.speed() * BEGIN_PERIODS * f64_from_i64(instant.period.0) / NANO;
                    let actual = self.actual.iter().take(BEGIN_CYCLES).map(|(_, velocity)| *velocity);
                    let velocity = actual
                        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), velocity| {
                            (velocity.min(low), velocity.max(high))
                        });
                    self.begun = Some(Begun { at: instant.at, way: way + 2.0 * count + ROUNDING, velocity });
                }
                let change = Change { velocity, acceleration, resolution, overdue };
                found.extend(self.follow(set_point, &change, curve, instant, statistics));
            }
            Leader::Bounded(most) => {
                if let Some((acceleration, rounding)) = acceleration {
                    let allowed = most * CORNERS * (1.0 + SPARE) + rounding;
                    if acceleration.abs() > allowed {
                        found.push(Finding::new(Rule::Acceleration, acceleration, -allowed, allowed, NANO));
                    }
                }
            }
            Leader::Ramp(deceleration) => {
                let before = same.and_then(|last| last.velocity).map(|(before, _)| before);
                found.extend(stop(deceleration, before, velocity, acceleration, resolution));
            }
            Leader::Hold => {
                // An axis that is started while it moves is held at the speed that it had.
                let allowed = self.speed() + resolution;
                if let Some(velocity) = velocity.filter(|velocity| velocity.abs() > allowed) {
                    found.push(Finding::new(Rule::Hold, velocity, -allowed, allowed, NANO));
                }
            }
            Leader::Other => {}
        }
        if let (Some(limit), Some(velocity)) = (instant.limit, velocity) {
            let limit = limit * (1.0 + SPARE) + resolution;
            if velocity.abs() > limit && leader != Leader::Other {
                found.push(Finding::new(Rule::Limit, velocity, -limit, limit, NANO));
            }
        }
        let velocity = velocity.map(|velocity| (velocity, over));
        self.last = Some(Last { cycle: instant.cycle, set_point, velocity, leader });
        found
    }

    /// The highest actual speed lately.
    fn speed(&self) -> f64 {
        self.actual.iter().fold(0.0, |most, (_, velocity)| velocity.abs().max(most))
    }

    /// By how many periods updates are overdue, or were when the curve of now was made.
    fn overdue(&mut self, curve: &Curve, instant: &Instant) -> f64 {
        self.overdue.push_back((instant.at, curve.overdue(instant.at, instant.cycle_time, &instant.skew)));
        let end = instant.at - instant.period * MAKING_UP;
        while self.overdue.front().is_some_and(|(at, _)| *at < end) {
            self.overdue.pop_front();
        }
        self.overdue.iter().fold(0.0, |most, (_, periods)| periods.max(most))
    }

    /// The first set-point of a drive that begins to follow: where the drive is, or was when it was switched on, to a count
    /// of the controller, which is some of the drive's, and its rounding.
    fn begin(&self, set_point: SetPoint, scaling: &Scaling) -> Option<Finding> {
        const ALLOWED: f64 = 4.0;
        let ways = self.actual.iter().map(|(actual, _)| f64_from_i64(scaling.way(*actual, set_point.counts)));
        let away = ways.fold(f64::INFINITY, |least, way| if way.abs() < least.abs() { way } else { least });
        let unit = NANO / scaling.position.abs();
        (away.abs() > ALLOWED).then(|| Finding::new(Rule::Begin, away, -ALLOWED, ALLOWED, unit))
    }

    /// A set-point of the controller.
    fn follow(
        &self,
        set_point: SetPoint,
        change: &Change,
        curve: &Curve,
        instant: &Instant,
        statistics: &mut Statistics,
    ) -> Vec<Finding> {
        let mut found = Vec::new();
        let Instant { at, cycle_time, skew, .. } = instant;
        let Change { velocity, acceleration, resolution, overdue } = *change;
        let mut check = |rule, band: &Band, value, resolution, unit| {
            if !band.allows(value, resolution) {
                let room = band.tolerance + resolution;
                found.push(Finding::new(rule, value, band.low - room, band.high + room, unit));
            }
        };
        if set_point.quantity == Quantity::Torque {
            if let Some(band) = curve.torque(*at, overdue, skew) {
                // Drives take torques in thousandths, and round them.
                check(Rule::Torque, &band, set_point.value, 1_000.0, PERCENT);
            }
            return found;
        }
        let period = f64_from_i64(instant.period.0) / NANO;
        let cycle = f64_from_i64(cycle_time.0) / NANO;
        let begun = self.begun.filter(|begun| at.since(begun.at) < instant.period * 8);
        let begins = begun.filter(|_| set_point.quantity == Quantity::Velocity).map(|begun| begun.velocity);
        let Some(mut bands) = curve.bands(*at, *cycle_time, overdue, skew) else {
            // The curve begins later: until then the axis goes on.
            if let (Some((low, high)), Some(velocity)) = (begins, velocity) {
                let tolerance = BEGIN_OVERSHOOT * low.abs().max(high.abs());
                check(Rule::Velocity, &Band { low, high, tolerance }, velocity, resolution, NANO);
            }
            return found;
        };
        statistics.add(velocity, acceleration.map(|(value, _)| value), &bands);
        if let Some((low, high)) = begins {
            // It begins at the speed that the axis has, and is on the curve a period later.
            let band = &mut bands.velocity;
            (band.low, band.high) = (band.low.min(low), band.high.max(high));
            band.tolerance += BEGIN_OVERSHOOT * (band.high - band.low);
        } else if let Some(begun) = begun {
            // The way from where the axis was held to the controller's first position is made in one period: by a
            // polynomial of third order that was at rest before.
            bands.velocity.tolerance += 11.0 / 6.0 * begun.way / period;
        }
        if let Some(begun) = begun {
            bands.acceleration.tolerance += 2.0 * 11.0 / 6.0 * begun.way / period / cycle;
        }
        if let Some(velocity) = velocity {
            check(Rule::Velocity, &bands.velocity, velocity, resolution, NANO);
        }
        if let Some((acceleration, resolution)) = acceleration {
            check(Rule::Acceleration, &bands.acceleration, acceleration, resolution, NANO);
        }
        found
    }
}

/// A set-point of the gateway's ramp: no faster than the one before, and no harder than the deceleration.
fn stop(
    deceleration: f64,
    before: Option<f64>,
    velocity: Option<f64>,
    acceleration: Option<(f64, f64)>,
    resolution: f64,
) -> Option<Finding> {
    let (before, velocity, (acceleration, rounding)) = (before?, velocity?, acceleration?);
    let toward = if before < 0.0 { -1.0 } else { 1.0 };
    let (low, high) = (-deceleration * (1.0 + REAL) - rounding, rounding);
    let slowing = acceleration * toward;
    let stands = velocity.abs() <= resolution && before.abs() <= resolution;
    (!stands && !(low..=high).contains(&slowing)).then(|| Finding::new(Rule::Stop, slowing, low, high, NANO))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: DurationNs = DurationNs::from_millis(4);
    const CYCLE: DurationNs = DurationNs::from_millis(2);
    const SCALING: Scaling =
        Scaling { position: 1_000.0, velocity: 1.0, torque: 1.0, modulo: 1 << 32, turn: 1.0, way_round: 1 };

    /// Follows a controller at one unit per second; `counts` is what the drive gets in a cycle, each of 1000 nanounits.
    fn follows(counts: impl Fn(i64) -> i64) -> Vec<Rule> {
        let (mut curve, mut follower) = (Curve::default(), Follower::default());
        let (mut found, mut statistics) = (Vec::new(), Statistics::default());
        for cycle in 0..100_i64 {
            let at = MonotonicTime::ZERO + CYCLE * cycle;
            if cycle % 2 == 0 {
                let id = u8::try_from(cycle / 2).unwrap();
                let value = f64::from(id) * 4e6;
                curve.sent(at, id, PERIOD, 2, Some((Quantity::Position, value)), None);
                curve.taken(at, id);
            }
            let counts = counts(cycle);
            let set_point = SetPoint { quantity: Quantity::Position, counts, value: 0.0 };
            let follows = Some(set_point).filter(|_| cycle > 40);
            let reading = Reading { mark: 0, follows, actual_counts: counts, actual_velocity: 0.0 };
            let skew = Skew { synchronous: true, ..Skew::default() };
            let instant = Instant { at, cycle, cycle_time: CYCLE, skew, period: PERIOD, limit: Some(5e9) };
            let new =
                follower.take(&reading, &SCALING, Leader::Controller, &curve, &instant, &mut statistics);
            found.extend(new.into_iter().map(|found| found.rule));
        }
        found
    }

    #[test]
    fn set_points_on_the_curve_are_allowed_and_others_are_not() {
        // A millisecond is 1000 counts; 6 ms behind the controller, and over the end of the 32 bits.
        let on_the_curve =
            |cycle: i64| (cycle * 2_000 - 6_000 + 0x7FFF_0000 + (1 << 31)) % (1 << 32) - (1 << 31);
        assert_eq!(follows(on_the_curve), []);
        let jumps = follows(|cycle| on_the_curve(cycle) + if cycle >= 80 { 100 } else { 0 });
        assert_eq!(jumps, [Rule::Velocity, Rule::Acceleration, Rule::Acceleration]);
        let stands = follows(|cycle| on_the_curve(cycle.min(80)));
        assert_eq!(stands[..2], [Rule::Velocity, Rule::Acceleration]);
        let noise = follows(|cycle| on_the_curve(cycle) + cycle % 2 * 3);
        assert!(noise.contains(&Rule::Velocity), "{noise:?}");
        assert!(follows(|cycle| on_the_curve(cycle) * 6).contains(&Rule::Limit));
    }

    #[test]
    fn a_drive_begins_where_it_is() {
        let mut follower = Follower::default();
        let reading = |counts, follows: bool| {
            let set_point = SetPoint { quantity: Quantity::Position, counts, value: 0.0 };
            let follows = Some(set_point).filter(|_| follows);
            Reading { mark: 0, follows, actual_counts: 500, actual_velocity: 0.0 }
        };
        let instant = |cycle| Instant {
            at: MonotonicTime::ZERO + CYCLE * cycle,
            cycle,
            cycle_time: CYCLE,
            skew: Skew::default(),
            period: PERIOD,
            limit: None,
        };
        let mut take = |reading, cycle| {
            let (curve, mut statistics) = (Curve::default(), Statistics::default());
            follower.take(&reading, &SCALING, Leader::Hold, &curve, &instant(cycle), &mut statistics)
        };
        assert_eq!(take(reading(900, false), 0), []);
        assert_eq!(take(reading(501, true), 1), []);
        assert_eq!(take(reading(501, true), 2), []);
        assert_eq!(take(reading(600, true), 3)[0].rule, Rule::Hold);
        assert_eq!(take(reading(600, false), 4), []);
        let found = take(reading(600, true), 5);
        assert_eq!((found[0].rule, found[0].value), (Rule::Begin, 100.0 * 1_000.0 / 1e9));
    }

    #[test]
    fn a_controller_without_a_curve_is_held_to_its_limits() {
        let found = |counts: fn(i64) -> i64| {
            let (mut follower, mut found) = (Follower::default(), Vec::new());
            for cycle in 0..60 {
                let counts = counts(cycle);
                let set_point = SetPoint { quantity: Quantity::Position, counts, value: 0.0 };
                let reading = Reading {
                    mark: 0,
                    follows: Some(set_point),
                    actual_counts: counts,
                    actual_velocity: 0.0,
                };
                let instant = Instant {
                    at: MonotonicTime::ZERO + CYCLE * cycle,
                    cycle,
                    cycle_time: CYCLE,
                    skew: Skew::default(),
                    period: PERIOD,
                    limit: Some(5e9),
                };
                let (curve, mut statistics) = (Curve::default(), Statistics::default());
                let leader = Leader::Bounded(10e9);
                found.extend(follower.take(&reading, &SCALING, leader, &curve, &instant, &mut statistics));
            }
            found.into_iter().map(|found| found.rule).collect::<Vec<_>>()
        };
        // 40 counts more in each cycle of 2 ms are 10 units/s².
        assert_eq!(found(|cycle| 20 * cycle * cycle), []);
        assert!(found(|cycle| 50 * cycle * cycle).contains(&Rule::Acceleration), "25 units/s²");
        let jump = found(|cycle| if cycle < 30 { 0 } else { 1_000 });
        assert_eq!(jump, [Rule::Acceleration, Rule::Acceleration], "there and back");
        assert_eq!(
            found(|cycle| 20 * 29 * cycle.min(30) + 20_000 * (cycle - 30).max(0)).last(),
            Some(&Rule::Limit)
        );
    }

    #[test]
    fn a_stop_is_never_harder_than_configured_nor_faster_than_before() {
        let at = |before: f64, velocity: f64| {
            let acceleration = (velocity - before) / 0.002;
            stop(10e9, Some(before), Some(velocity), Some((acceleration, 1e6)), 1e3).map(|found| found.rule)
        };
        assert_eq!(at(2e9, 1.98e9), None);
        assert_eq!(at(-2e9, -1.98e9), None);
        assert_eq!(at(2e9, 1.9e9), Some(Rule::Stop), "five times as hard");
        assert_eq!(at(2e9, 2.01e9), Some(Rule::Stop), "faster");
        assert_eq!(at(-2e9, -2.01e9), Some(Rule::Stop), "faster the other way");
        assert_eq!(at(0.01e9, 0.0), None);
        assert_eq!(at(0.0, 0.0), None);
    }
}
