//! What the master is told about its network.

use std::collections::BTreeMap;

use profile_generic::can::Id;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::sdo::request::SdoData;
pub use crate::wire::pdo::Direction;
use crate::wire::pdo::{MAPPING_MAX, PDO_LEN_MAX, PDO_NUMBER_MAX, mapped_len};
use crate::wire::pdo::{MappingEntry, TransmissionType};
use crate::wire::sync::COUNTER_MAX;
use crate::wire::{Function, Mux, NodeId, cob_id};

/// Most PDOs of a device, each way.
pub const PDOS_MAX: usize = 16;

/// Most requests of the application that a device can have waiting.
pub const QUEUE_MAX: usize = 16;

/// Lengths of FD frames beyond eight bytes.
const FD_LENGTHS: [usize; 7] = [12, 16, 20, 24, 32, 48, 64];

/// SYNC: its period, synchronous window and counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SyncConfig {
    /// Time between two SYNCs (1006), nanoseconds; whole microseconds.
    pub period_ns: u32,
    /// Synchronous window (1007): TPDOs that come later after a SYNC are late; 0 for the whole period. Whole microseconds.
    pub window_ns: u32,
    /// Counter overflow (1019): 0 for no counter, else 2 to 240.
    pub counter_overflow: u8,
}

/// Whether the mapping of a PDO is written, and what to do when a device does not take it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum MappingPolicy {
    /// It is written; a device that does not take it does not come up.
    #[default]
    Exact,
    /// It is not written: the device has it already, or does not come up. Of the communication parameters it need not take what it
    /// has.
    Keep,
    /// The mapping that it has is used. The application is told before the device starts, and must read what that is.
    Adopt,
}

/// One PDO of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PdoConfig {
    /// Number, 1 to 512: its parameters stand at 1400 + number - 1 and so on.
    pub number: u16,
    /// Identifier; `None` for the one of the default connection set, which PDOs 1 to 4 have.
    pub id: Option<Id>,
    /// Transmission type.
    pub transmission: TransmissionType,
    /// Types that do as well: they are tried in this order where the device refuses that one, and one that it has and does not
    /// let be changed is taken.
    pub others: &'static [TransmissionType],
    /// TPDO: shortest time between two, 100 microseconds.
    pub inhibit_100us: u16,
    /// RPDO: event timer, ms; TPDO: event timer of an event-driven one, ms. 0 for none.
    pub event_timer_ms: u16,
    /// TPDO: counter value of the SYNC that cycles are counted from; 0 for any.
    pub sync_start: u8,
    /// What is in it.
    pub mapping: Vec<MappingEntry>,
    /// Whether that is written, and what if the device does not take it.
    pub policy: MappingPolicy,
    /// TPDO: how many may be missing in a row before the application is told.
    pub allowed_losses: u16,
    /// Event-driven TPDO: longest time between two, ms; 0 for no limit.
    pub deadline_ms: u16,
}

impl PdoConfig {
    /// A PDO at every SYNC, with the default identifier.
    #[must_use]
    pub fn cyclic(number: u16, mapping: Vec<MappingEntry>) -> Self {
        Self {
            number,
            id: None,
            transmission: TransmissionType::EVERY_SYNC,
            others: &[],
            inhibit_100us: 0,
            event_timer_ms: 0,
            sync_start: 0,
            mapping,
            policy: MappingPolicy::Exact,
            allowed_losses: 1,
            deadline_ms: 0,
        }
    }

    /// Its identifier; `None` when it has none of its own and none by default.
    #[must_use]
    pub fn id(&self, direction: Direction, node: NodeId) -> Option<Id> {
        self.id.or_else(|| match direction {
            Direction::Receive => cob_id::rpdo(self.number, node),
            Direction::Transmit => cob_id::tpdo(self.number, node),
        })
    }
}

/// What a device must be; `None` is not compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Expected {
    /// 1000.
    pub device_type: Option<u32>,
    /// The device profile in 1000, its low 16 bits. What stands above differs from drive to drive.
    pub profile: Option<u16>,
    /// 1018:1.
    pub vendor: Option<u32>,
    /// 1018:2.
    pub product: Option<u32>,
    /// 1018:3.
    pub revision: Option<u32>,
    /// 1018:4.
    pub serial: Option<u32>,
}

