//! Local control: the north side with which people move axes in generic units while no controller is connected.
//!
//! ```text
//! socket --Request--> LocalNorth --Wish, AxisCommand--> AxisChannel
//!        <--Answer---            <--feedback, faults---
//! ```
//!
//! While a controller is connected to the device of an axis, the axis is the controller's. Otherwise a client of local control takes it
//! with its first order and keeps it until the torque is off again. When a controller connects, the axis stops as configured and is the
//! controller's immediately: the controller finds it without torque, at its actual position. The axis also stops when the client
//! disconnects.
//!
//! This runs in the cycle: it does not allocate or wait. Requests come through a bounded queue.

mod axis;
mod order;

pub use self::order::{Answer, ClientId, Failure, Generator, Jog, Move, Order, Request};

use profile_generic::inhibit::Inhibits;
use profile_generic::parameter::Parameter;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

use self::axis::LocalAxis;
use super::axis::AxisChannel;
use super::bus::{self, Buses, Purpose};
use super::north::{Exchange, North};
use super::notice::{Notice, axis_number};
use super::parameter::{Drives, ParameterFailure, ParameterJob, ParameterJobs};

/// How long an axis moves after a jog order, at most. A client that hangs, or a key that is released, stops the axis.
pub const JOG_TIME: DurationNs = DurationNs::from_millis(500);

/// Length of the queues of requests and of answers.
const QUEUE_LEN: usize = 64;

/// Most requests handled in one cycle.
const REQUESTS_PER_CYCLE: usize = 8;

/// The client side of the queues.
#[derive(Debug)]
pub struct ClientEnd {
    /// From clients to the engine.
    pub requests: rtrb::Producer<Request>,
    /// From the engine to clients.
    pub answers: rtrb::Consumer<Answer>,
}

/// Local control of all axes of a gateway.
#[derive(Debug)]
pub struct LocalNorth {
    requests: rtrb::Consumer<Request>,
    answers: rtrb::Producer<Answer>,
    axes: Box<[LocalAxis]>,
    /// Accesses to parameters under way.
    parameters: ParameterJobs<Accessed>,
    /// The ticket of the last of them.
    ticket: u32,
}

/// An access to a parameter, and who waits for it.
#[derive(Debug, Clone, Copy)]
struct Accessed {
    client: ClientId,
    id: u32,
    axis: usize,
    ticket: u32,
}

impl LocalNorth {
    /// Local control of this number of axes, and the client side of its queues.
    #[must_use]
    pub fn new(axes: usize) -> (Self, ClientEnd) {
        let (requests, taken) = rtrb::RingBuffer::new(QUEUE_LEN);
        let (given, answers) = rtrb::RingBuffer::new(QUEUE_LEN);
        let axes = (0..axes).map(|_| LocalAxis::new()).collect();
        let (parameters, ticket) = (ParameterJobs::default(), 0);
        let local = Self { requests: taken, answers: given, axes, parameters, ticket };
        (local, ClientEnd { requests, answers })
    }

    /// Whether a client controls this axis.
    #[must_use]
    pub fn holds(&self, axis: usize) -> bool {
        self.axes.get(axis).is_some_and(|axis| axis.holder.is_some())
    }

