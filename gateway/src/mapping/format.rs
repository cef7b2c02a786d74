//! What the table files look like: one Rust type per kind of row, nothing resolved yet.
//!
//! Every value that can be wrong keeps its place in the file ([`Spanned`]), so that an error can point at it. Names
//! of signals, IDNs, attributes and codes are plain text here; the resolvers turn them into what they name.

use serde::Deserialize;
use toml::Spanned;

/// A name that some dictionary must know.
pub type Name = Spanned<String>;

/// Where a row comes from: document and clause, or a vendor document.
pub type Source = Spanned<String>;

/// `mappings/dictionary/generic.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GenericFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `generic`.
    pub profile: Name,
    /// Values of the process image.
    pub signal: Vec<SignalRow>,
    /// Parameters outside the process image.
    pub parameter: Vec<ParameterRow>,
}

/// A signal of the generic model.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalRow {
    /// Name in snake case.
    pub name: Name,
    /// What it measures.
    pub quantity: Name,
    /// `command` or `feedback`.
    pub access: Name,
}

/// A parameter of the generic model.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterRow {
    /// Name in snake case.
    pub name: Name,
    /// What it measures.
    pub quantity: Name,
    /// `integer`, `float` or `text`.
    #[serde(rename = "type")]
    pub data_type: Name,
    /// `read`, `write` or `write_while_disabled`.
    pub access: Name,
}

/// `mappings/dictionary/cip-motion.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cip-motion`.
    pub profile: Name,
    /// Attributes of instance 0.
    pub class_attribute: Vec<AttributeRow>,
    /// Attributes of the axis instances.
    pub attribute: Vec<AttributeRow>,
    /// Enumerated codes.
    pub enumeration: Vec<EnumerationRow>,
    /// Bit fields.
    pub bits: Vec<BitsRow>,
    /// Data sets of the cyclic data block.
    pub data_set: Vec<DataSetRow>,
}

/// One attribute of the Motion Device Axis Object.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttributeRow {
    /// Attribute number.
    pub id: Spanned<u16>,
    /// Name in the standard.
    pub name: Name,
    /// CIP data type.
    #[serde(rename = "type")]
    pub data_type: Name,
    /// Elements of an array; absent for a single value.
    pub length: Option<u16>,
    /// `get`, `set` or `set_cyclic`.
    pub access: Name,
    /// Whether it may be set in the Running state.
    #[serde(default)]
    pub running: bool,
    /// `R`, `O`, `C` or `-` per device function B E F P V T; one letter for a class attribute.
    pub need: Name,
    /// Condition on the need.
    pub condition: Option<String>,
    /// Unit as the standard names it.
    pub unit: Option<Name>,
    /// Value at power-up where it is not 0.
    pub default: Option<i64>,
    /// How many channels repeat the attribute ("Feedback n ...").
    pub channels: Option<u16>,
    /// From the number of one channel to that of the next.
    pub channel_step: Option<u16>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Table of the standard.
    pub source: Source,
}

/// A set of named codes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EnumerationRow {
    /// Name of the set.
    pub name: Name,
    /// Attribute that holds such a code.
    pub attribute: Option<Name>,
    /// Where it comes from.
    pub source: Source,
    /// The codes.
    pub codes: Vec<CodeRow>,
}

/// One named code.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CodeRow {
    /// The code.
    pub code: Spanned<u32>,
    /// Its name.
    pub name: Name,
}

/// A set of named bits.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BitsRow {
    /// Name of the set.
    pub name: Name,
    /// Attribute that holds the bits.
    pub attribute: Option<Name>,
    /// How many bits the value has.
    pub width: u32,
    /// Where it comes from.
    pub source: Source,
    /// The bits.
    pub bits: Vec<BitRow>,
}

/// One named bit.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BitRow {
    /// Number of the bit, 0 first.
    pub bit: Spanned<u32>,
    /// Its name.
    pub name: Name,
    /// Device functions it applies to.
    pub rule: Option<String>,
}

