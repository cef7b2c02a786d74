//! Bit patterns: status words to reports, actions to control words.

use arrayvec::ArrayVec;

use crate::state::{Action, Report};

/// Some bits of a word with the values they have, or shall have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct BitPattern {
    /// Which bits count.
    pub mask: u32,
    /// What they are; bits outside the mask do not count.
    pub value: u32,
}

impl BitPattern {
    /// The bits of `mask` with the values in `value`.
    pub const fn new(mask: u32, value: u32) -> Self {
        Self { mask, value: value & mask }
    }

    /// Whether the word has these bits.
    #[inline]
    pub const fn matches(self, word: u32) -> bool {
        (word ^ self.value) & self.mask == 0
    }

    /// The word with these bits put in and all others as they were.
    #[inline]
    pub const fn apply(self, word: u32) -> u32 {
        (word & !self.mask) | (self.value & self.mask)
    }
}

/// The most rows a [`StateTable`] holds unless it is declared otherwise.
pub const MAX_STATE_ROWS: usize = 16;

/// Turns a status word into a [`Report`]: the first row that matches wins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StateTable<const N: usize = MAX_STATE_ROWS> {
    rows: ArrayVec<(BitPattern, Report), N>,
}

impl<const N: usize> StateTable<N> {
    /// A table without rows: it knows no status word.
    pub const fn new() -> Self {
        Self { rows: ArrayVec::new_const() }
    }

    /// Adds a row after the others. Returns `false` when the table is full.
    pub fn push(&mut self, pattern: BitPattern, report: Report) -> bool {
        self.rows.try_push((pattern, report)).is_ok()
    }

    /// The rows in order.
    pub fn rows(&self) -> impl Iterator<Item = (BitPattern, Report)> + '_ {
        self.rows.iter().copied()
    }

    /// What the status word says, or `None` when no row matches.
    pub fn decode(&self, word: u32) -> Option<Report> {
        self.rows().find(|(pattern, _)| pattern.matches(word)).map(|(_, report)| report)
    }

    /// A status word that says `report`: the first row for it put into `word`. `None` when no row says it.
    pub fn encode(&self, report: Report, word: u32) -> Option<u32> {
        self.rows().find(|(_, known)| *known == report).map(|(pattern, _)| pattern.apply(word))
    }
}

impl<const N: usize> Default for StateTable<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Turns an [`Action`] into a control word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActionTable {
    rows: [Option<BitPattern>; Action::ALL.len()],
}

impl ActionTable {
    /// A table without rows: no action writes anything.
    pub const fn new() -> Self {
        Self { rows: [None; Action::ALL.len()] }
    }

    /// Sets the bits that an action writes, instead of any set before.
    pub fn set(&mut self, action: Action, pattern: BitPattern) {
        self.rows[action.index()] = Some(pattern);
    }

    /// The bits that an action writes, if the table says.
    pub const fn get(&self, action: Action) -> Option<BitPattern> {
        self.rows[action.index()]
    }

    /// The control word after the action, or `None` when the table does not know the action.
    pub fn apply(&self, action: Action, word: u32) -> Option<u32> {
        self.get(action).map(|pattern| pattern.apply(word))
    }

    /// The first action, in the order of [`Action::ALL`], whose bits stand in the control word.
    pub fn decode(&self, word: u32) -> Option<Action> {
        let matches = |action: &Action| self.get(*action).is_some_and(|pattern| pattern.matches(word));
        Action::ALL.iter().copied().find(matches)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_outside_the_mask_do_not_count() {
        let pattern = BitPattern::new(0b0110, 0b1011);
        assert_eq!(pattern.value, 0b0010);
        assert!(pattern.matches(0b1010) && pattern.matches(0b0011) && !pattern.matches(0b0110));
        assert_eq!(pattern.apply(0b1111), 0b1011);
        assert!(pattern.matches(pattern.apply(0)));
        let loose = BitPattern { mask: 0b01, value: 0b11 };
        assert!(loose.matches(0b01));
        assert_eq!(loose.apply(0), 0b01);
    }

    #[test]
    fn the_first_row_that_matches_wins() {
        let mut table = StateTable::<3>::new();
        assert!(table.push(BitPattern::new(0x8000, 0x8000), Report::Faulted));
        assert!(table.push(BitPattern::new(0xC000, 0x4000), Report::Operating));
        assert!(table.push(BitPattern::new(0, 0), Report::NotReady));
        assert!(!table.push(BitPattern::new(0, 0), Report::Ready), "full");
        let rows = [(0xC000, Report::Faulted), (0x4001, Report::Operating), (0x0001, Report::NotReady)];
        for (word, report) in rows {
            assert_eq!(table.decode(word), Some(report), "{word:#x}");
        }
        assert_eq!(StateTable::<4>::new().decode(0), None);
        assert_eq!(table.encode(Report::Operating, 0x8001), Some(0x4001));
        assert_eq!(table.encode(Report::Silent, 0), None);
    }

    #[test]
    fn actions_write_their_bits_only() {
        let mut table = ActionTable::new();
        table.set(Action::Enable, BitPattern::new(0xE000, 0xE000));
        table.set(Action::Halt, BitPattern::new(0xE000, 0xC000));
        assert_eq!(table.apply(Action::Enable, 0x0007), Some(0xE007));
        assert_eq!(table.apply(Action::Halt, 0xE007), Some(0xC007));
        assert_eq!(table.apply(Action::TorqueOff, 0xE007), None);
        assert_eq!(table.decode(0xC001), Some(Action::Halt));
        assert_eq!(table.decode(0), None);
    }
}
