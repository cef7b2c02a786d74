//! `axisbridge param command`: a procedure command of a drive, from its start to its end.
//!
//! Every state that is shown is what the drive has answered. A command that is done, has failed, is late or is not wanted any more
//! is cancelled, as SERCOS has it: only then can it be started again.

use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::CommandArguments;
use super::drive::{Drive, Found, Refused};
use super::show::RECOMMISSION;
use crate::cli::progress::Progress;
use crate::cli::{CliError, print};
use crate::local::drive::job::{Act, Listing};
use crate::local::drive::{CommandReport, State};
use crate::local::protocol::printable;
use crate::parameter::id::Id;

/// How often the drive is asked how far it is.
const INTERVAL: Duration = Duration::from_millis(100);

/// How a command has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Ending {
    /// The drive answers that it is done.
    Done,
    /// The drive answers that it is not.
    Failed,
    /// It was cancelled, and the drive answers that it is not set any more.
    Cancelled,
    /// It was to be cancelled, and is not.
    NotCancelled,
}

/// A state of a command as one JSON object in a line.
#[derive(Debug, Serialize)]
struct Line<'r> {
    #[serde(flatten)]
    report: &'r CommandReport,
    /// Seconds since the start.
    seconds: f64,
    /// How it has ended, in the last line.
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<Ending>,
    /// Why it was cancelled, or was not.
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<&'r str>,
}

/// Starts the command, shows how far it is, and cancels it in the end.
///
/// # Errors
/// The drive or the gateway does not answer.
pub fn run(arguments: &CommandArguments) -> Result<ExitCode, CliError> {
    let mut drive = Drive::connect(&arguments.at)?;
    let number = number(&mut drive, &arguments.command)?;
    if arguments.cancel {
        return match drive.command(&number, Act::Cancel)? {
            Found::Report(report) => cancelled(&report, arguments.json),
            Found::Refused(refused) => Ok(refuse(&refused)),
        };
    }
    let stop = drive.stop()?;
    let begun = Instant::now();
    let mut report = match drive.command(&number, Act::Start)? {
        Found::Report(report) => *report,
        Found::Refused(refused) => return Ok(refuse(&refused)),
    };
    let limit = Duration::from_secs(arguments.time_limit.into());
    let mut progress = Progress::new(arguments.json);
    let mut shown = None;
    let late = loop {
        if !report.state.is_open() {
            break None;
        }
        if arguments.json && shown.replace(report.state) != Some(report.state) {
            print(line(&report, begun, None, None)?, ExitCode::SUCCESS)?;
        }
        if stop.load(Ordering::Relaxed) {
            break Some("interrupted".to_owned());
        }
        if begun.elapsed() >= limit {
            break Some(format!("not done within {} s", arguments.time_limit));
        }
        progress.at(|| {
            format!("{}: {}, {:.1} s", heading(&report), report.state.name(), begun.elapsed().as_secs_f64())
        });
        sleep(INTERVAL);
        let unknown = match drive.command(&number, Act::Progress) {
            Ok(Found::Report(now)) => {
                let CommandReport { name, recommission, .. } = report;
                report = CommandReport { name, recommission, ..*now };
                continue;
            }
            Ok(Found::Refused(refused)) => refused.text,
            Err(error) => error.to_string(),
        };
        progress.clear();
        return Err(format!("{number} is started, and its progress is not known: {unknown}").into());
    };
    progress.clear();
    end(&mut drive, &number, &report, begun, late.as_deref(), arguments.json)
}

/// Cancels a command that has ended or is to end, and says what came of it.
fn end(
    drive: &mut Drive,
    number: &str,
    report: &CommandReport,
    begun: Instant,
    late: Option<&str>,
    json: bool,
) -> Result<ExitCode, CliError> {
    // An object has no state that could be cancelled.
    let kept = match Id::parse(number) {
        Some(Id::Idn(_)) => match drive.command(number, Act::Cancel) {
            Ok(Found::Report(after)) if after.state == State::NotSet => None,
            Ok(Found::Report(after)) => Some(format!("the drive answers that it is {}", after.state.name())),
            Ok(Found::Refused(refused)) => Some(refused.text),
            Err(error) => Some(error.to_string()),
        },
        _ => None,
    };
    let (ending, code) = match (late, report.state, &kept) {
        (None, State::Done, _) => (Ending::Done, ExitCode::SUCCESS),
        (None, ..) => (Ending::Failed, ExitCode::FAILURE),
        (Some(_), _, None) => (Ending::Cancelled, ExitCode::FAILURE),
        (Some(_), _, Some(_)) => (Ending::NotCancelled, ExitCode::FAILURE),
    };
    let why = late.or(kept.as_deref());
    if json {
        return print(line(report, begun, Some(ending), why)?, code);
    }
    let seconds = begun.elapsed().as_secs_f64();
    let mut text = sentence(report, ending, seconds, late);
    if report.recommission {
        text += RECOMMISSION;
    }
    match ending {
        Ending::Done => print(text, code)?,
        _ => {
            eprint!("{text}");
            code
        }
    };
    if let Some(kept) = kept {
        eprintln!("{number} may still be set in the drive: {kept}");
    }
    Ok(code)
}

