//! What the tables of all drive profiles share: how their rows are read, and how a program is filled from them.

use profile_generic::image::{CommandSet, Signal};
use profile_generic::mode::{InterpolationSource, ModeSelection};
use profile_generic::parameter::{Access, Parameter};
use profile_generic::program::Field;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::state::Action;

use super::dictionary::{GenericDictionary, GenericParameter, quantity};
use super::drive_program::{DriveProgram, FaultRow, ModeEntry, ParameterEntry, Procedure, StatusRow};
use super::finding::registry as code;
use super::format::{Name, RatioRow, UnitRow};
use super::generic_names::{WAYS, directions, interpolation, operating_mode, parameter, signal};
use super::item::Item;
use super::resolver::Resolver;

/// Which way a cyclic value goes: whether it goes to the drive.
pub(crate) const CYCLIC_WAYS: [(&str, bool); 2] = [("to_drive", true), ("from_drive", false)];

/// Whether a drive that lacks a cyclic value or a mode is refused.
pub(crate) const REFUSED: [(&str, bool); 2] = [("refuse", true), ("omit", false)];

/// What a parameter is that the drive lacks: a value that is kept in its place would have no effect.
pub(crate) const REJECTED: [(&str, ()); 1] = [("reject", ())];

/// Whether commissioning fails where the drive refuses a step.
pub(crate) const FAILS: [(&str, bool); 2] = [("fail", true), ("continue", false)];

/// A table of an axis does not fit its program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} does not fit the program of an axis")]
pub struct Full(pub &'static str);

/// A fixed unit and how drives spell it.
#[derive(Debug, Clone)]
pub(crate) struct FixedUnit {
    pub unit: String,
    pub texts: Vec<String>,
    pub quantity: Quantity,
    pub ratio: Ratio,
}

impl FixedUnit {
    /// Whether a drive that says this means the unit.
    pub fn is(&self, text: &str) -> bool {
        self.texts.iter().chain([&self.unit]).any(|known| known.eq_ignore_ascii_case(text))
    }
}

/// A parameter that a drive keeps at this place of its profile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ParameterRule<At> {
    pub parameter: Parameter,
    pub quantity: Quantity,
    pub to_drive: bool,
    pub from_drive: bool,
    pub factor: Ratio,
    pub at: At,
}

impl<At> ParameterRule<At> {
    /// A rule that only converts a value, both ways; the number of the parameter does not matter for that.
    pub fn plain(quantity: Quantity, at: At) -> Self {
        let (parameter, factor) = (Parameter::default(), Ratio::ONE);
        Self { parameter, quantity, to_drive: true, from_drive: true, factor, at }
    }
}

/// Notes each action that no row of the table, whose head is `mapping`, carries out.
pub(super) fn every_action(
    resolver: &mut Resolver<'_>,
    mapping: &Name,
    has: impl Fn(Action) -> bool,
    expected: impl Fn(Action) -> String,
) {
    for action in Action::ALL.iter().filter(|action| !has(**action)) {
        let name = action.to_string();
        resolver.lacks(code::ROW_MISSING, mapping.span(), "action", &name, expected(*action));
    }
}

/// Reports a row whose name other rows have already.
pub(super) fn once(resolver: &mut Resolver<'_>, known: bool, key: &str, name: &Name) {
    if known {
        resolver.error(code::TWICE, name.span(), key, format!("the {key} is defined twice"));
    }
}

/// A `[[unit]]` row; `texts` is how drives spell it.
pub(super) fn fixed_unit(resolver: &mut Resolver<'_>, row: &UnitRow) -> Option<FixedUnit> {
    if let Some(times) = &row.times {
        let message = "expected no `times` for a fixed unit";
        resolver.error(code::CONTRADICTION, times.span(), "times", message);
    }
    if row.reciprocal {
        let message = "expected no `reciprocal` for the unit of a drive";
        resolver.error(code::CONTRADICTION, row.unit.span(), "reciprocal", message);
    }
    let quantity = quantity(resolver, &row.quantity);
    let ratio = resolver.ratio("generic_per_unit", &row.generic_per_unit);
    let (unit, texts) = (row.unit.get_ref().clone(), row.texts.clone());
    Some(FixedUnit { unit, texts, quantity: quantity?, ratio: ratio? })
}

