//! What a translation found, as a tree of lines that name the rows of the tables they come from.

use std::fmt;

use serde::Serialize;

use crate::mapping::Origin;

/// A line and what belongs below it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Node {
    /// The line.
    pub text: String,
    /// The rows that made it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<Origin>,
    /// What belongs to it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub children: Vec<Node>,
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
    pub fn by(mut self, row: impl IntoIterator<Item = Origin>) -> Self {
        self.rows.extend(row);
        self
    }

    /// Puts a line below.
    pub fn push(&mut self, child: Node) {
        self.children.push(child);
    }

    /// The tree as text, two blanks in for each level.
    pub fn write(&self, out: &mut dyn fmt::Write, level: usize, names: RowNames) -> fmt::Result {
        write!(out, "{:width$}{}", "", self.text, width = 2 * level)?;
        let named = self.rows.iter().map(|row| match names {
            RowNames::Lines => row.to_string(),
            RowNames::Keys => format!("[[{}]] {}", row.section, row.key),
        });
        let named: Vec<_> = named.collect();
        if !named.is_empty() {
            write!(out, "  <- {}", named.join(", "))?;
        }
        out.write_char('\n')?;
        self.children.iter().try_for_each(|child| child.write(out, level + 1, names))
    }
}

/// Bytes as people write them: `01 a0`.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_is_written_with_its_rows() {
        let row = Origin { file: "a.toml".into(), line: 3, section: "signal", key: "position".into() };
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
