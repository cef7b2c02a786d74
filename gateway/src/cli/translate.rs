//! `axisbridge translate`: what the mapping tables make of frames.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use serde::Serialize;

use super::decode::DictionaryNames;
use super::demo::{self, DriveKind};
use super::{CliError, TranslateArguments, print};
use crate::capture::reader::Reader;
use crate::config::Config;
use crate::mapping::Mapping;
use crate::translate::{List, Node, RowNames, Stage, translate_capture, translate_list};

/// The largest list that is read; a recording is read frame by frame.
const LIST_MAX: u64 = 10 * 1024 * 1024;

/// First bytes of recordings: pcapng, and pcap in both byte orders with micro- and nanoseconds.
const RECORDINGS: [[u8; 4]; 5] = [
    [0x0A, 0x0D, 0x0D, 0x0A],
    [0xA1, 0xB2, 0xC3, 0xD4],
    [0xD4, 0xC3, 0xB2, 0xA1],
    [0xA1, 0xB2, 0x3C, 0x4D],
    [0x4D, 0x3C, 0xB2, 0xA1],
];

/// The JSON object of `--json`.
#[derive(Serialize)]
struct Output<'a> {
    frames: &'a [Node],
    passed_over: usize,
    failed: usize,
    /// Drives whose scaling is that of simulated ones.
    simulated_scaling: Vec<&'a str>,
}

/// Translates and prints.
///
/// # Errors
/// A file is faulty, the drives are not commissioned with the configuration, the output cannot be written.
pub fn run(arguments: &TranslateArguments) -> Result<ExitCode, CliError> {
    let config = configuration(arguments.config.as_deref(), &arguments.drives)?;
    let stage = Arc::new(stage(&config, arguments.values.as_deref())?);
    let list = match (&arguments.hex, &arguments.file) {
        (Some(hex), _) => translate_list(&stage, hex).map_err(|error| format!("--hex:{error}"))?,
        (None, Some(file)) => translated(&stage, &config, file)?,
        // clap lets nothing else through.
        (None, None) => return Err("expected FILE or --hex BYTES".into()),
    };
    let simulated: Vec<&str> = stage.stand_ins().collect();
    if !simulated.is_empty() && !arguments.json {
        eprintln!(
            "the scaling of {} is that of simulated drives; use --values FILE for that of the machine",
            simulated.join(", ")
        );
    }
    let text = if arguments.json {
        let output = Output {
            frames: &list.frames,
            passed_over: list.passed_over,
            failed: list.failed,
            simulated_scaling: simulated,
        };
        serde_json::to_string_pretty(&output)? + "\n"
    } else {
        text(&list, RowNames::Lines)
    };
    print(text, if list.failed > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// The configuration, or that of the demonstration with these drives.
pub(super) fn configuration(path: Option<&Path>, drives: &[DriveKind]) -> Result<Config, CliError> {
    match path {
        Some(path) => Ok(Config::load(path)?),
        None => Ok(Config::parse(&demo::configuration(drives), "the configuration of the demonstration")?),
    }
}

/// The programs of a configuration, with drives that hold these values.
pub(super) fn stage(config: &Config, values: Option<&Path>) -> Result<Stage, CliError> {
    let mapping = Mapping::load(config.mappings_dir.as_deref(), &config.overlays)?;
    let stage = Stage::rehearse(config, mapping)?;
    let Some(path) = values else { return Ok(stage) };
    let shown = path.display();
    let text = list(path)?;
    Ok(stage.with_values(&text).map_err(|error| format!("{shown}:{error}"))?)
}

/// A list of lines.
fn list(path: &Path) -> Result<String, CliError> {
    let shown = path.display();
    let length = std::fs::metadata(path).map_err(|error| format!("{shown}: {error}"))?.len();
    if length > LIST_MAX {
        return Err(format!("{shown}: expected a list of at most {LIST_MAX} bytes, got {length}").into());
    }
    Ok(std::fs::read_to_string(path).map_err(|error| format!("{shown}: {error}"))?)
}

/// A list or a recording, as its first bytes say.
pub(super) fn translated(stage: &Arc<Stage>, config: &Config, path: &Path) -> Result<List, CliError> {
    let shown = path.display();
    let mut file = File::open(path).map_err(|error| format!("{shown}: {error}"))?;
    let mut first = [0; 4];
    let is_recording = io::Read::read_exact(&mut file, &mut first).is_ok() && RECORDINGS.contains(&first);
    drop(file);
    if is_recording {
        let file = File::open(path).map_err(|error| format!("{shown}: {error}"))?;
        let reader = Reader::new(BufReader::new(file)).map_err(|error| format!("{shown}: {error}"))?;
        let names = DictionaryNames(&stage.mapping.dictionaries.sercos);
        return Ok(
            translate_capture(stage, config, reader, &names).map_err(|error| format!("{shown}: {error}"))?
        );
    }
    let text = list(path)?;
    Ok(translate_list(stage, &text).map_err(|error| format!("{shown}:{error}"))?)
}

/// All trees.
pub(super) fn text(list: &List, names: RowNames) -> String {
    let mut text = String::new();
    for frame in &list.frames {
        // Writing to a string does not fail.
        let _ = frame.write(&mut text, 0, names);
    }
    if list.passed_over > 0 {
        text.push_str(&format!("{} frames carry nothing to translate\n", list.passed_over));
    }
    text
}
