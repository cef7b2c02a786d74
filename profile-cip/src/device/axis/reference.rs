//! The reference systems in which the controller sees the positions of an axis, and their change: clauses 5-2.3.2 (attributes
//! 83 and 84), 5-2.6.1.2 and Table 5-2.109.
//!
//! ```text
//! drive       unrolled counts since power-up, 64 bits
//!   + actual reference   = what the controller calls the actual position
//!                          cyclic axis: position in 0..unwind, and the cycles as Unwind Cycle Count
//!                          other axis:  low 32 bits as DINT, all 64 as LINT
//! controller  Command Position [+ unwind * Unwind Cycle Count]
//!   - command reference  = unrolled counts since power-up
//! ```
//!
//! Everything is derived anew from the one unrolled count, so nothing adds up over any number of cycles.

use super::refused::RefusalReason;
use crate::wire::motion::ActualPosition;
use crate::wire::motion::codes::{AxisControl, ControlMode};

/// Reference systems of an axis, position control units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct References {
    /// To be added to a position of the drive.
    actual: i64,
    /// To be subtracted from a commanded position.
    command: i64,
    /// Displacement of the last Change Actual Position Reference.
    displacement: i32,
}

/// A position as the controller sees it, position control units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SeenPosition {
    /// The position; between 0 and the unwind of a cyclic axis.
    pub position: i64,
    /// Cycles of a cyclic axis, counted down below zero; `None` where nothing is unwound.
    pub cycles: Option<i64>,
}

impl SeenPosition {
    /// The position in the type that was agreed on.
    pub fn value(self, lint: bool) -> ActualPosition {
        if lint { ActualPosition::Lint(self.position) } else { ActualPosition::Dint(self.dint()) }
    }

    /// The position as a DINT.
    pub fn dint(self) -> i32 {
        low_32(self.position)
    }

    /// Unwind Cycle Count.
    pub fn unwind_count(self) -> Option<i32> {
        self.cycles.map(low_32)
    }
}

impl References {
    /// Back to the reference system of power-up.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// A position of the drive in the controller's reference system, not unwound.
    pub const fn actual(&self, position: i64) -> i64 {
        position.wrapping_add(self.actual)
    }

    /// To be subtracted from a commanded position.
    pub const fn command(&self) -> i64 {
        self.command
    }

    /// Whether the last change of reference was made for both positions. Half of it is no ground to move on: a position
    /// that is commanded where the axis is said to be would lead it away by the displacement.
    const fn agree(&self) -> bool {
        self.actual == self.command
    }

    /// Whether a position may be commanded: the references agree, or another value leads.
    pub fn allow(&self, mode: ControlMode) -> bool {
        mode != ControlMode::POSITION || self.agree()
    }

    /// Displacement of the last Change Actual Position Reference.
    pub const fn displacement(&self) -> i32 {
        self.displacement
    }

    /// Carries out a change of reference. It is complete at once: there is nothing to cancel.
    pub fn change(&mut self, request: AxisControl, displacement: i32) -> Result<(), RefusalReason> {
        let of_actual = request == AxisControl::CHANGE_ACTUAL_POSITION;
        let reference = if of_actual { &mut self.actual } else { &mut self.command };
        *reference = reference.checked_add(i64::from(displacement)).ok_or(RefusalReason::ValueTooFar)?;
        if of_actual {
            self.displacement = displacement;
        }
        Ok(())
    }

    /// A position of the drive as the controller sees it.
    pub fn see(&self, position: i64, unwind: Option<u32>) -> SeenPosition {
        unwound(self.actual(position), unwind)
    }
}

/// How the controller sees the positions of an axis: for attributes, which have to agree with the cyclic data. Measured and
/// commanded positions have a reference each while it is being changed (clause 5-2.6.1.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PositionView {
    references: References,
    unwind: Option<u32>,
}

impl PositionView {
    /// A measured position, from one in the reference system of power-up; position control units.
    #[must_use]
    pub fn measured(&self, position: i64) -> i64 {
        self.references.see(position, self.unwind).position
    }

    /// A commanded position, from one in the reference system of power-up; position control units.
    #[must_use]
    pub fn commanded(&self, position: i64) -> i64 {
        unwound(position.wrapping_add(self.references.command), self.unwind).position
    }
}

impl PositionView {
    pub(super) const fn new(references: References, unwind: Option<u32>) -> Self {
        Self { references, unwind }
    }
}

/// A position in its cycle.
fn unwound(position: i64, unwind: Option<u32>) -> SeenPosition {
    match unwind.map(i64::from).filter(|unwind| *unwind > 0) {
        Some(unwind) => {
            SeenPosition { position: position.rem_euclid(unwind), cycles: Some(position.div_euclid(unwind)) }
        }
        None => SeenPosition { position, cycles: None },
    }
}

/// The low 32 bits: a DINT rolls over.
fn low_32(value: i64) -> i32 {
    let [a, b, c, d, ..] = value.to_le_bytes();
    i32::from_le_bytes([a, b, c, d])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_cyclic_position_is_never_outside_its_cycle() {
        let rows = [
            (0, 360, 0, 0),
            (359, 360, 359, 0),
            (360, 360, 0, 1),
            (-1, 360, 359, -1),
            (-360, 360, 0, -1),
            (-361, 360, 359, -2),
            (720_000_000_005, 360, 5, 2_000_000_000),
            (i64::MIN, 2, 0, i64::MIN / 2),
        ];
        for (position, unwind, folded, cycles) in rows {
            let seen = References::default().see(position, Some(unwind));
            assert_eq!((seen.position, seen.cycles), (folded, Some(cycles)), "{position}");
        }
        let seen = References::default().see(-5, None);
        assert_eq!((seen.position, seen.cycles, seen.unwind_count()), (-5, None, None));
    }

    proptest! {
        #[test]
        fn position_and_count_make_up_the_whole(position in -(1_i64 << 60)..1 << 60, actual in -(1_i64 << 40)..1 << 40,
            unwind in 2..i32::MAX.cast_unsigned()) {
            let seen = References { actual, ..References::default() }.see(position, Some(unwind));
            let whole = seen.cycles.map(|cycles| cycles * i64::from(unwind) + seen.position);
            prop_assert_eq!(whole, Some(position + actual));
            prop_assert!((0..i64::from(unwind)).contains(&seen.position));
        }
    }
}
