//! The attributes of the Motion Device Axis Object: definitions, table, values.
//!
//! Which attributes a device has, with type and access, is data that the device is built with
//! ([`AttributeDefinition`]). Only those the protocol itself needs are listed here ([`id`]); they are always there.
//! Lookup is a binary search in a sorted table; values of an instance are one run of octets. Nothing is allocated
//! after construction.

pub(super) mod list_job;
pub mod worker;

use core::fmt;

use crate::wire::status::GeneralStatus;

/// Numbers of the attributes that the protocol engine itself works with.
pub mod id {
    /// Class: Revision, Table 5-2.3.
    pub const REVISION: u16 = 1;
    /// Class: Node Control.
    pub const NODE_CONTROL: u16 = 14;
    /// Class: Node Status.
    pub const NODE_STATUS: u16 = 15;
    /// Class: Node Fault Code.
    pub const NODE_FAULT_CODE: u16 = 16;
    /// Class: Node Alarm Code.
    pub const NODE_ALARM_CODE: u16 = 17;
    /// Class: Controller Update Period, ns.
    pub const CONTROLLER_UPDATE_PERIOD: u16 = 18;
    /// Class: Controller Time Offset, ns.
    pub const CONTROLLER_TIME_OFFSET: u16 = 19;
    /// Class: Controller Time Stamp, ns of system time.
    pub const CONTROLLER_TIME_STAMP: u16 = 20;
    /// Class: Controller Update Delay High Limit, update periods.
    pub const UPDATE_DELAY_HIGH_LIMIT: u16 = 21;
    /// Class: Controller Update Delay Low Limit, update periods.
    pub const UPDATE_DELAY_LOW_LIMIT: u16 = 22;
    /// Class: Time Data Set.
    pub const TIME_DATA_SET: u16 = 31;
    /// Class: Lost Controller Updates.
    pub const LOST_UPDATES: u16 = 32;
    /// Class: Late Controller Updates.
    pub const LATE_UPDATES: u16 = 33;
    /// Class: Drive Power Structure Class ID.
    pub const POWER_STRUCTURE_CLASS_ID: u16 = 34;
    /// Class: Step Threshold, ns.
    pub const STEP_THRESHOLD: u16 = 35;
    /// Control Mode.
    pub const CONTROL_MODE: u16 = 40;
    /// Feedback Mode.
    pub const FEEDBACK_MODE: u16 = 42;
    /// Event Checking Control.
    pub const EVENT_CHECKING_CONTROL: u16 = 60;
    /// Event Checking Status.
    pub const EVENT_CHECKING_STATUS: u16 = 61;
    /// Registration 1 Positive Edge Position; the other three edges follow.
    pub const REGISTRATION_POSITION: u16 = 62;
    /// Registration 1 Positive Edge Time; the other three edges follow.
    pub const REGISTRATION_TIME: u16 = 66;
    /// Home Event Position.
    pub const HOME_EVENT_POSITION: u16 = 70;
    /// Home Event Time.
    pub const HOME_EVENT_TIME: u16 = 71;
    /// Watch 1 Event Time; Watch 2 follows.
    pub const WATCH_EVENT_TIME: u16 = 72;
    /// Registration Data Set.
    pub const REGISTRATION_DATA_SET: u16 = 95;
    /// Home Data Set.
    pub const HOME_DATA_SET: u16 = 96;
    /// Watch Data Set.
    pub const WATCH_DATA_SET: u16 = 97;
    /// Control Status.
    pub const CONTROL_STATUS: u16 = 89;
    /// Actual Data Set.
    pub const ACTUAL_DATA_SET: u16 = 90;
    /// Command Data Set.
    pub const COMMAND_DATA_SET: u16 = 91;
    /// Command Control.
    pub const COMMAND_CONTROL: u16 = 92;
    /// Command Target Time, ns of system time.
    pub const COMMAND_TARGET_TIME: u16 = 93;
    /// Status Data Set.
    pub const STATUS_DATA_SET: u16 = 94;
    /// Controller Position Command - Integer.
    pub const POSITION_COMMAND_INTEGER: u16 = 360;
    /// Controller Position Command - Float.
    pub const POSITION_COMMAND_FLOAT: u16 = 361;
    /// Controller Velocity Command.
    pub const VELOCITY_COMMAND: u16 = 362;
    /// Controller Acceleration Command.
    pub const ACCELERATION_COMMAND: u16 = 363;
    /// Controller Torque Command.
    pub const TORQUE_COMMAND: u16 = 364;
    /// Axis State.
    pub const AXIS_STATE: u16 = 650;
    /// Axis Status.
    pub const AXIS_STATUS: u16 = 651;
    /// Axis Status - Mfg.
    pub const AXIS_STATUS_MFG: u16 = 652;
    /// Axis I/O Status.
    pub const AXIS_IO_STATUS: u16 = 653;
    /// Axis I/O Status - Mfg.
    pub const AXIS_IO_STATUS_MFG: u16 = 654;
    /// Axis Exceptions.
    pub const AXIS_EXCEPTIONS: u16 = 655;
    /// Axis Exceptions - Mfg.
    pub const AXIS_EXCEPTIONS_MFG: u16 = 656;
    /// Axis Faults.
    pub const AXIS_FAULTS: u16 = 657;
    /// Axis Faults - Mfg.
    pub const AXIS_FAULTS_MFG: u16 = 658;
    /// Axis Alarms.
    pub const AXIS_ALARMS: u16 = 659;
    /// Axis Alarms - Mfg.
    pub const AXIS_ALARMS_MFG: u16 = 660;
    /// Axis Fault Code of the newest record.
    pub const AXIS_FAULT_CODE: u16 = 661;
    /// Axis Fault Type of the newest record.
    pub const AXIS_FAULT_TYPE: u16 = 662;
    /// Axis Fault Time Stamp of the newest record, ns of system time.
    pub const AXIS_FAULT_TIME_STAMP: u16 = 663;
    /// Axis Alarm Code of the newest record.
    pub const AXIS_ALARM_CODE: u16 = 664;
    /// Axis Alarm Type of the newest record.
    pub const AXIS_ALARM_TYPE: u16 = 665;
    /// Axis Fault Sub Code of the newest record.
    pub const AXIS_FAULT_SUB_CODE: u16 = 666;
    /// Axis Alarm Sub Code of the newest record.
    pub const AXIS_ALARM_SUB_CODE: u16 = 667;
    /// Axis Fault Action of the newest record.
    pub const AXIS_FAULT_ACTION: u16 = 668;
    /// Axis Alarm State of the newest record.
    pub const AXIS_ALARM_STATE: u16 = 669;
    /// Axis Alarm Time Stamp of the newest record, ns of system time.
    pub const AXIS_ALARM_TIME_STAMP: u16 = 670;
    /// Axis Exception Action, 64 elements.
    pub const AXIS_EXCEPTION_ACTION: u16 = 672;
    /// Axis Exception Action - Mfg, 64 elements.
    pub const AXIS_EXCEPTION_ACTION_MFG: u16 = 673;
    /// Initialization Faults.
    pub const INITIALIZATION_FAULTS: u16 = 674;
    /// Initialization Faults - Mfg.
    pub const INITIALIZATION_FAULTS_MFG: u16 = 675;
    /// Start Inhibits.
    pub const START_INHIBITS: u16 = 676;
    /// Start Inhibits - Mfg.
    pub const START_INHIBITS_MFG: u16 = 677;
    /// APR Faults. This and those below are there only where the device is built with them.
    pub const APR_FAULTS: u16 = 756;
    /// APR Faults - Mfg.
    pub const APR_FAULTS_MFG: u16 = 757;
    /// Axis Safety State.
    pub const AXIS_SAFETY_STATE: u16 = 760;
    /// Axis Safety Status.
    pub const AXIS_SAFETY_STATUS: u16 = 761;
    /// Axis Safety Status - Mfg.
    pub const AXIS_SAFETY_STATUS_MFG: u16 = 762;
    /// Axis Safety Faults.
    pub const AXIS_SAFETY_FAULTS: u16 = 763;
    /// Axis Safety Faults - Mfg.
    pub const AXIS_SAFETY_FAULTS_MFG: u16 = 764;
}

