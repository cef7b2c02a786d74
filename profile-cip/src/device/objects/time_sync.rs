//! The Time Sync object (class 0x43): how the clock of the device is synchronized.
//!
//! CIP Volume 1, which defines it, is not among our documents. Attribute numbers and layouts are those of Wireshark's
//! dissector and of the manuals of makers of CIP Sync devices, which agree; the class revision is from one such manual.
//!
//! The object reports what the device knows and refuses the rest with "attribute not supported". A device that runs no
//! PTP itself has measured neither an offset from a master nor a path delay, and has no parent, intervals or domain; it has
//! an opinion whether its time is everybody's time, and which clock that is. A follower of PTP serves all but the
//! priorities of a master, which it can never be.
//!
//! Get_Attributes_All has all of them in their order, with zeros in place of those that are not served.
//!
//! | attribute | name | layout | served when |
//! |---|---|---|---|
//! | 1 | PTPEnable | BOOL | always; set to what it is, or refused |
//! | 2 | IsSynchronized | BOOL | always |
//! | 3, 4 | SystemTimeMicroseconds, Nanoseconds | ULINT | the system time is known |
//! | 5 | OffsetFromMaster | LINT ns | measured |
//! | 6 | MaxOffsetFromMaster | ULINT ns | measured; set begins it anew |
//! | 7 | MeanPathDelayToMaster | LINT ns | measured |
//! | 8 | GrandMasterClockInfo | see [`ClockInfo`], and priorities UINT, UINT | there is one |
//! | 9 | ParentClockInfo | identity 8, port UINT, variance UINT, phase change rate UDINT | there is one |
//! | 10 | LocalClockInfo | see [`ClockInfo`] | known |
//! | 11 | NumberOfPorts | UINT | always: 1 |
//! | 12 | PortStateInfo | count UINT, (port UINT, state UINT) | always: disabled without PTP |
//! | 13 | PortEnableCfg | count UINT, (port UINT, enable UINT) | always; set to what it is, or refused |
//! | 14 | PortLogAnnounceIntervalCfg | count UINT, (port UINT, log2 s UINT) | with PTP |
//! | 15 | PortLogSyncIntervalCfg | count UINT, (port UINT, log2 s INT) | with PTP |
//! | 16, 17 | Priority1, Priority2 | | never: they belong to a master |
//! | 18 | DomainNumber | USINT | with PTP; settable, 0 to 127 |
//! | 19 | ClockType | WORD: bit 0 ordinary clock | with PTP |
//! | 20 | ManufactureIdentity | 4: OUI, 0 | with PTP |
//! | 21, 22, 23 | ProductDescription, RevisionData, UserDescription | UDINT length, text | always |
//! | 24 | PortProfileIdentityInfo | count UINT, (port UINT, profile 8) | with PTP |
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
const DEFAULT_PRIORITY: u8 = 128;
/// Identity of the profile: CIP Sync, six octets and two to fill.
const PROFILE: [u8; 8] = [0x00, 0x21, 0x6C, 0x00, 0x01, 0x00, 0, 0];
/// An ordinary clock.
const ORDINARY_CLOCK: u16 = 1;
/// What a follower has not measured of its parent, as other followers tell it.
const PARENT_VARIANCE: u16 = 0xFFFF;
const PARENT_PHASE_CHANGE_RATE: u32 = 0x7FFF_FFFF;
/// Highest domain (IEEE 1588-2008, table 2).
const DOMAIN_MAX: u8 = 127;

/// Octets of a [`ClockInfo`].
const CLOCK_INFO_LEN: usize = 20;

/// What a clock says of itself.
///
/// ```text
/// 0 8 identity, 8 2 class, 10 2 accuracy, 12 2 offset scaled log variance, 14 2 UTC offset s, 16 2 flags, 18 2 source
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockInfo {
    /// Identity, EUI-64.
    pub identity: [u8; 8],
    /// Class (IEEE 1588-2008, table 5).
    pub class: u8,
    /// Accuracy (table 6).
    pub accuracy: u8,
    /// Offset scaled log variance (clause 7.6.3.3).
    pub variance: u16,
    /// Seconds of TAI ahead of UTC, as far as the clock knows.
    pub utc_offset: Option<u16>,
    /// Flags of the time properties without the validity of the UTC offset.
    pub flags: u16,
    /// Time source (table 7).
    pub source: u8,
}

impl ClockInfo {
    /// Flag: the UTC offset is valid.
    const UTC_OFFSET_VALID: u16 = 1 << 2;
    /// Flag: the time scale is that of PTP, which is TAI.
    pub const PTP_TIME_SCALE: u16 = 1 << 3;
    /// Flag: the time is traceable to a standard.
    pub const TIME_TRACEABLE: u16 = 1 << 4;
    /// Flag: the rate is traceable to a standard.
    pub const FREQUENCY_TRACEABLE: u16 = 1 << 5;

