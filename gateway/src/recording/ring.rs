//! Frames in memory: one after the other, and as a ring of a fixed size that overwrites the oldest.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 8 | time |
//! | 8 | 1 | side |
//! | 9 | 2 | bytes of the frame |
//! | 11 | | the frame |

use std::io;

use crate::capture::recorder::Interfaces;
use crate::capture::{CAN_BUSES_MAX, FRAME_LEN_MAX, Side};
use crate::sys::clock::KernelTime;

/// Bytes in front of each frame.
const HEAD_LEN: usize = 11;

/// A frame that is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct KeptFrame<'a> {
    /// When it was seen.
    pub at: KernelTime,
    /// Where.
    pub side: Side,
    /// Its bytes.
    pub data: &'a [u8],
}

/// Bytes that a frame takes.
pub(super) fn kept_len(frame: &[u8]) -> usize {
    HEAD_LEN + frame.len().min(FRAME_LEN_MAX)
}

fn head(at: KernelTime, side: Side, len: usize) -> [u8; HEAD_LEN] {
    let mut head = [0; HEAD_LEN];
    head[..8].copy_from_slice(&at.0.to_le_bytes());
    head[8] = u8::try_from(side.index()).unwrap_or(u8::MAX);
    head[9..].copy_from_slice(&u16::try_from(len).unwrap_or(u16::MAX).to_le_bytes());
    head
}

/// Time, side and length in a head.
fn parse(head: [u8; HEAD_LEN]) -> (KernelTime, Side, usize) {
    let [a, b, c, d, e, f, g, h, side, low, high] = head;
    let side = Side::all(CAN_BUSES_MAX).nth(usize::from(side)).unwrap_or(Side::North);
    let time = KernelTime(u64::from_le_bytes([a, b, c, d, e, f, g, h]));
    (time, side, usize::from(u16::from_le_bytes([low, high])))
}

/// Appends a frame to frames.
pub(super) fn append(frames: &mut Vec<u8>, at: KernelTime, side: Side, frame: &[u8]) {
    let frame = frame.get(..FRAME_LEN_MAX).unwrap_or(frame);
    frames.extend_from_slice(&head(at, side, frame.len()));
    frames.extend_from_slice(frame);
}

/// The frames that were appended, in their order.
pub(super) fn frames(mut bytes: &[u8]) -> impl Iterator<Item = KeptFrame<'_>> {
    std::iter::from_fn(move || {
        let (head, rest) = bytes.split_first_chunk()?;
        let (at, side, len) = parse(*head);
        let (data, rest) = rest.split_at_checked(len)?;
        bytes = rest;
        Some(KeptFrame { at, side, data })
    })
}

/// The frames since a time as a pcapng file; `lost` more could not be kept.
pub(super) fn pcapng(
    bytes: &[u8],
    since: KernelTime,
    interfaces: &Interfaces,
    lost: u64,
) -> io::Result<Vec<u8>> {
    let mut writer = interfaces.writer(Vec::with_capacity(bytes.len() / 4 * 5))?;
    let (mut seen, mut last) = (0, since);
    let buses = writer.can_buses();
    let described = |side| !matches!(side, Side::Can(bus) if usize::from(bus) >= buses);
    for frame in frames(bytes).filter(|frame| since <= frame.at && described(frame.side)) {
        writer.frame(frame.side, frame.at, frame.data, None)?;
        seen += 1;
        last = last.max(frame.at);
    }
    // What was lost is not known by side: it is counted where people look first.
    writer.statistics(Side::North, last, seen + lost, lost)?;
    writer.finish()
}

/// The last frames, as many as there is room for.
#[derive(Debug)]
pub(super) struct FrameRing {
    bytes: Box<[u8]>,
    /// Where the oldest frame begins.
    start: usize,
    /// Bytes in use.
    used: usize,
}

impl FrameRing {
    /// A ring of so many bytes, which are taken from the system now.
    pub fn new(len: usize) -> Self {
        Self { bytes: vec![0; len.max(kept_len(&[0; FRAME_LEN_MAX]))].into(), start: 0, used: 0 }
    }