/// Signal of a `[[signal]]` row, whether it goes to the drive, and whether an axis is refused without it.
pub(super) fn signal_row(
    resolver: &mut Resolver<'_>,
    name: &Name,
    direction: &Name,
    missing: &Name,
) -> Option<(Signal, bool, bool)> {
    let signal = signal(resolver, "signal", name);
    let to_drive = resolver.word("direction", direction, &CYCLIC_WAYS);
    let refuse = resolver.word("missing", missing, &REFUSED);
    let (signal, to_drive, refuse) = (signal?, to_drive?, refuse?);
    if signal.is_command() != to_drive {
        let message = format!("{signal} cannot go {}", direction.get_ref());
        resolver.error(code::DIRECTION, direction.span(), "direction", message);
        return None;
    }
    Some((signal, to_drive, refuse))
}

/// What a `[[mode]]` row is for, and whether an axis can do without it.
pub(super) fn mode_row(
    resolver: &mut Resolver<'_>,
    mode: &Name,
    source: Option<&Name>,
    missing: &Name,
) -> Option<(ModeSelection, bool)> {
    let mode = operating_mode(resolver, mode);
    let interpolation = match source {
        None => Some(InterpolationSource::Controller),
        Some(name) => interpolation(resolver, name),
    };
    let optional = resolver.word("missing", missing, &REFUSED).map(|refuse| !refuse);
    Some((ModeSelection { mode: mode?, interpolation: interpolation? }, optional?))
}

/// Signals of a `[[mode]]` row; those that `has` no `[[signal]]` row are reported.
pub(super) fn mapped(
    resolver: &mut Resolver<'_>,
    key: &str,
    names: &[Name],
    has: impl Fn(Signal) -> bool,
) -> Vec<Signal> {
    let mut signals = Vec::with_capacity(names.len());
    for name in names {
        let Some(signal) = signal(resolver, key, name) else { continue };
        if !has(signal) {
            let message = format!("expected a [[signal]] row for {signal}, got none");
            resolver.lacks(code::ROW_MISSING, name.span(), key, name.get_ref(), message);
        }
        if signal.is_command() != (key == "command") {
            let message = format!("{signal} belongs to the other telegram");
            resolver.error(code::DIRECTION, name.span(), key, message);
        }
        signals.push(signal);
    }
    signals
}

/// A `[[parameter]]` row whose place is still to be found.
pub(super) fn parameter_row(
    resolver: &mut Resolver<'_>,
    generic: &GenericDictionary,
    name: &Name,
    (direction, missing, factor): (&Name, Option<&Name>, Option<&RatioRow>),
) -> Option<ParameterRule<()>> {
    let parameter = parameter(resolver, generic, name);
    let ways = directions(resolver, direction);
    missing.map_or(Some(()), |missing| resolver.word("missing", missing, &REJECTED))?;
    let factor = factor.map_or(Some(Ratio::ONE), |factor| resolver.ratio("factor", factor));
    let (parameter, (to_drive, from_drive), factor) = (parameter?, ways?, factor?);
    // Of the catalogue, what is only read has nothing to be written.
    if parameter.parameter.is_of_vendor() || (parameter.access == Access::Read && to_drive) {
        expect_ways(resolver, parameter, direction, (to_drive, from_drive));
    }
    let (parameter, quantity) = (parameter.parameter, parameter.quantity);
    Some(ParameterRule { parameter, quantity, to_drive, from_drive, factor, at: () })
}

