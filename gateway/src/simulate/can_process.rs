//! A simulated node on a CAN interface.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use profile_generic::can::Frame;
use profile_generic::time::MonotonicTime;

use super::can_bus::CanNode;
use super::drive_events::SimulatedDrives;
use super::drive_events::console::Director;
use crate::sys::can_error::BusEvent;
use crate::sys::can_socket::{CanSocket, Content};
use crate::sys::clock;
use crate::sys::link::LinkError;

/// How long it waits for a frame before it lets the time pass that is over: frames wake it, and what it says by itself may be
/// so much late.
const WAIT: Duration = Duration::from_millis(4);

/// Frames taken before the time is looked after again.
const FRAMES_PER_WAKE: usize = 64;

/// Runs a node on an interface until `stop` is set.
///
/// # Errors
/// The interface is gone.
pub fn run<N: CanNode + SimulatedDrives>(
    node: &mut N,
    socket: &mut CanSocket,
    director: &mut Director<N>,
    stop: &AtomicBool,
) -> io::Result<()> {
    node.start(clock::monotonic_now());
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
                        Content::Error(error) => error.events().for_each(|event| tell(node, now, event)),
                    }
                    send(node, socket, &mut held, now)?;
                }
                Ok(None) => break,
                Err(LinkError::Gone) => return Err(gone(socket)),
                // It may come back; the master is gone as long as it is down.
                Err(_) => {
                    node.bus_off(clock::monotonic_now());
                    break;
                }
            }
        }
        if socket.take_dropped() > 0 {
            node.overrun();
        }
        let now = clock::monotonic_now();
        node.handle_time(now);
        director.poll(now, node);
        send(node, socket, &mut held, now)?;
    }
    Ok(())
}

fn gone(socket: &CanSocket) -> io::Error {
    io::Error::other(format!("the CAN interface `{}` is gone", socket.name()))
}

/// What the controller says of the bus.
fn tell<N: CanNode>(node: &mut N, now: MonotonicTime, event: BusEvent) {
    match event {
        BusEvent::Off => node.bus_off(now),
        BusEvent::Restarted => node.bus_on(),
        _ => {}
    }
}

/// Sends what the node has to say, as far as the transmit queue has room.
fn send<N: CanNode>(
    node: &mut N,
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
