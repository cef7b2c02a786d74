//! Hookup tests from the services of the controller to the order of the drive and back.

use super::services::{explicit, reply_of};
use super::*;
use crate::device::axis::drive_link::{HookupTest, TestOrder, TestReport};
use crate::wire::Writer;
use crate::wire::motion::codes::{FeedbackMode, TestStatus};
use crate::wire::motion::test_service::{HookupTestData, RunHookupTest};
use crate::wire::status::GeneralStatus;

fn run(test_type: u8, feedback_channel: u8, distance: f32, time: f32) -> Vec<u8> {
    let mut body = [0; 12];
    let request = RunHookupTest { test_type, feedback_channel, distance, time };
    request.emit(&mut Writer::new(&mut body)).expect("room");
    body.to_vec()
}

const MOTOR: u8 = 0;
const FEEDBACK: u8 = 1;

impl Rig {
    /// Sends a service to axis 1 under a new transaction and returns status and body of the answer.
    fn ask(&mut self, service: MotionService, body: Vec<u8>) -> (u8, Vec<u8>) {
        let transaction = self.services[1].as_ref().map_or(1, |(last, _, _)| last.wrapping_add(1));
        self.services[1] = Some((transaction, service, body));
        self.cycle();
        let (answered, status, body) = self.response(1).expect("an answer");
        assert_eq!(answered, transaction);
        (status, body)
    }

    fn start(&mut self, body: Vec<u8>) -> u8 {
        self.ask(MotionService::RUN_HOOKUP_TEST, body).0
    }

    fn data(&mut self) -> Vec<u8> {
        let (status, body) = self.ask(MotionService::GET_HOOKUP_TEST_DATA, vec![]);
        assert_eq!(status, 0);
        body
    }

    fn order(&self) -> Option<TestOrder> {
        self.command(0).test
    }

    /// The drive reports the end of the test that stands.
    fn end_test(&mut self, status: TestStatus, feedback_1_direction: u8) {
        let id = self.order().expect("an order").id;
        let data = HookupTestData { status, feedback_1_direction, ..HookupTestData::default() };
        self.drives[0].image.test = Some(TestReport { id, data });
    }

    fn in_process(&mut self) -> bool {
        let reply = self.request(explicit(99, 0x0E, 1, Some(651), &[]));
        reply_of(reply).2[2] & 8 != 0
    }

    /// A rig whose first axis is in the state Testing.
    fn testing() -> Self {
        let mut rig = Self::stopped();
        rig.blocks[0].feedback_mode = FeedbackMode(2);
        rig.cycle();
        assert_eq!(rig.start(run(MOTOR, 0, 1.5, 0.0)), 0);
        rig.cycles(3);
        assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Testing, DriveAction::Test));
        rig
    }
}

#[test]
fn an_update_whose_commands_are_refused_starts_no_test() {
    let mut rig = Rig::stopped();
    rig.blocks[0].feedback_mode = FeedbackMode(2);
    rig.cycle();
    rig.control |= NodeControl::SYNC_CONTROL;
    rig.time = TimeDataSet::empty();
    assert_eq!(rig.start(run(MOTOR, 0, 1.5, 0.0)), GeneralStatus::DEVICE_STATE_CONFLICT.0);
    assert_eq!(rig.device.counters().untimed, 1);
    rig.cycles(3);
    assert_eq!((rig.order(), rig.state(0)), (None, AxisState::Stopped));
}

