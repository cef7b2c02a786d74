//! What tables say differently from others, by meaning: signs, scales, what is bound to what, states, modes, faults, what
//! happens where a drive lacks something, and what parameters of vendors are and take.
//!
//! A change that can move an axis differently is dangerous. `# accept: reason` next to its row acknowledges it. Rows of the
//! mapping tables are compared, row by row, not their order. Of the dictionaries only what a parameter of a vendor has there is
//! compared: its own row, its attribute, its IDN and its object.

mod cia402;
mod cip;
mod sercos;
mod vendor;

use std::fmt;
use std::ops::Range;

use profile_generic::ratio::Ratio;
use serde_json::{Value, json};

use crate::Mapping;
use crate::finding::{Source, Spanned};
use crate::format::{FieldValueRow, Name, RatioRow, UnitRow};

/// What a change is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aspect {
    /// The direction of a value.
    Sign,
    /// What a count or a unit is.
    Scale,
    /// What a value is bound to.
    Binding,
    /// What a word means, or what is written into one.
    State,
    /// What an operating mode selects, or what it carries.
    Mode,
    /// What follows from an error of a drive.
    Fault,
    /// What happens where a drive lacks a value.
    Missing,
    /// The values that a parameter takes.
    Range,
    /// When a parameter may be written.
    Access,
    /// What a parameter measures.
    Unit,
    /// How a value is held at one of its ends.
    Type,
    /// What is written into a drive, read from it or executed by it at start.
    Step,
    /// Something that no other aspect names.
    Other,
}

impl Aspect {
    /// The word for it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sign => "sign",
            Self::Scale => "scale",
            Self::Binding => "binding",
            Self::State => "state",
            Self::Mode => "mode",
            Self::Fault => "fault",
            Self::Missing => "missing",
            Self::Range => "range",
            Self::Access => "access",
            Self::Unit => "unit",
            Self::Type => "type",
            Self::Step => "step",
            Self::Other => "other",
        }
    }
}

/// Something that a row says.
#[derive(Debug, Clone)]
struct Fact<'m> {
    source: &'m Source,
    table: &'static str,
    list: &'static str,
    /// What identifies the row in its list.
    id: String,
    aspect: Aspect,
    says: String,
    number: Option<f64>,
    /// What it allows, from the least to the most: values, or how much access.
    reach: Option<(i64, i64)>,
    span: Range<usize>,
}

/// Something that two sets of tables say differently.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// What it is about.
    pub aspect: Aspect,
    /// The table.
    pub table: &'static str,
    /// The list and what identifies the row.
    pub row: String,
    /// Before; `None` where the row is new.
    pub before: Option<String>,
    /// After; `None` where the row is gone.
    pub after: Option<String>,
    /// How many times larger a value is afterwards, of a scale.
    pub factor: Option<f64>,
    /// File and line of the row.
    pub place: (String, usize),
    /// Whether it can move an axis differently.
    pub dangerous: bool,
    /// The reason for which it is acknowledged.
    pub accepted: Option<String>,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = match (self.dangerous, &self.accepted) {
            (true, None) => "DANGEROUS",
            (true, Some(_)) => "accepted",
            (false, _) => "change",
        };
        let word = |side: &Option<String>| side.clone().unwrap_or_else(|| "(no row)".to_owned());
        let (file, line) = &self.place;
        writeln!(f, "{mark:9} {:8} {} {}", self.aspect.name(), self.table, self.row)?;
        write!(f, "          {} -> {}", word(&self.before), word(&self.after))?;
        if let Some(factor) = self.factor {
            write!(f, " ({} times)", crate::check::axes::short(factor))?;
        }
        write!(f, "\n          {file}:{line}")?;
        match &self.accepted {
            Some(reason) => write!(f, ": {reason}"),
            None => Ok(()),
        }
    }
}

/// Everything that is said differently.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct Changes {
    /// By table, in the order of the rows.
    pub list: Vec<Change>,
}

impl Changes {
    /// The dangerous ones.
    #[must_use]
    pub fn dangerous(&self) -> usize {
        self.list.iter().filter(|change| change.dangerous).count()
    }

    /// Those of them that are not acknowledged.
    #[must_use]
    pub fn open(&self) -> usize {
        self.list.iter().filter(|change| change.dangerous && change.accepted.is_none()).count()
    }

    /// The same for programs. Keys are added, never changed.
    #[must_use]
    pub fn json(&self) -> Value {
        let change = |change: &Change| {
            json!({
                "aspect": change.aspect.name(),
                "table": change.table,
                "row": change.row,
                "before": change.before,
                "after": change.after,
                "factor": change.factor,
                "file": change.place.0,
                "line": change.place.1,
                "dangerous": change.dangerous,
                "accepted": change.accepted,
            })
        };
        json!({
            "format": 1,
            "changes": self.list.len(),
            "dangerous": self.dangerous(),
            "not_acknowledged": self.open(),
            "list": self.list.iter().map(change).collect::<Vec<_>>(),
        })
    }
}

