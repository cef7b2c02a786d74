//! What the north side wants the axis to be, as a level, and resets of faults under way.

use profile_generic::state::Request;
use profile_generic::time::MonotonicTime;

use super::{READY_TIME_OUT, RESET_TIME_OUT};

/// What a north side wants the axis to be: it holds until the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Intent {
    /// Nothing: without torque.
    #[default]
    Standby,
    /// In operation.
    Enable,
    /// In a test, with torque where the test needs it.
    Test,
    /// Stopped as configured.
    Disable,
    /// Shut down.
    Shutdown,
    /// Stopped for a fault.
    Abort,
}

/// An intent, and the request to the generic state machine by which it is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wish {
    /// What the axis shall be.
    pub intent: Intent,
    /// The request; `None` when nothing is asked of the drive.
    pub request: Option<Request>,
}

/// Who controls an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Owner {
    /// A controller or a local client may take it.
    #[default]
    Nobody,
    /// The controller that is connected to its device.
    Controller,
    /// A client of local control.
    Local,
}

impl Owner {
    /// Its name in the protocol of local control.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nobody => "nobody",
            Self::Controller => "controller",
            Self::Local => "local",
        }
    }
}

/// A reset of faults under way.
#[derive(Debug, Clone, Copy)]
struct Reset {
    id: u32,
    /// Since it was asked for, then since it was begun.
    since: MonotonicTime,
    begun: bool,
}

/// What one axis is asked for.
#[derive(Debug, Default)]
pub(super) struct Orders {
    wish: Wish,
    /// Since when an enable that was rejected is still asked for.
    enable_pending: Option<MonotonicTime>,
    /// The wish is an axis without torque, and the reaction to a fault would hold it.
    pub hold_unwanted: bool,
    /// The reset that was carried out last.
    reset_id: u32,
    reset: Option<Reset>,
    /// The drive's own fault reset is to be executed.
    pub drive_reset_wanted: bool,
    /// A request of this number was taken from a north side that speaks in the generic model.
    requested: Option<u32>,
    /// A controller is connected to the device of the axis.
    pub controller: bool,
    /// A client of local control controls the axis.
    pub local: bool,
}

/// What follows from a reset that goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ResetStep {
    /// The faults are to be cleared now.
    Clear,
    /// It takes too long, or the drive is not heard: it is not waited for any longer.
    Abandon,
}

impl Orders {
    pub fn owner(&self) -> Owner {
        match (self.local, self.controller) {
            (true, _) => Owner::Local,
            (false, true) => Owner::Controller,
            (false, false) => Owner::Nobody,
        }
    }

    pub fn wish(&self) -> Wish {
        self.wish
    }

    /// Takes another wish.
    pub fn want(&mut self, wish: Wish) {
        self.wish = wish;
        self.enable_pending = None;
        self.hold_unwanted = false;
    }

    /// The request of an enable or a test was rejected: one that came in the very cycle in which the drive was not ready is still
    /// asked for.
    pub fn reject_enable(&mut self, now: MonotonicTime) {
        let is_asked_for = matches!(self.wish.intent, Intent::Enable | Intent::Test);
        self.enable_pending = is_asked_for.then_some(now);
    }

    /// Such an enable is not tried again: what has happened since needs a new order.
    pub fn forget_pending(&mut self) {
        self.enable_pending = None;
    }

    /// Whether such an enable is to be tried again, now that the drive is ready.
    pub fn take_pending(&mut self) -> bool {
        self.enable_pending.take().is_some()
    }

    /// Whether such an enable has waited for too long. A stop has time limits of its own: as long as the axis `stops`, the wait does not
    /// begin.
    pub fn is_pending_late(&mut self, now: MonotonicTime, stops: bool) -> bool {
        let Some(since) = &mut self.enable_pending else { return false };
        if stops {
            *since = now;
        }
        now.since(*since) > READY_TIME_OUT
    }

    /// Whether the request of this number is another one than the last.
    pub fn is_new(&mut self, sequence: u32) -> bool {
        self.requested.replace(sequence) != Some(sequence)
    }

    /// The next request is of somebody who counts by himself.
    pub fn forget_number(&mut self) {
        self.requested = None;
    }

    /// The reset that was carried out last.
    pub fn reset_id(&self) -> u32 {
        self.reset_id
    }

    /// Whether this reset was neither carried out nor is under way.
    pub fn is_new_reset(&self, id: u32) -> bool {
        id != self.reset_id && self.reset.is_none_or(|reset| reset.id != id)
    }

    pub fn begin_reset(&mut self, now: MonotonicTime, id: u32) {
        self.reset = Some(Reset { id, since: now, begun: false });
    }

    /// A reset that has not begun counts as carried out.
    pub fn drop_waiting_reset(&mut self) {
        if let Some(reset) = self.reset.take_if(|reset| !reset.begun) {
            self.reset_id = reset.id;
        }
    }

    /// Whether a reset waits or is under way.
    pub fn has_reset(&self) -> bool {
        self.reset.is_some()
    }

