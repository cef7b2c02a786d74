//! What a count is, computed once by the tables and once by the formulas of the standards.

use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::idn::Idn;

use super::super::axes::short;
use super::facts::{
    CIA402_UNITS, DISPLACEMENTS, FACTORS, FEED, GEAR, INCH, METRE, SCALED_UNITS, SERCOS_UNITS, SPELLINGS,
    TURN, UNITS,
};
use super::{Reporter, is_standard, place_of};
use crate::finding::Findings;
use crate::finding::registry::{WRONG_SCALE, WRONG_SHAFT};
use crate::format::{Cia402MethodRow, RatioRow, SercosScalingRow, UnitRow};
use crate::sercos::scaling::{AxisUnits, Rated, ScalingSource};
use crate::{DriveFacts, Mapping, Reference};

/// Ratios of the tables are rounded to 64 bits; a wrong one is off by far more.
const TOLERANCE: f64 = 1e-9;

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

/// Newton metre in an inch pound of force, newton in a pound of force.
const INCH_POUND: f64 = 0.112_984_829_027_616_7;
const POUND: f64 = 4.448_221_615_260_5;

/// Generic units in a count, by the bits of the scaling type: 2-0 kind, 3 preferential or parameter, 4 unit, 5 time, 6 load.
/// `None`: no such type.
fn formula(scaling: &str, word: u32, axis: UnitKind) -> Option<f64> {
    let bit = |bit: u32| word >> bit & 1 == 1;
    if scaling == "temperature" {
        // A tenth of a degree Celsius or Fahrenheit.
        return Some(if bit(0) { 0.1 * 1e3 * 5.0 / 9.0 } else { 0.1 * 1e3 });
    }
    let linear = match word & 7 {
        0 if scaling == "torque" => return Some(0.1 * 1e4),
        1 => true,
        2 => false,
        _ => return None,
    };
    let (parameter, other_unit, seconds, load) = (bit(3), bit(4), bit(5), bit(6));
    // No source has another unit of time than that of a velocity.
    if seconds && scaling != "velocity" {
        return None;
    }
    let by_parameters = f64::from(FACTOR) * 10_f64.powi(EXPONENT);
    let preferred = |size: f64, known: bool| if parameter || !known { by_parameters } else { size };
    let length = if other_unit { INCH } else { METRE };
    let radian = TURN / std::f64::consts::TAU;
    let turns = f64::from(MOTOR_TURNS) / f64::from(LOAD_TURNS);
    let count = match scaling {
        "position" if linear => length * preferred(1e-7, !other_unit),
        "position" if other_unit => return None,
        "position" => TURN / if parameter { f64::from(RESOLUTION) } else { 3_600_000.0 },
        "velocity" if linear => {
            let per = if seconds { 1.0 } else { 60.0 };
            length / per * preferred(if other_unit { 1e-5 } else { 1e-6 }, !seconds)
        }
        "velocity" if other_unit => return None,
        "velocity" if seconds => TURN * preferred(1e-6, true),
        "velocity" => TURN / 60.0 * preferred(1e-4, true),
        "acceleration" | "jerk" if linear => length * preferred(1e-6, !other_unit),
        "acceleration" | "jerk" if other_unit => return None,
        "acceleration" | "jerk" => radian * preferred(1e-3, true),
        "torque" if linear => (if other_unit { POUND } else { 1.0 }) * 1e6 * preferred(1.0, !other_unit),
        "torque" => (if other_unit { INCH_POUND } else { 1.0 }) * 1e6 * preferred(1e-2, !other_unit),
        _ => return None,
    };
    if scaling == "torque" {
        // What the load has of torque, the motor has divided by the turns that it makes for one of the load.
        return Some(if load { count / turns } else { count } * 1e6 / f64::from(RATED));
    }
    let at_load = if load { count } else { count / turns };
    Some(match (linear, axis) {
        (false, UnitKind::Linear) => at_load * f64::from(FEED_MM),
        (true, UnitKind::Rotary) => at_load / f64::from(FEED_MM),
        _ => at_load,
    })
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

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    units(&mut reporter, &file.rows.unit);
    measures(&mut reporter, &file.rows.unit, SERCOS_UNITS);
    for row in &file.rows.unit {
        for text in &row.texts {
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
    for (rule, row) in mapping.sercos.scalings.iter().zip(&file.rows.scaling) {
        let name = row.scaling.get_ref().as_str();
        let Some((_, word, factor, exponent)) = SERCOS.iter().find(|(known, ..)| *known == name) else {
            continue;
        };
        // A gear that is turned round makes every method wrong: the cause is enough.
        if shafts(&mut reporter, row) {
            continue;
        }
        if row.word.get_ref() != word {
            let what = [
                format!("the scaling of the {name} is read from {}", row.word.get_ref()),
                format!("{word} is the scaling type of the {name}"),
                format!("write `word = \"{word}\"`"),
            ];
            reporter.report(WRONG_SCALE, ("word", row.word.span()), what);
            continue;
        }
        let mut reported = vec![false; row.methods.len()];
        let mut untaken = false;
        for (case, axis) in (0..128_u32).flat_map(|word| [(word, UnitKind::Rotary), (word, UnitKind::Linear)])
        {
            let right = formula(name, case, axis);
            let Some(at) = rule.methods.iter().position(|method| method.pattern.matches(case)) else {
                if right.is_some() && !untaken {
                    untaken = true;
                    let what = [
                        format!("no method of the {name} takes {} = {case:#04x}", row.word.get_ref()),
                        "it is a scaling type of the standard: a drive that counts so could not be used"
                            .to_owned(),
                        "add the method, or correct the `pattern` of one".to_owned(),
                    ];
                    reporter.report(WRONG_SCALE, ("scaling", row.scaling.span()), what);
                }
                continue;
            };
            let method = &row.methods[at];
            let own = facts((word, factor, exponent), case, !method.expect.is_empty());
            let source = ScalingSource {
                axis: AxisUnits { kind: axis, reference: Reference::Load, rated: rated(case) },
                facts: &own,
                dictionary: &mapping.dictionaries.sercos,
                feed: &|_| Ok(Ratio::new(FEED_MM.into(), 1).unwrap_or(Ratio::ONE)),
            };
            let given = rule.lsb(&source).map(|lsb| lsb.generic.to_f64(1));
            let off = match (&given, right) {
                (Ok(given), Some(right)) => ((given / right) - 1.0).abs() > TOLERANCE,
                (Ok(_), None) => true,
                (Err(_), _) => false,
            };
            if !off || reported[at] {
                continue;
            }
            reported[at] = true;
            let given = given.unwrap_or_default();
            let expected = match right {
                Some(right) => {
                    format!(
                        "{} = {case:#04x}: a count is {given:.6e} generic units, by the standard {right:.6e}: {} times",
                        row.word.get_ref(),
                        short(given / right)
                    )
                }
                None => format!(
                    "{} = {case:#04x} is no scaling type of the standard, and this method takes it",
                    row.word.get_ref()
                ),
            };
            let what = [
                format!("the method `{}` of the {name} does not count by the standard", method.name),
                expected,
                "correct `base`, `exponent`, `divisor` or `pattern` of the method, or `load` of the scaling"
                    .to_owned(),
            ];
            reporter.report(WRONG_SCALE, ("base", method.base.span()), what);
        }
    }
}

/// The rated torque or force that a scaling type needs.
fn rated(word: u32) -> Option<Rated> {
    let kind = if word & 7 == 1 { UnitKind::Linear } else { UnitKind::Rotary };
    Some(Rated { kind, value: RATED.into() })
}

/// Gear and feed constant of a scaling; whether one of them is wrong.
fn shafts(reporter: &mut Reporter<'_>, row: &SercosScalingRow) -> bool {
    let name = row.scaling.get_ref().as_str();
    let [motor, load] = GEAR;
    let right = if name == "torque" { [load, motor] } else { [motor, load] };
    let mut turned = false;
    if let Some(gear) = row.load.as_ref().map(|load| &load.gear) {
        let given = [gear[0].get_ref().as_str(), gear[1].get_ref().as_str()];
        let standard = given.iter().all(|idn| is_standard(idn));
        if standard && given != right {
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
            turned = true;
            reporter.report(WRONG_SHAFT, ("gear", gear[0].span()), what);
        }
    }
    let shared = matches!(name, "position" | "velocity" | "acceleration" | "jerk");
    let feed = row.feed.as_ref().map(|feed| feed.get_ref().as_str());
    let wrong =
        if shared { feed.is_none_or(|feed| is_standard(feed) && feed != FEED) } else { feed.is_some() };
    if wrong {
        let place = place_of("feed", row.feed.as_ref(), ("scaling", &row.scaling));
        let (why, help) = if shared {
            (
                format!(
                    "{FEED} is the way of the load in a turn, for position, velocity, acceleration and jerk"
                ),
                format!("write `feed = \"{FEED}\"`"),
            )
        } else {
            (format!("the {name} has no way"), "remove `feed`".to_owned())
        };
        reporter.report(
            WRONG_SHAFT,
            place,
            [format!("the feed constant of the {name} is another one"), why, help],
        );
    }
    let geared = shared || name == "torque";
    if geared && row.load.is_none() {
        let what = [
            format!("the {name} has no gear"),
            "the drive may refer to the other shaft than the axis".to_owned(),
            format!(
                "write `load = {{ pattern = [0x40, 0x40], gear = [\"{}\", \"{}\"] }}`",
                right[0], right[1]
            ),
        ];
        reporter.report(WRONG_SHAFT, ("scaling", row.scaling.span()), what);
    }
    turned || wrong || geared && row.load.is_none()
}

fn units(reporter: &mut Reporter<'_>, rows: &[UnitRow]) {
    for row in rows {
        let name = row.unit.get_ref().as_str();
        if row.reciprocal {
            // One over it are seconds, which the generic model counts in nanoseconds.
            ratio(reporter, name, &row.generic_per_unit, 1e9);
        } else if let Some((_, right)) = UNITS.iter().find(|(known, _)| *known == name) {
            ratio(reporter, name, &row.generic_per_unit, *right);
        }
    }
}

/// What each unit measures.
fn measures(reporter: &mut Reporter<'_>, rows: &[UnitRow], facts: &[(&str, &str)]) {
    for row in rows {
        let fact = facts.iter().find(|(unit, _)| unit == row.unit.get_ref());
        let Some((unit, right)) = fact.filter(|(_, right)| row.quantity.get_ref() != right) else { continue };
        let what = [
            format!("`{unit}` measures a {}", row.quantity.get_ref()),
            format!("expected `{right}`"),
            format!("write `quantity = \"{right}\"`"),
        ];
        reporter.report(WRONG_SCALE, ("quantity", row.quantity.span()), what);
    }
}

/// A ratio as a number; no number where it is none.
fn quotient(num: i64, den: i64) -> f64 {
    Ratio::new(num, den).map_or(f64::NAN, |ratio| ratio.to_f64(1))
}

fn ratio(reporter: &mut Reporter<'_>, name: &str, given: &RatioRow, right: f64) {
    let [num, den] = *given.get_ref();
    let value = quotient(num, den);
    let off = value / right;
    if (off - 1.0).abs() <= TOLERANCE {
        return;
    }
    let what = [
        format!("`{name}` has the wrong scale"),
        format!("one {name} is {right:.9e} generic units, not {value:.9e}: {} times", short(off)),
        "correct the ratio".to_owned(),
    ];
    reporter.report(WRONG_SCALE, ("generic_per_unit", given.span()), what);
}

pub(super) fn cip(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().cip_generic;
    let mut reporter = Reporter { source: &file.text, findings };
    units(&mut reporter, &file.rows.unit);
    for row in &file.rows.unit {
        let name = row.unit.get_ref().as_str();
        let given = row.times.as_ref().map(|name| name.get_ref().as_str());
        let right = SCALED_UNITS.iter().find(|(known, _)| *known == name).map(|(_, times)| *times);
        if right.is_some() {
            ratio(&mut reporter, name, &row.generic_per_unit, 1.0);
        }
        if given != right && (right.is_some() || UNITS.iter().any(|(known, _)| *known == name)) {
            let what = [
                format!("`{name}` follows another scaling of the axis"),
                format!("expected {}", right.unwrap_or("none")),
                right.map_or_else(
                    || "remove `times`".to_owned(),
                    |right| format!("write `times = \"{right}\"`"),
                ),
            ];
            reporter.report(WRONG_SCALE, ("unit", row.unit.span()), what);
        }
    }
    for row in &file.rows.displacement_unit {
        let code = row.code.get_ref();
        let end = code.rsplit(' ').next().unwrap_or_default();
        let Some((_, right)) = DISPLACEMENTS.iter().find(|(known, _)| *known == end) else { continue };
        let turns = if end.starts_with("Rev") { "rotary" } else { "linear" };
        if row.kind.get_ref() != turns {
            let what = [
                format!("`{code}` is taken for a {} unit", row.kind.get_ref()),
                format!("it is {turns}"),
                format!("write `kind = \"{turns}\"`"),
            ];
            reporter.report(WRONG_SCALE, ("kind", row.kind.span()), what);
        }
        let given = quotient(*row.nanounits.get_ref(), 1);
        if (given / right - 1.0).abs() > TOLERANCE {
            let what = [
                format!("`{code}` has the wrong scale"),
                format!("it is {right:.9e} nanounits, not {given:.9e}: {} times", short(given / right)),
                format!("write `nanounits = {right:.0}`"),
            ];
            reporter.report(WRONG_SCALE, ("nanounits", row.nanounits.span()), what);
        }
    }
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    units(&mut reporter, &file.rows.unit);
    measures(&mut reporter, &file.rows.unit, CIA402_UNITS);
    for row in &file.rows.scaling {
        let unit = row.unit.get_ref().as_str();
        for method in &row.methods {
            if let Some((base, right)) = method.base.as_ref().zip(base(unit, method)) {
                ratio(&mut reporter, &method.name, base, right);
            }
            factors(&mut reporter, &method.name, method);
        }
    }
}

/// What a method of CiA 402 counts from, in generic units.
fn base(unit: &str, method: &Cia402MethodRow) -> Option<f64> {
    if let Some((object, code)) = &method.when {
        return (object.get_ref() == "60A9:00").then(|| coded(*code)).flatten();
    }
    match unit {
        "position" => Some(TURN),
        "vl velocity" => Some(TURN / 60.0),
        "permille of rated torque" => Some(1e3),
        _ => None,
    }
}

/// A unit of velocity by its code: power of ten, numerator, denominator, each a byte from the top.
fn coded(code: i64) -> Option<f64> {
    let [_, denominator, numerator, power] = u32::try_from(code).ok()?.to_le_bytes();
    let power = i32::from(i8::from_le_bytes([power]));
    let seconds = match (numerator, denominator) {
        (0xB4, 0x47) => 60.0,
        (0xB4, 0x03) => 1.0,
        _ => return None,
    };
    Some(TURN * 10_f64.powi(power) / seconds)
}

/// The ratios of the factor group stand the right way round, and whole.
fn factors(reporter: &mut Reporter<'_>, name: &str, method: &Cia402MethodRow) {
    let has = |list: &[crate::format::Name], object: &str| list.iter().any(|name| name.get_ref() == object);
    for (times, over) in FACTORS {
        let right = has(&method.times, times) && has(&method.over, over);
        let anywhere = |object: &str| has(&method.times, object) || has(&method.over, object);
        if right && !has(&method.over, times) && !has(&method.times, over)
            || !anywhere(times) && !anywhere(over)
        {
            continue;
        }
        let place = method
            .times
            .iter()
            .chain(&method.over)
            .find(|object| [*times, *over].contains(&object.get_ref().as_str()));
        let Some(place) = place else { continue };
        let what = [
            format!("the method `{name}` has a ratio of the factor group the wrong way round"),
            format!("a count is multiplied by {times} and divided by {over}"),
            format!("write {times} in `times` and {over} in `over`"),
        ];
        reporter.report(WRONG_SHAFT, ("times", place.span()), what);
    }
}
