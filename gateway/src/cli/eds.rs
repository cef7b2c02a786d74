//! `axisbridge eds`: the electronic data sheets of the devices.

use std::process::ExitCode;

use super::{CliError, EdsArguments, print, usage};
use crate::config::Config;
use crate::engine::build::{Host, adapter_config};

/// What is not in a sheet, and so does not matter.
const NO_HOST: Host = Host { mac: [0; 6], incarnation: 1 };

/// Writes the sheets.
///
/// # Errors
/// The configuration is faulty; the output cannot be written.
pub fn run(arguments: &EdsArguments) -> Result<ExitCode, CliError> {
    let config = Config::load(&arguments.config)?;
    let devices = config.devices.iter().enumerate();
    let wanted = |name: &str| arguments.device.as_deref().is_none_or(|device| device == name);
    let chosen: Vec<_> = devices.filter(|(_, device)| wanted(&device.name)).collect();
    if let (Some(name), []) = (&arguments.device, chosen.as_slice()) {
        return Ok(usage(&format!("there is no device `{name}`; expected one of: {}", names(&config))));
    }
    let sheets = chosen.into_iter().filter_map(|(number, device)| {
        let adapter = adapter_config(&config, number, NO_HOST)?;
        Some((device.name.as_str(), adapter.eds))
    });
    let sheets: Vec<_> = sheets.collect();
    let Some(folder) = &arguments.output else {
        let [(_, sheet)] = sheets.as_slice() else {
            let names = names(&config);
            return Ok(usage(&format!(
                "there are several devices, {names}; name one with --device, or give --output"
            )));
        };
        return print(sheet, ExitCode::SUCCESS);
    };
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for (name, sheet) in sheets {
        let path = folder.join(format!("{name}.eds"));
        std::fs::write(&path, sheet).map_err(|error| format!("{}: {error}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

fn names(config: &Config) -> String {
    config.devices.iter().map(|device| device.name.as_str()).collect::<Vec<_>>().join(", ")
}
