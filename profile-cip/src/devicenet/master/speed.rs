//! The controller's end of a velocity drive of the AC/DC drive profile: what goes into its output assembly, and what comes
//! out of its input assembly.

use super::super::wire::speed::{
    Assembly, SpeedActual, SpeedCommand, SpeedControl, SpeedStatus, SupervisorState,
};
use crate::wire::Error;

/// Why a drive cannot be asked for something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SpeedError {
    /// It is none of the output assemblies 20 to 23.
    #[error("expected output assembly 20 to 23, got {}", .0.0)]
    Assembly(Assembly),
    /// The basic assemblies have no reverse.
    #[error("the {0} assembly has no run reverse")]
    NoReverse(Assembly),
}

/// The controller's end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpeedEnd {
    output: Assembly,
    input: Assembly,
    command: SpeedCommand,
    /// A reset was asked for, and its edge has not been seen to do anything.
    resets: Option<u8>,
    actual: Option<SpeedActual>,
}

/// Messages for which fault reset stays raised.
const RESET_MESSAGES: u8 = 5;

impl SpeedEnd {
    /// An end of this output assembly and the input assembly that goes with it. The drive stands.
    ///
    /// # Errors
    /// It is no output assembly.
    pub fn new(output: Assembly) -> Result<Self, SpeedError> {
        let input = output.status().ok_or(SpeedError::Assembly(output))?;
        let mut end = Self { output, input, command: SpeedCommand::default(), resets: None, actual: None };
        end.stop();
        Ok(end)
    }

    /// The assembly that the drive consumes.
    #[must_use]
    pub const fn output(&self) -> Assembly {
        self.output
    }

    /// Lengths of the poll connection: to the drive, and from it.
    #[must_use]
    pub const fn lengths(&self) -> (usize, usize) {
        (self.output.buffer_len(), self.input.buffer_len())
    }

    /// Runs at this speed, rpm / 2^SpeedScale; a negative one is reverse.
    ///
    /// # Errors
    /// Reverse with a basic assembly; the drive stands then.
    pub fn run(&mut self, speed: i16) -> Result<(), SpeedError> {
        self.stop();
        let reverse = speed < 0;
        if reverse && !self.output.is_extended() {
            return Err(SpeedError::NoReverse(self.output));
        }
        self.command.control.insert(if reverse {
            SpeedControl::RUN_REVERSE
        } else {
            SpeedControl::RUN_FORWARD
        });
        self.command.speed = i16::try_from(speed.unsigned_abs()).unwrap_or(i16::MAX);
        Ok(())
    }

    /// The torque reference, Nm / 2^TorqueScale.
    pub fn set_torque(&mut self, torque: i16) {
        self.command.torque = torque;
    }

    /// Slows down to a stop. Control and reference stay with the network.
    pub fn stop(&mut self) {
        self.command.control = SpeedControl::NET_CONTROL | SpeedControl::NET_REFERENCE;
        self.command.speed = 0;
    }

    /// Resets the fault; the drive stands, and has to be asked to run again.
    pub fn reset_fault(&mut self) {
        self.stop();
        self.resets = Some(RESET_MESSAGES);
    }

    /// Whether the reset of a fault is raised.
    #[must_use]
    pub fn is_resetting(&self) -> bool {
        self.resets.is_some_and(|left| left > 0)
    }

    /// The connection was taken anew: what was asked does not count any more.
    pub fn restart(&mut self) {
        self.stop();
        self.resets = None;
        self.actual = None;
    }

    /// Writes the next message.
    ///
    /// # Errors
    /// The buffer is too short.
    pub fn emit(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        let raised = self.is_resetting();
        self.command.control.set(SpeedControl::FAULT_RESET, raised);
        let len = self.command.emit(self.output, buffer)?;
        self.resets = self.resets.and_then(|left| left.checked_sub(1));
        Ok(len)
    }

    /// Takes a message of the drive.
    ///
    /// # Errors
    /// It is none of this assembly, and nothing changes.
    pub fn handle(&mut self, data: &[u8]) -> Result<&SpeedActual, Error> {
        let actual = SpeedActual::parse(self.input, data)?;
        Ok(self.actual.insert(actual))
    }

    /// What the drive has said last.
    #[must_use]
    pub const fn actual(&self) -> Option<&SpeedActual> {
        self.actual.as_ref()
    }

    /// Whether the drive has a fault.
    #[must_use]
    pub fn is_faulted(&self) -> bool {
        self.actual.is_some_and(|actual| actual.status.contains(SpeedStatus::FAULTED))
    }

    /// State of the Control Supervisor, which only the extended assemblies tell.
    #[must_use]
    pub fn state(&self) -> Option<SupervisorState> {
        self.actual.filter(|_| self.input.is_extended()).map(|actual| actual.state)
    }
}
