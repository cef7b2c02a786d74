//! What the master knows of one slave.

use arrayvec::ArrayVec;

use super::config::{CONNECTIONS_MAX, ConnectionConfig, Connections, MasterConfig, SlaveConfig};
use super::connection::{ConsumerEnd, ProducerEnd};
use super::event::Invalid;
use super::layout::SlaveNeed;
use super::plan::{Cursor, Step};
use super::report::{REPORT_MAX, ReportRow};
use super::svc::ServiceChannel;
use crate::wire::device_control::{DeviceControl, Topology};
use crate::wire::device_status::DeviceStatus;
use crate::wire::header::Phase;
use crate::wire::scp::{ScpClass, ScpEntry};
use crate::wire::svc::AtSvc;

/// Connections of a slave with fixed configuration.
pub const CONNECTIONS_FIXED: u16 = 2;

/// SCP classes kept per slave; the written list of active classes then fits into a request.
pub const CLASSES_MAX: usize = 32;

/// Whether a slave takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Presence {
    /// It takes part.
    Active,
    /// It was valid and is not any more.
    Lost,
    /// The application has excluded it.
    Excluded,
    /// It has not been there since the scan; its place is kept for hot plug.
    Absent,
    /// It is on its way in by hot plug.
    Joining,
}

/// What a slave says about itself in CP2.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Facts {
    /// S-0-1302.0.1, function specific profile type: 1 I/O, 2 drive, 3 encoder, as far as known.
    pub fsp_type: Option<u32>,
    /// S-0-1000, SCP classes.
    pub classes: ArrayVec<ScpEntry, CLASSES_MAX>,
    /// Whether it has S-0-1036, inter frame gap.
    pub gap: bool,
    /// Connections which it has: by S-0-1051, or [`CONNECTIONS_FIXED`] without SCP_VarCFG; 0 when it does not report.
    pub connections: u16,
}

impl Facts {
    /// The lowest version of the class which the slave has, `None` without the class.
    #[must_use]
    pub fn version(&self, class: ScpClass) -> Option<u8> {
        self.classes.iter().filter(|entry| entry.class == class).map(|entry| entry.version).min()
    }

    /// Exactly one way to configure connections.
    pub(super) fn is_consistent(&self) -> bool {
        self.version(ScpClass::FIX_CFG).is_some() != self.version(ScpClass::VAR_CFG).is_some()
    }

    /// S-0-1050.x.1 belongs to the classes that configure, synchronize or watch connections.
    pub(super) fn has_setup(&self) -> bool {
        [ScpClass::VAR_CFG, ScpClass::SYNC, ScpClass::WATCHDOG, ScpClass::WATCHDOG_CONNECTION]
            .into_iter()
            .any(|class| self.version(class).is_some())
    }

    /// The list for S-0-1000.0.1: the lowest version of each class.
    pub(super) fn active_classes(&self) -> ArrayVec<u8, { 2 * CLASSES_MAX }> {
        self.classes
            .iter()
            .filter(|entry| self.version(entry.class) == Some(entry.version))
            .flat_map(|entry| entry.to_word().to_le_bytes())
            .collect()
    }
}

/// The master's end of a connection.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "both ends hold the connection's data")]
pub(super) enum End {
    Producer(ProducerEnd),
    Consumer(ConsumerEnd),
}

/// How far a slave is in the present list of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Work {
    /// The next step can be asked for.
    Free,
    /// This step is with the service channel.
    Asked(Step, u8),
    Done,
    Failed,
}

/// What the telegrams of the last cycle said about a slave, and what those of the next one tell it.
#[derive(Debug, Default)]
pub(super) struct Link {
    /// S-SVC of the last cycle; `None` when its AT did not come.
    pub svc: Option<AtSvc>,
    /// S-DEV of the last cycle; `None` when its AT did not come.
    pub status: Option<DeviceStatus>,
    /// Errors and warnings of S-DEV that the application knows of.
    pub reported: DeviceStatus,
    /// Commanded topology and handshake bit of C-DEV.
    pub command: DeviceControl,
    pub misses: u16,
    /// Routes on which the last cycle brought valid data, one bit each by [`super::topology::Route::index`].
    pub valid_routes: u8,
    /// Cycles in a row in which it was valid again since it was lost.
    pub valid_cycles: u16,
}

/// How far a slave is set up, and what came of it.
#[derive(Debug)]
pub(super) struct Setup {
    pub work: Work,
    pub cursor: Cursor,
    /// The SERCOS address that it is to be given in CP2.
    pub assign: Option<u16>,
    pub check_failed: bool,
    /// Connections, by their instance, whose setup the slave does not let anybody write.
    pub fixed_setups: u32,
    /// S-0-0127 went through since the last scan: the slave will enter CP3 with the places it was told.
    pub checked: bool,
    /// Rows of the report that come from the first reading; a new attempt keeps them.
    pub read_rows: usize,
    /// At most [`REPORT_MAX`] rows, for which the room is set aside.
    pub report: Vec<ReportRow>,
    /// Buffer of the master's own list requests.
    pub list: Vec<u8>,
    /// S-0-0021 or S-0-0022 after a failed check.
    pub invalid: Invalid,
}

