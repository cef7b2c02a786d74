//! Faults in a configuration file, shown at their place.

use std::fmt;
use std::io;
use std::ops::Range;
use std::path::PathBuf;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use thiserror::Error;

use super::FILE_LEN_MAX;

/// A fault found while checking, by its place in the text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Problem {
    pub span: Range<usize>,
    pub title: String,
    pub expected: String,
    /// Another place that explains this one, and what is there.
    pub related: Option<(Range<usize>, String)>,
}

impl Problem {
    /// A fault of the syntax, of a type or of a key.
    pub fn from_toml(error: &toml::de::Error) -> Self {
        // The library says what it expected behind the last comma of its message, in words of the language.
        let message = error.message();
        let (title, expected) = match message.split_once(", expected ") {
            Some((title, "i64")) => (title, "expected a whole number".to_owned()),
            Some((title, "f64")) => (title, "expected a number".to_owned()),
            Some((title, expected)) => (title, format!("expected {expected}")),
            None => match message.strip_prefix("missing field ") {
                Some(key) => (message, format!("expected the key {key} in this table")),
                None => (message, String::new()),
            },
        };
        Self { span: error.span().unwrap_or(0..0), title: title.to_owned(), expected, related: None }
    }
}

/// A fault in a file, for programs; [`ConfigError`] shows it to people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub title: String,
    /// What was expected; empty where the title says it all.
    pub expected: String,
}

/// Why there is no configuration.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The file is far too long for a configuration.
    #[error("{} has {length} bytes, expected a configuration of at most {FILE_LEN_MAX}", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Its length.
        length: u64,
    },
    /// The file has faults.
    #[error("{report}")]
    Invalid {
        /// Every fault with its lines of the file, as plain text.
        report: Report,
        /// The same for programs.
        diagnostics: Vec<Diagnostic>,
    },
}

/// Faults as text with the lines of the file they are in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report(String);

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl ConfigError {
    pub(super) fn invalid(source: &str, name: &str, problems: Vec<Problem>) -> Self {
        let (report, diagnostics) = diagnose(source, name, problems);
        Self::Invalid { report, diagnostics }
    }

    /// The faults of the file; empty when it could not be read at all.
    #[must_use]
    pub fn diagnostics(&self) -> &[Diagnostic] {
        match self {
            Self::Invalid { diagnostics, .. } => diagnostics,
            _ => &[],
        }
    }
}

/// Shows the faults of a file in their order, to people and to programs.
pub(crate) fn diagnose(source: &str, name: &str, mut problems: Vec<Problem>) -> (Report, Vec<Diagnostic>) {
    problems.sort_by_key(|problem| problem.span.start);
    let rendered: Vec<String> = problems.iter().map(|problem| render(source, name, problem)).collect();
    let diagnostics = problems
        .into_iter()
        .map(|problem| {
            let (line, column) = place(source, problem.span.start);
            Diagnostic { line, column, title: problem.title, expected: problem.expected }
        })
        .collect();
    (Report(rendered.join("\n\n")), diagnostics)
}

fn render(source: &str, name: &str, problem: &Problem) -> String {
    let primary = AnnotationKind::Primary.span(clip(source, &problem.span));
    let primary =
        if problem.expected.is_empty() { primary } else { primary.label(problem.expected.as_str()) };
    let mut snippet = Snippet::source(source).path(name).annotation(primary);
    if let Some((span, text)) = &problem.related {
        snippet = snippet.annotation(AnnotationKind::Context.span(clip(source, span)).label(text.as_str()));
    }
    let group = Group::with_title(Level::ERROR.primary_title(problem.title.as_str())).element(snippet);
    Renderer::plain().render(&[group])
}

/// Within the text, and of one line: a span over a whole table is shown by its first line.
fn clip(source: &str, span: &Range<usize>) -> Range<usize> {
    let start = span.start.min(source.len());
    let end = span.end.clamp(start, source.len());
    let first_line = source[start..end].find('\n').map_or(end, |length| start + length);
    start..first_line
}

fn place(source: &str, offset: usize) -> (usize, usize) {
    let before = &source[..offset.min(source.len())];
    let line = before.matches('\n').count() + 1;
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    (line, before[line_start..].chars().count() + 1)
}
