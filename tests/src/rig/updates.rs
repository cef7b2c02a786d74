//! The controller's updates as datagrams: what each commands, read from its bytes.

use profile_cip::controller::Controller;
use profile_cip::wire::class1::{CLASS1_HEADER_LEN, Class1Datagram};
use profile_cip::wire::motion::codes::{CommandTarget, ControlMode, ControlStatus};
use profile_cip::wire::motion::fixed::FixedCommand;
use profile_cip::wire::motion::{CommandFrame, CommandPosition, CommandValues, Format};
use profile_generic::time::DurationNs;

/// Where the Controller Time Offset stands in a datagram: behind the first eight octets of the header and the time stamp.
const TIME_OFFSET_AT: usize = CLASS1_HEADER_LEN + 8 + 8;

/// Attributes of the trims of position (DINT, counts), velocity (REAL, units/s) and torque (REAL, %).
const TRIMS: [u16; 3] = [431, 451, 491];

/// What an update commands an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisCommanded {
    /// Instance number of the axis, from 1.
    pub instance: u8,
    /// The Control Mode of the values.
    pub mode: ControlMode,
    /// The values.
    pub values: CommandValues,
    /// The values are meant for so many periods after the time stamp.
    pub target: CommandTarget,
    /// What is added to position (counts), velocity (units/s) and torque (%).
    pub trims: (f64, f64, f64),
}

impl AxisCommanded {
    /// Whole position in counts, of which a DINT has only the last 32 bits.
    #[must_use]
    pub fn position(&self, unwind: Option<u32>) -> Option<f64> {
        let position = self.values.position?.as_f64() + self.trims.0;
        let cycles = self.values.unwind_count.map_or(0.0, f64::from);
        Some(position + cycles * unwind.map_or(0.0, f64::from))
    }

    /// Whether only the last 32 bits of the position travel.
    #[must_use]
    pub const fn rolls_over(&self) -> bool {
        matches!(self.values.position, Some(CommandPosition::Integer(_)))
    }
}

/// An update.
#[derive(Debug, Clone, PartialEq)]
pub struct Commanded {
    /// Update ID.
    pub id: u8,
    /// What it commands each axis; nothing before the axes are configured.
    pub axes: Vec<AxisCommanded>,
}

/// Reads an update; `None` for a datagram that is none. The trims are those that the controller sends in it.
#[must_use]
pub fn read(bytes: &[u8], format: Format, controller: Option<&Controller>) -> Option<Commanded> {
    let datagram = Class1Datagram::parse(bytes).ok()?;
    let float = |data: &[u8]| <[u8; 4]>::try_from(data).ok().map(f32::from_le_bytes).map(f64::from);
    let whole = |data: &[u8]| <[u8; 4]>::try_from(data).ok().map(i32::from_le_bytes).map(f64::from);
    let trims = |instance| {
        let sent = |id| controller?.cyclic_write(instance, id);
        let [position, velocity, torque] = TRIMS;
        (
            sent(position).and_then(whole).unwrap_or(0.0),
            sent(velocity).and_then(float).unwrap_or(0.0),
            sent(torque).and_then(float).unwrap_or(0.0),
        )
    };
    match format {
        Format::Variable => {
            let frame = CommandFrame::parse(datagram.data).ok()?;
            let axes = frame.instances().filter_map(|instance| {
                let block = instance.cyclic?;
                let trims = trims(instance.number);
                let (mode, values, target) = (block.control_mode, block.values, block.target);
                Some(AxisCommanded { instance: instance.number, mode, values, target, trims })
            });
            Some(Commanded { id: frame.header().update_id, axes: axes.collect() })
        }
        Format::Fixed => {
            let command = FixedCommand::parse(datagram.data).ok()?;
            let block = command.block(ControlStatus::empty(), CommandTarget::IMMEDIATE);
            let axis = AxisCommanded {
                instance: 1,
                mode: block.control_mode,
                values: block.values,
                target: block.target,
                trims: (0.0, 0.0, 0.0),
            };
            let axes = if block.values.is_empty() { Vec::new() } else { vec![axis] };
            Some(Commanded { id: command.update_id, axes })
        }
    }
}

/// Puts the Controller Time Offset of an update back by `hidden`, where it has one: the steps of a controller that does not
/// report them.
pub fn hide_steps(bytes: &mut [u8], hidden: DurationNs) {
    if hidden == DurationNs::ZERO {
        return;
    }
    let offset = Class1Datagram::parse(bytes)
        .ok()
        .and_then(|datagram| CommandFrame::parse(datagram.data).ok()?.header().time_offset);
    if let (Some(offset), Some(field)) = (offset, bytes.get_mut(TIME_OFFSET_AT..TIME_OFFSET_AT + 8)) {
        field.copy_from_slice(&offset.wrapping_sub(hidden.as_nanos()).to_le_bytes());
    }
}
