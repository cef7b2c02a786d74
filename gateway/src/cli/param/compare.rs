//! `axisbridge param compare`: a drive and a backup.

use std::process::ExitCode;

use serde::Serialize;

use super::CompareArguments;
use super::drive::{Drive, Found};
use super::show;
use crate::cli::progress::Progress;
use crate::cli::{CliError, print};
use crate::local::protocol::printable;
use crate::parameter::backup::{Backup, Kept};

/// A parameter in which the drive and the backup differ.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Its number.
    pub id: String,
    /// Its name.
    pub name: String,
    /// The value of the backup.
    pub backup: String,
    /// The value of the drive; not there when it could not be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    /// Why it could not be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

impl Difference {
    fn new(kept: &Kept) -> Self {
        let Kept { id, name, value, .. } = kept.clone();
        Self { id, name, backup: value, drive: None, why: None }
    }
}

/// Compares each parameter of the file with the drive.
///
/// # Errors
/// The drive or the gateway does not answer, or the file cannot be read.
pub fn run(arguments: &CompareArguments) -> Result<ExitCode, CliError> {
    let backup = Backup::load(&arguments.file)?;
    let mut drive = Drive::connect(&arguments.at)?;
    // A drive of another type differs, of course: that is said, and what it has is compared all the same.
    if let Err(other) = backup.is_for(&mut drive, false) {
        eprintln!("{other}");
    }
    let differences = differences(&mut drive, &backup, arguments.json)?;
    let code = if differences.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    if arguments.json {
        let count = backup.parameter.len();
        let object = serde_json::json!({ "compared": count, "differences": differences });
        return print(format!("{object}\n"), code);
    }
    print(text(&differences, backup.parameter.len()), code)
}

/// In what the drive differs from the backup. Bytes are compared, not what they look like.
pub fn differences(drive: &mut Drive, backup: &Backup, quiet: bool) -> Result<Vec<Difference>, CliError> {
    let mut progress = Progress::new(quiet);
    let (mut found, count) = (Vec::new(), backup.parameter.len());
    for (number, kept) in backup.parameter.iter().enumerate() {
        progress.at(|| format!("comparing {} of {count}: {}", number + 1, kept.id));
        match drive.read(&kept.id, true)? {
            Found::Report(report) if report.data.eq_ignore_ascii_case(&kept.data) => {}
            Found::Report(report) => {
                found.push(Difference { drive: Some(report.value), ..Difference::new(kept) });
            }
            Found::Refused(refused) if refused.ends_all() => return Err(refused.text.into()),
            Found::Refused(refused) => {
                found.push(Difference { why: Some(refused.text), ..Difference::new(kept) });
            }
        }
    }
    progress.clear();
    Ok(found)
}

/// The differences as a table.
fn text(differences: &[Difference], count: usize) -> String {
    if differences.is_empty() {
        return format!("{count} parameters are the same\n");
    }
    let mut rows = vec![["parameter", "backup", "drive", "name"].map(str::to_owned)];
    rows.extend(differences.iter().map(|difference| {
        let Difference { id, name, backup, drive, why } = difference;
        let drive = drive.as_ref().or(why.as_ref()).map_or_else(String::new, |text| printable(text));
        [id.clone(), printable(backup), drive, printable(name)]
    }));
    format!("{}\n{} of {count} parameters differ\n", show::table(&rows), differences.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_a_table() {
        let difference = |id: &str, drive: Option<&str>, why: Option<&str>| Difference {
            id: id.to_owned(),
            name: "Kv".to_owned(),
            backup: "1.50".to_owned(),
            drive: drive.map(str::to_owned),
            why: why.map(str::to_owned),
        };
        let differences = [
            difference("S-0-0104", Some("2.00"), None),
            difference("P-0-0001", None, Some("the drive refuses the IDN")),
        ];
        let expected = "parameter  backup  drive                      name\n\
                        S-0-0104   1.50    2.00                       Kv\n\
                        P-0-0001   1.50    the drive refuses the IDN  Kv\n\
                        \n2 of 9 parameters differ\n";
        assert_eq!(text(&differences, 9), expected);
        assert_eq!(text(&[], 9), "9 parameters are the same\n");
    }
}
