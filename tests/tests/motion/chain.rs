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
update_period = { min = "CYCLE", max = "40 ms" }

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
cycle_time = "2 ms"
jitter = "100 us"

[[south.sercos.drive]]
name = "drive"
address = 1
"#;

const CANOPEN: &str = r#"
[[south.can]]
interface = "in-process"
cycle_time = "4 ms"

[[south.can.drive]]
name = "drive"
node = 1
"#;

const DEVICENET: &str = r#"
[[south.devicenet]]
interface = "in-process"
bit_rate = 500_000
cycle_time = "10 ms"
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
        let (south, cycle, drives) = match self.bus {
            Bus::Sercos => (SERCOS, "2 ms", vec![(1, UnitKind::Rotary)]),
            Bus::Canopen => (CANOPEN, "4 ms", Vec::new()),
            Bus::Devicenet => (DEVICENET, "10 ms", Vec::new()),
        };
        let configuration = format!("{FRONT}{limits}{south}").replace("CYCLE", cycle);
        Rig::ready(Settings { configuration, drives, ..Settings::default() })
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
        let bus = match self.bus {
            Bus::Sercos => "SERCOS",
            Bus::Canopen => "CANopen",
            Bus::Devicenet => "DeviceNet",
        };
        f.pad(&format!("{bus} {}", if self.synchronous { "sync" } else { "async" }))
    }
}
