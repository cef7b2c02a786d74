//! The file as it is written. Every key that is not listed here is an error.
//!
//! Times are strings with a unit: `"2 ms"`, `"31.25 us"`, `"31250 ns"`, `"1 s"`. Names are 1 to 32 letters,
//! digits, `-` and `_`. Positions count in axis units: revolutions or millimetres.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::finding::Spanned;

/// The whole file.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// The box itself.
    #[serde(rename = "box")]
    pub the_box: BoxTable,
    /// Time. Default: the host's clock.
    pub time: Option<TimeTable>,
    /// Logging. Default: level `info`.
    pub log: Option<LogTable>,
    /// The Modbus TCP server. Default: none.
    pub modbus: Option<ModbusTable>,
    /// Mapping tables. Default: the built-in ones.
    pub mappings: Option<MappingsTable>,
    /// The CIP Motion devices seen by controllers, at least one.
    pub device: Vec<Spanned<DeviceTable>>,
    /// The axes, at least one, at most 64.
    pub axis: Vec<Spanned<AxisTable>>,
    /// The buses behind.
    pub south: Spanned<SouthTable>,
}

/// `[box]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxTable {
    /// Name of the box in logs, recordings and the status block.
    pub name: Spanned<String>,
    /// A file in which the box keeps what controllers set over the network; counts from the folder of this file.
    /// Default: none, and settings last until the process ends.
    pub settings_file: Option<Spanned<String>>,
}

/// `[time]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimeTable {
    /// Where system time comes from. Default: `"host"`, the host's clock (TAI where the kernel knows the
    /// offset from UTC).
    pub source: Option<Spanned<String>>,
}

/// `[log]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogTable {
    /// `"error"`, `"warn"`, `"info"`, `"debug"` or `"trace"`. Default: `"info"`.
    pub level: Option<Spanned<String>>,
}

/// `[modbus]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModbusTable {
    /// Address and port, such as `"0.0.0.0:502"`.
    pub listen: Spanned<String>,
    /// Clients served at once, 1 to 64. Default: 8.
    pub clients_max: Option<Spanned<i64>>,
}

/// `[mappings]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MappingsTable {
    /// A folder of dictionaries and mapping tables used in place of the built-in ones; counts from the folder
    /// of this file.
    pub dir: Option<Spanned<String>>,
    /// Files, or folders of files, with rows that are laid over the tables, in this order; they count from the folder of this
    /// file.
    #[serde(default)]
    pub overlays: Vec<Spanned<String>>,
}

/// `[[device]]`: a CIP Motion device.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DeviceTable {
    /// Name, unique among devices.
    pub name: Spanned<String>,
    /// An IPv4 address of this host, one for each device; TCP and UDP 44818 and UDP 2222 are used on it.
    pub listen: Spanned<String>,
    /// Names of its axes.
    pub axes: Spanned<Vec<Spanned<String>>>,
    /// What it calls itself.
    pub identity: IdentityTable,
    /// Drive Power Structure Class ID (class attribute 34); controllers may ask for it when they connect.
    /// Default: 0, each axis has its own.
    pub power_structure_class_id: Option<Spanned<i64>>,
    /// Format of the motion connection: `"variable"`, or `"fixed"` (16 bytes) for a device with one axis. Default:
    /// `"variable"`.
    pub connection_format: Option<Spanned<String>>,
    /// The controller update periods (RPI) it accepts.
    pub update_period: Option<UpdatePeriodTable>,
}

/// `identity` of a `[[device]]`; its device type follows from its axes: 47, CIP Motion Encoder, where all of them are
/// encoders; 48, CIP Motion Converter, where all are converters; else 37, CIP Motion Drive.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IdentityTable {
    /// Vendor number given by ODVA, 1 to 65535.
    pub vendor_id: Spanned<i64>,
    /// Name of that vendor in the electronic data sheet; printable ASCII, 1 to 32 characters. Default: `"Vendor"` and the
    /// number.
    pub vendor_name: Option<Spanned<String>>,
    /// The vendor's number of the product, 1 to 65535.
    pub product_code: Spanned<i64>,
    /// Major and minor revision, such as `"1.1"` (1 to 127, 1 to 255). Default: `"1.1"`.
    pub revision: Option<Spanned<String>>,
    /// Catalogue number in the electronic data sheet; printable ASCII, 1 to 32 characters. Default: the product name.
    pub catalog: Option<Spanned<String>>,
    /// Number of the piece, 1 to 4294967295, unique among the vendor's pieces.
    pub serial_number: Spanned<i64>,
    /// Printable ASCII, 1 to 32 characters. Default: `"Axisbridge"`.
    pub product_name: Option<Spanned<String>>,
}

