//! Turning the names of one file into what they name, and collecting what cannot be turned.

use std::ops::Range;

use crate::finding::Spanned;
use profile_generic::program::BitPattern;
use profile_generic::ratio::Ratio;

use super::dictionary::FieldValue;
use super::format::{FieldIs, FieldValueRow, Name, RatioRow};
use super::load::FORMAT;
use crate::finding::registry::{self as code, Code};
use crate::finding::{Findings, Problem, Source, closest};

/// Looks names up on behalf of one file and notes those that nothing has.
pub(super) struct Resolver<'a> {
    file: &'a Source,
    errors: &'a mut Findings,
}

/// A pattern over another one, whose bits count where the first has none.
pub(super) fn over(pattern: BitPattern, base: BitPattern) -> BitPattern {
    BitPattern::new(base.mask | pattern.mask, pattern.apply(base.value))
}

impl<'a> Resolver<'a> {
    pub fn new(file: &'a Source, errors: &'a mut Findings) -> Self {
        Self { file, errors }
    }

    /// The path of the file that a row stands in: the table itself, or what was laid over it.
    pub fn path_of(&self, name: &Name) -> &'a str {
        let (path, ..) = self.file.place(name.span().start);
        path
    }

    /// Whether something is wrong already, here or in another file.
    pub fn has_errors(&self) -> bool {
        self.errors.has_errors()
    }

    /// A reason is more than nothing.
    pub fn reason(&mut self, reason: &Name) {
        if reason.get_ref().trim().is_empty() {
            self.error(code::MISSING_KEY, reason.span(), "reason", "expected a reason, got none");
        }
    }

    /// Notes that the value at `span` is wrong.
    pub fn error(&mut self, code: Code, span: Range<usize>, key: &str, message: impl Into<String>) {
        self.errors.push(self.file, Problem::new(code, span).key(key).expected(message));
    }

    /// Notes that the value at `span` is wrong, and what to write.
    pub fn helped(
        &mut self,
        code: Code,
        span: Range<usize>,
        key: &str,
        message: impl Into<String>,
        help: &str,
    ) {
        self.errors.push(self.file, Problem::new(code, span).key(key).expected(message).help(help));
    }

    /// Notes that nothing defines the name that the value at `span` needs.
    pub fn lacks(
        &mut self,
        code: Code,
        span: Range<usize>,
        key: &str,
        name: &str,
        message: impl Into<String>,
    ) {
        self.errors.push(self.file, Problem::new(code, span).key(key).expected(message).lacks(name));
    }

    /// Checks the head of a file.
    pub fn head(&mut self, format: &Spanned<u32>, key: &str, title: &Name, expected: &str) {
        if *format.get_ref() != FORMAT {
            let message = format!("expected format {FORMAT}, got {}", format.get_ref());
            self.error(code::WRONG_HEAD, format.span(), "format", message);
        }
        self.same(code::WRONG_HEAD, key, title, expected);
    }

    /// Checks that a text is the only one that it can be.
    pub fn same(&mut self, code: Code, key: &str, text: &Name, expected: &str) {
        if text.get_ref() != expected {
            let message = format!("expected `{expected}`, got `{}`", text.get_ref());
            self.error(code, text.span(), key, message);
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
        let found = find(name.get_ref());
        if found.is_none() {
            self.unknown(code::UNKNOWN_NAME, key, name, what, known);
        }
        found
    }

    /// Notes that the dictionary does not have the IDN.
    pub fn unknown_idn<'n>(&mut self, key: &str, name: &Name, vendors: impl IntoIterator<Item = &'n str>) {
        let text = name.get_ref().as_str();
        let problem = Problem::new(code::UNKNOWN_NAME, name.span()).key(key).lacks(text);
        let problem = problem.expected(format!("expected an IDN of the dictionary, got {text}"));
        let near = closest(text, vendors).filter(|_| text.starts_with("P-"));
        let problem = problem.help(match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => "`axisbridge dictionary sercos` prints all; add one that the dictionary lacks as a row [[sercos-idns.idn]]"
                .to_owned(),
        });
        self.errors.push(self.file, problem);
    }

    /// Notes that nothing has the name.
    fn unknown<'n>(
        &mut self,
        code: Code,
        key: &str,
        name: &Name,
        what: &str,
        known: impl IntoIterator<Item = &'n str>,
    ) {
        let text = name.get_ref().as_str();
        let problem =
            Problem::new(code, name.span()).key(key).expected(format!("expected {what}, got `{text}`"));
        let problem = if code == code::UNKNOWN_NAME { problem.lacks(text) } else { problem };
        let problem = match closest(text, known) {
            Some(closest) => problem.help(format!("did you mean `{closest}`?")),
            None => problem,
        };
        self.errors.push(self.file, problem);
    }

    /// One of a few words.
    pub fn word<T: Copy>(&mut self, key: &str, name: &Name, words: &[(&str, T)]) -> Option<T> {
        let list: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        let what = format!("one of {}", list.join(", "));
        let found = words.iter().find(|(word, _)| word == name.get_ref()).map(|(_, value)| *value);
        if found.is_none() {
            self.unknown(code::UNKNOWN_WORD, key, name, &what, list.iter().copied());
        }
        found
    }

    /// A ratio above zero.
    pub fn ratio(&mut self, key: &str, row: &RatioRow) -> Option<Ratio> {
        let [num, den] = *row.get_ref();
        let ratio = Ratio::new(num, den).filter(|ratio| ratio.num() != 0);
        if ratio.is_none() {
            let message = format!("expected two whole numbers other than 0, got [{num}, {den}]");
            self.error(code::OUT_OF_RANGE, row.span(), key, message);
        }
        ratio
    }

    /// Mask and value of all `rows`, whose fields `find` knows as first and last bit, with their named values.
    pub fn pattern<'n, 'v>(
        &mut self,
        rows: &[FieldValueRow],
        find: impl Fn(&str) -> Option<((u32, u32), &'v [FieldValue])>,
        known: impl IntoIterator<Item = &'n str> + Clone,
    ) -> Option<BitPattern> {
        let mut pattern = BitPattern::new(0, 0);
        for row in rows {
            let ((low, high), values) =
                self.name("field", &row.field, "a field of the word", &find, known.clone())?;
            let width = high - low + 1;
            let field_mask = if width >= 32 { u32::MAX } else { (1 << width) - 1 };
            let is_named = matches!(row.is.get_ref(), FieldIs::Name(_));
            let value = match row.is.get_ref() {
                FieldIs::Number(number) => *number,
                FieldIs::Name(name) => {
                    let name = Spanned::new(row.is.span(), name.clone());
                    let names = values.iter().map(|value| value.name.as_str());
                    let find = |text: &str| values.iter().find(|value| value.name == text);
                    self.name("is", &name, "a number, or the name of a value of the field", find, names)?
                        .value
                }
            };
            if value & !field_mask != 0 {
                // What is wrong with a named value is told in the dictionary.
                if is_named {
                    return None;
                }
                let message = format!("expected 0 to {field_mask}, got {value}");
                self.error(code::FIELD_VALUE, row.is.span(), "is", message);
                return None;
            }
            pattern = BitPattern::new(pattern.mask | field_mask << low, pattern.value | value << low);
        }
        Some(pattern)
    }
}
