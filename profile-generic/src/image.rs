//! The process image of one axis: set-points going to the drive, actual values coming from it.
//!
//! Both images are `Copy` values of fixed size. A set-point or actual value counts only when its bit in
//! `present` is set, so that a profile that does not deliver a value cannot be mistaken for one that delivers
//! zero.

use crate::fault::Fault;
pub use crate::generated::signals::Signal;
use crate::inhibit::Inhibits;
use crate::mode::{InterpolationSource, ModeSelection, OperatingMode};
use crate::quantity::{Acceleration, Current, Position, Temperature, Torque, Velocity, Voltage};
use crate::state::{DriveState, Report, Request};
use crate::time::MonotonicTime;
use bitflags::bitflags;

/// One row per signal: variant, name, quantity, image, description.
macro_rules! signal_rows {
    ($( $signal:ident = $name:literal, $quantity:ident, $image:ident, $description:literal; )*) => {
        $crate::code::named_enum! {
            /// One value of the process image, as the mapping tables name it.
            pub enum Signal { $( #[doc = $description] $signal = $name ),* }
        }

        impl Signal {
            /// What the signal measures.
            pub const fn quantity(self) -> $crate::quantity::Quantity {
                match self { $( Self::$signal => $crate::quantity::Quantity::$quantity ),* }
            }

            /// Whether the signal belongs to the [`AxisCommand`](crate::image::AxisCommand); otherwise it belongs to the
            /// [`AxisFeedback`](crate::image::AxisFeedback).
            pub const fn is_command(self) -> bool {
                match self { $( Self::$signal => signal_rows!(@$image) ),* }
            }

            /// What it is, in a sentence.
            pub const fn description(self) -> &'static str {
                match self { $( Self::$signal => $description ),* }
            }
        }
    };
    (@Command) => { true };
    (@Feedback) => { false };
}
pub(crate) use signal_rows;

impl Signal {
    /// The offsets, which are added to set-points.
    pub const OFFSETS: [Self; 3] = [Self::PositionOffset, Self::VelocityOffset, Self::TorqueOffset];

    /// Its bit in a [`CommandSet`]; none of a signal of the feedback.
    pub fn command_bit(self) -> CommandSet {
        let mut probe = AxisCommand::default();
        probe.set(self, 0);
        probe.present
    }

    /// The set-point that leads in an operating mode, with the offset that is added to it, if there is one; `None` for a mode without a
    /// set-point.
    pub const fn leading(mode: OperatingMode) -> Option<(Self, Option<Self>)> {
        match mode {
            OperatingMode::Position => Some((Self::PositionCommand, Some(Self::PositionOffset))),
            OperatingMode::Velocity => Some((Self::VelocityCommand, Some(Self::VelocityOffset))),
            OperatingMode::Acceleration => Some((Self::AccelerationCommand, None)),
            OperatingMode::Torque => Some((Self::TorqueCommand, Some(Self::TorqueOffset))),
            OperatingMode::None | OperatingMode::Homing => None,
        }
    }
}

/// Reading and writing a process image by signal; what the compiled programs work on.
pub trait SignalImage {
    /// Whether the signal belongs to this image.
    fn owns(signal: Signal) -> bool;

    /// The value of the signal, or `None` when it is not present in this image.
    fn get(&self, signal: Signal) -> Option<i64>;

    /// Sets the value and marks it present. Returns whether the signal belongs to this image and holds the
    /// value.
    fn set(&mut self, signal: Signal, value: i64) -> bool;
}

bitflags! {
    /// Which set-points of an [`AxisCommand`] are valid.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct CommandSet: u16 {
        /// [`AxisCommand::position`].
        const POSITION = 1 << 0;
        /// [`AxisCommand::velocity`].
        const VELOCITY = 1 << 1;
        /// [`AxisCommand::acceleration`].
        const ACCELERATION = 1 << 2;
        /// [`AxisCommand::torque`].
        const TORQUE = 1 << 3;
        /// [`AxisCommand::position_offset`].
        const POSITION_OFFSET = 1 << 4;
        /// [`AxisCommand::velocity_offset`].
        const VELOCITY_OFFSET = 1 << 5;
        /// [`AxisCommand::torque_offset`].
        const TORQUE_OFFSET = 1 << 7;
        /// [`AxisCommand::target_position`].
        const TARGET_POSITION = 1 << 9;
        /// [`AxisCommand::profile_velocity`].
        const PROFILE_VELOCITY = 1 << 10;
        /// [`AxisCommand::profile_acceleration`].
        const PROFILE_ACCELERATION = 1 << 11;
        /// [`AxisCommand::profile_deceleration`].
        const PROFILE_DECELERATION = 1 << 12;
    }
}

