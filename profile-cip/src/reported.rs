//! Values and log records on their way to the other side: status of the device (clause 6-2.7.1.2.2, Status Data Set), time offsets
//! of both.
//!
//! A value is sent when it has changed, in every update until the other side's Last Received ID names an update that
//! carried it. Records of a log go one after the other, the next one only when the one before it has arrived.

use arrayvec::ArrayVec;

/// Records that a log keeps for transmission, clause 5-2.3.14.
pub(crate) const LOG_MAX: usize = 25;

/// The unbroken run of updates that carried something, by their Update IDs on the circle of 256.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Flight {
    first: u8,
    last: u8,
}

/// Longest run that counts: on a circle of 256 older updates could be taken for newer ones.
const FLIGHT_MAX: u8 = 127;

impl Flight {
    /// Update `id` carries it as well. A gap begins a new run: only an update that carried it proves anything.
    fn carry(flight: Option<Self>, id: u8) -> Self {
        match flight {
            Some(known) if id == known.last => known,
            Some(Self { first, last }) if id == last.wrapping_add(1) => {
                let full = id.wrapping_sub(first) > FLIGHT_MAX;
                Self { first: if full { first.wrapping_add(1) } else { first }, last: id }
            }
            _ => Self { first: id, last: id },
        }
    }

    /// Whether update `received` carried it.
    fn holds(self, received: u8) -> bool {
        received.wrapping_sub(self.first) <= self.last.wrapping_sub(self.first)
    }
}

/// A value that is reported when it changes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reported<T> {
    arrived: Option<T>,
    in_flight: Option<(Flight, T)>,
}

impl<T: Copy + PartialEq> Default for Reported<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Copy + PartialEq> Reported<T> {
    pub const fn new() -> Self {
        Self { arrived: None, in_flight: None }
    }

    /// A value that the other side knows already.
    pub const fn known(value: T) -> Self {
        Self { arrived: Some(value), in_flight: None }
    }

    /// The value if it is to be put into update `update_id`.
    pub fn due(&mut self, value: T, update_id: u8) -> Option<T> {
        if self.arrived == Some(value) {
            self.in_flight = None;
            return None;
        }
        let flight = self.in_flight.filter(|(_, sent)| *sent == value).map(|(flight, _)| flight);
        self.in_flight = Some((Flight::carry(flight, update_id), value));
        Some(value)
    }

    /// The other side has processed update `received`.
    pub fn acknowledge(&mut self, received: u8) {
        if let Some((flight, value)) = self.in_flight
            && flight.holds(received)
        {
            self.arrived = Some(value);
            self.in_flight = None;
        }
    }
}

/// A log of records.
#[derive(Debug, Clone)]
pub(crate) struct RecordLog<T> {
    records: ArrayVec<T, LOG_MAX>,
    in_flight: Option<Flight>,
    dropped: u32,
}

impl<T: Copy> RecordLog<T> {
    pub const fn new() -> Self {
        Self { records: ArrayVec::new_const(), in_flight: None, dropped: 0 }
    }

    /// Adds a record. A full log loses its oldest one that is not under way, and counts it.
    pub fn push(&mut self, record: T) {
        if self.records.is_full() {
            self.records.remove(usize::from(self.in_flight.is_some()));
            self.dropped = self.dropped.saturating_add(1);
        }
        self.records.push(record);
    }

    /// The record to put into update `update_id`.
    pub fn due(&mut self, update_id: u8) -> Option<T> {
        let record = self.records.first().copied()?;
        self.in_flight = Some(Flight::carry(self.in_flight, update_id));
        Some(record)
    }

    /// The controller has processed update `received`.
    pub fn acknowledge(&mut self, received: u8) {
        if self.in_flight.is_some_and(|flight| flight.holds(received)) {
            self.records.remove(0);
            self.in_flight = None;
        }
    }

    /// Forgets the records: another controller is told from the beginning.
    pub fn clear(&mut self) {
        self.records.clear();
        self.in_flight = None;
    }

    /// Records lost because the log was full.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_sent_until_an_update_with_it_has_arrived() {
        let mut value = Reported::new();
        assert_eq!(value.due(7, 254), Some(7));
        value.acknowledge(253);
        assert_eq!(value.due(7, 255), Some(7), "253 is before the first update with it");
        assert_eq!(value.due(7, 0), Some(7));
        value.acknowledge(0);
        assert_eq!(value.due(7, 1), None, "0 carried it, behind 254 on the circle");
        assert_eq!(value.due(8, 2), Some(8));
        assert_eq!(value.due(9, 3), Some(9));
        value.acknowledge(2);
        assert_eq!(value.due(9, 4), Some(9), "update 2 carried another value");
        value.acknowledge(3);
        assert_eq!(value.due(9, 5), None);
    }

    #[test]
    fn records_go_one_after_the_other() {
        let mut log = RecordLog::new();
        log.push('a');
        log.push('b');
        assert_eq!(log.due(10), Some('a'));
        assert_eq!(log.due(11), Some('a'));
        log.acknowledge(9);
        assert_eq!(log.due(12), Some('a'));
        log.acknowledge(13);
        assert_eq!(log.due(12), Some('a'), "13 was not sent yet");
        log.acknowledge(10);
        log.acknowledge(10);
        assert_eq!(log.due(13), Some('b'));
        log.acknowledge(12);
        assert_eq!(log.due(14), Some('b'), "12 carried the record before");
        log.acknowledge(13);
        assert_eq!(log.due(15), None);
    }

    #[test]
    fn an_update_without_the_record_proves_nothing() {
        let mut log = RecordLog::new();
        log.push('a');
        assert_eq!(log.due(20), Some('a'));
        // 21 to 24 went out without the Fault element: the controller did not ask for it.
        log.acknowledge(24);
        assert_eq!(log.due(25), Some('a'));
        log.acknowledge(20);
        assert_eq!(log.due(26), Some('a'), "20 belongs to the run before the gap");
        log.acknowledge(25);
        assert_eq!(log.due(27), None);
    }

    #[test]
    fn a_record_survives_a_controller_that_hears_nothing_for_long() {
        let mut log = RecordLog::new();
        log.push('a');
        let mut id = 0_u8;
        for _ in 0..1000 {
            assert_eq!(log.due(id), Some('a'));
            log.acknowledge(id.wrapping_sub(200));
            id = id.wrapping_add(1);
        }
        log.acknowledge(id.wrapping_sub(1));
        assert_eq!(log.due(id), None);
    }

    #[test]
    fn a_full_log_loses_the_oldest_that_is_not_under_way() {
        let mut log = RecordLog::new();
        for number in 0..LOG_MAX {
            log.push(number);
        }
        assert_eq!(log.due(1), Some(0));
        log.push(100);
        assert_eq!(log.dropped(), 1);
        log.acknowledge(1);
        assert_eq!(log.due(2), Some(2), "1 was lost, 0 was under way");
    }
}
