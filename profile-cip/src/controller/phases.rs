//! The start-up procedure of clause 7-1, the program, and the orderly end.
//!
//! | phase | what is sent | goes on when |
//! |---|---|---|
//! | Idle | | the TCP stream is there |
//! | Explicit | session, Identity, Forward_Open | the connection is open |
//! | FirstUpdate | header, update ID 0, Remote Control | the first D-to-C update came |
//! | ClassConfiguration | Set_Axis_Attributes_List to instance 0 | answered |
//! | GroupSync | Group_Sync, again and again; time stamps | device synchronized, and no skew seen here |
//! | AxisConfiguration | Set_Axis_Attributes_List to one axis after the other | answered |
//! | AxisScaling | Get_Axis_Attributes_List of the scaling, where it is the device's | answered |
//! | Completion | fixed format only: Set_Axis_Attributes_List of Command Control and Control Status | answered |
//! | Synchronizing | cyclic blocks, Configuration Complete, Sync Control | Sync Mode |
//! | Initializing | the same | every axis has left Initializing |
//! | Program | the same, with the commands of the steps | the steps have finished |
//! | Reconnecting | Forward_Close, UnRegisterSession, and Idle again | answered |
//! | Stopping | controlled stop, then Disable | no axis is enabled |
//! | Closing | Forward_Close, UnRegisterSession | answered, or nobody answers |
//! | Closed | | |
//!
//! Without a grand master GroupSync and Synchronizing are left out and no time stamps are sent. In the fixed format
//! services are explicit messages, see `carrier.rs`.
//! Whatever fails leads to Stopping if the connection is still there, and to Closing otherwise.

use super::axis::Axis;
use super::config::{AttributeSet, Scaling, command_control};
use super::engine::{Controller, push};
use super::event::Event;
use super::executor::{Context, report_refused};
use super::failure::Failure;
use super::services::{Outcome, Ticket};
use crate::device::attribute::id;
use crate::wire::motion::Format;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{
    AxisControl, AxisStateCode, CommandTarget, ControlStatus, NodeFault, NodeStatus, SyncStatus,
};
use profile_generic::time::{DurationNs, MonotonicTime};

/// Time between two Group_Sync requests.
const GROUP_SYNC_INTERVAL: DurationNs = DurationNs::from_millis(100);
/// Update periods by which the system times of controller and device may differ at Group_Sync.
const SKEW_PERIODS: i64 = 4;
/// Attributes of the scaling, Table 5-2.12, and what the first one says where the device scales.
const MOTION_SCALING_CONFIGURATION: u16 = 45;
const MOTION_RESOLUTION: u16 = 78;
const DRIVE_SCALING: u8 = 1;

/// Where a run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    Idle,
    Explicit,
    FirstUpdate { since: MonotonicTime },
    ClassConfiguration { ticket: Ticket },
    GroupSync { since: MonotonicTime, ticket: Option<Ticket>, next: MonotonicTime, last: SyncStatus },
    AxisConfiguration { instance: u8, ticket: Ticket },
    AxisScaling { instance: u8, ticket: Ticket },
    Completion { ticket: Ticket },
    Synchronizing { since: MonotonicTime },
    Initializing { since: MonotonicTime },
    Program,
    Reconnecting,
    Stopping { since: MonotonicTime },
    Closing,
    Closed,
}

impl Controller {
    /// Goes through the phases as far as possible.
    // Flat: one arm per phase.
    pub(super) fn advance(&mut self, now: MonotonicTime) -> Result<(), Failure> {
        if self.node.fault != NodeFault::NONE
            && !matches!(self.phase, Phase::Program | Phase::Stopping { .. } | Phase::Closing | Phase::Closed)
        {
            return Err(Failure::NodeFault(self.node.fault));
        }
        match self.phase {
            Phase::FirstUpdate { .. } if self.link.received_at().is_some() => {
                let ticket = {
                    let room = self.room();
                    self.services.set(0, &self.config.class_attributes, room)?
                };
                self.phase = Phase::ClassConfiguration { ticket };
            }
            Phase::ClassConfiguration { ticket } => self.configure_class(now, ticket)?,
            Phase::GroupSync { since, ticket, next, last } => {
                self.phase = self.group_sync(now, since, ticket, next, last)?;
            }
            Phase::AxisConfiguration { instance, ticket } => self.configure_next(now, instance, ticket)?,
            Phase::AxisScaling { instance, ticket } => self.take_scaling(now, instance, ticket)?,
            Phase::Completion { ticket } => self.complete_configuration(now, ticket)?,
            Phase::Synchronizing { since } => {
                let waited = now - since;
                if self.node.status.contains(NodeStatus::SYNC_MODE) {
                    self.report.synchronous = true;
                    self.event(Event::Started { synchronous: true });
                    self.phase = Phase::Initializing { since: now };
                } else if waited > self.config.time_outs.synchronization {
                    return Err(Failure::NoSyncMode { waited, alarm: self.node.alarm });
                }
            }
            Phase::Initializing { since } => self.await_axes(now, now - since)?,
            Phase::Program => self.run_program(now)?,
            Phase::Stopping { since } => self.stop_axes(now, since),
            _ => {}
        }
        Ok(())
    }

