//! Network management: states, boot-up, heartbeat and node guarding.

use super::dictionary::Dictionary;

/// The states of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NmtState {
    /// Starting; it hears nothing.
    Initialising,
    /// SDO, no PDO.
    PreOperational,
    /// Everything.
    Operational,
    /// Only NMT and error control.
    Stopped,
}

/// What time brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Due {
    /// The start is over.
    Boot,
    /// A heartbeat with this state.
    Heartbeat(u8),
    /// Guarding or the heartbeat of the master stayed away.
    MasterLost,
}

/// The state of the node and its timers.
#[derive(Debug, Clone)]
pub struct Nmt {
    /// The state.
    pub state: NmtState,
    /// Starts so far.
    pub boots: u32,
    /// When the last start was over.
    pub booted_at: u64,
    boot_due: Option<u64>,
    heartbeat_due: Option<u64>,
    toggle: bool,
    guarded: Option<u64>,
    heard: Option<u64>,
}

impl Nmt {
    /// A node that starts.
    #[must_use]
    pub fn new(boot_due: u64) -> Self {
        Self {
            state: NmtState::Initialising,
            boots: 0,
            booted_at: 0,
            boot_due: Some(boot_due),
            heartbeat_due: None,
            toggle: false,
            guarded: None,
            heard: None,
        }
    }

    /// Starts again.
    pub fn restart(&mut self, boot_due: u64) {
        *self = Self { boots: self.boots, ..Self::new(boot_due) };
    }

    /// The state as error control tells it.
    #[must_use]
    pub fn code(&self) -> u8 {
        match self.state {
            NmtState::Initialising => 0,
            NmtState::Stopped => 4,
            NmtState::Operational => 5,
            NmtState::PreOperational => 127,
        }
    }

    /// Whether SDO works.
    #[must_use]
    pub fn talks(&self) -> bool {
        matches!(self.state, NmtState::PreOperational | NmtState::Operational)
    }

    /// A guarding request: the answer, if the node guards.
    pub fn guard(&mut self, now: u64, od: &Dictionary) -> Option<u8> {
        if self.state == NmtState::Initialising || od.int(0x1017, 0) != 0 {
            return None;
        }
        self.guarded = Some(now);
        let answer = self.code() | if self.toggle { 0x80 } else { 0 };
        self.toggle = !self.toggle;
        Some(answer)
    }

    /// A heartbeat of another node.
    pub fn heartbeat_of(&mut self, node: u16, now: u64, od: &Dictionary) {
        let watched = (od.int(0x1016, 1) >> 16) & 0x7F;
        if watched != 0 && i64::from(node) == watched {
            self.heard = Some(now);
        }
    }

    /// 1017 was written.
    pub fn heartbeat_changed(&mut self, now: u64, od: &Dictionary) {
        self.heartbeat_due = period(od).map(|period| now + period);
    }

    /// What is due.
    pub fn tick(&mut self, now: u64, od: &Dictionary) -> Vec<Due> {
        let mut due = Vec::new();
        if self.boot_due.is_some_and(|at| now >= at) {
            self.boot_due = None;
            self.boots += 1;
            self.booted_at = now;
            self.state = NmtState::PreOperational;
            self.heartbeat_due = period(od).map(|period| now + period);
            due.push(Due::Boot);
        }
        if self.state == NmtState::Initialising {
            return due;
        }
        if let (Some(at), Some(period)) = (self.heartbeat_due, period(od))
            && now >= at
        {
            due.push(Due::Heartbeat(self.code()));
            self.heartbeat_due = Some(if at + period > now { at + period } else { now + period });
        }
        let micros = |value: i64| u64::try_from(value).unwrap_or(0) * 1000;
        let life = micros(od.int(0x100C, 0) * od.int(0x100D, 0));
        if life > 0 && self.guarded.is_some_and(|at| now - at > life) {
            self.guarded = None;
            due.push(Due::MasterLost);
        }
        let limit = micros(od.int(0x1016, 1) & 0xFFFF);
        if limit > 0 && self.heard.is_some_and(|at| now - at > limit) {
            self.heard = None;
            due.push(Due::MasterLost);
        }
        due
    }
}

fn period(od: &Dictionary) -> Option<u64> {
    u64::try_from(od.int(0x1017, 0)).ok().filter(|ms| *ms > 0).map(|ms| ms * 1000)
}
