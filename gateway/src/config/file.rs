//! The configuration file as it is written. Every key that is not listed here is an error. The doc comments are the descriptions of the
//! JSON Schema; `docs/reference/configuration.md` has the same keys.
//!
//! Times are strings with a unit: `"2 ms"`, `"31.25 us"`, `"31250 ns"`, `"1 s"`. Names are 1 to 32 letters,
//! digits, `-` and `_`. Positions count in axis units: revolutions or millimetres.

use schemars::JsonSchema;
use serde::Deserialize;

use super::scalar::Scalar;
use super::{check, form};
use crate::finding::Spanned;
use crate::mapping::{Cia402Type, VOLTAGE_BIT};
use crate::parameter::startup::OnDifference;

/// The whole file.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// The gateway itself.
    #[serde(rename = "box")]
    pub the_box: BoxTable,
    /// System time. Default: the host's clock.
    pub time: Option<TimeTable>,
    /// Logging. Default: level `info`.
    pub log: Option<LogTable>,
    /// The history of faults. Default: in memory only.
    pub history: Option<HistoryTable>,
    /// The Modbus TCP server. Default: none.
    pub modbus: Option<ModbusTable>,
    /// The rolling recording of all sides. Default: on, with the defaults of its keys.
    pub recording: Option<RecordingTable>,
    /// The HTTP server with the state of the gateway. Default: none.
    pub http: Option<HttpTable>,
    /// Mapping tables. Default: the built-in ones.
    pub mappings: Option<MappingsTable>,
    /// The devices seen by controllers, at least one.
    #[schemars(length(min = 1, max = 64))]
    pub device: Vec<Spanned<DeviceTable>>,
    /// The axes, at least one, at most 64.
    #[schemars(length(min = 1, max = 64))]
    pub axis: Vec<Spanned<AxisTable>>,
    /// The buses.
    pub south: Spanned<SouthTable>,
}

/// `[box]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxTable {
    /// Name of the gateway in logs, recordings and the status block.
    #[schemars(transform = form::label)]
    pub name: Spanned<String>,
    /// File for the settings that controllers make over the network, relative to the folder of this file. Default: none, and settings
    /// last until the process ends.
    #[schemars(transform = form::path)]
    pub settings_file: Option<Spanned<String>>,
}

/// `[time]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimeTable {
    /// Source of system time: `"ptp"` follows PTP (CIP Sync), `"daemon"` takes the time from `ptp4l` on this host, `"host"` is the host's clock while a daemon keeps it, `"shared"` is the
    /// host's clock where controllers read the same one, `"none"` is no common time. Default: `"shared"` if every device listens on
    /// a loopback address, else `"host"`.
    #[schemars(transform = form::word(&check::time::SOURCES))]
    pub source: Option<Spanned<String>>,
    /// Interface on which PTP is followed. Default: that of the first device's address.
    #[schemars(transform = form::interface)]
    pub interface: Option<Spanned<String>>,
    /// PTP domain, 0 to 127. Default: 0.
    #[schemars(range(min = 0, max = 127))]
    pub domain: Option<Spanned<i64>>,
    /// Largest offset of a clock that is called synchronized, 1 us to 10 ms. Default: 10 us.
    #[schemars(transform = form::time)]
    pub threshold: Option<Spanned<String>>,
    /// By how much the way from the master is longer than the mean of both ways, 0 to 10 ms. Default: 0.
    #[schemars(transform = form::time)]
    pub asymmetry: Option<Spanned<String>>,
    /// The way to the master is the longer one. Default: false.
    pub asymmetry_is_upstream: Option<bool>,
    /// PTP is followed with the time stamps of the network card where it has some. Default: true.
    pub card_stamps: Option<bool>,
    /// Management socket of `ptp4l`. Default: `"/var/run/ptp4l"`.
    #[schemars(transform = form::path)]
    pub socket: Option<Spanned<String>>,
    /// Clock of the network card that `ptp4l` keeps, such as `"/dev/ptp0"`. Default: that of the interface; without one the host's
    /// clock.
    #[schemars(transform = form::path)]
    pub phc: Option<Spanned<String>>,
}

/// `[log]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogTable {
    /// `"error"`, `"warn"`, `"info"`, `"debug"` or `"trace"`. Default: `"info"`.
    #[schemars(transform = form::word(&check::log_levels()))]
    pub level: Option<Spanned<String>>,
}

/// `[history]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HistoryTable {
    /// Directory in which the history of faults and the counters of the axes are kept, relative to the folder of this file. It is made if it
    /// is not there.
    #[schemars(transform = form::path)]
    pub directory: Spanned<String>,
}

/// `[recording]`
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RecordingTable {
    /// Length of the longest recording that can be taken, 0 to 600; 0 keeps no frames. Default: 10.
    #[schemars(range(min = 0, max = 600))]
    pub seconds: Option<Spanned<i64>>,
    /// Memory for frames, `"2 MB"` to `"1 GB"`: half for the last seconds, half for the first contacts. Default: `"16 MB"`.
    #[schemars(transform = form::size)]
    pub memory: Option<Spanned<String>>,
}

/// `[modbus]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModbusTable {
    /// Address and port, such as `"0.0.0.0:502"`.
    #[schemars(transform = form::socket_address)]
    pub listen: Spanned<String>,
    /// Hosts that are served, addresses or networks such as `"192.168.1.0/24"`. Default: every host.
    #[schemars(transform = form::hosts, length(max = 64))]
    pub clients: Option<Spanned<Vec<Spanned<String>>>>,
    /// Clients that can be connected at the same time, 1 to 64. Default: 8.
    #[schemars(range(min = 1, max = 64))]
    pub clients_max: Option<Spanned<i64>>,
    /// Registers that are parameters of drives, at most 256.
    #[serde(default)]
    #[schemars(length(max = 256))]
    pub parameter: Vec<Spanned<ModbusParameterTable>>,
}

/// `[[modbus.parameter]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModbusParameterTable {
    /// The first register, 4160 to 65532.
    #[schemars(range(min = 4160, max = 65_532))]
    pub register: Spanned<i64>,
    /// Size and sign of the value: `u16`, `i32` (default), `u32` or `i64`, in 1, 2, 2 or 4 registers.
    #[serde(rename = "type")]
    #[schemars(transform = form::word(&check::modbus::REGISTER_KINDS))]
    pub kind: Option<Spanned<String>>,
    /// The axis whose drive has the parameter.
    pub axis: Spanned<String>,
    /// The parameter, which an overlay defines.
    pub parameter: Spanned<String>,
    /// Whether clients may write it while nobody controls the axis. Default: false.
    #[serde(default)]
    pub write: bool,
}