bitflags! {
    /// Which actual values of an [`AxisFeedback`] are valid.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct FeedbackSet: u16 {
        /// [`AxisFeedback::position`].
        const POSITION = 1 << 0;
        /// [`AxisFeedback::velocity`].
        const VELOCITY = 1 << 1;
        /// [`AxisFeedback::acceleration`].
        const ACCELERATION = 1 << 2;
        /// [`AxisFeedback::torque`].
        const TORQUE = 1 << 3;
        /// [`AxisFeedback::current`].
        const CURRENT = 1 << 4;
        /// [`AxisFeedback::bus_voltage`].
        const BUS_VOLTAGE = 1 << 5;
        /// [`AxisFeedback::temperature`].
        const TEMPERATURE = 1 << 6;
        /// [`AxisFeedback::following_error`].
        const FOLLOWING_ERROR = 1 << 7;
        /// [`AxisFeedback::digital_inputs`].
        const DIGITAL_INPUTS = 1 << 8;
    }
}

bitflags! {
    /// Status of the drive, one bit each (IEC 61800-7-202, 3.1.44).
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct StatusBits: u32 {
        /// The drive could be enabled.
        const READY = 1 << 0;
        /// The power stage has its supply.
        const POWER = 1 << 1;
        /// The power stage is on: there is torque.
        const ENABLED = 1 << 2;
        /// The drive follows the set-points of the controller.
        const TRACKING = 1 << 3;
        /// The actual position is within the window around the set-point.
        const IN_POSITION = 1 << 4;
        /// The actual velocity is within the window around the set-point.
        const AT_VELOCITY = 1 << 5;
        /// The axis stands.
        const STANDSTILL = 1 << 6;
        /// The position set-point is held at a limit.
        const POSITION_LIMIT = 1 << 7;
        /// The velocity set-point is held at a limit.
        const VELOCITY_LIMIT = 1 << 8;
        /// The acceleration set-point is held at a limit.
        const ACCELERATION_LIMIT = 1 << 9;
        /// The torque is held at a limit.
        const TORQUE_LIMIT = 1 << 10;
        /// The current is held at a limit.
        const CURRENT_LIMIT = 1 << 11;
        /// A homing procedure has ended well.
        const HOMED = 1 << 12;
        /// The position refers to the machine's zero point.
        const REFERENCED = 1 << 13;
        /// The axis is halted by request, with torque.
        const HALT = 1 << 14;
        /// A warning is present.
        const WARNING = 1 << 15;
        /// A fault is latched.
        const FAULT = 1 << 16;
        /// The shutdown is latched.
        const SHUTDOWN = 1 << 17;
        /// The brake is released.
        const BRAKE_RELEASED = 1 << 18;
        /// A safety function is active.
        const SAFETY_ACTIVE = 1 << 19;
        /// A set-point or actual value was clamped in a conversion.
        const SATURATED = 1 << 20;
        /// A homing procedure has found its place: the controller that moves the axis has to stop it.
        const HOME_FOUND = 1 << 21;
        /// The homing procedure that was asked for has failed, or the drive refused it.
        const HOMING_FAILED = 1 << 22;
        /// The drive has reached the target of its own profile.
        const TARGET_REACHED = 1 << 23;
        /// The home switch is active.
        const HOME_SWITCH = 1 << 24;
        /// The drive reports its limit switches; without this bit nothing follows from the two below.
        const LIMIT_SWITCHES = 1 << 25;
        /// The switch at the end of the way forward is active: the axis has gone too far.
        const POSITIVE_LIMIT_SWITCH = 1 << 26;
        /// The switch at the end of the way backward is active.
        const NEGATIVE_LIMIT_SWITCH = 1 << 27;
        /// The velocity is below the threshold that the controller has set.
        const VELOCITY_THRESHOLD = 1 << 28;
        /// The torque is above the threshold that the controller has set.
        const TORQUE_THRESHOLD = 1 << 29;

        // Bits above are kept when they come from a newer table.
        const _ = !0;
    }
}

