//! The master with devices that do little but what it asks, and with devices that misbehave.

mod bad_input;
mod boot_up;
mod cyclic;
mod foreign;
mod guarding;
mod peer;
mod program;

use std::collections::BTreeMap;

use profile_generic::can::{Frame, Id};

use self::peer::Device;
use super::boot::{BootState, BootStatus};
use super::config::*;
use super::event::*;
use super::pdo_set::PdoSet;
use super::*;
use crate::sdo::request::{SdoData, SdoFailure};
use crate::wire::pdo::{MappingEntry, TransmissionType};
use crate::wire::{AbortCode, CobId, Mux};

const STATUSWORD: MappingEntry = MappingEntry(0x6041_0010);
const POSITION: MappingEntry = MappingEntry(0x6064_0020);
const CONTROLWORD: MappingEntry = MappingEntry(0x6040_0010);
const TARGET: MappingEntry = MappingEntry(0x607A_0020);

fn id(number: u8) -> NodeId {
    NodeId::new(number).unwrap()
}

fn ms(milliseconds: u64) -> MonotonicTime {
    MonotonicTime(milliseconds * 1_000_000)
}

/// A servo drive with one PDO each way, as the tests have it.
fn drive(number: u8) -> NodeConfig {
    NodeConfig {
        expected: Expected { device_type: Some(0x0002_0192), vendor: Some(0x319), ..Expected::default() },
        heartbeat: Some(HeartbeatConfig { producer_ms: 50, timeout_ms: 150 }),
        rpdos: vec![PdoConfig::cyclic(1, vec![CONTROLWORD, TARGET])],
        tpdos: vec![PdoConfig::cyclic(1, vec![STATUSWORD, POSITION])],
        ..NodeConfig::new(id(number))
    }
}

/// A network of such drives at 4 ms.
fn network(drives: u8) -> MasterConfig {
    MasterConfig {
        nodes: (1..=drives).map(drive).collect(),
        sync: Some(SyncConfig { period_ns: 4_000_000, window_ns: 0, counter_overflow: 0 }),
        heartbeat: Some(MasterHeartbeat { node: id(127), producer_ms: 100, timeout_ms: 300 }),
        listens: false,
        ..MasterConfig::default()
    }
}

/// Master and devices on one bus without delay, in virtual time.
struct Rig {
    master: Master,
    devices: Vec<Device>,
    now: MonotonicTime,
    log: Vec<Event>,
    /// Frames of the master, with their times.
    sent: Vec<(MonotonicTime, Frame)>,
    /// Calls `node_ready` by itself.
    auto: bool,
    /// Commits every RPDO in every period.
    cyclic: bool,
    /// Whether a frame of a device arrives.
    arrives: Box<dyn FnMut(&Frame) -> bool>,
    /// Devices that must not notice anything.
    kept: Vec<Kept>,
    /// Periods in which that was looked at.
    watched: usize,
}

/// A device that exchanges PDOs in every period, whatever the others do.
struct Kept {
    /// Among the devices of the rig.
    place: usize,
    number: u8,
    syncs: usize,
    received: usize,
}

fn rig(config: MasterConfig) -> Rig {
    let devices = config.nodes.iter().map(|node| Device::new(node.node)).collect();
    Rig {
        master: Master::new(config).unwrap(),
        devices,
        now: ms(1),
        log: vec![],
        sent: vec![],
        auto: true,
        cyclic: true,
        arrives: Box::new(|_| true),
        kept: vec![],
        watched: 0,
    }
}

/// Two drives, of which the second one is in operation and must stay so while the first one, which was not there yet, comes with
/// what is done to it here.
fn beside(config: MasterConfig, misdeed: impl FnOnce(&mut Device)) -> Rig {
    let mut rig = rig(config);
    rig.device(1).dead = true;
    rig.master.start(rig.now);
    rig.comes_up(&[2]);
    rig.keep(&[2]);
    rig.forget();
    let now = rig.now;
    let device = rig.device(1);
    device.dead = false;
    misdeed(device);
    device.reset(now);
    rig
}

/// A network whose drives are in operation, and the log empty.
fn running(drives: u8) -> Rig {
    let mut rig = rig(network(drives));
    rig.master.start(rig.now);
    rig.until("operation", |rig| rig.saw(&Event::NetworkOperational));
    rig.run_ms(40);
    rig.forget();
    rig
}

impl Rig {
    fn forget(&mut self) {
        self.log.clear();
        self.sent.clear();
    }

    fn device(&mut self, number: u8) -> &mut Device {
        self.devices.iter_mut().find(|device| device.node == id(number)).unwrap()
    }

    fn state(&self, number: u8) -> BootState {
        self.master.node(id(number)).unwrap().state
    }

    fn saw(&self, event: &Event) -> bool {
        self.log.contains(event)
    }

    fn count(&self, which: impl Fn(&Event) -> bool) -> usize {
        self.log.iter().filter(|event| which(event)).count()
    }

    /// Status and failed step of the last device that did not come up.
    fn failed(&self) -> (BootStatus, String) {
        let failed = self.log.iter().rev().find_map(|event| match event {
            Event::BootFailed { status: Some(status), step, .. } => Some((*status, *step)),
            _ => None,
        });
        let (status, step) = failed.expect("a failure");
        (status, step.map(|row| row.to_string()).unwrap_or_default())
    }

