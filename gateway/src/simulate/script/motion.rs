//! Verbs that move an axis, or change how it is moved.

use profile_cip::controller::program::Redefine;
use profile_cip::controller::{Limits, Step};
use profile_cip::wire::motion::codes::FeedbackMode;
use profile_generic::time::DurationNs;

use super::connection::{ACTUAL_POSITION_TYPES, FEEDBACKS, MODES};
use super::reader::{Keys, Value, table, time};
use super::step::{Frame, axis};

/// Jerk where nobody says: the acceleration is reached in a tenth of a second.
const JERK_FACTOR: f64 = 10.0;
/// How long to wait for a window where the step does not say.
const WINDOW_WAIT: DurationNs = DurationNs::from_secs(5);

fn keys<'a, 't>(value: &'a Value<'t>, what: &'a str, frame: &'a Frame<'_>) -> Option<(Keys<'a, 't>, u8)> {
    let mut keys = table(value, what, frame.problems)?;
    let axis = axis(keys.need("axis")?, frame)?;
    Some((keys, axis))
}

/// Acceleration and jerk, as the step or the axis has them.
fn ramp(keys: &mut Keys<'_, '_>, axis: u8, frame: &Frame<'_>) -> Option<(f64, f64)> {
    let usual = frame.motion[usize::from(axis) - 1];
    let acceleration = keys.number_or("acceleration", usual.acceleration)?;
    let jerk = keys.number_or("jerk", Some(usual.jerk.unwrap_or(acceleration * JERK_FACTOR)))?;
    Some((acceleration, jerk))
}

/// `move = { axis, to | by, velocity, acceleration, jerk }`
pub(super) fn go(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "move", frame)?;
    let usual = frame.motion[usize::from(axis) - 1];
    let (to, by) = (keys.maybe_number("to")?, keys.maybe_number("by")?);
    let velocity = keys.number_or("velocity", usual.velocity)?;
    let (acceleration, jerk) = ramp(&mut keys, axis, frame)?;
    let limits = Limits { velocity, acceleration, jerk };
    let step = match (to, by) {
        (Some(position), None) => Step::MoveAbsolute { axis, position, limits },
        (None, Some(distance)) => Step::MoveRelative { axis, distance, limits },
        _ => return one_of(&keys, "to", "by"),
    };
    keys.finish()?;
    Some(step)
}

fn one_of<T>(keys: &Keys<'_, '_>, a: &str, b: &str) -> Option<T> {
    let title = format!("`{a}` and `{b}` are one or the other");
    keys.problems.report(keys.span(), title, format_args!("expected one of them"))
}

/// `jog = { axis, velocity, for, acceleration, jerk }`
pub(super) fn jog(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "jog", frame)?;
    let velocity = keys.number("velocity")?;
    let span = time(keys.need("for")?, "for", frame.problems)?;
    let (acceleration, jerk) = ramp(&mut keys, axis, frame)?;
    keys.finish()?;
    let seconds = profile_generic::cast::f64_from_i64(span.0) / 1e9;
    Some(Step::Jog { axis, velocity, acceleration, jerk, seconds })
}

/// `velocity = { axis, velocity, acceleration, jerk }`
pub(super) fn velocity(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "velocity", frame)?;
    let velocity = keys.number("velocity")?;
    let (acceleration, jerk) = ramp(&mut keys, axis, frame)?;
    keys.finish()?;
    Some(Step::RunAt { axis, velocity, acceleration, jerk })
}

/// `torque = { axis, torque, rate, velocity_limit }`
pub(super) fn torque(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "torque", frame)?;
    let step = Step::Torque {
        axis,
        torque: keys.number("torque")?,
        rate: keys.number("rate")?,
        velocity_limit: keys.number("velocity_limit")?,
    };
    keys.finish()?;
    Some(step)
}

/// `stop = { axis, acceleration, jerk }`
pub(super) fn stop(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "stop", frame)?;
    let (acceleration, jerk) = ramp(&mut keys, axis, frame)?;
    keys.finish()?;
    Some(Step::Stop { axis, acceleration, jerk })
}

/// `mode = { axis, control }`
pub(super) fn mode(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "mode", frame)?;
    let mode = keys.word("control", MODES)?;
    keys.finish()?;
    Some(Step::Mode { axis, mode })
}

/// `feedback = { axis, source, actual_position_type }`
pub(super) fn feedback(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "feedback", frame)?;
    let source = keys.word("source", FEEDBACKS)?;
    let lint = keys.word_or("actual_position_type", ACTUAL_POSITION_TYPES, false)?;
    keys.finish()?;
    Some(Step::Feedback { axis, mode: FeedbackMode(source.0).with_lint(lint) })
}

/// `redefine_position = { axis, to | by }`
pub(super) fn redefine(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "redefine_position", frame)?;
    let change = match (keys.maybe_number("to")?, keys.maybe_number("by")?) {
        (Some(position), None) => Redefine::To(position),
        (None, Some(distance)) => Redefine::By(distance),
        _ => return one_of(&keys, "to", "by"),
    };
    keys.finish()?;
    Some(Step::RedefinePosition { axis, change })
}

/// `in_window = { axis, window, wait }`
pub(super) fn in_window(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "in_window", frame)?;
    let window = keys.number("window")?;
    let wait = keys.duration_or("wait", WINDOW_WAIT)?;
    keys.finish()?;
    Some(Step::WaitInWindow { axis, window, seconds: profile_generic::cast::f64_from_i64(wait.0) / 1e9 })
}

/// `data_sets = { axis, command, actual, status, position_type }`; what is not named is as in `[axis.N]`.
pub(super) fn data_sets(value: &Value<'_>, frame: &Frame<'_>) -> Option<Step> {
    let (mut keys, axis) = keys(value, "data_sets", frame)?;
    let before = frame.config.axes[usize::from(axis) - 1].sets;
    let sets = super::connection::data_sets(&mut keys, before)?;
    keys.finish()?;
    Some(Step::DataSets { axis, sets })
}
