//! What the loops of a drive make: values that the drive reports, and values that Axisbridge computes from signals and settings.
//!
//! Each is compared with what the test works out from the motion that the controller asked for, or from what the simulated drive holds.

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{BOX, CONTROLLER, Rig, Settings};
use profile_cip::controller::program::{CyclicAttribute, CyclicDirection};
use profile_cip::controller::{AttributeSet, AxisSet, Limits, Step};
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::quantity::Torque;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::wire::idn::Idn;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: u8 = 0;
const DEVICE_CONFLICT: u8 = 0x10;
const NOT_SUPPORTED: u8 = 0x14;

const TURNTABLE: u8 = 1;
const SLIDE: u8 = 2;

/// Numbers of the attributes of this file.
mod id {
    pub const MOTION_POLARITY: u16 = 79;
    pub const VELOCITY_FEED_FORWARD: u16 = 433;
    pub const POSITION_ERROR: u16 = 436;
    pub const POSITION_INTEGRATOR: u16 = 437;
    pub const POSITION_LOOP: u16 = 438;
    pub const KVFF: u16 = 440;
    pub const KPP: u16 = 441;
    pub const VELOCITY_TRIM: u16 = 451;
    pub const ACCELERATION_FEED_FORWARD: u16 = 452;
    pub const VELOCITY_REFERENCE: u16 = 453;
    pub const VELOCITY_ERROR: u16 = 455;
    pub const VELOCITY_INTEGRATOR: u16 = 456;
    pub const VELOCITY_LOOP: u16 = 457;
    pub const KAFF: u16 = 460;
    pub const KVP: u16 = 461;
    pub const KJ: u16 = 496;
    pub const TORQUE_REFERENCE: u16 = 492;
    pub const TORQUE_REFERENCE_FILTERED: u16 = 493;
    pub const TORQUE_REFERENCE_LIMITED: u16 = 494;
    pub const TORQUE_LIMIT_POSITIVE: u16 = 504;
    pub const IQ_COMMAND: u16 = 520;
    pub const IQ_FEEDBACK: u16 = 529;
    pub const OUTPUT_CURRENT: u16 = 601;
    pub const OUTPUT_POWER: u16 = 603;
    pub const BUS_VOLTAGE: u16 = 620;
    pub const MOTOR_TEMPERATURE: u16 = 642;
    pub const RATED_CURRENT_OF_INVERTER: u16 = 721;
    pub const FEEDBACK_VELOCITY: u16 = 1403;
}

/// Everything that one of the loops makes.
const LOOPS: [u16; 7] = [
    id::VELOCITY_FEED_FORWARD,
    id::POSITION_ERROR,
    id::POSITION_INTEGRATOR,
    id::POSITION_LOOP,
    id::ACCELERATION_FEED_FORWARD,
    id::VELOCITY_REFERENCE,
    id::VELOCITY_ERROR,
];

/// The torque and current that are asked for.
const TORQUES: [u16; 4] =
    [id::TORQUE_REFERENCE, id::TORQUE_REFERENCE_FILTERED, id::TORQUE_REFERENCE_LIMITED, id::IQ_COMMAND];

fn settings(configuration: &str) -> Settings {
    Settings::without_line(configuration)
}

/// A rig whose controller carries out these steps, with a client of its own.
fn rig(settings: Settings, program: Vec<Step>) -> (Rig, Client) {
    let mut rig = Rig::ready(settings);
    rig.connect(program);
    let client = Client::connect(&mut rig, CONTROLLER);
    (rig, client)
}

fn get(rig: &mut Rig, client: &Client, axis: u8, id: u16) -> Result<f64, u8> {
    let (status, value) = client.ask(rig, GET, axis, Some(id), &[]);
    match status {
        OK => Ok(f32::from_le_bytes(value.try_into().expect("a REAL")).into()),
        other => Err(other),
    }
}

#[track_caller]
pub(super) fn near(what: &str, value: Result<f64, u8>, expected: f64, tolerance: f64) {
    let is_near = value.is_ok_and(|value| (value - expected).abs() <= tolerance);
    assert!(is_near, "{what}: {value:02X?}, expected {expected} within {tolerance}");
}

fn to_step(rig: &mut Rig, step: usize) {
    rig.run_until(millis(30_000), "a step of the program", |rig| rig.report().steps_finished >= step);
    assert_eq!(rig.report().failure, None, "{}", rig.log());
}

