//! Rows of the mapping between CIP Motion and the generic model.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

use super::{Name, Source, UnitRow};

/// `mappings/tables/cip-generic.toml`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
    /// Feedback modes that an axis can be enabled with.
    pub feedback_mode: Vec<FeedbackModeRow>,
    /// Axis control requests.
    pub request: Vec<RequestRow>,
    /// What the device asks of a drive.
    pub drive_action: Vec<DriveActionRow>,
    /// Drive states.
    pub state: Vec<CipStateRow>,
    /// Status bits.
    pub status: Vec<StatusRow>,
    /// Inputs and outputs.
    pub io_status: Vec<IoStatusRow>,
    /// Faults.
    pub fault: Vec<CipFaultRow>,
    /// Reactions to faults.
    pub reaction: Vec<ReactionRow>,
    /// Inhibits.
    pub inhibit: Vec<InhibitRow>,
    /// Stopping actions.
    pub stopping: Vec<StoppingRow>,
    /// Attributes of the start and stop sequences.
    pub sequence: SequenceRow,
    /// Attributes of what lies between motor and load.
    pub mechanics: MechanicsRow,
    /// Events.
    pub event: Vec<CipEventRow>,
    /// What an event is told as that cannot be found.
    pub capture_status: Vec<CaptureStatusRow>,
    /// Attributes.
    pub attribute: Vec<CipAttributeRow>,
    /// Attributes that are not served.
    pub reject: Vec<RejectRow>,
    /// Exceptions that nobody finds.
    pub unraised: Vec<UnraisedRow>,
}

/// An event and what brings it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipEventRow {
    /// Code of Event Type.
    pub event: Name,
    /// Bit of Event Checking Control.
    pub checking: Name,
    /// Source of the capture that the drive does.
    pub capture: Option<Name>,
    /// Edge of that source.
    pub edge: Option<Name>,
    /// Signal from which the device evaluates the event itself.
    pub signal: Option<Name>,
    /// Unit in which the event wants the signal, where it is not the controller's count.
    pub unit: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// How a capture ended, and the Event Status that says so.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CaptureStatusRow {
    /// How the capture ended.
    pub status: Name,
    /// Event Status.
    pub event_status: u8,
    /// Where it comes from.
    pub source: Source,
}

/// Which attributes define what a count is.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Number {
    /// An integer.
    Integer(i64),
    /// A floating point number.
    Float(f64),
}

/// A control mode and its operating mode.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipModeRow {
    /// Control mode.
    pub control_mode: Name,
    /// Operating mode.
    pub mode: Name,
    /// Where it comes from.
    pub source: Source,
}

/// A feedback mode that an axis can be enabled with.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeedbackModeRow {
    /// Feedback mode.
    pub feedback_mode: Name,
    /// Axes that can be enabled with it, by the encoders that they go by: `motor`, `load` or `dual`.
    pub feedback: Name,
    /// Where it comes from.
    pub source: Source,
}

/// An Axis Control request and the generic request it makes.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriveActionRow {
    /// `none`, `power_up`, `enable`, `test`, `disable`, `shutdown` or `abort`.
    pub drive_action: Name,
    /// Generic request; absent when it asks for nothing.
    pub request: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A drive state and what it means to the axis state machine.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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

/// A bit of Axis I/O Status and the status bits that it follows from.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IoStatusRow {
    /// Generic status bits that must all be set.
    pub status: Vec<Name>,
    /// Generic status bits none of which may be set.
    #[serde(default)]
    pub without: Vec<Name>,
    /// Axis I/O Status bit.
    pub io_status: Name,
    /// The bit in its place for a controller that has inverted Motion Polarity. Default: the same.
    pub inverted: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A fault cause and how CIP reports it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
    /// Whether the code stands for other causes too, and that is meant.
    #[serde(default)]
    pub shared: bool,
    /// Who finds an exception besides the drive: `box` or `device`.
    pub found_by: Option<Name>,
    /// The least severe action that may be set for an exception; Major Fault where it is absent.
    pub least: Option<Name>,
    /// The action until another is set; Major Fault where it is absent.
    pub default: Option<Name>,
    /// The cause as which it is told a controller that has inverted Motion Polarity. Default: the same.
    pub inverted: Option<Name>,
    /// Where it comes from.
    pub source: Source,
}

/// A reaction and the Axis Fault Action it is reported as.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StoppingRow {
    /// Stopping Action code.
    pub stopping_action: Name,
    /// How the axis is brought to rest: `coast`, `decelerate` or `ramp`.
    pub method: Name,
    /// Whether the axis is held with torque at the end.
    pub holds: bool,
    /// Reaction to an Abort request.
    pub abort: Name,
    /// Where it comes from.
    pub source: Source,
}