impl StatusBits {
    /// What the gateway evaluates by what the controller has set, whatever the drive shows.
    pub const THRESHOLDS: Self = Self::VELOCITY_THRESHOLD.union(Self::TORQUE_THRESHOLD);

    /// What is wired to the drive: it counts while the drive is heard.
    pub const INPUTS: Self = Self::HOME_SWITCH
        .union(Self::LIMIT_SWITCHES)
        .union(Self::POSITIVE_LIMIT_SWITCH)
        .union(Self::NEGATIVE_LIMIT_SWITCH);

    /// Every named status bit with its name in snake case.
    pub const NAMED: &'static [(Self, &'static str)] = &[
        (Self::READY, "ready"),
        (Self::POWER, "power"),
        (Self::ENABLED, "enabled"),
        (Self::TRACKING, "tracking"),
        (Self::IN_POSITION, "in_position"),
        (Self::AT_VELOCITY, "at_velocity"),
        (Self::STANDSTILL, "standstill"),
        (Self::POSITION_LIMIT, "position_limit"),
        (Self::VELOCITY_LIMIT, "velocity_limit"),
        (Self::ACCELERATION_LIMIT, "acceleration_limit"),
        (Self::TORQUE_LIMIT, "torque_limit"),
        (Self::CURRENT_LIMIT, "current_limit"),
        (Self::HOMED, "homed"),
        (Self::REFERENCED, "referenced"),
        (Self::HALT, "halt"),
        (Self::WARNING, "warning"),
        (Self::FAULT, "fault"),
        (Self::SHUTDOWN, "shutdown"),
        (Self::BRAKE_RELEASED, "brake_released"),
        (Self::SAFETY_ACTIVE, "safety_active"),
        (Self::SATURATED, "saturated"),
        (Self::HOME_FOUND, "home_found"),
        (Self::HOMING_FAILED, "homing_failed"),
        (Self::TARGET_REACHED, "target_reached"),
        (Self::HOME_SWITCH, "home_switch"),
        (Self::LIMIT_SWITCHES, "limit_switches"),
        (Self::POSITIVE_LIMIT_SWITCH, "positive_limit_switch"),
        (Self::NEGATIVE_LIMIT_SWITCH, "negative_limit_switch"),
        (Self::VELOCITY_THRESHOLD, "velocity_threshold"),
        (Self::TORQUE_THRESHOLD, "torque_threshold"),
    ];

    /// The single bit with this exact name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(_, known)| *known == name).map(|(bit, _)| *bit)
    }
}

