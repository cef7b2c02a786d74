//! Which network interface of this host has an address.

use std::io;
use std::net::Ipv4Addr;

use nix::ifaddrs::getifaddrs;
use nix::sys::socket::SockaddrStorage;

/// An IPv4 address of an interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InterfaceAddress {
    /// Name of the interface.
    pub name: String,
    /// IPv4 address of the interface.
    pub address: Ipv4Addr,
    /// Its subnet mask.
    pub netmask: Ipv4Addr,
}

/// All IPv4 addresses of this host.
///
/// # Errors
/// What the system says.
pub fn addresses() -> io::Result<Vec<InterfaceAddress>> {
    let ip = |address: Option<SockaddrStorage>| Some(address?.as_sockaddr_in()?.ip());
    let found = getifaddrs()?.filter_map(|entry| {
        let (address, netmask) = (ip(entry.address)?, ip(entry.netmask)?);
        Some(InterfaceAddress { name: entry.interface_name, address, netmask })
    });
    Ok(found.collect())
}

/// Name of the interface with this IPv4 address; `None` when there is none.
#[must_use]
pub fn name_of(address: Ipv4Addr) -> Option<String> {
    addresses().ok()?.into_iter().find(|known| known.address == address).map(|known| known.name)
}

/// Hardware address of an interface of Ethernet; `None` for one without, or that is not there.
#[must_use]
pub fn mac(name: &str) -> Option<[u8; 6]> {
    let of_link = |entry: nix::ifaddrs::InterfaceAddress| entry.address?.as_link_addr()?.addr();
    getifaddrs().ok()?.filter(|entry| entry.interface_name == name).find_map(of_link)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loopback_interface_has_its_address() {
        let loopback = InterfaceAddress {
            name: "lo".to_owned(),
            address: Ipv4Addr::LOCALHOST,
            netmask: Ipv4Addr::new(255, 0, 0, 0),
        };
        let all = addresses().unwrap();
        assert!(all.contains(&loopback), "{all:?}");
        assert_eq!(name_of(Ipv4Addr::LOCALHOST).as_deref(), Some("lo"));
        assert_eq!(name_of(Ipv4Addr::new(192, 0, 2, 255)), None);
        assert_eq!((mac("lo"), mac("no-such")), (Some([0; 6]), None));
    }
}
