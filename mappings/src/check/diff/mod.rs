//! What tables say differently from others, by meaning: signs, scales, what is bound to what, states, modes, faults, what
//! happens where a drive lacks something, and what parameters of vendors are and take.
//!
//! A change that can move an axis differently is dangerous. `# accept: reason` next to its row acknowledges it. Rows of the
//! mapping tables are compared, row by row, not their order. Of the dictionaries only what a parameter of a vendor has there is
//! compared: its own row, its attribute, its IDN and its object.

mod vendor;

use std::fmt;
use std::ops::Range;

use profile_generic::ratio::Ratio;
use serde_json::{Value, json};

use crate::finding::{Source, Spanned};
use crate::format::{FieldValueRow, Name, RatioRow, UnitRow, listed};
use crate::{Mapping, TableTexts};

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

/// What `new` says differently from `old`. The texts of the new tables say why a row was taken away.
#[must_use]
pub fn changes(old: &Mapping, new: &Mapping, texts: &TableTexts) -> Changes {
    let mut list = Vec::new();
    compare(&facts(old), &facts(new), texts, &mut list);
    for family in new.families() {
        let before = old.families().iter().find(|known| known.name == family.name);
        let before = before.map_or(old, |known| &known.mapping);
        let mut own = Vec::new();
        compare(&cia402(before), &cia402(&family.mapping), texts, &mut own);
        own.retain(|change| !list.contains(change));
        for change in &mut own {
            change.row.push_str(&format!(", {}", family.name));
        }
        list.extend(own);
    }
    Changes { list }
}

fn compare(old: &[Fact<'_>], new: &[Fact<'_>], texts: &TableTexts, list: &mut Vec<Change>) {
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
        change.accepted = taken_away(fact, texts);
        list.push(change);
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
        // A new row can come before those that are there.
        dangerous: dangerous || before.is_none() && matches!(at.aspect, Aspect::State | Aspect::Fault),
        accepted: None,
    }
}

/// The reason in the row of an overlay that takes a row, or keys of it, away.
fn taken_away(fact: &Fact<'_>, texts: &TableTexts) -> Option<String> {
    // A row is identified by more than one key at times; the first one is in all of them.
    let names = [fact.id.as_str(), fact.id.split(", ").next()?, fact.id.split(' ').next()?];
    let list = format!("{}.{}", fact.table, fact.list);
    texts.overlays.iter().find_map(|overlay| {
        let source = Source::new(&overlay.path, &overlay.text);
        let heads = |at: usize| overlay.text[..at].lines().rfind(|line| line.starts_with('['));
        let of_list = |at: usize| heads(at).is_some_and(|head| head.trim_matches(['[', ']', ' ']) == list);
        names.iter().find_map(|name| {
            let named = format!("\"{name}\"");
            let mut places = overlay.text.match_indices(&named).filter(|(at, _)| of_list(*at));
            places.find_map(|(at, found)| source.accepts(&(at..at + found.len())).map(str::to_owned))
        })
    })
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
    let mut facts = cip(mapping);
    facts.extend(vendor::facts(mapping));
    facts.extend(sercos(mapping));
    facts.extend(cia402(mapping));
    facts
}

fn cip(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().cip_generic;
    let rows = &file.rows;
    let mut reader = Reader::new(&file.text, "cip-generic");
    reader.units(&rows.unit);
    for row in &rows.displacement_unit {
        let ratio = Spanned::new(row.nanounits.span(), [*row.nanounits.get_ref(), 1]);
        reader.scale(("displacement_unit", row.code.get_ref()), &ratio, 0, "");
    }
    for row in &rows.cyclic {
        reader.named(("cyclic", row.element.get_ref()), Aspect::Binding, &row.signal);
        reader.named(("cyclic", row.element.get_ref()), Aspect::Missing, &row.missing);
    }
    for row in &rows.mode {
        reader.named(("mode", row.control_mode.get_ref()), Aspect::Mode, &row.mode);
    }
    for row in &rows.request {
        let says = format!("{}, {}", text(row.request.as_ref()), row.axis_response.get_ref());
        reader.say(("request", row.axis_control.get_ref()), Aspect::State, says, row.axis_control.span());
    }
    for row in &rows.drive_action {
        let says = text(row.request.as_ref());
        reader.say(
            ("drive_action", row.drive_action.get_ref()),
            Aspect::State,
            says,
            row.drive_action.span(),
        );
    }
    for row in &rows.state {
        let says = format!("{}: {}", row.axis_state.get_ref(), listed(&row.conditions));
        reader.say(("state", row.state.get_ref()), Aspect::State, says, row.axis_state.span());
    }
    for row in &rows.fault {
        let named = [&row.exception, &row.node_fault, &row.initialization, &row.apr];
        let named = named.into_iter().flatten().next();
        let (least, default) = (text(row.least.as_ref()), text(row.default.as_ref()));
        let bit = row.manufacturer.as_ref().map(|bit| format!("manufacturer {}", bit.get_ref()));
        let says = format!("{}, least {least}, default {default}", bit.as_deref().unwrap_or(text(named)));
        reader.say(("fault", row.cause.get_ref()), Aspect::Fault, says, row.cause.span());
    }
    for row in &rows.reaction {
        let says = format!("{}, {}", row.stop.get_ref(), row.state_change.get_ref());
        reader.say(("reaction", row.reaction.get_ref()), Aspect::Fault, says, row.reaction.span());
    }
    for row in &rows.stopping {
        let says = format!("{}, holds {}, {}", row.method.get_ref(), row.holds, row.abort.get_ref());
        reader.say(
            ("stopping", row.stopping_action.get_ref()),
            Aspect::Fault,
            says,
            row.stopping_action.span(),
        );
    }
    for row in &rows.attribute {
        let id = ("attribute", row.attribute.get_ref().as_str());
        let named = [&row.parameter, &row.signal, &row.served_by];
        let named = text(named.into_iter().flatten().next());
        let value = row.value.map_or_else(String::new, |value| format!(" {value}"));
        reader.say(id, Aspect::Binding, format!("{named}{value}"), row.attribute.span());
        if let Some(missing) = &row.missing {
            reader.named(id, Aspect::Missing, missing);
        }
        reader.range(id, row.range, row.attribute.span());
    }
    reader.facts
}

