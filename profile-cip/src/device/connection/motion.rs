//! What a Forward_Open of the motion connection must be like (Volume 9 clause 7-1.1).
//!
//! The connection points are those of both formats of the connection data (clause 6-2.7.3 names no others); a device
//! accepts one of the formats, by the size type and the size of both directions.
//!
//! Path: `20 42 2C 51 2C 02 80 04` and the 8 bytes of configuration block revision 1, or connection point
//! 0x52 and block revision 2 with any number of axis IDs behind it.
//!
//! | offset | size | configuration block |
//! |---|---|---|
//! | 0 | 1 | format revision, 1 or 2 |
//! | 1 | 1 | configuration bits: 0 verify power ratings |
//! | 2 | 2 | reserved |
//! | 4 | 4 | Drive Power Structure Class ID |
//! | 8 | 4n | Drive Power Structure Axis IDs, revision 2 only |

use super::path::MotionPath;
use super::refusal::Refusal;
use crate::device::config::MotionConfig;
use crate::device::objects::class::CLASS_MOTION_DEVICE_AXIS;
use crate::wire::Reader;
use crate::wire::epath::{Encoding, Segment, emit_path, path_len};
use crate::wire::forward_open::{ForwardOpen, Transport, Trigger};
use crate::wire::motion::{FORMAT_REVISION, FORMAT_REVISION_RUN_IDLE, Format};
use crate::wire::network_parameters::{ConnectionType, NetworkParameters};
use crate::wire::status::{ConnectionStatus, GeneralStatus};

/// Configuration connection point of block revision 1.
const CONFIGURATION_POINT_1: u16 = 0x51;
/// Configuration connection point of block revision 2.
const CONFIGURATION_POINT_2: u16 = 0x52;
/// I/O connection points, which are the format revisions: that of this edition, and that of a later one with a run/idle header.
const IO_POINT: u16 = FORMAT_REVISION as u16;
const IO_POINT_RUN_IDLE: u16 = FORMAT_REVISION_RUN_IDLE as u16;

/// Transport of the connection: class 1, cyclic, and the device is no server of it (clauses 6-2.5 and 7-1.1).
pub const TRANSPORT: Transport = Transport { server: false, trigger: Trigger::CYCLIC, class: 1 };
/// Connection type of both directions.
pub const CONNECTION_TYPE: ConnectionType = ConnectionType::POINT_TO_POINT;

const VERIFY_POWER_RATINGS: u8 = 1;

/// The application path of a Forward_Open to the device with configuration block revision 1. The block has the device
/// verify its own Drive Power Structure Class ID unless that is 0, which leaves it to the axes.
#[must_use]
pub fn application_path(config: &MotionConfig) -> Vec<u8> {
    let class_id = config.power_structure_class_id;
    let bits = if class_id == 0 { 0 } else { VERIFY_POWER_RATINGS };
    let [a, b, c, d] = class_id.to_le_bytes();
    let block = [1, bits, 0, 0, a, b, c, d];
    let path = [
        Segment::class(CLASS_MOTION_DEVICE_AXIS),
        Segment::connection_point(CONFIGURATION_POINT_1),
        Segment::connection_point(IO_POINT),
        Segment::Data(&block),
    ];
    let mut out = vec![0; path_len(&path, Encoding::Padded)];
    // The length is that of the path.
    let written = emit_path(&path, Encoding::Padded, &mut out).unwrap_or(0);
    out.truncate(written);
    out
}
/// Extended status of a Class ID that does not match; the IDs of axes count on from the next one.
const CLASS_ID_MISMATCH: u16 = 0x04;
const AXIS_ID_MISMATCH: u16 = 0x05;

/// Checks the connection points and the configuration block. Returns the format revision of the connection data and the configuration
/// bits.
pub(crate) fn check_path(path: &MotionPath<'_>, config: &MotionConfig) -> Result<(u8, u8), Refusal> {
    let inconsistent = |found: u16, expected: u16| {
        Refusal::value(ConnectionStatus::INCONSISTENT_PATHS, u32::from(found), u32::from(expected))
    };
    let Some((&configuration, io)) = path.points.split_first() else {
        return Err(Refusal::connection(ConnectionStatus::INCONSISTENT_PATHS));
    };
    let revision = match configuration {
        CONFIGURATION_POINT_1 => 1,
        CONFIGURATION_POINT_2 => 2,
        other => return Err(inconsistent(other, CONFIGURATION_POINT_1)),
    };
    let Some(&point) = io.first() else { return Err(inconsistent(configuration, IO_POINT)) };
    let format = match point {
        IO_POINT => FORMAT_REVISION,
        // The fixed format has no later revision.
        IO_POINT_RUN_IDLE if config.format == Format::Variable => FORMAT_REVISION_RUN_IDLE,
        other => return Err(inconsistent(other, IO_POINT)),
    };
    if let Some(other) = io.iter().find(|other| **other != point) {
        return Err(inconsistent(*other, point));
    }
    let bits = check_block(path.data.unwrap_or(&[]), revision, config)?;
    Ok((format, bits))
}

