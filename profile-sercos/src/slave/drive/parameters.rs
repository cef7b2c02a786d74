//! The parameters of the drive profile, with element 3 as live drives show it.

use profile_generic::scaling::UnitKind;
use profile_generic::servo::ServoParameters;

use super::super::parameter::{Cyclic, Definition, Store};
use super::scaling::Scales;
use crate::wire::idn::Idn;

/// S-0-1302.0.1 of a drive.
const FSP_DRIVE: i64 = 2;

/// Operation modes: torque, velocity, position with and without following distance, the same with drive-controlled
/// interpolation.
pub const MODES: [u16; 10] = [0x0001, 0x0002, 0x0003, 0x000B, 0x0013, 0x001B, 0x0004, 0x000C, 0x0014, 0x001C];

/// S-0-0038: positive velocity limit value.
pub const POSITIVE_VELOCITY_LIMIT: Idn = Idn::standard(38);
/// S-0-0039: negative velocity limit value.
pub const NEGATIVE_VELOCITY_LIMIT: Idn = Idn::standard(39);
/// S-0-0157: velocity window.
pub const VELOCITY_WINDOW: Idn = Idn::standard(157);
/// S-0-0203: amplifier shut-down temperature.
pub const AMPLIFIER_SHUT_DOWN_TEMPERATURE: Idn = Idn::standard(203);
/// S-0-0204: motor shut-down temperature.
pub const MOTOR_SHUT_DOWN_TEMPERATURE: Idn = Idn::standard(204);
/// S-0-0381: DC bus current.
pub const DC_BUS_CURRENT: Idn = Idn::standard(381);
/// S-0-0382: DC bus power.
pub const DC_BUS_POWER: Idn = Idn::standard(382);

/// Element 3: unsigned, signed or bits; written in CP2 and CP3, at any time, or never.
mod attribute {
    pub const BITS: u32 = 0x7001_0001;
    pub const BITS_CP2_CP3: u32 = 0x4001_0001;
    pub const U16_CP2_CP3: u32 = 0x4011_0001;
    pub const I16_CP2_CP3: u32 = 0x4021_0001;
    pub const U32_CP2_CP3: u32 = 0x4012_0001;
    pub const FEED: u32 = 0x4422_0001;
    pub const VELOCITY: u32 = 0x0322_0001;
    pub const VELOCITY_UNSIGNED: u32 = 0x0312_0001;
    pub const VELOCITY_READ: u32 = 0x7322_0001;
    pub const POSITION: u32 = 0x0422_0001;
    pub const POSITION_READ: u32 = 0x7422_0001;
    pub const MODULO: u32 = 0x4422_0001;
    pub const TORQUE: u32 = 0x0121_0001;
    pub const TORQUE_UNSIGNED: u32 = 0x0111_0001;
    pub const TORQUE_READ: u32 = 0x7121_0001;
    pub const GAIN: u32 = 0x0211_0001;
    pub const DELAY: u32 = 0x0111_0001;
    pub const FILTER: u32 = 0x0011_0001;
    pub const CURRENT_READ: u32 = 0x7312_0001;
    pub const SPEED_READ: u32 = 0x7412_0001;
    pub const TEMPERATURE_READ: u32 = 0x7111_0001;
    pub const POWER_READ: u32 = 0x7322_0001;
    pub const U16_READ: u32 = 0x7011_0001;
    pub const VOLTAGE_READ: u32 = 0x7011_0001;
    pub const MODE_LIST: u32 = 0x7035_0001;
}

/// Fills a store with the parameters of a drive with this servo.
pub fn define(store: &mut Store, servo: &ServoParameters) {
    define_scaling(store, servo);
    define_values(store, servo);
    define_settings(store);
    preset(store, servo);
}