fn sercos(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().generic_sercos;
    let rows = &file.rows;
    let mut reader = Reader::new(&file.text, "generic-sercos");
    reader.units(&rows.unit);
    for row in &rows.scaling {
        let name = row.scaling.get_ref();
        if let Some(load) = &row.load {
            let [motor, turns] = [0, 1].map(|at: usize| load.gear[at].get_ref());
            let says = format!("gear {motor}/{turns}, feed {}", text(row.feed.as_ref()));
            reader.say(("scaling", name), Aspect::Scale, says, load.gear[0].span());
        }
        for method in &row.methods {
            let id = format!("{name}, {}", method.name);
            let idns =
                [&method.factor_idn, &method.exponent_idn, &method.divisor_idn].map(|idn| text(idn.as_ref()));
            let divisor = method.divisor.map_or_else(String::new, |divisor| format!(" / {divisor}"));
            let more = format!(
                "{divisor}, by {}, type {:#04x}/{:#04x}",
                idns.join(" "),
                method.pattern[0],
                method.pattern[1]
            );
            let exponent = method.exponent.unwrap_or_default();
            let fact = reader.scale(("scaling", &id), &method.base, exponent, &more);
            if let Some(divisor) = method.divisor {
                let by = quotient(1, divisor);
                fact.number = fact.number.zip(by).map(|(number, by)| number * by);
            }
        }
    }
    let sign = |polarity: &crate::format::PolarityRow| {
        format!("{} bit {}", polarity.idn.get_ref(), polarity.bit.get_ref())
    };
    let direction = &rows.direction.polarity;
    reader.say(("direction", "axis"), Aspect::Sign, sign(direction), direction.bit.span());
    for row in &rows.signal {
        let id = ("signal", row.signal.get_ref().as_str());
        let polarity = row.polarity.as_ref();
        let says = polarity.map_or_else(|| "never inverted".to_owned(), sign);
        reader.say(id, Aspect::Sign, says, span(polarity.map(|polarity| &polarity.bit), &row.signal));
        reader.named(id, Aspect::Binding, &row.idn);
        reader.named(id, Aspect::Missing, &row.missing);
    }
    for row in &rows.mode {
        let id = format!(
            "{}, by the {}",
            row.mode.get_ref(),
            row.interpolation.as_ref().map_or("controller", |name| name.get_ref())
        );
        let says = format!("{}; {}; {}", listed(&row.codes), listed(&row.command), listed(&row.actual));
        reader.say(("mode", &id), Aspect::Mode, says, row.mode.span());
        reader.named(("mode", &id), Aspect::Missing, &row.missing);
    }
    for row in &rows.action {
        let says = format!(
            "{} {}, command {}",
            text(row.send.as_ref()),
            pattern(&row.pattern),
            text(row.command.as_ref())
        );
        reader.say(("action", row.action.get_ref()), Aspect::State, says, row.action.span());
    }
    for row in &rows.report {
        let id = format!(
            "{}{}{}",
            pattern(&row.pattern),
            flag("acknowledges", row.acknowledges),
            flag("procedure", row.procedure)
        );
        reader.named(("report", &id), Aspect::State, &row.report);
    }
    for row in &rows.status {
        let id = format!(
            "{}, {}{}",
            row.status.get_ref(),
            pattern(&row.pattern),
            flag("acknowledges", row.acknowledges)
        );
        reader.say(("status", &id), Aspect::State, row.word.get_ref(), row.status.span());
    }
    for row in &rows.fault {
        let id = format!("{}, {}", row.word.get_ref(), pattern(&row.pattern));
        let says = format!("{}, reaction {}", row.cause.get_ref(), text(row.reaction.as_ref()));
        reader.say(("fault", &id), Aspect::Fault, says, row.cause.span());
    }
    for row in &rows.parameter {
        parameter(&mut reader, &row.parameter, &row.idn, row.factor.as_ref());
    }
    reader.facts
}

