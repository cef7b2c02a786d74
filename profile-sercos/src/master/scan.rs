//! CP0: who is on the network, and since when nothing has changed about it.
//!
//! First the topology, then the address list must stay the same for a number of cycles. A line of N slaves
//! returns the sequence counter, sent as 1, as 2 N: each slave counts once on the way out and once on the way
//! back, the last one once only.

use crate::wire::cp0::{AtRepr, NO_SLAVE, SLAVES_MAX, SequenceCounter, TopologyField};

/// What one cycle of CP0 has brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ScanResult {
    /// Not stable yet.
    Going,
    /// So many slaves, for long enough.
    Stable(u16),
    /// Time-out: no slaves answer.
    Nobody,
    /// Time-out: slaves answer, not always the same.
    Unstable,
}

#[derive(Debug)]
pub(super) struct Scan {
    stable_cycles: u16,
    timeout_cycles: u16,
    slaves: Option<u16>,
    list: [u16; SLAVES_MAX],
    topology_cycles: u16,
    list_cycles: u16,
    /// Cycles since the start of the present part.
    spent: u16,
    /// Consecutive cycles that do not fit the result of the scan.
    changed: u8,
}

/// Slaves in the line whose AT0 this is; `None` when it does not come from a line of at least one slave.
pub(super) fn slaves_in_line(at: &AtRepr) -> Option<u16> {
    let count = at.counter.count();
    let slaves = count / 2;
    let line = !at.counter.secondary() && count.is_multiple_of(2) && slaves > 0;
    (line && usize::from(slaves) <= SLAVES_MAX).then_some(slaves)
}

/// Whether no slave has written: the condition to leave CP0.
pub(super) fn is_untouched(at: &AtRepr) -> bool {
    at.topology.iter().all(|&word| word == NO_SLAVE)
}

/// AT0 as the master sends it.
pub(super) fn empty() -> AtRepr {
    AtRepr::empty(SequenceCounter::START_PRIMARY)
}

impl Scan {
    pub fn new(stable_cycles: u16, timeout_cycles: u16) -> Scan {
        Scan {
            stable_cycles,
            timeout_cycles,
            slaves: None,
            list: [NO_SLAVE; SLAVES_MAX],
            topology_cycles: 0,
            list_cycles: 0,
            spent: 0,
            changed: 0,
        }
    }

    pub fn start(&mut self) {
        *self = Scan::new(self.stable_cycles, self.timeout_cycles);
    }

    /// Takes AT0 of one cycle, `None` when it did not come back.
    pub fn update(&mut self, at: Option<&AtRepr>) -> ScanResult {
        let slaves = at.and_then(slaves_in_line);
        self.spent = self.spent.saturating_add(1);
        if slaves != self.slaves {
            self.slaves = slaves;
            self.topology_cycles = 0;
            self.list_cycles = 0;
        }
        if let (Some(at), Some(count)) = (at, slaves) {
            self.topology_cycles = self.topology_cycles.saturating_add(1);
            if self.topology_cycles <= self.stable_cycles {
                // The list has its own time-out, from the first cycle of a stable topology on.
                if self.topology_cycles == self.stable_cycles {
                    self.spent = 0;
                }
            } else if at.topology == self.list && is_complete(at, count) {
                self.list_cycles = self.list_cycles.saturating_add(1);
            } else {
                self.list_cycles = 0;
            }
            self.list = at.topology;
            if self.list_cycles >= self.stable_cycles {
                return ScanResult::Stable(count);
            }
        }
        if self.spent < self.timeout_cycles {
            return ScanResult::Going;
        }
        let nobody = self.slaves.is_none();
        self.start();
        if nobody { ScanResult::Nobody } else { ScanResult::Unstable }
    }

    /// Whether the network is another one than the scan found, for two cycles in a row: one lost telegram is not
    /// a change.
    pub fn has_changed(&mut self, at: Option<&AtRepr>) -> bool {
        let same = at.is_some_and(|at| slaves_in_line(at) == self.slaves && at.topology == self.list);
        self.changed = if same { 0 } else { self.changed.saturating_add(1) };
        self.changed >= 2
    }