/// A data set of the cyclic data block.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataSetRow {
    /// Name of the set.
    pub name: Name,
    /// Attribute that holds the bits of the set.
    pub attribute: Name,
    /// Where it comes from.
    pub source: Source,
    /// What the bits stand for.
    pub elements: Vec<ElementRow>,
}

/// One element of a data set.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ElementRow {
    /// Bit in the data set.
    pub bit: Spanned<u8>,
    /// Name of the element.
    pub name: Name,
    /// Attributes it carries.
    pub attributes: Vec<Name>,
}

/// `mappings/dictionary/sercos.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SercosFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `sercos`.
    pub profile: Name,
    /// Parameters and procedure commands.
    pub idn: Vec<IdnRow>,
    /// Words with named fields.
    pub word: Vec<WordRow>,
    /// Enumerated codes.
    pub enumeration: Vec<EnumerationRow>,
}

/// One IDN.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IdnRow {
    /// The number, as in `S-0-0047`.
    pub idn: Name,
    /// Its name.
    pub name: Name,
    /// Bytes of the value or of one list item; absent when only the drive knows.
    pub length: Option<Spanned<u8>>,
    /// Whether it is a list.
    #[serde(default)]
    pub list: bool,
    /// Display format.
    pub format: Option<Name>,
    /// Whether it is a procedure command.
    #[serde(default)]
    pub command: bool,
    /// Quantity whose scaling parameters give the unit.
    pub scaling: Option<Name>,
    /// Fixed unit.
    pub unit: Option<Name>,
    /// Digits behind the decimal point of a fixed unit.
    #[serde(default)]
    pub decimals: u8,
    /// Communication phases in which it can be written.
    pub write: Option<Vec<u8>>,
    /// Anything worth knowing.
    pub note: Option<String>,
    /// Keys of the documents.
    pub source: Source,
    /// `high`, `medium`, `low` or `none`.
    pub confidence: Name,
}

/// A word with named fields.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WordRow {
    /// Name of the word.
    pub name: Name,
    /// IDN that holds it.
    pub idn: Name,
    /// Where it comes from.
    pub source: Source,
    /// Its fields.
    pub fields: Vec<FieldRow>,
}

/// A named field of a word.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldRow {
    /// First and last bit.
    pub bits: Spanned<[u32; 2]>,
    /// Name of the field.
    pub name: Name,
}

/// A ratio `[numerator, denominator]`.
pub type RatioRow = Spanned<[i64; 2]>;

/// How a unit of a profile becomes the unit of a generic quantity.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UnitRow {
    /// Unit as the dictionary names it.
    pub unit: Name,
    /// Generic quantity.
    pub quantity: Name,
    /// Generic units in one unit of the profile.
    pub generic_per_unit: RatioRow,
    /// What multiplies the ratio: a scaling of the axis.
    pub times: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// `mappings/cip-generic.toml`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipGenericFile {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// `cip-motion to generic`.
    pub mapping: Name,
    /// Units of attributes.
    pub unit: Vec<UnitRow>,
    /// Attributes that define the scaling.
    pub scaling: CipScalingRow,
    /// What a displacement unit is.
    pub displacement_unit: Vec<DisplacementUnitRow>,
    /// Cyclic elements and signals.
    pub cyclic: Vec<CyclicRow>,
    /// Control modes.
    pub mode: Vec<CipModeRow>,
    /// Axis control requests.
    pub request: Vec<RequestRow>,
    /// What the device asks of a drive.
    pub drive_action: Vec<DriveActionRow>,
    /// Drive states.
    pub state: Vec<CipStateRow>,
    /// Status bits.
    pub status: Vec<StatusRow>,
    /// Faults.
    pub fault: Vec<CipFaultRow>,
    /// Reactions to faults.
    pub reaction: Vec<ReactionRow>,
    /// Inhibits.
    pub inhibit: Vec<InhibitRow>,
    /// Stopping actions.
    pub stopping: Vec<StoppingRow>,
    /// Attributes.
    pub attribute: Vec<CipAttributeRow>,
}

