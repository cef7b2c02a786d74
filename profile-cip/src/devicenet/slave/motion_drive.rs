//! A simulated CIP Motion drive on DeviceNet: the Motion Device Axis Object of this crate in the fixed format, in front of a
//! simulated servo.
//!
//! The poll connection carries the 16 octets of the fixed format each way, in three fragments. Its first message opens the
//! motion connection; the expected packet rate is the Controller Update Period. What needs a service (Configuration
//! Complete, attribute 89, among it) comes by explicit message.
//!
//! | what happens to the poll connection | the motion connection |
//! |---|---|
//! | established | opens with the first message |
//! | another rate | closes, and opens anew with the next message |
//! | times out | is lost: Control Connection Loss Fault, the axis stops |
//! | released, deleted | closes: the axis is without torque and initializes |
//! | a message without data | none: updates that are missing count as missing |
//!
//! The device forgets its attributes when a connection is opened or closed (5-2.3, note 3). This drive has them in a memory that outlives
//! that, and a Reset of type 0: only one of type 1 brings back the values of its maker.
//!
//! Units (IEC 61800-7-202, Table 35): the position control unit is the encoder count, velocity and acceleration are in
//! revolutions per second and per second squared, torque is % of the rated one.

use core::net::{Ipv4Addr, SocketAddrV4};

use arrayvec::ArrayVec;
use profile_generic::cast;
use profile_generic::fault::FaultCause;
use profile_generic::image::StatusBits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::servo::{Servo, ServoActual, ServoCommand, ServoControl, ServoError, ServoParameters};
use profile_generic::state::Report;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::super::connection::{Change, Connection, ConnectionKind, ConnectionSetup, ConnectionState};
use super::super::fragmentation::{Body, IoData};
use super::super::wire::{MacId, Request};
use super::application::{Application, ServiceError};
use super::explicit::{append, path_of};
use crate::device::AxisConfig;
use crate::device::attribute::{Access, AttributeDefinition};
use crate::device::axis::drive_link::{
    AxisCommandImage, Command, DriveAction, DriveCondition, DriveConditions, DriveImage, ExceptionAction,
    SetPoints,
};
use crate::device::axis::state::{AxisState, ControlKind};
use crate::device::config::MOTION_SIZE_FIXED;
use crate::device::event::ResetKind;
use crate::device::motion::device::{DeviceConfig, DeviceError, MotionDevice};
use crate::device::motion_link::{
    CloseParameters, ConnectionTriad, EXPLICIT_DATA_MAX, ExplicitRequest, MotionReply, MotionRequest,
    OpenParameters, Token,
};
use crate::device::objects::class::CLASS_MOTION_DEVICE_AXIS;
use crate::device::objects::identity::{Health, ModuleState};
use crate::wire::motion::codes::{ControlMode, FaultType};
use crate::wire::motion::{CommandPosition, FORMAT_REVISION, Format, fixed};
use crate::wire::status::GeneralStatus;

/// Period of the simulation.
const STEP: DurationNs = DurationNs::from_millis(1);

/// Longest time that is made up for in one call; a simulation that stood still for longer goes on from there.
const BACKLOG: DurationNs = DurationNs::from_millis(100);

/// Transport class and trigger of the motion connection (IEC 61800-7-302, 5.2): server, cyclic, class 1. On DeviceNet a
/// class 1 message has no sequence count.
const TRANSPORT: u8 = 0x81;

/// Path to the Motion Device Axis Object, which the connection produces and consumes.
const PATH: [u8; 4] = [0x20, 0x42, 0x24, 0x01];

/// Axis Fault Action: ramped stop, then disable.
const RAMP_AND_DISABLE: u8 = 0x22;
/// Axis Fault Action: coast, then disable.
const COAST_AND_DISABLE: u8 = 0x24;
/// The stop in an Axis Fault Action that lets the axis coast.
const COAST: u8 = 4;

/// Code of a fault without row in [`MotionDriveConfig::faults`], among Axis Faults - Mfg.
const OTHER_FAULT: u8 = 1;

const NANO: i128 = 1_000_000_000;

