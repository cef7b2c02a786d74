//! The end of a box: which axes are waited for, how long, and which did not come to rest.

use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use super::axis::AxisChannel;
use super::axis::rest::Unrested;

/// Beyond the limits of the axes, before the buses of a box that ends go down whatever the axes do: telegrams take their time.
const END_MARGIN: DurationNs = DurationNs::from_secs(1);

#[derive(Debug)]
pub(super) struct Ending {
    /// The box is to end.
    pub has_begun: bool,
    deadline: MonotonicTime,
    /// The axes that were on the move, or could be.
    awaited: Vec<bool>,
    /// Nobody is waited for any longer.
    pub is_over: bool,
    /// The axes that did not come to rest, or were not seen to.
    pub unrested: Vec<Unrested>,
}

impl Ending {
    /// The end of a box with so many axes; there is room for all of them.
    pub fn new(axes: usize) -> Self {
        Self {
            has_begun: false,
            deadline: MonotonicTime::MAX,
            awaited: vec![false; axes],
            is_over: false,
            unrested: Vec::with_capacity(axes),
        }
    }

    /// Stops all axes as on a lost command.
    pub fn begin(&mut self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel]) {
        self.has_begun = true;
        let mut limit = DurationNs::ZERO;
        for (axis, awaited) in axes.iter_mut().zip(&mut self.awaited) {
            *awaited = axis.is_stopping();
            axis.end(now, system);
            if *awaited {
                limit = limit.max(axis.stop_limit());
            }
        }
        self.deadline = now + limit + END_MARGIN;
    }

    /// No axis is waited for any longer.
    pub fn hurry(&mut self, now: MonotonicTime) {
        self.deadline = self.deadline.min(now);
    }

    /// Whether the buses may go down. Notes once which axes do not stand.
    pub fn advance(&mut self, now: MonotonicTime, system: SystemTime, axes: &mut [AxisChannel]) -> bool {
        if !self.has_begun || self.is_over {
            return self.is_over;
        }
        // No axis gets torque any more; one that has it against that is waited for as well.
        let awaited = || {
            let all = axes.iter().enumerate().zip(&self.awaited);
            all.filter(|((_, axis), awaited)| **awaited || axis.may_have_torque())
        };
        if now < self.deadline && !awaited().all(|((_, axis), _)| axis.has_stopped()) {
            return false;
        }
        self.is_over = true;
        self.unrested.extend(awaited().filter_map(|((number, axis), _)| axis.unrested(number)));
        // That these drives are not heard any more is no fault.
        let free = axes.iter_mut().filter(|axis| !axis.may_have_torque());
        free.for_each(|axis| axis.leave_south(now, system));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::axis::Limits;
    use profile_generic::fault::Reaction;
    use profile_generic::state::{Report, Request};

    const SYSTEM: SystemTime = SystemTime(1);

    fn at(seconds: i64) -> MonotonicTime {
        MonotonicTime::ZERO + DurationNs::from_secs(seconds)
    }

    /// An axis in operation, and one whose drive is not there.
    fn axes() -> [AxisChannel; 2] {
        let mut axes =
            [(); 2].map(|()| AxisChannel::new(Limits::default(), Reaction::DecelerateAndDisable, true));
        axes[0].report(at(0), SYSTEM, Report::Ready);
        axes[0].request(at(0), SYSTEM, Request::Enable);
        axes[0].report(at(0), SYSTEM, Report::Operating);
        axes
    }

    #[test]
    fn axis_with_torque_is_waited_for_until_its_own_limit() {
        let mut axes = axes();
        let limit = axes[0].stop_limit();
        let mut ending = Ending::new(2);
        assert!(!ending.advance(at(9), SYSTEM, &mut axes), "nobody ends");
        ending.begin(at(10), SYSTEM, &mut axes);
        let deadline = at(10) + axes[0].stop_limit().max(limit) + END_MARGIN;
        assert!(!ending.advance(deadline - DurationNs(1), SYSTEM, &mut axes));
        assert!(ending.advance(deadline, SYSTEM, &mut axes));
        let numbers: Vec<_> = ending.unrested.iter().map(|unrested| unrested.axis).collect();
        assert_eq!(numbers, [0]);
        assert!(ending.advance(deadline, SYSTEM, &mut axes));
        assert_eq!(ending.unrested.len(), 1, "noted once");
    }

    #[test]
    fn box_without_torque_ends_at_once_and_a_hurried_one_too() {
        let mut axes = axes();
        let mut ending = Ending::new(1);
        ending.begin(at(10), SYSTEM, &mut axes[1..]);
        assert!(ending.advance(at(10), SYSTEM, &mut axes[1..]));
        assert!(ending.unrested.is_empty());
        let mut ending = Ending::new(2);
        ending.begin(at(10), SYSTEM, &mut axes);
        assert!(!ending.advance(at(11), SYSTEM, &mut axes));
        ending.hurry(at(11));
        assert!(ending.advance(at(11), SYSTEM, &mut axes));
    }
}
