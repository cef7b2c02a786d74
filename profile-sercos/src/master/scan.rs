//! CP0: who is on the network, and since when nothing has changed about it.
//!
//! First the topology, then the address list must stay the same for a number of cycles. A line of N slaves
//! returns the sequence counter, sent as 1, as 2 N: each slave counts once on the way out and once on the way
//! back, the last one once only. In a ring each slave counts once. With a line on each port the S telegram starts
//! where the P telegram ends, so that the numbers of the second line follow those of the first.

use super::topology::{Route, Seen, Topology, Verdict};
use crate::wire::cp0::{AtRepr, NO_SLAVE, SLAVES_MAX, SequenceCounter, TopologyField};
use crate::wire::header::Channel;

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

/// What the ATs of one cycle say about the network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Survey {
    pub topology: Topology,
    /// Slaves that were counted.
    pub slaves: u16,
    /// Those of them that are numbered from port 1 on; the others are numbered from port 2 on.
    pub from_one: u16,
    /// Topology fields by topology address, counted from 0.
    list: [u16; SLAVES_MAX],
    /// Every slave has written, and nobody else.
    complete: bool,
}

impl Survey {
    /// Evaluates the ATs by route. `start_two` is the count with which the S telegram was sent. `None` when they do not
    /// come from a network with at least one slave.
    // Flat: one arm per topology.
    pub fn of(ats: &[Option<AtRepr>; 4], start_two: u16) -> Option<Survey> {
        let Verdict::Now(topology) = Topology::Absent.judge(Seen::of(|route| ats[route.index()].is_some()))
        else {
            return None;
        };
        let at = |route: Route| ats[route.index()].as_ref();
        let line = |route, start| at(route).and_then(|at| slaves_in_line(at, start));
        let ring = |route, start| at(route).and_then(|at| slaves_in_ring(at, start));
        let mut list = [NO_SLAVE; SLAVES_MAX];
        let mut copy = |route, from: u16, slaves: u16| {
            at(route).is_some_and(|at| copy_fields(&mut list, at, usize::from(from - 1), usize::from(slaves)))
        };
        let (slaves, from_one, complete) = match topology {
            Topology::Absent => return None,
            Topology::LineOne => {
                let slaves = line(Route::PRIMARY_ONE, 1)?;
                (slaves, slaves, copy(Route::PRIMARY_ONE, 1, slaves))
            }
            Topology::LineTwo => {
                let slaves = line(Route::SECONDARY_TWO, start_two)?;
                (slaves, 0, start_two == 1 && copy(Route::SECONDARY_TWO, 1, slaves))
            }
            Topology::BrokenRing => {
                let (one, two) = (line(Route::PRIMARY_ONE, 1)?, line(Route::SECONDARY_TWO, start_two)?);
                let written = copy(Route::PRIMARY_ONE, 1, one)
                    && start_two == one + 1
                    && copy(Route::SECONDARY_TWO, start_two, two);
                (one + two, one, written)
            }
            Topology::Ring => {
                let (one, two) = (ring(Route::PRIMARY_TWO, 1)?, ring(Route::SECONDARY_ONE, start_two)?);
                // Going the other way round, the S telegram meets the slaves in the opposite order.
                let reversed = at(Route::SECONDARY_ONE).zip(at(Route::PRIMARY_TWO)).is_some_and(|(s, p)| {
                    let len = usize::from(one).min(SLAVES_MAX);
                    p.topology[..len].iter().eq(s.topology[..len].iter().rev())
                });
                let written = copy(Route::PRIMARY_TWO, 1, one);
                (one, one, written && one == two && start_two == 1 && reversed)
            }
            Topology::DefectRing { defective: Channel::Secondary } => {
                let slaves = ring(Route::PRIMARY_TWO, 1)?;
                (slaves, slaves, copy(Route::PRIMARY_TWO, 1, slaves))
            }
            Topology::DefectRing { .. } => {
                // Slaves that still hear P telegrams take their numbers from those, as in a broken ring. How many
                // they are says the copy that was turned round; without it they cannot be numbered.
                let slaves = ring(Route::SECONDARY_ONE, start_two)?;
                let one = line(Route::SECONDARY_TWO, start_two).and_then(|upper| slaves.checked_sub(upper));
                let written = copy(Route::SECONDARY_ONE, start_two, slaves);
                let from_one = one.unwrap_or(0);
                if written {
                    reorder(&mut list, usize::from(slaves), usize::from(from_one));
                }
                (slaves, from_one, written && one.is_some() && start_two == from_one + 1)
            }
        };
        let fits = usize::from(slaves) <= SLAVES_MAX;
        fits.then_some(Survey { topology, slaves, from_one, list, complete })
    }

