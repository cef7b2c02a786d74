//! Codes, bits and states of CANopen devices with the drive profile CiA 402.

use super::cia402::Cia402Dictionary;
use super::cia402_objects::words;
use super::documents::Trust;
use crate::finding::registry as code;
use crate::finding::{Findings, Spanned};
use crate::format::{Cia402ClassRow, Cia402CodeFile, Cia402CodeRow, Cia402RangeRow, Cia402SetRow};
use crate::load::Parsed;
use crate::resolver::Resolver;

words! {
    /// What a set names.
    Cia402SetKind {
        /// Codes: one of them is the value.
        Codes = "codes",
        /// Bits, 0 first: any of them may be set.
        Bits = "bits",
        /// States: the first whose value under its mask fits.
        States = "states",
    }
}

words! {
    /// What codes without a name of their own are.
    Cia402RangeKind {
        /// A source names only what they have in common.
        Group = "group",
        /// The code is a number.
        Number = "number",
        /// Of a maker.
        Vendor = "vendor",
        /// Not to be used.
        Reserved = "reserved",
    }
}

/// One named code, bit or state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cia402Code {
    /// The code, the number of the first bit, or the value of the state under its mask.
    pub code: i64,
    /// The number of the last bit; `None` for codes and states.
    pub last: Option<u32>,
    /// What of the value counts; `None` for codes and bits.
    pub mask: Option<u32>,
    /// Its name.
    pub name: String,
    /// Modes of operation in which it means this; empty = in all.
    pub modes: Vec<&'static str>,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// Codes without a name of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cia402Range {
    /// The first of them.
    pub first: i64,
    /// The last of them.
    pub last: i64,
    /// What they are.
    pub kind: Cia402RangeKind,
    /// What they have in common.
    pub name: String,
}

/// What codes have in common, named or not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cia402Class {
    /// The first of them.
    pub first: i64,
    /// The last of them.
    pub last: i64,
    /// What they have in common.
    pub name: String,
}

/// A set of named codes, bits or states.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cia402CodeSet {
    /// Name of the set.
    pub name: String,
    /// What it names.
    pub kind: Cia402SetKind,
    /// Numbers of the objects that hold such a value.
    pub objects: Vec<u16>,
    /// What holds it beside or instead of an object, in words; mostly empty.
    pub element: String,
    /// The codes, bits or states.
    pub codes: Vec<Cia402Code>,
    /// Codes without a name of their own.
    pub ranges: Vec<Cia402Range>,
    /// What codes have in common.
    pub classes: Vec<Cia402Class>,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

impl Cia402CodeSet {
    /// The code, bit or state with this name, in a mode if it is one of some modes only.
    pub fn named(&self, name: &str) -> Option<&Cia402Code> {
        self.codes.iter().find(|code| code.name == name)
    }

    /// The name of a code or of the state that a value is in.
    pub fn name_of(&self, value: i64) -> Option<&str> {
        let fits = |code: &&Cia402Code| match (self.kind, code.mask) {
            (Cia402SetKind::Codes, _) => code.code == value,
            (Cia402SetKind::States, Some(mask)) => value & i64::from(mask) == code.code,
            _ => false,
        };
        self.codes.iter().find(fits).map(|code| code.name.as_str())
    }

    /// The closest class of a code.
    pub fn class_of(&self, code: i64) -> Option<&str> {
        let holds = |class: &&Cia402Class| (class.first..=class.last).contains(&code);
        self.classes.iter().rev().find(holds).map(|class| class.name.as_str())
    }
}

/// Reads the sets into the dictionary, which has the objects already.
pub(super) fn resolve_codes(
    file: &Parsed<Cia402CodeFile>,
    dictionary: &mut Cia402Dictionary,
    errors: &mut Findings,
) {
    let mut resolver = Resolver::new(&file.text, errors);
    let rows = &file.rows;
    resolver.head(&rows.format, "profile", &rows.profile, "cia402");
    for row in &rows.enumeration {
        if dictionary.codes(row.name.get_ref()).is_some() {
            resolver.error(code::TWICE, row.name.span(), "name", "the set is defined twice");
        }
        let set = resolve_set(row, dictionary, &mut resolver);
        dictionary.code_sets.extend(set);
    }
}

