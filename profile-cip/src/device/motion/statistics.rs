//! What the motion device has counted: since its construction, and for the controller since the connection was opened.

use super::io_counters::MotionCounters;
use crate::reported::Reported;
use crate::wire::Error;
use crate::wire::motion::UpdateDiagnostics;

/// The counts.
pub(super) struct Statistics {
    pub counters: MotionCounters,
    /// Why the last malformed update was refused.
    pub last_error: Option<Error>,
    /// Lost and late updates of this connection, modulo 256 (class attributes 32 and 33).
    diagnostics: (u8, u8),
    reported: Reported<(u8, u8)>,
}

impl Default for Statistics {
    fn default() -> Self {
        Self {
            counters: MotionCounters::default(),
            last_error: None,
            diagnostics: (0, 0),
            reported: Reported::known((0, 0)),
        }
    }
}

impl Statistics {
    /// A connection begins or ends: its own counts are 0, which the controller knows.
    pub fn start_over(&mut self) {
        self.diagnostics = (0, 0);
        self.reported = Reported::known((0, 0));
    }

    pub fn malformed(&mut self, error: Error) {
        self.last_error = Some(error);
        self.counters.malformed += 1;
    }

    /// So many updates were lost before the one that has come.
    pub fn lost(&mut self, lost: u8) {
        self.counters.lost_updates += u64::from(lost);
        self.diagnostics.0 = self.diagnostics.0.wrapping_add(lost);
    }

    pub fn late(&mut self) {
        self.counters.late_updates += 1;
        self.diagnostics.1 = self.diagnostics.1.wrapping_add(1);
    }

    /// Lost and late updates, class attributes 32 and 33.
    pub fn diagnostics(&self) -> (u8, u8) {
        self.diagnostics
    }

    /// A service may have set the attributes.
    pub fn set_diagnostics(&mut self, diagnostics: (u8, u8)) {
        self.diagnostics = diagnostics;
    }

    /// The counts if they are to be put into update `update_id`.
    pub fn due(&mut self, update_id: u8) -> Option<UpdateDiagnostics> {
        let (lost_updates, late_updates) = self.reported.due(self.diagnostics, update_id)?;
        Some(UpdateDiagnostics { lost_updates, late_updates })
    }

    /// The controller has processed update `received`.
    pub fn acknowledge(&mut self, received: u8) {
        self.reported.acknowledge(received);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_reported_until_acknowledged_and_start_over_with_the_connection() {
        let mut statistics = Statistics::default();
        assert_eq!(statistics.due(1), None, "the controller knows the zeros");
        statistics.lost(255);
        statistics.lost(2);
        statistics.late();
        let due = Some(UpdateDiagnostics { lost_updates: 1, late_updates: 1 });
        assert_eq!((statistics.due(2), statistics.due(3)), (due, due));
        statistics.acknowledge(2);
        assert_eq!(statistics.due(4), None);
        statistics.set_diagnostics((0, 7));
        assert_eq!(statistics.due(5), Some(UpdateDiagnostics { lost_updates: 0, late_updates: 7 }));
        statistics.start_over();
        assert_eq!((statistics.diagnostics(), statistics.due(6)), ((0, 0), None));
        assert_eq!((statistics.counters.lost_updates, statistics.counters.late_updates), (257, 1));
    }
}
