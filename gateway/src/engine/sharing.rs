//! The axes of one device of a bus: what is written to the device concerns all of them.

use profile_generic::time::{MonotonicTime, SystemTime};

use super::access::{Access, Operation};
use super::axis::AxisChannel;
use super::bus::{Answer, Buses};
use crate::parameter::known::rescales;

/// The axes of the device of an axis with their numbers, that one included.
pub(super) fn sharing<'a>(
    axis: usize,
    axes: &'a [AxisChannel],
    buses: &'a Buses,
) -> impl Iterator<Item = (usize, &'a AxisChannel)> {
    axes.iter().enumerate().filter(move |(other, _)| buses.share_device(axis, *other))
}

/// A parameter was written that decides what the values of the device mean, or was not written after all: see
/// [`AxisChannel::rescale`].
pub(super) fn rescale(
    (now, system): (MonotonicTime, SystemTime),
    axis: usize,
    (axes, buses): (&mut [AxisChannel], &Buses),
    is_written: bool,
) {
    let with_number = axes.iter_mut().enumerate();
    for (_, axis) in with_number.filter(|(other, _)| buses.share_device(axis, *other)) {
        axis.rescale(now, system, is_written);
    }
}

/// Whether an access writes a parameter that decides what the values of its device mean.
pub(super) fn is_rescaling(access: &Access) -> bool {
    matches!(access.operation, Operation::Write(_)) && rescales(access.item.into())
}

/// A write to such a parameter: the axes of the device are not enabled from then on, unless the drive has refused it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Rescaling {
    /// There is none.
    #[default]
    None,
    /// The drive was asked to take so many bytes.
    Asked(usize),
    /// The axes know of it, and the drive has not answered.
    Waits(usize),
    /// The drive has not taken it.
    Refused,
}

impl Rescaling {
    /// Whether such a write is under way.
    pub fn is_busy(self) -> bool {
        self != Self::None
    }

    /// The drive was asked for this access.
    pub fn asked(&mut self, access: &Access) {
        if let Operation::Write(data) = &access.operation
            && is_rescaling(access)
        {
            *self = Self::Asked(data.len());
        }
    }

    /// Takes the drive's answer to an access.
    pub fn answered(&mut self, answer: &Answer) {
        let Self::Waits(len) = *self else { return };
        if answer.write && rescales(answer.item.into()) {
            // A lost answer is no sign that the drive has not taken it.
            let is_refused = answer.said.is_some_and(|said| !said.may_have_written(len));
            *self = if answer.result.is_err() && is_refused { Self::Refused } else { Self::None };
        }
    }

    /// Lets the axes of the device of an axis know.
    pub fn apply(
        &mut self,
        now: (MonotonicTime, SystemTime),
        axis: usize,
        device: (&mut [AxisChannel], &Buses),
    ) {
        match *self {
            Self::Asked(len) => {
                rescale(now, axis, device, true);
                *self = Self::Waits(len);
            }
            Self::Refused => {
                rescale(now, axis, device, false);
                *self = Self::None;
            }
            Self::None | Self::Waits(_) => {}
        }
    }
}
