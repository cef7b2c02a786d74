//! Where a row of the mapping tables stands, for those who ask which row made a value.

mod cia402;

use core::fmt;
use core::ops::Range;

use profile_generic::fault::FaultCause;
use profile_generic::image::Signal;
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::parameter::Parameter;
use profile_generic::quantity::Quantity;
use profile_generic::state::{Action, DriveState};
use profile_sercos::wire::idn::Idn;
use serde::Serialize;

use super::format::Name;
use super::{Item, Mapping, Tables};
use crate::finding::Source;

/// Where a row stands.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Origin {
    /// The name of the file.
    pub file: String,
    /// Line of the value that the row is named by, 1 first.
    pub line: usize,
    /// The kind of row.
    pub section: &'static str,
    /// What the row is about, in the words of the table.
    pub key: String,
    /// The whole path of the file: others may have the same name.
    #[serde(skip)]
    pub path: String,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{} [[{}]] {}", self.file, self.line, self.section, self.key)
    }
}

/// The row whose named value is `wanted`.
fn find<R>(
    text: &Source,
    section: &'static str,
    rows: &[R],
    name: impl Fn(&R) -> &Name,
    wanted: &str,
) -> Option<Origin> {
    let row = rows.iter().find(|row| name(row).get_ref() == wanted)?;
    Some(origin(text, section, name(row)))
}

fn origin(text: &Source, section: &'static str, name: &Name) -> Origin {
    let (path, line, _) = text.place(name.span().start);
    let file = path.rsplit('/').next().unwrap_or_default().to_owned();
    Origin { file, line, section, key: name.get_ref().clone(), path: path.to_owned() }
}

/// Rows between CIP Motion and the generic model.
impl Mapping {
    /// The `[[cyclic]]` row of a signal.
    #[must_use]
    pub fn cyclic_row(&self, signal: Signal) -> Option<Origin> {
        let file = &self.tables.cip_generic;
        let row = file.rows.cyclic.iter().find(|row| row.signal.get_ref() == signal.name())?;
        Some(origin(&file.text, "cyclic", &row.element))
    }

    /// The `[[mode]]` row of an operating mode.
    #[must_use]
    pub fn control_mode_row(&self, mode: OperatingMode) -> Option<Origin> {
        let file = &self.tables.cip_generic;
        let row = file.rows.mode.iter().find(|row| row.mode.get_ref() == mode.name())?;
        Some(origin(&file.text, "mode", &row.control_mode))
    }

    /// The `[[request]]` row of an Axis Control code.
    #[must_use]
    pub fn request_row(&self, axis_control: u8) -> Option<Origin> {
        let file = &self.tables.cip_generic;
        let at = self.cip.requests.iter().position(|row| row.axis_control == axis_control)?;
        Some(origin(&file.text, "request", &file.rows.request.get(at)?.axis_control))
    }

    /// The `[[state]]` row of a drive state.
    #[must_use]
    pub fn state_row(&self, state: DriveState) -> Option<Origin> {
        let file = &self.tables.cip_generic;
        find(&file.text, "state", &file.rows.state, |row| &row.state, state.name())
    }

    /// The `[[state]]` row of an Axis State code.
    #[must_use]
    pub fn axis_state_row(&self, code: u8) -> Option<Origin> {
        let states = DriveState::ALL.iter().zip(&self.cip.states);
        let (state, _) = states.into_iter().find(|(_, row)| row.axis_state == code)?;
        self.state_row(*state)
    }

    /// The `[[fault]]` row of a cause.
    #[must_use]
    pub fn exception_row(&self, cause: FaultCause) -> Option<Origin> {
        let file = &self.tables.cip_generic;
        find(&file.text, "fault", &file.rows.fault, |row| &row.cause, &cause.to_string())
    }

    /// The `[[attribute]]` row of an attribute.
    #[must_use]
    pub fn attribute_row(&self, id: u16) -> Option<Origin> {
        let file = &self.tables.cip_generic;
        let name = &self.dictionaries.cip.attribute_by_id(id)?.name;
        find(&file.text, "attribute", &file.rows.attribute, |row| &row.attribute, name)
    }
}

/// Rows of any table.
impl Mapping {
    /// Where a row stands: the table with its text, and the line of the row in it.
    #[must_use]
    pub fn place_of(&self, row: &Origin) -> Option<(&Source, Range<usize>)> {
        let Tables { cip_generic, generic_sercos, generic_cia402, .. } = &self.tables;
        let texts = [&cip_generic.text, &generic_sercos.text, &generic_cia402.text];
        texts.into_iter().find_map(|text| Some((&**text, text.line_of(&row.path, row.line)?)))
    }

    /// The `[[scaling]]` row of a quantity on SERCOS drives.
    #[must_use]
    pub fn scaling_row(&self, quantity: Quantity) -> Option<Origin> {
        let file = &self.tables.generic_sercos;
        let quantity = quantity.to_string();
        let name =
            file.rows.scaling.iter().map(|row| &row.scaling).find(|name| *name.get_ref() == quantity)?;
        Some(origin(&file.text, "scaling", name))
    }

    /// The `[[scaling]]` row of a quantity on CiA 402 drives.
    #[must_use]
    pub fn object_scaling_row(&self, quantity: Quantity) -> Option<Origin> {
        let file = &self.tables.generic_cia402;
        let quantity = quantity.to_string();
        let row = file.rows.scaling.iter().find(|row| *row.quantity.get_ref() == quantity)?;
        Some(origin(&file.text, "scaling", &row.unit))
    }

