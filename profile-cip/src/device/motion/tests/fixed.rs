//! The fixed connection format: one axis, 16 octets each way, services as explicit messages.

use arrayvec::ArrayVec;

use super::*;
use crate::device::motion::device::DeviceError;
use crate::device::motion_link::{ExplicitRequest, ObjectPath};
use crate::wire::Writer;
use crate::wire::motion::codes::{CommandTarget, FeedbackMode, FeedbackSource, NodeFault, NodeStatus};
use crate::wire::motion::fixed::{FixedActual, FixedCommand, LEN};

const GET: u8 = 0x0E;
const SET: u8 = 0x10;

struct FixedRig {
    device: MotionDevice,
    drive: FakeDrive,
    now: u64,
    sequence: u16,
    command: FixedCommand,
    actual: Option<FixedActual>,
    packet: Vec<u8>,
}

fn config() -> DeviceConfig {
    let modes = [ControlMode::POSITION, ControlMode::VELOCITY, ControlMode::TORQUE];
    DeviceConfig {
        format: Format::Fixed,
        axes: vec![AxisConfig {
            kind: ControlKind::Active,
            control_modes: modes.iter().map(|mode| 1 << mode.0).sum(),
            feedback_modes: 0b1111,
            lint_position: true,
            ..AxisConfig::default()
        }],
        attributes: definitions(),
        power_structure_class_id: 0,
        supports_sync: false,
        sync_threshold: None,
        transmission_processing_ns: 0,
    }
}

fn velocity(value: f32) -> CommandValues {
    CommandValues { velocity: Some(value), ..CommandValues::default() }
}

impl FixedRig {
    fn new() -> Self {
        Self {
            device: MotionDevice::new(config()).expect("a device"),
            drive: FakeDrive::new(),
            now: 1_000_000_000,
            sequence: 0,
            command: FixedCommand {
                update_id: 0,
                node_control: NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID,
                control_mode: ControlMode::VELOCITY,
                feedback_mode: FeedbackMode(FeedbackSource::MOTOR.0),
                axis_control: AxisControl::NONE,
                actual_data_set: ActualDataSet::VELOCITY,
                status_data_set: StatusDataSet::FAULT | StatusDataSet::AXIS_STATUS,
                values: velocity(0.0),
            },
            actual: None,
            packet: Vec::new(),
        }
    }

    fn now(&self) -> MonotonicTime {
        MonotonicTime(self.now)
    }

    fn parameters(&self) -> OpenParameters {
        OpenParameters {
            o_to_t_size: 18,
            t_to_o_size: 18,
            o_to_t_variable: false,
            t_to_o_variable: false,
            ..Rig::new().open_parameters()
        }
    }

    fn try_open(&mut self, parameters: OpenParameters) -> Result<(), u16> {
        self.device.request(self.now(), None, MotionRequest::Open(parameters));
        let Some(MotionReply::Opened { outcome, .. }) = self.device.poll_reply() else { panic!("an answer") };
        outcome.map_err(|refusal| refusal.extended_status)
    }

    fn open(&mut self) {
        assert_eq!(self.try_open(self.parameters()), Ok(()));
        (self.sequence, self.command.update_id) = (0, 0);
    }

    fn octets(&self) -> [u8; LEN] {
        let mut octets = [0xA5; LEN];
        self.command.emit(&mut Writer::new(&mut octets)).expect("16 octets");
        octets
    }

    fn next_packet(&mut self) -> Vec<u8> {
        self.sequence = self.sequence.wrapping_add(1);
        self.command.update_id = self.command.update_id.wrapping_add(1);
        [&self.sequence.to_le_bytes()[..], &self.octets()].concat()
    }

    fn send(&mut self, packet: &[u8]) {
        self.device.handle_io(self.now(), None, packet);
    }

    fn run_device(&mut self) {
        let command = self.device.command(0, self.now()).expect("an axis");
        self.drive.step(&command);
        self.device.set_drive(0, self.drive.image);
        let mut out = [0xA5; 100];
        self.actual = None;
        if let Some(len) = self.device.poll_transmit(self.now(), None, &mut out) {
            assert_eq!((len, out[len]), (2 + LEN, 0xA5));
            self.packet = out[..len].to_vec();
            self.actual = Some(FixedActual::parse(&out[2..len]).expect("a good update"));
        }
    }

    fn cycle(&mut self) {
        let packet = self.next_packet();
        self.send(&packet);
        self.run_device();
        self.now += PERIOD;
    }

