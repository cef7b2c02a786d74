//! Bits and time of a frame on the wire (ISO 11898-1).
//!
//! | part | classic, bits | FD, bits |
//! |---|---|---|
//! | start, identifier and control up to the last bit at the nominal rate | 19 (39) with the length code | 17 (36) |
//! | error state indicator and length code | in the row above | 5 |
//! | data | 8 each byte | 8 each byte |
//! | stuff count and CRC | 15 | 4 + 17 up to 16 bytes, 4 + 21 beyond; 6 or 7 fixed stuff bits |
//! | CRC delimiter, acknowledge and its delimiter, end of frame | 10 | 10 |
//! | intermission | 3 | 3 |
//!
//! In brackets with an identifier of 29 bits. After five equal bits comes a stuff bit of the other value, which counts as the
//! first of the next five: from the start of frame to the end of the CRC, in FD to the end of the data. Behind an FD
//! frame's last data bit stands a fixed stuff bit and never one of this kind.
//!
//! An FD frame with bit rate switch goes at the data rate from the error state indicator to the end of the CRC. The bit
//! that switches and the CRC delimiter are counted whole at the nominal rate.

use core::fmt;
use core::ops::Add;

use super::frame::{Frame, Id};
use crate::time::DurationNs;

/// CRC delimiter, acknowledge slot, its delimiter, seven bits of end of frame and three of intermission.
const TAIL: u32 = 1 + 1 + 1 + 7 + 3;

/// CRC of a classic frame.
const CLASSIC_CRC: u32 = 15;

/// Its generator without the leading term.
const CLASSIC_POLYNOMIAL: u16 = 0x4599;

/// Longest FD frame that has the shorter CRC, bytes.
const FD_SHORT_CRC_MAX: usize = 16;

/// Stuff count, CRC and fixed stuff bits of an FD frame: one before the first of these bits and before every fourth.
const FD_SHORT_CRC: u32 = 4 + 17 + 6;
const FD_LONG_CRC: u32 = 4 + 21 + 7;

/// Equal bits in a row behind which a stuff bit comes.
const RUN: u32 = 5;

/// Flags of all stations laid over each other.
const ERROR_FLAG_MAX: u32 = 12;

/// Bits that an error frame takes at most: the flags of all stations laid over each other, delimiter, intermission.
pub const ERROR_FRAME_BITS: Bits = Bits { nominal: ERROR_FLAG_MAX + 8 + 3, data: 0 };

/// Recessive bits that a station waits for after bus off: 128 times eleven.
pub const RECOVERY_BITS: Bits = Bits { nominal: 128 * 11, data: 0 };

/// The rates of a bus, bit/s.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitRate {
    nominal: u32,
    data: Option<u32>,
}

impl BitRate {
    /// 1 Mbit/s, the most that a classic bus has.
    pub const MAX_CLASSIC: Self = Self { nominal: 1_000_000, data: None };

    /// A classic bus; `None` for 0 and for more than 1 Mbit/s.
    #[must_use]
    pub const fn classic(nominal: u32) -> Option<Self> {
        if nominal == 0 || nominal > Self::MAX_CLASSIC.nominal {
            return None;
        }
        Some(Self { nominal, data: None })
    }

    /// A bus of FD frames, whose data may go at `data` bit/s; `None` for a nominal rate that is none of a classic bus, and
    /// for a data rate below it or above 8 Mbit/s.
    #[must_use]
    pub const fn fd(nominal: u32, data: u32) -> Option<Self> {
        match Self::classic(nominal) {
            Some(rate) if data >= nominal && data <= 8_000_000 => Some(Self { data: Some(data), ..rate }),
            _ => None,
        }
    }

    /// Rate of everything but the data of FD frames, bit/s.
    #[must_use]
    pub const fn nominal(self) -> u32 {
        self.nominal
    }

    /// Rate of the data of FD frames with bit rate switch, bit/s; `None` on a classic bus.
    #[must_use]
    pub const fn data(self) -> Option<u32> {
        self.data
    }

