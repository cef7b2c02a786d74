//! Whatever comes, in whatever order: no panic, and no motion that was not commanded.

use proptest::prelude::*;

use super::*;
use crate::device::axis::drive_link::DriveAction;
use crate::device::axis::state::AxisState;

/// One thing that can happen.
#[derive(Debug, Clone)]
enum Step {
    /// A good update with this Axis Control for axis 0.
    Good(u8),
    /// A good update with one octet changed.
    Changed(usize, u8),
    /// A good update cut short.
    Cut(usize),
    /// Octets of no meaning.
    Noise(Vec<u8>),
    /// Update periods without anything.
    Silence(u8),
    /// An update with this Update ID ahead of the one before.
    Jump(u8),
    /// Node Control bits as they come.
    Control(u8),
    /// The drive's bus, start inhibit, fault, being online.
    Drive(bool, bool, bool, bool),
    Close,
    Open,
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        8 => prop_oneof![0u8..10, Just(127), any::<u8>()].prop_map(Step::Good),
        3 => (0usize..120, any::<u8>()).prop_map(|(at, value)| Step::Changed(at, value)),
        1 => (0usize..60).prop_map(Step::Cut),
        1 => prop::collection::vec(any::<u8>(), 0..80).prop_map(Step::Noise),
        2 => (1u8..20).prop_map(Step::Silence),
        1 => (0u8..10).prop_map(Step::Jump),
        1 => any::<u8>().prop_map(Step::Control),
        2 => any::<(bool, bool, bool, bool)>().prop_map(|(b, i, f, o)| Step::Drive(b, i, f, o)),
        1 => Just(Step::Close),
        2 => Just(Step::Open),
    ]
}

fn send(rig: &mut Rig, packet: &[u8]) {
    rig.send(packet);
    rig.run_device();
    rig.now += PERIOD;
}

fn apply(rig: &mut Rig, step: &Step) {
    match step {
        Step::Good(control) => {
            rig.blocks[0].axis_control = AxisControl(*control);
            let packet = rig.command_packet();
            send(rig, &packet);
        }
        Step::Changed(at, value) => {
            let mut packet = rig.command_packet();
            let at = at % packet.len();
            packet[at] = *value;
            send(rig, &packet);
        }
        Step::Cut(len) => {
            let packet = rig.command_packet();
            send(rig, &packet[..(*len).min(packet.len())]);
        }
        Step::Noise(octets) => send(rig, octets),
        Step::Silence(periods) => (0..*periods).for_each(|_| rig.silence()),
        Step::Jump(ahead) => {
            rig.update_id = rig.update_id.wrapping_add(*ahead);
            let packet = rig.command_packet();
            send(rig, &packet);
        }
        Step::Control(bits) => {
            rig.control = NodeControl::from_bits_retain(*bits);
            let packet = rig.command_packet();
            send(rig, &packet);
            rig.control = NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID;
        }
        Step::Drive(bus_up, inhibited, faulted, online) => {
            let image = &mut rig.drives[0].image;
            image.bus_up = *bus_up;
            image.start_inhibits = u16::from(*inhibited);
            image.online = *online;
            if *faulted {
                rig.raise(0, 5, 0x22);
            }
        }
        Step::Close => {
            let close = CloseParameters { token: Token(1), triad: TRIAD, o_to_t_id: 11 };
            rig.request(MotionRequest::Close(close));
        }
        Step::Open => {
            let parameters = rig.open_parameters();
            if let Some(MotionReply::Opened { outcome: Ok(()), .. }) =
                rig.request(MotionRequest::Open(parameters))
            {
                rig.sequence = 0;
                rig.update_id = 0;
                rig.packet.clear();
            }
        }
    }
    while rig.device.poll_reply().is_some() {}
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn nothing_moves_unasked(steps in prop::collection::vec(step(), 1..60)) {
        let mut rig = Rig::stopped();
        let mut before = rig.command(0);
        for step in &steps {
            apply(&mut rig, step);
            let command = rig.command(0);
            let enabled = |image: &AxisCommandImage| image.action == DriveAction::Enable;
            if enabled(&command) && !enabled(&before) {
                // Only an update can enable, and only one with the request in it (a changed octet may be that one).
                let asked = matches!(step, Step::Good(1) | Step::Changed(_, 1) | Step::Jump(_) | Step::Control(_));
                let standing = rig.blocks[0].axis_control == AxisControl::ENABLE;
                prop_assert!(asked || (matches!(step, Step::Changed(..)) && standing), "{step:?}");
            }
            if let Command::Follow(set_points) = command.command {
                prop_assert_eq!(command.state, AxisState::Running);
                prop_assert_eq!(command.action, DriveAction::Enable);
                prop_assert!(rig.device.connection().is_some());
                prop_assert!(set_points.values.is_finite());
                prop_assert!(u64::from(set_points.age_updates) <= 4);
                prop_assert_eq!(rig.device.node_fault(), crate::wire::motion::codes::NodeFault::NONE);
            }
            if !rig.packet.is_empty() {
                prop_assert!(ActualFrame::parse(&rig.packet[2..]).is_ok());
            }
            before = command;
        }
        // Silence always ends in a stop.
        (0..25).for_each(|_| rig.silence());
        prop_assert_ne!(rig.command(0).action, DriveAction::Enable);
        prop_assert!(rig.withheld(0).is_some());
    }
}

#[test]
fn a_feedback_axis_runs_without_being_enabled_and_never_energizes() {
    let mut rig = Rig::new();
    let config = DeviceConfig {
        format: Format::Variable,
        axes: vec![AxisConfig { kind: ControlKind::FeedbackOnly, ..AxisConfig::default() }; 2],
        attributes: Vec::new(),
        power_structure_class_id: 0,
        supports_sync: false,
        sync_threshold: None,
        transmission_processing_ns: 0,
    };
    rig.device = MotionDevice::new(config).expect("a device");
    rig.blocks.iter_mut().for_each(|block| {
        block.control_mode = ControlMode::NO_CONTROL;
        block.values = CommandValues::default();
    });
    rig.open();
    rig.configure();
    rig.cycles(3);
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Running, DriveAction::PowerUp));
    assert!(rig.withheld(0).is_some());
    rig.request_all(AxisControl::ENABLE);
    rig.cycle();
    assert_eq!(rig.actual(0).response_status, 0x0C);
    rig.request_all(AxisControl::SHUTDOWN);
    rig.cycle();
    assert_eq!((rig.state(0), rig.command(0).action), (AxisState::Shutdown, DriveAction::Shutdown));
    rig.close();
    rig.packet.clear();
    rig.request_all(AxisControl::NONE);
    rig.open();
    rig.cycles(3);
    assert_eq!(rig.state(0), AxisState::Running);
}
