//! Block transfers of the SDO server, for drives that have them.

use super::dictionary::abort;
use super::node::Node;
use super::sdo::{ROOM, aborted, message, size_bytes};

/// Segments the server takes in a block.
const BLOCK: u8 = 16;

#[derive(Debug, Clone, Default)]
enum State {
    #[default]
    Idle,
    Down {
        size: Option<usize>,
        crc: bool,
        expected: u8,
        data: Vec<u8>,
    },
    DownEnd {
        size: Option<usize>,
        crc: bool,
        data: Vec<u8>,
    },
    UpReady {
        data: Vec<u8>,
        block: u8,
    },
    Up {
        data: Vec<u8>,
        at: usize,
        sent: u8,
    },
    UpEnd,
}

/// The state of a block transfer.
#[derive(Debug, Clone, Default)]
pub struct Blocks {
    state: State,
    index: u16,
    sub: u8,
}

/// CRC-16 with polynomial 1021h that starts with 0.
fn crc(data: &[u8]) -> u16 {
    data.iter().fold(0, |sum: u16, byte| {
        (0..8).fold(sum ^ (u16::from(*byte) << 8), |sum, _| {
            if sum & 0x8000 != 0 { (sum << 1) ^ 0x1021 } else { sum << 1 }
        })
    })
}

impl Blocks {
    /// Whether a block transfer is going on.
    pub fn busy(&self) -> bool {
        !matches!(self.state, State::Idle)
    }

    fn stop(&mut self, code: u32, node: &mut Node) -> Vec<Vec<u8>> {
        self.state = State::Idle;
        node.refuse(self.index, self.sub, code);
        vec![aborted(self.index, self.sub, code)]
    }

    /// The request that begins a transfer.
    pub fn start(&mut self, request: [u8; 8], node: &mut Node) -> Vec<u8> {
        let [command, low, high, sub, a, b, c, d] = request;
        self.index = u16::from_le_bytes([low, high]);
        self.sub = sub;
        let result = match command {
            0xC0..=0xDF if command & 1 == 0 => {
                self.start_down(command, u32::from_le_bytes([a, b, c, d]), node)
            }
            0xA0..=0xBF if command & 3 == 0 => self.start_up(a, node),
            _ => Err(abort::COMMAND),
        };
        result.unwrap_or_else(|code| self.stop(code, node).swap_remove(0))
    }

    fn start_down(&mut self, command: u8, told: u32, node: &Node) -> Result<Vec<u8>, u32> {
        let size = (command & 2 != 0).then(|| usize::try_from(told).unwrap_or(usize::MAX));
        node.may_download(self.index, self.sub, size)?;
        if size.is_some_and(|size| size > ROOM) {
            return Err(abort::MEMORY);
        }
        self.state = State::Down { size, crc: command & 4 != 0, expected: 1, data: Vec::new() };
        Ok(message(0xA4, self.index, self.sub, [BLOCK, 0, 0, 0]))
    }

    fn start_up(&mut self, block: u8, node: &mut Node) -> Result<Vec<u8>, u32> {
        if block == 0 || block > 127 {
            return Err(abort::BLOCK_SIZE);
        }
        let data = node.upload(self.index, self.sub)?;
        let size = size_bytes(data.len());
        self.state = State::UpReady { data, block };
        Ok(message(0xC6, self.index, self.sub, size))
    }

