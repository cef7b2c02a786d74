//! The mapping tables as a page for a browser: every row with where it stands, and what was found.

mod diagram;
mod picture;

use std::fmt::Write as _;
use std::ops::Range;

use toml::de::{DeTable, DeValue};

use super::Outcome;
use crate::finding::{Finding, Severity};
use crate::groups;
use crate::{IdnPart, Mapping, TableText, TableTexts};

/// The page needs no other file.
const STYLE: &str = include_str!("page.css");

/// Shows only the rows that have the text; `/` goes to the filter, Escape empties it.
const SCRIPT: &str = include_str!("page.js");

/// The page of what was checked.
#[must_use]
pub fn page(outcome: &Outcome) -> String {
    let embedded;
    let texts = match &outcome.texts {
        Some(texts) => texts,
        None => {
            embedded = TableTexts::embedded();
            &embedded
        }
    };
    let files: Vec<&TableText> = vec![&texts.cip_generic, &texts.generic_sercos, &texts.generic_cia402];
    let mut page = String::from(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<title>Axisbridge mapping tables</title>\n",
    );
    // Writing to a string does not fail.
    let _ = write!(
        page,
        "<meta name=\"viewport\" content=\"width=device-width\">\n<style>{STYLE}</style></head>\n<body>\n<h1>Mapping tables</h1>\n<nav>\
         <input id=\"filter\" placeholder=\"show only rows with this text (press /)\" aria-label=\"filter\">\
         <a href=\"#findings\">Findings</a>"
    );
    if outcome.mapping.is_some() {
        page.push_str(
            "<a href=\"#values\">Values</a><a href=\"#states\">States</a><a href=\"#faults\">Faults</a>",
        );
    }
    for file in &files {
        let _ = write!(page, "<a href=\"#{0}\">{0}</a>", escaped(name(&file.path)));
    }
    let overlays = || texts.families.iter().chain(&texts.overlays);
    for overlay in overlays() {
        let _ = write!(page, "<a href=\"#{0}\">{0}</a>", escaped(name(&overlay.path)));
    }
    page.push_str("</nav>\n");
    findings(&mut page, outcome);
    if let Some(mapping) = &outcome.mapping {
        coverage(&mut page, mapping);
        picture::picture(&mut page, mapping);
    }
    for file in files {
        table(&mut page, outcome, &file.path, &file.text);
    }
    for overlay in overlays() {
        table(&mut page, outcome, &overlay.path, &overlay.text);
    }
    let _ = write!(page, "<script>{SCRIPT}</script>\n</body></html>\n");
    page
}

fn name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn findings(page: &mut String, outcome: &Outcome) {
    let list = &outcome.findings;
    let _ = writeln!(
        page,
        "<h2 id=\"findings\">Findings</h2>\n<p>{} errors, {} warnings, {} notes; {} worked examples were run.</p>",
        list.count(Severity::Error),
        list.count(Severity::Warning),
        list.count(Severity::Note),
        outcome.examples
    );
    let mut each = |wanted: Severity| {
        for finding in list.list().iter().filter(|finding| finding.severity() == wanted) {
            let _ = writeln!(page, "<pre class=\"{wanted:?}\">{}</pre>", escaped(&finding.to_string()));
        }
    };
    each(Severity::Error);
    each(Severity::Warning);
    if list.count(Severity::Note) > 0 {
        page.push_str("<details><summary>notes</summary>\n");
        for finding in list.list().iter().filter(|finding| finding.severity() == Severity::Note) {
            let _ = writeln!(page, "<pre>{}</pre>", escaped(&finding.to_string()));
        }
        page.push_str("</details>\n");
    }
}

/// How much of the profiles the tables have.
fn coverage(page: &mut String, mapping: &Mapping) {
    let all = mapping.dictionaries.cip.attributes().len();
    let (served, rejected) = (mapping.cip.attributes.len(), mapping.cip.rejected.len());
    let idns = mapping.dictionaries.sercos.idns().iter().filter(|row| row.part == IdnPart::Profile).count();
    let unbound = mapping.sercos.unbound.len();
    let (objects, left) = (mapping.dictionaries.cia402.objects().len(), mapping.cia402.unbound.len());
    let _ = writeln!(
        page,
        "<h2>Coverage</h2>\n<p>Of {all} attributes of an axis {served} are served and {rejected} rejected with a reason. \
         Of {idns} IDNs of the drive profile {unbound} are bound by no row, with a reason. \
         Of {objects} objects or families of objects of CiA 402 drives {left} are bound by no row, with a reason.</p>"
    );
}

