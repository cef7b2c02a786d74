//! What a count of a SERCOS drive is, by the formulas of the standard.

use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::idn::Idn;

use super::super::super::axes::short;
use super::super::facts::{FEED, GEAR, INCH, METRE, SERCOS_UNITS, SPELLINGS, TURN};
use super::super::{Reporter, is_standard, place_of};
use super::{TOLERANCE, measures, units};
use crate::dictionary::SercosDictionary;
use crate::finding::Findings;
use crate::finding::registry::{WRONG_SCALE, WRONG_SHAFT};
use crate::format::{Name, ScalingMethodRow, SercosScalingRow, UnitRow};
use crate::sercos::scaling::{AxisUnits, Rated, ScalingRule, ScalingSource};
use crate::{DriveFacts, Mapping, Reference};

/// What the test drive holds: turns of motor and load, way of a turn in mm, factor, exponent, resolution.
const MOTOR_TURNS: i32 = 7;
const LOAD_TURNS: i32 = 3;
const FEED_MM: i32 = 10;
const FACTOR: i32 = 3;
const EXPONENT: i32 = -2;
const RESOLUTION: i32 = 1_048_576;
/// What its motor gives: 2.5 Nm, or 2.5 N.
const RATED: i32 = 2_500_000;

/// The scaling parameters of a quantity: type, factor, exponent.
const SERCOS: &[(&str, &str, &str, &str)] = &[
    ("position", "S-0-0076", "S-0-0077", "S-0-0078"),
    ("velocity", "S-0-0044", "S-0-0045", "S-0-0046"),
    ("acceleration", "S-0-0160", "S-0-0161", "S-0-0162"),
    ("jerk", "S-0-0160", "S-0-0161", "S-0-0162"),
    ("torque", "S-0-0086", "S-0-0093", "S-0-0094"),
    ("temperature", "S-0-0208", "", ""),
];

/// How a position wraps: bit 7 of its scaling type, the range, and what divides the range.
const MODULO: ([u32; 2], &str, &str) = ([0x80, 0x80], "S-0-0103", "S-0-0294");
/// The resolution of rotary positions.
const TURN_COUNTS: &str = "S-0-0079";

/// Newton metre in an inch pound of force, newton in a pound of force.
const INCH_POUND: f64 = 0.112_984_829_027_616_7;
const POUND: f64 = 4.448_221_615_260_5;

/// A scaling type by its bits.
#[derive(Debug, Clone, Copy)]
struct ScalingType {
    /// Bits 2-0: 1, not 2.
    linear: bool,
    /// Bit 3: by the parameters, not preferential.
    parameter: bool,
    /// Bit 4: inch or pound, not metre or newton.
    other_unit: bool,
    /// Bit 5: per second, not per minute.
    seconds: bool,
    /// Bit 6: of the load, not of the motor.
    load: bool,
}

impl ScalingType {
    /// `None`: neither linear nor rotary.
    fn of(word: u32) -> Option<Self> {
        let linear = match word & 7 {
            1 => true,
            2 => false,
            _ => return None,
        };
        let bit = |bit: u32| word >> bit & 1 == 1;
        Some(Self { linear, parameter: bit(3), other_unit: bit(4), seconds: bit(5), load: bit(6) })
    }

    /// `size` in the preferential scaling if the standard has one for the type, else factor and exponent of the drive.
    fn preferred(self, size: f64, known: bool) -> f64 {
        if self.parameter || !known { f64::from(FACTOR) * 10_f64.powi(EXPONENT) } else { size }
    }

    fn length(self) -> f64 {
        if self.other_unit { INCH } else { METRE }
    }

    fn position(self) -> Option<f64> {
        match (self.linear, self.other_unit) {
            (true, other_unit) => Some(self.length() * self.preferred(1e-7, !other_unit)),
            (false, true) => None,
            (false, false) => Some(TURN / if self.parameter { f64::from(RESOLUTION) } else { 3_600_000.0 }),
        }
    }

