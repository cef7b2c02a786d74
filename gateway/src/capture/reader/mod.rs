//! Reads pcap and pcapng files, one frame at a time.
//!
//! Only the frame at hand is held. Nothing is allocated by a length in the file before as many bytes have
//! been read, and every error says at which offset of the file what was expected and what was found.
//!
//! pcap: global header of 24 bytes (magic number, version, zone, accuracy, snap length, link type), then for
//! each frame seconds, fraction (microseconds or nanoseconds by the magic number), captured length, original
//! length, data.
//!
//! pcapng: blocks of type, length, body, length again. Read are section headers, interface descriptions,
//! enhanced, simple and (obsolete) plain packets; all others are passed over.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use thiserror::Error;

use super::blocks;
use crate::sys::clock::KernelTime;

/// The longest frame or packet block accepted: what Wireshark accepts.
pub const FRAME_LEN_LIMIT: u32 = 262_144;

/// The longest pcapng block accepted: what Wireshark accepts.
pub const BLOCK_LEN_LIMIT: u32 = 16 * 1024 * 1024;

/// Interfaces described in one section; a file of this box has three.
pub const INTERFACES_MAX: usize = 1024;

/// Link type of Ethernet frames.
pub const LINK_TYPE_ETHERNET: u16 = 1;

/// What is wrong with a recording.
#[derive(Debug, Error)]
pub enum ReadError {
    /// Reading failed.
    #[error("offset {offset}: cannot read: {source}")]
    Io {
        /// Bytes from the start of the file.
        offset: u64,
        /// The system's error.
        source: io::Error,
    },
    /// The first four bytes are of neither format.
    #[error("not a pcap or pcapng file: it begins with {:02x} {:02x} {:02x} {:02x}", found[0], found[1], found[2], found[3])]
    UnknownFormat {
        /// The first bytes; zero past the end of a shorter file.
        found: [u8; 4],
    },
    /// The file ends inside something.
    #[error(
        "offset {offset}: the file ends in the middle of {what}: {expected} bytes expected, {found} left"
    )]
    Truncated {
        /// Where it begins.
        offset: u64,
        /// Name of the block or field.
        what: &'static str,
        /// Bytes it needs.
        expected: u64,
        /// Bytes there are.
        found: u64,
    },
    /// A length is beyond the limit or impossible.
    #[error("offset {offset}: {what} is {found}, expected {expected}")]
    BadLength {
        /// Where the record or block begins.
        offset: u64,
        /// Which length.
        what: &'static str,
        /// The lengths accepted.
        expected: &'static str,
        /// What was there.
        found: u32,
    },
    /// A value is not one of those the format has.
    #[error("offset {offset}: {what} is {found:#x}, expected {expected}")]
    BadValue {
        /// Where the record or block begins.
        offset: u64,
        /// Which value.
        what: &'static str,
        /// The values accepted.
        expected: &'static str,
        /// What was there.
        found: u32,
    },
    /// A packet names an interface that has not been described.
    #[error(
        "offset {offset}: the packet is of interface {id}, and {known} interfaces are described before it"
    )]
    UnknownInterface {
        /// Where the block begins.
        offset: u64,
        /// The interface's number.
        id: u32,
        /// Number of interfaces described so far.
        known: usize,
    },
}

/// One recorded frame; its bytes stay in the reader until the next one is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Its number in the file, from 1.
    pub number: u64,
    /// When it was recorded; `None` in simple packet blocks.
    pub at: Option<KernelTime>,
    /// Number of its section, from 0; a section has interfaces of its own.
    pub section: u64,
    /// Number of the interface in its section; 0 in pcap files.
    pub interface: u32,
    /// Name of the interface, where the file has one.
    pub interface_name: Option<&'a str>,
    /// What the file says about the interface.
    pub interface_description: Option<&'a str>,
    /// Link type; 1 is Ethernet.
    pub link_type: u16,
    /// Length the frame had on the network.
    pub original_len: u32,
    /// The recorded bytes.
    pub data: &'a [u8],
    /// The first comment on the frame.
    pub comment: Option<&'a str>,
}

