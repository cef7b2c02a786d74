//! The state of the whole gateway as one JSON object: the reply to `box`, and what `axisbridge status` shows.

use std::time::Duration;

use profile_cia402::drive::ErrorCode;
use profile_cia402::wire::emcy::ErrorRegister;
use profile_cip::device::visualization;
use profile_cip::wire::motion::codes::AxisStateCode;
use profile_generic::can::timing::BitRate;
use profile_generic::cast::f64_from_i64;
use profile_generic::image::{CommandSet, FeedbackSet};
use profile_generic::inhibit::Inhibits;
use profile_generic::quantity::Torque;
use profile_generic::state::DriveState;
use profile_sercos::master::station::Presence;
use profile_sercos::wire::device_control::Topology;
use profile_sercos::wire::device_status::{DeviceStatus, InactivePort};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::advice::advice;
use super::installation::{Installation, NamedBus, NamedDevice};
use super::protocol::unit;
use crate::config::TimeSource;
use crate::status::lateness::BOUNDS_NS;
use crate::status::pulse::silence;
use crate::status::{
    self, AxisStatus, BoxState, BoxStatus, BusDetail, BusStatus, Controller, NodeStatus, PHASE_NONE,
};
use crate::time::status::{Identity, TimeStatus};

/// Version of the object. It changes when a field gets another meaning, not when one is added.
pub const FORMAT: u32 = 1;

/// Nanounits in a unit.
const NANO: f64 = 1e9;

/// Microunits in a unit.
const MICRO: f64 = 1e6;

/// Thousandths in a unit.
const MILLI: f64 = 1e3;

/// Nanoseconds in an hour.
const NANO_PER_HOUR: f64 = 3_600.0 * NANO;

/// Millionths of the rated torque in a percent of it.
const PARTS_PER_PERCENT: f64 = 10_000.0;

/// A running gateway.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Overview {
    /// [`FORMAT`].
    pub format: u32,
    /// Its name in the configuration.
    pub name: String,
    /// Version of Axisbridge; empty if it is older than this field.
    #[serde(default)]
    pub version: String,
    /// `starting`, `phase_up`, `ready`, `running`, `bus_lost` or `stopping`.
    pub state: String,
    /// Why the cycle thread is not alive: all else here is as it was then. `null` while it is alive.
    #[serde(default)]
    pub silent: Option<String>,
    /// Communication phase of the SERCOS bus, where there is one.
    pub sercos_phase: Option<u8>,
    /// Open CIP Motion connections, and owners of assemblies.
    pub connections: u8,
    /// Seconds since the start.
    pub uptime_s: f64,
    /// How its cycles go.
    pub cycles: Cycles,
    /// System time.
    pub time: Time,
    /// The CIP Motion devices in the order of the configuration.
    #[serde(default)]
    pub devices: Vec<Device>,
    /// The SERCOS bus, the CANopen buses, the DeviceNet networks.
    #[serde(default)]
    pub buses: Vec<Bus>,
    /// The axes in the order of the configuration.
    pub axes: Vec<Axis>,
}

/// How the cycles go: counters since the start.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Cycles {
    /// Shortest cycle of all buses.
    pub cycle_ns: u32,
    /// Cycles of all buses.
    pub count: u64,
    /// Calls that were late by more than half a cycle.
    pub late: u64,
    /// Largest lateness of a call.
    pub latest_ns: u32,
    /// How late the calls were.
    #[serde(default)]
    pub lateness: Lateness,
    /// `free`, `pulling` or `locked`: how the buses follow system time, the least of all.
    pub phase_lock: String,
    /// Latest cycle after its instant of system time, the largest of all.
    pub phase_error_ns: i64,
    /// Updates of controllers that were lost or late.
    pub lost_updates: u64,
    /// Telegrams of drives that were not received in time.
    pub lost_telegrams: u64,
    /// Frames and datagrams that were malformed or from a stranger.
    pub refused_frames: u64,
    /// Frames and datagrams that could not be sent.
    pub send_failures: u64,
}

/// How late the calls of the cycle were, since the start: a histogram.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Lateness {
    /// Upper bounds of the classes.
    pub bounds_ns: Vec<u32>,
    /// Calls in each class, and last those that were later than the last bound.
    pub counts: Vec<u64>,
    /// Lateness of all calls together.
    pub sum_ns: u64,
}

