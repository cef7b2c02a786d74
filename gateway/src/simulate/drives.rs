//! Simulated SERCOS III drives: slaves with a servo behind them, inside this process or between network interfaces.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use arrayvec::ArrayVec;
use profile_generic::cast;
use profile_generic::quantity::{Acceleration, Position, Torque, TorqueAbsolute, Velocity};
use profile_generic::scaling::UnitKind;
use profile_generic::servo::{ServoError, ServoParameters};
use profile_generic::state::Report;
use profile_generic::time::MonotonicTime;
use profile_sercos::master::event::Port;
use profile_sercos::slave::communication::FixedConnection;
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::phase::State;
use profile_sercos::slave::{Config as SlaveConfig, Network, Slave, communication};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::scp::{ScpClass, ScpEntry};

use super::drive_events::console::Director;
use super::drive_events::setup::Setup;
use super::drive_events::{Change, Shown, SimulatedDrives};
use super::sercos_twin::Twin;
use crate::capture::Side;
use crate::capture::recorder::Tap;
use crate::config::{AxisKind, Config, DriveAt, Sercos};
use crate::engine::port::{EthernetPort, FRAME_MAX};
use crate::sys::clock;
use crate::sys::link::LinkState;
use crate::sys::packet_socket::{self, PacketSocket};

/// Ethernet address of the master on drives in the same process: locally administered.
pub const SIMULATED_MAC: [u8; 6] = [0x02, 0x41, 0x42, 0x00, 0x00, 0x01];

/// Drives and the cables between them.
pub type DriveNetwork = Network<Drive>;

/// Frames on their way back: a cycle has eight on each port, those of two cycles fit.
const FRAMES_MAX: usize = 32;

/// How long the drives wait for a frame before it looks after its time-outs.
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
        at_velocity_window: Velocity(MILLIMETRE),
        marker_distance: Position(20 * MILLIMETRE),
        ..ServoParameters::default()
    }
}

/// Drives with these SERCOS addresses, nearest to the master's port 1 first: in a ring, or else in a line.
///
/// # Panics
/// Never with the servos of this module; a test builds both.
#[must_use]
pub fn drives(drives: impl IntoIterator<Item = (u16, UnitKind)>, ring: bool) -> DriveNetwork {
    let network = built(drives, ring, communication::CLASSES, &[], &Setup::default(), None);
    network.expect("the servos of this module work")
}

/// The same with hot plug (SCP_HP): they can be plugged in while the bus runs.
///
/// # Panics
/// Never with the servos of this module.
#[must_use]
pub fn hot_plug_drives(drives: impl IntoIterator<Item = (u16, UnitKind)>, ring: bool) -> DriveNetwork {
    let network = built(drives, ring, communication::CLASSES_WITH_HOT_PLUG, &[], &Setup::default(), None);
    network.expect("the servos of this module work")
}

fn built(
    drives: impl IntoIterator<Item = (u16, UnitKind)>,
    ring: bool,
    classes: &'static [ScpEntry],
    fixed: &'static [FixedConnection],
    setup: &Setup,
    twin: Option<&Twin>,
) -> Result<DriveNetwork, DriveError> {
    let slaves = drives.into_iter().map(|(address, kind)| {
        let servo = match kind {
            UnitKind::Rotary => rotary(),
            UnitKind::Linear => linear(),
        };
        let servo = setup.servo(address, servo);
        let drive = match twin {
            None => Drive::new(servo),
            Some(twin) => Drive::like(servo, twin.given().to_vec()),
        };
        let drive = drive.map_err(|error| DriveError { address, error })?;
        let [low, high] = address.to_le_bytes();
        let mac = [0x02, 0x41, 0x42, 0x01, high, low];
        let config = SlaveConfig {
            address,
            mac,
            serial: u32::from(address),
            classes,
            fixed,
            ..SlaveConfig::default()
        };
        let mut slave = Slave::new(&config, drive);
        if let Some((motor, load)) = setup.gear(address) {
            slave.preset(Idn::INPUT_REVOLUTIONS_OF_LOAD_GEAR, i64::from(motor));
            slave.preset(Idn::OUTPUT_REVOLUTIONS_OF_LOAD_GEAR, i64::from(load));
        }
        if let Some(twin) = twin {
            twin.name(slave.store_mut());
        }
        Ok(slave)
    });
    let slaves = slaves.collect::<Result<_, _>>()?;
    Ok(if ring { Network::ring(slaves) } else { Network::line(slaves) })
}

