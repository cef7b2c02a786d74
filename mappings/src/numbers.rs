//! What a row can hold from one end to the other: range and precision, by types and scalings of both.
//!
//! Everything is found out with the conversions that the cycle uses, so that nothing can be true here and wrong there.

use profile_generic::image::Signal;
use profile_generic::program::{Conversion, Width};
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;

use super::attributes::Backing;
use super::sercos::commissioning::Step;
use super::{CipScaling, DriveFacts, DriveProgram, Item, Mapping, SercosAxis, SercosError};

/// Whole numbers that a single and a double can tell apart.
const SINGLE: i64 = 1 << 24;
const DOUBLE: i64 = 1 << 53;

/// How far is looked for the first value that does not come back.
const TRIED: i64 = 1_000;

/// A whole number of the controller that does not come back from the drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LostPrecision {
    /// The first of them.
    pub value: i64,
    /// What comes back of it.
    pub back: i64,
    /// The most that any of them is off, in units of the controller.
    pub most: f64,
}

/// What a signal or a parameter can hold.
#[derive(Debug, Clone, PartialEq)]
pub struct RowNumbers {
    /// Name of the signal or parameter.
    pub name: String,
    /// Whether it is a signal.
    pub is_signal: bool,
    /// Where the drive has it.
    pub item: Item,
    /// The controller's unit, as the standard names it.
    pub unit: String,
    /// What the drive can hold, in the controller's unit; `None` where it wraps.
    pub range: Option<(f64, f64)>,
    /// The same in generic units.
    pub generic_range: Option<(i64, i64)>,
    /// One count of the drive, in the controller's unit.
    pub step: f64,
    /// Whether the controller's value is a whole number.
    pub is_whole: bool,
    /// Up to this value a floating point number distinguishes every count of the drive.
    pub float_exact: Option<f64>,
    /// The first whole number that does not come back.
    pub lost: Option<LostPrecision>,
}

/// The drive's end of a row.
struct South {
    item: Item,
    width: Width,
    /// To counts.
    outward: Conversion,
    /// From counts.
    inward: Conversion,
    wraps: bool,
}

/// The controller's end of a row.
struct North {
    unit: String,
    /// Generic units in one of the controller's.
    ratio: Ratio,
    is_whole: bool,
    mantissa: i64,
}

impl Mapping {
    /// What a drive holds that has every mode, has taken every value that commissioning writes in CP2, and shows no polarity.
    ///
    /// # Errors
    /// As [`Mapping::commissioning`].
    pub fn facts_of_obedient(&self, axis: &SercosAxis) -> Result<DriveFacts, SercosError> {
        let mut facts = DriveFacts::new();
        let codes = self.sercos.modes.iter().flat_map(|rule| rule.codes.iter().chain(&rule.load_codes));
        let listed: Vec<u8> = codes.flat_map(|code| code.to_le_bytes()).collect();
        facts.note_data(self.sercos.supported_modes, &listed);
        let plan = self.commissioning(axis, 2, &facts)?;
        for idn in self.sercos.polarity_idns() {
            facts.note_data(idn, &[0, 0]);
        }
        for step in plan.steps {
            if let Step::Write { idn, candidates, .. } = step
                && let Some(first) = candidates.first()
            {
                facts.note_data(idn, first);
            }
        }
        Ok(facts)
    }

