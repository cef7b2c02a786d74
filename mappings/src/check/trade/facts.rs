//! Facts of the standards that the rules of this folder compare the tables with.
//!
//! They are stated here once and not read from the tables, so that a change of a table cannot change what it is compared with.

use super::commissioning::{Step, When};

/// A value of a SERCOS drive, and the bit by which the drive inverts it.
pub(super) struct SercosSign {
    pub idn: &'static str,
    pub polarity: &'static str,
    pub bit: u32,
}

const fn sign(idn: &'static str, polarity: &'static str, bit: u32) -> SercosSign {
    SercosSign { idn, polarity, bit }
}

/// S-0-0055, S-0-0043, S-0-0085: bit 0 inverts the command value, bit 1 the additive one, bit 2 feedback 1, bit 3 feedback 2.
pub(super) const SERCOS_SIGNS: &[SercosSign] = &[
    sign("S-0-0047", "S-0-0055", 0),
    sign("S-0-0258", "S-0-0055", 0),
    sign("S-0-0048", "S-0-0055", 1),
    sign("S-0-0051", "S-0-0055", 2),
    sign("S-0-0053", "S-0-0055", 3),
    sign("S-0-0036", "S-0-0043", 0),
    sign("S-0-0037", "S-0-0043", 1),
    sign("S-0-0040", "S-0-0043", 2),
    sign("S-0-0156", "S-0-0043", 3),
    sign("S-0-0080", "S-0-0085", 0),
    sign("S-0-0081", "S-0-0085", 1),
    sign("S-0-0084", "S-0-0085", 2),
];

/// The bit that gives the axis its direction: that of the actual position.
pub(super) const SERCOS_DIRECTION: (&str, u32) = ("S-0-0055", 2);

/// 607Eh: bit 7 inverts positions, bit 6 velocities. Torques are not inverted. A magnitude of a profile goes with the position.
pub(super) const CIA402_SIGNS: &[(&str, Option<&str>)] = &[
    ("607A:00", Some(CIA402_POSITION)),
    ("60C1:01", Some(CIA402_POSITION)),
    ("6064:00", Some(CIA402_POSITION)),
    ("60F4:00", Some(CIA402_POSITION)),
    ("6081:00", Some(CIA402_POSITION)),
    ("6083:00", Some(CIA402_POSITION)),
    ("6084:00", Some(CIA402_POSITION)),
    ("60FF:00", Some(CIA402_VELOCITY)),
    ("6042:00", Some(CIA402_VELOCITY)),
    ("6044:00", Some(CIA402_VELOCITY)),
    ("606C:00", Some(CIA402_VELOCITY)),
    ("60B1:00", Some(CIA402_VELOCITY)),
    ("6071:00", None),
    ("6077:00", None),
    ("60B2:00", None),
];

/// Values of parameters that 607Eh inverts, or does not: then the word is `none`.
pub(super) const CIA402_PARAMETER_SIGNS: &[(&str, &str)] = &[
    ("606B:00", CIA402_VELOCITY),
    ("6074:00", "none"),
    ("6077:00", "none"),
    ("6078:00", "none"),
    ("60E4:01", CIA402_POSITION),
    ("60E5:01", CIA402_VELOCITY),
];

/// The bit of 607Eh that gives the axis its direction.
pub(super) const CIA402_POSITION: &str = "Position polarity";
const CIA402_VELOCITY: &str = "Velocity polarity";

/// What holds a generic value: by name, the IDNs and the objects.
pub(super) struct Binding {
    pub name: &'static str,
    pub idns: &'static [&'static str],
    pub objects: &'static [&'static str],
}

const fn bound(
    name: &'static str,
    idns: &'static [&'static str],
    objects: &'static [&'static str],
) -> Binding {
    Binding { name, idns, objects }
}

/// The words that lead a drive.
pub(super) const WORDS: &[Binding] = &[
    bound("control", &["S-0-0134"], &["6040:00"]),
    bound("status", &["S-0-0135"], &["6041:00"]),
    bound("mode", &[], &["6060:00"]),
    bound("mode_shown", &[], &["6061:00"]),
    bound("modes_supported", &["S-0-0292"], &["6502:00"]),
    bound("polarity", &[], &["607E:00"]),
];

/// Cyclic values.
pub(super) const SIGNALS: &[Binding] = &[
    bound("position_command", &["S-0-0047"], &["607A:00", "60C1:01"]),
    bound("velocity_command", &["S-0-0036"], &["60FF:00", "6042:00"]),
    bound("velocity_offset", &["S-0-0037"], &["60B1:00"]),
    bound("torque_command", &["S-0-0080"], &["6071:00"]),
    bound("torque_offset", &["S-0-0081"], &["60B2:00"]),
    bound("target_position", &["S-0-0258"], &["607A:00"]),
    bound("profile_velocity", &["S-0-0259"], &["6081:00"]),
    bound("profile_acceleration", &["S-0-0260"], &["6083:00"]),
    bound("profile_deceleration", &["S-0-0359"], &["6084:00"]),
    bound("position_actual", &["S-0-0051", "S-0-0053"], &["6064:00"]),
    bound("velocity_actual", &["S-0-0040", "S-0-0156"], &["606C:00", "6044:00"]),
    bound("torque_actual", &["S-0-0084"], &["6077:00"]),
    bound("following_error", &["S-0-0189"], &["60F4:00"]),
    bound("digital_inputs", &[], &["60FD:00"]),
];

/// Cyclic values by the encoder of the load. All others are the same by either encoder.
pub(super) const LOADS: &[Binding] = &[
    bound("position_actual", &["S-0-0053"], &["60E4:01"]),
    bound("velocity_actual", &["S-0-0156"], &["60E5:01"]),
];

/// Values of the encoder of the motor that an axis needs of that of its load, if it goes by that one. On SERCOS the velocity of the
/// load is derived from its positions.
pub(super) const OF_MOTOR: &[&str] = &["S-0-0051", "6064:00", "606C:00"];

/// Limits of one direction by their object: that of the other direction, and that of both.
pub(super) const CIA402_LIMITS: &[(&str, &str, &str)] =
    &[("60E0:00", "60E1:00", "6072:00"), ("60E1:00", "60E0:00", "6072:00")];

