//! The motion I/O connection of the device: order of the packets, age of the updates, schedule of the answers.
//! Clauses 2-1.2 to 2-1.4, 6-2.7.1.1, 7-1.1 to 7-1.3.
//!
//! ```text
//! Connecting    header-only updates, refreshed at the RPI with the same sequence count
//! Asynchronous  a D-to-C update right behind every C-to-D update; without one, one period after the last
//! Pending       as before; Synchronous Control is accepted, the first synchronous update is scheduled
//! Synchronous   D-to-C updates at the start of each update cycle, C-to-D updates or not
//! ```

use profile_generic::interpolation::ArrivalClock;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::device::axis::report::missed_updates;
use crate::device::motion_link::OpenParameters;
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

/// What an update is, by its time stamp in synchronous operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Age {
    OnTime,
    /// More than one period old.
    Late,
    /// Beyond the low limit.
    Alarming,
    /// Beyond the high limit.
    TooLate,
    /// Further ahead than the high limit.
    Ahead,
}

/// Timing of the answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    Asynchronous,
    Pending { first_update_id: u8, at: MonotonicTime },
    Synchronous,
}

/// An open connection.
#[derive(Debug, Clone)]
pub(crate) struct IoConnection {
    pub parameters: OpenParameters,
    sequence: Option<u16>,
    last_heard: MonotonicTime,
    update_id: Option<u8>,
    /// Arrival of the last update that was applied.
    last_fresh: Option<MonotonicTime>,
    /// The newest update was applied.
    applied: bool,
    /// Header of the last accepted C-to-D packet.
    pub header: Option<CommandHeader>,
    pub mode: Mode,
    next_transmit: MonotonicTime,
    /// How much before its time an update may go in synchronous operation, ns.
    early: u64,
    /// Sequence count of the last D-to-C packet.
    pub transmit_sequence: u16,
    /// Head of the last D-to-C update if it had nothing to say.
    idle_header: Option<[u8; 8]>,
    /// Update ID of the last D-to-C update.
    sent_update_id: u8,
    /// Update ID that the next D-to-C update answers, if a C-to-D update has triggered it.
    answer: Option<u8>,
    /// System time at which the last C-to-D update was received, ns.
    pub received_at: u64,
    /// The controller's update clock, estimated from the arrivals of its updates.
    arrivals: ArrivalClock,
    /// The last time stamp that was trusted, on the local clock, with Update ID and arrival of its update.
    stamped: Option<(u64, u8, MonotonicTime)>,
}

impl IoConnection {
    /// An open connection that is asked for its updates every `poll_interval_ns`.
    pub fn new(parameters: OpenParameters, poll_interval_ns: u64, now: MonotonicTime) -> Self {
        let period = u64::from(parameters.rpi_us).saturating_mul(1000);
        Self {
            parameters,
            sequence: None,
            last_heard: now,
            update_id: None,
            last_fresh: None,
            applied: false,
            header: None,
            mode: Mode::Asynchronous,
            next_transmit: MonotonicTime(now.0.saturating_add(period)),
            early: poll_interval_ns / 2,
            transmit_sequence: 0,
            idle_header: None,
            sent_update_id: 0,
            answer: None,
            received_at: 0,
            stamped: None,
            arrivals: ArrivalClock::new(DurationNs(i64::try_from(period).unwrap_or(i64::MAX).max(1))),
        }
    }

    /// Controller Update Period, ns.
    pub fn period(&self) -> u64 {
        u64::from(self.parameters.rpi_us).saturating_mul(1000)
    }