/// CIP data type of an attribute element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataType {
    /// One octet, 0 or 1.
    Bool,
    /// Signed 8 bits.
    Sint,
    /// Signed 16 bits.
    Int,
    /// Signed 32 bits.
    Dint,
    /// Signed 64 bits.
    Lint,
    /// Unsigned 8 bits.
    Usint,
    /// Unsigned 16 bits.
    Uint,
    /// Unsigned 32 bits.
    Udint,
    /// Unsigned 64 bits.
    Ulint,
    /// 8 bits.
    Byte,
    /// 16 bits.
    Word,
    /// 32 bits.
    Dword,
    /// 64 bits.
    Lword,
    /// Floating point, 32 bits.
    Real,
    /// Floating point, 64 bits.
    Lreal,
    /// One length octet and at most [`SHORT_STRING_MAX`] characters.
    ShortString,
}

/// Most characters of a SHORT_STRING that a device keeps.
pub const SHORT_STRING_MAX: u8 = 32;

impl DataType {
    const NAMES: [(&'static str, Self); 16] = [
        ("BOOL", Self::Bool),
        ("SINT", Self::Sint),
        ("INT", Self::Int),
        ("DINT", Self::Dint),
        ("LINT", Self::Lint),
        ("USINT", Self::Usint),
        ("UINT", Self::Uint),
        ("UDINT", Self::Udint),
        ("ULINT", Self::Ulint),
        ("BYTE", Self::Byte),
        ("WORD", Self::Word),
        ("DWORD", Self::Dword),
        ("LWORD", Self::Lword),
        ("REAL", Self::Real),
        ("LREAL", Self::Lreal),
        ("SHORT_STRING", Self::ShortString),
    ];

    /// The type with this name of the standard, for example `UDINT`.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(known, _)| *known == name).map(|(_, data_type)| *data_type)
    }

    /// Octets of one element; of a string the most there can be.
    #[must_use]
    pub const fn size(self) -> u8 {
        match self {
            Self::Bool | Self::Sint | Self::Usint | Self::Byte => 1,
            Self::Int | Self::Uint | Self::Word => 2,
            Self::Dint | Self::Udint | Self::Dword | Self::Real => 4,
            Self::Lint | Self::Ulint | Self::Lword | Self::Lreal => 8,
            Self::ShortString => 1 + SHORT_STRING_MAX,
        }
    }

    /// The octets of one element as 64 bits without sign; `None` for a string or too few octets.
    fn raw(self, element: &[u8]) -> Option<u64> {
        let mut octets = [0; 8];
        let size = usize::from(self.size());
        octets.get_mut(..size)?.copy_from_slice(element.get(..size)?);
        Some(u64::from_le_bytes(octets))
    }

