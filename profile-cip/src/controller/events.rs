//! Event checking as the controller does it, Tables 6-2.29 to 6-2.31.
//!
//! A bit that is armed stays in Event Checking Control until its event comes, with auto-rearm until it is disarmed. A
//! notification counts once, however often the device repeats it, and is acknowledged for as long as it is repeated. A bit
//! is armed again only after the device has shown that it has seen it clear.

use arrayvec::ArrayVec;

use crate::wire::motion::codes::EventChecking;
use crate::wire::motion::event::{ExtendedEventData, MAX_EVENTS};
use crate::wire::motion::{ActualEvents, CommandEvents, EventAck, EventNotification};

/// Parameters on their way to the device.
#[derive(Debug, Clone, Copy)]
struct Sending {
    parameters: ExtendedEventData,
    /// Update that brought them first.
    since: Option<u8>,
}

/// The event channel of one axis.
#[derive(Debug, Default)]
pub(super) struct EventChecks {
    open: bool,
    control: EventChecking,
    /// To be armed once their status bits are clear.
    next: EventChecking,
    sending: Option<Sending>,
    status: EventChecking,
    /// Notifications of the newest update; they have been reported.
    seen: ArrayVec<u8, MAX_EVENTS>,
}

/// The bits that go with an event: its own, window and auto-rearm.
fn all_of(event: EventChecking) -> EventChecking {
    event | event.windows() | event.rearms()
}

impl EventChecks {
    /// Arms events; what is still armed from before and has occurred is armed again when that is over.
    pub fn arm(&mut self, checking: EventChecking, parameters: Option<&ExtendedEventData>) {
        let open = self.control & EventChecking::EVENTS;
        let waits = checking & self.status & (EventChecking::EVENTS - open);
        self.next |= checking & all_of(waits);
        self.control |= checking - all_of(waits);
        if let Some(parameters) = parameters {
            let mut all = self.sending.map(|sending| sending.parameters).unwrap_or_default();
            all.update(parameters);
            self.sending = Some(Sending { parameters: all, since: None });
        }
    }

    /// Disarms events.
    pub fn disarm(&mut self, checking: EventChecking) {
        self.control -= checking | all_of(checking & EventChecking::EVENTS);
        self.next -= checking | all_of(checking & EventChecking::EVENTS);
    }

    /// What the device says it is checking.
    pub const fn status(&self) -> EventChecking {
        self.status
    }

    /// Takes the event block of an update, or that there is none. `received` is the last update that the device has
    /// received.
    pub fn handle(
        &mut self,
        block: Option<&ActualEvents>,
        received: u8,
        mut event: impl FnMut(EventNotification),
    ) {
        let seen = core::mem::take(&mut self.seen);
        self.status = block.map_or_else(EventChecking::empty, |block| block.checking);
        if let Some(block) = block {
            for notification in &block.notifications {
                self.seen.push(notification.event_id);
                if seen.contains(&notification.event_id) {
                    continue;
                }
                event(*notification);
                let bit = notification.event_type.checking().unwrap_or_default();
                let rearms = !bit.rearms().is_empty() && self.control.contains(bit.rearms());
                if notification.status != 0 || !rearms {
                    self.control -= all_of(bit);
                }
            }
            if let Some(Sending { parameters, since: Some(since) }) = self.sending {
                let arrived = received.wrapping_sub(since) <= u8::MAX / 2;
                if arrived && block.extended == Some(parameters.data_sets()) {
                    self.sending = None;
                }
            }
        }
        let ready = (self.next & EventChecking::EVENTS) - self.status;
        self.control |= self.next & all_of(ready);
        self.next -= all_of(ready);
    }

    /// Whether the channel is open: updates have a block for it, and services that much less room.
    pub const fn is_open(&self) -> bool {
        self.open
    }

