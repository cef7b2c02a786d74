//! Generic <-> SERCOS: from rows to the resolved mapping.

use std::collections::BTreeSet;

use profile_cip::device::exception::ExceptionAction;
use profile_generic::image::Signal;
use profile_generic::mode::{InterpolationSource, ModeSelection};
use profile_generic::program::{BitPattern, MAX_STATE_ROWS};
use profile_generic::quantity::Quantity;
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::svc::Element;

use super::{
    Elements, ModeRule, ParameterAt, Polarity, ProcedureRule, ReportRule, SercosTables, SignalRule, SlotRule,
    StatusRule, StepKind, StepRule,
};
use crate::cip_tables::{CipTables, ExceptionRow};
use crate::dictionary::{Dictionaries, IdnFormat, IdnPart, IdnUnit, SercosIdn, Word, quantity};
use crate::drive_program::{FaultRow, PROCEDURE_COMMANDS_MAX, STATUS_WORDS_MAX};
use crate::drive_rows::{
    FAILS, every_action, fixed_unit, mapped, mode_row, once, parameter_row, signal_row, written_parameter,
};
use crate::finding::registry as code;
use crate::finding::{Findings, Spanned};
use crate::format::{
    CommissionRow, DiagnosisRow, FieldIs, FieldValueRow, GenericSercosFile, LoadSignalRow, ModeSlotRow, Name,
    PolarityRow, ProcedureRow, ScalingMethodRow, SercosCaptureRow, SercosFaultRow, SercosModeRow,
    SercosParameterRow, SercosScalingRow, SercosSignalRow, UnboundRow, WordsRow,
};
use crate::generic_names::{
    action, capture_kind, cause_and_reaction, interpolation, operating_mode, report, status_bit, unit_kind,
};
use crate::load::Parsed;
use crate::resolver::{Resolver, over};
use crate::sercos::captures::{CaptureBy, CaptureRule};
use crate::sercos::scaling::{GearRule, Method, ModuloRule, Reference, ScalingRule, Term};

impl SercosTables {
    pub(crate) fn resolve(
        file: &Parsed<GenericSercosFile>,
        dictionaries: &Dictionaries,
        cip: &CipTables,
        errors: &mut Findings,
    ) -> Self {
        let rows = &file.rows;
        let mut builder = Builder {
            resolver: Resolver::new(&file.text, errors),
            dictionaries,
            exceptions: &cip.exceptions,
            bound: BTreeSet::new(),
            tables: Self::default(),
        };
        builder.resolver.head(&rows.format, "mapping", &rows.mapping, "generic to sercos");
        builder.units(rows);
        for row in &rows.scaling {
            builder.scaling(row);
        }
        builder.tables.direction = builder.polarity(&rows.direction.polarity);
        for row in &rows.signal {
            builder.signal(row);
        }
        for row in &rows.mode {
            builder.mode(row);
        }
        for row in &rows.procedure {
            builder.procedure(row);
        }
        builder.words(rows);
        for row in &rows.fault {
            builder.fault(row);
        }
        builder.diagnosis(&rows.diagnosis);
        for row in &rows.parameter {
            builder.parameter(row);
        }
        builder.supported_modes(rows);
        builder.captures(rows);
        for row in &rows.commission {
            builder.step(row);
        }
        // What is wrong with a row, or with the dictionary, need not be told twice.
        if !builder.resolver.has_errors() {
            builder.unbound(&rows.unbound);
        }
        builder.tables
    }
}

struct Builder<'a> {
    resolver: Resolver<'a>,
    dictionaries: &'a Dictionaries,
    exceptions: &'a [ExceptionRow],
    /// IDNs that a row names, by themselves or by their word.
    bound: BTreeSet<(Idn, &'a str)>,
    tables: SercosTables,
}

