//! The objects of the AC/DC drive profile: Motor Data (28), Control Supervisor (29), AC/DC Drive (2A), and the assemblies
//! (class 4).

use profile_generic::servo::ServoParameters;

use super::super::super::wire::speed::{
    Assembly, DRIVE_MODE_SPEED as MODE_SPEED, DRIVE_MODE_TORQUE as MODE_TORQUE, SpeedActual, SpeedCommand,
    SpeedStatus,
};
use super::SpeedDrive;
use crate::device::objects::object::Object;
use crate::wire::status::GeneralStatus;

/// Class code.
pub const CLASS_ASSEMBLY: u16 = 0x04;
/// Class code.
pub const CLASS_MOTOR_DATA: u16 = 0x28;
/// Class code.
pub const CLASS_CONTROL_SUPERVISOR: u16 = 0x29;
pub use crate::device::objects::class::CLASS_AC_DC_DRIVE;

/// Motor type: permanent magnet, sinusoidal.
const MOTOR_TYPE: u8 = 9;

/// What can be set, with the value it has at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// 29:5 `NetCtrl`, for the assemblies without that bit.
    pub net_control: bool,
    /// 2A:4 `NetRef`, for the assemblies without that bit.
    pub net_reference: bool,
    /// 2A:6 `DriveMode`: 2 closed-loop speed, 3 torque.
    pub mode: u8,
    /// 2A:18 acceleration time from 0 to the high speed limit, ms.
    pub acceleration_ms: u16,
    /// 2A:19 deceleration time from the high speed limit to 0, ms.
    pub deceleration_ms: u16,
    /// 2A:20 low speed limit, rpm / 2^SpeedScale.
    pub low_limit: u16,
    /// 2A:21 high speed limit, rpm / 2^SpeedScale.
    pub high_limit: u16,
    /// 2A:22 `SpeedScale`: a unit of speed is 2^-SpeedScale rpm. -7..=7.
    pub speed_scale: i8,
    /// 2A:24 `TorqueScale`: a unit of torque is 2^-TorqueScale Nm. -7..=7.
    pub torque_scale: i8,
    /// What the drive was given of its motor.
    pub motor: MotorPlate,
}

/// Motor Data (28) that can be set. The simulated motor is what it is whatever they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MotorPlate {
    /// 28:6 `RatedCurrent`, 100 mA.
    pub rated_current: u16,
    /// 28:7 `RatedVoltage`, V.
    pub rated_voltage: u16,
    /// 28:15 `BaseSpeed`, rpm.
    pub base_speed: u16,
}

impl MotorPlate {
    /// That of the motor of a servo.
    #[must_use]
    pub fn of(servo: &ServoParameters) -> Self {
        let word = |value: i64| u16::try_from(value.clamp(0, 65_535)).unwrap_or(0);
        Self {
            rated_current: word(servo.rated_current.0 / 100_000),
            rated_voltage: word(servo.bus_voltage.0 / 1_000_000),
            base_speed: word(servo.rated_velocity.0 / 1_000_000 * 60 / 1000),
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            net_control: true,
            net_reference: true,
            mode: MODE_SPEED,
            acceleration_ms: 500,
            deceleration_ms: 500,
            low_limit: 0,
            high_limit: 3000,
            speed_scale: 0,
            torque_scale: 0,
            motor: MotorPlate::default(),
        }
    }
}

/// Largest scale either way.
const SCALE_MAX: i8 = 7;

/// The Assembly object of one output and one input assembly.
pub(super) struct Assemblies<'a, const INSTANCE: u16> {
    pub command: &'a SpeedCommand,
    pub actual: &'a SpeedActual,
}

impl<const INSTANCE: u16> Object for Assemblies<'_, INSTANCE> {
    const REVISION: u16 = 2;
    const INSTANCE: u16 = INSTANCE;
    const ALL: &'static [u16] = &[];
    const ATTRIBUTE_MAX: u16 = 3;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let assembly = Assembly(INSTANCE.to_le_bytes()[0]);
        let mut data = [0; 6];
        let len = match attribute {
            3 if assembly.is_output() => self.command.emit(assembly, &mut data),
            3 => self.actual.emit(assembly, &mut data),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        };
        out.extend(&data[..len.map_err(|_| GeneralStatus::DEVICE_STATE_CONFLICT)?]);
        Ok(())
    }
}

/// Motor Data.
pub(super) struct MotorData<'a>(pub &'a mut SpeedDrive);

impl Object for MotorData<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[];
    const ATTRIBUTE_MAX: u16 = 15;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let motor = &self.0.settings.motor;
        match attribute {
            3 => out.push(MOTOR_TYPE),
            6 => out.extend(motor.rated_current.to_le_bytes()),
            7 => out.extend(motor.rated_voltage.to_le_bytes()),
            15 => out.extend(motor.base_speed.to_le_bytes()),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        match attribute {
            3 => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
            6 | 7 | 15 => Ok(2),
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
    }

    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        self.0.check_idle()?;
        let value = match value {
            [low, high] if (*low, *high) != (0, 0) => u16::from_le_bytes([*low, *high]),
            _ => return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE),
        };
        let motor = &mut self.0.settings.motor;
        match attribute {
            6 => motor.rated_current = value,
            7 => motor.rated_voltage = value,
            _ => motor.base_speed = value,
        }
        Ok(())
    }
}

