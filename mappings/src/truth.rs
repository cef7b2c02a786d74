//! What an answer about an attribute means: whether it acts, is compared, is computed, or has no effect.
//!
//! It follows from the rows of the tables and from what the drive of the axis has.

use std::fmt;

use super::Mapping;
use super::attributes::{AttributeEntry, AttributeTable, Backing};
use super::cip_tables::Missing;
use super::dictionary::Access;
use super::drive_program::{DriveProgram, ParameterEntry};
use profile_generic::parameter::Parameter;

/// What success means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Truth {
    /// Read from the drive or written to it, or the gateway acts on it.
    Live,
    /// It can be set to what the drive or the gateway has, and to nothing else.
    Compared,
    /// The gateway computes it.
    Computed,
    /// It is given back and has no effect.
    Stored,
    /// Not supported.
    Absent,
}

impl Truth {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Live, Self::Compared, Self::Computed, Self::Stored, Self::Absent];

    /// Its name in texts.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Live => "live",
            Self::Compared => "compared",
            Self::Computed => "computed",
            Self::Stored => "stored",
            Self::Absent => "absent",
        }
    }
}

impl fmt::Display for Truth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What is true of an attribute of an axis.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttributeTruth<'a> {
    /// Attribute number.
    pub id: u16,
    /// Name.
    pub name: &'a str,
    /// Access by the standard.
    pub access: Access,
    /// What success means.
    pub truth: Truth,
    /// By what: a place in the drive, a signal, a reason.
    pub by: String,
}

/// Where the value of a parameter is, for an axis with a certain drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterPlace<'a> {
    /// The drive has it.
    Drive(&'a ParameterEntry),
    /// The configuration has it, and the drive does not show it. In the unit of the generic model.
    Configuration(i64),
    /// It is 0: the loops of the drive do not have such a term.
    Zero,
    /// The gateway goes by it.
    Gateway,
    /// It is kept and has no effect.
    Stored,
    /// Nobody has it.
    Absent,
}

impl DriveProgram {
    /// Where the value of a parameter is. `missing` is what the row of its attribute says for drives that do not have it.
    #[must_use]
    pub fn place(&self, parameter: Parameter, missing: Missing) -> ParameterPlace<'_> {
        if let Some(held) = self.parameter(parameter) {
            return ParameterPlace::Drive(held);
        }
        if let Some(value) = self.datum(parameter) {
            return ParameterPlace::Configuration(value);
        }
        match missing {
            Missing::Device | Missing::DeviceOrZero if self.can_go_by(parameter) => ParameterPlace::Gateway,
            Missing::Zero | Missing::DeviceOrZero if self.has_parameters() && !self.is_own(parameter) => {
                ParameterPlace::Zero
            }
            Missing::Stored => ParameterPlace::Stored,
            Missing::Absent | Missing::Zero | Missing::Device | Missing::DeviceOrZero => {
                ParameterPlace::Absent
            }
        }
    }
}