impl Expected {
    /// Any drive: the device profile is 402, whatever 1000 says beside it.
    pub const DRIVE: Self = Self {
        device_type: None,
        profile: Some(402),
        vendor: None,
        product: None,
        revision: None,
        serial: None,
    };
}

/// One value of a device's configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Write {
    /// Index and sub-index.
    pub object: Mux,
    /// Its bytes, at least one.
    pub data: SdoData,
}

/// The program that a device must have (1F55, 1F58).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramConfig {
    /// What it must report in 1F56:1, not 0.
    pub identification: u32,
    /// The program for a device that tells something else; `None` permits no download.
    pub image: Option<SdoData>,
    /// Longest time from the stop of the old program to the start of the new one.
    pub time: DurationNs,
}

/// When a device was configured (1020, 1F26, 1F27).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    /// Days since 1984-01-01.
    pub date: u32,
    /// Milliseconds after midnight.
    pub time: u32,
}

/// The device's heartbeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HeartbeatConfig {
    /// Time between two (1017), ms.
    pub producer_ms: u16,
    /// Time after which it is missed, ms.
    pub timeout_ms: u16,
}

/// Node guarding, for devices without a heartbeat: the master asks by a remote frame, and the device answers with its state and a
/// bit that alternates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GuardingConfig {
    /// Time between two requests (100C), ms.
    pub guard_time_ms: u16,
    /// Guard times without an answer after which the device is lost, or the master if no request comes (100D); at least 2.
    pub life_time_factor: u8,
}

/// One device of the network (1F81 and following).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeConfig {
    /// Its node-id.
    pub node: NodeId,
    /// Whether the network needs it.
    pub mandatory: bool,
    /// Whether it may stay in operation if it is when the master starts: it is not reset, and its PDOs are only read.
    pub keep_alive: bool,
    /// What it must be.
    pub expected: Expected,
    /// The program that it must have; `None` is not compared.
    pub program: Option<ProgramConfig>,
    /// If the device tells this in 1020, its configuration is not written again.
    pub stamp: Option<Stamp>,
    /// Its configuration, in the order of writing.
    pub writes: Vec<Write>,
    /// Whether it is told to keep its configuration (1010:1) when it was written. Only with a stamp, which it then must take: what
    /// is written again at every boot-up would wear out its memory.
    pub store: bool,
    /// Its heartbeat; `None` leaves it as it is and watches nothing.
    pub heartbeat: Option<HeartbeatConfig>,
    /// Node guarding, in place of a heartbeat.
    pub guarding: Option<GuardingConfig>,
    /// PDOs that it receives.
    pub rpdos: Vec<PdoConfig>,
    /// PDOs that it transmits.
    pub tpdos: Vec<PdoConfig>,
}

impl NodeConfig {
    /// A device that the network needs, of any kind, without PDOs and heartbeat.
    #[must_use]
    pub fn new(node: NodeId) -> Self {
        Self {
            node,
            mandatory: true,
            keep_alive: false,
            expected: Expected::default(),
            program: None,
            stamp: None,
            writes: vec![],
            store: false,
            heartbeat: None,
            guarding: None,
            rpdos: vec![],
            tpdos: vec![],
        }
    }

    /// How long it may say nothing of its state; `None` when it is not watched.
    #[must_use]
    pub fn silence_max(&self) -> Option<DurationNs> {
        let guarding =
            self.guarding.map(|guard| i64::from(guard.guard_time_ms) * i64::from(guard.life_time_factor));
        let milliseconds = self.heartbeat.map(|heartbeat| heartbeat.timeout_ms.into()).or(guarding);
        milliseconds.map(DurationNs::from_millis)
    }

    /// Its PDOs one way.
    #[must_use]
    pub fn pdos(&self, direction: Direction) -> &[PdoConfig] {
        match direction {
            Direction::Receive => &self.rpdos,
            Direction::Transmit => &self.tpdos,
        }
    }
}

