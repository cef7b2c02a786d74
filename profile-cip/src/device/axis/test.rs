//! The hookup test of an axis, clauses 5-2.5.1.9, 5-2.5.1.10 and 5-2.6.2.8.
//!
//! The device keeps the order, the state and the result; whoever runs the drive runs the test and reports its end
//! ([`TestOrder`], [`super::drive_link::TestReport`]). An active test goes Stopped, Starting, Testing, Stopping, Stopped; a
//! passive one changes no state. In Process stands from the order until the axis is out of motion again, and whatever
//! ends the motion ends the test: the order is taken back in the same step.

use super::drive_link::{HookupTest, TestOrder};
use super::state::{AxisEvent, AxisState, ControlKind};
use super::{Axis, Context};
use crate::wire::motion::codes::{FeedbackSource, TestStatus};
use crate::wire::motion::test_service::{HookupTestData, RunHookupTest};
use crate::wire::status::GeneralStatus;

/// Longest motion of a test that is ended by time, s; what a device takes at all is up to its maker.
const TIME_MAX: f32 = 30.0;

/// A test under way.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActiveTest {
    order: TestOrder,
    /// Its result is known; the axis still has to come out of motion.
    ended: bool,
}

impl Axis {
    /// Run_Hookup_Test: checks the request and gives the order.
    pub fn begin_hookup_test(&mut self, request: &RunHookupTest, context: &Context) -> GeneralStatus {
        if self.config.hookup_tests == 0 || self.config.kind == ControlKind::Converter {
            return GeneralStatus::SERVICE_NOT_SUPPORTED;
        }
        let known = request.test_type < 8 && self.config.hookup_tests & (1 << request.test_type) != 0;
        let (true, Some(test)) = (known, HookupTest::from_code(request.test_type)) else {
            return GeneralStatus::INVALID_PARAMETER;
        };
        let source = self.block.feedback_mode.source();
        let positive = |value: f32| value.is_finite() && value > 0.0;
        let timed = test == HookupTest::MotorFeedback && source == FeedbackSource::NONE;
        let good = match test {
            HookupTest::MotorFeedback if timed => positive(request.time) && request.time <= TIME_MAX,
            HookupTest::MotorFeedback => positive(request.distance),
            // Feedback 1 is what the drive shows; it has no other channel to watch.
            HookupTest::Feedback => positive(request.distance) && request.feedback_channel == 1,
        };
        if !good {
            return GeneralStatus::INVALID_PARAMETER;
        }
        let standby = matches!(
            self.state,
            AxisState::Stopped | AxisState::Shutdown | AxisState::PreCharge | AxisState::StartInhibited
        );
        let state = if test.is_active() { self.state == AxisState::Stopped } else { standby };
        if !state || self.test.is_some() || self.handshake.executing().is_some() {
            return GeneralStatus::OBJECT_STATE_CONFLICT;
        }
        // With load feedback the motor would move although channel 2 cannot be judged.
        let judged = !matches!(source, FeedbackSource::LOAD | FeedbackSource::DUAL);
        let may_move = judged && !self.inhibited() && self.drive.bus_up;
        let allowed = context.connected && context.remote && !context.node_fault && self.drive.online;
        if !allowed || (test.is_active() && !may_move) {
            return GeneralStatus::DEVICE_STATE_CONFLICT;
        }
        self.test_id = self.test_id.wrapping_add(1);
        let (distance, time) = if timed { (0.0, request.time) } else { (request.distance, 0.0) };
        let order = TestOrder { id: self.test_id, test, distance, time };
        if test.is_active() && !self.fire(AxisEvent::Test) {
            return GeneralStatus::OBJECT_STATE_CONFLICT;
        }
        self.test = Some(ActiveTest { order, ended: false });
        self.hookup = Some(HookupTestData { status: TestStatus::IN_PROGRESS, ..HookupTestData::default() });
        self.update_action();
        GeneralStatus::SUCCESS
    }

    /// Get_Hookup_Test_Data: the result of the last test; `None` before the first one.
    pub fn hookup_test_data(&self) -> Option<HookupTestData> {
        self.hookup
    }

    /// The test that the drive has to run now.
    pub fn test_order(&self) -> Option<TestOrder> {
        self.test.filter(|test| !test.ended).map(|test| test.order)
    }

    /// A test service has not come to its end (In Process, bit 19 of Axis Status).
    pub fn in_process(&self) -> bool {
        self.test.is_some()
    }

    /// A test that energizes the axis is under way: Start Complete leads to Testing.
    pub(super) fn is_testing(&self) -> bool {
        self.test_order().is_some_and(|order| order.test.is_active())
    }

    /// Writes the result down. What was not measured stays 0.
    fn record(&mut self, data: HookupTestData) {
        if let Some(test) = self.test.as_mut().filter(|test| !test.ended) {
            test.ended = true;
            self.hookup = Some(data);
        }
    }

    /// Ends the test with nothing measured.
    pub(super) fn break_off_test(&mut self, status: TestStatus) {
        self.record(HookupTestData { status, ..HookupTestData::default() });
    }

    /// Stop Process: the axis stops as by a Disable. Returns the status when there is nothing to wait for.
    pub(super) fn stop_process(&mut self) -> bool {
        let moves = self.is_testing();
        self.break_off_test(TestStatus::ABORTED);
        if moves {
            self.fire(AxisEvent::Disable);
            return false;
        }
        self.test = None;
        true
    }

    /// Lets the test follow the drive and the state of the axis.
    pub(super) fn follow_test(&mut self, context: &Context) {
        let Some(test) = self.test else { return };
        let report = self.drive.test.filter(|report| report.id == test.order.id);
        let passive_allowed = context.connected && context.remote && !context.node_fault && self.drive.online;
        match self.state {
            AxisState::Starting | AxisState::Testing if test.order.test.is_active() && !test.ended => {
                if let Some(report) = report {
                    self.record(report.data);
                    let event = if self.state == AxisState::Testing {
                        AxisEvent::TestComplete
                    } else {
                        AxisEvent::Disable
                    };
                    self.fire(event);
                }
            }
            AxisState::Stopping if test.order.test.is_active() => self.break_off_test(TestStatus::ABORTED),
            AxisState::Aborting | AxisState::MajorFaulted => {
                self.break_off_test(TestStatus::FAULTED);
                if self.state == AxisState::MajorFaulted {
                    self.test = None;
                }
            }
            AxisState::Stopped | AxisState::Shutdown | AxisState::PreCharge | AxisState::StartInhibited
                if !test.order.test.is_active() && !test.ended && passive_allowed =>
            {
                if let Some(report) = report {
                    self.record(report.data);
                    self.test = None;
                }
            }
            _ => {
                self.break_off_test(TestStatus::ABORTED);
                self.test = None;
            }
        }
    }
}
