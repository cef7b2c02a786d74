//! Signals and parameters of the generic model, the parameters that overlays add to it, and what is computed from them.

use crate::own_values::OF_GATEWAY;
use profile_generic::functional_element::FunctionalElement;
use profile_generic::image::Signal;
use profile_generic::parameter::{Access, Parameter, ParameterType};
use profile_generic::quantity::Quantity;

use crate::computed::{Computation, Operand, Read};
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{GenericFile, Name, ParameterRow as GenericParameterRow};
use crate::load::Parsed;
use crate::resolver::Resolver;

use super::{computed, quantity};

/// Parameters that overlays may define: the registers of a drive's maker are hundreds, and every access is by binary search.
const VENDOR_PARAMETERS_MAX: usize = 1_024;

/// A parameter of the catalogue, or of an overlay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GenericParameter {
    /// Its number.
    pub parameter: Parameter,
    /// Its name in the tables.
    pub name: String,
    /// Functional element that it belongs to.
    pub element: FunctionalElement,
    /// What it measures; decides the unit.
    pub quantity: Quantity,
    /// How it is held.
    pub kind: ParameterType,
    /// When it may be written.
    pub access: Access,
    /// What it is, in a sentence; may be empty for a parameter of an overlay.
    pub description: String,
    /// Least and greatest value that may be set, or that the drive may have where it is only read, in the unit of the
    /// quantity.
    pub range: Option<(i64, i64)>,
}

/// Signals and parameters of the generic model, as the generic dictionary lists them. The signals are the fields of the
/// process image, and the constants of the parameters are generated from the shipped dictionary: another one that says
/// otherwise is refused. Parameters of overlays come on top.
#[derive(Debug, Clone, Default)]
pub struct GenericDictionary {
    signals: Vec<Signal>,
    parameters: Vec<GenericParameter>,
    /// By the numbers of the parameters.
    computations: Vec<Computation>,
}

