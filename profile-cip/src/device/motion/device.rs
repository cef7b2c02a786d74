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

pub use crate::device::axis::SequenceSettings;
pub use crate::device::motion_link::SyncState;
use arrayvec::ArrayVec;
use profile_generic::time::{MonotonicTime, SystemTime};

use super::cyclic_list::{CyclicLists, Direction};
use super::explicit_queue::ExplicitQueue;
use super::fixed::with_services_alone;
use super::indication::StartupProgress;
use super::io_connection::{IoConnection, Mode};
use super::io_counters::MotionCounters;
use super::node::NodeHealth;
use super::service_channel::ServiceChannel;
use super::time_offset::OffsetCompensation;
use crate::device::attribute::worker::{AttributeAccess, AttributeSpace};
use crate::device::attribute::{AttributeDefinition, AttributeStore, AttributeTable, Scope, TableError, id};
use crate::device::axis::drive_link::{AxisCommandImage, DriveImage, Trims};
use crate::device::axis::event_channel::EventCounters;
use crate::device::axis::exception::ExceptionActions;
use crate::device::axis::fault_log::{FaultLog, LogEntry};
use crate::device::axis::refused::RefusedRequest;
use crate::device::axis::reported::Reported;
use crate::device::axis::state::AxisState;
use crate::device::axis::{Axis, AxisConfig, Context, FaultWords, PositionView};
use crate::device::motion_link::{CloseParameters, MotionReply, MotionRequest, OpenParameters, OpenRefusal};
use crate::wire::Error;
use crate::wire::motion::codes::{
    ControlMode, EventChecking, EventType, FaultType, NodeAlarm, NodeControl, NodeFault,
};
use crate::wire::motion::event::ExtendedEventData;
use crate::wire::motion::{FORMAT_REVISION, Format, WriteBlock};
use crate::wire::status::GeneralStatus;

/// Most axes of a device: what the EtherNet/IP part of the standard allows.
pub const AXES_MAX: usize = 16;
/// Instances of an update: the class and the axes.
pub(in crate::device) const INSTANCES_MAX: usize = AXES_MAX + 1;
/// Replies that wait to be taken; requests are refused before this overflows.
const REPLIES_MAX: usize = 16;
/// Octets of the class-1 sequence count.
pub(in crate::device) const SEQUENCE_LEN: usize = 2;

/// Extended status of a refused Forward_Open: the connection has an owner.
const OWNERSHIP_CONFLICT: u16 = 0x0106;
/// Extended status of a refused Forward_Open: the interval is not acceptable.
const INTERVAL_NOT_ACCEPTABLE: u16 = 0x0111;
/// Extended status of a refused Forward_Open: the connection point is not one of ours.
const INVALID_CONNECTION_POINT: u16 = 0x012F;

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
    /// How far apart the calls of [`MotionDevice::poll_transmit`] are, ns. In synchronous operation an update goes with
    /// the call that is nearest to its time: with periods of the same length, half of the updates would otherwise miss
    /// theirs by a hair and come a whole call late. 0: no update goes before its time.
    pub poll_interval_ns: u64,
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

/// What the last C-to-D update asked to hear about one instance.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::device) struct Echo {
    pub number: u8,
    pub cyclic: bool,
    /// Write block ID, read block ID and status of the write data.
    pub lists: Option<(u8, u8, GeneralStatus)>,
}

/// An axis with its attributes and channels.
pub(in crate::device) struct Slot {
    pub axis: Axis,
    pub store: AttributeStore,
    pub service: ServiceChannel,
    pub write_lists: CyclicLists,
    pub read_lists: CyclicLists,
}

/// The class with its attributes and channel.
pub(in crate::device) struct Class {
    pub store: AttributeStore,
    pub service: ServiceChannel,
}

