//! The fixed connection format in the motion device, clause 6-2.7.3: one axis, asynchronous, 16 octets each way.
//!
//! Order and loss of the updates, Node Control and Node Status, the states of the axis and the handshake of Axis Control
//! are those of the variable format; an update becomes a header and a cyclic block of it. What the 16 octets have no
//! room for:
//!
//! | left out | instead |
//! |---|---|
//! | time stamps | asynchronous operation only |
//! | Control Status, with Configuration Complete | attribute 89, set by a service |
//! | Command Control | attribute 92, set by a service; the position is a DINT |
//! | node fault and alarm codes | class attributes, read by a service; Node Status has the fault bit |
//! | status data | attributes, read by a service |
//! | event, service, write and read channels | services as explicit messages |
//!
//! Attributes 89 and 92 are `Set*`: set by the connection where it carries them and by a service where it does not
//! (footnote of Table 5-2.16).

use profile_generic::time::MonotonicTime;

use super::receive::Verdict;
use super::slot::Slot;
use crate::device::attribute::{
    Access, AttributeDefinition, AttributeTable, DataType, DefaultValue, Scope, id,
};
use crate::device::axis::drive_link::Trims;
use crate::device::axis::{Axis, Context};
use crate::device::config::MOTION_SIZE_FIXED;
use crate::device::motion_link::{OpenParameters, OpenRefusal};
use crate::wire::Writer;
use crate::wire::motion::codes::{CommandTarget, ControlStatus, NodeStatus};
use crate::wire::motion::fixed::{self, FixedActual, FixedCommand};
use crate::wire::motion::{ActualBlock, Format};
use crate::wire::status::{ConnectionStatus, GeneralStatus};

/// Command Control with a DINT position: Immediate, Extrapolate, Interpolate (Table 6-2.24).
const COMMAND_CONTROL: (u8, u8) = (0b0100, 0b0110);
/// Command Target Update in Command Control.
const TARGET_MASK: u8 = 0b11;

/// The attributes with those of the engine that a service sets, because the connection does not.
pub(super) fn with_services_alone(mut attributes: Vec<AttributeDefinition>) -> Vec<AttributeDefinition> {
    let replaced = [id::CONTROL_STATUS, id::COMMAND_CONTROL];
    attributes.retain(|one| one.scope != Scope::Instance || !replaced.contains(&one.id));
    let settable = |id, name| AttributeDefinition {
        settable_in_running: true,
        ..AttributeDefinition::new(Scope::Instance, id, DataType::Byte, Access::Set, name)
    };
    let (min, max) = COMMAND_CONTROL;
    attributes.push(settable(id::CONTROL_STATUS, "Control Status"));
    attributes.push(AttributeDefinition {
        default: DefaultValue::Integer(i64::from(min)),
        range: Some((f64::from(min), f64::from(max))),
        ..settable(id::COMMAND_CONTROL, "Command Control")
    });
    attributes
}

/// Checks that an accepted connection can carry the format of the device.
pub(super) fn check_format(format: Format, open: &OpenParameters) -> Result<(), OpenRefusal> {
    let variable = format == Format::Variable;
    let size = |octets| !variable && octets != MOTION_SIZE_FIXED;
    let refusals = [
        (open.o_to_t_variable != variable, ConnectionStatus::INVALID_O_TO_T_FIXED_VARIABLE),
        (open.t_to_o_variable != variable, ConnectionStatus::INVALID_T_TO_O_FIXED_VARIABLE),
        (size(open.o_to_t_size), ConnectionStatus::INVALID_O_TO_T_SIZE),
        (size(open.t_to_o_size), ConnectionStatus::INVALID_T_TO_O_SIZE),
    ];
    match refusals.iter().find(|(wrong, _)| *wrong) {
        None => Ok(()),
        Some((_, status)) => Err(OpenRefusal {
            general_status: GeneralStatus::CONNECTION_FAILURE.0,
            extended_status: status.0,
        }),
    }
}

/// Hands a judged update to the axis.
pub(super) fn apply(
    axis: &mut Axis,
    now: MonotonicTime,
    context: &Context,
    command: &FixedCommand,
    verdict: &Verdict,
) {
    let held = axis.block();
    let block = command.block(held.control_status, held.target);
    match verdict {
        Verdict::Fresh(times) => axis.handle_block(&block, Trims::default(), *times, now, context),
        Verdict::CommandsRefused => axis.handle_status_request(&block),
    }
}

/// Takes over what a service has set of the cyclic block.
pub(super) fn adopt(slot: &mut Slot, table: &AttributeTable) {
    let octet = |id| {
        let value = slot.store.unsigned(table, id).unwrap_or(0);
        u8::try_from(value).unwrap_or(0)
    };
    let (status, control) = (octet(id::CONTROL_STATUS), octet(id::COMMAND_CONTROL));
    slot.axis.command.block.control_status = ControlStatus::from_bits_retain(status);
    slot.axis.command.block.target = CommandTarget(control & TARGET_MASK);
}

/// Writes a D-to-C update; `block` is the axis's, the default before the controller's data are valid: then only the head
/// of the update says something.
pub(super) fn write(
    update: &mut [u8; fixed::LEN],
    update_id: u8,
    node_status: NodeStatus,
    block: &ActualBlock,
) -> Option<usize> {
    let actual = FixedActual { update_id, node_status, ..FixedActual::from(block) };
    let mut writer = Writer::new(update);
    actual.emit(&mut writer).ok()?;
    Some(writer.written())
}
