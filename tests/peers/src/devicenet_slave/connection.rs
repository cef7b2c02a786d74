//! Connections of the predefined master/slave connection set.

use super::messages;
use super::objects::Refusal;

/// The connection does not exist.
pub const NON_EXISTENT: u8 = 0;
/// It waits for its expected packet rate.
pub const CONFIGURING: u8 = 1;
/// It works.
pub const ESTABLISHED: u8 = 3;
/// Its watchdog has run out.
pub const TIMED_OUT: u8 = 4;
/// The explicit connection has run out while the poll connection works.
pub const DEFERRED: u8 = 5;

/// What the watchdog of a connection has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expired {
    /// It has not run out.
    No,
    /// The connection is timed out.
    TimedOut,
    /// The connection is deleted.
    Deleted,
    /// The connection goes on.
    Reset,
}

/// The explicit or the poll connection.
#[derive(Debug, Clone)]
pub struct Connection {
    /// The instance of the Connection object: 1 explicit, 2 polled.
    pub instance: u8,
    /// The state.
    pub state: u8,
    /// The expected packet rate in milliseconds.
    pub packet_rate: u16,
    /// 0 timed out, 1 delete, 2 reset, 3 deferred delete.
    pub watchdog_action: u8,
    /// The shift of the watchdog's factor of four.
    pub multiplier: u8,
    /// The attribute transportClass_trigger.
    pub transport: u8,
    /// The production inhibit time.
    pub inhibit: u16,
    /// The number of bytes it produces.
    pub produced_size: u16,
    /// The number of bytes it consumes.
    pub consumed_size: u16,
    /// Where the produced data come from.
    pub produced_path: Vec<u8>,
    /// Where the consumed data go.
    pub consumed_path: Vec<u8>,
    deadline_us: Option<u64>,
}

/// The time the first message may take at least.
const FIRST_US: u64 = 10_000_000;

impl Connection {
    /// A connection that does not exist.
    #[must_use]
    pub fn none(instance: u8) -> Self {
        Self {
            instance,
            state: NON_EXISTENT,
            packet_rate: 0,
            watchdog_action: 0,
            multiplier: 0,
            transport: 0x83,
            inhibit: 0,
            produced_size: 0,
            consumed_size: 0,
            produced_path: Vec::new(),
            consumed_path: Vec::new(),
            deadline_us: None,
        }
    }

    /// The explicit connection right after the allocation.
    #[must_use]
    pub fn explicit(now_us: u64) -> Self {
        let mut this = Self {
            state: ESTABLISHED,
            packet_rate: 2500,
            watchdog_action: 1,
            produced_size: 0xFFFF,
            consumed_size: 0xFFFF,
            ..Self::none(1)
        };
        this.arm(now_us, true);
        this
    }

    /// The poll connection right after the allocation. The sizes are produced and consumed.
    #[must_use]
    pub fn poll(transport: u8, sizes: (u16, u16), produced_path: Vec<u8>, consumed_path: Vec<u8>) -> Self {
        let (produced_size, consumed_size) = sizes;
        Self {
            state: CONFIGURING,
            transport,
            produced_size,
            consumed_size,
            produced_path,
            consumed_path,
            ..Self::none(2)
        }
    }

    /// Whether it is there at all.
    #[must_use]
    pub fn exists(&self) -> bool {
        self.state != NON_EXISTENT
    }

    /// Starts the watchdog anew.
    pub fn arm(&mut self, now_us: u64, first: bool) {
        let time = (u64::from(self.packet_rate) * 4000) << self.multiplier.min(7);
        self.deadline_us = (time > 0).then(|| now_us + if first { time.max(FIRST_US) } else { time });
    }

    /// Runs the watchdog. `child` says that the poll connection works.
    pub fn watch(&mut self, now_us: u64, child: bool) -> Expired {
        let watched = matches!(self.state, ESTABLISHED);
        if !watched || self.deadline_us.is_none_or(|deadline| now_us < deadline) {
            return Expired::No;
        }
        match self.watchdog_action {
            2 => {
                self.arm(now_us, false);
                Expired::Reset
            }
            3 if self.instance == 1 && child => {
                self.state = DEFERRED;
                Expired::TimedOut
            }
            1 | 3 => {
                *self = Self::none(self.instance);
                Expired::Deleted
            }
            _ => {
                self.state = TIMED_OUT;
                Expired::TimedOut
            }
        }
    }

    /// Reads an attribute. `told` replaces the sizes that are told.
    ///
    /// # Errors
    ///
    /// There is no such attribute.
    pub fn get(&self, mac: u8, attribute: u16, told: (Option<u16>, Option<u16>)) -> Result<Vec<u8>, Refusal> {
        let poll = self.instance == 2;
        let id = |group1: bool, message| {
            if group1 { messages::group1(mac, message) } else { messages::group2(mac, message) }
        };
        Ok(match attribute {
            1 => vec![self.state],
            2 => vec![u8::from(poll)],
            3 => vec![self.transport],
            4 if poll => id(true, messages::POLL_ANSWER).to_le_bytes().to_vec(),
            4 => id(false, messages::EXPLICIT_ANSWER).to_le_bytes().to_vec(),
            5 if poll => id(false, messages::POLL_COMMAND).to_le_bytes().to_vec(),
            5 => id(false, messages::EXPLICIT_REQUEST).to_le_bytes().to_vec(),
            6 => vec![if poll { 0x01 } else { 0x21 }],
            7 => told.0.unwrap_or(self.produced_size).to_le_bytes().to_vec(),
            8 => told.1.unwrap_or(self.consumed_size).to_le_bytes().to_vec(),
            9 => self.packet_rate.to_le_bytes().to_vec(),
            12 => vec![self.watchdog_action],
            13 => u16::try_from(self.produced_path.len()).unwrap_or(0).to_le_bytes().to_vec(),
            14 => self.produced_path.clone(),
            15 => u16::try_from(self.consumed_path.len()).unwrap_or(0).to_le_bytes().to_vec(),
            16 => self.consumed_path.clone(),
            17 => self.inhibit.to_le_bytes().to_vec(),
            18 => vec![self.multiplier],
            _ => return Err(Refusal::NO_ATTRIBUTE),
        })
    }
}
