//! The event channel of an axis, Tables 6-2.29 to 6-2.31: arming, notifications, acknowledgements.

use arrayvec::ArrayVec;

use crate::wire::motion::codes::{EventChecking, EventType};
use crate::wire::motion::event::{ExtendedAck, ExtendedEventData, MAX_EVENTS};
use crate::wire::motion::{ActualEvents, CommandEvents, EventNotification};

/// The bit that arms an event type.
fn checking_bit(event: EventType) -> Option<EventChecking> {
    Some(match event.0 {
        code @ 0..=3 => EventChecking::from_bits_retain(1 << code),
        code @ 4..=12 => EventChecking::from_bits_retain(1 << (code + 12)),
        code @ 13..=16 => EventChecking::from_bits_retain(1 << (code - 1)),
        _ => return None,
    })
}

/// The auto-rearm bit of an armed bit; only the four registration edges have one.
fn rearm_bit(bit: EventChecking) -> EventChecking {
    EventChecking::from_bits_retain((bit.bits() & 0b1111) << 8)
}

/// State of the channel.
#[derive(Debug, Clone, Default)]
pub(super) struct EventChannel {
    supported: EventChecking,
    open: bool,
    control: EventChecking,
    /// Events that have occurred and are not checked again until their control bit goes off.
    fired: EventChecking,
    extended: ExtendedEventData,
    ack: Option<ExtendedAck>,
    queue: ArrayVec<EventNotification, MAX_EVENTS>,
    last_id: u8,
}

impl EventChannel {
    /// A closed channel for a drive that can check for `supported` events.
    pub fn new(supported: EventChecking) -> Self {
        Self { supported, ..Self::default() }
    }

    /// Takes the event block of an update, or its absence, which closes the channel.
    pub fn handle(&mut self, block: Option<&CommandEvents>) {
        let Some(block) = block else {
            let last_id = self.last_id;
            *self = Self { last_id, ..Self::new(self.supported) };
            return;
        };
        self.open = true;
        self.control = block.checking;
        self.fired &= block.checking;
        for ack in block.acks.iter().filter(|ack| ack.status == 0) {
            self.queue.retain(|n| n.event_id != ack.event_id);
        }
        self.ack = block.extended.map(|data| {
            self.extended = data;
            data.data_sets()
        });
    }

    /// Event Checking Status: what the controller has armed and the drive can check.
    pub fn status(&self) -> EventChecking {
        let supported = self.supported | rearm_bit(self.supported);
        self.control & supported
    }

    /// Event Checking Control as it came.
    pub fn control(&self) -> EventChecking {
        self.control
    }

    /// What the drive has to look for now.
    pub fn armed(&self) -> EventChecking {
        self.status() - self.fired
    }

    /// Parameters of extended checking.
    pub fn parameters(&self) -> &ExtendedEventData {
        &self.extended
    }

    /// An event occurred. Returns whether it was armed and is now on its way.
    pub fn notify(&mut self, event: EventType, status: u8, position: i32, time_stamp: u64) -> bool {
        let Some(bit) = checking_bit(event) else { return false };
        if !self.armed().contains(bit) || self.queue.is_full() {
            return false;
        }
        if !self.control.contains(rearm_bit(bit)) || rearm_bit(bit).is_empty() {
            self.fired |= bit;
        }
        self.last_id = self.last_id.wrapping_add(1);
        let (position, time_stamp) = if status == 0 { (position, time_stamp) } else { (0, 0) };
        self.queue.push(EventNotification {
            event_id: self.last_id,
            status,
            event_type: event,
            position,
            time_stamp,
        });
        true
    }