/// A drive that cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("drive {address} cannot work as it is set up: {error}")]
pub struct DriveError {
    /// SERCOS address.
    address: u16,
    /// What is wrong with its servo.
    error: ServoError,
}

/// What is shown of a SERCOS drive: its communication phase and its state.
pub type DriveShown = Shown<State, Report>;

/// What drives of a line can do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LineKind {
    /// Their telegrams are configured by the master (SCP_VarCFG).
    Plain,
    /// They can be plugged in while the bus runs as well (SCP_HP).
    HotPlug,
    /// Their telegrams are what they are (SCP_FixCFG): what is sent to them, and what they send.
    Fixed([Vec<Idn>; 2]),
}

const FIXED_CLASSES: &[ScpEntry] =
    &[ScpEntry { class: ScpClass::FIX_CFG, version: 1 }, ScpEntry { class: ScpClass::SYNC, version: 1 }];

/// Drives with SERCOS addresses that count up, for events.
#[derive(Debug)]
pub struct DriveLine {
    network: DriveNetwork,
    first: u16,
}

impl DriveLine {
    /// Drives with consecutive addresses, nearest to the master's port 1 first.
    ///
    /// # Errors
    /// A drive cannot work with what `setup` makes of it.
    pub fn new(
        drives: impl IntoIterator<Item = (u16, UnitKind)>,
        ring: bool,
        kind: &LineKind,
        setup: &Setup,
    ) -> Result<Self, DriveError> {
        Self::like(drives, ring, kind, setup, None)
    }

    /// The same, each of them like the drive of a backup, where one is given.
    ///
    /// # Errors
    /// A drive cannot work with what `setup` makes of it.
    pub fn like(
        drives: impl IntoIterator<Item = (u16, UnitKind)>,
        ring: bool,
        kind: &LineKind,
        setup: &Setup,
        twin: Option<&Twin>,
    ) -> Result<Self, DriveError> {
        let mut drives = drives.into_iter().peekable();
        let first = drives.peek().map_or(1, |(address, _)| *address);
        let (classes, fixed): (_, &'static [FixedConnection]) = match kind {
            LineKind::Plain => (communication::CLASSES, &[]),
            LineKind::HotPlug => (communication::CLASSES_WITH_HOT_PLUG, &[]),
            LineKind::Fixed([to, from]) => {
                // As long as the process: it is one line of drives.
                let list =
                    |produces, idns: &Vec<Idn>| FixedConnection { produces, idns: idns.clone().leak() };
                (FIXED_CLASSES, vec![list(false, to), list(true, from)].leak())
            }
        };
        Ok(Self { network: built(drives, ring, classes, fixed, setup, twin)?, first })
    }

    /// The drives and their cables.
    pub fn network_mut(&mut self) -> &mut DriveNetwork {
        &mut self.network
    }

    /// The same, without the line.
    #[must_use]
    pub fn into_network(self) -> DriveNetwork {
        self.network
    }

    fn index(&self, drive: u16) -> Option<usize> {
        let index = usize::from(drive.checked_sub(self.first)?);
        (index < self.network.slaves().len()).then_some(index)
    }
}

impl SimulatedDrives for DriveLine {
    type State = DriveShown;

    fn state(&self, drive: u16) -> Option<DriveShown> {
        let index = self.index(drive)?;
        let slave = &self.network.slaves()[index];
        let actual = slave.application().actual();
        let shown = Shown {
            link: slave.state(),
            state: actual.report,
            fault: actual.fault,
            warning: actual.warning,
            silent: self.network.is_mute(index),
        };
        // Before its first step the servo has no state.
        (actual.report != Report::Silent).then_some(shown)
    }

    fn position(&self, drive: u16) -> Option<f64> {
        let position = self.network.slaves()[self.index(drive)?].application().actual().position;
        Some(cast::f64_from_i64(position.get()) * 1e-9)
    }

