//! The two ends of a cyclic connection at the master: producer (MDT) and consumer (AT).
//!
//! ```text
//!                 ready            new data or counter
//! Prepare ------------> Waiting ----------------------> Consuming <---+
//!    ^                     |  ^                          |   ^        |
//!    | not ready           |  | flow control ends   loss |   | new    | new data
//!    +---------------------+  |                          v   | data   |
//!                          Stopped <---- flow control -- Warning -----+
//!                                                          | more losses than S-0-1050.x.11
//!                                                          v
//!                                                        Error  (until reset)
//! ```

use core::fmt;

use arrayvec::ArrayVec;

use super::config::CONNECTION_LEN_MAX;
use crate::wire::connection::{CONNECTION_CONTROL_LEN, ConnectionControl};
use profile_generic::wire::put_u16;

/// Bytes of a connection's values.
const DATA_MAX: usize = CONNECTION_LEN_MAX - CONNECTION_CONTROL_LEN;

/// State of a consumer, from the toggle and counter of its C-CON.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConsumerState {
    /// The producer is not ready.
    Prepare,
    /// The producer is ready and has not produced yet.
    Waiting,
    /// Every expected value came.
    Consuming,
    /// Values are missing, not more than permitted.
    Warning,
    /// More values in a row were missing than permitted. Lasts until the consumer is reset.
    Error,
    /// The producer has stopped by flow control.
    Stopped,
}

/// What one cycle brought to a consumer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConsumerEvent {
    /// The producer is not ready.
    NotReady,
    /// The producer is ready; no new value, and none was due.
    Ready,
    /// The expected new value.
    NewData,
    /// A value was due and did not come, or one was skipped, within the permitted number.
    Loss,
    /// The same beyond the permitted number.
    TooManyLosses,
    /// Flow control stops the producer.
    FlowStop,
    /// The application wants to start again.
    Reset,
}

impl ConsumerState {
    /// All states.
    pub const ALL: [ConsumerState; 6] = [
        ConsumerState::Prepare,
        ConsumerState::Waiting,
        ConsumerState::Consuming,
        ConsumerState::Warning,
        ConsumerState::Error,
        ConsumerState::Stopped,
    ];

    /// The state after `event`.
    #[must_use]
    pub const fn next(self, event: ConsumerEvent) -> ConsumerState {
        use ConsumerEvent as E;
        use ConsumerState as S;
        match (self, event) {
            (_, E::Reset) => S::Prepare,
            (S::Error, _) => S::Error,
            (S::Consuming | S::Warning, E::TooManyLosses) => S::Error,
            (S::Consuming | S::Warning, E::Loss | E::NotReady) => S::Warning,
            (S::Prepare | S::Waiting | S::Stopped, E::NotReady) => S::Prepare,
            (S::Prepare, E::Loss | E::TooManyLosses) => S::Prepare,
            (_, E::FlowStop) => S::Stopped,
            (S::Prepare | S::Stopped, E::Ready) => S::Waiting,
            (S::Stopped, E::Loss | E::TooManyLosses) => S::Stopped,
            (S::Waiting, E::Ready | E::Loss | E::TooManyLosses) => S::Waiting,
            (S::Consuming, E::Ready) => S::Consuming,
            (S::Warning, E::Ready) => S::Warning,
            (_, E::NewData) => S::Consuming,
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

/// What the application sees of a connection that a slave produces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Consumer<'a> {
    /// The last value that was accepted, without C-CON; zeros before the first.
    pub data: &'a [u8],
    /// State of the connection. Only in `Consuming` is the data of this cycle; in `Warning` it is older.
    pub state: ConsumerState,
    /// Whether the last cycle brought a new value.
    pub fresh: bool,
    /// Consecutive losses up to now.
    pub missed: u32,
    /// C-CON as it came last.
    pub control: ConnectionControl,
}

/// Consumer of one connection. The state stands beside the first values: mostly it is one cache line.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct ConsumerEnd {
    state: ConsumerState,
    control: ConnectionControl,
    /// The producer has counted once: its counter decides, not the toggle.
    counting: bool,
    fresh: bool,
    losses: u32,
    /// Cycles since the last new value.
    idle_cycles: u32,
    producer_cycles: u32,
    allowed_losses: u32,
    data: ArrayVec<u8, DATA_MAX>,
}

impl ConsumerEnd {
    /// A consumer of `len` bytes with C-CON; at most [`CONNECTION_LEN_MAX`] are kept.
    pub fn new(len: u16, producer_cycles: u16, allowed_losses: u16) -> ConsumerEnd {
        ConsumerEnd {
            state: ConsumerState::Prepare,
            data: zeros(len),
            control: ConnectionControl::empty(),
            counting: false,
            fresh: false,
            losses: 0,
            idle_cycles: 0,
            producer_cycles: u32::from(producer_cycles).max(1),
            allowed_losses: u32::from(allowed_losses),
        }
    }

