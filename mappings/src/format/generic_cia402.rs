//! Rows of the mapping between the generic model and CiA 402.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::{FieldValueRow, Name, RatioRow, Source, UnitRow};

/// `mappings/tables/generic-cia402.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GenericCia402File {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `generic to cia402`.
    pub mapping: Name,
    /// Fixed units of objects.
    pub unit: Vec<UnitRow>,
    /// Units that the drive's factor group defines.
    pub scaling: Vec<Cia402ScalingRow>,
    /// How drives are of which the configuration does not say it.
    pub drive: Cia402DriveRow,
    /// Control, status and modes.
    pub words: Cia402WordsRow,
    /// Signals.
    pub signal: Vec<Cia402SignalRow>,
    /// Operating modes.
    pub mode: Vec<Cia402ModeRow>,
    /// Operating modes that a drive carries out by itself.
    pub procedure: Vec<Cia402ProcedureRow>,
    /// Controlword of each action.
    pub action: Vec<Cia402ActionRow>,
    /// What a statusword says.
    pub report: Vec<Cia402ReportRow>,
    /// Status bits.
    pub status: Vec<Cia402StatusRow>,
    /// Faults and warnings by error code.
    pub fault: Vec<Cia402FaultRow>,
    /// The same of codes that have no row of their own.
    pub fault_class: Vec<Cia402FaultClassRow>,
    /// Parameters.
    pub parameter: Vec<Cia402ParameterRow>,
    /// Captures.
    pub capture: Vec<Cia402CaptureRow>,
    /// What is written and read at start.
    pub commission: Vec<Cia402CommissionRow>,
    /// Objects that no row binds, with the reason.
    pub unbound: Vec<Cia402UnboundRow>,
}

/// Objects that no other row binds.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402UnboundRow {
    /// Why.
    pub reason: Name,
    /// Their numbers, a family by the first one.
    pub objects: Vec<Name>,
}

/// How drives are of which the configuration does not say it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402DriveRow {
    /// Whether bit 12 of the statusword tells that the drive follows command values.
    pub acknowledges: bool,
    /// What bit 4 of the statusword is: `dc-link` where the drive tells by it that its power stage is supplied, `ignore` otherwise.
    pub voltage_bit: Name,
    /// The modes of operation that the drive has, whatever 6502 tells. Default: what it tells.
    pub modes: Option<Vec<Name>>,
    /// Where it comes from.
    pub source: Source,
}

/// How a unit follows from the drive's factor group.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ScalingRow {
    /// Unit as the dictionary names it.
    pub unit: Name,
    /// Generic quantity.
    pub quantity: Name,
    /// How to work out what a count is; the first whose objects the drive has, all of them above 0.
    pub methods: Vec<Cia402MethodRow>,
    /// Where it comes from.
    pub source: Source,
    /// Worked examples.
    #[serde(default)]
    pub examples: Vec<Cia402ExampleRow>,
}

/// One way to work out what a count is: base, or the count of another unit, times and over objects.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402MethodRow {
    /// What it is called.
    pub name: String,
    /// Generic units of a rotary axis to begin with.
    pub base: Option<RatioRow>,
    /// An object and the value that it has to have.
    pub when: Option<(Name, i64)>,
    /// Unit whose count to begin with instead; of a row above.
    pub like: Option<Name>,
    /// Objects that multiply it.
    #[serde(default)]
    pub times: Vec<Name>,
    /// Objects that divide it.
    #[serde(default)]
    pub over: Vec<Name>,
}

/// A worked example: what a drive with these objects gets for a generic value, and what becomes of it on the way back.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ExampleRow {
    /// What the drive holds: object and value.
    pub drive: Vec<(String, i64)>,
    /// Object whose value is converted.
    pub object: Name,
    /// The generic value.
    pub generic: Spanned<i64>,
    /// The bytes in the object.
    pub bytes: Name,
    /// The generic value on the way back.
    pub back: Spanned<i64>,
}

