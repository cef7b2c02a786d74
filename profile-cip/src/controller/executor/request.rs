//! Steps that ask by Axis Control.

use super::Context;
use super::leaf::Run;
use crate::controller::failure::Failure;
use crate::controller::program::Step;
use crate::wire::motion::codes::{AxisControl, AxisStateCode};

/// States in which an axis is on its way somewhere and an Enable would come too early.
fn in_transit(state: Option<AxisStateCode>) -> bool {
    use AxisStateCode as S;
    [S::INITIALIZING, S::PRE_CHARGE, S::STOPPING, S::ABORTING].iter().any(|s| state == Some(*s))
        || state.is_none()
}

pub(super) fn advance(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    match step {
        Step::Ask { axes, request } => {
            // It has been sent once before the next step can take it back.
            if !run.done {
                for instance in axes.iter() {
                    cx.axis(instance)?.handshake.request(*request);
                }
            }
            Ok(core::mem::replace(&mut run.done, true))
        }
        Step::Refused { request, status, .. } => await_refusal(*request, *status, run, cx),
        _ => match step.request() {
            Some((_, request)) => ask(request, run, cx),
            None => Ok(true),
        },
    }
}

/// Asks every axis of the step and waits for all of them.
// Flat: one arm per step.
fn ask(request: AxisControl, run: &mut Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let waited = cx.now - run.since;
    let time_out = run.time_out.unwrap_or(cx.config.time_outs.axis_control);
    for instance in run.left.iter() {
        let axis = cx.axis(instance)?;
        let state = axis.state();
        if !run.asked.contains(instance) {
            if request == AxisControl::ENABLE && axis.is_running() {
                run.left = run.left.without(instance);
                continue;
            }
            if request == AxisControl::CANCEL {
                axis.handshake.ask_cancel();
                run.asked = run.asked.with(instance);
            } else if request != AxisControl::ENABLE || !in_transit(state) {
                axis.handshake.request(request);
                run.asked = run.asked.with(instance);
            }
        } else if let Some(answer) = axis.handshake.take(request) {
            if answer.status != 0 {
                let (status, state) = (answer.status, state.unwrap_or_default());
                return Err(Failure::RequestRefused { axis: instance, request, status, state });
            }
            run.acknowledged = run.acknowledged.with(instance);
        }
        if run.acknowledged.contains(instance) && (request != AxisControl::ENABLE || axis.is_running()) {
            run.left = run.left.without(instance);
        } else if waited > time_out {
            axis.handshake.cancel();
            let response = axis.handshake.response();
            return Err(match state.filter(|_| run.asked.contains(instance)) {
                Some(state) => Failure::RequestTimeOut { axis: instance, request, response, state, waited },
                None => Failure::AxisNotReady { axis: instance, state, waited },
            });
        }
    }
    Ok(run.left.is_empty())
}

/// Asks every axis of the step and waits until all of them have said no.
fn await_refusal(
    request: AxisControl,
    expected: Option<u8>,
    run: &mut Run,
    cx: &mut Context<'_>,
) -> Result<bool, Failure> {
    let waited = cx.now - run.since;
    let time_out = run.time_out.unwrap_or(cx.config.time_outs.axis_control);
    for instance in run.left.iter() {
        let axis = cx.axis(instance)?;
        if !run.asked.contains(instance) {
            axis.handshake.request(request);
            run.asked = run.asked.with(instance);
        } else if let Some(answer) = axis.handshake.take(request) {
            let found = answer.status;
            if found == 0 || expected.is_some_and(|expected| expected != found) {
                return Err(Failure::NotRefused { axis: instance, request, expected, found });
            }
            run.left = run.left.without(instance);
        } else if waited > time_out {
            axis.handshake.cancel();
            let (response, state) = (axis.handshake.response(), axis.state().unwrap_or_default());
            return Err(Failure::RequestTimeOut { axis: instance, request, response, state, waited });
        }
    }
    Ok(run.left.is_empty())
}
