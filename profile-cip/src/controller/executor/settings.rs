//! Steps that change what the updates carry: feedback mode, data sets, time data, command target, cyclic lists.

use super::Context;
use super::attributes::{outcome, take_set};
use super::leaf::{Run, done_within};
use crate::controller::axis::Axis;
use crate::controller::config::{AttributeSet, command_control};
use crate::controller::event::Event;
use crate::controller::failure::Failure;
use crate::controller::program::{CyclicAttribute, CyclicDirection, Step};
use crate::controller::services::Outcome;
use crate::wire::motion::Format;

// Flat: one arm per step.
pub(super) fn start(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<(), Failure> {
    match step {
        Step::Feedback { axis, mode } => {
            let (axis, before) = (*axis, cx.axis(*axis)?.feedback_mode());
            cx.axis(axis)?.set_feedback_mode(*mode);
            check_room(cx).inspect_err(|_| {
                cx.axes[usize::from(axis) - 1].set_feedback_mode(before);
            })
        }
        Step::DataSets { axis, sets } => {
            let (axis, before) = (*axis, *cx.axis(*axis)?.sets());
            cx.axis(axis)?.change_sets(*sets)?;
            check_room(cx).inspect_err(|_| cx.axes[usize::from(axis) - 1].set_sets(before))
        }
        Step::TimeData(set) => {
            cx.config.time_data = *set;
            Ok(())
        }
        Step::Target(target) => {
            cx.config.command_target = *target;
            if cx.config.format == Format::Fixed {
                let sets = [AttributeSet { required: true, ..command_control(*target) }];
                run.ticket = Some(cx.services.set(1, &sets, cx.room)?);
            }
            Ok(())
        }
        Step::CyclicList { axis, direction, attributes } => {
            check_list(*axis, *direction, attributes, cx)?;
            let ids: Vec<u16> = attributes.iter().map(|attribute| attribute.id).collect();
            run.ticket = Some(cx.services.cyclic_list(*axis, *direction, &ids, cx.room)?);
            Ok(())
        }
        Step::CyclicWrite { axis, values } => {
            let (axis, target) = (*axis, cx.axis(*axis)?);
            for (attribute, value) in values {
                if !target.lists.write(*attribute, value) {
                    return Err(Failure::NotInList { axis, attribute: *attribute });
                }
            }
            Ok(())
        }
        _ => Ok(()),
    }
}

pub(super) fn advance(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let waited = cx.now - run.since;
    match step {
        Step::DataSets { axis, .. } => {
            // In the fixed format another actual value has to be there before a step may count on it.
            let limit = run.time_out.unwrap_or(cx.config.time_outs.axis_control);
            let there = cx.axis(*axis)?.is_seen();
            done_within(there, waited, limit)
        }
        Step::Target(target) if run.ticket.is_some() => {
            let sets = [AttributeSet { required: true, ..command_control(*target) }];
            take_set(1, &sets, run, cx)
        }
        Step::CyclicList { axis, direction, attributes } => take_list(*axis, *direction, attributes, run, cx),
        _ => Ok(true),
    }
}

/// The data of all axes have to fit the connection.
fn check_room(cx: &Context<'_>) -> Result<(), Failure> {
    check_room_beside((0, 0), cx)
}

/// The data of all axes and so many octets of each direction have to fit the connection.
pub(super) fn check_room_beside(others: (usize, usize), cx: &Context<'_>) -> Result<(), Failure> {
    let lens = cx.axes.iter().map(Axis::lens);
    let all = lens.fold(others, |all, axis| (all.0 + axis.0, all.1 + axis.1));
    if cx.link.fits(all) {
        return Ok(());
    }
    Err(Failure::DataTooLong { needed: all.0.max(all.1), size: cx.config.connection_size })
}

/// The data of another list have to fit as well.
fn check_list(
    axis: u8,
    direction: CyclicDirection,
    attributes: &[CyclicAttribute],
    cx: &mut Context<'_>,
) -> Result<(), Failure> {
    let before = cx.axis(axis)?.lists.clone();
    cx.axis(axis)?.lists.adopt(direction, u8::MAX, attributes.to_vec());
    let fits = check_room(cx);
    cx.axis(axis)?.lists = before;
    fits
}

/// First the answer of the service, then updates with the new list until the device says that it uses it.
fn take_list(
    instance: u8,
    direction: CyclicDirection,
    attributes: &[CyclicAttribute],
    run: &mut Run,
    cx: &mut Context<'_>,
) -> Result<bool, Failure> {
    if let Some(result) = outcome(run, cx) {
        let Outcome::List { block_id, refused } = result? else { return Ok(true) };
        if let Some(&(attribute, status)) = refused.first() {
            return Err(Failure::AttributeRefused { instance, attribute, status });
        }
        run.ticket = None;
        cx.axis(instance)?.lists.adopt(direction, block_id, attributes.to_vec());
        (cx.event)(Event::CyclicListInUse { axis: instance, block_id });
    }
    if run.ticket.is_some() {
        return Ok(false);
    }
    let waited = cx.now - run.since;
    let limit = cx.config.time_outs.service;
    match cx.axis(instance)?.lists.status(direction) {
        Some(0) => Ok(true),
        Some(status) => Err(Failure::CyclicRefused { axis: instance, status }),
        None if waited > limit => Err(Failure::StepTimeOut { waited }),
        None => Ok(false),
    }
}
