//! The Connection Manager object (class 0x06): the motion connection and the explicit connections.
//!
//! The motion connection is an exclusive owner: there is one, and a second originator is refused while it
//! lives.
//!
//! | state | Forward_Open | device opened | refuses | Forward_Close | device closed | lost | device silent |
//! |---|---|---|---|---|---|---|---|
//! | Closed | Opening | | | refused | | | |
//! | Opening | refused | Open | Closed | refused | | | Closed, device asked to close |
//! | Open | refused | | | Closing | | Closed | |
//! | Closing | refused | | | refused | Closed | Closed | Closed |

use core::net::{Ipv4Addr, SocketAddrV4};

use profile_generic::time::{DurationNs, MonotonicTime};

use super::refusal::Refusal;
use crate::device::motion_link::{AssemblyRole, ConnectionTriad, OpenParameters, Token};
use crate::device::session_slot::SessionSlot;
use crate::wire::forward_open::{FIRST_MESSAGE_TIMEOUT, ForwardOpen, Trigger};
use crate::wire::network_parameters::ConnectionType;
use crate::wire::status::ConnectionStatus;

/// Most explicit connections at once: five controllers with six each, as ODVA recommends to expect.
pub const EXPLICIT_CONNECTIONS_MAX: usize = 32;

/// Most input-only and listen-only connections of a device with assemblies at once.
pub const LISTENERS_MAX: usize = 8;

/// Most connections at once: the motion connection and the explicit ones. Connection numbers are below it.
pub const CONNECTIONS_MAX: u16 = 33;

/// The same of a device with assemblies, where those that listen come last.
pub const ASSEMBLY_CONNECTIONS_MAX: u16 = 41;

const _: () = assert!(CONNECTIONS_MAX as usize == EXPLICIT_CONNECTIONS_MAX + 1);
const _: () = assert!(ASSEMBLY_CONNECTIONS_MAX as usize == CONNECTIONS_MAX as usize + LISTENERS_MAX);

/// Most explicit connections of one session, so that one peer cannot take them all.
pub const EXPLICIT_PER_SESSION_MAX: usize = 8;

/// Largest explicit connection in bytes in either direction, the 2-byte sequence count included.
pub const EXPLICIT_SIZE_MAX: u16 = 4002;

/// Smallest explicit connection in bytes: sequence count and an empty reply.
pub const EXPLICIT_SIZE_MIN: u16 = 6;

/// The motion connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Motion {
    #[default]
    Closed,
    Opening(Owner, Asked),
    Open(Owner),
    Closing(Owner, Asked),
}

/// Who has the motion connection, and on which terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Owner {
    /// The same as long as the connection lives: 0, or of those that listen from [`CONNECTIONS_MAX`] on.
    pub number: u16,
    pub open: OpenParameters,
    pub peer: SocketAddrV4,
    /// Time-out multiplier code of the Forward_Open.
    pub multiplier: u8,
}

/// What the motion device has been asked, and until when it may answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Asked {
    pub token: Token,
    pub deadline: MonotonicTime,
}

impl Motion {
    /// Who has the connection, unless closed.
    pub fn owner(&self) -> Option<&Owner> {
        match self {
            Self::Closed => None,
            Self::Opening(owner, _) | Self::Open(owner) | Self::Closing(owner, _) => Some(owner),
        }
    }

    /// The connection, unless closed.
    pub fn parameters(&self) -> Option<&OpenParameters> {
        self.owner().map(|owner| &owner.open)
    }

    /// When the motion device is given up.
    pub fn deadline(&self) -> Option<MonotonicTime> {
        match self {
            Self::Closed | Self::Open(_) => None,
            Self::Opening(_, asked) | Self::Closing(_, asked) => Some(asked.deadline),
        }
    }
}

