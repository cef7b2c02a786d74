//! `axisbridge manual`: manual pages and shell completions, made from the definition of the command line.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use clap::CommandFactory as _;
use clap_complete::Shell;

use super::{Cli, CliError, ManualArguments};

/// Where each shell of Debian looks for completions, below `/usr`.
const COMPLETIONS: [(Shell, &str); 3] = [
    (Shell::Bash, "share/bash-completion/completions/axisbridge"),
    (Shell::Zsh, "share/zsh/vendor-completions/_axisbridge"),
    (Shell::Fish, "share/fish/vendor_completions.d/axisbridge.fish"),
];

/// Writes all of it below the folder.
///
/// # Errors
/// A file or folder cannot be written.
pub fn run(arguments: &ManualArguments) -> Result<ExitCode, CliError> {
    let folder = &arguments.folder;
    let failed = |path: &Path, error| format!("cannot write {}: {error}", path.display());
    let create = |path: &Path| fs::create_dir_all(path).map_err(|error| failed(path, error));
    let pages = folder.join("share/man/man1");
    create(&pages)?;
    clap_mangen::generate_to(Cli::command(), &pages).map_err(|error| failed(&pages, error))?;
    for (shell, place) in COMPLETIONS {
        let path = folder.join(place);
        path.parent().map_or(Ok(()), create)?;
        let mut text = Vec::new();
        clap_complete::generate(shell, &mut Cli::command(), "axisbridge", &mut text);
        fs::write(&path, text).map_err(|error| failed(&path, error))?;
    }
    Ok(ExitCode::SUCCESS)
}
