//! Which datagrams are the owner's: the second look, behind the filter of the kernel ([`crate::sys::gate`]).
//!
//! A datagram is of the motion connection when it comes from the address of its Forward_Open, carries its connection ID, and
//! comes from the source port of the first update that the motion device took. No document fixes that port: many
//! controllers send from UDP 2222, others from any port, and the sockaddr items of the Forward_Open name the ports at which
//! data are received. So it is learned once for the life of the connection.
//!
//! The filter does the same, a few milliseconds later: what is refused here came before it was set, or is one of its
//! samples.

use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4};

use profile_cip::device::motion_link::OpenParameters;
use profile_cip::wire::class1::Class1Datagram;
use profile_generic::time::MonotonicTime;

use crate::log_limit::LogLimit;

/// Why a datagram is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// No motion connection is open.
    NoConnection,
    /// It comes from another address.
    Address {
        /// That of the owner.
        expected: Ipv4Addr,
    },
    /// It comes from another port of the owner's address.
    Port {
        /// That of the owner's updates.
        expected: u16,
    },
    /// It is no class 1 datagram, or too long for one.
    Malformed,
    /// It is not behind the last one of its connection.
    Old,
    /// Its data have a wrong length.
    Size {
        /// Bytes of the data with their header.
        expected: usize,
        /// Bytes that it carries.
        found: usize,
    },
    /// It is of another connection.
    ConnectionId {
        /// ID of the open connection.
        expected: u32,
        /// ID that it carries.
        found: u32,
    },
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoConnection => f.write_str("no motion connection is open"),
            Self::Address { expected } => write!(f, "the motion connection belongs to {expected}"),
            Self::Port { expected } => {
                write!(f, "the updates of the motion connection come from port {expected}")
            }
            Self::Malformed => f.write_str("expected a class 1 datagram"),
            Self::Old => f.write_str("expected a later encapsulation sequence number"),
            Self::Size { expected, found } => write!(f, "expected {expected} bytes of data, found {found}"),
            Self::ConnectionId { expected, found } => {
                write!(f, "expected connection ID {expected:#010X}, found {found:#010X}")
            }
        }
    }
}

/// Decides about the datagrams of one device, and counts what it refuses.
#[derive(Debug, Default)]
pub(super) struct Admission {
    /// Connection ID and address of the connection that was open last, and the source port of its updates once it is known.
    owner: Option<(u32, Ipv4Addr, Option<u16>)>,
    refused: u64,
    last: Option<(SocketAddrV4, Refused)>,
    limit: LogLimit,
}

impl Admission {
    /// Datagrams refused so far.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Checks whether a datagram is of this connection.
    pub fn check(
        &self,
        connection: Option<&OpenParameters>,
        bytes: &[u8],
        from: SocketAddrV4,
    ) -> Result<(), Refused> {
        let connection = connection.ok_or(Refused::NoConnection)?;
        if *from.ip() != connection.originator {
            return Err(Refused::Address { expected: connection.originator });
        }
        match self.port(connection.o_to_t_id) {
            Some(expected) if from.port() != expected => return Err(Refused::Port { expected }),
            _ => {}
        }
        let found = Class1Datagram::parse(bytes).map_err(|_| Refused::Malformed)?.connection_id;
        if found != connection.o_to_t_id {
            return Err(Refused::ConnectionId { expected: connection.o_to_t_id, found });
        }
        Ok(())
    }

    /// Source port of the updates of a connection, where it is known.
    fn port(&self, connection_id: u32) -> Option<u16> {
        self.owner.filter(|(id, ..)| *id == connection_id).and_then(|(.., port)| port)
    }

    /// The motion device has taken an update of this connection from this port; whether the port was not known before.
    pub fn learn(&mut self, connection_id: u32, from: SocketAddrV4) -> bool {
        let new = self.port(connection_id).is_none();
        if new {
            self.owner = Some((connection_id, *from.ip(), Some(from.port())));
        }
        new
    }

    /// Counts a refused datagram. The last ones of a connection that has just ended are not worth a line.
    pub fn refuse(&mut self, now: MonotonicTime, from: SocketAddrV4, why: Refused) {
        self.refused += 1;
        let former = self.owner.is_some_and(|(_, address, _)| address == *from.ip());
        if !(former && why == Refused::NoConnection) {
            self.last = Some((from, why));
            self.limit.add(now, 1);
        }
    }

    /// How many were refused, the sender of the last one and why: for the log, a minute after the last time at the earliest.
    pub fn strangers(&mut self, now: MonotonicTime) -> Option<(u64, SocketAddrV4, Refused)> {
        let count = self.limit.take(now)?;
        let (from, why) = self.last?;
        Some((count, from, why))
    }
}
