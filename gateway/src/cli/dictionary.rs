//! `axisbridge dictionary`: prints what a profile has, as the tables say it.

mod cip;
mod sheet;
mod south;

use std::io::{self, BufWriter, Write};
use std::process::ExitCode;

use super::{CliError, DictionaryArguments, DictionaryFormat, DictionaryPart, DictionaryProfile};
use crate::mapping::{Dictionaries, Mapping};
use sheet::Sheet;

/// Exit status of a wrong command line, as clap has it.
const USAGE: u8 = 2;

/// Prints to standard output.
///
/// # Errors
/// The tables are wrong; the output cannot be written.
pub fn run(arguments: &DictionaryArguments) -> Result<ExitCode, CliError> {
    print(arguments, &mut BufWriter::new(io::stdout().lock()))
}

fn print(arguments: &DictionaryArguments, out: &mut dyn Write) -> Result<ExitCode, CliError> {
    let mapping = match &arguments.mappings {
        Some(folder) => Mapping::from_folder(folder),
        None => Mapping::embedded(),
    };
    let mapping = mapping.map_err(|errors| errors.to_string())?;
    let sheet = match sheet(&mapping.dictionaries, arguments.profile, arguments.part) {
        Ok(sheet) => sheet,
        Err(message) => {
            eprintln!("error: {message}");
            return Ok(ExitCode::from(USAGE));
        }
    };
    let written = match arguments.format {
        DictionaryFormat::Csv => sheet.write_csv(&mut *out),
        DictionaryFormat::Json => sheet.write_json(&mut *out),
    };
    match written.and_then(|()| out.flush()) {
        Ok(()) => Ok(ExitCode::SUCCESS),
        // Whoever reads has seen enough, as `head` has.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(ExitCode::SUCCESS),
        Err(error) => Err(format!("cannot write: {error}").into()),
    }
}

/// What is asked for, or why there is no such thing.
fn sheet(
    dictionaries: &Dictionaries,
    profile: DictionaryProfile,
    part: Option<DictionaryPart>,
) -> Result<Sheet, String> {
    use DictionaryPart::{Class, Enums, Faults, Instance, Networks, Services};
    let part = part.unwrap_or(Instance);
    Ok(match (profile, part) {
        (DictionaryProfile::Cip, Instance) => cip::instance(&dictionaries.cip),
        (DictionaryProfile::Cip, Class) => cip::class(&dictionaries.cip),
        (DictionaryProfile::Cip, Enums) => cip::enums(&dictionaries.cip),
        (DictionaryProfile::Cip, Services) => cip::services(&dictionaries.cip),
        (DictionaryProfile::Cip, Networks) => cip::networks(&dictionaries.cip),
        (DictionaryProfile::Cip, Faults) => cip::faults(&dictionaries.cip),
        (DictionaryProfile::Sercos, Instance) => south::idns(&dictionaries.sercos),
        (DictionaryProfile::Sercos, Enums) => south::codes(&dictionaries.sercos),
        (DictionaryProfile::Generic, Instance) => south::generic(&dictionaries.generic),
        (DictionaryProfile::Sercos, _) => return Err(no_part("sercos", part, "instance, enums")),
        (DictionaryProfile::Generic, _) => return Err(no_part("generic", part, "instance")),
    })
}

fn no_part(profile: &str, part: DictionaryPart, parts: &str) -> String {
    format!("the {profile} dictionary has no part `{}`; expected one of: {parts}", part.name())
}
