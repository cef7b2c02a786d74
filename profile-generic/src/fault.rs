//! Faults: causes, classes and the reaction each of them requires.

use crate::code::named_enum;
use crate::open_code;
use crate::time::SystemTime;
use core::fmt;

named_enum! {
    /// Where a fault belongs; decides who it concerns and how it can be cleared.
    pub enum FaultClass {
        /// Found during start-up; only a restart clears it.
        Initialization = "initialization",
        /// Concerns the communication node and therefore every axis behind it.
        Node = "node",
        /// Concerns one axis while it runs.
        Axis = "axis",
        /// Reported by a safety function, which has already acted on its own.
        Safety = "safety",
        /// Reported only; nothing stops.
        Alarm = "alarm",
        /// Keeps the axis from starting and clears itself.
        Inhibit = "inhibit",
    }
}

named_enum! {
    /// What the drive has to do about a fault, ordered by how much control is given up.
    #[derive(Default)]
    pub enum Reaction {
        /// Nothing at all.
        Ignore = "ignore",
        /// Report it and carry on.
        Alarm = "alarm",
        /// Stop and hold the position with torque.
        HoldPosition = "hold_position",
        /// Stop under control, then take the torque away.
        #[default]
        DecelerateAndDisable = "decelerate_and_disable",
        /// Take the torque away at once and coast.
        CoastAndDisable = "coast_and_disable",
        /// Take the torque away at once and latch the shutdown.
        Shutdown = "shutdown",
    }
}

impl Reaction {
    /// Whether this reaction stops the axis.
    pub const fn stops(self) -> bool {
        !matches!(self, Self::Ignore | Self::Alarm)
    }
}

