//! What the controller has watched beside the motion: thresholds in the status, user limits with their exceptions, and what Axisbridge
//! estimates of load and use.

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{BOX, CONTROLLER, Rig, Settings};
use profile_cip::controller::{AttributeSet, AxisSet, Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_sercos::wire::idn::Idn;

use super::loops::near;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: u8 = 0;
const INVALID_VALUE: u8 = 0x09;
const STATE_CONFLICT: u8 = 0x0C;
const NOT_SUPPORTED: u8 = 0x14;

const TURNTABLE: u8 = 1;

/// Numbers of the attributes of this file.
mod id {
    pub const POSITION_ERROR_TOLERANCE_TIME: u16 = 445;
    pub const VELOCITY_THRESHOLD: u16 = 470;
    pub const VELOCITY_LIMIT_NEGATIVE: u16 = 474;
    pub const TORQUE_THRESHOLD: u16 = 507;
    pub const UNDERTORQUE_LIMIT: u16 = 510;
    pub const UNDERTORQUE_LIMIT_TIME: u16 = 511;
    pub const OPERATIVE_CURRENT_LIMIT: u16 = 521;
    pub const OUTPUT_FREQUENCY: u16 = 600;
    pub const CONVERTER_CURRENT: u16 = 605;
    pub const CONVERTER_POWER: u16 = 606;
    pub const ZERO_SPEED: u16 = 608;
    pub const MOTOR_CAPACITY: u16 = 635;
    pub const INVERTER_CAPACITY: u16 = 636;
    pub const HEATSINK_TEMPERATURE: u16 = 640;
    pub const MOTOR_TEMPERATURE: u16 = 642;
    pub const AXIS_STATUS: u16 = 651;
    pub const AXIS_ALARMS: u16 = 659;
    pub const MOTOR_FACTORY_LIMIT: u16 = 680;
    pub const INVERTER_FACTORY_LIMIT: u16 = 682;
    pub const OVERSPEED: u16 = 695;
    pub const MOTOR_OVERTEMPERATURE: u16 = 696;
    pub const INVERTER_OVERTEMPERATURE: u16 = 698;
    pub const BUS_OVERVOLTAGE: u16 = 704;
    pub const BUS_UNDERVOLTAGE: u16 = 705;
    pub const POWER_UP_TIME: u16 = 710;
}

/// Bits of Axis Status, and of Axis Alarms.
mod bit {
    pub const VELOCITY_THRESHOLD: u32 = 1 << 9;
    pub const TORQUE_THRESHOLD: u32 = 1 << 13;
    pub const MOTOR_OVERSPEED: u64 = 1 << 4;
    pub const MOTOR_OVERTEMPERATURE: u64 = 1 << 6;
    pub const INVERTER_OVERTEMPERATURE: u64 = 1 << 12;
    pub const BUS_UNDERVOLTAGE: u64 = 1 << 34;
    pub const BUS_OVERVOLTAGE: u64 = 1 << 36;
    pub const UNDERTORQUE: u64 = 1 << 57;
}

const NAMEPLATE: &str = "motor = { type = \"rotary-permanent-magnet\", rated_speed = 3000.0, poles = 8, thermal_time_constant = 1.0 }\n\
                         converter = { bus_voltage = 325.0, rated_current = 5.0, thermal_time_constant = 0.5 }\n";

/// A rig whose turntable has a nameplate.
fn ready(configuration: &str) -> Rig {
    let configuration = configuration.replacen("instance = 1\n", &format!("instance = 1\n{NAMEPLATE}"), 1);
    let settings = match configuration.contains("[south.sercos]") {
        true => Settings { configuration, ..Settings::default() },
        false => Settings::without_line(&configuration),
    };
    Rig::ready(settings)
}

/// The same, standing without torque.
fn standing(configuration: &str) -> (Rig, Client) {
    let mut rig = ready(configuration);
    rig.connect(vec![Step::Dwell { seconds: 10_000.0 }]);
    rig.run_until(millis(20_000), "Stopped", |rig| {
        rig.engine.devices()[0].axis_states().all(|(_, state)| state == AxisState::Stopped)
    });
    let client = Client::connect(&mut rig, CONTROLLER);
    (rig, client)
}

/// The same, with these attributes, on its way for long; it stands under torque for a second before.
fn turning(configuration: &str, attributes: &[(u16, f32)], alarm: Option<usize>) -> (Rig, Client) {
    let mut rig = ready(configuration);
    let limits = Limits { velocity: 2.0, acceleration: 40.0, jerk: 800.0 };
    let attributes = attributes.iter().map(|(id, value)| AttributeSet::real(*id, *value)).collect();
    rig.connect(vec![
        Step::Dwell { seconds: 0.5 },
        Step::SetAttributes { axis: TURNTABLE, attributes },
        Step::Enable(AxisSet::first(1)),
        Step::Dwell { seconds: 1.0 },
        Step::MoveAbsolute { axis: TURNTABLE, position: 2_000.0, limits },
    ]);
    rig.run_until(millis(20_000), "Stopped", |rig| {
        rig.engine.devices()[0].axis_states().all(|(_, state)| state == AxisState::Stopped)
    });
    let client = Client::connect(&mut rig, CONTROLLER);
    if let Some(exception) = alarm {
        let_alarm(&mut rig, &client, exception);
    }
    rig.run_until(millis(20_000), "torque", |rig| rig.report().steps_finished >= 3);
    assert_eq!(rig.report().failure, None, "{}", rig.told());
    (rig, client)
}

fn set(rig: &mut Rig, client: &Client, id: u16, value: f32) -> u8 {
    client.ask(rig, SET, TURNTABLE, Some(id), &value.to_le_bytes()).0
}

/// The REAL that the client was given.
fn real(value: f64) -> f32 {
    #[allow(clippy::cast_possible_truncation)]
    let real = value as f32;
    real
}

fn get(rig: &mut Rig, client: &Client, id: u16) -> Result<f64, u8> {
    let (status, value) = client.ask(rig, GET, TURNTABLE, Some(id), &[]);
    match status {
        OK => Ok(f32::from_le_bytes(value.try_into().expect("a REAL")).into()),
        other => Err(other),
    }
}

fn status(rig: &mut Rig, client: &Client) -> u32 {
    let (status, value) = client.ask(rig, GET, TURNTABLE, Some(id::AXIS_STATUS), &[]);
    assert_eq!(status, OK);
    u32::from_le_bytes(value.try_into().expect("a DWORD")) & (bit::VELOCITY_THRESHOLD | bit::TORQUE_THRESHOLD)
}

fn alarms(rig: &mut Rig, client: &Client) -> u64 {
    let (status, value) = client.ask(rig, GET, TURNTABLE, Some(id::AXIS_ALARMS), &[]);
    assert_eq!(status, OK);
    u64::from_le_bytes(value.try_into().expect("an LWORD"))
}

/// Sets the action Alarm for an exception, so that it shows and stops nothing.
fn let_alarm(rig: &mut Rig, client: &Client, exception: usize) {
    const AXIS_EXCEPTION_ACTION: u16 = 672;
    const ALARM: u8 = 1;
    let mut actions = [255_u8; 64];
    actions[exception] = ALARM;
    assert_eq!(client.ask(rig, SET, TURNTABLE, Some(AXIS_EXCEPTION_ACTION), &actions).0, OK);
}

fn speed(rig: &Rig) -> i64 {
    rig.engine.axes()[0].feedback().velocity.get()
}

fn to_speed(rig: &mut Rig) {
    rig.run_until(millis(20_000), "its speed", |rig| speed(rig) > 198 * NANO / 100);
    rig.run_for(millis(500));
}

const BUSES: [(&str, &str); 2] = [("SERCOS", BOX), ("CANopen", include_str!("can.toml"))];

/// The velocity is below its threshold until the axis turns; the torque is above its one while it turns against friction.
#[test]
fn thresholds_are_bits_of_the_axis_status() {
    for (bus, configuration) in BUSES {
        let (mut rig, client) = turning(configuration, &[], None);
        assert_eq!(status(&mut rig, &client), 0, "{bus}: never set");
        assert_eq!(set(&mut rig, &client, id::VELOCITY_THRESHOLD, 1.5), OK, "{bus}");
        assert_eq!(set(&mut rig, &client, id::TORQUE_THRESHOLD, 0.5), OK, "{bus}");
        rig.run_for(millis(20));
        assert_eq!(status(&mut rig, &client), bit::VELOCITY_THRESHOLD, "{bus}: it stands");
        to_speed(&mut rig);
        assert_eq!(status(&mut rig, &client), bit::TORQUE_THRESHOLD, "{bus}: it turns");
        assert_eq!(set(&mut rig, &client, id::VELOCITY_THRESHOLD, 2.5), OK, "{bus}");
        assert_eq!(set(&mut rig, &client, id::TORQUE_THRESHOLD, 90.0), OK, "{bus}");
        rig.run_for(millis(20));
        assert_eq!(status(&mut rig, &client), bit::VELOCITY_THRESHOLD, "{bus}: it turns slower than that");
    }
}

/// 2 turns a second are 4 % of 3000 a minute.
#[test]
fn speed_and_missing_torque_are_exceptions() {
    for (bus, configuration) in BUSES {
        for (limit, expected) in [(4.2, 0), (3.8, bit::MOTOR_OVERSPEED), (0.0, 0)] {
            let (mut rig, client) = turning(configuration, &[(id::OVERSPEED, limit)], Some(4));
            to_speed(&mut rig);
            assert_eq!(alarms(&mut rig, &client), expected, "{bus} {limit}");
            assert_eq!(set(&mut rig, &client, id::OVERSPEED, 9.0), STATE_CONFLICT, "{bus}: it runs");
        }
        let (mut rig, client) = turning(configuration, &[], Some(57));
        assert_eq!(set(&mut rig, &client, id::UNDERTORQUE_LIMIT, 90.0), OK, "{bus}");
        to_speed(&mut rig);
        assert_eq!(alarms(&mut rig, &client), 0, "{bus}: without a time");
        assert_eq!(set(&mut rig, &client, id::UNDERTORQUE_LIMIT_TIME, 3_000.0), OK, "{bus}");
        rig.run_for(millis(100));
        assert_eq!(alarms(&mut rig, &client), 0, "{bus}: for so long it may");
        assert_eq!(set(&mut rig, &client, id::UNDERTORQUE_LIMIT_TIME, 0.05), OK, "{bus}");
        rig.run_for(millis(100));
        assert_eq!(alarms(&mut rig, &client), bit::UNDERTORQUE, "{bus}");
        assert_eq!(rig.engine.axes()[0].fault(), None, "{bus}: an alarm stops nothing");
        assert!(speed(&rig) > 198 * NANO / 100, "{bus}");
    }
}

/// An exception that is a fault stops the axis, as it comes without another action.
#[test]
fn a_motor_that_is_too_fast_is_stopped() {
    let (mut rig, _) = turning(BOX, &[(id::OVERSPEED, 2.0)], None);
    rig.run_until(millis(10_000), "a fault", |rig| rig.engine.axes()[0].fault().is_some());
    let cause = rig.engine.axes()[0].fault().map(|fault| fault.cause.name());
    assert_eq!(cause, Some(Some("motor_over_speed_user_limit")));
    assert!(speed(&rig) < 12 * NANO / 10, "at about one turn a second: {}", speed(&rig));
    rig.run_until(millis(5_000), "standstill", |rig| speed(rig) == 0);
}

/// The temperatures are in no telegram: the drive is asked for them while a limit is set, and not otherwise.
#[test]
fn temperatures_and_bus_voltage_are_watched_from_what_the_drive_is_asked() {
    let (mut rig, client) = standing(BOX);
    let temperature = get(&mut rig, &client, id::MOTOR_TEMPERATURE).expect("the drive has it");
    let heatsink = get(&mut rig, &client, id::HEATSINK_TEMPERATURE).expect("the drive has it");
    let above = |value: f64| real(value) + 5.0;
    let below = |value: f64| real(value) - 5.0;
    for (id, limit, expected) in [
        (id::MOTOR_OVERTEMPERATURE, above(temperature), 0),
        (id::MOTOR_OVERTEMPERATURE, below(temperature), bit::MOTOR_OVERTEMPERATURE),
        (id::MOTOR_OVERTEMPERATURE, 0.0, 0),
        (id::INVERTER_OVERTEMPERATURE, above(heatsink), 0),
        (id::INVERTER_OVERTEMPERATURE, below(heatsink), bit::INVERTER_OVERTEMPERATURE),
        (id::INVERTER_OVERTEMPERATURE, 0.0, 0),
    ] {
        assert_eq!(set(&mut rig, &client, id, limit), OK, "{id}");
        rig.run_for(millis(1_500));
        assert_eq!(alarms(&mut rig, &client), expected, "{id} {limit}");
    }
    for (bus, configuration) in BUSES {
        let (mut rig, client) = standing(configuration);
        let volts = get(&mut rig, &client, 620).expect("the drive has it");
        let percent = real(volts / 325.0 * 100.0);
        for (id, limit, expected) in [
            (id::BUS_OVERVOLTAGE, percent + 2.0, 0),
            (id::BUS_OVERVOLTAGE, percent - 2.0, bit::BUS_OVERVOLTAGE),
            (id::BUS_OVERVOLTAGE, 0.0, 0),
            (id::BUS_UNDERVOLTAGE, percent - 2.0, 0),
            (id::BUS_UNDERVOLTAGE, percent + 2.0, bit::BUS_UNDERVOLTAGE),
            (id::BUS_UNDERVOLTAGE, 0.0, 0),
        ] {
            assert_eq!(set(&mut rig, &client, id, limit), OK, "{bus} {id}");
            rig.run_for(millis(1_500));
            assert_eq!(alarms(&mut rig, &client), expected, "{bus} {id} {limit}");
        }
    }
}

/// Without the nameplate nobody knows what a percentage of the rated speed or of the nominal voltage is.
#[test]
fn what_a_limit_is_a_part_of_has_to_be_known() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
    let client = Client::connect(&mut rig, CONTROLLER);
    for id in [id::OVERSPEED, id::ZERO_SPEED, id::BUS_OVERVOLTAGE, id::BUS_UNDERVOLTAGE] {
        assert_eq!(set(&mut rig, &client, id, 50.0), NOT_SUPPORTED, "{id}");
    }
    for id in [id::MOTOR_CAPACITY, id::INVERTER_CAPACITY, id::OUTPUT_FREQUENCY] {
        assert_eq!(get(&mut rig, &client, id), Err(NOT_SUPPORTED), "{id}");
    }
    // An axis that turns 4 % of its rated speed stands by this measure; a whole one would stand always.
    let (mut rig, client) = standing(BOX);
    assert_eq!(set(&mut rig, &client, id::ZERO_SPEED, 100.5), INVALID_VALUE);
    assert_eq!(set(&mut rig, &client, id::ZERO_SPEED, 4.0), OK);
    rig.run_for(millis(10));
    let settings = rig.engine.axes()[0].stop_settings();
    assert_eq!(settings.times.zero_speed.get(), 2 * NANO);
}

