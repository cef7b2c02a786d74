//! Simulated drives on DeviceNet.

use std::fmt;

use arrayvec::ArrayString;
use profile_cip::device::attribute::{Access, AttributeDefinition, DataType, DefaultValue, Scope};
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::config::{DEVICE_TYPE_CIP_MOTION_DRIVE, IdentityConfig};
use profile_cip::devicenet::access::AccessState;
use profile_cip::devicenet::master::config::DataRate;
use profile_cip::devicenet::slave::application::Application;
use profile_cip::devicenet::slave::motion_drive::{MotionDrive, MotionDriveConfig};
use profile_cip::devicenet::slave::speed_drive::{SpeedDrive, SpeedDriveConfig};
use profile_cip::devicenet::slave::{Slave, SlaveConfig};
use profile_cip::devicenet::wire::speed::SupervisorState;
use profile_cip::devicenet::wire::{BodyFormat, MacId};
use profile_generic::can::Frame;
use profile_generic::fault::FaultCause;
use profile_generic::servo::{Servo, ServoActual, ServoParameters};
use profile_generic::time::MonotonicTime;

use super::can_actor::ActingNode;
use super::can_bus::CanNode;
use super::drive_events::setup::Setup;
use super::drive_events::{Change, Shown};
use crate::config::{Devicenet, DevicenetDrive, DevicenetKind};

/// Attributes that the drive keeps: number, type, value as it comes from its maker, greatest value where there is one (the least is 0
/// then), name of the standard. Those of the box's limits are the first five.
const ATTRIBUTES: [(u16, DataType, u16, Option<u16>, &str); 18] = [
    (444, DataType::Real, 0, None, "Position Error Tolerance"),
    (485, DataType::Real, 0, None, "Acceleration Limit"),
    (486, DataType::Real, 0, None, "Deceleration Limit"),
    (504, DataType::Real, 0, None, "Torque Limit - Positive"),
    (505, DataType::Real, 0, None, "Torque Limit - Negative"),
    (440, DataType::Real, 100, Some(200), "Kvff"),
    (441, DataType::Real, 50, Some(1_000), "Kpp"),
    (442, DataType::Real, 0, Some(1_000), "Kpi"),
    (461, DataType::Real, 250, Some(5_000), "Kvp"),
    (462, DataType::Real, 100, Some(5_000), "Kvi"),
    (469, DataType::Real, 1_000, Some(10_000), "Velocity Low Pass Filter Bandwidth"),
    (502, DataType::Real, 2_000, Some(10_000), "Torque Low Pass Filter Bandwidth"),
    (503, DataType::Real, 0, Some(4_000), "Torque Notch Filter Frequency"),
    (1315, DataType::Usint, 1, Some(3), "Motor Type"),
    (1319, DataType::Real, 2, Some(50), "Motor Rated Continuous Current"),
    (1320, DataType::Real, 6, Some(150), "Motor Rated Peak Current"),
    (1329, DataType::Uint, 8, Some(100), "Rotary Motor Poles"),
    (1331, DataType::Real, 3_000, Some(12_000), "Rotary Motor Rated Speed"),
];

/// Cycles of its encoder in a revolution, and counts in a cycle: they can be set to what they are.
const ENCODER: [(u16, &str); 2] =
    [(1416, "Feedback 1 Cycle Resolution"), (1417, "Feedback 1 Cycle Interpolation")];

/// Axis Fault (attribute 657) of what can be wrong with the servo.
const AXIS_FAULTS: [(FaultCause, u8); 2] =
    [(FaultCause::OVER_CURRENT, 10), (FaultCause::MOTOR_OVER_TEMPERATURE, 5)];

/// The same as `FaultCode` of the Control Supervisor.
const FAULT_CODES: [(FaultCause, u16); 1] = [(FaultCause::MOTOR_OVER_CURRENT, 0x2310)];

/// Device type of an AC drive.
const DEVICE_TYPE_AC_DRIVE: u16 = 2;

/// A drive of either kind.
#[derive(Debug)]
pub enum DevicenetNode {
    /// A CIP Motion drive.
    Motion(Box<Slave<MotionDrive>>),
    /// A velocity drive of the AC/DC drive profile.
    Speed(Box<Slave<SpeedDrive>>),
}

