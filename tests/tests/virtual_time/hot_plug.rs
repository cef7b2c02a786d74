//! A drive is plugged in while another axis moves.

use axisbridge::engine::notice::Notice;
use axisbridge::simulate::drives::linear;
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, SLIDE, TURNTABLE, at_rest, millis};
use axisbridge_tests::rig::{BOX, CONTROLLER, Rig, Settings};
use profile_cip::controller::{AxisSet, Condition, ControllerConfig, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::codes::AxisStateCode;
use profile_generic::scaling::UnitKind;
use profile_generic::state::DriveState;
use profile_generic::time::DurationNs;
use profile_sercos::master::event::{Event, HotPlugRefusal};
use profile_sercos::slave::communication::CLASSES_WITH_HOT_PLUG;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::{Config as SlaveConfig, Slave};
use profile_sercos::wire::header::HEADER_LEN;
use profile_sercos::wire::idn::Idn;

/// A slide with SCP_HP.
fn slide(address: u16) -> Slave<Drive> {
    let config = SlaveConfig { address, classes: CLASSES_WITH_HOT_PLUG, ..SlaveConfig::default() };
    Slave::new(&config, Drive::new(linear()).expect("the servo works"))
}

/// The turntable alone, and a place for the slide.
fn settings() -> Settings {
    Settings {
        configuration: BOX.replace("address = 2", "address = 2\nhot_plug = true"),
        drives: vec![(1, UnitKind::Rotary)],
        ..Settings::default()
    }
}

/// Puts the slide behind the turntable.
fn plug(rig: &mut Rig, slave: Slave<Drive>) {
    rig.line.append(slave);
    rig.line.mend(1);
}

fn plugged(rig: &Rig) -> bool {
    rig.notices.iter().any(|notice| matches!(notice, Notice::Sercos(Event::HotPlugged { address: 2, .. })))
}

/// The turntable goes a long way; meanwhile the slide is waited for, enabled and moved.
fn program() -> Vec<Step> {
    let slide = vec![
        Step::Within {
            time_out: DurationNs::from_secs(30),
            step: Box::new(Step::Expect {
                condition: Condition::State { axis: 2, state: AxisStateCode::STOPPED },
                within: DurationNs::from_secs(30),
            }),
        },
        Step::Enable(AxisSet::one(2)),
        Step::MoveAbsolute { axis: 2, position: 60.0, limits: SLIDE },
        Step::WaitInWindow { axis: 2, window: 0.02, seconds: 1.0 },
    ];
    vec![
        Step::Enable(AxisSet::one(1)),
        Step::Together(vec![
            Step::MoveAbsolute { axis: 1, position: 60.0, limits: TURNTABLE },
            Step::Sequence(slide),
        ]),
        Step::WaitInWindow { axis: 1, window: 0.001, seconds: 1.0 },
        Step::Disable(AxisSet::first(2)),
    ]
}

#[test]
fn a_drive_that_is_plugged_in_while_another_axis_moves_is_enabled_and_moves() {
    let mut rig = Rig::ready(settings());
    assert!(!rig.told().contains("found none"), "nothing is missing: {}", rig.told());
    let config = ControllerConfig { late: AxisSet::one(2), ..rig.controller_config() };
    rig.connect_with(config, program());
    rig.run_until(millis(5_000), "full speed", |rig| rig.velocity(0) > 49 * NANO / 10);
    assert_eq!(rig.engine.axes()[1].state(), DriveState::NotReady);
    let before = rig.status().counters;
    plug(&mut rig, slide(2));
    // The turntable does not lose a cycle, and never leaves its speed.
    let mut slowest = i64::MAX;
    let took = rig.run_until(millis(9_000), "the drive", |rig| {
        slowest = slowest.min(rig.velocity(0));
        plugged(rig)
    });
    assert!(slowest > 49 * NANO / 10, "{slowest} within {took}");
    let report = rig.run(millis(60_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
    let after = rig.status().counters;
    assert_eq!(after.lost_telegrams, before.lost_telegrams, "no telegram was lost");
    assert_eq!(rig.status().axes[0].lost_telegrams, 0);
    let distance = [(0, 60 * NANO), (1, 60 * NANO)].map(|(at, end)| rig.position(at) - end);
    assert!(distance[0].abs() < NANO / 1_000 && distance[1].abs() < NANO / 50, "{distance:?}");
    assert!(rig.states(1).contains(&DriveState::Operating), "{:?}", rig.states(1));
    assert!(rig.axis_states(1).contains(&AxisState::Running));
    assert_eq!(rig.status().axes[0].faults + rig.status().axes[1].faults, 0);
    assert!(rig.torque_free());
}

#[test]
fn a_drive_that_is_pulled_out_in_motion_faults_its_axis_alone_and_can_be_plugged_in_again() {
    let mut rig = Rig::ready(settings());
    plug(&mut rig, slide(2));
    rig.run_until(millis(9_000), "the drive", plugged);
    rig.run_for(millis(50));
    rig.connect(axisbridge_tests::rig::motion::long_moves());
    rig.run_until(millis(5_000), "full speed", axisbridge_tests::rig::motion::at_full_speed);
    rig.line.cut(1);
    rig.run_until(millis(500), "the fault", |rig| rig.status().axes[1].faults == 1);
    rig.run_until(millis(3_000), "rest", at_rest);
    assert_eq!(rig.status().phase, 4, "the bus goes on");
    assert_eq!(rig.status().axes[0].lost_telegrams, 0);
    // Plugged in again it is commissioned again; nothing moves by itself.
    rig.notices.clear();
    let stands = rig.position(1);
    rig.line.mend(1);
    rig.run_until(millis(9_000), "the drive again", plugged);
    rig.run_for(millis(500));
    assert!((rig.position(1) - stands).abs() < NANO / 100);
    assert!(rig.torque_free());
    assert_eq!(rig.status().phase, 4);
}

#[test]
fn a_drive_that_does_not_belong_there_is_told_of_and_stays_out() {
    let mut rig = Rig::ready(settings());
    plug(&mut rig, slide(9));
    rig.run_for(millis(2_000));
    let refused = Event::HotPlugRefused { address: Some(9), reason: HotPlugRefusal::Unknown };
    let told = rig.notices.iter().filter(|notice| **notice == Notice::Sercos(refused.clone())).count();
    assert_eq!(told, 1, "{}", rig.told());
    assert_eq!(rig.engine.axes()[1].state(), DriveState::NotReady);
    assert_eq!(rig.status().phase, 4);
}

/// Connects a controller that only reads and sets attributes.
fn look_on(rig: &mut Rig) {
    rig.connect(vec![Step::Dwell { seconds: 100_000.0 }]);
    rig.run_until(millis(20_000), "Stopped", |rig| {
        rig.engine.devices()[0].axis_states().all(|(_, state)| state == AxisState::Stopped)
    });
}

/// Another drive with the same address takes the place of the one whose attribute a controller has set: it keeps what it came with.
#[test]
fn a_drive_that_takes_the_place_of_another_one_keeps_its_own_values() {
    const SET: u8 = 0x10;
    let kpp = Idn::standard(104);
    let held = |rig: &Rig| rig.line.slaves()[1].store().number_of(kpp);
    let mut rig = Rig::ready(settings());
    plug(&mut rig, slide(2));
    rig.run_until(millis(9_000), "the drive", plugged);
    look_on(&mut rig);
    let client = Client::connect(&mut rig, CONTROLLER);
    assert_eq!(client.ask(&mut rig, SET, 2, Some(441), &100.0_f32.to_le_bytes()).0, 0);
    assert_eq!(held(&rig), 600, "300 before");
    rig.line.cut(1);
    rig.run_for(millis(200));
    let mut other = slide(2);
    let handle = other.store().find(kpp).expect("the drive has it");
    other.store_mut().set_number(handle, 450);
    rig.line.set_power(1, false);
    rig.line.slaves_mut()[1] = other;
    rig.line.set_power(1, true);
    rig.notices.clear();
    rig.line.mend(1);
    rig.run_until(millis(9_000), "the other drive", plugged);
    rig.run_for(millis(500));
    rig.kill_controller();
    rig.run_until(millis(5_000), "the connection is lost", |rig| rig.status().connections == 0);
    look_on(&mut rig);
    assert_eq!(held(&rig), 450, "{}", rig.told());
}

/// A drive that fails again and again in the last step of its setup, and for the same reason.
#[test]
fn a_drive_that_is_refused_twice_for_the_same_reason_is_given_up_both_times() {
    let mut rig = Rig::ready(settings());
    plug(&mut rig, slide(2));
    let has_program = |rig: &Rig| rig.engine.axes()[1].south().is_some();
    let mut left = Vec::new();
    for attempt in ["the first attempt", "the second attempt"] {
        rig.run_until(millis(20_000), attempt, has_program);
        // Its service channel is silent from now on.
        let places = rig.sercos().master().layout().slaves[1].clone().expect("its places");
        rig.tamper_frame = Some(Box::new(move |frame| {
            let bytes = frame.as_mut_slice();
            if bytes[14] & 0x40 != 0 && bytes[15] & 0x8F == 4 && places.svc_at.telegram == bytes[14] & 0x0F {
                bytes[HEADER_LEN..][places.svc_at.range(6)].fill(0);
            }
            true
        }));
        rig.run_for(millis(1_000));
        left.push(has_program(&rig));
        rig.tamper_frame = None;
    }
    assert_eq!(left, [false, false], "{}", rig.told());
    let refused = Event::HotPlugRefused { address: Some(2), reason: HotPlugRefusal::SetUp };
    let told = rig.notices.iter().filter(|notice| **notice == Notice::Sercos(refused.clone())).count();
    assert_eq!(told, 1, "the same is reported once: {}", rig.told());
    rig.run_until(millis(20_000), "the third attempt", plugged);
    rig.run_for(millis(100));
    assert_eq!(rig.engine.axes()[1].state(), rig.engine.axes()[0].state());
}