/// System time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Time {
    /// The `source` of the configuration.
    pub source: String,
    /// Whether IsSynchronized is reported to controllers.
    pub synchronized: bool,
    /// In words, as the log has it.
    pub state: String,
    /// The grandmaster whose time it is.
    pub grandmaster: Option<String>,
    /// Offset from the master that the last Sync has shown.
    pub offset_ns: Option<i64>,
    /// Mean delay of the path to the master.
    pub path_delay_ns: Option<i64>,
    /// Bound of the error, where the source knows one.
    pub error_bound_ns: Option<u64>,
    /// Largest offset of a synchronized clock.
    pub threshold_ns: u64,
    /// Steps of the master's clock.
    pub steps: u32,
}

/// A CIP Motion device, as controllers see it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Device {
    /// Its name.
    pub name: String,
    /// The address of the gateway that it listens on.
    pub address: String,
    /// Address of the controller that is connected.
    pub controller: Option<String>,
    /// Controller Update Period of the connection.
    pub update_period_us: Option<u32>,
    /// Module Status indicator, such as `solid green`.
    pub module_status: String,
    /// Network Status indicator, such as `solid green`.
    pub network_status: String,
    /// Updates of controllers that were lost or late.
    pub lost_updates: u32,
}

/// A bus.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Bus {
    /// Its name, as the log has it: `SERCOS`, `CAN bus 1`, `DeviceNet 1`.
    pub name: String,
    /// Its interface, two for a ring, or `in-process`.
    pub interface: String,
    /// Whether every drive that answers is in cyclic operation.
    pub up: bool,
    /// SERCOS communication phase, 0 to 4.
    pub phase: Option<u8>,
    /// Its cycle.
    pub cycle_ns: u32,
    /// Cycles.
    pub cycles: u64,
    /// Telegrams of drives that were not received in time.
    pub lost_telegrams: u64,
    /// Frames that were received and refused.
    pub refused_frames: u64,
    /// `sercos`, `canopen` or `devicenet`; empty if the gateway is older than this field.
    #[serde(default)]
    pub kind: String,
    /// `free`, `pulling` or `locked`: how its cycles follow system time.
    #[serde(default)]
    pub phase_lock: String,
    /// Last cycle after its instant of system time.
    #[serde(default)]
    pub phase_error_ns: i64,
    /// What the network is, from the ports of the SERCOS master, such as `ring`.
    #[serde(default)]
    pub topology: Option<String>,
    /// Telegrams that the ports of the SERCOS master have lost: port 1, port 2.
    #[serde(default)]
    pub ports: Vec<PortCounters>,
    /// Nominal bit rate of a bus on CAN.
    #[serde(default)]
    pub bit_rate: Option<u32>,
    /// How long frames have occupied a bus on CAN, with all stuff bits that they can have: its change over time is the load.
    #[serde(default)]
    pub busy_ns: Option<u64>,
}

/// Telegrams that did not come back on a port of the SERCOS master, although the topology gives them back there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PortCounters {
    /// MDTs.
    pub lost_mdt: u32,
    /// ATs.
    pub lost_at: u32,
}

