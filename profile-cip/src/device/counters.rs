//! What the adapter has counted since its start.

use arrayvec::ArrayVec;

/// Different reasons of refused Forward_Opens that are distinguished; those beyond are counted in the last one.
pub const REFUSALS_MAX: usize = 48;

/// Everything that was refused or given up, by reason. Counters only rise.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Counters {
    /// Streams refused because all session slots are taken.
    pub sessions_refused: u64,
    /// Streams closed for silence.
    pub sessions_timed_out: u64,
    /// Streams closed because they spoke something else than encapsulation.
    pub sessions_garbled: u64,
    /// Encapsulation packets dropped without an answer: non-zero options or request status.
    pub packets_dropped: u64,
    /// Encapsulation packets refused: unknown command.
    pub commands_unknown: u64,
    /// Encapsulation packets refused: longer than the adapter takes, or with a length the command cannot
    /// have.
    pub lengths_invalid: u64,
    /// Encapsulation packets refused: malformed data.
    pub data_malformed: u64,
    /// Encapsulation packets refused: the session handle is not that of the stream.
    pub handles_invalid: u64,
    /// RegisterSession refused: another protocol version or options.
    pub versions_refused: u64,
    /// Datagrams without an answer: malformed, or nothing to answer.
    pub datagrams_dropped: u64,
    /// Connected messages dropped: no such connection in this session.
    pub connected_unknown: u64,
    /// Connected messages answered with the last reply, because their sequence count was repeated.
    pub connected_repeated: u64,
    /// Explicit requests refused with a general status.
    pub requests_refused: u64,
    /// Requests given up because the motion device did not answer.
    pub device_timeouts: u64,
    /// Replies of the motion device nobody waited for any more.
    pub replies_orphaned: u64,
    /// Forward_Opens received, both forms.
    pub open_requests: u64,
    /// Forward_Opens that were malformed.
    pub open_format_rejects: u64,
    /// Forward_Opens refused for want of connections.
    pub open_resource_rejects: u64,
    /// Forward_Opens refused for any other reason.
    pub open_other_rejects: u64,
    /// Forward_Opens refused, by general and extended status.
    pub open_refusals: ArrayVec<Refusal, REFUSALS_MAX>,
    /// Forward_Closes received.
    pub close_requests: u64,
    /// Forward_Closes that were malformed.
    pub close_format_rejects: u64,
    /// Forward_Closes refused: no such connection.
    pub close_other_rejects: u64,
    /// Connections that timed out, motion and explicit.
    pub connection_timeouts: u64,
    /// Events lost because nobody fetched them.
    pub events_lost: u64,
}

/// How often a status was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// General status.
    pub general: u8,
    /// First word of extended status, 0 without one.
    pub extended: u16,
    /// How often.
    pub count: u64,
}

impl Counters {
    /// Counts a refused Forward_Open.
    pub(crate) fn refuse_open(&mut self, general: u8, extended: u16) {
        let same = |row: &&mut Refusal| row.general == general && row.extended == extended;
        if let Some(row) = self.open_refusals.iter_mut().find(same) {
            row.count += 1;
        } else if self.open_refusals.try_push(Refusal { general, extended, count: 1 }).is_err()
            && let Some(last) = self.open_refusals.last_mut()
        {
            last.count += 1;
        }
    }

    /// How often a Forward_Open was refused with this status.
    pub fn open_refused(&self, general: u8, extended: u16) -> u64 {
        let same = |row: &&Refusal| row.general == general && row.extended == extended;
        self.open_refusals.iter().find(same).map_or(0, |row| row.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusals_are_told_apart_until_the_table_is_full() {
        let mut counters = Counters::default();
        counters.refuse_open(1, 0x106);
        counters.refuse_open(1, 0x106);
        counters.refuse_open(9, 4);
        assert_eq!(counters.open_refused(1, 0x106), 2);
        assert_eq!(counters.open_refused(9, 4), 1);
        assert_eq!(counters.open_refused(1, 0x107), 0);
        for extended in 0..100 {
            counters.refuse_open(2, extended);
        }
        assert_eq!(counters.open_refusals.iter().map(|row| row.count).sum::<u64>(), 103);
    }
}
