//! What is wrong with a file: one mechanism for mapping tables, configurations and scripts.
//!
//! A [`Finding`] has a stable [`Code`] of the [`registry`], whose severity it has, and the place where it was found, shown
//! with its line. Whoever reads a file makes [`Problem`]s of it, by their place in the text; [`Findings`] collects them.

mod closest;
mod consequences;
mod document;
mod json;
pub mod registry;
mod render;
mod sarif;
mod source;
mod spanned;
mod toml_error;

use std::fmt;
use std::ops::Range;
use std::path::Path;

pub use closest::closest;
pub use document::{Hint, Partial, deserialize, partial, tree};
pub use json::report as json_report;
pub use registry::{Code, Severity};
pub use sarif::report as sarif_report;
pub use source::Source;
pub use spanned::Spanned;

use registry as code;

/// The most findings that are kept of one look: nobody reads more, and a file that is wrong throughout must not take
/// memory and time without end.
pub const FINDINGS_MAX: usize = 500;

/// So many times the same is shown once.
const REPEATED_MIN: usize = 4;

/// The most other places that are named of it.
const PLACES_MAX: usize = 4;

/// Something that is wrong, by its place in a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// What kind of thing.
    pub code: Code,
    /// Where.
    pub span: Range<usize>,
    /// The key whose value is wrong; empty when there is none.
    pub key: String,
    /// What is wrong; empty takes the title of the code.
    pub title: String,
    /// What was expected; empty where the title says it all.
    pub expected: String,
    /// What to do about it; mostly empty.
    pub help: String,
    /// Another place that explains this one, and what is there.
    pub related: Option<(Range<usize>, String)>,
    /// What it is about: the value that a row binds; empty when that is of no account.
    pub about: String,
    /// The name that nothing defines; empty when none is lacking.
    pub lacks: String,
}

impl Problem {
    /// A problem that is yet to be described.
    pub fn new(code: Code, span: Range<usize>) -> Self {
        let none = String::new;
        Self {
            code,
            span,
            key: none(),
            title: none(),
            expected: none(),
            help: none(),
            related: None,
            about: none(),
            lacks: none(),
        }
    }

    /// The key whose value is wrong.
    #[must_use]
    pub fn key(self, key: impl Into<String>) -> Self {
        Self { key: key.into(), ..self }
    }

    /// What is wrong.
    #[must_use]
    pub fn title(self, title: impl Into<String>) -> Self {
        Self { title: title.into(), ..self }
    }

    /// What was expected.
    #[must_use]
    pub fn expected(self, expected: impl Into<String>) -> Self {
        Self { expected: expected.into(), ..self }
    }

    /// What to do about it.
    #[must_use]
    pub fn help(self, help: impl Into<String>) -> Self {
        Self { help: help.into(), ..self }
    }

    /// Another place that explains this one.
    #[must_use]
    pub fn related(self, span: Range<usize>, what: impl Into<String>) -> Self {
        Self { related: Some((span, what.into())), ..self }
    }

    /// The value that the row binds. An error that explains others about the same value hides them.
    #[must_use]
    pub fn about(self, name: impl Into<String>) -> Self {
        Self { about: name.into(), ..self }
    }

    /// The name that nothing defines. An error in the row that defines it hides this one.
    #[must_use]
    pub fn lacks(self, name: impl Into<String>) -> Self {
        Self { lacks: name.into(), ..self }
    }

    /// What is wrong, in words.
    fn full_title(&self) -> String {
        match (self.title.is_empty(), self.key.is_empty()) {
            (false, _) => self.title.clone(),
            (true, true) => self.code.title().to_owned(),
            (true, false) => format!("`{}`: {}", self.key, self.code.title()),
        }
    }
}

/// Another place that explains a finding.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Related {
    /// The file.
    pub file: String,
    /// Line, 1 first.
    pub line: usize,
    /// Column in characters, 1 first.
    pub column: usize,
    /// What is there.
    pub text: String,
}

