//! One file of frames, with what it is compared with.

use std::fmt;
use std::path::{Path, PathBuf};

use similar::{DiffOp, TextDiff};

use super::GOLDEN;
use crate::cli::CliError;
use crate::translate::Counts;

/// Lines around a difference.
const CONTEXT: usize = 3;

/// Facts that are named of a difference.
const FACTS_MAX: usize = 20;

/// How a line begins that says why something was not translated.
const ERROR: &str = "error: ";

/// What a comparison has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    Same,
    Differs,
    New,
    /// The golden text has no frames any more.
    Orphaned,
}

/// A value that is not what it was.
#[derive(Debug, PartialEq, Eq)]
pub struct Fact {
    /// The rows that made it, with file and line.
    pub rows: String,
    /// What it is now.
    pub now: String,
    /// What it was, where a line stands in its place.
    pub was: Option<String>,
}

/// A file of frames.
#[derive(Debug)]
pub struct Case {
    pub file: PathBuf,
    pub status: Status,
    pub counts: Counts,
    /// The difference as a patch has it.
    pub diff: String,
    pub facts: Vec<Fact>,
    /// It should have been accepted, and was not.
    pub refused: bool,
    /// It was accepted.
    accepted: bool,
    golden: PathBuf,
    found: String,
    /// The same text with the lines of rows.
    rows: Option<String>,
    /// Errors in the golden text.
    known_errors: usize,
}

impl Case {
    pub fn new(file: &Path, found: String, rows: Option<&str>, counts: Counts) -> Self {
        Self {
            file: file.to_owned(),
            status: Status::New,
            counts,
            diff: String::new(),
            facts: Vec::new(),
            refused: false,
            accepted: false,
            golden: file.with_extension(GOLDEN),
            found,
            rows: rows.map(str::to_owned),
            known_errors: 0,
        }
    }

    /// A golden text without frames.
    pub fn orphan(golden: &Path) -> Self {
        let case = Self::new(golden, String::new(), None, Counts::default());
        Self { status: Status::Orphaned, ..case }
    }

    /// Compares with the golden text.
    pub fn compare(&mut self) -> Result<(), CliError> {
        let expected = match std::fs::read_to_string(&self.golden) {
            Ok(expected) => expected,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(format!("{}: {error}", self.golden.display()).into()),
        };
        self.compare_with(&expected);
        Ok(())
    }

    fn compare_with(&mut self, expected: &str) {
        self.known_errors = errors(expected);
        if expected == self.found {
            self.status = Status::Same;
            return;
        }
        self.status = Status::Differs;
        let diff = TextDiff::from_lines(expected, self.found.as_str());
        let golden = self.golden.display().to_string();
        self.diff = diff.unified_diff().context_radius(CONTEXT).header(&golden, "as it is now").to_string();
        let (old, rows): (Vec<&str>, Vec<&str>) =
            (expected.lines().collect(), self.rows.iter().flat_map(|rows| rows.lines()).collect());
        for op in diff.ops().iter().filter(|op| !matches!(op, DiffOp::Equal { .. })) {
            let (before, after) = (op.old_range(), op.new_range());
            let paired = before.len() == after.len();
            for (place, line) in after.clone().enumerate() {
                let Some((now, made_by)) = rows.get(line).and_then(|line| line.split_once("  <- ")) else {
                    continue;
                };
                let was = old.get(before.start + place).filter(|_| paired);
                let was = was.map(|was| was.split("  <- ").next().unwrap_or_default().trim().to_owned());
                if self.facts.len() < FACTS_MAX {
                    self.facts.push(Fact { rows: made_by.to_owned(), now: now.trim().to_owned(), was });
                }
            }
        }
    }

    /// Whether something was not translated that was not known to be faulty.
    fn is_untranslated(&self) -> bool {
        !matches!(self.status, Status::Orphaned | Status::Same)
            && (self.counts.translated == 0 && self.counts.passed_over > 0
                || errors(&self.found) > self.known_errors)
    }

