//! A line of small slaves for the master's tests. They are scripted: each fault is a switch. The full slave role,
//! with its own state machines, meets the master in other tests.

use std::collections::BTreeMap;

use profile_generic::time::MonotonicTime;

use crate::checker::bus::{Arrived, Stations, Watch};
use crate::port::Port;
use crate::wire::cp12;
use crate::wire::header::{HEADER_LEN, Header, Kind, Phase};
use crate::wire::idn::Idn;
use crate::wire::layout::Offset;
use crate::wire::svc::{AtSvc, Element, MdtSvc, SvcStatus};

/// One service channel step as the slave saw it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SeenStep {
    pub phase: Phase,
    pub idn: Idn,
    pub element: Element,
    pub write: bool,
    pub last: bool,
    pub info: u32,
}

#[derive(Debug, Clone)]
pub struct Parameter {
    pub bytes: Vec<u8>,
    pub list: bool,
    pub minimum: u32,
}

/// What a slave does wrong.
#[derive(Debug, Clone, Default)]
pub struct Faults {
    /// It is not there any more: nothing is read or written, telegrams pass.
    pub gone: bool,
    /// It keeps inserting data when the phase is switched.
    pub stubborn: bool,
    /// S-0-0127 or S-0-0128 fail with this list.
    pub invalid: Option<(Idn, Vec<Idn>)>,
    /// Busy for ever once this data block is opened.
    pub busy_at: Option<Idn>,
    /// Operation data of this data block is refused with a code.
    pub error_at: Option<(Idn, u16)>,
    /// It never toggles its handshake bit.
    pub deaf: bool,
    /// Cycles for which procedure commands stay in process.
    pub command_cycles: u32,
}

pub struct Peer {
    pub address: u16,
    pub parameters: BTreeMap<Idn, Parameter>,
    pub faults: Faults,
    pub steps: Vec<SeenStep>,
    pub mdt_seen: Vec<u8>,
    phase: Phase,
    switching: bool,
    status: SvcStatus,
    info: u32,
    open: Option<Idn>,
    position: usize,
    commands: BTreeMap<Idn, u16>,
    busy_polls: u32,
    cycle: u16,
    dialogue: bool,
    /// S-0-0127 was executed in this CP2; without it the slave ignores CP3.
    checked: bool,
    /// Values it produces: C-CON counts with every AT while this is set.
    pub producing: bool,
}

fn word(value: u16) -> Parameter {
    Parameter { bytes: value.to_le_bytes().to_vec(), list: false, minimum: 0 }
}

fn double(value: u32) -> Parameter {
    Parameter { bytes: value.to_le_bytes().to_vec(), list: false, minimum: 0 }
}

fn list(words: &[u16]) -> Parameter {
    Parameter { bytes: words.iter().flat_map(|w| w.to_le_bytes()).collect(), list: true, minimum: 0 }
}

impl Peer {
    /// A slave with the classes and parameters of the recording's slaves.
    pub fn new(address: u16) -> Peer {
        let mut parameters = BTreeMap::new();
        for (idn, parameter) in [
            (Idn::FSP_TYPE, word(2)),
            (Idn::SCP_CLASSES, list(&[0x0201, 0x0301, 0x0A01])),
            (Idn::SCP_ACTIVE, list(&[])),
            (Idn::INTER_FRAME_GAP, word(37)),
            (Idn::CONNECTION_IMAGE, list(&[0, 0])),
            (Idn::FEEDBACK_TIME, double(0)),
            (Idn::AT_START, double(0)),
            (Idn::CYCLE_TIME, double(0)),
            (Idn::CONTROL_OFFSET, word(0)),
            (Idn::MDT_LENGTHS, list(&[0; 4])),
            (Idn::STATUS_OFFSET, word(0)),
            (Idn::AT_LENGTHS, list(&[0; 4])),
            (Idn::SVC_MDT_OFFSET, word(0)),
            (Idn::SVC_AT_OFFSET, word(0)),
            (Idn::MST_LOSSES, word(0)),
            (Idn::SYNC_TIME, double(0)),
            (Idn::COMMAND_VALID, double(0)),
            (Idn::RING_DELAY, double(0)),
            (Idn::SYNC_JITTER, double(0)),
            (Idn::UC_TIMES, list(&[0; 4])),
            (Idn::MTU_REQUESTED, word(0)),
            (Idn::MTU_EFFECTIVE, word(1500)),
            (Idn::INVALID_CP2, list(&[])),
            (Idn::INVALID_CP3, list(&[])),
            (Idn::CP3_CHECK, word(0)),
            (Idn::CP4_CHECK, word(0)),
            (Idn::DELAY_MEASURING, word(0)),
            (Idn::RESET_C1D, word(0)),
            (Idn::standard(32), word(0)),
        ] {
            parameters.insert(idn, parameter);
        }
        for connection in 0..2 {
            for element in [1, 2, 3, 5, 11] {
                parameters.insert(Idn::connection(connection, element), word(0));
            }
            parameters.insert(Idn::connection(connection, 6), list(&[]));
            parameters.insert(Idn::connection(connection, 10), double(0));
        }
        Peer {
            address,
            parameters,
            faults: Faults::default(),
            steps: Vec::new(),
            mdt_seen: Vec::new(),
            phase: Phase::CP0,
            switching: false,
            status: SvcStatus::empty(),
            info: 0,
            open: None,
            position: 0,
            commands: BTreeMap::new(),
            busy_polls: 0,
            cycle: 0,
            dialogue: false,
            checked: false,
            producing: true,
        }
    }

