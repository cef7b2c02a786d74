//! The controller itself: its inputs and outputs, and the update cycle.
//!
//! What it does when, the start-up procedure of clause 7-1, stands in `phases.rs`.

use core::net::SocketAddrV4;
use std::collections::VecDeque;

use super::axis::{Axis, UpdateTime};
use super::config::{ConfigError, ControllerConfig};
use super::event::Event;
use super::executor::Executor;
use super::failure::Failure;
use super::link::{Arrival, Link};
use super::phases::Phase;
use super::program::Step;
use super::report::Report;
use super::services::Services;
use super::session::{Output, Session};
use super::time_offset::TimeOffset;
use crate::wire::Error;
use crate::wire::motion::codes::{CommandTarget, NodeAlarm, NodeControl, NodeFault, NodeStatus, TimeDataSet};
use crate::wire::motion::header::CommandHeader;
use crate::wire::motion::{ActualFrame, CommandInstance};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

/// Events kept for the caller; more are dropped, the report has them all.
const EVENTS_MAX: usize = 1024;

/// A CIP Motion controller without sockets and clocks. See the [module](super) for how to drive it.
#[derive(Debug)]
pub struct Controller {
    pub(super) config: ControllerConfig,
    pub(super) phase: Phase,
    pub(super) session: Session,
    pub(super) link: Link,
    pub(super) services: Services,
    pub(super) axes: Vec<Axis>,
    pub(super) executor: Executor,
    pub(super) events: VecDeque<Event>,
    pub(super) report: Report,
    pub(super) next_tick: Option<MonotonicTime>,
    pub(super) update_id: u8,
    pub(super) node_status: NodeStatus,
    pub(super) node_fault: NodeFault,
    pub(super) node_alarm: NodeAlarm,
    pub(super) node_fault_reset: bool,
    pub(super) offset: TimeOffset,
    /// System time at reception less the device's time stamp, of the last update that had one.
    pub(super) skew: Option<DurationNs>,
    pub(super) disabling: bool,
}

impl Controller {
    /// A controller for one device and one program; nothing is sent before [`Controller::tcp_connected`].
    ///
    /// # Errors
    /// A value of the configuration that cannot work, or a step for an axis that the configuration does not
    /// have.
    pub fn new(config: ControllerConfig, program: Vec<Step>) -> Result<Self, ConfigError> {
        config.check()?;
        let count = u8::try_from(config.axes.len()).unwrap_or(u8::MAX);
        if let Some(axis) = program.iter().find_map(|step| step.unknown_axis(count)) {
            let wanted = "an axis of the configuration";
            return Err(ConfigError { what: "axis of a step", value: f64::from(axis), wanted });
        }
        Ok(Self {
            phase: Phase::Idle,
            session: Session::new(&config),
            link: Link::new(config.connection_size, config.axes.len()),
            services: Services::new(config.time_outs.service),
            axes: (1..).zip(config.axes.iter().cloned()).map(|(n, setup)| Axis::new(n, setup)).collect(),
            executor: Executor::new(program),
            events: VecDeque::with_capacity(EVENTS_MAX),
            report: Report::default(),
            next_tick: None,
            update_id: 0,
            node_status: NodeStatus::empty(),
            node_fault: NodeFault::NONE,
            node_alarm: NodeAlarm::NONE,
            node_fault_reset: false,
            offset: TimeOffset::default(),
            skew: None,
            disabling: false,
            config,
        })
    }

    /// The configuration.
    #[must_use]
    pub const fn config(&self) -> &ControllerConfig {
        &self.config
    }

