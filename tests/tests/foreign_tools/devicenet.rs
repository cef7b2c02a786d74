//! DeviceNet seen from outside: what tshark makes of our frames, and what a cycle of the master allocates.

use std::path::Path;

use axisbridge::capture::can_bus::{CanBuses, CanProtocol};
use axisbridge::capture::reader::Reader;
use axisbridge::decode::{Options, decode};
use profile_cip::device::config::IdentityConfig;
use profile_cip::devicenet::connection::ConnectionKind;
use profile_cip::devicenet::master::Master;
use profile_cip::devicenet::master::config::{DataRate, MasterConfig, SlaveConfig as Planned};
use profile_cip::devicenet::master::event::ExplicitRequest;
use profile_cip::devicenet::master::motion::{MotionEnd, SetPoint, Watched};
use profile_cip::devicenet::master::station::Phase;
use profile_cip::devicenet::slave::motion_drive::{MotionDrive, MotionDriveConfig};
use profile_cip::devicenet::slave::{Slave, SlaveConfig};
use profile_cip::devicenet::wire::{BodyFormat, Header, Identifier, MacId, Request, Response};
use profile_cip::wire::status::{GeneralStatus, Service};
use profile_generic::can::{Frame, Id};
use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::wire::describe::NoNames;

use axisbridge_tests::tshark;

/// SocketCAN frames in a capture file.
const LINKTYPE_CAN_SOCKETCAN: u32 = 227;

const POLL: ConnectionKind = ConnectionKind::Poll;

fn mac(number: u8) -> MacId {
    MacId::new(number).expect("a MAC ID")
}

/// Master 1 and the motion drives 9 and 12, each frame delivered to all others in the order in which it was sent.
struct Net {
    master: Master,
    slaves: Vec<Slave<MotionDrive>>,
    now: MonotonicTime,
    trace: Vec<(MonotonicTime, Frame)>,
}

impl Net {
    fn new() -> Self {
        let mut config =
            MasterConfig::new(mac(1), 0x0456, 77, DataRate::Rate500, DurationNs::from_millis(10));
        config.slaves = [9, 12].map(|number| Planned::polled(mac(number), 16, 16, 10)).to_vec();
        let mut master = Master::new(config).expect("a configuration");
        let now = MonotonicTime(1_000_000);
        master.start(now);
        let slaves = [9, 12].map(|number| {
            let servo = ServoParameters::default();
            let drive = MotionDriveConfig { attributes: Vec::new(), faults: Vec::new(), servo };
            let identity = IdentityConfig {
                vendor: 0x0123,
                device_type: 0x25,
                product_code: 42,
                major: 1,
                minor: 2,
                serial_number: 0xA000_0000 | u32::from(number),
                product_name: arrayvec::ArrayString::from("Axisbridge drive").expect("short"),
                configuration: 0,
            };
            let config = SlaveConfig {
                mac: mac(number),
                rate: 2,
                bus_off_reset: false,
                identity,
                rate_resolution_ms: 1,
                body_format: BodyFormat::CLASS_8_INSTANCE_8,
            };
            let mut slave = Slave::new(config, MotionDrive::new(drive).expect("a drive"));
            slave.start(now);
            slave
        });
        Self { master, slaves: slaves.into(), now, trace: Vec::new() }
    }

    /// One millisecond: everything that is to be said now.
    fn step(&mut self) {
        loop {
            let mut said = false;
            while let Some(frame) = self.master.poll(self.now) {
                said = true;
                self.trace.push((self.now, frame));
                for slave in &mut self.slaves {
                    let _ = slave.handle_frame(self.now, &frame);
                }
            }
            for speaker in 0..self.slaves.len() {
                while let Some(frame) = self.slaves[speaker].poll(self.now) {
                    said = true;
                    self.trace.push((self.now, frame));
                    let _ = self.master.handle_frame(self.now, &frame);
                    for (number, slave) in self.slaves.iter_mut().enumerate() {
                        if number != speaker {
                            let _ = slave.handle_frame(self.now, &frame);
                        }
                    }
                }
            }
            if !said {
                break;
            }
        }
        self.now = self.now + DurationNs::from_millis(1);
    }