    fn configure_class(&mut self, now: MonotonicTime, ticket: Ticket) -> Result<(), Failure> {
        if !self.take_configuration(0, ticket)? {
            return Ok(());
        }
        self.phase = if self.config.grand_master.is_some() {
            let last = SyncStatus::NOT_SYNCHRONIZED;
            Phase::GroupSync { since: now, ticket: None, next: now, last }
        } else {
            self.configure_axis(1)?
        };
        Ok(())
    }

    fn configure_next(&mut self, now: MonotonicTime, instance: u8, ticket: Ticket) -> Result<(), Failure> {
        if !self.take_configuration(instance, ticket)? {
            return Ok(());
        }
        if self.config.axes[usize::from(instance) - 1].scaling == Scaling::Device {
            let selectors = [(MOTION_SCALING_CONFIGURATION, 1), (MOTION_RESOLUTION, 4)]
                .map(|(id, size)| AttributeSelector::scalar(id, size));
            let room = self.room();
            let ticket = self.services.get(instance, &selectors, room)?;
            self.phase = Phase::AxisScaling { instance, ticket };
            return Ok(());
        }
        self.after_configuration(now, instance)
    }

    /// Takes the counts in a unit from the device, if it scales.
    fn take_scaling(&mut self, now: MonotonicTime, instance: u8, ticket: Ticket) -> Result<(), Failure> {
        let Some(result) = self.services.take(ticket) else { return Ok(()) };
        let Outcome::Get { values } = result? else { return Ok(()) };
        let value = |id| values.iter().find(|row| row.id == id).and_then(|row| row.value.as_ref().ok());
        let configuration = value(MOTION_SCALING_CONFIGURATION).and_then(|bytes| bytes.first()).copied();
        let resolution =
            value(MOTION_RESOLUTION).and_then(|bytes| Some(i32::from_le_bytes(bytes[..].try_into().ok()?)));
        let counts = f64::from(resolution.unwrap_or(0));
        if configuration != Some(DRIVE_SCALING) || counts <= 0.0 {
            return Err(Failure::ScalingUnknown { axis: instance, configuration });
        }
        self.axes[usize::from(instance) - 1].set_scale(counts);
        self.event(Event::Scaled { axis: instance, counts });
        self.after_configuration(now, instance)
    }

    fn after_configuration(&mut self, now: MonotonicTime, instance: u8) -> Result<(), Failure> {
        self.phase = if usize::from(instance) < self.axes.len() {
            self.configure_axis(instance + 1)?
        } else if self.config.grand_master.is_some() {
            Phase::Synchronizing { since: now }
        } else if self.config.format == Format::Fixed {
            let room = self.room();
            let sets = completion(self.config.command_target);
            Phase::Completion { ticket: self.services.set(instance, &sets, room)? }
        } else {
            self.event(Event::Started { synchronous: false });
            Phase::Initializing { since: now }
        };
        Ok(())
    }

    /// The device has been told that it is configured. One that knows it without being told refuses the attributes.
    fn complete_configuration(&mut self, now: MonotonicTime, ticket: Ticket) -> Result<(), Failure> {
        let Some(result) = self.services.take(ticket) else { return Ok(()) };
        if let Outcome::Set { refused } = result? {
            let sets = completion(self.config.command_target);
            let events = &mut self.events;
            report_refused(1, &sets, &refused, &mut |event| push(events, event))?;
        }
        self.event(Event::Started { synchronous: false });
        self.phase = Phase::Initializing { since: now };
        Ok(())
    }

    fn configure_axis(&mut self, instance: u8) -> Result<Phase, Failure> {
        let room = self.room();
        let sets = &self.config.axes[usize::from(instance) - 1].attributes;
        let ticket = self.services.set(instance, sets, room)?;
        Ok(Phase::AxisConfiguration { instance, ticket })
    }

    /// True when all attributes of the instance have been answered.
    fn take_configuration(&mut self, instance: u8, ticket: Ticket) -> Result<bool, Failure> {
        let Some(result) = self.services.take(ticket) else { return Ok(false) };
        let sets = match instance {
            0 => &self.config.class_attributes,
            axis => &self.config.axes[usize::from(axis) - 1].attributes,
        };
        let mut attributes = sets.len();
        if let Outcome::Set { refused } = result? {
            attributes = attributes.saturating_sub(refused.len());
            let events = &mut self.events;
            report_refused(instance, sets, &refused, &mut |event| push(events, event))?;
        }
        self.event(Event::Configured { instance, attributes });
        Ok(true)
    }

