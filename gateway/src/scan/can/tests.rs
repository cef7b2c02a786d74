//! Scans of simulated drives in virtual time.

use arrayvec::ArrayVec;
use profile_cia402::lss::slave::{Slave, SlaveConfig, SlaveState};
use profile_cia402::node::drive::{Device, identity};
use profile_cia402::node::{self, Identity, Node};
use profile_cia402::wire::lss::{FASTSCAN_CONFIRM, LssMode, LssRequest};
use profile_cia402::wire::nmt::NmtState;
use profile_generic::can::bus as wire;
use profile_generic::can::timing::BitRate;
use profile_generic::servo::ServoParameters;

use super::*;
use crate::config::Config;
use crate::simulate::can_bus::InProcessCan;
use crate::simulate::can_drive::{DriveNode, drive};

/// A bus with these devices, which have booted, and the time then. A device has a node-id and so many axes.
fn bus(devices: &[(u8, u8)], unassigned: &[LssAddress]) -> (InProcessCan<DriveNode>, MonotonicTime) {
    let rate = BitRate::classic(500_000).expect("a rate of CAN");
    let node = |number| NodeId::new(number).ok();
    let with = devices.iter().map(|(number, axes)| drive(node(*number), *axes).expect("a drive"));
    let without = unassigned.iter().map(|address| {
        let [vendor, product, revision, serial] = address.0;
        let servos = [ServoParameters::default()];
        let config = node::Config {
            node: None,
            identity: Identity { vendor, product, revision, serial, ..identity(1, 0) },
            boot_time: DurationNs::from_millis(50),
            has_blocks: true,
            has_mapping: true,
        };
        Node::new(&config, Device::new(&servos).expect("a drive"))
    });
    let mut bus = InProcessCan::new(wire::Bus::new(rate), with.chain(without).collect(), None);
    bus.bus_mut().share(cob_id::LSS_RESPONSE);
    let start = MonotonicTime(1_000_000_000);
    bus.advance(start);
    let booted = start + DurationNs::from_millis(200);
    bus.advance(booted);
    (bus, booted)
}

/// Keeps what is sent.
struct Watched<'a> {
    port: &'a mut InProcessCan<DriveNode>,
    sent: Vec<Frame>,
}

impl CanPort for Watched<'_> {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        self.port.receive(now)
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        let sent = self.port.send(now, frame);
        if sent != CanSent::Full {
            self.sent.push(*frame);
        }
        sent
    }
}

/// A scan of a bus that is given up once that is `enough`; what is found, what is sent of LSS, and when it ends.
fn scan_until(
    port: &mut InProcessCan<DriveNode>,
    begin: MonotonicTime,
    mut enough: impl FnMut(&[Frame]) -> bool,
) -> (Bus, Vec<LssRequest>, MonotonicTime) {
    let mut now = begin;
    let mut scanner = Scanner::new();
    let mut port = Watched { port, sent: Vec::new() };
    while !scanner.step(now, &mut port) {
        if enough(&port.sent) {
            scanner.give_up(now, "enough");
        }
        let latest = now + DurationNs::from_millis(5);
        now = scanner.wake_at().map_or(latest, |at| at.clamp(now, latest));
        now = now + DurationNs::from_micros(50);
    }
    port.port.bus_mut().judge();
    let lss = port.sent.iter().filter(|frame| frame.id() == cob_id::LSS_REQUEST);
    let lss = lss.map(|frame| LssRequest::parse(frame.data()).expect("a request")).collect();
    (scanner.finish(), lss, now)
}

/// What is found on a bus with these devices, and how long it takes.
fn scan(devices: &[(u8, u8)]) -> (Bus, DurationNs) {
    let (mut port, begin) = bus(devices, &[]);
    let (found, _, end) = scan_until(&mut port, begin, |_| false);
    (found, end.since(begin))
}

/// The nodes alone.
fn only(nodes: &[Found]) -> Bus {
    Bus { nodes: nodes.to_vec(), ..Bus::default() }
}

