//! What the axis tells: statusword, actual values, what it watches.

use profile_generic::image::StatusBits;
use profile_generic::time::DurationNs;

use super::Axis;
use crate::drive::{Controlword, ErrorCode, Mode, State, Statusword, index};
use crate::node::dictionary::Dictionary;
use crate::node::drive::homing::Senses;
use crate::node::drive::probe::Passed;
use crate::node::drive::scaling::TORQUE;

/// Part of the overload model, ppm, from which the drive warns.
const OVERLOAD_WARNING_PPM: i64 = 900_000;

/// Distance of the motor temperature to its limit from which the drive warns.
const TEMPERATURE_MARGIN_MILLIDEGREE: i64 = 10_000;

impl Axis {
    pub(super) fn senses(&self, passed: Passed, span: i64) -> Senses {
        let here = self.actual.position;
        let [negative, positive] = self.wiring.limit_switches;
        let window = self.servo.parameters().standstill_window.0;
        let velocity = self.actual.velocity.0;
        // 607Eh turns what positions and velocities are told as. Switches stay where they are, and homing looks for them there.
        Senses {
            limits: [here <= negative, here >= positive],
            limit_places: [negative.0, positive.0],
            home: self.actual.digital_inputs & profile_generic::servo::input::HOME_SWITCH != 0,
            passed,
            moves: if velocity.abs() <= window { 0 } else { velocity.signum() },
            span,
        }
    }

    /// Following error, limit switches, windows.
    pub(super) fn supervise(&mut self, elapsed: DurationNs, dictionary: &mut Dictionary) {
        let enabled = self.machine.state == State::OperationEnabled;
        let leads = matches!(
            self.path.mode,
            Mode::PROFILE_POSITION | Mode::CYCLIC_POSITION | Mode::INTERPOLATED_POSITION | Mode::HOMING
        );
        let demand = self.monitor.target.take().unwrap_or(self.path.motion.position);
        let error = if enabled && leads && self.machine.brake.is_none() {
            demand.saturating_sub(self.actual.position.0)
        } else {
            0
        };
        let number = |axis: &Self, index| axis.number(dictionary, index);
        let window = number(self, index::FOLLOWING_WINDOW);
        let beyond =
            window != i64::from(u32::MAX) && self.scales.position.counts(error).saturating_abs() > window;
        let time_out = DurationNs::from_millis(number(self, index::FOLLOWING_TIME_OUT));
        let lost = self.monitor.following(beyond, elapsed, time_out);
        self.monitor.error = error;
        if lost {
            self.raise_fault(ErrorCode::FOLLOWING_ERROR, dictionary);
        }
        let senses = self.senses(Passed::default(), 0);
        let into = senses.limits[0] && senses.moves < 0 || senses.limits[1] && senses.moves > 0;
        if enabled && into && self.path.mode != Mode::HOMING && !self.wiring.ignores_limit_switches {
            self.raise_fault(ErrorCode::REFERENCE_LIMIT, dictionary);
        }
        self.watch_windows(elapsed, dictionary);
    }

    /// Windows for bits 10 and 12.
    fn watch_windows(&mut self, elapsed: DurationNs, dictionary: &Dictionary) {
        let number = |index| self.number(dictionary, index);
        let time = |index| DurationNs::from_millis(number(index));
        let speed = self.actual.velocity.0;
        let counts = |servo: i64| self.scales.velocity.counts(servo).saturating_abs();
        let wanted = self.scales.velocity_of(number(index::TARGET_VELOCITY));
        let (inside, needed) = match self.path.mode {
            Mode::PROFILE_POSITION => {
                let error = self.scales.position.counts(self.path.motion.position - self.actual.position.0);
                let near = error.abs() <= number(index::POSITION_WINDOW);
                (self.path.profile.has_arrived() && near, time(index::POSITION_WINDOW_TIME))
            }
            Mode::PROFILE_VELOCITY => {
                let near = counts(wanted.saturating_sub(speed)) <= number(index::VELOCITY_WINDOW);
                (near, time(index::VELOCITY_WINDOW_TIME))
            }
            Mode::TORQUE => (self.path.torque == number(index::TARGET_TORQUE) * TORQUE, DurationNs::ZERO),
            Mode::VELOCITY => {
                let object =
                    self.scales.speed.counts(self.path.motion.velocity) * self.scales.velocity_sign();
                (object == number(index::VL_TARGET_VELOCITY), DurationNs::ZERO)
            }
            _ => (false, DurationNs::ZERO),
        };
        let slow = counts(speed) <= number(index::VELOCITY_THRESHOLD);
        let slow_time = time(index::VELOCITY_THRESHOLD_TIME);
        self.monitor.reached(inside, elapsed, needed);
        self.monitor.standing(slow, elapsed, slow_time);
    }

