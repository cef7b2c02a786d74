//! `axisbridge snapshot`: golden texts of translated frames, for the tables of a machine.

mod case;
mod report;

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use self::case::{Case, Status};
use super::translate::{Translated, configuration, missing, stage, text, translated};
use super::{CliError, SnapshotArguments, print};
use crate::config::Config;
use crate::mapping::Mapping;
use crate::simulate::drive_events::Script as Events;
use crate::simulate::script::Script;
use crate::translate::scene::{self, Orders};
use crate::translate::{Counts, List, RowNames};

/// The configuration in a folder of frames.
const CONFIGURATION: &str = "config.toml";

/// Endings of frames and of golden texts.
const FRAMES: [&str; 3] = ["hex", "pcap", "pcapng"];
const GOLDEN: &str = "golden";

/// Endings of scripts, and beside them of what happens to the drives and of orders of local control.
const SCENE: &str = "toml";
const EVENTS: &str = "events";
const LOCAL: &str = "local";

/// How the result is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub(super) enum Format {
    /// For people: differences as patches.
    #[default]
    Text,
    /// One JSON object.
    Json,
    /// For the test reports of a code host: a test case for each file.
    Junit,
}

/// Compares, or accepts.
///
/// # Errors
/// A folder or a file cannot be read, a list of frames or a script is faulty, a text cannot be written.
pub fn run(arguments: &SnapshotArguments) -> Result<ExitCode, CliError> {
    let folder = &arguments.folder;
    let own = folder.join(CONFIGURATION);
    let path = arguments.config.clone().or_else(|| own.exists().then_some(own));
    let mut cases = Vec::new();
    let config = configuration(path.as_deref(), &arguments.drives)?;
    compare(folder, &config, arguments.values.as_deref(), &mut cases)?;
    for folder in sub_folders(folder)? {
        let config = configuration(Some(&folder.join(CONFIGURATION)), &[])?;
        compare(&folder, &config, None, &mut cases)?;
    }
    if cases.iter().all(|case| case.status == Status::Orphaned) {
        let expected = "expected files *.hex, *.pcap, *.pcapng or *.toml, found none";
        return Err(format!("{}: {expected}", folder.display()).into());
    }
    if arguments.accept {
        for case in &mut cases {
            case.accept(arguments.with_errors)?;
        }
    }
    let refused: Vec<&Case> = cases.iter().filter(|case| case.refused).collect();
    for case in &refused {
        let why = Some(missing(case.counts)).filter(|why| !why.is_empty());
        let why = why.unwrap_or_else(|| "more errors than in the golden text\n".to_owned());
        eprint!("{}: not accepted: {why}", case.file.display());
    }
    let code = match cases.iter().all(Case::is_fine) {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    };
    let text = match arguments.format {
        Format::Text => text_of(&cases, arguments.accept),
        Format::Json => format!("{:#}\n", report::json(&cases)),
        Format::Junit => report::junit(folder, &cases),
    };
    print(text, code)
}

/// Compares what is in a folder.
fn compare(
    folder: &Path,
    config: &Config,
    values: Option<&Path>,
    cases: &mut Vec<Case>,
) -> Result<(), CliError> {
    let (frames, golden) = files(folder)?;
    // Lists need the drives, a scene brings its own.
    let mut rehearsed = None;
    for path in &frames {
        let mut case = if path.extension() == Some(OsStr::new(SCENE)) {
            Case::new(path, scene(config, path)?, None, Counts { translated: 1, ..Counts::default() })
        } else {
            let stage = match &rehearsed {
                Some(stage) => stage,
                None => rehearsed.insert(Arc::new(stage(config, values)?)),
            };
            let mut ended = None;
            let list = List::of(|sink| {
                let Translated { counts, error, .. } = translated(stage, config, path, u64::MAX, sink)?;
                ended = error;
                Ok::<_, CliError>(counts)
            })?;
            let (mut found, mut rows) = (text(&list, RowNames::Keys), text(&list, RowNames::Lines));
            let mut counts = list.counts;
            if let Some(error) = ended {
                counts.failed += 1;
                // The path is not the same everywhere.
                let error = error.rsplit_once(": offset ").map_or(error.as_str(), |(_, error)| error);
                for text in [&mut found, &mut rows] {
                    *text += &format!("error: the recording ends at offset {error}\n");
                }
            }
            Case::new(path, found, Some(&rows), counts)
        };
        case.compare()?;
        cases.push(case);
    }
    let is_orphan = |path: &&PathBuf| !frames.iter().any(|frames| frames.with_extension(GOLDEN) == **path);
    cases.extend(golden.iter().filter(is_orphan).map(|path| Case::orphan(path)));
    Ok(())
}

/// The text of a scene: a script, with events of the drives and orders of local control in files beside it if there are any.
fn scene(config: &Config, path: &Path) -> Result<String, CliError> {
    let mapping = Mapping::load(config.mappings_dir.as_deref(), &config.overlays)?;
    let script = Script::load(path, &mapping)?;
    let events = path.with_extension(EVENTS);
    let events = match events.exists() {
        true => Events::load(&events, &scene::names(config))?,
        false => Events::default(),
    };
    let local = path.with_extension(LOCAL);
    let orders = match local.exists() {
        true => Orders::parse(&std::fs::read_to_string(&local)?, config)
            .map_err(|error| format!("{}:{error}", local.display()))?,
        false => Orders::default(),
    };
    let played = scene::play(config, mapping, &script, events, orders);
    Ok(played.map_err(|error| format!("{}: {error}", path.display()))?)
}

/// Folders in a folder that have a configuration of their own, by name.
fn sub_folders(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let mut folders = entries(folder)?;
    folders.retain(|path| path.join(CONFIGURATION).exists());
    folders.sort();
    Ok(folders)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let failed = |error| format!("{}: {error}", folder.display());
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let paths: std::io::Result<_> = entries.map(|entry| entry.map(|entry| entry.path())).collect();
    Ok(paths.map_err(failed)?)
}

/// What is printed for people.
fn text_of(cases: &[Case], accept: bool) -> String {
    let mut text = String::new();
    let count = |status| cases.iter().filter(|case| case.status == status).count();
    for case in cases {
        // Writing to a string does not fail.
        let _ = case.write(&mut text);
    }
    let (same, differ) = (count(Status::Same), count(Status::Differs));
    let (new, orphaned) = (count(Status::New), count(Status::Orphaned));
    let _ = writeln!(text, "{same} the same, {differ} differ, {new} new, {orphaned} without frames");
    text + match (differ + new + orphaned, accept) {
        (0, _) => "",
        (_, true) if cases.iter().any(|case| case.refused) => {
            "accepted, but for what could not be translated\n"
        }
        (_, true) => "accepted\n",
        (_, false) => "if you meant this change, run again with --accept\n",
    }
}

/// The files with frames and scenes, and the golden texts, by name.
fn files(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), CliError> {
    let (mut frames, mut golden) = (Vec::new(), Vec::new());
    for path in entries(folder)? {
        match path.extension().and_then(OsStr::to_str) {
            Some(SCENE) if path.file_name() == Some(OsStr::new(CONFIGURATION)) => {}
            Some(ending) if ending == SCENE || FRAMES.contains(&ending) => frames.push(path),
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
