//! What a Forward_Open of a connection to assemblies must be like.
//!
//! Path: class 0x04, the configuration assembly as instance or as the first of three connection points where it is named, then
//! the connection points of consumed and produced data. The consumed one says what the originator may do:
//!
//! | consumed | role | size O->T | sent T->O |
//! |---|---|---|---|
//! | output assembly | exclusive owner | sequence count, run/idle header, assembly | input assembly |
//! | 152 | input only | sequence count, with or without run/idle header | input assembly |
//! | 153 | listen only | as 152 | input assembly |
//!
//! T->O data go to the originator, or to a multicast group. All connections that ask for multicast consume one stream: interval,
//! priority, and fixed or variable size have to be those of the first one. O->T is point to point.

use super::path::AssemblyPath;
use super::refusal::Refusal;
use crate::assembly::layout::{CONFIGURATION_POINT, INPUT_ONLY_POINT, LISTEN_ONLY_POINT};
use crate::assembly::{Assemblies, RUN_IDLE_LEN};
use crate::device::config::MotionConfig;
use crate::device::motion_link::{AssemblyRole, OpenParameters};
use crate::wire::class1::SEQUENCE_COUNT_LEN;
use crate::wire::forward_open::{ForwardOpen, Trigger};
use crate::wire::network_parameters::{ConnectionType, NetworkParameters};
use crate::wire::status::ConnectionStatus;

/// Sizes of a heartbeat: the sequence count, and with a run/idle header.
const HEARTBEAT_SIZES: [usize; 2] = [SEQUENCE_COUNT_LEN, SEQUENCE_COUNT_LEN + RUN_IDLE_LEN];

/// Checks the connection points and the configuration. Returns what the originator wants to be.
pub(crate) fn check_path(path: &AssemblyPath<'_>, assemblies: &Assemblies) -> Result<AssemblyRole, Refusal> {
    let wrong =
        |status, found: u16, expected: u16| Refusal::value(status, u32::from(found), u32::from(expected));
    if let Some(found) = path.configuration.filter(|found| *found != u32::from(CONFIGURATION_POINT)) {
        let status = ConnectionStatus::INVALID_CONFIGURATION_APPLICATION_PATH;
        return Err(Refusal::value(status, found, u32::from(CONFIGURATION_POINT)));
    }
    if let Some(data) = path.data.filter(|data| !data.is_empty()) {
        let found = u32::try_from(data.len()).unwrap_or(u32::MAX);
        return Err(Refusal::value(ConnectionStatus::INVALID_CONFIGURATION_SIZE, found, 0));
    }
    let &[consumed, produced] = path.points.as_slice() else {
        return Err(Refusal::connection(ConnectionStatus::INCONSISTENT_PATHS));
    };
    let role = match consumed {
        point if point == assemblies.output_point() => AssemblyRole::ExclusiveOwner,
        INPUT_ONLY_POINT => AssemblyRole::InputOnly,
        LISTEN_ONLY_POINT => AssemblyRole::ListenOnly,
        other => {
            return Err(wrong(ConnectionStatus::INVALID_CONSUMING_PATH, other, assemblies.output_point()));
        }
    };
    if produced != assemblies.input_point() {
        return Err(wrong(ConnectionStatus::INVALID_PRODUCING_PATH, produced, assemblies.input_point()));
    }
    Ok(role)
}

