//! The cycle of the box touches no heap once the bus is in CP4: weighed with a counting allocator, the
//! engine alone.

use std::cell::Cell;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;

use allocation_counter::{measure, opt_out};
use axisbridge::capture::Side;
use axisbridge::capture::reader::Reader;
use axisbridge::capture::recorder::{Interfaces, Recorder};
use axisbridge::config::Config;
use axisbridge::engine::direct::{DirectNorth, DirectRequest, Direction, Target};
use axisbridge::engine::notice::Notice;
use axisbridge::mapping::{CipProgram, Mapping, Object, Told};
use axisbridge::recording::{AttributeNames, ContactDevice, DEPTH, Plan, Recording};
use axisbridge::simulate::drives::linear;
use axisbridge::status::BoxState;
use axisbridge::sys::clock::KernelTime;
use axisbridge::translate::Stage;
use axisbridge_tests::can_frames;
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{at_full_speed, in_motion, long_moves, millis};
use axisbridge_tests::rig::network::Knobs;
use axisbridge_tests::rig::ports::TamperCan;
use axisbridge_tests::rig::{BOX, CONTROLLER, Rig, Settings};
use profile_cip::assembly::Control;
use profile_cip::controller::sets::DataSets;
use profile_cip::controller::{AttributeSet, AxisSet, ControllerConfig, Event, Limits, Misbehaviour, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::drive_link::DriveImage;
use profile_cip::wire::ConnectionTriad;
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram};
use profile_cip::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use profile_cip::wire::motion::codes::{ControlMode, EventChecking};
use profile_cip::wire::motion::event::ExtendedEventData;
use profile_cip::wire::motion::{CommandPosition, CommandValues};
use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
use profile_generic::can::{Frame, Id};
use profile_generic::fault::FaultCause;
use profile_generic::fault_set::FaultSet;
use profile_generic::image::{AxisCommand, AxisFeedback, Signal};
use profile_generic::mode::OperatingMode;
use profile_generic::program::ConversionReport;
use profile_generic::quantity::Position;
use profile_generic::scaling::UnitKind;
use profile_generic::servo::Marks;
use profile_generic::state::Action;
use profile_generic::time::DurationNs;
use profile_sercos::master::event::Event as SercosEvent;
use profile_sercos::port::Port;
use profile_sercos::slave::communication::CLASSES_WITH_HOT_PLUG;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::{Config as SlaveConfig, Slave};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::scp::{ScpClass, ScpEntry};
use profile_sercos::wire::svc::Element;

/// Calls of the engine in a cycle of the bus: to build it, and to send it at its instant.
const CALLS: u32 = 2;

/// Weighs so many cycles and returns their allocations; `between` acts on the rig before each.
fn weigh(rig: &mut Rig, cycles: u32, mut between: impl FnMut(&mut Rig, u32)) -> Vec<(u32, u64)> {
    let mut found = Vec::new();
    for number in 0..cycles {
        between(rig, number);
        for _ in 0..CALLS {
            let info = rig.cycle_in(|cycle| measure(cycle));
            if info.count_total != 0 {
                found.push((number, info.count_total));
            }
        }
    }
    found
}

#[test]
fn the_scale_weighs() {
    let info = measure(|| drop(std::hint::black_box(Box::new(1_u64))));
    assert_eq!(info.count_total, 1);
}

