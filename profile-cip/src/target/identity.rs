//! The Identity object (class 0x01).

use super::config::IdentityConfig;
use super::event::ResetKind;
use super::object::Object;
use crate::wire::status::GeneralStatus;

/// Class code of the Identity object.
pub const CLASS_IDENTITY: u16 = 0x01;

/// How the device is, as the Identity object tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Health {
    /// Everything works.
    #[default]
    Operational,
    /// Something recoverable is wrong that does not keep the device from working.
    MinorRecoverableFault,
    /// Something is wrong that will not go away, but does not keep the device from working.
    MinorUnrecoverableFault,
    /// The device does not work until the fault is cleared.
    MajorRecoverableFault,
    /// The device does not work until it is restarted.
    MajorUnrecoverableFault,
}

impl Health {
    // Status word bits 8..=11.
    const fn status_bits(self) -> u16 {
        match self {
            Self::Operational => 0,
            Self::MinorRecoverableFault => 1 << 8,
            Self::MinorUnrecoverableFault => 1 << 9,
            Self::MajorRecoverableFault => 1 << 10,
            Self::MajorUnrecoverableFault => 1 << 11,
        }
    }

    // Attribute 8.
    const fn state(self) -> u8 {
        match self {
            Self::Operational | Self::MinorRecoverableFault | Self::MinorUnrecoverableFault => 3,
            Self::MajorRecoverableFault => 4,
            Self::MajorUnrecoverableFault => 5,
        }
    }
}

/// The Identity object as it is at this moment.
pub(super) struct Identity<'a> {
    pub config: &'a IdentityConfig,
    pub health: Health,
    /// Whether the motion connection is open.
    pub owned: bool,
}

impl Identity<'_> {
    /// Attribute 5: bit 0 owned, bits 7..4 extended device status, bits 11..8 faults.
    pub fn status(&self) -> u16 {
        // Extended device status: 2 at least one faulted I/O connection, 3 no I/O connection, 5 major fault,
        // 6 at least one I/O connection in run mode.
        let extended = match (self.health, self.owned) {
            (Health::MajorRecoverableFault | Health::MajorUnrecoverableFault, _) => 5,
            (_, true) => 6,
            (_, false) => 3,
        };
        self.health.status_bits() | extended << 4 | u16::from(self.owned)
    }

    pub fn state(&self) -> u8 {
        self.health.state()
    }
}

impl Object for Identity<'_> {
    const REVISION: u16 = 1;
    const ALL: &'static [u16] = &[1, 2, 3, 4, 5, 6, 7, 8];
    const CLASS_ALL: &'static [u16] = &[1, 2, 6, 7];
    const ATTRIBUTE_MAX: u16 = 8;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        let c = self.config;
        match attribute {
            1 => out.extend(c.vendor.to_le_bytes()),
            2 => out.extend(c.device_type.to_le_bytes()),
            3 => out.extend(c.product_code.to_le_bytes()),
            4 => out.extend([c.major, c.minor]),
            5 => out.extend(self.status().to_le_bytes()),
            6 => out.extend(c.serial_number.to_le_bytes()),
            7 => short_string(&c.product_name, out),
            8 => out.push(self.state()),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }
}

/// Reads the parameter of a Reset service; without one the type is 0.
pub(super) fn reset_kind(data: &[u8]) -> Result<ResetKind, GeneralStatus> {
    match data {
        [] | [0] => Ok(ResetKind::PowerCycle),
        [1] => Ok(ResetKind::FactoryDefaults),
        [_] => Err(GeneralStatus::INVALID_PARAMETER),
        _ => Err(GeneralStatus::TOO_MUCH_DATA),
    }
}

/// Appends a SHORT_STRING: length byte and text.
pub(super) fn short_string(text: &str, out: &mut Vec<u8>) {
    let bytes = text.as_bytes();
    let length = u8::try_from(bytes.len()).unwrap_or(u8::MAX);
    out.push(length);
    out.extend(bytes.iter().take(usize::from(length)));
}
