//! Explicit round trips over loopback: the explicit server of Axisbridge and the adapter of `ciplink`, in turn.
//!
//! Both servers run in this process, each at an address of its own. A client is a thread with a plain socket and one
//! request under way: it sends a Get_Attribute_Single of the product name and waits for the whole answer. A third server
//! parses nothing and sends the same octets each time, from one blocking thread a stream: what sockets alone cost.
//!
//! ```text
//! axisbridge-peer-bench [REQUESTS] [RUNS]     each client sends REQUESTS (20000) in each of RUNS (5)
//! ```

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, TcpListener, TcpStream};
use std::sync::{Arc, Barrier};
use std::thread;
use std::time::{Duration, Instant};

use arrayvec::{ArrayString, ArrayVec};
use axisbridge::north::{self, ExplicitServer, motion_link};
use ciplink::adapter::{Adapter as OtherAdapter, AdapterConfig as OtherConfig, AdapterIdentity};
use profile_cip::device::adapter::Adapter;
use profile_cip::device::config::{
    AdapterConfig, DEVICE_TYPE_CIP_MOTION_DRIVE, IdentityConfig, InterfaceConfig, LinkConfig, MotionConfig,
    QosConfig,
};
use profile_cip::device::ethernet_link::{InterfaceType, LinkState};
use profile_cip::wire::motion::Format;

const OURS: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 41);
const OTHER: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 42);
const PRODUCT: &str = "A product";
/// Requests before the measurement.
const WARM_UP: usize = 500;
/// An answer that takes longer ends the program.
const LIMIT: Duration = Duration::from_secs(10);
/// Octets of an encapsulation header.
const HEADER_LEN: usize = 24;

/// RegisterSession, version 1.
const REGISTER: [u8; 28] = {
    let mut packet = [0; 28];
    (packet[0], packet[2], packet[24]) = (0x65, 4, 1);
    packet
};

/// SendRRData with Get_Attribute_Single of Identity, instance 1, attribute 7.
fn request(session: [u8; 4]) -> Vec<u8> {
    let message = [0x0E, 3, 0x20, 1, 0x24, 1, 0x30, 7];
    let mut packet = vec![0x6F, 0, 24, 0];
    packet.extend(session);
    packet.extend([0; 16]);
    // Interface and time-out, then two items: no address, and the message.
    packet.extend([0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0xB2, 0, 8, 0]);
    packet.extend(message);
    packet
}

/// Reads one encapsulation packet; gives its length.
fn answer(stream: &mut TcpStream, buffer: &mut [u8]) -> usize {
    let mut have = 0;
    loop {
        let count = stream.read(&mut buffer[have..]).expect("an answer in time");
        assert_ne!(count, 0, "the server closed the stream");
        have += count;
        if have >= HEADER_LEN {
            let len = HEADER_LEN + usize::from(u16::from_le_bytes([buffer[2], buffer[3]]));
            if have >= len {
                assert_eq!(have, len, "one answer to one request");
                return len;
            }
        }
    }
}

/// Round trip times of one client, in nanoseconds.
fn client(address: SocketAddr, requests: usize, start: &Barrier) -> Vec<u64> {
    let mut stream = TcpStream::connect(address).expect("the server listens");
    stream.set_nodelay(true).expect("a TCP socket");
    stream.set_read_timeout(Some(LIMIT)).expect("a TCP socket");
    let mut buffer = [0; 512];
    stream.write_all(&REGISTER).expect("a stream");
    answer(&mut stream, &mut buffer);
    let request = request([buffer[4], buffer[5], buffer[6], buffer[7]]);
    let mut trip = || {
        let sent = Instant::now();
        stream.write_all(&request).expect("a stream");
        let len = answer(&mut stream, &mut buffer);
        let took = sent.elapsed();
        assert!(buffer[..len].ends_with(PRODUCT.as_bytes()), "the product name: {:02x?}", &buffer[..len]);
        u64::try_from(took.as_nanos()).expect("less than centuries")
    };
    for _ in 0..WARM_UP {
        trip();
    }
    start.wait();
    (0..requests).map(|_| trip()).collect()
}

