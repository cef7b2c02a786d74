//! Identifiers of the predefined master/slave connection set, and fragmentation.

use crate::can::Frame;

/// Message ID in group 2: the slave's explicit and unconnected answers.
pub const EXPLICIT_ANSWER: u8 = 3;
/// Message ID in group 2: the master's explicit requests.
pub const EXPLICIT_REQUEST: u8 = 4;
/// Message ID in group 2: the master's poll command.
pub const POLL_COMMAND: u8 = 5;
/// Message ID in group 2: unconnected explicit requests to a group 2 only server.
pub const UNCONNECTED_REQUEST: u8 = 6;
/// Message ID in group 2: the duplicate MAC ID check.
pub const DUP_CHECK: u8 = 7;
/// Message ID in group 1: the slave's answer to a poll.
pub const POLL_ANSWER: u8 = 15;

/// The header's bit of a fragment.
pub const FRAGMENT: u8 = 0x80;
/// The header's transaction bit.
pub const TRANSACTION: u8 = 0x40;

/// An identifier of group 1.
#[must_use]
pub fn group1(mac: u8, message: u8) -> u16 {
    (u16::from(message & 0x0F) << 6) | u16::from(mac & 0x3F)
}

/// An identifier of group 2.
#[must_use]
pub fn group2(mac: u8, message: u8) -> u16 {
    0x400 | (u16::from(mac & 0x3F) << 3) | u16::from(message & 0x07)
}

/// The MAC ID and the message ID in an identifier of group 2.
#[must_use]
pub fn split_group2(id: u16) -> Option<(u8, u8)> {
    if id & 0x600 != 0x400 {
        return None;
    }
    Some((u8::try_from((id >> 3) & 0x3F).ok()?, u8::try_from(id & 7).ok()?))
}

/// What a frame of an explicit connection was.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Explicit {
    /// Nothing that counts.
    Nothing,
    /// A fragment that is taken, or not: the acknowledge to send, with its state.
    Part(u8, u8),
    /// A whole message from the service code on; a fragmented one also wants its last fragment acknowledged.
    Whole(Vec<u8>, Option<u8>),
    /// An acknowledge of a fragment of the slave's answer: count and state.
    Acknowledge(u8, u8),
}

/// Puts explicit requests together.
#[derive(Debug, Clone, Default)]
pub struct ExplicitIn {
    open: bool,
    count: u8,
    transaction: u8,
    data: Vec<u8>,
}

impl ExplicitIn {
    /// Takes the data of a frame, the header included. No message is longer than `longest`.
    pub fn take(&mut self, frame: &[u8], longest: usize) -> Explicit {
        let Some((&header, rest)) = frame.split_first() else { return Explicit::Nothing };
        if header & FRAGMENT == 0 {
            self.open = false;
            return if rest.is_empty() { Explicit::Nothing } else { Explicit::Whole(rest.to_vec(), None) };
        }
        let Some((&protocol, body)) = rest.split_first() else { return Explicit::Nothing };
        let count = protocol & 0x3F;
        let transaction = header & TRANSACTION;
        match protocol >> 6 {
            0 => {
                if count != 0 {
                    self.open = false;
                    return Explicit::Nothing;
                }
                self.open = true;
                self.count = 0;
                self.transaction = transaction;
                self.data.clear();
                self.data.extend_from_slice(body);
                Explicit::Part(0, 0)
            }
            3 => Explicit::Acknowledge(count, body.first().copied().unwrap_or(0)),
            kind => {
                if !self.open || transaction != self.transaction {
                    return Explicit::Nothing;
                }
                if count == self.count {
                    return Explicit::Part(count, 0);
                }
                if count != (self.count + 1) & 0x3F {
                    self.open = false;
                    return Explicit::Nothing;
                }
                self.count = count;
                if self.data.len() + body.len() > longest {
                    self.open = false;
                    return Explicit::Part(count, 1);
                }
                self.data.extend_from_slice(body);
                if kind == 1 {
                    return Explicit::Part(count, 0);
                }
                self.open = false;
                Explicit::Whole(std::mem::take(&mut self.data), Some(count))
            }
        }
    }
}

/// The data of an acknowledge of a fragment.
#[must_use]
pub fn acknowledge(header: u8, count: u8, state: u8) -> [u8; 3] {
    [(header & 0x7F) | FRAGMENT, 0xC0 | (count & 0x3F), state]
}

/// Sends an explicit answer, in fragments if it is long.
#[derive(Debug, Clone)]
pub struct ExplicitOut {
    id: u16,
    header: u8,
    data: Vec<u8>,
    at: usize,
    count: u8,
    tries: u8,
    deadline_us: u64,
}

