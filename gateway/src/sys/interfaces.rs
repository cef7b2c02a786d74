//! Which network interface of this host has an address.
#![allow(unsafe_code)]

use std::ffi::CStr;
use std::io;
use std::net::Ipv4Addr;

/// An IPv4 address of an interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InterfaceAddress {
    /// Name of the interface.
    pub name: String,
    /// The address.
    pub address: Ipv4Addr,
    /// Its subnet mask.
    pub netmask: Ipv4Addr,
}

/// All IPv4 addresses of this host.
///
/// # Errors
/// What the system says.
pub fn addresses() -> io::Result<Vec<InterfaceAddress>> {
    let mut head: *mut libc::ifaddrs = std::ptr::null_mut();
    // SAFETY: `head` is writable; on success it points to a list that is freed below and not used afterwards.
    if unsafe { libc::getifaddrs(&raw mut head) } != 0 {
        return Err(io::Error::last_os_error());
    }
    let mut found = Vec::new();
    let mut entry = head;
    while !entry.is_null() {
        // SAFETY: every entry of the list is a valid `ifaddrs` until the list is freed.
        let one = unsafe { &*entry };
        // SAFETY: the addresses of an entry are null or point to socket addresses of the family they name.
        let (address, netmask) = unsafe { (ipv4(one.ifa_addr), ipv4(one.ifa_netmask)) };
        if let (Some(address), Some(netmask), false) = (address, netmask, one.ifa_name.is_null()) {
            // SAFETY: the name is a C string that lives as long as the list.
            let name = unsafe { CStr::from_ptr(one.ifa_name) }.to_string_lossy().into_owned();
            found.push(InterfaceAddress { name, address, netmask });
        }
        entry = one.ifa_next;
    }
    // SAFETY: `head` came from getifaddrs, and nothing borrowed from the list is left.
    unsafe { libc::freeifaddrs(head) };
    Ok(found)
}

/// The address behind a socket address, if it is one of IPv4.
///
/// # Safety
/// `address` must be null or point to a socket address that is as long as its family says.
unsafe fn ipv4(address: *const libc::sockaddr) -> Option<Ipv4Addr> {
    // SAFETY: the caller promises a socket address where the pointer is not null; its family comes first in any.
    if address.is_null() || i32::from(unsafe { (*address).sa_family }) != libc::AF_INET {
        return None;
    }
    // SAFETY: of this family, it is a `sockaddr_in`; it need not be aligned for it.
    let address = unsafe { address.cast::<libc::sockaddr_in>().read_unaligned() };
    Some(Ipv4Addr::from_bits(u32::from_be(address.sin_addr.s_addr)))
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
    }
}