/// What the north side wants of one axis in this cycle. The north side sets it; the axis completes it for its drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisCommand {
    /// Operating mode: which set-point the drive follows.
    pub mode: OperatingMode,
    /// Who generates the profile.
    pub interpolation: InterpolationSource,
    /// Position set-point, 1e-9 revolution or mm, unrolled.
    pub position: Position,
    /// Velocity set-point, 1e-9 revolution/s or mm/s.
    pub velocity: Velocity,
    /// Acceleration set-point, 1e-9 revolution/s^2 or mm/s^2.
    pub acceleration: Acceleration,
    /// Torque or force set-point, 1e-6 of the rated one.
    pub torque: Torque,
    /// Added to the position set-point.
    pub position_offset: Position,
    /// Added to the velocity set-point: trim and feed-forward.
    pub velocity_offset: Velocity,
    /// Added to the torque set-point: trim and feed-forward.
    pub torque_offset: Torque,
    /// Target that the drive moves to with a profile of its own, 1e-9 revolution or mm.
    pub target_position: Position,
    /// Highest speed of that profile, 1e-9 revolution/s or mm/s, not negative.
    pub profile_velocity: Velocity,
    /// Acceleration of that profile, 1e-9 revolution/s^2 or mm/s^2.
    pub profile_acceleration: Acceleration,
    /// Deceleration of that profile, 1e-9 revolution/s^2 or mm/s^2.
    pub profile_deceleration: Acceleration,
    /// Which of the values above are valid.
    pub present: CommandSet,
    /// Instant on the local clock at which the set-points are to be reached; `None` for as soon as possible.
    pub target_time: Option<MonotonicTime>,
    /// A request to the state machine, if there is one.
    pub request: Option<Request>,
    /// Changes with every fresh command; the same number twice means the command is old.
    pub sequence: u32,
}

impl AxisCommand {
    /// The signals that a profile of the drive needs.
    pub const PROFILE: CommandSet = CommandSet::TARGET_POSITION
        .union(CommandSet::PROFILE_VELOCITY)
        .union(CommandSet::PROFILE_ACCELERATION)
        .union(CommandSet::PROFILE_DECELERATION);

    /// The signals that lead the axis from cycle to cycle.
    pub const SET_POINTS: CommandSet = CommandSet::POSITION
        .union(CommandSet::VELOCITY)
        .union(CommandSet::ACCELERATION)
        .union(CommandSet::TORQUE);

    /// Takes [`AxisCommand::SET_POINTS`] of another command: those that it lacks become absent. Nothing else changes.
    pub fn take_set_points(&mut self, other: &Self) {
        self.position = other.position;
        self.velocity = other.velocity;
        self.acceleration = other.acceleration;
        self.torque = other.torque;
        self.present = (self.present - Self::SET_POINTS) | (other.present & Self::SET_POINTS);
    }

    /// Puts position, velocity, acceleration and torque; those without a value become absent. Nothing else changes.
    pub fn put_set_points(&mut self, values: [Option<i64>; 4]) {
        self.present.remove(Self::SET_POINTS);
        let signals = [
            Signal::PositionCommand,
            Signal::VelocityCommand,
            Signal::AccelerationCommand,
            Signal::TorqueCommand,
        ];
        for (signal, value) in signals.into_iter().zip(values) {
            if let Some(value) = value {
                self.set(signal, value);
            }
        }
    }

    /// The operating mode, and who generates the profile.
    pub const fn selection(&self) -> ModeSelection {
        ModeSelection { mode: self.mode, interpolation: self.interpolation }
    }

    /// Sets the operating mode, and who generates the profile.
    pub const fn select(&mut self, selection: ModeSelection) {
        self.mode = selection.mode;
        self.interpolation = selection.interpolation;
    }

    /// Puts the offset of the set-point that leads in this mode into that set-point: the parts downstream see one value, and
    /// the offset is zero. Returns `false`, and changes nothing, when the sum does not fit.
    pub fn add_own_offset(&mut self) -> bool {
        let Some((command, Some(offset))) = Signal::leading(self.mode) else { return true };
        let (Some(value), Some(added)) = (self.get(command), self.get(offset)) else { return true };
        value.checked_add(added).is_some_and(|sum| self.set(command, sum) && self.set(offset, 0))
    }

