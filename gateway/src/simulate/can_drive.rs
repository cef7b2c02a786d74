//! A simulated CiA 402 drive on a CAN interface.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use profile_cia402::drive::ErrorCode;
use profile_cia402::node::drive::{Device, DeviceError, identity};
use profile_cia402::node::{Config, Node};
use profile_cia402::wire::NodeId;
use profile_generic::can::Frame;
use profile_generic::servo::ServoParameters;
use profile_generic::time::{DurationNs, MonotonicTime};

use crate::sys::can_error::BusEvent;
use crate::sys::can_socket::{CanSocket, Content};
use crate::sys::clock;
use crate::sys::link::LinkError;

/// From a reset to the boot-up message.
const BOOT_TIME: DurationNs = DurationNs::from_millis(50);

/// How long it waits for a frame before it lets the time pass that is over: frames wake it, and what it says by itself may be
/// so much late.
const WAIT: Duration = Duration::from_millis(4);

/// Frames taken before the time is looked after again.
const FRAMES_PER_WAKE: usize = 64;

/// A node on a bus.
pub type DriveNode = Node<Device>;

/// A device with so many axes, 1 to 8, each a servo of 1 Nm and 3000 revolutions per minute. Without a node-id it waits for
/// one by LSS. Its serial number is the node-id it begins with.
///
/// # Errors
/// Another number of axes.
pub fn drive(node: Option<NodeId>, axes: u8) -> Result<DriveNode, DeviceError> {
    let servos = vec![ServoParameters::default(); usize::from(axes)];
    let config = Config {
        node,
        identity: identity(servos.len(), node.map_or(0, |node| u32::from(node.get()))),
        boot_time: BOOT_TIME,
        has_blocks: true,
    };
    Ok(Node::new(&config, Device::new(&servos)?))
}

/// Runs a node on an interface until `stop` is set.
///
/// # Errors
/// The interface is gone.
pub fn run(node: &mut DriveNode, socket: &mut CanSocket, stop: &AtomicBool) -> io::Result<()> {
    // What the transmit queue had no room for.
    let mut held: Option<Frame> = None;
    while !stop.load(Ordering::Relaxed) {
        socket.wait(WAIT)?;
        for _ in 0..FRAMES_PER_WAKE {
            match socket.recv() {
                Ok(Some(received)) => {
                    let now = clock::monotonic_now();
                    match received.content {
                        Content::Frame(frame) => node.handle_frame(now, &frame),
                        Content::Error(error) => error.events().for_each(|event| tell(node, event)),
                    }
                    send(node, socket, &mut held, now)?;
                }
                Ok(None) => break,
                Err(LinkError::Gone) => return Err(gone(socket)),
                // It may come back; the master is gone as long as it is down.
                Err(_) => {
                    node.bus_off();
                    break;
                }
            }
        }
        if socket.take_dropped() > 0 {
            node.report_controller(ErrorCode::CAN_OVERRUN, true);
        }
        let now = clock::monotonic_now();
        node.handle_time(now);
        send(node, socket, &mut held, now)?;
    }
    Ok(())
}

fn gone(socket: &CanSocket) -> io::Error {
    io::Error::other(format!("the CAN interface `{}` is gone", socket.name()))
}

/// What the controller says of the bus.
fn tell(node: &mut DriveNode, event: BusEvent) {
    match event {
        BusEvent::Off => node.bus_off(),
        BusEvent::Restarted => {
            node.report_controller(ErrorCode::RECOVERED_FROM_BUS_OFF, true);
            node.report_controller(ErrorCode::RECOVERED_FROM_BUS_OFF, false);
        }
        _ => {}
    }
}

/// Sends what the node has to say, as far as the transmit queue has room.
fn send(
    node: &mut DriveNode,
    socket: &CanSocket,
    held: &mut Option<Frame>,
    now: MonotonicTime,
) -> io::Result<()> {
    while let Some(frame) = held.take().or_else(|| node.poll(now)) {
        match socket.send(&frame) {
            Ok(()) => {}
            Err(LinkError::Full) => {
                *held = Some(frame);
                break;
            }
            Err(LinkError::Gone) => return Err(gone(socket)),
            // A frame that cannot be sent is one that was lost on the way.
            Err(_) => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drives_have_one_to_eight_axes() {
        for axes in 1..=8 {
            let node = drive(NodeId::new(1).ok(), axes).expect("a drive");
            assert_eq!(node.application().axes().len(), usize::from(axes));
        }
        assert!(drive(None, 0).is_err() && drive(None, 9).is_err());
    }
}
