//! What can be asked of a slave's service channel, and what comes back.

use core::fmt;

use arrayvec::ArrayVec;

use crate::wire::attribute::Attribute;
use crate::wire::data_status::DataStatus;
use crate::wire::idn::Idn;
use crate::wire::svc::{Element, ListHead};
use crate::wire::svc_error::SvcError;

/// Bytes which a request carries without a buffer of its own: all scalars and a list of 16 IDNs.
pub const INLINE_LEN: usize = 64;

/// The bytes of a request or reply: little endian, lists and texts without their four-byte head.
///
/// Longer data needs a buffer that the caller brings. It travels with the request and comes back with the
/// reply, so that the cyclic path never allocates or frees.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SvcData {
    /// Up to [`INLINE_LEN`] bytes inside the request.
    Inline(ArrayVec<u8, INLINE_LEN>),
    /// A buffer of the caller; its capacity bounds the length, lists have at most 65535 bytes.
    Buffer(Vec<u8>),
}

impl Default for SvcData {
    fn default() -> SvcData {
        SvcData::Inline(ArrayVec::new())
    }
}

impl SvcData {
    /// A copy of `bytes` inside the request; `None` when there are more than [`INLINE_LEN`].
    #[must_use]
    pub fn inline(bytes: &[u8]) -> Option<SvcData> {
        ArrayVec::try_from(bytes).ok().map(SvcData::Inline)
    }

    /// The bytes.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        match self {
            SvcData::Inline(bytes) => bytes,
            SvcData::Buffer(bytes) => bytes,
        }
    }

    /// Bytes that fit without allocation.
    #[must_use]
    pub fn capacity(&self) -> usize {
        match self {
            SvcData::Inline(bytes) => bytes.capacity(),
            SvcData::Buffer(bytes) => bytes.capacity(),
        }
    }

    /// The bytes as a little-endian number; `None` unless there are 1, 2, 4 or 8.
    #[must_use]
    pub fn unsigned(&self) -> Option<u64> {
        let bytes = self.as_slice();
        if !matches!(bytes.len(), 1 | 2 | 4 | 8) {
            return None;
        }
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        Some(u64::from_le_bytes(wide))
    }

    /// The 16-bit items of a list; a last odd byte is left out.
    pub fn words(&self) -> impl Iterator<Item = u16> + '_ {
        self.as_slice().chunks_exact(2).map(|item| u16::from_le_bytes([item[0], item[1]]))
    }

    /// The 32-bit items of a list, IDNs for example; up to three last bytes are left out.
    pub fn double_words(&self) -> impl Iterator<Item = u32> + '_ {
        self.as_slice().chunks_exact(4).map(|item| u32::from_le_bytes([item[0], item[1], item[2], item[3]]))
    }

    pub(super) fn clear(&mut self) {
        match self {
            SvcData::Inline(bytes) => bytes.clear(),
            SvcData::Buffer(bytes) => bytes.clear(),
        }
    }

    /// Appends as many of `bytes` as the capacity permits.
    pub(super) fn append(&mut self, bytes: &[u8]) {
        let room = self.capacity().saturating_sub(self.as_slice().len());
        let bytes = &bytes[..bytes.len().min(room)];
        match self {
            SvcData::Inline(own) => own.extend(bytes.iter().copied()),
            SvcData::Buffer(own) => own.extend_from_slice(bytes),
        }
    }
}

/// How the bytes of an element are transferred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// A fixed number of bytes: 1, 2, 4 or 8.
    Fixed(u8),
    /// A list or text: a head of four bytes and then the items.
    List,
}

/// What a request does with the data block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SvcOperation {
    /// Opens the data block and takes the data status, nothing else.
    Status,
    /// Reads an element into the request's data.
    Read(Element),
    /// Writes the request's data to an element.
    Write(Element),
    /// Reads the head of a list or text and closes the data block.
    Length(Element),
    /// Procedure command: cancel, set and start, wait until it is done. It stays set.
    Execute,
    /// Procedure command: cancel.
    Cancel,
    /// Procedure command: [`SvcOperation::Execute`], then [`SvcOperation::Cancel`] whatever came out.
    Command,
}

