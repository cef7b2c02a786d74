//! The controller's own curve of one axis, from its updates as it sent them, and the band that it leaves to a set-point.
//!
//! A set-point that is made from updates P0, P1, P2, ... depends on those of a window of time. Its velocity is one that the
//! curve has in this window, widened by what a polynomial through the updates may overshoot. With backward differences
//! ∇ of the positions, in update periods T, the polynomial of third order through the last four is
//!
//! ```text
//! P(s)   = P3 + s ∇ + s(s+1)/2 ∇² + s(s+1)(s+2)/6 ∇³        s = -1..0 between the last two, above 0 beyond the last
//! P'(s)  =          ∇ + (2s+1)/2 ∇² + (3s²+6s+2)/6 ∇³
//! P''(s) =                      ∇² +         (s+1) ∇³
//! ```
//!
//! and where one polynomial follows another the velocity steps by a third of ∇⁴. At constant velocity all differences above
//! ∇ are zero: then nothing is widened but by the resolution of the values.

use std::collections::VecDeque;

use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::cast::f64_from_i64;
use profile_generic::time::{DurationNs, MonotonicTime};

/// Updates kept.
const UPDATES_MAX: usize = 256;

/// Periods from an update to the set-points that no longer depend on it when nothing is late: it is sent, is used from one
/// period later at the latest, leads to its target two periods after its stamp, and three further updates are led by a
/// polynomial that goes through it.
const PERIODS: f64 = 6.0;

/// Updates whose arrival is looked at for how irregular arrivals are.
const ARRIVALS: usize = 64;

/// What operation without a shared clock may add to the velocity, as a part of it: what is promised at an arrival jitter
/// of a tenth of a period (docs/tasks/configure-axes.md), and in proportion beyond that.
const RIPPLE: f64 = 0.02;
const RIPPLE_JITTER: f64 = 0.1;

/// Nanoseconds in a second.
const SECOND: f64 = 1e9;

/// What set-points are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Nanounits.
    Position,
    /// Nanounits per second.
    Velocity,
    /// Parts per million of the rated torque.
    Torque,
}

impl Quantity {
    /// What a Control Mode commands; `None` for what no drive here is commanded by.
    #[must_use]
    pub const fn of(mode: ControlMode) -> Option<Self> {
        match mode {
            ControlMode::POSITION => Some(Self::Position),
            ControlMode::VELOCITY => Some(Self::Velocity),
            ControlMode::TORQUE => Some(Self::Torque),
            _ => None,
        }
    }
}

/// One update.
#[derive(Debug, Clone, Copy)]
struct Update {
    /// Periods since the first update, those without one included.
    number: i64,
    sent: MonotonicTime,
    /// When its period began: when it would have been sent without delay.
    tick: MonotonicTime,
    /// When the gateway took it.
    taken: Option<MonotonicTime>,
    quantity: Option<Quantity>,
    value: f64,
    /// Periods from its stamp to its target.
    ahead: f64,
}

/// What differs between the time of the updates and that of the set-points.
#[derive(Debug, Clone, Copy, Default)]
pub struct Skew {
    /// Whether both share a clock.
    pub synchronous: bool,
    /// How far the controller's system time is ahead of the gateway's.
    pub offset: DurationNs,
    /// What one clock gains on the other in a second, in seconds.
    pub drift: f64,
}

/// What the curve allows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Lowest and highest value of the curve in the window.
    pub low: f64,
    /// Highest.
    pub high: f64,
    /// By how much a set-point may lie outside.
    pub tolerance: f64,
}

impl Band {
    /// How far a value is outside of the curve; 0 within it.
    #[must_use]
    pub fn outside(&self, value: f64) -> f64 {
        (value - self.high).max(self.low - value).max(0.0)
    }

    /// Whether the value is allowed.
    #[must_use]
    pub fn allows(&self, value: f64, resolution: f64) -> bool {
        self.outside(value) <= self.tolerance + resolution
    }
}

/// Bands of one set-point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bands {
    /// Nanounits per second.
    pub velocity: Band,
    /// Nanounits per second squared.
    pub acceleration: Band,
}

/// The curve of an axis.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    updates: VecDeque<Update>,
    last_id: Option<(u8, i64)>,
    /// The controller's update period in true time.
    period: DurationNs,
}

