//! The service channel client of one slave.
//!
//! One step goes out per cycle: the master toggles MHS, the slave answers with AHS equal to MHS and without BUSY.
//! A step without that handshake for some cycles, or a slave that is busy for too long, ends the request.
//! Requests wait in a fixed number of places; a place is taken until its outcome has been fetched, so no
//! outcome is ever lost.
//!
//! A procedure command in process does not hold the channel: other requests are served meanwhile. It is asked about
//! when nothing else waits, when S-DEV says that a command has changed, and every few steps in any case.

mod handshake;
pub mod request;
mod slots;
mod transfer;

use profile_generic::time::{DurationNs, MonotonicTime};

use self::handshake::{Answer, Handshake};
use self::request::{SvcFailure, SvcOutcome, SvcRequest};
pub use self::slots::REQUESTS_MAX;
use self::slots::Slots;
use self::transfer::{Flow, Transfer};
use crate::wire::idn::Idn;
use crate::wire::svc::{AtSvc, MdtSvc};
use crate::wire::svc_error::SvcError;

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

/// The service channel client of one slave.
#[derive(Debug)]
pub(crate) struct ServiceChannel {
    limits: SvcLimits,
    handshake: Handshake,
    slots: Slots,
    /// Whether steps may be started: only in CP2 to CP4, not while the phase is switched.
    open: bool,
    /// The request on the wire, with whether its first step has gone out.
    active: Option<(usize, Transfer, bool)>,
    /// The slave was through with everything in the last cycle.
    free: bool,
    /// S-DEV bit 5 as it was last, and the commands to ask about since it moved.
    change: bool,
    changed: usize,
    /// Steps since a command in process was asked about.
    unasked: u16,
}

impl ServiceChannel {
    pub fn new(limits: SvcLimits) -> ServiceChannel {
        ServiceChannel {
            limits,
            handshake: Handshake::default(),
            slots: Slots::new(),
            open: false,
            active: None,
            free: false,
            change: false,
            changed: 0,
            unasked: 0,
        }
    }

    /// The six bytes for the next MDT.
    pub fn outgoing(&self) -> MdtSvc {
        self.handshake.outgoing()
    }

    /// The handshake bit on the wire.
    pub fn mhs(&self) -> bool {
        self.handshake.mhs()
    }

    /// Sets the word to the given handshake bit and nothing else: the start of CP1 (0) and the end of it (1),
    /// and the start of later phases, where the bit goes on as it was.
    pub fn rest(&mut self, mhs: bool) {
        self.handshake.rest(mhs);
    }

    /// Permits or stops new requests. A request on the wire goes on.
    pub fn set_open(&mut self, open: bool) {
        self.open = open;
    }

    /// Whether a request is on the wire, or a procedure command in process.
    pub fn is_running(&self) -> bool {
        self.request().is_some()
    }

    /// The request on the wire, else a procedure command in process.
    pub fn request(&self) -> Option<(Idn, request::SvcOperation)> {
        let active = self.active.as_ref().map(|(index, ..)| *index);
        let request = self.slots.request(active.or_else(|| self.slots.parked())?);
        Some((request.idn, request.operation))
    }

    /// Whether nothing is on the wire and nothing waits.
    pub fn is_idle(&self) -> bool {
        self.active.is_none() && !self.slots.has_pending()
    }

    /// Takes a request of the application; gives it back when all places are taken.
    pub fn submit(&mut self, request: SvcRequest) -> Result<(usize, u64), SvcRequest> {
        self.slots.submit(request)
    }

    /// Takes a request of the master itself, which goes before all others. The one before must have been
    /// taken back with [`ServiceChannel::take_own`].
    pub fn submit_own(&mut self, request: SvcRequest) {
        self.slots.submit_own(request);
    }

    /// The outcome of one finished request of the application, oldest first, with its place and serial number.
    pub fn take_outcome(&mut self) -> Option<(usize, u64, SvcOutcome)> {
        self.slots.take_outcome()
    }

    /// The outcome of the master's own request.
    pub fn take_own(&mut self) -> Option<SvcOutcome> {
        self.slots.take_own()
    }

    /// Ends every request with `failure`.
    pub fn abort(&mut self, failure: SvcFailure) {
        self.active = None;
        self.free = false;
        self.slots.abort(failure);
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
            self.changed = self.slots.count_parked();
        }
        self.change = change;
    }

    /// Takes what the AT of this cycle said, `None` when it did not come, and prepares the next MDT.
    pub fn receive(&mut self, now: MonotonicTime, answer: Option<AtSvc>) {
        let answer = self.handshake.judge(answer);
        self.free = matches!(answer, Answer::Through(_));
        if self.active.is_none() && !self.start() {
            self.handshake.clear();
            return;
        }
        if let Answer::Through(info) = answer {
            self.handshake.clear();
            self.advance(now, info);
        } else if let Some(failure) = self.handshake.wait(now, matches!(answer, Answer::Busy), &self.limits) {
            if let Some((index, ..)) = self.active.take() {
                self.slots.finish(index, Err(failure));
            }
            self.handshake.clear();
        }
    }

    /// Makes the most urgent request the active one.
    fn start(&mut self) -> bool {
        if !self.slots.has_pending() {
            return false;
        }
        let Some(index) = self.slots.next(self.open, self.changed > 0 || self.unasked >= ASK_EVERY) else {
            return false;
        };
        let (transfer, parked) = self.slots.activate(index);
        if parked {
            self.unasked = 0;
            self.changed = self.changed.saturating_sub(1);
        }
        self.active = Some((index, transfer, false));
        true
    }

    /// The channel is through with the last step: take its answer and put the next step on the wire.
    fn advance(&mut self, now: MonotonicTime, mut info: Result<u32, SvcError>) {
        let timeout = self.limits.command_timeout;
        while let Some((index, transfer, on_wire)) = &mut self.active {
            let index = *index;
            let data = &mut self.slots.request_mut(index).data;
            // What the slave answers before the first step belongs to the request before.
            let flow = if *on_wire { transfer.advance(now, timeout, info, data) } else { Flow::Next };
            match flow {
                Flow::Next => return self.put_step(),
                // Others first, if there are any.
                Flow::InProcess => {
                    if let Some((_, transfer, _)) = self.active.take() {
                        self.slots.park(index, transfer);
                    }
                }
                Flow::Finished(result) => {
                    self.active = None;
                    self.slots.finish(index, result);
                    info = Ok(0);
                }
            }
            self.start();
        }
    }

    /// Toggles the handshake bit with the next step of the active request.
    fn put_step(&mut self) {
        if let Some((index, transfer, on_wire)) = &mut self.active {
            *on_wire = true;
            self.handshake.put(transfer.step(&self.slots.request(*index).data));
            self.free = false;
            self.unasked = self.unasked.saturating_add(1);
        }
    }
}

#[cfg(test)]
mod tests;