/// The master's own heartbeat, by which devices know that it is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MasterHeartbeat {
    /// The master's node-id.
    pub node: NodeId,
    /// Time between two, ms.
    pub producer_ms: u16,
    /// Time after which devices miss it (1016:1), ms.
    pub timeout_ms: u16,
}

/// When devices are started (1F80).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StartPolicy {
    /// Each as soon as it is ready.
    #[default]
    Each,
    /// When all mandatory ones are ready.
    Together,
}

/// What is done to the others when a mandatory device does not come up or is lost (1F80).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MandatoryError {
    /// Nothing: the application decides.
    #[default]
    Report,
    /// All devices are stopped.
    StopAll,
    /// All devices are reset and brought up again.
    ResetAll,
}

/// The network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MasterConfig {
    /// Its devices.
    pub nodes: Vec<NodeConfig>,
    /// SYNC, which the master produces; `None` for a network without.
    pub sync: Option<SyncConfig>,
    /// The master's heartbeat.
    pub heartbeat: Option<MasterHeartbeat>,
    /// `Some(fast)`: PDOs go in FD frames and may have 64 bytes; `fast` switches to the higher bit rate.
    pub fd: Option<bool>,
    /// When devices are started.
    pub start: StartPolicy,
    /// What if a mandatory one is missing.
    pub mandatory_error: MandatoryError,
    /// Longest time for an answer by SDO.
    pub sdo_timeout: DurationNs,
    /// Longest wait for the boot-up message after a reset.
    pub boot_up_time: DurationNs,
    /// Wait before a device that does not answer is asked again, or that was lost is reset.
    pub retry_time: DurationNs,
    /// Time after which a device that does not answer is given up, from its reset or its boot-up on (1F89); zero for never.
    pub boot_time: DurationNs,
    /// SDO frames per SYNC period, of all devices together. Zero for as many as the bus takes.
    pub sdo_frames_per_cycle: u8,
    /// EMCYs per device and second that are told one by one.
    pub emcy_per_second: u8,
    /// Whether it listens for another master before its first frame ([`LISTEN`](super::foreign::LISTEN)). Without, on a bus that
    /// nobody else can be on.
    pub listens: bool,
}

impl Default for MasterConfig {
    fn default() -> Self {
        Self {
            nodes: vec![],
            sync: None,
            heartbeat: None,
            fd: None,
            start: StartPolicy::Each,
            mandatory_error: MandatoryError::Report,
            sdo_timeout: DurationNs::from_millis(500),
            boot_up_time: DurationNs::from_millis(1000),
            retry_time: DurationNs::from_millis(1000),
            boot_time: DurationNs::from_millis(10_000),
            sdo_frames_per_cycle: 2,
            emcy_per_second: 16,
            listens: true,
        }
    }
}

