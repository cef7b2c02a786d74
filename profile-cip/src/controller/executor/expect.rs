//! Steps that wait until something is so.

use super::Context;
use super::leaf::Run;
use crate::controller::condition::{Condition, Found, Number};
use crate::controller::failure::Failure;
use crate::controller::program::{CyclicDirection, Step};
use crate::controller::services::Outcome;
use crate::wire::motion::EventNotification;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{NodeAlarm, NodeFault, NodeStatus};
use profile_generic::time::DurationNs;

/// Time between two reads of an attribute.
const READ_INTERVAL: DurationNs = DurationNs::from_millis(10);

pub(super) fn advance(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let Step::Expect { condition, within } = step else { return Ok(true) };
    let waited = cx.now - run.since;
    let of_faults =
        matches!(condition, Condition::NoFault | Condition::NodeFault(_) | Condition::Fault { .. });
    if of_faults && cx.fault_coming {
        // The service that reads it has a time-out of its own.
        return Ok(false);
    }
    let found = match condition {
        Condition::Attribute { axis, selector, .. } => match read(*axis, selector, condition, run, cx)? {
            Some(found) => found,
            // The service has a time-out of its own.
            None => return Ok(false),
        },
        _ => look(condition, cx)?,
    };
    match found {
        None => Ok(true),
        Some(found) if waited >= *within => Err(Failure::Unmet { condition: *condition, found, waited }),
        Some(_) => Ok(false),
    }
}

/// Reads the attribute again and again; the outer `None` means that the answer is not there yet.
#[expect(clippy::option_option, reason = "not answered, answered as wanted, answered otherwise")]
fn read(
    axis: u8,
    selector: &AttributeSelector,
    condition: &Condition,
    run: &mut Run,
    cx: &mut Context<'_>,
) -> Result<Option<Option<Found>>, Failure> {
    let Condition::Attribute { check, .. } = condition else { return Ok(Some(None)) };
    if run.ticket.is_none() && cx.now >= run.again {
        run.ticket = Some(cx.services.get(axis, core::slice::from_ref(selector), cx.room)?);
    }
    let Some(result) = run.ticket.and_then(|ticket| cx.services.take(ticket)) else { return Ok(None) };
    run.ticket = None;
    run.again = cx.now + READ_INTERVAL;
    let Outcome::Get { values } = result? else { return Ok(None) };
    Ok(Some(match values.first().map(|row| &row.value) {
        Some(Ok(bytes)) => match check.judge(bytes) {
            (_, true) => None,
            (found, false) => Some(found.map_or(Found::Nothing, Found::Number)),
        },
        Some(Err(status)) => Some(Found::Refused(*status)),
        None => Some(Found::Nothing),
    }))
}

fn near(found: Option<f64>, wanted: f64, tolerance: f64) -> Option<Found> {
    match found {
        Some(found) if (found - wanted).abs() <= tolerance => None,
        Some(found) => Some(Found::Number(Number::Float(found))),
        None => Some(Found::Nothing),
    }
}

