//! The services of the Motion Device Axis Object, clauses 5-2.4 and 5-2.5, for both ways they come: the service
//! channel of the I/O connection and explicit messages.
//!
//! Supported: Group_Sync (class), Get and Set_Axis_Attributes_List, Set_Cyclic_Write_List, Set_Cyclic_Read_List,
//! Run_Hookup_Test and Get_Hookup_Test_Data (axes), and explicitly also Get and Set_Attribute_List and Get and
//! Set_Attribute_Single. Motor and inertia tests answer "service not supported": they measure what only the drive can,
//! and nothing that runs a drive here has a procedure for them.
//!
//! While a connection is open, what does more than read is taken by explicit message only from its owner
//! ([`super::owner`]), and a test only while the owner's updates are fresh.

use profile_generic::time::{MonotonicTime, SystemTime};

use super::cyclic_list::Direction;
use super::device::MotionDevice;
use super::explicit_queue::Current;
use super::io_connection::IoConnection;
use super::owner::common;
use super::time_offset::Offsets;
use crate::device::attribute::id;
use crate::device::attribute::list_job::{BODY_MAX, ListFormat};
use crate::device::attribute::worker::AttributeSpace;
use crate::device::motion_link::{EXPLICIT_DATA_MAX, ExplicitReply, ExplicitRequest, MotionReply};
use crate::wire::Writer;
use crate::wire::motion::codes::{AlarmType, FaultType, MotionService, SyncStatus};
use crate::wire::motion::id_list::parse_group_sync;
use crate::wire::motion::test_service::{RUN_HOOKUP_TEST_LEN, RunHookupTest};
use crate::wire::motion::{CommandPosition, Format, ServiceRequest};
use crate::wire::status::GeneralStatus;

/// Class code of the Motion Device Axis Object.
pub const MOTION_AXIS_CLASS: u16 = 0x42;

/// Reads a request body that has one length and no other.
fn exact<T>(
    body: &[u8],
    len: usize,
    parse: impl FnOnce(&[u8]) -> Result<T, crate::wire::Error>,
) -> Result<T, GeneralStatus> {
    if body.len() > len {
        return Err(GeneralStatus::TOO_MUCH_DATA);
    }
    parse(body).map_err(|_| GeneralStatus::NOT_ENOUGH_DATA)
}

/// What a service turned out to be.
enum Started {
    /// Answered at once.
    Answered(GeneralStatus, usize),
    /// An attribute service.
    List(ListFormat),
}

