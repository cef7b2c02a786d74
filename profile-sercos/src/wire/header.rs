//! Ethernet and SERCOS header: the first 20 bytes of every SERCOS frame.
//!
//! | byte | size | field |
//! |---|---|---|
//! | 0 | 6 | destination, always broadcast |
//! | 6 | 6 | source: the master, also in telegrams that come back |
//! | 12 | 2 | EtherType 0x88CD, big endian |
//! | 14 | 1 | telegram type |
//! | 15 | 1 | phase field |
//! | 16 | 4 | header CRC, little endian |
//! | 20 | 40..1494 | data field |
//!
//! The header of MDT0 is the master synchronisation telegram (MST): its end is the time reference of the
//! cycle. Its CRC is the IEEE CRC-32 over frame bytes 0 to 15, so that a slave can trust the MST before the
//! frame check sequence has arrived. Every telegram carries it.

use core::fmt;

use profile_generic::wire::{Error, need};

/// Offsets in bytes from the start of the frame.
mod field {
    use core::ops::Range;
    pub const DESTINATION: Range<usize> = 0..6;
    pub const SOURCE: Range<usize> = DESTINATION.end..DESTINATION.end + 6;
    pub const ETHERTYPE: Range<usize> = SOURCE.end..SOURCE.end + 2;
    pub const TYPE: usize = ETHERTYPE.end;
    pub const PHASE: usize = TYPE + 1;
    pub const CRC: Range<usize> = PHASE + 1..PHASE + 5;
    pub const DATA: usize = CRC.end;
}

/// EtherType of SERCOS III.
pub const ETHERTYPE: u16 = 0x88CD;
/// Bytes before the data field. All telegram offsets in parameters count from here.
pub const HEADER_LEN: usize = field::DATA;
/// Shortest data field: fills the shortest Ethernet frame.
pub const DATA_LEN_MIN: usize = 40;
/// Longest data field: fills the longest Ethernet frame.
pub const DATA_LEN_MAX: usize = 1494;
/// Longest frame without the frame check sequence.
pub const FRAME_LEN_MAX: usize = HEADER_LEN + DATA_LEN_MAX;
/// MDTs, and likewise ATs, in one cycle.
pub const TELEGRAMS_MAX: usize = 4;

/// A hardware (MAC) address.
pub type MacAddress = [u8; 6];
/// Destination of every SERCOS frame.
pub const BROADCAST: MacAddress = [0xFF; 6];

/// The way round the ring that a telegram takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Primary channel, sent on the master's first port.
    Primary,
    /// Secondary channel, sent on the master's second port.
    Secondary,
}

impl Channel {
    /// Both, P first: each is at its `index`.
    pub const ALL: [Channel; 2] = [Channel::Primary, Channel::Secondary];

    /// The one that goes the other way round.
    #[must_use]
    pub const fn other(self) -> Channel {
        match self {
            Channel::Primary => Channel::Secondary,
            Channel::Secondary => Channel::Primary,
        }
    }

    /// 0 for P, 1 for S.
    pub(crate) const fn index(self) -> usize {
        match self {
            Channel::Primary => 0,
            Channel::Secondary => 1,
        }
    }
}

/// Who fills a telegram.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Master data telegram.
    Mdt,
    /// Acknowledge telegram: sent empty by the master, filled by the slaves as it passes.
    At,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kind::Mdt => "MDT",
            Kind::At => "AT",
        })
    }
}

/// The telegram type byte: bit 7 channel, bit 6 MDT or AT, bit 5 cycle count valid, bit 4 reserved,
/// bits 3..0 number. Reserved and unused bits are kept.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct TelegramType(pub u8);

impl TelegramType {
    const SECONDARY: u8 = 0x80;
    const AT: u8 = 0x40;
    const CYCLE_COUNT_VALID: u8 = 0x20;
    const NUMBER: u8 = 0x0F;

