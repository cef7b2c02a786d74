//! Facts of the standards that the rules of this folder compare the tables with.
//!
//! They are stated here once and not read from the tables, so that a change of a table cannot change what it is compared with.

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
    bound("load_position_actual", &["S-0-0053"], &[]),
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
    bound("homed", &["S-0-0403"], &[]),
];

/// Parameters that drives hold as a magnitude although the generic value is below zero.
pub(super) const MAGNITUDES: &[(&str, &[&str])] =
    &[("torque_limit_negative", &["S-0-0083", "S-0-0092", "60E1:00", "6072:00"])];

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
    ("N", 1e6),
    ("Hertz", 1e3),
    ("Ohms", 1e6),
    ("Henries", 1e9),
    ("kg*m\u{b2}", 1e9),
    ("kg", 1e6),
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

/// Units of CIP that follow the scaling of the axis (Table 5-2.8).
pub(super) const SCALED_UNITS: &[(&str, &str)] = &[
    ("Position Control Units", "motion_count"),
    ("Velocity Control Units / Sec", "motion_unit"),
    ("Accel Control Units / Sec\u{b2}", "motion_unit"),
    ("Velocity Control Units / Sec\u{b2}", "motion_unit"),
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
    ("External error", "external_input"),
    ("Generic error", "drive_specific"),
    ("Device specific", "drive_specific"),
];
