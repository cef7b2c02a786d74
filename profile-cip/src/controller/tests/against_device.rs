//! The controller against the device role of this crate, with a small ideal plant on each axis.

use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddrV4};

use arrayvec::{ArrayString, ArrayVec};
use profile_generic::time::{MonotonicTime, SystemTime};

use super::rig::{COUNTS_PER_UNIT, OFFSET_NS, config, seconds};
use crate::controller::{
    AttributeSet, AxisSet, Controller, ControllerConfig, DATAGRAM_MAX, Event, Limits, Report, Step,
    StreamAction,
};
use crate::device::attribute::{Access, AttributeDefinition, DataType, Scope, id};
use crate::device::axis::AxisConfig;
use crate::device::axis::drive_link::{
    AxisCommandImage, Command, DriveAction, DriveCondition, DriveConditions, DriveImage, ExceptionAction,
};
use crate::device::axis::state::AxisState;
use crate::device::config::{
    AdapterConfig, DEVICE_TYPE_CIP_MOTION_DRIVE, IdentityConfig, InterfaceConfig, LinkConfig, MotionConfig,
    QosConfig,
};
use crate::device::explicit::adapter::{Adapter, SessionSlot};
use crate::device::hosts::Hosts;
use crate::device::motion::device::{DeviceConfig, MotionDevice, SyncState};
use crate::device::motion_link::MotionReply;
use crate::device::objects::ethernet_link::{InterfaceType, LinkState};
use crate::wire::class1::Class1Datagram;
use crate::wire::encapsulation::IO_PORT;
use crate::wire::motion::Format;
use crate::wire::motion::attribute_list::AttributeSelector;
use crate::wire::motion::codes::{AxisStateCode, ControlMode, FaultType, NodeFault};

const GRAND_MASTER: [u8; 8] = [1, 2, 3, 4, 5, 6, 7, 8];
const LIMITS: Limits = Limits { velocity: 50.0, acceleration: 500.0, jerk: 10_000.0 };
/// The drives' own cycle.
const DRIVE_NS: u64 = 250_000;
/// Time a datagram is under way.
const LATENCY_NS: u64 = 60_000;

/// A drive that follows its commands exactly, starts in 5 ms and stops in 3.
pub(super) struct Plant {
    pub position: f64,
    path: VecDeque<(u64, f64)>,
    last: (u64, f64),
    sequence: u32,
    action: (u32, u64),
    reset_id: u32,
    pub fault: Option<DriveCondition>,
    pub inhibits: u16,
    /// Largest change of position in one drive cycle, counts.
    step_max: f64,
    /// Largest change of that step from one drive cycle to the next, counts.
    pub brake_max: f64,
    step: f64,
}

impl Plant {
    fn new(position: f64) -> Self {
        Self {
            position,
            path: VecDeque::new(),
            last: (0, position),
            sequence: 0,
            action: (0, 0),
            reset_id: 0,
            fault: None,
            inhibits: 0,
            step_max: 0.0,
            brake_max: 0.0,
            step: 0.0,
        }
    }

