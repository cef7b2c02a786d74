//! The CANopen buses of a configuration.

use profile_cia402::master::config::{
    Expected, HeartbeatConfig, MasterConfig, MasterHeartbeat, NodeConfig, SyncConfig,
};
use profile_cia402::wire::NodeId;
use profile_generic::mode::OperatingMode;

use super::{BuildError, kind, modes, parameters, startup};
use crate::config::{Axis, AxisFunction, Can, CanDevice, CanDrive, CanLink, Config, DriveAt, Lss};
use crate::engine::bus::can::CanBus;
use crate::engine::bus::can::commissioner::{AxisSetup, Commissioner, commissioner, pdos};
use crate::engine::bus::can::failure::Misfit;
use crate::engine::bus::can::layout::{AxisPdos, FoundPdo, FoundPdos, SpareIds};
use crate::engine::bus::can::lss::Assignment;
use crate::mapping::{AxisUnits, Cia402Axis, Mapping, Reference};

/// Heartbeats that may be missing.
const HEARTBEATS: u16 = 3;

/// Cycle time for which one SDO frame a cycle is let go, nanoseconds: with 10 ms there are five.
const SDO_INTERVAL_NS: i64 = 2_000_000;

/// Most SDO frames in a cycle.
const SDO_FRAMES_MAX: i64 = 8;

/// A network: its master, and the axes of its devices.
#[derive(Debug)]
pub struct Network {
    /// What the master is told.
    pub master: MasterConfig,
    /// The axes of each device.
    pub devices: Vec<(NodeId, Vec<AxisSetup>)>,
    /// The devices that are given their node-ids.
    pub assignments: Vec<Assignment>,
}

/// The network of a CAN bus, with PDOs as drives that lack nothing need them.
///
/// # Errors
/// An axis has no PDOs for what it needs.
pub fn network(config: &Config, place: usize, mapping: &Mapping) -> Result<Network, BuildError> {
    let bus = &config.can[place];
    let mut taken: Vec<NodeId> = bus.drives.iter().map(|drive| drive.node).collect();
    taken.push(bus.node);
    let mut spare = SpareIds::new(taken);
    let mut nodes: Vec<NodeConfig> = Vec::new();
    let mut devices: Vec<(NodeId, Vec<AxisSetup>)> = Vec::new();
    for (number, drive) in bus.drives.iter().enumerate() {
        if !nodes.iter().any(|known| known.node == drive.node) {
            nodes.push(node(bus, drive.node));
        }
        let at = DriveAt::Can { bus: place, drive: number };
        let Some((number, axis)) = config.axes.iter().enumerate().find(|(_, axis)| axis.drive == at) else {
            continue;
        };
        let misfit = |error| BuildError::CanDrive { name: axis.name.clone(), error };
        let needs = needs(axis, bus, drive);
        let mut axis_pdos = AxisPdos::new(drive.axis, bus.allowed_losses, &mut spare)
            .ok_or_else(|| misfit(Misfit::Identifiers))?;
        axis_pdos.cycle = bus.cycle_time;
        if let Some(device) = bus.device(drive.node) {
            (axis_pdos.kept, axis_pdos.types) = (device.keeps_mapping, device.types);
        }
        let telegram = mapping.cia402_telegram(&needs).map_err(|error| misfit(error.into()))?;
        let found = described(bus, drive.node);
        let both = pdos(mapping, &axis_pdos, &telegram.command, &telegram.feedback, found.as_ref());
        let both = both.map_err(misfit)?;
        if let Some(known) = nodes.iter_mut().find(|known| known.node == drive.node) {
            let [(receive, _), (transmit, _)] = both;
            known.rpdos.extend(receive);
            known.tpdos.extend(transmit);
        }
        let startup = startup::of_can(bus, drive, &needs, mapping);
        let setup = AxisSetup { axis: number, needs, pdos: axis_pdos, startup };
        match devices.iter_mut().find(|(node, _)| *node == drive.node) {
            Some((_, axes)) => axes.push(setup),
            None => devices.push((drive.node, vec![setup])),
        }
    }
    let cycle_ns = bus.cycle_time.as_nanos();
    let sdo_frames = (cycle_ns / SDO_INTERVAL_NS).clamp(1, SDO_FRAMES_MAX);
    let master = MasterConfig {
        nodes,
        sync: Some(SyncConfig {
            period_ns: u32::try_from(cycle_ns).unwrap_or(u32::MAX),
            window_ns: 0,
            counter_overflow: 0,
        }),
        heartbeat: Some(MasterHeartbeat {
            node: bus.node,
            producer_ms: bus.heartbeat_ms,
            timeout_ms: bus.heartbeat_ms.saturating_mul(HEARTBEATS),
        }),
        listens: matches!(bus.link, CanLink::Interface { .. }),
        sdo_frames_per_cycle: u8::try_from(sdo_frames).unwrap_or(1),
        ..MasterConfig::default()
    };
    let assignment = |device: &CanDevice| {
        let Lss { address, stores } = device.lss?;
        Some(Assignment { node: device.node, address, stores })
    };
    let assignments = bus.devices.iter().filter_map(assignment).collect();
    Ok(Network { master, devices, assignments })
}

