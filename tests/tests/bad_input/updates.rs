//! C-to-D updates on the motion connection.

use std::cell::Cell;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::rc::Rc;

use axisbridge_tests::rig::motion::{NANO, at_rest, in_motion, millis};
use axisbridge_tests::rig::ports::Bytes;
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::io_counters::MotionCounters;
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram};
use profile_cip::wire::encapsulation::IO_PORT;
use profile_cip::wire::motion::CommandFrame;
use profile_cip::wire::motion::codes::NodeFault;

/// Length of the data item in a class 1 datagram.
const ITEM_LENGTH: usize = 16;
/// Sequence count of the connection data.
pub const SEQUENCE_COUNT: usize = 18;
/// Format, revision, instance count and first instance behind the class 1 header.
const FORMAT: usize = CLASS1_HEADER_LEN;
const REVISION: usize = FORMAT + 1;
const INSTANCE_COUNT: usize = FORMAT + 4;

/// Where the instances of an update begin in its datagram.
pub fn instances(datagram: &[u8]) -> Vec<usize> {
    let data = Class1Datagram::parse(datagram).expect("the controller's own datagram").data;
    let frame = CommandFrame::parse(data).expect("the controller's own update");
    let mut at = datagram.len() - data.len() + frame.header().buffer_len();
    let mut places = Vec::new();
    for instance in frame.instances() {
        places.push(at);
        at += instance.buffer_len();
    }
    places
}

/// The same datagram with another length of data.
fn resized(datagram: &mut Bytes, data: usize) {
    let mut bytes = datagram.as_slice().to_vec();
    bytes.resize(CLASS1_HEADER_LEN + data, 0);
    let length = u16::try_from(data + 2).expect("a datagram");
    bytes[ITEM_LENGTH..ITEM_LENGTH + 2].copy_from_slice(&length.to_le_bytes());
    *datagram = Bytes::of(&bytes);
}

/// A rig in motion in which the next datagram of the controller is changed by `spoil`.
fn spoiled(spoil: impl Fn(&mut Bytes) + 'static) -> Rig {
    let mut rig = in_motion(Settings::default());
    let done = Rc::new(Cell::new(false));
    let once = Rc::clone(&done);
    rig.tamper_command = Some(Box::new(move |datagram| {
        if !once.replace(true) {
            spoil(datagram);
        }
        true
    }));
    rig.run_until(millis(20), "the spoiled update", |_| done.get());
    rig
}

type Spoil = fn(&mut Bytes);
type Counter = fn(&MotionCounters) -> u64;