    /// The count with which the next S telegram has to start.
    fn start_two(&self) -> u16 {
        match self.topology {
            Topology::BrokenRing | Topology::DefectRing { defective: Channel::Primary } => self.from_one + 1,
            _ => 1,
        }
    }

    /// Topology and number of slaves are the same.
    fn is_like(&self, other: &Survey) -> bool {
        (self.topology, self.slaves, self.from_one) == (other.topology, other.slaves, other.from_one)
    }
}

/// Slaves in the line whose AT0 this is, sent with the count `start`.
fn slaves_in_line(at: &AtRepr, start: u16) -> Option<u16> {
    let passes = at.counter.count().checked_sub(start)?;
    // One pass is the last slave's, two are each other's.
    let slaves = passes.div_ceil(2);
    (passes % 2 == 1 && usize::from(slaves) <= SLAVES_MAX).then_some(slaves)
}

/// Slaves in the ring whose AT0 this is, sent with the count `start`.
fn slaves_in_ring(at: &AtRepr, start: u16) -> Option<u16> {
    let slaves = at.counter.count().checked_sub(start)?;
    (slaves > 0 && usize::from(slaves) <= SLAVES_MAX).then_some(slaves)
}

/// Takes the fields from `from` on. Returns whether these and no others are written.
fn copy_fields(list: &mut [u16; SLAVES_MAX], at: &AtRepr, from: usize, slaves: usize) -> bool {
    let range = from..from + slaves;
    let (Some(to), Some(fields)) = (list.get_mut(range.clone()), at.topology.get(range.clone())) else {
        return false;
    };
    to.copy_from_slice(fields);
    let written = |(index, &word): (usize, &u16)| range.contains(&index) == (word != NO_SLAVE);
    at.topology.iter().enumerate().all(written)
}

/// Puts fields in S order, `from_one` + 1 to the last one and then the others backwards, in the order of their numbers.
fn reorder(list: &mut [u16; SLAVES_MAX], slaves: usize, from_one: usize) {
    let Some(moved) = list.get_mut(from_one..from_one + slaves) else { return };
    moved[slaves - from_one..].reverse();
    let fields: arrayvec::ArrayVec<u16, SLAVES_MAX> = moved.iter().copied().collect();
    list.fill(NO_SLAVE);
    list[from_one..slaves].copy_from_slice(&fields[..slaves - from_one]);
    list[..from_one].copy_from_slice(&fields[slaves - from_one..]);
}

/// Whether no slave has written: the condition to leave CP0.
pub(super) fn is_untouched(at: &AtRepr) -> bool {
    at.topology.iter().all(|&word| word == NO_SLAVE)
}

/// The sequence counter of the S telegram.
pub(super) fn secondary_counter(start: u16) -> SequenceCounter {
    SequenceCounter(SequenceCounter::START_SECONDARY.0 & 0x8000 | start)
}

#[derive(Debug)]
pub(super) struct Scan {
    stable_cycles: u16,
    timeout_cycles: u16,
    survey: Option<Survey>,
    topology_cycles: u16,
    list_cycles: u16,
    /// Cycles since the start of the present part.
    spent: u16,
    /// Consecutive cycles that do not fit the result of the scan.
    changed: u8,
    start_two: u16,
    /// Slaves in a stable scan that has not been taken over yet.
    pub ready: Option<u16>,
}

impl Scan {
    pub fn new(stable_cycles: u16, timeout_cycles: u16) -> Scan {
        Scan {
            stable_cycles,
            timeout_cycles,
            survey: None,
            topology_cycles: 0,
            list_cycles: 0,
            spent: 0,
            changed: 0,
            start_two: 1,
            ready: None,
        }
    }

    pub fn start(&mut self) {
        *self = Scan::new(self.stable_cycles, self.timeout_cycles);
    }

    /// The count with which the S telegram is sent.
    pub fn start_two(&self) -> u16 {
        self.start_two
    }

    /// What the network is, as far as known.
    pub fn survey(&self) -> Option<&Survey> {
        self.survey.as_ref()
    }

