//! The ports of the buses.

use profile_generic::can::timing::BitRate;

use super::StartError;
use super::can_watch::CanWatch;
use super::port::{CanSocketPort, OpenPort, PacketPort, PortError};
use crate::capture::recorder::Tap;
use crate::config::{CanLink, Config, Link};
use crate::engine::port::CanPort;
use crate::simulate::can_bus::InProcessCan;
use crate::simulate::drives::InProcessDrives;
use crate::sys::can_interface;
use crate::sys::interface_lock::InterfaceLock;

/// After how many milliseconds a CAN controller that is off the bus starts again by itself.
const CAN_RESTART_MS: u32 = 100;

/// Frames that the transmit queue of a CAN interface holds: the RPDOs of a cycle, and more. Linux gives ten.
const CAN_QUEUE: u32 = 128;

/// The interface of the SERCOS ring or line; `None` without one.
pub(super) fn sercos_wire(config: &Config) -> Result<Option<PacketPort>, PortError> {
    match config.sercos.as_ref().map(|sercos| &sercos.link) {
        Some(Link::Interface { name, ring }) => PacketPort::open(name, ring.as_deref()).map(Some),
        Some(Link::InProcess { .. }) | None => Ok(None),
    }
}

/// Opens the port of each bus in the order of the engine, with the next of the taps, and the watches over CAN interfaces.
pub(super) fn open(
    config: &Config,
    wire: Option<PacketPort>,
    taps: &mut Vec<Tap>,
) -> Result<(Vec<OpenPort>, Vec<CanWatch>), StartError> {
    let mut ports = Vec::new();
    if let Some(sercos) = &config.sercos {
        ports.push(OpenPort::Ethernet(match wire {
            Some(wire) => Box::new(wire.recorded(taps.pop())),
            None => Box::new(InProcessDrives::of(config, sercos, taps.pop())),
        }));
    }
    let mut watches = Vec::new();
    for (number, can) in (0..).zip(&config.can) {
        let tap = taps.pop().map(|tap| (tap, number));
        ports.push(OpenPort::Can(can_port(&can.link, can.bit_rate, &mut watches, tap, |tap| {
            Box::new(InProcessCan::of(can, tap).in_host_time(can.cycle_time))
        })?));
    }
    for (number, network) in (config.can.len()..).zip(&config.devicenet) {
        let tap = taps.pop().zip(u8::try_from(number).ok());
        ports.push(OpenPort::Can(can_port(&network.link, network.bit_rate(), &mut watches, tap, |tap| {
            Box::new(InProcessCan::of_devicenet(network, tap).in_host_time(network.cycle_time))
        })?));
    }
    Ok((ports, watches))
}

/// The port of a bus on CAN.
pub(crate) fn can_port(
    link: &CanLink,
    bit_rate: BitRate,
    watches: &mut Vec<CanWatch>,
    tap: Option<(Tap, u8)>,
    in_process: impl FnOnce(Option<(Tap, u8)>) -> Box<dyn CanPort + Send>,
) -> Result<Box<dyn CanPort + Send>, StartError> {
    let CanLink::Interface { name, set_bit_rate } = link else { return Ok(in_process(tap)) };
    // Before anything is set: that would disturb the master that there is.
    let lock = InterfaceLock::take(name)?;
    if *set_bit_rate {
        let settings = can_interface::Settings {
            bit_rate: Some(bit_rate),
            restart_ms: Some(CAN_RESTART_MS),
            queue: Some(CAN_QUEUE),
            ..can_interface::Settings::default()
        };
        can_interface::configure(name, &settings)?;
    }
    let port = CanSocketPort::open(name, lock)?.recorded(tap);
    watches.push(CanWatch::new(name.clone(), port.index(), *set_bit_rate, port.back()));
    Ok(Box::new(port))
}
