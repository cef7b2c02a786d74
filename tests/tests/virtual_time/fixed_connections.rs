//! Drives of class SCP_FixCFG: their telegrams are what they are, and the box lays its values out as they lie there or
//! refuses the drive by name.

use axisbridge::simulate::drives::rotary;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{FIXED_BOX, Rig, Settings};
use profile_cip::controller::sets::DataSets;
use profile_cip::controller::{AxisSet, ControllerConfig, Step};
use profile_cip::wire::motion::codes::ControlMode;
use profile_generic::fault::FaultCause;
use profile_generic::time::DurationNs;
use profile_sercos::slave::communication::FixedConnection;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::{Config, Slave};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::scp::{ScpClass, ScpEntry};

const ONE: AxisSet = AxisSet::NONE.with(1);

const CLASSES: &[ScpEntry] =
    &[ScpEntry { class: ScpClass::FIX_CFG, version: 1 }, ScpEntry { class: ScpClass::SYNC, version: 1 }];

const CONTROL: Idn = Idn::standard(134);
const STATUS: Idn = Idn::standard(135);
const VELOCITY_COMMAND: Idn = Idn::standard(36);
const POSITION_COMMAND: Idn = Idn::standard(47);
const POSITION: Idn = Idn::standard(51);
const VELOCITY: Idn = Idn::standard(40);
const TORQUE: Idn = Idn::standard(84);
const TORQUE_LIMIT: Idn = Idn::standard(92);
const DISTANCE: Idn = Idn::standard(189);

const fn to(idns: &'static [Idn]) -> FixedConnection {
    FixedConnection { produces: false, idns }
}

const fn from(idns: &'static [Idn]) -> FixedConnection {
    FixedConnection { produces: true, idns }
}

/// A box whose one drive has these connections. `modes` is a line of its configuration, or nothing.
fn rig(connections: &'static [FixedConnection], modes: &str) -> Rig {
    let mut rig =
        Rig::new(Settings { configuration: format!("{FIXED_BOX}\n{modes}\n"), ..Settings::fixed() });
    let drive = Drive::new(rotary()).expect("the servo works");
    let config = Config { classes: CLASSES, fixed: connections, ..Config::default() };
    rig.line.slaves_mut()[0] = Slave::new(&config, drive);
    rig.line.mend(0);
    rig
}

fn velocity_controller(rig: &Rig) -> ControllerConfig {
    let mut config = rig.controller_config();
    config.axes[0].control_mode = ControlMode::VELOCITY;
    config.axes[0].sets = DataSets::fixed(ControlMode::VELOCITY);
    config
}

/// Enables the axis in velocity control without a velocity: it stands. Then it turns as it is told.
fn is_driven_rightly(connections: &'static [FixedConnection], modes: &str) {
    let mut rig = rig(connections, modes);
    rig.until_ready();
    let config = velocity_controller(&rig);
    rig.connect_with(
        config,
        vec![
            Step::Enable(ONE),
            Step::Dwell { seconds: 1.0 },
            Step::RunAt { axis: 1, velocity: 2.0, acceleration: 4.0, jerk: 400.0 },
            Step::Dwell { seconds: 1.0 },
        ],
    );
    rig.run_until(millis(20_000), "the enable", |rig| rig.report().steps_finished == 1);
    let limit = NANO / 100;
    let mut fastest = 0;
    rig.run_until(millis(3_000), "the stand", |rig| {
        fastest = fastest.max(rig.velocity(0).abs());
        rig.report().steps_finished == 2
    });
    assert!(fastest < limit, "{connections:?}: {fastest} nanorevolutions per second without a command");
    rig.run_until(millis(10_000), "the velocity", |rig| (rig.velocity(0) - 2 * NANO).abs() < NANO / 50);
}

/// What is said when the box refuses the drive, which never gets into CP3 with connections.
fn refusal(connections: &'static [FixedConnection], modes: &str) -> String {
    let mut rig = rig(connections, modes);
    rig.run_until(DurationNs::from_secs(10), "a refusal", |rig| rig.told().contains("SCP_FixCFG"));
    let told = rig.told();
    let line = told.lines().find(|line| line.contains("SCP_FixCFG"));
    line.expect("the refusal").to_owned()
}