/// Programs alone, as they are made for SERCOS and for CiA 402 drives: C-to-D to the telegram, telegram to D-to-C.
#[test]
fn translation_allocates_nothing() {
    let mapping = Mapping::embedded().expect("the shipped tables");
    let config =
        Config::parse(include_str!("../frames/config.toml"), "config.toml").expect("a configuration");
    let sercos = Stage::rehearse(&config, mapping.clone()).expect("its drives");
    let can = can_frames::stage(mapping).expect("its drives");
    for axis in sercos.axes.iter().chain(&can.axes) {
        let values = CommandValues {
            position: Some(CommandPosition::Float(123_456.5)),
            velocity: Some(1.5),
            torque: Some(10.0),
            ..CommandValues::default()
        };
        let (mut trackers, mut south) = (axis.north.trackers(), axis.south.cached_status());
        let (mut command, mut feedback) = (AxisCommand::default(), AxisFeedback::default());
        let (mut telegram, mut image) = ([0; 128], DriveImage::default());
        let (faults, mut told) = (FaultSet::new(), Told::default());
        let mut report = ConversionReport::default();
        let info = measure(|| {
            for mode in [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque] {
                command.mode = mode;
                axis.north.decode(&values, 0, &mut trackers, &mut command);
                for action in Action::ALL {
                    for status in [0, 0x40, 0x21, 0x23, 0x27, 0x08_1037] {
                        axis.south.encode(&command, *action, 0, status, &mut telegram, &mut report);
                    }
                }
                axis.south.decode(&telegram, false, &mut feedback, &mut south, &mut report);
                axis.north.drive_image(&feedback, &faults, &mut told, &mut image);
                for code in [0x2310, 0x8611, 0xFFFF] {
                    for word in axis.south.diagnostic_words(true) {
                        let causes = axis.south.faults(word, code);
                        causes.for_each(|(cause, _)| {
                            std::hint::black_box(axis.north.fault(cause));
                        });
                    }
                }
            }
        });
        assert_eq!(info.count_total, 0, "{}", axis.drive);
        assert_eq!(report.saturated, 0, "{}", axis.drive);
        assert!(feedback.get(Signal::PositionActual).is_some(), "{}: it was translated", axis.drive);
    }
}

#[test]
fn cycles_with_two_axes_in_motion_allocate_nothing() {
    let mut rig = in_motion(Settings::default());
    assert_eq!(weigh(&mut rig, 2_000, |_, _| ()), []);
    assert!(rig.engine.axes().iter().all(|axis| axis.counters().commands > 900), "both axes were led");
    assert_eq!(rig.report().steps_finished, 1, "the whole time was inside of the motion");
}

/// What the cycle does for the rolling recording: a record of each frame into a queue, also when the queue is full.
#[test]
fn recording_of_frames_allocates_nothing_where_they_are_seen() {
    const ROUNDS: u32 = 2_000;
    let devices = vec![ContactDevice { name: "front".to_owned(), address: Ipv4Addr::new(192, 0, 2, 1) }];
    let recording = Recording::new(Plan {
        span: DurationNs::from_secs(10),
        memory: 2_000_000,
        interfaces: Interfaces { can: vec!["can0".to_owned()], ..Interfaces::default() },
        devices,
        axes: vec![("turntable".to_owned(), 0)],
        attributes: AttributeNames::default(),
        buses: vec!["SERCOS".to_owned()],
        directory: None,
    });
    let sink = Some(recording.sink());
    let (recorder, mut taps) = Recorder::start_with(None, sink, DEPTH, 1).expect("a thread");
    let tap = &mut taps[0];
    let (controller, device) = (
        SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 10), 2_222),
        SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 2_222),
    );
    let can = Frame::new(Id::Standard(0x181), &[1, 2, 3]).expect("a frame");
    let info = measure(|| {
        for number in 0..ROUNDS {
            let at = KernelTime(u64::from(number));
            tap.frame(at, Side::South(Port::One), &[7; 200]);
            tap.can_frame(at, 0, &can);
            tap.datagram(at, controller, device, 0, &[1; 100]);
            tap.datagram(at, device, controller, 0, &[2; 100]);
        }
    });
    assert_eq!(info.count_total, 0);
    drop(taps);
    recorder.finish().expect("no file");
    let file = recording.take(DurationNs::from_secs(10)).expect("a recording");
    let mut reader = Reader::new(&file[..]).expect("a recording");
    let mut frames = 0;
    while reader.next_frame().expect("a frame").is_some() {
        frames += 1;
    }
    assert!((DEPTH..=8_000).contains(&frames), "{frames} were taken");
}

#[test]
fn neither_a_bad_network_nor_a_start_nor_a_stop_allocates() {
    let knobs = Knobs { loss: 50, duplication: 20, reordering: 50, ..Knobs::GOOD };
    let mut rig = Rig::ready(Settings { knobs, ..Settings::default() });
    // How well lost updates are bridged stands in the tables of motion.
    rig.motion_checker.tolerate("repeated loss", |_| true);
    rig.connect(long_moves());
    // Opening the connection, configuration, enable, motion, disable, closing.
    assert_eq!(weigh(&mut rig, 3_000, |_, _| ()), []);
    assert_eq!(rig.report().failure, None);
    assert!(rig.report().steps_finished >= 2, "{}", rig.log());
}