/// The words that lead a drive.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402WordsRow {
    /// Controlword.
    pub control: Name,
    /// Statusword.
    pub status: Name,
    /// Mode of operation that is wanted.
    pub mode: Name,
    /// Mode of operation that is shown.
    pub mode_shown: Name,
    /// Modes of operation that there are.
    pub modes_supported: Name,
    /// Which values the drive inverts.
    pub polarity: Name,
    /// Its field for the value whose sign is that of the axis.
    pub direction: Name,
    /// Where it comes from.
    pub source: Source,
}

impl Cia402WordsRow {
    /// Each key with its object.
    pub(crate) fn objects(&self) -> [(&'static str, &Name); 6] {
        [
            ("control", &self.control),
            ("status", &self.status),
            ("mode", &self.mode),
            ("mode_shown", &self.mode_shown),
            ("modes_supported", &self.modes_supported),
            ("polarity", &self.polarity),
        ]
    }
}

/// A signal and its object.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402SignalRow {
    /// Signal of the generic model.
    pub signal: Name,
    /// Object.
    pub object: Name,
    /// Modes of operation in which it is this object. Default: all that no other row of the signal names.
    #[serde(default)]
    pub modes: Vec<Name>,
    /// `to_drive` or `from_drive`.
    pub direction: Name,
    /// Field of the polarity by which the drive inverts the value. Default: it never does.
    pub polarity: Option<Name>,
    /// What happens when the drive has no such object: `refuse` or `omit`.
    pub missing: Name,
    /// Object of the encoder of the load, for axes that only look at that one. Default: none.
    pub load: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// An operating mode on CiA 402. Of several rows of one operating mode the first counts whose modes of operation the drive has.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ModeRow {
    /// Operating mode.
    pub mode: Name,
    /// Who makes the way, `controller` or `drive`. Default: the controller.
    pub interpolation: Option<Name>,
    /// What happens when the drive has none of the modes, or lacks a value: `refuse` the drive, or `omit` the mode.
    pub missing: Name,
    /// Modes of operation, the preferred one first.
    pub modes: Vec<Name>,
    /// Fields of the controlword that stand in the mode while operation is enabled. Those of other modes are 0.
    #[serde(default)]
    pub control: Vec<FieldValueRow>,
    /// How the drive takes a target over.
    pub handshake: Option<Cia402HandshakeRow>,
    /// Signals to the drive.
    pub command: Vec<Name>,
    /// Signals from the drive.
    pub actual: Vec<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// An operating mode that a drive carries out by itself, from a start to an end that it tells.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ProcedureRow {
    /// Operating mode.
    pub mode: Name,
    /// Who moves the axis: `drive`.
    pub interpolation: Name,
    /// Modes of operation, the preferred one first.
    pub modes: Vec<Name>,
    /// Fields of the controlword that start it, and stand until it has ended.
    pub start: Vec<FieldValueRow>,
    /// How far it is when it is done.
    pub done: Name,
    /// How far it is when it has failed.
    pub failed: Vec<Name>,
    /// After so many seconds it has failed as well.
    pub seconds: Spanned<u32>,
    /// Where it comes from.
    pub source: Source,
}

/// How a drive takes a target over: it is asked to, says that it has, and may then be asked again.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402HandshakeRow {
    /// Fields of the controlword that ask; the bits are the other way round before and after.
    pub ask: Vec<FieldValueRow>,
    /// Fields of the statusword that answer.
    pub taken: Vec<FieldValueRow>,
}

/// What the controlword becomes by an action.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ActionRow {
    /// Generic action.
    pub action: Name,
    /// State that the drive has to show. Default: any.
    pub when: Option<Name>,
    /// Command of the profile: its bits, and 0 in all other bits that commands have in every mode.
    pub send: Option<Name>,
    /// Fields of the controlword that are otherwise; none of both when the action leaves it alone.
    #[serde(default)]
    pub pattern: Vec<FieldValueRow>,
    /// Where it comes from.
    pub source: Source,
}

/// What a statusword says.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ReportRow {
    /// State of the drive.
    pub state: Name,
    /// Fields of the statusword beside the state.
    #[serde(default)]
    pub pattern: Vec<FieldValueRow>,
    /// Modes of operation that the drive shows. Default: any.
    #[serde(default)]
    pub modes: Vec<Name>,
    /// Whether it is for drives that tell whether they follow command values, or for those that do not. Default: both.
    pub follows: Option<bool>,
    /// Whether it is for drives that tell by bit 4 whether the power stage has its supply, or for those whose bit 4 is not looked at. Default:
    /// both.
    pub voltage: Option<bool>,
    /// Report.
    pub report: Name,
    /// Where it comes from.
    pub source: Source,
}

