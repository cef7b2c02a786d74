//! The consumer of a connection: judges from cycle to cycle whether the values are new.
//!
//! ```text
//! Prepare --ready--> Waiting --new data--> Consuming <--> Warning --too many losses--> Error
//!    ^-- not ready ----+                      |  ^
//!                                             v  |
//!                                            Stopped (flow control)
//! ```
//!
//! A producer may count, or only toggle its new-data bit. Once a counter other than 0 has been seen the counter
//! is judged, before that the toggle bit. Error lasts until the connection is started again in CP4.

use core::fmt;

use crate::wire::connection::ConnectionControl;

/// State of a consumer, from the toggle and counter of its C-CON.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConsumerState {
    /// The producer is not ready.
    Prepare,
    /// The producer is ready, nothing has been produced yet.
    Waiting,
    /// Every value came when it was due.
    Consuming,
    /// Values are missing, fewer in a row than permitted.
    Warning,
    /// More values in a row were missing than S-0-1050.x.11 permits.
    Error,
    /// The producer has stopped by flow control.
    Stopped,
}

/// What a cycle brings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConsumerEvent {
    /// The producer is not ready, or takes its readiness back.
    NotReady,
    /// The producer is ready and has not produced.
    NoData,
    /// The expected value.
    NewData,
    /// Another value than the expected one: values in between were lost.
    Skipped,
    /// Flow control.
    Stop,
    /// The losses in a row are more than permitted.
    LossLimit,
}

impl ConsumerState {
    /// The state after `event`.
    #[must_use]
    pub const fn next(self, event: ConsumerEvent) -> ConsumerState {
        use ConsumerEvent as E;
        use ConsumerState as S;
        match (self, event) {
            (S::Error, _) => S::Error,
            (S::Prepare | S::Waiting | S::Stopped, E::NotReady) => S::Prepare,
            (S::Prepare | S::Waiting, E::NoData | E::LossLimit) => S::Waiting,
            (S::Prepare | S::Waiting | S::Stopped, E::NewData | E::Skipped) => S::Consuming,
            (S::Stopped, E::NoData | E::LossLimit) => S::Stopped,
            (_, E::Stop) => S::Stopped,
            (S::Consuming | S::Warning, E::NewData) => S::Consuming,
            (S::Consuming | S::Warning, E::NotReady | E::NoData | E::Skipped) => S::Warning,
            (S::Consuming | S::Warning, E::LossLimit) => S::Error,
        }
    }
}

impl fmt::Display for ConsumerState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ConsumerState::Prepare => "prepare",
            ConsumerState::Waiting => "waiting",
            ConsumerState::Consuming => "consuming",
            ConsumerState::Warning => "warning",
            ConsumerState::Error => "error",
            ConsumerState::Stopped => "stopped",
        })
    }
}

/// Judges the C-CON of a consumed connection, cycle by cycle.
#[derive(Debug, Clone, Copy)]
pub struct Consumer {
    state: ConsumerState,
    /// C-CON of the last accepted value.
    last: ConnectionControl,
    counts: bool,
    losses: u16,
    losses_max: u16,
    losses_total: u16,
    /// Cycles from one production to the next, and cycles since the last one.
    interval: u16,
    age: u16,
}

impl Consumer {
    /// A consumer that permits `losses_max` losses in a row of a producer which produces every `interval`
    /// cycles (at least 1).
    pub const fn new(losses_max: u16, interval: u16) -> Self {
        Consumer {
            state: ConsumerState::Prepare,
            last: ConnectionControl::empty(),
            counts: false,
            losses: 0,
            losses_max,
            losses_total: 0,
            interval: if interval == 0 { 1 } else { interval },
            age: 0,
        }
    }

    /// Back to the beginning, with the same limits.
    pub fn restart(&mut self) {
        *self = Consumer::new(self.losses_max, self.interval);
    }

    /// The state.
    pub const fn state(&self) -> ConsumerState {
        self.state
    }

    /// C-CON of the last accepted value.
    pub const fn control(&self) -> ConnectionControl {
        self.last
    }

    /// Lost values since CP4 began, S-0-1050.x.12.
    pub const fn losses_total(&self) -> u16 {
        self.losses_total
    }

    /// A cycle without the telegram of the connection.
    pub fn miss(&mut self) {
        self.lose(ConsumerEvent::NoData);
    }

    /// Takes the C-CON of this cycle. Returns whether the values behind it are new and to be used.
    pub fn handle(&mut self, control: ConnectionControl) -> bool {
        if control.contains(ConnectionControl::STOPPED) {
            self.losses = 0;
            self.state = self.state.next(ConsumerEvent::Stop);
            return false;
        }
        if !control.contains(ConnectionControl::READY) {
            self.lose(ConsumerEvent::NotReady);
            return false;
        }
        self.counts |= control.counter() != 0;
        let started = matches!(self.state, ConsumerState::Consuming | ConsumerState::Warning);
        let toggled = (control ^ self.last).contains(ConnectionControl::NEW_DATA);
        let steps = control.counter().wrapping_sub(self.last.counter()) & 0xF;
        let new = match (started, self.counts) {
            (true, true) => steps != 0,
            (true, false) => toggled,
            (false, true) => true,
            (false, false) => control.contains(ConnectionControl::NEW_DATA),
        };
        if !new || self.state == ConsumerState::Error {
            self.lose(ConsumerEvent::NoData);
            return false;
        }
        let skipped = started && self.counts && steps != 1;
        if skipped {
            self.losses_total = self.losses_total.saturating_add(1);
        }
        self.losses = 0;
        self.age = 0;
        self.last = control;
        self.state = self.state.next(if skipped { ConsumerEvent::Skipped } else { ConsumerEvent::NewData });
        true
    }

