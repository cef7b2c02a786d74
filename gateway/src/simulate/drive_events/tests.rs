//! The words, their time, and what each event does to the drives of each bus.

use std::fmt::Write as _;

use profile_cia402::drive::index;
use profile_cia402::wire::NodeId;
use profile_cia402::wire::nmt::NmtState;
use profile_cip::devicenet::master::config::DataRate;
use profile_cip::devicenet::wire::MacId;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::can::{Frame, Id};
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::TorqueAbsolute;
use profile_generic::scaling::UnitKind;
use profile_generic::servo::{ServoCommand, ServoParameters};
use profile_generic::state::Report;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::Master;
use profile_sercos::master::config::MasterConfig;
use profile_sercos::master::event::Output;
use profile_sercos::slave::Application as _;
use profile_sercos::slave::phase::State;
use profile_sercos::wire::header::{Header, Kind, Phase};
use profile_sercos::wire::idn::Idn;

use super::player::Player;
use super::setup::{Property, Setup};
use super::*;
use crate::config::DevicenetKind;
use crate::simulate::can_actor::{ActingNode, Actor};
use crate::simulate::can_bus::CanNode;
use crate::simulate::can_drive::{self, DriveNode};
use crate::simulate::devicenet_drive::{self, DevicenetNode};
use crate::simulate::drives::{DriveLine, LineKind, SIMULATED_MAC};

fn names() -> Names {
    Names { what: "drive", numbers: 1..=3 }
}

fn millis(time: i64) -> MonotonicTime {
    MonotonicTime::ZERO + DurationNs::from_millis(time)
}

fn script(text: &str) -> Script {
    Script::parse(text, "events.txt", &names()).unwrap_or_else(|findings| panic!("{findings}"))
}

#[test]
fn every_event_is_read() {
    let text = "\
# A bench that misbehaves.
resolution 4096
resolution 2 10000
rated_torque 3 2.5
gear 2 10:1

at 2 s fault 1 over_current for 200 ms   # a short one
at 1.5s fault feedback_loss
clear 1
clear 2 over_current
warning 1 motor_overload for 1 s
warning off
power off
power 2 off for 10 ms
power 2 on
silence 2 for 1 s
silence 2 off
freeze for 300 ms
freeze 1 off
jump -0.25
jump 2 1
delay ready 3 s
delay 1 torque 700 ms
delay brake 0 s
registration_1 2 on for 5 ms
registration_2 off
home_switch 2 0.25 0.5
home_switch 1 2
home_switch 2 off
home_switch off
limit_switches 1 -1 1
";
    let script = script(text);
    let mut table = String::new();
    for (at, Event { drive, change, lasts }) in &script.events {
        let drive = drive.map_or("all".to_owned(), |drive| drive.to_string());
        let lasts = lasts.map(|time| format!(" for {}", duration::show(time))).unwrap_or_default();
        writeln!(table, "{:>6} {drive:>3} {change}{lasts}", duration::show(*at)).unwrap();
    }
    insta::assert_snapshot!(table);
    let servo = |drive| script.setup.servo(drive, ServoParameters::default());
    let base = ServoParameters::default();
    assert_eq!([1, 2, 3].map(|drive| servo(drive).encoder_counts), [4096, 10_000, 4096]);
    assert_eq!([1, 2, 3].map(|drive| script.setup.gear(drive)), [None, Some((10, 1)), None]);
    let strong = servo(3);
    assert_eq!((strong.rated_torque, strong.inertia), (TorqueAbsolute(2_500_000), base.inertia * 5 / 2));
    assert_eq!(servo(1).rated_torque, base.rated_torque);
}

#[test]
fn every_line_that_is_none_is_reported_at_its_place() {
    let text = "\
falut 1 over_current
explode
fault 4 over_current
fault 1 over_curent
fault 1 banana
fault 1
fault 1 over_current for
fault 1 over_current for 3
fault 1 over_current for ever
fault 1 over_current now
power
power maybe
power on for 1 s
delay 1 sleep 1 s
delay ready
jump far
jump 2000000
jump
resolution 0
rated_torque 1 -3
gear 10
gear 0:1
at 1 s gear 10:1
at fault 1 over_current
at 1 s
help
warning 1
99999 fault
silence 70000
";
    let found = Script::parse(text, "events.txt", &names()).unwrap_err();
    assert_eq!(found.list().len(), text.lines().count());
    insta::assert_snapshot!(found.to_string());
}