/// `[http]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HttpTable {
    /// Address and port, such as `"127.0.0.1:8080"`.
    #[schemars(transform = form::socket_address)]
    pub listen: Spanned<String>,
    /// Hosts that are served, addresses or networks such as `"192.168.1.0/24"`. Default: every host.
    #[schemars(transform = form::hosts, length(max = 64))]
    pub clients: Option<Spanned<Vec<Spanned<String>>>>,
    /// Connections that can be open at the same time, 8 to 256; a page that is looked at holds one, and pages at most half of them.
    /// Default: 64.
    #[schemars(range(min = 8, max = 256))]
    pub connections_max: Option<Spanned<i64>>,
    /// File with the hash of the token that lets people control axes, which `axisbridge token` writes, relative to the folder of this file.
    /// Default: none, and nobody controls axes over HTTP.
    #[schemars(transform = form::path)]
    pub token: Option<Spanned<String>>,
    /// File with the certificate of the server and those that have signed it (PEM), relative to the folder of this file. Default: none, and
    /// nothing is encrypted.
    #[schemars(transform = form::path)]
    pub certificate: Option<Spanned<String>>,
    /// File with the private key of the certificate (PEM), relative to the folder of this file.
    #[schemars(transform = form::path)]
    pub key: Option<Spanned<String>>,
    /// Whether the token may cross the network without encryption. Default: false.
    pub plain: Option<Spanned<bool>>,
}

/// `[mappings]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MappingsTable {
    /// Folder of dictionaries and mapping tables to use instead of the built-in ones, relative to the folder of this file.
    #[schemars(transform = form::path)]
    pub dir: Option<Spanned<String>>,
    /// Files, or folders of files, with rows that are laid over the tables in this order, relative to the folder of this file.
    #[serde(default)]
    #[schemars(inner(length(min = 1)))]
    pub overlays: Vec<Spanned<String>>,
}

/// `[[device]]`: a CIP Motion device.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DeviceTable {
    /// Name, unique among devices.
    #[schemars(transform = form::name)]
    pub name: Spanned<String>,
    /// An IPv4 address of this host, one for each device; TCP and UDP 44818 and UDP 2222 are used on it.
    #[schemars(transform = form::own_address)]
    pub listen: Spanned<String>,
    /// Names of its axes.
    #[schemars(length(min = 1))]
    pub axes: Spanned<Vec<Spanned<String>>>,
    /// Hosts that may own the device and change anything in it, addresses or networks such as `"192.168.1.0/24"`. Default: every host.
    #[schemars(transform = form::hosts_v4, length(max = 64))]
    pub controllers: Option<Spanned<Vec<Spanned<String>>>>,
    /// Further hosts that are served; they read and listen only if there are `controllers`. Default: every host.
    #[schemars(transform = form::hosts_v4, length(max = 64))]
    pub tools: Option<Spanned<Vec<Spanned<String>>>>,
    /// What the device reports in its Identity object.
    pub identity: IdentityTable,
    /// Drive Power Structure Class ID (class attribute 34), which controllers may check when they connect. Default: 0, each axis has its
    /// own.
    #[schemars(range(min = 0, max = u32::MAX))]
    pub power_structure_class_id: Option<Spanned<i64>>,
    /// Format of the motion connection: `"variable"`, or `"fixed"` (16 bytes) for a device with one axis. Default:
    /// `"variable"`.
    #[schemars(transform = form::word(&check::device::FORMATS))]
    pub connection_format: Option<Spanned<String>>,
    /// The controller update periods (RPI) it accepts.
    pub update_period: Option<UpdatePeriodTable>,
    /// Makes it a device with assemblies, which any class 1 scanner can connect to, in place of a CIP Motion device.
    pub assembly: Option<Spanned<AssemblyTable>>,
}

/// `[device.assembly]`. Either `layout`, or `output` and `input`. `drive_mode` and `torque_scale` go with the layouts `"speed-torque"` and
/// `"speed-torque-basic"` only.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AssemblyTable {
    /// A shipped layout: `"position"`, `"motion"`, `"speed"`, `"speed-basic"`, `"speed-torque"`, `"speed-torque-basic"` or `"mixed"`.
    /// Default: `"position"`, unless fields are given.
    #[schemars(transform = form::word(&check::assembly::LAYOUTS))]
    pub layout: Option<Spanned<String>>,
    /// Fields that each axis has in the output assembly, in their order; with `control` and `mode`.
    #[schemars(transform = form::list_of(&check::assembly::output_fields()))]
    pub output: Option<Spanned<Vec<Spanned<String>>>>,
    /// Fields that each axis has in the input assembly, in their order; with `status`.
    #[schemars(transform = form::list_of(&check::assembly::input_fields()))]
    pub input: Option<Spanned<Vec<Spanned<String>>>>,
    /// Which reference of `"speed-torque"` and `"speed-torque-basic"` moves the axis: `"speed"` or `"torque"`. To be given with these
    /// layouts.
    #[schemars(transform = form::word(&check::assembly::drive_modes()))]
    pub drive_mode: Option<Spanned<String>>,
    /// TorqueScale, -15 to 15: torque is in Nm / 2^TorqueScale. Default: 0.
    #[schemars(range(min = -15, max = 15))]
    pub torque_scale: Option<Spanned<i64>>,
}

/// `identity` of a `[[device]]`. The device type follows from the axes: 47, CIP Motion Encoder, if all of them are encoders; 48, CIP Motion
/// Converter, if all are converters; otherwise 37, CIP Motion Drive.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdentityTable {
    /// Vendor number given by ODVA, 1 to 65535.
    #[schemars(range(min = 1, max = 65535))]
    pub vendor_id: Spanned<i64>,
    /// Name of that vendor in the electronic data sheet; printable ASCII, 1 to 32 characters. Default: `"Vendor"` and the
    /// number.
    #[schemars(transform = form::label)]
    pub vendor_name: Option<Spanned<String>>,
    /// The vendor's number of the product, 1 to 65535.
    #[schemars(range(min = 1, max = 65535))]
    pub product_code: Spanned<i64>,
    /// Major and minor revision, such as `"1.1"` (1 to 127, 1 to 255). Default: `"1.1"`.
    #[schemars(transform = form::revision)]
    pub revision: Option<Spanned<String>>,
    /// Catalogue number in the electronic data sheet; printable ASCII, 1 to 32 characters. Default: the product name.
    #[schemars(transform = form::label)]
    pub catalog: Option<Spanned<String>>,
    /// Serial number, 1 to 4294967295, unique among all pieces of the vendor.
    #[schemars(range(min = 1, max = u32::MAX))]
    pub serial_number: Spanned<i64>,
    /// Printable ASCII, 1 to 32 characters. Default: `"Axisbridge"`.
    #[schemars(transform = form::label)]
    pub product_name: Option<Spanned<String>>,
}

