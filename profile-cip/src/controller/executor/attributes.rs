//! Steps that read and set attributes.

use super::leaf::Run;
use super::{Context, report_refused};
use crate::controller::config::AttributeSet;
use crate::controller::event::Event;
use crate::controller::failure::Failure;
use crate::controller::program::Step;
use crate::controller::services::Outcome;

pub(super) fn start(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<(), Failure> {
    match step {
        Step::ReadAttributes { axis, attributes } => {
            run.ticket = Some(cx.services.get(*axis, attributes, cx.room)?);
        }
        Step::SetAttributes { axis, attributes } => {
            run.ticket = Some(cx.services.set(*axis, attributes, cx.room)?);
        }
        _ => {}
    }
    Ok(())
}

pub(super) fn advance(step: &Step, run: &Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    match step {
        Step::ReadAttributes { axis, .. } => take_read(*axis, run, cx),
        Step::SetAttributes { axis, attributes } => take_set(*axis, attributes, run, cx),
        _ => Ok(true),
    }
}

pub(super) fn outcome(run: &Run, cx: &mut Context<'_>) -> Option<Result<Outcome, Failure>> {
    run.ticket.and_then(|ticket| cx.services.take(ticket))
}

fn take_read(instance: u8, run: &Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let Some(result) = outcome(run, cx) else { return Ok(false) };
    if let Outcome::Get { values } = result? {
        (cx.event)(Event::AttributesRead { instance, values });
    }
    Ok(true)
}

pub(super) fn take_set(
    instance: u8,
    sets: &[AttributeSet],
    run: &Run,
    cx: &mut Context<'_>,
) -> Result<bool, Failure> {
    let Some(result) = outcome(run, cx) else { return Ok(false) };
    if let Outcome::Set { refused } = result? {
        report_refused(instance, sets, &refused, cx.event)?;
    }
    Ok(true)
}