    fn cycle(&mut self, command: &AxisCommandImage, system: u64) -> DriveImage {
        if self.action.0 != command.action_id {
            self.action = (command.action_id, system);
        }
        if self.reset_id != command.reset_id {
            self.reset_id = command.reset_id;
            self.fault = None;
        }
        let since = system - self.action.1;
        let enabled = command.action == DriveAction::Enable;
        let started = enabled && since >= 5_000_000;
        let before = self.position;
        match command.command {
            Command::Follow(points) if started => {
                if points.control_mode == ControlMode::TORQUE {
                    // Without inertia: friction makes one unit/s of each %.
                    let units = f64::from(points.values.torque.unwrap_or(0.0)) * seconds(DRIVE_NS);
                    self.position += units * COUNTS_PER_UNIT;
                    self.path.clear();
                    self.last = (system, self.position);
                } else if points.control_mode == ControlMode::VELOCITY {
                    let units = f64::from(points.values.velocity.unwrap_or(0.0)) * seconds(DRIVE_NS);
                    self.position += units * COUNTS_PER_UNIT;
                    self.path.clear();
                    self.last = (system, self.position);
                } else {
                    if points.sequence != self.sequence {
                        self.sequence = points.sequence;
                        let reference = crate::controller::number::float(points.position_reference);
                        let position = points.values.position.map(|position| position.as_f64() - reference);
                        let position = position.unwrap_or(self.position);
                        let at = points.target_time.unwrap_or(system).max(system);
                        self.path.push_back((at, position));
                    }
                    self.follow(system);
                }
            }
            _ => {
                self.path.clear();
                self.last = (system, self.position);
            }
        }
        let step = self.position - before;
        self.brake_max = self.brake_max.max((step - self.step).abs());
        self.step = step;
        self.step_max = self.step_max.max(step.abs());
        let stopped = !enabled && since >= 3_000_000;
        DriveImage {
            online: true,
            action_id: self.action.0,
            reset_id: self.reset_id,
            bus_up: true,
            start_complete: started,
            stop_complete: stopped,
            power_enabled: enabled || !stopped,
            tracking: started,
            conditions: DriveConditions::of(self.fault.as_slice()),
            start_inhibits: self.inhibits,
            position: crate::controller::number::counts(self.position),
            velocity: Some(crate::controller::number::real(
                (self.position - before) / COUNTS_PER_UNIT / seconds(DRIVE_NS),
            )),
            captured_at: system,
            ..DriveImage::default()
        }
    }

    fn follow(&mut self, system: u64) {
        while let Some(&(at, position)) = self.path.front() {
            if at > system {
                break;
            }
            self.last = (at, position);
            self.path.pop_front();
        }
        self.position = self.last.1;
        if let Some(&(at, position)) = self.path.front() {
            let part = seconds(system.saturating_sub(self.last.0)) / seconds(at - self.last.0);
            self.position += (position - self.last.1) * part;
        }
    }
}

fn adapter(format: Format, io_port: u16) -> Adapter {
    let address = Ipv4Addr::new(10, 0, 0, 9);
    Adapter::new(AdapterConfig {
        identity: IdentityConfig {
            vendor: 0x1234,
            device_type: DEVICE_TYPE_CIP_MOTION_DRIVE,
            product_code: 7,
            major: 2,
            minor: 3,
            serial_number: 0xDEAD_BEEF,
            product_name: ArrayString::from("Axisbridge").unwrap(),
            configuration: 0,
        },
        interface: InterfaceConfig {
            io_port,
            ..InterfaceConfig::new(address, Ipv4Addr::new(255, 255, 255, 0))
        },
        link: LinkConfig {
            mac: [2, 0, 0, 0, 0, 9],
            label: ArrayString::from("north").unwrap(),
            interface_type: InterfaceType::TwistedPair,
            state: LinkState {
                up: true,
                enabled: true,
                speed_mbit: 100,
                full_duplex: true,
                ..LinkState::default()
            },
        },
        qos: QosConfig::default(),
        motion: MotionConfig {
            format,
            rpi_min_us: 500,
            rpi_max_us: 32_000,
            rpi_multiple_us: 500,
            o_to_t_size_max: 1400,
            t_to_o_size_max: 1400,
            power_structure_class_id: 0x0A0B_0C0D,
            power_structure_axis_ids: ArrayVec::new(),
        },
        assembly: None,
        controllers: Hosts::EVERYBODY,
        eds: std::sync::Arc::new([]),
        incarnation: 0x7A00,
    })
    .unwrap()
}

fn device(format: Format, axes: usize) -> MotionDevice {
    let axis = AxisConfig { control_modes: 0b1_0110, feedback_modes: 0b1111, ..AxisConfig::default() };
    let attribute = |number, data_type| {
        AttributeDefinition::new(Scope::Instance, number, data_type, Access::Set, "attribute of the tests")
    };
    MotionDevice::new(DeviceConfig {
        format,
        axes: vec![axis; axes],
        attributes: vec![
            attribute(441, DataType::Real),
            attribute(610, DataType::Usint),
            AttributeDefinition { range: Some((0.0, 3.0)), ..attribute(629, DataType::Usint) },
        ],
        power_structure_class_id: 0x0A0B_0C0D,
        supports_sync: format == Format::Variable,
        sync_threshold: None,
        transmission_processing_ns: 200_000,
    })
    .unwrap()
}

