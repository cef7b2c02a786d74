//! CIP Motion <-> generic: the resolved mapping and the program of one axis.

use arrayvec::ArrayVec;
use bitflags::bitflags;
use profile_cip::device::drive_link::{DriveAction, TRIMS_MAX, Trims};
use profile_cip::device::fault_log::LogKind;
use profile_cip::wire::motion::CommandValues;
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{AxisCommand, AxisFeedback, Signal, StatusBits};
use profile_generic::inhibit::Inhibits;
use profile_generic::mode::OperatingMode;
use profile_generic::program::Conversion;
use profile_generic::ratio::{Outcome, Ratio, Rounding};
use profile_generic::scaling::WrapTracker;
use profile_generic::sequence::StopPlan;
use profile_generic::state::{DriveState, Request};

use super::attributes::behind;
use super::cip_events::EventProgram;
use super::cip_scaling::CipScaling;
use super::cip_tables::{CipTables, Served};
use super::device_link::{DRIVE_ACTIONS, bit, elements};
use super::dictionary::Access;

/// Elements of a data set: one per bit.
const ELEMENTS: usize = 8;

/// Codes of an enumeration in a nibble.
const NIBBLE: usize = 16;

/// Counts of a DINT.
const DINT_BITS: u32 = 32;

/// The most Axis Control codes a table names.
pub const MAX_REQUESTS: usize = 16;

/// The most rules for Axis Status bits.
pub const MAX_STATUS_RULES: usize = 48;

/// The most rules for Axis I/O Status bits.
pub const MAX_IO_STATUS_RULES: usize = 32;

/// The most fault causes a table names.
pub const MAX_FAULTS: usize = 128;

/// The most inhibits: the bits of [`Inhibits`].
pub const MAX_INHIBITS: usize = 32;

/// The most stopping actions a table names.
pub const MAX_STOPPINGS: usize = 8;

/// A value of the cyclic data block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CipValue {
    /// DINT.
    Dint(i32),
    /// REAL.
    Real(f32),
    /// LREAL.
    Lreal(f64),
}

bitflags! {
    /// Conditions of the axis state machine (Tables 5-2.97 and 5-2.98).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct CipConditions: u16 {
        /// Initialization is complete.
        const INITIALIZED = 1 << 0;
        /// The DC bus is up.
        const BUS_UP = 1 << 1;
        /// A start inhibit is active.
        const INHIBITED = 1 << 2;
        /// The start sequence is complete.
        const START_COMPLETE = 1 << 3;
        /// The stop sequence is complete.
        const STOP_COMPLETE = 1 << 4;
        /// A major fault is active.
        const FAULTED = 1 << 5;
        /// The shutdown is latched.
        const SHUTDOWN = 1 << 6;
        /// A test is active.
        const TEST_ACTIVE = 1 << 7;
    }
}

impl CipConditions {
    /// Every condition with its name in the tables.
    pub const NAMED: &'static [(&'static str, Self)] = &[
        ("initialized", Self::INITIALIZED),
        ("bus_up", Self::BUS_UP),
        ("inhibited", Self::INHIBITED),
        ("start_complete", Self::START_COMPLETE),
        ("stop_complete", Self::STOP_COMPLETE),
        ("faulted", Self::FAULTED),
        ("shutdown", Self::SHUTDOWN),
        ("test_active", Self::TEST_ACTIVE),
    ];
}

/// What a drive state means to the axis state machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CipState {
    /// Axis State (attribute 650) it leads to.
    pub axis_state: u8,
    /// Conditions that hold.
    pub conditions: CipConditions,
}

/// An Axis Control code and what it asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CipRequest {
    /// Axis Control code.
    pub axis_control: u8,
    /// Generic request; `None` when the device carries it out without the drive.
    pub request: Option<Request>,
    /// Axis Response code of success.
    pub axis_response: u8,
}

