//! What an explicit message asks for.

use super::settings::BodyFormat;

/// Reads an attribute.
pub const GET: u8 = 0x0E;
/// Writes an attribute.
pub const SET: u8 = 0x10;
/// Resets an object.
pub const RESET: u8 = 0x05;
/// Reads some attributes.
pub const GET_LIST: u8 = 0x03;
/// Writes some attributes.
pub const SET_LIST: u8 = 0x04;
/// Allocates the predefined master/slave connection set.
pub const ALLOCATE: u8 = 0x4B;
/// Releases it.
pub const RELEASE: u8 = 0x4C;

/// An explicit request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// The service.
    pub service: u8,
    /// The class.
    pub class: u16,
    /// The instance; 0 is the class itself.
    pub instance: u16,
    /// The attribute, for the services with a single one.
    pub attribute: Option<u16>,
    /// What follows.
    pub data: Vec<u8>,
}

/// Two bytes as a number.
#[must_use]
pub fn word(data: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes([*data.get(at)?, *data.get(at + 1)?]))
}

/// Reads class, instance and attribute from a padded path.
#[must_use]
pub fn path(mut rest: &[u8]) -> Option<(u16, u16, Option<u16>)> {
    let (mut class, mut instance, mut attribute) = (None, 0, None);
    while let Some(&segment) = rest.first() {
        let (value, used) = match segment & 0x03 {
            0 => (u16::from(*rest.get(1)?), 2),
            1 => (word(rest, 2)?, 4),
            _ => return None,
        };
        match segment & 0xFC {
            0x20 => class = Some(value),
            0x24 => instance = value,
            0x30 => attribute = Some(value),
            _ => return None,
        }
        rest = rest.get(used..)?;
    }
    Some((class?, instance, attribute))
}

impl Request {
    /// Reads a request from its service code on. `wide` is for the attributes of class 42h.
    #[must_use]
    pub fn parse(format: BodyFormat, wide: bool, message: &[u8]) -> Option<Self> {
        let (&service, body) = message.split_first()?;
        if service & 0x80 != 0 {
            return None;
        }
        let single = matches!(service, GET | SET);
        let byte = |at: usize| body.get(at).copied().map(u16::from);
        let (class, instance, used) = match format {
            BodyFormat::EightEight => (byte(0)?, byte(1)?, 2),
            BodyFormat::EightSixteen => (byte(0)?, word(body, 1)?, 3),
            BodyFormat::SixteenSixteen => (word(body, 0)?, word(body, 2)?, 4),
            BodyFormat::SixteenEight => (word(body, 0)?, byte(2)?, 3),
            BodyFormat::Path => {
                let end = 1 + 2 * usize::from(*body.first()?);
                let (class, instance, attribute) = path(body.get(1..end)?)?;
                let data = body.get(end..)?.to_vec();
                return Some(Self { service, class, instance, attribute, data });
            }
        };
        let data = body.get(used..)?;
        let (attribute, data) = if !single {
            (None, data)
        } else if wide && class == 0x42 {
            (word(data, 0), data.get(2..).unwrap_or(&[]))
        } else {
            (data.first().copied().map(u16::from), data.get(1..).unwrap_or(&[]))
        };
        Some(Self { service, class, instance, attribute, data: data.to_vec() })
    }
}
