//! The connection triad: what identifies a connection at its originator.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 2 | connection serial number |
//! | 2 | 2 | originator vendor ID |
//! | 4 | 4 | originator serial number |
//!
//! Forward_Open, Forward_Close and all their replies carry it in this order.

use super::{Error, Reader, Writer};
use core::fmt;

/// Length of the triad in bytes.
pub const TRIAD_LEN: usize = 8;

/// What identifies a connection at its originator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ConnectionTriad {
    /// Connection serial number, chosen by the originator.
    pub connection_serial: u16,
    /// Vendor ID of the originator.
    pub originator_vendor: u16,
    /// Serial number of the originator.
    pub originator_serial: u32,
}

impl ConnectionTriad {
    /// Reads the triad where `reader` stands.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn read(reader: &mut Reader<'_>) -> Result<Self, Error> {
        Ok(Self {
            connection_serial: reader.u16("connection serial number")?,
            originator_vendor: reader.u16("originator vendor ID")?,
            originator_serial: reader.u32("originator serial number")?,
        })
    }

    /// Writes the triad where `writer` stands.
    ///
    /// # Errors
    /// [`Error::truncated`].
    pub fn write(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.u16("connection serial number", self.connection_serial)?;
        writer.u16("originator vendor ID", self.originator_vendor)?;
        writer.u32("originator serial number", self.originator_serial)
    }
}

impl fmt::Display for ConnectionTriad {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "connection {:#06x} of vendor {:#06x} serial {:#010x}",
            self.connection_serial, self.originator_vendor, self.originator_serial
        )
    }
}
