//! Tests of the motion device in virtual time, with a controller and drives that are as simple as can be.

mod events;
mod faults;
mod fixed;
mod handshake;
mod hookup;
mod indicators;
mod owner;
mod planes;
mod refusals;
mod requests;
mod reset;
mod robustness;
mod services;
mod startup;
mod timing;

use std::net::{Ipv4Addr, SocketAddrV4};

use profile_generic::time::{MonotonicTime, SystemTime};

use crate::device::AxisConfig;
use crate::device::attribute::{
    Access, AttributeDefinition, Backing, DataType, DefaultValue, ElementRule, Scope,
};
use crate::device::axis::drive_link::{
    AxisCommandImage, Command, DriveAction, DriveCondition, DriveConditions, DriveImage, ExceptionAction,
    SetPoints, Withheld,
};
use crate::device::axis::state::{AxisState, ControlKind};
use crate::device::motion::device::{DeviceConfig, MotionDevice, SyncState};
use crate::device::motion_link::{
    CloseParameters, ConnectionTriad, MotionReply, MotionRequest, OpenParameters, Token,
};
use crate::wire::motion::codes::{
    ActualDataSet, AxisControl, ControlMode, ControlStatus, EventChecking, MotionService, NodeControl,
    StatusDataSet, TimeDataSet,
};
use crate::wire::motion::{
    ActualBlock, ActualFrame, ActualHeader, ActualPosition, ActualValues, CommandBlock, CommandEvents,
    CommandHeader, CommandInstance, CommandPosition, CommandValues, CommandWriter, Format, ServiceRequest,
};

/// Controller Update Period, ns.
pub(crate) const PERIOD: u64 = 2_000_000;
/// System time at monotonic time 0, ns.
pub(crate) const EPOCH: u64 = 1_700_000_000_000_000_000;
pub(crate) const GRANDMASTER: [u8; 8] = [1, 2, 3, 4, 5, 6, 7, 8];
pub(crate) const TRIAD: ConnectionTriad =
    ConnectionTriad { connection_serial: 7, originator_vendor: 1, originator_serial: 99 };

/// A drive that obeys after one cycle.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FakeDrive {
    pub image: DriveImage,
    /// Stays put: neither start nor stop ends.
    pub stuck: bool,
    /// The fault comes back at once after a reset.
    pub sticky: bool,
    /// An abort ends at rest with torque.
    pub holds: bool,
    /// It is still busy with the reset of its faults.
    pub resetting: bool,
}

impl FakeDrive {
    fn new() -> Self {
        let events = EventChecking::HOME_POSITIVE;
        let image = DriveImage {
            online: true,
            bus_up: true,
            velocity: Some(0.0),
            acceleration: Some(0.0),
            events,
            events_checking: events,
            ..DriveImage::default()
        };
        Self { image, stuck: false, sticky: false, holds: false, resetting: false }
    }

    fn step(&mut self, command: &AxisCommandImage) {
        if command.reset_id != self.image.reset_id && !self.resetting {
            self.image.reset_id = command.reset_id;
            if !self.sticky {
                self.image.conditions = DriveConditions::default();
            }
        }
        if command.action_id != self.image.action_id {
            self.image.action_id = command.action_id;
            self.image.start_complete = false;
            self.image.stop_complete = false;
            self.image.tracking = false;
            return;
        }
        if !self.stuck {
            let enabled = matches!(command.action, DriveAction::Enable | DriveAction::Test);
            self.image.start_complete = enabled;
            self.image.tracking = command.action == DriveAction::Enable;
            let held = self.holds && command.action == DriveAction::Abort;
            self.image.power_enabled = enabled || held;
            self.image.stop_complete = !enabled;
        }
    }
}

/// Service request as owned octets: transaction, code, body.
pub(crate) type OwnedService = Option<(u8, MotionService, Vec<u8>)>;

