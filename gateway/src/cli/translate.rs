//! `axisbridge translate`: what the mapping tables make of frames.

use std::fs::File;
use std::io::{self, BufWriter, IsTerminal as _, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use serde::Serialize;

use super::decode::DictionaryNames;
use super::demo::{self, DriveKind};
use super::progress::Progress;
use super::{CliError, TranslateArguments, written_to_end};
use crate::capture::reader::Reader;
use crate::config::Config;
use crate::decode::Format;
use crate::mapping::Mapping;
use crate::translate::record::{EndRecord, Record, SCHEMA, records, seconds};
use crate::translate::{
    Captured, Counts, Entry, Filter, List, Node, Plot, RowNames, Sink, Stage, translate_capture,
    translate_list_to,
};

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

/// What was translated, and why it ends early if it does.
#[derive(Debug, Default)]
pub(super) struct Translated {
    pub counts: Counts,
    pub error: Option<String>,
    /// Drives whose scaling is that of simulated ones.
    pub stand_ins: Vec<String>,
}

/// Translates and prints.
///
/// # Errors
/// A file is faulty, the drives are not commissioned with the configuration, the output cannot be written.
pub fn run(arguments: &TranslateArguments) -> Result<ExitCode, CliError> {
    let config = configuration(arguments.config.as_deref(), &arguments.drives)?;
    let stage = Arc::new(stage(&config, arguments.values.as_deref())?);
    let mut filter = filter(arguments, &stage)?;
    let last = arguments.count.map_or(u64::MAX, |count| filter.first.saturating_add(count).saturating_sub(1));
    let format = if arguments.json { Format::Json } else { arguments.format };
    let mut output = Output::new(&stage, format, BufWriter::with_capacity(1 << 16, io::stdout().lock()));
    let mut progress = Progress::new(io::stdout().is_terminal());
    let length =
        arguments.file.as_deref().and_then(|file| std::fs::metadata(file).ok()).map_or(0, |file| file.len());
    let mut plot = arguments.plot.as_ref().map(|_| Plot::new(stage.axes.len()));
    output.begin();
    let mut sink = |entry: Entry| {
        progress.at(|| {
            let share = entry.place.offset.saturating_mul(100).checked_div(length).unwrap_or_default();
            format!("frame {}, {share} %", entry.place.number)
        });
        let shown = filter.apply(entry);
        match (&mut plot, shown) {
            (_, None) => {}
            (Some(plot), Some(entry)) => plot.take(&stage, &entry),
            (None, Some(entry)) => output.entry(&entry),
        }
        output.written.is_ok()
    };
    let translated = match (&arguments.hex, &arguments.file) {
        (Some(hex), _) => {
            let counts =
                translate_list_to(&stage, hex, last, &mut sink).map_err(|error| format!("--hex:{error}"))?;
            Translated { counts, error: None, stand_ins: stand_ins(&stage) }
        }
        (None, Some(file)) => translated(&stage, &config, file, last, &mut sink)?,
        // clap lets nothing else through.
        (None, None) => return Err("expected FILE or --hex BYTES".into()),
    };
    progress.clear();
    let Translated { counts, error, stand_ins } = translated;
    match (&arguments.plot, &plot) {
        (Some(path), Some(plot)) => {
            let title = arguments.file.as_deref().map_or("--hex".into(), Path::to_string_lossy);
            let svg = plot.svg(&stage, &title);
            std::fs::write(path, svg).map_err(|error| format!("{}: {error}", path.display()))?;
        }
        _ => output.end(counts, &stand_ins),
    }
    if output.is_text() && !stand_ins.is_empty() {
        eprintln!(
            "the scaling of {} is that of simulated drives; use --values FILE for that of the machine",
            stand_ins.join(", ")
        );
    }
    if let Some(error) = &error {
        eprintln!("{error}");
    }
    // A reader that has seen enough has not seen everything.
    if output.written.is_ok() {
        eprint!("{}", missing(counts));
    }
    let code = if counts.is_complete() && error.is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    written_to_end(output.written, code)
}

/// What is to be shown.
fn filter(arguments: &TranslateArguments, stage: &Stage) -> Result<Filter, CliError> {
    let axis = match &arguments.axis {
        None => None,
        Some(name) => Some(stage.axis(name).ok_or_else(|| {
            let known: Vec<&str> = stage.axes.iter().map(|axis| axis.name.as_str()).collect();
            format!("--axis: expected the name of an axis, one of {}, got `{name}`", known.join(", "))
        })?),
    };
    Ok(Filter::new(arguments.from.max(1), arguments.only.clone(), axis, arguments.changes))
}

/// What is said of frames that were not translated.
pub(super) fn missing(counts: Counts) -> String {
    match counts {
        Counts { failed: 0, translated: 0, .. } => "nothing could be translated\n".to_owned(),
        Counts { failed: 0, .. } => String::new(),
        Counts { failed, translated, .. } => {
            format!("{failed} of {} frames could not be translated\n", failed.saturating_add(translated))
        }
    }
}

/// Prints frames.
struct Output<'s, W> {
    stage: &'s Stage,
    format: Format,
    out: W,
    text: String,
    frames: u64,
    written: io::Result<()>,
}