    fn cycles(&mut self, count: usize) {
        (0..count).for_each(|_| self.cycle());
    }

    fn silence(&mut self) {
        self.run_device();
        self.now += PERIOD;
    }

    fn actual(&self) -> FixedActual {
        self.actual.expect("an update")
    }

    fn state(&self) -> AxisState {
        self.device.axis_state(0).expect("an axis")
    }

    fn image(&self) -> AxisCommandImage {
        self.device.command(0, self.now()).expect("an axis")
    }

    fn follow(&self) -> SetPoints {
        match self.image().command {
            Command::Follow(set_points) => set_points,
            Command::Withheld(reason) => panic!("no set-points: {reason:?}"),
        }
    }

    fn withheld(&self) -> Option<Withheld> {
        match self.image().command {
            Command::Follow(_) => None,
            Command::Withheld(reason) => Some(reason),
        }
    }

    /// An explicit single-attribute service: general status and data.
    fn explicit(&mut self, service: u8, instance: u32, attribute: u16, data: &[u8]) -> (u8, Vec<u8>) {
        let path = ObjectPath { class: 0x42, instance, attribute: Some(attribute), ..ObjectPath::default() };
        let data = ArrayVec::try_from(data).expect("short");
        let request =
            ExplicitRequest { token: Token(500), originator: Ipv4Addr::LOCALHOST, service, path, data };
        self.device.request(self.now(), None, MotionRequest::Explicit(request));
        match self.device.poll_reply() {
            Some(MotionReply::Explicit(reply)) => (reply.general_status, reply.data.to_vec()),
            other => panic!("{other:?}"),
        }
    }

    fn configure(&mut self) {
        assert_eq!(self.explicit(SET, 1, 89, &[1]), (0, vec![]));
    }

    fn stopped() -> Self {
        let mut rig = Self::new();
        rig.open();
        rig.cycle();
        rig.configure();
        rig.cycles(3);
        assert_eq!(rig.state(), AxisState::Stopped);
        rig
    }

    fn running() -> Self {
        let mut rig = Self::stopped();
        rig.command.axis_control = AxisControl::ENABLE;
        rig.cycles(5);
        rig.command.axis_control = AxisControl::NONE;
        rig.cycles(2);
        assert_eq!(rig.state(), AxisState::Running);
        rig
    }
}

#[test]
fn a_device_of_the_fixed_format_has_one_axis_and_no_system_time() {
    let axis = config().axes[0];
    let refused = |config| MotionDevice::new(config).map(|_| ()).map_err(|error| error.to_string());
    assert_eq!(
        refused(DeviceConfig { axes: vec![axis, axis], ..config() }),
        Err("fixed connection format: expected 1 axis, found 2".to_owned())
    );
    assert_eq!(
        refused(DeviceConfig { supports_sync: true, ..config() }),
        Err(DeviceError::FixedSync.to_string())
    );
    assert_eq!(refused(config()), Ok(()));
}

#[test]
fn a_connection_that_cannot_carry_the_format_is_refused() {
    let mut rig = FixedRig::new();
    let good = rig.parameters();
    let cases = [
        (OpenParameters { o_to_t_variable: true, ..good }, 0x11F),
        (OpenParameters { t_to_o_variable: true, ..good }, 0x120),
        (OpenParameters { o_to_t_size: 17, ..good }, 0x127),
        (OpenParameters { o_to_t_size: 19, ..good }, 0x127),
        (OpenParameters { t_to_o_size: 16, ..good }, 0x128),
        (OpenParameters { format_revision: 1, ..good }, 0x12F),
        (OpenParameters { rpi_us: 0, ..good }, 0x111),
    ];
    for (parameters, extended) in cases {
        assert_eq!(rig.try_open(parameters), Err(extended), "{parameters:?}");
        assert_eq!(rig.device.connection(), None);
    }
    assert_eq!(rig.try_open(good), Ok(()));
    assert_eq!(rig.try_open(good), Err(0x106));
    let mut variable = Rig::new();
    let fixed = OpenParameters { o_to_t_variable: false, ..variable.open_parameters() };
    let reply = variable.request(MotionRequest::Open(fixed));
    assert!(
        matches!(reply, Some(MotionReply::Opened { outcome: Err(refusal), .. }) if refusal.extended_status == 0x11F)
    );
}