    /// The statusword.
    pub(super) fn show_status(&self, dictionary: &mut Dictionary) {
        let (held, value) = self.wiring.held_bits;
        let word = self.status().difference(held).union(value);
        self.set(dictionary, index::STATUSWORD, i64::from(word.bits()));
    }

    // Flat: one arm per mode of operation, each with its bits.
    fn status(&self) -> Statusword {
        let mut word = Statusword::empty().with_state(self.machine.state);
        let parameters = self.servo.parameters();
        let hot = self.actual.temperature.0 > parameters.max_temperature.0 - TEMPERATURE_MARGIN_MILLIDEGREE;
        let warns = hot || self.actual.overload > OVERLOAD_WARNING_PPM || self.actual.warning.is_some();
        word.set(Statusword::WARNING, warns);
        word.set(Statusword::VOLTAGE_ENABLED, self.actual.status.contains(StatusBits::POWER));
        word.set(Statusword::REMOTE, self.wiring.remote);
        let enabled = self.machine.state == State::OperationEnabled;
        let limits = StatusBits::VELOCITY_LIMIT | StatusBits::TORQUE_LIMIT;
        word.set(
            Statusword::INTERNAL_LIMIT,
            enabled && (self.path.limited || self.actual.status.intersects(limits)),
        );
        let stops =
            self.machine.brake.is_some() && (self.machine.before.contains(Controlword::HALT) || !enabled);
        if !enabled {
            word.set(
                Statusword::TARGET_REACHED,
                self.machine.state == State::QuickStopActive && self.machine.stands_braked(),
            );
            return word;
        }
        match self.path.mode {
            Mode::PROFILE_POSITION => {
                word.set(Statusword::TARGET_REACHED, self.monitor.has_reached);
                word.set(Statusword::SET_POINT_ACKNOWLEDGE, self.path.profile.acknowledges());
                word.set(Statusword::FOLLOWING_ERROR, self.monitor.is_beyond);
            }
            Mode::PROFILE_VELOCITY => {
                word.set(Statusword::TARGET_REACHED, self.monitor.has_reached);
                word.set(Statusword::SPEED_ZERO, self.monitor.stands);
            }
            Mode::VELOCITY | Mode::TORQUE => word.set(Statusword::TARGET_REACHED, self.monitor.has_reached),
            Mode::HOMING => word |= self.homing.progress().bits(),
            Mode::INTERPOLATED_POSITION => {
                word.set(Statusword::INTERPOLATION_ACTIVE, self.path.follows);
                word.set(Statusword::FOLLOWING_ERROR, self.monitor.is_beyond);
            }
            Mode::CYCLIC_POSITION => {
                word.set(Statusword::FOLLOWS_COMMAND, self.path.follows);
                word.set(Statusword::FOLLOWING_ERROR, self.monitor.is_beyond);
            }
            Mode::CYCLIC_VELOCITY | Mode::CYCLIC_TORQUE => {
                word.set(Statusword::FOLLOWS_COMMAND, self.path.follows)
            }
            _ => {}
        }
        if stops && self.path.mode != Mode::HOMING {
            word.set(Statusword::TARGET_REACHED, self.machine.stands_braked());
        }
        word
    }

