//! One step that has no steps in it: how it begins and how it goes on.

use super::Context;
use super::expect::expect;
use super::report_refused;
use super::request::{ask, await_refusal};
use crate::controller::config::AttributeSet;
use crate::controller::event::Event;
use crate::controller::failure::Failure;
use crate::controller::misbehaviour::Misbehaviour;
use crate::controller::number::span;
use crate::controller::phases::command_control;
use crate::controller::program::{AxisSet, CyclicAttribute, CyclicDirection, Step};
use crate::controller::services::{Outcome, Ticket};
use crate::controller::session::Asker;
use crate::controller::trajectory::Limits;
use crate::wire::motion::Format;
use crate::wire::motion::codes::{EventChecking, NodeFault, TestStatus};
use crate::wire::motion::event::{ACTUAL_EVENTS_BARE, COMMAND_EVENTS_MAX};
use profile_generic::time::{DurationNs, MonotonicTime};

/// Update periods in a row within the window that end a wait.
const WINDOW_UPDATES: u8 = 3;
/// Time between two looks at the result of a test.
const TEST_INTERVAL: DurationNs = DurationNs::from_millis(50);
/// How long a test may take where the step does not say.
const TEST_MAX: DurationNs = DurationNs::from_secs(60);

/// What a leaf remembers between two updates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    pub since: MonotonicTime,
    /// Axes that have not finished.
    pub left: AxisSet,
    /// Axes that have been asked.
    pub asked: AxisSet,
    /// Axes that have acknowledged.
    pub acknowledged: AxisSet,
    pub ticket: Option<Ticket>,
    /// Planned length.
    pub length: DurationNs,
    /// Updates in a row within a window.
    within: u8,
    /// When to ask again.
    pub again: MonotonicTime,
    /// Something was done that is done once.
    done: bool,
    /// Connection on which the step began.
    connection: u32,
}

