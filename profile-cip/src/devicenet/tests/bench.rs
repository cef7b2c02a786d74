//! A slave driven by hand: frames in, frames out, to the byte.

use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::rig::{mac, ms, slave_config, speed_drive};
use crate::devicenet::link::Refusal;
use crate::devicenet::slave::application::Application;
use crate::devicenet::slave::event::SlaveEvent;
use crate::devicenet::slave::speed_drive::SpeedDrive;
use crate::devicenet::slave::{Slave, SlaveConfig};
use crate::devicenet::wire::Identifier;

pub struct Bench<A> {
    pub slave: Slave<A>,
    pub now: MonotonicTime,
}

/// Identifier and data.
pub type Sent = (u16, Vec<u8>);

impl Bench<SpeedDrive> {
    /// A velocity drive with assembly 21 and MAC ID 9, on line.
    pub fn new() -> Self {
        Self::with(slave_config(9), speed_drive(21))
    }

    /// The same, allocated by MAC ID 10 with explicit and poll connection.
    pub fn allocated() -> Self {
        let mut bench = Self::new();
        assert_eq!(bench.send(0x44E, &[0x0A, 0x4B, 3, 1, 3, 0x0A]), [(0x44B, vec![0x0A, 0xCB, 0])]);
        bench
    }

    /// The same with the poll connection established at 50 ms.
    pub fn established() -> Self {
        let mut bench = Self::allocated();
        assert_eq!(bench.explicit(&[0x10, 5, 2, 9, 50, 0]), [0x90, 50, 0]);
        bench
    }
}

impl<A: Application> Bench<A> {
    pub fn with(config: SlaveConfig, application: A) -> Self {
        let mut bench = Self { slave: Slave::new(config, application), now: ms(0) };
        bench.slave.start(bench.now);
        bench.wait(2100);
        while bench.slave.poll_event().is_some() {}
        bench
    }

    fn drain(&mut self) -> Vec<Sent> {
        let mut all = Vec::new();
        while let Some(frame) = self.slave.poll(self.now) {
            let Id::Standard(bits) = frame.id() else { panic!("{frame}") };
            all.push((bits, frame.data().to_vec()));
        }
        all
    }

    /// Lets time pass by milliseconds; what was sent meanwhile.
    pub fn wait(&mut self, millis: u32) -> Vec<Sent> {
        let mut all = self.drain();
        for _ in 0..millis {
            self.now = self.now + DurationNs::from_millis(1);
            all.extend(self.drain());
        }
        all
    }

    pub fn try_send(&mut self, bits: u16, data: &[u8]) -> (Result<(), Refusal>, Vec<Sent>) {
        let frame = Frame::new(Id::Standard(bits), data).unwrap();
        let outcome = self.slave.handle_frame(self.now, &frame);
        (outcome, self.drain())
    }

    /// Sends a frame that is taken; what is sent for it.
    pub fn send(&mut self, bits: u16, data: &[u8]) -> Vec<Sent> {
        let (outcome, sent) = self.try_send(bits, data);
        assert_eq!(outcome, Ok(()), "{bits:03X} {data:02x?}");
        sent
    }

    /// A frame that is not used; why.
    pub fn refused(&mut self, bits: u16, data: &[u8]) -> String {
        let (outcome, sent) = self.try_send(bits, data);
        assert_eq!(sent, [], "{bits:03X} {data:02x?}");
        outcome.unwrap_err().to_string()
    }

    /// An unfragmented request of MAC ID 10 on the explicit connection; the body of its response.
    pub fn explicit(&mut self, body: &[u8]) -> Vec<u8> {
        let request = [&[0x0A], body].concat();
        let sent = self.send(Identifier::ExplicitRequest(mac(9)).bits(), &request);
        let [(0x44B, response)] = &sent[..] else { panic!("{sent:02x?}") };
        assert_eq!(response[0], 0x0A);
        response[1..].to_vec()
    }

    /// The same for a response in fragments.
    pub fn explicit_long(&mut self, body: &[u8]) -> Vec<u8> {
        let mut sent = self.send(0x44C, &[&[0x0A], body].concat());
        let mut all = Vec::new();
        loop {
            let [(0x44B, frame)] = &sent[..] else { panic!("{sent:02x?}") };
            assert_eq!(frame[0], 0x8A, "a fragment");
            all.extend(&frame[2..]);
            let last = frame[1] >> 6 == 2;
            let count = frame[1] & 0x3F;
            sent = self.send(0x44C, &[0x8A, 0xC0 | count, 0]);
            if last {
                assert_eq!(sent, []);
                return all;
            }
        }
    }

    pub fn events(&mut self) -> Vec<SlaveEvent> {
        core::iter::from_fn(|| self.slave.poll_event()).collect()
    }
}
