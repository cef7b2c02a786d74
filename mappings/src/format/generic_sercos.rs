//! Rows of the mapping between the generic model and SERCOS.

use std::fmt;

use schemars::JsonSchema;
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer};

use crate::finding::Spanned;

use super::{Name, RatioRow, Source, UnitRow};

/// `mappings/tables/generic-sercos.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GenericSercosFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `generic to sercos`.
    pub mapping: Name,
    /// Fixed units of IDNs.
    pub unit: Vec<UnitRow>,
    /// Units that the drive's scaling parameters define.
    pub scaling: Vec<SercosScalingRow>,
    /// Which way is forward.
    pub direction: DirectionRow,
    /// The control and the status word.
    pub words: WordsRow,
    /// Signals.
    pub signal: Vec<SercosSignalRow>,
    /// Operating modes.
    pub mode: Vec<SercosModeRow>,
    /// Places where the drive keeps its operation modes.
    pub mode_slot: Vec<ModeSlotRow>,
    /// The drive's list of its operation modes.
    pub supported_modes: SupportedModesRow,
    /// Modes that a drive has as procedure commands.
    pub procedure: Vec<ProcedureRow>,
    /// Control word of each action.
    pub action: Vec<ActionRow>,
    /// What a status word says.
    pub report: Vec<ReportRow>,
    /// Status bits in the status word and in other words of the drive's telegram.
    pub status: Vec<SercosStatusRow>,
    /// Faults and warnings in the diagnostic words.
    pub fault: Vec<SercosFaultRow>,
    /// The diagnostic message that the drive has for them.
    pub diagnosis: DiagnosisRow,
    /// Parameters.
    pub parameter: Vec<SercosParameterRow>,
    /// Which values a telegram may carry.
    pub configurable_data: ConfigurableDataRow,
    /// Captures.
    pub capture: Vec<SercosCaptureRow>,
    /// What is written and read at start.
    pub commission: Vec<CommissionRow>,
    /// What none of them binds.
    pub unbound: Vec<UnboundRow>,
}

/// IDNs of the drive profile that no other row binds.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnboundRow {
    /// Why.
    pub reason: Name,
    /// The IDNs.
    pub idns: Vec<Name>,
}

/// The drive's list of its operation modes.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SupportedModesRow {
    /// The list.
    pub list: Name,
    /// Where it comes from.
    pub source: Source,
}

/// The drive's lists of the values that it takes in telegrams.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConfigurableDataRow {
    /// List for the drive's telegram.
    pub producer: Name,
    /// List for the master's telegram.
    pub consumer: Name,
    /// Where it comes from.
    pub source: Source,
}

/// How a drive captures.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosCaptureRow {
    /// Source of the capture.
    pub capture: Name,
    /// Its edge.
    pub edge: Name,
    /// `latch`, `counter`, `input` or `sequence`.
    pub by: Name,
    /// IDN with the position; latch and counter.
    pub value: Option<Name>,
    /// Word that says that the edge has come, or what the level is; latch and input.
    pub word: Option<Name>,
    /// Its fields.
    #[serde(default)]
    pub pattern: Vec<FieldValueRow>,
    /// IDN that counts the edges; counter.
    pub counter: Option<Name>,
    /// IDN that lets the edge through; latch.
    pub enable: Option<Name>,
    /// Procedure command that has to be in process; latch.
    pub command: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// The words that every telegram begins with.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WordsRow {
    /// Control word.
    pub control: Name,
    /// Status word.
    pub status: Name,
    /// Field of the control word that selects the operation mode.
    pub mode_control: Name,
    /// Field of the status word that reports the operation mode.
    pub mode_status: Name,
    /// Where it comes from.
    pub source: Source,
}

/// A field that has a value.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldValueRow {
    /// Name of the field.
    pub field: Name,
    /// Its value, or the name that the dictionary has for it.
    pub is: Spanned<FieldIs>,
}

/// `Ready to operate = 3`.
impl fmt::Display for FieldValueRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let field = self.field.get_ref();
        match self.is.get_ref() {
            FieldIs::Number(number) => write!(f, "{field} = {number}"),
            FieldIs::Name(word) => write!(f, "{field} = {word}"),
        }
    }
}

/// The value of a field.
#[derive(Debug, Clone, JsonSchema)]
#[serde(untagged)]
pub enum FieldIs {
    /// A number.
    Number(u32),
    /// The name of one.
    Name(String),
}

impl<'de> Deserialize<'de> for FieldIs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl Visitor<'_> for Either {
            type Value = FieldIs;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("u32 or the name of a value")
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<FieldIs, E> {
                let number = u32::try_from(value);
                number
                    .map(FieldIs::Number)
                    .map_err(|_| E::invalid_value(de::Unexpected::Signed(value), &self))
            }
            fn visit_str<E: de::Error>(self, value: &str) -> Result<FieldIs, E> {
                Ok(FieldIs::Name(value.to_owned()))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// A bit of a polarity parameter.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolarityRow {
    /// The parameter.
    pub idn: Name,
    /// The bit: 1 is inverted.
    pub bit: Spanned<u32>,
}