#[test]
fn a_motor_test_goes_by_starting_and_testing_back_to_stopped() {
    let mut rig = Rig::stopped();
    rig.blocks[0].feedback_mode = FeedbackMode(2);
    rig.cycle();
    assert_eq!(rig.order(), None);
    assert_eq!(rig.start(run(MOTOR, 0, 1.5, 0.0)), 0, "answered when it begins, not when it ends");
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Starting, DriveAction::Test));
    let order = TestOrder { id: 1, test: HookupTest::MotorFeedback, distance: 1.5, time: 0.0 };
    assert_eq!(rig.order(), Some(order));
    rig.cycles(3);
    assert!(rig.in_process());
    assert_eq!((rig.state(0), rig.withheld(0)), (AxisState::Testing, Some(Withheld::NotRunning)));
    assert_eq!(rig.data(), [1, 0, 0, 0, 0, 0, 0, 0], "in progress");
    rig.end_test(TestStatus::SUCCESSFUL, 1);
    rig.cycle();
    assert_eq!((rig.state(0), rig.order()), (AxisState::Stopping, None));
    rig.cycles(3);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Stopped, DriveAction::PowerUp));
    assert_eq!(rig.data(), [0, 1, 0, 0, 0, 0, 0, 0], "successful, negative");
    assert_eq!(rig.state(1), AxisState::Stopped, "the other axis was left alone");
    // The report of the last test does not end the next one.
    assert_eq!(rig.start(run(MOTOR, 0, 1.5, 0.0)), 0);
    rig.cycles(4);
    assert_eq!((rig.state(0), rig.order().map(|order| order.id)), (AxisState::Testing, Some(2)));
}

#[test]
fn a_test_begins_only_where_the_standard_allows_it() {
    let conflict = GeneralStatus::OBJECT_STATE_CONFLICT.0;
    let device = GeneralStatus::DEVICE_STATE_CONFLICT.0;
    let invalid = GeneralStatus::INVALID_PARAMETER.0;
    let mut rig = Rig::stopped();
    rig.blocks[0].feedback_mode = FeedbackMode(2);
    rig.cycle();
    let (status, _) = rig.ask(MotionService::GET_HOOKUP_TEST_DATA, vec![]);
    assert_eq!(status, conflict, "there was no test");
    let (status, _) = rig.ask(MotionService::GET_HOOKUP_TEST_DATA, vec![0; 4]);
    assert_eq!(status, GeneralStatus::TOO_MUCH_DATA.0);
    assert_eq!(rig.start(run(MOTOR, 0, 1.0, 0.0)[..8].to_vec()), GeneralStatus::NOT_ENOUGH_DATA.0);
    let long = [run(MOTOR, 0, 1.0, 0.0), vec![0; 4]].concat();
    assert_eq!(rig.start(long), GeneralStatus::TOO_MUCH_DATA.0);
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(rig.start(run(MOTOR, 0, bad, 0.0)), invalid, "{bad}");
        assert_eq!(rig.start(run(FEEDBACK, 1, bad, 0.0)), invalid, "{bad}");
    }
    for test_type in (2..=8).chain([255]) {
        assert_eq!(rig.start(run(test_type, 1, 1.0, 1.0)), invalid, "test type {test_type}");
    }
    for channel in [0, 2, 3, 4] {
        assert_eq!(rig.start(run(FEEDBACK, channel, 1.0, 0.0)), invalid, "channel {channel}");
    }
    for source in [3, 4] {
        rig.blocks[0].feedback_mode = FeedbackMode(source);
        rig.cycle();
        assert_eq!(rig.start(run(MOTOR, 0, 1.0, 0.0)), device, "feedback 2 cannot be judged");
    }
    // Without feedback the time counts, and it has a limit.
    rig.blocks[0].feedback_mode = FeedbackMode(0);
    rig.cycle();
    assert_eq!(rig.start(run(MOTOR, 0, 1.0, 0.0)), invalid);
    assert_eq!(rig.start(run(MOTOR, 0, 0.0, 31.0)), invalid);
    rig.blocks[0].feedback_mode = FeedbackMode(2);
    rig.drives[0].image.start_inhibits = 2;
    rig.cycles(2);
    assert_eq!(rig.state(0), AxisState::StartInhibited);
    assert_eq!(rig.start(run(MOTOR, 0, 1.0, 0.0)), conflict);
    assert_eq!(rig.start(run(FEEDBACK, 1, 1.0, 0.0)), 0, "a passive test needs no torque");
    assert_eq!(rig.start(run(FEEDBACK, 1, 1.0, 0.0)), conflict, "one at a time");
    assert_eq!(rig.command(0).action, DriveAction::PowerUp);
    let mut rig = Rig::stopped();
    rig.blocks[0].feedback_mode = FeedbackMode(2);
    rig.request_all(AxisControl::ENABLE);
    rig.cycles(5);
    assert_eq!(rig.start(run(MOTOR, 0, 1.0, 0.0)), conflict);
    assert_eq!(rig.start(run(FEEDBACK, 1, 1.0, 0.0)), conflict);
    assert_eq!(rig.state(0), AxisState::Running, "nothing has happened to it");
    let mut rig = Rig::stopped();
    rig.control = NodeControl::DATA_VALID;
    let reply = rig.request(explicit(1, 0x53, 1, None, &run(FEEDBACK, 1, 1.0, 0.0)));
    assert_eq!(reply_of(reply).1, 0, "remote control until the update that ends it");
    rig.cycle();
    let reply = rig.request(explicit(2, 0x53, 2, None, &run(FEEDBACK, 1, 1.0, 0.0)));
    assert_eq!(reply_of(reply).1, device, "not without remote control");
}