/// Which attributes define what a count is.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipScalingRow {
    /// Attribute that chooses who scales.
    pub configuration: Name,
    /// Code of that attribute that means the device scales.
    pub drive_scaling: Name,
    /// Drive scaling: attribute with the displacement unit.
    pub unit: Name,
    /// Drive scaling: attribute with the counts in a unit.
    pub resolution: Name,
    /// Attribute that turns the direction.
    pub polarity: Name,
    /// Code of that attribute that turns it.
    pub inverted: Name,
    /// Attribute that makes the axis cyclic.
    pub unwind: Name,
    /// Attribute with the counts of one cycle.
    pub unwind_position: Name,
    /// Control scaling: attribute with the displacement unit.
    pub feedback_unit: Name,
    /// Control scaling: attributes whose product is the counts in a unit.
    pub feedback_resolution: Vec<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// What a displacement unit is in the generic model.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DisplacementUnitRow {
    /// Enumeration that names the unit.
    pub enumeration: Name,
    /// Code in the enumeration.
    pub code: Name,
    /// `rotary` or `linear`.
    pub kind: Name,
    /// Nanounits in one.
    pub nanounits: Spanned<i64>,
    /// Where it comes from.
    pub source: Source,
}

/// A cyclic element and its signal.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CyclicRow {
    /// Data set.
    pub set: Name,
    /// Element of the set.
    pub element: Name,
    /// Signal of the generic model.
    pub signal: Name,
    /// `to_generic` or `from_generic`.
    pub direction: Name,
    /// Whether the value is a position that wraps: at the range of the type, or at the unwind position.
    #[serde(default)]
    pub wraps: bool,
    /// What happens when the value is not there.
    pub missing: Name,
    /// Where it comes from.
    pub source: Source,
    /// Worked examples.
    #[serde(default)]
    pub examples: Vec<CipExampleRow>,
}

/// A worked example of a cyclic element or attribute.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipExampleRow {
    /// Code of the displacement unit, where it matters.
    pub displacement_unit: Option<Name>,
    /// Counts in a displacement unit, where it matters.
    pub resolution: Option<i64>,
    /// Whether the direction is turned.
    #[serde(default)]
    pub inverted: bool,
    /// CIP data type, where the element has several.
    #[serde(rename = "type")]
    pub data_type: Option<Name>,
    /// The value in CIP's unit.
    pub value: Spanned<Number>,
    /// The bytes on the wire.
    pub bytes: Name,
    /// The generic value.
    pub generic: Spanned<i64>,
    /// The value on the way back, where rounding changes it.
    pub back: Option<Number>,
}

/// An integer or a floating point number.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Number {
    /// An integer.
    Integer(i64),
    /// A floating point number.
    Float(f64),
}

/// A control mode and its operating mode.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipModeRow {
    /// Control mode.
    pub control_mode: Name,
    /// Operating mode.
    pub mode: Name,
    /// Where it comes from.
    pub source: Source,
}

/// An Axis Control request and the generic request it makes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RequestRow {
    /// Axis Control code.
    pub axis_control: Name,
    /// Generic request; absent when the device carries it out without the drive.
    pub request: Option<Name>,
    /// Axis Response code of success.
    pub axis_response: Name,
    /// Where it comes from.
    pub source: Source,
}

/// What the device asks of a drive and the generic request it makes.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveActionRow {
    /// `none`, `power_up`, `enable`, `disable`, `shutdown` or `abort`.
    pub drive_action: Name,
    /// Generic request; absent when it asks for nothing.
    pub request: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A drive state and what it means to the axis state machine.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipStateRow {
    /// Drive state.
    pub state: Name,
    /// Axis State it corresponds to when nothing else is going on.
    pub axis_state: Name,
    /// Conditions of the axis state machine that hold.
    pub conditions: Vec<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// Generic status bits and the Axis Status bit they make.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusRow {
    /// Status bits that must all be set.
    pub status: Vec<Name>,
    /// Operating mode that must be active as well.
    pub mode: Option<Name>,
    /// Axis Status bit.
    pub axis_status: Name,
    /// Where it comes from.
    pub source: Source,
}

