//! Network access: the duplicate MAC ID check before a node is on line, and its guard afterwards.
//!
//! | | checking | on line | communication fault | off |
//! |---|---|---|---|---|
//! | begun | | | | checking: request sent |
//! | 1 s after the first request | checking: request sent again | | | |
//! | 1 s after the second | on line | | | |
//! | request for this MAC ID | communication fault | response sent | | |
//! | response for this MAC ID | communication fault | communication fault | | |
//! | bus off, held (BOI 0) | communication fault | communication fault | | |
//! | bus off, reset (BOI 1) | checking anew | checking anew | | |
//! | reset, or another MAC ID | checking anew | checking anew | checking anew | checking |
//!
//! A request that comes while a node checks is a node that wants the same MAC ID at the same time: both go to
//! communication fault. A frame that this node has sent itself must not be handed over.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::wire::DuplicateMac;

/// Time from one request to the next, and from the second to on line.
pub const CHECK_WAIT: DurationNs = DurationNs::from_secs(1);

/// Where a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AccessState {
    /// Not begun.
    #[default]
    Off,
    /// So many requests are sent, 0 to 2.
    Checking(u8),
    /// On line.
    Online,
    /// Another node has the MAC ID, or the bus is off; only a reset ends it.
    Faulted,
}

/// What happens to a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AccessEvent {
    /// Switched on, reset, or given another MAC ID.
    Begin,
    /// The wait is over.
    Waited,
    /// A duplicate MAC ID check request for this MAC ID.
    Request,
    /// A duplicate MAC ID check response for this MAC ID.
    Response,
    /// The controller has left the bus; `reset` takes it back.
    BusOff {
        /// Bus-off interrupt attribute (BOI).
        reset: bool,
    },
}

impl AccessState {
    /// What comes of an event, and whether a response is to be sent.
    #[must_use]
    pub const fn next(self, event: AccessEvent) -> (Self, bool) {
        use AccessEvent as E;
        match (self, event) {
            (_, E::Begin) => (Self::Checking(0), false),
            (Self::Checking(2), E::Waited) => (Self::Online, false),
            (Self::Checking(_), E::Request | E::Response) | (Self::Online, E::Response) => {
                (Self::Faulted, false)
            }
            (Self::Online, E::Request) => (Self::Online, true),
            (Self::Checking(_) | Self::Online, E::BusOff { reset: true }) => (Self::Checking(0), false),
            (Self::Checking(_) | Self::Online, E::BusOff { reset: false }) => (Self::Faulted, false),
            (state, _) => (state, false),
        }
    }
}

/// The check of one node.
#[derive(Debug, Clone)]
pub struct NetworkAccess {
    state: AccessState,
    vendor: u16,
    serial: u32,
    deadline: MonotonicTime,
    respond: bool,
}

impl NetworkAccess {
    /// A node that is off.
    #[must_use]
    pub const fn new(vendor: u16, serial: u32) -> Self {
        Self { state: AccessState::Off, vendor, serial, deadline: MonotonicTime::ZERO, respond: false }
    }

    /// Where the node is.
    #[must_use]
    pub const fn state(&self) -> AccessState {
        self.state
    }

    /// Whether it is on line.
    #[must_use]
    pub fn is_online(&self) -> bool {
        self.state == AccessState::Online
    }

    /// Takes an event. Whether the state has changed.
    pub fn event(&mut self, event: AccessEvent) -> bool {
        let (next, respond) = self.state.next(event);
        self.respond = next == AccessState::Online && (self.respond || respond);
        core::mem::replace(&mut self.state, next) != next
    }

    /// Takes a message for this node's MAC ID. Whether it has faulted the node.
    pub fn handle(&mut self, message: &DuplicateMac) -> bool {
        let event = if message.response { AccessEvent::Response } else { AccessEvent::Request };
        self.event(event) && self.state == AccessState::Faulted
    }

