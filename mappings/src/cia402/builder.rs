//! From rows to the resolved mapping.

use std::collections::BTreeSet;

use profile_generic::image::Signal;
use profile_generic::mode::{InterpolationSource, ModeSelection};
use profile_generic::program::BitPattern;
use profile_generic::quantity::Quantity;
use profile_generic::time::DurationNs;

use super::captures::{CaptureRule, LatchRule};
use super::{
    ActionRule, Base, Cia402Tables, DriveDefaults, DriveMode, Drives, Handshake, Inversion, Method, ModeRule,
    Object, ParameterAt, ProcedureRule, ReportRule, ScalingRule, SignalRule, StatusRule, StepKind, StepRule,
    Tells, VOLTAGE_BIT, Value, Words,
};
use crate::dictionary::{Cia402Access, Cia402CodeSet, Cia402Sub, Dictionaries, quantity};
use crate::drive_program::FaultRow;
use crate::drive_rows::{
    FAILS, every_action, fixed_unit, mapped, mode_row, once, parameter_row, signal_row, written_parameter,
};
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{
    Cia402CaptureRow, Cia402CommissionRow, Cia402FaultClassRow, Cia402FaultRow, Cia402HandshakeRow,
    Cia402MethodRow, Cia402ModeRow, Cia402ParameterRow, Cia402ProcedureRow, Cia402ScalingRow,
    Cia402SignalRow, Cia402UnboundRow, FieldValueRow, GenericCia402File, Name,
};
use crate::generic_names::{
    action, capture_kind, cause_and_reaction, interpolation, operating_mode, report, status_bit,
};
use crate::item::Item;
use crate::load::Parsed;
use crate::resolver::{Resolver, over};

/// Where the error code is.
const ERROR_CODE: Object = Object { index: 0x603F, sub: 0 };

impl Cia402Tables {
    pub(crate) fn resolve(
        file: &Parsed<GenericCia402File>,
        dictionaries: &Dictionaries,
        errors: &mut Findings,
    ) -> Self {
        let rows = &file.rows;
        let resolver = Resolver::new(&file.text, errors);
        let mut builder = Builder {
            resolver,
            dictionaries,
            tables: Self::default(),
            bound: BTreeSet::from([(ERROR_CODE.index, file.text.path())]),
        };
        builder.resolver.head(&rows.format, "mapping", &rows.mapping, "generic to cia402");
        builder.units(rows);
        for row in &rows.scaling {
            builder.scaling(row);
        }
        builder.drive(rows);
        builder.words(rows);
        for row in &rows.signal {
            builder.signal(row);
        }
        for row in &rows.mode {
            builder.mode(row);
        }
        for row in &rows.procedure {
            builder.procedure(row);
        }
        builder.states(rows);
        for row in &rows.fault {
            builder.fault(row);
        }
        for row in &rows.fault_class {
            builder.fault_class(row);
        }
        for row in &rows.parameter {
            builder.parameter(row);
        }
        for row in &rows.capture {
            builder.capture(row);
        }
        for row in &rows.commission {
            builder.step(row);
        }
        builder.unbound(&rows.unbound);
        builder.tables
    }

    /// The value that an object of the dictionary holds, by its name in the files; for worked examples.
    pub(crate) fn value_of(dictionaries: &Dictionaries, text: &str) -> Option<Value> {
        let object = Object::parse(text)?;
        value(object, dictionaries.cia402.sub(object.index, object.sub)?)
    }
}

fn value(object: Object, row: &Cia402Sub) -> Option<Value> {
    Some(Value { object, width: row.data_type?.width()?, unit: row.unit.clone() })
}

struct Builder<'a> {
    resolver: Resolver<'a>,
    dictionaries: &'a Dictionaries,
    tables: Cia402Tables,
    /// Objects that rows name, with the files of the rows.
    bound: BTreeSet<(u16, &'a str)>,
}