/// How CIP reports a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CipFault {
    /// A fault of the axis.
    Axis {
        /// Axis Fault Type (attribute 662).
        fault_type: u8,
        /// Axis Alarm Type (attribute 665), when the condition can also be an alarm.
        alarm_type: Option<u8>,
        /// Bit number in the table of that type: Axis Fault Code or Axis Alarm Code.
        code: u8,
    },
    /// Node Fault Code: a fault of all axes of the device.
    Node(u8),
}

impl CipFault {
    /// Whether it is the fault of an axis with this Axis Fault Type and code.
    pub const fn is(self, wanted_type: u8, wanted_code: u8) -> bool {
        match self {
            Self::Axis { fault_type, code, .. } => fault_type == wanted_type && code == wanted_code,
            Self::Node(_) => false,
        }
    }
}

/// A stopping action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CipStopping {
    /// Stopping Action code (attribute 610).
    pub code: u8,
    /// How the axis stops.
    pub plan: StopPlan,
    /// The reaction to an Abort request.
    pub abort: Reaction,
}

/// What happens when a value is not there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MissingValue {
    /// It stays absent.
    Absent,
    /// It is sent as zero.
    Zero,
}

#[derive(Debug, Clone, Copy)]
struct Element {
    signal: Signal,
    conversion: Conversion,
    wraps: bool,
    missing: MissingValue,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct StatusRule {
    pub status: StatusBits,
    pub mode: Option<OperatingMode>,
    pub axis_status: u32,
}

/// A bit of Axis I/O Status.
#[derive(Debug, Clone, Copy)]
pub(super) struct IoStatusRule {
    /// Bits that must all be set.
    pub status: StatusBits,
    /// Bits none of which may be set.
    pub without: StatusBits,
    /// The bit as it stands in the word, and for a controller that has inverted the direction.
    pub bits: [u32; 2],
}

#[derive(Debug, Clone, Copy)]
pub(super) struct InhibitRule {
    pub inhibit: Inhibits,
    pub standard: u16,
    pub manufacturer: u16,
}

/// What happened to the values of one update on their way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CipReport {
    /// Values that were clamped.
    pub saturated: u32,
    /// Values that were infinite or not a number: left out.
    pub not_finite: u32,
    /// Elements that no row maps, or of another type than the row says: left out.
    pub unmapped: u32,
    /// Values that were not there.
    pub missing: u32,
    /// The signal that was clamped last.
    pub last_saturated: Option<Signal>,
}

impl CipReport {
    /// Whether every value arrived as it was meant.
    pub const fn is_clean(&self) -> bool {
        self.saturated == 0 && self.not_finite == 0 && self.unmapped == 0 && self.missing == 0
    }

    fn saturated(&mut self, signal: Signal) {
        self.saturated = self.saturated.saturating_add(1);
        self.last_saturated = Some(signal);
    }
}

/// The unrolled count of the command position; one per connection and axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CipTrackers {
    position: WrapTracker,
    /// What the controller has moved its reference system by, counts.
    reference: i64,
    /// Counts between the cycles that the controller counts and the unrolled count; `None` until it reports a count.
    anchor: Option<i64>,
}

impl CipTrackers {
    /// The controller counts from here on from where the axis is: `counts` of its position, without what the controller
    /// has moved its reference system by. The next command is taken within half a cycle of it, or within half the range
    /// of a DINT.
    pub fn start(&mut self, counts: i64, reference: i64) {
        // The first value after a restart is taken as it is.
        self.position.restart();
        self.position.update(counts.saturating_add(reference));
        self.reference = reference;
        self.anchor = None;
    }

    /// Commands come in another reference system: what they have moved on is distinguished from the change.
    fn change_reference(&mut self, reference: i64) {
        if reference != self.reference {
            self.position.shift(reference.wrapping_sub(self.reference));
            self.reference = reference;
            // Where the controller begins to count the cycles of the new system is its own affair.
            self.anchor = None;
        }
    }

