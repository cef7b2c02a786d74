//! Instance data header of both directions, clauses 6-2.7.1.2.1 and 6-2.7.2.1.4.
//!
//! | offset | content |
//! |---|---|
//! | 0 | instance number; 0 is the class |
//! | 1 | reserved |
//! | 2 | instance block size |
//! | 3 | cyclic block size: command (or actual) and write (or read) block together |
//! | 4 | cyclic command or cyclic actual block size |
//! | 5 | cyclic write or cyclic read block size |
//! | 6 | event block size |
//! | 7 | service block size |
//!
//! Sizes count 32-bit words; the instance block size includes this header. The examples of clause 7-1.2 and 7-1.3 fix
//! that (3 words of service give 5 words of instance).
//! What the cyclic block size covers is printed in two ways: Table 6-2.12 has one cyclic block per instance, Table
//! 6-2.5 two. This code writes the sum of both and, reading, also takes the command block alone.

use super::value::invalid;
use crate::wire::{Error, Reader, Writer};

mod field {
    pub const NUMBER: usize = 0;
    pub const INSTANCE: usize = 2;
    pub const CYCLIC: usize = 3;
}

/// Octets of the header.
pub const HEADER_LEN: usize = 8;
/// 32-bit words of the header.
const HEADER_WORDS: usize = 2;
const HEADER: &str = "instance header";

/// The four blocks of an instance as octets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blocks<'a> {
    pub number: u8,
    /// Offset of the first block in the frame, for error messages.
    pub offset: usize,
    pub cyclic: &'a [u8],
    pub read_write: &'a [u8],
    pub event: &'a [u8],
    pub service: &'a [u8],
}

impl<'a> Blocks<'a> {
    /// Takes one instance data block off `reader` and checks that its sizes agree with each other.
    #[inline]
    pub fn take(reader: &mut Reader<'a>) -> Result<Self, Error> {
        let start = reader.offset();
        let [number, _, instance, cyclic, main, read_write, event, service] = reader.array(HEADER)?;
        let words = |size: u8| usize::from(size);
        let content = words(main) + words(read_write) + words(event) + words(service);
        // Size 0 says that there is no instance data block: a bare header.
        let bare = instance == 0 && content == 0 && cyclic == 0;
        if !bare && words(instance) != HEADER_WORDS + content {
            let expected = u8::try_from(HEADER_WORDS + content).unwrap_or(u8::MAX);
            return Err(invalid("instance block size", start + field::INSTANCE, instance, expected));
        }
        if words(cyclic) != words(main) + words(read_write) && cyclic != main {
            let expected = main.saturating_add(read_write);
            return Err(invalid("cyclic block size", start + field::CYCLIC, cyclic, expected));
        }
        Ok(Self {
            number,
            offset: start + HEADER_LEN,
            cyclic: reader.take("cyclic block", 4 * words(main))?,
            read_write: reader.take("cyclic read or write block", 4 * words(read_write))?,
            event: reader.take("event block", 4 * words(event))?,
            service: reader.take("service block", 4 * words(service))?,
        })
    }
}

/// Checks that instance numbers follow each other without a gap.
///
/// The first one may be any: the class alone, the class and all axes, or one axis at a time are all legal.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sequence {
    expected: Option<u8>,
    ended: bool,
}

impl Sequence {
    pub fn check(&mut self, number: u8, start: usize) -> Result<(), Error> {
        let wanted = self.expected.unwrap_or(number);
        if number != wanted || self.ended {
            return Err(invalid("instance number", start + field::NUMBER, number, wanted));
        }
        self.expected = number.checked_add(1);
        self.ended = self.expected.is_none();
        Ok(())
    }
}

/// Octets of the blocks of an instance, and the header made of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sizes {
    pub cyclic: usize,
    pub read_write: usize,
    pub event: usize,
    pub service: usize,
}

impl Sizes {
    /// Octets of the whole instance data block.
    pub fn total(&self) -> usize {
        HEADER_LEN + self.cyclic + self.read_write + self.event + self.service
    }

    /// Writes the header.
    pub fn emit(&self, writer: &mut Writer<'_>, number: u8) -> Result<(), Error> {
        let words = |octets: usize| {
            let words = octets.div_ceil(4);
            u8::try_from(words).map_err(|_| {
                Error::too_large(
                    "block size in words",
                    u32::from(u8::MAX),
                    u32::try_from(words).unwrap_or(u32::MAX),
                )
            })
        };
        let (instance, cyclic) = (words(self.total())?, words(self.cyclic + self.read_write)?);
        let (main, read_write) = (words(self.cyclic)?, words(self.read_write)?);
        let header =
            [number, 0, instance, cyclic, main, read_write, words(self.event)?, words(self.service)?];
        writer.slice(HEADER, &header)
    }
}