fn turn(position: f64, velocity: f64) -> Step {
    let limits = Limits { velocity, acceleration: 40.0, jerk: 800.0 };
    Step::MoveAbsolute { axis: TURNTABLE, position, limits }
}

/// The number in the store of the first SERCOS drive.
fn idn(rig: &Rig, number: u16) -> f64 {
    float(rig.line.slaves()[0].store().number_of(Idn::standard(number)))
}

/// The number of an object of a CANopen drive.
fn object(rig: &mut Rig, axis: usize, index: u16) -> f64 {
    let node = rig.can[0].bus.nodes_mut().nth(axis).expect("a device");
    float(node.dictionary().number(index, 0))
}

fn float(number: i64) -> f64 {
    f64::from(i32::try_from(number).expect("32 bits"))
}

/// A position loop of 50 1/s with half of the velocity fed forward makes the other half of 2 turns a second of an error of 0.02 turns.
#[test]
fn position_loop_of_a_sercos_drive_that_moves_and_that_stands() {
    let (mut rig, client) = rig(
        Settings::default(),
        vec![
            Step::SetAttributes { axis: TURNTABLE, attributes: vec![AttributeSet::real(id::KVFF, 50.0)] },
            Step::Enable(AxisSet::first(1)),
            Step::Dwell { seconds: 0.5 },
            turn(20.0, 2.0),
            Step::Dwell { seconds: 0.5 },
            Step::Disable(AxisSet::first(1)),
            Step::Dwell { seconds: 100.0 },
        ],
    );
    to_step(&mut rig, 3);
    rig.run_until(millis(5_000), "2 turns a second", |rig| rig.velocity(0) > 199 * NANO / 100);
    rig.run_for(millis(1_000));
    let mut read = |id| get(&mut rig, &client, TURNTABLE, id);
    near("Kpp", read(id::KPP), 50.0, 0.2);
    near("velocity feedforward command", read(id::VELOCITY_FEED_FORWARD), 1.0, 0.001);
    near("position error", read(id::POSITION_ERROR), 20_000.0, 100.0);
    near("position integrator output", read(id::POSITION_INTEGRATOR), 0.0, 0.0);
    near("position loop output", read(id::POSITION_LOOP), 1.0, 0.005);
    near("velocity reference", read(id::VELOCITY_REFERENCE), 2.0, 0.005);
    near("velocity error", read(id::VELOCITY_ERROR), 0.0, 0.01);
    near("acceleration feedforward command", read(id::ACCELERATION_FEED_FORWARD), 0.0, 0.0);
    // The drive shows no torque set-point while its own loops make it.
    for id in TORQUES {
        assert_eq!(read(id), Err(DEVICE_CONFLICT), "{id}");
    }
    // S-0-0084 in 0.1 %, S-0-0111 in mA.
    let (torque, rated) = (idn(&rig, 84) / 10.0, idn(&rig, 111) / 1_000.0);
    assert!(torque > 1.0, "friction: {torque} %");
    near("Iq current feedback", get(&mut rig, &client, TURNTABLE, id::IQ_FEEDBACK), torque, 0.2);
    near(
        "output current",
        get(&mut rig, &client, TURNTABLE, id::OUTPUT_CURRENT),
        torque / 100.0 * rated,
        rated / 500.0,
    );
    to_step(&mut rig, 4);
    rig.run_for(millis(200));
    let distance = idn(&rig, 189);
    let mut read = |id| get(&mut rig, &client, TURNTABLE, id);
    // Friction leaves a rest of the error, which the drive shows in 0.0001 degree.
    near("position error at rest", read(id::POSITION_ERROR), distance / 3.6, 3.0);
    near("position loop output at rest", read(id::POSITION_LOOP), 50.0 * distance / 3_600_000.0, 0.001);
    near("velocity feedforward command at rest", read(id::VELOCITY_FEED_FORWARD), 0.0, 0.0);
    near("velocity reference at rest", read(id::VELOCITY_REFERENCE), 0.0, 0.001);
    to_step(&mut rig, 6);
    rig.run_for(millis(100));
    for id in LOOPS.into_iter().chain(TORQUES) {
        near("without torque", get(&mut rig, &client, TURNTABLE, id), 0.0, 0.0);
    }
    assert_eq!(get(&mut rig, &client, TURNTABLE, id::VELOCITY_INTEGRATOR), Err(NOT_SUPPORTED));
}

