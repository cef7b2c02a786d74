//! The SDO server.

use super::dictionary::abort;
use super::node::Node;
use super::sdo_block::Blocks;
use super::settings::Block;

/// A transfer in progress.
#[derive(Debug, Clone, Default)]
enum Transfer {
    #[default]
    Idle,
    Down {
        index: u16,
        sub: u8,
        size: Option<usize>,
        data: Vec<u8>,
        toggle: bool,
    },
    Up {
        index: u16,
        sub: u8,
        data: Vec<u8>,
        at: usize,
        toggle: bool,
    },
}

/// The server: one transfer at a time.
#[derive(Debug, Clone, Default)]
pub struct SdoServer {
    transfer: Transfer,
    blocks: Blocks,
    requests: u32,
}

/// Most bytes a segmented download can have.
pub(super) const ROOM: usize = 4096;

/// An abort message.
pub(super) fn aborted(index: u16, sub: u8, code: u32) -> Vec<u8> {
    let [low, high] = index.to_le_bytes();
    let mut answer = vec![0x80, low, high, sub];
    answer.extend_from_slice(&code.to_le_bytes());
    answer
}

/// Command, index, sub-index and four more bytes.
pub(super) fn message(command: u8, index: u16, sub: u8, rest: [u8; 4]) -> Vec<u8> {
    let [low, high] = index.to_le_bytes();
    let mut answer = vec![command, low, high, sub];
    answer.extend_from_slice(&rest);
    answer
}

/// The length of something as the protocol tells it.
pub(super) fn size_bytes(length: usize) -> [u8; 4] {
    u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes()
}

/// The unused bytes of a segment, as its command tells them.
fn unused(used: usize) -> u8 {
    u8::try_from(7_usize.saturating_sub(used)).unwrap_or(0)
}

impl SdoServer {
    /// A request; the answers.
    pub fn hear(&mut self, data: &[u8], node: &mut Node) -> Vec<Vec<u8>> {
        let Some(Ok(request)) = data.get(..8).map(<[u8; 8]>::try_from) else { return Vec::new() };
        self.requests = self.requests.wrapping_add(1);
        if node.s.sdo_drops_every > 0 && self.requests.is_multiple_of(node.s.sdo_drops_every) {
            return Vec::new();
        }
        if self.blocks.busy() {
            return self.blocks.hear(request, node);
        }
        self.plain(request, node).into_iter().collect()
    }

    fn plain(&mut self, request: [u8; 8], node: &mut Node) -> Option<Vec<u8>> {
        let [command, low, high, sub, rest @ ..] = request;
        let index = u16::from_le_bytes([low, high]);
        let result = match command >> 5 {
            0 => return Some(self.down_segment(request, node)),
            1 => self.start_down(command, index, sub, rest, node),
            2 => self.start_up(index, sub, node),
            3 => return Some(self.up_segment(command)),
            4 => {
                self.transfer = Transfer::Idle;
                return None;
            }
            5 | 6 => {
                self.transfer = Transfer::Idle;
                match node.s.block {
                    Block::Works => Ok(self.blocks.start(request, node)),
                    Block::PlainAnswer if command >> 5 == 5 && command & 3 == 0 => {
                        self.start_up(index, sub, node)
                    }
                    Block::Silent => return None,
                    _ => Err(abort::COMMAND),
                }
            }
            _ => {
                self.transfer = Transfer::Idle;
                Err(abort::COMMAND)
            }
        };
        Some(result.unwrap_or_else(|code| {
            self.transfer = Transfer::Idle;
            node.refuse(index, sub, code);
            aborted(index, sub, code)
        }))
    }

    fn start_down(
        &mut self,
        command: u8,
        index: u16,
        sub: u8,
        rest: [u8; 4],
        node: &mut Node,
    ) -> Result<Vec<u8>, u32> {
        self.transfer = Transfer::Idle;
        let told = command & 1 != 0;
        if command & 2 != 0 {
            let length = match node.width(index, sub) {
                _ if told => 4 - usize::from((command >> 2) & 3),
                Some(width) => width,
                None => 4,
            };
            node.download(index, sub, rest.get(..length).unwrap_or(&rest))?;
        } else {
            let size = told.then(|| usize::try_from(u32::from_le_bytes(rest)).unwrap_or(usize::MAX));
            node.may_download(index, sub, size)?;
            if size.is_some_and(|size| size > ROOM) {
                return Err(abort::MEMORY);
            }
            self.transfer = Transfer::Down { index, sub, size, data: Vec::new(), toggle: false };
        }
        Ok(message(0x60, index, sub, [0; 4]))
    }

    fn down_segment(&mut self, request: [u8; 8], node: &mut Node) -> Vec<u8> {
        let [command, bytes @ ..] = request;
        let Transfer::Down { index, sub, size, mut data, toggle } = std::mem::take(&mut self.transfer) else {
            return aborted(0, 0, abort::COMMAND);
        };
        let sent_toggle = command & 0x10 != 0;
        let used = 7 - usize::from((command >> 1) & 7);
        data.extend_from_slice(bytes.get(..used).unwrap_or(&[]));
        let last = command & 1 != 0;
        let result = if sent_toggle != toggle {
            Err(abort::TOGGLE)
        } else if data.len() > ROOM {
            Err(abort::MEMORY)
        } else if !last {
            self.transfer = Transfer::Down { index, sub, size, data, toggle: !toggle };
            Ok(())
        } else if size.is_some_and(|size| size != data.len()) {
            Err(abort::LENGTH)
        } else {
            node.download(index, sub, &data)
        };
        match result {
            Ok(()) => vec![0x20 | if toggle { 0x10 } else { 0 }, 0, 0, 0, 0, 0, 0, 0],
            Err(code) => {
                node.refuse(index, sub, code);
                aborted(index, sub, code)
            }
        }
    }

    fn start_up(&mut self, index: u16, sub: u8, node: &mut Node) -> Result<Vec<u8>, u32> {
        self.transfer = Transfer::Idle;
        let data = node.upload(index, sub)?;
        if (1..=4).contains(&data.len()) && !node.s.upload_in_segments {
            let mut rest = [0; 4];
            for (to, from) in rest.iter_mut().zip(&data) {
                *to = *from;
            }
            let free = u8::try_from(4 - data.len()).unwrap_or(0);
            let command = if node.s.upload_without_size { 0x42 } else { 0x43 | (free << 2) };
            return Ok(message(command, index, sub, rest));
        }
        let size = size_bytes(data.len());
        self.transfer = Transfer::Up { index, sub, data, at: 0, toggle: false };
        if node.s.upload_without_size {
            return Ok(message(0x40, index, sub, [0; 4]));
        }
        Ok(message(0x41, index, sub, size))
    }

    fn up_segment(&mut self, command: u8) -> Vec<u8> {
        let Transfer::Up { index, sub, data, at, toggle } = std::mem::take(&mut self.transfer) else {
            return aborted(0, 0, abort::COMMAND);
        };
        if (command & 0x10 != 0) != toggle {
            return aborted(index, sub, abort::TOGGLE);
        }
        let part = data.get(at..data.len().min(at + 7)).unwrap_or(&[]).to_vec();
        let next = at + part.len();
        let last = next >= data.len();
        let head = if toggle { 0x10 } else { 0 } | (unused(part.len()) << 1) | u8::from(last);
        let mut answer = vec![head];
        answer.extend_from_slice(&part);
        answer.resize(8, 0);
        if !last {
            self.transfer = Transfer::Up { index, sub, data, at: next, toggle: !toggle };
        }
        answer
    }
}