impl Mapping {
    /// What is true of each attribute of an axis with this drive, in the order of their numbers.
    #[must_use]
    pub fn truths(&self, attributes: &AttributeTable, drive: &DriveProgram) -> Vec<AttributeTruth<'_>> {
        let rows = self.dictionaries.cip.attributes().iter();
        let of = |row: &'_ super::dictionary::CipAttribute| match attributes.get(row.id) {
            Some(entry) => self.truth(entry, drive),
            None => {
                let rejected = self.cip.rejected.iter().find(|(id, _)| *id == row.id);
                (Truth::Absent, rejected.map_or_else(|| "no row".to_owned(), |(_, reason)| reason.clone()))
            }
        };
        let mut all: Vec<_> = rows
            .map(|row| {
                let (truth, by) = of(row);
                AttributeTruth { id: row.id, name: &row.name, access: row.access, truth, by }
            })
            .collect();
        all.sort_by_key(|row| row.id);
        all
    }

    /// Whether anybody has an attribute of an axis with this drive: [`Truth::Absent`] otherwise.
    #[must_use]
    pub fn has(&self, entry: &AttributeEntry, drive: &DriveProgram) -> bool {
        let (parameter, missing) = match entry.backing {
            Backing::Mechanics(fact) => return drive.mechanical(fact).is_some(),
            Backing::Signal { signal, otherwise: Some(parameter), .. } if !drive.tells(signal) => {
                (parameter, Missing::Absent)
            }
            Backing::Parameter { parameter, missing, .. } => (parameter, missing),
            _ => return true,
        };
        match (drive.place(parameter, missing), self.dictionaries.generic.computation(parameter)) {
            (ParameterPlace::Drive(_) | ParameterPlace::Configuration(_), _) => true,
            (_, Some(computation)) => computation.is_possible(drive),
            (place, None) => place != ParameterPlace::Absent,
        }
    }

    fn truth(&self, entry: &AttributeEntry, drive: &DriveProgram) -> (Truth, String) {
        let is_set = entry.access != Access::Get;
        match entry.backing {
            Backing::Device if is_set => (Truth::Live, "the gateway goes by it".to_owned()),
            Backing::Device => (Truth::Computed, "the gateway".to_owned()),
            Backing::Connection if is_set => (Truth::Live, "the motion connection".to_owned()),
            Backing::Connection => (Truth::Computed, "the motion connection".to_owned()),
            Backing::Stored => (Truth::Stored, String::new()),
            Backing::Constant(value) => (Truth::Compared, format!("always {value}")),
            Backing::Mechanics(fact) => match drive.mechanical(fact) {
                Some((_, value)) => (Truth::Compared, format!("{value} by the scaling of the drive")),
                None => (Truth::Absent, "the drive does not show it".to_owned()),
            },
            Backing::Signal { signal, otherwise: Some(parameter), .. } if !drive.tells(signal) => {
                self.truth_of(parameter, Missing::Absent, is_set, drive)
            }
            Backing::Signal { signal, .. } if drive.derives(signal) => {
                (Truth::Computed, format!("{signal}: from the values of earlier cycles"))
            }
            Backing::Signal { signal, .. } => (Truth::Live, signal.to_string()),
            Backing::Parameter { parameter, missing, .. } => self.truth_of(parameter, missing, is_set, drive),
        }
    }

    /// How the value of a parameter is computed, in words.
    fn formula(&self, name: &str) -> String {
        let row = self.tables().generic.rows.computed.iter().find(|row| row.parameter.get_ref() == name);
        row.map_or_else(|| name.to_owned(), |row| format!("{name}: {}", row.words()))
    }

    fn truth_of(
        &self,
        parameter: Parameter,
        missing: Missing,
        is_set: bool,
        drive: &DriveProgram,
    ) -> (Truth, String) {
        let name = self.parameter_name(parameter);
        if let Some(computation) = self.dictionaries.generic.computation(parameter)
            && drive.parameter(parameter).is_none()
            && drive.datum(parameter).is_none()
        {
            return match computation.is_possible(drive) {
                true => (Truth::Computed, self.formula(&name.to_string())),
                false => (Truth::Absent, format!("the drive lacks what {name} is computed from")),
            };
        }
        let of_torque_limits = parameter == Parameter::STOPPING_TORQUE;
        match drive.place(parameter, missing) {
            ParameterPlace::Drive(held) if is_set && held.to_drive.is_none() => {
                (Truth::Compared, format!("{} of the drive", held.item))
            }
            ParameterPlace::Drive(held) => (Truth::Live, held.item.to_string()),
            ParameterPlace::Configuration(_) => (Truth::Compared, "the configuration".to_owned()),
            ParameterPlace::Zero => (Truth::Compared, format!("0: the drive has no {name}")),
            ParameterPlace::Gateway if of_torque_limits => {
                (Truth::Compared, "the torque limits of the drive".to_owned())
            }
            ParameterPlace::Gateway => (Truth::Live, "the gateway goes by it".to_owned()),
            ParameterPlace::Stored => (Truth::Stored, format!("the drive has no {name}")),
            ParameterPlace::Absent if missing == Missing::Device => {
                (Truth::Absent, drive.lacks(parameter).to_owned())
            }
            ParameterPlace::Absent => (Truth::Absent, format!("the drive has no {name}")),
        }
    }
}
