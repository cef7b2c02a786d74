//! From a configuration to an engine and the adapters beside it.

pub mod can;
pub mod devicenet;
pub mod sercos;
pub mod startup;

use std::hash::{DefaultHasher, Hash, Hasher};
use std::net::Ipv4Addr;
use std::sync::Arc;

use arrayvec::{ArrayString, ArrayVec};
use profile_cip::assembly::Scale;
use profile_cip::device::axis_object::AxisConfig;
use profile_cip::device::axis_state::ControlKind;
use profile_cip::device::config::{
    AdapterConfig, DEVICE_TYPE_CIP_MOTION_CONVERTER, DEVICE_TYPE_CIP_MOTION_DRIVE,
    DEVICE_TYPE_CIP_MOTION_ENCODER, DEVICE_TYPE_GENERIC, IdentityConfig, InterfaceConfig, LinkConfig,
    MotionConfig, QosConfig,
};
use profile_cip::device::ethernet_link::{InterfaceType, LinkState};
use profile_cip::device::motion_device::DeviceConfig;
use profile_cip::wire::motion::Format;
use profile_generic::fault::Reaction;
use profile_generic::mode::{ModeSelection, OperatingMode};
use profile_generic::parameter::Parameter;
use profile_generic::quantity::Velocity;
use profile_generic::scaling::UnitKind;
use profile_generic::sequence::{SequenceTimes, StopMethod, StopPlan};
use profile_generic::time::DurationNs;

use super::assembly::{AssemblyAxis, AssemblyChannel};
use super::axis::{AxisChannel, HookupSettings, Limits, StopSettings};
use super::bus::can::failure::Misfit;
use super::bus::{self, AnyBus, Buses};
use super::device::{DeviceChannel, MemberConfig, StopDefaults};
use super::notice::Notice;
use super::{Engine, Parts};
use crate::config::{Axis, AxisFunction, AxisKind, Config, Device, DriveAt, StoppingAction, TimeSource};
use crate::eds;
use crate::latest::{self, Reader};
use crate::mapping::{CipProgram, CipScaling, FeedbackUse, Mapping};
use crate::north::{AdapterEnd, motion_link};
use crate::status::BoxStatus;

/// Notices kept until the supervisor takes them: for each axis what a phase-up brings, and never fewer than for 16.
const NOTICES_OF_AXIS: usize = 64;
const NOTICES_MIN: usize = 16 * NOTICES_OF_AXIS;

/// Largest connection sizes that a device takes, with the sequence count.
const CONNECTION_SIZE_MAX: u16 = 1400;

/// What a device needs from the start of a D-to-C update to its transmission, behind the step of a bus that begins `lead` before an
/// instant of the grid. With a bus that is locked to the controller, that step is as near to the start of the update cycle: an
/// update that waited for it would come too late as often as the cycle thread does.
const TRANSMISSION_PROCESSING: DurationNs = DurationNs::from_micros(50);

/// The whole of a box but its sockets and threads.
#[derive(Debug)]
pub struct Built {
    /// What runs in the cycle.
    pub engine: Engine,
    /// For each device the configuration of its explicit side and that side's end of the link.
    pub adapters: Vec<(AdapterConfig, AdapterEnd)>,
    /// What people should know.
    pub notices: rtrb::Consumer<Notice>,
    /// The status of the box.
    pub status: Reader<BoxStatus>,
    /// What commissions drives that come later: to be polled beside the cycle.
    pub commissioners: Commissioners,
}

