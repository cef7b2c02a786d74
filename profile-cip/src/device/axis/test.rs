//! The hookup test of an axis, clauses 5-2.5.1.9, 5-2.5.1.10 and 5-2.6.2.8.
//!
//! The device keeps the order, the state and the result; the application that runs the drive runs the test and reports its end
//! ([`TestOrder`], [`super::drive_link::TestReport`]). An active test goes Stopped, Starting, Testing, Stopping, Stopped; a
//! passive one changes no state. In Process stands from the order until the axis is out of motion again, and whatever
//! ends the motion ends the test: the order is taken back in the same step.

use super::drive_link::{HookupTest, TestOrder};
use crate::wire::motion::codes::{FeedbackSource, TestStatus};
use crate::wire::motion::test_service::{HookupTestData, RunHookupTest};

/// Longest motion of a test that is ended by time, s; what a device takes at all is up to its maker.
const TIME_MAX: f32 = 30.0;

/// A test under way.
#[derive(Debug, Clone, Copy)]
struct ActiveTest {
    order: TestOrder,
    /// Its result is known; the axis still has to come out of motion.
    ended: bool,
}

/// The test of an axis and its result.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AxisTest {
    active: Option<ActiveTest>,
    id: u32,
    /// Result of the last test.
    data: Option<HookupTestData>,
}

/// The order for a test, without its number; `None` if the parameters are not right. `source` is the feedback of the axis.
pub(super) fn order(test: HookupTest, request: &RunHookupTest, source: FeedbackSource) -> Option<TestOrder> {
    let positive = |value: f32| value.is_finite() && value > 0.0;
    let timed = test == HookupTest::MotorFeedback && source == FeedbackSource::NONE;
    let good = match test {
        HookupTest::MotorFeedback if timed => positive(request.time) && request.time <= TIME_MAX,
        HookupTest::MotorFeedback => positive(request.distance),
        // Feedback 1 is what the drive shows; it has no other channel to watch.
        HookupTest::Feedback => positive(request.distance) && request.feedback_channel == 1,
    };
    let (distance, time) = if timed { (0.0, request.time) } else { (request.distance, 0.0) };
    good.then_some(TestOrder { id: 0, test, distance, time })
}

impl AxisTest {
    /// Gives an order.
    pub fn begin(&mut self, order: TestOrder) {
        self.id = self.id.wrapping_add(1);
        self.active = Some(ActiveTest { order: TestOrder { id: self.id, ..order }, ended: false });
        self.data = Some(HookupTestData { status: TestStatus::IN_PROGRESS, ..HookupTestData::default() });
    }

    /// Result of the last test; `None` before the first one.
    pub fn data(&self) -> Option<HookupTestData> {
        self.data
    }

    /// The order that is given, and whether its result is known.
    pub fn given(&self) -> Option<(TestOrder, bool)> {
        self.active.map(|test| (test.order, test.ended))
    }

    /// The test that the drive has to run now.
    pub fn order(&self) -> Option<TestOrder> {
        self.active.filter(|test| !test.ended).map(|test| test.order)
    }

    /// A test service has not come to its end (In Process, bit 19 of Axis Status).
    pub fn is_in_process(&self) -> bool {
        self.active.is_some()
    }

    /// A test that energizes the axis is under way: Start Complete leads to Testing.
    pub fn is_energizing(&self) -> bool {
        self.order().is_some_and(|order| order.test.is_active())
    }

    /// Writes the result down. What was not measured stays 0.
    pub fn record(&mut self, data: HookupTestData) {
        if let Some(test) = self.active.as_mut().filter(|test| !test.ended) {
            test.ended = true;
            self.data = Some(data);
        }
    }

    /// Ends the test with nothing measured.
    pub fn break_off(&mut self, status: TestStatus) {
        self.record(HookupTestData { status, ..HookupTestData::default() });
    }

    /// The axis is out of motion: the test has come to its end.
    pub fn end(&mut self) {
        self.active = None;
    }

    /// A connection begins or ends: no test and no result.
    pub fn forget(&mut self) {
        (self.active, self.data) = (None, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_is_given_once_and_its_first_result_stands() {
        let request = RunHookupTest { test_type: 0, feedback_channel: 1, distance: 2.0, time: 0.0 };
        let order = order(HookupTest::Feedback, &request, FeedbackSource::MOTOR).expect("an order");
        let mut test = AxisTest::default();
        test.begin(order);
        assert_eq!(test.order(), Some(TestOrder { id: 1, ..order }));
        test.break_off(TestStatus::ABORTED);
        test.break_off(TestStatus::FAULTED);
        assert_eq!(test.data().map(|data| data.status), Some(TestStatus::ABORTED));
        assert_eq!((test.order(), test.is_in_process()), (None, true));
        test.end();
        test.begin(order);
        assert_eq!(test.order().map(|order| order.id), Some(2));
        test.forget();
        assert_eq!((test.is_in_process(), test.data()), (false, None));
    }
}
