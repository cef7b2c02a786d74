//! What an axis has done in its life: time in operation, revolutions and energy of its motor. Every cycle adds to it; a run of the gateway
//! begins with what the ones before have counted, where that is kept ([`crate::history`]).

use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::time::{DurationNs, MonotonicTime};

/// What lies further apart than this was not seen, and counts for nothing.
const LONGEST: DurationNs = DurationNs::from_millis(1_000);

/// An axis that stands turns to and fro by the noise of its encoder. What it goes is counted in steps of at least this, 1e-9 unit.
const STEP: u64 = 1_000_000;

/// Parts of an axis unit and of a revolution of the motor: [`Counters::sample`] is given revolutions in a unit in 1e-15.
const TURNS: i128 = 1_000_000_000_000_000;

/// 1e-9 revolution in a millionth.
const FINE_TURN: i128 = 1_000;

/// Millionths of the rated torque times 1e-9 revolution a second times nanoseconds, in a millionth.
const FINE_WORK: i128 = 1_000_000_000_000_000_000;

/// What has been counted; it only grows, but for the energy.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Totals {
    /// Time in operation.
    pub run_time: DurationNs,
    /// Revolutions of the motor in both directions, 1e-6 revolution.
    pub motor_turns: i64,
    /// What the motor has given less what it was given, 1e-6 of its rated torque times a revolution.
    pub motor_work: i64,
}

/// What a cycle brings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// When the drive has taken its values.
    pub at: MonotonicTime,
    /// The axis is in operation.
    pub running: bool,
    /// Where it is; `None` while the drive may count from another place at any moment.
    pub position: Option<Position>,
    pub velocity: Option<Velocity>,
    pub torque: Option<Torque>,
    /// Revolutions of the motor in an axis unit, 1e-15; `None` where nobody knows them.
    pub turns_per_unit: Option<i64>,
}

/// The counters of one axis.
#[derive(Debug, Default)]
pub(super) struct Counters {
    totals: Totals,
    at: Option<MonotonicTime>,
    /// The position up to which revolutions are counted.
    mark: Option<Position>,
    /// What is not yet a millionth of a revolution, 1e-9 revolution; of work, 1e-24.
    rest_of_turns: i128,
    rest_of_work: i128,
}

impl Counters {
    /// Begins with what was counted before.
    pub fn begin_with(&mut self, totals: Totals) {
        self.totals = totals;
    }

    pub const fn totals(&self) -> Totals {
        self.totals
    }

    /// The next position has nothing to do with the last one.
    pub fn restart_position(&mut self) {
        self.mark = None;
    }

    /// Takes the values of a cycle.
    pub fn sample(&mut self, sample: &Sample) {
        if let (Some(position), Some(turns)) = (sample.position, sample.turns_per_unit) {
            self.go_to(position, turns);
        } else {
            self.restart_position();
        }
        let Some(before) = self.at.replace(sample.at) else { return };
        let time = sample.at.since(before);
        if time <= DurationNs::ZERO || time > LONGEST {
            return;
        }
        if sample.running {
            self.totals.run_time = DurationNs(self.totals.run_time.0.saturating_add(time.0));
        }
        if let (Some(torque), Some(velocity), Some(turns)) =
            (sample.torque, sample.velocity, sample.turns_per_unit)
        {
            let speed = i128::from(velocity.get()) * i128::from(turns) / TURNS;
            let work = i128::from(torque.get()) * i128::from(time.0);
            let work = work.saturating_mul(speed).saturating_add(self.rest_of_work);
            self.rest_of_work = work % FINE_WORK;
            self.totals.motor_work = self.totals.motor_work.saturating_add(whole(work, FINE_WORK));
        }
    }

    fn go_to(&mut self, position: Position, turns: i64) {
        let mark = *self.mark.get_or_insert(position);
        let way = position.get().abs_diff(mark.get());
        if way < STEP {
            return;
        }
        self.mark = Some(position);
        let turned = i128::from(way) * i128::from(turns) / TURNS + self.rest_of_turns;
        self.rest_of_turns = turned % FINE_TURN;
        self.totals.motor_turns = self.totals.motor_turns.saturating_add(whole(turned, FINE_TURN));
    }
}

/// A count in parts, as whole ones.
fn whole(parts: i128, in_one: i128) -> i64 {
    i64::try_from(parts / in_one).unwrap_or(if parts < 0 { i64::MIN } else { i64::MAX })
}

#[cfg(test)]
mod tests {
    use super::*;

