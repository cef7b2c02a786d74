//! The server on loopback addresses, as clients and the cycle thread see it.

mod admission;
mod client;
mod marking;
mod other_targets;
mod streams;

use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use arrayvec::{ArrayString, ArrayVec};
use profile_cip::device::adapter::Adapter;
use profile_cip::device::config::{
    AdapterConfig, DEVICE_TYPE_CIP_MOTION_DRIVE, IdentityConfig, InterfaceConfig, LinkConfig, MotionConfig,
    QosConfig,
};
use profile_cip::device::ethernet_link::{InterfaceType, LinkState};
use profile_cip::device::event::Event;
use profile_cip::device::hosts::Hosts;
use profile_cip::device::identity::Health;
use profile_cip::device::motion_link::{ExplicitReply, MotionReply, MotionRequest, ObjectPath, OpenRefusal};
use profile_cip::wire::encapsulation::Command;
use profile_cip::wire::forward_open::ForwardOpenReply;
use profile_cip::wire::motion::Format;
use profile_cip::wire::status::Service;
use tokio::net::UdpSocket;

use super::*;
use crate::capture::reader::Reader;
use crate::capture::recorder::{Recorder, Settings};
use client::{Client, PATH_AXIS_1, PATH_IDENTITY, motion_open};

/// Nothing here takes longer, unless it hangs.
const LIMIT: Duration = Duration::from_secs(10);

fn adapter(address: Ipv4Addr) -> Adapter {
    Adapter::new(test_adapter_config(address)).unwrap()
}

/// A device with one axis.
pub(crate) fn test_adapter_config(address: Ipv4Addr) -> AdapterConfig {
    AdapterConfig {
        identity: IdentityConfig {
            vendor: 0x1234,
            device_type: DEVICE_TYPE_CIP_MOTION_DRIVE,
            product_code: 7,
            major: 2,
            minor: 3,
            serial_number: 0xDEAD_BEEF,
            product_name: ArrayString::from("Axisbridge").unwrap(),
            configuration: 0,
        },
        interface: InterfaceConfig::new(address, Ipv4Addr::new(255, 0, 0, 0)),
        link: LinkConfig {
            mac: [2, 0, 0, 0, 0, 9],
            label: ArrayString::from("north").unwrap(),
            interface_type: InterfaceType::TwistedPair,
            state: LinkState {
                up: true,
                enabled: true,
                speed_mbit: 100,
                full_duplex: true,
                ..LinkState::default()
            },
        },
        qos: QosConfig::default(),
        motion: MotionConfig {
            format: Format::Variable,
            rpi_min_us: 1000,
            rpi_max_us: 32_000,
            rpi_multiple_us: 500,
            o_to_t_size_max: 500,
            t_to_o_size_max: 600,
            power_structure_class_id: 0x0A0B_0C0D,
            power_structure_axis_ids: ArrayVec::from_iter([0x11]),
        },
        assembly: None,
        controllers: Hosts::EVERYBODY,
        eds: Arc::new([]),
        incarnation: 0x7A00,
    }
}

/// A server at a free port of 127.0.0.`last`, and the device's end of its link.
fn bind(last: u8) -> (ExplicitServer, DeviceEnd) {
    let address = Ipv4Addr::new(127, 0, 0, last);
    let (link, device) = motion_link();
    let server = ExplicitServer::bind_port(SocketAddrV4::new(address, 0), adapter(address), link, None);
    (server.unwrap(), device)
}

/// A thread in the place of the cycle thread, answering what `answer` says; it returns what it was asked.
struct Device {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Vec<MotionRequest>>,
}