#[test]
fn whatever_ends_the_motion_ends_the_test_at_once() {
    /// Name, what ends the test, the state it leads to and the Test Status.
    type Ender = (&'static str, fn(&mut Rig), AxisState, u8);
    let enders: [Ender; 5] = [
        ("disable", |rig| rig.request_all(AxisControl::DISABLE), AxisState::Stopping, 2),
        ("abort", |rig| rig.request_all(AxisControl::ABORT), AxisState::Aborting, 4),
        ("shutdown", |rig| rig.request_all(AxisControl::SHUTDOWN), AxisState::Stopping, 2),
        ("stop process", |rig| rig.request_all(AxisControl::STOP_PROCESS), AxisState::Stopping, 2),
        ("fault", |rig| rig.raise(0, 7, 0x22), AxisState::Aborting, 4),
    ];
    for (name, end, state, status) in enders {
        let mut rig = Rig::testing();
        end(&mut rig);
        rig.drives[0].stuck = true;
        rig.cycles(2);
        assert_eq!((rig.state(0), rig.order()), (state, None), "{name}");
        assert_ne!(rig.command(0).action, DriveAction::Test, "{name}");
        assert_eq!(rig.data()[0], status, "{name}");
        rig.drives[0].stuck = false;
        rig.cycles(4);
        assert!(!rig.state(0).is_energized(), "{name}");
        assert_eq!(rig.command(0).test, None, "{name}");
    }
    // Remote control given up, a malformed update, and silence.
    let mut rig = Rig::testing();
    rig.control = NodeControl::DATA_VALID;
    rig.cycles(2);
    assert_eq!((rig.order(), rig.command(0).action == DriveAction::Test), (None, false));
    let mut rig = Rig::testing();
    let mut malformed = rig.command_packet();
    malformed[2] = 9;
    rig.send(&malformed);
    assert_eq!((rig.state(0), rig.order()), (AxisState::Aborting, None));
    let mut rig = Rig::testing();
    for _ in 0..6 {
        rig.silence();
    }
    assert_eq!((rig.order(), rig.command(0).action), (None, DriveAction::Abort));
    for _ in 0..20 {
        rig.silence();
    }
    assert_eq!((rig.state(0), rig.order()), (AxisState::MajorFaulted, None), "the connection is lost");
    let mut rig = Rig::testing();
    rig.close();
    assert_eq!((rig.order(), rig.command(0).action), (None, DriveAction::Disable));
}

#[test]
fn a_drive_that_does_not_get_ready_ends_the_test_without_motion() {
    let mut rig = Rig::stopped();
    rig.blocks[0].feedback_mode = FeedbackMode(2);
    rig.cycle();
    rig.drives[0].stuck = true;
    assert_eq!(rig.start(run(MOTOR, 0, 1.0, 0.0)), 0);
    rig.cycles(2);
    assert_eq!(rig.state(0), AxisState::Starting);
    rig.end_test(TestStatus::TIMED_OUT, 0);
    rig.cycles(2);
    rig.drives[0].stuck = false;
    rig.cycles(3);
    assert_eq!((rig.state(0), rig.data()[0]), (AxisState::Stopped, 3));
}

#[test]
fn an_enable_does_not_become_a_test_and_a_test_does_not_become_an_enable() {
    let mut rig = Rig::stopped();
    assert_eq!(rig.start(run(FEEDBACK, 1, 1.0, 0.0)), 0);
    assert!(rig.order().is_some());
    rig.request_all(AxisControl::ENABLE);
    rig.cycles(5);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Running, DriveAction::Enable));
    assert_eq!(rig.order(), None, "the passive test ended with it");
    rig.request_all(AxisControl::NONE);
    rig.cycles(2);
    assert_eq!(rig.data()[0], 2);
    let mut rig = Rig::testing();
    rig.request_all(AxisControl::ENABLE);
    rig.cycles(2);
    assert_eq!(rig.actual(0).response_status, GeneralStatus::OBJECT_STATE_CONFLICT.0);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Testing, DriveAction::Test));
}

