//! Network interfaces of the buses, and addresses of the devices.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, UdpSocket};
use std::path::Path;

use super::{Check, Verdict};
use crate::config::{CanLink, Config, Link};
use crate::sys::can_interface::{self, State};
use crate::sys::ethtool::{self, Features};
use crate::sys::interfaces;
use crate::sys::link::LinkState;
use crate::sys::packet_socket::{ETHER_TYPE_SERCOS, OpenError, PacketSocket};
use profile_generic::can::timing::BitRate;

const AREA: &str = "network";

/// Speed and duplex that SERCOS III has at least.
const SPEED_MIN: u32 = 100;

/// Frames that the box sends in a cycle: SYNC, and for each drive its RPDOs and a message of commissioning.
const FRAMES_OF_A_DRIVE: usize = 4;

/// TCP port of EtherNet/IP.
const ENCAPSULATION_PORT: u16 = 44818;

/// `ARPHRD_ETHER`.
const TYPE_ETHERNET: &str = "1";

/// The interfaces of the buses and the addresses of the devices; without a configuration what every Ethernet interface is.
pub(super) fn checks(root: &Path, config: Option<&Config>) -> Vec<Check> {
    let Some(config) = config else {
        let mut checks = vec![permission()];
        for name in ethernet_interfaces(root) {
            checks.push(wire(&name, &Wire::of(root, &name)));
        }
        return checks;
    };
    let mut checks = Vec::new();
    let mut simulated = false;
    match config.sercos.as_ref().map(|sercos| &sercos.link) {
        Some(Link::Interface { name, ring }) => {
            for name in std::iter::once(name).chain(ring) {
                checks.extend(sercos(root, name));
            }
        }
        Some(Link::InProcess { .. }) => simulated = true,
        None => {}
    }
    let can_open = config.can.iter().map(|bus| (&bus.link, bus.bit_rate, bus.drives.len()));
    let devicenet = config.devicenet.iter().map(|bus| (&bus.link, bus.bit_rate(), bus.drives.len()));
    for (link, bit_rate, drives) in can_open.chain(devicenet) {
        match link {
            CanLink::Interface { name, set_bit_rate } => {
                checks.push(can(name, bit_rate, *set_bit_rate));
                if !set_bit_rate && let Ok(state) = can_interface::state(name) {
                    checks.extend(left_to_the_user(name, &state, drives));
                }
            }
            CanLink::InProcess => simulated = true,
        }
    }
    if simulated {
        checks.push(Check::good(AREA, "simulated drives", "in the process: no interface is needed"));
    }
    for device in &config.devices {
        let at = SocketAddr::from((device.listen, ENCAPSULATION_PORT));
        checks.push(address(&format!("device {}", device.name), at));
    }
    if let Some(modbus) = &config.modbus {
        checks.push(address("Modbus", modbus.listen));
    }
    if let Some(http) = &config.http {
        checks.push(address("HTTP", http.listen));
    }
    checks
}

/// Whether packet sockets may be opened at all. The loopback interface carries no frames of a bus, so nothing is disturbed.
fn permission() -> Check {
    let what = "raw frames";
    match PacketSocket::open("lo", ETHER_TYPE_SERCOS) {
        Err(OpenError::NotPermitted { .. }) => not_permitted(what),
        _ => Check::good(AREA, what, "permitted"),
    }
}

fn not_permitted(what: &str) -> Check {
    let advice = "needs CAP_NET_RAW (run as root, or `setcap cap_net_raw+ep` on the program)";
    Check::unfit(AREA, what, "not permitted", advice)
}

fn ethernet_interfaces(root: &Path) -> Vec<String> {
    let Ok(folder) = std::fs::read_dir(root.join("sys/class/net")) else { return Vec::new() };
    let names = folder.flatten().filter(|entry| {
        std::fs::read_to_string(entry.path().join("type")).is_ok_and(|kind| kind.trim() == TYPE_ETHERNET)
    });
    let mut names: Vec<String> =
        names.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable();
    names
}

