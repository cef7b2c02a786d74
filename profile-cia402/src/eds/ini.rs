//! Lines, sections and keys of a data sheet, each with its place.

use std::borrow::Cow;
use std::collections::HashMap;

use super::diagnostic::{Diagnostics, Kind, Place};

/// The longest file that is read, bytes: a hundred times a large data sheet.
pub const BYTES_MAX: usize = 10 * 1024 * 1024;

/// The longest line, bytes.
pub const LINE_MAX: usize = 16 * 1024;

/// The most section headers of a file. Data sheets of large drives have some thousands.
pub const SECTIONS_MAX: usize = 100_000;

/// The most keys of a file.
pub const ENTRIES_MAX: usize = 500_000;

/// Why a file is not read at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// Too many bytes.
    #[error("expected at most {BYTES_MAX} bytes, got {0}: not a data sheet")]
    TooLong(usize),
    /// A line with too many bytes.
    #[error("line {line}: expected at most {LINE_MAX} bytes, got {bytes}: not a data sheet")]
    LineTooLong {
        /// The line, from 1.
        line: u32,
        /// Its bytes.
        bytes: usize,
    },
    /// Too many sections.
    #[error("line {0}: expected at most {SECTIONS_MAX} sections, got one more: not a data sheet")]
    TooManySections(u32),
    /// Too many keys.
    #[error("line {0}: expected at most {ENTRIES_MAX} keys, got one more: not a data sheet")]
    TooManyEntries(u32),
    /// Two bytes for each character.
    #[error("expected UTF-8 or Latin-1, got UTF-16: save the file as text with one byte for each letter")]
    Utf16,
}

/// A key with its value.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry<'t> {
    pub key: &'t str,
    pub value: &'t str,
    pub line: u32,
    pub key_column: u32,
    pub value_column: u32,
}

/// A section.
#[derive(Debug, Clone)]
pub(super) struct Section<'t> {
    pub name: &'t str,
    pub line: u32,
    pub column: u32,
    pub entries: Vec<Entry<'t>>,
}

impl<'t> Section<'t> {
    /// The place of its header.
    pub fn place(&self) -> Place<'t> {
        Place { line: self.line, column: self.column, section: self.name, key: "" }
    }

    /// The place of a value.
    pub fn value_place(&self, entry: &Entry<'t>) -> Place<'t> {
        Place { line: entry.line, column: entry.value_column, section: self.name, key: entry.key }
    }

    /// The place of a key.
    pub fn key_place(&self, entry: &Entry<'t>) -> Place<'t> {
        Place { line: entry.line, column: entry.key_column, section: self.name, key: entry.key }
    }
}

/// Sections and keys of a file. Of what is defined twice the first one counts; case does not matter.
#[derive(Debug, Default)]
pub(super) struct Document<'t> {
    pub sections: Vec<Section<'t>>,
    names: HashMap<String, usize>,
    keys: HashMap<(usize, String), usize>,
    entries: usize,
    headers: usize,
}

impl<'t> Document<'t> {
    /// The section with a name, and its number.
    pub fn section(&self, name: &str) -> Option<(usize, &Section<'t>)> {
        let at = *self.names.get(&name.to_ascii_lowercase())?;
        Some((at, self.sections.get(at)?))
    }

    /// The entry of a section with this key.
    pub fn entry(&self, section: usize, key: &str) -> Option<&Entry<'t>> {
        let at = *self.keys.get(&(section, key.to_ascii_lowercase()))?;
        self.sections.get(section)?.entries.get(at)
    }
}

/// The text of a file: without byte order mark, and with one character for each byte that is not UTF-8.
pub(super) fn text<'b>(bytes: &'b [u8], diagnostics: &mut Diagnostics) -> Result<Cow<'b, str>, Refused> {
    if bytes.len() > BYTES_MAX {
        return Err(Refused::TooLong(bytes.len()));
    }
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        return Err(Refused::Utf16);
    }
    let bytes = unmarked(bytes);
    match core::str::from_utf8(bytes) {
        Ok(text) => Ok(Cow::Borrowed(text)),
        Err(error) => {
            let before = &bytes[..error.valid_up_to()];
            let (line, column) = place_after(before);
            let byte = bytes.get(error.valid_up_to()).copied().unwrap_or_default();
            let place = Place { line, column, ..Place::default() };
            diagnostics.push(Kind::Latin1, place, "UTF-8", format!("byte {byte:#04X}, read as Latin-1"));
            Ok(latin1(bytes))
        }
    }
}

/// The text of any file as [`read`](super::read) sees it, without what it says about that.
pub fn plain(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = unmarked(bytes);
    core::str::from_utf8(bytes).map_or_else(|_| latin1(bytes), Cow::Borrowed)
}

fn unmarked(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(&[0xEF, 0xBB, 0xBF]).unwrap_or(bytes)
}

fn latin1(bytes: &[u8]) -> Cow<'static, str> {
    Cow::Owned(bytes.iter().map(|&byte| char::from(byte)).collect())
}

