//! Frames by hand.

mod link;
mod motion;
mod odd;
mod speed;

use super::*;

/// The MAC ID of the master in the tests.
const MASTER: u8 = 1;

/// A slave with MAC ID 5 and the clock of its bus.
struct Bus {
    slave: DevicenetSlave,
    now_us: u64,
}

impl Bus {
    /// A slave that is on line.
    fn new(settings: Settings) -> Self {
        let mut bus = Self { slave: DevicenetSlave::new(settings), now_us: 0 };
        bus.wait(2_001);
        assert!(bus.slave.on_line());
        bus
    }

    /// Milliseconds go by; what is said in them.
    fn wait(&mut self, ms: u32) -> Vec<Frame> {
        let mut out = Vec::new();
        for _ in 0..ms {
            self.now_us += 1000;
            self.slave.tick(self.now_us, &mut out);
        }
        out
    }

    /// Says a frame; what is said at once.
    fn say(&mut self, id: u16, data: &[u8]) -> Vec<Frame> {
        let mut out = Vec::new();
        self.now_us += 100;
        self.slave.hear(self.now_us, &Frame::new(id, data), &mut out);
        out
    }

    /// Says a frame and wants one frame.
    fn one(&mut self, id: u16, data: &[u8]) -> Frame {
        let mut out = self.say(id, data);
        assert_eq!(out.len(), 1, "{out:?}");
        out.remove(0)
    }

    /// An explicit request without fragments; the data of the one frame of its answer, without the header.
    fn ask(&mut self, body: &[u8]) -> Vec<u8> {
        let frame = self.one(0x42C, &[&[MASTER], body].concat());
        assert_eq!(frame.id, 0x42B);
        assert_eq!(frame.data[0], MASTER);
        frame.data[1..].to_vec()
    }

    /// An explicit request of any length and its answer of any length.
    fn ask_long(&mut self, body: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        if body.len() <= 7 {
            out = self.say(0x42C, &[&[MASTER], body].concat());
        } else {
            let last = body.len().div_ceil(6) - 1;
            for (at, part) in body.chunks(6).enumerate() {
                let kind = if at == 0 {
                    0x00
                } else if at == last {
                    0x80
                } else {
                    0x40
                };
                let count = u8::try_from(at).unwrap();
                out = self.say(0x42C, &[&[0x80 | MASTER, kind | count], part].concat());
                let acknowledge = out.remove(0);
                assert_eq!(acknowledge.data, [0x80 | MASTER, 0xC0 | count, 0]);
            }
        }
        let mut answer = Vec::new();
        loop {
            assert_eq!(out.len(), 1, "{out:?}");
            let frame = out.remove(0);
            assert_eq!(frame.id, 0x42B);
            if frame.data[0] & 0x80 == 0 {
                return frame.data[1..].to_vec();
            }
            answer.extend_from_slice(&frame.data[2..]);
            let protocol = frame.data[1];
            out = self.say(0x42C, &[0x80 | MASTER, 0xC0 | (protocol & 0x3F), 0]);
            if protocol & 0xC0 == 0x80 {
                assert_eq!(out, []);
                return answer;
            }
        }
    }

    /// Allocates explicit and poll, sets the packet rate of the poll connection.
    fn connect(&mut self, rate: u8) {
        assert_eq!(self.one(0x42E, &[MASTER, 0x4B, 3, 1, 0x03, MASTER]).data, [MASTER, 0xCB, 0]);
        assert_eq!(self.ask(&[0x10, 5, 2, 9, rate, 0]), [0x90, rate, 0]);
    }

    /// A poll of at most eight bytes; the answer.
    fn poll(&mut self, data: &[u8]) -> Vec<u8> {
        let frame = self.one(0x42D, data);
        assert_eq!(frame.id, 0x3C5);
        frame.data
    }
}