/// With an inverted Motion Polarity the drive turns the other way: what it has behind is negative there, and positive for the controller
/// (Table 5-2.14), as the velocity of its encoder is.
#[test]
fn position_error_and_encoder_have_the_sign_of_the_controller() {
    for (bus, configuration) in [("SERCOS", None), ("CANopen", Some(include_str!("can.toml")))] {
        for polarity in [0, 1] {
            let settings = configuration.map_or_else(Settings::default, Settings::without_line);
            let mut attributes = vec![AttributeSet::usint(id::MOTION_POLARITY, polarity)];
            // A drive that feeds all of the velocity forward has nothing behind.
            attributes.extend(configuration.is_none().then(|| AttributeSet::real(id::KVFF, 0.0)));
            let (mut rig, client) = rig(
                settings,
                vec![
                    Step::SetAttributes { axis: TURNTABLE, attributes },
                    Step::Enable(AxisSet::first(1)),
                    turn(20.0, 2.0),
                    Step::Dwell { seconds: 100.0 },
                ],
            );
            rig.run_until(millis(20_000), "2 turns a second", |rig| {
                rig.engine.axes()[0].feedback().velocity.get().abs() > 199 * NANO / 100
            });
            rig.run_for(millis(1_000));
            let turns = if polarity == 0 { 1.0 } else { -1.0 };
            let speed = if configuration.is_none() { idn(&rig, 40) } else { object(&mut rig, 0, 0x606C) };
            assert!(speed * turns > 0.0, "{bus} {polarity}: {speed}");
            // The CANopen drive has nothing behind at a constant speed.
            if configuration.is_none() {
                let held = idn(&rig, 189);
                assert!(held * turns > 10_000.0, "{polarity}: {held}");
                let error = get(&mut rig, &client, TURNTABLE, id::POSITION_ERROR);
                near("position error", error, held * turns / 3.6, 100.0);
            }
            near(bus, get(&mut rig, &client, TURNTABLE, id::FEEDBACK_VELOCITY), 2.0, 0.05);
        }
    }
}

/// A trim of half a turn a second stands against the output of the position loop: together they are nothing.
#[test]
fn velocity_trim_is_part_of_the_velocity_reference() {
    let trim = |value: f32| (id::VELOCITY_TRIM, value.to_le_bytes().to_vec());
    let (number, value) = trim(0.0);
    let attributes = vec![CyclicAttribute { id: number, element_size: 4, value }];
    let (mut rig, client) = rig(
        Settings::default(),
        vec![
            Step::CyclicList { axis: TURNTABLE, direction: CyclicDirection::Write, attributes },
            Step::Enable(AxisSet::first(1)),
            Step::CyclicWrite { axis: TURNTABLE, values: vec![trim(0.5)] },
            Step::Dwell { seconds: 1.0 },
            Step::Dwell { seconds: 100.0 },
        ],
    );
    to_step(&mut rig, 4);
    let mut read = |id| get(&mut rig, &client, TURNTABLE, id);
    near("position loop output", read(id::POSITION_LOOP), -0.5, 0.005);
    near("velocity reference", read(id::VELOCITY_REFERENCE), 0.0, 0.005);
    near("position error", read(id::POSITION_ERROR), -10_000.0, 100.0);
}

#[test]
fn velocity_loop_of_a_sercos_drive() {
    let (mut rig, client) = rig(
        Settings::default(),
        vec![
            Step::Enable(AxisSet::first(1)),
            Step::Jog { axis: TURNTABLE, velocity: -4.0, acceleration: 40.0, jerk: 800.0, seconds: 5.0 },
            Step::Dwell { seconds: 100.0 },
        ],
    );
    rig.run_until(millis(10_000), "4 turns a second", |rig| rig.velocity(0) < -399 * NANO / 100);
    rig.run_for(millis(500));
    let mut read = |id| get(&mut rig, &client, TURNTABLE, id);
    near("velocity reference", read(id::VELOCITY_REFERENCE), -4.0, 0.0);
    near("velocity error", read(id::VELOCITY_ERROR), 0.0, 0.02);
    // What belongs to the position loop is nothing here.
    for id in [id::VELOCITY_FEED_FORWARD, id::POSITION_INTEGRATOR, id::POSITION_LOOP] {
        near("of the position loop", read(id), 0.0, 0.0);
    }
    // A load of twice the rated torque, that the integrator has not made up for yet: the error is what is missing.
    rig.drive_mut(0).servo_mut().set_load(Torque(2_000_000));
    rig.run_for(millis(6));
    let before = idn(&rig, 40) / 600_000.0;
    let error = get(&mut rig, &client, TURNTABLE, id::VELOCITY_ERROR);
    let after = idn(&rig, 40) / 600_000.0;
    let [least, most] =
        [(-4.0 - before).abs().min((-4.0 - after).abs()), (-4.0 - before).abs().max((-4.0 - after).abs())];
    assert!(most > 0.1, "{before} {after}");
    assert!(
        error.is_ok_and(|error| (least - 0.01..=most + 0.01).contains(&error.abs())),
        "{error:?}, {least} to {most}"
    );
    let (status, _) = client.ask(&mut rig, SET, TURNTABLE, Some(id::VELOCITY_ERROR), &[0; 4]);
    assert_eq!(status, 0x0E, "only to be read");
}