/// Line and column behind these bytes; every byte of a character but the first is none of its own.
fn place_after(bytes: &[u8]) -> (u32, u32) {
    let text = String::from_utf8_lossy(bytes);
    let (mut line, mut column) = (1_u32, 1_u32);
    let mut before = ' ';
    for letter in text.chars() {
        match letter {
            '\n' if before == '\r' => {}
            '\r' | '\n' => (line, column) = (line.saturating_add(1), 1),
            _ => column = column.saturating_add(1),
        }
        before = letter;
    }
    (line, column)
}

/// Takes a text apart.
pub(super) fn parse<'t>(text: &'t str, diagnostics: &mut Diagnostics) -> Result<Document<'t>, Refused> {
    let mut document = Document::default();
    let mut current = None;
    for (line, content) in (1..).zip(lines(text)) {
        if content.len() > LINE_MAX {
            return Err(Refused::LineTooLong { line, bytes: content.len() });
        }
        let trimmed = content.trim();
        if trimmed.is_empty() || trimmed.starts_with([';', '#']) {
            continue;
        }
        let line = Line { number: line, content };
        if trimmed.starts_with('[') {
            current = document.header(line, diagnostics)?.or(current);
        } else {
            document.key(line, current, diagnostics)?;
        }
    }
    Ok(document)
}

/// The lines of a text that end in CR LF, LF or CR.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    core::iter::from_fn(move || {
        let text = rest?;
        match text.find(['\r', '\n']) {
            None => {
                rest = None;
                Some(text)
            }
            Some(end) => {
                let behind = &text[end..];
                let skip = if behind.starts_with("\r\n") { 2 } else { 1 };
                rest = Some(&behind[skip..]);
                Some(&text[..end])
            }
        }
    })
}

#[derive(Clone, Copy)]
struct Line<'t> {
    number: u32,
    content: &'t str,
}

impl<'t> Line<'t> {
    /// The column of a part of the line.
    fn column(&self, part: &'t str) -> u32 {
        let offset = (part.as_ptr() as usize).saturating_sub(self.content.as_ptr() as usize);
        let before = self.content.get(..offset).unwrap_or_default();
        u32::try_from(before.chars().count()).unwrap_or(u32::MAX).saturating_add(1)
    }

    fn place(&self, part: &'t str) -> Place<'t> {
        Place { line: self.number, column: self.column(part), ..Place::default() }
    }
}

impl<'t> Document<'t> {
    /// The number of the section that a header opens; `None` when it is no header.
    fn header(&mut self, line: Line<'t>, diagnostics: &mut Diagnostics) -> Result<Option<usize>, Refused> {
        let trimmed = line.content.trim();
        let inside = trimmed.strip_prefix('[').and_then(|rest| rest.split_once(']'));
        let named = inside.filter(|(name, behind)| {
            let behind = behind.trim_start();
            !name.trim().is_empty() && (behind.is_empty() || behind.starts_with([';', '#']))
        });
        let Some((name, _)) = named else {
            diagnostics.push(Kind::Syntax, line.place(trimmed), "`[section]`", trimmed);
            return Ok(None);
        };
        self.headers += 1;
        if self.headers > SECTIONS_MAX {
            return Err(Refused::TooManySections(line.number));
        }
        let name = name.trim();
        let column = line.column(name);
        let section = Section { name, line: line.number, column, entries: Vec::new() };
        let known = name.to_ascii_lowercase();
        if let Some(&at) = self.names.get(&known) {
            let first = self.sections.get(at).map_or(0, |first| first.line);
            diagnostics.push(
                Kind::SectionTwice,
                section.place(),
                "each section once",
                format!("the one of line {first} again"),
            );
            return Ok(Some(at));
        }
        self.names.insert(known, self.sections.len());
        self.sections.push(section);
        Ok(Some(self.sections.len() - 1))
    }