/// The node of an axis, as the master of its bus knows it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Node {
    /// How far its master has brought it, or whether it takes part, such as `active` or `operational`.
    pub state: String,
    /// SERCOS: its place in the network, from 1.
    pub place: Option<u16>,
    /// SERCOS: how it passes telegrams on, and what it sees on its inactive port.
    pub link: Option<String>,
    /// CANopen: state of its network management, as it has reported it.
    pub nmt: Option<String>,
    /// CANopen: its last EMCY.
    pub emcy: Option<String>,
    /// SERCOS: errors and warnings of its device status.
    pub conditions: Vec<String>,
    /// SERCOS: device status (S-DEV). DeviceNet: status of its Identity object.
    pub status: Option<u16>,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Axis {
    /// Its name.
    pub name: String,
    /// Its bus, by the name in `buses`.
    #[serde(default)]
    pub bus: String,
    /// Its drive.
    #[serde(default)]
    pub drive: String,
    /// Its device, where it is on one.
    #[serde(default)]
    pub device: Option<String>,
    /// State in the generic drive model.
    pub state: String,
    /// State that the controller sees (Axis State), where the axis is on a device.
    pub cip_state: Option<String>,
    /// `nobody`, `controller` or `local`.
    pub owner: String,
    /// Operating mode that the drive shows.
    pub mode: String,
    /// What the drive reports: the status bits that are set, such as `ready`, `power`, `enabled`.
    #[serde(default)]
    pub drive_status: Vec<String>,
    /// Axis Status indicator, such as `solid green`.
    #[serde(default)]
    pub axis_status: String,
    /// What the display of a CIP Motion drive would show.
    #[serde(default)]
    pub display: String,
    /// `rev` or `mm`.
    pub unit: String,
    /// Actual position, in the unit.
    pub position: f64,
    /// Actual velocity, in the unit per second.
    pub velocity: f64,
    /// Actual torque, percent of the rated torque.
    pub torque: f64,
    /// Commanded less actual position, in the unit.
    pub following_error: f64,
    /// The fault that stands.
    pub fault: Option<String>,
    /// What to do about it.
    #[serde(default)]
    pub advice: Option<String>,
    /// The drive's own code of it; 0 if it has reported none.
    pub drive_code: u32,
    /// What the axis has waited for, for longer than a second, in words.
    pub waits: Option<String>,
    /// Why it cannot be enabled.
    pub inhibits: Vec<String>,
    /// Bus cycles without fresh data from the drive.
    pub lost_telegrams: u32,
    /// Faults that have occurred.
    #[serde(default)]
    pub faults: u32,
    /// Its drive on the bus, such as `address 3`, `node 5` or `MAC ID 7`.
    #[serde(default)]
    pub address: String,
    /// The node of its drive, as far as it is known.
    #[serde(default)]
    pub node: Option<Node>,
    /// Position set-point as the drive has got it last, in the unit.
    #[serde(default)]
    pub position_command: Option<f64>,
    /// Velocity set-point as the drive has got it last, in the unit per second.
    #[serde(default)]
    pub velocity_command: Option<f64>,
    /// Torque set-point as the drive has got it last, percent of the rated torque.
    #[serde(default)]
    pub torque_command: Option<f64>,
    /// Motor current in ampere, where the telegram of the drive has it.
    #[serde(default)]
    pub current: Option<f64>,
    /// Voltage of the DC bus in volt, where the telegram of the drive has it.
    #[serde(default)]
    pub bus_voltage: Option<f64>,
    /// Temperature of the motor in degrees Celsius, where the telegram of the drive has it.
    #[serde(default)]
    pub temperature: Option<f64>,
    /// Time in operation, hours; counted over restarts where there is a `[history]`.
    #[serde(default)]
    pub run_hours: f64,
    /// Revolutions of the motor in both directions, counted alike; 0 where its gear is not known.
    #[serde(default)]
    pub motor_turns: f64,
}

impl Overview {
    /// The overview of a status that was published just now.
    #[must_use]
    pub fn of(known: &Installation, status: &BoxStatus, time: &TimeStatus) -> Self {
        let counters = &status.counters;
        let axes = status.configured_axes().iter().take(known.axes.len()).enumerate();
        let devices = known.devices.iter().enumerate();
        let buses = known.buses.iter().zip(status.configured_buses());
        Self {
            format: FORMAT,
            name: known.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            state: status.state.to_string(),
            silent: silence(status, Duration::ZERO),
            sercos_phase: Some(status.phase).filter(|phase| *phase != PHASE_NONE),
            connections: status.connections,
            uptime_s: f64_from_i64(status.uptime.0) / NANO,
            cycles: Cycles {
                cycle_ns: status.cycle_time_ns,
                count: counters.cycles,
                late: counters.late_cycles,
                latest_ns: status.lateness_max_ns,
                lateness: Lateness::of(&status.lateness),
                phase_lock: status.phase_lock.state.name().to_owned(),
                phase_error_ns: status.phase_lock.error.0,
                lost_updates: counters.lost_updates,
                lost_telegrams: counters.lost_telegrams,
                refused_frames: counters.refused_frames,
                send_failures: counters.send_failures,
            },
            time: Time::of(known.source, time),
            devices: devices.map(|(number, device)| Device::of(number, device, status)).collect(),
            buses: buses.map(|(bus, status)| Bus::of(bus, status)).collect(),
            axes: axes.map(|(number, axis)| Axis::of(known, number, axis)).collect(),
        }
    }