    fn command(&mut self, ends: &mut [MotionEnd; 2]) {
        for (number, end) in [9, 12].into_iter().zip(ends) {
            if let Some(consumer) = self.master.consumer(mac(number), POLL)
                && consumer.fresh
            {
                let _ = end.handle(consumer.data);
            }
            if let Some(producer) = self.master.producer(mac(number), POLL) {
                end.emit(producer).expect("16 bytes");
                self.master.commit(mac(number), POLL);
            }
        }
    }

    fn exchange(&mut self) {
        while [9, 12].iter().any(|number| self.master.phase(mac(*number)) != Some(Phase::Exchange)) {
            assert!(self.now.0 < 10_000_000_000, "not in ten seconds");
            self.step();
        }
    }
}

/// A capture file of classic CAN frames: the header of a file, and of each packet, as libpcap has them; the CAN identifier
/// in network order in front of length and data.
fn write(path: &Path, frames: &[(MonotonicTime, Frame)]) {
    let mut file = Vec::new();
    for word in [0xA1B2_C3D4_u32, 4 << 16 | 2, 0, 0, 65_535, LINKTYPE_CAN_SOCKETCAN] {
        file.extend(word.to_le_bytes());
    }
    for (at, frame) in frames {
        let Id::Standard(id) = frame.id() else { panic!("DeviceNet has 11 bits") };
        let mut packet = u32::from(id).to_be_bytes().to_vec();
        packet.extend([u8::try_from(frame.data().len()).expect("8 bytes at most"), 0, 0, 0]);
        packet.extend(frame.data());
        let micros = at.0 / 1000;
        let len = u32::try_from(packet.len()).expect("short");
        let seconds = u32::try_from(micros / 1_000_000).expect("a few");
        let rest = u32::try_from(micros % 1_000_000).expect("below a million");
        for word in [seconds, rest, len, len] {
            file.extend(word.to_le_bytes());
        }
        file.extend(packet);
    }
    std::fs::write(path, file).expect("a file");
}

/// What tshark says of these frames, one by one; `None` without tshark.
fn dissect(name: &str, frames: &[(MonotonicTime, Frame)]) -> Vec<tshark::Frame> {
    let path = std::env::temp_dir().join(format!("axisbridge-devicenet-{name}-{}.pcap", std::process::id()));
    write(&path, frames);
    let dissected = tshark::dissect(&path, "devicenet", &["-d", "can.subdissector,devicenet"]);
    std::fs::remove_file(&path).expect("it was there");
    dissected
}

fn number(frame: &tshark::Frame, field: &str) -> Option<u32> {
    let text = &frame.field(field)?.show;
    match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16).ok(),
        None => text.parse().ok(),
    }
}

/// A whole run of our own: every frame is one of DeviceNet to tshark, of the same message group and MAC ID as to us.
#[test]
fn tshark_reads_identifiers_and_duplicate_mac_checks_of_a_run_as_we_do() {
    let mut net = Net::new();
    net.exchange();
    let start = || MotionEnd::new(SetPoint::Position(0), Watched::Position);
    let mut ends = [start(), start()];
    for step in 0..200 {
        if step % 10 == 0 {
            net.command(&mut ends);
        }
        net.step();
    }
    assert!(ends.iter().all(MotionEnd::is_valid), "the drives answer");
    let dissected = dissect("run", &net.trace);
    assert_eq!(dissected.len(), net.trace.len());
    assert!(net.trace.len() > 200);
    let mut checks = 0;
    for ((_, frame), seen) in net.trace.iter().zip(&dissected) {
        let Id::Standard(bits) = frame.id() else { panic!("{frame}") };
        let identifier = Identifier::parse(bits).expect("ours");
        assert_eq!(number(seen, "devicenet.can_id"), Some(u32::from(bits)), "{frame}");
        let group = identifier.group();
        let message = format!("devicenet.grp_msg{group}.id");
        assert!(seen.field(&message).is_some(), "{frame}: {identifier}");
        let source = identifier.mac().map(|mac| u32::from(mac.get()));
        assert_eq!(number(seen, "devicenet.src_mac_id"), source, "{frame}: {identifier}");
        if matches!(identifier, Identifier::DuplicateMacCheck(_)) {
            checks += 1;
            let serial = number(seen, "devicenet.dup_mac_id.serial_number");
            let vendor = number(seen, "devicenet.dup_mac_id.vendor");
            let expected = match source {
                Some(1) => (0x0456, 77),
                Some(other) => (0x0123, 0xA000_0000 | other),
                None => panic!("a MAC ID"),
            };
            assert_eq!((vendor, serial), (Some(expected.0), Some(expected.1)), "{frame}");
            assert_eq!(number(seen, "devicenet.dup_mac_id.rr"), Some(0));
            assert_eq!(number(seen, "devicenet.dup_mac_id.physical_port_number"), Some(0));
        }
    }
    assert_eq!(checks, 6, "three nodes, twice each");
}

