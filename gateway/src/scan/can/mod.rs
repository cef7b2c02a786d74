//! Looking at a CAN bus without a configuration: which CANopen devices are there, and what they say of themselves.
//!
//! A [`Scanner`] asks every node-id for its device type, and who answers for its identity, name and modes. All of that is
//! reading by SDO, which a device does in every state but stopped; no command of NMT is sent and nothing is written, so that
//! nothing can move. Before the first question the scan listens: a bus that a master leads is left alone. Devices without a node-id are looked for in the end, by LSS; none is given one.

mod report;
mod starter;
mod unassigned;

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use profile_cia402::drive::index::{AXIS_OFFSET, SUPPORTED_MODES};
use profile_cia402::drive::modes::SupportedModes;
use profile_cia402::master::foreign::LISTEN;
use profile_cia402::sdo::client::{Client, ClientConfig};
use profile_cia402::sdo::request::{Method, SdoFailure, SdoRequest};
use profile_cia402::wire::lss::LssAddress;
use profile_cia402::wire::{Function, Mux, NodeId, cob_id};
use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime};

pub use report::{json, text};
pub use starter::{hints, starter};

use self::unassigned::Search;
use super::readable;
use crate::engine::port::{CanInput, CanPort, CanSent, OFF_THE_BUS, UNACKNOWLEDGED};

/// How long a device may take for an answer: who is there answers within some milliseconds.
const PATIENCE: DurationNs = DurationNs::from_millis(100);

/// Node-ids that are asked at the same time. The frames of more would not fit the queue of an interface.
const AT_ONCE: usize = 8;

/// Axes of one device.
const AXES_MAX: u16 = 8;

/// Longest text that is read.
const TEXT_MAX: usize = 256;

/// Frames taken in one step at most.
const FRAMES_PER_STEP: usize = 64;

/// How often what does not fit the transmit queue is offered again.
const FULL_PAUSE: DurationNs = DurationNs::from_millis(1);

/// How long the transmit queue may stay full: then nobody acknowledges what is sent.
const STUCK_MAX: DurationNs = DurationNs::from_secs(1);

/// 1000h: the profile in the low word, its additional information above.
pub const DEVICE_TYPE: Mux = Mux::new(0x1000, 0);
/// Identity: vendor, product, revision, serial number.
pub const IDENTITY: [Mux; 4] =
    [Mux::new(0x1018, 1), Mux::new(0x1018, 2), Mux::new(0x1018, 3), Mux::new(0x1018, 4)];
/// Name, hardware and software version.
pub const NAME: Mux = Mux::new(0x1008, 0);
/// Hardware version.
pub const HARDWARE: Mux = Mux::new(0x1009, 0);
/// Software version.
pub const SOFTWARE: Mux = Mux::new(0x100A, 0);

/// Supported modes of an axis, from 0.
#[must_use]
pub fn modes_of(axis: u16) -> Mux {
    Mux::new(SUPPORTED_MODES + axis * AXIS_OFFSET, 0)
}

/// What a device answered to one question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// What was asked.
    pub object: Mux,
    /// Its bytes, or why there are none.
    pub data: Result<Vec<u8>, SdoFailure>,
}

/// A device that was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its node-id.
    pub node: NodeId,
    /// What it answered.
    pub answers: Vec<Answer>,
}

impl Found {
    fn bytes(&self, object: Mux) -> Option<&[u8]> {
        let answer = self.answers.iter().find(|answer| answer.object == object)?;
        answer.data.as_ref().ok().map(Vec::as_slice)
    }

    /// A number of up to four bytes.
    #[must_use]
    pub fn number(&self, object: Mux) -> Option<u32> {
        let bytes = self.bytes(object).filter(|bytes| (1..=4).contains(&bytes.len()))?;
        let mut word = [0; 4];
        word[..bytes.len()].copy_from_slice(bytes);
        Some(u32::from_le_bytes(word))
    }

    /// A text without what is no character.
    #[must_use]
    pub fn text(&self, object: Mux) -> Option<String> {
        readable(self.bytes(object)?)
    }

