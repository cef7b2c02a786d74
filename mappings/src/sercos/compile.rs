//! Generic <-> SERCOS: the telegram and the program of one axis.

use arrayvec::ArrayVec;
use profile_generic::image::Signal;
use profile_generic::mode::ModeSelection;
use profile_generic::parameter::Parameter;
use profile_generic::program::{BitPattern, Conversion, Field, Width};
use profile_generic::quantity::Quantity;
use profile_generic::ratio::{Ratio, Rounding};
use profile_generic::scaling::UnitKind;
use profile_sercos::wire::connection::CONNECTION_CONTROL_LEN;
use profile_sercos::wire::idn::Idn;

use super::captures;
use super::facts::DriveFacts;
use super::fixed_connections::FixedConnections;
use super::modes::Signals;
use super::scaling::{AxisUnits, Lsb, ScalingError, ScalingSource, above_zero, power_of_ten};
use super::tables::{ParameterRule, Polarity, ReportRule, SercosTables, SlotRule};
use crate::capture_program::CaptureMode;
use crate::dictionary::{IdnUnit, SercosDictionary};
use crate::drive_program::{
    DriveProgram, MAX_MODES, ModeEntry, PROCEDURE_COMMANDS_MAX, PROCEDURES_MAX, ParameterEntry, Procedure,
    ProcedureBy, StatusRow, Telegram, WORD_BYTES,
};
use crate::drive_rows::Full;
use crate::feedback::FeedbackUse;
use crate::item::Item;
use crate::mechanics::Mechanics;

/// Wraps of a position that does not work modulo: the range of its 32 bits.
const FULL_RANGE: i64 = 1 << 32;

/// What must be known of an axis to work with its SERCOS drive.
#[derive(Debug, Clone, Default)]
pub struct SercosAxis {
    /// Units.
    pub units: AxisUnits,
    /// Modes in the order of their slots, with those among them that are procedures; the first is active at start.
    pub modes: ArrayVec<ModeSelection, { MAX_MODES + PROCEDURES_MAX }>,
    /// One of the modes is enough: those that the drive does not have are left out.
    pub any_mode: bool,
    /// The drive has refused the values of a telegram and does not report which: those that the axis can do without stay out.
    pub bare: bool,
    /// Whether positions wrap.
    pub modulo: bool,
    /// Whether commissioning sets the scaling of the drive; it is left alone otherwise.
    pub set_scaling: bool,
    /// Parameters to write at start, in generic units.
    pub parameters: Vec<(Parameter, i64)>,
    /// How the drive's captures are used.
    pub captures: CaptureMode,
    /// The drive's status word does not report whether it follows command values and whether it is halted.
    pub silent: bool,
    /// Whose encoder its position and velocity are of.
    pub feedback: FeedbackUse,
}

