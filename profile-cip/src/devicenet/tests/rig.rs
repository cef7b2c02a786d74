//! A DeviceNet in virtual time: a bus, and masters and slaves on it.

use arrayvec::ArrayString;
use core::fmt::Write as _;
use profile_generic::can::Frame;
use profile_generic::can::bus::{Bus, Disturbance, Effect, Output, State, Station};
use profile_generic::can::timing::BitRate;
use profile_generic::fault::FaultCause;
use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::io::Terminal;
use crate::device::config::{DEVICE_TYPE_CIP_MOTION_DRIVE, IdentityConfig};
use crate::devicenet::master::Master;
use crate::devicenet::master::config::{DataRate, MasterConfig, SlaveConfig as Planned};
use crate::devicenet::master::event::Event;
use crate::devicenet::master::station::Phase;
use crate::devicenet::slave::motion_drive::{MotionDrive, MotionDriveConfig};
use crate::devicenet::slave::speed_drive::{SpeedDrive, SpeedDriveConfig};
use crate::devicenet::slave::{Slave, SlaveConfig};
use crate::devicenet::wire::speed::Assembly;
use crate::devicenet::wire::{BodyFormat, Identifier, MacId};

pub const MASTER: MacId = mac(1);
pub const VENDOR: u16 = 0x0123;

pub const fn mac(number: u8) -> MacId {
    MacId::from_low_bits(number)
}

pub fn ms(millis: u64) -> MonotonicTime {
    MonotonicTime(millis * 1_000_000)
}

pub fn identity(number: u8) -> IdentityConfig {
    IdentityConfig {
        vendor: VENDOR,
        device_type: DEVICE_TYPE_CIP_MOTION_DRIVE,
        product_code: 42,
        major: 1,
        minor: 2,
        serial_number: 0xA000_0000 | u32::from(number),
        product_name: ArrayString::from("Axisbridge drive").unwrap(),
        configuration: 0,
    }
}

pub fn slave_config(number: u8) -> SlaveConfig {
    SlaveConfig {
        mac: mac(number),
        rate: 2,
        bus_off_reset: false,
        identity: identity(number),
        rate_resolution_ms: 1,
        body_format: BodyFormat::CLASS_8_INSTANCE_8,
    }
}

pub fn motion_drive() -> MotionDrive {
    let faults = vec![(FaultCause::OVER_CURRENT, 8)];
    MotionDrive::new(MotionDriveConfig { attributes: Vec::new(), faults, servo: ServoParameters::default() })
        .unwrap()
}

pub fn speed_drive(output: u8) -> SpeedDrive {
    let faults = vec![(FaultCause::OVER_CURRENT, 0x2310)];
    SpeedDrive::new(SpeedDriveConfig { output: Assembly(output), faults, servo: ServoParameters::default() })
        .unwrap()
}

/// What stands on the bus.
#[expect(clippy::large_enum_variant, reason = "a handful in a test")]
pub enum Node {
    Master(Master),
    Motion(Slave<MotionDrive>),
    Speed(Slave<SpeedDrive>),
    Terminal(Slave<Terminal>),
    /// Says nothing by itself, and hears nothing.
    Dumb,
}

impl Node {
    fn handle(&mut self, now: MonotonicTime, frame: &Frame) {
        // What is refused is an event as well.
        let _ = match self {
            Self::Master(node) => node.handle_frame(now, frame),
            Self::Motion(node) => node.handle_frame(now, frame),
            Self::Speed(node) => node.handle_frame(now, frame),
            Self::Terminal(node) => node.handle_frame(now, frame),
            Self::Dumb => Ok(()),
        };
    }

    fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        match self {
            Self::Master(node) => node.poll(now),
            Self::Motion(node) => node.poll(now),
            Self::Speed(node) => node.poll(now),
            Self::Terminal(node) => node.poll(now),
            Self::Dumb => None,
        }
    }

    fn wake_at(&self) -> Option<MonotonicTime> {
        match self {
            Self::Master(node) => node.wake_at(),
            Self::Motion(node) => node.wake_at(),
            Self::Speed(node) => node.wake_at(),
            Self::Terminal(node) => node.wake_at(),
            Self::Dumb => None,
        }
    }
}