impl Frame<'_> {
    /// How much of the frame was not recorded, in words; `None` of a whole one.
    #[must_use]
    pub fn cut(&self) -> Option<String> {
        let original = usize::try_from(self.original_len).unwrap_or(usize::MAX);
        let missing = original.saturating_sub(self.data.len());
        (missing > 0).then(|| format!("cut in the recording: {missing} bytes are missing"))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Endian {
    Little,
    Big,
}

impl Endian {
    fn u16(self, bytes: &[u8], at: usize) -> u16 {
        let mut field = [0; 2];
        field.copy_from_slice(&bytes[at..at + 2]);
        match self {
            Self::Little => u16::from_le_bytes(field),
            Self::Big => u16::from_be_bytes(field),
        }
    }

    fn u32(self, bytes: &[u8], at: usize) -> u32 {
        let mut field = [0; 4];
        field.copy_from_slice(&bytes[at..at + 4]);
        match self {
            Self::Little => u32::from_le_bytes(field),
            Self::Big => u32::from_be_bytes(field),
        }
    }
}

/// Length of a time unit and where it starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TimeUnit {
    per_second: u128,
    offset_s: i64,
}

impl TimeUnit {
    const MICROSECONDS: Self = Self { per_second: 1_000_000, offset_s: 0 };

    /// From `if_tsresol`: bit 7 clear, negative power of ten; set, negative power of two.
    fn from_resolution(byte: u8) -> Option<Self> {
        let exponent = u32::from(byte & 0x7F);
        let per_second = if byte & 0x80 == 0 {
            // 10^19 is the largest power below 2^64: no finer unit can reach one second in 64 bits.
            (exponent <= 19).then(|| 10_u128.pow(exponent))?
        } else {
            (exponent <= 64).then(|| 1_u128 << exponent)?
        };
        Some(Self { per_second, offset_s: 0 })
    }

    fn to_time(self, units: u64) -> KernelTime {
        let nanoseconds = u128::from(units) * 1_000_000_000 / self.per_second;
        let nanoseconds = u64::try_from(nanoseconds).unwrap_or(u64::MAX);
        KernelTime(nanoseconds.saturating_add_signed(self.offset_s.saturating_mul(1_000_000_000)))
    }
}

#[derive(Debug, Clone)]
struct Interface {
    link_type: u16,
    snap_len: u32,
    unit: TimeUnit,
    name: Option<String>,
    description: Option<String>,
}

#[derive(Debug)]
enum Format {
    Pcap { endian: Endian, unit: TimeUnit, link_type: u16 },
    PcapNg { endian: Endian, section: u64, interfaces: Vec<Interface> },
}

/// An open recording.
#[derive(Debug)]
pub struct Reader<R> {
    source: Source<R>,
    format: Format,
    frames: u64,
    body: Vec<u8>,
}

impl Reader<BufReader<File>> {
    /// Opens a file.
    ///
    /// # Errors
    /// [`ReadError`] when it cannot be read or is of neither format.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let file = File::open(path).map_err(|source| ReadError::Io { offset: 0, source })?;
        Self::new(BufReader::with_capacity(1 << 16, file))
    }
}

