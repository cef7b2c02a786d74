//! The Connection object (class 5) as the predefined master/slave connection set uses it: states, timers, attributes.
//!
//! An I/O connection:
//!
//! | | non-existent | configuring | established | timed out |
//! |---|---|---|---|---|
//! | allocate | configuring | refused | refused | refused |
//! | release, delete | refused | non-existent | non-existent | non-existent |
//! | set expected packet rate | refused | established | timer anew | refused |
//! | set another attribute | refused | taken | taken | refused |
//! | apply attributes | refused | established | taken | refused |
//! | reset | refused | refused | timer anew | established |
//! | get | refused | answered | answered | answered |
//! | message | dropped | dropped | consumed, timer anew | dropped |
//! | watchdog, action 0 time out | | | timed out | |
//! | watchdog, action 1 auto delete | | | non-existent | |
//! | watchdog, action 2 auto reset | | | timer anew | |
//!
//! The explicit connection is established as soon as it is allocated, and knows the actions auto delete and deferred delete:
//! with the latter it waits in deferred delete as long as an I/O connection is established, and a message takes it back to
//! established.
//!
//! The watchdog is four times the expected packet rate; 0 stops it. Until an I/O connection has consumed its first message
//! it is 10 s at least.

use core::fmt;

pub use crate::generated::devicenet::{ConnectionState, WatchdogAction};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::wire::{Identifier, MacId};
use crate::wire::status::GeneralStatus;

/// Class code of the Connection object.
pub const CLASS_CONNECTION: u8 = 0x05;

/// Connection time-out multiplier: the watchdog is so many times the expected packet rate.
pub const TIMEOUT_MULTIPLIER: i64 = 4;

/// Shortest watchdog of an I/O connection that has not consumed yet.
pub const FIRST_MESSAGE_TIMEOUT: DurationNs = DurationNs::from_secs(10);

/// Expected packet rate of the explicit connection out of the box, ms.
pub const EXPLICIT_RATE_MS: u16 = 2500;

/// Connections of the predefined master/slave connection set, in the order of their instance numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ConnectionKind {
    /// Instance 1: explicit messages.
    Explicit,
    /// Instance 2.
    Poll,
    /// Instance 3.
    BitStrobe,
    /// Instance 4: change of state, or cyclic.
    ChangeOfState,
}

impl ConnectionKind {
    /// Every kind.
    pub const ALL: [Self; 4] = [Self::Explicit, Self::Poll, Self::BitStrobe, Self::ChangeOfState];

    /// Instance number.
    #[must_use]
    pub const fn instance(self) -> u8 {
        match self {
            Self::Explicit => 1,
            Self::Poll => 2,
            Self::BitStrobe => 3,
            Self::ChangeOfState => 4,
        }
    }

    /// Place among all four.
    #[must_use]
    pub const fn index(self) -> usize {
        self.instance() as usize - 1
    }

    /// Whether it is an I/O connection.
    #[must_use]
    pub const fn is_io(self) -> bool {
        !matches!(self, Self::Explicit)
    }
}

impl fmt::Display for ConnectionKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Explicit => "explicit connection",
            Self::Poll => "poll connection",
            Self::BitStrobe => "bit strobe connection",
            Self::ChangeOfState => "change of state connection",
        })
    }
}

/// What happens to a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConnectionEvent {
    /// Allocated by a master.
    Allocate,
    /// Released, or deleted by the service of that name.
    Release,
    /// Set of attribute 9.
    SetRate,
    /// Set of another attribute.
    SetOther,
    /// Service `Apply_Attributes`.
    Apply,
    /// Service Reset.
    Reset,
    /// Get of an attribute.
    Get,
    /// A message of the master.
    Message,
    /// The watchdog has run out.
    Watchdog(WatchdogAction),
    /// The last established I/O connection has gone.
    LastIoGone,
}

/// What comes of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ConnectionTransition {
    /// The state afterwards.
    pub next: ConnectionState,
    /// A service is refused with this status; a message is dropped.
    pub refused: Option<GeneralStatus>,
    /// The watchdog begins anew.
    pub restart: bool,
}

impl ConnectionState {
    /// Whether messages of the master are taken.
    #[must_use]
    pub const fn takes_messages(self) -> bool {
        matches!(self, Self::ESTABLISHED | Self::DEFERRED_DELETE)
    }

