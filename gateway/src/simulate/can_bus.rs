//! Simulated drives inside this process, of CANopen or of DeviceNet, on a bus that takes as long for each frame as its bits do.
//!
//! Whenever the box looks at its port, everything happens on the bus that has happened up to then: arbitration, frames in
//! both directions, and what the drives say to them.

use std::collections::VecDeque;

use profile_cia402::drive::ErrorCode;
use profile_cip::devicenet::wire::{Identifier, MacId};
use profile_generic::can::Frame;
use profile_generic::can::bus::{Bus, Output, QUEUE_DEFAULT, SendError, State, Station};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::can_drive::{DriveNode, stand_in};
use super::devicenet_drive::{self, DevicenetNode};
use crate::capture::recorder::Tap;
use crate::config::{Can, Devicenet};
use crate::engine::port::{CanInput, CanPort, CanSent};
use crate::sys::clock;

/// Frames and events for the box that it has not taken yet: more than a bus carries between two calls.
const INBOUND_MAX: usize = 1024;

/// Cycles without a SYNC that a drive stands in any case.
const SYNC_CYCLES: u16 = 3;

/// Frames that the box's transmit queue holds.
const QUEUE: usize = 64;

/// A node of a simulated bus.
pub trait CanNode {
    /// It is switched on.
    fn start(&mut self, now: MonotonicTime);

    /// Takes a frame from the bus.
    fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame);

    /// Lets time pass.
    fn handle_time(&mut self, now: MonotonicTime);

    /// The next frame that it sends.
    fn poll(&mut self, now: MonotonicTime) -> Option<Frame>;

    /// When it has something to do by itself.
    fn wake_at(&self) -> MonotonicTime;

    /// Its controller is off the bus.
    fn bus_off(&mut self, now: MonotonicTime);

    /// Its controller is on the bus again.
    fn bus_on(&mut self) {}

    /// Frames for it were lost because there was no room for them.
    fn overrun(&mut self) {}
}

impl CanNode for DriveNode {
    fn start(&mut self, _now: MonotonicTime) {}

    fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) {
        self.handle_frame(now, frame);
    }

    fn handle_time(&mut self, now: MonotonicTime) {
        self.handle_time(now);
    }

    fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        self.poll(now)
    }

    fn wake_at(&self) -> MonotonicTime {
        self.wake_at()
    }

    fn bus_off(&mut self, _now: MonotonicTime) {
        self.bus_off();
    }

    fn bus_on(&mut self) {
        self.report_controller(ErrorCode::RECOVERED_FROM_BUS_OFF, true);
        self.report_controller(ErrorCode::RECOVERED_FROM_BUS_OFF, false);
    }

    fn overrun(&mut self) {
        self.report_controller(ErrorCode::CAN_OVERRUN, true);
    }
}

/// The bus as the box sees it.
#[derive(Debug)]
pub struct InProcessCan<N = DriveNode> {
    bus: Bus,
    own: Station,
    nodes: Vec<(Station, N)>,
    inbound: VecDeque<CanInput>,
    /// Up to when everything has happened.
    reached: MonotonicTime,
    pauses: Option<Pauses>,
    /// The recording, and the number of the bus in it.
    tap: Option<(Tap, u8)>,
}

/// Host time in which nothing can have happened on the bus.
#[derive(Debug)]
struct Pauses {
    cycle: DurationNs,
    /// The last look at the port.
    looked: MonotonicTime,
    /// How much the bus is behind the host.
    sum: DurationNs,
}

impl Pauses {
    /// Bus time of a look at the port. Who looks each cycle, and then not for two, was paused for one of them or more.
    fn bus_time(&mut self, now: MonotonicTime) -> MonotonicTime {
        let gap = now.since(self.looked);
        if self.looked != MonotonicTime::ZERO && gap > self.cycle * 2 {
            self.sum = self.sum + (gap - self.cycle);
        }
        self.looked = self.looked.max(now);
        now + -self.sum
    }
}