/// Why a configuration makes no box.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// The master cannot work so.
    #[error("SERCOS master: {0}")]
    Master(#[from] profile_sercos::master::config::ConfigError),
    /// A CANopen master cannot work so.
    #[error("CANopen master of `{bus}`: {error}")]
    Can {
        /// The bus.
        bus: String,
        /// Why.
        error: profile_cia402::master::config::ConfigError,
    },
    /// A CANopen drive does not fit its PDOs, or has a mode that the tables do not have.
    #[error("axis {name}: {error}")]
    CanDrive {
        /// The axis.
        name: String,
        /// Why.
        error: Misfit,
    },
    /// A DeviceNet master cannot work so.
    #[error("DeviceNet master of `{network}`: {error}")]
    Devicenet {
        /// The network.
        network: String,
        /// Why.
        error: profile_cip::devicenet::master::config::ConfigError,
    },
    /// The tables make no program for a drive on DeviceNet.
    #[error("axis {name}: {error}")]
    DevicenetDrive {
        /// The axis.
        name: String,
        /// Why.
        error: crate::mapping::devicenet::DevicenetError,
    },
    /// A device cannot work so.
    #[error("device {name}: {error}")]
    Device {
        /// Its name.
        name: String,
        /// Why.
        error: super::device::ChannelError,
    },
    /// The mapping tables lack something that every box needs.
    #[error("axis {name}: the mapping tables have no {what}")]
    Tables {
        /// The axis.
        name: String,
        /// What is missing.
        what: &'static str,
    },
}

/// What is known of the host.
#[derive(Debug, Clone, Copy)]
pub struct Host {
    /// The master's Ethernet address where the configuration gives none.
    pub mac: [u8; 6],
    /// Differs from start to start, so that session handles do.
    pub incarnation: u16,
}

/// Builds the engine and everything it is connected to.
///
/// # Errors
/// See [`BuildError`].
pub fn build(config: &Config, mapping: Mapping, host: Host) -> Result<Built, BuildError> {
    let (buses, commissioners) = buses(config, host, &mapping)?;
    let axes = config.axes.iter().map(|axis| channel(axis, &mapping)).collect::<Result<Vec<_>, _>>()?;
    let (mut axes, programs): (Vec<_>, Vec<_>) = axes.into_iter().unzip();
    let mut devices = Vec::with_capacity(config.devices.len());
    let mut assemblies = Vec::new();
    let mut adapters = Vec::with_capacity(config.devices.len());
    for (number, device) in config.devices.iter().enumerate() {
        let members = members(config, number);
        let (adapter_end, device_end) = motion_link();
        let member = |(number, axis): &(usize, &Axis)| MemberConfig {
            axis: *number,
            scaling: scaling(axis),
            program: programs[*number].clone(),
            stops: stop_defaults(axis),
            feedback: axis.feedback,
        };
        let configs: Vec<_> = members.iter().map(member).collect();
        let number = u8::try_from(number).unwrap_or(u8::MAX);
        if let Some(layout) = &device.assembly {
            let of_assembly: Vec<_> =
                members.iter().map(|(number, axis)| assembly_axis(*number, axis)).collect();
            for (number, axis) in &members {
                axes[*number].set_stop_settings(assembly_stops(axis));
            }
            assemblies.push(AssemblyChannel::new(number, layout.clone(), device_end, &of_assembly));
            adapters.push((with_sheet(device, &members, host), adapter_end));
            continue;
        }
        let channel = DeviceChannel::new(
            number,
            device_config(device, &members, &mapping, config),
            device_end,
            configs,
            &mapping,
        )
        .map_err(|error| BuildError::Device { name: device.name.clone(), error })?;
        devices.push(channel);
        adapters.push((with_sheet(device, &members, host), adapter_end));
    }
    let (producer, notices) = rtrb::RingBuffer::new(NOTICES_MIN.max(config.axes.len() * NOTICES_OF_AXIS));
    let (publisher, status) = latest::latest(BoxStatus::STARTING);
    let lead = config.lead;
    let notices_in = producer;
    let parts = Parts { mapping, buses, devices, assemblies, axes, notices: notices_in, publisher, lead };
    let engine = Engine::new(parts);
    Ok(Built { engine, adapters, notices, status, commissioners })
}