/// An interface of the SERCOS III master, opened as the box will open it.
fn sercos(root: &Path, name: &str) -> Vec<Check> {
    let what = format!("interface {name}");
    let socket = match PacketSocket::open(name, ETHER_TYPE_SERCOS) {
        Ok(socket) => socket,
        Err(OpenError::NotPermitted { .. }) => return vec![not_permitted(&what)],
        Err(error) => {
            let advice = "[south.sercos] interface, ring_interface; `ip link` shows what there is";
            return vec![Check::unfit(AREA, what, error.to_string(), advice)];
        }
    };
    let mut checks = vec![match socket.link_state() {
        LinkState::Up => Check::good(AREA, &what, "up"),
        LinkState::NoCarrier => {
            Check::doubtful(AREA, &what, "no carrier", "plug the cable in; the slaves have to be on")
        }
        LinkState::Down | LinkState::Gone => {
            Check::unfit(AREA, &what, "went down", format!("ip link set {name} up"))
        }
    }];
    let facts = Wire::of(root, name);
    checks.push(wire(name, &facts));
    checks.push(stamps(name, socket.has_time_stamps(), &facts.features));
    checks.push(sending(name, &socket));
    checks.push(own_traffic(name, &facts));
    checks
}

/// Who sends the telegrams at their instant.
fn sending(name: &str, socket: &PacketSocket) -> Check {
    let who = if socket.launches() {
        "at the instant of the cycle, by the discipline etf"
    } else {
        "when the cycle thread wakes up; with the discipline etf on the interface, the kernel or the card holds each frame until \
         its instant (docs/tasks/prepare-the-host.md)"
    };
    Check::good(AREA, format!("sending on {name}"), who)
}

/// What is known of an Ethernet interface.
#[derive(Debug, Default)]
struct Wire {
    speed_mbit: Option<u32>,
    half_duplex: bool,
    features: Features,
    addresses: Vec<Ipv4Addr>,
    ipv6: bool,
}

impl Wire {
    fn of(root: &Path, name: &str) -> Self {
        let file =
            |path: String| std::fs::read_to_string(root.join(path)).ok().map(|text| text.trim().to_owned());
        let port = |what: &str| file(format!("sys/class/net/{name}/{what}"));
        let all = interfaces::addresses().unwrap_or_default();
        Self {
            // Without a link the kernel says -1, and virtual interfaces say it or nothing.
            speed_mbit: port("speed").and_then(|speed| speed.parse().ok()),
            half_duplex: port("duplex").as_deref() == Some("half"),
            features: ethtool::features(name).unwrap_or_default(),
            addresses: all.into_iter().filter(|one| one.name == name).map(|one| one.address).collect(),
            ipv6: file(format!("proc/sys/net/ipv6/conf/{name}/disable_ipv6")).as_deref() == Some("0"),
        }
    }
}

/// Speed, and what delays frames.
fn wire(name: &str, wire: &Wire) -> Check {
    let what = format!("wire of {name}");
    let Features { driver, coalescing_us, energy_efficient, .. } = &wire.features;
    let mut found = vec![driver.clone().unwrap_or_else(|| "driver unknown".to_owned())];
    found.extend(wire.speed_mbit.map(|speed| format!("{speed} Mbit/s")));
    if wire.half_duplex {
        found.push("half duplex".to_owned());
    }
    let mut advice = Vec::new();
    if let Some((receive, send)) = coalescing_us.filter(|both| *both != (0, 0)) {
        found.push(format!("interrupts held back {receive} us received, {send} us sent"));
        advice.push(format!("ethtool -C {name} adaptive-rx off rx-usecs 0 tx-usecs 0"));
    }
    if *energy_efficient == Some(true) {
        found.push("Energy Efficient Ethernet".to_owned());
        advice.push(format!("ethtool --set-eee {name} eee off"));
    }
    let found = found.join(", ");
    if wire.half_duplex || wire.speed_mbit.is_some_and(|speed| speed < SPEED_MIN) {
        return Check::unfit(AREA, what, found, "SERCOS III needs 100 Mbit/s, full duplex");
    }
    match advice.as_slice() {
        [] => Check::good(AREA, what, found),
        advice => Check::doubtful(AREA, what, found, advice.join("; ")),
    }
}

/// Who stamps received frames: recordings show it.
fn stamps(name: &str, granted: bool, features: &Features) -> Check {
    let what = format!("time stamps of {name}");
    let hardware = features.time_stamps.is_some_and(|stamps| stamps.hardware);
    match (granted, hardware) {
        (true, true) => Check::good(AREA, what, "by the kernel; those of the card are for PTP alone"),
        (true, false) => Check::good(AREA, what, "by the kernel"),
        (false, _) => Check::doubtful(
            AREA,
            what,
            "none",
            "recordings show when Axisbridge read a frame, which is later",
        ),
    }
}

