//! The Time Sync object (class 0x43): how the clock of the device is synchronized.
//!
//! CIP Volume 1, which defines it, is not among our documents. Attribute numbers and layouts are those of Wireshark's
//! dissector and of the manuals of makers of CIP Sync devices, which agree; the class revision is from one such manual.
//!
//! The object reports what the device knows and refuses the rest with "attribute not supported". A device that runs no
//! PTP itself has measured neither an offset from a master nor a path delay, and has no parent, intervals, priorities
//! or domain; it has an opinion whether its time is everybody's time, and which clock that is.
//!
//! | attribute | name | layout | served when |
//! |---|---|---|---|
//! | 1 | PTPEnable | BOOL | always; set to what it is, or refused |
//! | 2 | IsSynchronized | BOOL | always |
//! | 3, 4 | SystemTimeMicroseconds, Nanoseconds | ULINT | the system time is known |
//! | 5 | OffsetFromMaster | LINT ns | measured |
//! | 6 | MaxOffsetFromMaster | ULINT ns | measured |
//! | 7 | MeanPathDelayToMaster | LINT ns | measured |
//! | 8 | GrandMasterClockInfo | see [`ClockInfo`], and priorities UINT, UINT | there is one |
//! | 9 | ParentClockInfo | no one has a parent without PTP | never |
//! | 10 | LocalClockInfo | see [`ClockInfo`] | known |
//! | 11 | NumberOfPorts | UINT | always: 1 |
//! | 12 | PortStateInfo | count UINT, (port UINT, state UINT) | always: disabled without PTP |
//! | 13 | PortEnableCfg | count UINT, (port UINT, enable UINT) | always |
//! | 14..=20, 24 | intervals, priorities, domain, clock type, maker, profile | | never: they belong to PTP |
//! | 21, 22, 23 | ProductDescription, RevisionData, UserDescription | UDINT length, text | always |
//! | 25 | PortPhysicalAddressInfo | count UINT, (port UINT, protocol 16, length UINT, address 16) | the MAC address is known |
//! | 26 | PortProtocolAddressInfo | count UINT, (port UINT, protocol UINT, length UINT, address 16) | always |
//! | 27 | StepsRemoved | UINT | known |
//! | 28 | SystemTimeAndOffset | ULINT us, ULINT us | the system time is known |

use profile_generic::time::MonotonicTime;

use super::object::Object;
use crate::device::config::AdapterConfig;
use crate::device::motion_link::SyncState;
use crate::wire::status::GeneralStatus;

/// Class code of the Time Sync object.
pub const CLASS_TIME_SYNC: u16 = 0x43;

/// The one port.
const PORT: u16 = 1;
/// State of a port that takes no part in PTP (IEEE 1588-2008, table 8).
const PORT_DISABLED: u16 = 3;
/// Network protocol UDP over IPv4 (IEEE 1588-2008, table 3).
const UDP_IPV4: u16 = 1;
/// Longest address in the structures of the object.
const ADDRESS_LEN: usize = 16;
/// Priority of a clock whose priority nobody has set (IEEE 1588-2008, annex J).
const DEFAULT_PRIORITY: u16 = 128;

/// What a clock says of itself.
///
/// ```text
/// 0 8 identity, 8 2 class, 10 2 accuracy, 12 2 offset scaled log variance, 14 2 UTC offset s, 16 2 flags, 18 2 source
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockInfo {
    /// Identity, EUI-64.
    pub identity: [u8; 8],
    /// Seconds of TAI ahead of UTC, as far as the clock knows.
    pub utc_offset: Option<u16>,
}

impl ClockInfo {
    /// Clock class: default (IEEE 1588-2008, table 5).
    const CLASS: u16 = 248;
    /// Accuracy: unknown (table 6).
    const ACCURACY: u16 = 0xFE;
    /// Variance: not computed (clause 7.6.3.3).
    const VARIANCE: u16 = 0xFFFF;
    /// Time source: other (table 7).
    const SOURCE: u16 = 0x90;
    /// The UTC offset is valid.
    const UTC_OFFSET_VALID: u16 = 1 << 2;
    /// The time scale is that of PTP, which is TAI.
    const PTP_TIME_SCALE: u16 = 1 << 3;

