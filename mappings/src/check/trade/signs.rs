//! Every value that a drive can invert is inverted back by the same bit, in both directions.

use super::facts::{
    CIA402_PARAMETER_SIGNS, CIA402_POSITION, CIA402_SIGNS, MAGNITUDES, SERCOS_DIRECTION, SERCOS_SIGNS,
    SercosSign,
};
use super::{Reporter, is_standard, place_of};
use crate::Mapping;
use crate::finding::Findings;
use crate::finding::registry::WRONG_SIGN;
use crate::format::{Name, PolarityRow, RatioRow};

pub(super) fn sercos(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_sercos;
    let mut reporter = Reporter { source: &file.text, findings };
    let direction = &file.rows.direction.polarity;
    if is_standard(direction.idn.get_ref()) && !is(direction, SERCOS_DIRECTION) {
        let (idn, bit) = SERCOS_DIRECTION;
        let what = [
            "the direction of the axis is not that of its actual position".to_owned(),
            format!("expected bit {bit} of {idn}, which inverts position feedback 1"),
            format!("write `polarity = {{ idn = \"{idn}\", bit = {bit} }}`"),
        ];
        reporter.report(WRONG_SIGN, ("polarity", direction.bit.span()), what);
    }
    for row in &file.rows.signal {
        let name = &row.signal;
        polarity(&mut reporter, name, ("signal", name), &row.idn, row.polarity.as_ref());
        if let Some(load) = &row.load {
            polarity(&mut reporter, name, ("load", &load.idn), &load.idn, load.polarity.as_ref());
        }
    }
    for row in &file.rows.parameter {
        magnitude(&mut reporter, &row.parameter, &row.idn, row.factor.as_ref());
    }
}

/// The polarity of a signal by one of the encoders. `missing` is where one that is not there is reported.
fn polarity(
    reporter: &mut Reporter<'_>,
    signal: &Name,
    missing: (&str, &Name),
    idn: &Name,
    given: Option<&PolarityRow>,
) {
    let (signal, idn) = (signal.get_ref(), idn.get_ref());
    let Some(SercosSign { polarity, bit, .. }) = SERCOS_SIGNS.iter().find(|sign| sign.idn == idn) else {
        return;
    };
    let help = format!("write `polarity = {{ idn = \"{polarity}\", bit = {bit} }}`");
    match given {
        None => {
            let what = [
                format!("`{signal}` has no polarity"),
                format!(
                    "bit {bit} of {polarity} inverts {idn} in the drive: a drive that has it set would turn the other way"
                ),
                help,
            ];
            reporter.report(WRONG_SIGN, (missing.0, missing.1.span()), what);
        }
        Some(given) if is_standard(given.idn.get_ref()) && !is(given, (polarity, *bit)) => {
            let what = [
                format!("`{signal}` has the polarity of another value"),
                format!(
                    "bit {bit} of {polarity} inverts {idn}, not bit {} of {}",
                    given.bit.get_ref(),
                    given.idn.get_ref()
                ),
                help,
            ];
            reporter.report(WRONG_SIGN, ("polarity", given.bit.span()), what);
        }
        Some(_) => {}
    }
}

fn is(given: &PolarityRow, (idn, bit): (&str, u32)) -> bool {
    given.idn.get_ref() == idn && *given.bit.get_ref() == bit
}

pub(super) fn cia402(mapping: &Mapping, findings: &mut Findings) {
    let file = &mapping.tables().generic_cia402;
    let mut reporter = Reporter { source: &file.text, findings };
    let direction = &file.rows.words.direction;
    if direction.get_ref() != CIA402_POSITION {
        let what = [
            "the direction of the axis is not that of its position".to_owned(),
            format!("expected `{CIA402_POSITION}`, bit 7 of 607Eh"),
            format!("write `direction = \"{CIA402_POSITION}\"`"),
        ];
        reporter.report(WRONG_SIGN, ("direction", direction.span()), what);
    }
    for row in &file.rows.signal {
        let object = row.object.get_ref();
        let Some((_, expected)) = CIA402_SIGNS.iter().find(|(known, _)| known == object) else { continue };
        let given = row.polarity.as_ref().map(|name| name.get_ref().as_str());
        if given == *expected {
            continue;
        }
        let signal = row.signal.get_ref();
        let (expected, help) = match expected {
            Some(field) => (
                format!(
                    "`{field}` of 607Eh inverts {object}: a drive that has it set would turn the other way"
                ),
                format!("write `polarity = \"{field}\"`"),
            ),
            None => (
                format!("607Eh inverts no torque, so {object} is never inverted"),
                "remove `polarity`".to_owned(),
            ),
        };
        let place = place_of("polarity", row.polarity.as_ref(), ("signal", &row.signal));
        reporter.report(
            WRONG_SIGN,
            place,
            [format!("`{signal}` does not follow the polarity of the drive"), expected, help],
        );
    }
    for row in &file.rows.parameter {
        magnitude(&mut reporter, &row.parameter, &row.object, row.factor.as_ref());
        let object = row.object.get_ref();
        let fact = CIA402_PARAMETER_SIGNS.iter().find(|(known, _)| known == object);
        let given = row.polarity.as_ref().map(|name| name.get_ref().as_str());
        if let Some((_, expected)) = fact.filter(|(_, expected)| given != Some(*expected)) {
            let what = [
                format!("`{}` does not follow the polarity of the drive", row.parameter.get_ref()),
                format!("expected `{expected}`: so is {object} inverted by 607Eh, or not"),
                format!("write `polarity = \"{expected}\"`"),
            ];
            let place = place_of("polarity", row.polarity.as_ref(), ("parameter", &row.parameter));
            reporter.report(WRONG_SIGN, place, what);
        }
    }
}

/// A factor turns a value that the drive holds as a magnitude, and no other one, and never scales.
fn magnitude(reporter: &mut Reporter<'_>, parameter: &Name, place: &Name, factor: Option<&RatioRow>) {
    let place_name = place.get_ref().as_str();
    let standard = is_standard(place_name);
    let given = factor.map_or([1, 1], |factor| *factor.get_ref());
    let turned =
        MAGNITUDES.iter().any(|(name, places)| *name == parameter.get_ref() && places.contains(&place_name));
    let wanted = if turned { -1 } else { 1 };
    if !standard || given == [wanted, 1] {
        return;
    }
    let name = parameter.get_ref();
    let (why, help) = if turned {
        (
            format!("{place_name} is a magnitude, and the generic value is below zero"),
            "write `factor = [-1, 1]`",
        )
    } else {
        (format!("{place_name} has the sign and the scale of the generic value"), "remove `factor`")
    };
    let place = place_of("factor", factor, ("parameter", parameter));
    reporter.report(WRONG_SIGN, place, [format!("`{name}` has the wrong factor"), why, help.to_owned()]);
}
