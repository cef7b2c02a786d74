//! What the device says of an axis.

use std::collections::VecDeque;

use crate::controller::condition::{AlarmPattern, FaultPattern};
use crate::controller::event::Event;
use crate::controller::number::{float, seconds, unroll};
use crate::controller::report::AxisReport;
use crate::wire::motion::codes::{AxisIoStatus, AxisStateCode, AxisStatus, ControlMode, FaultType};
use crate::wire::motion::{
    ActualBlock, ActualPosition, ActualValues, AlarmRecord, EventNotification, FaultRecord, StatusValues,
};
use profile_generic::time::SystemTime;

/// Records that wait for an expectation; older ones give way.
const RECORDS_MAX: usize = 64;

/// The newest of everything.
#[derive(Debug, Default)]
pub(in crate::controller) struct Seen {
    pub state: Option<AxisStateCode>,
    pub status: Option<AxisStatus>,
    pub io_status: Option<AxisIoStatus>,
    /// Control Mode in force.
    pub mode: Option<ControlMode>,
    /// The fault that has not been reset yet.
    pub fault: Option<FaultRecord>,
    /// Actual Position in counts, unrolled.
    pub actual: Option<i64>,
    /// In counts/s: from the positions.
    estimated_velocity: f64,
    /// In units/s: from the device.
    told_velocity: Option<f64>,
    at: SystemTime,
    last_fault: Option<FaultRecord>,
    last_alarm: Option<AlarmRecord>,
    faults: VecDeque<FaultRecord>,
    alarms: VecDeque<AlarmRecord>,
    events: VecDeque<EventNotification>,
}

fn keep<T>(records: &mut VecDeque<T>, record: T) {
    if records.len() == RECORDS_MAX {
        records.pop_front();
    }
    records.push_back(record);
}

impl Seen {
    /// Takes a block with all but its position.
    pub fn handle(&mut self, block: &ActualBlock, report: &mut AxisReport, event: &mut impl FnMut(Event)) {
        let axis = report.axis;
        if self.state != Some(block.axis_state) {
            event(Event::AxisState { axis, from: self.state, to: block.axis_state });
            report.states.push(block.axis_state);
            report.state = Some(block.axis_state);
            self.state = Some(block.axis_state);
        }
        self.mode = Some(ControlMode(block.control_mode.0 & 0x0F));
        self.told_velocity = block.actual.velocity.map(f64::from);
        if let Some((status, _)) = block.status.axis_status {
            self.status = Some(status);
        }
        if let Some((status, _)) = block.status.io_status {
            self.io_status = Some(status);
        }
        self.handle_records(&block.status, report, event);
    }

    /// A record stays in the updates until the device has seen that it arrived; it counts once.
    pub fn handle_records(
        &mut self,
        status: &StatusValues,
        report: &mut AxisReport,
        event: &mut impl FnMut(Event),
    ) {
        let axis = report.axis;
        if let Some(fault) = status.fault
            && self.last_fault.replace(fault) != Some(fault)
        {
            event(Event::AxisFault { axis, fault });
            let cleared = fault.fault_type == FaultType::CLEARED;
            self.fault = (!cleared).then_some(fault);
            keep(&mut self.faults, fault);
            if !cleared {
                report.faults.push(fault);
            }
        }
        if let Some(alarm) = status.alarm
            && self.last_alarm.replace(alarm) != Some(alarm)
        {
            event(Event::AxisAlarm { axis, alarm });
            keep(&mut self.alarms, alarm);
            report.alarms.push(alarm);
        }
    }

    /// Takes the actual position; returns it unrolled. Of an axis that the device unwinds nobody knows without the count
    /// where it is.
    pub fn handle_position(
        &mut self,
        actual: &ActualValues,
        unwind: Option<u32>,
        at: SystemTime,
    ) -> Option<i64> {
        let position = match (actual.position?, unwind) {
            (within, Some(unwind)) => {
                let within = match within {
                    ActualPosition::Dint(position) => i64::from(position),
                    ActualPosition::Lint(position) => position,
                };
                i64::from(actual.unwind_count?) * i64::from(unwind) + within
            }
            (ActualPosition::Dint(raw), None) => self.actual.map_or(i64::from(raw), |near| unroll(near, raw)),
            (ActualPosition::Lint(position), None) => position,
        };
        let elapsed = seconds(at - self.at);
        if let Some(before) = self.actual
            && elapsed > 0.0
        {
            self.estimated_velocity = float(position - before) / elapsed;
        }
        self.at = at;
        self.actual = Some(position);
        Some(position)
    }

    /// The position reference has changed: the difference to the position before is no movement.
    pub fn rereference(&mut self) {
        self.at = SystemTime(u64::MAX);
        self.estimated_velocity = 0.0;
    }

    /// Another actual value is asked for: neither where the axis was nor how fast it went counts any more.
    pub fn forget_motion(&mut self) {
        self.actual = None;
        self.told_velocity = None;
        self.estimated_velocity = 0.0;
    }

    /// Actual velocity in units/s, for an axis with `scale` counts in a unit.
    pub fn velocity(&self, scale: f64) -> f64 {
        self.told_velocity.unwrap_or(self.estimated_velocity / scale)
    }

    /// Takes the first fault record of this kind that waits for an expectation.
    pub fn take_fault(&mut self, pattern: &FaultPattern) -> bool {
        let at = self.faults.iter().position(|record| pattern.matches(record));
        at.and_then(|at| self.faults.remove(at)).is_some()
    }

    /// Takes the first alarm record of this kind that waits for an expectation.
    pub fn take_alarm(&mut self, pattern: &AlarmPattern) -> bool {
        let at = self.alarms.iter().position(|record| pattern.matches(record));
        at.and_then(|at| self.alarms.remove(at)).is_some()
    }

    /// Keeps a notification of an event for an expectation.
    pub fn note_event(&mut self, notification: EventNotification) {
        keep(&mut self.events, notification);
    }

    /// Takes the first notification of this kind that waits for an expectation.
    pub fn take_event(&mut self, matches: impl Fn(&EventNotification) -> bool) -> bool {
        let at = self.events.iter().position(matches);
        at.and_then(|at| self.events.remove(at)).is_some()
    }

    /// The newest notification that no expectation has taken.
    pub fn newest_event(&self) -> Option<EventNotification> {
        self.events.back().copied()
    }

    /// A fault that no expectation has taken.
    pub fn open_fault(&self) -> Option<FaultRecord> {
        self.faults.iter().find(|record| record.fault_type != FaultType::CLEARED).copied()
    }

    /// The newest record that no expectation has taken.
    pub fn newest_fault(&self) -> Option<FaultRecord> {
        self.faults.back().copied()
    }

    /// The newest record that no expectation has taken.
    pub fn newest_alarm(&self) -> Option<AlarmRecord> {
        self.alarms.back().copied()
    }

    /// The connection is a new one; what waits for expectations stays.
    pub fn reconnect(&mut self) {
        let (faults, alarms) = (core::mem::take(&mut self.faults), core::mem::take(&mut self.alarms));
        let events = core::mem::take(&mut self.events);
        *self = Self { faults, alarms, events, ..Self::default() };
    }
}
