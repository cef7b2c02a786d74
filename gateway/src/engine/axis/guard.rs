//! The last look at a set-point before it goes into a telegram: what the change since the one before means in velocity and
//! acceleration, against the axis's limits.
//!
//! A drive goes from one set-point to the next in one cycle of its bus, however long ago the one before was sent. The velocity of a
//! step over cycles that were left out is judged as the drive would move: in one cycle. Its acceleration is that of the curve, as a
//! drive that misses a telegram goes on by itself.
//!
//! A set-point beyond a limit is not sent and not clamped: the axis goes on for this cycle as it was, and stops from there.

use std::fmt;

use profile_generic::cast;
use profile_generic::fault::FaultCause;
use profile_generic::image::AxisCommand;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Acceleration, Position, Quantity, Velocity};
use profile_generic::time::DurationNs;

const SECOND: i128 = 1_000_000_000;

/// A tenth to spare beyond each limit.
const SPARE: (i128, i128) = (11, 10);

/// The velocity of set-points that are placed by their arrivals is uneven by this part: 2 %.
const RIPPLE_DIVISOR: i128 = 50;

/// Counts by which the curve through rounded set-points may be off, at both ends of a cycle.
const ROUNDING_COUNTS: i128 = 8;

/// Who leads the command of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Lead {
    /// Nobody: it shows the drive its own position, and the drive does not follow it.
    #[default]
    Nobody,
    /// The gateway: it holds, or ramps down.
    Gateway,
    /// Set-points lead: velocity and acceleration are judged.
    SetPoints,
}

/// What a cycle is judged by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Highest velocity, either direction.
    pub velocity: Option<Velocity>,
    /// Highest acceleration and deceleration.
    pub acceleration: Option<Acceleration>,
    /// Longest way of a drive that works modulo: a longer one would lead it backward.
    pub step: Option<i64>,
    /// Cycle of the bus.
    pub cycle: DurationNs,
    /// Time since the cycle before: longer where cycles were left out.
    pub elapsed: DurationNs,
    /// Time between the controller's updates.
    pub period: DurationNs,
    /// The controller's position count in nanounits.
    pub count: i64,
}

/// A limit that a set-point has exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trip {
    /// What is limited: position, velocity or acceleration.
    pub quantity: Quantity,
    /// The value of the set-point, in the unit of the quantity.
    pub value: i64,
    /// The limit, in the same unit.
    pub limit: i64,
    /// By how much the cycle was late in which it was found.
    pub late: DurationNs,
}

impl fmt::Display for Trip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = match self.quantity {
            Quantity::Velocity => "u/s",
            Quantity::Acceleration => "u/s2",
            _ => "u",
        };
        let units = |nanounits: i64| cast::f64_from_i64(nanounits) / 1e9;
        write!(
            f,
            "set-point with {} {:.3} {unit}, limit {:.3} {unit}, in a cycle that was {} late",
            self.quantity,
            units(self.value),
            units(self.limit),
            self.late
        )
    }
}

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Finding {
    pub cause: FaultCause,
    pub trip: Trip,
}

/// The command that was sent last.
#[derive(Debug, Clone, Copy)]
struct Sent {
    lead: Lead,
    mode: OperatingMode,
    position: Position,
    velocity: Velocity,
}

/// Judges the commands of one axis.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Guard {
    sent: Option<Sent>,
}

impl Guard {
    /// Judges the command of a cycle that is `late`. One beyond a limit is replaced by one that goes on as the one before.
    /// `actual` is the velocity of the drive: that of a command that nobody leads.
    pub fn judge(
        &mut self,
        command: &mut AxisCommand,
        lead: Lead,
        actual: Velocity,
        bounds: &Bounds,
        late: DurationNs,
    ) -> Option<Finding> {
        let finding = self.find(command, lead, bounds, late);
        if finding.is_some()
            && let Some(sent) = self.sent
        {
            command.position = sent.position.saturating_add(way(sent.velocity, bounds.cycle));
            command.velocity = sent.velocity;
        }
        let velocity = match (lead, finding, self.sent) {
            (Lead::Nobody, ..) => actual,
            (_, Some(_), Some(sent)) => sent.velocity,
            _ => self.velocity(command, bounds.elapsed).unwrap_or(actual),
        };
        self.sent = Some(Sent { lead, mode: command.mode, position: command.position, velocity });
        finding
    }

