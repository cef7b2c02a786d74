//! The master's ends of PDOs: what devices transmit is consumed, what they receive is produced.
//!
//! ```text
//!            first TPDO            due and not there       more than permitted
//! Waiting ---------------> Good ---------------------> Missing ----------------> Lost
//!    |                      ^_____________________________|_______________________|
//!    +--- more than permitted ---> Lost        TPDO
//! ```

use profile_generic::can::Id;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::config::{Direction, PdoConfig};
use crate::wire::NodeId;
use crate::wire::pdo::{MappingEntry, TransmissionType, mapped_len};

/// Most bytes of a PDO, in an FD frame.
const DATA_MAX: usize = 64;

/// Periods in a row with a TPDO too many, which tell of a second device.
const DOUBLES_MAX: u8 = 3;

/// TPDOs that may still come after their period, at most.
const OWED_MAX: u8 = 100;

/// Whether the values of a TPDO count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConsumerState {
    /// Nothing has come since the device went into operation.
    Waiting,
    /// Every TPDO that was due came.
    Good,
    /// TPDOs are missing, not more than permitted.
    Missing,
    /// More were missing in a row than permitted, since the last one.
    Lost,
}

/// What the application sees of a TPDO.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Consumer<'a> {
    /// The last values that came; zeros before the first.
    pub data: &'a [u8],
    /// Only in `Good` are cyclic data those of this cycle.
    pub state: ConsumerState,
    /// Whether values came since the last SYNC. In a network without SYNC, whether any came in operation and no deadline has passed
    /// since.
    pub fresh: bool,
    /// Whether it is sent at SYNC. Another one belongs to the moment at which it came.
    pub cyclic: bool,
    /// When they came; `None` before the first ones in operation.
    pub at: Option<MonotonicTime>,
    /// Whether they came after the synchronous window.
    pub late: bool,
    /// TPDOs in a row that were due and did not come.
    pub missed: u32,
}

/// Consumer of one TPDO.
#[derive(Debug)]
pub(super) struct TpdoEnd {
    pub number: u16,
    pub id: Id,
    pub mapping: Vec<MappingEntry>,
    len: usize,
    data: [u8; DATA_MAX],
    state: ConsumerState,
    fresh: bool,
    at: Option<MonotonicTime>,
    late: bool,
    missed: u32,
    allowed: u32,
    transmission: TransmissionType,
    /// Every how many SYNCs it is due; 0 when it is not cyclic.
    every: u32,
    /// SYNCs since it was due.
    syncs: u32,
    /// Longest time between two where it is event-driven, and what it is while it is.
    longest_of_events: DurationNs,
    longest: DurationNs,
    deadline: Option<MonotonicTime>,
    /// TPDOs that came in this period, without those that were due before.
    frames: u8,
    /// TPDOs that did not come in their period, and may be on their way: what waits in a queue comes faster than it is due.
    owed: u8,
    /// Periods in a row in which more than one came.
    doubles: u8,
    /// A wrong length has been reported.
    pub length_told: bool,
}

/// What a frame was to a consumer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Taken {
    /// A value.
    Value,
    /// The first one after a loss.
    Back,
    /// One too many in this period, again and again.
    Double,
}

impl TpdoEnd {
    pub fn new(pdo: &PdoConfig, node: NodeId) -> Self {
        let mut end = Self {
            number: pdo.number,
            id: pdo.id(Direction::Transmit, node).unwrap_or(Id::Standard(0)),
            mapping: Vec::with_capacity(crate::wire::pdo::MAPPING_MAX),
            len: 0,
            data: [0; DATA_MAX],
            state: ConsumerState::Waiting,
            fresh: false,
            at: None,
            late: false,
            missed: 0,
            allowed: u32::from(pdo.allowed_losses),
            transmission: pdo.transmission,
            every: 0,
            syncs: 0,
            longest_of_events: DurationNs::from_millis(i64::from(pdo.deadline_ms)),
            longest: DurationNs::ZERO,
            deadline: None,
            frames: 0,
            owed: 0,
            doubles: 0,
            length_told: false,
        };
        end.map(&pdo.mapping);
        end.send_as(pdo.transmission);
        end
    }

    pub fn transmission(&self) -> TransmissionType {
        self.transmission
    }

