//! `axisbridge doctor`: is this host fit for the box.

use std::process::ExitCode;
use std::time::Duration;

use super::progress::Progress;
use super::{CliError, DoctorArguments, print};
use crate::config::Config;
use crate::doctor::{self, Verdict};

/// Looks at the host and prints what it found.
///
/// # Errors
/// The configuration is faulty; the output cannot be written.
pub fn run(arguments: &DoctorArguments) -> Result<ExitCode, CliError> {
    let config = arguments.config.as_deref().map(Config::load).transpose()?;
    let mut progress = Progress::new(arguments.json);
    let each = Duration::from_secs(arguments.seconds.into());
    let diagnosis = doctor::examine(config.as_ref(), each, |text| progress.step(text));
    let output =
        if arguments.json { format!("{:#}\n", doctor::json(&diagnosis)) } else { doctor::text(&diagnosis) };
    let unfit = diagnosis.verdict() == Verdict::Unfit;
    print(output, if unfit { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