    /// One element as a number, for range checks. Integers beyond 53 bits are rounded; a string is none.
    #[must_use]
    pub fn to_f64(self, element: &[u8]) -> Option<f64> {
        let raw = self.raw(element)?;
        let shift = 64 - 8 * u32::from(self.size());
        Some(match self {
            Self::Real => f64::from(f32::from_bits(u32::try_from(raw).ok()?)),
            Self::Lreal => f64::from_bits(raw),
            Self::Sint | Self::Int | Self::Dint | Self::Lint => {
                i64_to_f64((raw << shift).cast_signed() >> shift)
            }
            _ => u64_to_f64(raw),
        })
    }
}

#[expect(clippy::cast_precision_loss, reason = "only compared with range limits, which are f64 themselves")]
fn i64_to_f64(value: i64) -> f64 {
    value as f64
}

#[expect(clippy::cast_precision_loss, reason = "only compared with range limits, which are f64 themselves")]
fn u64_to_f64(value: u64) -> f64 {
    value as f64
}

/// Who has an attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Scope {
    /// The class, instance 0.
    Class,
    /// Every axis.
    Instance,
}

/// Access rule of the standard's tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Get only.
    Get,
    /// Get and Set by a service.
    Set,
    /// `Set*`: set by the cyclic connection data, not by a service.
    Cyclic,
}

/// Where the value lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backing {
    /// In the device; the owner of the device may publish values with `put_attribute`.
    Stored,
    /// In the device, and every Set is carried to the drive before it is acknowledged.
    WriteThrough,
    /// In the drive: every Get and Set is carried to it.
    Drive,
    /// In the process image of the drive: a Get is carried to the owner of the device like one of [`Backing::Drive`], and
    /// what a cyclic read list holds of them is published in every cycle.
    Signal,
}

impl Backing {
    /// Whether a Get has to ask the owner of the device.
    #[must_use]
    pub const fn is_elsewhere(self) -> bool {
        matches!(self, Self::Drive | Self::Signal)
    }
}

/// Value an attribute has before it is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DefaultValue {
    /// For the integer and bit string types.
    Integer(i64),
    /// For REAL and LREAL.
    Real(f64),
}

/// What an attribute is.
#[derive(Debug, Clone, PartialEq)]
pub struct AttributeDefinition {
    /// Who has it.
    pub scope: Scope,
    /// Attribute ID.
    pub id: u16,
    /// Type of an element.
    pub data_type: DataType,
    /// Number of elements of an array; `None` for a single value.
    pub elements: Option<u16>,
    /// Access rule.
    pub access: Access,
    /// Whether it may be set while the axis is Running, Table 5-2.110.
    pub settable_in_running: bool,
    /// Where the value lives.
    pub backing: Backing,
    /// Default of every element.
    pub default: DefaultValue,
    /// Permitted values, ends included.
    pub range: Option<(f64, f64)>,
    /// What holds for single elements of an array in place of `default` and `range`: one rule for each element from the
    /// first; empty where all are alike.
    pub element_rules: Vec<ElementRule>,
    /// Permitted codes of an enumeration in ascending order; empty for any value of the type.
    pub codes: Vec<u32>,
    /// Bits of a bit field that mean something; the others have to be 0.
    pub bits: Option<u64>,
    /// Name of the standard.
    pub name: String,
}

/// Default and permitted values of one element of an array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementRule {
    /// Its default.
    pub default: DefaultValue,
    /// Its permitted values, ends included.
    pub range: (f64, f64),
}

impl AttributeDefinition {
    /// A stored single value with default 0 and no range.
    #[must_use]
    pub fn new(scope: Scope, id: u16, data_type: DataType, access: Access, name: &str) -> Self {
        Self {
            scope,
            id,
            data_type,
            elements: None,
            access,
            settable_in_running: false,
            backing: Backing::Stored,
            default: DefaultValue::Integer(0),
            range: None,
            element_rules: Vec::new(),
            codes: Vec::new(),
            bits: None,
            name: name.to_owned(),
        }
    }

    /// Octets of the whole value.
    #[must_use]
    pub fn size(&self) -> usize {
        usize::from(self.data_type.size()) * usize::from(self.elements.unwrap_or(1))
    }
}

/// Revision of the Motion Device Axis Object that the device speaks (clause 5-2.2).
pub const OBJECT_REVISION: u16 = 4;