/// `update_period` of a `[[device]]`; both from `250 us` to `100 ms`, in whole microseconds.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UpdatePeriodTable {
    /// Shortest, at least the bus cycle. Default: `"1 ms"`, or the bus cycle where that is longer.
    pub min: Option<Spanned<String>>,
    /// Longest. Default: `"32 ms"`.
    pub max: Option<Spanned<String>>,
}

/// `[[axis]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisTable {
    /// Name, unique among axes.
    pub name: Spanned<String>,
    /// Instance of the Motion Device Axis Object, 1 to 255, unique in its device.
    pub instance: Spanned<i64>,
    /// Name of the drive behind it; each drive serves one axis.
    pub drive: Spanned<String>,
    /// What it is: `"drive"`, controlled in motion; `"encoder"`, seen but never switched on; `"converter"`, a supply of
    /// the DC bus, without motion. Encoder and converter take neither `limits` nor `on_command_loss`. Default: `"drive"`.
    pub function: Option<Spanned<String>>,
    /// `"revolution"` for a rotary axis, `"millimetre"` for a linear one.
    pub unit: Spanned<String>,
    /// Position counts of the controller in one unit, 1 to 2147483647. Default: 1000000.
    pub motion_resolution: Option<Spanned<i64>>,
    /// For an axis without ends: position counts after which it is at its start again, 1 to 2147483647.
    /// Default: an axis with ends.
    pub unwind_counts: Option<Spanned<i64>>,
    /// Drive Power Structure Axis ID (attribute 725). Default: 0.
    pub power_structure_axis_id: Option<Spanned<i64>>,
    /// Limits held by the box. Default: those of the drive alone.
    pub limits: Option<LimitsTable>,
    /// What the axis does when commands stay away: `"disable-and-coast"`, `"current-decel-and-disable"`,
    /// `"ramped-decel-and-disable"`, `"current-decel-and-hold"` or `"ramped-decel-and-hold"`. Default:
    /// `"ramped-decel-and-disable"`.
    pub on_command_loss: Option<Spanned<String>>,
    /// How the drive's captures are used: `cyclic`, `service-channel` or `off`. Default: `cyclic` on SERCOS, `service-channel`, which
    /// is SDO there, on CAN.
    pub events: Option<Spanned<String>>,
}

/// `limits` of an `[[axis]]`; each is left to the drive where it is not given.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitsTable {
    /// Lowest position command, in axis units; only for an axis with ends, and together with `position_max`.
    pub position_min: Option<Spanned<f64>>,
    /// Highest position command, in axis units.
    pub position_max: Option<Spanned<f64>>,
    /// Highest speed in either direction, in axis units per second.
    pub velocity: Option<Spanned<f64>>,
    /// Highest acceleration and deceleration, in axis units per second squared.
    pub acceleration: Option<Spanned<f64>>,
    /// Highest torque or force in either direction, in percent of the motor's rating.
    pub torque_percent: Option<Spanned<f64>>,
    /// Largest distance of actual from commanded position, in axis units.
    pub following_error: Option<Spanned<f64>>,
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
pub struct SouthTable {
    /// What to ask of the kernel for the cycle thread, which serves all buses; refusals are reported and do not stop the box.
    pub realtime: Option<RealtimeTable>,
    /// The SERCOS III bus.
    pub sercos: Option<Spanned<SercosTable>>,
    /// CAN buses with CANopen drives, at most 4.
    #[serde(default)]
    pub can: Vec<Spanned<CanTable>>,
    /// DeviceNet networks, at most 4.
    #[serde(default)]
    pub devicenet: Vec<Spanned<DevicenetTable>>,
}