    const REVOLUTION: i64 = 1_000_000_000;

    fn at(millis: i64) -> MonotonicTime {
        MonotonicTime(1) + DurationNs::from_millis(millis)
    }

    /// Ten revolutions of the motor in one of the axis.
    fn sample(millis: i64, position: i64) -> Sample {
        Sample {
            at: at(millis),
            running: true,
            position: Some(Position(position)),
            velocity: Some(Velocity(2 * REVOLUTION)),
            torque: Some(Torque(500_000)),
            turns_per_unit: Some(10_000_000_000_000_000),
        }
    }

    #[test]
    fn time_in_operation_revolutions_both_ways_and_work_are_counted() {
        let mut counters = Counters::default();
        for millis in 0..=2_000 {
            // Two revolutions a second there, and back.
            let way = if millis <= 1_000 { millis } else { 2_000 - millis };
            let velocity = Velocity(if millis <= 1_000 { 2 * REVOLUTION } else { -2 * REVOLUTION });
            let one = sample(millis, way * 2 * REVOLUTION / 1_000);
            let torque = Torque(if millis <= 1_000 { 500_000 } else { 250_000 });
            counters.sample(&Sample { velocity: Some(velocity), torque: Some(torque), ..one });
        }
        let totals = counters.totals();
        assert_eq!(totals.run_time, DurationNs::from_secs(2));
        assert_eq!(totals.motor_turns, 40_000_000, "20 there and 20 back");
        // Half the rated torque for 20 revolutions, less a quarter for 20.
        assert_eq!(totals.motor_work, 5_000_000);
        counters.sample(&Sample { running: false, velocity: None, ..sample(2_001, 0) });
        assert_eq!(counters.totals(), totals, "it stands, without torque");
    }

    #[test]
    fn what_was_counted_before_is_gone_on_with() {
        let before =
            Totals { run_time: DurationNs::from_secs(3_600), motor_turns: 7, motor_work: i64::MAX - 1 };
        let mut counters = Counters::default();
        counters.begin_with(before);
        counters.sample(&sample(0, 0));
        counters.sample(&sample(100, REVOLUTION / 5));
        let totals = counters.totals();
        assert_eq!(totals.run_time, DurationNs::from_millis(3_600_100));
        assert_eq!((totals.motor_turns, totals.motor_work), (2_000_007, i64::MAX), "it does not overflow");
    }

    #[test]
    fn parts_add_up_and_noise_does_not() {
        let mut counters = Counters::default();
        // 1.5e-3 revolution of the motor in a cycle, for 1000 cycles.
        for cycle in 0..=1_000 {
            counters.sample(&Sample { velocity: Some(Velocity(1_003)), ..sample(cycle, cycle * 150_001) });
        }
        let totals = counters.totals();
        // The last step of less than a thousandth of a unit is not counted yet.
        assert!((1_490_000..=1_500_010).contains(&totals.motor_turns), "{totals:?}");
        // Half the rated torque and 10.03e-6 revolutions.
        assert_eq!(totals.motor_work, 5);
        let before = counters.totals().motor_turns;
        for cycle in 1_001..10_000 {
            let noise = if cycle % 2 == 0 { 400_000 } else { -400_000 };
            counters.sample(&sample(cycle, 150_001_000 + noise));
        }
        assert!(counters.totals().motor_turns - before <= 20_000, "one step at the most");
    }

    #[test]
    fn what_was_not_seen_does_not_count() {
        let mut counters = Counters::default();
        counters.sample(&sample(0, 0));
        counters.sample(&Sample { position: None, ..sample(100, 0) });
        counters.sample(&sample(200, 50 * REVOLUTION));
        assert_eq!(counters.totals().motor_turns, 0, "the drive has begun to count from another place");
        counters.restart_position();
        counters.sample(&sample(300, 90 * REVOLUTION));
        assert_eq!(counters.totals().motor_turns, 0, "and again");
        let totals = counters.totals();
        counters.sample(&sample(10_300, 90 * REVOLUTION));
        counters.sample(&sample(9_000, 90 * REVOLUTION));
        assert_eq!(counters.totals(), totals, "ten seconds that nobody has seen, and a clock that goes back");
        counters.sample(&Sample { turns_per_unit: None, ..sample(9_100, 91 * REVOLUTION) });
        let turns = counters.totals();
        assert_eq!((turns.motor_turns, turns.motor_work), (0, totals.motor_work), "its gear is not known");
    }
}
