//! CIP Motion <-> generic: the mapping file with every name resolved.

mod builder;

use profile_cip::device::drive_link::DriveAction;
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::Parameter;
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;
use profile_generic::state::{DriveState, Request};

use super::cip_events::EventTables;
use super::compile_cip::{
    CipFault, CipRequest, CipState, CipStopping, InhibitRule, IoStatusRule, MissingValue, StatusRule,
};
use super::device_link::DRIVE_ACTIONS;
use super::dictionary::{CipAttribute, CipType};
use super::feedback::FeedbackUse;
use super::mechanics::MechanicalFact;

/// What multiplies the ratio of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Times {
    /// Nothing.
    One,
    /// Nanounits in a count of the controller.
    MotionCount,
    /// Nanounits in a displacement unit of the controller.
    MotionUnit,
    /// Nanounits in a count of an encoder.
    FeedbackCount,
    /// Nanounits in the unit of an encoder.
    FeedbackUnit,
}

/// An encoder of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FeedbackChannel {
    /// At the motor.
    One,
    /// At the load.
    Two,
}

impl FeedbackChannel {
    /// The first attribute of channel 1, and how many a channel has (clause 5-2.3.5).
    const FIRST: u16 = 1400;
    const EACH: u16 = 50;

    /// The channel of an attribute; `None` of one that describes no encoder, or one that an axis does not have here.
    #[must_use]
    pub const fn of(attribute: u16) -> Option<Self> {
        match attribute.saturating_sub(Self::FIRST) / Self::EACH {
            0 if attribute >= Self::FIRST => Some(Self::One),
            1 => Some(Self::Two),
            _ => None,
        }
    }

    /// By how much the numbers of its attributes are above those of channel 1.
    #[must_use]
    pub const fn offset(self) -> u16 {
        match self {
            Self::One => 0,
            Self::Two => Self::EACH,
        }
    }
}

/// What a value of an encoder counts in: the attributes of its channel say how much that is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FeedbackUnit {
    /// Whose it is.
    pub channel: FeedbackChannel,
    /// Counts of the encoder; otherwise its units.
    pub is_counts: bool,
}

impl Times {
    /// All of them with their words in the tables.
    pub(super) const NAMED: [(&'static str, Self); 4] = [
        ("motion_count", Self::MotionCount),
        ("motion_unit", Self::MotionUnit),
        ("feedback_count", Self::FeedbackCount),
        ("feedback_unit", Self::FeedbackUnit),
    ];

    /// What it counts in, of an attribute that is a value of an encoder.
    pub(super) const fn feedback(self, attribute: u16) -> Option<FeedbackUnit> {
        let is_counts = match self {
            Self::FeedbackCount => true,
            Self::FeedbackUnit => false,
            Self::One | Self::MotionCount | Self::MotionUnit => return None,
        };
        match FeedbackChannel::of(attribute) {
            Some(channel) => Some(FeedbackUnit { channel, is_counts }),
            None => None,
        }
    }
}

/// How a CIP unit becomes a generic one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CipUnit {
    /// Generic units in one.
    pub ratio: Ratio,
    /// What multiplies it.
    pub times: Times,
    /// The value is one over the generic one; 0 on both sides is "none".
    pub reciprocal: bool,
}

/// A displacement unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DisplacementUnit {
    /// Name in its enumeration.
    pub name: String,
    /// Code in its enumeration.
    pub code: u32,
    /// Rotary or linear.
    pub kind: UnitKind,
    /// Nanounits in one.
    pub nanounits: i64,
}

/// The attributes that define the scaling, by number.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ScalingAttributes {
    /// Chooses who scales.
    pub configuration: u16,
    /// Code that means the device scales.
    pub drive_scaling: u32,
    /// Displacement unit, when the device scales.
    pub unit: u16,
    /// Counts in a unit, when the device scales.
    pub resolution: Vec<u16>,
    /// Turns the direction.
    pub polarity: u16,
    /// Code that turns it.
    pub inverted: u32,
    /// Makes the axis cyclic.
    pub unwind: u16,
    /// Counts of one cycle.
    pub unwind_position: u16,
    /// Displacement unit, when the controller scales.
    pub feedback_unit: u16,
    /// Factors of the counts in a unit, when the controller scales.
    pub feedback_resolution: Vec<u16>,
}