pub(super) fn start(step: &Step, cx: &mut Context<'_>) -> Result<Run, Failure> {
    let mut run = Run {
        since: cx.now,
        left: step.request().map_or(AxisSet::NONE, |(axes, _)| axes),
        asked: AxisSet::NONE,
        acknowledged: AxisSet::NONE,
        ticket: None,
        length: DurationNs::ZERO,
        within: 0,
        again: cx.now,
        done: false,
        connection: cx.connection,
    };
    match step {
        Step::MoveAbsolute { axis, position, limits } => {
            run.length = cx.axis(*axis)?.move_to(*position, *limits)?;
        }
        Step::MoveRelative { axis, distance, limits } => {
            let axis = cx.axis(*axis)?;
            run.length = axis.move_to(axis.commanded() + distance, *limits)?;
        }
        Step::Jog { axis, velocity, acceleration, jerk, seconds } => {
            let limits = Limits { velocity: velocity.abs(), acceleration: *acceleration, jerk: *jerk };
            run.length = cx.axis(*axis)?.jog(*velocity, *seconds, limits)?;
        }
        Step::RunAt { axis, velocity, acceleration, jerk } => {
            let limits = Limits { velocity: velocity.abs(), acceleration: *acceleration, jerk: *jerk };
            run.length = cx.axis(*axis)?.run_at(*velocity, limits)?;
        }
        Step::Torque { axis, torque, rate, velocity_limit } => {
            run.length = cx.axis(*axis)?.torque_to(*torque, *rate, *velocity_limit)?;
        }
        Step::Mode { axis, mode } => run.length = cx.axis(*axis)?.change_mode(*mode)?,
        Step::Feedback { axis, mode } => {
            let (axis, before) = (*axis, cx.axis(*axis)?.feedback_mode());
            cx.axis(axis)?.set_feedback_mode(*mode);
            check_room(cx).inspect_err(|_| {
                cx.axes[usize::from(axis) - 1].set_feedback_mode(before);
            })?;
        }
        Step::DataSets { axis, sets } => {
            let (axis, before) = (*axis, *cx.axis(*axis)?.sets());
            cx.axis(axis)?.change_sets(*sets)?;
            check_room(cx).inspect_err(|_| cx.axes[usize::from(axis) - 1].set_sets(before))?;
        }
        Step::TimeData(set) => cx.config.time_data = *set,
        Step::Target(target) => {
            cx.config.command_target = *target;
            if cx.config.format == Format::Fixed {
                let sets = [AttributeSet { required: true, ..command_control(*target) }];
                run.ticket = Some(cx.services.set(1, &sets, cx.room)?);
            }
        }
        Step::RedefinePosition { axis, change } => cx.axis(*axis)?.redefine(*change)?,
        Step::Stop { axis, acceleration, jerk } => {
            // The velocity limit has no part in slowing down.
            let limits = Limits { velocity: 1.0, acceleration: *acceleration, jerk: *jerk };
            run.length = cx.axis(*axis)?.stop(Some(limits))?;
        }
        Step::Dwell { seconds } => run.length = span(*seconds),
        Step::ReadAttributes { axis, attributes } => {
            run.ticket = Some(cx.services.get(*axis, attributes, cx.room)?);
        }
        Step::SetAttributes { axis, attributes } => {
            run.ticket = Some(cx.services.set(*axis, attributes, cx.room)?);
        }
        Step::CyclicList { axis, direction, attributes } => {
            check_list(*axis, *direction, attributes, cx)?;
            let ids: Vec<u16> = attributes.iter().map(|attribute| attribute.id).collect();
            run.ticket = Some(cx.services.cyclic_list(*axis, *direction, &ids, cx.room)?);
        }
        Step::CyclicWrite { axis, values } => {
            let (axis, target) = (*axis, cx.axis(*axis)?);
            for (attribute, value) in values {
                if !target.lists.write(*attribute, value) {
                    return Err(Failure::NotInList { axis, attribute: *attribute });
                }
            }
        }
        Step::ArmEvents { axis, checking, parameters } => {
            check_events(*axis, cx)?;
            cx.axis(*axis)?.events.arm(*checking, parameters.as_deref());
        }
        Step::DisarmEvents { axis, checking } => cx.axis(*axis)?.events.disarm(*checking),
        Step::Service { axis, service, data, .. } => {
            run.ticket = Some(cx.services.raw(*axis, *service, data, cx.room)?);
        }
        Step::Explicit { .. } => *cx.answer = None,
        Step::Misbehave(kind) => {
            (cx.event)(Event::Misbehaving(*kind));
            cx.abuse.begin(*kind);
            cx.drop_stream |= *kind == Misbehaviour::DropTcp;
        }
        _ => {}
    }
    Ok(run)
}

/// The data of all axes have to fit the connection.
fn check_room(cx: &Context<'_>) -> Result<(), Failure> {
    let lens = cx.axes.iter().map(crate::controller::axis::Axis::lens);
    let all = lens.fold((0, 0), |all, axis| (all.0 + axis.0, all.1 + axis.1));
    if cx.link.fits(all) {
        return Ok(());
    }
    Err(Failure::DataTooLong { needed: all.0.max(all.1), size: cx.config.connection_size })
}