    /// The unrolled count of a commanded position.
    ///
    /// With the count of cycles every step is exact, however many cycles it leads over. What the controller calls cycle
    /// zero is found by the first count: the axis stands within half a cycle of its first command.
    fn unroll(&mut self, counts: i64, cycle: Option<i64>, cycles: Option<i64>) -> i64 {
        let near = self.position.update(counts);
        let (Some(cycle), Some(cycles)) = (cycle, cycles) else { return near };
        let told = cycles.saturating_mul(cycle).saturating_add(counts);
        let anchor = *self.anchor.get_or_insert(near.wrapping_sub(told));
        let total = told.saturating_add(anchor);
        self.position.set_total(total);
        total
    }
}

/// The program of one axis: flat, without names, hashes or allocation.
#[derive(Debug, Clone)]
pub struct CipProgram {
    commands: [Option<Element>; ELEMENTS],
    /// Attributes that are trims, their signals, and what turns them into these.
    trims: ArrayVec<(u16, Signal, Conversion), TRIMS_MAX>,
    actuals: [Option<Element>; ELEMENTS],
    /// Counts after which positions wrap; `None` for the range of a DINT.
    unwind: Option<i64>,
    tracker: WrapTracker,
    position_counts: Ratio,
    /// A position count in nanounits.
    count: i64,
    modes: [Option<OperatingMode>; NIBBLE],
    requests: ArrayVec<CipRequest, MAX_REQUESTS>,
    states: [CipState; DriveState::ALL.len()],
    status: ArrayVec<StatusRule, MAX_STATUS_RULES>,
    io_status: ArrayVec<IoStatusRule, MAX_IO_STATUS_RULES>,
    /// Whether the controller has inverted the direction.
    inverted: bool,
    /// Sorted by cause.
    faults: ArrayVec<(FaultCause, CipFault), MAX_FAULTS>,
    reactions: [u8; Reaction::ALL.len()],
    inhibits: ArrayVec<InhibitRule, MAX_INHIBITS>,
    stoppings: ArrayVec<CipStopping, MAX_STOPPINGS>,
    pub(super) drive_actions: [(DriveAction, Option<Request>); DRIVE_ACTIONS.len()],
    events: EventProgram,
}

impl CipProgram {
    /// The program for an axis with this scaling.
    pub(super) fn compile(tables: &CipTables, scaling: &CipScaling) -> Option<Self> {
        let position_counts = scaling.nanounits_per_count().inverse()?;
        let opposite = |cause| {
            let other = tables.opposites.iter().find(|(known, _)| scaling.inverted && *known == cause);
            other.map_or(cause, |(_, other)| *other)
        };
        let row = |cause| tables.faults.iter().find(|(known, _)| *known == cause);
        let told = |(cause, own): &(FaultCause, CipFault)| {
            (*cause, row(opposite(*cause)).map_or(*own, |(_, fault)| *fault))
        };
        let mut program = Self {
            commands: [None; ELEMENTS],
            trims: ArrayVec::new(),
            actuals: [None; ELEMENTS],
            unwind: scaling.unwind,
            tracker: match scaling.unwind {
                Some(counts) => WrapTracker::new(counts)?,
                None => WrapTracker::of_bits(DINT_BITS)?,
            },
            position_counts,
            count: scaling.nanounits_per_count().convert(1, Rounding::Nearest).value.saturating_abs().max(1),
            modes: tables.modes,
            requests: tables.requests.iter().copied().collect(),
            states: tables.states,
            status: tables.status.iter().copied().collect(),
            io_status: tables.io_status.iter().copied().collect(),
            inverted: scaling.inverted,
            faults: tables.faults.iter().map(told).collect(),
            reactions: tables.reactions,
            inhibits: tables.inhibits.iter().copied().collect(),
            stoppings: tables.stoppings.iter().copied().collect(),
            drive_actions: tables.drive_actions,
            events: EventProgram::compile(&tables.events, scaling)?,
        };
        for row in tables.attributes.iter().filter(|row| row.attribute.access == Access::SetCyclic) {
            if let (Served::Signal { signal, unit, .. }, turns) = behind(tables, row, scaling) {
                let to_generic = Conversion::new(scaling.convert(*unit, turns)?);
                program.trims.try_push((row.attribute.id, *signal, to_generic)).ok()?;
            }
        }
        for row in &tables.cyclic {
            let to_generic = scaling.convert(row.unit, row.turns)?;
            let conversion = if row.to_generic { to_generic } else { to_generic.inverse()? };
            let element = Element {
                signal: row.signal,
                conversion: Conversion::new(conversion),
                wraps: row.wraps,
                missing: row.missing,
            };
            let set = if row.to_generic { &mut program.commands } else { &mut program.actuals };
            *set.get_mut(usize::from(row.bit))? = Some(element);
        }
        Some(program)
    }

