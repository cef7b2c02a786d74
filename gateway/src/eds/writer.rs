//! The form of a data sheet: sections, entries, fields. Lines end in CR LF, as tools on every system read them.

use std::fmt::Write as _;

/// A field of an entry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Field<'a> {
    /// Nothing.
    Empty,
    /// A number.
    Number(u32),
    /// A number in hexadecimal with so many digits.
    Hex(u32, usize),
    /// A word without quotation marks: a keyword, date, time or revision.
    Word(&'a str),
    /// Text in quotation marks.
    Text(&'a str),
    /// A parameter of the sheet.
    Reference(u16),
}

impl From<u16> for Field<'_> {
    fn from(number: u16) -> Self {
        Self::Number(u32::from(number))
    }
}

/// Writes a sheet from its beginning to its end.
#[derive(Debug, Default)]
pub struct Writer {
    out: String,
}

impl Writer {
    /// A line for people.
    pub fn comment(&mut self, text: &str) {
        self.line(&format!("$ {}", printable(text)));
    }

    /// Begins a section.
    pub fn section(&mut self, name: &str) {
        self.line("");
        self.line(&format!("[{name}]"));
    }

    /// Writes an entry.
    pub fn entry(&mut self, keyword: &str, fields: &[Field<'_>]) {
        let mut text = format!("        {keyword} = ");
        for (index, field) in fields.iter().enumerate() {
            if index > 0 {
                text.push(',');
            }
            // Writing to a string does not fail.
            let _ = match field {
                Field::Empty => Ok(()),
                Field::Number(number) => write!(text, "{number}"),
                Field::Hex(number, digits) => write!(text, "0x{number:0digits$X}"),
                Field::Word(word) => text.write_str(word),
                Field::Text(content) => write!(text, "\"{}\"", quoted(content)),
                Field::Reference(number) => write!(text, "Param{number}"),
            };
        }
        text.push(';');
        self.line(&text);
    }

    /// The sheet.
    pub fn finish(self) -> String {
        self.out
    }

    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        self.out.push_str("\r\n");
    }
}

/// Printable ASCII; anything else becomes a question mark.
fn printable(text: &str) -> String {
    text.chars().map(|c| if (' '..='~').contains(&c) { c } else { '?' }).collect()
}

/// Text between quotation marks: those in it, and backslashes, with a backslash before them.
fn quoted(text: &str) -> String {
    printable(text).replace('\\', "\\\\").replace('"', "\\\"")
}