/// Parameters.
pub(super) const PARAMETERS: &[Binding] = &[
    bound("position_limit_positive", &["S-0-0049"], &["607D:02"]),
    bound("position_limit_negative", &["S-0-0050"], &["607D:01"]),
    bound("velocity_limit_positive", &["S-0-0038", "S-0-0091"], &["607F:00"]),
    bound("velocity_limit_negative", &["S-0-0039", "S-0-0091"], &["607F:00"]),
    bound("acceleration_limit", &["S-0-0136", "S-0-0138"], &["60C5:00"]),
    bound("deceleration_limit", &["S-0-0137", "S-0-0138"], &["60C6:00"]),
    bound("jerk_limit", &["S-0-0349"], &["60A4:01"]),
    bound("torque_limit_positive", &["S-0-0082", "S-0-0092"], &["60E0:00", "6072:00"]),
    bound("torque_limit_negative", &["S-0-0083", "S-0-0092"], &["60E1:00", "6072:00"]),
    bound("velocity_limit_bipolar", &["S-0-0091"], &[]),
    bound("torque_limit_bipolar", &["S-0-0092"], &["6072:00"]),
    bound("velocity_demand", &[], &["606B:00"]),
    bound("torque_demand", &[], &["6074:00"]),
    bound("torque_reference_limited", &[], &["6074:00"]),
    bound("torque_current", &[], &["6078:00"]),
    bound("drive_rated_current", &["S-0-0112"], &[]),
    bound("brake_release_time", &["S-0-0206"], &[]),
    bound("brake_engage_time", &["S-0-0207"], &[]),
    bound("position_error_tolerance", &["S-0-0159"], &["6065:00"]),
    bound("position_error_tolerance_time", &[], &["6066:00"]),
    bound("in_position_window", &["S-0-0057"], &["6067:00"]),
    bound("at_velocity_window", &["S-0-0157"], &["606D:00"]),
    bound("standstill_window", &["S-0-0124"], &["606F:00"]),
    bound("position_loop_gain", &["S-0-0104"], &[]),
    bound("velocity_integral_time", &["S-0-0101"], &[]),
    bound("velocity_feed_forward_gain", &["S-0-0296"], &[]),
    bound("motor_rated_current", &["S-0-0111"], &["6075:00"]),
    bound("motor_peak_current", &["S-0-0109"], &[]),
    bound("motor_rated_torque", &[], &["6076:00"]),
    bound("motor_max_velocity", &["S-0-0113"], &["6080:00"]),
    bound("gear_ratio_numerator", &["S-0-0121"], &["6091:01"]),
    bound("gear_ratio_denominator", &["S-0-0122"], &["6091:02"]),
    bound("following_error", &["S-0-0189"], &["60F4:00"]),
    bound("torque_actual", &["S-0-0084"], &["6077:00"]),
    bound("load_position_actual", &["S-0-0053"], &["60E4:01"]),
    bound("load_velocity_actual", &["S-0-0156"], &["60E5:01"]),
    bound("loop_torque", &[], &["6074:00"]),
    bound("drive_peak_current", &["S-0-0110"], &[]),
    bound("feedback_velocity_filter", &["S-0-0392"], &[]),
    bound("own_acceleration_feed_forward", &["S-0-0348"], &[]),
    bound("velocity_error", &["S-0-0347"], &[]),
    bound("bus_voltage", &["S-0-0380"], &["6079:00"]),
    bound("motor_temperature", &["S-0-0383"], &[]),
    bound("drive_temperature", &["S-0-0384"], &[]),
    bound("homing_method", &["S-0-0147"], &["6098:00"]),
    bound("homing_velocity", &["S-0-0041"], &["6099:01"]),
    bound("homing_creep_velocity", &[], &["6099:02"]),
    bound("homing_acceleration", &["S-0-0042"], &["609A:00"]),
    bound("home_position", &["S-0-0052"], &[]),
    bound("home_offset", &["S-0-0150"], &["607C:00"]),
    bound("motor_temperature_limit", &["S-0-0204"], &[]),
    bound("drive_temperature_limit", &["S-0-0203"], &[]),
    bound("converter_current", &["S-0-0381"], &[]),
    bound("converter_power", &["S-0-0382"], &[]),
    bound("current_limit", &[], &["6073:00"]),
    bound("operative_current_limit", &[], &["6073:00"]),
    bound("homed", &["S-0-0403"], &[]),
];

/// Parameters that drives hold as a magnitude although the generic value is below zero.
pub(super) const MAGNITUDES: &[(&str, &[&str])] = &[
    ("torque_limit_negative", &["S-0-0083", "S-0-0092", "60E1:00", "6072:00"]),
    ("velocity_limit_negative", &["S-0-0091", "607F:00"]),
];

/// Words of which the other one means the opposite: a name with one is never bound to a name with the other.
pub(super) const OPPOSITES: &[(&str, &str)] = &[
    ("positive", "negative"),
    ("acceleration", "deceleration"),
    ("command", "actual"),
    ("numerator", "denominator"),
    ("release", "engage"),
];

/// Turns of the motor and turns of the load that belong to them.
pub(super) const GEAR: [&str; 2] = ["S-0-0121", "S-0-0122"];
/// Way of the load in one of its turns.
pub(super) const FEED: &str = "S-0-0123";

/// A turn, a metre and a second in generic units: nanoturns, nanounits of 1 mm / 10^9, nanoseconds.
pub(super) const TURN: f64 = 1e9;
pub(super) const METRE: f64 = 1e12;
pub(super) const INCH: f64 = 25.4e9;
const PER_MINUTE: f64 = TURN / 60.0;

/// Units by name, and what one is in generic units. Names that the profiles share mean the same in all of them.
pub(super) const UNITS: &[(&str, f64)] = &[
    ("ns", 1.0),
    ("Nanoseconds", 1.0),
    ("us", 1e3),
    ("ms", 1e6),
    ("Sec", 1e9),
    ("Hours", 3_600.0 * 1e9),
    ("Kilowatt-Hours", 3.6e6),
    ("A", 1e6),
    ("Amps", 1e6),
    ("Amps (RMS)", 1e6),
    ("mA", 1e3),
    ("V", 1e6),
    ("Volts", 1e6),
    ("Volts (RMS)", 1e6),
    ("mV", 1e3),
    ("kW", 1e6),
    ("Kilowatts", 1e6),
    ("%", 1e4),
    ("% Motor Rated", 1e4),
    ("% Motor Rated / Sec", 1e4),
    ("% Inverter Rated", 1e4),
    // 1000/min as a gain is 1000/60 1/s in 10^-6 1/s.
    ("1000/min", 1e9 / 60.0),
    ("Radians/Sec", 1e6),
    ("1/min", PER_MINUTE),
    ("rpm", PER_MINUTE),
    ("RPM", PER_MINUTE),
    ("m/s", METRE),
    ("mm/Rev", 1.0),
    ("um/Rev", 1e-3),
    ("inch/Rev", 25.4),
    ("Rev", 1.0),
    ("Input Shaft Revs", 1.0),
    ("Output Shaft Revs", 1.0),
    ("degC", 1e3),
    ("\u{b0}C", 1e3),
    ("mNm", 1e3),
    ("N*m", 1e6),
    ("N*m/Amp (RMS)", 1e6),
    ("N/Amp (RMS)", 1e6),
    ("Volts (RMS) / KRPM", 1e6),
    ("Volts (RMS) / (m/s)", 1e6),
    ("Meters", 1e9),
    ("ID#", 1.0),
    ("% Nominal Bus Voltage", 1e4),
    ("N", 1e6),
    ("Hertz", 1e3),
    ("Ohms", 1e6),
    ("Henries", 1e9),
    ("kg*m\u{b2}", 1e9),
    ("kg", 1e6),
];

/// What the units of the drives measure. A drive says by element 4 which one it uses: each may come, whether a shipped IDN has it or not.
pub(super) const SERCOS_UNITS: &[(&str, &str)] = &[
    ("ns", "time"),
    ("us", "time"),
    ("ms", "time"),
    ("A", "current"),
    ("V", "voltage"),
    ("kW", "power"),
    ("%", "fraction"),
    ("1000/min", "gain"),
    ("1/min", "velocity"),
    ("Rev", "none"),
    ("mm/Rev", "none"),
    ("um/Rev", "none"),
    ("inch/Rev", "none"),
    ("degC", "temperature"),
];
pub(super) const CIA402_UNITS: &[(&str, &str)] = &[
    ("ms", "time"),
    ("us", "time"),
    ("mA", "current"),
    ("mV", "voltage"),
    ("mNm", "torque_absolute"),
    ("rpm", "velocity"),
];

/// Displacement units of CIP by the end of their name, in nanounits.
pub(super) const DISPLACEMENTS: &[(&str, f64)] = &[
    ("Rev", TURN),
    ("Rev/s", TURN),
    ("mm", METRE / 1e3),
    ("inch", INCH),
    ("inch/s", INCH),
    ("m/s", METRE),
    ("Meter", METRE),
];

/// Units of CIP that follow the scaling of the axis (Table 5-2.8), or that of its encoders (Table 5-2.33).
pub(super) const SCALED_UNITS: &[(&str, &str)] = &[
    ("Position Control Units", "motion_count"),
    ("Velocity Control Units / Sec", "motion_unit"),
    ("Accel Control Units / Sec\u{b2}", "motion_unit"),
    ("Velocity Control Units / Sec\u{b2}", "motion_unit"),
    ("Feedback n Counts", "feedback_count"),
    ("Feedback n Units / Sec", "feedback_unit"),
    ("Feedback n Units / Sec\u{b2}", "feedback_unit"),
];