    /// It is sent by this transmission type.
    pub fn send_as(&mut self, transmission: TransmissionType) {
        self.transmission = transmission;
        self.every = u32::from(transmission.syncs().unwrap_or(0));
        self.longest = if transmission.is_event_driven() { self.longest_of_events } else { DurationNs::ZERO };
    }

    /// Takes another mapping, whose length has been checked.
    pub fn map(&mut self, mapping: &[MappingEntry]) {
        self.mapping.clear();
        self.mapping.extend_from_slice(mapping);
        self.len = mapped_len(mapping).unwrap_or(0).min(DATA_MAX);
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn view(&self) -> Consumer<'_> {
        Consumer {
            data: &self.data[..self.len],
            state: self.state,
            fresh: self.fresh,
            cyclic: self.every > 0,
            at: self.at,
            late: self.late,
            missed: self.missed,
        }
    }

    /// Nothing is valid any more; the values stay for the record.
    pub fn stop(&mut self) {
        self.state = ConsumerState::Waiting;
        (self.fresh, self.late, self.missed, self.syncs) = (false, false, 0, 0);
        (self.frames, self.owed, self.doubles) = (0, 0, 0);
        (self.at, self.deadline) = (None, None);
        self.length_told = false;
    }

    /// The device goes into operation.
    pub fn start(&mut self, now: MonotonicTime) {
        self.stop();
        self.deadline = (self.longest > DurationNs::ZERO).then(|| now + self.longest);
    }

    /// Takes a value of the right length.
    pub fn take(&mut self, now: MonotonicTime, data: &[u8], late: bool) -> Taken {
        if self.frames > 0 && self.owed > 0 {
            self.owed -= 1;
        } else {
            self.frames = self.frames.saturating_add(1);
        }
        self.data[..self.len].copy_from_slice(&data[..self.len]);
        let back = self.state == ConsumerState::Lost;
        self.state = ConsumerState::Good;
        (self.fresh, self.late, self.missed, self.syncs) = (true, late, 0, 0);
        self.length_told = false;
        self.at = Some(now);
        self.deadline = (self.longest > DurationNs::ZERO).then(|| now + self.longest);
        if self.every == 1 && self.frames > 1 && self.doubles + 1 >= DOUBLES_MAX {
            return Taken::Double;
        }
        if back { Taken::Back } else { Taken::Value }
    }

    /// One was due and did not come; `true` when that is the first one too many.
    fn miss(&mut self) -> bool {
        self.missed = self.missed.saturating_add(1);
        self.owed = self.owed.saturating_add(1).min(OWED_MAX);
        if self.missed > self.allowed {
            return core::mem::replace(&mut self.state, ConsumerState::Lost) != ConsumerState::Lost;
        }
        if self.state == ConsumerState::Good {
            self.state = ConsumerState::Missing;
        }
        false
    }

    /// A SYNC goes out: what has come belongs to the period before. Says whether a TPDO was due and did not come, and whether
    /// that is the first one too many.
    pub fn sync(&mut self) -> (bool, bool) {
        self.doubles = if self.frames > 1 { self.doubles.saturating_add(1).min(DOUBLES_MAX) } else { 0 };
        self.frames = 0;
        self.fresh = false;
        self.late = false;
        if self.every == 0 {
            return (false, false);
        }
        self.syncs += 1;
        if self.syncs <= self.every {
            return (false, false);
        }
        // The SYNC that goes out now is the first one of the next period.
        self.syncs = 1;
        (true, self.miss())
    }

    pub fn deadline(&self) -> Option<MonotonicTime> {
        self.deadline
    }

    /// As [`TpdoEnd::sync`], for a TPDO that has a time.
    pub fn elapsed(&mut self, now: MonotonicTime) -> (bool, bool) {
        match self.deadline {
            Some(deadline) if now >= deadline => {
                self.deadline = Some(now + self.longest);
                self.fresh = false;
                (true, self.miss())
            }
            _ => (false, false),
        }
    }
}

/// Producer of one RPDO.
#[derive(Debug)]
pub(super) struct RpdoEnd {
    pub number: u16,
    pub id: Id,
    pub mapping: Vec<MappingEntry>,
    len: usize,
    data: [u8; DATA_MAX],
    transmission: TransmissionType,
    /// To be sent.
    pub committed: bool,
    /// To be sent in this period.
    pub due: bool,
    /// Event-driven: the values of the last period, which are to count from now, and those of the period that begins.
    held: [[u8; DATA_MAX]; 2],
    /// There are such of the period that begins.
    holds: bool,
}

