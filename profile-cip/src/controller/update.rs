//! The update cycle: what comes in an update, what goes out in one, and how long both take.

use super::axis::{Axis, UpdateTime};
use super::engine::{Controller, push};
use super::event::Event;
use super::failure::Failure;
use super::fault_reader::FaultRead;
use super::link::{Arrival, Update};
use super::misbehaviour::Spoil;
use super::phases::Phase;
use super::report::Report;
use super::services::Room;
use crate::wire::Error;
use crate::wire::motion::codes::{CommandTarget, NodeControl, NodeFault, NodeStatus, TimeDataSet};
use crate::wire::motion::fixed::{FixedActual, FixedCommand};
use crate::wire::motion::header::CommandHeader;
use crate::wire::motion::{ActualEvents, ActualFrame, CommandInstance, CommandValues, Format};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

/// Update IDs.
const IDS: usize = 256;

/// The updates of one connection.
#[derive(Debug)]
pub(super) struct Traffic {
    /// ID of the update sent last.
    pub update_id: u8,
    /// Updates sent.
    pub sent: u64,
    /// When the update with this ID was sent, until the device says that it came.
    sent_at: [Option<MonotonicTime>; IDS],
    received_at: Option<MonotonicTime>,
}

impl Default for Traffic {
    fn default() -> Self {
        Self { update_id: 0, sent: 0, sent_at: [None; IDS], received_at: None }
    }
}

impl Traffic {
    fn note_sent(&mut self, now: MonotonicTime, update_id: u8, really: bool) {
        self.sent += 1;
        self.sent_at[usize::from(update_id)] = really.then_some(now);
    }

    fn handle_update(&mut self, now: MonotonicTime, report: &mut Report) {
        if let Some(before) = self.received_at.replace(now) {
            report.interval.add(now - before);
        }
    }

    /// The device has processed this update of ours.
    fn handle_received(&mut self, now: MonotonicTime, received: u8, report: &mut Report) {
        if let Some(sent) = self.sent_at[usize::from(received)].take() {
            report.round_trip.add(now - sent);
        }
    }
}

impl Controller {
    pub(super) fn handle_update(&mut self, now: MonotonicTime, arrival: Arrival, update: &Update<'_>) {
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
        self.traffic.handle_update(now, &mut self.report);
        match update {
            Update::Variable(frame) => self.handle_variable(now, frame),
            Update::Fixed(actual) => self.handle_fixed(now, actual),
        }
    }

    /// An update of the fixed format: no time stamp, and nothing about what the device received.
    fn handle_fixed(&mut self, now: MonotonicTime, actual: &FixedActual) {
        self.node.status = actual.node_status;
        self.faults.handle(actual);
        if !actual.node_status.contains(NodeStatus::FAULT) {
            self.note_node_fault(NodeFault::NONE);
        }
        // Before that only the head says something.
        if actual.node_status.contains(NodeStatus::DATA_VALID)
            && let Some(axis) = self.axes.first_mut()
        {
            let at = self.clock.to_local(self.clock.system_at(now));
            let time = UpdateTime { at, ahead: self.config.period() * 2 };
            let events = &mut self.events;
            axis.handle(&actual.block(), time, |event| push(events, event));
        }
    }

    fn note_node_fault(&mut self, fault: NodeFault) {
        let events = &mut self.events;
        self.node.handle_fault(fault, &mut self.report, |event| push(events, event));
    }

    /// Whether attributes can be read that the updates of the fixed format do not bring.
    pub(super) const fn reads_faults(&self) -> bool {
        !self.abuse.vanished && !self.abuse.stream_dropped
    }

    /// In the fixed format: finds out by services which fault there is.
    fn read_faults(&mut self, now: MonotonicTime) {
        if self.config.format != Format::Fixed || !self.reads_faults() {
            return;
        }
        let room = self.room();
        match self.faults.poll(&mut self.services, room) {
            Ok(None) => {}
            Ok(Some(FaultRead::Node { fault, over })) => {
                self.note_node_fault(fault);
                if over {
                    self.note_node_fault(NodeFault::NONE);
                }
            }
            Ok(Some(FaultRead::Axis(record))) => {
                let events = &mut self.events;
                if let Some(axis) = self.axes.first_mut() {
                    axis.handle_fault(record, |event| push(events, event));
                }
            }
            // On the way out the failure before counts.
            Err(_) if matches!(self.phase, Phase::Stopping { .. }) => {}
            Err(failure) => self.fail(now, failure),
        }
    }

