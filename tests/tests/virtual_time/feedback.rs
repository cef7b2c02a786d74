//! Feedback Mode (42), Feedback Master Select (43) and Feedback Unit Ratio (44): whose encoder the position of an axis is of, and over
//! which the drive closes its loop. The encoder of the load is a quarter of a turn ahead of the motor's.

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{BOX, CONTROLLER, Rig, Settings};
use profile_cip::controller::{AxisSet, Failure, Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::codes::{FeedbackMode, FeedbackSource};
use profile_generic::quantity::Position;
use profile_sercos::wire::idn::Idn;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: u8 = 0;
const INVALID_VALUE: u8 = 0x09;
const STATE_CONFLICT: u8 = 0x0C;
const NOT_SUPPORTED: u8 = 0x14;

const TURNTABLE: u8 = 1;

const SLIP: i64 = NANO / 4;

/// 0.0001 degree, in nanounits.
const LSB: i64 = 278;

mod id {
    pub const MASTER_SELECT: u16 = 43;
    pub const UNIT_RATIO: u16 = 44;
    pub const POSITION: u16 = 434;
    pub const MOTOR_ENCODER: u16 = 1402;
    pub const LOAD_ENCODER: u16 = 1452;
}

fn with(configuration: &str, keys: &str) -> String {
    configuration.replacen("instance = 1\n", &format!("instance = 1\n{keys}\n"), 1)
}

/// A SERCOS box whose turntable has these keys, and whose load is ahead.
fn sercos(keys: &str) -> Rig {
    let mut rig = Rig::new(Settings { configuration: with(BOX, keys), ..Settings::default() });
    rig.drive_mut(0).set_slip(Position(SLIP));
    rig.until_ready();
    rig
}

/// The same with CANopen drives.
fn canopen(keys: &str) -> Rig {
    let mut rig = Rig::new(Settings::without_line(with(include_str!("can.toml"), keys)));
    let node = rig.can[0].bus.nodes_mut().next().expect("the turntable");
    node.application_mut().axes_mut()[0].set_slip(Position(SLIP));
    rig.until_ready();
    rig
}

/// A turn with a Feedback Mode, and then nothing for so many seconds.
fn turn_with(source: FeedbackSource, seconds: f64) -> Vec<Step> {
    vec![
        Step::Feedback { axis: TURNTABLE, mode: FeedbackMode(source.0) },
        Step::Enable(AxisSet::first(1)),
        Step::MoveRelative {
            axis: TURNTABLE,
            distance: 1.0,
            limits: Limits { velocity: 2.0, acceleration: 20.0, jerk: 400.0 },
        },
        Step::Dwell { seconds },
        Step::Disable(AxisSet::first(1)),
    ]
}

fn idn(rig: &Rig, number: u16) -> i64 {
    rig.line.slaves()[0].store().number_of(Idn::standard(number))
}

fn counts(rig: &mut Rig, client: &Client, id: u16) -> Result<i64, u8> {
    let (status, value) = client.ask(rig, GET, TURNTABLE, Some(id), &[]);
    if status == OK {
        Ok(i64::from(i32::from_le_bytes(value.try_into().expect("a DINT"))))
    } else {
        Err(status)
    }
}

/// Whether a Feedback Mode is refused with 0x09 when the axis is enabled, and nothing moves.
fn is_refused(mut rig: Rig, source: FeedbackSource) -> bool {
    rig.connect(turn_with(source, 0.1));
    let report = rig.run(millis(20_000));
    let Some(Failure::RequestRefused { axis: TURNTABLE, status, .. }) = report.failure else { return false };
    assert!(status == INVALID_VALUE && rig.torque_free());
    true
}

#[test]
fn drive_closes_its_loop_over_the_encoder_that_the_feedback_mode_names() {
    for (keys, source, code, ahead) in [
        ("feedback = \"motor\"", FeedbackSource::MOTOR, 0x000B, 0),
        ("feedback = \"dual\"", FeedbackSource::DUAL, 0x000C, SLIP),
        ("feedback = \"load\"", FeedbackSource::LOAD, 0x000C, SLIP),
    ] {
        let mut rig = sercos(keys);
        assert_eq!(idn(&rig, 32), code, "{keys}: operation mode of the drive");
        let from = rig.position(0);
        rig.connect(turn_with(source, 1_000.0));
        let client = Client::connect(&mut rig, CONTROLLER);
        rig.run_until(millis(20_000), keys, |rig| rig.position(0) - from > 9 * NANO / 10);
        rig.run_for(millis(2_000));
        // The axis is where its encoder is, and that has come to where the controller wants it.
        let axis = &rig.engine.axes()[0];
        let (position, command) = (axis.feedback().position.get(), axis.command().position.get());
        assert!((position - rig.position(0) - ahead).abs() <= 2 * LSB, "{keys}: {position}");
        assert!((position - command).abs() <= 20 * LSB, "{keys}: {position} {command}");
        assert!((rig.position(0) - from - NANO).abs() < NANO / 1_000, "{keys}: it has gone a turn");
        assert_eq!(idn(&rig, 386), idn(&rig, if ahead == 0 { 51 } else { 53 }), "{keys}: active feedback");
        let shown = counts(&mut rig, &client, id::POSITION).expect("a position");
        assert!((shown - position / 1_000).abs() <= 2, "{keys}: {shown}");
        // What the encoder of the motor counts does not follow from the load's.
        let motor = counts(&mut rig, &client, id::MOTOR_ENCODER);
        assert_eq!(motor == Err(NOT_SUPPORTED), ahead != 0, "{keys}: {motor:?}");
    }
}

#[test]
fn other_feedback_modes_are_refused_and_nothing_moves() {
    let all = [
        FeedbackSource::NONE,
        FeedbackSource::MASTER,
        FeedbackSource::MOTOR,
        FeedbackSource::LOAD,
        FeedbackSource::DUAL,
    ];
    for (keys, own) in [("", FeedbackSource::MOTOR), ("feedback = \"dual\"", FeedbackSource::DUAL)] {
        for source in all.into_iter().filter(|source| *source != own) {
            assert!(is_refused(sercos(keys), source), "SERCOS {keys}: {source}");
        }
    }
    // No object of CiA 402 says which encoder the drive's loop is closed over: the configuration does.
    for source in [FeedbackSource::MOTOR, FeedbackSource::DUAL] {
        assert!(is_refused(canopen("feedback = \"load\""), source), "CiA 402: {source}");
    }
    assert!(!is_refused(canopen("feedback = \"load\""), FeedbackSource::LOAD));
}

/// A drive that has no mode with feedback 2 cannot be used so.
#[test]
fn drive_without_modes_of_the_load_is_not_led_by_it() {
    let mut rig =
        Rig::new(Settings { configuration: with(BOX, "feedback = \"dual\""), ..Settings::default() });
    let codes: Vec<u8> = [1_u16, 2, 3, 0x0B].iter().flat_map(|code| code.to_le_bytes()).collect();
    rig.line.slaves_mut()[0].store_mut().set_data_of(Idn::OPERATION_MODES, &codes);
    rig.until_up();
    rig.run_for(millis(5_000));
    assert!(rig.told().contains("0x000c"), "{}", rig.told());
    rig.connect(turn_with(FeedbackSource::DUAL, 0.1));
    let report = rig.run(millis(20_000));
    assert!(report.failure.is_some() && rig.torque_free(), "{report:?}");
}

/// An axis that is never switched on shows one of the two encoders.
#[test]
fn feedback_only_axis_shows_the_encoder_of_its_master_select() {
    for (name, select, ahead) in [("motor", 1_u8, 0), ("load", 2, SLIP)] {
        let keys = format!("function = \"encoder\"\nfeedback = \"{name}\"");
        let limits = "[axis.limits]\nfollowing_error = 0.5\n";
        let of = |text: &str| with(&text.replacen(limits, "", 1), &keys);
        for is_can in [false, true] {
            let mut rig = if is_can {
                let mut rig = Rig::new(Settings::without_line(of(include_str!("can.toml"))));
                let node = rig.can[0].bus.nodes_mut().next().expect("the turntable");
                node.application_mut().axes_mut()[0].set_slip(Position(SLIP));
                rig
            } else {
                let mut rig = Rig::new(Settings { configuration: of(BOX), ..Settings::default() });
                rig.drive_mut(0).set_slip(Position(SLIP));
                rig
            };
            rig.until_ready();
            rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
            let client = Client::connect(&mut rig, CONTROLLER);
            rig.run_until(millis(20_000), "Running", |rig| {
                rig.engine.devices()[0]
                    .axis_states()
                    .next()
                    .is_some_and(|(_, state)| state == AxisState::Running)
            });
            let what = format!("{name}, CAN {is_can}");
            let motor = if is_can { 0 } else { rig.position(0) };
            let position = rig.engine.axes()[0].feedback().position.get();
            // 65536 counts in a turn on CANopen.
            assert!((position - motor - ahead).abs() <= 20_000, "{what}: {position}");
            let shown = counts(&mut rig, &client, id::POSITION).expect("a position");
            assert!((shown - position / 1_000).abs() <= 2, "{what}: {shown}");
            let (status, value) = client.ask(&mut rig, GET, TURNTABLE, Some(id::MASTER_SELECT), &[]);
            assert_eq!((status, value), (OK, vec![select]), "{what}");
            let (status, _) = client.ask(&mut rig, SET, TURNTABLE, Some(id::MASTER_SELECT), &[3 - select]);
            assert_eq!(status, STATE_CONFLICT, "{what}: it runs");
        }
    }
}

/// Five turns of the motor for two of the load.
#[test]
fn unit_ratio_is_that_of_the_gear_and_no_other_one() {
    let mut rig =
        Rig::new(Settings { configuration: with(BOX, "feedback = \"dual\""), ..Settings::default() });
    let store = rig.line.slaves_mut()[0].store_mut();
    store.set_number_of(Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR, 5);
    store.set_number_of(Idn::OUTPUT_REVOLUTIONS_OF_LOAD_GEAR, 2);
    rig.until_ready();
    rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
    let client = Client::connect(&mut rig, CONTROLLER);
    let (status, value) = client.ask(&mut rig, GET, TURNTABLE, Some(id::UNIT_RATIO), &[]);
    assert_eq!(status, OK);
    assert_eq!(value, 2.5_f32.to_le_bytes());
    for (ratio, status) in [(2.5_f32, OK), (2.4, INVALID_VALUE), (f32::NAN, INVALID_VALUE)] {
        let (found, _) = client.ask(&mut rig, SET, TURNTABLE, Some(id::UNIT_RATIO), &ratio.to_le_bytes());
        assert_eq!(found, status, "{ratio}");
    }
    assert!(counts(&mut rig, &client, id::LOAD_ENCODER).is_err(), "nobody has said what it counts");
    // A drive without an encoder of the load has no ratio of it.
    let mut rig = Rig::ready(Settings::without_line(include_str!("devicenet.toml")));
    let client = Client::connect(&mut rig, CONTROLLER);
    assert_eq!(client.ask(&mut rig, GET, TURNTABLE, Some(id::UNIT_RATIO), &[]).0, NOT_SUPPORTED);
}