/// Ratios of the factor group of CiA 402: what a count is multiplied by, and what it is divided by.
pub(super) const FACTORS: &[(&str, &str)] = &[
    ("608F:02", "608F:01"),
    ("6091:02", "6091:01"),
    ("6092:02", "6092:01"),
    ("6096:02", "6096:01"),
    ("6097:02", "6097:01"),
    ("604C:01", "604C:02"),
];

/// Axis states of CIP Motion (Tables 5-2.97 and 5-2.98, 5-2.6.2): generic state, axis state, conditions.
pub(super) const AXIS_STATES: &[(&str, &str, &[&str])] = &[
    ("not_ready", "Initializing", &[]),
    ("inhibited", "Start Inhibited", &["initialized", "bus_up", "inhibited", "stop_complete"]),
    ("awaiting_power", "Pre-Charge", &["initialized", "stop_complete"]),
    ("ready", "Stopped", &["initialized", "bus_up", "stop_complete"]),
    ("starting", "Starting", &["initialized", "bus_up"]),
    ("operating", "Running", &["initialized", "bus_up", "start_complete"]),
    ("testing", "Testing", &["initialized", "bus_up", "start_complete", "test_active"]),
    ("stopping", "Stopping", &["initialized", "bus_up"]),
    ("fault_reaction", "Aborting", &["initialized", "bus_up", "faulted"]),
    ("faulted", "Major Faulted", &["initialized", "stop_complete", "faulted"]),
    ("shutdown", "Shutdown", &["initialized", "stop_complete", "shutdown"]),
];

/// Requests of CIP Motion (Tables 5-2.101 and 5-2.102): Axis Control, generic request, Axis Response.
pub(super) const REQUESTS: &[(&str, Option<&str>, &str)] = &[
    ("No Request", None, "No Acknowledge"),
    ("Enable Request", Some("enable"), "Enable Acknowledge"),
    ("Disable Request", Some("disable"), "Disable Acknowledge"),
    ("Shutdown Request", Some("shutdown"), "Shutdown Acknowledge"),
    ("Shutdown Reset Request", Some("shutdown_reset"), "Shutdown Reset Acknowledge"),
    ("Abort Request", Some("abort"), "Abort Acknowledge"),
    ("Fault Reset Request", Some("fault_reset"), "Fault Reset Acknowledge"),
    ("Stop Process Request", Some("test_stop"), "Stop Process Acknowledge"),
    ("Change Actual Position Reference Request", None, "Change Actual Position Reference Acknowledge"),
    ("Change Command Position Reference Request", None, "Change Command Position Reference Acknowledge"),
    ("Cancel Request", None, "Cancel Acknowledge"),
];

/// What the axis state machine of a CIP device asks of a drive (5-2.6).
pub(super) const DRIVE_ACTIONS: &[(&str, Option<&str>)] = &[
    ("none", None),
    ("power_up", Some("shutdown_reset")),
    ("enable", Some("enable")),
    ("test", Some("test")),
    ("disable", Some("disable")),
    ("shutdown", Some("shutdown")),
    ("abort", Some("abort")),
];

/// Control Mode of CIP Motion (Table 5-2.10).
pub(super) const CONTROL_MODES: &[(&str, &str)] = &[
    ("No Control", "none"),
    ("Position Control", "position"),
    ("Velocity Control", "velocity"),
    ("Acceleration Control", "acceleration"),
    ("Torque Control", "torque"),
];

/// Feedback Mode of CIP Motion (Table 5-2.34), and by which encoders an axis goes in it.
pub(super) const FEEDBACK_MODES: &[(&str, &str)] =
    &[("Motor Feedback", "motor"), ("Load Feedback", "load"), ("Dual Feedback", "dual")];

/// The attributes of the start and stop sequences (5-2.3.9.1, 5-2.3.4, 5-2.6.5.4), by the key that names each.
pub(super) const SEQUENCE: &[(&str, &str)] = &[
    ("stopping_action", "Stopping Action"),
    ("stopping_time_limit", "Stopping Time Limit"),
    ("coasting_time_limit", "Coasting Time Limit"),
    ("brake_release_delay", "Mechanical Brake Release Delay"),
    ("brake_engage_delay", "Mechanical Brake Engage Delay"),
    ("zero_speed", "Velocity Standstill Window"),
    ("zero_speed_time", "Zero Speed Time"),
    ("ramp_velocity_positive", "Ramp Velocity - Positive"),
    ("ramp_velocity_negative", "Ramp Velocity - Negative"),
    ("ramp_acceleration", "Ramp Acceleration"),
    ("ramp_deceleration", "Ramp Deceleration"),
    ("deceleration_limit", "Deceleration Limit"),
    ("flying_start", "Flying Start Enable"),
    ("overtravel_checking", "Hardware Overtravel Input Checking"),
];

/// Cyclic elements of CIP Motion (Tables 6-2.19 to 6-2.22).
pub(super) const CYCLIC: &[(&str, &str)] = &[
    ("Command Position", "position_command"),
    ("Command Velocity", "velocity_command"),
    ("Command Acceleration", "acceleration_command"),
    ("Command Torque", "torque_command"),
    ("Actual Position", "position_actual"),
    ("Actual Velocity", "velocity_actual"),
    ("Actual Acceleration", "acceleration_actual"),
];

/// Operation modes of CiA 402 (6060h) by the generic operating mode.
pub(super) const CIA402_MODES: &[(&str, bool, &[&str])] = &[
    ("position", false, &["csp", "ip"]),
    ("position", true, &["pp"]),
    ("velocity", false, &["csv", "pv", "vl"]),
    ("torque", false, &["cst", "tq"]),
];

/// Operation modes of SERCOS by the generic operating mode: how their names begin.
pub(super) const SERCOS_MODES: &[(&str, bool, &str)] = &[
    ("position", false, "Position control"),
    ("position", true, "Drive controlled"),
    ("velocity", false, "Velocity control"),
    ("torque", false, "Torque control"),
];

/// Set-points that the controller makes, and the value that shows where the axis is: a drive that lacks one cannot be used in the mode.
/// What is added inside the drive (offsets) and the deceleration of a profile, for which drives take the acceleration, may be missing.
pub(super) const REQUIRED: &[&str] = &[
    "position_command",
    "velocity_command",
    "torque_command",
    "target_position",
    "profile_velocity",
    "profile_acceleration",
    "position_actual",
];

/// What every SERCOS drive shows as well; the gateway takes it from the position of a CiA 402 drive without it.
pub(super) const REQUIRED_OF_SERCOS: &str = "velocity_actual";

/// The mode of a frequency converter, which may have no encoder: its velocity is what shows that it turns.
pub(super) const WITHOUT_ENCODER: (&str, &str) = ("vl", "velocity_actual");

/// Steps of commissioning after which the axis is another one when the drive refuses: the mode of operation, and what the
/// configuration limits.
pub(super) const MODE_STEPS: &[&str] = &["write_modes", "write_mode"];
pub(super) const LIMITS: &[&str] = &[
    "position_limit_positive",
    "position_limit_negative",
    "velocity_limit_positive",
    "velocity_limit_negative",
    "acceleration_limit",
    "deceleration_limit",
    "torque_limit_positive",
    "torque_limit_negative",
    "position_error_tolerance",
];

/// The one element of the Actual Data Set that is there with every drive (Table 6-2.21): of one that is gone, the last position.
pub(super) const ALWAYS_THERE: &str = "Actual Position";

/// How a Stopping Action of CIP Motion stops (Table 5-2.54): the method, whether the axis is held then, and the strongest
/// stop that an Abort request may make of it.
pub(super) const STOPPINGS: &[(&str, &str, bool, &str)] = &[
    ("Disable & Coast", "coast", false, "coast_and_disable"),
    ("Current Decel & Disable", "decelerate", false, "decelerate_and_disable"),
    ("Ramped Decel & Disable", "ramp", false, "decelerate_and_disable"),
    ("Current Decel & Hold", "decelerate", true, "hold_position"),
    ("Ramped Decel & Hold", "ramp", true, "hold_position"),
];