/// The buses of a configuration in the order of their ports: SERCOS first, then those of CAN, then those of DeviceNet.
fn buses(config: &Config, host: Host, mapping: &Mapping) -> Result<(Buses, Commissioners), BuildError> {
    let mut list = Vec::new();
    let mut commissioners = Commissioners::default();
    if let Some(table) = &config.sercos {
        let (bus, commissioner) = sercos::bus(config, table, host, mapping)?;
        list.push(AnyBus::Sercos(Box::new(bus)));
        commissioners.sercos = Some(commissioner);
    }
    let first = list.len();
    for place in 0..config.can.len() {
        let (bus, commissioner) = can::bus(config, place, mapping)?;
        list.push(AnyBus::Can(Box::new(bus)));
        commissioners.can.push(commissioner);
    }
    let behind_can = list.len();
    for place in 0..config.devicenet.len() {
        let (bus, commissioner) = devicenet::bus(config, place, mapping)?;
        list.push(AnyBus::Devicenet(Box::new(bus)));
        commissioners.devicenet.push(commissioner);
    }
    let of = config.axes.iter().map(|axis| match axis.drive {
        DriveAt::Sercos { .. } => 0,
        DriveAt::Can { bus, .. } => first + bus,
        DriveAt::Devicenet { network, .. } => behind_can + network,
    });
    Ok((Buses::new(list, of.collect()), commissioners))
}

/// What commissions drives beside the cycle.
#[derive(Debug, Default)]
pub struct Commissioners {
    sercos: Option<bus::sercos::commissioner::Commissioner>,
    can: Vec<bus::can::commissioner::Commissioner>,
    devicenet: Vec<bus::devicenet::commissioner::Commissioner>,
}

impl Commissioners {
    /// Whether the cycle thread has gone.
    #[must_use]
    pub fn is_abandoned(&self) -> bool {
        self.sercos.iter().all(|one| one.is_abandoned())
            && self.can.iter().all(|one| one.is_abandoned())
            && self.devicenet.iter().all(|one| one.is_abandoned())
    }

    /// Does what there is to do, without waiting.
    pub fn poll(&mut self) {
        self.sercos.iter_mut().for_each(|one| one.poll());
        self.can.iter_mut().for_each(|one| one.poll());
        self.devicenet.iter_mut().for_each(|one| one.poll());
    }
}

fn kind(axis: &Axis) -> UnitKind {
    match axis.kind {
        AxisKind::Rotary => UnitKind::Rotary,
        AxisKind::Linear => UnitKind::Linear,
    }
}

/// Limits that the drive itself holds.
fn parameters(axis: &Axis) -> Vec<(Parameter, i64)> {
    let limits = &axis.limits;
    let mut parameters = Vec::new();
    let mut limit =
        |parameter: Parameter, value: Option<i64>| parameters.extend(value.map(|value| (parameter, value)));
    limit(Parameter::ACCELERATION_LIMIT, limits.acceleration.map(|value| value.0));
    limit(Parameter::DECELERATION_LIMIT, limits.acceleration.map(|value| value.0));
    limit(Parameter::TORQUE_LIMIT_POSITIVE, limits.torque.map(|value| value.0));
    limit(Parameter::TORQUE_LIMIT_NEGATIVE, limits.torque.map(|value| -value.0));
    limit(Parameter::POSITION_ERROR_TOLERANCE, limits.following_error.map(|value| value.0));
    parameters
}

/// The controller's counts as the configuration has them; a controller may set others.
#[must_use]
pub fn scaling(axis: &Axis) -> CipScaling {
    CipScaling {
        kind: kind(axis),
        nanounits_per_unit: profile_generic::scaling::NANO,
        counts_per_unit: i64::from(axis.motion_resolution),
        inverted: false,
        unwind: axis.unwind_counts.map(i64::from),
    }
}

/// An axis, and its program of the CIP side.
fn channel(axis: &Axis, mapping: &Mapping) -> Result<(AxisChannel, CipProgram), BuildError> {
    let missing = |what| BuildError::Tables { name: axis.name.clone(), what };
    let program =
        mapping.cip_program(&scaling(axis)).ok_or_else(|| missing("exact ratio for its resolution"))?;
    let limits = Limits {
        position_min: axis.limits.position_min,
        position_max: axis.limits.position_max,
        velocity: axis.limits.velocity,
        acceleration: axis.limits.acceleration,
        following_error: axis.limits.following_error,
        hookup: Some(HookupSettings::new(kind(axis), axis.limits.velocity, axis.limits.torque)),
    };
    let moves = axis.function == AxisFunction::Drive;
    let mut channel = AxisChannel::new(limits, reaction(axis.on_command_loss), moves);
    channel.set_count(program.count());
    channel.set_data(axis_data(axis));
    Ok((channel, program))
}

