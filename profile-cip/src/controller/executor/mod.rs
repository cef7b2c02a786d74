//! Runs the steps of a program, once per update period.

mod attributes;
mod connection;
mod events;
mod expect;
mod leaf;
mod motion;
mod request;
mod services;
mod settings;

use self::leaf::Run;
use super::axis::Axis;
use super::config::{AttributeSet, ControllerConfig};
use super::event::Event;
use super::failure::Failure;
use super::link::Link;
use super::misbehaviour::Abuse;
use super::node::NodeSeen;
use super::program::Step;
use super::report::StepReport;
use super::services::{Room, Services};
use super::session::{Answer, Session};
use profile_generic::time::{DurationNs, MonotonicTime};

/// What steps act on.
pub(super) struct Context<'a> {
    pub now: MonotonicTime,
    pub axes: &'a mut [Axis],
    pub services: &'a mut Services,
    pub session: &'a mut Session,
    /// The answer to the explicit message under way.
    pub answer: &'a mut Option<Result<Answer, Failure>>,
    /// A fault is there or may be of which is not known which one it is.
    pub fault_unread: bool,
    /// It is being read.
    pub fault_coming: bool,
    pub config: &'a mut ControllerConfig,
    pub link: &'a Link,
    pub room: Room,
    pub node: &'a mut NodeSeen,
    pub node_fault_reset: &'a mut bool,
    pub abuse: &'a mut Abuse,
    /// Why the connection is lost.
    pub lost: Option<Failure>,
    pub loss_expected: &'a mut bool,
    /// Connections opened so far.
    pub connection: u32,
    /// A step wants the connection anew.
    pub reconnect: bool,
    /// A step wants the TCP stream closed.
    pub drop_stream: bool,
    pub steps: &'a mut Vec<StepReport>,
    pub event: &'a mut dyn FnMut(Event),
}

impl Context<'_> {
    fn axis(&mut self, instance: u8) -> Result<&mut Axis, Failure> {
        let count = u8::try_from(self.axes.len()).unwrap_or(u8::MAX);
        let missing = Failure::UnknownAxis { axis: instance, count };
        self.axes.get_mut(usize::from(instance).wrapping_sub(1)).ok_or(missing)
    }
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
        if let Some(failure) = cx.lost
            && !self.step.works_without_connection()
        {
            return Err(failure);
        }
        let mut run = match &self.progress {
            Progress::Running(run) => *run,
            _ => leaf::start(&self.step, self.time_out, cx)?,
        };
        let finished = leaf::advance(&self.step, &mut run, cx)?;
        self.progress = Progress::Running(run);
        Ok(finished)
    }
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

    /// Whether a step has begun and has not finished.
    pub const fn is_under_way(&self) -> bool {
        self.started
    }

    /// Goes on with the program; true when all steps have finished.
    pub fn poll(&mut self, cx: &mut Context<'_>) -> Result<bool, Failure> {
        while let Some(node) = self.nodes.get_mut(self.at) {
            let step = self.at;
            if !core::mem::replace(&mut self.started, true) {
                (cx.event)(Event::StepStarted { step });
                cx.steps.push(StepReport { began: cx.now, ended: None });
            }
            let polled = node.poll(cx);
            if !matches!(polled, Ok(false))
                && let Some(report) = cx.steps.last_mut()
            {
                report.ended = Some(cx.now);
            }
            if !polled? {
                return Ok(false);
            }
            (cx.event)(Event::StepFinished { step });
            self.at += 1;
            self.started = false;
        }
        Ok(true)
    }
}
