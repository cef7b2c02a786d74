//! Objects of one axis, with what the simulated servo gives them to begin with.

use profile_generic::servo::ServoParameters;

use super::scaling::Scales;
use crate::drive::homing::Method;
use crate::drive::index::*;
use crate::drive::modes::SupportedModes;
use crate::node::dictionary::{DataType, Definition, Dictionary, Mapping, Shape};
use crate::node::pdo::{self, AXIS_STEP, Preset};
use crate::wire::Mux;
use crate::wire::pdo::Direction;
use crate::wire::pdo::MappingEntry;

/// Device type: 402, a servo drive.
pub const SERVO: u32 = 0x0002_0192;
/// Device type of a device with several axes; 67FFh says what each is.
pub const SEVERAL_AXES: u32 = 0xFFFF_0192;

/// Part of the velocity of the position set-point that is fed forward, 1/1000; of this manufacturer.
pub const FEED_FORWARD: u16 = 0x2000;
/// Sub-index 1: an error code written here raises that fault; of this manufacturer.
pub const FAULT_INJECTION: u16 = 0x2FFF;
/// Room for any bytes, to try long transfers; of this manufacturer. The device has it once.
pub const SCRATCH: u16 = 0x2FFE;
/// Bytes of [`SCRATCH`].
pub const SCRATCH_LEN: usize = 4096;

/// User units in a turn of the motor, to begin with.
pub const UNITS_PER_TURN: i64 = 65_536;

/// Modes of operation of the simulated drive.
pub const MODES: SupportedModes = SupportedModes::all().difference(SupportedModes::CYCLIC_TORQUE_COMMUTATION);