/// Why no program can be made for an axis.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SercosError {
    /// An operating mode without a row.
    #[error("no [[mode]] or [[procedure]] row for operating mode {0}")]
    Mode(ModeSelection),
    /// A procedure that is led in a mode which the axis does not have.
    #[error("{procedure} needs the operating mode {led_in}, which the axis does not have")]
    LedIn {
        /// The procedure.
        procedure: ModeSelection,
        /// The mode.
        led_in: ModeSelection,
    },
    /// A slave that says that it is no drive.
    #[error("S-0-1302.0.1 says that it is {0}, not a drive")]
    Profile(&'static str),
    /// No operation mode at all.
    #[error(
        "expected at least one operation mode, got none: the drive has none of those that the axis is configured for"
    )]
    NoMode,
    /// More modes than slots.
    #[error("expected at most {slots} operating modes, got {modes}")]
    Slots {
        /// Rows in the table.
        slots: usize,
        /// Modes of the axis.
        modes: usize,
    },
    /// The drive lacks a value that the mode needs.
    #[error("the drive has no {idn}, which carries {signal}")]
    Missing {
        /// The IDN.
        idn: Idn,
        /// The signal.
        signal: Signal,
    },
    /// The drive lists what its telegrams can carry, and a value that the mode needs is not in it.
    #[error(
        "{list}, the list of what may be in a telegram of the drive, has no {idn}, which carries {signal}"
    )]
    NotConfigurable {
        /// S-0-0187 or S-0-0188.
        list: Idn,
        /// The IDN.
        idn: Idn,
        /// The signal.
        signal: Signal,
    },
    /// The drive lists its operation modes, and the one that is wanted is not in it.
    #[error("{mode} needs one of the operation modes {wanted}, and {list} is [{found}]")]
    NotSupported {
        /// S-0-0292.
        list: Idn,
        /// The mode.
        mode: ModeSelection,
        /// Codes that would do.
        wanted: String,
        /// Codes that the drive has.
        found: String,
    },
    /// The drive does not list its operation modes, and none of those that it is set to is the one that is wanted.
    #[error(
        "{mode} needs one of the operation modes {wanted}; the drive does not tell what it has, and is set to {found}: name its `modes` \
         in the configuration, if it has it"
    )]
    NotSelected {
        /// The mode.
        mode: ModeSelection,
        /// Codes that would do.
        wanted: String,
        /// The parameters of the modes, with their codes.
        found: String,
    },
    /// The drive has refused the operation mode.
    #[error("the drive takes no code of it for {0}")]
    SlotRefused(Idn),
    /// A fixed configuration list lacks a value that a mode needs.
    #[error(
        "{list}: expected {idn} in the list of this slave of class SCP_FixCFG, which carries {signal} for {mode}, and it is not there; \
         configure the list in the slave, or give its drive in the configuration only `modes` that its lists serve"
    )]
    FixedMissing {
        /// S-0-1050.x.6.
        list: Idn,
        /// The IDN.
        idn: Idn,
        /// The signal.
        signal: Signal,
        /// The mode that needs it.
        mode: ModeSelection,
    },
    /// A fixed configuration list has a command value that nothing fills.
    #[error(
        "{list}: the list of this slave of class SCP_FixCFG has {idn}, for which none of the modes of this drive has a value, and 0 \
         may be dangerous; take it out of the list in the slave, or add the mode that commands it to `modes` of the drive"
    )]
    FixedUnfilled {
        /// S-0-1050.x.6.
        list: Idn,
        /// The IDN.
        idn: Idn,
    },
    /// A value stands in a fixed configuration list twice.
    #[error(
        "{list}: {idn} is twice in the list of this slave of class SCP_FixCFG; configure the list in the slave with each value once"
    )]
    FixedTwice {
        /// S-0-1050.x.6.
        list: Idn,
        /// The IDN.
        idn: Idn,
    },
    /// No fixed connection carries the control word or the status word.
    #[error(
        "expected {word} in a configuration list of this slave of class SCP_FixCFG, found {lists}; configure the lists in the slave"
    )]
    FixedWord {
        /// Control or status word.
        word: Idn,
        /// The lists, for people.
        lists: String,
    },
    /// What a fixed connection carries and what its setup says do not agree.
    #[error(
        "{list}: expected a connection with {word} to be {} by the slave, and S-0-1050.x.1 bit 14 says that it is not; correct the setup \
         in the slave",
        if *produces { "produced" } else { "consumed" }
    )]
    FixedDirection {
        /// S-0-1050.x.6.
        list: Idn,
        /// Control or status word.
        word: Idn,
        /// Whether the slave should produce it.
        produces: bool,
    },
    /// Nobody knows how long a value is.
    #[error("{0}: neither the drive nor the dictionary has the length")]
    Length(Idn),
    /// The unit of a value is not known.
    #[error(transparent)]
    Scaling(#[from] ScalingError),
    /// A table does not fit the program.
    #[error(transparent)]
    Full(#[from] Full),
    /// A value beyond the minimum or maximum that the drive gives.
    #[error("{idn}: expected {} to {} by elements 5 and 6 of the drive, got {value}", limits.0, limits.1)]
    Limit {
        /// The IDN.
        idn: Idn,
        /// The value in the drive's unit.
        value: i64,
        /// Minimum and maximum.
        limits: (i64, i64),
    },
    /// A value that the parameter of the drive cannot hold.
    #[error("{idn}: {value} does not fit a {width}")]
    Range {
        /// The IDN.
        idn: Idn,
        /// The value in the drive's unit.
        value: i64,
        /// How the value lies in the drive.
        width: Width,
    },
}

impl Telegram {
    /// The telegrams of an axis. Values that the drive is known to lack and that the table lets go are left
    /// out.
    ///
    /// # Errors
    /// A mode has no row, the drive lacks a value that it must have, or a length is not known.
    pub(crate) fn compile(
        tables: &SercosTables,
        dictionary: &SercosDictionary,
        axis: &SercosAxis,
        facts: &DriveFacts,
    ) -> Result<Self, SercosError> {
        let compiler = Compiler { tables, dictionary, axis, facts };
        let signals = compiler.signals()?;
        match FixedConnections::of(tables, facts)? {
            Some(fixed) => compiler.fixed_telegram(&signals.0, &fixed),
            None => compiler.own_telegram(signals),
        }
    }
}

impl Compiler<'_> {
    fn width(&self, idn: Idn) -> Result<Width, SercosError> {
        self.facts.width(idn, self.dictionary).ok_or(SercosError::Length(idn))
    }

    /// Bytes of a value in a telegram.
    fn bytes(&self, idn: Idn) -> Result<u16, SercosError> {
        u16::try_from(self.width(idn)?.bytes()).map_err(|_| SercosError::Length(idn))
    }

    /// The telegrams of a drive that has its own lists. Every value of the command has to be one that the axis gives.
    fn fixed_telegram(
        &self,
        command: &[(Signal, Idn)],
        fixed: &FixedConnections,
    ) -> Result<Telegram, SercosError> {
        let mut telegram = Telegram::default();
        let unfilled =
            |idn: &&Idn| **idn != self.tables.control && !command.iter().any(|(_, known)| known == *idn);
        if let Some(&idn) = fixed.command.idns.iter().find(unfilled) {
            return Err(SercosError::FixedUnfilled { list: fixed.command.list(), idn });
        }
        for (idns, items, bytes) in [
            (&fixed.command.idns, &mut telegram.command, &mut telegram.command_bytes),
            (&fixed.feedback.idns, &mut telegram.feedback, &mut telegram.feedback_bytes),
        ] {
            for &idn in idns {
                items.push(idn.into());
                *bytes += self.bytes(idn)?;
            }
        }
        Ok(telegram)
    }

    /// The telegrams of a drive that takes the lists of the axis: words, signals, words of the status, captures.
    fn own_telegram(&self, (command, actual): (Signals, Signals)) -> Result<Telegram, SercosError> {
        let Self { tables, dictionary, axis, facts } = *self;
        let mut telegram = Telegram::default();
        for (word, signals, idns, bytes) in [
            (tables.control, command, &mut telegram.command, &mut telegram.command_bytes),
            (tables.status_word, actual, &mut telegram.feedback, &mut telegram.feedback_bytes),
        ] {
            idns.push(word.into());
            *bytes = WORD_BYTES;
            for (_, idn) in signals {
                idns.push(idn.into());
                *bytes += self.bytes(idn)?;
            }
        }
        for idn in tables.added_words() {
            let width = facts.width(idn, dictionary).and_then(|width| u16::try_from(width.bytes()).ok());
            let listed = !axis.bare && captures::is_listed(tables.configurable[0], idn, facts);
            if let Some(width) = width.filter(|_| listed && !telegram.feedback.contains(&idn.into())) {
                telegram.feedback.push(idn.into());
                telegram.feedback_bytes += width;
            }
        }
        captures::extend(&mut telegram, tables, dictionary, axis, facts);
        Ok(telegram)
    }
}