    pub fn value(&self, idn: Idn) -> u64 {
        let mut wide = [0; 8];
        let bytes = &self.parameters[&idn].bytes;
        wide[..bytes.len().min(8)].copy_from_slice(&bytes[..bytes.len().min(8)]);
        u64::from_le_bytes(wide)
    }

    fn value16(&self, idn: Idn) -> u16 {
        u16::try_from(self.value(idn)).unwrap()
    }

    /// The low word of C-SVC's data status for the open data block.
    fn data_status(&self, idn: Idn) -> u32 {
        u32::from(self.commands.get(&idn).copied().unwrap_or(0))
    }

    fn mst(&mut self, header: &Header) {
        self.switching = header.phase.switching();
        if !self.switching {
            if self.phase != header.phase.phase() {
                self.checked &= header.phase.phase() > Phase::CP2;
                self.status = SvcStatus::empty();
                if header.phase.phase() >= Phase::CP2 {
                    self.status = SvcStatus::VALID;
                    self.status.set(SvcStatus::AHS, self.dialogue);
                }
            }
            self.phase = header.phase.phase();
        }
        self.cycle += 1;
    }

    /// Takes the service channel of one MDT.
    fn request(&mut self, bytes: &[u8]) {
        let mdt = MdtSvc::parse(bytes).unwrap();
        if self.phase == Phase::CP1 {
            self.status = SvcStatus::VALID;
            self.status.set(SvcStatus::AHS, mdt.control.mhs());
            self.dialogue = mdt.control.mhs();
            return;
        }
        let toggled = mdt.control.mhs() != self.status.contains(SvcStatus::AHS);
        if self.phase < Phase::CP2 || self.switching || !toggled || self.faults.deaf {
            return;
        }
        self.status = SvcStatus::VALID;
        self.status.set(SvcStatus::AHS, mdt.control.mhs());
        self.dialogue = mdt.control.mhs();
        let (element, write, last) = (mdt.control.element(), mdt.control.write(), mdt.control.last());
        if element == Element::Idn {
            self.open = Some(Idn(mdt.info));
            self.position = 0;
        }
        let idn = self.open.unwrap_or_default();
        if element == Element::Close {
            self.open = None;
            self.info = 0;
        }
        self.steps.push(SeenStep { phase: self.phase, idn, element, write, last, info: mdt.info });
        if element == Element::Close {
            return;
        }
        if self.faults.busy_at == Some(idn) {
            self.status |= SvcStatus::BUSY;
        }
        match self.element(idn, element, write, mdt.info) {
            Ok(info) => self.info = info,
            Err(code) => {
                self.status |= SvcStatus::ERROR;
                self.info = u32::from(code);
            }
        }
    }