impl Setup {
    /// Nothing is done yet. The buffers are kept, because nothing is allocated once the master runs.
    fn new(report: Vec<ReportRow>, list: Vec<u8>) -> Setup {
        Setup {
            work: Work::Done,
            cursor: Cursor::default(),
            assign: None,
            check_failed: false,
            fixed_setups: 0,
            checked: false,
            read_rows: 0,
            report,
            list,
            invalid: Invalid::default(),
        }
    }

    fn clear(&mut self) {
        self.report.clear();
        *self = Setup::new(core::mem::take(&mut self.report), core::mem::take(&mut self.list));
    }

    /// Keeps a row of the report.
    pub fn note(&mut self, row: ReportRow) {
        // The report is for people: rows that do not fit are left out.
        if self.report.len() < REPORT_MAX {
            self.report.push(row);
        }
    }
}

/// One slave. What every cycle touches stands together at the beginning, in as few cache lines as it fits into.
#[derive(Debug)]
#[repr(C)]
pub(super) struct Station {
    pub channel: ServiceChannel,
    pub link: Link,
    pub presence: Presence,
    pub ends: ArrayVec<End, CONNECTIONS_MAX>,
    pub connections: Connections,
    pub address: u16,
    pub configured: bool,
    /// The configuration lets it come later.
    pub hot_plug: bool,
    pub facts: Facts,
    pub need: SlaveNeed,
    pub setup: Setup,
}

impl Station {
    /// Storage for one slave.
    pub fn new(config: &MasterConfig) -> Station {
        Station {
            address: 0,
            presence: Presence::Active,
            configured: false,
            hot_plug: false,
            connections: Connections::new(),
            facts: Facts::default(),
            need: SlaveNeed::default(),
            ends: ArrayVec::new(),
            channel: ServiceChannel::new(config.svc),
            link: Link::default(),
            setup: Setup::new(Vec::with_capacity(REPORT_MAX), Vec::with_capacity(config.list_capacity)),
        }
    }

    /// Makes it a slave that has just been found. Outcomes that wait for the application stay.
    pub fn found(&mut self, address: u16, config: Option<&SlaveConfig>) {
        self.address = address;
        self.presence = Presence::Active;
        self.configured = config.is_some();
        self.hot_plug = config.is_some_and(|config| config.hot_plug.is_some());
        self.connections.clear();
        if let Some(config) = config {
            self.connections.extend(config.connections.iter().cloned());
        }
        self.facts = Facts::default();
        self.need = SlaveNeed::default();
        self.ends.clear();
        self.channel.rest(false);
        self.link = Link::default();
        self.setup.clear();
    }

    pub fn is_active(&self) -> bool {
        self.presence == Presence::Active
    }

    /// It takes part, or is on its way in: its service channel is served.
    pub fn is_served(&self) -> bool {
        matches!(self.presence, Presence::Active | Presence::Joining)
    }

    /// It is spoken to. One that was lost in CP4 may hear every word: it is told what the application wants of it, which is to
    /// stop, until it is heard again or known to have left.
    pub fn is_addressed(&self, phase: Phase) -> bool {
        self.is_served() || phase == Phase::CP4 && self.presence == Presence::Lost
    }

    /// It is not there and can come in by hot plug.
    pub fn may_come(&self) -> bool {
        match self.presence {
            Presence::Absent => true,
            Presence::Lost => self.hot_plug || self.facts.version(ScpClass::HOT_PLUG).is_some(),
            Presence::Active | Presence::Excluded | Presence::Joining => false,
        }
    }

    /// Commands a topology: the bits change and the handshake bit toggles.
    pub fn command_topology(&mut self, topology: Topology) {
        self.link.command = self.link.command.with_topology(topology);
        self.link.command.toggle(DeviceControl::TOPOLOGY_CHANGE);
    }

    /// Whether S-DEV shows what was commanded.
    pub fn follows_command(&self) -> bool {
        self.link.status.is_some_and(|status| {
            status.contains(DeviceStatus::TOPOLOGY_CHANGE)
                == self.link.command.contains(DeviceControl::TOPOLOGY_CHANGE)
                && status.topology() == self.link.command.topology()
        })
    }

    pub fn connection(&self, instance: u8) -> Option<&ConnectionConfig> {
        self.connections.iter().find(|connection| connection.instance == instance)
    }

    /// Position of a connection in the configuration, and of its end.
    pub fn end(&mut self, instance: u8) -> Option<&mut End> {
        let index = self.connections.iter().position(|connection| connection.instance == instance)?;
        self.ends.get_mut(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lowest_version_of_each_class_is_activated() {
        let mut facts = Facts::default();
        for word in [0x0201, 0x0302, 0x0301, 0x0A02] {
            facts.classes.push(ScpEntry::from_word(word));
        }
        assert_eq!(facts.active_classes().as_slice(), [0x01, 0x02, 0x01, 0x03, 0x02, 0x0A]);
        assert_eq!(facts.version(ScpClass::SYNC), Some(1));
        assert_eq!(facts.version(ScpClass::HOT_PLUG), None);
        assert!(facts.is_consistent());
        facts.classes.push(ScpEntry::from_word(0x0101));
        assert!(!facts.is_consistent());
        assert!(!Facts::default().is_consistent());
    }
}