    /// Whether all buses are in cyclic operation.
    #[must_use]
    pub fn is_up(&self) -> bool {
        [BoxState::READY, BoxState::RUNNING].iter().any(|state| self.state == state.to_string())
    }

    /// What is missing, by name: a living cycle thread, a bus in cyclic operation, a commissioned drive, an axis without fault.
    #[must_use]
    pub fn missing(&self) -> Vec<String> {
        let mut missing: Vec<String> = self.silent.iter().cloned().collect();
        // What the state of the whole gateway lacks that no bus lacks.
        let stops = self.state == BoxState::STOPPING.to_string();
        missing.extend(stops.then(|| "the gateway stops".to_owned()));
        missing.extend(self.buses.iter().filter_map(missing_at_bus));
        missing.extend(self.axes.iter().filter_map(missing_at_axis));
        missing
    }

    /// Whether all is well: nothing is missing, and time is synchronized if there is to be one.
    #[must_use]
    pub fn is_healthy(&self) -> bool {
        let timed = self.time.synchronized || self.time.source == TimeSource::None.name();
        self.is_up() && timed && self.missing().is_empty()
    }
}

fn missing_at_bus(bus: &Bus) -> Option<String> {
    let phase = bus.phase.map(|phase| format!(" (CP{phase})")).unwrap_or_default();
    (!bus.up).then(|| format!("bus {}: not in cyclic operation{phase}", bus.name))
}

fn missing_at_axis(axis: &Axis) -> Option<String> {
    let name = &axis.name;
    if let Some(fault) = &axis.fault {
        return Some(format!("axis {name}: fault {fault}"));
    }
    let no_drive = Inhibits::NAMED.iter().find(|(inhibit, _)| *inhibit == Inhibits::NO_DRIVE);
    let waits = no_drive.is_some_and(|(_, name)| axis.inhibits.iter().any(|inhibit| inhibit == name));
    let initialises = axis.state == DriveState::NotReady.name();
    (waits || initialises).then(|| format!("axis {name}: its drive {} is not commissioned", axis.drive))
}

impl Lateness {
    fn of(lateness: &status::Lateness) -> Self {
        Self { bounds_ns: BOUNDS_NS.to_vec(), counts: lateness.counts.to_vec(), sum_ns: lateness.sum_ns }
    }
}

impl Time {
    fn of(source: TimeSource, time: &TimeStatus) -> Self {
        let measured = matches!(source, TimeSource::Ptp | TimeSource::Daemon | TimeSource::Host);
        Self {
            source: source.name().to_owned(),
            synchronized: time.phase.is_synchronized(),
            state: time.phase.to_string(),
            grandmaster: time.grandmaster.map(|grandmaster| Identity(grandmaster).to_string()),
            offset_ns: time.offset_from_master,
            path_delay_ns: time.mean_path_delay,
            error_bound_ns: Some(time.error_bound).filter(|bound| measured && *bound != u64::MAX),
            threshold_ns: time.threshold,
            steps: time.steps,
        }
    }
}

impl Device {
    fn of(number: usize, device: &NamedDevice, status: &BoxStatus) -> Self {
        // Every axis of a device shows the state of the device alike.
        let axis = status.configured_axes().iter().find(|axis| usize::from(axis.device) == number);
        let axis = axis.unwrap_or(&AxisStatus::NONE);
        let controller = axis.controller;
        Self {
            name: device.name.clone(),
            address: device.address.to_string(),
            controller: controller.map(|Controller { address, .. }| address.to_string()),
            update_period_us: controller.map(|controller| controller.update_period_us),
            module_status: visualization::module_status(axis.indicators.module).to_string(),
            network_status: axis.indicators.network.to_string(),
            lost_updates: axis.lost_updates,
        }
    }
}