/// A CIP Motion device.
pub struct MotionDevice {
    pub(in crate::device) config: DeviceConfig,
    pub(in crate::device) class_table: AttributeTable,
    pub(in crate::device) axis_table: AttributeTable,
    pub(in crate::device) class: Class,
    pub(in crate::device) slots: Vec<Slot>,
    pub(in crate::device) connection: Option<IoConnection>,
    pub(in crate::device) node: NodeHealth,
    pub(in crate::device) compensation: OffsetCompensation,
    pub(in crate::device) sync: SyncState,
    pub(in crate::device) progress: StartupProgress,
    pub(in crate::device) counters: MotionCounters,
    pub(in crate::device) last_error: Option<Error>,
    /// Lost and late updates of this connection, modulo 256.
    pub(in crate::device) diagnostics: (u8, u8),
    pub(in crate::device) reported_diagnostics: Reported<(u8, u8)>,
    pub(in crate::device) reported_offset: Reported<i64>,
    pub(in crate::device) echo: ArrayVec<Echo, INSTANCES_MAX>,
    pub(in crate::device) explicit: ExplicitQueue,
    pub(in crate::device) replies: ArrayVec<MotionReply, REPLIES_MAX>,
    pub(in crate::device) tickets: u32,
    pub(in crate::device) idle_header: Option<[u8; 8]>,
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
        let class_table = AttributeTable::new(Scope::Class, &config.attributes)?;
        let axis_table = AttributeTable::new(Scope::Instance, &config.attributes)?;
        let class = Class { store: AttributeStore::new(&class_table), service: ServiceChannel::default() };
        let slots = config
            .axes
            .iter()
            .map(|axis| Slot {
                axis: Axis::new(*axis),
                store: AttributeStore::new(&axis_table),
                service: ServiceChannel::default(),
                write_lists: CyclicLists::default(),
                read_lists: CyclicLists::default(),
            })
            .collect();
        Ok(Self {
            config,
            class_table,
            axis_table,
            class,
            slots,
            connection: None,
            node: NodeHealth::default(),
            compensation: OffsetCompensation::default(),
            sync: SyncState::default(),
            progress: StartupProgress::default(),
            counters: MotionCounters::default(),
            last_error: None,
            diagnostics: (0, 0),
            reported_diagnostics: Reported::known((0, 0)),
            reported_offset: Reported::new(),
            echo: ArrayVec::new(),
            explicit: ExplicitQueue::default(),
            replies: ArrayVec::new(),
            tickets: 0,
            idle_header: None,
        })
    }

    // -- getters ------------------------------------------------------------------------------------------------

    /// Number of axes; `axis` arguments count from 0, instance numbers from 1.
    #[must_use]
    pub fn axis_count(&self) -> usize {
        self.slots.len()
    }

    /// State of an axis, or `None` if there is no such axis.
    #[must_use]
    pub fn axis_state(&self, axis: usize) -> Option<AxisState> {
        self.slots.get(axis).map(|slot| slot.axis.state())
    }

    /// Exceptions, faults and alarms of an axis.
    #[must_use]
    pub fn fault_words(&self, axis: usize) -> Option<&FaultWords> {
        self.slots.get(axis).map(|slot| slot.axis.fault_words())
    }

    /// Control Mode of the last update of an axis, or `None` if there is no such axis.
    #[must_use]
    pub fn control_mode(&self, axis: usize) -> Option<ControlMode> {
        self.slots.get(axis).map(|slot| ControlMode(slot.axis.block().control_mode.0 & 0x0F))
    }

    /// Axis Faults (attribute 657) of an axis.
    #[must_use]
    pub fn axis_faults(&self, axis: usize) -> Option<u64> {
        self.fault_words(axis).map(|words| words.fault(FaultType::AXIS))
    }

    /// The log of faults and alarms of an axis.
    #[must_use]
    pub fn fault_log(&self, axis: usize) -> Option<&FaultLog> {
        self.slots.get(axis).map(|slot| slot.axis.log())
    }

    /// The next entry that came into the log of an axis or ended there.
    pub fn poll_fault_log(&mut self, axis: usize) -> Option<LogEntry> {
        self.slots.get_mut(axis).and_then(|slot| slot.axis.faults.log.poll())
    }

    /// The next request of an axis that was refused.
    pub fn poll_refused(&mut self, axis: usize) -> Option<RefusedRequest> {
        self.slots.get_mut(axis)?.axis.refused.pop_at(0)
    }

    /// Fault and alarm records of an axis that were lost because the controller did not take them.
    #[must_use]
    pub fn dropped_records(&self, axis: usize) -> Option<u32> {
        self.slots.get(axis).map(|slot| slot.axis.dropped_records())
    }

    /// Active node fault.
    #[must_use]
    pub fn node_fault(&self) -> NodeFault {
        self.node.fault()
    }

    /// Active node alarm.
    #[must_use]
    pub fn node_alarm(&self) -> NodeAlarm {
        self.node.alarm()
    }

    /// What the connection has seen.
    #[must_use]
    pub fn counters(&self) -> &MotionCounters {
        &self.counters
    }

    /// Why the last malformed update was refused.
    #[must_use]
    pub fn last_error(&self) -> Option<Error> {
        self.last_error
    }

    /// The open connection.
    #[must_use]
    pub fn connection(&self) -> Option<&OpenParameters> {
        self.connection.as_ref().map(|c| &c.parameters)
    }

    /// Whether the device produces its updates synchronously.
    #[must_use]
    pub fn is_synchronous(&self) -> bool {
        self.connection.as_ref().is_some_and(|c| c.mode == Mode::Synchronous)
    }

    /// The attributes of a scope in the order of their IDs.
    pub fn attributes(&self, scope: Scope) -> impl Iterator<Item = &AttributeDefinition> {
        let table = match scope {
            Scope::Class => &self.class_table,
            Scope::Instance => &self.axis_table,
        };
        table.iter()
    }

    /// When to call [`MotionDevice::poll`] or [`MotionDevice::poll_transmit`] again at the latest; `None` while
    /// nothing is connected.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.connection.as_ref().map(IoConnection::wake_at)
    }

    /// Events that are to be looked for on an axis now, with the parameters of extended checking. Watch positions and
    /// torque are evaluated here; the rest is the drive's part, which says in [`DriveImage::events_checking`] what it is
    /// looking for.
    #[must_use]
    pub fn armed_events(&self, axis: usize) -> Option<(EventChecking, &ExtendedEventData)> {
        self.slots.get(axis).map(|slot| (slot.axis.events.armed(), slot.axis.events.parameters()))
    }

    pub(in crate::device) fn high_limit(&self) -> u64 {
        self.class.store.unsigned(&self.class_table, id::UPDATE_DELAY_HIGH_LIMIT).unwrap_or(0)
    }

    pub(in crate::device) fn low_limit(&self) -> u64 {
        self.class.store.unsigned(&self.class_table, id::UPDATE_DELAY_LOW_LIMIT).unwrap_or(0)
    }

    pub(in crate::device) fn step_threshold(&self) -> i64 {
        let threshold = self.class.store.unsigned(&self.class_table, id::STEP_THRESHOLD).unwrap_or(0);
        i64::try_from(threshold).unwrap_or(i64::MAX)
    }

    pub(in crate::device) fn context(&self, system_time: Option<SystemTime>) -> Context {
        let control = self.connection.as_ref().map_or(NodeControl::empty(), IoConnection::node_control);
        Context {
            connected: self.connection.is_some(),
            remote: control.contains(NodeControl::REMOTE_CONTROL),
            node_fault: self.node.is_faulted(),
            system_time: system_time.map_or(0, |t| t.0),
        }
    }

    /// What the drive of an axis has to do at `now`; `None` if there is no such axis.
    #[must_use]
    pub fn command(&self, axis: usize, now: MonotonicTime) -> Option<AxisCommandImage> {
        let slot = self.slots.get(axis)?;
        let period = self.connection.as_ref().map_or(0, IoConnection::period);
        let limit = u32::try_from(self.high_limit()).unwrap_or(u32::MAX);
        Some(slot.axis.command(now, &self.context(None), period, limit))
    }

    // -- drive side ---------------------------------------------------------------------------------------------

    /// Takes what the drive of an axis reports; to be followed by [`MotionDevice::poll`] in the same cycle.
    pub fn set_drive(&mut self, axis: usize, image: DriveImage) {
        self.update_drive(axis, |drive| *drive = image);
    }

    /// What the drive of an axis reported last, or `None` if there is no such axis.
    #[must_use]
    pub fn drive(&self, axis: usize) -> Option<&DriveImage> {
        self.slots.get(axis).map(|slot| slot.axis.drive())
    }

    /// As [`MotionDevice::set_drive`], without a copy: `fill` gets what the drive reported before and has to write all of
    /// it anew ([`DriveImage::clear`] is where to begin). It is not called without such an axis.
    pub fn update_drive(&mut self, axis: usize, fill: impl FnOnce(&mut DriveImage)) {
        if let Some(slot) = self.slots.get_mut(axis) {
            slot.axis.update_drive(fill);
        }
    }

    /// Says how the drive of an axis starts and stops from now on.
    pub fn set_sequence(&mut self, axis: usize, settings: SequenceSettings) {
        if let Some(slot) = self.slots.get_mut(axis) {
            slot.axis.set_sequence(settings);
        }
    }

    /// Raises a fault of the communications node that only the owner of the device can see. Every axis stops, and it
    /// stays until the controller resets it. Under a fault that is there already it is a consequence of that one, as a command
    /// that is withheld for a node fault is, and changes nothing.
    pub fn raise_node_fault(&mut self, fault: NodeFault) {
        if !self.node.is_faulted() {
            self.node.raise(fault);
        }
    }

    /// Tells the state of the device's clock. A new offset moves the time stamps of events that were not told yet.
    pub fn set_sync(&mut self, sync: SyncState) {
        let step = sync.offset.saturating_sub(self.sync.offset);
        if step != 0 {
            self.slots.iter_mut().for_each(|slot| slot.axis.events.shift(step));
        }
        self.sync = sync;
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
        self.slots
            .get_mut(axis)
            .is_some_and(|slot| slot.axis.notify_event(event, status, position, time_stamp))
    }

    /// What the event channel of an axis has counted since construction.
    #[must_use]
    pub fn event_counters(&self, axis: usize) -> Option<EventCounters> {
        self.slots.get(axis).map(|slot| slot.axis.events.counters())
    }

    /// Publishes the value of a stored attribute of an axis, for example a signal. Access and range do not count.
    ///
    /// # Errors
    /// There is no such axis or attribute, or the octets are not those of the whole value.
    pub fn put_attribute(&mut self, axis: usize, id: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        let slot = self.slots.get_mut(axis).ok_or(GeneralStatus::OBJECT_DOES_NOT_EXIST)?;
        let entry = self.axis_table.find(id).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        slot.store.put(entry, entry.whole(), value)
    }

    /// Publishes the signals of an axis that its cyclic read lists hold, before [`MotionDevice::poll_transmit`] of the same
    /// cycle. `value` writes the octets of an attribute and returns how many they are, or `None` while it has no value: a
    /// list with such an attribute is answered with "device state conflict" instead of old data.
    pub fn publish_signals(
        &mut self,
        axis: usize,
        value: &mut dyn FnMut(u16, &mut [u8; 8]) -> Option<usize>,
    ) {
        if let Some(slot) = self.slots.get_mut(axis) {
            slot.read_lists.publish(&self.axis_table, &mut slot.store, value);
        }
    }

    /// How the controller sees the positions of an axis now.
    #[must_use]
    pub fn position_view(&self, axis: usize) -> Option<PositionView> {
        self.slots.get(axis).map(|slot| slot.axis.position_view())
    }

    /// The value of an attribute of an axis as it is stored in the device.
    ///
    /// # Errors
    /// There is no such axis or attribute.
    pub fn attribute(&self, axis: usize, id: u16) -> Result<&[u8], GeneralStatus> {
        let slot = self.slots.get(axis).ok_or(GeneralStatus::OBJECT_DOES_NOT_EXIST)?;
        let entry = self.axis_table.find(id).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
        slot.store.get(entry, entry.whole())
    }

    /// A number that is another one after an attribute of an axis has changed, or `None` if there is no such axis. What was made
    /// of [`MotionDevice::attribute`] may be kept as long as it is the same.
    #[must_use]
    pub fn attribute_changes(&self, axis: usize) -> Option<u64> {
        self.slots.get(axis).map(|slot| slot.store.changes())
    }

    /// The next access to an attribute that lives in the drive.
    pub fn poll_attribute_access(&mut self) -> Option<AttributeAccess> {
        let channels = self.slots.iter_mut().map(|slot| &mut slot.service.worker);
        let mut workers = channels.chain([&mut self.class.service.worker, &mut self.explicit.worker]);
        workers.find_map(crate::device::attribute::worker::AttributeWorker::take_access)
    }

    /// Answers an access: the octets of a Read, no octets for a Write, or why it failed.
    ///
    /// Answers to accesses that nobody waits for any more are ignored.
    pub fn complete_attribute(&mut self, ticket: u32, answer: Result<&[u8], GeneralStatus>) {
        for number in 0..self.slots.len() {
            let slot = &mut self.slots[number];
            let mut space = AttributeSpace {
                table: &self.axis_table,
                store: &mut slot.store,
                instance: u8::try_from(number + 1).unwrap_or(u8::MAX),
                running: slot.axis.is_running(),
                tickets: &mut self.tickets,
            };
            if slot.service.worker.complete(ticket, answer, &mut space) {
                self.run_service(number + 1);
                return;
            }
        }
        self.complete_explicit(ticket, answer);
    }

    // -- connection ---------------------------------------------------------------------------------------------

    /// Takes a request of the explicit side; its reply comes out of [`MotionDevice::poll_reply`].
    pub fn request(&mut self, now: MonotonicTime, system_time: Option<SystemTime>, request: MotionRequest) {
        match request {
            MotionRequest::Open(parameters) => {
                let outcome = self.open(now, system_time, parameters);
                self.reply(MotionReply::Opened { token: parameters.token, outcome });
            }
            MotionRequest::Close(parameters) => {
                self.close(system_time, &parameters);
                self.reply(MotionReply::Closed { token: parameters.token });
            }
            MotionRequest::Explicit(request) => self.queue_explicit(request),
            MotionRequest::PrepareReset(token) => {
                self.reply(MotionReply::ResetPrepared { token, granted: !self.is_in_use() });
            }
        }
        self.run_explicit(now, system_time);
    }

    /// The next reply to the explicit side.
    pub fn poll_reply(&mut self) -> Option<MotionReply> {
        (!self.replies.is_empty()).then(|| self.replies.remove(0))
    }

    pub(in crate::device) fn reply(&mut self, reply: MotionReply) {
        // Open, Close and loss alternate and explicit requests are limited, so there is room unless nobody takes the
        // replies; the oldest then has nobody waiting for it.
        if self.replies.is_full() {
            self.replies.remove(0);
        }
        self.replies.push(reply);
    }

    fn open(
        &mut self,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
        parameters: OpenParameters,
    ) -> Result<(), OpenRefusal> {
        let refuse = |extended_status| {
            Err(OpenRefusal { general_status: GeneralStatus::CONNECTION_FAILURE.0, extended_status })
        };
        if self.connection.is_some() {
            return refuse(OWNERSHIP_CONFLICT);
        }
        if parameters.format_revision != FORMAT_REVISION {
            return refuse(INVALID_CONNECTION_POINT);
        }
        self.check_format(&parameters)?;
        if parameters.rpi_us == 0 || parameters.timeout_us == 0 {
            return refuse(INTERVAL_NOT_ACCEPTABLE);
        }
        self.connection = Some(IoConnection::new(parameters, self.config.poll_interval_ns, now));
        self.break_off_foreign();
        self.start_over();
        let system_time = system_time.map_or(0, |t| t.0);
        self.slots.iter_mut().for_each(|slot| slot.axis.open(system_time));
        Ok(())
    }

    fn close(&mut self, system_time: Option<SystemTime>, parameters: &CloseParameters) {
        let same = self.connection.as_ref().is_some_and(|c| {
            c.parameters.triad == parameters.triad && c.parameters.o_to_t_id == parameters.o_to_t_id
        });
        if same {
            self.connection = None;
            self.start_over();
            let system_time = system_time.map_or(0, |t| t.0);
            self.slots.iter_mut().for_each(|slot| slot.axis.close(system_time));
        }
    }

    /// Factory defaults and idle channels: a connection begins or ends.
    fn start_over(&mut self) {
        self.node.clear();
        self.progress = StartupProgress::default();
        self.compensation.reset();
        self.diagnostics = (0, 0);
        self.reported_diagnostics = Reported::known((0, 0));
        self.reported_offset = Reported::new();
        self.echo.clear();
        self.idle_header = None;
        self.class.store.reset(&self.class_table);
        self.class.service.reset();
        for slot in &mut self.slots {
            slot.store.reset(&self.axis_table);
            slot.service.reset();
            slot.write_lists = CyclicLists::default();
            slot.read_lists = CyclicLists::default();
        }
    }

    fn lose(&mut self, now: MonotonicTime) {
        let Some(connection) = self.connection.take() else { return };
        self.counters.connection_losses += 1;
        self.node.raise(NodeFault::CONNECTION_LOSS);
        self.progress = StartupProgress { connection_lost: true, ..StartupProgress::default() };
        self.echo.clear();
        self.class.service.reset();
        for slot in &mut self.slots {
            slot.axis.lose();
            slot.service.reset();
        }
        self.reply(MotionReply::ConnectionLost {
            o_to_t_id: connection.parameters.o_to_t_id,
            silent_us: connection.silence(now) / 1000,
        });
    }

    // -- time ---------------------------------------------------------------------------------------------------

    /// Lets time pass: time-outs, missed updates, alarms, state machines.
    pub fn poll(&mut self, now: MonotonicTime, system_time: Option<SystemTime>) {
        self.node.tick(now);
        if self.connection.as_ref().is_some_and(|c| c.is_timed_out(now)) {
            self.lose(now);
        }
        if let Some(connection) = &self.connection {
            let missed = connection.missed(now);
            let synchronous = connection.mode == Mode::Synchronous;
            if missed > self.high_limit() {
                self.node.raise(NodeFault::CONNECTION_UPDATE);
            } else if missed > self.low_limit() {
                self.node.post(NodeAlarm::CONNECTION_UPDATE, now);
            }
            if synchronous {
                self.node.synchronization(self.sync.synchronized, now);
            }
        }
        self.step(system_time);
        self.run_explicit(now, system_time);
    }

    pub(in crate::device) fn step(&mut self, system_time: Option<SystemTime>) {
        let context = self.context(system_time);
        for slot in &mut self.slots {
            // They are looked up only where there is something that they say anything about.
            let nothing = slot.axis.drive().conditions.as_slice().is_empty() && !slot.axis.has_found();
            let actions = match nothing {
                true => ExceptionActions::NONE,
                false => ExceptionActions::of(&self.axis_table, &slot.store),
            };
            slot.axis.step(&context, &actions);
        }
    }
}

impl Slot {
    /// Applies cyclic write data and says what to tell about it. What they add to the set-points goes into `trims`.
    pub(in crate::device) fn cyclic_write(
        &mut self,
        table: &AttributeTable,
        block: &WriteBlock<'_>,
        refused: bool,
        trims: &mut Trims,
    ) -> (u8, u8, GeneralStatus) {
        let written = if refused {
            Err(GeneralStatus::OBJECT_STATE_CONFLICT)
        } else {
            let running = self.axis.is_running();
            self.write_lists.write(table, &mut self.store, block.write_block_id, block.data, running)
        };
        let status = match written {
            Ok(written) => {
                *trims = written;
                GeneralStatus::SUCCESS
            }
            Err(status) => status,
        };
        (block.write_block_id, block.read_block_id, status)
    }

    /// Carries out a Set_Cyclic_Write_List or Set_Cyclic_Read_List.
    pub(in crate::device) fn configure_list(
        &mut self,
        table: &AttributeTable,
        direction: Direction,
        body: &[u8],
        response: &mut [u8],
    ) -> (GeneralStatus, usize) {
        match direction {
            Direction::Write => self.write_lists.configure(table, direction, body, response),
            Direction::Read => self.read_lists.configure(table, direction, body, response),
        }
    }
}
