use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::AtomicBool;

use profile_cip::assembly::Layout;
use profile_cip::assembly::handshake::Status;
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::cpf::{CommonPacket, EncapsulatedPacket, Item, ItemType};
use profile_cip::wire::encapsulation::{Command, EXPLICIT_PORT, HEADER_LEN, Header, Packet};
use profile_cip::wire::forward_close::{ForwardClose, ForwardCloseReply};
use profile_cip::wire::forward_open::{ForwardOpen, ForwardOpenReply};
use profile_cip::wire::message_router::{Reply, Request};
use profile_cip::wire::sockaddr::SockaddrInfo;
use profile_cip::wire::status::GeneralStatus;

use super::*;

const DEVICE: Ipv4Addr = Ipv4Addr::new(127, 44, 18, 1);
const INTERVAL: Duration = Duration::from_millis(5);

/// Updates that the device sends before it is silent.
const UPDATES: u16 = 10;

/// Room for an answer.
const ROOM: usize = 200;

/// A device that opens and closes a connection, and sends `input` [`UPDATES`] times.
fn serve(listener: &TcpListener, input: &[u8]) {
    let (mut stream, from) = listener.accept().unwrap();
    let io = UdpSocket::bind((DEVICE, 0)).unwrap();
    let mut header = [0; HEADER_LEN];
    while stream.read_exact(&mut header).is_ok() {
        let header = Header::parse(&header).unwrap();
        let mut data = vec![0; usize::from(header.length)];
        stream.read_exact(&mut data).unwrap();
        if header.command == Command::REGISTER_SESSION {
            answer(&mut stream, header, &data);
            continue;
        }
        let body = EncapsulatedPacket::parse(&data).unwrap();
        let request = Request::parse(body.packet.items[1].data).unwrap();
        let mut reply = [0; ROOM];
        let (id, len) = if request.service == Service::FORWARD_CLOSE {
            let close = ForwardClose::parse(request.data).unwrap();
            let closed = ForwardCloseReply { triad: close.triad, application_reply: &[] };
            (None, closed.emit(&mut reply).unwrap())
        } else {
            let open = ForwardOpen::parse(request.data, request.service != Service::FORWARD_OPEN).unwrap();
            let opened = ForwardOpenReply {
                o_to_t_id: 7,
                t_to_o_id: open.t_to_o_id,
                triad: open.triad,
                o_to_t_api_us: open.o_to_t_rpi_us,
                t_to_o_api_us: open.t_to_o_rpi_us,
                application_reply: &[],
            };
            (Some(open.t_to_o_id), opened.emit(&mut reply).unwrap())
        };
        let reply = Reply { data: &reply[..len], ..Reply::new(request.service, GeneralStatus::SUCCESS) };
        let mut message = vec![0; reply.buffer_len()];
        reply.emit(&mut message).unwrap();
        let items = [
            Item { item_type: ItemType::NULL_ADDRESS, data: &[] },
            Item { item_type: ItemType::UNCONNECTED_DATA, data: &message },
        ];
        let answered =
            EncapsulatedPacket { packet: CommonPacket::new(&items), ..EncapsulatedPacket::default() };
        let mut bytes = vec![0; answered.buffer_len()];
        answered.emit(&mut bytes).unwrap();
        answer(&mut stream, header, &bytes);
        if let Some(connection_id) = id {
            let port = SockaddrInfo::parse(body.packet.items[2].data).unwrap().address.port();
            for number in 1..=UPDATES {
                let datagram = Class1Datagram {
                    connection_id,
                    encapsulation_sequence: number.into(),
                    sequence_count: number,
                    data: input,
                };
                let mut bytes = vec![0; datagram.buffer_len()];
                datagram.emit(&mut bytes).unwrap();
                io.send_to(&bytes, SocketAddr::new(from.ip(), port)).unwrap();
                std::thread::sleep(INTERVAL);
            }
        }
    }
}

fn answer(stream: &mut TcpStream, header: Header, data: &[u8]) {
    let Header { command, status, sender_context, options, .. } = header;
    let packet = Packet { command, session_handle: 1, status, sender_context, options, data };
    let mut bytes = vec![0; packet.buffer_len()];
    packet.emit(&mut bytes).unwrap();
    stream.write_all(&bytes).unwrap();
}

#[test]
fn what_a_device_sent_last_counts_only_until_the_connection_has_timed_out() {
    let plan = Plan {
        address: DEVICE,
        assemblies: Assemblies::new(Layout::shipped("mixed").unwrap(), 1).unwrap(),
        names: vec!["slide".to_owned()],
        counts: vec![1000],
        interval: INTERVAL,
    };
    let listener = TcpListener::bind((DEVICE, EXPLICIT_PORT)).unwrap();
    let input = vec![0; plan.assemblies.input_len()];
    let device = std::thread::spawn(move || serve(&listener, &input));
    let planned = |step| Planned { step, within: Duration::from_secs(5), title: String::new(), line: None };
    let expect = Step::Expect { axis: 0, condition: Condition::Status { bits: Status::TORQUE, on: false } };
    let silence = Step::Silence(Duration::from_secs(1));
    let steps = [expect.clone(), silence, expect].map(planned);
    let outcome = run(&plan, &steps, &AtomicBool::new(false), &mut |_| {});
    let failure = outcome.failure.unwrap();
    assert_eq!(failure.step, Some(2), "{failure}");
    assert!(matches!(failure.error, PlcError::ConnectionLost { .. }), "{failure}");
    device.join().unwrap();
}