    fn handle_variable(&mut self, now: MonotonicTime, frame: &ActualFrame<'_>) {
        let header = frame.header();
        let events = &mut self.events;
        self.node.handle(header, &mut self.report, |event| push(events, event));
        self.traffic.handle_received(now, header.last_received_id, &mut self.report);
        self.clock.handle_received(header.last_received_id);
        let synchronous = header.node_status.contains(NodeStatus::SYNC_MODE);
        // A device without time synchronization sends time stamps of zero.
        let stamp = header.time_stamp.filter(|stamp| *stamp != 0).map(SystemTime);
        let period = self.config.period();
        let stamp = stamp.map(|stamp| self.clock.compensate(stamp, header.time_offset, period));
        let system_time = self.clock.system_at(now);
        self.skew = stamp.map(|stamp| system_time - stamp);
        let limit = self.config.period() * i64::from(self.config.update_delay_low_limit);
        if synchronous && self.skew.is_some_and(|skew| skew > limit) {
            self.report.late_updates += 1;
        }
        let at = self.clock.to_local(stamp.filter(|_| synchronous).unwrap_or(system_time));
        let time = UpdateTime { at, ahead: period * 2 };
        for instance in frame.instances() {
            if let Some(response) = &instance.service {
                self.services.handle(now, instance.number, response);
            }
            let Some(index) = usize::from(instance.number).checked_sub(1) else { continue };
            if let (Some(axis), Some(block)) = (self.axes.get_mut(index), &instance.cyclic) {
                let events = &mut self.events;
                axis.handle(block, time, |event| push(events, event));
            }
            if let (Some(axis), Some(block)) = (self.axes.get_mut(index), &instance.read) {
                axis.lists.handle(block);
            }
            self.handle_events(index, instance.events.as_ref(), header.last_received_id);
        }
    }

    /// Runs the Controller Task that was due at `due`.
    pub(super) fn tick(&mut self, now: MonotonicTime, due: MonotonicTime) {
        let period = self.config.period();
        let missed = (now - due).0 / period.0.max(1);
        let task = due + period * missed;
        self.next_tick = Some(task + period);
        self.report.missed_cycles += missed.unsigned_abs();
        if self.lost.is_none()
            && let Err(failure) = self.supervise(now)
        {
            if !(self.abuse.ever && self.phase == Phase::Program) {
                self.record_failure(failure);
                return self.close(now);
            }
            // The program may have meant just that.
            self.lost = Some(failure);
            self.event(Event::ConnectionLost);
        }
        // The time stamp is that of the start of the update cycle, however late this call is.
        let start = task - self.config.timing.phase(period);
        let ahead = self.config.timing.plans_ahead();
        if !ahead {
            self.run_task(now);
        }
        if !self.is_silent() {
            if self.planned.take() != Some(start) {
                self.plan(now, start);
            }
            if let Err(error) = self.send(now, start, 1 + missed) {
                self.malformed(error);
            }
        }
        if ahead {
            self.run_task(now);
            self.plan(now, start + period);
            self.planned = Some(start + period);
        }
    }

    /// What a Controller Task does beside planning: services and the program.
    fn run_task(&mut self, now: MonotonicTime) {
        self.services.advance(now);
        self.read_faults(now);
        if let Err(failure) = self.advance(now) {
            self.fail(now, failure);
        }
        self.services.advance(now);
    }