/// Adds the objects of axis `axis`, from 0.
pub fn define(dictionary: &mut Dictionary, axis: u8, servo: &ServoParameters) {
    use DataType::{I8, I16, I32, U8, U16, U32};
    use Mapping::{Both, Rpdo, Tpdo};
    let offset = u16::from(axis) * AXIS_OFFSET;
    let new = Definition::new;
    let mut add = |index: u16, definition: Definition| dictionary.variable(index + offset, definition);
    let command = |name, data_type| new(name, data_type, 0).volatile().mappable(Both);
    let setting = |name, data_type, default| new(name, data_type, default).mappable(Rpdo);
    let actual = |name, data_type| new(name, data_type, 0).read_only().mappable(Tpdo);
    let scales = Scales::preset();
    let rated_speed = scales.velocity.counts(servo.rated_velocity.0);
    let top_speed = scales.velocity.counts(servo.velocity_limit.0);
    let rpm = servo.velocity_limit.0.saturating_mul(6) / 100_000_000;
    let quick = scales.acceleration.counts(servo.deceleration_limit.0);
    let torque = servo.torque_limit.0 / 1_000;

    add(FEED_FORWARD, new("Velocity feed forward", U16, 1_000).range(0, 1_000));
    add(ABORT_CONNECTION_OPTION, new("Abort connection option code", I16, 1).range(0, 3));
    add(ERROR_CODE, actual("Error code", U16));
    add(CONTROLWORD, command("Controlword", U16));
    add(STATUSWORD, actual("Statusword", U16));
    add(VL_TARGET_VELOCITY, command("vl target velocity", I16));
    add(VL_VELOCITY_DEMAND, actual("vl velocity demand", I16));
    add(VL_VELOCITY_ACTUAL, actual("vl velocity actual value", I16));
    add(QUICK_STOP_OPTION, new("Quick stop option code", I16, 2).range(0, 8));
    add(SHUTDOWN_OPTION, new("Shutdown option code", I16, 0).range(0, 1));
    add(DISABLE_OPTION, new("Disable operation option code", I16, 1).range(0, 1));
    add(HALT_OPTION, new("Halt option code", I16, 1).range(1, 4));
    add(FAULT_REACTION_OPTION, new("Fault reaction option code", I16, 2).range(0, 4));
    add(MODE, command("Modes of operation", I8));
    add(MODE_DISPLAY, actual("Modes of operation display", I8));
    add(POSITION_DEMAND, actual("Position demand value", I32));
    add(POSITION_INTERNAL, actual("Position actual internal value", I32));
    add(POSITION_ACTUAL, actual("Position actual value", I32));
    add(FOLLOWING_WINDOW, setting("Following error window", U32, UNITS_PER_TURN));
    add(FOLLOWING_TIME_OUT, setting("Following error time out", U16, 10));
    add(POSITION_WINDOW, setting("Position window", U32, UNITS_PER_TURN / 1_000));
    add(POSITION_WINDOW_TIME, setting("Position window time", U16, 5));
    add(VELOCITY_SENSOR, actual("Velocity sensor actual value", I32));
    add(VELOCITY_DEMAND, actual("Velocity demand value", I32));
    add(VELOCITY_ACTUAL, actual("Velocity actual value", I32));
    add(VELOCITY_WINDOW, setting("Velocity window", U16, UNITS_PER_TURN / 10));
    add(VELOCITY_WINDOW_TIME, setting("Velocity window time", U16, 5));
    add(VELOCITY_THRESHOLD, setting("Velocity threshold", U16, UNITS_PER_TURN / 10));
    add(VELOCITY_THRESHOLD_TIME, setting("Velocity threshold time", U16, 5));
    add(TARGET_TORQUE, command("Target torque", I16));
    add(MAX_TORQUE, setting("Max torque", U16, torque).range(1, torque));
    add(MAX_CURRENT, setting("Max current", U16, torque).range(1, torque));
    add(TORQUE_DEMAND, actual("Torque demand", I16));
    add(RATED_CURRENT, new("Motor rated current", U32, servo.rated_current.0 / 1_000).constant());
    add(RATED_TORQUE, new("Motor rated torque", U32, servo.rated_torque.0 / 1_000).constant());
    add(TORQUE_ACTUAL, actual("Torque actual value", I16));
    add(CURRENT_ACTUAL, actual("Current actual value", I16));
    add(DC_LINK_VOLTAGE, actual("DC link circuit voltage", U32));
    add(TARGET_POSITION, command("Target position", I32));
    add(HOME_OFFSET, setting("Home offset", I32, 0));
    add(POLARITY, new("Polarity", U8, 0));
    add(MAX_PROFILE_VELOCITY, setting("Max profile velocity", U32, top_speed));
    add(MAX_MOTOR_SPEED, setting("Max motor speed", U32, rpm));
    add(PROFILE_VELOCITY, setting("Profile velocity", U32, rated_speed));
    add(END_VELOCITY, new("End velocity", U32, 0).range(0, 0));
    add(PROFILE_ACCELERATION, setting("Profile acceleration", U32, quick / 5).range(1, i64::from(u32::MAX)));
    add(PROFILE_DECELERATION, setting("Profile deceleration", U32, quick / 5).range(1, i64::from(u32::MAX)));
    add(
        QUICK_STOP_DECELERATION,
        setting("Quick stop deceleration", U32, quick).range(1, i64::from(u32::MAX)),
    );
    add(PROFILE_TYPE, new("Motion profile type", I16, 0).range(0, 0));
    add(TORQUE_SLOPE, setting("Torque slope", U32, 10_000).range(1, i64::from(u32::MAX)));
    add(HOMING_METHOD, setting("Homing method", I8, 37));
    add(HOMING_ACCELERATION, setting("Homing acceleration", U32, quick / 5).range(1, i64::from(u32::MAX)));
    add(POSITION_OFFSET, command("Position offset", I32));
    add(VELOCITY_OFFSET, command("Velocity offset", I32));
    add(TORQUE_OFFSET, command("Torque offset", I16));
    add(PROBE_FUNCTION, command("Touch probe function", U16));
    add(PROBE_STATUS, actual("Touch probe status", U16));
    add(PROBE_1_RISING, actual("Touch probe position 1 positive edge", I32));
    add(PROBE_1_FALLING, actual("Touch probe position 1 negative edge", I32));
    add(PROBE_2_RISING, actual("Touch probe position 2 positive edge", I32));
    add(PROBE_2_FALLING, actual("Touch probe position 2 negative edge", I32));
    add(INTERPOLATION_SUB_MODE, new("Interpolation sub mode select", I16, 0).range(0, 0));
    add(
        MAX_ACCELERATION,
        setting("Max acceleration", U32, i64::from(u32::MAX)).range(1, i64::from(u32::MAX)),
    );
    add(
        MAX_DECELERATION,
        setting("Max deceleration", U32, i64::from(u32::MAX)).range(1, i64::from(u32::MAX)),
    );
    add(PROBE_1_RISING_COUNTER, actual("Touch probe 1 positive edge counter", U16));
    add(PROBE_1_FALLING_COUNTER, actual("Touch probe 1 negative edge counter", U16));
    add(PROBE_2_RISING_COUNTER, actual("Touch probe 2 positive edge counter", U16));
    add(PROBE_2_FALLING_COUNTER, actual("Touch probe 2 negative edge counter", U16));
    add(POSITIVE_TORQUE_LIMIT, setting("Positive torque limit value", U16, torque).range(1, torque));
    add(NEGATIVE_TORQUE_LIMIT, setting("Negative torque limit value", U16, torque).range(1, torque));
    add(FOLLOWING_ERROR, actual("Following error actual value", I32));
    add(CONTROL_EFFORT, actual("Control effort", I32));
    add(POSITION_DEMAND_INTERNAL, actual("Position demand internal value", I32));
    add(DIGITAL_INPUTS, actual("Digital inputs", U32));
    add(TARGET_VELOCITY, command("Target velocity", I32));
    // 3: PM synchronous motor.
    add(MOTOR_TYPE, new("Motor type", U16, 3).constant());
    add(SUPPORTED_MODES, new("Supported drive modes", U32, i64::from(MODES.bits())).constant());
    add(AXIS_DEVICE_TYPE, new("Single device type", U32, i64::from(SERVO)).constant());

    let part = |definition: Definition| Some(definition);
    let several = |name, default| part(setting(name, U32, default).range(1, i64::from(u32::MAX)));
    let ratio = |upper, lower, default: (i64, i64)| [several(upper, default.0), several(lower, default.1)];
    let (lowest, highest) = I32.range();
    let limits = |low, high| [low, high].map(|name| part(setting(name, I32, 0)));
    let records: [(u16, &str, Shape, &[Option<Definition>]); 16] = [
        (
            FAULT_INJECTION,
            "Fault injection",
            Shape::Record,
            &[part(new("Error code to raise", U16, 0).volatile())],
        ),
        (
            VL_VELOCITY_LIMITS,
            "vl velocity min max amount",
            Shape::Array,
            &[part(new("vl velocity min amount", U32, 0)), part(new("vl velocity max amount", U32, rpm))],
        ),
        (
            VL_ACCELERATION,
            "vl velocity acceleration",
            Shape::Record,
            &[several("Delta speed", rpm), part(setting("Delta time", U16, 1).range(1, 65_535))],
        ),
        (
            VL_DECELERATION,
            "vl velocity deceleration",
            Shape::Record,
            &[several("Delta speed", rpm), part(setting("Delta time", U16, 1).range(1, 65_535))],
        ),
        (
            VL_QUICK_STOP,
            "vl velocity quick stop",
            Shape::Record,
            &[several("Delta speed", 5 * rpm), part(setting("Delta time", U16, 1).range(1, 65_535))],
        ),
        (
            VL_DIMENSION_FACTOR,
            "vl dimension factor",
            Shape::Array,
            &[
                part(new("vl dimension factor numerator", I32, 1).range(1, highest)),
                part(new("vl dimension factor denominator", I32, 1).range(1, highest)),
            ],
        ),
        (
            RANGE_LIMIT,
            "Position range limit",
            Shape::Array,
            &[
                part(new("Min position range limit", I32, lowest)),
                part(new("Max position range limit", I32, highest)),
            ],
        ),
        (
            SOFTWARE_LIMIT,
            "Software position limit",
            Shape::Array,
            &limits("Min position limit", "Max position limit"),
        ),
        (
            ENCODER_RESOLUTION,
            "Position encoder resolution",
            Shape::Array,
            &[
                part(new("Encoder increments", U32, i64::from(servo.encoder_counts)).constant()),
                part(new("Motor revolutions", U32, 1).constant()),
            ],
        ),
        (GEAR_RATIO, "Gear ratio", Shape::Array, &ratio("Motor revolutions", "Shaft revolutions", (1, 1))),
        (
            FEED_CONSTANT,
            "Feed constant",
            Shape::Array,
            &ratio("Feed", "Shaft revolutions", (UNITS_PER_TURN, 1)),
        ),
        (VELOCITY_FACTOR, "Velocity factor", Shape::Array, &ratio("Numerator", "Divisor", (1, 1))),
        (ACCELERATION_FACTOR, "Acceleration factor", Shape::Array, &ratio("Numerator", "Divisor", (1, 1))),
        (
            HOMING_SPEEDS,
            "Homing speeds",
            Shape::Array,
            &[
                several("Speed during search for switch", 4 * UNITS_PER_TURN),
                several("Speed during search for zero", UNITS_PER_TURN / 4),
            ],
        ),
        (
            INTERPOLATION_DATA,
            "Interpolation data record",
            Shape::Record,
            &[part(command("1st set-point", I32))],
        ),
        (
            INTERPOLATION_PERIOD,
            "Interpolation time period",
            Shape::Record,
            &[
                part(new("Interpolation time period value", U8, 1).range(1, 255)),
                part(new("Interpolation time index", I8, -3).range(-9, 0)),
            ],
        ),
    ];
    for (index, name) in [
        (ADDITIONAL_POSITION_ACTUAL, "Additional position actual value"),
        (ADDITIONAL_VELOCITY_ACTUAL, "Additional velocity actual value"),
    ] {
        dictionary.record(index + offset, name, Shape::Array, &[part(actual(name, I32))]);
    }
    for (index, name, shape, parts) in records {
        dictionary.record(index + offset, name, shape, parts);
    }
    let outputs = [part(command("Physical outputs", U32).mappable(Rpdo)), part(new("Bit mask", U32, 0))];
    dictionary.record(DIGITAL_OUTPUTS + offset, "Digital outputs", Shape::Array, &outputs);
    let methods =
        Method::ALL.map(|number| part(new("Supported homing method", I8, i64::from(number)).constant()));
    dictionary.record(SUPPORTED_HOMING_METHODS + offset, "Supported homing methods", Shape::Array, &methods);
    define_pdos(dictionary, axis);
}

