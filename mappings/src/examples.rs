//! Worked examples: numbers that stand in the tables and must come out.

use core::fmt;
use std::ops::Range;

use profile_cip::device::drive_link::DriveImage;
use profile_generic::fault_set::FaultSet;
use profile_generic::image::{AxisCommand, AxisFeedback, Signal};
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::Parameter;
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::idn::Idn;

use super::cip_tables::CipTables;
use super::format::{
    Cia402ExampleRow, CipAttributeRow, CipExampleRow, CyclicRow, Name, Number, ScalingExampleRow,
};
use super::load::Tables;
use super::sercos::compile::{Compiler, unit_of};
use super::{
    AxisUnits, Cia402Axis, Cia402Tables, CipScaling, CipType, CipValue, DriveFacts, Mapping, ObjectFacts,
    Rated, Reference, SercosAxis, Told,
};
use crate::finding::{Findings, Problem, Source, registry as code};

/// What is wrong, and the value it is wrong about.
type Wrong = (Range<usize>, String);

struct Runner<'m> {
    mapping: &'m Mapping,
    count: usize,
    findings: &'m mut Findings,
}

/// Runs every example and returns how many there are.
pub(super) fn run(mapping: &Mapping, tables: &Tables, findings: &mut Findings) -> usize {
    let mut runner = Runner { mapping, count: 0, findings };
    let cip = &tables.cip_generic;
    for row in &cip.rows.cyclic {
        for example in &row.examples {
            let result = runner.mapping.cyclic_example(row, example);
            runner.note(&cip.text, &row.element, result);
        }
    }
    for row in &cip.rows.attribute {
        for example in &row.examples {
            let result = runner.mapping.attribute_example(row, example);
            runner.note(&cip.text, &row.attribute, result);
        }
    }
    let sercos = &tables.generic_sercos;
    for row in &sercos.rows.scaling {
        for example in &row.examples {
            let result = runner.mapping.drive_example(None, example);
            runner.note(&sercos.text, &row.scaling, result);
        }
    }
    for row in &sercos.rows.parameter {
        for example in &row.examples {
            let result = runner.mapping.drive_example(Parameter::from_name(row.parameter.get_ref()), example);
            runner.note(&sercos.text, &row.parameter, result);
        }
    }
    runner.cia402(mapping);
    // What holds for all drives has to hold for those of a family as well, where it says nothing else. It is one example then.
    for family in mapping.families() {
        let count = runner.count;
        runner.count = count + runner.cia402(&family.mapping);
    }
    runner.count
}

impl Runner<'_> {
    /// Those between the generic model and CiA 402; how many of them stand in an overlay.
    fn cia402(&mut self, mapping: &Mapping) -> usize {
        let file = &mapping.tables().generic_cia402;
        let mut own = 0;
        for row in &file.rows.scaling {
            for example in &row.examples {
                let (path, ..) = file.text.place(example.object.span().start);
                own += usize::from(path != file.text.path());
                self.note(&file.text, &row.unit, mapping.object_example(example));
            }
        }
        own
    }

    /// Counts an example of the row of a name, and reports it if it failed.
    fn note(&mut self, text: &Source, row: &Name, result: Result<(), Wrong>) {
        self.count += 1;
        let Err((span, message)) = result else { return };
        let problem = |at: &Range<usize>| Problem::new(code::EXAMPLE_FAILS, at.clone()).about(row.get_ref());
        let place = |at: &Range<usize>| text.place(at.start).0;
        // An example of the table that fails with the row of an overlay shows what the overlay has changed.
        if place(&span) == place(&row.span()) {
            return self.findings.push(text, problem(&span).expected(message));
        }
        let title = format!("with this row, a worked example of `{}` fails", row.get_ref());
        let problem = problem(&row.span()).title(title).expected(message).related(span, "the example");
        let help = "if the drive is as the row says, take the example away with `remove = [\"examples\"]`, or write `examples` of its own";
        self.findings.push(text, problem.help(help));
    }
}

