//! A device for the tests of the master: NMT, SDO, PDOs on SYNC, heartbeat. What it does wrong is set by the test.

use std::collections::VecDeque;

use super::*;
use crate::sdo::server::{ObjectAccess, Server, ServerConfig};
use crate::wire::error_control::Heartbeat;
use crate::wire::nmt::Nmt;
use crate::wire::{cob_id, frame};

/// Its object dictionary.
pub struct Objects {
    pub values: BTreeMap<Mux, Vec<u8>>,
    /// Objects that refuse to be written.
    pub refuse: BTreeMap<Mux, AbortCode>,
    /// Values that an object takes, where it does not take all.
    pub takes: BTreeMap<Mux, Vec<u64>>,
    /// Whether mappings cannot be changed.
    pub fixed_mapping: bool,
    /// What a reset of the communication gives to parameters of PDOs instead.
    pub fixed: Vec<(Mux, u32)>,
    pub writes: Vec<(Mux, u64)>,
    /// Its flash, if it has one.
    pub flash: Option<Flash>,
    /// Accesses so far, and which one of them goes wrong.
    pub accesses: usize,
    pub wrong: Option<(usize, Wrong)>,
}

/// A program that can be written: 1F50 to 1F57. Its identification is its first four bytes.
#[derive(Debug, Clone)]
pub struct Flash {
    pub image: Vec<u8>,
    pub runs: bool,
    /// Starts anew when it is stopped and when it is started, and does not answer that.
    pub has_loader: bool,
    /// Reads of 1F57 until it is written.
    pub busy: u32,
    /// Status in 1F57, bits 1 to 7.
    pub status: u32,
    /// What is written is not what runs then.
    pub spoils: bool,
    /// What was written to 1F51.
    pub controls: Vec<u8>,
    restart: bool,
}

impl Flash {
    pub fn new(image: &[u8]) -> Self {
        Self {
            image: image.to_vec(),
            runs: true,
            has_loader: false,
            busy: 0,
            status: 0,
            spoils: false,
            controls: vec![],
            restart: false,
        }
    }

    fn read(&mut self, object: Mux) -> Option<Vec<u8>> {
        Some(match object.index {
            0x1F51 => vec![u8::from(self.runs)],
            0x1F56 => self.image.iter().copied().chain([0; 4]).take(4).collect(),
            0x1F57 => {
                let busy = self.busy.min(1);
                self.busy -= busy;
                (busy | self.status << 1).to_le_bytes().to_vec()
            }
            _ => return None,
        })
    }

    fn write(&mut self, object: Mux, data: &[u8]) -> Result<(), AbortCode> {
        match (object.index, data) {
            (0x1F51, [0 | 1]) => {
                self.runs = data == [1];
                self.restart = self.has_loader;
                if self.runs && self.spoils {
                    self.image = vec![0xBA, 0xD0];
                }
            }
            (0x1F51, [3]) if self.runs => return Err(AbortCode::DEVICE_STATE),
            (0x1F51, [3]) => self.image.clear(),
            (0x1F50, _) if self.runs || !self.image.is_empty() => return Err(AbortCode::DEVICE_STATE),
            (0x1F50, _) => self.image = data.to_vec(),
            _ => return Err(AbortCode::VALUE),
        }
        if object.index == 0x1F51 {
            self.controls.extend(data);
        }
        Ok(())
    }
}

/// What a device does instead of answering.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrong {
    /// It ends the transfer.
    Abort,
    /// It says nothing.
    Silence,
    /// It answers with a command that there is not.
    Nonsense,
    /// It answers to something else.
    Stranger,
    /// It starts anew.
    Reboot,
}

impl Objects {
    fn new(node: NodeId) -> Self {
        let mut objects = Self {
            values: BTreeMap::new(),
            refuse: BTreeMap::new(),
            takes: BTreeMap::new(),
            fixed_mapping: false,
            fixed: vec![],
            writes: vec![],
            flash: None,
            accesses: 0,
            wrong: None,
        };
        let number = |value: u32| value.to_le_bytes().to_vec();
        objects.values.extend([
            (Mux::DEVICE_TYPE, number(0x0002_0192)),
            (Mux::VENDOR, number(0x319)),
            (Mux::PRODUCT, number(7)),
            (Mux::REVISION, number(0x0001_0002)),
            (Mux::SERIAL, number(u32::from(node.get()))),
            (Mux::CYCLE_PERIOD, number(0)),
            (Mux::SYNC_WINDOW, number(0)),
            (Mux::SYNC_OVERFLOW, vec![0]),
            (Mux::CONFIGURATION_DATE, number(0)),
            (Mux::CONFIGURATION_TIME, number(0)),
            (Mux::consumer_heartbeat(1), number(0)),
            (Mux::PRODUCER_HEARTBEAT, vec![0; 2]),
            (Mux::GUARD_TIME, vec![0; 2]),
            (Mux::LIFE_TIME_FACTOR, vec![0]),
            (Mux::new(0x6060, 0), vec![0]),
            (Mux::new(0x1008, 0), b"A drive of the tests with a name of some length, for segments".to_vec()),
        ]);
        objects.default_pdos(node);
        objects
    }