    // -- receiving ----------------------------------------------------------------------------------------------

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
    }

    pub fn update(&self, id: u8) -> Update {
        match self.update_id.map(|last| id.wrapping_sub(last)) {
            None => Update::New(0),
            Some(0) => Update::Repeated,
            Some(step @ 1..=127) => Update::New(step - 1),
            Some(_) => Update::Old,
        }
    }

    /// Judges a time stamp in this device's system time; all in ns.
    pub fn age(&self, time_stamp: u64, system_time: u64, low_limit: u64, high_limit: u64) -> Age {
        let period = self.period();
        let ahead = time_stamp.saturating_sub(system_time);
        let age = system_time.saturating_sub(time_stamp);
        if ahead > period.saturating_mul(high_limit.max(1)) {
            Age::Ahead
        } else if age > period.saturating_mul(high_limit) {
            Age::TooLate
        } else if age > period.saturating_mul(low_limit) {
            Age::Alarming
        } else if age > period {
            Age::Late
        } else {
            Age::OnTime
        }
    }

    /// An update has arrived, after so many lost ones: when it would have arrived without the jitter of the network.
    pub fn arrive(&mut self, arrival: MonotonicTime, lost: u8) -> MonotonicTime {
        self.arrivals.arrive(arrival, u32::from(lost) + 1)
    }

    /// Whether a time stamp, on the local clock in ns, follows from the one before: to half a period as many periods later as the
    /// Update ID says. After a gap in the arrivals it may be as long later as the update has arrived later, to one and a half
    /// periods: a controller that was held up leaves out cycles. One that does neither is of a clock that was set.
    pub fn follows(&mut self, stamp: u64, id: u8, arrival: MonotonicTime) -> bool {
        let period = self.period();
        let plausible = self.stamped.is_none_or(|(last, before, arrived)| {
            let advance = stamp.wrapping_sub(last).cast_signed();
            let expected = u64::from(id.wrapping_sub(before)).saturating_mul(period);
            let gap = arrival.0.saturating_sub(arrived.0);
            let near = |expected: u64| advance.abs_diff(expected.cast_signed());
            near(expected) <= period / 2
                || gap > expected.saturating_add(period / 2) && near(gap) <= period + period / 2
        });
        if plausible {
            self.stamped = Some((stamp, id, arrival));
        }
        plausible
    }

    /// Time stamps are not looked at any more: the next one begins anew.
    pub fn forget_stamps(&mut self) {
        self.stamped = None;
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

    pub fn is_timed_out(&self, now: MonotonicTime) -> bool {
        self.silence(now) > self.parameters.timeout_us.saturating_mul(1000)
    }

    pub fn node_control(&self) -> NodeControl {
        self.header.map_or(NodeControl::empty(), |h| h.node_control)
    }

    pub fn time_data_set(&self) -> TimeDataSet {
        self.header.map_or(TimeDataSet::empty(), |h| h.time_data_set())
    }

    // -- transmitting -------------------------------------------------------------------------------------------

    /// A C-to-D update asks for its answer. In synchronous mode the schedule goes on by itself.
    pub fn answer(&mut self, update_id: u8, now: MonotonicTime) {
        if self.mode == Mode::Synchronous {
            return;
        }
        if self.has_data() && update_id == self.sent_update_id && self.answer.is_none() {
            // The timer has sent this ID already: the update was late. The next one is due a period from here.
            self.next_transmit = MonotonicTime(now.0.saturating_add(self.period()));
            return;
        }
        self.answer = Some(update_id);
        self.next_transmit = now;
    }

    /// Schedules the first synchronous update for `in_ns` from now.
    pub fn synchronize(&mut self, update_id: u8, in_ns: u64, now: MonotonicTime) {
        self.mode = Mode::Pending {
            // The update that starts two cycles after the one of this command.
            first_update_id: update_id.wrapping_add(2),
            at: MonotonicTime(now.0.saturating_add(in_ns)),
        };
    }

    /// Aligns the schedule with a cycle that starts in `in_ns` or whole periods from it.
    pub fn align(&mut self, in_ns: i64, now: MonotonicTime) {
        if self.mode != Mode::Synchronous {
            return;
        }
        let period = i64::try_from(self.period()).unwrap_or(i64::MAX).max(1);
        // Negative when it is overdue, as it is whenever an update and a command meet in one cycle of the device.
        let planned = self.next_transmit.since(now).as_nanos();
        // The multiple of the period from that start which is nearest to the plan.
        let off = planned.saturating_sub(in_ns).rem_euclid(period);
        let correction = if off > period / 2 { period - off } else { -off };
        self.next_transmit = MonotonicTime(self.next_transmit.0.saturating_add_signed(correction));
    }

    /// An update was produced; `idle` is the head of one that has nothing to say. While there is nothing to say, the same
    /// packet is repeated to keep the connection alive (clause 7-1.1).
    pub fn transmitted(&mut self, idle: Option<[u8; 8]>) {
        if idle.is_none() || self.has_data() || idle != self.idle_header {
            self.transmit_sequence = self.transmit_sequence.wrapping_add(1);
        }
        self.idle_header = idle;
    }

    /// Goes back to asynchronous operation.
    pub fn desynchronize(&mut self) {
        self.mode = Mode::Asynchronous;
    }

    /// Time of the next D-to-C update.
    pub fn transmit_at(&self) -> MonotonicTime {
        match self.mode {
            Mode::Pending { at, .. } => at.min(self.next_transmit),
            _ => self.next_transmit,
        }
    }

    /// If a D-to-C update is due: its Update ID. Schedules the one after it.
    pub fn take_transmit(&mut self, now: MonotonicTime) -> Option<u8> {
        // This call is the nearest to what is due until then. Before the cycles are known, an update is the answer to
        // the controller's or comes after waiting for it, so that none goes early.
        let nearest = MonotonicTime(now.0.saturating_add(self.early));
        let due = match self.mode {
            Mode::Asynchronous => now >= self.next_transmit,
            Mode::Pending { at, .. } => now >= self.next_transmit || nearest >= at,
            Mode::Synchronous => nearest >= self.next_transmit,
        };
        if !due {
            return None;
        }
        let period = self.period();
        let answered = self.answer.take();
        let id = match self.mode {
            Mode::Pending { first_update_id, at } if nearest >= at => {
                self.mode = Mode::Synchronous;
                self.next_transmit = MonotonicTime(at.0.saturating_add(period));
                first_update_id
            }
            _ => {
                let next = self.next_transmit.0.saturating_add(period);
                // A schedule that has fallen behind starts anew instead of catching up in a burst.
                let behind = next <= now.0;
                self.next_transmit = MonotonicTime(if behind { now.0.saturating_add(period) } else { next });
                match answered {
                    Some(id) => id,
                    None if self.has_data() => self.sent_update_id.wrapping_add(1),
                    None => self.sent_update_id,
                }
            }
        };
        self.sent_update_id = id;
        Some(id)
    }

    /// When the connection has something to do at the latest.
    pub fn wake_at(&self) -> MonotonicTime {
        let timeout = self.parameters.timeout_us.saturating_mul(1000).saturating_add(1);
        self.transmit_at().min(MonotonicTime(self.last_heard.0.saturating_add(timeout)))
    }
}
