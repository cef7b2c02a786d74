//! A finding as text, with the line it was found in.

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use super::consequences::Origin;
use super::source::Place;
use super::{Finding, Problem, Related, Severity, Source};

/// A line with more bytes is not shown, only named.
const LINE_MAX: usize = 1_000;

pub(super) fn finding(source: &Source, problem: Problem) -> Finding {
    let title = problem.full_title();
    let Some(place) = source.locate(&problem.span) else {
        return bare(source.path(), problem, title);
    };
    if place.part.text.is_empty() {
        return bare(&place.part.path, problem, title);
    }
    let related =
        problem.related.as_ref().and_then(|(span, text)| Some((source.locate(span)?, text.as_str())));
    let [rendered, styled] = show(&problem, &title, &place, related.as_ref());
    Finding {
        code: problem.code,
        file: place.part.path.to_string(),
        line: place.line,
        column: place.column,
        length: place.part.text[place.span.clone()].chars().count(),
        key: problem.key,
        title,
        expected: problem.expected,
        help: problem.help,
        related: related.map(|(place, text)| Related {
            file: place.part.path.to_string(),
            line: place.line,
            column: place.column,
            text: text.to_owned(),
        }),
        origin: Origin::new(&place, problem.about, problem.lacks),
        rendered,
        styled,
    }
}

/// What concerns a file as a whole.
fn bare(path: &str, problem: Problem, title: String) -> Finding {
    let mut rendered = format!("{}[{}]: {title}\n --> {path}", problem.code.severity(), problem.code);
    for (word, text) in [("", &problem.expected), ("help: ", &problem.help)] {
        if !text.is_empty() {
            rendered.push_str(&format!("\n  = {word}{text}"));
        }
    }
    Finding {
        code: problem.code,
        file: path.to_owned(),
        line: 0,
        column: 0,
        length: 0,
        key: problem.key,
        title,
        expected: problem.expected,
        help: problem.help,
        related: None,
        origin: Origin::default(),
        styled: rendered.clone(),
        rendered,
    }
}

/// The finding without and with colours.
fn show(
    problem: &Problem,
    title: &str,
    place: &Place<'_>,
    related: Option<&(Place<'_>, &str)>,
) -> [String; 2] {
    let level = match problem.code.severity() {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    };
    let code = problem.code.to_string();
    let title = level.primary_title(title).id(code.as_str());
    // Another place in the same file is shown in the same piece.
    let (beside, apart) = match related {
        Some(related) if std::ptr::eq(related.0.part, place.part) => (Some(related), None),
        other => (None, other),
    };
    let mut group = Group::with_title(title).element(snippet(place, &problem.expected, beside));
    if let Some((other, text)) = apart {
        group = group.element(snippet(other, text, None));
    }
    if !problem.help.is_empty() {
        group = group.element(Level::HELP.message(problem.help.as_str()));
    }
    let groups = [group];
    [Renderer::plain(), Renderer::styled()]
        .map(|renderer| renderer.decor_style(DecorStyle::Ascii).render(&groups))
}

/// The lines of a place, and of another one in the same file.
fn snippet<'a>(
    place: &Place<'a>,
    label: &'a str,
    beside: Option<&(Place<'a>, &'a str)>,
) -> Snippet<'a, annotate_snippets::Annotation<'a>> {
    let part = place.part;
    let lines = [place.line, beside.map_or(place.line, |(other, _)| other.line)];
    let (first, last) = (lines[0].min(lines[1]), lines[0].max(lines[1]));
    let shown = part.line(first).start..part.line(last).end;
    let long = (first..=last).any(|line| part.line(line).len() > LINE_MAX);
    if long {
        // The place is told, the line is not.
        let text = "(a very long line)";
        let annotation = AnnotationKind::Primary.span(0..text.len());
        let annotation = if label.is_empty() { annotation } else { annotation.label(label) };
        return Snippet::source(text)
            .line_start(place.line)
            .path(part.path.to_string())
            .annotation(annotation);
    }
    let within = |span: &std::ops::Range<usize>| span.start - shown.start..span.end - shown.start;
    let primary = AnnotationKind::Primary.span(within(&place.span));
    let primary = if label.is_empty() { primary } else { primary.label(label) };
    let snippet = Snippet::source(&part.text[shown.clone()]);
    let mut snippet = snippet.line_start(first).path(part.path.to_string()).annotation(primary);
    if let Some((other, text)) = beside {
        snippet = snippet.annotation(AnnotationKind::Context.span(within(&other.span)).label(*text));
    }
    snippet
}