    /// Whether a reset is under way: the drive may still show what is being reset.
    pub fn resets(&self) -> bool {
        self.reset.is_some_and(|reset| reset.begun)
    }

    /// Begins a reset that waits, once the axis does not stop any more: a stop under way is not interrupted.
    pub fn advance_reset(&mut self, now: MonotonicTime, stops: bool) -> Option<ResetStep> {
        let reset = self.reset.as_mut().filter(|reset| !reset.begun && !stops)?;
        *reset = Reset { since: now, begun: true, ..*reset };
        Some(ResetStep::Clear)
    }

    /// Ends a reset under way when the axis is not `faulted` any more, its drive is `lost`, or its time is over.
    pub fn end_reset(&mut self, now: MonotonicTime, faulted: bool, lost: bool) -> Option<ResetStep> {
        let reset = self.reset.filter(|reset| reset.begun)?;
        let in_vain = lost || now.since(reset.since) > RESET_TIME_OUT;
        if !faulted || in_vain {
            self.reset = None;
            self.reset_id = reset.id;
        }
        in_vain.then_some(ResetStep::Abandon)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use profile_generic::time::DurationNs;

    const NOW: MonotonicTime = MonotonicTime(1_000);

    #[test]
    fn a_reset_waits_for_the_stop_and_ends_when_the_drive_is_well_or_its_time_is_over() {
        let mut orders = Orders::default();
        assert!(!orders.is_new_reset(0) && orders.is_new_reset(7));
        orders.begin_reset(NOW, 7);
        assert!(!orders.is_new_reset(7) && orders.has_reset() && !orders.resets());
        assert_eq!(orders.advance_reset(NOW, true), None);
        assert_eq!(orders.end_reset(NOW, false, false), None, "it has not begun");
        assert_eq!(orders.reset_id(), 0);
        assert_eq!(orders.advance_reset(NOW, false), Some(ResetStep::Clear));
        assert_eq!(orders.advance_reset(NOW, false), None, "once");
        assert_eq!((orders.end_reset(NOW + RESET_TIME_OUT, true, false), orders.resets()), (None, true));
        assert_eq!((orders.end_reset(NOW, false, false), orders.reset_id()), (None, 7));
        orders.begin_reset(NOW, 8);
        orders.advance_reset(NOW, false);
        let late = NOW + RESET_TIME_OUT + DurationNs(1);
        assert_eq!((orders.end_reset(late, true, false), orders.reset_id()), (Some(ResetStep::Abandon), 8));
        assert!(!orders.has_reset());
        orders.begin_reset(NOW, 9);
        assert_eq!(orders.end_reset(NOW, true, true), None, "it has not begun");
        orders.drop_waiting_reset();
        assert_eq!((orders.has_reset(), orders.is_new_reset(9)), (false, false));
        orders.begin_reset(NOW, 10);
        orders.advance_reset(NOW, false);
        orders.drop_waiting_reset();
        assert!(orders.resets(), "it has begun");
        assert_eq!((orders.end_reset(NOW, true, true), orders.reset_id()), (Some(ResetStep::Abandon), 10));
    }

    #[test]
    fn only_a_rejected_enable_or_test_is_tried_again_until_another_wish_or_event() {
        for (intent, again) in
            [(Intent::Enable, true), (Intent::Test, true), (Intent::Disable, false), (Intent::Abort, false)]
        {
            let mut orders = Orders::default();
            orders.want(Wish { intent, request: None });
            orders.reject_enable(NOW);
            assert_eq!((orders.take_pending(), orders.take_pending()), (again, false), "{intent:?}");
            orders.reject_enable(NOW);
            orders.want(Wish::default());
            assert!(!orders.take_pending(), "{intent:?}");
            orders.want(Wish { intent, request: None });
            orders.reject_enable(NOW);
            orders.forget_pending();
            assert!(!orders.take_pending(), "{intent:?}");
        }
    }

    #[test]
    fn rejected_enable_waits_for_a_limited_time_that_begins_after_a_stop() {
        let mut orders = Orders::default();
        let late = READY_TIME_OUT + DurationNs(1);
        assert!(!orders.is_pending_late(NOW + late, false), "nothing is asked for");
        orders.want(Wish { intent: Intent::Enable, request: None });
        orders.reject_enable(NOW);
        assert!(!orders.is_pending_late(NOW + READY_TIME_OUT, false));
        assert!(orders.is_pending_late(NOW + late, false));
        let stopped = NOW + late * 5;
        assert!(!orders.is_pending_late(stopped, true), "the stop has its own limit");
        assert!(!orders.is_pending_late(stopped + READY_TIME_OUT, false));
        assert!(orders.is_pending_late(stopped + late, false));
        assert!(orders.take_pending() && !orders.is_pending_late(stopped + late, false));
    }

    #[test]
    fn a_request_counts_once() {
        let mut orders = Orders::default();
        assert!(orders.is_new(0) && !orders.is_new(0) && orders.is_new(1) && orders.is_new(0));
        orders.forget_number();
        assert!(orders.is_new(0) && !orders.is_new(0), "of somebody else");
    }
}
