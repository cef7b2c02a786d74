//! The class-1 connections that a recording has opened.

use std::collections::VecDeque;
use std::net::Ipv4Addr;

use profile_cip::wire::ConnectionTriad;
use profile_cip::wire::forward_open::ForwardOpen;

use super::explicit::last_class;

/// Connections followed at once; the oldest is forgotten.
const CONNECTIONS_MAX: usize = 256;

/// Class of the Motion Device Axis Object.
pub(super) const CLASS_MOTION: u32 = 0x42;

/// What a Forward_Open asks for, as far as the data need it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Opening {
    pub triad: ConnectionTriad,
    pub transport_class: u8,
    pub motion: bool,
}

impl Opening {
    pub fn new(open: &ForwardOpen<'_>) -> Self {
        Self {
            triad: open.triad,
            transport_class: open.transport.class,
            motion: last_class(open.path) == Some(CLASS_MOTION),
        }
    }
}

/// A connection with the ends and IDs of its data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Connection {
    pub opening: Opening,
    pub originator: Ipv4Addr,
    pub target: Ipv4Addr,
    pub o_to_t_id: u32,
    pub t_to_o_id: u32,
}

/// Which way data go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    OriginatorToTarget,
    TargetToOriginator,
}

/// The open connections, the latest last.
#[derive(Debug, Default)]
pub(super) struct Connections(VecDeque<Connection>);

impl Connections {
    pub fn opened(&mut self, connection: Connection) {
        self.closed(&connection.opening.triad);
        if self.0.len() == CONNECTIONS_MAX {
            self.0.pop_front();
        }
        self.0.push_back(connection);
    }

    pub fn closed(&mut self, triad: &ConnectionTriad) {
        self.0.retain(|connection| connection.opening.triad != *triad);
    }

    /// The connection of a datagram. Targets choose their IDs alone, so the ends must fit as well; a T->O
    /// datagram may be multicast.
    pub fn find(&self, id: u32, from: Ipv4Addr, to: Ipv4Addr) -> Option<(Connection, Direction)> {
        self.0.iter().rev().find_map(|connection| {
            if connection.o_to_t_id == id && connection.originator == from && connection.target == to {
                Some((*connection, Direction::OriginatorToTarget))
            } else if connection.t_to_o_id == id
                && connection.target == from
                && (connection.originator == to || to.is_multicast())
            {
                Some((*connection, Direction::TargetToOriginator))
            } else {
                None
            }
        })
    }
}