    pub fn view(&self) -> Consumer<'_> {
        Consumer {
            data: &self.data,
            state: self.state,
            fresh: self.fresh,
            missed: self.losses,
            control: self.control,
        }
    }

    /// Starts again from `Prepare`; the data stays. So does the last C-CON: a producer that stands still has nothing new to
    /// say after a reset either.
    pub fn reset(&mut self) {
        self.state = self.state.next(ConsumerEvent::Reset);
        self.counting = false;
        self.fresh = false;
        self.losses = 0;
        self.idle_cycles = 0;
    }

    /// Takes what one cycle brought: C-CON and values, or nothing when the telegram did not come or the slave is
    /// not valid. Returns the state when it has changed.
    pub fn update(&mut self, bytes: Option<&[u8]>) -> Option<ConsumerState> {
        let before = self.state;
        let (event, accept) = self.classify(bytes);
        self.state = self.state.next(event);
        self.fresh = accept && self.state != ConsumerState::Error;
        if let (true, Some(bytes)) = (self.fresh, bytes) {
            let values = &bytes[CONNECTION_CONTROL_LEN..];
            let len = values.len().min(self.data.len());
            self.data[..len].copy_from_slice(&values[..len]);
        }
        (self.state != before).then_some(self.state)
    }

    /// What the cycle means, and whether it brought a value to accept.
    fn classify(&mut self, bytes: Option<&[u8]>) -> (ConsumerEvent, bool) {
        let Some(word) = bytes.and_then(|bytes| bytes.first_chunk::<CONNECTION_CONTROL_LEN>()) else {
            return (self.no_value(), false);
        };
        let control = ConnectionControl::from_bits_retain(u16::from_le_bytes(*word));
        let last = core::mem::replace(&mut self.control, control);
        if !control.contains(ConnectionControl::READY) {
            let running = matches!(self.state, ConsumerState::Consuming | ConsumerState::Warning);
            return (if running { self.loss() } else { ConsumerEvent::NotReady }, false);
        }
        if control.contains(ConnectionControl::STOPPED) {
            self.losses = 0;
            self.idle_cycles = 0;
            return (ConsumerEvent::FlowStop, false);
        }
        self.counting |= control.counter() != 0;
        let changed = if self.state == ConsumerState::Prepare {
            // The toggle says nothing before it has been seen once; the counter does, and one that was seen has to go on.
            control.counter() != 0 && control.counter() != last.counter()
        } else if self.counting {
            control.counter() != last.counter()
        } else {
            control.contains(ConnectionControl::NEW_DATA) != last.contains(ConnectionControl::NEW_DATA)
        };
        if !changed {
            return (self.no_value(), false);
        }
        self.idle_cycles = 0;
        let running = matches!(self.state, ConsumerState::Consuming | ConsumerState::Warning);
        let skipped = running && self.counting && control.counter() != (last.counter() + 1) & 0xF;
        if skipped {
            return (self.loss(), true);
        }
        self.losses = 0;
        (ConsumerEvent::NewData, true)
    }

    /// No new value: a loss when one was due.
    fn no_value(&mut self) -> ConsumerEvent {
        if !matches!(self.state, ConsumerState::Consuming | ConsumerState::Warning) {
            return if self.control.contains(ConnectionControl::READY) {
                ConsumerEvent::Ready
            } else {
                ConsumerEvent::NotReady
            };
        }
        self.idle_cycles = self.idle_cycles.saturating_add(1);
        if self.idle_cycles.is_multiple_of(self.producer_cycles) { self.loss() } else { ConsumerEvent::Ready }
    }

    fn loss(&mut self) -> ConsumerEvent {
        self.losses = self.losses.saturating_add(1);
        if self.losses > self.allowed_losses { ConsumerEvent::TooManyLosses } else { ConsumerEvent::Loss }
    }
}

/// Producer of one connection. C-CON stands beside the first values that go out.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct ProducerEnd {
    control: ConnectionControl,
    /// What goes out: changed by a commit only.
    sent: ArrayVec<u8, DATA_MAX>,
    data: ArrayVec<u8, DATA_MAX>,
    /// There was a commit since telegrams were built last.
    is_new: bool,
    /// The C-CON of these telegrams was another one than before.
    is_first: bool,
    /// These telegrams were not sent: nobody has seen that C-CON.
    is_unseen: bool,
}

