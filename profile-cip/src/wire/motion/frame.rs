//! Whole updates of the variable formats: a header and the instance data blocks, clause 6-2.7.
//!
//! [`CommandFrame::parse`] and [`ActualFrame::parse`] check the entire update before anything of it can be read, so
//! that nobody acts on half of a malformed one. [`CommandWriter`] and [`ActualWriter`] compute every size.

use core::fmt;

use super::actual::ActualBlock;
use super::codes::{NodeControl, NodeStatus};
use super::cyclic::CommandBlock;
use super::event::{ActualEvents, CommandEvents};
use super::header::{ActualHeader, CommandHeader, FORMAT_REVISION};
use super::instance::{Blocks, Sequence, Sizes};
use super::read_write::{ReadBlock, WriteBlock};
use super::service::{ServiceRequest, ServiceResponse};
use crate::wire::{Error, Reader, Writer};

/// Instance data block of a C-to-D update.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CommandInstance<'a> {
    /// Instance number; 0 is the class.
    pub number: u8,
    /// Cyclic command block.
    pub cyclic: Option<CommandBlock>,
    /// Cyclic write block.
    pub write: Option<WriteBlock<'a>>,
    /// Event block.
    pub events: Option<CommandEvents>,
    /// Service request.
    pub service: Option<ServiceRequest<'a>>,
}

/// Instance data block of a D-to-C update.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ActualInstance<'a> {
    /// Instance number; 0 is the class.
    pub number: u8,
    /// Cyclic actual block.
    pub cyclic: Option<ActualBlock>,
    /// Cyclic read block.
    pub read: Option<ReadBlock<'a>>,
    /// Event block.
    pub events: Option<ActualEvents>,
    /// Service response.
    pub service: Option<ServiceResponse<'a>>,
}

/// Parses a block if there is one, and gives its errors their place in the frame.
#[inline]
fn block<'a, T>(
    octets: &'a [u8],
    offset: &mut usize,
    parse: impl FnOnce(&'a [u8]) -> Result<T, Error>,
) -> Result<Option<T>, Error> {
    let base = *offset;
    *offset += octets.len();
    if octets.is_empty() {
        return Ok(None);
    }
    parse(octets).map(Some).map_err(|error| error.behind(base))
}

