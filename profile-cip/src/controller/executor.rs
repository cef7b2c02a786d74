//! Runs the steps of a program, once per update period.

use super::axis::Axis;
use super::config::{AttributeSet, TimeOuts};
use super::event::Event;
use super::failure::Failure;
use super::number::span;
use super::program::{AxisSet, Step};
use super::services::{Outcome, Room, Services, Ticket};
use super::trajectory::Limits;
use crate::wire::motion::codes::{AxisControl, AxisStateCode, NodeFault};
use profile_generic::time::{DurationNs, MonotonicTime};

/// Update periods in a row within the window that end a wait.
const WINDOW_UPDATES: u8 = 3;

/// What steps act on.
pub(super) struct Context<'a> {
    pub now: MonotonicTime,
    pub axes: &'a mut [Axis],
    pub services: &'a mut Services,
    pub room: Room,
    pub time_outs: TimeOuts,
    pub node_fault: NodeFault,
    pub node_fault_reset: &'a mut bool,
    pub event: &'a mut dyn FnMut(Event),
}

impl Context<'_> {
    fn axis(&mut self, instance: u8) -> Result<&mut Axis, Failure> {
        let missing = Failure::AxisNotReady { axis: instance, state: None, waited: DurationNs::ZERO };
        self.axes.get_mut(usize::from(instance).wrapping_sub(1)).ok_or(missing)
    }
}

/// What a leaf remembers between two updates.
#[derive(Debug, Clone, Copy)]
struct Run {
    since: MonotonicTime,
    /// Axes that have not finished.
    left: AxisSet,
    /// Axes that have been asked.
    asked: AxisSet,
    /// Axes that have acknowledged.
    acknowledged: AxisSet,
    ticket: Option<Ticket>,
    /// Planned length.
    length: DurationNs,
    /// Updates in a row within a window.
    within: u8,
}

#[derive(Debug)]
enum Progress {
    Waiting,
    Running(Run),
    Finished,
}

/// A step with its progress; children are those of [`Step::Together`] and [`Step::Sequence`].
#[derive(Debug)]
struct Node {
    step: Step,
    children: Vec<Node>,
    time_out: Option<DurationNs>,
    since: Option<MonotonicTime>,
    progress: Progress,
}

impl Node {
    fn new(step: Step) -> Self {
        let (step, time_out) = match step {
            Step::Within { time_out, step } => (*step, Some(time_out)),
            step => (step, None),
        };
        let mut node =
            Self { step, children: Vec::new(), time_out, since: None, progress: Progress::Waiting };
        match &mut node.step {
            Step::Together(steps) | Step::Sequence(steps) => {
                node.children = steps.drain(..).map(Self::new).collect();
            }
            // A time-out around a time-out: the outer one counts for the whole.
            Step::Within { .. } => {
                let inner = core::mem::replace(&mut node.step, Step::Sequence(Vec::new()));
                node.children.push(Self::new(inner));
            }
            _ => {}
        }
        node
    }

    const fn is_finished(&self) -> bool {
        matches!(self.progress, Progress::Finished)
    }

    /// Goes on; true when finished.
    fn poll(&mut self, cx: &mut Context<'_>) -> Result<bool, Failure> {
        if self.is_finished() {
            return Ok(true);
        }
        let since = *self.since.get_or_insert(cx.now);
        let finished = match &self.step {
            Step::Together(_) => {
                let mut all = true;
                for child in &mut self.children {
                    all &= child.poll(cx)?;
                }
                all
            }
            Step::Sequence(_) => {
                let mut finished = true;
                for child in &mut self.children {
                    finished = child.poll(cx)?;
                    if !finished {
                        break;
                    }
                }
                finished
            }
            _ => self.poll_leaf(cx)?,
        };
        if finished {
            self.progress = Progress::Finished;
        } else if let Some(time_out) = self.time_out
            && cx.now - since > time_out
        {
            return Err(Failure::StepTimeOut { waited: cx.now - since });
        }
        Ok(finished)
    }

    fn poll_leaf(&mut self, cx: &mut Context<'_>) -> Result<bool, Failure> {
        let mut run = match &self.progress {
            Progress::Running(run) => *run,
            _ => start(&self.step, cx)?,
        };
        let finished = go_on(&self.step, &mut run, cx, self.time_out)?;
        self.progress = Progress::Running(run);
        Ok(finished)
    }
}

fn start(step: &Step, cx: &mut Context<'_>) -> Result<Run, Failure> {
    let mut run = Run {
        since: cx.now,
        left: step.request().map_or(AxisSet::NONE, |(axes, _)| axes),
        asked: AxisSet::NONE,
        acknowledged: AxisSet::NONE,
        ticket: None,
        length: DurationNs::ZERO,
        within: 0,
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
        _ => {}
    }
    Ok(run)
}

