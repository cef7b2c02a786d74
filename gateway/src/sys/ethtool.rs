//! What the driver of a network interface says of itself (`SIOCETHTOOL`), for people who look for what delays frames.
//!
//! A driver answers the questions it knows; the others come back as `None`.
#![allow(unsafe_code)]

use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::os::fd::{AsFd, AsRawFd};

const SIOCETHTOOL: libc::c_ulong = 0x8946;
const SIOCSHWTSTAMP: libc::c_ulong = 0x89B0;
const SIOCGHWTSTAMP: libc::c_ulong = 0x89B1;

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
/// Places of `tx_types` and `rx_filters` in the same: a bit for each value of `tx_type` and `rx_filter`.
const STAMP_KINDS: (usize, usize) = (3, 7);
/// Places of `tx_type` and `rx_filter` in `struct hwtstamp_config`.
const STAMPING: (usize, usize) = (1, 2);
/// Place of `eee_enabled` in `struct ethtool_eee`.
const EEE_ENABLED: usize = 5;

/// `SOF_TIMESTAMPING_RX_HARDWARE` and `SOF_TIMESTAMPING_RX_SOFTWARE`.
const RX_HARDWARE: u32 = 1 << 2;
const RX_SOFTWARE: u32 = 1 << 3;
/// `SOF_TIMESTAMPING_TX_HARDWARE` and `SOF_TIMESTAMPING_RAW_HARDWARE`: stamps of sent messages, by the clock of the card.
const TX_HARDWARE: u32 = 1 << 0;
const RAW_HARDWARE: u32 = 1 << 6;

/// `HWTSTAMP_TX_ON`: of the messages whose socket asks for it.
const TX_ON: u32 = 1;
/// `HWTSTAMP_FILTER_PTP_V2_L4_EVENT`, `_PTP_V2_EVENT`, `_ALL`: what stamps PTP version 2 over UDP, the narrowest first.
const RX_FILTERS: [u32; 3] = [6, 12, 1];

/// Who stamps received frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeStamps {
    /// The network card.
    pub hardware: bool,
    /// The kernel.
    pub software: bool,
}

/// What a card is to stamp (`struct hwtstamp_config`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamping {
    /// Which sent messages: 0 none, 1 those whose socket asks for it.
    pub sent: u32,
    /// Which received ones: number of a filter.
    pub received: u32,
}

/// How a card stamps the event messages of PTP over UDP, sent and received ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PtpStamps {
    filter: u32,
}

impl PtpStamps {
    /// What the answer of a driver allows.
    fn of(answer: &[u32; WORDS]) -> Option<Self> {
        let has = |mask, kinds: u32, kind: u32| answer[STAMPS] & mask == mask && kinds & 1 << kind != 0;
        let filter = |filter: &u32| has(RX_HARDWARE | RAW_HARDWARE, answer[STAMP_KINDS.1], *filter);
        let filter = RX_FILTERS.into_iter().find(filter)?;
        has(TX_HARDWARE, answer[STAMP_KINDS.0], TX_ON).then_some(Self { filter })
    }

    /// What switches them on.
    #[must_use]
    pub fn wanted(self) -> Stamping {
        Stamping { sent: TX_ON, received: self.filter }
    }

    /// Whether they are on already, perhaps with more than they need.
    #[must_use]
    pub fn are_on(self, present: Stamping) -> bool {
        present.sent == TX_ON && RX_FILTERS.contains(&present.received)
    }
}

/// What a driver says; `None` where it does not.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Features {
    /// Its name.
    pub driver: Option<String>,
    /// Who stamps received frames.
    pub time_stamps: Option<TimeStamps>,
    /// How it stamps PTP, where it does.
    pub ptp_stamps: Option<PtpStamps>,
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
    let ask = |command| ask(&socket, name, command).ok();
    Ok(Features {
        driver: ask(ETHTOOL_GDRVINFO).map(|answer| text(&answer)),
        time_stamps: ask(ETHTOOL_GET_TS_INFO).map(|answer| TimeStamps {
            hardware: answer[STAMPS] & RX_HARDWARE != 0,
            software: answer[STAMPS] & RX_SOFTWARE != 0,
        }),
        ptp_stamps: ask(ETHTOOL_GET_TS_INFO).and_then(|answer| PtpStamps::of(&answer)),
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

/// What the card of an interface stamps now.
///
/// # Errors
/// The driver stamps nothing, or the system gives no socket.
pub fn stamping(name: &str) -> io::Result<Stamping> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    let answer = request(&socket, name, SIOCGHWTSTAMP, [0; WORDS])?;
    Ok(Stamping { sent: answer[STAMPING.0], received: answer[STAMPING.1] })
}

/// Sets what the card of an interface stamps.
///
/// # Errors
/// The driver cannot do it, or the caller may not.
pub fn set_stamping(name: &str, wanted: Stamping) -> io::Result<()> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    let mut words = [0; WORDS];
    (words[STAMPING.0], words[STAMPING.1]) = (wanted.sent, wanted.received);
    request(&socket, name, SIOCSHWTSTAMP, words).map(drop)
}