impl fmt::Display for Changes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for change in &self.list {
            writeln!(f, "{change}\n")?;
        }
        let (count, dangerous) = (self.list.len(), self.dangerous());
        writeln!(f, "{count} changes, {dangerous} dangerous, {} not acknowledged", self.open())
    }
}

/// What `new` says differently from `old`.
#[must_use]
pub fn changes(old: &Mapping, new: &Mapping) -> Changes {
    let mut list = Vec::new();
    compare(&facts(old), &facts(new), new, &mut list);
    for family in new.families() {
        let before = old.families().iter().find(|known| known.name == family.name);
        let before = before.map_or(old, |known| &known.mapping);
        let mut own = Vec::new();
        compare(&cia402::facts(before), &cia402::facts(&family.mapping), &family.mapping, &mut own);
        own.retain(|change| !list.contains(change));
        for change in &mut own {
            change.row.push_str(&format!(", {}", family.name));
        }
        list.extend(own);
    }
    // No key should be left out above. One that is must not look like no change.
    if list.is_empty() && old.meaning() != new.meaning() {
        list.push(unnamed(new));
    }
    Changes { list }
}

/// A change of which no row is known.
fn unnamed(new: &Mapping) -> Change {
    Change {
        aspect: Aspect::Other,
        table: "all",
        row: "tables".to_owned(),
        before: Some("one meaning".to_owned()),
        after: Some("another meaning, by rows that are not compared".to_owned()),
        factor: None,
        place: (new.tables().cip_generic.text.path().to_owned(), 1),
        dangerous: true,
        accepted: None,
    }
}

/// The text of a table, with what is laid over it.
fn source<'m>(mapping: &'m Mapping, table: &str) -> Option<&'m Source> {
    let tables = mapping.tables();
    let sources = [
        ("cip-generic", &tables.cip_generic.text),
        ("generic-sercos", &tables.generic_sercos.text),
        ("generic-cia402", &tables.generic_cia402.text),
        ("generic", &tables.generic.text),
        ("cip-attributes", &tables.cip_attributes.text),
        ("sercos-idns", &tables.sercos_idns.text),
        ("cia402-objects", &tables.cia402_objects.text),
    ];
    sources.into_iter().find(|(name, _)| *name == table).map(|(_, source)| &**source)
}

fn compare(old: &[Fact<'_>], new: &[Fact<'_>], mapping: &Mapping, list: &mut Vec<Change>) {
    let same = |one: &Fact<'_>, other: &Fact<'_>| {
        (one.table, one.list, &one.id, one.aspect) == (other.table, other.list, &other.id, other.aspect)
    };
    for fact in new {
        let before = old.iter().find(|known| same(known, fact));
        if before.is_some_and(|before| before.says == fact.says) {
            continue;
        }
        let mut change = change(fact, before, Some(fact));
        change.accepted = fact.source.accepts(&fact.span).map(str::to_owned);
        list.push(change);
    }
    for fact in old.iter().filter(|fact| !new.iter().any(|known| same(known, fact))) {
        let mut change = change(fact, Some(fact), None);
        let taken = source(mapping, fact.table).and_then(|new| new.accepts_loss(fact.source, &fact.span));
        change.accepted = taken.map(str::to_owned);
        list.push(change);
    }
}

/// Whether a new row comes before rows that are there, or beside them into the drive.
fn wins(new: &Fact<'_>) -> bool {
    match new.aspect {
        Aspect::State | Aspect::Fault | Aspect::Step => true,
        Aspect::Scale => new.list == "scaling",
        Aspect::Mode => new.table == "generic-cia402",
        // A row for some modes of operation wins over the one for all others.
        Aspect::Sign | Aspect::Binding => new.list == "signal" && new.id.contains(" in "),
        _ => false,
    }
}

fn change(at: &Fact<'_>, before: Option<&Fact<'_>>, after: Option<&Fact<'_>>) -> Change {
    let (file, line, _) = at.source.place(at.span.start);
    let numbers = before.and_then(|fact| fact.number).zip(after.and_then(|fact| fact.number));
    let says = |fact: Option<&Fact<'_>>| fact.map(|fact| fact.says.clone());
    // What a drive lacks is only dangerous where an axis would now go without it.
    let dangerous = match at.aspect {
        Aspect::Missing => before.is_some_and(|fact| fact.says == "refuse"),
        // To allow less harms nobody, and a parameter that is gone is told by what was bound to it.
        Aspect::Range | Aspect::Access => {
            let reaches = before.and_then(|fact| fact.reach).zip(after.and_then(|fact| fact.reach));
            reaches.is_some_and(|(before, after)| after.0 < before.0 || after.1 > before.1)
        }
        _ => before.is_some(),
    };
    Change {
        aspect: at.aspect,
        table: at.table,
        row: format!("[[{}]] {}", at.list, at.id),
        before: says(before),
        after: says(after),
        factor: numbers.map(|(before, after)| after / before).filter(|factor| *factor != 1.0),
        place: (file.to_owned(), line),
        dangerous: dangerous || before.is_none() && wins(at),
        accepted: None,
    }
}

