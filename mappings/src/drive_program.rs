//! The program of one drive: how its telegrams are made and read, whatever its profile. Compiled from the tables before the
//! cycle starts; in use it knows no names, looks nothing up and allocates nothing.

use arrayvec::ArrayVec;
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{AxisCommand, AxisFeedback, CommandSet, Signal, StatusBits};
use profile_generic::mode::ModeSelection;
use profile_generic::parameter::Parameter;
use profile_generic::program::{
    ActionTable, BitPattern, CommandProgram, Conversion, ConversionReport, FeedbackProgram, Field,
    MAX_FIELDS, StateTable, Trackers, Width,
};
use profile_generic::quantity::Velocity;
use profile_generic::state::{Action, Report};
use profile_generic::time::DurationNs;
use profile_sercos::wire::idn::Idn;

use super::attributes::Number;
use super::capture_program::{CaptureProgram, Place};
use super::feedback::FeedbackUse;
use super::item::Item;
use super::mechanics::{MechanicalFact, Mechanics};
use crate::own_values::OF_CONFIGURATION;

/// Operation modes of one axis: the slots S-0-0032..35 and S-0-0284..287.
pub const MAX_MODES: usize = 8;

/// The most procedures that stand for modes of one axis.
pub const PROCEDURES_MAX: usize = 4;

/// The most procedure commands of one of them.
pub const PROCEDURE_COMMANDS_MAX: usize = 4;

/// The most ways in which a status reports that a procedure has failed.
pub const PROCEDURE_FAILURES_MAX: usize = 4;

/// Bytes of the control and of the status word.
pub(super) const WORD_BYTES: u16 = 2;

/// The most rows for reports.
pub const REPORTS_MAX: usize = 32;

/// The most rows for actions that depend on what the drive shows.
pub const STEPS_MAX: usize = 16;

/// Where the operating mode stands in the control and the status as the rows of a program see them: above the 16 bits of the
/// word, for drives that have an octet of its own for it.
pub const MODE_SHIFT: u32 = 16;

/// The most rows for status bits.
pub const MAX_STATUS_ROWS: usize = 32;

/// The most words with status bits beside the status word.
pub const STATUS_WORDS_MAX: usize = 2;

/// The most rows for faults and warnings.
pub const MAX_FAULT_ROWS: usize = 160;

/// What stands in the two telegrams of an axis, in order. The control and the status word come first.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Telegram {
    /// From the master.
    pub command: Vec<Item>,
    /// From the drive.
    pub feedback: Vec<Item>,
    /// Bytes of the master's values, without the connection control word.
    pub command_bytes: u16,
    /// Bytes of the drive's values, without the connection control word.
    pub feedback_bytes: u16,
}

/// A parameter that the drive holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParameterEntry {
    /// The parameter.
    pub parameter: Parameter,
    /// Where the drive keeps it.
    pub item: Item,
    /// How it lies there.
    pub width: Width,
    /// From the generic unit, when it can be written.
    pub to_drive: Option<Conversion>,
    /// To the generic unit, when it can be read.
    pub from_drive: Option<Conversion>,
}

impl ParameterEntry {
    /// The bytes as the drive keeps them; those that count, and whether the value was clamped. `None` when the
    /// parameter cannot be written.
    pub fn encode(&self, generic: i64) -> Option<([u8; 8], usize, bool)> {
        let to_drive = self.to_drive?;
        let mut bytes = [0; 8];
        let clamped = match self.width {
            Width::F32 => {
                let (outcome, saturated) = to_drive.convert_to_f32(generic);
                bytes[..4].copy_from_slice(&outcome.value.to_le_bytes());
                saturated
            }
            Width::F64 => {
                let (outcome, saturated) = to_drive.convert_to_f64(generic);
                bytes = outcome.value.to_le_bytes();
                saturated
            }
            _ => {
                let outcome = to_drive.convert(generic);
                let (min, max) = self.width.range();
                let value = outcome.value.clamp(min, max);
                bytes = value.to_le_bytes();
                outcome.saturated || value != outcome.value
            }
        };
        Some((bytes, self.width.bytes(), clamped))
    }

    /// The generic value of the bytes that the drive keeps. `None` when the parameter cannot be read or has another
    /// length, and for a floating point number that is none or does not fit.
    pub fn decode(&self, data: &[u8]) -> Option<i64> {
        let from_drive = self.from_drive?;
        let real = match (self.width, data) {
            (Width::F32, &[a, b, c, d]) => Some(f64::from(f32::from_le_bytes([a, b, c, d]))),
            (Width::F64, &[a, b, c, d, e, f, g, h]) => Some(f64::from_le_bytes([a, b, c, d, e, f, g, h])),
            _ => None,
        };
        match real {
            Some(real) => {
                let outcome = from_drive.convert_f64(real).filter(|outcome| !outcome.saturated);
                outcome.map(|outcome| outcome.value)
            }
            None => Some(from_drive.convert(self.width.integer(data)?).value),
        }
    }
}

/// How a drive takes a target over: it is asked by bits of the control word and answers by bits of the status word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Handshake {
    /// The bits that ask.
    pub ask: BitPattern,
    /// The bits that answer.
    pub taken: BitPattern,
}