impl RpdoEnd {
    pub fn new(pdo: &PdoConfig, node: NodeId) -> Self {
        let mut end = Self {
            number: pdo.number,
            id: pdo.id(Direction::Receive, node).unwrap_or(Id::Standard(0)),
            mapping: Vec::with_capacity(crate::wire::pdo::MAPPING_MAX),
            len: 0,
            data: [0; DATA_MAX],
            transmission: pdo.transmission,
            committed: false,
            due: false,
            held: [[0; DATA_MAX]; 2],
            holds: false,
        };
        end.map(&pdo.mapping);
        end
    }

    /// Takes another mapping, whose length has been checked.
    pub fn map(&mut self, mapping: &[MappingEntry]) {
        self.mapping.clear();
        self.mapping.extend_from_slice(mapping);
        self.len = mapped_len(mapping).unwrap_or(0).min(DATA_MAX);
    }

    pub fn transmission(&self) -> TransmissionType {
        self.transmission
    }

    /// The device takes it by this transmission type.
    pub fn take_as(&mut self, transmission: TransmissionType) {
        self.transmission = transmission;
    }

    /// Goes out whenever there are values, in a network without SYNC.
    pub fn is_event_driven(&self) -> bool {
        self.transmission.is_event_driven()
    }

    /// A SYNC period begins. A synchronous RPDO is sent in it, and the device takes it at the next SYNC. An event-driven one counts
    /// as soon as it is there, and is kept until then: both get their values for the same instant.
    pub fn sync(&mut self) {
        let committed = core::mem::take(&mut self.committed);
        if !self.is_event_driven() {
            self.due |= committed;
            return;
        }
        self.held.swap(0, 1);
        self.due |= core::mem::replace(&mut self.holds, committed);
        self.held[1][..self.len].copy_from_slice(&self.data[..self.len]);
    }

    /// What is to be sent. `held` in a network with SYNC.
    pub fn outgoing(&self, held: bool) -> &[u8] {
        let from = if held && self.is_event_driven() { &self.held[0] } else { &self.data };
        &from[..self.len]
    }

    pub fn data_mut(&mut self) -> &mut [u8] {
        &mut self.data[..self.len]
    }

    /// Nothing is sent any more; the values are zeros again, so that no old ones go out when the device is back.
    pub fn stop(&mut self) {
        self.withdraw();
        self.data = [0; DATA_MAX];
    }