fn define_scaling(store: &mut Store, servo: &ServoParameters) {
    use attribute as a;
    let value = Definition::value;
    let rotary = servo.kind == UnitKind::Rotary;
    let method = if rotary { 2 } else { 1 };
    let exponent = |rotational, linear| if rotary { rotational } else { linear };
    let definitions = [
        value(Idn::POSITION_DATA_SCALING_TYPE, a::BITS_CP2_CP3, "Position data scaling type", method),
        value(
            Idn::LINEAR_POSITION_DATA_SCALING_FACTOR,
            a::U16_CP2_CP3,
            "Linear position data scaling factor",
            1,
        )
        .range(1, 0xFFFF),
        value(
            Idn::LINEAR_POSITION_DATA_SCALING_EXPONENT,
            a::I16_CP2_CP3,
            "Linear position data scaling exponent",
            -7,
        )
        .range(-32, 32),
        value(
            Idn::ROTATIONAL_POSITION_RESOLUTION,
            a::U32_CP2_CP3,
            "Rotational position resolution",
            3_600_000,
        )
        .range(1, i64::from(u32::MAX)),
        value(Idn::VELOCITY_DATA_SCALING_TYPE, a::BITS_CP2_CP3, "Velocity data scaling type", method),
        value(Idn::VELOCITY_DATA_SCALING_FACTOR, a::U16_CP2_CP3, "Velocity data scaling factor", 1)
            .range(1, 0xFFFF),
        value(
            Idn::VELOCITY_DATA_SCALING_EXPONENT,
            a::I16_CP2_CP3,
            "Velocity data scaling exponent",
            exponent(-4, -6),
        )
        .range(-32, 32),
        value(Idn::ACCELERATION_DATA_SCALING_TYPE, a::BITS_CP2_CP3, "Acceleration data scaling type", method),
        value(Idn::ACCELERATION_DATA_SCALING_FACTOR, a::U16_CP2_CP3, "Acceleration data scaling factor", 1)
            .range(1, 0xFFFF),
        value(
            Idn::ACCELERATION_DATA_SCALING_EXPONENT,
            a::I16_CP2_CP3,
            "Acceleration data scaling exponent",
            exponent(-3, -6),
        )
        .range(-32, 32),
        value(Idn::TORQUE_FORCE_DATA_SCALING_TYPE, a::BITS_CP2_CP3, "Torque/force data scaling type", 0),
        value(Idn::TORQUE_FORCE_DATA_SCALING_FACTOR, a::U16_CP2_CP3, "Torque/force data scaling factor", 1)
            .range(1, 0xFFFF),
        value(
            Idn::TORQUE_FORCE_DATA_SCALING_EXPONENT,
            a::I16_CP2_CP3,
            "Torque/force data scaling exponent",
            -1,
        )
        .range(-32, 32),
        value(Idn::MODULO, a::MODULO, "Modulo value", 3_600_000).range(2, i64::from(i32::MAX)),
        value(Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR, a::U32_CP2_CP3, "Input revolutions of load gear", 1)
            .unit("Rev")
            .range(1, i64::from(u32::MAX)),
        value(Idn::OUTPUT_REVOLUTIONS_OF_LOAD_GEAR, a::U32_CP2_CP3, "Output revolutions of load gear", 1)
            .unit("Rev")
            .range(1, i64::from(u32::MAX)),
        value(Idn::FEED_CONSTANT, a::FEED, "Feed constant", 100_000)
            .unit("mm/Rev")
            .range(1, i64::from(i32::MAX)),
        value(Idn::TEMPERATURE_DATA_SCALING_TYPE, a::BITS_CP2_CP3, "Temperature data scaling type", 0),
        value(Idn::VELOCITY_POLARITY_PARAMETER, a::BITS_CP2_CP3, "Velocity polarity parameter", 0),
        value(Idn::POSITION_POLARITY_PARAMETERS, a::BITS_CP2_CP3, "Position polarity parameter", 0),
        value(Idn::TORQUE_POLARITY_PARAMETER, a::BITS_CP2_CP3, "Torque/force polarity parameter", 0),
    ];
    for definition in definitions {
        store.define(definition);
    }
}

