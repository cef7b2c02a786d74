//! Standard input and standard error of a process with simulated drives.

use std::io::{self, BufRead, BufReader, IsTerminal as _, Read, Write as _};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use profile_generic::time::MonotonicTime;

use super::player::Player;
use super::{Names, Order, Script, SimulatedDrives, causes, help};

/// Lines that wait to be looked at.
const LINES_MAX: usize = 64;

/// Longest line; what is longer is cut there.
const LINE_LEN_MAX: u64 = 1024;

/// How often a process in the background looks whether it may read the terminal.
const BACKGROUND_WAIT: Duration = Duration::from_millis(500);

/// Lines that a person types, read by a thread of its own. They end with standard input; the process goes on.
///
/// # Errors
/// No thread can be started.
pub fn typed_lines() -> io::Result<Receiver<String>> {
    let (sender, receiver) = sync_channel(LINES_MAX);
    thread::Builder::new().name("axisbridge-typed".to_owned()).spawn(move || {
        let stdin = io::stdin();
        let may_read = || {
            // Whoever reads a terminal from the background is stopped.
            while stdin.is_terminal() && !is_in_foreground() {
                thread::sleep(BACKGROUND_WAIT);
            }
        };
        send_lines(BufReader::new(io::stdin()), &sender, may_read);
    })?;
    Ok(receiver)
}

fn send_lines(mut from: impl BufRead, to: &SyncSender<String>, may_read: impl Fn()) {
    let mut line = Vec::new();
    loop {
        line.clear();
        may_read();
        match from.by_ref().take(LINE_LEN_MAX).read_until(b'\n', &mut line) {
            Ok(1..) if to.send(String::from_utf8_lossy(&line).into_owned()).is_ok() => {}
            _ => return,
        }
    }
}

/// Whether the terminal belongs to the process group of this process, as the kernel reports it.
fn is_in_foreground() -> bool {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    belongs_to_terminal(&stat).unwrap_or(true)
}

/// Group and foreground group of `/proc/PID/stat`, fields 5 and 8, are the same.
fn belongs_to_terminal(stat: &str) -> Option<bool> {
    // The name of the program, in brackets, may contain anything.
    let (_, fields) = stat.rsplit_once(')')?;
    let mut fields = fields.split_whitespace().skip(2);
    Some(fields.next()? == fields.nth(2)?)
}

/// What directs simulated drives while their process runs: a script, a person, and reports on standard error.
#[derive(Debug)]
pub struct Director<D: SimulatedDrives> {
    player: Player<D>,
    lines: Receiver<String>,
}

impl<D: SimulatedDrives> Director<D> {
    /// Plays a script that begins at `start`, and takes lines beside it.
    #[must_use]
    pub fn new(names: Names, script: Script, start: MonotonicTime, lines: Receiver<String>) -> Self {
        Self { player: Player::new(names, script, start), lines }
    }

    /// Does what is due.
    pub fn poll(&mut self, now: MonotonicTime, drives: &mut D) {
        let start = self.player.start();
        self.poll_to(now, drives, &mut |text| say(now, start, text));
    }

    fn poll_to(&mut self, now: MonotonicTime, drives: &mut D, say: &mut dyn FnMut(&str)) {
        for line in self.lines.try_iter().take(LINES_MAX) {
            match Order::parse(&line, self.player.names()) {
                None => {}
                Some(Ok(Order::Event(event))) => self.player.play(now, event, drives, say),
                Some(Ok(Order::Status)) => self.player.show(drives, say),
                Some(Ok(Order::Causes)) => say(&format!("causes\n{}", causes().trim_end())),
                // The reader gives no properties to a person.
                Some(Ok(Order::Help | Order::Property(..))) => {
                    say(&format!(
                        "N is the number of a {}; without it all are meant\n{}",
                        self.player.names().what,
                        help().trim_end()
                    ));
                }
                Some(Err(findings)) => say(&format!("{findings}")),
            }
        }
        self.player.poll(now, drives, say);
    }

    /// Says something about the process as a whole.
    pub fn say(&self, now: MonotonicTime, text: &str) {
        say(now, self.player.start(), text);
    }
}

/// A line on standard error with the time since the start. Nobody may be there to read it.
pub fn say(now: MonotonicTime, start: MonotonicTime, text: &str) {
    let millis = now.since(start).0 / 1_000_000;
    let _ = writeln!(io::stderr(), "{:4}.{:03} s  {text}", millis / 1000, millis % 1000);
}

#[cfg(test)]
mod tests {
    use profile_generic::scaling::UnitKind;

    use super::*;
    use crate::simulate::drive_events::setup::Setup;
    use crate::simulate::drives::{DriveLine, LineKind};

    #[test]
    fn every_typed_line_is_answered_and_none_ends_the_drives() {
        let (sender, lines) = sync_channel(LINES_MAX);
        let names = Names { what: "drive", numbers: 1..=1 };
        let mut director = Director::new(names, Script::default(), MonotonicTime::ZERO, lines);
        let mut drives =
            DriveLine::new([(1, UnitKind::Rotary)], false, &LineKind::Plain, &Setup::default()).unwrap();
        let mut said = String::new();
        let typed = ["silence 1 for 1 s\n", "\n", "silenz\n", "help\n", "status\n", "causes\n"];
        for (second, line) in (1..).zip(typed) {
            sender.send(line.to_owned()).unwrap();
            let now = MonotonicTime(second * 1_000_000_000);
            drives.network_mut().handle_time(now);
            director.poll_to(now, &mut drives, &mut |text| said += &format!("{second} s {text}\n"));
        }
        // The end of standard input is nothing to a drive.
        drop(sender);
        director.poll_to(MonotonicTime(7_000_000_000), &mut drives, &mut |text| said += text);
        insta::assert_snapshot!(said);
    }

    #[test]
    fn lines_come_whole_long_ones_in_parts_and_end_with_their_source() {
        let (sender, receiver) = sync_channel(LINES_MAX);
        let long = "x".repeat(1500);
        let text = format!("power off\n\nfault 1 \u{FF} y\n{long}\nlast");
        send_lines(text.as_bytes(), &sender, || {});
        drop(sender);
        let lines: Vec<String> = receiver.iter().collect();
        let (head, tail) = long.split_at(1024);
        assert_eq!(lines, ["power off\n", "\n", "fault 1 \u{FF} y\n", head, &format!("{tail}\n"), "last"]);
    }

    #[test]
    fn the_foreground_is_told_by_the_kernel() {
        assert_eq!(belongs_to_terminal("7 (a) b) S 1 7 7 34816 7 4194304 1"), Some(true));
        assert_eq!(belongs_to_terminal("7 (a) b) S 1 7 7 34816 9 4194304 1"), Some(false));
        assert_eq!(belongs_to_terminal(""), None);
    }
}
