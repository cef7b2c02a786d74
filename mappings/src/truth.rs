//! What an answer about an attribute means: whether it acts, is compared, is computed, or has no effect.
//!
//! It follows from the rows of the tables and from what the drive of the axis has.

use std::fmt;

use super::Mapping;
use super::attributes::{AttributeEntry, AttributeTable, Backing};
use super::cip_tables::Missing;
use super::dictionary::Access;
use super::drive_program::DriveProgram;
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
        match (drive.parameter(parameter), missing) {
            (Some(held), _) if is_set && held.to_drive.is_none() => {
                (Truth::Compared, format!("{} of the drive", held.item))
            }
            (Some(held), _) => (Truth::Live, held.item.to_string()),
            (None, _) if drive.datum(parameter).is_some() => {
                (Truth::Compared, "the configuration".to_owned())
            }
            (None, Missing::Absent) => (Truth::Absent, format!("the drive has no {name}")),
            (None, Missing::Stored) => (Truth::Stored, format!("the drive has no {name}")),
            (None, Missing::DeviceOrZero) if drive.can_go_by(parameter) => {
                (Truth::Live, "the gateway goes by it".to_owned())
            }
            (None, Missing::Zero | Missing::DeviceOrZero)
                if drive.has_parameters() && !drive.is_own(parameter) =>
            {
                (Truth::Compared, format!("0: the drive has no {name}"))
            }
            (None, Missing::Zero | Missing::DeviceOrZero) => {
                (Truth::Absent, format!("the drive has no {name}"))
            }
            (None, Missing::Device) if !drive.can_go_by(parameter) => {
                (Truth::Absent, drive.lacks(parameter).to_owned())
            }
            (None, Missing::Device) if parameter == Parameter::STOPPING_TORQUE => {
                (Truth::Compared, "the torque limits of the drive".to_owned())
            }
            (None, Missing::Device) => (Truth::Live, "the gateway goes by it".to_owned()),
        }
    }
}