pub struct Net {
    pub bus: Bus,
    pub now: MonotonicTime,
    nodes: Vec<Node>,
    stations: Vec<Station>,
    /// Frames that have gone out, if they are kept.
    pub trace: Option<Vec<(MonotonicTime, Frame)>>,
    /// Events of master and slaves: when, whose (0 the master), what.
    pub log: Vec<(MonotonicTime, u8, String)>,
    pub events: Vec<Event>,
}

impl Net {
    pub fn new() -> Self {
        let mut bus = Bus::new(BitRate::classic(500_000).unwrap());
        for number in 0..64 {
            bus.share(Identifier::DuplicateMacCheck(mac(number)).can());
        }
        Self {
            bus,
            now: ms(1),
            nodes: Vec::new(),
            stations: Vec::new(),
            trace: None,
            log: Vec::new(),
            events: Vec::new(),
        }
    }

    /// A node; it is started.
    pub fn add(&mut self, mut node: Node) -> usize {
        let now = self.now;
        match &mut node {
            Node::Master(node) => node.start(now),
            Node::Motion(node) => node.start(now),
            Node::Speed(node) => node.start(now),
            Node::Terminal(node) => node.start(now),
            Node::Dumb => {}
        }
        self.nodes.push(node);
        self.stations.push(self.bus.add(64).unwrap());
        self.nodes.len() - 1
    }

    /// A master of these slaves and those slaves, all started in the same instant.
    pub fn with(slaves: Vec<(Planned, Node)>) -> Self {
        Self::configured(|_| {}, slaves)
    }

    pub fn configured(set: impl FnOnce(&mut MasterConfig), slaves: Vec<(Planned, Node)>) -> Self {
        let mut net = Self::new();
        let mut config = master_config();
        config.slaves = slaves.iter().map(|(planned, _)| planned.clone()).collect();
        set(&mut config);
        net.add(Node::Master(Master::new(config).unwrap()));
        for (_, node) in slaves {
            net.add(node);
        }
        net
    }

    pub fn station(&self, node: usize) -> Station {
        self.stations[node]
    }

    pub fn master(&mut self) -> &mut Master {
        match &mut self.nodes[0] {
            Node::Master(master) => master,
            _ => panic!("node 0 is the master"),
        }
    }

    pub fn motion(&mut self, node: usize) -> &mut Slave<MotionDrive> {
        match &mut self.nodes[node] {
            Node::Motion(slave) => slave,
            _ => panic!("no motion drive"),
        }
    }

    pub fn speed(&mut self, node: usize) -> &mut Slave<SpeedDrive> {
        match &mut self.nodes[node] {
            Node::Speed(slave) => slave,
            _ => panic!("no speed drive"),
        }
    }

    pub fn terminal(&mut self, node: usize) -> &mut Slave<Terminal> {
        match &mut self.nodes[node] {
            Node::Terminal(slave) => slave,
            _ => panic!("no terminal"),
        }
    }

    /// Puts a frame on the bus as `node`, whatever the node thinks.
    pub fn inject(&mut self, node: usize, identifier: Identifier, data: &[u8]) {
        let frame = Frame::new(identifier.can(), data).unwrap();
        self.bus.send(self.now, self.stations[node], &frame).unwrap();
    }

    pub fn disturb(&mut self, effect: Effect, shape: impl FnOnce(Disturbance) -> Disturbance) {
        assert!(self.bus.disturb(shape(Disturbance::all(effect))));
    }

    /// Pulls the plug of a node, or puts it back.
    pub fn plug(&mut self, node: usize, connected: bool) {
        let (now, station) = (self.now, self.stations[node]);
        if connected { self.bus.connect(now, station) } else { self.bus.disconnect(now, station) }
    }