#[test]
fn a_typed_line_is_answered() {
    let parse = |line| Order::parse(line, &names());
    assert!(parse("  # nothing").is_none());
    let fault = Event { drive: Some(1), change: Change::Fault(FaultCause::OVER_CURRENT), lasts: None };
    assert_eq!(parse("fault 1 over_current\n").unwrap().unwrap(), Order::Event(fault));
    assert_eq!(parse("help").unwrap().unwrap(), Order::Help);
    assert_eq!(parse("status").unwrap().unwrap(), Order::Status);
    let answers = ["gear 10:1", "at 1 s power off", "hlep"];
    let answers = answers.map(|line| parse(line).unwrap().unwrap_err().to_string());
    insta::assert_snapshot!(answers.join("\n\n"));
    insta::assert_snapshot!("help", help());
}

/// Plays a script on drives for so many milliseconds, and returns what was said.
fn play<D: SimulatedDrives>(
    drives: &mut D,
    names: Names,
    text: &str,
    time: i64,
    mut pass: impl FnMut(&mut D, MonotonicTime),
) -> Vec<String> {
    let script = Script::parse(text, "events.txt", &names).unwrap_or_else(|findings| panic!("{findings}"));
    let mut player = Player::new(names, script, MonotonicTime::ZERO);
    let mut said = Vec::new();
    for now in 0..=time {
        pass(drives, millis(now));
        player.poll(millis(now), drives, &mut |text| said.push(format!("{now} ms {text}")));
    }
    said
}

/// Changes that were carried out, and nothing else.
#[derive(Default)]
struct Recorder(Vec<(u16, Change)>);

impl SimulatedDrives for Recorder {
    type State = u16;

    fn state(&self, drive: u16) -> Option<u16> {
        Some(drive)
    }

    fn apply(&mut self, drive: u16, change: Change) -> Result<(), &'static str> {
        self.0.push((drive, change));
        if change == Change::Warning(None) { Err("it has none") } else { Ok(()) }
    }
}

#[test]
fn events_begin_and_end_in_their_time_and_the_last_word_counts() {
    let text = "\
at 10 ms silence 1 for 20 ms
at 20 ms silence 1 for 20 ms
at 50 ms freeze 2 for 30 ms
at 60 ms freeze 2 off
at 70 ms fault 3 brake for 5 ms
at 72 ms clear 3
at 80 ms power off for 1 ms
at 90 ms warning 1 off
";
    let mut recorder = Recorder::default();
    let said = play(&mut recorder, names(), text, 100, |_, _| {});
    insta::assert_snapshot!(said.join("\n"));
    let of = |drive| recorder.0.iter().filter(move |(to, _)| *to == drive).map(|(_, change)| *change);
    assert_eq!(of(1).filter(|change| *change == Change::Silence(false)).count(), 1);
    assert_eq!(of(2).filter(|change| *change == Change::Freeze(false)).count(), 1);
    assert_eq!(of(3).filter(|change| matches!(change, Change::Clear(_))).count(), 1);
}

fn sercos(setup: &Setup) -> DriveLine {
    DriveLine::new([(1, UnitKind::Rotary), (2, UnitKind::Linear)], false, &LineKind::Plain, setup).unwrap()
}