fn parameter(reader: &mut Reader<'_>, name: &Name, place: &Name, factor: Option<&RatioRow>) {
    let id = ("parameter", name.get_ref().as_str());
    reader.named(id, Aspect::Binding, place);
    let one = Spanned::new(name.span(), [1, 1]);
    let fact = reader.scale(id, factor.unwrap_or(&one), 0, "");
    if fact.number.is_some_and(|number| number < 0.0) {
        fact.says.push_str(" (turned)");
    }
}

fn cia402(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().generic_cia402;
    let rows = &file.rows;
    let mut reader = Reader::new(&file.text, "generic-cia402");
    reader.units(&rows.unit);
    for row in &rows.scaling {
        for method in &row.methods {
            let id = format!("{}, {}", row.unit.get_ref(), method.name);
            let more = format!(
                ", times {}, over {}, like {}",
                listed(&method.times),
                listed(&method.over),
                text(method.like.as_ref())
            );
            match &method.base {
                Some(base) => reader.scale(("scaling", &id), base, 0, &more),
                None => {
                    let says = more.trim_start_matches(", ");
                    reader.say(("scaling", &id), Aspect::Scale, says, row.unit.span())
                }
            };
        }
    }
    let words = &rows.words;
    reader.named(("words", "direction"), Aspect::Sign, &words.direction);
    for (key, name) in [
        ("control", &words.control),
        ("status", &words.status),
        ("mode", &words.mode),
        ("mode_shown", &words.mode_shown),
        ("polarity", &words.polarity),
    ] {
        reader.named(("words", key), Aspect::Binding, name);
    }
    let drive = &rows.drive;
    let says = format!("acknowledges {}, voltage bit {}", drive.acknowledges, drive.voltage_bit.get_ref());
    reader.say(("drive", "usual"), Aspect::State, says, drive.voltage_bit.span());
    for row in &rows.signal {
        let modes = if row.modes.is_empty() { String::new() } else { format!(" in {}", listed(&row.modes)) };
        let id = format!("{}{modes}", row.signal.get_ref());
        let says = row.polarity.as_ref().map_or("never inverted", |name| name.get_ref());
        reader.say(("signal", &id), Aspect::Sign, says, span(row.polarity.as_ref(), &row.signal));
        reader.named(("signal", &id), Aspect::Binding, &row.object);
        reader.named(("signal", &id), Aspect::Missing, &row.missing);
    }
    for row in &rows.mode {
        let by = row.interpolation.as_ref().map_or("controller", |name| name.get_ref());
        let id = format!("{}, by the {by}, {}", row.mode.get_ref(), listed(&row.modes));
        let says = format!("{}; {}; {}", pattern(&row.control), listed(&row.command), listed(&row.actual));
        reader.say(("mode", &id), Aspect::Mode, says, row.mode.span());
        reader.named(("mode", &id), Aspect::Missing, &row.missing);
    }
    for row in &rows.action {
        let id = format!(
            "{}, in {}",
            row.action.get_ref(),
            row.when.as_ref().map_or("every state", |name| name.get_ref())
        );
        let says = format!("{} {}", text(row.send.as_ref()), pattern(&row.pattern));
        reader.say(("action", &id), Aspect::State, says, row.action.span());
    }
    for row in &rows.report {
        let modes = listed(&row.modes);
        let id = format!(
            "{} {} {modes}{}{}",
            row.state.get_ref(),
            pattern(&row.pattern),
            flag("follows", row.follows),
            flag("voltage", row.voltage)
        );
        reader.named(("report", &id), Aspect::State, &row.report);
    }
    for row in &rows.status {
        let state = row.state.as_ref().map_or("", |name| name.get_ref());
        let id = format!(
            "{}, {state} {} {}{}{}",
            row.status.get_ref(),
            pattern(&row.pattern),
            listed(&row.modes),
            flag("follows", row.follows),
            flag("voltage", row.voltage)
        );
        reader.say(("status", &id), Aspect::State, row.object.get_ref(), row.status.span());
    }
    for row in &rows.fault {
        let says = format!("{}, reaction {}", row.cause.get_ref(), text(row.reaction.as_ref()));
        for name in &row.codes {
            reader.say(("fault", name.get_ref()), Aspect::Fault, says.clone(), name.span());
        }
    }
    for row in &rows.fault_class {
        let says = format!("{}, reaction {}", row.cause.get_ref(), text(row.reaction.as_ref()));
        for name in &row.classes {
            reader.say(("fault_class", name.get_ref()), Aspect::Fault, says.clone(), name.span());
        }
    }
    for row in &rows.parameter {
        parameter(&mut reader, &row.parameter, &row.object, row.factor.as_ref());
    }
    reader.facts
}
