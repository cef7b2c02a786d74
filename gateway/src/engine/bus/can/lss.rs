//! Node-ids by LSS: a device that does not answer may be there without one.
//!
//! ```text
//! all wait --> select by address --> which node-id? --none--> set --> store, where that is asked for --> all wait
//!                   |                     |                   |
//!                nobody                another one         refused  ----------------------------------> all wait
//! ```
//!
//! The device reports its boot-up once it is out of the configuration again, and the master brings it up. One that has another
//! node-id keeps that: who gave it to it may lead it. Nothing here allocates.

use core::fmt;

use profile_cia402::lss::master::{LssFailure, LssReply, LssTask, Master, MasterConfig};
use profile_cia402::wire::lss::LssAddress;
use profile_cia402::wire::{NodeId, cob_id};
use profile_generic::can::Frame;
use profile_generic::time::{DurationNs, MonotonicTime};

/// Longest time for an answer; storing takes some.
const TIMEOUT: DurationNs = DurationNs::from_secs(1);

/// From the end of one try to the next one for the same device.
const PAUSE: DurationNs = DurationNs::from_secs(2);

/// A device that is given its node-id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Assignment {
    /// The node-id.
    pub node: NodeId,
    /// Who gets it.
    pub address: LssAddress,
    /// Whether the device is to keep it.
    pub stores: bool,
}

/// What came of a try.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LssNotice {
    /// It has its node-id, and keeps it where that was asked for.
    Given {
        /// The device.
        assignment: Assignment,
    },
    /// It has another one.
    Other {
        /// The device.
        assignment: Assignment,
        /// What it has.
        has: NodeId,
    },
    /// It does not take it, or does not answer any more.
    Failed {
        /// The device.
        assignment: Assignment,
        /// What was tried.
        what: &'static str,
        /// Why it failed.
        failure: LssFailure,
    },
}

impl fmt::Display for LssNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Given { assignment } | Self::Other { assignment, .. } | Self::Failed { assignment, .. }) =
            self;
        let Assignment { node, address, stores } = assignment;
        match self {
            Self::Given { .. } if *stores => {
                write!(f, "the device with {address} was given node-id {node} and stores it")
            }
            Self::Given { .. } => write!(f, "the device with {address} was given node-id {node}"),
            Self::Other { has, .. } => {
                write!(
                    f,
                    "the device with {address} has node-id {has}: expected none, or {node}; it is left as it is"
                )
            }
            Self::Failed { what, failure, .. } => {
                write!(f, "the device with {address} was not given node-id {node}: {what}: {failure}")
            }
        }
    }
}

/// Where a try is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Wait,
    Select,
    Inquire,
    Set,
    Store,
    /// All devices wait again; what is to be told then.
    Leave(Option<LssNotice>),
}

/// One device.
#[derive(Debug)]
struct Place {
    assignment: Assignment,
    /// When it may be tried.
    next: MonotonicTime,
    /// What was told last: the same is not told again.
    told: Option<LssNotice>,
}

fn idle() -> Master {
    Master::new(MasterConfig { timeout: TIMEOUT, ..MasterConfig::default() })
}

/// Gives node-ids, one device at a time.
#[derive(Debug)]
pub struct Assigner {
    master: Master,
    places: Vec<Place>,
    at: Option<(usize, Step)>,
}

impl Assigner {
    /// For these devices.
    pub fn new(assignments: &[Assignment]) -> Self {
        let place = |assignment: &Assignment| Place {
            assignment: *assignment,
            next: MonotonicTime::ZERO,
            told: None,
        };
        Self { master: idle(), places: assignments.iter().map(place).collect(), at: None }
    }

    /// The bus is lost: a try that was under way is forgotten. The next one begins with all devices waiting.
    pub fn abort(&mut self) {
        if self.at.take().is_some() {
            self.master = idle();
        }
    }

    /// Goes on, and begins with the next device that is `wanted`; what people should know.
    pub fn run(&mut self, now: MonotonicTime, wanted: impl Fn(NodeId) -> bool) -> Option<LssNotice> {
        let Some((place, step)) = self.at else {
            let ready = |place: &Place| now >= place.next && wanted(place.assignment.node);
            if let Some(place) = self.places.iter().position(ready) {
                self.go(now, place, Step::Wait);
            }
            return None;
        };
        let outcome = self.master.take_outcome()?;
        let assignment = self.places.get(place)?.assignment;
        let failed = |what, failure| Step::Leave(Some(LssNotice::Failed { assignment, what, failure }));
        let next = match (step, outcome) {
            (Step::Wait, _) => Step::Select,
            // Nobody with this address: it is not there, or has no LSS.
            (Step::Select, Err(_)) => Step::Leave(None),
            (Step::Select, Ok(_)) => Step::Inquire,
            (Step::Inquire, Ok(LssReply::NodeId(None))) => Step::Set,
            (Step::Inquire, Ok(LssReply::NodeId(Some(has)))) if has != assignment.node => {
                Step::Leave(Some(LssNotice::Other { assignment, has }))
            }
            (Step::Inquire, Ok(_)) => Step::Leave(None),
            (Step::Inquire, Err(failure)) => failed("asking for its node-id", failure),
            (Step::Set, Err(failure)) => failed("giving the node-id", failure),
            (Step::Set, Ok(_)) if assignment.stores => Step::Store,
            (Step::Store, Err(failure)) => failed("storing the node-id", failure),
            (Step::Set | Step::Store, Ok(_)) => Step::Leave(Some(LssNotice::Given { assignment })),
            (Step::Leave(notice), _) => {
                self.at = None;
                let place = self.places.get_mut(place)?;
                place.next = now + PAUSE;
                let news = notice.filter(|notice| place.told != Some(*notice));
                place.told = notice.or(place.told);
                if matches!(notice, Some(LssNotice::Given { .. })) {
                    place.told = None;
                }
                return news;
            }
        };
        self.go(now, place, next);
        None
    }

    fn go(&mut self, now: MonotonicTime, place: usize, step: Step) {
        let Some(Assignment { node, address, .. }) = self.places.get(place).map(|place| place.assignment)
        else {
            return;
        };
        self.at = Some((place, step));
        let task = match step {
            Step::Wait | Step::Leave(_) => LssTask::SwitchAllToWaiting,
            Step::Select => LssTask::Select(address),
            Step::Inquire => LssTask::InquireNodeId,
            Step::Set => LssTask::SetNodeId(Some(node)),
            Step::Store => LssTask::Store,
        };
        // It is idle between two steps.
        let _ = self.master.start(now, task);
    }

    /// The next frame to send.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        let request = self.master.poll(now)?;
        Frame::new(cob_id::LSS_REQUEST, &request).ok()
    }

    /// Takes a frame; whether it is one of LSS that was asked for.
    pub fn handle(&mut self, now: MonotonicTime, frame: &Frame) -> bool {
        let answer = self.at.is_some() && frame.id() == cob_id::LSS_RESPONSE && !frame.is_remote();
        answer && self.master.handle(now, frame.data()).unwrap_or(false)
    }

    /// When there is something to do by itself.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.at.and_then(|_| self.master.wake_at())
    }
}