/// What the configuration has of motor and power stage.
fn axis_data(axis: &Axis) -> Vec<(Parameter, i64)> {
    let mut data = axis.nameplate.0.clone();
    data.push((Parameter::POWER_STRUCTURE_AXIS_ID, axis.power_structure_axis_id.into()));
    let is_of_load = axis.function == AxisFunction::Encoder && axis.feedback == FeedbackUse::Load;
    data.push((Parameter::FEEDBACK_MASTER, if is_of_load { 2 } else { 1 }));
    data
}

/// The modes that a drive is set up in: those that are wanted of it, else all that set-points lead.
fn modes(wanted: Option<&[ModeSelection]>) -> impl Iterator<Item = ModeSelection> + '_ {
    const LED: [OperatingMode; 3] = [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque];
    let all = wanted.is_none().then_some(LED).into_iter().flatten().map(ModeSelection::from);
    wanted.unwrap_or_default().iter().copied().chain(all)
}

/// A hundredth of the highest speed counts as standing, as the standard takes it of the rated one; where no limit is
/// given, 6 revolutions a minute or 1 mm/s.
fn stop_defaults(axis: &Axis) -> StopDefaults {
    let usual = match axis.kind {
        AxisKind::Rotary => 100_000_000,
        AxisKind::Linear => 1_000_000_000,
    };
    let zero_speed = axis.limits.velocity.map_or(usual, |limit| (limit.0 / 100).max(1));
    StopDefaults { zero_speed: Velocity(zero_speed), deceleration: axis.limits.acceleration }
}

/// How an axis of a device with assemblies stops, whoever controls it: on a ramp of its acceleration limit, or by the drive where it
/// has none, and without torque then.
fn assembly_stops(axis: &Axis) -> StopSettings {
    let StopDefaults { zero_speed, deceleration } = stop_defaults(axis);
    let method = if deceleration.is_some() { StopMethod::Ramp } else { StopMethod::Decelerate };
    StopSettings {
        plan: StopPlan { method, hold: false },
        times: SequenceTimes { zero_speed, ..SequenceTimes::default() },
        deceleration,
        ..StopSettings::default()
    }
}

/// An axis of a device with assemblies.
fn assembly_axis(number: usize, axis: &Axis) -> AssemblyAxis {
    AssemblyAxis {
        axis: number,
        instance: u16::from(axis.instance),
        scale: Scale {
            counts_per_unit: axis.motion_resolution,
            rated_torque: axis.nameplate.value(Parameter::MOTOR_RATED_TORQUE).unwrap_or(0),
        },
    }
}

/// What a lost command makes of the configured stopping action.
fn reaction(action: StoppingAction) -> Reaction {
    match action {
        StoppingAction::DisableAndCoast => Reaction::CoastAndDisable,
        StoppingAction::CurrentDecelAndDisable | StoppingAction::RampedDecelAndDisable => {
            Reaction::DecelerateAndDisable
        }
        StoppingAction::CurrentDecelAndHold | StoppingAction::RampedDecelAndHold => Reaction::HoldPosition,
    }
}

/// A device is what all of its axes are; one with several kinds is a drive with feedback-only axes or a converter of its
/// own.
fn device_type(members: &[(usize, &Axis)]) -> u16 {
    let all = |function| members.iter().all(|(_, axis)| axis.function == function);
    if all(AxisFunction::Encoder) {
        DEVICE_TYPE_CIP_MOTION_ENCODER
    } else if all(AxisFunction::Converter) {
        DEVICE_TYPE_CIP_MOTION_CONVERTER
    } else {
        DEVICE_TYPE_CIP_MOTION_DRIVE
    }
}

