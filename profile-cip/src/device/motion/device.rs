//! The motion device: the I/O connection, the communications node and up to 16 axes.
//!
//! ```text
//! handle_io(C-to-D packet) -->  check all of it --> judge order and age --> axes, services, events
//! set_drive(axis, image)   -->  axes
//! poll(now)                -->  time-outs, state machines
//! command(axis)            <--  what the drive has to do
//! poll_transmit            <--  D-to-C packet
//! request / poll_reply     <->  Forward_Open, Forward_Close, explicit services
//! poll_attribute_access / complete_attribute  <->  attributes that live in the drive
//! ```
//!
//! An update that is wrong in any way is refused as a whole and counted ([`MotionCounters`]); a wrong form raises node
//! fault 4. See [`crate::device::axis::drive_link`] for the rules that keep an axis from moving on a doubtful command.
//!
//! Nothing is allocated after construction.

use arrayvec::ArrayVec;
use profile_generic::time::{MonotonicTime, SystemTime};

use super::cyclic_list::Direction;
use super::engine::Engine;
use super::explicit::ExplicitSide;
use super::fixed::with_services_alone;
use super::instances::Completed;
use super::io_connection::{IoConnection, Mode};
use super::io_counters::MotionCounters;
use super::{indication, service};
use crate::device::attribute::worker::AttributeAccess;
use crate::device::attribute::{AttributeDefinition, Scope, TableError};
pub use crate::device::axis::SequenceSettings;
use crate::device::axis::drive_link::{AxisCommandImage, DriveImage};
use crate::device::axis::event_channel::EventCounters;
use crate::device::axis::exception::ExceptionActions;
use crate::device::axis::fault_log::{FaultLog, LogEntry};
use crate::device::axis::refused::RefusedRequest;
use crate::device::axis::state::AxisState;
use crate::device::axis::{AxisConfig, FaultWords, PositionView};
use crate::device::motion_link::{MotionReply, MotionRequest, OpenParameters};
pub use crate::device::motion_link::{SyncQuality, SyncState};
use crate::device::objects::identity::ModuleState;
use crate::device::visualization::display::{self, Line, NodeCondition};
use crate::device::visualization::{self, AxisCondition, Indication};
use crate::wire::Error;
use crate::wire::motion::Format;
use crate::wire::motion::codes::{ControlMode, EventChecking, EventType, FaultType, NodeAlarm, NodeFault};
use crate::wire::motion::event::ExtendedEventData;
use crate::wire::status::GeneralStatus;

/// Most axes of a device: what the EtherNet/IP part of the standard allows.
pub const AXES_MAX: usize = 16;
/// What the device is made of.
#[derive(Debug, Clone)]
pub struct DeviceConfig {
    /// Format of the connection data. The fixed one is for a single axis without system time.
    pub format: Format,
    /// The axes in the order of their instance numbers, at most [`AXES_MAX`].
    pub axes: Vec<AxisConfig>,
    /// Attributes of class and instances beside those of the engine.
    pub attributes: Vec<AttributeDefinition>,
    /// Drive Power Structure Class ID, class attribute 34.
    pub power_structure_class_id: u32,
    /// Whether the device has a synchronized system time (CIP Sync).
    pub supports_sync: bool,
    /// Largest variation of system time with which the clock counts as synchronized as long as no controller says another one, ns;
    /// `None` if the clock of the device measures none.
    pub sync_threshold: Option<u32>,
    /// Time to produce a D-to-C update before its cycle starts, ns (Transmission Processing Time, clause 7-1.3).
    pub transmission_processing_ns: u64,
}

/// Why a device cannot be built.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DeviceError {
    /// There are no axes, or more than [`AXES_MAX`].
    AxisCount(usize),
    /// More than one axis for the fixed format.
    FixedAxisCount(usize),
    /// A system time for the fixed format, whose updates have no time stamps.
    FixedSync,
    /// The attribute definitions are not usable.
    Attributes(TableError),
}

