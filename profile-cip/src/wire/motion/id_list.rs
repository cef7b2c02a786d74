//! Bodies of Set_Cyclic_Write_List (0x4D), Set_Cyclic_Read_List (0x4E) and Group_Sync (0x1C), clauses 5-2.5.1.3,
//! 5-2.5.1.4 and 5-2.4.1.1.
//!
//! | body | content |
//! |---|---|
//! | list request | number of attributes u16, reserved u16, then IDs u16 |
//! | list response | number of attributes u16, block ID u16 (8 bits used), then per attribute ID u16, status u8, reserved u8 |
//! | Group_Sync request | grand master clock ID, 8 octets as they come from the Time Sync object |
//! | Group_Sync response | sync status u8 |

use crate::wire::{Error, Reader, Writer};

const BODY: &str = "cyclic list";
const SYNC: &str = "Group_Sync body";

/// The attribute IDs of a Set_Cyclic_Write_List or Set_Cyclic_Read_List request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IdList<'a> {
    ids: &'a [u8],
}

/// Answer to one ID of such a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IdStatus {
    /// Attribute ID.
    pub id: u16,
    /// General status; 0 if the attribute can be transferred cyclically.
    pub status: u8,
}

/// The answers of a Set_Cyclic_Write_List or Set_Cyclic_Read_List response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IdStatusList<'a> {
    /// Block ID in force after the request.
    pub block_id: u8,
    items: &'a [u8],
}

impl<'a> IdList<'a> {
    /// Reads a request body. Padding behind an odd number of IDs is permitted.
    ///
    /// # Errors
    /// The octets are too few for the announced number.
    pub fn parse(body: &'a [u8]) -> Result<Self, Error> {
        let mut reader = Reader::new(body);
        let count = usize::from(reader.u16(BODY)?);
        reader.u16(BODY)?;
        Ok(Self { ids: reader.take(BODY, 2 * count)? })
    }

    /// The IDs in order.
    pub fn iter(&self) -> impl Iterator<Item = u16> + use<'a> {
        self.ids.chunks_exact(2).map(|c| u16::from_le_bytes([c[0], c[1]]))
    }

    /// Number of IDs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ids.len() / 2
    }

    /// Whether there is no ID.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Writes a request body and returns its octets.
    ///
    /// # Errors
    /// The buffer is too short, or there are more than 65535 IDs.
    pub fn emit(buffer: &mut [u8], ids: &[u16]) -> Result<usize, Error> {
        let mut writer = Writer::new(buffer);
        writer.u16(BODY, count(ids.len())?)?;
        writer.u16(BODY, 0)?;
        for id in ids {
            writer.u16(BODY, *id)?;
        }
        writer.zeros(BODY, 2 * (ids.len() % 2))?;
        Ok(writer.written())
    }
}

fn count(len: usize) -> Result<u16, Error> {
    let value = u32::try_from(len).unwrap_or(u32::MAX);
    u16::try_from(len).map_err(|_| Error::too_large(BODY, u32::from(u16::MAX), value))
}

impl<'a> IdStatusList<'a> {
    /// Reads a response body.
    ///
    /// # Errors
    /// The octets are too few for the announced number.
    pub fn parse(body: &'a [u8]) -> Result<Self, Error> {
        let mut reader = Reader::new(body);
        let count = usize::from(reader.u16(BODY)?);
        let [block_id, _] = reader.u16(BODY)?.to_le_bytes();
        Ok(Self { block_id, items: reader.take(BODY, 4 * count)? })
    }

    /// The answers in order.
    pub fn iter(&self) -> impl Iterator<Item = IdStatus> + use<'a> {
        self.items.chunks_exact(4).map(|c| IdStatus { id: u16::from_le_bytes([c[0], c[1]]), status: c[2] })
    }

    /// Writes a response body and returns its octets.
    ///
    /// # Errors
    /// The buffer is too short, or there are more than 65535 answers.
    pub fn emit(buffer: &mut [u8], block_id: u8, items: &[IdStatus]) -> Result<usize, Error> {
        let mut writer = Writer::new(buffer);
        writer.u16(BODY, count(items.len())?)?;
        writer.u16(BODY, u16::from(block_id))?;
        for item in items {
            writer.u16(BODY, item.id)?;
            writer.slice(BODY, &[item.status, 0])?;
        }
        Ok(writer.written())
    }
}

/// Reads the grand master clock ID of a Group_Sync request.
///
/// # Errors
/// There are not eight octets.
pub fn parse_group_sync(body: &[u8]) -> Result<[u8; 8], Error> {
    let mut reader = Reader::new(body);
    let id = reader.array(SYNC)?;
    reader.finish(SYNC)?;
    Ok(id)
}
