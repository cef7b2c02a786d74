//! Velocity drives of the AC/DC drive profile on DeviceNet.

use profile_cip::devicenet::wire::speed::{SpeedStatus, SupervisorState};
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{Signal, StatusBits};
use profile_generic::mode::OperatingMode;
use profile_generic::program::{BitPattern, Conversion, Field, Width};
use profile_generic::ratio::Ratio;
use profile_generic::state::{Action, Report};

use super::{DevicenetError, POSITION_AT, control_mode, may_run, mode_at, mode_entry, orders, push_status};
use crate::Cia402Tables;
use crate::cip_tables::CipTables;
use crate::drive_program::{DriveProgram, FaultRow, Telegram};
use crate::drive_rows::Full;
use crate::item::Item;

/// Byte 0 to the drive: it is to run.
pub const RUN: u8 = 1 << 0;
/// Byte 0 to the drive: its fault is to be reset.
pub const RESET: u8 = 1 << 1;
/// Motor Data object.
pub const CLASS_MOTOR: u16 = 0x28;
/// Control Supervisor object.
pub const CLASS_SUPERVISOR: u16 = 0x29;
/// Its attribute FaultCode.
pub const FAULT_CODE: u16 = 13;
/// Its attribute WarningCode.
pub const WARNING_CODE: u16 = 14;
/// AC/DC Drive object.
pub const CLASS_DRIVE: u16 = 0x2A;
/// Its attribute SpeedScale.
pub const SPEED_SCALE: u16 = 22;

/// A velocity drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpeedAxis {
    /// Nanounits of the axis per second in a unit of its speed.
    pub speed: Ratio,
    /// Whether its assemblies are the extended ones.
    pub extended: bool,
}

pub(super) fn program(
    cip: &CipTables,
    cia402: &Cia402Tables,
    axis: &SpeedAxis,
) -> Result<DriveProgram, DevicenetError> {
    let mut program = DriveProgram::new(Telegram::default(), false);
    program.mode_octets = Some([mode_at(); 2]);
    let offset = u16::try_from(POSITION_AT).map_err(|_| DevicenetError::Overflow)?;
    let value = |signal, conversion| Field { signal, offset, width: Width::I16, conversion, modulo: None };
    let to_drive = Conversion::new(axis.speed.inverse().ok_or(DevicenetError::Overflow)?);
    // The basic assembly has no reverse: such a command cannot be carried out.
    let to_drive = if axis.extended { to_drive } else { to_drive.within(0, i64::from(i16::MAX)) };
    program.add_field(value(Signal::VelocityCommand, to_drive))?;
    program.add_field(value(Signal::VelocityActual, Conversion::new(axis.speed)))?;
    let velocity = OperatingMode::Velocity;
    let carried = Signal::VelocityCommand.command_bit();
    program.add_mode(mode_entry(control_mode(cip, velocity)?, velocity, carried))?;
    for action in orders() {
        let bits = match action {
            Action::ResetFault => RESET,
            action if may_run(action) => RUN,
            _ => 0,
        };
        program.actions.set(action, BitPattern::new(0xFF, u32::from(bits)));
    }
    for (pattern, report) in if axis.extended { extended_reports() } else { basic_reports() } {
        if !program.reports.push(pattern, report) {
            return Err(Full("the table of reports").into());
        }
        push_status(&mut program, pattern, status_of(report))?;
    }
    push_status(&mut program, bit(SpeedStatus::FAULTED), StatusBits::FAULT)?;
    if axis.extended {
        push_status(&mut program, bit(SpeedStatus::AT_REFERENCE), StatusBits::AT_VELOCITY)?;
        push_status(&mut program, bit(SpeedStatus::WARNING), StatusBits::WARNING)?;
        // What it warns of has codes of the vendor.
        let word = Item::attribute(CLASS_SUPERVISOR, WARNING_CODE);
        let (cause, reaction) = (FaultCause::DRIVE_WARNING, Reaction::Alarm);
        program.add_faults([FaultRow { word, pattern: BitPattern::default(), cause, reaction }])?;
    }
    // The codes of FaultCode are those of the emergency object of CiA 402, both from DRIVECOM.
    let word = Item::attribute(CLASS_SUPERVISOR, FAULT_CODE);
    program.add_faults(cia402.faults().iter().map(|row| FaultRow { word, ..*row }))?;
    Ok(program)
}

/// What the state of the Control Supervisor says, and who commands the drive: one that runs by its own keys is not ready for
/// anybody else.
fn extended_reports() -> Vec<(BitPattern, Report)> {
    let state = |state: SupervisorState| BitPattern::new(0xFF00, u32::from(state.0) << 8);
    let by_network = u32::from((SpeedStatus::CONTROL_FROM_NET | SpeedStatus::REFERENCE_FROM_NET).bits());
    let enabled = state(SupervisorState::ENABLED);
    vec![
        (state(SupervisorState::FAULT_STOP), Report::FaultReaction),
        (state(SupervisorState::FAULTED), Report::Faulted),
        (state(SupervisorState::NOT_READY), Report::AwaitingPower),
        (state(SupervisorState::READY), Report::Ready),
        (BitPattern::new(enabled.mask | by_network, enabled.value | by_network), Report::Operating),
        (state(SupervisorState::STOPPING), Report::Stopping),
    ]
}

/// Status bits of what a velocity drive reports.
const fn status_of(report: Report) -> StatusBits {
    use StatusBits as S;
    match report {
        Report::Ready => S::READY.union(S::POWER),
        Report::Operating => S::ENABLED.union(S::POWER).union(S::TRACKING),
        Report::Stopping => S::ENABLED.union(S::POWER),
        _ => S::empty(),
    }
}

/// A bit that is set.
fn bit(bit: SpeedStatus) -> BitPattern {
    BitPattern::new(u32::from(bit.bits()), u32::from(bit.bits()))
}

/// The basic assembly has two bits. In Fault_Stop, in which the drive still brakes, it shows both.
fn basic_reports() -> Vec<(BitPattern, Report)> {
    let (faulted, running) = (bit(SpeedStatus::FAULTED), bit(SpeedStatus::RUNNING_FORWARD));
    vec![
        (BitPattern::new(faulted.mask | running.mask, faulted.value | running.value), Report::FaultReaction),
        (faulted, Report::Faulted),
        (running, Report::Operating),
        (BitPattern::new(0, 0), Report::Ready),
    ]
}
