//! Faults and alarms of an axis, and their logs.

use super::super::axis_state::AxisEvent;
use super::super::drive_link::{DriveFault, DriveImage};
use super::{Axis, STATE_CHANGE_SHUTDOWN};
use crate::wire::motion::codes::{ClearingEvent, FaultType};
use crate::wire::motion::{AlarmRecord, FaultRecord};

impl Axis {
    pub fn set_drive(&mut self, image: DriveImage) {
        self.drive = image;
    }

    pub(super) fn log_cleared(&mut self, by: ClearingEvent, system_time: u64) {
        let record = FaultRecord {
            fault_type: FaultType::CLEARED,
            code: by.0,
            time_stamp: system_time,
            ..FaultRecord::default()
        };
        self.fault_log.push(record);
    }

    pub(super) fn raise(&mut self, fault: DriveFault, system_time: u64) {
        self.fault_log.push(FaultRecord {
            fault_type: fault.fault_type,
            code: fault.code,
            sub_code: fault.sub_code,
            action: fault.action,
            time_stamp: system_time,
        });
        if fault.fault_type == FaultType::AXIS && fault.code < 64 {
            self.faults |= 1 << fault.code;
        }
        let state_change = fault.action >> 4;
        if state_change == STATE_CHANGE_SHUTDOWN {
            self.shutdown = true;
        }
        if state_change != 0 {
            self.fire(AxisEvent::MajorFault);
        }
    }

    pub(super) fn log_alarm(&mut self, system_time: u64) {
        if self.alarm == self.drive.alarm {
            return;
        }
        for (alarm, state) in [(self.alarm, 0), (self.drive.alarm, 1)] {
            if let Some(alarm) = alarm {
                self.alarm_log.push(AlarmRecord {
                    alarm_type: alarm.alarm_type,
                    code: alarm.code,
                    sub_code: alarm.sub_code,
                    state,
                    time_stamp: system_time,
                });
            }
        }
        self.alarm = self.drive.alarm;
    }
}
