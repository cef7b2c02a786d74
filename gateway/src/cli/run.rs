//! `axisbridge run`: the box.

use std::cell::RefCell;
use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tracing::{error, info, warn};
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::util::SubscriberInitExt as _;
use tracing_subscriber::{Registry, reload};

use super::service_manager::ServiceManager;
use super::{CliError, RunArguments, has_colours};
use crate::bundle::Files;
use crate::check::{Request, check};
use crate::config::{Config, LogLevel};
use crate::finding::{Finding, Findings, Severity};
use crate::history::{EventRing, Histories, LinesOf, RingLayer};
use crate::mapping::Mapping;
use crate::runner;
use crate::settings::Store;
use crate::sys::memory::return_large_blocks;

/// How often the box is looked after.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// Runs the box until it is asked to end.
pub fn run(arguments: &RunArguments) -> Result<ExitCode, CliError> {
    return_large_blocks();
    let (mut good, findings) = read(&arguments.config).map_err(|findings| refusal(&findings))?;
    let events = Arc::new(EventRing::default());
    let log = Log::to_stderr(good.config.log_level, &events);
    let in_memory = Histories { events: Arc::clone(&events), ..Histories::default() };
    tell(&findings);
    // They have the texts of all tables, megabytes that would stay in memory while the gateway runs.
    drop(findings);
    let [stop, hurry] = super::signal::stop_and_hurry_on_signals()?;
    let asked = Asked { stop, hurry, reload: super::signal::reload_on_hang_up()? };
    info!(name = good.config.name, version = env!("CARGO_PKG_VERSION"), "axisbridge starts");
    let manager = RefCell::new(ServiceManager::of_environment(Instant::now()));
    let mut settings = Store::open(good.config.settings_file.as_deref()).map(Arc::new)?;
    // What ran before files were read again.
    let mut before = None;
    let mut number = 1;
    loop {
        log.set_level(good.config.log_level);
        let directory = good.config.history_dir.as_deref();
        let histories = directory.map_or_else(|| in_memory.clone(), |path| in_memory.kept_in(path));
        // A pipe takes all runs.
        let of_run = |path: &Path| if path.is_file() { capture_of(path, number) } else { path.to_owned() };
        let capture = arguments.capture.as_deref().map(of_run);
        number += 1;
        let outputs = Outputs { capture: capture.as_deref(), histories: &histories };
        let running = match (start(&good, arguments, &outputs, &mut settings), before.take()) {
            (Ok(running), _) => running,
            (Err(error), None) => return Err(error),
            (Err(error), Some(previous)) => {
                error!("the gateway cannot start with the new configuration: {error}");
                warn!("the gateway starts with the configuration that it had before");
                (good, settings) = previous;
                continue;
            }
        };
        match run_once(running, arguments, &asked, &manager)? {
            After::End { rested: true } => return Ok(ExitCode::SUCCESS),
            After::End { rested: false } => return Ok(ExitCode::FAILURE),
            After::Again(None) => {}
            After::Again(Some(next)) => {
                before = Some((std::mem::replace(&mut good, *next), Arc::clone(&settings)));
            }
        }
    }
}