    /// Whether no update is sent.
    fn is_silent(&self) -> bool {
        !self.link.is_open() || self.lost.is_some() || self.abuse.vanished
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

    /// Whether the axes are configured and get commands.
    const fn is_configured(&self) -> bool {
        matches!(
            self.phase,
            Phase::Synchronizing { .. }
                | Phase::Completion { .. }
                | Phase::Initializing { .. }
                | Phase::Program
                | Phase::Stopping { .. }
        )
    }

    /// Whether updates carry time stamps.
    const fn is_timed(&self) -> bool {
        self.config.grand_master.is_some()
            && !matches!(self.phase, Phase::FirstUpdate { .. } | Phase::ClassConfiguration { .. })
    }

    /// The update that commands are meant for; asynchronous ones apply on reception, clause 2-1.2.
    const fn target(&self) -> CommandTarget {
        if self.is_timed() { self.config.command_target } else { CommandTarget::IMMEDIATE }
    }

    /// Plans the commands of all axes for the update cycle that begins at `start`.
    fn plan(&mut self, now: MonotonicTime, start: MonotonicTime) {
        if !self.is_configured() || self.is_silent() {
            return;
        }
        let synchronous = self.is_timed() && self.node.status.contains(NodeStatus::SYNC_MODE);
        let target = self.config.period() * i64::from(self.target().0);
        let stamp = self.clock.to_local(self.clock.system_at(start));
        let applies_at = stamp + if synchronous { target } else { DurationNs::ZERO };
        let mut planned = Ok(());
        for axis in &mut self.axes {
            planned = planned.and(axis.plan(start + target, applies_at));
        }
        if let Err(failure) = planned {
            self.fail(now, failure);
        }
    }

    /// Sends the update of the cycle that begins at `start`, so many periods after the one before.
    fn send(&mut self, now: MonotonicTime, start: MonotonicTime, periods: i64) -> Result<(), Error> {
        let first = matches!(self.phase, Phase::FirstUpdate { .. });
        let (configured, timed, target) = (self.is_configured(), self.is_timed(), self.target());
        let spoil = self.abuse.next();
        let fresh = !first || self.traffic.sent == 0;
        if !first {
            // The ID counts update periods, the ones missed included, so that it keeps matching the device's.
            let [step, ..] = periods.to_le_bytes();
            self.traffic.update_id = self.traffic.update_id.wrapping_add(step);
        }
        let update_id = self.traffic.update_id;
        let mut node_control = NodeControl::REMOTE_CONTROL;
        node_control.set(NodeControl::DATA_VALID, !first);
        node_control.set(NodeControl::SYNC_CONTROL, configured && timed);
        node_control.set(NodeControl::FAULT_RESET, self.node_fault_reset);
        if self.config.format == Format::Fixed {
            return self.send_fixed(now, node_control, first, fresh, &spoil);
        }
        let stamp = self.clock.system_at(start);
        let time_offset = if timed { self.clock.due(update_id) } else { None };
        let header = CommandHeader {
            update_id: update_id.wrapping_sub(spoil.update_id_back),
            node_control,
            instance_count: 0,
            last_received_id: if first { 0 } else { self.link.last_received() },
            time_stamp: timed.then_some((stamp - spoil.stamp_age).0),
            time_offset,
            diagnostics: if first { TimeDataSet::empty() } else { self.config.time_data },
        };
        let request = self.services.request();
        let service_of = |number: u8| request.filter(|(instance, _)| *instance == number).map(|(_, r)| r);
        let busy = request.is_some();
        let axes = self.axes.iter_mut().map(|axis| {
            let events = configured.then(|| axis.events.block(update_id, busy)).flatten();
            let axis = &*axis;
            CommandInstance {
                number: axis.instance(),
                cyclic: configured.then(|| axis.block(configured, target, &spoil)),
                write: axis.lists.block().filter(|_| configured),
                events,
                service: service_of(axis.instance()),
            }
        });
        let class = CommandInstance { number: 0, service: service_of(0), ..CommandInstance::default() };
        let instances = core::iter::once(class)
            .chain(axes)
            .filter(|instance| instance.cyclic.is_some() || instance.service.is_some());
        self.link.send(now, &header, instances, fresh, &spoil)?;
        self.traffic.note_sent(now, update_id, !spoil.skip);
        self.report.cycles += 1;
        Ok(())
    }

    /// An update of the fixed format. The first one says nothing but its head; commands begin with Configuration Complete.
    fn send_fixed(
        &mut self,
        now: MonotonicTime,
        node_control: NodeControl,
        first: bool,
        fresh: bool,
        spoil: &Spoil,
    ) -> Result<(), Error> {
        let update_id = self.traffic.update_id;
        let configured = self.is_configured();
        let head = FixedCommand {
            update_id: update_id.wrapping_sub(spoil.update_id_back),
            node_control,
            ..FixedCommand::default()
        };
        let command = match self.axes.first().filter(|_| !first) {
            Some(axis) => {
                let block = axis.block(configured, CommandTarget::IMMEDIATE, spoil);
                FixedCommand {
                    control_mode: block.control_mode,
                    feedback_mode: block.feedback_mode,
                    axis_control: block.axis_control,
                    actual_data_set: block.actual_data_set,
                    status_data_set: block.status_data_set,
                    values: if configured { block.values } else { CommandValues::default() },
                    ..head
                }
            }
            None => head,
        };
        self.link.send_fixed(now, &command, fresh, spoil)?;
        self.traffic.note_sent(now, update_id, false);
        self.report.cycles += 1;
        Ok(())
    }

    /// Room of a service beside the cyclic data.
    pub(super) fn room(&self) -> Room {
        let lens = || self.axes.iter().map(Axis::lens);
        let sum = lens().fold((0, 0), |all, axis| (all.0 + axis.0, all.1 + axis.1));
        let most = lens().fold((0, 0), |most: (usize, usize), axis| (most.0.max(axis.0), most.1.max(axis.1)));
        self.link.room(sum, most)
    }

    /// Takes the event block of an axis.
    fn handle_events(&mut self, index: usize, block: Option<&ActualEvents>, received: u8) {
        let Some(axis) = self.axes.get_mut(index) else { return };
        let (number, events) = (axis.instance(), &mut self.events);
        let super::axis::Axis { events: checks, seen, .. } = axis;
        checks.handle(block, received, |notification| {
            seen.note_event(notification);
            push(events, Event::AxisEvent { axis: number, notification });
        });
    }
}