    /// The PDOs as they are after a reset of the communication: 1 to 4 exist, the first ones valid.
    pub fn default_pdos(&mut self, node: NodeId) {
        for number in 1..=4_u16 {
            for (communication, mapping, word, entry) in [
                (0x1400, 0x1600, cob_id::rpdo(number, node), CONTROLWORD),
                (0x1800, 0x1A00, cob_id::tpdo(number, node), STATUSWORD),
            ] {
                let (communication, mapping) = (communication + number - 1, mapping + number - 1);
                let word =
                    CobId::new(word.unwrap()).with_valid(number == 1).with_bit_30(communication >= 0x1800);
                self.values.insert(Mux::new(communication, 1), word.0.to_le_bytes().to_vec());
                self.values.insert(Mux::new(communication, 2), vec![255]);
                for (sub, len) in [(3, 2), (5, 2), (6, 1)] {
                    self.values.insert(Mux::new(communication, sub), vec![0; len]);
                }
                self.values.insert(Mux::new(mapping, 0), vec![1]);
                self.values.insert(Mux::new(mapping, 1), entry.0.to_le_bytes().to_vec());
                for sub in 2..=8 {
                    self.values.insert(Mux::new(mapping, sub), vec![0; 4]);
                }
            }
        }
        for (object, value) in self.fixed.clone() {
            self.set(object, value);
        }
    }

    /// The first PDO with these communication parameters takes no other transmission types.
    pub fn take(&mut self, communication: u16, types: &[u64]) {
        self.takes.insert(Mux::new(communication, 2), types.to_vec());
    }

    /// These transmission types cannot be changed.
    pub fn fix(&mut self, types: &[(u16, u32)]) {
        for (communication, value) in types {
            let object = Mux::new(*communication, 2);
            self.refuse.insert(object, AbortCode::READ_ONLY);
            self.fixed.push((object, *value));
            self.set(object, *value);
        }
    }

    pub fn number(&self, object: Mux) -> u32 {
        let mut wide = [0; 4];
        let bytes = self.values.get(&object).map(Vec::as_slice).unwrap_or_default();
        wide[..bytes.len()].copy_from_slice(bytes);
        u32::from_le_bytes(wide)
    }

    pub fn set(&mut self, object: Mux, value: u32) {
        let len = self.values[&object].len();
        self.values.insert(object, value.to_le_bytes()[..len].to_vec());
    }

    /// One access more; whether it is the one to be refused.
    fn count(&mut self) -> Result<(), AbortCode> {
        self.accesses += 1;
        match self.wrong {
            Some((at, Wrong::Abort)) if at == self.accesses => Err(AbortCode::DEVICE_STATE),
            _ => Ok(()),
        }
    }

    /// What goes wrong with the access that was counted last.
    fn now_wrong(&self) -> Option<Wrong> {
        self.wrong.filter(|(at, _)| *at == self.accesses).map(|(_, wrong)| wrong)
    }

    /// The rules for changing a mapping, as drives have them.
    fn may_write(&self, object: Mux) -> Result<(), AbortCode> {
        if let Some(&code) = self.refuse.get(&object) {
            return Err(code);
        }
        let mapping = matches!(object.index, 0x1600..=0x1603 | 0x1A00..=0x1A03);
        let valid = CobId(self.number(Mux::new(object.index.wrapping_sub(0x200), 1))).is_valid();
        let count = self.number(Mux::new(object.index, 0));
        match (mapping, object.sub) {
            (true, _) if self.fixed_mapping => Err(AbortCode::READ_ONLY),
            (true, _) if valid => Err(AbortCode::ACCESS),
            (true, 1..) if count != 0 => Err(AbortCode::ACCESS),
            _ => Ok(()),
        }
    }
}

impl ObjectAccess for Objects {
    fn read(&mut self, object: Mux, into: &mut [u8]) -> Result<usize, AbortCode> {
        self.count()?;
        if let Some(value) = self.flash.as_mut().and_then(|flash| flash.read(object)) {
            into[..value.len()].copy_from_slice(&value);
            return Ok(value.len());
        }
        let value = self.values.get(&object).ok_or(AbortCode::NO_OBJECT)?;
        into[..value.len()].copy_from_slice(value);
        Ok(value.len())
    }