    /// Starts an order, or answers it if it is refused or has nothing to do.
    fn order(
        &mut self,
        now: (MonotonicTime, SystemTime),
        ending: bool,
        (number, axis): (usize, &mut AxisChannel),
        (client, id, order): (ClientId, u32, Order),
        notice: &mut dyn FnMut(Notice),
    ) {
        let Some(local) = self.axes.get_mut(number) else { return };
        let refusal = match local.holder {
            _ if ending => Some(Failure::Ending),
            _ if axis.has_controller() => Some(Failure::Controller),
            Some(holder) if holder != client => Some(Failure::Held),
            _ if !axis.moves() => Some(Failure::NeverMoves),
            Some(_) => None,
            None => match (order, axis.fault()) {
                // Its controller is gone since this call, and the stop for that has not begun.
                (Order::Enable | Order::Reset, None) if axis.runs() => Some(Failure::Stopping),
                (Order::Enable | Order::Reset, None) | (Order::Reset, Some(_)) => None,
                (Order::Stop | Order::Disable, _) if !axis.may_have_torque() => {
                    return self.answer(Answer { client, id, result: Ok(None) });
                }
                (_, Some(fault)) => Some(Failure::Fault(fault.cause)),
                // It may still have torque: it stops because a controller has disconnected.
                (_, None) => Some(Failure::NotEnabled(axis.state())),
            },
        };
        if let Some(failure) = refusal {
            return self.answer(Answer { client, id, result: Err(failure) });
        }
        if local.holder.is_none() {
            local.begin(client, now, axis);
            notice(owner_changed(number, true));
        }
        match local.take(now, axis, (client, id, order)) {
            Ok(None) => {}
            Ok(Some(replaced)) => {
                let result = Err(Failure::Replaced(order.name()));
                self.answer(Answer { client: replaced.client, id: replaced.id, result });
            }
            Err(failure) => self.answer(Answer { client, id, result: Err(failure) }),
        }
    }

    /// Advances an axis under local control, and releases it when it has neither torque nor an order in progress.
    fn advance(
        &mut self,
        (now, system): (MonotonicTime, SystemTime),
        number: usize,
        axis: &mut AxisChannel,
        notice: &mut dyn FnMut(Notice),
    ) {
        let Some(local) = self.axes.get_mut(number).filter(|local| local.holder.is_some()) else { return };
        // Local control does not need the configuration that a controller would send.
        let mut inhibits = Inhibits::empty();
        inhibits.set(Inhibits::LIMIT_SWITCHES_NOT_TOLD, axis.misses_limit_switches());
        axis.set_inhibits(now, system, inhibits);
        let ended = local.advance((now, system), axis);
        if !local.is_busy() && !axis.may_have_torque() {
            local.release((now, system), axis);
            notice(owner_changed(number, false));
        }
        if let Some((task, result)) = ended {
            let result = result.map(|()| None);
            self.answer(Answer { client: task.client, id: task.id, result });
        }
    }

    /// Begins an access to a parameter, or answers it if it is refused. Reading disturbs nobody; what is written is up to who
    /// controls the axis. The other axes of its device are looked at before the drive is asked.
    fn access(
        &mut self,
        ending: bool,
        axis: &AxisChannel,
        (client, id, number): (ClientId, u32, usize),
        (parameter, wanted): (Parameter, Option<i64>),
    ) {
        let holder = self.axes.get(number).and_then(|local| local.holder);
        let refusal = match holder {
            _ if ending => Some(Failure::Ending),
            _ if wanted.is_none() => None,
            _ if axis.has_controller() => Some(Failure::Controller),
            Some(holder) if holder != client => Some(Failure::Held),
            _ => None,
        };
        self.ticket = self.ticket.wrapping_add(1);
        let what = Accessed { client, id, axis: number, ticket: self.ticket };
        let begun = refusal.map_or(Ok(()), Err).and_then(|()| {
            let has_room = self.parameters.push(what, ParameterJob::new(parameter, wanted));
            has_room.then_some(()).ok_or(Failure::Parameter(ParameterFailure::Busy))
        });
        if let Err(failure) = begun {
            self.answer(Answer { client, id, result: Err(failure) });
        }
    }

    /// Asks drives for what accesses to parameters need next, and answers those that are over.
    pub(super) fn parameters(&mut self, exchange: &mut Exchange<'_>, buses: &mut Buses) {
        let Self { parameters, answers, axes, .. } = self;
        let held = |number: usize| axes.get(number).and_then(|local| local.holder);
        let mut drives = Drives::of(exchange, buses);
        parameters.advance(
            |what, job| {
                let purpose = Purpose::LocalParameter(what.ticket);
                job.step(&mut drives, what.axis, purpose, |number, axis| {
                    axis.has_controller() || held(number).is_some_and(|holder| holder != what.client)
                })
            },
            |what, result| {
                let Accessed { client, id, .. } = what;
                let result = result.map(Some).map_err(Failure::Parameter);
                // The queue is full only if the server does not read it.
                let _ = answers.push(Answer { client, id, result });
            },
        );
    }