    /// The clock of a host: of the default class, unknown accuracy, another source.
    #[must_use]
    pub const fn host(identity: [u8; 8], utc_offset: Option<u16>) -> Self {
        let flags = if utc_offset.is_some() { Self::PTP_TIME_SCALE } else { 0 };
        Self { identity, class: 248, accuracy: 0xFE, variance: 0xFFFF, utc_offset, flags, source: 0x90 }
    }

    /// The clock of a follower: it is never a master, and has an oscillator of its own.
    #[must_use]
    pub const fn follower(identity: [u8; 8]) -> Self {
        Self { class: 255, source: 0xA0, ..Self::host(identity, None) }
    }

    fn write(&self, out: &mut Vec<u8>) {
        let valid = if self.utc_offset.is_some() { Self::UTC_OFFSET_VALID } else { 0 };
        out.extend(self.identity);
        for value in [
            self.class.into(),
            self.accuracy.into(),
            self.variance,
            self.utc_offset.unwrap_or(0),
            self.flags | valid,
            self.source.into(),
        ] {
            out.extend(u16::to_le_bytes(value));
        }
    }
}

/// The master that a follower follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MasterInfo {
    /// What the grandmaster says of itself.
    pub grandmaster: ClockInfo,
    /// Its first and second priority.
    pub priorities: [u8; 2],
    /// Identity and port number of the clock that sends the Syncs.
    pub parent: ([u8; 8], u16),
    /// Clocks on the way from the grandmaster.
    pub steps_removed: u16,
}

/// State of the port of a follower (IEEE 1588-2008, table 8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PortState {
    /// No master is heard.
    #[default]
    Listening = 4,
    /// A master is followed; time is not synchronized.
    Uncalibrated = 8,
    /// Time is synchronized.
    Slave = 9,
}

/// PTP of a device that follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PtpPort {
    /// State of the port.
    pub state: PortState,
    /// Domain, 0 to 127.
    pub domain: u8,
    /// Interval of Announces that is expected, log2 s.
    pub log_announce: u16,
    /// Interval of Syncs that is expected, log2 s.
    pub log_sync: i16,
    /// Who is followed.
    pub master: Option<MasterInfo>,
}

/// What somebody has set in the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeSyncSetting {
    /// The largest offset from the master begins anew.
    MaxOffset,
    /// Another domain is to be followed, 0 to 127.
    Domain(u8),
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
    /// PTP, if the device follows it.
    pub ptp: Option<PtpPort>,
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
    /// What a service has set.
    pub setting: Option<TimeSyncSetting>,
}