impl<R: Read> Reader<R> {
    /// Reads the file's header.
    ///
    /// # Errors
    /// [`ReadError`] when it is of neither format.
    pub fn new(source: R) -> Result<Self, ReadError> {
        let mut source = Source { inner: source, offset: 0 };
        let mut magic = [0; 4];
        let found = source.fill(&mut magic)?;
        let format = match magic {
            _ if found < magic.len() => return Err(ReadError::UnknownFormat { found: magic }),
            [0xA1, 0xB2, 0xC3, 0xD4] => pcap_header(&mut source, Endian::Big, 1_000_000)?,
            [0xA1, 0xB2, 0x3C, 0x4D] => pcap_header(&mut source, Endian::Big, 1_000_000_000)?,
            [0xD4, 0xC3, 0xB2, 0xA1] => pcap_header(&mut source, Endian::Little, 1_000_000)?,
            [0x4D, 0x3C, 0xB2, 0xA1] => pcap_header(&mut source, Endian::Little, 1_000_000_000)?,
            [0x0A, 0x0D, 0x0D, 0x0A] => {
                let endian = section_header(&mut source, 0)?;
                Format::PcapNg { endian, section: 0, interfaces: Vec::new() }
            }
            _ => return Err(ReadError::UnknownFormat { found: magic }),
        };
        Ok(Self { source, format, frames: 0, body: Vec::new() })
    }

    /// Bytes of the file that were read so far.
    #[must_use]
    pub fn offset(&self) -> u64 {
        self.source.offset
    }

    /// The next frame; `None` at the end of the file.
    ///
    /// # Errors
    /// [`ReadError`]; what follows in the file cannot be read then.
    pub fn next_frame(&mut self) -> Result<Option<Frame<'_>>, ReadError> {
        match self.format {
            Format::Pcap { endian, unit, link_type } => self.next_pcap(endian, unit, link_type),
            Format::PcapNg { .. } => self.next_pcapng(),
        }
    }

    fn next_pcap(
        &mut self,
        endian: Endian,
        unit: TimeUnit,
        link_type: u16,
    ) -> Result<Option<Frame<'_>>, ReadError> {
        let start = self.source.offset;
        let mut header = [0; 16];
        if !self.source.header(&mut header, "a frame's header")? {
            return Ok(None);
        }
        let captured = endian.u32(&header, 8);
        if captured > FRAME_LEN_LIMIT {
            return Err(ReadError::BadLength {
                offset: start,
                what: "the captured length",
                expected: "at most 262144",
                found: captured,
            });
        }
        self.source.body(captured, start, "a frame", &mut self.body)?;
        self.frames += 1;
        let fraction = unit.to_time(u64::from(endian.u32(&header, 4))).0;
        let seconds = u64::from(endian.u32(&header, 0));
        Ok(Some(Frame {
            number: self.frames,
            at: Some(KernelTime(seconds * 1_000_000_000 + fraction)),
            section: 0,
            interface: 0,
            interface_name: None,
            interface_description: None,
            link_type,
            original_len: endian.u32(&header, 12),
            data: &self.body,
            comment: None,
        }))
    }

    fn next_pcapng(&mut self) -> Result<Option<Frame<'_>>, ReadError> {
        let Some(packet) = self.next_packet()? else { return Ok(None) };
        let Format::PcapNg { endian, section, interfaces } = &self.format else { return Ok(None) };
        let interface = &interfaces[packet.index];
        let comment = packet.options_at.and_then(|at| {
            let mut options = Options::new(&self.body, at, *endian);
            let (_, text) = options.find(|(code, _)| *code == blocks::OPTION_COMMENT)?;
            std::str::from_utf8(text).ok()
        });
        self.frames += 1;
        Ok(Some(Frame {
            number: self.frames,
            at: packet.units.map(|units| interface.unit.to_time(units)),
            section: *section,
            interface: packet.interface,
            interface_name: interface.name.as_deref(),
            interface_description: interface.description.as_deref(),
            link_type: interface.link_type,
            original_len: packet.original_len,
            data: &self.body[packet.data_at..packet.data_at + packet.captured],
            comment,
        }))
    }

    /// Reads blocks up to the next one that carries a packet; its body is left in `self.body`.
    fn next_packet(&mut self) -> Result<Option<Packet>, ReadError> {
        let Format::PcapNg { endian, section, interfaces } = &mut self.format else { return Ok(None) };
        loop {
            let start = self.source.offset;
            let mut kind = [0; 4];
            if !self.source.header(&mut kind, "a block's type")? {
                return Ok(None);
            }
            let kind = endian.u32(&kind, 0);
            // The section header's type reads the same in both byte orders.
            if kind == blocks::SECTION {
                *endian = section_header(&mut self.source, start)?;
                *section += 1;
                interfaces.clear();
                continue;
            }
            block_body(&mut self.source, *endian, start, &mut self.body)?;
            match kind {
                blocks::INTERFACE if interfaces.len() == INTERFACES_MAX => {
                    return Err(ReadError::BadLength {
                        offset: start,
                        what: "the number of interfaces",
                        expected: "at most 1024",
                        found: 1025,
                    });
                }
                blocks::INTERFACE => interfaces.push(interface_description(&self.body, *endian, start)?),
                blocks::ENHANCED | blocks::PACKET_OBSOLETE | blocks::SIMPLE => {
                    return packet(kind, &self.body, *endian, start, interfaces).map(Some);
                }
                _ => {}
            }
        }
    }
}

