//! Tables that would send a drive the wrong way: complete, well formed, and wrong.

use super::*;
use crate::check;
use crate::finding::registry::{self as code, Code};
use crate::finding::{Finding, Severity};

/// One of the files.
type Table = fn(&mut TableTexts) -> &mut TableText;

/// What is dangerous, in which file, from what, to what, the code and the key of the finding.
type Case = (&'static str, Table, &'static str, &'static str, Code, &'static str);

const CASES: &[Case] = &[
    (
        "polarity of the actual position removed",
        |t| &mut t.generic_sercos,
        "polarity = { idn = \"S-0-0055\", bit = 2 }, load = ",
        "load = ",
        code::WRONG_SIGN,
        "signal",
    ),
    (
        "bit of the actual position's polarity",
        |t| &mut t.generic_sercos,
        "direction = \"from_drive\", missing = \"refuse\", polarity = { idn = \"S-0-0055\", bit = 2 }",
        "direction = \"from_drive\", missing = \"refuse\", polarity = { idn = \"S-0-0055\", bit = 0 }",
        code::WRONG_SIGN,
        "polarity",
    ),
    (
        "direction of the axis",
        |t| &mut t.generic_sercos,
        "[direction]\npolarity = { idn = \"S-0-0055\", bit = 2 }",
        "[direction]\npolarity = { idn = \"S-0-0055\", bit = 0 }",
        code::WRONG_SIGN,
        "polarity",
    ),
    (
        "polarity of a velocity for a position",
        |t| &mut t.generic_cia402,
        "object = \"607A:00\", direction = \"to_drive\", polarity = \"Position polarity\"",
        "object = \"607A:00\", direction = \"to_drive\", polarity = \"Velocity polarity\"",
        code::WRONG_SIGN,
        "polarity",
    ),
    (
        "a limit turned round",
        |t| &mut t.generic_sercos,
        "idn = \"S-0-0039\", direction = \"both\"",
        "idn = \"S-0-0039\", direction = \"both\", factor = [-1, 1]",
        code::WRONG_SIGN,
        "factor",
    ),
    (
        "gear of the velocity turned round",
        |t| &mut t.generic_sercos,
        "word = \"S-0-0044\"\nload = { pattern = [0x40, 0x40], gear = [\"S-0-0121\", \"S-0-0122\"] }",
        "word = \"S-0-0044\"\nload = { pattern = [0x40, 0x40], gear = [\"S-0-0122\", \"S-0-0121\"] }",
        code::WRONG_SHAFT,
        "gear",
    ),
    (
        "gear ratio of CiA 402 turned round",
        |t| &mut t.generic_cia402,
        "times = [\"608F:02\", \"6091:02\"], over = [\"608F:01\", \"6091:01\"]",
        "times = [\"608F:02\", \"6091:01\"], over = [\"608F:01\", \"6091:02\"]",
        code::WRONG_SHAFT,
        "times",
    ),
    (
        "60 times too slow in a method without example",
        |t| &mut t.generic_sercos,
        "name = \"rotary per second, parameters\", kind = \"rotary\", quantity = \"velocity\", base = [1_000_000_000, 1]",
        "name = \"rotary per second, parameters\", kind = \"rotary\", quantity = \"velocity\", base = [50_000_000, 3]",
        code::WRONG_SCALE,
        "base",
    ),
    (
        "60 times too slow in a unit",
        |t| &mut t.generic_sercos,
        "unit = \"1/min\", quantity = \"velocity\", generic_per_unit = [50_000_000, 3]",
        "unit = \"1/min\", quantity = \"velocity\", generic_per_unit = [1_000_000_000, 1]",
        code::WRONG_SCALE,
        "generic_per_unit",
    ),
    (
        "60 times too slow by the code of a unit",
        |t| &mut t.generic_cia402,
        "when = [\"60A9:00\", 0x00B4_4700], base = [50_000_000, 3]",
        "when = [\"60A9:00\", 0x00B4_4700], base = [2_500_000, 9]",
        code::WRONG_SCALE,
        "generic_per_unit",
    ),
    (
        "a scaling type that is none",
        |t| &mut t.generic_sercos,
        "{ pattern = [0x07, 0x00], name = \"percent of continuous stall torque\"",
        "{ pattern = [0x01, 0x00], name = \"percent of continuous stall torque\"",
        code::WRONG_SCALE,
        "base",
    ),
    (
        "operation mode written to the display",
        |t| &mut t.generic_cia402,
        "mode = \"6060:00\"",
        "mode = \"6061:00\"",
        code::WRONG_BINDING,
        "mode",
    ),
    (
        "command in the place of the actual value",
        |t| &mut t.generic_sercos,
        "idn = \"S-0-0047\", direction",
        "idn = \"S-0-0051\", direction",
        code::WRONG_BINDING,
        "idn",
    ),
    (
        "an object that no PDO takes",
        |t| &mut t.generic_cia402,
        "signal = \"torque_actual\", object = \"6077:00\", direction",
        "signal = \"torque_actual\", object = \"6072:00\", direction",
        code::WRONG_BINDING,
        "object",
    ),
    (
        "limits exchanged",
        |t| &mut t.generic_sercos,
        "parameter = \"position_limit_positive\", idn = \"S-0-0049\"",
        "parameter = \"position_limit_positive\", idn = \"S-0-0050\"",
        code::WRONG_BINDING,
        "idn",
    ),
    (
        "running shown as stopped",
        |t| &mut t.cip_generic,
        "axis_state = \"Running\"",
        "axis_state = \"Stopped\"",
        code::WRONG_STATE,
        "axis_state",
    ),
    (
        "no main power taken for ready",
        |t| &mut t.generic_sercos,
        "\"Ready to operate\", is = 1 }], report = \"awaiting_power\"",
        "\"Ready to operate\", is = 1 }], report = \"ready\"",
        code::WRONG_STATE,
        "report",
    ),
    (
        "switched on taken for operating",
        |t| &mut t.generic_cia402,
        "state = \"Switched on\", report = \"ready\"",
        "state = \"Switched on\", report = \"operating\"",
        code::WRONG_STATE,
        "report",
    ),
    (
        "a pattern that shadows the fault",
        |t| &mut t.generic_sercos,
        "{ pattern = [{ field = \"Drive shut-down error\", is = 1 }], report = \"faulted\"",
        "{ pattern = [{ field = \"Drive shut-down error\", is = 1 }, { field = \"Ready to operate\", is = 0 }], report = \"faulted\"",
        code::WRONG_STATE,
        "report",
    ),
    (
        "enabled bit from another state",
        |t| &mut t.generic_cia402,
        "state = \"Operation enabled\", status = \"enabled\"",
        "state = \"Switched on\", status = \"enabled\"",
        code::WRONG_STATE,
        "status",
    ),
    (
        "position mode that is a torque mode",
        |t| &mut t.generic_cia402,
        "modes = [\"csp\"], command",
        "modes = [\"cst\"], command",
        code::WRONG_STATE,
        "modes",
    ),
    (
        "enable before there is power",
        |t| &mut t.generic_cia402,
        "when = \"Switch on disabled\", send = \"Shutdown\"",
        "when = \"Switch on disabled\", send = \"Enable operation\"",
        code::WRONG_ORDER,
        "send",
    ),
    (
        "disable that keeps the torque",
        |t| &mut t.generic_cia402,
        "action = \"disable\", when = \"Operation enabled\", send = \"Switch on\"",
        "action = \"disable\", when = \"Operation enabled\", send = \"Enable operation\"",
        code::WRONG_ORDER,
        "send",
    ),
    (
        "torque off that brakes",
        |t| &mut t.generic_sercos,
        "{ action = \"torque_off\", pattern = [\n    { field = \"Drive on\", is = \"off\" },\n    { field = \"Enable drive\", is = \"torque off\" }",
        "{ action = \"torque_off\", pattern = [\n    { field = \"Drive on\", is = \"off\" },\n    { field = \"Enable drive\", is = \"enabled\" }",
        code::WRONG_ORDER,
        "action",
    ),
    (
        "enable that asks for disable",
        |t| &mut t.cip_generic,
        "axis_control = \"Enable Request\", request = \"enable\"",
        "axis_control = \"Enable Request\", request = \"disable\"",
        code::REQUEST_LOST,
        "request",
    ),
    (
        "a request in two rows",
        |t| &mut t.cip_generic,
        "axis_control = \"Enable Request\", request",
        "axis_control = \"Disable Request\", request",
        code::TWICE,
        "axis_control",
    ),
    (
        "a row in the long form that repeats one of a group",
        |t| &mut t.generic_sercos,
        "[supported_modes]",
        "[[mode_slot]]\nslot = 3\nidn = \"S-0-0035\"\nsource = \"again\"\n\n[supported_modes]",
        code::TWICE,
        "slot",
    ),
    (
        "a set-point that may be missing",
        |t| &mut t.generic_sercos,
        "idn = \"S-0-0036\", direction = \"to_drive\", missing = \"refuse\"",
        "idn = \"S-0-0036\", direction = \"to_drive\", missing = \"omit\"",
        code::POLICY_WEAK,
        "missing",
    ),
    (
        "a mode that may be refused",
        |t| &mut t.generic_cia402,
        "do = \"write_mode\", refused = \"fail\"",
        "do = \"write_mode\", refused = \"continue\"",
        code::POLICY_WEAK,
        "refused",
    ),
    (
        "a limit that may be refused",
        |t| &mut t.generic_sercos,
        "parameter = \"torque_limit_positive\", refused = \"fail\"",
        "parameter = \"torque_limit_positive\", refused = \"continue\"",
        code::POLICY_WEAK,
        "refused",
    ),
    (
        "a velocity that nobody has told as 0",
        |t| &mut t.cip_generic,
        "signal = \"velocity_actual\", direction = \"from_generic\", missing = \"absent\"",
        "signal = \"velocity_actual\", direction = \"from_generic\", missing = \"zero\"",
        code::POLICY_WEAK,
        "missing",
    ),
    (
        "a warning that nobody is told",
        |t| &mut t.cip_generic,
        "cause = \"drive_warning\", manufacturer = 29, least = \"Ignore\", default = \"Alarm\"",
        "cause = \"drive_warning\", manufacturer = 29, least = \"Ignore\", default = \"Ignore\"",
        code::POLICY_WEAK,
        "default",
    ),
    (
        "an over-voltage told as an under-voltage",
        |t| &mut t.generic_sercos,
        "field = \"Overvoltage error\", is = 1 }], cause = \"over_voltage\"",
        "field = \"Overvoltage error\", is = 1 }], cause = \"under_voltage\"",
        code::WRONG_FAULT,
        "cause",
    ),
    (
        "a fault of the motor told as one of the inverter",
        |t| &mut t.cip_generic,
        "cause = \"motor_over_temperature\", exception = \"Motor Overtemperature FL\"",
        "cause = \"motor_over_temperature\", exception = \"Inverter Thermal Overload FL\"",
        code::WRONG_FAULT,
        "exception",
    ),
    (
        "a bit of the manufacturer moved",
        |t| &mut t.cip_generic,
        "cause = \"homing\", manufacturer = 9",
        "cause = \"homing\", manufacturer = 40",
        code::WRONG_FAULT,
        "manufacturer",
    ),
    (
        "a class of errors told as another one",
        |t| &mut t.generic_cia402,
        "classes = [\"Data set\"], cause = \"parameter\"",
        "classes = [\"Data set\"], cause = \"internal\"",
        code::WRONG_FAULT,
        "cause",
    ),
    (
        "an error code as a warning",
        |t| &mut t.generic_cia402,
        "{ codes = [\"I2t fault\"], cause = \"motor_overload\" }",
        "{ codes = [\"I2t fault\"], cause = \"motor_overload_user_limit\", reaction = \"alarm\" }",
        code::WEAKER_REACTION,
        "reaction",
    ),
    (
        "a motor that the controller may set up",
        |t| &mut t.generic_cia402,
        "parameter = \"gear_ratio_denominator\", object = \"6091:02\", direction = \"from_drive\"",
        "parameter = \"gear_ratio_denominator\", object = \"6091:02\", direction = \"both\"",
        code::DIRECTION,
        "direction",
    ),
    (
        "a limit that is never read",
        |t| &mut t.generic_sercos,
        "parameter = \"velocity_limit_negative\", idn = \"S-0-0039\", direction = \"both\"",
        "parameter = \"velocity_limit_negative\", idn = \"S-0-0039\", direction = \"to_drive\"",
        code::DIRECTION,
        "direction",
    ),
    (
        "a probe that is armed by the bit of the other one",
        |t| &mut t.generic_sercos,
        "value = \"S-0-0130\", word = \"Probe status\", pattern = [{ field = \"Probe 1 positive latched\", is = 1 }], enable = \"S-0-0405\"",
        "value = \"S-0-0130\", word = \"Probe status\", pattern = [{ field = \"Probe 1 positive latched\", is = 1 }], enable = \"S-0-0406\"",
        code::WRONG_BINDING,
        "enable",
    ),
    (
        "a probe that samples the other edge",
        |t| &mut t.generic_cia402,
        "select = [{ field = \"Sample at positive edge 1\", is = 1 }]",
        "select = [{ field = \"Sample at negative edge 1\", is = 1 }]",
        code::WRONG_STATE,
        "edge",
    ),
    (
        "a diagnosis that is no error taken for one",
        |t| &mut t.generic_sercos,
        "pattern = [{ field = \"Class\", is = 0xF }], cause = \"drive_specific\"",
        "pattern = [{ field = \"Class\", is = 0xE }], cause = \"drive_specific\"",
        code::WRONG_FAULT,
        "cause",
    ),
    (
        "a status bit that nobody shows",
        |t| &mut t.generic_sercos,
        "  { word = \"Class 3 diagnostic\", pattern = [{ field = \"Torque at limit\", is = 1 }], status = \"torque_limit\", source = \"Rexroth: limits S-0-0092, 0082, 0083\" },\n",
        "",
        code::NOTHING_BOUND,
        "mapping",
    ),
    (
        "a parameter that nobody binds",
        |t| &mut t.generic_cia402,
        "  { parameter = \"standstill_window\", object = \"606F:00\", direction = \"both\", source = \"SSC KM OM TS\" },\n",
        "",
        code::NOTHING_BOUND,
        "mapping",
    ),
    (
        "a mode that does not show the velocity",
        |t| &mut t.generic_sercos,
        "command = [\"torque_command\"], actual = [\"position_actual\", \"velocity_actual\", \"torque_actual\"]",
        "command = [\"torque_command\"], actual = [\"position_actual\", \"torque_actual\"]",
        code::MODES_DIFFER,
        "mode",
    ),
    (
        "a stop that coasts in place of a ramp",
        |t| &mut t.cip_generic,
        "stopping_action = \"Ramped Decel & Disable\", method = \"ramp\"",
        "stopping_action = \"Ramped Decel & Disable\", method = \"coast\"",
        code::WRONG_ORDER,
        "method",
    ),
    (
        "a bit of the status word that is not looked at",
        |t| &mut t.generic_sercos,
        "pattern = [{ field = \"Ready to operate\", is = 2 }], status = \"power\"",
        "pattern = [{ field = \"Ready to operate\", is = 2 }, { field = \"Drive warning\", is = 0 }], status = \"power\"",
        code::WRONG_STATE,
        "status",
    ),
    (
        "power of drives that tell nothing of it",
        |t| &mut t.generic_cia402,
        "state = \"Switched on\", voltage = false, status = \"power\"",
        "state = \"Switched on\", voltage = true, status = \"power\"",
        code::WRONG_STATE,
        "status",
    ),
    (
        "an edge that is told by the other one",
        |t| &mut t.generic_cia402,
        "pattern = [{ field = \"Home switch\", is = 0 }]",
        "pattern = []",
        code::WRONG_STATE,
        "edge",
    ),
    (
        "a reset of faults that asks for a quick stop",
        |t| &mut t.generic_cia402,
        "send = \"Fault reset\", pattern = [{ field = \"Quick stop\", is = 1 }]",
        "send = \"Fault reset\"",
        code::WRONG_ORDER,
        "send",
    ),
    (
        "a target that waits for the one before",
        |t| &mut t.generic_cia402,
        "{ field = \"Change set immediately\", is = 1 }",
        "{ field = \"Change set immediately\", is = 0 }",
        code::WRONG_ORDER,
        "modes",
    ),
    (
        "an event that comes by another edge",
        |t| &mut t.cip_generic,
        "event = \"Home Switch-Marker +-\", checking = \"Home Switch-Marker +-\", capture = \"home_switch_marker_negative\"",
        "event = \"Home Switch-Marker +-\", checking = \"Home Switch-Marker +-\", capture = \"home_switch_marker_positive\"",
        code::WRONG_BINDING,
        "capture",
    ),
    (
        "feedback that is the following error",
        |t| &mut t.cip_generic,
        "attribute = \"Position Feedback\", signal = \"position_actual\"",
        "attribute = \"Position Feedback\", signal = \"following_error\"",
        code::WRONG_BINDING,
        "signal",
    ),
    (
        "a scaling type that no method takes",
        |t| &mut t.generic_sercos,
        "pattern = [0x3F, 0x19], name = \"inch per second cubed, parameters\"",
        "pattern = [0x3F, 0x3B], name = \"inch per second cubed, parameters\"",
        code::WRONG_SCALE,
        "scaling",
    ),
    (
        "a value that nobody goes by",
        |t| &mut t.cip_generic,
        "parameter = \"velocity_feed_forward_gain\"",
        "parameter = \"velocity_feed_forward_gain\", missing = \"device\"",
        code::POLICY_WEAK,
        "missing",
    ),
    (
        "one more attribute without effect",
        |t| &mut t.cip_generic,
        "attribute = \"Control Method\", served_by = \"constant\", value = 2",
        "attribute = \"Control Method\", served_by = \"stored\"",
        code::POLICY_WEAK,
        "served_by",
    ),
    (
        "over-current as a warning",
        |t| &mut t.generic_sercos,
        "cause = \"over_current\", source",
        "cause = \"motor_overload_user_limit\", reaction = \"alarm\", source",
        code::WEAKER_REACTION,
        "reaction",
    ),
    (
        "a position that ends at the range of its DINT",
        |t| &mut t.cip_generic,
        "signal = \"position_command\", direction = \"to_generic\", wraps = true",
        "signal = \"position_command\", direction = \"to_generic\"",
        code::WRONG_WRAP,
        "element",
    ),
    (
        "a limit that is stored and never reaches a drive",
        |t| &mut t.cip_generic,
        "attribute = \"Torque Rate Limit\", parameter = \"torque_rate_limit\"",
        "attribute = \"Torque Rate Limit\", served_by = \"device\"",
        code::NOTHING_BOUND,
        "mapping",
    ),
    (
        "the scaling of a way for an axis that turns",
        |t| &mut t.generic_sercos,
        "value = 0x41, when = { kind = \"linear\", set_scaling = true }, refused = \"continue\", source = \"linear, preferential, metre",
        "value = 0x41, when = { set_scaling = true }, refused = \"continue\", source = \"linear, preferential, metre",
        code::STEP_MISPLACED,
        "idn",
    ),
    (
        "the scaling of a drive that keeps its own",
        |t| &mut t.generic_sercos,
        "value = 0x00, when = { set_scaling = true }",
        "value = 0x00, when = { set_scaling = false }",
        code::STEP_MISPLACED,
        "idn",
    ),
    (
        "a limit before its unit is known",
        |t| &mut t.generic_sercos,
        "{ phase = 3, do = \"write\", parameter = \"acceleration_limit\"",
        "{ phase = 2, do = \"write\", parameter = \"acceleration_limit\"",
        code::STEP_MISPLACED,
        "phase",
    ),
    (
        "the way of interpolation for drives that do not interpolate",
        |t| &mut t.generic_cia402,
        "object = \"60C0:00\", value = 0, modes = [\"ip\"]",
        "object = \"60C0:00\", value = 0",
        code::STEP_MISPLACED,
        "object",
    ),
    (
        "an error of the drive taken for one of the bus",
        |t| &mut t.generic_sercos,
        "{ field = \"Source type\", is = 3 }",
        "{ field = \"Source type\", is = 0 }",
        code::WRONG_FAULT,
        "cause",
    ),
    (
        "a drive in interpolated position that does not follow yet",
        |t| &mut t.generic_cia402,
        "modes = [\"ip\"], follows = true, report = \"enabling\"",
        "modes = [\"ip\"], follows = true, report = \"operating\"",
        code::WRONG_STATE,
        "report",
    ),
    (
        "a drive that homes and is taken for one that follows",
        |t| &mut t.generic_cia402,
        "modes = [\"pp\", \"pv\", \"tq\", \"vl\"], status = \"tracking\"",
        "status = \"tracking\"",
        code::WRONG_STATE,
        "status",
    ),
    (
        "motor data that a controller overwrites",
        |t| &mut t.generic_sercos,
        "parameter = \"motor_max_velocity\", idn = \"S-0-0113\", direction = \"from_drive\"",
        "parameter = \"motor_max_velocity\", idn = \"S-0-0113\", direction = \"both\"",
        code::DIRECTION,
        "direction",
    ),
    (
        "a gear that is read from the mode of operation",
        |t| &mut t.generic_cia402,
        "parameter = \"gear_ratio_numerator\", object = \"6091:01\"",
        "parameter = \"gear_ratio_numerator\", object = \"6061:00\"",
        code::WRONG_BINDING,
        "object",
    ),
    (
        "a memory that is reported as anything inside",
        |t| &mut t.generic_cia402,
        "\"Working memory (RAM)\", \"Program memory (EPROM)\"",
        "\"Program memory (EPROM)\"",
        code::NOTHING_BOUND,
        "mapping",
    ),
    (
        "polarity of the encoder of the load removed",
        |t| &mut t.generic_sercos,
        "load = { idn = \"S-0-0053\", polarity = { idn = \"S-0-0055\", bit = 3 } }",
        "load = { idn = \"S-0-0053\" }",
        code::WRONG_SIGN,
        "load",
    ),
    (
        "polarity of the encoder of the motor for that of the load",
        |t| &mut t.generic_sercos,
        "load = { idn = \"S-0-0053\", polarity = { idn = \"S-0-0055\", bit = 3 } }",
        "load = { idn = \"S-0-0053\", polarity = { idn = \"S-0-0055\", bit = 2 } }",
        code::WRONG_SIGN,
        "polarity",
    ),
    (
        "position of the motor for that of the load",
        |t| &mut t.generic_sercos,
        "load = { idn = \"S-0-0053\", polarity = { idn = \"S-0-0055\", bit = 3 } }",
        "load = { idn = \"S-0-0051\", polarity = { idn = \"S-0-0055\", bit = 2 } }",
        code::WRONG_BINDING,
        "load",
    ),
    (
        "an axis of the load that goes by its motor",
        |t| &mut t.generic_sercos,
        "load = { idn = \"S-0-0053\", polarity = { idn = \"S-0-0055\", bit = 3 } }, ",
        "",
        code::WRONG_BINDING,
        "signal",
    ),
    (
        "velocity mode for a position by the encoder of the load",
        |t| &mut t.generic_sercos,
        "load_codes = [\"Position control, feedback 2, lagless\", \"Position control, feedback 2\"]",
        "load_codes = [\"Velocity control\"]",
        code::WRONG_STATE,
        "load_codes",
    ),
    (
        "a position loop over the motor for one over the load",
        |t| &mut t.generic_sercos,
        "load_codes = [\"Position control, feedback 2, lagless\", \"Position control, feedback 2\"]",
        "load_codes = [\"Position control, feedback 1, lagless\"]",
        code::WRONG_STATE,
        "load_codes",
    ),
    (
        "no mode of the encoder of the load",
        |t| &mut t.generic_sercos,
        "load_codes = [\"Position control, feedback 2, lagless\", \"Position control, feedback 2\"], ",
        "",
        code::WRONG_STATE,
        "mode",
    ),
    (
        "position of the motor for that of the load of CiA 402",
        |t| &mut t.generic_cia402,
        "load = \"60E4:01\"",
        "load = \"6064:00\"",
        code::WRONG_BINDING,
        "load",
    ),
    (
        "velocity of the motor for an axis of the load",
        |t| &mut t.generic_cia402,
        "load = \"60E5:01\", ",
        "",
        code::WRONG_BINDING,
        "signal",
    ),
    (
        "an axis of its motor that is enabled by the encoder of the load",
        |t| &mut t.cip_generic,
        "feedback_mode = \"Load Feedback\", feedback = \"load\"",
        "feedback_mode = \"Load Feedback\", feedback = \"motor\"",
        code::WRONG_STATE,
        "feedback",
    ),
    (
        "limits that are exchanged in an inverted drive",
        |t| &mut t.generic_cia402,
        "object = \"60E0:00\", inverted = \"60E1:00\"",
        "object = \"60E0:00\"",
        code::WRONG_SIGN,
        "parameter",
    ),
    (
        "a drive with one limit that gets none",
        |t| &mut t.generic_cia402,
        "inverted = \"60E0:00\", common = \"6072:00\"",
        "inverted = \"60E0:00\"",
        code::WRONG_BINDING,
        "parameter",
    ),
    (
        "limit switches that are checked by another attribute",
        |t| &mut t.cip_generic,
        "overtravel_checking = \"Hardware Overtravel Input Checking\"",
        "overtravel_checking = \"Flying Start Enable\"",
        code::WRONG_BINDING,
        "overtravel_checking",
    ),
    (
        "a stop with the ramp of the start",
        |t| &mut t.cip_generic,
        "ramp_deceleration = \"Ramp Deceleration\"",
        "ramp_deceleration = \"Ramp Acceleration\"",
        code::WRONG_BINDING,
        "ramp_deceleration",
    ),
    (
        "a position that wraps after one turn",
        |t| &mut t.generic_sercos,
        "range = \"S-0-0103\", divider",
        "range = \"S-0-0079\", divider",
        code::WRONG_SCALE,
        "modulo",
    ),
    (
        "a position that never wraps",
        |t| &mut t.generic_sercos,
        "modulo = { pattern = [0x80, 0x80], range = \"S-0-0103\", divider = \"S-0-0294\" }\n",
        "",
        code::WRONG_SCALE,
        "scaling",
    ),
    (
        "a range that nobody asks whether it is divided",
        |t| &mut t.generic_sercos,
        "range = \"S-0-0103\", divider = \"S-0-0294\"",
        "range = \"S-0-0103\"",
        code::WRONG_SCALE,
        "modulo",
    ),
    (
        "a preferential scaling that is not held to its factors",
        |t| &mut t.generic_sercos,
        ", divisor = 3_600_000, expect = [[\"S-0-0079\", 3_600_000]]",
        ", divisor = 3_600_000",
        code::WRONG_SCALE,
        "base",
    ),
    (
        "a preferential scaling with the exponent of another",
        |t| &mut t.generic_sercos,
        "exponent = -4, expect = [[\"S-0-0045\", 1], [\"S-0-0046\", -4]]",
        "exponent = -4, expect = [[\"S-0-0045\", 1], [\"S-0-0046\", -6]]",
        code::WRONG_SCALE,
        "expect",
    ),
];

