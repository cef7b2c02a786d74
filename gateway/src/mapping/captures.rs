//! Generic <-> SERCOS: how a drive captures positions.
//!
//! What of it goes in the telegrams is what the drive lists as configurable; the rest of a latch goes over the service
//! channel. A capture is there only if the drive has answered for every IDN that it needs.

use arrayvec::ArrayVec;
use profile_generic::capture::{CaptureEdge, CaptureKind, CaptureSet, CaptureSource};
use profile_generic::image::Signal;
use profile_generic::program::{BitPattern, Conversion, Width};
use profile_generic::quantity::Quantity;
use profile_sercos::wire::idn::Idn;

use super::compile_sercos::{Compiler, SercosAxis, Telegram};
use super::dictionary::{SercosDictionary, SercosIdn};
use super::drive_facts::DriveFacts;
use super::sercos_tables::SercosTables;

/// Latches, counters and inputs of a drive, each.
pub const CAPTURES_MAX: usize = 8;

/// IDNs that let edges through, and words that say that they have come.
pub const WORDS_MAX: usize = 4;

/// Values that a telegram of the master has room for.
const CONNECTION_IDNS_MAX: usize = profile_sercos::master::config::CONNECTION_IDNS_MAX;

/// How the drive's captures are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CaptureMode {
    /// Not at all.
    #[default]
    Off,
    /// Over the service channel: nothing more in the telegrams.
    ServiceChannel,
    /// In the telegrams, as far as the drive allows.
    Cyclic,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CaptureBy {
    Latch { value: Idn, word: Idn, pattern: BitPattern, enable: Idn, command: Option<Idn> },
    Counter { value: Idn, counter: Idn },
    Input { word: Idn, pattern: BitPattern },
    Sequence,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct CaptureRule {
    pub kind: CaptureKind,
    pub by: CaptureBy,
}

impl CaptureRule {
    fn command_idn(&self) -> Option<Idn> {
        match self.by {
            CaptureBy::Latch { enable, .. } => Some(enable),
            _ => None,
        }
    }

    /// What the drive's telegram should carry: words before values.
    fn feedback_idns(&self) -> [Option<Idn>; 2] {
        match self.by {
            CaptureBy::Latch { value, word, .. } => [Some(word), Some(value)],
            CaptureBy::Counter { value, counter } => [Some(counter), Some(value)],
            CaptureBy::Input { word, .. } => [Some(word), None],
            CaptureBy::Sequence => [None, None],
        }
    }

    fn idns(&self) -> impl Iterator<Item = Idn> {
        self.feedback_idns().into_iter().chain([self.command_idn()]).flatten()
    }
}

/// Every IDN that a capture of the tables needs, once.
pub(super) fn idns(tables: &SercosTables) -> Vec<Idn> {
    let mut idns = Vec::new();
    for idn in tables.captures.iter().flat_map(CaptureRule::idns) {
        if !idns.contains(&idn) {
            idns.push(idn);
        }
    }
    idns
}

/// The home switch edge and the marker edge that make up a sequence.
pub(super) fn sequence(kind: CaptureKind) -> Option<[CaptureKind; 2]> {
    let marker = match kind.source {
        CaptureSource::HomeSwitchMarkerPositive => CaptureEdge::Positive,
        CaptureSource::HomeSwitchMarkerNegative => CaptureEdge::Negative,
        _ => return None,
    };
    let switch = CaptureKind::new(CaptureSource::HomeSwitch, kind.edge);
    Some([switch, CaptureKind::new(CaptureSource::Marker, marker)])
}

/// The rules whose IDNs the drive has all answered for.
fn usable<'t>(tables: &'t SercosTables, facts: &'t DriveFacts) -> impl Iterator<Item = &'t CaptureRule> {
    tables.captures.iter().filter(|rule| rule.idns().all(|idn| facts.attribute(idn).is_some()))
}

/// Whether the drive lists an IDN as configurable.
pub(super) fn is_listed(list: Idn, idn: Idn, facts: &DriveFacts) -> bool {
    let wide = facts.attribute(list).is_none_or(|attribute| attribute.item_length().bytes() == 4);
    let data = facts.data(list).unwrap_or_default();
    if wide {
        data.chunks_exact(4).any(|item| item == idn.0.to_le_bytes())
    } else {
        data.chunks_exact(2).any(|item| idn.0.to_le_bytes() == [item[0], item[1], 0, 0])
    }
}

/// Whether a value that an axis can do without may stand in a telegram: the drive has it, and the list of what it takes
/// there, if it has one, names it.
pub(super) fn may_be_cyclic(tables: &SercosTables, facts: &DriveFacts, idn: Idn, to_drive: bool) -> bool {
    let list = tables.configurable[usize::from(to_drive)];
    !facts.is_missing(idn) && (facts.data(list).is_none() || is_listed(list, idn, facts))
}

/// Puts what the drive allows into the telegrams.
pub(super) fn extend(
    telegram: &mut Telegram,
    tables: &SercosTables,
    dictionary: &SercosDictionary,
    axis: &SercosAxis,
    facts: &DriveFacts,
) {
    if axis.captures != CaptureMode::Cyclic {
        return;
    }
    let [producer, consumer] = tables.configurable;
    for rule in usable(tables, facts) {
        let command = rule.command_idn().map(|idn| (idn, consumer, true));
        let feedback = rule.feedback_idns().into_iter().flatten().map(|idn| (idn, producer, false));
        for (idn, list, to_drive) in command.into_iter().chain(feedback) {
            let (idns, bytes) = if to_drive {
                (&mut telegram.command, &mut telegram.command_bytes)
            } else {
                (&mut telegram.feedback, &mut telegram.feedback_bytes)
            };
            let width = facts.width(idn, dictionary).and_then(|width| u16::try_from(width.bytes()).ok());
            let fits = idns.len() < CONNECTION_IDNS_MAX && !idns.contains(&idn);
            if let Some(width) = width.filter(|_| fits && is_listed(list, idn, facts)) {
                idns.push(idn);
                *bytes += width;
            }
        }
    }
}

/// Where a value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// IDN, for the service channel.
    pub idn: Idn,
    /// How it lies there and in the telegram.
    pub width: Width,
    /// Its place in the telegram; `None` when it is not there.
    pub offset: Option<u16>,
}