    /// Whether the run is over and everything is closed.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.phase == Phase::Closed
    }

    /// Whether the steps of the program are being carried out.
    #[must_use]
    pub fn is_running_program(&self) -> bool {
        self.phase == Phase::Program
    }

    /// Where the C-to-D datagrams go if the device said so; otherwise UDP port 2222 of the device.
    #[must_use]
    pub fn datagram_destination(&self) -> Option<SocketAddrV4> {
        self.link.destination()
    }

    /// The figures of the run so far.
    #[must_use]
    pub fn report(&self) -> Report {
        let axes = self.axes.iter().map(|axis| axis.report.clone()).collect();
        Report { axes, ..self.report.clone() }
    }

    /// When [`Controller::handle_time`] is due; `None` if only input can go on.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        let tick = self.next_tick.filter(|_| self.link.is_open());
        [tick, self.session.wake_at()].into_iter().flatten().min()
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Bytes for the TCP stream; returns how many were put into `buffer`.
    pub fn poll_stream_transmit(&mut self, buffer: &mut [u8]) -> Option<usize> {
        self.session.poll_transmit(buffer)
    }

    /// A C-to-D datagram; returns its length. `buffer` needs [`super::DATAGRAM_MAX`] bytes to hold any of
    /// them.
    pub fn poll_datagram_transmit(&mut self, buffer: &mut [u8]) -> Option<usize> {
        self.link.poll_transmit(buffer)
    }

    /// The TCP stream to the device is there.
    pub fn tcp_connected(&mut self, now: MonotonicTime) {
        if self.phase == Phase::Idle {
            self.phase = Phase::Explicit;
            self.session.start(now);
        }
    }

    /// The TCP stream is gone.
    pub fn tcp_closed(&mut self, now: MonotonicTime) {
        if !matches!(self.phase, Phase::Closing | Phase::Closed) {
            self.record_failure(Failure::StreamClosed);
        }
        self.link.close();
        self.session.stream_closed();
        self.drain_session(now);
    }

    /// Ends the run early: stops the axes, disables them, and closes the connection.
    pub fn finish(&mut self, now: MonotonicTime) {
        self.wind_up(now);
        self.drain_session(now);
    }

    /// Bytes of the TCP stream.
    pub fn handle_stream(&mut self, now: MonotonicTime, bytes: &[u8]) {
        self.session.handle_stream(now, bytes);
        self.drain_session(now);
    }

    /// A datagram that came to the I/O port.
    pub fn handle_datagram(&mut self, now: MonotonicTime, system_time: SystemTime, bytes: &[u8]) {
        match self.link.receive(now, bytes) {
            Ok(Some((arrival, frame))) => self.handle_update(now, system_time, arrival, &frame),
            Ok(None) => {}
            Err(error) => self.malformed(error),
        }
    }

    /// Time has passed; sends the update that is due. To be called at [`Controller::wake_at`], later is
    /// possible.
    pub fn handle_time(&mut self, now: MonotonicTime, system_time: SystemTime) {
        self.session.handle_time(now);
        self.drain_session(now);
        if let Some(due) = self.next_tick
            && self.link.is_open()
            && now >= due
        {
            self.tick(now, system_time, due);
            self.drain_session(now);
        }
    }

    pub(super) fn event(&mut self, event: Event) {
        push(&mut self.events, event);
    }

    fn malformed(&mut self, error: Error) {
        self.report.malformed += 1;
        self.event(Event::Malformed { error });
    }

    fn drain_session(&mut self, now: MonotonicTime) {
        while let Some(output) = self.session.poll() {
            match output {
                Output::Identified(identity) => {
                    self.report.identity = Some(identity.clone());
                    self.event(Event::Identified(identity));
                }
                Output::Registered(handle) => self.event(Event::SessionRegistered { handle }),
                Output::Malformed(error) => self.malformed(error),
                Output::Failed(failure) => self.fail(now, failure),
                Output::Opened(opened) => {
                    let (o_to_t_id, t_to_o_id) = (opened.o_to_t_id, opened.t_to_o_id);
                    self.event(Event::ConnectionOpened { o_to_t_id, t_to_o_id });
                    self.link.open(opened);
                    self.phase = Phase::FirstUpdate { since: now };
                    self.next_tick = Some(now);
                }
                Output::Closed => {
                    if self.phase != Phase::Closed {
                        self.phase = Phase::Closed;
                        self.link.close();
                        self.event(Event::Closed);
                    }
                }
            }
        }
    }

    fn record_failure(&mut self, failure: Failure) {
        if self.report.failure.is_some() {
            return;
        }
        self.report.failure = Some(failure);
        if self.phase == Phase::Program {
            self.report.failed_step = Some(self.executor.at());
        }
        self.event(Event::Failed(failure));
    }

    pub(super) fn fail(&mut self, now: MonotonicTime, failure: Failure) {
        self.record_failure(failure);
        self.wind_up(now);
    }

    /// Stops the axes if they can still be reached, else closes at once.
    pub(super) fn wind_up(&mut self, now: MonotonicTime) {
        match self.phase {
            Phase::Synchronizing { .. } | Phase::Initializing { .. } | Phase::Program => {
                self.services.clear();
                self.node_fault_reset = false;
                self.disabling = false;
                // A motion that cannot be stopped smoothly is stopped by the Disable that follows.
                for axis in &mut self.axes {
                    axis.handshake.cancel();
                    let _ = axis.stop(None);
                }
                self.phase = Phase::Stopping { since: now };
            }
            Phase::Idle => {
                self.phase = Phase::Closed;
                self.event(Event::Closed);
            }
            Phase::Stopping { .. } | Phase::Closing | Phase::Closed => {}
            _ => self.close(now),
        }
    }

    pub(super) fn close(&mut self, now: MonotonicTime) {
        if !matches!(self.phase, Phase::Closing | Phase::Closed) {
            self.phase = Phase::Closing;
            self.link.close();
            self.session.close(now);
        }
    }

    fn handle_update(
        &mut self,
        now: MonotonicTime,
        system_time: SystemTime,
        arrival: Arrival,
        frame: &ActualFrame<'_>,
    ) {
        let header = frame.header();
        match arrival {
            Arrival::Fresh { lost } => {
                self.report.updates += 1;
                self.report.lost_updates += u64::from(lost);
            }
            Arrival::Repeated => return,
            Arrival::Overtaken => {
                self.report.late_updates += 1;
                return;
            }
        }
        self.node_status = header.node_status;
        if header.node_fault != self.node_fault {
            self.node_fault = header.node_fault;
            self.report.node_fault =
                Some(header.node_fault).filter(|f| *f != NodeFault::NONE).or(self.report.node_fault);
            self.event(Event::NodeFault(header.node_fault));
        }
        if header.node_alarm != self.node_alarm {
            self.node_alarm = header.node_alarm;
            self.report.node_alarm =
                Some(header.node_alarm).filter(|a| *a != NodeAlarm::NONE).or(self.report.node_alarm);
            self.event(Event::NodeAlarm(header.node_alarm));
        }
        if let Some(counters) = header.update_diagnostics {
            self.report.device_lost_updates = counters.lost_updates;
            self.report.device_late_updates = counters.late_updates;
        }
        self.offset.handle_received(header.last_received_id);
        let synchronous = header.node_status.contains(NodeStatus::SYNC_MODE);
        // A device without time synchronization sends time stamps of zero.
        let stamp = header.time_stamp.filter(|stamp| *stamp != 0).map(SystemTime);
        self.skew = stamp.map(|stamp| system_time - stamp);
        let limit = self.config.period() * i64::from(self.config.update_delay_low_limit);
        if synchronous && self.skew.is_some_and(|skew| skew > limit) {
            self.report.late_updates += 1;
        }
        let time = UpdateTime {
            at: stamp.filter(|_| synchronous).unwrap_or(system_time),
            ahead: self.config.period() * 2,
        };
        for instance in frame.instances() {
            if let Some(response) = &instance.service {
                self.services.handle(now, instance.number, response);
            }
            let Some(index) = usize::from(instance.number).checked_sub(1) else { continue };
            if let (Some(axis), Some(block)) = (self.axes.get_mut(index), &instance.cyclic) {
                let events = &mut self.events;
                axis.handle(block, time, |event| push(events, event));
            }
            self.handle_events(index, instance.events.as_ref(), header.last_received_id);
        }
    }

    fn tick(&mut self, now: MonotonicTime, system_time: SystemTime, due: MonotonicTime) {
        let period = self.config.period();
        let missed = (now - due).0 / period.0.max(1);
        let tick = due + period * missed;
        self.next_tick = Some(tick + period);
        self.report.missed_cycles += missed.unsigned_abs();
        if let Err(failure) = self.supervise(now) {
            self.record_failure(failure);
            return self.close(now);
        }
        self.services.advance(now);
        if let Err(failure) = self.advance(now) {
            self.fail(now, failure);
        }
        self.services.advance(now);
        if !self.link.is_open() {
            return;
        }
        // The time stamp is that of the start of the update period, however late this call is.
        let stamp = system_time - (now - tick);
        let periods = 1 + missed;
        if let Err(error) = self.send(tick, stamp, periods) {
            self.malformed(error);
        }
    }

    /// Time-outs of the connection.
    fn supervise(&mut self, now: MonotonicTime) -> Result<(), Failure> {
        if let Phase::FirstUpdate { since } = self.phase {
            let waited = now - since;
            if self.link.received_at().is_none() && waited > self.config.time_outs.first_update {
                return Err(Failure::NoFirstUpdate { waited });
            }
            return Ok(());
        }
        let Some(received_at) = self.link.received_at() else { return Ok(()) };
        let silent = now - received_at;
        let limit = self.config.connection_timeout();
        if silent > limit {
            let last_update = self.link.last_received();
            return Err(Failure::ConnectionTimedOut { silent, limit, last_update });
        }
        let missing = u32::try_from(silent.0 / self.config.period().0.max(1)).unwrap_or(u32::MAX);
        match self.config.update_delay_high_limit {
            Some(limit) if missing > u32::from(limit) => Err(Failure::UpdatesMissing { missing, limit }),
            _ => Ok(()),
        }
    }

    fn send(&mut self, tick: MonotonicTime, stamp: SystemTime, periods: i64) -> Result<(), Error> {
        let phase = self.phase;
        let first = matches!(phase, Phase::FirstUpdate { .. });
        let configured = matches!(
            phase,
            Phase::Synchronizing { .. }
                | Phase::Initializing { .. }
                | Phase::Program
                | Phase::Stopping { .. }
        );
        let timed = self.config.grand_master.is_some()
            && !first
            && !matches!(phase, Phase::ClassConfiguration { .. });
        let fresh = !first || self.report.cycles == 0;
        if !first {
            // The ID counts update periods, the ones missed included, so that it keeps matching the device's.
            let [step, ..] = periods.to_le_bytes();
            self.update_id = self.update_id.wrapping_add(step);
        }
        let mut node_control = NodeControl::REMOTE_CONTROL;
        node_control.set(NodeControl::DATA_VALID, !first);
        node_control.set(NodeControl::SYNC_CONTROL, configured && timed);
        node_control.set(NodeControl::FAULT_RESET, self.node_fault_reset);
        let time_offset = if timed {
            let offset = stamp.0.wrapping_sub(tick.0).cast_signed();
            self.offset.measure(offset, self.update_id)
        } else {
            None
        };
        let header = CommandHeader {
            update_id: self.update_id,
            node_control,
            instance_count: 0,
            last_received_id: if first { 0 } else { self.link.last_received() },
            time_stamp: timed.then_some(stamp.0),
            time_offset,
            diagnostics: if first { TimeDataSet::empty() } else { TimeDataSet::UPDATE_DIAGNOSTICS },
        };
        // Asynchronous commands apply on reception, clause 2-1.2.
        let synchronous = timed && self.node_status.contains(NodeStatus::SYNC_MODE);
        let target = if timed { self.config.command_target } else { CommandTarget::IMMEDIATE };
        let ahead = self.config.period() * if synchronous { i64::from(target.0) } else { 0 };
        if configured {
            for axis in &mut self.axes {
                axis.plan(tick + self.config.period() * i64::from(target.0), stamp + ahead);
            }
        }
        let request = self.services.request();
        let service_of = |number: u8| request.filter(|(instance, _)| *instance == number).map(|(_, r)| r);
        let (update_id, busy) = (self.update_id, request.is_some());
        let axes = self.axes.iter_mut().map(|axis| CommandInstance {
            number: axis.instance(),
            cyclic: configured.then(|| axis.block(configured, target)),
            events: configured.then(|| axis.events.block(update_id, busy)).flatten(),
            service: service_of(axis.instance()),
            ..CommandInstance::default()
        });
        let class = CommandInstance { number: 0, service: service_of(0), ..CommandInstance::default() };
        let instances = core::iter::once(class)
            .chain(axes)
            .filter(|instance| instance.cyclic.is_some() || instance.service.is_some());
        self.link.send(&header, instances, fresh)?;
        self.report.cycles += 1;
        Ok(())
    }
}

/// Keeps an event for the caller while there is room.
pub(super) fn push(events: &mut VecDeque<Event>, event: Event) {
    if events.len() < EVENTS_MAX {
        events.push_back(event);
    }
}