impl ProducerEnd {
    /// A producer of `len` bytes with C-CON.
    pub fn new(len: u16) -> ProducerEnd {
        ProducerEnd {
            data: zeros(len),
            sent: zeros(len),
            control: ConnectionControl::empty(),
            is_new: false,
            is_first: false,
            is_unseen: false,
        }
    }

    /// The values for the next commit.
    pub fn data(&mut self) -> &mut [u8] {
        &mut self.data
    }

    /// Makes the values the new ones: ready, toggled, counted. In place of values that nobody has seen they are counted once.
    pub fn commit(&mut self) {
        self.sent.copy_from_slice(&self.data);
        if !self.is_unseen {
            self.control = self.control.produced();
        }
        self.is_new = true;
    }

    /// Takes readiness back: consumers do not accept anything until the next commit.
    pub fn withdraw(&mut self) {
        self.control = ConnectionControl::empty();
        (self.is_new, self.is_first, self.is_unseen) = (false, false, false);
    }

    /// The telegrams that were built last are not sent.
    pub fn take_back(&mut self) {
        self.is_unseen = self.is_first;
    }

    /// Writes C-CON and values into a telegram that is built.
    pub fn emit(&mut self, bytes: &mut [u8]) {
        let (is_new, is_unseen) = (std::mem::take(&mut self.is_new), std::mem::take(&mut self.is_unseen));
        self.is_first = is_new || is_unseen;
        if bytes.len() >= CONNECTION_CONTROL_LEN + self.sent.len() {
            put_u16(bytes, 0, self.control.bits());
            bytes[CONNECTION_CONTROL_LEN..][..self.sent.len()].copy_from_slice(&self.sent);
        }
    }
}