/// `update_period` of a `[[device]]`; both from `250 us` to `100 ms`, in whole microseconds.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UpdatePeriodTable {
    /// Shortest period, at least a quarter of the bus cycle. Default: `"1 ms"`, or the bus cycle if that is longer.
    #[schemars(transform = form::time)]
    pub min: Option<Spanned<String>>,
    /// Longest period. Default: `"32 ms"`, or the bus cycle if that is longer.
    #[schemars(transform = form::time)]
    pub max: Option<Spanned<String>>,
}

/// `[[axis]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisTable {
    /// Name, unique among axes.
    #[schemars(transform = form::name)]
    pub name: Spanned<String>,
    /// Instance of the Motion Device Axis Object, 1 to 255, unique in its device.
    #[schemars(range(min = 1, max = 255))]
    pub instance: Spanned<i64>,
    /// Name of its drive. Each drive serves one axis.
    pub drive: Spanned<String>,
    /// What the axis is: `"drive"`, controlled in motion; `"encoder"`, a feedback-only axis that is never switched on; `"converter"`, a
    /// supply of the DC bus. Encoders and converters take neither `limits` nor `on_command_loss`. Default: `"drive"`.
    #[schemars(transform = form::word(&check::axis::functions()))]
    pub function: Option<Spanned<String>>,
    /// `"revolution"` for a rotary axis, `"millimetre"` for a linear one.
    #[schemars(transform = form::word(&check::axis::UNITS))]
    pub unit: Spanned<String>,
    /// Encoder that the position of the axis is of, and over which the drive closes its position loop: `"motor"`; `"dual"`, that of the
    /// load, while the velocity is the motor's; `"load"`, both are the load's. Not on DeviceNet. Default: `"motor"`.
    #[schemars(transform = form::word(&check::axis::feedback_uses()))]
    pub feedback: Option<Spanned<String>>,
    /// Position counts of the controller in one unit, 1 to 2147483647. Default: 1000000.
    #[schemars(range(min = 1, max = 2_147_483_647))]
    pub motion_resolution: Option<Spanned<i64>>,
    /// Position counts in one turn of an unlimited (modulo) axis, 1 to 2147483647. Default: a limited axis.
    #[schemars(range(min = 1, max = 2_147_483_647))]
    pub unwind_counts: Option<Spanned<i64>>,
    /// Drive Power Structure Axis ID (attribute 725). Default: 0.
    #[schemars(range(min = 0, max = u32::MAX))]
    pub power_structure_axis_id: Option<Spanned<i64>>,
    /// Limits that the gateway enforces. Default: only those of the drive.
    pub limits: Option<LimitsTable>,
    /// What the axis does when commands stay away: `"disable-and-coast"`, `"current-decel-and-disable"`,
    /// `"ramped-decel-and-disable"`, `"current-decel-and-hold"` or `"ramped-decel-and-hold"`. Default:
    /// `"ramped-decel-and-disable"`.
    #[schemars(transform = form::word(&check::axis::stopping_actions()))]
    pub on_command_loss: Option<Spanned<String>>,
    /// Data of the motor that the drive does not show. Default: only what the drive shows.
    pub motor: Option<MotorTable>,
    /// Data of the power stage that the drive does not show. Default: only what the drive shows.
    pub converter: Option<ConverterTable>,
    /// Data of the motor's encoder that the drive does not show. Default: only what the drive shows.
    pub encoder: Option<EncoderTable>,
    /// Data of the control loops that the drive does not show. Default: only what the drive shows.
    pub loops: Option<LoopsTable>,
    /// How the captures of the drive are read: `cyclic`, `service-channel` or `off`. Default: `cyclic` on SERCOS, `service-channel` (SDO)
    /// on CAN.
    #[schemars(transform = form::word(&check::axis::EVENTS))]
    pub events: Option<Spanned<String>>,
}

/// `limits` of an `[[axis]]`. A limit that is not given is left to the drive.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = form::together(&[("position_min", "position_max"), ("position_max", "position_min")]))]
pub struct LimitsTable {
    /// Lowest position command, in axis units. Only for a limited axis, and together with `position_max`.
    pub position_min: Option<Spanned<f64>>,
    /// Highest position command, in axis units.
    pub position_max: Option<Spanned<f64>>,
    /// Highest speed in either direction, in axis units per second.
    #[schemars(transform = form::positive)]
    pub velocity: Option<Spanned<f64>>,
    /// Highest acceleration and deceleration, in axis units per second squared.
    #[schemars(transform = form::positive)]
    pub acceleration: Option<Spanned<f64>>,
    /// Highest torque or force in either direction, in percent of the motor's rating.
    #[schemars(transform = form::positive)]
    pub torque_percent: Option<Spanned<f64>>,
    /// Largest distance between actual and commanded position, in axis units.
    #[schemars(transform = form::positive)]
    pub following_error: Option<Spanned<f64>>,
}

