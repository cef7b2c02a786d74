//! What can be said of a step before anything is sent.

use super::axis::check_torque_step;
use super::config::{AxisSetup, ControllerConfig, Scaling};
use super::failure::Failure;
use super::format::check_step;
use super::program::{Redefine, Step};
use super::sets::cyclic_len;
use super::trajectory::{Limits, Profile, State};
use crate::wire::motion::Format;

impl Step {
    /// Finds what makes the step fail for certain on axes set up like this: an axis that is not there or not scaled,
    /// a value beyond a limit, a motion that cannot be planned.
    ///
    /// # Errors
    /// The failure that the step would end with.
    // Flat: one arm per step.
    pub fn check(&self, config: &ControllerConfig) -> Result<(), Failure> {
        let count = u8::try_from(config.axes.len()).unwrap_or(u8::MAX);
        if let Some(axis) = self.unknown_axis(count) {
            return Err(Failure::UnknownAxis { axis, count });
        }
        if config.format == Format::Fixed {
            check_step(self, config)?;
        }
        match self {
            Self::MoveAbsolute { axis, position, limits } => {
                let setup = scaled(config, *axis)?;
                motion(setup, *axis, *limits)?;
                setup.limits.check_position(*axis, *position)?;
                in_range(setup, *axis, *position)?;
                plan(*axis, Profile::to_position(0.0, *position, *limits))
            }
            Self::MoveRelative { axis, distance, limits } => {
                motion(scaled(config, *axis)?, *axis, *limits)?;
                plan(*axis, Profile::to_position(0.0, *distance, *limits))
            }
            Self::Jog { axis, velocity, acceleration, jerk, seconds } => {
                let limits = Limits { velocity: velocity.abs(), acceleration: *acceleration, jerk: *jerk };
                motion(scaled(config, *axis)?, *axis, limits)?;
                plan(*axis, Profile::jog(State::default(), *velocity, *seconds, limits))
            }
            Self::RunAt { axis, velocity, acceleration, jerk } => {
                let limits = Limits { velocity: velocity.abs(), acceleration: *acceleration, jerk: *jerk };
                motion(scaled(config, *axis)?, *axis, limits)?;
                plan(*axis, Profile::to_velocity(State::default(), *velocity, unlimited(limits)))
            }
            Self::Stop { axis, acceleration, jerk } => {
                let limits = Limits { velocity: 1.0, acceleration: *acceleration, jerk: *jerk };
                plan(*axis, Profile::to_velocity(State::default(), 0.0, limits))
            }
            Self::Torque { axis, torque, rate, velocity_limit } => {
                let setup = scaled(config, *axis)?;
                check_torque_step(*axis, *torque, *rate, *velocity_limit)?;
                setup.limits.check_torque(*axis, *torque)
            }
            Self::RedefinePosition { axis, change } => {
                let (Redefine::To(value) | Redefine::By(value)) = *change;
                in_range(scaled(config, *axis)?, *axis, value)
            }
            Self::DataSets { axis, sets } if config.format == Format::Variable => {
                let mut axes = config.axes.clone();
                axes[usize::from(*axis) - 1].sets = *sets;
                let needed = cyclic_len(&axes);
                let size = config.connection_size;
                if needed > usize::from(size) { Err(Failure::DataTooLong { needed, size }) } else { Ok(()) }
            }
            Self::Together(steps) | Self::Sequence(steps) => steps.iter().try_for_each(|s| s.check(config)),
            Self::Within { step, .. } => step.check(config),
            _ => Ok(()),
        }
    }
}

fn scaled(config: &ControllerConfig, axis: u8) -> Result<&AxisSetup, Failure> {
    let setup = usize::from(axis).checked_sub(1).and_then(|index| config.axes.get(index));
    setup.filter(|setup| setup.scaling != Scaling::Unknown).ok_or(Failure::NotScaled { axis })
}

fn motion(setup: &AxisSetup, axis: u8, limits: Limits) -> Result<(), Failure> {
    setup.limits.check_motion(axis, limits)
}

