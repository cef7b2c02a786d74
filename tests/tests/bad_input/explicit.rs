//! Encapsulation, and the Forward_Open of the motion connection.

use std::net::{Ipv4Addr, SocketAddrV4};

use axisbridge_tests::rig::explicit::{Client, packet};
use axisbridge_tests::rig::motion::{in_motion, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::device::counters::Counters;
use profile_cip::wire::ConnectionTriad;
use profile_cip::wire::encapsulation::{Command, EncapsulationStatus, Header};
use profile_cip::wire::forward_open::{ForwardOpen, Transport, Trigger};
use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};

const MANAGER: &[u8] = &[0x20, 6, 0x24, 1];
/// Class 0x42, configuration point 0x51, I/O point 2, configuration block of revision 1 that verifies the
/// class ID.
const PATH: &[u8] = &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4, 1, 1, 0, 0, 0x0D, 0x0C, 0x0B, 0x0A];

fn box_with_power_structure() -> Settings {
    let name = "name = \"front\"\n";
    let configuration = BOX.replace(name, &format!("{name}power_structure_class_id = 0x0A0B_0C0D\n"));
    Settings { configuration, ..Settings::default() }
}

const STRANGER: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 66);

fn stranger() -> SocketAddrV4 {
    SocketAddrV4::new(STRANGER, 50_066)
}

/// A client with a registered session.
fn client(rig: &mut Rig) -> Client {
    Client::connect(rig, STRANGER)
}

fn direction(size: u16) -> NetworkParameters {
    NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority: Priority::URGENT,
        variable: true,
        size,
    }
}

fn good_open() -> ForwardOpen<'static> {
    ForwardOpen {
        large: false,
        priority_tick: 5,
        timeout_ticks: 157,
        o_to_t_id: 0,
        t_to_o_id: 0x5500_0001,
        triad: ConnectionTriad { connection_serial: 77, originator_vendor: 1, originator_serial: 0xCAFE },
        timeout_multiplier: 3,
        o_to_t_rpi_us: 4_000,
        o_to_t: direction(400),
        t_to_o_rpi_us: 4_000,
        t_to_o: direction(400),
        transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
        path: PATH,
    }
}

/// Sends a Forward_Open and returns general and first extended status.
fn open(rig: &mut Rig, client: Client, open: &ForwardOpen<'_>) -> (u8, u16) {
    let mut data = vec![0; open.buffer_len()];
    open.emit(&mut data).expect("it fits");
    let (status, extended, _) = client.request_extended(rig, open.service().0, MANAGER, &data);
    (status, extended)
}

#[test]
fn a_forward_open_that_does_not_fit_is_refused_with_the_status_of_the_standard() {
    let key = |vendor: u8, device_type: u8, major: u8| {
        [&[0x34, 4, vendor, 0, device_type, 0, 0, 0, major, 0][..], PATH].concat()
    };
    let (vendor, device_type, revision) = (key(9, 0, 0), key(0, 2, 0), key(0, 0, 9));
    let class_id = [&PATH[..12], &[1, 2, 3, 4]].concat();
    let good = good_open();
    let fixed = NetworkParameters { variable: false, ..direction(400) };
    let multicast = NetworkParameters { connection_type: ConnectionType::MULTICAST, ..direction(400) };
    let cases = [
        ("vendor of the key", ForwardOpen { path: &vendor, ..good }, (1, 0x114)),
        ("device type of the key", ForwardOpen { path: &device_type, ..good }, (1, 0x115)),
        ("revision of the key", ForwardOpen { path: &revision, ..good }, (1, 0x116)),
        ("power structure of the class", ForwardOpen { path: &class_id, ..good }, (9, 4)),
        ("no connection point", ForwardOpen { path: &PATH[..2], ..good }, (1, 0x12F)),
        (
            "another configuration point",
            ForwardOpen { path: &[0x20, 0x42, 0x2C, 0x50, 0x2C, 2], ..good },
            (1, 0x12F),
        ),
        ("no configuration block", ForwardOpen { path: &PATH[..6], ..good }, (1, 0x126)),
        ("another class", ForwardOpen { path: &[0x20, 4, 0x24, 1, 0x2C, 0x51, 0x2C, 2], ..good }, (1, 0x117)),
        ("size to the device", ForwardOpen { large: true, o_to_t: direction(1_401), ..good }, (1, 0x127)),
        ("size from the device", ForwardOpen { t_to_o: direction(4), ..good }, (1, 0x128)),
        ("fixed size", ForwardOpen { o_to_t: fixed, ..good }, (1, 0x11F)),
        ("multicast", ForwardOpen { t_to_o: multicast, ..good }, (1, 0x124)),
        ("too fast", ForwardOpen { o_to_t_rpi_us: 1_000, t_to_o_rpi_us: 1_000, ..good }, (1, 0x111)),
        ("time-out multiplier", ForwardOpen { timeout_multiplier: 8, ..good }, (1, 0x133)),
        (
            "transport class 0",
            ForwardOpen { transport: Transport { class: 0, ..good.transport }, ..good },
            (1, 0x11C),
        ),
    ];
    let mut rig = Rig::ready(box_with_power_structure());
    let client = client(&mut rig);
    let count = u64::try_from(cases.len()).expect("some cases");
    for (name, request, expected) in cases {
        assert_eq!(open(&mut rig, client, &request), expected, "{name}");
        assert!(rig.adapter.counters().open_refused(expected.0, expected.1) > 0, "{name}");
        assert_eq!(rig.engine.devices()[0].device().connection(), None, "{name}");
    }
    let counters = rig.adapter.counters();
    assert_eq!(counters.open_refusals.iter().map(|row| row.count).sum::<u64>(), count);
    assert_eq!(open(&mut rig, client, &good), (0, 0), "what fits is taken");
}

