//! Looking at a south bus without a configuration: who is there, and what they say of themselves.
//!
//! A [`Scanner`] takes the line to CP2, reads what a person asks first about a drive, and takes the line down again. No
//! connection is set up and nothing is written but the active communication classes (S-0-1000.0.1), so that nothing can
//! move.

pub mod can;
mod questions;
mod report;
mod starter;

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use profile_cia402::eds::plain;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::Master;
use profile_sercos::master::config::{AddressPolicy, ConfigError, MasterConfig};
use profile_sercos::master::event::{Event, Output, SlaveId, Ticket};
use profile_sercos::master::station::Facts;
use profile_sercos::master::svc::request::{SvcData, SvcFailure, SvcRequest};
use profile_sercos::master::topology::Topology;
use profile_sercos::wire::header::Phase;
use profile_sercos::wire::idn::Idn;

pub use questions::QUESTIONS;
pub use report::{json, text};
pub use starter::starter;

use crate::engine::port::{EthernetPort, FRAME_MAX};

/// Slaves up to which two telegrams are enough in CP1 and CP2; more need four and longer cycles.
const SLAVES_FEW: u16 = 255;

/// Longest list or text that is read: a list of every IDN there is.
const ANSWER_LEN_MAX: usize = 8192;

/// Frames taken in one step at most.
const FRAMES_PER_STEP: usize = 32;

/// What a slave answered to one question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// What was asked.
    pub idn: Idn,
    /// Its operation data, or why there is none.
    pub data: Result<Vec<u8>, SvcFailure>,
}

/// A slave that was found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Which one along the line.
    pub id: SlaveId,
    /// Its SERCOS address, 0 when none is set.
    pub address: u16,
    /// What the master read of its communication.
    pub facts: Facts,
    /// What it answered, in the order of [`QUESTIONS`].
    pub answers: Vec<Answer>,
    /// Whether it went away meanwhile.
    pub lost: bool,
}

/// What a device calls itself: UTF-8, or else a character of Latin-1 for each byte, without what is no letter; `None` when nothing
/// is left.
fn readable(bytes: &[u8]) -> Option<String> {
    let text = plain(bytes);
    let text: String = text.chars().filter(|letter| !letter.is_control()).collect();
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

impl Found {
    /// The operation data of an IDN, if the slave gave it.
    #[must_use]
    pub fn data(&self, idn: Idn) -> Option<&[u8]> {
        let answer = self.answers.iter().find(|answer| answer.idn == idn)?;
        answer.data.as_ref().ok().map(Vec::as_slice)
    }

    /// A text without what is no character.
    #[must_use]
    pub fn text(&self, idn: Idn) -> Option<String> {
        readable(self.data(idn)?)
    }

    /// A number of 1, 2, 4 or 8 bytes.
    #[must_use]
    pub fn number(&self, idn: Idn) -> Option<u64> {
        let data = self.data(idn)?;
        if !matches!(data.len(), 1 | 2 | 4 | 8) {
            return None;
        }
        let mut wide = [0; 8];
        wide[..data.len()].copy_from_slice(data);
        Some(u64::from_le_bytes(wide))
    }

    /// A list of 16-bit words.
    pub fn words(&self, idn: Idn) -> impl Iterator<Item = u16> + '_ {
        self.data(idn).unwrap_or_default().chunks_exact(2).map(|item| u16::from_le_bytes([item[0], item[1]]))
    }
}

/// What a scan has found.
#[derive(Debug, Clone, Default)]
pub struct Bus {
    /// Everybody on the line, nearest to the master first.
    pub slaves: Vec<Found>,
    /// How they are joined.
    pub topology: Option<Topology>,
    /// What went wrong or is worth a look, in the order in which it came.
    pub findings: Vec<String>,
}

/// Where a scan is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// On the way to CP2.
    Up,
    /// In CP2, the questions are asked.
    Asking,
    /// On the way down.
    Down,
    /// No telegrams any more.
    Done,
}

/// One scan of a bus.
#[derive(Debug)]
pub struct Scanner {
    master: Master,
    stage: Stage,
    bus: Bus,
    /// What is still to be asked of each slave.
    waiting: Vec<VecDeque<Idn>>,
    /// What is being asked.
    asked: Vec<Ticket>,
    /// More slaves than were expected: all over again with room for every one.
    crowded: bool,
}

impl Scanner {
    /// A scan with this master; its slaves, their room and what to do about addresses do not matter.
    ///
    /// # Errors
    /// A value of the configuration is out of its range.
    pub fn new(config: MasterConfig) -> Result<Self, ConfigError> {
        let config = MasterConfig {
            slaves: Vec::new(),
            slaves_max: SLAVES_FEW,
            addresses: AddressPolicy::Refuse,
            ..config
        };
        Ok(Self {
            master: up(config)?,
            stage: Stage::Up,
            bus: Bus::default(),
            waiting: Vec::new(),
            asked: Vec::new(),
            crowded: false,
        })
    }