    fn element(&mut self, idn: Idn, element: Element, write: bool, info: u32) -> Result<u32, u16> {
        let Some(parameter) = self.parameters.get_mut(&idn) else {
            return Err(0x1001);
        };
        match (element, write) {
            (Element::Idn, true) => {
                if self.busy_polls > 0 {
                    self.busy_polls -= 1;
                    if self.busy_polls == 0 && self.commands.get(&idn) == Some(&7) {
                        self.commands.insert(idn, 3);
                    }
                }
                Ok(self.data_status(idn))
            }
            (Element::Attribute, false) => {
                let length = match (parameter.list, parameter.bytes.len()) {
                    (true, _) => 5,
                    (false, 4) => 2,
                    _ => 1,
                };
                Ok(length << 16 | 1)
            }
            (Element::Minimum, false) => Ok(parameter.minimum),
            (Element::Data, _) if self.faults.error_at.is_some_and(|(at, _)| at == idn) => {
                Err(self.faults.error_at.unwrap().1)
            }
            (Element::Data, true) if COMMANDS.contains(&idn) => {
                let mut status = u16::try_from(info & 3).unwrap();
                if status == 3 {
                    if let Some((check, invalid)) = &self.faults.invalid
                        && *check == idn
                    {
                        status = 0xF;
                        let bytes = invalid.iter().flat_map(|idn| idn.0.to_le_bytes()).collect();
                        let list = if idn == Idn::CP3_CHECK { Idn::INVALID_CP2 } else { Idn::INVALID_CP3 };
                        self.parameters.get_mut(&list).unwrap().bytes = bytes;
                    } else if self.faults.command_cycles > 0 {
                        self.busy_polls = self.faults.command_cycles;
                        status = 7;
                    }
                }
                self.checked |= idn == Idn::CP3_CHECK && matches!(status, 3 | 7);
                self.commands.insert(idn, status);
                Ok(0)
            }
            (Element::Data, false) if parameter.list => {
                let len = u16::try_from(parameter.bytes.len()).unwrap();
                let head = u32::from(len) | 64 << 16;
                let info = if self.position == 0 { head } else { part(&parameter.bytes, self.position - 4) };
                self.position += 4;
                Ok(info)
            }
            (Element::Data, true) if parameter.list => {
                if self.position == 0 {
                    parameter.bytes = vec![0; usize::try_from(info & 0xFFFF).unwrap()];
                } else {
                    let at = self.position - 4;
                    let len = parameter.bytes.len().saturating_sub(at).min(4);
                    parameter.bytes[at..at + len].copy_from_slice(&info.to_le_bytes()[..len]);
                }
                self.position += 4;
                if idn.block() == 1050 && idn.element() == 6 {
                    self.update_length(idn);
                }
                Ok(0)
            }
            (Element::Data, false) => Ok(part(&parameter.bytes, 0)),
            (Element::Data, true) => {
                let len = parameter.bytes.len();
                parameter.bytes.copy_from_slice(&info.to_le_bytes()[..len]);
                Ok(0)
            }
            _ => Err(0x4001),
        }
    }

    /// S-0-1050.x.5 follows from the list: control and status word two bytes, all else four.
    fn update_length(&mut self, list: Idn) {
        let bytes = self.parameters[&list].bytes.clone();
        let length = bytes.chunks_exact(4).map(|idn| match u32::from_le_bytes(idn.try_into().unwrap()) {
            134 | 135 => 2,
            _ => 4,
        });
        let total: u16 = length.sum::<u16>() + 2;
        self.parameters.insert(list.with_structure(list.instance(), 5), word(total));
    }

    fn place(&self, kind: Kind, topology: u16) -> ((u8, usize), (u8, usize)) {
        if self.phase < Phase::CP3 {
            let place = cp12::place(topology).unwrap();
            return ((place.telegram, place.svc), (place.telegram, place.device));
        }
        let (svc, device) = match kind {
            Kind::Mdt => (Idn::SVC_MDT_OFFSET, Idn::CONTROL_OFFSET),
            Kind::At => (Idn::SVC_AT_OFFSET, Idn::STATUS_OFFSET),
        };
        let pair = |idn| {
            let offset = Offset::from_parameter(self.value16(idn));
            (offset.telegram, usize::from(offset.offset))
        };
        (pair(svc), pair(device))
    }