/// In torque control the set-point is the reference, and the limit of the drive holds it.
#[test]
fn torque_loop_of_a_sercos_drive() {
    let (mut rig, client) = rig(
        Settings::default(),
        vec![
            Step::SetAttributes {
                axis: TURNTABLE,
                attributes: vec![AttributeSet::real(id::TORQUE_LIMIT_POSITIVE, 5.0)],
            },
            Step::Enable(AxisSet::first(1)),
            Step::Mode { axis: TURNTABLE, mode: ControlMode::TORQUE },
            Step::Torque { axis: TURNTABLE, torque: 4.0, rate: 1_000.0, velocity_limit: 40.0 },
            Step::Dwell { seconds: 0.1 },
            Step::Torque { axis: TURNTABLE, torque: 6.0, rate: 1_000.0, velocity_limit: 40.0 },
            Step::Dwell { seconds: 100.0 },
        ],
    );
    to_step(&mut rig, 4);
    rig.run_for(millis(20));
    for id in TORQUES {
        near("below the limit", get(&mut rig, &client, TURNTABLE, id), 4.0, 0.0001);
    }
    to_step(&mut rig, 6);
    rig.run_for(millis(50));
    let mut read = |id| get(&mut rig, &client, TURNTABLE, id);
    near("torque reference", read(id::TORQUE_REFERENCE), 6.0, 0.0001);
    near("filtered", read(id::TORQUE_REFERENCE_FILTERED), 6.0, 0.0001);
    near("limited", read(id::TORQUE_REFERENCE_LIMITED), 5.0, 0.0001);
    near("Iq command", read(id::IQ_COMMAND), 5.0, 0.0001);
    near("Iq feedback: what the motor makes", read(id::IQ_FEEDBACK), 5.0, 0.1);
    near("velocity reference", read(id::VELOCITY_REFERENCE), 0.0, 0.0);
    near("velocity error", read(id::VELOCITY_ERROR), 0.0, 0.0);
}

/// Values that a SERCOS drive has, and that are in no telegram.
#[test]
fn power_stage_of_a_sercos_drive() {
    let (mut rig, client) = rig(Settings::default(), vec![Step::Dwell { seconds: 100.0 }]);
    rig.run_for(millis(1_000));
    let held = [idn(&rig, 380), idn(&rig, 383) / 10.0, idn(&rig, 112) / 1_000.0];
    assert!(held.iter().all(|value| *value > 1.0), "{held:?}");
    let ids = [id::BUS_VOLTAGE, id::MOTOR_TEMPERATURE, id::RATED_CURRENT_OF_INVERTER];
    for (id, held) in ids.into_iter().zip(held) {
        near("of the drive", get(&mut rig, &client, TURNTABLE, id), held, 0.001);
    }
    // Its profile has no rated torque.
    assert_eq!(get(&mut rig, &client, TURNTABLE, id::OUTPUT_POWER), Err(NOT_SUPPORTED));
}

const OWN_REFERENCE: &str = r#"
format = 1
overlay = "drives that report what their velocity loop follows"

[[sercos-terms.source]]
key = "D"
family = "vendor"
title = "Manual of the drive"

[[sercos-idns.idn]]
idn = "P-0-0048"
name = "Effective velocity command"
clause = "1"
length = 4
format = "signed"
scaling = "velocity"
decimals = 4
write = []
source = "D"
confidence = "medium"

[[generic-sercos.parameter]]
parameter = "velocity_reference"
idn = "P-0-0048"
direction = "from_drive"
source = "manual of the drive"
"#;

