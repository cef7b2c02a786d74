//! The contract of a north side: what controls axes in the generic model.
//!
//! There are three: a CIP Motion device ([`super::device`]), a device with assemblies ([`super::assembly`]) and local control
//! ([`super::local`]). An axis belongs to one of
//! them at a time, see [`super::axis::Owner`]. The counterpart for drives is [`super::bus::South`].

use profile_generic::time::{MonotonicTime, SystemTime};
use profile_generic::time_base::TimeBase;

use super::axis::AxisChannel;
use super::notice::Notice;
use crate::mapping::Mapping;

/// The arguments of [`North::exchange`], between the feedback of the drives and their next telegrams.
pub struct Exchange<'a> {
    /// Now, on the local clock.
    pub now: MonotonicTime,
    /// System time over the local clock.
    pub time: &'a TimeBase,
    /// The mapping tables.
    pub mapping: &'a Mapping,
    /// Whether the gateway is stopping. A north side must not take an axis then.
    pub ending: bool,
    /// All axes of the gateway; a north side touches only those that it owns or may take.
    pub axes: &'a mut [AxisChannel],
    /// Where notices for people go.
    pub notice: &'a mut dyn FnMut(Notice),
}

impl Exchange<'_> {
    /// Now, as system time.
    #[must_use]
    pub fn system(&self) -> SystemTime {
        self.time.system_at(self.now)
    }
}

/// The contract of a north side. The counterpart for drives is [`super::bus::South`].
pub trait North {
    /// Reports to its controllers or clients what the axes have done, and gives the axes its wishes and set-points. Called once
    /// in each cycle; it neither allocates nor waits.
    fn exchange(&mut self, exchange: &mut Exchange<'_>);
}