    /// Hands frames of devices to the master, and its own to the devices, until nobody has anything to say at this time.
    fn settle(&mut self) {
        for _ in 0..10_000 {
            let mut moved = false;
            for place in 0..self.devices.len() {
                while let Some(frame) = self.devices[place].poll(self.now) {
                    moved = true;
                    if (self.arrives)(&frame) {
                        let _ = self.master.handle_frame(self.now, &frame);
                    }
                }
            }
            if self.master.wake_at().is_some_and(|at| self.now >= at) {
                let sync = self.master.next_sync().is_some_and(|at| self.now >= at);
                if sync {
                    self.watch();
                }
                if sync && self.cyclic {
                    self.commit();
                }
                while let Some(Output::Transmit(frame)) = self.master.poll(self.now) {
                    moved = true;
                    self.sent.push((self.now, frame));
                    for device in &mut self.devices {
                        device.handle(self.now, &frame);
                    }
                }
            }
            while let Some(event) = self.master.poll_event() {
                if let (Event::AwaitingApplication { node, .. }, true) = (&event, self.auto) {
                    self.master.node_ready(*node).unwrap();
                    moved = true;
                }
                self.log.push(event);
            }
            if !moved {
                return;
            }
        }
        panic!("the network does not come to rest at {}", self.now);
    }

    /// From now on these devices must not notice anything.
    fn keep(&mut self, numbers: &[u8]) {
        for &number in numbers {
            let place = self.devices.iter().position(|device| device.node == id(number)).unwrap();
            let device = &self.devices[place];
            let (syncs, received) = (device.syncs.len(), device.received.len());
            self.kept.push(Kept { place, number, syncs, received });
        }
    }

    /// Before each SYNC: what was sent and received in the period before.
    fn watch(&mut self) {
        for kept in &self.kept {
            let (number, device) = (kept.number, &self.devices[kept.place]);
            assert_eq!(self.state(number), BootState::Operational, "node {number} at {}", self.now);
            let consumer = self.master.consumer(id(number), 1).unwrap();
            let seen = (consumer.state, consumer.fresh, consumer.missed);
            assert_eq!(
                seen,
                (ConsumerState::Good, true, 0),
                "node {number} at {}: {:#?}",
                self.now,
                self.log
            );
            let (syncs, received) = (device.syncs.len() - kept.syncs, device.received.len() - kept.received);
            assert_eq!(syncs, received, "RPDOs of node {number} at {}", self.now);
            self.watched += 1;
        }
    }

    /// The devices that were to be kept have not noticed anything: told by every period so far, and ten more.
    fn kept(&mut self) {
        let before = self.watched;
        self.run_ms(40);
        assert!(self.watched - before >= 9 * self.kept.len() && !self.kept.is_empty());
    }

    fn commit(&mut self) {
        let pdos: Vec<_> = self.master.config().nodes.iter().map(|node| node.node).collect();
        for node in pdos {
            if let Some(data) = self.master.producer(node, 1) {
                data[0] = data[0].wrapping_add(1);
                self.master.commit(node, 1);
            }
        }
    }

    /// Goes to the next time at which something happens, at most `until`.
    fn step(&mut self, until: MonotonicTime) {
        self.settle();
        let devices = self.devices.iter().filter_map(Device::wake_at);
        let next = devices.chain(self.master.wake_at()).min().unwrap_or(until);
        self.now = next.max(MonotonicTime(self.now.0 + 1)).min(until);
    }

    fn run_ms(&mut self, milliseconds: u64) {
        let until = MonotonicTime(self.now.0 + milliseconds * 1_000_000);
        while self.now < until {
            self.step(until);
        }
        self.settle();
    }

    fn until(&mut self, what: &str, done: impl Fn(&Self) -> bool) {
        let end = MonotonicTime(self.now.0 + 60_000_000_000);
        while !done(self) {
            assert!(self.now < end, "no {what} within a minute: {:#?}", self.log);
            self.step(end);
            self.settle();
        }
    }

    /// The master takes a frame from somebody.
    fn hear(&mut self, id: Id, data: &[u8]) -> Result<(), Refusal> {
        let frame = Frame::new(id, data).unwrap();
        let taken = self.master.handle_frame(self.now, &frame);
        self.settle();
        taken
    }

    /// These devices come into operation, and then do what [`Rig::runs`] says.
    fn comes_up(&mut self, numbers: &[u8]) {
        let up = |rig: &Self| numbers.iter().all(|&number| rig.state(number) == BootState::Operational);
        self.until("operation", up);
        self.run_ms(20);
        self.runs(numbers);
    }

    /// These devices are in operation and exchange PDOs.
    fn runs(&mut self, numbers: &[u8]) {
        let before: BTreeMap<u8, usize> =
            numbers.iter().map(|&number| (number, self.device(number).received.len())).collect();
        self.run_ms(40);
        for &number in numbers {
            assert_eq!(self.state(number), BootState::Operational, "node {number}");
            let consumer = self.master.consumer(id(number), 1).unwrap();
            assert_eq!((consumer.state, consumer.missed), (ConsumerState::Good, 0), "node {number}");
            let received = self.device(number).received.len() - before[&number];
            assert!((9..=11).contains(&received), "node {number} received {received}");
        }
    }
}