impl<'a> Builder<'a> {
    /// What no row binds has a reason, once.
    fn unbound(&mut self, rows: &[Cia402UnboundRow]) {
        for row in rows {
            self.resolver.reason(&row.reason);
            for name in &row.objects {
                let known = &self.dictionaries.cia402;
                let index = u16::from_str_radix(name.get_ref(), 16).ok();
                let Some(object) = index.and_then(|index| known.object(index)) else {
                    let message = format!(
                        "expected an object of the dictionary such as 60FD, got `{}`",
                        name.get_ref()
                    );
                    self.resolver.error(code::UNKNOWN_NAME, name.span(), "objects", message);
                    continue;
                };
                let (shown, path) = (name.get_ref(), self.resolver.path_of(name));
                let family = object.index..=object.last;
                let mut bound = self.bound.iter().filter(|(index, _)| family.contains(index)).peekable();
                let wins = bound.peek().is_some();
                // A row that is laid over the table wins over its list.
                if bound.any(|(_, bound_in)| *bound_in == path) {
                    let message = format!("a row binds {shown}");
                    self.resolver.error(code::CONTRADICTION, name.span(), "objects", message);
                }
                if self.tables.unbound.iter().any(|(index, _)| *index == object.index) {
                    let message = format!("{shown} is defined twice");
                    self.resolver.error(code::TWICE, name.span(), "objects", message);
                }
                if !wins {
                    self.tables.unbound.push((object.index, row.reason.get_ref().clone()));
                }
            }
        }
        let listed = |index: u16| self.tables.unbound.iter().any(|(known, _)| *known == index);
        // The error code stands for the faults.
        let open = self.dictionaries.cia402.objects().iter().filter(|object| {
            let family = object.index..=object.last;
            let bound = self.bound.iter().any(|(index, _)| family.contains(index));
            object.index != ERROR_CODE.index && !listed(object.index) && !bound
        });
        self.tables.unanswered = open.map(|object| object.index).collect();
    }

    fn object(&mut self, key: &str, name: &Name) -> Option<(Object, &'a Cia402Sub)> {
        let Some(object) = Object::parse(name.get_ref()) else {
            let message = format!("expected an object such as 607A:00, got `{}`", name.get_ref());
            self.resolver.error(code::UNKNOWN_NAME, name.span(), key, message);
            return None;
        };
        let row = self.dictionaries.cia402.sub(object.index, object.sub);
        if row.is_none() {
            let message = format!("expected an object of the dictionary, got {object}");
            let index = format!("0x{:04X}", object.index);
            self.resolver.lacks(code::UNKNOWN_NAME, name.span(), key, &index, message);
        }
        self.bound.insert((object.index, self.resolver.path_of(name)));
        Some((object, row?))
    }

    /// An object that holds a number of known length.
    fn value(&mut self, key: &str, name: &Name) -> Option<(Value, &'a Cia402Sub)> {
        let (object, row) = self.object(key, name)?;
        let value = value(object, row);
        if value.is_none() {
            let message = format!("expected an object of known length, {object} has none in the dictionary");
            self.resolver.error(code::NO_LENGTH, name.span(), key, message);
        }
        Some((value?, row))
    }

