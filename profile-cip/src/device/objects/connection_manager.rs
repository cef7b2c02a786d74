//! What the Connection Manager tells of its connections: counters, which ones are open, and the data of one.
//!
//! Reply of Get_Connection_Data (by number) and Search_Connection_Data (by triad):
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | connection number: 0 the motion connection or the owner of assemblies, 1 to 32 the explicit ones, from 33 those that listen |
//! | 2 | 2 | state: 1 configuring, 3 established, 6 closing |
//! | 4 | 2 | originator port: where the request to open came from |
//! | 6 | 2 | target port: where this device takes the connection's messages |
//! | 8 | 8 | triad |
//! | 16 | 4 | O->T connection ID of the originator |
//! | 20 | 4 | O->T connection ID of the target |
//! | 24 | 1 | time-out multiplier code |
//! | 25 | 3 | reserved |
//! | 28 | 4 | O->T requested packet interval in microseconds |
//! | 32 | 4 | O->T actual packet interval in microseconds |
//! | 36 | 20 | the same from offset 16 on for T->O |
//!
//! Whoever knows a connection ID can forge data of the connection. Therefore the four IDs are 0 in the reply to a client
//! with another address than the connection's originator.

use core::net::Ipv4Addr;

use super::object::{Answer, Object, data_status};
use crate::device::config::InterfaceConfig;
use crate::device::connection::manager::{ConnectionManager, Explicit, Motion, Owner};
use crate::device::counters::Counters;
use crate::device::motion_link::ConnectionTriad;
use crate::wire::status::GeneralStatus;
use crate::wire::{Reader, Writer};

/// Bytes of the reply data.
const CONNECTION_DATA_LEN: usize = 56;

/// States of a connection as the reply has them.
const CONFIGURING: u16 = 1;
const ESTABLISHED: u16 = 3;
const CLOSING: u16 = 6;

/// Attributes of the Connection Manager.
pub(crate) struct Statistics<'a> {
    pub counters: &'a Counters,
    pub connections: &'a ConnectionManager,
    /// Connections there can be.
    pub available: u16,
}

impl Object for Statistics<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[1, 2, 3, 4, 5, 6, 7, 8, 9];
    const ATTRIBUTE_MAX: u16 = 9;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let c = self.counters;
        let count = match attribute {
            1 => c.open_requests,
            2 => c.open_format_rejects,
            3 => c.open_resource_rejects,
            4 => c.open_other_rejects,
            5 => c.close_requests,
            6 => c.close_format_rejects,
            7 => c.close_other_rejects,
            8 => c.connection_timeouts,
            9 => {
                self.entry_list(out);
                return Ok(());
            }
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        };
        // The attributes are 16 bits wide and start over.
        let [low, high, ..] = count.to_le_bytes();
        out.extend([low, high]);
        Ok(())
    }
}

impl Statistics<'_> {
    /// Connection Entry List: how many connections there can be, and a bit for each that is open.
    fn entry_list(&self, out: &mut Vec<u8>) {
        out.extend(self.available.to_le_bytes());
        let mut bits = vec![0_u8; usize::from(self.available.div_ceil(8))];
        let io = self.connections.io().filter_map(Motion::owner).map(|owner| owner.number);
        for number in self.connections.explicit.iter().map(|one| one.number).chain(io) {
            if let Some(byte) = bits.get_mut(usize::from(number / 8)) {
                *byte |= 1 << (number % 8);
            }
        }
        out.extend(bits);
    }
}

/// Get_Connection_Data: the connection with this number.
pub(crate) fn get(
    connections: &ConnectionManager,
    interface: &InterfaceConfig,
    client: Ipv4Addr,
    data: &[u8],
) -> Answer {
    let mut r = Reader::new(data);
    let number = match r.u16("connection number").and_then(|number| r.finish("request").map(|()| number)) {
        Ok(number) => number,
        Err(error) => return Answer::status(data_status(error)),
    };
    let explicit = connections.explicit.iter().find(|one| one.number == number);
    let io = connections.io().find(|one| one.owner().is_some_and(|owner| owner.number == number));
    answer(interface, client, io, explicit)
}

