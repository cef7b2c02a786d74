//! A device as its master sees it: frames in, frames out, in virtual time.

mod bad_input;
mod communication;
mod configuration;

use profile_generic::can::{Frame, Id};
use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::drive::{Device, identity};
use super::*;
use crate::drive::{State, Statusword, index};
use crate::wire::nmt::NmtCommand;
use crate::wire::{AbortCode, Mux};

/// A device and its master's hand.
pub(crate) struct Rig {
    pub node: Node<Device>,
    pub now: MonotonicTime,
    /// What the device has sent.
    pub sent: Vec<Frame>,
}

pub(crate) const NODE: u8 = 5;

impl Rig {
    /// A device with so many axes, pre-operational, with its DC link charged.
    pub fn new(axes: usize) -> Self {
        let device = Device::new(&vec![ServoParameters::default(); axes]).expect("a device");
        let config = Config {
            node: NodeId::new(NODE).ok(),
            identity: identity(axes, 1),
            boot_time: DurationNs::from_millis(10),
            has_blocks: true,
            has_mapping: true,
        };
        let mut rig =
            Self { node: Node::new(&config, device), now: MonotonicTime(1_000_000_000), sent: Vec::new() };
        rig.run(400);
        rig
    }

    /// Lets so many milliseconds pass.
    pub fn run(&mut self, milliseconds: i64) {
        for _ in 0..milliseconds {
            self.now = self.now + DurationNs::from_millis(1);
            self.node.handle_time(self.now);
            self.drain();
        }
    }

    /// Runs until something is so, or so many milliseconds.
    pub fn run_until(&mut self, milliseconds: i64, mut done: impl FnMut(&mut Self) -> bool) -> bool {
        for _ in 0..milliseconds {
            if done(self) {
                return true;
            }
            self.run(1);
        }
        false
    }

    fn drain(&mut self) {
        while let Some(frame) = self.node.poll(self.now) {
            self.sent.push(frame);
        }
    }

    /// Takes what was sent.
    pub fn take(&mut self) -> Vec<Frame> {
        std::mem::take(&mut self.sent)
    }

    /// What was sent with an identifier.
    pub fn take_of(&mut self, id: u16) -> Vec<Vec<u8>> {
        let frames = self.take().into_iter().filter(|frame| frame.id() == Id::Standard(id));
        frames.map(|frame| frame.data().to_vec()).collect()
    }

    pub fn send(&mut self, id: u16, data: &[u8]) {
        let frame = Frame::new(Id::Standard(id), data).expect("a frame");
        self.node.handle_frame(self.now, &frame);
        self.drain();
    }

    pub fn nmt(&mut self, command: NmtCommand) {
        self.send(0, &[command.0, NODE]);
    }

    fn sdo(&mut self, request: [u8; 8]) -> [u8; 8] {
        self.sent.retain(|frame| frame.id() != Id::Standard(0x580 + u16::from(NODE)));
        self.send(0x600 + u16::from(NODE), &request);
        let answers = self.sent.iter().filter(|frame| frame.id() == Id::Standard(0x580 + u16::from(NODE)));
        let answers: Vec<_> = answers.map(|frame| frame.data().to_vec()).collect();
        assert_eq!(answers.len(), 1, "one answer to {request:02x?}");
        answers[0].clone().try_into().expect("eight bytes")
    }

    /// Writes up to four bytes of an object.
    pub fn write(&mut self, index: u16, sub: u8, number: i64, size: usize) -> Result<(), AbortCode> {
        let [low, high] = index.to_le_bytes();
        let unused = u8::try_from(4 - size).expect("up to four bytes");
        let mut request = [0x23 | unused << 2, low, high, sub, 0, 0, 0, 0];
        request[4..4 + size].copy_from_slice(&number.to_le_bytes()[..size]);
        let answer = self.sdo(request);
        match answer[0] {
            0x60 => Ok(()),
            0x80 => Err(AbortCode(u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]))),
            other => panic!("answer {other:02x}"),
        }
    }

    /// Writes an object of its own size.
    pub fn set(&mut self, index: u16, sub: u8, number: i64) -> Result<(), AbortCode> {
        let handle = self.node.dictionary().find(Mux::new(index, sub)).expect("an object");
        let size = self.node.dictionary().entry(handle).definition().data_type.size();
        self.write(index, sub, number, size)
    }

    /// Reads an object of up to four bytes.
    pub fn read(&mut self, index: u16, sub: u8) -> Result<u32, AbortCode> {
        let [low, high] = index.to_le_bytes();
        let answer = self.sdo([0x40, low, high, sub, 0, 0, 0, 0]);
        let value = u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]);
        match answer[0] {
            0x43 | 0x47 | 0x4B | 0x4F => Ok(value),
            0x80 => Err(AbortCode(value)),
            other => panic!("answer {other:02x}"),
        }
    }

    pub fn status(&self, axis: u16) -> Statusword {
        let word = self.node.dictionary().number(index::STATUSWORD + axis * index::AXIS_OFFSET, 0);
        Statusword::from_bits_retain(u16::try_from(word).expect("a word"))
    }

    pub fn state(&self) -> State {
        self.status(0).state().expect("a state")
    }

    /// Enables the first axis by SDO, in a mode.
    pub fn enable(&mut self, mode: i64) {
        self.set(index::MODE, 0, mode).expect("a mode");
        for (word, state) in
            [(6, State::ReadyToSwitchOn), (7, State::SwitchedOn), (15, State::OperationEnabled)]
        {
            self.set(index::CONTROLWORD, 0, word).expect("a controlword");
            assert!(self.run_until(500, |rig| rig.state() == state), "{} not {state}", self.state());
        }
    }

    /// Maps objects into a PDO as a master does: disable, clear, map, count, communication, enable.
    pub fn map(&mut self, communication: u16, id: u32, kind: i64, entries: &[u32]) {
        let mapping = communication + 0x200;
        self.set(communication, 1, i64::from(id | 1 << 31)).expect("invalid");
        self.set(mapping, 0, 0).expect("empty");
        for (sub, entry) in (1..).zip(entries) {
            self.set(mapping, sub, i64::from(*entry)).expect("mapped");
        }
        self.set(mapping, 0, i64::try_from(entries.len()).expect("a few")).expect("counted");
        self.set(communication, 2, kind).expect("a type");
        self.set(communication, 1, i64::from(id)).expect("valid");
    }

    /// Maps controlword and target position, statusword and actual position, with SYNC.
    pub fn map_position(&mut self) {
        self.map(0x1400, 0x200 + u32::from(NODE), 1, &[0x6040_0010, 0x607A_0020]);
        self.map(0x1800, 0x180 + u32::from(NODE), 1, &[0x6041_0010, 0x6064_0020]);
    }

    /// One cycle of the master: set-point, SYNC, and what comes back.
    pub fn cycle(&mut self, milliseconds: i64, word: u16, target: i32) -> Option<(u16, i32)> {
        let mut data = [0; 6];
        data[..2].copy_from_slice(&word.to_le_bytes());
        data[2..].copy_from_slice(&target.to_le_bytes());
        self.send(0x200 + u16::from(NODE), &data);
        self.send(0x80, &[]);
        let got = self.take_of(0x180 + u16::from(NODE));
        self.run(milliseconds);
        let data: [u8; 6] = got.first()?.clone().try_into().expect("six bytes");
        let [a, b, position @ ..] = data;
        Some((u16::from_le_bytes([a, b]), i32::from_le_bytes(position)))
    }
}