impl MotionDevice {
    /// Executes what both ways have in common; writes an immediate answer to `response`.
    fn start_service(
        &mut self,
        instance: usize,
        service: MotionService,
        body: &[u8],
        system_time: Option<SystemTime>,
        response: &mut [u8],
    ) -> Started {
        let unsupported = Started::Answered(GeneralStatus::SERVICE_NOT_SUPPORTED, 0);
        match (service, instance.checked_sub(1)) {
            (MotionService::GET_AXIS_ATTRIBUTES_LIST, _) => Started::List(ListFormat::AxisGet),
            (MotionService::SET_AXIS_ATTRIBUTES_LIST, _) => {
                self.progress.attribute_set = true;
                Started::List(ListFormat::AxisSet)
            }
            (MotionService::GROUP_SYNC, None) if self.config.supports_sync => {
                let (status, sync) = self.group_sync(body, system_time);
                match (status, response.first_mut()) {
                    (GeneralStatus::SUCCESS, Some(place)) => {
                        *place = sync.0;
                        Started::Answered(status, 1)
                    }
                    _ => Started::Answered(status, 0),
                }
            }
            (MotionService::SET_CYCLIC_WRITE_LIST | MotionService::SET_CYCLIC_READ_LIST, Some(axis)) => {
                let write = service == MotionService::SET_CYCLIC_WRITE_LIST;
                let direction = if write { Direction::Write } else { Direction::Read };
                let Some(slot) = self.slots.get_mut(axis) else { return unsupported };
                let (status, len) = slot.configure_list(&self.axis_table, direction, body, response);
                Started::Answered(status, len)
            }
            (MotionService::RUN_HOOKUP_TEST, Some(axis)) => {
                let context = self.context(system_time);
                let Some(slot) = self.slots.get_mut(axis) else { return unsupported };
                let request = exact(body, RUN_HOOKUP_TEST_LEN, RunHookupTest::parse);
                let status = match request {
                    Ok(request) => slot.axis.begin_hookup_test(&request, &context),
                    Err(status) => status,
                };
                Started::Answered(status, 0)
            }
            (MotionService::GET_HOOKUP_TEST_DATA, Some(axis)) => {
                let Some(slot) = self.slots.get(axis) else { return unsupported };
                if slot.axis.config.hookup_tests == 0 {
                    return unsupported;
                }
                if !body.is_empty() {
                    return Started::Answered(GeneralStatus::TOO_MUCH_DATA, 0);
                }
                // Zeros would say that a test has succeeded.
                let Some(data) = slot.axis.hookup_test_data() else {
                    return Started::Answered(GeneralStatus::OBJECT_STATE_CONFLICT, 0);
                };
                let mut writer = Writer::new(response);
                match data.emit(&mut writer) {
                    Ok(()) => Started::Answered(GeneralStatus::SUCCESS, writer.written()),
                    Err(_) => Started::Answered(GeneralStatus::REPLY_DATA_TOO_LARGE, 0),
                }
            }
            _ => unsupported,
        }
    }

    /// Group_Sync, clause 5-2.4.1.1: same grand master, synchronized, no skew.
    ///
    /// The skew can only be judged by a time stamp of the controller. The example of clause 7-1.3 sends none before it;
    /// then Synchronous Control, which needs one, makes the judgement.
    fn group_sync(&mut self, body: &[u8], system_time: Option<SystemTime>) -> (GeneralStatus, SyncStatus) {
        let grandmaster = match parse_group_sync(body) {
            Ok(id) => id,
            Err(crate::wire::Error::Trailing { .. }) => {
                return (GeneralStatus::TOO_MUCH_DATA, SyncStatus::NOT_SYNCHRONIZED);
            }
            Err(_) => return (GeneralStatus::NOT_ENOUGH_DATA, SyncStatus::NOT_SYNCHRONIZED),
        };
        let status = match (self.sync.grandmaster, system_time) {
            (Some(ours), _) if ours != grandmaster => SyncStatus::DIFFERENT_GRANDMASTER,
            (Some(_), Some(SystemTime(system_time))) if self.sync.synchronized => {
                self.clock_skew(system_time)
            }
            _ => SyncStatus::NOT_SYNCHRONIZED,
        };
        if status == SyncStatus::SYNCHRONIZED {
            let controller =
                self.class.store.unsigned(&self.class_table, id::CONTROLLER_TIME_OFFSET).unwrap_or(0);
            let offsets = Offsets { device: self.sync.offset, controller: controller.cast_signed() };
            self.compensation.synchronize(offsets);
            self.progress.group_synced = true;
        }
        (GeneralStatus::SUCCESS, status)
    }

    fn clock_skew(&self, system_time: u64) -> SyncStatus {
        let Some(connection) = &self.connection else { return SyncStatus::NOT_SYNCHRONIZED };
        let period = connection.period();
        let skewed = connection.header.and_then(|h| h.time_stamp).is_some_and(|received| {
            let time_stamp = self.compensation.compensate(received);
            time_stamp.saturating_add(period).abs_diff(system_time) > period
        });
        if skewed { SyncStatus::CLOCK_SKEW } else { SyncStatus::SYNCHRONIZED }
    }

    // -- service channel ----------------------------------------------------------------------------------------

