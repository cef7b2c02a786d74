//! What the keys of tables may name, for the schemas.

use profile_generic::capture::{CaptureEdge, CaptureSource};
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::Signal;
use profile_generic::inhibit::Inhibits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::Quantity;
use profile_generic::state::{Action, DriveState, Report, Request};

use crate::cip_tables::{MISSING, Times};
use crate::device_link::DRIVE_ACTIONS;
use crate::dictionary::{AT_LIMIT, ROUNDINGS};
use crate::dictionary::{
    Access, Cia402Access, Cia402Category, Cia402Kind, Cia402Pdo, Cia402RangeKind, Cia402SetKind, Cia402Type,
    CipType, Clearing, Confidence, GroupKind, IdnFormat, Layout, RangeKind,
};
use crate::drive_rows::{CYCLIC_WAYS, FAILS, REFUSED, REJECTED};
use crate::generic_names::WAYS;
use crate::{CipConditions, Mapping, Reference, VOLTAGE_BIT};

/// Forms of the names that a file can add to a dictionary: of an attribute or word, of a generic parameter, of an IDN.
const NAME: &str = "^[ -~]+$";
const WORD: &str = "^[a-z][a-z0-9_]*$";
const IDN: &str = "^[SP]-[0-7]-[0-9]{4}(\\.[0-9]+\\.[0-9]+)?$";

/// What a key may name.
pub(super) enum Known<'n> {
    /// These names only.
    Only(Vec<&'static str>),
    /// Texts of a form.
    Form(&'static str),
    /// These names, which an editor offers, and those of the form that a file adds to a dictionary.
    Offered(&'n [String], &'static str),
}

/// What keys may name.
pub(super) struct Names {
    parameters: Vec<String>,
    attributes: Vec<String>,
    idns: Vec<String>,
    words: Vec<String>,
}

impl Names {
    pub fn new(mapping: &Mapping) -> Self {
        let dictionaries = &mapping.dictionaries;
        Self {
            parameters: dictionaries.generic.names().map(str::to_owned).collect(),
            attributes: dictionaries.cip.attributes().iter().map(|row| row.name.clone()).collect(),
            idns: dictionaries.sercos.idns().iter().map(|row| row.number()).collect(),
            words: dictionaries.sercos.words().iter().map(|word| word.name.clone()).collect(),
        }
    }

    /// What the key of a row may name; `None` for those that are free, or are checked by the program alone.
    pub fn of(&self, row: &str, key: &str) -> Option<Known<'_>> {
        let row = row.rsplit('.').next().unwrap_or(row);
        let offered = |names, form| Some(Known::Offered(names, form));
        match (row, key) {
            ("CipAttributeRow", "attribute") | ("RejectRow", "attributes") => offered(&self.attributes, NAME),
            (_, "signal") | ("SercosModeRow", "command" | "actual") => {
                Some(Known::Only(words(Signal::ALL, Signal::name)))
            }
            (_, "parameter") => offered(&self.parameters, WORD),
            (
                "SercosSignalRow" | "LoadSignalRow" | "SercosParameterRow" | "ModeSlotRow" | "CommissionRow"
                | "PolarityRow",
                "idn",
            ) => offered(&self.idns, IDN),
            ("SercosStatusRow" | "SercosFaultRow", "word") => offered(&self.words, NAME),
            _ => generic(row, key)
                .or_else(|| of_builders(row, key))
                .map(Known::Only)
                .or_else(|| form(row, key).map(Known::Form)),
        }
    }
}

