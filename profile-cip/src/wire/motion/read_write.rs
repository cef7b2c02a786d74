//! Cyclic write data block (C-to-D) and cyclic read data block (D-to-C), clauses 6-2.7.1.2.3 and 6-2.7.2.1.6.
//!
//! | offset | C-to-D | D-to-C |
//! |---|---|---|
//! | 0 | cyclic write block ID | cyclic write block ID |
//! | 1 | reserved | cyclic write status |
//! | 2 | cyclic read block ID | cyclic read block ID |
//! | 3 | reserved | cyclic read status |
//! | 4 | values, laid out by the attribute list of the ID | values |
//!
//! The layout of the values is agreed by the Set_Cyclic_Write_List and Set_Cyclic_Read_List services, so they are
//! octets here.

use core::fmt;

use crate::wire::status::GeneralStatus;
use crate::wire::{Error, Reader, Writer};

/// Octets of either block without values.
pub const HEADER_LEN: usize = 4;
const WRITE: &str = "cyclic write block";
const READ: &str = "cyclic read block";

/// Cyclic write data block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WriteBlock<'a> {
    /// Layout of `data`; 0 is the empty layout.
    pub write_block_id: u8,
    /// Layout asked for in the next D-to-C update; 0 is the empty layout.
    pub read_block_id: u8,
    /// Values, padded to 32 bits.
    pub data: &'a [u8],
}

/// Cyclic read data block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadBlock<'a> {
    /// Layout of the last C-to-D write data.
    pub write_block_id: u8,
    /// General status of that write; 0 is success.
    pub write_status: u8,
    /// Layout of `data`.
    pub read_block_id: u8,
    /// General status of the read; if not 0 there is no data.
    pub read_status: u8,
    /// Values, padded to 32 bits.
    pub data: &'a [u8],
}

/// Octets of `data` when padded to whole 32-bit words.
fn padded(data: &[u8]) -> usize {
    data.len().next_multiple_of(4)
}

fn emit_data(writer: &mut Writer<'_>, what: &'static str, data: &[u8]) -> Result<(), Error> {
    writer.slice(what, data)?;
    writer.zeros(what, padded(data) - data.len())
}

impl<'a> WriteBlock<'a> {
    /// Reads a block; all that follows the header is data.
    ///
    /// # Errors
    /// There are fewer than four octets.
    pub fn parse(block: &'a [u8]) -> Result<Self, Error> {
        let mut reader = Reader::new(block);
        let [write_block_id, _, read_block_id, _] = reader.array(WRITE)?;
        Ok(Self { write_block_id, read_block_id, data: reader.rest() })
    }

    /// Octets that [`WriteBlock::emit`] writes; a multiple of four.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN + padded(self.data)
    }

    /// Writes the block and pads it to 32 bits.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.slice(WRITE, &[self.write_block_id, 0, self.read_block_id, 0])?;
        emit_data(writer, WRITE, self.data)
    }
}

impl<'a> ReadBlock<'a> {
    /// Reads a block; all that follows the header is data.
    ///
    /// # Errors
    /// There are fewer than four octets.
    pub fn parse(block: &'a [u8]) -> Result<Self, Error> {
        let mut reader = Reader::new(block);
        let [write_block_id, write_status, read_block_id, read_status] = reader.array(READ)?;
        Ok(Self { write_block_id, write_status, read_block_id, read_status, data: reader.rest() })
    }

    /// Octets that [`ReadBlock::emit`] writes; a multiple of four.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        HEADER_LEN + padded(self.data)
    }

    /// Writes the block and pads it to 32 bits.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer
            .slice(READ, &[self.write_block_id, self.write_status, self.read_block_id, self.read_status])?;
        emit_data(writer, READ, self.data)
    }
}

impl fmt::Display for WriteBlock<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "    Cyclic Write Block {}, asks for Cyclic Read Block {}",
            self.write_block_id, self.read_block_id
        )?;
        writeln!(f, "      data {:02X?}", self.data)
    }
}

impl fmt::Display for ReadBlock<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "    Cyclic Write Block {}: {}", self.write_block_id, GeneralStatus(self.write_status))?;
        writeln!(f, "    Cyclic Read Block {}: {}", self.read_block_id, GeneralStatus(self.read_status))?;
        writeln!(f, "      data {:02X?}", self.data)
    }
}
