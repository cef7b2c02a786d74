//! How an axis starts and stops, from the attributes that the controller has set.

use profile_cip::device::motion_device::{MotionDevice, SequenceSettings};
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::fault::Reaction;
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::Parameter;
use profile_generic::quantity::{Acceleration, Torque, Velocity};
use profile_generic::sequence::SequenceTimes;
use profile_generic::time::DurationNs;

use super::access::{generic_of, held};
use super::axis::CipAxis;
use super::scaling::number_of;
use crate::engine::axis::{AxisChannel, FeedForward, Ramp, StopSettings, Tolerances, UserLimits};
use crate::mapping::{AttributeEntry, AttributeTable, Backing, SequenceAttributes};

/// What a stop falls back to where the controller has set nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StopDefaults {
    /// Speed of an axis that stands.
    pub zero_speed: Velocity,
    /// Deceleration of a ramp.
    pub deceleration: Option<Acceleration>,
}

/// The settings of starts and stops of one axis. They are worked out again when something has changed that they are made of.
#[derive(Debug)]
pub(super) struct Stopping {
    defaults: StopDefaults,
    held: Option<(Sources, (StopSettings, SequenceSettings))>,
    /// Calls since a debug build compared what is held with what it would be now.
    uncompared: u8,
}

/// Calls between two such comparisons: with one in each call the debug build would spend a third of its cycle there.
const COMPARED_EACH: u8 = 16;

/// What the settings are made of, besides [`StopDefaults`]: attributes of the axis, its programs, and the control mode of the
/// last update.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sources {
    attributes: Option<u64>,
    programs: (u64, u32),
    control_mode: Option<ControlMode>,
}

/// Where the settings come from.
#[derive(Clone, Copy)]
pub(super) struct Settings<'a> {
    pub rows: &'a SequenceAttributes,
    pub device: &'a MotionDevice,
    /// Place of the axis in the device.
    pub place: usize,
    pub attributes: &'a AttributeTable,
    pub cip: &'a CipAxis,
    pub axis: &'a AxisChannel,
}

impl Stopping {
    pub fn new(defaults: StopDefaults) -> Self {
        Self { defaults, held: None, uncompared: 0 }
    }

    /// How the axis starts and stops now.
    pub fn settings(&mut self, from: Settings<'_>) -> (StopSettings, SequenceSettings) {
        let now = Sources {
            attributes: from.device.attribute_changes(from.place),
            programs: (from.axis.programs(), from.cip.scaling_id()),
            control_mode: from.device.control_mode(from.place),
        };
        if let Some((sources, settings)) = self.held
            && sources == now
        {
            if cfg!(debug_assertions) {
                self.uncompared = (self.uncompared + 1) % COMPARED_EACH;
                assert!(self.uncompared != 0 || settings == from.work_out(&self.defaults), "it is stale");
            }
            return settings;
        }
        let settings = from.work_out(&self.defaults);
        self.held = Some((now, settings));
        settings
    }
}

