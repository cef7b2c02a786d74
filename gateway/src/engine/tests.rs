//! What one device may do depends on the others: questions over all devices, without drives.

use std::net::{Ipv4Addr, SocketAddrV4};

use profile_cip::device::motion_link::{
    AssemblyOpen, AssemblyRole, CloseParameters, ConnectionTriad, MotionReply, MotionRequest, OpenParameters,
    Token,
};
use profile_cip::wire::network_parameters::Priority;
use profile_generic::inhibit::Inhibits;
use profile_generic::state::{Report, Request};

use super::build::{Built, Host, build};
use super::port::Datagram;
use super::*;
use crate::config::Config;
use crate::north::AdapterEnd;

/// A motion device, another one and one with assemblies, each with an axis of its own.
const CONFIGURATION: &str = r#"[box]
name = "three"

[[device]]
name = "front"
listen = "192.0.2.10"
axes = ["x"]
[device.identity]
vendor_id = 1
product_code = 2
serial_number = 3

[[device]]
name = "middle"
listen = "192.0.2.11"
axes = ["y"]
[device.identity]
vendor_id = 1
product_code = 2
serial_number = 4

[[device]]
name = "back"
listen = "192.0.2.12"
axes = ["z"]
assembly = {}
[device.identity]
vendor_id = 1
product_code = 3
serial_number = 5

[[axis]]
name = "x"
instance = 1
drive = "a"
unit = "revolution"

[[axis]]
name = "y"
instance = 1
drive = "b"
unit = "revolution"

[[axis]]
name = "z"
instance = 1
drive = "c"
unit = "revolution"
limits = { velocity = 20.0, acceleration = 100.0 }

[south.sercos]
interface = "in-process"
cycle_time = "2 ms"

[[south.sercos.drive]]
name = "a"
address = 1

[[south.sercos.drive]]
name = "b"
address = 2

[[south.sercos.drive]]
name = "c"
address = 3
"#;

const TRIAD: ConnectionTriad =
    ConnectionTriad { connection_serial: 1, originator_vendor: 2, originator_serial: 3 };

/// A port without a network.
struct Nothing;

impl NorthPort for Nothing {
    fn receive(&mut self, _: &mut [u8]) -> Option<Datagram> {
        None
    }

    fn send(&mut self, _: &[u8], _: SocketAddrV4) -> bool {
        true
    }
}

struct Three {
    engine: Engine,
    adapters: Vec<AdapterEnd>,
    now: MonotonicTime,
}

impl Three {
    fn new() -> Self {
        let config = Config::parse(CONFIGURATION, "three.toml").unwrap_or_else(|error| panic!("{error}"));
        let host = Host { mac: [2, 0, 0, 0, 0, 1], incarnation: 1 };
        let Built { engine, adapters, .. } =
            build(&config, Mapping::embedded().expect("tables"), host).expect("a gateway");
        let adapters = adapters.into_iter().map(|(_, end)| end).collect();
        Self { engine, adapters, now: MonotonicTime(1_000_000_000) }
    }

    /// The reply of a device to a request.
    fn ask(&mut self, device: usize, request: MotionRequest) -> MotionReply {
        self.adapters[device].request(request).expect("room");
        self.pass(DurationNs::from_millis(1));
        self.adapters[device].reply().expect("a reply")
    }

    /// A call of the engine after this time.
    fn pass(&mut self, time: DurationNs) {
        self.now = self.now + time;
        let mut ports = [Nothing, Nothing, Nothing];
        let mut ports: Vec<&mut dyn NorthPort> =
            ports.iter_mut().map(|port| port as &mut dyn NorthPort).collect();
        self.engine.cycle(self.now, &mut ports, &mut []);
    }

    /// Which of the devices would be started anew.
    fn granted(&mut self) -> [bool; 3] {
        [0, 1, 2].map(|device| match self.ask(device, MotionRequest::PrepareReset(Token(7))) {
            MotionReply::ResetPrepared { token: Token(7), granted } => granted,
            other => panic!("{other:?}"),
        })
    }
}