/// The PDOs that a device keeps, where its file reports them.
#[must_use]
pub fn described(bus: &Can, node: NodeId) -> Option<FoundPdos> {
    let device = bus.device(node).filter(|device| device.keeps_mapping)?;
    let pdos = device.file.as_ref()?.pdos.as_ref()?;
    Some(pdos.each_ref().map(|pdos| pdos.iter().map(FoundPdo::described).collect()))
}

fn node(bus: &Can, node: NodeId) -> NodeConfig {
    let device = bus.device(node);
    let guarding = device.and_then(|device| device.guarding);
    let file = device.and_then(|device| device.file.as_ref());
    let heartbeat = HeartbeatConfig {
        producer_ms: bus.heartbeat_ms,
        timeout_ms: bus.heartbeat_ms.saturating_mul(HEARTBEATS),
    };
    NodeConfig {
        expected: device.map_or(Expected::DRIVE, |device| device.expected),
        stamp: file.filter(|file| !file.writes.is_empty()).map(|file| file.stamp),
        writes: file.map(|file| file.writes.clone()).unwrap_or_default(),
        store: device.is_some_and(|device| device.stores),
        heartbeat: guarding.is_none().then_some(heartbeat),
        guarding,
        ..NodeConfig::new(node)
    }
}

/// A CANopen bus, and what commissions its drives.
pub(super) fn bus(
    config: &Config,
    place: usize,
    mapping: &Mapping,
) -> Result<(CanBus, Commissioner), BuildError> {
    let Network { master, devices, assignments } = network(config, place, mapping)?;
    let (commissioner, end) = commissioner(mapping.clone(), master.clone(), devices.iter().cloned());
    let number = u8::try_from(place).unwrap_or(u8::MAX);
    let name = config.can[place].link.interface().unwrap_or("in-process");
    let bus = CanBus::new(number, master, &devices, &assignments, end)
        .map_err(|error| BuildError::Can { bus: name.to_owned(), error })?;
    Ok((bus, commissioner))
}

/// What the commissioning has to achieve.
#[must_use]
pub fn needs(axis: &Axis, bus: &Can, drive: &CanDrive) -> Cia402Axis {
    let modes = match axis.function {
        AxisFunction::Drive => modes(drive.modes.as_deref()).collect(),
        // What is only looked at has its position looked at.
        AxisFunction::Encoder | AxisFunction::Converter => {
            [OperatingMode::Position.into()].into_iter().collect()
        }
    };
    Cia402Axis {
        units: AxisUnits { kind: kind(axis), reference: Reference::Load, rated: None },
        axis: drive.axis,
        modes,
        way_of_a_turn: drive.way_of_a_turn,
        counts: drive.counts.clone(),
        cycle: bus.cycle_time,
        parameters: parameters(axis),
        acknowledges: drive.acknowledges,
        tells_voltage: drive.tells_voltage,
        drive_modes: drive.drive_modes.clone(),
        any_mode: drive.modes.is_none() && axis.function == AxisFunction::Drive,
        left_out: drive.left_out.clone(),
        offsets: drive.offsets.clone(),
        captures: axis.events,
        feedback: axis.feedback,
        only_looks: axis.function != AxisFunction::Drive,
    }
}