    /// Lets time pass and gives the message that is to be sent. Whether the node is on line now is told by the state.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<DuplicateMac> {
        if core::mem::take(&mut self.respond) {
            return Some(self.message(true));
        }
        match self.state {
            AccessState::Checking(0) => {}
            AccessState::Checking(_) if now < self.deadline => return None,
            AccessState::Checking(2) => {
                self.event(AccessEvent::Waited);
                return None;
            }
            AccessState::Checking(_) => {}
            _ => return None,
        }
        self.state = AccessState::Checking(if self.state == AccessState::Checking(0) { 1 } else { 2 });
        self.deadline = now + CHECK_WAIT;
        Some(self.message(false))
    }

    const fn message(&self, response: bool) -> DuplicateMac {
        DuplicateMac { response, port: 0, vendor: self.vendor, serial: self.serial }
    }

    /// When [`Self::poll`] has something to do.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        match self.state {
            _ if self.respond => Some(MonotonicTime::ZERO),
            AccessState::Checking(0) => Some(MonotonicTime::ZERO),
            AccessState::Checking(_) => Some(self.deadline),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use core::fmt::Write as _;

    use super::*;

    #[test]
    fn every_state_and_event() {
        use AccessState::{Checking, Faulted, Off, Online};
        let events = [
            AccessEvent::Begin,
            AccessEvent::Waited,
            AccessEvent::Request,
            AccessEvent::Response,
            AccessEvent::BusOff { reset: false },
            AccessEvent::BusOff { reset: true },
        ];
        let mut text = String::new();
        for state in [Off, Checking(0), Checking(1), Checking(2), Online, Faulted] {
            for event in events {
                let (next, respond) = state.next(event);
                let respond = if respond { ", response sent" } else { "" };
                writeln!(text, "{state:?} {event:?} -> {next:?}{respond}").unwrap();
            }
        }
        insta::assert_snapshot!(text);
    }

    fn ms(millis: u64) -> MonotonicTime {
        MonotonicTime(millis * 1_000_000)
    }

    fn online() -> NetworkAccess {
        let mut access = NetworkAccess::new(0x123, 7);
        access.event(AccessEvent::Begin);
        for millis in [0, 1000, 2000] {
            access.poll(ms(millis));
        }
        assert!(access.is_online());
        access
    }

    #[test]
    fn two_requests_a_second_apart_and_then_on_line() {
        let mut access = NetworkAccess::new(0x123, 7);
        assert_eq!((access.poll(ms(0)), access.wake_at()), (None, None));
        access.event(AccessEvent::Begin);
        let request = DuplicateMac { response: false, port: 0, vendor: 0x123, serial: 7 };
        assert_eq!(access.poll(ms(50)), Some(request));
        assert_eq!((access.poll(ms(1049)), access.wake_at()), (None, Some(ms(1050))));
        assert_eq!(access.poll(ms(1050)), Some(request));
        assert_eq!((access.poll(ms(2049)), access.is_online()), (None, false));
        assert_eq!((access.poll(ms(2050)), access.is_online()), (None, true));
        assert_eq!(access.wake_at(), None);
    }

    #[test]
    fn who_is_on_line_defends_its_mac_id_and_gives_way_to_an_answer() {
        let mut access = online();
        let other = DuplicateMac { response: false, port: 0, vendor: 9, serial: 9 };
        assert!(!access.handle(&other));
        let answer = access.poll(ms(3000)).unwrap();
        assert_eq!((answer.response, answer.vendor, answer.serial), (true, 0x123, 7));
        assert_eq!(access.poll(ms(3000)), None, "once");
        // Two segments that were joined: both are on line, and one hears the other's answer.
        assert!(access.handle(&DuplicateMac { response: true, ..other }));
        assert_eq!((access.state(), access.poll(ms(9000))), (AccessState::Faulted, None));
    }

    #[test]
    fn two_that_check_at_once_both_fail() {
        let mut access = NetworkAccess::new(1, 1);
        access.event(AccessEvent::Begin);
        access.poll(ms(0));
        assert!(access.handle(&DuplicateMac { response: false, port: 0, vendor: 2, serial: 2 }));
        assert_eq!(access.poll(ms(5000)), None);
        access.event(AccessEvent::Begin);
        assert!(access.poll(ms(6000)).is_some(), "a reset begins anew");
    }
}
