//! Turning the names of one file into what they name, and collecting what cannot be turned.

use std::ops::Range;

use profile_generic::program::BitPattern;
use profile_generic::ratio::Ratio;
use toml::Spanned;

use super::format::{FieldValueRow, Name, RatioRow};
use super::load::{FORMAT, TableErrors, TableText};

/// Looks names up on behalf of one file and notes those that nothing has.
pub(super) struct Resolver<'a> {
    file: &'a TableText,
    errors: &'a mut TableErrors,
}

impl<'a> Resolver<'a> {
    pub fn new(file: &'a TableText, errors: &'a mut TableErrors) -> Self {
        Self { file, errors }
    }

    /// Notes that the value at `span` is wrong.
    pub fn error(&mut self, span: Range<usize>, key: &str, message: impl Into<String>) {
        self.errors.push(self.file, span, key, message);
    }

    /// Checks the head of a file.
    pub fn head(&mut self, format: &Spanned<u32>, key: &str, title: &Name, expected: &str) {
        if *format.get_ref() != FORMAT {
            self.error(
                format.span(),
                "format",
                format!("expected format {FORMAT}, got {}", format.get_ref()),
            );
        }
        if title.get_ref() != expected {
            self.error(title.span(), key, format!("expected `{expected}`, got `{}`", title.get_ref()));
        }
    }

    /// What `name` names, or an error that says what `key` expects and what comes closest.
    pub fn name<'n, T>(
        &mut self,
        key: &str,
        name: &Name,
        what: &str,
        find: impl FnOnce(&str) -> Option<T>,
        known: impl IntoIterator<Item = &'n str>,
    ) -> Option<T> {
        let text = name.get_ref().as_str();
        let found = find(text);
        if found.is_none() {
            let mut message = format!("expected {what}, got `{text}`");
            if let Some(closest) = closest(text, known) {
                message.push_str(&format!("; did you mean `{closest}`?"));
            }
            self.error(name.span(), key, message);
        }
        found
    }

    /// One of a few words.
    pub fn word<T: Copy>(&mut self, key: &str, name: &Name, words: &[(&str, T)]) -> Option<T> {
        let list: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        let what = format!("one of {}", list.join(", "));
        let find = |text: &str| words.iter().find(|(word, _)| *word == text).map(|(_, value)| *value);
        self.name(key, name, &what, find, list.iter().copied())
    }

    /// A ratio above zero.
    pub fn ratio(&mut self, key: &str, row: &RatioRow) -> Option<Ratio> {
        let [num, den] = *row.get_ref();
        let ratio = Ratio::new(num, den).filter(|ratio| ratio.num() != 0);
        if ratio.is_none() {
            self.error(
                row.span(),
                key,
                format!("expected two whole numbers other than 0, got [{num}, {den}]"),
            );
        }
        ratio
    }

    /// Mask and value of all `rows`, whose fields `find` knows as first and last bit.
    pub fn pattern<'n>(
        &mut self,
        rows: &[FieldValueRow],
        find: impl Fn(&str) -> Option<(u32, u32)>,
        known: impl IntoIterator<Item = &'n str> + Clone,
    ) -> Option<BitPattern> {
        let mut pattern = BitPattern::new(0, 0);
        for row in rows {
            let (low, high) = self.name("field", &row.field, "a field of the word", &find, known.clone())?;
            let width = high - low + 1;
            let field_mask = if width >= 32 { u32::MAX } else { (1 << width) - 1 };
            let value = *row.is.get_ref();
            if value & !field_mask != 0 {
                let message = format!("expected a value of {width} bits, got {value}");
                self.error(row.is.span(), "is", message);
                return None;
            }
            pattern = BitPattern::new(pattern.mask | field_mask << low, pattern.value | value << low);
        }
        Some(pattern)
    }
}

/// The word closest to `text`, if any is close enough to be what was meant.
fn closest<'n>(text: &str, known: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    let limit = (text.chars().count() / 3).max(1);
    let distances = known.into_iter().map(|word| (distance(text, word), word));
    distances
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, word)| word)
}

/// Letters to insert, delete or replace to turn one word into the other; case does not count.
fn distance(from: &str, to: &str) -> usize {
    let to: Vec<char> = to.to_lowercase().chars().collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (i, letter) in from.to_lowercase().chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, other) in to.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_name_is_offered_only_when_it_is_close() {
        let known = ["position_command", "velocity_command", "torque_command"];
        assert_eq!(closest("position_comand", known), Some("position_command"));
        assert_eq!(closest("Velocity_Command", known), Some("velocity_command"));
        assert_eq!(closest("temperature", known), None);
        assert_eq!((distance("kitten", "sitting"), distance("", "abc"), distance("abc", "")), (3, 3, 3));
    }
}
