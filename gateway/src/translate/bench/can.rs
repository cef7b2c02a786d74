//! The CAN port of the bench: simulated CiA 402 drives, of which it replaces what they say and hears what they are told.
//!
//! The drives underneath are brought up and answer heartbeats and SDOs. They get their PDOs without the controlword, so that no
//! command of a list moves or trips them.

use std::collections::VecDeque;

use arrayvec::ArrayVec;
use profile_cia402::master::config::Direction;
use profile_cia402::wire::Mux;
use profile_generic::can::{Frame, Id};
use profile_generic::time::MonotonicTime;

use super::Peer;
use crate::config::Can;
use crate::engine::port::{CanInput, CanPort, CanSent};
use crate::mapping::{Item, Object};
use crate::simulate::can_bus::InProcessCan;
use crate::translate::stage::{CanDrive, CanPdo};

/// Functions of the default connection set: SDO requests, and their answers.
const SDO_REQUEST: u16 = 0x600;
const SDO_ANSWER: u16 = 0x580;
const FUNCTION: u16 = 0x780;

/// Command specifiers of expedited SDOs: upload request, and the answer to it with `4 - n` bytes.
const UPLOAD: u8 = 0x40;
const UPLOADED: u8 = 0x43;

/// Most bytes of a frame.
const FRAME_MAX: usize = 64;

/// Bytes of the controlword, the first value of the program.
const CONTROL_LEN: usize = 2;

/// A drive, or one axis of it.
#[derive(Debug)]
struct Drive {
    axis: usize,
    node: u8,
    pdos: Vec<CanPdo>,
    /// Its values to the drive as they came last.
    command: Vec<u8>,
    /// What it shows, in the order of its program.
    feedback: Vec<u8>,
}

/// The port.
#[derive(Debug)]
pub(super) struct Tap {
    bus: InProcessCan,
    known: Vec<Drive>,
    /// The drives of the bus: their names and node-ids.
    nodes: Vec<(String, u8)>,
    /// Objects that a node holds in place of its own.
    held: Vec<(u8, Object, Vec<u8>)>,
    /// Answers about these.
    answers: VecDeque<CanInput>,
    pub peers: Vec<Peer>,
}

impl Tap {
    pub fn new(config: &Can, axes: usize) -> Self {
        Self {
            bus: InProcessCan::of(config, None),
            known: Vec::new(),
            nodes: config.drives.iter().map(|drive| (drive.name.clone(), drive.node.get())).collect(),
            held: Vec::new(),
            answers: VecDeque::new(),
            peers: (0..axes).map(|_| Peer::default()).collect(),
        }
    }