fn found(change: impl Fn(&mut TableTexts)) -> Vec<Finding> {
    let mut texts = TableTexts::embedded();
    change(&mut texts);
    check::texts(Some(texts), Findings::default()).findings.list().to_vec()
}

fn replace(table: &mut TableText, from: &str, to: &str) {
    assert!(table.text.contains(from), "{from:?} is not in {}", table.path);
    table.text = table.text.replacen(from, to, 1);
}

#[test]
fn what_would_send_a_drive_the_wrong_way_is_an_error_at_its_row() {
    let (mut text, mut missed) = (String::new(), Vec::new());
    for (what, table, from, to, code, key) in CASES {
        let findings = found(|texts| replace(table(texts), from, to));
        let own: Vec<&Finding> = findings.iter().filter(|finding| finding.code == *code).collect();
        let all: String = findings
            .iter()
            .filter(|found| found.severity() != Severity::Note)
            .map(|found| format!("{found}\n"))
            .collect();
        if !own.iter().any(|finding| finding.key == *key) {
            missed.push(format!("{what}:\n{all}"));
        }
        assert!(own.iter().all(|finding| !finding.help.is_empty()), "{what}:\n{all}");
        writeln!(text, "## {what}\n{all}").unwrap();
    }
    assert!(missed.is_empty(), "not found: {}", missed.join("\n"));
    insta::assert_snapshot!(text);
}