fn slave<A: Application>(mac: MacId, device_type: u16, rate: u8, drive: A) -> Box<Slave<A>> {
    let identity = IdentityConfig {
        vendor: 1,
        device_type,
        product_code: 1,
        major: 1,
        minor: 1,
        serial_number: u32::from(mac.get()),
        product_name: ArrayString::from("simulated drive").unwrap_or_default(),
        configuration: 0,
    };
    let config = SlaveConfig {
        mac,
        rate,
        bus_off_reset: true,
        identity,
        rate_resolution_ms: 1,
        body_format: BodyFormat::CLASS_8_INSTANCE_8,
    };
    Box::new(Slave::new(config, drive))
}

/// The drive that the configuration expects: a servo of 1 Nm and 3000 revolutions per minute. What the configuration says of its
/// identity it has.
///
/// # Panics
/// Never with a checked configuration: encoders have counts, and assemblies are assemblies.
#[must_use]
pub fn drive(network: &Devicenet, drive: &DevicenetDrive) -> DevicenetNode {
    node(drive.mac, network.rate, &drive.kind)
}

/// A drive of this kind, with this MAC ID on a network of this rate: a servo of 1 Nm and 3000 revolutions per minute.
///
/// # Panics
/// With an encoder without counts, or an assembly that is no output assembly.
#[must_use]
pub fn node(mac: MacId, rate: DataRate, kind: &DevicenetKind) -> DevicenetNode {
    node_with(mac, rate, kind, &Setup::default()).expect("a checked configuration")
}

/// The same with what a script makes of it.
///
/// # Errors
/// It cannot work so.
pub fn node_with(
    mac: MacId,
    rate: DataRate,
    kind: &DevicenetKind,
    setup: &Setup,
) -> Result<DevicenetNode, String> {
    let rate = rate.code();
    let drive = u16::from(mac.get());
    if setup.gear(drive).is_some() {
        return Err(format!(
            "MAC ID {drive}: expected no `gear`: drives on DeviceNet have no object for one"
        ));
    }
    let wrong = |error: &dyn fmt::Display| format!("MAC ID {drive} cannot work as it is set up: {error}");
    match kind {
        DevicenetKind::Motion { resolution, .. } => {
            let config = MotionDriveConfig {
                attributes: attributes(*resolution),
                faults: AXIS_FAULTS.to_vec(),
                servo: setup.servo(
                    drive,
                    ServoParameters { encoder_counts: *resolution, ..ServoParameters::default() },
                ),
            };
            let motion = MotionDrive::new(config).map_err(|error| wrong(&error))?;
            Ok(DevicenetNode::Motion(slave(mac, DEVICE_TYPE_CIP_MOTION_DRIVE, rate, motion)))
        }
        DevicenetKind::Speed { assembly, .. } => {
            let config = SpeedDriveConfig {
                output: *assembly,
                faults: FAULT_CODES.to_vec(),
                servo: setup.servo(drive, ServoParameters::default()),
            };
            let speed = SpeedDrive::new(config).map_err(|error| wrong(&error))?;
            Ok(DevicenetNode::Speed(slave(mac, DEVICE_TYPE_AC_DRIVE, rate, speed)))
        }
    }
}

/// The attributes of a CIP Motion drive with so many counts in a revolution.
fn attributes(resolution: u32) -> Vec<AttributeDefinition> {
    let new = |id, data_type, name| AttributeDefinition {
        settable_in_running: true,
        ..AttributeDefinition::new(Scope::Instance, id, data_type, Access::Set, name)
    };
    let kept = ATTRIBUTES.iter().map(|(id, data_type, default, greatest, name)| AttributeDefinition {
        default: match data_type {
            DataType::Real => DefaultValue::Real(f64::from(*default)),
            _ => DefaultValue::Integer(i64::from(*default)),
        },
        range: greatest.map(|greatest| (0.0, f64::from(greatest))),
        ..new(*id, *data_type, name)
    });
    let encoder = ENCODER.iter().zip([resolution, 1]).map(|((id, name), value)| AttributeDefinition {
        settable_in_running: false,
        default: DefaultValue::Integer(i64::from(value)),
        range: Some((f64::from(value), f64::from(value))),
        ..new(*id, DataType::Udint, name)
    });
    kept.chain(encoder).collect()
}

