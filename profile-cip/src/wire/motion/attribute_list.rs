//! Bodies of Get_Axis_Attributes_List (0x4B) and Set_Axis_Attributes_List (0x4C), clauses 5-2.5.1.1 and 5-2.5.1.2.
//!
//! | part | content |
//! |---|---|
//! | head of every body | number of attributes u16, reserved u16 |
//! | attribute head | ID u16, dimension u8, element size u8 |
//! | per dimension | start index u16, number of elements u16 |
//! | value | elements, padded to 32 bits; in a Get response and a Set request |
//! | set status | ID u16, status u8, index u8; in a Set response |
//!
//! In a Get response the dimension 0xFF marks an error; the element size is then the general status and there is no
//! value.

use core::fmt;

use crate::wire::{Error, Reader, Writer};

/// Most dimensions of an array attribute that this code follows; the object has none with more than one.
pub const MAX_DIMENSIONS: usize = 3;
/// Dimension octet of a Get response item that holds an error instead of a value.
pub const ERROR_DIMENSION: u8 = 0xFF;
/// Octets of the head of a body.
pub const HEAD_LEN: usize = 4;
const BODY: &str = "attribute list";

/// Part of an array along one dimension.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Range {
    /// First index.
    pub start: u16,
    /// Number of elements.
    pub count: u16,
}

/// Head of an attribute in a list: which attribute, and which part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttributeSelector {
    /// Attribute ID.
    pub id: u16,
    /// Octets per element.
    pub element_size: u8,
    dimensions: u8,
    ranges: [Range; MAX_DIMENSIONS],
}

/// One item of a Get response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GetItem<'a> {
    /// The value.
    Value(AttributeSelector, &'a [u8]),
    /// The attribute ID and the general status that says why there is no value.
    Error(u16, u8),
}

/// One item of a Set response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetStatus {
    /// Attribute ID.
    pub id: u16,
    /// General status; 0 is success.
    pub status: u8,
    /// Array index that caused the status.
    pub index: u8,
}

impl AttributeSelector {
    /// A single value of `element_size` octets.
    #[must_use]
    pub fn scalar(id: u16, element_size: u8) -> Self {
        Self { id, element_size, dimensions: 0, ranges: [Range::default(); MAX_DIMENSIONS] }
    }

    /// Part of an array; at most [`MAX_DIMENSIONS`] ranges.
    #[must_use]
    pub fn array(id: u16, element_size: u8, ranges: &[Range]) -> Option<Self> {
        let mut selector = Self::scalar(id, element_size);
        selector.ranges.get_mut(..ranges.len())?.copy_from_slice(ranges);
        selector.dimensions = u8::try_from(ranges.len()).ok()?;
        Some(selector)
    }

    /// The ranges; empty for a single value.
    #[must_use]
    pub fn ranges(&self) -> &[Range] {
        &self.ranges[..usize::from(self.dimensions)]
    }

    /// Octets of the value without padding; `None` if the product does not fit.
    #[must_use]
    pub fn value_len(&self) -> Option<usize> {
        self.ranges()
            .iter()
            .try_fold(usize::from(self.element_size), |len, range| len.checked_mul(usize::from(range.count)))
    }

    /// Octets of the head.
    #[must_use]
    pub fn head_len(&self) -> usize {
        4 + 4 * self.ranges().len()
    }

    fn parse_after_id(
        reader: &mut Reader<'_>,
        id: u16,
        dimension: u8,
        element_size: u8,
    ) -> Result<Self, Error> {
        let mut selector = Self::scalar(id, element_size);
        if usize::from(dimension) > MAX_DIMENSIONS {
            let max = u32::try_from(MAX_DIMENSIONS).unwrap_or(u32::MAX);
            return Err(Error::too_large("attribute dimension", max, u32::from(dimension)));
        }
        selector.dimensions = dimension;
        for range in &mut selector.ranges[..usize::from(dimension)] {
            *range = Range { start: reader.u16(BODY)?, count: reader.u16(BODY)? };
        }
        Ok(selector)
    }

    /// Reads a head with its ranges.
    pub(crate) fn parse(reader: &mut Reader<'_>) -> Result<Self, Error> {
        let id = reader.u16(BODY)?;
        let (dimension, element_size) = (reader.u8(BODY)?, reader.u8(BODY)?);
        Self::parse_after_id(reader, id, dimension, element_size)
    }

    fn emit(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.u16(BODY, self.id)?;
        writer.slice(BODY, &[self.dimensions, self.element_size])?;
        for range in self.ranges() {
            writer.u16(BODY, range.start)?;
            writer.u16(BODY, range.count)?;
        }
        Ok(())
    }
}

/// Takes a value with its padding; the padding of the last value may be missing.
pub(crate) fn take_value<'a>(
    reader: &mut Reader<'a>,
    selector: &AttributeSelector,
) -> Result<&'a [u8], Error> {
    let len = selector.value_len().unwrap_or(usize::MAX);
    let value = reader.take("attribute value", len)?;
    let padding = (len.next_multiple_of(4) - len).min(reader.remaining());
    reader.take(BODY, padding)?;
    Ok(value)
}