/// What a drive reports takes the place of what Axisbridge would compute, in values that are computed from it too.
#[test]
fn value_of_the_drive_goes_before_the_computed_one() {
    let mut rig = Rig::new(Settings { overlays: vec![OWN_REFERENCE], ..Settings::default() });
    let own: Idn = "P-0-0048".parse().expect("an IDN");
    // 150 revolutions a minute, in 0.0001.
    let value = Definition::value(own, 0x7422_0001, "Effective velocity command", 1_500_000);
    rig.line.slaves_mut()[0].store_mut().define(value.unit("1/min"));
    rig.until_ready();
    rig.connect(vec![Step::Enable(AxisSet::first(2)), Step::Dwell { seconds: 100.0 }]);
    let client = Client::connect(&mut rig, CONTROLLER);
    to_step(&mut rig, 1);
    rig.run_for(millis(200));
    near("velocity reference", get(&mut rig, &client, TURNTABLE, id::VELOCITY_REFERENCE), 2.5, 0.0001);
    near("velocity error", get(&mut rig, &client, TURNTABLE, id::VELOCITY_ERROR), 2.5, 0.01);
    near("of the other drive", get(&mut rig, &client, SLIDE, id::VELOCITY_REFERENCE), 0.0, 0.01);
}

/// Torque, current and power of a CANopen drive: 6074h, 6078h, 6075h, 6077h and 6076h.
#[test]
fn torque_and_power_of_a_canopen_drive_that_moves() {
    let (mut rig, client) = rig(
        settings(include_str!("can.toml")),
        vec![
            Step::Enable(AxisSet::first(2)),
            Step::Dwell { seconds: 0.5 },
            Step::Jog { axis: SLIDE, velocity: 20.0, acceleration: 100.0, jerk: 1_000.0, seconds: 5.0 },
            Step::Dwell { seconds: 1.0 },
            Step::Disable(AxisSet::first(2)),
            Step::Dwell { seconds: 100.0 },
        ],
    );
    to_step(&mut rig, 1);
    rig.run_for(millis(100));
    // In position control nothing says what the velocity loop follows.
    for id in [id::VELOCITY_REFERENCE, id::VELOCITY_ERROR] {
        assert_eq!(get(&mut rig, &client, SLIDE, id), Err(DEVICE_CONFLICT), "{id}");
    }
    for id in
        [id::VELOCITY_FEED_FORWARD, id::POSITION_LOOP, id::MOTOR_TEMPERATURE, id::RATED_CURRENT_OF_INVERTER]
    {
        assert_eq!(get(&mut rig, &client, SLIDE, id), Err(NOT_SUPPORTED), "{id}");
    }
    for id in [id::POSITION_INTEGRATOR, id::ACCELERATION_FEED_FORWARD] {
        near("no such term", get(&mut rig, &client, SLIDE, id), 0.0, 0.0);
    }
    rig.run_until(millis(10_000), "20 mm a second", |rig| {
        rig.engine.axes()[1].feedback().velocity.get() > 199 * NANO / 10
    });
    rig.run_for(millis(1_000));
    let [demand, torque, current, milliamperes, milli_nm] =
        [0x6074, 0x6077, 0x6078, 0x6075, 0x6076].map(|index| object(&mut rig, 1, index));
    assert!(demand >= 10.0 && current >= 10.0, "friction: {demand} {current}");
    let mut read = |id| get(&mut rig, &client, SLIDE, id);
    for id in TORQUES {
        near("6074", read(id), demand / 10.0, 0.31);
    }
    near("Iq current feedback", read(id::IQ_FEEDBACK), current / 10.0, 0.31);
    let amperes = current / 1_000.0 * milliamperes / 1_000.0;
    near("output current", read(id::OUTPUT_CURRENT), amperes, amperes * 0.1);
    // 20 mm a second on a screw of 5 mm are 4 turns a second.
    let watts = torque / 1_000.0 * milli_nm / 1_000.0 * std::f64::consts::TAU * 4.0;
    near("output power, kW", read(id::OUTPUT_POWER), watts / 1_000.0, watts / 10_000.0);
    near("velocity reference", read(id::VELOCITY_REFERENCE), 20.0, 0.05);
    near("velocity error", read(id::VELOCITY_ERROR), 0.0, 0.1);
    let volts = object(&mut rig, 1, 0x6079) / 1_000.0;
    assert!(volts > 100.0);
    near("DC bus voltage", get(&mut rig, &client, SLIDE, id::BUS_VOLTAGE), volts, 0.001);
    to_step(&mut rig, 5);
    rig.run_for(millis(200));
    for id in TORQUES.into_iter().chain([id::IQ_FEEDBACK, id::OUTPUT_CURRENT, id::OUTPUT_POWER]) {
        near("without torque", get(&mut rig, &client, SLIDE, id), 0.0, 0.0);
    }
}