    /// Makes what was found the golden text.
    pub fn accept(&mut self, with_errors: bool) -> Result<(), CliError> {
        if self.is_untranslated() && !with_errors {
            self.refused = true;
            return Ok(());
        }
        let failed = |error| format!("{}: {error}", self.golden.display());
        match self.status {
            Status::Same => {}
            Status::Differs | Status::New => std::fs::write(&self.golden, &self.found).map_err(failed)?,
            Status::Orphaned => std::fs::remove_file(&self.golden).map_err(failed)?,
        }
        self.accepted = true;
        Ok(())
    }

    /// Whether there is nothing to be done.
    pub fn is_fine(&self) -> bool {
        !self.refused && (self.accepted || self.status == Status::Same)
    }

    /// What is wrong, in a line.
    pub fn message(&self) -> String {
        let file = self.file.display();
        match self.status {
            Status::Same => format!("{file}: the same"),
            Status::Differs => format!("{file}: differs from {}", self.golden.display()),
            Status::New => format!("{file}: no {} yet", self.golden.display()),
            Status::Orphaned => format!("{file}: it has no frames any more"),
        }
    }

    /// The difference for people.
    pub fn write(&self, out: &mut dyn fmt::Write) -> fmt::Result {
        match self.status {
            Status::Same => return Ok(()),
            Status::Differs => write!(out, "{}", self.diff)?,
            Status::New | Status::Orphaned => writeln!(out, "{}", self.message())?,
        }
        self.facts.iter().try_for_each(|fact| writeln!(out, "{fact}"))
    }
}

/// `generic-sercos.toml:12 [[signal]] position_command: now ..., was ...`
impl fmt::Display for Fact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: now {}", self.rows, self.now)?;
        self.was.as_ref().map_or(Ok(()), |was| write!(f, ", was {was}"))
    }
}

/// Lines that say that something was not translated.
fn errors(text: &str) -> usize {
    text.lines().filter(|line| line.trim_start().starts_with(ERROR) || line.contains(": error: ")).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Counts = Counts { translated: 2, passed_over: 0, failed: 0 };

    fn case(found: &str, rows: &str, counts: Counts) -> Case {
        Case::new(Path::new("moves.hex"), found.to_owned(), Some(rows), counts)
    }

    #[test]
    fn a_difference_names_row_and_fact() {
        let found = "line 1\n  S-0-0047: 2 -> b  <- [[signal]] position\n";
        let rows = "line 1\n  S-0-0047: 2 -> b  <- generic-sercos.toml:12 [[signal]] position\n";
        let mut case = case(found, rows, GOOD);
        case.compare_with("line 1\n  S-0-0047: 1 -> a  <- [[signal]] position\n");
        assert_eq!(case.status, Status::Differs);
        let facts: Vec<_> = case.facts.iter().map(ToString::to_string).collect();
        assert_eq!(
            facts,
            ["generic-sercos.toml:12 [[signal]] position: now S-0-0047: 2 -> b, was S-0-0047: 1 -> a"]
        );
        assert!(case.diff.contains("-  S-0-0047: 1 -> a"), "{}", case.diff);
        assert!(!case.is_fine());
    }

    #[test]
    fn what_was_not_translated_is_not_accepted_unless_it_was_before() {
        let failed = Counts { failed: 1, ..GOOD };
        let text = "line 1\n  error: bad\n";
        let mut new = case(text, text, failed);
        new.accept(false).unwrap();
        assert!(new.refused && !new.is_fine());
        // The line is meant to be faulty: its error is part of the golden text.
        let mut known = case(text, text, failed);
        known.compare_with(text);
        known.accept(false).unwrap();
        assert!(!known.refused && known.is_fine());
        let mut nothing =
            case("5 frames carry nothing to translate\n", "", Counts { passed_over: 5, ..Counts::default() });
        nothing.accept(false).unwrap();
        assert!(nothing.refused);
        // Once accepted there is nothing to be written.
        let text = "5 frames carry nothing to translate\n";
        let mut known = case(text, "", Counts { passed_over: 5, ..Counts::default() });
        known.compare_with(text);
        known.accept(false).unwrap();
        assert!(!known.refused && known.is_fine());
        let mut worse = case("line 1\n  error: bad\n  error: worse\n", "", failed);
        worse.compare_with(text);
        worse.accept(false).unwrap();
        assert!(worse.refused);
    }
}