    /// The routes on which every telegram comes back, as far as known.
    pub fn routes(&self) -> &'static [Route] {
        self.survey.as_ref().map_or(&[], |survey| survey.topology.routes())
    }

    /// Takes what one cycle says, `None` when no slaves answered.
    pub fn update(&mut self, survey: Option<Survey>) -> ScanResult {
        self.spent = self.spent.saturating_add(1);
        let like = match (&survey, &self.survey) {
            (Some(new), Some(old)) => new.is_like(old),
            (new, old) => new.is_none() == old.is_none(),
        };
        if !like {
            self.topology_cycles = 0;
            self.list_cycles = 0;
        }
        if let Some(new) = &survey {
            self.topology_cycles = self.topology_cycles.saturating_add(1);
            if self.topology_cycles <= self.stable_cycles {
                // The list has its own time-out, from the first cycle of a stable topology on.
                if self.topology_cycles == self.stable_cycles {
                    self.spent = 0;
                }
            } else if new.complete && self.survey.as_ref() == survey.as_ref() {
                self.list_cycles = self.list_cycles.saturating_add(1);
            } else {
                self.list_cycles = 0;
            }
            self.start_two = new.start_two();
        }
        self.survey = survey;
        if let Some(survey) = self.survey.as_ref().filter(|_| self.list_cycles >= self.stable_cycles) {
            return ScanResult::Stable(survey.slaves);
        }
        if self.spent < self.timeout_cycles {
            return ScanResult::Going;
        }
        let nobody = self.survey.is_none();
        self.start();
        if nobody { ScanResult::Nobody } else { ScanResult::Unstable }
    }

    /// Whether the network is another one than the scan found, for two cycles in a row: one lost telegram is not
    /// a change.
    pub fn has_changed(&mut self, survey: Option<&Survey>) -> bool {
        let same = survey == self.survey.as_ref();
        self.changed = if same { 0 } else { self.changed.saturating_add(1) };
        self.changed >= 2
    }

    /// SERCOS address of the slave at `index`; 0 when it has none.
    pub fn address(&self, index: usize) -> u16 {
        let word = self.survey.as_ref().and_then(|survey| survey.list.get(index));
        word.and_then(|&word| TopologyField(word).address()).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(count: usize, from: usize, addresses: &[u16]) -> AtRepr {
        let mut at = AtRepr::empty(SequenceCounter(u16::try_from(count).unwrap()));
        at.topology[from..from + addresses.len()].copy_from_slice(addresses);
        at
    }

    /// A line on port 1.
    fn line(addresses: &[u16]) -> Survey {
        Survey::of(&[Some(at(2 * addresses.len(), 0, addresses)), None, None, None], 1).unwrap()
    }

    #[test]
    fn the_recordings_line() {
        // Startup recording, frame 4: counter 4, addresses 1 and 2.
        let mut scan = Scan::new(100, 1000);
        let at = line(&[1, 2]);
        let cycles = (1..).find(|_| scan.update(Some(at.clone())) != ScanResult::Going);
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
        let lines = [0, 1, 2, 3, 4, 1022, 1024].map(|counter| slaves_in_line(&at(counter), 1));
        assert_eq!(lines, [None, None, Some(1), None, Some(2), Some(511), None]);
    }

    #[test]
    fn a_change_starts_the_count_again() {
        let mut scan = Scan::new(10, 100);
        for _ in 0..19 {
            assert_eq!(scan.update(Some(line(&[1, 2]))), ScanResult::Going);
        }
        assert_eq!(scan.update(Some(line(&[1, 3]))), ScanResult::Going);
        let cycles = (1..).find(|_| scan.update(Some(line(&[1, 3]))) == ScanResult::Stable(2));
        assert_eq!(cycles, Some(10));
        let mut scan = Scan::new(10, 100);
        for _ in 0..19 {
            scan.update(Some(line(&[1, 2])));
        }
        scan.update(Some(line(&[1])));
        let cycles = (1..).find(|_| scan.update(Some(line(&[1, 2]))) == ScanResult::Stable(2));
        assert_eq!(cycles, Some(20));
    }

    #[test]
    fn timeouts() {
        let mut scan = Scan::new(10, 100);
        assert_eq!((1..).find(|_| scan.update(None) == ScanResult::Nobody), Some(100));
        assert_eq!((1..).find(|_| scan.update(None) == ScanResult::Nobody), Some(100));
        let mut last = ScanResult::Going;
        for cycle in 0..100 {
            last = scan.update(Some(line(if cycle % 8 < 4 { &[1, 2] } else { &[1] })));
        }
        assert_eq!(last, ScanResult::Unstable);
        // A slave that counts and never writes its address: the list never becomes complete.
        let mut scan = Scan::new(10, 100);
        let results: Vec<_> = (0..110).map(|_| scan.update(Some(line(&[1, NO_SLAVE])))).collect();
        assert_eq!(results.last(), Some(&ScanResult::Unstable));
    }

    /// The slaves in order of their numbers, and how many are numbered from port 1 on.
    fn found(survey: Option<Survey>) -> (Topology, Vec<u16>, u16, bool) {
        let survey = survey.expect("slaves");
        let list = survey.list[..usize::from(survey.slaves)].to_vec();
        (survey.topology, list, survey.from_one, survey.complete)
    }

    #[test]
    fn every_topology_is_numbered() {
        let two = |at: AtRepr| AtRepr { counter: secondary_counter(at.counter.count()), ..at };
        let ring = [None, None, Some(at(4, 0, &[1, 2, 3])), Some(two(at(4, 0, &[3, 2, 1])))];
        assert_eq!(found(Survey::of(&ring, 1)), (Topology::Ring, vec![1, 2, 3], 3, true));
        let line_two = [None, Some(two(at(4, 0, &[3, 2]))), None, None];
        assert_eq!(found(Survey::of(&line_two, 1)), (Topology::LineTwo, vec![3, 2], 0, true));
        // The second line is numbered from 1 on at first, and behind the first one in the next cycle.
        let first = [Some(at(4, 0, &[1, 2])), Some(two(at(6, 0, &[5, 4, 3]))), None, None];
        let survey = Survey::of(&first, 1).unwrap();
        assert_eq!((survey.slaves, survey.from_one, survey.complete, survey.start_two()), (5, 2, false, 3));
        let next = [Some(at(4, 0, &[1, 2])), Some(two(at(8, 2, &[5, 4, 3]))), None, None];
        assert_eq!(found(Survey::of(&next, 3)), (Topology::BrokenRing, vec![1, 2, 5, 4, 3], 2, true));
        let only_p = [None, None, Some(at(3, 0, &[1, 2])), None];
        let topology = Topology::DefectRing { defective: Channel::Secondary };
        assert_eq!(found(Survey::of(&only_p, 1)), (topology, vec![1, 2], 2, true));
        let turned = [Some(at(2, 0, &[1])), None, Some(at(3, 0, &[1, 2])), None];
        assert_eq!(found(Survey::of(&turned, 1)), (topology, vec![1, 2], 2, true));
        // Slaves 1 and 2 hear P telegrams, 3 turns the S telegrams round, 4 and 5 are behind it.
        let topology = Topology::DefectRing { defective: Channel::Primary };
        let first = [None, Some(two(at(6, 0, &[5, 4, 3]))), None, Some(two(at(6, 0, &[5, 4, 3, 2, 1])))];
        let survey = Survey::of(&first, 1).unwrap();
        assert_eq!((survey.slaves, survey.from_one, survey.complete, survey.start_two()), (5, 2, false, 3));
        let next = [None, Some(two(at(8, 2, &[5, 4, 3]))), None, Some(two(at(8, 2, &[5, 4, 3, 2, 1])))];
        assert_eq!(found(Survey::of(&next, 3)), (topology, vec![1, 2, 5, 4, 3], 2, true));
        // Nobody turns them round: it is unknown who hears the P telegrams.
        let unknown = [None, None, None, Some(two(at(6, 0, &[5, 4, 3, 2, 1])))];
        assert!(!found(Survey::of(&unknown, 1)).3);
    }

    #[test]
    fn contradicting_counts_and_lists_are_no_scan() {
        let two = |at: AtRepr| AtRepr { counter: secondary_counter(at.counter.count()), ..at };
        let counts = [None, None, Some(at(4, 0, &[1, 2, 3])), Some(two(at(3, 0, &[3, 2])))];
        assert!(!found(Survey::of(&counts, 1)).3);
        let order = [None, None, Some(at(4, 0, &[1, 2, 3])), Some(two(at(4, 0, &[1, 2, 3])))];
        assert!(!found(Survey::of(&order, 1)).3);
        let hole = [Some(at(4, 0, &[1, NO_SLAVE, 2])), None, None, None];
        assert!(!found(Survey::of(&hole, 1)).3);
        // Two lines that together are more than a network has, a master's ports joined without a slave.
        let long = [Some(at(1022, 0, &[1; 511])), Some(two(at(513, 0, &[]))), None, None];
        assert_eq!(Survey::of(&long, 512), None);
        let joined = [None, None, Some(at(1, 0, &[])), Some(two(at(1, 0, &[])))];
        assert_eq!(Survey::of(&joined, 1), None);
    }
}