/// The rest of a pcap global header after its magic number.
fn pcap_header<R: Read>(
    source: &mut Source<R>,
    endian: Endian,
    per_second: u128,
) -> Result<Format, ReadError> {
    let mut header = [0; 20];
    if !source.header(&mut header, "the file's header")? {
        return Err(ReadError::Truncated { offset: 4, what: "the file's header", expected: 20, found: 0 });
    }
    let major = endian.u16(&header, 0);
    if major != 2 {
        return Err(ReadError::BadValue {
            offset: 4,
            what: "the major version",
            expected: "2",
            found: u32::from(major),
        });
    }
    // The upper bits of the link type carry the length of a frame check sequence.
    let link_type = u16::try_from(endian.u32(&header, 16) & 0xFFFF).unwrap_or(0);
    Ok(Format::Pcap { endian, unit: TimeUnit { per_second, offset_s: 0 }, link_type })
}

/// The rest of a section header after its type: its byte order is inside.
fn section_header<R: Read>(source: &mut Source<R>, start: u64) -> Result<Endian, ReadError> {
    const WHAT: &str = "a section header";
    let mut header = [0; 8];
    if !source.header(&mut header, WHAT)? {
        return Err(ReadError::Truncated { offset: start, what: WHAT, expected: 28, found: 4 });
    }
    let endian = match header[4..] {
        [0x1A, 0x2B, 0x3C, 0x4D] => Endian::Big,
        [0x4D, 0x3C, 0x2B, 0x1A] => Endian::Little,
        _ => {
            return Err(ReadError::BadValue {
                offset: start,
                what: "the byte order of the section",
                expected: "0x1a2b3c4d",
                found: Endian::Big.u32(&header, 4),
            });
        }
    };
    let length = endian.u32(&header, 0);
    check_block_length(length, 28, start)?;
    // Type, length and byte order have been read.
    let mut rest = Vec::new();
    source.body(length - 12, start, WHAT, &mut rest)?;
    let major = endian.u16(&rest, 0);
    if major != 1 {
        return Err(ReadError::BadValue {
            offset: start,
            what: "the major version of the section",
            expected: "1",
            found: u32::from(major),
        });
    }
    check_trailer(endian.u32(&rest, rest.len() - 4), length, start)?;
    Ok(endian)
}

/// The body of a block after its type, without the closing length.
fn block_body<R: Read>(
    source: &mut Source<R>,
    endian: Endian,
    start: u64,
    body: &mut Vec<u8>,
) -> Result<(), ReadError> {
    let mut length = [0; 4];
    if !source.header(&mut length, "a block's length")? {
        return Err(ReadError::Truncated { offset: start, what: "a block's header", expected: 8, found: 4 });
    }
    let length = endian.u32(&length, 0);
    check_block_length(length, 12, start)?;
    source.body(length - 8, start, "a block", body)?;
    let trailer = endian.u32(body, body.len() - 4);
    check_trailer(trailer, length, start)?;
    body.truncate(body.len() - 4);
    Ok(())
}

