//! What the master is told before it starts.

use arrayvec::ArrayVec;
use profile_generic::time::DurationNs;

use super::layout::SlaveNeed;
use super::svc::SvcLimits;
use crate::port::Port;
use crate::wire::connection::{CONNECTION_CONTROL_LEN, ConfigurationType, ConnectionSetup, ConnectionTiming};
use crate::wire::cp0::{self, CommunicationVersion};
use crate::wire::header::MacAddress;
use crate::wire::idn::Idn;

/// Connections which the master can set up per slave.
pub const CONNECTIONS_MAX: usize = 8;

/// IDNs in the configuration list of one connection; the list fits into a request without a buffer.
pub const CONNECTION_IDNS_MAX: usize = 16;

/// Bytes of one connection with C-CON.
pub const CONNECTION_LEN_MAX: usize = 256;

/// Largest SERCOS cycle time in nanoseconds.
pub const CYCLE_NS_MAX: u32 = 65_000_000;

/// Shortest cycle of CP0 to CP2 in nanoseconds, with two telegrams of each kind in CP1 and CP2.
const SETUP_CYCLE_NS_MIN: u32 = 1_000_000;

/// One cyclic connection of a slave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConnectionConfig {
    /// The connection's number at the slave, x of S-0-1050.x.
    pub instance: u8,
    /// Whether the slave produces (AT, feedback) or consumes (MDT, command values).
    pub slave_produces: bool,
    /// What the data is made of, S-0-1050.x.1 bits 5..4. Only for an IDN list is `idns` written.
    pub configuration: ConfigurationType,
    /// How the connection is timed, S-0-1050.x.1 bits 1..0.
    pub timing: ConnectionTiming,
    /// Configuration list, S-0-1050.x.6.
    pub idns: ArrayVec<Idn, CONNECTION_IDNS_MAX>,
    /// The producer has a new value every so many cycles, 1 or more; S-0-1050.x.10 in units of the cycle time.
    pub producer_cycles: u16,
    /// Consecutive losses which the consumer bears, S-0-1050.x.11.
    pub allowed_losses: u16,
    /// Bytes of the values by the application's account, without C-CON. A slave whose S-0-1050.x.5 does not agree is refused.
    /// `None`: the application does not know.
    pub data_len: Option<u16>,
}

impl ConnectionConfig {
    /// A clock synchronous connection of an IDN list, produced every cycle, ten losses allowed. IDNs beyond
    /// [`CONNECTION_IDNS_MAX`] make [`MasterConfig::check`] fail: `None` here.
    #[must_use]
    pub fn new(instance: u8, slave_produces: bool, idns: &[Idn]) -> Option<ConnectionConfig> {
        Some(ConnectionConfig {
            instance,
            slave_produces,
            configuration: ConfigurationType::IdnList,
            timing: ConnectionTiming::ClockSynchronous,
            idns: ArrayVec::try_from(idns).ok()?,
            producer_cycles: 1,
            allowed_losses: 10,
            data_len: None,
        })
    }

    /// The word for S-0-1050.x.1.
    #[must_use]
    pub fn setup(&self) -> ConnectionSetup {
        ConnectionSetup::synchronous(self.slave_produces)
            .with_configuration(self.configuration)
            .with_timing(self.timing)
    }
}

/// The connections of one slave.
pub type Connections = ArrayVec<ConnectionConfig, CONNECTIONS_MAX>;

/// What the master does in CP2 about slaves without a SERCOS address of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AddressPolicy {
    /// Reports them and does not enter CP3 with them.
    #[default]
    Refuse,
    /// Gives them free addresses by S-0-1040, the lowest first, in the order of the network. Addresses of the
    /// configuration are not given away, and no slave keeps one that it shares: which of them was meant is for a person
    /// to say. They take part without connections.
    Assign,
}

/// One slave that is expected on the network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlaveConfig {
    /// SERCOS address, 1..=511.
    pub address: u16,
    /// Its connections; may also be set in CP2 with [`super::Master::set_connections`].
    pub connections: Connections,
    /// What the telegrams keep free for it while it is not there, so that it can be plugged in later: the lengths of its
    /// connections with C-CON, and its times. `None`: it has to be there from the start.
    pub hot_plug: Option<SlaveNeed>,
}