/// What came of a command, for people.
fn sentence(report: &CommandReport, ending: Ending, seconds: f64, late: Option<&str>) -> String {
    let heading = heading(report);
    let late = late.unwrap_or_default();
    match ending {
        Ending::Done => format!("{heading}: done after {seconds:.1} s\n"),
        Ending::Failed => {
            let status = report.status.as_deref().unwrap_or_default();
            let mut text =
                format!("{heading}: {} after {seconds:.1} s, data status {status}\n", report.state.name());
            if let Some(diagnostic) = &report.diagnostic {
                text += &format!("  diagnostic number   {diagnostic}\n");
            }
            if let Some(message) = &report.message {
                text += &format!("  diagnostic message  {}\n", printable(message));
            }
            text
        }
        Ending::Cancelled => format!("{heading}: {late}, and cancelled after {seconds:.1} s\n"),
        Ending::NotCancelled => format!("{heading}: {late}, and not cancelled\n"),
    }
}

/// Number and name.
fn heading(report: &CommandReport) -> String {
    match &report.name {
        Some(name) => format!("{} {}", report.id, printable(name)),
        None => report.id.clone(),
    }
}

fn line(
    report: &CommandReport,
    begun: Instant,
    result: Option<Ending>,
    why: Option<&str>,
) -> Result<String, CliError> {
    // Milliseconds are enough.
    let seconds = (begun.elapsed().as_secs_f64() * 1_000.0).round() / 1_000.0;
    Ok(serde_json::to_string(&Line { report, seconds, result, why })? + "\n")
}

/// What came of `--cancel`.
fn cancelled(report: &CommandReport, json: bool) -> Result<ExitCode, CliError> {
    let code = if report.state == State::NotSet { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    let text = match json {
        true => serde_json::to_string(report)? + "\n",
        false => format!("{}: {}\n", heading(report), report.state.name()),
    };
    print(text, code)
}

fn refuse(refused: &Refused) -> ExitCode {
    eprintln!("{refused}");
    ExitCode::FAILURE
}

/// The number of a command: that itself, or its name among those that the drive has.
fn number(drive: &mut Drive, command: &str) -> Result<String, CliError> {
    if Id::is_meant(command) {
        return Ok(command.to_owned());
    }
    let list = drive.list(Listing::Commands)?;
    let found = list.parameters.iter().find(|listed| listed.detail("name").eq_ignore_ascii_case(command));
    found.map(|listed| listed.id.clone()).ok_or_else(|| {
        format!(
            "`{}` is neither number nor name of a command: expected one such as S-0-0264 or 1010:01, or a name that \
             `axisbridge param list {} --commands` shows",
            printable(command),
            drive.axis()
        )
        .into()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load() -> CommandReport {
        CommandReport {
            id: "S-0-0262".to_owned(),
            name: Some("Load defaults".to_owned()),
            state: State::Done,
            status: Some("0x0003".to_owned()),
            ..CommandReport::default()
        }
    }

    #[test]
    fn how_a_command_has_ended_is_a_sentence() {
        assert_eq!(sentence(&load(), Ending::Done, 1.26, None), "S-0-0262 Load defaults: done after 1.3 s\n");
        let failed = CommandReport {
            state: State::Failed,
            status: Some("0x000f".to_owned()),
            diagnostic: Some("0x0000f218".to_owned()),
            message: Some("F218 too\u{1b} hot".to_owned()),
            ..load()
        };
        let expected = "S-0-0262 Load defaults: failed after 0.2 s, data status 0x000f\n  diagnostic number   0x0000f218\n  \
                        diagnostic message  F218 too? hot\n";
        assert_eq!(sentence(&failed, Ending::Failed, 0.2, None), expected);
        let open = CommandReport { state: State::InProcess, name: None, ..load() };
        let late = Some("not done within 2 s");
        assert_eq!(
            sentence(&open, Ending::Cancelled, 2.0, late),
            "S-0-0262: not done within 2 s, and cancelled after 2.0 s\n"
        );
        assert_eq!(
            sentence(&open, Ending::NotCancelled, 2.0, late),
            "S-0-0262: not done within 2 s, and not cancelled\n"
        );
    }

    #[test]
    fn a_state_is_an_object_in_a_line() {
        let text = line(&load(), Instant::now(), Some(Ending::Done), None).unwrap();
        let object: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!((&object["state"], &object["result"]), (&"done".into(), &"done".into()), "{text}");
        assert!(object["seconds"].is_number() && text.ends_with("}\n"), "{text}");
    }
}