    /// The drives are in operation: the PDOs of each axis, and the bytes of its values both ways.
    pub fn learn<'d>(&mut self, drives: impl Iterator<Item = (usize, &'d CanDrive, [usize; 2])>) {
        let drive = |(axis, drive, [command, feedback]): (usize, &CanDrive, [usize; 2])| Drive {
            axis,
            node: drive.node,
            pdos: drive.pdos.clone(),
            command: vec![0; command],
            feedback: vec![0; feedback],
        };
        self.known = drives.map(drive).collect();
    }

    /// The drives are commissioned. From now on their motors do not matter: what the drives send is replaced.
    pub fn pause_drives(&mut self) {
        self.bus.nodes_mut().for_each(|node| node.application_mut().set_paused(true));
    }

    /// The drive of an axis holds this in place of its own value.
    pub fn hold(&mut self, axis: usize, object: Object, bytes: &[u8]) {
        if let Some(node) = self.known.iter().find(|drive| drive.axis == axis).map(|drive| drive.node) {
            self.hold_at(node, object, bytes);
        }
    }

    /// The same before it is known which axis has the drive, until [`Self::release`].
    pub fn commission_with(&mut self, drive: &str, object: Object, bytes: &[u8]) {
        if let Some((_, node)) = self.nodes.iter().find(|(name, _)| name == drive) {
            self.hold_at(*node, object, bytes);
        }
    }

    fn hold_at(&mut self, node: u8, object: Object, bytes: &[u8]) {
        self.held.retain(|(known, of, _)| (*known, *of) != (node, object));
        self.held.push((node, object, bytes.to_vec()));
    }

    /// What the drive of an axis holds; `None` of a drive without the object.
    pub fn kept(&self, axis: usize, object: Object) -> Option<i64> {
        let node = self.known.iter().find(|drive| drive.axis == axis)?.node;
        let device = self.bus.nodes().find(|known| known.node().is_some_and(|id| id.get() == node))?;
        let Object { index, sub } = object;
        device.dictionary().find(Mux { index, sub }).map(|_| device.dictionary().number(index, sub))
    }

    /// Drives hold what they have themselves.
    pub fn release(&mut self) {
        self.held.clear();
    }

    /// The answer of a drive to an SDO request for what it holds in place of its own.
    fn answer(&self, id: u16, data: &[u8]) -> Option<Frame> {
        let [UPLOAD, low, high, sub, ..] = *data else { return None };
        let object = Object { index: u16::from_le_bytes([low, high]), sub };
        let node = id & !FUNCTION;
        let held = self.held.iter().find(|(known, of, _)| *of == object && u16::from(*known) == node);
        let (_, _, bytes) = held.filter(|(.., bytes)| (1..=4).contains(&bytes.len()))?;
        let mut data = [0; 8];
        let unused = u8::try_from(4 - bytes.len()).unwrap_or(0);
        data[..4].copy_from_slice(&[UPLOADED | unused << 2, low, high, sub]);
        data[4..4 + bytes.len()].copy_from_slice(bytes);
        Frame::new(Id::Standard(SDO_ANSWER | node), &data).ok()
    }

    /// Notes a write of up to four bytes.
    fn hear_sdo(&mut self, id: u16, data: &[u8]) {
        let [specifier, low, high, sub, rest @ ..] = data else { return };
        // Initiate download, expedited, size indicated.
        if specifier & 0xE3 != 0x23 {
            return;
        }
        let len = 4 - usize::from(specifier >> 2 & 3);
        let item = Item::Object(Object { index: u16::from_le_bytes([*low, *high]), sub: *sub });
        let node = id & !FUNCTION;
        for drive in self.known.iter().filter(|drive| u16::from(drive.node) == node) {
            let bytes = rest.get(..len).unwrap_or_default().to_vec();
            self.peers[drive.axis].written.push((item, bytes));
        }
    }
}

impl CanPort for Tap {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        if let Some(answer) = self.answers.pop_front() {
            return Some(answer);
        }
        let input = self.bus.receive(now)?;
        let CanInput::Frame(frame) = &input else { return Some(input) };
        let Id::Standard(id) = frame.id() else { return Some(input) };
        let is_tpdo = |pdo: &&CanPdo| pdo.id == id && pdo.direction == Direction::Transmit;
        let mut data: ArrayVec<u8, FRAME_MAX> = frame.data().iter().copied().collect();
        for drive in &mut self.known {
            let Some(pdo) = drive.pdos.iter().find(is_tpdo) else { continue };
            self.peers[drive.axis].show(&mut drive.feedback);
            CanDrive::put(pdo, &drive.feedback, &mut data);
        }
        Frame::new(frame.id(), &data).ok().map(CanInput::Frame).or(Some(input))
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        let Id::Standard(id) = frame.id() else { return self.bus.send(now, frame) };
        if id & FUNCTION == SDO_REQUEST {
            if let Some(answer) = self.answer(id, frame.data()) {
                self.answers.extend([CanInput::Transmitted, CanInput::Frame(answer)]);
                return CanSent::Sent;
            }
            self.hear_sdo(id, frame.data());
        }
        let is_rpdo = |pdo: &&CanPdo| pdo.id == id && pdo.direction == Direction::Receive;
        let mut data: ArrayVec<u8, FRAME_MAX> = frame.data().iter().copied().collect();
        for drive in &mut self.known {
            let Some(pdo) = drive.pdos.iter().find(is_rpdo) else { continue };
            CanDrive::gather(pdo, frame.data(), &mut drive.command);
            self.peers[drive.axis].hear(now, &drive.command);
            let mut asks_nothing = drive.command.clone();
            asks_nothing.iter_mut().take(CONTROL_LEN).for_each(|byte| *byte = 0);
            CanDrive::put(pdo, &asks_nothing, &mut data);
        }
        match Frame::new(frame.id(), &data) {
            Ok(quiet) => self.bus.send(now, &quiet),
            Err(_) => self.bus.send(now, frame),
        }
    }
}
