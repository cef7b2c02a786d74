//! The controller itself: its inputs and outputs, and the update cycle.
//!
//! What it does when, the start-up procedure of clause 7-1, stands in `phases.rs`.

use core::net::SocketAddrV4;
use std::collections::VecDeque;

use super::axis::Axis;
use super::clock::Clock;
use super::config::{ConfigError, ControllerConfig};
use super::event::Event;
use super::executor::Executor;
use super::failure::Failure;
use super::fault_reader::FaultReader;
use super::link::Link;
use super::misbehaviour::Abuse;
use super::node::NodeSeen;
use super::phases::Phase;
use super::program::Step;
use super::report::Report;
use super::services::Services;
use super::session::{Answer, Output, Session};
use super::update::Traffic;
use crate::wire::Error;
use crate::wire::motion::codes::{AxisControl, EventChecking};
use crate::wire::motion::event::ExtendedEventData;
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

/// Shortest time between two attempts to get a lost session back.
const REOPEN_INTERVAL: DurationNs = DurationNs::from_secs(1);

/// Events kept for the caller; more are dropped, the report has them all.
const EVENTS_MAX: usize = 1024;

/// What the caller has to do with the TCP stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StreamAction {
    /// Close it; nothing more is said of that.
    Close,
    /// Close it if it is still there, open a new one and say [`Controller::tcp_connected`].
    Reopen,
}

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
    pub(super) traffic: Traffic,
    pub(super) node: NodeSeen,
    pub(super) node_fault_reset: bool,
    pub(super) clock: Clock,
    /// The update cycle for which commands were planned ahead: its start.
    pub(super) planned: Option<MonotonicTime>,
    /// System time at reception less the device's time stamp, of the last update that had one.
    pub(super) skew: Option<DurationNs>,
    pub(super) disabling: bool,
    pub(super) abuse: Abuse,
    /// Why the connection is lost, after misbehaviour that may well have led to it.
    pub(super) lost: Option<Failure>,
    /// Whether a step has expected that.
    pub(super) loss_expected: bool,
    /// Connections opened so far.
    pub(super) connections: u32,
    /// The answer to the explicit message under way.
    pub(super) answer: Option<Result<Answer, Failure>>,
    /// In the fixed format: the service that was sent as a message, by instance and transaction ID.
    pub(super) carried: Option<(u8, u8)>,
    /// In the fixed format: faults that the updates do not name.
    pub(super) faults: FaultReader,
    /// Since when the session is lost while the motion connection goes on.
    pub(super) session_lost: Option<MonotonicTime>,
    /// When another stream is to be opened for it, and when the last one was.
    reopen_at: Option<MonotonicTime>,
    reopened_at: Option<MonotonicTime>,
    /// How long the motions may take to their end.
    pub(super) stop_patience: DurationNs,
    stream: Option<StreamAction>,
}

impl Controller {
    /// A controller for one device and one program; nothing is sent before [`Controller::tcp_connected`].
    ///
    /// # Errors
    /// A value of the configuration that cannot work, or a step that would fail for certain.
    pub fn new(config: ControllerConfig, program: Vec<Step>) -> Result<Self, ConfigError> {
        config.check()?;
        for (step, row) in program.iter().enumerate() {
            row.check(&config).map_err(|failure| ConfigError::Step { step, failure })?;
        }
        Ok(Self {
            phase: Phase::Idle,
            session: Session::new(&config),
            link: Link::of(&config),
            services: Services::new(config.time_outs.service),
            axes: (1..)
                .zip(config.axes.iter().cloned())
                .map(|(n, setup)| Axis::new(n, config.format, setup))
                .collect(),
            executor: Executor::new(program),
            events: VecDeque::with_capacity(EVENTS_MAX),
            report: Report::default(),
            next_tick: None,
            traffic: Traffic::default(),
            node: NodeSeen::default(),
            node_fault_reset: false,
            clock: Clock::default(),
            planned: None,
            skew: None,
            disabling: false,
            abuse: Abuse::default(),
            lost: None,
            loss_expected: false,
            connections: 0,
            answer: None,
            carried: None,
            faults: FaultReader::default(),
            session_lost: None,
            reopen_at: None,
            reopened_at: None,
            stop_patience: DurationNs::ZERO,
            stream: None,
            config,
        })
    }

    /// The configuration.
    #[must_use]
    pub const fn config(&self) -> &ControllerConfig {
        &self.config
    }

    /// The controller has another grandmaster from now on, bytes as in the Time Sync object: Group_Sync names it. A controller
    /// that runs asynchronously goes on so.
    pub fn set_grand_master(&mut self, grand_master: [u8; 8]) {
        if let Some(known) = &mut self.config.grand_master {
            *known = grand_master;
        }
    }