fn define_values(store: &mut Store, servo: &ServoParameters) {
    use Cyclic::{Both, Command, Feedback};
    use attribute as a;
    let value = |idn, attribute, name, cyclic| Definition::value(idn, attribute, name, 0).cyclic(cyclic);
    let (length, speed, force) = match servo.kind {
        UnitKind::Rotary => ("deg", "1/min", "%"),
        UnitKind::Linear => ("mm", "mm/min", "%"),
    };
    let definitions = [
        value(Idn::DRIVE_CONTROL, a::BITS, "Drive control", Command),
        value(Idn::DRIVE_STATUS, a::BITS, "Drive status", Feedback),
        value(Idn::CLASS_3_DIAGNOSTIC, a::BITS, "Class 3 diagnostics", Feedback),
        value(Idn::VELOCITY_COMMAND, a::VELOCITY, "Velocity command value", Both).unit(speed),
        value(Idn::ADDITIVE_VELOCITY_COMMAND, a::VELOCITY, "Additive velocity command value", Both)
            .unit(speed),
        value(Idn::VELOCITY_FEEDBACK_VALUE_1, a::VELOCITY_READ, "Velocity feedback value 1", Feedback)
            .unit(speed),
        value(Idn::standard(156), a::POSITION_READ, "Velocity feedback value 2", Feedback).unit(speed),
        value(Idn::POSITION_COMMAND, a::POSITION, "Position command value", Both).unit(length),
        value(Idn::ADDITIVE_POSITION_COMMAND, a::POSITION, "Additive position command value", Both)
            .unit(length),
        value(Idn::POSITION_FEEDBACK_VALUE_1, a::POSITION_READ, "Position feedback value 1", Feedback)
            .unit(length),
        value(Idn::POSITION_FEEDBACK_VALUE_2, a::POSITION_READ, "Position feedback value 2", Feedback)
            .unit(length),
        value(Idn::ACTIVE_POSITION_FEEDBACK, a::POSITION_READ, "Active position feedback value", Feedback)
            .unit(length),
        value(Idn::FOLLOWING_DISTANCE, a::POSITION_READ, "Following distance", Feedback).unit(length),
        value(Idn::TORQUE_COMMAND, a::TORQUE, "Torque/force command value", Both).unit(force),
        value(Idn::ADDITIVE_TORQUE_COMMAND, a::TORQUE, "Additive torque/force command value", Both)
            .unit(force),
        value(Idn::TORQUE_FEEDBACK, a::TORQUE_READ, "Torque/force feedback value", Feedback).unit(force),
        value(Idn::DC_BUS_VOLTAGE, a::VOLTAGE_READ, "DC bus voltage", Feedback).unit("V"),
        value(Idn::MOTOR_TEMPERATURE, a::TORQUE_READ, "Motor temperature", Feedback).unit("degC"),
        value(Idn::AMPLIFIER_TEMPERATURE, a::TORQUE_READ, "Amplifier temperature", Feedback).unit("degC"),
        value(MOTOR_SHUT_DOWN_TEMPERATURE, a::TEMPERATURE_READ, "Motor shut-down temperature", Feedback)
            .unit("degC"),
        value(DC_BUS_CURRENT, a::POWER_READ, "DC bus current", Feedback).unit("A"),
        value(DC_BUS_POWER, a::POWER_READ, "DC bus power", Feedback).unit("kW"),
        value(Idn::POSITION_FEEDBACK_VALUE_STATUS, a::BITS, "Position feedback value status", Feedback),
        value(Idn::MANUFACTURER_CLASS_1_DIAGNOSTIC, a::BITS, "Manufacturer class 1 diagnostics", Feedback),
    ];
    for definition in definitions {
        store.define(definition);
    }
    super::probe::define(store, length);
    super::homing::define(store, length, speed);
    super::memory::define(store);
    let positioning = [
        value(Idn::TARGET_POSITION, a::POSITION, "Target position", Command).unit(length),
        value(Idn::POSITIONING_VELOCITY, a::VELOCITY, "Positioning velocity", Command).unit(speed),
        value(Idn::POSITIONING_ACCELERATION, a::VELOCITY, "Positioning acceleration", Command),
        value(Idn::POSITIONING_DECELERATION, a::VELOCITY, "Positioning deceleration", Command),
        Definition::value(Idn::FEEDRATE_OVERRIDE, a::GAIN, "Feedrate override", 10_000)
            .unit("%")
            .cyclic(Command),
        Definition::value(Idn::VELOCITY_FEED_FORWARD_GAIN, a::GAIN, "Velocity feed forward gain", 10_000)
            .unit("%")
            .range(0, 10_000),
    ];
    for definition in positioning {
        store.define(definition);
    }
    let milli = |micro: i64| micro / 1_000;
    let rated = milli(servo.rated_current.0);
    let peak = rated.saturating_mul(servo.torque_limit.0) / 1_000_000;
    // From nanounits a second to 0.0001 units a minute.
    let fastest = servo.rated_velocity.0.saturating_mul(6) / 10_000;
    // The amplifier warms half as much as the motor, and is switched off with it.
    let amplifier = (servo.max_temperature.0 + servo.ambient_temperature.0) / 200;
    let data = [
        Definition::value(Idn::standard(109), a::CURRENT_READ, "Motor peak current", peak).unit("A"),
        Definition::value(Idn::standard(110), a::CURRENT_READ, "Amplifier peak current", peak).unit("A"),
        Definition::value(Idn::standard(111), a::CURRENT_READ, "Motor continuous stall current", rated)
            .unit("A"),
        Definition::value(Idn::standard(112), a::CURRENT_READ, "Amplifier rated current", rated).unit("A"),
        Definition::value(
            AMPLIFIER_SHUT_DOWN_TEMPERATURE,
            a::TEMPERATURE_READ,
            "Amplifier shut-down temperature",
            amplifier,
        )
        .unit("degC"),
        Definition::value(Idn::FSP_TYPE, a::U16_READ, "FSP type and version", FSP_DRIVE),
    ];
    for definition in data {
        store.define(definition);
    }
    if servo.kind == UnitKind::Rotary {
        // In revolutions a minute, which a linear motor does not make.
        let name = "Maximum motor speed";
        store.define(Definition::value(Idn::standard(113), a::SPEED_READ, name, fastest).unit(speed));
    }
}

