//! Exceptions: conditions that the drive side reports, and what the controller wants done about each of them
//! (clause 5-2.6.3, attributes 655 to 660, 672 and 673).
//!
//! A condition is a level: it is in the list of the axis as long as it is there. Axis Exception Action says what follows
//! from it, but never less than [`DriveCondition::least`]: a drive that has already switched itself off cannot be kept
//! running by an attribute.

use crate::device::attribute::{AttributeStore, AttributeTable, id};
pub use crate::generated::motion_codes::ExceptionAction;
use crate::wire::motion::codes::FaultType;

/// Most conditions of an axis at the same time: the two diagnostic words of a drive and a few of the box.
pub const CONDITIONS_MAX: usize = 32;

/// Exceptions of the standard, or of the manufacturer: the bits of an LWORD.
pub const EXCEPTIONS: usize = 64;

/// One condition that is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DriveCondition {
    /// The table that `code` is a bit number of.
    pub fault_type: FaultType,
    /// Bit number, 1 to 63.
    pub code: u8,
    /// Sub code for the controller.
    pub sub_code: u8,
    /// The drive's own code, for the log.
    pub detail: u32,
    /// Best stopping action that is left, as Axis Fault Action (attribute 668): stop in the low nibble, state change in
    /// the high one. Without a state change it is a ramped stop with disable.
    pub action: u8,
    /// The least that follows from it, whatever the attribute says.
    pub least: ExceptionAction,
    /// System time at which it came, ns.
    pub at: u64,
}

impl DriveCondition {
    /// Whether nothing less than a major fault follows from it.
    #[must_use]
    pub fn stops(&self) -> bool {
        self.least >= ExceptionAction::MAJOR_FAULT
    }
}

/// The conditions of an axis.
#[derive(Debug, Clone, Copy)]
pub struct DriveConditions {
    list: [DriveCondition; CONDITIONS_MAX],
    len: usize,
}

/// What lies behind the last condition does not count.
impl PartialEq for DriveConditions {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl Eq for DriveConditions {}

impl Default for DriveConditions {
    fn default() -> Self {
        let none = DriveCondition {
            fault_type: FaultType::CLEARED,
            code: 0,
            sub_code: 0,
            detail: 0,
            action: 0,
            least: ExceptionAction::IGNORE,
            at: 0,
        };
        Self { list: [none; CONDITIONS_MAX], len: 0 }
    }
}

impl DriveConditions {
    /// These conditions; those beyond [`CONDITIONS_MAX`] are left out.
    #[must_use]
    pub fn of(conditions: &[DriveCondition]) -> Self {
        let mut all = Self::default();
        for condition in conditions {
            all.push(*condition);
        }
        all
    }

    /// Takes all of them out.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds one. In a full list a condition that stops the axis takes the place of one that need not; `false` when there
    /// is no place.
    pub fn push(&mut self, condition: DriveCondition) -> bool {
        if let Some(place) = self.list.get_mut(self.len) {
            *place = condition;
            self.len += 1;
            return true;
        }
        let weaker = self.list.iter_mut().find(|known| known.least < condition.least);
        weaker.map(|place| *place = condition).is_some()
    }

    /// The conditions in the order in which they were added.
    #[must_use]
    pub fn as_slice(&self) -> &[DriveCondition] {
        self.list.get(..self.len).unwrap_or(&[])
    }
}

/// What the controller has set for each exception of an axis.
#[derive(Debug, Clone, Copy)]
pub struct ExceptionActions<'a> {
    standard: &'a [u8],
    manufacturer: &'a [u8],
}

impl<'a> ExceptionActions<'a> {
    /// Nothing is set: every exception stops the axis.
    pub const NONE: ExceptionActions<'static> = ExceptionActions::new(&[], &[]);

    /// The arrays 672 and 673 of an axis.
    #[must_use]
    pub fn of(table: &AttributeTable, store: &'a AttributeStore) -> Self {
        let array = |id| {
            let entry = table.find(id);
            entry.and_then(|entry| store.get(entry, entry.whole()).ok()).unwrap_or(&[])
        };
        Self {
            standard: array(id::AXIS_EXCEPTION_ACTION),
            manufacturer: array(id::AXIS_EXCEPTION_ACTION_MFG),
        }
    }

    /// These actions of the standard's and the manufacturer's exceptions.
    #[must_use]
    pub const fn new(standard: &'a [u8], manufacturer: &'a [u8]) -> Self {
        Self { standard, manufacturer }
    }