impl Device {
    fn start(mut end: DeviceEnd, answer: impl Fn(&MotionRequest) -> MotionReply + Send + 'static) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut asked = Vec::new();
            while !flag.load(Ordering::Relaxed) {
                while let Some(request) = end.request() {
                    let mut reply = answer(&request);
                    while let Err(full) = end.reply(reply) {
                        reply = full;
                        std::thread::yield_now();
                    }
                    asked.push(request);
                }
                std::thread::sleep(Duration::from_micros(500));
            }
            asked
        });
        Self { stop, thread }
    }

    fn stop(self) -> Vec<MotionRequest> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

/// Takes every connection; explicit services answer with their own data.
fn willing(request: &MotionRequest) -> MotionReply {
    match request {
        MotionRequest::Open(open) => MotionReply::Opened { token: open.token, outcome: Ok(()) },
        MotionRequest::Close(close) => MotionReply::Closed { token: close.token },
        MotionRequest::PrepareReset(token) => MotionReply::ResetPrepared { token: *token, granted: true },
        MotionRequest::Explicit(explicit) => MotionReply::Explicit(ExplicitReply {
            data: explicit.data.iter().copied().collect(),
            ..ExplicitReply::status(explicit.token, 0)
        }),
    }
}

#[tokio::test]
async fn sessions_identity_and_lists_over_tcp_and_udp() {
    let (server, _device) = bind(61);
    let handle = spawn(
        server.attend(|adapter| adapter.set_health(Health { minor_recoverable: true, ..Health::default() })),
    )
    .unwrap();
    let mut client = Client::register(handle.address()).await;
    // Vendor ID, product name, status: no I/O connection (3 in bits 7..4), minor recoverable fault (bit 8).
    assert_eq!(client.get(PATH_IDENTITY, 1).await, [0x34, 0x12]);
    assert_eq!(client.get(PATH_IDENTITY, 7).await, b"\x0aAxisbridge");
    assert_eq!(client.get(PATH_IDENTITY, 5).await, [0x30, 0x01]);

    let request = client::packet(Command::LIST_IDENTITY, 0, &[]);
    let over_tcp = client.exchange(&request).await;
    assert_eq!(over_tcp.1.last_chunk(), Some(b"\x0aAxisbridge\x03"), "product name and state");

    let socket = UdpSocket::bind((Ipv4Addr::new(127, 0, 0, 161), 0)).await.unwrap();
    socket.send_to(&request, handle.address()).await.unwrap();
    let mut answer = [0; 300];
    let (len, from) = tokio::time::timeout(LIMIT, socket.recv_from(&mut answer)).await.unwrap().unwrap();
    assert_eq!(from, handle.address().into());
    assert_eq!(client::parse(&answer[..len]), over_tcp);
    // What is no packet gets no answer; the next question does.
    socket.send_to(&[0xFF; 5], handle.address()).await.unwrap();
    socket.send_to(&client::packet(Command::LIST_SERVICES, 0, &[]), handle.address()).await.unwrap();
    let (len, _) = tokio::time::timeout(LIMIT, socket.recv_from(&mut answer)).await.unwrap().unwrap();
    assert_eq!(client::parse(&answer[..len]).0.command, Command::LIST_SERVICES);

    let statistics = handle.stop().await;
    assert_eq!((statistics.accepted, statistics.datagrams, statistics.streams), (1, 3, 0));
    assert_eq!(statistics.adapter.datagrams_dropped, 1);
}

