//! The chains that every disturbance is tried on: each kind of bus, with and without a shared clock.

use std::fmt;

use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::ControllerConfig;
use profile_generic::scaling::UnitKind;
use profile_generic::time::DurationNs;

/// What all boxes have in common: a turntable alone.
const FRONT: &str = r#"
[box]
name = "motion"

[[device]]
name = "front"
listen = "10.0.0.2"
axes = ["turntable"]
update_period = { min = "PERIOD", max = "40 ms" }

[device.identity]
vendor_id = 1
product_code = 1001
serial_number = 0x0041_4201
product_name = "Axisbridge motion"

[[axis]]
name = "turntable"
instance = 1
drive = "drive"
unit = "revolution"
motion_resolution = 1_000_000

[axis.limits]
following_error = 0.5
"#;

const SERCOS: &str = r#"
[south.sercos]
interface = "in-process"
cycle_time = "CYCLE"
jitter = "100 us"

[[south.sercos.drive]]
name = "drive"
address = 1
"#;

const CANOPEN: &str = r#"
[[south.can]]
interface = "in-process"
cycle_time = "CYCLE"

[[south.can.drive]]
name = "drive"
node = 1
"#;

const DEVICENET: &str = r#"
[[south.devicenet]]
interface = "in-process"
bit_rate = 500_000
cycle_time = "CYCLE"
mac_id = 1

[[south.devicenet.drive]]
name = "drive"
mac_id = 5
resolution = 1_048_576
"#;

/// A bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bus {
    /// 2 ms, four cycles in an update period.
    Sercos,
    /// 4 ms, two cycles in an update period.
    Canopen,
    /// 10 ms, two cycles in an update period.
    Devicenet,
}

impl Bus {
    /// A rig with this bus at this cycle, whose device takes update periods from `least` on.
    pub fn ready(self, cycle: DurationNs, least: DurationNs, limits: &str) -> Rig {
        self.ready_with(cycle, least, limits, &[])
    }

    /// The same with some texts of its configuration replaced.
    fn ready_with(
        self,
        cycle: DurationNs,
        least: DurationNs,
        limits: &str,
        replaced: &[(&str, &str)],
    ) -> Rig {
        let (south, drives) = match self {
            Self::Sercos => (SERCOS, vec![(1, UnitKind::Rotary)]),
            Self::Canopen => (CANOPEN, Vec::new()),
            Self::Devicenet => (DEVICENET, Vec::new()),
        };
        let micros = |span: DurationNs| format!("{} us", span.as_nanos() / 1_000);
        let configuration = format!("{FRONT}{limits}{south}");
        let configuration =
            configuration.replace("CYCLE", &micros(cycle)).replace("PERIOD", &micros(least.min(cycle)));
        let configuration = replaced.iter().fold(configuration, |text, (old, new)| text.replace(old, new));
        Rig::ready(Settings { configuration, drives, ..Settings::default() })
    }
}

impl fmt::Display for Bus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Sercos => "SERCOS",
            Self::Canopen => "CANopen",
            Self::Devicenet => "DeviceNet",
        })
    }
}

/// A bus and how the controller works with the gateway.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chain {
    /// The bus.
    pub bus: Bus,
    /// Whether controller and gateway share a clock.
    pub synchronous: bool,
}

impl Chain {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self { bus: Bus::Sercos, synchronous: true },
        Self { bus: Bus::Sercos, synchronous: false },
        Self { bus: Bus::Canopen, synchronous: true },
        Self { bus: Bus::Canopen, synchronous: false },
        Self { bus: Bus::Devicenet, synchronous: true },
        Self { bus: Bus::Devicenet, synchronous: false },
    ];

    /// The controller's update period.
    pub const fn period(self) -> DurationNs {
        match self.bus {
            Bus::Sercos | Bus::Canopen => DurationNs::from_millis(8),
            Bus::Devicenet => DurationNs::from_millis(20),
        }
    }

    /// The cycle of the bus.
    pub const fn cycle(self) -> DurationNs {
        match self.bus {
            Bus::Sercos => DurationNs::from_millis(2),
            Bus::Canopen => DurationNs::from_millis(4),
            Bus::Devicenet => DurationNs::from_millis(10),
        }
    }

    /// A rig whose bus is up.
    pub fn ready(self) -> Rig {
        self.ready_with("")
    }

    /// The same with more limits of the axis.
    pub fn ready_with(self, limits: &str) -> Rig {
        self.bus.ready(self.cycle(), self.cycle(), limits)
    }

    /// A rig whose device has assemblies with this layout in place of CIP Motion, and more limits of the axis.
    pub fn ready_for_assemblies(self, layout: &str, limits: &str) -> Rig {
        let identity = "[device.identity]";
        let assembly = format!("assembly = {layout}\n\n{identity}");
        self.bus.ready_with(self.cycle(), self.cycle(), limits, &[(identity, &assembly)])
    }

    /// A rig whose axis turns without end: its drive counts within a revolution.
    pub fn endless(self) -> Rig {
        let axis = "motion_resolution = 1_000_000";
        let drive = "address = 1";
        self.bus.ready_with(
            self.cycle(),
            self.cycle(),
            "",
            &[
                (axis, &format!("{axis}\nunwind_counts = 1_000_000")),
                (drive, &format!("{drive}\nset_scaling = true")),
            ],
        )
    }

    /// The controller's configuration.
    pub fn controller(self, rig: &Rig) -> ControllerConfig {
        let mut config = rig.controller_config();
        config.rpi_us = u32::try_from(self.period().as_nanos() / 1_000).expect("some milliseconds");
        if !self.synchronous {
            config.grand_master = None;
        }
        config
    }
}

impl fmt::Display for Chain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&format!("{} {}", self.bus, if self.synchronous { "sync" } else { "async" }))
    }
}