    /// SERCOS address of the slave at `index`; 0 when it has none.
    pub fn address(&self, index: usize) -> u16 {
        self.list.get(index).and_then(|&word| TopologyField(word).address()).unwrap_or(0)
    }
}

/// Every slave of the line has written, and nobody else.
fn is_complete(at: &AtRepr, slaves: u16) -> bool {
    let slaves = usize::from(slaves);
    at.topology[..slaves].iter().all(|&word| word != NO_SLAVE)
        && at.topology[slaves..].iter().all(|&word| word == NO_SLAVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(addresses: &[u16]) -> AtRepr {
        let counter = SequenceCounter(u16::try_from(2 * addresses.len()).unwrap());
        let mut at = AtRepr::empty(counter);
        at.topology[..addresses.len()].copy_from_slice(addresses);
        at
    }

    #[test]
    fn the_recordings_line() {
        // Startup recording, frame 4: counter 4, addresses 1 and 2.
        let mut scan = Scan::new(100, 1000);
        let at = line(&[1, 2]);
        let cycles = (1..).find(|_| scan.update(Some(&at)) != ScanResult::Going);
        // 100 cycles for the topology, 100 for the list.
        assert_eq!(cycles, Some(200));
        assert_eq!((scan.address(0), scan.address(1), scan.address(2)), (1, 2, 0));
        assert!(!scan.has_changed(Some(&at)));
        assert!(!scan.has_changed(None));
        assert!(!scan.has_changed(Some(&at)));
        assert!(!scan.has_changed(Some(&line(&[1]))));
        assert!(scan.has_changed(Some(&line(&[1]))));
    }

    #[test]
    fn counters_that_are_no_line() {
        let at = |counter| AtRepr::empty(SequenceCounter(counter));
        let lines = [0, 1, 2, 3, 4, 1022, 1024, 0x8002].map(|counter| slaves_in_line(&at(counter)));
        assert_eq!(lines, [None, None, Some(1), None, Some(2), Some(511), None, None]);
    }

    #[test]
    fn a_change_starts_the_count_again() {
        let mut scan = Scan::new(10, 100);
        for _ in 0..19 {
            assert_eq!(scan.update(Some(&line(&[1, 2]))), ScanResult::Going);
        }
        assert_eq!(scan.update(Some(&line(&[1, 3]))), ScanResult::Going);
        let cycles = (1..).find(|_| scan.update(Some(&line(&[1, 3]))) == ScanResult::Stable(2));
        assert_eq!(cycles, Some(10));
        let mut scan = Scan::new(10, 100);
        for _ in 0..19 {
            scan.update(Some(&line(&[1, 2])));
        }
        scan.update(Some(&line(&[1])));
        let cycles = (1..).find(|_| scan.update(Some(&line(&[1, 2]))) == ScanResult::Stable(2));
        assert_eq!(cycles, Some(20));
    }

    #[test]
    fn timeouts() {
        let mut scan = Scan::new(10, 100);
        assert_eq!((1..).find(|_| scan.update(None) == ScanResult::Nobody), Some(100));
        assert_eq!((1..).find(|_| scan.update(None) == ScanResult::Nobody), Some(100));
        let mut last = ScanResult::Going;
        for cycle in 0..100 {
            last = scan.update(Some(&line(if cycle % 8 < 4 { &[1, 2] } else { &[1] })));
        }
        assert_eq!(last, ScanResult::Unstable);
        // A slave that counts and never writes its address: the list never becomes complete.
        let mut scan = Scan::new(10, 100);
        let results: Vec<_> = (0..110).map(|_| scan.update(Some(&line(&[1, NO_SLAVE])))).collect();
        assert_eq!(results.last(), Some(&ScanResult::Unstable));
    }
}
