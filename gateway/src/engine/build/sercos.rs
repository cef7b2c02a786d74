//! The SERCOS III bus of a configuration.

use profile_generic::mode::OperatingMode;
use profile_sercos::master::config::{Connections, MasterConfig, Ports, SlaveConfig};
use profile_sercos::master::layout::{ConnectionNeed, SlaveNeed};

use super::{BuildError, Host, kind, modes, parameters, startup};
use crate::config::{Axis, AxisFunction, AxisKind, Config, Drive, Sercos, TimeSource};
use crate::engine::bus::sercos::commissioner::{Commissioner, DriveSetup, commissioner};
use crate::engine::bus::sercos::{COMMAND_CONNECTION, FEEDBACK_CONNECTION, SercosBus};
use crate::mapping::{AxisUnits, Mapping, Reference, SercosAxis};

/// The SERCOS III master of a configuration.
#[must_use]
pub fn master_config(sercos: &Sercos, host: Host) -> MasterConfig {
    let ns = |span: profile_generic::time::DurationNs| u32::try_from(span.as_nanos()).unwrap_or(u32::MAX);
    let mut master = MasterConfig::new(sercos.master_mac.unwrap_or(host.mac), ns(sercos.cycle_time));
    master.ports = if sercos.link.has_ring() { Ports::Both } else { Ports::One };
    master.addresses = sercos.addresses;
    master.mst_jitter_ns = ns(sercos.jitter);
    master.stable_cycles = sercos.cp0_stable_cycles;
    master.mst_losses = sercos.allowed_losses;
    // The connection's own limit stops the axis; the master need not give up on the slave before.
    master.slave_valid_misses = sercos.allowed_losses.max(master.slave_valid_misses);
    // Which connections a drive needs is known once it has reported what it can.
    let slave = |drive: &Drive| SlaveConfig {
        address: drive.address,
        connections: Connections::new(),
        hot_plug: None,
    };
    master.slaves = sercos.drives.iter().map(slave).collect();
    master.slaves_max = Sercos::slaves_max(sercos.drives.len());
    // Nothing moves yet, and the service channel takes a step in a cycle: the shorter the better.
    master.setup_cycle_ns = sercos.setup_cycle.map_or(master.setup_cycle_min_ns(), ns);
    master
}

/// The SERCOS III bus of a configuration, and what commissions drives that come later.
pub(super) fn bus(
    config: &Config,
    sercos: &Sercos,
    host: Host,
    mapping: &Mapping,
) -> Result<(SercosBus, Commissioner), BuildError> {
    let axes = config.axes.iter().enumerate();
    let drives: Vec<_> =
        axes.filter_map(|(number, axis)| Some((number, axis, config.sercos_drive(axis)?))).collect();
    let mut master = master_config(sercos, host);
    master.system_time = config.time.source != TimeSource::None;
    for (_, axis, drive) in drives.iter().filter(|(.., drive)| drive.hot_plug) {
        let slave = master.slaves.iter_mut().find(|slave| slave.address == drive.address);
        if let Some(slave) = slave {
            slave.hot_plug = Some(room(&needs(axis, drive), mapping));
        }
    }
    let drives = drives.iter().map(|(number, axis, drive)| {
        let needs = needs(axis, drive);
        let startup = startup::of_sercos(&drive.startup, &needs, mapping);
        DriveSetup { axis: *number, address: drive.address, needs, startup }
    });
    let drives: Vec<_> = drives.collect();
    let (commissioner, end) = commissioner(mapping.clone(), master.mst_losses, drives.iter().cloned());
    Ok((SercosBus::new(master, drives, end)?, commissioner))
}

/// What the telegrams keep for a drive that may come later: the longest connections that it can need.
fn room(needs: &SercosAxis, mapping: &Mapping) -> SlaveNeed {
    let (command, feedback) = mapping.telegram_room(needs);
    let need = |instance, slave_produces, len| ConnectionNeed { instance, slave_produces, len };
    let connections = [need(COMMAND_CONNECTION, false, command), need(FEEDBACK_CONNECTION, true, feedback)];
    SlaveNeed { connections: connections.into_iter().collect(), ..SlaveNeed::default() }
}

/// What the commissioning has to achieve.
#[must_use]
pub fn needs(axis: &Axis, drive: &Drive) -> SercosAxis {
    SercosAxis {
        units: AxisUnits { kind: kind(axis), reference: Reference::Load, rated: drive.rated },
        // A drive that is only looked at is set up in one mode, because its telegram belongs to one; it is never on.
        modes: match axis.function {
            AxisFunction::Drive => modes(drive.modes.as_deref()).collect(),
            AxisFunction::Encoder | AxisFunction::Converter => {
                [OperatingMode::Position.into()].into_iter().collect()
            }
        },
        any_mode: drive.modes.is_none(),
        bare: false,
        // Positions of a linear drive reach for hundreds of kilometres.
        modulo: axis.kind == AxisKind::Rotary && axis.unwind_counts.is_some(),
        set_scaling: drive.set_scaling,
        silent: !drive.acknowledges,
        parameters: parameters(axis),
        captures: axis.events,
        feedback: axis.feedback,
    }
}