/// The value whose sign is that of the axis.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionRow {
    /// Its polarity.
    pub polarity: PolarityRow,
    /// Where it comes from.
    pub source: Source,
}

/// How the unit of a quantity follows from the drive's scaling parameters.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosScalingRow {
    /// The `scaling` of the dictionary rows it applies to.
    pub scaling: Name,
    /// IDN with the scaling type.
    pub word: Name,
    /// Where the scaling type says that the values refer to the load, and what lies between motor and load.
    pub load: Option<LoadRow>,
    /// IDN with the way that the load makes in one turn, where turns and ways are to be converted to each other.
    pub feed: Option<Name>,
    /// Whether only the exact ratio will do; else the nearest one that 64 bits hold.
    #[serde(default)]
    pub exact: bool,
    /// Bits of the scaling type that say that positions wrap, and the IDN with the range.
    pub modulo: Option<ModuloRow>,
    /// What the scaling types mean; the first that matches wins.
    pub methods: Vec<ScalingMethodRow>,
    /// Where it comes from.
    pub source: Source,
    /// Worked examples.
    #[serde(default)]
    pub examples: Vec<ScalingExampleRow>,
}

/// Values that refer to the load.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadRow {
    /// Mask and value in the scaling type.
    pub pattern: [u32; 2],
    /// IDNs with the turns of the motor and the turns of the load that belong to them.
    pub gear: [Name; 2],
    /// The shaft that the generic quantity refers to, `load` or `motor`. Default: that of the axis.
    pub generic: Option<Name>,
}

/// Modulo processing.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModuloRow {
    /// Mask and value in the scaling type.
    pub pattern: [u32; 2],
    /// IDN with the range, in the unit of the scaling.
    pub range: Name,
    /// IDN that changes the range in a way that nobody has told: only 1 will do.
    pub divider: Option<Name>,
}

/// One scaling type.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScalingMethodRow {
    /// Mask and value in the scaling type.
    pub pattern: [u32; 2],
    /// What it is called.
    pub name: String,
    /// What the data measure, `rotary` or `linear`; absent where they measure neither, so that no gear lies between.
    pub kind: Option<Name>,
    /// Generic quantity of the base unit.
    pub quantity: Name,
    /// Generic units in one base unit.
    pub base: RatioRow,
    /// Power of ten: LSB = base * factor * 10^exponent / divisor.
    pub exponent: Option<i32>,
    /// IDN with the exponent.
    pub exponent_idn: Option<Name>,
    /// IDN with the factor.
    pub factor_idn: Option<Name>,
    /// Divisor.
    pub divisor: Option<i64>,
    /// IDN with the divisor.
    pub divisor_idn: Option<Name>,
    /// Counts at zero of the generic quantity. Default: 0.
    pub zero: Option<i64>,
    /// What the drive must hold where it has the IDN: a preferential scaling shows the factors it works with.
    #[serde(default)]
    pub expect: Vec<(Name, i64)>,
}

/// A worked example of a scaling.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScalingExampleRow {
    /// `rotary` or `linear`.
    pub kind: Name,
    /// What the drive holds: IDN and value.
    pub drive: Vec<(String, i64)>,
    /// Rated torque in micro newton metre, or rated force in micro newton, by the kind; where it matters.
    pub rated: Option<i64>,
    /// IDN whose value is converted.
    pub idn: Name,
    /// The generic value.
    pub generic: Spanned<i64>,
    /// The bytes in the telegram.
    pub bytes: Name,
    /// The generic value on the way back.
    pub back: Spanned<i64>,
}

/// A signal and its IDN.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosSignalRow {
    /// Signal of the generic model.
    pub signal: Name,
    /// IDN.
    pub idn: Name,
    /// `to_drive` or `from_drive`.
    pub direction: Name,
    /// What happens when the drive has no such IDN, or does not put it into telegrams: `refuse` or `omit`.
    pub missing: Name,
    /// The bit by which the drive inverts the value.
    pub polarity: Option<PolarityRow>,
    /// The same value by the encoder of the load, for axes that go by that one.
    pub load: Option<LoadSignalRow>,
    /// Where it comes from.
    pub source: Source,
}

/// A signal by the encoder of the load.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadSignalRow {
    /// IDN.
    pub idn: Name,
    /// The bit by which the drive inverts the value.
    pub polarity: Option<PolarityRow>,
}

/// An operating mode on SERCOS.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosModeRow {
    /// Operating mode.
    pub mode: Name,
    /// Who makes the way, `controller` (default) or `drive`.
    pub interpolation: Option<Name>,
    /// What happens when the drive has none of the codes, or lacks a value of the mode: `refuse` the drive, or `omit` the
    /// mode.
    pub missing: Name,
    /// Operation mode codes, the preferred one first.
    pub codes: Vec<Name>,
    /// The same for axes whose position is that of the encoder of the load. Default: `codes`.
    #[serde(default)]
    pub load_codes: Vec<Name>,
    /// Signals in the master's telegram.
    pub command: Vec<Name>,
    /// Signals in the drive's telegram.
    pub actual: Vec<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// An operating mode that is no operation mode of the drive but a sequence of procedure commands. Each is executed after