    /// Actual values, and the statusword.
    pub(super) fn publish(&self, dictionary: &mut Dictionary) {
        let actual = &self.actual;
        let scales = &self.scales;
        let sign = scales.position_sign();
        let [negative, positive, home, manufacturer] = self.inputs();
        let velocity = scales.velocity_object(actual.velocity.0);
        let speed = |servo: i64| scales.velocity_sign() * scales.speed.counts(servo);
        let leads =
            matches!(self.path.mode, Mode::TORQUE | Mode::CYCLIC_TORQUE) && self.machine.brake.is_none();
        let torque = if leads { self.path.torque } else { actual.torque.0 };
        let rated = self.servo.parameters().rated_current.0.max(1);
        let wrap = |count: i64| i64::from(i32::from_le_bytes(low_half(count)));
        let values = [
            (index::POSITION_ACTUAL, scales.position_object(actual.position.0)),
            (index::POSITION_DEMAND, scales.position_object(self.path.motion.position)),
            (index::POSITION_INTERNAL, wrap(sign * scales.increments.counts(actual.position.0))),
            (
                index::POSITION_DEMAND_INTERNAL,
                wrap(sign * scales.increments.counts(self.path.motion.position)),
            ),
            (index::VELOCITY_SENSOR, velocity),
            (index::VELOCITY_ACTUAL, velocity),
            (index::VELOCITY_DEMAND, scales.velocity_object(self.path.motion.velocity)),
            (index::CONTROL_EFFORT, scales.velocity_object(self.path.motion.velocity)),
            (index::VL_VELOCITY_DEMAND, speed(self.path.motion.velocity)),
            (index::VL_VELOCITY_ACTUAL, speed(actual.velocity.0)),
            (index::TORQUE_DEMAND, torque / TORQUE),
            (index::TORQUE_ACTUAL, actual.torque.0 / TORQUE),
            (index::CURRENT_ACTUAL, actual.current.0.saturating_mul(1_000) / rated),
            (index::DC_LINK_VOLTAGE, actual.bus_voltage.0 / 1_000),
            (index::FOLLOWING_ERROR, scales.distance_object(self.monitor.error)),
            (index::DIGITAL_INPUTS, negative | positive | home | manufacturer),
        ];
        for (index, value) in values {
            self.set(dictionary, index, value);
        }
        let load = scales.position_object(actual.position.0.saturating_add(self.slip));
        for (index, value) in
            [(index::ADDITIONAL_POSITION_ACTUAL, load), (index::ADDITIONAL_VELOCITY_ACTUAL, velocity)]
        {
            dictionary.set(index + self.offset, 1, value);
        }
        self.show_status(dictionary);
    }

    /// Bits of 60FDh: negative limit, positive limit, home switch, and the inputs of the servo from bit 16 up.
    fn inputs(&self) -> [i64; 4] {
        use profile_generic::servo::input as servo;
        let inputs = self.actual.digital_inputs;
        let limits = self.senses(Passed::default(), 0).limits;
        let bit = |set: bool, bit: u32| if set { i64::from(bit) } else { 0 };
        let probes = inputs & (servo::REGISTRATION_1 | servo::REGISTRATION_2);
        let user = inputs >> servo::USER_SHIFT << 3 | probes;
        [
            bit(limits[0], index::input::NEGATIVE_LIMIT),
            bit(limits[1], index::input::POSITIVE_LIMIT),
            bit(inputs & servo::HOME_SWITCH != 0, index::input::HOME),
            i64::from(user.wrapping_shl(index::input::MANUFACTURER_SHIFT)),
        ]
    }
}

/// The low 32 bits.
const fn low_half(number: i64) -> [u8; 4] {
    let [a, b, c, d, ..] = number.to_le_bytes();
    [a, b, c, d]
}