/// What the drive is to do in a cycle.
#[derive(Debug, Clone, Copy)]
pub struct Order {
    /// The action.
    pub action: Action,
    /// The mode that it is told in place of the chosen one.
    pub told: Option<ModeSelection>,
    /// It is asked to take its target over, or to carry out its procedure.
    pub asks: bool,
}

impl From<Action> for Order {
    fn from(action: Action) -> Self {
        Self { action, told: None, asks: false }
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct ModeEntry {
    pub selection: ModeSelection,
    pub control: BitPattern,
    pub status: BitPattern,
    /// Bits of the control word that belong to modes, as they stand in this one while the drive is in operation.
    pub bits: BitPattern,
    /// How it takes over what it goes to by itself, or is told to begin.
    pub handshake: Option<Handshake>,
    /// Its signals without which it must not be chosen.
    pub needs: CommandSet,
    /// Its signals that the telegram carries.
    pub carried: CommandSet,
}

/// What an action writes while the drive shows something.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepRow {
    pub action: Action,
    /// Bits of the status.
    pub when: BitPattern,
    /// Bits of the control.
    pub control: BitPattern,
    /// Those in their place as long as the drive does not show the mode that it is told: torque in another mode would follow values
    /// that are meant for no one.
    pub other_mode: Option<BitPattern>,
}

/// What is kept of a drive's telegrams from one to the next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CachedStatus {
    /// Unrolls the values that wrap.
    trackers: Trackers,
    /// What the drive showed last, and what that says: it seldom shows anything new.
    last: Option<(Shown, Said)>,
}

impl CachedStatus {
    /// Forgets where all counters were: the next values are taken as they are.
    pub fn restart(&mut self) {
        self.trackers.restart();
    }
}

/// All that state, mode and status bits of a drive follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shown {
    status: u32,
    /// The words beside the status, those that the telegram is long enough for.
    words: [Option<u32>; STATUS_WORDS_MAX],
    /// It carries out a procedure.
    led: bool,
}

/// What a drive says by what it shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Said {
    report: Report,
    mode: ModeSelection,
    bits: StatusBits,
}

/// A status bit in a word of the telegram.
#[derive(Debug, Clone, Copy)]
pub(super) struct StatusRow {
    /// The word beside the status word; `None` for the status word.
    pub word: Option<Item>,
    pub pattern: BitPattern,
    pub bit: StatusBits,
}

/// A mode that is carried out by procedure commands.
#[derive(Debug, Clone)]
pub struct Procedure {
    /// What it stands for.
    pub selection: ModeSelection,
    /// The mode in which the controller moves the axis while the first command is in process; the drive moves it where
    /// there is none.
    pub led_in: Option<ModeSelection>,
    /// What it consists of.
    pub by: ProcedureBy,
}

/// What a procedure consists of.
#[derive(Debug, Clone)]
pub enum ProcedureBy {
    /// Procedure commands, in their order.
    Commands(ArrayVec<Item, PROCEDURE_COMMANDS_MAX>),
    /// A mode of its own that the drive ends by itself.
    Mode(ModeProcedure),
}

/// A mode that a drive ends by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModeProcedure {
    /// What a status shows in the mode.
    pub shown: BitPattern,
    /// What a status shows when it has ended well.
    pub done: BitPattern,
    /// What a status shows when it has failed; any of them.
    pub failed: [Option<BitPattern>; PROCEDURE_FAILURES_MAX],
    /// After this time it has failed as well.
    pub time_out: DurationNs,
}

impl ModeProcedure {
    /// Whether a status shows that it has failed.
    #[must_use]
    pub fn has_failed(&self, status: u32) -> bool {
        self.shown.matches(status) && self.failed.iter().flatten().any(|pattern| pattern.matches(status))
    }

    /// Whether a status shows that it has ended well.
    #[must_use]
    pub fn is_done(&self, status: u32) -> bool {
        self.shown.matches(status) && self.done.matches(status)
    }
}

impl Procedure {
    /// Its procedure commands.
    #[must_use]
    pub fn commands(&self) -> &[Item] {
        match &self.by {
            ProcedureBy::Commands(commands) => commands,
            ProcedureBy::Mode(_) => &[],
        }
    }
}

