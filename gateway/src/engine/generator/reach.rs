//! What an axis can do and may do: modes of its drive, limits of its configuration.

use profile_generic::mode::ModeSelection;
use profile_generic::quantity::{Acceleration, Position, Velocity};
use profile_generic::time::DurationNs;

use super::{POSITION, VELOCITY};
use crate::engine::axis::AxisChannel;

/// Largest distance from the target at which a movement is completed: a hundredth of a unit, or this part of the following error
/// limit if that is more.
const IN_POSITION: Position = Position(10_000_000);
const IN_POSITION_DIVISOR: i64 = 20;

/// Why an axis cannot or must not move like this.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Misfit {
    /// The drive is not set up for this mode.
    Mode(ModeSelection),
    /// Neither the request nor the configuration gives an acceleration.
    NoAcceleration,
    /// Velocity or acceleration is zero or negative.
    NotPositive,
    /// Above this limit of the configuration.
    TooFast(Velocity),
    /// Above this limit of the configuration.
    TooSteep(Acceleration),
    /// Beyond this limit of the configuration.
    Beyond(Position),
}

/// Checks a velocity and an acceleration against the limits of the axis; returns the acceleration to use.
pub(crate) fn acceleration(
    axis: &AxisChannel,
    velocity: Velocity,
    given: Option<Acceleration>,
) -> Result<Acceleration, Misfit> {
    let limits = axis.limits();
    let beyond = |limit: &Velocity| velocity.get().unsigned_abs() > limit.get().unsigned_abs();
    if let Some(limit) = limits.velocity.filter(beyond) {
        return Err(Misfit::TooFast(limit));
    }
    let configured = limits.acceleration.or(axis.stop_settings().deceleration);
    let acceleration = given.or(configured).ok_or(Misfit::NoAcceleration)?;
    if acceleration <= Acceleration::ZERO {
        return Err(Misfit::NotPositive);
    }
    match limits.acceleration.filter(|limit| acceleration > *limit) {
        Some(limit) => Err(Misfit::TooSteep(limit)),
        None => Ok(acceleration),
    }
}

/// Checks a target, and the velocity on the way to it.
pub(crate) fn target(axis: &AxisChannel, target: Position, velocity: Velocity) -> Result<(), Misfit> {
    if velocity <= Velocity::ZERO {
        return Err(Misfit::NotPositive);
    }
    let limits = axis.limits();
    let beyond = limits.position_max.filter(|end| target > *end);
    match beyond.or(limits.position_min.filter(|end| target < *end)) {
        Some(end) => Err(Misfit::Beyond(end)),
        None => Ok(()),
    }
}

/// Where a movement at this velocity has to end; `None` where there is no limit ahead.
pub(crate) fn end_of_travel(axis: &AxisChannel, velocity: Velocity) -> Result<Option<Position>, Misfit> {
    // Velocity zero brakes, wherever the axis is.
    if velocity == Velocity::ZERO {
        return Ok(None);
    }
    let (limits, here) = (axis.limits(), axis.feedback().position);
    let backward = velocity < Velocity::ZERO;
    let Some(limit) = (if backward { limits.position_min } else { limits.position_max }) else {
        return Ok(None);
    };
    if if backward { here < limit } else { here > limit } {
        return Err(Misfit::Beyond(limit));
    }
    // The drive may overshoot the profile slightly.
    Ok(Some(match backward {
        true => limit.saturating_add(IN_POSITION).min(here),
        false => limit.saturating_sub(IN_POSITION).max(here),
    }))
}

/// The mode in which an axis moves at a velocity.
pub(crate) fn run_mode(axis: &AxisChannel) -> Result<ModeSelection, Misfit> {
    let mode = [POSITION, VELOCITY].into_iter().find(|mode| has(axis, *mode));
    mode.ok_or(Misfit::Mode(POSITION))
}

/// Whether the axis is at its target.
pub(crate) fn is_in_position(axis: &AxisChannel, target: Position) -> bool {
    let bound = axis.limits().following_error.map_or(0, |limit| limit.get() / IN_POSITION_DIVISOR);
    let bound = bound.max(IN_POSITION.get()).unsigned_abs();
    axis.feedback().position.get().abs_diff(target.get()) <= bound
}

/// Whether the drive of the axis is set up for a mode.
pub(crate) fn has(axis: &AxisChannel, mode: ModeSelection) -> bool {
    axis.south().is_some_and(|program| program.has_mode(mode))
}

/// Whether an axis in velocity control has to brake now to stop ahead of its position limit: until the drive follows, it goes on for
/// `delay`.
pub(super) fn runs_beyond(axis: &AxisChannel, braking: Acceleration, delay: DurationNs) -> bool {
    let (limits, feedback) = (axis.limits(), axis.feedback());
    let velocity = i128::from(feedback.velocity.get());
    let rest = velocity * velocity / (2 * i128::from(braking.get().max(1))) * velocity.signum();
    let goes_on = velocity * i128::from(delay.as_nanos()) / 1_000_000_000;
    let place = i128::from(feedback.position.get()) + rest + goes_on;
    let margin = i128::from(IN_POSITION.get());
    let above = |end: Position| velocity > 0 && place > i128::from(end.get()) - margin;
    let below = |end: Position| velocity < 0 && place < i128::from(end.get()) + margin;
    limits.position_max.is_some_and(above) || limits.position_min.is_some_and(below)
}
