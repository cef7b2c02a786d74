//! Measuring the delays once more in CP4, where the telegrams take another way than when it was done last: a network
//! that came up with an open ring and is closed, or in which slaves have come in.

use super::event::Event;
use super::network::Network;
use super::plan;
use super::station::{Station, Work};
use crate::wire::header::Phase;
use crate::wire::scp::ScpClass;

/// Whether the delays have to be measured, and are being measured.
#[derive(Debug, Default)]
pub(super) struct Measuring {
    wanted: bool,
    running: bool,
    /// The delays are those of a closed ring with the slaves that there are.
    ring: bool,
}

impl Measuring {
    /// CP4 begins; the delays were measured in CP2.
    pub fn start(&mut self, ring: bool) {
        *self = Measuring { ring, ..Measuring::default() };
    }

    /// The ring is closed.
    pub fn ring_closed(&mut self) {
        self.wanted = !core::mem::replace(&mut self.ring, true);
    }

    /// A slave has come in.
    pub fn joined(&mut self) {
        self.ring = false;
    }
}

/// A slave whose delay counts.
fn measures(station: &Station) -> bool {
    station.is_active() && station.facts.version(ScpClass::SYNC).is_some()
}

impl Measuring {
    /// One cycle of measuring, if there is something to measure. All slaves at the same time.
    pub fn step(&mut self, net: &mut Network) {
        if core::mem::take(&mut self.wanted) {
            self.running = true;
            for index in 0..net.stations.len() {
                if measures(&net.stations[index]) {
                    net.begin_steps(index);
                }
            }
        }
        if !self.running {
            return;
        }
        let (mut pending, mut done) = (false, 0);
        for index in 0..net.stations.len() {
            if measures(&net.stations[index]) {
                match net.work_on(index, plan::MEASURE_AGAIN, Phase::CP4) {
                    Work::Free | Work::Asked(..) => pending = true,
                    Work::Done => done += 1,
                    Work::Failed => {}
                }
            }
        }
        if !pending {
            self.running = false;
            net.emit(Event::Measured { slaves: done });
        }
    }
}