/// `motor` of an `[[axis]]`: what its nameplate or data sheet says. What the drive shows counts more.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorTable {
    /// Kind of motor: `"rotary-permanent-magnet"`, `"rotary-induction"`, `"linear-permanent-magnet"` or `"linear-induction"`. To be given on
    /// an axis in millimetres. Default: a rotary one that nothing more is known of.
    #[serde(rename = "type")]
    #[schemars(transform = form::word(&check::nameplate::MOTORS))]
    pub kind: Option<Spanned<String>>,
    /// Rated torque in Nm, or rated force in N.
    #[schemars(transform = form::positive)]
    pub rated_torque: Option<Spanned<f64>>,
    /// Rated continuous current in A.
    #[schemars(transform = form::positive)]
    pub rated_current: Option<Spanned<f64>>,
    /// Peak current in A.
    #[schemars(transform = form::positive)]
    pub peak_current: Option<Spanned<f64>>,
    /// Rated speed in revolutions per minute, or in m/s.
    #[schemars(transform = form::positive)]
    pub rated_speed: Option<Spanned<f64>>,
    /// Highest speed in revolutions per minute, or in m/s.
    #[schemars(transform = form::positive)]
    pub max_speed: Option<Spanned<f64>>,
    /// Rated voltage in V.
    #[schemars(transform = form::positive)]
    pub rated_voltage: Option<Spanned<f64>>,
    /// Rated power in kW.
    #[schemars(transform = form::positive)]
    pub rated_power: Option<Spanned<f64>>,
    /// Poles, twice the pairs of poles: 2 to 65534, even. Only of a rotary motor.
    #[schemars(range(min = 2, max = 65_534), extend("multipleOf" = 2))]
    pub poles: Option<Spanned<i64>>,
    /// Pole pitch in mm. Only of a linear motor.
    #[schemars(transform = form::positive)]
    pub pole_pitch: Option<Spanned<f64>>,
    /// Torque constant in Nm/A, or force constant in N/A, both of the effective current. Only of a motor with permanent magnets.
    #[schemars(transform = form::positive)]
    pub torque_constant: Option<Spanned<f64>>,
    /// Effective voltage from phase to phase in V at 1000 revolutions per minute, or at 1 m/s. Only of a motor with permanent magnets.
    #[schemars(transform = form::positive)]
    pub voltage_constant: Option<Spanned<f64>>,
    /// Time constant of its warming in s: with it the gateway estimates Motor Capacity.
    #[schemars(transform = form::positive)]
    pub thermal_time_constant: Option<Spanned<f64>>,
    /// Inductance across the magnets in henries. Only of a motor with permanent magnets.
    #[schemars(transform = form::positive)]
    pub q_inductance: Option<Spanned<f64>>,
    /// Inductance along the magnets in henries. Only of a motor with permanent magnets.
    #[schemars(transform = form::positive)]
    pub d_inductance: Option<Spanned<f64>>,
    /// Rated frequency in Hz. Only of an induction motor.
    #[schemars(transform = form::positive)]
    pub rated_frequency: Option<Spanned<f64>>,
    /// Magnetising current in A. Only of an induction motor.
    #[schemars(transform = form::positive)]
    pub flux_current: Option<Spanned<f64>>,
    /// Resistance of a phase of the stator in ohms. Only of an induction motor.
    #[schemars(transform = form::positive)]
    pub stator_resistance: Option<Spanned<f64>>,
    /// Inertia in kg m², or mass of the moving part in kg.
    #[schemars(transform = form::positive)]
    pub inertia: Option<Spanned<f64>>,
    /// Resistance of the winding from phase to phase, in ohms.
    #[schemars(transform = form::positive)]
    pub resistance: Option<Spanned<f64>>,
    /// Inductance of the winding from phase to phase, in henries.
    #[schemars(transform = form::positive)]
    pub inductance: Option<Spanned<f64>>,
    /// Highest temperature of the winding in °C.
    #[schemars(transform = form::positive)]
    pub max_winding_temperature: Option<Spanned<f64>>,
    /// Use of the thermal capacity of the motor at which the drive faults, in percent.
    #[schemars(transform = form::positive)]
    pub overload_limit: Option<Spanned<f64>>,
}

/// `converter` of an `[[axis]]`: what the nameplate of the power stage says. What the drive shows counts more.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConverterTable {
    /// Nominal voltage of the DC bus in V.
    #[schemars(transform = form::positive)]
    pub bus_voltage: Option<Spanned<f64>>,
    /// Rated output current in A.
    #[schemars(transform = form::positive)]
    pub rated_current: Option<Spanned<f64>>,
    /// Rated output voltage in V.
    #[schemars(transform = form::positive)]
    pub rated_voltage: Option<Spanned<f64>>,
    /// Rated output power in kW.
    #[schemars(transform = form::positive)]
    pub rated_power: Option<Spanned<f64>>,
    /// Time constant of its warming in s: with it the gateway estimates Inverter Capacity.
    #[schemars(transform = form::positive)]
    pub thermal_time_constant: Option<Spanned<f64>>,
    /// Where the DC bus has its power from: `"standalone"`, `"shared-ac-dc"`, `"shared-dc"` or `"shared-dc-non-cip-converter"`.
    #[schemars(transform = form::word(&check::nameplate::BUSES))]
    pub bus: Option<Spanned<String>>,
    /// The mains that the power stage is set to: `"high"` for 115, 230 and 460 V, `"low"` for 100, 200 and 400 V.
    #[schemars(transform = form::word(&check::nameplate::MAINS))]
    pub mains: Option<Spanned<String>>,
    /// Whether the drive has an enable input without which it gives no torque.
    pub checks_enable_input: Option<bool>,
}

/// `encoder` of an `[[axis]]`: that of the motor.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EncoderTable {
    /// Interface: `"digital-aqb"`, `"digital-aqb-uvw"`, `"digital-parallel"`, `"sine-cosine"`, `"sine-cosine-uvw"`, `"hiperface"`,
    /// `"endat-sine-cosine"`, `"endat-digital"`, `"resolver"`, `"ssi"`, `"hiperface-dsl"`, `"biss-digital"`, `"integrated"`,
    /// `"ssi-sine-cosine"`, `"ssi-aqb"` or `"biss-sine-cosine"`.
    #[serde(rename = "type")]
    #[schemars(transform = form::word(&check::nameplate::ENCODERS))]
    pub kind: Option<Spanned<String>>,
    /// Where it counts from: `"incremental"` from where it is at power-up, `"absolute"` from its own zero.
    #[schemars(transform = form::word(&check::nameplate::STARTUPS))]
    pub startup: Option<Spanned<String>>,
    /// Revolutions that an absolute rotary encoder tells apart, 1 to 4294967295.
    #[schemars(range(min = 1, max = u32::MAX))]
    pub turns: Option<Spanned<i64>>,
    /// Length of an absolute linear encoder in mm.
    #[schemars(transform = form::positive)]
    pub length: Option<Spanned<f64>>,
}

