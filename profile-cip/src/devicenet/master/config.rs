//! What the master is told before it starts.

use arrayvec::ArrayVec;
use profile_generic::can::timing::{BitRate, Bits, Shape};
use profile_generic::time::DurationNs;

use super::super::connection::{ConnectionKind, TIMEOUT_MULTIPLIER};
use super::super::fragmentation::{ACKNOWLEDGE_TIMEOUT, IO_FRAGMENT_MAX, IO_MAX, IO_UNFRAGMENTED_MAX};
use super::super::wire::{AllocationChoice, MacId};

/// Most slaves: every MAC ID but the master's.
pub const SLAVES_MAX: usize = MacId::COUNT - 1;

/// Most I/O connections of a slave.
pub const CONNECTIONS_MAX: usize = 3;

/// Data rate of the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum DataRate {
    /// 125 kbit/s.
    #[default]
    Rate125,
    /// 250 kbit/s.
    Rate250,
    /// 500 kbit/s.
    Rate500,
}

impl DataRate {
    /// Bits a second.
    #[must_use]
    pub const fn bits_per_second(self) -> u32 {
        match self {
            Self::Rate125 => 125_000,
            Self::Rate250 => 250_000,
            Self::Rate500 => 500_000,
        }
    }

    /// Value of attribute 2 of the DeviceNet object.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Rate125 => 0,
            Self::Rate250 => 1,
            Self::Rate500 => 2,
        }
    }
}

/// Who a slave has to be; what is `None` is not looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExpectedIdentity {
    /// Vendor ID.
    pub vendor: Option<u16>,
    /// Device type.
    pub device_type: Option<u16>,
    /// Product code.
    pub product_code: Option<u16>,
}

/// An I/O connection with a slave.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IoConfig {
    /// Poll, bit strobe or change of state.
    pub kind: ConnectionKind,
    /// Of a change of state connection: it is a cyclic one.
    pub cyclic: bool,
    /// Of a change of state connection: what the slave sends is acknowledged.
    pub acknowledged: bool,
    /// Bytes to the slave. A bit strobe has one byte, of which bit 0 goes out; change of state has none.
    pub output: usize,
    /// Bytes from the slave.
    pub input: usize,
    /// Expected packet rate that the slave is given, ms. Its watchdog is four times that.
    pub rate_ms: u16,
    /// The slave is asked in every so many cycles, 1 or more.
    pub every: u16,
    /// Assemblies that the messages to the slave and from it have to be; `None` where the profile has no other.
    pub assemblies: Option<[u8; 2]>,
}

impl IoConfig {
    /// A poll connection that is asked in every cycle.
    #[must_use]
    pub const fn poll(output: usize, input: usize, rate_ms: u16) -> Self {
        let kind = ConnectionKind::Poll;
        Self { kind, cyclic: false, acknowledged: true, output, input, rate_ms, every: 1, assemblies: None }
    }

    /// Its bit of the allocation choice.
    #[must_use]
    pub const fn choice(&self) -> AllocationChoice {
        match self.kind {
            ConnectionKind::Explicit => AllocationChoice::EXPLICIT,
            ConnectionKind::Poll => AllocationChoice::POLL,
            ConnectionKind::BitStrobe => AllocationChoice::BIT_STROBE,
            ConnectionKind::ChangeOfState => {
                let kind =
                    if self.cyclic { AllocationChoice::CYCLIC } else { AllocationChoice::CHANGE_OF_STATE };
                let silent = AllocationChoice::ACKNOWLEDGE_SUPPRESSION;
                if self.acknowledged { kind } else { kind.union(silent) }
            }
        }
    }

    /// Bits of one exchange on the wire, at most.
    fn bits(&self) -> u32 {
        let command = match self.kind {
            ConnectionKind::BitStrobe => 0,
            _ => message_bits(self.output),
        };
        command.saturating_add(message_bits(self.input))
    }
}

/// Frames of one message.
const fn message_frames(len: usize) -> usize {
    if len <= IO_UNFRAGMENTED_MAX { 1 } else { len.div_ceil(IO_FRAGMENT_MAX) }
}

/// Bits of the frames of one message, at most.
fn message_bits(len: usize) -> u32 {
    let frame = |len| Shape::classic(len).map_or(0, |shape| shape.most().nominal);
    if len <= IO_UNFRAGMENTED_MAX {
        return frame(len);
    }
    let whole = u32::try_from(len / IO_FRAGMENT_MAX).unwrap_or(0);
    let rest = len % IO_FRAGMENT_MAX;
    whole * frame(IO_FRAGMENT_MAX + 1) + if rest == 0 { 0 } else { frame(rest + 1) }
}