impl GenericDictionary {
    pub(super) fn resolve(file: &Parsed<GenericFile>, errors: &mut Findings) -> Self {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "generic");
        let mut dictionary = Self::default();
        for row in &rows.signal {
            let signals = Signal::ALL.iter().map(|signal| signal.name());
            let what = "a signal of the generic model";
            let Some(signal) = resolver.name("name", &row.name, what, Signal::parse, signals) else {
                continue;
            };
            let access = if signal.is_command() { "command" } else { "feedback" };
            same(&mut resolver, "quantity", &row.quantity, signal.quantity().name());
            same(&mut resolver, "access", &row.access, access);
            if let Some(about) = &row.about {
                same(&mut resolver, "about", about, signal.description());
            }
            if dictionary.signals.contains(&signal) {
                resolver.error(code::TWICE, row.name.span(), "name", "the signal is defined twice");
            }
            dictionary.signals.push(signal);
        }
        for row in &rows.parameter {
            let is_of_vendor =
                row.number.as_ref().is_some_and(|number| Parameter(*number.get_ref()).is_of_vendor());
            let known = Parameter::from_name(row.name.get_ref()).is_some();
            let found = match is_of_vendor && !known {
                true => of_vendor(&mut resolver, row),
                false => of_catalogue(&mut resolver, row),
            };
            dictionary.extend(&mut resolver, row, found);
        }
        dictionary.limit(&mut resolver, &rows.profile);
        dictionary.computations = computed::resolve(&mut resolver, rows, &dictionary);
        rows.parameter.iter().for_each(|row| dictionary.bounded(&mut resolver, row));
        dictionary
    }

    fn extend(
        &mut self,
        resolver: &mut Resolver<'_>,
        row: &GenericParameterRow,
        found: Option<GenericParameter>,
    ) {
        let Some(found) = found else { return };
        if self.parameters.iter().any(|other| other.name == found.name) {
            resolver.error(code::TWICE, row.name.span(), "name", "the parameter is defined twice");
        } else if let Some(other) = self.parameters.iter().find(|other| other.parameter == found.parameter) {
            let message = format!("0x{:04X} is the number of {}", found.parameter.0, other.name);
            let span = row.number.as_ref().map_or(row.name.span(), |number| number.span());
            resolver.error(code::TWICE, span, "number", message);
        }
        self.parameters.push(found);
    }

    fn limit(&self, resolver: &mut Resolver<'_>, at: &Name) {
        let count = self.parameters.iter().filter(|row| row.parameter.is_of_vendor()).count();
        if count > VENDOR_PARAMETERS_MAX {
            let message =
                format!("expected at most {VENDOR_PARAMETERS_MAX} parameters of vendors, got {count}");
            resolver.error(code::TOO_MANY, at.span(), "parameter", message);
        }
    }

    /// The range of a parameter that is only read says what a computed value can be, or can be computed from.
    fn bounded(&self, resolver: &mut Resolver<'_>, row: &GenericParameterRow) {
        let Some(range) = row.range.as_ref().filter(|_| row.access.get_ref() == Access::Read.name()) else {
            return;
        };
        let Some(known) = self.parameter(row.name.get_ref()) else { return };
        let counts = self.computations.iter().any(|computation| {
            computation.reads.iter().any(|read| read.parameter == Some(known.parameter))
                || computation.rows.iter().any(|row| row.parameter == known.parameter)
        });
        if !counts && known.parameter.is_of_vendor() {
            let message =
                "expected no range for a parameter that is only read, and that no computed value uses";
            resolver.error(code::CONTRADICTION, range.span(), "range", message);
        }
    }

    /// All signals.
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// All parameters.
    pub fn parameters(&self) -> &[GenericParameter] {
        &self.parameters
    }

    /// The parameter with this name.
    pub fn parameter(&self, name: &str) -> Option<&GenericParameter> {
        self.parameters.iter().find(|known| known.name == name)
    }

    /// The parameter with this number.
    pub fn by_number(&self, parameter: Parameter) -> Option<&GenericParameter> {
        self.parameters.iter().find(|known| known.parameter == parameter)
    }

    /// Whether a parameter is a setting or a rating, which changes only when somebody changes it, and no actual value: everything that
    /// can be set, and the limits that drives fix.
    #[must_use]
    pub fn is_setting(&self, parameter: Parameter) -> bool {
        let is_limit =
            Parameter::VELOCITY_LIMIT_BIPOLAR == parameter || Parameter::TORQUE_LIMIT_BIPOLAR == parameter;
        is_limit || self.by_number(parameter).is_some_and(|row| row.access != Access::Read)
    }

    /// Whether the value of a parameter can be computed in every cycle: from signals, and from what does not change by itself.
    #[must_use]
    pub fn is_cyclic(&self, parameter: Parameter) -> bool {
        let is_known = |read: &Read| {
            read.signal.is_some()
                || read
                    .parameter
                    .is_some_and(|parameter| OF_GATEWAY.contains(&parameter) || self.is_setting(parameter))
        };
        self.computation(parameter).is_some_and(|computation| {
            let mut operands = computation.rows.iter().flat_map(|row| row.operation.operands());
            // What a row computes is computed, also where the drive has it.
            operands.all(|operand| match operand {
                Operand::Read(at) => computation.reads.get(at).is_some_and(is_known),
                Operand::ReadOrRow(..) | Operand::Row(_) | Operand::Constant(_) => true,
            })
        })
    }

    /// How the value of a parameter is computed, of the catalogue in drives that lack it; `None` for one that only drives have.
    pub fn computation(&self, parameter: Parameter) -> Option<&Computation> {
        let of = |computation: &Computation| computation.rows.last().map(|row| row.parameter);
        let at = self.computations.binary_search_by_key(&Some(parameter), of).ok()?;
        self.computations.get(at)
    }

    /// Everything that is computed.
    pub fn computations(&self) -> &[Computation] {
        &self.computations
    }

    /// The names of all parameters.
    pub fn names(&self) -> impl Iterator<Item = &str> + Clone + '_ {
        self.parameters.iter().map(|row| row.name.as_str())
    }
}

