//! What an axis waits for, as words of the published status.

use std::fmt;

use profile_generic::program::BitPattern;
use profile_generic::time::DurationNs;
use profile_sercos::wire::idn::Idn;

use crate::engine::axis::{Awaited, Waiting};
use crate::mapping::{Attribute, Item, MODE_SHIFT, Object};

/// Words of a wait in the published form.
pub(super) const WAIT_WORDS: usize = 3;

/// An axis that has waited for longer than a second, as the log reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AxisWait {
    /// What for, and what its drive shows.
    pub waiting: Waiting,
    /// Since when, in whole seconds.
    pub seconds: u32,
}

/// The line of the log: `has waited 12 s for its drive to follow set-points; 6041:00 = 0237, expected bit 12 = 1`.
impl fmt::Display for AxisWait {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "has waited {} s for {}", self.seconds, self.waiting)
    }
}

impl AxisWait {
    /// A wait of this length.
    #[must_use]
    pub fn new(waiting: Waiting, time: DurationNs) -> Self {
        let seconds = time.as_nanos() / 1_000_000_000;
        Self { waiting, seconds: u32::try_from(seconds.max(0)).unwrap_or(u32::MAX) }
    }

    /// The status word of the drive, 0 when it does not matter.
    #[must_use]
    pub fn word(&self) -> u16 {
        self.waiting.shown.map_or(0, |(_, word, _)| low(word))
    }

    /// The bits of [`Self::word`] that keep the axis waiting.
    #[must_use]
    pub fn mask(&self) -> u16 {
        self.waiting.shown.map_or(0, |(.., missing)| low(missing.mask))
    }

    /// What the bits of [`Self::mask`] have to be.
    #[must_use]
    pub fn value(&self) -> u16 {
        self.waiting.shown.map_or(0, |(.., missing)| low(missing.value))
    }

    /// Whether the drive has to show another operating mode.
    #[must_use]
    pub fn needs_mode(&self) -> bool {
        self.waiting.shown.is_some_and(|(.., missing)| missing.mask >> MODE_SHIFT != 0)
    }

    /// The number of [`Self::word`]: an IDN, `index << 8 | sub-index`, or `class << 16 | attribute`; 0 for none.
    #[must_use]
    pub fn item(&self) -> u32 {
        self.waiting.shown.map_or(0, |(item, ..)| item_code(item).1)
    }

    pub(super) fn to_words(wait: Option<Self>) -> [u64; WAIT_WORDS] {
        let Some(Self { waiting: Waiting { awaited, shown }, seconds }) = wait else {
            return [0; WAIT_WORDS];
        };
        let (kind, item, word, missing) = match shown {
            None => (0, 0, 0, BitPattern::new(0, 0)),
            Some((item, word, missing)) => {
                let (kind, item) = item_code(item);
                (kind, item, word, missing)
            }
        };
        let [a, b, c, d] = seconds.to_be_bytes();
        [
            u64::from_be_bytes([awaited.code(), kind, 0, 0, a, b, c, d]),
            super::pair(item, word),
            super::pair(missing.mask, missing.value),
        ]
    }

    pub(super) fn from_words(words: &[u64; WAIT_WORDS]) -> Option<Self> {
        let [awaited, kind, _, _, a, b, c, d] = words[0].to_be_bytes();
        let awaited = Awaited::of_code(awaited)?;
        let (item, word) = super::split(words[1]);
        let (mask, value) = super::split(words[2]);
        let shown = item_of(kind, item).map(|item| (item, word, BitPattern::new(mask, value)));
        Some(Self { waiting: Waiting { awaited, shown }, seconds: u32::from_be_bytes([a, b, c, d]) })
    }
}

/// The word without the operating mode above it.
const fn low(word: u32) -> u16 {
    let [.., high, low] = word.to_be_bytes();
    u16::from_be_bytes([high, low])
}

/// The profile of an item, from 1, and its number there.
fn item_code(item: Item) -> (u8, u32) {
    match item {
        Item::Idn(idn) => (1, idn.0),
        Item::Object(Object { index, sub }) => (2, u32::from(index) << 8 | u32::from(sub)),
        Item::Attribute(Attribute { class, id }) => (3, u32::from(class) << 16 | u32::from(id)),
    }
}

fn item_of(kind: u8, number: u32) -> Option<Item> {
    let [first, second, third, fourth] = number.to_be_bytes();
    match kind {
        1 => Some(Item::Idn(Idn(number))),
        2 => Some(Item::object(u16::from_be_bytes([second, third]), fourth)),
        3 => Some(Item::attribute(u16::from_be_bytes([first, second]), u16::from_be_bytes([third, fourth]))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_wait_crosses_the_words_of_the_status() {
        let items = [Item::Idn(Idn(0x0001_8087)), Item::object(0x6841, 0xFE), Item::attribute(0x42, 661)];
        let shown = items.map(|item| Some((item, 0x8_0237, BitPattern::new(0x8_1004, 0x8_1000))));
        for shown in shown.into_iter().chain([None]) {
            for awaited in Awaited::ALL {
                let wait = AxisWait { waiting: Waiting { awaited: *awaited, shown }, seconds: 0x0102_0304 };
                assert_eq!(AxisWait::from_words(&AxisWait::to_words(Some(wait))), Some(wait));
            }
        }
        assert_eq!(AxisWait::to_words(None), [0; WAIT_WORDS]);
        assert_eq!(AxisWait::from_words(&[0; WAIT_WORDS]), None);
    }

    #[test]
    fn its_numbers_are_those_of_the_line() {
        let shown = Some((Item::object(0x6041, 0), 0x8_0237, BitPattern::new(0x1000, 0x1000)));
        let waiting = Waiting { awaited: Awaited::Following, shown };
        let wait = AxisWait::new(waiting, DurationNs::from_millis(12_999));
        assert_eq!(
            wait.to_string(),
            "has waited 12 s for its drive to follow set-points; 6041:00 = 0237, expected bit 12 = 1"
        );
        assert_eq!(
            (wait.item(), wait.word(), wait.mask(), wait.value()),
            (0x60_4100, 0x0237, 0x1000, 0x1000)
        );
        assert!(!wait.needs_mode());
        let mode = Some((Item::object(0x6041, 0), 0x8_0237, BitPattern::new(0x8_0000, 0x8_0000)));
        let wait = AxisWait { waiting: Waiting { awaited: Awaited::Following, shown: mode }, ..wait };
        assert_eq!((wait.word(), wait.mask(), wait.needs_mode()), (0x0237, 0, true));
    }
}
