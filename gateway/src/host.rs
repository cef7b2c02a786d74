//! What the host tells of the network port a device listens at: for the TCP/IP Interface and Ethernet Link objects.
//!
//! Everything comes from text files of the kernel, which an unprivileged process may read. What is not there is left at
//! "unknown"; nothing of it keeps the box from running. Name servers and domain stay empty: the device resolves no names.

use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};

use arrayvec::ArrayString;
use profile_cip::device::config::AdapterConfig;
use profile_cip::device::ethernet_link::{InterfaceCounters, InterfaceType, LinkState, MediaCounters};

use crate::sys::interfaces::{self, InterfaceAddress};

/// `IFF_UP` of the interface flags.
const FLAG_UP: u64 = 1;
/// `ARPHRD_LOOPBACK` of the interface types.
const TYPE_LOOPBACK: u64 = 772;
/// `RTF_GATEWAY` of the routing table's flags.
const ROUTE_GATEWAY: u32 = 2;

/// The port with a certain address.
#[derive(Debug, Clone)]
pub struct HostPort {
    root: PathBuf,
    interface: String,
    netmask: Ipv4Addr,
}

impl HostPort {
    /// The port whose interface has `address`, or whose subnet holds it, as the loopback interface's holds all of 127.
    #[must_use]
    pub fn find(address: Ipv4Addr) -> Option<Self> {
        let all = interfaces::addresses().unwrap_or_default();
        let one = choose(&all, address)?;
        Some(Self { root: PathBuf::from("/"), interface: one.name.clone(), netmask: one.netmask })
    }

    /// Name of the interface.
    #[must_use]
    pub fn interface(&self) -> &str {
        &self.interface
    }

    /// Fills in what does not change: mask, gateway, host name, MAC address, and how the port is now.
    pub fn describe(&self, config: &mut AdapterConfig) {
        config.interface.netmask = self.netmask;
        config.interface.gateway = self
            .file("proc/net/route")
            .and_then(|table| gateway(&table, &self.interface))
            .unwrap_or(Ipv4Addr::UNSPECIFIED);
        config.interface.host_name =
            fitting(self.file("proc/sys/kernel/hostname").unwrap_or_default().trim());
        // The files are those of the namespace that the process began in; the interface may be in another one.
        let told = self.of_port("address").and_then(|text| mac(&text));
        config.link.mac = told.or_else(|| interfaces::mac(&self.interface)).unwrap_or([0; 6]);
        config.link.interface_type = match self.number("type") {
            Some(TYPE_LOOPBACK) => InterfaceType::Internal,
            _ => InterfaceType::Unknown,
        };
        config.link.label = fitting(&self.interface);
        config.link.state = self.state();
    }

    /// How the port is now.
    #[must_use]
    pub fn state(&self) -> LinkState {
        let up = self.number("carrier") == Some(1);
        // A port without a link has no speed, and the kernel then says -1 or nothing.
        let speed = self.number("speed").filter(|_| up).and_then(|speed| u32::try_from(speed).ok());
        LinkState {
            up,
            enabled: self
                .of_port("flags")
                .and_then(|text| hexadecimal(&text))
                .is_some_and(|flags| flags & FLAG_UP != 0),
            speed_mbit: speed.unwrap_or(0),
            full_duplex: self.of_port("duplex").is_some_and(|text| text == "full"),
            counters: self.counters(),
            media: self.media(),
        }
    }

    fn counters(&self) -> Option<InterfaceCounters> {
        let (received, multicast) = (self.statistic("rx_packets")?, self.statistic("multicast").unwrap_or(0));
        let rest = |name| self.statistic(name).unwrap_or(0);
        Some(InterfaceCounters {
            in_octets: rest("rx_bytes"),
            in_unicast: received.saturating_sub(multicast),
            in_multicast: multicast,
            in_discards: rest("rx_dropped"),
            in_errors: rest("rx_errors"),
            in_unknown_protocols: rest("rx_nohandler"),
            out_octets: rest("tx_bytes"),
            out_unicast: rest("tx_packets"),
            // The kernel does not count multicasts apart when it sends them.
            out_multicast: 0,
            out_discards: rest("tx_dropped"),
            out_errors: rest("tx_errors"),
        })
    }