/// Attributes of the engine: scope, ID, type, access, default, name.
const ENGINE: &[(Scope, u16, DataType, Access, i64, &str)] = {
    use Access::{Cyclic, Get, Set};
    use DataType::{Byte, Dword, Lint, Lword, Udint, Uint, Usint, Word};
    use Scope::{Class, Instance};
    &[
        (Class, id::REVISION, Uint, Get, OBJECT_REVISION as i64, "Revision"),
        (Class, id::NODE_CONTROL, Byte, Cyclic, 0, "Node Control"),
        (Class, id::NODE_STATUS, Byte, Get, 0, "Node Status"),
        (Class, id::NODE_FAULT_CODE, Usint, Get, 0, "Node Fault Code"),
        (Class, id::NODE_ALARM_CODE, Usint, Get, 0, "Node Alarm Code"),
        (Class, id::CONTROLLER_UPDATE_PERIOD, Udint, Cyclic, 0, "Controller Update Period"),
        (Class, id::CONTROLLER_TIME_OFFSET, Lint, Cyclic, 0, "Controller Time Offset"),
        (Class, id::CONTROLLER_TIME_STAMP, Lint, Cyclic, 0, "Controller Time Stamp"),
        (Class, id::UPDATE_DELAY_HIGH_LIMIT, Usint, Set, 4, "Controller Update Delay High Limit"),
        (Class, id::UPDATE_DELAY_LOW_LIMIT, Usint, Set, 2, "Controller Update Delay Low Limit"),
        (Class, id::TIME_DATA_SET, Byte, Cyclic, 0, "Time Data Set"),
        (Class, id::LOST_UPDATES, Byte, Set, 0, "Lost Controller Updates"),
        (Class, id::LATE_UPDATES, Byte, Set, 0, "Late Controller Updates"),
        (Class, id::POWER_STRUCTURE_CLASS_ID, Udint, Get, 0, "Drive Power Structure Class ID"),
        (Class, id::STEP_THRESHOLD, Udint, Set, 1_000_000, "Step Threshold"),
        (Instance, id::CONTROL_MODE, Usint, Cyclic, 0, "Control Mode"),
        (Instance, id::FEEDBACK_MODE, Byte, Cyclic, 0, "Feedback Mode"),
        (Instance, id::EVENT_CHECKING_CONTROL, Dword, Cyclic, 0, "Event Checking Control"),
        (Instance, id::EVENT_CHECKING_STATUS, Dword, Get, 0, "Event Checking Status"),
        (Instance, id::CONTROL_STATUS, Byte, Cyclic, 0, "Control Status"),
        (Instance, id::ACTUAL_DATA_SET, Byte, Cyclic, 0, "Actual Data Set"),
        (Instance, id::COMMAND_DATA_SET, Byte, Cyclic, 0, "Command Data Set"),
        (Instance, id::COMMAND_CONTROL, Byte, Cyclic, 0, "Command Control"),
        (Instance, id::COMMAND_TARGET_TIME, Lint, Get, 0, "Command Target Time"),
        (Instance, id::STATUS_DATA_SET, Byte, Cyclic, 0, "Status Data Set"),
        (Instance, id::AXIS_STATE, Usint, Get, 0, "Axis State"),
        (Instance, id::AXIS_STATUS, Dword, Get, 0, "Axis Status"),
        (Instance, id::AXIS_STATUS_MFG, Dword, Get, 0, "Axis Status - Mfg"),
        (Instance, id::AXIS_IO_STATUS, Dword, Get, 0, "Axis I/O Status"),
        (Instance, id::AXIS_IO_STATUS_MFG, Dword, Get, 0, "Axis I/O Status - Mfg"),
        (Instance, id::AXIS_EXCEPTIONS, Lword, Get, 0, "Axis Exceptions"),
        (Instance, id::AXIS_EXCEPTIONS_MFG, Lword, Get, 0, "Axis Exceptions - Mfg"),
        (Instance, id::AXIS_FAULTS, Lword, Get, 0, "Axis Faults"),
        (Instance, id::AXIS_FAULTS_MFG, Lword, Get, 0, "Axis Faults - Mfg"),
        (Instance, id::AXIS_ALARMS, Lword, Get, 0, "Axis Alarms"),
        (Instance, id::AXIS_ALARMS_MFG, Lword, Get, 0, "Axis Alarms - Mfg"),
        (Instance, id::AXIS_FAULT_CODE, Usint, Get, 0, "Axis Fault Code"),
        (Instance, id::AXIS_FAULT_TYPE, Usint, Get, 0, "Axis Fault Type"),
        (Instance, id::AXIS_FAULT_TIME_STAMP, Lint, Get, 0, "Axis Fault Time Stamp"),
        (Instance, id::AXIS_ALARM_CODE, Usint, Get, 0, "Axis Alarm Code"),
        (Instance, id::AXIS_ALARM_TYPE, Usint, Get, 0, "Axis Alarm Type"),
        (Instance, id::AXIS_FAULT_SUB_CODE, Usint, Get, 0, "Axis Fault Sub Code"),
        (Instance, id::AXIS_ALARM_SUB_CODE, Usint, Get, 0, "Axis Alarm Sub Code"),
        (Instance, id::AXIS_FAULT_ACTION, Usint, Get, 0, "Axis Fault Action"),
        (Instance, id::AXIS_ALARM_STATE, Usint, Get, 0, "Axis Alarm State"),
        (Instance, id::AXIS_ALARM_TIME_STAMP, Lint, Get, 0, "Axis Alarm Time Stamp"),
        (Instance, id::INITIALIZATION_FAULTS, Dword, Get, 0, "Initialization Faults"),
        (Instance, id::INITIALIZATION_FAULTS_MFG, Dword, Get, 0, "Initialization Faults - Mfg"),
        (Instance, id::START_INHIBITS, Word, Get, 0, "Start Inhibits"),
        (Instance, id::START_INHIBITS_MFG, Word, Get, 0, "Start Inhibits - Mfg"),
    ]
};

/// Why a table of definitions cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TableError {
    /// Two definitions have the same scope and ID.
    Duplicate(Scope, u16),
    /// The engine needs this attribute with another type, or as a single value.
    EngineType {
        /// Scope of the attribute.
        scope: Scope,
        /// Attribute ID.
        id: u16,
        /// The type that the engine needs.
        expected: DataType,
    },
    /// A default does not fit its type or its range.
    Default(Scope, u16),
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Duplicate(scope, id) => write!(f, "{scope:?} attribute {id} is defined twice"),
            Self::EngineType { scope, id, expected } => {
                write!(f, "{scope:?} attribute {id}: expected a single {expected:?}")
            }
            Self::Default(scope, id) => {
                write!(f, "{scope:?} attribute {id}: the default does not fit its type or range")
            }
        }
    }
}