/// The fault of CIP Motion that stands for a cause, by the texts of Tables 5-2.65 (exceptions), 5-2.6 (node faults), 5-2.72
/// (initialization faults) and 5-2.76 (APR faults): the key of the row, and the name. Other causes have no name in the standard.
pub(super) const CIP_FAULTS: &[(&str, &str, &str)] = &[
    ("motor_over_current", "exception", "Motor Overcurrent"),
    ("motor_short_circuit", "exception", "Motor Overcurrent"),
    ("commutation", "exception", "Motor Commutation"),
    ("motor_over_speed", "exception", "Motor Overspeed FL"),
    ("motor_over_speed_user_limit", "exception", "Motor Overspeed UL"),
    ("motor_over_temperature", "exception", "Motor Overtemperature FL"),
    ("motor_over_temperature_user_limit", "exception", "Motor Overtemperature UL"),
    ("motor_overload", "exception", "Motor Thermal Overload FL"),
    ("motor_overload_user_limit", "exception", "Motor Thermal Overload UL"),
    ("motor_phase_loss", "exception", "Motor Phase Loss"),
    ("over_torque", "exception", "Overtorque Limit"),
    ("under_torque", "exception", "Undertorque Limit"),
    ("over_current", "exception", "Inverter Overcurrent"),
    ("drive_over_temperature", "exception", "Inverter Overtemperature FL"),
    ("drive_over_temperature_user_limit", "exception", "Inverter Overtemperature UL"),
    ("drive_overload", "exception", "Inverter Thermal Overload FL"),
    ("drive_overload_user_limit", "exception", "Inverter Thermal Overload UL"),
    ("ground_current", "exception", "Converter Ground Current FL"),
    ("over_voltage", "exception", "Bus Overvoltage FL"),
    ("over_voltage_user_limit", "exception", "Bus Overvoltage UL"),
    ("under_voltage", "exception", "Bus Undervoltage FL"),
    ("under_voltage_user_limit", "exception", "Bus Undervoltage UL"),
    ("power_loss", "exception", "Bus Power Loss"),
    ("mains_loss", "exception", "Converter AC Power Loss"),
    ("mains_phase_loss", "exception", "Converter AC Single Phase Loss"),
    ("mains_short_circuit", "exception", "Converter AC Phase Short"),
    ("pre_charge", "exception", "Converter Pre-Charge Failure"),
    ("bus_regulator", "exception", "Bus Regulator Failure"),
    ("bus_regulator_overload", "exception", "Bus Regulator Thermal Overload FL"),
    ("bus_fuse", "exception", "Bus Power Blown Fuse"),
    ("bus_sharing", "exception", "Bus Power Sharing"),
    ("bus_leakage", "exception", "Bus Power Leakage"),
    ("converter_over_current", "exception", "Converter Overcurrent"),
    ("converter_over_temperature", "exception", "Converter Overtemperature FL"),
    ("converter_overload", "exception", "Converter Thermal Overload FL"),
    ("feedback_loss", "exception", "Feedback Signal Loss FL"),
    ("feedback_noise", "exception", "Feedback Signal Noise FL"),
    ("feedback_data_loss", "exception", "Feedback Data Loss FL"),
    ("feedback_device", "exception", "Feedback Device Failure"),
    ("excessive_position_error", "exception", "Excessive Position Error"),
    ("excessive_velocity_error", "exception", "Excessive Velocity Error"),
    ("hardware_overtravel_positive", "exception", "Hardware Overtravel Positive"),
    ("hardware_overtravel_negative", "exception", "Hardware Overtravel Negative"),
    ("software_overtravel_positive", "exception", "Position Overtravel Positive"),
    ("software_overtravel_negative", "exception", "Position Overtravel Negative"),
    ("brake_slip", "exception", "Brake Slip"),
    ("enable_input_lost", "exception", "Enable Input Deactivated"),
    ("external_input", "exception", "External Exception Input"),
    ("controller_abort", "exception", "Controller Initiated Exception"),
    ("illegal_mode", "exception", "Illegal Control Mode"),
    ("command_lost", "node_fault", "Control Connection Update Fault"),
    ("synchronization_loss", "node_fault", "Clock Sync Fault"),
    ("time_stamp", "node_fault", "Clock Skew Fault"),
    ("data_format", "node_fault", "Data Format Error"),
    ("connection_closed", "node_fault", "Control Connection Loss Fault"),
    ("duplicate_address", "node_fault", "Duplicate Address"),
    ("processor_watchdog", "node_fault", "Processor Watchdog Fault"),
    ("node_hardware", "node_fault", "Hardware Fault"),
    ("memory", "initialization", "Nonvolatile Memory Checksum Fault"),
    ("self_test", "initialization", "Main Block Checksum Fault"),
    ("absolute_position_lost", "apr", "Feedback Integrity Loss"),
];

/// Bits of S-0-0011 and S-0-0012, and what they say is wrong.
pub(super) const SERCOS_FAULTS: &[(&str, &str)] = &[
    ("Overload shut-down", "motor_overload"),
    ("Amplifier overtemperature shut-down", "drive_over_temperature"),
    ("Motor overtemperature shut-down", "motor_over_temperature"),
    ("Cooling error shut-down", "cooling"),
    ("Control voltage error", "control_voltage"),
    ("Feedback error", "feedback_loss"),
    ("Commutation error", "commutation"),
    ("Overcurrent error", "over_current"),
    ("Overvoltage error", "over_voltage"),
    ("Undervoltage error", "under_voltage"),
    ("Power supply phase error", "mains_phase_loss"),
    ("Excessive position deviation", "excessive_position_error"),
    ("Communication error", "communication_loss"),
    ("Overtravel limit exceeded", "software_overtravel_positive"),
    ("Manufacturer specific error", "drive_specific"),
    ("Overload warning", "motor_overload_user_limit"),
    ("Amplifier overtemperature warning", "drive_over_temperature_user_limit"),
    ("Motor overtemperature warning", "motor_over_temperature_user_limit"),
    ("Cooling error warning", "cooling_warning"),
    ("Positioning velocity above limit", "velocity_command_warning"),
    ("Undervoltage warning", "under_voltage_user_limit"),
    ("Target position outside of travel range", "position_command_warning"),
    ("Manufacturer specific warning", "drive_warning"),
];

/// Classes of the error codes of 603Fh, and what is wrong by them where the code says no more.
pub(super) const CLASSES: &[(&str, &str)] = &[
    ("Current", "over_current"),
    ("Current, input side", "over_current"),
    ("Current, inside the device", "over_current"),
    ("Current, output side", "over_current"),
    ("Mains voltage", "mains_loss"),
    ("DC link voltage", "over_voltage"),
    ("Temperature", "drive_over_temperature"),
    ("Ambient temperature", "drive_over_temperature"),
    ("Device temperature", "drive_over_temperature"),
    ("Drive temperature", "drive_over_temperature"),
    ("Device hardware", "internal"),
    ("Device software", "internal"),
    ("Internal software", "internal"),
    ("User software", "internal"),
    ("Data set", "parameter"),
    ("Communication", "communication_loss"),
    ("Protocol", "communication_loss"),
    ("Velocity control", "excessive_velocity_error"),
    ("Position control", "excessive_position_error"),
    ("Positioning", "excessive_position_error"),
    ("Supply temperature", "drive_over_temperature"),
    ("Additional modules", "drive_specific"),
    ("Monitoring", "drive_specific"),
    ("Additional functions", "drive_specific"),
    ("External error", "external_input"),
    ("Output voltage", "drive_specific"),
    ("Voltage", "drive_specific"),
    ("Torque control", "drive_specific"),
    ("Generic error", "drive_specific"),
    ("Device specific", "drive_specific"),
];

