//! The terminal of standard input in raw mode.

use std::io::{self, IsTerminal as _, Read as _};
use std::os::fd::AsFd as _;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcsetattr};

use crate::cli::CliError;

/// Bytes that are read at once.
const READ_MAX: usize = 256;

/// A terminal that gives each key at once; as it was before when this is dropped.
#[derive(Debug)]
pub struct RawTerminal {
    before: Termios,
}

impl RawTerminal {
    /// Takes the terminal of standard input.
    pub fn open() -> Result<Self, CliError> {
        let stdin = io::stdin();
        if !stdin.is_terminal() {
            return Err("keys need a terminal: standard input is none".into());
        }
        let before = tcgetattr(stdin.as_fd())?;
        let mut raw = before.clone();
        raw.make_raw();
        tcsetattr(stdin.as_fd(), OptionalActions::Flush, &raw)?;
        Ok(Self { before })
    }

    /// What was typed within this time; nothing if nothing was, and `None` when the terminal has gone.
    pub fn read(&self, patience: Duration) -> io::Result<Option<Vec<u8>>> {
        let stdin = io::stdin();
        let wait = Timespec { tv_sec: 0, tv_nsec: i64::from(patience.subsec_nanos()) };
        let mut fds = [PollFd::new(&stdin, PollFlags::IN)];
        match poll(&mut fds, Some(&wait)) {
            Ok(0) => return Ok(Some(Vec::new())),
            Err(rustix::io::Errno::INTR) => return Ok(Some(Vec::new())),
            found => found?,
        };
        let mut bytes = vec![0; READ_MAX];
        let len = stdin.lock().read(&mut bytes)?;
        bytes.truncate(len);
        Ok((len > 0).then_some(bytes))
    }
}

impl Drop for RawTerminal {
    fn drop(&mut self) {
        let _ = tcsetattr(io::stdin().as_fd(), OptionalActions::Flush, &self.before);
    }
}