    /// What an event makes of a connection. `io` tells I/O connections from the explicit one; `io_established` says, for the
    /// explicit one, that an I/O connection is established.
    #[must_use]
    // Flat: the table of the standard, one arm per transition.
    pub const fn next(self, io: bool, event: ConnectionEvent, io_established: bool) -> ConnectionTransition {
        use ConnectionEvent as E;
        const fn go(next: ConnectionState) -> ConnectionTransition {
            ConnectionTransition { next, refused: None, restart: false }
        }
        const fn anew(next: ConnectionState) -> ConnectionTransition {
            ConnectionTransition { next, refused: None, restart: true }
        }
        const fn refuse(state: ConnectionState, status: GeneralStatus) -> ConnectionTransition {
            ConnectionTransition { next: state, refused: Some(status), restart: false }
        }
        let conflict = refuse(self, GeneralStatus::OBJECT_STATE_CONFLICT);
        match (self, event) {
            (Self::NON_EXISTENT, E::Allocate) if io => go(Self::CONFIGURING),
            (Self::NON_EXISTENT, E::Allocate) => anew(Self::ESTABLISHED),
            (Self::NON_EXISTENT, E::Watchdog(_) | E::LastIoGone) => go(self),
            (Self::NON_EXISTENT, _) => refuse(self, GeneralStatus::OBJECT_DOES_NOT_EXIST),
            (_, E::Allocate) => refuse(self, GeneralStatus::ALREADY_IN_STATE),
            (_, E::Release) => go(Self::NON_EXISTENT),
            (_, E::Get) => go(self),
            (Self::CONFIGURING, E::SetRate | E::Apply) => anew(Self::ESTABLISHED),
            (Self::CONFIGURING, E::SetOther) => go(self),
            (Self::ESTABLISHED, E::SetRate | E::Reset | E::Message) => anew(self),
            (Self::ESTABLISHED, E::SetOther | E::Apply) => go(self),
            (Self::ESTABLISHED, E::Watchdog(action)) => match (action, io) {
                (WatchdogAction::TIME_OUT, true) => go(Self::TIMED_OUT),
                (WatchdogAction::AUTO_RESET, true) => anew(self),
                (WatchdogAction::DEFERRED_DELETE, false) if io_established => go(Self::DEFERRED_DELETE),
                _ => go(Self::NON_EXISTENT),
            },
            (Self::TIMED_OUT, E::Reset) => anew(Self::ESTABLISHED),
            (Self::DEFERRED_DELETE, E::SetRate | E::Reset | E::Message) => anew(Self::ESTABLISHED),
            (Self::DEFERRED_DELETE, E::SetOther | E::Apply) => go(self),
            (Self::DEFERRED_DELETE, E::LastIoGone) => go(Self::NON_EXISTENT),
            (_, E::Watchdog(_) | E::LastIoGone) => go(self),
            _ => conflict,
        }
    }
}

/// What a connection carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ConnectionSetup {
    /// Transport class and trigger, attribute 3: bit 7 server, bits 6..4 production trigger (0 cyclic, 1 change of state,
    /// 2 application), bits 3..0 transport class.
    pub transport: u8,
    /// Longest message produced, bytes.
    pub produced_size: u16,
    /// Longest message consumed, bytes.
    pub consumed_size: u16,
    /// Whether what is consumed commands something, so that the watchdog must not be off.
    pub supervised: bool,
}

/// One instance at a slave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Connection {
    kind: ConnectionKind,
    state: ConnectionState,
    setup: ConnectionSetup,
    rate_ms: u16,
    resolution_ms: u16,
    action: WatchdogAction,
    inhibit_ms: u16,
    acknowledged: bool,
    mac: MacId,
    master: MacId,
    consumed: bool,
    deadline: Option<MonotonicTime>,
}

/// What an event has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The state before.
    pub before: ConnectionState,
    /// The state now.
    pub after: ConnectionState,
}

impl Connection {
    /// An instance that does not exist yet. The expected packet rate is rounded up to multiples of `resolution_ms`.
    #[must_use]
    pub const fn new(kind: ConnectionKind, mac: MacId, resolution_ms: u16) -> Self {
        Self {
            kind,
            state: ConnectionState::NON_EXISTENT,
            setup: ConnectionSetup { transport: 0, produced_size: 0, consumed_size: 0, supervised: false },
            rate_ms: 0,
            resolution_ms,
            action: WatchdogAction::TIME_OUT,
            inhibit_ms: 0,
            acknowledged: true,
            mac,
            master: mac,
            consumed: false,
            deadline: None,
        }
    }

    /// Which one.
    #[must_use]
    pub const fn kind(&self) -> ConnectionKind {
        self.kind
    }

    /// Its state.
    #[must_use]
    pub const fn state(&self) -> ConnectionState {
        self.state
    }

    /// What it carries.
    #[must_use]
    pub const fn setup(&self) -> &ConnectionSetup {
        &self.setup
    }

