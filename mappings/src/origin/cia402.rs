//! Rows between the generic model and CiA 402.

use profile_generic::image::Signal;
use profile_generic::mode::ModeSelection;
use profile_generic::parameter::Parameter;
use profile_generic::state::Action;

use super::{Origin, find, origin};
use crate::Cia402Axis;
use crate::cia402::DriveMode;
use crate::drive_program::MODE_SHIFT;
use crate::{Item, Mapping, Object};

impl Mapping {
    /// The `[[signal]]` row of a signal in an object of the first axis.
    #[must_use]
    pub fn object_signal_row(&self, signal: Signal, object: Object) -> Option<Origin> {
        let file = &self.tables.generic_cia402;
        let mut rules = self.cia402.signals.iter();
        let at = rules.position(|rule| rule.signal == signal && rule.value.object == object)?;
        Some(origin(&file.text, "signal", &file.rows.signal.get(at)?.signal))
    }

    /// The `[[mode]]` or `[[procedure]]` row of an operating mode that is this mode of operation.
    #[must_use]
    pub fn object_mode_row(&self, selection: ModeSelection, mode: i8) -> Option<Origin> {
        let file = &self.tables.generic_cia402;
        let is = |known: &DriveMode| known.code == mode;
        let mut rules = self.cia402.modes.iter();
        if let Some(at) = rules.position(|rule| rule.selection == selection && rule.modes.iter().any(is)) {
            return Some(origin(&file.text, "mode", &file.rows.mode.get(at)?.mode));
        }
        let mut rules = self.cia402.procedures.iter();
        let at = rules.position(|rule| rule.selection == selection && rule.modes.iter().any(is))?;
        Some(origin(&file.text, "procedure", &file.rows.procedure.get(at)?.mode))
    }

    /// The `[[action]]` row of an action while the drive shows a status.
    #[must_use]
    pub fn object_action_row(&self, action: Action, status: u32) -> Option<Origin> {
        let file = &self.tables.generic_cia402;
        let rules = &self.cia402.actions;
        let step = |when: Option<_>| {
            when.is_some_and(|when: profile_generic::program::BitPattern| when.matches(status))
        };
        let at = rules.iter().position(|rule| rule.action == action && step(rule.when));
        let at = at.or_else(|| rules.iter().position(|rule| rule.action == action && rule.when.is_none()))?;
        let row = file.rows.action.get(at)?;
        Some(beside(origin(&file.text, "action", &row.action), row.when.as_ref()))
    }

    /// The `[[report]]` row that a status meets, mode of operation included.
    #[must_use]
    pub fn object_report_row(&self, status: u32, axis: &Cia402Axis) -> Option<Origin> {
        let file = &self.tables.generic_cia402;
        let tells = self.cia402.tells(axis);
        let at = self.cia402.reports.iter().position(|rule| {
            rule.drives.include(tells) && shows(&rule.modes, status) && rule.pattern.matches(status)
        })?;
        let row = file.rows.report.get(at)?;
        Some(beside(origin(&file.text, "report", &row.report), Some(&row.state)))
    }

    /// The `[[status]]` rows that a status and the words beside it meet.
    #[must_use]
    pub fn object_status_rows(&self, status: u32, words: &[(Item, u32)], axis: &Cia402Axis) -> Vec<Origin> {
        let file = &self.tables.generic_cia402;
        let value = |object: Object| match words.iter().find(|(known, _)| *known == Item::Object(object)) {
            Some((_, word)) => Some(*word),
            None => (object == self.cia402.words.status).then_some(status),
        };
        let tells = self.cia402.tells(axis);
        let rows = self.cia402.status.iter().zip(&file.rows.status).filter(|(rule, _)| {
            rule.drives.include(tells)
                && shows(&rule.modes, status)
                && value(rule.object).is_some_and(|word| rule.pattern.matches(word))
        });
        rows.map(|(_, row)| beside(origin(&file.text, "status", &row.status), row.state.as_ref())).collect()
    }

    /// The `[[fault]]` or `[[fault_class]]` row of an error code.
    #[must_use]
    pub fn object_fault_row(&self, error_code: u32) -> Option<Origin> {
        let file = &self.tables.generic_cia402;
        let at = self.cia402.faults.iter().position(|row| row.pattern.matches(error_code))?;
        let codes =
            file.rows.fault.iter().flat_map(|row| row.codes.iter().map(move |_| ("fault", &row.cause)));
        let classes = file.rows.fault_class.iter();
        let classes = classes.flat_map(|row| row.classes.iter().map(move |_| ("fault_class", &row.cause)));
        let (section, cause) = codes.chain(classes).nth(at)?;
        Some(origin(&file.text, section, cause))
    }

    /// The `[[parameter]]` row of a parameter.
    #[must_use]
    pub fn object_parameter_row(&self, parameter: Parameter) -> Option<Origin> {
        let file = &self.tables.generic_cia402;
        let name = self.parameter_name(parameter);
        find(&file.text, "parameter", &file.rows.parameter, |row| &row.parameter, &name)
    }
}

/// Whether a status shows one of these modes of operation; of none, any.
fn shows(modes: &[i8], status: u32) -> bool {
    let [shown, ..] = (status >> MODE_SHIFT).to_le_bytes();
    modes.is_empty() || modes.contains(&i8::from_le_bytes([shown]))
}

/// The row with the state that tells it from others of its name.
fn beside(mut origin: Origin, state: Option<&crate::format::Name>) -> Origin {
    if let Some(state) = state {
        origin.key.push_str(", ");
        origin.key.push_str(state.get_ref());
    }
    origin
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::shipped;

    #[test]
    fn rows_are_found_by_what_they_are_about() {
        let mapping = shipped();
        let key = |origin: Option<Origin>| origin.map(|origin| format!("{} {}", origin.section, origin.key));
        let line = |origin: Option<Origin>| {
            let text = include_str!("../../tables/generic-cia402.toml");
            text.lines().nth(origin.unwrap().line - 1).unwrap().to_owned()
        };
        let signal =
            line(mapping.object_signal_row(Signal::PositionCommand, Object { index: 0x607A, sub: 0 }));
        assert!(signal.trim().starts_with("{ signal = \"position_command\""), "{signal}");
        assert_eq!(
            key(mapping.object_action_row(Action::Enable, 0x23)),
            Some("action enable, Switched on".to_owned())
        );
        assert_eq!(key(mapping.object_action_row(Action::Enable, 0x08)), Some("action enable".to_owned()));
        // csp follows, csp ignores, profile velocity has no bit 12.
        let axis = Cia402Axis { acknowledges: Some(true), ..Cia402Axis::default() };
        let report = |status| key(mapping.object_report_row(status, &axis));
        assert_eq!(report(0x08_1027), Some("report operating, Operation enabled".to_owned()));
        assert_eq!(report(0x08_0027), Some("report enabling, Operation enabled".to_owned()));
        assert_eq!(report(0x03_0027), Some("report operating, Operation enabled".to_owned()));
        assert_ne!(mapping.object_report_row(0x08_1027, &axis), mapping.object_report_row(0x03_0027, &axis));
        let fault = line(mapping.object_fault_row(0x8611));
        assert!(fault.contains("cause = \"excessive_position_error\""), "{fault}");
        assert_eq!(
            key(mapping.object_fault_row(0x86FF)),
            Some("fault_class excessive_position_error".to_owned())
        );
        assert_eq!(key(mapping.object_fault_row(0)), None);
    }
}