impl std::error::Error for TableError {}

/// One attribute with the place of its value.
#[derive(Debug, Clone)]
pub struct Entry {
    /// What it is.
    pub definition: AttributeDefinition,
    offset: usize,
    default: [u8; 8],
    /// Defaults of the elements that have a rule of their own.
    element_defaults: Vec<[u8; 8]>,
}

/// The sorted attributes of one scope.
#[derive(Debug, Clone)]
pub struct AttributeTable {
    entries: Vec<Entry>,
    /// Place of each ID below [`INDEXED`] among the entries, [`NOWHERE`] where there is no such attribute.
    index: Box<[u16]>,
    octets: usize,
}

/// IDs below this are found without a search: those of the standard, which the cycle asks for.
const INDEXED: usize = 4096;

/// Place of an ID that no entry has.
const NOWHERE: u16 = u16::MAX;

fn index(entries: &[Entry]) -> Box<[u16]> {
    let mut index = Vec::new();
    for (place, entry) in (0..).zip(entries) {
        let id = usize::from(entry.definition.id);
        if id < INDEXED {
            index.resize(id, NOWHERE);
            index.push(place);
        }
    }
    index.into_boxed_slice()
}

fn encode_default(
    definition: &AttributeDefinition,
    default: DefaultValue,
    range: Option<(f64, f64)>,
) -> Option<[u8; 8]> {
    let size = usize::from(definition.data_type.size());
    let octets = match (definition.data_type, default) {
        (DataType::ShortString, DefaultValue::Integer(0)) => return Some([0; 8]),
        (DataType::ShortString, _) => return None,
        (DataType::Real, DefaultValue::Real(value)) => {
            let narrow = narrow(value);
            let mut octets = [0; 8];
            octets[..4].copy_from_slice(&narrow.to_le_bytes());
            octets
        }
        (DataType::Lreal, DefaultValue::Real(value)) => value.to_le_bytes(),
        (DataType::Real | DataType::Lreal, DefaultValue::Integer(0)) => [0; 8],
        (DataType::Real | DataType::Lreal, _) | (_, DefaultValue::Real(_)) => return None,
        (_, DefaultValue::Integer(value)) => {
            let octets = value.to_le_bytes();
            let (low, high) = octets.split_at(size);
            let negative = low[size - 1] & 0x80 != 0;
            let clean = high.iter().all(|o| *o == 0) || (negative && high.iter().all(|o| *o == 0xFF));
            if !clean {
                return None;
            }
            octets
        }
    };
    // Everything is 0 at power-up unless the standard says otherwise, also where 0 is none of the codes.
    check_range(definition.data_type, range, &octets[..size]).ok()?;
    Some(octets)
}

#[expect(clippy::cast_possible_truncation, reason = "a REAL holds the nearest single precision number")]
fn narrow(value: f64) -> f32 {
    value as f32
}

/// Checks one element: a number that is finite and within the range, and then one of the codes and bits that there are.
fn check_value(
    definition: &AttributeDefinition,
    range: Option<(f64, f64)>,
    element: &[u8],
) -> Result<(), GeneralStatus> {
    check_range(definition.data_type, range, element)?;
    let raw = definition.data_type.raw(element).ok_or(GeneralStatus::NOT_ENOUGH_DATA)?;
    let truth = definition.data_type != DataType::Bool || raw <= 1;
    let code = definition.codes.is_empty()
        || u32::try_from(raw).is_ok_and(|raw| definition.codes.binary_search(&raw).is_ok());
    let bits = definition.bits.is_none_or(|bits| raw & !bits == 0);
    if truth && code && bits { Ok(()) } else { Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE) }
}

/// Checks that the octets are a string with its length in front.
fn check_string(value: &[u8]) -> Result<(), GeneralStatus> {
    match value.split_first() {
        Some((length, characters)) if characters.len() > usize::from(*length) => {
            Err(GeneralStatus::TOO_MUCH_DATA)
        }
        Some((length, characters)) if characters.len() == usize::from(*length) => {
            if *length <= SHORT_STRING_MAX { Ok(()) } else { Err(GeneralStatus::TOO_MUCH_DATA) }
        }
        _ => Err(GeneralStatus::NOT_ENOUGH_DATA),
    }
}

/// Checks one element: finite and within the range.
fn check_range(data_type: DataType, range: Option<(f64, f64)>, element: &[u8]) -> Result<(), GeneralStatus> {
    let value = data_type.to_f64(element).ok_or(GeneralStatus::NOT_ENOUGH_DATA)?;
    let (low, high) = range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    if value.is_finite() && value >= low && value <= high {
        Ok(())
    } else {
        Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)
    }
}

