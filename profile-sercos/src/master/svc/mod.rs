//! The service channel client of one slave.
//!
//! One step goes out per cycle: the master toggles MHS, the slave answers with AHS equal to MHS and without BUSY.
//! A step without that handshake for some cycles, or a slave that is busy for too long, ends the request.
//! Requests wait in a fixed number of places; a place is taken until its outcome has been fetched, so no
//! outcome is ever lost.
//!
//! A procedure command in process does not hold the channel: other requests are served meanwhile. It is asked about
//! when nothing else waits, when S-DEV says that a command has changed, and every few steps in any case.

pub mod request;
mod transfer;

use profile_generic::time::{DurationNs, MonotonicTime};

use self::request::{SvcFailure, SvcOutcome, SvcReply, SvcRequest};
use self::transfer::{Flow, Transfer};
use crate::wire::data_status::DataStatus;
use crate::wire::idn::Idn;
use crate::wire::svc::{AtSvc, Element, MdtSvc, SvcControl, SvcStatus};
use crate::wire::svc_error::SvcError;

/// Requests of the application which one slave holds, waiting or answered and not fetched.
pub const REQUESTS_MAX: usize = 16;

/// Place of the master's own requests.
const OWN: usize = REQUESTS_MAX;

/// Steps for other requests after which a procedure command in process is asked about.
const ASK_EVERY: u16 = 64;

/// Times which a slave has for its answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SvcLimits {
    /// Cycles until the handshake bit has followed, 1..=65535; 10 by default.
    pub handshake_cycles: u16,
    /// Time for which a slave may be busy with one step; 1000 ms by default.
    pub busy_timeout: DurationNs,
    /// Time from the start of a procedure command to its end; 10 s by default.
    pub command_timeout: DurationNs,
}

impl Default for SvcLimits {
    fn default() -> SvcLimits {
        SvcLimits {
            handshake_cycles: 10,
            busy_timeout: DurationNs::from_millis(1000),
            command_timeout: DurationNs::from_secs(10),
        }
    }
}

#[derive(Debug)]
enum Place {
    Free,
    Waiting,
    Active,
    /// A procedure command in process, off the wire, and when it was asked about in the order of all.
    Parked(Transfer, u64),
    Finished(Result<SvcReply, SvcFailure>),
}

#[derive(Debug)]
struct Slot {
    place: Place,
    serial: u64,
    request: SvcRequest,
}

impl Slot {
    fn empty() -> Slot {
        let request = SvcRequest::new(crate::wire::idn::Idn(0), request::SvcOperation::Status);
        Slot { place: Place::Free, serial: 0, request }
    }
}

/// What a slave's answer in this cycle says about the step on the wire.
enum Answer {
    /// The slave is through: its info, or an error code.
    Through(Result<u32, SvcError>),
    Busy,
    Missing,
}

/// The service channel client of one slave.
#[derive(Debug)]
pub(crate) struct ServiceChannel {
    limits: SvcLimits,
    sent: MdtSvc,
    /// Whether steps may be started: only in CP2 to CP4, not while the phase is switched.
    open: bool,
    /// The request on the wire, with whether its first step has gone out.
    active: Option<(usize, Transfer, bool)>,
    missing_cycles: u16,
    busy_since: Option<MonotonicTime>,
    /// The slave was through with everything in the last cycle.
    free: bool,
    /// S-DEV bit 5 as it was last, and the commands to ask about since it moved.
    change: bool,
    changed: usize,
    /// Commands in process that were asked about so far.
    turn: u64,
    /// Steps since a command in process was asked about.
    unasked: u16,
    /// Requests that wait or are parked, and those of the application that are finished: most of the time there are none.
    pending: usize,
    finished: usize,
    slots: Box<[Slot; REQUESTS_MAX + 1]>,
    serial: u64,
}

impl ServiceChannel {
    pub fn new(limits: SvcLimits) -> ServiceChannel {
        ServiceChannel {
            limits,
            sent: MdtSvc::default(),
            open: false,
            active: None,
            missing_cycles: 0,
            busy_since: None,
            free: false,
            change: false,
            changed: 0,
            turn: 0,
            unasked: 0,
            pending: 0,
            finished: 0,
            slots: Box::new(core::array::from_fn(|_| Slot::empty())),
            serial: 0,
        }
    }

    /// The six bytes for the next MDT.
    pub fn outgoing(&self) -> MdtSvc {
        self.sent
    }

    /// The handshake bit on the wire.
    pub fn mhs(&self) -> bool {
        self.sent.control.mhs()
    }

    /// Sets the word to the given handshake bit and nothing else: the start of CP1 (0) and the end of it (1),
    /// and the start of later phases, where the bit goes on as it was.
    pub fn rest(&mut self, mhs: bool) {
        self.sent = MdtSvc { control: SvcControl::new(mhs, Element::Close, false, false), info: 0 };
    }

    /// Permits or stops new requests. A request on the wire goes on.
    pub fn set_open(&mut self, open: bool) {
        self.open = open;
    }

