//! The end of a velocity drive.

use profile_cip::devicenet::master::speed::{SpeedEnd, SpeedError};
use profile_cip::devicenet::wire::speed::{Assembly, SpeedCommand, SpeedControl};
use profile_cip::wire::motion::codes::ControlMode;

use super::{MessageError, Row, word};
use crate::mapping::devicenet::{MODE_AT, POSITION_AT, ROW_LEN, speed};

/// The end of a velocity drive.
#[derive(Debug, Clone)]
pub struct SpeedLink {
    end: SpeedEnd,
}

impl SpeedLink {
    /// The end of a drive with this output assembly.
    ///
    /// # Errors
    /// It is none.
    pub fn new(assembly: Assembly) -> Result<Self, SpeedError> {
        Ok(Self { end: SpeedEnd::new(assembly)? })
    }

    pub(super) const fn lengths(&self) -> (usize, usize) {
        self.end.lengths()
    }

    pub(super) fn restart(&mut self) {
        self.end.restart();
    }

    pub(super) fn emit_neutral(&mut self, message: &mut [u8]) -> bool {
        self.end.stop();
        self.end.emit(message).is_ok()
    }

    pub(super) const fn is_answered(&self) -> bool {
        self.end.actual().is_some()
    }

    pub(super) fn emit(&mut self, row: &Row, message: &mut [u8]) -> bool {
        let [low, high, ..] = word(row, POSITION_AT);
        if row[0] & speed::RESET != 0 {
            if !self.end.is_resetting() {
                self.end.reset_fault();
            }
        } else if row[0] & speed::RUN == 0 {
            self.end.stop();
        } else if self.end.run(i16::from_le_bytes([low, high])).is_err() {
            return false;
        }
        self.end.emit(message).is_ok()
    }

    pub(super) fn overhear(&mut self, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        let SpeedCommand { control, speed, .. } = SpeedCommand::parse(self.end.output(), message)?;
        let reverse = control.contains(SpeedControl::RUN_REVERSE);
        let runs = control.intersects(SpeedControl::RUN_FORWARD | SpeedControl::RUN_REVERSE);
        *row = [0; ROW_LEN];
        row[0] = if runs { speed::RUN } else { 0 };
        if control.contains(SpeedControl::FAULT_RESET) {
            row[0] |= speed::RESET;
        }
        row[MODE_AT] = ControlMode::VELOCITY.0;
        let speed = if reverse { speed.saturating_neg() } else { speed };
        row[POSITION_AT..POSITION_AT + 2].copy_from_slice(&speed.to_le_bytes());
        Ok(())
    }

    pub(super) fn handle(&mut self, message: &[u8], row: &mut Row) -> Result<(), MessageError> {
        let actual = self.end.handle(message)?;
        row[..POSITION_AT].copy_from_slice(&[actual.status.bits(), actual.state.0, ControlMode::VELOCITY.0]);
        row[POSITION_AT..POSITION_AT + 2].copy_from_slice(&actual.speed.to_le_bytes());
        Ok(())
    }
}