/// Which of its two ports the master has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Ports {
    /// Port 1 only: a line with P telegrams.
    #[default]
    One,
    /// Port 2 only: a line with S telegrams.
    Two,
    /// Both: a ring, or a line on either or on both.
    Both,
}

impl Ports {
    /// Whether there is this port.
    #[must_use]
    pub const fn contains(self, port: Port) -> bool {
        matches!((self, port), (Ports::Both, _) | (Ports::One, Port::One) | (Ports::Two, Port::Two))
    }
}

/// Configuration of the master.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MasterConfig {
    /// Source address of all telegrams. Frames with another source are refused.
    pub mac: MacAddress,
    /// The Ethernet ports there are.
    pub ports: Ports,
    /// Cycles for which both ends of an open ring must see each other's telegrams before it is closed again.
    pub close_cycles: u16,
    /// Cycle time of CP3 and CP4 (tScyc) in nanoseconds: 31250, 62500, 125000 or a multiple of 250000 up to
    /// 65 ms.
    pub cycle_ns: u32,
    /// Cycle time of CP0, CP1 and CP2 in nanoseconds: a multiple of 250000, 1 ms (2 ms with more than 255
    /// slaves) to 65 ms. By default `cycle_ns`, where that is longer: a network may not hold a shorter one.
    pub setup_cycle_ns: u32,
    /// Deviation of the master's own cycle start in nanoseconds, S-0-1023 follows from it. Above 1000 the master
    /// declares itself a soft master in S-0-1032.
    pub mst_jitter_ns: u32,
    /// Deviation of one slave's forwarding in nanoseconds; the inter frame gap follows from it.
    pub slave_jitter_ns: u32,
    /// Delay of one pass through a slave in nanoseconds; the ring delay follows from it. 900 by default, more than
    /// any known slave needs.
    pub slave_delay_ns: u32,
    /// Slaves for which storage is set aside, 1..=511. Above 255 the network uses four telegrams in CP1 and CP2.
    pub slaves_max: u16,
    /// Expected slaves. Others found on the network take part without connections.
    pub slaves: Vec<SlaveConfig>,
    /// Slaves that have no address or share one.
    pub addresses: AddressPolicy,
    /// Consecutive cycles for which topology, and then the address list, must stay the same in CP0.
    pub stable_cycles: u16,
    /// Cycles after which CP0 reports that topology or list do not become stable.
    pub scan_timeout_cycles: u16,
    /// Silence before a phase is entered with new telegrams; at least 120 ms.
    pub pause: DurationNs,
    /// Wait at the start of CP0 before the telegrams are evaluated.
    pub settle: DurationNs,
    /// Time for the slaves to meet each condition of a phase switch.
    pub switch_timeout: DurationNs,
    /// Times of the service channel.
    pub svc: SvcLimits,
    /// Consecutive cycles without SlaveValid before a slave counts as lost.
    pub slave_valid_misses: u16,
    /// S-0-1003, MST losses which the slaves bear in CP3 and CP4.
    pub mst_losses: u16,
    /// MDT0 carries the SERCOS time in its extended field: S-0-1032 tells the slaves so. What it is comes from
    /// [`Master::set_system_time`](super::Master::set_system_time); while nothing comes, the field says that it is not valid.
    pub system_time: bool,
    /// S-0-1027.0.1, requested MTU of the unified communication channel in bytes.
    pub mtu: u16,
    /// A hot-plug field at the start of every telegram, as slaves before specification 1.3.0 need it, and not
    /// of MDT0 and AT0 only.
    pub hot_plug_in_all: bool,
    /// Bytes set aside per slave for lists which the master itself reads (S-0-1000, S-0-0021, S-0-0022).
    pub list_capacity: usize,
}

/// MDTs, and ATs, in CP1 and CP2.
fn setup_telegrams(slaves_max: u16) -> u8 {
    if slaves_max > 255 { 4 } else { 2 }
}