/// Why a configuration is not acceptable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// A node-id is given twice, the master's own included.
    #[error("node-id {0} is given twice")]
    DoubleNode(NodeId),
    /// SYNC's times are not possible.
    #[error(
        "SYNC: expected a period of at least 100 us in whole microseconds and a window not above it, got {period_ns} ns and {window_ns} ns"
    )]
    SyncTimes {
        /// Communication cycle period (1006), ns.
        period_ns: u32,
        /// Synchronous window length (1007), ns.
        window_ns: u32,
    },
    /// The counter overflow is not possible.
    #[error("SYNC: expected a counter overflow of 0 or 2 to 240, got {0}")]
    CounterOverflow(u8),
    /// A heartbeat is missed before it is due, or has no time.
    #[error(
        "node {node}: expected a heartbeat time and a longer time-out, got {producer_ms} ms and {timeout_ms} ms"
    )]
    Heartbeat {
        /// The device, or the master.
        node: NodeId,
        /// Time between two.
        producer_ms: u16,
        /// Time-out.
        timeout_ms: u16,
    },
    /// Node guarding has no time, or one answer that is lost would be one too many.
    #[error(
        "node {node}: expected a guard time and a life time factor of at least 2, got {guard_time_ms} ms and {life_time_factor}"
    )]
    Guarding {
        /// The device.
        node: NodeId,
        /// Guard time (100C), ms.
        guard_time_ms: u16,
        /// Life time factor (100D): guard times until the device counts as lost.
        life_time_factor: u8,
    },
    /// A device is watched in two ways.
    #[error("node {0}: expected a heartbeat or node guarding, got both")]
    TwoErrorControls(NodeId),
    /// A program has no bytes, or no identification.
    #[error("node {0}: expected a program with a software identification other than 0 and at least one byte")]
    EmptyProgram(NodeId),
    /// A configuration is to be stored, and nothing would tell that it is there already.
    #[error("node {0}: expected a date and time of the configuration that is stored, got none")]
    StoreUnstamped(NodeId),
    /// A value to write has no bytes.
    #[error("node {node}: nothing to write to {object}")]
    EmptyWrite {
        /// The device.
        node: NodeId,
        /// Index and sub-index.
        object: Mux,
    },
    /// More PDOs than there is room for.
    #[error("node {node}: expected at most {PDOS_MAX} {direction}s, got {found}")]
    TooManyPdos {
        /// The device.
        node: NodeId,
        /// Which.
        direction: Direction,
        /// How many.
        found: usize,
    },
    /// A PDO is not possible.
    #[error("node {node} {direction} {number}: {reason}")]
    Pdo {
        /// The device.
        node: NodeId,
        /// Which way.
        direction: Direction,
        /// Its number.
        number: u16,
        /// Why.
        reason: PdoError,
    },
}

/// Why a PDO is not possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PdoError {
    /// Not 1 to 512, or given twice.
    #[error("expected a number of 1 to 512, each once")]
    Number,
    /// It has no identifier, one that other services use, or one that another PDO has.
    #[error("expected an identifier of its own, 181h to 6DFh and not of another service")]
    Id,
    /// Reserved, by remote frame, or synchronous without SYNC.
    #[error("expected a transmission type of 0 to 240 with SYNC, or 254 or 255; got {0}")]
    Transmission(u8),
    /// The mapping does not make a frame.
    #[error("expected 1 to {max} whole bytes mapped, got {bits} bits")]
    Mapping {
        /// Bits mapped.
        bits: usize,
        /// Most bytes.
        max: usize,
    },
}

impl MasterConfig {
    /// When a device is given up that is asked from this moment on.
    pub(super) fn gives_up_at(&self, asked: MonotonicTime) -> Option<MonotonicTime> {
        (self.boot_time > DurationNs::ZERO).then(|| asked + self.boot_time)
    }