    /// Type of telegram `number` (0..=3; higher bits are cut off) with a valid cycle count.
    pub const fn new(channel: Channel, kind: Kind, number: u8) -> Self {
        let channel = match channel {
            Channel::Primary => 0,
            Channel::Secondary => Self::SECONDARY,
        };
        let kind = match kind {
            Kind::Mdt => 0,
            Kind::At => Self::AT,
        };
        TelegramType(channel | kind | Self::CYCLE_COUNT_VALID | (number & Self::NUMBER))
    }

    /// The channel.
    pub const fn channel(self) -> Channel {
        if self.0 & Self::SECONDARY == 0 { Channel::Primary } else { Channel::Secondary }
    }

    /// MDT or AT.
    pub const fn kind(self) -> Kind {
        if self.0 & Self::AT == 0 { Kind::Mdt } else { Kind::At }
    }

    /// Number of the telegram in its cycle; 0..=3 are in use, up to 15 can be written.
    pub const fn number(self) -> u8 {
        self.0 & Self::NUMBER
    }

    /// Whether the header of this telegram is the MST.
    pub const fn is_mst(self) -> bool {
        self.0 & (Self::AT | Self::NUMBER) == 0
    }
}

impl fmt::Debug for TelegramType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TelegramType({self}, {:#04x})", self.0)
    }
}

impl fmt::Display for TelegramType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let channel = match self.channel() {
            Channel::Primary => 'P',
            Channel::Secondary => 'S',
        };
        write!(f, "{}{} {channel}", self.kind(), self.number())
    }
}

/// A communication phase: 0 to 4 are defined, the field has room for 15.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Phase(pub u8);

impl Phase {
    /// Scan and addressing.
    pub const CP0: Phase = Phase(0);
    /// Service channel and device words are put into operation.
    pub const CP1: Phase = Phase(1);
    /// Parameters over the service channel.
    pub const CP2: Phase = Phase(2);
    /// Configured telegrams, cyclic data not yet evaluated.
    pub const CP3: Phase = Phase(3);
    /// Cyclic operation.
    pub const CP4: Phase = Phase(4);

    /// The phase above, or `None` from CP4 on.
    pub const fn next(self) -> Option<Phase> {
        if self.0 < Self::CP4.0 { Some(Phase(self.0 + 1)) } else { None }
    }

    /// Whether this is one of CP0 to CP4.
    pub const fn is_defined(self) -> bool {
        self.0 <= Self::CP4.0
    }
}

impl fmt::Debug for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CP{}", self.0)
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CP{}", self.0)
    }
}

/// The phase byte: bit 7 phase switching (CPS), bits 6..4 cycle count, bits 3..0 communication phase.
///
/// With CPS set the phase is already the new one while the telegrams still have the layout of the old one.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct PhaseField(pub u8);

impl PhaseField {
    const SWITCHING: u8 = 0x80;

    /// A phase byte. `cycle_count` and `phase` are cut to 3 and 4 bits.
    pub const fn new(switching: bool, cycle_count: u8, phase: Phase) -> Self {
        let cps = if switching { Self::SWITCHING } else { 0 };
        PhaseField(cps | (cycle_count & 7) << 4 | (phase.0 & 0x0F))
    }

    /// Whether a phase switch is pending (CPS).
    pub const fn switching(self) -> bool {
        self.0 & Self::SWITCHING != 0
    }

    /// Cycle count, 0..=7, one more every cycle.
    pub const fn cycle_count(self) -> u8 {
        self.0 >> 4 & 7
    }

    /// The communication phase, or the coming one when [`switching`](Self::switching).
    pub const fn phase(self) -> Phase {
        Phase(self.0 & 0x0F)
    }
}

impl fmt::Debug for PhaseField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PhaseField({self})")
    }
}

impl fmt::Display for PhaseField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let arrow = if self.switching() { "switching to " } else { "" };
        write!(f, "{arrow}{} cycle {}", self.phase(), self.cycle_count())
    }
}