    fn key(
        &mut self,
        line: Line<'t>,
        current: Option<usize>,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), Refused> {
        let trimmed = line.content.trim();
        let split = line.content.split_once('=').filter(|(key, _)| !key.trim().is_empty());
        let Some((key, value)) = split else {
            diagnostics.push(
                Kind::Syntax,
                line.place(trimmed),
                "`[section]`, `key=value` or `;comment`",
                trimmed,
            );
            return Ok(());
        };
        let (key, value) = (key.trim(), without_comment(value).trim());
        let place = Place { key, ..line.place(key) };
        let section = current.and_then(|at| self.sections.get_mut(at).map(|section| (at, section)));
        let Some((at, section)) = section else {
            diagnostics.push(Kind::KeyOutside, place, "a section before the first key", key);
            return Ok(());
        };
        self.entries += 1;
        if self.entries > ENTRIES_MAX {
            return Err(Refused::TooManyEntries(line.number));
        }
        let known = (at, key.to_ascii_lowercase());
        if let Some(first) = self.keys.get(&known).and_then(|&first| section.entries.get(first)) {
            let got = format!("`{}` after `{}` in line {}", value, first.value, first.line);
            diagnostics.push(Kind::KeyTwice, Place { section: section.name, ..place }, "each key once", got);
            return Ok(());
        }
        self.keys.insert(known, section.entries.len());
        section.entries.push(Entry {
            key,
            value,
            line: line.number,
            key_column: place.column,
            value_column: line.column(value),
        });
        Ok(())
    }
}

/// A value without the comment behind it: a semicolon after a blank.
fn without_comment(value: &str) -> &str {
    let mut before = ' ';
    for (at, letter) in value.char_indices() {
        if letter == ';' && before.is_whitespace() {
            return &value[..at];
        }
        before = letter;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> (Document<'_>, String) {
        let mut diagnostics = Diagnostics::default();
        let document = parse(text, &mut diagnostics).expect("not refused");
        (document, diagnostics.to_string())
    }

    #[test]
    fn sections_and_keys_come_with_their_places() {
        let (document, odd) =
            parsed("; first\r\n[ A ] ; here\r\n  Key = some text ; comment\rk=;\n#x\n\n[b]\nä= ü");
        assert_eq!(odd, "");
        let all: Vec<_> = document
            .sections
            .iter()
            .flat_map(|section| section.entries.iter().map(move |entry| (section, entry)))
            .map(|(section, entry)| {
                let places = (section.line, section.column, entry.line, entry.key_column, entry.value_column);
                (section.name, entry.key, entry.value, places)
            })
            .collect();
        assert_eq!(
            all,
            [
                ("A", "Key", "some text", (2, 3, 3, 3, 9)),
                ("A", "k", "", (2, 3, 4, 1, 3)),
                ("b", "ä", "ü", (7, 2, 8, 1, 4)),
            ]
        );
        let (at, section) = document.section("B").expect("without regard to case");
        assert_eq!((section.name, document.entry(at, "Ä").is_some()), ("b", false));
        assert!(document.entry(0, "KEY").is_some());
    }

    #[test]
    fn of_what_is_there_twice_the_first_counts() {
        let (document, odd) = parsed("[a]\nk=1\n[A]\nK=2\nl=3\n");
        let (at, section) = document.section("a").expect("there");
        assert_eq!((section.entries.len(), document.entry(at, "k").map(|entry| entry.value)), (2, Some("1")));
        assert_eq!(
            odd,
            "3:2: warning[section-twice]: [A]: expected each section once, got the one of line 1 again\n\
             4:1: warning[key-twice]: [a] K: expected each key once, got `2` after `1` in line 2\n"
        );
    }

    #[test]
    fn lines_that_are_nothing_are_told() {
        let (document, odd) = parsed("k=1\n[a\n[]\n[b] x\nnothing\n=3\n[c]\n k =\n");
        assert_eq!(document.sections.len(), 1);
        assert_eq!(
            odd,
            "1:1: error[key-outside]: k: expected a section before the first key, got k\n\
             2:1: error[syntax]: expected `[section]`, got [a\n\
             3:1: error[syntax]: expected `[section]`, got []\n\
             4:1: error[syntax]: expected `[section]`, got [b] x\n\
             5:1: error[syntax]: expected `[section]`, `key=value` or `;comment`, got nothing\n\
             6:1: error[syntax]: expected `[section]`, `key=value` or `;comment`, got =3\n"
        );
    }

    #[test]
    fn what_is_too_much_is_refused() {
        let refused = |text: &str| parse(text, &mut Diagnostics::default()).map(|_| ()).unwrap_err();
        assert_eq!(
            refused(&format!("\n{}", "x".repeat(LINE_MAX + 1))),
            Refused::LineTooLong { line: 2, bytes: LINE_MAX + 1 }
        );
        assert_eq!(refused(&"[a]\n".repeat(1_000_000)), Refused::TooManySections(100_001));
        let keys: String = (0..=ENTRIES_MAX).map(|number| format!("{number}=\n")).collect();
        assert_eq!(refused(&format!("[a]\n{keys}")), Refused::TooManyEntries(500_002));
        let bytes = |bytes: &[u8]| text(bytes, &mut Diagnostics::default()).map(Cow::into_owned);
        assert_eq!(bytes(&vec![b' '; BYTES_MAX + 1]), Err(Refused::TooLong(BYTES_MAX + 1)));
        assert_eq!(bytes(&[0xFF, 0xFE, b'[', 0]), Err(Refused::Utf16));
        assert_eq!(bytes(b"\xEF\xBB\xBFa").as_deref(), Ok("a"));
    }

    #[test]
    fn bytes_that_are_not_utf_8_are_latin_1() {
        let mut diagnostics = Diagnostics::default();
        assert_eq!(text(b"[a]\r\nk=\xFCber", &mut diagnostics).as_deref(), Ok("[a]\r\nk=über"));
        assert_eq!(
            diagnostics.to_string(),
            "2:3: note[latin-1]: expected UTF-8, got byte 0xFC, read as Latin-1\n"
        );
    }
}