fn resolve_set(
    row: &Cia402SetRow,
    dictionary: &Cia402Dictionary,
    resolver: &mut Resolver<'_>,
) -> Option<Cia402CodeSet> {
    let kind = match &row.kind {
        Some(kind) => resolver.word("kind", kind, Cia402SetKind::NAMED)?,
        None => Cia402SetKind::Codes,
    };
    for object in &row.objects {
        if dictionary.object(*object.get_ref()).is_none() {
            let message = format!("expected an object of the dictionary, got {:#06x}", object.get_ref());
            resolver.error(code::UNKNOWN_NAME, object.span(), "objects", message);
        }
    }
    if row.objects.is_empty() && row.element.is_none() {
        let message = "expected `objects` or `element`, got neither";
        resolver.error(code::CONTRADICTION, row.name.span(), "name", message);
    }
    let types = row.objects.iter().filter_map(|index| dictionary.sub(*index.get_ref(), 0)?.data_type);
    let mut set = Cia402CodeSet {
        name: row.name.get_ref().clone(),
        kind,
        objects: row.objects.iter().map(|object| *object.get_ref()).collect(),
        element: row.element.clone().unwrap_or_default(),
        codes: Vec::with_capacity(row.codes.len()),
        ranges: Vec::with_capacity(row.ranges.len()),
        classes: Vec::with_capacity(row.classes.len()),
        trust: dictionary.documents.trust(&row.source, &row.confidence, resolver),
        note: row.note.clone().unwrap_or_default(),
    };
    let holder = Holder {
        bits: types.clone().filter_map(|held| held.bits()).min().unwrap_or(u32::BITS),
        range: types
            .filter_map(|held| held.range())
            .reduce(|one, other| (*one.start()).max(*other.start())..=(*one.end()).min(*other.end())),
    };
    for code in &row.codes {
        let resolved = resolve_code(code, &set, &holder, dictionary, resolver);
        set.codes.extend(resolved);
    }
    for range in &row.ranges {
        let resolved = resolve_range(range, &set, &holder, resolver);
        set.ranges.extend(resolved);
    }
    for class in &row.classes {
        let resolved = resolve_class(class, resolver);
        set.classes.extend(resolved);
    }
    Some(set)
}

/// What the objects of a set can hold.
struct Holder {
    bits: u32,
    range: Option<std::ops::RangeInclusive<i64>>,
}

impl Holder {
    fn fits(&self, number: &Spanned<i64>, key: &str, resolver: &mut Resolver<'_>) {
        let value = number.get_ref();
        if let Some(range) = self.range.as_ref().filter(|range| !range.contains(value)) {
            let message = format!("expected {} to {}, got {value}", range.start(), range.end());
            resolver.error(code::OUT_OF_RANGE, number.span(), key, message);
        }
    }
}

fn resolve_code(
    row: &Cia402CodeRow,
    set: &Cia402CodeSet,
    holder: &Holder,
    dictionary: &Cia402Dictionary,
    resolver: &mut Resolver<'_>,
) -> Option<Cia402Code> {
    let modes = Cia402Dictionary::modes(&row.modes, resolver);
    let last = last_bit(row, set.kind, holder, resolver)?;
    let mask = row.mask.as_ref().map(|mask| *mask.get_ref());
    let stray = (set.kind != Cia402SetKind::Bits && row.last.is_some())
        || (set.kind != Cia402SetKind::States && mask.is_some());
    if stray {
        let message = format!("`last` is of bits and `mask` of states, the set has {}", set.kind.name());
        resolver.error(code::CONTRADICTION, row.code.span(), "code", message);
    }
    let number = *row.code.get_ref();
    if set.codes.iter().any(|known| known.meets((number, last), mask, &modes)) {
        resolver.error(code::TWICE, row.code.span(), "code", "the code is defined twice");
    }
    if set.codes.iter().any(|known| known.name == *row.name.get_ref()) {
        resolver.error(code::TWICE, row.name.span(), "name", "the name is defined twice");
    }
    let own = (row.source.as_ref(), row.confidence.as_ref());
    Some(Cia402Code {
        code: number,
        last,
        mask,
        name: row.name.get_ref().clone(),
        modes,
        trust: dictionary.documents.trust_or(own, &set.trust, resolver),
        note: row.note.clone().unwrap_or_default(),
    })
}