impl Curve {
    /// Forgets the updates of another connection.
    pub fn restart(&mut self) {
        self.updates.clear();
        self.last_id = None;
    }

    /// The update ID goes on by one each period; what goes back by less than half of its range is an older update.
    fn number(&self, id: u8) -> i64 {
        let Some((last, number)) = self.last_id else { return 0 };
        let step = i64::from(id.wrapping_sub(last));
        number + if step <= 127 { step } else { step - 256 }
    }

    /// Takes an update with this ID that was sent at `now`; the value of an integer position rolls over at `modulo`.
    pub fn sent(
        &mut self,
        now: MonotonicTime,
        id: u8,
        period: DurationNs,
        ahead: u8,
        commanded: Option<(Quantity, f64)>,
        modulo: Option<f64>,
    ) {
        self.period = period;
        let number = self.number(id);
        let last = self.updates.back().copied();
        if last.is_none_or(|last| number > last.number) {
            self.last_id = Some((id, number));
        }
        if self.updates.iter().any(|known| known.number == number) {
            return;
        }
        let tick = last.map_or(now, |last| now.min(last.tick + period * (number - last.number)));
        let mut value = commanded.map_or(0.0, |(_, value)| value);
        let before = last.filter(|last| last.quantity == Some(Quantity::Position)).map(|last| last.value);
        if let (Some((Quantity::Position, _)), Some(before), Some(modulo)) = (commanded, before, modulo) {
            value += ((before - value) / modulo).round() * modulo;
        }
        let quantity = commanded.map(|(quantity, _)| quantity);
        let update =
            Update { number, sent: now, tick, taken: None, quantity, value, ahead: f64::from(ahead) };
        let place = self.updates.iter().position(|known| known.number > number).unwrap_or(self.updates.len());
        self.updates.insert(place, update);
        if self.updates.len() > UPDATES_MAX {
            self.updates.pop_front();
        }
    }

    /// The gateway has taken the update with this ID.
    pub fn taken(&mut self, now: MonotonicTime, id: u8) {
        let number = self.number(id);
        if let Some(update) = self.updates.iter_mut().find(|known| known.number == number) {
            update.taken.get_or_insert(now);
        }
    }

    /// By how many periods the set-points of `at` are beyond the target of the newest update that had been taken then.
    #[must_use]
    pub fn overdue(&self, at: MonotonicTime, cycle: DurationNs, skew: &Skew) -> f64 {
        let period = f64_from_i64(self.period.0);
        let newest = self.updates.iter().rev().find(|update| update.taken.is_some_and(|taken| taken <= at));
        let Some(newest) = newest else { return 0.0 };
        let passed = f64_from_i64((at + cycle).since(newest.tick).0);
        // A controller that is behind has targets that are past; without a shared clock an update counts from its arrival.
        let offset = if skew.synchronous { f64_from_i64(skew.offset.0) } else { period };
        ((passed - offset) / period - if skew.synchronous { newest.ahead } else { 1.0 }).max(0.0)
    }

    /// How irregular arrivals are: the longest way of an update less the shortest, in periods.
    fn arrival_jitter(&self) -> f64 {
        let ways = self.updates.iter().rev().take(ARRIVALS);
        let ways = ways.filter_map(|update| update.taken.map(|taken| taken.since(update.tick).0));
        let (least, most) = ways.fold((i64::MAX, i64::MIN), |(a, b), way| (a.min(way), b.max(way)));
        if least > most { 0.0 } else { f64_from_i64(most - least) / f64_from_i64(self.period.0) }
    }

    /// The part of the curve that set-points at `at` may depend on: velocities (or torques) with the number of the update.
    fn window(&self, at: MonotonicTime, beyond: f64, skew: &Skew) -> Vec<(i64, Quantity, f64)> {
        let period = f64_from_i64(self.period.0);
        // Updates of a controller that is ahead wait for their time.
        let waiting = f64_from_i64(skew.offset.0.max(0)) / period;
        let periods = PERIODS + beyond.ceil() + waiting + if skew.synchronous { 0.0 } else { 1.0 };
        let jitter = self.arrival_jitter();
        let span = (periods + jitter) * period;
        let mut found = Vec::new();
        let mut before: Option<&Update> = None;
        for update in self.updates.iter().filter(|update| update.sent <= at) {
            let age = f64_from_i64(at.since(update.tick).0);
            match (update.quantity, before) {
                _ if age > span => {}
                (Some(Quantity::Position), Some(before)) if before.quantity == Some(Quantity::Position) => {
                    let time = period * f64_from_i64(update.number - before.number) / SECOND;
                    found.push((update.number, Quantity::Position, (update.value - before.value) / time));
                }
                (Some(quantity @ (Quantity::Velocity | Quantity::Torque)), _) => {
                    found.push((update.number, quantity, update.value));
                }
                _ => {}
            }
            before = Some(update);
        }
        found
    }

