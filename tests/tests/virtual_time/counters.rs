//! What an axis has done in its life (711 to 713): counted in every cycle, and gone on with after a restart.

use axisbridge::engine::axis::Totals;
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{BOX, CONTROLLER, Rig, Settings};
use profile_cip::controller::{AxisSet, Step};
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;
use profile_sercos::wire::idn::Idn;

use super::loops::near;

const GET: u8 = 0x0E;
const OK: u8 = 0;
const NOT_SUPPORTED: u8 = 0x14;

const TURNTABLE: u8 = 1;

mod id {
    pub const OUTPUT_POWER: u16 = 603;
    pub const RUN_TIME: u16 = 711;
    pub const ENERGY: u16 = 712;
    pub const MOTOR_REVS: u16 = 713;
}

const RATED_TORQUE: f64 = 2.4;

fn settings() -> Settings {
    let nameplate = format!("instance = 1\nmotor = {{ rated_torque = {RATED_TORQUE:.1} }}\n");
    Settings { configuration: BOX.replacen("instance = 1\n", &nameplate, 1), ..Settings::default() }
}

fn real(rig: &mut Rig, client: &Client, id: u16) -> Result<f64, u8> {
    let (status, value) = client.ask(rig, GET, TURNTABLE, Some(id), &[]);
    if status == OK {
        Ok(f64::from(f32::from_le_bytes(value.try_into().expect("a REAL"))))
    } else {
        Err(status)
    }
}

fn revs(rig: &mut Rig, client: &Client) -> i64 {
    let (status, value) = client.ask(rig, GET, TURNTABLE, Some(id::MOTOR_REVS), &[]);
    assert_eq!(status, OK);
    i64::from_le_bytes(value.try_into().expect("a LINT"))
}

fn number(value: i64) -> f64 {
    f64::from(i32::try_from(value).expect("32 bits"))
}

/// A gear of 5 to 2: ten turns of the load there and back are 50 of the motor. They begin with what earlier runs have counted.
#[test]
fn life_of_an_axis_is_counted_and_goes_on_after_a_restart() {
    let mut rig = Rig::new(settings());
    let before = Totals {
        run_time: DurationNs::from_secs(36_000),
        motor_turns: 1_000_000_500_000,
        motor_work: 5_000_000_000_000,
    };
    rig.engine.axes_mut()[0].begin_totals(before);
    let store = rig.line.slaves_mut()[0].store_mut();
    store.set_number_of(Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR, 5);
    store.set_number_of(Idn::OUTPUT_REVOLUTIONS_OF_LOAD_GEAR, 2);
    rig.until_ready();
    let jog =
        |velocity| Step::Jog { axis: TURNTABLE, velocity, acceleration: 20.0, jerk: 400.0, seconds: 5.0 };
    let program = vec![
        Step::Enable(AxisSet::first(1)),
        jog(2.0),
        jog(-2.0),
        Step::Disable(AxisSet::first(1)),
        Step::Dwell { seconds: 1_000.0 },
    ];
    rig.connect(program);
    let client = Client::connect(&mut rig, CONTROLLER);
    let (mut way, mut last, mut running, mut energy) = (0, None, 0_i64, 0.0);
    let step = millis(2);
    let mut stopped = 0;
    while stopped < 500 {
        rig.run_for(step);
        let axis = &rig.engine.axes()[0];
        let runs = axis.state() == DriveState::Operating;
        running += i64::from(runs);
        let (torque, speed) = (axis.feedback().torque.get(), axis.feedback().velocity.get());
        // Watts: the motor turns two and a half times as fast.
        let turns = number(speed / 1_000) / 1e6 * 2.5;
        energy += number(torque) / 1e6 * RATED_TORQUE * turns * std::f64::consts::TAU * 0.002;
        let position = axis.feedback().position.get();
        way += last.map_or(0, |last: i64| position.abs_diff(last));
        last = Some(position);
        stopped = if running > 0 && !runs { stopped + 1 } else { 0 };
    }
    assert!(way > 18_000_000_000 && energy > 0.1, "{way} {energy}");
    let totals = rig.engine.axes()[0].totals();
    let hours = 10.0 + number(running) * 0.002 / 3_600.0;
    near("hours", real(&mut rig, &client, id::RUN_TIME), hours, 2e-5);
    // The part of a turn that was there before counts as well.
    let turned = 1_000_000.5 + number(i64::try_from(way / 1_000_000).expect("64 bits")) / 1e3 * 2.5;
    let shown = number(revs(&mut rig, &client));
    assert!((shown - turned.floor()).abs() <= 1.0, "{shown} {turned}");
    let kilowatt_hours = |joules: f64| joules / 3.6e6;
    let worked = 5e6 * RATED_TORQUE * std::f64::consts::TAU;
    near("energy", real(&mut rig, &client, id::ENERGY), kilowatt_hours(worked + energy), 1e-4);
    let gained = number(totals.motor_work - before.motor_work) / 1e6 * RATED_TORQUE * std::f64::consts::TAU;
    near("what this run has given", Ok(gained), energy, energy.abs() * 0.05);
    near("no power", real(&mut rig, &client, id::OUTPUT_POWER), 0.0, 0.01);

    // It stands, and nothing goes on.
    rig.run_for(millis(3_000));
    let later = rig.engine.axes()[0].totals();
    assert_eq!(later.run_time, totals.run_time);
    assert_eq!(later.motor_turns, totals.motor_turns);
    let status = rig.status();
    assert_eq!(status.axes[0].totals, later, "it is published");
    assert_eq!(status.axes[1].totals.run_time, DurationNs::ZERO, "the slide was never on");
}

/// Without a rated torque there is no energy; without a known gear no revolutions.
#[test]
fn what_nobody_knows_is_not_counted() {
    let ask = |rig: &mut Rig, id| Client::connect(rig, CONTROLLER).ask(rig, GET, TURNTABLE, Some(id), &[]).0;
    let mut rig = Rig::ready(Settings::default());
    let seen = [id::RUN_TIME, id::ENERGY, id::MOTOR_REVS].map(|id| ask(&mut rig, id));
    assert_eq!(seen, [OK, NOT_SUPPORTED, OK]);
    let mut rig = Rig::ready(Settings::without_line(include_str!("devicenet.toml")));
    let seen = [id::RUN_TIME, id::ENERGY, id::MOTOR_REVS].map(|id| ask(&mut rig, id));
    assert_eq!(seen, [OK, NOT_SUPPORTED, NOT_SUPPORTED]);
}