#[test]
fn every_event_changes_a_sercos_drive() {
    let names = Names { what: "drive", numbers: 1..=2 };
    let mut line = sercos(&Setup::default());
    let text = "\
at 500 ms fault 1 over_current for 200 ms
at 500 ms warning 2 under_voltage for 100 ms
at 1 s power 2 off for 500 ms
at 2 s freeze 2
at 2 s jump 2.5
at 2.1 s freeze off
at 3 s silence 1 for 1 s
delay 2 torque 700 ms
delay 2 brake 80 ms
delay 2 ready 900 ms
";
    let mut seen = Vec::new();
    let said = play(&mut line, names, text, 5_000, |line, now| {
        let network = line.network_mut();
        network.handle_time(now);
        let drives: Vec<_> = network.slaves().iter().map(|slave| slave.application()).collect();
        let position = drives.iter().map(|drive| drive.actual().position.0 / 1_000_000);
        seen.push((
            drives[0].diagnosis().errors,
            drives[1].diagnosis().warnings,
            position.collect::<Vec<_>>(),
        ));
    });
    insta::assert_snapshot!(said.join("\n"));
    let at = |time: usize| &seen[time];
    const OVER_CURRENT: u16 = 1 << 7;
    const UNDER_VOLTAGE: u16 = 1 << 9;
    assert_eq!((at(490).0, at(520).0, at(4_000).0), (0, OVER_CURRENT, OVER_CURRENT));
    assert_eq!((at(490).1, at(520).1, at(650).1), (0, UNDER_VOLTAGE, 0));
    assert_eq!(at(2_050).2, [2_500, 0], "the frozen drive shows no jump");
    assert_eq!(at(2_200).2, [2_500, 2_500]);
    let servo = *line.network_mut().slaves()[1].application().servo().parameters();
    let times = [servo.power_up_time, servo.starting_time, servo.brake_time];
    assert_eq!(times, [900, 700, 80].map(DurationNs::from_millis));
}

#[test]
fn a_silent_sercos_drive_stays_in_its_phase_and_writes_nothing() {
    // A drive is still heard behind one that is silent.
    let mut written = Vec::new();
    for silent in [&[][..], &[1], &[1, 2]] {
        let mut line = sercos(&Setup::default());
        for drive in silent {
            line.apply(*drive, Change::Silence(true)).unwrap();
        }
        let mut master = Master::new(MasterConfig::new(SIMULATED_MAC, 2_000_000)).unwrap();
        master.set_target_phase(Phase::CP0);
        let (mut came_back, mut changed) = (0, 0);
        for now in (0..1_000).map(millis) {
            while let Some(Output::Transmit { frame, .. }) = master.poll(now) {
                let mut bytes = frame.to_vec();
                let at = Header::parse(&bytes).is_ok_and(|header| header.telegram.kind() == Kind::At);
                let back = line.network_mut().round_trip(now, &mut bytes);
                came_back += i32::from(back);
                changed += i32::from(at && bytes != *frame);
            }
        }
        assert!(came_back > 400, "{came_back} telegrams came back");
        let phases = line.network_mut().slaves().iter().map(|slave| slave.state());
        assert_eq!(phases.collect::<Vec<_>>(), [State::In(Phase::CP0); 2]);
        written.push(changed > 0);
    }
    assert_eq!(written, [true, true, false]);
}

fn can(setup: &Setup) -> Actor<DriveNode> {
    Actor::new(can_drive::drive_with(NodeId::new(5).ok(), 5, 2, setup).unwrap())
}