impl AttributeTable {
    /// Builds the table of one scope: the definitions of that scope and those of the engine that are missing.
    ///
    /// # Errors
    /// See [`TableError`].
    pub fn new(scope: Scope, definitions: &[AttributeDefinition]) -> Result<Self, TableError> {
        let mut all: Vec<AttributeDefinition> =
            definitions.iter().filter(|d| d.scope == scope).cloned().collect();
        for (_, id, data_type, access, default, name) in ENGINE.iter().filter(|row| row.0 == scope) {
            match all.iter_mut().find(|d| d.id == *id) {
                Some(d) if d.data_type.size() == data_type.size() && d.elements.is_none() => {
                    // A definition that leaves the default open must not turn a limit into 0.
                    if d.default == DefaultValue::Integer(0) {
                        d.default = DefaultValue::Integer(*default);
                    }
                }
                Some(_) => return Err(TableError::EngineType { scope, id: *id, expected: *data_type }),
                None => {
                    let mut definition = AttributeDefinition::new(scope, *id, *data_type, *access, name);
                    definition.default = DefaultValue::Integer(*default);
                    definition.settable_in_running = true;
                    all.push(definition);
                }
            }
        }
        all.sort_by_key(|d| d.id);
        if let Some(pair) = all.windows(2).find(|pair| pair[0].id == pair[1].id) {
            return Err(TableError::Duplicate(scope, pair[0].id));
        }
        let mut entries = Vec::with_capacity(all.len());
        let mut octets = 0;
        for definition in all {
            let wrong = TableError::Default(scope, definition.id);
            if definition.element_rules.len() > usize::from(definition.elements.unwrap_or(0)) {
                return Err(wrong);
            }
            let default =
                encode_default(&definition, definition.default, definition.range).ok_or(wrong.clone())?;
            let encode = |rule: &ElementRule| encode_default(&definition, rule.default, Some(rule.range));
            let element_defaults: Option<Vec<_>> = definition.element_rules.iter().map(encode).collect();
            let element_defaults = element_defaults.ok_or(wrong)?;
            let size = definition.size();
            entries.push(Entry { definition, offset: octets, default, element_defaults });
            octets += size;
        }
        let index = index(&entries);
        Ok(Self { entries, index, octets })
    }

    /// The attribute with this ID.
    #[must_use]
    pub fn find(&self, id: u16) -> Option<&Entry> {
        match self.index.get(usize::from(id)) {
            Some(place) => self.entries.get(usize::from(*place)),
            None => {
                let at = self.entries.binary_search_by_key(&id, |e| e.definition.id).ok()?;
                self.entries.get(at)
            }
        }
    }

    /// All attributes in the order of their IDs.
    pub fn iter(&self) -> impl Iterator<Item = &AttributeDefinition> {
        self.entries.iter().map(|e| &e.definition)
    }
}

/// Part of an attribute: `count` elements from `start`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// First element.
    pub start: u16,
    /// Number of elements.
    pub count: u16,
}

impl Entry {
    /// The whole value.
    #[must_use]
    pub fn whole(&self) -> Part {
        Part { start: 0, count: self.definition.elements.unwrap_or(1) }
    }

    /// Checks that the part lies within the attribute, and gives its octets within the whole value.
    fn range(&self, part: Part) -> Result<core::ops::Range<usize>, GeneralStatus> {
        let size = usize::from(self.definition.data_type.size());
        let end = u32::from(part.start) + u32::from(part.count);
        if part.count == 0 || end > u32::from(self.whole().count) {
            return Err(GeneralStatus::INVALID_PARAMETER);
        }
        let start = usize::from(part.start) * size;
        Ok(start..start + usize::from(part.count) * size)
    }

    /// Whether the attribute is a trim: a value of the drive's process image that updates carry beside their set-points. It
    /// counts for the set-points that it came with, and for no others.
    #[must_use]
    pub fn is_trim(&self) -> bool {
        self.definition.access == Access::Cyclic && self.definition.backing == Backing::Signal
    }

    /// Checks a value for a part without writing it.
    ///
    /// # Errors
    /// The general status and the index of the element that caused it.
    pub fn check_set(&self, part: Part, value: &[u8], running: bool) -> Result<(), (GeneralStatus, u16)> {
        if self.definition.access != Access::Set {
            return Err((GeneralStatus::ATTRIBUTE_NOT_SETTABLE, 0));
        }
        self.check_value(part, value, running)
    }

    /// The same without a look at the access: for what an update carries.
    ///
    /// # Errors
    /// The general status and the index of the element that caused it.
    pub(in crate::device) fn check_value(
        &self,
        part: Part,
        value: &[u8],
        running: bool,
    ) -> Result<(), (GeneralStatus, u16)> {
        let definition = &self.definition;
        let range = self.range(part).map_err(|status| (status, part.start))?;
        let is_string = definition.data_type == DataType::ShortString;
        if is_string {
            check_string(value).map_err(|status| (status, 0))?;
        } else if value.len() != range.len() {
            let short = value.len() < range.len();
            let status = if short { GeneralStatus::NOT_ENOUGH_DATA } else { GeneralStatus::TOO_MUCH_DATA };
            return Err((status, 0));
        }
        if running && !definition.settable_in_running {
            return Err((GeneralStatus::OBJECT_STATE_CONFLICT, 0));
        }
        if is_string {
            return Ok(());
        }
        let size = usize::from(definition.data_type.size());
        for (index, element) in (part.start..).zip(value.chunks_exact(size)) {
            let rule = definition.element_rules.get(usize::from(index));
            let range = rule.map_or(definition.range, |rule| Some(rule.range));
            check_value(definition, range, element).map_err(|status| (status, index))?;
        }
        Ok(())
    }
}

/// The values of one instance.
#[derive(Debug, Clone)]
pub struct AttributeStore {
    octets: Box<[u8]>,
    /// Counts how often a value has become another one.
    changes: u64,
}