    /// Expected packet rate, ms.
    #[must_use]
    pub const fn rate_ms(&self) -> u16 {
        self.rate_ms
    }

    /// Production inhibit time, ms.
    #[must_use]
    pub const fn inhibit_ms(&self) -> u16 {
        self.inhibit_ms
    }

    /// Whether what a change of state connection produces is acknowledged.
    #[must_use]
    pub const fn is_acknowledged(&self) -> bool {
        self.acknowledged
    }

    /// When the watchdog runs out.
    #[must_use]
    pub const fn deadline(&self) -> Option<MonotonicTime> {
        self.deadline
    }

    /// Whether a change of state connection produces cyclically.
    #[must_use]
    pub const fn is_cyclic(&self) -> bool {
        self.setup.transport & 0x70 == 0
    }

    /// Whether it must not be established yet, because its watchdog would be off.
    #[must_use]
    pub const fn lacks_rate(&self) -> bool {
        self.setup.supervised && self.rate_ms == 0
    }

    /// Takes the connection into use for `master`.
    ///
    /// # Errors
    /// It is in use.
    pub fn allocate(
        &mut self,
        now: MonotonicTime,
        master: MacId,
        setup: ConnectionSetup,
        acknowledged: bool,
    ) -> Result<Change, GeneralStatus> {
        let change = self.event(now, ConnectionEvent::Allocate, false)?;
        self.setup = setup;
        self.master = master;
        self.inhibit_ms = 0;
        self.acknowledged = acknowledged;
        self.consumed = false;
        (self.rate_ms, self.action) = match self.kind {
            ConnectionKind::Explicit => (EXPLICIT_RATE_MS, WatchdogAction::AUTO_DELETE),
            _ => (0, WatchdogAction::TIME_OUT),
        };
        self.restart(now);
        Ok(change)
    }

    /// Carries an event out.
    ///
    /// # Errors
    /// It is refused, and nothing changes.
    pub fn event(
        &mut self,
        now: MonotonicTime,
        event: ConnectionEvent,
        io_established: bool,
    ) -> Result<Change, GeneralStatus> {
        let before = self.state;
        let transition = before.next(self.kind.is_io(), event, io_established);
        if let Some(status) = transition.refused {
            return Err(status);
        }
        self.state = transition.next;
        if event == ConnectionEvent::Message {
            self.consumed = true;
        } else if before != ConnectionState::ESTABLISHED && transition.next == ConnectionState::ESTABLISHED {
            self.consumed = false;
        }
        if transition.restart {
            self.restart(now);
        } else if transition.next != ConnectionState::ESTABLISHED {
            self.deadline = None;
        }
        Ok(Change { before, after: self.state })
    }

    fn restart(&mut self, now: MonotonicTime) {
        // What a slave produces by itself has no watchdog at the slave: the rate is its own trigger.
        let watched = self.state == ConnectionState::ESTABLISHED
            && self.rate_ms != 0
            && self.kind != ConnectionKind::ChangeOfState;
        let span = DurationNs::from_millis(i64::from(self.rate_ms)) * TIMEOUT_MULTIPLIER;
        let first = self.kind.is_io() && !self.consumed;
        let span = if first { span.max(FIRST_MESSAGE_TIMEOUT) } else { span };
        self.deadline = watched.then(|| now + span);
    }

    /// Lets time pass. `Some`: the watchdog has run out.
    pub fn handle_time(&mut self, now: MonotonicTime, io_established: bool) -> Option<Change> {
        if self.deadline.is_none_or(|deadline| now < deadline) {
            return None;
        }
        self.event(now, ConnectionEvent::Watchdog(self.action), io_established).ok()
    }

    /// Identifier of what the slave produces, attribute 4.
    #[must_use]
    pub const fn produced_identifier(&self) -> Identifier {
        match self.kind {
            ConnectionKind::Explicit => Identifier::ExplicitResponse(self.mac),
            ConnectionKind::Poll => Identifier::PollResponse(self.mac),
            ConnectionKind::BitStrobe => Identifier::BitStrobeResponse(self.mac),
            ConnectionKind::ChangeOfState => Identifier::ChangeOfState(self.mac),
        }
    }

    /// Identifier of what the slave consumes, attribute 5; `None` for a connection that consumes nothing.
    #[must_use]
    pub const fn consumed_identifier(&self) -> Option<Identifier> {
        match self.kind {
            ConnectionKind::Explicit => Some(Identifier::ExplicitRequest(self.mac)),
            ConnectionKind::Poll => Some(Identifier::PollCommand(self.mac)),
            ConnectionKind::BitStrobe => Some(Identifier::BitStrobeCommand(self.master)),
            ConnectionKind::ChangeOfState if self.acknowledged => Some(Identifier::Acknowledge(self.mac)),
            ConnectionKind::ChangeOfState => None,
        }
    }

