//! The texts that findings point into.

use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

/// One or more files whose texts are counted through: a span of the second begins where the first ends. So the rows
/// of a table and of what is laid over it can stand side by side and still be shown where they come from.
#[derive(Debug, Clone)]
pub struct Source {
    parts: Vec<Part>,
    /// Values that a row laid over the others has taken away or replaced, and the place of that row.
    losses: Vec<(Range<usize>, Range<usize>)>,
}

/// One file of a [`Source`].
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub path: Arc<str>,
    pub text: Arc<str>,
    /// Where it begins in the count.
    start: usize,
    /// Where each line begins in the text.
    lines: Vec<usize>,
}

/// A place in one of the files.
pub(super) struct Place<'s> {
    pub part: &'s Part,
    /// Within the text of the part and of one line: a span over a whole table is shown by its first line.
    pub span: Range<usize>,
    /// Line, 1 first.
    pub line: usize,
    /// Column in characters, 1 first.
    pub column: usize,
}

impl Source {
    /// A single file.
    #[must_use]
    pub fn new(path: &str, text: &str) -> Self {
        let mut source = Self { parts: Vec::new(), losses: Vec::new() };
        source.push(path.into(), text.into());
        source
    }

    /// Adds a file and returns where its spans begin.
    pub fn push(&mut self, path: Arc<str>, text: Arc<str>) -> usize {
        // One more than the length, so that the end of a file is not the begin of the next.
        let start = self.parts.last().map_or(0, |part| part.start + part.text.len() + 1);
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        self.parts.push(Part { path, text, start, lines });
        start
    }

    /// The text of the first file; `None` where there is no file.
    #[must_use]
    pub fn first(&self) -> Option<Arc<str>> {
        self.parts.first().map(|part| Arc::clone(&part.text))
    }

    /// The path of the first file.
    #[must_use]
    pub fn path(&self) -> &str {
        self.parts.first().map_or("", |part| &part.path)
    }

    /// File, line and column (both from 1) of an offset.
    #[must_use]
    pub fn place(&self, offset: usize) -> (&str, usize, usize) {
        self.locate(&(offset..offset))
            .map_or(("", 0, 0), |place| (&place.part.path, place.line, place.column))
    }

    /// What stands in a line of the first file from a column on, both from 1.
    pub fn rest_of_line(&self, line: usize, column: usize) -> Option<Range<usize>> {
        let part = self.parts.first()?;
        let whole = (1..=part.lines.len()).contains(&line).then(|| part.line(line))?;
        let before = part.text[whole.clone()].char_indices().nth(column.saturating_sub(1));
        Some(before.map_or(whole.end, |(at, _)| whole.start + at)..whole.end)
    }

    /// The first line of the first file that is the wanted one.
    pub fn find_line(&self, wanted: impl Fn(&str) -> bool) -> Option<Range<usize>> {
        let part = self.parts.first()?;
        (1..=part.lines.len()).map(|line| part.line(line)).find(|line| wanted(&part.text[line.clone()]))
    }

    /// A line (1 first) of the file with this path, without its indentation; the last such file, as the ones laid over others are.
    #[must_use]
    pub fn line_of(&self, path: &str, line: usize) -> Option<Range<usize>> {
        let part = self
            .parts
            .iter()
            .rfind(|part| &*part.path == path)
            .filter(|part| (1..=part.lines.len()).contains(&line))?;
        let whole = part.line(line);
        let text = &part.text[whole.clone()];
        let start = whole.start + text.len() - text.trim_start().len();
        Some(part.start + start..part.start + whole.end)
    }

    /// The reason for which a row is accepted as it is: `# accept: reason` in one of its lines, or in the comment above it.
    #[must_use]
    pub fn accepts(&self, span: &Range<usize>) -> Option<&str> {
        let place = self.locate(span)?;
        let line = |at: usize| &place.part.text[place.part.line(at)];
        let rows = place.row();
        let mut first = *rows.start();
        while first > 1 && line(first - 1).trim_start().starts_with('#') {
            first -= 1;
        }
        (first..=*rows.end())
            .filter_map(|at| line(at).split_once("# accept:"))
            .map(|(_, reason)| reason.trim())
            .find(|reason| !reason.is_empty())
    }

    /// Keeps which values rows that were laid over others have taken away or replaced, each with the place of that row.
    pub(crate) fn lose(&mut self, losses: Vec<(Range<usize>, Range<usize>)>) {
        self.losses.extend(losses);
    }

