//! The event channel of an axis, Tables 6-2.29 to 6-2.31: arming, notifications, acknowledgements.
//!
//! ```text
//! Event Checking bit   C-to-D set and checkable -> WANTED -> the drive looks for it -> CHECKING (status bit set)
//!                      event, no auto-rearm     -> FIRED (status bit stays, nothing is looked for)
//!                      C-to-D clear             -> off, and the status bit with it
//! notification         event -> pending, sent in every update -> acknowledged with status 0 -> gone
//! ```
//!
//! A bit is not checkable, and its status bit stays clear, if the drive cannot look for the event or if a parameter of it
//! has never come: the window of a registration edge, a watch position, the torque threshold. A registration edge whose
//! window cannot be checked is not checked at all.

use arrayvec::ArrayVec;

use crate::device::attribute::id;
use crate::wire::motion::codes::{EventChecking, EventType};
use crate::wire::motion::event::{ExtendedAck, ExtendedEventData, MAX_EVENTS};
use crate::wire::motion::{ActualEvents, CommandEvents, EventNotification};

/// Notifications that wait to be acknowledged; what occurs beyond that is lost. One of each of the 17 event types, and
/// nearly as many again from auto-rearm.
pub const PENDING_MAX: usize = 32;

/// What an event channel has counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EventCounters {
    /// Events told to the controller, errors among them.
    pub notified: u64,
    /// Registration edges outside of their window: not told.
    pub outside_window: u64,
    /// Events lost because the controller acknowledged none of [`PENDING_MAX`] before.
    pub lost: u64,
}

/// Positions and times of the last events, attributes 62 to 73.
#[derive(Debug, Clone, Copy, Default)]
struct Captured {
    registration: [(i32, u64); 4],
    home: (i32, u64),
    watch: [u64; 2],
}

impl Captured {
    fn take(&mut self, event: EventType, position: i32, time: u64) {
        match event.0 {
            edge @ 0..=3 => self.registration[usize::from(edge)] = (position, time),
            4..=12 => self.home = (position, time),
            13 | 14 => self.watch[0] = time,
            15 | 16 => self.watch[1] = time,
            _ => {}
        }
    }
}

/// State of the channel.
#[derive(Debug, Clone, Default)]
pub(crate) struct EventChannel {
    supported: EventChecking,
    open: bool,
    control: EventChecking,
    /// First word of the last C-to-D block.
    control_word: u32,
    /// What the drive has been looking for since its bit was set.
    confirmed: EventChecking,
    /// Events that have occurred and are not checked again until their control bit goes off.
    fired: EventChecking,
    parameters: ExtendedEventData,
    data_sets: ExtendedAck,
    ack: Option<ExtendedAck>,
    pending: ArrayVec<EventNotification, PENDING_MAX>,
    last_id: u8,
    captured: Captured,
    counters: EventCounters,
}

impl EventChannel {
    /// A connection begins or ends: nothing is armed and no event has occurred. Event IDs and counters go on.
    pub fn reset(&mut self) {
        let Self { supported, last_id, counters, .. } = *self;
        *self = Self { supported, last_id, counters, ..Self::default() };
    }

    /// Takes the event block of an update, or its absence, which closes the channel.
    pub fn handle(&mut self, block: Option<&CommandEvents>) {
        let Some(block) = block else {
            let captured = self.captured;
            self.reset();
            self.captured = captured;
            return;
        };
        self.open = true;
        self.control = block.checking;
        self.control_word = block.word();
        self.fired &= block.checking;
        for ack in block.acks.iter().filter(|ack| ack.status == 0) {
            self.pending.retain(|n| n.event_id != ack.event_id);
        }
        self.ack = block.extended.map(|data| {
            self.parameters.update(&data);
            self.data_sets = data.data_sets();
            self.data_sets
        });
        self.confirmed &= self.wanted();
    }

    /// Tells what can be checked for.
    pub fn support(&mut self, supported: EventChecking) {
        self.supported = supported;
        self.confirmed &= self.wanted();
    }

    /// Tells what is being looked for.
    pub fn confirm(&mut self, checking: EventChecking) {
        self.confirmed |= checking & self.wanted();
    }

    /// Events that the controller has armed and that can be checked for.
    fn wanted(&self) -> EventChecking {
        let mut wanted = self.control & self.supported & EventChecking::EVENTS;
        for (number, window) in self.parameters.windows.iter().enumerate() {
            let edge = EventChecking::from_bits_retain(1 << number);
            let known = self.supported.contains(edge.windows()) && window.is_some();
            if self.control.contains(edge.windows()) && !known {
                wanted -= edge;
            }
        }
        let watch_1 = EventChecking::WATCH_1_FORWARD | EventChecking::WATCH_1_REVERSE;
        let watch_2 = EventChecking::WATCH_2_FORWARD | EventChecking::WATCH_2_REVERSE;
        let [first, second] = self.parameters.watch_positions;
        let torque = self.parameters.home_torque_threshold;
        for (bits, known) in [
            (watch_1, first.is_some()),
            (watch_2, second.is_some()),
            (EventChecking::HOME_TORQUE, torque.is_some()),
        ] {
            if !known {
                wanted -= bits;
            }
        }
        wanted
    }

