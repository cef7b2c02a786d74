//! Progress for a person at a terminal; silent in a pipe.

use std::io::{IsTerminal as _, Write as _};
use std::time::Instant;

/// Prints steps to standard error while that is a terminal.
#[derive(Debug)]
pub struct Progress {
    visible: bool,
    start: Instant,
    open_line: bool,
}

impl Progress {
    /// Starts counting time; `quiet` silences it even on a terminal.
    #[must_use]
    pub fn new(quiet: bool) -> Self {
        Self { visible: !quiet && std::io::stderr().is_terminal(), start: Instant::now(), open_line: false }
    }

    /// Ends the present line and says `text` on a line of its own, with the time since the start.
    pub fn step(&mut self, text: &str) {
        if self.visible {
            let end = if self.open_line { "\n" } else { "" };
            let _ = writeln!(std::io::stderr(), "{end}{:7.3} s  {text}", self.start.elapsed().as_secs_f64());
            self.open_line = false;
        }
    }

    /// Rewrites the present line with `text`.
    pub fn update(&mut self, text: &str) {
        if self.visible {
            let _ = write!(std::io::stderr(), "\r{:7.3} s  {text}\x1b[K", self.start.elapsed().as_secs_f64());
            let _ = std::io::stderr().flush();
            self.open_line = true;
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.open_line {
            let _ = writeln!(std::io::stderr());
        }
    }
}