#[test]
fn velocity_list_of_a_fixcfg_slave_is_filled_in_its_order() {
    let only = "modes = [\"velocity\"]";
    is_driven_rightly(
        const { &[to(&[CONTROL, VELOCITY_COMMAND]), from(&[STATUS, POSITION, VELOCITY])] },
        only,
    );
    // Modes that the lists do not serve are left out where the configuration names none.
    is_driven_rightly(const { &[to(&[CONTROL, VELOCITY_COMMAND]), from(&[STATUS, POSITION, VELOCITY])] }, "");
    // Values before the words.
    is_driven_rightly(
        const { &[to(&[VELOCITY_COMMAND, CONTROL]), from(&[POSITION, TORQUE, STATUS, VELOCITY])] },
        only,
    );
    // A value that nobody asked for, and the connections the other way round.
    is_driven_rightly(
        const { &[from(&[STATUS, DISTANCE, POSITION, VELOCITY]), to(&[CONTROL, VELOCITY_COMMAND])] },
        only,
    );
}

#[test]
fn fixcfg_slave_whose_lists_do_not_serve_the_modes_is_refused_by_name() {
    const ACTUAL: FixedConnection = from(&[STATUS, POSITION, VELOCITY]);
    let velocity = "modes = [\"velocity\"]";
    let cases: [(&'static [FixedConnection], &str); 6] = [
        (const { &[to(&[CONTROL, POSITION_COMMAND]), ACTUAL] }, velocity),
        (const { &[to(&[CONTROL, VELOCITY_COMMAND, TORQUE_LIMIT]), ACTUAL] }, ""),
        (const { &[to(&[CONTROL, VELOCITY_COMMAND, POSITION_COMMAND]), ACTUAL] }, velocity),
        (const { &[to(&[VELOCITY_COMMAND]), ACTUAL] }, ""),
        (const { &[to(&[CONTROL, VELOCITY_COMMAND]), from(&[POSITION, VELOCITY])] }, ""),
        (const { &[to(&[CONTROL, VELOCITY_COMMAND, VELOCITY_COMMAND]), ACTUAL] }, ""),
    ];
    let told: Vec<_> = cases.into_iter().map(|(connections, modes)| refusal(connections, modes)).collect();
    println!("{} rows", told.len());
    insta::assert_snapshot!(told.join("\n"));
}

/// Nothing but another configuration helps: the drive is looked at less and less often, no command is executed in it again, and no
/// cycle runs without anybody in it.
#[test]
fn drive_that_is_refused_for_what_it_is_gets_left_alone_for_longer_and_longer() {
    let connections = const { &[to(&[VELOCITY_COMMAND]), from(&[STATUS, POSITION, VELOCITY])] };
    let mut rig = rig(connections, "");
    let refusals = |rig: &Rig| rig.told().matches("SCP_FixCFG").count();
    rig.run_until(DurationNs::from_secs(10), "a refusal", |rig| refusals(rig) == 1);
    // An error that is gone: S-0-0099 would clear it.
    let drive = rig.line.slaves_mut()[0].application_mut();
    drive.raise_fault(FaultCause::OVER_CURRENT);
    drive.clear_fault(FaultCause::OVER_CURRENT);
    let begin = rig.now();
    let mut at = Vec::new();
    for known in 1..6 {
        rig.run_until(DurationNs::from_secs(60), "the next refusal", |rig| refusals(rig) > known);
        at.push(rig.now().since(begin).0 / 1_000_000_000);
    }
    let pauses: Vec<_> = at.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(
        pauses.iter().zip([4, 8, 16, 32]).all(|(pause, least)| (least..least + 2).contains(pause)),
        "{pauses:?}"
    );
    assert!(rig.line.slaves()[0].application().actual().fault.is_some(), "S-0-0099 was executed");
    assert_eq!(rig.told().matches("no slave is left that can be used").count(), 5, "{}", rig.told());
    assert!(!rig.told().contains("found none"), "{}", rig.told());
}