    fn velocity(self) -> Option<f64> {
        match (self.linear, self.other_unit) {
            (true, other_unit) => {
                let per = if self.seconds { 1.0 } else { 60.0 };
                let size = if other_unit { 1e-5 } else { 1e-6 };
                Some(self.length() / per * self.preferred(size, !self.seconds))
            }
            (false, true) => None,
            (false, false) if self.seconds => Some(TURN * self.preferred(1e-6, true)),
            (false, false) => Some(TURN / 60.0 * self.preferred(1e-4, true)),
        }
    }

    /// Of acceleration and jerk.
    fn acceleration(self) -> Option<f64> {
        let radian = TURN / std::f64::consts::TAU;
        match (self.linear, self.other_unit) {
            (true, other_unit) => Some(self.length() * self.preferred(1e-6, !other_unit)),
            (false, true) => None,
            (false, false) => Some(radian * self.preferred(1e-3, true)),
        }
    }

    /// In generic units of the rated torque or force.
    fn torque(self) -> f64 {
        let metric = !self.other_unit;
        let (pound, size) = if self.linear { (POUND, 1.0) } else { (INCH_POUND, 1e-2) };
        let count = (if metric { 1.0 } else { pound }) * 1e6 * self.preferred(size, metric);
        // What the load has of torque, the motor has divided by the turns that it makes for one of the load.
        let at_motor = if self.load { count / turns() } else { count };
        at_motor * 1e6 / f64::from(RATED)
    }

    /// What a count of the drive is at the axis, which refers to its load.
    fn at_axis(self, count: f64, axis: UnitKind) -> f64 {
        let at_load = if self.load { count } else { count / turns() };
        match (self.linear, axis) {
            (false, UnitKind::Linear) => at_load * f64::from(FEED_MM),
            (true, UnitKind::Rotary) => at_load / f64::from(FEED_MM),
            _ => at_load,
        }
    }
}

/// Turns of the motor for one of the load.
fn turns() -> f64 {
    f64::from(MOTOR_TURNS) / f64::from(LOAD_TURNS)
}

/// Generic units in a count by the scaling type. `None`: no such type.
fn formula(scaling: &str, word: u32, axis: UnitKind) -> Option<f64> {
    match scaling {
        // A tenth of a degree Celsius or Fahrenheit.
        "temperature" => return Some(if word & 1 == 1 { 0.1 * 1e3 * 5.0 / 9.0 } else { 0.1 * 1e3 }),
        // A tenth of a per cent of the rated torque.
        "torque" if word & 7 == 0 => return Some(0.1 * 1e4),
        _ => {}
    }
    let kind = ScalingType::of(word)?;
    // No source has another unit of time than that of a velocity.
    if kind.seconds && scaling != "velocity" {
        return None;
    }
    let count = match scaling {
        "position" => kind.position()?,
        "velocity" => kind.velocity()?,
        "acceleration" | "jerk" => kind.acceleration()?,
        "torque" => return Some(kind.torque()),
        _ => return None,
    };
    Some(kind.at_axis(count, axis))
}

fn facts(words: (&str, &str, &str), word: u32, preferential: bool) -> DriveFacts {
    let mut facts = DriveFacts::new();
    let mut note = |idn: &str, value: i32| {
        if let Ok(idn) = idn.parse::<Idn>() {
            facts.note_data(idn, &value.to_le_bytes());
        }
    };
    note(words.0, word.cast_signed());
    note(GEAR[0], MOTOR_TURNS);
    note(GEAR[1], LOAD_TURNS);
    if !preferential {
        note(words.1, FACTOR);
        // An exponent has two bytes.
        if let Ok(idn) = words.2.parse::<Idn>() {
            facts.note_data(idn, &EXPONENT.to_le_bytes()[..2]);
        }
        facts.note_data(Idn::standard(79), &RESOLUTION.to_le_bytes());
    }
    facts
}