/// What `decode` says of the frames of a run, against tshark as far as that goes, and against what was sent.
#[test]
fn decode_reads_a_run_as_tshark_does_and_puts_its_messages_together() {
    let mut net = Net::new();
    net.exchange();
    let start = || MotionEnd::new(SetPoint::Position(0), Watched::Position);
    let mut ends = [start(), start()];
    for step in 0..100 {
        if step % 10 == 0 {
            net.command(&mut ends);
        }
        net.step();
    }
    let path = std::env::temp_dir().join(format!("axisbridge-devicenet-decode-{}.pcap", std::process::id()));
    write(&path, &net.trace);
    let reader = Reader::open(&path).expect("our own file opens");
    let can = CanBuses::default().with_rest(Some(CanProtocol::Devicenet));
    let mut text = Vec::new();
    let summary =
        decode(reader, &Options { can, ..Options::default() }, &NoNames, &mut text).expect("it is read");
    std::fs::remove_file(&path).expect("it was there");
    assert_eq!(summary.printed, net.trace.len() as u64);
    let text = String::from_utf8(text).expect("text");
    let trees: Vec<&str> = text.split("frame ").skip(1).collect();
    assert_eq!(trees.len(), net.trace.len());
    for bad in ["not readable", "dropped", "not seen", "because it fits", "no identifier"] {
        assert!(!text.contains(bad), "{bad}: {text}");
    }
    let mut updates = 0;
    for ((_, frame), tree) in net.trace.iter().zip(&trees) {
        let Id::Standard(bits) = frame.id() else { panic!("{frame}") };
        let identifier = Identifier::parse(bits).expect("ours");
        let is_poll = matches!(identifier, Identifier::PollCommand(_) | Identifier::PollResponse(_));
        // The last of three fragments: the update is whole.
        let whole = is_poll && frame.data().first().is_some_and(|head| head >> 6 == 2);
        assert_eq!(whole, tree.contains("fixed format, update"), "{tree}");
        updates += u32::from(whole);
    }
    assert!(updates >= 36, "both drives were polled and have answered: {updates}");
    assert_eq!(text.matches("device type 0x25").count(), 2);
    assert_eq!(text.matches("consumed connection size 16 bytes").count(), 2);
    let dissected = dissect("decoded", &net.trace);
    for (seen, tree) in dissected.iter().zip(&trees) {
        let told = tree.lines().nth(1).expect("what it is").trim();
        let field = |name: &str| number(seen, &format!("devicenet.{name}"));
        let group = (1..=4).find(|group| seen.field(&format!("devicenet.grp_msg{group}.id")).is_some());
        assert!(told.starts_with(&format!("group {}: ", group.expect("a group"))), "{tree}");
        let mac = field("src_mac_id").expect("a MAC ID");
        assert!(told.ends_with(&format!(", MAC ID {mac}")), "{tree}");
        if let Some(serial) = field("dup_mac_id.serial_number") {
            let vendor = field("dup_mac_id.vendor").expect("a vendor");
            let port = field("dup_mac_id.physical_port_number").expect("a port");
            let wanted = format!("check request, port {port}, vendor {vendor:#06x}, serial {serial:#010x}");
            assert!(tree.contains(&wanted), "{tree}");
        }
    }
}