    /// The axes that have modes of CiA 402.
    pub fn axes(&self) -> impl Iterator<Item = (u16, SupportedModes)> + '_ {
        (0..AXES_MAX)
            .filter_map(|axis| Some((axis, SupportedModes::from_bits_retain(self.number(modes_of(axis))?))))
    }
}

/// What a scan has found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Bus {
    /// Devices with a node-id, by node-id.
    pub nodes: Vec<Found>,
    /// LSS addresses of devices without one, the lowest first.
    pub unassigned: Vec<LssAddress>,
    /// What was odd.
    pub findings: Vec<String>,
}

/// A node-id that is being asked.
#[derive(Debug)]
struct Probe {
    client: Client,
    found: Found,
    questions: VecDeque<Mux>,
}

impl Probe {
    fn new(now: MonotonicTime, node: NodeId) -> Self {
        let client = Client::new(ClientConfig { timeout: PATIENCE, ..ClientConfig::default() });
        let mut questions: VecDeque<Mux> = IDENTITY.into();
        questions.extend([NAME, HARDWARE, SOFTWARE, modes_of(0)]);
        let mut probe = Self { client, found: Found { node, answers: Vec::new() }, questions };
        probe.ask(now, DEVICE_TYPE);
        probe
    }

    fn ask(&mut self, now: MonotonicTime, object: Mux) {
        // Nearly all of it comes in the first answer. Blocks are for much more, and not every stack knows them well.
        let request = SdoRequest {
            method: Method::Segments,
            ..SdoRequest::upload_into(object, Vec::with_capacity(TEXT_MAX))
        };
        // It is free whenever it is asked something.
        let _ = self.client.start(now, request);
    }

    /// Takes what has come; `true` when everything is asked.
    fn advance(&mut self, now: MonotonicTime) -> bool {
        let Some(outcome) = self.client.take_outcome() else { return false };
        let object = outcome.object;
        let data = outcome.result.map(|()| outcome.data.as_slice().to_vec());
        let silent = matches!(data, Err(SdoFailure::Timeout { .. }));
        if silent && object == DEVICE_TYPE {
            return true;
        }
        // Axes are numbered without gaps.
        let next = (0..AXES_MAX - 1).find(|axis| object == modes_of(*axis)).filter(|_| data.is_ok());
        self.questions.extend(next.map(|axis| modes_of(axis + 1)));
        self.found.answers.push(Answer { object, data });
        match self.questions.pop_front() {
            Some(object) => {
                self.ask(now, object);
                false
            }
            None => true,
        }
    }
}

/// Asks one after the other, some at a time.
#[derive(Debug)]
pub struct Scanner {
    waiting: VecDeque<NodeId>,
    probes: Vec<Probe>,
    found: Vec<Found>,
    search: Search,
    findings: Vec<String>,
    /// What the transmit queue had no room for.
    held: Option<Frame>,
    again: Option<MonotonicTime>,
    /// Since when it has had none.
    full_since: Option<MonotonicTime>,
    /// Nothing is asked before then.
    listens_until: Option<MonotonicTime>,
    /// What somebody who leads the bus has sent meanwhile.
    master: Option<Id>,
}

impl Default for Scanner {
    fn default() -> Self {
        Self::new()
    }
}

impl Scanner {
    /// A scan of all node-ids that begins with the first step.
    #[must_use]
    pub fn new() -> Self {
        let waiting = (1..=NodeId::MAX.get()).filter_map(|node| NodeId::new(node).ok()).collect();
        Self {
            waiting,
            probes: Vec::new(),
            found: Vec::new(),
            search: Search::new(),
            findings: Vec::new(),
            held: None,
            again: None,
            full_since: None,
            listens_until: None,
            master: None,
        }
    }

    /// Ends the scan at once; what is found counts. [`Scanner::step`] has still to leave the devices as they were.
    pub fn give_up(&mut self, now: MonotonicTime, why: &str) {
        self.note(why);
        self.waiting.clear();
        self.probes.clear();
        self.search.give_up(now);
    }