/// Control Supervisor.
pub(super) struct ControlSupervisor<'a>(pub &'a mut SpeedDrive);

impl Object for ControlSupervisor<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[];
    const ATTRIBUTE_MAX: u16 = 16;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        use super::super::super::wire::speed::SpeedControl as Control;
        let drive = &self.0;
        let control = |bit| u8::from(drive.command.control.contains(bit));
        let status = |bit| u8::from(drive.status().contains(bit));
        match attribute {
            3 => out.push(control(Control::RUN_FORWARD)),
            4 => out.push(control(Control::RUN_REVERSE)),
            5 => out.push(u8::from(drive.settings.net_control)),
            6 => out.push(drive.state.0),
            7 => out.push(status(SpeedStatus::RUNNING_FORWARD)),
            8 => out.push(status(SpeedStatus::RUNNING_REVERSE)),
            9 => out.push(status(SpeedStatus::READY)),
            10 => out.push(status(SpeedStatus::FAULTED)),
            11 => out.push(status(SpeedStatus::WARNING)),
            12 => out.push(control(Control::FAULT_RESET)),
            13 => out.extend(drive.fault_code().to_le_bytes()),
            14 => out.extend([0, 0]),
            15 => out.push(status(SpeedStatus::CONTROL_FROM_NET)),
            // Fault and stop when the network is lost.
            16 => out.push(0),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        match attribute {
            5 | 12 | 16 => Ok(1),
            // An explicit message has nobody who watches that the next one comes: Run goes by the I/O connection.
            3..=16 => Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE),
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
    }

    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        let value = bool_of(value)?;
        match attribute {
            5 => {
                self.0.check_idle()?;
                self.0.settings.net_control = value;
            }
            12 => self.0.explicit_reset = value,
            // The other modes let the drive run on without the network.
            _ if value => return Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE),
            _ => {}
        }
        Ok(())
    }
}

/// AC/DC Drive.
pub(super) struct AcDcDrive<'a>(pub &'a mut SpeedDrive);

impl Object for AcDcDrive<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[];
    const ATTRIBUTE_MAX: u16 = 29;

    // Flat: one arm per attribute.
    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let drive = &self.0;
        let settings = &drive.settings;
        let actual = drive.speed_actual();
        let status = |bit| u8::from(actual.status.contains(bit));
        match attribute {
            3 => out.push(status(SpeedStatus::AT_REFERENCE)),
            4 => out.push(u8::from(settings.net_reference)),
            6 => out.push(settings.mode),
            7 => out.extend(actual.speed.to_le_bytes()),
            8 => out.extend(drive.command.speed.to_le_bytes()),
            // 100 mA.
            9 => out.extend(super::word(drive.actual.current.0 / 100_000).to_le_bytes()),
            11 => out.extend(actual.torque.to_le_bytes()),
            12 => out.extend(drive.command.torque.to_le_bytes()),
            15 => out.extend(super::word(drive.power_watts()).to_le_bytes()),
            18 => out.extend(settings.acceleration_ms.to_le_bytes()),
            19 => out.extend(settings.deceleration_ms.to_le_bytes()),
            20 => out.extend(settings.low_limit.to_le_bytes()),
            21 => out.extend(settings.high_limit.to_le_bytes()),
            22 => out.extend(settings.speed_scale.to_le_bytes()),
            24 => out.extend(settings.torque_scale.to_le_bytes()),
            29 => out.push(status(SpeedStatus::REFERENCE_FROM_NET)),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    fn settable_len(&self, attribute: u16) -> Result<usize, GeneralStatus> {
        match attribute {
            4 | 6 | 22 | 24 => Ok(1),
            18..=21 => Ok(2),
            3..=15 | 29 => {
                self.get(attribute, &mut Vec::new())?;
                Err(GeneralStatus::ATTRIBUTE_NOT_SETTABLE)
            }
            _ => Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
    }

    // Flat: one arm per attribute.
    fn set(&mut self, attribute: u16, value: &[u8]) -> Result<(), GeneralStatus> {
        self.0.check_idle()?;
        let word = || match value {
            [low, high] => u16::from_le_bytes([*low, *high]),
            _ => 0,
        };
        let scale = || match value {
            [byte] if byte.cast_signed().abs() <= SCALE_MAX => Ok(byte.cast_signed()),
            _ => Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE),
        };
        let fits = |fits: bool| if fits { Ok(()) } else { Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE) };
        let settings = &mut self.0.settings;
        match attribute {
            4 => settings.net_reference = bool_of(value)?,
            6 => {
                fits(matches!(value, [MODE_SPEED | MODE_TORQUE]))?;
                settings.mode = value[0];
            }
            18 => settings.acceleration_ms = word(),
            19 => {
                // A drive that cannot stop must not be made.
                fits(word() != 0)?;
                settings.deceleration_ms = word();
            }
            20 => {
                fits(word() <= settings.high_limit)?;
                settings.low_limit = word();
            }
            21 => {
                fits(word() >= settings.low_limit && word() <= 32_767)?;
                settings.high_limit = word();
            }
            22 => settings.speed_scale = scale()?,
            _ => settings.torque_scale = scale()?,
        }
        Ok(())
    }
}

fn bool_of(value: &[u8]) -> Result<bool, GeneralStatus> {
    match value {
        [0] => Ok(false),
        [1] => Ok(true),
        _ => Err(GeneralStatus::INVALID_ATTRIBUTE_VALUE),
    }
}
