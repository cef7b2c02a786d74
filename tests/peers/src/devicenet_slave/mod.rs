//! A DeviceNet slave with a drive in it: a group 2 only server, either a CIP Motion drive or an AC drive.
//!
//! It has the explicit and the poll connection of the predefined master/slave connection set. Where the standards leave
//! something open, it does this:
//!
//! - An allocation with the poll choice, and a release of it, put the axis back to Initializing and all its attributes
//!   to 0.
//! - The fixed connection format has no Control Status and no Command Control by its table, so the axis leaves
//!   Initializing with the first valid block, and Command Position is a DINT when there is no room for an LREAL. If
//!   the two bytes are used as in the variable format, they are obeyed.
//! - Actual and status data that do not fit in the fixed size are left out, with their bits; the rest is zero.
//! - A disable request is acknowledged when the axis stands, not when it begins to stop.
//! - A poll command of another length than the consumed size is neither taken nor answered. An empty one is answered,
//!   and changes nothing.
//! - A poll connection that has timed out can be allocated anew.
//! - Run bits of the AC drive are edges: after a reset or with network control granted late, they must fall and rise.
//! - Class 1 transport has no sequence count on this network.

mod axis_object;
mod axis_table;
mod connection;
mod drive;
mod messages;
mod motion_drive;
mod objects;
mod power;
mod request;
pub mod settings;
mod speed_drive;

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use crate::can::{Frame, Station};
use connection::{Connection, DEFERRED, ESTABLISHED, Expired};
use drive::Drive;
use messages::{Explicit, ExplicitIn, ExplicitOut, IoIn};
pub use objects::{RefusedRecord, SetRecord};
use power::Power;
pub use settings::{
    BodyFormat, CommandPosition, Lasts, PlannedFault, Profile, RefusedSet, Settings, UpdateId,
};

#[derive(Debug, Clone)]
enum Later {
    Explicit { header: u8, data: Vec<u8> },
    Frames(Vec<Frame>),
}

/// The slave.
#[derive(Debug, Clone)]
pub struct DevicenetSlave {
    settings: Settings,
    now_us: u64,
    power: Power,
    power_us: u64,
    restart_us: u64,
    master: Option<u8>,
    foreign: bool,
    explicit: Connection,
    explicit_in: ExplicitIn,
    explicit_out: Option<ExplicitOut>,
    poll: Connection,
    io_in: IoIn,
    consumed_assembly: u8,
    produced_assembly: u8,
    later: VecDeque<(u64, Later)>,
    requests: u32,
    polls: u32,
    restart_asked: bool,
    failing: Option<u16>,
    drive: Drive,
    sets: Vec<SetRecord>,
    refused: Vec<RefusedRecord>,
    log: Vec<String>,
}

/// The log is not longer than this.
const LOG_LINES: usize = 20_000;
/// No physical step is longer than this.
const STEP_US: u64 = 1000;