    /// The reason for which a row that was laid over these texts took a value of `other` away. A value that several rows had in common
    /// went for a reason if each of them did.
    #[must_use]
    pub fn accepts_loss(&self, other: &Self, span: &Range<usize>) -> Option<&str> {
        let lost = other.locate(span)?;
        let is_same = |place: Place<'_>| place.part.path == lost.part.path && place.span == lost.span;
        let mut reasons = self
            .losses
            .iter()
            .filter(|(value, _)| self.locate(value).is_some_and(is_same))
            .map(|(_, row)| self.accepts(row));
        let first = reasons.next()??;
        reasons.all(|reason| reason.is_some()).then_some(first)
    }

    /// The text of a place, as far as it lies in one line.
    #[must_use]
    pub fn slice(&self, span: &Range<usize>) -> &str {
        self.locate(span).map_or("", |place| &place.part.text[place.span])
    }

    /// What stands in the line of a place before it, and from it on.
    pub(super) fn line_around(&self, at: usize) -> (&str, &str) {
        self.locate(&(at..at)).map_or(("", ""), |place| {
            let line = place.part.line(place.line);
            (&place.part.text[line.start..place.span.start], &place.part.text[place.span.start..line.end])
        })
    }

    pub(super) fn locate(&self, span: &Range<usize>) -> Option<Place<'_>> {
        let at = self.parts.partition_point(|part| part.start <= span.start).checked_sub(1)?;
        let part = &self.parts[at];
        let start = floor(&part.text, span.start - part.start);
        let end = floor(&part.text, span.end.saturating_sub(part.start).max(start));
        let line = part.lines.partition_point(|begin| *begin <= start);
        let begin = part.lines[line - 1];
        let line_end = part.line(line).end;
        let span = start..end.min(line_end).max(start);
        Some(Place { part, span, line, column: part.text[begin..start].chars().count() + 1 })
    }
}

impl Place<'_> {
    /// The lines (1 first) of the row that the place is in: a line of a list, or the lines from a head to the next one.
    pub fn row(&self) -> RangeInclusive<usize> {
        let line = |at: usize| &self.part.text[self.part.line(at)];
        let begins = |at: usize| line(at).trim_start().starts_with(['{', '[']);
        let mut first = self.line;
        while first > 1 && !begins(first) && !line(first - 1).trim().is_empty() {
            first -= 1;
        }
        let mut last = self.line;
        let alone = line(first).trim_start().starts_with('{');
        while !alone && last < self.part.lines.len() && !begins(last + 1) && !line(last + 1).trim().is_empty()
        {
            last += 1;
        }
        first..=last
    }
}

impl Part {
    /// Where a line (1 first) lies, without its end of line.
    pub fn line(&self, line: usize) -> Range<usize> {
        let begin = self.lines[line - 1];
        let end = self.lines.get(line).map_or(self.text.len(), |next| next - 1);
        begin..end
    }
}

/// The next place at or before `offset` where a character begins.
fn floor(text: &str, offset: usize) -> usize {
    let mut at = offset.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_accepted_beside_it() {
        let text = "rows = [\n  # accept: above\n  { a = 1 },\n  { b = 1 }, # accept: at its end\n  { c = 1 },\n]\n\n\
            [[x]]\nd = 1\n# accept: inside\n\n[[y]]\ne = 1 # accept:\n";
        let source = Source::new("folder/a.toml", text);
        let reason = |line| source.accepts(&source.line_of("folder/a.toml", line).unwrap());
        assert_eq!(
            [3, 4, 5, 9, 12].map(reason),
            [Some("above"), Some("at its end"), None, Some("inside"), None]
        );
        assert_eq!(source.line_of("folder/a.toml", 99), None);
        assert_eq!(source.line_of("other/a.toml", 1), None);
    }

    #[test]
    fn spans_are_found_in_the_file_they_belong_to() {
        let mut source = Source::new("a", "one\ntwo");
        let second = source.push("b".into(), "\u{b5}x\nthree\n".into());
        assert_eq!(second, 8);
        assert_eq!(source.place(4), ("a", 2, 1));
        assert_eq!(source.place(7), ("a", 2, 4));
        assert_eq!(source.place(second), ("b", 1, 1));
        // The second byte of a letter is that letter.
        assert_eq!(source.place(second + 1), ("b", 1, 1));
        assert_eq!(source.place(second + 2), ("b", 1, 2));
        assert_eq!(source.place(second + 4), ("b", 2, 1));
        assert_eq!(source.place(second + 1_000), ("b", 3, 1));
        let place = source.locate(&(second + 4..second + 99)).unwrap();
        assert_eq!(&place.part.text[place.span], "three");
    }
}
