//! Streams that stall, are too many, or end.

use std::net::SocketAddr;
use tokio::io::AsyncWriteExt;

use tokio::net::TcpSocket;
use tokio::time::Instant;

use super::*;

#[tokio::test]
async fn a_client_that_stops_after_four_bytes_costs_the_others_nothing() {
    let (server, _device) = bind(71);
    let handle = spawn(server).unwrap();
    let mut stalled = Client::connect(handle.address()).await;
    let request = client::packet(Command::REGISTER_SESSION, 0, &[1, 0, 0, 0]);
    stalled.stream.write_all(&request[..4]).await.unwrap();
    let mut other = Client::register(handle.address()).await;
    for _ in 0..100 {
        assert_eq!(other.get(PATH_IDENTITY, 1).await, [0x34, 0x12]);
    }
    // It may still go on, byte by byte.
    for byte in &request[4..] {
        stalled.stream.write_all(&[*byte]).await.unwrap();
    }
    assert_eq!(stalled.read_packet().await.0.command, Command::REGISTER_SESSION);
    assert_eq!(handle.stop().await.accepted, 2);
}

#[tokio::test]
async fn a_client_that_never_reads_is_dropped_and_the_others_are_served() {
    let (mut server, _device) = bind(72);
    server.stall_limit = Duration::from_millis(200);
    let handle = spawn(server).unwrap();
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(4096).unwrap();
    let mut deaf = socket.connect(handle.address().into()).await.unwrap();
    let asking = tokio::spawn(async move {
        let request = client::packet(Command::LIST_IDENTITY, 0, &[]).repeat(1000);
        // Until the server lets go.
        while deaf.write_all(&request).await.is_ok() {}
    });
    let mut other = Client::register(handle.address()).await;
    let start = Instant::now();
    while handle.statistics().stalled == 0 {
        assert!(start.elapsed() < LIMIT, "the server holds on to a client that does not read");
        assert_eq!(other.get(PATH_IDENTITY, 1).await, [0x34, 0x12]);
    }
    tokio::time::timeout(LIMIT, asking).await.unwrap().unwrap();
    let statistics = handle.stop().await;
    assert_eq!((statistics.stalled, statistics.accepted), (1, 2));
}

#[tokio::test]
async fn more_requests_than_are_taken_at_once_are_all_answered_in_order() {
    const COUNT: usize = 2000;
    let (server, end) = bind(73);
    let device = Device::start(end, willing);
    let handle = spawn(server).unwrap();
    let mut client = Client::register(handle.address()).await;
    // One that waits for the motion device, and many behind it.
    client.send_message(&client::message(Service(0x4B), PATH_AXIS_1, &[1])).await;
    let (mut reading, mut writing) = client.stream.into_split();
    let sender = tokio::spawn(async move {
        let requests = client::packet(Command::LIST_SERVICES, 0, &[]).repeat(COUNT);
        writing.write_all(&requests).await.unwrap();
        writing
    });
    let mut commands = Vec::new();
    while commands.len() <= COUNT {
        let mut header = [0; 24];
        let read = tokio::io::AsyncReadExt::read_exact(&mut reading, &mut header);
        tokio::time::timeout(LIMIT, read).await.unwrap().unwrap();
        let (command, len) = (header[0], u16::from_le_bytes([header[2], header[3]]));
        let mut rest = vec![0; usize::from(len)];
        tokio::io::AsyncReadExt::read_exact(&mut reading, &mut rest).await.unwrap();
        commands.push(command);
    }
    assert_eq!(commands[0], 0x6F);
    assert!(commands[1..].iter().all(|command| *command == 0x04));
    drop(sender.await.unwrap());
    device.stop();
    handle.stop().await;
}