/// A value of an example as a person writes it.
trait Shown {
    fn shown(&self) -> String;
}

impl Shown for i64 {
    fn shown(&self) -> String {
        self.to_string()
    }
}

impl Shown for f64 {
    fn shown(&self) -> String {
        self.to_string()
    }
}

impl Shown for Vec<u8> {
    fn shown(&self) -> String {
        self.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
    }
}

impl<T: Shown> Shown for Option<T> {
    fn shown(&self) -> String {
        self.as_ref().map_or_else(|| "nothing".to_owned(), Shown::shown)
    }
}

impl<T: Shown, E: fmt::Display> Shown for Result<T, E> {
    fn shown(&self) -> String {
        self.as_ref().map_or_else(ToString::to_string, Shown::shown)
    }
}

fn expect<T: PartialEq + Shown>(span: Range<usize>, what: &str, expected: &T, got: &T) -> Result<(), Wrong> {
    if expected == got {
        Ok(())
    } else {
        Err((span, format!("{what}: the table says {}, got {}", expected.shown(), got.shown())))
    }
}

/// The bytes of a text such as `90 D0 03 00`.
fn hex(name: &Name) -> Result<Vec<u8>, Wrong> {
    let parse = |text: &str| u8::from_str_radix(text, 16).ok().filter(|_| text.len() == 2);
    let bytes: Option<Vec<u8>> = name.get_ref().split_whitespace().map(parse).collect();
    bytes.ok_or_else(|| {
        (name.span(), format!("expected pairs of hexadecimal digits, got `{}`", name.get_ref()))
    })
}

/// The value in the bytes, and the same as a double.
fn cip_value(bytes: &[u8], data_type: CipType) -> Option<(CipValue, f64)> {
    match (data_type, bytes) {
        (CipType::Real, &[a, b, c, d]) => {
            let value = f32::from_le_bytes([a, b, c, d]);
            Some((CipValue::Real(value), f64::from(value)))
        }
        (CipType::Lreal, &[a, b, c, d, e, f, g, h]) => {
            let value = f64::from_le_bytes([a, b, c, d, e, f, g, h]);
            Some((CipValue::Lreal(value), value))
        }
        (CipType::Dint, &[a, b, c, d]) => {
            let value = i32::from_le_bytes([a, b, c, d]);
            Some((CipValue::Dint(value), f64::from(value)))
        }
        _ => None,
    }
}

fn number(number: Number) -> f64 {
    match number {
        Number::Integer(value) => profile_generic::cast::f64_from_i64(value),
        Number::Float(value) => value,
    }
}

impl CipTables {
    /// The scaling that an example names; one turn of a million counts when it does not matter.
    fn example_scaling(&self, example: &CipExampleRow) -> Result<CipScaling, Wrong> {
        let mut scaling = CipScaling {
            kind: UnitKind::Rotary,
            nanounits_per_unit: profile_generic::scaling::NANO,
            counts_per_unit: example.resolution.unwrap_or(1_000_000),
            inverted: example.inverted,
            unwind: None,
        };
        if let Some(name) = &example.displacement_unit {
            let unit = self.motion_units.iter().find(|unit| unit.name == *name.get_ref());
            let unit = unit.ok_or((name.span(), "expected a name of Motion Unit".to_owned()))?;
            scaling.kind = unit.kind;
            scaling.nanounits_per_unit = unit.nanounits;
        }
        Ok(scaling)
    }
}