    /// Trackers for [`CipProgram::decode`].
    pub fn trackers(&self) -> CipTrackers {
        CipTrackers { position: self.tracker, reference: 0, anchor: None }
    }

    /// Puts the values of a Command Data Set into a command. Values that are not there become absent.
    /// `reference` is subtracted from positions, in counts: what the controller has moved its reference
    /// system by. A cyclic axis moves the short way to its next position, unless the Unwind Cycle Count says how many
    /// cycles it is; then every position is exact.
    pub fn decode(
        &self,
        values: &CommandValues,
        reference: i64,
        trackers: &mut CipTrackers,
        command: &mut AxisCommand,
    ) -> CipReport {
        let cycles = values.unwind_count.map(i64::from);
        self.decode_elements(elements(values), cycles, reference, trackers, command)
    }

    /// [`CipProgram::decode`] of values by their bits in the Command Data Set; `cycles` is the Unwind Cycle Count.
    pub(super) fn decode_elements(
        &self,
        values: impl IntoIterator<Item = (usize, CipValue)>,
        cycles: Option<i64>,
        reference: i64,
        trackers: &mut CipTrackers,
        command: &mut AxisCommand,
    ) -> CipReport {
        let mut report = CipReport::default();
        command.present = profile_generic::image::CommandSet::empty();
        trackers.change_reference(reference);
        for (bit, value) in values {
            let Some(element) = self.commands.get(bit).and_then(Option::as_ref) else {
                // Elements of the position say how to take it; they are no values of their own.
                report.unmapped += u32::from(!bit::OF_POSITION.contains(&bit));
                continue;
            };
            let unroll = |counts| trackers.unroll(counts, self.unwind, cycles).saturating_sub(reference);
            let Some(outcome) = element.decode(value, unroll) else {
                report.not_finite += 1;
                continue;
            };
            if !command.set(element.signal, outcome.value) || outcome.saturated {
                report.saturated(element.signal);
            }
        }
        report
    }

    /// Puts the trims of an update into a command, behind [`CipProgram::decode`]: those that are not there stay absent.
    pub fn decode_trims(&self, trims: &Trims, command: &mut AxisCommand) -> CipReport {
        let mut report = CipReport::default();
        for (attribute, value) in trims.iter() {
            let Some((_, signal, to_generic)) = self.trims.iter().find(|(known, ..)| *known == attribute)
            else {
                report.unmapped += 1;
                continue;
            };
            let Some(outcome) = to_generic.convert_f64(value) else {
                report.not_finite += 1;
                continue;
            };
            if !command.set(*signal, outcome.value) || outcome.saturated {
                report.saturated(*signal);
            }
        }
        report
    }

    /// The whole counts of an actual value, not wrapped; 0 when it is not there.
    pub(super) fn actual_counts(&self, bit: usize, feedback: &AxisFeedback, report: &mut CipReport) -> i64 {
        let Some((element, generic)) = self.actual(bit, feedback, report) else { return 0 };
        let outcome = element.conversion.convert(generic);
        if outcome.saturated {
            report.saturated(element.signal);
        }
        outcome.value
    }