impl InProcessCan {
    /// The devices of a configuration, each with as many axes as it names.
    ///
    /// # Panics
    /// Never with a checked configuration: a device has 1 to 8 axes.
    #[must_use]
    pub fn of(config: &Can, tap: Option<(Tap, u8)>) -> Self {
        let mut devices: Vec<(profile_cia402::wire::NodeId, u8)> = Vec::new();
        for known in &config.drives {
            let axes = u8::try_from(known.axis + 1).unwrap_or(u8::MAX);
            match devices.iter_mut().find(|(node, _)| *node == known.node) {
                Some((_, most)) => *most = (*most).max(axes),
                None => devices.push((known.node, axes)),
            }
        }
        let devices = devices.into_iter().map(|(node, axes)| {
            let mut drive = stand_in(node, axes, config.device(node)).expect("1 to 8 axes");
            // A drive misses as many SYNCs as the gateway may miss of its telegrams.
            drive.set_sync_cycles(config.allowed_losses.max(SYNC_CYCLES));
            drive
        });
        Self::new(Bus::new(config.bit_rate), devices.collect(), tap)
    }
}

impl InProcessCan<DevicenetNode> {
    /// The drives of a DeviceNet network.
    ///
    /// # Panics
    /// Never with a checked configuration.
    #[must_use]
    pub fn of_devicenet(config: &Devicenet, tap: Option<(Tap, u8)>) -> Self {
        let mut bus = Bus::new(config.bit_rate());
        for mac in (0..).map_while(MacId::new) {
            // Whoever asks whether a MAC ID is free uses the identifier of that MAC ID.
            bus.share(Identifier::DuplicateMacCheck(mac).can());
        }
        let drives = config.drives.iter().map(|drive| devicenet_drive::drive(config, drive));
        Self::new(bus, drives.collect(), tap)
    }
}

impl<N: CanNode> InProcessCan<N> {
    /// A bus with these devices.
    ///
    /// # Panics
    /// With more devices than a bus has room for.
    #[must_use]
    pub fn new(mut bus: Bus, devices: Vec<N>, tap: Option<(Tap, u8)>) -> Self {
        let own = bus.add(QUEUE).expect("an empty bus has room");
        let mut station = || bus.add(QUEUE_DEFAULT).expect("a bus has room for all its node-ids");
        let nodes = devices.into_iter().map(|device| (station(), device)).collect();
        let inbound = VecDeque::with_capacity(INBOUND_MAX);
        Self { bus, own, nodes, inbound, reached: MonotonicTime::ZERO, pauses: None, tap }
    }

    /// The same in the time of a host, which may pause, at this cycle of the box.
    #[must_use]
    pub fn in_host_time(self, cycle: DurationNs) -> Self {
        let pauses = Pauses { cycle, looked: MonotonicTime::ZERO, sum: DurationNs::ZERO };
        Self { pauses: Some(pauses), ..self }
    }

    fn bus_time(&mut self, now: MonotonicTime) -> MonotonicTime {
        self.pauses.as_mut().map_or(now, |pauses| pauses.bus_time(now))
    }

    /// The devices, in the order in which they were given.
    pub fn nodes(&self) -> impl Iterator<Item = &N> {
        self.nodes.iter().map(|(_, node)| node)
    }

    /// The same, to act on them from outside.
    pub fn nodes_mut(&mut self) -> impl Iterator<Item = &mut N> {
        self.nodes.iter_mut().map(|(_, node)| node)
    }

    /// The bus in virtual time below the nodes.
    #[must_use]
    pub fn bus(&self) -> &Bus {
        &self.bus
    }

    /// The bus, to look at it or to disturb it.
    pub fn bus_mut(&mut self) -> &mut Bus {
        &mut self.bus
    }

    /// The station of the box.
    #[must_use]
    pub fn own_station(&self) -> Station {
        self.own
    }

    /// The station of a device.
    #[must_use]
    pub fn station(&self, device: usize) -> Station {
        self.nodes[device].0
    }

    /// Puts another device on the bus, behind all others.
    ///
    /// # Panics
    /// When the bus has no room for it.
    pub fn add(&mut self, device: N) {
        let station = self.bus.add(QUEUE_DEFAULT).expect("the bus has room for another station");
        self.nodes.push((station, device));
    }