impl core::fmt::Display for DeviceError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::AxisCount(count) => write!(f, "expected 1 to {AXES_MAX} axes, found {count}"),
            Self::FixedAxisCount(count) => {
                write!(f, "fixed connection format: expected 1 axis, found {count}")
            }
            Self::FixedSync => {
                f.write_str("fixed connection format: expected no CIP Sync, found it supported")
            }
            Self::Attributes(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for DeviceError {}

impl From<TableError> for DeviceError {
    fn from(error: TableError) -> Self {
        Self::Attributes(error)
    }
}

/// A CIP Motion device.
pub struct MotionDevice {
    pub(super) engine: Engine,
    explicit: ExplicitSide,
}

impl MotionDevice {
    /// Builds a device; its axes are Initializing.
    ///
    /// # Errors
    /// See [`DeviceError`].
    pub fn new(config: DeviceConfig) -> Result<Self, DeviceError> {
        if config.axes.is_empty() || config.axes.len() > AXES_MAX {
            return Err(DeviceError::AxisCount(config.axes.len()));
        }
        if config.format == Format::Fixed {
            if config.axes.len() > 1 {
                return Err(DeviceError::FixedAxisCount(config.axes.len()));
            }
            if config.supports_sync {
                return Err(DeviceError::FixedSync);
            }
        }
        let config = match config.format {
            Format::Variable => config,
            Format::Fixed => DeviceConfig { attributes: with_services_alone(config.attributes), ..config },
        };
        Ok(Self { engine: Engine::new(config)?, explicit: ExplicitSide::default() })
    }

    // -- getters ------------------------------------------------------------------------------------------------

    /// Number of axes; `axis` arguments count from 0, instance numbers from 1.
    #[must_use]
    pub fn axis_count(&self) -> usize {
        self.engine.instances.axis_count()
    }

    /// State of an axis, or `None` if there is no such axis.
    #[must_use]
    pub fn axis_state(&self, axis: usize) -> Option<AxisState> {
        self.engine.instances.slots.get(axis).map(|slot| slot.axis.state())
    }

    /// Exceptions, faults and alarms of an axis.
    #[must_use]
    pub fn fault_words(&self, axis: usize) -> Option<&FaultWords> {
        self.engine.instances.slots.get(axis).map(|slot| slot.axis.fault_words())
    }

    /// Control Mode of the last update of an axis, or `None` if there is no such axis.
    #[must_use]
    pub fn control_mode(&self, axis: usize) -> Option<ControlMode> {
        self.engine.instances.slots.get(axis).map(|slot| ControlMode(slot.axis.block().control_mode.0 & 0x0F))
    }

    /// Axis Faults (attribute 657) of an axis.
    #[must_use]
    pub fn axis_faults(&self, axis: usize) -> Option<u64> {
        self.fault_words(axis).map(|words| words.fault(FaultType::AXIS))
    }

    /// The log of faults and alarms of an axis.
    #[must_use]
    pub fn fault_log(&self, axis: usize) -> Option<&FaultLog> {
        self.engine.instances.slots.get(axis).map(|slot| slot.axis.log())
    }

    /// The next entry that came into the log of an axis or ended there.
    pub fn poll_fault_log(&mut self, axis: usize) -> Option<LogEntry> {
        self.engine.instances.slots.get_mut(axis).and_then(|slot| slot.axis.faults.log.poll())
    }

    /// The next request of an axis that was refused.
    pub fn poll_refused(&mut self, axis: usize) -> Option<RefusedRequest> {
        self.engine.instances.slots.get_mut(axis)?.axis.requests.refused.pop_at(0)
    }

    /// Fault and alarm records of an axis that were lost because the controller did not take them.
    #[must_use]
    pub fn dropped_records(&self, axis: usize) -> Option<u32> {
        self.engine.instances.slots.get(axis).map(|slot| slot.axis.dropped_records())
    }

    /// Active node fault.
    #[must_use]
    pub fn node_fault(&self) -> NodeFault {
        self.engine.node.fault()
    }

    /// Active node alarm.
    #[must_use]
    pub fn node_alarm(&self) -> NodeAlarm {
        self.engine.node.alarm()
    }

    /// What the connection has seen.
    #[must_use]
    pub fn counters(&self) -> &MotionCounters {
        &self.engine.statistics.counters
    }

    /// Why the last malformed update was refused.
    #[must_use]
    pub fn last_error(&self) -> Option<Error> {
        self.engine.statistics.last_error
    }

    /// The open connection.
    #[must_use]
    pub fn connection(&self) -> Option<&OpenParameters> {
        self.engine.connection.as_ref().map(|c| &c.parameters)
    }

    /// Whether the device produces its updates synchronously.
    #[must_use]
    pub fn is_synchronous(&self) -> bool {
        self.engine.connection.as_ref().is_some_and(|c| c.schedule.mode == Mode::Synchronous)
    }

    /// An instant of the controller's updates in system time, as its time stamps have it, and its update period in ns; `None`
    /// while it does not work synchronously.
    #[must_use]
    pub fn update_grid(&self) -> Option<(SystemTime, u64)> {
        let connection = self.engine.connection.as_ref()?;
        let synchronous = connection.schedule.mode == Mode::Synchronous;
        let stamp = connection.stamped_at.filter(|_| synchronous)?;
        Some((SystemTime(stamp), connection.period()))
    }

    /// Updates of the controller that may be missed before it is a fault: the Controller Update Delay High Limit.
    #[must_use]
    pub fn update_delay_high_limit(&self) -> u32 {
        u32::try_from(self.engine.instances.high_limit()).unwrap_or(u32::MAX)
    }

    /// The attributes of a scope in the order of their IDs.
    pub fn attributes(&self, scope: Scope) -> impl Iterator<Item = &AttributeDefinition> {
        self.engine.instances.table(scope).iter()
    }

    /// When to call [`MotionDevice::poll`] or [`MotionDevice::poll_transmit`] again at the latest; `None` while
    /// nothing is connected.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.engine.connection.as_ref().map(IoConnection::wake_at)
    }

    /// Events that are to be looked for on an axis now, with the parameters of extended checking. Watch positions and
    /// torque are evaluated here; the rest is the drive's part, which says in [`DriveImage::events_checking`] what it is
    /// looking for.
    #[must_use]
    pub fn armed_events(&self, axis: usize) -> Option<(EventChecking, &ExtendedEventData)> {
        self.engine
            .instances
            .slots
            .get(axis)
            .map(|slot| (slot.axis.events.armed(), slot.axis.events.parameters()))
    }

    /// What the drive of an axis has to do at `now`; `None` if there is no such axis.
    #[must_use]
    pub fn command(&self, axis: usize, now: MonotonicTime) -> Option<AxisCommandImage> {
        let slot = self.engine.instances.slots.get(axis)?;
        let period = self.engine.connection.as_ref().map_or(0, IoConnection::period);
        let limit = self.update_delay_high_limit();
        Some(slot.axis.command(now, &self.engine.context(None), period, limit))
    }

    // -- drive side ---------------------------------------------------------------------------------------------

    /// Takes what the drive of an axis reports; to be followed by [`MotionDevice::poll`] in the same cycle.
    pub fn set_drive(&mut self, axis: usize, image: DriveImage) {
        self.update_drive(axis, |drive| *drive = image);
    }

    /// What the drive of an axis reported last, or `None` if there is no such axis.
    #[must_use]
    pub fn drive(&self, axis: usize) -> Option<&DriveImage> {
        self.engine.instances.slots.get(axis).map(|slot| slot.axis.drive())
    }

    /// As [`MotionDevice::set_drive`], without a copy: `fill` gets what the drive reported before and has to write all of
    /// it anew ([`DriveImage::clear`] is where to begin). It is not called without such an axis.
    pub fn update_drive(&mut self, axis: usize, fill: impl FnOnce(&mut DriveImage)) {
        if let Some(slot) = self.engine.instances.slots.get_mut(axis) {
            let was_online = slot.axis.drive().online;
            slot.axis.update_drive(fill);
            if slot.axis.drive().online && !was_online {
                slot.drive_values.renew();
            }
        }
    }

    /// Says how the drive of an axis starts and stops from now on.
    pub fn set_sequence(&mut self, axis: usize, settings: SequenceSettings) {
        if let Some(slot) = self.engine.instances.slots.get_mut(axis) {
            slot.axis.set_sequence(settings);
        }
    }

    /// Raises a fault of the communications node that only the owner of the device can see. Every axis stops, and it
    /// stays until the controller resets it. Under a fault that is there already it is a consequence of that one, as a command
    /// that is withheld for a node fault is, and changes nothing.
    pub fn raise_node_fault(&mut self, fault: NodeFault) {
        if !self.engine.node.is_faulted() {
            self.engine.node.raise(fault);
        }
    }

    /// Tells the state of the device's clock. A new offset moves the time stamps of events that were not told yet.
    pub fn set_sync(&mut self, sync: SyncState) {
        let step = self.engine.clock.set(sync);
        if step != 0 {
            self.engine.instances.slots.iter_mut().for_each(|slot| slot.axis.events.shift(step));
        }
    }

    /// Says how good the synchronization of the device's clock is.
    pub fn set_sync_quality(&mut self, quality: SyncQuality) {
        self.engine.clock.set_quality(quality);
    }

    /// Sync Threshold of the controller that is connected (class attribute 29), ns: the clock of the device has to go by it.
    #[must_use]
    pub fn sync_threshold(&self) -> Option<u64> {
        self.engine.connection.as_ref().and_then(|_| self.engine.instances.sync_threshold())
    }

    /// An event that the drive was armed for has occurred, or cannot be found for the reason `status`, which is then not
    /// 0. `position` is in the reference system of power-up, position control units, `time_stamp` is system time in ns.
    /// Returns whether it is on its way to the controller.
    pub fn notify_event(
        &mut self,
        axis: usize,
        event: EventType,
        status: u8,
        position: i64,
        time_stamp: u64,
    ) -> bool {
        self.engine
            .instances
            .slots
            .get_mut(axis)
            .is_some_and(|slot| slot.axis.notify_event(event, status, position, time_stamp))
    }

    /// What the event channel of an axis has counted since construction.
    #[must_use]
    pub fn event_counters(&self, axis: usize) -> Option<EventCounters> {
        self.engine.instances.slots.get(axis).map(|slot| slot.axis.events.counters())
    }

    /// Publishes the value of a stored attribute of an axis, for example a signal. Access and range do not count.
    ///
    /// # Errors
    /// There is no such axis or attribute, or the octets are not those of the whole value.
    pub fn put_attribute(&mut self, axis: usize, id: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        self.engine.instances.put(axis, id, value)
    }

    /// Publishes the signals of an axis that its cyclic read lists hold, before [`MotionDevice::poll_transmit`] of the same
    /// cycle. `value` writes the octets of an attribute and returns how many they are, or `None` while it has no value: a
    /// list with such an attribute is answered with "device state conflict" instead of old data.
    pub fn publish_signals(
        &mut self,
        axis: usize,
        value: &mut dyn FnMut(u16, &mut [u8; 8]) -> Option<usize>,
    ) {
        self.engine.instances.publish_signals(axis, value);
    }

    /// Sets which attributes of an axis that are not in the device the drive does not let be in cyclic read lists; up to 256.
    pub fn set_not_cyclically_read(&mut self, axis: usize, ids: impl Iterator<Item = u16>) {
        self.engine.instances.set_not_cyclic(axis, Direction::Read, ids);
    }

    /// The same for cyclic write lists.
    pub fn set_not_cyclically_written(&mut self, axis: usize, ids: impl Iterator<Item = u16>) {
        self.engine.instances.set_not_cyclic(axis, Direction::Write, ids);
    }

    /// How the controller sees the positions of an axis now.
    #[must_use]
    pub fn position_view(&self, axis: usize) -> Option<PositionView> {
        self.engine.instances.slots.get(axis).map(|slot| slot.axis.position_view())
    }

    /// The value of an attribute of an axis as it is stored in the device.
    ///
    /// # Errors
    /// There is no such axis or attribute.
    pub fn attribute(&self, axis: usize, id: u16) -> Result<&[u8], GeneralStatus> {
        self.engine.instances.get(axis, id)
    }

    /// What the controller wants done about the exceptions of an axis.
    #[must_use]
    pub fn exception_actions(&self, axis: usize) -> ExceptionActions<'_> {
        self.engine.instances.exception_actions(axis)
    }

    /// A number that is another one after an attribute of an axis has changed, or `None` if there is no such axis. What was made
    /// of [`MotionDevice::attribute`] may be kept as long as it is the same.
    #[must_use]
    pub fn attribute_changes(&self, axis: usize) -> Option<u64> {
        self.engine.instances.slots.get(axis).map(|slot| slot.store.changes())
    }

    /// The next access to an attribute that lives in the drive.
    pub fn poll_attribute_access(&mut self) -> Option<AttributeAccess> {
        self.engine.instances.take_access().or_else(|| self.explicit.take_access())
    }

    /// Answers an access: the octets of a Read, no octets for a Write, or why it failed.
    ///
    /// Answers to accesses that nobody waits for any more are ignored.
    pub fn complete_attribute(&mut self, ticket: u32, answer: Result<&[u8], GeneralStatus>) {
        match self.engine.instances.complete(ticket, answer) {
            Completed::List => {}
            Completed::Channel(instance) => service::run(&mut self.engine, instance),
            Completed::Nobody => self.explicit.complete(&mut self.engine, ticket, answer),
        }
    }

    // -- connection ---------------------------------------------------------------------------------------------

    /// Takes a request of the explicit side; its reply comes out of [`MotionDevice::poll_reply`].
    pub fn request(&mut self, now: MonotonicTime, system_time: Option<SystemTime>, request: MotionRequest) {
        match request {
            MotionRequest::Open(parameters) => {
                let outcome = self.engine.open(now, system_time, parameters);
                if outcome.is_ok() {
                    self.explicit.break_off_foreign(parameters.originator);
                }
                self.explicit.reply(MotionReply::Opened { token: parameters.token, outcome });
            }
            MotionRequest::Close(parameters) => {
                self.engine.close(system_time, &parameters);
                self.explicit.reply(MotionReply::Closed { token: parameters.token });
            }
            MotionRequest::Explicit(request) => {
                let queued = self.explicit.queue(request);
                self.engine.statistics.counters.explicit_overflow += u64::from(!queued);
            }
            MotionRequest::PrepareReset(token) => {
                let granted = !self.engine.is_in_use();
                self.explicit.reply(MotionReply::ResetPrepared { token, granted });
            }
        }
        self.explicit.run(&mut self.engine, now, system_time);
    }

    /// The next reply to the explicit side.
    pub fn poll_reply(&mut self) -> Option<MotionReply> {
        self.explicit.poll_reply()
    }

    // -- updates ------------------------------------------------------------------------------------------------

    /// Takes the data of a C-to-D packet: the class-1 sequence count and the update.
    ///
    /// `system_time` is `None` if the device has no synchronized time. The packet must be of this connection; whose it
    /// is stands in the datagram around it. Returns whether it was taken: its form was right, and it was not older than the
    /// last one.
    pub fn handle_io(&mut self, now: MonotonicTime, system_time: Option<SystemTime>, packet: &[u8]) -> bool {
        self.engine.handle_packet(now, now, system_time, packet)
    }

    /// The same for a packet that arrived at `arrival`, before it could be looked at. The controller's update clock is estimated from
    /// the arrivals (asynchronous operation); everything else goes by `now`.
    pub fn handle_io_arrived(
        &mut self,
        now: MonotonicTime,
        arrival: MonotonicTime,
        system_time: Option<SystemTime>,
        packet: &[u8],
    ) -> bool {
        self.engine.handle_packet(now, arrival, system_time, packet)
    }

    /// Takes a C-to-D update of a network that puts no sequence count in front of it, as DeviceNet does: the 16
    /// octets of the fixed format, or an update of the variable one. The Update ID alone tells what is new.
    pub fn handle_unsequenced(&mut self, now: MonotonicTime, system_time: Option<SystemTime>, update: &[u8]) {
        self.engine.handle_unsequenced(now, system_time, update);
    }

    /// Says when [`MotionDevice::poll_transmit`] is called next, behind the call that is to come: in synchronous operation an
    /// update goes with the last call that is not too late for it (Actual Update Window, clause 2-1.3). Without this it goes
    /// with the first call at [`MotionDevice::wake_at`] or behind.
    pub fn expect_poll(&mut self, next_call: MonotonicTime) {
        if let Some(connection) = &mut self.engine.connection {
            connection.schedule.expect(next_call);
        }
    }

    /// If a D-to-C update is due at `now`, writes its data (class-1 sequence count and update) and returns the octets.
    ///
    /// `out` should hold the T-to-O connection size; more of it is not used.
    pub fn poll_transmit(
        &mut self,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
        out: &mut [u8],
    ) -> Option<usize> {
        self.poll(now, system_time);
        self.engine.transmit(now, system_time, out)
    }

    /// As [`MotionDevice::poll_transmit`], for a network that puts no sequence count in front of an update: `out` gets the
    /// update alone.
    pub fn poll_unsequenced(
        &mut self,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
        out: &mut [u8],
    ) -> Option<usize> {
        self.poll(now, system_time);
        self.engine.transmit_unsequenced(now, system_time, out)
    }

    /// Lets time pass: time-outs, missed updates, alarms, state machines.
    pub fn poll(&mut self, now: MonotonicTime, system_time: Option<SystemTime>) {
        if let Some(lost) = self.engine.poll(now, system_time) {
            self.explicit.reply(lost);
        }
        self.explicit.run(&mut self.engine, now, system_time);
    }

    // -- what is shown ------------------------------------------------------------------------------------------

    /// The node as it shows.
    #[must_use]
    pub fn node_condition(&self) -> NodeCondition {
        let startup = indication::startup(&self.engine);
        NodeCondition { startup, fault: self.node_fault(), alarm: self.node_alarm() }
    }

    /// An axis as it shows, or `None` if there is no such axis.
    #[must_use]
    pub fn axis_condition(&self, axis: usize) -> Option<AxisCondition> {
        self.engine.instances.slots.get(axis).map(|slot| indication::condition(&slot.axis))
    }

    /// State of the device as the Identity object and the Module Status LED have it.
    #[must_use]
    pub fn module_state(&self) -> ModuleState {
        let axes = self.engine.instances.slots.iter().map(|slot| indication::condition(&slot.axis));
        visualization::module_state(axes.collect::<ArrayVec<_, AXES_MAX>>().iter())
    }

    /// The Axis Status LED of an axis; dark without such an axis.
    #[must_use]
    pub fn axis_indication(&self, axis: usize) -> Indication {
        self.axis_condition(axis).map_or(Indication::OFF, |axis| visualization::axis_status(&axis))
    }

    /// The line of the display for an axis; empty without such an axis.
    #[must_use]
    pub fn display_line(&self, axis: usize) -> Line {
        self.axis_condition(axis).map_or(Line::default(), |axis| display::line(&self.node_condition(), &axis))
    }

    /// Whether the motion connection was lost and nobody has opened it since.
    #[must_use]
    pub fn is_connection_lost(&self) -> bool {
        self.engine.progress.connection_lost
    }
}
