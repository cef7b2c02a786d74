//! Generic <-> SERCOS: how a drive captures positions.
//!
//! What of it goes in the telegrams is what the drive lists as configurable; the rest of a latch goes over the service
//! channel. A capture is there only if the drive has answered for every IDN that it needs.

use arrayvec::ArrayVec;
use profile_generic::capture::{CaptureEdge, CaptureKind, CaptureSource};
use profile_generic::image::Signal;
use profile_generic::program::{BitPattern, Conversion};
use profile_generic::quantity::Quantity;
use profile_sercos::wire::idn::Idn;

use super::compile::{Compiler, SercosAxis};
use super::facts::DriveFacts;
use super::tables::SercosTables;
use crate::capture_program::{
    CaptureMode, CaptureProgram, Counter, Gate, Input, Latch, Place, Sequence, Stored, WORDS_MAX,
};
use crate::dictionary::{SercosDictionary, SercosIdn};
use crate::drive_program::Telegram;
use crate::item::Item;

/// Values that a telegram of the master has room for.
const CONNECTION_IDNS_MAX: usize = profile_sercos::master::config::CONNECTION_IDNS_MAX;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CaptureBy {
    Latch { value: Idn, word: Idn, pattern: BitPattern, enable: Idn, command: Option<Idn> },
    Counter { value: Idn, counter: Idn },
    Input { word: Idn, pattern: BitPattern },
    Sequence,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct CaptureRule {
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

    /// The word of an input that is looked at in every cycle.
    pub(crate) fn input(&self) -> Option<Idn> {
        match self.by {
            CaptureBy::Input { word, .. } => Some(word),
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
pub(crate) fn idns(tables: &SercosTables) -> Vec<Idn> {
    let mut idns = Vec::new();
    for idn in tables.captures.iter().flat_map(CaptureRule::idns) {
        if !idns.contains(&idn) {
            idns.push(idn);
        }
    }
    idns
}

/// The home switch edge and the marker edge that make up a sequence.
pub(crate) fn sequence(kind: CaptureKind) -> Option<[CaptureKind; 2]> {
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
pub(crate) fn is_listed(list: Idn, idn: Idn, facts: &DriveFacts) -> bool {
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
pub(crate) fn may_be_cyclic(tables: &SercosTables, facts: &DriveFacts, idn: Idn, to_drive: bool) -> bool {
    let list = tables.configurable[usize::from(to_drive)];
    !facts.is_missing(idn) && (facts.data(list).is_none() || is_listed(list, idn, facts))
}

/// Puts what the drive allows into the telegrams.
pub(crate) fn extend(
    telegram: &mut Telegram,
    tables: &SercosTables,
    dictionary: &SercosDictionary,
    axis: &SercosAxis,
    facts: &DriveFacts,
) {
    if axis.captures != CaptureMode::Cyclic || axis.bare {
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
            let fits = idns.len() < CONNECTION_IDNS_MAX && !idns.contains(&idn.into());
            if let Some(width) = width.filter(|_| fits && is_listed(list, idn, facts)) {
                idns.push(idn.into());
                *bytes += width;
            }
        }
    }
}

/// The place of an IDN among others, at the end when it is new; `None` when it has no room.
pub(crate) fn index_of(places: &mut ArrayVec<Place, WORDS_MAX>, place: Place) -> Option<usize> {
    let known = places.iter().position(|known| known.item == place.item);
    known.or_else(|| places.try_push(place).ok().map(|()| places.len() - 1))
}

pub(crate) fn compile(compiler: &Compiler<'_>, telegram: &Telegram) -> CaptureProgram {
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
                if program.command.is_some() && program.command != command.map(Item::from) {
                    return None;
                }
                let word = index_of(&mut program.words, word)?;
                let known = program.enables.iter().position(|gate| gate.place.item == enable.item);
                let enable = match known {
                    Some(known) => known,
                    None => {
                        program.enables.try_push(Gate::whole(enable)).ok()?;
                        program.enables.len() - 1
                    }
                };
                program.latches.try_push(Latch { kind, enable, word, pattern, select: 0, value }).ok()?;
                program.command = command.map(Item::from);
            }
            CaptureBy::Counter { value, counter } => {
                let value = self.stored(value, telegram)?;
                let counter = self.place(counter, &telegram.feedback)?;
                // Only what comes in every cycle can be distinguished.
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
    pub fn place(&self, idn: Idn, telegram: &[Item]) -> Option<Place> {
        let width = self.facts.width(idn, self.dictionary)?;
        let mut offset = 0;
        let item = Item::from(idn);
        for known in telegram {
            if *known == item {
                return Some(Place { item, width, offset: Some(offset) });
            }
            offset += u16::try_from(self.facts.width(known.idn()?, self.dictionary)?.bytes()).ok()?;
        }
        Some(Place { item, width, offset: None })
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
