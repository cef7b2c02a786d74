//! What is odd about a file, with its place.

use core::fmt;

/// At most so many diagnostics of a file are kept; the rest is counted.
pub const DIAGNOSTICS_MAX: usize = 500;

/// At most so many characters of what a file has are repeated.
const SHOWN_MAX: usize = 60;

/// How much a diagnostic matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Read as it was meant.
    Note,
    /// Contradictory, or incomplete: read in one of several ways.
    Warning,
    /// Not read: the entry is as if it were not there.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident: $severity:ident = $code:literal),* $(,)?) => {
        /// What is odd. The codes are stable.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Kind { $($(#[$doc])* $kind),* }

        impl Kind {
            /// Every kind.
            pub const ALL: &'static [Self] = &[$(Self::$kind),*];

            /// Its stable code.
            #[must_use]
            pub const fn code(self) -> &'static str {
                match self { $(Self::$kind => $code),* }
            }

            /// How much it matters.
            #[must_use]
            pub const fn severity(self) -> Severity {
                match self { $(Self::$kind => Severity::$severity),* }
            }
        }
    };
}

kinds! {
    /// The bytes are not UTF-8; each was taken for a character of Latin-1.
    Latin1: Note = "latin-1",
    /// A line that is neither section, key nor comment.
    Syntax: Error = "syntax",
    /// A key before the first section.
    KeyOutside: Error = "key-outside",
    /// A section that is there a second time; its keys are taken as if they stood in the first.
    SectionTwice: Warning = "section-twice",
    /// A key that is there a second time; the first one counts.
    KeyTwice: Warning = "key-twice",
    /// A section of which nothing is known.
    SectionUnknown: Note = "section-unknown",
    /// A section that every file has.
    SectionMissing: Warning = "section-missing",
    /// A list of objects that does not have the entries it says.
    ListCount: Warning = "list-count",
    /// An object that stands in two lists, or twice in one.
    ListedTwice: Warning = "listed-twice",
    /// An object in a list that is not described.
    ListedOnly: Warning = "listed-only",
    /// An object that is described and stands in no list.
    Unlisted: Warning = "unlisted",
    /// An object that every device has is not described.
    MandatoryMissing: Warning = "mandatory-missing",
    /// A kind of object that there is not.
    ObjectType: Error = "object-type",
    /// A variable with sub-objects, which is taken for a record.
    SubsOfVariable: Warning = "subs-of-variable",
    /// A sub-object without its object.
    SubOrphan: Warning = "sub-orphan",
    /// The number of sub-objects is not what it says.
    SubNumber: Warning = "sub-number",
    /// `CompactSubObj` next to sub-objects, or entries beyond it.
    Compact: Warning = "compact",
    /// More compact objects than are read.
    TooMany: Error = "too-many",
    /// An object without a name.
    NameMissing: Warning = "name-missing",
    /// A value without a data type.
    TypeMissing: Error = "type-missing",
    /// A data type that is none of CiA 301.
    TypeUnknown: Warning = "type-unknown",
    /// A value without access; it is taken for read only.
    AccessMissing: Warning = "access-missing",
    /// An access that there is not; it is taken for read only.
    Access: Error = "access",
    /// What should be a number and is none.
    Number: Error = "number",
    /// A value that its data type cannot be.
    Value: Error = "value",
    /// A value that its data type cannot hold.
    Range: Error = "range",
    /// A bit pattern where a number with a sign is meant.
    TwosComplement: Note = "twos-complement",
    /// A lower limit above the higher one.
    Limits: Warning = "limits",
    /// A value beyond its limits.
    BeyondLimits: Warning = "beyond-limits",
    /// The number of PDOs is not what it says.
    PdoCount: Warning = "pdo-count",
    /// A PDO mapping that names what is not there, not mappable, of another length, or too much.
    Mapping: Warning = "mapping",
    /// A node-ID or bit rate that there is not.
    Commissioning: Error = "commissioning",
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.code())
    }
}

/// One oddity.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// What it is.
    pub kind: Kind,
    /// Line, from 1; 0 for the file as a whole.
    pub line: u32,
    /// Column in characters, from 1; 0 for the file as a whole.
    pub column: u32,
    /// Section and key as in `[1018sub1] DefaultValue`; either or both may be missing.
    pub place: String,
    /// What was expected.
    pub expected: String,
    /// What came.
    pub got: String,
}

