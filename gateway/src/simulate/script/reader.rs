//! Reading of TOML tables key by key, with a problem at its place for whatever is wrong.

use std::cell::RefCell;
use std::fmt::Display;
use std::ops::{Range, RangeInclusive};

use profile_generic::time::DurationNs;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::attributes::nearest;
use crate::config::duration;
use crate::finding::{Findings, Problem, Source, registry as code, tree};

/// A value with its place.
pub(in crate::simulate) type Value<'t> = Spanned<DeValue<'t>>;

/// Where problems are collected, so that one look at a file finds them all.
#[derive(Debug, Default)]
pub(in crate::simulate) struct Problems(RefCell<Vec<Problem>>);

impl Problems {
    /// Adds one; `None`, so that it can be returned.
    pub fn report<T>(&self, span: Range<usize>, title: impl Display, expected: impl Display) -> Option<T> {
        let problem = Problem::new(code::SCRIPT, span).title(title.to_string());
        self.0.borrow_mut().push(problem.expected(expected.to_string()));
        None
    }

    /// What was found, in the order of the file.
    pub fn take(self) -> Vec<Problem> {
        self.0.into_inner()
    }
}

/// What `read` makes of the text of a script; `name` stands in the errors.
///
/// # Errors
/// Every fault found, of the syntax and by `read`. What stands behind a fault of the syntax may be read wrongly.
pub(in crate::simulate) fn parsed<T>(
    source: &str,
    name: &str,
    read: impl FnOnce(&DeTable<'_>, &Problems) -> Option<T>,
) -> Result<T, Findings> {
    let mut findings = Findings::default();
    let text = Source::new(name, source);
    let problems = Problems::default();
    let script = tree(source, &text, &mut findings).and_then(|table| read(table.get_ref(), &problems));
    problems.take().into_iter().for_each(|problem| findings.push(&text, problem));
    match script {
        Some(script) if findings.is_empty() => Ok(script),
        _ => Err(findings),
    }
}

/// What a script is about, if it says so.
pub(in crate::simulate) fn title(keys: &mut Keys<'_, '_>) -> Option<Option<String>> {
    let Some(value) = keys.find("title") else { return Some(None) };
    match value.get_ref().as_str() {
        Some(title) => Some(Some(title.to_owned())),
        None => wrong(value, "title", "a string", keys.problems),
    }
}

/// The one verb of a step, and its arguments. `modifiers` are the keys of a step that are none; `expected` is said of a second verb.
pub(in crate::simulate) fn verb<'a, 't, R>(
    value: &Value<'_>,
    keys: &mut Keys<'a, 't>,
    verbs: &'static [(&'static str, R)],
    modifiers: &[&str],
    expected: &str,
) -> Option<(&'static R, &'a Value<'t>)> {
    let mut found: Option<(&(&'static str, R), &Value<'_>)> = None;
    for (name, place, arguments) in keys.keys() {
        let Some(verb) = verbs.iter().find(|(known, _)| *known == name) else { continue };
        if let Some(((first, _), _)) = found.replace((verb, arguments)) {
            let title = format_args!("`{name}` is a second verb besides `{first}`");
            return keys.problems.report(place, title, expected);
        }
        keys.find(verb.0);
    }
    if let Some(((_, read), arguments)) = found {
        return Some((read, arguments));
    }
    let expected = "expected a verb, such as enable or move";
    match keys.keys().find(|(name, ..)| !modifiers.contains(name)) {
        Some((name, place, _)) => {
            let near = nearest(name, verbs.iter().map(|(name, _)| *name));
            let hint = near.map_or_else(|| expected.to_owned(), |near| format!("did you mean `{near}`?"));
            keys.problems.report(place, format_args!("`{name}` is no step"), hint)
        }
        None => {
            let title = format!("the step is {} without a verb", kind(value.get_ref()));
            keys.problems.report(value.span(), title, expected)
        }
    }
}

/// What kind of value this is, for people.
pub(in crate::simulate) fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

/// A table whose keys are taken one after the other; what nobody has taken is an unknown key.
pub(in crate::simulate) struct Keys<'a, 't> {
    what: &'a str,
    table: &'a DeTable<'t>,
    span: Range<usize>,
    taken: Vec<&'static str>,
    pub problems: &'a Problems,
}

/// The table in a value.
pub(in crate::simulate) fn table<'a, 't>(
    value: &'a Value<'t>,
    what: &'a str,
    problems: &'a Problems,
) -> Option<Keys<'a, 't>> {
    match value.get_ref() {
        DeValue::Table(table) => Some(Keys::new(what, table, value.span(), problems)),
        other => problems.report(
            value.span(),
            format_args!("{what} is {}", kind(other)),
            "expected a table such as { axis = 1 }",
        ),
    }
}

/// Tells a value that is of the wrong kind or has no meaning.
pub(in crate::simulate) fn wrong<T>(
    value: &Value<'_>,
    key: &str,
    expected: impl Display,
    problems: &Problems,
) -> Option<T> {
    let title = match value.get_ref() {
        DeValue::String(text) => format!("`{key}` is \"{text}\""),
        DeValue::Integer(number) => format!("`{key}` is {number}"),
        DeValue::Float(number) => format!("`{key}` is {number}"),
        DeValue::Boolean(value) => format!("`{key}` is {value}"),
        other => format!("`{key}` is {}", kind(other)),
    };
    problems.report(value.span(), title, format_args!("expected {expected}"))
}

/// A whole number as it is written, in any radix.
pub(in crate::simulate) fn whole(value: &Value<'_>) -> Option<i128> {
    let integer = value.get_ref().as_integer()?;
    i128::from_str_radix(integer.as_str(), integer.radix()).ok()
}

/// A number; whole ones count too.
pub(in crate::simulate) fn number(value: &Value<'_>) -> Option<f64> {
    match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok(),
        // Decimal digits give the nearest number; other radixes only say small ones.
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
        DeValue::Integer(_) => whole(value).and_then(|value| i32::try_from(value).ok()).map(f64::from),
        _ => None,
    }
}