/// The program of one axis: flat, without names, hashes or allocation in use.
#[derive(Debug, Clone)]
pub struct DriveProgram {
    /// What the telegrams carry.
    pub telegram: Telegram,
    /// Values from the master, behind the control word.
    pub command: CommandProgram,
    /// Values from the drive, behind the status word.
    pub feedback: FeedbackProgram,
    /// The bits of the control word for each action.
    pub actions: ActionTable,
    /// The same while the drive shows something; they go before.
    pub(super) steps: ArrayVec<StepRow, STEPS_MAX>,
    /// Octets of the operating mode in both telegrams, where the drive has such.
    pub(super) mode_octets: Option<[u16; 2]>,
    /// Where the control and the status word begin.
    pub(super) words_at: [u16; 2],
    /// What carries each value to and from the drive, where it is not their order in the telegrams.
    pub(super) carriers: Option<[Vec<Item>; 2]>,
    /// What a status word says.
    pub reports: StateTable<REPORTS_MAX>,
    /// What it says while the drive carries out a procedure.
    pub(super) led_reports: StateTable<REPORTS_MAX>,
    pub(super) procedures: ArrayVec<Procedure, PROCEDURES_MAX>,
    pub(super) modes: ArrayVec<ModeEntry, MAX_MODES>,
    pub(super) status: ArrayVec<StatusRow, MAX_STATUS_ROWS>,
    pub(super) status_words: ArrayVec<Place, STATUS_WORDS_MAX>,
    pub(super) known_status: StatusBits,
    /// A bit of its own shows whether its power stage is supplied, also while it is faulted or disabled.
    pub(super) has_power_bit: bool,
    pub(super) faults: ArrayVec<FaultRow, MAX_FAULT_ROWS>,
    pub(super) diagnosis: ArrayVec<Item, 2>,
    pub(super) commands: ArrayVec<(Action, Item), { Action::ALL.len() }>,
    pub(super) captures: CaptureProgram,
    pub(super) parameters: Vec<ParameterEntry>,
    /// Values of parameters that the drive does not show, in the order of their numbers.
    data: ArrayVec<(Parameter, i64), DATA_MAX>,
    /// What lies between its motor and its load, where that is known.
    pub mechanics: Option<Mechanics>,
    /// Whose encoder its position and velocity are of.
    pub encoders: FeedbackUse,
    /// Its loops have a feed-forward of the acceleration of their own.
    pub(super) feeds_forward: bool,
    pub(super) position_step: Option<i64>,
    pub(super) acknowledges: bool,
    /// Set-point and target of the position stand in one place of the telegram.
    pub(super) shares_target: bool,
}

/// Most values of parameters that a drive does not show: those of the configuration, the number of the power stage, and the encoder that an
/// axis goes by.
pub const DATA_MAX: usize = OF_CONFIGURATION.len() + 2;

/// A fault or warning in a diagnostic word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultRow {
    /// The word.
    pub word: Item,
    /// Bits of the word.
    pub pattern: BitPattern,
    /// What they mean.
    pub cause: FaultCause,
    /// What happens then.
    pub reaction: Reaction,
}

impl DriveProgram {
    /// A program for these telegrams that knows nothing yet.
    pub(super) fn new(telegram: Telegram, acknowledges: bool) -> Self {
        Self {
            telegram,
            command: CommandProgram::new(),
            feedback: FeedbackProgram::new(),
            actions: ActionTable::new(),
            steps: ArrayVec::new(),
            mode_octets: None,
            words_at: [0; 2],
            carriers: None,
            reports: StateTable::new(),
            led_reports: StateTable::new(),
            procedures: ArrayVec::new(),
            modes: ArrayVec::new(),
            status: ArrayVec::new(),
            status_words: ArrayVec::new(),
            known_status: StatusBits::empty(),
            has_power_bit: false,
            faults: ArrayVec::new(),
            diagnosis: ArrayVec::new(),
            commands: ArrayVec::new(),
            captures: CaptureProgram::default(),
            parameters: Vec::new(),
            data: ArrayVec::new(),
            mechanics: None,
            encoders: FeedbackUse::Motor,
            feeds_forward: false,
            position_step: None,
            acknowledges,
            shares_target: false,
        }
    }

    /// Whether the gateway can go by a parameter itself that the drive lacks: a watched torque has to be reported, a Stopping Torque takes
    /// limits to compare it with.
    #[must_use]
    pub fn can_go_by(&self, parameter: Parameter) -> bool {
        match parameter {
            Parameter::OVER_TORQUE_LIMIT | Parameter::OVER_TORQUE_LIMIT_TIME => {
                self.feedback.fields().any(|field| field.signal == Signal::TorqueActual)
            }
            Parameter::TORQUE_THRESHOLD
            | Parameter::UNDER_TORQUE_LIMIT
            | Parameter::UNDER_TORQUE_LIMIT_TIME => self.tells(Signal::TorqueActual),
            Parameter::VELOCITY_THRESHOLD => {
                self.tells(Signal::VelocityActual) || self.derives(Signal::VelocityActual)
            }
            Parameter::OVER_SPEED_USER_LIMIT | Parameter::ZERO_SPEED => self.rated_velocity().is_some(),
            Parameter::MOTOR_TEMPERATURE_USER_LIMIT => {
                self.tells(Signal::Temperature) || self.reads(Parameter::MOTOR_TEMPERATURE)
            }
            Parameter::DRIVE_TEMPERATURE_USER_LIMIT => self.reads(Parameter::DRIVE_TEMPERATURE),
            Parameter::BUS_OVERVOLTAGE_USER_LIMIT | Parameter::BUS_UNDERVOLTAGE_USER_LIMIT => {
                self.datum(Parameter::BUS_NOMINAL_VOLTAGE).is_some()
                    && (self.tells(Signal::BusVoltage) || self.reads(Parameter::BUS_VOLTAGE))
            }
            Parameter::STOPPING_TORQUE => {
                let limits = [Parameter::TORQUE_LIMIT_POSITIVE, Parameter::TORQUE_LIMIT_NEGATIVE];
                limits.iter().all(|limit| self.parameter(*limit).is_some())
            }
            Parameter::SYSTEM_INERTIA => {
                let torque = self.feedback.fields().any(|field| field.signal == Signal::TorqueActual);
                let is_used = torque || self.can_go_by(Parameter::ACCELERATION_FEED_FORWARD_GAIN);
                is_used && self.has_parameters() && self.motor_turns_per_unit().is_some()
            }
            Parameter::ACCELERATION_FEED_FORWARD_GAIN => {
                let carries = self.command.fields().any(|field| field.signal == Signal::TorqueOffset);
                let has_inertia = self.parameter(Parameter::SYSTEM_INERTIA).is_some();
                carries && !self.feeds_forward && !has_inertia && self.motor_turns_per_unit().is_some()
            }
            Parameter::FEEDBACK_ACCELERATION_FILTER => self.derives(Signal::AccelerationActual),
            Parameter::LOAD_FEEDBACK_UNIT
            | Parameter::LOAD_FEEDBACK_RESOLUTION
            | Parameter::LOAD_FEEDBACK_INTERPOLATION => self.has_load_encoder(),
            _ => true,
        }
    }

