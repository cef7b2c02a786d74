//! Limits that may be passed for a time: those of the velocity error and of the torque, as the controller has set them.

use profile_generic::fault::FaultCause;
use profile_generic::quantity::{Torque, Velocity};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::supervision::Conditions;

/// What an axis may differ from its command by, and give, and for how long. Without a value nothing is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tolerances {
    /// Velocity Error Tolerance (attribute 465).
    pub velocity_error: Option<Velocity>,
    /// How long it may be passed (attribute 466).
    pub velocity_error_time: DurationNs,
    /// Overtorque Limit (attribute 508), of both directions.
    pub over_torque: Option<Torque>,
    /// How long it may be passed (attribute 509); without a time it is not watched.
    pub over_torque_time: Option<DurationNs>,
    /// Undertorque Limit (attribute 510), of both directions.
    pub under_torque: Option<Torque>,
    /// How long the torque may be below it (attribute 511); without a time it is not watched.
    pub under_torque_time: Option<DurationNs>,
}

/// Since when each of them is passed.
#[derive(Debug, Default)]
pub(super) struct ToleranceWatch {
    velocity_error: Option<MonotonicTime>,
    over_torque: Option<MonotonicTime>,
    under_torque: Option<MonotonicTime>,
}

impl ToleranceWatch {
    /// Which of them have been passed for too long by now. `error` and `torque` are those of an axis under control, where they are known.
    pub fn look(
        &mut self,
        now: MonotonicTime,
        tolerances: &Tolerances,
        error: Option<Velocity>,
        torque: Option<Torque>,
    ) -> Conditions<3> {
        let astray = |limit: Velocity| {
            error.is_some_and(|error| error.get().unsigned_abs() > limit.get().unsigned_abs())
        };
        let astray = tolerances.velocity_error.is_some_and(astray);
        let strained = |limit: Torque| {
            torque.is_some_and(|torque| torque.get().unsigned_abs() > limit.get().unsigned_abs())
        };
        let strained = tolerances.over_torque.is_some_and(strained);
        let slack = |limit: Torque| {
            torque.is_some_and(|torque| torque.get().unsigned_abs() < limit.get().unsigned_abs())
        };
        let slack = tolerances.under_torque.is_some_and(slack);
        let astray = lasts(&mut self.velocity_error, now, astray, Some(tolerances.velocity_error_time));
        let strained = lasts(&mut self.over_torque, now, strained, tolerances.over_torque_time);
        let slack = lasts(&mut self.under_torque, now, slack, tolerances.under_torque_time);
        [
            (FaultCause::EXCESSIVE_VELOCITY_ERROR, astray),
            (FaultCause::OVER_TORQUE, strained),
            (FaultCause::UNDER_TORQUE, slack),
        ]
    }
}

/// Whether it has been so for longer than `time`; never without one.
fn lasts(
    since: &mut Option<MonotonicTime>,
    now: MonotonicTime,
    is_so: bool,
    time: Option<DurationNs>,
) -> bool {
    let Some(time) = time.filter(|_| is_so) else {
        *since = None;
        return false;
    };
    now.since(*since.get_or_insert(now)) >= time
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: i64 = 1_000_000_000;

    #[test]
    fn a_tolerance_may_be_passed_for_its_time_and_no_longer() {
        let tolerances = Tolerances {
            velocity_error: Some(Velocity(UNIT)),
            velocity_error_time: DurationNs::from_millis(20),
            over_torque: Some(Torque(500_000)),
            over_torque_time: Some(DurationNs::from_millis(5)),
            under_torque: Some(Torque(100)),
            under_torque_time: Some(DurationNs::from_millis(2)),
        };
        let mut watch = ToleranceWatch::default();
        let at = |millis| MonotonicTime(1) + DurationNs::from_millis(millis);
        for (millis, error, torque, expected) in [
            (0, UNIT, 500_000, [false; 3]),
            (1, -UNIT - 1, 500_001, [false; 3]),
            (5, -UNIT - 1, -500_001, [false; 3]),
            (6, UNIT + 1, -500_001, [false, true, false]),
            (20, UNIT + 1, 0, [false; 3]),
            (21, -UNIT - 1, 500_001, [true, false, false]),
            (22, UNIT, 500_001, [false; 3]),
            (23, UNIT + 1, 500_001, [false; 3]),
            (43, UNIT + 1, 500_001, [true, true, false]),
            (50, UNIT, 99, [false; 3]),
            (51, UNIT, -99, [false; 3]),
            (52, UNIT, 0, [false, false, true]),
            (53, UNIT, -100, [false; 3]),
            (54, UNIT, 99, [false; 3]),
        ] {
            let passed = watch.look(at(millis), &tolerances, Some(Velocity(error)), Some(Torque(torque)));
            assert_eq!(passed.map(|(_, is_there)| is_there), expected, "{millis} ms");
            assert_eq!(passed[0].0, FaultCause::EXCESSIVE_VELOCITY_ERROR);
            assert_eq!(passed[1].0, FaultCause::OVER_TORQUE);
            assert_eq!(passed[2].0, FaultCause::UNDER_TORQUE);
        }
        // The axis is not controlled, or the drive does not report its torque: the time begins anew.
        let passed = watch.look(at(64), &tolerances, None, None);
        assert_eq!(passed.map(|(_, is_there)| is_there), [false; 3]);
        let passed = watch.look(at(65), &tolerances, Some(Velocity(9 * UNIT)), Some(Torque(900_000)));
        assert_eq!(passed.map(|(_, is_there)| is_there), [false; 3]);
    }

    #[test]
    fn what_was_not_set_is_not_watched_and_a_torque_without_a_time_neither() {
        let mut watch = ToleranceWatch::default();
        let mut look = |tolerances: &Tolerances, at| {
            let error = Some(Velocity(i64::MIN));
            watch.look(MonotonicTime(at), tolerances, error, Some(Torque(i64::MIN))).map(|(_, there)| there)
        };
        assert_eq!(look(&Tolerances::default(), 1), [false; 3]);
        let tolerances = Tolerances {
            velocity_error: Some(Velocity(UNIT)),
            over_torque: Some(Torque(1)),
            under_torque: Some(Torque(i64::MAX)),
            ..Tolerances::default()
        };
        assert_eq!(
            look(&tolerances, 2),
            [true, false, false],
            "a velocity error without a time counts at once"
        );
        assert_eq!(look(&tolerances, 1_000_000_000), [true, false, false]);
    }
}
