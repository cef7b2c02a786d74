//! What a translation found, as a tree of lines that name the rows of the tables they come from.

use std::fmt::{self, Write as _};
use std::ops::Deref;
use std::sync::Arc;

use serde::{Serialize, Serializer};

use super::fact::Fact;
use crate::mapping::Origin;

/// A row of a table, with its name for people; cheap to clone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row(Arc<(Origin, String)>);

impl Row {
    /// File, line, kind and key.
    fn name(&self) -> &str {
        &self.0.1
    }
}

impl From<Origin> for Row {
    fn from(origin: Origin) -> Self {
        let name = origin.to_string();
        Self(Arc::new((origin, name)))
    }
}

impl From<Row> for Origin {
    fn from(row: Row) -> Self {
        row.0.0.clone()
    }
}

impl Deref for Row {
    type Target = Origin;

    fn deref(&self) -> &Origin {
        &self.0.0
    }
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.0.serialize(serializer)
    }
}

/// A line and what belongs below it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Node {
    /// The line.
    pub text: String,
    /// The rows that made it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<Row>,
    /// What belongs to it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub children: Vec<Node>,
    /// The values that the line shows.
    #[serde(skip)]
    pub facts: Vec<Fact>,
    /// Number of the axis that the line is about.
    #[serde(skip)]
    pub axis: Option<usize>,
    /// What the line is beside a value.
    #[serde(skip)]
    pub mark: Mark,
}

/// What a line is, where it is no value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mark {
    /// Nothing special.
    #[default]
    None,
    /// What the gateway says in its log.
    Log,
    /// Something could not be translated.
    Error,
    /// Something about the recording.
    Note,
}

/// How the rows are named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowNames {
    /// By file, line, kind and key: for people.
    Lines,
    /// By kind and key: stays the same when rows move in their file.
    Keys,
}

impl Node {
    /// A line without a row.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    /// Names a row that made the line.
    #[must_use]
    pub fn by<R: Into<Row>>(mut self, row: impl IntoIterator<Item = R>) -> Self {
        self.rows.extend(row.into_iter().map(Into::into));
        self
    }

    /// Says which value the line shows.
    #[must_use]
    pub fn shows(mut self, facts: impl IntoIterator<Item = Fact>) -> Self {
        self.facts.extend(facts);
        self
    }

    /// Says which axis the line is about.
    #[must_use]
    pub fn about(mut self, axis: usize) -> Self {
        self.axis = Some(axis);
        self
    }

    /// Says what the line is.
    #[must_use]
    pub fn marked(mut self, mark: Mark) -> Self {
        self.mark = mark;
        self
    }

    /// Whether something in the tree could not be translated.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.mark == Mark::Error || self.children.iter().any(Self::has_errors)
    }

    /// Calls `see` with every node, and the rows that count for it.
    pub fn walk<'n>(&'n self, see: &mut dyn FnMut(&'n Self)) {
        see(self);
        self.children.iter().for_each(|child| child.walk(see));
    }

    /// Puts a line below.
    pub fn push(&mut self, child: Node) {
        self.children.push(child);
    }

    /// The tree as text, two blanks in for each level.
    pub fn write(&self, out: &mut dyn fmt::Write, level: usize, names: RowNames) -> fmt::Result {
        (0..level).try_for_each(|_| out.write_str("  "))?;
        out.write_str(&self.text)?;
        for (place, row) in self.rows.iter().enumerate() {
            out.write_str(if place == 0 { "  <- " } else { ", " })?;
            match names {
                RowNames::Lines => out.write_str(row.name())?,
                RowNames::Keys => write!(out, "[[{}]] {}", row.section, row.key)?,
            }
        }
        out.write_char('\n')?;
        self.children.iter().try_for_each(|child| child.write(out, level + 1, names))
    }
}

/// A line of text, in room for most of them: a string that grows is copied several times.
pub(super) fn line(arguments: std::fmt::Arguments<'_>) -> String {
    const ROOM: usize = 120;
    let mut text = String::with_capacity(ROOM);
    // Writing to a string does not fail.
    let _ = text.write_fmt(arguments);
    text
}

/// `format!` in room for a whole line: see [`line`].
macro_rules! text {
    ($($part:tt)*) => {
        $crate::translate::tree::line(format_args!($($part)*))
    };
}
pub(super) use text;

/// Bytes as people write them: `01 a0`.
pub(super) fn hex(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let mut text = String::with_capacity(3 * bytes.len());
    for (place, byte) in bytes.iter().enumerate() {
        if place > 0 {
            text.push(' ');
        }
        text.push(char::from(DIGITS[usize::from(byte >> 4)]));
        text.push(char::from(DIGITS[usize::from(byte & 15)]));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_is_written_with_its_rows() {
        let row = Origin {
            file: "a.toml".into(),
            line: 3,
            section: "signal",
            key: "position".into(),
            path: String::new(),
        };
        let mut tree = Node::new("axis");
        tree.push(Node::new(hex(&[1, 0xA0])).by(Some(row)));
        let text = |names| {
            let mut text = String::new();
            tree.write(&mut text, 1, names).unwrap();
            text
        };
        assert_eq!(text(RowNames::Lines), "  axis\n    01 a0  <- a.toml:3 [[signal]] position\n");
        assert_eq!(text(RowNames::Keys), "  axis\n    01 a0  <- [[signal]] position\n");
        let json = serde_json::to_value(&tree).unwrap();
        assert_eq!(json["children"][0]["rows"][0]["line"], 3);
        assert!(json.get("rows").is_none());
    }
}
