//! Collects what is wrong in a file.

use std::fmt::Display;
use std::ops::Range;

use crate::finding::registry::{self as code, Code};
use crate::finding::{Problem, Spanned, closest};

/// The problems found so far. Reporting one gives `None`, for functions that return nothing where a value cannot be used.
#[derive(Default)]
pub(super) struct Problems(Vec<Problem>);

impl Problems {
    /// What has been checked, if nothing is wrong.
    pub(super) fn done<T>(self, checked: Option<T>) -> Result<T, Vec<Problem>> {
        checked.filter(|_| self.0.is_empty()).ok_or(self.0)
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// A problem of more than one place.
    pub(super) fn push(&mut self, problem: Problem) {
        self.0.push(problem);
    }

    pub(super) fn report<T>(
        &mut self,
        span: Range<usize>,
        title: impl Display,
        expected: impl Display,
    ) -> Option<T> {
        self.report_as(code::CONFIG_VALUE, span, title, expected)
    }

    pub(super) fn report_as<T>(
        &mut self,
        code: Code,
        span: Range<usize>,
        title: impl Display,
        expected: impl Display,
    ) -> Option<T> {
        self.0.push(Problem::new(code, span).title(title.to_string()).expected(expected.to_string()));
        None
    }

    /// What to do about the last one.
    pub(super) fn help(&mut self, help: impl Into<String>) {
        if let Some(last) = self.0.last_mut() {
            last.help = help.into();
        }
    }

    pub(super) fn duplicate(&mut self, what: &str, first: Range<usize>, second: Range<usize>) {
        let problem = Problem::new(code::TWICE, second).title(format!("{what} is used twice"));
        self.0.push(problem.expected("expected one that is not used yet").related(first, "used here first"));
    }

    /// Reports every value that has come before.
    pub(super) fn unique<T: PartialEq + Display>(&mut self, what: &str, values: &[Spanned<T>]) {
        for (index, value) in values.iter().enumerate() {
            if let Some(first) = values[..index].iter().find(|earlier| earlier.get_ref() == value.get_ref()) {
                self.duplicate(&format!("{what} `{}`", value.get_ref()), first.span(), value.span());
            }
        }
    }

    pub(super) fn count<T>(&mut self, tables: &[Spanned<T>], what: &str, most: usize) {
        if let Some(excess) = tables.get(most) {
            self.report_as::<()>(
                code::TOO_MANY,
                excess.span(),
                format_args!("too many {what}: {}", tables.len()),
                format_args!("expected at most {most}"),
            );
        }
    }

    pub(super) fn unknown<'a>(
        &mut self,
        what: &str,
        name: &Spanned<String>,
        known: impl Iterator<Item = &'a String>,
    ) {
        let known: Vec<&str> = known.map(String::as_str).collect();
        let all: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
        let expected = match known.is_empty() {
            true => format!("expected one that is there: there is no {what}"),
            false => format!("expected one of {}", all.join(", ")),
        };
        let title = format!("there is no {what} `{}`", name.get_ref());
        let problem = Problem::new(code::CONFIG_REFERENCE, name.span()).title(title).expected(expected);
        let near = closest(name.get_ref(), known).map(|near| format!("did you mean `{near}`?"));
        self.0.push(problem.help(near.unwrap_or_default()));
    }
}