/// The gains of the simulated drive: [`profile_generic::servo::ServoParameters`] and the feed-forward of its own object.
const GAINS: &str = "loops = { position_gain = 50.0, velocity_gain = 400.0, velocity_integral_gain = 100.0, velocity_feed_forward = 40.0 }\n";

/// A configuration whose first axis states these gains.
fn with_gains(configuration: &str) -> String {
    configuration.replacen("instance = 1\n", &format!("instance = 1\n{GAINS}"), 1)
}

/// The drive feeds 40 % of the velocity forward; its position loop makes the other 60 % of 2 turns a second of an error of 0.024 turns.
#[test]
fn loops_of_a_canopen_drive_are_computed_with_the_gains_of_the_configuration() {
    let mut rig = Rig::new(settings(&with_gains(include_str!("can.toml"))));
    let node = rig.can[0].bus.nodes_mut().next().expect("a device");
    // Its own object, in thousandths.
    node.dictionary_mut().set(0x2000, 0, 400);
    rig.until_ready();
    rig.connect(vec![
        Step::Enable(AxisSet::first(1)),
        turn(20.0, 2.0),
        Step::Disable(AxisSet::first(1)),
        Step::Dwell { seconds: 100.0 },
    ]);
    let client = Client::connect(&mut rig, CONTROLLER);
    rig.run_until(millis(20_000), "2 turns a second", |rig| {
        rig.engine.axes()[0].feedback().velocity.get() > 199 * NANO / 100
    });
    rig.run_for(millis(1_000));
    let mut read = |id| get(&mut rig, &client, TURNTABLE, id);
    near("Kvff", read(id::KVFF), 40.0, 0.0);
    near("Kpp", read(id::KPP), 50.0, 0.0);
    near("velocity feedforward command", read(id::VELOCITY_FEED_FORWARD), 0.8, 0.001);
    near("position error", read(id::POSITION_ERROR), 24_000.0, 600.0);
    near("position integrator output", read(id::POSITION_INTEGRATOR), 0.0, 0.0);
    near("position loop output", read(id::POSITION_LOOP), 1.2, 0.03);
    // What no object of the drive reports in position control comes out as what the drive does.
    near("velocity reference", read(id::VELOCITY_REFERENCE), 2.0, 0.03);
    near("velocity error", read(id::VELOCITY_ERROR), 0.0, 0.05);
    to_step(&mut rig, 3);
    rig.run_for(millis(100));
    for id in LOOPS {
        near("without torque", get(&mut rig, &client, TURNTABLE, id), 0.0, 0.0);
    }
}

/// A drive that turns steadily against its friction has no velocity error: the integrator gives all of the output of the loop.
#[test]
fn velocity_integrator_of_a_drive_that_turns_steadily_gives_the_friction() {
    let sercos = Settings { configuration: with_gains(BOX), ..Settings::default() };
    for (bus, settings) in [("SERCOS", sercos), ("CANopen", settings(&with_gains(include_str!("can.toml"))))]
    {
        let (mut rig, client) = rig(
            settings,
            vec![
                Step::Enable(AxisSet::first(1)),
                Step::Jog { axis: TURNTABLE, velocity: 4.0, acceleration: 40.0, jerk: 800.0, seconds: 9.0 },
                Step::Dwell { seconds: 100.0 },
            ],
        );
        rig.run_until(millis(10_000), "4 turns a second", |rig| {
            rig.engine.axes()[0].feedback().velocity.get() > 39 * NANO / 10
        });
        rig.run_for(millis(1_000));
        let answer = get(&mut rig, &client, TURNTABLE, id::VELOCITY_INTEGRATOR);
        assert_eq!(answer, Err(DEVICE_CONFLICT), "{bus}: without an inertia");
        let (status, _) = client.ask(&mut rig, SET, TURNTABLE, Some(id::KJ), &0.5_f32.to_le_bytes());
        assert_eq!(status, OK, "{bus}");
        rig.run_for(millis(10));
        let torque = if bus == "SERCOS" { idn(&rig, 84) } else { object(&mut rig, 0, 0x6074) } / 10.0;
        assert!(torque > 1.0, "{bus}: friction: {torque} %");
        let mut read = |id| get(&mut rig, &client, TURNTABLE, id);
        near(bus, read(id::KVP), 400.0, 0.0);
        near("velocity error", read(id::VELOCITY_ERROR), 0.0, 0.01);
        near(bus, read(id::VELOCITY_INTEGRATOR), torque / 0.5, torque * 0.2 + 400.0 * 0.01);
    }
}