/// Taken at an Enable, taken again, and given up with the connection.
#[test]
fn scaling_of_the_controller_allocates_nothing() {
    let mut rig = Rig::ready(Settings::default());
    let count = |rig: &Rig| rig.engine.devices()[0].program(0).map(CipProgram::count);
    let resolution = |counts: i32| Step::SetAttributes {
        axis: 1,
        attributes: vec![AttributeSet::bytes(78, &counts.to_le_bytes())],
    };
    let turntable = AxisSet::one(1);
    rig.connect(vec![
        resolution(500_000),
        Step::Enable(turntable),
        Step::Disable(turntable),
        resolution(250_000),
        Step::Enable(turntable),
        Step::Disable(turntable),
        Step::Dwell { seconds: 10.0 },
    ]);
    let mut counts = vec![count(&rig)];
    let found = weigh(&mut rig, 3_000, |rig, _| {
        if counts.last() != Some(&count(rig)) {
            counts.push(count(rig));
        }
    });
    assert_eq!(found, []);
    assert_eq!((rig.report().failure, rig.report().steps_finished), (None, 6), "{}", rig.log());
    rig.kill_controller();
    rig.run_until(millis(5_000), "the connection is lost", |rig| rig.status().connections == 0);
    rig.connect(vec![Step::Dwell { seconds: 10.0 }]);
    assert_eq!(weigh(&mut rig, 1_000, |_, _| ()), []);
    counts.push(count(&rig));
    assert_eq!(counts, [1_000, 2_000, 4_000, 1_000].map(Some));
}

#[test]
fn a_drive_that_is_plugged_in_while_another_axis_moves_allocates_nothing() {
    let classes: &'static [ScpEntry] = &[
        ScpEntry { class: ScpClass::VAR_CFG, version: 1 },
        ScpEntry { class: ScpClass::SYNC, version: 1 },
        ScpEntry { class: ScpClass::HOT_PLUG, version: 1 },
    ];
    let mut rig = Rig::ready(Settings {
        configuration: BOX.replace("address = 2", "address = 2\nhot_plug = true"),
        drives: vec![(1, UnitKind::Rotary)],
        ..Settings::default()
    });
    let config = ControllerConfig { late: AxisSet::one(2), ..rig.controller_config() };
    let limits = axisbridge_tests::rig::motion::TURNTABLE;
    let program = vec![
        Step::Enable(AxisSet::one(1)),
        Step::MoveAbsolute { axis: 1, position: 60.0, limits },
        Step::Disable(AxisSet::one(1)),
    ];
    rig.connect_with(config, program);
    rig.run_until(millis(5_000), "full speed", |rig| rig.velocity(0) > 4_900_000_000);
    let found = weigh(&mut rig, 5_000, |rig, number| match number {
        100 => {
            let config = SlaveConfig { address: 2, classes, ..SlaveConfig::default() };
            rig.line.append(Slave::new(&config, Drive::new(linear()).expect("the servo works")));
            rig.line.mend(1);
        }
        // Pulled out, and in again.
        3_000 => rig.line.cut(1),
        3_100 => rig.line.mend(1),
        _ => {}
    });
    let came =
        |notice: &&Notice| matches!(notice, Notice::Sercos(SercosEvent::HotPlugged { address: 2, .. }));
    assert_eq!(rig.notices.iter().filter(came).count(), 2, "{}", rig.told());
    assert_eq!(found, []);
    assert_eq!(rig.report().failure, None);
}

/// The answers to what it was asked have buffers, which the commissioner frees.
#[test]
fn a_drive_that_goes_again_on_its_way_in_frees_nothing_in_the_cycle() {
    let mut rig = Rig::ready(Settings {
        configuration: BOX.replace("address = 2", "address = 2\nhot_plug = true"),
        drives: vec![(1, UnitKind::Rotary)],
        ..Settings::default()
    });
    let config = SlaveConfig { address: 2, classes: CLASSES_WITH_HOT_PLUG, ..SlaveConfig::default() };
    rig.line.append(Slave::new(&config, Drive::new(linear()).expect("the servo works")));
    let mut found = Vec::new();
    let mut refused = 0;
    for cycles in (100..400).step_by(25) {
        rig.line.mend(1);
        for number in 0..cycles + 100 {
            if number == cycles {
                rig.line.cut(1);
            }
            for _ in 0..CALLS {
                let info = rig.cycle_in(|cycle| measure(cycle));
                if (info.count_total, info.count_current) != (0, 0) {
                    found.push((cycles, number, info.count_total, info.count_current));
                }
            }
        }
        let is_refusal = |notice: &&Notice| {
            matches!(notice, Notice::Sercos(SercosEvent::HotPlugRefused { address: Some(2), .. }))
        };
        refused += rig.notices.iter().filter(is_refusal).count();
        rig.notices.clear();
    }
    assert!(refused > 3, "{refused}");
    assert_eq!(found, []);
}