impl crate::Mapping {
    /// Bytes with C-CON, even, of the longest connections that a drive for this axis can need, whatever it tells: to the
    /// drive and from it.
    #[must_use]
    pub fn telegram_room(&self, axis: &SercosAxis) -> (u16, u16) {
        Telegram::room(self.sercos_of(axis), &self.dictionaries.sercos, axis)
    }
}

impl Telegram {
    /// Bytes with C-CON, even, of the longest telegrams that a drive for this axis can need, to it and from it: every
    /// value that it may have, in four bytes where the dictionary does not say.
    pub(crate) fn room(
        tables: &SercosTables,
        dictionary: &SercosDictionary,
        axis: &SercosAxis,
    ) -> (u16, u16) {
        let facts = DriveFacts::new();
        let bytes = |idn| facts.width(idn, dictionary).map_or(4, |width| width.bytes());
        let mut idns: [Vec<Idn>; 2] = Default::default();
        for rule in tables.modes.iter().filter(|rule| axis.modes.contains(&rule.selection)) {
            for (list, signals) in idns.iter_mut().zip([&rule.command, &rule.actual]) {
                list.extend(signals.iter().filter_map(|signal| Some(tables.signal(*signal)?.idn)));
            }
        }
        idns[1].extend(tables.added_words());
        if axis.captures == CaptureMode::Cyclic {
            // In either direction: which, the drive says.
            let captures = super::captures::idns(tables);
            idns.iter_mut().for_each(|list| list.extend(&captures));
        }
        let [command, feedback] = idns.map(|mut list| {
            list.sort_unstable();
            list.dedup();
            let values: usize = list.into_iter().map(bytes).sum();
            let longest = profile_sercos::master::config::CONNECTION_LEN_MAX;
            let len =
                (CONNECTION_CONTROL_LEN + usize::from(WORD_BYTES) + values).next_multiple_of(2).min(longest);
            u16::try_from(len).unwrap_or(u16::MAX)
        });
        (command, feedback)
    }
}

