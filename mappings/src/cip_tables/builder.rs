//! CIP Motion <-> generic: from rows to the resolved mapping.

use profile_cip::device::exception::ExceptionAction;
use profile_generic::capture::CaptureStatus;
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{Signal, StatusBits};
use profile_generic::inhibit::Inhibits;
use profile_generic::parameter::{Access as Write, Parameter, ParameterType};
use profile_generic::quantity::Quantity;
use profile_generic::sequence::{StopMethod, StopPlan};
use profile_generic::state::{DriveState, Request};

use super::{
    CipTables, CipUnit, CyclicElement, DisplacementUnit, ExceptionRow, Finder, MISSING, Missing,
    ScalingAttributes, SequenceAttributes, Served, ServedAttribute, Times, has_direction,
};
use crate::cip_events::{EventRule, EventTrigger};
use crate::compile_cip::{
    CipConditions, CipFault, CipRequest, CipState, CipStopping, InhibitRule, IoStatusRule, MAX_FAULTS,
    MAX_INHIBITS, MAX_IO_STATUS_RULES, MAX_REQUESTS, MAX_STATUS_RULES, MAX_STOPPINGS, MissingValue,
    StatusRule,
};
use crate::device_link::DRIVE_ACTIONS;
use crate::dictionary::{Access, CipAttribute, Dictionaries, GenericParameter, quantity};
use crate::feedback::FeedbackUse;
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{
    CipAttributeRow, CipEventRow, CipFaultRow, CipGenericFile, CyclicRow, DisplacementUnitRow, Name,
    RejectRow, UnraisedRow,
};
use crate::generic_names::{capture_kind, cause, operating_mode, reaction, signal, status_bit, unit_kind};
use crate::load::Parsed;
use crate::mechanics::MechanicalFact;
use crate::resolver::Resolver;

impl CipTables {
    pub(crate) fn resolve(
        file: &Parsed<CipGenericFile>,
        dictionaries: &Dictionaries,
        errors: &mut Findings,
    ) -> Self {
        let mut builder =
            Builder { resolver: Resolver::new(&file.text, errors), dictionaries, tables: Self::default() };
        let rows = &file.rows;
        builder.resolver.head(&rows.format, "mapping", &rows.mapping, "cip-motion to generic");
        builder.units(rows);
        builder.scaling(rows);
        for row in &rows.displacement_unit {
            builder.displacement_unit(row);
        }
        for row in &rows.cyclic {
            builder.cyclic(row);
        }
        builder.modes(rows);
        builder.feedback_modes(rows);
        builder.requests(rows);
        builder.drive_actions(rows);
        builder.states(rows);
        builder.status(rows);
        for row in &rows.fault {
            builder.fault(row);
        }
        builder.io_status(rows);
        builder.reactions(rows);
        builder.inhibits(rows);
        builder.stoppings(rows);
        builder.sequence(rows);
        builder.mechanics(rows);
        builder.events(rows);
        for row in &rows.attribute {
            builder.attribute(row);
        }
        for row in &rows.reject {
            builder.reject(row);
        }
        for row in &rows.unraised {
            builder.unraised(row);
        }
        builder.finish(file)
    }
}

struct Builder<'a> {
    resolver: Resolver<'a>,
    dictionaries: &'a Dictionaries,
    tables: CipTables,
}