impl AttributeStore {
    /// Values at their defaults.
    #[must_use]
    pub fn new(table: &AttributeTable) -> Self {
        let mut store = Self { octets: vec![0; table.octets].into_boxed_slice(), changes: 0 };
        store.reset(table);
        store
    }

    /// Puts every value back to its default.
    pub fn reset(&mut self, table: &AttributeTable) {
        self.changes += 1;
        for entry in &table.entries {
            let size = usize::from(entry.definition.data_type.size());
            let place = entry.offset..entry.offset + entry.definition.size();
            for (index, element) in self.octets[place].chunks_exact_mut(size).enumerate() {
                let default = entry.element_defaults.get(index).unwrap_or(&entry.default);
                // A string begins empty; only its length octet counts then.
                let known = size.min(default.len());
                element[..known].copy_from_slice(&default[..known]);
            }
        }
    }

    /// The octets of a part.
    ///
    /// # Errors
    /// The part does not lie within the attribute.
    pub fn get(&self, entry: &Entry, part: Part) -> Result<&[u8], GeneralStatus> {
        let range = entry.range(part)?;
        let octets = &self.octets[entry.offset + range.start..entry.offset + range.end];
        Ok(match octets.first() {
            Some(length) if entry.definition.data_type == DataType::ShortString => {
                octets.get(..1 + usize::from(*length)).unwrap_or(octets)
            }
            _ => octets,
        })
    }

    /// Writes the octets of a part, without looking at access or range.
    ///
    /// # Errors
    /// The part does not lie within the attribute, or the octets are not as many.
    pub fn put(&mut self, entry: &Entry, part: Part, value: &[u8]) -> Result<(), GeneralStatus> {
        let range = entry.range(part)?;
        let mut place = &mut self.octets[entry.offset + range.start..entry.offset + range.end];
        if entry.definition.data_type == DataType::ShortString {
            check_string(value)?;
            place = &mut place[..value.len()];
        }
        if place.len() != value.len() {
            return Err(GeneralStatus::NOT_ENOUGH_DATA);
        }
        if *place != *value {
            place.copy_from_slice(value);
            self.changes += 1;
        }
        Ok(())
    }

    /// A number that is another one after a value has changed: what was made of the values before may be kept as long as it
    /// is the same.
    #[must_use]
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// A single unsigned value up to 64 bits; `None` if there is no such attribute.
    #[must_use]
    pub fn unsigned(&self, table: &AttributeTable, id: u16) -> Option<u64> {
        let entry = table.find(id)?;
        let value = self.get(entry, Part { start: 0, count: 1 }).ok()?;
        let mut octets = [0; 8];
        octets.get_mut(..value.len())?.copy_from_slice(value);
        Some(u64::from_le_bytes(octets))
    }