    fn write(&self, out: &mut Vec<u8>) {
        let flags = match self.utc_offset {
            Some(_) => Self::UTC_OFFSET_VALID | Self::PTP_TIME_SCALE,
            None => 0,
        };
        out.extend(self.identity);
        for value in
            [Self::CLASS, Self::ACCURACY, Self::VARIANCE, self.utc_offset.unwrap_or(0), flags, Self::SOURCE]
        {
            out.extend(value.to_le_bytes());
        }
    }
}

/// What PTP has measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Measurement {
    /// Offset of this clock from its master, ns.
    pub offset_from_master: i64,
    /// The largest one so far, ns.
    pub max_offset_from_master: u64,
    /// Mean delay of the path to the master, ns.
    pub mean_path_delay: i64,
}

/// How the clock of the device is, as the Time Sync object reports it. Group_Sync judges by the same [`SyncState`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TimeSyncState {
    /// Whether it is synchronized, and with whom.
    pub sync: SyncState,
    /// System time less monotonic time, ns; `None` without a system time.
    pub system_less_monotonic: Option<i64>,
    /// The device runs PTP.
    pub ptp: bool,
    /// What it has measured.
    pub measurement: Option<Measurement>,
    /// The clock of the device itself.
    pub local: Option<ClockInfo>,
}

impl TimeSyncState {
    fn system_time(&self, now: MonotonicTime) -> Option<u64> {
        now.0.checked_add_signed(self.system_less_monotonic?)
    }

    /// The grand master is the device's own clock.
    fn is_grandmaster(&self) -> bool {
        self.local.is_some_and(|local| Some(local.identity) == self.sync.grandmaster)
    }
}

/// The object as it is at this moment.
pub(crate) struct TimeSync<'a> {
    pub state: &'a TimeSyncState,
    pub config: &'a AdapterConfig,
    pub now: MonotonicTime,
}

impl Object for TimeSync<'_> {
    const REVISION: u16 = 3;
    const ALL: &'static [u16] = &[];
    const ATTRIBUTE_MAX: u16 = 28;

    // Flat: one arm per attribute.
    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        const NONE: GeneralStatus = GeneralStatus::ATTRIBUTE_NOT_SUPPORTED;
        let state = self.state;
        let measured = state.measurement.ok_or(NONE);
        match attribute {
            1 => out.push(u8::from(state.ptp)),
            2 => out.push(u8::from(state.sync.synchronized)),
            3 => out.extend((self.system_time()? / 1000).to_le_bytes()),
            4 => out.extend(self.system_time()?.to_le_bytes()),
            5 => out.extend(measured?.offset_from_master.to_le_bytes()),
            6 => out.extend(measured?.max_offset_from_master.to_le_bytes()),
            7 => out.extend(measured?.mean_path_delay.to_le_bytes()),
            8 => {
                let local = state.local.filter(|_| state.is_grandmaster()).ok_or(NONE)?;
                local.write(out);
                out.extend(DEFAULT_PRIORITY.to_le_bytes());
                out.extend(DEFAULT_PRIORITY.to_le_bytes());
            }
            10 => state.local.ok_or(NONE)?.write(out),
            11 => out.extend(1u16.to_le_bytes()),
            12 if !state.ptp => port(out, &PORT_DISABLED.to_le_bytes()),
            13 => port(out, &u16::from(state.ptp).to_le_bytes()),
            21 => text(
                &format!(";{};{:08X}", self.config.identity.product_name, self.config.identity.serial_number),
                out,
            ),
            22 => text(&format!(";{}.{};", self.config.identity.major, self.config.identity.minor), out),
            23 => text("", out),
            25 => {
                let mac = self.config.link.mac;
                if mac == [0; 6] {
                    return Err(NONE);
                }
                let mut protocol = [0; ADDRESS_LEN];
                protocol[..10].copy_from_slice(b"IEEE 802.3");
                port(out, &protocol);
                address(&mac, out);
            }
            26 => {
                port(out, &UDP_IPV4.to_le_bytes());
                address(&self.config.interface.address.octets(), out);
            }
            27 if state.is_grandmaster() => out.extend(0u16.to_le_bytes()),
            28 => {
                let system_time = self.system_time()?;
                out.extend((system_time / 1000).to_le_bytes());
                out.extend((state.sync.offset / 1000).to_le_bytes());
            }
            _ => return Err(NONE),
        }
        Ok(())
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        match attribute {
            1 => Ok(1),
            _ => {
                self.get(attribute, &mut Vec::new())?;
                Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)
            }
        }
    }

    /// To ask for what is there is no error; a device that has no PTP cannot be made to have it.
    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        match (attribute, value) {
            (1, [0]) if !self.state.ptp => Ok(()),
            (1, [1]) if self.state.ptp => Ok(()),
            (1, _) => Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE),
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
        }
    }
}