    fn apply(&mut self, drive: u16, change: Change) -> Result<(), &'static str> {
        let index = self.index(drive).ok_or("there is no such drive")?;
        act_on(&mut self.network, index, change)
    }
}

/// Carries out a change in the drive at a place of the line.
///
/// # Errors
/// Why this drive cannot do it.
pub fn act_on(network: &mut DriveNetwork, place: usize, change: Change) -> Result<(), &'static str> {
    let drive = network.slaves_mut().get_mut(place).ok_or("there is no such drive")?.application_mut();
    if change.apply_to(drive.servo_mut()) {
        return Ok(());
    }
    match change {
        Change::Power(on) => drive.set_main_power(on),
        Change::Silence(silent) => network.set_mute(place, silent),
        Change::LimitSwitches(..) => return Err("it has no limit switches"),
        _ => {}
    }
    Ok(())
}

/// Drives inside this process: what is sent comes back at once, changed as the slaves change it. The frames are the
/// same as on a wire.
#[derive(Debug)]
pub struct InProcessDrives {
    network: DriveNetwork,
    returned: Returned,
    tap: Option<Tap>,
}

/// Frames that have come back and were not taken yet.
#[derive(Debug)]
struct Returned {
    frames: Box<[(Port, [u8; FRAME_MAX], usize); FRAMES_MAX]>,
    first: usize,
    count: usize,
}

impl Returned {
    fn new() -> Self {
        Self { frames: Box::new([(Port::One, [0; FRAME_MAX], 0); FRAMES_MAX]), first: 0, count: 0 }
    }

    /// Keeps a frame; one for which there is no room is lost.
    fn push(&mut self, port: Port, frame: &[u8]) {
        if self.count == FRAMES_MAX {
            return;
        }
        let (on, bytes, length) = &mut self.frames[(self.first + self.count) % FRAMES_MAX];
        let Some(place) = bytes.get_mut(..frame.len()) else { return };
        place.copy_from_slice(frame);
        (*on, *length) = (port, frame.len());
        self.count += 1;
    }

    fn pop(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        self.count = self.count.checked_sub(1)?;
        let (port, frame, length) = &self.frames[self.first];
        let length = (*length).min(buffer.len());
        buffer[..length].copy_from_slice(&frame[..length]);
        self.first = (self.first + 1) % FRAMES_MAX;
        Some((*port, length))
    }
}

impl InProcessDrives {
    /// The master's ports on `network`.
    #[must_use]
    pub fn new(network: DriveNetwork, tap: Option<Tap>) -> Self {
        Self { network, returned: Returned::new(), tap }
    }

    /// The drives and their cables.
    pub fn network_mut(&mut self) -> &mut DriveNetwork {
        &mut self.network
    }

    /// The drives of a configuration, each for the axis it is to move.
    #[must_use]
    pub fn of(config: &Config, sercos: &Sercos, tap: Option<Tap>) -> Self {
        let kind = |drive: usize| {
            let at = DriveAt::Sercos { drive };
            match config.axes.iter().find(|axis| axis.drive == at).map(|axis| axis.kind) {
                Some(AxisKind::Linear) => UnitKind::Linear,
                _ => UnitKind::Rotary,
            }
        };
        let addresses = sercos.drives.iter().enumerate();
        let addresses = addresses.map(|(number, drive)| (drive.address, kind(number)));
        Self::new(drives(addresses, sercos.link.has_ring()), tap)
    }
}

impl EthernetPort for InProcessDrives {
    fn receive(&mut self, buffer: &mut [u8]) -> Option<(Port, usize)> {
        let (port, length) = self.returned.pop(buffer)?;
        if let Some(tap) = self.tap.as_mut() {
            tap.frame(clock::realtime_now(), Side::South(port), &buffer[..length]);
        }
        Some((port, length))
    }

    fn send(&mut self, now: MonotonicTime, port: Port, frame: &[u8]) -> bool {
        let mut buffer = [0; FRAME_MAX];
        let Some(bytes) = buffer.get_mut(..frame.len()) else { return false };
        bytes.copy_from_slice(frame);
        if let Some(tap) = self.tap.as_mut() {
            tap.frame(clock::realtime_now(), Side::South(port), frame);
        }
        let Self { network, returned, .. } = self;
        network.handle_time(now);
        network.send(now, port, bytes, &mut |port, frame| returned.push(port, frame));
        true
    }
}