fn ask(socket: &UdpSocket, name: &str, command: u32) -> io::Result<[u32; WORDS]> {
    let mut words = [0; WORDS];
    words[0] = command;
    request(socket, name, SIOCETHTOOL, words)
}

/// Asks the driver with a structure of words, which comes back with its answer.
fn request(
    socket: &UdpSocket,
    name: &str,
    request: libc::c_ulong,
    mut words: [u32; WORDS],
) -> io::Result<[u32; WORDS]> {
    let mut asked = Request { name: [0; libc::IFNAMSIZ], data: &raw mut words, rest: [0; 16] };
    // The last byte stays zero.
    for (slot, byte) in asked.name[..libc::IFNAMSIZ - 1].iter_mut().zip(name.bytes()) {
        *slot = byte;
    }
    // SAFETY: the kernel reads and writes a `struct ifreq`, which `asked` is at least as long as, and through its pointer
    // the structure of the request, of which none here is longer than `words`; both live through the call.
    let result = unsafe { libc::ioctl(socket.as_fd().as_raw_fd(), request as _, &raw mut asked) };
    if result == 0 { Ok(words) } else { Err(io::Error::last_os_error()) }
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
            assert_eq!(found.ptp_stamps, None);
            let wanted = Stamping { sent: 1, received: 6 };
            // The kernel passes both to the driver, which has no such function: the requests are the right ones.
            for refused in [stamping("south0").map(drop), set_stamping("south0", wanted)] {
                assert_eq!(refused.unwrap_err().raw_os_error(), Some(libc::EOPNOTSUPP));
            }
            assert_eq!(found.energy_efficient, None, "there is no wire that could sleep");
        });
    }

    #[test]
    fn an_interface_that_is_not_there_says_nothing() {
        assert_eq!(features("axb-none").unwrap(), Features::default());
        assert_eq!(features("a-name-longer-than-fifteen").unwrap(), Features::default());
    }

    #[test]
    fn a_card_stamps_ptp_if_it_stamps_both_directions_by_its_clock() {
        let both = TX_HARDWARE | RX_HARDWARE | RAW_HARDWARE;
        let answer = |flags, sent, filters: &[u32]| {
            let mut answer = [0; WORDS];
            (answer[STAMPS], answer[STAMP_KINDS.0]) = (flags, sent);
            answer[STAMP_KINDS.1] = filters.iter().fold(0, |all, filter| all | 1 << filter);
            PtpStamps::of(&answer).map(|found| found.wanted())
        };
        let on = |received| Some(Stamping { sent: 1, received });
        assert_eq!(answer(both, 0b11, &[0, 6, 12]), on(6));
        assert_eq!(answer(both, 0b11, &[0, 1, 12]), on(12));
        assert_eq!(answer(both, 0b11, &[0, 1]), on(1), "a card that stamps everything");
        assert_eq!(answer(both, 0b01, &[6]), None, "none of sent ones");
        assert_eq!(answer(both, 0b11, &[0, 3]), None, "PTP version 1 alone");
        assert_eq!(answer(both & !RAW_HARDWARE, 0b11, &[6]), None, "by no clock of its own");
        assert_eq!(answer(both & !TX_HARDWARE, 0b11, &[6]), None);
        let stamps = PtpStamps { filter: 6 };
        assert!(stamps.are_on(Stamping { sent: 1, received: 1 }), "more than it needs");
        assert!(!stamps.are_on(Stamping { sent: 0, received: 6 }));
        assert!(!stamps.are_on(Stamping { sent: 1, received: 0 }));
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