pub(super) type Script = dyn FnMut(&Report, &mut Vec<Plant>);

/// Controller and device on one virtual clock.
pub(super) struct Pair {
    pub controller: Controller,
    adapter: Adapter,
    pub device: MotionDevice,
    pub plants: Vec<Plant>,
    slot: SessionSlot,
    /// The controller has closed its stream.
    stream_closed: bool,
    /// When the controller is told to end.
    pub interrupt_at: Option<u64>,
    now: u64,
    sequence: u32,
    commands: u64,
    lose_command: fn(u64) -> bool,
    lose_actual: fn(u64) -> bool,
    /// From this instant on the device is gone.
    dies_at: Option<u64>,
    pub events: Vec<Event>,
    pub script: Box<Script>,
}

impl Pair {
    pub fn new(config: ControllerConfig, positions: &[f64], program: Vec<Step>) -> Self {
        let mut adapter = adapter(config.format, IO_PORT);
        let start = 5_000_000;
        let peer = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 50_000);
        let slot = adapter.open(MonotonicTime(start), peer).unwrap();
        let mut device = device(config.format, positions.len());
        device.set_sync(SyncState {
            grandmaster: Some(GRAND_MASTER),
            synchronized: true,
            offset: OFFSET_NS.cast_signed(),
        });
        Self {
            controller: Controller::new(config, program).unwrap(),
            adapter,
            device,
            plants: positions.iter().map(|p| Plant::new(*p)).collect(),
            slot,
            stream_closed: false,
            interrupt_at: None,
            now: start,
            sequence: 0,
            commands: 0,
            lose_command: |_| false,
            lose_actual: |_| false,
            dies_at: None,
            events: Vec::new(),
            script: Box::new(|_, _| {}),
        }
    }

    /// The controller is set up otherwise than the device.
    pub fn with_controller(&mut self, config: ControllerConfig) {
        self.controller = Controller::new(config, Vec::new()).unwrap();
    }

    /// The device takes its I/O at another port.
    fn with_io_port(mut self, port: u16) -> Self {
        self.adapter = adapter(Format::Variable, port);
        let peer = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 50_000);
        self.slot = self.adapter.open(MonotonicTime(self.now), peer).unwrap();
        self
    }

    fn is_dead(&self) -> bool {
        self.dies_at.is_some_and(|at| self.now >= at)
    }

    /// Everything that can pass without time passing.
    fn exchange(&mut self) {
        let now = MonotonicTime(self.now);
        let mut buffer = vec![0; DATAGRAM_MAX];
        loop {
            let mut moved = false;
            while let Some(length) = self.controller.poll_stream_transmit(&mut buffer) {
                moved = true;
                if !self.is_dead() && !self.stream_closed {
                    assert_eq!(self.adapter.handle_stream(now, self.slot, &buffer[..length]), length);
                }
            }
            while let Some(request) = self.adapter.poll_motion() {
                let system = Some(SystemTime(self.now + OFFSET_NS));
                self.device.request(now, system, request);
                moved = true;
            }
            while let Some(reply) = self.device.poll_reply() {
                let slot = self.adapter.complete(now, &reply);
                if !matches!(reply, MotionReply::ConnectionLost { .. }) && !self.stream_closed {
                    assert_eq!(slot, Some(self.slot));
                }
                moved = true;
            }
            while !self.stream_closed {
                let length = self.adapter.poll_transmit(now, self.slot, &mut buffer);
                if length == 0 {
                    break;
                }
                moved = true;
                if !self.is_dead() {
                    self.controller.handle_stream(now, &buffer[..length]);
                }
            }
            while let Some(length) = self.controller.poll_datagram_transmit(&mut buffer) {
                moved = true;
                self.commands += 1;
                if !(self.lose_command)(self.commands) && !self.is_dead() {
                    let datagram = Class1Datagram::parse(&buffer[..length]).unwrap();
                    let mut packet = datagram.sequence_count.to_le_bytes().to_vec();
                    packet.extend(datagram.data);
                    let at = self.now + LATENCY_NS;
                    let Some(connection) = self.device.connection() else { continue };
                    assert_eq!(datagram.connection_id, connection.o_to_t_id);
                    self.device.handle_io(MonotonicTime(at), Some(SystemTime(at + OFFSET_NS)), &packet);
                }
            }
            match self.controller.poll_stream_action() {
                Some(StreamAction::Close) => self.close_stream(),
                Some(StreamAction::Reopen) => {
                    self.close_stream();
                    let peer = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 50_001);
                    self.slot = self.adapter.open(now, peer).unwrap();
                    self.stream_closed = false;
                    self.controller.tcp_connected(now);
                    moved = true;
                }
                None => {}
            }
            while let Some(event) = self.controller.poll_event() {
                self.events.push(event);
            }
            if !moved {
                return;
            }
        }
    }

    fn close_stream(&mut self) {
        if !self.stream_closed {
            self.adapter.close(self.slot);
            self.stream_closed = true;
        }
    }

    fn drive_cycle(&mut self) {
        let (now, system) = (MonotonicTime(self.now), self.now + OFFSET_NS);
        for (axis, plant) in self.plants.iter_mut().enumerate() {
            let command = self.device.command(axis, now).unwrap();
            let image = plant.cycle(&command, system);
            self.device.set_drive(axis, image);
        }
        self.device.poll(now, Some(SystemTime(system)));
        let mut buffer = vec![0; DATAGRAM_MAX];
        let Some(length) = self.device.poll_transmit(now, Some(SystemTime(system)), &mut buffer) else {
            return;
        };
        let Some(connection) = self.device.connection() else { return };
        self.sequence += 1;
        let datagram = Class1Datagram {
            connection_id: connection.t_to_o_id,
            encapsulation_sequence: self.sequence,
            sequence_count: u16::from_le_bytes([buffer[0], buffer[1]]),
            data: &buffer[2..length],
        };
        let mut bytes = vec![0; datagram.buffer_len()];
        datagram.emit(&mut bytes).unwrap();
        if !(self.lose_actual)(u64::from(self.sequence)) && !self.is_dead() {
            let at = self.now + LATENCY_NS;
            self.controller.handle_datagram(MonotonicTime(at), SystemTime(at + OFFSET_NS), &bytes);
        }
    }

    pub fn run(&mut self, limit: u64) -> Report {
        let end = self.now + limit * 1_000_000_000;
        self.controller.tcp_connected(MonotonicTime(self.now));
        self.exchange();
        let mut drive = self.now;
        while !self.controller.is_closed() {
            assert!(self.now < end, "not closed within {limit} s\n{}", self.log());
            let wake = self.controller.wake_at().map_or(u64::MAX, |at| at.0);
            self.now = self.now.max(wake.min(drive));
            if drive <= self.now {
                drive += DRIVE_NS;
                (self.script)(&self.controller.report(), &mut self.plants);
                self.drive_cycle();
            }
            if self.interrupt_at.is_some_and(|at| self.now >= at) {
                self.interrupt_at = None;
                self.controller.interrupt(MonotonicTime(self.now));
            }
            self.controller.handle_time(MonotonicTime(self.now), SystemTime(self.now + OFFSET_NS));
            self.exchange();
        }
        self.controller.report()
    }

    pub fn log(&self) -> String {
        self.events.iter().map(|event| format!("{event}\n")).collect()
    }
}

