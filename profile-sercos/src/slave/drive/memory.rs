//! The memory of the drive that keeps parameters without power: S-0-0264 stores them, which takes a while.
//!
//! What is stored is not simulated: a simulated drive has its parameters as long as it runs.

use profile_generic::time::DurationNs;

use crate::slave::application::{Order, Progress};
use crate::slave::parameter::{Definition, Store};
use crate::wire::idn::Idn;

/// S-0-0264.
pub const BACKUP: Idn = Idn::standard(264);

/// Diagnostic number of the failure: one of a procedure command.
pub(super) const FAILURE: u32 = super::fault::number(0xC, 264);

/// Diagnostic message of the failure.
pub(super) const FAILURE_TEXT: &str = "Backup working memory failed";

/// Element 3: a command of CP2 to CP4.
const COMMAND: u32 = 0x0009_0001;

/// Adds the procedure command.
pub fn define(store: &mut Store) {
    store.define(Definition::command(BACKUP, COMMAND, "Backup working memory procedure command"));
}

/// State of the memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Memory {
    /// How long it takes to store.
    pub time: DurationNs,
    /// It cannot be written: the command ends with an error.
    pub is_broken: bool,
    /// What is left of it.
    left: DurationNs,
    /// The command is set.
    is_set: bool,
}

impl Default for Memory {
    fn default() -> Self {
        Self { time: DurationNs::from_millis(200), is_broken: false, left: DurationNs::ZERO, is_set: false }
    }
}

impl Memory {
    /// The master's order to the command.
    pub fn order(&mut self, order: Order) -> Progress {
        match order {
            Order::Start => (self.left, self.is_set) = (self.time, true),
            Order::Cancel => (self.left, self.is_set) = (DurationNs::ZERO, false),
            Order::Resume | Order::Interrupt => {}
        }
        Progress::InProcess
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        match self.left {
            DurationNs::ZERO if self.is_broken => Progress::Failed,
            DurationNs::ZERO => Progress::Done,
            _ => Progress::InProcess,
        }
    }

    /// Whether the command has failed and is not cancelled yet.
    pub fn has_failed(&self) -> bool {
        self.is_set && self.progress() == Progress::Failed
    }

    /// Time passes.
    pub fn step(&mut self, elapsed: DurationNs) {
        self.left = (self.left - elapsed).max(DurationNs::ZERO);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn storing_takes_its_time_and_a_broken_memory_fails() {
        let mut memory = Memory { time: DurationNs(10), ..Memory::default() };
        for (is_broken, end) in [(false, Progress::Done), (true, Progress::Failed)] {
            memory.is_broken = is_broken;
            assert_eq!(memory.order(Order::Start), Progress::InProcess);
            memory.step(DurationNs(9));
            assert_eq!(memory.progress(), Progress::InProcess);
            memory.step(DurationNs(9));
            assert_eq!(memory.progress(), end);
        }
        assert!(memory.has_failed());
        memory.order(Order::Start);
        memory.order(Order::Cancel);
        assert_ne!(memory.progress(), Progress::InProcess);
        assert!(!memory.has_failed());
    }
}