    /// Whether FD frames may go.
    #[must_use]
    pub const fn is_fd(self) -> bool {
        self.data.is_some()
    }

    /// How long these bits take, rounded up to a nanosecond for each rate.
    #[must_use]
    pub fn time(self, bits: Bits) -> DurationNs {
        let span = |bits: u32, rate: u32| (u64::from(bits) * 1_000_000_000).div_ceil(u64::from(rate));
        let sum = span(bits.nominal, self.nominal) + span(bits.data, self.data.unwrap_or(self.nominal));
        DurationNs(i64::try_from(sum).unwrap_or(i64::MAX))
    }
}

impl fmt::Display for BitRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = |f: &mut fmt::Formatter<'_>, rate: u32| match rate {
            _ if rate.is_multiple_of(1_000_000) => write!(f, "{} Mbit/s", rate / 1_000_000),
            _ if rate.is_multiple_of(1_000) => write!(f, "{} kbit/s", rate / 1_000),
            _ => write!(f, "{rate} bit/s"),
        };
        one(f, self.nominal)?;
        let Some(data) = self.data else { return Ok(()) };
        f.write_str(" with data at ")?;
        one(f, data)
    }
}

/// Bits on the wire at each of the two rates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Bits {
    /// At the nominal rate.
    pub nominal: u32,
    /// At the data rate of FD.
    pub data: u32,
}

impl Bits {
    /// All of them.
    #[must_use]
    pub const fn total(self) -> u32 {
        self.nominal + self.data
    }
}

impl Add for Bits {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { nominal: self.nominal + other.nominal, data: self.data + other.data }
    }
}

/// How a frame is built, whatever its data: enough for the bits it takes at most and at least.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    extended: bool,
    kind: Kind,
    data: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Classic,
    Fd { fast: bool },
}

impl Shape {
    /// The shape of a frame.
    #[must_use]
    pub fn of(frame: &Frame) -> Self {
        let kind = if frame.is_fd() { Kind::Fd { fast: frame.is_fast() } } else { Kind::Classic };
        Self { extended: matches!(frame.id(), Id::Extended(_)), kind, data: bytes(frame.data().len()) }
    }

    /// A classic data frame of `len` bytes with an identifier of 11 bits; `None` beyond 8 bytes.
    #[must_use]
    pub fn classic(len: usize) -> Option<Self> {
        Frame::new(Id::Standard(0), &[0; 64][..len.min(64)]).ok().map(|frame| Self::of(&frame))
    }

    /// An FD frame of `len` bytes with an identifier of 11 bits, its data at the data rate; `None` for a length that FD does
    /// not have.
    #[must_use]
    pub fn fd(len: usize) -> Option<Self> {
        let data = [0; 64];
        Frame::fd(Id::Standard(0), data.get(..len)?, true).ok().map(|frame| Self::of(&frame))
    }

    /// The same with an identifier of 29 bits.
    #[must_use]
    pub const fn extended(self) -> Self {
        Self { extended: true, ..self }
    }

    /// Bits with no stuff bits but the fixed ones.
    #[must_use]
    pub fn fewest(self) -> Bits {
        self.bits(Stuffing::default())
    }

    /// Bits with as many stuff bits as a frame of this shape could ever have: one behind the first five bits and one behind
    /// every further four, whatever the bits of the frame's own form are.
    #[must_use]
    pub fn most(self) -> Bits {
        let stuffing = match self.kind {
            Kind::Classic => Stuffing { head: (self.head() + self.data + CLASSIC_CRC - 1) / 4, data: 0 },
            Kind::Fd { .. } => {
                let head = (self.head() - 1) / 4;
                // None behind the last bit, where the fixed one stands.
                Stuffing { head, data: (self.head() + self.fast_part() - 2) / 4 - head }
            }
        };
        self.bits(stuffing)
    }

    /// Start of frame, identifier and control; in FD up to the bit that switches the rate.
    const fn head(self) -> u32 {
        match (self.kind, self.extended) {
            (Kind::Classic, false) => 19,
            (Kind::Classic, true) => 39,
            (Kind::Fd { .. }, false) => 17,
            (Kind::Fd { .. }, true) => 36,
        }
    }