    /// What the curve allows a torque at `at`, when updates are or were `beyond` periods overdue.
    #[must_use]
    pub fn torque(&self, at: MonotonicTime, beyond: f64, skew: &Skew) -> Option<Band> {
        let torques: Vec<f64> = self
            .window(at, beyond, skew)
            .into_iter()
            .filter(|(_, quantity, _)| *quantity == Quantity::Torque)
            .map(|(.., value)| value)
            .collect();
        let (low, high) = hull(&torques)?;
        let slope = differences(&torques).iter().fold(0.0_f64, |most, step| most.max(step.abs()));
        Some(Band { low, high, tolerance: slope * beyond })
    }

    /// What the curve allows a set-point at `at`, of a bus with this cycle, when updates are or were `beyond` periods
    /// overdue.
    #[must_use]
    pub fn bands(&self, at: MonotonicTime, cycle: DurationNs, beyond: f64, skew: &Skew) -> Option<Bands> {
        let window = self.window(at, beyond, skew);
        let numbers: Vec<i64> = window.iter().map(|(number, ..)| *number).collect();
        let velocities: Vec<f64> = window
            .iter()
            .filter(|(_, quantity, _)| *quantity != Quantity::Torque)
            .map(|(.., value)| *value)
            .collect();
        let (low, high) = hull(&velocities)?;
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let (period, cycle) = (f64_from_i64(self.period.0) / SECOND, f64_from_i64(cycle.0) / SECOND);
        // Differences of the velocities, in units per second: ∇², ∇³ and ∇⁴ over T.
        let second = differences(&velocities);
        let third = differences(&second);
        let fourth = differences(&third);
        let (d2, d3, d4) = (largest(&second), largest(&third), largest(&fourth));
        // P' and P'' between the last two updates, or as far beyond as updates are overdue; a curve is followed one period
        // beyond its end, and goes on straight from there.
        let s = beyond.min(1.0);
        let mut velocity = (s + 0.5) * d2 + f64::max(1.0 / 3.0, (3.0 * s * s + 6.0 * s + 2.0) / 6.0) * d3;
        if beyond > 0.0 {
            // The curve goes on to where the controller does not go: what slows down goes on slowing down, and positions
            // that were not sent are wrong by up to `away`, which is taken back over a period.
            let n = beyond.ceil();
            let away = (n + 1.0) * (n + 2.0) / 2.0 * d2;
            velocity += (n + 1.0) * d2 + away;
        }
        let fastest = low.abs().max(high.abs());
        let mut part = skew.drift;
        if !skew.synchronous {
            part += RIPPLE * (self.arrival_jitter() / RIPPLE_JITTER).max(1.0);
        }
        velocity += part * fastest;
        let gaps = numbers.windows(2).map(|pair| f64_from_i64((pair[1] - pair[0]).max(1)) * period);
        let accelerations: Vec<f64> = second.iter().zip(gaps).map(|(step, time)| step / time).collect();
        let (least, most) = hull(&accelerations).unwrap_or((0.0, 0.0));
        let mut acceleration = (s + 1.0) * d3 / period + d4 / (3.0 * cycle);
        if beyond > 0.0 {
            // One polynomial ends somewhere in the band of velocities, and the next begins somewhere in it.
            acceleration += 2.0 * velocity / cycle;
        }
        acceleration += 2.0 * part * fastest / cycle;
        Some(Bands {
            velocity: Band { low, high, tolerance: velocity },
            acceleration: Band { low: least.min(0.0), high: most.max(0.0), tolerance: acceleration },
        })
    }
}

fn hull(values: &[f64]) -> Option<(f64, f64)> {
    let first = *values.first()?;
    Some(values.iter().fold((first, first), |(low, high), value| (low.min(*value), high.max(*value))))
}