impl Builder<'_> {
    fn units(&mut self, rows: &CipGenericFile) {
        for row in &rows.unit {
            let Some(quantity) = quantity(&mut self.resolver, &row.quantity) else { continue };
            let Some(ratio) = self.resolver.ratio("generic_per_unit", &row.generic_per_unit) else {
                continue;
            };
            let times = match &row.times {
                None => Times::One,
                Some(name) => match self.resolver.word("times", name, &Times::NAMED) {
                    Some(times) => times,
                    None => continue,
                },
            };
            self.tables.units.push((
                row.unit.get_ref().clone(),
                quantity,
                CipUnit { ratio, times, reciprocal: row.reciprocal },
            ));
        }
    }

    fn attribute_id(&mut self, key: &str, name: &Name) -> u16 {
        let found = self.dictionaries.cip.attribute_or_error(key, name, &mut self.resolver);
        found.map(|attribute| attribute.id).unwrap_or_default()
    }

    fn code(&mut self, set: &str, key: &str, name: &Name) -> Option<u32> {
        self.dictionaries.cip.code_or_error(set, key, name, &mut self.resolver)
    }

    /// A code that fits a byte.
    fn byte_code(&mut self, set: &str, key: &str, name: &Name) -> Option<u8> {
        let code = self.code(set, key, name)?;
        let byte = u8::try_from(code).ok();
        if byte.is_none() {
            self.resolver.error(
                code::OUT_OF_RANGE,
                name.span(),
                key,
                format!("expected a code of one byte, got {code}"),
            );
        }
        byte
    }

    fn bit(&mut self, set: &str, key: &str, name: &Name) -> Option<u8> {
        let bit = self.dictionaries.cip.bit_or_error(set, key, name, &mut self.resolver)?;
        u8::try_from(bit).ok()
    }

    fn scaling(&mut self, rows: &CipGenericFile) {
        let row = &rows.scaling;
        let configuration = self.attribute_id("configuration", &row.configuration);
        let drive_scaling = self.code(row.configuration.get_ref(), "drive_scaling", &row.drive_scaling);
        let inverted = self.code(row.polarity.get_ref(), "inverted", &row.inverted);
        let mut feedback_resolution = Vec::new();
        for name in &row.feedback_resolution {
            feedback_resolution.push(self.attribute_id("feedback_resolution", name));
        }
        self.tables.scaling = ScalingAttributes {
            configuration,
            drive_scaling: drive_scaling.unwrap_or_default(),
            unit: self.attribute_id("unit", &row.unit),
            resolution: vec![self.attribute_id("resolution", &row.resolution)],
            polarity: self.attribute_id("polarity", &row.polarity),
            inverted: inverted.unwrap_or_default(),
            unwind: self.attribute_id("unwind", &row.unwind),
            unwind_position: self.attribute_id("unwind_position", &row.unwind_position),
            feedback_unit: self.attribute_id("feedback_unit", &row.feedback_unit),
            feedback_resolution,
        };
    }

    fn displacement_unit(&mut self, row: &DisplacementUnitRow) {
        let set = row.enumeration.get_ref().as_str();
        let is_motion = match set {
            "Motion Unit" => true,
            "Feedback Unit" => false,
            other => {
                let message = format!("expected `Motion Unit` or `Feedback Unit`, got `{other}`");
                return self.resolver.error(
                    code::UNKNOWN_WORD,
                    row.enumeration.span(),
                    "enumeration",
                    message,
                );
            }
        };
        let code = self.code(set, "code", &row.code);
        let kind = unit_kind(&mut self.resolver, &row.kind);
        let nanounits = *row.nanounits.get_ref();
        if nanounits <= 0 {
            self.resolver.error(
                code::OUT_OF_RANGE,
                row.nanounits.span(),
                "nanounits",
                "expected a number above 0",
            );
        }
        let (Some(code), Some(kind)) = (code, kind) else { return };
        let unit = DisplacementUnit { name: row.code.get_ref().clone(), code, kind, nanounits };
        let units = if is_motion { &mut self.tables.motion_units } else { &mut self.tables.feedback_units };
        units.push(unit);
    }

    fn cyclic(&mut self, row: &CyclicRow) {
        let names = self.dictionaries.cip.data_set_names();
        let elements = self.resolver.name(
            "set",
            &row.set,
            "a data set of the cyclic data block",
            |text| self.dictionaries.cip.data_set(text),
            names,
        );
        let Some(elements) = elements else { return };
        let element = self.resolver.name(
            "element",
            &row.element,
            &format!("an element of {}", row.set.get_ref()),
            |text| elements.iter().find(|element| element.name == text),
            elements.iter().map(|element| element.name.as_str()),
        );
        let signal = signal(&mut self.resolver, "signal", &row.signal);
        let to_generic =
            self.resolver.word("direction", &row.direction, &[("to_generic", true), ("from_generic", false)]);
        let missing = [("absent", MissingValue::Absent), ("zero", MissingValue::Zero)];
        let missing = self.resolver.word("missing", &row.missing, &missing);
        let (Some(element), Some(signal), Some(to_generic), Some(missing)) =
            (element, signal, to_generic, missing)
        else {
            return;
        };
        if signal.is_command() != to_generic {
            let message = format!("{signal} cannot go {}", row.direction.get_ref());
            return self.resolver.error(code::DIRECTION, row.direction.span(), "direction", message);
        }
        let carried = element.attributes.first().and_then(|id| self.dictionaries.cip.attribute_by_id(*id));
        let Some(attribute) = carried else {
            let message = format!("element {} carries no attribute", element.name);
            return self.resolver.error(code::ROW_MISSING, row.element.span(), "element", message);
        };
        let Some(unit) = self.tables.unit(&attribute.unit, signal.quantity()) else {
            let message = no_unit(attribute, signal.quantity());
            return self.resolver.error(code::UNIT, row.element.span(), "element", message);
        };
        self.tables.cyclic.push(CyclicElement {
            bit: element.bit,
            signal,
            to_generic,
            unit,
            turns: has_direction(signal.quantity()),
            wraps: row.wraps,
            data_type: attribute.data_type,
            missing,
        });
    }

    fn modes(&mut self, rows: &CipGenericFile) {
        for row in &rows.mode {
            let code = self.byte_code("Control Mode", "control_mode", &row.control_mode);
            let mode = operating_mode(&mut self.resolver, &row.mode);
            if let (Some(code), Some(mode)) = (code, mode)
                && let Some(slot) = self.tables.modes.get_mut(usize::from(code))
            {
                *slot = Some(mode);
            }
        }
    }

    fn feedback_modes(&mut self, rows: &CipGenericFile) {
        for row in &rows.feedback_mode {
            let code = self.byte_code("Feedback Mode", "feedback_mode", &row.feedback_mode);
            let known = FeedbackUse::ALL.iter().enumerate().map(|(at, of)| (of.name(), at));
            let find = |name: &str| known.clone().find(|(known, _)| *known == name).map(|(_, at)| at);
            let names = known.clone().map(|(name, _)| name);
            let at = self.resolver.name("feedback", &row.feedback, "a use of the encoders", find, names);
            if let (Some(code), Some(slot)) = (code, at.and_then(|at| self.tables.feedback_modes.get_mut(at)))
            {
                *slot = Some(code);
            }
        }
    }

    fn requests(&mut self, rows: &CipGenericFile) {
        for row in &rows.request {
            let axis_control = self.byte_code("Axis Control", "axis_control", &row.axis_control);
            let axis_response = self.byte_code("Axis Response", "axis_response", &row.axis_response);
            let request = match &row.request {
                None => None,
                Some(name) => match self.request(name) {
                    Some(request) => Some(request),
                    None => continue,
                },
            };
            if let (Some(axis_control), Some(axis_response)) = (axis_control, axis_response) {
                self.tables.requests.push(CipRequest { axis_control, request, axis_response });
            }
        }
    }

    fn states(&mut self, rows: &CipGenericFile) {
        let mut seen = [false; DriveState::ALL.len()];
        for row in &rows.state {
            let known = DriveState::ALL.iter().map(|state| state.name());
            let find = |text: &str| DriveState::ALL.iter().position(|state| state.name() == text);
            let at = self.resolver.name("state", &row.state, "a drive state", find, known);
            let axis_state = self.byte_code("Axis State", "axis_state", &row.axis_state);
            let mut conditions = CipConditions::empty();
            for name in &row.conditions {
                if let Some(condition) = self.resolver.word("conditions", name, CipConditions::NAMED) {
                    conditions |= condition;
                }
            }
            if let (Some(at), Some(axis_state)) = (at, axis_state) {
                self.once(&mut seen, at, "state", &row.state);
                self.tables.states[at] = CipState { axis_state, conditions };
            }
        }
        self.all_there(rows, &seen, "state", DriveState::ALL.iter().map(|state| state.name()));
    }

    /// Notes that the row of something is there.
    fn once(&mut self, seen: &mut [bool], at: usize, key: &str, name: &Name) {
        if std::mem::replace(&mut seen[at], true) {
            let message = format!("the {} is defined twice", key.replace('_', " "));
            self.resolver.error(code::TWICE, name.span(), key, message);
        }
    }

    /// Everything has its row.
    fn all_there<'n>(
        &mut self,
        rows: &CipGenericFile,
        seen: &[bool],
        key: &str,
        names: impl Iterator<Item = &'n str>,
    ) {
        for (name, _) in names.zip(seen).filter(|(_, seen)| !**seen) {
            let message = format!("expected a row for {} {name}, got none", key.replace('_', " "));
            self.resolver.lacks(code::ROW_MISSING, rows.mapping.span(), key, name, message);
        }
    }

    /// All of these status bits.
    fn status_bits(&mut self, names: &[Name]) -> Option<StatusBits> {
        let mut bits = StatusBits::empty();
        for name in names {
            bits |= status_bit(&mut self.resolver, name)?;
        }
        Some(bits)
    }

    fn io_status(&mut self, rows: &CipGenericFile) {
        for row in &rows.io_status {
            let status = self.status_bits(&row.status);
            let without = self.status_bits(&row.without);
            let bit = self.bit("Axis I/O Status", "io_status", &row.io_status);
            let inverted = match &row.inverted {
                Some(name) => self.bit("Axis I/O Status", "inverted", name),
                None => bit,
            };
            let (Some(status), Some(without), Some(bit), Some(inverted)) = (status, without, bit, inverted)
            else {
                continue;
            };
            let bits = [1 << bit, 1 << inverted];
            self.tables.io_status.push(IoStatusRule { status, without, bits });
        }
    }

    fn status(&mut self, rows: &CipGenericFile) {
        for row in &rows.status {
            let Some(status) = self.status_bits(&row.status) else { continue };
            let mode = match &row.mode {
                None => None,
                Some(name) => match operating_mode(&mut self.resolver, name) {
                    Some(mode) => Some(mode),
                    None => continue,
                },
            };
            if let Some(bit) = self.bit("Axis Status", "axis_status", &row.axis_status) {
                self.tables.status.push(StatusRule { status, mode, axis_status: 1 << bit });
            }
        }
    }

    fn fault(&mut self, row: &CipFaultRow) {
        let cause = cause(&mut self.resolver, &row.cause);
        let mut faults = Vec::new();
        let mut given = 0;
        if let Some(name) = &row.exception {
            given += 1;
            let bit = self.bit("Axis Exceptions", "exception", name);
            faults.extend(bit.and_then(|code| self.axis_fault(row, "Axis Fault", Some("Axis Alarm"), code)));
        }
        if let Some(bit) = &row.manufacturer {
            given += 1;
            let number = u8::try_from(*bit.get_ref()).ok().filter(|number| (1..=63).contains(number));
            if number.is_none() {
                let message = format!("expected a bit from 1 to 63, got {}", bit.get_ref());
                self.resolver.error(code::OUT_OF_RANGE, bit.span(), "manufacturer", message);
            }
            let fault = number
                .and_then(|code| self.axis_fault(row, "Axis Fault - Mfg", Some("Axis Alarm - Mfg"), code));
            faults.extend(fault);
        }
        if let Some(name) = &row.node_fault {
            given += 1;
            faults.extend(self.byte_code("Node Fault Code", "node_fault", name).map(CipFault::Node));
        }
        if let Some(name) = &row.initialization {
            given += 1;
            let bit = self.bit("Initialization Faults", "initialization", name);
            faults.extend(bit.and_then(|code| self.axis_fault(row, "Initialization Fault", None, code)));
        }
        if let Some(name) = &row.apr {
            given += 1;
            let bit = self.bit("APR Faults", "apr", name);
            faults.extend(bit.and_then(|code| self.axis_fault(row, "APR Fault", None, code)));
        }
        if given != 1 {
            let message = format!(
                "expected one of exception, manufacturer, node_fault, initialization and apr, got {given}"
            );
            return self.resolver.error(code::CONTRADICTION, row.cause.span(), "cause", message);
        }
        if let (Some(cause), [fault]) = (cause, faults.as_slice()) {
            if self.tables.faults.iter().any(|(known, _)| *known == cause) {
                self.resolver.error(code::TWICE, row.cause.span(), "cause", "the cause is defined twice");
            }
            self.tables.faults.push((cause, *fault));
            let opposite = row.inverted.as_ref().and_then(|name| self::cause(&mut self.resolver, name));
            self.tables.opposites.extend(opposite.map(|opposite| (cause, opposite)));
            self.exception(row, cause, *fault);
        }
    }

    /// What the controller may set for an exception.
    fn exception(&mut self, row: &CipFaultRow, cause: FaultCause, fault: CipFault) {
        let words = [("box", Finder::Box), ("device", Finder::Device)];
        let found_by = row.found_by.as_ref();
        let found_by = found_by.and_then(|name| self.resolver.word("found_by", name, &words));
        let major = ExceptionAction::MAJOR_FAULT.0;
        let mut action = |key: &str, name: &Option<Name>| {
            name.as_ref().map_or(Some(major), |name| self.byte_code("Axis Exception Action", key, name))
        };
        let (Some(least), Some(default)) = (action("least", &row.least), action("default", &row.default))
        else {
            return;
        };
        let manufacturer = row.manufacturer.is_some();
        let (CipFault::Axis { code, .. }, true) = (fault, manufacturer || row.exception.is_some()) else {
            for (key, name) in [("found_by", &row.found_by), ("least", &row.least), ("default", &row.default)]
            {
                if let Some(name) = name {
                    let message = "only an exception has it: this cause is another kind of fault";
                    self.resolver.error(code::EXCEPTION_ACTION, name.span(), key, message);
                }
            }
            return;
        };
        if least > major || default > major || default < least {
            let key = if row.default.is_some() { "default" } else { "least" };
            let message = "expected an action that is at least as severe as `least`, at most Major Fault";
            return self.resolver.error(code::EXCEPTION_ACTION, row.cause.span(), key, message);
        }
        self.tables.exceptions.push(ExceptionRow {
            cause,
            manufacturer,
            bit: code,
            found_by,
            least,
            default,
        });
    }

    /// A fault of the axis whose types have these names in the dictionary.
    fn axis_fault(
        &mut self,
        row: &CipFaultRow,
        fault: &str,
        alarm: Option<&str>,
        code: u8,
    ) -> Option<CipFault> {
        let cip = &self.dictionaries.cip;
        let find = |set: &str, name: &str| {
            let codes = &cip.enumeration(set)?.codes;
            codes.iter().find(|known| known.name == name).and_then(|known| u8::try_from(known.code).ok())
        };
        let Some(fault_type) = find("Axis Fault Type", fault) else {
            let message = format!("the dictionary has no Axis Fault Type `{fault}`");
            self.resolver.error(code::ROW_MISSING, row.cause.span(), "cause", message);
            return None;
        };
        let alarm_type = alarm.and_then(|name| find("Axis Alarm Type", name));
        Some(CipFault::Axis { fault_type, alarm_type, code })
    }

    fn drive_actions(&mut self, rows: &CipGenericFile) {
        self.tables.drive_actions = DRIVE_ACTIONS.map(|(_, action)| (action, None));
        let mut seen = [false; DRIVE_ACTIONS.len()];
        for row in &rows.drive_action {
            let Some(action) = self.resolver.word("drive_action", &row.drive_action, &DRIVE_ACTIONS) else {
                continue;
            };
            if let Some(at) = DRIVE_ACTIONS.iter().position(|(_, known)| *known == action) {
                self.once(&mut seen, at, "drive_action", &row.drive_action);
            }
            let request = match &row.request {
                None => None,
                Some(name) => match self.request(name) {
                    Some(request) => Some(request),
                    None => continue,
                },
            };
            for (_, slot) in self.tables.drive_actions.iter_mut().filter(|(known, _)| *known == action) {
                *slot = request;
            }
        }
        self.all_there(rows, &seen, "drive_action", DRIVE_ACTIONS.iter().map(|(name, _)| *name));
    }

    fn request(&mut self, name: &Name) -> Option<Request> {
        let known = Request::ALL.iter().map(|request| request.name());
        self.resolver.name("request", name, "a request of the generic model", Request::parse, known)
    }

    fn reactions(&mut self, rows: &CipGenericFile) {
        let mut seen = [false; Reaction::ALL.len()];
        for row in &rows.reaction {
            let known = Reaction::ALL.iter().map(|reaction| reaction.name());
            let find = |text: &str| Reaction::ALL.iter().position(|reaction| reaction.name() == text);
            let at = self.resolver.name("reaction", &row.reaction, "a reaction", find, known);
            let stop = self.code("Axis Fault Action - Stop", "stop", &row.stop);
            let change = self.code("Axis Fault Action - State Change", "state_change", &row.state_change);
            if let (Some(at), Some(stop), Some(change)) = (at, stop, change) {
                // Two nibbles (attribute 668).
                self.tables.reactions[at] = u8::try_from(change << 4 | stop).unwrap_or(0);
                self.once(&mut seen, at, "reaction", &row.reaction);
            }
        }
        self.all_there(rows, &seen, "reaction", Reaction::ALL.iter().map(|reaction| reaction.name()));
    }

    fn inhibits(&mut self, rows: &CipGenericFile) {
        for row in &rows.inhibit {
            let known = Inhibits::NAMED.iter().map(|(_, name)| *name);
            let inhibit = self.resolver.name("inhibit", &row.inhibit, "an inhibit", Inhibits::parse, known);
            let standard = match &row.start_inhibit {
                None => 0,
                Some(name) => match self.bit("Start Inhibits", "start_inhibit", name) {
                    Some(bit) => 1 << bit,
                    None => continue,
                },
            };
            let manufacturer = match &row.manufacturer {
                None => 0,
                Some(bit) if (1..=15).contains(bit.get_ref()) => 1 << *bit.get_ref(),
                Some(bit) => {
                    let message = format!("expected a bit from 1 to 15, got {}", bit.get_ref());
                    self.resolver.error(code::OUT_OF_RANGE, bit.span(), "manufacturer", message);
                    continue;
                }
            };
            if let Some(inhibit) = inhibit {
                self.tables.inhibits.push(InhibitRule { inhibit, standard, manufacturer });
            }
        }
    }

    fn stoppings(&mut self, rows: &CipGenericFile) {
        for row in &rows.stopping {
            let code = self.byte_code("Stopping Action", "stopping_action", &row.stopping_action);
            let methods = StopMethod::ALL.iter().map(|method| method.name());
            let what = "a way to stop of the generic model";
            let method = self.resolver.name("method", &row.method, what, StopMethod::parse, methods);
            let abort = reaction(&mut self.resolver, "abort", &row.abort);
            if let (Some(code), Some(method), Some(abort)) = (code, method, abort) {
                let plan = StopPlan { method, hold: row.holds };
                self.tables.stoppings.push(CipStopping { code, plan, abort });
            }
        }
    }

    fn sequence(&mut self, rows: &CipGenericFile) {
        let row = &rows.sequence;
        self.tables.sequence = SequenceAttributes {
            stopping_action: self.attribute_id("stopping_action", &row.stopping_action),
            stopping_time_limit: self.attribute_id("stopping_time_limit", &row.stopping_time_limit),
            coasting_time_limit: self.attribute_id("coasting_time_limit", &row.coasting_time_limit),
            brake_release_delay: self.attribute_id("brake_release_delay", &row.brake_release_delay),
            brake_engage_delay: self.attribute_id("brake_engage_delay", &row.brake_engage_delay),
            zero_speed: self.attribute_id("zero_speed", &row.zero_speed),
            zero_speed_time: self.attribute_id("zero_speed_time", &row.zero_speed_time),
            ramp_velocity_positive: self.attribute_id("ramp_velocity_positive", &row.ramp_velocity_positive),
            ramp_velocity_negative: self.attribute_id("ramp_velocity_negative", &row.ramp_velocity_negative),
            ramp_acceleration: self.attribute_id("ramp_acceleration", &row.ramp_acceleration),
            ramp_deceleration: self.attribute_id("ramp_deceleration", &row.ramp_deceleration),
            deceleration_limit: self.attribute_id("deceleration_limit", &row.deceleration_limit),
            flying_start: self.attribute_id("flying_start", &row.flying_start),
            overtravel_checking: self.attribute_id("overtravel_checking", &row.overtravel_checking),
        };
    }

    fn mechanics(&mut self, rows: &CipGenericFile) {
        let row = &rows.mechanics;
        let load = |builder: &mut Self, key, name| builder.code("Load Type", key, name).map(i64::from);
        let actuator =
            |builder: &mut Self, key, name| builder.code("Actuator Type", key, name).map(i64::from);
        let load_type = match (
            load(self, "direct_rotary", &row.direct_rotary),
            load(self, "rotary_transmission", &row.rotary_transmission),
            load(self, "linear_actuator", &row.linear_actuator),
        ) {
            (Some(direct), Some(transmission), Some(actuator)) => {
                Some(MechanicalFact::LoadType { direct, transmission, actuator })
            }
            _ => None,
        };
        let actuator_type = match (
            actuator(self, "no_actuator", &row.no_actuator),
            actuator(self, "actuator", &row.actuator),
        ) {
            (Some(none), Some(usual)) => Some(MechanicalFact::ActuatorType { none, usual }),
            _ => None,
        };
        for (key, name, fact) in [
            ("load_type", &row.load_type, load_type),
            ("actuator_type", &row.actuator_type, actuator_type),
            ("lead", &row.lead, Some(MechanicalFact::Lead)),
            ("diameter", &row.diameter, Some(MechanicalFact::Diameter)),
            ("unit_ratio", &row.unit_ratio, Some(MechanicalFact::UnitRatio)),
        ] {
            let id = self.attribute_id(key, name);
            self.tables.mechanics.extend(fact.map(|fact| (id, fact)));
        }
    }

    fn events(&mut self, rows: &CipGenericFile) {
        for row in &rows.event {
            let event = self.byte_code("Event Type", "event", &row.event);
            let checking = self.bit("Event Checking", "checking", &row.checking);
            let trigger = match (&row.capture, &row.edge, &row.signal) {
                (Some(source), Some(edge), None) => {
                    capture_kind(&mut self.resolver, source, edge).map(EventTrigger::Capture)
                }
                (None, None, Some(name)) => self.event_signal(row, name),
                _ => {
                    let message = "expected capture and edge, or a signal";
                    self.resolver.error(code::CONTRADICTION, row.event.span(), "event", message);
                    None
                }
            };
            if let (Some(event), Some(checking), Some(trigger)) = (event, checking, trigger) {
                if self.tables.events.rules.iter().any(|known| known.event == event) {
                    self.resolver.error(code::TWICE, row.event.span(), "event", "the event is defined twice");
                }
                let checking = 1 << checking;
                self.tables.events.rules.push(EventRule { event, checking, trigger });
            }
        }
        for row in &rows.capture_status {
            let known = CaptureStatus::ALL.iter().map(|status| status.name());
            let what = "how a capture ends";
            let status = self.resolver.name("status", &row.status, what, CaptureStatus::parse, known);
            self.tables.events.status.extend(status.map(|status| (status, row.event_status)));
        }
    }

    fn event_signal(&mut self, row: &CipEventRow, name: &Name) -> Option<EventTrigger> {
        let signal = signal(&mut self.resolver, "signal", name)?;
        if let Some(unit) = &row.unit {
            let Some(found) = self.tables.unit(unit.get_ref(), signal.quantity()) else {
                let message = format!("no [[unit]] row turns {} into {}", unit.get_ref(), signal.quantity());
                self.resolver.error(code::UNIT, unit.span(), "unit", message);
                return None;
            };
            self.tables.events.units.push((signal, found));
        }
        Some(EventTrigger::Signal(signal))
    }

    fn attribute(&mut self, row: &CipAttributeRow) {
        let dictionaries = self.dictionaries;
        let found = dictionaries.cip.attribute_or_error("attribute", &row.attribute, &mut self.resolver);
        let Some(attribute) = found else { return };
        let served = match (&row.parameter, &row.signal, &row.served_by) {
            (Some(name), None, None) => self.parameter(row, attribute, name),
            (parameter, Some(name), None) => {
                self.signal_attribute(row, attribute, (name, parameter.as_ref()))
            }
            (None, None, Some(name)) if name.get_ref() == "mechanics" => self.mechanical(attribute, name),
            (None, None, Some(name)) => {
                let value = self.constant(row, attribute, name);
                let words = [
                    ("device", Served::Device),
                    ("connection", Served::Connection),
                    ("stored", Served::Stored),
                    ("constant", Served::Constant(value)),
                ];
                self.resolver.word("served_by", name, &words)
            }
            _ => {
                let message = "expected parameter, signal, both of them, or served_by";
                self.resolver.error(code::CONTRADICTION, row.attribute.span(), "attribute", message);
                None
            }
        };
        let Some(served) = served else { return };
        if self.tables.attributes.iter().any(|known| known.attribute.id == attribute.id) {
            self.resolver.error(
                code::TWICE,
                row.attribute.span(),
                "attribute",
                "the attribute is defined twice",
            );
        }
        if row.range.is_some() && attribute.data_type.width().is_none() {
            let message = "expected no `range` for an attribute that is no number";
            self.resolver.error(code::CONTRADICTION, row.attribute.span(), "range", message);
        }
        let range = match served {
            // What never changes can only be set to what it is.
            Served::Constant(value) => Some((value, value)),
            _ => row.range.map(|[low, high]| (low, high)),
        };
        let without = self.codes_without(row, attribute);
        self.tables.attributes.push(ServedAttribute { attribute: attribute.clone(), served, range, without });
    }

    /// The codes that an attribute cannot be set to.
    fn codes_without(&mut self, row: &CipAttributeRow, attribute: &CipAttribute) -> Vec<u32> {
        let sets = self.dictionaries.cip.enumerations();
        let set = sets.iter().find(|set| set.element.is_empty() && set.attributes.contains(&attribute.id));
        let known = || set.into_iter().flat_map(|set| &set.codes);
        let what = format!("a code of {}", attribute.name);
        let mut codes = Vec::with_capacity(row.without.len());
        for name in &row.without {
            let find = |text: &str| known().find(|code| code.name == text).map(|code| code.code);
            let names = known().map(|code| code.name.as_str());
            codes.extend(self.resolver.name("without", name, &what, find, names));
        }
        codes
    }

    /// An attribute of `[mechanics]`.
    fn mechanical(&mut self, attribute: &CipAttribute, name: &Name) -> Option<Served> {
        let found = self.tables.mechanics.iter().find(|(id, _)| *id == attribute.id);
        if found.is_none() {
            let message = format!("expected an attribute that [mechanics] names, got {}", attribute.name);
            self.resolver.error(code::CONTRADICTION, name.span(), "served_by", message);
        }
        found.map(|(_, fact)| Served::Mechanics(*fact))
    }

    /// The value of a constant; 0 for anything else.
    fn constant(&mut self, row: &CipAttributeRow, attribute: &CipAttribute, name: &Name) -> i64 {
        let value = row.value.or(attribute.default);
        if name.get_ref() == "constant" {
            if value.is_none() {
                let message = "expected the `value` of a constant, got none";
                self.resolver.error(code::MISSING_KEY, name.span(), "value", message);
            }
            if row.range.is_some() {
                let message = "expected no `range` for a constant: it can only be set to what it is";
                self.resolver.error(code::CONTRADICTION, name.span(), "range", message);
            }
        }
        value.unwrap_or(0)
    }

    fn reject(&mut self, row: &RejectRow) {
        self.resolver.reason(&row.reason);
        for name in &row.attributes {
            let dictionaries = self.dictionaries;
            let found = dictionaries.cip.attribute_or_error("attributes", name, &mut self.resolver);
            let Some(attribute) = found else { continue };
            let served = self.tables.attributes.iter().any(|known| known.attribute.id == attribute.id);
            let twice = self.tables.rejected.iter().any(|(known, _)| *known == attribute.id);
            if served || twice {
                self.resolver.error(code::TWICE, name.span(), "attributes", "the attribute is defined twice");
            }
            self.tables.rejected.push((attribute.id, row.reason.get_ref().clone()));
        }
    }

    fn unraised(&mut self, row: &UnraisedRow) {
        self.resolver.reason(&row.reason);
        for name in &row.exceptions {
            let Some(bit) = self.bit("Axis Exceptions", "exceptions", name) else { continue };
            if self.tables.unraised.iter().any(|(known, _)| *known == bit) {
                self.resolver.error(code::TWICE, name.span(), "exceptions", "the exception is defined twice");
            }
            self.tables.unraised.push((bit, row.reason.get_ref().clone()));
        }
    }

    fn parameter(&mut self, row: &CipAttributeRow, attribute: &CipAttribute, name: &Name) -> Option<Served> {
        let generic = &self.dictionaries.generic;
        let what = "a parameter of the generic model";
        let parameter =
            self.resolver.name("parameter", name, what, |text| generic.parameter(text), generic.names())?;
        if parameter.kind != ParameterType::Integer {
            let message = format!("expected a whole number, {} is a {}", name.get_ref(), parameter.kind);
            self.resolver.error(code::WRONG_KIND, name.span(), "parameter", message);
            return None;
        }
        let missing = match &row.missing {
            Some(word) => self.resolver.word("missing", word, &MISSING)?,
            None => Missing::Absent,
        };
        if parameter.parameter.is_of_vendor() {
            if let Some(word) = row.missing.as_ref().filter(|_| missing != Missing::Absent) {
                let message = "expected `reject`: a parameter of a vendor is the drive's alone, a value kept in the gateway has no effect";
                self.resolver.error(code::CONTRADICTION, word.span(), "missing", message);
            }
            self.settable(attribute, parameter, name);
        }
        let Some(unit) = self.tables.unit(&attribute.unit, parameter.quantity) else {
            self.resolver.error(code::UNIT, name.span(), "parameter", no_unit(attribute, parameter.quantity));
            return None;
        };
        Some(Served::Parameter { parameter: parameter.parameter, unit, missing, range: parameter.range })
    }

    /// The attribute of a vendor's parameter is set only where and when the drive takes a value.
    fn settable(&mut self, attribute: &CipAttribute, parameter: &GenericParameter, name: &Name) {
        let message = match (attribute.access, parameter.access) {
            (Access::Get, _) | (Access::Set, Write::Write) => None,
            (Access::Set, Write::WriteWhileDisabled) if !attribute.running => None,
            (Access::Set, Write::WriteWhileDisabled) => Some(
                "which is not to be written while the drive has torque: expected an attribute with `running = false`",
            ),
            (Access::Set, Write::Read) => {
                Some("which is only read: expected an attribute with `access = \"get\"`")
            }
            (Access::SetCyclic, _) => {
                Some("which no update carries: expected an attribute with `access = \"get\"` or `\"set\"`")
            }
        };
        if let Some(message) = message {
            let message = format!("{} is {}, {message}", attribute.name, parameter.name);
            self.resolver.error(code::READ_ONLY, name.span(), "parameter", message);
        }
    }

    /// An attribute that shows a signal, and a parameter while the signal has no value.
    fn signal_attribute(
        &mut self,
        row: &CipAttributeRow,
        attribute: &CipAttribute,
        (name, parameter): (&Name, Option<&Name>),
    ) -> Option<Served> {
        let signal = signal(&mut self.resolver, "signal", name)?;
        let otherwise = match parameter {
            None => None,
            Some(parameter) => Some(self.otherwise(row, attribute, (signal, parameter))?),
        };
        if attribute.access == Access::SetCyclic && !Signal::OFFSETS.contains(&signal) {
            let message = format!("expected an offset, as {} is added to a set-point", attribute.name);
            self.resolver.error(code::DIRECTION, name.span(), "signal", message);
            return None;
        }
        let Some(unit) = self.tables.unit(&attribute.unit, signal.quantity()) else {
            self.resolver.error(code::UNIT, name.span(), "signal", no_unit(attribute, signal.quantity()));
            return None;
        };
        if unit.reciprocal {
            let message = format!("expected a unit that is no reciprocal, {} is a signal", attribute.name);
            self.resolver.error(code::UNIT, name.span(), "signal", message);
            return None;
        }
        Some(Served::Signal { signal, otherwise, unit })
    }

    /// The parameter that is read while a signal has no value: it measures the same, and is only read.
    fn otherwise(
        &mut self,
        row: &CipAttributeRow,
        attribute: &CipAttribute,
        (signal, name): (Signal, &Name),
    ) -> Option<Parameter> {
        let Served::Parameter { parameter, .. } = self.parameter(row, attribute, name)? else { return None };
        let known = self.dictionaries.generic.by_number(parameter);
        if known.is_some_and(|known| known.quantity != signal.quantity()) {
            let message =
                format!("expected a parameter that measures {}, as {signal} does", signal.quantity());
            self.resolver.error(code::UNIT, name.span(), "parameter", message);
            return None;
        }
        if attribute.access != Access::Get || row.missing.is_some() {
            let message =
                "expected an attribute that is only read, and no `missing`: its signal is the drive's";
            self.resolver.error(code::CONTRADICTION, name.span(), "parameter", message);
            return None;
        }
        Some(parameter)
    }

    fn finish(mut self, file: &Parsed<CipGenericFile>) -> CipTables {
        let tables = &mut self.tables;
        tables.attributes.sort_by_key(|row| row.attribute.id);
        tables.rejected.sort();
        tables.faults.sort_by_key(|(cause, _)| *cause);
        let limits = [
            ("request", tables.requests.len(), MAX_REQUESTS),
            ("status", tables.status.len(), MAX_STATUS_RULES),
            ("io_status", tables.io_status.len(), MAX_IO_STATUS_RULES),
            ("fault", tables.faults.len(), MAX_FAULTS),
            ("inhibit", tables.inhibits.len(), MAX_INHIBITS),
            ("stopping", tables.stoppings.len(), MAX_STOPPINGS),
        ];
        for (key, rows, limit) in limits {
            if rows > limit {
                let message = format!("expected at most {limit} rows, got {rows}");
                self.resolver.error(code::TOO_MANY, file.rows.mapping.span(), key, message);
            }
        }
        self.tables
    }
}

fn no_unit(attribute: &CipAttribute, quantity: Quantity) -> String {
    let unit = if attribute.unit.is_empty() { "no unit" } else { attribute.unit.as_str() };
    format!("{} is in {unit}, and no [[unit]] row turns that into {quantity}", attribute.name)
}