macro_rules! list {
    ($(#[$meta:meta])* $name:ident, $item:ty, $parse:expr) => {
        $(#[$meta])*
        #[derive(Debug, Clone)]
        pub struct $name<'a> {
            reader: Reader<'a>,
            left: u16,
        }

        impl<'a> $name<'a> {
            /// Starts at the head of a body.
            ///
            /// # Errors
            /// There are fewer than four octets.
            pub fn new(body: &'a [u8]) -> Result<Self, Error> {
                let mut reader = Reader::new(body);
                let left = reader.u16(BODY)?;
                reader.u16(BODY)?;
                Ok(Self { reader, left })
            }

            /// Number of attributes that the body announces and that have not been read yet.
            #[must_use]
            pub fn left(&self) -> u16 {
                self.left
            }

            /// Octets that have not been read yet.
            #[must_use]
            pub fn rest(&self) -> usize {
                self.reader.remaining()
            }
        }

        impl<'a> Iterator for $name<'a> {
            type Item = Result<$item, Error>;

            fn next(&mut self) -> Option<Self::Item> {
                self.left = self.left.checked_sub(1)?;
                let parse: fn(&mut Reader<'a>) -> Result<$item, Error> = $parse;
                let item = parse(&mut self.reader);
                if item.is_err() {
                    self.left = 0;
                }
                Some(item)
            }
        }
    };
}

list!(
    /// The attributes of a Get request. After an error the iterator ends.
    GetRequest, AttributeSelector, AttributeSelector::parse
);

list!(
    /// The values of a Get response. After an error the iterator ends.
    GetResponse, GetItem<'a>, |reader| {
        let id = reader.u16(BODY)?;
        let (dimension, element_size) = (reader.u8(BODY)?, reader.u8(BODY)?);
        if dimension == ERROR_DIMENSION {
            return Ok(GetItem::Error(id, element_size));
        }
        let selector = AttributeSelector::parse_after_id(reader, id, dimension, element_size)?;
        Ok(GetItem::Value(selector, take_value(reader, &selector)?))
    }
);

list!(
    /// The values of a Set request. After an error the iterator ends.
    SetRequest, (AttributeSelector, &'a [u8]), |reader| {
        let selector = AttributeSelector::parse(reader)?;
        Ok((selector, take_value(reader, &selector)?))
    }
);

list!(
    /// The statuses of a Set response. After an error the iterator ends.
    SetResponse, SetStatus, |reader| {
        Ok(SetStatus { id: reader.u16(BODY)?, status: reader.u8(BODY)?, index: reader.u8(BODY)? })
    }
);

/// Writes any of the four bodies item by item; [`ListWriter::finish`] fills in the count.
#[derive(Debug)]
pub struct ListWriter<'b> {
    writer: Writer<'b>,
    count: u16,
}

impl<'b> ListWriter<'b> {
    /// Starts a body in `buffer`.
    ///
    /// # Errors
    /// The buffer is shorter than the head.
    pub fn new(buffer: &'b mut [u8]) -> Result<Self, Error> {
        let mut writer = Writer::new(buffer);
        writer.zeros(BODY, HEAD_LEN)?;
        Ok(Self { writer, count: 0 })
    }

    fn counted(&mut self) {
        self.count = self.count.saturating_add(1);
    }

    /// Octets that still fit.
    #[must_use]
    pub fn remaining(&self) -> usize {
        self.writer.remaining()
    }

    /// Adds an attribute of a Get request.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn select(&mut self, selector: &AttributeSelector) -> Result<(), Error> {
        selector.emit(&mut self.writer)?;
        self.counted();
        Ok(())
    }

    /// Adds a value of a Get response or a Set request.
    ///
    /// # Errors
    /// The buffer is too short, or `value` is not as long as `selector` says. Nothing is added then.
    pub fn value(&mut self, selector: &AttributeSelector, value: &[u8]) -> Result<(), Error> {
        let padded = value.len().next_multiple_of(4);
        let needed = selector.head_len() + padded;
        let available = self.writer.remaining();
        if needed > available {
            return Err(Error::truncated(BODY, self.writer.written(), needed, available));
        }
        if selector.value_len() != Some(value.len()) {
            let clip = |len: usize| u32::try_from(len).unwrap_or(u32::MAX);
            let max = clip(selector.value_len().unwrap_or(usize::MAX));
            return Err(Error::too_large("attribute value", max, clip(value.len())));
        }
        selector.emit(&mut self.writer)?;
        self.writer.slice(BODY, value)?;
        self.writer.zeros(BODY, padded - value.len())?;
        self.counted();
        Ok(())
    }

    /// Adds an error of a Get response.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn error(&mut self, id: u16, status: u8) -> Result<(), Error> {
        let [low, high] = id.to_le_bytes();
        self.writer.slice(BODY, &[low, high, ERROR_DIMENSION, status])?;
        self.counted();
        Ok(())
    }

    /// Adds a status of a Set response.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn status(&mut self, status: SetStatus) -> Result<(), Error> {
        let [low, high] = status.id.to_le_bytes();
        self.writer.slice(BODY, &[low, high, status.status, status.index])?;
        self.counted();
        Ok(())
    }

    /// Fills in the number of attributes and returns the octets written; a multiple of four.
    #[must_use]
    pub fn finish(mut self) -> usize {
        // The head was written by `new`, so the patch cannot fail.
        let _ = self.writer.patch_u16(BODY, 0, self.count);
        self.writer.written()
    }
}

impl fmt::Display for AttributeSelector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "attribute {}, {} octets", self.id, self.element_size)?;
        for range in self.ranges() {
            write!(f, " [{}; {}]", range.start, range.count)?;
        }
        Ok(())
    }
}