    /// The velocity that a command means; `None` when it is none of position or velocity.
    fn velocity(&self, command: &AxisCommand, time: DurationNs) -> Option<Velocity> {
        match (command.mode, self.sent) {
            (OperatingMode::Position, Some(sent)) if sent.mode == OperatingMode::Position => {
                let way = i128::from(command.position.get()) - i128::from(sent.position.get());
                Some(Velocity(saturate(way * SECOND / i128::from(time.as_nanos().max(1)))))
            }
            // The first position after another mode has no position before it.
            (OperatingMode::Position | OperatingMode::Velocity, _) => Some(command.velocity),
            _ => None,
        }
    }

    fn find(&self, command: &AxisCommand, lead: Lead, bounds: &Bounds, late: DurationNs) -> Option<Finding> {
        if lead == Lead::Nobody {
            return None;
        }
        let found = |cause, quantity, value, limit| {
            Some(Finding { cause, trip: Trip { quantity, value, limit, late } })
        };
        let positions =
            |sent: &Sent| (command.mode, sent.mode) == (OperatingMode::Position, OperatingMode::Position);
        if let (Some(step), Some(sent)) = (bounds.step, self.sent.filter(positions)) {
            let way = command.position.saturating_sub(sent.position).get();
            if way.unsigned_abs() > step.unsigned_abs() {
                return found(FaultCause::VELOCITY_COMMAND_LIMIT, Quantity::Position, way, step);
            }
        }
        let velocity = self.velocity(command, bounds.cycle)?;
        let speed = i128::from(velocity.get()).abs();
        if let Some(limit) = bounds.velocity
            && speed * SPARE.1 > i128::from(limit.get()).abs() * SPARE.0
        {
            return found(
                FaultCause::VELOCITY_COMMAND_LIMIT,
                Quantity::Velocity,
                velocity.get(),
                limit.get(),
            );
        }
        // A stop may be as hard as it was set up to be; out of it, and out of nothing, the set-points begin where it is.
        let sent = self.sent.filter(|sent| lead == Lead::SetPoints && sent.lead != Lead::Nobody)?;
        let limit = bounds.acceleration?;
        let velocity = self.velocity(command, bounds.elapsed)?;
        let change = i128::from(velocity.get()) - i128::from(sent.velocity.get());
        let (cycle, period) = (i128::from(bounds.elapsed.as_nanos()), i128::from(bounds.period.as_nanos()));
        // The controller may change the velocity from one update to the next, and the curve between two updates is steeper at one
        // of its ends than the way from one to the other.
        let allowed = i128::from(limit.get()).abs() * SPARE.0 / SPARE.1 * (period + cycle) / SECOND
            + speed / RIPPLE_DIVISOR
            + ROUNDING_COUNTS * i128::from(bounds.count) * SECOND / period.min(cycle).max(1);
        if change.abs() > allowed {
            let value = saturate(change * SECOND / cycle.max(1));
            return found(FaultCause::ACCELERATION_COMMAND_LIMIT, Quantity::Acceleration, value, limit.get());
        }
        None
    }
}

/// The way at a velocity in a time.
pub(super) fn way(velocity: Velocity, span: DurationNs) -> Position {
    Position(saturate(i128::from(velocity.get()) * i128::from(span.as_nanos()) / SECOND))
}

