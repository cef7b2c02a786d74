//! The program of one axis.

use arrayvec::ArrayVec;
use profile_cia402::drive::controlword::Command;
use profile_cia402::drive::{Controlword, State, Statusword};
use profile_generic::image::{CommandSet, Signal};
use profile_generic::mode::ModeSelection;
use profile_generic::parameter::Parameter;
use profile_generic::program::{BitPattern, Conversion, Field, Width};
use profile_generic::quantity::Quantity;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;
use profile_generic::state::Action;
use profile_generic::time::DurationNs;

use super::facts::ObjectFacts;
use super::{
    ActionRule, Cia402Tables, DriveMode, FULL_RANGE, Inversion, ModeRule, Object, ParameterAt, ParameterRule,
    ProcedureRule, SignalRule, Value,
};
use crate::capture_program::{CaptureMode, Place};
use crate::dictionary::Cia402Dictionary;
use crate::drive_program::{
    DriveProgram, FaultRow, Handshake, MAX_MODES, MODE_SHIFT, ModeEntry, ModeProcedure,
    PROCEDURE_FAILURES_MAX, ParameterEntry, Procedure, ProcedureBy, StatusRow, StepRow, Telegram, WORD_BYTES,
};
use crate::drive_rows::Full;
use crate::feedback::FeedbackUse;
use crate::item::Item;
use crate::mechanics::Mechanics;
use crate::sercos::scaling::AxisUnits;

/// Octets of a mode of operation.
const MODE_BYTES: u16 = 1;

/// What must be known of an axis to work with its CiA 402 drive.
#[derive(Debug, Clone, Default)]
pub struct Cia402Axis {
    /// Units.
    pub units: AxisUnits,
    /// The axis of the device, from 0.
    pub axis: u16,
    /// Modes; the first that it has is active at start.
    pub modes: ArrayVec<ModeSelection, MAX_MODES>,
    /// Nobody has asked for these modes: those that the drive lacks are left out, as long as one is left.
    pub any_mode: bool,
    /// Nanounits of a linear axis in a nanoturn.
    pub way_of_a_turn: Option<Ratio>,
    /// Generic units in one count, where the drive's factor group is not to be asked.
    pub counts: Vec<(Quantity, Ratio)>,
    /// Time between set-points.
    pub cycle: DurationNs,
    /// Parameters to write at start, in generic units.
    pub parameters: Vec<(Parameter, i64)>,
    /// Whether the drive tells by bit 12 of its statusword that it follows command values; `None`: as the tables say.
    pub acknowledges: Option<bool>,
    /// Whether it tells by bit 4 that its power stage is supplied; `None`: as the tables say.
    pub tells_voltage: Option<bool>,
    /// Its modes of operation, where it does not report them by 6502, or reports wrong ones; `None`: as the tables say.
    pub drive_modes: Option<Vec<i8>>,
    /// Values that are not wanted in every cycle; those without which a mode does not work are there nevertheless.
    pub left_out: Vec<Signal>,
    /// Offsets that the drive is to add to its set-points; they go to it in every cycle, so none does unless it is named here.
    pub offsets: Vec<Signal>,
    /// How its captures are used.
    pub captures: CaptureMode,
    /// Whose encoder its position and velocity are of.
    pub feedback: FeedbackUse,
    /// It is never switched on: of a load, its position is what the drive shows of that encoder beside its loops.
    pub only_looks: bool,
}

impl Cia402Axis {
    /// An object of the tables on this axis of the device; `None` when the device has no such axis.
    #[must_use]
    pub fn item(&self, object: Object) -> Option<Item> {
        Some(Item::object(Cia402Dictionary::on_axis(object.index, self.axis)?, object.sub))
    }

    /// Whether a value is to stand in the telegrams, if the drive has it. Where captures do, their inputs are there for all who
    /// look at them.
    pub(super) fn wants(&self, rule: &SignalRule) -> bool {
        let signal = rule.signal;
        if Signal::OFFSETS.contains(&signal) {
            return self.offsets.contains(&signal);
        }
        let seen = signal == Signal::DigitalInputs && self.captures == CaptureMode::Cyclic;
        rule.refuse || seen || !self.left_out.contains(&signal)
    }

    /// What the configuration says of the counts of a quantity.
    pub(super) fn count_of(&self, quantity: Quantity) -> Option<Ratio> {
        self.counts.iter().find(|(known, _)| *known == quantity).map(|(_, ratio)| *ratio)
    }
}