    /// The event block of the update `update_id`; `None` closes the channel, once nothing is armed or on its way. A
    /// service that is under way counts on its room: meanwhile (`busy`) no channel opens and no parameters are sent.
    pub fn block(&mut self, update_id: u8, busy: bool) -> Option<CommandEvents> {
        let idle = self.control.is_empty() && self.next.is_empty() && self.status.is_empty();
        let idle = idle && self.sending.is_none() && self.seen.is_empty();
        self.open = !idle && (self.open || !busy);
        if !self.open {
            return None;
        }
        let extended = self.sending.as_mut().filter(|_| !busy).map(|sending| {
            sending.since.get_or_insert(update_id);
            sending.parameters
        });
        let acks = self.seen.iter().map(|event_id| EventAck { event_id: *event_id, status: 0 }).collect();
        Some(CommandEvents { checking: self.control, extended, acks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::axis::event_channel::EventChannel;
    use crate::wire::motion::codes::EventType;
    use crate::wire::motion::event::Window;
    use proptest::prelude::*;

    const REARM: EventChecking = EventChecking::REG_1_POSITIVE.union(EventChecking::REG_1_POSITIVE_REARM);

    /// Device and controller with a network between them that loses what it is told to.
    #[derive(Default)]
    struct Pair {
        checks: EventChecks,
        channel: EventChannel,
        update_id: u8,
        received: u8,
        told: Vec<EventNotification>,
    }

    impl Pair {
        fn new() -> Self {
            let mut pair = Self::default();
            pair.channel.support(EventChecking::EVENTS | EventChecking::WINDOWS);
            pair
        }

        fn cycle(&mut self, command_arrives: bool, actual_arrives: bool) {
            self.update_id = self.update_id.wrapping_add(1);
            let block = self.checks.block(self.update_id, false);
            if command_arrives {
                self.channel.handle(block.as_ref());
                self.channel.confirm(EventChecking::EVENTS);
                self.received = self.update_id;
            }
            let actual = self.channel.block();
            if actual_arrives {
                self.checks.handle(actual.as_ref(), self.received, |event| self.told.push(event));
            }
        }
    }

    #[test]
    fn a_single_event_is_told_once_and_ends_the_channel() {
        let mut pair = Pair::new();
        pair.checks.arm(EventChecking::HOME_POSITIVE, None);
        assert_eq!(pair.checks.status(), EventChecking::empty());
        pair.cycle(true, true);
        assert_eq!(pair.checks.status(), EventChecking::HOME_POSITIVE);
        assert!(pair.channel.notify(EventType::HOME_POSITIVE, 0, 5, 6));
        pair.cycle(true, true);
        assert_eq!(pair.told.len(), 1);
        // Armed again while the old cycle is not over: the device has to see the bit clear first.
        pair.checks.arm(EventChecking::HOME_POSITIVE, None);
        let block = pair.checks.block(0, false).expect("open");
        assert_eq!((block.checking, block.acks.len()), (EventChecking::empty(), 1));
        pair.cycle(true, true);
        pair.cycle(true, true);
        assert_eq!(pair.checks.status(), EventChecking::HOME_POSITIVE);
        assert!(pair.channel.notify(EventType::HOME_POSITIVE, 0, 7, 8));
        for _ in 0..3 {
            pair.cycle(true, true);
        }
        assert_eq!(pair.told.iter().map(|event| event.position).collect::<Vec<_>>(), [5, 7]);
        assert_eq!((pair.checks.block(0, false), pair.checks.status()), (None, EventChecking::empty()));
    }

    #[test]
    fn parameters_are_sent_until_the_device_has_received_them() {
        let mut pair = Pair::new();
        let window = |max| ExtendedEventData {
            windows: [Some(Window { max, min: 0 }), None, None, None],
            ..ExtendedEventData::default()
        };
        let bits = REARM | EventChecking::REG_1_POSITIVE_WINDOW;
        pair.checks.arm(bits, Some(&window(5)));
        pair.cycle(true, false);
        // Other limits in the same data set: the acknowledgement of the first ones must not count for them.
        pair.checks.arm(bits, Some(&window(9)));
        pair.cycle(false, true);
        assert_eq!(pair.channel.parameters().windows[0].map(|w| w.max), Some(5));
        assert!(pair.checks.block(pair.update_id, false).is_some_and(|block| block.extended.is_some()));
        pair.cycle(true, true);
        assert_eq!(pair.channel.parameters().windows[0].map(|w| w.max), Some(9));
        assert!(pair.checks.block(0, false).is_some_and(|block| block.extended.is_none()));
        assert_eq!(pair.checks.status(), bits);
        pair.checks.disarm(bits);
        for _ in 0..3 {
            pair.cycle(true, true);
        }
        assert_eq!(pair.checks.block(0, false), None);
    }

    proptest! {
        /// Whatever is lost on the way, every event that the device took is reported once and in order.
        #[test]
        fn no_event_is_lost_or_doubled(
            losses in prop::collection::vec((any::<bool>(), any::<bool>(), 0..4_usize), 1..600),
        ) {
            let mut pair = Pair::new();
            let mut taken = Vec::new();
            pair.checks.arm(REARM | EventChecking::MARKER_POSITIVE, None);
            for (place, (command, actual, events)) in (0..).zip(losses) {
                pair.cycle(command, actual);
                for _ in 0..events {
                    if pair.channel.notify(EventType::REGISTRATION_1_POSITIVE, 0, place, 1) {
                        taken.push(place);
                    }
                }
                if pair.channel.notify(EventType::MARKER_POSITIVE, 0, place, 1) {
                    taken.push(place);
                }
                pair.checks.arm(EventChecking::MARKER_POSITIVE, None);
            }
            for _ in 0..20 {
                pair.cycle(true, true);
            }
            prop_assert_eq!(pair.told.iter().map(|event| event.position).collect::<Vec<_>>(), taken);
        }
    }
}