impl Settings<'_> {
    fn work_out(&self, defaults: &StopDefaults) -> (StopSettings, SequenceSettings) {
        let Self { rows, device, place, cip, .. } = *self;
        let raw = |id| number_of(device.attribute(place, id), false);
        let stopping = u8::try_from(raw(rows.stopping_action)).ok();
        let stopping = stopping.and_then(|code| cip.program().stopping(code));
        let by_velocity = device.control_mode(place).and_then(|mode| cip.program().mode(mode.0))
            == Some(OperatingMode::Velocity);
        let settings = StopSettings {
            plan: stopping.map(|row| row.plan).unwrap_or_default(),
            times: self.times(defaults),
            deceleration: self
                .value(rows.ramp_deceleration)
                .or_else(|| self.value(rows.deceleration_limit))
                .map(Acceleration)
                .or(defaults.deceleration),
            ramp: self.ramp(),
            flying_start: raw(rows.flying_start) != 0 && by_velocity,
            checks_overtravel: raw(rows.overtravel_checking) != 0,
            tolerances: self.tolerances(),
            user_limits: self.user_limits(),
            acceleration_filter: self
                .attribute_of(Parameter::FEEDBACK_ACCELERATION_FILTER)
                .and_then(|id| self.value(id))
                .map(DurationNs)
                .unwrap_or_default(),
            feed_forward: self.feed_forward(),
        };
        let abort: Reaction = stopping.map(|row| row.abort).unwrap_or_default();
        let abort = cip.program().fault_action(abort);
        (settings, SequenceSettings { flying_start: settings.flying_start, abort })
    }

    fn times(&self, defaults: &StopDefaults) -> SequenceTimes {
        let Self { rows, .. } = *self;
        let time = |id| self.value(id).map(DurationNs);
        // A delay that the drive waits out by itself is not waited twice.
        let delay = |id| if self.is_in_drive(id) { DurationNs::ZERO } else { time(id).unwrap_or_default() };
        let stopping_limit = time(rows.stopping_time_limit).unwrap_or(SequenceTimes::FACTORY_LIMIT);
        SequenceTimes {
            brake_release_delay: delay(rows.brake_release_delay),
            brake_engage_delay: delay(rows.brake_engage_delay),
            stopping_limit,
            // Where it is not set the stopping time limit applies (attribute 617).
            coasting_limit: time(rows.coasting_time_limit).unwrap_or(stopping_limit),
            zero_speed: self
                .of_rated_speed(Parameter::ZERO_SPEED)
                .or_else(|| self.value(rows.zero_speed).map(Velocity))
                .unwrap_or(defaults.zero_speed),
            zero_speed_time: time(rows.zero_speed_time).unwrap_or_default(),
        }
    }

    /// The ramp generator. The directions change places with an inverted Motion Polarity.
    fn ramp(&self) -> Ramp {
        let limit = |parameter| {
            let id = self.attribute_of(parameter)?;
            generic_of(self.attributes, self.device, self.place, id).filter(|generic| *generic != 0)
        };
        Ramp {
            positive: limit(Parameter::RAMP_VELOCITY_POSITIVE).map(Velocity),
            negative: limit(Parameter::RAMP_VELOCITY_NEGATIVE).map(Velocity),
            acceleration: self.value(self.rows.ramp_acceleration).map(Acceleration),
            deceleration: self.value(self.rows.ramp_deceleration).map(Acceleration),
        }
    }

    /// The attribute that stands for a parameter.
    fn attribute_of(&self, parameter: Parameter) -> Option<u16> {
        let mut entries = self.attributes.entries().iter();
        let is = |entry: &&AttributeEntry| matches!(entry.backing, Backing::Parameter { parameter: own, .. } if own == parameter);
        Some(entries.find(is)?.id)
    }

    /// What the controller has set of a parameter that the gateway goes by; `None` unless it is above 0. A drive that has the parameter
    /// goes by it itself.
    fn own(&self, parameter: Parameter) -> Option<i64> {
        let id = self.attribute_of(parameter)?;
        let is_ours = self.axis.south().is_some_and(|program| program.can_go_by(parameter));
        if self.is_in_drive(id) || !is_ours { None } else { self.value(id) }
    }

    /// A part of the rated speed as a speed of the axis.
    fn of_rated_speed(&self, parameter: Parameter) -> Option<Velocity> {
        let rated = self.axis.south()?.rated_velocity()?;
        part(self.own(parameter)?, rated.get()).map(Velocity)
    }

    /// What is watched beside the tolerances.
    fn user_limits(&self) -> UserLimits {
        let nominal = self.axis.south().and_then(|program| program.datum(Parameter::BUS_NOMINAL_VOLTAGE));
        let of_nominal = |parameter| part(self.own(parameter)?, nominal?);
        UserLimits {
            speed: self.of_rated_speed(Parameter::OVER_SPEED_USER_LIMIT),
            motor_temperature: self.own(Parameter::MOTOR_TEMPERATURE_USER_LIMIT),
            drive_temperature: self.own(Parameter::DRIVE_TEMPERATURE_USER_LIMIT),
            bus_high: of_nominal(Parameter::BUS_OVERVOLTAGE_USER_LIMIT),
            bus_low: of_nominal(Parameter::BUS_UNDERVOLTAGE_USER_LIMIT),
            velocity_threshold: self.own(Parameter::VELOCITY_THRESHOLD).map(Velocity),
            torque_threshold: self.own(Parameter::TORQUE_THRESHOLD).map(Torque),
        }
    }

    /// Limits of velocity error and torque.
    fn tolerances(&self) -> Tolerances {
        let of = |parameter| self.own(parameter);
        Tolerances {
            velocity_error: of(Parameter::VELOCITY_ERROR_TOLERANCE).map(Velocity),
            velocity_error_time: of(Parameter::VELOCITY_ERROR_TOLERANCE_TIME)
                .map(DurationNs)
                .unwrap_or_default(),
            over_torque: of(Parameter::OVER_TORQUE_LIMIT).map(Torque),
            over_torque_time: of(Parameter::OVER_TORQUE_LIMIT_TIME).map(DurationNs),
            under_torque: of(Parameter::UNDER_TORQUE_LIMIT).map(Torque),
            under_torque_time: of(Parameter::UNDER_TORQUE_LIMIT_TIME).map(DurationNs),
        }
    }

    /// Torque that is fed forward to a drive that does not do it by itself.
    fn feed_forward(&self) -> FeedForward {
        let of = |parameter| self.attribute_of(parameter).and_then(|id| self.value(id)).unwrap_or(0);
        FeedForward {
            gain: of(Parameter::ACCELERATION_FEED_FORWARD_GAIN),
            inertia: of(Parameter::SYSTEM_INERTIA),
        }
    }

    /// An attribute in its generic unit; `None` unless it is above 0.
    fn value(&self, id: u16) -> Option<i64> {
        generic_of(self.attributes, self.device, self.place, id).filter(|generic| *generic > 0)
    }

    /// Whether the drive has a parameter for the attribute.
    fn is_in_drive(&self, id: u16) -> bool {
        held(self.attributes, self.axis, id).is_some()
    }
}

/// A part, in millionths, of a whole.
fn part(millionths: i64, whole: i64) -> Option<i64> {
    i64::try_from(i128::from(millionths) * i128::from(whole) / 1_000_000).ok()
}