impl TimeSync<'_> {
    fn system_time(&self) -> Result<u64, GeneralStatus> {
        self.state.system_time(self.now).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)
    }
}

/// Appends the count of ports, the one port, and the beginning of what is told of it.
fn port(out: &mut Vec<u8>, value: &[u8]) {
    out.extend(1u16.to_le_bytes());
    out.extend(PORT.to_le_bytes());
    out.extend(value);
}

/// Appends an address with its length, filled up.
fn address(octets: &[u8], out: &mut Vec<u8>) {
    out.extend(u16::try_from(octets.len()).unwrap_or(0).to_le_bytes());
    out.extend(octets.iter().copied().chain(core::iter::repeat(0)).take(ADDRESS_LEN));
}

/// Appends a text with its length.
fn text(text: &str, out: &mut Vec<u8>) {
    out.extend(u32::try_from(text.len()).unwrap_or(0).to_le_bytes());
    out.extend(text.as_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::config::tests::device;

    const HOST: [u8; 8] = [2, 0x41, 0x42, 0xFF, 0xFE, 0, 0, 1];

    /// A device that takes the clock of its host for the time of everybody.
    fn host() -> TimeSyncState {
        TimeSyncState {
            sync: SyncState { grandmaster: Some(HOST), synchronized: true, offset: 7000 },
            system_less_monotonic: Some(1_000_000_000_000),
            local: Some(ClockInfo { identity: HOST, utc_offset: Some(37) }),
            ..TimeSyncState::default()
        }
    }

    fn value(state: &TimeSyncState, attribute: u16) -> Result<Vec<u8>, GeneralStatus> {
        let mut out = Vec::new();
        let config = device();
        let object = TimeSync { state, config: &config, now: MonotonicTime(5_000_001) };
        object.get(attribute, &mut out).map(|()| out)
    }

    #[test]
    fn a_host_clock_tells_what_is_true_of_it_and_refuses_what_only_ptp_knows() {
        const NO: Result<&[u8], GeneralStatus> = Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED);
        let clock = [&HOST[..], &[248, 0, 0xFE, 0, 0xFF, 0xFF, 37, 0, 0x0C, 0, 0x90, 0]].concat();
        let grandmaster = [&clock[..], &[128, 0, 128, 0]].concat();
        let micros = 1_000_005_000u64.to_le_bytes();
        let both = [&micros[..], &7u64.to_le_bytes()].concat();
        let mut physical = vec![1, 0, 1, 0];
        physical.extend(b"IEEE 802.3\0\0\0\0\0\0");
        physical.extend([6, 0, 2, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        let protocol = [1, 0, 1, 0, 1, 0, 4, 0, 10, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let described = [&20u32.to_le_bytes()[..], b";Axisbridge;DEADBEEF"].concat();
        let revision = [&5u32.to_le_bytes()[..], b";2.3;"].concat();
        let rows: [(u16, Result<&[u8], GeneralStatus>); 29] = [
            (0, NO),
            (1, Ok(&[0])),
            (2, Ok(&[1])),
            (3, Ok(&micros)),
            (4, Ok(&1_000_005_000_001u64.to_le_bytes())),
            (5, NO),
            (6, NO),
            (7, NO),
            (8, Ok(&grandmaster)),
            (9, NO),
            (10, Ok(&clock)),
            (11, Ok(&[1, 0])),
            (12, Ok(&[1, 0, 1, 0, 3, 0])),
            (13, Ok(&[1, 0, 1, 0, 0, 0])),
            (14, NO),
            (15, NO),
            (16, NO),
            (17, NO),
            (18, NO),
            (19, NO),
            (20, NO),
            (21, Ok(&described)),
            (22, Ok(&revision)),
            (23, Ok(&[0, 0, 0, 0])),
            (24, NO),
            (25, Ok(&physical)),
            (26, Ok(&protocol)),
            (27, Ok(&[0, 0])),
            (28, Ok(&both)),
        ];
        for (attribute, expected) in rows {
            assert_eq!(value(&host(), attribute).as_deref(), expected.as_deref(), "{attribute}");
        }
    }

    #[test]
    fn what_is_not_known_is_not_told() {
        let unknown = TimeSyncState::default();
        for attribute in [3, 4, 5, 6, 7, 8, 10, 27, 28] {
            assert_eq!(
                value(&unknown, attribute),
                Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
                "{attribute}"
            );
        }
        assert_eq!(value(&unknown, 2), Ok(vec![0]));
        // A clock on UTC says nothing of TAI.
        let utc = TimeSyncState { local: Some(ClockInfo { identity: HOST, utc_offset: None }), ..host() };
        assert_eq!(value(&utc, 10).map(|clock| clock[14..18].to_vec()), Ok(vec![0; 4]));
        // Somebody else's clock is not described by ours.
        let follower =
            TimeSyncState { sync: SyncState { grandmaster: Some([9; 8]), ..host().sync }, ..host() };
        for attribute in [8, 27] {
            assert_eq!(value(&follower, attribute), Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED));
        }
        let measurement =
            Measurement { offset_from_master: -5, max_offset_from_master: 99, mean_path_delay: 1234 };
        let measured = TimeSyncState { measurement: Some(measurement), ..host() };
        assert_eq!(value(&measured, 5), Ok((-5i64).to_le_bytes().to_vec()));
        assert_eq!(value(&measured, 6), Ok(99u64.to_le_bytes().to_vec()));
        assert_eq!(value(&measured, 7), Ok(1234i64.to_le_bytes().to_vec()));
        // Before the epoch of the system time there is none.
        let early = TimeSyncState { system_less_monotonic: Some(i64::MIN), ..host() };
        assert_eq!(value(&early, 4), Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED));
    }

    #[test]
    fn ptp_can_be_asked_for_only_as_it_is() {
        let config = device();
        for (ptp, wanted, outcome) in [
            (false, 0, Ok(())),
            (false, 1, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)),
            (true, 0, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)),
            (true, 1, Ok(())),
            (false, 2, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)),
        ] {
            let state = TimeSyncState { ptp, ..host() };
            let mut object = TimeSync { state: &state, config: &config, now: MonotonicTime(0) };
            assert_eq!(object.settable_len(1), Ok(1));
            assert_eq!(object.set(1, &[wanted]), outcome, "{ptp} {wanted}");
        }
        let state = host();
        let object = TimeSync { state: &state, config: &config, now: MonotonicTime(0) };
        assert_eq!(object.settable_len(2), Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE));
        assert_eq!(object.settable_len(9), Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED));
    }
}