/// What the drive is made of.
#[derive(Debug, Clone)]
pub struct MotionDriveConfig {
    /// Attributes of the Motion Device Axis Object beside those of the engine; all of them are kept in the device. Those that a service
    /// sets outlive connections and resets.
    pub attributes: Vec<AttributeDefinition>,
    /// Axis Fault (attribute 657) of the servo's faults: bit number. What is not here is Axis Fault - Mfg 1.
    pub faults: Vec<(FaultCause, u8)>,
    /// Mechanics and loops of the simulated axis.
    pub servo: ServoParameters,
}

/// Why a drive cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MotionDriveError {
    /// The device.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The servo.
    #[error(transparent)]
    Servo(#[from] ServoError),
}

/// A CIP Motion drive in the fixed format, with a simulated axis.
pub struct MotionDrive {
    config: MotionDriveConfig,
    device: MotionDevice,
    servo: Servo,
    actual: ServoActual,
    image: DriveImage,
    power: bool,
    /// Next step of the simulation.
    next: Option<MonotonicTime>,
    /// State and rate of the poll connection, and its master.
    established: Option<(u16, MacId)>,
    tokens: u64,
}

impl core::fmt::Debug for MotionDrive {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("MotionDrive").field("actual", &self.actual).finish_non_exhaustive()
    }
}

fn device(config: &MotionDriveConfig) -> Result<MotionDevice, DeviceError> {
    let modes = [ControlMode::POSITION, ControlMode::VELOCITY, ControlMode::TORQUE];
    MotionDevice::new(DeviceConfig {
        format: Format::Fixed,
        axes: vec![AxisConfig {
            kind: ControlKind::Active,
            control_modes: modes.iter().map(|mode| 1 << mode.0).sum(),
            // Motor feedback.
            feedback_modes: 1 << 2,
            lint_position: false,
            hookup_tests: 0,
        }],
        attributes: config.attributes.clone(),
        power_structure_class_id: 0,
        supports_sync: false,
        sync_threshold: None,
        transmission_processing_ns: 0,
    })
}

impl MotionDrive {
    /// A drive with power.
    ///
    /// # Errors
    /// Attributes or servo parameters are not usable.
    pub fn new(config: MotionDriveConfig) -> Result<Self, MotionDriveError> {
        Ok(Self {
            device: device(&config)?,
            servo: Servo::new(config.servo)?,
            config,
            actual: ServoActual::default(),
            image: DriveImage::default(),
            power: true,
            next: None,
            established: None,
            tokens: 0,
        })
    }

    /// The servo, to look at it.
    #[must_use]
    pub const fn servo(&self) -> &Servo {
        &self.servo
    }

    /// The servo, to load it and to raise faults.
    pub const fn servo_mut(&mut self) -> &mut Servo {
        &mut self.servo
    }

    /// What the servo did in the last step.
    #[must_use]
    pub const fn actual(&self) -> &ServoActual {
        &self.actual
    }

    /// The motion device, to look at it.
    #[must_use]
    pub const fn device(&self) -> &MotionDevice {
        &self.device
    }

    /// The motion device, to change what it holds.
    pub const fn device_mut(&mut self) -> &mut MotionDevice {
        &mut self.device
    }

    /// Switches main power.
    pub fn set_power(&mut self, on: bool) {
        self.power = on;
    }

    /// State of the axis.
    #[must_use]
    pub fn axis_state(&self) -> AxisState {
        self.device.axis_state(0).unwrap_or(AxisState::Initializing)
    }

    // -- units --------------------------------------------------------------------------------------------------

    fn counts_per_unit(&self) -> i128 {
        i128::from(self.config.servo.encoder_counts)
    }

    /// Nanounits of so many counts.
    fn nanounits(&self, counts: i64) -> i64 {
        saturate(i128::from(counts) * NANO / self.counts_per_unit())
    }

    fn counts(&self, nanounits: i64) -> i64 {
        saturate((i128::from(nanounits) * self.counts_per_unit()).div_euclid(NANO))
    }

    // -- simulation ---------------------------------------------------------------------------------------------

    /// One step: what the axis has to do goes to the servo, and what became of it back.
    fn step(&mut self, now: MonotonicTime) {
        if let Some(command) = self.device.command(0, now) {
            let reset = command.reset_id != self.image.reset_id;
            let order = self.servo_command(&command, reset);
            self.actual = self.servo.step(STEP.0, &order);
            self.image = self.drive_image(&command);
            self.device.set_drive(0, self.image);
        }
        self.device.poll(now, None);
        while let Some(reply) = self.device.poll_reply() {
            // Only the loss of the connection comes by itself, and it shows in the state of the axis.
            debug_assert!(matches!(reply, MotionReply::ConnectionLost { .. }), "{reply:?}");
        }
    }