    /// Whether a request is on the wire, or a procedure command in process.
    pub fn is_running(&self) -> bool {
        let parked = |slot: &Slot| matches!(slot.place, Place::Parked(..));
        self.active.is_some() || (self.pending > 0 && self.slots.iter().any(parked))
    }

    /// The request on the wire, else a procedure command in process.
    pub fn request(&self) -> Option<(Idn, request::SvcOperation)> {
        let parked = |slot: &&Slot| matches!(slot.place, Place::Parked(..));
        let active = self.active.as_ref().map(|(index, ..)| &self.slots[*index]);
        let slot = active.or_else(|| self.slots.iter().find(parked).filter(|_| self.pending > 0))?;
        Some((slot.request.idn, slot.request.operation))
    }

    /// Whether nothing is on the wire and nothing waits.
    pub fn is_idle(&self) -> bool {
        self.active.is_none() && self.pending == 0
    }

    /// The data status which the slave gave last for a request under way: how far a procedure command is. `None` when
    /// it waits or has ended.
    pub fn progress(&self, place: usize, serial: u64) -> Option<DataStatus> {
        let slot = self.slots.get(place).filter(|slot| slot.serial == serial)?;
        match (&slot.place, &self.active) {
            (Place::Parked(transfer, _), _) => Some(transfer.status()),
            (Place::Active, Some((index, transfer, _))) if *index == place => Some(transfer.status()),
            _ => None,
        }
    }

    /// Takes a request of the application; gives it back when all places are taken.
    pub fn submit(&mut self, request: SvcRequest) -> Result<(usize, u64), SvcRequest> {
        let free = self.slots[..OWN].iter().position(|slot| matches!(slot.place, Place::Free));
        match free {
            Some(index) => Ok((index, self.occupy(index, request))),
            None => Err(request),
        }
    }

    /// Takes a request of the master itself, which goes before all others. The one before must have been
    /// taken back with [`ServiceChannel::take_own`].
    pub fn submit_own(&mut self, request: SvcRequest) {
        self.occupy(OWN, request);
    }

    fn occupy(&mut self, index: usize, request: SvcRequest) -> u64 {
        self.serial += 1;
        let again = matches!(self.slots[index].place, Place::Waiting | Place::Parked(..));
        self.pending += usize::from(!again);
        self.slots[index] = Slot { place: Place::Waiting, serial: self.serial, request };
        self.serial
    }

    /// Whether a request of the application is finished.
    #[inline]
    pub fn has_outcome(&self) -> bool {
        self.finished > 0
    }

    /// The outcome of one finished request of the application, oldest first, with its place and serial number.
    pub fn take_outcome(&mut self) -> Option<(usize, u64, SvcOutcome)> {
        if !self.has_outcome() {
            return None;
        }
        let index = (0..OWN)
            .filter(|&index| matches!(self.slots[index].place, Place::Finished(_)))
            .min_by_key(|&index| self.slots[index].serial)?;
        let serial = self.slots[index].serial;
        self.take(index).map(|outcome| (index, serial, outcome))
    }

    /// The outcome of the master's own request.
    pub fn take_own(&mut self) -> Option<SvcOutcome> {
        self.take(OWN)
    }

    fn take(&mut self, index: usize) -> Option<SvcOutcome> {
        let slot = &mut self.slots[index];
        let Place::Finished(result) = slot.place else {
            return None;
        };
        slot.place = Place::Free;
        if index != OWN {
            self.finished -= 1;
        }
        Some(SvcOutcome {
            idn: slot.request.idn,
            operation: slot.request.operation,
            result,
            data: core::mem::take(&mut slot.request.data),
        })
    }

    /// Ends every request with `failure`.
    pub fn abort(&mut self, failure: SvcFailure) {
        self.active = None;
        self.free = false;
        for index in 0..self.slots.len() {
            if matches!(self.slots[index].place, Place::Waiting | Place::Active | Place::Parked(..)) {
                self.finish(index, Err(failure));
            }
        }
        self.pending = 0;
    }

    /// Puts the first step of a waiting request on the wire when the slave was through in the last cycle.
    pub fn kick(&mut self) {
        if self.free && self.active.is_none() && self.start() {
            self.put_step();
        }
    }

    /// Takes S-DEV bit 5: it moves when a procedure command has ended or failed.
    pub fn command_change(&mut self, change: bool) {
        if change != self.change {
            self.changed = self.slots.iter().filter(|slot| matches!(slot.place, Place::Parked(..))).count();
        }
        self.change = change;
    }

    /// Takes what the AT of this cycle said, `None` when it did not come, and prepares the next MDT.
    pub fn receive(&mut self, now: MonotonicTime, answer: Option<AtSvc>) {
        let answer = self.judge(answer);
        self.free = matches!(answer, Answer::Through(_));
        if self.active.is_none() && !self.start() {
            self.missing_cycles = 0;
            self.busy_since = None;
            return;
        }
        match answer {
            Answer::Through(info) => {
                self.missing_cycles = 0;
                self.busy_since = None;
                self.advance(now, info);
            }
            Answer::Busy => {
                self.missing_cycles = 0;
                let since = *self.busy_since.get_or_insert(now);
                if now - since >= self.limits.busy_timeout {
                    let milliseconds = self.limits.busy_timeout.as_nanos() / 1_000_000;
                    let milliseconds = u32::try_from(milliseconds).unwrap_or(u32::MAX);
                    self.fail(SvcFailure::BusyTimeout { milliseconds });
                }
            }
            Answer::Missing => {
                self.missing_cycles = self.missing_cycles.saturating_add(1);
                if self.missing_cycles >= self.limits.handshake_cycles {
                    self.fail(SvcFailure::HandshakeTimeout { cycles: self.missing_cycles });
                }
            }
        }
    }