/// How long an acknowledge may take.
const ACKNOWLEDGE_US: u64 = 1_000_000;
/// The data bytes of an explicit fragment.
const EXPLICIT_PART: usize = 6;
/// The data bytes of a fragment of I/O data.
const IO_PART: usize = 7;

impl ExplicitOut {
    /// Sends the first frame. Something comes back if there is more to send.
    pub fn start(now_us: u64, id: u16, header: u8, data: Vec<u8>, out: &mut Vec<Frame>) -> Option<Self> {
        let header = header & !FRAGMENT;
        if data.len() <= 7 {
            let mut bytes = vec![header];
            bytes.extend_from_slice(&data);
            out.push(Frame::new(id, &bytes));
            return None;
        }
        let mut this = Self { id, header, data, at: 0, count: 0, tries: 0, deadline_us: 0 };
        this.send(now_us, out);
        Some(this)
    }

    fn send(&mut self, now_us: u64, out: &mut Vec<Frame>) {
        let end = (self.at + EXPLICIT_PART).min(self.data.len());
        let kind = if self.at == 0 {
            0x00
        } else if end == self.data.len() {
            0x80
        } else {
            0x40
        };
        let mut bytes = vec![self.header | FRAGMENT, kind | self.count];
        bytes.extend_from_slice(&self.data[self.at..end]);
        out.push(Frame::new(self.id, &bytes));
        self.tries += 1;
        self.deadline_us = now_us + ACKNOWLEDGE_US;
    }

    /// Takes an acknowledge. True as long as there is more to come.
    pub fn acknowledged(&mut self, now_us: u64, count: u8, state: u8, out: &mut Vec<Frame>) -> bool {
        if count != self.count {
            return true;
        }
        if state != 0 {
            return false;
        }
        self.at += EXPLICIT_PART;
        if self.at >= self.data.len() {
            return false;
        }
        self.count = (self.count + 1) & 0x3F;
        self.tries = 0;
        self.send(now_us, out);
        true
    }

    /// Sends a fragment once more when its acknowledge is late. True as long as there is hope.
    pub fn tick(&mut self, now_us: u64, out: &mut Vec<Frame>) -> bool {
        if now_us < self.deadline_us {
            return true;
        }
        if self.tries >= 2 {
            return false;
        }
        self.send(now_us, out);
        true
    }
}

/// The frames' data of an I/O message of a connection of this size.
#[must_use]
pub fn split_io(size: usize, data: &[u8]) -> Vec<Vec<u8>> {
    if size.max(data.len()) <= 8 {
        return vec![data.to_vec()];
    }
    if data.len() <= IO_PART {
        let mut only = vec![0x3F];
        only.extend_from_slice(data);
        return vec![only];
    }
    let parts = data.chunks(IO_PART);
    let last = parts.len() - 1;
    parts
        .enumerate()
        .map(|(at, part)| {
            let kind = match at {
                0 => 0x00,
                at if at == last => 0x80,
                _ => 0x40,
            };
            let mut bytes = vec![kind | (u8::try_from(at & 0x3F).unwrap_or(0))];
            bytes.extend_from_slice(part);
            bytes
        })
        .collect()
}

/// Puts I/O messages together.
#[derive(Debug, Clone, Default)]
pub struct IoIn {
    open: bool,
    count: u8,
    data: Vec<u8>,
}

impl IoIn {
    /// Takes the data of a frame for a connection of this size. A whole message comes back.
    pub fn take(&mut self, size: usize, frame: &[u8]) -> Option<Vec<u8>> {
        if size <= 8 {
            return Some(frame.to_vec());
        }
        let Some((&protocol, body)) = frame.split_first() else { return Some(Vec::new()) };
        let count = protocol & 0x3F;
        match protocol >> 6 {
            0 if count == 0x3F => {
                self.open = false;
                Some(body.to_vec())
            }
            0 if count == 0 => {
                self.open = true;
                self.count = 0;
                self.data.clear();
                self.data.extend_from_slice(body);
                None
            }
            kind @ (1 | 2) if self.open && count == (self.count + 1) & 0x3F => {
                self.count = count;
                self.data.extend_from_slice(body);
                if self.data.len() > size {
                    self.open = false;
                    return None;
                }
                if kind == 1 {
                    return None;
                }
                self.open = false;
                Some(std::mem::take(&mut self.data))
            }
            _ => {
                self.open = false;
                None
            }
        }
    }

    /// Forgets a message that has begun.
    pub fn clear(&mut self) {
        self.open = false;
    }
}