    fn write_begins(&mut self, object: Mux, _: Option<u32>) -> Result<usize, AbortCode> {
        self.count()?;
        if self.flash.is_some() && [0x1F50, 0x1F51].contains(&object.index) {
            self.may_write(object)?;
            return Ok(if object.index == 0x1F50 { 1_024 } else { 1 });
        }
        let value = self.values.get(&object).ok_or(AbortCode::NO_OBJECT)?;
        self.may_write(object)?;
        Ok(value.len())
    }

    fn write(&mut self, object: Mux, data: &[u8]) -> Result<(), AbortCode> {
        if let Some(flash) = self.flash.as_mut().filter(|_| [0x1F50, 0x1F51].contains(&object.index)) {
            return flash.write(object, data);
        }
        if data.len() != self.values[&object].len() {
            return Err(AbortCode::LENGTH);
        }
        let number = data.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte));
        if self.takes.get(&object).is_some_and(|takes| !takes.contains(&number)) {
            return Err(AbortCode::VALUE);
        }
        self.writes.push((object, number));
        self.values.insert(object, data.to_vec());
        Ok(())
    }
}

/// A device.
pub struct Device {
    pub node: NodeId,
    pub state: NmtState,
    pub objects: Objects,
    server: Server,
    out: VecDeque<(MonotonicTime, Frame)>,
    next_heartbeat: Option<MonotonicTime>,
    /// When TPDO 1 was sent last by its event timer.
    event_at: MonotonicTime,
    /// Bytes of its TPDOs.
    pub values: [u8; 8],
    /// RPDOs that came.
    pub received: Vec<Vec<u8>>,
    pub syncs: Vec<Vec<u8>>,
    /// Not there at all.
    pub dead: bool,
    /// Does not answer by SDO.
    pub mute: bool,
    /// Does not send heartbeats, and does not answer to guarding.
    pub no_heartbeat: bool,
    /// Bit 7 of its next answer to guarding, and whether that stays as it is.
    pub toggle: bool,
    pub stuck: bool,
    /// Requests of node guarding that came.
    pub guarded: Vec<MonotonicTime>,
    /// Does not obey NMT start.
    pub lazy: bool,
    /// Time from a reset to its boot-up message; `None` for no message.
    pub boot_time: Option<DurationNs>,
    /// Boot-up messages after a reset.
    pub boot_ups: usize,
    /// Time from a question to the answer.
    pub answer_time: DurationNs,
    /// Bytes left out of its TPDOs, or too many.
    pub tpdo_len: Option<usize>,
}

impl Device {
    pub fn new(node: NodeId) -> Self {
        Self {
            node,
            state: NmtState::PRE_OPERATIONAL,
            objects: Objects::new(node),
            server: Server::new(ServerConfig { capacity: 1_024, ..ServerConfig::default() }),
            out: VecDeque::new(),
            next_heartbeat: None,
            event_at: MonotonicTime::ZERO,
            values: [0x27, 6, 1, 2, 3, 4, 5, 6],
            received: vec![],
            syncs: vec![],
            dead: false,
            mute: false,
            no_heartbeat: false,
            toggle: false,
            stuck: false,
            guarded: vec![],
            lazy: false,
            boot_time: Some(DurationNs::from_millis(20)),
            boot_ups: 1,
            answer_time: DurationNs::from_micros(300),
            tpdo_len: None,
        }
    }

    fn send(&mut self, at: MonotonicTime, frame: Frame) {
        let place = self.out.iter().position(|(other, _)| *other > at).unwrap_or(self.out.len());
        self.out.insert(place, (at, frame));
    }

    /// Starts again, by itself or by command.
    pub fn reset(&mut self, now: MonotonicTime) {
        self.state = NmtState::PRE_OPERATIONAL;
        self.server.reset();
        self.out.clear();
        self.objects.default_pdos(self.node);
        self.objects.set(Mux::PRODUCER_HEARTBEAT, 0);
        (self.next_heartbeat, self.toggle) = (None, false);
        if let Some(time) = self.boot_time {
            for turn in 0..self.boot_ups {
                let boot_up = Heartbeat::new(NmtState::BOOT_UP);
                let at = now + time + DurationNs::from_millis(10) * i64::try_from(turn).unwrap();
                self.send(at, frame(cob_id::error_control(self.node), &boot_up.emit()));
            }
        }
    }

