//! One step that has no steps in it: how it begins and how it goes on. Each kind of step has a module of its own.

use super::{Context, attributes, connection, events, expect, motion, request, services, settings};
use crate::controller::failure::Failure;
use crate::controller::program::{AxisSet, Step};
use crate::controller::services::Ticket;
use profile_generic::time::{DurationNs, MonotonicTime};

/// What a leaf remembers between two updates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    pub since: MonotonicTime,
    /// How long the step may take, where the program says so.
    pub time_out: Option<DurationNs>,
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
    pub within: u8,
    /// When to ask again.
    pub again: MonotonicTime,
    /// Something was done that is done once.
    pub done: bool,
    /// Connection on which the step began.
    pub connection: u32,
}

/// Begins a step.
pub(super) fn start(step: &Step, time_out: Option<DurationNs>, cx: &mut Context<'_>) -> Result<Run, Failure> {
    let mut run = Run {
        since: cx.now,
        time_out,
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
    match kind(step) {
        Kind::Motion => motion::start(step, &mut run, cx)?,
        Kind::Setting => settings::start(step, &mut run, cx)?,
        Kind::Attributes => attributes::start(step, &mut run, cx)?,
        Kind::Events => events::start(step, cx)?,
        Kind::Service => services::start(step, &mut run, cx)?,
        Kind::Connection => connection::start(step, cx),
        Kind::Expect | Kind::Request => {}
    }
    Ok(run)
}

/// Carries a step on; true when it has finished.
pub(super) fn advance(step: &Step, run: &mut Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    match kind(step) {
        Kind::Motion => motion::advance(step, run, cx),
        Kind::Setting => settings::advance(step, run, cx),
        Kind::Attributes => attributes::advance(step, run, cx),
        Kind::Events => events::advance(step, run, cx),
        Kind::Service => services::advance(step, run, cx),
        Kind::Connection => connection::advance(step, run, cx),
        Kind::Expect => expect::advance(step, run, cx),
        Kind::Request => request::advance(step, run, cx),
    }
}

/// Who carries a step out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Motion,
    Setting,
    Attributes,
    Events,
    Service,
    Connection,
    Expect,
    /// Requests of Axis Control, and what is none of the others.
    Request,
}

const fn kind(step: &Step) -> Kind {
    match step {
        Step::MoveAbsolute { .. }
        | Step::MoveRelative { .. }
        | Step::Jog { .. }
        | Step::RunAt { .. }
        | Step::Torque { .. }
        | Step::Stop { .. }
        | Step::Mode { .. }
        | Step::RedefinePosition { .. }
        | Step::Dwell { .. }
        | Step::WaitInWindow { .. } => Kind::Motion,
        Step::Feedback { .. }
        | Step::DataSets { .. }
        | Step::TimeData(_)
        | Step::Target(_)
        | Step::CyclicList { .. }
        | Step::CyclicWrite { .. } => Kind::Setting,
        Step::ReadAttributes { .. } | Step::SetAttributes { .. } => Kind::Attributes,
        Step::ArmEvents { .. } | Step::DisarmEvents { .. } => Kind::Events,
        Step::Service { .. } | Step::TestResult { .. } | Step::Explicit { .. } => Kind::Service,
        Step::NodeFaultReset | Step::Misbehave(_) | Step::Reconnect => Kind::Connection,
        Step::Expect { .. } => Kind::Expect,
        _ => Kind::Request,
    }
}

/// Whether it is done; fails when it is not and the limit has passed.
pub(super) fn done_within(done: bool, waited: DurationNs, limit: DurationNs) -> Result<bool, Failure> {
    if !done && waited > limit { Err(Failure::StepTimeOut { waited }) } else { Ok(done) }
}