/// An explicit (class 3) connection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Explicit {
    /// From 1, the same as long as the connection lives; 0 is the motion connection.
    pub number: u16,
    pub session: SessionSlot,
    pub peer: SocketAddrV4,
    pub triad: ConnectionTriad,
    pub o_to_t_id: u32,
    pub t_to_o_id: u32,
    /// Largest message to be received, sequence count included.
    pub o_to_t_size: u16,
    /// Largest message to be sent, sequence count included.
    pub t_to_o_size: u16,
    /// Packet intervals in microseconds, O->T and T->O.
    pub intervals_us: (u32, u32),
    /// Time-out multiplier code of the Forward_Open.
    pub multiplier: u8,
    pub timeout: DurationNs,
    /// When the last message came, or the connection was opened.
    pub heard: MonotonicTime,
    /// When the connection is over without another message.
    pub deadline: MonotonicTime,
    pub last_sequence: Option<u16>,
    pub last_reply: Vec<u8>,
}

/// All connections.
#[derive(Debug)]
pub(crate) struct ConnectionManager {
    pub motion: Motion,
    /// Whether the last motion connection has timed out, until the next one.
    pub motion_lost: bool,
    /// Input-only and listen-only connections to assemblies; none of them is closed.
    pub listeners: Vec<Motion>,
    pub explicit: Vec<Explicit>,
    next_id: u32,
    /// What connection IDs are drawn with; without it they count up.
    secret: Option<u64>,
}

impl ConnectionManager {
    pub fn new(incarnation: u16) -> Self {
        let next_id = u32::from(incarnation) << 16 | 1;
        let explicit = Vec::with_capacity(EXPLICIT_CONNECTIONS_MAX);
        let listeners = Vec::with_capacity(LISTENERS_MAX);
        Self { motion: Motion::Closed, motion_lost: false, listeners, explicit, next_id, secret: None }
    }

    /// Draws connection IDs with a secret from now on: nobody gets that of another's connection out of its own.
    pub fn set_secret(&mut self, secret: u64) {
        self.secret = Some(secret);
    }

    /// A connection ID nobody uses.
    pub fn new_id(&mut self) -> u32 {
        loop {
            let id = self.secret.map_or(self.next_id, |secret| drawn(self.next_id, secret));
            self.next_id = self.next_id.wrapping_add(1);
            let motion = self.all_io().any(|open| open.o_to_t_id == id);
            if id != 0 && !motion && self.explicit.iter().all(|one| one.o_to_t_id != id) {
                return id;
            }
        }
    }

    /// Whether a connection of this triad lives.
    pub fn has(&self, triad: ConnectionTriad) -> bool {
        self.all_io().any(|open| open.triad == triad) || self.explicit.iter().any(|one| one.triad == triad)
    }

    /// The motion connection, or that of the owner of assemblies, and those that listen.
    pub fn io(&self) -> impl Iterator<Item = &Motion> {
        std::iter::once(&self.motion).chain(&self.listeners).filter(|one| **one != Motion::Closed)
    }

    fn all_io(&self) -> impl Iterator<Item = &OpenParameters> {
        self.io().filter_map(Motion::parameters)
    }

    /// Number of another connection that listens.
    pub fn listener_number(&self) -> u16 {
        let taken = |number: u16| self.io().filter_map(Motion::owner).any(|owner| owner.number == number);
        // There are as many numbers as places, and a place is free.
        (CONNECTIONS_MAX..ASSEMBLY_CONNECTIONS_MAX).find(|number| !taken(*number)).unwrap_or(CONNECTIONS_MAX)
    }

    /// Fails unless another connection to assemblies can be opened in this role.
    pub fn check_assembly(&self, role: AssemblyRole) -> Result<(), Refusal> {
        let opens = |one: &Motion| {
            let assembly = one.parameters().and_then(|open| open.assembly);
            assembly.is_some_and(|open| open.role != AssemblyRole::ListenOnly)
        };
        match role {
            AssemblyRole::ExclusiveOwner => return self.check_owner(),
            AssemblyRole::ListenOnly if !std::iter::once(&self.motion).chain(&self.listeners).any(opens) => {
                return Err(Refusal::connection(ConnectionStatus::NON_LISTEN_ONLY_NOT_OPENED));
            }
            AssemblyRole::InputOnly | AssemblyRole::ListenOnly => {}
        }
        if self.listeners.len() >= LISTENERS_MAX {
            return Err(Refusal::connection(ConnectionStatus::OUT_OF_CONNECTIONS));
        }
        Ok(())
    }