/// A row that repeats the catalogue.
fn of_catalogue(resolver: &mut Resolver<'_>, row: &GenericParameterRow) -> Option<GenericParameter> {
    let names = Parameter::NAMED.iter().map(|(_, name)| *name);
    let what = "a parameter of the generic model, or a number from 0x8000 to 0xFFFF for one of your own";
    let find = |name: &str| Parameter::from_name(name).and_then(Parameter::row);
    let known = resolver.name("name", &row.name, what, find, names)?;
    if let Some(number) = row.number.as_ref().filter(|number| *number.get_ref() != known.parameter.0) {
        let (expected, got) = (known.parameter.0, number.get_ref());
        let message = format!("expected 0x{expected:04X}, got 0x{got:04X}");
        resolver.error(code::CONTRADICTS_CATALOGUE, number.span(), "number", message);
    }
    if let Some(element) = &row.element {
        same(resolver, "element", element, known.element.name());
    }
    if let Some(about) = &row.about {
        same(resolver, "about", about, known.description);
    }
    same(resolver, "quantity", &row.quantity, known.quantity.name());
    same(resolver, "type", &row.data_type, known.kind.name());
    same(resolver, "access", &row.access, known.access.name());
    if let Some(range) = &row.range {
        let message = "expected no range: that of a parameter of the catalogue is the drive's";
        resolver.error(code::CONTRADICTS_CATALOGUE, range.span(), "range", message);
    }
    Some(GenericParameter {
        parameter: known.parameter,
        name: row.name.get_ref().clone(),
        element: known.element,
        quantity: known.quantity,
        kind: known.kind,
        access: known.access,
        description: known.description.to_owned(),
        range: None,
    })
}

/// A row of an overlay that defines a parameter.
fn of_vendor(resolver: &mut Resolver<'_>, row: &GenericParameterRow) -> Option<GenericParameter> {
    plain(resolver, &row.name);
    let element = match &row.element {
        None => Some(FunctionalElement::ApplicationFunction),
        Some(name) => {
            let names = FunctionalElement::ALL.iter().map(|element| element.name());
            resolver.name("element", name, "a functional element", FunctionalElement::parse, names)
        }
    };
    let quantity = quantity(resolver, &row.quantity);
    let kind = resolver.word("type", &row.data_type, &[("integer", ParameterType::Integer)]);
    let accesses = Access::ALL.iter().map(|access| access.name());
    let access = resolver.name("access", &row.access, "an access", Access::parse, accesses);
    let range = row.range.as_ref().map(|range| (range, *range.get_ref()));
    if let Some((at, [low, high])) = range.filter(|(_, [low, high])| low > high) {
        let message = format!("expected the least value first, got [{low}, {high}]");
        resolver.error(code::OUT_OF_RANGE, at.span(), "range", message);
    }
    Some(GenericParameter {
        parameter: Parameter(*row.number.as_ref()?.get_ref()),
        name: row.name.get_ref().clone(),
        element: element?,
        quantity: quantity?,
        kind: kind?,
        access: access?,
        description: row.about.as_ref().map(|about| about.get_ref().clone()).unwrap_or_default(),
        range: range.map(|(_, [low, high])| (low, high)),
    })
}

/// Names of overlays look like those of the catalogue.
pub(super) fn plain(resolver: &mut Resolver<'_>, row: &Name) {
    let name = row.get_ref();
    let is_plain = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
    if name.is_empty() || !name.bytes().all(is_plain) {
        let message = format!("expected small letters, digits and _, got `{name}`");
        resolver.error(code::UNKNOWN_NAME, row.span(), "name", message);
    }
}

/// Checks that a dictionary says what the program was built with.
fn same(resolver: &mut Resolver<'_>, key: &str, name: &Name, expected: &str) {
    resolver.same(code::CONTRADICTS_CATALOGUE, key, name, expected);
}
