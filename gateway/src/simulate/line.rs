//! Simulated SERCOS III drives: slaves with a servo behind them, on a line inside this process or on a network interface.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use profile_generic::quantity::{Acceleration, Position, Torque, TorqueAbsolute, Velocity};
use profile_generic::scaling::UnitKind;
use profile_generic::servo::ServoParameters;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::{Config as SlaveConfig, Network, Slave};

use crate::capture::Side;
use crate::capture::recorder::Tap;
use crate::config::{AxisKind, Config};
use crate::engine::port::{FRAME_MAX, SouthPort};
use crate::sys::clock;
use crate::sys::packet_socket::PacketSocket;

/// Drives joined to a line.
pub type DriveLine = Network<Drive>;

/// Frames on their way back: a cycle has eight, those of two cycles fit.
const FRAMES_MAX: usize = 16;

/// How long the line waits for a frame before it looks after its time-outs.
const WAIT: Duration = Duration::from_millis(10);

/// Longest pause that does not hold up the end of the process.
const FRAMES_PER_WAKE: usize = 64;

/// A servo of a turning axis: 1 Nm, 3000 revolutions per minute.
#[must_use]
pub fn rotary() -> ServoParameters {
    ServoParameters::default()
}

/// A linear motor: 200 N on a slide of 10 kg, 1.5 m/s.
#[must_use]
pub fn linear() -> ServoParameters {
    const MILLIMETRE: i64 = 1_000_000_000;
    ServoParameters {
        kind: UnitKind::Linear,
        encoder_counts: 10_000,
        encoder_bits: 32,
        rated_torque: TorqueAbsolute(200_000_000),
        inertia: 10_000_000,
        coulomb_friction: Torque(20_000),
        viscous_friction: Torque(30_000),
        rated_velocity: Velocity(1_000 * MILLIMETRE),
        velocity_limit: Velocity(1_500 * MILLIMETRE),
        deceleration_limit: Acceleration(20_000 * MILLIMETRE),
        position_error_tolerance: Position(20 * MILLIMETRE),
        in_position_window: Position(MILLIMETRE / 100),
        standstill_window: Velocity(MILLIMETRE),
        marker_distance: Position(20 * MILLIMETRE),
        ..ServoParameters::default()
    }
}

/// A line of drives with these SERCOS addresses, nearest to the master first.
///
/// # Panics
/// Never with the servos of this module; a test builds both.
#[must_use]
pub fn line(drives: impl IntoIterator<Item = (u16, UnitKind)>) -> DriveLine {
    let slaves = drives.into_iter().map(|(address, kind)| {
        let servo = match kind {
            UnitKind::Rotary => rotary(),
            UnitKind::Linear => linear(),
        };
        let drive = Drive::new(servo).expect("the servos of this module work");
        let [low, high] = address.to_le_bytes();
        let mac = [0x02, 0x41, 0x42, 0x01, high, low];
        let config = SlaveConfig { address, mac, serial: u32::from(address), ..SlaveConfig::default() };
        Slave::new(&config, drive)
    });
    Network::line(slaves.collect())
}

/// A line inside this process: what is sent comes back at once, changed as the slaves change it. The frames are the
/// same as on a wire.
#[derive(Debug)]
pub struct InProcessLine {
    line: DriveLine,
    /// Frames that have come back and were not taken yet.
    returned: Box<[([u8; FRAME_MAX], usize); FRAMES_MAX]>,
    first: usize,
    count: usize,
    tap: Option<Tap>,
}

impl InProcessLine {
    /// A port on `line`.
    #[must_use]
    pub fn new(line: DriveLine, tap: Option<Tap>) -> Self {
        Self { line, returned: Box::new([([0; FRAME_MAX], 0); FRAMES_MAX]), first: 0, count: 0, tap }
    }

    /// The drives of a configuration, each for the axis it is to move.
    #[must_use]
    pub fn of(config: &Config, tap: Option<Tap>) -> Self {
        let kind =
            |drive: usize| match config.axes.iter().find(|axis| axis.drive == drive).map(|axis| axis.kind) {
                Some(AxisKind::Linear) => UnitKind::Linear,
                _ => UnitKind::Rotary,
            };
        let drives = config.sercos.drives.iter().enumerate();
        Self::new(line(drives.map(|(number, drive)| (drive.address, kind(number)))), tap)
    }
}

impl SouthPort for InProcessLine {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        if self.count == 0 {
            return None;
        }
        let (frame, length) = &self.returned[self.first];
        let length = (*length).min(buffer.len());
        buffer[..length].copy_from_slice(&frame[..length]);
        self.first = (self.first + 1) % FRAMES_MAX;
        self.count -= 1;
        if let Some(tap) = self.tap.as_mut() {
            tap.frame(clock::realtime_now(), Side::South, &buffer[..length]);
        }
        Some((Port::One, length))
    }

    fn send(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        if port != Port::One || self.count == FRAMES_MAX || frame.len() > FRAME_MAX {
            return false;
        }
        if let Some(tap) = self.tap.as_mut() {
            tap.frame(clock::realtime_now(), Side::South, frame);
        }
        self.line.handle_time(now);
        let (back, length) = &mut self.returned[(self.first + self.count) % FRAMES_MAX];
        back[..frame.len()].copy_from_slice(frame);
        *length = frame.len();
        if self.line.round_trip(now, &mut back[..frame.len()]) {
            self.count += 1;
        }
        true
    }
}

/// Runs a line on a network interface until `stop` is set.
///
/// # Errors
/// The interface is gone.
pub fn run(line: &mut DriveLine, socket: &PacketSocket, stop: &AtomicBool) -> std::io::Result<()> {
    let mut buffer = [0; FRAME_MAX];
    while !stop.load(Ordering::Relaxed) {
        line.handle_time(clock::monotonic_now());
        if !socket.wait(WAIT)? {
            continue;
        }
        for _ in 0..FRAMES_PER_WAKE {
            // A link that went down gives nothing until it is back.
            let Ok(Some(received)) = socket.recv(&mut buffer) else { break };
            let Some(frame) = buffer.get_mut(..received.len) else { continue };
            if line.round_trip(clock::monotonic_now(), frame) {
                // A frame that cannot be sent is one that was lost on the way.
                let _ = socket.send(frame);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_of_drive_can_be_built() {
        let line = line([(7, UnitKind::Rotary), (9, UnitKind::Linear)]);
        assert_eq!(line.slaves().len(), 2);
    }
}
