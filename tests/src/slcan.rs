//! CAN adapters on serial lines, in a guest: `slcan` is the one driver of a real controller that needs no hardware. What it is told
//! by the far end of the line, error states and bus off, and what is told to it, the bit rate, go the way of every driver.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::process::Running;

/// The driver; a guest that loads it has no CAN interface but those of [`Adapters`].
pub const MODULE: &str = "drivers/net/can/slcan/slcan";

/// How long they may take for anything.
const PATIENCE: Duration = Duration::from_secs(20);

/// Adapters on one bus, of a guest: the interfaces can0, can1 and so on, which are down and have no bit rate.
#[derive(Debug)]
pub struct Adapters {
    _peer: Running,
    output: PathBuf,
    control: PathBuf,
}

impl Adapters {
    /// Starts them.
    ///
    /// # Panics
    /// When they do not start.
    #[must_use]
    pub fn start(python: &Path, count: usize) -> Self {
        let folder = std::env::temp_dir();
        let (output, control) = (folder.join("adapters"), folder.join("adapters.control"));
        let file = File::create(&output).expect("the guest's temporary folder can be written");
        let mut command = Command::new(python);
        command.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/peers/slcan_adapter.py"));
        command.arg(count.to_string()).arg(&control).stdin(Stdio::null());
        command.stdout(file.try_clone().unwrap()).stderr(file);
        let adapters = Self { _peer: Running::start("slcan_adapter.py", &mut command), output, control };
        adapters.have_said(&["up"]);
        adapters
    }

    /// Waits until they have said exactly this: "up", then what their hosts told them but frames, as in "0 S8".
    ///
    /// # Panics
    /// When they say something else.
    #[track_caller]
    pub fn have_said(&self, expected: &[&str]) {
        let end = Instant::now() + PATIENCE;
        loop {
            let said = std::fs::read_to_string(&self.output).unwrap_or_default();
            if said.lines().eq(expected.iter().copied()) {
                return;
            }
            assert!(Instant::now() < end, "expected {expected:?}, they said:\n{said}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Has the first one say this to its host: "sb000256" is bus off.
    ///
    /// # Panics
    /// When there is nobody to be told.
    pub fn say(&self, line: &str) {
        let control = File::options().write(true).open(&self.control);
        let written = control.and_then(|mut control| control.write_all(format!("0 {line}\n").as_bytes()));
        written.expect("the adapters can be told");
    }
}