/// A fault cause and how CIP reports it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipFaultRow {
    /// Generic cause.
    pub cause: Name,
    /// Standard axis exception.
    pub exception: Option<Name>,
    /// Bit of Axis Exceptions - Mfg.
    pub manufacturer: Option<Spanned<u32>>,
    /// Node fault code.
    pub node_fault: Option<Name>,
    /// Standard initialization fault.
    pub initialization: Option<Name>,
    /// Standard fault of the absolute position recovery.
    pub apr: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A reaction and the Axis Fault Action it is reported as.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReactionRow {
    /// Generic reaction.
    pub reaction: Name,
    /// How the axis stops.
    pub stop: Name,
    /// What state the power structure ends in.
    pub state_change: Name,
    /// Where it comes from.
    pub source: Source,
}

/// An inhibit and its start inhibit.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InhibitRow {
    /// Generic inhibit.
    pub inhibit: Name,
    /// Standard start inhibit.
    pub start_inhibit: Option<Name>,
    /// Bit of Start Inhibits - Mfg.
    pub manufacturer: Option<Spanned<u32>>,
    /// Where it comes from.
    pub source: Source,
}

/// A stopping action and what the generic model does for it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoppingRow {
    /// Stopping Action code.
    pub stopping_action: Name,
    /// Generic action.
    pub action: Name,
    /// Whether the axis is held with torque at the end.
    pub holds: bool,
    /// Where it comes from.
    pub source: Source,
}

/// An attribute and what stands behind it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CipAttributeRow {
    /// The attribute.
    pub attribute: Name,
    /// Generic parameter behind it.
    pub parameter: Option<Name>,
    /// Signal behind it.
    pub signal: Option<Name>,
    /// Who serves it otherwise: `device`, `connection`, `shadow` or `constant`.
    pub served_by: Option<Name>,
    /// Value of a constant.
    pub value: Option<i64>,
    /// What happens when the drive has no such parameter: `shadow` or `reject`.
    pub missing: Option<Name>,
    /// Where it comes from.
    pub source: Source,
    /// Worked examples.
    #[serde(default)]
    pub examples: Vec<CipExampleRow>,
}

/// `mappings/generic-sercos.toml`.
#[derive(Debug, Clone, Deserialize)]
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
    /// The control and the status word.
    pub words: WordsRow,
    /// Signals.
    pub signal: Vec<SercosSignalRow>,
    /// Operating modes.
    pub mode: Vec<SercosModeRow>,
    /// Places where the drive keeps its operation modes.
    pub mode_slot: Vec<ModeSlotRow>,
    /// Control word of each action.
    pub action: Vec<ActionRow>,
    /// What a status word says.
    pub report: Vec<ReportRow>,
    /// Status bits in the status word.
    pub status: Vec<SercosStatusRow>,
    /// Faults and warnings in the diagnostic words.
    pub fault: Vec<SercosFaultRow>,
    /// Parameters.
    pub parameter: Vec<SercosParameterRow>,
    /// What is written and read at start.
    pub commission: Vec<CommissionRow>,
}

/// The words that every telegram begins with.
#[derive(Debug, Clone, Deserialize)]
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
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldValueRow {
    /// Name of the field.
    pub field: Name,
    /// Its value.
    pub is: Spanned<u32>,
}

