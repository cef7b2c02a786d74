//! The master's end.
//!
//! ```text
//! Idle --start--> Await (an answer, or that a time passes) --> Idle
//!            \--> Select: four frames, then Await
//!            \--> Scan: one question per bit and part; silence means no
//! ```
//!
//! No answer to most questions is a time-out, but silence is itself an answer in a scan. All devices that answer a question of a
//! scan send the same frame, not all at the same time: what comes late must not be taken for the answer to the next question. So
//! each question of a scan has its whole time.

use core::fmt;

use profile_generic::time::{DurationNs, MonotonicTime};

use crate::wire::lss::{
    BitTiming, FASTSCAN_CONFIRM, IdentifyPart, LSS_LEN, LssAddress, LssError, LssMode, LssRequest,
    LssResponse, Part, UNCONFIGURED,
};
use crate::wire::{Error, NodeId};

/// Time for an answer that should come, and for the silence in a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MasterConfig {
    /// Longest time for an answer.
    pub timeout: DurationNs,
    /// Time that each question of a scan has, within which every device must have answered; a scan asks 133 of them.
    pub scan_timeout: DurationNs,
}

impl Default for MasterConfig {
    fn default() -> Self {
        Self { timeout: DurationNs::from_millis(500), scan_timeout: DurationNs::from_millis(20) }
    }
}

/// Devices by a range of their addresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct AddressRange {
    /// Vendor-ID (1018 sub 1).
    pub vendor: u32,
    /// Product code.
    pub product: u32,
    /// Lowest and highest revision.
    pub revision: (u32, u32),
    /// Lowest and highest serial number.
    pub serial: (u32, u32),
}

/// What the master can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LssTask {
    /// All devices wait.
    SwitchAllToWaiting,
    /// All devices go to configuration. Right only where there is one device.
    SwitchAllToConfiguration,
    /// The device with this address goes to configuration.
    Select(LssAddress),
    /// Finds a device without a node-id, which goes to configuration.
    Fastscan,
    /// Whether there are devices with addresses in this range.
    Identify(AddressRange),
    /// Whether there are devices without a node-id.
    IdentifyUnconfigured,
    /// Address of the device in configuration.
    InquireAddress,
    /// Node-id of the device in configuration.
    InquireNodeId,
    /// Sets the node-id of the device in configuration; `None` takes it away. It counts from the time when the device leaves
    /// configuration, if it had none, or from the next reset of the communication.
    SetNodeId(Option<NodeId>),
    /// Sets the bit rate of the device in configuration.
    SetBitTiming(BitTiming),
    /// All devices in configuration change to the bit rate that was set: silence for one delay before and one after that. The
    /// task takes two delays; the caller changes its own bit rate in the middle of it.
    ActivateBitTiming {
        /// Milliseconds.
        delay_ms: u16,
    },
    /// The device in configuration keeps its settings.
    Store,
}

/// What came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LssReply {
    /// It is done.
    Done,
    /// An address: of the device that was found, or asked for it.
    Address(LssAddress),
    /// A node-id; `None` when the device has none.
    NodeId(Option<NodeId>),
    /// Whether anybody is there.
    Found(bool),
}

/// Why a task failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum LssFailure {
    /// Nobody answered.
    #[error("no answer within {milliseconds} ms")]
    Timeout {
        /// Time waited.
        milliseconds: u32,
    },
    /// The device refused.
    #[error("refused: {error} ({specific})")]
    Refused {
        /// Error code.
        error: LssError,
        /// Code of the manufacturer.
        specific: u8,
    },
    /// The scan came to an address to which nobody answered: devices came or went while it ran.
    #[error("the scan came to {0}, which no device has")]
    Unstable(LssAddress),
    /// A device told a node-id that there is not.
    #[error("expected a node-id of 1 to 127 or 255, got {0}")]
    NodeId(u8),
}

/// A scan: the bits found so far, and what is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Scan {
    address: LssAddress,
    part: usize,
    /// What is asked: whether anybody is there, this bit, or whether all bits of the part are right.
    question: Question,
    /// Somebody has said yes.
    heard: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Question {
    Anybody,
    Bit(u8),
    Confirm,
}

impl Scan {
    const START: Self =
        Self { address: LssAddress([0; 4]), part: 0, question: Question::Anybody, heard: false };

    fn request(&self) -> LssRequest {
        let number = self.address.0[self.part];
        let part = u8::try_from(self.part).unwrap_or_default();
        match self.question {
            Question::Anybody => {
                LssRequest::Fastscan { number: 0, bit_check: FASTSCAN_CONFIRM, sub: 0, next: 0 }
            }
            Question::Bit(bit) => LssRequest::Fastscan { number, bit_check: bit, sub: part, next: part },
            Question::Confirm => {
                LssRequest::Fastscan { number, bit_check: 0, sub: part, next: (part + 1) & 3 }
            }
        }
    }