pub(in super::super) fn check(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    units(&mut reporter, &file.rows.unit);
    measures(&mut reporter, &file.rows.unit, SERCOS_UNITS);
    spellings(&mut reporter, &file.rows.unit);
    for (rule, row) in mapping.sercos.scalings.iter().zip(&file.rows.scaling) {
        let name = row.scaling.get_ref().as_str();
        let Some((name, word, factor, exponent)) = SERCOS.iter().find(|(known, ..)| *known == name) else {
            continue;
        };
        modulo(&mut reporter, row);
        for method in &row.methods {
            expected(&mut reporter, method, (factor, exponent));
        }
        // A gear that is turned round makes every method wrong: the cause is enough.
        if shafts(&mut reporter, row) || other_word(&mut reporter, row, word) {
            continue;
        }
        let scaling = Scaling {
            name,
            words: (word, factor, exponent),
            rule,
            row,
            dictionary: &mapping.dictionaries.sercos,
        };
        scaling.methods(&mut reporter);
    }
}

/// Where positions wrap, and nothing else does.
fn modulo(reporter: &mut Reporter<'_>, row: &SercosScalingRow) {
    let name = row.scaling.get_ref();
    let (pattern, range, divider) = MODULO;
    let wraps = name == "position";
    let of_vendor = |given: &Name| !is_standard(given.get_ref());
    let same = |given: &Name, right: &str| given.get_ref() == right || of_vendor(given);
    let fits = row.modulo.as_ref().map(|given| {
        let divided = given.divider.as_ref().is_some_and(|given| same(given, divider));
        given.pattern == pattern && same(&given.range, range) && (divided || of_vendor(&given.range))
    });
    if fits.unwrap_or(!wraps) && (wraps || fits.is_none()) {
        return;
    }
    let what = if wraps {
        [
            format!("the {name} wraps somewhere else than in the drive"),
            format!("bit 7 of the scaling type says that it wraps, at {range}, which {divider} divides"),
            format!(
                "write `modulo = {{ pattern = [{:#04x}, {:#04x}], range = \"{range}\", divider = \"{divider}\" }}`",
                pattern[0], pattern[1]
            ),
        ]
    } else {
        [format!("the {name} wraps"), "only positions wrap".to_owned(), "remove `modulo`".to_owned()]
    };
    let given = row.modulo.as_ref().map(|given| &given.range);
    reporter.report(WRONG_SCALE, place_of("modulo", given, ("scaling", &row.scaling)), what);
}

/// What a method that fixes its factors holds a drive to: one that shows others counts by those.
fn expected(reporter: &mut Reporter<'_>, method: &ScalingMethodRow, (factor, exponent): (&str, &str)) {
    // Neither rotary nor linear: no parameter of the drive is about it.
    if method.kind.is_none() {
        return;
    }
    let mut right: Vec<(&str, i64)> = Vec::new();
    right.extend(method.divisor.map(|divisor| (TURN_COUNTS, divisor)));
    right.extend(method.exponent.iter().flat_map(|power| [(factor, 1), (exponent, i64::from(*power))]));
    let given: Vec<(&str, i64)> =
        method.expect.iter().map(|(idn, value)| (idn.get_ref().as_str(), *value)).collect();
    if right.iter().all(|one| given.contains(one)) {
        return;
    }
    let listed: Vec<String> = right.iter().map(|(idn, value)| format!("[\"{idn}\", {value}]")).collect();
    let what = [
        format!("the method `{}` takes a drive whose parameters say something else", method.name),
        "a drive of a preferential scaling shows the factors that it counts by, and those are fixed"
            .to_owned(),
        format!("write `expect = [{}]`", listed.join(", ")),
    ];
    let place = method.expect.first().map_or(("base", method.base.span()), |(idn, _)| ("expect", idn.span()));
    reporter.report(WRONG_SCALE, place, what);
}