    fn media(&self) -> Option<MediaCounters> {
        let fcs_errors = self.statistic("rx_crc_errors")?;
        let rest = |name| self.statistic(name).unwrap_or(0);
        Some(MediaCounters {
            alignment_errors: rest("rx_frame_errors"),
            fcs_errors,
            // The kernel counts collisions without saying how many a frame had.
            single_collisions: rest("collisions"),
            multiple_collisions: 0,
            sqe_test_errors: rest("tx_heartbeat_errors"),
            deferred: 0,
            late_collisions: rest("tx_window_errors"),
            excessive_collisions: rest("tx_aborted_errors"),
            mac_transmit_errors: rest("tx_fifo_errors"),
            carrier_sense_errors: rest("tx_carrier_errors"),
            frames_too_long: rest("rx_length_errors"),
            mac_receive_errors: rest("rx_missed_errors") + rest("rx_fifo_errors"),
        })
    }

    fn file(&self, path: &str) -> Option<String> {
        std::fs::read_to_string(self.root.join(path)).ok()
    }

    fn of_port(&self, name: &str) -> Option<String> {
        let path = Path::new("sys/class/net").join(&self.interface).join(name);
        std::fs::read_to_string(self.root.join(path)).ok().map(|text| text.trim().to_owned())
    }

    fn number(&self, name: &str) -> Option<u64> {
        self.of_port(name)?.parse().ok()
    }

    fn statistic(&self, name: &str) -> Option<u64> {
        self.number(&format!("statistics/{name}"))
    }
}

fn choose(all: &[InterfaceAddress], address: Ipv4Addr) -> Option<&InterfaceAddress> {
    let same_subnet = |one: &&InterfaceAddress| {
        one.address.to_bits() & one.netmask.to_bits() == address.to_bits() & one.netmask.to_bits()
    };
    all.iter().find(|one| one.address == address).or_else(|| all.iter().find(same_subnet))
}

/// The default gateway of an interface out of the kernel's table: addresses are hexadecimal, in the memory order of the
/// host.
fn gateway(table: &str, interface: &str) -> Option<Ipv4Addr> {
    table.lines().skip(1).find_map(|line| {
        let mut fields = line.split_whitespace();
        let (name, destination, gateway, flags) =
            (fields.next()?, fields.next()?, fields.next()?, fields.next()?);
        let flags = u32::from_str_radix(flags, 16).ok()?;
        if name != interface || destination != "00000000" || flags & ROUTE_GATEWAY == 0 {
            return None;
        }
        Some(Ipv4Addr::from(u32::from_str_radix(gateway, 16).ok()?.to_ne_bytes()))
    })
}

fn mac(text: &str) -> Option<[u8; 6]> {
    let mut octets = [0; 6];
    let mut parts = text.split(':');
    for octet in &mut octets {
        *octet = u8::from_str_radix(parts.next()?, 16).ok()?;
    }
    parts.next().is_none().then_some(octets)
}

fn hexadecimal(text: &str) -> Option<u64> {
    u64::from_str_radix(text.strip_prefix("0x")?, 16).ok()
}