pub(crate) struct Rig {
    pub device: MotionDevice,
    pub now: u64,
    pub sequence: u16,
    pub update_id: u8,
    pub control: NodeControl,
    pub time: TimeDataSet,
    pub blocks: Vec<CommandBlock>,
    pub services: Vec<OwnedService>,
    pub events: Option<CommandEvents>,
    pub drives: Vec<FakeDrive>,
    /// The last D-to-C packet.
    pub packet: Vec<u8>,
    pub t_to_o_size: u16,
    /// Controller Update Period of the connections to come, ns.
    pub period: u64,
    token: u64,
}

/// The exceptions that an axis finds itself stop it, as long as the controller says nothing else; others are ignored.
fn exception_rules() -> Vec<ElementRule> {
    let rule = |code| ElementRule {
        keeps: None,
        default: DefaultValue::Integer(if matches!(code, 60 | 62) { 3 } else { 0 }),
        range: (0.0, 255.0),
    };
    (0..64).map(rule).collect()
}

pub(crate) fn definitions() -> Vec<AttributeDefinition> {
    let new =
        |id, data_type| AttributeDefinition::new(Scope::Instance, id, data_type, Access::Set, "an attribute");
    vec![
        AttributeDefinition { settable_in_running: true, ..new(461, DataType::Real) },
        AttributeDefinition {
            elements: Some(64),
            element_rules: exception_rules(),
            ..new(672, DataType::Usint)
        },
        AttributeDefinition { elements: Some(64), ..new(673, DataType::Usint) },
        AttributeDefinition { backing: Backing::Drive, ..new(1316, DataType::Udint) },
        AttributeDefinition { range: Some((0.0, 4.0)), ..new(610, DataType::Usint) },
        AttributeDefinition { access: Access::Cyclic, ..new(360, DataType::Dint) },
        AttributeDefinition { access: Access::Cyclic, ..new(361, DataType::Lreal) },
        AttributeDefinition { access: Access::Cyclic, ..new(362, DataType::Real) },
    ]
}

impl Rig {
    pub fn new() -> Self {
        Self::with(definitions())
    }

    /// A device with these attributes.
    pub fn with(attributes: Vec<AttributeDefinition>) -> Self {
        Self::processing(100_000, attributes)
    }

    /// A device with these attributes whose clock measures how well it is synchronized.
    pub fn measuring(sync_threshold: u32, attributes: Vec<AttributeDefinition>) -> Self {
        Self::of(100_000, Some(sync_threshold), attributes)
    }

    /// A device with these attributes and this Transmission Processing Time, ns.
    pub fn processing(transmission_processing_ns: u64, attributes: Vec<AttributeDefinition>) -> Self {
        Self::of(transmission_processing_ns, None, attributes)
    }

    fn of(
        transmission_processing_ns: u64,
        sync_threshold: Option<u32>,
        attributes: Vec<AttributeDefinition>,
    ) -> Self {
        let axis = AxisConfig {
            kind: ControlKind::Active,
            control_modes: 1 << ControlMode::POSITION.0 | 1 << ControlMode::VELOCITY.0,
            feedback_modes: 0b1101,
            lint_position: true,
            hookup_tests: 0b11,
        };
        let config = DeviceConfig {
            format: Format::Variable,
            axes: vec![axis, axis],
            attributes,
            power_structure_class_id: 0x1234,
            supports_sync: true,
            sync_threshold,
            transmission_processing_ns,
        };
        let mut device = MotionDevice::new(config).expect("a device");
        device.set_sync(SyncState { grandmaster: Some(GRANDMASTER), synchronized: true, offset: 0 });
        let block = CommandBlock {
            control_mode: ControlMode::POSITION,
            actual_data_set: ActualDataSet::POSITION,
            status_data_set: StatusDataSet::FAULT | StatusDataSet::AXIS_STATUS,
            values: CommandValues { position: Some(CommandPosition::Float(0.0)), ..CommandValues::default() },
            ..CommandBlock::default()
        };
        Self {
            device,
            now: 1_000_000_000,
            sequence: 0,
            update_id: 0,
            control: NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID,
            time: TimeDataSet::empty(),
            blocks: vec![block; 2],
            services: vec![None; 3],
            events: None,
            drives: vec![FakeDrive::new(); 2],
            packet: Vec::new(),
            t_to_o_size: 500,
            period: PERIOD,
            token: 0,
        }
    }