/// How modes of operation are tried: by these objects of the axis, and which ones, by name and number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModeWords {
    /// Where a mode is written.
    pub mode: Object,
    /// Where it is shown.
    pub shown: Object,
    /// The modes.
    pub modes: Vec<(String, i8)>,
}

/// Why no program can be made for an axis.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Cia402Error {
    /// An operating mode without a row.
    #[error("no [[mode]] row for operating mode {0}")]
    Mode(ModeSelection),
    /// No operating mode at all.
    #[error("expected at least one operating mode, got none")]
    NoMode,
    /// The drive lacks something for every mode that an axis could have.
    #[error("the axis would have none of its modes: {0}")]
    NoneLeft(String),
    /// The drive has no mode of operation that an operating mode can be.
    #[error("{mode} needs one of the modes {wanted}, the drive has none of them: 6502:00 is {told:#010x}")]
    NotSupported {
        /// The mode.
        mode: ModeSelection,
        /// What the drive tells, or what was tried.
        told: u32,
        /// The drive's modes that would do.
        wanted: String,
    },
    /// The drive lacks a value that the mode needs.
    #[error("the drive has no {object}, which carries {signal}")]
    Missing {
        /// The object.
        object: Object,
        /// The signal.
        signal: Signal,
    },
    /// The unit of an object is not known.
    #[error("{object}: no [[unit]] or [[scaling]] row for `{unit}`")]
    Unit {
        /// The object.
        object: Object,
        /// The unit.
        unit: String,
    },
    /// The drive has reported nothing that a unit follows from, and the configuration does not say it either.
    #[error(
        "the size of a count of {0} is not known: expected a factor group in the drive, or `counts` in the configuration"
    )]
    NoScaling(String),
    /// A linear axis whose way in a turn is not known.
    #[error("expected the travel of a linear axis in a turn of its motor, got none")]
    Way,
    /// A ratio beyond 64 bits.
    #[error("{0}: its scaling does not fit 64 bits")]
    Overflow(Object),
    /// A value that the object cannot hold.
    #[error("{object}: {value} does not fit")]
    Range {
        /// The object.
        object: Object,
        /// The value.
        value: i64,
    },
    /// A cycle that an interpolation time cannot be.
    #[error("a cycle of {0} is not 1 to 255 times a power of ten of seconds")]
    Cycle(DurationNs),
    /// The device has no axis of this number.
    #[error("expected an axis from 0 to 7 of a device, got {0}")]
    Axis(u16),
    /// A table does not fit the program.
    #[error(transparent)]
    Full(#[from] Full),
}

/// Signals, and where they stand in their telegram.
pub(super) type Places<'a> = Vec<(&'a SignalRule, u16)>;