    /// Keeps a frame, in the place of the oldest ones.
    pub fn push(&mut self, at: KernelTime, side: Side, frame: &[u8]) {
        let frame = frame.get(..FRAME_LEN_MAX).unwrap_or(frame);
        while self.bytes.len() - self.used < kept_len(frame) {
            let (_, _, len) = parse(self.read_head());
            self.start = (self.start + HEAD_LEN + len) % self.bytes.len();
            self.used -= HEAD_LEN + len;
        }
        self.write(&head(at, side, frame.len()));
        self.write(frame);
    }

    /// All frames, one after the other.
    pub fn copy(&self) -> Vec<u8> {
        let (behind, front) = self.halves();
        [behind, front].concat()
    }

    /// The part up to the end of the memory, and the part from its beginning.
    fn halves(&self) -> (&[u8], &[u8]) {
        let first = self.used.min(self.bytes.len() - self.start);
        (&self.bytes[self.start..self.start + first], &self.bytes[..self.used - first])
    }

    fn read_head(&self) -> [u8; HEAD_LEN] {
        let (behind, front) = self.halves();
        let mut bytes = behind.iter().chain(front);
        std::array::from_fn(|_| bytes.next().copied().unwrap_or_default())
    }

    fn write(&mut self, bytes: &[u8]) {
        let at = (self.start + self.used) % self.bytes.len();
        let first = bytes.len().min(self.bytes.len() - at);
        let (behind, front) = bytes.split_at(first);
        self.bytes[at..at + first].copy_from_slice(behind);
        self.bytes[..front.len()].copy_from_slice(front);
        self.used += bytes.len();
    }
}

#[cfg(test)]
mod tests {
    use profile_sercos::port::Port;

    use super::*;
    use crate::capture::reader::Reader;

    const TWO: Side = Side::South(Port::Two);

    #[test]
    fn ring_has_the_newest_frames_whole_and_in_order_whatever_their_lengths() {
        let mut ring = FrameRing::new(4_096);
        for number in 0..1_000_u64 {
            let len = usize::try_from(number * 37 % 600).unwrap();
            let side = if number % 2 == 0 { TWO } else { Side::Can(7) };
            let byte = number.to_le_bytes()[0];
            ring.push(KernelTime(number), side, &vec![byte; len]);
            let copy = ring.copy();
            let kept: Vec<_> = frames(&copy).collect();
            let first = kept[0].at.0;
            assert_eq!(first + u64::try_from(kept.len()).unwrap(), number + 1, "nothing is missing");
            for (number, frame) in (first..).zip(&kept) {
                let len = usize::try_from(number * 37 % 600).unwrap();
                assert_eq!((frame.at.0, frame.data.len()), (number, len));
                assert_eq!(frame.side, if number % 2 == 0 { TWO } else { Side::Can(7) });
                assert!(frame.data.iter().all(|byte| *byte == number.to_le_bytes()[0]));
            }
            assert!(copy.len() <= 4_096);
            assert!(first == 0 || copy.len() > 4_096 - 2 * (HEAD_LEN + 600), "the memory is used");
        }
    }

    #[test]
    fn file_has_the_frames_since_a_time_of_the_interfaces_that_it_has() {
        let mut bytes = Vec::new();
        append(&mut bytes, KernelTime(5), Side::North, &[1; 60]);
        append(&mut bytes, KernelTime(6), Side::Can(3), &[2; 16]);
        append(&mut bytes, KernelTime(7), TWO, &[3; 2_000]);
        let file = pcapng(&bytes, KernelTime(6), &Interfaces::default(), 9).unwrap();
        let mut reader = Reader::new(&file[..]).unwrap();
        let frame = reader.next_frame().unwrap().unwrap();
        assert_eq!((frame.at, frame.interface, frame.data.len()), (Some(KernelTime(7)), 2, FRAME_LEN_MAX));
        assert!(reader.next_frame().unwrap().is_none());
        // Interface statistics: seen and lost.
        let counts = [10_u64.to_le_bytes(), 9_u64.to_le_bytes()];
        let has = |count: &[u8]| file.windows(count.len()).any(|window| window == count);
        assert!(has(&counts[0]) && has(&counts[1]), "{file:02x?}");
    }
}
