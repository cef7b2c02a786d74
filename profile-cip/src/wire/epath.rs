//! EPATH: the segments that name an object, a route, or carry a little data.
//!
//! The first byte of a segment says what it is:
//!
//! | bits 7..5 | segment | rest of the byte |
//! |---|---|---|
//! | 000 | port | 4: extended link address; 3..0: port, 15 = 16-bit port follows |
//! | 001 | logical | 4..2: type; 1..0: format (8, 16, 32 bit) |
//! | 010 | network | 4..0: subtype; from 0x10 on a word count follows, below it one byte |
//! | 011 | symbolic | 4..0: length of the ASCII text, 0 is not supported |
//! | 100 | data | 0x80 simple (word count, words), 0x91 ANSI extended symbol (byte count, text) |
//!
//! In the padded form, which every explicit message and connection path uses, each segment has an even
//! length: 16 and 32-bit logical values have a zero byte before them, odd texts and link addresses one
//! behind. The packed form leaves these bytes out.

use super::encapsulation::words_u8;
use super::{Error, Reader, Writer};
use core::fmt;
use profile_generic::open_code;

open_code! {
    /// What a logical segment names (bits 4..2).
    pub struct LogicalType(u8) {
        /// Class.
        CLASS = 0 => "class",
        /// Instance.
        INSTANCE = 1 => "instance",
        /// Member of an attribute.
        MEMBER = 2 => "member",
        /// Connection point.
        CONNECTION_POINT = 3 => "connection point",
        /// Attribute.
        ATTRIBUTE = 4 => "attribute",
        /// Service.
        SERVICE = 6 => "service",
    }
}

const LOGICAL_SPECIAL: u8 = 5;
const LOGICAL_EXTENDED: u8 = 7;
const KEY_FORMAT_4: u8 = 4;
const SIMPLE_DATA: u8 = 0x80;
const EXTENDED_SYMBOL: u8 = 0x91;
const EXTENDED_PORT: u8 = 15;

/// Whether segments are aligned to 16 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Every segment has an even length.
    Padded,
    /// No padding bytes.
    Packed,
}

/// The value of a logical segment in the width it is sent with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogicalValue {
    /// 8 bits.
    U8(u8),
    /// 16 bits.
    U16(u16),
    /// 32 bits.
    U32(u32),
}

impl LogicalValue {
    /// The value in the narrowest width that holds it.
    pub fn narrowest(value: u32) -> Self {
        if let Ok(value) = u8::try_from(value) {
            Self::U8(value)
        } else if let Ok(value) = u16::try_from(value) {
            Self::U16(value)
        } else {
            Self::U32(value)
        }
    }

    /// The value, whatever its width.
    pub fn get(self) -> u32 {
        match self {
            Self::U8(value) => u32::from(value),
            Self::U16(value) => u32::from(value),
            Self::U32(value) => value,
        }
    }
}

/// Electronic key, format 4: which device the originator thinks it talks to. A zero matches anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ElectronicKey {
    /// Vendor ID.
    pub vendor: u16,
    /// Device type (profile).
    pub device_type: u16,
    /// Product code.
    pub product_code: u16,
    /// Bit 7: any device that is compatible will do.
    pub compatible: bool,
    /// Major revision, 0..=127.
    pub major: u8,
    /// Minor revision.
    pub minor: u8,
}

