//! CIP Motion drives on DeviceNet.

use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{CommandSet, Signal, StatusBits};
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::Parameter;
use profile_generic::program::{BitPattern, Conversion, Field, Width};
use profile_generic::ratio::Ratio;
use profile_generic::state::{Action, DriveState, Report, Request};

use super::{
    DevicenetError, POSITION_AT, TORQUE_AT, VELOCITY_AT, control_mode, may_run, mode_at, mode_entry, orders,
    push_status,
};
use crate::Mapping;
use crate::cip_scaling::CipScaling;
use crate::cip_tables::{CipTables, Served};
use crate::compile_cip::CipFault;
use crate::dictionary::CipType;
use crate::drive_program::{DriveProgram, FaultRow, StepRow, Telegram};
use crate::drive_rows::Full;
use crate::item::Item;

/// Positions wrap after the counts of a DINT.
const FULL_RANGE: i64 = 1 << 32;

/// Byte 1 to the drive: the axis may be enabled; without it a request to enable it is taken back.
pub const MAY_RUN: u8 = 1 << 0;
/// Byte 1 from the drive: it obeys, and what it says of its axis is valid.
pub const VALID: u8 = 1 << 0;
/// Byte 1 from the drive: its node has a fault.
pub const NODE_FAULT: u8 = 1 << 1;
/// Motion Device Axis Object.
pub const CLASS: u16 = 0x42;
/// Axis Fault Code (661) and, by an access of the same number, Axis Fault Type (662) as the byte above it.
pub const AXIS_FAULT: u16 = 661;

/// A CIP Motion drive, as the configuration knows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MotionAxis {
    /// Its units.
    pub scaling: CipScaling,
    /// What it is used for.
    pub modes: Vec<OperatingMode>,
}

impl Mapping {
    /// The attribute of a CIP Motion drive that holds a parameter, with its value there.
    ///
    /// # Errors
    /// There is none, or a ratio does not fit 64 bits.
    pub fn devicenet_parameter(
        &self,
        scaling: &CipScaling,
        parameter: Parameter,
        value: i64,
    ) -> Result<(u16, f32), DevicenetError> {
        let holds = |served: Served| match served {
            Served::Parameter { parameter: known, unit, .. } if known == parameter && !unit.reciprocal => {
                Some(unit)
            }
            _ => None,
        };
        let real = self.cip.attributes.iter().filter(|row| row.attribute.data_type == CipType::Real);
        let found = real.filter_map(|row| Some((row.attribute.id, holds(row.served)?))).next();
        let (id, unit) = found.ok_or(DevicenetError::Parameter(parameter))?;
        let ratio = scaling.convert(unit, false).and_then(Ratio::inverse).ok_or(DevicenetError::Overflow)?;
        let (outcome, saturated) = Conversion::new(ratio).convert_to_f32(value);
        if saturated { Err(DevicenetError::Overflow) } else { Ok((id, outcome.value)) }
    }
}

/// A value in a row.
fn field(tables: &CipTables, scaling: &CipScaling, signal: Signal) -> Result<Field, DevicenetError> {
    let row = tables.cyclic.iter().find(|row| row.signal == signal);
    let row = row.ok_or(DevicenetError::Signal(signal))?;
    let to_generic = scaling.convert(row.unit, row.turns).ok_or(DevicenetError::Overflow)?;
    let ratio = if signal.is_command() { to_generic.inverse() } else { Some(to_generic) };
    let (at, width, modulo) = match signal {
        Signal::PositionCommand | Signal::PositionActual => (POSITION_AT, Width::I32, Some(FULL_RANGE)),
        Signal::TorqueCommand => (TORQUE_AT, Width::F32, None),
        _ => (VELOCITY_AT, Width::F32, None),
    };
    let offset = u16::try_from(at).map_err(|_| DevicenetError::Overflow)?;
    let conversion = Conversion::new(ratio.ok_or(DevicenetError::Overflow)?);
    Ok(Field { signal, offset, width, conversion, modulo })
}