/// `loops` of an `[[axis]]`: how the loops of its drive are set, in the units of CIP Volume 9, Tables 5-2.41 and 5-2.43. What the drive
/// shows counts more.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoopsTable {
    /// Proportional gain of the position loop, which is its bandwidth, in rad/s (attribute 441, Kpp).
    #[schemars(transform = form::positive)]
    pub position_gain: Option<Spanned<f64>>,
    /// Integral gain of the position loop, one over its time constant, in rad/s; 0 for none (attribute 442, Kpi).
    #[schemars(transform = form::not_negative)]
    pub position_integral_gain: Option<Spanned<f64>>,
    /// Proportional gain of the velocity loop, which is its bandwidth, in rad/s (attribute 461, Kvp).
    #[schemars(transform = form::positive)]
    pub velocity_gain: Option<Spanned<f64>>,
    /// Integral gain of the velocity loop, one over its time constant, in rad/s; 0 for none (attribute 462, Kvi).
    #[schemars(transform = form::not_negative)]
    pub velocity_integral_gain: Option<Spanned<f64>>,
    /// Part of the velocity set-point that the drive adds to the output of its position loop, in percent (attribute 440, Kvff).
    #[schemars(transform = form::not_negative)]
    pub velocity_feed_forward: Option<Spanned<f64>>,
}

impl LimitsTable {
    /// The first limit that is given, and where.
    pub(crate) fn first(&self) -> Option<(&'static str, std::ops::Range<usize>)> {
        let all = [
            ("position_min", &self.position_min),
            ("position_max", &self.position_max),
            ("velocity", &self.velocity),
            ("acceleration", &self.acceleration),
            ("torque_percent", &self.torque_percent),
            ("following_error", &self.following_error),
        ];
        all.into_iter().find_map(|(key, value)| Some((key, value.as_ref()?.span())))
    }
}

/// `[south]`: at least one bus.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = form::some_bus)]
pub struct SouthTable {
    /// What to ask of the kernel for the cycle thread, which serves all buses. A refusal is logged and does not stop the gateway.
    pub realtime: Option<RealtimeTable>,
    /// The SERCOS III bus.
    pub sercos: Option<Spanned<SercosTable>>,
    /// CAN buses with CANopen drives, at most 4.
    #[serde(default)]
    #[schemars(length(max = 4))]
    pub can: Vec<Spanned<CanTable>>,
    /// DeviceNet networks, at most 4.
    #[serde(default)]
    #[schemars(length(max = 4))]
    pub devicenet: Vec<Spanned<DevicenetTable>>,
}

/// `[south.sercos]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosTable {
    /// Network interface of the bus, such as `"enp3s0"`, or `"in-process"` for simulated drives.
    #[schemars(transform = form::interface)]
    pub interface: Spanned<String>,
    /// Interface of the master's second port, for the other end of a ring, or for a second line. `"in-process"` closes the ring of
    /// simulated drives. Default: none, and the drives are a line.
    #[schemars(transform = form::interface)]
    pub ring_interface: Option<Spanned<String>>,
    /// Communication cycle: `31.25 us`, `62.5 us`, `125 us`, `250 us`, or a multiple of `250 us` up to `65
    /// ms`.
    #[schemars(transform = form::time)]
    pub cycle_time: Spanned<String>,
    /// Cycle of phases 0 to 2, in which slaves are found and set up: a multiple of `250 us` from `1 ms` to `65 ms`, at least `2 ms` with more
    /// than 239 drives. Default: `"1 ms"`, or `"2 ms"`.
    #[schemars(transform = form::time)]
    pub setup_cycle: Option<Spanned<String>>,
    /// Ethernet address that the master sends from, such as `"02:00:00:00:00:01"`. Default: that of the interface.
    #[schemars(transform = form::station)]
    pub master_mac: Option<Spanned<String>>,
    /// How far the start of a cycle may be off its time, `1 us` to a quarter of the cycle. Declared to the slaves. Default: `"50 us"`, or a
    /// quarter of the cycle if that is shorter.
    #[schemars(transform = form::time)]
    pub jitter: Option<Spanned<String>>,
    /// Cycles for which topology and addresses must stay the same in phase 0, 1 to 1000. Default: 100.
    #[schemars(range(min = 1, max = 1000))]
    pub cp0_stable_cycles: Option<Spanned<i64>>,
    /// Cycles in a row that may be lost in phases 3 and 4 before a slave or the master gives up, 1 to 65535.
    /// Default: 5.
    #[schemars(range(min = 1, max = 65535))]
    pub allowed_losses: Option<Spanned<i64>>,
    /// Give free addresses (S-0-1040) to slaves that have none or share one, so that the bus can run. Such slaves take part without an axis.
    /// Otherwise they are logged, and the bus stays in phase 2. Default: false.
    pub assign_addresses: Option<bool>,
    /// The drives, at least one.
    #[schemars(length(min = 1))]
    pub drive: Vec<Spanned<DriveTable>>,
}

/// `[south.realtime]`
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RealtimeTable {
    /// `SCHED_FIFO` priority, 1 to 99; 0 for no real-time scheduling. Default: 80.
    #[schemars(range(min = 0, max = 99))]
    pub priority: Option<Spanned<i64>>,
    /// Processor to stay on, from 0. Default: any.
    #[schemars(range(min = 0, max = 1023))]
    pub cpu: Option<Spanned<i64>>,
    /// How long before its instant the work for a cycle begins, `"0 us"` to `"1 ms"`, limited to a tenth of the cycle. At the instant, the
    /// prepared telegrams are sent. What drives send later than that belongs to the next cycle. Default: `"100 us"`.
    #[schemars(transform = form::time)]
    pub lead: Option<Spanned<String>>,
    /// Keep the memory of the process resident. Default: true.
    pub lock_memory: Option<bool>,
    /// Keep the host's processors from sleeping while the gateway runs: the most even cycle, at full power. Default: false.
    pub stay_awake: Option<bool>,
}