/// One row per cause: constant, code, name, class, reaction the cause requires when nobody configured
/// another.
macro_rules! fault_catalogue {
    ($( $(#[$doc:meta])*
        $constant:ident = $value:literal, $name:literal, $class:ident, $reaction:ident; )*) => {
        open_code! {
            /// The cause of a fault: the generic catalogue that each profile's codes are mapped to.
            pub struct FaultCause(u16) {
                $( $(#[$doc])* $constant = $value => $name, )*
            }
        }

        impl FaultCause {
            /// The class of this cause; an unknown cause concerns its axis.
            pub const fn class(self) -> FaultClass {
                match self {
                    $( Self::$constant => FaultClass::$class, )*
                    _ => FaultClass::Axis,
                }
            }

            /// The reaction this cause requires unless another is configured; an unknown cause stops the
            /// axis.
            pub const fn default_reaction(self) -> Reaction {
                match self {
                    $( Self::$constant => Reaction::$reaction, )*
                    _ => Reaction::DecelerateAndDisable,
                }
            }
        }
    };
}

fault_catalogue! {
    /// The drive reports a fault that has no generic name; the vendor code reports it.
    DRIVE_SPECIFIC = 0x0001, "drive_specific", Axis, DecelerateAndDisable;
    /// The drive warns of something that has no generic name; the vendor code reports it.
    DRIVE_WARNING = 0x0002, "drive_warning", Alarm, Alarm;

    /// The motor current exceeded its peak limit.
    MOTOR_OVER_CURRENT = 0x0101, "motor_over_current", Axis, CoastAndDisable;
    /// The commutation of the motor is wrong or was lost.
    COMMUTATION = 0x0102, "commutation", Axis, CoastAndDisable;
    /// The motor turns faster than it may.
    MOTOR_OVER_SPEED = 0x0103, "motor_over_speed", Axis, CoastAndDisable;
    /// The motor turns faster than the user's limit.
    MOTOR_OVER_SPEED_USER_LIMIT = 0x0104, "motor_over_speed_user_limit", Axis, DecelerateAndDisable;
    /// The motor is hotter than it may be, or its thermal switch opened.
    MOTOR_OVER_TEMPERATURE = 0x0105, "motor_over_temperature", Axis, CoastAndDisable;
    /// The motor is hotter than the user's limit.
    MOTOR_OVER_TEMPERATURE_USER_LIMIT =
        0x0106, "motor_over_temperature_user_limit", Axis, DecelerateAndDisable;
    /// The thermal model of the motor reached its capacity.
    MOTOR_OVERLOAD = 0x0107, "motor_overload", Axis, DecelerateAndDisable;
    /// The thermal model of the motor reached the user's limit.
    MOTOR_OVERLOAD_USER_LIMIT = 0x0108, "motor_overload_user_limit", Axis, DecelerateAndDisable;
    /// A motor phase carries no current.
    MOTOR_PHASE_LOSS = 0x0109, "motor_phase_loss", Axis, CoastAndDisable;
    /// A motor phase is shorted to earth or to another phase.
    MOTOR_SHORT_CIRCUIT = 0x010A, "motor_short_circuit", Axis, CoastAndDisable;
    /// The motor stands although torque is at its limit.
    MOTOR_STALLED = 0x010B, "motor_stalled", Axis, DecelerateAndDisable;
    /// Torque rose above the user's upper limit.
    OVER_TORQUE = 0x010C, "over_torque", Axis, DecelerateAndDisable;
    /// Torque fell below the user's lower limit.
    UNDER_TORQUE = 0x010D, "under_torque", Axis, DecelerateAndDisable;

    /// The inverter current exceeded its peak limit.
    OVER_CURRENT = 0x0201, "over_current", Axis, CoastAndDisable;
    /// The inverter is hotter than it may be.
    DRIVE_OVER_TEMPERATURE = 0x0202, "drive_over_temperature", Axis, CoastAndDisable;
    /// The inverter is hotter than the user's limit.
    DRIVE_OVER_TEMPERATURE_USER_LIMIT =
        0x0203, "drive_over_temperature_user_limit", Axis, DecelerateAndDisable;
    /// The thermal model of the inverter reached its capacity.
    DRIVE_OVERLOAD = 0x0204, "drive_overload", Axis, DecelerateAndDisable;
    /// The thermal model of the inverter reached the user's limit.
    DRIVE_OVERLOAD_USER_LIMIT = 0x0205, "drive_overload_user_limit", Axis, DecelerateAndDisable;
    /// The control electronics supply is out of range.
    CONTROL_VOLTAGE = 0x0206, "control_voltage", Axis, CoastAndDisable;
    /// Current flows to earth.
    GROUND_CURRENT = 0x0207, "ground_current", Axis, CoastAndDisable;
    /// The cooling (fan, water) failed.
    COOLING = 0x0208, "cooling", Axis, DecelerateAndDisable;
    /// The cooling fails; the drive still goes on.
    COOLING_WARNING = 0x0209, "cooling_warning", Alarm, Alarm;

    /// The DC bus voltage is above its limit.
    OVER_VOLTAGE = 0x0301, "over_voltage", Axis, CoastAndDisable;
    /// The DC bus voltage is above the user's limit.
    OVER_VOLTAGE_USER_LIMIT = 0x0302, "over_voltage_user_limit", Axis, DecelerateAndDisable;
    /// The DC bus voltage is below its limit.
    UNDER_VOLTAGE = 0x0303, "under_voltage", Axis, CoastAndDisable;
    /// The DC bus voltage is below the user's limit.
    UNDER_VOLTAGE_USER_LIMIT = 0x0304, "under_voltage_user_limit", Axis, DecelerateAndDisable;
    /// The DC bus lost its power for longer than allowed.
    POWER_LOSS = 0x0305, "power_loss", Axis, CoastAndDisable;
    /// The mains lost several phases.
    MAINS_LOSS = 0x0306, "mains_loss", Axis, DecelerateAndDisable;
    /// The mains lost one phase.
    MAINS_PHASE_LOSS = 0x0307, "mains_phase_loss", Axis, DecelerateAndDisable;
    /// The DC bus could not be charged.
    PRE_CHARGE = 0x0308, "pre_charge", Axis, CoastAndDisable;
    /// The brake resistor or its switch failed.
    BUS_REGULATOR = 0x0309, "bus_regulator", Axis, CoastAndDisable;
    /// The brake resistor is overloaded or too hot.
    BUS_REGULATOR_OVERLOAD = 0x030A, "bus_regulator_overload", Axis, DecelerateAndDisable;
    /// The converter current exceeded its peak limit.
    CONVERTER_OVER_CURRENT = 0x030B, "converter_over_current", Axis, CoastAndDisable;
    /// The converter is too hot.
    CONVERTER_OVER_TEMPERATURE = 0x030C, "converter_over_temperature", Axis, CoastAndDisable;
    /// The converter is overloaded.
    CONVERTER_OVERLOAD = 0x030D, "converter_overload", Axis, DecelerateAndDisable;
    /// A fuse of the DC bus is blown.
    BUS_FUSE = 0x030E, "bus_fuse", Axis, CoastAndDisable;
    /// Another device on the shared DC bus asks that no more power be taken.
    BUS_SHARING = 0x030F, "bus_sharing", Axis, DecelerateAndDisable;
    /// A phase of the mains is shorted to another or to earth.
    MAINS_SHORT_CIRCUIT = 0x0310, "mains_short_circuit", Axis, CoastAndDisable;
    /// Power leaks from the DC bus, for instance through a wrong sharing connection.
    BUS_LEAKAGE = 0x0311, "bus_leakage", Axis, CoastAndDisable;

    /// The feedback signal is lost.
    FEEDBACK_LOSS = 0x0401, "feedback_loss", Axis, CoastAndDisable;
    /// The feedback signal is noisy.
    FEEDBACK_NOISE = 0x0402, "feedback_noise", Axis, DecelerateAndDisable;
    /// The serial data of the feedback device failed too often.
    FEEDBACK_DATA_LOSS = 0x0403, "feedback_data_loss", Axis, CoastAndDisable;
    /// The feedback device reports an error of its own.
    FEEDBACK_DEVICE = 0x0404, "feedback_device", Axis, CoastAndDisable;
    /// Two feedback devices of one axis disagree.
    FEEDBACK_MISMATCH = 0x0405, "feedback_mismatch", Axis, DecelerateAndDisable;
    /// The battery of an absolute feedback device is empty or the absolute position is lost.
    ABSOLUTE_POSITION_LOST = 0x0406, "absolute_position_lost", Axis, DecelerateAndDisable;

    /// The position error exceeded its tolerance.
    EXCESSIVE_POSITION_ERROR = 0x0501, "excessive_position_error", Axis, DecelerateAndDisable;
    /// The velocity error exceeded its tolerance.
    EXCESSIVE_VELOCITY_ERROR = 0x0502, "excessive_velocity_error", Axis, DecelerateAndDisable;
    /// The limit switch at the positive end opened.
    HARDWARE_OVERTRAVEL_POSITIVE = 0x0503, "hardware_overtravel_positive", Axis, DecelerateAndDisable;
    /// The limit switch at the negative end opened.
    HARDWARE_OVERTRAVEL_NEGATIVE = 0x0504, "hardware_overtravel_negative", Axis, DecelerateAndDisable;
    /// The position is beyond the positive software limit.
    SOFTWARE_OVERTRAVEL_POSITIVE = 0x0505, "software_overtravel_positive", Axis, DecelerateAndDisable;
    /// The position is beyond the negative software limit.
    SOFTWARE_OVERTRAVEL_NEGATIVE = 0x0506, "software_overtravel_negative", Axis, DecelerateAndDisable;
    /// A set-point is beyond the position limits.
    POSITION_COMMAND_LIMIT = 0x0507, "position_command_limit", Axis, DecelerateAndDisable;
    /// A set-point asks for more velocity than allowed.
    VELOCITY_COMMAND_LIMIT = 0x0508, "velocity_command_limit", Axis, DecelerateAndDisable;
    /// A set-point asks for more acceleration than allowed.
    ACCELERATION_COMMAND_LIMIT = 0x0509, "acceleration_command_limit", Axis, DecelerateAndDisable;
    /// Homing did not find what it looked for.
    HOMING = 0x050A, "homing", Axis, DecelerateAndDisable;
    /// The axis moves although it should stand.
    STANDSTILL_MOVEMENT = 0x050B, "standstill_movement", Axis, DecelerateAndDisable;
    /// The drive was given a target outside its travel range and does not go there.
    POSITION_COMMAND_WARNING = 0x050C, "position_command_warning", Alarm, Alarm;
    /// The drive was given a positioning velocity above its limit and keeps to the limit.
    VELOCITY_COMMAND_WARNING = 0x050D, "velocity_command_warning", Alarm, Alarm;

    /// The motor moved while the brake was closed.
    BRAKE_SLIP = 0x0601, "brake_slip", Axis, HoldPosition;
    /// The brake or its supply failed.
    BRAKE = 0x0602, "brake", Axis, DecelerateAndDisable;
    /// The enable input went away while the power stage was on.
    ENABLE_INPUT_LOST = 0x0603, "enable_input_lost", Axis, CoastAndDisable;
    /// An external input asks for a fault.
    EXTERNAL_INPUT = 0x0604, "external_input", Axis, DecelerateAndDisable;
    /// The controller asked for an abort.
    CONTROLLER_ABORT = 0x0605, "controller_abort", Axis, DecelerateAndDisable;
    /// The operating mode asked for is not supported.
    ILLEGAL_MODE = 0x0606, "illegal_mode", Axis, DecelerateAndDisable;
    /// The drive did not come into operation in time.
    START_TIME_OUT = 0x0607, "start_time_out", Axis, DecelerateAndDisable;
    /// The drive did not come to a stop in time.
    STOP_TIME_OUT = 0x0608, "stop_time_out", Axis, CoastAndDisable;
    /// The drive has torque although nobody asked for it.
    UNEXPECTED_TORQUE = 0x0609, "unexpected_torque", Axis, CoastAndDisable;
    /// The drive left operation by itself.
    LEFT_OPERATION = 0x060A, "left_operation", Axis, CoastAndDisable;

    /// Communication with the controller is lost.
    COMMUNICATION_LOSS = 0x0701, "communication_loss", Node, DecelerateAndDisable;
    /// Fresh set-points stopped coming while the connection stands.
    COMMAND_LOST = 0x0702, "command_lost", Node, DecelerateAndDisable;
    /// The drive no longer answers the gateway.
    SOUTH_SILENCE = 0x0703, "south_silence", Node, DecelerateAndDisable;
    /// The local clock lost the system time, or jumped too far.
    SYNCHRONIZATION_LOSS = 0x0704, "synchronization_loss", Node, DecelerateAndDisable;
    /// A set-point came with a time stamp that cannot be right.
    TIME_STAMP = 0x0705, "time_stamp", Node, DecelerateAndDisable;
    /// A telegram was understood only in part.
    DATA_FORMAT = 0x0706, "data_format", Node, DecelerateAndDisable;
    /// The connection was closed while the axis ran.
    CONNECTION_CLOSED = 0x0707, "connection_closed", Node, DecelerateAndDisable;
    /// The south bus left its operating phase.
    BUS_PHASE = 0x0708, "bus_phase", Node, DecelerateAndDisable;
    /// Two stations claim the same address.
    DUPLICATE_ADDRESS = 0x0709, "duplicate_address", Node, DecelerateAndDisable;
    /// The watchdog of a processor expired.
    PROCESSOR_WATCHDOG = 0x070A, "processor_watchdog", Node, CoastAndDisable;
    /// The hardware of the node failed.
    NODE_HARDWARE = 0x070B, "node_hardware", Node, CoastAndDisable;

    /// The memory of the program or of the parameters is corrupt.
    MEMORY = 0x0801, "memory", Initialization, Shutdown;
    /// The configuration contradicts itself.
    CONFIGURATION = 0x0802, "configuration", Axis, DecelerateAndDisable;
    /// A parameter is missing or out of range.
    PARAMETER = 0x0803, "parameter", Axis, DecelerateAndDisable;
    /// The drive is not the one that was configured.
    WRONG_DEVICE = 0x0804, "wrong_device", Axis, DecelerateAndDisable;
    /// An error inside the device that its program noticed.
    INTERNAL = 0x0805, "internal", Axis, CoastAndDisable;
    /// The start-up test of the device failed.
    SELF_TEST = 0x0806, "self_test", Initialization, Shutdown;
    /// A value was beyond what its target can hold and was clamped.
    CONVERSION_SATURATED = 0x0807, "conversion_saturated", Alarm, Alarm;

    /// The safe torque off function took the torque away.
    SAFE_TORQUE_OFF = 0x0901, "safe_torque_off", Safety, CoastAndDisable;
    /// A safe stop function failed or was violated.
    SAFE_STOP = 0x0902, "safe_stop", Safety, CoastAndDisable;
    /// A safe speed, acceleration or direction limit was violated.
    SAFE_MOTION_LIMIT = 0x0903, "safe_motion_limit", Safety, CoastAndDisable;
    /// The safe feedback failed.
    SAFE_FEEDBACK = 0x0904, "safe_feedback", Safety, CoastAndDisable;
    /// The safety core of the drive failed.
    SAFETY_CORE = 0x0905, "safety_core", Safety, CoastAndDisable;
}

/// A fault as it happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Fault {
    /// What happened.
    pub cause: FaultCause,
    /// Whom it concerns.
    pub class: FaultClass,
    /// What has to be done about it.
    pub reaction: Reaction,
    /// The drive's own code for it, 0 when it gave none.
    pub vendor_code: u32,
    /// When it was noticed.
    pub at: SystemTime,
}

impl Fault {
    /// A fault with the class and reaction that its cause has by default, and no vendor code.
    pub const fn new(cause: FaultCause, at: SystemTime) -> Self {
        Self { cause, class: cause.class(), reaction: cause.default_reaction(), vendor_code: 0, at }
    }

    /// The best stop that the fault leaves. A warning leaves a controlled one.
    pub const fn best_stop(&self) -> Reaction {
        if self.reaction.stops() { self.reaction } else { Reaction::DecelerateAndDisable }
    }

    /// The same fault with the drive's own code.
    pub const fn with_vendor_code(self, vendor_code: u32) -> Self {
        Self { vendor_code, ..self }
    }

    /// The same fault with a configured reaction.
    pub const fn with_reaction(self, reaction: Reaction) -> Self {
        Self { reaction, ..self }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({} fault, {}", self.cause, self.class, self.reaction)?;
        if self.vendor_code != 0 {
            write!(f, ", vendor code {:#010x}", self.vendor_code)?;
        }
        write!(f, ") at {}", self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_catalogue_is_ordered_complete_and_uniquely_named() {
        assert!(FaultCause::NAMED.len() >= 40, "{}", FaultCause::NAMED.len());
        for pair in FaultCause::NAMED.windows(2) {
            assert!(pair[0].0 < pair[1].0, "{:?} before {:?}", pair[0], pair[1]);
        }
        for (cause, name) in FaultCause::NAMED {
            assert_eq!(FaultCause::from_name(name), Some(*cause), "{name}");
            assert!(name.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'_'), "{name}");
        }
    }

    #[test]
    fn only_alarms_let_the_axis_run_on() {
        for (cause, name) in FaultCause::NAMED {
            assert_eq!(cause.default_reaction().stops(), cause.class() != FaultClass::Alarm, "{name}");
        }
    }

    #[test]
    fn an_unknown_cause_stops_its_axis() {
        let fault = Fault::new(FaultCause(0xEEEE), SystemTime(7));
        assert_eq!(fault.class, FaultClass::Axis);
        assert_eq!(fault.reaction, Reaction::DecelerateAndDisable);
        assert_eq!(
            fault.with_vendor_code(0x1234).to_string(),
            "0xeeee (axis fault, decelerate_and_disable, vendor code 0x00001234) at 0.000000007 s"
        );
    }

    #[test]
    fn reactions_are_ordered_by_how_much_control_is_given_up() {
        assert!(Reaction::Alarm < Reaction::HoldPosition);
        assert!(Reaction::DecelerateAndDisable < Reaction::CoastAndDisable);
        assert_eq!(Reaction::ALL.iter().max(), Some(&Reaction::Shutdown));
    }
}
