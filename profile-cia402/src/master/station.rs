//! What the master keeps of a device.

use arrayvec::ArrayVec;
use profile_generic::time::MonotonicTime;

use super::boot::{BootState, BootStatus};
use super::config::{Direction, MasterConfig, NodeConfig, PDOS_MAX};
use super::ends::{RpdoEnd, TpdoEnd};
use super::event::DuplicateSign;
use super::plan::{Step, steps_max};
use super::program::ProgramStep;
use super::queue::Queue;
use super::relapse::Relapse;
use super::report::ReportRow;
use crate::sdo::client::{Client, ClientConfig};
use crate::wire::emcy::Emcy;
use crate::wire::nmt::{NmtCommand, NmtState};
use crate::wire::pdo::{MAPPING_MAX, MappingEntry, TransmissionType};
use crate::wire::{CobId, NodeId};

/// Most rows of a report.
pub const REPORT_MAX: usize = 512;

/// Whose transfer the client carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Work {
    Free,
    /// A step of the boot-up.
    Step(Step),
    /// A request of the application.
    Application,
}

/// EMCYs told one by one in a second.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EmcyLimit {
    second: u64,
    told: u32,
}

/// What to do with an EMCY.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EmcyVerdict {
    Tell,
    /// It is the first one too many.
    Storm,
    Suppress,
}

impl EmcyLimit {
    pub fn count(&mut self, now: MonotonicTime, per_second: u8) -> EmcyVerdict {
        let second = now.0 / 1_000_000_000;
        if second != self.second {
            *self = Self { second, told: 0 };
        }
        self.told = self.told.saturating_add(1);
        match self.told.cmp(&(u32::from(per_second) + 1)) {
            core::cmp::Ordering::Less => EmcyVerdict::Tell,
            core::cmp::Ordering::Equal => EmcyVerdict::Storm,
            core::cmp::Ordering::Greater => EmcyVerdict::Suppress,
        }
    }
}

/// A device of the list.
#[derive(Debug)]
pub(super) struct Station {
    pub node: NodeId,
    pub state: BootState,
    pub since: MonotonicTime,
    /// When the state runs out.
    pub deadline: Option<MonotonicTime>,
    /// When the boot time is over.
    pub give_up: Option<MonotonicTime>,
    pub client: Client,
    pub queue: Queue,
    pub work: Work,
    pub steps: Vec<Step>,
    /// The next one of the steps.
    pub at: usize,
    /// The step that goes before it.
    pub again: Option<Step>,
    /// It does not go before this.
    pub pause: Option<MonotonicTime>,
    /// It was given a program.
    pub programmed: bool,
    /// When there is no more time for the download that is under way.
    pub program_until: Option<MonotonicTime>,
    pub report: Vec<ReportRow>,
    /// The step that failed.
    pub failed: Option<ReportRow>,
    pub status: Option<BootStatus>,
    /// The application is through.
    pub proceed: bool,
    /// It was in operation when the master came.
    pub kept: bool,
    pub nmt: Option<NmtCommand>,
    pub device_type: Option<u32>,
    pub identity: [Option<u32>; 4],
    /// 1020 is what it should be.
    pub configured: bool,
    pub bit_30: bool,
    pub other: CobId,
    pub found: ArrayVec<MappingEntry, MAPPING_MAX>,
    pub found_count: usize,
    pub adopted: ArrayVec<(Direction, u16), { 2 * PDOS_MAX }>,
    /// PDOs with another transmission type than it was to have: PDO, that one, and its own.
    pub types: ArrayVec<(Direction, u16, TransmissionType, TransmissionType), { 2 * PDOS_MAX }>,
    pub tpdos: Vec<TpdoEnd>,
    pub rpdos: Vec<RpdoEnd>,
    /// What its heartbeat told last.
    pub heartbeat: Option<NmtState>,
    pub heartbeat_deadline: Option<MonotonicTime>,
    /// Node guarding: the next request.
    pub guard_at: Option<MonotonicTime>,
    /// Node guarding: bit 7 of the next answer; `None` for any.
    pub guard_toggle: Option<bool>,
    pub boot_up_at: Option<MonotonicTime>,
    pub relapse: Relapse,
    /// Command and object of the last answer that was asked for, unless one may still come that was given up.
    pub last_answer: Option<[u8; 4]>,
    /// Answers that came twice.
    pub strays: u8,
    pub signs: ArrayVec<DuplicateSign, 3>,
    pub emcy: Option<Emcy>,
    pub emcy_limit: EmcyLimit,
}