/// What the values of an IDN measure, and generic units in one count.
pub(crate) fn unit_of(
    tables: &SercosTables,
    dictionary: &SercosDictionary,
    units: AxisUnits,
    facts: &DriveFacts,
    idn: Idn,
    quantity: Quantity,
) -> Result<Lsb, SercosError> {
    let plain = Lsb { quantity, generic: Ratio::ONE, zero: 0, modulo: None };
    let row = dictionary.idn(idn);
    match row.map(|row| &row.unit) {
        None | Some(IdnUnit::None) => Ok(plain),
        Some(IdnUnit::Fixed { unit, decimals }) => {
            let generic = fixed_unit(tables, facts, idn, quantity, Some((unit, *decimals)))?;
            Ok(Lsb { generic, ..plain })
        }
        Some(IdnUnit::Scaled(scaling)) => {
            let rule = tables.scalings.iter().find(|rule| rule.scaling == *scaling);
            let rule = rule.ok_or_else(|| ScalingError::Unknown(scaling.clone()))?;
            let feed = |idn| feed_constant(tables, dictionary, facts, idn);
            Ok(rule.lsb(&ScalingSource { axis: units, facts, dictionary, feed: &feed })?)
        }
    }
}

/// Generic units in one count of a value whose unit does not follow from scaling parameters. The drive's elements 3 and
/// 4 count more than the dictionary.
fn fixed_unit(
    tables: &SercosTables,
    facts: &DriveFacts,
    idn: Idn,
    quantity: Quantity,
    dictionary: Option<(&String, u8)>,
) -> Result<Ratio, SercosError> {
    let mut units = tables.units.iter().filter(|known| known.quantity == quantity);
    let found = match (facts.unit(idn), dictionary) {
        (Some(text), _) => units.find(|known| known.is(text)).ok_or_else(|| ScalingError::Unit {
            idn,
            expected: quantity,
            got: text.to_owned(),
        })?,
        (None, Some((unit, _))) => {
            units.find(|known| known.unit == *unit).ok_or_else(|| ScalingError::Unknown(unit.clone()))?
        }
        (None, None) => return Err(ScalingError::NotRead(idn).into()),
    };
    let decimals = dictionary.map_or(0, |(_, decimals)| decimals);
    let decimals = facts.attribute(idn).map_or(decimals, |attribute| attribute.decimals());
    let power = power_of_ten(idn, -i64::from(decimals))?;
    Ok(found.ratio.then(power).ok_or(ScalingError::Overflow(idn))?)
}

