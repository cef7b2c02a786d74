//! The hookup tests over the whole chain: the box moves a drive gently, says what it saw, and leaves off at once when it
//! has to.

use std::net::Ipv4Addr;

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, at_rest, both, millis, moves};
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::controller::{AxisSet, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::Writer;
use profile_cip::wire::motion::codes::TestStatus;
use profile_cip::wire::motion::test_service::{HookupTestData, RunHookupTest};
use profile_generic::fault::FaultCause;
use profile_generic::quantity::Torque;
use profile_generic::state::DriveState;

const RUN: u8 = 0x53;
const DATA: u8 = 0x54;
const SINGLE_GET: u8 = 0x0E;

/// What ends a test, with its name.
type End = (&'static str, fn(&mut Rig));

/// Which test.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Motor,
    Feedback,
}

fn request(kind: Kind, distance: f32) -> Vec<u8> {
    let (test_type, feedback_channel) = match kind {
        Kind::Motor => (0, 0),
        Kind::Feedback => (1, 1),
    };
    let mut body = [0; 12];
    RunHookupTest { test_type, feedback_channel, distance, time: 0.0 }
        .emit(&mut Writer::new(&mut body))
        .expect("room");
    body.to_vec()
}

fn data(rig: &mut Rig, client: &Client, instance: u8) -> HookupTestData {
    let (status, body) = client.ask(rig, DATA, instance, None, &[]);
    assert_eq!(status, 0);
    HookupTestData::parse(&body).expect("test data")
}

/// A controller that has configured the axes and waits, and a client of its own beside it.
fn waiting() -> (Rig, Client) {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![Step::Dwell { seconds: 100.0 }]);
    let stopped =
        |rig: &Rig| rig.engine.devices()[0].axis_states().all(|(_, state)| state == AxisState::Stopped);
    rig.run_until(millis(10_000), "both axes in Stopped", stopped);
    let client = Client::connect(&mut rig, CONTROLLER);
    (rig, client)
}

/// A motor test of axis 1 in full swing.
fn testing() -> (Rig, Client) {
    let (mut rig, client) = waiting();
    assert_eq!(client.ask(&mut rig, RUN, 1, None, &request(Kind::Motor, 5.0)), (0, vec![]));
    rig.run_until(millis(10_000), "motion", |rig| rig.velocity(0).abs() > NANO / 10);
    (rig, client)
}

#[test]
fn the_motor_is_moved_forward_gently_and_the_direction_of_its_feedback_is_told() {
    let (mut rig, client) = waiting();
    let from = rig.position(0);
    assert_eq!(client.ask(&mut rig, DATA, 1, None, &[]).0, 0x0C, "there was no test");
    assert_eq!(client.ask(&mut rig, RUN, 1, None, &request(Kind::Motor, 1.0)), (0, vec![]));
    rig.run_until(millis(5_000), "Testing", |rig| rig.axis_states(0).last() == Some(&AxisState::Testing));
    assert_eq!(data(&mut rig, &client, 1).status, TestStatus::IN_PROGRESS);
    let (_, status) = client.ask(&mut rig, SINGLE_GET, 1, Some(651), &[]);
    assert_ne!(status[2] & 8, 0, "In Process");
    let mut fastest = 0;
    rig.run_until(millis(25_000), "the end of the test", |rig| {
        fastest = fastest.max(rig.velocity(0).abs());
        rig.axis_states(0).last() == Some(&AxisState::Stopped)
    });
    let result = data(&mut rig, &client, 1);
    assert_eq!((result.status, result.feedback_1_direction), (TestStatus::SUCCESSFUL, 0));
    let way = rig.position(0) - from;
    assert!((NANO..5 * NANO / 4).contains(&way), "it went {way} nanorevolutions");
    assert!((NANO / 10..NANO).contains(&fastest), "at {fastest} nanorevolutions per second at most");
    assert!(rig.torque_free() && at_rest(&rig));
    use AxisState as A;
    let states = rig.axis_states(0);
    let from_stopped = states.iter().position(|state| *state == A::Stopped).expect("it was Stopped");
    assert_eq!(states[from_stopped..], [A::Stopped, A::Starting, A::Testing, A::Stopping, A::Stopped]);
    assert!(rig.states(0).contains(&DriveState::Testing));
    assert!(
        !rig.states(1).iter().any(|state| state.may_have_torque()),
        "the other axis has never had torque"
    );
    let (_, status) = client.ask(&mut rig, SINGLE_GET, 1, Some(651), &[]);
    assert_eq!(status[2] & 8, 0, "no longer In Process");
}

