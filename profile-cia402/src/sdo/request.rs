//! What can be asked of an SDO server, and what comes back.

use core::fmt;

use arrayvec::ArrayVec;
use profile_generic::time::DurationNs;

use crate::wire::{AbortCode, Mux};

/// Bytes which a request carries without a buffer of its own: all numbers and most names.
pub const INLINE_LEN: usize = 64;

/// The bytes of a request or reply.
///
/// Longer data needs a buffer that the caller brings. It travels with the request and comes back with the outcome, so that the
/// cyclic path never allocates or frees.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SdoData {
    /// Up to [`INLINE_LEN`] bytes inside the request.
    Inline(ArrayVec<u8, INLINE_LEN>),
    /// A buffer of the caller; its capacity bounds the length.
    Buffer(Vec<u8>),
}

impl Default for SdoData {
    fn default() -> Self {
        Self::Inline(ArrayVec::new())
    }
}

impl SdoData {
    /// A copy of `bytes` inside the request; `None` when there are more than [`INLINE_LEN`].
    #[must_use]
    pub fn inline(bytes: &[u8]) -> Option<Self> {
        ArrayVec::try_from(bytes).ok().map(Self::Inline)
    }

    /// The bytes.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        match self {
            Self::Inline(bytes) => bytes,
            Self::Buffer(bytes) => bytes,
        }
    }

    /// Bytes that fit without allocation.
    #[must_use]
    pub fn capacity(&self) -> usize {
        match self {
            Self::Inline(bytes) => bytes.capacity(),
            Self::Buffer(bytes) => bytes.capacity(),
        }
    }

    /// The bytes as a little-endian number; `None` unless there are 1 to 8.
    #[must_use]
    pub fn unsigned(&self) -> Option<u64> {
        let bytes = self.as_slice();
        let mut wide = [0; 8];
        wide.get_mut(..bytes.len()).filter(|_| !bytes.is_empty())?.copy_from_slice(bytes);
        Some(u64::from_le_bytes(wide))
    }

    pub(super) fn clear(&mut self) {
        match self {
            Self::Inline(bytes) => bytes.clear(),
            Self::Buffer(bytes) => bytes.clear(),
        }
    }

    /// Appends bytes; `false` when they do not fit, and nothing is appended.
    pub(super) fn append(&mut self, bytes: &[u8]) -> bool {
        if bytes.len() > self.capacity() - self.as_slice().len() {
            return false;
        }
        match self {
            Self::Inline(own) => own.extend(bytes.iter().copied()),
            Self::Buffer(own) => own.extend_from_slice(bytes),
        }
        true
    }
}

/// Which way the bytes go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SdoOperation {
    /// From the device.
    Upload,
    /// To the device.
    Download,
}

/// How more than four bytes go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Method {
    /// In blocks, if there is much to carry and the server can; else in segments.
    #[default]
    Auto,
    /// In segments.
    Segments,
    /// In blocks.
    Blocks,
}

/// One request to a server.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SdoRequest {
    /// Index and sub-index.
    pub object: Mux,
    /// What to do with it.
    pub operation: SdoOperation,
    /// How.
    pub method: Method,
    /// Bytes to write, or the place for bytes to read.
    pub data: SdoData,
    /// Longest time for an answer, where it is another one than that of the client.
    pub timeout: Option<DurationNs>,
}

impl SdoRequest {
    /// Reads an object of at most [`INLINE_LEN`] bytes.
    #[must_use]
    pub fn upload(object: Mux) -> Self {
        let (operation, method) = (SdoOperation::Upload, Method::Auto);
        Self { object, operation, method, data: SdoData::default(), timeout: None }
    }

    /// Reads an object of at most the capacity of `buffer`.
    #[must_use]
    pub fn upload_into(object: Mux, buffer: Vec<u8>) -> Self {
        Self { data: SdoData::Buffer(buffer), ..Self::upload(object) }
    }

    /// Writes `data` to an object.
    #[must_use]
    pub fn download(object: Mux, data: SdoData) -> Self {
        Self { object, operation: SdoOperation::Download, method: Method::Auto, data, timeout: None }
    }