    fn judge(&self, answer: Option<AtSvc>) -> Answer {
        let Some(answer) = answer else {
            return Answer::Missing;
        };
        let handshake = answer.status.contains(SvcStatus::AHS) == self.mhs();
        if !handshake || !answer.status.contains(SvcStatus::VALID) {
            Answer::Missing
        } else if answer.status.contains(SvcStatus::BUSY) {
            Answer::Busy
        } else if answer.status.contains(SvcStatus::ERROR) {
            Answer::Through(Err(SvcError(answer.info_word())))
        } else {
            Answer::Through(Ok(answer.info))
        }
    }

    /// A request has come to its end.
    fn finish(&mut self, index: usize, result: Result<SvcReply, SvcFailure>) {
        self.slots[index].place = Place::Finished(result);
        if index != OWN {
            self.finished += 1;
        }
    }

    /// Makes the most urgent request the active one.
    fn start(&mut self) -> bool {
        if self.pending == 0 {
            return false;
        }
        let Some(index) = self.next() else {
            return false;
        };
        let slot = &mut self.slots[index];
        let transfer = match core::mem::replace(&mut slot.place, Place::Active) {
            Place::Parked(transfer, _) => {
                self.unasked = 0;
                self.changed = self.changed.saturating_sub(1);
                transfer
            }
            _ => Transfer::new(&mut slot.request),
        };
        self.pending -= 1;
        self.active = Some((index, transfer, false));
        true
    }

    /// The request to go on with: the most urgent one that waits, or a command in process where its time has come.
    fn next(&self) -> Option<usize> {
        let serial = |index: usize| core::cmp::Reverse(self.slots[index].serial);
        let rank = |index: usize| (index == OWN, self.slots[index].request.priority, serial(index));
        let all = 0..self.slots.len();
        let waiting = all.clone().filter(|&index| self.may_start(index)).max_by_key(|&index| rank(index));
        let asked = |index: usize| match self.slots[index].place {
            Place::Parked(_, turn) => Some((turn, index)),
            _ => None,
        };
        let parked = all.filter_map(asked).min();
        let due = waiting.is_none() || self.changed > 0 || self.unasked >= ASK_EVERY;
        parked.filter(|_| due).map(|(_, index)| index).or(waiting)
    }

    /// Whether the request waits and may go on the wire. One command at a time acts on a data block.
    fn may_start(&self, index: usize) -> bool {
        let slot = &self.slots[index];
        let taken = |other: &Slot| matches!(&other.place, Place::Parked(transfer, _) if transfer.idn() == slot.request.idn);
        self.open && matches!(slot.place, Place::Waiting) && !self.slots.iter().any(taken)
    }

    /// The channel is through with the last step: take its answer and put the next step on the wire.
    fn advance(&mut self, now: MonotonicTime, mut info: Result<u32, SvcError>) {
        let timeout = self.limits.command_timeout;
        while let Some((index, transfer, on_wire)) = &mut self.active {
            let data = &mut self.slots[*index].request.data;
            // What the slave answers before the first step belongs to the request before.
            let flow = if *on_wire { transfer.advance(now, timeout, info, data) } else { Flow::Next };
            match flow {
                Flow::Next => {
                    self.put_step();
                    return;
                }
                // Others first, if there are any.
                Flow::InProcess => {
                    let index = *index;
                    self.turn += 1;
                    if let Some((_, transfer, _)) = self.active.take() {
                        self.slots[index].place = Place::Parked(transfer, self.turn);
                        self.pending += 1;
                    }
                    self.start();
                }
                Flow::Finished(result) => {
                    let index = *index;
                    self.finish(index, result);
                    self.active = None;
                    info = Ok(0);
                    self.start();
                }
            }
        }
    }

    /// Toggles the handshake bit with the next step of the active request.
    fn put_step(&mut self) {
        if let Some((index, transfer, on_wire)) = &mut self.active {
            *on_wire = true;
            let step = transfer.step(&self.slots[*index].request.data);
            let control = SvcControl::new(!self.sent.control.mhs(), step.element, step.write, step.last);
            self.sent = MdtSvc { control, info: step.info };
            self.free = false;
            self.unasked = self.unasked.saturating_add(1);
        }
    }

    fn fail(&mut self, failure: SvcFailure) {
        if let Some((index, _, _)) = self.active.take() {
            self.finish(index, Err(failure));
        }
        self.missing_cycles = 0;
        self.busy_since = None;
    }
}

#[cfg(test)]
mod tests;