    /// In FD: error state indicator, length code and data.
    const fn fast_part(self) -> u32 {
        1 + 4 + self.data
    }

    fn bits(self, stuffing: Stuffing) -> Bits {
        let Kind::Fd { fast } = self.kind else {
            let nominal = self.head() + self.data + CLASSIC_CRC + TAIL + stuffing.head + stuffing.data;
            return Bits { nominal, data: 0 };
        };
        let crc = if self.data <= bytes(FD_SHORT_CRC_MAX) { FD_SHORT_CRC } else { FD_LONG_CRC };
        let nominal = self.head() + TAIL + stuffing.head;
        let data = self.fast_part() + stuffing.data + crc;
        if fast { Bits { nominal, data } } else { Bits { nominal: nominal + data, data: 0 } }
    }
}

/// Bits of so many bytes of data.
fn bytes(len: usize) -> u32 {
    u32::try_from(len).map_or(u32::MAX, |len| len.saturating_mul(8))
}

/// Stuff bits before and behind the bit that switches the rate.
#[derive(Debug, Clone, Copy, Default)]
struct Stuffing {
    head: u32,
    data: u32,
}

/// The bits that this frame takes on the wire with exactly its identifier and data, intermission included.
#[must_use]
pub fn exact(frame: &Frame) -> Bits {
    let shape = Shape::of(frame);
    let mut line = Line::new(if frame.is_fd() { shape.head() } else { u32::MAX });
    head(frame, &mut line);
    for byte in frame.data() {
        line.push(u32::from(*byte), 8);
    }
    if frame.is_fd() {
        line.end_without_stuff();
    } else {
        line.push(u32::from(line.crc), CLASSIC_CRC);
    }
    shape.bits(line.stuffing)
}

/// Everything before the data.
fn head(frame: &Frame, line: &mut Line) {
    let remote = u32::from(frame.is_remote());
    line.push(0, 1);
    match frame.id() {
        Id::Standard(id) => line.push(u32::from(id), 11),
        Id::Extended(id) => {
            line.push(id >> 18, 11);
            // Substitute remote request and identifier extension are recessive.
            line.push(0b11, 2);
            line.push(id & 0x3_FFFF, 18);
        }
    }
    let code = u32::from(frame.length_code());
    if frame.is_fd() {
        // Remote request substitution; with 11 bits the identifier extension; FD format, reserved, bit rate switch.
        line.push(0, if matches!(frame.id(), Id::Standard(_)) { 2 } else { 1 });
        line.push(0b100 | u32::from(frame.is_fast()), 3);
        // A station that is error active tells so by a dominant bit.
        line.push(0, 1);
    } else {
        line.push(remote, 1);
        // Identifier extension and one reserved bit, or two reserved bits.
        line.push(0, 2);
    }
    line.push(code, 4);
}

/// No bit.
const NO_BIT: u16 = 2;

/// Counts stuff bits behind the bits that go past.
struct Line {
    stuffing: Stuffing,
    /// Bits that belong to the head, of which stuff bits are no part.
    head: u32,
    passed: u32,
    /// The last bit, [`NO_BIT`] before the first, and how many of it stand in a row.
    last: u16,
    run: u32,
    /// Over all bits so far, stuff bits left out.
    crc: u16,
    /// Whether the last bit that was passed made a stuff bit.
    stuffed: bool,
}

impl Line {
    const fn new(head: u32) -> Self {
        let stuffing = Stuffing { head: 0, data: 0 };
        Self { stuffing, head, passed: 0, last: NO_BIT, run: 0, crc: 0, stuffed: false }
    }

    /// The lowest `count` bits of `value`, highest first.
    fn push(&mut self, value: u32, count: u32) {
        for place in (0..count).rev() {
            self.bit(if value >> place & 1 == 1 { 1 } else { 0 });
        }
    }

