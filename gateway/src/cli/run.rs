//! `axisbridge run`: the box.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tracing::{info, warn};
use tracing_subscriber::EnvFilter;

use super::{CliError, RunArguments};
use crate::config::{Config, LogLevel};
use crate::runner;
use crate::settings::Store;

/// How often the box is looked after.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// Runs the box until it is asked to end.
pub fn run(arguments: &RunArguments) -> Result<ExitCode, CliError> {
    let config = Config::load(&arguments.config)?;
    log_to_stderr(config.log_level);
    let stop = super::signal::stop_on_signals()?;
    info!(name = config.name, version = env!("CARGO_PKG_VERSION"), "axisbridge starts");
    let settings = Arc::new(Store::open(config.settings_file.as_deref())?);
    while run_once(&config, arguments.capture.as_deref(), &settings, &stop)? {
        info!("axisbridge starts anew: a controller has reset the Identity object");
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs the box once; `true` when it is to be started again.
fn run_once(
    config: &Config,
    capture: Option<&Path>,
    settings: &Arc<Store>,
    stop: &AtomicBool,
) -> Result<bool, CliError> {
    let running = runner::start(config, capture, settings)?;
    let mut told = false;
    while !stop.load(Ordering::Relaxed) && !running.wants_restart() {
        std::thread::sleep(LOOK_INTERVAL);
        if !told {
            told = true;
            let refused = running.realtime_report();
            if !refused.is_empty() {
                warn!(refused, "the cycle thread runs without");
            }
        }
        if running.is_dead() {
            return Err("the cycle thread has ended by itself; see above".into());
        }
    }
    let again = running.wants_restart() && !stop.load(Ordering::Relaxed);
    info!("axisbridge ends: axes stop, the bus goes down");
    if let Some(dropped) = running.stop()?.filter(|dropped| *dropped > 0) {
        warn!(dropped, "frames are missing in the recording");
    }
    Ok(again)
}

/// Logs to standard error; the environment variable `RUST_LOG` overrides the level of the file.
fn log_to_stderr(level: LogLevel) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level.name()));
    let logger =
        tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_target(false);
    // Refused only when a logger is set already.
    let _ = logger.try_init();
}