    /// What follows from a condition; no less than it demands itself, unless it is one that is never major.
    #[must_use]
    pub fn action(&self, condition: &DriveCondition) -> ExceptionAction {
        let set = self.configured(condition.fault_type, condition.code);
        match condition.fault_type {
            FaultType::APR | FaultType::APR_MFG => set,
            _ => set.max(condition.least),
        }
    }

    /// What the controller wants done about a code. An exception that nobody expected stops the axis; so does every fault
    /// that is no exception, but for those of the absolute position recovery, which clause 5-2.6.2.12 does not count as major.
    #[must_use]
    pub fn configured(&self, fault_type: FaultType, code: u8) -> ExceptionAction {
        let array = match fault_type {
            FaultType::AXIS => self.standard,
            FaultType::AXIS_MFG => self.manufacturer,
            FaultType::APR | FaultType::APR_MFG => return ExceptionAction::MINOR_FAULT,
            _ => return ExceptionAction::MAJOR_FAULT,
        };
        let set = array.get(usize::from(code)).copied().map(ExceptionAction);
        set.filter(|action| *action <= ExceptionAction::MAJOR_FAULT).unwrap_or(ExceptionAction::MAJOR_FAULT)
    }
}

/// The more severe of two Axis Fault Actions in each nibble: the one that needs less control (Table 5-2.70).
#[must_use]
pub const fn worst_action(one: u8, other: u8) -> u8 {
    let stop = if one & 0x0F > other & 0x0F { one & 0x0F } else { other & 0x0F };
    let change = if one >> 4 > other >> 4 { one >> 4 } else { other >> 4 };
    change << 4 | stop
}

#[cfg(test)]
mod tests {
    use super::*;

    fn condition(code: u8, least: ExceptionAction) -> DriveCondition {
        DriveCondition { fault_type: FaultType::AXIS, code, least, ..DriveCondition::default() }
    }

    #[test]
    fn the_attribute_decides_but_never_below_the_least() {
        let mut standard = [3; EXCEPTIONS];
        standard[54] = 0;
        standard[55] = 255;
        let actions = ExceptionActions::new(&standard, &[]);
        assert_eq!(actions.action(&condition(54, ExceptionAction::IGNORE)), ExceptionAction::IGNORE);
        assert_eq!(
            actions.action(&condition(54, ExceptionAction::MAJOR_FAULT)),
            ExceptionAction::MAJOR_FAULT
        );
        assert_eq!(actions.action(&condition(55, ExceptionAction::IGNORE)), ExceptionAction::MAJOR_FAULT);
        let manufacturer =
            DriveCondition { fault_type: FaultType::AXIS_MFG, ..condition(54, ExceptionAction::IGNORE) };
        assert_eq!(actions.action(&manufacturer), ExceptionAction::MAJOR_FAULT, "no array, no mercy");
    }

    #[test]
    fn a_list_that_was_cleared_is_like_one_that_never_had_any() {
        let mut list = DriveConditions::of(&[condition(8, ExceptionAction::IGNORE); 3]);
        assert_ne!(list, DriveConditions::default());
        list.clear();
        assert_eq!(list, DriveConditions::default());
        assert!(list.push(condition(6, ExceptionAction::ALARM)));
        assert_eq!(list, DriveConditions::of(&[condition(6, ExceptionAction::ALARM)]));
        assert_eq!(list.as_slice(), [condition(6, ExceptionAction::ALARM)]);
    }

    #[test]
    fn a_full_list_keeps_what_stops_the_axis() {
        let mut list = DriveConditions::default();
        for _ in 0..CONDITIONS_MAX {
            assert!(list.push(condition(8, ExceptionAction::IGNORE)));
        }
        assert!(!list.push(condition(6, ExceptionAction::IGNORE)));
        assert!(list.push(condition(10, ExceptionAction::MAJOR_FAULT)));
        assert_eq!(list.as_slice().len(), CONDITIONS_MAX);
        assert_eq!(list.as_slice()[0].code, 10);
    }

    #[test]
    fn the_worst_of_two_actions_is_taken_by_nibble() {
        assert_eq!(worst_action(0x13, 0x22), 0x23);
        assert_eq!(worst_action(0x24, 0x32), 0x34);
        assert_eq!(worst_action(0, 0x13), 0x13);
    }
}