#[test]
fn a_passive_test_watches_without_torque_until_the_drive_reports() {
    let mut rig = Rig::stopped();
    assert_eq!(rig.start(run(FEEDBACK, 1, 0.25, 0.0)), 0);
    rig.cycles(3);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Stopped, DriveAction::PowerUp));
    assert!(rig.in_process());
    rig.end_test(TestStatus::SUCCESSFUL, 0);
    rig.cycle();
    assert_eq!(rig.data(), [0; 8]);
    assert!(!rig.in_process());
    assert_eq!(rig.start(run(FEEDBACK, 1, 0.25, 0.0)), 0);
    rig.request_all(AxisControl::STOP_PROCESS);
    rig.cycle();
    assert_eq!((rig.order(), rig.actual(0).response_status, rig.data()[0]), (None, 0, 2));
}

#[test]
fn a_test_is_not_begun_by_explicit_message_while_the_updates_are_stale() {
    let device = GeneralStatus::DEVICE_STATE_CONFLICT.0;
    let ask = |rig: &mut Rig, token| {
        reply_of(rig.request(explicit(token, 0x53, 1, None, &run(MOTOR, 0, 1.0, 0.0)))).1
    };
    let ready = || {
        let mut rig = Rig::stopped();
        rig.blocks[0].feedback_mode = FeedbackMode(2);
        rig.cycle();
        rig
    };
    // Half a period overdue is jitter, one missed update is not; the next good one is enough again.
    let mut rig = ready();
    rig.now += PERIOD / 4;
    assert_eq!(ask(&mut rig, 1), 0);
    let mut rig = ready();
    rig.silence();
    assert_eq!((ask(&mut rig, 1), rig.state(0), rig.order()), (device, AxisState::Stopped, None));
    let passive = explicit(2, 0x53, 1, None, &run(FEEDBACK, 1, 1.0, 0.0));
    assert_eq!(reply_of(rig.request(passive)).1, device);
    rig.cycle();
    assert_eq!((ask(&mut rig, 3), rig.state(0)), (0, AxisState::Starting));
    // An update that came in time and was refused is none.
    let mut rig = ready();
    rig.control |= NodeControl::SYNC_CONTROL;
    rig.time = TimeDataSet::empty();
    let packet = rig.command_packet();
    rig.send(&packet);
    assert_eq!(
        (rig.device.counters().untimed, ask(&mut rig, 1), rig.state(0)),
        (1, device, AxisState::Stopped)
    );
    // Neither is one whose data are said to be not valid.
    let mut rig = ready();
    rig.control = NodeControl::REMOTE_CONTROL;
    let packet = rig.command_packet();
    rig.send(&packet);
    assert_eq!(
        (rig.device.counters().not_valid, ask(&mut rig, 1), rig.state(0)),
        (1, device, AxisState::Stopped)
    );
    rig.control |= NodeControl::DATA_VALID;
    rig.cycle();
    assert_eq!(ask(&mut rig, 2), 0);
}

#[test]
fn explicit_group_sync_compares_with_the_time_of_the_moment() {
    let mut rig = Rig::stopped();
    let reply = rig.request(explicit(1, 0x1C, 0, None, &GRANDMASTER));
    assert_eq!(reply_of(reply), (1, 0, vec![0]));
    let reply = rig.request(explicit(2, 0x1C, 0, None, &[9; 8]));
    assert_eq!(reply_of(reply), (2, 0, vec![2]));
    let reply = rig.request(explicit(3, 0x1C, 1, None, &GRANDMASTER));
    assert_eq!(reply_of(reply).1, GeneralStatus::SERVICE_NOT_SUPPORTED.0, "a service of the class");
}
