//! `axisbridge param`: the parameters of a drive, through a running gateway and its local socket, or without one.

mod alone;
mod backup;
mod command;
mod compare;
mod drive;
mod file;
mod restore;
mod show;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};

use self::drive::{Drive, Found};
use super::{CliError, print};
use crate::local::drive::job::Listing;

/// What `param` does.
#[derive(Debug, Subcommand)]
pub enum ParamCommand {
    /// List the parameters that are known of a drive, and say where the list is from.
    List(ListArguments),
    /// Read parameters: value, name, unit, limits and type.
    Read(ReadArguments),
    /// Write a parameter, read it back and compare. Only while nobody controls the axis and the drive has no torque.
    Write(WriteArguments),
    /// Write all parameters of the drive's backup list to a file, with the identity of the drive.
    Backup(BackupArguments),
    /// Write the parameters of a backup to a drive where they differ.
    Restore(RestoreArguments),
    /// Compare a drive with a backup. Exit status 1 if they differ.
    Compare(CompareArguments),
    /// Execute a procedure command of the drive, show how far it is, and what came of it. Exit status 0 only if it is done.
    Command(CommandArguments),
}

/// The axis, and the gateway.
#[derive(Debug, Args)]
pub struct At {
    /// The axis whose drive is meant, by its name in the configuration.
    axis: String,
    /// The Unix socket of the running gateway (`run --local`).
    #[arg(long, value_name = "SOCKET", default_value = "/run/axisbridge/local")]
    local: PathBuf,
    /// Without a gateway: over the bus of the configuration, which must have no master. No axis can be enabled.
    #[arg(long, requires = "config", conflicts_with = "local")]
    alone: bool,
    /// The configuration, for --alone.
    #[arg(long, value_name = "FILE", requires = "alone")]
    config: Option<PathBuf>,
}

/// Arguments of `param list`.
#[derive(Debug, Args)]
pub struct ListArguments {
    #[command(flatten)]
    at: At,
    /// Only the parameters of a backup.
    #[arg(long)]
    backup: bool,
    /// Only procedure commands.
    #[arg(long, conflicts_with = "backup")]
    commands: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Arguments of `param read`.
#[derive(Debug, Args)]
pub struct ReadArguments {
    #[command(flatten)]
    at: At,
    /// Parameters: a name of the tables, an IDN (S-0-0100), an object (6081h, 0x60C2.1) or a path (class.instance.attribute).
    #[arg(required = true)]
    parameter: Vec<String>,
    /// Print one JSON object a parameter and line.
    #[arg(long)]
    json: bool,
}

/// Arguments of `param write`.
#[derive(Debug, Args)]
pub struct WriteArguments {
    #[command(flatten)]
    at: At,
    /// The parameter, as for `param read`.
    parameter: String,
    /// The value, as `param read` shows it; hex:BYTES for bytes in the drive's order; u16:5, i32:-7 and so on for an object whose
    /// type is not known.
    #[arg(allow_hyphen_values = true)]
    value: String,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Arguments of `param backup`.
#[derive(Debug, Args)]
pub struct BackupArguments {
    #[command(flatten)]
    at: At,
    /// The file (TOML) to write.
    file: PathBuf,
}

/// Arguments of `param restore`.
#[derive(Debug, Args)]
pub struct RestoreArguments {
    #[command(flatten)]
    at: At,
    /// The file of `param backup`.
    file: PathBuf,
    /// Restore although the backup is of another type of drive.
    #[arg(long)]
    force: bool,
}

/// Arguments of `param compare`.
#[derive(Debug, Args)]
pub struct CompareArguments {
    #[command(flatten)]
    at: At,
    /// The file of `param backup`.
    file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Arguments of `param command`.
#[derive(Debug, Args)]
pub struct CommandArguments {
    #[command(flatten)]
    at: At,
    /// The command: an IDN (S-0-0264), an object (1010:01 stores parameters, 1011:01 restores defaults), or its name.
    command: String,
    /// Cancel it when it is not done after this time, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u16).range(1..))]
    time_limit: u16,
    /// Cancel the command instead of starting it.
    #[arg(long)]
    cancel: bool,
    /// Print one JSON object for each state, and line.
    #[arg(long)]
    json: bool,
}

/// Runs a command.
///
/// # Errors
/// No gateway answers, or a file cannot be read or written.
pub fn run(command: &ParamCommand) -> Result<ExitCode, CliError> {
    match command {
        ParamCommand::List(arguments) => list(arguments),
        ParamCommand::Read(arguments) => read(arguments),
        ParamCommand::Write(arguments) => write(arguments),
        ParamCommand::Backup(arguments) => backup::run(arguments),
        ParamCommand::Restore(arguments) => restore::run(arguments),
        ParamCommand::Compare(arguments) => compare::run(arguments),
        ParamCommand::Command(arguments) => command::run(arguments),
    }
}

fn list(arguments: &ListArguments) -> Result<ExitCode, CliError> {
    let of = match (arguments.backup, arguments.commands) {
        (true, _) => Listing::Backup,
        (_, true) => Listing::Commands,
        _ => Listing::All,
    };
    let list = Drive::connect(&arguments.at)?.list(of)?;
    let text = if arguments.json { show::list_json(&list)? } else { show::list(&list) };
    print(text, ExitCode::SUCCESS)
}

fn read(arguments: &ReadArguments) -> Result<ExitCode, CliError> {
    let mut drive = Drive::connect(&arguments.at)?;
    let mut text = String::new();
    let mut code = ExitCode::SUCCESS;
    for parameter in &arguments.parameter {
        match drive.read(parameter, false)? {
            Found::Report(report) if arguments.json => text += &show::json(&report)?,
            Found::Report(report) => text += &show::parameter(&report),
            Found::Refused(refused) => {
                eprintln!("{refused}");
                code = ExitCode::FAILURE;
            }
        }
    }
    print(text, code)
}

fn write(arguments: &WriteArguments) -> Result<ExitCode, CliError> {
    let mut drive = Drive::connect(&arguments.at)?;
    match drive.write(&arguments.parameter, &arguments.value)? {
        Found::Report(report) if arguments.json => print(show::json(&report)?, ExitCode::SUCCESS),
        Found::Report(report) => print(show::written(&report), ExitCode::SUCCESS),
        Found::Refused(refused) => {
            eprintln!("{refused}");
            Ok(ExitCode::FAILURE)
        }
    }
}