    /// The value of a command signal, or `None` when it is absent or belongs to the feedback.
    #[inline]
    pub fn get(&self, signal: Signal) -> Option<i64> {
        let (bit, value) = match signal {
            Signal::PositionCommand => (CommandSet::POSITION, self.position.0),
            Signal::VelocityCommand => (CommandSet::VELOCITY, self.velocity.0),
            Signal::AccelerationCommand => (CommandSet::ACCELERATION, self.acceleration.0),
            Signal::TorqueCommand => (CommandSet::TORQUE, self.torque.0),
            Signal::PositionOffset => (CommandSet::POSITION_OFFSET, self.position_offset.0),
            Signal::VelocityOffset => (CommandSet::VELOCITY_OFFSET, self.velocity_offset.0),
            Signal::TorqueOffset => (CommandSet::TORQUE_OFFSET, self.torque_offset.0),
            Signal::TargetPosition => (CommandSet::TARGET_POSITION, self.target_position.0),
            Signal::ProfileVelocity => (CommandSet::PROFILE_VELOCITY, self.profile_velocity.0),
            Signal::ProfileAcceleration => (CommandSet::PROFILE_ACCELERATION, self.profile_acceleration.0),
            Signal::ProfileDeceleration => (CommandSet::PROFILE_DECELERATION, self.profile_deceleration.0),
            _ => return None,
        };
        self.present.contains(bit).then_some(value)
    }

    /// Sets a command signal and marks it present. Returns `false`, and changes nothing, when the signal
    /// belongs to the feedback.
    #[inline]
    pub fn set(&mut self, signal: Signal, value: i64) -> bool {
        let bit = match signal {
            Signal::PositionCommand => {
                self.position = Position(value);
                CommandSet::POSITION
            }
            Signal::VelocityCommand => {
                self.velocity = Velocity(value);
                CommandSet::VELOCITY
            }
            Signal::AccelerationCommand => {
                self.acceleration = Acceleration(value);
                CommandSet::ACCELERATION
            }
            Signal::TorqueCommand => {
                self.torque = Torque(value);
                CommandSet::TORQUE
            }
            Signal::PositionOffset => {
                self.position_offset = Position(value);
                CommandSet::POSITION_OFFSET
            }
            Signal::VelocityOffset => {
                self.velocity_offset = Velocity(value);
                CommandSet::VELOCITY_OFFSET
            }
            Signal::TorqueOffset => {
                self.torque_offset = Torque(value);
                CommandSet::TORQUE_OFFSET
            }
            Signal::TargetPosition => {
                self.target_position = Position(value);
                CommandSet::TARGET_POSITION
            }
            Signal::ProfileVelocity => {
                self.profile_velocity = Velocity(value);
                CommandSet::PROFILE_VELOCITY
            }
            Signal::ProfileAcceleration => {
                self.profile_acceleration = Acceleration(value);
                CommandSet::PROFILE_ACCELERATION
            }
            Signal::ProfileDeceleration => {
                self.profile_deceleration = Acceleration(value);
                CommandSet::PROFILE_DECELERATION
            }
            _ => return false,
        };
        self.present |= bit;
        true
    }
}

impl SignalImage for AxisCommand {
    fn owns(signal: Signal) -> bool {
        signal.is_command()
    }

    #[inline]
    fn get(&self, signal: Signal) -> Option<i64> {
        AxisCommand::get(self, signal)
    }

    #[inline]
    fn set(&mut self, signal: Signal, value: i64) -> bool {
        AxisCommand::set(self, signal, value)
    }
}

