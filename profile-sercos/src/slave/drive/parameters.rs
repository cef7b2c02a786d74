//! The parameters of the drive profile, with element 3 as live drives show it.

use profile_generic::scaling::UnitKind;
use profile_generic::servo::ServoParameters;

use super::super::parameter::{Cyclic, Definition, Store};
use super::scaling::{Scales, idn as scaling};
use crate::wire::idn::Idn;

/// IDNs of the drive profile.
pub mod idn {
    use crate::wire::idn::Idn;

    /// Class 3 diagnostics: status.
    pub const STATUS: Idn = Idn::standard(13);
    /// Primary operation mode; the secondary ones follow.
    pub const MODE: Idn = Idn::standard(32);
    /// Velocity command value.
    pub const VELOCITY_COMMAND: Idn = Idn::standard(36);
    /// Additive velocity command value.
    pub const VELOCITY_ADDITIVE: Idn = Idn::standard(37);
    /// Velocity feedback value 1.
    pub const VELOCITY_FEEDBACK: Idn = Idn::standard(40);
    /// Velocity polarity.
    pub const VELOCITY_POLARITY: Idn = Idn::standard(43);
    /// Position command value.
    pub const POSITION_COMMAND: Idn = Idn::standard(47);
    /// Additive position command value.
    pub const POSITION_ADDITIVE: Idn = Idn::standard(48);
    /// Positive position limit.
    pub const POSITION_LIMIT_POSITIVE: Idn = Idn::standard(49);
    /// Negative position limit.
    pub const POSITION_LIMIT_NEGATIVE: Idn = Idn::standard(50);
    /// Position feedback value 1.
    pub const POSITION_FEEDBACK: Idn = Idn::standard(51);
    /// Position feedback value 2.
    pub const POSITION_FEEDBACK_2: Idn = Idn::standard(53);
    /// Position polarity.
    pub const POSITION_POLARITY: Idn = Idn::standard(55);
    /// Position window.
    pub const POSITION_WINDOW: Idn = Idn::standard(57);
    /// Torque command value.
    pub const TORQUE_COMMAND: Idn = Idn::standard(80);
    /// Additive torque command value.
    pub const TORQUE_ADDITIVE: Idn = Idn::standard(81);
    /// Torque feedback value.
    pub const TORQUE_FEEDBACK: Idn = Idn::standard(84);
    /// Torque polarity.
    pub const TORQUE_POLARITY: Idn = Idn::standard(85);
    /// Positive torque/force limit value.
    pub const TORQUE_LIMIT_POSITIVE: Idn = Idn::standard(82);
    /// Negative torque/force limit value, a magnitude.
    pub const TORQUE_LIMIT_NEGATIVE: Idn = Idn::standard(83);
    /// Positive acceleration limit value.
    pub const ACCELERATION_LIMIT_POSITIVE: Idn = Idn::standard(136);
    /// Negative acceleration limit value, a magnitude.
    pub const ACCELERATION_LIMIT_NEGATIVE: Idn = Idn::standard(137);
    /// Bipolar velocity limit.
    pub const VELOCITY_LIMIT: Idn = Idn::standard(91);
    /// Bipolar torque limit.
    pub const TORQUE_LIMIT: Idn = Idn::standard(92);
    /// Kv of the position loop.
    pub const POSITION_GAIN: Idn = Idn::standard(104);
    /// Feedrate override.
    pub const OVERRIDE: Idn = Idn::standard(108);
    /// Target position.
    pub const TARGET_POSITION: Idn = Idn::standard(258);
    /// Positioning velocity.
    pub const POSITIONING_VELOCITY: Idn = Idn::standard(259);
    /// Positioning acceleration.
    pub const POSITIONING_ACCELERATION: Idn = Idn::standard(260);
    /// Positioning deceleration; 0 takes the acceleration.
    pub const POSITIONING_DECELERATION: Idn = Idn::standard(359);
    /// Velocity feed forward gain of lag-less position control.
    pub const VELOCITY_FEED_FORWARD: Idn = Idn::standard(296);
    /// Standstill window.
    pub const STANDSTILL_WINDOW: Idn = Idn::standard(124);
    /// Velocity threshold n_x.
    pub const VELOCITY_THRESHOLD: Idn = Idn::standard(125);
    /// Torque threshold T_x.
    pub const TORQUE_THRESHOLD: Idn = Idn::standard(126);
    /// Manufacturer class 1 diagnostics.
    pub const MANUFACTURER_ERRORS: Idn = Idn::standard(129);
    /// Bipolar acceleration limit.
    pub const ACCELERATION_LIMIT: Idn = Idn::standard(138);
    /// Monitoring window of the following error.
    pub const MONITORING_WINDOW: Idn = Idn::standard(159);
    /// Following distance.
    pub const FOLLOWING_DISTANCE: Idn = Idn::standard(189);
    /// Drive-on delay.
    pub const ON_DELAY: Idn = Idn::standard(206);
    /// Drive-off delay.
    pub const OFF_DELAY: Idn = Idn::standard(207);
    /// Supported operation modes.
    pub const MODES: Idn = Idn::standard(292);
    /// DC bus voltage.
    pub const BUS_VOLTAGE: Idn = Idn::standard(380);
    /// Motor temperature.
    pub const MOTOR_TEMPERATURE: Idn = Idn::standard(383);
    /// Amplifier temperature.
    pub const AMPLIFIER_TEMPERATURE: Idn = Idn::standard(384);
    /// Active position feedback value.
    pub const ACTIVE_POSITION: Idn = Idn::standard(386);
    /// Position feedback value status.
    pub const POSITION_STATUS: Idn = Idn::standard(403);
}