fn program() -> Vec<Step> {
    let both = AxisSet::first(2);
    vec![
        Step::Enable(both),
        Step::Together(vec![
            Step::MoveAbsolute { axis: 1, position: 12.5, limits: LIMITS },
            Step::MoveRelative { axis: 2, distance: -3.0, limits: LIMITS },
        ]),
        Step::Together(vec![
            Step::WaitInWindow { axis: 1, window: 0.002, seconds: 1.0 },
            Step::WaitInWindow { axis: 2, window: 0.002, seconds: 1.0 },
        ]),
        Step::Jog { axis: 2, velocity: 20.0, acceleration: 200.0, jerk: 5000.0, seconds: 0.3 },
        Step::MoveAbsolute { axis: 2, position: 0.0, limits: LIMITS },
        Step::WaitInWindow { axis: 2, window: 0.002, seconds: 1.0 },
        Step::Disable(both),
    ]
}

pub(super) fn configured(axes: usize) -> ControllerConfig {
    let mut config = config(axes);
    config.list_identity = true;
    config.key.vendor = 0x1234;
    config.key.device_type = DEVICE_TYPE_CIP_MOTION_DRIVE;
    config.power_structure = Some(0x0A0B_0C0D);
    config.class_attributes = vec![
        AttributeSet::usint(id::UPDATE_DELAY_HIGH_LIMIT, 4),
        AttributeSet::usint(id::UPDATE_DELAY_LOW_LIMIT, 2),
        AttributeSet::udint(id::STEP_THRESHOLD, 2_000_000),
    ];
    for axis in &mut config.axes {
        axis.attributes = vec![AttributeSet::real(441, 80.0), AttributeSet::usint(610, 1)];
    }
    config
}