/// The drive trips at once when its monitoring window is left.
#[test]
fn a_time_that_the_drive_does_not_have_is_none() {
    let (mut rig, client) = standing(BOX);
    assert_eq!(get(&mut rig, &client, id::POSITION_ERROR_TOLERANCE_TIME), Ok(0.0));
    assert_eq!(set(&mut rig, &client, id::POSITION_ERROR_TOLERANCE_TIME, 0.0), OK);
    assert_eq!(set(&mut rig, &client, id::POSITION_ERROR_TOLERANCE_TIME, 0.1), INVALID_VALUE);
    // One limit of the profile counts in both directions.
    let (mut rig, client) = standing(include_str!("can.toml"));
    let limit = get(&mut rig, &client, id::VELOCITY_LIMIT_NEGATIVE).expect("the drive has it");
    assert!(limit < -1.0, "{limit}");
    assert_eq!(set(&mut rig, &client, id::VELOCITY_LIMIT_NEGATIVE, real(limit)), OK);
    assert_eq!(set(&mut rig, &client, id::VELOCITY_LIMIT_NEGATIVE, real(limit) / 2.0), INVALID_VALUE);
}

/// An axis that gets 2 turns a second faster each second has the same torque for long: after many time constants its use is the square of
/// that. Four pairs of poles make four times the turns.
#[test]
fn frequency_power_and_use_follow_from_the_motion() {
    let mut rig = ready(BOX);
    rig.connect(vec![
        Step::Enable(AxisSet::first(1)),
        Step::Jog { axis: TURNTABLE, velocity: 30.0, acceleration: 2.0, jerk: 100.0, seconds: 20.0 },
    ]);
    let client = Client::connect(&mut rig, CONTROLLER);
    rig.run_until(millis(30_000), "20 turns a second", |rig| speed(rig) > 20 * NANO);
    let number = |value: i64| f64::from(i32::try_from(value).expect("32 bits"));
    let store = |rig: &Rig, of| number(rig.line.slaves()[0].store().number_of(Idn::standard(of)));
    let share = number(rig.engine.axes()[0].feedback().torque.get()) / 1e6;
    assert!(share > 0.01, "{share}");
    let turns = number(speed(&rig) / 1_000) / 1e6;
    near("output frequency", get(&mut rig, &client, id::OUTPUT_FREQUENCY), 4.0 * turns, 1.0);
    near("power of the DC bus", get(&mut rig, &client, id::CONVERTER_POWER), store(&rig, 382) / 1e3, 0.002);
    assert!(store(&rig, 382) > 2.0, "W: {}", store(&rig, 382));
    near(
        "current of the DC bus",
        get(&mut rig, &client, id::CONVERTER_CURRENT),
        store(&rig, 381) / 1e3,
        0.01,
    );
    let expected = share * share * 100.0;
    near("motor capacity", get(&mut rig, &client, id::MOTOR_CAPACITY), expected, expected * 0.1);
    let ratio = store(&rig, 111) / store(&rig, 112);
    let expected = expected * ratio * ratio;
    near("inverter capacity", get(&mut rig, &client, id::INVERTER_CAPACITY), expected, expected * 0.1);
    near("motor shut-down", get(&mut rig, &client, id::MOTOR_FACTORY_LIMIT), store(&rig, 204) / 10.0, 0.01);
    let amplifier = store(&rig, 203) / 10.0;
    near("amplifier shut-down", get(&mut rig, &client, id::INVERTER_FACTORY_LIMIT), amplifier, 0.01);
    let peak = store(&rig, 109).min(store(&rig, 110)) / store(&rig, 111) * 100.0;
    near("operative current limit", get(&mut rig, &client, id::OPERATIVE_CURRENT_LIMIT), peak, 0.1);
    let since = number(rig.elapsed().0 / 1_000_000) / 1e3;
    near("time that the drive is heard", get(&mut rig, &client, id::POWER_UP_TIME), since - 1.0, 1.0);
}