fn zeros(len: u16) -> ArrayVec<u8, DATA_MAX> {
    let len = usize::from(len).saturating_sub(CONNECTION_CONTROL_LEN).min(DATA_MAX);
    core::iter::repeat_n(0, len).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_table() {
        use ConsumerEvent::*;
        let events = [NotReady, Ready, NewData, Loss, TooManyLosses, FlowStop, Reset];
        let mut table = String::new();
        for state in ConsumerState::ALL {
            for event in events {
                table += &format!(
                    "{:<10} {:<14} {}\n",
                    state.to_string(),
                    format!("{event:?}"),
                    state.next(event)
                );
            }
        }
        insta::assert_snapshot!(table);
    }

    /// Feeds words with their own value as data; the states as a line.
    fn run(consumer: &mut ConsumerEnd, words: &[Option<u16>]) -> String {
        let mut line = String::new();
        for word in words {
            let bytes = word.map(|word| {
                let [a, b] = word.to_le_bytes();
                [a, b, a, b]
            });
            consumer.update(bytes.as_ref().map(|b| &b[..]));
            let fresh = if consumer.view().fresh { "*" } else { "" };
            line += &format!("{}{fresh} ", consumer.view().state);
        }
        line.trim_end().to_string()
    }

    #[test]
    fn producer_of_the_recording() {
        // Startup recording, frames 5196 to 5232: nothing, then 0x1003, 0x2001, 0x3003.
        let mut consumer = ConsumerEnd::new(4, 1, 10);
        assert_eq!(
            run(&mut consumer, &[Some(0), Some(0x1003), Some(0x2001), Some(0x3003)]),
            "prepare consuming* consuming* consuming*"
        );
        assert_eq!(consumer.view().data, [0x03, 0x30]);
    }

    #[test]
    fn a_toggling_producer() {
        let mut consumer = ConsumerEnd::new(4, 1, 1);
        let words = [Some(0), Some(1), Some(1), Some(3), Some(1), Some(1), Some(3), Some(3), Some(3)];
        assert_eq!(
            run(&mut consumer, &words),
            "prepare waiting waiting consuming* consuming* warning consuming* warning error"
        );
        // New data after the error is not accepted.
        assert_eq!(run(&mut consumer, &[Some(1), Some(3)]), "error error");
        assert_eq!(consumer.view().data, [0x03, 0x00]);
        consumer.reset();
        assert_eq!(run(&mut consumer, &[Some(1), Some(3)]), "waiting consuming*");
    }

    /// A drive that hangs sends its last telegram for ever: a reset makes no new value of it.
    #[test]
    fn a_word_that_stood_before_a_reset_is_no_new_value_after_it() {
        let mut consumer = ConsumerEnd::new(4, 1, 1);
        let words = [Some(0x1003), Some(0x2001), Some(0x2001), Some(0x2001)];
        assert_eq!(run(&mut consumer, &words), "consuming* consuming* warning error");
        consumer.reset();
        assert_eq!(
            run(&mut consumer, &[Some(0x2001), Some(0x2001), None, Some(0x2001)]),
            "waiting waiting waiting waiting"
        );
        assert_eq!(run(&mut consumer, &[Some(0x3003), Some(0x4001)]), "consuming* consuming*");
        // One that went on meanwhile is taken from its first value.
        consumer.reset();
        assert_eq!(run(&mut consumer, &[Some(0x9001)]), "consuming*");
    }

    #[test]
    fn a_producer_that_stands_still_has_nothing_new_after_a_reset() {
        for word in [0x5003, 0x0003, 0x0001] {
            let mut consumer = ConsumerEnd::new(4, 1, 1);
            run(&mut consumer, &[Some(0x3003), Some(0x4001), Some(0x5003), Some(word)]);
            let still = [Some(word); 4];
            assert!(run(&mut consumer, &still).ends_with("error"), "{word:04x}");
            for _ in 0..3 {
                consumer.reset();
                let line = run(&mut consumer, &still);
                assert!(!line.contains('*') && line.ends_with("waiting waiting"), "{word:04x}: {line}");
            }
            assert!(run(&mut consumer, &[Some(0x6001)]).ends_with("consuming*"), "and goes on when it does");
        }
    }

    #[test]
    fn losses_within_the_limit_are_borne() {
        let mut consumer = ConsumerEnd::new(4, 1, 2);
        let words = [Some(0x1003), None, None, Some(0x4001), Some(0x5003), None, None, None];
        assert_eq!(run(&mut consumer, &words), "consuming* warning warning error error error error error");
        let mut consumer = ConsumerEnd::new(4, 1, 3);
        // The counter skipped values: taken, counted as one more loss, and the next one is good again.
        assert_eq!(
            run(&mut consumer, &words),
            "consuming* warning warning warning* consuming* warning warning warning"
        );
        assert_eq!(consumer.view().missed, 3);
    }

    #[test]
    fn readiness_lost_and_flow_control() {
        let mut consumer = ConsumerEnd::new(4, 1, 10);
        let words = [Some(0x1003), Some(0x1002), Some(0x2001), Some(0x2011), Some(0x2001), Some(0x3003)];
        assert_eq!(run(&mut consumer, &words), "consuming* warning consuming* stopped waiting consuming*");
    }

    #[test]
    fn slower_producers_are_waited_for() {
        let mut consumer = ConsumerEnd::new(4, 3, 0);
        let words = [Some(0x1003), Some(0x1003), Some(0x1003), Some(0x2001), None, None, None];
        assert_eq!(
            run(&mut consumer, &words),
            "consuming* consuming consuming consuming* consuming consuming error"
        );
    }

    #[test]
    fn telegram_loss_before_the_start_is_no_loss() {
        let mut consumer = ConsumerEnd::new(4, 1, 0);
        assert_eq!(run(&mut consumer, &[None, Some(1), None, Some(3)]), "prepare waiting waiting consuming*");
        // Too few bytes for C-CON are no telegram.
        assert_eq!(consumer.update(Some(&[1])), Some(ConsumerState::Error));
    }

    #[test]
    fn producer_sends_what_was_committed() {
        let mut producer = ProducerEnd::new(6);
        let mut bytes = [0xA5; 6];
        producer.emit(&mut bytes);
        assert_eq!(bytes, [0; 6]);
        producer.data().copy_from_slice(&[1, 2, 3, 4]);
        producer.emit(&mut bytes);
        assert_eq!(bytes, [0; 6]);
        producer.commit();
        producer.emit(&mut bytes);
        assert_eq!(bytes, [0x03, 0x10, 1, 2, 3, 4]);
        producer.commit();
        producer.emit(&mut bytes);
        assert_eq!(bytes[..2], [0x01, 0x20]);
        // What was built and not sent keeps its count, with newer values or without.
        for committed in [true, false] {
            producer.data()[0] = 9;
            producer.commit();
            producer.emit(&mut bytes);
            let built = bytes;
            producer.take_back();
            producer.data()[0] = 1;
            if committed {
                producer.commit();
            }
            producer.emit(&mut bytes);
            assert_eq!((bytes[..2].to_vec(), bytes[2]), (built[..2].to_vec(), if committed { 1 } else { 9 }));
            producer.emit(&mut bytes);
            producer.take_back();
            producer.commit();
            producer.emit(&mut bytes);
            assert_ne!(bytes[..2], built[..2], "that one was seen");
        }
        producer.withdraw();
        producer.emit(&mut bytes);
        assert_eq!(bytes, [0, 0, 1, 2, 3, 4]);
        // A place that is too small stays as it is.
        let mut small = [0xA5; 5];
        producer.emit(&mut small);
        assert_eq!(small, [0xA5; 5]);
    }
}