fn check_block_length(length: u32, least: u32, offset: u64) -> Result<(), ReadError> {
    if length < least || length > BLOCK_LEN_LIMIT || !length.is_multiple_of(4) {
        return Err(ReadError::BadLength {
            offset,
            what: "the block's length",
            expected: "a multiple of 4 from 12 (28 for a section header) to 16777216",
            found: length,
        });
    }
    Ok(())
}

fn check_trailer(trailer: u32, length: u32, offset: u64) -> Result<(), ReadError> {
    if trailer == length {
        return Ok(());
    }
    Err(ReadError::BadLength {
        offset,
        what: "the length at the end of the block",
        expected: "the same as at its beginning",
        found: trailer,
    })
}

fn interface_description(body: &[u8], endian: Endian, start: u64) -> Result<Interface, ReadError> {
    require(body, 8, "an interface description", start)?;
    let mut interface = Interface {
        link_type: endian.u16(body, 0),
        snap_len: endian.u32(body, 4),
        unit: TimeUnit::MICROSECONDS,
        name: None,
        description: None,
    };
    let mut offset_s = 0;
    let utf8 = |text| std::str::from_utf8(text).ok().map(str::to_owned);
    for (code, value) in Options::new(body, 8, endian) {
        match (code, value) {
            (blocks::OPTION_IF_NAME, text) => interface.name = utf8(text),
            (blocks::OPTION_IF_DESCRIPTION, text) => interface.description = utf8(text),
            (blocks::OPTION_IF_TSRESOL, &[byte]) => {
                interface.unit = TimeUnit::from_resolution(byte).ok_or(ReadError::BadValue {
                    offset: start,
                    what: "the resolution of time stamps",
                    expected: "at most 19 decimal or 64 binary digits",
                    found: u32::from(byte),
                })?;
            }
            (blocks::OPTION_IF_TSOFFSET, &[a, b, c, d, e, f, g, h]) => {
                let bytes = [a, b, c, d, e, f, g, h];
                offset_s = match endian {
                    Endian::Little => i64::from_le_bytes(bytes),
                    Endian::Big => i64::from_be_bytes(bytes),
                };
            }
            _ => {}
        }
    }
    interface.unit.offset_s = offset_s;
    Ok(interface)
}

struct Packet {
    interface: u32,
    index: usize,
    units: Option<u64>,
    data_at: usize,
    captured: usize,
    original_len: u32,
    options_at: Option<usize>,
}

fn packet(
    kind: u32,
    body: &[u8],
    endian: Endian,
    start: u64,
    interfaces: &[Interface],
) -> Result<Packet, ReadError> {
    let find = |id: u32| {
        let index = usize::try_from(id).unwrap_or(usize::MAX);
        let interface = interfaces.get(index).ok_or(ReadError::UnknownInterface {
            offset: start,
            id,
            known: interfaces.len(),
        })?;
        Ok((index, interface))
    };
    let (id, units, captured, original_len, data_at) = if kind == blocks::SIMPLE {
        require(body, 4, "a simple packet", start)?;
        let original = endian.u32(body, 0);
        let (_, interface) = find(0)?;
        let limit = if interface.snap_len == 0 { u32::MAX } else { interface.snap_len };
        (0, None, original.min(limit), original, 4)
    } else {
        require(body, 20, "a packet", start)?;
        let id = if kind == blocks::ENHANCED { endian.u32(body, 0) } else { u32::from(endian.u16(body, 0)) };
        let units = u64::from(endian.u32(body, 4)) << 32 | u64::from(endian.u32(body, 8));
        (id, Some(units), endian.u32(body, 12), endian.u32(body, 16), 20)
    };
    let (index, _) = find(id)?;
    if captured > FRAME_LEN_LIMIT {
        return Err(ReadError::BadLength {
            offset: start,
            what: "the captured length",
            expected: "at most 262144",
            found: captured,
        });
    }
    let found = captured;
    let captured = usize::try_from(captured).unwrap_or(usize::MAX);
    if captured > body.len() - data_at {
        return Err(ReadError::BadLength {
            offset: start,
            what: "the captured length",
            expected: "no more than the block holds",
            found,
        });
    }
    let options_at = (kind != blocks::SIMPLE).then(|| data_at + captured.next_multiple_of(4));
    Ok(Packet { interface: id, index, units, data_at, captured, original_len, options_at })
}

