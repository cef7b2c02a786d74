//! The node: what ties dictionary, process data, network management and motion together.

use super::Refusal;
use super::Write;
use super::dictionary::{Access, Dictionary, abort, long, number, word};
use super::motion::{Motion, State};
use super::nmt::{Due, Nmt, NmtState};
use super::pdo::{self, Mapped, Pdos, Received};
use super::settings::{Period, Settings, ShortPdo};
use crate::can::Frame;

/// Lines the log keeps.
const LOG: usize = 20_000;

/// A drive without its SDO server.
#[derive(Debug, Clone)]
pub struct Node {
    /// How the drive is.
    pub s: Settings,
    /// Its objects.
    pub od: Dictionary,
    /// Its network state.
    pub nmt: Nmt,
    /// Its drive.
    pub motion: Motion,
    /// Downloads accepted.
    pub writes: Vec<Write>,
    /// Transfers refused.
    pub refused: Vec<Refusal>,
    /// What happened.
    pub log: Vec<(u64, String)>,
    /// Set at a restart: the SDO server starts anew.
    pub restarted: bool,
    pdos: Pdos,
    stored: Option<Dictionary>,
    delivered: bool,
    powered: bool,
    now: u64,
    fault_fired: bool,
    history: Vec<u32>,
    outbox: Vec<(u64, Frame)>,
}

