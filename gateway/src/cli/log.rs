//! `axisbridge log`: the last lines of the log of a running gateway, over its local socket.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::gateway_client::GatewayClient;
use super::status::PATIENCE;
use super::{CliError, LogArguments, print, signal, written_to_end};
use crate::history::LogEvent;
use crate::local::protocol::printable;

/// How often `--follow` asks.
const INTERVAL: Duration = Duration::from_millis(500);

/// How often it looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// Shows the lines once, or goes on with new ones.
pub fn run(arguments: &LogArguments) -> Result<ExitCode, CliError> {
    let mut client = GatewayClient::connect(&arguments.local, PATIENCE)?;
    let first = format!("lines={}", arguments.lines);
    let mut lines = ask(&mut client, arguments, &first)?;
    if !arguments.follow {
        return print(lines.text(arguments.json), ExitCode::SUCCESS);
    }
    let stop = signal::stop_on_signals()?;
    loop {
        let mut out = std::io::stdout().lock();
        let written = out.write_all(lines.text(arguments.json).as_bytes()).and_then(|()| out.flush());
        drop(out);
        if written.is_err() {
            return written_to_end(written, ExitCode::SUCCESS);
        }
        for _ in 0..INTERVAL.as_millis() / LOOK.as_millis() {
            if stop.load(Ordering::Relaxed) {
                return Ok(ExitCode::SUCCESS);
            }
            std::thread::sleep(LOOK);
        }
        lines = ask(&mut client, arguments, &format!("after={} lines=10000", lines.next))?;
        if lines.missed > 0 {
            eprintln!("{} lines are missing: they came faster than they were asked for", lines.missed);
        }
    }
}

/// Lines of the log.
struct Lines {
    /// Each as it came, and as it is.
    events: Vec<(String, LogEvent)>,
    /// The number to go on after.
    next: u64,
    /// Lines that were no longer there.
    missed: u64,
}

fn ask(client: &mut GatewayClient, arguments: &LogArguments, which: &str) -> Result<Lines, CliError> {
    let axis = arguments.axis.as_ref().map(|axis| format!(" axis={axis}")).unwrap_or_default();
    let reply = client.ask(&format!("log {which} level={}{axis}", arguments.level))?;
    const FORM: &str = "ok log N next=N missed=N";
    let end = reply.end("log", FORM)?;
    let number = |name: &str| {
        let word = end.split(' ').find_map(|word| word.strip_prefix(name));
        word.and_then(|word| word.parse().ok()).ok_or_else(|| reply.unexpected(FORM))
    };
    let (next, missed) = (number("next=")?, number("missed=")?);
    let events = reply.rows("event")?.into_iter().map(|(text, event)| (text.to_owned(), event)).collect();
    Ok(Lines { events, next, missed })
}

impl Lines {
    fn text(&self, json: bool) -> String {
        let mut text = String::new();
        for (object, event) in &self.events {
            let _ = match json {
                true => writeln!(text, "{object}"),
                false => writeln!(text, "{}", line(event)),
            };
        }
        text
    }
}

/// A line for a person: time, level, what it is about, text. Some texts begin with their bus.
fn line(event: &LogEvent) -> String {
    let LogEvent { time, level, axis, device, bus, text, .. } = event;
    let about = axis.as_ref().or(device.as_ref()).or(bus.as_ref()).map(|name| format!("{name}: "));
    let about = about.filter(|about| !text.starts_with(about));
    let level = level.to_ascii_uppercase();
    printable(&format!("{time} {level:>5} {}{text}", about.unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_names_what_it_is_about_and_moves_no_cursor() {
        let mut event = LogEvent {
            time: "2026-01-31T12:00:00.000000Z".to_owned(),
            level: "warn".to_owned(),
            axis: Some("turntable".to_owned()),
            bus: Some("SERCOS".to_owned()),
            text: "the drive reports \"\u{1b}[2J\"".to_owned(),
            ..LogEvent::default()
        };
        let shown = "2026-01-31T12:00:00.000000Z  WARN turntable: the drive reports \"?[2J\"";
        assert_eq!(line(&event), shown);
        event.axis = None;
        assert!(line(&event).contains(" WARN SERCOS: the drive"));
        event.text.insert_str(0, "SERCOS: ");
        assert!(line(&event).contains(" WARN SERCOS: the drive"), "once");
        event.bus = None;
        assert!(line(&event).contains(" WARN SERCOS: the drive"), "as it was written");
        event.text = "the drive".to_owned();
        assert!(line(&event).contains(" WARN the drive"));
    }
}
