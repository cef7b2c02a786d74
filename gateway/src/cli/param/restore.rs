//! `axisbridge param restore`: the parameters of a backup into a drive.
//!
//! Only what differs is written. Limits depend on each other, so what a drive refuses is tried again after the others, as long as
//! that changes anything. Nothing is left half set without a word: what was written, what was not and why is listed in any case,
//! and what the drive has in the end is compared with the file.

use std::process::ExitCode;

use super::RestoreArguments;
use super::compare::differences;
use super::drive::{Drive, Found, Refused};
use super::show;
use crate::cli::CliError;
use crate::cli::progress::Progress;
use crate::local::protocol::printable;
use crate::parameter::backup::{Backup, Kept};

/// Times that what was refused is tried, at most.
const PASSES_MAX: usize = 8;

/// How far a restore has come.
#[derive(Default)]
struct Restore<'b> {
    /// Parameters that the drive had already.
    equal: usize,
    /// Those that were written and are as in the backup.
    written: Vec<&'b Kept>,
    /// Those that were not, with the reason.
    refused: Vec<(&'b Kept, String)>,
    /// Whether one of them decides what the values of the drive mean.
    recommission: bool,
}

/// Writes what differs.
///
/// # Errors
/// The file is of another type of drive, or cannot be read; the gateway does not answer.
pub fn run(arguments: &RestoreArguments) -> Result<ExitCode, CliError> {
    let backup = Backup::load(&arguments.file)?;
    let mut drive = Drive::connect(&arguments.at)?;
    backup.is_for(&mut drive, arguments.force)?;
    let mut restore = Restore::default();
    let ended = restore.run(&mut drive, &backup);
    for kept in &restore.written {
        println!("{} = {}", kept.id, printable(&kept.value));
    }
    for (kept, why) in &restore.refused {
        eprintln!("not restored: {} = {}: {}", kept.id, printable(&kept.value), printable(why));
    }
    let done = restore.equal + restore.written.len();
    let count = backup.parameter.len();
    println!(
        "{} of {count} parameters were written, {} were the same, {} were not restored",
        restore.written.len(),
        restore.equal,
        count - done
    );
    if let Err(error) = ended {
        return Err(format!(
            "the restore was broken off, and the drive has {done} of {count} parameters: {error}"
        )
        .into());
    }
    // A parameter that was written may have changed another one.
    let differences = differences(&mut drive, &backup, false)?;
    for difference in &differences {
        let refused = restore.refused.iter().any(|(kept, _)| kept.id == difference.id);
        if !refused {
            let found = difference.drive.as_ref().or(difference.why.as_ref()).map_or("", String::as_str);
            eprintln!(
                "changed by another one: {} = {} in the backup, {} in the drive",
                difference.id,
                printable(&difference.backup),
                printable(found)
            );
        }
    }
    if restore.recommission {
        print!("{}", show::RECOMMISSION);
    }
    Ok(if differences.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

impl<'b> Restore<'b> {
    fn run(&mut self, drive: &mut Drive, backup: &'b Backup) -> Result<(), CliError> {
        let mut progress = Progress::new(false);
        let ended = self.passes(drive, backup, &mut progress);
        progress.clear();
        ended
    }

    fn passes(
        &mut self,
        drive: &mut Drive,
        backup: &'b Backup,
        progress: &mut Progress,
    ) -> Result<(), CliError> {
        let mut open: Vec<&Kept> = backup.parameter.iter().collect();
        let count = open.len();
        for pass in 1..=PASSES_MAX {
            let mut left = Vec::new();
            self.refused.clear();
            for (number, kept) in open.iter().enumerate() {
                progress.at(|| format!("pass {pass}, {} of {count}: {}", number + 1, kept.id));
                match self.restore(drive, kept)? {
                    None => {}
                    Some(refused) if refused.ends_all() => return Err(refused.text.into()),
                    Some(refused) => {
                        self.refused.push((kept, refused.text));
                        left.push(*kept);
                    }
                }
            }
            if left.is_empty() || left.len() == open.len() {
                break;
            }
            open = left;
        }
        Ok(())
    }

    /// Restores one parameter; what was refused.
    fn restore(&mut self, drive: &mut Drive, kept: &'b Kept) -> Result<Option<Refused>, CliError> {
        match drive.read(&kept.id, true)? {
            Found::Report(report) if report.data.eq_ignore_ascii_case(&kept.data) => {
                self.equal += 1;
                return Ok(None);
            }
            Found::Report(_) => {}
            Found::Refused(refused) => return Ok(Some(refused)),
        }
        Ok(match drive.write(&kept.id, &format!("hex:{}", kept.data))? {
            Found::Report(report) => {
                self.recommission |= report.recommission;
                self.written.push(kept);
                None
            }
            Found::Refused(refused) => Some(refused),
        })
    }
}