/// tshark looks into explicit messages of group 3 only; header and body are the same there.
#[test]
fn tshark_reads_headers_and_bodies_of_explicit_messages_as_we_do() {
    let at = MonotonicTime(0);
    let identifier = Identifier::Group3 { message: 1, source: mac(33) };
    let mut frames = Vec::new();
    let mut message = |header: Header, body: &[u8]| {
        let data = [&[header.byte()], body].concat();
        frames.push((at, Frame::new(identifier.can(), &data).expect("8 bytes")));
    };
    let mut body = [0; 8];
    let request = Request { service: Service::GET_ATTRIBUTE_SINGLE, class: 0x2A, instance: 3, data: &[7] };
    let len = request.emit(BodyFormat::CLASS_8_INSTANCE_8, &mut body).expect("room");
    message(Header { fragmented: false, xid: true, mac: mac(9) }, &body[..len]);
    let success = Response::Success { service: Service::GET_ATTRIBUTE_SINGLE, data: &[1, 2] };
    let len = success.emit(&mut body).expect("room");
    message(Header { fragmented: false, xid: false, mac: mac(63) }, &body[..len]);
    let refusal = Response::Error { status: GeneralStatus::OBJECT_STATE_CONFLICT, additional: 1 };
    let len = refusal.emit(&mut body).expect("room");
    message(Header { fragmented: false, xid: true, mac: mac(0) }, &body[..len]);
    for byte in [0x00, 0x45, 0x86, 0xC6] {
        message(Header { fragmented: true, xid: false, mac: mac(9) }, &[byte, 0]);
    }
    let seen = dissect("explicit", &frames);
    let field = |frame: usize, name: &str| number(&seen[frame], &format!("devicenet.{name}"));
    for (frame, xid, dest) in [(0, 1, 9), (1, 0, 63), (2, 1, 0)] {
        assert_eq!(field(frame, "grp_msg3.frag"), Some(0));
        assert_eq!(field(frame, "grp_msg3.xid"), Some(xid));
        assert_eq!(field(frame, "dest_mac_id"), Some(dest));
    }
    for (frame, rr, service) in [(0, 0, 0x0E), (1, 1, 0x0E), (2, 1, 0x14)] {
        let said = (field(frame, "rr"), field(frame, "service"));
        assert_eq!(said, (Some(rr), Some(service)), "{:?}", seen[frame].field("devicenet.service"));
    }
    for (frame, kind, count) in [(3, 0, 0), (4, 1, 5), (5, 2, 6), (6, 3, 6)] {
        assert_eq!(field(frame, "grp_msg3.frag"), Some(1));
        let (seen_kind, seen_count) = (field(frame, "fragment_type"), field(frame, "fragment_count"));
        assert_eq!(
            (seen_kind.map(|kind| kind & 3), seen_count),
            (Some(kind), Some(count)),
            "{:?}",
            seen[frame]
        );
    }
}

/// The cycle of the master, with commands, answers and a request on the way, allocates nothing.
#[test]
fn a_cycle_of_the_master_allocates_nothing() {
    let mut net = Net::new();
    net.exchange();
    let start = || MotionEnd::new(SetPoint::Velocity(0.0), Watched::Velocity);
    let mut ends = [start(), start()];
    for step in 0..100 {
        if step % 10 == 0 {
            net.command(&mut ends);
        }
        net.step();
    }
    // The frames of the slaves are taken beforehand, so that only the master is measured.
    let request = ExplicitRequest::get(1, 1, 7);
    net.master.submit(mac(9), request).expect("room");
    let mut cycles = 0;
    for step in 0..300 {
        let mut frames = arrayvec::ArrayVec::<Frame, 64>::new();
        let now = net.now;
        let measured = allocation_counter::measure(|| {
            if step % 10 == 0 {
                net.command(&mut ends);
                cycles += 1;
            }
            while let Some(frame) = net.master.poll(now) {
                frames.push(frame);
            }
            while net.master.poll_event().is_some() {}
        });
        assert_eq!(measured.count_total, 0, "millisecond {step}");
        for frame in &frames {
            for slave in &mut net.slaves {
                let _ = slave.handle_frame(now, frame);
            }
        }
        for place in 0..net.slaves.len() {
            while let Some(frame) = net.slaves[place].poll(now) {
                let measured = allocation_counter::measure(|| {
                    let _ = net.master.handle_frame(now, &frame);
                });
                assert_eq!(measured.count_total, 0, "{frame}");
            }
        }
        net.now = net.now + DurationNs::from_millis(1);
    }
    assert_eq!(cycles, 30);
    assert!(ends.iter().all(MotionEnd::is_valid));
    assert_eq!(net.master.statistics().losses, 0);
}