/// The torque that the telegram adds for a drive: S-0-0081 in 0.1 %, or 60B2h in 0.1 %.
fn added_torque(rig: &mut Rig) -> f64 {
    if rig.can.is_empty() { idn(rig, 81) / 10.0 } else { object(rig, 0, 0x60B2) / 10.0 }
}

/// Half of what 2 turns a second squared take at 4 % for each: 4 % of the rated torque, with its sign.
#[test]
fn acceleration_is_fed_forward_as_a_torque_by_kaff_and_kj() {
    // Offsets are in a telegram of CANopen where its configuration names them.
    let drive = "name = \"drive-a\"\nnode = 1\n";
    let canopen = include_str!("can.toml").replace(drive, &format!("{drive}offsets = [\"torque\"]\n"));
    for (bus, configuration) in [("SERCOS", None), ("CANopen", Some(canopen.as_str()))] {
        let velocity = |rig: &Rig| rig.engine.axes()[0].feedback().velocity.get();
        let run = |kaff: f32, kj: f32| {
            let settings = configuration.map_or_else(Settings::default, Settings::without_line);
            let attributes = vec![AttributeSet::real(id::KAFF, kaff), AttributeSet::real(id::KJ, kj)];
            let (mut rig, client) = rig(
                settings,
                vec![
                    Step::SetAttributes { axis: TURNTABLE, attributes },
                    Step::Enable(AxisSet::first(1)),
                    Step::MoveAbsolute {
                        axis: TURNTABLE,
                        position: 6.0,
                        limits: Limits { velocity: 3.0, acceleration: 2.0, jerk: 40.0 },
                    },
                    Step::Disable(AxisSet::first(1)),
                    Step::Dwell { seconds: 100.0 },
                ],
            );
            rig.run_until(millis(10_000), "half of its speed", |rig| velocity(rig) > NANO);
            let up = added_torque(&mut rig);
            let fed = get(&mut rig, &client, TURNTABLE, id::ACCELERATION_FEED_FORWARD);
            rig.run_until(millis(10_000), "its speed", |rig| velocity(rig) > 29 * NANO / 10);
            rig.run_until(millis(10_000), "it brakes", |rig| velocity(rig) < 2 * NANO);
            let down = added_torque(&mut rig);
            to_step(&mut rig, 4);
            rig.run_for(millis(100));
            near("at rest", Ok(added_torque(&mut rig)), 0.0, 0.0);
            (up, down, fed)
        };
        let (up, down, fed) = run(50.0, 4.0);
        near(bus, Ok(up), 4.0, 0.1);
        near(bus, Ok(down), -4.0, 0.1);
        near("452", fed, 1.0, 0.02);
        let (up, down, fed) = run(0.0, 4.0);
        assert_eq!((up, down), (0.0, 0.0), "{bus}: no part of it");
        near("452 without Kaff", fed, 0.0, 0.0);
        let (up, down, _) = run(100.0, 0.0);
        assert_eq!((up, down), (0.0, 0.0), "{bus}: nothing to turn");
    }
}

/// At a constant speed the loop makes the torque of the friction: at 2 % for a turn per second squared, half as much acceleration.
#[test]
fn velocity_loop_output_is_the_torque_over_kj() {
    for (bus, configuration) in [("SERCOS", None), ("CANopen", Some(include_str!("can.toml")))] {
        let settings = configuration.map_or_else(Settings::default, Settings::without_line);
        let (mut rig, client) = rig(
            settings,
            vec![
                Step::Enable(AxisSet::first(1)),
                Step::Jog { axis: TURNTABLE, velocity: 4.0, acceleration: 40.0, jerk: 800.0, seconds: 9.0 },
                Step::Dwell { seconds: 100.0 },
            ],
        );
        rig.run_until(millis(10_000), "4 turns a second", |rig| {
            rig.engine.axes()[0].feedback().velocity.get() > 39 * NANO / 10
        });
        rig.run_for(millis(1_000));
        let answer = get(&mut rig, &client, TURNTABLE, id::VELOCITY_LOOP);
        assert_eq!(answer, Err(DEVICE_CONFLICT), "{bus}: without an inertia");
        let set =
            |rig: &mut Rig, value: f32| client.ask(rig, SET, TURNTABLE, Some(id::KJ), &value.to_le_bytes()).0;
        assert_eq!(set(&mut rig, -1.0), 0x09, "{bus}: no inertia");
        for inertia in [2.0_f32, 0.5] {
            assert_eq!(set(&mut rig, inertia), OK, "{bus}");
            rig.run_for(millis(10));
            let torque =
                if configuration.is_none() { idn(&rig, 84) } else { object(&mut rig, 0, 0x6074) } / 10.0;
            assert!(torque > 1.0, "{bus}: friction: {torque} %");
            let expected = torque / f64::from(inertia);
            near(bus, get(&mut rig, &client, TURNTABLE, id::VELOCITY_LOOP), expected, expected * 0.1 + 0.3);
        }
        assert_eq!(get(&mut rig, &client, TURNTABLE, id::VELOCITY_INTEGRATOR), Err(NOT_SUPPORTED));
    }
}