impl Station {
    pub fn new(config: &MasterConfig, node: &NodeConfig) -> Self {
        let client = ClientConfig { timeout: config.sdo_timeout, ..ClientConfig::default() };
        let mut station = Self {
            node: node.node,
            state: BootState::Off,
            since: MonotonicTime::ZERO,
            deadline: None,
            give_up: None,
            client: Client::new(client),
            queue: Queue::default(),
            work: Work::Free,
            steps: Vec::new(),
            at: 0,
            again: None,
            pause: None,
            programmed: false,
            program_until: None,
            report: Vec::with_capacity(REPORT_MAX),
            failed: None,
            status: None,
            proceed: false,
            kept: false,
            nmt: None,
            device_type: None,
            identity: [None; 4],
            configured: false,
            bit_30: false,
            other: CobId(0),
            found: ArrayVec::new(),
            found_count: 0,
            adopted: ArrayVec::new(),
            types: ArrayVec::new(),
            tpdos: Vec::new(),
            rpdos: Vec::new(),
            heartbeat: None,
            heartbeat_deadline: None,
            guard_at: None,
            guard_toggle: None,
            boot_up_at: None,
            relapse: Relapse::default(),
            last_answer: None,
            strays: 0,
            signs: ArrayVec::new(),
            emcy: None,
            emcy_limit: EmcyLimit::default(),
        };
        station.make_ends(node);
        station
    }

    /// Makes the ends of the PDOs as they are configured.
    pub fn make_ends(&mut self, node: &NodeConfig) {
        self.steps.reserve(steps_max(node).saturating_sub(self.steps.len()));
        self.tpdos = node.tpdos.iter().map(|pdo| TpdoEnd::new(pdo, node.node)).collect();
        self.rpdos = node.rpdos.iter().map(|pdo| RpdoEnd::new(pdo, node.node)).collect();
    }

    /// Gives a PDO the mapping that was read.
    pub fn take_mapping(&mut self, direction: Direction, place: usize) {
        match direction {
            Direction::Receive => {
                if let Some(end) = self.rpdos.get_mut(place) {
                    end.map(&self.found);
                }
            }
            Direction::Transmit => {
                if let Some(end) = self.tpdos.get_mut(place) {
                    end.map(&self.found);
                }
            }
        }
    }

    /// The transmission type of a PDO; by the configuration until the device has reported another one.
    pub fn transmission(&self, direction: Direction, place: usize) -> Option<TransmissionType> {
        match direction {
            Direction::Receive => self.rpdos.get(place).map(RpdoEnd::transmission),
            Direction::Transmit => self.tpdos.get(place).map(TpdoEnd::transmission),
        }
    }

    /// Gives a PDO another transmission type.
    pub fn take_transmission(&mut self, direction: Direction, place: usize, transmission: TransmissionType) {
        match direction {
            Direction::Receive => {
                if let Some(end) = self.rpdos.get_mut(place) {
                    end.take_as(transmission);
                }
            }
            Direction::Transmit => {
                if let Some(end) = self.tpdos.get_mut(place) {
                    end.send_as(transmission);
                }
            }
        }
    }

    /// Gives all PDOs the transmission types of the configuration.
    pub fn reset_transmissions(&mut self, node: &NodeConfig) {
        for (end, pdo) in self.rpdos.iter_mut().zip(&node.rpdos) {
            end.take_as(pdo.transmission);
        }
        for (end, pdo) in self.tpdos.iter_mut().zip(&node.tpdos) {
            end.send_as(pdo.transmission);
        }
        self.types.clear();
    }

    /// Keeps a row of the report while there is room.
    pub fn note(&mut self, row: ReportRow) {
        if self.report.len() < REPORT_MAX {
            self.report.push(row);
        }
    }

    /// Nothing of a second device with the same node-id was seen yet.
    pub fn forget_duplicate(&mut self) {
        self.signs.clear();
        (self.strays, self.last_answer) = (0, None);
    }

    /// No PDO is valid any more.
    pub fn stop_ends(&mut self) {
        self.tpdos.iter_mut().for_each(TpdoEnd::stop);
        self.rpdos.iter_mut().for_each(RpdoEnd::stop);
    }

    /// The next step, and moves on.
    pub fn next_step(&mut self) -> Option<Step> {
        if let Some(step) = self.again.take() {
            return Some(step);
        }
        let step = self.steps.get(self.at).copied()?;
        self.at += 1;
        Some(step)
    }

    /// Whether it has no program for the moment, and may start anew by itself.
    pub fn is_without_program(&self) -> bool {
        let started = Step::Program(ProgramStep::Start);
        self.program_until.is_some() && !self.steps[..self.at].contains(&started)
    }

    /// Whether the application's requests are through.
    pub fn is_quiet(&self) -> bool {
        self.queue.is_idle() && self.work == Work::Free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emcys_beyond_the_limit_are_told_once_a_second() {
        let mut limit = EmcyLimit::default();
        let mut run = |ms: u64| limit.count(MonotonicTime(ms * 1_000_000), 2);
        let verdicts: Vec<_> = [0, 1, 2, 3, 999, 1000].into_iter().map(&mut run).collect();
        use EmcyVerdict::*;
        assert_eq!(verdicts, [Tell, Tell, Storm, Suppress, Suppress, Tell]);
    }
}