/// How the unit of a quantity follows from the drive's scaling parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SercosScalingRow {
    /// The `scaling` of the dictionary rows it applies to.
    pub scaling: Name,
    /// IDN with the scaling type.
    pub word: Name,
    /// Where the scaling type says that the values refer to the load, and what lies between motor and load.
    pub load: Option<LoadRow>,
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
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadRow {
    /// Mask and value in the scaling type.
    pub pattern: [u32; 2],
    /// IDNs with the turns of the motor and the turns of the load that belong to them.
    pub gear: [Name; 2],
}

/// Modulo processing.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModuloRow {
    /// Mask and value in the scaling type.
    pub pattern: [u32; 2],
    /// IDN with the range, in the unit of the scaling.
    pub range: Name,
}

/// One scaling type.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalingMethodRow {
    /// Mask and value in the scaling type.
    pub pattern: [u32; 2],
    /// What it is called.
    pub name: String,
    /// `rotary`, `linear`, or absent when either will do.
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
}

/// A worked example of a scaling.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScalingExampleRow {
    /// `rotary` or `linear`.
    pub kind: Name,
    /// What the drive holds: IDN and value.
    pub drive: Vec<(String, i64)>,
    /// Rated torque in micro newton metre, where it matters.
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
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SercosSignalRow {
    /// Signal of the generic model.
    pub signal: Name,
    /// IDN.
    pub idn: Name,
    /// `to_drive` or `from_drive`.
    pub direction: Name,
    /// What happens when the drive has no such IDN: `refuse` or `omit`.
    pub missing: Name,
    /// Where it comes from.
    pub source: Source,
}

/// An operating mode on SERCOS.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SercosModeRow {
    /// Operating mode.
    pub mode: Name,
    /// Feedback that closes the position loop: `motor` or `load`.
    pub feedback: Option<Name>,
    /// Operation mode codes, the preferred one first.
    pub codes: Vec<Name>,
    /// Signals in the master's telegram.
    pub command: Vec<Name>,
    /// Signals in the drive's telegram.
    pub actual: Vec<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A place where the drive keeps an operation mode.
#[derive(Debug, Clone, Deserialize)]
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
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActionRow {
    /// Generic action.
    pub action: Name,
    /// Fields of the control word; none when the action leaves it alone.
    pub pattern: Vec<FieldValueRow>,
    /// Procedure command that belongs to the action.
    pub command: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// What a status word says.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportRow {
    /// Fields of the status word.
    pub pattern: Vec<FieldValueRow>,
    /// Report.
    pub report: Name,
    /// Where it comes from.
    pub source: Source,
}

/// A status bit in a word.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SercosStatusRow {
    /// Word.
    pub word: Name,
    /// Fields of the word.
    pub pattern: Vec<FieldValueRow>,
    /// Generic status bit.
    pub status: Name,
    /// Where it comes from.
    pub source: Source,
}

/// A fault or warning in a diagnostic word.
#[derive(Debug, Clone, Deserialize)]
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

/// A parameter and its IDN.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SercosParameterRow {
    /// Generic parameter.
    pub parameter: Name,
    /// IDN.
    pub idn: Name,
    /// `both`, `to_drive` or `from_drive`.
    pub direction: Name,
    /// What happens when the drive has no such IDN: `shadow` or `reject`.
    pub missing: Name,
    /// Factor between parameter and IDN, for signs (`[-1, 1]`) and reciprocals of units.
    pub factor: Option<RatioRow>,
    /// Where it comes from.
    pub source: Source,
    /// Worked examples.
    #[serde(default)]
    pub examples: Vec<ScalingExampleRow>,
}

/// One step of commissioning.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommissionRow {
    /// Communication phase, 2 to 4.
    pub phase: Spanned<u8>,
    /// `write`, `read`, `command`, `read_scaling`, `read_telegram` or `write_modes`.
    #[serde(rename = "do")]
    pub step: Name,
    /// IDN; none for the steps that know theirs.
    pub idn: Option<Name>,
    /// Elements to read: `attribute` and `data`.
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
#[derive(Debug, Clone, Deserialize)]
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
}
