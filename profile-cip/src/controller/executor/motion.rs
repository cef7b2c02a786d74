//! Steps that move an axis, and those that wait for a motion.

use super::Context;
use super::leaf::{Run, done_within};
use crate::controller::failure::Failure;
use crate::controller::number::span;
use crate::controller::program::Step;
use crate::controller::trajectory::Limits;
use profile_generic::time::DurationNs;

/// Update periods in a row within the window that end a wait.
const WINDOW_UPDATES: u8 = 3;

// Flat: one arm per step.
pub(super) fn start(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<(), Failure> {
    run.length = match step {
        Step::MoveAbsolute { axis, position, limits } => cx.axis(*axis)?.move_to(*position, *limits)?,
        Step::MoveRelative { axis, distance, limits } => {
            let axis = cx.axis(*axis)?;
            axis.move_to(axis.commanded() + distance, *limits)?
        }
        Step::Jog { axis, velocity, acceleration, jerk, seconds } => {
            let limits = Limits { velocity: velocity.abs(), acceleration: *acceleration, jerk: *jerk };
            cx.axis(*axis)?.jog(*velocity, *seconds, limits)?
        }
        Step::RunAt { axis, velocity, acceleration, jerk } => {
            let limits = Limits { velocity: velocity.abs(), acceleration: *acceleration, jerk: *jerk };
            cx.axis(*axis)?.run_at(*velocity, limits)?
        }
        Step::Torque { axis, torque, rate, velocity_limit } => {
            cx.axis(*axis)?.torque_to(*torque, *rate, *velocity_limit)?
        }
        Step::Mode { axis, mode } => cx.axis(*axis)?.change_mode(*mode)?,
        Step::Stop { axis, acceleration, jerk } => {
            // The velocity limit has no part in slowing down.
            let limits = Limits { velocity: 1.0, acceleration: *acceleration, jerk: *jerk };
            cx.axis(*axis)?.stop(Some(limits))?
        }
        Step::Dwell { seconds } => span(*seconds),
        Step::RedefinePosition { axis, change } => {
            cx.axis(*axis)?.redefine(*change)?;
            DurationNs::ZERO
        }
        _ => DurationNs::ZERO,
    };
    Ok(())
}

// Flat: one arm per motion.
pub(super) fn advance(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let waited = cx.now - run.since;
    match step {
        Step::Mode { axis, mode } => {
            let limit = run.length + cx.config.time_outs.motion_margin;
            let axis = cx.axis(*axis)?;
            let done = !axis.is_busy() && axis.seen.mode == Some(*mode);
            done_within(done, waited, run.time_out.unwrap_or(limit))
        }
        Step::RedefinePosition { axis, .. } => {
            let limit = run.time_out.unwrap_or(cx.config.time_outs.axis_control);
            match cx.axis(*axis)?.take_redefined() {
                Some(ended) => ended.map(|()| true),
                None if waited > limit => Err(Failure::StepTimeOut { waited }),
                None => Ok(false),
            }
        }
        Step::Dwell { .. } => Ok(waited >= run.length),
        Step::WaitInWindow { axis, window, seconds } => {
            let axis = cx.axis(*axis)?;
            let distance = axis.distance().unwrap_or(f64::INFINITY);
            let within = axis.is_running() && distance <= *window;
            run.within = if within { run.within + 1 } else { 0 };
            if run.within < WINDOW_UPDATES && waited > span(*seconds) {
                let (axis, window) = (axis.instance(), *window);
                return Err(Failure::OutOfWindow { axis, window, distance, waited });
            }
            Ok(run.within >= WINDOW_UPDATES)
        }
        Step::MoveAbsolute { axis, .. }
        | Step::MoveRelative { axis, .. }
        | Step::Jog { axis, .. }
        | Step::RunAt { axis, .. }
        | Step::Torque { axis, .. }
        | Step::Stop { axis, .. } => {
            let limit = run.length + cx.config.time_outs.motion_margin;
            let axis = cx.axis(*axis)?;
            if !axis.is_running() {
                let (axis, state, fault) = (axis.instance(), axis.state(), axis.fault());
                return Err(Failure::AxisNotRunning { axis, state, fault });
            }
            done_within(!axis.is_busy(), waited, limit)
        }
        _ => Ok(true),
    }
}