    /// The next question when the time of this one is over, or the end.
    fn next(mut self) -> Result<Self, Result<LssReply, LssFailure>> {
        match (self.question, core::mem::take(&mut self.heard)) {
            (Question::Anybody, false) => return Err(Ok(LssReply::Found(false))),
            (Question::Anybody, true) => self.question = Question::Bit(31),
            (Question::Bit(bit), yes) => {
                if !yes {
                    self.address.0[self.part] |= 1 << bit;
                }
                self.question = bit.checked_sub(1).map_or(Question::Confirm, Question::Bit);
            }
            (Question::Confirm, false) => return Err(Err(LssFailure::Unstable(self.address))),
            (Question::Confirm, true) if self.part == 3 => return Err(Ok(LssReply::Address(self.address))),
            (Question::Confirm, true) => {
                self.part += 1;
                self.question = Question::Bit(31);
            }
        }
        Ok(self)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    /// Frames of a sequence that have been sent; after the last one an answer is awaited.
    Await {
        sent: usize,
    },
    /// Numbers of the address that have been reported.
    Inquire {
        known: usize,
    },
    Scan(Scan),
    /// Only time passes.
    Pause,
}

/// The master's end of LSS. One task at a time.
#[derive(Debug)]
pub struct Master {
    config: MasterConfig,
    task: LssTask,
    state: State,
    address: LssAddress,
    frame: Option<LssRequest>,
    deadline: MonotonicTime,
    outcome: Option<Result<LssReply, LssFailure>>,
}

impl Master {
    /// A master without a task.
    #[must_use]
    pub fn new(config: MasterConfig) -> Self {
        Self {
            config,
            task: LssTask::SwitchAllToWaiting,
            state: State::Idle,
            address: LssAddress::default(),
            frame: None,
            deadline: MonotonicTime::ZERO,
            outcome: None,
        }
    }

    /// Whether no task is under way.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.state == State::Idle
    }

    /// Starts a task; `false` when another one is under way.
    pub fn start(&mut self, now: MonotonicTime, task: LssTask) -> bool {
        if !self.is_idle() {
            return false;
        }
        (self.task, self.outcome) = (task, None);
        self.state = match task {
            LssTask::InquireAddress => State::Inquire { known: 0 },
            LssTask::Fastscan => State::Scan(Scan::START),
            LssTask::ActivateBitTiming { .. } => State::Pause,
            _ => State::Await { sent: 0 },
        };
        self.ask(now);
        true
    }

    /// What came of the last task, once.
    pub fn take_outcome(&mut self) -> Option<Result<LssReply, LssFailure>> {
        self.outcome.take()
    }

