//! `axisbridge dictionary`: prints what a profile has, as the tables say it.

mod cia402;
mod cip;
mod generic;
mod sercos;
mod sheet;

use std::io::{self, BufWriter, Write};
use std::process::ExitCode;

use super::{CliError, DictionaryArguments, DictionaryFormat, DictionaryPart, DictionaryProfile, usage};
use crate::mapping::{IdnPart, Mapping};
use sheet::Sheet;

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
    let sheet = match sheet(&mapping, arguments.profile, arguments.part) {
        Ok(sheet) => sheet,
        Err(message) => return Ok(usage(&message)),
    };
    let written = match arguments.format {
        DictionaryFormat::Csv => sheet.write_csv(&mut *out),
        DictionaryFormat::Json => sheet.write_json(&mut *out),
    };
    match written.and_then(|()| out.flush()) {
        Ok(()) => Ok(ExitCode::SUCCESS),
        // The reader has closed the pipe, as `head` does: it has seen enough.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(ExitCode::SUCCESS),
        Err(error) => Err(format!("cannot write: {error}").into()),
    }
}

/// What is asked for, or why there is no such thing.
fn sheet(
    mapping: &Mapping,
    profile: DictionaryProfile,
    part: Option<DictionaryPart>,
) -> Result<Sheet, String> {
    use DictionaryPart::{
        Bits, Class, Codes, Communication, Enums, Faults, Idns, Instance, Networks, Objects, Services,
    };
    let dictionaries = &mapping.dictionaries;
    Ok(match (profile, part) {
        (DictionaryProfile::Cip, None | Some(Instance)) => cip::instance(&dictionaries.cip),
        (DictionaryProfile::Cip, Some(Class)) => cip::class(&dictionaries.cip),
        (DictionaryProfile::Cip, Some(Enums)) => cip::enums(&dictionaries.cip),
        (DictionaryProfile::Cip, Some(Services)) => cip::services(&dictionaries.cip),
        (DictionaryProfile::Cip, Some(Networks)) => cip::networks(&dictionaries.cip),
        (DictionaryProfile::Cip, Some(Faults)) => cip::faults(&dictionaries.cip),
        (DictionaryProfile::Sercos, None) => sercos::idns(&dictionaries.sercos, None),
        (DictionaryProfile::Sercos, Some(Idns)) => sercos::idns(&dictionaries.sercos, Some(IdnPart::Profile)),
        (DictionaryProfile::Sercos, Some(Communication)) => {
            sercos::idns(&dictionaries.sercos, Some(IdnPart::Communication))
        }
        (DictionaryProfile::Sercos, Some(Bits)) => sercos::bits(&dictionaries.sercos),
        (DictionaryProfile::Sercos, Some(Codes)) => sercos::codes(&dictionaries.sercos),
        (DictionaryProfile::Cia402, None | Some(Objects)) => cia402::objects(&dictionaries.cia402),
        (DictionaryProfile::Cia402, Some(Codes)) => cia402::codes(&dictionaries.cia402),
        (DictionaryProfile::Generic, None | Some(Instance)) => generic::instance(mapping),
        (_, Some(part)) => return Err(no_part(profile, part)),
    })
}

fn no_part(profile: DictionaryProfile, part: DictionaryPart) -> String {
    let (name, parts) = match profile {
        DictionaryProfile::Cip => ("cip", "instance, class, enums, services, networks, faults"),
        DictionaryProfile::Sercos => ("sercos", "idns, communication, bits, codes"),
        DictionaryProfile::Cia402 => ("cia402", "objects, codes"),
        DictionaryProfile::Generic => ("generic", "instance"),
    };
    format!("the {name} dictionary has no part `{}`; expected one of: {parts}", part.name())
}