impl MasterConfig {
    /// A configuration for a line on port 1 with the usual times: in CP0 to CP2 the cycle time, and 1 ms at least,
    /// 120 ms pauses, 200 ms waits, 100 stable
    /// cycles, 45 us jitter of a soft master, room for 64 slaves.
    #[must_use]
    pub fn new(mac: MacAddress, cycle_ns: u32) -> MasterConfig {
        MasterConfig {
            mac,
            ports: Ports::One,
            close_cycles: 100,
            cycle_ns,
            setup_cycle_ns: cycle_ns.max(SETUP_CYCLE_NS_MIN),
            mst_jitter_ns: 45_000,
            slave_jitter_ns: 80,
            slave_delay_ns: 900,
            slaves_max: 64,
            slaves: Vec::new(),
            addresses: AddressPolicy::Refuse,
            stable_cycles: 100,
            scan_timeout_cycles: 1000,
            pause: DurationNs::from_millis(120),
            settle: DurationNs::from_millis(200),
            switch_timeout: DurationNs::from_millis(200),
            svc: SvcLimits::default(),
            slave_valid_misses: 2,
            mst_losses: 10,
            system_time: false,
            mtu: 1500,
            hot_plug_in_all: true,
            list_capacity: 1024,
        }
    }

    /// MDTs, and ATs, in CP1 and CP2: 2, or 4 for more than 255 slaves.
    #[must_use]
    pub fn setup_telegrams(&self) -> u8 {
        setup_telegrams(self.slaves_max)
    }

    /// The shortest cycle of CP0 to CP2 in nanoseconds: 1 ms, or 2 ms for more than 255 slaves.
    #[must_use]
    pub fn setup_cycle_min_ns(&self) -> u32 {
        Self::setup_cycle_least(self.slaves_max)
    }

    /// The same for a network with room for so many slaves.
    #[must_use]
    pub fn setup_cycle_least(slaves_max: u16) -> u32 {
        if setup_telegrams(slaves_max) == 4 { 2 * SETUP_CYCLE_NS_MIN } else { SETUP_CYCLE_NS_MIN }
    }

    /// Checks every value against its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let cycle = self.cycle_ns;
        let fine = matches!(cycle, 31_250 | 62_500 | 125_000);
        let coarse = cycle > 0 && cycle.is_multiple_of(250_000) && cycle <= CYCLE_NS_MAX;
        if !fine && !coarse {
            return Err(ConfigError::CycleTime { nanoseconds: cycle });
        }
        let setup = self.setup_cycle_ns;
        let minimum = self.setup_cycle_min_ns();
        if setup < minimum || setup > CYCLE_NS_MAX || !setup.is_multiple_of(250_000) {
            return Err(ConfigError::SetupCycleTime { nanoseconds: setup, minimum });
        }
        if self.slaves_max == 0 || usize::from(self.slaves_max) > cp0::SLAVES_MAX {
            return Err(ConfigError::SlavesMax(self.slaves_max));
        }
        if self.slaves.len() > usize::from(self.slaves_max) {
            return Err(ConfigError::TooManySlaves { configured: self.slaves.len(), max: self.slaves_max });
        }
        if self.pause < DurationNs::from_millis(120) {
            return Err(ConfigError::Pause(self.pause));
        }
        if self.mst_jitter_ns >= self.cycle_ns {
            return Err(ConfigError::Jitter { nanoseconds: self.mst_jitter_ns, cycle_ns: self.cycle_ns });
        }
        self.check_slaves()
    }

    fn check_slaves(&self) -> Result<(), ConfigError> {
        for (index, slave) in self.slaves.iter().enumerate() {
            if slave.address == 0 || usize::from(slave.address) > cp0::SLAVES_MAX {
                return Err(ConfigError::Address(slave.address));
            }
            if self.slaves[..index].iter().any(|other| other.address == slave.address) {
                return Err(ConfigError::DoubleAddress(slave.address));
            }
            check_connections(slave.address, &slave.connections, self.cycle_ns)?;
            check_room(slave)?;
        }
        Ok(())
    }

    /// The slave that is to have this address.
    pub(super) fn slave(&self, address: u16) -> Option<&SlaveConfig> {
        self.slaves.iter().find(|slave| slave.address == address)
    }

    /// The communication version of CP0.
    pub(super) fn communication_version(&self) -> CommunicationVersion {
        let four = self.setup_telegrams() == 4;
        let telegrams =
            if four { CommunicationVersion::FOUR_TELEGRAMS } else { CommunicationVersion::empty() };
        CommunicationVersion::ADDRESS_ALLOCATION | telegrams
    }
}