/// The recording of a run of the gateway: from the second on with its number, so that a restart erases none.
fn capture_of(path: &Path, number: u32) -> PathBuf {
    if number == 1 {
        return path.to_owned();
    }
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!(".{number}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Where a run of the gateway writes.
struct Outputs<'a> {
    capture: Option<&'a Path>,
    histories: &'a Histories,
}

/// A configuration and its tables, without errors.
struct Good {
    config: Config,
    mapping: Mapping,
    files: Files,
}

/// What the box is asked for from outside.
struct Asked {
    stop: Arc<AtomicBool>,
    /// To end without waiting for axes.
    hurry: Arc<AtomicBool>,
    reload: Arc<AtomicBool>,
}

/// What comes after a run of the box.
enum After {
    /// Nothing.
    End {
        /// Every axis stands.
        rested: bool,
    },
    /// Another run, with other files where some were read.
    Again(Option<Box<Good>>),
}

/// Reads the configuration and its tables, as `check` does.
fn read(path: &Path) -> Result<(Good, Findings), Findings> {
    let outcome = check(&Request { config: Some(path), mappings: &[], frames: false });
    match (outcome.config, outcome.tables.mapping) {
        (Some(config), Some(mapping)) if !outcome.tables.findings.has_errors() => {
            let findings = outcome.tables.findings;
            let configuration = outcome.text.map_or_else(String::new, |text| text.to_string());
            let files = Files { configuration, findings: lines(&findings) };
            Ok((Good { config, mapping, files }, findings))
        }
        _ => Err(outcome.tables.findings),
    }
}

/// The findings, one a line.
fn lines(findings: &Findings) -> String {
    findings.list().iter().map(|finding| format!("{finding}\n")).collect()
}

/// Why the files are refused, with what else asks for something; notes on tables as they are shipped are for `check`.
fn refusal(findings: &Findings) -> String {
    findings.shown(has_colours(&std::io::stderr()), Finding::asks)
}

/// Logs warnings; notes are for `check`.
fn tell(findings: &Findings) {
    for finding in findings.list().iter().filter(|finding| finding.severity() == Severity::Warning) {
        warn!("{finding}");
    }
}

/// Starts the box with the settings of its file, or with these.
fn start(
    good: &Good,
    arguments: &RunArguments,
    outputs: &Outputs<'_>,
    settings: &mut Arc<Store>,
) -> Result<runner::RunningBox, CliError> {
    *settings = settings.reopen(good.config.settings_file.as_deref())?;
    let extras = runner::Extras {
        capture: outputs.capture,
        local: arguments.local.as_deref(),
        histories: Some(outputs.histories),
        files: Some(&good.files),
    };
    Ok(runner::start(&good.config, good.mapping.clone(), extras, settings)?)
}

/// Runs the box once. Files that are read again and refused leave it as it is.
fn run_once(
    running: runner::RunningBox,
    arguments: &RunArguments,
    asked: &Asked,
    manager: &RefCell<ServiceManager>,
) -> Result<After, CliError> {
    let (next, reloads) = attend(&running, arguments, asked, manager)?;
    let stops = asked.stop.load(Ordering::Relaxed);
    info!(
        "axisbridge stops: the axes stop, then the bus goes down; a second signal ends the wait for the axes"
    );
    if stops {
        manager.borrow_mut().stopping();
    }
    let rested = stop(running, asked, manager);
    if stops {
        return Ok(After::End { rested });
    }
    let why = if reloads {
        "configuration and tables were read again"
    } else {
        "a controller has reset the Identity object"
    };
    info!(why, "axisbridge restarts");
    Ok(After::Again(next))
}

/// Stays with a running gateway until it is to stop or to start again; the files that were read again, and whether they are why.
fn attend(
    running: &runner::RunningBox,
    arguments: &RunArguments,
    asked: &Asked,
    manager: &RefCell<ServiceManager>,
) -> Result<(Option<Box<Good>>, bool), CliError> {
    let mut told = false;
    let mut next = None;
    let mut reloads = false;
    while !asked.stop.load(Ordering::Relaxed) && !running.wants_restart() && !reloads {
        std::thread::sleep(LOOK_INTERVAL);
        manager.borrow_mut().look(Instant::now(), || running.status());
        if !told {
            told = true;
            let refused = running.realtime_report();
            if !refused.is_empty() {
                warn!(refused, "the kernel refused real-time settings of the cycle thread");
            }
        }
        if running.is_dead() {
            return Err("the cycle thread has ended by itself; see above".into());
        }
        if asked.reload.swap(false, Ordering::Relaxed) {
            (next, reloads) = replace(next, reload(&arguments.config), running.has_torque());
        }
    }
    Ok((next, reloads))
}

/// Stops a gateway, and logs what is missing; whether every axis stands.
fn stop(running: runner::RunningBox, asked: &Asked, manager: &RefCell<ServiceManager>) -> bool {
    let status = running.reader();
    // The wait for the axes can be longer than a watchdog is patient.
    let stopped = running.stop(&|| {
        manager.borrow_mut().look(Instant::now(), || status.read());
        asked.hurry.load(Ordering::Relaxed)
    });
    stopped.unrested.iter().for_each(|axis| error!("{axis}"));
    match stopped.recording {
        Some(Ok(dropped)) if dropped > 0 => warn!(dropped, "frames are missing in the recording"),
        Some(Err(error)) => warn!(%error, "the recording has ended early"),
        _ => {}
    }
    stopped.unrested.is_empty()
}

/// What takes effect at the next start once the files were read again, and whether that start is now. Files that are refused never put
/// those into operation that were read before them.
fn replace<T>(before: Option<T>, read: Option<T>, has_torque: bool) -> (Option<T>, bool) {
    match (&read, before) {
        (Some(_), _) if has_torque => {
            info!("an axis has torque: the new configuration takes effect at the next start");
        }
        (None, Some(_)) => {
            warn!("the configuration that was to take effect at the next start is not used either");
        }
        _ => {}
    }
    let starts = read.is_some() && !has_torque;
    (read, starts)
}

/// Reads the files again; `None` when they are refused, or the file of the settings could not be used at the start.
fn reload(path: &Path) -> Option<Box<Good>> {
    let refused = || warn!("configuration and tables are refused: the gateway keeps the present ones");
    let (good, findings) = match read(path) {
        Ok(read) => read,
        Err(findings) => {
            let errors = findings.list().iter().filter(|finding| finding.severity() == Severity::Error);
            errors.for_each(|finding| error!("{finding}"));
            refused();
            return None;
        }
    };
    if let Err(error) = Store::open(good.config.settings_file.as_deref()) {
        error!("{error}");
        refused();
        return None;
    }
    info!(file = %path.display(), "configuration and tables were read again, without errors");
    tell(&findings);
    Some(Box::new(good))
}

/// What is logged: what `wanted` says (`debug`, or `info,axisbridge::modbus=trace`), or else the level of the file; and why not what is wanted. The
/// PTP library has lines for each message, which nobody needs who does not ask for them.
fn filter(level: LogLevel, wanted: Option<&str>) -> (Targets, Option<String>) {
    let least = match level {
        LogLevel::Error => LevelFilter::ERROR,
        LogLevel::Warn => LevelFilter::WARN,
        LogLevel::Info => LevelFilter::INFO,
        LogLevel::Debug => LevelFilter::DEBUG,
        LogLevel::Trace => LevelFilter::TRACE,
    };
    let own = Targets::new().with_default(least).with_target("statime", least.min(LevelFilter::WARN));
    match wanted.filter(|wanted| !wanted.trim().is_empty()).map(targets) {
        None => (own, None),
        Some(Ok(wanted)) => (wanted, None),
        Some(Err(error)) => (own, Some(format!("RUST_LOG is not used: {error}"))),
    }
}

/// Levels of parts of the program; one without a part is that of all others. The library takes a word that is no level for a part.
fn targets(wanted: &str) -> Result<Targets, String> {
    let mut parts = wanted.split(',').map(str::trim).filter(|part| !part.is_empty());
    parts.try_fold(Targets::new(), |targets, part| {
        let (target, level) = match part.split_once('=') {
            Some((target, level)) => (Some(target.trim()), level.trim()),
            None => (None, part),
        };
        let is_path = |target: &str| target.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == ':');
        let is_good = target.is_none_or(|target| !target.is_empty() && is_path(target)) && !level.is_empty();
        let level = level.parse::<LevelFilter>().ok().filter(|_| is_good);
        let level = level.ok_or_else(|| {
            format!("`{part}`: expected a level, or a part of the program with a level, as in `info,axisbridge::modbus=trace`")
        })?;
        Ok(match target {
            Some(target) => targets.with_target(target, level),
            None => targets.with_default(level),
        })
    })
}