impl<'a> Builder<'a> {
    fn idn(&mut self, key: &str, name: &Name) -> Option<&'a SercosIdn> {
        let row = self.dictionaries.sercos.idn_or_error(key, name, &mut self.resolver)?;
        self.bound.insert((row.idn, self.resolver.path_of(name)));
        Some(row)
    }

    /// What no row binds has a reason, once.
    fn unbound(&mut self, rows: &[UnboundRow]) {
        let mut known = BTreeSet::new();
        for row in rows {
            self.resolver.reason(&row.reason);
            for name in &row.idns {
                let sercos = &self.dictionaries.sercos;
                let Some(idn) = sercos.idn_or_error("idns", name, &mut self.resolver) else { continue };
                let idn = idn.idn;
                // A row that is laid over the table wins over its list.
                if self.bound.contains(&(idn, self.resolver.path_of(name))) {
                    self.resolver.error(
                        code::CONTRADICTION,
                        name.span(),
                        "idns",
                        format!("a row binds {idn}"),
                    );
                }
                if !known.insert(idn) {
                    self.resolver.error(code::TWICE, name.span(), "idns", format!("{idn} is defined twice"));
                }
                if !self.bound.iter().any(|(bound, _)| *bound == idn) {
                    self.tables.unbound.push((idn, row.reason.get_ref().clone()));
                }
            }
        }
        let profile = self.dictionaries.sercos.idns().iter().filter(|row| row.part == IdnPart::Profile);
        let answered = |idn: Idn| known.contains(&idn) || self.bound.iter().any(|(bound, _)| *bound == idn);
        self.tables.unanswered = profile.map(|row| row.idn).filter(|idn| !answered(*idn)).collect();
    }

    /// The word with this name and the one IDN that holds it.
    fn word(&mut self, key: &str, name: &Name) -> Option<(Idn, &'a Word)> {
        let sercos = &self.dictionaries.sercos;
        let known = sercos.words().iter().map(|word| word.name.as_str());
        let find = |text: &str| sercos.word(text);
        let word = self.resolver.name(key, name, "a word of the dictionary", find, known)?;
        if let [idn] = word.idns.as_slice() {
            self.bound.insert((*idn, self.resolver.path_of(name)));
            return Some((*idn, word));
        }
        let message = format!("expected a word of one IDN, `{}` has {}", word.name, word.idns.len());
        self.resolver.error(code::OUT_OF_RANGE, name.span(), key, message);
        None
    }

    fn pattern(&mut self, word: &Word, rows: &[FieldValueRow]) -> Option<BitPattern> {
        self.resolver.pattern(rows, |text| Some((word.field(text)?, word.values(text))), word.field_names())
    }

    /// Mask and value that the dictionary has under a name for a whole word.
    fn named_value(&mut self, word: &Word, key: &str, name: &Name) -> Option<BitPattern> {
        let find = |text: &str| word.patterns.iter().find(|pattern| pattern.value.name == text);
        let names = word.patterns.iter().map(|pattern| pattern.value.name.as_str());
        let found = self.resolver.name(key, name, "a named value of the control word", find, names)?;
        let (low, high) = found.bits;
        let mask = (low..=high).fold(0, |mask, bit| mask | 1 << bit);
        Some(BitPattern::new(mask, found.value.value << low))
    }

    fn units(&mut self, rows: &GenericSercosFile) {
        for row in &rows.unit {
            self.tables.units.extend(fixed_unit(&mut self.resolver, row));
        }
    }

    fn scaling(&mut self, row: &SercosScalingRow) {
        let word = self.idn("word", &row.word);
        let gear = match &row.load {
            None => None,
            Some(load) => {
                let [mask, value] = load.pattern;
                let [motor, turns] = &load.gear;
                let gear = (self.idn("gear", motor), self.idn("gear", turns));
                let (Some(motor), Some(turns)) = gear else { return };
                let generic = load
                    .generic
                    .as_ref()
                    .and_then(|name| self.resolver.word("generic", name, Reference::NAMED));
                Some(GearRule {
                    pattern: BitPattern::new(mask, value),
                    motor: motor.idn,
                    load: turns.idn,
                    generic,
                })
            }
        };
        let feed = match &row.feed {
            None => None,
            Some(name) => {
                let Some(feed) = self.idn("feed", name) else { return };
                if !self.measures(feed, Quantity::None) {
                    let message =
                        format!("expected an IDN with a fixed unit of [[unit]], {} has none", feed.idn);
                    self.resolver.error(code::UNIT, name.span(), "feed", message);
                }
                Some(feed.idn)
            }
        };
        let modulo = match &row.modulo {
            None => None,
            Some(modulo) => {
                let [mask, value] = modulo.pattern;
                let Some(range) = self.idn("range", &modulo.range) else { return };
                let divider = modulo.divider.as_ref().and_then(|name| self.idn("divider", name));
                Some(ModuloRule {
                    pattern: BitPattern::new(mask, value),
                    range: range.idn,
                    divider: divider.map(|row| row.idn),
                })
            }
        };
        let methods: Vec<Method> = row.methods.iter().filter_map(|method| self.method(method)).collect();
        if let Some(word) = word {
            let scaling = row.scaling.get_ref().clone();
            let word = word.idn;
            let rule = ScalingRule { scaling, word, gear, feed, exact: row.exact, modulo, methods };
            self.tables.scalings.push(rule);
        }
    }

    fn method(&mut self, row: &ScalingMethodRow) -> Option<Method> {
        let kind = match &row.kind {
            Some(name) => Some(unit_kind(&mut self.resolver, name)?),
            None => None,
        };
        let quantity = quantity(&mut self.resolver, &row.quantity)?;
        let base = self.resolver.ratio("base", &row.base)?;
        let factor = self.term("factor_idn", None, row.factor_idn.as_ref(), 1)?;
        let exponent = row.exponent.map(i64::from);
        let exponent = self.term("exponent_idn", exponent, row.exponent_idn.as_ref(), 0)?;
        let divisor = self.term("divisor_idn", row.divisor, row.divisor_idn.as_ref(), 1)?;
        let mut expect = Vec::with_capacity(row.expect.len());
        for (name, value) in &row.expect {
            expect.push((self.idn("expect", name)?.idn, *value));
        }
        let [mask, value] = row.pattern;
        Some(Method {
            pattern: BitPattern::new(mask, value),
            kind,
            quantity,
            base,
            factor,
            exponent,
            divisor,
            zero: row.zero.unwrap_or(0),
            expect,
        })
    }

    fn term(&mut self, key: &str, fixed: Option<i64>, idn: Option<&Name>, otherwise: i64) -> Option<Term> {
        match (fixed, idn) {
            (None, None) => Some(Term::Fixed(otherwise)),
            (Some(value), None) => Some(Term::Fixed(value)),
            (None, Some(name)) => self.idn(key, name).map(|row| Term::Drive(row.idn)),
            (Some(_), Some(name)) => {
                self.resolver.error(
                    code::CONTRADICTION,
                    name.span(),
                    key,
                    "expected a number or an IDN, got both",
                );
                None
            }
        }
    }

    fn polarity(&mut self, row: &PolarityRow) -> Option<Polarity> {
        let idn = self.idn("polarity", &row.idn)?.idn;
        let bit = *row.bit.get_ref();
        if bit > 15 {
            self.resolver.error(
                code::OUT_OF_RANGE,
                row.bit.span(),
                "bit",
                format!("expected a bit from 0 to 15, got {bit}"),
            );
        }
        Some(Polarity { idn, bit })
    }

    fn signal(&mut self, row: &SercosSignalRow) {
        let head = signal_row(&mut self.resolver, &row.signal, &row.direction, &row.missing);
        let idn = self.idn("idn", &row.idn);
        let (Some((signal, _, refuse)), Some(idn)) = (head, idn) else { return };
        if idn.length.is_none() || idn.list {
            let message = format!("expected an IDN of known length, {} has none in the dictionary", idn.idn);
            return self.resolver.error(code::NO_LENGTH, row.idn.span(), "idn", message);
        }
        if !self.measures(idn, signal.quantity()) {
            let message = format!("the unit of {} is not a unit of {}", idn.idn, signal.quantity());
            return self.resolver.error(code::UNIT, row.idn.span(), "idn", message);
        }
        once(&mut self.resolver, self.tables.signal(signal).is_some(), "signal", &row.signal);
        let polarity = row.polarity.as_ref().and_then(|row| self.polarity(row));
        let load = row.load.as_ref().and_then(|row| self.load_signal(signal, row));
        self.tables.signals.push(SignalRule { signal, idn: idn.idn, refuse, polarity, load });
    }

    fn load_signal(&mut self, signal: Signal, row: &LoadSignalRow) -> Option<(Idn, Option<Polarity>)> {
        let idn = self.idn("load", &row.idn)?;
        if !self.measures(idn, signal.quantity()) {
            let message = format!("the unit of {} is not a unit of {}", idn.idn, signal.quantity());
            self.resolver.error(code::UNIT, row.idn.span(), "load", message);
        }
        Some((idn.idn, row.polarity.as_ref().and_then(|row| self.polarity(row))))
    }

    /// Whether the unit of an IDN can become the quantity.
    fn measures(&self, idn: &SercosIdn, quantity: Quantity) -> bool {
        match &idn.unit {
            IdnUnit::None => quantity == Quantity::None,
            IdnUnit::Fixed { unit, .. } => {
                self.tables.units.iter().any(|known| known.unit == *unit && known.quantity == quantity)
            }
            IdnUnit::Scaled(scaling) => self.tables.scalings.iter().any(|rule| {
                let converts =
                    |of| of == quantity || of == Quantity::TorqueAbsolute && quantity == Quantity::Torque;
                rule.scaling == *scaling && rule.methods.iter().any(|method| converts(method.quantity))
            }),
        }
    }

    fn mode_codes(&mut self, key: &'static str, names: &[Name]) -> Vec<u16> {
        let mut codes = Vec::with_capacity(names.len());
        for name in names {
            let code =
                self.dictionaries.sercos.code_or_error("Operation mode", key, name, &mut self.resolver);
            codes.extend(code.and_then(|code| u16::try_from(code).ok()));
        }
        codes
    }

    fn mode(&mut self, row: &SercosModeRow) {
        let head = mode_row(&mut self.resolver, &row.mode, row.interpolation.as_ref(), &row.missing);
        let codes = self.mode_codes("codes", &row.codes);
        let load_codes = self.mode_codes("load_codes", &row.load_codes);
        if codes.is_empty() {
            self.resolver.error(
                code::MISSING_KEY,
                row.mode.span(),
                "codes",
                "expected at least one operation mode",
            );
        }
        let has = |signal| self.tables.signal(signal).is_some();
        let command = mapped(&mut self.resolver, "command", &row.command, has);
        let actual = mapped(&mut self.resolver, "actual", &row.actual, has);
        if let Some((selection, optional)) = head {
            let known = self.tables.modes.iter().any(|known| known.selection == selection);
            once(&mut self.resolver, known, "mode", &row.mode);
            self.tables.modes.push(ModeRule { selection, optional, codes, load_codes, command, actual });
        }
    }

    fn procedure(&mut self, row: &ProcedureRow) {
        let mode = operating_mode(&mut self.resolver, &row.mode);
        let interpolation = interpolation(&mut self.resolver, &row.interpolation);
        let led_in = match &row.led_in {
            None => None,
            Some(name) => {
                let Some(led_in) = operating_mode(&mut self.resolver, name) else { return };
                let led_in = ModeSelection::from(led_in);
                if !self.tables.modes.iter().any(|known| known.selection == led_in) {
                    let message = format!("expected a mode with a [[mode]] row, {led_in} has none");
                    self.resolver.error(code::ROW_MISSING, name.span(), "led_in", message);
                }
                Some(led_in)
            }
        };
        let mut commands = Vec::with_capacity(row.commands.len());
        for name in &row.commands {
            let Some(idn) = self.idn("commands", name) else { continue };
            if !idn.command {
                let message = format!("expected a procedure command, {} is not one", idn.idn);
                self.resolver.error(code::NOT_A_COMMAND, name.span(), "commands", message);
            }
            commands.push(idn.idn);
        }
        if commands.is_empty() || commands.len() > PROCEDURE_COMMANDS_MAX {
            let message =
                format!("expected 1 to {PROCEDURE_COMMANDS_MAX} procedure commands, got {}", commands.len());
            self.resolver.error(code::TOO_MANY, row.mode.span(), "commands", message);
        }
        let (Some(mode), Some(interpolation)) = (mode, interpolation) else { return };
        let selection = ModeSelection { mode, interpolation };
        if led_in.is_some() != (interpolation == InterpolationSource::Controller) {
            let message = "expected `led_in` where the controller makes the way, and nowhere else";
            self.resolver.error(code::CONTRADICTION, row.interpolation.span(), "led_in", message);
        }
        let modes = self.tables.modes.iter().map(|known| known.selection);
        let known = modes
            .chain(self.tables.procedures.iter().map(|known| known.selection))
            .any(|one| one == selection);
        once(&mut self.resolver, known, "mode", &row.mode);
        self.tables.procedures.push(ProcedureRule { selection, led_in, commands });
    }

    /// Control and status word, and the rows that set and read their fields.
    fn words(&mut self, rows: &GenericSercosFile) {
        let control = self.idn("control", &rows.words.control).map(|row| row.idn);
        let status = self.idn("status", &rows.words.status).map(|row| row.idn);
        let (Some(control), Some(status)) = (control, status) else { return };
        self.tables.control = control;
        self.tables.status_word = status;
        let sercos = &self.dictionaries.sercos;
        let (Some(control), Some(status)) = (sercos.word_of(control), sercos.word_of(status)) else {
            let message = "expected IDNs whose words the dictionary describes";
            return self.resolver.error(code::ROW_MISSING, rows.words.control.span(), "control", message);
        };
        for row in &rows.mode_slot {
            self.mode_slot(&rows.words, row, (control, status));
        }
        self.actions(rows, control);
        self.reports(rows, status);
        self.status(rows);
    }

    fn mode_slot(&mut self, words: &WordsRow, row: &ModeSlotRow, (control, status): (&Word, &Word)) {
        let is = || Spanned::new(row.slot.span(), FieldIs::Number(*row.slot.get_ref()));
        let value = |field: &Name| [FieldValueRow { field: field.clone(), is: is() }];
        let control = self.pattern(control, &value(&words.mode_control));
        let status = self.pattern(status, &value(&words.mode_status));
        let idn = self.idn("idn", &row.idn);
        if let (Some(control), Some(status), Some(idn)) = (control, status, idn) {
            self.tables.slots.push(SlotRule { control, status, idn: idn.idn });
        }
    }

    fn actions(&mut self, rows: &GenericSercosFile, control: &Word) {
        for row in &rows.action {
            let action = action(&mut self.resolver, &row.action);
            let sent = match &row.send {
                None => Some(BitPattern::new(0, 0)),
                Some(name) => self.named_value(control, "send", name),
            };
            let pattern = self.pattern(control, &row.pattern);
            let pattern = sent.zip(pattern).map(|(sent, pattern)| over(pattern, sent));
            let command = row.command.as_ref().and_then(|name| self.procedure_command("command", name));
            if let (Some(action), Some(pattern)) = (action, pattern) {
                self.tables.actions.push((action, pattern));
                self.tables.commands.extend(command.map(|idn| (action, idn)));
            }
        }
        let actions = &self.tables.actions;
        let has = |action| actions.iter().any(|(known, _)| *known == action);
        every_action(&mut self.resolver, &rows.mapping, has, |action| {
            format!("expected a row for action {action}, got none")
        });
    }

    /// The IDN of a procedure command; `None` with an error if it is another one.
    fn procedure_command(&mut self, key: &str, name: &Name) -> Option<Idn> {
        let idn = self.idn(key, name)?;
        if !idn.command {
            let message = format!("expected a procedure command, {} is not one", idn.idn);
            self.resolver.error(code::NOT_A_COMMAND, name.span(), key, message);
            return None;
        }
        Some(idn.idn)
    }

    fn reports(&mut self, rows: &GenericSercosFile, status: &Word) {
        for row in &rows.report {
            let report = report(&mut self.resolver, &row.report);
            if let (Some(pattern), Some(report)) = (self.pattern(status, &row.pattern), report) {
                let (acknowledges, procedure) = (row.acknowledges, row.procedure);
                self.tables.reports.push(ReportRule { pattern, report, acknowledges, procedure });
            }
        }
        if self.tables.reports.len() > MAX_STATE_ROWS {
            let message =
                format!("expected at most {MAX_STATE_ROWS} rows, got {}", self.tables.reports.len());
            self.resolver.error(code::TOO_MANY, rows.mapping.span(), "report", message);
        }
    }

    /// Status bits, each from a word of its own choice.
    fn status(&mut self, rows: &GenericSercosFile) {
        for row in &rows.status {
            let bit = status_bit(&mut self.resolver, &row.status);
            let Some((idn, word)) = self.word("word", &row.word) else { continue };
            if let (Some(pattern), Some(bit)) = (self.pattern(word, &row.pattern), bit) {
                let acknowledges = row.acknowledges;
                self.tables.status.push(StatusRule { word: idn, pattern, bit, acknowledges });
            }
        }
        let words = self.tables.status_words().len();
        if words > STATUS_WORDS_MAX {
            let message =
                format!("expected at most {STATUS_WORDS_MAX} words beside the status word, got {words}");
            self.resolver.error(code::TOO_MANY, rows.mapping.span(), "status", message);
        }
    }

    fn fault(&mut self, row: &SercosFaultRow) {
        let named = cause_and_reaction(&mut self.resolver, &row.cause, row.reaction.as_ref());
        let Some((idn, word)) = self.word("word", &row.word) else { return };
        let pattern = self.pattern(word, &row.pattern);
        if let (Some((cause, reaction)), Some(pattern)) = (named, pattern) {
            let severe =
                |known: &&ExceptionRow| known.cause == cause && known.default > ExceptionAction::ALARM.0;
            if !reaction.stops() && self.exceptions.iter().any(|row| severe(&row)) {
                let message =
                    "the drive only warns: expected a cause whose exception has default = \"Alarm\"";
                self.resolver.error(code::WARNING_STOPS, row.cause.span(), "cause", message);
            }
            self.tables.faults.push(FaultRow { word: idn.into(), pattern, cause, reaction });
        }
    }

    fn diagnosis(&mut self, row: &DiagnosisRow) {
        let text = self.idn("text", &row.text);
        if let Some(idn) = text.filter(|idn| !idn.list || idn.format != Some(IdnFormat::Text)) {
            let message = format!("expected a text, {} is not one", idn.idn);
            self.resolver.error(code::OUT_OF_RANGE, row.text.span(), "text", message);
        }
        let number = self.idn("number", &row.number);
        if let Some(idn) = number.filter(|idn| idn.list || idn.format == Some(IdnFormat::Text)) {
            let message = format!("expected a number, {} is a list", idn.idn);
            self.resolver.error(code::OUT_OF_RANGE, row.number.span(), "number", message);
        }
        self.tables.diagnosis = number.zip(text).map(|(number, text)| [number.idn, text.idn]);
    }

    fn supported_modes(&mut self, rows: &GenericSercosFile) {
        let name = &rows.supported_modes.list;
        let Some(row) = self.idn("list", name) else { return };
        let (idn, list) = (row.idn, row.list);
        if !list {
            let message = format!("expected a list, {idn} is not one");
            self.resolver.error(code::OUT_OF_RANGE, name.span(), "list", message);
        }
        self.tables.supported_modes = idn;
    }

    fn captures(&mut self, rows: &GenericSercosFile) {
        let lists = [&rows.configurable_data.producer, &rows.configurable_data.consumer];
        let lists = lists.map(|name| self.idn("configurable_data", name).map(|row| row.idn));
        if let [Some(producer), Some(consumer)] = lists {
            self.tables.configurable = [producer, consumer];
        }
        for row in &rows.capture {
            let Some(rule) = self.capture(row) else { continue };
            let known = self.tables.captures.iter().any(|known| known.kind == rule.kind);
            once(&mut self.resolver, known, "capture", &row.capture);
            self.tables.captures.push(rule);
        }
    }

    fn capture(&mut self, row: &SercosCaptureRow) -> Option<CaptureRule> {
        let kind = capture_kind(&mut self.resolver, &row.capture, &row.edge)?;
        let words = [("latch", 0), ("counter", 1), ("input", 2), ("sequence", 3)];
        let by = self.resolver.word("by", &row.by, &words)?;
        let idns = [
            ("value", &row.value, by <= 1),
            ("counter", &row.counter, by == 1),
            ("enable", &row.enable, by == 0),
            ("command", &row.command, false),
        ];
        let mut found = [None; 4];
        for ((key, name, needed), found) in idns.into_iter().zip(&mut found) {
            match name {
                Some(name) => *found = Some(self.idn(key, name)?),
                None if needed => {
                    let message = format!("expected an IDN, got none for {}", row.by.get_ref());
                    self.resolver.error(code::MISSING_KEY, row.by.span(), key, message);
                    return None;
                }
                None => {}
            }
        }
        let [value, counter, enable, command] = found;
        if let (Some(value), Some(name)) = (value, &row.value)
            && value.is_known()
            && !self.measures(value, Quantity::Position)
        {
            let message = format!("the unit of {} is not a unit of {}", value.idn, Quantity::Position);
            self.resolver.error(code::UNIT, name.span(), "value", message);
        }
        if let (Some(command), Some(name)) = (command.filter(|command| !command.command), &row.command) {
            let message = format!("expected a procedure command, {} is not one", command.idn);
            self.resolver.error(code::NOT_A_COMMAND, name.span(), "command", message);
        }
        let word = match (&row.word, by) {
            (Some(name), 0 | 2) => {
                let (idn, word) = self.word("word", name)?;
                Some((idn, self.pattern(word, &row.pattern)?))
            }
            (None, 1 | 3) => None,
            _ => {
                let message = "expected a word for a latch or an input, and for nothing else";
                self.resolver.error(code::CONTRADICTION, row.by.span(), "word", message);
                return None;
            }
        };
        let is_sequence = crate::sercos::captures::sequence(kind).is_some();
        let by = match (by, value, word, counter, enable) {
            (0, Some(value), Some((word, pattern)), None, Some(enable)) => CaptureBy::Latch {
                value: value.idn,
                word,
                pattern,
                enable: enable.idn,
                command: command.map(|command| command.idn),
            },
            (1, Some(value), None, Some(counter), None) => {
                CaptureBy::Counter { value: value.idn, counter: counter.idn }
            }
            (2, None, Some((word, pattern)), None, None) => CaptureBy::Input { word, pattern },
            (3, None, None, None, None) if is_sequence => CaptureBy::Sequence,
            _ => {
                let message = format!("{} does not go with these keys", row.by.get_ref());
                self.resolver.error(code::CONTRADICTION, row.by.span(), "by", message);
                return None;
            }
        };
        Some(CaptureRule { kind, by })
    }

    fn parameter(&mut self, row: &SercosParameterRow) {
        let generic = &self.dictionaries.generic;
        let words = (&row.direction, row.missing.as_ref(), row.factor.as_ref());
        let rule = parameter_row(&mut self.resolver, generic, &row.parameter, words);
        let idn = self.idn("idn", &row.idn);
        let (Some(rule), Some(idn)) = (rule, idn) else { return };
        let quantity = rule.quantity;
        let is_wrong = match (row.unit_by_drive, &idn.unit) {
            // Of a unit that differs from drive to drive the dictionary has one of them.
            (true, IdnUnit::None | IdnUnit::Fixed { .. }) => quantity == Quantity::None,
            (true, IdnUnit::Scaled(_)) => true,
            (false, unit) => *unit == IdnUnit::None && quantity != Quantity::None,
        };
        if is_wrong {
            let message = "expected `unit_by_drive` for an IDN whose unit the dictionary does not know, and for none with a scaling";
            let help = match row.unit_by_drive {
                true => "remove `unit_by_drive`",
                false => "add `unit_by_drive = true`, or the `unit` of the IDN to its row in the dictionary",
            };
            self.resolver.helped(code::UNIT, row.idn.span(), "unit_by_drive", message, help);
        } else if !row.unit_by_drive && !self.measures(idn, quantity) {
            let message = format!("the unit of {} is not a unit of {quantity}", idn.idn);
            return self.resolver.error(code::UNIT, row.idn.span(), "idn", message);
        }
        if rule.to_drive && idn.write.as_ref().is_some_and(Vec::is_empty) {
            let message = format!("{} is read only", idn.idn);
            self.resolver.error(code::READ_ONLY, row.direction.span(), "direction", message);
        }
        let known = self.tables.parameters.iter().any(|known| known.parameter == rule.parameter);
        once(&mut self.resolver, known, "parameter", &row.parameter);
        let acts_in = row.acts_in.as_ref().and_then(|name| {
            let sercos = &self.dictionaries.sercos;
            let code = sercos.code_or_error("Operation mode", "acts_in", name, &mut self.resolver)?;
            u16::try_from(code).ok()
        });
        let at = ParameterAt { idn: idn.idn, unit_by_drive: row.unit_by_drive, acts_in };
        self.tables.parameters.push(rule.at(at));
    }

    fn step(&mut self, row: &CommissionRow) {
        let phase = *row.phase.get_ref();
        if !(2..=4).contains(&phase) {
            let message = format!("expected a phase from 2 to 4, got {phase}");
            self.resolver.error(code::OUT_OF_RANGE, row.phase.span(), "phase", message);
        }
        let words = [
            ("write", Verb::Write),
            ("read", Verb::Read),
            ("command", Verb::Command),
            ("read_scaling", Verb::ReadScaling),
            ("read_telegram", Verb::ReadTelegram),
            ("read_parameters", Verb::ReadParameters),
            ("read_captures", Verb::ReadCaptures),
            ("read_procedures", Verb::ReadProcedures),
            ("write_modes", Verb::WriteModes),
        ];
        let Some(verb) = self.resolver.word("do", &row.step, &words) else { return };
        let fail = self.resolver.word("refused", &row.refused, &FAILS);
        let Some(kind) = self.step_kind(row, verb, phase) else { return };
        let mut rule = StepRule {
            phase,
            kind,
            axis: None,
            modulo: None,
            set_scaling: None,
            mode: None,
            captures: None,
            fail: fail.unwrap_or(true),
        };
        if let Some(when) = &row.when {
            rule.axis = when.kind.as_ref().and_then(|name| unit_kind(&mut self.resolver, name));
            rule.mode = when.mode.as_ref().and_then(|name| operating_mode(&mut self.resolver, name));
            rule.modulo = when.modulo;
            rule.set_scaling = when.set_scaling;
            rule.captures = when.captures;
        }
        self.tables.steps.push(rule);
    }

    fn step_kind(&mut self, row: &CommissionRow, verb: Verb, phase: u8) -> Option<StepKind> {
        let idn = match &row.idn {
            Some(name) => Some(self.idn("idn", name)?),
            None => None,
        };
        match (verb, idn, &row.value, &row.parameter) {
            (Verb::Write, Some(idn), Some(value), None) => {
                if idn.write.as_ref().is_some_and(|phases| !phases.contains(&phase)) {
                    let message = format!("{} cannot be written in CP{phase}", idn.idn);
                    self.resolver.error(code::PHASE, row.phase.span(), "phase", message);
                }
                if idn.length.is_none() || idn.list {
                    let message = format!("expected an IDN of known length, {} has none", idn.idn);
                    self.resolver.error(code::NO_LENGTH, value.span(), "value", message);
                }
                Some(StepKind::WriteValue(idn.idn, *value.get_ref()))
            }
            (Verb::Write, None, None, Some(name)) => {
                let generic = &self.dictionaries.generic;
                written_parameter(&mut self.resolver, generic, &self.tables.parameters, name)
                    .map(StepKind::WriteParameter)
            }
            (Verb::Read, Some(idn), None, None) => {
                let words = [
                    ("attribute", Element::Attribute),
                    ("unit", Element::Unit),
                    ("minimum", Element::Minimum),
                    ("maximum", Element::Maximum),
                    ("data", Element::Data),
                ];
                let mut elements = Elements::new();
                for (name, element) in words {
                    let wanted = |rows: &Vec<Name>| rows.iter().any(|row| row.get_ref() == name);
                    if row.elements.as_ref().is_none_or(wanted) {
                        elements.push(element);
                    }
                }
                for name in row.elements.iter().flatten() {
                    self.resolver.word("elements", name, &words)?;
                }
                Some(StepKind::Read { idn: idn.idn, elements })
            }
            (Verb::Command, Some(idn), None, None) if idn.command => Some(StepKind::Command(idn.idn)),
            (Verb::ReadScaling, None, None, None) => Some(StepKind::ReadScaling),
            (Verb::ReadTelegram, None, None, None) => Some(StepKind::ReadTelegram),
            (Verb::ReadParameters, None, None, None) => Some(StepKind::ReadParameters),
            (Verb::ReadCaptures, None, None, None) => Some(StepKind::ReadCaptures),
            (Verb::ReadProcedures, None, None, None) => Some(StepKind::ReadProcedures),
            (Verb::WriteModes, None, None, None) => Some(StepKind::WriteModes),
            _ => {
                let message = "expected `write` with idn and value or with parameter, `read` with idn, \
                               `command` with the idn of a procedure command, or a step without any";
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
    Command,
    ReadScaling,
    ReadTelegram,
    ReadParameters,
    ReadCaptures,
    ReadProcedures,
    WriteModes,
}