/// The attributes that say how the start and stop sequences run.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SequenceRow {
    /// Chooses a `[[stopping]]` row.
    pub stopping_action: Name,
    /// Longest time to zero speed with torque.
    pub stopping_time_limit: Name,
    /// Longest time to zero speed without.
    pub coasting_time_limit: Name,
    /// From torque to the first command that is followed.
    pub brake_release_delay: Name,
    /// From rest to the end of the torque.
    pub brake_engage_delay: Name,
    /// Speed of an axis that stands.
    pub zero_speed: Name,
    /// How long it has to be so slow.
    pub zero_speed_time: Name,
    /// Highest velocity forward of the ramp generator.
    pub ramp_velocity_positive: Name,
    /// Highest velocity backward of it.
    pub ramp_velocity_negative: Name,
    /// Its acceleration.
    pub ramp_acceleration: Name,
    /// Its deceleration, and that of a ramped stop.
    pub ramp_deceleration: Name,
    /// The same where that was not set.
    pub deceleration_limit: Name,
    /// Whether an axis may be started while it moves.
    pub flying_start: Name,
    /// Whether a limit switch stops it.
    pub overtravel_checking: Name,
    /// Where it comes from.
    pub source: Source,
}

impl SequenceRow {
    /// Each key with its attribute.
    pub(crate) fn attributes(&self) -> [(&'static str, &Name); 14] {
        let Self {
            stopping_action,
            stopping_time_limit,
            coasting_time_limit,
            brake_release_delay,
            brake_engage_delay,
            zero_speed,
            zero_speed_time,
            ramp_velocity_positive,
            ramp_velocity_negative,
            ramp_acceleration,
            ramp_deceleration,
            deceleration_limit,
            flying_start,
            overtravel_checking,
            source: _,
        } = self;
        [
            ("stopping_action", stopping_action),
            ("stopping_time_limit", stopping_time_limit),
            ("coasting_time_limit", coasting_time_limit),
            ("brake_release_delay", brake_release_delay),
            ("brake_engage_delay", brake_engage_delay),
            ("zero_speed", zero_speed),
            ("zero_speed_time", zero_speed_time),
            ("ramp_velocity_positive", ramp_velocity_positive),
            ("ramp_velocity_negative", ramp_velocity_negative),
            ("ramp_acceleration", ramp_acceleration),
            ("ramp_deceleration", ramp_deceleration),
            ("deceleration_limit", deceleration_limit),
            ("flying_start", flying_start),
            ("overtravel_checking", overtravel_checking),
        ]
    }
}

/// The attributes of what lies between motor and load. They can be set to what the scaling of the drive comes to, and to nothing else.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MechanicsRow {
    /// Kind of the load.
    pub load_type: Name,
    /// Its code for a shaft that turns with the motor.
    pub direct_rotary: Name,
    /// Its code for a shaft behind a gear.
    pub rotary_transmission: Name,
    /// Its code for a load that a turning motor moves along a line.
    pub linear_actuator: Name,
    /// Kind of the actuator that does that.
    pub actuator_type: Name,
    /// Its code for none.
    pub no_actuator: Name,
    /// Its code until the controller sets another one that is an actuator too.
    pub actuator: Name,
    /// Travel of the load in a turn of the shaft, millimetre.
    pub lead: Name,
    /// Diameter of a wheel with that circumference, millimetre.
    pub diameter: Name,
    /// Revolutions of the encoder of the motor in a unit of that of the load.
    pub unit_ratio: Name,
    /// Where it comes from.
    pub source: Source,
}

/// Standard exceptions that neither the box nor a drive finds, and why.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnraisedRow {
    /// Why.
    pub reason: Name,
    /// The exceptions.
    pub exceptions: Vec<Name>,
}

/// Attributes that the device does not have, and why.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RejectRow {
    /// Why.
    pub reason: Name,
    /// The attributes; "Feedback n" by the channel.
    pub attributes: Vec<Name>,
}

/// An attribute and what stands behind it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CipAttributeRow {
    /// The attribute.
    pub attribute: Name,
    /// Generic parameter behind it. With a `signal` as well, it is read while the signal has no value.
    pub parameter: Option<Name>,
    /// Signal behind it.
    pub signal: Option<Name>,
    /// Who serves it otherwise: `device`, `connection`, `constant` (it can only be set to what it is), `mechanics` (of that section) or
    /// `stored` (without effect).
    pub served_by: Option<Name>,
    /// Value of a constant.
    pub value: Option<i64>,
    /// What the attribute is of a drive without the parameter: `reject` (not supported, the default), `device` (the gateway goes by the
    /// value itself), `zero` (the loops of the drive have no such term: it can be set to 0 only) or `stored` (without effect).
    pub missing: Option<Name>,
    /// Least and greatest value that may be set; others are refused.
    pub range: Option<[i64; 2]>,
    /// Names of codes that it cannot be set to, of those that it has.
    #[serde(default)]
    pub without: Vec<Name>,
    /// Where it comes from.
    pub source: Source,
    /// Worked examples.
    #[serde(default)]
    pub examples: Vec<CipExampleRow>,
}