/// The header of a SERCOS frame. The CRC is not part of it: `emit` computes it, `parse` checks it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Hardware address of the master.
    pub source: MacAddress,
    /// Kind, number and channel of the telegram.
    pub telegram: TelegramType,
    /// Phase, cycle count and phase switching.
    pub phase: PhaseField,
}

impl Header {
    /// Reads the header from the start of a frame.
    ///
    /// Fails if the frame is short, not broadcast, not SERCOS, or if the header CRC is wrong.
    pub fn parse(frame: &[u8]) -> Result<Header, Error> {
        let header = Header::parse_unchecked(frame)?;
        let (found, expected) = (crc_found(frame), crc_expected(frame));
        if found != expected {
            return Err(Error::invalid("header CRC", field::CRC.start, expected, found));
        }
        Ok(header)
    }

    /// Reads the header without judging its CRC: for a decoder that shows broken frames.
    pub fn parse_unchecked(frame: &[u8]) -> Result<Header, Error> {
        need("SERCOS header", HEADER_LEN, frame.len())?;
        let ethertype =
            u16::from_be_bytes([frame[field::ETHERTYPE.start], frame[field::ETHERTYPE.start + 1]]);
        if ethertype != ETHERTYPE {
            return Err(Error::invalid(
                "EtherType",
                field::ETHERTYPE.start,
                u32::from(ETHERTYPE),
                u32::from(ethertype),
            ));
        }
        if let Some(offset) = field::DESTINATION.into_iter().find(|&at| frame[at] != 0xFF) {
            let found = u32::from(frame[offset]);
            return Err(Error::invalid("destination address", offset, 0xFF, found));
        }
        let mut source = [0; 6];
        source.copy_from_slice(&frame[field::SOURCE]);
        Ok(Header {
            source,
            telegram: TelegramType(frame[field::TYPE]),
            phase: PhaseField(frame[field::PHASE]),
        })
    }

    /// Bytes written by [`emit`](Self::emit).
    pub const fn buffer_len(&self) -> usize {
        HEADER_LEN
    }

    /// Writes the header with its CRC to the start of `frame`.
    pub fn emit(&self, frame: &mut [u8]) -> Result<(), Error> {
        need("SERCOS header", HEADER_LEN, frame.len())?;
        frame[field::DESTINATION].copy_from_slice(&BROADCAST);
        frame[field::SOURCE].copy_from_slice(&self.source);
        frame[field::ETHERTYPE].copy_from_slice(&ETHERTYPE.to_be_bytes());
        frame[field::TYPE] = self.telegram.0;
        frame[field::PHASE] = self.phase.0;
        let crc = crc_expected(frame);
        frame[field::CRC].copy_from_slice(&crc.to_le_bytes());
        Ok(())
    }
}

impl fmt::Display for Header {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} from ", self.telegram, self.phase)?;
        for (index, byte) in self.source.iter().enumerate() {
            write!(f, "{}{byte:02x}", if index == 0 { "" } else { ":" })?;
        }
        Ok(())
    }
}

/// The CRC as it stands in the frame; `frame` must hold a whole header.
fn crc_found(frame: &[u8]) -> u32 {
    profile_generic::wire::u32_at(frame, field::CRC.start)
}

