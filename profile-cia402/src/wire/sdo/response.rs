//! From the server to the client.

use core::fmt;

use super::request::describe;
use super::{Abort, SDO_LEN, Segment, Transfer, crc_flag, toggle, unknown, with_bytes, with_mux};
use crate::wire::mux::Mux;
use profile_generic::wire::{Error, exact, u16_at, u32_at};

/// A frame from the server.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SdoResponse {
    /// The first frame of an upload.
    Upload(Mux, Transfer),
    /// A segment of an upload.
    UploadSegment(Segment),
    /// A download has begun, or is done if it was expedited.
    Download(Mux),
    /// A segment of a download was taken.
    DownloadSegment {
        /// That of the segment.
        toggle: bool,
    },
    /// Ends the transfer.
    Abort(Abort),
    /// A block download has begun.
    BlockDownload {
        /// The object.
        mux: Mux,
        /// Whether the server can compute a CRC.
        crc: bool,
        /// Segments of the first block, 1 to 127.
        block_size: u8,
    },
    /// A block of a download came.
    BlockReceived {
        /// The last segment that came in order; 0 for none.
        acknowledged: u8,
        /// Segments of the next block, 1 to 127.
        block_size: u8,
    },
    /// The block download is done.
    EndBlockDownload,
    /// A block upload has begun.
    BlockUpload {
        /// The object.
        mux: Mux,
        /// Whether the server can compute a CRC.
        crc: bool,
        /// Bytes of all segments, where that is told.
        size: Option<u32>,
    },
    /// All blocks of an upload have been sent.
    EndBlockUpload {
        /// Bytes of the last segment that do not count, 0 to 7.
        unused: u8,
        /// CRC of all bytes, 0 without one.
        crc: u16,
    },
}

impl SdoResponse {
    /// Reads a frame that is no segment of a block. Reserved bits and bytes are ignored.
    ///
    /// # Errors
    /// [`Error`] unless there are eight bytes with a known command specifier.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let bytes = exact::<SDO_LEN>("SDO response", bytes)?;
        let first = bytes[0];
        let mux = Mux::of(&bytes);
        Ok(match (first >> 5, first & 3) {
            (0, _) => Self::UploadSegment(Segment::parse(&bytes)),
            (1, _) => Self::DownloadSegment { toggle: first & 0x10 != 0 },
            (2, _) => Self::Upload(mux, Transfer::parse(&bytes)),
            (3, _) => Self::Download(mux),
            (4, _) => Self::Abort(Abort::of(&bytes)),
            (5, 0) => Self::BlockDownload { mux, crc: first & 4 != 0, block_size: bytes[4] },
            (5, 1) => Self::EndBlockDownload,
            (5, 2) => Self::BlockReceived { acknowledged: bytes[1], block_size: bytes[2] },
            (6, 0 | 2) => Self::BlockUpload {
                mux,
                crc: first & 4 != 0,
                size: (first & 2 != 0).then(|| u32_at(&bytes, 4)),
            },
            (6, _) => Self::EndBlockUpload { unused: first >> 2 & 7, crc: u16_at(&bytes, 1) },
            _ => return Err(unknown("SDO response", first)),
        })
    }

    /// The bytes; reserved ones are 0.
    #[must_use]
    pub fn emit(&self) -> [u8; SDO_LEN] {
        match *self {
            Self::Upload(mux, ref transfer) => transfer.emit(2, mux),
            Self::UploadSegment(segment) => segment.emit(),
            Self::Download(mux) => with_mux(0x60, mux, [0; 4]),
            Self::DownloadSegment { toggle: set } => with_bytes(0x20 | toggle(set), 0, 0),
            Self::Abort(abort) => abort.emit(),
            Self::BlockDownload { mux, crc, block_size } => {
                with_mux(0xA0 | crc_flag(crc), mux, [block_size, 0, 0, 0])
            }
            Self::BlockReceived { acknowledged, block_size } => with_bytes(0xA2, acknowledged, block_size),
            Self::EndBlockDownload => with_bytes(0xA1, 0, 0),
            Self::BlockUpload { mux, crc, size } => {
                let first = 0xC0 | crc_flag(crc) | u8::from(size.is_some()) << 1;
                with_mux(first, mux, size.unwrap_or_default().to_le_bytes())
            }
            Self::EndBlockUpload { unused, crc } => {
                let [low, high] = crc.to_le_bytes();
                with_bytes(0xC1 | (unused & 7) << 2, low, high)
            }
        }
    }
}

impl fmt::Display for SdoResponse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SDO ")?;
        match self {
            Self::Upload(mux, transfer) => write!(f, "uploaded {mux}: {transfer}"),
            Self::UploadSegment(segment) => write!(f, "uploaded {segment}"),
            Self::Download(mux) => write!(f, "downloaded {mux}"),
            Self::DownloadSegment { toggle } => write!(f, "downloaded segment t{}", u8::from(*toggle)),
            Self::Abort(abort) => write!(f, "server {abort}"),
            Self::BlockDownload { mux, crc, block_size } => {
                write!(f, "block download of {mux}, blocks of {block_size}")?;
                describe(f, *crc, None)
            }
            Self::BlockReceived { acknowledged, block_size } => {
                write!(f, "block download received to {acknowledged}, next blocks of {block_size}")
            }
            Self::EndBlockDownload => f.write_str("block download ended"),
            Self::BlockUpload { mux, crc, size } => {
                write!(f, "block upload of {mux}")?;
                describe(f, *crc, *size)
            }
            Self::EndBlockUpload { unused, crc } => {
                write!(f, "block upload ended, {unused} bytes unused, CRC {crc:04X}")
            }
        }
    }
}
