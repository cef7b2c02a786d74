//! Wishes from outside: to end (Ctrl-C, or SIGTERM from a service manager), to read the files again (SIGHUP).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::CliError;
use crate::sys::thread::{self, WAITING_STACK};

/// A flag that the first SIGINT or SIGTERM sets; a second one ends the process at once.
pub fn stop_on_signals() -> Result<Arc<AtomicBool>, CliError> {
    let [stop] = flags_on_signals()?;
    Ok(stop)
}

/// A flag that the first SIGINT or SIGTERM sets, and one that the second sets; a third ends the process at once.
pub fn stop_and_hurry_on_signals() -> Result<[Arc<AtomicBool>; 2], CliError> {
    flags_on_signals()
}

/// Flags that one SIGINT or SIGTERM after the other sets; the next one ends the process.
fn flags_on_signals<const N: usize>() -> Result<[Arc<AtomicBool>; N], CliError> {
    let flags: [Arc<AtomicBool>; N] = std::array::from_fn(|_| Arc::default());
    let own = flags.clone();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    thread::named("axisbridge-signals", WAITING_STACK).spawn(move || {
        runtime.block_on(async {
            use tokio::signal::unix::{SignalKind, signal};
            let (Ok(mut interrupt), Ok(mut terminate)) =
                (signal(SignalKind::interrupt()), signal(SignalKind::terminate()))
            else {
                return;
            };
            loop {
                tokio::select! {
                    _ = interrupt.recv() => {}
                    _ = terminate.recv() => {}
                }
                match own.iter().find(|flag| !flag.load(Ordering::Relaxed)) {
                    Some(flag) => flag.store(true, Ordering::Relaxed),
                    None => std::process::exit(1),
                }
            }
        });
    })?;
    Ok(flags)
}

/// A flag that each SIGHUP sets; the part that obeys it clears it.
pub fn reload_on_hang_up() -> Result<Arc<AtomicBool>, CliError> {
    let reload = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&reload);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    thread::named("axisbridge-reload", WAITING_STACK).spawn(move || {
        runtime.block_on(async {
            use tokio::signal::unix::{SignalKind, signal};
            let Ok(mut hang_up) = signal(SignalKind::hangup()) else { return };
            while hang_up.recv().await.is_some() {
                flag.store(true, Ordering::Relaxed);
            }
        });
    })?;
    Ok(reload)
}
