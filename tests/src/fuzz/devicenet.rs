//! DeviceNet: frames, slaves and the master.

use std::sync::LazyLock;

use axisbridge::config::Config;
use axisbridge::engine::build::devicenet as build;
use axisbridge::simulate::can_bus::CanNode;
use axisbridge::simulate::devicenet_drive::{self, DevicenetNode};
use profile_cip::devicenet::connection::ConnectionKind;
use profile_cip::devicenet::link::accept;
use profile_cip::devicenet::master::Master;
use profile_cip::devicenet::master::event::Event;
use profile_cip::devicenet::master::station::Phase;
use profile_cip::devicenet::wire::allocation::Allocate;
use profile_cip::devicenet::wire::duplicate_mac::DuplicateMac;
use profile_cip::devicenet::wire::explicit::{Header, Request, Response};
use profile_cip::devicenet::wire::fragment::Fragment;
use profile_cip::devicenet::wire::speed::{Assembly, SpeedActual, SpeedCommand};
use profile_cip::devicenet::wire::{BodyFormat, Identifier};
use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::conversation::{BURST_MAX, Bytes, Disturber};
use super::{assert_printed, printed_again, same_again};

const START: MonotonicTime = MonotonicTime(1_000_000_000);
const MILLISECOND: DurationNs = DurationNs::from_millis(1);

/// Every kind of frame: two bytes of identifier, then what is in it.
pub fn wire(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    if let Ok(identifier) = Identifier::parse(bytes.word()) {
        assert_eq!(Identifier::parse(identifier.bits()), Ok(identifier));
        assert_printed(&identifier.to_string(), 2);
        assert!(identifier.group() >= 1 && !identifier.name().is_empty());
    }
    let byte = bytes.byte();
    assert_eq!(Header::parse(byte).byte(), byte);
    assert_eq!(Fragment::parse(byte).byte(), byte);
    let body = data.get(2..).unwrap_or_default();
    printed_again!(DuplicateMac, body);
    same_again!(Allocate, body);
    printed_again!(Response, body);
    for format in
        [BodyFormat::CLASS_8_INSTANCE_8, BodyFormat(1), BodyFormat(2), BodyFormat(3), BodyFormat(byte)]
    {
        if let Ok(request) = Request::parse(format, body) {
            let mut again = vec![0xA5; request.buffer_len(format)];
            assert_eq!(request.emit(format, &mut again), Ok(again.len()), "{request:?}");
            assert_eq!(Request::parse(format, &again), Ok(request));
            assert_printed(&request.to_string(), body.len());
        }
    }
    for assembly in [20, 21, 22, 23, 70, 71, 72, 73, byte].map(Assembly) {
        let mut again = vec![0xA5; assembly.buffer_len()];
        if let Ok(command) = SpeedCommand::parse(assembly, body) {
            assert_eq!(command.emit(assembly, &mut again), Ok(again.len()));
            assert_eq!(SpeedCommand::parse(assembly, &again), Ok(command));
            assert_printed(&command.to_string(), body.len());
        }
        if let Ok(actual) = SpeedActual::parse(assembly, body) {
            assert_eq!(actual.emit(assembly, &mut again), Ok(again.len()));
            assert_eq!(SpeedActual::parse(assembly, &again), Ok(actual));
            assert_printed(&actual.to_string(), body.len());
        }
    }
    if let Some(frame) = Bytes::new(data).frame() {
        let _ = accept(&frame);
    }
}

/// A network of a motion drive (MAC ID 5) and a velocity drive (9).
static CONFIG: LazyLock<Config> = LazyLock::new(|| {
    let text = include_str!("../../../examples/two-axes-devicenet.toml");
    Config::parse(text, "two-axes-devicenet.toml").expect("a sound example")
});

fn drives() -> Vec<DevicenetNode> {
    let network = &CONFIG.devicenet[0];
    let mut drives: Vec<_> =
        network.drives.iter().map(|drive| devicenet_drive::drive(network, drive)).collect();
    drives.iter_mut().for_each(|drive| drive.start(START));
    drives
}

/// Milliseconds that a node needs for the check of its MAC ID, with some to spare.
const CHECK_MS: u64 = 2_100;

fn drain(node: &mut DevicenetNode, now: MonotonicTime) -> Vec<Frame> {
    let sent: Vec<_> = core::iter::from_fn(|| node.poll(now)).take(BURST_MAX).collect();
    assert!(sent.len() < 100, "{} frames at once", sent.len());
    sent
}

