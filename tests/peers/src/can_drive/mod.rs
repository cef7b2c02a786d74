//! A CANopen drive of CiA 402.
//!
//! [`CanDrive`] is one node with one axis. [`Settings`] say how it is and how it is odd; the presets are near drives of the
//! field. Tests hand it frames and time, and look at it with the methods here.

pub mod dictionary;
pub mod settings;

mod axis;
mod modes;
mod motion;
mod nmt;
mod node;
mod objects;
mod pdo;
mod presets;
mod sdo;
mod sdo_block;

#[cfg(test)]
mod tests;

pub use motion::State;
pub use nmt::NmtState;
pub use settings::{PdoDefault, Settings};

use crate::can::{Frame, Station};
use node::Node;
use sdo::SdoServer;

/// An SDO download that was accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Write {
    /// The index.
    pub index: u16,
    /// The sub-index.
    pub sub: u8,
    /// The bytes.
    pub data: Vec<u8>,
}

/// An SDO transfer that was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// The index.
    pub index: u16,
    /// The sub-index.
    pub sub: u8,
    /// The abort code.
    pub code: u32,
}

/// A drive on the bus.
#[derive(Debug, Clone)]
pub struct CanDrive {
    node: Node,
    sdo: SdoServer,
}

impl CanDrive {
    /// A drive that gets power when it is first called.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self { node: Node::new(settings), sdo: SdoServer::default() }
    }

    /// How the drive is.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.node.s
    }

    /// Changes how the drive is. What makes the objects counts after a reset.
    pub fn settings_mut(&mut self) -> &mut Settings {
        &mut self.node.s
    }

    /// The state of the drive.
    #[must_use]
    pub fn state(&self) -> State {
        self.node.motion.state
    }

    /// The state of the node.
    #[must_use]
    pub fn nmt_state(&self) -> NmtState {
        self.node.nmt.state
    }

    /// The statusword.
    #[must_use]
    pub fn status(&self) -> u16 {
        self.node.motion.status(&self.node.od, &self.node.s)
    }

    /// The last controlword that was taken.
    #[must_use]
    pub fn control(&self) -> u16 {
        self.node.motion.word
    }

    /// The mode in force; 6061 may still show another.
    #[must_use]
    pub fn mode(&self) -> i8 {
        self.node.motion.modes.mode
    }

    /// Position in counts.
    #[must_use]
    pub fn position(&self) -> i64 {
        self.node.motion.axis.counts()
    }

    /// Velocity in counts per second.
    #[must_use]
    pub fn velocity(&self) -> i64 {
        axis::rounded(self.node.motion.axis.vel, axis::MICRO)
    }

    /// Torque of the motor in thousandths of rated torque.
    #[must_use]
    pub fn torque(&self) -> i64 {
        axis::rounded(self.node.motion.axis.torque, 1)
    }

    /// Whether the stage controls the motor.
    #[must_use]
    pub fn enabled(&self) -> bool {
        self.node.motion.enabled()
    }

    /// Starts so far, with or without boot-up message.
    #[must_use]
    pub fn boots(&self) -> u32 {
        self.node.nmt.boots
    }

    /// SDO downloads that were accepted.
    #[must_use]
    pub fn writes(&self) -> &[Write] {
        &self.node.writes
    }

    /// SDO transfers that were refused.
    #[must_use]
    pub fn refused(&self) -> &[Refusal] {
        &self.node.refused
    }

    /// What happened, with the time in microseconds.
    #[must_use]
    pub fn log(&self) -> &[(u64, String)] {
        &self.node.log
    }

    /// The bytes of an object, whatever its access.
    #[must_use]
    pub fn object(&self, index: u16, sub: u8) -> Option<&[u8]> {
        self.node.od.wire(index, sub).ok().map(|entry| entry.data.as_slice())
    }

    /// A fault comes up. With `reset_needs_mend` it cannot be reset until `mend`.
    pub fn fail(&mut self, code: u16) {
        let node = &mut self.node;
        node.motion.fail(code, &mut node.od, &node.s);
        node.motion.publish(&mut node.od, &node.s);
    }

    /// The cause of the fault goes.
    pub fn mend(&mut self) {
        self.node.motion.mend();
    }

    /// The mains come or go.
    pub fn set_mains(&mut self, on: bool) {
        self.node.motion.mains = on;
    }

    /// The safety input (safe torque off) comes or goes.
    pub fn set_safe(&mut self, on: bool) {
        let node = &mut self.node;
        node.motion.set_safe(on, &mut node.od, &node.s);
        node.motion.publish(&mut node.od, &node.s);
    }

    /// Something holds the axis, or lets it go.
    pub fn set_blocked(&mut self, on: bool) {
        self.node.motion.axis.blocked = on;
    }

    /// A torque against positive motion, thousandths of rated.
    pub fn set_load(&mut self, load: i64) {
        self.node.motion.axis.load = load;
    }

    /// Power goes and comes again.
    pub fn power_cycle(&mut self, now_us: u64, out: &mut Vec<Frame>) {
        self.node.power_on(now_us);
        self.tick(now_us, out);
    }

    fn end(&mut self, out: &mut Vec<Frame>) {
        if std::mem::take(&mut self.node.restarted) {
            self.sdo = SdoServer::default();
        }
        self.node.settle();
        self.node.flush(out);
    }
}

impl Station for CanDrive {
    fn hear(&mut self, now_us: u64, frame: &Frame, out: &mut Vec<Frame>) {
        let node = &mut self.node;
        node.advance(now_us);
        let own = u16::from(node.s.node_id & 0x7F);
        if node.nmt.state != NmtState::Initialising && frame.data.len() <= 8 {
            match frame.id {
                0 if !frame.remote => node.network_command(&frame.data),
                id if node.is_sync(id) && !frame.remote => node.sync(&frame.data),
                id if id == 0x600 + own && !frame.remote => {
                    if node.nmt.talks() {
                        let delay = node.s.sdo_delay_ms;
                        for answer in self.sdo.hear(&frame.data, node) {
                            node.say_later(delay, 0x580 + own, &answer);
                        }
                    }
                }
                id if id == 0x700 + own && frame.remote => {
                    if let Some(answer) = node.nmt.guard(now_us, &node.od) {
                        node.say_later(0, id, &[answer]);
                    }
                }
                id @ 0x701..=0x77F if !frame.remote => node.nmt.heartbeat_of(id - 0x700, now_us, &node.od),
                _ => node.process_data(frame),
            }
        }
        self.end(out);
    }

    fn tick(&mut self, now_us: u64, out: &mut Vec<Frame>) {
        self.node.advance(now_us);
        self.end(out);
    }
}
