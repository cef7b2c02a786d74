use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::Path;

use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use profile_cip::wire::encapsulation::{Command, EncapsulationStatus, Packet};
use profile_cip::wire::epath::{Encoding, Segment, emit_path};
use profile_cip::wire::forward_close::{ForwardClose, ForwardCloseReply};
use profile_cip::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use profile_cip::wire::message_router::{Reply, Request};
use profile_cip::wire::motion::codes::{
    AxisControl, AxisStateCode, ControlMode, NodeAlarm, NodeControl, NodeFault, NodeStatus, TimeDataSet,
};
use profile_cip::wire::motion::{
    ActualBlock, ActualHeader, ActualInstance, ActualPosition, ActualValues, ActualWriter, CommandBlock,
    CommandHeader, CommandInstance, CommandPosition, CommandValues, CommandWriter,
};
use profile_cip::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
use profile_cip::wire::sockaddr::SockaddrInfo;
use profile_cip::wire::status::{GeneralStatus, Service};
use profile_cip::wire::unconnected_send::UnconnectedSend;
use profile_cip::wire::{ConnectionTriad, multiple_service};
use profile_sercos::port::Port;
use profile_sercos::wire::describe::NoNames;
use proptest::prelude::*;

use super::*;
use crate::capture::Side;
use crate::capture::synth::Synthesizer;
use crate::capture::writer::Writer;
use crate::decode::dialogue::{Dialogue, Shown};

const CLIENT: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 50_000);
const SERVER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 2), 44_818);
const CLIENT_IO: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 2222);
const SERVER_IO: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 2), 2222);
const TRIAD: ConnectionTriad =
    ConnectionTriad { connection_serial: 0x1234, originator_vendor: 1, originator_serial: 0xABCD };
const O_TO_T: u32 = 0x1000_0001;
const T_TO_O: u32 = 0x2000_0002;

/// Writes a recording frame by frame.
struct Recording {
    writer: Writer<Vec<u8>>,
    synth: Synthesizer,
    at: u64,
}

impl Recording {
    fn new() -> Self {
        let writer = Writer::new(Vec::new(), ["north", "sercos port 1", "not used"], &[]).unwrap();
        Self { writer, synth: Synthesizer::new(), at: 1_000_000_000 }
    }

    fn put(&mut self, run: impl FnOnce(&mut Synthesizer, &mut dyn FnMut(&[u8]))) {
        let Self { writer, synth, at } = self;
        run(synth, &mut |frame| {
            writer.frame(Side::North, KernelTime(*at), frame, None).unwrap();
            *at += 1_000;
        });
    }

    fn tcp(&mut self, from: SocketAddrV4, to: SocketAddrV4, bytes: &[u8]) {
        self.put(|synth, emit| synth.tcp_data(from, to, bytes, emit));
    }

    fn udp(&mut self, from: SocketAddrV4, to: SocketAddrV4, bytes: &[u8]) {
        self.put(|synth, emit| synth.udp(from, to, 0, bytes, emit).unwrap());
    }

    fn request(&mut self, context: u8, message: &[u8]) {
        self.tcp(CLIENT, SERVER, &send_rr_data(context, message));
    }

    fn reply(&mut self, context: u8, message: &[u8]) {
        self.tcp(SERVER, CLIENT, &send_rr_data(context, message));
    }

    fn text(self, options: &Options) -> String {
        decoded(&self.writer.finish().unwrap(), options).0
    }
}

fn decoded(file: &[u8], options: &Options) -> (String, Summary) {
    let mut text = Vec::new();
    let summary = decode(Reader::new(file).unwrap(), options, &NoNames, &mut text).unwrap();
    (String::from_utf8(text).unwrap(), summary)
}

fn emitted(length: usize, emit: impl FnOnce(&mut [u8]) -> usize) -> Vec<u8> {
    let mut bytes = vec![0xA5; length];
    let written = emit(&mut bytes);
    bytes.truncate(written);
    bytes
}

fn message(command: Command, context: u8, data: &[u8]) -> Vec<u8> {
    let packet = Packet {
        command,
        session_handle: 7,
        status: EncapsulationStatus::SUCCESS,
        sender_context: [context; 8],
        options: 0,
        data,
    };
    emitted(packet.buffer_len(), |buffer| packet.emit(buffer).unwrap())
}

fn send_rr_data(context: u8, cip: &[u8]) -> Vec<u8> {
    send_rr_data_with(context, cip, &[])
}