impl Cia402Tables {
    /// The modes of an axis that the controller leads, or that go to targets, with what they are in the drive. The first rule
    /// counts of whose modes of operation 6502 names one, and of those the first; a drive without 6502 is believed to have what
    /// is wanted most.
    pub(super) fn chosen(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Vec<(&ModeRule, &DriveMode)>, Cia402Error> {
        let (chosen, mut lacks) = self.choose(axis, facts)?;
        if chosen.is_empty() {
            return Err(match lacks.len() {
                0 => Cia402Error::NoMode,
                1 => lacks.remove(0).1,
                _ => {
                    let all: Vec<_> = lacks.iter().map(|(mode, why)| format!("{mode} ({why})")).collect();
                    Cia402Error::NoneLeft(all.join(", "))
                }
            });
        }
        Ok(chosen)
    }

    /// The same, and which modes the axis does without, and why.
    #[allow(clippy::type_complexity, reason = "chosen and left out, each with what belongs to it")]
    fn choose(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<(Vec<(&ModeRule, &DriveMode)>, Vec<(ModeSelection, Cia402Error)>), Cia402Error> {
        let mut chosen = Vec::with_capacity(axis.modes.len());
        let mut lacks = Vec::new();
        for selection in &axis.modes {
            let mut rules = self.modes.iter().filter(|rule| rule.selection == *selection).peekable();
            match rules.peek() {
                None if self.procedures.iter().any(|rule| rule.selection == *selection) => continue,
                None => return Err(Cia402Error::Mode(*selection)),
                Some(_) => {}
            }
            let has = |mode: &&DriveMode| self.has_mode(mode, facts);
            let found = rules.clone().find_map(|rule| Some((rule, rule.modes.iter().find(has)?)));
            match found {
                Some((rule, mode)) => match self.lacks_any(rule, mode, axis, facts) {
                    Some(_) if rule.optional => {}
                    Some(lack) if axis.any_mode => lacks.push((*selection, lack)),
                    _ => chosen.push((rule, mode)),
                },
                None if rules.clone().all(|rule| rule.optional) => {}
                None => {
                    let names: Vec<_> =
                        rules.flat_map(|rule| &rule.modes).map(|mode| mode.name.as_str()).collect();
                    let told = self.modes_told(facts).unwrap_or_default();
                    let wanted = names.join(", ");
                    let lack = Cia402Error::NotSupported { mode: *selection, told, wanted };
                    if !axis.any_mode {
                        return Err(lack);
                    }
                    lacks.push((*selection, lack));
                }
            }
        }
        Ok((chosen, lacks))
    }

    /// Modes of an axis that it does without, and why.
    pub(crate) fn modes_left_out(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Vec<(ModeSelection, Cia402Error)> {
        self.choose(axis, facts).map(|(_, lacks)| lacks).unwrap_or_default()
    }

    /// The modes of an axis that its drive carries out by itself, with what they are in the drive; one that it lacks the axis
    /// does without.
    pub(super) fn procedures_of(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Vec<(&ProcedureRule, &DriveMode)> {
        let rules =
            axis.modes.iter().filter_map(|mode| self.procedures.iter().find(|rule| rule.selection == *mode));
        let has = |mode: &&DriveMode| self.has_mode(mode, facts);
        rules.filter_map(|rule| Some((rule, rule.modes.iter().find(has)?))).collect()
    }

    fn has_mode(&self, mode: &DriveMode, facts: &ObjectFacts) -> bool {
        self.modes_told(facts).is_none_or(|word| word >> mode.bit & 1 != 0)
    }

    /// What 6502 tells.
    fn modes_told(&self, facts: &ObjectFacts) -> Option<u32> {
        u32::try_from(facts.integer(self.words.modes_supported, Width::U32)?).ok()
    }

    /// What has to be tried of a drive that does not report its modes of operation, as one without 6502 and one with a 6502 of 0.
    pub(crate) fn modes_untold(&self, axis: &Cia402Axis, facts: &mut ObjectFacts) -> Option<ModeWords> {
        if let Some(codes) = axis.drive_modes.as_ref().or(self.drive.modes.as_ref()) {
            self.has_modes(facts, codes.iter().copied());
            return None;
        }
        if self.modes_told(facts).is_some_and(|word| word != 0) {
            return None;
        }
        let on_axis = |object: Object| match axis.item(object)? {
            Item::Object(object) => Some(object),
            _ => None,
        };
        let mut modes: Vec<(String, i8)> = Vec::new();
        for mode in self.modes_of(axis) {
            if !modes.iter().any(|(_, code)| *code == mode.code) {
                modes.push((mode.name.clone(), mode.code));
            }
        }
        Some(ModeWords { mode: on_axis(self.words.mode)?, shown: on_axis(self.words.mode_shown)?, modes })
    }

    /// Notes that the drive has these modes of operation and no others.
    pub(crate) fn has_modes(&self, facts: &mut ObjectFacts, codes: impl Iterator<Item = i8>) {
        let bit = |code: i8| self.all_modes().find(|mode| mode.code == code).map(|mode| mode.bit);
        let word = codes.filter_map(bit).fold(0_u32, |word, bit| word | 1 << bit);
        facts.note_data(self.words.modes_supported, &word.to_le_bytes());
    }

    /// The modes of operation of an axis, those that are wanted most first.
    fn modes_of<'a>(&'a self, axis: &'a Cia402Axis) -> impl Iterator<Item = &'a DriveMode> {
        axis.modes.iter().flat_map(|selection| {
            let led =
                self.modes.iter().filter(|rule| rule.selection == *selection).flat_map(|rule| &rule.modes);
            let own = self.procedures.iter().filter(|rule| rule.selection == *selection);
            led.chain(own.flat_map(|rule| &rule.modes))
        })
    }

    fn all_modes(&self) -> impl Iterator<Item = &DriveMode> {
        let own = self.procedures.iter().flat_map(|rule| &rule.modes);
        self.modes.iter().flat_map(|rule| &rule.modes).chain(own)
    }

    /// Why a signal cannot be used: the drive does not have it, or nobody says what it counts.
    fn lacks(&self, rule: &SignalRule, axis: &Cia402Axis, facts: &ObjectFacts) -> Option<Cia402Error> {
        let (object, signal) = (rule.value.object, rule.signal);
        if facts.is_missing(object) {
            return Some(Cia402Error::Missing { object, signal });
        }
        let unscaled = self.is_unscaled(&rule.value, signal.quantity(), axis, facts);
        unscaled.then(|| Cia402Error::NoScaling(rule.value.unit.clone()))
    }

    /// What the drive lacks without which a mode does not work.
    fn lacks_any(
        &self,
        rule: &ModeRule,
        mode: &DriveMode,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Option<Cia402Error> {
        let mut signals = rule.command.iter().chain(&rule.actual);
        signals.find_map(|signal| {
            let rule = self.signal(*signal, mode.code).filter(|rule| rule.refuse)?;
            self.lacks(rule, axis, facts)
        })
    }

    /// The program of an axis whose drive was asked.
    ///
    /// # Errors
    /// [`Cia402Error`].
    pub(crate) fn program(
        &self,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<DriveProgram, Cia402Error> {
        let chosen = self.chosen(axis, facts)?;
        let item = |object| axis.item(object).ok_or(Cia402Error::Axis(axis.axis));
        let (telegram, places) = self.telegram(axis, &chosen, facts)?;
        let shares =
            |signal: Signal| places.iter().find(|(rule, _)| rule.signal == signal).map(|(_, at)| *at);
        let shares_target =
            shares(Signal::TargetPosition).is_some_and(|at| shares(Signal::PositionCommand) == Some(at));
        let mut fields = Vec::new();
        for (rule, at) in &places {
            fields.push(self.field(rule, *at, axis, facts)?);
        }
        let mut program = DriveProgram::new(telegram, false);
        program.mode_octets = Some([WORD_BYTES, WORD_BYTES]);
        program.shares_target = shares_target;
        for field in fields {
            program.add_field(field)?;
        }
        self.mode_entries(&chosen, &self.procedures_of(axis, facts), &mut program)?;
        for (rule, at) in &places {
            let object = rule.value.object;
            if object != self.words.status && self.status.iter().any(|rule| rule.object == object) {
                let place = Place { item: item(object)?, width: rule.value.width, offset: Some(*at) };
                program.status_words.try_push(place).map_err(|_| Full("the words of status bits"))?;
            }
        }
        self.words(axis, &chosen, facts, &mut program)?;
        program.captures = self.capture_program(axis, facts, &program.telegram, &places)?;
        let error = item(self.words.error)?;
        program.add_faults(self.faults.iter().map(|row| FaultRow { word: error, ..*row }))?;
        program.add_parameters(&self.parameters, |rule| self.entry(rule, axis, facts))?;
        program.mechanics = Some(self.mechanics(axis, facts));
        program.set_encoders(axis.feedback, axis.only_looks);
        Ok(program)
    }

    /// What lies between motor and load: the gear of the drive, and the travel of the configuration.
    fn mechanics(&self, axis: &Cia402Axis, facts: &ObjectFacts) -> Mechanics {
        let turns = |parameter| {
            let rule = self.parameters.iter().find(|rule| rule.parameter == parameter)?;
            facts.number(&rule.at.value).filter(|turns| *turns > 0)
        };
        let motor = turns(Parameter::GEAR_RATIO_NUMERATOR);
        let load = turns(Parameter::GEAR_RATIO_DENOMINATOR);
        let gear = motor.zip(load).and_then(|(motor, load)| Ratio::new(motor, load));
        let kind = axis.units.kind;
        Mechanics { kind, gear, travel: axis.way_of_a_turn.filter(|_| kind == UnitKind::Linear) }
    }

    /// What the telegrams carry at most, of a drive that lacks nothing.
    ///
    /// # Errors
    /// A mode has no row.
    pub(crate) fn telegram_room(&self, axis: &Cia402Axis) -> Result<Telegram, Cia402Error> {
        let facts = ObjectFacts::new();
        let chosen = self.chosen(axis, &facts)?;
        Ok(self.telegram(axis, &chosen, &facts)?.0)
    }

    /// What the telegrams carry, and where the signals stand in them.
    fn telegram(
        &self,
        axis: &Cia402Axis,
        chosen: &[(&ModeRule, &DriveMode)],
        facts: &ObjectFacts,
    ) -> Result<(Telegram, Places<'_>), Cia402Error> {
        let item = |object| axis.item(object).ok_or(Cia402Error::Axis(axis.axis));
        let words = &self.words;
        let head = WORD_BYTES + MODE_BYTES;
        let mut telegram = Telegram {
            command: vec![item(words.control)?, item(words.mode)?],
            feedback: vec![item(words.status)?, item(words.mode_shown)?],
            command_bytes: head,
            feedback_bytes: head,
        };
        let mut places = Vec::new();
        for (to_drive, items, bytes) in [
            (true, &mut telegram.command, &mut telegram.command_bytes),
            (false, &mut telegram.feedback, &mut telegram.feedback_bytes),
        ] {
            let mut known: Vec<(Object, u16)> = Vec::new();
            for rule in self.signals_of(axis, chosen, to_drive, facts)? {
                let object = rule.value.object;
                // What two signals are goes there once.
                if let Some((_, at)) = known.iter().find(|(known, _)| *known == object) {
                    places.push((rule, *at));
                    continue;
                }
                items.push(item(object)?);
                places.push((rule, *bytes));
                known.push((object, *bytes));
                *bytes += octets(rule.value.width);
            }
            for value in self.cyclic_of_captures(axis, facts, to_drive, &places) {
                items.push(item(value.object)?);
                *bytes += octets(value.width);
            }
        }
        Ok((telegram, places))
    }

    /// The signals of all modes, each once, in the order of the modes.
    fn signals_of(
        &self,
        axis: &Cia402Axis,
        chosen: &[(&ModeRule, &DriveMode)],
        to_drive: bool,
        facts: &ObjectFacts,
    ) -> Result<Vec<&SignalRule>, Cia402Error> {
        let mut rules: Vec<&SignalRule> = Vec::new();
        let of = |(rule, mode): &(&ModeRule, &DriveMode)| {
            let signals = if to_drive { &rule.command } else { &rule.actual };
            signals.iter().map(|signal| (*signal, mode.code)).collect::<Vec<_>>()
        };
        for (signal, mode) in chosen.iter().flat_map(of) {
            let signal = &signal;
            let Some(rule) = self.signal(*signal, mode) else { continue };
            if !axis.wants(rule) || rules.iter().any(|known| known.signal == *signal) {
                continue;
            }
            match self.lacks(rule, axis, facts) {
                Some(lack) if rule.refuse => return Err(lack),
                Some(_) => {}
                None => rules.push(rule),
            }
        }
        Ok(rules)
    }

    /// What the modes are in control and status.
    fn mode_entries(
        &self,
        chosen: &[(&ModeRule, &DriveMode)],
        procedures: &[(&ProcedureRule, &DriveMode)],
        program: &mut DriveProgram,
    ) -> Result<(), Cia402Error> {
        // Every bit of the controlword that one of the modes uses means something else, or nothing, in the others.
        let of_modes = chosen
            .iter()
            .map(|(rule, _)| rule.control.mask | rule.handshake.map_or(0, |handshake| handshake.ask.mask));
        let mask =
            of_modes.chain(procedures.iter().map(|(rule, _)| rule.start.mask)).fold(0, |all, one| all | one);
        let entry =
            |selection, mode: &DriveMode, control: BitPattern, handshake: Option<Handshake>| ModeEntry {
                selection,
                control: shown(mode.code),
                status: shown(mode.code),
                bits: BitPattern::new(mask, control.value),
                handshake,
                needs: CommandSet::empty(),
                carried: CommandSet::empty(),
            };
        for (rule, mode) in chosen {
            let refuse = |signal| self.signal(signal, mode.code).is_some_and(|row| row.refuse);
            let (needs, carried) = program.command_sets(&rule.command, refuse);
            let entry = entry(rule.selection, mode, rule.control, rule.handshake);
            program.add_mode(ModeEntry { needs, carried, ..entry })?;
        }
        for (rule, mode) in procedures {
            let start = Handshake { ask: rule.start, taken: rule.done };
            program.add_mode(entry(rule.selection, mode, BitPattern::default(), Some(start)))?;
            let mut failed = [None; PROCEDURE_FAILURES_MAX];
            for (place, pattern) in failed.iter_mut().zip(&rule.failed) {
                *place = Some(*pattern);
            }
            let by = ProcedureBy::Mode(ModeProcedure {
                shown: shown(mode.code),
                done: rule.done,
                failed,
                time_out: rule.time_out,
            });
            program.add_procedure(Procedure { selection: rule.selection, led_in: None, by })?;
        }
        Ok(())
    }

    fn field(
        &self,
        rule: &SignalRule,
        offset: u16,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Field, Cia402Error> {
        let (signal, value) = (rule.signal, &rule.value);
        let mut count = self.count(value, signal.quantity(), axis, facts)?;
        if self.is_inverted(rule, facts) {
            let inverted = count.num().checked_neg().and_then(|num| Ratio::new(num, count.den()));
            count = inverted.ok_or(Cia402Error::Overflow(value.object))?;
        }
        let conversion = if signal.is_command() { to_drive(value, count)? } else { Conversion::new(count) };
        let absolute = matches!(signal, Signal::PositionActual) && value.width.bits() == 32;
        let modulo = absolute.then_some(FULL_RANGE);
        Ok(Field { signal, offset, width: value.width, conversion, modulo })
    }

    /// Whether the sign of a value is not that of the axis: the drive inverts positions and velocities by bits of their own, and
    /// torques not at all.
    fn is_inverted(&self, rule: &SignalRule, facts: &ObjectFacts) -> bool {
        // What has no unit has no sign either.
        let own = rule.polarity.is_some_and(|bit| self.inverts(bit, facts));
        rule.signal.quantity() != Quantity::None && own != self.inverts_positions(facts)
    }

    /// Whether the drive inverts its positions. What it does not invert, torques, their limits and the switches at the ends of
    /// the way, is the other way round in the box.
    pub(super) fn inverts_positions(&self, facts: &ObjectFacts) -> bool {
        self.inverts(self.words.direction, facts)
    }

    fn inverts(&self, bit: u32, facts: &ObjectFacts) -> bool {
        facts.integer(self.words.polarity, Width::U8).is_some_and(|word| word >> bit & 1 != 0)
    }

    /// What is written instead of a step that puts a drive into operation (transition 4): it stays switched on.
    fn instead_of_operation(
        &self,
        action: Action,
        when: BitPattern,
        control: BitPattern,
    ) -> Option<BitPattern> {
        let low = |word: u32| u16::try_from(word & 0xFFFF).unwrap_or_default();
        let command =
            |pattern: BitPattern| Command::decode(Controlword::from_bits_retain(low(pattern.value)));
        let state = State::decode(Statusword::from_bits_retain(low(when.value)));
        let begins =
            command(control) == Some(Command::EnableOperation) && state != Some(State::OperationEnabled);
        let stays =
            |rule: &&ActionRule| rule.action == action && command(rule.pattern) == Some(Command::SwitchOn);
        self.actions.iter().find(stays).filter(|_| begins).map(|rule| rule.pattern)
    }

    /// Actions, reports and status bits.
    fn words(
        &self,
        axis: &Cia402Axis,
        chosen: &[(&ModeRule, &DriveMode)],
        facts: &ObjectFacts,
        program: &mut DriveProgram,
    ) -> Result<(), Cia402Error> {
        for rule in &self.actions {
            match rule.when {
                Some(when) => {
                    let other_mode = self.instead_of_operation(rule.action, when, rule.pattern);
                    let row = StepRow { action: rule.action, when, control: rule.pattern, other_mode };
                    program.steps.try_push(row).map_err(|_| Full("the table of actions"))?;
                }
                None => program.actions.set(rule.action, rule.pattern),
            }
        }
        let tells = self.tells(axis);
        program.has_power_bit = tells.voltage;
        for rule in self.reports.iter().filter(|rule| rule.drives.include(tells)) {
            for pattern in in_modes(rule.pattern, &rule.modes, chosen) {
                // A drive that carries out something by itself need not follow command values.
                let led = rule.drives.follows == Some(true) || program.led_reports.push(pattern, rule.report);
                if !led || !program.reports.push(pattern, rule.report) {
                    return Err(Full("the table of reports").into());
                }
            }
        }
        for rule in self.status.iter().filter(|rule| rule.drives.include(tells)) {
            let word = (rule.object != self.words.status).then(|| axis.item(rule.object)).flatten();
            if !program.carries_word(word) {
                continue;
            }
            let bit = if self.inverts_positions(facts) { rule.inverted } else { rule.bit };
            program.known_status |= bit;
            for pattern in in_modes(rule.pattern, &rule.modes, chosen) {
                program.add_status(StatusRow { word, pattern, bit })?;
            }
        }
        Ok(())
    }

    /// The entry of a parameter; `None` when the drive lacks it, or its unit is not known.
    pub(crate) fn entry(
        &self,
        rule: &ParameterRule,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Option<ParameterEntry>, Cia402Error> {
        let inverted = rule.at.inverted.as_ref().filter(|_| self.inverts_positions(facts));
        self.entry_at(inverted.unwrap_or(&rule.at.value), rule, axis, facts)
    }

    /// The entry of a parameter in this object.
    pub(super) fn entry_at(
        &self,
        value: &Value,
        rule: &ParameterRule,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Option<ParameterEntry>, Cia402Error> {
        if facts.is_missing(value.object) {
            return Ok(None);
        }
        self.entry_in(value, rule, axis, facts)
    }

    /// The same, whether the drive has the object or not.
    pub(super) fn entry_in(
        &self,
        value: &Value,
        rule: &ParameterRule,
        axis: &Cia402Axis,
        facts: &ObjectFacts,
    ) -> Result<Option<ParameterEntry>, Cia402Error> {
        let count = match self.count(value, rule.quantity, axis, facts) {
            Ok(count) => count,
            Err(Cia402Error::NoScaling(_) | Cia402Error::Way) => return Ok(None),
            Err(error) => return Err(error),
        };
        let overflow = || Cia402Error::Overflow(value.object);
        let ratio = rule.factor.inverse().and_then(|factor| count.then(factor)).ok_or_else(overflow)?;
        let turned = rule.at.polarity.is_some_and(|polarity| {
            let own = matches!(polarity, Inversion::Bit(bit) if self.inverts(bit, facts));
            own != self.inverts_positions(facts)
        });
        let opposite = ratio.num().checked_neg().and_then(|num| Ratio::new(num, ratio.den()));
        let ratio = if turned { opposite.ok_or_else(overflow)? } else { ratio };
        let (min, max) = value.width.range();
        Ok(Some(ParameterEntry {
            parameter: rule.parameter,
            item: axis.item(value.object).ok_or(Cia402Error::Axis(axis.axis))?,
            width: value.width,
            to_drive: if rule.to_drive { Some(to_drive(value, ratio)?.within(min, max)) } else { None },
            from_drive: rule.from_drive.then(|| Conversion::new(ratio)),
        }))
    }

    /// A rule that only converts a value, both ways, to the quantity that its unit measures; for worked examples.
    pub(crate) fn plain_rule(&self, value: Value) -> ParameterRule {
        let scaling = self.scalings.iter().find(|rule| rule.unit == value.unit);
        let quantity = scaling.map_or(Quantity::None, |rule| rule.quantity);
        ParameterRule::plain(quantity, ParameterAt { value, inverted: None, common: None, polarity: None })
    }
}

fn octets(width: Width) -> u16 {
    u16::try_from(width.bytes()).unwrap_or(u16::MAX)
}

/// From the generic unit to counts.
fn to_drive(value: &Value, count: Ratio) -> Result<Conversion, Cia402Error> {
    Ok(Conversion::new(count.inverse().ok_or(Cia402Error::Overflow(value.object))?))
}

/// A mode of operation in control or status.
fn shown(code: i8) -> BitPattern {
    BitPattern::new(0xFF << MODE_SHIFT, u32::from(code.to_le_bytes()[0]) << MODE_SHIFT)
}

/// A row for each mode of the axis that it is for, or one for all.
fn in_modes(pattern: BitPattern, modes: &[i8], chosen: &[(&ModeRule, &DriveMode)]) -> Vec<BitPattern> {
    if modes.is_empty() {
        return vec![pattern];
    }
    let there = chosen.iter().map(|(_, mode)| mode.code).filter(|code| modes.contains(code));
    let with = |code| {
        let mode = shown(code);
        BitPattern::new(pattern.mask | mode.mask, pattern.value | mode.value)
    };
    there.map(with).collect()
}