macro_rules! frame {
    (
        $(#[$frame_meta:meta])* $frame:ident,
        $(#[$writer_meta:meta])* $writer:ident,
        $instances:ident, $header:ident, $instance:ident,
        valid: $valid:expr, $cyclic:ident, $second:ident: $second_block:ident, $events:ident, $service:ident
    ) => {
        impl<'a> $instance<'a> {
            /// What [`Self::from_blocks`] refuses. It keeps nothing, so an instance is not put together only to be checked.
            fn check(blocks: Blocks<'a>) -> Result<(), Error> {
                let mut offset = blocks.offset;
                block(blocks.cyclic, &mut offset, |octets| $cyclic::parse(octets).map(drop))?;
                block(blocks.read_write, &mut offset, |octets| $second_block::parse(octets).map(drop))?;
                block(blocks.event, &mut offset, |octets| $events::parse(octets).map(drop))?;
                block(blocks.service, &mut offset, |octets| $service::parse(octets).map(drop))?;
                Ok(())
            }

            #[inline]
            fn from_blocks(blocks: Blocks<'a>) -> Result<Self, Error> {
                let mut offset = blocks.offset;
                Ok(Self {
                    number: blocks.number,
                    cyclic: block(blocks.cyclic, &mut offset, $cyclic::parse)?,
                    $second: block(blocks.read_write, &mut offset, $second_block::parse)?,
                    events: block(blocks.event, &mut offset, $events::parse)?,
                    service: block(blocks.service, &mut offset, $service::parse)?,
                })
            }

            fn sizes(&self) -> Sizes {
                Sizes {
                    cyclic: self.cyclic.as_ref().map_or(0, $cyclic::buffer_len),
                    read_write: self.$second.as_ref().map_or(0, $second_block::buffer_len),
                    event: self.events.as_ref().map_or(0, $events::buffer_len),
                    service: self.service.as_ref().map_or(0, $service::buffer_len),
                }
            }

            /// Octets that this instance takes in an update; a multiple of four.
            #[must_use]
            pub fn buffer_len(&self) -> usize {
                self.sizes().total()
            }

            /// Writes the instance with its header.
            ///
            /// # Errors
            /// The buffer is too short, or a size exceeds 255 words.
            pub fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
                self.emit_sized(writer, self.sizes())
            }

            fn emit_sized(&self, writer: &mut Writer<'_>, sizes: Sizes) -> Result<(), Error> {
                sizes.emit(writer, self.number)?;
                self.cyclic.as_ref().map_or(Ok(()), |b| b.emit(writer))?;
                self.$second.as_ref().map_or(Ok(()), |b| b.emit(writer))?;
                self.events.as_ref().map_or(Ok(()), |b| b.emit(writer))?;
                self.service.as_ref().map_or(Ok(()), |b| b.emit(writer))
            }
        }

        impl fmt::Display for $instance<'_> {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self.number {
                    0 => writeln!(f, "  Instance 0 (class)")?,
                    number => writeln!(f, "  Instance {number}")?,
                }
                self.cyclic.map_or(Ok(()), |b| b.fmt(f))?;
                self.$second.map_or(Ok(()), |b| b.fmt(f))?;
                self.events.as_ref().map_or(Ok(()), |b| b.fmt(f))?;
                self.service.map_or(Ok(()), |b| b.fmt(f))
            }
        }

        $(#[$frame_meta])*
        #[derive(Debug, Clone, Copy)]
        pub struct $frame<'a> {
            header: $header,
            revision: u8,
            body: &'a [u8],
        }

        impl<'a> $frame<'a> {
            /// Reads an update from the octets behind the class-1 sequence count and checks all of it.
            ///
            /// Without the data valid bit only the header counts, and there are no instances.
            ///
            /// # Errors
            /// Format, revision, a size, a reserved code of unknown size, the order of the instance numbers, or
            /// octets missing or left over.
            pub fn parse(update: &'a [u8]) -> Result<Self, Error> {
                Self::parse_as(update, FORMAT_REVISION)
            }

            /// The same of a connection of this format revision.
            ///
            /// # Errors
            /// As [`Self::parse`].
            pub fn parse_as(update: &'a [u8], revision: u8) -> Result<Self, Error> {
                let mut reader = Reader::new(update);
                let header = $header::parse(&mut reader, revision)?;
                let valid: fn(&$header) -> bool = $valid;
                if !valid(&header) {
                    return Ok(Self { header, revision, body: &[] });
                }
                let checked = reader.clone();
                let mut sequence = Sequence::default();
                for _ in 0..header.instance_count {
                    let start = reader.offset();
                    let blocks = Blocks::take(&mut reader)?;
                    sequence.check(blocks.number, start)?;
                    $instance::check(blocks)?;
                }
                reader.finish("instance data blocks")?;
                Ok(Self { header, revision, body: checked.clone().rest() })
            }

            /// The header.
            #[must_use]
            pub fn header(&self) -> &$header {
                &self.header
            }

            /// The instances in the order of their numbers.
            #[must_use]
            pub fn instances(&self) -> $instances<'a> {
                $instances { reader: Reader::new(self.body) }
            }
        }

        /// Iterator over the checked instances of an update.
        #[derive(Debug, Clone)]
        pub struct $instances<'a> {
            reader: Reader<'a>,
        }

        impl<'a> Iterator for $instances<'a> {
            type Item = $instance<'a>;

            fn next(&mut self) -> Option<Self::Item> {
                if self.reader.is_empty() {
                    return None;
                }
                // The frame was checked as a whole, so neither step fails.
                Blocks::take(&mut self.reader).and_then($instance::from_blocks).ok()
            }
        }

        impl fmt::Display for $frame<'_> {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.header.describe(self.revision, f)?;
                self.instances().try_for_each(|instance| instance.fmt(f))
            }
        }

        $(#[$writer_meta])*
        #[derive(Debug)]
        pub struct $writer<'b> {
            header: $header,
            head: &'b mut [u8],
            writer: Writer<'b>,
        }

        impl<'b> $writer<'b> {
            /// Starts an update in `buffer`; the instance count of `header` is replaced by the number of
            /// instances that are added.
            ///
            /// # Errors
            /// The buffer is shorter than the header.
            pub fn new(buffer: &'b mut [u8], header: &$header) -> Result<Self, Error> {
                let needed = header.buffer_len();
                let available = buffer.len();
                let (head, body) = buffer.split_at_mut_checked(needed).ok_or(Error::truncated("connection header", 0, needed, available))?;
                let header = $header { instance_count: 0, ..*header };
                Ok(Self { header, head, writer: Writer::new(body) })
            }

            /// Octets that still fit.
            #[must_use]
            pub fn remaining(&self) -> usize {
                self.writer.remaining()
            }

            /// Adds an instance. Nothing is added on an error.
            ///
            /// # Errors
            /// The buffer is too short, a size exceeds 255 words, or there are 255 instances already.
            pub fn instance(&mut self, instance: &$instance<'_>) -> Result<(), Error> {
                let sizes = instance.sizes();
                let needed = sizes.total();
                let available = self.writer.remaining();
                if needed > available {
                    let offset = self.head.len() + self.writer.written();
                    return Err(Error::truncated("instance data block", offset, needed, available));
                }
                let max = u32::from(u8::MAX);
                let count = self.header.instance_count.checked_add(1);
                let count = count.ok_or(Error::too_large("instance count", max, max + 1))?;
                // With the room proven, only a size over 255 words can fail, and that before anything is written.
                instance.emit_sized(&mut self.writer, sizes)?;
                self.header.instance_count = count;
                Ok(())
            }

            /// Fills in the instance count and returns the octets of the update.
            #[must_use]
            pub fn finish(self) -> usize {
                let len = self.head.len() + self.writer.written();
                // The room was set aside for exactly this header, so writing it cannot fail.
                let _ = self.header.emit(&mut Writer::new(self.head));
                len
            }
        }
    };
}

frame!(
    /// A checked C-to-D update.
    CommandFrame,
    /// Builds a C-to-D update instance by instance.
    CommandWriter,
    CommandInstances, CommandHeader, CommandInstance,
    valid: |header| header.node_control.contains(NodeControl::DATA_VALID),
    CommandBlock, write: WriteBlock, CommandEvents, ServiceRequest
);

frame!(
    /// A checked D-to-C update.
    ActualFrame,
    /// Builds a D-to-C update instance by instance.
    ActualWriter,
    ActualInstances, ActualHeader, ActualInstance,
    valid: |header| header.node_status.contains(NodeStatus::DATA_VALID),
    ActualBlock, read: ReadBlock, ActualEvents, ServiceResponse
);