    fn telegram(&mut self, header: &Header, data: &mut [u8], topology: u16) {
        if self.phase > Phase::CP2 && !self.checked {
            return;
        }
        let (kind, number) = (header.telegram.kind(), header.telegram.number());
        let (svc, device) = self.place(kind, topology);
        let inserting = !self.switching || self.faults.stubborn;
        match kind {
            Kind::Mdt => {
                if svc.0 == number {
                    self.request(&data[svc.1..svc.1 + 6]);
                }
                if self.phase == Phase::CP4 && number == 0 {
                    self.mdt_seen = data.to_vec();
                }
            }
            Kind::At => {
                if svc.0 == number && (inserting || self.phase > Phase::CP1) {
                    AtSvc { status: self.status, info: self.info }.emit(&mut data[svc.1..svc.1 + 6]).unwrap();
                }
                if device.0 == number && inserting {
                    data[device.1..device.1 + 2].copy_from_slice(&0x0100u16.to_le_bytes());
                }
                if self.phase == Phase::CP4 && inserting && self.producing {
                    self.produce(number, data);
                }
            }
        }
    }

    fn produce(&self, number: u8, data: &mut [u8]) {
        for connection in 0..2 {
            if self.value(Idn::connection(connection, 1)) & 0xC000 != 0xC000 {
                continue;
            }
            let (_, at) = Offset::from_assignment(self.value16(Idn::connection(connection, 3)));
            let len = usize::try_from(self.value(Idn::connection(connection, 5))).unwrap();
            if at.telegram == number {
                let bytes = &mut data[at.range(len)];
                let control = (self.cycle & 0xF) << 12 | (self.cycle & 1) << 1 | 1;
                bytes[..2].copy_from_slice(&control.to_le_bytes());
                bytes[2..].fill(u8::try_from(self.address & 0xFF).unwrap());
            }
        }
    }
}

fn part(bytes: &[u8], at: usize) -> u32 {
    let mut info = [0; 4];
    for (to, from) in info.iter_mut().zip(bytes.get(at..).unwrap_or_default()) {
        *to = *from;
    }
    u32::from_le_bytes(info)
}

/// The procedure commands.
const COMMANDS: [Idn; 4] = [Idn::CP3_CHECK, Idn::CP4_CHECK, Idn::DELAY_MEASURING, Idn::RESET_C1D];

/// Slaves in a line.
pub struct Line {
    pub peers: Vec<Peer>,
}

impl Line {
    pub fn new(addresses: &[u16]) -> Line {
        Line { peers: addresses.iter().map(|&address| Peer::new(address)).collect() }
    }
}

impl Stations for Line {
    fn handle_time(&mut self, _: MonotonicTime) {}

    fn pass(
        &mut self,
        _: MonotonicTime,
        port: Port,
        frame: &mut [u8],
        watch: &mut Watch<'_>,
        arrived: &mut Arrived<'_>,
    ) {
        self.change(frame, watch);
        arrived(port, frame);
    }
}

impl Line {
    fn change(&mut self, frame: &mut [u8], watch: &mut Watch<'_>) {
        let header = Header::parse(frame).expect("the master sends good headers");
        for peer in self.peers.iter_mut().filter(|peer| !peer.faults.gone) {
            if header.telegram.is_mst() {
                peer.mst(&header);
            }
        }
        if self.peers.first().is_some_and(|peer| peer.phase == Phase::CP0) {
            if header.telegram.kind() == Kind::At {
                self.scan(&header, frame, watch);
            }
            return;
        }
        for (topology, peer) in (1u16..).zip(&mut self.peers).filter(|(_, peer)| !peer.faults.gone) {
            let before = frame.to_vec();
            peer.telegram(&header, &mut frame[HEADER_LEN..], topology);
            watch(topology, true, &before, frame);
        }
    }

    fn scan(&mut self, header: &Header, frame: &mut [u8], watch: &mut Watch<'_>) {
        let peers = self.peers.iter().filter(|peer| !peer.faults.gone);
        let count = peers.clone().count();
        for (topology, peer) in (1u16..).zip(peers) {
            let before = frame.to_vec();
            if header.phase.switching() {
                watch(topology, true, &before, frame);
                continue;
            }
            let data = &mut frame[HEADER_LEN..];
            data[2 * usize::from(topology)..][..2].copy_from_slice(&peer.address.to_le_bytes());
            data[..2].copy_from_slice(&(topology + 1).to_le_bytes());
            watch(topology, true, &before, frame);
        }
        for topology in (1..count).rev() {
            if header.phase.switching() {
                continue;
            }
            let before = frame.to_vec();
            let counter = u16::from_le_bytes([frame[HEADER_LEN], frame[HEADER_LEN + 1]]) + 1;
            frame[HEADER_LEN..][..2].copy_from_slice(&counter.to_le_bytes());
            watch(u16::try_from(topology).unwrap(), false, &before, frame);
        }
    }
}