    /// A message in the middle of a transfer.
    pub fn hear(&mut self, request: [u8; 8], node: &mut Node) -> Vec<Vec<u8>> {
        let [command, rest @ ..] = request;
        // In a block of segments 80h would be a last segment 0, which cannot be: it is an abort.
        if command == 0x80 {
            self.state = State::Idle;
            return Vec::new();
        }
        match std::mem::take(&mut self.state) {
            State::Down { size, crc, expected, data } => {
                self.down(command, rest, Down { size, crc, expected, data }, node)
            }
            State::DownEnd { size, crc, data } => self.down_end(request, size, crc, data, node),
            State::UpReady { data, block } if command & 0xE3 == 0xA3 => self.send(data, 0, block),
            State::Up { data, at, sent } if command & 0xE3 == 0xA2 => {
                let [acknowledged, block, ..] = rest;
                if acknowledged > sent {
                    return self.stop(abort::SEQUENCE, node);
                }
                if block == 0 || block > 127 {
                    return self.stop(abort::BLOCK_SIZE, node);
                }
                let next = at + usize::from(acknowledged) * 7;
                if next < data.len() || (data.is_empty() && acknowledged == 0) {
                    return self.send(data, next, block);
                }
                let used = if data.is_empty() { 0 } else { (data.len() - 1) % 7 + 1 };
                let unused = u8::try_from(7 - used).unwrap_or(0);
                let [low, high] = crc(&data).to_le_bytes();
                self.state = State::UpEnd;
                vec![vec![0xC1 | (unused << 2), low, high, 0, 0, 0, 0, 0]]
            }
            State::UpEnd if command & 0xE3 == 0xA1 => Vec::new(),
            _ => self.stop(abort::COMMAND, node),
        }
    }

    fn send(&mut self, data: Vec<u8>, at: usize, block: u8) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        let mut from = at;
        for sequence in 1..=block {
            let part = data.get(from..data.len().min(from + 7)).unwrap_or(&[]);
            from += part.len();
            let last = from >= data.len();
            let mut segment = vec![sequence | if last { 0x80 } else { 0 }];
            segment.extend_from_slice(part);
            segment.resize(8, 0);
            out.push(segment);
            if last {
                break;
            }
        }
        let sent = u8::try_from(out.len()).unwrap_or(127);
        self.state = State::Up { data, at, sent };
        out
    }

    fn down(&mut self, command: u8, bytes: [u8; 7], mut now: Down, node: &mut Node) -> Vec<Vec<u8>> {
        let sequence = command & 0x7F;
        let last = command & 0x80 != 0;
        let fits = sequence == now.expected;
        if fits {
            now.data.extend_from_slice(&bytes);
            now.expected += 1;
        }
        if now.data.len() > ROOM + 7 {
            return self.stop(abort::MEMORY, node);
        }
        let taken = now.expected - 1;
        let Down { size, crc, data, .. } = now;
        if last && fits {
            self.state = State::DownEnd { size, crc, data };
        } else if last || sequence >= BLOCK {
            self.state = State::Down { size, crc, expected: 1, data };
        } else {
            self.state = State::Down { size, crc, expected: taken + 1, data };
            return Vec::new();
        }
        vec![vec![0xA2, taken, BLOCK, 0, 0, 0, 0, 0]]
    }

    fn down_end(
        &mut self,
        request: [u8; 8],
        size: Option<usize>,
        with_crc: bool,
        mut data: Vec<u8>,
        node: &mut Node,
    ) -> Vec<Vec<u8>> {
        let [command, low, high, ..] = request;
        if command & 0xE3 != 0xC1 {
            return self.stop(abort::COMMAND, node);
        }
        let unused = usize::from((command >> 2) & 7);
        data.truncate(data.len().saturating_sub(unused));
        if with_crc && crc(&data) != u16::from_le_bytes([low, high]) {
            return self.stop(abort::CRC, node);
        }
        if size.is_some_and(|size| size != data.len()) {
            return self.stop(abort::LENGTH, node);
        }
        match node.download(self.index, self.sub, &data) {
            Ok(()) => vec![vec![0xA1, 0, 0, 0, 0, 0, 0, 0]],
            Err(code) => self.stop(code, node),
        }
    }
}

/// A download in the middle of a block.
struct Down {
    size: Option<usize>,
    crc: bool,
    expected: u8,
    data: Vec<u8>,
}

#[cfg(test)]
mod tests {
    #[test]
    fn crc_of_the_check_string() {
        assert_eq!(super::crc(b"123456789"), 0x31C3);
    }
}
