//! SDO: what client and server say to each other. Every frame has eight bytes.
//!
//! Bits 7..5 of the first byte are the command specifier. Client to server:
//!
//! | cs | 4 | 3..2 | 1 | 0 | bytes 1..3 | bytes 4..7 | |
//! |---|---|---|---|---|---|---|---|
//! | 0 | toggle | unused bytes, 3 bits | | last | data from byte 1 | | download segment |
//! | 1 | 0 | unused bytes | expedited | size told | multiplexer | data or size | initiate download |
//! | 2 | | | | | multiplexer | | initiate upload |
//! | 3 | toggle | | | | | | upload segment |
//! | 4 | | | | | multiplexer | abort code | abort |
//! | 5 | | CRC | 0: initiate; 1 end, 2 acknowledge, 3 start | | multiplexer | block size, switch threshold | block upload |
//! | 6 | unused bytes, 3 bits | CRC | size told | 0 initiate, 1 end | multiplexer or CRC | size | block download |
//!
//! Server to client: 0 upload segment, 1 download segment acknowledged, 2 initiate upload, 3 initiate download, 4 abort, 5 block
//! download, 6 block upload. The segments of a block carry a sequence number in place of the command specifier; only who waits
//! for them can know them: [`BlockSegment`].

mod request;
mod response;
#[cfg(test)]
mod tests;

use core::fmt;

pub use self::request::SdoRequest;
pub use self::response::SdoResponse;
use super::abort::AbortCode;
use super::bytes::Bytes;
use super::mux::Mux;
use profile_generic::wire::{Error, exact, u32_at};

/// Bytes of every frame.
pub const SDO_LEN: usize = 8;

/// Bytes of an object that fit into the first frame of a transfer.
pub const EXPEDITED_MAX: usize = 4;

/// Bytes of an object in a segment.
pub const SEGMENT_LEN: usize = 7;

/// Most segments of a block.
pub const BLOCK_MAX: u8 = 127;

/// CRC-16/XMODEM of the bytes of a block transfer (polynomial 1021, initial value 0), continued from `crc`.
#[must_use]
pub fn crc16(crc: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(crc, |crc, &byte| {
        (0..8).fold(
            crc ^ u16::from(byte) << 8,
            |crc, _| {
                if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x1021 }
            },
        )
    })
}

/// How a transfer begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Transfer {
    /// All of it, 1 to 4 bytes.
    Expedited {
        /// The bytes; all four when the size is not told.
        data: Bytes<EXPEDITED_MAX>,
        /// Whether the size is told.
        sized: bool,
    },
    /// Segments follow.
    Segmented {
        /// Bytes of all segments, where that is told.
        size: Option<u32>,
    },
}

impl Transfer {
    /// A transfer in one frame; `None` unless there are 1 to 4 bytes.
    #[must_use]
    pub fn expedited(data: &[u8]) -> Option<Self> {
        let data = Bytes::new(data).filter(|data| !data.is_empty())?;
        Some(Self::Expedited { data, sized: true })
    }

    fn parse(bytes: &[u8; SDO_LEN]) -> Self {
        let sized = bytes[0] & 1 != 0;
        if bytes[0] & 2 == 0 {
            return Self::Segmented { size: sized.then(|| u32_at(bytes, 4)) };
        }
        let unused = if sized { usize::from(bytes[0] >> 2 & 3) } else { 0 };
        Self::Expedited { data: Bytes::truncated(&bytes[4..SDO_LEN - unused]), sized }
    }

    fn emit(&self, command: u8, mux: Mux) -> [u8; SDO_LEN] {
        match *self {
            Self::Expedited { data, sized } => {
                let unused = if sized { unused::<EXPEDITED_MAX>(&data) & 3 } else { 0 };
                with_mux(command << 5 | unused << 2 | 2 | u8::from(sized), mux, *data.padded())
            }
            Self::Segmented { size } => {
                let size_told = u8::from(size.is_some());
                with_mux(command << 5 | size_told, mux, size.unwrap_or_default().to_le_bytes())
            }
        }
    }
}

impl fmt::Display for Transfer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Expedited { data, sized: true } => write!(f, "{data}"),
            Self::Expedited { data, sized: false } => write!(f, "{data} or less"),
            Self::Segmented { size: Some(size) } => write!(f, "{size} bytes in segments"),
            Self::Segmented { size: None } => f.write_str("segments"),
        }
    }
}