fn words<T: Copy>(all: &[T], name: impl Fn(T) -> &'static str) -> Vec<&'static str> {
    all.iter().map(|one| name(*one)).collect()
}

fn named<T>(named: &[(&'static str, T)]) -> Vec<&'static str> {
    named.iter().map(|(name, _)| *name).collect()
}

/// Words of the generic model.
fn generic(row: &str, key: &str) -> Option<Vec<&'static str>> {
    Some(match (row, key) {
        ("CipModeRow" | "SercosModeRow" | "ProcedureRow" | "WhenRow" | "StatusRow", "mode") => {
            words(OperatingMode::ALL, OperatingMode::name)
        }
        ("ComputedRow", "modes") => words(OperatingMode::ALL, OperatingMode::name),
        ("ComputedRow", "signals") => words(Signal::ALL, Signal::name),
        (_, "quantity") => words(Quantity::ALL, Quantity::name),
        (_, "cause") => FaultCause::NAMED.iter().map(|(_, name)| *name).collect(),
        (_, "reaction" | "abort") => words(Reaction::ALL, Reaction::name),
        ("CipStateRow", "state") => words(DriveState::ALL, DriveState::name),
        (_, "request") if row != "ServiceRow" => words(Request::ALL, Request::name),
        (_, "report") => words(Report::ALL, Report::name),
        (_, "action") if row != "ExceptionActionRow" => words(Action::ALL, Action::name),
        ("InhibitRow", "inhibit") => Inhibits::NAMED.iter().map(|(_, name)| *name).collect(),
        (_, "capture") => words(CaptureSource::ALL, CaptureSource::name),
        (_, "edge") => words(CaptureEdge::ALL, CaptureEdge::name),
        _ => return None,
    })
}

/// Words of the tables; the builders have them beside what they mean.
fn of_builders(row: &str, key: &str) -> Option<Vec<&'static str>> {
    let cyclic = matches!(row, "CyclicRow" | "SercosSignalRow" | "Cia402SignalRow");
    Some(match (row, key) {
        ("CyclicRow", "direction") => vec!["to_generic", "from_generic"],
        (_, "direction") if cyclic => named(&CYCLIC_WAYS),
        ("SercosParameterRow" | "Cia402ParameterRow", "direction") => named(&WAYS),
        ("CyclicRow", "missing") => vec!["absent", "zero"],
        ("SercosModeRow" | "Cia402ModeRow", "missing") => named(&REFUSED),
        (_, "missing") if cyclic => named(&REFUSED),
        ("CipAttributeRow", "missing") => named(&MISSING),
        (_, "missing") => named(&REJECTED),
        (_, "refused") => named(&FAILS),
        ("ComputedRow", "at_limit") => named(&AT_LIMIT),
        ("ComputedRow", "rounding") => named(&ROUNDINGS),
        (_, "interpolation") => vec!["controller", "drive"],
        (_, "voltage_bit") => named(&VOLTAGE_BIT),
        (_, "served_by") => vec!["device", "connection", "stored", "constant", "mechanics"],
        (_, "found_by") => vec!["box", "device"],
        (_, "drive_action") => named(&DRIVE_ACTIONS),
        ("UnitRow", "times") => Times::NAMED.iter().map(|(word, _)| *word).collect(),
        ("SercosCaptureRow", "by") => vec!["latch", "counter", "input", "sequence"],
        (_, "confidence") => named(Confidence::NAMED),
        ("WordRow", "layout") => named(Layout::NAMED),
        ("IdnRow", "format") => named(IdnFormat::NAMED),
        ("AttributeRow", "type") => named(CipType::NAMED),
        ("AttributeRow", "access") => named(Access::NAMED),
        ("AttributeRow", "polarity") => vec!["sign"],
        ("Cia402ObjectRow" | "Cia402SubRow", "type") => named(Cia402Type::NAMED),
        ("Cia402ObjectRow" | "Cia402SubRow", "access") => named(Cia402Access::NAMED),
        ("Cia402ObjectRow" | "Cia402SubRow", "pdo") => named(Cia402Pdo::NAMED),
        ("Cia402ObjectRow", "kind") => named(Cia402Kind::NAMED),
        ("Cia402ObjectRow", "category") => named(Cia402Category::NAMED),
        ("SercosRangeRow", "kind") => named(GroupKind::NAMED),
        ("Cia402RangeRow", "kind") => named(Cia402RangeKind::NAMED),
        ("Cia402SetRow", "kind") => named(Cia402SetKind::NAMED),
        ("CipRangeRow", "kind") => named(RangeKind::NAMED),
        ("CommissionRow", "do") => vec![
            "write",
            "read",
            "command",
            "read_scaling",
            "read_telegram",
            "read_parameters",
            "read_captures",
            "read_procedures",
            "write_modes",
        ],
        ("CommissionRow", "elements") => {
            vec!["attribute", "unit", "minimum", "maximum", "data"]
        }
        ("Cia402CommissionRow", "do") => {
            vec![
                "write",
                "read",
                "read_scaling",
                "read_parameters",
                "read_captures",
                "write_cycle",
                "write_mode",
            ]
        }
        ("LoadRow", "generic") => named(Reference::NAMED),
        ("CipStateRow", "conditions") => named(CipConditions::NAMED),
        ("ElementRow" | "CipCodeRow" | "CipRangeRow", "need") => vec!["R", "O", "C", "-"],
        ("NetworkObjectRow", "need") => vec!["R", "O"],
        ("DisplacementUnitRow", "enumeration") => vec!["Motion Unit", "Feedback Unit"],
        ("ServiceRow", "class") => vec!["R", "O", "C", "-"],
        ("ServiceRow", "via") => vec!["explicit", "service_data_block"],
        ("FaultRecordRow", "cleared_by") => named(Clearing::NAMED),
        ("NetworkRow", "formats") => vec!["fixed", "variable"],
        ("NetworkRow", "trigger") => vec!["cyclic"],
        ("NetworkRow", "priority") => vec!["urgent", "very_high"],
        ("NetworkObjectRow", "per") => vec!["node", "axis"],
        _ => return None,
    })
}

/// Forms of texts: an object of CANopen, bytes in hex.
fn form(row: &str, key: &str) -> Option<&'static str> {
    match (row, key) {
        ("Cia402SignalRow" | "Cia402ParameterRow" | "Cia402StatusRow" | "Cia402ExampleRow", "object")
        | ("Cia402ParameterRow", "inverted" | "common") => Some("^[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2}$"),
        (_, "bytes") => Some("^[0-9A-Fa-f]{2}( [0-9A-Fa-f]{2})*$"),
        _ => None,
    }
}
