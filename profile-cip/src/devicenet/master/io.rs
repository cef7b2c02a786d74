//! The two ends of an I/O connection at the master.

use super::super::connection::ConnectionKind;
use super::super::fragmentation::{IO_MAX, IoReceiver};
use super::config::IoConfig;

/// What a slave has sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Consumer<'a> {
    /// The newest message; empty before the first, and when the slave has sent one without data.
    pub data: &'a [u8],
    /// It has come since the last cycle began.
    pub fresh: bool,
    /// Answers that are missing in a row.
    pub missed: u32,
}

/// One connection.
#[derive(Debug, Clone)]
pub(super) struct IoEnd {
    pub config: IoConfig,
    output: [u8; IO_MAX],
    /// Cycles since the last commit; `None` before the first.
    committed: Option<u16>,
    pub receiver: IoReceiver,
    has_data: bool,
    fresh: bool,
    /// An answer is due.
    asked: bool,
    pub missed: u32,
    /// Cycles to the next question.
    countdown: u16,
}

impl IoEnd {
    pub fn new(config: IoConfig) -> Self {
        Self {
            config,
            output: [0; IO_MAX],
            committed: None,
            receiver: IoReceiver::default(),
            has_data: false,
            fresh: false,
            asked: false,
            missed: 0,
            countdown: 0,
        }
    }

    /// Nothing has been exchanged yet.
    pub fn reset(&mut self) {
        *self = Self::new(self.config);
    }

    pub fn output_mut(&mut self) -> &mut [u8] {
        &mut self.output[..self.config.output.min(IO_MAX)]
    }

    pub fn commit(&mut self) {
        self.committed = Some(0);
    }

    /// What goes out now; nothing when there is no command that still counts.
    pub fn command(&self, hold_cycles: u16) -> &[u8] {
        match self.committed {
            Some(age) if age <= hold_cycles => &self.output[..self.config.output.min(IO_MAX)],
            _ => &[],
        }
    }

    /// A cycle begins. Whether the slave is to be asked in it.
    pub fn begin_cycle(&mut self) -> bool {
        self.fresh = false;
        if self.countdown > 0 {
            self.countdown -= 1;
            return false;
        }
        self.countdown = self.config.every.max(1) - 1;
        if self.asked {
            self.missed = self.missed.saturating_add(1);
        }
        self.asked = self.config.kind != ConnectionKind::ChangeOfState;
        true
    }

    /// What was committed last has not gone out.
    pub const fn is_unsent(&self) -> bool {
        matches!(self.committed, Some(0))
    }

    /// The command has gone out.
    pub fn sent(&mut self) {
        self.committed = self.committed.map(|age| age.saturating_add(1));
    }

    /// The receiver has a whole message.
    pub fn received(&mut self) {
        self.has_data = true;
        self.fresh = true;
        self.asked = false;
        self.missed = 0;
    }

    /// What came last was no message of this connection: there is nothing to look at until the next one.
    pub fn invalidate(&mut self) {
        self.has_data = false;
        self.fresh = false;
    }

    pub fn consumer(&self) -> Consumer<'_> {
        let data = if self.has_data { self.receiver.data() } else { &[] };
        Consumer { data, fresh: self.fresh, missed: self.missed }
    }
}