pub(super) fn assert_good(report: &Report, pair: &Pair) {
    assert_eq!(report.failure, None, "{}", pair.log());
    assert_eq!(pair.device.connection(), None, "closed");
    assert_eq!(pair.device.counters().malformed, 0, "{:?}", pair.device.last_error());
    assert_eq!(pair.device.node_fault(), NodeFault::NONE);
    // 50 units/s in 250 us are 12.5 counts.
    for plant in &pair.plants {
        assert!(plant.step_max <= 12.6, "a step of {} counts in a drive cycle", plant.step_max);
    }
}

#[test]
fn the_whole_program_runs_synchronously() {
    let mut pair = Pair::new(configured(2), &[4321.0, -777.0], program());
    let report = pair.run(30);
    assert_good(&report, &pair);
    assert!(report.synchronous);
    assert_eq!(report.steps_finished, 7);
    let [one, two] = report.axes.as_slice() else { panic!("two axes") };
    assert_eq!((one.commanded, one.reached), (Some(12.5), Some(12.5)));
    assert_eq!((two.commanded, two.reached), (Some(0.0), Some(0.0)));
    assert!(one.following_error_max <= 0.001 && two.following_error_max <= 0.001, "{report}");
    assert_eq!((report.lost_updates, report.malformed), (0, 0), "{report}");
    // The bus is up from the start, so Pre-Charge is passed between two updates.
    use AxisStateCode as S;
    assert_eq!(one.states.kept(), [S::STOPPED, S::STARTING, S::RUNNING, S::STOPPING, S::STOPPED]);
    assert_eq!(report.identity.as_ref().unwrap().product_name, "Axisbridge");
    insta::assert_snapshot!(pair.log());
}

#[test]
fn a_jog_covers_its_velocity_times_its_time() {
    let one = AxisSet::one(1);
    let jog = Step::Jog { axis: 1, velocity: 20.0, acceleration: 200.0, jerk: 5000.0, seconds: 0.3 };
    let mut pair = Pair::new(configured(1), &[0.0], vec![Step::Enable(one), jog, Step::Disable(one)]);
    let report = pair.run(30);
    assert_good(&report, &pair);
    let reached = report.axes[0].reached.unwrap();
    assert!((reached - 6.0).abs() < 0.02, "{reached}");
}

#[test]
fn without_a_grand_master_it_runs_asynchronously() {
    let config = ControllerConfig { grand_master: None, ..configured(2) };
    let mut pair = Pair::new(config, &[0.0, 0.0], program());
    let report = pair.run(30);
    assert_eq!(report.failure, None, "{}", pair.log());
    assert!(!report.synchronous);
    assert_eq!((report.axes[0].reached, report.axes[1].reached), (Some(12.5), Some(0.0)));
}