/// `[[south.sercos.drive]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriveTable {
    /// Name, unique among drives.
    #[schemars(transform = form::name)]
    pub name: Spanned<String>,
    /// SERCOS address, 1 to 511, unique.
    #[schemars(range(min = 1, max = 511))]
    pub address: Spanned<i64>,
    /// Set the scaling of the drive to the preferential one of the axis's unit. Otherwise it is read and left as it is. Default: false.
    pub set_scaling: Option<bool>,
    /// Whether its status word (S-0-0135) reports that it follows command values (bit 3) and that it is halted (bit 4). A drive without
    /// these bits is held by its command instead of its halt. Default: true.
    pub acknowledges: Option<bool>,
    /// Operating modes that the drive must have: "position", "velocity", "torque", and "positioning" and "homing", in which the drive moves
    /// by itself. The first one is active at the start: one of the first three. Default: those of the first three that the drive has, at
    /// least one.
    #[schemars(transform = form::modes(&check::can::modes(), check::can::MODES.len()))]
    pub modes: Option<Spanned<Vec<Spanned<String>>>>,
    /// Rated (continuous stall) torque or force of its motor, such as `"2.5 Nm"` or `"200 N"`. Needed if the drive's torque values are in
    /// newton metre, newton or their inch units. Default: not known.
    #[schemars(transform = form::torque)]
    pub rated_torque: Option<Spanned<String>>,
    /// Whether it may be plugged in while the bus runs: the bus starts without it and keeps its place in the telegrams. At least one drive
    /// has to be there from the start. Default: false.
    pub hot_plug: Option<Spanned<bool>>,
    /// What parameters of the drive have to be before it takes part in the cycle: its start-up list. Default: none.
    #[serde(default)]
    pub startup: Vec<Spanned<StartupTable>>,
    /// A backup made by `axisbridge param backup` as start-up list, below the entries of `startup`. A path relative to the folder of this
    /// file. Default: none.
    #[schemars(transform = form::path)]
    pub startup_file: Option<Spanned<String>>,
    /// What is done when the drive has another value, for entries that do not say it: `"write"` writes the value and reads it back,
    /// `"refuse"` does not use the drive, `"warn"` logs it. Default: `"write"`.
    #[schemars(transform = form::word(&OnDifference::NAMED))]
    pub on_startup_difference: Option<Spanned<String>>,
}

/// `[[south.sercos.drive.startup]]`: an entry of the start-up list of a SERCOS drive.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartupTable {
    /// The IDN, such as `"S-0-0121"`, `"P-0-0123"` or `"S-0-1300.0.3"`.
    #[schemars(transform = form::idn)]
    pub parameter: Spanned<String>,
    /// The value, in the decimals that the attribute of the IDN has: a number, or a text as `axisbridge param read` shows it, such as
    /// `"0b0101"`, `"S-0-0040,S-0-0051"` or `"hex:0a00"`.
    pub value: Spanned<Scalar>,
    /// What is done when the drive has another value. Default: `on_startup_difference` of the drive.
    #[schemars(transform = form::word(&OnDifference::NAMED))]
    pub on_difference: Option<Spanned<String>>,
}

/// `[[south.can.drive.startup]]`: an entry of the start-up list of a CANopen drive.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectStartupTable {
    /// The object as the device numbers it, such as `"6091:01"`, `"0x6091.1"` or `"2001h"`; behind `:` hexadecimal, behind `.` decimal.
    #[schemars(transform = form::object)]
    pub parameter: Spanned<String>,
    /// The value: a number, or a text as `axisbridge param read` shows it, such as `"hex:0a00"`.
    pub value: Spanned<Scalar>,
    /// The type of the object, such as `"u32"`. Default: that of the device's `configuration`, or of the dictionary.
    #[serde(rename = "type")]
    #[schemars(transform = form::word(Cia402Type::NAMED))]
    pub kind: Option<Spanned<String>>,
    /// What is done when the drive has another value. Default: `on_startup_difference` of the drive.
    #[schemars(transform = form::word(&OnDifference::NAMED))]
    pub on_difference: Option<Spanned<String>>,
}

/// `[[south.can]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanTable {
    /// CAN interface of the bus, such as `"can0"`, or `"in-process"` for simulated drives.
    #[schemars(transform = form::interface)]
    pub interface: Spanned<String>,
    /// Bits per second, 10000 to 1000000. The load of the bus is checked against it. Default: 1000000.
    #[schemars(range(min = 10000, max = 1000000))]
    pub bit_rate: Option<Spanned<i64>>,
    /// Set the interface to this bit rate and bring it up. Otherwise it is used as it is. Default: false.
    pub set_bit_rate: Option<bool>,
    /// Time from one SYNC to the next: `500 us` to `1 s`, in whole 100 microseconds.
    #[schemars(transform = form::time)]
    pub cycle_time: Spanned<String>,
    /// Node-id of the gateway, 1 to 127, used by no device. Default: 127.
    #[schemars(range(min = 1, max = 127))]
    pub node: Option<Spanned<i64>>,
    /// Heartbeat period of the gateway and of the drives, `10 ms` to `10 s`. A node whose heartbeat stays away for three periods is lost.
    /// Default: `"100 ms"`.
    #[schemars(transform = form::time)]
    pub heartbeat: Option<Spanned<String>>,
    /// How many TPDOs in a row may be missing before an axis stops, 1 to 1000. Default: 3.
    #[schemars(range(min = 1, max = 1000))]
    pub allowed_losses: Option<Spanned<i64>>,
    /// The drives, at least one.
    #[schemars(length(min = 1))]
    pub drive: Vec<Spanned<CanDriveTable>>,
    /// Settings for devices as a whole, at most one table for each device.
    #[serde(default)]
    pub device: Vec<Spanned<CanDeviceTable>>,
}