    /// The first `[[commission]]` row that writes or reads an IDN or object.
    #[must_use]
    pub fn commission_row(&self, item: Item) -> Option<Origin> {
        let wanted = item.to_string();
        match item {
            Item::Idn(_) => {
                let file = &self.tables.generic_sercos;
                let names = file.rows.commission.iter().filter_map(|row| row.idn.as_ref());
                let name = names.into_iter().find(|name| *name.get_ref() == wanted)?;
                Some(origin(&file.text, "commission", name))
            }
            // Rows that write one object have it as their only one.
            Item::Object(_) => {
                let file = &self.tables.generic_cia402;
                let names = file.rows.commission.iter().filter_map(|row| row.object.as_ref());
                let name = names.into_iter().find(|name| *name.get_ref() == wanted)?;
                Some(origin(&file.text, "commission", name))
            }
            Item::Attribute(_) => None,
        }
    }
}

/// Rows between the generic model and SERCOS.
impl Mapping {
    /// The `[[signal]]` row of a signal.
    #[must_use]
    pub fn signal_row(&self, signal: Signal) -> Option<Origin> {
        let file = &self.tables.generic_sercos;
        find(&file.text, "signal", &file.rows.signal, |row| &row.signal, signal.name())
    }

    /// The `[[mode]]` row of an operating mode.
    #[must_use]
    pub fn mode_row(&self, selection: ModeSelection) -> Option<Origin> {
        let file = &self.tables.generic_sercos;
        let at = self.sercos.modes.iter().position(|rule| rule.selection == selection)?;
        Some(origin(&file.text, "mode", &file.rows.mode.get(at)?.mode))
    }

    /// The `[[action]]` row of an action.
    #[must_use]
    pub fn action_row(&self, action: Action) -> Option<Origin> {
        let file = &self.tables.generic_sercos;
        find(&file.text, "action", &file.rows.action, |row| &row.action, action.name())
    }

    /// The `[[report]]` row that a status word meets; `silent` as in [`super::SercosAxis`].
    #[must_use]
    pub fn report_row(&self, status: u32, silent: bool) -> Option<Origin> {
        let file = &self.tables.generic_sercos;
        let at = self.sercos.reports.iter().position(|rule| {
            rule.acknowledges.is_none_or(|wanted| wanted != silent)
                && rule.procedure != Some(true)
                && rule.pattern.matches(status)
        })?;
        Some(origin(&file.text, "report", &file.rows.report.get(at)?.report))
    }

    /// The `[[status]]` rows that a status word and the words beside it meet; `silent` as in [`super::SercosAxis`].
    #[must_use]
    pub fn status_rows(&self, status: u32, words: &[(Item, u32)], silent: bool) -> Vec<Origin> {
        let file = &self.tables.generic_sercos;
        let value = |idn: Idn| match words.iter().find(|(known, _)| *known == idn.into()) {
            Some((_, word)) => Some(*word),
            None => (idn == self.sercos.status_word).then_some(status),
        };
        let rows = self.sercos.status.iter().zip(&file.rows.status).filter(|(rule, _)| {
            rule.acknowledges.is_none_or(|wanted| wanted != silent)
                && value(rule.word).is_some_and(|word| rule.pattern.matches(word))
        });
        rows.map(|(_, row)| origin(&file.text, "status", &row.status)).collect()
    }

    /// The `[[fault]]` row by which a diagnostic word shows a cause.
    #[must_use]
    pub fn fault_row(&self, idn: Idn, word: u32, cause: FaultCause) -> Option<Origin> {
        let file = &self.tables.generic_sercos;
        let at = self
            .sercos
            .faults
            .iter()
            .position(|row| row.word == idn.into() && row.cause == cause && row.pattern.matches(word))?;
        Some(origin(&file.text, "fault", &file.rows.fault.get(at)?.cause))
    }

    /// The name of a parameter, or its number.
    #[must_use]
    pub fn parameter_name(&self, parameter: Parameter) -> String {
        let own = self.dictionaries.generic.by_number(parameter);
        own.map_or_else(|| parameter.to_string(), |row| row.name.clone())
    }

    /// The `[[parameter]]` row of a parameter.
    #[must_use]
    pub fn parameter_row(&self, parameter: Parameter) -> Option<Origin> {
        let file = &self.tables.generic_sercos;
        let name = self.parameter_name(parameter);
        find(&file.text, "parameter", &file.rows.parameter, |row| &row.parameter, &name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_by_what_they_are_about() {
        let mapping = Mapping::embedded().unwrap();
        let origin = mapping.signal_row(Signal::PositionCommand).unwrap();
        assert_eq!((origin.file.as_str(), origin.section), ("generic-sercos.toml", "signal"));
        let text = include_str!("../../tables/generic-sercos.toml");
        let line = text.lines().nth(origin.line - 1).unwrap();
        assert!(line.trim().starts_with("{ signal = \"position_command\""), "{line}");
        let origin = mapping.cyclic_row(Signal::PositionActual).unwrap();
        assert_eq!(origin.key, "Actual Position");
        assert!(mapping.action_row(Action::Enable).is_some());
        assert!(mapping.state_row(DriveState::Operating).is_some());
        assert_eq!(mapping.attribute_row(1).map(|origin| origin.key), None);
        assert_eq!(mapping.report_row(0, false).unwrap().key, "not_ready");
    }
}