impl Diagnostic {
    /// How much it matters.
    #[must_use]
    pub const fn severity(&self) -> Severity {
        self.kind.severity()
    }
}

/// `12:5: error[number]: [1018sub1] DefaultValue: expected ..., got ...`
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.line > 0 {
            write!(f, "{}:{}: ", self.line, self.column)?;
        }
        write!(f, "{}[{}]: ", self.severity(), self.kind)?;
        if !self.place.is_empty() {
            write!(f, "{}: ", self.place)?;
        }
        write!(f, "expected {}, got {}", self.expected, self.got)
    }
}

/// What is odd about a file, in the order of lines.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    more: usize,
    worst: Option<Severity>,
}

/// Where something stands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Place<'t> {
    pub line: u32,
    pub column: u32,
    pub section: &'t str,
    pub key: &'t str,
}

impl Diagnostics {
    /// Those that are kept: the first [`DIAGNOSTICS_MAX`].
    #[must_use]
    pub fn list(&self) -> &[Diagnostic] {
        &self.list
    }

    /// How many more there were.
    #[must_use]
    pub const fn more(&self) -> usize {
        self.more
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The worst one, of those that are not kept too.
    #[must_use]
    pub const fn worst(&self) -> Option<Severity> {
        self.worst
    }

    pub(super) fn push(
        &mut self,
        kind: Kind,
        place: Place<'_>,
        expected: impl Into<String>,
        got: impl AsRef<str>,
    ) {
        self.worst = self.worst.max(Some(kind.severity()));
        if self.list.len() >= DIAGNOSTICS_MAX {
            self.more += 1;
            return;
        }
        let section = shown(place.section);
        let text = match (section.is_empty(), place.key.is_empty()) {
            (true, _) => shown(place.key),
            (false, true) => format!("[{section}]"),
            (false, false) => format!("[{section}] {}", shown(place.key)),
        };
        let Place { line, column, .. } = place;
        self.list.push(Diagnostic {
            kind,
            line,
            column,
            place: text,
            expected: expected.into(),
            got: shown(got.as_ref()),
        });
    }

    /// In the order of the lines; what is about the file as a whole comes first.
    pub(super) fn sort(&mut self) {
        self.list.sort_by_key(|diagnostic| (diagnostic.line, diagnostic.column));
    }
}

/// One line each.
impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for diagnostic in &self.list {
            writeln!(f, "{diagnostic}")?;
        }
        if self.more > 0 {
            writeln!(f, "and {} more", self.more)?;
        }
        Ok(())
    }
}

/// The beginning of a text, with nothing in it that would upset a terminal.
fn shown(text: &str) -> String {
    let visible = |letter: char| if letter.is_control() { '?' } else { letter };
    let mut short: String = text.chars().take(SHOWN_MAX).map(visible).collect();
    if text.chars().nth(SHOWN_MAX).is_some() {
        short.push_str("...");
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_code_of_its_own() {
        for (at, kind) in Kind::ALL.iter().enumerate() {
            assert!(!Kind::ALL[..at].iter().any(|other| other.code() == kind.code()), "{kind}");
        }
    }

    #[test]
    fn so_many_are_kept_and_the_rest_is_counted() {
        let mut diagnostics = Diagnostics::default();
        for line in 0..DIAGNOSTICS_MAX + 3 {
            let line = u32::try_from(line).unwrap();
            diagnostics.push(Kind::Latin1, Place { line, column: 1, ..Place::default() }, "UTF-8", "\u{7}");
        }
        assert_eq!((diagnostics.list().len(), diagnostics.more()), (DIAGNOSTICS_MAX, 3));
        assert_eq!(diagnostics.worst(), Some(Severity::Note));
        diagnostics.push(Kind::Number, Place::default(), "", "");
        assert_eq!(diagnostics.worst(), Some(Severity::Error));
        assert_eq!(diagnostics.list()[1].to_string(), "1:1: note[latin-1]: expected UTF-8, got ?");
    }
}