fn open() -> OpenParameters {
    OpenParameters {
        token: Token(8),
        triad: TRIAD,
        o_to_t_id: 4,
        t_to_o_id: 5,
        originator: Ipv4Addr::new(192, 0, 2, 1),
        t_to_o_destination: SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 2222),
        rpi_us: 4_000,
        timeout_us: 64_000,
        o_to_t_size: 200,
        t_to_o_size: 200,
        o_to_t_variable: true,
        t_to_o_variable: true,
        t_to_o_dscp: 0,
        format_revision: 2,
        configuration_bits: 0,
        assembly: None,
    }
}

#[test]
fn no_device_is_started_anew_while_an_axis_of_any_device_has_torque() {
    for axis in 0..3 {
        let mut three = Three::new();
        assert_eq!(three.granted(), [true; 3]);
        let (now, system) = (three.now, SystemTime(9));
        three.engine.axes[axis].set_inhibits(now, system, Inhibits::empty());
        three.engine.axes[axis].report(now, system, Report::Ready);
        three.engine.axes[axis].request(now, system, Request::Enable);
        assert!(three.engine.axes[axis].may_have_torque(), "axis {axis}");
        assert_eq!(three.granted(), [false; 3], "axis {axis}");
        three.engine.axes[axis].request(now, system, Request::Coast);
        three.engine.axes[axis].report(now, system, Report::Ready);
        assert_eq!(three.granted(), [true; 3], "axis {axis}");
    }
}

#[test]
fn no_device_is_started_anew_while_a_controller_is_connected_to_any_device() {
    let mut three = Three::new();
    let opened = three.ask(0, MotionRequest::Open(open()));
    assert_eq!(opened, MotionReply::Opened { token: Token(8), outcome: Ok(()) });
    assert_eq!(three.granted(), [false; 3]);
    let close = CloseParameters { token: Token(9), triad: TRIAD, o_to_t_id: 4 };
    assert_eq!(three.ask(0, MotionRequest::Close(close)), MotionReply::Closed { token: Token(9) });
    assert_eq!(three.granted(), [true; 3]);
}

/// Without the report the adapter would keep the connection open, and refuse every other controller.
#[test]
fn lost_connection_is_reported_once_the_queue_of_replies_has_room() {
    let assembly = AssemblyOpen {
        role: AssemblyRole::ExclusiveOwner,
        t_to_o_rpi_us: 4_000,
        t_to_o_priority: Priority::SCHEDULED,
        multicast: false,
    };
    for (device, assembly) in [(0, None), (2, Some(assembly))] {
        let mut three = Three::new();
        let opened = three.ask(device, MotionRequest::Open(OpenParameters { assembly, ..open() }));
        assert_eq!(opened, MotionReply::Opened { token: Token(8), outcome: Ok(()) });
        // Nobody takes the replies: there is room for 32.
        for token in 0..32 {
            three.adapters[device].request(MotionRequest::PrepareReset(Token(token))).expect("room");
            three.pass(DurationNs::from_millis(1));
        }
        // The controller has not sent anything for more than ten seconds.
        three.pass(DurationNs::from_secs(11));
        three.pass(DurationNs::from_millis(1));
        let kept: Vec<_> = std::iter::from_fn(|| three.adapters[device].reply()).collect();
        assert_eq!(kept.len(), 32, "device {device}");
        assert!(kept.iter().all(|reply| matches!(reply, MotionReply::ResetPrepared { .. })), "{kept:?}");
        three.pass(DurationNs::from_millis(1));
        let lost = three.adapters[device].reply();
        assert!(
            matches!(lost, Some(MotionReply::ConnectionLost { o_to_t_id: 4, .. })),
            "device {device}: {lost:?}"
        );
        three.pass(DurationNs::from_millis(1));
        assert_eq!(three.adapters[device].reply(), None, "device {device}: once");
    }
}