/// What an axis state of the drive is to the generic state machine: it is the state of the same name there. A drive that is
/// shut down waits for its Shutdown Reset as for power; nobody tests it, and a start inhibit is its own affair.
const fn report_of(state: DriveState) -> Option<Report> {
    match state {
        DriveState::NotReady | DriveState::Inhibited | DriveState::Testing => None,
        DriveState::AwaitingPower | DriveState::Shutdown => Some(Report::AwaitingPower),
        DriveState::Ready => Some(Report::Ready),
        DriveState::Starting => Some(Report::Enabling),
        DriveState::Operating => Some(Report::Operating),
        DriveState::Stopping => Some(Report::Stopping),
        DriveState::FaultReaction => Some(Report::FaultReaction),
        DriveState::Faulted => Some(Report::Faulted),
    }
}

/// Status bits of an axis state.
const fn status_of(state: DriveState) -> StatusBits {
    use StatusBits as S;
    match state {
        DriveState::NotReady | DriveState::Inhibited | DriveState::AwaitingPower => S::empty(),
        DriveState::Ready => S::READY.union(S::POWER),
        DriveState::Starting | DriveState::Testing | DriveState::Stopping => S::ENABLED.union(S::POWER),
        DriveState::Operating => S::ENABLED.union(S::POWER).union(S::TRACKING),
        DriveState::FaultReaction | DriveState::Faulted => S::FAULT,
        DriveState::Shutdown => S::SHUTDOWN,
    }
}

/// What is asked of the drive for an action, while it is in a state. The request stands only as long as it changes something;
/// torque that has to go at once goes by a shutdown, which is reset as soon as it is there.
const STEPS: [(Action, DriveState, Request); 14] = [
    (Action::Enable, DriveState::Ready, Request::Enable),
    (Action::Enable, DriveState::Shutdown, Request::ShutdownReset),
    (Action::Energize, DriveState::Shutdown, Request::ShutdownReset),
    (Action::Disable, DriveState::Shutdown, Request::ShutdownReset),
    (Action::TorqueOff, DriveState::Shutdown, Request::ShutdownReset),
    (Action::Disable, DriveState::Starting, Request::Disable),
    (Action::Disable, DriveState::Operating, Request::Disable),
    (Action::Disable, DriveState::Testing, Request::Disable),
    (Action::TorqueOff, DriveState::Starting, Request::Shutdown),
    (Action::TorqueOff, DriveState::Operating, Request::Shutdown),
    (Action::TorqueOff, DriveState::Testing, Request::Shutdown),
    (Action::TorqueOff, DriveState::Stopping, Request::Shutdown),
    (Action::ResetFault, DriveState::Faulted, Request::FaultReset),
    (Action::ResetFault, DriveState::Shutdown, Request::ShutdownReset),
];

pub(super) fn program(tables: &CipTables, axis: &MotionAxis) -> Result<DriveProgram, DevicenetError> {
    let mut program = DriveProgram::new(Telegram::default(), false);
    program.mode_octets = Some([mode_at(); 2]);
    add_values(&mut program, tables, axis)?;
    add_reports(&mut program, tables)?;
    add_requests(&mut program, tables)?;
    add_faults(&mut program, tables)?;
    Ok(program)
}

/// Set-points of the modes, the modes, and actual values.
fn add_values(
    program: &mut DriveProgram,
    tables: &CipTables,
    axis: &MotionAxis,
) -> Result<(), DevicenetError> {
    let mut carried = CommandSet::empty();
    for mode in &axis.modes {
        let (signal, _) = Signal::leading(*mode).ok_or(DevicenetError::Mode((*mode).into()))?;
        program.add_field(field(tables, &axis.scaling, signal)?)?;
        carried |= signal.command_bit();
    }
    if carried.is_empty() {
        return Err(DevicenetError::NoMode);
    }
    for mode in &axis.modes {
        let own = Signal::leading(*mode).map_or(CommandSet::empty(), |(signal, _)| signal.command_bit());
        program.add_mode(mode_entry(control_mode(tables, *mode)?, *mode, own))?;
    }
    for signal in [Signal::PositionActual, Signal::VelocityActual] {
        program.add_field(field(tables, &axis.scaling, signal)?)?;
    }
    Ok(())
}