/// A list of words, each from the set.
pub(in crate::simulate) fn words<T: Copy>(
    value: &Value<'_>,
    key: &str,
    set: &[(&str, T)],
    problems: &Problems,
) -> Option<Vec<T>> {
    let DeValue::Array(items) = value.get_ref() else {
        return wrong(value, key, "a list of names", problems);
    };
    // All of them are looked at before the first bad one decides.
    let found: Vec<Option<T>> = items.iter().map(|item| word_of(item, key, set, problems)).collect();
    found.into_iter().collect()
}

/// Letters and digits alone, in small letters: how names are compared. Where signs stand side by side, as in the names
/// of marker events, they count as well.
pub(in crate::simulate) fn folded(name: &str) -> String {
    let is_sign = |c: Option<&char>| matches!(c, Some('+' | '-'));
    let letters: Vec<char> = name.chars().collect();
    let mut folded = String::with_capacity(name.len());
    for (at, letter) in letters.iter().enumerate() {
        let beside =
            is_sign(letters.get(at + 1)) || at.checked_sub(1).is_some_and(|at| is_sign(letters.get(at)));
        if letter.is_alphanumeric() || (is_sign(Some(letter)) && beside) {
            folded.push(letter.to_ascii_lowercase());
        }
    }
    folded
}

/// A word from the set; spelling differs in capitals, blanks and dashes at will.
pub(in crate::simulate) fn word_of<T: Copy>(
    value: &Value<'_>,
    key: &str,
    set: &[(&str, T)],
    problems: &Problems,
) -> Option<T> {
    let names = || set.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let DeValue::String(text) = value.get_ref() else {
        return wrong(value, key, format_args!("one of {}", names()), problems);
    };
    let found = set.iter().find(|(name, _)| folded(name) == folded(text));
    match found {
        Some((_, word)) => Some(*word),
        None => problems.report(
            value.span(),
            format_args!("`{text}` is no {}", key.replace('_', " ")),
            format_args!("expected one of {}", names()),
        ),
    }
}

impl<'a, 't> Keys<'a, 't> {
    pub fn new(what: &'a str, table: &'a DeTable<'t>, span: Range<usize>, problems: &'a Problems) -> Self {
        Self { what, table, span, taken: Vec::new(), problems }
    }

    /// Place of the whole table.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// Keys that are there, with their places, in the order of the file.
    pub fn keys(&self) -> impl Iterator<Item = (&'a str, Range<usize>, &'a Value<'t>)> + use<'a, 't> {
        let mut keys: Vec<_> =
            self.table.iter().map(|(key, value)| (key.get_ref().as_ref(), key.span(), value)).collect();
        keys.sort_by_key(|(_, span, _)| span.start);
        keys.into_iter()
    }