/// Error codes of 603Fh whose names say more than their class and their exception. A current that is too high at the output is a short
/// circuit or lasts too long; CIP Motion has one exception for both. That every memory is one cause is the product's own: CIP Motion has
/// one fault of a memory (Table 5-2.72).
pub(super) const CODES: &[(&str, &str)] = &[
    ("Short circuit or earth leakage, motor side", "motor_short_circuit"),
    ("Short circuit, motor side", "motor_short_circuit"),
    ("Short circuit phases U-V", "motor_short_circuit"),
    ("Short circuit phases V-W", "motor_short_circuit"),
    ("Short circuit phases W-U", "motor_short_circuit"),
    ("Continuous over-current", "motor_over_current"),
    ("Continuous over-current 1", "motor_over_current"),
    ("Continuous over-current 2", "motor_over_current"),
    ("Hardware data storage", "memory"),
    ("Working memory (RAM)", "memory"),
    ("Program memory (EPROM)", "memory"),
    ("Non-volatile data memory (EEPROM)", "memory"),
    ("Data storage of additional modules", "memory"),
];

/// Axis Status bits of CIP Motion (Tables 5-2.60 and 5-2.61): the bit, and the generic bits and the mode that it shows, each
/// line one way to come to it.
pub(super) const AXIS_STATUS: &[(&str, &str, Option<&str>)] = &[
    ("Alarm", "warning", None),
    ("DC Bus Up", "power", None),
    ("Power Structure Enabled", "enabled", None),
    ("Tracking Command", "tracking", None),
    ("Position Lock", "in_position", None),
    ("Velocity Lock", "at_velocity", None),
    ("Velocity Standstill", "standstill", None),
    ("Velocity Limit", "velocity_limit", None),
    ("Acceleration Limit", "acceleration_limit", None),
    ("Torque Limit", "torque_limit", None),
    ("Current Limit", "current_limit", None),
    ("Shutdown", "shutdown", None),
    ("Position Control Mode", "enabled", Some("position")),
    ("Velocity Control Mode", "enabled", Some("velocity")),
    ("Torque Control Mode", "enabled", Some("torque")),
];