struct Reader<'m> {
    source: &'m Source,
    table: &'static str,
    facts: Vec<Fact<'m>>,
}

impl<'m> Reader<'m> {
    const fn new(source: &'m Source, table: &'static str) -> Self {
        Self { source, table, facts: Vec::new() }
    }

    fn say(
        &mut self,
        (list, id): (&'static str, &str),
        aspect: Aspect,
        says: impl Into<String>,
        span: Range<usize>,
    ) -> &mut Fact<'m> {
        let (source, table, id) = (self.source, self.table, id.to_owned());
        let fact =
            Fact { source, table, list, id, aspect, says: says.into(), number: None, reach: None, span };
        let place = self.facts.len();
        self.facts.push(fact);
        &mut self.facts[place]
    }

    /// What a single word says.
    fn named(&mut self, row: (&'static str, &str), aspect: Aspect, name: &Name) {
        self.say(row, aspect, name.get_ref(), name.span());
    }

    /// Least and greatest value that may be set.
    fn range(&mut self, row: (&'static str, &str), range: Option<[i64; 2]>, span: Range<usize>) {
        let says = range.map_or_else(|| "any value".to_owned(), |[low, high]| format!("{low} to {high}"));
        let [low, high] = range.unwrap_or([i64::MIN, i64::MAX]);
        self.say(row, Aspect::Range, says, span).reach = Some((low, high));
    }

    fn scale(
        &mut self,
        row: (&'static str, &str),
        ratio: &RatioRow,
        exponent: i32,
        more: &str,
    ) -> &mut Fact<'m> {
        let [num, den] = *ratio.get_ref();
        let power = if exponent == 0 { String::new() } else { format!(" * 10^{exponent}") };
        let fact = self.say(row, Aspect::Scale, format!("{num}/{den}{power}{more}"), ratio.span());
        fact.number = quotient(num, den).map(|number| number * 10_f64.powi(exponent));
        fact
    }

    fn units(&mut self, rows: &[UnitRow]) {
        for row in rows {
            let id = format!("{} ({})", row.unit.get_ref(), row.quantity.get_ref());
            self.scale(("unit", &id), &row.generic_per_unit, 0, "");
            let over = if row.reciprocal { "one over it" } else { "itself" };
            let says =
                format!("{over}, times {}, spelt {}", text(row.times.as_ref()), row.texts.join(" or "));
            self.say(("unit", &id), Aspect::Unit, says, row.unit.span());
        }
    }
}

fn quotient(num: i64, den: i64) -> Option<f64> {
    Ratio::new(num, den).map(|ratio| ratio.to_f64(1))
}

fn text(name: Option<&Name>) -> &str {
    name.map_or("none", |name| name.get_ref())
}

fn pattern(fields: &[FieldValueRow]) -> String {
    fields.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and ")
}

fn span<T>(value: Option<&Spanned<T>>, row: &Name) -> Range<usize> {
    value.map_or_else(|| row.span(), Spanned::span)
}

fn flag(name: &str, value: Option<bool>) -> String {
    value.map_or_else(String::new, |value| format!(", {name} = {value}"))
}

fn facts(mapping: &Mapping) -> Vec<Fact<'_>> {
    let mut facts = cip::facts(mapping);
    facts.extend(vendor::facts(mapping));
    facts.extend(sercos::facts(mapping));
    facts.extend(cia402::facts(mapping));
    facts
}

/// A parameter of a drive: its place, its scale, and what else the row says of it.
fn parameter(
    reader: &mut Reader<'_>,
    name: &Name,
    place: &Name,
    factor: Option<&RatioRow>,
    (direction, missing): (&Name, Option<&Name>),
) {
    let id = ("parameter", name.get_ref().as_str());
    reader.named(id, Aspect::Binding, place);
    let one = Spanned::new(name.span(), [1, 1]);
    let fact = reader.scale(id, factor.unwrap_or(&one), 0, "");
    if fact.number.is_some_and(|number| number < 0.0) {
        fact.says.push_str(" (turned)");
    }
    reader.named(("parameter", &format!("{}, direction", id.1)), Aspect::Binding, direction);
    // `reject` is what happens without the key.
    let says = missing.map_or("reject", |missing| missing.get_ref());
    reader.say(id, Aspect::Missing, says, span(missing, name));
}

/// What the row has under a key; nothing without the key.
fn said(name: &str, value: Option<&Name>) -> String {
    value.map_or_else(String::new, |value| format!(", {name} {}", value.get_ref()))
}