    /// A connection that consumes the multicast stream, while there is one that goes on.
    pub fn stream(&self) -> Option<&OpenParameters> {
        let goes_on = self.io().filter(|one| matches!(one, Motion::Opening(..) | Motion::Open(_)));
        goes_on.filter_map(Motion::parameters).find(|open| open.group().is_some())
    }

    /// The state of the connection to assemblies, or of the motion connection, of this triad.
    pub fn io_of(&mut self, triad: ConnectionTriad) -> Option<&mut Motion> {
        let of = |one: &&mut Motion| one.parameters().is_some_and(|open| open.triad == triad);
        std::iter::once(&mut self.motion).chain(&mut self.listeners).find(of)
    }

    /// Fails unless the motion connection is free.
    pub fn check_owner(&self) -> Result<(), Refusal> {
        match self.motion {
            Motion::Closed => Ok(()),
            _ => Err(Refusal::connection(ConnectionStatus::OWNERSHIP_CONFLICT)),
        }
    }

    /// Opens an explicit connection.
    pub fn open_explicit(
        &mut self,
        now: MonotonicTime,
        session: SessionSlot,
        peer: SocketAddrV4,
        open: &ForwardOpen<'_>,
    ) -> Result<u32, Refusal> {
        check_explicit(open)?;
        let of_session = self.explicit.iter().filter(|one| one.session == session).count();
        if self.explicit.len() >= EXPLICIT_CONNECTIONS_MAX || of_session >= EXPLICIT_PER_SESSION_MAX {
            return Err(Refusal::connection(ConnectionStatus::OUT_OF_CONNECTIONS));
        }
        let timeout = timeout_ns(open);
        let o_to_t_id = self.new_id();
        let free = |number: &u16| self.explicit.iter().all(|one| one.number != *number);
        // There are as many numbers as places, and a place is free.
        let number = (1..=CONNECTIONS_MAX).find(free).unwrap_or(CONNECTIONS_MAX);
        self.explicit.push(Explicit {
            number,
            session,
            peer,
            triad: open.triad,
            o_to_t_id,
            t_to_o_id: open.t_to_o_id,
            o_to_t_size: open.o_to_t.size,
            t_to_o_size: open.t_to_o.size,
            intervals_us: (open.o_to_t_rpi_us, open.t_to_o_rpi_us),
            multiplier: open.timeout_multiplier,
            timeout,
            heard: now,
            deadline: now + timeout.max(FIRST_MESSAGE_TIMEOUT),
            last_sequence: None,
            last_reply: Vec::new(),
        });
        Ok(o_to_t_id)
    }

    /// The explicit connection with this O->T ID, if it belongs to `session`.
    pub fn explicit_mut(&mut self, session: SessionSlot, o_to_t_id: u32) -> Option<&mut Explicit> {
        self.explicit.iter_mut().find(|one| one.session == session && one.o_to_t_id == o_to_t_id)
    }

    /// Closes the explicit connection of this triad, if it was opened from that address.
    pub fn close_explicit(&mut self, triad: ConnectionTriad, peer: Ipv4Addr) -> bool {
        let found = self.explicit.iter().position(|one| one.triad == triad && *one.peer.ip() == peer);
        found.map(|at| self.explicit.swap_remove(at)).is_some()
    }

    /// Closes the explicit connections of a session that has ended.
    pub fn close_session(&mut self, session: SessionSlot) {
        self.explicit.retain(|one| one.session != session);
    }

    /// Takes out one explicit connection whose time is up.
    pub fn take_expired(&mut self, now: MonotonicTime) -> Option<Explicit> {
        let at = self.explicit.iter().position(|one| one.deadline <= now)?;
        Some(self.explicit.swap_remove(at))
    }

    /// When the next connection, or the motion device's answer about one, times out.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        let listeners = self.listeners.iter().filter_map(Motion::deadline);
        self.explicit.iter().map(|one| one.deadline).chain(self.motion.deadline()).chain(listeners).min()
    }
}