/// `[[south.can.drive]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanDriveTable {
    /// Name, unique among drives.
    #[schemars(transform = form::name)]
    pub name: Spanned<String>,
    /// Node-id of its device, 1 to 127.
    #[schemars(range(min = 1, max = 127))]
    pub node: Spanned<i64>,
    /// Which axis of the device it is, 0 to 7; unique in the device. Default: 0.
    #[schemars(range(min = 0, max = 7))]
    pub axis: Option<Spanned<i64>>,
    /// What the axis is used for: `"position"`, `"velocity"`, `"torque"`, and `"positioning"` and `"homing"`, in which the drive moves by
    /// itself. The first one is active at the start: one of the first three. Set-points of other modes are not sent, and a drive that lacks
    /// one of these modes is not controlled. Default: those of the first three that the drive has.
    #[schemars(transform = form::modes(&check::can::modes(), check::can::MODES.len()))]
    pub modes: Option<Spanned<Vec<Spanned<String>>>>,
    /// Which actual values the drive sends in every cycle besides the position: `"velocity"`, `"torque"`, `"following-error"` (60F4), which
    /// the gateway computes otherwise, and `"inputs"` (60FD): limit switches and home switch. Each adds to the load of the bus. Default:
    /// velocity and torque.
    #[schemars(transform = form::words(&check::can::ACTUAL_VALUES))]
    pub actual_values: Option<Spanned<Vec<Spanned<String>>>>,
    /// Which trims are sent to the drive in every cycle: `"velocity"` (60B1) in position control, `"torque"` (60B2) in position and
    /// velocity control. The drive adds them. Default: none, and such a trim of the controller has no effect.
    #[schemars(transform = form::words(&check::can::OFFSETS))]
    pub offsets: Option<Spanned<Vec<Spanned<String>>>>,
    /// Whether bit 12 of its statusword reports that it follows command values. Default: what the tables say of its family, else false: a
    /// drive in operation follows.
    pub acknowledges: Option<bool>,
    /// What bit 4 of its statusword means: `"dc-link"` if it reports that the power stage is supplied, `"ignore"` otherwise. Default: what the
    /// tables say of its family, else ignore.
    #[schemars(transform = form::word(&VOLTAGE_BIT))]
    pub voltage_bit: Option<Spanned<String>>,
    /// Modes of operation that the drive has, such as `"csp"` and `"pv"`, if it does not report them in 6502 or reports wrong ones. Default:
    /// what the tables say of its family, else what it reports. If it reports none, the modes are tried.
    #[schemars(transform = form::some_words(&check::can::DRIVE_MODES))]
    pub drive_modes: Option<Spanned<Vec<Spanned<String>>>>,
    /// Travel of a linear axis in a turn of its motor, in millimetres. Needed for a linear axis whose drive counts turns.
    #[schemars(transform = form::positive)]
    pub millimetres_per_turn: Option<Spanned<f64>>,
    /// Counts in an axis unit, for a drive that does not report its scaling or reports it wrongly. Default: what the drive reports.
    pub counts: Option<CountsTable>,
    /// What objects of the drive have to be before it takes part in the cycle: its start-up list. Default: none.
    #[serde(default)]
    pub startup: Vec<Spanned<ObjectStartupTable>>,
    /// A backup made by `axisbridge param backup` as start-up list, below the entries of `startup`. A path relative to the folder of this
    /// file. Default: none.
    #[schemars(transform = form::path)]
    pub startup_file: Option<Spanned<String>>,
    /// What is done when the drive has another value, for entries that do not say it: `"write"` writes the value and reads it back,
    /// `"refuse"` does not use the drive, `"warn"` logs it. Default: `"write"`.
    #[schemars(transform = form::word(&OnDifference::NAMED))]
    pub on_startup_difference: Option<Spanned<String>>,
}

/// `[[south.can.device]]`: settings for a device as a whole, whatever axes it has.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = form::can_device)]
pub struct CanDeviceTable {
    /// Its node-id. There must be a drive with it.
    #[schemars(range(min = 1, max = 127))]
    pub node: Spanned<i64>,
    /// Identity that the device must have (1018). A device with another one is not controlled. Default: any, or that of `configuration`.
    pub identity: Option<Spanned<CanIdentityTable>>,
    /// Device type that 1000 must show: `"drive"`, profile 402 in the low half, or `"any"`, for a drive that shows something else. Nothing is
    /// written to another device. Default: `"drive"`.
    #[schemars(transform = form::word(&check::can_device::DEVICE_TYPES))]
    pub device_type: Option<Spanned<String>>,
    /// What happens while no device answers under the node-id: `"assign"`: the device with this complete `identity` is given the node-id by
    /// LSS if it has none; `"store"`: and it stores it. Default: nothing.
    #[schemars(transform = form::word(&check::can_device::LSS))]
    pub lss: Option<Spanned<String>>,
    /// Its data sheet: an EDS or DCF of CiA 306. `axisbridge check` compares what the axes need with what the file says that the device
    /// has. Nothing of it is written to the device. A path relative to the folder of this file. Default: none.
    #[schemars(transform = form::path)]
    pub eds: Option<Spanned<String>>,
    /// Its configuration, written at boot-up before anything else: a device configuration file (DCF) of CiA 306, or a concise one as in
    /// 1F22. A path relative to the folder of this file. Default: none.
    #[schemars(transform = form::path)]
    pub configuration: Option<Spanned<String>>,
    /// Let the device store its configuration (1010:1) after it was written. Needs object 1020, which shows that it is stored already.
    /// Default: false.
    pub store: Option<Spanned<bool>>,
    /// `"write"`: the gateway maps the PDOs as the axes need them; `"keep"`: they are used as they are. Default: `"write"`.
    #[schemars(transform = form::word(&check::can_device::MAPPINGS))]
    pub pdo_mapping: Option<Spanned<String>>,
    /// Transmission type of its RPDOs: 0 to 240, 254, 255. Default: the first of 1, 0, 255 and 254 that the device accepts.
    #[schemars(transform = form::rpdo_type)]
    pub rpdo_type: Option<Spanned<i64>>,
    /// Transmission type of its TPDOs: 1, 254 or 255. With 254 and 255 the device sends by its event timer, once in a cycle. Default: the
    /// first of 1, 255 and 254 that the device accepts.
    #[schemars(transform = form::one_of(&[1, 254, 255]))]
    pub tpdo_type: Option<Spanned<i64>>,
    /// Node guarding instead of a heartbeat, for a device without 1017: the time between two requests, `10 ms` to `10 s`. Default: none,
    /// the device has a heartbeat.
    #[schemars(transform = form::time)]
    pub guarding: Option<Spanned<String>>,
    /// Guarding requests in a row that may go unanswered, or that the device may miss, before the other side is lost: 2 to 255. Default: 3.
    #[schemars(range(min = 2, max = 255))]
    pub life_time_factor: Option<Spanned<i64>>,
}

/// `identity` of a `[[south.can.device]]`. What is not given is not compared.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = form::not_empty)]
pub struct CanIdentityTable {
    /// Vendor-ID (1018:1).
    #[schemars(range(min = 0, max = u32::MAX))]
    pub vendor_id: Option<Spanned<i64>>,
    /// Product code (1018:2).
    #[schemars(range(min = 0, max = u32::MAX))]
    pub product_code: Option<Spanned<i64>>,
    /// Revision number (1018:3).
    #[schemars(range(min = 0, max = u32::MAX))]
    pub revision_number: Option<Spanned<i64>>,
    /// Serial number (1018:4).
    #[schemars(range(min = 0, max = u32::MAX))]
    pub serial_number: Option<Spanned<i64>>,
}

/// `counts` of a `[[south.can.drive]]`. What is not given is taken from the drive.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CountsTable {
    /// Position counts in an axis unit.
    #[schemars(transform = form::positive)]
    pub position: Option<Spanned<f64>>,
    /// Velocity counts in an axis unit per second, such as 600 if a count is 0.1 revolutions per minute.
    #[schemars(transform = form::positive)]
    pub velocity: Option<Spanned<f64>>,
    /// Acceleration counts in an axis unit per second squared.
    #[schemars(transform = form::positive)]
    pub acceleration: Option<Spanned<f64>>,
    /// Torque counts in the rated torque, 1000 if a count is a thousandth of it.
    #[schemars(transform = form::positive)]
    pub torque: Option<Spanned<f64>>,
}