    /// Whether the run is over and everything is closed.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.phase == Phase::Closed
    }

    /// Where the C-to-D datagrams go if the device said so; otherwise UDP port 2222 of the device.
    #[must_use]
    pub fn datagram_destination(&self) -> Option<SocketAddrV4> {
        self.link.destination()
    }

    /// The value of an attribute in the cyclic write data of an axis instance, in wire order; `None` if it is not among
    /// them.
    #[must_use]
    pub fn cyclic_write(&self, instance: u8, attribute: u16) -> Option<&[u8]> {
        self.axes.get(usize::from(instance).checked_sub(1)?)?.lists.written(attribute)
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
        let keep_alive = self.session.keep_alive_at().filter(|_| self.keeps_session());
        let wakes = [tick, self.session.wake_at(), self.link.wake_at(), keep_alive, self.reopen_at];
        wakes.into_iter().flatten().min()
    }

    /// Whether the motion connection is open: it does not need the TCP stream to go on.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.link.is_open()
    }

    fn keeps_session(&self) -> bool {
        self.link.is_open() && !self.abuse.vanished && !self.abuse.stream_dropped
    }

    /// What to do with the TCP stream, once. To be asked for after every input, as the events are.
    pub fn poll_stream_action(&mut self) -> Option<StreamAction> {
        self.stream.take()
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Bytes for the TCP stream; returns how many were put into `buffer`.
    pub fn poll_stream_transmit(&mut self, buffer: &mut [u8]) -> Option<usize> {
        if self.abuse.vanished {
            return None;
        }
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
            self.connections += 1;
            self.session.start(now);
        } else {
            self.session.resume(now);
        }
    }

    /// The TCP stream is gone, or could not be opened again. While the motion connection is open the run goes on, and
    /// [`StreamAction::Reopen`] asks for another stream.
    pub fn tcp_closed(&mut self, now: MonotonicTime) {
        if self.abuse.vanished || self.abuse.stream_dropped || self.phase == Phase::Idle {
            return;
        }
        if self.link.is_open() {
            self.session.lose();
            self.lose_session(now);
            return self.drain_session(now);
        }
        if !matches!(self.phase, Phase::Closing | Phase::Closed | Phase::Reconnecting) {
            self.record_failure(Failure::StreamClosed);
        }
        self.link.close();
        self.session.stream_closed();
        self.drain_session(now);
    }

    /// Has another stream opened, at once or after a while.
    fn lose_session(&mut self, now: MonotonicTime) {
        if self.session_lost.is_none() {
            self.session_lost = Some(now);
            self.event(Event::SessionLost);
        }
        self.reopen_at = Some(self.reopened_at.map_or(now, |last| now.max(last + REOPEN_INTERVAL)));
    }

    /// Ends the run early: stops the axes, disables them, and closes the connection.
    pub fn finish(&mut self, now: MonotonicTime) {
        self.wind_up(now);
        self.drain_session(now);
    }

    /// Ends the run early as [`Controller::finish`] does, and lets it fail for that.
    pub fn interrupt(&mut self, now: MonotonicTime) {
        if !matches!(self.phase, Phase::Stopping { .. } | Phase::Closing | Phase::Closed) {
            self.record_failure(Failure::Interrupted);
        }
        self.finish(now);
    }

    /// Bytes of the TCP stream.
    pub fn handle_stream(&mut self, now: MonotonicTime, bytes: &[u8]) {
        self.session.handle_stream(now, bytes);
        self.drain_session(now);
    }

    /// A datagram that came to the I/O port.
    pub fn handle_datagram(&mut self, now: MonotonicTime, system_time: SystemTime, bytes: &[u8]) {
        self.clock.feed(now, system_time);
        match self.link.receive(now, bytes) {
            Ok(Some((arrival, update))) => self.handle_update(now, arrival, &update),
            Ok(None) => {}
            Err(error) => self.malformed(error),
        }
    }

    /// Time has passed; sends the update that is due. To be called at [`Controller::wake_at`], later is
    /// possible.
    pub fn handle_time(&mut self, now: MonotonicTime, system_time: SystemTime) {
        self.session.handle_time(now);
        self.link.handle_time(now);
        if self.keeps_session() {
            self.session.keep_alive(now);
        }
        if self.reopen_at.take_if(|at| *at <= now).is_some() {
            self.reopened_at = Some(now);
            self.stream = Some(StreamAction::Reopen);
        }
        self.drain_session(now);
        if let Some(due) = self.next_tick
            && self.link.is_open()
            && now >= due
        {
            self.clock.feed(now, system_time);
            self.tick(now, due);
            self.drain_session(now);
        }
    }

    pub(super) fn event(&mut self, event: Event) {
        push(&mut self.events, event);
    }

    pub(super) fn malformed(&mut self, error: Error) {
        self.report.malformed += 1;
        self.event(Event::Malformed { error });
    }

    pub(super) fn drain_session(&mut self, now: MonotonicTime) {
        while let Some(output) = self.session.poll() {
            match output {
                Output::Identified(identity) => {
                    self.report.identity = Some(identity.clone());
                    self.event(Event::Identified(identity));
                }
                Output::Registered(handle) => {
                    self.session_lost = None;
                    self.event(Event::SessionRegistered { handle });
                }
                Output::Lost => self.lose_session(now),
                Output::Malformed(error) => self.malformed(error),
                Output::Failed(failure) => self.fail(now, failure),
                Output::Opened(opened) => {
                    let (o_to_t_id, t_to_o_id) = (opened.o_to_t_id, opened.t_to_o_id);
                    self.event(Event::ConnectionOpened { o_to_t_id, t_to_o_id });
                    self.link.open(opened);
                    self.phase = Phase::FirstUpdate { since: now };
                    self.next_tick = Some(now);
                }
                Output::Answered(asker, answer) => self.take_answer(now, asker, answer),
                Output::Closed => {
                    if self.phase == Phase::Reconnecting {
                        self.restart();
                    } else if self.phase != Phase::Closed {
                        self.phase = Phase::Closed;
                        self.link.close();
                        self.event(Event::Closed);
                    }
                }
            }
        }
        self.carry_services(now);
    }

    pub(super) fn record_failure(&mut self, failure: Failure) {
        if self.report.failure.is_some() {
            return;
        }
        self.report.failure = Some(failure);
        if self.executor.is_under_way() {
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
        self.abuse.end();
        match self.phase {
            _ if self.lost.is_some() || self.abuse.vanished => self.close(now),
            Phase::Synchronizing { .. } | Phase::Initializing { .. } | Phase::Program => {
                self.services.clear();
                self.faults.restart();
                self.node_fault_reset = false;
                self.disabling = false;
                let mut longest = DurationNs::ZERO;
                for axis in &mut self.axes {
                    axis.handshake.cancel();
                    match axis.stop(None) {
                        Ok(length) => longest = longest.max(length),
                        // What cannot be stopped smoothly is stopped by the device.
                        Err(_) => axis.handshake.request(AxisControl::DISABLE),
                    }
                }
                let time_outs = &self.config.time_outs;
                self.stop_patience = time_outs.axis_control.max(longest + time_outs.motion_margin);
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
        if matches!(self.phase, Phase::Closing | Phase::Closed) {
            return;
        }
        self.phase = Phase::Closing;
        self.reopen_at = None;
        self.link.close();
        if self.abuse.vanished || self.abuse.stream_dropped {
            self.session.stream_closed();
        } else if self.lost.is_some() {
            self.session.leave();
        } else {
            self.session.close(now);
        }
    }

    /// Closes what is still open, and then begins anew.
    pub(super) fn reconnect(&mut self, now: MonotonicTime) {
        self.event(Event::Reconnecting);
        self.services.clear();
        let unreachable = self.session.is_lost() || self.abuse.vanished || self.abuse.stream_dropped;
        if self.lost.is_some() || unreachable {
            self.restart();
        } else {
            self.phase = Phase::Reconnecting;
            self.link.close();
            self.session.close(now);
        }
    }

    /// As before the first connection, with the program where it is.
    fn restart(&mut self) {
        // What still comes on the old connection is none of the new one's.
        self.config.connection_serial = self.config.connection_serial.wrapping_add(1);
        self.config.t_to_o_id = self.config.t_to_o_id.wrapping_add(1);
        self.session = Session::new(&self.config);
        self.link = Link::of(&self.config);
        self.services = Services::new(self.config.time_outs.service);
        self.axes.iter_mut().for_each(Axis::reconnect);
        self.traffic = Traffic::default();
        self.node.reconnect();
        self.node_fault_reset = false;
        self.clock.reconnect();
        self.planned = None;
        self.skew = None;
        self.abuse = Abuse::default();
        self.lost = None;
        self.loss_expected = false;
        self.answer = None;
        self.carried = None;
        self.faults = FaultReader::default();
        self.next_tick = None;
        (self.session_lost, self.reopen_at, self.reopened_at) = (None, None, None);
        self.phase = Phase::Idle;
        self.stream = Some(StreamAction::Reopen);
    }

    /// Tells the caller to close the stream.
    pub(super) fn drop_stream(&mut self) {
        self.stream = Some(StreamAction::Close);
    }

    /// Arms events of an axis, with the parameters that extended checking needs. Each comes as [`Event::AxisEvent`].
    /// Whether the device checks for them shows in [`Controller::event_status`]. `false` if there is no such axis.
    pub fn arm_events(
        &mut self,
        axis: u8,
        checking: EventChecking,
        parameters: Option<&ExtendedEventData>,
    ) -> bool {
        let axis = self.axes.iter_mut().find(|known| known.instance() == axis);
        axis.map(|axis| axis.events.arm(checking, parameters)).is_some()
    }

    /// Event Checking Status of the newest update; `None` if there is no such axis.
    #[must_use]
    pub fn event_status(&self, axis: u8) -> Option<EventChecking> {
        self.axes.iter().find(|known| known.instance() == axis).map(|axis| axis.events.status())
    }

    /// The value of an attribute in the cyclic read data of the newest update that had some, as its octets; `None` if there is no such
    /// axis, or its list does not hold the attribute.
    #[must_use]
    pub fn cyclic_read(&self, axis: u8, attribute: u16) -> Option<&[u8]> {
        self.axes.iter().find(|known| known.instance() == axis)?.lists.value(attribute)
    }
}

/// Keeps an event for the caller while there is room.
pub(super) fn push(events: &mut VecDeque<Event>, event: Event) {
    if events.len() < EVENTS_MAX {
        events.push_back(event);
    }
}
