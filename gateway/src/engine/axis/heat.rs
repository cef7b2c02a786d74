//! How warm motor and power stage are by their load, where the drive does not show it: an estimate of the first order with a thermal time
//! constant from the configuration. It trips nothing.

use profile_generic::quantity::Torque;
use profile_generic::time::{DurationNs, MonotonicTime};

/// A load that was not heard of for longer counts for this time only.
const LONGEST: DurationNs = DurationNs::from_millis(1_000);

/// Parts of the estimate in a millionth, so that a cycle that is short against the time constant is not lost in rounding.
const FINE: i128 = 1_000_000_000;

/// The estimate of one part, 1e-15 of what its rated load comes to.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Heat(i128);

impl Heat {
    /// Millionths of what the rated load comes to in the end.
    pub fn millionths(self) -> i64 {
        i64::try_from(self.0 / FINE).unwrap_or(i64::MAX)
    }

    /// Time with a load, in parts of the rated one, passes.
    fn load(&mut self, torque: Torque, time: DurationNs, constant: DurationNs) {
        let load = i128::from(torque.get());
        let end = (load * load / 1_000_000).min(i128::from(i64::MAX)) * FINE;
        let (time, constant) = (i128::from(time.0), i128::from(constant.0).max(1));
        self.0 += (end - self.0) * time.clamp(0, constant) / constant;
    }
}

/// The estimates of one axis.
#[derive(Debug, Default)]
pub(super) struct Heats {
    pub motor: Heat,
    pub drive: Heat,
    /// Time constants of motor and power stage; what has none is not estimated.
    constants: [Option<DurationNs>; 2],
    at: Option<MonotonicTime>,
}

impl Heats {
    /// Sets the time constants of motor and power stage.
    pub fn set_constants(&mut self, constants: [Option<DurationNs>; 2]) {
        self.constants = constants;
    }

    /// Takes the torque of a cycle.
    pub fn sample(&mut self, now: MonotonicTime, torque: Torque) {
        let Some(before) = self.at.replace(now) else { return };
        let time = now.since(before).min(LONGEST);
        for (heat, constant) in [&mut self.motor, &mut self.drive].into_iter().zip(self.constants) {
            if let Some(constant) = constant {
                heat.load(torque, time, constant);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two thirds of the way in a time constant and a bit: 1 - 1/e.
    #[test]
    fn heat_follows_the_square_of_the_load() {
        let mut heats = Heats::default();
        heats.set_constants([Some(DurationNs::from_millis(600_000)), None]);
        let at = |millis| MonotonicTime(1) + DurationNs::from_millis(millis);
        for millis in 0..=600_000 {
            heats.sample(at(millis), Torque(-2_000_000));
        }
        let share = heats.motor.millionths();
        // 4 (1 - 1/e).
        assert!(share.abs_diff(2_528_482) < 100, "{share}");
        assert_eq!(heats.drive.millionths(), 0, "it has no time constant");
        for millis in 600_001..=3_600_000 {
            heats.sample(at(millis), Torque(0));
        }
        let rest = heats.motor.millionths();
        assert!((15_000..20_000).contains(&rest), "five time constants later: {rest}");
    }

    #[test]
    fn a_load_that_was_not_heard_of_counts_for_a_second() {
        let mut heats = Heats::default();
        heats.set_constants([Some(DurationNs::from_millis(10_000)); 2]);
        let at = |millis| MonotonicTime(1) + DurationNs::from_millis(millis);
        heats.sample(at(0), Torque(1_000_000));
        heats.sample(at(100_000), Torque(1_000_000));
        assert_eq!(heats.motor.millionths(), 100_000, "a tenth of the time constant");
        assert_eq!(heats.drive.millionths(), 100_000);
        heats.sample(at(99_000), Torque(i64::MAX));
        assert_eq!(heats.motor.millionths(), 100_000, "no time has passed");
        heats.sample(at(200_000), Torque(i64::MIN));
        assert!(heats.motor.millionths() > 1_000_000_000, "nor does it overflow");
    }
}
