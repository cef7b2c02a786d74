//! Names of the generic model as the rows of every mapping write them.

use profile_generic::capture::{CaptureEdge, CaptureKind, CaptureSource};
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{Signal, StatusBits};
use profile_generic::mode::{InterpolationSource, OperatingMode};
use profile_generic::scaling::UnitKind;
use profile_generic::state::{Action, Report};

use super::dictionary::{GenericDictionary, GenericParameter};
use super::format::Name;
use super::resolver::Resolver;

/// A signal by name.
pub(super) fn signal(resolver: &mut Resolver<'_>, key: &str, name: &Name) -> Option<Signal> {
    let known = Signal::ALL.iter().map(|signal| signal.name());
    resolver.name(key, name, "a signal of the generic model", Signal::parse, known)
}

/// An operating mode by name.
pub(super) fn operating_mode(resolver: &mut Resolver<'_>, name: &Name) -> Option<OperatingMode> {
    let known = OperatingMode::ALL.iter().map(|mode| mode.name());
    resolver.name("mode", name, "an operating mode", OperatingMode::parse, known)
}

/// Who makes the way, by name.
pub(super) fn interpolation(resolver: &mut Resolver<'_>, name: &Name) -> Option<InterpolationSource> {
    let known = InterpolationSource::ALL.iter().map(|source| source.name());
    resolver.name("interpolation", name, "who makes the way", InterpolationSource::parse, known)
}

/// An action by name.
pub(super) fn action(resolver: &mut Resolver<'_>, name: &Name) -> Option<Action> {
    let known = Action::ALL.iter().map(|action| action.name());
    resolver.name("action", name, "an action of the generic model", Action::parse, known)
}

/// Rotary or linear, by name.
pub(super) fn unit_kind(resolver: &mut Resolver<'_>, name: &Name) -> Option<UnitKind> {
    let known = UnitKind::ALL.iter().map(|kind| kind.name());
    resolver.name("kind", name, "rotary or linear", UnitKind::parse, known)
}

/// A capture by the names of its source and its edge.
pub(super) fn capture_kind(resolver: &mut Resolver<'_>, source: &Name, edge: &Name) -> Option<CaptureKind> {
    let known = CaptureSource::ALL.iter().map(|source| source.name());
    let source = resolver.name("capture", source, "a source of captures", CaptureSource::parse, known);
    let known = CaptureEdge::ALL.iter().map(|edge| edge.name());
    let edge = resolver.name("edge", edge, "positive or negative", CaptureEdge::parse, known);
    Some(CaptureKind::new(source?, edge?))
}

/// A report of a drive by name.
pub(super) fn report(resolver: &mut Resolver<'_>, name: &Name) -> Option<Report> {
    let known = Report::ALL.iter().map(|report| report.name());
    resolver.name("report", name, "a report of a drive", Report::parse, known)
}

/// A status bit by name.
pub(super) fn status_bit(resolver: &mut Resolver<'_>, name: &Name) -> Option<StatusBits> {
    let known = StatusBits::NAMED.iter().map(|(_, name)| *name);
    resolver.name("status", name, "a status bit", StatusBits::parse, known)
}

/// A cause of faults by name.
pub(super) fn cause(resolver: &mut Resolver<'_>, name: &Name) -> Option<FaultCause> {
    let known = FaultCause::NAMED.iter().map(|(_, name)| *name);
    resolver.name("cause", name, "a cause of the fault catalogue", FaultCause::from_name, known)
}

/// A reaction by name.
pub(super) fn reaction(resolver: &mut Resolver<'_>, key: &str, name: &Name) -> Option<Reaction> {
    let known = Reaction::ALL.iter().map(|reaction| reaction.name());
    resolver.name(key, name, "a reaction", Reaction::parse, known)
}

/// A cause and its reaction: its usual one where the row names none.
pub(super) fn cause_and_reaction(
    resolver: &mut Resolver<'_>,
    name: &Name,
    wanted: Option<&Name>,
) -> Option<(FaultCause, Reaction)> {
    let cause = cause(resolver, name);
    let reaction = match wanted {
        None => cause.map(FaultCause::default_reaction),
        Some(name) => reaction(resolver, "reaction", name),
    };
    Some((cause?, reaction?))
}

/// A parameter by name.
pub(super) fn parameter<'g>(
    resolver: &mut Resolver<'_>,
    generic: &'g GenericDictionary,
    name: &Name,
) -> Option<&'g GenericParameter> {
    let find = |text: &str| generic.parameter(text);
    resolver.name("parameter", name, "a parameter of the generic model", find, generic.names())
}

/// Which ways a parameter goes: whether to the drive, and whether from it.
pub(crate) const WAYS: [(&str, (bool, bool)); 3] =
    [("both", (true, true)), ("to_drive", (true, false)), ("from_drive", (false, true))];

/// Whether a value goes to the drive, and whether it comes from it.
pub(super) fn directions(resolver: &mut Resolver<'_>, name: &Name) -> Option<(bool, bool)> {
    resolver.word("direction", name, &WAYS)
}