/// Search_Connection_Data: the connection of this triad.
pub(crate) fn search(
    connections: &ConnectionManager,
    interface: &InterfaceConfig,
    client: Ipv4Addr,
    data: &[u8],
) -> Answer {
    let mut r = Reader::new(data);
    let triad = match ConnectionTriad::read(&mut r).and_then(|triad| r.finish("request").map(|()| triad)) {
        Ok(triad) => triad,
        Err(error) => return Answer::status(data_status(error)),
    };
    let io = connections.io().find(|one| one.parameters().is_some_and(|open| open.triad == triad));
    let explicit = connections.explicit.iter().find(|one| one.triad == triad);
    answer(interface, client, io, explicit)
}

fn answer(
    interface: &InterfaceConfig,
    client: Ipv4Addr,
    io: Option<&Motion>,
    explicit: Option<&Explicit>,
) -> Answer {
    let mut data = match (io, explicit) {
        (Some(Motion::Opening(owner, _)), _) => io_data(owner, CONFIGURING, interface),
        (Some(Motion::Open(owner)), _) => io_data(owner, ESTABLISHED, interface),
        (Some(Motion::Closing(owner, _)), _) => io_data(owner, CLOSING, interface),
        (_, Some(explicit)) => explicit_data(explicit, interface),
        (Some(Motion::Closed) | None, None) => {
            return Answer::status(GeneralStatus::PATH_DESTINATION_UNKNOWN);
        }
    };
    if client != data.originator {
        data.ids = (0, 0);
    }
    let mut bytes = vec![0; CONNECTION_DATA_LEN];
    match data.write(&mut Writer::new(&mut bytes)) {
        Ok(()) => Answer::done(bytes),
        Err(_) => Answer::status(GeneralStatus::REPLY_DATA_TOO_LARGE),
    }
}

struct ConnectionData {
    number: u16,
    state: u16,
    originator: Ipv4Addr,
    ports: (u16, u16),
    triad: ConnectionTriad,
    ids: (u32, u32),
    multiplier: u8,
    intervals_us: (u32, u32),
}

fn io_data(owner: &Owner, state: u16, interface: &InterfaceConfig) -> ConnectionData {
    let open = &owner.open;
    let t_to_o_us = open.assembly.map_or(open.rpi_us, |assembly| assembly.t_to_o_rpi_us);
    ConnectionData {
        number: owner.number,
        state,
        originator: *owner.peer.ip(),
        ports: (owner.peer.port(), interface.io_port),
        triad: open.triad,
        ids: (open.o_to_t_id, open.t_to_o_id),
        multiplier: owner.multiplier,
        intervals_us: (open.rpi_us, t_to_o_us),
    }
}

fn explicit_data(explicit: &Explicit, interface: &InterfaceConfig) -> ConnectionData {
    ConnectionData {
        number: explicit.number,
        state: ESTABLISHED,
        originator: *explicit.peer.ip(),
        ports: (explicit.peer.port(), interface.explicit_port),
        triad: explicit.triad,
        ids: (explicit.o_to_t_id, explicit.t_to_o_id),
        multiplier: explicit.multiplier,
        intervals_us: explicit.intervals_us,
    }
}

impl ConnectionData {
    fn write(&self, w: &mut Writer<'_>) -> Result<(), crate::wire::Error> {
        w.u16("connection number", self.number)?;
        w.u16("state", self.state)?;
        w.u16("originator port", self.ports.0)?;
        w.u16("target port", self.ports.1)?;
        self.triad.write(w)?;
        for (id, interval_us) in [(self.ids.0, self.intervals_us.0), (self.ids.1, self.intervals_us.1)] {
            // Both ends use the ID that one of them has chosen, and the actual interval is the requested one.
            w.u32("connection ID of the originator", id)?;
            w.u32("connection ID of the target", id)?;
            w.u8("time-out multiplier", self.multiplier)?;
            w.zeros("reserved", 3)?;
            w.u32("requested interval", interval_us)?;
            w.u32("actual interval", interval_us)?;
        }
        Ok(())
    }
}
