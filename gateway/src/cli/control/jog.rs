//! Jogging with the keys of a terminal.
//!
//! A key moves the axis for as long as a jog lasts ([`crate::engine::local::JOG_TIME`]). Held down it is repeated by the terminal, and the
//! axis goes on; released, or without this program, the axis brakes. Nothing here repeats a jog by itself.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::ExitCode;
use std::time::Duration;

use super::keys::{Key, keys};
use super::terminal::RawTerminal;
use crate::cli::CliError;
use crate::cli::gateway_client::{GatewayClient, Reply};
use crate::local::protocol::printable;

/// How often the position is shown while no key is pressed.
const INTERVAL: Duration = Duration::from_millis(100);

/// What is shown first.
const HELP: &str = "right, + or l: forward   left, - or h: backward   any other key: brake   q: end";

/// Enables the axis, and jogs it until `q`; then it is without torque.
pub fn run(
    mut client: GatewayClient,
    axis: &str,
    velocity: &str,
    acceleration: Option<&str>,
) -> Result<ExitCode, CliError> {
    if velocity.starts_with(['-', '+']) {
        return Err("the velocity of a jog has no sign: the key says the direction".into());
    }
    // First the keys: an axis that nobody can stop is not enabled.
    let terminal = RawTerminal::open()?;
    let reply = client.ask(&format!("enable {axis}"))?;
    reply.end("enable", "ok enable AXIS ...")?;
    let order = |velocity: &str| {
        let mut order = format!("jog {axis} {velocity}");
        let _ = acceleration.map(|acceleration| write!(order, " acceleration={acceleration}"));
        order
    };
    let (forward, backward, brake) = (order(velocity), order(&format!("-{velocity}")), order("0"));
    let look = format!("status {axis}");
    eprint!("{HELP}\r\n");
    let ended = loop {
        let Some(bytes) = terminal.read(INTERVAL)? else { break Ok(()) };
        // Of keys that came together only the last one counts: the axis does not work off what was typed before.
        let request = match keys(&bytes).last() {
            Some(Key::Forward) => &forward,
            Some(Key::Backward) => &backward,
            Some(Key::Stop) => &brake,
            Some(Key::Quit) => break Ok(()),
            None => &look,
        };
        let reply = client.ask(request)?;
        show(&reply)?;
        if !reply.last.starts_with("ok ") {
            break Err(reply);
        }
        if request == &look && !reply.last.contains(" state=operating ") {
            break Err(reply);
        }
    };
    let disabled = client.ask(&format!("disable {axis}"))?;
    drop(terminal);
    eprintln!();
    if let Err(reply) = ended {
        return Err(format!("the axis is not jogged any more: {}", printable(&reply.last)).into());
    }
    disabled.end("disable", "ok disable AXIS ...")?;
    Ok(ExitCode::SUCCESS)
}

/// Shows the state of the axis in one line, which the next one replaces.
fn show(reply: &Reply) -> Result<(), CliError> {
    let words = reply.last.split(' ').filter(|word| {
        ["state=", "position=", "velocity=", "unit="].iter().any(|name| word.starts_with(name))
    });
    let line = words.collect::<Vec<_>>().join("  ");
    let mut out = std::io::stderr().lock();
    write!(out, "\r\x1b[K{}", printable(&line)).and_then(|()| out.flush())?;
    Ok(())
}
