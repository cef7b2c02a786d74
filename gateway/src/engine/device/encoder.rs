//! What the values of an encoder count in, as the controller has described the encoder.
//!
//! The attributes of a channel may be set at any time: they count as they are when a value is read.

use profile_cip::device::motion_device::MotionDevice;
use profile_generic::ratio::Ratio;
use profile_generic::scaling::UnitKind;

use super::scaling::number_of;
use crate::engine::axis::AxisChannel;
use crate::mapping::{CipTables, FeedbackChannel, FeedbackUnit};

/// Nanounits in one of what a value counts in; `None` while the controller has not said it, or has named a unit that the encoder
/// does not measure (Table 5-2.33).
pub(super) fn nanounits(
    tables: &CipTables,
    unit: FeedbackUnit,
    (device, place): (&MotionDevice, usize),
    axis: &AxisChannel,
) -> Option<Ratio> {
    let FeedbackUnit { channel, is_counts } = unit;
    let value = |id: u16| number_of(device.attribute(place, id + channel.offset()), false);
    let kind = match channel {
        FeedbackChannel::One => UnitKind::Rotary,
        FeedbackChannel::Two => axis.south()?.mechanics?.kind,
    };
    let code = value(tables.scaling.feedback_unit);
    let unit = tables.feedback_units.iter().find(|unit| i64::from(unit.code) == code && unit.kind == kind)?;
    let mut counts = Ratio::ONE;
    if is_counts {
        for id in &tables.scaling.feedback_resolution {
            counts = counts.then(Ratio::new(value(*id), 1)?)?;
        }
    }
    Ratio::new(unit.nanounits, 1)?.then(counts.inverse()?)
}