/// Checks the connections of one slave.
pub(crate) fn check_connections(
    address: u16,
    connections: &[ConnectionConfig],
    cycle_ns: u32,
) -> Result<(), ConfigError> {
    for (index, connection) in connections.iter().enumerate() {
        let instance = connection.instance;
        if connections[..index].iter().any(|other| other.instance == instance) {
            return Err(ConfigError::DoubleInstance { address, instance });
        }
        let cycles = connection.producer_cycles;
        if cycles == 0 || u32::from(cycles).checked_mul(cycle_ns).is_none() {
            return Err(ConfigError::ProducerCycles { address, instance, cycles });
        }
        if connection.configuration == ConfigurationType::IdnList && connection.idns.is_empty() {
            return Err(ConfigError::NoIdns { address, instance });
        }
    }
    Ok(())
}

/// Checks the room that is kept for a slave.
fn check_room(slave: &SlaveConfig) -> Result<(), ConfigError> {
    let room = slave.hot_plug.iter().flat_map(|need| &need.connections);
    for (index, connection) in room.clone().enumerate() {
        let (address, instance, length) = (slave.address, connection.instance, connection.len);
        if room.clone().take(index).any(|other| other.instance == instance) {
            return Err(ConfigError::DoubleInstance { address, instance });
        }
        let possible = (CONNECTION_CONTROL_LEN..=CONNECTION_LEN_MAX).contains(&usize::from(length));
        if !possible || length % 2 != 0 {
            return Err(ConfigError::Room { address, instance, length });
        }
    }
    Ok(())
}