/// A segment of a transfer that is not a block transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Segment {
    /// Alternates, and is clear in the first one.
    pub toggle: bool,
    /// 0 to 7 bytes.
    pub data: Bytes<SEGMENT_LEN>,
    /// Whether it is the last one.
    pub last: bool,
}

impl Segment {
    fn parse(bytes: &[u8; SDO_LEN]) -> Self {
        let unused = usize::from(bytes[0] >> 1 & 7);
        Self {
            toggle: bytes[0] & 0x10 != 0,
            data: Bytes::truncated(&bytes[1..SDO_LEN - unused]),
            last: bytes[0] & 1 != 0,
        }
    }

    fn emit(&self) -> [u8; SDO_LEN] {
        let first = toggle(self.toggle) | unused::<SEGMENT_LEN>(&self.data) << 1 | u8::from(self.last);
        with_data(first, self.data.padded())
    }
}

impl fmt::Display for Segment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = if self.last { " last" } else { "" };
        write!(f, "segment t{}{last}: {}", u8::from(self.toggle), self.data)
    }
}

/// A segment of a block, either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BlockSegment {
    /// Counts from 1 in each block, at most 127.
    pub sequence: u8,
    /// Whether it is the last one of the transfer.
    pub last: bool,
    /// The bytes; how many of the last one count is told by the end of the transfer.
    pub data: [u8; SEGMENT_LEN],
}

impl BlockSegment {
    /// Reads a segment. An abort is none: its sequence number would be 0.
    ///
    /// # Errors
    /// [`Error`] unless there are eight bytes with a sequence number from 1.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let [first, data @ ..] = exact::<SDO_LEN>("SDO block segment", bytes)?;
        match first & 0x7F {
            0 => Err(Error::value("sequence number", "1 to 127", 0)),
            sequence => Ok(Self { sequence, last: first & 0x80 != 0, data }),
        }
    }

    /// The bytes.
    #[must_use]
    pub fn emit(&self) -> [u8; SDO_LEN] {
        with_data(self.sequence & 0x7F | u8::from(self.last) << 7, &self.data)
    }
}

impl fmt::Display for BlockSegment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = if self.last { " last" } else { "" };
        let data = Bytes::<SEGMENT_LEN>::truncated(&self.data);
        write!(f, "block segment {}{last}: {data}", self.sequence)
    }
}

/// The end of a transfer, from either side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Abort {
    /// The object of the transfer.
    pub mux: Mux,
    /// Why.
    pub code: AbortCode,
}

impl Abort {
    /// Reads an abort; `None` for anything else. An abort can come in the place of any frame.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let bytes = exact::<SDO_LEN>("SDO abort", bytes).ok()?;
        (bytes[0] == 0x80).then(|| Self::of(&bytes))
    }

    /// The bytes.
    #[must_use]
    pub fn emit(&self) -> [u8; SDO_LEN] {
        with_mux(0x80, self.mux, self.code.0.to_le_bytes())
    }

    fn of(bytes: &[u8; SDO_LEN]) -> Self {
        Self { mux: Mux::of(bytes), code: AbortCode(u32_at(bytes, 4)) }
    }
}

impl fmt::Display for Abort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "abort {}: {:08X} {}", self.mux, self.code.0, self.code.name().unwrap_or("unknown code"))
    }
}

/// Unused bytes of `N`.
fn unused<const N: usize>(data: &Bytes<N>) -> u8 {
    u8::try_from(N - data.len()).unwrap_or_default()
}

fn toggle(set: bool) -> u8 {
    u8::from(set) << 4
}

fn crc_flag(set: bool) -> u8 {
    u8::from(set) << 2
}

fn with_mux(first: u8, mux: Mux, [a, b, c, d]: [u8; 4]) -> [u8; SDO_LEN] {
    let [low, high, sub] = mux.emit();
    [first, low, high, sub, a, b, c, d]
}

fn with_data(first: u8, &[a, b, c, d, e, f, g]: &[u8; SEGMENT_LEN]) -> [u8; SDO_LEN] {
    [first, a, b, c, d, e, f, g]
}

fn with_bytes(first: u8, a: u8, b: u8) -> [u8; SDO_LEN] {
    [first, a, b, 0, 0, 0, 0, 0]
}

const fn unknown(what: &'static str, found: u8) -> Error {
    Error::value(what, "a known command specifier", found as u32)
}