/// Something that is wrong with a file. As text it is shown with its line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What kind of thing; its severity is that of the finding.
    pub code: Code,
    /// The file.
    pub file: String,
    /// Line, 1 first; 0 when it concerns the file as a whole.
    pub line: usize,
    /// Column in characters, 1 first; 0 when it concerns the file as a whole.
    pub column: usize,
    /// How many characters are marked.
    pub length: usize,
    /// The key whose value is wrong; empty when there is none.
    pub key: String,
    /// What is wrong.
    pub title: String,
    /// What was expected; empty where the title says it all.
    pub expected: String,
    /// What to do about it; mostly empty.
    pub help: String,
    /// Another place that explains this one.
    pub related: Option<Related>,
    origin: consequences::Origin,
    rendered: String,
    styled: String,
}

impl Finding {
    /// How bad it is.
    #[must_use]
    pub fn severity(&self) -> Severity {
        self.code.severity()
    }

    /// The same text with colours, for a terminal.
    #[must_use]
    pub fn styled(&self) -> &str {
        &self.styled
    }

    /// Whether it asks for something to be done: an error, a warning, or a note about a row that a user has written.
    #[must_use]
    pub fn asks(&self) -> bool {
        let fact = registry::FACTS.contains(&self.code);
        self.severity() != Severity::Note || !fact && !self.file.starts_with(crate::load::SHIPPED)
    }

    fn order(&self) -> (&str, usize, usize, Code, &str) {
        (&self.file, self.line, self.column, self.code, &self.title)
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.rendered)
    }
}

/// Everything that was found in one look, by file, line and column.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Findings {
    list: Vec<Finding>,
    beyond: usize,
}

impl Findings {
    /// Notes a problem of a text.
    pub fn push(&mut self, source: &Source, problem: Problem) {
        if self.list.len() >= FINDINGS_MAX {
            self.beyond += 1;
            return;
        }
        let finding = render::finding(source, problem);
        let at = self.list.partition_point(|known| known.order() <= finding.order());
        // The same thing is reported once, however many ways lead to it.
        if self.list[..at].last().is_none_or(|last| *last != finding) {
            self.list.insert(at, finding);
        }
    }

    /// Notes what is wrong with a file as a whole.
    pub fn push_file(&mut self, code: Code, path: &Path, expected: impl Into<String>) {
        self.push(&Source::new(&path.display().to_string(), ""), Problem::new(code, 0..0).expected(expected));
    }

    /// Takes in what another look has found.
    pub fn extend(&mut self, other: Self) {
        self.beyond += other.beyond;
        self.list.extend(other.list);
        self.list.sort_by(|a, b| a.order().cmp(&b.order()));
        self.list.dedup();
        self.beyond += self.list.len().saturating_sub(FINDINGS_MAX);
        self.list.truncate(FINDINGS_MAX);
    }

    /// Forgets what only follows from something else that was found: the cause stands alone.
    pub fn settle(&mut self) {
        consequences::forget(&mut self.list);
    }

    /// Forgets those that are not to be kept.
    pub fn retain(&mut self, keep: impl Fn(&Finding) -> bool) {
        self.list.retain(keep);
    }

    /// All of them.
    #[must_use]
    pub fn list(&self) -> &[Finding] {
        &self.list
    }

    /// How many were found beyond [`FINDINGS_MAX`].
    #[must_use]
    pub fn beyond(&self) -> usize {
        self.beyond
    }

    /// Whether nothing was found.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// How many there are of a severity.
    #[must_use]
    pub fn count(&self, severity: Severity) -> usize {
        self.list.iter().filter(|finding| finding.severity() == severity).count()
    }

    /// Whether something was found that keeps the files from being used.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.beyond > 0 || self.count(Severity::Error) > 0
    }

    /// `Ok` when there are no errors.
    ///
    /// # Errors
    /// These findings.
    pub fn into_result<T>(self, value: T) -> Result<T, Findings> {
        if self.has_errors() { Err(self) } else { Ok(value) }
    }
}

impl fmt::Display for Findings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.shown(false, |_| true).trim_end())
    }
}