    /// The value of a key, if it is there.
    pub fn find(&mut self, key: &'static str) -> Option<&'a Value<'t>> {
        self.taken.push(key);
        self.table.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value)
    }

    /// The value of a key that has to be there.
    pub fn need(&mut self, key: &'static str) -> Option<&'a Value<'t>> {
        let found = self.find(key);
        if found.is_none() {
            return self.problems.report(
                self.span(),
                format_args!("missing key `{key}` in {}", self.what),
                format_args!("expected the key `{key}` in this table"),
            );
        }
        found
    }

    /// Reports the keys that nobody has taken; `None` if there is one.
    pub fn finish(self) -> Option<()> {
        let mut good = Some(());
        for (key, span, _) in self.keys() {
            if !self.taken.contains(&key) {
                let known: Vec<_> = self.taken.iter().map(|key| format!("`{key}`")).collect();
                good = self.problems.report(
                    span,
                    format_args!("unknown key `{key}` in {}", self.what),
                    format_args!("expected one of {}", known.join(", ")),
                );
            }
        }
        good
    }

    /// A number that is finite; the default where the key is not there.
    pub fn number_or(&mut self, key: &'static str, default: Option<f64>) -> Option<f64> {
        match (self.find(key), default) {
            (Some(value), _) => self.finite(key, value),
            (None, Some(default)) => Some(default),
            (None, None) => self.need(key).and(None),
        }
    }

    /// A number that has to be there.
    pub fn number(&mut self, key: &'static str) -> Option<f64> {
        self.number_or(key, None)
    }

    /// A number that may be there: `Some(None)` if it is not, `None` after a problem.
    #[expect(clippy::option_option, reason = "absent is not wrong")]
    pub fn maybe_number(&mut self, key: &'static str) -> Option<Option<f64>> {
        match self.find(key) {
            Some(value) => self.finite(key, value).map(Some),
            None => Some(None),
        }
    }

    pub fn finite(&self, key: &str, value: &Value<'_>) -> Option<f64> {
        match number(value) {
            Some(number) if number.is_finite() => Some(number),
            Some(number) => self.problems.report(
                value.span(),
                format_args!("`{key}` is {number}"),
                "expected a finite number",
            ),
            None => wrong(value, key, "a number", self.problems),
        }
    }

    /// A whole number in a range.
    pub fn integer<T: TryFrom<i128>>(&mut self, key: &'static str, range: RangeInclusive<i128>) -> Option<T> {
        let value = self.need(key)?;
        self.in_range(key, value, &range)
    }

    /// A whole number in a range; the default where the key is not there.
    pub fn integer_or<T: TryFrom<i128>>(
        &mut self,
        key: &'static str,
        range: RangeInclusive<i128>,
        default: T,
    ) -> Option<T> {
        match self.find(key) {
            Some(value) => self.in_range(key, value, &range),
            None => Some(default),
        }
    }

    pub fn in_range<T: TryFrom<i128>>(
        &self,
        key: &str,
        value: &Value<'_>,
        range: &RangeInclusive<i128>,
    ) -> Option<T> {
        let expected = format!("a whole number from {} to {}", range.start(), range.end());
        let Some(number) = whole(value) else { return wrong(value, key, expected, self.problems) };
        match T::try_from(number) {
            Ok(found) if range.contains(&number) => Some(found),
            _ => self.problems.report(
                value.span(),
                format_args!("`{key}` is {number}"),
                format_args!("expected {expected}"),
            ),
        }
    }

    /// True or false; the default where the key is not there.
    pub fn boolean_or(&mut self, key: &'static str, default: bool) -> Option<bool> {
        match self.find(key) {
            Some(value) => match value.get_ref().as_bool() {
                Some(value) => Some(value),
                None => wrong(value, key, "true or false", self.problems),
            },
            None => Some(default),
        }
    }

    /// A time; the default where the key is not there.
    pub fn duration_or(&mut self, key: &'static str, default: DurationNs) -> Option<DurationNs> {
        match self.find(key) {
            Some(value) => time(value, key, self.problems),
            None => Some(default),
        }
    }

    /// A word from a set.
    pub fn word<T: Copy>(&mut self, key: &'static str, set: &[(&str, T)]) -> Option<T> {
        let value = self.need(key)?;
        word_of(value, key, set, self.problems)
    }

    /// A word from a set; the default where the key is not there.
    pub fn word_or<T: Copy>(&mut self, key: &'static str, set: &[(&str, T)], default: T) -> Option<T> {
        match self.find(key) {
            Some(value) => word_of(value, key, set, self.problems),
            None => Some(default),
        }
    }
}

/// A time with its unit.
pub(in crate::simulate) fn time(value: &Value<'_>, key: &str, problems: &Problems) -> Option<DurationNs> {
    let DeValue::String(text) = value.get_ref() else {
        return wrong(value, key, duration::EXPECTED, problems);
    };
    duration::parse(text).or_else(|| {
        let title = format!("`{text}` is not a time");
        problems.report(value.span(), title, format_args!("expected {}", duration::EXPECTED))
    })
}

/// Bytes in hex, with blanks at will.
pub(in crate::simulate) fn hex(value: &Value<'_>, key: &str, problems: &Problems) -> Option<Vec<u8>> {
    const EXPECTED: &str = "bytes in hex, such as \"01 00 B9 01\"";
    let DeValue::String(text) = value.get_ref() else { return wrong(value, key, EXPECTED, problems) };
    let digits: Vec<u32> =
        text.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_digit(16).unwrap_or(16)).collect();
    if !digits.len().is_multiple_of(2) || digits.contains(&16) {
        let expected = format_args!("expected {EXPECTED}");
        return problems.report(value.span(), format_args!("`{text}` is not in hex"), expected);
    }
    Some(digits.chunks(2).filter_map(|two| u8::try_from(two[0] * 16 + two[1]).ok()).collect())
}