    /// What every signal and parameter can hold that has a row on both sides, on an axis with this scaling and this program.
    pub fn row_numbers(&self, scaling: &CipScaling, program: &DriveProgram) -> Vec<RowNumbers> {
        let mut numbers = Vec::new();
        for (field, item) in program.command_fields().chain(program.feedback_fields()) {
            let Some(north) = self.north_of_signal(field.signal, scaling) else { continue };
            let is_command = field.signal.is_command();
            let Some(back) = field.conversion.inverse() else { continue };
            let (outward, inward) =
                if is_command { (field.conversion, back) } else { (back, field.conversion) };
            let south = South {
                item,
                width: field.width,
                outward,
                inward,
                wraps: is_command && field.modulo.is_some(),
            };
            numbers.extend(end_to_end(field.signal.name(), true, &north, &south));
        }
        let Some(table) = self.attribute_table(scaling) else { return numbers };
        for entry in table.entries() {
            // The step of a reciprocal differs from value to value.
            let Backing::Parameter { parameter, to_generic, reciprocal: false, feedback: None, .. } =
                entry.backing
            else {
                continue;
            };
            let Some(row) = program.parameter(parameter) else { continue };
            // A floating point number in the drive has neither counts nor ends that matter.
            if row.width.is_float() {
                continue;
            }
            let (outward, inward) = match (row.to_drive, row.from_drive) {
                (Some(outward), Some(inward)) => (outward, inward),
                (Some(outward), None) => (outward, outward.inverse().unwrap_or(outward)),
                (None, Some(inward)) => (inward.inverse().unwrap_or(inward), inward),
                (None, None) => continue,
            };
            let attribute = self.dictionaries.cip.attribute_by_id(entry.id);
            let (Some(attribute), Some(width)) = (attribute, entry.data_type.width()) else { continue };
            let north = North {
                unit: attribute.unit.clone(),
                ratio: to_generic.ratio,
                is_whole: !width.is_float(),
                mantissa: if width == Width::F32 { SINGLE } else { DOUBLE },
            };
            let south = South { item: row.item, width: row.width, outward, inward, wraps: false };
            let name = self.dictionaries.generic.by_number(parameter).map_or("", |row| &row.name);
            numbers.extend(end_to_end(name, false, &north, &south));
        }
        numbers.sort_by(|one, two| {
            (!one.is_signal, one.item, &one.name).cmp(&(!two.is_signal, two.item, &two.name))
        });
        numbers.dedup();
        numbers
    }

    fn north_of_signal(&self, signal: Signal, scaling: &CipScaling) -> Option<North> {
        let element = self.cip.cyclic.iter().find(|element| element.signal == signal)?;
        let ratio = scaling.convert(element.unit, false)?;
        let width = element.data_type.width()?;
        let unit = match signal.quantity() {
            Quantity::Position => "Position Control Units",
            Quantity::Velocity => "Velocity Control Units / Sec",
            Quantity::Acceleration => "Accel Control Units / Sec²",
            Quantity::Torque => "% Motor Rated",
            _ => "",
        };
        let mantissa = if width == Width::F32 { SINGLE } else { DOUBLE };
        Some(North { unit: unit.to_owned(), ratio, is_whole: !width.is_float(), mantissa })
    }
}

fn end_to_end(name: &str, is_signal: bool, north: &North, south: &South) -> Option<RowNumbers> {
    let to_north = north.ratio.inverse()?;
    let (low, high) = south.width.range();
    let (low, high) = (low.max(south.outward.min), high.min(south.outward.max));
    let generic = |count: i64| south.inward.convert(count).value;
    let (one, two) = (generic(low), generic(high));
    let ends = (one.min(two), one.max(two));
    let lsb = south.inward.ratio;
    // Of one whole number, exactly; the limits of 64 bits are no matter to a ratio.
    let step = lsb.then_nearest(to_north).map_or(f64::NAN, |ratio| ratio.to_f64(1)).abs();
    Some(RowNumbers {
        name: name.to_owned(),
        is_signal,
        item: south.item,
        unit: north.unit.clone(),
        range: (!south.wraps).then(|| (to_north.to_f64(ends.0), to_north.to_f64(ends.1))),
        generic_range: (!south.wraps).then_some(ends),
        step,
        is_whole: north.is_whole,
        float_exact: (!north.is_whole).then(|| step * profile_generic::cast::f64_from_i64(north.mantissa)),
        lost: lost(north, south, to_north).map(|(value, back)| LostPrecision {
            value,
            back,
            most: step / 2.0,
        }),
    })
}

/// The first whole number of the controller that does not come back.
fn lost(north: &North, south: &South, to_north: Ratio) -> Option<(i64, i64)> {
    if !north.is_whole {
        return None;
    }
    let to_generic = Conversion::new(north.ratio);
    let to_north = Conversion::new(to_north);
    let (low, high) = south.width.range();
    (1..=TRIED).find_map(|value| {
        let count = south.outward.convert(to_generic.convert(value).value);
        if count.saturated || !(low..=high).contains(&count.value) {
            return None;
        }
        let back = to_north.convert(south.inward.convert(count.value).value).value;
        (back != value).then_some((value, back))
    })
}