#[tokio::test]
async fn a_forward_open_reaches_the_motion_device_and_its_answer_comes_back() {
    let (server, end) = bind(62);
    let (told, mut events) = tokio::sync::mpsc::unbounded_channel();
    let server = server.on_event(move |event| told.send(*event).unwrap());
    let device = Device::start(end, willing);
    let handle = spawn(server).unwrap();
    let mut client = Client::register(handle.address()).await;

    let opened = client.ask(&motion_open(5)).await;
    assert_eq!(opened.outcome(), (0, 0));
    let granted = ForwardOpenReply::parse(&opened.data).unwrap();
    assert_eq!(granted.triad.connection_serial, 5);
    let Some(Event::MotionOpened { originator, rpi_us: 2000, .. }) = events.recv().await else { panic!() };
    assert_eq!(originator, client.local());

    // Get Axis Attributes List of the axis object: handed on with its data.
    let answer = client.ask(&client::message(Service(0x4B), PATH_AXIS_1, &[1, 2, 3])).await;
    assert_eq!((answer.outcome(), answer.data.as_slice()), ((0, 0), &[1, 2, 3][..]));
    // A second owner is refused without the device being asked.
    assert_eq!(client.ask(&motion_open(6)).await.outcome(), (1, 0x0106));
    assert_eq!(client.ask(&client::motion_close(5)).await.outcome(), (0, 0));

    let asked = device.stop();
    let [MotionRequest::Open(open), MotionRequest::Explicit(explicit), MotionRequest::Close(close)] =
        asked.as_slice()
    else {
        panic!("{asked:?}")
    };
    assert_eq!((open.originator, open.o_to_t_id), (*client.local().ip(), granted.o_to_t_id));
    assert_eq!((explicit.service, explicit.data.as_slice()), (0x4B, &[1, 2, 3][..]));
    let path = ObjectPath { class: 0x42, instance: 1, ..ObjectPath::default() };
    assert_eq!(explicit.path, path);
    assert_eq!(close.o_to_t_id, granted.o_to_t_id);
    let statistics = handle.stop().await;
    assert_eq!((statistics.motion_requests, statistics.motion_replies), (3, 3));
    assert_eq!((statistics.motion_opened, statistics.motion_closed), (1, 1));
    assert_eq!((statistics.events, statistics.adapter.open_refused(1, 0x0106)), (3, 1));
}

