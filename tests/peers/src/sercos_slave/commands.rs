//! Procedure commands: set, start, interrupt, cancel, and their states in the data status.

use std::collections::BTreeMap;

use super::idn::Idn;
use super::settings::Settings;

/// The data status of a command that is not set.
pub const NONE: u16 = 0;
/// Set, not started.
pub const SET: u16 = 1;
/// Set, carried out.
pub const DONE: u16 = 3;
/// Set, busy, interrupted.
pub const INTERRUPTED: u16 = 5;
/// In process.
pub const RUNNING: u16 = 7;
/// Error with busy reset.
pub const ERROR_IDLE: u16 = 0xB;
/// Error.
pub const ERROR: u16 = 0xF;

/// One command that is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Run {
    status: u16,
    /// When it ends; none: somebody else ends it.
    until: Option<u64>,
}

/// All commands of a device.
#[derive(Debug, Clone, Default)]
pub struct Commands {
    runs: BTreeMap<Idn, Run>,
    error: u16,
}

impl Commands {
    /// With the way errors are shown.
    #[must_use]
    pub fn new(settings: &Settings) -> Self {
        let error = if settings.error_without_busy { ERROR_IDLE } else { ERROR };
        Self { runs: BTreeMap::new(), error }
    }

    /// The state of a command.
    #[must_use]
    pub fn status(&self, idn: Idn) -> u16 {
        self.runs.get(&idn).map_or(NONE, |run| run.status)
    }

    /// A control word was written. True: the command starts now, and `finish` is due at `until`.
    pub fn write(&mut self, idn: Idn, control: u16, until: Option<u64>) -> bool {
        let status = self.status(idn);
        match control & 3 {
            3 => {
                if status == INTERRUPTED {
                    if let Some(run) = self.runs.get_mut(&idn) {
                        run.status = RUNNING;
                    }
                    return false;
                }
                if status == NONE || status == SET {
                    self.runs.insert(idn, Run { status: RUNNING, until });
                    return true;
                }
                false
            }
            1 => {
                let next = match status {
                    NONE => SET,
                    RUNNING => INTERRUPTED,
                    same => same,
                };
                let until = self.runs.get(&idn).and_then(|run| run.until);
                self.runs.insert(idn, Run { status: next, until });
                false
            }
            _ => {
                self.runs.remove(&idn);
                false
            }
        }
    }

    /// Commands whose time is over.
    #[must_use]
    pub fn due(&self, now: u64) -> Vec<Idn> {
        let over = |run: &Run| run.status == RUNNING && run.until.is_some_and(|until| now >= until);
        self.runs.iter().filter(|(_, run)| over(run)).map(|(idn, _)| *idn).collect()
    }

    /// A command has ended.
    pub fn finish(&mut self, idn: Idn, well: bool) {
        let error = self.error;
        if let Some(run) = self.runs.get_mut(&idn) {
            run.status = if well { DONE } else { error };
        }
    }

    /// Does the change bit of S-DEV stand? A command has ended and was not cancelled yet.
    #[must_use]
    pub fn changed(&self) -> bool {
        self.runs.values().any(|run| matches!(run.status, DONE | ERROR | ERROR_IDLE))
    }

    /// A new start: nothing is set.
    pub fn clear(&mut self) {
        self.runs.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const C: Idn = Idn::s(127);

    #[test]
    fn a_command_goes_from_7_to_3_and_back_to_0() {
        let mut c = Commands::new(&Settings::default());
        assert!(c.write(C, 3, Some(50)));
        assert_eq!((c.status(C), c.changed()), (7, false));
        assert!(c.due(49).is_empty());
        assert_eq!(c.due(50), [C]);
        c.finish(C, true);
        assert_eq!((c.status(C), c.changed()), (3, true));
        assert!(!c.write(C, 3, Some(90)));
        assert_eq!(c.status(C), 3);
        c.write(C, 0, None);
        assert_eq!((c.status(C), c.changed()), (0, false));
    }

    #[test]
    fn errors_and_interruptions_are_shown() {
        let mut c = Commands::new(&Settings::default());
        c.write(C, 1, None);
        assert_eq!(c.status(C), 1);
        assert!(c.write(C, 3, Some(50)));
        c.write(C, 1, None);
        assert_eq!((c.status(C), c.due(60).len()), (5, 0));
        assert!(!c.write(C, 3, Some(70)));
        assert_eq!(c.due(60), [C]);
        c.finish(C, false);
        assert_eq!(c.status(C), 0xF);
        let settings = Settings { error_without_busy: true, ..Settings::default() };
        let mut c = Commands::new(&settings);
        c.write(C, 3, None);
        c.finish(C, false);
        assert_eq!(c.status(C), 0xB);
    }
}