/// As much of a text as there is room for.
fn fitting<const N: usize>(text: &str) -> ArrayString<N> {
    let mut fitting = ArrayString::new();
    for character in text.chars().filter(char::is_ascii) {
        if fitting.try_push(character).is_err() {
            break;
        }
    }
    fitting
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(name: &str, address: [u8; 4], netmask: [u8; 4]) -> InterfaceAddress {
        InterfaceAddress { name: name.to_owned(), address: address.into(), netmask: netmask.into() }
    }

    #[test]
    fn the_interface_with_the_address_comes_before_one_with_its_subnet() {
        let all = [
            address("lo", [127, 0, 0, 1], [255, 0, 0, 0]),
            address("eth0", [10, 0, 0, 1], [255, 255, 255, 0]),
            address("eth1", [10, 0, 0, 9], [255, 255, 255, 0]),
        ];
        let of = |ip: [u8; 4]| choose(&all, ip.into()).map(|one| one.name.as_str());
        assert_eq!(of([10, 0, 0, 9]), Some("eth1"));
        assert_eq!(of([10, 0, 0, 7]), Some("eth0"));
        assert_eq!(of([127, 0, 0, 2]), Some("lo"));
        assert_eq!(of([192, 0, 2, 1]), None);
    }

    #[test]
    fn the_default_gateway_of_an_interface() {
        let table = "Iface\tDestination\tGateway\tFlags\n\
                     eth0\t0000000A\t00000000\t0001\n\
                     eth1\t00000000\t0100A8C0\t0003\n\
                     eth0\t00000000\t0100000A\t0003\n\
                     eth0\t00000000\tnonsense\t0003\n";
        let expected = |ip: [u8; 4]| Some(Ipv4Addr::from(ip)).filter(|_| cfg!(target_endian = "little"));
        if cfg!(target_endian = "little") {
            assert_eq!(gateway(table, "eth0"), expected([10, 0, 0, 1]));
            assert_eq!(gateway(table, "eth1"), expected([192, 168, 0, 1]));
        }
        assert_eq!(gateway(table, "eth2"), None);
        assert_eq!(gateway("", "eth0"), None);
    }

    /// A folder as the kernel would show it.
    fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
        let root = std::env::temp_dir().join(format!("axisbridge-host-{}-{name}", std::process::id()));
        for (path, text) in files {
            let path = root.join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        root
    }

    #[test]
    fn the_state_of_a_port() {
        const PORT: &str = "sys/class/net/eth7";
        let path = |name: &str| format!("{PORT}/{name}");
        let files = [
            (path("carrier"), "1\n"),
            (path("speed"), "1000\n"),
            (path("duplex"), "full\n"),
            (path("flags"), "0x1003\n"),
            (path("statistics/rx_packets"), "100\n"),
            (path("statistics/multicast"), "30\n"),
            (path("statistics/rx_bytes"), "5000000000\n"),
            (path("statistics/tx_packets"), "7\n"),
            (path("statistics/rx_crc_errors"), "4\n"),
            (path("statistics/rx_missed_errors"), "2\n"),
            (path("statistics/rx_fifo_errors"), "1\n"),
        ];
        let files: Vec<_> = files.iter().map(|(path, text)| (path.as_str(), *text)).collect();
        let root = folder("state", &files);
        let port =
            HostPort { root: root.clone(), interface: "eth7".to_owned(), netmask: Ipv4Addr::UNSPECIFIED };
        let state = port.state();
        let counters = InterfaceCounters {
            in_octets: 5_000_000_000,
            in_unicast: 70,
            in_multicast: 30,
            out_unicast: 7,
            ..InterfaceCounters::default()
        };
        let media = MediaCounters { fcs_errors: 4, mac_receive_errors: 3, ..MediaCounters::default() };
        assert_eq!(
            state,
            LinkState {
                up: true,
                enabled: true,
                speed_mbit: 1000,
                full_duplex: true,
                counters: Some(counters),
                media: Some(media),
            }
        );
        // The cable is pulled: the kernel says -1, and nothing of duplex.
        std::fs::write(root.join(path("carrier")), "0\n").unwrap();
        std::fs::write(root.join(path("speed")), "-1\n").unwrap();
        std::fs::remove_file(root.join(path("duplex"))).unwrap();
        let state = port.state();
        assert_eq!((state.up, state.enabled, state.speed_mbit, state.full_duplex), (false, true, 0, false));
        std::fs::remove_dir_all(&root).unwrap();
        // An interface that has gone, too.
        assert_eq!(port.state(), LinkState::default());
    }

    #[test]
    fn the_loopback_interface_of_this_host() {
        let port = HostPort::find(Ipv4Addr::new(127, 0, 0, 2)).unwrap();
        assert_eq!((port.interface(), port.netmask), ("lo", Ipv4Addr::new(255, 0, 0, 0)));
        let state = port.state();
        assert!(state.up && state.enabled && state.counters.is_some(), "{state:?}");
    }

    #[test]
    fn texts_are_cut_to_their_room() {
        assert_eq!(fitting::<4>("axis-1").as_str(), "axis");
        assert_eq!(fitting::<8>("\u{e4}xis").as_str(), "xis");
        assert_eq!(mac("02:00:00:00:00:0a"), Some([2, 0, 0, 0, 0, 10]));
        assert_eq!((mac("02:00"), mac("02:00:00:00:00:0a:01"), mac("zz:0:0:0:0:0")), (None, None, None));
    }
}