/// One with the highest numbers, and two that are told apart by the last one.
const UNASSIGNED: [LssAddress; 3] = [
    LssAddress([0x319, 0x0002_0192, 0x0001_0000, 7]),
    LssAddress([0x319, 0x0002_0192, 0x0001_0000, 0x8000_0001]),
    LssAddress([u32::MAX; 4]),
];

const ANYBODY: LssRequest = LssRequest::Fastscan { number: 0, bit_check: FASTSCAN_CONFIRM, sub: 0, next: 0 };
const ALL_WAIT: LssRequest = LssRequest::SwitchGlobal(LssMode::WAITING);

#[test]
fn drives_tell_who_they_are_and_the_rest_is_asked_in_vain() {
    let (bus, took) = scan(&[(9, 1), (127, 1), (3, 2)]);
    let found = &bus.nodes;
    let nodes: Vec<_> = found.iter().map(|device| device.node.get()).collect();
    assert_eq!(nodes, [3, 9, 127]);
    assert_eq!(found[1].number(DEVICE_TYPE), Some(0x0002_0192));
    assert_eq!(found[1].number(IDENTITY[3]), Some(9), "the serial number");
    assert_eq!(found[0].axes().count(), 2);
    assert_eq!(found[2].axes().count(), 1);
    // 124 who are not there, eight at a time.
    assert!(took < DurationNs::from_millis(3_600), "{took}");
    insta::assert_snapshot!(text(&only(&found[..2])));
    insta::assert_snapshot!(format!("{:#}", json(&only(&found[1..2]))));
}

/// A number takes a question and an answer, and texts come in segments: blocks are for more, and not every stack knows them.
#[test]
fn devices_are_asked_without_blocks() {
    let (mut port, begin) = bus(&[(9, 1)], &[]);
    let mut commands = Vec::new();
    let (found, ..) = scan_until(&mut port, begin, |sent| {
        let asked = sent.iter().filter(|frame| frame.id() == Id::Standard(0x609));
        commands = asked.map(|frame| (frame.data()[0] >> 5, frame.data()[1..4].to_vec())).collect();
        false
    });
    assert_eq!(found.nodes.len(), 1);
    // 2 asks for a value, 3 for a segment of it; 5 would ask for blocks.
    assert!(commands.iter().all(|(command, _)| matches!(command, 2 | 3)), "{commands:?}");
    let of = |object: [u8; 3]| {
        commands.iter().filter(|(command, about)| *command == 2 && *about == object).count()
    };
    let after = |object: [u8; 3]| {
        let place = commands.iter().position(|(command, about)| *command == 2 && *about == object).unwrap();
        commands[place + 1..].iter().take_while(|(command, _)| *command == 3).count()
    };
    assert_eq!((of([0x00, 0x10, 0]), after([0x00, 0x10, 0])), (1, 0), "1000 in one answer");
    assert!(after([0x08, 0x10, 0]) > 1, "the name in segments");
}

#[test]
fn nobody_is_nobody() {
    // Not even somebody who acknowledges: the first frames stay in the queue.
    let (found, took) = scan(&[]);
    assert!(took < DurationNs::from_secs(6), "{took}");
    assert_eq!(found.findings, ["no station of the bus acknowledges what is sent"]);
    assert_eq!(starter(&found, "can0", None), None);
    assert_eq!(hints(&found), "");
}