fn define_settings(store: &mut Store) {
    use attribute as a;
    let value = Definition::value;
    let (double, word) = (i64::from(i32::MAX), i64::from(u16::MAX));
    let codes = MODES.iter().flat_map(|code| code.to_le_bytes()).collect::<Vec<u8>>();
    let mut definitions = vec![
        Definition::list(
            Idn::OPERATION_MODES,
            a::MODE_LIST,
            "List of supported operation modes",
            &codes,
            codes.len(),
        ),
        value(Idn::POSITIVE_POSITION_LIMIT, a::POSITION, "Positive position limit value", 0),
        value(Idn::NEGATIVE_POSITION_LIMIT, a::POSITION, "Negative position limit value", 0),
        value(Idn::POSITION_WINDOW, a::POSITION, "Position window", 1).range(1, double),
        value(Idn::BIPOLAR_VELOCITY_LIMIT, a::VELOCITY_UNSIGNED, "Bipolar velocity limit value", 1)
            .range(1, double),
        value(POSITIVE_VELOCITY_LIMIT, a::VELOCITY, "Positive velocity limit value", 1).range(1, double),
        value(NEGATIVE_VELOCITY_LIMIT, a::VELOCITY, "Negative velocity limit value", -1).range(-double, -1),
        value(VELOCITY_WINDOW, a::VELOCITY, "Velocity window", 1).range(1, double),
        value(Idn::BIPOLAR_TORQUE_LIMIT, a::TORQUE_UNSIGNED, "Bipolar torque/force limit value", 1)
            .range(1, word),
        value(Idn::POSITIVE_TORQUE_LIMIT, a::TORQUE_UNSIGNED, "Positive torque/force limit value", 1)
            .range(1, word),
        value(Idn::NEGATIVE_TORQUE_LIMIT, a::TORQUE_UNSIGNED, "Negative torque/force limit value", 1)
            .range(1, word),
        value(Idn::POSITION_LOOP_KV, a::GAIN, "Position loop Kv-factor", 1).unit("1000/min").range(1, word),
        // 10 ms; a drive in the lists of Rexroth has 0.0 to 3276.7 ms.
        value(Idn::standard(101), a::DELAY, "Velocity loop integral action time", 100)
            .unit("ms")
            .range(0, 32_767),
        value(Idn::standard(392), a::FILTER, "Velocity feedback filter", 0).unit("us").range(0, word),
        value(Idn::STANDSTILL_WINDOW, a::VELOCITY, "Standstill window", 1).range(1, double),
        value(Idn::VELOCITY_THRESHOLD, a::VELOCITY, "Velocity threshold n_x", 0).range(0, double),
        value(Idn::TORQUE_THRESHOLD, a::TORQUE_UNSIGNED, "Torque/force threshold T_x", 0).range(0, word),
        value(Idn::BIPOLAR_ACCELERATION_LIMIT, a::VELOCITY, "Bipolar acceleration limit value", 1)
            .range(1, double),
        value(Idn::ACCELERATION_LIMIT, a::VELOCITY_UNSIGNED, "Positive acceleration limit value", 1)
            .range(1, double),
        value(Idn::DECELERATION_LIMIT, a::VELOCITY_UNSIGNED, "Negative acceleration limit value", 1)
            .range(1, double),
        value(Idn::MONITORING_WINDOW, a::POSITION, "Monitoring window", 0).range(0, double),
        value(Idn::DRIVE_ON_DELAY_TIME, a::DELAY, "Drive on delay time", 0).unit("ms").range(0, word),
        value(Idn::DRIVE_OFF_DELAY_TIME, a::DELAY, "Drive off delay time", 0).unit("ms").range(0, word),
    ];
    let modes = [
        (32, "Primary operation mode"),
        (33, "Secondary operation mode 1"),
        (34, "Secondary operation mode 2"),
        (35, "Secondary operation mode 3"),
        (284, "Secondary operation mode 4"),
        (285, "Secondary operation mode 5"),
        (286, "Secondary operation mode 6"),
        (287, "Secondary operation mode 7"),
    ];
    for (block, name) in modes {
        let code = if block == 32 { i64::from(MODES[2]) } else { 0 };
        definitions.push(value(Idn::standard(block), a::BITS_CP2_CP3, name, code));
    }
    for definition in definitions {
        store.define(definition);
    }
}

