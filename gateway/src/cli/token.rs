//! `axisbridge token`: the secret that lets people control axes over HTTP. The file has its hash alone.

use std::io::{self, BufRead as _, ErrorKind, IsTerminal as _, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::path::Path;
use std::process::ExitCode;

use rustix::termios::{LocalModes, OptionalActions, tcgetattr, tcsetattr};

use super::{CliError, TokenArguments, print};
use crate::http::{hash, random_secret};
use crate::replace_file::{create_private, replace_private};

/// Longest line that is read.
const LINE_MAX: u64 = 1_024;

/// Makes or takes a secret, and writes its hash.
///
/// # Errors
/// The secret does not fit, or the file cannot be written.
pub fn run(arguments: &TokenArguments) -> Result<ExitCode, CliError> {
    let path = arguments.output.as_path();
    if !arguments.replace
        && path.try_exists().map_err(|error| format!("cannot look for {}: {error}", path.display()))?
    {
        return Err(exists(path).into());
    }
    let secret = if arguments.own { own()? } else { random_secret() };
    let hash = hash(&secret)?;
    write(path, &format!("{hash}\n"), arguments.replace)?;
    let file = path.display();
    eprintln!("{file}: the hash of the token. The user that runs the gateway has to be able to read it.");
    if arguments.own {
        return Ok(ExitCode::SUCCESS);
    }
    eprintln!("The token, which is shown this once:");
    print(format!("{secret}\n"), ExitCode::SUCCESS)
}

fn exists(path: &Path) -> String {
    format!("{} exists already: replace it with --replace", path.display())
}

/// The secret of a person or a program.
fn own() -> Result<String, CliError> {
    let stdin = io::stdin();
    if !stdin.is_terminal() {
        return line();
    }
    let first = ask("Token: ")?;
    if ask("The same again: ")? != first {
        return Err("the two are not the same".into());
    }
    Ok(first)
}

/// Reads a line from the terminal without showing it.
fn ask(question: &str) -> Result<String, CliError> {
    let stdin = io::stdin();
    let before = tcgetattr(stdin.as_fd())?;
    let mut silent = before.clone();
    silent.local_modes.remove(LocalModes::ECHO);
    eprint!("{question}");
    tcsetattr(stdin.as_fd(), OptionalActions::Flush, &silent)?;
    let read = line();
    tcsetattr(stdin.as_fd(), OptionalActions::Flush, &before)?;
    eprintln!();
    read
}

fn line() -> Result<String, CliError> {
    let mut line = String::new();
    io::stdin().lock().take(LINE_MAX).read_line(&mut line)?;
    Ok(line.trim_end_matches(['\n', '\r']).to_owned())
}

/// Writes a file that only this user can read, as a whole.
fn write(path: &Path, text: &str, replaces: bool) -> Result<(), CliError> {
    let failed = |error: io::Error| match error.kind() {
        ErrorKind::AlreadyExists => exists(path),
        _ => format!("cannot write {}: {error}", path.display()),
    };
    let written = if replaces {
        replace_private(path, text)
    } else {
        create_private(path)
            .and_then(|mut file| file.write_all(text.as_bytes()).and_then(|()| file.sync_all()))
    };
    Ok(written.map_err(failed)?)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;
    use crate::http::Token;

    #[test]
    fn file_has_the_hash_alone_for_its_user_alone_and_is_not_overwritten() {
        let folder = std::env::temp_dir().join(format!("axisbridge-token-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("token");
        let arguments = |replace| TokenArguments { output: path.clone(), own: false, replace };
        run(&arguments(false)).unwrap();
        let first = std::fs::read_to_string(&path).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        assert!(Token::read(&path).is_ok());
        let error = run(&arguments(false)).unwrap_err().to_string();
        assert!(error.ends_with("token exists already: replace it with --replace"), "{error}");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).unwrap();
        run(&arguments(true)).unwrap();
        assert_ne!(std::fs::read_to_string(&path).unwrap(), first);
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