/// Nanounits that a linear load moves in a nanoturn.
fn feed_constant(
    tables: &SercosTables,
    dictionary: &SercosDictionary,
    facts: &DriveFacts,
    idn: Idn,
) -> Result<Ratio, ScalingError> {
    let value = facts.number(idn, dictionary).ok_or(ScalingError::NotRead(idn))?;
    let value = Ratio::new(above_zero(idn, value)?, 1).ok_or(ScalingError::Overflow(idn))?;
    let unit = match dictionary.idn(idn).map(|row| &row.unit) {
        Some(IdnUnit::Fixed { unit, decimals }) => Some((unit, *decimals)),
        _ => None,
    };
    let unit = fixed_unit(tables, facts, idn, Quantity::None, unit).map_err(|error| match error {
        SercosError::Scaling(error) => error,
        _ => ScalingError::NotRead(idn),
    })?;
    value.then(unit).ok_or(ScalingError::Overflow(idn))
}

impl DriveProgram {
    /// The program of an axis whose drive has reported its scaling.
    ///
    /// # Errors
    /// As [`Telegram::compile`], and when the scaling was not read or has no row.
    pub(crate) fn compile(
        tables: &SercosTables,
        dictionary: &SercosDictionary,
        axis: &SercosAxis,
        facts: &DriveFacts,
    ) -> Result<Self, SercosError> {
        let compiler = Compiler { tables, dictionary, axis, facts };
        let signals = compiler.signals()?;
        let telegram = Telegram::compile(tables, dictionary, axis, facts)?;
        let mut program = Self::new(telegram, !axis.silent);
        compiler.add_signals(&mut program, signals)?;
        compiler.add_actions(&mut program)?;
        compiler.add_reports(&mut program)?;
        compiler.add_modes(&mut program)?;
        compiler.add_procedures(&mut program)?;
        compiler.add_status(&mut program)?;
        compiler.add_faults(&mut program)?;
        program.add_parameters(&tables.parameters, |rule| compiler.parameter(rule))?;
        program.mechanics = Some(compiler.mechanics());
        program.encoders = axis.feedback;
        program.feeds_forward = compiler.feeds_forward();
        program.captures = captures::compile(&compiler, &program.telegram);
        Ok(program)
    }
}

pub(crate) struct Compiler<'t> {
    pub tables: &'t SercosTables,
    pub dictionary: &'t SercosDictionary,
    pub axis: &'t SercosAxis,
    pub facts: &'t DriveFacts,
}