/// What is passed through to the drive is read from it, and written where it may be: nothing else knows the value.
fn expect_ways(
    resolver: &mut Resolver<'_>,
    parameter: &GenericParameter,
    direction: &Name,
    ways: (bool, bool),
) {
    let expected = if parameter.access == Access::Read { (false, true) } else { (true, true) };
    if ways != expected {
        let word = WAYS.iter().find(|(_, ways)| *ways == expected).map_or("", |(word, _)| *word);
        let (name, access) = (&parameter.name, parameter.access);
        let message = format!(
            "expected `{word}` for {name}, whose access is `{access}`, got `{}`",
            direction.get_ref()
        );
        resolver.error(code::DIRECTION, direction.span(), "direction", message);
    }
}

/// The parameter of a commissioning step that writes it.
pub(super) fn written_parameter<At>(
    resolver: &mut Resolver<'_>,
    generic: &GenericDictionary,
    rules: &[ParameterRule<At>],
    name: &Name,
) -> Option<Parameter> {
    let parameter = parameter(resolver, generic, name)?.parameter;
    if !rules.iter().any(|rule| rule.parameter == parameter && rule.to_drive) {
        let message = "expected a parameter with a [[parameter]] row that goes to the drive";
        resolver.lacks(code::ROW_MISSING, name.span(), "parameter", name.get_ref(), message);
    }
    Some(parameter)
}

impl<At> ParameterRule<At> {
    /// The same rule at another place.
    pub fn at<Other>(self, at: Other) -> ParameterRule<Other> {
        let Self { parameter, quantity, to_drive, from_drive, factor, .. } = self;
        ParameterRule { parameter, quantity, to_drive, from_drive, factor, at }
    }
}

impl DriveProgram {
    pub(super) fn add_field(&mut self, field: Field) -> Result<(), Full> {
        let (full, table) = match field.signal.is_command() {
            true => (self.command.push(field).is_err(), "the master's telegram"),
            false => (self.feedback.push(field).is_err(), "the drive's telegram"),
        };
        if full { Err(Full(table)) } else { Ok(()) }
    }

    pub(super) fn add_mode(&mut self, entry: ModeEntry) -> Result<(), Full> {
        self.modes.try_push(entry).map_err(|_| Full("the table of modes"))
    }

    /// Signals of a mode that it needs, of those that an axis is refused without, and signals that the telegram carries.
    pub(super) fn command_sets(
        &self,
        signals: &[Signal],
        refused: impl Fn(Signal) -> bool,
    ) -> (CommandSet, CommandSet) {
        let set = |chosen: &dyn Fn(Signal) -> bool| {
            signals.iter().filter(|signal| chosen(**signal)).map(|signal| signal.command_bit()).collect()
        };
        let carried = |signal| self.command.fields().any(|field| field.signal == signal);
        (set(&refused), set(&carried))
    }

    pub(super) fn add_procedure(&mut self, procedure: Procedure) -> Result<(), Full> {
        self.procedures.try_push(procedure).map_err(|_| Full("the table of procedures"))
    }

    /// Whether the word of a status bit is in the telegram.
    pub(super) fn carries_word(&self, word: Option<Item>) -> bool {
        word.is_none_or(|word| self.status_words.iter().any(|place| place.item == word))
    }

    pub(super) fn add_status(&mut self, row: StatusRow) -> Result<(), Full> {
        self.known_status |= row.bit;
        self.status.try_push(row).map_err(|_| Full("the table of status bits"))
    }

    pub(super) fn add_faults(&mut self, rows: impl IntoIterator<Item = FaultRow>) -> Result<(), Full> {
        rows.into_iter()
            .try_for_each(|row| self.faults.try_push(row))
            .map_err(|_| Full("the table of faults"))
    }

    /// Adds the parameters that the drive has; `entry` is `None` for one that it lacks or does not report the unit of.
    pub(super) fn add_parameters<At, E>(
        &mut self,
        rules: &[ParameterRule<At>],
        entry: impl Fn(&ParameterRule<At>) -> Result<Option<ParameterEntry>, E>,
    ) -> Result<(), E> {
        for rule in rules {
            self.parameters.extend(entry(rule)?);
        }
        self.parameters.sort_by_key(|entry| entry.parameter);
        Ok(())
    }
}