impl ScalingAttributes {
    /// Every attribute that changes the scaling when it is set.
    pub fn all(&self) -> impl Iterator<Item = u16> + '_ {
        let single = [
            self.configuration,
            self.unit,
            self.polarity,
            self.unwind,
            self.unwind_position,
            self.feedback_unit,
        ];
        single
            .into_iter()
            .chain(self.resolution.iter().copied())
            .chain(self.feedback_resolution.iter().copied())
    }
}

/// The attributes that say how the start and stop sequences run, by number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SequenceAttributes {
    /// Stopping action.
    pub stopping_action: u16,
    /// Longest time to zero speed with torque.
    pub stopping_time_limit: u16,
    /// Longest time to zero speed without.
    pub coasting_time_limit: u16,
    /// From torque to the first command that is followed.
    pub brake_release_delay: u16,
    /// From rest to the end of the torque.
    pub brake_engage_delay: u16,
    /// Speed of an axis that stands.
    pub zero_speed: u16,
    /// How long it has to be so slow.
    pub zero_speed_time: u16,
    /// Highest velocity forward of the ramp generator.
    pub ramp_velocity_positive: u16,
    /// Highest velocity backward of it.
    pub ramp_velocity_negative: u16,
    /// Its acceleration.
    pub ramp_acceleration: u16,
    /// Its deceleration, and that of a ramped stop.
    pub ramp_deceleration: u16,
    /// The same where that was not set.
    pub deceleration_limit: u16,
    /// Whether an axis may be started while it moves.
    pub flying_start: u16,
    /// Whether a limit switch stops the axis.
    pub overtravel_checking: u16,
}

#[derive(Debug, Clone)]
pub(super) struct CyclicElement {
    pub bit: u8,
    pub signal: Signal,
    pub to_generic: bool,
    pub unit: CipUnit,
    /// Whether the polarity of the axis turns it.
    pub turns: bool,
    pub wraps: bool,
    pub data_type: CipType,
    pub missing: MissingValue,
}

/// Who answers for an attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Served {
    /// The device computes it.
    Device,
    /// The connection writes it.
    Connection,
    /// It is stored and given back, without effect: what the standard lets a device keep.
    Stored,
    /// It never changes.
    Constant(i64),
    /// It is what the scaling of the drive comes to.
    Mechanics(MechanicalFact),
    /// A value of the process image.
    Signal {
        /// The signal.
        signal: Signal,
        /// The parameter of the drive that is read while the signal has no value.
        otherwise: Option<Parameter>,
        /// Unit of the attribute.
        unit: CipUnit,
    },
    /// A parameter of the drive.
    Parameter {
        /// The parameter.
        parameter: Parameter,
        /// Unit of the attribute.
        unit: CipUnit,
        /// What it is of a drive without the parameter.
        missing: Missing,
        /// Least and greatest value that may be set, in the generic unit.
        range: Option<(i64, i64)>,
    },
}

/// What an attribute is of a drive without its parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// Not supported.
    Absent,
    /// The device goes by its value itself.
    Device,
    /// The device goes by its value itself where it can; elsewhere as [`Missing::Zero`].
    DeviceOrZero,
    /// The loops of the drive have no such term: it is 0, and can be set to nothing else.
    Zero,
    /// Stored and given back, without effect.
    Stored,
}

/// Words of `missing`; without one the attribute is not supported.
pub(crate) const MISSING: [(&str, Missing); 5] = [
    ("reject", Missing::Absent),
    ("device", Missing::Device),
    ("device_or_zero", Missing::DeviceOrZero),
    ("zero", Missing::Zero),
    ("stored", Missing::Stored),
];

/// An attribute that the device serves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServedAttribute {
    /// The attribute.
    pub attribute: CipAttribute,
    /// Who answers for it.
    pub served: Served,
    /// Least and greatest value that may be set.
    pub range: Option<(i64, i64)>,
    /// Codes that it cannot be set to, of those that it has.
    pub without: Vec<u32>,
}

/// Who finds a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finder {
    /// The box, in what it knows of drive and bus.
    Box,
    /// The motion device, in what the controller does.
    Device,
}

