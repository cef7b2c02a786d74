//! Set-points: the mode, command values of the master, and the ways that the drive makes by itself.

use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::servo::motion::{Motion, Pace};
use profile_generic::servo::{ServoCommand, ServoControl, input};
use profile_generic::state::Report;
use profile_generic::time::DurationNs;

use super::Drive;
use super::control::mode_of;
use super::homing::Senses;
use crate::slave::application::Cycle;
use crate::slave::parameter::Store;
use crate::wire::idn::Idn;

/// Bit of an operation mode: the drive makes up the way to its target by itself.
const INTERPOLATED: u16 = 1 << 4;

/// Where the set-points are.
#[derive(Debug, Default)]
pub(super) struct Path {
    /// Whole position command in counts.
    pub position: i64,
    /// The set-point that the drive makes up by itself, and whether it has come to S-0-0258.
    motion: Motion,
    pub attained: bool,
    /// Set-points that count from the next cycle on.
    next: ServoCommand,
}

impl Drive {
    /// The operation mode that the control word selects; `None` if there is none behind the number.
    pub(super) fn select_mode(&mut self, elapsed: DurationNs, store: &Store) -> Option<OperatingMode> {
        let selected = self.control.word.mode();
        let (code, number) = self.mode.select(selected, elapsed, self.in_operation(), store);
        let mode = mode_of(code)?;
        if (code, number) != (self.mode.code, self.mode.number) {
            (self.mode.code, self.mode.number) = (code, number);
            self.adopt(store);
        }
        Some(mode)
    }

    /// The command of this cycle in generic units.
    pub(super) fn command(&mut self, cycle: &Cycle, mode: OperatingMode, store: &mut Store) -> ServoCommand {
        let control = self.control.servo_control(cycle, store, &self.actual, self.in_operation());
        let running = self.actual.report == Report::Operating;
        let torque = running || self.actual.report == Report::Halted;
        let through = self.control.is_through_on_delay(torque, cycle.elapsed, store);
        let able = running && through && control == ServoControl::Enable;
        self.control.follows = able && !self.homing.leads();
        let mut command =
            ServoCommand { control, power: self.control.main_power, mode, ..ServoCommand::default() };
        if let Some(position) = self.lead(cycle, able, mode, store) {
            self.path.position = self.scales.position.counts(position.saturating_add(self.loop_slip()));
            command.position = Position(position);
            command.mode = OperatingMode::Position;
            return command;
        }
        let slip = self.loop_slip();
        let actual = self.scales.position.counts(self.actual.position.0.saturating_add(slip));
        self.path.motion = Motion { position: self.actual.position.0, velocity: self.actual.velocity.0 };
        if !self.control.follows {
            // Command values do not count: the drive stands where it is.
            self.path.position = actual;
            command.position = self.actual.position;
            if mode == OperatingMode::Torque {
                command.mode = OperatingMode::Velocity;
            }
            return command;
        }
        let number = |idn| store.number_of(idn);
        let sign = |idn, bit: i64| if number(idn) & 1 << bit == 0 { 1 } else { -1 };
        let whole = self.scales.unfold(
            sign(Idn::POSITION_POLARITY_PARAMETERS, 0) * number(Idn::POSITION_COMMAND),
            self.path.position,
        );
        // Position commands begin where the drive is, whatever way it has gone without them.
        self.path.position = if mode == OperatingMode::Position { whole } else { actual };
        let additive = sign(Idn::POSITION_POLARITY_PARAMETERS, 1) * number(Idn::ADDITIVE_POSITION_COMMAND);
        let position = self.scales.position.generic(self.path.position.saturating_add(additive));
        // The loop of the servo is closed over the motor: what the load is ahead, the motor stays behind.
        command.position = Position(position.saturating_sub(slip));
        let velocity = |value| Velocity(self.scales.velocity.generic(value));
        command.velocity =
            velocity(sign(Idn::VELOCITY_POLARITY_PARAMETER, 0) * number(Idn::VELOCITY_COMMAND));
        command.velocity_offset =
            velocity(sign(Idn::VELOCITY_POLARITY_PARAMETER, 1) * number(Idn::ADDITIVE_VELOCITY_COMMAND));
        let torque = |value| Torque(self.scales.torque.generic(value));
        command.torque = torque(sign(Idn::TORQUE_POLARITY_PARAMETER, 0) * number(Idn::TORQUE_COMMAND));
        command.torque_offset =
            torque(sign(Idn::TORQUE_POLARITY_PARAMETER, 1) * number(Idn::ADDITIVE_TORQUE_COMMAND));
        if mode == OperatingMode::Position {
            self.path.motion.position = command.position.0;
        }
        command
    }