/// `[south.sercos]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SercosTable {
    /// Network interface of the bus, such as `"enp3s0"`, or `"in-process"` for simulated drives.
    pub interface: Spanned<String>,
    /// Interface of the master's second port, where the other end of a ring is plugged in, or a second line; `"in-process"`
    /// closes the ring of simulated drives. Default: none, and the drives are a line.
    pub ring_interface: Option<Spanned<String>>,
    /// Communication cycle: `31.25 us`, `62.5 us`, `125 us`, `250 us`, or a multiple of `250 us` up to `65
    /// ms`.
    pub cycle_time: Spanned<String>,
    /// Cycle of phases 0 to 2, in which slaves are found and set up: a multiple of `250 us` from `1 ms` to `65 ms`, `2 ms` at least with more
    /// than 239 drives. Default: `"1 ms"`, or `"2 ms"`.
    pub setup_cycle: Option<Spanned<String>>,
    /// Ethernet address the master sends from, such as `"02:00:00:00:00:01"`. Default: the interface's own.
    pub master_mac: Option<Spanned<String>>,
    /// How far the start of a cycle may lie off its time, `1 us` to a quarter of the cycle; declared to the
    /// slaves. Default: `"50 us"`, or a quarter of the cycle where that is shorter.
    pub jitter: Option<Spanned<String>>,
    /// Cycles for which topology and addresses must stay the same in phase 0, 1 to 1000. Default: 100.
    pub cp0_stable_cycles: Option<Spanned<i64>>,
    /// Cycles in a row that may be lost in phases 3 and 4 before a slave or the master gives up, 1 to 65535.
    /// Default: 5.
    pub allowed_losses: Option<Spanned<i64>>,
    /// Give free addresses to slaves that have none or share one, so that the bus can run (S-0-1040); else they are told, and the
    /// bus stays in phase 2. Such slaves take part without an axis. Default: false.
    pub assign_addresses: Option<bool>,
    /// The drives, at least one.
    pub drive: Vec<Spanned<DriveTable>>,
}

/// `[south.realtime]`
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RealtimeTable {
    /// `SCHED_FIFO` priority, 1 to 99; 0 for no real-time scheduling. Default: 80.
    pub priority: Option<Spanned<i64>>,
    /// Processor to stay on, from 0. Default: any.
    pub cpu: Option<Spanned<i64>>,
    /// How long before its instant the work for a cycle begins, `"0 us"` to `"1 ms"`: at the instant only what is ready goes out. What
    /// drives send later than that belongs to the next cycle; at most a tenth of the cycle counts. Default: `"100 us"`.
    pub lead: Option<Spanned<String>>,
    /// Keep the memory of the process resident. Default: true.
    pub lock_memory: Option<bool>,
    /// Keep the host's processors from sleeping while the box runs: the most even cycle, at full consumption. Default:
    /// false.
    pub stay_awake: Option<bool>,
}

/// `[[south.sercos.drive]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriveTable {
    /// Name, unique among drives.
    pub name: Spanned<String>,
    /// SERCOS address, 1 to 511, unique.
    pub address: Spanned<i64>,
    /// Whether the drive's scaling is set to the preferential one of the axis's unit; else it is read and left as it is.
    /// Default: false.
    pub set_scaling: Option<bool>,
    /// Whether its status word (S-0-0135) tells that it follows command values (bit 3) and that it is halted (bit 4). A
    /// drive without them is held by its command instead of its halt. Default: true.
    pub acknowledges: Option<bool>,
    /// The operating modes that the drive must have, the first being active at start: "position", "velocity", "torque". Default:
    /// all three, each only where the drive has it, and one at least.
    pub modes: Option<Spanned<Vec<Spanned<String>>>>,
    /// Rated (continuous stall) torque or force of its motor, such as `"2.5 Nm"` or `"200 N"`: needed where the drive's
    /// torque values are in newton metre, newton or their inch units. Default: not known.
    pub rated_torque: Option<Spanned<String>>,
    /// Whether it may be plugged in while the bus is in operation: the bus runs without it, and its place in the
    /// telegrams is kept. At least one drive has to be there from the start. Default: false.
    pub hot_plug: Option<Spanned<bool>>,
}

/// `[[south.can]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanTable {
    /// CAN interface of the bus, such as `"can0"`, or `"in-process"` for simulated drives.
    pub interface: Spanned<String>,
    /// Bits per second: 10000 to 1000000. What the drives send in a cycle is checked against it. Default: 1000000.
    pub bit_rate: Option<Spanned<i64>>,
    /// Set the interface to this bit rate and bring it up; else it is taken as it is. Default: false.
    pub set_bit_rate: Option<bool>,
    /// Time from one SYNC to the next: `500 us` to `1 s`, in whole 100 microseconds.
    pub cycle_time: Spanned<String>,
    /// Node-id of the box, 1 to 127, of its own. Default: 127.
    pub node: Option<Spanned<i64>>,
    /// Time between two heartbeats, of the box and of the drives, `10 ms` to `10 s`; one that stays away for three times as
    /// long is missed. Default: `"100 ms"`.
    pub heartbeat: Option<Spanned<String>>,
    /// How many TPDOs in a row may be missing before an axis stops, 1 to 1000. Default: 3.
    pub allowed_losses: Option<Spanned<i64>>,
    /// The drives, at least one.
    pub drive: Vec<Spanned<CanDriveTable>>,
    /// What is said of devices as a whole, each once.
    #[serde(default)]
    pub device: Vec<Spanned<CanDeviceTable>>,
}