#[test]
fn a_fault_its_diagnosis_and_its_reset_allocate_nothing() {
    let mut rig = in_motion(Settings::default());
    assert!(at_full_speed(&rig));
    let found = weigh(&mut rig, 1_000, |rig, number| match number {
        100 => rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT),
        300 => rig.drive_mut(0).clear_fault(FaultCause::OVER_CURRENT),
        500 => {
            rig.kill_controller();
        }
        _ => {}
    });
    assert_eq!(found, []);
    assert_eq!(rig.engine.axes()[0].counters().faults, 1);
    rig.run_for(millis(10));
}

#[test]
fn events_in_the_telegrams_and_over_the_service_channel_allocate_nothing() {
    for way in ["cyclic", "service-channel"] {
        let line = format!("events = \"{way}\"\ninstance = ");
        let settings = Settings { configuration: BOX.replace("instance = ", &line), ..Settings::default() };
        let mut rig = in_motion(settings);
        let marks =
            Marks { from: Position(0), length: Position(1_000_000), every: Some(Position(500_000_000)) };
        rig.drive_mut(0).servo_mut().set_marks(1, Some(marks));
        let bits = EventChecking::REG_1_POSITIVE | EventChecking::REG_1_POSITIVE_REARM;
        let data =
            ExtendedEventData { watch_positions: [Some(5_000_000), None], ..ExtendedEventData::default() };
        let checking = bits | EventChecking::WATCH_1_FORWARD | EventChecking::MARKER_POSITIVE;
        rig.controller.as_mut().expect("a controller").arm_events(1, checking, Some(&data));
        assert_eq!(weigh(&mut rig, 1_000, |_, _| ()), []);
        let told = rig.events.iter().filter(|event| matches!(event, Event::AxisEvent { .. })).count();
        assert!(told > 5, "{way}: {told} events");
    }
}

#[test]
fn the_fixed_format_allocates_nothing() {
    let mut rig = Rig::ready(Settings::fixed());
    let mut config = rig.controller_config();
    config.axes[0].control_mode = ControlMode::VELOCITY;
    config.axes[0].sets = DataSets::fixed(ControlMode::VELOCITY);
    let one = AxisSet::first(1);
    rig.connect_with(
        config,
        vec![
            Step::Enable(one),
            Step::RunAt { axis: 1, velocity: 2.0, acceleration: 2.0, jerk: 100.0 },
            Step::Misbehave(Misbehaviour::SkipUpdates { updates: 1 }),
            Step::Dwell { seconds: 100.0 },
        ],
    );
    rig.run_until(millis(20_000), "the axis enabled", |rig| rig.report().steps_finished == 1);
    // The format octet of an update, behind the class 1 header.
    let other = Rc::new(Cell::new(false));
    let spoil = Rc::clone(&other);
    rig.tamper_command = Some(Box::new(move |bytes| {
        if spoil.take() {
            bytes.as_mut_slice()[CLASS1_HEADER_LEN] = 6;
        }
        true
    }));
    let applied = rig.engine.axes()[0].counters().commands;
    let found = weigh(&mut rig, 2_000, |rig, number| match number {
        1_600 => other.set(true),
        1_800 => {
            rig.kill_controller();
        }
        1_599 => assert!(rig.velocity(0) > 1_900_000_000, "{}", rig.velocity(0)),
        _ => {}
    });
    assert_eq!(found, []);
    assert!(!other.get(), "an update of the other format came");
    assert!(rig.engine.axes()[0].counters().commands > applied + 600, "the axis was led");
    assert!(rig.torque_free(), "and stopped");
}