fn saturate(value: i128) -> i64 {
    i64::try_from(value).unwrap_or(if value > 0 { i64::MAX } else { i64::MIN })
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::quantity::Torque;
    use proptest::prelude::*;

    const UNIT: i64 = 1_000_000_000;
    const CYCLE: DurationNs = DurationNs::from_millis(2);

    fn bounds() -> Bounds {
        Bounds {
            velocity: Some(Velocity(50 * UNIT)),
            acceleration: Some(Acceleration(200 * UNIT)),
            step: None,
            cycle: CYCLE,
            elapsed: CYCLE,
            period: DurationNs::from_millis(4),
            count: 1_000,
        }
    }

    fn at(position: i64) -> AxisCommand {
        AxisCommand { mode: OperatingMode::Position, position: Position(position), ..AxisCommand::default() }
    }

    fn at_speed(velocity: i64) -> AxisCommand {
        AxisCommand { mode: OperatingMode::Velocity, velocity: Velocity(velocity), ..AxisCommand::default() }
    }

    /// Sends commands led by set-points; gives the findings with their places.
    fn sends(guard: &mut Guard, bounds: &Bounds, commands: &[AxisCommand]) -> Vec<(usize, Trip)> {
        let mut findings = Vec::new();
        for (place, command) in commands.iter().enumerate() {
            let mut command = *command;
            let found = guard.judge(
                &mut command,
                Lead::SetPoints,
                Velocity::ZERO,
                bounds,
                DurationNs::from_micros(7),
            );
            findings.extend(found.map(|found| (place, found.trip)));
        }
        findings
    }

    fn moving(guard: &mut Guard, bounds: &Bounds, velocity: i64) {
        // Up to speed within the acceleration, then even.
        let mut position = 0;
        for step in 0..1_000_i64 {
            let speed = (step * UNIT / 5).min(velocity);
            position += speed / 500;
            assert_eq!(sends(guard, bounds, &[at(position)]), [], "{step}");
        }
    }

    #[test]
    fn a_step_beyond_the_velocity_limit_is_replaced_by_the_motion_before() {
        let (mut guard, bounds) = (Guard::default(), bounds());
        moving(&mut guard, &bounds, 45 * UNIT);
        let before = guard.sent.unwrap();
        // Three cycles were left out: the drive would go four cycles' way in one.
        let mut command = at(before.position.get() + 4 * 45 * UNIT / 500);
        let found = guard
            .judge(&mut command, Lead::SetPoints, Velocity::ZERO, &bounds, DurationNs::from_micros(7_600))
            .unwrap();
        assert_eq!(found.cause, FaultCause::VELOCITY_COMMAND_LIMIT);
        assert_eq!((found.trip.value, found.trip.limit), (180 * UNIT, 50 * UNIT));
        assert_eq!(
            found.trip.to_string(),
            "set-point with velocity 180.000 u/s, limit 50.000 u/s, in a cycle that was 7.600000 ms late"
        );
        assert_eq!(command.position.get() - before.position.get(), 45 * UNIT / 500, "it goes on as it was");
        assert_eq!(command.velocity, before.velocity);
    }

    #[test]
    fn a_cycle_that_was_left_out_is_no_acceleration() {
        let (mut guard, bounds) = (Guard::default(), bounds());
        moving(&mut guard, &bounds, 10 * UNIT);
        let late = Bounds { elapsed: CYCLE * 3, ..bounds };
        let position = guard.sent.unwrap().position.get() + 3 * 10 * UNIT / 500;
        assert_eq!(sends(&mut guard, &late, &[at(position)]), []);
        assert_eq!(sends(&mut guard, &bounds, &[at(position + 10 * UNIT / 500)]), [], "it goes on as it was");
    }

    #[test]
    fn the_limits_have_a_tenth_to_spare() {
        for (velocity, expected) in [(54 * UNIT, 0), (-54 * UNIT, 0), (56 * UNIT, 1), (-56 * UNIT, 1)] {
            let bounds = Bounds { acceleration: None, ..bounds() };
            let mut guard = Guard::default();
            assert_eq!(
                sends(&mut guard, &bounds, &[at(0), at(velocity / 500)]).len(),
                expected,
                "{velocity}"
            );
            assert_eq!(sends(&mut Guard::default(), &bounds, &[at_speed(velocity)]).len(), expected);
        }
    }

    #[test]
    fn a_change_of_velocity_beyond_the_acceleration_limit_is_found() {
        let (mut guard, bounds) = (Guard::default(), bounds());
        moving(&mut guard, &bounds, 10 * UNIT);
        let position = guard.sent.unwrap().position.get();
        // 200 u/s2 over an update and a cycle are 1.2 u/s, with a tenth 1.32, and 2 % of the speed.
        assert_eq!(sends(&mut guard, &bounds, &[at(position + 11_400 * UNIT / 1_000 / 500)]), []);
        let position = guard.sent.unwrap().position.get();
        let found = sends(&mut guard, &bounds, &[at(position + 14 * UNIT / 500)]);
        let [(0, trip)] = found[..] else { panic!("{found:?}") };
        assert_eq!((trip.quantity, trip.limit), (Quantity::Acceleration, 200 * UNIT));
        assert!((trip.value - 1_300 * UNIT).abs() < UNIT, "{trip}");
    }

    #[test]
    fn a_drive_that_works_modulo_gets_no_step_beyond_half_of_it() {
        let bounds = Bounds { velocity: None, acceleration: None, step: Some(UNIT / 2), ..bounds() };
        let found = sends(&mut Guard::default(), &bounds, &[at(0), at(UNIT / 2), at(UNIT + 1)]);
        let [(2, trip)] = found[..] else { panic!("{found:?}") };
        assert_eq!((trip.quantity, trip.value, trip.limit), (Quantity::Position, UNIT / 2 + 1, UNIT / 2));
    }

    #[test]
    fn what_nobody_leads_is_not_judged_and_what_begins_then_begins_at_the_actual_velocity() {
        let (mut guard, bounds) = (Guard::default(), bounds());
        for position in [0, 5 * UNIT, -UNIT, 0] {
            let found =
                guard.judge(&mut at(position), Lead::Nobody, Velocity(9 * UNIT), &bounds, DurationNs::ZERO);
            assert_eq!(found, None);
        }
        assert_eq!(sends(&mut guard, &bounds, &[at(9 * UNIT / 500)]), [], "at the velocity that it has");
        assert_eq!(sends(&mut guard, &bounds, &[at(9 * UNIT / 500 + 60 * UNIT / 500)]).len(), 1);
    }

    #[test]
    fn a_stop_of_the_gateway_may_be_harder_than_the_limit_of_acceleration() {
        let (mut guard, bounds) = (Guard::default(), bounds());
        moving(&mut guard, &bounds, 45 * UNIT);
        let position = guard.sent.unwrap().position.get();
        let mut held = at(position);
        assert_eq!(guard.judge(&mut held, Lead::Gateway, Velocity::ZERO, &bounds, DurationNs::ZERO), None);
        assert_eq!(held.position.get(), position);
    }

    #[test]
    fn a_change_of_mode_is_judged_by_velocities() {
        let (mut guard, bounds) = (Guard::default(), bounds());
        moving(&mut guard, &bounds, 10 * UNIT);
        let position = guard.sent.unwrap().position.get();
        assert_eq!(sends(&mut guard, &bounds, &[at_speed(10 * UNIT), at_speed(10 * UNIT)]), []);
        // The position that it comes back to is where the drive is by then.
        let back = AxisCommand { velocity: Velocity(10 * UNIT), ..at(position + UNIT) };
        assert_eq!(sends(&mut guard, &bounds, &[back, at(position + UNIT + 10 * UNIT / 500)]), []);
        assert_eq!(sends(&mut guard, &bounds, &[at_speed(30 * UNIT)]).len(), 1, "velocity steps as well");
        let torque = AxisCommand { mode: OperatingMode::Torque, torque: Torque(9), ..AxisCommand::default() };
        assert_eq!(sends(&mut guard, &bounds, &[torque]), []);
    }

    proptest! {
        /// Whatever comes, what is sent moves the drive by no more than the limit allows.
        #[test]
        fn nothing_beyond_the_velocity_limit_is_sent(positions in prop::collection::vec(any::<i64>(), 1..60)) {
            let (mut guard, bounds) = (Guard::default(), bounds());
            let mut last: Option<i64> = None;
            for position in positions {
                let mut command = at(position >> 24);
                guard.judge(&mut command, Lead::SetPoints, Velocity::ZERO, &bounds, DurationNs::ZERO);
                if let Some(last) = last {
                    prop_assert!((command.position.get() - last).abs() <= 55 * UNIT / 500 + 1);
                }
                last = Some(command.position.get());
            }
        }

        #[test]
        fn anything_is_survived(values in prop::collection::vec((any::<i64>(), any::<i64>(), 0..3_u8), 1..40)) {
            let mut guard = Guard::default();
            let bounds = Bounds { cycle: DurationNs(1), elapsed: DurationNs(1), period: DurationNs(1), count: i64::MAX, ..bounds() };
            for (position, velocity, lead) in values {
                let lead = [Lead::Nobody, Lead::Gateway, Lead::SetPoints][usize::from(lead)];
                let mut command = AxisCommand { velocity: Velocity(velocity), ..at(position) };
                guard.judge(&mut command, lead, Velocity(velocity), &bounds, DurationNs::MAX);
            }
        }
    }
}