    /// Whether the network is possible.
    ///
    /// # Errors
    /// The first thing that is not.
    // Flat: one line per value, each with its error.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.check_sync()?;
        let mut taken = BTreeMap::new();
        let heartbeats = self.heartbeat.iter().map(|own| (own.node, own.producer_ms, own.timeout_ms));
        for (node, producer_ms, timeout_ms) in heartbeats {
            check_heartbeat(node, producer_ms, timeout_ms)?;
            taken.insert(node, ());
        }
        let mut ids = BTreeMap::new();
        for device in &self.nodes {
            let node = device.node;
            if taken.insert(node, ()).is_some() {
                return Err(ConfigError::DoubleNode(node));
            }
            if let Some(heartbeat) = device.heartbeat {
                check_heartbeat(node, heartbeat.producer_ms, heartbeat.timeout_ms)?;
            }
            if let Some(GuardingConfig { guard_time_ms, life_time_factor }) = device.guarding {
                if device.heartbeat.is_some() {
                    return Err(ConfigError::TwoErrorControls(node));
                }
                if guard_time_ms == 0 || life_time_factor < 2 {
                    return Err(ConfigError::Guarding { node, guard_time_ms, life_time_factor });
                }
            }
            let empty = |program: &ProgramConfig| {
                let image = program.image.as_ref();
                program.identification == 0 || image.is_some_and(|image| image.as_slice().is_empty())
            };
            if device.program.as_ref().is_some_and(empty) {
                return Err(ConfigError::EmptyProgram(node));
            }
            if device.store && device.stamp.is_none() {
                return Err(ConfigError::StoreUnstamped(node));
            }
            if let Some(write) = device.writes.iter().find(|write| write.data.as_slice().is_empty()) {
                return Err(ConfigError::EmptyWrite { node, object: write.object });
            }
            self.check_pdos(node, Direction::Receive, &device.rpdos, &mut ids)?;
            self.check_pdos(node, Direction::Transmit, &device.tpdos, &mut ids)?;
        }
        Ok(())
    }

    fn check_sync(&self) -> Result<(), ConfigError> {
        let Some(SyncConfig { period_ns, window_ns, counter_overflow }) = self.sync else { return Ok(()) };
        let whole = period_ns.is_multiple_of(1000) && window_ns.is_multiple_of(1000);
        if period_ns < 100_000 || window_ns > period_ns || !whole {
            return Err(ConfigError::SyncTimes { period_ns, window_ns });
        }
        if counter_overflow == 1 || counter_overflow > COUNTER_MAX {
            return Err(ConfigError::CounterOverflow(counter_overflow));
        }
        Ok(())
    }

    /// Most bytes of a PDO.
    pub(super) fn pdo_len_max(&self) -> usize {
        if self.fd.is_some() { 64 } else { PDO_LEN_MAX }
    }

    /// Whether a PDO can have these entries; its length.
    pub(super) fn check_mapping(&self, mapping: &[MappingEntry]) -> Result<usize, PdoError> {
        let max = self.pdo_len_max();
        let bits = mapping.iter().map(|entry| usize::from(entry.bits())).sum();
        let len = mapped_len(mapping).filter(|&len| {
            let fits = len <= PDO_LEN_MAX || FD_LENGTHS.contains(&len);
            (1..=max).contains(&len) && fits && mapping.len() <= MAPPING_MAX
        });
        len.ok_or(PdoError::Mapping { bits, max })
    }

    fn check_pdos(
        &self,
        node: NodeId,
        direction: Direction,
        pdos: &[PdoConfig],
        ids: &mut BTreeMap<u64, ()>,
    ) -> Result<(), ConfigError> {
        if pdos.len() > PDOS_MAX {
            return Err(ConfigError::TooManyPdos { node, direction, found: pdos.len() });
        }
        for (place, pdo) in pdos.iter().enumerate() {
            let check = || {
                let twice = pdos[..place].iter().any(|other| other.number == pdo.number);
                if !(1..=PDO_NUMBER_MAX).contains(&pdo.number) || twice {
                    return Err(PdoError::Number);
                }
                let id = pdo.id(direction, node).filter(|&id| is_free(id)).ok_or(PdoError::Id)?;
                let kind = pdo.transmission;
                let synchronous = kind.is_synchronous() && !kind.is_remote();
                if !(kind.is_event_driven() || synchronous && self.sync.is_some()) {
                    return Err(PdoError::Transmission(kind.0));
                }
                self.check_mapping(&pdo.mapping)?;
                Ok(id)
            };
            let error = |reason| ConfigError::Pdo { node, direction, number: pdo.number, reason };
            let id = check().map_err(error)?;
            let key = match id {
                Id::Standard(id) => u64::from(id),
                Id::Extended(id) => u64::from(id) | 1 << 32,
            };
            if ids.insert(key, ()).is_some() {
                return Err(error(PdoError::Id));
            }
        }
        Ok(())
    }
}

fn check_heartbeat(node: NodeId, producer_ms: u16, timeout_ms: u16) -> Result<(), ConfigError> {
    if producer_ms == 0 || timeout_ms <= producer_ms {
        return Err(ConfigError::Heartbeat { node, producer_ms, timeout_ms });
    }
    Ok(())
}

