//! CAN frames as recordings have them: link type 227, `LINKTYPE_CAN_SOCKETCAN`.
//!
//! | offset | bytes | what |
//! |---|---|---|
//! | 0 | 4 | flags (31: identifier of 29 bits, 30: remote, 29: word of the controller) and identifier, big endian |
//! | 4 | 1 | length of the data |
//! | 5 | 1 | FD: 01 bit rate switch, 02 error state indicator, 04 FD frame; 0 in a classic frame |
//! | 6 | 2 | not used here |
//! | 8 | n | data; recordings of an interface may have a classic frame's filled up to 8 bytes |

use std::fmt;

use profile_generic::can::{Frame, Id};

/// Link type of CAN frames.
pub const LINK_TYPE_CAN: u16 = 227;

/// Longest record of one frame.
pub const RECORD_LEN_MAX: usize = HEAD_LEN + 64;

const HEAD_LEN: usize = 8;

const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;
const ERROR: u32 = 0x2000_0000;

const FD_BIT_RATE_SWITCH: u8 = 0x01;
const FD_FRAME: u8 = 0x04;

/// What stands in a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Record {
    /// A frame of the bus.
    Frame(Frame),
    /// What a controller said of its bus: the classes of `linux/can/error.h`.
    Controller {
        /// Which events.
        classes: u32,
    },
}

/// Why bytes are no record of a CAN frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// Shorter than its head, or than the data it says it has.
    #[error("expected {expected} bytes, got {found}")]
    Short {
        /// Bytes that it needs.
        expected: usize,
        /// Bytes that there are.
        found: usize,
    },
    /// No frame is like this.
    #[error(transparent)]
    Frame(#[from] profile_generic::can::FrameError),
}

impl fmt::Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Record::Frame(frame) => frame.fmt(f),
            Record::Controller { classes } => write!(f, "controller {classes:03X}"),
        }
    }
}

/// Writes a frame to the start of `buffer` and gives how many bytes it takes.
#[must_use]
pub fn emit(frame: &Frame, buffer: &mut [u8; RECORD_LEN_MAX]) -> usize {
    let remote = if frame.is_remote() { REMOTE } else { 0 };
    let word = match frame.id() {
        Id::Standard(id) => u32::from(id),
        Id::Extended(id) => id | EXTENDED,
    };
    let fast = if frame.is_fast() { FD_BIT_RATE_SWITCH } else { 0 };
    buffer[..4].copy_from_slice(&(word | remote).to_be_bytes());
    // At most 64.
    buffer[4] = u8::try_from(frame.len()).unwrap_or(0);
    buffer[5] = if frame.is_fd() { FD_FRAME | fast } else { 0 };
    buffer[6..HEAD_LEN].fill(0);
    let data = frame.data();
    buffer[HEAD_LEN..HEAD_LEN + data.len()].copy_from_slice(data);
    HEAD_LEN + data.len()
}

/// Reads a record. Those of an interface that has no mark for FD frames are told by their length.
///
/// # Errors
/// [`RecordError`].
pub fn parse(bytes: &[u8]) -> Result<Record, RecordError> {
    let short = |expected| RecordError::Short { expected, found: bytes.len() };
    let (head, rest) = bytes.split_first_chunk::<HEAD_LEN>().ok_or(short(HEAD_LEN))?;
    let word = u32::from_be_bytes([head[0], head[1], head[2], head[3]]);
    if word & ERROR != 0 {
        return Ok(Record::Controller { classes: word & Id::EXTENDED_MAX });
    }
    let id = if word & EXTENDED != 0 {
        Id::Extended(word & Id::EXTENDED_MAX)
    } else {
        Id::Standard(u16::try_from(word & Id::EXTENDED_MAX).unwrap_or(u16::MAX))
    };
    let len = usize::from(head[4]);
    if word & REMOTE != 0 {
        return Ok(Record::Frame(Frame::remote(id, len)?));
    }
    let data = rest.get(..len).ok_or(short(HEAD_LEN + len))?;
    let frame = if head[5] & FD_FRAME != 0 || len > 8 {
        Frame::fd(id, data, head[5] & FD_BIT_RATE_SWITCH != 0)
    } else {
        Frame::new(id, data)
    };
    Ok(Record::Frame(frame?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn standard(id: u16, data: &[u8]) -> Frame {
        Frame::new(Id::Standard(id), data).unwrap()
    }

    /// The format's description at tcpdump.org.
    #[test]
    fn records_both_ways() {
        let vectors: [(Frame, &[u8]); 5] = [
            (standard(0x181, &[0x27, 6]), &[0, 0, 1, 0x81, 2, 0, 0, 0, 0x27, 6]),
            (Frame::new(Id::Extended(0x1234), &[]).unwrap(), &[0x80, 0, 0x12, 0x34, 0, 0, 0, 0]),
            (Frame::remote(Id::Standard(0x701), 1).unwrap(), &[0x40, 0, 7, 1, 1, 0, 0, 0]),
            (Frame::fd(Id::Standard(0x181), &[9], true).unwrap(), &[0, 0, 1, 0x81, 1, 5, 0, 0, 9]),
            (Frame::fd(Id::Standard(0x181), &[9], false).unwrap(), &[0, 0, 1, 0x81, 1, 4, 0, 0, 9]),
        ];
        for (frame, bytes) in vectors {
            let mut buffer = [0xA5; RECORD_LEN_MAX];
            let len = emit(&frame, &mut buffer);
            assert_eq!(&buffer[..len], bytes);
            assert_eq!(parse(bytes), Ok(Record::Frame(frame)));
        }
        // Filled up to eight bytes, as an interface gives them.
        let padded = [0, 0, 1, 0x81, 2, 0, 0, 0, 0x27, 6, 0, 0, 0, 0, 0, 0];
        assert_eq!(parse(&padded), Ok(Record::Frame(standard(0x181, &[0x27, 6]))));
        // A frame of 12 bytes without the mark.
        let unmarked = [&[0, 0, 1, 0x81, 12, 0, 0, 0][..], &[7; 12]].concat();
        assert_eq!(parse(&unmarked).unwrap().to_string(), "181##007 07 07 07 07 07 07 07 07 07 07 07");
        assert_eq!(parse(&[0x20, 0, 0, 0x44, 8, 0, 0, 0]), Ok(Record::Controller { classes: 0x44 }));
    }

    #[test]
    fn what_is_no_record_says_why() {
        let text = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
        assert_eq!(text(&[0; 7]), "expected 8 bytes, got 7");
        assert_eq!(text(&[0, 0, 1, 0x81, 2, 0, 0, 0, 1]), "expected 10 bytes, got 9");
        assert_eq!(text(&[0, 0, 8, 0, 0, 0, 0, 0]), "expected an identifier of 11 or 29 bits, got 800");
        let odd = [&[0, 0, 1, 0x81, 13, 0, 0, 0][..], &[7; 13]].concat();
        assert!(text(&odd).ends_with("got 13"));
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..90)) {
            let _ = parse(&bytes);
        }

        #[test]
        fn every_frame_comes_back(id in 0..=Id::EXTENDED_MAX, data in proptest::collection::vec(any::<u8>(), 0..=8), fd: bool) {
            let frame = if fd { Frame::fd(Id::Extended(id), &data, true) } else { Frame::new(Id::Extended(id), &data) };
            let frame = frame.unwrap();
            let mut buffer = [0; RECORD_LEN_MAX];
            let len = emit(&frame, &mut buffer);
            prop_assert_eq!(parse(&buffer[..len]), Ok(Record::Frame(frame)));
        }
    }
}