/// A status bit.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402StatusRow {
    /// Object with the word.
    pub object: Name,
    /// State of the drive, of the statusword.
    pub state: Option<Name>,
    /// Fields of the word.
    #[serde(default)]
    pub pattern: Vec<FieldValueRow>,
    /// As in a report.
    #[serde(default)]
    pub modes: Vec<Name>,
    /// As in a report.
    pub follows: Option<bool>,
    /// As in a report.
    pub voltage: Option<bool>,
    /// Generic status bit.
    pub status: Name,
    /// The bit in its place in a drive that inverts its positions. Default: the same.
    pub inverted: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// What error codes mean.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402FaultRow {
    /// Error codes by name.
    pub codes: Vec<Name>,
    /// Generic cause.
    pub cause: Name,
    /// Reaction, where it is not the usual one of the cause.
    pub reaction: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// What error codes of a class mean.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402FaultClassRow {
    /// Classes of error codes by name.
    pub classes: Vec<Name>,
    /// Generic cause.
    pub cause: Name,
    /// Reaction, where it is not the usual one of the cause.
    pub reaction: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A parameter and its object.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402ParameterRow {
    /// Generic parameter.
    pub parameter: Name,
    /// Object.
    pub object: Name,
    /// The object in its place in a drive that inverts its positions. Default: the same.
    pub inverted: Option<Name>,
    /// What limits both directions at once in a drive without the object: the least of the values that fall to it is written at
    /// start.
    pub common: Option<Name>,
    /// `both`, `to_drive` or `from_drive`.
    pub direction: Name,
    /// Field of the polarity by which the drive inverts the value, or `none`: of a drive that inverts its positions and not this value,
    /// or the other way round, the sign is the opposite. Default: the value has no direction, or goes with the positions.
    pub polarity: Option<Name>,
    /// What happens when the drive has no such object: `reject`, which is the default.
    pub missing: Option<Name>,
    /// Factor between parameter and object, for signs (`[-1, 1]`).
    pub factor: Option<RatioRow>,
    /// Where it comes from.
    pub source: Source,
}

/// What a drive captures: a position that a probe stores, or an input that changes from one cycle to the next.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402CaptureRow {
    /// Source of the capture.
    pub capture: Name,
    /// Its edge.
    pub edge: Name,
    /// Object with the word that says that the edge has come, or what the level is.
    pub word: Name,
    /// Its fields.
    pub pattern: Vec<FieldValueRow>,
    /// Object with the stored position; of a probe.
    pub value: Option<Name>,
    /// Object that lets the probe work; of a probe.
    pub function: Option<Name>,
    /// Its fields for the probe.
    #[serde(default)]
    pub enable: Vec<FieldValueRow>,
    /// Its fields for this edge: the others of the probe are 0 where nobody wants them.
    #[serde(default)]
    pub select: Vec<FieldValueRow>,
    /// Where it comes from.
    pub source: Source,
}

/// One step of commissioning.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cia402CommissionRow {
    /// `write`, `read`, `read_scaling`, `read_parameters`, `read_captures`, `write_cycle` or `write_mode`.
    #[serde(rename = "do")]
    pub step: Name,
    /// Object; none for the steps that know theirs.
    pub object: Option<Name>,
    /// Object with the power of ten of the cycle in seconds; `write_cycle`.
    pub exponent: Option<Name>,
    /// Value to write.
    pub value: Option<Spanned<i64>>,
    /// Parameter of the axis configuration to write, if it is given there.
    pub parameter: Option<Name>,
    /// Modes of operation of which the axis has to use one. Default: whatever it uses.
    #[serde(default)]
    pub modes: Vec<Name>,
    /// What happens when the drive refuses: `fail` or `continue`.
    pub refused: Name,
    /// Where it comes from.
    pub source: Source,
}