/// The PDOs that most drives have to begin with: four each way, only the first of them valid, on event.
fn define_pdos(dictionary: &mut Dictionary, axis: u8) {
    let offset = u16::from(axis) * AXIS_OFFSET;
    let entry = |index: u16, bits| MappingEntry::new(Mux::new(index + offset, 0), bits);
    let none = MappingEntry(0);
    let both = [
        (
            Direction::Receive,
            entry(CONTROLWORD, 16),
            [(MODE, 8), (TARGET_POSITION, 32), (TARGET_VELOCITY, 32)],
        ),
        (
            Direction::Transmit,
            entry(STATUSWORD, 16),
            [(MODE_DISPLAY, 8), (POSITION_ACTUAL, 32), (VELOCITY_ACTUAL, 32)],
        ),
    ];
    for (direction, word, others) in both {
        let first = if direction == Direction::Receive { 0x200 } else { 0x180 };
        let others = others.map(|(index, bits)| entry(index, bits));
        for (number, other) in (0..4_u16).zip([none].into_iter().chain(others)) {
            // Only the first four PDOs of a device have identifiers by default.
            let base = (axis == 0).then_some(first + 0x100 * number);
            let preset = Preset {
                direction,
                offset: u16::from(axis) * AXIS_STEP + number,
                base,
                valid: axis == 0 && number == 0,
                entries: [word, other, none],
            };
            pdo::define(dictionary, &preset);
        }
    }
}
