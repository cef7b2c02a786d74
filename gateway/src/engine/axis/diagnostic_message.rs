//! The diagnostic message of a drive: a number and a text for people that come with a fault or warning, read over the
//! service channel one after the other.

use arrayvec::ArrayString;
use profile_generic::time::MonotonicTime;

use super::diagnosis::ANSWER_TIME_OUT;
use crate::engine::access::DATA_LEN;
use crate::mapping::Item;

/// Bytes of a text: a drive's octets may take two each.
const TEXT_LEN: usize = 2 * DATA_LEN;

/// Bytes of a number; what is longer is a text.
const NUMBER_LEN: usize = 4;

/// What a drive says.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DiagnosticMessage {
    /// Its number of the diagnosis.
    pub number: Option<u32>,
    /// Its text; empty when it has none, or one that is too long to be read here.
    pub text: ArrayString<TEXT_LEN>,
}

/// Where the reading stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Reading {
    /// Something has come since the last reading began.
    wanted: bool,
    /// Place of what is read, in the order of the program.
    place: Option<usize>,
    asked: Option<(Item, MonotonicTime)>,
    said: DiagnosticMessage,
    /// What it said last; that is reported once as long as something is there.
    told: DiagnosticMessage,
}

impl Reading {
    pub fn want(&mut self) {
        self.wanted = true;
    }

    /// What should be read now of these items, so that people learn what the drive says.
    pub fn wanted(&self, now: MonotonicTime, items: &[Item]) -> Option<Item> {
        let waits = self.asked.is_some_and(|(_, since)| now.since(since) < ANSWER_TIME_OUT);
        if waits || (self.place.is_none() && !self.wanted) {
            return None;
        }
        items.get(self.place.unwrap_or(0)).copied()
    }

    /// What was wanted is on its way.
    pub fn ask(&mut self, now: MonotonicTime, item: Item) {
        if self.place.is_none() {
            *self = Self { place: Some(0), told: self.told, ..Self::default() };
        }
        self.asked = Some((item, now));
    }

    /// The drive has answered, or has nothing to say. Returns all that it said when that was the last of so many `items`, and the fault
    /// or warning still `stands`.
    pub fn take(
        &mut self,
        item: Item,
        data: Option<&[u8]>,
        items: usize,
        stands: bool,
    ) -> Option<DiagnosticMessage> {
        self.asked.take_if(|(asked, _)| *asked == item)?;
        let place = self.place? + 1;
        let last = place >= items;
        let number = data.filter(|data| place == 1 && matches!(data.len(), 2 | NUMBER_LEN));
        match (number, data) {
            (Some(data), _) => self.said.number = Some(little_endian(data)),
            (None, Some(data)) => self.said.text = text(data),
            (None, None) => {}
        }
        self.place = (!last).then_some(place);
        if !last || !stands || self.said == DiagnosticMessage::default() || self.said == self.told {
            return None;
        }
        self.told = self.said;
        Some(self.said)
    }

    /// What the drive showed is over: it will be told again when it comes again.
    pub fn end(&mut self) {
        self.told = DiagnosticMessage::default();
    }
}

fn little_endian(data: &[u8]) -> u32 {
    data.iter().rev().fold(0, |number, octet| number << 8 | u32::from(*octet))
}

/// The characters of a text: of UTF-8 where it is that, else of ISO 8859-1, as older drives have it.
fn text(data: &[u8]) -> ArrayString<TEXT_LEN> {
    let mut text = ArrayString::new();
    let mut push = |character: char| {
        if !character.is_control() {
            // There is room for every octet as the longest character that it can be.
            let _ = text.try_push(character);
        }
    };
    match core::str::from_utf8(data) {
        Ok(utf8) => utf8.trim().chars().for_each(&mut push),
        Err(_) => data.iter().map(|octet| char::from(*octet)).for_each(&mut push),
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_read_in_either_code_and_lose_what_is_no_character() {
        assert_eq!(text(b"overcurrent\0 ").as_str(), "overcurrent");
        assert_eq!(text("\u{dc}berstrom".as_bytes()).as_str(), "\u{dc}berstrom");
        assert_eq!(text(b"\xdcberstrom").as_str(), "\u{dc}berstrom");
        assert_eq!(text(&[0xFF; DATA_LEN]).chars().count(), DATA_LEN, "the longest text has room");
        assert_eq!(text(b"").as_str(), "");
    }

    #[test]
    fn numbers_are_read_with_two_and_with_four_octets() {
        assert_eq!(little_endian(&[0x0B, 0x00, 0x0F, 0xC0]), 0xC00F_000B);
        assert_eq!(little_endian(&[0x26, 0xF2]), 0xF226);
    }
}
