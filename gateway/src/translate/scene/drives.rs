//! The simulated drives of a scene, each by its axis.

use profile_generic::can::{Frame, Id};
use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;

use super::recording::Sum;
use crate::config::{Config, DriveAt};
use crate::engine::port::{CanInput, CanPort, CanSent, EthernetPort, SouthPort};
use crate::simulate::can_actor::{self, ActingNode};
use crate::simulate::can_bus::{CanNode, InProcessCan};
use crate::simulate::can_drive::DriveNode;
use crate::simulate::devicenet_drive::DevicenetNode;
use crate::simulate::drive_events::{Change, SimulatedDrives};
use crate::simulate::drives::{self, InProcessDrives};

/// A bus, and what the box has sent there.
struct Recorded<B> {
    bus: B,
    sum: Sum,
}

impl<B> Recorded<B> {
    fn new(bus: B) -> Self {
        Self { bus, sum: Sum::default() }
    }
}

impl EthernetPort for Recorded<InProcessDrives> {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        self.bus.receive(buffer)
    }

    fn send(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        self.sum.add(frame);
        self.bus.send(now, port, frame)
    }
}

impl<N: CanNode> CanPort for Recorded<InProcessCan<N>> {
    fn receive(&mut self, now: MonotonicTime) -> Option<CanInput> {
        self.bus.receive(now)
    }

    fn send(&mut self, now: MonotonicTime, frame: &Frame) -> CanSent {
        let id = match frame.id() {
            Id::Standard(id) => u32::from(id),
            Id::Extended(id) => id,
        };
        let sent = self.bus.send(now, frame);
        if sent == CanSent::Sent {
            self.sum.add(&id.to_le_bytes());
            self.sum.add(frame.data());
        }
        sent
    }
}

/// Where the drive of an axis is: the place of its device on a bus, and its number there from 1.
#[derive(Debug, Clone, Copy)]
enum At {
    Sercos { slave: usize },
    Can { bus: usize, device: usize, axis: u16 },
    Devicenet { network: usize, device: usize },
}

/// All drives.
pub(super) struct Drives {
    sercos: Option<Recorded<InProcessDrives>>,
    can: Vec<Recorded<InProcessCan<DriveNode>>>,
    devicenet: Vec<Recorded<InProcessCan<DevicenetNode>>>,
    /// By the numbers of the axes.
    places: Vec<At>,
    now: MonotonicTime,
}

impl Drives {
    pub fn of(config: &Config) -> Self {
        let place = |at: &DriveAt| match *at {
            DriveAt::Sercos { drive } => At::Sercos { slave: drive },
            DriveAt::Can { bus, drive } => {
                let drives = &config.can[bus].drives;
                let own = &drives[drive];
                // A device comes onto the bus with the first of its drives.
                let mut nodes = Vec::new();
                for drive in drives {
                    if !nodes.contains(&drive.node) {
                        nodes.push(drive.node);
                    }
                }
                let device = nodes.iter().position(|node| *node == own.node).unwrap_or(0);
                At::Can { bus, device, axis: own.axis + 1 }
            }
            DriveAt::Devicenet { network, drive } => At::Devicenet { network, device: drive },
        };
        let sercos = config.sercos.as_ref();
        let can = config.can.iter().map(|bus| Recorded::new(InProcessCan::of(bus, None)));
        let devicenet = config.devicenet.iter();
        let devicenet = devicenet.map(|network| Recorded::new(InProcessCan::of_devicenet(network, None)));
        Self {
            sercos: sercos.map(|bus| Recorded::new(InProcessDrives::of(config, bus, None))),
            can: can.collect(),
            devicenet: devicenet.collect(),
            places: config.axes.iter().map(|axis| place(&axis.drive)).collect(),
            now: MonotonicTime::ZERO,
        }
    }

    /// The instant of what happens next.
    pub fn set_time(&mut self, now: MonotonicTime) {
        self.now = now;
    }

    /// The ports in the order of the engine's buses.
    pub fn ports(&mut self) -> Vec<SouthPort<'_>> {
        let sercos = self.sercos.iter_mut().map(|bus| SouthPort::Ethernet(bus));
        let can = self.can.iter_mut().map(|bus| SouthPort::Can(bus));
        let devicenet = self.devicenet.iter_mut().map(|bus| SouthPort::Can(bus));
        sercos.chain(can).chain(devicenet).collect()
    }

    /// What was sent since the last time, in the same order.
    pub fn take_sums(&mut self) -> Vec<Sum> {
        let sercos = self.sercos.iter_mut().map(|bus| &mut bus.sum);
        let can = self.can.iter_mut().map(|bus| &mut bus.sum);
        let devicenet = self.devicenet.iter_mut().map(|bus| &mut bus.sum);
        sercos.chain(can).chain(devicenet).map(std::mem::take).collect()
    }
}

/// Lets a change happen in a device of a bus; a silent one has its cable pulled.
fn act<N: ActingNode>(
    bus: &mut InProcessCan<N>,
    now: MonotonicTime,
    device: usize,
    number: u16,
    change: Change,
) -> Result<(), &'static str> {
    let mut silence = None;
    let node = bus.nodes_mut().nth(device).ok_or("there is no such drive")?;
    can_actor::act_on(node, number, change, |silent| silence = Some(silent))?;
    if let Some(silent) = silence {
        bus.connect(now, device, !silent);
    }
    Ok(())
}

impl SimulatedDrives for Drives {
    /// States are told by the box.
    type State = bool;

    fn state(&self, _: u16) -> Option<bool> {
        None
    }

    fn apply(&mut self, axis: u16, change: Change) -> Result<(), &'static str> {
        let place = usize::from(axis).checked_sub(1).and_then(|axis| self.places.get(axis));
        match (*place.ok_or("there is no such axis")?, &mut self.sercos) {
            (At::Sercos { slave }, Some(line)) => drives::act_on(line.bus.network_mut(), slave, change),
            (At::Can { bus, device, axis }, _) => act(&mut self.can[bus].bus, self.now, device, axis, change),
            (At::Devicenet { network, device }, _) => {
                act(&mut self.devicenet[network].bus, self.now, device, 1, change)
            }
            (At::Sercos { .. }, None) => Err("there is no bus"),
        }
    }
}
