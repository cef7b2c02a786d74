//! The fault and alarm log that a device keeps for people, beside the records it sends to its controller
//! (clause 5-2.3.14 leaves its form to the device).
//!
//! It outlives connections. [`FAULT_LOG_LEN`] entries are kept: the oldest one that has ended is replaced first, and
//! [`FaultLog::total`] reports how many there were.

use arrayvec::ArrayVec;

use super::state::AxisState;
use crate::wire::motion::codes::{AlarmType, ClearingEvent, FaultType};

/// Entries that are kept for each axis.
pub const FAULT_LOG_LEN: usize = 64;

/// Changes that wait for somebody to tell them.
const CHANGES_MAX: usize = 32;

/// What an entry is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogKind {
    /// A fault, latched until a reset.
    Fault(FaultType),
    /// An alarm or start inhibit, which ends with its condition.
    Alarm(AlarmType),
}

/// One fault or alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogEntry {
    /// Its number since the device was started, from 1.
    pub number: u32,
    /// What it is.
    pub kind: LogKind,
    /// Bit number in the table of its type.
    pub code: u8,
    /// Sub code.
    pub sub_code: u8,
    /// Axis Fault Action; 0 for a minor fault or an alarm.
    pub action: u8,
    /// The drive's own code, 0 when it gave none.
    pub detail: u32,
    /// State of the axis when it came.
    pub state: AxisState,
    /// System time at which it came, ns.
    pub at: u64,
    /// What ended it, and when; [`ClearingEvent::NONE`] when its condition went by itself.
    pub ended: Option<(ClearingEvent, u64)>,
}

/// The log of one axis.
#[derive(Debug, Clone)]
pub struct FaultLog {
    /// Oldest first.
    entries: ArrayVec<LogEntry, FAULT_LOG_LEN>,
    changes: ArrayVec<LogEntry, CHANGES_MAX>,
    total: u32,
    untold: u32,
}

impl FaultLog {
    pub(crate) const fn new() -> Self {
        Self { entries: ArrayVec::new_const(), changes: ArrayVec::new_const(), total: 0, untold: 0 }
    }

    /// The entries, newest first.
    pub fn entries(&self) -> impl Iterator<Item = &LogEntry> {
        self.entries.iter().rev()
    }

    /// Entries since the device was started, also those that have given way.
    #[must_use]
    pub const fn total(&self) -> u32 {
        self.total
    }

    /// Changes that were not told because nobody asked for them.
    #[must_use]
    pub const fn untold(&self) -> u32 {
        self.untold
    }

    /// The next entry that came or ended.
    pub(crate) fn poll(&mut self) -> Option<LogEntry> {
        (!self.changes.is_empty()).then(|| self.changes.remove(0))
    }

    fn change(&mut self, entry: LogEntry) {
        if self.changes.is_full() {
            self.changes.remove(0);
            self.untold = self.untold.saturating_add(1);
        }
        self.changes.push(entry);
    }

    /// Adds an entry; its number and end are filled in.
    pub(crate) fn add(&mut self, entry: LogEntry) {
        self.total = self.total.wrapping_add(1);
        let entry = LogEntry { number: self.total, ended: None, ..entry };
        if self.entries.is_full() {
            // The end of an entry is reported only while the entry is kept.
            let ended = self.entries.iter().position(|entry| entry.ended.is_some());
            self.entries.remove(ended.unwrap_or(0));
        }
        self.entries.push(entry);
        self.change(entry);
    }

    /// Ends the faults that a reset clears.
    pub(crate) fn end_faults(&mut self, by: ClearingEvent, at: u64, clears: impl Fn(FaultType) -> bool) {
        for place in 0..self.entries.len() {
            let entry = &mut self.entries[place];
            let cleared = matches!(entry.kind, LogKind::Fault(kind) if clears(kind));
            if cleared && entry.ended.is_none() {
                entry.ended = Some((by, at));
                let entry = *entry;
                self.change(entry);
            }
        }
    }

    /// Ends an alarm, and gives the sub code that it had.
    pub(crate) fn end_alarm(&mut self, alarm: AlarmType, code: u8, by: ClearingEvent, at: u64) -> u8 {
        let open = |entry: &&mut LogEntry| {
            entry.kind == LogKind::Alarm(alarm) && entry.code == code && entry.ended.is_none()
        };
        let Some(entry) = self.entries.iter_mut().rev().find(open) else { return 0 };
        entry.ended = Some((by, at));
        let entry = *entry;
        self.change(entry);
        entry.sub_code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(code: u8) -> LogEntry {
        LogEntry {
            number: 0,
            kind: LogKind::Fault(FaultType::AXIS),
            code,
            sub_code: 0,
            action: 0x24,
            detail: 0,
            state: AxisState::Running,
            at: u64::from(code),
            ended: None,
        }
    }

    #[test]
    fn the_newest_entries_are_kept_and_all_are_counted() {
        let mut log = FaultLog::new();
        for code in 0..100 {
            log.add(fault(code));
        }
        assert_eq!((log.total(), log.entries().count()), (100, FAULT_LOG_LEN));
        let newest = log.entries().next().expect("an entry");
        assert_eq!((newest.number, newest.code), (100, 99));
        assert_eq!(log.entries().last().map(|entry| entry.number), Some(37));
        assert_eq!(log.untold(), 68, "nobody took the changes");
    }

    #[test]
    fn a_reset_ends_what_it_clears_once() {
        let mut log = FaultLog::new();
        log.add(fault(1));
        log.end_faults(ClearingEvent::FAULT_RESET, 50, |_| true);
        log.add(fault(2));
        log.end_faults(ClearingEvent::SHUTDOWN_RESET, 60, |_| true);
        let ends: Vec<_> = log.entries().map(|entry| entry.ended).collect();
        assert_eq!(ends, [Some((ClearingEvent::SHUTDOWN_RESET, 60)), Some((ClearingEvent::FAULT_RESET, 50))]);
        assert_eq!(std::iter::from_fn(|| log.poll()).count(), 4);
    }

    #[test]
    fn entry_that_has_not_ended_outlasts_those_that_have() {
        let mut log = FaultLog::new();
        log.add(fault(1));
        for at in 0..64 {
            log.add(LogEntry { kind: LogKind::Alarm(AlarmType::START_INHIBIT), ..fault(2) });
            log.end_alarm(AlarmType::START_INHIBIT, 2, ClearingEvent::NONE, at);
            while log.poll().is_some() {}
        }
        log.end_faults(ClearingEvent::FAULT_RESET, 99, |_| true);
        let end = log.poll().map(|entry| (entry.code, entry.ended));
        assert_eq!(end, Some((1, Some((ClearingEvent::FAULT_RESET, 99)))));
        assert_eq!((log.entries().count(), log.total()), (FAULT_LOG_LEN, 65));
    }
}
