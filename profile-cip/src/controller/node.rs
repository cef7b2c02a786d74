//! What the device says of itself as a node, in the header of every D-to-C update.

use super::event::Event;
use super::report::Report;
use crate::wire::motion::codes::{NodeAlarm, NodeFault, NodeStatus};
use crate::wire::motion::header::ActualHeader;

/// The newest of everything, and what waits for an expectation.
#[derive(Debug, Default)]
pub(super) struct NodeSeen {
    pub status: NodeStatus,
    pub fault: NodeFault,
    pub alarm: NodeAlarm,
    /// Faults and alarms that came and that no expectation has taken, by their code.
    open_faults: u16,
    open_alarms: u16,
    /// Counters of the device, with their turns.
    lost: Counter,
    late: Counter,
}

/// The device counts from zero since the connection was opened, and reports only what has changed.
#[derive(Debug, Default)]
struct Counter {
    last: u8,
    total: u32,
}

impl Counter {
    fn handle(&mut self, value: u8) {
        let more = value.wrapping_sub(core::mem::replace(&mut self.last, value));
        self.total = self.total.saturating_add(u32::from(more));
    }
}

const fn bit(code: u8) -> u16 {
    1 << (code & 0x0F)
}

impl NodeSeen {
    pub fn handle(&mut self, header: &ActualHeader, report: &mut Report, mut event: impl FnMut(Event)) {
        self.status = header.node_status;
        self.handle_fault(header.node_fault, report, &mut event);
        if header.node_alarm != self.alarm {
            self.alarm = header.node_alarm;
            if self.alarm != NodeAlarm::NONE {
                report.node_alarm = Some(self.alarm);
                self.open_alarms |= bit(self.alarm.0);
            }
            event(Event::NodeAlarm(self.alarm));
        }
        if let Some(counters) = header.update_diagnostics {
            report.device_lost_updates = counters.lost_updates;
            report.device_late_updates = counters.late_updates;
            self.lost.handle(counters.lost_updates);
            self.late.handle(counters.late_updates);
        }
    }

    /// Takes the fault code.
    pub fn handle_fault(&mut self, fault: NodeFault, report: &mut Report, mut event: impl FnMut(Event)) {
        if fault == self.fault {
            return;
        }
        self.fault = fault;
        if fault != NodeFault::NONE {
            report.node_fault = Some(fault);
            self.open_faults |= bit(fault.0);
        }
        event(Event::NodeFault(fault));
    }

    /// Takes a fault that waits for an expectation; one that is still there counts in any case.
    pub fn take_fault(&mut self, fault: NodeFault) -> bool {
        let found = self.fault == fault || self.open_faults & bit(fault.0) != 0;
        self.open_faults &= !bit(fault.0);
        found
    }

    /// Takes an alarm that waits for an expectation; one that is still there counts in any case.
    pub fn take_alarm(&mut self, alarm: NodeAlarm) -> bool {
        let found = self.alarm == alarm || self.open_alarms & bit(alarm.0) != 0;
        self.open_alarms &= !bit(alarm.0);
        found
    }

    /// A fault that is there, or came and no expectation has taken it.
    pub fn open_fault(&self) -> Option<NodeFault> {
        let came = (1..16).map(NodeFault).find(|fault| self.open_faults & bit(fault.0) != 0);
        Some(self.fault).filter(|fault| *fault != NodeFault::NONE).or(came)
    }

    /// Lost and late updates that the device counts since the connection was opened.
    pub const fn counters(&self) -> (u32, u32) {
        (self.lost.total, self.late.total)
    }

    /// The connection is a new one; what waits for expectations stays.
    pub fn reconnect(&mut self) {
        let (open_faults, open_alarms) = (self.open_faults, self.open_alarms);
        *self = Self { open_faults, open_alarms, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_turn_over_and_faults_wait_to_be_taken() {
        let mut counter = Counter::default();
        for value in [250, 255, 4] {
            counter.handle(value);
        }
        assert_eq!(counter.total, 260);
        let mut node = NodeSeen { open_faults: bit(1), ..NodeSeen::default() };
        assert_eq!(node.open_fault(), Some(NodeFault::CONNECTION_UPDATE));
        assert!(node.take_fault(NodeFault::CONNECTION_UPDATE));
        assert!(!node.take_fault(NodeFault::CONNECTION_UPDATE));
        assert_eq!(node.open_fault(), None);
        assert!(node.take_fault(NodeFault::NONE), "none is there now");
    }
}