fn require(body: &[u8], least: usize, what: &'static str, offset: u64) -> Result<(), ReadError> {
    if body.len() >= least {
        return Ok(());
    }
    let (expected, found) = (u64::try_from(least).unwrap_or(0), u64::try_from(body.len()).unwrap_or(0));
    Err(ReadError::Truncated { offset, what, expected, found })
}

/// The options at the end of a block: code, length, value padded to 4. A bad length ends them.
struct Options<'a> {
    bytes: &'a [u8],
    endian: Endian,
}

impl<'a> Options<'a> {
    fn new(body: &'a [u8], at: usize, endian: Endian) -> Self {
        Self { bytes: body.get(at..).unwrap_or(&[]), endian }
    }
}

impl<'a> Iterator for Options<'a> {
    type Item = (u16, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.bytes.len() < 4 {
            return None;
        }
        let code = self.endian.u16(self.bytes, 0);
        let length = usize::from(self.endian.u16(self.bytes, 2));
        if code == blocks::OPTION_END {
            return None;
        }
        let value = self.bytes.get(4..4 + length)?;
        self.bytes = self.bytes.get(4 + length.next_multiple_of(4)..).unwrap_or(&[]);
        Some((code, value))
    }
}

/// The file, and how far it has been read.
#[derive(Debug)]
struct Source<R> {
    inner: R,
    offset: u64,
}

impl<R: Read> Source<R> {
    /// Fills as much of `buffer` as the file has left.
    fn fill(&mut self, buffer: &mut [u8]) -> Result<usize, ReadError> {
        let mut filled = 0;
        while filled < buffer.len() {
            match self.inner.read(&mut buffer[filled..]) {
                Ok(0) => break,
                Ok(read) => {
                    filled += read;
                    self.offset += u64::try_from(read).unwrap_or(0);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(source) => return Err(ReadError::Io { offset: self.offset, source }),
            }
        }
        Ok(filled)
    }

    /// Fills `buffer`; `false` when the file has ended before it, an error when it ends within.
    fn header(&mut self, buffer: &mut [u8], what: &'static str) -> Result<bool, ReadError> {
        let offset = self.offset;
        let found = self.fill(buffer)?;
        if found == 0 {
            return Ok(false);
        }
        if found < buffer.len() {
            let expected = u64::try_from(buffer.len()).unwrap_or(0);
            return Err(ReadError::Truncated {
                offset,
                what,
                expected,
                found: u64::try_from(found).unwrap_or(0),
            });
        }
        Ok(true)
    }

    /// Replaces `body` by the next `length` bytes; it grows only as bytes arrive.
    fn body(
        &mut self,
        length: u32,
        start: u64,
        what: &'static str,
        body: &mut Vec<u8>,
    ) -> Result<(), ReadError> {
        body.clear();
        let read = Read::take(&mut self.inner, u64::from(length)).read_to_end(body);
        let found = read.map_err(|source| ReadError::Io { offset: self.offset, source })?;
        let found = u64::try_from(found).unwrap_or(0);
        self.offset += found;
        if found < u64::from(length) {
            return Err(ReadError::Truncated { offset: start, what, expected: u64::from(length), found });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