/// S-0-1302.0.1 of a drive.
const FSP_DRIVE: i64 = 2;

/// Operation modes: torque, velocity, position with and without following distance, the same with drive-controlled
/// interpolation.
pub const MODES: [u16; 6] = [0x0001, 0x0002, 0x0003, 0x000B, 0x0013, 0x001B];

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
    pub const CURRENT_READ: u32 = 0x7312_0001;
    pub const SPEED_READ: u32 = 0x7412_0001;
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
        value(scaling::POSITION_TYPE, a::BITS_CP2_CP3, "Position data scaling type", method),
        value(scaling::POSITION_FACTOR, a::U16_CP2_CP3, "Linear position data scaling factor", 1)
            .range(1, 0xFFFF),
        value(scaling::POSITION_EXPONENT, a::I16_CP2_CP3, "Linear position data scaling exponent", -7)
            .range(-32, 32),
        value(scaling::POSITION_RESOLUTION, a::U32_CP2_CP3, "Rotational position resolution", 3_600_000)
            .range(1, i64::from(u32::MAX)),
        value(scaling::VELOCITY_TYPE, a::BITS_CP2_CP3, "Velocity data scaling type", method),
        value(scaling::VELOCITY_FACTOR, a::U16_CP2_CP3, "Velocity data scaling factor", 1).range(1, 0xFFFF),
        value(scaling::VELOCITY_EXPONENT, a::I16_CP2_CP3, "Velocity data scaling exponent", exponent(-4, -6))
            .range(-32, 32),
        value(scaling::ACCELERATION_TYPE, a::BITS_CP2_CP3, "Acceleration data scaling type", method),
        value(scaling::ACCELERATION_FACTOR, a::U16_CP2_CP3, "Acceleration data scaling factor", 1)
            .range(1, 0xFFFF),
        value(
            scaling::ACCELERATION_EXPONENT,
            a::I16_CP2_CP3,
            "Acceleration data scaling exponent",
            exponent(-3, -6),
        )
        .range(-32, 32),
        value(scaling::TORQUE_TYPE, a::BITS_CP2_CP3, "Torque/force data scaling type", 0),
        value(scaling::TORQUE_FACTOR, a::U16_CP2_CP3, "Torque/force data scaling factor", 1).range(1, 0xFFFF),
        value(scaling::TORQUE_EXPONENT, a::I16_CP2_CP3, "Torque/force data scaling exponent", -1)
            .range(-32, 32),
        value(scaling::MODULO, a::MODULO, "Modulo value", 3_600_000).range(2, i64::from(i32::MAX)),
        value(scaling::GEAR_INPUT, a::U32_CP2_CP3, "Input revolutions of load gear", 1)
            .unit("Rev")
            .range(1, i64::from(u32::MAX)),
        value(scaling::GEAR_OUTPUT, a::U32_CP2_CP3, "Output revolutions of load gear", 1)
            .unit("Rev")
            .range(1, i64::from(u32::MAX)),
        value(scaling::FEED_CONSTANT, a::FEED, "Feed constant", 100_000)
            .unit("mm/Rev")
            .range(1, i64::from(i32::MAX)),
        value(scaling::TEMPERATURE_TYPE, a::BITS_CP2_CP3, "Temperature data scaling type", 0),
        value(idn::VELOCITY_POLARITY, a::BITS_CP2_CP3, "Velocity polarity parameter", 0),
        value(idn::POSITION_POLARITY, a::BITS_CP2_CP3, "Position polarity parameter", 0),
        value(idn::TORQUE_POLARITY, a::BITS_CP2_CP3, "Torque/force polarity parameter", 0),
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
        value(idn::STATUS, a::BITS, "Class 3 diagnostics", Feedback),
        value(idn::VELOCITY_COMMAND, a::VELOCITY, "Velocity command value", Both).unit(speed),
        value(idn::VELOCITY_ADDITIVE, a::VELOCITY, "Additive velocity command value", Both).unit(speed),
        value(idn::VELOCITY_FEEDBACK, a::VELOCITY_READ, "Velocity feedback value 1", Feedback).unit(speed),
        value(idn::POSITION_COMMAND, a::POSITION, "Position command value", Both).unit(length),
        value(idn::POSITION_ADDITIVE, a::POSITION, "Additive position command value", Both).unit(length),
        value(idn::POSITION_FEEDBACK, a::POSITION_READ, "Position feedback value 1", Feedback).unit(length),
        value(idn::POSITION_FEEDBACK_2, a::POSITION_READ, "Position feedback value 2", Feedback).unit(length),
        value(idn::ACTIVE_POSITION, a::POSITION_READ, "Active position feedback value", Feedback)
            .unit(length),
        value(idn::FOLLOWING_DISTANCE, a::POSITION_READ, "Following distance", Feedback).unit(length),
        value(idn::TORQUE_COMMAND, a::TORQUE, "Torque/force command value", Both).unit(force),
        value(idn::TORQUE_ADDITIVE, a::TORQUE, "Additive torque/force command value", Both).unit(force),
        value(idn::TORQUE_FEEDBACK, a::TORQUE_READ, "Torque/force feedback value", Feedback).unit(force),
        value(idn::BUS_VOLTAGE, a::VOLTAGE_READ, "DC bus voltage", Feedback).unit("V"),
        value(idn::MOTOR_TEMPERATURE, a::TORQUE_READ, "Motor temperature", Feedback).unit("degC"),
        value(idn::AMPLIFIER_TEMPERATURE, a::TORQUE_READ, "Amplifier temperature", Feedback).unit("degC"),
        value(idn::POSITION_STATUS, a::BITS, "Position feedback value status", Feedback),
        value(idn::MANUFACTURER_ERRORS, a::BITS, "Manufacturer class 1 diagnostics", Feedback),
    ];
    for definition in definitions {
        store.define(definition);
    }
    super::probe::define(store, length);
    super::homing::define(store, length, speed);
    let positioning = [
        value(idn::TARGET_POSITION, a::POSITION, "Target position", Command).unit(length),
        value(idn::POSITIONING_VELOCITY, a::VELOCITY, "Positioning velocity", Command).unit(speed),
        value(idn::POSITIONING_ACCELERATION, a::VELOCITY, "Positioning acceleration", Command),
        value(idn::POSITIONING_DECELERATION, a::VELOCITY, "Positioning deceleration", Command),
        Definition::value(idn::OVERRIDE, a::GAIN, "Feedrate override", 10_000).unit("%").cyclic(Command),
        Definition::value(idn::VELOCITY_FEED_FORWARD, a::GAIN, "Velocity feed forward gain", 10_000)
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
    let data = [
        Definition::value(Idn::standard(109), a::CURRENT_READ, "Motor peak current", peak).unit("A"),
        Definition::value(Idn::standard(110), a::CURRENT_READ, "Amplifier peak current", peak).unit("A"),
        Definition::value(Idn::standard(111), a::CURRENT_READ, "Motor continuous stall current", rated)
            .unit("A"),
        Definition::value(Idn::standard(112), a::CURRENT_READ, "Amplifier rated current", rated).unit("A"),
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
        Definition::list(idn::MODES, a::MODE_LIST, "List of supported operation modes", &codes, codes.len()),
        value(idn::POSITION_LIMIT_POSITIVE, a::POSITION, "Positive position limit value", 0),
        value(idn::POSITION_LIMIT_NEGATIVE, a::POSITION, "Negative position limit value", 0),
        value(idn::POSITION_WINDOW, a::POSITION, "Position window", 1).range(1, double),
        value(idn::VELOCITY_LIMIT, a::VELOCITY_UNSIGNED, "Bipolar velocity limit value", 1).range(1, double),
        value(idn::TORQUE_LIMIT, a::TORQUE_UNSIGNED, "Bipolar torque/force limit value", 1).range(1, word),
        value(idn::TORQUE_LIMIT_POSITIVE, a::TORQUE_UNSIGNED, "Positive torque/force limit value", 1)
            .range(1, word),
        value(idn::TORQUE_LIMIT_NEGATIVE, a::TORQUE_UNSIGNED, "Negative torque/force limit value", 1)
            .range(1, word),
        value(idn::POSITION_GAIN, a::GAIN, "Position loop Kv-factor", 1).unit("1000/min").range(1, word),
        value(idn::STANDSTILL_WINDOW, a::VELOCITY, "Standstill window", 1).range(1, double),
        value(idn::VELOCITY_THRESHOLD, a::VELOCITY, "Velocity threshold n_x", 0).range(0, double),
        value(idn::TORQUE_THRESHOLD, a::TORQUE_UNSIGNED, "Torque/force threshold T_x", 0).range(0, word),
        value(idn::ACCELERATION_LIMIT, a::VELOCITY, "Bipolar acceleration limit value", 1).range(1, double),
        value(idn::ACCELERATION_LIMIT_POSITIVE, a::VELOCITY_UNSIGNED, "Positive acceleration limit value", 1)
            .range(1, double),
        value(idn::ACCELERATION_LIMIT_NEGATIVE, a::VELOCITY_UNSIGNED, "Negative acceleration limit value", 1)
            .range(1, double),
        value(idn::MONITORING_WINDOW, a::POSITION, "Monitoring window", 0).range(0, double),
        value(idn::ON_DELAY, a::DELAY, "Drive on delay time", 0).unit("ms").range(0, word),
        value(idn::OFF_DELAY, a::DELAY, "Drive off delay time", 0).unit("ms").range(0, word),
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
fn preset(store: &mut Store, servo: &ServoParameters) {
    let Ok(scales) = Scales::read(store, servo) else { return };
    for (idn, value) in [
        (idn::VELOCITY_LIMIT, scales.velocity.counts(servo.velocity_limit.0)),
        (idn::TORQUE_LIMIT, scales.torque.counts(servo.torque_limit.0)),
        (idn::TORQUE_LIMIT_POSITIVE, scales.torque.counts(servo.torque_limit.0)),
        (idn::TORQUE_LIMIT_NEGATIVE, scales.torque.counts(servo.torque_limit.0)),
        (idn::ACCELERATION_LIMIT_POSITIVE, scales.acceleration.counts(servo.deceleration_limit.0)),
        (idn::ACCELERATION_LIMIT_NEGATIVE, scales.acceleration.counts(servo.deceleration_limit.0)),
        (idn::ACCELERATION_LIMIT, scales.acceleration.counts(servo.deceleration_limit.0)),
        (idn::POSITION_WINDOW, scales.position.counts(servo.in_position_window.0)),
        (idn::STANDSTILL_WINDOW, scales.velocity.counts(servo.standstill_window.0)),
        (idn::VELOCITY_THRESHOLD, scales.velocity.counts(servo.standstill_window.0)),
        (idn::TORQUE_THRESHOLD, scales.torque.counts(servo.torque_limit.0)),
        (idn::MONITORING_WINDOW, scales.position.counts(servo.position_error_tolerance.0)),
        (super::homing::idn::VELOCITY, scales.velocity.counts(servo.velocity_limit.0 / 50)),
        (super::homing::idn::ACCELERATION, scales.acceleration.counts(servo.deceleration_limit.0 / 10)),
        (idn::POSITIONING_VELOCITY, scales.velocity.counts(servo.velocity_limit.0 / 10)),
        (idn::POSITIONING_ACCELERATION, scales.acceleration.counts(servo.deceleration_limit.0 / 10)),
        // 0.01 (1000/min) = 1/6 per second.
        (idn::POSITION_GAIN, servo.position_gain.saturating_mul(6) / 1_000_000),
    ] {
        store.set_number_of(idn, value);
    }
}