/// One segment of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Segment<'a> {
    /// Leave through `port` to the neighbour with this link address.
    Port {
        /// Port number, 1..=65535.
        port: u16,
        /// Link address: one byte, or text such as an IPv4 address, at most 255 bytes.
        link: &'a [u8],
    },
    /// A number in the object model.
    Logical {
        /// What the number names.
        kind: LogicalType,
        /// The number.
        value: LogicalValue,
    },
    /// Which device is meant.
    Key(ElectronicKey),
    /// Network segment, kept but not interpreted: schedule, fixed tag, production inhibit, safety.
    Network {
        /// Bits 4..0 of the segment byte.
        subtype: u8,
        /// One byte below subtype 0x10, an even count of bytes from there on.
        data: &'a [u8],
    },
    /// ASCII symbol of up to 31 characters.
    Symbol(&'a [u8]),
    /// ANSI extended symbol, at most 255 characters.
    ExtendedSymbol(&'a [u8]),
    /// Simple data, an even count of bytes up to 510.
    Data(&'a [u8]),
}

impl<'a> Segment<'a> {
    /// Class segment.
    pub fn class(class: u16) -> Self {
        Self::logical(LogicalType::CLASS, u32::from(class))
    }

    /// Instance segment.
    pub fn instance(instance: u32) -> Self {
        Self::logical(LogicalType::INSTANCE, instance)
    }

    /// Attribute segment.
    pub fn attribute(attribute: u16) -> Self {
        Self::logical(LogicalType::ATTRIBUTE, u32::from(attribute))
    }

    /// Connection point segment.
    pub fn connection_point(point: u16) -> Self {
        Self::logical(LogicalType::CONNECTION_POINT, u32::from(point))
    }

    /// Logical segment in its narrowest width.
    pub fn logical(kind: LogicalType, value: u32) -> Self {
        Self::Logical { kind, value: LogicalValue::narrowest(value) }
    }

    /// Reads one segment where `r` stands.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::invalid`] naming the field for segments that are reserved or not
    /// supported.
    // Flat: one arm per kind of segment.
    pub fn read(r: &mut Reader<'a>, encoding: Encoding) -> Result<Self, Error> {
        let start = r.offset();
        let first = r.u8("segment")?;
        match first >> 5 {
            0 => Self::read_port(r, first, start, encoding),
            1 => Self::read_logical(r, first, start, encoding),
            2 => {
                let subtype = first & 0x1F;
                let length =
                    if subtype < 0x10 { 1 } else { 2 * usize::from(r.u8("network segment length")?) };
                Ok(Self::Network { subtype, data: r.take("network segment", length)? })
            }
            3 if first & 0x1F != 0 => {
                let text = r.take("symbol", usize::from(first & 0x1F))?;
                pad_read(r, start, encoding)?;
                Ok(Self::Symbol(text))
            }
            4 if first == SIMPLE_DATA => {
                let words = r.u8("data segment length")?;
                Ok(Self::Data(r.take("data segment", 2 * usize::from(words))?))
            }
            4 if first == EXTENDED_SYMBOL => {
                let length = r.u8("symbol length")?;
                let text = r.take("symbol", usize::from(length))?;
                pad_read(r, start, encoding)?;
                Ok(Self::ExtendedSymbol(text))
            }
            _ => Err(unsupported("segment type", start, first)),
        }
    }

    fn read_port(r: &mut Reader<'a>, first: u8, start: usize, encoding: Encoding) -> Result<Self, Error> {
        let extended_link = first & 0x10 != 0;
        let link_length = if extended_link { usize::from(r.u8("link address length")?) } else { 1 };
        let port = match first & 0x0F {
            0 => return Err(unsupported("port", start, first)),
            EXTENDED_PORT => match r.u16("extended port")? {
                0 => return Err(unsupported("extended port", start, first)),
                port => port,
            },
            port => u16::from(port),
        };
        let link = r.take("link address", link_length)?;
        if extended_link {
            pad_read(r, start, encoding)?;
        }
        Ok(Self::Port { port, link })
    }

    fn read_logical(r: &mut Reader<'a>, first: u8, start: usize, encoding: Encoding) -> Result<Self, Error> {
        let kind = first >> 2 & 7;
        let format = first & 3;
        match (kind, format) {
            (LOGICAL_SPECIAL, 0) => Self::read_key(r),
            (LOGICAL_SPECIAL | LOGICAL_EXTENDED, _) => Err(unsupported("logical segment", start, first)),
            (_, 0) => {
                Ok(Self::Logical { kind: LogicalType(kind), value: LogicalValue::U8(r.u8("logical value")?) })
            }
            (6, _) => Err(unsupported("service segment format", start, first)),
            (_, 1 | 2) => {
                if encoding == Encoding::Padded {
                    r.u8("logical pad")?;
                }
                let value = if format == 1 {
                    LogicalValue::U16(r.u16("logical value")?)
                } else {
                    LogicalValue::U32(r.u32("logical value")?)
                };
                Ok(Self::Logical { kind: LogicalType(kind), value })
            }
            _ => Err(unsupported("logical format", start, first)),
        }
    }

    fn read_key(r: &mut Reader<'a>) -> Result<Self, Error> {
        let offset = r.offset();
        let format = r.u8("electronic key format")?;
        if format != KEY_FORMAT_4 {
            let (found, expected) = (u32::from(format), u32::from(KEY_FORMAT_4));
            return Err(Error::invalid("electronic key format", offset, expected, found));
        }
        let vendor = r.u16("key vendor ID")?;
        let device_type = r.u16("key device type")?;
        let product_code = r.u16("key product code")?;
        let major = r.u8("key major revision")?;
        let minor = r.u8("key minor revision")?;
        let compatible = major & 0x80 != 0;
        Ok(Self::Key(ElectronicKey {
            vendor,
            device_type,
            product_code,
            compatible,
            major: major & 0x7F,
            minor,
        }))
    }

    /// Bytes of this segment.
    pub fn buffer_len(&self, encoding: Encoding) -> usize {
        let length = match *self {
            Self::Port { port, link } => {
                1 + usize::from(link.len() != 1)
                    + 2 * usize::from(port >= u16::from(EXTENDED_PORT))
                    + link.len()
            }
            Self::Logical { value, .. } => {
                let pad = usize::from(encoding == Encoding::Padded);
                match value {
                    LogicalValue::U8(_) => 2,
                    LogicalValue::U16(_) => 3 + pad,
                    LogicalValue::U32(_) => 5 + pad,
                }
            }
            Self::Key(_) => 10,
            Self::Network { subtype, data } => 1 + usize::from(subtype >= 0x10) + data.len(),
            Self::Symbol(text) => 1 + text.len(),
            Self::ExtendedSymbol(text) | Self::Data(text) => 2 + text.len(),
        };
        length + usize::from(encoding == Encoding::Padded && length % 2 != 0)
    }

    /// Writes the segment where `w` stands.
    ///
    /// # Errors
    /// [`Error::truncated`]; [`Error::too_large`] and [`Error::invalid`] for a value its segment cannot
    /// carry.
    // Flat: one arm per kind of segment.
    pub fn write(&self, w: &mut Writer<'_>, encoding: Encoding) -> Result<(), Error> {
        let start = w.written();
        match *self {
            Self::Port { port, link } => Self::write_port(w, port, link)?,
            Self::Logical { kind, value } => Self::write_logical(w, kind, value, encoding)?,
            Self::Key(key) => {
                w.u8("segment", 0x20 | LOGICAL_SPECIAL << 2)?;
                w.u8("electronic key format", KEY_FORMAT_4)?;
                w.u16("key vendor ID", key.vendor)?;
                w.u16("key device type", key.device_type)?;
                w.u16("key product code", key.product_code)?;
                let major = at_most("key major revision", key.major, 0x7F)?;
                w.u8("key major revision", major | u8::from(key.compatible) << 7)?;
                w.u8("key minor revision", key.minor)?;
            }
            Self::Network { subtype, data } => {
                w.u8("segment", 0x40 | at_most("network segment subtype", subtype, 0x1F)?)?;
                if subtype >= 0x10 {
                    w.u8("network segment length", words_u8("network segment", data.len())?)?;
                } else if data.len() != 1 {
                    let found = u32::try_from(data.len()).unwrap_or(u32::MAX);
                    return Err(Error::invalid("network segment", start, 1, found));
                }
                w.slice("network segment", data)?;
            }
            Self::Symbol(text) => {
                let length = at_most("symbol length", length_u8("symbol", text.len())?, 31)?;
                if length == 0 {
                    return Err(unsupported("symbol length", start, 0));
                }
                w.u8("segment", 0x60 | length)?;
                w.slice("symbol", text)?;
            }
            Self::ExtendedSymbol(text) => {
                w.u8("segment", EXTENDED_SYMBOL)?;
                w.u8("symbol length", length_u8("symbol", text.len())?)?;
                w.slice("symbol", text)?;
            }
            Self::Data(data) => {
                w.u8("segment", SIMPLE_DATA)?;
                w.u8("data segment length", words_u8("data segment", data.len())?)?;
                w.slice("data segment", data)?;
            }
        }
        if encoding == Encoding::Padded && !(w.written() - start).is_multiple_of(2) {
            w.u8("pad", 0)?;
        }
        Ok(())
    }

    fn write_port(w: &mut Writer<'_>, port: u16, link: &[u8]) -> Result<(), Error> {
        if port == 0 {
            return Err(unsupported("port", w.written(), 0));
        }
        let low = u8::try_from(port).map_or(EXTENDED_PORT, |port| port.min(EXTENDED_PORT));
        let extended_link = link.len() != 1;
        w.u8("segment", low | u8::from(extended_link) << 4)?;
        if extended_link {
            w.u8("link address length", length_u8("link address", link.len())?)?;
        }
        if low == EXTENDED_PORT {
            w.u16("extended port", port)?;
        }
        w.slice("link address", link)
    }

    fn write_logical(
        w: &mut Writer<'_>,
        kind: LogicalType,
        value: LogicalValue,
        encoding: Encoding,
    ) -> Result<(), Error> {
        let wide_service = kind == LogicalType::SERVICE && !matches!(value, LogicalValue::U8(_));
        if kind.0 > 6 || kind.0 == LOGICAL_SPECIAL || wide_service {
            return Err(unsupported("logical type", w.written(), kind.0));
        }
        let format = match value {
            LogicalValue::U8(_) => 0,
            LogicalValue::U16(_) => 1,
            LogicalValue::U32(_) => 2,
        };
        w.u8("segment", 0x20 | kind.0 << 2 | format)?;
        if format != 0 && encoding == Encoding::Padded {
            w.u8("logical pad", 0)?;
        }
        match value {
            LogicalValue::U8(value) => w.u8("logical value", value),
            LogicalValue::U16(value) => w.u16("logical value", value),
            LogicalValue::U32(value) => w.u32("logical value", value),
        }
    }
}

fn unsupported(what: &'static str, offset: usize, found: u8) -> Error {
    Error::invalid(what, offset, 0x20, u32::from(found))
}

fn at_most(what: &'static str, value: u8, max: u8) -> Result<u8, Error> {
    if value <= max {
        return Ok(value);
    }
    Err(Error::too_large(what, u32::from(max), u32::from(value)))
}

fn length_u8(what: &'static str, length: usize) -> Result<u8, Error> {
    u8::try_from(length).map_err(|_| Error::too_large(what, 255, u32::try_from(length).unwrap_or(u32::MAX)))
}

fn pad_read(r: &mut Reader<'_>, start: usize, encoding: Encoding) -> Result<(), Error> {
    if encoding == Encoding::Padded && !(r.offset() - start).is_multiple_of(2) {
        r.u8("pad")?;
    }
    Ok(())
}

/// The segments of a path one after the other; stops behind the first malformed one.
#[derive(Debug, Clone)]
pub struct Segments<'a> {
    reader: Reader<'a>,
    encoding: Encoding,
    failed: bool,
}

/// Walks through the segments of `path`.
pub const fn segments(path: &[u8], encoding: Encoding) -> Segments<'_> {
    Segments { reader: Reader::new(path), encoding, failed: false }
}