/// A drive with a feed-forward of its own gets none besides: S-0-0348 is in the unit of its maker.
#[test]
fn drive_that_feeds_the_acceleration_forward_itself_takes_no_kaff() {
    let mut rig = Rig::new(Settings::default());
    let own = Definition::value(Idn::standard(348), 0x0111_0001, "Acceleration feed forward gain", 100);
    rig.line.slaves_mut()[0].store_mut().define(own.unit("mAsec^2/rad"));
    rig.until_ready();
    rig.connect(vec![Step::Dwell { seconds: 100.0 }]);
    let client = Client::connect(&mut rig, CONTROLLER);
    rig.run_for(millis(1_000));
    for (axis, expected) in [(TURNTABLE, NOT_SUPPORTED), (SLIDE, OK)] {
        let (status, _) = client.ask(&mut rig, SET, axis, Some(id::KAFF), &50.0_f32.to_le_bytes());
        assert_eq!(status, expected, "{axis}");
    }
    assert_eq!(get(&mut rig, &client, TURNTABLE, id::KAFF), Err(NOT_SUPPORTED));
}

/// Downstream of an acting limit nobody sees how much more the loops ask for.
#[test]
fn torque_reference_of_a_canopen_drive_at_its_limit_has_no_value() {
    let (mut rig, client) = rig(
        settings(include_str!("can.toml")),
        vec![
            Step::Enable(AxisSet::first(1)),
            Step::Jog { axis: TURNTABLE, velocity: 4.0, acceleration: 40.0, jerk: 800.0, seconds: 5.0 },
            Step::Dwell { seconds: 100.0 },
        ],
    );
    rig.run_until(millis(10_000), "4 turns a second", |rig| {
        rig.engine.axes()[0].feedback().velocity.get() > 39 * NANO / 10
    });
    rig.run_for(millis(300));
    let demand = object(&mut rig, 0, 0x6074);
    near("below the limit", get(&mut rig, &client, TURNTABLE, id::TORQUE_REFERENCE), demand / 10.0, 0.31);
    let node = rig.can[0].bus.nodes_mut().next().expect("a device");
    let demand = i16::try_from(node.dictionary().number(0x6074, 0)).expect("16 bits");
    let limit = f32::from(demand) / 10.0 - 0.5;
    let (status, _) =
        client.ask(&mut rig, SET, TURNTABLE, Some(id::TORQUE_LIMIT_POSITIVE), &limit.to_le_bytes());
    assert_eq!(status, OK);
    rig.run_for(millis(20));
    for id in [id::TORQUE_REFERENCE, id::TORQUE_REFERENCE_FILTERED] {
        assert_eq!(get(&mut rig, &client, TURNTABLE, id), Err(DEVICE_CONFLICT), "{id}");
    }
    near("limited", get(&mut rig, &client, TURNTABLE, id::TORQUE_REFERENCE_LIMITED), limit.into(), 0.11);
}

/// The loops of a DeviceNet drive are those of its maker: nothing of them is known.
#[test]
fn loops_of_a_devicenet_drive_are_not_guessed() {
    let (mut rig, client) =
        rig(settings(include_str!("devicenet.toml")), vec![Step::Dwell { seconds: 100.0 }]);
    rig.run_for(millis(2_000));
    for id in LOOPS.into_iter().chain(TORQUES).chain([id::OUTPUT_CURRENT, id::OUTPUT_POWER]) {
        let answer = get(&mut rig, &client, TURNTABLE, id);
        assert_eq!(answer, Err(NOT_SUPPORTED), "{id}");
    }
}