impl Findings {
    /// Those that are to be shown, one after the other, each with an empty line after it. What is the same at many places is
    /// shown at the first of them, with the others named.
    #[must_use]
    pub fn shown(&self, styled: bool, keep: impl Fn(&Finding) -> bool) -> String {
        let kept: Vec<&Finding> = self.list.iter().filter(|finding| keep(finding)).collect();
        let same =
            |a: &Finding, b: &Finding| (a.code, &a.title, &a.expected) == (b.code, &b.title, &b.expected);
        let mut text = String::new();
        for (index, finding) in kept.iter().enumerate() {
            let others: Vec<&&Finding> =
                kept[index + 1..].iter().filter(|other| same(other, finding)).collect();
            let before = kept[..index].iter().filter(|other| same(other, finding)).count();
            let repeated = before + others.len() >= REPEATED_MIN;
            if repeated && before > 0 {
                continue;
            }
            text.push_str(if styled { &finding.styled } else { &finding.rendered });
            if repeated {
                let place = |other: &&&Finding| match other.file == finding.file {
                    true => format!("line {}", other.line),
                    false => format!("{}:{}", other.file, other.line),
                };
                let more = match others.len().saturating_sub(PLACES_MAX) {
                    0 => String::new(),
                    more => format!(" and at {more} more places"),
                };
                let places: Vec<String> = others.iter().take(PLACES_MAX).map(place).collect();
                text.push_str(&format!("\n  = the same at {}{more}", places.join(", ")));
            }
            text.push_str("\n\n");
        }
        if self.beyond > 0 {
            text.push_str(&format!("{} more are not shown\n\n", self.beyond));
        }
        text
    }
}

impl std::error::Error for Findings {}

/// Reads a file of limited length.
///
/// # Errors
/// It cannot be read, or is longer than `most` bytes: the code, and what was expected.
pub fn read_bytes(path: &Path, most: u64) -> Result<Vec<u8>, (Code, String)> {
    use std::io::Read;
    let mut bytes = Vec::new();
    // The length that the system tells may change until it is read, and a pipe has none.
    let read = std::fs::File::open(path).and_then(|file| file.take(most + 1).read_to_end(&mut bytes));
    match read {
        Err(error) => Err((code::UNREADABLE, format!("expected a file, got: {error}"))),
        Ok(length) if length as u64 > most => Err((code::TOO_LONG, format!("expected at most {most} bytes"))),
        Ok(_) => Ok(bytes),
    }
}

/// Reads a text file of limited length.
///
/// # Errors
/// It cannot be read, is longer than `most` bytes, or is not UTF-8, with the place of the first byte that is none.
pub fn read_file(path: &Path, most: u64) -> Result<String, Findings> {
    let mut findings = Findings::default();
    match read_bytes(path, most) {
        Err((code, expected)) => findings.push_file(code, path, expected),
        Ok(bytes) if kind(&bytes).is_some() => {
            let [what, help] = kind(&bytes).unwrap_or_default();
            let problem = Problem::new(code::NOT_UTF8, 0..0).title("the file is not a text");
            let problem = problem.expected(format!("expected a text, got {what}")).help(help);
            findings.push(&Source::new(&path.display().to_string(), ""), problem);
        }
        Ok(bytes) => match String::from_utf8(bytes) {
            Ok(text) => return Ok(text),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                let byte = error.as_bytes().get(at).copied().unwrap_or_default();
                let text = String::from_utf8_lossy(error.as_bytes());
                let problem = Problem::new(code::NOT_UTF8, at..at + '\u{FFFD}'.len_utf8());
                let problem = problem.expected(format!("expected UTF-8, got the byte {byte:#04x}"));
                findings.push(&Source::new(&path.display().to_string(), &text), problem);
            }
        },
    }
    Err(findings)
}

/// What a file is that begins with these bytes and is no text, and what reads it.
fn kind(bytes: &[u8]) -> Option<[&'static str; 2]> {
    const RECORDING: [&str; 2] =
        ["a recording", "`axisbridge decode` and `axisbridge translate` read recordings"];
    match bytes {
        [0x0A, 0x0D, 0x0D, 0x0A, ..]
        | [0xD4 | 0x4D, 0xC3 | 0x3C, 0xB2, 0xA1, ..]
        | [0xA1, 0xB2, 0xC3 | 0x3C, 0xD4 | 0x4D, ..] => Some(RECORDING),
        [0x1F, 0x8B, ..] | [b'P', b'K', 3, 4, ..] => Some(["a compressed file", "unpack it first"]),
        _ if bytes.iter().take(1_000).any(|byte| *byte == 0) => Some(["a binary file", ""]),
        _ => None,
    }
}