fn go_on(
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
        | Step::Stop { axis, .. } => {
            let margin = cx.time_outs.motion_margin;
            let axis = cx.axis(*axis)?;
            if !axis.is_running() {
                let (axis, state, fault) = (axis.instance(), axis.state(), axis.fault());
                return Err(Failure::AxisNotRunning { axis, state, fault });
            }
            if axis.is_moving() && waited > run.length + margin {
                return Err(Failure::StepTimeOut { waited });
            }
            Ok(!axis.is_moving())
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
            *cx.node_fault_reset = cx.node_fault != NodeFault::NONE;
            if *cx.node_fault_reset && waited > time_out.unwrap_or(cx.time_outs.axis_control) {
                *cx.node_fault_reset = false;
                return Err(Failure::NodeFault(cx.node_fault));
            }
            Ok(!*cx.node_fault_reset)
        }
        Step::ReadAttributes { axis, .. } => take_read(*axis, run, cx),
        Step::SetAttributes { axis, attributes } => take_set(*axis, attributes, run, cx),
        _ => match step.request() {
            Some((_, request)) => ask(request, run, cx, time_out),
            None => Ok(true),
        },
    }
}

fn take_read(instance: u8, run: &Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let Some(result) = run.ticket.and_then(|ticket| cx.services.take(ticket)) else { return Ok(false) };
    if let Outcome::Get { values } = result? {
        (cx.event)(Event::AttributesRead { instance, values });
    }
    Ok(true)
}

fn take_set(instance: u8, sets: &[AttributeSet], run: &Run, cx: &mut Context<'_>) -> Result<bool, Failure> {
    let Some(result) = run.ticket.and_then(|ticket| cx.services.take(ticket)) else { return Ok(false) };
    if let Outcome::Set { refused } = result? {
        report_refused(instance, sets, &refused, cx.event)?;
    }
    Ok(true)
}

/// Tells each refused attribute; fails on the first one that is required.
pub(super) fn report_refused(
    instance: u8,
    sets: &[AttributeSet],
    refused: &[(u16, u8)],
    event: &mut dyn FnMut(Event),
) -> Result<(), Failure> {
    let mut failure = None;
    for &(attribute, status) in refused {
        event(Event::AttributeRefused { instance, attribute, status });
        let required = sets.iter().any(|set| set.selector.id == attribute && set.required);
        if required && failure.is_none() {
            failure = Some(Failure::AttributeRefused { instance, attribute, status });
        }
    }
    failure.map_or(Ok(()), Err)
}

/// States in which an axis is on its way somewhere and an Enable would come too early.
fn in_transit(state: Option<AxisStateCode>) -> bool {
    use AxisStateCode as S;
    [S::INITIALIZING, S::PRE_CHARGE, S::STOPPING, S::ABORTING].iter().any(|s| state == Some(*s))
        || state.is_none()
}

/// Asks every axis of the step and waits for all of them.
fn ask(
    request: AxisControl,
    run: &mut Run,
    cx: &mut Context<'_>,
    time_out: Option<DurationNs>,
) -> Result<bool, Failure> {
    let waited = cx.now - run.since;
    let time_out = time_out.unwrap_or(cx.time_outs.axis_control);
    for instance in run.left.iter() {
        let axis = cx.axis(instance)?;
        let state = axis.state();
        if !run.asked.contains(instance) {
            if request == AxisControl::ENABLE && axis.is_running() {
                run.left = run.left.without(instance);
                continue;
            }
            if request != AxisControl::ENABLE || !in_transit(state) {
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

/// A program under way.
#[derive(Debug)]
pub(super) struct Executor {
    nodes: Vec<Node>,
    at: usize,
    started: bool,
}

impl Executor {
    pub fn new(program: Vec<Step>) -> Self {
        Self { nodes: program.into_iter().map(Node::new).collect(), at: 0, started: false }
    }

    /// The step under way, counted from 0; the number of steps when all have finished.
    pub const fn at(&self) -> usize {
        self.at
    }

    /// Goes on with the program; true when all steps have finished.
    pub fn poll(&mut self, cx: &mut Context<'_>) -> Result<bool, Failure> {
        while let Some(node) = self.nodes.get_mut(self.at) {
            let step = self.at;
            if !core::mem::replace(&mut self.started, true) {
                (cx.event)(Event::StepStarted { step });
            }
            if !node.poll(cx)? {
                return Ok(false);
            }
            (cx.event)(Event::StepFinished { step });
            self.at += 1;
            self.started = false;
        }
        Ok(true)
    }
}