    fn drain(&mut self) {
        for (place, (node, station)) in self.nodes.iter_mut().zip(&self.stations).enumerate() {
            while let Some(frame) = node.poll(self.now) {
                // A node without cable talks to itself.
                let sent = self.bus.send(self.now, *station, &frame);
                assert!(sent.is_ok() || !matches!(sent, Err(profile_generic::can::bus::SendError::Full)));
            }
            let who = u8::try_from(place).unwrap();
            let now = self.now;
            match node {
                Node::Master(node) => {
                    while let Some(event) = node.poll_event() {
                        self.log.push((now, who, event.to_string()));
                        self.events.push(event);
                    }
                }
                Node::Motion(node) => {
                    while let Some(event) = node.poll_event() {
                        self.log.push((now, who, event.to_string()));
                    }
                }
                Node::Speed(node) => {
                    while let Some(event) = node.poll_event() {
                        self.log.push((now, who, event.to_string()));
                    }
                }
                Node::Terminal(node) => {
                    while let Some(event) = node.poll_event() {
                        self.log.push((now, who, event.to_string()));
                    }
                }
                Node::Dumb => {}
            }
        }
    }

    fn deliver(&mut self) {
        while let Some(output) = self.bus.poll(self.now) {
            match output {
                Output::Received { to, frame, .. } => self.nodes[to.index()].handle(self.now, &frame),
                Output::Sent { at, frame, .. } => {
                    if let Some(trace) = &mut self.trace {
                        trace.push((at, frame));
                    }
                }
                Output::State { station, state: State::BusOff, .. } => {
                    match &mut self.nodes[station.index()] {
                        Node::Master(node) => node.handle_bus_off(self.now),
                        Node::Motion(node) => node.handle_bus_off(self.now),
                        Node::Speed(node) => node.handle_bus_off(self.now),
                        Node::Terminal(node) => node.handle_bus_off(self.now),
                        Node::Dumb => {}
                    }
                }
                Output::State { .. } => {}
            }
        }
    }

    /// Lets time pass; `each` is called at every instant at which something happens.
    pub fn run_with(&mut self, until: MonotonicTime, mut each: impl FnMut(&mut Self)) {
        let mut stuck = 0;
        while self.now < until {
            self.deliver();
            each(self);
            self.drain();
            let nodes = self.nodes.iter().filter_map(Node::wake_at);
            let next = nodes.chain(self.bus.wake_at()).min().unwrap_or(until).min(until);
            stuck = if next <= self.now { stuck + 1 } else { 0 };
            assert!(stuck < 1000, "somebody wants to be called for ever at {}", self.now);
            self.now = self.now.max(next);
        }
        self.deliver();
        self.drain();
    }

    pub fn run(&mut self, until: MonotonicTime) {
        self.run_with(until, |_| {});
    }

    pub fn run_for(&mut self, millis: i64) {
        let until = self.now + DurationNs::from_millis(millis);
        self.run(until);
    }

    /// Until every slave of the master is exchanged with.
    pub fn exchange(&mut self) {
        let slaves: Vec<MacId> = self.master().config().slaves.iter().map(|slave| slave.mac).collect();
        let limit = self.now + DurationNs::from_secs(10);
        while slaves.iter().any(|slave| self.master().phase(*slave) != Some(Phase::Exchange)) {
            assert!(self.now < limit, "{}", self.text());
            self.run_for(1);
        }
    }

    /// The log as text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (at, who, what) in &self.log {
            let millis = at.0 / 1_000_000;
            let name = if *who == 0 { "master".to_owned() } else { format!("node {who}") };
            writeln!(text, "{millis:6} ms {name}: {what}").unwrap();
        }
        text
    }

    pub fn said(&self, who: u8, what: &str) -> bool {
        self.log.iter().any(|(_, by, text)| *by == who && text.contains(what))
    }
}

pub fn master_config() -> MasterConfig {
    MasterConfig::new(MASTER, 0x0456, 77, DataRate::Rate500, DurationNs::from_millis(10))
}

/// A CIP Motion drive at the master's cycle.
pub fn motion(number: u8) -> (Planned, Node) {
    (Planned::polled(mac(number), 16, 16, 10), Node::Motion(Slave::new(slave_config(number), motion_drive())))
}

pub fn speed(number: u8, output: u8) -> (Planned, Node) {
    let len = Assembly(output).buffer_len();
    let slave = Slave::new(slave_config(number), speed_drive(output));
    (Planned::polled(mac(number), len, len, 50), Node::Speed(slave))
}

/// The refusals in a slave's or the master's log.
pub fn refusals(net: &Net, who: u8) -> Vec<String> {
    let refused = net.log.iter().filter(|(_, by, text)| *by == who && text.starts_with("frame refused"));
    refused.map(|(_, _, text)| text.clone()).collect()
}