#[test]
fn a_second_controller_is_refused_and_the_first_one_moves_on() {
    let mut rig = in_motion(box_with_power_structure());
    let client = client(&mut rig);
    // Ownership conflict.
    assert_eq!(open(&mut rig, client, &good_open()), (1, 0x106));
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.steps_finished), (None, 4), "{}", rig.log());
}

#[test]
fn broken_encapsulation_is_refused_while_the_axes_move_on() {
    type Counter = fn(&Counters) -> u64;
    let mut rig = in_motion(Settings::default());
    let handle = client(&mut rig).handle();
    let mut long = packet(Command::SEND_RR_DATA, handle, &[]);
    long[2..4].copy_from_slice(&65_511_u16.to_le_bytes());
    let mut optional = packet(Command::LIST_IDENTITY, 0, &[]);
    optional[20] = 1;
    let cases: [(&str, Vec<u8>, Option<EncapsulationStatus>, Counter); 6] = [
        (
            "unknown command",
            packet(Command(0x0099), handle, &[]),
            Some(EncapsulationStatus::INVALID_COMMAND),
            |counters| counters.commands_unknown,
        ),
        (
            "another session's handle",
            packet(Command::SEND_RR_DATA, handle ^ 0x100, &[0; 16]),
            Some(EncapsulationStatus::INVALID_SESSION_HANDLE),
            |counters| counters.handles_invalid,
        ),
        (
            "a session of another protocol version",
            packet(Command::REGISTER_SESSION, 0, &[2, 0, 0, 0]),
            Some(EncapsulationStatus::UNSUPPORTED_PROTOCOL),
            |counters| counters.versions_refused,
        ),
        (
            "a session request of another length",
            packet(Command::REGISTER_SESSION, 0, &[1, 0, 0]),
            Some(EncapsulationStatus::INVALID_LENGTH),
            |counters| counters.lengths_invalid,
        ),
        ("options", optional, None, |counters| counters.packets_dropped),
        ("longer than the box takes", long, Some(EncapsulationStatus::INVALID_LENGTH), |counters| {
            counters.lengths_invalid
        }),
    ];
    for (name, bytes, status, counter) in cases {
        let before = counter(rig.adapter.counters());
        let slot = rig.open_stream(stranger()).expect("room for a stream");
        let answer = rig.exchange(slot, &bytes, millis(50));
        let found = Header::parse(&answer).ok().map(|header| header.status);
        assert_eq!(found, status, "{name}");
        assert_eq!(counter(rig.adapter.counters()), before + 1, "{name}");
        rig.adapter.close(slot);
    }
    // Half a header and silence: the stream is left waiting, nobody else is.
    let slot = rig.open_stream(stranger()).expect("room for a stream");
    assert!(rig.exchange(slot, &packet(Command::NOP, 0, &[])[..11], millis(50)).is_empty());
    // Noise ends its own stream, not the controller's.
    let slot = rig.open_stream(stranger()).expect("room for a stream");
    rig.exchange(slot, &[0xA5; 2_000], millis(50));
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.steps_finished), (None, 4), "{}", rig.log());
}