/// A slave: its MAC ID, what it must be, and its connections.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlaveConfig {
    /// Its MAC ID.
    pub mac: MacId,
    /// Who it has to be.
    pub identity: ExpectedIdentity,
    /// Its I/O connections, at most one of each kind. Without any, it only answers requests.
    pub connections: ArrayVec<IoConfig, CONNECTIONS_MAX>,
    /// So many answers in a row may be missing before the slave counts as lost.
    pub missed_max: u8,
    /// So many cycles the last command is repeated when no new one is committed; then the slave is told that the master is
    /// idle. 0: a command goes out once.
    pub hold_cycles: u16,
}

impl SlaveConfig {
    /// A slave with a poll connection, two answers of which may be missing in a row, and commands that go out once.
    #[must_use]
    pub fn polled(mac: MacId, output: usize, input: usize, rate_ms: u16) -> Self {
        Self {
            mac,
            identity: ExpectedIdentity::default(),
            connections: ArrayVec::from_iter([IoConfig::poll(output, input, rate_ms)]),
            missed_max: 2,
            hold_cycles: 0,
        }
    }

    /// A slave of which the explicit connection alone is allocated.
    #[must_use]
    pub fn explicit(mac: MacId) -> Self {
        let identity = ExpectedIdentity::default();
        Self { mac, identity, connections: ArrayVec::new(), missed_max: 0, hold_cycles: 0 }
    }

    /// What is allocated of it.
    #[must_use]
    pub fn choice(&self) -> AllocationChoice {
        self.connections.iter().fold(AllocationChoice::EXPLICIT, |all, one| all | one.choice())
    }
}

/// Configuration of the master.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MasterConfig {
    /// Its MAC ID.
    pub mac: MacId,
    /// Its vendor ID, for the duplicate MAC ID check.
    pub vendor: u16,
    /// Its serial number, for the duplicate MAC ID check.
    pub serial: u32,
    /// Data rate of the network.
    pub rate: DataRate,
    /// Time from one poll to the next.
    pub cycle: DurationNs,
    /// Time to wait for the answer to a request on an explicit connection before it is sent once more, and then given up:
    /// more than the 2 s after which a server gives up a response in fragments.
    pub explicit_timeout: DurationNs,
    /// Time after which a slave that is missing, lost or refuses is asked again; it doubles with every vain attempt.
    pub retry: DurationNs,
    /// Longest such time.
    pub retry_max: DurationNs,
    /// After bus off it goes through the duplicate MAC ID check again, and otherwise stays off.
    pub bus_off_reset: bool,
    /// The slaves to allocate, each with a MAC ID of its own.
    pub slaves: Vec<SlaveConfig>,
}

/// Why a configuration cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// The cycle is no time, or more than a second.
    #[error("cycle: expected more than 0 and at most 1 s, got {0}")]
    Cycle(DurationNs),
    /// A time is too short.
    #[error("{what}: expected more than {above}, got {got}")]
    Time {
        /// Which one.
        what: &'static str,
        /// What it is.
        got: DurationNs,
        /// What it has to be above.
        above: DurationNs,
    },
    /// Two nodes have this MAC ID.
    #[error("MAC ID {0} is given twice")]
    DoubleMac(MacId),
    /// A connection that is none of the I/O connections.
    #[error("slave {0}: the explicit connection needs no configuration")]
    Explicit(MacId),
    /// Two connections of the same kind.
    #[error("slave {mac}: two of the kind {kind}")]
    DoubleConnection {
        /// The slave.
        mac: MacId,
        /// The kind.
        kind: ConnectionKind,
    },
    /// A length that the connection cannot have.
    #[error("slave {mac}, {kind}: expected {what} of at most {max} bytes, got {got}")]
    Length {
        /// The slave.
        mac: MacId,
        /// The connection.
        kind: ConnectionKind,
        /// Which length.
        what: &'static str,
        /// What it is.
        got: usize,
        /// The most.
        max: usize,
    },
    /// Without an expected packet rate the slave would go on for ever without its master.
    #[error("slave {mac}, {kind}: expected a packet rate of 1 ms or more, got 0")]
    NoWatchdog {
        /// The slave.
        mac: MacId,
        /// The connection.
        kind: ConnectionKind,
    },
    /// The slave would time out between two polls.
    #[error("slave {mac}, {kind}: the watchdog of {watchdog} is shorter than two polls, {interval} apart")]
    WatchdogTooShort {
        /// The slave.
        mac: MacId,
        /// The connection.
        kind: ConnectionKind,
        /// Four times the expected packet rate.
        watchdog: DurationNs,
        /// Time between two polls.
        interval: DurationNs,
    },
    /// The cyclic messages do not fit the cycle.
    #[error("the I/O messages of a cycle take {needed} on the wire, the cycle has {cycle}")]
    Load {
        /// Time on the wire, at most.
        needed: DurationNs,
        /// The cycle.
        cycle: DurationNs,
    },
}