fn differences(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: DurationNs = DurationNs::from_millis(4);
    const CYCLE: DurationNs = DurationNs::from_millis(2);
    const SHARED: Skew = Skew { synchronous: true, offset: DurationNs::ZERO, drift: 0.0 };

    /// A curve of positions by time in seconds, whose updates all arrive at once.
    fn curve(updates: u8, position: impl Fn(f64) -> f64) -> Curve {
        let mut curve = Curve::default();
        for id in 0..updates {
            let now = MonotonicTime::ZERO + PERIOD * i64::from(id);
            let value = position(f64::from(id) * 0.004);
            curve.sent(now, id, PERIOD, 2, Some((Quantity::Position, value)), None);
            curve.taken(now, id);
        }
        curve
    }

    fn allowed(curve: &Curve, at: MonotonicTime, skew: &Skew) -> Bands {
        curve.bands(at, CYCLE, curve.overdue(at, CYCLE, skew), skew).unwrap()
    }

    fn at(updates: i64) -> MonotonicTime {
        MonotonicTime::ZERO + PERIOD * updates
    }

    #[test]
    fn constant_velocity_leaves_no_room() {
        let bands = allowed(&curve(40, |t| 2e9 * t), at(39), &SHARED);
        assert!((bands.velocity.low - 2e9).abs() < 10.0 && (bands.velocity.high - 2e9).abs() < 10.0);
        assert!(bands.velocity.tolerance < 10.0, "{bands:?}");
        assert!(bands.acceleration.tolerance < 10_000.0, "{bands:?}");
        // Nor do updates that are overdue.
        let bands = allowed(&curve(40, |t| 2e9 * t), at(43), &SHARED);
        assert!(bands.velocity.tolerance < 100.0, "{bands:?}");
        assert!(!bands.velocity.allows(2.001e9, 1e5));
    }

    #[test]
    fn an_accelerating_axis_has_the_velocities_of_the_window() {
        // 10 units/s²: 40 milliunits per second more in each period.
        let bands = allowed(&curve(60, |t| 5e9 * t * t), at(59), &SHARED);
        assert!(bands.velocity.high - bands.velocity.low < 10.0 * 0.04e9, "{bands:?}");
        assert!((bands.velocity.tolerance - 0.02e9).abs() < 1e3, "half of ∇²: {bands:?}");
        assert!((bands.acceleration.high - 10e9).abs() < 1e6, "{bands:?}");
        let late = allowed(&curve(60, |t| 5e9 * t * t), at(62), &SHARED);
        assert!(late.velocity.tolerance > 0.1e9, "the way to the next update is longer: {late:?}");
    }

    #[test]
    fn a_lost_update_leaves_the_curve_as_it_is() {
        let mut curve = Curve::default();
        for id in (250..=255).chain(0..20).filter(|id| *id != 253 && *id != 2) {
            let periods = i64::from(u8::wrapping_sub(id, 250));
            let now = MonotonicTime::ZERO + PERIOD * periods;
            let value = 1e9 * f64_from_i64(periods) * 0.004;
            curve.sent(now, id, PERIOD, 2, Some((Quantity::Position, value)), None);
            curve.taken(now, id);
        }
        let bands = allowed(&curve, at(25), &SHARED);
        assert!((bands.velocity.high - 1e9).abs() < 10.0 && bands.velocity.tolerance < 10.0, "{bands:?}");
    }

    #[test]
    fn an_integer_position_rolls_over() {
        let mut curve = Curve::default();
        for id in 0..20_u8 {
            let whole = 1_000.0 * f64::from(id);
            let now = MonotonicTime::ZERO + PERIOD * i64::from(id);
            curve.sent(now, id, PERIOD, 2, Some((Quantity::Position, whole % 4_096.0)), Some(4_096.0));
            curve.taken(now, id);
        }
        let bands = allowed(&curve, at(19), &SHARED);
        assert!(
            (bands.velocity.low - 250_000.0).abs() < 1e-6 && bands.velocity.tolerance < 1e-6,
            "{bands:?}"
        );
    }

    #[test]
    fn without_a_shared_clock_the_promised_ripple_is_allowed() {
        let asynchronous = Skew { synchronous: false, ..SHARED };
        let bands = allowed(&curve(40, |t| 1e9 * t), at(39), &asynchronous);
        assert!(bands.velocity.allows(1.019e9, 0.0) && !bands.velocity.allows(1.021e9, 0.0), "{bands:?}");
    }
}
