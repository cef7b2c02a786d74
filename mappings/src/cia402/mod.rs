//! Generic <-> CiA 402: the mapping file with every name resolved, and what is compiled from it for one axis.
//!
//! ```text
//! Cia402Tables --plan(axis)--> ObjectStep, read into ObjectFacts --program(axis, facts)--> DriveProgram
//! ```

mod builder;
mod captures;
mod commissioning;
mod compile;
mod facts;
mod scaling;

#[cfg(test)]
mod tests;

use profile_generic::image::{Signal, StatusBits};
use profile_generic::mode::ModeSelection;
use profile_generic::parameter::Parameter;
use profile_generic::program::{BitPattern, Width};
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::state::{Action, Report};
use profile_generic::time::DurationNs;

pub use self::commissioning::{InterpolationPeriod, ObjectStep, Plan};
pub use self::compile::{Cia402Axis, Cia402Error, ModeWords};
pub use self::facts::{DriveIdentity, ObjectFacts};

use self::captures::CaptureRule;
use super::drive_program::{FaultRow, Handshake, MAX_MODES};
use super::drive_rows::FixedUnit;
use super::item::Object;

/// Wraps of a position: the range of its 32 bits.
const FULL_RANGE: i64 = 1 << 32;

/// An object that holds a number, and what it measures.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Value {
    pub object: Object,
    pub width: Width,
    /// Unit as the dictionary names it; empty without.
    pub unit: String,
}

/// What a count is.
#[derive(Debug, Clone)]
pub(crate) struct ScalingRule {
    pub unit: String,
    pub quantity: Quantity,
    pub methods: Vec<Method>,
}

#[derive(Debug, Clone)]
pub(crate) struct Method {
    /// What an object has to say.
    pub when: Option<(Value, i64)>,
    pub base: Base,
    pub times: Vec<Value>,
    pub over: Vec<Value>,
}

#[derive(Debug, Clone)]
pub(crate) enum Base {
    Generic(Ratio),
    /// The count of the rule in this place.
    Like(usize),
}

#[derive(Debug, Clone)]
pub(crate) struct SignalRule {
    pub signal: Signal,
    pub value: Value,
    /// Modes of operation in which it is this object; empty = all that no other rule of the signal has.
    pub modes: Vec<i8>,
    /// Bit of the polarity by which the drive inverts it.
    pub polarity: Option<u32>,
    /// Whether an axis cannot work without it.
    pub refuse: bool,
    /// The object of the encoder of the load.
    pub load: Option<Value>,
}

/// A mode of operation: its code, and its bit in the list of those that a drive has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DriveMode {
    pub name: String,
    pub code: i8,
    pub bit: u32,
}

#[derive(Debug, Clone)]
pub(crate) struct ModeRule {
    pub selection: ModeSelection,
    /// Whether an axis can do without it.
    pub optional: bool,
    pub modes: Vec<DriveMode>,
    /// Bits of the controlword that stand in it.
    pub control: BitPattern,
    pub handshake: Option<Handshake>,
    pub command: Vec<Signal>,
    pub actual: Vec<Signal>,
}

/// A mode that the drive carries out by itself.
#[derive(Debug, Clone)]
pub(crate) struct ProcedureRule {
    pub selection: ModeSelection,
    pub modes: Vec<DriveMode>,
    pub start: BitPattern,
    pub done: BitPattern,
    pub failed: Vec<BitPattern>,
    pub time_out: DurationNs,
}

#[derive(Debug, Clone)]
pub(crate) struct ActionRule {
    pub action: Action,
    pub when: Option<BitPattern>,
    pub pattern: BitPattern,
}

/// Drives that a row is for, by bits of the statusword that not all of them keep.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Drives {
    /// Those that tell by bit 12 whether they follow command values, or those that do not.
    pub follows: Option<bool>,
    /// Those that tell by bit 4 whether there is power, or those that do not.
    pub voltage: Option<bool>,
}

impl Drives {
    /// Whether a drive that tells this is one of them.
    pub fn include(self, tells: Tells) -> bool {
        self.follows.is_none_or(|follows| follows == tells.follows)
            && self.voltage.is_none_or(|voltage| voltage == tells.voltage)
    }
}

/// What bit 4 of the statusword is: nothing to go by, or the supply of the power stage.
pub const VOLTAGE_BIT: [(&str, bool); 2] = [("ignore", false), ("dc-link", true)];

/// What a drive tells by bits of its statusword that not all drives keep.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Tells {
    /// By bit 12, that it follows command values.
    pub follows: bool,
    /// By bit 4, that there is power.
    pub voltage: bool,
}

/// How drives are of which the configuration does not say it.
#[derive(Debug, Clone, Default)]
pub(super) struct DriveDefaults {
    pub tells: Tells,
    /// Modes of operation, whatever 6502 tells.
    pub modes: Option<Vec<i8>>,
}

#[derive(Debug, Clone)]
pub(crate) struct ReportRule {
    pub pattern: BitPattern,
    /// Modes that the drive shows; empty = any.
    pub modes: Vec<i8>,
    pub drives: Drives,
    pub report: Report,
}

