//! Drives of the crate `axisbridge-peers` on the buses of the rig: somebody else's work, in place of the simulated drives.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use axisbridge::simulate::can_bus::{CanNode, InProcessCan};
use axisbridge_peers::can::{self, Station};
use axisbridge_peers::sercos_slave::SercosSlave;
use profile_generic::can::bus::Bus;
use profile_generic::can::timing::BitRate;
use profile_generic::can::{Frame, Id};
use profile_generic::time::{DurationNs, MonotonicTime};
use profile_sercos::checker::bus::{Arrived, Stations, Watch};
use profile_sercos::master::event::Port;
use profile_sercos::slave::STRANGER;

use super::ports::CanWire;

/// How often a station is given time.
const TICK: DurationNs = DurationNs::from_micros(250);

/// A station, of which a test keeps another handle.
pub type Shared = Rc<RefCell<dyn Station>>;

/// A station on the bus of the rig.
pub struct Foreign {
    station: Shared,
    out: VecDeque<Frame>,
    next: MonotonicTime,
}

impl Foreign {
    fn act(&mut self, act: impl FnOnce(&mut dyn Station, &mut Vec<can::Frame>)) {
        let mut said = Vec::new();
        act(&mut *self.station.borrow_mut(), &mut said);
        let frame = |frame: can::Frame| {
            let id = Id::Standard(frame.id);
            match frame.remote {
                true => Frame::remote(id, 0),
                false => Frame::new(id, &frame.data),
            }
            .expect("a frame of CAN")
        };
        self.out.extend(said.into_iter().map(frame));
    }
}

impl CanNode for Foreign {
    fn start(&mut self, now: MonotonicTime) {
        self.handle_time(now);
    }

    fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) {
        let Id::Standard(id) = frame.id() else { return };
        let heard = can::Frame { id, remote: frame.is_remote(), data: frame.data().to_vec() };
        self.act(|station, out| station.hear(now.0 / 1000, &heard, out));
    }

    fn handle_time(&mut self, now: MonotonicTime) {
        if now >= self.next {
            self.next = now + TICK;
            self.act(|station, out| station.tick(now.0 / 1000, out));
        }
    }

    fn poll(&mut self, _now: MonotonicTime) -> Option<Frame> {
        self.out.pop_front()
    }

    fn wake_at(&self) -> MonotonicTime {
        self.next
    }

    fn bus_off(&mut self, _now: MonotonicTime) {}
}

/// A bus with these stations. `shared` are identifiers that several stations may send at the same time.
pub fn wire(rate: BitRate, stations: Vec<Shared>, shared: &[Id]) -> CanWire<Foreign> {
    let mut bus = Bus::new(rate);
    shared.iter().for_each(|id| bus.share(*id));
    let foreign = |station| Foreign { station, out: VecDeque::new(), next: MonotonicTime::ZERO };
    CanWire::new(InProcessCan::new(bus, stations.into_iter().map(foreign).collect(), None))
}

/// A SERCOS slave, of which a test keeps another handle.
pub type SharedSlave = Rc<RefCell<SercosSlave>>;

/// SERCOS slaves one behind the other on port 1 of the master.
pub struct ForeignLine {
    slaves: Vec<SharedSlave>,
}

impl ForeignLine {
    /// A line; the nearest to the master first.
    #[must_use]
    pub fn new(slaves: Vec<SharedSlave>) -> Self {
        let last = slaves.len().saturating_sub(1);
        for (place, slave) in slaves.iter().enumerate() {
            slave.borrow_mut().set_neighbour(1, true);
            slave.borrow_mut().set_neighbour(2, place < last);
        }
        Self { slaves }
    }
}

impl Stations for ForeignLine {
    fn handle_time(&mut self, now: MonotonicTime) {
        self.slaves.iter().for_each(|slave| slave.borrow_mut().tick(now.0));
    }

    fn pass(
        &mut self,
        now: MonotonicTime,
        port: Port,
        frame: &mut [u8],
        watch: &mut Watch<'_>,
        arrived: &mut Arrived<'_>,
    ) {
        if port != Port::One {
            return;
        }
        // Where copies of the frame come in: at which slave, by which of its ports.
        let mut on_their_way = vec![(0, 1, frame.to_vec())];
        while let Some((place, port, mut frame)) = on_their_way.pop() {
            let Some(slave) = self.slaves.get(place) else { continue };
            let before = frame.clone();
            let leaves = slave.borrow_mut().pass(now.0, port, &mut frame);
            let slave = slave.borrow();
            let number = slave.topology_address().filter(|address| *address > 0);
            let stranger = STRANGER + u16::try_from(place).unwrap_or(0);
            watch(number.unwrap_or(stranger), port == 1, &before, &mut frame);
            let copy = slave.copy_port();
            for port in [copy, leaves].into_iter().flatten() {
                match (port, place) {
                    (1, 0) => arrived(Port::One, &mut frame.clone()),
                    (1, _) => on_their_way.push((place - 1, 2, frame.clone())),
                    _ => on_their_way.push((place + 1, 1, frame.clone())),
                }
            }
        }
    }
}