#[test]
fn lost_datagrams_both_ways_are_ridden_through() {
    let mut pair = Pair::new(configured(2), &[100.0, 200.0], program());
    pair.lose_command = |n| n > 60 && n % 19 == 0;
    pair.lose_actual = |n| n > 60 && n % 23 == 0;
    let report = pair.run(30);
    assert_eq!(report.failure, None, "{}", pair.log());
    assert_eq!((report.axes[0].reached, report.axes[1].reached), (Some(12.5), Some(0.0)));
    assert!(report.lost_updates > 20 && report.device_lost_updates > 20, "{report}");
    assert_eq!(u64::from(report.device_lost_updates), pair.device.counters().lost_updates % 256);
}

#[test]
fn attributes_are_written_read_back_and_refused_by_name() {
    let mut config = configured(1);
    config.axes[0].attributes.push(AttributeSet::usint(9999, 1).optional());
    let program = vec![Step::ReadAttributes {
        axis: 1,
        attributes: vec![AttributeSelector::scalar(441, 4), AttributeSelector::scalar(650, 1)],
    }];
    let mut pair = Pair::new(config.clone(), &[0.0], program);
    let report = pair.run(30);
    assert_good(&report, &pair);
    assert!(pair.log().contains("axis 1: attribute 9999 refused with status 0x14 (attribute not supported)"));
    assert!(pair.log().contains("axis 1: read 441=[00, 00, A0, 42] 650=[02]"), "{}", pair.log());

    config.axes[0].attributes.push(AttributeSet::usint(629, 4));
    let mut pair = Pair::new(config, &[0.0], vec![]);
    let report = pair.run(30);
    let expected = "axis 1: attribute 629 refused with status 0x09 (invalid attribute value)";
    assert_eq!(report.failure.unwrap().to_string(), expected);
}

#[test]
fn enable_is_refused_while_a_start_inhibit_is_there() {
    let mut pair = Pair::new(configured(1), &[0.0], vec![Step::Enable(AxisSet::one(1))]);
    pair.plants[0].inhibits = 1 << 5;
    let report = pair.run(30);
    let text = report.failure.unwrap().to_string();
    assert!(text.starts_with("axis 1: Enable refused with status 0x"), "{text}");
    assert!(text.ends_with("state Start Inhibited"), "{text}");
    assert_eq!(pair.device.connection(), None);
}

#[test]
fn forward_open_is_refused_for_key_power_structure_and_interval() {
    type Spoil = fn(&mut ControllerConfig);
    let cases: [(Spoil, &str); 4] = [
        (|c| c.key.vendor = 0x4D, "0x0114 (vendor ID or product code mismatch)"),
        (|c| c.key.major_revision = 9, "0x0116 (revision mismatch)"),
        (|c| c.power_structure = Some(1), "0x0004 (data segment: drive power structure of the class)"),
        (|c| c.rpi_us = 1_250, "0x0111 (RPI not supported)"),
    ];
    for (spoil, expected) in cases {
        let mut config = configured(1);
        spoil(&mut config);
        let mut pair = Pair::new(config, &[0.0], vec![]);
        let text = pair.run(30).failure.unwrap().to_string();
        assert!(text.contains(expected), "{text}");
        assert_eq!(pair.device.connection(), None);
    }
}

pub(super) fn drive_fault(code: u8, sub_code: u8, action: u8) -> DriveCondition {
    let (fault_type, least) = (FaultType::AXIS, ExceptionAction::MAJOR_FAULT);
    DriveCondition { fault_type, code, sub_code, action, least, ..DriveCondition::default() }
}

#[test]
fn a_drive_fault_amid_a_move_is_in_the_failure() {
    let mut pair = Pair::new(
        configured(1),
        &[0.0],
        vec![Step::Enable(AxisSet::one(1)), Step::MoveAbsolute { axis: 1, position: 50.0, limits: LIMITS }],
    );
    pair.script = Box::new(|report, plants| {
        if report.axes[0].commanded.is_some_and(|p| p > 20.0) && report.failure.is_none() {
            plants[0].fault = Some(drive_fault(34, 2, 0x22));
        }
    });
    let report = pair.run(30);
    let text = report.failure.unwrap().to_string();
    assert!(text.starts_with("axis 1: expected state Running, found state "), "{text}");
    assert!(text.contains("Axis Fault code 34 sub code 2 action 0x22"), "{text}");
    assert_eq!(report.axes[0].faults.total, 1);
}