/// Whether the host itself talks on the wire: its frames go out whenever it likes, in the middle of a cycle too.
fn own_traffic(name: &str, wire: &Wire) -> Check {
    let what = format!("other traffic on {name}");
    let mut found: Vec<String> = wire.addresses.iter().map(ToString::to_string).collect();
    let mut advice = Vec::new();
    if !found.is_empty() {
        advice.push(format!("ip addr flush dev {name}"));
    }
    if wire.ipv6 {
        found.push("IPv6".to_owned());
        advice.push(format!("sysctl net.ipv6.conf.{name}.disable_ipv6=1"));
    }
    match found.as_slice() {
        [] => Check::good(AREA, what, "none"),
        found => Check::doubtful(AREA, what, found.join(", "), advice.join("; ")),
    }
}

/// A CAN interface: whether it is there and has, or can be given, the bit rate of the bus.
fn can(name: &str, wanted: BitRate, set_bit_rate: bool) -> Check {
    let what = format!("interface {name}");
    let state = match can_interface::state(name) {
        Ok(state) => state,
        Err(error) => {
            let advice = "[[south.can]] or [[south.devicenet]] interface; `ip link` shows what there is";
            return Check::unfit(AREA, what, error.to_string(), advice);
        }
    };
    let found = format!("{}, {state}", if state.link == LinkState::Down { "down" } else { "up" });
    let by_hand =
        format!("ip link set {name} down; ip link set {name} up type can bitrate {}", wanted.nominal());
    match (state.link, state.has_bit_rate) {
        (LinkState::Gone, _) => Check::unfit(AREA, what, "gone", "`ip link` shows what there is"),
        (LinkState::Down, true) if set_bit_rate => {
            Check::good(AREA, what, format!("{found}; the gateway sets it up"))
        }
        (LinkState::Down, _) => Check::unfit(AREA, what, found, by_hand),
        (_, true) if !state.has(wanted) => {
            Check::unfit(AREA, what, format!("{found}, expected {wanted}"), by_hand)
        }
        (_, true) => Check::good(AREA, what, found),
        (_, false) => Check::good(AREA, what, "virtual: no bit rate"),
    }
}

/// What the box would set of a CAN interface and leaves to the user here.
fn left_to_the_user(name: &str, state: &State, drives: usize) -> Vec<Check> {
    let mut checks = Vec::new();
    let frames = 1 + FRAMES_OF_A_DRIVE * drives;
    if usize::try_from(state.queue).is_ok_and(|queue| queue < frames) {
        let found = format!("{} frames, the gateway may send {frames} in a cycle", state.queue);
        let advice = format!("ip link set {name} txqueuelen 128, or set_bit_rate");
        checks.push(Check::doubtful(AREA, format!("transmit queue of {name}"), found, advice));
    }
    if state.has_bit_rate && !state.restarts() {
        let advice = format!("ip link set {name} type can restart-ms 100 while it is down, or set_bit_rate");
        let found = "none: it stays off the bus";
        checks.push(Check::doubtful(AREA, format!("restart of {name} after bus off"), found, advice));
    }
    checks
}