/// `[[south.can.drive]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanDriveTable {
    /// Name, unique among drives.
    pub name: Spanned<String>,
    /// Node-id of its device, 1 to 127.
    pub node: Spanned<i64>,
    /// Which axis of the device it is, 0 to 7; unique in the device. Default: 0.
    pub axis: Option<Spanned<i64>>,
    /// What the axis is to be used for: `"position"`, `"velocity"`, `"torque"`; set-points of others are not sent, and a drive that lacks
    /// one of them is not led. Default: all three, as far as the drive has them.
    pub modes: Option<Spanned<Vec<Spanned<String>>>>,
    /// Which actual values beside the position are sent in every cycle, each of which makes the bus fuller: `"velocity"`, `"torque"`,
    /// `"following-error"` (60F4), which the box works out otherwise, and `"inputs"` (60FD): limit switches and home switch. Default:
    /// velocity and torque.
    pub actual_values: Option<Spanned<Vec<Spanned<String>>>>,
    /// Which trims go to the drive in every cycle, for it to add them: `"velocity"` (60B1) in position control, `"torque"` (60B2)
    /// in position and velocity control. Default: none, and such a trim of the controller has no effect.
    pub offsets: Option<Spanned<Vec<Spanned<String>>>>,
    /// Whether its statusword tells by bit 12 that it follows command values. Default: what the tables say of its
    /// family, else false: a drive in operation follows.
    pub acknowledges: Option<bool>,
    /// What bit 4 of its statusword is: `"dc-link"` where the drive tells by it that its power stage is supplied, `"ignore"` otherwise. Default:
    /// what the tables say of its family, else ignore: a drive that is ready is ready.
    pub voltage_bit: Option<Spanned<String>>,
    /// Modes of operation that the drive has, such as `"csp"` and `"pv"`, where it does not tell them by 6502 or tells wrong ones.
    /// Default: what the tables say of its family, else what it tells; one that tells none is tried.
    pub drive_modes: Option<Spanned<Vec<Spanned<String>>>>,
    /// Millimetres that a linear axis makes in a turn of its motor; needed for a linear axis whose drive counts turns.
    pub millimetres_per_turn: Option<Spanned<f64>>,
    /// What its counts are, for a drive whose factor group does not say it, or says it wrong. Default: what the drive says.
    pub counts: Option<CountsTable>,
}

/// `[[south.can.device]]`: what is said of a device as a whole, whatever axes it has.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanDeviceTable {
    /// Its node-id, which is that of a drive.
    pub node: Spanned<i64>,
    /// What it has to be (1018); a device that is something else is not led. Default: any, or what `configuration` is for.
    pub identity: Option<Spanned<CanIdentityTable>>,
    /// What it has to say of itself in 1000: `"drive"`, the device profile 402, whatever stands above it, or `"any"`, for a drive that
    /// says something else. Nothing is written to another device. Default: `"drive"`.
    pub device_type: Option<Spanned<String>>,
    /// What happens when nobody answers under its node-id: `"assign"`, a device with all of this `identity` that has no node-id is
    /// given it by LSS; `"store"`, and keeps it. Default: nothing.
    pub lss: Option<Spanned<String>>,
    /// Its configuration, written at boot-up before anything else: a device configuration file (DCF) of CiA 306, or a concise one
    /// as in 1F22. A path that counts from the folder of this file. Default: none.
    pub configuration: Option<Spanned<String>>,
    /// Whether it is told to keep its configuration (1010:1) when that was written; it has to have 1020, which tells that it is
    /// there already. Default: false.
    pub store: Option<Spanned<bool>>,
    /// `"write"`: its PDOs are mapped as its axes need them; `"keep"`: they are used as they are. Default: `"write"`.
    pub pdo_mapping: Option<Spanned<String>>,
    /// Transmission type of its RPDOs: 0 to 240, 254, 255, or left to the device, which is asked to take 1, then 0, 255 and 254.
    /// Default: left to the device.
    pub rpdo_type: Option<Spanned<i64>>,
    /// Transmission type of its TPDOs: 1, 254 or 255, or left to the device, which is asked to take 1, then 255 and 254. With 254 and
    /// 255 it sends by its event timer, once in a cycle. Default: left to the device.
    pub tpdo_type: Option<Spanned<i64>>,
    /// Node guarding in place of a heartbeat, for a device without 1017: the time between two requests, `10 ms` to `10 s`.
    /// Default: none, it has a heartbeat.
    pub guarding: Option<Spanned<String>>,
    /// How many requests in a row may stay without an answer, or the device without a request, until the other one is missed: 2
    /// to 255. Default: 3.
    pub life_time_factor: Option<Spanned<i64>>,
}

