//! Text with indentation.

use std::fmt::{Arguments, Write as _};

/// Bytes shown of data that nothing is known about.
const BYTES_SHOWN: usize = 64;

/// Lines of a tree.
#[derive(Debug, Default)]
pub(super) struct Text(String);

impl Text {
    pub fn clear(&mut self) {
        self.0.clear();
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// A line, two blanks in for each level.
    pub fn line(&mut self, level: usize, line: Arguments<'_>) {
        if !self.0.is_empty() {
            self.0.push('\n');
        }
        for _ in 0..level {
            self.0.push_str("  ");
        }
        // Writing to a string does not fail.
        let _ = self.0.write_fmt(line);
    }

    /// Goes on in the last line, after a blank.
    pub fn append(&mut self, more: Arguments<'_>) {
        self.0.push(' ');
        let _ = self.0.write_fmt(more);
    }

    /// Lines with their own indentation, each moved in.
    pub fn block(&mut self, level: usize, lines: &str) {
        for line in lines.lines() {
            self.line(level, format_args!("{line}"));
        }
    }

    /// Bytes in hexadecimal, the first ones only when they are many.
    pub fn bytes(&mut self, level: usize, what: &str, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.line(level, format_args!("{what}:"));
        for byte in bytes.iter().take(BYTES_SHOWN) {
            self.append(format_args!("{byte:02x}"));
        }
        if let Some(more) = bytes.len().checked_sub(BYTES_SHOWN).filter(|more| *more > 0) {
            self.append(format_args!("and {more} more"));
        }
    }
}
