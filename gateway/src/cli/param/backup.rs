//! `axisbridge param backup`: the parameters of a drive into a file.

use std::process::ExitCode;

use super::BackupArguments;
use super::drive::{Drive, Found};
use crate::cli::CliError;
use crate::cli::progress::Progress;
use crate::local::drive::job::Listing;
use crate::parameter::backup::{Backup, Identity, Kept, Unread};

/// Reads all parameters of the backup list and writes them to the file.
///
/// # Errors
/// The drive or the gateway does not answer; there is no list; the file cannot be written.
pub fn run(arguments: &BackupArguments) -> Result<ExitCode, CliError> {
    let mut drive = Drive::connect(&arguments.at)?;
    let list = drive.list(Listing::Backup)?;
    if list.parameters.is_empty() {
        return Err(format!("nothing is known that could be backed up of this drive ({})", list.bus).into());
    }
    let identity = Identity::of(&mut drive, &list.bus)?;
    let mut backup = Backup::new(drive.axis(), &list.bus, &list.source, identity);
    let mut progress = Progress::new(false);
    let (mut absent, count) = (0, list.parameters.len());
    for (number, listed) in list.parameters.iter().enumerate() {
        progress.at(|| format!("reading {} of {count}: {}", number + 1, listed.id));
        match drive.read(&listed.id, true)? {
            Found::Report(report) => backup.parameter.push(Kept::from(*report)),
            Found::Refused(refused) if refused.ends_all() => return Err(refused.text.into()),
            // A list of what drives can have, not of what this one has.
            Found::Refused(refused) if refused.code == "absent" && list.bus != "sercos" => absent += 1,
            Found::Refused(refused) => backup.unread.push(Unread::new(&listed.id, &refused)),
        }
    }
    progress.clear();
    backup.save(&arguments.file)?;
    println!("{} parameters of {} in {}", backup.parameter.len(), drive.axis(), arguments.file.display());
    if absent > 0 {
        println!("{absent} parameters of the list are not in this drive");
    }
    for unread in &backup.unread {
        eprintln!("not read: {}", unread.why);
    }
    Ok(if backup.unread.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