impl fmt::Display for SvcOperation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Status => f.write_str("opening"),
            Self::Read(Element::Data) => f.write_str("reading"),
            Self::Write(Element::Data) => f.write_str("writing"),
            Self::Length(Element::Data) => f.write_str("reading the length of"),
            Self::Read(element) => write!(f, "reading the {element} of"),
            Self::Write(element) => write!(f, "writing the {element} of"),
            Self::Length(element) => write!(f, "reading the length of the {element} of"),
            Self::Execute | Self::Command => f.write_str("executing"),
            Self::Cancel => f.write_str("cancelling"),
        }
    }
}

/// Which of several waiting requests goes first. A running request is never interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Priority {
    /// In order of submission.
    #[default]
    Normal,
    /// Before all normal requests.
    Urgent,
}

/// One request to one slave's service channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SvcRequest {
    /// The data block.
    pub idn: Idn,
    /// What to do with it.
    pub operation: SvcOperation,
    /// Shape of minimum, maximum and operation data where it is known; otherwise the attribute is read first.
    pub shape: Option<Shape>,
    /// Priority among this slave's requests.
    pub priority: Priority,
    /// Bytes to write, or the place for bytes to read.
    pub data: SvcData,
}

impl SvcRequest {
    /// A request without data.
    #[must_use]
    pub fn new(idn: Idn, operation: SvcOperation) -> SvcRequest {
        SvcRequest { idn, operation, shape: None, priority: Priority::Normal, data: SvcData::default() }
    }

    /// Reads the operation data.
    #[must_use]
    pub fn read(idn: Idn) -> SvcRequest {
        SvcRequest::new(idn, SvcOperation::Read(Element::Data))
    }

    /// Writes `data` as operation data.
    #[must_use]
    pub fn write(idn: Idn, data: SvcData) -> SvcRequest {
        SvcRequest { data, ..SvcRequest::new(idn, SvcOperation::Write(Element::Data)) }
    }

    /// Runs a procedure command to its end and cancels it.
    #[must_use]
    pub fn command(idn: Idn) -> SvcRequest {
        SvcRequest::new(idn, SvcOperation::Command)
    }

    /// The same request with `buffer` as its data; what is in it is written by write requests and discarded by
    /// read requests.
    #[must_use]
    pub fn with_buffer(self, buffer: Vec<u8>) -> SvcRequest {
        SvcRequest { data: SvcData::Buffer(buffer), ..self }
    }

    /// The same request with a known shape: the attribute is not read.
    #[must_use]
    pub fn with_shape(self, shape: Shape) -> SvcRequest {
        SvcRequest { shape: Some(shape), ..self }
    }

    /// The same request ahead of all normal ones.
    #[must_use]
    pub fn urgent(self) -> SvcRequest {
        SvcRequest { priority: Priority::Urgent, ..self }
    }
}

/// What a slave said besides the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SvcReply {
    /// Data status of the last opening of the data block.
    pub status: DataStatus,
    /// The attribute, when it was read.
    pub attribute: Option<Attribute>,
    /// The head of a list or text, when one was read.
    pub head: Option<ListHead>,
}

