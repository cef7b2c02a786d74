//! What the bytes of a fuzzer do to a conversation.

use profile_generic::can::{Frame, Id};

/// Frames that a peer may send at one instant before it counts as out of hand.
pub const BURST_MAX: usize = 2_000;

/// The bytes, one after the other; zeros once they are over.
#[derive(Debug, Clone)]
pub struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    pub const fn new(data: &'a [u8]) -> Self {
        Self(data)
    }

    pub const fn is_over(&self) -> bool {
        self.0.is_empty()
    }

    pub fn byte(&mut self) -> u8 {
        let [byte] = self.array();
        byte
    }

    pub fn word(&mut self) -> u16 {
        u16::from_le_bytes(self.array())
    }

    pub fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut array = [0; N];
        let taken = self.take(N);
        array[..taken.len()].copy_from_slice(taken);
        array
    }

    /// So many bytes, or those that are left.
    pub fn take(&mut self, len: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(len.min(self.0.len()));
        self.0 = rest;
        taken
    }

    /// A length and so many bytes.
    pub fn block(&mut self) -> &'a [u8] {
        let len = usize::from(self.byte());
        self.take(len)
    }

    /// A head of two bytes, a length and the data of a frame.
    ///
    /// | bits of the head | |
    /// |---|---|
    /// | 10..0 | identifier |
    /// | 13 | an FD frame |
    /// | 14 | an identifier of 29 bits |
    /// | 15 | a remote frame |
    pub fn frame(&mut self) -> Option<Frame> {
        let head = self.word();
        let len = usize::from(self.byte() & 0x0F);
        can_frame(head, self.take(len))
    }
}

/// The frame with a head as in [`Bytes::frame`]; no frame for FD frames of lengths that there are not.
fn can_frame(head: u16, data: &[u8]) -> Option<Frame> {
    let number = head & Id::STANDARD_MAX;
    let id = if head & 1 << 14 == 0 { Id::Standard(number) } else { Id::Extended(u32::from(number)) };
    let short = &data[..data.len().min(8)];
    match head >> 13 {
        4.. => Frame::remote(id, short.len()),
        1 | 3 => Frame::fd(id, data, false),
        _ => Frame::new(id, short),
    }
    .ok()
}

/// Disturbs what one side of a conversation says, in the order in which it is said.
///
/// A byte below [`ACT`] lets so many messages pass, any other one does something to the next message. When the bytes are over, or
/// [`Disturber::calm`] was called, everything passes.
pub struct Disturber<'a> {
    bytes: Bytes<'a>,
    pass: u8,
}

/// From this byte on something is done.
const ACT: u8 = 0xC0;

impl<'a> Disturber<'a> {
    pub const fn new(data: &'a [u8]) -> Self {
        Self { bytes: Bytes::new(data), pass: 0 }
    }

    pub const fn is_over(&self) -> bool {
        self.bytes.is_over()
    }

    /// Nothing is disturbed any more.
    pub const fn calm(&mut self) {
        self.bytes = Bytes::new(&[]);
        self.pass = 0;
    }

    /// A message is said; `deliver` gets what arrives.
    pub fn carry(&mut self, message: &[u8], deliver: &mut dyn FnMut(&[u8])) {
        if self.pass > 0 {
            self.pass -= 1;
            return deliver(message);
        }
        if self.is_over() {
            return deliver(message);
        }
        let act = self.bytes.byte();
        if act < ACT {
            self.pass = act;
            return deliver(message);
        }
        let mut changed = message.to_vec();
        match act & 7 {
            0 => return,
            1 => deliver(message),
            2 => {
                let at = usize::from(self.bytes.word());
                let with = self.bytes.byte();
                if let Some(byte) = changed.get_mut(at % message.len().max(1)) {
                    *byte ^= with;
                }
            }
            3 => changed.truncate(usize::from(self.bytes.byte())),
            4 => changed = self.bytes.block().to_vec(),
            5 => {
                deliver(message);
                changed = self.bytes.block().to_vec();
            }
            6 => {
                let at = usize::from(self.bytes.word()) % message.len().max(1);
                let with = self.bytes.array::<4>();
                let end = (at + with.len()).min(changed.len());
                changed[at.min(end)..end].copy_from_slice(&with[..end.saturating_sub(at)]);
            }
            _ => {
                let (to, from) = (usize::from(self.bytes.word()), self.bytes.block());
                let at = to % message.len().max(1);
                changed.truncate(at);
                changed.extend_from_slice(from);
            }
        }
        deliver(&changed);
    }

    /// The same for a CAN frame, whose head is the first two bytes of its message, as in [`Bytes::frame`].
    pub fn carry_frame(&mut self, frame: &Frame, deliver: &mut dyn FnMut(&Frame)) {
        let Id::Standard(number) = frame.id() else { return deliver(frame) };
        let message = [&number.to_le_bytes()[..], frame.data()].concat();
        self.carry(&message, &mut |bytes| {
            if let Some((head, data)) = bytes.split_first_chunk()
                && let Some(frame) = can_frame(u16::from_le_bytes(*head), data)
            {
                deliver(&frame);
            }
        });
    }
}