/// Whether the box can listen there.
fn address(what: &str, at: SocketAddr) -> Check {
    let found = |text: &str| format!("{at}: {text}");
    let there = UdpSocket::bind((at.ip(), 0)).map(drop);
    match there.and_then(|()| TcpListener::bind(at).map(drop)) {
        Ok(()) => Check::good(AREA, what, found("free")),
        Err(error) if error.kind() == ErrorKind::AddrInUse => Check::doubtful(
            AREA,
            what,
            found("in use"),
            "another process listens there: is a gateway running already?",
        ),
        Err(error) if error.kind() == ErrorKind::AddrNotAvailable => {
            let advice = format!("no interface of this host has it: ip addr add {}/24 dev IF", at.ip());
            Check::unfit(AREA, what, found("not an address of this host"), advice)
        }
        Err(error) => {
            let advice = "ports below 1024 need CAP_NET_BIND_SERVICE";
            Check {
                verdict: Verdict::Unfit,
                ..Check::doubtful(AREA, what, found(&error.to_string()), advice)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sys::ethtool::TimeStamps;

    fn told(check: &Check) -> (Verdict, &str, Option<&str>) {
        (check.verdict, &check.found, check.advice.as_deref())
    }

    #[test]
    fn a_can_interface_that_the_user_sets_up_wants_a_queue_and_a_restart() {
        let state = State {
            index: 3,
            link: LinkState::Up,
            has_bit_rate: true,
            nominal: Some(1_000_000),
            sample_point: None,
            data: None,
            fd: false,
            state: None,
            restart_ms: Some(0),
            errors: None,
            queue: 10,
        };
        let checks = |state: &State, drives| {
            let checks = left_to_the_user("can0", state, drives);
            checks.iter().map(|check| format!("{}: {}", check.what, check.found)).collect::<Vec<_>>()
        };
        let none = "restart of can0 after bus off: none: it stays off the bus";
        assert_eq!(checks(&state, 2), [none]);
        let short = "transmit queue of can0: 10 frames, the gateway may send 13 in a cycle";
        assert_eq!(checks(&state, 3), [short, none]);
        assert_eq!(checks(&State { restart_ms: Some(100), queue: 13, ..state }, 3), [""; 0]);
        // A virtual interface is never off the bus.
        assert_eq!(
            checks(&State { has_bit_rate: false, restart_ms: None, queue: 1000, ..state }, 3),
            [""; 0]
        );
    }

    #[test]
    fn a_wire_is_judged_by_speed_and_by_what_holds_frames_back() {
        let good = Wire {
            speed_mbit: Some(100),
            features: Features {
                driver: Some("igb".to_owned()),
                coalescing_us: Some((0, 0)),
                ..Features::default()
            },
            ..Wire::default()
        };
        assert_eq!(told(&wire("eth1", &good)), (Verdict::Good, "igb, 100 Mbit/s", None));
        let features =
            Features { coalescing_us: Some((3, 0)), energy_efficient: Some(true), ..good.features.clone() };
        let slow_to_tell = Wire { features, ..good };
        let check = wire("eth1", &slow_to_tell);
        assert_eq!(
            told(&check),
            (
                Verdict::Doubtful,
                "igb, 100 Mbit/s, interrupts held back 3 us received, 0 us sent, Energy Efficient Ethernet",
                Some("ethtool -C eth1 adaptive-rx off rx-usecs 0 tx-usecs 0; ethtool --set-eee eth1 eee off")
            )
        );
        for bad in [
            Wire { speed_mbit: Some(10), ..Wire::default() },
            Wire { speed_mbit: Some(100), half_duplex: true, ..Wire::default() },
        ] {
            assert_eq!(wire("eth1", &bad).verdict, Verdict::Unfit, "{bad:?}");
        }
        assert_eq!(told(&wire("eth1", &Wire::default())), (Verdict::Good, "driver unknown", None));
    }

    #[test]
    fn what_the_host_itself_would_send_is_told() {
        let quiet = Wire::default();
        assert_eq!(told(&own_traffic("eth1", &quiet)), (Verdict::Good, "none", None));
        let loud = Wire { addresses: vec![Ipv4Addr::new(192, 0, 2, 1)], ipv6: true, ..Wire::default() };
        let advice = "ip addr flush dev eth1; sysctl net.ipv6.conf.eth1.disable_ipv6=1";
        assert_eq!(told(&own_traffic("eth1", &loud)), (Verdict::Doubtful, "192.0.2.1, IPv6", Some(advice)));
    }

    #[test]
    fn who_stamps_is_told() {
        let card = Features {
            time_stamps: Some(TimeStamps { hardware: true, software: true }),
            ..Features::default()
        };
        assert_eq!(stamps("eth1", true, &Features::default()).found, "by the kernel");
        assert!(stamps("eth1", true, &card).found.starts_with("by the kernel; those of the card"));
        assert_eq!(stamps("eth1", false, &card).verdict, Verdict::Doubtful);
    }

    #[test]
    fn interfaces_that_are_not_there_are_unfit_by_name() {
        let check = &sercos(Path::new("/"), "axb-none")[0];
        let said = "there is no network interface `axb-none`";
        assert_eq!((check.verdict, check.what.as_str()), (Verdict::Unfit, "interface axb-none"));
        assert_eq!(check.found, said);
        let check = can("axb-none", BitRate::MAX_CLASSIC, true);
        assert_eq!((check.verdict, check.found.as_str()), (Verdict::Unfit, said));
    }

    #[test]
    fn addresses_are_free_taken_or_of_another_host() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let taken = listener.local_addr().unwrap();
        assert_eq!(address("device a", taken).verdict, Verdict::Doubtful);
        drop(listener);
        let check = address("device a", taken);
        assert_eq!(told(&check), (Verdict::Good, format!("{taken}: free").as_str(), None));
        // An address for documentation, which nobody has.
        let check = address("device a", "192.0.2.77:44818".parse().unwrap());
        assert_eq!(check.verdict, Verdict::Unfit);
        assert_eq!(check.found, "192.0.2.77:44818: not an address of this host");
    }
}
