//! Simulated drives on DeviceNet.

use arrayvec::ArrayString;
use profile_cip::devicenet::master::config::DataRate;
use profile_cip::devicenet::slave::application::Application;
use profile_cip::devicenet::slave::motion_drive::{MotionDrive, MotionDriveConfig};
use profile_cip::devicenet::slave::speed_drive::{SpeedDrive, SpeedDriveConfig};
use profile_cip::devicenet::slave::{Slave, SlaveConfig};
use profile_cip::devicenet::wire::{BodyFormat, MacId};
use profile_cip::target::attribute::{Access, AttributeDefinition, DataType, Scope};
use profile_cip::target::config::{DEVICE_TYPE_CIP_MOTION_DRIVE, IdentityConfig};
use profile_generic::can::Frame;
use profile_generic::fault::FaultCause;
use profile_generic::servo::{Servo, ServoActual, ServoParameters};
use profile_generic::time::MonotonicTime;

use super::can_bus::CanNode;
use crate::config::{Devicenet, DevicenetDrive, DevicenetKind};

/// Attributes that hold limits, which the box writes: number and name of the standard.
const LIMITS: [(u16, &str); 5] = [
    (444, "Position Error Tolerance"),
    (485, "Acceleration Limit"),
    (486, "Deceleration Limit"),
    (504, "Torque Limit - Positive"),
    (505, "Torque Limit - Negative"),
];

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
    let rate = rate.code();
    match kind {
        DevicenetKind::Motion { resolution, .. } => {
            let attribute = |(id, name): &(u16, &str)| AttributeDefinition {
                settable_in_running: true,
                ..AttributeDefinition::new(Scope::Instance, *id, DataType::Real, Access::Set, name)
            };
            let config = MotionDriveConfig {
                attributes: LIMITS.iter().map(attribute).collect(),
                faults: AXIS_FAULTS.to_vec(),
                servo: ServoParameters { encoder_counts: *resolution, ..ServoParameters::default() },
            };
            let motion = MotionDrive::new(config).expect("a servo with an encoder");
            DevicenetNode::Motion(slave(mac, DEVICE_TYPE_CIP_MOTION_DRIVE, rate, motion))
        }
        DevicenetKind::Speed { assembly, .. } => {
            let config = SpeedDriveConfig {
                output: *assembly,
                faults: FAULT_CODES.to_vec(),
                servo: ServoParameters::default(),
            };
            let speed = SpeedDrive::new(config).expect("an output assembly");
            DevicenetNode::Speed(slave(mac, DEVICE_TYPE_AC_DRIVE, rate, speed))
        }
    }
}

impl DevicenetNode {
    /// Switches main power, where the kind of drive tells anything of it.
    pub fn set_main_power(&mut self, on: bool) {
        match self {
            Self::Motion(slave) => slave.application_mut().set_power(on),
            Self::Speed(_) => {}
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
