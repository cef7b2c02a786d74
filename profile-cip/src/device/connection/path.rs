//! The connection path of a Forward_Open: which device is meant, what to connect to, and configuration data.

use arrayvec::ArrayVec;

use super::refusal::Refusal;
use crate::device::config::{IdentityConfig, KeyMismatch};
use crate::device::objects::class::{CLASS_ASSEMBLY, CLASS_MESSAGE_ROUTER, CLASS_MOTION_DEVICE_AXIS};
use crate::wire::epath::{self, ElectronicKey, Encoding, LogicalType, Segment};
use crate::wire::status::ConnectionStatus;

/// Most connection points of a path: configuration, consumed, produced.
const POINTS_MAX: usize = 3;

/// What the originator wants to connect to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Application<'a> {
    /// The Message Router: an explicit connection.
    MessageRouter,
    /// The Motion Device Axis Object class: the motion connection.
    Motion(MotionPath<'a>),
    /// The Assembly Object class.
    Assembly(AssemblyPath<'a>),
}

/// The path to a connection to assemblies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct AssemblyPath<'a> {
    /// The configuration assembly, where the path names one: the instance, or the first of three connection points.
    pub configuration: Option<u32>,
    /// Connection points of consumed and produced data.
    pub points: ArrayVec<u16, POINTS_MAX>,
    /// Configuration data.
    pub data: Option<&'a [u8]>,
}

/// The path to the motion connection (Volume 9 clause 7-1.1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct MotionPath<'a> {
    /// Connection points in their order: configuration, then consumed and produced data, which are the same
    /// one.
    pub points: ArrayVec<u16, POINTS_MAX>,
    /// Configuration block.
    pub data: Option<&'a [u8]>,
}

#[derive(Default)]
struct Parts<'a> {
    class: Option<u32>,
    instance: Option<u32>,
    points: ArrayVec<u16, POINTS_MAX>,
    data: Option<&'a [u8]>,
}

/// Reads the path and checks its electronic key.
///
/// Network segments, such as a production inhibit time, are passed over. A class named again must be the same
/// one.
///
/// # Errors
/// The refusal the Forward_Open is to be answered with.
pub(crate) fn application<'a>(path: &'a [u8], identity: &IdentityConfig) -> Result<Application<'a>, Refusal> {
    let mut parts = Parts::default();
    let mut consumed = 0;
    for segment in epath::segments(path, Encoding::Padded) {
        let remaining = u8::try_from((path.len() - consumed) / 2).unwrap_or(u8::MAX);
        let fail = |status| Refusal { remaining_path_words: remaining, ..Refusal::connection(status) };
        let segment = segment.map_err(|_| fail(ConnectionStatus::INVALID_SEGMENT))?;
        consumed += segment.buffer_len(Encoding::Padded);
        parts
            .take(segment, identity)
            .map_err(|refusal| Refusal { remaining_path_words: remaining, ..refusal })?;
    }
    let inconsistent = Refusal::connection(ConnectionStatus::INVALID_APPLICATION_PATH);
    let class = parts.class.ok_or(inconsistent.clone())?;
    if class == u32::from(CLASS_MESSAGE_ROUTER)
        && parts.points.is_empty()
        && parts.data.is_none()
        && parts.instance.unwrap_or(1) == 1
    {
        return Ok(Application::MessageRouter);
    }
    // The connection points belong to the class, which instance 0 names as well.
    if class == u32::from(CLASS_MOTION_DEVICE_AXIS) && parts.instance.unwrap_or(0) == 0 {
        return Ok(Application::Motion(MotionPath { points: parts.points, data: parts.data }));
    }
    if class == u32::from(CLASS_ASSEMBLY) {
        let Parts { instance, mut points, data, .. } = parts;
        let first = if instance.is_none() && points.is_full() { points.pop_at(0) } else { None };
        let configuration = instance.or(first.map(u32::from));
        return Ok(Application::Assembly(AssemblyPath { configuration, points, data }));
    }
    Err(inconsistent)
}

impl<'a> Parts<'a> {
    fn take(&mut self, segment: Segment<'a>, identity: &IdentityConfig) -> Result<(), Refusal> {
        let bad = || Err(Refusal::connection(ConnectionStatus::INVALID_SEGMENT));
        match segment {
            Segment::Key(key) => check_key(&key, identity),
            Segment::Network { .. } => Ok(()),
            Segment::Port { .. } => Err(Refusal::connection(ConnectionStatus::PORT_NOT_AVAILABLE)),
            Segment::Data(data) if self.data.is_none() => {
                self.data = Some(data);
                Ok(())
            }
            Segment::Logical { kind, value } => {
                let value = value.get();
                match kind {
                    LogicalType::CLASS => same(&mut self.class, value),
                    LogicalType::INSTANCE => same(&mut self.instance, value),
                    LogicalType::CONNECTION_POINT => {
                        let point = u16::try_from(value).map_err(|_| inconsistent_points(value))?;
                        self.points.try_push(point).map_err(|_| inconsistent_points(value))
                    }
                    _ => bad(),
                }
            }
            _ => bad(),
        }
    }
}

fn inconsistent_points(found: u32) -> Refusal {
    Refusal { found: Some(found), ..Refusal::connection(ConnectionStatus::INCONSISTENT_PATHS) }
}

fn same(slot: &mut Option<u32>, value: u32) -> Result<(), Refusal> {
    match slot.replace(value) {
        Some(before) if before != value => Err(Refusal {
            found: Some(value),
            expected: Some(before),
            ..Refusal::connection(ConnectionStatus::INVALID_APPLICATION_PATH)
        }),
        _ => Ok(()),
    }
}

fn check_key(key: &ElectronicKey, identity: &IdentityConfig) -> Result<(), Refusal> {
    let (status, found, expected) = match identity.check_key(key) {
        Ok(()) => return Ok(()),
        Err(KeyMismatch::VendorOrProduct) if key.vendor != 0 && key.vendor != identity.vendor => {
            (ConnectionStatus::VENDOR_OR_PRODUCT_MISMATCH, key.vendor, identity.vendor)
        }
        Err(KeyMismatch::VendorOrProduct) => {
            (ConnectionStatus::VENDOR_OR_PRODUCT_MISMATCH, key.product_code, identity.product_code)
        }
        Err(KeyMismatch::DeviceType) => {
            (ConnectionStatus::DEVICE_TYPE_MISMATCH, key.device_type, identity.device_type)
        }
        Err(KeyMismatch::Revision) => (
            ConnectionStatus::REVISION_MISMATCH,
            u16::from_be_bytes([key.major, key.minor]),
            u16::from_be_bytes([identity.major, identity.minor]),
        ),
    };
    let (found, expected) = (Some(u32::from(found)), Some(u32::from(expected)));
    Err(Refusal { found, expected, ..Refusal::connection(status) })
}