/// Opens a connection to the assemblies of the rig's box with two axes and the layout "position"; its O->T ID.
fn open_assembly(rig: &mut Rig) -> u32 {
    let direction = |size| NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority: Priority::SCHEDULED,
        variable: false,
        size,
    };
    let open = ForwardOpen {
        large: false,
        priority_tick: 5,
        timeout_ticks: 157,
        o_to_t_id: 0,
        t_to_o_id: 9,
        triad: ConnectionTriad { connection_serial: 1, originator_vendor: 2, originator_serial: 3 },
        timeout_multiplier: 2,
        o_to_t_rpi_us: 2_000,
        o_to_t: direction(38),
        t_to_o_rpi_us: 2_000,
        t_to_o: direction(42),
        transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
        path: &[0x20, 4, 0x24, 151, 0x2C, 150, 0x2C, 100],
    };
    let mut data = vec![0; open.buffer_len()];
    open.emit(&mut data).expect("it fits");
    let client = Client::connect(rig, CONTROLLER);
    let (status, data) = client.request(rig, 0x54, &[0x20, 6, 0x24, 1], &data);
    assert_eq!(status, 0);
    ForwardOpenReply::parse(&data).expect("a reply").o_to_t_id
}

#[test]
fn an_axis_moved_through_assemblies_and_its_lost_connection_allocate_nothing() {
    let assembly = "assembly = { layout = \"position\" }\n\n[device.identity]";
    let text = BOX.replacen("[device.identity]", assembly, 1);
    let mut rig = Rig::ready(Settings { configuration: text, ..Settings::default() });
    let connection_id = open_assembly(&mut rig);
    let mut fastest = 0;
    let found = weigh(&mut rig, 1_200, |rig, number| {
        fastest = fastest.max(rig.velocity(0));
        // Silence from then on.
        if number >= 900 {
            return;
        }
        let word = match number {
            0..20 => Control::empty(),
            20..300 => Control::ENABLE,
            _ => Control::ENABLE | Control::START,
        };
        let mut data = [0; 36];
        data[0] = 1;
        data[4..6].copy_from_slice(&word.bits().to_le_bytes());
        for (place, value) in [(8, 5_000_000_i32), (12, 1_000_000), (16, 10_000_000)] {
            data[place..place + 4].copy_from_slice(&value.to_le_bytes());
        }
        let [low, high, ..] = number.to_le_bytes();
        let datagram = Class1Datagram {
            connection_id,
            encapsulation_sequence: number,
            sequence_count: u16::from_le_bytes([low, high]),
            data: &data,
        };
        let mut bytes = [0; 64];
        let len = datagram.emit(&mut bytes).expect("it fits");
        rig.inject_datagram(&bytes[..len], SocketAddrV4::new(CONTROLLER, 2222));
    });
    assert_eq!(found, []);
    assert!(fastest > 900_000_000, "it was at speed: {fastest}");
    let fault = rig.engine.axes()[0].fault().map(|fault| fault.cause);
    assert_eq!(fault, Some(FaultCause::COMMAND_LOST));
    assert!(rig.torque_free());
}

#[test]
fn a_hookup_test_allocates_nothing() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![Step::Dwell { seconds: 100.0 }]);
    let stopped =
        |rig: &Rig| rig.engine.devices()[0].axis_states().all(|(_, state)| state == AxisState::Stopped);
    rig.run_until(millis(10_000), "both axes in Stopped", stopped);
    let client = Client::connect(&mut rig, CONTROLLER);
    let quarter_turn = [0, 0, 0, 0, 0, 0, 0x80, 0x3E, 0, 0, 0, 0];
    assert_eq!(client.ask(&mut rig, 0x53, 1, None, &quarter_turn), (0, vec![]));
    let from = rig.position(0);
    assert_eq!(weigh(&mut rig, 6_000, |_, _| ()), []);
    assert!(rig.position(0) - from > 200_000_000, "it moved while it was weighed");
    assert!(stopped(&rig), "from beginning to end");
}

/// A box with two CAN drives that has just been switched on.
fn on_can_from_the_start(tamper: Option<TamperCan>) -> Rig {
    let configuration = include_str!("virtual_time/can.toml").to_owned();
    let mut rig = Rig::new(Settings::without_line(configuration));
    rig.can[0].tamper = tamper;
    rig
}

/// Both CAN axes in the middle of a long move.
fn on_can(tamper: Option<TamperCan>) -> Rig {
    let mut rig = on_can_from_the_start(tamper);
    rig.run_until(millis(20_000), "the bus up", |rig| rig.status().state == BoxState::READY);
    let limits = Limits { velocity: 4.0, acceleration: 50.0, jerk: 1_000.0 };
    rig.connect(vec![
        Step::Enable(AxisSet::first(2)),
        Step::Together(vec![
            Step::MoveAbsolute { axis: 1, position: 1_000.0, limits },
            Step::MoveAbsolute { axis: 2, position: 900.0, limits },
        ]),
    ]);
    rig.run_until(millis(5_000), "both in motion", |rig| (0..2).all(|device| turns(rig, device)));
    rig
}