    /// Executes a new request of the service channel.
    pub(in crate::device) fn execute_service(
        &mut self,
        instance: usize,
        request: &ServiceRequest<'_>,
        system_time: Option<SystemTime>,
    ) {
        let mut response = [0; BODY_MAX];
        let started = self.start_service(instance, request.service, request.data, system_time, &mut response);
        let Some(channel) = self.channel(instance) else { return };
        match started {
            Started::Answered(status, len) => channel.answer(status, &response[..len]),
            Started::List(format) => match channel.worker.start(format, request.data, BODY_MAX) {
                Ok(()) => self.run_service(instance),
                Err(status) => channel.answer(status, &[]),
            },
        }
    }

    fn channel(&mut self, instance: usize) -> Option<&mut super::service_channel::ServiceChannel> {
        match instance.checked_sub(1) {
            None => Some(&mut self.class.service),
            Some(axis) => self.slots.get_mut(axis).map(|slot| &mut slot.service),
        }
    }

    /// Carries the attribute service of an instance on as far as it goes.
    pub(in crate::device) fn run_service(&mut self, instance: usize) {
        self.publish(instance);
        let tickets = &mut self.tickets;
        let (channel, mut space) = match instance.checked_sub(1) {
            None => {
                let store = &mut self.class.store;
                let space =
                    AttributeSpace { table: &self.class_table, store, instance: 0, running: false, tickets };
                (&mut self.class.service, space)
            }
            Some(axis) => {
                let Some(slot) = self.slots.get_mut(axis) else { return };
                let running = slot.axis.is_running();
                let number = u8::try_from(instance).unwrap_or(u8::MAX);
                let store = &mut slot.store;
                let table = &self.axis_table;
                (&mut slot.service, AttributeSpace { table, store, instance: number, running, tickets })
            }
        };
        if !channel.is_busy() {
            return;
        }
        let mut worker = core::mem::take(&mut channel.worker);
        match worker.run(&mut space) {
            Some((status, body)) => channel.answer(status, body),
            None => channel.worker = worker,
        }
        self.adopt(instance);
    }

    /// Takes over attributes that a service may have set and that the engine counts with.
    fn adopt(&mut self, instance: usize) {
        if instance == 0 {
            let counter = |id| {
                let value = self.class.store.unsigned(&self.class_table, id).unwrap_or(0);
                u8::try_from(value).unwrap_or(u8::MAX)
            };
            self.diagnostics = (counter(id::LOST_UPDATES), counter(id::LATE_UPDATES));
        } else if self.config.format == Format::Fixed {
            self.adopt_fixed();
        }
    }

