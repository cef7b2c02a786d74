//! What the driver of a network interface says of itself (`SIOCETHTOOL`), for people who look for what delays frames.
//!
//! A driver answers the questions it knows; the others come back as `None`.
#![allow(unsafe_code)]

use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::os::fd::{AsFd, AsRawFd};

const SIOCETHTOOL: libc::c_ulong = 0x8946;

const ETHTOOL_GDRVINFO: u32 = 0x03;
const ETHTOOL_GCOALESCE: u32 = 0x0E;
const ETHTOOL_GET_TS_INFO: u32 = 0x41;
const ETHTOOL_GEEE: u32 = 0x44;

/// Words of the longest answer: that of `ETHTOOL_GDRVINFO` has 196 bytes.
const WORDS: usize = 64;
/// Place of the driver's name in `struct ethtool_drvinfo`, and its length in bytes.
const DRIVER: (usize, usize) = (1, 32);
/// Places of `rx_coalesce_usecs` and `tx_coalesce_usecs` in `struct ethtool_coalesce`.
const COALESCE: (usize, usize) = (1, 5);
/// Places of `so_timestamping` and `rx_filters` in `struct ethtool_ts_info`.
const STAMPS: usize = 1;
/// Place of `phc_index` in the same: the number of the card's clock, or -1.
const PHC_INDEX: usize = 2;
/// Place of `eee_enabled` in `struct ethtool_eee`.
const EEE_ENABLED: usize = 5;

/// `SOF_TIMESTAMPING_RX_HARDWARE` and `SOF_TIMESTAMPING_RX_SOFTWARE`.
const RX_HARDWARE: u32 = 1 << 2;
const RX_SOFTWARE: u32 = 1 << 3;

/// Who stamps received frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeStamps {
    /// The network card.
    pub hardware: bool,
    /// The kernel.
    pub software: bool,
}

/// What a driver says; `None` where it does not.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Features {
    /// Its name.
    pub driver: Option<String>,
    /// Who stamps received frames.
    pub time_stamps: Option<TimeStamps>,
    /// Number of the card's own clock, `/dev/ptpN`.
    pub clock: Option<u32>,
    /// How long it may hold back the interrupt of a received and of a sent frame, us.
    pub coalescing_us: Option<(u32, u32)>,
    /// Whether Energy Efficient Ethernet is on: then the link sleeps between frames and takes time to wake.
    pub energy_efficient: Option<bool>,
}

/// Asks the driver of an interface.
///
/// # Errors
/// The system gives no socket.
pub fn features(name: &str) -> io::Result<Features> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    let ask = |command| ask(&socket, name, command);
    Ok(Features {
        driver: ask(ETHTOOL_GDRVINFO).map(|answer| text(&answer)),
        time_stamps: ask(ETHTOOL_GET_TS_INFO).map(|answer| TimeStamps {
            hardware: answer[STAMPS] & RX_HARDWARE != 0,
            software: answer[STAMPS] & RX_SOFTWARE != 0,
        }),
        clock: ask(ETHTOOL_GET_TS_INFO)
            .map(|answer| answer[PHC_INDEX])
            .filter(|index| index.cast_signed() >= 0),
        coalescing_us: ask(ETHTOOL_GCOALESCE).map(|answer| (answer[COALESCE.0], answer[COALESCE.1])),
        energy_efficient: ask(ETHTOOL_GEEE).map(|answer| answer[EEE_ENABLED] != 0),
    })
}

/// Where the kernel finds question and answer.
#[repr(C)]
struct Request {
    name: [u8; libc::IFNAMSIZ],
    data: *mut [u32; WORDS],
    /// The kernel copies a whole `struct ifreq`, 40 bytes with 64 bit pointers and 32 with others.
    rest: [u8; 16],
}

fn ask(socket: &UdpSocket, name: &str, command: u32) -> Option<[u32; WORDS]> {
    let mut answer = [0; WORDS];
    answer[0] = command;
    let mut request = Request { name: [0; libc::IFNAMSIZ], data: &raw mut answer, rest: [0; 16] };
    // The last byte stays zero.
    for (slot, byte) in request.name[..libc::IFNAMSIZ - 1].iter_mut().zip(name.bytes()) {
        *slot = byte;
    }
    // SAFETY: the kernel reads and writes a `struct ifreq`, which `request` is at least as long as, and through its pointer
    // the structure of the command, of which none here is longer than `answer`; both live through the call.
    let result = unsafe { libc::ioctl(socket.as_fd().as_raw_fd(), SIOCETHTOOL as _, &raw mut request) };
    (result == 0).then_some(answer)
}

/// The driver's name: bytes up to the first zero.
fn text(answer: &[u32; WORDS]) -> String {
    let (at, len) = DRIVER;
    let bytes = answer[at..at + len / 4].iter().flat_map(|word| word.to_ne_bytes());
    let bytes: Vec<u8> = bytes.take_while(|byte| *byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sys::namespace::{in_namespace, ip};

    #[test]
    fn a_virtual_cable_says_who_drives_it_and_who_stamps() {
        in_namespace("a_virtual_cable_says_who_drives_it", || {
            ip("link add south0 type veth peer name south1");
            let found = features("south0").unwrap();
            assert_eq!(found.driver.as_deref(), Some("veth"));
            let stamps = found.time_stamps.expect("every driver answers since Linux 3.5");
            assert!(stamps.software && !stamps.hardware, "{stamps:?}");
            assert_eq!(found.energy_efficient, None, "there is no wire that could sleep");
        });
    }

    #[test]
    fn an_interface_that_is_not_there_says_nothing() {
        assert_eq!(features("axb-none").unwrap(), Features::default());
        assert_eq!(features("a-name-longer-than-fifteen").unwrap(), Features::default());
    }

    #[test]
    fn names_end_at_the_first_zero() {
        let mut answer = [u32::from_ne_bytes(*b"xxxx"); WORDS];
        (answer[1], answer[2]) = (u32::from_ne_bytes(*b"igb0"), u32::from_ne_bytes(*b"12\0x"));
        assert_eq!(text(&answer), "igb012");
        let full = [u32::from_ne_bytes(*b"abcd"); WORDS];
        assert_eq!(text(&full).len(), 32);
    }
}