/// A velocity of zero needs no limit above zero.
fn unlimited(limits: Limits) -> Limits {
    Limits { velocity: 1.0, ..limits }
}

fn in_range(setup: &AxisSetup, axis: u8, units: f64) -> Result<(), Failure> {
    let Scaling::Counts(scale) = setup.scaling else { return Ok(()) };
    let counts = units * scale;
    if setup.has_room_for(counts) {
        return Ok(());
    }
    Err(Failure::OutOfRange { axis, counts })
}

fn plan(axis: u8, profile: Result<Profile, super::trajectory::ProfileError>) -> Result<(), Failure> {
    profile.map(|_| ()).map_err(|error| Failure::Profile { axis, error })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::limits::AxisLimits;
    use crate::wire::motion::codes::{ActualDataSet, StatusDataSet};

    const LIMITS: Limits = Limits { velocity: 2.0, acceleration: 20.0, jerk: 200.0 };

    #[test]
    fn each_step_that_must_fail_is_found_before_anything_is_sent() {
        let mut axis = AxisSetup::position(1000.0);
        axis.limits = AxisLimits {
            velocity: Some(2.0),
            acceleration: Some(20.0),
            position: Some((-1.0, 5.0)),
            torque: Some(30.0),
        };
        let mut config = ControllerConfig::new(None, vec![axis, AxisSetup::unscaled()]);
        config.connection_size = 300;
        let go = |axis, position, limits| Step::MoveAbsolute { axis, position, limits };
        let jog = |velocity| Step::Jog { axis: 1, velocity, acceleration: 1.0, jerk: 1.0, seconds: 1.0 };
        let run = |velocity| Step::RunAt { axis: 1, velocity, acceleration: 1.0, jerk: 1.0 };
        let torque = |torque| Step::Torque { axis: 1, torque, rate: 10.0, velocity_limit: 1.0 };
        let mut sets = config.axes[0].sets;
        let good = [
            go(1, 5.0, LIMITS),
            jog(-2.0),
            run(0.0),
            torque(-30.0),
            Step::DataSets { axis: 1, sets },
            Step::RedefinePosition { axis: 1, change: Redefine::To(100.0) },
        ];
        for step in good {
            assert_eq!(step.check(&config), Ok(()), "{step}");
        }
        sets.actual = ActualDataSet::from_bits_retain(0b1100_0111);
        sets.status = StatusDataSet::from_bits_retain(0b0001_1111);
        config.connection_size = 180;
        let bad = [
            (go(3, 0.0, LIMITS), "axis 3: expected an axis from 1 to 2"),
            (go(2, 0.0, LIMITS), "axis 2: does not move, because the counts of its unit are not known"),
            (go(1, 5.5, LIMITS), "axis 1: position 5.5 is beyond the limit 5"),
            (go(1, 1.0, Limits { velocity: 2.5, ..LIMITS }), "axis 1: velocity 2.5 is beyond the limit 2"),
            (
                go(1, 1.0, Limits { acceleration: 21.0, ..LIMITS }),
                "axis 1: acceleration 21 is beyond the limit 20",
            ),
            (
                go(1, 1.0, Limits { jerk: 0.0, ..LIMITS }),
                "axis 1: jerk limit: expected a number that is finite and above zero, found 0",
            ),
            (Step::Together(vec![jog(-3.0)]), "axis 1: velocity 3 is beyond the limit 2"),
            (run(3.0), "axis 1: velocity 3 is beyond the limit 2"),
            (torque(31.0), "axis 1: torque 31 is beyond the limit 30"),
            (
                Step::RedefinePosition { axis: 1, change: Redefine::By(3e6) },
                "axis 1: 3000000000 counts are beyond the 32-bit range of Command Position",
            ),
            (
                Step::DataSets { axis: 1, sets },
                "the data sets of the axes need 190 bytes, the connection has 180",
            ),
        ];
        for (step, text) in bad {
            assert_eq!(step.check(&config).unwrap_err().to_string(), text, "{step}");
        }
    }
}