/// Returns the configuration bits.
fn check_block(block: &[u8], revision: u8, config: &MotionConfig) -> Result<u8, Refusal> {
    let found = u32::try_from(block.len()).unwrap_or(u32::MAX);
    let size = || Refusal::value(ConnectionStatus::INVALID_CONFIGURATION_SIZE, found, 8);
    let mut r = Reader::new(block);
    let block_revision = r.u8("configuration revision").map_err(|_| size())?;
    let bits = r.u8("configuration bits").map_err(|_| size())?;
    r.take("reserved", 2).map_err(|_| size())?;
    let class_id = r.u32("power structure class ID").map_err(|_| size())?;
    let axis_ids = r.rest();
    if !axis_ids.len().is_multiple_of(4) || (revision == 1 && !axis_ids.is_empty()) {
        return Err(size());
    }
    if block_revision != revision {
        // The index of the block's element at fault, as the extended status of the other elements is.
        let refusal = Refusal::new(GeneralStatus::INVALID_ATTRIBUTE_VALUE, 0);
        let (found, expected) = (Some(u32::from(block_revision)), Some(u32::from(revision)));
        return Err(Refusal { found, expected, ..refusal });
    }
    if bits & VERIFY_POWER_RATINGS == 0 {
        return Ok(bits);
    }
    // In revision 2 a zero class ID leaves the check to the axis IDs, and a zero axis ID is not checked.
    let class_checked = revision == 1 || axis_ids.is_empty() || class_id != 0;
    if class_checked && class_id != config.power_structure_class_id {
        return Err(power_mismatch(CLASS_ID_MISMATCH, class_id, Some(config.power_structure_class_id)));
    }
    for (n, id) in axis_ids.chunks_exact(4).enumerate() {
        let id = u32::from_le_bytes([id[0], id[1], id[2], id[3]]);
        let expected = config.power_structure_axis_ids.get(n).copied();
        if id != 0 && expected != Some(id) {
            let n = u16::try_from(n).unwrap_or(u16::MAX - AXIS_ID_MISMATCH);
            return Err(power_mismatch(AXIS_ID_MISMATCH + n, id, expected));
        }
    }
    Ok(bits)
}

fn power_mismatch(extended: u16, found: u32, expected: Option<u32>) -> Refusal {
    let refusal = Refusal::new(GeneralStatus::INVALID_ATTRIBUTE_VALUE, extended);
    Refusal { found: Some(found), expected, ..refusal }
}

/// Checks transport, directions, sizes and intervals.
pub(crate) fn check_parameters(open: &ForwardOpen<'_>, config: &MotionConfig) -> Result<(), Refusal> {
    check_transport(open.transport)?;
    let variable = config.is_variable();
    check_direction(&open.o_to_t, variable, config.sizes(config.o_to_t_size_max), &O_TO_T)?;
    check_direction(&open.t_to_o, variable, config.sizes(config.t_to_o_size_max), &T_TO_O)?;
    if open.multiplier().is_none() {
        let found = u32::from(open.timeout_multiplier);
        return Err(Refusal::value(ConnectionStatus::MULTIPLIER_NOT_ACCEPTABLE, found, 7));
    }
    let acceptable = config.acceptable_rpi_us(open.o_to_t_rpi_us);
    if open.o_to_t_rpi_us != acceptable {
        return Err(Refusal::intervals(open.o_to_t_rpi_us, acceptable, acceptable));
    }
    // There is one Controller Update Period, so both directions have the same interval.
    if open.t_to_o_rpi_us != acceptable {
        return Err(Refusal::intervals(open.t_to_o_rpi_us, acceptable, acceptable));
    }
    Ok(())
}

fn check_transport(transport: Transport) -> Result<(), Refusal> {
    if transport.class != TRANSPORT.class {
        let (found, expected) = (u32::from(transport.class), u32::from(TRANSPORT.class));
        return Err(Refusal::value(ConnectionStatus::CLASS_NOT_SUPPORTED, found, expected));
    }
    if transport.trigger != TRANSPORT.trigger {
        let (found, expected) = (u32::from(transport.trigger.0), u32::from(TRANSPORT.trigger.0));
        return Err(Refusal::value(ConnectionStatus::TRIGGER_NOT_SUPPORTED, found, expected));
    }
    if transport.server != TRANSPORT.server {
        return Err(Refusal::value(ConnectionStatus::DIRECTION_NOT_SUPPORTED, 1, 0));
    }
    Ok(())
}

struct Direction {
    connection_type: ConnectionStatus,
    fixed_variable: ConnectionStatus,
    size: ConnectionStatus,
}

const O_TO_T: Direction = Direction {
    connection_type: ConnectionStatus::INVALID_O_TO_T_TYPE,
    fixed_variable: ConnectionStatus::INVALID_O_TO_T_FIXED_VARIABLE,
    size: ConnectionStatus::INVALID_O_TO_T_SIZE,
};

const T_TO_O: Direction = Direction {
    connection_type: ConnectionStatus::INVALID_T_TO_O_TYPE,
    fixed_variable: ConnectionStatus::INVALID_T_TO_O_FIXED_VARIABLE,
    size: ConnectionStatus::INVALID_T_TO_O_SIZE,
};

fn check_direction(
    parameters: &NetworkParameters,
    variable: bool,
    (size_min, size_max): (u16, u16),
    direction: &Direction,
) -> Result<(), Refusal> {
    if parameters.connection_type != CONNECTION_TYPE {
        let (found, expected) = (u32::from(parameters.connection_type.0), u32::from(CONNECTION_TYPE.0));
        return Err(Refusal::value(direction.connection_type, found, expected));
    }
    if parameters.redundant_owner {
        return Err(Refusal::value(ConnectionStatus::INVALID_REDUNDANT_OWNER, 1, 0));
    }
    if parameters.variable != variable {
        let (found, expected) = (u32::from(parameters.variable), u32::from(variable));
        return Err(Refusal::value(direction.fixed_variable, found, expected));
    }
    if parameters.size > size_max {
        return Err(Refusal::size(direction.size, parameters.size, size_max));
    }
    if parameters.size < size_min {
        return Err(Refusal::size(direction.size, parameters.size, size_min));
    }
    Ok(())
}