/// The row of a drive that obeys, and whose axis is in this state.
fn shown(tables: &CipTables, state: DriveState) -> BitPattern {
    let found = DriveState::ALL.iter().zip(&tables.states).find(|(known, _)| **known == state);
    let axis_state = found.map_or(0, |(_, row)| row.axis_state);
    let valid = u32::from(VALID) << 8;
    BitPattern::new(0xFF | valid, u32::from(axis_state) | valid)
}

/// The row of a drive whose node has a fault.
const NODE_FAULTED: BitPattern = {
    let bit = (NODE_FAULT as u32) << 8;
    BitPattern::new(bit, bit)
};

/// What the axis states of the drive are to the generic model. A fault of the node comes first; it takes no torque away.
fn add_reports(program: &mut DriveProgram, tables: &CipTables) -> Result<(), DevicenetError> {
    let known = DriveState::ALL.iter().filter_map(|state| Some((*state, report_of(*state)?)));
    let known = known.map(|(state, report)| (shown(tables, state), report));
    let with_torque = DriveState::ALL.iter().filter(|state| state.may_have_torque()).map(|state| {
        let BitPattern { mask, value } = shown(tables, *state);
        (BitPattern::new(mask | NODE_FAULTED.mask, value | NODE_FAULTED.value), Report::FaultReaction)
    });
    for (pattern, report) in with_torque.chain([(NODE_FAULTED, Report::Faulted)]).chain(known) {
        if !program.reports.push(pattern, report) {
            return Err(Full("the table of reports").into());
        }
    }
    for state in DriveState::ALL {
        push_status(program, shown(tables, *state), status_of(*state))?;
    }
    Ok(())
}

/// What the drive is sent for an action.
fn word(action: Action, request: u8) -> BitPattern {
    let may = if may_run(action) { u32::from(MAY_RUN) << 8 } else { 0 };
    BitPattern::new(0xFFFF, u32::from(request) | may)
}

/// Axis Control of a request.
fn axis_control(tables: &CipTables, request: Request) -> Result<u8, DevicenetError> {
    let row = tables.requests.iter().find(|row| row.request == Some(request));
    Ok(row.ok_or(DevicenetError::Request)?.axis_control)
}

fn add_requests(program: &mut DriveProgram, tables: &CipTables) -> Result<(), DevicenetError> {
    for action in orders() {
        program.actions.set(action, word(action, 0));
    }
    let of_state = STEPS.map(|(action, state, request)| (action, shown(tables, state), request));
    // A fault of the node goes by Node Control, for which the same request stands.
    let of_node = (Action::ResetFault, NODE_FAULTED, Request::FaultReset);
    for (action, when, request) in of_state.into_iter().chain([of_node]) {
        let control = word(action, axis_control(tables, request)?);
        let step = StepRow { action, when, control, other_mode: None };
        program.steps.try_push(step).map_err(|_| Full("the table of actions"))?;
    }
    Ok(())
}

fn add_faults(program: &mut DriveProgram, tables: &CipTables) -> Result<(), DevicenetError> {
    let item = Item::attribute(CLASS, AXIS_FAULT);
    for (cause, fault) in &tables.faults {
        if let CipFault::Axis { fault_type, code, .. } = *fault {
            let value = u32::from(code) | u32::from(fault_type) << 8;
            program.add_faults([stopped(item, BitPattern::new(0xFFFF, value), *cause)])?;
        }
    }
    Ok(())
}

/// A fault of the drive that has stopped it: it is none that only warns.
fn stopped(word: Item, pattern: BitPattern, cause: FaultCause) -> FaultRow {
    FaultRow { word, pattern, cause, reaction: cause.default_reaction().max(Reaction::DecelerateAndDisable) }
}