/// A frame of the JSON document.
#[derive(Serialize)]
struct Frame<'a> {
    frame: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    #[serde(flatten)]
    tree: &'a Node,
    values: Vec<Record<'a>>,
}

impl<'s, W: Write> Output<'s, W> {
    fn new(stage: &'s Stage, format: Format, out: W) -> Self {
        Self { stage, format, out, text: String::new(), frames: 0, written: Ok(()) }
    }

    fn is_text(&self) -> bool {
        self.format == Format::Text
    }

    /// Writes, unless writing has failed before.
    fn write(&mut self, write: impl FnOnce(&mut W) -> io::Result<()>) {
        if self.written.is_ok() {
            self.written = write(&mut self.out);
        }
    }

    fn begin(&mut self) {
        if self.format == Format::Json {
            self.write(|out| write!(out, "{{\"schema\":{SCHEMA},\"frames\":["));
        }
    }

    fn entry(&mut self, entry: &Entry) {
        self.frames += 1;
        let (stage, first) = (self.stage, self.frames == 1);
        match self.format {
            Format::Text => {
                self.text.clear();
                // Writing to a string does not fail.
                let _ = entry.tree.write(&mut self.text, 0, RowNames::Lines);
                if self.written.is_ok() {
                    self.written = self.out.write_all(self.text.as_bytes());
                }
            }
            Format::Json => {
                let mut values = Vec::new();
                records(stage, entry, &mut |record| values.push(record));
                let frame = Frame {
                    frame: entry.place.number,
                    time: seconds(entry.place),
                    tree: &entry.tree,
                    values,
                };
                self.write(|out| {
                    out.write_all(if first { b"\n" } else { b",\n" })?;
                    Ok(serde_json::to_writer(out, &frame)?)
                });
            }
            Format::Ndjson => records(stage, entry, &mut |record| self.line(&record)),
        }
    }

    fn line(&mut self, record: &Record<'_>) {
        self.write(|out| {
            serde_json::to_writer(&mut *out, record)?;
            out.write_all(b"\n")
        });
    }

    fn end(&mut self, counts: Counts, stand_ins: &[String]) {
        let simulated = stand_ins.iter().map(String::as_str).collect();
        match self.format {
            Format::Text => self.write(|out| out.write_all(last_line(counts).as_bytes())),
            Format::Json => {
                let Counts { translated, passed_over, failed } = counts;
                let rest = serde_json::json!({
                    "translated": translated, "passed_over": passed_over, "failed": failed, "simulated_scaling": simulated,
                });
                self.write(|out| writeln!(out, "\n],{}", rest.to_string().trim_start_matches('{')));
            }
            Format::Ndjson => self.line(&Record::End(EndRecord::new(counts, simulated))),
        }
        self.write(W::flush);
    }
}

/// What is said of frames that are not shown.
fn last_line(counts: Counts) -> String {
    match counts.passed_over {
        0 => String::new(),
        passed_over => format!("{passed_over} frames carry nothing to translate\n"),
    }
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

/// A list or a recording, as its first bytes say; a recording up to frame `last`.
pub(super) fn translated(
    stage: &Arc<Stage>,
    config: &Config,
    path: &Path,
    last: u64,
    sink: Sink<'_>,
) -> Result<Translated, CliError> {
    let shown = path.display();
    let mut file = File::open(path).map_err(|error| format!("{shown}: {error}"))?;
    let mut first = [0; 4];
    let is_recording = io::Read::read_exact(&mut file, &mut first).is_ok() && RECORDINGS.contains(&first);
    drop(file);
    if is_recording {
        let reader = Reader::open(path).map_err(|error| format!("{shown}: {error}"))?;
        let names = DictionaryNames(&stage.mapping.dictionaries.sercos);
        let Captured { counts, error, stage } = translate_capture(stage, config, reader, &names, last, sink);
        let error = error.map(|error| format!("{shown}: {error}"));
        return Ok(Translated { counts, error, stand_ins: stand_ins(&stage) });
    }
    let text = list(path)?;
    let counts = translate_list_to(stage, &text, last, sink).map_err(|error| format!("{shown}:{error}"))?;
    Ok(Translated { counts, error: None, stand_ins: stand_ins(stage) })
}

/// Drives whose scaling is that of simulated ones.
fn stand_ins(stage: &Stage) -> Vec<String> {
    stage.stand_ins().map(str::to_owned).collect()
}

/// All trees.
pub(super) fn text(list: &List, names: RowNames) -> String {
    let mut text = String::new();
    for frame in &list.frames {
        // Writing to a string does not fail.
        let _ = frame.write(&mut text, 0, names);
    }
    text + &last_line(list.counts)
}