/// A file whose rows are shown, and what was found in it.
struct File<'f> {
    title: &'f str,
    text: &'f str,
    findings: Vec<&'f Finding>,
}

/// The rows of a file, kind by kind in the order of the file.
fn table(page: &mut String, outcome: &Outcome, path: &str, text: &str) {
    let findings = outcome.findings.list().iter();
    let findings =
        findings.filter(|finding| finding.file == path && finding.severity() != Severity::Note).collect();
    let file = &File { title: name(path), text, findings };
    let _ = writeln!(page, "<h2 id=\"{0}\">{0}</h2>", escaped(file.title));
    let Ok(mut tree) = DeTable::parse(text) else {
        let _ = writeln!(page, "<pre>{}</pre>", escaped(text));
        return;
    };
    groups::spread(tree.get_mut());
    for (_, value) in tree.get_mut().iter_mut() {
        // An overlay has the rows below the name of their table.
        if let DeValue::Table(rows) = value.get_mut() {
            groups::spread(rows);
        }
    }
    let mut sections: Vec<_> = tree.get_ref().iter().collect();
    sections.sort_by_key(|(key, _)| key.span().start);
    for (key, value) in sections {
        section(page, file, key.get_ref(), value.get_ref());
    }
}

fn section(page: &mut String, file: &File<'_>, name: &str, value: &DeValue<'_>) {
    match value {
        DeValue::Table(row) if row.iter().all(|(_, value)| is_rows(value.get_ref())) && !row.is_empty() => {
            let mut inner: Vec<_> = row.iter().collect();
            inner.sort_by_key(|(key, _)| key.span().start);
            for (key, value) in inner {
                section(page, file, &format!("{name}.{}", key.get_ref()), value.get_ref());
            }
        }
        DeValue::Table(row) => rows(page, file, name, &[(first_key(row), row)]),
        DeValue::Array(array) => {
            let tables: Vec<_> = array
                .iter()
                .filter_map(|item| match item.get_ref() {
                    DeValue::Table(row) => Some((first_key_in(row, &item.span()), row)),
                    _ => None,
                })
                .collect();
            if !tables.is_empty() {
                rows(page, file, name, &tables);
            }
        }
        other => {
            let _ = writeln!(page, "<p><b>{}</b> {}</p>", escaped(name), shown(other));
        }
    }
}

fn is_rows(value: &DeValue<'_>) -> bool {
    matches!(value, DeValue::Array(array) if array.iter().any(|item| matches!(item.get_ref(), DeValue::Table(_))))
}

/// Where the first key of a row stands.
fn first_key(row: &DeTable<'_>) -> usize {
    row.iter().map(|(key, _)| key.span().start).min().unwrap_or_default()
}

/// The same of a row of a list, which may have keys of its group.
fn first_key_in(row: &DeTable<'_>, place: &Range<usize>) -> usize {
    let own = row.iter().map(|(key, _)| key.span().start).filter(|start| place.contains(start)).min();
    own.unwrap_or_else(|| first_key(row))
}

