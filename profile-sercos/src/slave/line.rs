//! Slaves joined to a line in one process.

use profile_generic::time::MonotonicTime;

use super::{Application, Forward, Port, Slave};

/// Slaves one behind the other. A frame goes out through all of them, turns round at the last one and comes
/// back.
#[derive(Debug)]
pub struct Line<A> {
    slaves: Vec<Slave<A>>,
}

impl<A: Application> Line<A> {
    /// Joins slaves; the first one is next to the master.
    pub fn new(slaves: Vec<Slave<A>>) -> Self {
        let mut line = Line { slaves };
        line.cut_behind(usize::MAX);
        line
    }

    /// The slaves, nearest to the master first.
    pub fn slaves(&self) -> &[Slave<A>] {
        &self.slaves
    }

    /// The slaves, to act on them from outside.
    pub fn slaves_mut(&mut self) -> &mut [Slave<A>] {
        &mut self.slaves
    }

    /// Cuts the line behind so many slaves; frames turn round there. A number beyond the last slave mends it.
    pub fn cut_behind(&mut self, count: usize) {
        let len = self.slaves.len();
        for (index, slave) in self.slaves.iter_mut().enumerate() {
            slave.set_link(Port::One, index != count);
            slave.set_link(Port::Two, index + 1 != count && index + 1 != len);
        }
    }

    /// When [`handle_time`](Self::handle_time) has something to do unless a frame comes before; `None` without
    /// slaves.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.slaves.iter().map(Slave::wake_at).min()
    }

    /// Looks after the time-outs of all slaves.
    pub fn handle_time(&mut self, now: MonotonicTime) {
        for slave in &mut self.slaves {
            slave.handle_time(now);
        }
    }

    /// Sends a frame through the line. It is changed as the slaves change it. Returns whether it comes back.
    pub fn handle_frame(&mut self, now: MonotonicTime, frame: &mut [u8]) -> bool {
        let mut turned = None;
        for (index, slave) in self.slaves.iter_mut().enumerate() {
            match slave.handle_frame(now, Port::One, frame) {
                Forward::Through => {}
                Forward::Back | Forward::BackAndThrough => {
                    turned = Some(index);
                    break;
                }
            }
        }
        let Some(last) = turned else { return false };
        for slave in self.slaves[..last].iter_mut().rev() {
            slave.handle_frame(now, Port::Two, frame);
        }
        true
    }
}