    fn note(&mut self, why: &str) {
        if !self.findings.iter().any(|finding| finding == why) {
            self.findings.push(why.to_owned());
        }
    }

    /// Does what there is to do; `true` when all have been asked, or the bus is off or takes no frames.
    pub fn step(&mut self, now: MonotonicTime, port: &mut dyn CanPort) -> bool {
        for _ in 0..FRAMES_PER_STEP {
            match port.receive(now) {
                Some(CanInput::Frame(frame)) => self.take(now, &frame),
                Some(CanInput::BusOff) => {
                    self.note(OFF_THE_BUS);
                    return true;
                }
                Some(CanInput::Transmitted | CanInput::BusOn) => {}
                None => break,
            }
        }
        if let Some(id) = self.master {
            self.give_up(now, &format!("another master is on this bus: it sends {id}; nothing was asked"));
            return true;
        }
        if now < *self.listens_until.get_or_insert(now + LISTEN) {
            return false;
        }
        while self.probes.len() < AT_ONCE
            && let Some(node) = self.waiting.pop_front()
        {
            self.probes.push(Probe::new(now, node));
        }
        self.send(now, port);
        let Self { probes, found, .. } = self;
        probes.retain_mut(|probe| {
            let done = probe.advance(now);
            if done && !probe.found.answers.is_empty() {
                found.push(probe.found.clone());
            }
            !done
        });
        let asked = self.probes.is_empty() && self.waiting.is_empty() && self.held.is_none();
        let over = asked && self.search.run(now);
        self.send(now, port);
        let stuck = self.full_since.is_some_and(|since| now.since(since) > STUCK_MAX);
        if stuck {
            self.note(UNACKNOWLEDGED);
        }
        stuck || over
    }

    fn take(&mut self, now: MonotonicTime, frame: &Frame) {
        let of_a_master =
            matches!(Function::of(frame.id()), Some(Function::Sync | Function::Nmt | Function::Rpdo(..)));
        if of_a_master && self.listens_until.is_none_or(|until| now < until) {
            self.master = Some(frame.id());
        }
        if frame.id() == cob_id::LSS_RESPONSE && !frame.is_remote() {
            self.search.handle(now, frame.data());
        }
        let Some(Function::SdoResponse(node)) = Function::of(frame.id()) else { return };
        if let Some(probe) = self.probes.iter_mut().find(|probe| probe.found.node == node) {
            // What is no answer leaves the time-out running.
            let _ = probe.client.handle(now, frame.data());
        }
    }

    fn send(&mut self, now: MonotonicTime, port: &mut dyn CanPort) {
        self.again = None;
        loop {
            let Self { probes, search, .. } = self;
            let next = self.held.take().or_else(|| {
                let question = probes.iter_mut().find_map(|probe| {
                    let bytes = probe.client.poll(now)?;
                    Frame::new(cob_id::sdo_request(probe.found.node), &bytes).ok()
                });
                question.or_else(|| search.poll(now))
            });
            let Some(frame) = next else { return };
            if port.send(now, &frame) == CanSent::Full {
                (self.held, self.again) = (Some(frame), Some(now + FULL_PAUSE));
                self.full_since.get_or_insert(now);
                return;
            }
            self.full_since = None;
        }
    }

    /// When to call [`Scanner::step`] again, unless a frame comes before.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        // Nothing was asked yet.
        if self.probes.is_empty() && self.found.is_empty() && !self.waiting.is_empty() {
            return self.listens_until;
        }
        // Nothing else can be done while the queue is full.
        let clients = || self.probes.iter().filter_map(|probe| probe.client.wake_at());
        self.again.or_else(|| clients().chain(self.search.wake_at()).min())
    }

    /// Who was found.
    #[must_use]
    pub fn finish(mut self) -> Bus {
        self.found.sort_by_key(|found| found.node);
        let (unassigned, findings) = self.search.finish();
        self.findings.extend(findings);
        Bus { nodes: self.found, unassigned, findings: self.findings }
    }
}
