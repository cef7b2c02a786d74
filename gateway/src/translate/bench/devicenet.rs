//! The CAN port of the bench on a DeviceNet: simulated drives, of which it replaces what they answer and hears how they are polled.
//!
//! The drives underneath are taken and set up, and answer each poll with its Update ID. They get their polls without what would
//! switch them on, so that no command of a list moves or trips them.

use profile_cip::devicenet::fragmentation::{IO_FRAGMENT_MAX, IO_UNFRAGMENTED_MAX, IoReceiver};
use profile_cip::devicenet::wire::{Identifier, MacId};
use profile_generic::can::{Frame, Id};
use profile_generic::time::MonotonicTime;

use super::Peer;
use crate::config::Devicenet;
use crate::engine::port::{CanInput, CanPort, CanSent};
use crate::simulate::can_bus::InProcessCan;
use crate::simulate::devicenet_drive::DevicenetNode;

/// Bits of the count in the octet in front of a fragment.
const FRAGMENT_COUNT: u8 = 0x3F;

/// Place of the Update ID in an answer, which is that of the poll whatever the drive is to show.
const UPDATE_ID_AT: usize = 2;
/// Place of Axis Control in an update.
const AXIS_CONTROL_AT: usize = 6;

/// A drive.
#[derive(Debug)]
struct Drive {
    axis: usize,
    mac: MacId,
    is_motion: bool,
    /// Bytes of its polls and of its answers.
    lengths: (usize, usize),
    poll: IoReceiver,
    answer: Vec<u8>,
}

/// The port.
#[derive(Debug)]
pub(super) struct Tap {
    bus: InProcessCan<DevicenetNode>,
    known: Vec<Drive>,
    pub peers: Vec<Peer>,
}

impl Tap {
    pub fn new(config: &Devicenet, axes: usize) -> Self {
        Self {
            bus: InProcessCan::of_devicenet(config, None),
            known: Vec::new(),
            peers: (0..axes).map(|_| Peer::default()).collect(),
        }
    }

    /// The drives are set up: of each axis its MAC ID, whether it is a CIP Motion drive, and the bytes of its messages.
    pub fn learn(&mut self, drives: impl Iterator<Item = (usize, MacId, bool, (usize, usize))>) {
        let drive = |(axis, mac, is_motion, lengths): (usize, MacId, bool, (usize, usize))| Drive {
            axis,
            mac,
            is_motion,
            lengths,
            poll: IoReceiver::default(),
            answer: vec![0; lengths.1],
        };
        self.known = drives.map(drive).collect();
    }
}

/// The octets of a message that a frame of it carries: where they begin there, and in the frame.
fn place(len: usize, data: &[u8]) -> (usize, usize) {
    match data.first() {
        Some(fragment) if len > IO_UNFRAGMENTED_MAX => {
            (IO_FRAGMENT_MAX * usize::from(fragment & FRAGMENT_COUNT), 1)
        }
        _ => (0, 0),
    }
}

impl CanPort for Tap {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        let input = self.bus.receive(now)?;
        let CanInput::Frame(frame) = &input else { return Some(input) };
        let Id::Standard(id) = frame.id() else { return Some(input) };
        let Ok(Identifier::PollResponse(mac)) = Identifier::parse(id) else { return Some(input) };
        let Some(drive) = self.known.iter_mut().find(|drive| drive.mac == mac) else { return Some(input) };
        let mut data = frame.data().to_vec();
        let (from, head) = place(drive.lengths.1, &data);
        self.peers[drive.axis].show(&mut drive.answer);
        for (at, octet) in data.iter_mut().skip(head).enumerate() {
            let at = from + at;
            if drive.is_motion && at == UPDATE_ID_AT {
                continue;
            }
            if let Some(shown) = drive.answer.get(at) {
                *octet = *shown;
            }
        }
        Frame::new(frame.id(), &data).ok().map(CanInput::Frame).or(Some(input))
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        let Id::Standard(id) = frame.id() else { return self.bus.send(now, frame) };
        let Ok(Identifier::PollCommand(mac)) = Identifier::parse(id) else {
            return self.bus.send(now, frame);
        };
        let Some(drive) = self.known.iter_mut().find(|drive| drive.mac == mac) else {
            return self.bus.send(now, frame);
        };
        if drive.poll.handle(drive.lengths.0, frame.data()) == Ok(true) {
            self.peers[drive.axis].hear(now, drive.poll.data());
        }
        let mut data = frame.data().to_vec();
        let (from, head) = place(drive.lengths.0, &data);
        let switch = if drive.is_motion { AXIS_CONTROL_AT } else { 0 };
        if let Some(octet) = switch.checked_sub(from).and_then(|at| data.get_mut(at + head)) {
            *octet = 0;
        }
        match Frame::new(frame.id(), &data) {
            Ok(quiet) => self.bus.send(now, &quiet),
            Err(_) => self.bus.send(now, frame),
        }
    }
}