/// What the controller may set for an exception.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExceptionRow {
    /// The cause that the exception stands for.
    pub cause: FaultCause,
    /// Whether it is one of the manufacturer's.
    pub manufacturer: bool,
    /// Its bit.
    pub bit: u8,
    /// Who finds it without the drive's word.
    pub found_by: Option<Finder>,
    /// The least severe Axis Exception Action.
    pub least: u8,
    /// The Axis Exception Action until another is set.
    pub default: u8,
}

/// The mapping of CIP Motion to the generic model.
#[derive(Debug, Clone, Default)]
pub struct CipTables {
    /// The attributes that define the scaling.
    pub scaling: ScalingAttributes,
    /// The attributes of the start and stop sequences.
    pub sequence: SequenceAttributes,
    /// The attributes of what lies between motor and load, by number.
    pub(super) mechanics: Vec<(u16, MechanicalFact)>,
    /// What Motion Unit may be.
    pub motion_units: Vec<DisplacementUnit>,
    /// What Feedback n Unit may be.
    pub feedback_units: Vec<DisplacementUnit>,
    /// What the device serves, by attribute number.
    pub attributes: Vec<ServedAttribute>,
    /// What it does not serve, by attribute number, and why.
    pub rejected: Vec<(u16, String)>,
    /// Bits of Axis Exceptions that nobody finds, and why.
    pub unraised: Vec<(u8, String)>,
    units: Vec<(String, Quantity, CipUnit)>,
    pub(super) cyclic: Vec<CyclicElement>,
    pub(super) modes: [Option<OperatingMode>; 16],
    /// The Feedback Mode of each use of the encoders, in their order.
    pub(super) feedback_modes: [Option<u8>; FeedbackUse::ALL.len()],
    pub(super) requests: Vec<CipRequest>,
    pub(super) drive_actions: [(DriveAction, Option<Request>); DRIVE_ACTIONS.len()],
    pub(super) states: [CipState; DriveState::ALL.len()],
    pub(super) status: Vec<StatusRule>,
    pub(super) io_status: Vec<IoStatusRule>,
    pub(super) faults: Vec<(FaultCause, CipFault)>,
    /// Causes, and those as which they are told a controller that has inverted the direction.
    pub(super) opposites: Vec<(FaultCause, FaultCause)>,
    /// Exceptions and their actions.
    pub exceptions: Vec<ExceptionRow>,
    pub(super) reactions: [u8; Reaction::ALL.len()],
    pub(super) inhibits: Vec<InhibitRule>,
    pub(super) stoppings: Vec<CipStopping>,
    pub(super) events: EventTables,
}

impl ServedAttribute {
    /// Makes one of all that is only stored and given back.
    pub(super) fn forget_who_stores(&mut self) {
        if matches!(self.served, Served::Device | Served::Connection) {
            self.served = Served::Stored;
        }
    }
}

impl CipTables {
    /// The Feedback Modes that an axis can be enabled with that uses its encoders so, as bits numbered by the code.
    #[must_use]
    pub fn feedback_modes(&self, feedback: FeedbackUse) -> u16 {
        let at = FeedbackUse::ALL.iter().position(|of| *of == feedback);
        let code = at.and_then(|at| self.feedback_modes.get(at).copied().flatten());
        code.and_then(|code| 1_u16.checked_shl(u32::from(code))).unwrap_or(0)
    }

    /// Forgets the rows of units.
    pub(super) fn forget_units(&mut self) {
        self.units.clear();
    }

    /// How `unit` becomes `quantity`; an attribute without a unit is a bare number.
    pub(super) fn unit(&self, unit: &str, quantity: Quantity) -> Option<CipUnit> {
        if unit.is_empty() && quantity == Quantity::None {
            return Some(CipUnit { ratio: Ratio::ONE, times: Times::One, reciprocal: false });
        }
        let row = self.units.iter().find(|(known, of, _)| known == unit && *of == quantity)?;
        Some(row.2)
    }
}

/// Whether the polarity of an axis turns a quantity (Table 5-2.14).
pub(super) const fn has_direction(quantity: Quantity) -> bool {
    matches!(quantity, Quantity::Position | Quantity::Velocity | Quantity::Acceleration | Quantity::Torque)
}

/// Whether the limits of the two directions differ in sign. Those of acceleration and deceleration are magnitudes.
pub(super) const fn limit_has_sign(quantity: Quantity) -> bool {
    matches!(quantity, Quantity::Position | Quantity::Velocity | Quantity::Torque)
}