/// The CRC which the header should have; `frame` must hold a whole header.
fn crc_expected(frame: &[u8]) -> u32 {
    crc32fast::hash(&frame[..field::CRC.start])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MASTER: MacAddress = [0xDE, 0xBC, 0x6C, 0x7C, 0xA2, 0x4F];

    fn header(telegram: u8, phase: u8) -> Header {
        Header { source: MASTER, telegram: TelegramType(telegram), phase: PhaseField(phase) }
    }

    /// Recording sercos3_startup_line2: frame number, type byte, phase byte, CRC bytes.
    const VECTORS: &[(u32, u8, u8, [u8; 4])] = &[
        (1, 0x20, 0x00, [0xF0, 0x5E, 0xB0, 0x3A]),
        (2, 0x60, 0x00, [0xF5, 0x11, 0xC9, 0xCA]),
        (5, 0x20, 0x10, [0x94, 0x4E, 0x07, 0x27]),
        (6, 0x60, 0x10, [0x91, 0x01, 0x7E, 0xD7]),
        (14, 0x60, 0x30, [0x59, 0x21, 0x10, 0xEC]),
    ];

    #[test]
    fn vectors_both_ways() {
        for &(frame, telegram, phase, crc) in VECTORS {
            let mut bytes = [0xA5; HEADER_LEN];
            let header = header(telegram, phase);
            header.emit(&mut bytes).unwrap();
            assert_eq!(bytes[..6], BROADCAST, "frame {frame}");
            assert_eq!(bytes[6..12], MASTER, "frame {frame}");
            assert_eq!(bytes[12..16], [0x88, 0xCD, telegram, phase], "frame {frame}");
            assert_eq!(bytes[16..20], crc, "frame {frame}");
            assert_eq!(Header::parse(&bytes), Ok(header), "frame {frame}");
        }
    }

    #[test]
    fn every_single_bit_error_is_found() {
        let mut bytes = [0; HEADER_LEN];
        header(0x20, 0x43).emit(&mut bytes).unwrap();
        for bit in 0..HEADER_LEN * 8 {
            let mut broken = bytes;
            broken[bit / 8] ^= 1 << (bit % 8);
            assert!(Header::parse(&broken).is_err(), "bit {bit}");
        }
    }

    #[test]
    fn truncation_is_an_error_at_every_byte() {
        let mut bytes = [0; HEADER_LEN];
        header(0x20, 0).emit(&mut bytes).unwrap();
        for len in 0..HEADER_LEN {
            let expected = Error::truncated("SERCOS header", 0, 20, len);
            assert_eq!(Header::parse(&bytes[..len]), Err(expected));
            assert_eq!(header(0x20, 0).emit(&mut [0; HEADER_LEN][..len]), Err(expected));
        }
    }

    #[test]
    fn type_and_phase_fields() {
        let telegram = TelegramType::new(Channel::Secondary, Kind::At, 3);
        assert_eq!(telegram.0, 0xE3);
        assert_eq!(
            (telegram.channel(), telegram.kind(), telegram.number(), telegram.is_mst()),
            (Channel::Secondary, Kind::At, 3, false)
        );
        assert_eq!(TelegramType::new(Channel::Primary, Kind::Mdt, 0).0, 0x20);
        assert!(TelegramType(0xA0).is_mst());
        let phase = PhaseField::new(true, 6, Phase::CP4);
        assert_eq!(phase.0, 0xE4);
        assert_eq!((phase.switching(), phase.cycle_count(), phase.phase()), (true, 6, Phase::CP4));
        assert_eq!(Phase::CP3.next(), Some(Phase::CP4));
        assert_eq!(Phase::CP4.next(), None);
        assert_eq!(header(0x60, 0xE4).to_string(), "AT0 P switching to CP4 cycle 6 from de:bc:6c:7c:a2:4f");
    }

    proptest! {
        #[test]
        fn any_header_comes_back(source: [u8; 6], telegram: u8, phase: u8) {
            let header = Header { source, telegram: TelegramType(telegram), phase: PhaseField(phase) };
            let mut bytes = [0xA5; HEADER_LEN];
            header.emit(&mut bytes).unwrap();
            prop_assert_eq!(Header::parse(&bytes), Ok(header));
        }

        #[test]
        fn any_bytes_do_not_panic(bytes: Vec<u8>) {
            if let Ok(header) = Header::parse(&bytes) {
                let mut again = [0; HEADER_LEN];
                header.emit(&mut again).unwrap();
                prop_assert_eq!(&again[..], &bytes[..HEADER_LEN]);
            }
        }
    }
}