    /// Puts the engine's own values into the attributes of an instance, so that a service reads them.
    pub(in crate::device) fn publish(&mut self, instance: usize) {
        let context = self.context(None);
        match instance.checked_sub(1) {
            None => {
                let header = self.connection.as_ref().and_then(|c| c.header);
                let period = self.connection.as_ref().map_or(0, IoConnection::period);
                let control = header.map_or(0, |h| u64::from(h.node_control.bits()));
                let values = [
                    (id::NODE_CONTROL, control),
                    (id::NODE_STATUS, u64::from(self.node_status().bits())),
                    (id::NODE_FAULT_CODE, u64::from(self.node.fault().0)),
                    (id::NODE_ALARM_CODE, u64::from(self.node.alarm().0)),
                    (id::CONTROLLER_UPDATE_PERIOD, period),
                    (id::CONTROLLER_TIME_STAMP, header.and_then(|h| h.time_stamp).unwrap_or(0)),
                    (id::TIME_DATA_SET, header.map_or(0, |h| u64::from(h.time_data_set().bits()))),
                    (id::LOST_UPDATES, u64::from(self.diagnostics.0)),
                    (id::LATE_UPDATES, u64::from(self.diagnostics.1)),
                    (id::POWER_STRUCTURE_CLASS_ID, u64::from(self.config.power_structure_class_id)),
                ];
                for (id, value) in values {
                    self.class.store.publish(&self.class_table, id, value);
                }
            }
            Some(axis) => {
                let fixed = self.config.format == Format::Fixed;
                let Some(slot) = self.slots.get_mut(axis) else { return };
                let (block, drive) = (slot.axis.block(), slot.axis.drive());
                let words = slot.axis.fault_words();
                let fault = slot.axis.faults.newest_fault();
                let alarm = slot.axis.faults.newest_alarm();
                let safety = drive.safety.unwrap_or_default();
                let real = |value: Option<f32>| u64::from(value.unwrap_or(0.0).to_bits());
                // A position in the form in which it came; the other form shows nothing.
                let (integer, counts, float) = match block.values.position {
                    Some(CommandPosition::Integer(counts)) => (true, i64::from(counts).cast_unsigned(), 0),
                    Some(CommandPosition::Float(counts)) => (false, 0, counts.to_bits()),
                    None => (false, 0, 0),
                };
                let values = [
                    (id::CONTROL_MODE, u64::from(block.control_mode.0)),
                    (id::FEEDBACK_MODE, u64::from(block.feedback_mode.0)),
                    (id::CONTROL_STATUS, u64::from(block.control_status.bits())),
                    (id::ACTUAL_DATA_SET, u64::from(block.actual_data_set.bits())),
                    (id::COMMAND_DATA_SET, u64::from(block.values.data_set().bits())),
                    (id::COMMAND_CONTROL, u64::from(block.target.0) | (u64::from(fixed || integer) << 2)),
                    (id::COMMAND_TARGET_TIME, slot.axis.target_time()),
                    (id::STATUS_DATA_SET, u64::from(block.status_data_set.bits())),
                    (id::POSITION_COMMAND_INTEGER, counts),
                    (id::POSITION_COMMAND_FLOAT, float),
                    (id::VELOCITY_COMMAND, real(block.values.velocity)),
                    (id::ACCELERATION_COMMAND, real(block.values.acceleration)),
                    (id::TORQUE_COMMAND, real(block.values.torque)),
                    (id::AXIS_STATE, u64::from(slot.axis.state().code().0)),
                    (id::AXIS_STATUS, u64::from(slot.axis.status(&context).bits())),
                    (id::AXIS_STATUS_MFG, u64::from(drive.axis_status_mfg)),
                    (id::AXIS_IO_STATUS, u64::from(drive.io_status.bits())),
                    (id::AXIS_IO_STATUS_MFG, u64::from(drive.io_status_mfg)),
                    (id::AXIS_EXCEPTIONS, words.exceptions[0]),
                    (id::AXIS_EXCEPTIONS_MFG, words.exceptions[1]),
                    (id::AXIS_FAULTS, words.fault(FaultType::AXIS)),
                    (id::AXIS_FAULTS_MFG, words.fault(FaultType::AXIS_MFG)),
                    (id::AXIS_ALARMS, words.alarm(AlarmType::AXIS)),
                    (id::AXIS_ALARMS_MFG, words.alarm(AlarmType::AXIS_MFG)),
                    (id::AXIS_FAULT_CODE, u64::from(fault.code)),
                    (id::AXIS_FAULT_TYPE, u64::from(fault.fault_type.0)),
                    (id::AXIS_FAULT_TIME_STAMP, fault.time_stamp),
                    (id::AXIS_ALARM_CODE, u64::from(alarm.code)),
                    (id::AXIS_ALARM_TYPE, u64::from(alarm.alarm_type.0)),
                    (id::AXIS_FAULT_SUB_CODE, u64::from(fault.sub_code)),
                    (id::AXIS_ALARM_SUB_CODE, u64::from(alarm.sub_code)),
                    (id::AXIS_FAULT_ACTION, u64::from(fault.action)),
                    (id::AXIS_ALARM_STATE, u64::from(alarm.state)),
                    (id::AXIS_ALARM_TIME_STAMP, alarm.time_stamp),
                    (id::INITIALIZATION_FAULTS, words.fault(FaultType::INITIALIZATION)),
                    (id::INITIALIZATION_FAULTS_MFG, words.fault(FaultType::INITIALIZATION_MFG)),
                    (id::APR_FAULTS, words.fault(FaultType::APR)),
                    (id::APR_FAULTS_MFG, words.fault(FaultType::APR_MFG)),
                    (id::AXIS_SAFETY_STATE, u64::from(safety.state)),
                    (id::AXIS_SAFETY_STATUS, u64::from(safety.status)),
                    (id::AXIS_SAFETY_STATUS_MFG, u64::from(safety.manufacturer)),
                    (id::AXIS_SAFETY_FAULTS, words.fault(FaultType::SAFETY)),
                    (id::AXIS_SAFETY_FAULTS_MFG, words.fault(FaultType::SAFETY_MFG)),
                    (id::START_INHIBITS, u64::from(drive.start_inhibits)),
                    (id::START_INHIBITS_MFG, u64::from(drive.start_inhibits_mfg)),
                ];
                for (id, value) in values {
                    slot.store.publish(&self.axis_table, id, value);
                }
                for (id, value) in slot.axis.events.attributes() {
                    slot.store.publish(&self.axis_table, id, value);
                }
            }
        }
    }