    /// Takes back what has not been sent yet.
    pub fn withdraw(&mut self) {
        (self.committed, self.due, self.holds) = (false, false, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::pdo::TransmissionType;

    fn end(transmission: u8, allowed_losses: u16) -> TpdoEnd {
        let mapping = vec![MappingEntry(0x6041_0010)];
        let pdo = PdoConfig {
            transmission: TransmissionType(transmission),
            allowed_losses,
            ..PdoConfig::cyclic(1, mapping)
        };
        let mut end = TpdoEnd::new(&pdo, NodeId::MAX);
        end.start(MonotonicTime::ZERO);
        end
    }

    /// Each period: a SYNC, and a TPDO where there is an `x`.
    fn run(end: &mut TpdoEnd, periods: &str) -> String {
        let mut said = String::new();
        for period in periods.chars() {
            let (missed, lost) = end.sync();
            said.push(match (missed, lost) {
                (_, true) => 'L',
                (true, _) => 'm',
                _ => '.',
            });
            if period == 'x' && end.take(MonotonicTime::ZERO, &[1, 2], false) == Taken::Back {
                said.push('B');
            }
        }
        said
    }

    #[test]
    fn losses_are_counted_from_the_sync_after_the_one_that_asked() {
        assert_eq!(run(&mut end(1, 1), "xxx-x"), "....m");
        assert_eq!(run(&mut end(1, 1), "x---x-"), "..mLmB.");
        assert_eq!(run(&mut end(1, 0), "---"), ".Lm");
        assert_eq!(run(&mut end(4, 0), "x---x----x"), ".........L".replace('L', "LB"));
        assert_eq!(run(&mut end(255, 0), "-----"), ".....");
    }

    #[test]
    fn states_and_freshness() {
        let mut end = end(1, 1);
        let states = |end: &TpdoEnd| (end.view().state, end.view().fresh, end.view().missed);
        assert_eq!(states(&end), (ConsumerState::Waiting, false, 0));
        run(&mut end, "x");
        assert_eq!((states(&end), end.view().data), ((ConsumerState::Good, true, 0), &[1, 2][..]));
        run(&mut end, "-");
        assert_eq!(states(&end), (ConsumerState::Good, false, 0));
        run(&mut end, "-");
        assert_eq!(states(&end), (ConsumerState::Missing, false, 1));
        run(&mut end, "-");
        assert_eq!(states(&end), (ConsumerState::Lost, false, 2));
        end.stop();
        assert_eq!((states(&end), end.view().data), ((ConsumerState::Waiting, false, 0), &[1, 2][..]));
    }

    #[test]
    fn a_second_sender_is_seen() {
        let mut end = end(1, 1);
        let now = MonotonicTime::ZERO;
        let mut taken = vec![];
        for _ in 0..3 {
            end.sync();
            taken.extend([end.take(now, &[0; 2], false), end.take(now, &[0; 2], false)]);
        }
        assert_eq!(taken[..5], [Taken::Value; 5]);
        assert_eq!(taken[5], Taken::Double);
        // One too many now and then is no second sender.
        end.stop();
        for _ in 0..5 {
            end.sync();
            end.take(now, &[0; 2], false);
            assert_eq!(end.take(now, &[0; 2], false), Taken::Value);
            end.sync();
            end.take(now, &[0; 2], false);
        }
    }

    #[test]
    fn what_comes_late_is_no_second_sender() {
        let mut end = end(1, 1);
        let now = MonotonicTime::ZERO;
        let mut take = |end: &mut TpdoEnd| end.take(now, &[0; 2], false);
        let twice = |end: &mut TpdoEnd, take: &mut dyn FnMut(&mut TpdoEnd) -> Taken| {
            end.sync();
            [take(end), take(end)]
        };
        // The first one, then six that did not come in time, the last of them in the period in which the device comes back with two a
        // period.
        end.sync();
        take(&mut end);
        (0..6).for_each(|_| _ = end.sync());
        assert_eq!(end.view().missed, 5);
        assert_eq!(twice(&mut end, &mut take), [Taken::Back, Taken::Value]);
        for _ in 0..5 {
            assert_eq!(twice(&mut end, &mut take), [Taken::Value; 2]);
        }
        // A device that owes nothing more sends one; two senders are seen after three periods.
        for _ in 0..2 {
            assert_eq!(twice(&mut end, &mut take), [Taken::Value; 2]);
        }
        assert_eq!(twice(&mut end, &mut take), [Taken::Value, Taken::Double]);
        // However long it was gone, what may come late is bounded.
        end.stop();
        take(&mut end);
        (0..1_000).for_each(|_| _ = end.sync());
        let periods = (0..).take_while(|_| twice(&mut end, &mut take)[1] != Taken::Double).count();
        assert_eq!(periods, usize::from(OWED_MAX) + 2);
        // Nothing of it is owed by a device that starts anew.
        (0..10).for_each(|_| _ = end.sync());
        end.start(now);
        let periods = (0..).take_while(|_| twice(&mut end, &mut take)[1] != Taken::Double).count();
        assert_eq!(periods, 2);
    }

    #[test]
    fn tpdos_that_are_not_cyclic_have_a_deadline_if_one_is_given() {
        let pdo = PdoConfig {
            transmission: TransmissionType::EVENT_PROFILE,
            deadline_ms: 100,
            ..PdoConfig::cyclic(2, vec![MappingEntry(0x6041_0010)])
        };
        let mut end = TpdoEnd::new(&pdo, NodeId::MAX);
        let ms = |ms: u64| MonotonicTime(ms * 1_000_000);
        end.start(ms(0));
        assert_eq!((end.elapsed(ms(99)), end.elapsed(ms(100))), ((false, false), (true, false)));
        end.take(ms(150), &[0; 2], false);
        assert_eq!((end.view().at, end.view().fresh), (Some(ms(150)), true));
        assert_eq!(
            (end.deadline(), end.elapsed(ms(250)), end.elapsed(ms(350))),
            (Some(ms(250)), (true, false), (true, true))
        );
    }
}