fn turns(rig: &Rig, device: usize) -> bool {
    let node = rig.can[0].bus.nodes().nth(device).expect("a device");
    node.application().axes()[0].actual().velocity.get() > 700_000_000
}

#[test]
fn cycles_with_two_can_axes_in_motion_allocate_nothing() {
    let mut rig = on_can(None);
    assert_eq!(weigh(&mut rig, 4_000, |_, _| ()), []);
    assert!(rig.engine.axes().iter().all(|axis| axis.counters().commands > 900), "both axes were led");
    assert!((0..2).all(|device| turns(&rig, device)));
}

/// Direct accesses of local control bring their buffers and take them away again: long values, and writes that are refused.
#[test]
fn direct_accesses_to_drives_in_motion_allocate_nothing() {
    let targets = [
        Target::Element(Idn::standard(17), Element::Data),
        Target::Element(Idn::standard(104), Element::Name),
        Target::Object(Object { index: 0x1008, sub: 0 }),
    ];
    for (mut rig, answered) in
        [(in_motion(Settings::default()), [true, true, false]), (on_can(None), [false, false, true])]
    {
        let (direct, mut end) = DirectNorth::new();
        rig.engine.set_direct(direct);
        let mut counts = [0_u32; 3];
        let mut refused = 0;
        let found = weigh(&mut rig, 3_000, |_, number| {
            while let Ok(answer) = end.answers.pop() {
                match answer.result {
                    Ok(_) => counts[usize::try_from(answer.id).expect("small")] += 1,
                    Err(_) => refused += 1,
                }
            }
            if number % 10 == 0 {
                let place = number / 10 % 3;
                let target = targets[usize::try_from(place).expect("small")];
                let direction =
                    if number % 100 == 0 { Direction::Write { rescales: true } } else { Direction::Read };
                let data = Vec::with_capacity(4_096);
                let request = DirectRequest { client: 1, id: place, axis: 0, target, direction, data };
                // A full queue is tried again.
                let _ = end.requests.push(request);
            }
        });
        assert_eq!(found, []);
        assert_eq!(counts.map(|count| count > 3), answered, "{counts:?}");
        assert!(refused > 3, "a controller has the axis, and other buses have other numbers: {refused}");
    }
}

/// The first drive has no torque to tell, and gets other PDOs than those that were planned.
fn without_torque() -> TamperCan {
    Box::new(|_, frame| {
        let torque = frame.id() == Id::Standard(0x581) && frame.data().get(1..3) == Some(&[0x77, 0x60]);
        if torque {
            let abort = [0x80, 0x77, 0x60, 0, 0, 0, 0x02, 0x06];
            *frame = Frame::new(frame.id(), &abort).expect("a frame");
        }
        true
    })
}

#[test]
fn can_drives_come_up_without_allocating_in_the_cycle() {
    let mut rig = on_can_from_the_start(Some(without_torque()));
    assert_eq!(weigh(&mut rig, 1_500, |_, _| ()), []);
    assert_eq!(rig.status().state, BoxState::READY, "{}", rig.told());
    let bus = rig.engine.buses().can().next().expect("a CAN bus");
    let bytes = |node: usize| bus.master().config().nodes[node].tpdos.iter().map(|pdo| pdo.mapping.len());
    assert!(bytes(0).sum::<usize>() < bytes(1).sum::<usize>(), "the first one has no torque");
}

#[test]
fn neither_an_emergency_nor_a_lost_can_drive_nor_its_return_allocates() {
    let mut rig = on_can(Some(without_torque()));
    assert!(
        rig.told().contains("commissioning continues without reading 60A9:00, 6077:00"),
        "{}",
        rig.told()
    );
    let found = weigh(&mut rig, 6_000, |rig, number| {
        let now = rig.now();
        let bus = &mut rig.can[0].bus;
        match number {
            // Temperature of the motor, as a fault.
            200 => {
                let node = bus.nodes_mut().next().expect("a drive");
                node.dictionary_mut().set(0x2FFF, 1, 0x4310);
            }
            1_000 => bus.connect(now, 0, false),
            2_000 => bus.connect(now, 0, true),
            _ => {}
        }
    });
    let told = rig.told();
    for line in ["CAN bus 1: the heartbeat of node 1 is gone", "CAN bus 1: node 1: EMCY 4310"] {
        assert!(told.lines().any(|found| found.starts_with(line)), "{line}: {told}");
    }
    let back = told.lines().filter(|line| *line == "CAN bus 1: node 1 is in operation").count();
    assert_eq!(back, 2, "{told}");
    assert_eq!(found, []);
}