    pub fn now(&self) -> MonotonicTime {
        MonotonicTime(self.now)
    }

    pub fn system(&self) -> Option<SystemTime> {
        Some(SystemTime(EPOCH + self.now))
    }

    pub fn open_parameters(&mut self) -> OpenParameters {
        self.token += 1;
        OpenParameters {
            token: Token(self.token),
            triad: TRIAD,
            o_to_t_id: 11,
            t_to_o_id: 12,
            originator: Ipv4Addr::LOCALHOST,
            t_to_o_destination: SocketAddrV4::new(Ipv4Addr::LOCALHOST, 2222),
            rpi_us: u32::try_from(self.period / 1000).expect("fits"),
            timeout_us: 16 * self.period / 1000,
            o_to_t_size: 500,
            t_to_o_size: self.t_to_o_size,
            o_to_t_variable: true,
            t_to_o_variable: true,
            t_to_o_dscp: 55,
            format_revision: 2,
            configuration_bits: 0,
            assembly: None,
        }
    }

    pub fn request(&mut self, request: MotionRequest) -> Option<MotionReply> {
        self.device.request(self.now(), self.system(), request);
        self.device.poll_reply()
    }

    pub fn open(&mut self) {
        let parameters = self.open_parameters();
        let reply = self.request(MotionRequest::Open(parameters));
        assert_eq!(reply, Some(MotionReply::Opened { token: parameters.token, outcome: Ok(()) }));
        self.sequence = 0;
        self.update_id = 0;
    }

    pub fn close(&mut self) {
        let close = CloseParameters { token: Token(77), triad: TRIAD, o_to_t_id: 11 };
        let reply = self.request(MotionRequest::Close(close));
        assert_eq!(reply, Some(MotionReply::Closed { token: Token(77) }));
    }

    pub fn command_header(&self) -> CommandHeader {
        CommandHeader {
            update_id: self.update_id,
            node_control: self.control,
            instance_count: 0,
            last_received_id: if self.packet.is_empty() { 0 } else { self.header().update_id },
            time_stamp: self.time.contains(TimeDataSet::TIME_STAMP).then_some(EPOCH + self.now),
            time_offset: self.time.contains(TimeDataSet::TIME_OFFSET).then_some(0),
            diagnostics: self.time,
        }
    }

    /// The octets of the controller's next packet.
    pub fn command_packet(&mut self) -> Vec<u8> {
        self.sequence = self.sequence.wrapping_add(1);
        self.update_id = self.update_id.wrapping_add(1);
        let header = self.command_header();
        self.packet_with(&header)
    }

    pub fn packet_with(&self, header: &CommandHeader) -> Vec<u8> {
        let service = |number: usize| {
            self.services[number].as_ref().map(|(transaction_id, service, data)| ServiceRequest {
                transaction_id: *transaction_id,
                service: *service,
                data,
            })
        };
        let mut buffer = vec![0xA5; 2000];
        let mut writer = CommandWriter::new(&mut buffer, header).expect("room");
        if service(0).is_some() {
            let class = CommandInstance { service: service(0), ..CommandInstance::default() };
            writer.instance(&class).expect("room");
        }
        for (number, block) in (1_u8..).zip(&self.blocks) {
            let instance = CommandInstance {
                number,
                cyclic: Some(*block),
                write: None,
                events: self.events.clone().filter(|_| number == 1),
                service: service(usize::from(number)),
            };
            writer.instance(&instance).expect("room");
        }
        let len = writer.finish();
        let mut packet = self.sequence.to_le_bytes().to_vec();
        packet.extend(&buffer[..len]);
        packet
    }

    pub fn send(&mut self, packet: &[u8]) {
        let (now, system) = (self.now(), self.system());
        self.device.handle_io(now, system, packet);
    }