    /// An actual value as a REAL; `None` when it is not there, unless its row wants it to be zero then.
    pub(super) fn actual_real(
        &self,
        bit: usize,
        feedback: &AxisFeedback,
        report: &mut CipReport,
    ) -> Option<f32> {
        let missing = self.actuals.get(bit)?.as_ref()?.missing;
        let Some((element, generic)) = self.actual(bit, feedback, report) else {
            return (missing == MissingValue::Zero).then_some(0.0);
        };
        let (outcome, saturated) = element.conversion.convert_to_f32(generic);
        if saturated {
            report.saturated(element.signal);
        }
        Some(outcome.value)
    }

    fn actual(&self, bit: usize, feedback: &AxisFeedback, report: &mut CipReport) -> Option<(&Element, i64)> {
        let element = self.actuals.get(bit)?.as_ref()?;
        let value = feedback.get(element.signal);
        if value.is_none() {
            report.missing += 1;
        }
        Some((element, value?))
    }

    /// Counts after which a cyclic axis is where it was; `None` for an axis that is not cyclic.
    pub(super) fn unwind(&self) -> Option<u32> {
        self.unwind.and_then(|counts| u32::try_from(counts).ok())
    }

    /// Counts of the controller in a generic position.
    pub fn counts(&self, nanounits: i64) -> Outcome {
        Conversion::new(self.position_counts).convert(nanounits)
    }

    /// A position count of the controller in nanounits, at least 1.
    pub fn count(&self) -> i64 {
        self.count
    }

    /// The operating mode of a Control Mode; `None` when the device does not know the mode.
    pub fn mode(&self, control_mode: u8) -> Option<OperatingMode> {
        self.modes.get(usize::from(control_mode & 0x0F)).copied().flatten()
    }

    /// The row of an Axis Control code; `None` when the code is reserved.
    pub fn request(&self, axis_control: u8) -> Option<CipRequest> {
        self.requests.iter().find(|row| row.axis_control == axis_control).copied()
    }

    /// What a drive state means to the axis state machine.
    pub fn state(&self, state: DriveState) -> CipState {
        DriveState::ALL
            .iter()
            .position(|known| *known == state)
            .and_then(|at| self.states.get(at))
            .copied()
            .unwrap_or_default()
    }

    /// The Axis Status bits (attribute 651) that follow from the drive.
    pub fn axis_status(&self, feedback: &AxisFeedback) -> u32 {
        self.status
            .iter()
            .filter(|rule| feedback.status.contains(rule.status))
            .filter(|rule| rule.mode.is_none_or(|mode| mode == feedback.mode))
            .fold(0, |word, rule| word | rule.axis_status)
    }

    /// The Axis I/O Status bits (attribute 653) that follow from the drive.
    pub fn io_status(&self, feedback: &AxisFeedback) -> u32 {
        let rules = self.io_status.iter();
        rules
            .filter(|rule| feedback.status.contains(rule.status) && !feedback.status.intersects(rule.without))
            .fold(0, |word, rule| word | rule.bits[usize::from(self.inverted)])
    }

    /// How CIP reports a cause; `None` for a cause that no row names.
    pub fn fault(&self, cause: FaultCause) -> Option<CipFault> {
        let at = self.faults.binary_search_by_key(&cause, |(known, _)| *known).ok()?;
        self.faults.get(at).map(|(_, fault)| *fault)
    }

    /// The cause that CIP reports as this fault type and code; the first one where several share it.
    pub fn cause(&self, fault_type: u8, code: u8) -> Option<FaultCause> {
        self.faults.iter().find(|(_, fault)| fault.is(fault_type, code)).map(|(cause, _)| *cause)
    }

