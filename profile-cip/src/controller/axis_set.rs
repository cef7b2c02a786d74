//! Sets of axes, by instance number.

use core::fmt;

use super::config::MAX_AXES;

const _: () = assert!(MAX_AXES == 16, "an axis set has one bit for each axis");

/// A set of axes, by instance number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AxisSet(u16);

impl AxisSet {
    /// No axis.
    pub const NONE: Self = Self(0);

    /// One axis; instances beyond the largest number of axes make an empty set.
    #[must_use]
    pub const fn one(instance: u8) -> Self {
        if instance == 0 || instance > 16 { Self::NONE } else { Self(1 << (instance - 1)) }
    }

    /// The axes 1 to `count`.
    #[must_use]
    pub fn first(count: u8) -> Self {
        (1..=count).fold(Self::NONE, |set, axis| set.with(axis))
    }

    /// This set and one axis more.
    #[must_use]
    pub const fn with(self, instance: u8) -> Self {
        Self(self.0 | Self::one(instance).0)
    }

    /// This set without that axis.
    #[must_use]
    pub const fn without(self, instance: u8) -> Self {
        Self(self.0 & !Self::one(instance).0)
    }

    /// Whether the axis is in the set.
    #[must_use]
    pub const fn contains(self, instance: u8) -> bool {
        self.0 & Self::one(instance).0 != 0
    }

    /// Whether no axis is in the set.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The instance numbers in ascending order.
    pub fn iter(self) -> impl Iterator<Item = u8> {
        (1..=16).filter(move |instance| self.contains(*instance))
    }
}

impl fmt::Display for AxisSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.iter().count() == 1 { "axis" } else { "axes" })?;
        self.iter().try_for_each(|axis| write!(f, " {axis}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_hold_axes_by_instance_number() {
        let set = AxisSet::one(3).with(1).with(16);
        assert_eq!(set.iter().collect::<Vec<_>>(), [1, 3, 16]);
        assert_eq!(set.without(3).to_string(), "axes 1 16");
        assert_eq!(AxisSet::first(2), AxisSet::one(1).with(2));
        assert_eq!((AxisSet::one(0), AxisSet::one(17)), (AxisSet::NONE, AxisSet::NONE));
        assert!(!set.contains(0) && !set.contains(2) && set.contains(16));
        assert_eq!(AxisSet::first(255).iter().count(), MAX_AXES);
    }
}