/// the one before is done; then all are cancelled, the last one first. Whatever fails cancels those before it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProcedureRow {
    /// Operating mode.
    pub mode: Name,
    /// Who makes the way, `controller` or `drive`.
    pub interpolation: Name,
    /// Operating mode in which the controller moves the axis while the first command is in process; before the others the
    /// axis has to stand. Absent where the drive moves it.
    pub led_in: Option<Name>,
    /// The procedure commands.
    pub commands: Vec<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A place where the drive keeps an operation mode.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModeSlotRow {
    /// Value of the mode fields of control and status word.
    pub slot: Spanned<u32>,
    /// IDN that holds the code.
    pub idn: Name,
    /// Where it comes from.
    pub source: Source,
}

/// What the control word becomes by an action.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ActionRow {
    /// Generic action.
    pub action: Name,
    /// Named value of the control word, by the dictionary.
    pub send: Option<Name>,
    /// Fields of the control word besides; none of both when the action leaves it alone.
    #[serde(default)]
    pub pattern: Vec<FieldValueRow>,
    /// Procedure command that belongs to the action.
    pub command: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// What a status word says.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReportRow {
    /// Fields of the status word.
    pub pattern: Vec<FieldValueRow>,
    /// Report.
    pub report: Name,
    /// Whether it is for drives that acknowledge (follow command values, halt), or for those that do not. Default: both.
    pub acknowledges: Option<bool>,
    /// Whether it is for the time in which the drive carries out a procedure, or for all other. Default: both.
    pub procedure: Option<bool>,
    /// Where it comes from.
    pub source: Source,
}

/// A status bit in a word.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosStatusRow {
    /// Word.
    pub word: Name,
    /// Fields of the word.
    pub pattern: Vec<FieldValueRow>,
    /// Generic status bit.
    pub status: Name,
    /// As in a report.
    pub acknowledges: Option<bool>,
    /// Where it comes from.
    pub source: Source,
}

/// A fault or warning in a diagnostic word.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosFaultRow {
    /// Word.
    pub word: Name,
    /// Fields of the word.
    pub pattern: Vec<FieldValueRow>,
    /// Generic cause.
    pub cause: Name,
    /// Reaction, where it is not the usual one of the cause.
    pub reaction: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// Where a drive has its diagnostic message.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiagnosisRow {
    /// IDN of the text.
    pub text: Name,
    /// IDN of the number.
    pub number: Name,
    /// Where it comes from.
    pub source: Source,
}

/// A parameter and its IDN.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosParameterRow {
    /// Generic parameter.
    pub parameter: Name,
    /// IDN.
    pub idn: Name,
    /// `both`, `to_drive` or `from_drive`.
    pub direction: Name,
    /// What happens when the drive has no such IDN: `reject`, which is the default.
    pub missing: Option<Name>,
    /// Factor between parameter and IDN, for signs (`[-1, 1]`) and reciprocals of units.
    pub factor: Option<RatioRow>,
    /// No source reports the unit: the drive's element 4 does, or the parameter is missing.
    #[serde(default)]
    pub unit_by_drive: bool,
    /// The operation mode in which the drive goes by it. A drive that works in another one of the same `[[mode]]` row has no such
    /// parameter.
    pub acts_in: Option<Name>,
    /// Where it comes from.
    pub source: Source,
    /// Worked examples.
    #[serde(default)]
    pub examples: Vec<ScalingExampleRow>,
}

/// One step of commissioning.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommissionRow {
    /// Communication phase, 2 to 4.
    pub phase: Spanned<u8>,
    /// `write`, `read`, `command`, `read_scaling`, `read_telegram`, `read_parameters`, `read_captures`, `read_procedures`
    /// or `write_modes`.
    #[serde(rename = "do")]
    pub step: Name,
    /// IDN; none for the steps that know theirs.
    pub idn: Option<Name>,
    /// Elements to read: `attribute`, `unit`, `minimum`, `maximum`, `data`. Default: all of them.
    pub elements: Option<Vec<Name>>,
    /// Value to write.
    pub value: Option<Spanned<i64>>,
    /// Parameter of the axis configuration to write, if it is given there.
    pub parameter: Option<Name>,
    /// When the step applies.
    pub when: Option<WhenRow>,
    /// What happens when the drive refuses: `fail` or `continue`.
    pub refused: Name,
    /// Where it comes from.
    pub source: Source,
}

/// When a step of commissioning applies: all that is given must hold.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WhenRow {
    /// `rotary` or `linear`.
    pub kind: Option<Name>,
    /// Whether positions wrap.
    pub modulo: Option<bool>,
    /// Whether the gateway sets the drive's scaling.
    pub set_scaling: Option<bool>,
    /// An operating mode that must be configured.
    pub mode: Option<Name>,
    /// Whether the axis is to capture events.
    pub captures: Option<bool>,
}