/// The same with further items.
fn send_rr_data_with(context: u8, cip: &[u8], more: &[Item<'_>]) -> Vec<u8> {
    let items = [
        Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
        Item { item_type: ItemType::UNCONNECTED_DATA, data: cip },
    ];
    let items = CommonPacket::new(&[&items, more].concat());
    let packet = EncapsulatedPacket { packet: items, ..EncapsulatedPacket::default() };
    let data = emitted(packet.buffer_len(), |buffer| packet.emit(buffer).unwrap());
    message(Command::SEND_RR_DATA, context, &data)
}

fn path(segments: &[Segment<'_>]) -> Vec<u8> {
    emitted(64, |buffer| emit_path(segments, Encoding::Padded, buffer).unwrap())
}

fn request(service: Service, class: u16, data: &[u8]) -> Vec<u8> {
    let path = path(&[Segment::class(class), Segment::instance(1)]);
    let request = Request { service, path: &path, data };
    emitted(request.buffer_len(), |buffer| request.emit(buffer).unwrap())
}

fn reply(service: Service, status: GeneralStatus, data: &[u8]) -> Vec<u8> {
    let reply = Reply { data, ..Reply::new(service, status) };
    emitted(reply.buffer_len(), |buffer| reply.emit(buffer).unwrap())
}

fn open_request(class: u16) -> Vec<u8> {
    let parameters = NetworkParameters {
        redundant_owner: false,
        connection_type: ConnectionType::POINT_TO_POINT,
        priority: Priority::URGENT,
        variable: true,
        size: 200,
    };
    let path = path(&[
        Segment::class(class),
        Segment::connection_point(2),
        Segment::Data(&[2, 0, 0, 0, 0xE9, 3, 0, 0]),
    ]);
    let open = ForwardOpen {
        large: false,
        priority_tick: 5,
        timeout_ticks: 100,
        o_to_t_id: 0,
        t_to_o_id: T_TO_O,
        triad: TRIAD,
        timeout_multiplier: 2,
        o_to_t_rpi_us: 2000,
        o_to_t: parameters,
        t_to_o_rpi_us: 2000,
        t_to_o: parameters,
        transport: Transport { server: false, trigger: Trigger::CYCLIC, class: 1 },
        path: &path,
    };
    let data = emitted(open.buffer_len(), |buffer| open.emit(buffer).unwrap());
    request(Service::FORWARD_OPEN, 6, &data)
}

fn open_reply() -> Vec<u8> {
    let open = ForwardOpenReply {
        o_to_t_id: O_TO_T,
        t_to_o_id: T_TO_O,
        triad: TRIAD,
        o_to_t_api_us: 2000,
        t_to_o_api_us: 2000,
        application_reply: &[],
    };
    let data = emitted(open.buffer_len(), |buffer| open.emit(buffer).unwrap());
    reply(Service::FORWARD_OPEN, GeneralStatus::SUCCESS, &data)
}

pub(crate) fn class1(connection_id: u32, count: u16, data: &[u8]) -> Vec<u8> {
    let datagram = Class1Datagram {
        connection_id,
        encapsulation_sequence: u32::from(count),
        sequence_count: count,
        data,
    };
    emitted(datagram.buffer_len(), |buffer| datagram.emit(buffer).unwrap())
}

/// A controller-to-device update that enables axis 1 in position control.
fn command_update() -> Vec<u8> {
    let header = CommandHeader {
        update_id: 17,
        node_control: NodeControl::REMOTE_CONTROL | NodeControl::DATA_VALID,
        instance_count: 1,
        last_received_id: 16,
        time_stamp: Some(1_000_000),
        time_offset: None,
        diagnostics: TimeDataSet::empty(),
    };
    let cyclic = CommandBlock {
        control_mode: ControlMode::POSITION,
        axis_control: AxisControl::ENABLE,
        values: CommandValues { position: Some(CommandPosition::Float(1234.5)), ..CommandValues::default() },
        ..CommandBlock::default()
    };
    let instance = CommandInstance { number: 1, cyclic: Some(cyclic), ..CommandInstance::default() };
    emitted(200, |buffer| {
        let mut writer = CommandWriter::new(buffer, &header).unwrap();
        writer.instance(&instance).unwrap();
        writer.finish()
    })
}

/// A device-to-controller update of axis 1, running, at a position.
pub(crate) fn actual_update(position: i32) -> Vec<u8> {
    let header = ActualHeader {
        update_id: 17,
        node_status: NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID,
        instance_count: 1,
        node_fault: NodeFault(0),
        node_alarm: NodeAlarm(0),
        last_received_id: 17,
        time_stamp: None,
        time_offset: None,
        update_diagnostics: None,
        time_diagnostics: None,
    };
    let cyclic = ActualBlock {
        control_mode: ControlMode::POSITION,
        axis_response: AxisControl::ENABLE,
        axis_state: AxisStateCode::RUNNING,
        actual: ActualValues { position: Some(ActualPosition::Dint(position)), ..ActualValues::default() },
        ..ActualBlock::default()
    };
    let instance = ActualInstance { number: 1, cyclic: Some(cyclic), ..ActualInstance::default() };
    emitted(200, |buffer| {
        let mut writer = ActualWriter::new(buffer, &header).unwrap();
        writer.instance(&instance).unwrap();
        writer.finish()
    })
}

/// A controller's visit: identity, session, connection, data both ways, close.
fn visit() -> Recording {
    let mut recording = Recording::new();
    recording.udp(CLIENT, SERVER, &message(Command::LIST_IDENTITY, 0, &[]));
    recording.put(|synth, emit| synth.tcp_open(CLIENT, SERVER, emit));
    let register = message(Command::REGISTER_SESSION, 1, &[1, 0, 0, 0]);
    // In two segments, the second of which begins another message.
    recording.tcp(CLIENT, SERVER, &register[..10]);
    let open = send_rr_data(2, &open_request(0x42));
    recording.tcp(CLIENT, SERVER, &[&register[10..], &open].concat());
    recording.tcp(SERVER, CLIENT, &register);
    recording.reply(2, &open_reply());
    recording.udp(CLIENT_IO, SERVER_IO, &class1(O_TO_T, 1, &command_update()));
    recording.udp(SERVER_IO, CLIENT_IO, &class1(T_TO_O, 1, &actual_update(-42)));
    let close = ForwardClose { priority_tick: 5, timeout_ticks: 100, triad: TRIAD, path: &[] };
    let close = emitted(100, |buffer| close.emit(buffer).unwrap());
    recording.request(3, &request(Service::FORWARD_CLOSE, 6, &close));
    let closed = ForwardCloseReply { triad: TRIAD, application_reply: &[] };
    let closed = emitted(100, |buffer| closed.emit(buffer).unwrap());
    recording.reply(3, &reply(Service::FORWARD_CLOSE, GeneralStatus::SUCCESS, &closed));
    recording.udp(CLIENT_IO, SERVER_IO, &class1(O_TO_T, 2, &[1, 2, 3]));
    recording.put(|synth, emit| synth.tcp_close(CLIENT, SERVER, emit));
    recording
}

#[test]
fn a_visit_of_a_controller_is_read() {
    insta::assert_snapshot!(visit().text(&Options::default()));
}

/// An originator may name any port for the data of the target, which come from port 2222.
#[test]
fn data_to_another_port_that_the_originator_named_are_read() {
    let mut recording = Recording::new();
    let mut port = [0; 16];
    let address = SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, CLIENT.port());
    SockaddrInfo { address }.emit(&mut port).unwrap();
    let port = [Item { item_type: ItemType::SOCKADDR_T_TO_O, data: &port }];
    recording.tcp(CLIENT, SERVER, &send_rr_data_with(1, &open_request(0x42), &port));
    recording.reply(1, &open_reply());
    let update = class1(T_TO_O, 1, &actual_update(-42));
    recording.udp(SERVER_IO, CLIENT, &update);
    let text = recording.text(&Options::default());
    assert!(text.contains("count 1 with 28 bytes (T->O of connection 0x1234"), "{text}");
    assert!(text.contains("Axis State: Running"), "{text}");
    let mut shown = Vec::new();
    let packet = packet::Packet::Udp { from: SERVER_IO, to: CLIENT, payload: &update };
    Dialogue::default().packet(&packet, |one| shown.push(one));
    assert_eq!(shown, [Shown::Running]);
}

/// The numbers of interfaces begin anew in a section, and so does what is known of them.
#[test]
fn a_section_has_buses_of_its_own() {
    let section = |description: &str| {
        let mut file = Writer::new(Vec::new(), ["north", "none", "none"], &[description]).unwrap();
        let poll =
            profile_generic::can::Frame::new(profile_generic::can::Id::Standard(0x44D), &[0x61, 0, 0xDC, 5]);
        file.can_frame(0, KernelTime(1_000_000_000), &poll.unwrap(), None).unwrap();
        file.finish().unwrap()
    };
    let second = section("can1, DeviceNet");
    let (alone, _) = decoded(&second, &Options::default());
    let (both, summary) = decoded(&[section("can0, CANopen"), second].concat(), &Options::default());
    assert_eq!(summary.frames, 2);
    assert!(alone.contains("poll"), "{alone}");
    let (_, last) = both.split_once("frame 2").unwrap();
    assert_eq!(last.lines().skip(1).collect::<Vec<_>>(), alone.lines().skip(1).collect::<Vec<_>>());
}

#[test]
fn requests_in_requests_and_refusals_are_read() {
    let mut recording = Recording::new();
    let single = request(Service::GET_ATTRIBUTE_SINGLE, 1, &[]);
    let open = open_request(0x42);
    let send = UnconnectedSend { priority_tick: 5, timeout_ticks: 9, message: &open, route: &[1, 0] };
    let send = emitted(300, |buffer| send.emit(buffer).unwrap());
    recording.request(1, &request(Service::UNCONNECTED_SEND, 6, &send));
    recording.reply(1, &open_reply());
    // The connection opened along a route is known as well.
    recording.udp(CLIENT_IO, SERVER_IO, &class1(O_TO_T, 1, &command_update()));

    let both = [single.as_slice(), &single];
    let both = emitted(100, |buffer| multiple_service::emit(&both, buffer).unwrap());
    recording.request(2, &request(Service::MULTIPLE_SERVICE_PACKET, 2, &both));
    let good = reply(Service::GET_ATTRIBUTE_SINGLE, GeneralStatus::SUCCESS, &[1, 2]);
    let answers = [good.as_slice(), &reply(Service::GET_ATTRIBUTE_SINGLE, GeneralStatus(0x14), &[])];
    let answers = emitted(100, |buffer| multiple_service::emit(&answers, buffer).unwrap());
    recording.reply(2, &reply(Service::MULTIPLE_SERVICE_PACKET, GeneralStatus(0x1E), &answers));

    let mut refused = Reply::new(Service::FORWARD_OPEN, GeneralStatus(1));
    refused.extended.push(0x0106);
    refused.data = &[0x34, 0x12, 1, 0, 0xCD, 0xAB, 0, 0, 0, 0];
    recording.request(3, &open_request(0x04));
    recording.reply(3, &emitted(100, |buffer| refused.emit(buffer).unwrap()));
    // An axis attribute read by explicit message: attribute 40, one octet.
    recording.request(4, &request(Service(0x4B), 0x42, &[1, 0, 0, 0, 40, 0, 0, 1]));
    recording.reply(4, &reply(Service(0x4B), GeneralStatus::SUCCESS, &[1, 0, 0, 0, 40, 0, 0, 1, 1, 0, 0, 0]));
    insta::assert_snapshot!(recording.text(&Options { first: 4, ..Options::default() }));
}

#[test]
fn what_cannot_be_read_is_said_and_does_not_end_it() {
    let mut recording = Recording::new();
    recording.udp(CLIENT, SERVER, &[0x63, 0, 1, 0]);
    recording.udp(CLIENT_IO, SERVER_IO, &class1(O_TO_T, 1, &command_update()));
    recording.udp(CLIENT_IO, SERVER_IO, &class1(O_TO_T, 1, &[6, 9, 0, 0]));
    recording.udp(CLIENT_IO, SERVER_IO, &[0; 10]);
    recording.udp(CLIENT, CLIENT, b"dns?");
    recording.tcp(CLIENT, SERVER, b"GET / HTTP/1.1 not EtherNet/IP");
    recording.request(1, &[0x0E, 9, 0x20]);
    recording.request(2, &request(Service::FORWARD_OPEN, 6, &[1, 2, 3]));
    recording.reply(9, &[0x8E, 0]);
    let mut frame = [0; 60];
    frame[12..14].copy_from_slice(&[0x88, 0xCD]);
    recording.writer.frame(Side::South(Port::One), KernelTime(recording.at), &frame, Some("cut")).unwrap();
    insta::assert_snapshot!(recording.text(&Options::default()));
}

#[test]
fn frames_and_lines_are_chosen() {
    let file = visit().writer.finish().unwrap();
    let (all, summary) = decoded(&file, &Options::default());
    assert_eq!(summary, Summary { frames: 16, printed: 16, cut: false });

    let (some, summary) = decoded(&file, &Options { first: 8, last: 9, ..Options::default() });
    assert_eq!(summary, Summary { frames: 9, printed: 2, cut: false });
    assert!(all.contains(&some) && some.starts_with("frame 8 at 0.000007000 s"), "{some}");

    let (some, summary) = decoded(&file, &Options { lines_max: 3, ..Options::default() });
    assert!(summary.cut);
    assert_eq!(some.lines().count(), 3);
    assert!(all.starts_with(&some));

    let (some, _) = decoded(&file, &Options { only: Some(Protocol::Sercos), ..Options::default() });
    assert_eq!(some, "");
    let (some, _) = decoded(&file, &Options { only: Some(Protocol::EtherNetIp), ..Options::default() });
    assert_eq!(some, all);
}

#[test]
fn a_foreign_masters_start_up_is_read_to_its_end() {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/captures/sercos3_startup_line2_part.pcap");
    let mut text = Vec::new();
    let reader = Reader::open(&path).unwrap();
    let summary = decode(reader, &Options::default(), &NoNames, &mut text).unwrap();
    assert_eq!(summary, Summary { frames: 674, printed: 674, cut: false });
    let text = String::from_utf8(text).unwrap();
    assert!(!text.contains("not readable"), "a frame was not understood");
    // In CP4 the places of the connections are known from what the master wrote in CP2.
    let last = text.find("frame 673").unwrap();
    insta::assert_snapshot!(&text[last..]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Bytes changed, or cut off, anywhere behind the file's headers.
    #[test]
    fn no_recording_makes_it_panic(
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..12),
        payload in proptest::collection::vec(any::<u8>(), 0..120),
        port in prop_oneof![Just(SERVER), Just(SERVER_IO)],
    ) {
        let mut recording = visit();
        recording.udp(CLIENT, port, &payload);
        recording.tcp(CLIENT, SERVER, &payload);
        let mut file = recording.writer.finish().unwrap();
        for (index, value) in changes {
            let at = index.index(file.len());
            file[at] = value;
        }
        if let Ok(reader) = Reader::new(file.as_slice()) {
            // Either outcome is right; only a panic is not.
            let _ = decode(reader, &Options::default(), &NoNames, &mut Vec::new());
        }
    }
}

/// The codes of drives and those of the communication profile are one list, that of the tables.
#[test]
fn emergencies_have_the_names_of_the_tables() {
    let cases: [([u8; 8], &str); 4] = [
        (
            [0x11, 0x86, 0x21, 0, 0, 0, 0, 0],
            "EMCY 8611 (following error), register 0x21 (GENERIC, PROFILE), 00 00 00 00 00",
        ),
        (
            [0x30, 0x82, 0x11, 0, 0, 0, 0, 0],
            "EMCY 8230 (multiplexed PDO not processed: no such object), register 0x11 (GENERIC, COMMUNICATION), \
             00 00 00 00 00",
        ),
        (
            [0x51, 0x54, 0x21, 0, 0, 0, 0, 0],
            "EMCY 5451 (fuse S1: L1), register 0x21 (GENERIC, PROFILE), 00 00 00 00 00",
        ),
        ([0x99, 0x23, 0x03, 0, 0, 0, 0, 0], "EMCY 2399, register 0x03 (GENERIC, CURRENT), 00 00 00 00 00"),
    ];
    // pcap: magic number, version 2.4, zone, accuracy, snap length, link type.
    let mut file = vec![0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0, 0];
    file.extend(u32::from(LINK_TYPE_CAN).to_le_bytes());
    for (data, _) in &cases {
        let id = profile_generic::can::Id::Standard(0x081);
        let frame = profile_generic::can::Frame::new(id, data).unwrap();
        let mut record = [0; can::RECORD_LEN_MAX];
        let len = can::emit(&frame, &mut record);
        let size = u32::try_from(len).unwrap().to_le_bytes();
        file.extend([[0; 4], [0; 4], size, size].concat());
        file.extend(&record[..len]);
    }
    let (text, summary) = decoded(&file, &Options::default());
    assert_eq!(summary.frames, 4, "{text}");
    let emergencies: Vec<&str> = text
        .lines()
        .map(str::trim)
        .filter(|line| line.starts_with("EMCY ") && !line.starts_with("EMCY of"))
        .collect();
    assert_eq!(emergencies, cases.map(|(_, expected)| expected));
}
