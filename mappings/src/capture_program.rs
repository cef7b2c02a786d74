//! The captures of one drive as a program, whatever its profile.

use arrayvec::ArrayVec;
use profile_generic::capture::{CaptureKind, CaptureSet};
use profile_generic::program::{BitPattern, Conversion, Width};

use super::item::Item;

/// Latches, counters and inputs of a drive, each.
pub const CAPTURES_MAX: usize = 8;

/// Items that let edges through, and words that say that they have come.
pub const WORDS_MAX: usize = 4;

/// How the drive's captures are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CaptureMode {
    /// Not at all.
    #[default]
    Off,
    /// Beside the cycle: nothing more in the telegrams.
    ServiceChannel,
    /// In the telegrams, as far as the drive allows.
    Cyclic,
}

/// Where a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// What it is, for an access to it beside the cycle.
    pub item: Item,
    /// How it lies there and in the telegram.
    pub width: Width,
    /// Its place in the telegram; `None` when it is not there.
    pub offset: Option<u16>,
}

impl Place {
    /// The raw value of bytes that hold nothing else.
    #[must_use]
    pub fn decode(&self, bytes: &[u8]) -> Option<i64> {
        self.width.integer(bytes)
    }

    /// The raw value in the drive's telegram.
    #[must_use]
    pub fn read(&self, telegram: &[u8]) -> Option<i64> {
        let from = usize::from(self.offset?);
        self.decode(telegram.get(from..from + self.width.bytes())?)
    }

    /// The low bits of the raw value in the drive's telegram.
    #[must_use]
    pub fn read_word(&self, telegram: &[u8]) -> Option<u32> {
        let [a, b, c, d, ..] = self.read(telegram)?.to_le_bytes();
        Some(u32::from_le_bytes([a, b, c, d]))
    }

    /// Writes these bits into the master's telegram; the others stay as they are.
    pub fn write_bits(&self, telegram: &mut [u8], bits: BitPattern) {
        let Some(word) = self.read_word(telegram) else { return };
        let from = self.offset.map_or(0, usize::from);
        let bytes = u64::from(bits.apply(word)).to_le_bytes();
        if let Some(place) = telegram.get_mut(from..from + self.width.bytes())
            && let Some(bytes) = bytes.get(..place.len())
        {
            place.copy_from_slice(bytes);
        }
    }
}

/// What lets the edges of latches through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gate {
    /// Where it is told.
    pub place: Place,
    /// The bits that belong to it.
    pub mask: u32,
    /// Those that stand while it lets edges through, beside what its latches need.
    pub on: u32,
}

impl Gate {
    /// A word of its own that is 1 or 0.
    #[must_use]
    pub const fn whole(place: Place) -> Self {
        Self { place, mask: u32::MAX, on: 1 }
    }
}

/// A position that the drive has stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stored {
    /// Where it is.
    pub place: Place,
    pub(super) to_generic: Conversion,
    pub(super) to_drive: Conversion,
    pub(super) modulo: i64,
}

impl Stored {
    /// The generic position of a raw value: of all that it may stand for, the one closest to `near`, a generic position.
    #[must_use]
    pub fn position(&self, raw: i64, near: i64) -> i64 {
        let near = self.to_drive.convert(near).value;
        let gap = raw.wrapping_sub(near).rem_euclid(self.modulo);
        let gap = if gap > self.modulo / 2 { gap - self.modulo } else { gap };
        self.to_generic.convert(near.saturating_add(gap)).value
    }
}

/// A latch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Latch {
    /// What it captures.
    pub kind: CaptureKind,
    /// Place of its enable in [`CaptureProgram::enables`].
    pub enable: usize,
    /// Place of its status word in [`CaptureProgram::words`].
    pub word: usize,
    /// What the word shows when the edge has come.
    pub pattern: BitPattern,
    /// Bits of the enable that let this edge through.
    pub select: u32,
    /// The position.
    pub value: Stored,
}

/// A counter of edges with the position of the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counter {
    /// What it captures.
    pub kind: CaptureKind,
    /// The counter.
    pub counter: Place,
    /// The position.
    pub value: Stored,
}

/// An input in the drive's telegram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Input {
    /// What it captures.
    pub kind: CaptureKind,
    /// The word.
    pub word: Place,
    /// What the word shows after the edge.
    pub pattern: BitPattern,
}

/// A marker after the home switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sequence {
    /// What it captures.
    pub kind: CaptureKind,
    /// Place of the edge of the switch in [`CaptureProgram::inputs`].
    pub switch: usize,
    /// Place of the marker in [`CaptureProgram::counters`].
    pub marker: usize,
}

/// The captures of one drive.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CaptureProgram {
    /// Latches.
    pub latches: ArrayVec<Latch, CAPTURES_MAX>,
    /// What lets the edges of the latches through.
    pub enables: ArrayVec<Gate, WORDS_MAX>,
    /// What says that the edges have come.
    pub words: ArrayVec<Place, WORDS_MAX>,
    /// The procedure command that has to be in process.
    pub command: Option<Item>,
    /// Counters.
    pub counters: ArrayVec<Counter, CAPTURES_MAX>,
    /// Inputs.
    pub inputs: ArrayVec<Input, CAPTURES_MAX>,
    /// Sequences of an input and a counter.
    pub sequences: ArrayVec<Sequence, WORDS_MAX>,
}

impl CaptureProgram {
    /// What the drive captures.
    #[must_use]
    pub fn kinds(&self) -> CaptureSet {
        let latches = self.latches.iter().map(|latch| latch.kind);
        let counters = self.counters.iter().map(|counter| counter.kind);
        let inputs = self.inputs.iter().map(|input| input.kind);
        let sequences = self.sequences.iter().map(|sequence| sequence.kind);
        latches.chain(counters).chain(inputs).chain(sequences).collect()
    }
}