/// Checks transport, directions, sizes and intervals; `stream` is a connection of the multicast stream, where there is one.
pub(crate) fn check_parameters(
    open: &ForwardOpen<'_>,
    role: AssemblyRole,
    assemblies: &Assemblies,
    intervals: &MotionConfig,
    stream: Option<&OpenParameters>,
) -> Result<(), Refusal> {
    if open.transport.class != 1 {
        let found = u32::from(open.transport.class);
        return Err(Refusal::value(ConnectionStatus::CLASS_NOT_SUPPORTED, found, 1));
    }
    if open.transport.trigger != Trigger::CYCLIC {
        let (found, expected) = (u32::from(open.transport.trigger.0), u32::from(Trigger::CYCLIC.0));
        return Err(Refusal::value(ConnectionStatus::TRIGGER_NOT_SUPPORTED, found, expected));
    }
    let multicast = open.t_to_o.connection_type == ConnectionType::MULTICAST;
    check_type(&open.o_to_t, ConnectionStatus::INVALID_O_TO_T_TYPE, false)?;
    check_type(&open.t_to_o, ConnectionStatus::INVALID_T_TO_O_TYPE, multicast)?;
    let (size, wrong) = (open.o_to_t.size, ConnectionStatus::INVALID_O_TO_T_SIZE);
    match role {
        AssemblyRole::ExclusiveOwner if size != assemblies.o_to_t_size() => {
            return Err(Refusal::size(wrong, size, assemblies.o_to_t_size()));
        }
        AssemblyRole::InputOnly | AssemblyRole::ListenOnly
            if !HEARTBEAT_SIZES.contains(&usize::from(size)) =>
        {
            return Err(Refusal::size(wrong, size, 2));
        }
        _ => {}
    }
    if open.t_to_o.size != assemblies.t_to_o_size() {
        let wrong = ConnectionStatus::INVALID_T_TO_O_SIZE;
        return Err(Refusal::size(wrong, open.t_to_o.size, assemblies.t_to_o_size()));
    }
    if open.multiplier().is_none() {
        let found = u32::from(open.timeout_multiplier);
        return Err(Refusal::value(ConnectionStatus::MULTIPLIER_NOT_ACCEPTABLE, found, 7));
    }
    let (o_to_t, t_to_o) =
        (intervals.acceptable_rpi_us(open.o_to_t_rpi_us), intervals.acceptable_rpi_us(open.t_to_o_rpi_us));
    // What comes less often than the device would like is a heartbeat; only an owner has to be in time.
    let o_to_t_fits =
        o_to_t == open.o_to_t_rpi_us || role != AssemblyRole::ExclusiveOwner && open.o_to_t_rpi_us > o_to_t;
    if !o_to_t_fits || t_to_o != open.t_to_o_rpi_us {
        let found = if o_to_t_fits { open.t_to_o_rpi_us } else { open.o_to_t_rpi_us };
        return Err(Refusal::intervals(found, o_to_t, t_to_o));
    }
    match stream.filter(|_| multicast) {
        Some(stream) => check_stream(open, stream),
        None => Ok(()),
    }
}

/// Checks that a connection can consume the stream of another one.
fn check_stream(open: &ForwardOpen<'_>, stream: &OpenParameters) -> Result<(), Refusal> {
    let Some(assembly) = stream.assembly else { return Ok(()) };
    if open.t_to_o_rpi_us != assembly.t_to_o_rpi_us {
        let (found, expected) = (open.t_to_o_rpi_us, assembly.t_to_o_rpi_us);
        return Err(Refusal::stream_interval(found, open.o_to_t_rpi_us, expected));
    }
    if open.t_to_o.variable != stream.t_to_o_variable {
        let status = ConnectionStatus::MISMATCHED_T_TO_O_FIXED_VARIABLE;
        return Err(Refusal::value(status, open.t_to_o.variable.into(), stream.t_to_o_variable.into()));
    }
    if open.t_to_o.priority != assembly.t_to_o_priority {
        let status = ConnectionStatus::MISMATCHED_T_TO_O_PRIORITY;
        let (found, expected) = (open.t_to_o.priority.0, assembly.t_to_o_priority.0);
        return Err(Refusal::value(status, found.into(), expected.into()));
    }
    Ok(())
}

fn check_type(
    parameters: &NetworkParameters,
    status: ConnectionStatus,
    multicast: bool,
) -> Result<(), Refusal> {
    if !multicast && parameters.connection_type != ConnectionType::POINT_TO_POINT {
        let (found, expected) =
            (u32::from(parameters.connection_type.0), u32::from(ConnectionType::POINT_TO_POINT.0));
        return Err(Refusal::value(status, found, expected));
    }
    if parameters.redundant_owner {
        return Err(Refusal::value(ConnectionStatus::INVALID_REDUNDANT_OWNER, 1, 0));
    }
    Ok(())
}