    /// Publishes a single value given as 64 bits; the excess octets are cut off. Unknown IDs are ignored.
    pub fn publish(&mut self, table: &AttributeTable, id: u16, value: u64) {
        if let Some(entry) = table.find(id) {
            let size = usize::from(entry.definition.data_type.size()).min(8);
            // A single number of its own size always fits.
            let _ = self.put(entry, Part { start: 0, count: 1 }, &value.to_le_bytes()[..size]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> AttributeTable {
        let set = |id, data_type| {
            AttributeDefinition::new(Scope::Instance, id, data_type, Access::Set, "an attribute")
        };
        let definitions = [
            AttributeDefinition {
                range: Some((-1.0, 1.0)),
                default: DefaultValue::Real(0.5),
                settable_in_running: true,
                ..set(461, DataType::Real)
            },
            AttributeDefinition {
                elements: Some(64),
                range: Some((0.0, 4.0)),
                default: DefaultValue::Integer(3),
                ..set(672, DataType::Usint)
            },
            AttributeDefinition { default: DefaultValue::Integer(-7), ..set(100, DataType::Int) },
        ];
        AttributeTable::new(Scope::Instance, &definitions).expect("a table")
    }

    #[test]
    fn values_start_at_their_defaults_and_return_to_them() {
        let table = table();
        let mut store = AttributeStore::new(&table);
        let real = table.find(461).expect("defined");
        assert_eq!(store.get(real, real.whole()), Ok(&0.5_f32.to_le_bytes()[..]));
        assert_eq!(store.unsigned(&table, 100), Some(u64::from((-7_i16).cast_unsigned())));
        let array = table.find(672).expect("defined");
        assert_eq!(store.put(array, Part { start: 62, count: 2 }, &[1, 2]), Ok(()));
        assert_eq!(store.get(array, Part { start: 61, count: 3 }), Ok(&[3, 1, 2][..]));
        store.reset(&table);
        assert_eq!(store.get(array, Part { start: 61, count: 3 }), Ok(&[3, 3, 3][..]));
    }

    #[test]
    fn every_id_leads_to_its_attribute_and_no_other() {
        let number =
            |id| AttributeDefinition::new(Scope::Instance, id, DataType::Dint, Access::Set, "a number");
        for ids in [&[][..], &[1], &[4095, 4096], &[5, 4094, 65_535], &[65_534]] {
            let definitions: Vec<_> = ids.iter().map(|id| number(*id)).collect();
            let table = AttributeTable::new(Scope::Instance, &definitions).expect("a table");
            let known: Vec<u16> = table.iter().map(|definition| definition.id).collect();
            assert!(ids.iter().all(|id| known.contains(id)));
            for id in 0..=u16::MAX {
                let found = table.find(id).map(|entry| entry.definition.id);
                assert_eq!(found, known.contains(&id).then_some(id));
            }
        }
    }

    #[test]
    fn changes_are_counted_when_a_value_becomes_another_one() {
        let table = table();
        let mut store = AttributeStore::new(&table);
        let entry = table.find(100).expect("it is there");
        let mut last = store.changes();
        let mut changed =
            |store: &AttributeStore| std::mem::replace(&mut last, store.changes()) != store.changes();
        store.put(entry, entry.whole(), &[0xF9, 0xFF]).expect("two octets");
        assert!(!changed(&store), "it was -7 before");
        store.put(entry, entry.whole(), &[0xF8, 0xFF]).expect("two octets");
        assert!(changed(&store));
        assert!(store.put(entry, entry.whole(), &[0]).is_err());
        assert!(!changed(&store));
        store.publish(&table, 100, 3);
        assert!(changed(&store));
        store.publish(&table, 100, 3);
        assert!(!changed(&store));
        store.reset(&table);
        assert!(changed(&store));
    }

    #[test]
    fn a_set_is_refused_with_its_reason_and_index() {
        let table = table();
        let real = table.find(461).expect("defined");
        let array = table.find(672).expect("defined");
        let check = |entry: &Entry, part, value: &[u8], running| entry.check_set(part, value, running);
        let one = Part { start: 0, count: 1 };
        assert_eq!(check(real, one, &1.0_f32.to_le_bytes(), true), Ok(()));
        let invalid = GeneralStatus::INVALID_ATTRIBUTE_VALUE;
        assert_eq!(check(real, one, &1.5_f32.to_le_bytes(), false), Err((invalid, 0)));
        assert_eq!(check(real, one, &f32::NAN.to_le_bytes(), false), Err((invalid, 0)));
        assert_eq!(check(real, one, &[0; 3], false), Err((GeneralStatus::NOT_ENOUGH_DATA, 0)));
        assert_eq!(check(real, one, &[0; 5], false), Err((GeneralStatus::TOO_MUCH_DATA, 0)));
        assert_eq!(check(array, one, &[3], true), Err((GeneralStatus::OBJECT_STATE_CONFLICT, 0)));
        assert_eq!(check(array, Part { start: 10, count: 3 }, &[3, 5, 3], false), Err((invalid, 11)));
        let outside = Part { start: 63, count: 2 };
        assert_eq!(check(array, outside, &[3, 3], false), Err((GeneralStatus::INVALID_PARAMETER, 63)));
        let state = table.find(id::AXIS_STATE).expect("an engine attribute");
        assert_eq!(check(state, one, &[1], false), Err((GeneralStatus::ATTRIBUTE_NOT_SETTABLE, 0)));
    }

    #[test]
    fn a_table_that_contradicts_the_engine_or_itself_is_refused() {
        let new = |id, data_type| {
            AttributeDefinition::new(Scope::Instance, id, data_type, Access::Set, "an attribute")
        };
        let build = |definitions: &[AttributeDefinition]| {
            AttributeTable::new(Scope::Instance, definitions).map(|t| t.iter().count())
        };
        let expected = TableError::EngineType { scope: Scope::Instance, id: 650, expected: DataType::Usint };
        assert_eq!(build(&[new(650, DataType::Udint)]), Err(expected));
        let twice = [new(5, DataType::Int), new(5, DataType::Dint)];
        assert_eq!(build(&twice), Err(TableError::Duplicate(Scope::Instance, 5)));
        let default = AttributeDefinition { default: DefaultValue::Integer(256), ..new(7, DataType::Usint) };
        assert_eq!(build(&[default]), Err(TableError::Default(Scope::Instance, 7)));
        let limit = AttributeDefinition::new(Scope::Class, 21, DataType::Usint, Access::Set, "a limit");
        let class = AttributeTable::new(Scope::Class, &[limit]).expect("a table");
        assert_eq!(AttributeStore::new(&class).unsigned(&class, 21), Some(4), "the engine's default stands");
        let engine = ENGINE.iter().filter(|row| row.0 == Scope::Instance).count();
        assert_eq!(build(&[new(5, DataType::Int)]), Ok(engine + 1));
    }

    #[test]
    fn numbers_of_every_type_are_read_with_their_sign() {
        let f = |data_type: DataType, octets: &[u8]| data_type.to_f64(octets);
        assert_eq!(f(DataType::Sint, &[0xFF]), Some(-1.0));
        assert_eq!(f(DataType::Usint, &[0xFF]), Some(255.0));
        assert_eq!(f(DataType::Int, &[0, 0x80]), Some(-32768.0));
        assert_eq!(f(DataType::Dint, &(-5_i32).to_le_bytes()), Some(-5.0));
        assert_eq!(f(DataType::Lint, &(-6_i64).to_le_bytes()), Some(-6.0));
        assert_eq!(f(DataType::Real, &2.5_f32.to_le_bytes()), Some(2.5));
        assert_eq!(f(DataType::Lreal, &(-0.25_f64).to_le_bytes()), Some(-0.25));
        assert_eq!(f(DataType::Dint, &[1, 2]), None);
        assert_eq!(DataType::from_name("LWORD"), Some(DataType::Lword));
        assert_eq!(DataType::from_name("SHORT_STRING"), Some(DataType::ShortString));
        assert_eq!(DataType::from_name("STRING"), None);
    }
}