/// The last bit of a row of bits, `Some(None)` for codes and states, `None` if the objects cannot hold what the row says.
fn last_bit(
    row: &Cia402CodeRow,
    kind: Cia402SetKind,
    holder: &Holder,
    resolver: &mut Resolver<'_>,
) -> Option<Option<u32>> {
    let number = *row.code.get_ref();
    match kind {
        Cia402SetKind::Bits => {
            let first = u32::try_from(number).unwrap_or(u32::MAX);
            let end = row.last.as_ref().map_or(first, |last| *last.get_ref());
            if first > end || end >= holder.bits {
                let message = format!("expected bits below {}, got {number} to {end}", holder.bits);
                resolver.error(code::OUT_OF_RANGE, row.code.span(), "code", message);
                return None;
            }
            Some(Some(end))
        }
        Cia402SetKind::States => {
            let outside = row.mask.as_ref().is_none_or(|mask| number & !i64::from(*mask.get_ref()) != 0);
            if outside {
                let message = "expected a `mask` that has every bit of the code";
                resolver.error(code::FIELD_VALUE, row.code.span(), "mask", message);
                return None;
            }
            Some(None)
        }
        Cia402SetKind::Codes => {
            holder.fits(&row.code, "code", resolver);
            Some(None)
        }
    }
}

impl Cia402Code {
    /// Whether a code, or bits up to `last`, means the same value in a mode of both.
    fn meets(&self, (code, last): (i64, Option<u32>), mask: Option<u32>, modes: &[&'static str]) -> bool {
        let end = |code: i64, last: Option<u32>| last.map_or(code, i64::from);
        let in_mode =
            self.modes.is_empty() || modes.is_empty() || self.modes.iter().any(|mode| modes.contains(mode));
        let overlaps = self.code <= end(code, last) && code <= end(self.code, self.last);
        in_mode && overlaps && (mask.is_none() || self.mask == mask)
    }
}

fn resolve_range(
    row: &Cia402RangeRow,
    set: &Cia402CodeSet,
    holder: &Holder,
    resolver: &mut Resolver<'_>,
) -> Option<Cia402Range> {
    let (first, last) = rising(&row.from, &row.to, resolver)?;
    holder.fits(&row.from, "from", resolver);
    holder.fits(&row.to, "to", resolver);
    let named = set.codes.iter().any(|code| (first..=last).contains(&code.code));
    let taken = set.ranges.iter().any(|other| first <= other.last && other.first <= last);
    if named || taken {
        let message = "the range takes in a code that is there already";
        resolver.error(code::OVERLAP, row.from.span(), "from", message);
    }
    let kind = resolver.word("kind", &row.kind, Cia402RangeKind::NAMED)?;
    Some(Cia402Range { first, last, kind, name: row.name.clone() })
}

fn resolve_class(row: &Cia402ClassRow, resolver: &mut Resolver<'_>) -> Option<Cia402Class> {
    let (first, last) = rising(&row.from, &row.to, resolver)?;
    Some(Cia402Class { first, last, name: row.name.get_ref().clone() })
}

fn rising(from: &Spanned<i64>, to: &Spanned<i64>, resolver: &mut Resolver<'_>) -> Option<(i64, i64)> {
    let (first, last) = (*from.get_ref(), *to.get_ref());
    if first > last {
        let message = format!("expected at most {last}, got {first}");
        resolver.error(code::OUT_OF_RANGE, from.span(), "from", message);
        return None;
    }
    Some((first, last))
}
