//! From the client to the server.

use core::fmt;

use super::{Abort, SDO_LEN, Segment, Transfer, crc_flag, toggle, unknown, with_bytes, with_mux};
use crate::wire::mux::Mux;
use profile_generic::wire::{Error, exact, u16_at, u32_at};

/// A frame from the client.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SdoRequest {
    /// The first frame of a download.
    Download(Mux, Transfer),
    /// A segment of a download.
    DownloadSegment(Segment),
    /// The first frame of an upload.
    Upload(Mux),
    /// The next segment of an upload, please.
    UploadSegment {
        /// Alternates, and is clear in the first one.
        toggle: bool,
    },
    /// Ends the transfer.
    Abort(Abort),
    /// The first frame of a block download.
    BlockDownload {
        /// The object.
        mux: Mux,
        /// Whether the client can compute a CRC.
        crc: bool,
        /// Bytes of all segments, where that is told.
        size: Option<u32>,
    },
    /// The last frame of a block download.
    EndBlockDownload {
        /// Bytes of the last segment that do not count, 0 to 7.
        unused: u8,
        /// CRC of all bytes, 0 without one.
        crc: u16,
    },
    /// The first frame of a block upload.
    BlockUpload {
        /// The object.
        mux: Mux,
        /// Whether the client can compute a CRC.
        crc: bool,
        /// Segments per block, 1 to 127.
        block_size: u8,
        /// Up to this many bytes the server may answer as to an ordinary upload; 0: not.
        switch_threshold: u8,
    },
    /// The server may send its first block.
    StartBlockUpload,
    /// A block of an upload came.
    BlockReceived {
        /// The last segment that came in order; 0 for none.
        acknowledged: u8,
        /// Segments of the next block, 1 to 127.
        block_size: u8,
    },
    /// The upload is complete.
    EndBlockUpload,
}

impl SdoRequest {
    /// Reads a frame that is no segment of a block. Reserved bits and bytes are ignored.
    ///
    /// # Errors
    /// [`Error`] unless there are eight bytes with a known command specifier.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let bytes = exact::<SDO_LEN>("SDO request", bytes)?;
        let first = bytes[0];
        let mux = Mux::of(&bytes);
        Ok(match first >> 5 {
            0 => Self::DownloadSegment(Segment::parse(&bytes)),
            1 => Self::Download(mux, Transfer::parse(&bytes)),
            2 => Self::Upload(mux),
            3 => Self::UploadSegment { toggle: first & 0x10 != 0 },
            4 => Self::Abort(Abort::of(&bytes)),
            5 => match first & 3 {
                0 => Self::BlockUpload {
                    mux,
                    crc: first & 4 != 0,
                    block_size: bytes[4],
                    switch_threshold: bytes[5],
                },
                1 => Self::EndBlockUpload,
                2 => Self::BlockReceived { acknowledged: bytes[1], block_size: bytes[2] },
                _ => Self::StartBlockUpload,
            },
            6 if first & 1 == 0 => Self::BlockDownload {
                mux,
                crc: first & 4 != 0,
                size: (first & 2 != 0).then(|| u32_at(&bytes, 4)),
            },
            6 => Self::EndBlockDownload { unused: first >> 2 & 7, crc: u16_at(&bytes, 1) },
            _ => return Err(unknown("SDO request", first)),
        })
    }

    /// The bytes; reserved ones are 0.
    #[must_use]
    pub fn emit(&self) -> [u8; SDO_LEN] {
        match *self {
            Self::Download(mux, ref transfer) => transfer.emit(1, mux),
            Self::DownloadSegment(segment) => segment.emit(),
            Self::Upload(mux) => with_mux(0x40, mux, [0; 4]),
            Self::UploadSegment { toggle: set } => with_bytes(0x60 | toggle(set), 0, 0),
            Self::Abort(abort) => abort.emit(),
            Self::BlockDownload { mux, crc, size } => {
                let first = 0xC0 | crc_flag(crc) | u8::from(size.is_some()) << 1;
                with_mux(first, mux, size.unwrap_or_default().to_le_bytes())
            }
            Self::EndBlockDownload { unused, crc } => {
                let [low, high] = crc.to_le_bytes();
                with_bytes(0xC1 | (unused & 7) << 2, low, high)
            }
            Self::BlockUpload { mux, crc, block_size, switch_threshold } => {
                with_mux(0xA0 | crc_flag(crc), mux, [block_size, switch_threshold, 0, 0])
            }
            Self::StartBlockUpload => with_bytes(0xA3, 0, 0),
            Self::BlockReceived { acknowledged, block_size } => with_bytes(0xA2, acknowledged, block_size),
            Self::EndBlockUpload => with_bytes(0xA1, 0, 0),
        }
    }
}

impl fmt::Display for SdoRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SDO ")?;
        match self {
            Self::Download(mux, transfer) => write!(f, "download {mux}: {transfer}"),
            Self::DownloadSegment(segment) => write!(f, "download {segment}"),
            Self::Upload(mux) => write!(f, "upload {mux}"),
            Self::UploadSegment { toggle } => write!(f, "upload segment t{}", u8::from(*toggle)),
            Self::Abort(abort) => write!(f, "client {abort}"),
            Self::BlockDownload { mux, crc, size } => {
                write!(f, "block download {mux}")?;
                describe(f, *crc, *size)
            }
            Self::EndBlockDownload { unused, crc } => {
                write!(f, "block download end, {unused} bytes unused, CRC {crc:04X}")
            }
            Self::BlockUpload { mux, crc, block_size, switch_threshold } => {
                write!(f, "block upload {mux}, blocks of {block_size}, switch at {switch_threshold}")?;
                describe(f, *crc, None)
            }
            Self::StartBlockUpload => f.write_str("block upload start"),
            Self::BlockReceived { acknowledged, block_size } => {
                write!(f, "block upload received to {acknowledged}, next blocks of {block_size}")
            }
            Self::EndBlockUpload => f.write_str("block upload end"),
        }
    }
}

/// What a block transfer's first frame says besides.
pub(super) fn describe(f: &mut fmt::Formatter<'_>, crc: bool, size: Option<u32>) -> fmt::Result {
    if let Some(size) = size {
        write!(f, ", {size} bytes")?;
    }
    f.write_str(if crc { ", CRC" } else { ", no CRC" })
}