/// Whether each spelling of element 4 stands with its unit.
fn spellings(reporter: &mut Reporter<'_>, rows: &[UnitRow]) {
    for (row, text) in rows.iter().flat_map(|row| row.texts.iter().map(move |text| (row, text))) {
        let fact = SPELLINGS.iter().find(|(known, _)| *known == text.as_str());
        let Some((_, right)) = fact.filter(|(_, right)| row.unit.get_ref() != right) else { continue };
        let what = [
            format!("`{text}` is taken for the unit `{}`", row.unit.get_ref()),
            format!("drives write it for `{right}`"),
            format!("move the text to the row of `{right}`"),
        ];
        reporter.report(WRONG_SCALE, ("unit", row.unit.span()), what);
    }
}

/// Whether a scaling is read from another IDN than its scaling type.
fn other_word(reporter: &mut Reporter<'_>, row: &SercosScalingRow, word: &str) -> bool {
    let name = row.scaling.get_ref();
    let other = row.word.get_ref() != word;
    if other {
        let what = [
            format!("the scaling of the {name} is read from {}", row.word.get_ref()),
            format!("{word} is the scaling type of the {name}"),
            format!("write `word = \"{word}\"`"),
        ];
        reporter.report(WRONG_SCALE, ("word", row.word.span()), what);
    }
    other
}

/// A scaling of the tables, and what the standard has for it.
struct Scaling<'a> {
    name: &'static str,
    /// Type, factor, exponent.
    words: (&'static str, &'static str, &'static str),
    rule: &'a ScalingRule,
    row: &'a SercosScalingRow,
    dictionary: &'a SercosDictionary,
}

impl Scaling<'_> {
    /// Compares every scaling type on both kinds of axes, and reports each method once.
    fn methods(&self, reporter: &mut Reporter<'_>) {
        let mut reported = vec![false; self.row.methods.len()];
        let mut untaken = false;
        let cases = (0..128_u32).flat_map(|word| [(word, UnitKind::Rotary), (word, UnitKind::Linear)]);
        for (case, axis) in cases {
            let right = formula(self.name, case, axis);
            match self.rule.methods.iter().position(|method| method.pattern.matches(case)) {
                None if right.is_some() && !untaken => {
                    untaken = true;
                    self.report_untaken(reporter, case);
                }
                None => {}
                Some(at) => {
                    let given = self.given(at, case, axis).filter(|given| is_off(*given, right));
                    if let Some(given) = given.filter(|_| !reported[at]) {
                        reported[at] = true;
                        self.report_method(reporter, at, case, (given, right));
                    }
                }
            }
        }
    }

    /// What a count is by the tables; `None` where the method does not apply.
    fn given(&self, at: usize, case: u32, axis: UnitKind) -> Option<f64> {
        let facts = facts(self.words, case, !self.row.methods[at].expect.is_empty());
        let source = ScalingSource {
            axis: AxisUnits { kind: axis, reference: Reference::Load, rated: rated(case) },
            facts: &facts,
            dictionary: self.dictionary,
            feed: &|_| Ok(Ratio::new(FEED_MM.into(), 1).unwrap_or(Ratio::ONE)),
        };
        self.rule.lsb(&source).ok().map(|lsb| lsb.generic.to_f64(1))
    }

    fn report_untaken(&self, reporter: &mut Reporter<'_>, case: u32) {
        let what = [
            format!("no method of the {} takes {} = {case:#04x}", self.name, self.row.word.get_ref()),
            "it is a scaling type of the standard: a drive that counts so could not be used".to_owned(),
            "add the method, or correct the `pattern` of one".to_owned(),
        ];
        reporter.report(WRONG_SCALE, ("scaling", self.row.scaling.span()), what);
    }

    fn report_method(
        &self,
        reporter: &mut Reporter<'_>,
        at: usize,
        case: u32,
        (given, right): (f64, Option<f64>),
    ) {
        let (method, word) = (&self.row.methods[at], self.row.word.get_ref());
        let expected = match right {
            Some(right) => format!(
                "{word} = {case:#04x}: a count is {given:.6e} generic units, by the standard {right:.6e}: {} times",
                short(given / right)
            ),
            None => {
                format!("{word} = {case:#04x} is no scaling type of the standard, and this method takes it")
            }
        };
        let what = [
            format!("the method `{}` of the {} does not count by the standard", method.name, self.name),
            expected,
            "correct `base`, `exponent`, `divisor` or `pattern` of the method, or `load` of the scaling"
                .to_owned(),
        ];
        reporter.report(WRONG_SCALE, ("base", method.base.span()), what);
    }
}