    /// When [`Scanner::step`] has something to do; `None` when the scan is over.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if self.stage == Stage::Done { None } else { self.master.wake_at() }
    }

    /// Ends the scan early; what was found until now counts.
    pub fn give_up(&mut self, why: &str) {
        if matches!(self.stage, Stage::Up | Stage::Asking) {
            self.bus.findings.push(why.to_owned());
            self.end();
        }
    }

    /// Everything that can be done at this moment; whether the scan is over.
    pub fn step(&mut self, now: MonotonicTime, south: &mut dyn EthernetPort) -> bool {
        let mut buffer = [0; FRAME_MAX];
        for _ in 0..FRAMES_PER_STEP {
            let Some((port, length)) = south.receive(&mut buffer) else { break };
            // A refused frame is counted by the master and changes nothing.
            let _ = self.master.handle_frame(now, port, &buffer[..length]);
        }
        while let Some(Output::Transmit { port, frame }) = self.master.poll(now) {
            // A frame that cannot be sent is one that was lost on the way.
            let _ = south.send(now, port, frame);
        }
        while let Some(event) = self.master.poll_event() {
            self.note(event);
        }
        self.ask();
        self.stage == Stage::Done
    }

    /// What was found.
    #[must_use]
    pub fn finish(self) -> Bus {
        self.bus
    }

    fn note(&mut self, event: Event) {
        match event {
            Event::AwaitingApplication { phase } if phase == Phase::CP2 && self.stage == Stage::Up => {
                let found = self.master.slaves().map(|slave| Found {
                    id: slave.id,
                    address: slave.address,
                    facts: slave.facts.clone(),
                    answers: Vec::with_capacity(QUESTIONS.len()),
                    lost: false,
                });
                self.bus.slaves = found.collect();
                self.bus.topology = Some(self.master.topology());
                self.waiting = vec![QUESTIONS.iter().copied().collect(); self.bus.slaves.len()];
                self.stage = Stage::Asking;
            }
            Event::Svc { ticket, outcome } => {
                self.asked.retain(|asked| *asked != ticket);
                let data = outcome.result.map(|_| bytes(outcome.data));
                if let Some(slave) = self.bus.slaves.iter_mut().find(|slave| slave.id == ticket.slave) {
                    slave.answers.push(Answer { idn: outcome.idn, data });
                }
            }
            Event::SlaveLost { slave, .. } => {
                self.bus.findings.push(event.to_string());
                let found = self.bus.slaves.iter().position(|found| found.id == slave);
                if let Some(index) = found {
                    self.bus.slaves[index].lost = true;
                    self.waiting[index].clear();
                }
            }
            Event::TooManySlaves { .. } if self.master.config().slaves_max == SLAVES_FEW => {
                self.crowded = true;
                self.end();
            }
            Event::OtherMaster(_)
            | Event::NoSlaves
            | Event::ScanUnstable
            | Event::TooManySlaves { .. }
            | Event::SwitchFailed { .. }
            | Event::StepFailed { .. }
            | Event::AllSlavesLost => {
                self.bus.findings.push(event.to_string());
                self.end();
            }
            Event::DoubleAddress { .. }
            | Event::AddressConflict { .. }
            | Event::ClassMismatch { .. }
            | Event::Isolated { .. }
            | Event::CableOpen { .. } => {
                self.bus.findings.push(event.to_string());
            }
            Event::Stopped => self.stopped(),
            _ => {}
        }
    }

    /// Hands every slave its next question.
    fn ask(&mut self) {
        if self.stage != Stage::Asking {
            return;
        }
        for (slave, waiting) in self.bus.slaves.iter().zip(&mut self.waiting) {
            while let Some(idn) = waiting.front() {
                let request = SvcRequest::read(*idn).with_buffer(Vec::with_capacity(ANSWER_LEN_MAX));
                // When its places are taken, the rest waits until there is an answer.
                let Ok(ticket) = self.master.svc_submit(slave.id, request) else { break };
                self.asked.push(ticket);
                waiting.pop_front();
            }
        }
        if self.asked.is_empty() && self.waiting.iter().all(VecDeque::is_empty) {
            self.end();
        }
    }

    fn end(&mut self) {
        self.stage = Stage::Down;
        self.master.stop();
    }

    /// No more telegrams: the scan is over, or starts anew with more room.
    fn stopped(&mut self) {
        self.stage = Stage::Done;
        if !std::mem::take(&mut self.crowded) {
            return;
        }
        let mut config = self.master.config().clone();
        config.slaves_max = u16::try_from(profile_sercos::wire::cp0::SLAVES_MAX).unwrap_or(SLAVES_FEW);
        config.setup_cycle_ns = config.setup_cycle_ns.max(config.setup_cycle_min_ns());
        match up(config) {
            Ok(master) => (self.master, self.stage) = (master, Stage::Up),
            Err(error) => self.bus.findings.push(error.to_string()),
        }
    }
}

/// A master on its way to CP2.
fn up(config: MasterConfig) -> Result<Master, ConfigError> {
    let mut master = Master::new(config)?;
    master.set_target_phase(Phase::CP2);
    Ok(master)
}

fn bytes(data: SvcData) -> Vec<u8> {
    data.as_slice().to_vec()
}
