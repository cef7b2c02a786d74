//! The drive as a master sees it: frames written by hand.

mod basics;
mod oddities;
mod pdos;
mod power;
mod presets;

use super::{CanDrive, Settings};
use crate::can::{Frame, Station};

/// A drive, a clock and what was said.
pub struct Rig {
    pub drive: CanDrive,
    pub now: u64,
    pub said: Vec<Frame>,
}

impl Rig {
    /// A drive that has started, ten milliseconds ago.
    pub fn new(settings: Settings) -> Self {
        let mut rig = Self { drive: CanDrive::new(settings), now: 1_000, said: Vec::new() };
        rig.drive.tick(1_000, &mut rig.said);
        rig.run(10);
        rig
    }

    pub fn plain() -> Self {
        Self::new(Settings::default())
    }

    /// Lets milliseconds pass.
    pub fn run(&mut self, ms: u64) {
        for _ in 0..ms {
            self.now += 1000;
            self.drive.tick(self.now, &mut self.said);
        }
    }

    /// Sends a frame; what the drive says at once.
    pub fn send(&mut self, id: u16, data: &[u8]) -> Vec<Frame> {
        let mut out = Vec::new();
        self.drive.hear(self.now, &Frame::new(id, data), &mut out);
        out
    }

    pub fn request(&mut self, id: u16) -> Vec<Frame> {
        let mut out = Vec::new();
        self.drive.hear(self.now, &Frame { id, remote: true, data: Vec::new() }, &mut out);
        out
    }

    /// An SDO request and the answer to it.
    pub fn sdo(&mut self, data: [u8; 8]) -> Vec<u8> {
        let out = self.send(0x605, &data);
        let answers: Vec<_> = out.into_iter().filter(|frame| frame.id == 0x585).collect();
        assert_eq!(answers.len(), 1, "{answers:?}");
        answers[0].data.clone()
    }

    /// An expedited download: 0, or the abort code.
    pub fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> u32 {
        let [low, high] = index.to_le_bytes();
        let command = match value.len() {
            1 => 0x2F,
            2 => 0x2B,
            3 => 0x27,
            _ => 0x23,
        };
        let mut data = [command, low, high, sub, 0, 0, 0, 0];
        data[4..4 + value.len()].copy_from_slice(value);
        let answer = self.sdo(data);
        assert_eq!(answer[1..4], [low, high, sub]);
        if answer[0] == 0x60 {
            return 0;
        }
        assert_eq!(answer[0], 0x80);
        u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]])
    }

    /// An expedited upload: the bytes, or the abort code.
    pub fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        let [low, high] = index.to_le_bytes();
        let answer = self.sdo([0x40, low, high, sub, 0, 0, 0, 0]);
        assert_eq!(answer[1..4], [low, high, sub]);
        match answer[0] {
            0x4F => Ok(answer[4..5].to_vec()),
            0x4B => Ok(answer[4..6].to_vec()),
            0x47 => Ok(answer[4..7].to_vec()),
            0x43 => Ok(answer[4..8].to_vec()),
            0x80 => Err(u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]])),
            other => panic!("{other:02X}"),
        }
    }

    pub fn status(&mut self) -> u16 {
        let data = self.read(0x6041, 0).unwrap();
        u16::from_le_bytes([data[0], data[1]])
    }

    pub fn long(&mut self, index: u16) -> i32 {
        let data = self.read(index, 0).unwrap();
        i32::from_le_bytes([data[0], data[1], data[2], data[3]])
    }

    pub fn word(&mut self, word: u16) {
        assert_eq!(self.write(0x6040, 0, &word.to_le_bytes()), 0);
    }

    /// Enables the drive in a mode by SDO.
    pub fn enable(&mut self, mode: u8) {
        assert_eq!(self.write(0x6060, 0, &[mode]), 0);
        for word in [0x06, 0x07, 0x0F] {
            self.word(word);
            self.run(2);
        }
        assert!(self.drive.enabled());
    }

    /// The data of all frames with this identifier said while time passed.
    pub fn heard(&mut self, id: u16) -> Vec<Vec<u8>> {
        self.said.drain(..).filter(|frame| frame.id == id).map(|frame| frame.data).collect()
    }
}