/// Gives limits and windows the values of the servo, in the preset scaling.
pub(super) fn preset(store: &mut Store, servo: &ServoParameters) {
    let Ok(scales) = Scales::read(store, servo) else { return };
    for (idn, value) in [
        (Idn::BIPOLAR_VELOCITY_LIMIT, scales.velocity.counts(servo.velocity_limit.0)),
        (POSITIVE_VELOCITY_LIMIT, scales.velocity.counts(servo.velocity_limit.0)),
        (NEGATIVE_VELOCITY_LIMIT, -scales.velocity.counts(servo.velocity_limit.0)),
        (VELOCITY_WINDOW, scales.velocity.counts(servo.at_velocity_window.0)),
        (Idn::BIPOLAR_TORQUE_LIMIT, scales.torque.counts(servo.torque_limit.0)),
        (Idn::POSITIVE_TORQUE_LIMIT, scales.torque.counts(servo.torque_limit.0)),
        (Idn::NEGATIVE_TORQUE_LIMIT, scales.torque.counts(servo.torque_limit.0)),
        (Idn::ACCELERATION_LIMIT, scales.acceleration.counts(servo.deceleration_limit.0)),
        (Idn::DECELERATION_LIMIT, scales.acceleration.counts(servo.deceleration_limit.0)),
        (Idn::BIPOLAR_ACCELERATION_LIMIT, scales.acceleration.counts(servo.deceleration_limit.0)),
        (Idn::POSITION_WINDOW, scales.position.counts(servo.in_position_window.0)),
        (Idn::STANDSTILL_WINDOW, scales.velocity.counts(servo.standstill_window.0)),
        (Idn::VELOCITY_THRESHOLD, scales.velocity.counts(servo.standstill_window.0)),
        (Idn::TORQUE_THRESHOLD, scales.torque.counts(servo.torque_limit.0)),
        (Idn::MONITORING_WINDOW, scales.position.counts(servo.position_error_tolerance.0)),
        (Idn::HOMING_VELOCITY, scales.velocity.counts(servo.velocity_limit.0 / 50)),
        (Idn::HOMING_ACCELERATION, scales.acceleration.counts(servo.deceleration_limit.0 / 10)),
        (Idn::POSITIONING_VELOCITY, scales.velocity.counts(servo.velocity_limit.0 / 10)),
        (Idn::POSITIONING_ACCELERATION, scales.acceleration.counts(servo.deceleration_limit.0 / 10)),
        // 0.01 (1000/min) = 1/6 per second.
        (Idn::POSITION_LOOP_KV, servo.position_gain.saturating_mul(6) / 1_000_000),
    ] {
        store.set_number_of(idn, value);
    }
}