#[test]
fn every_event_changes_a_can_drive() {
    let names = Names { what: "axis", numbers: 1..=2 };
    let mut drive = can(&Setup::default());
    let text = "\
at 500 ms fault 1 over_current for 200 ms
at 500 ms warning 2 under_voltage for 100 ms
at 1 s power 2 off for 500 ms
at 2 s freeze 2
at 2 s jump 2.5
at 2.1 s freeze off
at 3 s silence 1 for 1 s
at 4.7 s home_switch 2 2 3
at 4.8 s registration_1 2 on
at 4.9 s limit_switches 2 -1 1
delay 2 torque 700 ms
delay 2 brake 80 ms
delay 2 ready 900 ms
";
    let start = Frame::new(Id::Standard(0), &[1, 0]).unwrap();
    let (mut frames, mut seen) = (Vec::new(), Vec::new());
    let said = play(&mut drive, names, text, 5_000, |drive, now| {
        // The device is started while it is silent, and again afterwards.
        if [millis(3_500), millis(4_500)].contains(&now) {
            drive.handle_frame(now, &start);
        }
        drive.handle_time(now);
        while let Some(frame) = drive.poll(now) {
            frames.push((now.0 / 1_000_000, frame));
        }
        let node = drive.node();
        let number = |index| node.dictionary().number(index, 0);
        let other = index::AXIS_OFFSET;
        let positions = [index::POSITION_ACTUAL, index::POSITION_ACTUAL + other].map(number);
        let status = number(index::STATUSWORD + other);
        let inputs = number(0x60FD + other) & 7;
        seen.push((status & 1 << 7 != 0, status & 1 << 4 != 0, positions, DriveNode::state(node), inputs));
    });
    insta::assert_snapshot!(said.join("\n"));
    let emergencies = frames.iter().filter(|(_, frame)| frame.id() == Id::Standard(0x85));
    let codes: Vec<_> = emergencies.map(|(at, frame)| (*at, &frame.data()[..2])).collect();
    assert_eq!(codes, [(501, &[0x10, 0x23][..])], "over current is 2310h");
    let at = |time: usize| seen[time];
    assert_eq!([490, 520, 650].map(|time| at(time).0), [false, true, false], "warning");
    assert_eq!([990, 1_400, 2_800].map(|time| at(time).1), [true, false, true], "voltage enabled");
    let jump = at(2_050).2[0];
    assert!(jump > 0);
    assert_eq!((at(1_990).2, at(2_050).2, at(2_200).2), ([0, 0], [jump, 0], [jump, jump]));
    // The axis stands at 2.5: in the home switch, and beyond the upper limit switch.
    assert_eq!([4_690, 4_790, 4_990].map(|time| at(time).4), [0, 4, 6], "inputs");
    let states = [3_600, 4_600].map(|time| at(time).3);
    assert_eq!(states, [NmtState::PRE_OPERATIONAL, NmtState::OPERATIONAL]);
    let servo = *drive.node().application().axes()[1].servo().parameters();
    let times = [servo.power_up_time, servo.starting_time, servo.brake_time];
    assert_eq!(times, [900, 700, 80].map(DurationNs::from_millis));
}

fn devicenet(kind: &DevicenetKind, setup: &Setup) -> Result<Actor<DevicenetNode>, String> {
    let mac = MacId::new(9).unwrap();
    devicenet_drive::node_with(mac, DataRate::Rate500, kind, setup).map(Actor::new)
}

fn kinds() -> [DevicenetKind; 2] {
    let modes = vec![OperatingMode::Position];
    [
        DevicenetKind::Motion { modes, resolution: 1_000 },
        DevicenetKind::Speed { assembly: Assembly(21), scale: 0 },
    ]
}

#[test]
fn every_event_changes_a_devicenet_drive() {
    let text = "\
at 3 s power off for 500 ms
at 4 s fault 9 over_current for 200 ms
at 5 s warning 9 under_voltage for 100 ms
at 7 s freeze
at 7 s jump 2.5
at 7.1 s freeze off
at 8 s silence for 500 ms
delay torque 700 ms
";
    for kind in kinds() {
        let names = Names { what: "MAC ID", numbers: 9..=9 };
        let mut drive = devicenet(&kind, &Setup::default()).unwrap();
        drive.start(MonotonicTime::ZERO);
        // Another node asks whether the MAC ID is free.
        let check = Frame::new(Id::Standard(0x44F), &[0, 1, 0, 2, 0, 0, 0]).unwrap();
        let (mut answers, mut seen) = (Vec::new(), Vec::new());
        let said = play(&mut drive, names, text, 9_000, |drive, now| {
            if [millis(3_900), millis(8_100), millis(8_600)].contains(&now) {
                drive.handle_frame(now, &check);
            }
            drive.handle_time(now);
            while let Some(frame) = drive.poll(now) {
                answers.push((now.0 / 1_000_000, frame.id()));
            }
            let actual = drive.node().actual();
            seen.push((actual.position.0 / 1_000_000, actual.report));
        });
        let title = if matches!(kind, DevicenetKind::Motion { .. }) { "motion" } else { "speed" };
        insta::assert_snapshot!(format!("devicenet_{title}"), said.join("\n"));
        assert_eq!([6_990, 7_050, 7_200].map(|time| seen[time].0), [0, 0, 2_500]);
        let reports = [2_990, 3_400, 3_900, 4_100].map(|time| seen[time].1);
        assert_eq!(reports, [Report::Ready, Report::AwaitingPower, Report::Ready, Report::Faulted]);
        let times = answers.iter().filter(|(at, _)| *at >= 3_000).map(|(at, _)| *at);
        assert_eq!(times.collect::<Vec<_>>(), [3_900, 8_600], "nothing is answered in silence");
        let node = drive.node_mut();
        let servo = *ActingNode::servo_mut(node, 9).unwrap().parameters();
        assert_eq!(servo.starting_time, DurationNs::from_millis(700));
    }
}

