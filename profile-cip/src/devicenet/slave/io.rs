//! I/O messages of a slave: poll, bit strobe, change of state and cyclic.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::super::connection::{ConnectionEvent, ConnectionKind, ConnectionState};
use super::super::fragmentation::{IoData, IoFrames};
use super::super::link::Refusal;
use super::super::wire::{AllocationChoice, Identifier};
use super::application::Application;
use super::event::SlaveEvent;
use super::{FRAMES_MAX, Slave};

/// Time to wait for the master's acknowledge of a change of state (Acknowledge Handler object, attribute 1, out of the box).
const ACKNOWLEDGE_TIMEOUT: DurationNs = DurationNs::from_millis(16);

/// Bytes of a bit strobe command: one bit for each MAC ID.
const STROBE_LEN: usize = 8;

/// Transport class and trigger of a change of state or cyclic connection: client, class 2 when it is acknowledged.
pub(super) const fn transport(choice: AllocationChoice) -> u8 {
    let trigger = if choice.contains(AllocationChoice::CHANGE_OF_STATE) { 0x10 } else { 0 };
    let class = if choice.contains(AllocationChoice::ACKNOWLEDGE_SUPPRESSION) { 0 } else { 2 };
    trigger | class
}

/// Production of a change of state or cyclic connection.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ChangeOfState {
    /// When it has produced last.
    last: Option<MonotonicTime>,
    /// Something has changed that was not told yet.
    changed: bool,
    /// An acknowledge is due by then; the message was sent so many times.
    waiting: Option<(MonotonicTime, u8)>,
}

impl<A: Application> Slave<A> {
    /// Takes a frame of an I/O connection. `Some`: the message is whole, and in the receiver.
    fn receive(
        &mut self,
        now: MonotonicTime,
        kind: ConnectionKind,
        identifier: Identifier,
        frame: &[u8],
    ) -> Result<bool, Refusal> {
        let connection = self.connection(kind);
        if connection.state() != ConnectionState::ESTABLISHED {
            return Err(Refusal::NoConnection(identifier));
        }
        let size = usize::from(connection.setup().consumed_size);
        let receiver = &mut self.receivers[kind.index()];
        if !receiver.handle(size, frame).map_err(|error| Refusal::Fragment(identifier, error))? {
            return Ok(false);
        }
        let found = receiver.data().len();
        // A message without data is valid on every connection, and says that the master commands nothing.
        if found != 0 && found != size {
            return Err(Refusal::Length { identifier, expected: size, found });
        }
        let _ = self.connection_event(now, kind, ConnectionEvent::Message);
        Ok(true)
    }

    pub(super) fn handle_poll(
        &mut self,
        now: MonotonicTime,
        identifier: Identifier,
        frame: &[u8],
    ) -> Result<(), Refusal> {
        let kind = ConnectionKind::Poll;
        if self.receive(now, kind, identifier, frame)? {
            self.application.consume(now, kind, self.receivers[kind.index()].data());
            self.produce(now, kind);
        }
        Ok(())
    }

    pub(super) fn handle_strobe(
        &mut self,
        now: MonotonicTime,
        identifier: Identifier,
        frame: &[u8],
    ) -> Result<(), Refusal> {
        let kind = ConnectionKind::BitStrobe;
        if self.connection(kind).state() != ConnectionState::ESTABLISHED {
            return Err(Refusal::NoConnection(identifier));
        }
        let mac = self.config.mac.get();
        let bit = match frame.len() {
            0 => None,
            STROBE_LEN => Some(frame[usize::from(mac / 8)] >> (mac % 8) & 1),
            found => return Err(Refusal::Length { identifier, expected: STROBE_LEN, found }),
        };
        let _ = self.connection_event(now, kind, ConnectionEvent::Message);
        self.application.consume(now, kind, bit.as_slice());
        self.produce(now, kind);
        Ok(())
    }

    fn produce(&mut self, now: MonotonicTime, kind: ConnectionKind) {
        let mut data = IoData::new();
        self.application.produce(now, kind, &mut data);
        let connection = self.connection(kind);
        let size = usize::from(connection.setup().produced_size);
        let identifier = connection.produced_identifier();
        data.truncate(size);
        let frames = IoFrames::new(size, &data);
        // All of a message or nothing.
        if self.frames.len() + frames.clone().count() <= FRAMES_MAX {
            for frame in frames {
                self.send(identifier, &frame);
            }
        }
    }

    pub(super) fn handle_acknowledge(&mut self, identifier: Identifier) -> Result<(), Refusal> {
        let connection = self.connection(ConnectionKind::ChangeOfState);
        if connection.state() != ConnectionState::ESTABLISHED {
            return Err(Refusal::NoConnection(identifier));
        }
        match self.change_of_state.waiting.take() {
            Some(_) => Ok(()),
            None => Err(Refusal::Unasked(identifier)),
        }
    }

    /// When the change of state connection produces next, changed or not.
    fn production(&self) -> Option<MonotonicTime> {
        let connection = self.connection(ConnectionKind::ChangeOfState);
        if connection.state() != ConnectionState::ESTABLISHED {
            return None;
        }
        let Some(last) = self.change_of_state.last else { return Some(MonotonicTime::ZERO) };
        let after = |millis: u16| last + DurationNs::from_millis(i64::from(millis));
        let heartbeat = (connection.rate_ms() != 0).then(|| after(connection.rate_ms()));
        let changed = self.change_of_state.changed && !connection.is_cyclic();
        let change = changed.then(|| after(connection.inhibit_ms()));
        heartbeat.into_iter().chain(change).min()
    }

    pub(super) fn change_of_state_wake_at(&self) -> Option<MonotonicTime> {
        let acknowledge = self.change_of_state.waiting.map(|(deadline, _)| deadline);
        self.production().into_iter().chain(acknowledge).min()
    }

    pub(super) fn poll_change_of_state(&mut self, now: MonotonicTime) {
        let kind = ConnectionKind::ChangeOfState;
        if self.connection(kind).state() != ConnectionState::ESTABLISHED {
            return;
        }
        self.change_of_state.changed |= self.application.take_change();
        let repeat = match self.change_of_state.waiting {
            Some((deadline, _)) if now < deadline => None,
            Some((_, 1)) => Some(2),
            Some(_) => {
                self.change_of_state.waiting = None;
                self.tell(SlaveEvent::NoAcknowledge);
                None
            }
            None => None,
        };
        let due = self.production().is_some_and(|at| now >= at);
        if !due && repeat.is_none() {
            return;
        }
        self.produce(now, kind);
        self.change_of_state.changed = false;
        self.change_of_state.last = Some(now);
        let deadline = now + ACKNOWLEDGE_TIMEOUT;
        let sent = repeat.unwrap_or(1);
        self.change_of_state.waiting = self.connection(kind).is_acknowledged().then_some((deadline, sent));
    }
}