impl Bus {
    fn of(bus: &NamedBus, status: &BusStatus) -> Self {
        Self {
            name: bus.name.clone(),
            interface: bus.interface.clone(),
            up: status.up,
            phase: Some(status.phase).filter(|phase| *phase != PHASE_NONE),
            cycle_ns: status.cycle_time_ns,
            cycles: status.cycles,
            lost_telegrams: status.lost_telegrams,
            refused_frames: status.refused_frames,
            kind: bus.kind.name().to_owned(),
            phase_lock: status.phase_lock.state.name().to_owned(),
            phase_error_ns: status.phase_lock.error.0,
            topology: match status.detail {
                BusDetail::Sercos { topology, .. } => Some(topology.to_string()),
                BusDetail::Can { .. } | BusDetail::None => None,
            },
            ports: match status.detail {
                BusDetail::Sercos { lost, .. } => {
                    lost.map(|port| PortCounters { lost_mdt: port.mdt, lost_at: port.at }).to_vec()
                }
                BusDetail::Can { .. } | BusDetail::None => Vec::new(),
            },
            bit_rate: bus.bit_rate.map(BitRate::nominal),
            busy_ns: match (status.detail, bus.bit_rate) {
                (BusDetail::Can { nominal, data }, Some(rate)) => Some(busy_ns(rate, nominal, data)),
                _ => None,
            },
        }
    }
}

/// How long so many bits take.
fn busy_ns(rate: BitRate, nominal: u64, data: u64) -> u64 {
    let span = |bits: u64, rate: u32| u128::from(bits) * 1_000_000_000 / u128::from(rate.max(1));
    let sum = span(nominal, rate.nominal()) + span(data, rate.data().unwrap_or(rate.nominal()));
    u64::try_from(sum).unwrap_or(u64::MAX)
}

impl Node {
    fn of(node: NodeStatus) -> Option<Self> {
        let known = |state: String| Self {
            state,
            place: None,
            link: None,
            nmt: None,
            emcy: None,
            conditions: Vec::new(),
            status: None,
        };
        match node {
            NodeStatus::Unknown => None,
            NodeStatus::Sercos { place, presence, status } => Some(Self {
                place: Some(place),
                link: status.map(link),
                conditions: status
                    .iter()
                    .flat_map(|status| status.condition_names())
                    .map(str::to_owned)
                    .collect(),
                status: status.map(|status| status.bits()),
                ..known(presence_name(presence).to_owned())
            }),
            NodeStatus::Can { state, nmt, emcy } => Some(Self {
                nmt: nmt.map(|nmt| nmt.to_string()),
                emcy: emcy.map(|(code, register)| emergency(ErrorCode(code), register)),
                ..known(state.to_string())
            }),
            NodeStatus::Devicenet { phase, status } => Some(Self { status, ..known(phase.to_string()) }),
        }
    }
}

const fn presence_name(presence: Presence) -> &'static str {
    match presence {
        Presence::Active => "active",
        Presence::Lost => "lost",
        Presence::Excluded => "excluded",
        Presence::Absent => "absent",
        Presence::Joining => "joining",
    }
}

/// How a slave passes telegrams on, and what it sees on the port that it does not pass them to.
fn link(status: DeviceStatus) -> String {
    let inactive = match status.inactive_port() {
        InactivePort::NoLink => "no link",
        InactivePort::Link => "a link without telegrams",
        InactivePort::PrimaryTelegram => "P telegrams",
        InactivePort::SecondaryTelegram => "S telegrams",
    };
    match status.topology() {
        Topology::FastForward => "passes telegrams on".to_owned(),
        Topology::LoopbackForwardPrimary => format!("turns P telegrams round, {inactive} on the other port"),
        Topology::LoopbackForwardSecondary => {
            format!("turns S telegrams round, {inactive} on the other port")
        }
        Topology::StoreAndForward => "passes on other frames only".to_owned(),
    }
}

fn emergency(code: ErrorCode, register: ErrorRegister) -> String {
    let name = code.name().map(|name| format!(" ({name})")).unwrap_or_default();
    format!("{:04X}{name}, error register {register}", code.0)
}