/// `identity` of a `[[south.can.device]]`; what is not given is not compared.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanIdentityTable {
    /// Vendor-ID (1018:1).
    pub vendor_id: Option<Spanned<i64>>,
    /// Product code (1018:2).
    pub product_code: Option<Spanned<i64>>,
    /// Revision number (1018:3).
    pub revision_number: Option<Spanned<i64>>,
    /// Serial number (1018:4).
    pub serial_number: Option<Spanned<i64>>,
}

/// `counts` of a `[[south.can.drive]]`; each is left to the drive where it is not given.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CountsTable {
    /// Position counts in an axis unit.
    pub position: Option<Spanned<f64>>,
    /// Velocity counts in an axis unit per second, such as 600 where a count is 0.1 revolutions per minute.
    pub velocity: Option<Spanned<f64>>,
    /// Acceleration counts in an axis unit per second squared.
    pub acceleration: Option<Spanned<f64>>,
    /// Torque counts in the rated torque, 1000 where a count is a thousandth of it.
    pub torque: Option<Spanned<f64>>,
}

/// `[[south.devicenet]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DevicenetTable {
    /// CAN interface of the network, such as `"can0"`, or `"in-process"` for simulated drives.
    pub interface: Spanned<String>,
    /// Bits per second: 125000, 250000 or 500000. What goes over the network in a cycle is checked against it. Default:
    /// 125000.
    pub bit_rate: Option<Spanned<i64>>,
    /// Set the interface to this bit rate and bring it up; else it is taken as it is. Default: false.
    pub set_bit_rate: Option<bool>,
    /// Time from one poll of a drive to the next: `1 ms` to `1 s`, in whole milliseconds.
    pub cycle_time: Spanned<String>,
    /// MAC ID of the box, 0 to 63, of its own. Default: 0.
    pub mac_id: Option<Spanned<i64>>,
    /// How many answers of a drive in a row may be missing before its axis stops, 1 to 100. Default: 3.
    pub allowed_losses: Option<Spanned<i64>>,
    /// The drives, at least one.
    pub drive: Vec<Spanned<DevicenetDriveTable>>,
}

/// `[[south.devicenet.drive]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DevicenetDriveTable {
    /// Name, unique among drives.
    pub name: Spanned<String>,
    /// MAC ID of the drive, 0 to 63, unique on the network.
    pub mac_id: Spanned<i64>,
    /// `"motion"`, a CIP Motion drive with the fixed connection format, or `"ac-dc"`, a velocity drive of the AC/DC drive
    /// profile. Default: `"motion"`.
    pub kind: Option<Spanned<String>>,
    /// Expected packet rate that the drive is given, in whole milliseconds up to `10 s`; without a message for four times as
    /// long it gives the box up and stops. Default: the cycle time.
    pub packet_rate: Option<Spanned<String>>,
    /// Vendor number that the drive has to have, 1 to 65535. Default: any.
    pub vendor_id: Option<Spanned<i64>>,
    /// Product code that the drive has to have, 0 to 65535. Default: any.
    pub product_code: Option<Spanned<i64>>,
    /// What a CIP Motion drive is to be used for: `"position"`, `"velocity"`, `"torque"`. Default: all three.
    pub modes: Option<Spanned<Vec<Spanned<String>>>>,
    /// Position counts of a CIP Motion drive in one of its position units, 1 to 2147483647. Needed for one.
    pub resolution: Option<Spanned<i64>>,
    /// Millimetres that a linear axis makes in a turn of its motor. For an axis in revolutions there is none. A CIP Motion
    /// drive of a linear axis counts in millimetres without it; a velocity drive needs it.
    pub millimetres_per_turn: Option<Spanned<f64>>,
    /// Output assembly of a velocity drive: 20, basic speed control, or 21, extended speed control; its input assembly is 70
    /// or 71. Default: 21.
    pub assembly: Option<Spanned<i64>>,
    /// SpeedScale (attribute 22 of the AC/DC Drive object) of a velocity drive, -15 to 15: its speed is in units of rpm /
    /// 2^SpeedScale. Default: 0.
    pub speed_scale: Option<Spanned<i64>>,
}