/// The log of the process.
struct Log {
    filter: reload::Handle<Targets, Registry>,
    /// The environment variable `RUST_LOG`, which overrides the level of the file.
    wanted: Option<String>,
}

impl Log {
    /// Logs to standard error, and into the ring.
    fn to_stderr(level: LogLevel, ring: &Arc<EventRing>) -> Self {
        let wanted = std::env::var_os("RUST_LOG").map(|wanted| wanted.to_string_lossy().into_owned());
        let (filter, refused) = filter(level, wanted.as_deref());
        let (filter, handle) = reload::Layer::new(filter);
        let lines = tracing_subscriber::fmt::layer()
            .fmt_fields(LinesOf)
            .with_writer(std::io::stderr)
            .with_target(false);
        // A log file or a journal has no colours.
        let lines = lines.with_ansi(std::io::stderr().is_terminal());
        // The filter is that of both, so that the ring has what is logged.
        let logger =
            tracing_subscriber::registry().with(filter).with(lines).with(RingLayer::new(Arc::clone(ring)));
        // Refused only when a logger is set already.
        let _ = logger.try_init();
        if let Some(refused) = refused {
            error!("{refused}");
        }
        Self { filter: handle, wanted }
    }

    /// Logs from now on what a file with this level says.
    fn set_level(&self, level: LogLevel) {
        let (filter, _) = filter(level, self.wanted.as_deref());
        // Refused only when the logger was not set.
        let _ = self.filter.reload(filter);
    }
}

