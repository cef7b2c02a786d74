//! An axis with its attributes, its service channel and its cyclic lists.

use super::cyclic_list::{CyclicLists, Direction};
use super::drive_values::DriveValues;
use super::receive::Verdict;
use super::service_channel::ServiceChannel;
use crate::device::attribute::{AttributeStore, AttributeTable, id};
use crate::device::axis::drive_link::Trims;
use crate::device::axis::{Axis, AxisConfig, Context};
use crate::wire::motion::codes::{AlarmType, FaultType};
use crate::wire::motion::{CommandInstance, CommandPosition, WriteBlock};
use crate::wire::status::GeneralStatus;
use profile_generic::time::MonotonicTime;

/// An axis of the device.
pub(super) struct Slot {
    pub axis: Axis,
    pub store: AttributeStore,
    pub service: ServiceChannel,
    pub write_lists: CyclicLists,
    pub read_lists: CyclicLists,
    /// What the write list in use has for the drive.
    pub drive_values: DriveValues,
}

impl Slot {
    pub fn new(config: AxisConfig, table: &AttributeTable) -> Self {
        Self {
            axis: Axis::new(config),
            store: AttributeStore::new(table),
            service: ServiceChannel::default(),
            write_lists: CyclicLists::default(),
            read_lists: CyclicLists::default(),
            drive_values: DriveValues::default(),
        }
    }

    /// Factory defaults, no lists and an idle channel: a connection begins or ends.
    pub fn start_over(&mut self, table: &AttributeTable) {
        self.store.reset(table);
        self.service.reset();
        self.write_lists.start_over();
        self.read_lists.start_over();
        self.drive_values.clear();
    }

    /// Whether its drive has or may have torque: until the drive reports otherwise.
    pub fn is_energized(&self) -> bool {
        self.axis.drive().power_enabled || self.axis.state().is_energized()
    }

    /// Applies what an update has for the cyclic channels of the axis. Returns what to report about its lists.
    pub fn apply(
        &mut self,
        table: &AttributeTable,
        instance: &CommandInstance<'_>,
        verdict: &Verdict,
        now: MonotonicTime,
        context: &Context,
    ) -> Option<(u8, u8, GeneralStatus)> {
        let refused = context.node_fault || matches!(verdict, Verdict::CommandsRefused);
        let mut trims = Trims::default();
        let lists = instance.write.map(|block| self.cyclic_write(table, &block, refused, &mut trims));
        self.axis.events.handle(instance.events.as_ref());
        if let Some(block) = &instance.cyclic {
            match verdict {
                Verdict::Fresh(times) => self.axis.handle_block(block, trims, *times, now, context),
                Verdict::CommandsRefused => self.axis.handle_status_request(block),
            }
        }
        lists
    }

    /// Applies cyclic write data and returns what to report about it. What they add to the set-points goes into `trims`.
    fn cyclic_write(
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
            let values = (&mut self.store, &mut self.drive_values);
            self.write_lists.write(table, values, block.write_block_id, block.data, running)
        };
        let status = match written {
            Ok(written) => {
                *trims = written;
                self.drive_values.status()
            }
            Err(status) => status,
        };
        (block.write_block_id, block.read_block_id, status)
    }

    /// Carries out a Set_Cyclic_Write_List or Set_Cyclic_Read_List.
    pub fn configure_list(
        &mut self,
        table: &AttributeTable,
        direction: Direction,
        body: &[u8],
        response: &mut [u8],
    ) -> (GeneralStatus, usize) {
        self.lists(direction).configure(table, direction, body, response)
    }

    /// The lists of a direction.
    pub fn lists(&mut self, direction: Direction) -> &mut CyclicLists {
        match direction {
            Direction::Write => &mut self.write_lists,
            Direction::Read => &mut self.read_lists,
        }
    }

    /// Puts the values of the axis into its attributes, so that a service or a cyclic list reads them. `fixed`: the
    /// position is a DINT, whatever the last block says.
    pub fn publish(&mut self, table: &AttributeTable, fixed: bool, context: &Context) {
        let (block, drive) = (self.axis.block(), self.axis.drive());
        let words = self.axis.fault_words();
        let fault = self.axis.faults.newest_fault();
        let alarm = self.axis.faults.newest_alarm();
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
            (id::COMMAND_TARGET_TIME, self.axis.target_time()),
            (id::STATUS_DATA_SET, u64::from(block.status_data_set.bits())),
            (id::POSITION_COMMAND_INTEGER, counts),
            (id::POSITION_COMMAND_FLOAT, float),
            (id::VELOCITY_COMMAND, real(block.values.velocity)),
            (id::ACCELERATION_COMMAND, real(block.values.acceleration)),
            (id::TORQUE_COMMAND, real(block.values.torque)),
            (id::AXIS_STATE, u64::from(self.axis.state().code().0)),
            (id::AXIS_STATUS, u64::from(self.axis.status(context).bits())),
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
            self.store.publish(table, id, value);
        }
        for (id, value) in self.axis.events.attributes() {
            self.store.publish(table, id, value);
        }
    }
}