/// Whether a PDO may have this identifier.
fn is_free(id: Id) -> bool {
    match id {
        Id::Extended(_) => id.is_valid(),
        Id::Standard(number) => {
            let kind = Function::of(id);
            let of_pdos = matches!(kind, None | Some(Function::Tpdo(..) | Function::Rpdo(..)));
            of_pdos && (0x181..0x6E0).contains(&number) && number != 0x580 && number != 0x600
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(number: u8) -> NodeId {
        NodeId::new(number).unwrap()
    }

    fn position(number: u16) -> PdoConfig {
        PdoConfig::cyclic(number, vec![MappingEntry(0x6041_0010), MappingEntry(0x6064_0020)])
    }

    fn network() -> MasterConfig {
        let sync = Some(SyncConfig { period_ns: 2_000_000, window_ns: 0, counter_overflow: 0 });
        let device = |number| NodeConfig {
            rpdos: vec![position(1)],
            tpdos: vec![position(1)],
            ..NodeConfig::new(node(number))
        };
        MasterConfig { nodes: vec![device(1), device(2)], sync, ..MasterConfig::default() }
    }

    /// What is said about the network with one thing changed.
    fn said(change: impl FnOnce(&mut MasterConfig)) -> String {
        let mut config = network();
        change(&mut config);
        config.check().map_or_else(|error| error.to_string(), |()| "good".into())
    }

    #[test]
    fn every_mistake_is_named() {
        let pdo = |change: fn(&mut PdoConfig)| said(move |config| change(&mut config.nodes[1].tpdos[0]));
        let cases = [
            said(|_| {}),
            said(|config| config.nodes[1].node = node(1)),
            said(|config| {
                config.heartbeat = Some(MasterHeartbeat { node: node(2), producer_ms: 10, timeout_ms: 20 });
            }),
            said(|config| config.sync = None),
            said(|config| {
                config.sync = Some(SyncConfig { period_ns: 2_000_500, window_ns: 0, counter_overflow: 0 })
            }),
            said(|config| {
                config.sync = Some(SyncConfig { period_ns: 2_000_000, window_ns: 0, counter_overflow: 1 })
            }),
            said(|config| {
                config.nodes[0].heartbeat = Some(HeartbeatConfig { producer_ms: 100, timeout_ms: 100 })
            }),
            said(|config| {
                config.nodes[0].guarding = Some(GuardingConfig { guard_time_ms: 100, life_time_factor: 1 })
            }),
            said(|config| {
                config.nodes[0].heartbeat = Some(HeartbeatConfig { producer_ms: 50, timeout_ms: 100 });
                config.nodes[0].guarding = Some(GuardingConfig { guard_time_ms: 100, life_time_factor: 3 });
            }),
            said(|config| {
                let time = DurationNs::from_secs(1);
                let image = Some(SdoData::default());
                config.nodes[0].program = Some(ProgramConfig { identification: 1, image, time });
            }),
            said(|config| {
                config.nodes[0].writes =
                    vec![Write { object: Mux::new(0x6060, 0), data: SdoData::default() }];
            }),
            said(|config| config.nodes[0].store = true),
            said(|config| config.nodes[0].tpdos = vec![position(1); 17]),
            said(|config| config.nodes[0].tpdos = vec![position(1); 2]),
            pdo(|pdo| pdo.number = 5),
            pdo(|pdo| pdo.number = 0),
            pdo(|pdo| pdo.id = Some(Id::Standard(0x201))),
            pdo(|pdo| pdo.id = Some(Id::Standard(0x582))),
            pdo(|pdo| pdo.id = Some(Id::Standard(0x180))),
            pdo(|pdo| pdo.transmission = TransmissionType(245)),
            pdo(|pdo| pdo.transmission = TransmissionType::RTR_SYNC),
            pdo(|pdo| pdo.mapping.clear()),
            pdo(|pdo| pdo.mapping.push(MappingEntry(0x6064_0020))),
            pdo(|pdo| pdo.mapping.push(MappingEntry(0x0001_0001))),
        ];
        insta::assert_snapshot!(cases.join("\n"));
    }

    #[test]
    fn fd_frames_carry_more() {
        let long = |config: &mut MasterConfig, entries: usize| {
            config.fd = Some(true);
            config.nodes[1].tpdos[0].mapping = vec![MappingEntry(0x6064_0020); entries];
        };
        assert_eq!(said(|config| long(config, 16)), "good");
        let text = said(|config| long(config, 7));
        assert_eq!(text, "node 2 TPDO 1: expected 1 to 64 whole bytes mapped, got 224 bits");
    }
}
