//! Steps that act on the node and on the connection.

use super::Context;
use super::leaf::Run;
use crate::controller::event::Event;
use crate::controller::failure::Failure;
use crate::controller::misbehaviour::Misbehaviour;
use crate::controller::program::Step;
use crate::wire::motion::codes::NodeFault;

pub(super) fn start(step: &Step, cx: &mut Context<'_>) {
    if let Step::Misbehave(kind) = step {
        (cx.event)(Event::Misbehaving(*kind));
        cx.abuse.begin(*kind);
        cx.drop_stream |= *kind == Misbehaviour::DropTcp;
    }
}

pub(super) fn advance(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let waited = cx.now - run.since;
    match step {
        Step::NodeFaultReset => {
            if cx.fault_coming {
                return Ok(false);
            }
            let faulted = cx.node.fault != NodeFault::NONE;
            *cx.node_fault_reset = faulted;
            if faulted && waited > run.time_out.unwrap_or(cx.config.time_outs.axis_control) {
                *cx.node_fault_reset = false;
                return Err(Failure::NodeFault(cx.node.fault));
            }
            Ok(!faulted)
        }
        Step::Misbehave(_) => Ok(!cx.abuse.is_under_way()),
        Step::Reconnect => {
            // A fault that is being read would be forgotten with the connection.
            if !run.done && !cx.fault_coming {
                run.done = true;
                cx.reconnect = true;
            }
            Ok(cx.connection > run.connection)
        }
        _ => Ok(true),
    }
}