#[test]
fn a_load_that_pulls_the_axis_away_ends_the_test() {
    let (mut rig, client) = waiting();
    let from = rig.position(0);
    assert_eq!(client.ask(&mut rig, RUN, 1, None, &request(Kind::Motor, 5.0)), (0, vec![]));
    rig.run_until(millis(5_000), "Testing", |rig| rig.axis_states(0).last() == Some(&AxisState::Testing));
    rig.drive_mut(0).servo_mut().set_load(Torque(400_000));
    rig.run_until(millis(1_000), "the end", |rig| rig.axis_states(0).last() == Some(&AxisState::Stopping));
    let fallen = from - rig.position(0);
    assert!(fallen < NANO / 10, "{fallen} nanorevolutions");
    rig.drive_mut(0).servo_mut().set_load(Torque(0));
    rig.run_for(millis(1_000));
    assert_eq!(data(&mut rig, &client, 1).status, TestStatus::FAULTED, "it was too fast");
    assert!(rig.torque_free() && at_rest(&rig));
}

#[test]
fn whatever_stops_an_axis_stops_its_test() {
    // The controller goes, the line is cut, the drive faults, its power goes.
    let ends: [End; 4] = [
        ("controller", |rig| {
            rig.kill_controller();
        }),
        ("cable", |rig| rig.cable = false),
        ("fault", |rig| rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT)),
        ("power", |rig| rig.drive_mut(0).set_main_power(false)),
    ];
    for (name, end) in ends {
        let (mut rig, _) = testing();
        end(&mut rig);
        let off = rig.run_until(millis(2_000), "no torque", |rig| {
            let drive = &rig.watched[0];
            rig.torque_free() || !drive.on && rig.velocity(0).abs() < NANO / 100
        });
        assert!(off < millis(400), "{name}: {off}");
        rig.run_for(millis(1_000));
        assert!(rig.torque_free() && at_rest(&rig), "{name}: {}", rig.told());
        // A drive that is gone cannot say that it stands: then the time limit of the stop does.
        rig.run_until(millis(60_000), "Major Faulted", |rig| {
            rig.axis_states(0).last() == Some(&AxisState::MajorFaulted)
        });
    }
}

#[test]
fn only_the_owner_starts_a_test_and_only_in_stopped() {
    let (mut rig, client) = waiting();
    let other = Client::connect(&mut rig, Ipv4Addr::new(10, 0, 0, 66));
    assert_eq!(other.ask(&mut rig, RUN, 1, None, &request(Kind::Motor, 1.0)).0, 0x0F);
    assert_eq!(client.ask(&mut rig, RUN, 1, None, &request(Kind::Motor, 0.0)).0, 0x20);
    for service in 0x4F..=0x52 {
        assert_eq!(client.ask(&mut rig, service, 1, None, &[0; 16]).0, 0x08, "motor and inertia tests");
    }
    rig.run_for(millis(500));
    assert!(rig.watched[0].changes.is_empty(), "the drive was never switched on");
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(both()),
        moves(3.0, 100.0),
        Step::Dwell { seconds: 2.0 },
        Step::Disable(AxisSet::first(2)),
    ]);
    rig.run_until(millis(5_000), "motion", |rig| rig.velocity(0).abs() > NANO);
    let client = Client::connect(&mut rig, CONTROLLER);
    assert_eq!(client.ask(&mut rig, RUN, 1, None, &request(Kind::Motor, 1.0)).0, 0x0C);
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{}", rig.log());
}

#[test]
fn a_feedback_test_watches_while_somebody_else_moves_the_axis() {
    let (mut rig, client) = waiting();
    assert_eq!(client.ask(&mut rig, RUN, 1, None, &request(Kind::Feedback, 0.5)), (0, vec![]));
    rig.run_for(millis(500));
    assert_eq!(data(&mut rig, &client, 1).status, TestStatus::IN_PROGRESS);
    rig.drive_mut(0).servo_mut().set_load(Torque(60_000));
    rig.run_until(millis(10_000), "half a revolution", |rig| rig.position(0) < -NANO / 2);
    rig.drive_mut(0).servo_mut().set_load(Torque(0));
    rig.run_for(millis(200));
    let result = data(&mut rig, &client, 1);
    assert_eq!((result.status, result.feedback_1_direction), (TestStatus::SUCCESSFUL, 1));
    assert!(rig.watched[0].changes.is_empty(), "without torque from beginning to end");
}