/// What is there instead; `None` when the condition holds.
// Flat: one arm per condition.
fn look(condition: &Condition, cx: &mut Context<'_>) -> Result<Option<Found>, Failure> {
    let otherwise = |holds: bool, found: Found| (!holds).then_some(found);
    Ok(match condition {
        Condition::State { axis, state } => {
            let found = cx.axis(*axis)?.state();
            otherwise(found == Some(*state), found.map_or(Found::Nothing, Found::State))
        }
        Condition::Position { axis, position, tolerance } => {
            let axis = cx.axis(*axis)?;
            if !axis.is_scaled() {
                return Err(Failure::NotScaled { axis: axis.instance() });
            }
            near(axis.actual_units(), *position, *tolerance)
        }
        Condition::Velocity { axis, velocity, tolerance } => {
            let axis = cx.axis(*axis)?;
            if !axis.is_scaled() {
                return Err(Failure::NotScaled { axis: axis.instance() });
            }
            near(Some(axis.seen.velocity(axis.scale())), *velocity, *tolerance)
        }
        Condition::Mode { axis, mode } => {
            let found = cx.axis(*axis)?.seen.mode;
            otherwise(found == Some(*mode), found.map_or(Found::Nothing, Found::Mode))
        }
        Condition::Status { axis, bits, on } => match cx.axis(*axis)?.seen.status {
            Some(status) => {
                let holds = if *on { status.contains(*bits) } else { !status.intersects(*bits) };
                otherwise(holds, Found::Status(status))
            }
            None => Some(Found::Nothing),
        },
        Condition::IoStatus { axis, bits, on } => match cx.axis(*axis)?.seen.io_status {
            Some(status) => {
                let holds = if *on { status.contains(*bits) } else { !status.intersects(*bits) };
                otherwise(holds, Found::IoStatus(status))
            }
            None => Some(Found::Nothing),
        },
        Condition::Fault { axis, pattern } => {
            let axis = cx.axis(*axis)?;
            let taken = axis.seen.take_fault(pattern);
            let instance = axis.instance();
            let newest = axis.seen.newest_fault();
            otherwise(taken, newest.map_or(Found::Nothing, |record| Found::Fault(instance, record)))
        }
        Condition::Alarm { axis, pattern } => {
            let axis = cx.axis(*axis)?;
            let taken = axis.seen.take_alarm(pattern);
            otherwise(taken, axis.seen.newest_alarm().map_or(Found::Nothing, Found::Alarm))
        }
        Condition::Event { axis, event_type, position } => {
            let axis = cx.axis(*axis)?;
            let scale = axis.scale();
            let units = |notification: &EventNotification| f64::from(notification.position) / scale;
            let taken = axis.seen.take_event(|notification| {
                notification.event_type == *event_type
                    && notification.status == 0
                    && position.is_none_or(|(at, tolerance)| (units(notification) - at).abs() <= tolerance)
            });
            let newest = axis.seen.newest_event();
            let found = newest.map_or(Found::Nothing, |event| Found::Event(event.event_type, units(&event)));
            otherwise(taken, found)
        }
        Condition::NoFault => {
            let of_axis = cx
                .axes
                .iter()
                .find_map(|axis| axis.seen.open_fault().map(|record| Found::Fault(axis.instance(), record)));
            let of_node = || cx.node.open_fault().map(Found::NodeFault);
            of_axis.or_else(of_node).or_else(|| cx.fault_unread.then_some(Found::Otherwise))
        }
        Condition::NodeFault(NodeFault::NONE) => {
            otherwise(cx.node.fault == NodeFault::NONE, Found::NodeFault(cx.node.fault))
        }
        Condition::NodeFault(fault) => otherwise(cx.node.take_fault(*fault), Found::NodeFault(cx.node.fault)),
        Condition::NodeAlarm(NodeAlarm::NONE) => {
            otherwise(cx.node.alarm == NodeAlarm::NONE, Found::NodeAlarm(cx.node.alarm))
        }
        Condition::NodeAlarm(alarm) => otherwise(cx.node.take_alarm(*alarm), Found::NodeAlarm(cx.node.alarm)),
        Condition::Synchronous(wanted) => {
            otherwise(cx.node.status.contains(NodeStatus::SYNC_MODE) == *wanted, Found::Otherwise)
        }
        Condition::ConnectionLost => {
            *cx.loss_expected |= cx.lost.is_some();
            otherwise(cx.lost.is_some(), Found::Otherwise)
        }
        Condition::LostUpdates(count) => at_least(*count, cx.node.counters().0),
        Condition::LateUpdates(count) => at_least(*count, cx.node.counters().1),
        Condition::CyclicRead { axis, attribute, check } => {
            match cx.axis(*axis)?.lists.value(*attribute).map(|bytes| check.judge(bytes)) {
                Some((_, true)) => None,
                Some((found, false)) => Some(found.map_or(Found::Nothing, Found::Number)),
                None => Some(Found::Nothing),
            }
        }
        Condition::CyclicWriteStatus { axis, status } => {
            match cx.axis(*axis)?.lists.status(CyclicDirection::Write) {
                Some(found) if found == *status => None,
                Some(found) => Some(Found::Number(Number::Integer(i64::from(found)))),
                None => Some(Found::Nothing),
            }
        }
        // Asked for by a service, not looked at.
        Condition::Attribute { .. } => None,
    })
}

fn at_least(wanted: u8, found: u32) -> Option<Found> {
    (found < u32::from(wanted)).then_some(Found::Number(Number::Integer(i64::from(found))))
}