impl<'a> Iterator for Segments<'a> {
    type Item = Result<Segment<'a>, Error>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed || self.reader.is_empty() {
            return None;
        }
        let segment = Segment::read(&mut self.reader, self.encoding);
        self.failed = segment.is_err();
        Some(segment)
    }
}

/// Bytes of a path made of these segments.
pub fn path_len(path: &[Segment<'_>], encoding: Encoding) -> usize {
    path.iter().map(|segment| segment.buffer_len(encoding)).sum()
}

/// Writes a path made of these segments and returns its length.
///
/// # Errors
/// As [`Segment::write`].
pub fn emit_path(path: &[Segment<'_>], encoding: Encoding, buffer: &mut [u8]) -> Result<usize, Error> {
    let mut w = Writer::new(buffer);
    for segment in path {
        segment.write(&mut w, encoding)?;
    }
    Ok(w.written())
}

impl fmt::Display for Segment<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Port { port, link: [address] } => write!(f, "port {port} link {address}"),
            Self::Port { port, link } => write!(f, "port {port} link \"{}\"", link.escape_ascii()),
            Self::Logical { kind, value } => write!(f, "{kind} {:#x}", value.get()),
            Self::Key(key) => write!(
                f,
                "key vendor {:#x} type {:#x} product {:#x} revision {}.{}{}",
                key.vendor,
                key.device_type,
                key.product_code,
                key.major,
                key.minor,
                if key.compatible { " or compatible" } else { "" }
            ),
            Self::Network { subtype, data } => write!(f, "network {subtype:#x} with {} bytes", data.len()),
            Self::Symbol(text) | Self::ExtendedSymbol(text) => {
                write!(f, "symbol \"{}\"", text.escape_ascii())
            }
            Self::Data(data) => write!(f, "data of {} bytes", data.len()),
        }
    }
}

#[cfg(test)]
#[path = "epath_tests.rs"]
mod tests;