    /// Takes the drive's answer to an access to a parameter.
    pub(super) fn parameter_answered(&mut self, ticket: u32, answer: &bus::Answer, axis: &AxisChannel) {
        self.parameters.take(|what| what.ticket == ticket, answer, axis);
    }

    /// The client that controls the axis has disconnected.
    fn lose(&mut self, now: (MonotonicTime, SystemTime), number: usize, axis: &mut AxisChannel) {
        let local = &mut self.axes[number];
        // Only once: the stop then continues by itself.
        if local.holder.is_some_and(|holder| holder != NOBODY) {
            local.holder = Some(NOBODY);
            local.take_task();
            local.disable(now, axis);
        }
    }

    /// Stops the axis and releases it.
    fn give_back(
        &mut self,
        now: (MonotonicTime, SystemTime),
        number: usize,
        axis: &mut AxisChannel,
        failure: Failure,
        notice: &mut dyn FnMut(Notice),
    ) {
        let local = &mut self.axes[number];
        local.disable(now, axis);
        local.release(now, axis);
        notice(owner_changed(number, false));
        if let Some(task) = local.take_task() {
            self.answer(Answer { client: task.client, id: task.id, result: Err(failure) });
        }
    }

    fn answer(&mut self, answer: Answer) {
        // The queue is full only if the server does not read it.
        let _ = self.answers.push(answer);
    }
}

impl North for LocalNorth {
    /// Handles requests and advances the axes under local control. The engine calls it ahead of the motion devices.
    fn exchange(&mut self, exchange: &mut Exchange<'_>) {
        let now = (exchange.now, exchange.system());
        let Exchange { ending, ref mut axes, ref mut notice, .. } = *exchange;
        // The server of the socket has ended.
        let deserted = self.requests.is_abandoned() && self.requests.is_empty();
        for number in 0..self.axes.len().min(axes.len()) {
            if self.holds(number) && (ending || axes[number].has_controller()) {
                let failure = if ending { Failure::Ending } else { Failure::Taken };
                self.give_back(now, number, &mut axes[number], failure, notice);
            } else if deserted {
                self.lose(now, number, &mut axes[number]);
            }
        }
        for _ in 0..REQUESTS_PER_CYCLE {
            let Ok(request) = self.requests.pop() else { break };
            match request {
                Request::Order { client, id, axis, order } => {
                    let number = usize::from(axis);
                    match axes.get_mut(number) {
                        Some(axis) => self.order(now, ending, (number, axis), (client, id, order), notice),
                        None => self.answer(Answer { client, id, result: Err(Failure::NoAxis) }),
                    }
                }
                Request::Parameter { client, id, axis, parameter, wanted } => {
                    let number = usize::from(axis);
                    match axes.get(number) {
                        Some(axis) => {
                            self.access(ending, axis, (client, id, number), (parameter, wanted));
                        }
                        None => self.answer(Answer { client, id, result: Err(Failure::NoAxis) }),
                    }
                }
                Request::Gone { client } => {
                    for (number, axis) in axes.iter_mut().enumerate() {
                        if self.axes.get(number).is_some_and(|local| local.holder == Some(client)) {
                            self.lose(now, number, axis);
                        }
                    }
                }
            }
        }
        for (number, axis) in axes.iter_mut().enumerate() {
            self.advance(now, number, axis, notice);
        }
    }
}

/// That local control has taken or released an axis.
fn owner_changed(axis: usize, taken: bool) -> Notice {
    Notice::LocalControl { axis: axis_number(axis), taken }
}

/// Holder of an axis that stops because its client has disconnected.
const NOBODY: ClientId = 0;
