//! Parameters of drives for a north side that knows registers and moves nothing: reads at any time, and writes while nobody
//! controls an axis of the device.
//!
//! This runs in the cycle: it does not allocate or wait. Requests come through a bounded queue.

use profile_generic::parameter::Parameter;

use super::axis::{AxisChannel, Owner};
use super::bus::{Answer, Buses, Purpose};
use super::north::Exchange;
use super::parameter::{Drives, ParameterFailure, ParameterJob, ParameterJobs};
use super::sharing::sharing;

/// Length of the queues of requests and of answers.
const QUEUE_LEN: usize = 64;

/// Most requests handled in one cycle.
const REQUESTS_PER_CYCLE: usize = 4;

/// An access to a parameter of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegisterRequest {
    /// Returned in the [`RegisterAnswer`].
    pub id: u32,
    /// Position of the axis in the configuration, from 0.
    pub axis: u8,
    /// The parameter.
    pub parameter: Parameter,
    /// What is written, in the unit of the parameter's quantity; `None` reads.
    pub wanted: Option<i64>,
}

/// Its result: the value of the parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegisterAnswer {
    /// The number of the request.
    pub id: u32,
    /// The value, or why there is none.
    pub result: Result<i64, RegisterFailure>,
}

/// Why a parameter was not read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RegisterFailure {
    /// A controller is connected to the device of the axis, or local control has the axis, or another axis of the same drive is
    /// controlled so.
    #[error("the axis is controlled by somebody else")]
    Owned,
    /// The gateway is stopping.
    #[error("the gateway is stopping")]
    Ending,
    /// The access failed.
    #[error(transparent)]
    Parameter(#[from] ParameterFailure),
}

/// The client side of the queues.
#[derive(Debug)]
pub struct RegisterEnd {
    /// To the engine.
    pub requests: rtrb::Producer<RegisterRequest>,
    /// From the engine.
    pub answers: rtrb::Consumer<RegisterAnswer>,
}

/// The accesses of such a north side.
#[derive(Debug)]
pub struct RegisterNorth {
    requests: rtrb::Consumer<RegisterRequest>,
    answers: rtrb::Producer<RegisterAnswer>,
    jobs: ParameterJobs<Accessed>,
    ticket: u32,
}

/// An access under way.
#[derive(Debug, Clone, Copy)]
struct Accessed {
    id: u32,
    axis: usize,
    ticket: u32,
}

/// Whether somebody controls the axis.
fn is_owned(axis: &AxisChannel) -> bool {
    axis.has_controller() || axis.owner() != Owner::Nobody
}

impl RegisterNorth {
    /// Without accesses, and the client side of its queues.
    #[must_use]
    pub fn new() -> (Self, RegisterEnd) {
        let (requests, taken) = rtrb::RingBuffer::new(QUEUE_LEN);
        let (given, answers) = rtrb::RingBuffer::new(QUEUE_LEN);
        let north = Self { requests: taken, answers: given, jobs: ParameterJobs::default(), ticket: 0 };
        (north, RegisterEnd { requests, answers })
    }

    fn answer(&mut self, id: u32, result: Result<i64, RegisterFailure>) {
        // The queue is full only if the server does not read it.
        let _ = self.answers.push(RegisterAnswer { id, result });
    }

    /// Takes requests, asks drives for what they need next, and answers those that are over.
    pub(super) fn exchange(&mut self, exchange: &mut Exchange<'_>, buses: &mut Buses) {
        for _ in 0..REQUESTS_PER_CYCLE {
            let Ok(request) = self.requests.pop() else { break };
            self.begin(request, (exchange.axes, buses), exchange.ending);
        }
        let Self { jobs, answers, .. } = self;
        let mut drives = Drives::of(exchange, buses);
        jobs.advance(
            |what, job| {
                let purpose = Purpose::RegisterParameter(what.ticket);
                job.step(&mut drives, what.axis, purpose, |_, axis| is_owned(axis))
            },
            |what, result| {
                let result = result.map_err(RegisterFailure::Parameter);
                let _ = answers.push(RegisterAnswer { id: what.id, result });
            },
        );
    }

    fn begin(&mut self, request: RegisterRequest, (axes, buses): (&[AxisChannel], &Buses), ending: bool) {
        let RegisterRequest { id, axis, parameter, wanted } = request;
        let axis = usize::from(axis);
        let refusal = match wanted {
            _ if ending => Some(RegisterFailure::Ending),
            _ if axis >= axes.len() => Some(ParameterFailure::Absent.into()),
            Some(_) if sharing(axis, axes, buses).any(|(_, axis)| is_owned(axis)) => {
                Some(RegisterFailure::Owned)
            }
            _ => None,
        };
        if let Some(refusal) = refusal {
            return self.answer(id, Err(refusal));
        }
        self.ticket = self.ticket.wrapping_add(1);
        let what = Accessed { id, axis, ticket: self.ticket };
        if !self.jobs.push(what, ParameterJob::new(parameter, wanted)) {
            self.answer(id, Err(ParameterFailure::Busy.into()));
        }
    }

    /// Takes the drive's answer to an access.
    pub(super) fn answered(&mut self, ticket: u32, answer: &Answer, axis: &AxisChannel) {
        self.jobs.take(|what| what.ticket == ticket, answer, axis);
    }
}