impl Mapping {
    fn cyclic_example(&self, row: &CyclicRow, example: &CipExampleRow) -> Result<(), Wrong> {
        let span = example.value.span();
        let scaling = self.cip.example_scaling(example)?;
        let none = || (span.clone(), "the row cannot be compiled for this example".to_owned());
        let program = self.cip_program(&scaling).ok_or_else(none)?;
        let signal = Signal::parse(row.signal.get_ref()).ok_or_else(none)?;
        let element = self.cip.cyclic.iter().find(|element| element.signal == signal).ok_or_else(none)?;
        let data_type = match &example.data_type {
            Some(name) => {
                CipType::NAMED.iter().find(|(known, _)| known == name.get_ref()).map(|(_, kind)| *kind)
            }
            None => Some(element.data_type),
        };
        let bytes = hex(&example.bytes)?;
        let (value, float) = data_type.and_then(|kind| cip_value(&bytes, kind)).ok_or_else(|| {
            (example.bytes.span(), format!("the bytes are no value of type {}", element.data_type.name()))
        })?;
        expect(span.clone(), "value of the bytes", &number(*example.value.get_ref()), &float)?;
        let ratio = scaling.convert(element.unit, element.turns).ok_or_else(none)?;
        let generic = *example.generic.get_ref();
        if element.to_generic {
            let mut command = AxisCommand::default();
            let values = [(usize::from(element.bit), value)];
            program.decode_elements(values, None, 0, &mut program.trackers(), &mut command);
            expect(example.generic.span(), "generic value", &Some(generic), &command.get(signal))?;
            let back = ratio.inverse().ok_or_else(none)?.to_f64(generic);
            expect(span, "value on the way back", &example.back.map_or(float, number), &back)
        } else {
            let mut feedback = AxisFeedback::default();
            feedback.set(signal, generic);
            let mut image = DriveImage::default();
            program.drive_image(&feedback, &FaultSet::new(), &mut Told::default(), &mut image);
            // The device sends the low word of a position that it does not unwind.
            let sent = match signal {
                Signal::PositionActual => Some(image.position.to_le_bytes()[..4].to_vec()),
                Signal::VelocityActual => image.velocity.map(|value| value.to_le_bytes().to_vec()),
                Signal::AccelerationActual => image.acceleration.map(|value| value.to_le_bytes().to_vec()),
                _ => None,
            };
            expect(example.bytes.span(), "bytes", &Some(bytes), &sent)
        }
    }

    fn attribute_example(&self, row: &CipAttributeRow, example: &CipExampleRow) -> Result<(), Wrong> {
        let span = example.value.span();
        let scaling = self.cip.example_scaling(example)?;
        let none = || (span.clone(), "the attribute has no generic value".to_owned());
        let table = self.attribute_table(&scaling).ok_or_else(none)?;
        let id = self.dictionaries.cip.attribute(row.attribute.get_ref()).map(|attribute| attribute.id);
        let entry = id.and_then(|id| table.get(id)).ok_or_else(none)?;
        let bytes = hex(&example.bytes)?;
        let (_, float) = cip_value(&bytes, entry.data_type).ok_or_else(|| {
            (example.bytes.span(), format!("the bytes are no value of type {}", entry.data_type.name()))
        })?;
        expect(span.clone(), "value of the bytes", &number(*example.value.get_ref()), &float)?;
        let generic = *example.generic.get_ref();
        // Of a parameter that is read while a signal has no value, the conversion is the signal's.
        if row.parameter.is_some() && row.signal.is_none() {
            expect(example.generic.span(), "generic value", &Ok(generic), &entry.to_generic(&bytes))?;
        }
        let mut out = [0; 8];
        let written = entry.from_generic(generic, &mut out).map(|(length, _)| out[..length].to_vec());
        match example.back {
            None => expect(example.bytes.span(), "bytes on the way back", &Ok(bytes), &written),
            Some(back) => {
                let got =
                    written.ok().and_then(|bytes| cip_value(&bytes, entry.data_type)).map(|(_, float)| float);
                expect(span, "value on the way back", &Some(number(back)), &got)
            }
        }
    }