    /// The cause of an entry of the log. An alarm has the bits of the fault of its table; start inhibits are no causes.
    pub fn cause_of(&self, kind: LogKind, code: u8) -> Option<FaultCause> {
        match kind {
            LogKind::Fault(fault_type) => self.cause(fault_type.0, code),
            LogKind::Alarm(wanted) => {
                let is = |fault: &CipFault| match *fault {
                    CipFault::Axis { alarm_type, code: bit, .. } => {
                        alarm_type == Some(wanted.0) && bit == code
                    }
                    CipFault::Node(_) => false,
                };
                self.faults.iter().find(|(_, fault)| is(fault)).map(|(cause, _)| *cause)
            }
        }
    }

    /// The reaction that carries out an Axis Fault Action: the mildest one that gives up as much control in each nibble.
    pub fn reaction(&self, action: u8) -> Reaction {
        let enough = |reaction: &&Reaction| {
            let known = self.fault_action(**reaction);
            reaction.stops() && known & 0x0F >= action & 0x0F && known >> 4 >= action >> 4
        };
        Reaction::ALL.iter().find(enough).copied().unwrap_or(Reaction::Shutdown)
    }

    /// The Axis Fault Action (attribute 668) of a reaction.
    pub fn fault_action(&self, reaction: Reaction) -> u8 {
        let at = Reaction::ALL.iter().position(|known| *known == reaction);
        at.and_then(|at| self.reactions.get(at)).copied().unwrap_or(0)
    }

    /// Start Inhibits and Start Inhibits - Mfg (attributes 676 and 677).
    pub fn start_inhibits(&self, inhibits: Inhibits) -> (u16, u16) {
        let active = self.inhibits.iter().filter(|rule| inhibits.contains(rule.inhibit));
        active.fold((0, 0), |(standard, manufacturer), rule| {
            (standard | rule.standard, manufacturer | rule.manufacturer)
        })
    }

    /// Events and what brings them.
    pub fn events(&self) -> &EventProgram {
        &self.events
    }

    /// What a Stopping Action does.
    pub fn stopping(&self, code: u8) -> Option<CipStopping> {
        self.stoppings.iter().find(|row| row.code == code).copied()
    }

    /// Every Stopping Action the device knows.
    pub fn stoppings(&self) -> &[CipStopping] {
        &self.stoppings
    }
}

impl Element {
    fn decode(&self, value: CipValue, unroll: impl FnOnce(i64) -> i64) -> Option<Outcome> {
        if !self.wraps {
            return match value {
                CipValue::Dint(value) => Some(self.conversion.convert(i64::from(value))),
                CipValue::Real(value) => self.conversion.convert_f64(f64::from(value)),
                CipValue::Lreal(value) => self.conversion.convert_f64(value),
            };
        }
        let (whole, fraction) = match value {
            CipValue::Dint(value) => (i64::from(value), 0.0),
            CipValue::Real(value) => split(f64::from(value))?,
            CipValue::Lreal(value) => split(value)?,
        };
        let counts = self.conversion.convert(unroll(whole));
        if fraction == 0.0 {
            return Some(counts);
        }
        // The fraction of a count is converted by itself: less than one nanounit is lost, and nothing adds
        // up, as the count stays an integer.
        let rest = self.conversion.convert_f64(fraction)?;
        let sum = counts.value.checked_add(rest.value);
        let saturated = counts.saturated || rest.saturated || sum.is_none();
        let inexact = counts.inexact || rest.inexact;
        Some(Outcome { value: sum.unwrap_or(counts.value), saturated, inexact })
    }
}

/// The whole counts in a double, and the rest; `None` when it is not finite or holds more than a DINT does.
fn split(value: f64) -> Option<(i64, f64)> {
    let whole = value.floor();
    let counts = Conversion::IDENTITY.within(i64::from(i32::MIN), i64::from(i32::MAX)).convert_f64(whole)?;
    (!counts.saturated).then_some((counts.value, value - whole))
}