/// What is wrong with a configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// The SERCOS cycle time is none of the permitted ones.
    #[error("cycle time {nanoseconds} ns: 31250, 62500, 125000 or a multiple of 250000 up to 65000000")]
    CycleTime {
        /// The value given.
        nanoseconds: u32,
    },
    /// The cycle time of CP0 to CP2 is out of range.
    #[error("cycle time of CP0 to CP2 {nanoseconds} ns: a multiple of 250000, {minimum} to 65000000")]
    SetupCycleTime {
        /// The value given.
        nanoseconds: u32,
        /// The smallest permitted value.
        minimum: u32,
    },
    /// Storage for an impossible number of slaves.
    #[error("room for {0} slaves: 1 to 511")]
    SlavesMax(u16),
    /// More slaves configured than there is storage for.
    #[error("{configured} slaves configured, room for {max}")]
    TooManySlaves {
        /// Slaves configured.
        configured: usize,
        /// Slaves that fit.
        max: u16,
    },
    /// The pause between phases is too short.
    #[error("pause between phases {0}: at least 120 ms")]
    Pause(DurationNs),
    /// The master's jitter exceeds the cycle.
    #[error("jitter {nanoseconds} ns is not below the cycle time {cycle_ns} ns")]
    Jitter {
        /// The value given.
        nanoseconds: u32,
        /// Cycle time in nanoseconds.
        cycle_ns: u32,
    },
    /// A SERCOS address out of range.
    #[error("SERCOS address {0}: 1 to 511")]
    Address(u16),
    /// Two slaves with the same SERCOS address.
    #[error("SERCOS address {0} is configured twice")]
    DoubleAddress(u16),
    /// Two connections of a slave with the same number.
    #[error("slave {address}: connection {instance} is configured twice")]
    DoubleInstance {
        /// SERCOS address.
        address: u16,
        /// Connection number.
        instance: u8,
    },
    /// An impossible producer cycle.
    #[error("slave {address} connection {instance}: production every {cycles} cycles")]
    ProducerCycles {
        /// SERCOS address.
        address: u16,
        /// Connection number.
        instance: u8,
        /// The value given.
        cycles: u16,
    },
    /// Room kept for a connection of an impossible length.
    #[error("slave {address} connection {instance}: room of {length} bytes; an even number from 2 to 256")]
    Room {
        /// SERCOS address.
        address: u16,
        /// Connection number.
        instance: u8,
        /// The value given.
        length: u16,
    },
    /// An IDN list connection without IDNs.
    #[error("slave {address} connection {instance}: the configuration list is empty")]
    NoIdns {
        /// SERCOS address.
        address: u16,
        /// Connection number.
        instance: u8,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAC: MacAddress = [2, 0, 0, 0, 0, 1];

    #[test]
    fn cycle_times() {
        let good = [31_250, 62_500, 125_000, 250_000, 1_000_000, 65_000_000];
        let bad = [0, 1, 31_251, 200_000, 375_000, 65_250_000];
        let check = |cycle| MasterConfig { mst_jitter_ns: 0, ..MasterConfig::new(MAC, cycle) }.check();
        assert!(good.iter().all(|&cycle| check(cycle) == Ok(())));
        assert!(bad.iter().all(|&cycle| check(cycle) == Err(ConfigError::CycleTime { nanoseconds: cycle })));
        let wide = MasterConfig { slaves_max: 256, ..MasterConfig::new(MAC, 1_000_000) };
        assert_eq!(
            wide.check(),
            Err(ConfigError::SetupCycleTime { nanoseconds: 1_000_000, minimum: 2_000_000 })
        );
    }

    #[test]
    fn the_phases_before_cp3_go_no_faster_than_the_cycle_asked_for() {
        let setup = |cycle| MasterConfig::new(MAC, cycle).setup_cycle_ns;
        assert_eq!(
            [31_250, 1_000_000, 1_250_000, 4_000_000].map(setup),
            [1_000_000, 1_000_000, 1_250_000, 4_000_000]
        );
        let min = |slaves_max| {
            MasterConfig { slaves_max, ..MasterConfig::new(MAC, 1_000_000) }.setup_cycle_min_ns()
        };
        assert_eq!((min(255), min(256)), (1_000_000, 2_000_000));
    }

    #[test]
    fn each_fault_has_its_error() {
        let base = MasterConfig::new(MAC, 1_000_000);
        let slave = |address| SlaveConfig { address, connections: Connections::new(), hot_plug: None };
        let with = |slaves: &[SlaveConfig]| MasterConfig { slaves: slaves.to_vec(), ..base.clone() }.check();
        assert_eq!(with(&[slave(0)]), Err(ConfigError::Address(0)));
        assert_eq!(with(&[slave(512)]), Err(ConfigError::Address(512)));
        assert_eq!(with(&[slave(7), slave(7)]), Err(ConfigError::DoubleAddress(7)));
        let connection = |instance| ConnectionConfig::new(instance, true, &[Idn(40)]).unwrap();
        let connected = |connections: &[ConnectionConfig]| {
            with(&[SlaveConfig { connections: connections.iter().cloned().collect(), ..slave(1) }])
        };
        assert_eq!(
            connected(&[connection(1), connection(1)]),
            Err(ConfigError::DoubleInstance { address: 1, instance: 1 })
        );
        assert_eq!(
            connected(&[ConnectionConfig::new(0, true, &[]).unwrap()]),
            Err(ConfigError::NoIdns { address: 1, instance: 0 })
        );
        assert_eq!(
            connected(&[ConnectionConfig { producer_cycles: 0, ..connection(3) }]),
            Err(ConfigError::ProducerCycles { address: 1, instance: 3, cycles: 0 })
        );
        assert_eq!(connected(&[connection(0), connection(1)]), Ok(()));
        // A telegram type of the profile, S-0-0015, needs no list.
        let mut profile = ConnectionConfig::new(0, true, &[]).unwrap();
        profile.configuration = ConfigurationType::Profile;
        assert_eq!(profile.setup().bits(), 0xC020);
        assert_eq!(connected(&[profile]), Ok(()));
        assert_eq!(ConnectionConfig::new(0, true, &[Idn(1); 17]), None);
        let room =
            |instance, len| super::super::layout::ConnectionNeed { instance, slave_produces: true, len };
        let kept = |room: &[super::super::layout::ConnectionNeed]| {
            let need = SlaveNeed { connections: room.iter().copied().collect(), ..SlaveNeed::default() };
            with(&[SlaveConfig { hot_plug: Some(need), ..slave(1) }])
        };
        assert_eq!(kept(&[room(0, 8), room(1, 256)]), Ok(()));
        assert_eq!(
            kept(&[room(0, 8), room(0, 8)]),
            Err(ConfigError::DoubleInstance { address: 1, instance: 0 })
        );
        for length in [0, 7, 258] {
            let wanted = ConfigError::Room { address: 1, instance: 3, length };
            assert_eq!(kept(&[room(3, length)]), Err(wanted));
        }
        let short = MasterConfig { pause: DurationNs::from_millis(119), ..base.clone() };
        assert_eq!(short.check(), Err(ConfigError::Pause(DurationNs::from_millis(119))));
        let shaky = MasterConfig { mst_jitter_ns: 1_000_000, ..base };
        assert_eq!(shaky.check(), Err(ConfigError::Jitter { nanoseconds: 1_000_000, cycle_ns: 1_000_000 }));
    }
}