    fn object_example(&self, example: &Cia402ExampleRow) -> Result<(), Wrong> {
        let wrong = |message: String| (example.object.span(), message);
        let value = |text: &str| {
            let value = Cia402Tables::value_of(&self.dictionaries, text);
            value.ok_or_else(|| wrong(format!("{text} is no object of known length in the dictionary")))
        };
        let mut facts = ObjectFacts::new();
        for (name, number) in &example.drive {
            let held = value(name)?;
            let bytes = number.to_le_bytes();
            facts.note_data(held.object, bytes.get(..held.width.bytes()).unwrap_or_default());
        }
        let held = value(example.object.get_ref())?;
        let rule = self.cia402.plain_rule(held);
        let entry = self.cia402.entry(&rule, &Cia402Axis::default(), &facts);
        let entry = entry.map_err(|error| wrong(error.to_string()))?;
        let entry =
            entry.ok_or_else(|| wrong("the drive reports nothing that determines its unit".to_owned()))?;
        let bytes = hex(&example.bytes)?;
        let sent =
            entry.encode(*example.generic.get_ref()).map(|(bytes, length, _)| bytes[..length].to_vec());
        expect(example.bytes.span(), "bytes", &Some(bytes.clone()), &sent)?;
        let back = *example.back.get_ref();
        expect(example.back.span(), "generic value on the way back", &Some(back), &entry.decode(&bytes))
    }

    /// `parameter` for the example of a [[parameter]] row, `None` for that of a [[scaling]] row.
    fn drive_example(&self, parameter: Option<Parameter>, example: &ScalingExampleRow) -> Result<(), Wrong> {
        let sercos = &self.dictionaries.sercos;
        let wrong = |message: String| (example.idn.span(), message);
        let kind = UnitKind::parse(example.kind.get_ref())
            .ok_or_else(|| (example.kind.span(), "expected rotary or linear".to_owned()))?;
        let mut facts = DriveFacts::new();
        for (name, value) in &example.drive {
            let idn: Idn = name.parse().map_err(|error| wrong(format!("{name}: {error}")))?;
            let width =
                facts.width(idn, sercos).ok_or_else(|| wrong(format!("{idn} is not in the dictionary")))?;
            facts.note_data(idn, value.to_le_bytes().get(..width.bytes()).unwrap_or_default());
        }
        let units = AxisUnits {
            kind,
            reference: Reference::Load,
            rated: example.rated.map(|value| Rated { kind, value }),
        };
        let idn: Idn = example.idn.get_ref().parse().map_err(|error| wrong(format!("{error}")))?;
        let axis = SercosAxis {
            units,
            modes: [OperatingMode::Position.into()].into_iter().collect(),
            ..SercosAxis::default()
        };
        let generic = *example.generic.get_ref();
        let compiler = Compiler { tables: &self.sercos, dictionary: sercos, axis: &axis, facts: &facts };
        let rule = match parameter {
            Some(parameter) => {
                let rule = self.sercos.parameters.iter().find(|rule| rule.parameter == parameter);
                *rule
                    .filter(|rule| rule.at.idn == idn)
                    .ok_or_else(|| wrong(format!("the row does not map {idn}")))?
            }
            None => self
                .sercos
                .plain_rule(idn, &self.dictionaries)
                .ok_or_else(|| wrong(format!("{idn} has no unit")))?,
        };
        unit_of(&self.sercos, sercos, units, &facts, idn, rule.quantity)
            .map_err(|error| wrong(error.to_string()))?;
        let entry = compiler.parameter(&rule).map_err(|error| wrong(error.to_string()))?;
        let entry = entry.ok_or_else(|| wrong(format!("{idn} has no length or unit")))?;
        let bytes = hex(&example.bytes)?;
        if rule.to_drive {
            let sent = entry.encode(generic).map(|(bytes, length, _)| bytes[..length].to_vec());
            expect(example.bytes.span(), "bytes", &Some(bytes.clone()), &sent)?;
        }
        let back = *example.back.get_ref();
        expect(example.back.span(), "generic value on the way back", &Some(back), &entry.decode(&bytes))
    }
}
