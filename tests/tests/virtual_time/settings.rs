//! Settings of the loops, of the mechanics and of what is watched: what a controller may set, and what becomes of it.

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::motion_checker::violation::Rule;
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::controller::{AttributeSet, AxisSet, Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::codes::{CommandTarget, ControlMode};
use profile_generic::fault::FaultCause;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::wire::idn::Idn;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: u8 = 0;
const INVALID_VALUE: u8 = 0x09;
const NOT_SUPPORTED: u8 = 0x14;

const TURNTABLE: u8 = 1;
const SLIDE: u8 = 2;

/// Numbers of the attributes that these tests set.
mod id {
    pub const MOTION_POLARITY: u16 = 79;
    pub const RAMP_VELOCITY_POSITIVE: u16 = 374;
    pub const RAMP_VELOCITY_NEGATIVE: u16 = 375;
    pub const RAMP_ACCELERATION: u16 = 376;
    pub const RAMP_DECELERATION: u16 = 377;
    pub const KPI: u16 = 442;
    pub const KAFF: u16 = 460;
    pub const KVI: u16 = 462;
    pub const VELOCITY_ERROR_TOLERANCE: u16 = 465;
    pub const VELOCITY_ERROR_TOLERANCE_TIME: u16 = 466;
    pub const OVERTORQUE_LIMIT: u16 = 508;
    pub const OVERTORQUE_LIMIT_TIME: u16 = 509;
    pub const LOAD_TYPE: u16 = 1370;
    pub const GEAR_INPUT: u16 = 1371;
    pub const GEAR_OUTPUT: u16 = 1372;
    pub const ACTUATOR_TYPE: u16 = 1373;
    pub const ACTUATOR_LEAD: u16 = 1374;
    pub const ACTUATOR_LEAD_UNIT: u16 = 1375;
    pub const ACTUATOR_DIAMETER: u16 = 1376;
    pub const ACTUATOR_DIAMETER_UNIT: u16 = 1377;
}

fn settings(configuration: &str) -> Settings {
    Settings::without_line(configuration)
}

/// A rig whose axes stand, with a client of their device.
pub(super) fn stopped(mut rig: Rig) -> (Rig, Client) {
    rig.connect(vec![Step::Dwell { seconds: 10_000.0 }]);
    rig.run_until(millis(20_000), "Stopped", |rig| {
        rig.engine.devices()[0].axis_states().all(|(_, state)| state == AxisState::Stopped)
    });
    let client = Client::connect(&mut rig, CONTROLLER);
    (rig, client)
}

fn real(bytes: &[u8]) -> f32 {
    f32::from_le_bytes(bytes.try_into().expect("a REAL"))
}

/// Kvi is the bandwidth of the velocity integrator, S-0-0101 its time constant in 0.1 ms.
#[test]
fn an_integrator_bandwidth_becomes_the_time_constant_of_the_drive() {
    let (mut rig, client) = stopped(Rig::ready(Settings::default()));
    let held = |rig: &Rig| rig.line.slaves()[0].store().number_of(Idn::standard(101));
    let set =
        |rig: &mut Rig, value: f32| client.ask(rig, SET, TURNTABLE, Some(id::KVI), &value.to_le_bytes()).0;
    let get = |rig: &mut Rig| {
        let (status, value) = client.ask(rig, GET, TURNTABLE, Some(id::KVI), &[]);
        assert_eq!(status, OK);
        real(&value)
    };
    assert_eq!((held(&rig), get(&mut rig)), (100, 100.0), "10 ms are 100 rad/s");
    for (bandwidth, raw, shown) in
        [(80.0, 125, 80.0), (0.0, 0, 0.0), (3.0, 3_333, 3.000_3), (20_000.0, 1, 10_000.0)]
    {
        assert_eq!(set(&mut rig, bandwidth), OK, "{bandwidth} rad/s");
        assert_eq!(held(&rig), raw, "{bandwidth} rad/s");
        assert!((get(&mut rig) - shown).abs() <= shown * 1e-6, "{bandwidth} rad/s: {}", get(&mut rig));
    }
    // A time below half a step of the drive would be none, one above its range cannot be kept, and none is below 0.
    for bandwidth in [20_001.0, 1e30, 0.3, 1e-30, -80.0, f32::NAN, f32::INFINITY] {
        assert_eq!(set(&mut rig, bandwidth), INVALID_VALUE, "{bandwidth} rad/s");
        assert_eq!(held(&rig), 1, "{bandwidth} rad/s");
    }
}

/// A drive that states no unit of S-0-0101, or one that nobody knows, has no Kvi.
#[test]
fn a_time_constant_in_a_unit_that_is_not_known_is_not_guessed() {
    for unit in ["counts", ""] {
        let mut rig = Rig::new(Settings::default());
        let time =
            Definition::value(Idn::standard(101), 0x0111_0001, "Velocity loop integral action time", 100);
        rig.line.slaves_mut()[0].store_mut().define(time.unit(unit));
        rig.until_ready();
        let (mut rig, client) = stopped(rig);
        let set = client.ask(&mut rig, SET, TURNTABLE, Some(id::KVI), &80.0_f32.to_le_bytes()).0;
        let get = client.ask(&mut rig, GET, TURNTABLE, Some(id::KVI), &[]).0;
        assert_eq!((set, get), (NOT_SUPPORTED, NOT_SUPPORTED), "`{unit}`");
        assert_eq!(rig.line.slaves()[0].store().number_of(Idn::standard(101)), 100, "as it was");
        let (status, other) = client.ask(&mut rig, GET, SLIDE, Some(id::KVI), &[]);
        assert_eq!((status, real(&other)), (OK, 100.0), "the other drive states its unit");
    }
}

/// Terms that the loops of a drive do not have are 0.
#[test]
fn a_gain_that_the_drive_does_not_have_can_be_set_to_0_only() {
    for (bus, settings) in [("SERCOS", Settings::default()), ("CANopen", settings(include_str!("can.toml")))]
    {
        let (mut rig, client) = stopped(Rig::ready(settings));
        let mut ask = |service, value: &[u8]| client.ask(&mut rig, service, TURNTABLE, Some(id::KPI), value);
        assert_eq!(ask(GET, &[]), (OK, vec![0; 4]), "{bus}");
        for (value, expected) in [
            (0.0_f32, OK),
            (-0.0, OK),
            (100.0, INVALID_VALUE),
            (1e-30, INVALID_VALUE),
            (f32::NAN, INVALID_VALUE),
        ] {
            assert_eq!(ask(SET, &value.to_le_bytes()).0, expected, "{bus} {value}");
        }
        assert_eq!(real(&ask(GET, &[]).1), 0.0, "{bus}");
        let said = "attribute 442 cannot be set to 100: the drive has 0, and only it can change that";
        assert!(rig.told().contains(said), "{bus}: {}", rig.told());
    }
    let (mut rig, client) = stopped(Rig::ready(settings(include_str!("devicenet.toml"))));
    for id in [id::KPI, id::KAFF] {
        assert_eq!(
            client.ask(&mut rig, GET, TURNTABLE, Some(id), &[]).0,
            NOT_SUPPORTED,
            "its loops are not seen"
        );
        assert_eq!(client.ask(&mut rig, SET, TURNTABLE, Some(id), &[0; 4]).0, NOT_SUPPORTED);
    }
}

/// A turntable without a gear, and a slide on a screw: of 10 mm by S-0-0123, of 5 mm by the configuration of CANopen.
#[test]
fn what_lies_between_motor_and_load_can_be_set_to_what_the_drive_has_only() {
    for (bus, settings, lead) in
        [("SERCOS", Settings::default(), 10.0_f32), ("CANopen", settings(include_str!("can.toml")), 5.0)]
    {
        let (mut rig, client) = stopped(Rig::ready(settings));
        let mut code = |axis, id, right: &[u8], wrong: &[u8]| {
            for value in wrong {
                let status = client.ask(&mut rig, SET, axis, Some(id), &[*value]).0;
                assert_eq!(status, INVALID_VALUE, "{bus} {axis} {id} {value}");
            }
            for value in right {
                assert_eq!(
                    client.ask(&mut rig, SET, axis, Some(id), &[*value]).0,
                    OK,
                    "{bus} {axis} {id} {value}"
                );
                assert_eq!(
                    client.ask(&mut rig, GET, axis, Some(id), &[]),
                    (OK, vec![*value]),
                    "{bus} {axis} {id}"
                );
            }
        };
        code(TURNTABLE, id::LOAD_TYPE, &[2, 0], &[1, 3, 4, 255]);
        code(TURNTABLE, id::ACTUATOR_TYPE, &[0], &[1, 2, 3, 4, 5]);
        code(SLIDE, id::LOAD_TYPE, &[3], &[0, 1, 2, 4]);
        code(SLIDE, id::ACTUATOR_TYPE, &[1, 2, 3, 4], &[0, 5]);
        for axis in [TURNTABLE, SLIDE] {
            code(axis, id::ACTUATOR_LEAD_UNIT, &[0], &[1]);
            code(axis, id::ACTUATOR_DIAMETER_UNIT, &[0], &[1]);
        }
        let diameter = lead / std::f32::consts::PI;
        for (axis, id, held) in [
            (TURNTABLE, id::ACTUATOR_LEAD, 0.0),
            (TURNTABLE, id::ACTUATOR_DIAMETER, 0.0),
            (SLIDE, id::ACTUATOR_LEAD, lead),
            (SLIDE, id::ACTUATOR_DIAMETER, diameter),
        ] {
            let mut ask = |service, value: &[u8]| client.ask(&mut rig, service, axis, Some(id), value);
            let (status, shown) = ask(GET, &[]);
            assert_eq!((status, real(&shown)), (OK, held), "{bus} {axis} {id}");
            for wrong in [held + 0.001, -held - 1.0, held * 2.0 + 1.0, f32::NAN] {
                assert_eq!(ask(SET, &wrong.to_le_bytes()).0, INVALID_VALUE, "{bus} {axis} {id} {wrong}");
            }
            assert_eq!(ask(SET, &held.to_le_bytes()).0, OK, "{bus} {axis} {id}");
            assert_eq!(real(&ask(GET, &[]).1), held, "{bus} {axis} {id}");
        }
        let said = format!(
            "attribute 1374 cannot be set to {}: the drive has {lead}, and only it",
            lead * 2.0 + 1.0
        );
        assert!(rig.told().contains(&said), "{bus}: {}", rig.told());
    }
    let (mut rig, client) = stopped(Rig::ready(settings(include_str!("devicenet.toml"))));
    for id in [id::LOAD_TYPE, id::ACTUATOR_TYPE, id::ACTUATOR_LEAD, id::ACTUATOR_DIAMETER] {
        assert_eq!(client.ask(&mut rig, GET, SLIDE, Some(id), &[]).0, NOT_SUPPORTED, "DeviceNet {id}");
    }
}

/// Where the controller and the drive agree on a gear of 10:1, a turn of the load is ten of the motor on the wire.
#[test]
fn a_gear_that_was_agreed_turns_the_load_as_the_controller_believes() {
    let mut rig = Rig::new(Settings::default());
    rig.line.slaves_mut()[0].preset(Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR, 10);
    rig.until_ready();
    let sent = |rig: &Rig| rig.line.slaves()[0].store().number_of(Idn::standard(47));
    assert_eq!(
        rig.line.slaves()[0].store().number_of(Idn::standard(76)) & 0x40,
        0,
        "the drive counts at the motor"
    );
    let limits = Limits { velocity: 1.0, acceleration: 10.0, jerk: 100.0 };
    rig.connect(vec![
        Step::SetAttributes {
            axis: 1,
            attributes: vec![
                AttributeSet::usint(id::LOAD_TYPE, 2),
                AttributeSet::bytes(id::GEAR_INPUT, &10_i32.to_le_bytes()),
                AttributeSet::bytes(id::GEAR_OUTPUT, &1_i32.to_le_bytes()),
            ],
        },
        Step::Enable(AxisSet::one(1)),
        Step::MoveAbsolute { axis: 1, position: 1.0, limits },
        Step::Dwell { seconds: 0.5 },
        Step::MoveAbsolute { axis: 1, position: 2.0, limits },
        Step::Dwell { seconds: 100.0 },
    ]);
    rig.run_until(millis(20_000), "the first turn", |rig| rig.report().steps_finished == 3);
    rig.run_for(millis(300));
    let first = sent(&rig);
    rig.run_until(millis(20_000), "the second turn", |rig| rig.report().steps_finished == 5);
    rig.run_for(millis(300));
    assert_eq!(sent(&rig) - first, 10 * 3_600_000, "ten turns of the motor at 0.0001 degree");
    assert_eq!(rig.report().failure, None, "{}", rig.told());
}

/// The same of a CANopen drive: its positions are those of the load (6092h), and 6063h is what its motor has turned.
#[test]
fn a_gear_of_a_canopen_drive_turns_the_load_as_the_controller_believes() {
    let mut rig = Rig::new(settings(include_str!("can.toml")));
    let dictionary = rig.can[0].bus.nodes_mut().next().expect("a drive").dictionary_mut();
    dictionary.set(0x6091, 1, 10);
    dictionary.set(0x6091, 2, 1);
    rig.until_ready();
    let positions = |rig: &Rig| {
        let dictionary = rig.can[0].bus.nodes().next().expect("a drive").dictionary();
        [0x6063, 0x6064].map(|index| dictionary.number(index, 0))
    };
    let (encoder, shaft) = {
        let dictionary = rig.can[0].bus.nodes().next().expect("a drive").dictionary();
        (dictionary.number(0x608F, 1) / dictionary.number(0x608F, 2), dictionary.number(0x6092, 1))
    };
    let limits = Limits { velocity: 1.0, acceleration: 10.0, jerk: 100.0 };
    rig.connect(vec![
        Step::SetAttributes {
            axis: 1,
            attributes: vec![
                AttributeSet::usint(id::LOAD_TYPE, 2),
                AttributeSet::bytes(id::GEAR_INPUT, &10_i32.to_le_bytes()),
                AttributeSet::bytes(id::GEAR_OUTPUT, &1_i32.to_le_bytes()),
            ],
        },
        Step::Enable(AxisSet::one(1)),
        Step::MoveAbsolute { axis: 1, position: 1.0, limits },
        Step::Dwell { seconds: 0.5 },
        Step::MoveAbsolute { axis: 1, position: 2.0, limits },
        Step::Dwell { seconds: 100.0 },
    ]);
    rig.run_until(millis(20_000), "the first turn", |rig| rig.report().steps_finished == 3);
    rig.run_for(millis(300));
    let first = positions(&rig);
    rig.run_until(millis(20_000), "the second turn", |rig| rig.report().steps_finished == 5);
    rig.run_for(millis(300));
    let [motor, load] = positions(&rig);
    let (motor, load) = (motor - first[0], load - first[1]);
    assert_eq!(rig.report().failure, None, "{}", rig.told());
    assert!((load - shaft).abs() < shaft / 500, "{load} of {shaft} in a turn of the load");
    assert!((motor - 10 * encoder).abs() < encoder / 50, "{motor} of {encoder} in a turn of the motor");
}

/// A turntable on its way with these attributes set, and its fault after a while.
fn watched(settings: Settings, attributes: Vec<AttributeSet>) -> Option<FaultCause> {
    let mut rig = Rig::ready(settings);
    rig.connect(vec![
        Step::SetAttributes { axis: 1, attributes },
        Step::Enable(AxisSet::one(1)),
        Step::Jog { axis: 1, velocity: 4.0, acceleration: 40.0, jerk: 800.0, seconds: 2.0 },
        Step::Dwell { seconds: 100.0 },
    ]);
    rig.run_until(millis(15_000), "the enable", |rig| {
        rig.report().steps_finished >= 2 || rig.engine.axes()[0].fault().is_some()
    });
    rig.motion_checker.tolerate("an axis that stops for a fault", |_| true);
    let mut fault = None;
    for _ in 0..1_500 {
        fault = fault.or(rig.engine.axes()[0].fault().map(|fault| fault.cause));
        if fault.is_some() {
            break;
        }
        rig.run_for(millis(1));
    }
    let speed = rig.engine.axes()[0].feedback().velocity.get();
    assert_eq!(fault.is_none(), speed > 3 * NANO, "{fault:?} {}", rig.told());
    fault
}

/// Exception 55: the velocity error is passed for longer than its time.
#[test]
fn a_velocity_error_beyond_its_tolerance_is_an_exception() {
    let with = |tolerance, time| {
        vec![
            AttributeSet::real(id::VELOCITY_ERROR_TOLERANCE, tolerance),
            AttributeSet::real(id::VELOCITY_ERROR_TOLERANCE_TIME, time),
        ]
    };
    for (bus, settings) in [
        ("SERCOS", Settings::default as fn() -> Settings),
        ("CANopen", || settings(include_str!("can.toml"))),
    ] {
        let error = Some(FaultCause::EXCESSIVE_VELOCITY_ERROR);
        assert_eq!(watched(settings(), with(0.002, 0.01)), error, "{bus}");
        assert_eq!(watched(settings(), with(0.002, 10.0)), None, "{bus}: for so long it is allowed");
        assert_eq!(watched(settings(), with(100.0, 0.01)), None, "{bus}: so much is allowed");
        assert_eq!(watched(settings(), with(0.0, 0.0)), None, "{bus}: never set");
    }
}

/// Exception 56: the torque is above its limit for longer than its time.
#[test]
fn a_torque_above_its_limit_is_an_exception() {
    let with = |limit, time| {
        vec![
            AttributeSet::real(id::OVERTORQUE_LIMIT, limit),
            AttributeSet::real(id::OVERTORQUE_LIMIT_TIME, time),
        ]
    };
    for (bus, settings) in [
        ("SERCOS", Settings::default as fn() -> Settings),
        ("CANopen", || settings(include_str!("can.toml"))),
    ] {
        assert_eq!(watched(settings(), with(0.5, 0.01)), Some(FaultCause::OVER_TORQUE), "{bus}");
        assert_eq!(watched(settings(), with(0.5, 10.0)), None, "{bus}: for so long it is allowed");
        assert_eq!(watched(settings(), with(900.0, 0.01)), None, "{bus}: so much is allowed");
        assert_eq!(watched(settings(), with(0.5, 0.0)), None, "{bus}: a time of 0 disables it");
    }
}

/// An LDT has settings of its own, which drives do not take: the type is refused, so that they do not apply.
#[test]
fn a_feedback_that_is_an_ldt_is_refused() {
    const FEEDBACK_TYPE: u16 = 1413;
    let (mut rig, client) = stopped(Rig::ready(Settings::default()));
    let mut set = |value| client.ask(&mut rig, SET, TURNTABLE, Some(FEEDBACK_TYPE), &[value]).0;
    for value in (0..=10).chain(12..=17) {
        assert_eq!(set(value), OK, "{value}");
    }
    assert_eq!(set(11), INVALID_VALUE, "LDT");
    assert_eq!(client.ask(&mut rig, GET, TURNTABLE, Some(FEEDBACK_TYPE), &[]), (OK, vec![17]), "as it was");
}

/// Velocities that the controller commands at once go by the ramp generator: a drive is sent no faster change, in either direction of the
/// axis. Interpolated ones pass it (5-2.6.5.4).
#[test]
fn a_velocity_that_is_commanded_at_once_goes_by_the_ramp() {
    const RAMP: [(u16, f32); 4] = [
        (id::RAMP_VELOCITY_POSITIVE, 3.0),
        (id::RAMP_VELOCITY_NEGATIVE, -2.0),
        (id::RAMP_ACCELERATION, 10.0),
        (id::RAMP_DECELERATION, 5.0),
    ];
    for (bus, settings) in [
        ("SERCOS", Settings::default as fn() -> Settings),
        ("CANopen", || settings(include_str!("can.toml"))),
        ("DeviceNet", || settings(include_str!("devicenet.toml"))),
    ] {
        for (asked, inverted) in [(4.0, 0), (4.0, 1), (-4.0, 0), (-4.0, 1)] {
            let what = format!("{bus}, {asked} rev/s, polarity {inverted}");
            let mut rig = Rig::ready(settings());
            let mut attributes: Vec<_> =
                RAMP.iter().map(|(id, value)| AttributeSet::real(*id, *value)).collect();
            attributes.push(AttributeSet::usint(id::MOTION_POLARITY, inverted));
            let mut config = rig.controller_config();
            config.axes[0].control_mode = ControlMode::VELOCITY;
            config.command_target = CommandTarget::IMMEDIATE;
            let jog = Step::Jog { axis: 1, velocity: asked, acceleration: 1e5, jerk: 1e9, seconds: 1.5 };
            let program = vec![
                Step::SetAttributes { axis: 1, attributes },
                Step::Enable(AxisSet::one(TURNTABLE)),
                jog,
                Step::Dwell { seconds: 100.0 },
            ];
            rig.motion_checker.tolerate("the ramp is slower than the controller commands", |violation| {
                matches!(violation.rule, Rule::Velocity | Rule::Acceleration)
            });
            rig.connect_with(config, program);
            // What the drive is sent, in turns per second as the controller means them.
            let turn = if inverted == 1 { -1.0 } else { 1.0 };
            #[allow(clippy::cast_precision_loss)]
            let sent = |rig: &Rig| turn * rig.engine.axes()[0].command().velocity.get() as f64 / 1e9;
            let (mut last, mut fastest, mut rise, mut fall) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
            for _ in 0..200 {
                rig.run_for(millis(40));
                let now = sent(&rig);
                let change = (now.abs() - last.abs()) / 0.04;
                (rise, fall) = (rise.max(change), fall.max(-change));
                if now.abs() > fastest.abs() {
                    fastest = now;
                }
                last = now;
            }
            let limit = if asked > 0.0 { 3.0 } else { -2.0 };
            assert!((fastest - limit).abs() < 1e-6, "{what}: {fastest}");
            assert_eq!(last, 0.0, "{what}: it has ended");
            // A cycle of up to 10 ms more than 40 ms may lie between two looks.
            assert!((9.0..=12.5).contains(&rise), "{what}: {rise} rev/s²");
            assert!((4.5..=6.25).contains(&fall), "{what}: {fall} rev/s²");
        }
    }
}