    // -- explicit messages --------------------------------------------------------------------------------------

    /// Queues an explicit request, or refuses it if too many are waiting.
    pub(in crate::device) fn queue_explicit(&mut self, request: ExplicitRequest) {
        if let Err(request) = self.explicit.push(request) {
            self.counters.explicit_overflow += 1;
            let status = GeneralStatus::RESOURCE_UNAVAILABLE.0;
            self.reply(MotionReply::Explicit(ExplicitReply::status(request.token, status)));
        }
    }

    /// Works on the explicit requests, one at a time.
    ///
    /// The times are those of the moment, for services that compare them.
    pub(in crate::device) fn run_explicit(&mut self, now: MonotonicTime, system_time: Option<SystemTime>) {
        loop {
            if self.explicit.current.is_none() {
                let Some(request) = self.explicit.pop() else { return };
                self.start_explicit(&request, now, system_time);
            } else if !self.continue_explicit() {
                return;
            }
        }
    }

    fn start_explicit(
        &mut self,
        request: &ExplicitRequest,
        now: MonotonicTime,
        system_time: Option<SystemTime>,
    ) {
        let token = request.token;
        let answer = |device: &mut Self, status: GeneralStatus, body: &[u8]| {
            let mut reply = ExplicitReply::status(token, status.0);
            if reply.data.try_extend_from_slice(body).is_err() {
                reply = ExplicitReply::status(token, GeneralStatus::REPLY_DATA_TOO_LARGE.0);
            }
            device.reply(MotionReply::Explicit(reply));
        };
        let instance = usize::try_from(request.path.instance).unwrap_or(usize::MAX);
        if request.path.class != MOTION_AXIS_CLASS || instance > self.slots.len() {
            answer(self, GeneralStatus::PATH_DESTINATION_UNKNOWN, &[]);
            return;
        }
        if request.path.member.is_some() || request.path.connection_point.is_some() {
            answer(self, GeneralStatus::PATH_SEGMENT_ERROR, &[]);
            return;
        }
        if self.is_foreign(request) {
            answer(self, GeneralStatus::PRIVILEGE_VIOLATION, &[]);
            return;
        }
        let mut response = [0; EXPLICIT_DATA_MAX];
        let started = match (request.service, request.path.attribute) {
            (common::GET_ATTRIBUTE_LIST, _) => Started::List(ListFormat::CommonGet),
            (common::SET_ATTRIBUTE_LIST, _) => Started::List(ListFormat::CommonSet),
            (common::GET_ATTRIBUTE_SINGLE, Some(id)) => Started::List(ListFormat::SingleGet(id)),
            (common::SET_ATTRIBUTE_SINGLE, Some(id)) => Started::List(ListFormat::SingleSet(id)),
            (common::GET_ATTRIBUTE_SINGLE | common::SET_ATTRIBUTE_SINGLE, None) => {
                Started::Answered(GeneralStatus::PATH_SEGMENT_ERROR, 0)
            }
            (service, _) => {
                let service = MotionService(service);
                // A test moves the axis. In the service channel the update that brings it has been judged; this message
                // says nothing about the updates.
                let stale = self.connection.as_ref().is_some_and(|connection| !connection.is_current(now));
                if stale && service == MotionService::RUN_HOOKUP_TEST {
                    Started::Answered(GeneralStatus::DEVICE_STATE_CONFLICT, 0)
                } else {
                    self.start_service(instance, service, &request.data, system_time, &mut response)
                }
            }
        };
        match started {
            Started::Answered(status, len) => answer(self, status, &response[..len]),
            Started::List(format) => {
                let sets = matches!(format, ListFormat::CommonSet | ListFormat::SingleSet(_));
                self.progress.attribute_set |= sets;
                match self.explicit.worker.start(format, &request.data, EXPLICIT_DATA_MAX) {
                    Ok(()) => self.explicit.current = Some(Self::current(request, instance)),
                    Err(status) => answer(self, status, &[]),
                }
            }
        }
    }