    fn lose(&mut self, event: ConsumerEvent) {
        let mut event = event;
        if matches!(self.state, ConsumerState::Consuming | ConsumerState::Warning) {
            self.age = self.age.saturating_add(1);
            if event == ConsumerEvent::NoData && !self.age.is_multiple_of(self.interval) {
                // The producer's next value is not due yet.
                return;
            }
            self.losses = self.losses.saturating_add(1);
            self.losses_total = self.losses_total.saturating_add(1);
            if self.losses > self.losses_max {
                event = ConsumerEvent::LossLimit;
            }
        }
        self.state = self.state.next(event);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_table() {
        use ConsumerEvent as E;
        use ConsumerState as S;
        let states = [S::Prepare, S::Waiting, S::Consuming, S::Warning, S::Error, S::Stopped];
        let events = [E::NotReady, E::NoData, E::NewData, E::Skipped, E::Stop, E::LossLimit];
        let mut table = String::new();
        for state in states {
            for event in events {
                table += &format!("{state} + {event:?} -> {}\n", state.next(event));
            }
        }
        insta::assert_snapshot!(table);
    }

    /// C-CON words of recording sercos3_startup_line2, MDT0 of CP4: frames 5223, 5227, 5231, 5235, 5239.
    #[test]
    fn a_counting_producer_of_the_recording() {
        let mut consumer = Consumer::new(10, 1);
        let words = [0x0000, 0x0001, 0x1003, 0x2001, 0x3003];
        let fresh = words.map(|word| consumer.handle(ConnectionControl::from_bits_retain(word)));
        assert_eq!(fresh, [false, false, true, true, true]);
        assert_eq!(consumer.state(), ConsumerState::Consuming);
        // The same word again is a loss, the next one but one as well, and then all is well again.
        assert!(!consumer.handle(ConnectionControl::from_bits_retain(0x3003)));
        assert_eq!(consumer.state(), ConsumerState::Warning);
        assert!(consumer.handle(ConnectionControl::from_bits_retain(0x5003)));
        assert_eq!((consumer.state(), consumer.losses_total()), (ConsumerState::Warning, 2));
        assert!(consumer.handle(ConnectionControl::from_bits_retain(0x6001)));
        assert_eq!(consumer.state(), ConsumerState::Consuming);
    }

    #[test]
    fn a_producer_that_only_toggles() {
        let mut consumer = Consumer::new(1, 1);
        let mut handle =
            |word| (consumer.handle(ConnectionControl::from_bits_retain(word)), consumer.state());
        assert_eq!(handle(0x0001), (false, ConsumerState::Waiting));
        assert_eq!(handle(0x0003), (true, ConsumerState::Consuming));
        assert_eq!(handle(0x0001), (true, ConsumerState::Consuming));
        assert_eq!(handle(0x0001), (false, ConsumerState::Warning));
        assert_eq!(handle(0x0011), (false, ConsumerState::Stopped));
        assert_eq!(handle(0x0003), (true, ConsumerState::Consuming));
        assert_eq!(handle(0x0003), (false, ConsumerState::Warning));
        assert_eq!(handle(0x0003), (false, ConsumerState::Error));
        assert_eq!(handle(0x0001), (false, ConsumerState::Error));
    }

    #[test]
    fn a_slower_producer_is_awaited_at_its_pace() {
        let mut consumer = Consumer::new(1, 2);
        let mut handle =
            |word| (consumer.handle(ConnectionControl::from_bits_retain(word)), consumer.state());
        assert_eq!(handle(0x1003), (true, ConsumerState::Consuming));
        assert_eq!(handle(0x1003), (false, ConsumerState::Consuming));
        assert_eq!(handle(0x2001), (true, ConsumerState::Consuming));
        assert_eq!(handle(0x2001), (false, ConsumerState::Consuming));
        assert_eq!(handle(0x2001), (false, ConsumerState::Warning));
        assert_eq!(handle(0x2001), (false, ConsumerState::Warning));
        assert_eq!(handle(0x2001), (false, ConsumerState::Error));
    }

    #[test]
    fn readiness_taken_back_and_missing_telegrams_are_losses() {
        let mut consumer = Consumer::new(2, 1);
        assert!(consumer.handle(ConnectionControl::from_bits_retain(0x1003)));
        assert!(!consumer.handle(ConnectionControl::from_bits_retain(0x2000)));
        consumer.miss();
        assert_eq!(consumer.state(), ConsumerState::Warning);
        consumer.miss();
        assert_eq!((consumer.state(), consumer.losses_total()), (ConsumerState::Error, 3));
    }
}