    /// The set-point of a motion that the drive makes up by itself: homing, or the way to S-0-0258 in an operation mode
    /// with drive-controlled interpolation.
    fn lead(&mut self, cycle: &Cycle, able: bool, mode: OperatingMode, store: &mut Store) -> Option<i64> {
        let (edge, marker) = self.probe.take_homing_edges();
        let switch = self.actual.digital_inputs & input::HOME_SWITCH != 0;
        let senses = Senses { switch, edge, marker, able, span: cycle.elapsed.0 };
        let (scales, inverted) =
            (self.scales, store.number_of(Idn::POSITION_POLARITY_PARAMETERS) & 1 << 2 != 0);
        let counts = |position: i64| {
            let counts = scales.position.counts(position);
            scales.fold(if inverted { -counts } else { counts })
        };
        self.homing.watch(&senses, store, counts);
        self.path.attained = false;
        if self.homing.leads() {
            let shift = self.homing.advance(&mut self.path.motion, &senses, store, &scales, counts);
            if let Some(shift) = shift {
                self.displace(shift);
            }
            return able.then_some(self.path.motion.position);
        }
        if !self.control.follows || mode != OperatingMode::Position || self.mode.code & INTERPOLATED == 0 {
            return None;
        }
        let number = |idn| store.number_of(idn);
        let sign = if number(Idn::POSITION_POLARITY_PARAMETERS) & 1 == 0 { 1 } else { -1 };
        let slip = self.loop_slip();
        let here = scales.position.counts(self.path.motion.position.saturating_add(slip));
        let target = scales.position.generic(scales.unfold(sign * number(Idn::TARGET_POSITION), here));
        let target = target.saturating_sub(slip);
        // 0.01 %.
        let velocity = scales.velocity.generic(number(Idn::POSITIONING_VELOCITY).abs());
        let velocity = velocity / 10_000 * number(Idn::FEEDRATE_OVERRIDE)
            + velocity % 10_000 * number(Idn::FEEDRATE_OVERRIDE) / 10_000;
        let limit = self.servo.parameters().velocity_limit.0;
        let acceleration = scales.acceleration.generic(number(Idn::POSITIONING_ACCELERATION).abs()).max(1);
        let deceleration = scales.acceleration.generic(number(Idn::POSITIONING_DECELERATION).abs());
        let deceleration = if deceleration > 0 { deceleration } else { acceleration };
        if velocity == 0 {
            self.path.motion.advance(cycle.elapsed.0, 0, Pace { velocity: 1, acceleration, deceleration });
        } else {
            let pace = Pace { velocity: velocity.min(limit), acceleration, deceleration };
            self.path.attained = self.path.motion.advance_to(cycle.elapsed.0, target, pace);
        }
        Some(self.path.motion.position)
    }

    /// The place of the axis gets a position that is `shift` nanounits more, and refers to the machine from now on.
    pub(super) fn displace(&mut self, shift: i64) {
        let moved = |position: Position| Position(position.0.saturating_add(shift));
        self.servo.set_position(moved(self.servo.position()));
        self.actual.position = moved(self.actual.position);
        self.path.next.position = moved(self.path.next.position);
        self.path.motion.position = self.path.motion.position.saturating_add(shift);
        let place = self.actual.position.0.saturating_add(self.loop_slip());
        self.path.position = self.scales.position.counts(place);
        self.homing.shifted(shift);
        self.referenced = true;
    }

    /// The command for the time up to now: the set-points of a telegram count from the synchronisation after it, so that
    /// all drives of a line follow at the same instant. Everything else counts at once.
    pub(super) fn synchronous(&mut self, command: ServoCommand) -> ServoCommand {
        let points = core::mem::replace(&mut self.path.next, command);
        if points.mode != command.mode {
            // Those of another operation mode lead nowhere.
            return command;
        }
        ServoCommand {
            position: points.position,
            velocity: points.velocity,
            torque: points.torque,
            velocity_offset: points.velocity_offset,
            torque_offset: points.torque_offset,
            ..command
        }
    }
}