    /// Asks until the device is synchronized and the clocks of both sides agree, clause 5-2.4.1.1.
    fn group_sync(
        &mut self,
        now: MonotonicTime,
        since: MonotonicTime,
        ticket: Option<Ticket>,
        next: MonotonicTime,
        last: SyncStatus,
    ) -> Result<Phase, Failure> {
        let waited = now - since;
        if let Some(result) = ticket.and_then(|ticket| self.services.take(ticket)) {
            let Outcome::Sync(status) = result? else { return Ok(self.phase) };
            self.event(Event::GroupSync(status));
            let limit = (self.config.period() * SKEW_PERIODS).magnitude();
            let skewed = self.skew.is_some_and(|skew| skew.magnitude() > limit);
            if status == SyncStatus::SYNCHRONIZED && !skewed {
                self.clock.synchronize();
                return self.configure_axis(1);
            }
            let last =
                if skewed && status == SyncStatus::SYNCHRONIZED { SyncStatus::CLOCK_SKEW } else { status };
            return Ok(Phase::GroupSync { since, ticket: None, next: now + GROUP_SYNC_INTERVAL, last });
        }
        if ticket.is_none() && waited > self.config.time_outs.synchronization {
            return Err(Failure::NotSynchronized { status: last, skew: self.skew, waited });
        }
        let ticket = match (ticket, self.config.grand_master) {
            (None, Some(grand_master)) if now >= next => Some(self.services.group_sync(grand_master)),
            (ticket, _) => ticket,
        };
        Ok(Phase::GroupSync { since, ticket, next, last })
    }

    fn await_axes(&mut self, now: MonotonicTime, waited: DurationNs) -> Result<(), Failure> {
        let initializing =
            |axis: &&Axis| axis.state().is_none_or(|state| state == AxisStateCode::INITIALIZING);
        let late = self.config.late;
        match self.axes.iter().filter(|axis| !late.contains(axis.instance())).find(initializing) {
            None => {
                self.phase = Phase::Program;
                self.run_program(now)
            }
            Some(axis) if waited > self.config.time_outs.initialization => {
                let (axis, state) = (axis.instance(), axis.state());
                Err(Failure::AxisNotReady { axis, state, waited })
            }
            Some(_) => Ok(()),
        }
    }

    fn run_program(&mut self, now: MonotonicTime) -> Result<(), Failure> {
        let room = self.room();
        let fault_unread = self.faults.is_busy();
        let fault_coming = fault_unread && self.reads_faults();
        let events = &mut self.events;
        let mut event = |event| push(events, event);
        let mut context = Context {
            now,
            axes: &mut self.axes,
            services: &mut self.services,
            session: &mut self.session,
            answer: &mut self.answer,
            fault_unread,
            fault_coming,
            config: &mut self.config,
            link: &self.link,
            room,
            node: &mut self.node,
            node_fault_reset: &mut self.node_fault_reset,
            abuse: &mut self.abuse,
            lost: self.lost,
            loss_expected: &mut self.loss_expected,
            connection: self.connections,
            reconnect: false,
            drop_stream: false,
            steps: &mut self.report.steps,
            event: &mut event,
        };
        let finished = self.executor.poll(&mut context);
        let (reconnect, drop_stream) = (context.reconnect, context.drop_stream);
        self.report.steps_finished = self.executor.at();
        if drop_stream {
            self.drop_stream();
        }
        if finished? {
            match self.lost {
                Some(failure) if !self.loss_expected => return Err(failure),
                _ => self.wind_up(now),
            }
        } else if reconnect {
            self.reconnect(now);
        }
        Ok(())
    }

    /// First the motions end, then the axes are disabled, then the connection is closed.
    fn stop_axes(&mut self, now: MonotonicTime, since: MonotonicTime) {
        let waited = now - since;
        let patience = self.config.time_outs.axis_control;
        if !self.disabling && (waited > self.stop_patience || !self.axes.iter().any(Axis::is_moving)) {
            self.disabling = true;
            for axis in self.axes.iter_mut().filter(|axis| is_enabled(axis.state())) {
                axis.handshake.request(AxisControl::DISABLE);
            }
        }
        let enabled = self.axes.iter().any(|axis| is_enabled(axis.state()));
        // Which fault it was belongs into the report.
        let reading = self.faults.is_busy() && self.reads_faults();
        // Without a session nobody can be asked to close the connection; it may come back.
        let unreachable =
            self.session_lost.is_some_and(|since| now - since <= self.config.time_outs.explicit);
        if self.disabling && (!(enabled || reading || unreachable) || waited > self.stop_patience + patience)
        {
            self.close(now);
        }
    }
}

/// What ends the configuration in the fixed format, in this order.
fn completion(target: CommandTarget) -> [AttributeSet; 2] {
    let complete = ControlStatus::CONFIGURATION_COMPLETE.bits();
    [command_control(target), AttributeSet::usint(id::CONTROL_STATUS, complete).optional()]
}

/// States from which an axis has to be disabled before the connection may be closed.
fn is_enabled(state: Option<AxisStateCode>) -> bool {
    use AxisStateCode as S;
    [S::STARTING, S::RUNNING, S::TESTING, S::STOPPING, S::ABORTING].iter().any(|s| state == Some(*s))
}