#[tokio::test]
async fn twenty_four_streams_of_a_host_are_served_and_the_rest_is_closed_at_once() {
    let (server, _device) = bind(74);
    let handle = spawn(server).unwrap();
    let mut clients = Vec::new();
    for _ in 0..40 {
        clients.push(Client::connect(handle.address()).await);
    }
    for client in &mut clients[..24] {
        client.register_session().await;
    }
    for client in &mut clients[24..] {
        assert!(client.is_closed().await);
    }
    // A place that becomes free is given again, however the client left.
    clients.truncate(24);
    clients.swap_remove(0);
    let unregister = client::packet(Command::UNREGISTER_SESSION, 0, &[]);
    clients[0].stream.write_all(&unregister).await.unwrap();
    let newcomer = async {
        loop {
            let mut client = Client::connect(handle.address()).await;
            let request = client::packet(Command::LIST_SERVICES, 0, &[]);
            let mut byte = [0; 1];
            if client.stream.write_all(&request).await.is_ok()
                && tokio::io::AsyncReadExt::read_exact(&mut client.stream, &mut byte).await.is_ok()
            {
                return byte;
            }
        }
    };
    assert_eq!(tokio::time::timeout(LIMIT, newcomer).await.unwrap(), [0x04]);
    let statistics = handle.stop().await;
    assert!(statistics.refused >= 16 && statistics.accepted == 25, "{statistics:?}");
    assert_eq!(statistics.adapter.sessions_refused, statistics.refused);
}

/// Hosts of the loopback network: a controller, a tool, and one that is neither.
#[tokio::test]
async fn hosts_on_no_list_are_not_served() {
    let [controller, tool, stranger] = [1, 2, 3].map(|last| Ipv4Addr::new(127, 0, 74, last));
    let hosts = |host: Ipv4Addr| Hosts::of([host.into()..=host.into()]);
    let address = Ipv4Addr::new(127, 0, 0, 86);
    let (link, _device) = motion_link();
    let config = AdapterConfig { controllers: hosts(controller), ..test_adapter_config(address) };
    let adapter = Adapter::new(config).unwrap();
    let server = ExplicitServer::bind_port(SocketAddrV4::new(address, 0), adapter, link, None).unwrap();
    let handle = spawn(server.serve_tools(hosts(tool))).unwrap();
    for host in [controller, tool] {
        let mut client = Client::connect_from(host, handle.address()).await;
        client.register_session().await;
        assert_eq!(client.get(PATH_IDENTITY, 1).await, [0x34, 0x12], "{host}");
    }
    assert!(Client::connect_from(stranger, handle.address()).await.is_closed().await);
    let request = client::packet(Command::LIST_IDENTITY, 0, &[]);
    let mut answer = [0; 256];
    for (host, answers) in [(stranger, false), (tool, true)] {
        let socket = UdpSocket::bind((host, 0)).await.unwrap();
        socket.send_to(&request, SocketAddr::V4(handle.address())).await.unwrap();
        let received = tokio::time::timeout(Duration::from_millis(500), socket.recv(&mut answer)).await;
        assert_eq!(received.is_ok(), answers, "{host}");
    }
    let statistics = handle.stop().await;
    assert_eq!((statistics.refused, statistics.accepted), (1, 2), "{statistics:?}");
}

#[tokio::test]
async fn a_stream_that_speaks_something_else_is_closed() {
    let (server, _device) = bind(75);
    let handle = spawn(server).unwrap();
    let mut client = Client::connect(handle.address()).await;
    // The server may break off before it is all out. Read as headers, these lines announce packets of 8 KiB
    // and more.
    let _ = client.stream.write_all(&b"GET / HTTP/1.1\r\n\r\n".repeat(20_000)).await;
    assert!(client.is_closed().await);
    assert_eq!(handle.stop().await.adapter.sessions_garbled, 1);
}

/// Whether somebody listens at `address`.
fn listens(address: SocketAddrV4) -> bool {
    std::net::TcpListener::bind(address).is_err()
}

#[tokio::test]
async fn stopping_closes_every_stream_and_frees_the_port() {
    let (server, _device) = bind(76);
    let handle = spawn(server).unwrap();
    let address = handle.address();
    let mut clients = Vec::new();
    for _ in 0..5 {
        clients.push(Client::register(address).await);
    }
    // One of the streams is in the middle of a write that does not go on: its peer does not read.
    let questions = client::packet(Command::LIST_IDENTITY, 0, &[]).repeat(1000);
    let pause = Duration::from_millis(100);
    while tokio::time::timeout(pause, clients[0].stream.write_all(&questions)).await.is_ok() {}
    assert!(listens(address));
    assert_eq!(handle.stop().await.streams, 0);
    for client in &mut clients {
        assert!(client.is_closed().await);
    }
    let (link, _end) = motion_link();
    let again = ExplicitServer::bind_port(address, adapter(*address.ip()), link, None).unwrap();
    // A handle that is dropped stops its server as well.
    drop(spawn(again).unwrap());
    let start = Instant::now();
    while listens(address) {
        assert!(start.elapsed() < LIMIT);
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}
