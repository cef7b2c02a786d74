//! `axisbridge snapshot`: golden texts of translated frames, for the tables of a machine.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use similar::TextDiff;

use super::translate::{configuration, stage, text, translated};
use super::{CliError, SnapshotArguments};
use crate::translate::RowNames;

/// The configuration in a folder of frames.
const CONFIGURATION: &str = "config.toml";

/// Endings of frames, and of golden texts.
const FRAMES: [&str; 3] = ["hex", "pcap", "pcapng"];
const GOLDEN: &str = "golden";

/// Lines around a difference.
const CONTEXT: usize = 3;

/// What became of the files.
#[derive(Debug, Default)]
struct Tally {
    same: usize,
    differ: usize,
    new: usize,
    orphaned: usize,
}

/// Compares, or accepts.
///
/// # Errors
/// The folder or a file cannot be read, a list of frames is faulty, a text cannot be written.
pub fn run(arguments: &SnapshotArguments) -> Result<ExitCode, CliError> {
    let folder = &arguments.folder;
    let own = folder.join(CONFIGURATION);
    let path = arguments.config.clone().or_else(|| own.exists().then_some(own));
    let config = configuration(path.as_deref(), &arguments.drives)?;
    let (frames, golden) = files(folder)?;
    if frames.is_empty() {
        return Err(
            format!("{}: expected files *.hex, *.pcap or *.pcapng, found none", folder.display()).into()
        );
    }
    let stage = Arc::new(stage(&config, arguments.values.as_deref())?);
    let mut tally = Tally::default();
    for path in &frames {
        let list = translated(&stage, &config, path)?;
        let found = text(&list, RowNames::Keys);
        let golden = path.with_extension(GOLDEN);
        let expected = match std::fs::read_to_string(&golden) {
            Ok(expected) => Some(expected),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
            Err(error) => return Err(format!("{}: {error}", golden.display()).into()),
        };
        match &expected {
            Some(expected) if *expected == found => {
                tally.same += 1;
                continue;
            }
            Some(expected) => {
                tally.differ += 1;
                print!("{}", difference(path, expected, &found));
            }
            None => {
                tally.new += 1;
                println!("{}: no {} yet", path.display(), golden.display());
            }
        }
        if arguments.accept {
            std::fs::write(&golden, &found).map_err(|error| format!("{}: {error}", golden.display()))?;
        }
    }
    for path in
        golden.iter().filter(|path| !frames.iter().any(|frames| frames.with_extension(GOLDEN) == **path))
    {
        tally.orphaned += 1;
        println!("{}: it has no frames any more", path.display());
        if arguments.accept {
            std::fs::remove_file(path).map_err(|error| format!("{}: {error}", path.display()))?;
        }
    }
    Ok(finish(&tally, arguments.accept))
}

fn finish(tally: &Tally, accept: bool) -> ExitCode {
    let Tally { same, differ, new, orphaned } = tally;
    println!("{same} the same, {differ} differ, {new} new, {orphaned} without frames");
    if differ + new + orphaned == 0 {
        return ExitCode::SUCCESS;
    }
    if accept {
        println!("accepted");
        return ExitCode::SUCCESS;
    }
    println!("if you meant this change, run again with --accept");
    ExitCode::FAILURE
}

/// The files with frames, and the golden texts, by name.
fn files(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), CliError> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let (mut frames, mut golden) = (Vec::new(), Vec::new());
    for entry in entries {
        let path = entry.map_err(|error| format!("{}: {error}", folder.display()))?.path();
        match path.extension().and_then(OsStr::to_str) {
            Some(ending) if FRAMES.contains(&ending) => frames.push(path),
            Some(GOLDEN) => golden.push(path),
            _ => {}
        }
    }
    frames.sort();
    golden.sort();
    for pair in frames.windows(2) {
        if pair[0].file_stem() == pair[1].file_stem() {
            let (first, second) = (pair[0].display(), pair[1].display());
            return Err(format!("{first} and {second} would have the same golden text").into());
        }
    }
    Ok((frames, golden))
}

/// A difference as a patch has it.
fn difference(path: &Path, expected: &str, found: &str) -> String {
    let diff = TextDiff::from_lines(expected, found);
    let golden = path.with_extension(GOLDEN).display().to_string();
    diff.unified_diff().context_radius(CONTEXT).header(&golden, "as it is now").to_string()
}