    /// When to call [`Master::poll`].
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        if self.frame.is_some() {
            return Some(MonotonicTime::ZERO);
        }
        (!self.is_idle()).then_some(self.deadline)
    }

    /// The next frame to send.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<[u8; LSS_LEN]> {
        if self.frame.is_none() && !self.is_idle() && now >= self.deadline {
            self.elapsed(now);
        }
        let frame = self.frame.take()?;
        self.sent(now);
        Some(frame.emit())
    }

    /// Takes an answer; `Ok(false)` when nobody has asked for it.
    ///
    /// # Errors
    /// [`Error`] when it is none. Nothing changes.
    pub fn handle(&mut self, now: MonotonicTime, data: &[u8]) -> Result<bool, Error> {
        let response = LssResponse::parse(data)?;
        if let (State::Scan(scan), LssResponse::Identified, None) = (&mut self.state, response, self.frame) {
            scan.heard = true;
            return Ok(true);
        }
        let Some(reply) = self.reply(response) else { return Ok(false) };
        match reply {
            Some(outcome) => self.finish(outcome),
            None => self.ask(now),
        }
        Ok(true)
    }

    /// What an answer means: nothing (`None`), that there is more to ask, or the outcome.
    fn reply(&mut self, response: LssResponse) -> Option<Option<Result<LssReply, LssFailure>>> {
        use LssResponse as R;
        use LssTask as T;
        if self.frame.is_some() {
            return None;
        }
        let done = |error, specific| match error {
            LssError::OK => Ok(LssReply::Done),
            _ => Err(LssFailure::Refused { error, specific }),
        };
        Some(match (self.state, self.task, response) {
            (State::Inquire { known }, _, R::Inquired(part, number)) if part.index() == known => {
                self.address.0[known] = number;
                if known + 1 < Part::ALL.len() {
                    self.state = State::Inquire { known: known + 1 };
                    None
                } else {
                    Some(Ok(LssReply::Address(self.address)))
                }
            }
            (State::Await { .. }, T::Select(_), R::Selected) => Some(Ok(LssReply::Done)),
            (State::Await { .. }, T::Identify(_), R::Identified)
            | (State::Await { .. }, T::IdentifyUnconfigured, R::Unconfigured) => {
                Some(Ok(LssReply::Found(true)))
            }
            (State::Await { .. }, T::SetNodeId(_), R::NodeId { error, specific })
            | (State::Await { .. }, T::SetBitTiming(_), R::BitTiming { error, specific })
            | (State::Await { .. }, T::Store, R::Store { error, specific }) => Some(done(error, specific)),
            (State::Await { .. }, T::InquireNodeId, R::InquiredNodeId(node)) => {
                Some(match NodeId::new(node) {
                    Ok(node) => Ok(LssReply::NodeId(Some(node))),
                    Err(_) if node == UNCONFIGURED => Ok(LssReply::NodeId(None)),
                    Err(_) => Err(LssFailure::NodeId(node)),
                })
            }
            _ => return None,
        })
    }

    fn finish(&mut self, outcome: Result<LssReply, LssFailure>) {
        self.state = State::Idle;
        self.frame = None;
        self.outcome = Some(outcome);
    }

    /// Sets the next frame to send.
    fn ask(&mut self, now: MonotonicTime) {
        self.frame = match self.state {
            State::Scan(scan) => Some(scan.request()),
            State::Inquire { known } => Part::ALL.get(known).map(|&part| LssRequest::Inquire(part)),
            State::Await { sent } => self.sequence(sent),
            State::Pause => self.sequence(0),
            State::Idle => None,
        };
        self.deadline = now + self.wait();
    }

    /// The frame of a task after so many.
    fn sequence(&self, sent: usize) -> Option<LssRequest> {
        match self.task {
            LssTask::Select(address) => {
                Part::ALL.get(sent).map(|&part| LssRequest::SwitchSelective(part, address.part(part)))
            }
            LssTask::Identify(range) => {
                let numbers = [
                    range.vendor,
                    range.product,
                    range.revision.0,
                    range.revision.1,
                    range.serial.0,
                    range.serial.1,
                ];
                let part = IdentifyPart::ALL.get(sent)?;
                Some(LssRequest::Identify(*part, numbers[sent]))
            }
            _ if sent > 0 => None,
            LssTask::SwitchAllToWaiting => Some(LssRequest::SwitchGlobal(LssMode::WAITING)),
            LssTask::SwitchAllToConfiguration => Some(LssRequest::SwitchGlobal(LssMode::CONFIGURATION)),
            LssTask::IdentifyUnconfigured => Some(LssRequest::IdentifyUnconfigured),
            LssTask::InquireNodeId => Some(LssRequest::InquireNodeId),
            LssTask::SetNodeId(node) => Some(LssRequest::NodeId(node.map_or(UNCONFIGURED, NodeId::get))),
            LssTask::SetBitTiming(entry) => Some(LssRequest::BitTiming { table: 0, entry }),
            LssTask::ActivateBitTiming { delay_ms } => Some(LssRequest::ActivateBitTiming { delay_ms }),
            LssTask::Store => Some(LssRequest::Store),
            LssTask::InquireAddress | LssTask::Fastscan => None,
        }
    }

    /// A frame is out: the next one of the sequence follows, or an answer is awaited.
    fn sent(&mut self, now: MonotonicTime) {
        self.deadline = now + self.wait();
        if let State::Await { sent } = self.state {
            self.state = State::Await { sent: sent + 1 };
            self.frame = self.sequence(sent + 1);
            let silent = matches!(self.task, LssTask::SwitchAllToWaiting | LssTask::SwitchAllToConfiguration);
            if silent {
                self.finish(Ok(LssReply::Done));
            }
        }
    }

    fn wait(&self) -> DurationNs {
        match self.task {
            LssTask::Fastscan => self.config.scan_timeout,
            LssTask::ActivateBitTiming { delay_ms } => DurationNs::from_millis(i64::from(delay_ms) * 2),
            _ => self.config.timeout,
        }
    }

    fn elapsed(&mut self, now: MonotonicTime) {
        let milliseconds = u32::try_from(self.wait().0 / 1_000_000).unwrap_or(u32::MAX);
        match (self.state, self.task) {
            (State::Pause, _) => self.finish(Ok(LssReply::Done)),
            (State::Scan(scan), _) => match scan.next() {
                Ok(scan) => {
                    self.state = State::Scan(scan);
                    self.ask(now);
                }
                Err(outcome) => self.finish(outcome),
            },
            (_, LssTask::Identify(_) | LssTask::IdentifyUnconfigured) => {
                self.finish(Ok(LssReply::Found(false)))
            }
            _ => self.finish(Err(LssFailure::Timeout { milliseconds })),
        }
    }
}

impl fmt::Display for LssReply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Done => f.write_str("done"),
            Self::Address(address) => write!(f, "{address}"),
            Self::NodeId(Some(node)) => write!(f, "node-id {node}"),
            Self::NodeId(None) => f.write_str("no node-id"),
            Self::Found(true) => f.write_str("found"),
            Self::Found(false) => f.write_str("no device"),
        }
    }
}