    /// Writes the lowest `len` bytes of a number, 1 to 8, to an object.
    #[must_use]
    pub fn download_number(object: Mux, value: u64, len: usize) -> Self {
        let bytes = value.to_le_bytes();
        let data = ArrayVec::from_iter(bytes[..len.clamp(1, 8)].iter().copied());
        Self::download(object, SdoData::Inline(data))
    }

    /// The same request by another method.
    #[must_use]
    pub fn by(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// The same request to a device that may take so long for an answer.
    #[must_use]
    pub fn within(self, timeout: DurationNs) -> Self {
        Self { timeout: Some(timeout), ..self }
    }
}

impl fmt::Display for SdoRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.operation {
            SdoOperation::Upload => write!(f, "read {}", self.object),
            SdoOperation::Download => write!(f, "write {}", self.object),
        }
    }
}

/// Why a request failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum SdoFailure {
    /// The server ended the transfer.
    #[error("refused with {:08X}: {}", .0.0, .0.name().unwrap_or("unknown code"))]
    Refused(AbortCode),
    /// The server broke the protocol, and the transfer was ended.
    #[error("ended with {:08X}: {}", .0.0, .0.name().unwrap_or("unknown code"))]
    Protocol(AbortCode),
    /// The server did not answer in time.
    #[error("no answer within {milliseconds} ms")]
    Timeout {
        /// Time waited.
        milliseconds: u32,
    },
    /// The object is longer than the place for it.
    #[error("the object has more than {capacity} bytes")]
    TooLong {
        /// Bytes that fit.
        capacity: usize,
    },
    /// The device restarted, was lost, or has left the states that have SDO.
    #[error("the node is gone")]
    NodeLost,
}

impl SdoFailure {
    /// Whether the device does not have the object or the sub-index.
    #[must_use]
    pub const fn is_absent(self) -> bool {
        matches!(self, Self::Refused(code) if code.is_absent())
    }

    /// Whether the device lets no value be written.
    #[must_use]
    pub const fn is_read_only(self) -> bool {
        matches!(self, Self::Refused(AbortCode::READ_ONLY | AbortCode::ACCESS))
    }
}

/// A finished request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SdoOutcome {
    /// Index and sub-index.
    pub object: Mux,
    /// What was asked.
    pub operation: SdoOperation,
    /// What came out.
    pub result: Result<(), SdoFailure>,
    /// The bytes read; a write request's bytes; the caller's buffer in any case.
    pub data: SdoData,
}

impl fmt::Display for SdoOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let way = match self.operation {
            SdoOperation::Upload => "read",
            SdoOperation::Download => "write",
        };
        write!(f, "{way} {}: ", self.object)?;
        match &self.result {
            Ok(()) => write!(f, "{} bytes", self.data.as_slice().len()),
            Err(failure) => write!(f, "{failure}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_never_outgrow_their_place() {
        let mut data = SdoData::Buffer(Vec::with_capacity(6));
        let capacity = data.capacity();
        assert!(data.append(&[1, 2, 3, 4]));
        assert!(!data.append(&vec![0; capacity - 3]));
        assert_eq!((data.as_slice(), data.capacity()), (&[1, 2, 3, 4][..], capacity));
        assert_eq!(SdoData::inline(&[0; INLINE_LEN + 1]), None);
    }

    #[test]
    fn numbers_of_one_to_eight_bytes() {
        let number = |bytes: &[u8]| SdoData::inline(bytes).unwrap().unsigned();
        assert_eq!((number(&[0x34, 0x12]), number(&[1, 2, 3])), (Some(0x1234), Some(0x03_0201)));
        assert_eq!((number(&[]), number(&[0; 9])), (None, None));
        let request = SdoRequest::download_number(Mux::new(0x6060, 0), 8, 1);
        assert_eq!((request.data.as_slice(), request.to_string()), (&[8][..], "write 6060:00".into()));
    }

    #[test]
    fn failures_say_what_happened() {
        let texts = [
            SdoFailure::Refused(AbortCode::NO_OBJECT),
            SdoFailure::Protocol(AbortCode(0x1234)),
            SdoFailure::Timeout { milliseconds: 500 },
        ];
        assert_eq!(
            texts.map(|failure| failure.to_string()),
            [
                "refused with 06020000: object does not exist",
                "ended with 00001234: unknown code",
                "no answer within 500 ms"
            ]
        );
        assert!(texts[0].is_absent() && !texts[1].is_absent());
    }
}