fn device_config(
    device: &Device,
    members: &[(usize, &Axis)],
    mapping: &Mapping,
    config: &Config,
) -> DeviceConfig {
    // Updates of the fixed format have no time stamps.
    let supports_sync = device.connection_format == Format::Variable;
    let measures_time = matches!(config.time.source, TimeSource::Ptp | TimeSource::Daemon);
    let threshold = u32::try_from(config.time.threshold.magnitude()).unwrap_or(u32::MAX);
    let axis = |(_, axis): &(usize, &Axis)| AxisConfig {
        kind: match axis.function {
            AxisFunction::Drive => ControlKind::Active,
            AxisFunction::Encoder => ControlKind::FeedbackOnly,
            AxisFunction::Converter => ControlKind::Converter,
        },
        // Position, velocity and torque; nothing can be enabled that is no drive.
        control_modes: if axis.function == AxisFunction::Drive { 1 << 1 | 1 << 2 | 1 << 4 } else { 0 },
        feedback_modes: mapping.cip.feedback_modes(axis.feedback),
        lint_position: true,
        // Motor and feedback, feedback; a drive shows the box neither its marker nor its phasing.
        hookup_tests: 0b11,
    };
    DeviceConfig {
        format: device.connection_format,
        axes: members.iter().map(axis).collect(),
        attributes: Vec::new(),
        power_structure_class_id: device.power_structure_class_id,
        supports_sync,
        sync_threshold: (supports_sync && measures_time).then_some(threshold),
        transmission_processing_ns: (config.lead + TRANSMISSION_PROCESSING).magnitude(),
    }
}

/// A number that differs between two configurations of a device and its axes.
fn configuration(device: &Device, members: &[(usize, &Axis)]) -> u16 {
    let mut hasher = DefaultHasher::new();
    format!("{device:?} {members:?}").hash(&mut hasher);
    let [low, high, ..] = hasher.finish().to_le_bytes();
    u16::from_le_bytes([low, high])
}

/// The explicit side of a device, with its electronic data sheet; `None` if there is no such device.
#[must_use]
pub fn adapter_config(config: &Config, number: usize, host: Host) -> Option<AdapterConfig> {
    Some(with_sheet(config.devices.get(number)?, &members(config, number), host))
}

/// The axes of a device in the order of their instances, with their numbers.
fn members(config: &Config, device: usize) -> Vec<(usize, &Axis)> {
    let mut members: Vec<_> = config.axes_of(device).collect();
    members.sort_by_key(|(_, axis)| axis.instance);
    members
}

fn with_sheet(device: &Device, members: &[(usize, &Axis)], host: Host) -> AdapterConfig {
    let mut adapter = without_sheet(device, members, host);
    adapter.eds = eds::sheet(device, &adapter).into_bytes().into();
    adapter
}

fn without_sheet(device: &Device, members: &[(usize, &Axis)], host: Host) -> AdapterConfig {
    let identity = &device.identity;
    let us =
        |span: profile_generic::time::DurationNs| u32::try_from(span.as_nanos() / 1000).unwrap_or(u32::MAX);
    // The host knows the mask; without one, that of the class of old.
    let netmask = if device.listen.is_loopback() {
        Ipv4Addr::new(255, 0, 0, 0)
    } else {
        Ipv4Addr::new(255, 255, 255, 0)
    };
    AdapterConfig {
        identity: IdentityConfig {
            vendor: identity.vendor_id,
            device_type: if device.assembly.is_some() { DEVICE_TYPE_GENERIC } else { device_type(members) },
            product_code: identity.product_code,
            major: identity.revision_major,
            minor: identity.revision_minor,
            serial_number: identity.serial_number,
            product_name: ArrayString::from(&identity.product_name).unwrap_or_default(),
            configuration: configuration(device, members),
        },
        interface: InterfaceConfig::new(device.listen, netmask),
        // The host knows more of it; it is told where there is a host.
        link: LinkConfig {
            mac: [0; 6],
            label: ArrayString::from(&device.name).unwrap_or_default(),
            interface_type: InterfaceType::Unknown,
            state: LinkState::default(),
        },
        qos: QosConfig::default(),
        motion: MotionConfig {
            format: device.connection_format,
            rpi_min_us: us(device.update_period_min),
            rpi_max_us: us(device.update_period_max),
            rpi_multiple_us: 1,
            o_to_t_size_max: CONNECTION_SIZE_MAX,
            t_to_o_size_max: CONNECTION_SIZE_MAX,
            power_structure_class_id: device.power_structure_class_id,
            power_structure_axis_ids: members
                .iter()
                .map(|(_, axis)| axis.power_structure_axis_id)
                .collect::<ArrayVec<_, 16>>(),
        },
        assembly: device.assembly.clone(),
        controllers: device.controllers.clone(),
        eds: Arc::new([]),
        incarnation: host.incarnation,
    }
}