#[tokio::test]
async fn a_refusal_and_the_loss_of_the_connection_come_from_the_device() {
    let (server, mut end) = bind(63);
    let handle = spawn(server).unwrap();
    let mut client = Client::register(handle.address()).await;
    let device = |end: &mut DeviceEnd, outcome| {
        loop {
            if let Some(MotionRequest::Open(open)) = end.request() {
                end.reply(MotionReply::Opened { token: open.token, outcome }).unwrap();
                return open;
            }
            std::thread::yield_now();
        }
    };
    let refusal = OpenRefusal { general_status: 0x10, extended_status: 0 };
    client.send_message(&motion_open(1)).await;
    let mut end = tokio::task::spawn_blocking(move || {
        device(&mut end, Err(refusal));
        end
    })
    .await
    .unwrap();
    assert_eq!(client.reply().await.outcome(), (0x10, 0));

    client.send_message(&motion_open(2)).await;
    let (mut end, open) = tokio::task::spawn_blocking(move || {
        let open = device(&mut end, Ok(()));
        (end, open)
    })
    .await
    .unwrap();
    assert_eq!(client.reply().await.outcome(), (0, 0));
    // Nobody waits for anything now; still the notice is seen, and the connection is free again.
    end.reply(MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_000 }).unwrap();
    let lost = async {
        while client.get(PATH_IDENTITY, 5).await != [0x20, 0] {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    tokio::time::timeout(LIMIT, lost).await.unwrap();
    assert_eq!(handle.stop().await.motion_lost, 1);
}

#[tokio::test]
async fn a_full_queue_holds_a_request_until_the_device_makes_room() {
    let address = Ipv4Addr::new(127, 0, 0, 64);
    let (mut link, end) = motion_link();
    let triad = client::triad(9);
    for number in 0..QUEUE_LEN {
        let token = profile_cip::device::motion_link::Token(1_000_000 + u64::try_from(number).unwrap());
        let close = profile_cip::device::motion_link::CloseParameters { token, triad, o_to_t_id: 1 };
        link.request(MotionRequest::Close(close)).unwrap();
    }
    let server =
        ExplicitServer::bind_port(SocketAddrV4::new(address, 0), adapter(address), link, None).unwrap();
    let handle = spawn(server).unwrap();
    let mut client = Client::register(handle.address()).await;
    client.send_message(&client::message(Service(0x4B), PATH_AXIS_1, &[7])).await;
    tokio::time::sleep(Duration::from_millis(20)).await;
    let device = Device::start(end, willing);
    let answer = client.reply().await;
    assert_eq!((answer.outcome(), answer.data.as_slice()), ((0, 0), &[7][..]));
    assert_eq!(device.stop().len(), QUEUE_LEN + 1);
    let statistics = handle.stop().await;
    assert_eq!((statistics.motion_requests, statistics.motion_requests_held), (1, 1));
}

#[tokio::test]
async fn a_recording_shows_both_directions() {
    let address = Ipv4Addr::new(127, 0, 0, 65);
    let path = std::env::temp_dir().join(format!("axisbridge-north-{}.pcapng", std::process::id()));
    let (recorder, mut taps) = Recorder::start(Settings::new(&path), 1).unwrap();
    let (link, _device) = motion_link();
    let at = SocketAddrV4::new(address, 0);
    let server = ExplicitServer::bind_port(at, adapter(address), link, taps.pop()).unwrap();
    let handle = spawn(server).unwrap();
    let mut client = Client::register(handle.address()).await;
    client.get(PATH_IDENTITY, 1).await;
    let socket = UdpSocket::bind((Ipv4Addr::new(127, 0, 0, 165), 0)).await.unwrap();
    let request = client::packet(Command::LIST_IDENTITY, 0, &[]);
    socket.send_to(&request, handle.address()).await.unwrap();
    tokio::time::timeout(LIMIT, socket.recv_from(&mut [0; 300])).await.unwrap().unwrap();
    let local = client.local();
    drop(client);
    let statistics = handle.stop().await;
    assert_eq!(statistics.accepted, 1);
    recorder.finish().unwrap();

    let mut reader = Reader::open(&path).unwrap();
    let mut ports = Vec::new();
    while let Some(frame) = reader.next_frame().unwrap() {
        // Source port of TCP or UDP over IPv4, and whether it carries data.
        let (udp, source) = (frame.data[23] == 17, u16::from_be_bytes([frame.data[34], frame.data[35]]));
        if udp || frame.data.len() > 54 {
            ports.push((udp, source == local.port() || source == socket.local_addr().unwrap().port()));
        }
    }
    std::fs::remove_file(&path).unwrap();
    let (asked, answered) = ((false, true), (false, false));
    assert_eq!(ports, [asked, answered, asked, answered, (true, true), (true, false)]);
}

#[tokio::test]
async fn what_cannot_be_bound_is_told_with_address_and_reason() {
    let (server, _device) = bind(66);
    let taken = server.local_address();
    let (link, _end) = motion_link();
    let error = ExplicitServer::bind_port(taken, adapter(*taken.ip()), link, None).unwrap_err();
    let port = taken.port();
    let expected = format!("cannot listen at {taken}: TCP port {port} is in use by another program");
    assert_eq!(error.to_string(), expected);

    let udp = UdpSocket::bind((Ipv4Addr::new(127, 0, 0, 67), 0)).await.unwrap();
    let std::net::SocketAddr::V4(taken) = udp.local_addr().unwrap() else { panic!() };
    let (link, _end) = motion_link();
    let error = ExplicitServer::bind_port(taken, adapter(*taken.ip()), link, None).unwrap_err();
    assert!(matches!(error, ServeError::InUse { transport: "UDP", .. }), "{error}");

    let (link, _end) = motion_link();
    let foreign = Ipv4Addr::new(192, 0, 2, 1);
    let error = ExplicitServer::bind(foreign, adapter(foreign), link, None).unwrap_err();
    assert_eq!(error.to_string(), "cannot listen at 192.0.2.1:44818: no interface has the address 192.0.2.1");
}
