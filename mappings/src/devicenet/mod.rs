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

use profile_cip::devicenet::wire::speed::{Assembly, SpeedStatus, SupervisorState};
use profile_generic::fault::{FaultCause, Reaction};
use profile_generic::image::{CommandSet, Signal, StatusBits};
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::parameter::Parameter;
use profile_generic::program::{BitPattern, Conversion, Field, Width};
use profile_generic::ratio::Ratio;
use profile_generic::state::{Action, DriveState, Report, Request};

use super::cip_scaling::CipScaling;
use super::cip_tables::{CipTables, Served};
use super::compile_cip::CipFault;
use super::dictionary::CipType;
use super::drive_program::{DriveProgram, FaultRow, MODE_SHIFT, ModeEntry, StatusRow, StepRow, Telegram};
use super::drive_rows::Full;
use super::item::Item;
use super::{Cia402Tables, Mapping};

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

/// Positions wrap after the counts of a DINT.
const FULL_RANGE: i64 = 1 << 32;

/// Row of a CIP Motion drive.
pub mod motion {
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
}

/// Row of a velocity drive.
pub mod speed {
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
}

/// A CIP Motion drive, as the configuration knows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MotionAxis {
    /// Its units.
    pub scaling: CipScaling,
    /// What it is used for.
    pub modes: Vec<OperatingMode>,
}

/// A velocity drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpeedAxis {
    /// Nanounits of the axis per second in a unit of its speed.
    pub speed: Ratio,
    /// Whether its assemblies are the extended ones.
    pub extended: bool,
}

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
        motion_program(&self.cip, axis)
    }

    /// The program of a velocity drive on DeviceNet.
    ///
    /// # Errors
    /// A ratio does not fit 64 bits, or the tables have no velocity mode.
    pub fn devicenet_speed_program(&self, axis: &SpeedAxis) -> Result<DriveProgram, DevicenetError> {
        speed_program(&self.cip, &self.cia402, axis)
    }

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