    fn has_torque(&self) -> bool {
        matches!(
            self.actual.report,
            Report::Enabling | Report::Operating | Report::Halted | Report::Stopping | Report::FaultReaction
        )
    }

    fn servo_command(&self, command: &AxisCommandImage, reset_fault: bool) -> ServoCommand {
        let still = ServoCommand {
            control: ServoControl::TorqueOff,
            power: self.power,
            reset_fault,
            mode: OperatingMode::Velocity,
            position: self.actual.position,
            ..ServoCommand::default()
        };
        let control = match command.action {
            DriveAction::Enable => ServoControl::Enable,
            DriveAction::Disable | DriveAction::Shutdown => ServoControl::Disable,
            DriveAction::Abort => match command.abort {
                Some(order) if order.action & 0x0F == COAST => ServoControl::TorqueOff,
                _ => ServoControl::Disable,
            },
            // No hookup test is offered.
            DriveAction::None | DriveAction::PowerUp | DriveAction::Test => ServoControl::TorqueOff,
        };
        match (control, command.command) {
            (ServoControl::Enable, Command::Follow(set_points)) => self.follow(still, &set_points),
            // Energized without anything to follow: it stands.
            (ServoControl::Enable, Command::Withheld(_)) if self.actual.report == Report::Operating => {
                ServoCommand { control: ServoControl::Halt, ..still }
            }
            _ => ServoCommand { control, ..still },
        }
    }

    fn follow(&self, still: ServoCommand, set_points: &SetPoints) -> ServoCommand {
        let values = &set_points.values;
        let command = ServoCommand { control: ServoControl::Enable, ..still };
        match set_points.control_mode {
            ControlMode::POSITION => {
                let Some(CommandPosition::Integer(position)) = values.position else { return command };
                let wanted = i64::from(position).saturating_sub(set_points.position_reference);
                // A DINT wraps: of all positions that it may stand for, the one next to where the axis is.
                let here = self.counts(self.actual.position.0);
                let way = i64::from(low_word(wanted.wrapping_sub(here)));
                let position = Position(self.nanounits(here.saturating_add(way)));
                ServoCommand { mode: OperatingMode::Position, position, ..command }
            }
            ControlMode::VELOCITY => {
                let velocity = f64::from(values.velocity.unwrap_or(0.0)) * 1e9;
                let velocity = Velocity(cast::i64_from_f64(velocity));
                ServoCommand { velocity, ..command }
            }
            ControlMode::TORQUE => {
                let torque = f64::from(values.torque.unwrap_or(0.0)) * 10_000.0;
                let torque = Torque(cast::i64_from_f64(torque));
                ServoCommand { mode: OperatingMode::Torque, torque, ..command }
            }
            _ => ServoCommand { control: ServoControl::Disable, ..still },
        }
    }

    fn drive_image(&self, command: &AxisCommandImage) -> DriveImage {
        let actual = &self.actual;
        let enable = command.action == DriveAction::Enable;
        let operating = matches!(actual.report, Report::Operating | Report::Halted);
        let (velocity, acceleration) = (actual.velocity.0, actual.acceleration.0);
        DriveImage {
            online: true,
            action_id: command.action_id,
            reset_id: command.reset_id,
            bus_up: !matches!(actual.report, Report::NotReady | Report::AwaitingPower),
            start_complete: enable && operating,
            stop_complete: !enable && !self.has_torque() && actual.status.contains(StatusBits::STANDSTILL),
            power_enabled: self.has_torque(),
            tracking: enable && actual.report == Report::Operating,
            conditions: self.conditions(),
            position: self.counts(actual.position.0),
            velocity: Some(units(velocity)),
            acceleration: Some(units(acceleration)),
            torque: Some(narrow(cast::f64_from_i64(actual.torque.0) / 10_000.0)),
            ..DriveImage::default()
        }
    }