/// Whether a count differs from the standard, or the standard has no such type.
fn is_off(given: f64, right: Option<f64>) -> bool {
    right.is_none_or(|right| ((given / right) - 1.0).abs() > TOLERANCE)
}

/// The rated torque or force that a scaling type needs.
fn rated(word: u32) -> Option<Rated> {
    let kind = if word & 7 == 1 { UnitKind::Linear } else { UnitKind::Rotary };
    Some(Rated { kind, value: RATED.into() })
}

/// Gear and feed constant of a scaling; whether one of them is wrong.
fn shafts(reporter: &mut Reporter<'_>, row: &SercosScalingRow) -> bool {
    let turned = turned_gear(reporter, row);
    let feed = wrong_feed(reporter, row);
    let missing = missing_gear(reporter, row);
    turned || feed || missing
}

/// Whether a quantity follows the way of the load.
fn has_way(name: &str) -> bool {
    matches!(name, "position" | "velocity" | "acceleration" | "jerk")
}

/// The gear as the standard has it for a quantity.
fn gear(name: &str) -> [&'static str; 2] {
    let [motor, load] = GEAR;
    if name == "torque" { [load, motor] } else { [motor, load] }
}

fn turned_gear(reporter: &mut Reporter<'_>, row: &SercosScalingRow) -> bool {
    let Some(given) = row.load.as_ref().map(|load| &load.gear) else { return false };
    let name = row.scaling.get_ref().as_str();
    let ([motor, load], right) = (GEAR, gear(name));
    let idns = [given[0].get_ref().as_str(), given[1].get_ref().as_str()];
    let turned = idns.iter().all(|idn| is_standard(idn)) && idns != right;
    if turned {
        let why = if name == "torque" {
            format!("a torque goes through the gear the other way than a turn: {} first", right[0])
        } else {
            format!("{motor} has the turns of the motor, {load} those of the load")
        };
        let what = [
            format!("the gear of the {name} is turned round"),
            why,
            format!("write `gear = [\"{}\", \"{}\"]`, as in the other scalings", right[0], right[1]),
        ];
        reporter.report(WRONG_SHAFT, ("gear", given[0].span()), what);
    }
    turned
}

fn wrong_feed(reporter: &mut Reporter<'_>, row: &SercosScalingRow) -> bool {
    let name = row.scaling.get_ref().as_str();
    let feed = row.feed.as_ref().map(|feed| feed.get_ref().as_str());
    let wrong = match feed {
        Some(feed) if has_way(name) => is_standard(feed) && feed != FEED,
        Some(_) => true,
        None => has_way(name),
    };
    if wrong {
        let (why, help) = if has_way(name) {
            let of = "position, velocity, acceleration and jerk";
            (
                format!("{FEED} is the way of the load in a turn, for {of}"),
                format!("write `feed = \"{FEED}\"`"),
            )
        } else {
            (format!("the {name} has no way"), "remove `feed`".to_owned())
        };
        let what = [format!("the feed constant of the {name} is another one"), why, help];
        reporter.report(WRONG_SHAFT, place_of("feed", row.feed.as_ref(), ("scaling", &row.scaling)), what);
    }
    wrong
}

fn missing_gear(reporter: &mut Reporter<'_>, row: &SercosScalingRow) -> bool {
    let name = row.scaling.get_ref().as_str();
    let missing = (has_way(name) || name == "torque") && row.load.is_none();
    if missing {
        let [first, second] = gear(name);
        let what = [
            format!("the {name} has no gear"),
            "the drive may refer to the other shaft than the axis".to_owned(),
            format!("write `load = {{ pattern = [0x40, 0x40], gear = [\"{first}\", \"{second}\"] }}`"),
        ];
        reporter.report(WRONG_SHAFT, ("scaling", row.scaling.span()), what);
    }
    missing
}
