//! The file of a backup, as it is made of what a drive answers, and whether it is for a drive.

use super::drive::{Drive, Found, Refused};
use crate::cli::CliError;
use crate::local::drive::job::{Listing, ParameterReport};
use crate::parameter::backup::{Backup, Identity, Kept, Unread, questions};

impl From<ParameterReport> for Kept {
    fn from(report: ParameterReport) -> Self {
        let ParameterReport { id, name, kind, value, data, unit, attribute, minimum, maximum, .. } = report;
        Self {
            id,
            name: name.unwrap_or_default(),
            kind: kind.unwrap_or_default(),
            value,
            unit: unit.unwrap_or_default(),
            attribute: attribute.unwrap_or_default(),
            minimum: minimum.unwrap_or_default(),
            maximum: maximum.unwrap_or_default(),
            data,
        }
    }
}

impl Identity {
    /// What a drive says about itself. It need not have all of it.
    pub fn of(drive: &mut Drive, bus: &str) -> Result<Self, CliError> {
        let mut identity = Self::default();
        for question in questions(bus) {
            match drive.read(question.id, true)? {
                Found::Report(report) => {
                    identity.0.insert(question.key.to_owned(), report.value);
                }
                Found::Refused(refused) if refused.ends_all() => return Err(refused.text.into()),
                Found::Refused(_) => {}
            }
        }
        Ok(identity)
    }
}

impl Backup {
    /// Whether the drive of an axis can have these parameters: the bus must be the same, and the type of the drive, unless it is
    /// forced.
    pub fn is_for(&self, drive: &mut Drive, force: bool) -> Result<(), CliError> {
        let bus = drive.list(Listing::Backup)?.bus;
        if self.bus != bus {
            return Err(format!("the backup is of a drive on {}, and this one is on {bus}", self.bus).into());
        }
        let found = Identity::of(drive, &bus)?;
        let differences = self.drive.differences(&found, &bus);
        if differences.is_empty() || force {
            return Ok(());
        }
        let texts = differences
            .iter()
            .map(|(key, of_file, found)| format!("\n  {key}: {of_file} in the backup, {found} in the drive"));
        Err(format!("the backup is of another type of drive:{}", texts.collect::<String>()).into())
    }
}

/// A refusal as it is kept.
impl Unread {
    /// Why a parameter could not be read.
    pub fn new(id: &str, refused: &Refused) -> Self {
        Self { id: id.to_owned(), why: refused.text.clone() }
    }
}