    /// Without branches that depend on the bits, which nobody can foresee.
    fn bit(&mut self, bit: u16) {
        let feedback = (self.crc >> 14 ^ bit) & 1;
        self.crc = self.crc << 1 & 0x7FFF ^ CLASSIC_POLYNOMIAL & feedback.wrapping_neg();
        self.passed += 1;
        self.run = self.run * u32::from(self.last == bit) + 1;
        self.stuffed = self.run == RUN;
        *self.part() += u32::from(self.stuffed);
        // A stuff bit is the first of the other value.
        self.last = bit ^ u16::from(self.stuffed);
        self.run -= u32::from(self.stuffed) * (RUN - 1);
    }

    fn part(&mut self) -> &mut u32 {
        if self.passed <= self.head { &mut self.stuffing.head } else { &mut self.stuffing.data }
    }

    /// Takes back a stuff bit behind the last bit, where a fixed one stands instead.
    fn end_without_stuff(&mut self) {
        if self.stuffed {
            *self.part() -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn classic(id: u16, data: &[u8]) -> Frame {
        Frame::new(Id::Standard(id), data).unwrap()
    }

    /// Widely published: 47 + 8n + floor((33 + 8n) / 4) bits with the intermission and an identifier of 11 bits.
    #[test]
    fn the_most_bits_of_classic_frames() {
        let most = |len| Shape::classic(len).unwrap().most().total();
        assert_eq!([0, 1, 6, 8].map(most), [55, 65, 115, 135]);
        assert_eq!(Shape::classic(8).unwrap().fewest().total(), 111);
        for len in 0..=8 {
            let n = u32::try_from(len).unwrap();
            assert_eq!(most(len), 47 + 8 * n + (33 + 8 * n) / 4, "{len}");
            let extended = Shape::classic(len).unwrap().extended().most().total();
            assert_eq!(extended, 67 + 8 * n + (53 + 8 * n) / 4, "{len}");
        }
        assert_eq!(Shape::classic(8).unwrap().extended().most().total(), 160);
        assert_eq!(Shape::classic(9), None);
    }

    /// Computed from the formula with 34 nominal bits and `5 + 8n + floor((5 + 8n) / 4) + 27 or 32` data bits.
    #[test]
    fn the_most_time_of_fd_frames() {
        let time = |len, data| {
            let rate = BitRate::fd(1_000_000, data).unwrap();
            rate.time(Shape::fd(len).unwrap().most())
        };
        assert_eq!(time(8, 2_000_000), DurationNs(90_500));
        assert_eq!(time(8, 5_000_000), DurationNs(56_600));
        assert_eq!(time(8, 8_000_000), DurationNs(48_125));
        assert_eq!(time(16, 5_000_000), DurationNs(72_600));
        assert_eq!(time(64, 5_000_000), DurationNs(169_600));
        assert_eq!(Shape::fd(9), None);
        // 41 + 64 bits of 29-bit identifier, control and data: the stuff bit that would stand behind the last bit is none.
        let extended = Shape::fd(8).unwrap().extended();
        assert_eq!((extended.most().nominal, extended.most().data), (36 + 13 + 8, 5 + 64 + 17 + 27));
    }

    #[test]
    fn slow_fd_frames_take_the_nominal_rate_all_along() {
        let frame = Frame::fd(Id::Standard(0x181), &[0x55; 12], false).unwrap();
        assert_eq!(exact(&frame).data, 0);
        let fast = Frame::fd(Id::Standard(0x181), &[0x55; 12], true).unwrap();
        assert_eq!(exact(&fast).data, 5 + 96 + 27);
        assert_eq!(Shape::of(&fast).most().total(), Shape::of(&frame).most().total());
    }

    /// Counted by hand, see the lines.
    #[test]
    fn stuff_bits_are_counted_exactly() {
        // 0 000 0000 0000 0 0 0 0000 and a CRC of zeroes: 34 zeroes. The first stuff bit stands behind five zeroes, the
        // next ones behind five more each, since they are ones: 6 of them.
        assert_eq!(exact(&classic(0, &[])).total(), 47 + 6);
        // Alternating bits have none: 0 10101010101 0 0 0 1000 and data 55 ...: four zeroes at the most in a row before
        // the CRC.
        let mut line = Line::new(u32::MAX);
        head(&classic(0x555, &[0x55; 8]), &mut line);
        assert_eq!((line.passed, line.stuffing.head), (19, 0));
        // Data of ones behind the length code 1000: 1000 11111(0)11111(0)11111(0)11111(0)...: 64 ones have twelve.
        let mut line = Line::new(u32::MAX);
        head(&classic(0x555, &[0xFF; 8]), &mut line);
        for _ in 0..8 {
            line.push(0xFF, 8);
        }
        assert_eq!(line.stuffing.head, 12);
    }

    /// CRC of ISO 11898-1 (CRC-15/CAN): 059E over the ASCII text "123456789", as the catalogue of parametrised CRC
    /// algorithms has it.
    #[test]
    fn the_crc_is_that_of_can() {
        let mut line = Line::new(u32::MAX);
        for byte in b"123456789" {
            line.push(u32::from(*byte), 8);
        }
        assert_eq!(line.crc, 0x059E);
    }

    /// Bits that change behind every fourth.
    #[test]
    fn worst_case_data_need_nearly_all_the_stuff_bits_there_could_be() {
        let frame = classic(0x078, &[0x3C, 0x3C, 0x3C, 0x3C, 0x3C, 0x3C, 0x3C, 0x3C]);
        let most = Shape::of(&frame).most().total();
        assert!(exact(&frame).total() > Shape::of(&frame).fewest().total() + 14, "{:?}", exact(&frame));
        assert!(exact(&frame).total() <= most);
    }

    #[test]
    fn rates_have_limits_and_names() {
        assert_eq!(BitRate::classic(0), None);
        assert_eq!(BitRate::classic(1_000_001), None);
        assert_eq!(BitRate::fd(500_000, 499_999), None);
        assert_eq!(BitRate::fd(500_000, 8_000_001), None);
        let text = |rate: Option<BitRate>| rate.unwrap().to_string();
        assert_eq!(text(BitRate::classic(1_000_000)), "1 Mbit/s");
        assert_eq!(text(BitRate::classic(83_333)), "83333 bit/s");
        assert_eq!(text(BitRate::fd(500_000, 2_000_000)), "500 kbit/s with data at 2 Mbit/s");
        // 55 bits at a rate that is no part of a second are rounded up.
        let rate = BitRate::classic(83_333).unwrap();
        assert_eq!(rate.time(Bits { nominal: 1, data: 0 }), DurationNs(12_001));
    }

    fn any_frame() -> impl Strategy<Value = Frame> {
        let id = prop_oneof![
            (0..=Id::STANDARD_MAX).prop_map(Id::Standard),
            (0..=Id::EXTENDED_MAX).prop_map(Id::Extended)
        ];
        (id, 0..4_u8, proptest::collection::vec(any::<u8>(), 64)).prop_flat_map(|(id, kind, data)| {
            (0..=8_usize, 0..16_usize).prop_map(move |(short, long)| {
                let long = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64][long];
                match kind {
                    0 => Frame::new(id, &data[..short]),
                    1 => Frame::remote(id, short),
                    _ => Frame::fd(id, &data[..long], kind == 2),
                }
                .unwrap()
            })
        })
    }

    proptest! {
        #[test]
        fn no_frame_has_more_bits_than_its_shape_says(frame in any_frame()) {
            let (exact, shape) = (exact(&frame), Shape::of(&frame));
            prop_assert!(exact.total() >= shape.fewest().total());
            prop_assert!(exact.total() <= shape.most().total());
            prop_assert!(exact.nominal <= shape.most().nominal);
        }

        /// Frames of long runs come near the worst case.
        #[test]
        fn nor_does_one_of_long_runs(id in 0..=Id::STANDARD_MAX, shift in 0..8_u32, len in 0..=8_usize) {
            let data = [0xF0_u8.rotate_right(shift); 8];
            let frame = classic(id, &data[..len]);
            prop_assert!(exact(&frame).total() <= Shape::of(&frame).most().total());
        }
    }
}