impl DevicenetNode {
    /// Switches main power.
    pub fn set_main_power(&mut self, on: bool) {
        match self {
            Self::Motion(slave) => slave.application_mut().set_power(on),
            Self::Speed(slave) => slave.application_mut().set_power(on),
        }
    }

    /// The servo, to load it and to raise faults.
    pub fn servo_mut(&mut self) -> &mut Servo {
        match self {
            Self::Motion(slave) => slave.application_mut().servo_mut(),
            Self::Speed(slave) => slave.application_mut().servo_mut(),
        }
    }

    /// What the servo did in its last step.
    #[must_use]
    pub fn actual(&self) -> &ServoActual {
        match self {
            Self::Motion(slave) => slave.application().actual(),
            Self::Speed(slave) => slave.application().actual(),
        }
    }
}

/// How a node stands on its network, for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnNetwork(pub AccessState);

impl fmt::Display for OnNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.0 {
            AccessState::Off => "off",
            AccessState::Checking(_) => "checking its MAC ID",
            AccessState::Online => "on line",
            AccessState::Faulted => "communication faulted",
        })
    }
}

/// State of a drive of either kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DevicenetState {
    /// Of a CIP Motion drive.
    Motion(AxisState),
    /// Of a velocity drive.
    Speed(SupervisorState),
}

impl fmt::Display for DevicenetState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Motion(state) => state.fmt(f),
            Self::Speed(state) => state.fmt(f),
        }
    }
}

impl ActingNode for DevicenetNode {
    type State = Shown<OnNetwork, DevicenetState>;

    fn state(&self, drive: u16) -> Option<Self::State> {
        let (mac, access, state) = match self {
            Self::Motion(slave) => {
                let state = DevicenetState::Motion(slave.application().axis_state());
                (slave.config().mac, slave.access(), state)
            }
            Self::Speed(slave) => {
                let state = DevicenetState::Speed(slave.application().state());
                (slave.config().mac, slave.access(), state)
            }
        };
        let actual = self.actual();
        let (fault, warning) = (actual.fault, actual.warning);
        // The requests of the check are not distinguished.
        let access =
            if matches!(access, AccessState::Checking(_)) { AccessState::Checking(0) } else { access };
        let shown = Shown { link: OnNetwork(access), state, fault, warning, silent: false };
        (u16::from(mac.get()) == drive).then_some(shown)
    }

    fn servo_mut(&mut self, _drive: u16) -> Option<&mut Servo> {
        Some(self.servo_mut())
    }

    fn set_power(&mut self, _drive: u16, on: bool) {
        self.set_main_power(on);
    }

    fn refuses(&self, change: Change) -> Option<&'static str> {
        let warns = matches!((self, change), (Self::Motion(_), Change::Warning(_)));
        warns.then_some("a CIP Motion drive on DeviceNet reports no warnings")
    }
}

impl CanNode for DevicenetNode {
    fn start(&mut self, now: MonotonicTime) {
        match self {
            Self::Motion(slave) => slave.start(now),
            Self::Speed(slave) => slave.start(now),
        }
    }

    fn handle_frame(&mut self, now: MonotonicTime, frame: &Frame) {
        // What is refused changes nothing.
        let _ = match self {
            Self::Motion(slave) => slave.handle_frame(now, frame),
            Self::Speed(slave) => slave.handle_frame(now, frame),
        };
    }

    fn handle_time(&mut self, _now: MonotonicTime) {
        // A slave lets time pass when it is asked for frames. Nobody looks at its events.
        match self {
            Self::Motion(slave) => while slave.poll_event().is_some() {},
            Self::Speed(slave) => while slave.poll_event().is_some() {},
        }
    }

    fn poll(&mut self, now: MonotonicTime) -> Option<Frame> {
        match self {
            Self::Motion(slave) => slave.poll(now),
            Self::Speed(slave) => slave.poll(now),
        }
    }

    fn wake_at(&self) -> MonotonicTime {
        let wake = match self {
            Self::Motion(slave) => slave.wake_at(),
            Self::Speed(slave) => slave.wake_at(),
        };
        wake.unwrap_or(MonotonicTime::MAX)
    }

    fn bus_off(&mut self, now: MonotonicTime) {
        match self {
            Self::Motion(slave) => slave.handle_bus_off(now),
            Self::Speed(slave) => slave.handle_bus_off(now),
        }
    }
}