impl Node {
    /// A drive without power.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let od = Dictionary::new(&settings);
        Self {
            nmt: Nmt::new(0),
            motion: Motion::new(&settings, 0),
            od,
            s: settings,
            writes: Vec::new(),
            refused: Vec::new(),
            log: Vec::new(),
            restarted: false,
            pdos: Pdos::default(),
            stored: None,
            delivered: false,
            powered: false,
            now: 0,
            fault_fired: false,
            history: Vec::new(),
            outbox: Vec::new(),
        }
    }

    /// Adds a line to the log.
    pub fn note(&mut self, text: String) {
        if self.log.len() < LOG {
            self.log.push((self.now, text));
        }
    }

    fn say(&mut self, id: u16, data: &[u8]) {
        self.say_later(0, id, data);
    }

    /// Says something after a time.
    pub fn say_later(&mut self, ms: u64, id: u16, data: &[u8]) {
        self.outbox.push((self.now + ms * 1000, Frame::new(id, data)));
    }

    /// Moves what is due to the bus.
    pub fn flush(&mut self, out: &mut Vec<Frame>) {
        let now = self.now;
        let (due, later): (Vec<_>, Vec<_>) = self.outbox.drain(..).partition(|(at, _)| *at <= now);
        self.outbox = later;
        out.extend(due.into_iter().map(|(_, frame)| frame));
    }

    fn own_id(&self, base: u16) -> u16 {
        base + u16::from(self.s.node_id & 0x7F)
    }

    /// Power comes, or goes and comes again.
    pub fn power_on(&mut self, now: u64) {
        self.now = self.now.max(now);
        self.powered = true;
        self.note("power on".into());
        self.reset_node();
    }

    /// All starts anew, as after the NMT command or a restart of the drive itself.
    pub fn reset_node(&mut self) {
        self.note("reset".into());
        let (pos, blocked, load) = (self.motion.axis.pos, self.motion.axis.blocked, self.motion.axis.load);
        let (mains, safe) = (self.motion.mains, self.motion.safe);
        let first = self.nmt.boots == 0;
        self.motion = Motion::new(&self.s, self.now + self.s.boot_ms * 1000);
        if !first && !self.s.forgets_position {
            self.motion.axis.pos = pos;
        }
        self.motion.axis.blocked = blocked;
        self.motion.axis.load = load;
        self.motion.mains = mains;
        self.motion.safe = safe;
        self.od = Dictionary::new(&self.s);
        if let Some(stored) = self.stored.as_ref().filter(|_| !self.delivered) {
            self.od = stored.clone();
        }
        self.delivered = false;
        self.history.clear();
        self.start_again();
    }

    /// Only the communication starts anew.
    fn reset_communication(&mut self) {
        self.note("reset communication".into());
        self.motion.connection_lost(&mut self.od, &self.s);
        let fresh = self.stored.clone().unwrap_or_else(|| Dictionary::new(&self.s));
        let code = self.od.int(0x1001, 0);
        self.od.restore(&fresh, 0x1000, 0x1FFF);
        self.od.set(0x1001, 0, code);
        self.start_again();
    }

    fn start_again(&mut self) {
        self.nmt.restart(self.now + self.s.boot_ms * 1000);
        self.outbox.clear();
        self.pdos = Pdos::default();
        self.pdos.load(&self.od, &self.s);
        self.motion.operational = false;
        self.motion.publish(&mut self.od, &self.s);
        self.restarted = true;
        self.fault_fired = false;
    }

    /// Lets time pass.
    pub fn advance(&mut self, now: u64) {
        if !self.powered {
            self.power_on(now);
        }
        self.now = self.now.max(now);
        let now = self.now;
        if self.nmt.state != NmtState::Initialising {
            let age = now - self.nmt.booted_at;
            if self.s.restarts_every_ms.is_some_and(|ms| age >= ms * 1000) {
                self.reset_node();
            } else if let Some((ms, code)) = self.s.fault_after
                && !self.fault_fired
                && age >= ms * 1000
            {
                self.fault_fired = true;
                self.motion.fail(code, &mut self.od, &self.s);
            }
        }
        for due in self.nmt.tick(now, &self.od) {
            self.network_due(due);
        }
        if self.nmt.state == NmtState::Initialising {
            return;
        }
        self.motion.advance(now, &mut self.od, &self.s);
        if self.nmt.state == NmtState::Operational {
            if self.pdos.late(now) {
                self.warning(0x8250);
            }
            let operating = self.motion.state == State::OperationEnabled;
            if operating && self.motion.modes.sync_lost(now, &self.od, &self.s) {
                self.motion.fail(0x8700, &mut self.od, &self.s);
            }
        }
        self.settle();
    }

    fn network_due(&mut self, due: Due) {
        let id = self.own_id(0x700);
        match due {
            Due::Boot => {
                self.note("boot-up".into());
                if !self.s.silent_boot {
                    self.say(id, &[0]);
                }
                if self.s.self_starting {
                    self.change_state(NmtState::Operational);
                }
            }
            Due::Heartbeat(state) => self.say(id, &[state]),
            Due::MasterLost => {
                self.note("master lost".into());
                match self.od.int(0x1029, 1) {
                    0 if self.nmt.state == NmtState::Operational => {
                        self.change_state(NmtState::PreOperational)
                    }
                    2 => self.change_state(NmtState::Stopped),
                    _ => {}
                }
                self.motion.connection_lost(&mut self.od, &self.s);
                if self.motion.emergencies.is_empty() {
                    self.warning(0x8130);
                }
            }
        }
    }

    /// Says what came of everything: emergencies, events, notes.
    pub fn settle(&mut self) {
        for note in std::mem::take(&mut self.motion.notes) {
            self.note(note);
        }
        for code in std::mem::take(&mut self.motion.emergencies) {
            self.emergency(code);
        }
        if self.nmt.state == NmtState::Operational {
            for (id, data) in self.pdos.events(&self.od, &self.s, self.now) {
                self.say(id, &data);
            }
        }
    }

    /// A fault comes or goes: 1001 shows it.
    fn emergency(&mut self, code: u16) {
        self.od.set(0x1001, 0, register(code).into());
        self.warning(code);
    }

    /// Sends an emergency message and keeps the history.
    fn warning(&mut self, code: u16) {
        self.note(format!("emergency {code:04X}"));
        if code != 0 {
            self.history.insert(0, u32::from(code));
            self.history.truncate(8);
            self.show_history();
        }
        let cob = long(self.od.int(0x1014, 0));
        if cob & 0x8000_0000 == 0 && self.nmt.talks() {
            let [low, high] = code.to_le_bytes();
            self.say(word(i64::from(cob & 0x7FF)), &[low, high, register(code), 0, 0, 0, 0, 0]);
        }
    }

    fn show_history(&mut self) {
        self.od.set(0x1003, 0, i64::try_from(self.history.len()).unwrap_or(0));
        for sub in 1..=8_u8 {
            let code = self.history.get(usize::from(sub) - 1).copied().unwrap_or(0);
            self.od.set(0x1003, sub, code.into());
        }
    }

    fn change_state(&mut self, state: NmtState) {
        if self.nmt.state == state {
            return;
        }
        self.note(format!("{:?} -> {state:?}", self.nmt.state));
        self.nmt.state = state;
        self.motion.operational = state == NmtState::Operational;
        self.pdos.forget();
        if state == NmtState::Stopped {
            self.motion.connection_lost(&mut self.od, &self.s);
        }
        self.motion.publish(&mut self.od, &self.s);
    }

    /// An NMT command.
    pub fn network_command(&mut self, data: &[u8]) {
        let &[command, target] = data else { return };
        if target != 0 && target != self.s.node_id {
            return;
        }
        match command {
            1 => self.change_state(NmtState::Operational),
            2 => self.change_state(NmtState::Stopped),
            128 => self.change_state(NmtState::PreOperational),
            129 => self.reset_node(),
            130 => self.reset_communication(),
            _ => {}
        }
    }

    /// A SYNC: first the actual values go out, then the set-points take effect.
    pub fn sync(&mut self, data: &[u8]) {
        if !self.nmt.talks() {
            return;
        }
        let overflow = self.od.int(0x1019, 0);
        let wanted = usize::from(overflow != 0);
        if data.len() != wanted && overflow != 0 {
            self.warning(0x8240);
            return;
        }
        if self.nmt.state != NmtState::Operational {
            return;
        }
        let counter = data.first().copied().filter(|_| overflow != 0);
        for (id, bytes) in self.pdos.at_sync(&self.od, counter, self.now) {
            self.say(id, &bytes);
        }
        for (map, bytes) in self.pdos.waiting() {
            self.take(&map, &bytes);
        }
        self.motion.sync(&self.od);
        self.motion.publish(&mut self.od, &self.s);
        self.settle();
    }

    /// Whether this identifier is that of SYNC.
    #[must_use]
    pub fn is_sync(&self, id: u16) -> bool {
        i64::from(id) == self.od.int(0x1005, 0) & 0x7FF
    }

    /// A frame that is perhaps an RPDO or a request for a TPDO.
    pub fn process_data(&mut self, frame: &Frame) {
        if self.nmt.state != NmtState::Operational {
            return;
        }
        if frame.remote {
            if let Some(data) = self.pdos.requested(frame.id, &self.od, self.now) {
                self.say(frame.id, &data);
            }
            return;
        }
        let Some((received, long)) = self.pdos.receive(frame.id, &frame.data, self.now) else { return };
        if long && self.s.long_pdo_emergency {
            self.warning(0x8220);
        }
        match received {
            Received::Now(map, data) => self.take(&map, &data),
            Received::Later => {}
            Received::Short => match self.s.short_pdo {
                ShortPdo::Ignored => self.note("short PDO".into()),
                ShortPdo::Emergency => self.warning(0x8210),
                ShortPdo::Fault => self.motion.fail(0x8210, &mut self.od, &self.s),
            },
        }
        self.settle();
    }

    /// All values of a PDO are stored first; the controlword takes effect last.
    fn take(&mut self, map: &[Mapped], data: &[u8]) {
        let mut at = 0;
        let mut done = Vec::new();
        for (index, sub, bytes) in map {
            let Some(value) = data.get(at..at + bytes) else { return };
            at += bytes;
            let inner = self.od.inner(*index);
            let mode = number(value, true);
            let wrong_mode = inner == 0x6060 && self.motion.check_mode(mode, &self.s).is_err();
            if wrong_mode {
                self.note(format!("mode {mode} in a PDO refused"));
            } else if self.od.wire(*index, *sub).is_ok() {
                self.od.set_wire(*index, *sub, value);
                done.push((inner, *sub));
            }
        }
        done.sort_by_key(|(index, _)| *index == 0x6040);
        for (index, sub) in done {
            self.after_write(index, sub, true);
        }
    }

    /// Bytes of an object, if it has a fixed number.
    #[must_use]
    pub fn width(&self, index: u16, sub: u8) -> Option<usize> {
        self.od.wire(index, sub).ok().and_then(|entry| entry.kind.width())
    }

    /// An upload.
    ///
    /// # Errors
    /// The abort code.
    pub fn upload(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        let entry = self.od.wire(index, sub)?;
        if entry.access == Access::Wo {
            return Err(abort::WRITE_ONLY);
        }
        let empty = index == 0x1003 && usize::from(sub) > self.history.len();
        if empty && !self.s.empty_history_reads {
            return Err(abort::NO_DATA);
        }
        Ok(entry.data.clone())
    }

    /// Whether a download may begin.
    ///
    /// # Errors
    /// The abort code.
    pub fn may_download(&self, index: u16, sub: u8, size: Option<usize>) -> Result<(), u32> {
        let entry = self.od.wire(index, sub)?;
        if matches!(entry.access, Access::Const | Access::Ro) {
            return Err(abort::READ_ONLY);
        }
        match (entry.kind.width(), size) {
            (Some(width), Some(size)) if width != size => Err(abort::LENGTH),
            _ => Ok(()),
        }
    }

    /// A transfer was refused.
    pub fn refuse(&mut self, index: u16, sub: u8, code: u32) {
        self.note(format!("{index:04X}:{sub} refused {code:08X}"));
        self.refused.push(Refusal { index, sub, code });
    }

    /// A download.
    ///
    /// # Errors
    /// The abort code.
    pub fn download(&mut self, index: u16, sub: u8, data: &[u8]) -> Result<(), u32> {
        self.od.check(index, sub, data)?;
        let inner = self.od.inner(index);
        let signed = self.od.wire(index, sub)?.kind.signed();
        let value = number(data, signed);
        pdo::check(&self.od, self.nmt.state, &self.s, index, sub, value)?;
        self.check(inner, sub, value)?;
        self.writes.push(Write { index, sub, data: data.to_vec() });
        if matches!((inner, self.s.period), (0x60C2, Period::Sticks(..)))
            || (0x1010..=0x1011).contains(&inner)
        {
            self.keep(inner);
            return Ok(());
        }
        self.od.set_wire(index, sub, data);
        self.after_write(inner, sub, false);
        Ok(())
    }

    /// What holds for objects other than the PDO objects.
    fn check(&self, index: u16, sub: u8, value: i64) -> Result<(), u32> {
        let guarding = self.od.int(0x100C, 0) * self.od.int(0x100D, 0) != 0;
        let beating = self.od.int(0x1017, 0) != 0;
        match index {
            0x1003 if value != 0 => Err(abort::VALUE),
            0x1010 if self.s.store_fails => Err(abort::HARDWARE),
            0x1010 if value != 0x6576_6173 => Err(abort::STORE),
            0x1011 if value != 0x6461_6F6C => Err(abort::STORE),
            0x1017 if self.s.heartbeat_or_guarding && guarding && value != 0 => Err(abort::INCOMPATIBLE),
            0x100C | 0x100D if self.s.heartbeat_or_guarding && beating && value != 0 => {
                Err(abort::INCOMPATIBLE)
            }
            0x1019 if value != 0 && !(2..=240).contains(&value) => Err(abort::VALUE),
            0x1029 if sub == 1 && !(0..=2).contains(&value) => Err(abort::VALUE),
            0x6060 => self.motion.check_mode(value, &self.s),
            0x6098 => {
                let (low, high) = self.s.homing_methods;
                let known = (i64::from(low)..=i64::from(high)).contains(&value);
                if known { Ok(()) } else { Err(abort::VALUE) }
            }
            0x605A if !(0..=8).contains(&value) => Err(abort::VALUE),
            0x6007 if !(0..=3).contains(&value) => Err(abort::VALUE),
            _ => Ok(()),
        }
    }

    /// Store and restore.
    fn keep(&mut self, index: u16) {
        match index {
            0x1010 => self.stored = Some(self.od.clone()),
            0x1011 => self.delivered = true,
            _ => {}
        }
    }

    fn after_write(&mut self, index: u16, sub: u8, by_pdo: bool) {
        match index {
            0x1003 => {
                self.history.clear();
                self.show_history();
            }
            0x1017 => self.nmt.heartbeat_changed(self.now, &self.od),
            0x1400..=0x1BFF => self.pdos.load(&self.od, &self.s),
            _ => {}
        }
        if self.s.ready_after == Some((index, sub)) {
            self.motion.released();
        }
        self.motion.written(index, by_pdo, &mut self.od, &self.s);
    }
}

/// The error register of an error code.
fn register(code: u16) -> u8 {
    match code {
        0 => 0,
        0x2000..=0x2FFF => 0x03,
        0x3000..=0x3FFF => 0x05,
        0x4000..=0x4FFF => 0x09,
        0x8100..=0x82FF => 0x11,
        0x8300..=0x8FFF => 0x21,
        0xFF00..=0xFFFF => 0x81,
        _ => 0x01,
    }
}