impl DevicenetSlave {
    /// A slave without power. The first frame or tick switches it on.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let drive = Drive::new(&settings, 0);
        Self {
            now_us: 0,
            power: Power::Off,
            power_us: 0,
            restart_us: 0,
            master: None,
            foreign: false,
            explicit: Connection::none(1),
            explicit_in: ExplicitIn::default(),
            explicit_out: None,
            poll: Connection::none(2),
            io_in: IoIn::default(),
            consumed_assembly: settings.consumed_assembly,
            produced_assembly: settings.produced_assembly,
            later: VecDeque::new(),
            requests: 0,
            polls: 0,
            restart_asked: false,
            failing: None,
            drive,
            sets: Vec::new(),
            refused: Vec::new(),
            log: Vec::new(),
            settings,
        }
    }

    /// The settings, which may be changed at any time.
    pub fn settings(&mut self) -> &mut Settings {
        &mut self.settings
    }

    /// Motion: Axis State. Speed: the state of the Control Supervisor.
    #[must_use]
    pub fn state(&self) -> u8 {
        self.drive.state()
    }

    /// Motion: feedback counts. Speed: turns since power-on.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.drive.position()
    }

    /// Motion: units per second. Speed: RPM.
    #[must_use]
    pub fn velocity(&self) -> f64 {
        self.drive.velocity()
    }

    /// Whether the motor has power.
    #[must_use]
    pub fn enabled(&self) -> bool {
        self.drive.enabled()
    }

    /// Whether there is a fault.
    #[must_use]
    pub fn faulted(&self) -> bool {
        self.drive.faulted()
    }

    /// Every attribute that was set, in order.
    #[must_use]
    pub fn sets(&self) -> &[SetRecord] {
        &self.sets
    }

    /// Every request that was refused, in order.
    #[must_use]
    pub fn refused(&self) -> &[RefusedRecord] {
        &self.refused
    }

    /// The MAC ID of the master and the choice byte of what it has allocated.
    #[must_use]
    pub fn allocated(&self) -> Option<(u8, u8)> {
        self.master.map(|master| (master, self.choice()))
    }

    /// The states of the explicit and of the poll connection, as their attribute 1 tells them.
    #[must_use]
    pub fn connection_states(&self) -> (u8, u8) {
        (self.explicit.state, self.poll.state)
    }

    /// Whether it has done its duplicate MAC ID check and is on line.
    #[must_use]
    pub fn on_line(&self) -> bool {
        self.power == Power::OnLine
    }

    /// The number of poll commands taken since power-on.
    #[must_use]
    pub fn polls(&self) -> u32 {
        self.polls
    }

    /// Makes a fault whose cause stays until `mend`. Motion: the bit number in Axis Faults. Speed: the fault code.
    pub fn fail(&mut self, code: u16) {
        self.write_log(&format!("fails with {code:04X}h"));
        self.failing = Some(code);
        self.drive.fail(code);
    }

    /// Takes the cause of the fault away. The fault itself stays until the master resets it.
    pub fn mend(&mut self) {
        self.write_log("mended");
        self.failing = None;
        self.drive.mend();
    }

    /// What has happened, a line each, with the time in microseconds.
    #[must_use]
    pub fn log(&self) -> &[String] {
        &self.log
    }

    fn write_log(&mut self, line: &str) {
        if self.log.len() < LOG_LINES {
            self.log.push(format!("{} {line}", self.now_us));
        }
    }

    fn choice(&self) -> u8 {
        u8::from(self.explicit.exists()) | (u8::from(self.poll.exists()) << 1)
    }

    /// Forgets the master when nothing of the set is left.
    fn let_go(&mut self) {
        let alive =
            self.explicit.exists() || matches!(self.poll.state, connection::CONFIGURING | ESTABLISHED);
        if self.master.is_some() && !alive {
            self.master = None;
            self.poll = Connection::none(2);
            self.write_log("nobody's slave again");
        }
    }

    fn open_poll(&mut self) {
        self.consumed_assembly = self.settings.consumed_assembly;
        self.produced_assembly = self.settings.produced_assembly;
        let settings = &self.settings;
        let (size, consumed, produced) = match settings.profile {
            Profile::Motion => (16, settings.motion_path.clone(), settings.motion_path.clone()),
            Profile::Speed => (
                4,
                vec![0x20, 0x04, 0x24, self.consumed_assembly, 0x30, 0x03],
                vec![0x20, 0x04, 0x24, self.produced_assembly, 0x30, 0x03],
            ),
        };
        let produced_size = settings.produced_size.unwrap_or(size);
        let consumed_size = settings.consumed_size.unwrap_or(size);
        self.poll =
            Connection::poll(settings.poll_transport, (produced_size, consumed_size), produced, consumed);
        self.io_in.clear();
        self.drive.opened(&self.settings);
    }

    fn close_poll(&mut self) {
        self.poll = Connection::none(2);
        self.drive.closed(&self.settings);
    }

    /// Lets time pass up to now.
    fn advance(&mut self, now_us: u64, out: &mut Vec<Frame>) {
        let now_us = now_us.max(self.now_us);
        let running = self.power != Power::Off;
        let mut from = if running { self.now_us } else { now_us };
        self.now_us = now_us;
        let every = u64::from(self.settings.restart_every_ms) * 1000;
        let asked = self.restart_asked && self.later.is_empty() && self.explicit_out.is_none();
        if running && (asked || (every > 0 && now_us >= self.restart_us + every)) {
            self.power = Power::Off;
            from = now_us;
        }
        self.power_up(out);
        while from < now_us {
            let step = if now_us - from > 10_000_000 {
                now_us - from - 10_000_000
            } else {
                STEP_US.min(now_us - from)
            };
            from += step;
            self.drive.advance(&self.settings, from, step);
        }
        let foreign_us = u64::from(self.settings.foreign_master_ms) * 1000;
        if self.foreign && foreign_us > 0 && now_us >= self.restart_us + foreign_us {
            self.foreign = false;
        }
        self.watch();
        self.send_later(out);
    }

    fn watch(&mut self) {
        match self.poll.watch(self.now_us, false) {
            Expired::TimedOut | Expired::Deleted => {
                self.write_log("poll connection timed out");
                self.drive.lost(&self.settings);
                if self.explicit.state == DEFERRED {
                    self.explicit = Connection::none(1);
                }
                self.let_go();
            }
            Expired::No | Expired::Reset => {}
        }
        let child = self.poll.state == ESTABLISHED;
        match self.explicit.watch(self.now_us, child) {
            Expired::TimedOut | Expired::Deleted => {
                self.write_log("explicit connection timed out");
                self.explicit_out = None;
                self.let_go();
            }
            Expired::No | Expired::Reset => {}
        }
    }

    fn send_later(&mut self, out: &mut Vec<Frame>) {
        while self.later.front().is_some_and(|(due, _)| *due <= self.now_us) {
            let Some((_, what)) = self.later.pop_front() else { break };
            match what {
                Later::Frames(frames) => out.extend(frames),
                Later::Explicit { header, data } => {
                    let id = messages::group2(self.settings.mac, messages::EXPLICIT_ANSWER);
                    self.explicit_out = ExplicitOut::start(self.now_us, id, header, data, out);
                }
            }
        }
        if let Some(mut sending) = self.explicit_out.take() {
            if sending.tick(self.now_us, out) {
                self.explicit_out = Some(sending);
            } else {
                self.write_log("an answer was given up");
            }
        }
    }

    fn put_later(&mut self, delay_ms: u32, what: Later) {
        let due = self.now_us + u64::from(delay_ms) * 1000;
        let at = self.later.partition_point(|(other, _)| *other <= due);
        self.later.insert(at, (due, what));
    }

    /// Carries a whole explicit message out and prepares the answer.
    fn explicit_message(&mut self, header: u8, format: BodyFormat, message: &[u8]) {
        self.requests = self.requests.saturating_add(1);
        let master = header & 0x3F;
        let wide = self.settings.wide_axis_attribute;
        let service = message.first().copied().unwrap_or(0);
        let answer = match objects::Request::parse(format, wide, message) {
            Some(request) => self.serve(master, &request),
            None if service & 0x80 != 0 => return,
            None => Err(objects::Refusal::SHORT),
        };
        let every = self.settings.explicit_missing_every;
        if every > 0 && self.requests.is_multiple_of(every) {
            return;
        }
        let data = match answer {
            Ok(data) => {
                let extra = u8::from(self.settings.wrong_service);
                let mut whole = vec![(service.wrapping_add(extra)) | 0x80];
                whole.extend(data);
                whole
            }
            Err(refusal) => vec![0x94, refusal.general, refusal.additional],
        };
        let mut header = header & !messages::FRAGMENT;
        if self.settings.wrong_mac {
            header = (header & messages::TRANSACTION) | self.settings.mac;
        }
        if self.settings.wrong_transaction {
            header ^= messages::TRANSACTION;
        }
        self.explicit_out = None;
        self.put_later(self.settings.explicit_delay_ms, Later::Explicit { header, data });
    }

    fn hear_unconnected(&mut self, data: &[u8]) {
        let Some((&header, message)) = data.split_first() else { return };
        let Some(&service) = message.first() else { return };
        if header & messages::FRAGMENT != 0 || service & 0x80 != 0 {
            return;
        }
        if matches!(service, objects::ALLOCATE | objects::RELEASE) && message.get(1..3) == Some(&[3, 1][..]) {
            self.explicit_message(header, BodyFormat::EightEight, message);
        } else {
            let refusal = objects::Refusal::with(0x08, 0x03);
            self.note_refused(service, 0, 0, None, refusal);
            let data = vec![0x94, refusal.general, refusal.additional];
            self.put_later(self.settings.explicit_delay_ms, Later::Explicit { header, data });
        }
    }

    fn hear_explicit(&mut self, data: &[u8], out: &mut Vec<Frame>) {
        let Some(&header) = data.first() else { return };
        if self.master != Some(header & 0x3F) {
            return;
        }
        match self.explicit.state {
            ESTABLISHED => {}
            DEFERRED => self.explicit.state = ESTABLISHED,
            _ => return,
        }
        self.explicit.arm(self.now_us, false);
        let id = messages::group2(self.settings.mac, messages::EXPLICIT_ANSWER);
        match self.explicit_in.take(data, self.settings.longest_request) {
            Explicit::Nothing => {}
            Explicit::Part(count, state) => {
                out.push(Frame::new(id, &messages::acknowledge(header, count, state)))
            }
            Explicit::Whole(message, count) => {
                if let Some(count) = count {
                    out.push(Frame::new(id, &messages::acknowledge(header, count, 0)));
                }
                let format = self.settings.body_format;
                self.explicit_message(header, format, &message);
            }
            Explicit::Acknowledge(count, state) => {
                if let Some(mut sending) = self.explicit_out.take()
                    && sending.acknowledged(self.now_us, count, state, out)
                {
                    self.explicit_out = Some(sending);
                }
            }
        }
    }

    fn hear_poll(&mut self, data: &[u8]) {
        if self.poll.state != ESTABLISHED {
            return;
        }
        let size = usize::from(self.poll.consumed_size);
        let Some(message) = self.io_in.take(size, data) else { return };
        if !message.is_empty() && message.len() != size {
            self.write_log(&format!(
                "a poll command of {} bytes is not taken, {size} are due",
                message.len()
            ));
            return;
        }
        self.poll.arm(self.now_us, false);
        self.polls = self.polls.saturating_add(1);
        let size = usize::from(self.poll.produced_size);
        let (consumed, produced) = (self.consumed_assembly, self.produced_assembly);
        let mut answer = self.drive.poll(&self.settings, &message, (consumed, produced), size);
        let every = self.settings.poll_missing_every;
        if every > 0 && self.polls.is_multiple_of(every) {
            return;
        }
        answer.resize(size, 0);
        answer.truncate(size.saturating_sub(self.settings.poll_short_by));
        answer.resize(answer.len() + self.settings.poll_long_by, 0);
        let id = messages::group1(self.settings.mac, messages::POLL_ANSWER);
        let frames = messages::split_io(size, &answer).iter().map(|part| Frame::new(id, part)).collect();
        self.put_later(self.settings.poll_delay_ms, Later::Frames(frames));
    }
}

impl Station for DevicenetSlave {
    fn hear(&mut self, now_us: u64, frame: &Frame, out: &mut Vec<Frame>) {
        self.advance(now_us, out);
        if frame.remote || frame.data.len() > 8 {
            return;
        }
        let Some((mac, message)) = messages::split_group2(frame.id) else { return };
        if message == messages::DUP_CHECK {
            self.hear_dup_check(mac, &frame.data, out);
            return;
        }
        if mac != self.settings.mac || self.power != Power::OnLine {
            return;
        }
        match message {
            messages::UNCONNECTED_REQUEST => self.hear_unconnected(&frame.data),
            messages::EXPLICIT_REQUEST => self.hear_explicit(&frame.data, out),
            messages::POLL_COMMAND => self.hear_poll(&frame.data),
            _ => {}
        }
        self.send_later(out);
    }

    fn tick(&mut self, now_us: u64, out: &mut Vec<Frame>) {
        self.advance(now_us, out);
    }
}
