//! The drive behind the slave, whichever profile it has.

use super::DevicenetSlave;
use super::motion_drive::MotionDrive;
use super::objects::{Answer, GET, RESET, Refusal, Request, SET};
use super::settings::{Profile, Settings};
use super::speed_drive::SpeedDrive;

/// The drive.
#[derive(Debug, Clone)]
pub enum Drive {
    /// A CIP Motion drive.
    Motion(Box<MotionDrive>),
    /// An AC drive.
    Speed(Box<SpeedDrive>),
}

/// The seconds of a time in microseconds.
fn seconds(us: u64) -> f64 {
    f64::from(u32::try_from(us).unwrap_or(u32::MAX)) / 1e6
}

impl Drive {
    /// A drive that has just got power.
    #[must_use]
    pub fn new(settings: &Settings, now_us: u64) -> Self {
        match settings.profile {
            Profile::Motion => Self::Motion(Box::new(MotionDrive::new(settings, now_us))),
            Profile::Speed => Self::Speed(Box::new(SpeedDrive::new(settings, now_us))),
        }
    }

    /// The state.
    #[must_use]
    pub fn state(&self) -> u8 {
        match self {
            Self::Motion(drive) => drive.state(),
            Self::Speed(drive) => drive.state(),
        }
    }

    /// Counts or turns.
    #[must_use]
    pub fn position(&self) -> f64 {
        match self {
            Self::Motion(drive) => drive.position(),
            Self::Speed(drive) => drive.turns(),
        }
    }

    /// Units per second or RPM.
    #[must_use]
    pub fn velocity(&self) -> f64 {
        match self {
            Self::Motion(drive) => drive.velocity(),
            Self::Speed(drive) => drive.rpm(),
        }
    }

    /// Whether the motor has power.
    #[must_use]
    pub fn enabled(&self) -> bool {
        match self {
            Self::Motion(drive) => drive.enabled(),
            Self::Speed(drive) => drive.enabled(),
        }
    }

    /// Whether there is a fault.
    #[must_use]
    pub fn faulted(&self) -> bool {
        match self {
            Self::Motion(drive) => drive.faulted(),
            Self::Speed(drive) => drive.faulted(),
        }
    }

    /// Makes a fault whose cause stays.
    pub fn fail(&mut self, code: u16) {
        match self {
            Self::Motion(drive) => drive.fail(code),
            Self::Speed(drive) => drive.fail(code),
        }
    }

    /// Takes the cause away.
    pub fn mend(&mut self) {
        match self {
            Self::Motion(drive) => drive.mend(),
            Self::Speed(drive) => drive.mend(),
        }
    }

    /// Lets time pass up to now.
    pub fn advance(&mut self, settings: &Settings, now_us: u64, step_us: u64) {
        match self {
            Self::Motion(drive) => drive.advance(settings, now_us, seconds(step_us)),
            Self::Speed(drive) => drive.advance(settings, now_us, seconds(step_us)),
        }
    }

    /// The poll connection is allocated.
    pub fn opened(&mut self, settings: &Settings) {
        match self {
            Self::Motion(drive) => drive.opened(settings),
            Self::Speed(drive) => drive.closed(),
        }
    }

    /// The poll connection is released.
    pub fn closed(&mut self, settings: &Settings) {
        match self {
            Self::Motion(drive) => drive.closed(settings),
            Self::Speed(drive) => drive.closed(),
        }
    }

    /// The poll connection has timed out.
    pub fn lost(&mut self, settings: &Settings) {
        match self {
            Self::Motion(drive) => drive.lost(),
            Self::Speed(drive) => drive.lost(settings),
        }
    }

    /// Takes a poll command, empty when the master is idle, and gives the answer.
    pub fn poll(&mut self, settings: &Settings, data: &[u8], assemblies: (u8, u8), size: usize) -> Vec<u8> {
        match self {
            Self::Motion(drive) => {
                drive.polled(settings);
                drive.consume(settings, data);
                drive.produce(settings, size)
            }
            Self::Speed(drive) => {
                drive.polled(settings);
                if !data.is_empty() {
                    drive.consume(settings, assemblies.0, data);
                }
                drive.produce(settings, assemblies.1)
            }
        }
    }
}

impl DevicenetSlave {
    /// Requests to the objects of the drive.
    pub(super) fn drive_object(&mut self, class: u16, request: &Request) -> Answer {
        let motion = self.settings.profile == Profile::Motion;
        match class {
            0x28..=0x2A if !motion => self.speed_object(class, request),
            0x42 if motion => self.axis_object(request),
            _ => Err(Refusal::NO_OBJECT),
        }
    }

    fn speed_object(&mut self, class: u16, request: &Request) -> Answer {
        match (request.instance, request.service, request.attribute) {
            (0, GET, Some(1)) => return Ok(vec![1, 0]),
            (0, GET, _) => return Err(Refusal::NO_ATTRIBUTE),
            (0, ..) => return Err(Refusal::NO_SERVICE),
            (1, GET | SET, None) => return Err(Refusal::SHORT),
            (1, ..) => {}
            _ => return Err(Refusal::NO_OBJECT),
        }
        let refusal = request.attribute.and_then(|attribute| self.chosen_refusal(class, attribute));
        let Drive::Speed(drive) = &mut self.drive else { return Err(Refusal::NO_OBJECT) };
        match (request.service, request.attribute) {
            (GET, Some(attribute)) => drive.get(&self.settings, class, attribute),
            (SET, Some(attribute)) => {
                if let Some(refusal) = refusal {
                    return Err(refusal);
                }
                drive.set(&self.settings, class, attribute, &request.data)?;
                self.note_set(class, 1, attribute, &request.data);
                Ok(Vec::new())
            }
            (RESET, _) if class == 0x29 => {
                drive.set(&self.settings, 0x29, 12, &[0])?;
                drive.set(&self.settings, 0x29, 12, &[1])?;
                drive.set(&self.settings, 0x29, 12, &[0])?;
                Ok(Vec::new())
            }
            _ => Err(Refusal::NO_SERVICE),
        }
    }
}
