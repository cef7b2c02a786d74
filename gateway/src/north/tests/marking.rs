//! What the device sends carries the code points of the QoS object.

use std::io::Read as _;
use std::time::Instant;

use profile_cip::wire::network_parameters::Priority;
use socket2::{Domain, Protocol, Socket, Type};

use super::*;
use crate::sys::udp::IoSocket;

/// `ETH_P_IP`.
const IPV4: u16 = 0x0800;

/// Sees every IPv4 packet of this host, without a link header; `None` where that is not permitted.
fn tap(test: &str) -> Option<Socket> {
    // Packet sockets take the protocol in network order.
    match Socket::new(Domain::PACKET, Type::DGRAM, Some(Protocol::from(i32::from(IPV4.to_be())))) {
        Ok(socket) => {
            socket.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
            Some(socket)
        }
        Err(error) => {
            println!("SKIPPED: {test}: cannot see the packets of this host: {error}");
            None
        }
    }
}

/// Code points of the TCP segments with data and of the datagrams that `from` sent, until there are `count` of each.
fn seen(mut tap: &Socket, from: SocketAddrV4, count: usize) -> (Vec<u8>, Vec<u8>) {
    let (mut segments, mut datagrams) = (Vec::new(), Vec::new());
    let mut packet = [0; 2048];
    let end = Instant::now() + LIMIT;
    while (segments.len() < count || datagrams.len() < count) && Instant::now() < end {
        let Ok(len) = tap.read(&mut packet) else { continue };
        let packet = &packet[..len];
        let header = usize::from(packet[0] & 0x0F) * 4;
        let port = u16::from_be_bytes([packet[header], packet[header + 1]]);
        if packet[12..16] != from.ip().octets() || port != from.port() {
            continue;
        }
        let total = usize::from(u16::from_be_bytes([packet[2], packet[3]]));
        match packet[9] {
            6 if total > header + usize::from(packet[header + 12] >> 4) * 4 => segments.push(packet[1] >> 2),
            17 => datagrams.push(packet[1] >> 2),
            _ => {}
        }
    }
    (segments, datagrams)
}

#[tokio::test]
async fn explicit_messages_carry_their_code_point_over_tcp_and_udp() {
    let Some(tap) = tap("explicit_messages_carry_their_code_point_over_tcp_and_udp") else { return };
    for (last, dscp) in [(81, 27), (82, 34)] {
        let address = Ipv4Addr::new(127, 0, 0, last);
        let mut config = test_adapter_config(address);
        config.qos.explicit = dscp;
        let (link, _device) = motion_link();
        let at = SocketAddrV4::new(address, 0);
        let server = ExplicitServer::bind_port(at, Adapter::new(config).unwrap(), link, None).unwrap();
        let handle = spawn(server).unwrap();
        let mut client = Client::register(handle.address()).await;
        client.get(PATH_IDENTITY, 1).await;
        let socket = UdpSocket::bind((Ipv4Addr::new(127, 0, 0, 181), 0)).await.unwrap();
        let request = client::packet(Command::LIST_IDENTITY, 0, &[]);
        socket.send_to(&request, handle.address()).await.unwrap();
        tokio::time::timeout(LIMIT, socket.recv_from(&mut [0; 300])).await.unwrap().unwrap();
        let from = handle.address();
        let (segments, datagrams) = seen(&tap, from, 1);
        assert!(!segments.is_empty() && segments.iter().all(|one| *one == dscp), "TCP {segments:?}");
        assert!(!datagrams.is_empty() && datagrams.iter().all(|one| *one == dscp), "UDP {datagrams:?}");
        handle.stop().await;
    }
}

#[tokio::test]
async fn data_of_the_motion_connection_carry_the_code_point_of_its_priority() {
    let address = Ipv4Addr::new(127, 0, 0, 83);
    let mut config = test_adapter_config(address);
    config.qos.high = 40;
    let io = IoSocket::bind(SocketAddrV4::new(address, 0), config.qos.urgent).unwrap();
    let receiver = IoSocket::bind(SocketAddrV4::new(Ipv4Addr::new(127, 0, 0, 183), 0), 0).unwrap();
    let marker = io.marker().unwrap();
    let (link, mut end) = motion_link();
    let at = SocketAddrV4::new(address, 0);
    let server = ExplicitServer::bind_port(at, Adapter::new(config).unwrap(), link, None).unwrap();
    let server = server.on_open(move |open| marker.mark(open.t_to_o_dscp).unwrap());
    let handle = spawn(server).unwrap();
    let mut client = Client::register(handle.address()).await;
    for (serial, (priority, dscp)) in (1..).zip([
        (Priority::SCHEDULED, 47),
        (Priority::URGENT, 55),
        (Priority::HIGH, 40),
        (Priority::LOW, 31),
    ]) {
        client.send_message(&client::motion_open_at(serial, priority)).await;
        // In the place of the cycle thread: from the moment it knows of the connection, its data are marked.
        let deadline = Instant::now() + LIMIT;
        let open = loop {
            if let Some(MotionRequest::Open(open)) = end.request() {
                break open;
            }
            assert!(Instant::now() < deadline);
            tokio::task::yield_now().await;
        };
        assert_eq!((open.t_to_o_dscp, io.dscp()), (dscp, dscp));
        io.send_to(&[1], receiver.local_address()).unwrap();
        let mut buffer = [0; 8];
        let datagram = loop {
            if let Some(datagram) = receiver.recv(&mut buffer).unwrap() {
                break datagram;
            }
            assert!(Instant::now() < deadline);
        };
        assert_eq!(datagram.dscp, dscp, "{priority}");
        end.reply(MotionReply::Opened { token: open.token, outcome: Ok(()) }).unwrap();
        assert_eq!(client.reply().await.outcome(), (0, 0));
        end.reply(MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_000 }).unwrap();
        while client.get(PATH_IDENTITY, 5).await != [0x20, 0] {
            assert!(Instant::now() < deadline);
        }
    }
    handle.stop().await;
}
