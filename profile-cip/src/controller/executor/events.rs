//! Steps that arm events and take them back.

use super::Context;
use super::leaf::{Run, done_within};
use super::settings::check_room_beside;
use crate::controller::failure::Failure;
use crate::controller::program::Step;
use crate::wire::motion::codes::EventChecking;
use crate::wire::motion::event::{ACTUAL_EVENTS_BARE, COMMAND_EVENTS_MAX};

pub(super) fn start(step: &Step, cx: &mut Context<'_>) -> Result<(), Failure> {
    match step {
        Step::ArmEvents { axis, checking, parameters } => {
            // The event block has to fit as well.
            if !cx.axis(*axis)?.events.is_open() {
                check_room_beside((COMMAND_EVENTS_MAX, ACTUAL_EVENTS_BARE), cx)?;
            }
            cx.axis(*axis)?.events.arm(*checking, parameters.as_deref());
        }
        Step::DisarmEvents { axis, checking } => cx.axis(*axis)?.events.disarm(*checking),
        _ => {}
    }
    Ok(())
}

pub(super) fn advance(step: &Step, run: &Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let waited = cx.now - run.since;
    match step {
        Step::ArmEvents { axis, checking, .. } => {
            let wanted = *checking & EventChecking::EVENTS;
            let limit = run.time_out.unwrap_or(cx.config.time_outs.service);
            let axis = cx.axis(*axis)?;
            let armed = axis.events.status().contains(wanted);
            if !armed && waited > limit {
                let (axis, found) = (axis.instance(), axis.events.status());
                return Err(Failure::EventsNotChecked { axis, wanted, found });
            }
            Ok(armed)
        }
        Step::DisarmEvents { axis, checking } => {
            let limit = run.time_out.unwrap_or(cx.config.time_outs.service);
            let gone = !cx.axis(*axis)?.events.status().intersects(*checking & EventChecking::EVENTS);
            done_within(gone, waited, limit)
        }
        _ => Ok(true),
    }
}