impl Object for TimeSync<'_> {
    const REVISION: u16 = 3;
    const ALL: &'static [u16] = &[
        1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28,
    ];
    const ATTRIBUTE_MAX: u16 = 28;

    // Flat: one arm per attribute.
    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        const NONE: GeneralStatus = GeneralStatus::ATTRIBUTE_NOT_SUPPORTED;
        let state = self.state;
        let measured = state.measurement.ok_or(NONE);
        let ptp = state.ptp.ok_or(NONE);
        let master = state.ptp.and_then(|ptp| ptp.master).ok_or(NONE);
        match attribute {
            1 => out.push(u8::from(state.ptp.is_some())),
            2 => out.push(u8::from(state.sync.synchronized)),
            3 => out.extend((self.system_time()? / 1000).to_le_bytes()),
            4 => out.extend(self.system_time()?.to_le_bytes()),
            5 => out.extend(measured?.offset_from_master.to_le_bytes()),
            6 => out.extend(measured?.max_offset_from_master.to_le_bytes()),
            7 => out.extend(measured?.mean_path_delay.to_le_bytes()),
            8 => {
                let (clock, priorities) = match (master, state.local.filter(|_| state.is_grandmaster())) {
                    (Ok(master), _) => (master.grandmaster, master.priorities),
                    (Err(_), Some(local)) => (local, [DEFAULT_PRIORITY; 2]),
                    (Err(none), None) => return Err(none),
                };
                clock.write(out);
                priorities.iter().for_each(|priority| out.extend(u16::from(*priority).to_le_bytes()));
            }
            9 => {
                let (identity, port) = master?.parent;
                out.extend(identity);
                out.extend(port.to_le_bytes());
                out.extend(PARENT_VARIANCE.to_le_bytes());
                out.extend(PARENT_PHASE_CHANGE_RATE.to_le_bytes());
            }
            10 => state.local.ok_or(NONE)?.write(out),
            11 => out.extend(1u16.to_le_bytes()),
            12 => {
                let state = state.ptp.map_or(PORT_DISABLED, |ptp| u16::from(ptp.state as u8));
                port(out, &state.to_le_bytes());
            }
            13 => port(out, &u16::from(state.ptp.is_some()).to_le_bytes()),
            14 => port(out, &ptp?.log_announce.to_le_bytes()),
            15 => port(out, &ptp?.log_sync.to_le_bytes()),
            18 => out.push(ptp?.domain),
            19 => {
                ptp?;
                out.extend(ORDINARY_CLOCK.to_le_bytes());
            }
            20 => {
                ptp?;
                let identity = state.local.ok_or(NONE)?.identity;
                out.extend([identity[0], identity[1], identity[2], 0]);
            }
            21 => text(
                &format!(";{};{:08X}", self.config.identity.product_name, self.config.identity.serial_number),
                out,
            ),
            22 => text(&format!(";{}.{};", self.config.identity.major, self.config.identity.minor), out),
            23 => text("", out),
            24 => {
                ptp?;
                port(out, &PROFILE);
            }
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
            27 => {
                let own = state.is_grandmaster().then_some(0u16);
                let steps = master.map(|master| master.steps_removed).ok().or(own).ok_or(NONE)?;
                out.extend(steps.to_le_bytes());
            }
            28 => {
                let system_time = self.system_time()?;
                out.extend((system_time / 1000).to_le_bytes());
                out.extend((state.sync.offset / 1000).to_le_bytes());
            }
            _ => return Err(NONE),
        }
        Ok(())
    }

    /// Zeros of the same size, so that what follows stands at its place; a list has no ports.
    fn absent(&self, attribute: u16, out: &mut Vec<u8>) {
        let len = match attribute {
            16..=18 => 1,
            14 | 15 | 19 | 24 | 25 | 27 => 2,
            20 => 4,
            3..=7 => 8,
            9 | 28 => 16,
            10 => CLOCK_INFO_LEN,
            8 => CLOCK_INFO_LEN + 4,
            _ => 0,
        };
        out.resize(out.len() + len, 0);
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        match attribute {
            1 => Ok(1),
            6 => self.state.measurement.map(|_| 8).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
            13 => Ok(6),
            18 => self.state.ptp.map(|_| 1).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
            _ => {
                self.get(attribute, &mut Vec::new())?;
                Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)
            }
        }
    }

    /// To ask for what is there is no error; a device that has no PTP cannot be made to have it, and one that has it keeps it.
    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        match (attribute, value) {
            (1 | 13, value) => {
                let mut same = Vec::new();
                self.get(attribute, &mut same)?;
                if same == value { Ok(()) } else { Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE) }
            }
            // Whatever is written, the count begins anew.
            (6, _) => {
                self.setting = Some(TimeSyncSetting::MaxOffset);
                Ok(())
            }
            (18, [domain @ 0..=DOMAIN_MAX]) => {
                self.setting = Some(TimeSyncSetting::Domain(*domain));
                Ok(())
            }
            (18, _) => Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE),
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
            local: Some(ClockInfo::host(HOST, Some(37))),
            ..TimeSyncState::default()
        }
    }

    fn value(state: &TimeSyncState, attribute: u16) -> Result<Vec<u8>, GeneralStatus> {
        let mut out = Vec::new();
        let config = device();
        let object = TimeSync { state, config: &config, now: MonotonicTime(5_000_001), setting: None };
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
        let utc = TimeSyncState { local: Some(ClockInfo::host(HOST, None)), ..host() };
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
        let follower = Some(PtpPort::default());
        for (ptp, wanted, outcome) in [
            (None, 0, Ok(())),
            (None, 1, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)),
            (follower, 0, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)),
            (follower, 1, Ok(())),
            (None, 2, Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE)),
        ] {
            let state = TimeSyncState { ptp, ..host() };
            let mut object =
                TimeSync { state: &state, config: &config, now: MonotonicTime(0), setting: None };
            assert_eq!(object.settable_len(1), Ok(1));
            assert_eq!(object.set(1, &[wanted]), outcome, "{ptp:?} {wanted}");
            assert_eq!(object.settable_len(13), Ok(6));
            assert_eq!(object.set(13, &[1, 0, 1, 0, wanted, 0]), outcome, "{ptp:?} {wanted}");
            assert_eq!(object.setting, None);
        }
        let state = host();
        let object = TimeSync { state: &state, config: &config, now: MonotonicTime(0), setting: None };
        assert_eq!(object.settable_len(2), Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE));
        assert_eq!(object.settable_len(6), Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED));
        assert_eq!(object.settable_len(9), Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED));
        assert_eq!(object.settable_len(18), Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED));
    }

    /// A follower of a grandmaster behind one boundary clock.
    fn follower() -> TimeSyncState {
        let grandmaster = ClockInfo {
            identity: [1; 8],
            class: 6,
            accuracy: 0x21,
            variance: 0x4E5D,
            utc_offset: Some(37),
            flags: ClockInfo::PTP_TIME_SCALE | ClockInfo::TIME_TRACEABLE | ClockInfo::FREQUENCY_TRACEABLE,
            source: 0x20,
        };
        let master =
            MasterInfo { grandmaster, priorities: [100, 101], parent: ([2; 8], 0x0304), steps_removed: 2 };
        TimeSyncState {
            sync: SyncState { grandmaster: Some([1; 8]), synchronized: true, offset: 9_000 },
            system_less_monotonic: Some(1_000_000_000_000),
            ptp: Some(PtpPort {
                state: PortState::Slave,
                domain: 5,
                log_announce: 1,
                log_sync: 0,
                master: Some(master),
            }),
            measurement: Some(Measurement {
                offset_from_master: -12,
                max_offset_from_master: 345,
                mean_path_delay: 678,
            }),
            local: Some(ClockInfo::follower([9, 8, 7, 6, 5, 4, 3, 2])),
        }
    }

    #[test]
    fn a_follower_serves_everything_but_the_priorities_of_a_master() {
        let port = |value: &[u8]| [&[1, 0, 1, 0][..], value].concat();
        let clock = |identity: [u8; 8], rest: &[u8]| [&identity[..], rest].concat();
        let grandmaster =
            clock([1; 8], &[6, 0, 0x21, 0, 0x5D, 0x4E, 37, 0, 0x3C, 0, 0x20, 0, 100, 0, 101, 0]);
        let parent = clock([2; 8], &[0x04, 0x03, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x7F]);
        let local = clock([9, 8, 7, 6, 5, 4, 3, 2], &[255, 0, 0xFE, 0, 0xFF, 0xFF, 0, 0, 0, 0, 0xA0, 0]);
        assert_eq!((grandmaster.len(), parent.len(), local.len()), (24, 16, 20));
        for (attribute, expected) in [
            (1, vec![1]),
            (2, vec![1]),
            (5, (-12_i64).to_le_bytes().to_vec()),
            (6, 345_u64.to_le_bytes().to_vec()),
            (7, 678_i64.to_le_bytes().to_vec()),
            (8, grandmaster),
            (9, parent),
            (10, local),
            (12, port(&[9, 0])),
            (13, port(&[1, 0])),
            (14, port(&[1, 0])),
            (15, port(&[0, 0])),
            (18, vec![5]),
            (19, vec![1, 0]),
            (20, vec![9, 8, 7, 0]),
            (24, port(&[0x00, 0x21, 0x6C, 0x00, 0x01, 0x00, 0, 0])),
            (27, vec![2, 0]),
        ] {
            assert_eq!(value(&follower(), attribute), Ok(expected), "{attribute}");
        }
        for attribute in [16, 17, 29] {
            assert_eq!(
                value(&follower(), attribute),
                Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
                "{attribute}"
            );
        }
        for (state, code) in [(PortState::Listening, 4), (PortState::Uncalibrated, 8)] {
            let ptp = PtpPort { state, master: None, ..PtpPort::default() };
            let status = TimeSyncState { ptp: Some(ptp), ..follower() };
            assert_eq!(value(&status, 12), Ok(port(&[code, 0])));
            assert_eq!(value(&status, 9), Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED), "no parent");
        }
    }

    #[test]
    fn all_attributes_stand_at_their_places_whether_they_are_served_or_not() {
        const LENGTHS: [(u16, usize); 12] = [
            (1, 1),
            (2, 1),
            (3, 8),
            (4, 8),
            (5, 8),
            (6, 8),
            (7, 8),
            (8, 24),
            (9, 16),
            (10, 20),
            (11, 2),
            (12, 6),
        ];
        for state in [follower(), host(), TimeSyncState::default()] {
            let config = device();
            let now = MonotonicTime(5_000_001);
            let object = TimeSync { state: &state, config: &config, now, setting: None };
            let whole = super::super::object::all(&object, false, &[]).unwrap();
            let mut at = 0;
            for (attribute, len) in LENGTHS {
                let expected = value(&state, attribute).unwrap_or_else(|_| vec![0; len]);
                assert_eq!(whole[at..at + len], expected, "{attribute}");
                at += len;
            }
        }
    }

    #[test]
    fn what_a_follower_can_be_told_is_told_on() {
        let (config, state) = (device(), follower());
        let mut object = TimeSync { state: &state, config: &config, now: MonotonicTime(0), setting: None };
        assert_eq!((object.settable_len(6), object.settable_len(18)), (Ok(8), Ok(1)));
        assert_eq!((object.set(6, &[0; 8]), object.setting), (Ok(()), Some(TimeSyncSetting::MaxOffset)));
        assert_eq!((object.set(18, &[127]), object.setting), (Ok(()), Some(TimeSyncSetting::Domain(127))));
        assert_eq!(object.set(18, &[128]), Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE));
        assert_eq!(object.settable_len(16), Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED));
    }
}