/// One run of so many clients at once, as a line.
fn run(name: &str, address: SocketAddr, clients: usize, requests: usize) {
    let start = Arc::new(Barrier::new(clients + 1));
    let threads: Vec<_> = (0..clients)
        .map(|_| {
            let start = Arc::clone(&start);
            thread::spawn(move || client(address, requests, &start))
        })
        .collect();
    start.wait();
    let begun = Instant::now();
    let mut times: Vec<u64> =
        threads.into_iter().flat_map(|thread| thread.join().expect("a client that ends well")).collect();
    let took = begun.elapsed();
    times.sort_unstable();
    let at = |permille: usize| times[(times.len() - 1) * permille / 1000] / 100;
    let us = |tenths: u64| format!("{}.{}", tenths / 10, tenths % 10);
    let rate = times.len() as u128 * 1_000_000 / took.as_micros().max(1);
    println!("{name:<10} {clients:>7} {rate:>8} {:>8} {:>8} {:>8}", us(at(500)), us(at(990)), us(at(999)));
}

/// Answers every packet with octets that stand ready.
fn bare_server() -> SocketAddr {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
    let address = listener.local_addr().expect("a bound socket");
    let mut reply = vec![0x6F, 0, u8::try_from(PRODUCT.len()).expect("a short name"), 0];
    reply.resize(HEADER_LEN, 0);
    reply.extend(PRODUCT.as_bytes());
    thread::spawn(move || {
        for stream in listener.incoming() {
            let (mut stream, reply) = (stream.expect("a stream"), reply.clone());
            stream.set_nodelay(true).expect("a TCP socket");
            thread::spawn(move || {
                let mut buffer = [0; 512];
                while stream.read(&mut buffer).is_ok_and(|len| len > 0) {
                    let sent = stream.write_all(if buffer[0] == REGISTER[0] { &REGISTER } else { &reply });
                    sent.expect("a stream");
                }
            });
        }
    });
    address
}

/// The adapter that a box with one axis has.
fn adapter() -> Adapter {
    Adapter::new(AdapterConfig {
        identity: IdentityConfig {
            vendor: 1,
            device_type: DEVICE_TYPE_CIP_MOTION_DRIVE,
            product_code: 7,
            major: 1,
            minor: 1,
            serial_number: 1,
            product_name: ArrayString::from(PRODUCT).expect("a short name"),
            configuration: 0,
        },
        interface: InterfaceConfig::new(OURS, Ipv4Addr::new(255, 0, 0, 0)),
        link: LinkConfig {
            mac: [2, 0, 0, 0, 0, 9],
            label: ArrayString::from("north").expect("a short name"),
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
            power_structure_class_id: 0,
            power_structure_axis_ids: ArrayVec::from_iter([0x11]),
        },
        assembly: None,
        eds: Arc::new([]),
        incarnation: 1,
    })
    .expect("a sound configuration")
}

fn main() {
    let mut arguments = std::env::args().skip(1).map(|number| number.parse().expect("a number"));
    let requests = arguments.next().unwrap_or(20_000);
    let runs = arguments.next().unwrap_or(5);

    // As `axisbridge run` has it.
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .expect("a runtime");
    let inside = runtime.enter();
    let (link, _device) = motion_link();
    let server = ExplicitServer::bind_port(SocketAddrV4::new(OURS, 0), adapter(), link, None);
    let ours = north::spawn(server.expect("a free port")).expect("a thread");

    let other = OtherAdapter::start(OtherConfig {
        identity: AdapterIdentity { product_name: PRODUCT.into(), ..AdapterIdentity::default() },
        bind: OTHER,
        port: 0,
        io_port: 0,
        ..OtherConfig::default()
    })
    .expect("a free port");

    let bare = bare_server();

    println!("server     clients  trips/s   p50 us   p99 us p99.9 us");
    for clients in [1, 4] {
        for _ in 0..runs {
            run("axisbridge", SocketAddr::V4(ours.address()), clients, requests);
            run("ciplink", other.addr(), clients, requests);
            run("sockets", bare, clients, requests);
        }
    }
    other.stop();
    runtime.block_on(ours.stop());
    drop(inside);
}
