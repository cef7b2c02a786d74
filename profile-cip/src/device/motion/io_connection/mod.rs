//! The motion I/O connection of the device: order of the packets, age of the updates, schedule of the answers.
//! Clauses 2-1.2 to 2-1.4, 6-2.7.1.1, 7-1.1 to 7-1.3.
//!
//! ```text
//! Connecting    header-only updates, refreshed at the RPI with the same sequence count
//! Asynchronous  a D-to-C update right behind every C-to-D update; without one, one period after the last
//! Pending       as before; Synchronous Control is accepted, the first synchronous update is scheduled
//! Synchronous   D-to-C updates at the start of each update cycle, C-to-D updates or not
//! ```

mod schedule;
mod stamps;

use profile_generic::time::MonotonicTime;

pub(crate) use self::schedule::{Mode, Schedule};
pub(crate) use self::stamps::{Age, Stamps};

use crate::device::axis::report::missed_updates;
use crate::device::motion_link::OpenParameters;
use crate::wire::forward_open::FIRST_MESSAGE_TIMEOUT;
use crate::wire::motion::CommandHeader;
use crate::wire::motion::codes::{NodeControl, TimeDataSet};

/// Steps of the sequence count that are always believed.
const STEPS_MIN: u64 = 8;

/// What a packet is, by its sequence count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Packet {
    New,
    Refresh,
    Old,
}

/// What an update is, by its Update ID.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Update {
    /// New, after so many lost ones.
    New(u8),
    Repeated,
    Old,
}

/// An open connection.
#[derive(Debug, Clone)]
pub(crate) struct IoConnection {
    pub parameters: OpenParameters,
    sequence: Option<u16>,
    /// When the owner was heard last; until then, when the connection was opened.
    last_heard: MonotonicTime,
    /// The owner was heard on this connection.
    is_heard: bool,
    update_id: Option<u8>,
    /// Arrival of the last update that was applied.
    last_fresh: Option<MonotonicTime>,
    /// The newest update was applied.
    applied: bool,
    /// Header of the last accepted C-to-D packet.
    pub header: Option<CommandHeader>,
    /// System time at which the last C-to-D update was received, ns.
    pub received_at: u64,
    /// Time stamp of the last update that counted synchronously, in the device's system time, ns.
    pub stamped_at: Option<u64>,
    pub stamps: Stamps,
    pub schedule: Schedule,
}

impl IoConnection {
    /// An open connection whose device needs `processing_ns` to produce an update (Transmission Processing Time).
    pub fn new(parameters: OpenParameters, processing_ns: u64, now: MonotonicTime) -> Self {
        let period = u64::from(parameters.rpi_us).saturating_mul(1000);
        Self {
            parameters,
            sequence: None,
            last_heard: now,
            is_heard: false,
            update_id: None,
            last_fresh: None,
            applied: false,
            header: None,
            received_at: 0,
            stamped_at: None,
            stamps: Stamps::new(period),
            schedule: Schedule::new(period, processing_ns, now),
        }
    }

    /// Controller Update Period, ns.
    pub fn period(&self) -> u64 {
        u64::from(self.parameters.rpi_us).saturating_mul(1000)
    }

    /// What a packet with this sequence count is. A count that is further ahead than the time-out lets updates be lost, twice
    /// over, is not the next one of this connection but an old one that comes again after the counter has gone round.
    pub fn packet(&self, sequence: u16) -> Packet {
        match self.sequence.map(|last| sequence.wrapping_sub(last)) {
            None => Packet::New,
            Some(0) => Packet::Refresh,
            Some(step) if u64::from(step) <= self.steps_max() => Packet::New,
            Some(_) => Packet::Old,
        }
    }

    /// Steps of the sequence count from one packet to the next at most: twice the updates in the time-out.
    fn steps_max(&self) -> u64 {
        let updates = self.parameters.timeout_us / u64::from(self.parameters.rpi_us.max(1));
        updates.saturating_mul(2).clamp(STEPS_MIN, 0x7FFF)
    }

    /// A packet of the owner has come, with its sequence count where the network has one.
    pub fn heard(&mut self, sequence: Option<u16>, now: MonotonicTime) {
        self.sequence = sequence;
        self.last_heard = now;
        self.is_heard = true;
    }

    pub fn update(&self, id: u8) -> Update {
        match self.update_id.map(|last| id.wrapping_sub(last)) {
            None => Update::New(0),
            Some(0) => Update::Repeated,
            Some(step @ 1..=127) => Update::New(step - 1),
            Some(_) => Update::Old,
        }
    }

    /// An update with data was accepted, to be applied or not.
    pub fn accepted(&mut self, id: u8, now: MonotonicTime, fresh: bool) {
        self.update_id = Some(id);
        self.applied = fresh;
        if fresh || self.last_fresh.is_none() {
            self.last_fresh = Some(now);
        }
    }

    /// An update without valid data has come: what the one before it commanded does not stand any more.
    pub fn invalid(&mut self) {
        self.applied = false;
    }

    /// Whether the controller commands now: its newest update was applied, and none is overdue.
    pub fn is_current(&self, now: MonotonicTime) -> bool {
        self.applied && self.missed(now) == 0
    }

    /// Update ID of the last accepted update with data.
    pub fn last_received_id(&self) -> u8 {
        self.update_id.unwrap_or(0)
    }

    /// Whether the exchange of data has begun.
    pub fn has_data(&self) -> bool {
        self.update_id.is_some()
    }

    /// Consecutive missed updates; 0 before the first one.
    pub fn missed(&self, now: MonotonicTime) -> u64 {
        self.last_fresh.map_or(0, |last| missed_updates(now.0.saturating_sub(last.0), self.period()))
    }

    /// Silence of the controller, ns.
    pub fn silence(&self, now: MonotonicTime) -> u64 {
        now.0.saturating_sub(self.last_heard.0)
    }

    /// Longest silence of the controller, ns. Before its first packet it has longer: nothing moves that could run away.
    fn timeout(&self) -> u64 {
        let timeout = self.parameters.timeout_us.saturating_mul(1000);
        if self.is_heard { timeout } else { timeout.max(FIRST_MESSAGE_TIMEOUT.0.unsigned_abs()) }
    }

    pub fn is_timed_out(&self, now: MonotonicTime) -> bool {
        self.silence(now) > self.timeout()
    }

    pub fn node_control(&self) -> NodeControl {
        self.header.map_or(NodeControl::empty(), |h| h.node_control)
    }

    pub fn time_data_set(&self) -> TimeDataSet {
        self.header.map_or(TimeDataSet::empty(), |h| h.time_data_set())
    }

    /// A C-to-D update asks for its answer.
    pub fn answer(&mut self, update_id: u8, now: MonotonicTime) {
        self.schedule.answer(update_id, self.has_data(), now);
    }

    /// An update was produced; `idle` is the head of one that has nothing to say.
    pub fn transmitted(&mut self, idle: Option<[u8; 8]>) {
        self.schedule.transmitted(idle, self.has_data());
    }

    /// If a D-to-C update is due: its Update ID. Schedules the one after it.
    pub fn take_transmit(&mut self, now: MonotonicTime) -> Option<u8> {
        self.schedule.take(now, self.has_data())
    }

    /// When the connection has something to do at the latest.
    pub fn wake_at(&self) -> MonotonicTime {
        let timeout = self.timeout().saturating_add(1);
        self.schedule.next().min(MonotonicTime(self.last_heard.0.saturating_add(timeout)))
    }
}