#[test]
fn the_configuration_is_one_that_the_box_takes() {
    let (found, _) = scan(&[(3, 2), (127, 1)]);
    let text = starter(&found, "can0", Some(500_000)).expect("there are drives");
    let config = Config::parse(&text, "box.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    let bus = &config.can[0];
    let drives: Vec<_> = bus.drives.iter().map(|drive| (drive.node.get(), drive.axis)).collect();
    assert_eq!(drives, [(3, 0), (3, 1), (127, 0)]);
    assert_eq!((bus.bit_rate.nominal(), bus.node.get()), (500_000, 126));
    assert_eq!(config.axes.len(), 3);
    insta::assert_snapshot!(text);
}

#[test]
fn devices_without_a_node_id_are_found_one_by_one_and_left_as_they_were() {
    let order = [UNASSIGNED[2], UNASSIGNED[0], UNASSIGNED[1]];
    let (mut port, mut now) = bus(&[(3, 1)], &order);
    // The second scan finds them only if the first has left them waiting, and without a node-id.
    for _ in 0..2 {
        let (found, sent, end) = scan_until(&mut port, now, |_| false);
        assert_eq!(found.nodes.iter().map(|device| device.node.get()).collect::<Vec<_>>(), [3]);
        assert_eq!(found.unassigned, UNASSIGNED);
        assert_eq!(found.findings, [""; 0]);
        assert!(end.since(now) < DurationNs::from_secs(12), "{}", end.since(now));
        let (last, questions) = sent.split_last().expect("requests");
        assert_eq!(*last, ALL_WAIT);
        assert!(questions.iter().all(|request| matches!(request, LssRequest::Fastscan { .. })));
        // 133 questions a device, and whether there is another one.
        assert_eq!(questions.len(), 3 * 133 + 1);
        let nodes: Vec<_> = port.nodes().map(|node| node.node().map(NodeId::get)).collect();
        assert_eq!(nodes, [Some(3), None, None, None]);
        assert_eq!(port.nodes().next().expect("a node").state(), NmtState::PRE_OPERATIONAL);
        now = end;
    }
}

#[test]
fn where_all_have_a_node_id_one_question_is_all_that_is_sent_by_lss() {
    let (mut port, begin) = bus(&[(3, 1), (9, 1)], &[]);
    let (found, sent, _) = scan_until(&mut port, begin, |_| false);
    assert_eq!((found.nodes.len(), found.unassigned.len()), (2, 0));
    assert_eq!(sent, [ANYBODY]);
}

#[test]
fn a_scan_that_is_given_up_leaves_all_devices_waiting() {
    let (mut port, begin) = bus(&[], &UNASSIGNED);
    // The first is found, the second half.
    let half =
        |sent: &[Frame]| sent.iter().filter(|frame| frame.id() == cob_id::LSS_REQUEST).count() > 133 + 60;
    let (found, sent, end) = scan_until(&mut port, begin, half);
    assert_eq!(found.unassigned, UNASSIGNED[..1]);
    assert_eq!(found.findings, ["enough"]);
    assert_eq!((sent.len(), sent.last()), (133 + 62, Some(&ALL_WAIT)));
    let (found, _, _) = scan_until(&mut port, end, |_| false);
    assert_eq!(found.unassigned, UNASSIGNED);
}

/// A search among these devices alone, each question of which comes so late; what is found, what is odd, how long it takes.
/// Forgetful devices wait again as soon as they are found.
fn search(
    addresses: &[LssAddress],
    late: DurationNs,
    forgetful: bool,
) -> (Vec<LssAddress>, Vec<String>, DurationNs) {
    let config =
        |&address| SlaveConfig { address, node: None, bit_timings: ArrayVec::new(), storable: false };
    let mut slaves: Vec<_> = addresses.iter().map(|address| Slave::new(config(address))).collect();
    let begin = MonotonicTime(1_000_000_000);
    let (mut now, mut search) = (begin, Search::new());
    while !search.run(now) {
        while let Some(request) = search.poll(now) {
            for slave in &mut slaves {
                slave.handle(request.data()).expect("a request");
                if let Some(answer) = slave.poll() {
                    search.handle(now, &answer);
                }
                if forgetful && slave.state() == SlaveState::Configuration {
                    slave.reset();
                }
            }
        }
        now = search.wake_at().map_or(now, |at| at.max(now) + late);
    }
    assert!(slaves.iter().all(|slave| slave.state() == SlaveState::Waiting && slave.node().is_none()));
    let (found, findings) = search.finish();
    (found, findings, now.since(begin))
}

#[test]
fn a_search_that_cannot_find_all_says_so_and_leaves_all_devices_waiting() {
    let addresses: Vec<_> = (1..=17).map(|serial| LssAddress([1, 2, 3, serial])).collect();
    let told = |why: &str| vec![format!("there may be more devices without a node-id: {why}")];
    let (found, findings, took) = search(&addresses, DurationNs::ZERO, false);
    assert_eq!((found.as_slice(), findings), (&addresses[..16], told("16 are looked for at most")));
    assert!(took < DurationNs::from_secs(45), "{took}");
    // On a bus that is so busy.
    let (found, findings, took) = search(&addresses, DurationNs::from_millis(180), false);
    assert_eq!((found.as_slice(), findings), (&addresses[..2], told("not done in time")));
    assert!(took < DurationNs::from_secs(61), "{took}");
    let (found, findings, _) = search(&addresses[..1], DurationNs::ZERO, true);
    let again = "the device with vendor 00000001 product 00000002 revision 00000003 serial 00000001 answers again once it is found";
    assert_eq!((found.as_slice(), findings), (&addresses[..1], told(again)));
}

#[test]
fn devices_without_a_node_id_are_told_and_hinted_at() {
    let (mut port, begin) = bus(&[(1, 1)], &UNASSIGNED[1..2]);
    let (found, _, _) = scan_until(&mut port, begin, |_| false);
    insta::assert_snapshot!(text(&found));
    insta::assert_snapshot!(format!("{:#}", json(&found)));
    let hints = hints(&found);
    insta::assert_snapshot!(hints);
    let mut whole = starter(&found, "can0", Some(500_000)).expect("there is a drive");
    assert!(whole.lines().any(|line| line == "node = 1"), "{whole}");
    // As it is printed, and then with the hint taken, as if for the drive that is there.
    whole.push_str(&hints);
    let config =
        |text: &str| Config::parse(text, "box.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(config(&whole).can[0].devices.len(), 0);
    let taken = whole.replace("# [[", "[[").replace("# node = 2", "node = 1");
    let taken = taken.replace("# identity", "identity").replace("# lss", "lss");
    let devices = &config(&taken).can[0].devices;
    let [device] = devices.as_slice() else { panic!("{taken}") };
    assert_eq!(device.node.get(), 1);
    assert_eq!(device.lss.expect("LSS").address, UNASSIGNED[1]);
}

#[test]
fn a_bus_that_a_master_leads_is_left_alone() {
    for number in [0x080, 0x000, 0x201] {
        let (mut port, mut now) = bus(&[(3, 1)], &[]);
        let other = port.bus_mut().add(8).expect("room");
        let mut port = Watched { port: &mut port, sent: Vec::new() };
        let mut scanner = Scanner::new();
        assert!(!scanner.step(now, &mut port));
        now = now + DurationNs::from_millis(900);
        let frame = Frame::new(Id::Standard(number), &[0; 2]).expect("a frame");
        port.port.bus_mut().send(now, other, &frame).expect("room");
        let mut over = false;
        for _ in 0..10 {
            now = now + DurationNs::from_millis(1);
            over |= !over && scanner.step(now, &mut port);
        }
        assert!(over && port.sent.is_empty(), "{:?}", port.sent);
        let found = scanner.finish();
        let text = format!("another master is on this bus: it sends {}; nothing was asked", frame.id());
        assert_eq!((found.nodes.len(), found.findings), (0, vec![text]));
    }
}

/// An interface that goes off the bus once it was asked for the next frame so often.
struct Broken<'a> {
    port: &'a mut InProcessCan<DriveNode>,
    left: u32,
}

impl CanPort for Broken<'_> {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        let frame = self.port.receive(now)?;
        if self.left == 0 {
            return Some(CanInput::BusOff);
        }
        self.left -= 1;
        Some(frame)
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        self.port.send(now, frame)
    }
}

#[test]
fn a_scan_that_breaks_off_says_so() {
    let (mut port, mut now) = bus(&[(3, 1), (9, 1)], &[]);
    let mut broken = Broken { port: &mut port, left: 20 };
    let mut scanner = Scanner::new();
    while !scanner.step(now, &mut broken) {
        now = now + DurationNs::from_micros(500);
    }
    let found = scanner.finish();
    assert!(!found.nodes.is_empty() || broken.left == 0);
    assert_eq!(found.findings, ["the interface is off the bus"]);
    assert!(text(&found).contains("the interface is off the bus"));
}