/// Rows with where each begins.
fn rows(page: &mut String, file: &File<'_>, name: &str, rows: &[(usize, &DeTable<'_>)]) {
    let mut columns: Vec<(usize, &str)> = Vec::new();
    for (_, row) in rows {
        for (key, _) in row.iter() {
            if !columns.iter().any(|(_, known)| *known == key.get_ref().as_ref()) {
                columns.push((key.span().start, key.get_ref().as_ref()));
            }
        }
    }
    columns.sort_unstable();
    let _ = write!(page, "<h3>{}</h3>\n<table><thead><tr><th>line</th>", escaped(name));
    for (_, column) in &columns {
        let _ = write!(page, "<th>{}</th>", escaped(column));
    }
    page.push_str("</tr></thead><tbody>\n");
    let line_of = |at: usize| file.text.get(..at).map_or(0, |before| before.matches('\n').count() + 1);
    for (at, row) in rows {
        let line = line_of(*at);
        // From the head of the table to its last value.
        let header =
            file.text.lines().nth(line.saturating_sub(2)).is_some_and(|before| before.starts_with('['));
        let last = row.iter().map(|(_, value)| line_of(value.span().end)).max().unwrap_or(line);
        let lines = line - usize::from(header)..=last.max(line);
        let found: Vec<_> = file.findings.iter().filter(|finding| lines.contains(&finding.line)).collect();
        let class = found.iter().map(|finding| finding.severity()).min();
        let class = class.map_or_else(String::new, |severity| format!(" class=\"{severity:?}\""));
        let id = format!("{}-{line}", escaped(file.title));
        let _ = write!(page, "<tr id=\"{id}\"{class}><td class=\"n\"><a href=\"#{id}\">{line}</a>");
        for finding in found {
            let _ = write!(page, "<br><span>{}: {}</span>", finding.code, escaped(&finding.title));
        }
        page.push_str("</td>");
        for (_, column) in &columns {
            let value = row.get(*column).map_or_else(String::new, |value| shown(value.get_ref()));
            let _ = write!(page, "<td>{value}</td>");
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody></table>\n");
}

/// A value as people read it.
fn shown(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => escaped(text),
        DeValue::Integer(number) => escaped(&number.to_string()),
        DeValue::Float(number) => escaped(&number.to_string()),
        DeValue::Boolean(flag) => flag.to_string(),
        DeValue::Datetime(time) => escaped(&time.to_string()),
        DeValue::Array(items) => {
            let lines = items.iter().any(|item| matches!(item.get_ref(), DeValue::Table(_)));
            let items: Vec<_> = items.iter().map(|item| shown(item.get_ref())).collect();
            items.join(if lines { "<br>" } else { ", " })
        }
        DeValue::Table(table) => {
            let mut pairs: Vec<_> = table.iter().collect();
            pairs.sort_by_key(|(key, _)| key.span().start);
            let pairs = pairs
                .iter()
                .map(|(key, value)| format!("{} {}", escaped(key.get_ref()), shown(value.get_ref())));
            pairs.collect::<Vec<_>>().join("; ")
        }
    }
}

/// A text in HTML or XML; characters that XML does not have become a question mark.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\n' | '\t' => out.push(character),
            other if other.is_control() => out.push('?'),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Overlay;
    use crate::check::check;

    #[test]
    fn every_row_stands_on_the_page_and_text_is_no_markup() {
        let mut texts = TableTexts::embedded();
        let overlay = "format = 1\noverlay = \"a < b\"\n[[generic-sercos.parameter]]\nparameter = \"jerk_limit\"\nmissing = \"reject\"\n";
        texts.overlays.push(Overlay::new("own.toml", overlay));
        let outcome = Outcome { texts: Some(texts.clone()), ..check(None, &[]) };
        let page = page(&outcome);
        let tables = [&texts.cip_generic, &texts.generic_sercos, &texts.generic_cia402];
        let rows: usize = tables.iter().map(|table| rows_of(&table.text)).sum();
        assert!(rows > 870, "{rows}");
        assert!(page.matches("<tr id=").count() > rows, "{}", page.matches("<tr id=").count());
        assert!(page.contains("a &lt; b") && !page.contains("a < b"));
        assert!(page.contains("<h3>generic-sercos.parameter</h3>"));
        let line = texts
            .generic_sercos
            .text
            .lines()
            .position(|line| line.contains("signal = \"position_command\""))
            .unwrap()
            + 1;
        assert!(page.contains(&format!("id=\"generic-sercos.toml-{line}\"")), "{line}");
        assert!(page.contains("0 errors"));
    }

    #[test]
    fn a_finding_is_at_its_row() {
        let mut texts = TableTexts::embedded();
        let overlay = "format = 1\noverlay = \"own\"\n\n[[cip-generic.fault]]\ncause = \"brake_slip\"\nexception = \"Overtorque Limit\"\n";
        texts.overlays.push(Overlay::new("own.toml", overlay));
        let outcome = crate::check::texts(Some(texts), crate::finding::Findings::default());
        let found = outcome
            .findings
            .list()
            .iter()
            .find(|finding| finding.file == "own.toml" && finding.severity() == Severity::Error);
        let found = found.expect("the exception of another cause");
        let page = page(&outcome);
        let row = page.lines().find(|line| line.starts_with("<tr id=\"own.toml-5\"")).expect("the row");
        assert!(
            row.contains(&format!("class=\"{:?}\"", found.severity()))
                && row.contains(&found.code.to_string()),
            "{row}"
        );
    }

    /// Rows of the lists of a table.
    fn rows_of(text: &str) -> usize {
        let mut tree = DeTable::parse(text).unwrap();
        groups::spread(tree.get_mut());
        let lists = tree.get_ref().iter().filter_map(|(_, list)| list.get_ref().as_array());
        lists.map(|list| list.len()).sum()
    }
}