/// What brings an event.
pub(super) enum Trigger {
    Capture(&'static str, &'static str),
    Signal(&'static str),
}

use Trigger::{Capture, Signal};

/// Events of CIP Motion (Table 6-2.47) with their bits of Event Checking Control (Table 5-2.36), and what brings them. The first sign
/// of a home switch and marker is the edge of the switch, the second that of the marker.
pub(super) const EVENTS: &[(&str, &str, Trigger)] = &[
    ("Registration 1 Positive Edge", "Reg 1 Pos Edge", Capture("registration_1", "positive")),
    ("Registration 1 Negative Edge", "Reg 1 Neg Edge", Capture("registration_1", "negative")),
    ("Registration 2 Positive Edge", "Reg 2 Pos Edge", Capture("registration_2", "positive")),
    ("Registration 2 Negative Edge", "Reg 2 Neg Edge", Capture("registration_2", "negative")),
    ("Marker Positive Edge", "Marker Pos Edge", Capture("marker", "positive")),
    ("Marker Negative Edge", "Marker Neg Edge", Capture("marker", "negative")),
    ("Home Switch Positive Edge", "Home Switch Pos Edge", Capture("home_switch", "positive")),
    ("Home Switch Negative Edge", "Home Switch Neg Edge", Capture("home_switch", "negative")),
    ("Home Switch-Marker ++", "Home Switch-Marker ++", Capture("home_switch_marker_positive", "positive")),
    ("Home Switch-Marker +-", "Home Switch-Marker +-", Capture("home_switch_marker_negative", "positive")),
    ("Home Switch-Marker -+", "Home Switch-Marker -+", Capture("home_switch_marker_positive", "negative")),
    ("Home Switch-Marker --", "Home Switch-Marker --", Capture("home_switch_marker_negative", "negative")),
    ("Home Torque Threshold", "Home Torque Threshold", Signal("torque_actual")),
    ("Watch 1 Position Forward", "Watch Position 1 Fwd", Signal("position_actual")),
    ("Watch 1 Position Reverse", "Watch Position 1 Rev", Signal("position_actual")),
    ("Watch 2 Position Forward", "Watch Position 2 Fwd", Signal("position_actual")),
    ("Watch 2 Position Reverse", "Watch Position 2 Rev", Signal("position_actual")),
];

/// Attributes of CIP Motion whose names say which generic value they are (Tables 5-2.38 to 5-2.57 and 5-2.20 to 5-2.25).
pub(super) const ATTRIBUTES: &[(&str, &str)] = &[
    ("Fine Command Position", "position_command"),
    ("Fine Command Velocity", "velocity_command"),
    ("Fine Command Acceleration", "acceleration_command"),
    ("Position Command", "position_command"),
    ("Position Trim", "position_offset"),
    ("Position Reference", "position_command"),
    ("Position Feedback", "position_actual"),
    ("Position Error", "following_error"),
    ("Velocity Command", "velocity_command"),
    ("Velocity Trim", "velocity_offset"),
    ("Velocity Feedback", "velocity_actual"),
    ("Acceleration Command", "acceleration_command"),
    ("Acceleration Feedback", "acceleration_actual"),
    ("Torque Command", "torque_command"),
    ("Torque Trim", "torque_offset"),
    ("Torque Reference", "torque_reference"),
    // Without the filters of attributes 502 and 503.
    ("Torque Reference - Filtered", "torque_reference"),
    ("Torque Reference - Limited", "torque_reference_limited"),
    ("Iq Current Command", "torque_reference_limited"),
    ("Iq Current Feedback", "torque_current"),
    ("Velocity Feedforward Command", "velocity_feed_forward"),
    ("Position Integrator Output", "position_integrator_output"),
    ("Position Loop Output", "position_loop_output"),
    ("Acceleration Feedforward Command", "acceleration_feed_forward"),
    ("Velocity Reference", "velocity_reference"),
    ("Velocity Integrator Output", "velocity_integrator_output"),
    ("Velocity Loop Output", "velocity_loop_output"),
    ("Velocity Error", "velocity_error"),
    ("Kvi", "velocity_integral_time"),
    ("Kj", "system_inertia"),
    ("Ramp Velocity - Positive", "ramp_velocity_positive"),
    ("Ramp Velocity - Negative", "ramp_velocity_negative"),
    ("Ramp Acceleration", "ramp_acceleration"),
    ("Ramp Deceleration", "ramp_deceleration"),
    ("Inverter Rated Output Current", "drive_rated_current"),
    ("Transmission Ratio Input", "gear_ratio_numerator"),
    ("Transmission Ratio Output", "gear_ratio_denominator"),
    ("Feedback 1 Velocity Filter Bandwidth", "feedback_velocity_filter"),
    ("Feedback 1 Accel Filter Bandwidth", "feedback_acceleration_filter"),
    ("Feedback 1 Position", "motor_position"),
    ("Feedback 1 Velocity", "motor_speed"),
    ("Feedback 1 Acceleration", "motor_acceleration"),
    ("Feedback 2 Position", "load_position_actual"),
    ("Feedback 2 Velocity", "load_velocity_actual"),
    ("Output Current", "current_actual"),
    ("Output Voltage", "output_voltage"),
    ("Output Frequency", "output_frequency"),
    ("Output Power", "output_power"),
    ("DC Bus Voltage", "bus_voltage"),
    ("DC Bus Voltage - Nominal", "bus_nominal_voltage"),
    ("Digital Inputs", "digital_inputs"),
    ("Motor Temperature", "temperature"),
    ("Inverter Temperature", "drive_temperature"),
    ("Motor Capacity", "motor_capacity"),
    ("Inverter Capacity", "drive_capacity"),
    ("Kvff", "velocity_feed_forward_gain"),
    ("Kpp", "position_loop_gain"),
    ("Kpi", "position_integral_gain"),
    ("Kaff", "acceleration_feed_forward_gain"),
    ("Kvp", "velocity_loop_gain"),
    ("Position Lock Tolerance", "in_position_window"),
    ("Position Error Tolerance", "position_error_tolerance"),
    ("Position Error Tolerance Time", "position_error_tolerance_time"),
    ("Position Limit - Positive", "position_limit_positive"),
    ("Position Limit - Negative", "position_limit_negative"),
    ("Velocity Error Tolerance", "velocity_error_tolerance"),
    ("Velocity Error Tolerance Time", "velocity_error_tolerance_time"),
    ("Velocity Lock Tolerance", "at_velocity_window"),
    ("Velocity Standstill Window", "standstill_window"),
    ("Velocity Limit - Positive", "velocity_limit_positive"),
    ("Velocity Limit - Negative", "velocity_limit_negative"),
    ("Acceleration Limit", "acceleration_limit"),
    ("Deceleration Limit", "deceleration_limit"),
    ("Torque Limit - Positive", "torque_limit_positive"),
    ("Torque Limit - Negative", "torque_limit_negative"),
    ("Torque Rate Limit", "torque_rate_limit"),
    ("Overtorque Limit", "over_torque_limit"),
    ("Overtorque Limit Time", "over_torque_limit_time"),
    ("Stopping Torque", "stopping_torque"),
    ("Stopping Time Limit", "stopping_time_limit"),
    ("Coasting Time Limit", "coasting_time_limit"),
    ("Zero Speed Time", "zero_speed_time"),
    ("Mechanical Brake Release Delay", "brake_release_time"),
    ("Mechanical Brake Engage Delay", "brake_engage_time"),
    ("Motor Rated Voltage", "motor_rated_voltage"),
    ("Motor Rated Continuous Current", "motor_rated_current"),
    ("Motor Rated Peak Current", "motor_peak_current"),
    ("Motor Rated Output Power", "motor_rated_power"),
    ("Motor Overload Limit", "motor_overload_limit"),
    ("Motor Max Winding Temperature", "motor_max_temperature"),
    ("PM Motor Resistance", "motor_resistance"),
    ("PM Motor Inductance", "motor_inductance"),
    ("PM Motor Rated Torque", "motor_rated_torque"),
    ("Rotary Motor Poles", "motor_pole_count"),
    ("Rotary Motor Inertia", "motor_inertia"),
    ("Rotary Motor Rated Speed", "motor_rated_velocity"),
    ("Rotary Motor Max Speed", "motor_max_velocity"),
    ("Velocity Threshold", "velocity_threshold"),
    ("Operative Current Limit", "operative_current_limit"),
    ("Current Vector Limit", "current_limit"),
    ("Torque Threshold", "torque_threshold"),
    ("Undertorque Limit", "under_torque_limit"),
    ("Undertorque Limit Time", "under_torque_limit_time"),
    ("Converter Output Current", "converter_current"),
    ("Converter Output Power", "converter_power"),
    ("Zero Speed", "zero_speed"),
    ("Bus Configuration", "bus_configuration"),
    ("Bus Voltage Select", "mains_class"),
    ("Inverter Heatsink Temperature", "drive_temperature"),
    ("Rotary Motor Overspeed Factory Limit", "motor_max_velocity"),
    ("Linear Motor Overspeed Factory Limit", "motor_linear_max_velocity"),
    ("Motor Overtemperature Factory Limit", "motor_temperature_limit"),
    ("Inverter Overtemperature Factory Limit", "drive_temperature_limit"),
    ("Motor Overspeed User Limit", "over_speed_user_limit"),
    ("Motor Overtemperature User Limit", "motor_temperature_user_limit"),
    ("Inverter Overtemperature User Limit", "drive_temperature_user_limit"),
    ("Bus Overvoltage User Limit", "bus_overvoltage_user_limit"),
    ("Bus Undervoltage User Limit", "bus_undervoltage_user_limit"),
    ("Control Power-up Time", "up_time"),
    ("Cumulative Run Time", "run_time"),
    ("Cumulative Energy Usage", "output_energy"),
    ("Cumulative Motor Revs", "motor_turns"),
    ("Inverter Rated Output Voltage", "drive_rated_voltage"),
    ("Inverter Rated Output Power", "drive_rated_power"),
    ("Drive Power Structure Axis ID", "power_structure_axis_id"),
    ("Feedback Master Select", "feedback_master"),
    ("Drive Enable Input Checking", "enable_input_checking"),
    ("Motor Type", "motor_type"),
    ("Motor Unit", "motor_unit"),
    ("Linear Motor Pole Pitch", "motor_pole_pitch"),
    ("Linear Motor Rated Speed", "motor_linear_rated_velocity"),
    ("Linear Motor Mass", "motor_mass"),
    ("Linear Motor Max Speed", "motor_linear_max_velocity"),
    ("PM Motor Torque Constant", "motor_torque_constant"),
    ("PM Motor Rotary Voltage Constant", "motor_voltage_constant"),
    ("PM Motor Rated Force", "motor_rated_force"),
    ("PM Motor Force Constant", "motor_force_constant"),
    ("PM Motor Linear Voltage Constant", "motor_linear_voltage_constant"),
    ("Induction Motor Rated Frequency", "motor_rated_frequency"),
    ("Induction Motor Flux Current", "motor_flux_current"),
    ("Induction Motor Stator Resistance", "motor_stator_resistance"),
    ("PM Motor Lq Inductance", "motor_q_inductance"),
    ("PM Motor Ld Inductance", "motor_d_inductance"),
    ("Feedback 1 Type", "encoder_type"),
    ("Feedback 1 Startup Method", "encoder_startup"),
    ("Feedback 1 Turns", "encoder_turns"),
    ("Feedback 1 Length", "encoder_length"),
    ("Feedback 2 Unit", "load_feedback_unit"),
    ("Feedback 2 Cycle Resolution", "load_feedback_resolution"),
    ("Feedback 2 Cycle Interpolation", "load_feedback_interpolation"),
];

/// Bits of S-0-0013 in the telegram, and what they show.
pub(super) const SERCOS_STATUS: &[(&str, &str, &str)] = &[
    ("Class 3 diagnostic", "Velocity feedback equals command", "at_velocity"),
    ("Class 3 diagnostic", "Velocity feedback is zero", "standstill"),
    ("Class 3 diagnostic", "Torque at limit", "torque_limit"),
    ("Class 3 diagnostic", "Velocity command above limit", "velocity_limit"),
    ("Class 3 diagnostic", "In position", "in_position"),
    ("Class 3 diagnostic", "Target position attained", "target_reached"),
    ("Home switch", "Home switch active", "home_switch"),
];

/// Where drives have the edges of probes and switches: capture and edge, the field and its value that show the edge, and the
/// value of the position; by IDN, and by object.
pub(super) struct CaptureFact {
    pub capture: &'static str,
    pub edge: &'static str,
    pub field: &'static str,
    pub is: u32,
    pub value: Option<&'static str>,
}

const fn edge(
    capture: &'static str,
    edge: &'static str,
    field: &'static str,
    is: u32,
    value: Option<&'static str>,
) -> CaptureFact {
    CaptureFact { capture, edge, field, is, value }
}

pub(super) const SERCOS_CAPTURES: &[CaptureFact] = &[
    edge("registration_1", "positive", "Probe 1 positive latched", 1, Some("S-0-0130")),
    edge("registration_1", "negative", "Probe 1 negative latched", 1, Some("S-0-0131")),
    edge("registration_2", "positive", "Probe 2 positive latched", 1, Some("S-0-0132")),
    edge("registration_2", "negative", "Probe 2 negative latched", 1, Some("S-0-0133")),
    edge("home_switch", "positive", "Home switch active", 1, None),
    edge("home_switch", "negative", "Home switch active", 0, None),
];

pub(super) const CIA402_CAPTURES: &[CaptureFact] = &[
    edge("registration_1", "positive", "Positive edge stored 1", 1, Some("60BA:00")),
    edge("registration_1", "negative", "Negative edge stored 1", 1, Some("60BB:00")),
    edge("registration_2", "positive", "Positive edge stored 2", 1, Some("60BC:00")),
    edge("registration_2", "negative", "Negative edge stored 2", 1, Some("60BD:00")),
    edge("home_switch", "positive", "Home switch", 1, None),
    edge("home_switch", "negative", "Home switch", 0, None),
];

/// The procedures of homing: who makes the way, and the commands of the drive.
pub(super) const PROCEDURES: &[(&str, &str, &[&str])] =
    &[("homing", "drive", &["S-0-0148"]), ("homing", "controller", &["S-0-0146", "S-0-0171", "S-0-0172"])];

/// The IDN of the operation mode that bits 10 to 8 of control and status word choose.
pub(super) const MODE_SLOTS: &[&str] =
    &["S-0-0032", "S-0-0033", "S-0-0034", "S-0-0035", "S-0-0284", "S-0-0285", "S-0-0286", "S-0-0287"];

/// What commissioning writes into a drive as a number: scaling types, preferential factors, both edges of the probes; the drive's
/// reactions to the loss of torque, halt, quick stop and the master.
pub(super) const WRITES: &[(&str, &[i64])] = &[
    ("S-0-0076", &[0x42, 0xC2, 0x41]),
    ("S-0-0079", &[3_600_000]),
    ("S-0-0103", &[1_843_200_000]),
    ("S-0-0044", &[0x42, 0x41]),
    ("S-0-0160", &[0x42, 0x41]),
    ("S-0-0086", &[0]),
    ("S-0-0169", &[0x3, 0xF]),
    ("60C0:00", &[0]),
    ("605C:00", &[1]),
    ("605D:00", &[1]),
    ("605A:00", &[2]),
    ("6007:00", &[3]),
];

/// Which axes a step of commissioning is for, and its phase. What the gateway scales it writes in CP2, which all drives accept; what it
/// scales depends on the axis: turns or a way, and whether positions wrap. Probes are set up for an axis that captures events. Parameters
/// are written in CP3, when their units were read.
pub(super) const SERCOS_STEPS_OF: &[Step] = &[
    ("command", Some("S-0-0099"), None, 2, When::ALWAYS),
    ("write", Some("S-0-0076"), Some(0x42), 2, When::TURNS_NOT),
    ("write", Some("S-0-0076"), Some(0xC2), 2, When::TURNS),
    ("write", Some("S-0-0076"), Some(0x41), 2, When::LINEAR),
    ("write", Some("S-0-0079"), Some(3_600_000), 2, When::ROTARY),
    ("write", Some("S-0-0103"), Some(1_843_200_000), 2, When::TURNS),
    ("write", Some("S-0-0044"), Some(0x42), 2, When::ROTARY),
    ("write", Some("S-0-0044"), Some(0x41), 2, When::LINEAR),
    ("write", Some("S-0-0160"), Some(0x42), 2, When::ROTARY),
    ("write", Some("S-0-0160"), Some(0x41), 2, When::LINEAR),
    ("write", Some("S-0-0086"), Some(0), 2, When::SCALED),
    ("write_modes", None, None, 2, When::ALWAYS),
    ("read_scaling", None, None, 2, When::ALWAYS),
    ("read", Some("S-0-0187"), None, 2, When::ALWAYS),
    ("read", Some("S-0-0188"), None, 2, When::ALWAYS),
    ("read_telegram", None, None, 2, When::ALWAYS),
    ("read_parameters", None, None, 2, When::ALWAYS),
    ("read_procedures", None, None, 2, When::ALWAYS),
    ("read_captures", None, None, 2, When::CAPTURES),
    ("write", Some("S-0-0169"), Some(0x3), 3, When::CAPTURES),
    ("write", Some("S-0-0169"), Some(0xF), 3, When::CAPTURES),
    ("write", None, None, 3, When::ALWAYS),
    ("read", Some("S-0-0011"), None, 3, When::ALWAYS),
];

/// The modes of operation of which a drive must be led in one to be written this: how it interpolates matters in ip alone.
pub(super) const CIA402_STEPS_OF: &[(&str, &[&str])] =
    &[("60C0:00", &["ip"]), ("605C:00", &[]), ("605D:00", &[]), ("605A:00", &[]), ("6007:00", &[])];

/// Errors of S-0-0390, by fields of the number: the communication profile (source type 3) with a standard code (interpretation 3), and
/// any other of class F, which is a class 1 diagnostic.
pub(super) const SERCOS_NUMBERS: &[(&[(&str, u32)], &str)] = &[
    (&[("Class", 0xF), ("Interpretation", 3), ("Source type", 3)], "communication_loss"),
    (&[("Class", 0xF)], "drive_specific"),
];

/// Cyclic elements that are positions: they go round at the end of a DINT (Tables 6-2.19 and 6-2.21), and at the unwind position
/// (Table 5-2.12).
pub(super) const WRAPPING: &[&str] = &["Command Position", "Actual Position"];

/// Steps of commissioning without which an axis does not know its drive.
pub(super) const SERCOS_STEPS: &[&str] = &[
    "command",
    "write_modes",
    "read_scaling",
    "read_telegram",
    "read_parameters",
    "read_procedures",
    "read_captures",
];
pub(super) const CIA402_STEPS: &[&str] =
    &["read_scaling", "write_cycle", "read_parameters", "read_captures", "write_mode"];

/// What the configuration of an axis says of its drive, and commissioning writes.
pub(super) const SERCOS_WRITTEN: &[&str] = &[
    "in_position_window",
    "position_error_tolerance",
    "acceleration_limit",
    "deceleration_limit",
    "torque_limit_positive",
    "torque_limit_negative",
];
pub(super) const CIA402_WRITTEN: &[&str] = &[
    "in_position_window",
    "position_error_tolerance",
    "velocity_limit_positive",
    "torque_limit_positive",
    "torque_limit_negative",
];

/// Bits of 6040h that a mode of operation needs while it follows: the mode, the bits that count, their values, and why.
pub(super) const CIA402_CONTROL: &[(&str, u32, u32, &str)] = &[
    (
        "pp",
        0x260,
        0x020,
        "bit 5 (change set immediately) is 1, and bits 6 (relative) and 9 (change on set-point) are 0",
    ),
    ("ip", 0x010, 0x010, "bit 4 (enable interpolation) is 1"),
    ("vl", 0x070, 0x070, "bits 4, 5 and 6 (enable, unlock and reference of the ramp) are 1"),
];

/// Bits of Axis Exceptions - Mfg and Start Inhibits - Mfg, and the codes of Event Status: the assignment of the product, on which
/// programs of controllers and the texts of the documentation rely.
pub(super) const OWN_FAULTS: &[(&str, u32)] = &[
    ("drive_specific", 1),
    ("motor_stalled", 2),
    ("control_voltage", 3),
    ("cooling", 4),
    ("feedback_mismatch", 5),
    ("position_command_limit", 6),
    ("velocity_command_limit", 7),
    ("acceleration_command_limit", 8),
    ("homing", 9),
    ("standstill_movement", 10),
    ("brake", 11),
    ("start_time_out", 12),
    ("stop_time_out", 13),
    ("unexpected_torque", 14),
    ("left_operation", 15),
    ("communication_loss", 16),
    ("south_silence", 17),
    ("bus_phase", 18),
    ("configuration", 19),
    ("parameter", 20),
    ("wrong_device", 21),
    ("internal", 22),
    ("conversion_saturated", 23),
    ("safe_torque_off", 24),
    ("safe_stop", 25),
    ("safe_motion_limit", 26),
    ("safe_feedback", 27),
    ("safety_core", 28),
    ("drive_warning", 29),
    ("cooling_warning", 30),
    ("position_command_warning", 31),
    ("velocity_command_warning", 32),
];
pub(super) const OWN_INHIBITS: &[(&str, u32)] = &[
    ("no_power", 1),
    ("configuration_incomplete", 2),
    ("not_homed", 3),
    ("no_controller", 4),
    ("no_drive", 5),
    ("not_synchronized", 6),
    ("no_operating_mode", 7),
    ("local_control", 8),
    ("transfer_active", 9),
    ("brake", 10),
    ("restart_delay", 11),
    ("drive_specific", 12),
    ("limit_switches_not_told", 13),
];
pub(super) const OWN_EVENT_STATUS: &[(&str, u8)] =
    &[("captured", 0), ("not_supported", 1), ("busy", 2), ("failed", 3), ("ambiguous", 4)];

/// Start Inhibits of the standard (Table 5-2.74).
pub(super) const INHIBITS: &[(&str, &str)] = &[
    ("safety", "Safe Torque Off Active"),
    ("hardware_enable", "Axis Enable Input"),
    ("motor_not_configured", "Motor Not Configured"),
    ("feedback_not_configured", "Feedback Not Configured"),
    ("commutation_not_configured", "Commutation Not Configured"),
];

/// Motor data that a SERCOS drive keeps as it was set up; a CiA 402 drive takes the same limit at any time.
pub(super) const OF_THE_SERCOS_DRIVE: &[&str] = &["S-0-0113"];

/// Parameters that are the drive's: what it shows, and how motor and mechanics were set up in it.
pub(super) const OF_THE_DRIVE: &[&str] = &[
    "motor_rated_current",
    "motor_peak_current",
    "motor_rated_torque",
    "gear_ratio_numerator",
    "gear_ratio_denominator",
    "following_error",
    "torque_actual",
    "load_position_actual",
    "velocity_error",
    "bus_voltage",
    "motor_temperature",
    "drive_temperature",
    "homed",
];

/// By what a SERCOS drive lets an edge through: the enable of each probe, and the procedure of both.
pub(super) const SERCOS_PROBES: &[(&str, &str)] =
    &[("registration_1", "S-0-0405"), ("registration_2", "S-0-0406")];
pub(super) const SERCOS_PROBING: &str = "S-0-0170";

/// By what a CiA 402 drive does: fields of 60B8h and their values, `{n}` the probe and `{edge}` the edge.
pub(super) const CIA402_PROBING: &str = "60B8:00";
pub(super) const CIA402_PROBES: &[(&str, u32)] =
    &[("Enable touch probe {n}", 1), ("Continuous {n}", 0), ("Index pulse {n}", 0)];
pub(super) const CIA402_SAMPLES: &str = "Sample at {edge} edge {n}";

/// Axis I/O Status bits (Table 5-2.63): what sets them, what keeps them from being set, and the bit of an axis that counts the other way.
pub(super) const IO_STATUS: &[(&str, &str, Option<&str>, Option<&str>)] = &[
    ("Home Input", "home_switch", None, None),
    (
        "Positive Overtravel OK Input",
        "limit_switches",
        Some("positive_limit_switch"),
        Some("Negative Overtravel OK Input"),
    ),
    (
        "Negative Overtravel OK Input",
        "limit_switches",
        Some("negative_limit_switch"),
        Some("Positive Overtravel OK Input"),
    ),
];

/// Axis Fault Action (attribute 668) of each reaction: how the axis stops, and the state that it comes to.
pub(super) const REACTIONS: &[(&str, &str, &str)] = &[
    ("ignore", "No Action", "No Action"),
    ("alarm", "No Action", "No Action"),
    ("hold_position", "Current Limited Stop", "Hold"),
    ("decelerate_and_disable", "Current Limited Stop", "Disable"),
    ("coast_and_disable", "Coast", "Disable"),
    ("shutdown", "Coast", "Shutdown"),
];

/// Causes that the gateway or the device in it finds; all others only a drive does.
pub(super) const FOUND_BY_BOX: &[&str] = &[
    "commutation",
    "motor_over_speed_user_limit",
    "power_loss",
    "feedback_data_loss",
    "excessive_position_error",
    "excessive_velocity_error",
    "over_torque",
    "under_torque",
    "motor_over_temperature_user_limit",
    "drive_over_temperature_user_limit",
    "over_voltage_user_limit",
    "under_voltage_user_limit",
    "hardware_overtravel_positive",
    "hardware_overtravel_negative",
    "software_overtravel_positive",
    "software_overtravel_negative",
    "enable_input_lost",
    "position_command_limit",
    "velocity_command_limit",
    "homing",
    "start_time_out",
    "stop_time_out",
    "unexpected_torque",
    "left_operation",
    "south_silence",
    "configuration",
    "safe_torque_off",
];
pub(super) const FOUND_BY_DEVICE: &[&str] = &["external_input", "controller_abort", "illegal_mode"];

/// Exceptions that a controller may set to Ignore: limits of the user, what the gateway watches, and warnings. An exception for which the
/// drive has switched itself off is a major fault whatever is set (5-2.3.16.1).
pub(super) const IGNORABLE: &[&str] = &[
    "motor_over_speed_user_limit",
    "motor_over_temperature_user_limit",
    "motor_overload_user_limit",
    "drive_over_temperature_user_limit",
    "over_voltage_user_limit",
    "under_voltage_user_limit",
    "excessive_position_error",
    "excessive_velocity_error",
    "over_torque",
    "under_torque",
    "hardware_overtravel_positive",
    "hardware_overtravel_negative",
    "software_overtravel_positive",
    "software_overtravel_negative",
    "controller_abort",
    "illegal_mode",
    "drive_warning",
    "cooling_warning",
    "position_command_warning",
    "velocity_command_warning",
];

/// Operation modes of SERCOS that a generic mode selects, the preferred one first: without following distance, if the drive can.
pub(super) const SERCOS_CODES: &[(&str, bool, &[&str])] = &[
    ("position", false, &["Position control, feedback 1, lagless", "Position control, feedback 1"]),
    ("velocity", false, &["Velocity control"]),
    ("torque", false, &["Torque control"]),
    (
        "position",
        true,
        &[
            "Drive controlled interpolation, feedback 1, lagless",
            "Drive controlled interpolation, feedback 1",
        ],
    ),
];

/// The same where the encoder of the load closes the position loop. The other modes have none.
pub(super) const SERCOS_LOAD_CODES: &[(&str, bool, &[&str])] = &[
    ("position", false, &["Position control, feedback 2, lagless", "Position control, feedback 2"]),
    (
        "position",
        true,
        &[
            "Drive controlled interpolation, feedback 2, lagless",
            "Drive controlled interpolation, feedback 2",
        ],
    ),
];

/// How drives spell units in element 4, and the unit that it is.
pub(super) const SPELLINGS: &[(&str, &str)] = &[
    ("mm/U", "mm/Rev"),
    ("mm/rev.", "mm/Rev"),
    ("mm", "mm/Rev"),
    ("um/U", "um/Rev"),
    ("um", "um/Rev"),
    ("\u{b5}m", "um/Rev"),
    ("in", "inch/Rev"),
    ("inch", "inch/Rev"),
    ("\u{b0}C", "degC"),
    ("C", "degC"),
];

/// Captures of a SERCOS drive beside those of a field of their own.
pub(super) const SERCOS_EDGES: &[(&str, &str)] = &[
    ("marker", "positive"),
    ("home_switch_marker_positive", "positive"),
    ("home_switch_marker_positive", "negative"),
];

/// What a drive says of itself: the lists of what its telegrams may carry, and errors that are left over; its modes, and which values
/// it inverts.
pub(super) const SERCOS_READS: &[&str] = &["S-0-0187", "S-0-0188", "S-0-0011"];
pub(super) const CIA402_READS: &[&str] = &["6502:00", "607E:00"];