#[cfg(test)]
mod tests {
    use tracing::Level;

    use super::*;

    #[test]
    fn recording_of_a_later_run_has_its_number() {
        for (path, number, expected) in [
            ("/tmp/box.pcapng", 1, "/tmp/box.pcapng"),
            ("/tmp/box.pcapng", 2, "/tmp/box.2.pcapng"),
            ("box", 12, "box.12"),
        ] {
            assert_eq!(capture_of(Path::new(path), number), Path::new(expected));
        }
    }

    #[test]
    fn refused_files_start_nothing_and_drop_what_waited_for_the_next_start() {
        for (before, read, torque, next, starts) in [
            (None, Some(2), false, Some(2), true),
            (None, Some(2), true, Some(2), false),
            (Some(1), Some(2), true, Some(2), false),
            (Some(1), Some(2), false, Some(2), true),
            (Some(1), None, false, None, false),
            (Some(1), None, true, None, false),
            (None, None, false, None, false),
        ] {
            assert_eq!(replace(before, read, torque), (next, starts), "{before:?} {read:?} {torque}");
        }
    }

    #[test]
    fn file_or_variable_says_what_is_logged_and_a_wrong_variable_is_said() {
        let logged = |level, wanted, target| {
            let (filter, refused) = filter(level, wanted);
            let levels = [Level::ERROR, Level::WARN, Level::INFO, Level::DEBUG, Level::TRACE];
            (levels.iter().filter(|level| filter.would_enable(target, level)).count(), refused)
        };
        for (place, level) in LogLevel::ALL.into_iter().enumerate() {
            assert_eq!(logged(level, None, "axisbridge::runner"), (place + 1, None));
            assert_eq!(logged(level, Some(" "), "statime::port"), ((place + 1).min(2), None));
        }
        assert_eq!(logged(LogLevel::Error, Some("debug"), "statime::port"), (4, None));
        for wanted in ["warn,axisbridge::modbus=trace", " warn , axisbridge::modbus = TRACE,"] {
            let wanted = Some(wanted);
            assert_eq!(logged(LogLevel::Info, wanted, "axisbridge::modbus::server"), (5, None));
            assert_eq!(logged(LogLevel::Info, wanted, "axisbridge::runner"), (2, None));
        }
        for wanted in [
            "inof",
            "axisbridge=loud",
            "=info",
            "axisbridge=",
            "axisbridge[x]=debug",
            "axisbridge[{x}]=debug",
            "info,verbose",
        ] {
            let (levels, refused) = logged(LogLevel::Info, Some(wanted), "axisbridge::runner");
            let refused = refused.unwrap_or_else(|| panic!("{wanted} is taken"));
            let word = wanted.rsplit(',').next().unwrap_or_default();
            assert!(
                levels == 3 && refused.starts_with(&format!("RUST_LOG is not used: `{word}`: ")),
                "{refused}"
            );
        }
    }
}