    /// Pulls or plugs the cable of a device.
    pub fn connect(&mut self, now: MonotonicTime, device: usize, connected: bool) {
        let now = self.bus_time(now);
        let (station, _) = &self.nodes[device];
        if connected {
            self.bus.connect(now, *station);
        } else {
            self.bus.disconnect(now, *station);
        }
    }

    /// Lets everything happen up to `now`.
    pub fn advance(&mut self, now: MonotonicTime) {
        if self.reached == MonotonicTime::ZERO {
            // Nobody was there before the first look.
            self.reached = now;
            self.nodes.iter_mut().for_each(|(_, node)| node.start(now));
        }
        loop {
            self.happen();
            let nodes = self.nodes.iter().map(|(_, node)| node.wake_at());
            let next = nodes.chain(self.bus.wake_at()).min().unwrap_or(MonotonicTime::MAX);
            if next > now {
                break;
            }
            self.reached = next.max(self.reached);
            for (_, node) in &mut self.nodes {
                node.handle_time(self.reached);
            }
        }
        self.reached = self.reached.max(now);
    }

    /// What can happen without time passing.
    fn happen(&mut self) {
        let Self { bus, own, nodes, inbound, reached, .. } = self;
        let now = *reached;
        while let Some(output) = bus.poll(now) {
            match output {
                Output::Received { to, frame, .. } if to == *own => keep(inbound, CanInput::Frame(frame)),
                Output::Received { to, frame, .. } => {
                    if let Some((_, node)) = nodes.iter_mut().find(|(station, _)| *station == to) {
                        node.handle_frame(now, &frame);
                    }
                }
                Output::State { station, state: State::BusOff, .. } if station == *own => {
                    keep(inbound, CanInput::BusOff);
                }
                Output::State { station, state: State::Active, .. } if station == *own => {
                    keep(inbound, CanInput::BusOn);
                }
                Output::State { station, state: State::BusOff, .. } => {
                    if let Some((_, node)) = nodes.iter_mut().find(|(known, _)| *known == station) {
                        node.bus_off(now);
                    }
                }
                Output::Sent { from, .. } if from == *own => keep(inbound, CanInput::Transmitted),
                Output::Sent { .. } | Output::State { .. } => {}
            }
        }
        for (station, node) in nodes {
            while let Some(frame) = node.poll(now) {
                // What the queue has no room for is lost, as behind a network card.
                let _ = bus.send(now, *station, &frame);
            }
        }
    }
}

/// Keeps what the box has not taken yet; what there is no room for is lost.
fn keep(inbound: &mut VecDeque<CanInput>, input: CanInput) {
    if inbound.len() < INBOUND_MAX {
        inbound.push_back(input);
    }
}

impl<N: CanNode> CanPort for InProcessCan<N> {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        let now = self.bus_time(now);
        self.advance(now);
        let input = self.inbound.pop_front()?;
        if let (Some((tap, bus)), CanInput::Frame(frame)) = (&mut self.tap, &input) {
            tap.can_frame(clock::realtime_now(), *bus, frame);
        }
        Some(input)
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        let now = self.bus_time(now);
        self.advance(now);
        match self.bus.send(now, self.own, frame) {
            Ok(()) => {
                if let Some((tap, bus)) = &mut self.tap {
                    tap.can_frame(clock::realtime_now(), *bus, frame);
                }
                CanSent::Sent
            }
            Err(SendError::Full) => CanSent::Full,
            Err(SendError::BusOff | SendError::Disconnected | SendError::Fd) => CanSent::Failed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bus_stands_still_while_nobody_can_look() {
        let millis = |ms| MonotonicTime::ZERO + DurationNs::from_millis(ms);
        let mut pauses =
            Pauses { cycle: DurationNs::from_millis(2), looked: MonotonicTime::ZERO, sum: DurationNs::ZERO };
        let looks = [100, 102, 102, 106, 110, 115, 117, 1_117, 1_119];
        let found: Vec<_> = looks.into_iter().map(|look| pauses.bus_time(millis(look))).collect();
        let expected = [100, 102, 102, 106, 110, 112, 114, 116, 118].map(millis);
        assert_eq!(found, expected);
    }
}