#[test]
fn states_exchanged_and_ready_exchanged_are_found_in_both_rows() {
    let swap = |table: &mut TableText, one: &str, other: &str| {
        assert!(table.text.contains(one) && table.text.contains(other));
        table.text = table.text.replacen(one, "\u{1}", 1).replacen(other, one, 1).replacen('\u{1}', other, 1);
    };
    let states = found(|texts| swap(&mut texts.cip_generic, "\"Running\"", "\"Stopped\""));
    assert_eq!(states.iter().filter(|found| found.code == code::WRONG_STATE).count(), 2);
    let ready = found(|texts| {
        let [one, other] = [1, 2].map(|is| format!("\"Ready to operate\", is = {is} }}], report"));
        swap(&mut texts.generic_sercos, &one, &other);
    });
    assert_eq!(ready.iter().filter(|found| found.code == code::WRONG_STATE).count(), 2);
}

#[test]
fn a_row_that_is_accepted_with_a_reason_is_not_reported() {
    let from = "{ pattern = [{ field = \"Ready to operate\", is = 1 }], report = \"awaiting_power\"";
    let wrong = "{ pattern = [{ field = \"Ready to operate\", is = 1 }], report = \"ready\"";
    let count = |comment: &str| {
        let findings = found(|texts| replace(&mut texts.generic_sercos, from, &format!("{comment}{wrong}")));
        findings.iter().filter(|found| found.code == code::WRONG_STATE).count()
    };
    assert_eq!(count(""), 1);
    assert_eq!(count("# accept: the drive has no contactor\n  "), 0);
    assert_eq!(count("# accept:\n  "), 1, "a reason is needed");
}

#[test]
fn what_is_shipped_agrees_with_the_standards() {
    let findings = found(|_| {});
    let bad: Vec<String> =
        findings.iter().filter(|found| found.severity() != Severity::Note).map(ToString::to_string).collect();
    assert!(bad.is_empty(), "{}", bad.join("\n\n"));
}
