//! `axisbridge scan` of a CAN bus.

use std::sync::atomic::Ordering;

use profile_generic::time::DurationNs;

use super::progress::Progress;
use super::scan::Scanned;
use super::{CliError, signal};
use crate::runner::port::CanSocketPort;
use crate::scan::can::{self, Scanner};
use crate::sys::can_socket::{self, CanSocket, OpenError};
use crate::sys::interface_lock::InterfaceLock;
use crate::sys::{can_interface, clock};

/// Longest sleep: answers come at any time.
const PATIENCE: DurationNs = DurationNs::from_millis(1);

/// Whether an interface is one of CAN.
///
/// # Errors
/// It is one, and cannot be used.
pub fn is_can(interface: &str) -> Result<bool, CliError> {
    match CanSocket::open(interface, &can_socket::Options::default()) {
        Ok(_) => Ok(true),
        Err(OpenError::NotPermitted { name }) => Err(OpenError::NotPermitted { name }.into()),
        // What else is wrong with it, the scan of SERCOS says.
        Err(_) => Ok(false),
    }
}

/// Looks at the bus, with its progress on standard error unless it is `quiet`.
///
/// # Errors
/// The interface cannot be opened.
pub fn find(interface: &str, quiet: bool) -> Result<Scanned, CliError> {
    let mut port = CanSocketPort::open(interface, InterfaceLock::take(interface)?)?;
    // A virtual interface has no rate.
    let rate = can_interface::state(interface).ok().and_then(|state| state.nominal);
    let stop = signal::stop_on_signals()?;
    let mut progress = Progress::new(quiet);
    progress.step(&format!("scanning {interface}"));
    let mut scanner = Scanner::new();
    loop {
        let now = clock::monotonic_now();
        if stop.load(Ordering::Relaxed) {
            scanner.give_up(now, "interrupted");
        }
        if scanner.step(now, &mut port) {
            break;
        }
        let latest = now + PATIENCE;
        clock::sleep_until(scanner.wake_at().map_or(latest, |at| at.min(latest)))?;
    }
    let bus = scanner.finish();
    let mut text = String::new();
    for line in format!("axisbridge scan of {interface}: {}", can::text(&bus)).lines() {
        text.push_str(format!("# {line}").trim_end());
        text.push('\n');
    }
    let starter = can::starter(&bus, interface, rate);
    if let Some(starter) = &starter {
        text.push('\n');
        text.push_str(starter);
    }
    text.push_str(&can::hints(&bus));
    Ok(Scanned {
        text,
        has_starter: starter.is_some(),
        json: can::json(&bus),
        good: bus.findings.is_empty() && !(bus.nodes.is_empty() && bus.unassigned.is_empty()),
    })
}