/// Rows for status bits, one for each bit.
fn push_status(program: &mut DriveProgram, pattern: BitPattern, bits: StatusBits) -> Result<(), Full> {
    bits.iter().try_for_each(|bit| program.add_status(StatusRow { word: None, pattern, bit }))
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

/// Whether a drive may be enabled for an action.
const fn may_run(action: Action) -> bool {
    matches!(action, Action::Enable | Action::Halt)
}

fn motion_program(tables: &CipTables, axis: &MotionAxis) -> Result<DriveProgram, DevicenetError> {
    let mut program = DriveProgram::new(Telegram::default(), false);
    program.mode_octets = Some([mode_at(); 2]);
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
    let axis_state = |state: DriveState| {
        let found = DriveState::ALL.iter().zip(&tables.states).find(|(known, _)| **known == state);
        found.map_or(0, |(_, row)| row.axis_state)
    };
    let shown = |state| {
        let valid = u32::from(motion::VALID) << 8;
        BitPattern::new(0xFF | valid, u32::from(axis_state(state)) | valid)
    };
    let node_fault = u32::from(motion::NODE_FAULT) << 8;
    let mut reports = vec![(BitPattern::new(node_fault, node_fault), Report::Faulted)];
    let known = DriveState::ALL.iter().filter_map(|state| Some((*state, report_of(*state)?)));
    reports.extend(known.map(|(state, report)| (shown(state), report)));
    if !reports.into_iter().all(|(pattern, report)| program.reports.push(pattern, report)) {
        return Err(Full("the table of reports").into());
    }
    for state in DriveState::ALL {
        push_status(&mut program, shown(*state), status_of(*state))?;
    }
    let word = |action, request: u8| {
        let may = if may_run(action) { u32::from(motion::MAY_RUN) << 8 } else { 0 };
        BitPattern::new(0xFFFF, u32::from(request) | may)
    };
    for action in
        Action::ALL.iter().copied().filter(|action| !matches!(action, Action::None | Action::Reject))
    {
        program.actions.set(action, word(action, 0));
    }
    for (action, state, request) in STEPS {
        let row = tables.requests.iter().find(|row| row.request == Some(request));
        let code = row.ok_or(DevicenetError::Request)?.axis_control;
        let step = StepRow { action, when: shown(state), control: word(action, code) };
        program.steps.try_push(step).map_err(|_| Full("the table of actions"))?;
    }
    // A fault of the node goes by Node Control, for which the same request stands.
    let reset = tables.requests.iter().find(|row| row.request == Some(Request::FaultReset));
    let code = reset.ok_or(DevicenetError::Request)?.axis_control;
    let step = StepRow {
        action: Action::ResetFault,
        when: BitPattern::new(node_fault, node_fault),
        control: word(Action::ResetFault, code),
    };
    program.steps.try_push(step).map_err(|_| Full("the table of actions"))?;
    let item = Item::attribute(motion::CLASS, motion::AXIS_FAULT);
    for (cause, fault) in &tables.faults {
        if let CipFault::Axis { fault_type, code, .. } = *fault {
            let value = u32::from(code) | u32::from(fault_type) << 8;
            program.add_faults([stopped(item, BitPattern::new(0xFFFF, value), *cause)])?;
        }
    }
    Ok(program)
}

/// A fault of the drive that has stopped it: it is none that only warns.
fn stopped(word: Item, pattern: BitPattern, cause: FaultCause) -> FaultRow {
    FaultRow { word, pattern, cause, reaction: cause.default_reaction().max(Reaction::DecelerateAndDisable) }
}

fn speed_program(
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
    for action in
        Action::ALL.iter().copied().filter(|action| !matches!(action, Action::None | Action::Reject))
    {
        let bits = match action {
            Action::ResetFault => speed::RESET,
            action if may_run(action) => speed::RUN,
            _ => 0,
        };
        program.actions.set(action, BitPattern::new(0xFF, u32::from(bits)));
    }
    for (pattern, report) in if axis.extended { extended_reports() } else { basic_reports() } {
        if !program.reports.push(pattern, report) {
            return Err(Full("the table of reports").into());
        }
        push_status(&mut program, pattern, speed_status_of(report))?;
    }
    push_status(&mut program, bit(SpeedStatus::FAULTED), StatusBits::FAULT)?;
    if axis.extended {
        push_status(&mut program, bit(SpeedStatus::AT_REFERENCE), StatusBits::AT_VELOCITY)?;
        push_status(&mut program, bit(SpeedStatus::WARNING), StatusBits::WARNING)?;
        // What it warns of has codes of the vendor.
        let word = Item::attribute(speed::CLASS_SUPERVISOR, speed::WARNING_CODE);
        let (cause, reaction) = (FaultCause::DRIVE_WARNING, Reaction::Alarm);
        program.add_faults([FaultRow { word, pattern: BitPattern::default(), cause, reaction }])?;
    }
    // The codes of FaultCode are those of the emergency object of CiA 402, both from DRIVECOM.
    let word = Item::attribute(speed::CLASS_SUPERVISOR, speed::FAULT_CODE);
    program.add_faults(cia402.faults().iter().map(|row| FaultRow { word, ..*row }))?;
    Ok(program)
}

/// What the state of the Control Supervisor says, and who commands the drive: one that runs by its own keys is not ready for
/// anybody else.
fn extended_reports() -> Vec<(BitPattern, Report)> {
    let state = |state: SupervisorState| BitPattern::new(0xFF00, u32::from(state.0) << 8);
    let led = u32::from((SpeedStatus::CONTROL_FROM_NET | SpeedStatus::REFERENCE_FROM_NET).bits());
    let enabled = state(SupervisorState::ENABLED);
    vec![
        (state(SupervisorState::FAULT_STOP), Report::FaultReaction),
        (state(SupervisorState::FAULTED), Report::Faulted),
        (state(SupervisorState::NOT_READY), Report::AwaitingPower),
        (state(SupervisorState::READY), Report::Ready),
        (BitPattern::new(enabled.mask | led, enabled.value | led), Report::Operating),
        (state(SupervisorState::STOPPING), Report::Stopping),
    ]
}

/// Status bits of what a velocity drive reports.
const fn speed_status_of(report: Report) -> StatusBits {
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

/// The basic assembly has two bits.
fn basic_reports() -> Vec<(BitPattern, Report)> {
    vec![
        (bit(SpeedStatus::FAULTED), Report::Faulted),
        (bit(SpeedStatus::RUNNING_FORWARD), Report::Operating),
        (BitPattern::new(0, 0), Report::Ready),
    ]
}

#[cfg(test)]
mod tests;