    /// The event block for the next D-to-C update.
    pub fn block(&self) -> Option<ActualEvents> {
        self.open.then(|| ActualEvents {
            checking: self.status(),
            extended: self.ack,
            notifications: self.queue.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::motion::EventAck;

    fn block(checking: EventChecking, acks: &[(u8, u8)]) -> CommandEvents {
        let acks =
            acks.iter().map(|(event_id, status)| EventAck { event_id: *event_id, status: *status }).collect();
        CommandEvents { checking, extended: None, acks }
    }

    fn ids(channel: &EventChannel) -> Vec<u8> {
        channel.block().expect("open").notifications.iter().map(|n| n.event_id).collect()
    }

    #[test]
    fn basic_cycle_of_table_6_2_29() {
        let home = EventChecking::HOME_POSITIVE;
        let mut channel = EventChannel::new(home | EventChecking::MARKER_POSITIVE);
        assert_eq!(channel.block(), None);
        assert!(!channel.notify(EventType::HOME_POSITIVE, 0, 1, 1), "not armed");
        channel.handle(Some(&block(home | EventChecking::HOME_TORQUE, &[])));
        assert_eq!(channel.status(), home, "torque is not supported");
        assert!(channel.notify(EventType::HOME_POSITIVE, 0, -5, 99));
        assert!(!channel.notify(EventType::HOME_POSITIVE, 0, -6, 100), "no rearm: one event");
        assert_eq!((channel.armed(), channel.status()), (EventChecking::empty(), home));
        let note = channel.block().expect("open").notifications[0];
        assert_eq!((note.event_id, note.position, note.time_stamp), (1, -5, 99));
        channel.handle(Some(&block(home, &[(1, 3)])));
        assert_eq!(ids(&channel), [1], "a bad acknowledge asks for it again");
        channel.handle(Some(&block(EventChecking::empty(), &[(1, 0)])));
        assert_eq!((channel.status(), ids(&channel)), (EventChecking::empty(), vec![]));
        channel.handle(Some(&block(home, &[])));
        assert!(channel.notify(EventType::HOME_POSITIVE, 7, -5, 99), "armed again");
        let note = channel.block().expect("open").notifications[0];
        assert_eq!((note.event_id, note.status, note.position, note.time_stamp), (2, 7, 0, 0));
        channel.handle(None);
        assert_eq!(channel.block(), None);
    }

    #[test]
    fn auto_rearm_keeps_checking() {
        // Table 6-2.31.
        let bits = EventChecking::REG_2_NEGATIVE | EventChecking::REG_2_NEGATIVE_REARM;
        let mut channel = EventChannel::new(EventChecking::REG_2_NEGATIVE);
        channel.handle(Some(&block(bits, &[])));
        assert_eq!(channel.status(), bits);
        for _ in 0..MAX_EVENTS {
            assert!(channel.notify(EventType::REGISTRATION_2_NEGATIVE, 0, 0, 0));
        }
        assert!(!channel.notify(EventType::REGISTRATION_2_NEGATIVE, 0, 0, 0), "the block is full");
        channel.handle(Some(&block(bits, &[(1, 0), (3, 0)])));
        assert_eq!(ids(&channel), [2, 4, 5, 6, 7]);
        assert!(channel.notify(EventType::REGISTRATION_2_NEGATIVE, 0, 0, 0));
    }

    #[test]
    fn every_event_type_has_the_bit_of_its_name() {
        let named = |bits: EventChecking| bits.iter().next().map(|b| b.to_string());
        let pairs = [
            (EventType::REGISTRATION_1_NEGATIVE, "Reg 1 Neg Edge"),
            (EventType::MARKER_POSITIVE, "Marker Pos Edge"),
            (EventType::HOME_NEGATIVE, "Home Switch Neg Edge"),
            (EventType::HOME_MARKER_NN, "Home Switch-Marker --"),
            (EventType::HOME_TORQUE, "Home Torque Threshold"),
            (EventType::WATCH_1_FORWARD, "Watch Position 1 Fwd"),
            (EventType::WATCH_2_REVERSE, "Watch Position 2 Rev"),
        ];
        for (event, name) in pairs {
            assert_eq!(checking_bit(event).and_then(named).as_deref(), Some(name));
        }
        assert_eq!(checking_bit(EventType(17)), None);
    }

    #[test]
    fn extended_parameters_are_acknowledged_in_the_update_after() {
        let data = ExtendedEventData { watch_positions: [Some(5), None], ..ExtendedEventData::default() };
        let mut channel = EventChannel::new(EventChecking::WATCH_1_FORWARD);
        let mut events = block(EventChecking::WATCH_1_FORWARD, &[]);
        events.extended = Some(data);
        channel.handle(Some(&events));
        assert_eq!(channel.block().and_then(|b| b.extended), Some(data.data_sets()));
        assert_eq!(channel.parameters(), &data);
        events.extended = None;
        channel.handle(Some(&events));
        assert_eq!(channel.block().and_then(|b| b.extended), None);
        assert_eq!(channel.parameters(), &data, "the parameters stay");
    }
}
