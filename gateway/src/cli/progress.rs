//! Progress for a person at a terminal; silent in a pipe.

use std::io::{IsTerminal as _, Write as _};
use std::time::{Duration, Instant};

/// Prints steps to standard error while that is a terminal.
#[derive(Debug)]
pub struct Progress {
    visible: bool,
    start: Instant,
    /// When the line that is written over was written last.
    last: Option<Instant>,
}

/// How often the line that is written over changes.
const INTERVAL: Duration = Duration::from_millis(200);

impl Progress {
    /// Starts counting time; `quiet` silences it even on a terminal.
    #[must_use]
    pub fn new(quiet: bool) -> Self {
        Self { visible: !quiet && std::io::stderr().is_terminal(), start: Instant::now(), last: None }
    }

    /// Says `text` on a line of its own, with the time since the start.
    pub fn step(&mut self, text: &str) {
        if self.visible {
            let _ = writeln!(std::io::stderr(), "{:7.3} s  {text}", self.start.elapsed().as_secs_f64());
        }
    }

    /// Says how far it is, in a line that is written over, a few times in a second at most.
    pub fn at(&mut self, text: impl FnOnce() -> String) {
        let due = || self.last.unwrap_or(self.start).elapsed() >= INTERVAL;
        if self.visible && due() {
            self.last = Some(Instant::now());
            let _ = write!(std::io::stderr(), "\r\x1b[K{}", text());
        }
    }

    /// Clears that line.
    pub fn clear(&mut self) {
        if self.last.take().is_some() {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}