    fn conditions(&self) -> DriveConditions {
        let Some(cause) = self.actual.fault else { return DriveConditions::default() };
        let known = self.config.faults.iter().find(|(known, _)| *known == cause);
        let (fault_type, code) =
            known.map_or((FaultType::AXIS_MFG, OTHER_FAULT), |(_, code)| (FaultType::AXIS, *code));
        let action = if self.has_torque() { RAMP_AND_DISABLE } else { COAST_AND_DISABLE };
        let least = ExceptionAction::MAJOR_FAULT;
        let detail = u32::from(cause.0);
        DriveConditions::of(&[DriveCondition {
            fault_type,
            code,
            detail,
            action,
            least,
            ..DriveCondition::default()
        }])
    }

    // -- motion connection --------------------------------------------------------------------------------------

    fn token(&mut self) -> Token {
        self.tokens += 1;
        Token(self.tokens)
    }

    fn request(&mut self, now: MonotonicTime, request: MotionRequest) -> Option<MotionReply> {
        let token = request.token();
        self.device.request(now, None, request);
        let mine = |reply: &MotionReply| match reply {
            MotionReply::Opened { token: of, .. }
            | MotionReply::Closed { token: of }
            | MotionReply::ResetPrepared { token: of, .. } => *of == token,
            MotionReply::Explicit(reply) => reply.token == token,
            MotionReply::ConnectionLost { .. } => false,
        };
        core::iter::from_fn(|| self.device.poll_reply()).find(mine)
    }

    fn open(&mut self, now: MonotonicTime, rate_ms: u16, master: MacId) {
        let rpi_us = u32::from(rate_ms) * 1000;
        let parameters = OpenParameters {
            token: self.token(),
            triad: TRIAD,
            o_to_t_id: 1,
            t_to_o_id: 1,
            originator: address(master),
            t_to_o_destination: SocketAddrV4::new(address(master), 0),
            rpi_us,
            timeout_us: u64::from(rpi_us) * 4,
            o_to_t_size: MOTION_SIZE_FIXED,
            t_to_o_size: MOTION_SIZE_FIXED,
            o_to_t_variable: false,
            t_to_o_variable: false,
            t_to_o_dscp: 0,
            format_revision: FORMAT_REVISION,
            configuration_bits: 0,
            assembly: None,
        };
        let reply = self.keeping(|drive| drive.request(now, MotionRequest::Open(parameters)));
        debug_assert!(matches!(reply, Some(MotionReply::Opened { outcome: Ok(()), .. })), "{reply:?}");
    }

    fn close(&mut self, now: MonotonicTime) {
        let token = self.token();
        let close = CloseParameters { token, triad: TRIAD, o_to_t_id: 1 };
        self.keeping(|drive| drive.request(now, MotionRequest::Close(close)));
    }

    /// Does what makes the device forget its attributes, and gives it back those that a service sets.
    fn keeping<T>(&mut self, act: impl FnOnce(&mut Self) -> T) -> T {
        let settable = self.config.attributes.iter().filter(|one| one.access == Access::Set);
        let ids: Vec<u16> = settable.map(|one| one.id).collect();
        let value = |id: &u16| self.device.attribute(0, *id).map(<[u8]>::to_vec).unwrap_or_default();
        let values: Vec<Vec<u8>> = ids.iter().map(value).collect();
        let result = act(self);
        for (id, value) in ids.into_iter().zip(values) {
            // What was read of the same attribute fits it.
            let put = self.device.put_attribute(0, id, &value);
            debug_assert_eq!(put, Ok(()), "{id}");
        }
        result
    }
}

/// There is one connection, and nobody sees its triad.
const TRIAD: ConnectionTriad =
    ConnectionTriad { connection_serial: 1, originator_vendor: 0, originator_serial: 0 };

/// A node of DeviceNet where the motion device wants the address of an originator.
const fn address(mac: MacId) -> Ipv4Addr {
    Ipv4Addr::new(0, 0, 0, mac.get())
}

fn saturate(value: i128) -> i64 {
    i64::try_from(value).unwrap_or(if value < 0 { i64::MIN } else { i64::MAX })
}

/// The low 32 bits, with their sign.
fn low_word(value: i64) -> i32 {
    let [a, b, c, d, ..] = value.to_le_bytes();
    i32::from_le_bytes([a, b, c, d])
}

/// Units of so many nanounits.
fn units(nanounits: i64) -> f32 {
    narrow(cast::f64_from_i64(nanounits) / 1e9)
}

#[expect(clippy::cast_possible_truncation, reason = "a REAL has fewer digits; rounding is what is wanted")]
fn narrow(value: f64) -> f32 {
    value as f32
}

