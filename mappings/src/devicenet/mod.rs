//! Drives on DeviceNet: their programs.
//!
//! A CIP Motion drive speaks the very profile of `cip-generic.toml`: its states, requests, control modes, values, units,
//! parameters and faults are read from there, the other way round. A velocity drive of the AC/DC drive profile has a handful
//! of bits that its assemblies fix; its fault codes are those of `generic-cia402.toml`.
//!
//! A program sees a drive as a row of bytes, which the bus makes messages of:
//!
//! | byte | to a CIP Motion drive | from it | to a velocity drive | from it |
//! |---|---|---|---|---|
//! | 0 | Axis Control | Axis State | [`speed`] | its status byte |
//! | 1 | [`motion::MAY_RUN`] | [`motion::VALID`], [`motion::NODE_FAULT`] | 0 | state of the Control Supervisor |
//! | 2 | Control Mode | Control Mode | Control Mode | Control Mode |
//! | 3 | position, counts (i32) | position, counts (i32) | speed (i16) | speed (i16) |
//! | 7 | velocity, units per second (f32) | the same, by the box | | |
//! | 11 | torque, % rated (f32) | | | |

pub mod motion;
pub mod speed;

pub use self::motion::MotionAxis;
pub use self::speed::SpeedAxis;

use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::image::{CommandSet, Signal, StatusBits};
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::parameter::Parameter;
use profile_generic::program::BitPattern;
use profile_generic::state::Action;

use super::Mapping;
use super::cip_tables::CipTables;
use super::drive_program::{DriveProgram, MODE_SHIFT, ModeEntry, StatusRow};
use super::drive_rows::Full;

/// Bytes of a row, either way.
pub const ROW_LEN: usize = 15;

/// Byte of the Control Mode.
pub const MODE_AT: usize = 2;

/// Byte of the position, or of the speed of a velocity drive.
pub const POSITION_AT: usize = 3;

/// Byte of the velocity.
pub const VELOCITY_AT: usize = 7;

/// Byte of the torque.
pub const TORQUE_AT: usize = 11;

/// A drive of either kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DevicenetAxis {
    /// A CIP Motion drive.
    Motion(MotionAxis),
    /// A velocity drive.
    Speed(SpeedAxis),
}

/// Why a drive has no program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DevicenetError {
    /// No operating mode.
    #[error("expected at least one operating mode, got none")]
    NoMode,
    /// No `[[mode]]` row of cip-generic.toml has it.
    #[error("no [[mode]] row of cip-generic.toml for operating mode {0}")]
    Mode(ModeSelection),
    /// No `[[cyclic]]` row of cip-generic.toml has it.
    #[error("no [[cyclic]] row of cip-generic.toml for {0}")]
    Signal(Signal),
    /// No `[[request]]` row of cip-generic.toml has it.
    #[error("no [[request]] row of cip-generic.toml for what every drive needs")]
    Request,
    /// No `[[attribute]]` row of cip-generic.toml has it as REAL.
    #[error("no attribute of cip-generic.toml holds {0}")]
    Parameter(Parameter),
    /// It is no output assembly.
    #[error("expected output assembly 20 or 21, got {}", .0.0)]
    Assembly(Assembly),
    /// A ratio beyond 64 bits.
    #[error("the scaling does not fit 64 bits")]
    Overflow,
    /// A table does not fit the program.
    #[error(transparent)]
    Full(#[from] Full),
}

impl Mapping {
    /// The program of a drive on DeviceNet.
    ///
    /// # Errors
    /// The tables lack something, or a ratio does not fit 64 bits.
    pub fn devicenet_program(&self, axis: &DevicenetAxis) -> Result<DriveProgram, DevicenetError> {
        match axis {
            DevicenetAxis::Motion(axis) => self.devicenet_motion_program(axis),
            DevicenetAxis::Speed(axis) => self.devicenet_speed_program(axis),
        }
    }

    /// The program of a CIP Motion drive on DeviceNet.
    ///
    /// # Errors
    /// The tables lack something, or a ratio does not fit 64 bits.
    pub fn devicenet_motion_program(&self, axis: &MotionAxis) -> Result<DriveProgram, DevicenetError> {
        motion::program(&self.cip, axis)
    }

    /// The program of a velocity drive on DeviceNet.
    ///
    /// # Errors
    /// A ratio does not fit 64 bits, or the tables have no velocity mode.
    pub fn devicenet_speed_program(&self, axis: &SpeedAxis) -> Result<DriveProgram, DevicenetError> {
        speed::program(&self.cip, &self.cia402, axis)
    }
}

/// The Control Mode that is an operating mode.
fn control_mode(tables: &CipTables, mode: OperatingMode) -> Result<u8, DevicenetError> {
    let found = tables.modes.iter().position(|known| *known == Some(mode));
    found.and_then(|code| u8::try_from(code).ok()).ok_or(DevicenetError::Mode(mode.into()))
}

fn mode_entry(code: u8, mode: OperatingMode, carried: CommandSet) -> ModeEntry {
    let pattern = BitPattern::new(0xFF << MODE_SHIFT, u32::from(code) << MODE_SHIFT);
    ModeEntry {
        selection: mode.into(),
        control: pattern,
        status: pattern,
        // Its code is all that a mode changes.
        bits: BitPattern::default(),
        handshake: None,
        needs: carried,
        carried,
    }
}

fn mode_at() -> u16 {
    u16::try_from(MODE_AT).unwrap_or(u16::MAX)
}

/// Rows for status bits, one for each bit.
fn push_status(program: &mut DriveProgram, pattern: BitPattern, bits: StatusBits) -> Result<(), Full> {
    bits.iter().try_for_each(|bit| program.add_status(StatusRow { word: None, pattern, bit }))
}

/// Whether a drive may be enabled for an action.
const fn may_run(action: Action) -> bool {
    matches!(action, Action::Enable | Action::Halt)
}

/// What a drive can be ordered.
fn orders() -> impl Iterator<Item = Action> {
    Action::ALL.iter().copied().filter(|action| !matches!(action, Action::None | Action::Reject))
}

#[cfg(test)]
mod tests;