/// Two drives fed with frames: a head below 0x8000 is that of a frame, above it so many milliseconds pass (low seven bits of the
/// second byte). Whatever was said, they come to rest when they are off the bus.
pub fn slave(data: &[u8]) {
    let (mut drives, mut bytes, mut now) = (drives(), Bytes::new(data), START);
    let pass = |drives: &mut [DevicenetNode], now: &mut MonotonicTime, milliseconds: u64| {
        *now = *now + MILLISECOND * i64::try_from(milliseconds).unwrap_or(i64::MAX);
        for node in drives {
            node.handle_time(*now);
            drain(node, *now);
        }
    };
    (0..CHECK_MS / 10).for_each(|_| pass(&mut drives, &mut now, 10));
    while !bytes.is_over() {
        let mut ahead = bytes.clone();
        let [_, high] = ahead.array();
        if high & 0x80 == 0 {
            let Some(frame) = bytes.frame() else { continue };
            for node in &mut drives {
                node.handle_frame(now, &frame);
                drain(node, now);
            }
        } else {
            bytes = ahead;
            pass(&mut drives, &mut now, u64::from(high & 0x7F));
        }
    }
    // A watchdog may have been set to never; who is off the bus has no master for sure.
    drives.iter_mut().for_each(|node| node.bus_off(now));
    let silent_since = now;
    while drives.iter().any(|node| node.actual().velocity.get() != 0) {
        pass(&mut drives, &mut now, 10);
        // The longest ramp that can be set takes 66 s.
        let waited = now.since(silent_since);
        assert!(
            waited < DurationNs::from_secs(100),
            "{:?}",
            drives.iter().map(|node| node.actual()).collect::<Vec<_>>()
        );
    }
}

/// A master with good drives whose frames are disturbed for eight seconds at most. Left alone, it exchanges data with both soon.
pub fn master(data: &[u8]) {
    let mut master = Master::new(build::master(&CONFIG, 0)).expect("a possible network");
    let (mut drives, mut now, mut said) = (drives(), START, Disturber::new(data));
    let macs: Vec<_> = CONFIG.devicenet[0].drives.iter().map(|drive| drive.mac).collect();
    master.start(now);
    let (mut calm_since, disturbed_until) = (None, now + DurationNs::from_secs(8));
    loop {
        for _ in 0..BURST_MAX {
            let mut moved = false;
            let mut frames = Vec::new();
            for node in &mut drives {
                node.handle_time(now);
                frames.extend(drain(node, now));
            }
            for frame in frames {
                moved = true;
                let bits = frame.id();
                said.carry_frame(&frame, &mut |frame| {
                    let _ = master.handle_frame(now, frame);
                });
                // The drives hear each other.
                for node in
                    drives.iter_mut().filter(|_| matches!(bits, Id::Standard(id) if id & 0x600 != 0x400))
                {
                    node.handle_frame(now, &frame);
                }
            }
            let mut sent = 0;
            while let Some(frame) = master.poll(now) {
                moved = true;
                sent += 1;
                assert!(sent < BURST_MAX, "the master does not stop sending");
                drives.iter_mut().for_each(|node| node.handle_frame(now, &frame));
            }
            while let Some(event) = master.poll_event() {
                // Somebody has to look who has the master's MAC ID, and to start it again.
                if matches!(event, Event::DuplicateMac { .. }) {
                    master.start(now);
                }
            }
            if !moved {
                break;
            }
        }
        if calm_since.is_none() && (said.is_over() || now >= disturbed_until) {
            said.calm();
            calm_since = Some(now);
        }
        if let Some(since) = calm_since {
            let up = |mac| {
                let fresh = master.consumer(mac, ConnectionKind::Poll).is_some_and(|consumer| consumer.fresh);
                fresh && master.phase(mac) == Some(Phase::Exchange)
            };
            if macs.iter().all(|mac| up(*mac)) {
                break;
            }
            let (waited, phases) =
                (now.since(since), macs.iter().map(|mac| master.phase(*mac)).collect::<Vec<_>>());
            assert!(waited < DurationNs::from_secs(120), "{phases:?}, {waited} after all was well again");
        }
        now = now + MILLISECOND * 2;
    }
    for node in &drives {
        assert_eq!(node.actual().velocity.get(), 0, "nobody has enabled the drives");
    }
}
