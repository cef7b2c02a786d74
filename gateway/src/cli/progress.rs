//! Progress for a person at a terminal; silent in a pipe.

use std::io::{IsTerminal as _, Write as _};
use std::time::Instant;

/// Prints steps to standard error while that is a terminal.
#[derive(Debug)]
pub struct Progress {
    visible: bool,
    start: Instant,
}

impl Progress {
    /// Starts counting time; `quiet` silences it even on a terminal.
    #[must_use]
    pub fn new(quiet: bool) -> Self {
        Self { visible: !quiet && std::io::stderr().is_terminal(), start: Instant::now() }
    }

    /// Says `text` on a line of its own, with the time since the start.
    pub fn step(&mut self, text: &str) {
        if self.visible {
            let _ = writeln!(std::io::stderr(), "{:7.3} s  {text}", self.start.elapsed().as_secs_f64());
        }
    }
}