impl MasterConfig {
    /// A master without slaves, with the usual times: 2.5 s for answers, one to eight seconds between attempts.
    #[must_use]
    pub fn new(mac: MacId, vendor: u16, serial: u32, rate: DataRate, cycle: DurationNs) -> Self {
        Self {
            mac,
            vendor,
            serial,
            rate,
            cycle,
            explicit_timeout: DurationNs::from_millis(2500),
            retry: DurationNs::from_secs(1),
            retry_max: DurationNs::from_secs(8),
            bus_off_reset: false,
            slaves: Vec::new(),
        }
    }

    /// Frames of the I/O messages of a cycle, when every slave is asked.
    #[must_use]
    pub fn io_frames(&self) -> usize {
        let connections = || self.slaves.iter().flat_map(|slave| &slave.connections);
        let strobe = usize::from(connections().any(|one| one.kind == ConnectionKind::BitStrobe));
        let output = |one: &IoConfig| match one.kind {
            ConnectionKind::BitStrobe => 0,
            _ => message_frames(one.output),
        };
        connections().map(|one| output(one) + message_frames(one.input)).sum::<usize>() + strobe
    }

    /// Time that the I/O messages of a cycle take on the wire at most, when every slave is asked.
    #[must_use]
    pub fn io_time(&self) -> DurationNs {
        let connections = || self.slaves.iter().flat_map(|slave| &slave.connections);
        let strobes = connections().any(|one| one.kind == ConnectionKind::BitStrobe);
        let strobe = if strobes { message_bits(IO_UNFRAGMENTED_MAX) } else { 0 };
        let nominal = connections().fold(strobe, |sum, one| sum.saturating_add(one.bits()));
        let rate = BitRate::classic(self.rate.bits_per_second());
        rate.map_or(DurationNs::MAX, |rate| rate.time(Bits { nominal, data: 0 }))
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first that cannot be.
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.cycle <= DurationNs::ZERO || self.cycle > DurationNs::from_secs(1) {
            return Err(ConfigError::Cycle(self.cycle));
        }
        let times = [
            ("time for an explicit answer", self.explicit_timeout, ACKNOWLEDGE_TIMEOUT * 2),
            ("retry", self.retry, DurationNs::ZERO),
            ("longest retry", self.retry_max, self.retry - DurationNs(1)),
        ];
        if let Some((what, got, above)) = times.into_iter().find(|(_, got, above)| got <= above) {
            return Err(ConfigError::Time { what, got, above });
        }
        let mut seen = [false; MacId::COUNT];
        for mac in core::iter::once(self.mac).chain(self.slaves.iter().map(|slave| slave.mac)) {
            if core::mem::replace(&mut seen[usize::from(mac.get())], true) {
                return Err(ConfigError::DoubleMac(mac));
            }
        }
        self.slaves.iter().try_for_each(|slave| self.check_slave(slave))?;
        let needed = self.io_time();
        if needed > self.cycle {
            return Err(ConfigError::Load { needed, cycle: self.cycle });
        }
        Ok(())
    }

    fn check_slave(&self, slave: &SlaveConfig) -> Result<(), ConfigError> {
        let mac = slave.mac;
        for (place, one) in slave.connections.iter().enumerate() {
            let kind = one.kind;
            let (output, input) = match kind {
                ConnectionKind::Explicit => return Err(ConfigError::Explicit(mac)),
                ConnectionKind::Poll => (IO_MAX, IO_MAX),
                ConnectionKind::BitStrobe => (1, IO_UNFRAGMENTED_MAX),
                ConnectionKind::ChangeOfState => (0, IO_MAX),
            };
            if slave.connections[..place].iter().any(|other| other.kind == kind) {
                return Err(ConfigError::DoubleConnection { mac, kind });
            }
            for (what, got, max) in [("output", one.output, output), ("input", one.input, input)] {
                if got > max {
                    return Err(ConfigError::Length { mac, kind, what, got, max });
                }
            }
            if one.rate_ms == 0 {
                return Err(ConfigError::NoWatchdog { mac, kind });
            }
            let watchdog = DurationNs::from_millis(i64::from(one.rate_ms)) * TIMEOUT_MULTIPLIER;
            let interval = self.cycle * i64::from(one.every.max(1));
            if kind != ConnectionKind::ChangeOfState && watchdog < interval * 2 {
                return Err(ConfigError::WatchdogTooShort { mac, kind, watchdog, interval });
            }
        }
        Ok(())
    }
}