#[test]
fn drives_have_the_encoder_the_torque_and_the_gear_of_the_script() {
    let mut setup = Setup::default();
    setup.set(None, Property::Resolution(4_096));
    setup.set(Some(2), Property::RatedTorque(TorqueAbsolute(7_000_000)));
    setup.set(Some(1), Property::Gear(10, 3));

    let mut line = sercos(&setup);
    let slaves = line.network_mut().slaves();
    let gear = |slave: usize, idn| slaves[slave].store().number_of(idn);
    assert_eq!([0, 1].map(|slave| gear(slave, Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR)), [10, 1]);
    assert_eq!([0, 1].map(|slave| gear(slave, Idn::OUTPUT_REVOLUTIONS_OF_LOAD_GEAR)), [3, 1]);
    let servo = slaves[1].application().servo().parameters();
    assert_eq!((servo.encoder_counts, servo.rated_torque.0), (4_096, 7_000_000));

    let mut drive = can(&setup);
    drive.start(MonotonicTime::ZERO);
    (0..200).for_each(|now| drive.handle_time(millis(now)));
    // A reset of the node keeps them.
    let reset = Frame::new(Id::Standard(0), &[0x81, 0]).unwrap();
    drive.handle_frame(millis(200), &reset);
    (200..400).for_each(|now| drive.handle_time(millis(now)));
    let dictionary = drive.node().dictionary();
    let part = |index, sub| dictionary.number(index, sub);
    assert_eq!([1, 2].map(|sub| part(index::GEAR_RATIO, sub)), [10, 3]);
    assert_eq!([1, 2].map(|sub| part(index::GEAR_RATIO + index::AXIS_OFFSET, sub)), [1, 1]);
    assert_eq!(part(index::ENCODER_RESOLUTION, 1), 4_096);
    assert_eq!(part(index::RATED_TORQUE + index::AXIS_OFFSET, 0), 7_000, "mNm");

    let mut setup = Setup::default();
    setup.set(None, Property::Resolution(4_096));
    for kind in kinds() {
        let mut drive = devicenet(&kind, &setup).unwrap();
        assert_eq!(ActingNode::servo_mut(drive.node_mut(), 9).unwrap().parameters().encoder_counts, 4_096);
    }
    setup.set(None, Property::Gear(2, 1));
    let error = devicenet(&kinds()[0], &setup).unwrap_err();
    assert_eq!(error, "MAC ID 9: expected no `gear`: drives on DeviceNet have no object for one");
}

#[test]
fn every_cause_faults_a_drive() {
    let mut servo = Servo::new(ServoParameters::default()).unwrap();
    for (cause, name) in FaultCause::NAMED {
        assert!(Change::Fault(*cause).apply_to(&mut servo));
        assert_eq!(servo.step(1, &ServoCommand::default()).fault, Some(*cause), "{name}");
        assert!(Change::Clear(None).apply_to(&mut servo));
        let reset = ServoCommand { reset_fault: true, ..ServoCommand::default() };
        assert_eq!(servo.step(1, &reset).fault, None, "{name}");
        servo.step(1, &ServoCommand::default());
    }
}

#[test]
fn a_drive_shows_where_it_is_and_what_is_wrong() {
    let shown = Shown {
        link: NmtState::OPERATIONAL,
        state: Report::Faulted,
        fault: Some(FaultCause::OVER_CURRENT),
        warning: Some(FaultCause::MOTOR_OVERLOAD),
        silent: true,
    };
    assert_eq!(shown.to_string(), "operational, faulted, fault over_current, warning motor_overload, silent");
}