/// What is known of one axis in this cycle. The axis sets it from what its drive reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisFeedback {
    /// The state of the generic state machine.
    pub state: DriveState,
    /// What the drive itself last reported.
    pub report: Report,
    /// Operating mode that the drive shows.
    pub mode: OperatingMode,
    /// Who generates the profile that the drive follows.
    pub interpolation: InterpolationSource,
    /// Actual position, 1e-9 revolution or mm, unrolled.
    pub position: Position,
    /// Actual velocity, 1e-9 revolution/s or mm/s.
    pub velocity: Velocity,
    /// Actual acceleration, 1e-9 revolution/s^2 or mm/s^2.
    pub acceleration: Acceleration,
    /// Actual torque or force, 1e-6 of the rated one.
    pub torque: Torque,
    /// Actual motor current, uA.
    pub current: Current,
    /// Voltage of the DC bus, uV.
    pub bus_voltage: Voltage,
    /// Temperature of the motor, 0.001 degree C.
    pub temperature: Temperature,
    /// Position set-point less actual position.
    pub following_error: Position,
    /// Digital inputs, bit 0 first.
    pub digital_inputs: u32,
    /// Which of the values above are valid.
    pub present: FeedbackSet,
    /// Status bits.
    pub status: StatusBits,
    /// What keeps the axis from starting.
    pub inhibits: Inhibits,
    /// The latched fault, if there is one.
    pub fault: Option<Fault>,
    /// Whether this cycle brought new data from the drive.
    pub fresh: bool,
    /// Cycles since the last new data; 0 when fresh.
    pub age_cycles: u32,
    /// When the actual values were taken.
    pub at: MonotonicTime,
}

impl AxisFeedback {
    /// What the drive follows, and who makes the way.
    pub const fn selection(&self) -> ModeSelection {
        ModeSelection { mode: self.mode, interpolation: self.interpolation }
    }

    /// The value of a feedback signal, or `None` when it is absent or belongs to the command.
    #[inline]
    pub fn get(&self, signal: Signal) -> Option<i64> {
        let (bit, value) = match signal {
            Signal::PositionActual => (FeedbackSet::POSITION, self.position.0),
            Signal::VelocityActual => (FeedbackSet::VELOCITY, self.velocity.0),
            Signal::AccelerationActual => (FeedbackSet::ACCELERATION, self.acceleration.0),
            Signal::TorqueActual => (FeedbackSet::TORQUE, self.torque.0),
            Signal::CurrentActual => (FeedbackSet::CURRENT, self.current.0),
            Signal::BusVoltage => (FeedbackSet::BUS_VOLTAGE, self.bus_voltage.0),
            Signal::Temperature => (FeedbackSet::TEMPERATURE, self.temperature.0),
            Signal::FollowingError => (FeedbackSet::FOLLOWING_ERROR, self.following_error.0),
            Signal::DigitalInputs => (FeedbackSet::DIGITAL_INPUTS, i64::from(self.digital_inputs)),
            _ => return None,
        };
        self.present.contains(bit).then_some(value)
    }

    /// Sets a feedback signal and marks it present. Returns `false`, and changes nothing, when the signal
    /// belongs to the command or the value does not fit (digital inputs are 32 bits).
    #[inline]
    pub fn set(&mut self, signal: Signal, value: i64) -> bool {
        let bit = match signal {
            Signal::PositionActual => {
                self.position = Position(value);
                FeedbackSet::POSITION
            }
            Signal::VelocityActual => {
                self.velocity = Velocity(value);
                FeedbackSet::VELOCITY
            }
            Signal::AccelerationActual => {
                self.acceleration = Acceleration(value);
                FeedbackSet::ACCELERATION
            }
            Signal::TorqueActual => {
                self.torque = Torque(value);
                FeedbackSet::TORQUE
            }
            Signal::CurrentActual => {
                self.current = Current(value);
                FeedbackSet::CURRENT
            }
            Signal::BusVoltage => {
                self.bus_voltage = Voltage(value);
                FeedbackSet::BUS_VOLTAGE
            }
            Signal::Temperature => {
                self.temperature = Temperature(value);
                FeedbackSet::TEMPERATURE
            }
            Signal::FollowingError => {
                self.following_error = Position(value);
                FeedbackSet::FOLLOWING_ERROR
            }
            Signal::DigitalInputs => {
                let Ok(bits) = u32::try_from(value) else { return false };
                self.digital_inputs = bits;
                FeedbackSet::DIGITAL_INPUTS
            }
            _ => return false,
        };
        self.present |= bit;
        true
    }
}