#[test]
fn fault_reset_brings_a_faulted_axis_back() {
    let one = AxisSet::one(1);
    let mut pair = Pair::new(
        configured(1),
        &[0.0],
        vec![
            Step::Enable(one),
            Step::Dwell { seconds: 0.2 },
            Step::FaultReset(one),
            Step::Enable(one),
            Step::MoveAbsolute { axis: 1, position: 1.0, limits: LIMITS },
            Step::Shutdown(one),
            Step::ShutdownReset(one),
            Step::Enable(one),
            Step::Disable(one),
        ],
    );
    let mut raised = false;
    pair.script = Box::new(move |report, plants| {
        if report.steps_finished == 1 && !raised {
            raised = true;
            plants[0].fault = Some(drive_fault(11, 0, 0x22));
        }
    });
    let report = pair.run(30);
    assert_good(&report, &pair);
    assert_eq!(report.steps_finished, 9);
    assert!(report.axes[0].states.kept().contains(&AxisStateCode::MAJOR_FAULTED));
    assert!(report.axes[0].states.kept().contains(&AxisStateCode::SHUTDOWN));
}

#[test]
fn a_device_that_vanishes_amid_a_move() {
    let mut pair = Pair::new(
        configured(1),
        &[0.0],
        vec![Step::Enable(AxisSet::one(1)), Step::MoveAbsolute { axis: 1, position: 50.0, limits: LIMITS }],
    );
    pair.dies_at = Some(700_000_000);
    let report = pair.run(60);
    let text = report.failure.unwrap().to_string();
    assert!(text.starts_with("connection timed out from device to controller: silent for 1"), "{text}");
    // The device has noticed it as well and has stopped the axis.
    // Four missed periods are noticed before the connection times out after eight.
    assert_eq!(pair.device.node_fault(), NodeFault::CONNECTION_UPDATE);
    assert_eq!(pair.device.counters().connection_losses, 1);
    assert_eq!(pair.device.axis_state(0), Some(AxisState::MajorFaulted));
    assert_eq!(pair.device.connection(), None);
}

#[test]
fn one_millisecond_and_sixteen_axes() {
    let all = AxisSet::first(16);
    let mut config = configured(16);
    config.rpi_us = 1_000;
    let moves = (1..=16).map(|axis| Step::MoveRelative { axis, distance: f64::from(axis), limits: LIMITS });
    let program = vec![Step::Enable(all), Step::Together(moves.collect()), Step::Disable(all)];
    let mut pair = Pair::new(config, &[0.0; 16], program);
    let report = pair.run(30);
    assert_good(&report, &pair);
    for (axis, expected) in report.axes.iter().zip(1..=16) {
        assert_eq!(axis.commanded, Some(f64::from(expected)));
        assert!(axis.following_error_max <= 0.001, "{report}");
    }
    assert!(pair.events.len() < 200);
    assert_eq!(report.missed_cycles, 0);
}

#[test]
fn other_ports_than_2222_are_agreed_in_the_forward_open() {
    let mut config = configured(1);
    config.t_to_o_port = Some(40_000);
    let mut pair = Pair::new(config, &[0.0], vec![]).with_io_port(2300);
    pair.controller.tcp_connected(MonotonicTime(pair.now));
    pair.exchange();
    let destination = pair.device.connection().unwrap().t_to_o_destination;
    assert_eq!(destination, SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 40_000));
    assert_eq!(pair.controller.datagram_destination().map(|address| address.port()), Some(2300));
    let report = pair.run(10);
    assert_good(&report, &pair);

    let mut pair = Pair::new(configured(1), &[0.0], vec![]);
    pair.controller.tcp_connected(MonotonicTime(pair.now));
    pair.exchange();
    assert_eq!(pair.device.connection().unwrap().t_to_o_destination.port(), IO_PORT);
    assert_eq!(pair.controller.datagram_destination(), None);
}