    pub fn handle(&mut self, now: MonotonicTime, frame_in: &Frame) {
        if self.dead {
            return;
        }
        let (id, data) = (frame_in.id(), frame_in.data());
        if frame_in.is_remote() {
            // Nobody answers while the boot-up message is still to come.
            let boots = self.out.iter().any(|(_, frame)| frame.id() == id);
            if id == cob_id::error_control(self.node) && !boots {
                self.guarded.push(now);
                let answer = Heartbeat { state: self.state, toggle: self.toggle };
                if !self.no_heartbeat {
                    self.toggle ^= !self.stuck;
                    self.send(now + self.answer_time, frame(id, &answer.emit()));
                }
            }
            return;
        }
        if id == cob_id::NMT {
            let nmt = Nmt::parse(data).unwrap();
            if nmt.node.is_none_or(|node| node == self.node) {
                match nmt.command {
                    NmtCommand::START if !self.lazy => self.state = NmtState::OPERATIONAL,
                    NmtCommand::START => {}
                    NmtCommand::STOP => self.state = NmtState::STOPPED,
                    NmtCommand::RESET_COMMUNICATION => self.reset(now),
                    _ => self.state = NmtState::PRE_OPERATIONAL,
                }
            }
        } else if id == cob_id::SYNC {
            self.syncs.push(data.to_vec());
            self.sync(now);
        } else if id == cob_id::sdo_request(self.node) && self.state.has_sdo() && !self.mute {
            self.server.handle(now, data, &mut self.objects).unwrap();
            if self.objects.flash.as_mut().is_some_and(|flash| core::mem::take(&mut flash.restart)) {
                return self.reset(now);
            }
            while self.server.wake_at() == Some(MonotonicTime::ZERO) {
                let mut answer = self.server.poll(now).unwrap();
                match self.objects.now_wrong() {
                    None | Some(Wrong::Abort) => {}
                    Some(Wrong::Silence) => continue,
                    Some(Wrong::Nonsense) => answer[0] = 0xE7,
                    Some(Wrong::Stranger) => answer[1..4].copy_from_slice(&[0xFF, 0x5F, 7]),
                    Some(Wrong::Reboot) => {
                        self.objects.wrong = None;
                        return self.reset(now);
                    }
                }
                self.send(now + self.answer_time, frame(cob_id::sdo_response(self.node), &answer));
            }
            let period = self.objects.number(Mux::PRODUCER_HEARTBEAT);
            if period > 0 && self.next_heartbeat.is_none() {
                self.next_heartbeat = Some(now + DurationNs::from_millis(period.into()));
            }
        } else if self.state.has_pdo() {
            for index in 0x1400..0x1404 {
                let word = CobId(self.objects.number(Mux::new(index, 1)));
                if word.is_valid() && word.id() == id {
                    self.received.push(data.to_vec());
                }
            }
        }
    }

    fn sync(&mut self, now: MonotonicTime) {
        if !self.state.has_pdo() {
            return;
        }
        for number in 0..4 {
            let word = CobId(self.objects.number(Mux::new(0x1800 + number, 1)));
            let every = self.objects.number(Mux::new(0x1800 + number, 2));
            if word.is_valid() && every == 1 {
                let tpdo = self.tpdo(number);
                self.send(now + DurationNs::from_micros(500), tpdo);
            }
        }
    }

    /// A TPDO, counted from 0.
    fn tpdo(&self, number: u16) -> Frame {
        let word = CobId(self.objects.number(Mux::new(0x1800 + number, 1)));
        let mapping = 0x1A00 + number;
        let count = u8::try_from(self.objects.number(Mux::new(mapping, 0))).unwrap();
        let bits: u32 = (1..=count).map(|sub| self.objects.number(Mux::new(mapping, sub)) & 0xFF).sum();
        let len = self.tpdo_len.unwrap_or(usize::try_from(bits / 8).unwrap());
        frame(word.id(), &self.values[..len])
    }

    /// When TPDO 1 is due by its event timer.
    fn next_event(&self) -> Option<MonotonicTime> {
        let word = CobId(self.objects.number(Mux::new(0x1800, 1)));
        let kind = self.objects.number(Mux::new(0x1800, 2));
        let timer = self.objects.number(Mux::new(0x1800, 5));
        let runs = self.state.has_pdo() && word.is_valid() && kind >= 254 && timer > 0;
        runs.then(|| self.event_at + DurationNs::from_millis(timer.into()))
    }

    pub fn wake_at(&self) -> Option<MonotonicTime> {
        let frames = self.out.front().map(|(at, _)| *at);
        [frames, self.next_heartbeat, self.next_event()].into_iter().flatten().min().filter(|_| !self.dead)
    }

    pub fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        if self.dead {
            return None;
        }
        if self.next_heartbeat.is_some_and(|at| now >= at) {
            let period = self.objects.number(Mux::PRODUCER_HEARTBEAT);
            self.next_heartbeat = (period > 0).then(|| now + DurationNs::from_millis(period.into()));
            let heartbeat = frame(cob_id::error_control(self.node), &Heartbeat::new(self.state).emit());
            if !self.no_heartbeat {
                return Some(heartbeat);
            }
        }
        if self.next_event().is_some_and(|at| now >= at) {
            self.event_at = now;
            return Some(self.tpdo(0));
        }
        match self.out.front() {
            Some((at, _)) if now >= *at => self.out.pop_front().map(|(_, frame)| frame),
            _ => None,
        }
    }
}