#[test]
fn a_wrong_update_is_node_fault_4_and_stops_every_axis_of_the_device() {
    let malformed: Counter = |counters| counters.malformed;
    let cases: [(&str, Spoil, Counter); 10] = [
        ("format of the other direction", |d| d.as_mut_slice()[FORMAT] = 7, malformed),
        ("format unknown", |d| d.as_mut_slice()[FORMAT] = 0xFF, malformed),
        ("revision", |d| d.as_mut_slice()[REVISION] = 3, malformed),
        ("more instances than there are", |d| d.as_mut_slice()[INSTANCE_COUNT] += 1, malformed),
        (
            "size of a block",
            |d| {
                let at = instances(d.as_slice())[0];
                d.as_mut_slice()[at + 2] += 1;
            },
            malformed,
        ),
        (
            "instances out of sequence",
            |d| {
                let places = instances(d.as_slice());
                let bytes = d.as_mut_slice();
                bytes.swap(places[0], places[1]);
            },
            malformed,
        ),
        (
            "a gap in the instances",
            |d| {
                let at = instances(d.as_slice())[1];
                d.as_mut_slice()[at] = 9;
            },
            malformed,
        ),
        ("cut off", |d| resized(d, d.as_slice().len() - CLASS1_HEADER_LEN - 4), malformed),
        ("longer than the connection", |d| resized(d, 600), |counters| counters.oversize),
        (
            "position that is no number",
            |d| {
                let at = instances(d.as_slice())[0] + 16;
                d.as_mut_slice()[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
            },
            |counters| counters.not_finite,
        ),
    ];
    for (name, spoil, counter) in cases {
        let mut rig = spoiled(spoil);
        let from = [rig.position(0), rig.position(1)];
        let mut fastest = [0, 0];
        let rest = rig.run_until(millis(1_000), "rest", |rig| {
            fastest = [0, 1].map(|place| fastest[place].max(rig.velocity(place)));
            at_rest(rig)
        });
        assert!(rest < millis(100), "{name}: {rest}");
        assert!(fastest[0] < 51 * NANO / 10 && fastest[1] < 205 * NANO, "{name}: {fastest:?}");
        let way = [0, 1].map(|place| rig.position(place) - from[place]);
        assert!((0..NANO / 5).contains(&way[0]) && (0..10 * NANO).contains(&way[1]), "{name}: {way:?}");
        let report = rig.run(millis(20_000));
        assert_eq!(report.node_fault, Some(NodeFault::DATA_FORMAT), "{name}");
        assert!(report.failure.is_some(), "{name}");
        let counters = *rig.engine.devices()[0].device().counters();
        assert_eq!(counter(&counters), 1, "{name}: {counters:?}");
        let refused = counters.malformed + counters.oversize + counters.not_finite;
        assert_eq!((refused, counters.unknown_instance), (1, 0), "{name}: {counters:?}");
        for axis in 0..2 {
            assert!(rig.axis_states(axis).contains(&AxisState::MajorFaulted), "{name}");
        }
        assert!(rig.torque_free(), "{name}");
    }
}

#[test]
fn an_update_for_an_axis_that_is_not_there_is_refused_as_a_whole() {
    let mut rig = spoiled(|datagram| {
        // A third axis behind the second one, as like it as can be.
        let last = instances(datagram.as_slice())[1];
        let mut bytes = datagram.as_slice().to_vec();
        bytes.extend_from_within(last..);
        let third = datagram.as_slice().len();
        bytes[third] = 3;
        bytes[INSTANCE_COUNT] = 3;
        let data = bytes.len() - CLASS1_HEADER_LEN;
        *datagram = Bytes::of(&bytes);
        resized(datagram, data);
    });
    let report = rig.run(millis(20_000));
    assert_eq!(report.node_fault, Some(NodeFault::DATA_FORMAT));
    let device = rig.engine.devices()[0].device();
    assert_eq!(device.counters().unknown_instance, 1, "{:?} {:?}", device.counters(), device.last_error());
    assert!(at_rest(&rig) && rig.torque_free());
}

#[test]
fn datagrams_that_are_not_of_the_connection_do_not_touch_the_motion() {
    let mut rig = in_motion(Settings::default());
    let before = rig.engine.devices()[0].counters().refused;
    let seen = Rc::new(Cell::new(None));
    let copy = Rc::clone(&seen);
    rig.tamper_command = Some(Box::new(move |datagram| {
        copy.set(Some(datagram.as_slice().to_vec()));
        true
    }));
    rig.run_for(millis(10));
    rig.tamper_command = None;
    let good: Vec<u8> = seen.take().expect("a datagram of the controller");
    let controller = SocketAddrV4::new(CONTROLLER, IO_PORT);
    let stranger = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 66), IO_PORT);
    let mut foreign = good.clone();
    foreign[6] ^= 0x40;
    let mut lying = good.clone();
    lying[ITEM_LENGTH] ^= 0x10;
    let mut refused = 0;
    let cases: [(&str, &[u8], SocketAddrV4); 6] = [
        ("another address", &good, stranger),
        ("another connection", &foreign, controller),
        ("only a header", &good[..CLASS1_HEADER_LEN - 2], controller),
        ("a length that lies", &lying, controller),
        ("nothing", &[], controller),
        ("noise", &[0xA5; 700], controller),
    ];
    for (name, bytes, from) in cases {
        rig.inject_datagram(bytes, from);
        rig.run_for(millis(6));
        refused += 1;
        assert_eq!(rig.engine.devices()[0].counters().refused - before, refused, "{name}");
    }
    // A datagram of the connection that comes again later, as a replay, is old.
    rig.inject_datagram(&good, controller);
    rig.run_for(millis(6));
    assert_eq!(rig.engine.devices()[0].device().counters().out_of_order, 1);
    let mut renumbered = good.clone();
    let ahead = u16::from_le_bytes([good[SEQUENCE_COUNT], good[SEQUENCE_COUNT + 1]]).wrapping_sub(1);
    renumbered[SEQUENCE_COUNT..SEQUENCE_COUNT + 2].copy_from_slice(&ahead.to_le_bytes());
    rig.inject_datagram(&renumbered, controller);
    rig.run_for(millis(6));
    assert_eq!(rig.engine.devices()[0].device().counters().out_of_order, 2);
    assert!(rig.status().counters.refused_frames >= 6, "the status of the box counts them");
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.steps_finished), (None, 4), "{}", rig.log());
    assert_eq!(report.node_fault, None);
}