    /// Event Checking Status: what is being checked for, or has occurred and is still armed.
    pub fn status(&self) -> EventChecking {
        let events = self.control & (self.confirmed | self.fired) & EventChecking::EVENTS;
        events | (self.control & (events.windows() | events.rearms()))
    }

    /// What has to be looked for now.
    pub fn armed(&self) -> EventChecking {
        self.wanted() - self.fired
    }

    /// Whether an event is being looked for, and has been since before the actual values of this moment.
    pub fn is_checking(&self, event: EventType) -> bool {
        event.checking().is_some_and(|bit| (self.armed() & self.confirmed).contains(bit))
    }

    /// Parameters of extended checking.
    pub fn parameters(&self) -> &ExtendedEventData {
        &self.parameters
    }

    pub fn counters(&self) -> EventCounters {
        self.counters
    }

    /// Values of the attributes 60 to 73 and 95 to 97.
    pub fn attributes(&self) -> impl Iterator<Item = (u16, u64)> {
        let status = self.block().map_or(0, |block| block.word());
        let position = |position: i32| u64::from(position.cast_unsigned());
        let Captured { registration, home, watch } = self.captured;
        let sets = self.data_sets;
        let positions = (id::REGISTRATION_POSITION..).zip(registration.map(|(place, _)| position(place)));
        let times = (id::REGISTRATION_TIME..).zip(registration.map(|(_, time)| time));
        [
            (id::EVENT_CHECKING_CONTROL, u64::from(self.control_word)),
            (id::EVENT_CHECKING_STATUS, u64::from(status)),
            (id::HOME_EVENT_POSITION, position(home.0)),
            (id::HOME_EVENT_TIME, home.1),
            (id::REGISTRATION_DATA_SET, u64::from(sets.registration)),
            (id::HOME_DATA_SET, u64::from(sets.home)),
            (id::WATCH_DATA_SET, u64::from(sets.watch)),
        ]
        .into_iter()
        .chain(positions)
        .chain(times)
        .chain((id::WATCH_EVENT_TIME..).zip(watch))
    }

    /// An event occurred, or cannot be found for the reason `status`, which then is not 0. Returns whether it was armed
    /// and is now on its way.
    pub fn notify(&mut self, event: EventType, status: u8, position: i32, time_stamp: u64) -> bool {
        let Some(bit) = event.checking().filter(|bit| self.armed().contains(*bit)) else { return false };
        let (position, time_stamp) = if status == 0 { (position, time_stamp) } else { (0, 0) };
        if status == 0 && !self.is_within(bit, position) {
            self.counters.outside_window += 1;
            return false;
        }
        if self.pending.is_full() {
            self.counters.lost += 1;
            return false;
        }
        let rearms = !bit.rearms().is_empty() && self.control.contains(bit.rearms());
        if status != 0 || !rearms {
            self.fired |= bit;
        }
        if status == 0 {
            self.captured.take(event, position, time_stamp);
        }
        self.counters.notified += 1;
        self.last_id = self.last_id.wrapping_add(1);
        self.pending.push(EventNotification {
            event_id: self.last_id,
            status,
            event_type: event,
            position,
            time_stamp,
        });
        true
    }

    /// The device's System Time Offset has changed by so much, ns: events that wait to be told are stamped in the system
    /// time of before, and are told in that of now (clause 5-2.6.7.3). So are those that the attributes tell.
    pub fn shift(&mut self, offset: i64) {
        let notified = self.pending.iter_mut().map(|event| &mut event.time_stamp);
        let Captured { registration, home, watch } = &mut self.captured;
        let captured = registration.iter_mut().map(|(_, time)| time).chain([&mut home.1]).chain(watch);
        // 0 is no time: an event that cannot be found, or that never was.
        for time in notified.chain(captured).filter(|time| **time != 0) {
            *time = time.saturating_add_signed(offset);
        }
    }

    /// Whether a position passes the window check of a registration edge, if there is one.
    fn is_within(&self, bit: EventChecking, position: i32) -> bool {
        let windowed = bit.windows();
        if windowed.is_empty() || !self.control.contains(windowed) {
            return true;
        }
        let number = usize::try_from(bit.bits().trailing_zeros()).unwrap_or(usize::MAX);
        let window = self.parameters.windows.get(number).copied().flatten();
        window.is_some_and(|window| window.contains(position))
    }

    /// The event block for the next D-to-C update: the oldest events that are not acknowledged.
    pub fn block(&self) -> Option<ActualEvents> {
        self.open.then(|| ActualEvents {
            checking: self.status(),
            extended: self.ack,
            notifications: self.pending.iter().take(MAX_EVENTS).copied().collect(),
        })
    }
}

#[cfg(test)]
mod tests;
