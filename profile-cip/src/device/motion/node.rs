//! The communications node of the device: faults and alarms of the class, clauses 5-2.2.1.4 and 5-2.2.1.5.

use profile_generic::time::MonotonicTime;

use crate::wire::motion::codes::{NodeAlarm, NodeFault};

/// Alarms clear by themselves after this, ns (clause 5-2.2.1.5).
const ALARM_NS: u64 = 10_000_000_000;
/// Loss of synchronization that is an alarm, ns (Table 5-2.7: 10 to 20 s).
const SYNC_ALARM_NS: u64 = 10_000_000_000;
/// Loss of synchronization that is a fault, ns (Table 5-2.6: 40 to 60 s).
const SYNC_FAULT_NS: u64 = 60_000_000_000;
/// Clock skew that is a fault, ns (clause 7-1.3).
const SKEW_FAULT_NS: u64 = 60_000_000_000;

/// Faults and alarms of the node.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct NodeHealth {
    fault: NodeFault,
    /// The fault that only another connection ends, also where another one came first and is the one that shows.
    lasting: NodeFault,
    alarm: NodeAlarm,
    alarm_since: MonotonicTime,
    skew_since: Option<MonotonicTime>,
    unsynchronized_since: Option<MonotonicTime>,
}

impl NodeHealth {
    pub fn fault(&self) -> NodeFault {
        self.fault
    }

    pub fn alarm(&self) -> NodeAlarm {
        self.alarm
    }

    pub fn is_faulted(&self) -> bool {
        self.fault != NodeFault::NONE
    }

    /// Latches a fault. The first one stands: it is the cause.
    pub fn raise(&mut self, fault: NodeFault) {
        let lasts = matches!(fault, NodeFault::CONNECTION_UPDATE | NodeFault::CONNECTION_LOSS);
        if lasts && self.lasting == NodeFault::NONE {
            self.lasting = fault;
        }
        if !self.is_faulted() {
            self.fault = fault;
        }
    }

    /// Posts an alarm, or posts it again.
    pub fn post(&mut self, alarm: NodeAlarm, now: MonotonicTime) {
        self.alarm = alarm;
        self.alarm_since = now;
    }

    /// A fresh update has come: it ends the update alarm (clause 6-2.7.1.1).
    pub fn fresh_update(&mut self) {
        if self.alarm == NodeAlarm::CONNECTION_UPDATE {
            self.alarm = NodeAlarm::NONE;
        }
    }

    /// Node Fault Reset. Update and loss faults end only with another connection.
    pub fn reset(&mut self) {
        if self.fault != self.lasting {
            self.fault = self.lasting;
            self.skew_since = None;
            self.unsynchronized_since = None;
        }
    }

    /// A connection was opened or closed.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// The clocks of controller and device are skewed or not, at the request of synchronous operation.
    pub fn skew(&mut self, skewed: bool, now: MonotonicTime) {
        if !skewed {
            self.skew_since = None;
            return;
        }
        let since = *self.skew_since.get_or_insert(now);
        self.post(NodeAlarm::CLOCK_SKEW, now);
        if now.0.saturating_sub(since.0) > SKEW_FAULT_NS {
            self.raise(NodeFault::CLOCK_SKEW);
        }
    }

    /// The device's clock is synchronized or not, in synchronous operation.
    pub fn synchronization(&mut self, synchronized: bool, now: MonotonicTime) {
        if synchronized {
            self.unsynchronized_since = None;
            return;
        }
        let since = *self.unsynchronized_since.get_or_insert(now);
        let lost = now.0.saturating_sub(since.0);
        if lost > SYNC_FAULT_NS {
            self.raise(NodeFault::CLOCK_SYNC);
        } else if lost > SYNC_ALARM_NS {
            self.post(NodeAlarm::CLOCK_SYNC, now);
        }
    }

    /// The variation of system time is beyond the threshold, in synchronous operation. An alarm that says more stands.
    pub fn jitter(&mut self, now: MonotonicTime) {
        if matches!(self.alarm, NodeAlarm::NONE | NodeAlarm::CLOCK_JITTER) {
            self.post(NodeAlarm::CLOCK_JITTER, now);
        }
    }

    /// Lets alarms run out.
    pub fn tick(&mut self, now: MonotonicTime) {
        if now.0.saturating_sub(self.alarm_since.0) > ALARM_NS {
            self.alarm = NodeAlarm::NONE;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    fn at(seconds: u64) -> MonotonicTime {
        MonotonicTime(seconds * SECOND)
    }

    #[test]
    fn the_first_fault_stands_and_reset_spares_those_of_the_connection() {
        let mut node = NodeHealth::default();
        node.raise(NodeFault::DATA_FORMAT);
        node.raise(NodeFault::CONNECTION_UPDATE);
        assert_eq!(node.fault(), NodeFault::DATA_FORMAT);
        node.reset();
        assert_eq!(node.fault(), NodeFault::CONNECTION_UPDATE, "it shows when the first one is reset");
        node.reset();
        assert_eq!(node.fault(), NodeFault::CONNECTION_UPDATE);
        node.clear();
        node.raise(NodeFault::DATA_FORMAT);
        node.reset();
        assert!(!node.is_faulted());
        for fault in [NodeFault::CONNECTION_UPDATE, NodeFault::CONNECTION_LOSS] {
            node.clear();
            node.raise(fault);
            node.reset();
            assert_eq!(node.fault(), fault);
        }
        node.clear();
        assert!(!node.is_faulted());
    }

    #[test]
    fn alarms_run_out_and_the_update_alarm_ends_with_a_fresh_update() {
        let mut node = NodeHealth::default();
        node.post(NodeAlarm::CLOCK_JITTER, at(1));
        node.fresh_update();
        node.tick(at(11));
        assert_eq!(node.alarm(), NodeAlarm::CLOCK_JITTER);
        node.tick(at(12));
        assert_eq!(node.alarm(), NodeAlarm::NONE);
        node.post(NodeAlarm::CONNECTION_UPDATE, at(12));
        node.fresh_update();
        assert_eq!(node.alarm(), NodeAlarm::NONE);
    }

    #[test]
    fn skew_and_lost_synchronization_become_faults_after_a_minute() {
        let mut node = NodeHealth::default();
        node.skew(true, at(0));
        node.skew(true, at(60));
        assert_eq!((node.alarm(), node.is_faulted()), (NodeAlarm::CLOCK_SKEW, false));
        node.skew(false, at(61));
        node.skew(true, at(62));
        node.skew(true, at(122));
        assert!(!node.is_faulted(), "the minute begins again");
        node.skew(true, at(123));
        assert_eq!(node.fault(), NodeFault::CLOCK_SKEW);

        let mut node = NodeHealth::default();
        node.synchronization(false, at(0));
        node.synchronization(false, at(10));
        assert_eq!(node.alarm(), NodeAlarm::NONE);
        node.synchronization(false, at(11));
        assert_eq!(node.alarm(), NodeAlarm::CLOCK_SYNC);
        node.synchronization(false, at(61));
        assert_eq!(node.fault(), NodeFault::CLOCK_SYNC);
    }
}
