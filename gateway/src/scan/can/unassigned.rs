//! Devices without a node-id, by LSS fastscan.
//!
//! ```text
//! fastscan --found--> fastscan --found--> fastscan --nobody--> all wait
//!    |                                       |
//!    +--nobody--> (nothing to undo)          +--failure, enough, out of time, given up--> all wait
//! ```
//!
//! A device that is found is in LSS configuration, where it answers no fastscan: so the next one is found, and none needs a
//! node-id for that. In the end all wait again, as before. A device that has a node-id does not answer a fastscan.

use profile_cia402::lss::master::{LssReply, LssTask, Master, MasterConfig};
use profile_cia402::wire::cob_id;
use profile_cia402::wire::lss::LssAddress;
use profile_generic::can::Frame;
use profile_generic::time::{DurationNs, MonotonicTime};

/// Devices that are looked for at most. Each takes some three seconds.
const DEVICES_MAX: usize = 16;

/// Longest time for all of them.
const TIME_MAX: DurationNs = DurationNs::from_secs(60);

/// Where the search is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    NotBegun,
    Fastscan,
    Leave,
    Over,
}

/// Looks for them, one after the other.
#[derive(Debug)]
pub(super) struct Search {
    master: Master,
    stage: Stage,
    /// When it ends at the latest.
    end: MonotonicTime,
    found: Vec<LssAddress>,
    findings: Vec<String>,
}

impl Search {
    pub(super) fn new() -> Self {
        Self {
            master: Master::new(MasterConfig::default()),
            stage: Stage::NotBegun,
            end: MonotonicTime::ZERO,
            found: Vec::new(),
            findings: Vec::new(),
        }
    }

    /// Goes on, and begins with the first call; `true` when it is over.
    pub(super) fn run(&mut self, now: MonotonicTime) -> bool {
        if self.stage == Stage::NotBegun {
            self.end = now + TIME_MAX;
            self.go(now, Stage::Fastscan);
        } else if let Some(outcome) = self.master.take_outcome() {
            match (self.stage, outcome) {
                (Stage::Fastscan, Ok(LssReply::Address(address))) => self.add(now, address),
                // Nobody, and nobody before: no device has left its state.
                (Stage::Fastscan, Ok(_)) if self.found.is_empty() => self.stage = Stage::Over,
                (Stage::Fastscan, Ok(_)) => self.go(now, Stage::Leave),
                (Stage::Fastscan, Err(failure)) => self.leave(now, &failure.to_string()),
                (Stage::NotBegun | Stage::Leave | Stage::Over, _) => self.stage = Stage::Over,
            }
        } else if self.stage == Stage::Fastscan && now >= self.end {
            self.leave(now, "not done in time");
        }
        self.stage == Stage::Over
    }

    fn add(&mut self, now: MonotonicTime, address: LssAddress) {
        if self.found.contains(&address) {
            return self.leave(now, &format!("the device with {address} answers again once it is found"));
        }
        self.found.push(address);
        if self.found.len() == DEVICES_MAX {
            return self.leave(now, &format!("{DEVICES_MAX} are looked for at most"));
        }
        self.go(now, Stage::Fastscan);
    }

    fn leave(&mut self, now: MonotonicTime, why: &str) {
        self.findings.push(format!("there may be more devices without a node-id: {why}"));
        self.go(now, Stage::Leave);
    }

    fn go(&mut self, now: MonotonicTime, stage: Stage) {
        let task = if stage == Stage::Leave { LssTask::SwitchAllToWaiting } else { LssTask::Fastscan };
        self.stage = stage;
        // A fastscan that is broken off is under way in the old one.
        self.master = Master::new(MasterConfig::default());
        let _ = self.master.start(now, task);
    }

    /// Ends the search; devices that it has found wait again.
    pub(super) fn give_up(&mut self, now: MonotonicTime) {
        match self.stage {
            Stage::NotBegun => self.stage = Stage::Over,
            Stage::Fastscan => self.go(now, Stage::Leave),
            Stage::Leave | Stage::Over => {}
        }
    }

    /// The next frame to send.
    pub(super) fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        let request = self.master.poll(now)?;
        Frame::new(cob_id::LSS_REQUEST, &request).ok()
    }

    /// Takes an answer of LSS.
    pub(super) fn handle(&mut self, now: MonotonicTime, data: &[u8]) {
        // What is no answer changes nothing.
        let _ = self.master.handle(now, data);
    }

    /// When there is something to do by itself.
    pub(super) fn wake_at(&self) -> Option<MonotonicTime> {
        self.master.wake_at()
    }

    /// The addresses that were found, in their order, and what people should know of the search.
    pub(super) fn finish(mut self) -> (Vec<LssAddress>, Vec<String>) {
        if matches!(self.stage, Stage::Fastscan | Stage::Leave) && !self.found.is_empty() {
            self.findings.push(
                "the bus takes no frames any more: the devices without a node-id may be in LSS configuration until they are switched off"
                    .to_owned(),
            );
        }
        (self.found, self.findings)
    }
}