/// The event block has to fit as well.
fn check_events(axis: u8, cx: &mut Context<'_>) -> Result<(), Failure> {
    if cx.axis(axis)?.events.is_open() {
        return Ok(());
    }
    let lens = cx.axes.iter().map(crate::controller::axis::Axis::lens);
    let all =
        lens.fold((COMMAND_EVENTS_MAX, ACTUAL_EVENTS_BARE), |all, axis| (all.0 + axis.0, all.1 + axis.1));
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

pub(super) fn advance(
    step: &Step,
    run: &mut Run,
    cx: &mut Context<'_>,
    time_out: Option<DurationNs>,
) -> Result<bool, Failure> {
    let waited = cx.now - run.since;
    match step {
        Step::MoveAbsolute { axis, .. }
        | Step::MoveRelative { axis, .. }
        | Step::Jog { axis, .. }
        | Step::RunAt { axis, .. }
        | Step::Torque { axis, .. }
        | Step::Stop { axis, .. } => {
            let margin = cx.config.time_outs.motion_margin;
            let axis = cx.axis(*axis)?;
            if !axis.is_running() {
                let (axis, state, fault) = (axis.instance(), axis.state(), axis.fault());
                return Err(Failure::AxisNotRunning { axis, state, fault });
            }
            if axis.is_busy() && waited > run.length + margin {
                return Err(Failure::StepTimeOut { waited });
            }
            Ok(!axis.is_busy())
        }
        Step::Mode { axis, mode } => {
            let limit = run.length + cx.config.time_outs.motion_margin;
            let axis = cx.axis(*axis)?;
            let done = !axis.is_busy() && axis.seen.mode == Some(*mode);
            if !done && waited > time_out.unwrap_or(limit) {
                return Err(Failure::StepTimeOut { waited });
            }
            Ok(done)
        }
        Step::RedefinePosition { axis, .. } => {
            let limit = time_out.unwrap_or(cx.config.time_outs.axis_control);
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
        Step::NodeFaultReset => {
            if cx.fault_coming {
                return Ok(false);
            }
            let faulted = cx.node.fault != NodeFault::NONE;
            *cx.node_fault_reset = faulted;
            if faulted && waited > time_out.unwrap_or(cx.config.time_outs.axis_control) {
                *cx.node_fault_reset = false;
                return Err(Failure::NodeFault(cx.node.fault));
            }
            Ok(!faulted)
        }
        Step::DataSets { axis, .. } => {
            // In the fixed format another actual value has to be there before a step may count on it.
            let limit = time_out.unwrap_or(cx.config.time_outs.axis_control);
            let there = cx.axis(*axis)?.is_seen();
            if !there && waited > limit { Err(Failure::StepTimeOut { waited }) } else { Ok(there) }
        }
        Step::Target(target) if run.ticket.is_some() => {
            let sets = [AttributeSet { required: true, ..command_control(*target) }];
            take_set(1, &sets, run, cx)
        }
        Step::ReadAttributes { axis, .. } => take_read(*axis, run, cx),
        Step::SetAttributes { axis, attributes } => take_set(*axis, attributes, run, cx),
        Step::CyclicList { axis, direction, attributes } => take_list(*axis, *direction, attributes, run, cx),
        Step::ArmEvents { axis, checking, .. } => {
            let wanted = *checking & EventChecking::EVENTS;
            let limit = time_out.unwrap_or(cx.config.time_outs.service);
            let axis = cx.axis(*axis)?;
            let armed = axis.events.status().contains(wanted);
            if !armed && waited > limit {
                let (axis, found) = (axis.instance(), axis.events.status());
                return Err(Failure::EventsNotChecked { axis, wanted, found });
            }
            Ok(armed)
        }
        Step::DisarmEvents { axis, checking } => {
            let limit = time_out.unwrap_or(cx.config.time_outs.service);
            let gone = !cx.axis(*axis)?.events.status().intersects(*checking & EventChecking::EVENTS);
            if !gone && waited > limit { Err(Failure::StepTimeOut { waited }) } else { Ok(gone) }
        }
        Step::Service { axis, status, .. } => take_raw(*axis, *status, step, run, cx),
        Step::TestResult { axis, status, .. } => await_test(*axis, *status, step, run, cx, time_out),
        Step::Explicit { message, status } => {
            if !run.done {
                run.done = cx.session.message(cx.now, Asker::Program, message);
                return Ok(false);
            }
            let Some(answer) = cx.answer.take() else { return Ok(false) };
            let answer = answer?;
            let (service, found, extended) = (answer.service, answer.status, answer.extended);
            (cx.event)(Event::ExplicitAnswered { service, status: found, extended, data: answer.data });
            check_status(service, *status, found)
        }
        Step::Expect { condition, within } => expect(condition, *within, run, cx),
        Step::Misbehave(_) => Ok(!cx.abuse.is_under_way()),
        Step::Reconnect => {
            // A fault that is being read would be forgotten with the connection.
            if !run.done && !cx.fault_coming {
                run.done = true;
                cx.reconnect = true;
            }
            Ok(cx.connection > run.connection)
        }
        Step::Ask { axes, request } => {
            // It has been sent once before the next step can take it back.
            if !run.done {
                for instance in axes.iter() {
                    cx.axis(instance)?.handshake.request(*request);
                }
            }
            Ok(core::mem::replace(&mut run.done, true))
        }
        Step::Refused { request, status, .. } => await_refusal(*request, *status, run, cx, time_out),
        _ => match step.request() {
            Some((_, request)) => ask(request, run, cx, time_out),
            None => Ok(true),
        },
    }
}

fn check_status(service: u8, expected: Option<u8>, found: u8) -> Result<bool, Failure> {
    match expected {
        Some(expected) if expected != found => Err(Failure::OtherStatus { service, expected, found }),
        _ => Ok(true),
    }
}

fn outcome(run: &Run, cx: &mut Context<'_>) -> Option<Result<Outcome, Failure>> {
    run.ticket.and_then(|ticket| cx.services.take(ticket))
}

fn take_read(instance: u8, run: &Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let Some(result) = outcome(run, cx) else { return Ok(false) };
    if let Outcome::Get { values } = result? {
        (cx.event)(Event::AttributesRead { instance, values });
    }
    Ok(true)
}

fn take_set(instance: u8, sets: &[AttributeSet], run: &Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let Some(result) = outcome(run, cx) else { return Ok(false) };
    if let Outcome::Set { refused } = result? {
        report_refused(instance, sets, &refused, cx.event)?;
    }
    Ok(true)
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

fn take_raw(
    instance: u8,
    expected: Option<u8>,
    step: &Step,
    run: &Run,
    cx: &mut Context<'_>,
) -> Result<bool, Failure> {
    let Step::Service { service, .. } = step else { return Ok(true) };
    let Some(result) = outcome(run, cx) else { return Ok(false) };
    let Outcome::Raw { status, data } = result? else { return Ok(true) };
    (cx.event)(Event::ServiceAnswered { instance, service: *service, status, data });
    check_status(service.0, expected, status)
}

/// Asks for the result of a test until it is over.
fn await_test(
    instance: u8,
    expected: TestStatus,
    step: &Step,
    run: &mut Run,
    cx: &mut Context<'_>,
    time_out: Option<DurationNs>,
) -> Result<bool, Failure> {
    let Step::TestResult { service, .. } = step else { return Ok(true) };
    if run.ticket.is_none() && cx.now >= run.again {
        run.ticket = Some(cx.services.raw(instance, *service, &[], cx.room)?);
    }
    let Some(result) = outcome(run, cx) else { return Ok(false) };
    let Outcome::Raw { status, data } = result? else { return Ok(true) };
    run.ticket = None;
    run.again = cx.now + TEST_INTERVAL;
    if status != 0 {
        return Err(Failure::ServiceRefused { instance, service: *service, status });
    }
    let found = data.first().copied().map_or(TestStatus::IN_PROGRESS, TestStatus);
    let waited = cx.now - run.since;
    if found == TestStatus::IN_PROGRESS && expected != found {
        let late = waited > time_out.unwrap_or(TEST_MAX);
        return if late { Err(Failure::StepTimeOut { waited }) } else { Ok(false) };
    }
    (cx.event)(Event::ServiceAnswered { instance, service: *service, status, data });
    if found == expected { Ok(true) } else { Err(Failure::TestResult { axis: instance, expected, found }) }
}