impl Application for MotionDrive {
    fn setup(&self, kind: ConnectionKind) -> Option<ConnectionSetup> {
        let size = u16::try_from(fixed::LEN).unwrap_or(u16::MAX);
        (kind == ConnectionKind::Poll).then_some(ConnectionSetup {
            transport: TRANSPORT,
            produced_size: size,
            consumed_size: size,
            supervised: true,
        })
    }

    fn paths(&self, kind: ConnectionKind) -> (&[u8], &[u8]) {
        if kind == ConnectionKind::Poll { (&PATH, &PATH) } else { (&[], &[]) }
    }

    fn classes(&self) -> &[u16] {
        &[CLASS_MOTION_DEVICE_AXIS]
    }

    fn serve(
        &mut self,
        now: MonotonicTime,
        originator: MacId,
        request: &Request<'_>,
        reply: &mut Body,
    ) -> Result<(), ServiceError> {
        let (path, data) = path_of(request)?;
        let mut octets = ArrayVec::<u8, EXPLICIT_DATA_MAX>::new();
        octets.try_extend_from_slice(data).map_err(|_| GeneralStatus::TOO_MUCH_DATA)?;
        let request = ExplicitRequest {
            token: self.token(),
            originator: address(originator),
            service: request.service.0,
            path,
            data: octets,
        };
        match self.request(now, MotionRequest::Explicit(request)) {
            Some(MotionReply::Explicit(answer)) if answer.general_status == 0 => append(reply, &answer.data),
            Some(MotionReply::Explicit(answer)) if answer.data.is_empty() => {
                Err(GeneralStatus(answer.general_status).into())
            }
            // A list says by attribute what is wrong, and there is no place for that in a refusal on DeviceNet.
            Some(MotionReply::Explicit(answer)) => append(reply, &answer.data),
            _ => Err(GeneralStatus::DEVICE_STATE_CONFLICT.into()),
        }
    }

    fn consume(&mut self, now: MonotonicTime, _: ConnectionKind, data: &[u8]) {
        if data.is_empty() {
            return;
        }
        if let Some((rate_ms, master)) = self.established
            && self.device.connection().is_none()
        {
            self.open(now, rate_ms, master);
        }
        self.device.handle_unsequenced(now, None, data);
    }

    fn produce(&mut self, now: MonotonicTime, _: ConnectionKind, data: &mut IoData) {
        let mut update = [0; fixed::LEN];
        if let Some(len) = self.device.poll_unsequenced(now, None, &mut update) {
            data.extend(update[..len].iter().copied());
        }
    }

    fn take_change(&mut self) -> bool {
        false
    }

    fn connection_changed(
        &mut self,
        now: MonotonicTime,
        connection: &Connection,
        change: Change,
        master: MacId,
    ) {
        if connection.kind() != ConnectionKind::Poll {
            return;
        }
        self.established =
            (change.after == ConnectionState::ESTABLISHED).then(|| (connection.rate_ms(), master));
        // What has timed out times out in the motion device as well, with its fault.
        if change.after != ConnectionState::TIMED_OUT && self.device.connection().is_some() {
            self.close(now);
        }
    }

    fn handle_time(&mut self, now: MonotonicTime) {
        let mut next = self.next.unwrap_or(now);
        if now.since(next) > BACKLOG {
            next = now;
        }
        while next <= now {
            self.step(next);
            next = next + STEP;
        }
        self.next = Some(next);
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        Some(self.next.unwrap_or(MonotonicTime::ZERO))
    }

    fn health(&self) -> Health {
        let state = ModuleState::of_axis(self.axis_state().code(), false);
        Health { state, ..Health::default() }
    }

    fn permits_reset(&mut self, now: MonotonicTime) -> bool {
        let token = self.token();
        let reply = self.request(now, MotionRequest::PrepareReset(token));
        matches!(reply, Some(MotionReply::ResetPrepared { granted: true, .. }))
    }

    fn reset(&mut self, kind: ResetKind) {
        let again = |drive: &mut Self| {
            // It has been built from this configuration before.
            if let Ok(device) = device(&drive.config) {
                drive.device = device;
            }
        };
        match kind {
            ResetKind::PowerCycle => self.keeping(again),
            ResetKind::FactoryDefaults => again(self),
        }
        self.image = DriveImage::default();
        self.established = None;
    }
}