/// `[[south.devicenet]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DevicenetTable {
    /// CAN interface of the network, such as `"can0"`, or `"in-process"` for simulated drives.
    #[schemars(transform = form::interface)]
    pub interface: Spanned<String>,
    /// Bits per second: 125000, 250000 or 500000. The load of the network is checked against it. Default: 125000.
    #[schemars(transform = form::one_of(&[125_000, 250_000, 500_000]))]
    pub bit_rate: Option<Spanned<i64>>,
    /// Set the interface to this bit rate and bring it up. Otherwise it is used as it is. Default: false.
    pub set_bit_rate: Option<bool>,
    /// Time from one poll of a drive to the next: `1 ms` to `1 s`, in whole milliseconds.
    #[schemars(transform = form::time)]
    pub cycle_time: Spanned<String>,
    /// MAC ID of the gateway, 0 to 63, used by no drive. Default: 0.
    #[schemars(range(min = 0, max = 63))]
    pub mac_id: Option<Spanned<i64>>,
    /// How many answers of a drive in a row may be missing before its axis stops, 1 to 100. Default: 3.
    #[schemars(range(min = 1, max = 100))]
    pub allowed_losses: Option<Spanned<i64>>,
    /// The drives, at least one.
    #[schemars(length(min = 1))]
    pub drive: Vec<Spanned<DevicenetDriveTable>>,
}

/// `[[south.devicenet.drive]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = form::kind_of_drive)]
pub struct DevicenetDriveTable {
    /// Name, unique among drives.
    #[schemars(transform = form::name)]
    pub name: Spanned<String>,
    /// MAC ID of the drive, 0 to 63, unique on the network.
    #[schemars(range(min = 0, max = 63))]
    pub mac_id: Spanned<i64>,
    /// `"motion"`, a CIP Motion drive with the fixed connection format, or `"ac-dc"`, a velocity drive of the AC/DC drive
    /// profile. Default: `"motion"`.
    #[schemars(transform = form::word(&check::devicenet::KINDS))]
    pub kind: Option<Spanned<String>>,
    /// Expected packet rate given to the drive, in whole milliseconds up to `10 s`. Without a message for four times as long, the drive
    /// stops by itself. Default: the cycle time.
    #[schemars(transform = form::time)]
    pub packet_rate: Option<Spanned<String>>,
    /// Vendor number that the drive must have, 1 to 65535. Default: any.
    #[schemars(range(min = 1, max = 65535))]
    pub vendor_id: Option<Spanned<i64>>,
    /// Product code that the drive must have, 0 to 65535. Default: any.
    #[schemars(range(min = 0, max = 65535))]
    pub product_code: Option<Spanned<i64>>,
    /// What a CIP Motion drive is used for: `"position"`, `"velocity"`, `"torque"`. Default: all three.
    #[schemars(transform = form::some_words(&check::can::MODES))]
    pub modes: Option<Spanned<Vec<Spanned<String>>>>,
    /// Position counts of a CIP Motion drive in one of its position units, 1 to 2147483647. Required for a CIP Motion drive.
    #[schemars(range(min = 1, max = 2_147_483_647))]
    pub resolution: Option<Spanned<i64>>,
    /// Travel of a linear axis in a turn of its motor, in millimetres. A rotary axis does not take it. Without it, a CIP Motion drive of a
    /// linear axis counts in millimetres. A velocity drive of a linear axis needs it.
    #[schemars(transform = form::positive)]
    pub millimetres_per_turn: Option<Spanned<f64>>,
    /// Output assembly of a velocity drive: 20, basic speed control, or 21, extended speed control. Its input assembly is 70 or 71. Default:
    /// 21.
    #[schemars(range(min = 20, max = 21))]
    pub assembly: Option<Spanned<i64>>,
    /// SpeedScale (attribute 22 of the AC/DC Drive object) of a velocity drive, -15 to 15: its speed is in units of rpm /
    /// 2^SpeedScale. Default: 0.
    #[schemars(range(min = -15, max = 15))]
    pub speed_scale: Option<Spanned<i64>>,
    /// What attributes of the drive have to be before it takes part in the cycle: its start-up list. Default: none.
    #[serde(default)]
    pub startup: Vec<Spanned<AttributeStartupTable>>,
    /// A backup made by `axisbridge param backup` as start-up list, below the entries of `startup`. A path relative to the folder of this
    /// file. Default: none.
    #[schemars(transform = form::path)]
    pub startup_file: Option<Spanned<String>>,
    /// What is done when the drive has another value, for entries that do not say it: `"write"` writes the value and reads it back,
    /// `"refuse"` does not use the drive, `"warn"` logs it. Default: `"write"`.
    #[schemars(transform = form::word(&OnDifference::NAMED))]
    pub on_startup_difference: Option<Spanned<String>>,
}

/// `[[south.devicenet.drive.startup]]`: an entry of the start-up list of a drive on DeviceNet.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AttributeStartupTable {
    /// Class, instance and attribute, such as `"0x2A.1.22"` or `"66.1.504"`; decimal, or with `0x` hexadecimal.
    #[schemars(transform = form::attribute)]
    pub parameter: Spanned<String>,
    /// The value: a number, or a text as `axisbridge param read` shows it, such as `"hex:0a00"`.
    pub value: Spanned<Scalar>,
    /// The type of the attribute, such as `"f32"` for a REAL or `"i8"` for a SINT. Default: that of the dictionary, which has the Identity
    /// object (class 1), the Motion Device Axis Object (class 66) of a CIP Motion drive, and Motor Data (28h), Control Supervisor (29h) and
    /// AC/DC Drive (2Ah) of an AC/DC drive. Required of others, unless the value has its own type, as `"hex:0a00"` and `"u16:5"`.
    #[serde(rename = "type")]
    #[schemars(transform = form::word(Cia402Type::NAMED))]
    pub kind: Option<Spanned<String>>,
    /// What is done when the drive has another value. Default: `on_startup_difference` of the drive.
    #[schemars(transform = form::word(&OnDifference::NAMED))]
    pub on_difference: Option<Spanned<String>>,
}