    /// Whether the drive shows an encoder of the load.
    fn has_load_encoder(&self) -> bool {
        self.parameter(Parameter::LOAD_POSITION_ACTUAL).is_some() || self.encoders != FeedbackUse::Motor
    }

    /// Sets the use of the encoders. A CiA 402 drive whose loop is closed over the encoder of the load shows another one beside it, which
    /// is not the load's.
    pub(crate) fn set_encoders(&mut self, feedback: FeedbackUse, only_looks: bool) {
        self.encoders = feedback;
        if feedback != FeedbackUse::Motor && !only_looks {
            const OF_LOAD: [Parameter; 2] =
                [Parameter::LOAD_POSITION_ACTUAL, Parameter::LOAD_VELOCITY_ACTUAL];
            self.parameters.retain(|entry| !OF_LOAD.contains(&entry.parameter));
        }
    }

    /// Whether the drive has a parameter that can be read.
    fn reads(&self, parameter: Parameter) -> bool {
        self.parameter(parameter).is_some_and(|held| held.from_drive.is_some())
    }

    /// What is missing where the gateway cannot go by a parameter: a key of the configuration, or a value of the drive.
    #[must_use]
    pub fn lacks(&self, parameter: Parameter) -> &'static str {
        match parameter {
            Parameter::OVER_SPEED_USER_LIMIT | Parameter::ZERO_SPEED => {
                "`rated_speed` of `[axis.motor]` is not configured"
            }
            Parameter::BUS_OVERVOLTAGE_USER_LIMIT | Parameter::BUS_UNDERVOLTAGE_USER_LIMIT
                if self.datum(Parameter::BUS_NOMINAL_VOLTAGE).is_none() =>
            {
                "`bus_voltage` of `[axis.converter]` is not configured"
            }
            _ => "the drive does not show what it goes by",
        }
    }

    /// Rated velocity of the motor as a velocity of the axis, by the nameplate in the configuration; `None` where nobody knows it.
    #[must_use]
    pub fn rated_velocity(&self) -> Option<Velocity> {
        if let Some(velocity) = self.datum(Parameter::MOTOR_LINEAR_RATED_VELOCITY) {
            return Some(Velocity(velocity));
        }
        const TURN: i128 = 1_000_000_000_000_000;
        let of_motor = i128::from(self.datum(Parameter::MOTOR_RATED_VELOCITY)?);
        let turns = i128::from(self.motor_turns_per_unit().filter(|turns| *turns > 0)?);
        i64::try_from(of_motor * TURN / turns).ok().map(Velocity)
    }

    /// Whether the drive does by itself, in a unit of its own, what a parameter that it lacks is for.
    #[must_use]
    pub fn is_own(&self, parameter: Parameter) -> bool {
        parameter == Parameter::ACCELERATION_FEED_FORWARD_GAIN && self.feeds_forward
    }

    /// Whether the gateway has a value itself that the drive lacks, for what is computed from it.
    #[must_use]
    pub fn keeps(&self, parameter: Parameter) -> bool {
        let is_kept = match parameter {
            Parameter::SYSTEM_INERTIA | Parameter::ACCELERATION_FEED_FORWARD_GAIN => {
                self.can_go_by(parameter)
            }
            Parameter::MOTOR_USE => {
                self.tells(Signal::TorqueActual) && self.datum(Parameter::MOTOR_THERMAL_TIME).is_some()
            }
            Parameter::DRIVE_USE => {
                self.tells(Signal::TorqueActual) && self.datum(Parameter::DRIVE_THERMAL_TIME).is_some()
            }
            Parameter::HEARD_TIME | Parameter::COUNTED_RUN_TIME => true,
            Parameter::MOTOR_ENCODER_SHOWN => self.encoders == FeedbackUse::Motor,
            Parameter::COUNTED_TURNS => self.motor_turns_per_unit().is_some(),
            Parameter::COUNTED_WORK => {
                let has_velocity = self.tells(Signal::VelocityActual) || self.derives(Signal::VelocityActual);
                has_velocity && self.tells(Signal::TorqueActual) && self.motor_turns_per_unit().is_some()
            }
            _ => false,
        };
        is_kept && self.parameter(parameter).is_none()
    }

    /// Whether the gateway knows the loops of the drive by its profile: it has parameters.
    #[must_use]
    pub fn has_parameters(&self) -> bool {
        !self.parameters.is_empty()
    }

    /// Revolutions of the motor in one axis unit, in 1e-15: by gear and feed. `None` where nobody knows them.
    #[must_use]
    pub fn motor_turns_per_unit(&self) -> Option<i64> {
        self.mechanics.and_then(|mechanics| mechanics.motor_turns_per_unit())
    }

    /// What the drive has of its mechanics: with it, what an attribute can be set to; `None` where nobody knows, or the axis has no such
    /// encoder.
    #[must_use]
    pub fn mechanical(&self, fact: MechanicalFact) -> Option<(Mechanics, Number)> {
        let has = fact != MechanicalFact::UnitRatio || self.has_load_encoder();
        let mechanics = self.mechanics.filter(|_| has)?;
        Some((mechanics, mechanics.value(fact)?))
    }

    /// The values to the drive, each with what carries it.
    pub fn command_fields(&self) -> impl Iterator<Item = (&Field, Item)> + '_ {
        // Two signals that stand in one place have one item.
        let fields = self.command.fields().enumerate();
        fields.filter_map(|(number, field)| {
            let before = self.command.fields().take(number);
            let mut places: ArrayVec<u16, MAX_FIELDS> = ArrayVec::new();
            for offset in before.map(|field| field.offset) {
                if !places.contains(&offset) {
                    places.push(offset);
                }
            }
            let place = places.iter().position(|offset| *offset == field.offset).unwrap_or(places.len());
            if let Some([carriers, _]) = &self.carriers {
                return Some((field, *carriers.get(place)?));
            }
            Some((field, *self.telegram.command.get(self.heads() + place)?))
        })
    }

    /// The values from the drive, each with what carries it.
    pub fn feedback_fields(&self) -> impl Iterator<Item = (&Field, Item)> + '_ {
        let carriers = match &self.carriers {
            Some([_, carriers]) => carriers.as_slice(),
            None => self.telegram.feedback.get(self.heads()..).unwrap_or_default(),
        };
        self.feedback.fields().zip(carriers.iter().copied())
    }

    /// The word that shows the state of the drive; `None` where none does.
    pub fn status_item(&self) -> Option<Item> {
        /// S-0-0135.
        const DRIVE_STATUS: Idn = Idn(135);
        let first = self.telegram.feedback.first().copied().filter(|_| self.mode_octets.is_some());
        first
            .or_else(|| self.telegram.feedback.iter().copied().find(|item| *item == Item::from(DRIVE_STATUS)))
    }

    /// Whether the drive tells this value in every cycle.
    pub fn tells(&self, signal: Signal) -> bool {
        self.feedback.fields().any(|field| field.signal == signal)
    }

    /// Whether the gateway derives this value of every cycle from others that the drive tells.
    #[must_use]
    pub fn derives(&self, signal: Signal) -> bool {
        let tells = |of: &[Signal]| of.iter().any(|signal| self.tells(*signal));
        !self.tells(signal)
            && match signal {
                Signal::VelocityActual => tells(&[Signal::PositionActual]),
                Signal::AccelerationActual => tells(&[Signal::PositionActual, Signal::VelocityActual]),
                _ => false,
            }
    }

    /// What leads the drive: the control word, and the operating mode where it has an octet of its own.
    pub fn heads_of_command(&self) -> impl Iterator<Item = Item> + '_ {
        self.telegram.command.iter().take(self.heads()).copied()
    }

    /// Where an item stands in the telegram to the drive, and in how many bytes.
    pub fn place_of_command(&self, item: Item) -> Option<(usize, usize)> {
        let at = self.mode_octets.map(|[at, _]| at);
        place(item, &self.telegram.command, at, self.command_fields())
    }

    /// The same of the telegram from the drive.
    pub fn place_of_feedback(&self, item: Item) -> Option<(usize, usize)> {
        let at = self.mode_octets.map(|[_, at]| at);
        let word = self.status_words.iter().find(|word| word.item == item);
        let word = word.and_then(|word| Some((usize::from(word.offset?), word.width.bytes())));
        place(item, &self.telegram.feedback, at, self.feedback_fields()).or(word)
    }

    /// Writes a status that reports this in a mode, with more bits of the status word, into a telegram from the drive: for a peer
    /// that stands in for the drive. `false`, and nothing written, where no status reports it.
    pub fn write_status(
        &self,
        report: Report,
        selection: ModeSelection,
        bits: StatusBits,
        telegram: &mut [u8],
    ) -> bool {
        let mode = self.shown_in(selection).and_then(|shown| self.entry(shown));
        let shown = |status: u32| mode.map_or(status, |entry| entry.status.apply(status));
        let rows = self.reports.rows().map(|(row, _)| shown(row.value));
        let Some(status) = rows.into_iter().find(|status| self.report(*status) == report) else {
            return false;
        };
        let more = self.status.iter().filter(|row| row.word.is_none() && bits.contains(row.bit));
        let [low, high, octet, _] = more.fold(status, |status, row| row.pattern.apply(status)).to_le_bytes();
        let [_, at] = self.words_at.map(usize::from);
        if let Some(word) = telegram.get_mut(at..at + usize::from(WORD_BYTES)) {
            word.copy_from_slice(&[low, high]);
        }
        if let Some(place) = self.mode_octets.and_then(|[_, at]| telegram.get_mut(usize::from(at))) {
            *place = octet;
        }
        true
    }

    /// Whether an item is a word that shows faults or warnings.
    pub fn is_diagnostic(&self, item: Item) -> bool {
        self.faults.iter().any(|row| row.word == item)
    }

    /// What stands in front of the values: control or status word, and the operating mode where it has an octet of its own.
    fn heads(&self) -> usize {
        1 + usize::from(self.mode_octets.is_some())
    }

    /// Puts a command and its control into the telegram to the drive. `control` is what was sent last, `status` what the
    /// drive showed last; the new control comes back. An action without bits leaves it alone, and so does a mode that the
    /// drive does not have.
    pub fn encode(
        &self,
        command: &AxisCommand,
        order: impl Into<Order>,
        control: u32,
        status: u32,
        telegram: &mut [u8],
        report: &mut ConversionReport,
    ) -> u32 {
        let order = order.into();
        let told = self.told(order, command.selection());
        let control = self.control_in(told, order, control, status);
        let [low, high, mode, _] = control.to_le_bytes();
        let [at, _] = self.words_at.map(usize::from);
        if let Some(bytes) = telegram.get_mut(at..at + usize::from(WORD_BYTES)) {
            bytes.copy_from_slice(&[low, high]);
        }
        if let Some(octet) = self.mode_octets.and_then(|[at, _]| telegram.get_mut(usize::from(at))) {
            *octet = mode;
        }
        let hidden = self.hidden(told, status);
        if hidden.is_empty() {
            self.command.encode(command, telegram, report);
        } else {
            let shown = AxisCommand { present: command.present.difference(hidden), ..*command };
            self.command.encode(&shown, telegram, report);
        }
        control
    }

    /// The mode that the drive is told.
    fn told(&self, order: Order, selection: ModeSelection) -> Option<&ModeEntry> {
        self.entry(order.told.or_else(|| self.shown_in(selection))?)
    }

    /// Where set-point and target of the position stand in one place: the one that does not count. A drive that does not show
    /// yet that it goes to targets would follow one at once.
    fn hidden(&self, told: Option<&ModeEntry>, status: u32) -> CommandSet {
        let target = |entry: &ModeEntry| {
            entry.carried.contains(CommandSet::TARGET_POSITION) && entry.status.matches(status)
        };
        match self.shares_target {
            false => CommandSet::empty(),
            true if told.is_some_and(target) => CommandSet::POSITION,
            true => CommandSet::TARGET_POSITION,
        }
    }

    /// The operating mode in a control or a status, where the drive has an octet of its own for it.
    pub fn mode_octet(&self, word: u32) -> Option<i8> {
        let [_, _, mode, _] = word.to_le_bytes();
        self.mode_octets.map(|_| i8::from_le_bytes([mode]))
    }

    /// The control after an action in a mode: the control word, and the operating mode above it where it has an octet of its
    /// own.
    pub fn control(
        &self,
        order: impl Into<Order>,
        selection: ModeSelection,
        control: u32,
        status: u32,
    ) -> u32 {
        let order = order.into();
        self.control_in(self.told(order, selection), order, control, status)
    }

    /// The same in the mode that the drive is told.
    fn control_in(&self, told: Option<&ModeEntry>, order: Order, control: u32, status: u32) -> u32 {
        let Order { action, asks, .. } = order;
        let step = self.steps.iter().find(|step| step.action == action && step.when.matches(status));
        let control = match step {
            Some(step) => {
                let other =
                    step.other_mode.filter(|_| told.is_some_and(|entry| !entry.status.matches(status)));
                other.unwrap_or(step.control).apply(control)
            }
            None => self.actions.apply(action, control).unwrap_or(control),
        };
        let Some(entry) = told else { return control };
        let control = entry.control.apply(control);
        if entry.bits.mask == 0 {
            return control;
        }
        let operates = matches!(action, Action::Enable | Action::Halt)
            && matches!(self.report(status), Report::Operating | Report::Enabling | Report::Halted);
        let ask = entry.handshake.map_or(BitPattern::default(), |handshake| handshake.ask);
        match (operates, asks) {
            (true, true) => ask.apply(entry.bits.apply(control)),
            (true, false) => entry.bits.apply(control),
            // Bits of a mode mean nothing, or something else, before the drive is in operation.
            (false, _) => BitPattern::new(entry.bits.mask, 0).apply(control),
        }
    }

    /// How the drive takes over, step by step, what it goes to by itself in a mode.
    pub fn handshake(&self, selection: ModeSelection) -> Option<Handshake> {
        let entry = self.entry(selection).filter(|_| self.procedure(selection).is_none());
        entry.and_then(|entry| entry.handshake)
    }

    /// Whether a status shows the mode.
    pub fn shows(&self, selection: ModeSelection, status: u32) -> bool {
        self.entry(selection).is_some_and(|entry| entry.status.matches(status))
    }

    /// Takes the drive's telegram apart into report, mode, status bits and actual values. `led` is whether the drive carries
    /// out a procedure. Returns the status, or `None` when the telegram is too short to hold one.
    pub fn decode(
        &self,
        telegram: &[u8],
        led: bool,
        feedback: &mut AxisFeedback,
        cached: &mut CachedStatus,
        report: &mut ConversionReport,
    ) -> Option<u32> {
        let status = self.status(telegram)?;
        let shown = Shown { status, words: self.words(telegram), led };
        let said = match cached.last {
            Some((last, said)) if last == shown => said,
            _ => {
                let said = self.said(shown);
                cached.last = Some((shown, said));
                said
            }
        };
        feedback.report = said.report;
        (feedback.mode, feedback.interpolation) = (said.mode.mode, said.mode.interpolation);
        feedback.status = feedback.status.difference(self.known_status).union(said.bits);
        self.feedback.decode(telegram, feedback, &mut cached.trackers, report);
        Some(status)
    }

    /// What [`DriveProgram::decode`] keeps of a drive that was not heard yet.
    #[must_use]
    pub fn cached_status(&self) -> CachedStatus {
        CachedStatus { trackers: self.feedback.trackers(), last: None }
    }

    fn said(&self, shown: Shown) -> Said {
        let Shown { status, words, led } = shown;
        Said {
            report: if led { self.led_report(status) } else { self.report(status) },
            mode: self.mode(status).unwrap_or_default(),
            bits: self.status_bits(status, &self.named(words)),
        }
    }

    /// The status in a telegram: the status word, and the operating mode above it where it has an octet of its own.
    pub fn status(&self, telegram: &[u8]) -> Option<u32> {
        let [_, at] = self.words_at.map(usize::from);
        let [low, high] = *telegram.get(at..)?.first_chunk()?;
        let mode = match self.mode_octets {
            Some([_, at]) => *telegram.get(usize::from(at))?,
            None => 0,
        };
        Some(u32::from_le_bytes([low, high, mode, 0]))
    }

    /// What a status says; one that no row matches says that the drive is not ready.
    pub fn report(&self, status: u32) -> Report {
        self.reports.decode(status).unwrap_or(Report::NotReady)
    }

    /// The same while the drive carries out a procedure: that it does not follow command values is right then.
    pub fn led_report(&self, status: u32) -> Report {
        self.led_reports.decode(status).unwrap_or(Report::NotReady)
    }

    /// The operating mode that a status shows.
    pub fn mode(&self, status: u32) -> Option<ModeSelection> {
        self.modes.iter().find(|entry| entry.status.matches(status)).map(|entry| entry.selection)
    }

    fn entry(&self, selection: ModeSelection) -> Option<&ModeEntry> {
        self.modes.iter().find(|entry| entry.selection == selection)
    }

    /// Whether the drive was set up for this mode, or has the procedure that stands for it.
    pub fn has_mode(&self, selection: impl Into<ModeSelection>) -> bool {
        let selection = selection.into();
        self.entry(selection).is_some() || self.procedure(selection).is_some()
    }

    /// The mode in which the drive was set up.
    pub fn first_mode(&self) -> Option<ModeSelection> {
        self.modes.first().map(|entry| entry.selection)
    }

    /// The procedure that stands for a mode.
    pub fn procedure(&self, selection: ModeSelection) -> Option<&Procedure> {
        self.procedures.iter().find(|procedure| procedure.selection == selection)
    }

    /// Every procedure.
    pub fn procedures(&self) -> &[Procedure] {
        &self.procedures
    }

    /// The operation mode that the drive is in while it is in a mode: another one during a procedure that the controller
    /// leads, `None` where a procedure leaves it alone.
    pub fn shown_in(&self, selection: ModeSelection) -> Option<ModeSelection> {
        match self.procedure(selection) {
            Some(procedure) => procedure.led_in,
            None => Some(selection),
        }
    }

    /// The command signals without which a mode must not be chosen.
    pub fn needs(&self, selection: ModeSelection) -> CommandSet {
        self.shown_in(selection)
            .and_then(|shown| self.entry(shown))
            .map_or(CommandSet::empty(), |entry| entry.needs)
    }

    /// The command signals that reach the drive in a mode, and that it makes use of there.
    pub fn carries(&self, selection: ModeSelection) -> CommandSet {
        self.entry(selection).map_or(CommandSet::empty(), |entry| entry.carried)
    }

    /// The words with status bits that the drive's telegram has beside the status word.
    pub fn status_words(&self, telegram: &[u8]) -> ArrayVec<(Item, u32), STATUS_WORDS_MAX> {
        self.named(self.words(telegram))
    }

    fn words(&self, telegram: &[u8]) -> [Option<u32>; STATUS_WORDS_MAX] {
        let mut words = [None; STATUS_WORDS_MAX];
        for (word, place) in words.iter_mut().zip(&self.status_words) {
            *word = place.read_word(telegram);
        }
        words
    }

    /// The words that are there, each with what it is.
    fn named(&self, words: [Option<u32>; STATUS_WORDS_MAX]) -> ArrayVec<(Item, u32), STATUS_WORDS_MAX> {
        self.status_words.iter().zip(words).filter_map(|(place, word)| Some((place.item, word?))).collect()
    }

    /// The status bits in a status, and in the words beside it.
    pub fn status_bits(&self, status: u32, words: &[(Item, u32)]) -> StatusBits {
        let shows = |row: &&StatusRow| match row.word {
            None => row.pattern.matches(status),
            Some(item) => words.iter().any(|(known, word)| *known == item && row.pattern.matches(*word)),
        };
        self.status.iter().filter(shows).fold(StatusBits::empty(), |bits, row| bits | row.bit)
    }

    /// Whether the drive tells this status bit.
    pub fn knows_status(&self, bit: StatusBits) -> bool {
        self.known_status.contains(bit)
    }

    /// Whether the drive shows by a bit of its own whether its power stage is supplied. Others show it by their states: faulted or disabled
    /// they show nothing of it.
    pub fn has_power_bit(&self) -> bool {
        self.has_power_bit
    }

    /// The faults and warnings that a diagnostic word shows, in the order of the rows. A bit counts for one row only.
    pub fn faults(&self, item: Item, word: u32) -> impl Iterator<Item = (FaultCause, Reaction)> + '_ {
        let mut used = 0;
        let rows = self.faults.iter().filter(move |row| row.word == item && row.pattern.matches(word));
        rows.filter_map(move |row| {
            let free = row.pattern.mask & used == 0;
            used |= row.pattern.mask;
            free.then_some((row.cause, row.reaction))
        })
    }

    /// The diagnostic words that can show a fault, or a warning, in the order in which they should be read.
    pub fn diagnostic_words(&self, stops: bool) -> impl Iterator<Item = Item> + '_ {
        let counts = move |row: &FaultRow| row.reaction.stops() == stops;
        let first =
            move |at: usize, item: Item| !self.faults[..at].iter().any(|row| counts(row) && row.word == item);
        let rows =
            self.faults.iter().enumerate().filter(move |(at, row)| counts(row) && first(*at, row.word));
        rows.map(|(_, row)| row.word)
    }

    /// The diagnostic message that the drive has for a fault or warning: number and text. Empty where it has neither.
    pub fn diagnosis(&self) -> &[Item] {
        &self.diagnosis
    }

    /// The procedure command that belongs to an action.
    pub fn command_of(&self, action: Action) -> Option<Item> {
        self.commands.iter().find(|(known, _)| *known == action).map(|(_, item)| *item)
    }

    /// Where the drive keeps a parameter; `None` when it has none.
    pub fn parameter(&self, parameter: Parameter) -> Option<&ParameterEntry> {
        let at = self.parameters.binary_search_by_key(&parameter, |entry| entry.parameter).ok()?;
        self.parameters.get(at)
    }

    /// Sets the data that the configuration has of motor and power stage, up to `DATA_MAX`. What the drive shows itself counts more.
    pub fn set_data(&mut self, data: &[(Parameter, i64)]) {
        let counting: ArrayVec<_, DATA_MAX> = self.counting(data).collect();
        self.data = counting;
    }

    /// Whether [`DriveProgram::set_data`] would change nothing.
    #[must_use]
    pub fn has_data(&self, data: &[(Parameter, i64)]) -> bool {
        self.counting(data).eq(self.data.iter().copied())
    }

    /// What counts of such data.
    fn counting(&self, data: &[(Parameter, i64)]) -> impl Iterator<Item = (Parameter, i64)> {
        data.iter().copied().filter(|(of, _)| self.parameter(*of).is_none()).take(DATA_MAX)
    }

    /// What the configuration has of a parameter that the drive does not show.
    #[must_use]
    pub fn datum(&self, parameter: Parameter) -> Option<i64> {
        self.data.iter().find(|(of, _)| *of == parameter).map(|(_, value)| *value)
    }

    /// The longest way from one position command to the next: in a drive that works modulo a longer one would lead the
    /// other way round. Nanounits.
    pub fn position_step(&self) -> Option<i64> {
        self.position_step
    }

    /// Whether the drive's status word tells that it follows command values, and that it is halted.
    pub fn acknowledges(&self) -> bool {
        self.acknowledges
    }

    /// The drive's captures.
    pub fn captures(&self) -> &CaptureProgram {
        &self.captures
    }

    /// Everything the drive keeps, by parameter.
    pub fn parameters(&self) -> &[ParameterEntry] {
        &self.parameters
    }
}

/// Where an item stands in a telegram: word, mode, fields.
fn place<'f>(
    item: Item,
    items: &[Item],
    mode: Option<u16>,
    mut fields: impl Iterator<Item = (&'f Field, Item)>,
) -> Option<(usize, usize)> {
    match (items.iter().position(|known| *known == item)?, mode) {
        (0, _) => Some((0, usize::from(WORD_BYTES))),
        (1, Some(mode)) => Some((usize::from(mode), 1)),
        _ => {
            let (field, _) = fields.find(|(_, known)| *known == item)?;
            Some((usize::from(field.offset), field.width.bytes()))
        }
    }
}