    fn set(&self, name: &str) -> Option<&'a Cia402CodeSet> {
        self.dictionaries.cia402.codes(name)
    }

    fn units(&mut self, rows: &GenericCia402File) {
        for row in &rows.unit {
            let known = self.dictionaries.cia402.units();
            let find = |text: &str| known.iter().any(|(unit, _)| unit == text).then_some(());
            let names = known.iter().map(|(unit, _)| unit.as_str());
            let named = self.resolver.name("unit", &row.unit, "a unit of the dictionary", find, names);
            let unit = fixed_unit(&mut self.resolver, row);
            self.tables.units.extend(unit.filter(|_| named.is_some()));
        }
    }

    fn scaling(&mut self, row: &Cia402ScalingRow) {
        let Some(quantity) = quantity(&mut self.resolver, &row.quantity) else { return };
        let methods = row.methods.iter().filter_map(|method| self.method(row, method)).collect();
        let unit = row.unit.get_ref().clone();
        let known = self.tables.scalings.iter().any(|known| known.unit == unit);
        once(&mut self.resolver, known, "unit", &row.unit);
        self.tables.scalings.push(ScalingRule { unit, quantity, methods });
    }

    fn method(&mut self, row: &Cia402ScalingRow, method: &Cia402MethodRow) -> Option<Method> {
        let base = match (&method.base, &method.like) {
            (Some(base), None) => Base::Generic(self.resolver.ratio("base", base)?),
            (None, Some(like)) => {
                let scalings = &self.tables.scalings;
                let find = |text: &str| scalings.iter().position(|known| known.unit == text);
                let known = scalings.iter().map(|known| known.unit.as_str());
                Base::Like(self.resolver.name("like", like, "the unit of a row above", find, known)?)
            }
            _ => {
                let message = format!("expected `base` or `like` in `{}`, got both or neither", method.name);
                self.resolver.error(code::CONTRADICTION, row.unit.span(), "methods", message);
                return None;
            }
        };
        let mut values = |key, names: &[Name]| -> Vec<Value> {
            names.iter().filter_map(|name| self.value(key, name)).map(|(value, _)| value).collect()
        };
        let (times, over) = (values("times", &method.times), values("over", &method.over));
        let when = match &method.when {
            Some((name, number)) => Some((self.value("when", name)?.0, *number)),
            None => None,
        };
        Some(Method { when, base, times, over })
    }

    fn drive(&mut self, rows: &GenericCia402File) {
        let row = &rows.drive;
        let voltage = self.resolver.word("voltage_bit", &row.voltage_bit, &VOLTAGE_BIT).unwrap_or_default();
        let tells = Tells { follows: row.acknowledges, voltage };
        let modes = row.modes.as_ref().map(|names| self.mode_codes(names));
        self.tables.drive = DriveDefaults { tells, modes };
    }

    fn words(&mut self, rows: &GenericCia402File) {
        let row = &rows.words;
        let mut word = |key, name| self.object(key, name).map(|(object, _)| object).unwrap_or_default();
        self.tables.words = Words {
            control: word("control", &row.control),
            status: word("status", &row.status),
            mode: word("mode", &row.mode),
            mode_shown: word("mode_shown", &row.mode_shown),
            modes_supported: word("modes_supported", &row.modes_supported),
            polarity: word("polarity", &row.polarity),
            direction: 0,
            error: ERROR_CODE,
        };
        self.tables.words.direction = self.polarity("direction", &row.direction).unwrap_or_default();
    }

    /// The bit of a field of the polarity.
    fn polarity(&mut self, key: &str, name: &Name) -> Option<u32> {
        let bits = &self.set("Polarity")?.codes;
        let find = |text: &str| bits.iter().find(|bit| bit.name == text);
        let names = bits.iter().map(|bit| bit.name.as_str());
        let bit = self.resolver.name(key, name, "a field of the polarity", find, names)?;
        u32::try_from(bit.code).ok()
    }

    /// Whether the unit of a value can become the quantity.
    fn measures(&self, value: &Value, quantity: Quantity) -> bool {
        if value.unit.is_empty() {
            return quantity == Quantity::None;
        }
        let fixed = self.tables.units.iter().any(|unit| unit.unit == value.unit && unit.quantity == quantity);
        let scaled = |rule: &ScalingRule| rule.unit == value.unit && rule.quantity == quantity;
        // What is counted, such as turns of a gear, has a unit in the dictionary and is a plain number here.
        fixed || self.tables.scalings.iter().any(scaled) || quantity == Quantity::None
    }

    fn signal(&mut self, row: &Cia402SignalRow) {
        let head = signal_row(&mut self.resolver, &row.signal, &row.direction, &row.missing);
        let value = self.value("object", &row.object);
        let (Some((signal, to_drive, refuse)), Some((value, entry))) = (head, value) else { return };
        if !self.measures(&value, signal.quantity()) {
            let message = format!("the unit of {} is not a unit of {}", value.object, signal.quantity());
            return self.resolver.error(code::UNIT, row.object.span(), "object", message);
        }
        self.writable(entry, to_drive, &row.direction, value.object);
        let modes = self.mode_codes(&row.modes);
        let shared = |known: &SignalRule| {
            known.modes.is_empty() && modes.is_empty() || known.modes.iter().any(|mode| modes.contains(mode))
        };
        let known = self.tables.signals.iter().any(|known| known.signal == signal && shared(known));
        once(&mut self.resolver, known, "signal", &row.signal);
        let polarity = row.polarity.as_ref().and_then(|name| self.polarity("polarity", name));
        let load = row.load.as_ref().and_then(|name| self.load_value(signal, name));
        self.tables.signals.push(SignalRule { signal, value, modes, polarity, refuse, load });
    }

    fn load_value(&mut self, signal: Signal, name: &Name) -> Option<Value> {
        let (value, _) = self.value("load", name)?;
        if !self.measures(&value, signal.quantity()) {
            let message = format!("the unit of {} is not a unit of {}", value.object, signal.quantity());
            self.resolver.error(code::UNIT, name.span(), "load", message);
        }
        Some(value)
    }

    fn writable(&mut self, entry: &Cia402Sub, to_drive: bool, direction: &Name, object: Object) {
        let fixed = matches!(entry.access, Some(Cia402Access::Ro | Cia402Access::Const));
        if to_drive && fixed {
            let message = format!("{object} is read only");
            self.resolver.error(code::READ_ONLY, direction.span(), "direction", message);
        }
    }

    fn drive_mode(&mut self, name: &Name) -> Option<DriveMode> {
        let set = self.set("Supported drive modes")?;
        let known = set.codes.iter().filter(|bit| bit.last == u32::try_from(bit.code).ok());
        let find = |text: &str| known.clone().find(|bit| bit.name == text);
        let names = known.clone().map(|bit| bit.name.as_str());
        let bit = self.resolver.name("modes", name, "a mode of operation", find, names)?;
        // Bit 0 of 6502 is mode 1 of 6060.
        let code = i8::try_from(bit.code + 1).ok()?;
        Some(DriveMode { name: bit.name.clone(), code, bit: u32::try_from(bit.code).ok()? })
    }

    fn drive_modes(&mut self, names: &[Name]) -> Vec<DriveMode> {
        names.iter().filter_map(|name| self.drive_mode(name)).collect()
    }

    fn mode_codes(&mut self, names: &[Name]) -> Vec<i8> {
        self.drive_modes(names).into_iter().map(|mode| mode.code).collect()
    }

    fn mode(&mut self, row: &Cia402ModeRow) {
        let head = mode_row(&mut self.resolver, &row.mode, row.interpolation.as_ref(), &row.missing);
        let modes = self.drive_modes(&row.modes);
        if row.modes.is_empty() {
            let message = "expected at least one mode of operation";
            self.resolver.error(code::MISSING_KEY, row.mode.span(), "modes", message);
        }
        let control = self.pattern("Controlword", &row.control);
        let handshake = match &row.handshake {
            None => Some(None),
            Some(handshake) => self.handshake(handshake).map(Some),
        };
        let has = |signal| modes.iter().all(|mode| self.tables.signal(signal, mode.code).is_some());
        let command = mapped(&mut self.resolver, "command", &row.command, has);
        let actual = mapped(&mut self.resolver, "actual", &row.actual, has);
        let (Some((selection, optional)), Some(control), Some(handshake)) = (head, control, handshake) else {
            return;
        };
        let same = |known: &&ModeRule| known.selection == selection;
        let mut known = self.tables.modes.iter().filter(same).flat_map(|known| &known.modes);
        once(&mut self.resolver, known.any(|known| modes.contains(known)), "mode", &row.mode);
        let rule = ModeRule { selection, optional, modes, control, handshake, command, actual };
        self.tables.modes.push(rule);
    }

    fn handshake(&mut self, row: &Cia402HandshakeRow) -> Option<Handshake> {
        let ask = self.pattern("Controlword", &row.ask);
        let taken = self.pattern("Statusword", &row.taken);
        Some(Handshake { ask: ask?, taken: taken? })
    }

    fn procedure(&mut self, row: &Cia402ProcedureRow) {
        let mode = operating_mode(&mut self.resolver, &row.mode);
        let source = interpolation(&mut self.resolver, &row.interpolation);
        if source == Some(InterpolationSource::Controller) {
            let message = "expected `drive`: what the controller leads is a [[mode]]";
            self.resolver.error(code::CONTRADICTION, row.interpolation.span(), "interpolation", message);
        }
        let modes = self.drive_modes(&row.modes);
        if row.modes.is_empty() {
            let message = "expected at least one mode of operation";
            self.resolver.error(code::MISSING_KEY, row.mode.span(), "modes", message);
        }
        let start = self.pattern("Controlword", &row.start);
        let done = self.coded_state("Homing status", "done", &row.done);
        let failed: Vec<_> =
            row.failed.iter().filter_map(|name| self.coded_state("Homing status", "failed", name)).collect();
        let (Some(mode), Some(interpolation), Some(start), Some(done)) = (mode, source, start, done) else {
            return;
        };
        let selection = ModeSelection { mode, interpolation };
        let known = self.tables.procedures.iter().any(|known| known.selection == selection);
        once(&mut self.resolver, known, "mode", &row.mode);
        let time_out = DurationNs::from_secs(i64::from(*row.seconds.get_ref()));
        self.tables.procedures.push(ProcedureRule { selection, modes, start, done, failed, time_out });
    }

    /// Mask and value of fields of a word, by the set of its bits.
    fn pattern(&mut self, set: &str, rows: &[FieldValueRow]) -> Option<BitPattern> {
        let bits = &self.set(set)?.codes;
        let place = |text: &str| {
            let bit = bits.iter().find(|bit| bit.name == text)?;
            Some(((u32::try_from(bit.code).ok()?, bit.last?), [].as_slice()))
        };
        self.resolver.pattern(rows, place, bits.iter().map(|bit| bit.name.as_str()))
    }

    fn state(&mut self, key: &str, name: &Name) -> Option<BitPattern> {
        self.coded_state("State", key, name)
    }

    /// Mask and value of a state of a set of them.
    fn coded_state(&mut self, set: &str, key: &str, name: &Name) -> Option<BitPattern> {
        let states = &self.set(set)?.codes;
        let find = |text: &str| states.iter().find(|state| state.name == text);
        let names = states.iter().map(|state| state.name.as_str());
        let what = if set == "Command" { "a command of the profile" } else { "a state of the drive" };
        let state = self.resolver.name(key, name, what, find, names)?;
        Some(BitPattern::new(state.mask?, u32::try_from(state.code).ok()?))
    }

    /// The controlword of a command: the bits that it names, and 0 in the others that mean the same in every mode.
    fn command(&mut self, name: &Name) -> Option<BitPattern> {
        let command = self.coded_state("Command", "send", name)?;
        let bits = self.set("Controlword")?.codes.iter().filter(|bit| bit.modes.is_empty());
        let single = bits.filter(|bit| bit.last == u32::try_from(bit.code).ok());
        let mask = single.filter_map(|bit| bit.last).fold(command.mask, |mask, bit| mask | 1 << bit);
        Some(BitPattern::new(mask, command.value))
    }

    fn states(&mut self, rows: &GenericCia402File) {
        for row in &rows.action {
            let Some(action) = action(&mut self.resolver, &row.action) else { continue };
            let when = match &row.when {
                Some(name) => match self.state("when", name) {
                    Some(state) => Some(state),
                    None => continue,
                },
                None => None,
            };
            let sent = match &row.send {
                Some(name) => self.command(name),
                None => Some(BitPattern::new(0, 0)),
            };
            let (Some(sent), Some(pattern)) = (sent, self.pattern("Controlword", &row.pattern)) else {
                continue;
            };
            let pattern = over(pattern, sent);
            let known = self.tables.actions.iter().any(|known| known.action == action && known.when == when);
            once(&mut self.resolver, known, "action", &row.action);
            self.tables.actions.push(ActionRule { action, when, pattern });
        }
        let actions = &self.tables.actions;
        let has = |action| actions.iter().any(|rule| rule.action == action && rule.when.is_none());
        every_action(&mut self.resolver, &rows.mapping, has, |action| {
            format!("expected a row for {action} without `when`, got none")
        });
        for row in &rows.report {
            let report = report(&mut self.resolver, &row.report);
            let state = self.state("state", &row.state);
            let pattern = self.pattern("Statusword", &row.pattern);
            let modes = self.mode_codes(&row.modes);
            let (Some(report), Some(state), Some(pattern)) = (report, state, pattern) else { continue };
            let drives = Drives { follows: row.follows, voltage: row.voltage };
            let rule = ReportRule { pattern: both(state, pattern), modes, drives, report };
            self.tables.reports.push(rule);
        }
        for row in &rows.status {
            let bit = status_bit(&mut self.resolver, &row.status);
            let Some((object, _)) = self.object("object", &row.object) else { continue };
            let state = match &row.state {
                Some(name) => self.state("state", name),
                None => Some(BitPattern::new(0, 0)),
            };
            let set = if object == self.tables.words.status { "Statusword" } else { "Digital inputs" };
            let pattern = self.pattern(set, &row.pattern);
            let modes = self.mode_codes(&row.modes);
            let inverted = match &row.inverted {
                Some(name) => status_bit(&mut self.resolver, name),
                None => bit,
            };
            let (Some(bit), Some(inverted), Some(state), Some(pattern)) = (bit, inverted, state, pattern)
            else {
                continue;
            };
            let drives = Drives { follows: row.follows, voltage: row.voltage };
            let rule = StatusRule { object, pattern: both(state, pattern), modes, drives, bit, inverted };
            self.tables.status.push(rule);
        }
    }

    fn fault(&mut self, row: &Cia402FaultRow) {
        let Some(set) = self.set("Error code") else { return };
        let codes = set.codes.iter().map(|code| (code.name.as_str(), code.code, code.code));
        let patterns = self.codes("codes", "an error code", &row.codes, codes);
        self.causes(&row.cause, row.reaction.as_ref(), &patterns);
    }

    fn fault_class(&mut self, row: &Cia402FaultClassRow) {
        let Some(set) = self.set("Error code") else { return };
        let classes = set.classes.iter().map(|class| (class.name.as_str(), class.first, class.last));
        let patterns = self.codes("classes", "a class of error codes", &row.classes, classes);
        self.causes(&row.cause, row.reaction.as_ref(), &patterns);
    }

    /// Mask and value of what has these names.
    fn codes<'n>(
        &mut self,
        key: &str,
        what: &str,
        names: &[Name],
        known: impl Iterator<Item = (&'n str, i64, i64)> + Clone,
    ) -> Vec<(BitPattern, std::ops::Range<usize>)> {
        let mut patterns = Vec::with_capacity(names.len());
        for name in names {
            let find = |text: &str| known.clone().find(|(known, ..)| *known == text);
            let found = self.resolver.name(key, name, what, find, known.clone().map(|(known, ..)| known));
            let pattern = found.and_then(|(_, first, last)| span(first, last));
            patterns.extend(pattern.map(|pattern| (pattern, name.span())));
        }
        patterns
    }

    fn causes(
        &mut self,
        cause: &Name,
        reaction: Option<&Name>,
        patterns: &[(BitPattern, std::ops::Range<usize>)],
    ) {
        let Some((cause, reaction)) = cause_and_reaction(&mut self.resolver, cause, reaction) else { return };
        let word = Item::object(ERROR_CODE.index, ERROR_CODE.sub);
        for (pattern, place) in patterns {
            if self.tables.faults.iter().any(|known| known.pattern == *pattern) {
                let message = format!("the code {:04X} is defined twice", pattern.value);
                self.resolver.error(code::TWICE, place.clone(), "codes", message);
            }
            self.tables.faults.push(FaultRow { word, pattern: *pattern, cause, reaction });
        }
    }

    fn parameter(&mut self, row: &Cia402ParameterRow) {
        let generic = &self.dictionaries.generic;
        let words = (&row.direction, row.missing.as_ref(), row.factor.as_ref());
        let rule = parameter_row(&mut self.resolver, generic, &row.parameter, words);
        let value = self.value("object", &row.object);
        let inverted = self.like("inverted", row.inverted.as_ref(), value.as_ref());
        let common = self.like("common", row.common.as_ref(), value.as_ref());
        let polarity = row.polarity.as_ref().and_then(|name| match name.get_ref().as_str() {
            "none" => Some(Inversion::Never),
            _ => self.polarity("polarity", name).map(Inversion::Bit),
        });
        let (Some(rule), Some((value, entry))) = (rule, value) else { return };
        let quantity = rule.quantity;
        if !self.measures(&value, quantity) {
            let message = format!("the unit of {} is not a unit of {quantity}", value.object);
            return self.resolver.error(code::UNIT, row.object.span(), "object", message);
        }
        self.writable(entry, rule.to_drive, &row.direction, value.object);
        let known = self.tables.parameters.iter().any(|known| known.parameter == rule.parameter);
        once(&mut self.resolver, known, "parameter", &row.parameter);
        self.tables.parameters.push(rule.at(ParameterAt { value, inverted, common, polarity }));
    }

    /// An object that takes the place of another one, whose unit it has.
    fn like(&mut self, key: &str, name: Option<&Name>, other: Option<&(Value, &Cia402Sub)>) -> Option<Value> {
        let name = name?;
        let (value, _) = self.value(key, name)?;
        if let Some((other, _)) = other.filter(|(other, _)| other.unit != value.unit) {
            let message = format!("the unit of {} is not that of {}", value.object, other.object);
            self.resolver.error(code::UNIT, name.span(), key, message);
        }
        Some(value)
    }

    fn capture(&mut self, row: &Cia402CaptureRow) {
        let Some(kind) = capture_kind(&mut self.resolver, &row.capture, &row.edge) else { return };
        let set = |object: Object| match object.index {
            0x60B8 => "Touch probe function",
            0x60B9 => "Touch probe status",
            _ => "Digital inputs",
        };
        let Some((word, _)) = self.value("word", &row.word) else { return };
        let Some(pattern) = self.pattern(set(word.object), &row.pattern) else { return };
        let latch = match (&row.value, &row.function) {
            (None, None) if row.enable.is_empty() && row.select.is_empty() => None,
            (Some(value), Some(function)) => {
                let Some((value, _)) = self.value("value", value) else { return };
                if !self.measures(&value, Quantity::Position) {
                    let message =
                        format!("the unit of {} is not a unit of {}", value.object, Quantity::Position);
                    self.resolver.error(code::UNIT, row.capture.span(), "value", message);
                }
                let Some((held, entry)) = self.value("function", function) else { return };
                self.writable(entry, true, function, held.object);
                let enable = self.pattern(set(held.object), &row.enable);
                let select = self.pattern(set(held.object), &row.select);
                let (Some(enable), Some(select)) = (enable, select) else { return };
                Some(LatchRule { value, function: held, enable, select })
            }
            _ => {
                let message = "expected `value` and `function` with `enable` and `select`, or none of them";
                return self.resolver.error(code::CONTRADICTION, row.capture.span(), "value", message);
            }
        };
        let known = self.tables.captures.iter().any(|known| known.kind == kind);
        once(&mut self.resolver, known, "capture", &row.capture);
        self.tables.captures.push(CaptureRule { kind, word, pattern, latch });
    }

    fn step(&mut self, row: &Cia402CommissionRow) {
        let words = [
            ("write", Verb::Write),
            ("read", Verb::Read),
            ("read_scaling", Verb::ReadScaling),
            ("read_parameters", Verb::ReadParameters),
            ("read_captures", Verb::ReadCaptures),
            ("write_cycle", Verb::WriteCycle),
            ("write_mode", Verb::WriteMode),
        ];
        let Some(verb) = self.resolver.word("do", &row.step, &words) else { return };
        let fail = self.resolver.word("refused", &row.refused, &FAILS);
        let modes = self.mode_codes(&row.modes);
        let (Some(kind), Some(fail)) = (self.kind(row, verb), fail) else { return };
        self.tables.steps.push(StepRule { kind, modes, fail });
    }

    fn kind(&mut self, row: &Cia402CommissionRow, verb: Verb) -> Option<StepKind> {
        let Cia402CommissionRow { object, exponent, value, parameter: wanted, .. } = row;
        match (verb, object, exponent, value, wanted) {
            (Verb::Read, Some(object), None, None, None) => {
                Some(StepKind::Read(self.object("object", object)?.0))
            }
            (Verb::Write, Some(object), None, Some(number), None) => {
                let (held, entry) = self.value("object", object)?;
                self.writable(entry, true, object, held.object);
                let (min, max) = held.width.range();
                if !(min..=max).contains(number.get_ref()) {
                    let message = format!("expected {min} to {max}, got {}", number.get_ref());
                    self.resolver.error(code::OUT_OF_RANGE, number.span(), "value", message);
                }
                Some(StepKind::Write(held, *number.get_ref()))
            }
            (Verb::Write, None, None, None, Some(name)) => {
                let generic = &self.dictionaries.generic;
                written_parameter(&mut self.resolver, generic, &self.tables.parameters, name)
                    .map(StepKind::WriteParameter)
            }
            (Verb::WriteCycle, Some(object), Some(exponent), None, None) => {
                let (held, _) = self.value("object", object)?;
                let (power, _) = self.value("exponent", exponent)?;
                Some(StepKind::WriteCycle(held, power))
            }
            (Verb::ReadScaling, None, None, None, None) => Some(StepKind::ReadScaling),
            (Verb::ReadParameters, None, None, None, None) => Some(StepKind::ReadParameters),
            (Verb::ReadCaptures, None, None, None, None) => Some(StepKind::ReadCaptures),
            (Verb::WriteMode, None, None, None, None) => Some(StepKind::WriteMode),
            _ => {
                let message = "expected `write` with object and value or with parameter, `read` with object, \
                               `write_cycle` with object and exponent, or a step without any";
                self.resolver.error(code::CONTRADICTION, row.step.span(), "do", message);
                None
            }
        }
    }
}

#[derive(Clone, Copy)]
enum Verb {
    Write,
    Read,
    ReadScaling,
    ReadParameters,
    ReadCaptures,
    WriteCycle,
    WriteMode,
}

fn both(one: BitPattern, other: BitPattern) -> BitPattern {
    BitPattern::new(one.mask | other.mask, one.value | other.value)
}

/// Mask and value of the 16-bit codes from `first` to `last`, which differ in their low bits only; `None` for others.
fn span(first: i64, last: i64) -> Option<BitPattern> {
    let (first, last) = (u16::try_from(first).ok()?, u16::try_from(last).ok()?);
    let low = first ^ last;
    let aligned = low.wrapping_add(1).is_power_of_two() || low == 0;
    (aligned && first & low == 0).then(|| BitPattern::new(u32::from(!low), u32::from(first)))
}