impl Compiler<'_> {
    pub fn unit(&self, idn: Idn, quantity: Quantity) -> Result<Lsb, SercosError> {
        unit_of(self.tables, self.dictionary, self.axis.units, self.facts, idn, quantity)
    }

    /// Where a value that is in a telegram begins.
    fn offset(&self, idn: Idn, telegram: &[Item]) -> Result<u16, SercosError> {
        self.place(idn, telegram).and_then(|place| place.offset).ok_or(SercosError::Length(idn))
    }

    /// Words and signals with their places in the telegrams.
    fn add_signals(
        &self,
        program: &mut DriveProgram,
        (command, actual): (Signals, Signals),
    ) -> Result<(), SercosError> {
        if command.iter().any(|(signal, _)| *signal == Signal::PositionCommand) {
            program.position_step = self.position_step()?;
        }
        program.words_at = [
            self.offset(self.tables.control, &program.telegram.command)?,
            self.offset(self.tables.status_word, &program.telegram.feedback)?,
        ];
        let carriers = |signals: &Signals| signals.iter().map(|(_, idn)| Item::from(*idn)).collect();
        program.carriers = Some([carriers(&command), carriers(&actual)]);
        for (signal, idn) in command {
            let field = self.field(signal, idn, self.offset(idn, &program.telegram.command)?)?;
            program.add_field(field)?;
        }
        for (signal, idn) in actual {
            let field = self.field(signal, idn, self.offset(idn, &program.telegram.feedback)?)?;
            program.add_field(field)?;
        }
        Ok(())
    }

    /// Values of the control word and procedure commands of the actions.
    fn add_actions(&self, program: &mut DriveProgram) -> Result<(), SercosError> {
        for (action, pattern) in &self.tables.actions {
            program.actions.set(*action, *pattern);
        }
        for (action, idn) in &self.tables.commands {
            let command = (*action, Item::from(*idn));
            program.commands.try_push(command).map_err(|_| Full("the table of commands"))?;
        }
        Ok(())
    }

    /// Whether a row counts for this drive, which acknowledges command values or does not.
    fn counts(&self, acknowledges: Option<bool>) -> bool {
        acknowledges.is_none_or(|wanted| wanted != self.axis.silent)
    }

    fn add_reports(&self, program: &mut DriveProgram) -> Result<(), SercosError> {
        for rule in self.tables.reports.iter().filter(|rule| self.counts(rule.acknowledges)) {
            let ReportRule { pattern, report, procedure, .. } = *rule;
            let fits = (procedure == Some(true) || program.reports.push(pattern, report))
                && (procedure == Some(false) || program.led_reports.push(pattern, report));
            if !fits {
                return Err(Full("the table of reports").into());
            }
        }
        Ok(())
    }

    fn add_modes(&self, program: &mut DriveProgram) -> Result<(), SercosError> {
        for (rule, slot) in self.modes()?.chosen {
            let SlotRule { control, status, .. } = *slot;
            let refuse = |signal| self.tables.signal(signal).is_some_and(|row| row.refuse);
            let (needs, carried) = program.command_sets(&rule.command, refuse);
            program.add_mode(ModeEntry {
                selection: rule.selection,
                control,
                status,
                bits: BitPattern::default(),
                handshake: None,
                needs,
                carried,
            })?;
        }
        Ok(())
    }

    /// What the drive does by itself on a procedure command; without the command it is left out.
    fn add_procedures(&self, program: &mut DriveProgram) -> Result<(), SercosError> {
        for rule in self.axis.modes.iter().filter_map(|mode| self.tables.procedure(*mode)) {
            if let Some(led_in) = rule.led_in
                && !self.axis.modes.contains(&led_in)
            {
                return Err(SercosError::LedIn { procedure: rule.selection, led_in });
            }
            if rule.commands.iter().any(|idn| self.facts.is_missing(*idn)) {
                continue;
            }
            let commands = rule.commands.iter().copied().map(Item::from).take(PROCEDURE_COMMANDS_MAX);
            program.add_procedure(Procedure {
                selection: rule.selection,
                led_in: rule.led_in,
                by: ProcedureBy::Commands(commands.collect()),
            })?;
        }
        Ok(())
    }

    /// Status bits, of the words that are in the telegram.
    fn add_status(&self, program: &mut DriveProgram) -> Result<(), SercosError> {
        for idn in self.tables.status_words() {
            let place = self.place(idn, &program.telegram.feedback).filter(|place| place.offset.is_some());
            // The builder has counted them.
            place.map(|place| program.status_words.try_push(place));
        }
        for rule in self.tables.status.iter().filter(|rule| self.counts(rule.acknowledges)) {
            let word = Some(rule.word).filter(|word| *word != self.tables.status_word).map(Item::from);
            if program.carries_word(word) {
                program.add_status(StatusRow { word, pattern: rule.pattern, bit: rule.bit })?;
            }
        }
        Ok(())
    }

    /// Faults, and where the drive keeps its diagnostic message.
    fn add_faults(&self, program: &mut DriveProgram) -> Result<(), SercosError> {
        program.add_faults(self.tables.faults.iter().copied())?;
        let diagnosis = self.tables.diagnosis.into_iter().flatten();
        program.diagnosis.extend(diagnosis.filter(|idn| !self.facts.is_missing(*idn)).map(Item::from));
        Ok(())
    }

    fn field(&self, signal: Signal, idn: Idn, offset: u16) -> Result<Field, SercosError> {
        let width = self.width(idn)?;
        let lsb = self.unit(idn, signal.quantity())?;
        let absolute = signal.quantity() == Quantity::Position
            && !matches!(signal, Signal::FollowingError | Signal::PositionOffset);
        let wraps = lsb.modulo.filter(|_| absolute);
        if let Some((value, idn)) = wraps
            && value - 1 > width.range().1
        {
            let expected = "a range whose end fits the length of the position";
            return Err(ScalingError::Value { idn, expected, value }.into());
        }
        let wraps = wraps.map(|(range, _)| range);
        let generic = if self.is_inverted(signal)? { negative(lsb.generic) } else { Some(lsb.generic) };
        let generic = generic.ok_or(ScalingError::Overflow(idn))?;
        let (conversion, modulo) = if signal.is_command() {
            // What leaves the range of the drive is clamped and reported.
            let to_drive = to_drive(idn, generic, lsb.zero)?;
            let limits = self.facts.limits(idn, self.dictionary).filter(|_| wraps.is_none());
            (limits.map_or(to_drive, |(min, max)| to_drive.within(min, max)), wraps)
        } else {
            let range = (width.bits() == 32).then_some(FULL_RANGE).filter(|_| absolute);
            (from_drive(idn, generic, lsb.zero)?, wraps.or(range))
        };
        Ok(Field { signal, offset, width, conversion, modulo })
    }

    /// Whether the sign of a value in the telegram is not that of the axis: the drive inverts each value by a bit of its
    /// own, and the axis goes the way of the actual position.
    fn is_inverted(&self, signal: Signal) -> Result<bool, SercosError> {
        let rule = self.tables.signal(signal).and_then(|rule| rule.polarity);
        let Some((own, axis)) = rule.zip(self.tables.direction) else { return Ok(false) };
        let bit = |polarity: Polarity| match self.facts.number(polarity.idn, self.dictionary) {
            Some(word) => Ok(word >> polarity.bit & 1 != 0),
            None if self.facts.is_missing(polarity.idn) => Ok(false),
            None => Err(ScalingError::NotRead(polarity.idn)),
        };
        Ok(bit(own)? != bit(axis)?)
    }

    /// The longest step of a position command that leads a drive with modulo positions the way that is meant.
    fn position_step(&self) -> Result<Option<i64>, SercosError> {
        let Some(rule) = self.tables.signal(Signal::PositionCommand) else { return Ok(None) };
        if self.facts.is_missing(rule.idn) {
            return Ok(None);
        }
        let lsb = self.unit(rule.idn, Quantity::Position)?;
        // One count less than half, for the rounding of both ends.
        let half = lsb.modulo.map(|(range, _)| range / 2 - 1);
        Ok(half.map(|half| lsb.generic.convert(half, Rounding::Floor).value))
    }

    /// What lies between motor and load, by the gear and the feed constant of the positions.
    fn mechanics(&self) -> Mechanics {
        let kind = self.axis.units.kind;
        let turns = |idn| self.facts.number(idn, self.dictionary).filter(|turns| *turns > 0);
        // The gear of torques goes the other way.
        let rules = self.tables.scalings.iter();
        let gear = rules.clone().filter_map(|rule| rule.gear).find(|gear| gear.generic.is_none());
        let gear = gear.and_then(|gear| Ratio::new(turns(gear.motor)?, turns(gear.load)?));
        let feed = rules.filter_map(|rule| rule.feed).next();
        let travel = feed.and_then(|idn| feed_constant(self.tables, self.dictionary, self.facts, idn).ok());
        Mechanics { kind, gear, travel: travel.filter(|_| kind == UnitKind::Linear) }
    }

    /// Whether the loops of the drive feed the acceleration forward by themselves.
    fn feeds_forward(&self) -> bool {
        let mut rules = self.tables.parameters.iter();
        rules.any(|rule| {
            rule.parameter == Parameter::OWN_ACCELERATION_FEED_FORWARD && !self.facts.is_missing(rule.at.idn)
        })
    }

    /// Whether the drive works in another operation mode than this one, in a mode of the axis that has both.
    fn works_without(&self, code: u16) -> bool {
        let rules = self.tables.modes.iter().filter(|rule| self.axis.modes.contains(&rule.selection));
        let mut rules = rules.filter(|rule| rule.codes.contains(&code));
        // They are tried in order: the first that the drive lists.
        rules.any(|rule| self.codes(rule).first().is_some_and(|first| *first != code))
    }

    /// The entry of a parameter; `None` when the drive lacks it or does not report its unit.
    pub fn parameter(&self, rule: &ParameterRule) -> Result<Option<ParameterEntry>, SercosError> {
        if self.facts.is_missing(rule.at.idn) || rule.at.acts_in.is_some_and(|code| self.works_without(code))
        {
            return Ok(None);
        }
        let Some(width) = self.facts.width(rule.at.idn, self.dictionary) else { return Ok(None) };
        let unit = if rule.at.unit_by_drive {
            let generic = fixed_unit(self.tables, self.facts, rule.at.idn, rule.quantity, None);
            generic.map(|generic| Lsb { quantity: rule.quantity, generic, zero: 0, modulo: None })
        } else {
            self.unit(rule.at.idn, rule.quantity)
        };
        let lsb = match unit {
            Ok(lsb) => lsb,
            // A quantity that no mode needs may well be unscaled: the parameter is served as if it were
            // missing.
            Err(SercosError::Scaling(_)) => return Ok(None),
            Err(error) => return Err(error),
        };
        let overflow = || ScalingError::Overflow(rule.at.idn);
        let ratio = lsb.generic.then(rule.factor.inverse().ok_or_else(overflow)?).ok_or_else(overflow)?;
        // Minimum and maximum of a floating point number are such numbers too: the drive itself compares them.
        let limits = self.facts.limits(rule.at.idn, self.dictionary).filter(|_| !width.is_float());
        let limits = limits.unwrap_or(width.range());
        let outward = to_drive(rule.at.idn, ratio, lsb.zero)?.within(limits.0, limits.1);
        let inward = from_drive(rule.at.idn, ratio, lsb.zero)?;
        Ok(Some(ParameterEntry {
            parameter: rule.parameter,
            item: rule.at.idn.into(),
            width,
            to_drive: rule.to_drive.then_some(outward),
            from_drive: rule.from_drive.then_some(inward),
        }))
    }
}

fn negative(ratio: Ratio) -> Option<Ratio> {
    Ratio::new(ratio.num().checked_neg()?, ratio.den())
}

/// From the generic unit to counts.
fn to_drive(idn: Idn, generic: Ratio, zero: i64) -> Result<Conversion, ScalingError> {
    let ratio = generic.inverse().ok_or(ScalingError::Overflow(idn))?;
    Ok(Conversion::new(ratio).with_offset(zero))
}

/// From counts to the generic unit. A zero that is no whole number there is rounded.
fn from_drive(idn: Idn, generic: Ratio, zero: i64) -> Result<Conversion, ScalingError> {
    let offset = generic.apply(zero, Rounding::Nearest).map_err(|_| ScalingError::Overflow(idn))?;
    Ok(Conversion::new(generic).with_offset(-offset))
}
