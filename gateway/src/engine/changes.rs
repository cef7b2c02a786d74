//! Tells people of axes: new states and faults, and axes that wait for long.

use profile_generic::fault::FaultCause;
use profile_generic::state::DriveState;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::axis::{Awaited, AxisChannel};
use super::notice::Notice;
use crate::status::AxisWait;

/// How long an axis waits before its wait is reported; ten times as long before it is reported again.
const WAIT_REPORTED: DurationNs = DurationNs::from_secs(1);

/// What was reported of each axis.
#[derive(Debug)]
pub(super) struct Changes(Vec<Reported>);

#[derive(Debug)]
struct Reported {
    /// The generic state and fault that were reported last.
    state: (DriveState, Option<FaultCause>),
    /// What the axis waits for, and since when.
    waits: Option<(Awaited, MonotonicTime)>,
    /// How long the wait may last until it is reported, or reported again.
    limit: DurationNs,
}

impl Changes {
    pub fn new(axes: &[AxisChannel]) -> Self {
        let reported = |axis: &AxisChannel| Reported {
            state: (axis.state(), None),
            waits: None,
            limit: DurationNs::ZERO,
        };
        Self(axes.iter().map(reported).collect())
    }

    /// Reports what is new; whether a state or fault is.
    pub fn report(
        &mut self,
        now: MonotonicTime,
        axes: &[AxisChannel],
        notice: &mut dyn FnMut(Notice),
    ) -> bool {
        let mut changed = false;
        for (number, (axis, reported)) in (0_u8..).zip(axes.iter().zip(&mut self.0)) {
            changed |= reported.state(number, axis, notice);
        }
        for (number, (axis, reported)) in (0_u8..).zip(axes.iter().zip(&mut self.0)) {
            reported.wait(now, number, axis, notice);
        }
        changed
    }

    /// The wait of an axis for the published status; `None` until it is long enough to be reported.
    pub fn wait(&self, now: MonotonicTime, number: usize, axis: &AxisChannel) -> Option<AxisWait> {
        let (awaited, since) = self.0.get(number)?.waits?;
        let time = now.since(since);
        let waiting = (time >= WAIT_REPORTED).then(|| axis.waiting()).flatten()?;
        (waiting.awaited == awaited).then(|| AxisWait::new(waiting, time))
    }
}

impl Reported {
    fn state(&mut self, number: u8, axis: &AxisChannel, notice: &mut dyn FnMut(Notice)) -> bool {
        let fault = axis.fault();
        let now = (axis.state(), fault.map(|fault| fault.cause));
        if self.state == now {
            return false;
        }
        let before = std::mem::replace(&mut self.state, now);
        if now.0 != before.0 {
            notice(Notice::State { axis: number, from: before.0, to: now.0 });
        }
        // Once more when it is known which one the drive has.
        if let Some(fault) = fault.filter(|fault| before.1 != Some(fault.cause)) {
            let (loss, trip, jump) = (axis.loss(), axis.tripped(), axis.jump());
            notice(Notice::Fault { axis: number, fault, loss, trip, jump });
        }
        true
    }

    fn wait(&mut self, now: MonotonicTime, number: u8, axis: &AxisChannel, notice: &mut dyn FnMut(Notice)) {
        let awaited = axis.awaited();
        let Some((known, since)) = self.waits.filter(|(known, _)| Some(*known) == awaited) else {
            self.waits = awaited.map(|awaited| (awaited, now));
            self.limit = WAIT_REPORTED;
            return;
        };
        let time = now.since(since);
        if time < self.limit {
            return;
        }
        self.limit = self.limit * 10;
        if let Some(waiting) = axis.waiting().filter(|waiting| waiting.awaited == known) {
            notice(Notice::Waiting { axis: number, wait: AxisWait::new(waiting, time) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::axis::Limits;
    use profile_generic::fault::Reaction;
    use profile_generic::state::Report;
    use profile_generic::time::SystemTime;

    fn report(changes: &mut Changes, axes: &[AxisChannel], seconds: i64) -> (bool, Vec<Notice>) {
        let mut notices = Vec::new();
        let now = MonotonicTime::ZERO + DurationNs::from_secs(seconds);
        let changed = changes.report(now, axes, &mut |notice| notices.push(notice));
        (changed, notices)
    }

    fn axes() -> [AxisChannel; 2] {
        [(); 2].map(|()| AxisChannel::new(Limits::default(), Reaction::HoldPosition, true))
    }

    #[test]
    fn state_and_fault_are_reported_once() {
        let mut axes = axes();
        let mut changes = Changes::new(&axes);
        let (at, system) = (MonotonicTime(1), SystemTime(1));
        axes[1].report(at, system, Report::Ready);
        let (changed, notices) = report(&mut changes, &axes, 0);
        let expected = Notice::State { axis: 1, from: DriveState::NotReady, to: axes[1].state() };
        assert_eq!((changed, notices), (true, vec![expected]));
        assert_eq!(report(&mut changes, &axes, 0), (false, vec![]));
        axes[0].refuse_configuration(at, system);
        let (changed, notices) = report(&mut changes, &axes, 0);
        let [.., Notice::Fault { axis: 0, fault, .. }] = &notices[..] else { panic!("{notices:?}") };
        assert_eq!((changed, fault.cause), (true, FaultCause::CONFIGURATION));
        assert_eq!(report(&mut changes, &axes, 0), (false, vec![]));
    }

    #[test]
    fn wait_is_reported_after_one_second_and_after_ten() {
        let axes = &axes()[..1];
        assert_eq!(axes[0].awaited(), Some(Awaited::Drive), "no drive is there");
        let mut changes = Changes::new(axes);
        let reported: Vec<i64> =
            (0..30).filter(|seconds| !report(&mut changes, axes, *seconds).1.is_empty()).collect();
        assert_eq!(reported, [1, 10]);
        let wait = |seconds| {
            changes.wait(MonotonicTime::ZERO + DurationNs::from_secs(seconds), 0, &axes[0]).is_some()
        };
        assert_eq!([wait(0), wait(1), wait(30)], [false, true, true]);
    }
}