/// Why a request failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum SvcFailure {
    /// The slave refused a step.
    #[error("{element}: {code}")]
    Refused {
        /// Element of the step.
        element: Element,
        /// The slave's error code.
        code: SvcError,
    },
    /// The slave's handshake bit did not follow within the permitted cycles.
    #[error("no handshake from the slave within {cycles} cycles")]
    HandshakeTimeout {
        /// Cycles waited.
        cycles: u16,
    },
    /// The slave stayed busy for too long.
    #[error("the slave was busy for more than {milliseconds} ms")]
    BusyTimeout {
        /// Permitted time in milliseconds.
        milliseconds: u32,
    },
    /// What the slave has is longer than the request's data can take.
    #[error("the slave has {length} bytes, the request has room for {capacity}")]
    TooLong {
        /// Bytes which the slave has.
        length: u16,
        /// Bytes which the request can take.
        capacity: usize,
    },
    /// The bytes to write do not have the length which the attribute asks for.
    #[error("{given} bytes to write where {expected} are needed")]
    Length {
        /// Bytes needed; 65535 for lists, as an upper bound.
        expected: usize,
        /// Bytes given.
        given: usize,
    },
    /// The slave asks for something that no network can give it.
    #[error("the slave asks for {value}, at most {max} is possible")]
    Impossible {
        /// What it asks for, in the unit of the parameter.
        value: u32,
        /// The largest possible value.
        max: u32,
    },
    /// The slave's connection setup cannot be written, and is another one.
    #[error("the setup of the connection cannot be changed and is {found:#06x}, expected {expected:#06x}")]
    FixedSetup {
        /// What is wanted.
        expected: u16,
        /// What the slave has.
        found: u16,
    },
    /// The slave's fixed configuration list is not the one that the telegram was laid out for.
    #[error(
        "the list of a slave with SCP_FixCFG is {found} at place {place}, the telegram was laid out for {expected}"
    )]
    FixedList {
        /// First place, from 0, at which they differ.
        place: u16,
        /// What the telegram was laid out for; `S-0-0000` behind its end.
        expected: Idn,
        /// What the slave has; `S-0-0000` behind its end.
        found: Idn,
    },
    /// The slave's length of a connection is not what its list makes.
    #[error("the slave says {found} bytes with C-CON, its configuration list makes {expected}")]
    ConnectionLength {
        /// What the list makes.
        expected: u16,
        /// What the slave says.
        found: u16,
    },
    /// The procedure command failed or was interrupted.
    #[error("procedure command {}", .0.command_state())]
    CommandFailed(DataStatus),
    /// The procedure command was not done in time.
    #[error("procedure command not done in time: {}", .0.command_state())]
    CommandTimeout(DataStatus),
    /// The slave is not in the network any more.
    #[error("the slave is gone")]
    SlaveLost,
    /// The network left the phases that have a service channel.
    #[error("the communication phase was left")]
    PhaseLeft,
}

impl SvcFailure {
    /// Whether the slave does not have the data block or the element (codes x001).
    #[must_use]
    pub fn is_absent(self) -> bool {
        matches!(self, SvcFailure::Refused { code, .. } if code.0 & 0x0FFF == 1 && code.0 != 1)
    }
}

/// A finished request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SvcOutcome {
    /// The data block.
    pub idn: Idn,
    /// What was asked.
    pub operation: SvcOperation,
    /// What came out.
    pub result: Result<SvcReply, SvcFailure>,
    /// The bytes read; a write request's bytes; the caller's buffer in any case.
    pub data: SvcData,
}

impl fmt::Display for SvcOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.idn)?;
        match &self.result {
            Ok(_) => write!(f, "{} bytes", self.data.as_slice().len()),
            Err(failure) => write!(f, "{failure}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_never_outgrows_its_place() {
        let mut data = SvcData::Buffer(Vec::with_capacity(6));
        let capacity = data.capacity();
        for _ in 0..4 {
            data.append(&[1, 2, 3, 4]);
        }
        assert_eq!((data.as_slice().len(), data.capacity()), (capacity, capacity));
        assert_eq!(SvcData::inline(&[0; INLINE_LEN + 1]), None);
        assert_eq!(SvcData::inline(&[0x34, 0x12]).unwrap().unsigned(), Some(0x1234));
        assert_eq!(SvcData::inline(&[1, 2, 3]).unwrap().unsigned(), None);
        let list = SvcData::inline(&[1, 0, 2, 0, 3]).unwrap();
        assert_eq!(list.words().collect::<Vec<_>>(), [1, 2]);
        assert_eq!(list.double_words().collect::<Vec<_>>(), [0x0002_0001]);
    }

    #[test]
    fn absence() {
        let refused = |code| SvcFailure::Refused { element: Element::Idn, code: SvcError(code) };
        assert!(refused(0x1001).is_absent());
        assert!(refused(0x4001).is_absent());
        assert!(!refused(0x0001).is_absent());
        assert!(!refused(0x7004).is_absent());
        assert!(!SvcFailure::SlaveLost.is_absent());
        assert_eq!(refused(0x1001).to_string(), "IDN: IDN not available");
    }
}