    /// Carries the current request on; returns whether it has ended.
    fn continue_explicit(&mut self) -> bool {
        let Some(Current { token, instance, .. }) = self.explicit.current else { return false };
        self.publish(instance);
        let mut worker = core::mem::take(&mut self.explicit.worker);
        let Some(mut space) = self.space(instance) else { return false };
        let reply = worker.run(&mut space).map(|(status, body)| {
            let mut reply = ExplicitReply::status(token, status.0);
            // The worker keeps to the limit it was started with.
            reply.data.extend(body.iter().copied().take(EXPLICIT_DATA_MAX));
            reply
        });
        self.adopt(instance);
        let Some(reply) = reply else {
            self.explicit.worker = worker;
            return false;
        };
        self.explicit.current = None;
        self.reply(MotionReply::Explicit(reply));
        true
    }

    fn space(&mut self, instance: usize) -> Option<AttributeSpace<'_>> {
        let tickets = &mut self.tickets;
        match instance.checked_sub(1) {
            None => {
                let (table, store) = (&self.class_table, &mut self.class.store);
                Some(AttributeSpace { table, store, instance: 0, running: false, tickets })
            }
            Some(axis) => {
                let slot = self.slots.get_mut(axis)?;
                let running = slot.axis.is_running();
                let instance = u8::try_from(instance).unwrap_or(u8::MAX);
                Some(AttributeSpace {
                    table: &self.axis_table,
                    store: &mut slot.store,
                    instance,
                    running,
                    tickets,
                })
            }
        }
    }

    /// Takes the drive's answer if it belongs to the class channel or to the explicit request.
    pub(in crate::device) fn complete_explicit(&mut self, ticket: u32, answer: Result<&[u8], GeneralStatus>) {
        let mut worker = core::mem::take(&mut self.class.service.worker);
        let of_class = self.space(0).is_some_and(|mut space| worker.complete(ticket, answer, &mut space));
        self.class.service.worker = worker;
        if of_class {
            self.run_service(0);
            return;
        }
        let Some(Current { instance, .. }) = self.explicit.current else { return };
        let mut worker = core::mem::take(&mut self.explicit.worker);
        let taken = self.space(instance).is_some_and(|mut space| worker.complete(ticket, answer, &mut space));
        self.explicit.worker = worker;
        if taken {
            // The requests behind it begin with the next poll, which knows the time.
            self.continue_explicit();
        }
    }
}