impl SignalImage for AxisFeedback {
    fn owns(signal: Signal) -> bool {
        !signal.is_command()
    }

    #[inline]
    fn get(&self, signal: Signal) -> Option<i64> {
        AxisFeedback::get(self, signal)
    }

    #[inline]
    fn set(&mut self, signal: Signal, value: i64) -> bool {
        AxisFeedback::set(self, signal, value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_signal_belongs_to_exactly_one_image_and_reads_back() {
        for (signal, value) in Signal::ALL.iter().copied().zip(1_000..) {
            assert_eq!(Signal::parse(signal.name()), Some(signal));
            let (mut command, mut feedback) = (AxisCommand::default(), AxisFeedback::default());
            assert_eq!(
                (command.get(signal), feedback.get(signal)),
                (None, None),
                "{signal} present in an empty image"
            );
            assert_eq!(command.set(signal, value), signal.is_command(), "{signal}");
            assert_eq!(feedback.set(signal, value), !signal.is_command(), "{signal}");
            assert_eq!(command.get(signal), signal.is_command().then_some(value), "{signal}");
            assert_eq!(feedback.get(signal), (!signal.is_command()).then_some(value), "{signal}");
            for other in Signal::ALL.iter().copied().filter(|other| *other != signal) {
                assert_eq!(
                    (command.get(other), feedback.get(other)),
                    (None, None),
                    "{signal} leaks into {other}"
                );
            }
        }
    }

    #[test]
    fn an_offset_goes_into_the_set_point_of_its_own_mode_only() {
        for mode in OperatingMode::ALL.iter().copied() {
            let mut command = AxisCommand { mode, ..AxisCommand::default() };
            for (signal, value) in Signal::ALL.iter().copied().filter(|signal| signal.is_command()).zip(1..) {
                command.set(signal, value);
            }
            let mut expected = command;
            if let Some((set_point, Some(offset))) = Signal::leading(mode) {
                let sum = command.get(set_point).zip(command.get(offset)).map(|(a, b)| a + b);
                expected.set(set_point, sum.expect("both are there"));
                expected.set(offset, 0);
            }
            assert!(command.add_own_offset());
            assert_eq!(command, expected, "{mode}");
        }
        let mut absent = AxisCommand { mode: OperatingMode::Velocity, ..AxisCommand::default() };
        absent.set(Signal::VelocityCommand, 5);
        assert!(absent.add_own_offset());
        assert_eq!(absent.get(Signal::VelocityCommand), Some(5));
        let mut huge = AxisCommand { mode: OperatingMode::Torque, ..AxisCommand::default() };
        huge.set(Signal::TorqueCommand, i64::MAX);
        huge.set(Signal::TorqueOffset, 1);
        let before = huge;
        assert!(!huge.add_own_offset());
        assert_eq!(huge, before);
    }

    #[test]
    fn inputs_refuse_more_than_32_bits() {
        let mut feedback = AxisFeedback::default();
        assert!(!feedback.set(Signal::DigitalInputs, 1 << 32));
        assert!(!feedback.set(Signal::DigitalInputs, -1));
        assert_eq!(feedback, AxisFeedback::default());
        assert!(feedback.set(Signal::DigitalInputs, 0xFFFF_FFFF));
        assert_eq!(feedback.get(Signal::DigitalInputs), Some(0xFFFF_FFFF));
    }

    #[test]
    fn status_names_lead_back_and_cover_single_bits_once() {
        let mut seen = StatusBits::empty();
        for (bit, name) in StatusBits::NAMED {
            assert_eq!(bit.bits().count_ones(), 1, "{name}");
            assert_eq!(StatusBits::parse(name), Some(*bit));
            assert!(!seen.intersects(*bit), "{name} twice");
            seen |= *bit;
        }
        assert_eq!(seen.bits(), (1 << StatusBits::NAMED.len()) - 1);
    }
}