    /// Initial communication characteristics, attribute 6: high nibble what is produced, low nibble what is consumed
    /// (0 group 1, 1 group 2 by the slave's MAC ID, 2 group 2 by the other's, F nothing).
    const fn characteristics(&self) -> u8 {
        match self.kind {
            ConnectionKind::Explicit => 0x21,
            ConnectionKind::Poll => 0x01,
            ConnectionKind::BitStrobe => 0x02,
            ConnectionKind::ChangeOfState if self.acknowledged => 0x01,
            ConnectionKind::ChangeOfState => 0x0F,
        }
    }

    /// Appends the value of an attribute; `paths` are those of what is produced and consumed.
    ///
    /// # Errors
    /// The instance does not exist, or has no such attribute.
    // Flat: one arm per attribute.
    pub fn get(
        &self,
        attribute: u8,
        paths: (&[u8], &[u8]),
        out: &mut impl Extend<u8>,
    ) -> Result<(), GeneralStatus> {
        if self.state == ConnectionState::NON_EXISTENT {
            return Err(GeneralStatus::OBJECT_DOES_NOT_EXIST);
        }
        let len = |path: &[u8]| u16::try_from(path.len()).unwrap_or(u16::MAX);
        let mut word = |value: u16| out.extend(value.to_le_bytes());
        match attribute {
            1 => out.extend([self.state.0]),
            2 => out.extend([u8::from(self.kind.is_io())]),
            3 => out.extend([self.setup.transport]),
            4 => word(self.produced_identifier().bits()),
            5 => word(self.consumed_identifier().map_or(0xFFFF, Identifier::bits)),
            6 => out.extend([self.characteristics()]),
            7 => word(self.setup.produced_size),
            8 => word(self.setup.consumed_size),
            9 => word(self.rate_ms),
            12 => out.extend([self.action.0]),
            13 => word(len(paths.0)),
            14 => out.extend(paths.0.iter().copied()),
            15 => word(len(paths.1)),
            16 => out.extend(paths.1.iter().copied()),
            17 => word(self.inhibit_ms),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    /// Writes an attribute: the expected packet rate, the watchdog action, the production inhibit time.
    ///
    /// # Errors
    /// The attribute, its length, its value or the state does not permit it; nothing changes.
    // Flat: one arm per attribute.
    pub fn set(&mut self, now: MonotonicTime, attribute: u8, value: &[u8]) -> Result<Change, GeneralStatus> {
        if self.state == ConnectionState::NON_EXISTENT {
            return Err(GeneralStatus::OBJECT_DOES_NOT_EXIST);
        }
        let word = || match value.len() {
            2 => Ok(u16::from_le_bytes([value[0], value[1]])),
            0 | 1 => Err(GeneralStatus::NOT_ENOUGH_DATA),
            _ => Err(GeneralStatus::TOO_MUCH_DATA),
        };
        match attribute {
            9 => {
                let wanted = word()?;
                if wanted == 0 && self.setup.supervised {
                    // Without a watchdog a drive would go on with the last command for ever.
                    return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
                }
                let rounded = wanted.checked_next_multiple_of(self.resolution_ms.max(1));
                let rate = rounded.ok_or(GeneralStatus::INVALID_ATTRIBUTE_VALUE)?;
                let before = core::mem::replace(&mut self.rate_ms, rate);
                // It is set first, because the watchdog begins anew with it.
                self.event(now, ConnectionEvent::SetRate, false).inspect_err(|_| self.rate_ms = before)
            }
            12 => {
                let action = match (value, self.kind.is_io()) {
                    ([action @ 0..=2], true) | ([action @ (1 | 3)], false) => WatchdogAction(*action),
                    ([_], _) => return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE),
                    ([], _) => return Err(GeneralStatus::NOT_ENOUGH_DATA),
                    _ => return Err(GeneralStatus::TOO_MUCH_DATA),
                };
                if action == WatchdogAction::AUTO_RESET && self.setup.supervised {
                    return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
                }
                let change = self.event(now, ConnectionEvent::SetOther, false)?;
                self.action = action;
                Ok(change)
            }
            17 if self.kind == ConnectionKind::ChangeOfState => {
                let inhibit = word()?;
                if inhibit > self.rate_ms && self.rate_ms != 0 {
                    return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE);
                }
                let change = self.event(now, ConnectionEvent::SetOther, false)?;
                self.inhibit_ms = inhibit;
                Ok(change)
            }
            1..=8 | 13..=17 => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
    }
}

#[cfg(test)]
mod tests;