/// Runs drives between network interfaces until `stop` is set: the first one is the one nearer to the master's port 1,
/// and behind the second one, where there is one, the line goes on or the ring closes.
///
/// # Errors
/// An interface is gone.
pub fn run(
    drives: &mut DriveLine,
    sockets: &ArrayVec<PacketSocket, 2>,
    director: &mut Director<DriveLine>,
    stop: &AtomicBool,
) -> std::io::Result<()> {
    let mut buffer = [0; FRAME_MAX];
    // As the links were when they were looked at last; all drives begin with both.
    let mut up = [true; 2];
    while !stop.load(Ordering::Relaxed) {
        let now = clock::monotonic_now();
        drives.network.handle_time(now);
        director.poll(now, drives);
        let network = &mut drives.network;
        let waiting = packet_socket::wait(sockets, WAIT)?;
        for (number, socket) in sockets.iter().enumerate() {
            let is_up = socket.link_state() == LinkState::Up;
            if std::mem::replace(&mut up[number], is_up) != is_up {
                let cable = if number == 0 { 0 } else { network.slaves().len() };
                network.set_cable(cable, is_up, is_up);
                let text = if is_up { "link up" } else { "link down" };
                director.say(clock::monotonic_now(), &format!("{}: {text}", socket.name()));
            }
        }
        if !waiting {
            continue;
        }
        for _ in 0..FRAMES_PER_WAKE {
            let mut any = false;
            for (socket, port) in sockets.iter().zip(Port::ALL) {
                // A link that went down gives nothing until it is back.
                let Ok(Some(received)) = socket.recv(&mut buffer) else { continue };
                any = true;
                let Some(frame) = buffer.get_mut(..received.len) else { continue };
                network.send(clock::monotonic_now(), port, frame, &mut |port, frame| {
                    let leaves = sockets.iter().zip(Port::ALL).find(|(_, known)| *known == port);
                    if let Some((socket, _)) = leaves {
                        // A frame that cannot be sent is one that was lost on the way.
                        let _ = socket.send(frame);
                    }
                });
            }
            if !any {
                break;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use profile_generic::time::DurationNs;
    use profile_sercos::master::Master;
    use profile_sercos::master::config::{MasterConfig, Ports};
    use profile_sercos::master::event::Output;
    use profile_sercos::wire::header::Phase;

    use super::*;

    #[test]
    fn both_kinds_of_drive_can_be_built() {
        let line = drives([(7, UnitKind::Rotary), (9, UnitKind::Linear)], false);
        assert_eq!(line.slaves().len(), 2);
    }

    #[test]
    fn what_goes_into_a_ring_comes_out_at_the_other_port() {
        let ways = [(false, Port::One, Some(Port::One)), (false, Port::Two, None)];
        let round = [(true, Port::One, Some(Port::Two)), (true, Port::Two, Some(Port::One))];
        for (ring, from, back) in ways.into_iter().chain(round) {
            let mut master = MasterConfig::new(SIMULATED_MAC, 2_000_000);
            master.ports = if from == Port::One { Ports::One } else { Ports::Two };
            let mut master = Master::new(master).unwrap();
            master.set_target_phase(Phase::CP0);
            let mut drives = InProcessDrives::new(drives([(7, UnitKind::Rotary)], ring), None);
            let now = master.wake_at().unwrap_or(MonotonicTime::ZERO);
            let mut sent = 0;
            // The pause before CP0 passes without telegrams.
            for wake in 0..1000 {
                let now = now + DurationNs::from_millis(wake);
                while let Some(Output::Transmit { port, frame }) = master.poll(now) {
                    assert_eq!(port, from);
                    assert!(drives.send(now, port, frame));
                    sent += 1;
                    let mut buffer = [0; FRAME_MAX];
                    let came = drives.receive(&mut buffer);
                    assert_eq!(came, back.map(|back| (back, frame.len())), "ring {ring}, from {from}");
                    assert_eq!(drives.receive(&mut buffer), None);
                }
            }
            assert!(sent > 100, "{sent} telegrams");
            assert!(!drives.send(now, from, &[0; FRAME_MAX + 1]));
        }
    }
}