impl Place {
    /// The raw value of bytes that hold nothing else.
    #[must_use]
    pub fn decode(&self, bytes: &[u8]) -> Option<i64> {
        if bytes.len() != self.width.bytes() {
            return None;
        }
        let negative = self.width.range().0 < 0 && bytes.last().is_some_and(|byte| byte & 0x80 != 0);
        let mut wide = [if negative { 0xFF } else { 0 }; 8];
        wide.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(i64::from_le_bytes(wide))
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

    /// Writes 0 or 1 into the master's telegram.
    pub fn write_bit(&self, telegram: &mut [u8], on: bool) {
        let Some(from) = self.offset.map(usize::from) else { return };
        if let Some(place) = telegram.get_mut(from..from + self.width.bytes()) {
            place.fill(0);
            place[0] = u8::from(on);
        }
    }
}

/// A position that the drive has stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stored {
    /// Where it is.
    pub place: Place,
    to_generic: Conversion,
    to_drive: Conversion,
    modulo: i64,
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
    pub enables: ArrayVec<Place, WORDS_MAX>,
    /// What says that the edges have come.
    pub words: ArrayVec<Place, WORDS_MAX>,
    /// The procedure command that has to be in process.
    pub command: Option<Idn>,
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

/// The place of an IDN among others, at the end when it is new; `None` when it has no room.
fn index_of(places: &mut ArrayVec<Place, WORDS_MAX>, place: Place) -> Option<usize> {
    let known = places.iter().position(|known| known.idn == place.idn);
    known.or_else(|| places.try_push(place).ok().map(|()| places.len() - 1))
}

pub(super) fn compile(compiler: &Compiler<'_>, telegram: &Telegram) -> CaptureProgram {
    let mut program = CaptureProgram::default();
    if compiler.axis.captures == CaptureMode::Off {
        return program;
    }
    for rule in usable(compiler.tables, compiler.facts) {
        // A capture that does not fit, or whose unit is not known, is one that the axis does not have.
        let _ = compiler.capture(rule, telegram, &mut program);
    }
    for rule in usable(compiler.tables, compiler.facts).filter(|rule| rule.by == CaptureBy::Sequence) {
        let Some([switch, marker]) = sequence(rule.kind) else { continue };
        let switch = program.inputs.iter().position(|input| input.kind == switch);
        let marker = program.counters.iter().position(|counter| counter.kind == marker);
        if let (Some(switch), Some(marker)) = (switch, marker) {
            let _ = program.sequences.try_push(Sequence { kind: rule.kind, switch, marker });
        }
    }
    program
}

impl Compiler<'_> {
    fn capture(&self, rule: &CaptureRule, telegram: &Telegram, program: &mut CaptureProgram) -> Option<()> {
        let kind = rule.kind;
        match rule.by {
            CaptureBy::Latch { value, word, pattern, enable, command } => {
                let value = self.stored(value, telegram)?;
                let word = self.place(word, &telegram.feedback)?;
                let enable = self.place(enable, &telegram.command)?;
                if program.command.is_some() && program.command != command {
                    return None;
                }
                let word = index_of(&mut program.words, word)?;
                let enable = index_of(&mut program.enables, enable)?;
                program.latches.try_push(Latch { kind, enable, word, pattern, value }).ok()?;
                program.command = command;
            }
            CaptureBy::Counter { value, counter } => {
                let value = self.stored(value, telegram)?;
                let counter = self.place(counter, &telegram.feedback)?;
                // Only what comes in every cycle can be told apart.
                let (_, _) = (value.place.offset?, counter.offset?);
                program.counters.try_push(Counter { kind, counter, value }).ok()?;
            }
            CaptureBy::Input { word, pattern } => {
                let word = self.place(word, &telegram.feedback)?;
                word.offset?;
                program.inputs.try_push(Input { kind, word, pattern }).ok()?;
            }
            CaptureBy::Sequence => {}
        }
        Some(())
    }

    /// Where a value is, and where in the telegram.
    pub fn place(&self, idn: Idn, telegram: &[Idn]) -> Option<Place> {
        let width = self.facts.width(idn, self.dictionary)?;
        let mut offset = 0;
        for known in telegram {
            if *known == idn {
                return Some(Place { idn, width, offset: Some(offset) });
            }
            offset += u16::try_from(self.facts.width(*known, self.dictionary)?.bytes()).ok()?;
        }
        Some(Place { idn, width, offset: None })
    }

    fn stored(&self, idn: Idn, telegram: &Telegram) -> Option<Stored> {
        let place = self.place(idn, &telegram.feedback)?;
        // What nobody has described is in the unit of the position feedback, with which it is compared.
        let known = self.dictionary.idn(idn).is_some_and(SercosIdn::is_known);
        let like = if known { idn } else { self.tables.signal(Signal::PositionActual)?.idn };
        let lsb = self.unit(like, Quantity::Position).ok()?;
        let whole = 1_i64.checked_shl(place.width.bits()).filter(|_| place.width.bits() < 63)?;
        Some(Stored {
            place,
            to_generic: Conversion::new(lsb.generic),
            to_drive: Conversion::new(lsb.generic.inverse()?),
            modulo: lsb.modulo.map_or(whole, |(range, _)| range),
        })
    }
}