impl Axis {
    fn of(known: &Installation, number: usize, axis: &AxisStatus) -> Self {
        let units = |nano: i64| f64_from_i64(nano) / NANO;
        let named = &known.axes[number];
        let image = &axis.image;
        let command = |set: CommandSet, value: f64| image.commands.contains(set).then_some(value);
        let actual = |set: FeedbackSet, value: i64, scale: f64| {
            image.actual.contains(set).then(|| f64_from_i64(value) / scale)
        };
        let percent = |torque: Torque| f64_from_i64(torque.get()) / PARTS_PER_PERCENT;
        let device = known.devices.get(usize::from(axis.device)).filter(|_| axis.instance != 0);
        Self {
            name: named.name.clone(),
            bus: known.bus_of(number).map(|bus| bus.name.clone()).unwrap_or_default(),
            drive: named.drive.clone(),
            device: device.map(|device| device.name.clone()),
            state: axis.state.to_string(),
            cip_state: (axis.instance != 0).then(|| AxisStateCode(axis.cip_axis_state).to_string()),
            owner: axis.owner.name().to_owned(),
            mode: axis.mode.to_string(),
            drive_status: lower_case(axis.status.iter_names().map(|(name, _)| name)),
            axis_status: axis.indicators.axis.to_string(),
            display: axis.display().to_string(),
            unit: unit(named.kind).to_owned(),
            position: units(axis.position.get()),
            velocity: units(axis.velocity.get()),
            torque: percent(axis.torque),
            following_error: units(axis.following_error.get()),
            fault: axis.fault.map(|fault| fault.to_string()),
            advice: axis.fault.map(|fault| advice(fault).to_owned()),
            drive_code: axis.fault_vendor_code,
            waits: axis.wait.map(|wait| wait.to_string()),
            inhibits: lower_case(axis.inhibits.iter_names().map(|(name, _)| name)),
            lost_telegrams: axis.lost_telegrams,
            faults: axis.faults,
            address: named.address.clone(),
            node: Node::of(axis.node),
            position_command: command(CommandSet::POSITION, units(image.position_command.get())),
            velocity_command: command(CommandSet::VELOCITY, units(image.velocity_command.get())),
            torque_command: command(CommandSet::TORQUE, percent(image.torque_command)),
            current: actual(FeedbackSet::CURRENT, image.current.get(), MICRO),
            bus_voltage: actual(FeedbackSet::BUS_VOLTAGE, image.bus_voltage.get(), MICRO),
            temperature: actual(FeedbackSet::TEMPERATURE, image.temperature.get(), MILLI),
            run_hours: f64_from_i64(axis.totals.run_time.0) / NANO_PER_HOUR,
            motor_turns: f64_from_i64(axis.totals.motor_turns) / MICRO,
        }
    }
}

fn lower_case<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    names.map(str::to_ascii_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::super::installation::tests::installation;
    use super::*;
    use crate::status::tests::distinct;
    use crate::time::judge::{Reason, SyncPhase};
    use crate::time::status::tests::synchronized;

    fn overview() -> Overview {
        Overview::of(&installation(), &distinct(), &synchronized())
    }

    #[test]
    fn every_value_is_in_the_object() {
        // The version changes with each release.
        let overview = Overview { version: "VERSION".to_owned(), ..overview() };
        insta::assert_snapshot!(serde_json::to_string_pretty(&overview).unwrap());
    }

    #[test]
    fn health_is_everything_there_without_fault_and_time_where_there_is_to_be_one() {
        let mut good = overview();
        good.buses.iter_mut().for_each(|bus| bus.up = true);
        good.axes[1] = good.axes[0].clone();
        assert!(good.is_healthy());
        let mut faulted = good.clone();
        faulted.axes[1].fault = Some("over_current".to_owned());
        let down = Overview { state: "bus_lost".to_owned(), ..good.clone() };
        let mut untimed = good.clone();
        (untimed.time.synchronized, untimed.time.state) =
            (false, SyncPhase::Uncalibrated(Reason::Offset).to_string());
        let silent = Some("the cycle thread has published nothing for 5 s".to_owned());
        let standing = Overview { silent, ..good.clone() };
        let (mut missing, mut starting) = (good.clone(), good.clone());
        missing.axes[1].inhibits = vec!["no_drive".to_owned()];
        starting.axes[1].state = "not_ready".to_owned();
        for bad in [&faulted, &down, &untimed, &standing, &missing, &starting] {
            assert!(!bad.is_healthy(), "{bad:?}");
        }
        untimed.time.source = "none".to_owned();
        assert!(untimed.is_healthy(), "nobody wants to know the time");
    }
}