#[test]
fn before_valid_data_only_the_head_of_an_update_says_something() {
    let mut rig = FixedRig::new();
    rig.open();
    rig.command.node_control = NodeControl::REMOTE_CONTROL;
    // Clause 7-1.1: update ID 0, remote control, nothing else; repeated as the same packet.
    rig.sequence = 1;
    let packet = [&[1, 0][..], &rig.octets()].concat();
    rig.send(&packet);
    rig.run_device();
    assert_eq!(rig.packet, [&[1, 0, 3, 2, 0, 1][..], &[0; 12]].concat());
    rig.now += PERIOD;
    rig.run_device();
    assert_eq!(rig.packet[..2], [1, 0], "a refresh has the sequence count of the packet before");
    assert_eq!(rig.state(), AxisState::Initializing);
    rig.command.node_control |= NodeControl::DATA_VALID;
    rig.cycle();
    assert_eq!(rig.packet, [2, 0, 3, 2, 1, 5, 2, 2, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn configuration_complete_is_set_by_a_service() {
    let mut rig = FixedRig::new();
    rig.open();
    rig.cycles(5);
    assert_eq!(rig.state(), AxisState::Initializing, "nobody has said that it is configured");
    // What the octets call reserved is not Control Status.
    let mut packet = rig.next_packet();
    packet[2 + 7] = 1;
    rig.send(&packet);
    rig.run_device();
    assert_eq!(rig.state(), AxisState::Initializing);
    rig.configure();
    rig.cycles(2);
    assert_eq!(rig.state(), AxisState::Stopped);
    assert_eq!(rig.explicit(GET, 1, 89, &[]), (0, vec![1]), "updates do not take it back");

    // The next connection begins with the configuration.
    let close = CloseParameters { token: Token(77), triad: TRIAD, o_to_t_id: 11 };
    rig.device.request(rig.now(), None, MotionRequest::Close(close));
    assert_eq!(rig.device.poll_reply(), Some(MotionReply::Closed { token: Token(77) }));
    rig.open();
    rig.cycles(5);
    assert_eq!(rig.state(), AxisState::Initializing);
}

#[test]
fn only_a_fixed_connection_leaves_control_status_and_command_control_to_a_service() {
    let mut rig = Rig::stopped();
    for attribute in [89, 92] {
        let path =
            ObjectPath { class: 0x42, instance: 1, attribute: Some(attribute), ..ObjectPath::default() };
        let data = ArrayVec::from_iter([5]);
        let request =
            ExplicitRequest { token: Token(1), originator: Ipv4Addr::LOCALHOST, service: SET, path, data };
        let reply = rig.request(MotionRequest::Explicit(request));
        assert!(matches!(reply, Some(MotionReply::Explicit(reply)) if reply.general_status == 0x0E));
    }
}

#[test]
fn enable_run_and_stop_in_velocity_control() {
    let mut rig = FixedRig::stopped();
    assert_eq!(rig.withheld(), Some(Withheld::NotRunning));
    rig.command.axis_control = AxisControl::ENABLE;
    rig.cycle();
    assert_eq!(rig.state(), AxisState::Starting);
    assert_eq!(rig.actual().axis_response, AxisControl::NONE);
    rig.cycles(3);
    assert_eq!(rig.state(), AxisState::Running);
    assert_eq!((rig.actual().axis_response, rig.actual().response_status), (AxisControl::ENABLE, 0));
    assert_eq!(rig.actual().axis_state.0, 4);
    rig.command.axis_control = AxisControl::NONE;
    rig.command.values = velocity(2.5);
    rig.drive.image.velocity = Some(2.25);
    rig.cycle();
    assert_eq!(rig.actual().axis_response, AxisControl::NONE);
    assert_eq!(rig.actual().actual, ActualValues { velocity: Some(2.25), ..ActualValues::default() });
    let set_points = rig.follow();
    assert_eq!((set_points.control_mode, set_points.values), (ControlMode::VELOCITY, velocity(2.5)));
    assert_eq!((set_points.time_stamp, set_points.target_time), (None, None));
    assert_eq!(set_points.target, CommandTarget::IMMEDIATE);
    rig.command.axis_control = AxisControl::DISABLE;
    rig.cycle();
    assert_eq!((rig.state(), rig.image().action), (AxisState::Stopping, DriveAction::Disable));
    rig.cycles(2);
    assert_eq!(rig.state(), AxisState::Stopped);
    assert_eq!((rig.actual().axis_response, rig.actual().response_status), (AxisControl::DISABLE, 0));
}

#[test]
fn position_and_torque_and_the_actual_value_that_was_asked_for() {
    let mut rig = FixedRig::running();
    rig.drive.image.position = 0x1_0000_0003;
    rig.drive.image.velocity = Some(0.5);
    rig.drive.image.acceleration = Some(-4.0);
    rig.command.control_mode = ControlMode::POSITION;
    // The LINT that this asks for has no room: the position stays a DINT.
    rig.command.feedback_mode = FeedbackMode(FeedbackSource::MOTOR.0).with_lint(true);
    rig.command.values =
        CommandValues { position: Some(CommandPosition::Integer(-77)), ..CommandValues::default() };
    rig.command.actual_data_set = ActualDataSet::POSITION;
    rig.cycle();
    assert_eq!(rig.follow().values.position, Some(CommandPosition::Integer(-77)));
    assert_eq!(rig.actual().feedback_mode, FeedbackMode(FeedbackSource::MOTOR.0));
    let position = Some(ActualPosition::Dint(3));
    assert_eq!(rig.actual().actual, ActualValues { position, ..ActualValues::default() });
    rig.command.control_mode = ControlMode::TORQUE;
    rig.command.values = CommandValues { torque: Some(12.5), ..CommandValues::default() };
    rig.command.actual_data_set = ActualDataSet::ACCELERATION;
    rig.cycle();
    assert_eq!((rig.follow().control_mode, rig.follow().values.torque), (ControlMode::TORQUE, Some(12.5)));
    assert_eq!(rig.actual().actual, ActualValues { acceleration: Some(-4.0), ..ActualValues::default() });
    rig.command.actual_data_set = ActualDataSet::empty();
    rig.cycle();
    assert_eq!(rig.actual().actual, ActualValues::default());
    // Interpolation towards the update after the next, by a service.
    assert_eq!(rig.explicit(GET, 1, 92, &[]), (0, vec![0b0100]));
    assert_eq!(rig.explicit(SET, 1, 92, &[0b0110]), (0, vec![]));
    rig.cycle();
    assert_eq!(rig.follow().target, CommandTarget::INTERPOLATE);
    for refused in [0b0000, 0b0010, 0b0111, 0b1000] {
        assert_eq!(
            rig.explicit(SET, 1, 92, &[refused]).0,
            0x09,
            "no LREAL, nothing reserved: {refused:#06b}"
        );
    }
    assert_eq!(rig.explicit(GET, 1, 92, &[]), (0, vec![0b0110]));
}

#[test]
fn a_mode_without_its_set_point_stops_the_axis() {
    let mut rig = FixedRig::running();
    rig.command.control_mode = ControlMode::TORQUE;
    rig.cycle();
    assert_eq!(rig.state(), AxisState::Aborting);
    assert_eq!(rig.device.axis_faults(0), Some(1 << 60));
}

#[test]
fn a_fault_is_told_by_its_state_and_read_and_reset_by_name() {
    let mut rig = FixedRig::running();
    let condition = DriveCondition {
        fault_type: crate::wire::motion::codes::FaultType::AXIS,
        code: 30,
        least: ExceptionAction::MAJOR_FAULT,
        ..DriveCondition::default()
    };
    rig.drive.image.conditions = DriveConditions::of(&[condition]);
    rig.drive.sticky = true;
    rig.cycles(4);
    assert_eq!((rig.state(), rig.actual().axis_state.0), (AxisState::MajorFaulted, 8));
    assert!(!rig.actual().node_status.contains(NodeStatus::FAULT), "a fault of the axis, not of the node");
    assert_eq!(rig.explicit(GET, 1, 657, &[]), (0, (1_u64 << 30).to_le_bytes().to_vec()));
    rig.command.axis_control = AxisControl::FAULT_RESET;
    rig.cycles(3);
    assert_eq!(rig.state(), AxisState::MajorFaulted, "the cause is still there");
    rig.command.axis_control = AxisControl::NONE;
    rig.drive.sticky = false;
    rig.cycle();
    rig.command.axis_control = AxisControl::FAULT_RESET;
    rig.cycles(3);
    assert_eq!((rig.state(), rig.actual().axis_response), (AxisState::Stopped, AxisControl::FAULT_RESET));
    assert_eq!((rig.image().action, rig.withheld()), (DriveAction::PowerUp, Some(Withheld::NotRunning)));
}

#[test]
fn lost_repeated_and_reordered_updates_are_told_apart() {
    let mut rig = FixedRig::running();
    let before = *rig.device.counters();
    rig.command.values = velocity(1.0);
    let first = rig.next_packet();
    rig.command.values = velocity(2.0);
    let second = rig.next_packet();
    rig.send(&second);
    assert_eq!(rig.follow().values, velocity(2.0));
    rig.send(&first);
    assert_eq!(rig.follow().values, velocity(2.0), "an older update changes nothing");
    rig.send(&second);
    // The same Update ID under a new sequence count.
    rig.sequence += 1;
    rig.command.values = velocity(3.0);
    let again = [&rig.sequence.to_le_bytes()[..], &rig.octets()].concat();
    rig.send(&again);
    assert_eq!(rig.follow().values, velocity(2.0), "a repeated update changes nothing");
    let after = rig.device.counters();
    assert_eq!(after.applied - before.applied, 1);
    assert_eq!(after.lost_updates - before.lost_updates, 1);
    assert_eq!(after.out_of_order - before.out_of_order, 1);
    assert_eq!(after.refreshes - before.refreshes, 1);
    assert_eq!(after.repeated - before.repeated, 1);
    assert_eq!(rig.device.node_fault(), NodeFault::NONE);
    // More in a row than the high limit allows: the node faults, the axis stops, and a reset does not help.
    let limit = rig.explicit(GET, 0, 21, &[]);
    let skipped = u8::try_from(rig.device.engine.instances.high_limit()).expect("an octet") + 1;
    assert_eq!(limit, (0, vec![skipped - 1]));
    rig.command.update_id = rig.command.update_id.wrapping_add(skipped);
    rig.cycle();
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE);
    assert_eq!(rig.withheld(), Some(Withheld::NodeFault));
    rig.cycle();
    assert!(rig.actual().node_status.contains(NodeStatus::FAULT));
    assert_eq!(rig.explicit(GET, 0, 16, &[]), (0, vec![NodeFault::CONNECTION_UPDATE.0]));
}

#[test]
fn without_updates_the_device_goes_on_answering_and_stops_the_axis() {
    let mut rig = FixedRig::running();
    rig.cycle();
    let last = rig.actual().update_id;
    rig.silence();
    assert_eq!(rig.actual().update_id, last.wrapping_add(1), "on its own schedule");
    let mut silent = 1;
    while rig.state() == AxisState::Running {
        assert!(rig.image().action == DriveAction::Enable && silent < 20);
        rig.silence();
        silent += 1;
    }
    assert_eq!(rig.withheld(), Some(Withheld::NodeFault));
    assert_eq!(rig.device.node_fault(), NodeFault::CONNECTION_UPDATE);
    assert_ne!(rig.image().action, DriveAction::Enable);
    for _ in 0..20 {
        rig.silence();
    }
    assert_eq!(rig.device.connection(), None, "16 periods of silence end the connection");
    assert_eq!(rig.device.counters().connection_losses, 1);
    assert_eq!(rig.withheld(), Some(Withheld::ConnectionLost));
    assert!(matches!(rig.device.poll_reply(), Some(MotionReply::ConnectionLost { o_to_t_id: 11, .. })));
}

#[test]
fn what_is_not_an_update_of_this_format_is_counted_and_faults_the_node() {
    let good = FixedRig::running().octets();
    let mut variable = Rig::running();
    let variable_update = variable.command_packet()[2..].to_vec();
    let changed = |at: usize, octet: u8| {
        let mut octets = good.to_vec();
        octets[at] = octet;
        octets
    };
    // Name, update, and which counter counts it: malformed, not finite, oversize.
    let cases: Vec<(&str, Vec<u8>, [u64; 3])> = vec![
        ("variable format", variable_update[..8].to_vec(), [1, 0, 0]),
        ("a whole variable update", variable_update, [0, 0, 1]),
        ("device's own format", changed(0, 3), [1, 0, 0]),
        ("peer to peer", changed(0, 0), [1, 0, 0]),
        ("revision 1", changed(1, 1), [1, 0, 0]),
        ("two commands", changed(8, 0b11), [1, 0, 0]),
        ("reserved command", changed(8, 0b1_0000), [1, 0, 0]),
        ("two actual values", changed(9, 0b11), [1, 0, 0]),
        ("one octet short", good[..15].to_vec(), [1, 0, 0]),
        ("one octet too many", [&good[..], &[0]].concat(), [0, 0, 1]),
        ("nothing", Vec::new(), [1, 0, 0]),
        ("not a number", [&good[..12], &f32::NAN.to_le_bytes()].concat(), [0, 1, 0]),
        ("infinite", [&good[..12], &f32::INFINITY.to_le_bytes()].concat(), [0, 1, 0]),
    ];
    for (name, mut update, expected) in cases {
        let mut rig = FixedRig::running();
        let before = *rig.device.counters();
        rig.next_packet();
        if let Some(id) = update.get_mut(2) {
            *id = rig.command.update_id;
        }
        let packet = [&rig.sequence.to_le_bytes()[..], &update].concat();
        rig.send(&packet);
        let after = *rig.device.counters();
        let counted = [
            after.malformed - before.malformed,
            after.not_finite - before.not_finite,
            after.oversize - before.oversize,
        ];
        assert_eq!(counted, expected, "{name}");
        assert_eq!(after.applied, before.applied, "{name}");
        assert_eq!(rig.device.node_fault(), NodeFault::DATA_FORMAT, "{name}");
        assert_eq!(rig.withheld(), Some(Withheld::NodeFault), "{name}");
        rig.run_device();
        assert_ne!(rig.image().action, DriveAction::Enable, "{name}");
    }
}

#[test]
fn a_fixed_update_on_a_variable_connection_is_refused() {
    let octets = FixedRig::running().octets();
    let mut rig = Rig::running();
    let before = rig.device.counters().malformed;
    let sequence = rig.sequence + 1;
    let packet = [&sequence.to_le_bytes()[..], &octets].concat();
    rig.send(&packet);
    assert_eq!(rig.device.counters().malformed, before + 1);
    assert_eq!(rig.device.node_fault(), NodeFault::DATA_FORMAT);
    assert_eq!(rig.withheld(0), Some(Withheld::NodeFault));
    let error = rig.device.last_error().map(|error| error.to_string());
    assert!(error.as_ref().is_some_and(|text| text.contains("connection format")), "{error:?}");
}

#[test]
fn synchronous_control_and_local_control() {
    let mut rig = FixedRig::running();
    rig.command.node_control |= NodeControl::SYNC_CONTROL;
    rig.cycles(3);
    assert!(!rig.actual().node_status.contains(NodeStatus::SYNC_MODE), "without time stamps there is none");
    assert_eq!((rig.state(), rig.device.node_fault()), (AxisState::Running, NodeFault::NONE));
    rig.command.node_control = NodeControl::DATA_VALID;
    rig.cycles(3);
    assert_eq!(rig.withheld(), Some(Withheld::LocalControl));
    assert_ne!(rig.state(), AxisState::Running);
}

#[test]
fn sixteen_octets_alone_do_on_a_network_without_sequence_counts() {
    let mut rig = FixedRig::stopped();
    let mut out = [0xA5; 64];
    let mut answers = Vec::new();
    rig.command.axis_control = AxisControl::ENABLE;
    rig.command.values = velocity(4.0);
    for step in 0..6 {
        rig.command.update_id = rig.command.update_id.wrapping_add(1);
        let octets = rig.octets();
        rig.device.handle_unsequenced(rig.now(), None, &octets);
        if step == 5 {
            // The same octets again: alive, and nothing new.
            rig.device.handle_unsequenced(rig.now(), None, &octets);
        }
        let command = rig.image();
        rig.drive.step(&command);
        rig.device.set_drive(0, rig.drive.image);
        if let Some(len) = rig.device.poll_unsequenced(rig.now(), None, &mut out) {
            assert_eq!((len, out[len]), (LEN, 0xA5));
            answers.push(FixedActual::parse(&out[..len]).expect("an update").update_id);
        }
        rig.now += PERIOD;
    }
    assert_eq!((rig.state(), rig.follow().values), (AxisState::Running, velocity(4.0)));
    let id = rig.command.update_id;
    assert_eq!(answers, (0..6).map(|back| id.wrapping_sub(5 - back)).collect::<Vec<_>>());
    assert_eq!(rig.device.counters().repeated, 1);
    // An older Update ID is old, whatever comes around it.
    rig.command.update_id = id.wrapping_sub(2);
    let old = rig.octets();
    rig.device.handle_unsequenced(rig.now(), None, &old);
    assert_eq!(rig.device.counters().out_of_order, 1);
    rig.device.handle_unsequenced(rig.now(), None, &[0; 17]);
    assert_eq!((rig.device.counters().oversize, rig.device.node_fault()), (1, NodeFault::DATA_FORMAT));
}