/// A box with a CIP Motion drive and a velocity drive on DeviceNet that has just been switched on.
fn on_devicenet_from_the_start() -> Rig {
    let configuration = include_str!("virtual_time/devicenet.toml");
    let (head, tail) =
        configuration.split_once("[axis.limits]\nfollowing_error = 0.5\n").expect("the turntable's limits");
    let velocity_drive =
        format!("{head}{tail}").replace("mac_id = 5\nresolution = 1_048_576", "mac_id = 5\nkind = \"ac-dc\"");
    let mut rig = Rig::new(Settings::without_line(velocity_drive));
    // The simulated drives make their explicit answers on the heap.
    rig.devicenet[0].aside = |run| opt_out(run);
    rig
}

/// Both axes in motion: the turntable in velocity control, the slide on a long way.
fn on_devicenet() -> Rig {
    let mut rig = on_devicenet_from_the_start();
    rig.run_until(millis(20_000), "the network up", |rig| rig.status().state == BoxState::READY);
    let limits = Limits { velocity: 10.0, acceleration: 100.0, jerk: 2_000.0 };
    let mut config = rig.controller_config();
    config.axes[0].control_mode = ControlMode::VELOCITY;
    let program = vec![
        Step::Enable(AxisSet::first(2)),
        Step::RunAt { axis: 1, velocity: 2.0, acceleration: 20.0, jerk: 400.0 },
        Step::MoveAbsolute { axis: 2, position: 900.0, limits },
    ];
    rig.connect_with(config, program);
    rig.run_until(millis(5_000), "both in motion", |rig| (0..2).all(|drive| turns_on_devicenet(rig, drive)));
    rig
}

fn turns_on_devicenet(rig: &Rig, drive: usize) -> bool {
    let node = rig.devicenet[0].bus.nodes().nth(drive).expect("a drive");
    node.actual().velocity.get() > 1_000_000_000
}

#[test]
fn cycles_with_two_devicenet_axes_in_motion_allocate_nothing() {
    let mut rig = on_devicenet();
    let before: Vec<u64> = rig.engine.axes().iter().map(|axis| axis.counters().commands).collect();
    assert_eq!(weigh(&mut rig, 2_000, |_, _| ()), []);
    for (axis, before) in rig.engine.axes().iter().zip(before) {
        assert!(axis.counters().commands > before + 50, "both axes were led");
    }
    assert!((0..2).all(|drive| turns_on_devicenet(&rig, drive)));
}

/// There is no commissioner: access, allocation and set-up are all steps of the cycle.
#[test]
fn devicenet_drives_come_up_without_allocating() {
    let mut rig = on_devicenet_from_the_start();
    assert_eq!(weigh(&mut rig, 8_000, |_, _| ()), []);
    assert_eq!(rig.status().state, BoxState::READY, "{}", rig.told());
    assert!(rig.engine.axes().iter().all(|axis| axis.south().is_some()), "{}", rig.told());
}

#[test]
fn neither_a_lost_devicenet_drive_nor_its_return_nor_a_fault_allocates() {
    let mut rig = on_devicenet();
    let found = weigh(&mut rig, 12_000, |rig, number| {
        let now = rig.now();
        let bus = &mut rig.devicenet[0].bus;
        match number {
            200 => bus.nodes_mut().nth(1).expect("a drive").servo_mut().raise_fault(FaultCause::OVER_CURRENT),
            1_000 => bus.connect(now, 0, false),
            2_000 => bus.connect(now, 0, true),
            _ => {}
        }
    });
    let told = rig.told();
    let back = told.lines().filter(|line| *line == "DeviceNet 1: slave 5: exchanging").count();
    assert_eq!(back, 2, "{told}");
    assert!(
        rig.engine.axes()[1].fault().is_some_and(|fault| fault.cause == FaultCause::OVER_CURRENT),
        "{told}"
    );
    assert_eq!(found, []);
}