    /// Lets the drives act and takes the D-to-C packet, if one is due.
    pub fn run_device(&mut self) -> bool {
        let (now, system) = (self.now(), self.system());
        for axis in 0..self.drives.len() {
            let command = self.device.command(axis, now).expect("an axis");
            self.drives[axis].step(&command);
            self.device.set_drive(axis, self.drives[axis].image);
        }
        let mut out = vec![0xA5; 1000];
        let sent = self.device.poll_transmit(now, system, &mut out);
        if let Some(len) = sent {
            assert!(len <= usize::from(self.t_to_o_size));
            self.packet = out[..len].to_vec();
        }
        sent.is_some()
    }

    /// One update period with a C-to-D update at its start.
    pub fn cycle(&mut self) {
        let packet = self.command_packet();
        self.send(&packet);
        self.run_device();
        self.now += self.period;
    }

    pub fn cycles(&mut self, count: usize) {
        for _ in 0..count {
            self.cycle();
        }
    }

    /// One update period in which nothing comes from the controller.
    pub fn silence(&mut self) {
        self.run_device();
        self.now += self.period;
    }

    pub fn frame(&self) -> ActualFrame<'_> {
        ActualFrame::parse(&self.packet[2..]).expect("a good update")
    }

    pub fn header(&self) -> ActualHeader {
        *self.frame().header()
    }

    pub fn actual(&self, axis: usize) -> ActualBlock {
        let instance = self.frame().instances().find(|i| usize::from(i.number) == axis + 1);
        instance.and_then(|i| i.cyclic).expect("a cyclic block")
    }

    /// Transaction, general status and body of a service response.
    pub fn response(&self, instance: u8) -> Option<(u8, u8, Vec<u8>)> {
        let response = self.frame().instances().find(|i| i.number == instance)?.service?;
        Some((response.transaction_id, response.general_status, response.data.to_vec()))
    }

    pub fn state(&self, axis: usize) -> AxisState {
        self.device.axis_state(axis).expect("an axis")
    }

    pub fn command(&self, axis: usize) -> AxisCommandImage {
        self.device.command(axis, self.now()).expect("an axis")
    }

    pub fn follow(&self, axis: usize) -> SetPoints {
        match self.command(axis).command {
            Command::Follow(set_points) => set_points,
            Command::Withheld(reason) => panic!("no set-points: {reason:?}"),
        }
    }

    pub fn withheld(&self, axis: usize) -> Option<Withheld> {
        match self.command(axis).command {
            Command::Follow(_) => None,
            Command::Withheld(reason) => Some(reason),
        }
    }

    pub fn request_all(&mut self, control: AxisControl) {
        self.blocks.iter_mut().for_each(|block| block.axis_control = control);
    }

    pub fn configure(&mut self) {
        let complete = ControlStatus::CONFIGURATION_COMPLETE;
        self.blocks.iter_mut().for_each(|block| block.control_status = complete);
    }

    /// An open connection with both axes Stopped.
    pub fn stopped() -> Self {
        Self::new().connected()
    }

    /// The same with an open connection and both axes Stopped.
    pub fn connected(mut self) -> Self {
        self.open();
        self.configure();
        self.cycles(3);
        assert_eq!((self.state(0), self.state(1)), (AxisState::Stopped, AxisState::Stopped));
        self
    }

    /// An open connection with both axes Running.
    pub fn running() -> Self {
        let mut rig = Self::stopped();
        rig.request_all(AxisControl::ENABLE);
        rig.cycles(5);
        rig.request_all(AxisControl::NONE);
        rig.cycles(2);
        assert_eq!((rig.state(0), rig.state(1)), (AxisState::Running, AxisState::Running));
        rig
    }

    /// The drive has a fault of its own, and has acted on it.
    pub fn raise(&mut self, axis: usize, code: u8, action: u8) {
        let condition = DriveCondition {
            fault_type: crate::wire::motion::codes::FaultType::AXIS,
            code,
            action,
            least: ExceptionAction::MAJOR_FAULT,
            ..DriveCondition::default()
        };
        self.drives[axis].image.conditions = DriveConditions::of(&[condition]);
    }
}