#[derive(Debug, Clone)]
pub(crate) struct StatusRule {
    pub object: Object,
    pub pattern: BitPattern,
    pub modes: Vec<i8>,
    pub drives: Drives,
    pub bit: StatusBits,
    /// The same in a drive that inverts its positions.
    pub inverted: StatusBits,
}

/// Where a drive keeps a parameter.
#[derive(Debug, Clone)]
pub(crate) struct ParameterAt {
    pub value: Value,
    /// The same in a drive that inverts its positions, where it is another one.
    pub inverted: Option<Value>,
    /// What limits both directions in a drive without it.
    pub common: Option<Value>,
    /// By what the drive inverts the value, where that is not what inverts its positions.
    pub polarity: Option<Inversion>,
}

/// What inverts a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Inversion {
    /// Nothing.
    Never,
    /// A bit of the polarity.
    Bit(u32),
}

pub(crate) type ParameterRule = super::drive_rows::ParameterRule<ParameterAt>;

#[derive(Debug, Clone)]
pub(crate) enum StepKind {
    Read(Object),
    Write(Value, i64),
    WriteParameter(Parameter),
    ReadScaling,
    ReadParameters,
    ReadCaptures,
    /// The cycle as value and power of ten.
    WriteCycle(Value, Value),
    WriteMode,
}

#[derive(Debug, Clone)]
pub(crate) struct StepRule {
    pub kind: StepKind,
    /// Modes of operation of which the axis has to use one; empty = whatever it uses.
    pub modes: Vec<i8>,
    /// Whether commissioning fails when the drive refuses.
    pub fail: bool,
}

/// The words that lead a drive.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Words {
    pub control: Object,
    pub status: Object,
    pub mode: Object,
    pub mode_shown: Object,
    pub modes_supported: Object,
    /// Which values the drive inverts, and the bit of the value whose sign is that of the axis.
    pub polarity: Object,
    pub direction: u32,
    /// The error code.
    pub error: Object,
}

/// The mapping of the generic model to CiA 402.
#[derive(Debug, Clone, Default)]
pub struct Cia402Tables {
    pub(super) units: Vec<FixedUnit>,
    pub(crate) scalings: Vec<ScalingRule>,
    pub(super) drive: DriveDefaults,
    pub(super) words: Words,
    pub(crate) signals: Vec<SignalRule>,
    pub(crate) modes: Vec<ModeRule>,
    pub(crate) procedures: Vec<ProcedureRule>,
    pub(super) actions: Vec<ActionRule>,
    pub(crate) reports: Vec<ReportRule>,
    pub(crate) status: Vec<StatusRule>,
    pub(crate) faults: Vec<FaultRow>,
    pub(crate) parameters: Vec<ParameterRule>,
    pub(crate) captures: Vec<CaptureRule>,
    pub(crate) steps: Vec<StepRule>,
    /// Objects that no row binds, a family by its first number, with the reason.
    pub unbound: Vec<(u16, String)>,
    /// Those that no row binds for no reason.
    pub(crate) unanswered: Vec<u16>,
}

impl Cia402Tables {
    /// The tables for axes that only look at the encoder of the load.
    pub(crate) fn for_load(&self) -> Self {
        let mut tables = self.clone();
        for rule in &mut tables.signals {
            if let Some(load) = &rule.load {
                rule.value.clone_from(load);
            }
        }
        tables
    }
}

impl Cia402Tables {
    /// Where a signal is while the drive is in a mode of operation.
    pub(super) fn signal(&self, signal: Signal, mode: i8) -> Option<&SignalRule> {
        let mut rules = self.signals.iter().filter(|rule| rule.signal == signal);
        let general = rules.clone().find(|rule| rule.modes.is_empty());
        rules.find(|rule| rule.modes.contains(&mode)).or(general)
    }

    /// What the drive of an axis tells.
    pub(super) fn tells(&self, axis: &Cia402Axis) -> Tells {
        let usual = self.drive.tells;
        Tells {
            follows: axis.acknowledges.unwrap_or(usual.follows),
            voltage: axis.tells_voltage.unwrap_or(usual.voltage),
        }
    }

    /// Whether bit 4 of a drive of which the configuration says nothing reports that there is power.
    #[cfg(test)]
    pub(super) fn drive_tells_voltage(&self) -> bool {
        self.drive.tells.voltage
    }

    /// The operating modes that a controller can lead drives in.
    pub fn modes(&self) -> impl Iterator<Item = ModeSelection> + '_ {
        let first =
            |at: usize| !self.modes[..at].iter().any(|rule| rule.selection == self.modes[at].selection);
        let rules = self.modes.iter().enumerate().filter(move |(at, _)| first(*at));
        rules.map(|(_, rule)| rule.selection).take(MAX_MODES)
    }

    /// What statuswords say, the first that fits counts.
    pub(crate) fn reports(&self) -> &[ReportRule] {
        &self.reports
    }

    /// What error codes mean, the first that fits counts.
    #[must_use]
    pub fn faults(&self) -> &[FaultRow] {
        &self.faults
    }
}