/// The number in the place of `number` in an order of all numbers that follows from the secret: two halves of 16 bits, mixed
/// into each other (a Feistel network), which gives no number twice.
fn drawn(number: u32, secret: u64) -> u32 {
    let [a, b, c, d] = number.to_le_bytes();
    let mut halves = [u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])];
    for round in 0..6_u64 {
        // SplitMix64.
        let mut mixed =
            secret.wrapping_add((round << 16 | u64::from(halves[1])).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        mixed = (mixed ^ mixed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        let [low, high, ..] = (mixed ^ mixed >> 31).to_le_bytes();
        halves = [halves[1], halves[0] ^ u16::from_le_bytes([low, high])];
    }
    u32::from(halves[0]) << 16 | u32::from(halves[1])
}

/// Interval times multiplier, in nanoseconds; the multiplier has been checked before.
pub(crate) fn timeout_ns(open: &ForwardOpen<'_>) -> DurationNs {
    DurationNs::from_micros(i64::from(open.o_to_t_rpi_us)) * i64::from(open.multiplier().unwrap_or(4))
}

fn check_explicit(open: &ForwardOpen<'_>) -> Result<(), Refusal> {
    if open.transport.class != 3 {
        let found = u32::from(open.transport.class);
        return Err(Refusal::value(ConnectionStatus::CLASS_NOT_SUPPORTED, found, 3));
    }
    if !open.transport.server {
        return Err(Refusal::value(ConnectionStatus::DIRECTION_NOT_SUPPORTED, 0, 1));
    }
    if open.transport.trigger.0 > Trigger::APPLICATION.0 {
        let found = u32::from(open.transport.trigger.0);
        return Err(Refusal::value(ConnectionStatus::TRIGGER_NOT_SUPPORTED, found, 2));
    }
    for (parameters, wrong_type, wrong_size) in [
        (open.o_to_t, ConnectionStatus::INVALID_O_TO_T_TYPE, ConnectionStatus::INVALID_O_TO_T_SIZE),
        (open.t_to_o, ConnectionStatus::INVALID_T_TO_O_TYPE, ConnectionStatus::INVALID_T_TO_O_SIZE),
    ] {
        if parameters.connection_type != ConnectionType::POINT_TO_POINT {
            return Err(Refusal::value(wrong_type, u32::from(parameters.connection_type.0), 2));
        }
        if parameters.redundant_owner {
            return Err(Refusal::value(ConnectionStatus::INVALID_REDUNDANT_OWNER, 1, 0));
        }
        let nearest = parameters.size.clamp(EXPLICIT_SIZE_MIN, EXPLICIT_SIZE_MAX);
        if parameters.size != nearest {
            return Err(Refusal::size(wrong_size, parameters.size, nearest));
        }
    }
    if open.multiplier().is_none() {
        let found = u32::from(open.timeout_multiplier);
        return Err(Refusal::value(ConnectionStatus::MULTIPLIER_NOT_ACCEPTABLE, found, 7));
    }
    if open.o_to_t_rpi_us == 0 {
        return Err(Refusal::intervals(0, 10_000, open.t_to_o_rpi_us.max(10_000)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn drawn_connection_ids_never_repeat_and_do_not_follow_from_each_other() {
        let ids = |secret| {
            let mut manager = ConnectionManager::new(0x7A00);
            manager.set_secret(secret);
            (0..20_000).map(|_| manager.new_id()).collect::<Vec<_>>()
        };
        let one = ids(1);
        assert_eq!(one.iter().collect::<BTreeSet<_>>().len(), one.len());
        assert_eq!(one, ids(1));
        let other = ids(2);
        assert!(one.iter().zip(&other).filter(|(a, b)| a == b).count() < 3);
        // Of the steps from one to the next no one is frequent, and half of the bits change.
        let steps: BTreeSet<_> = one.windows(2).map(|pair| pair[1].wrapping_sub(pair[0])).collect();
        assert!(steps.len() > one.len() - 100, "{}", steps.len());
        let changed: u32 = one.windows(2).map(|pair| (pair[0] ^ pair[1]).count_ones()).sum();
        assert!((15 * 20_000..17 * 20_000).contains(&changed), "{changed}");
        let whole: BTreeSet<_> = (0..=u16::MAX).map(|low| drawn(u32::from(low), 3)).collect();
        assert_eq!(whole.len(), 0x1_0000);
    }
}
