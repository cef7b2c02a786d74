//! Backups of drives as their start-up lists: the files of `axisbridge param backup`.
//!
//! The entries of a file come first, in its order. An entry of the configuration for the same parameter takes the place of the one of
//! the file. In front of them stands what makes the drive one of the same type as that of the backup: another one is refused.

use std::ops::Range;
use std::path::Path;

use super::Written;
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source, Spanned, deserialize, read_file, tree};
use crate::parameter::backup::{BYTES_MAX, Backup, FORMAT, questions};
use crate::parameter::id::Id;
use crate::parameter::startup::{OnDifference, StartupEntry, StartupValue};
use crate::parameter::value::unhex;

/// So many parameters are named in one finding.
const NAMED_MAX: usize = 8;

/// A backup whose texts know their places.
type BackupTable = Backup<Spanned<String>, Spanned<i64>>;

/// Reads the files that a configuration names; whether all of them can be used. `folder` is where their paths count from.
pub(super) fn load(folder: &Path, written: &mut Written, findings: &mut Findings) -> bool {
    let Written { text, file, config } = written;
    let south = file.south.get_ref();
    let mut good = true;
    let mut list = |path: &Spanned<String>,
                    reaction: Option<&Spanned<String>>,
                    bus: &'static str,
                    startup: &mut Vec<StartupEntry>| {
        let usual = reaction.and_then(|word| {
            OnDifference::NAMED.iter().find(|(name, _)| name == word.get_ref()).map(|(_, reaction)| *reaction)
        });
        let mut loader = Loader { text, key: path.span(), bus, usual: usual.unwrap_or_default(), findings };
        match loader.load(&folder.join(path.get_ref())) {
            Some(entries) => merge(startup, entries),
            None => good = false,
        }
    };
    let sercos = config.sercos.iter_mut().flat_map(|bus| &mut bus.drives);
    let tables = south.sercos.iter().flat_map(|table| &table.get_ref().drive);
    for (drive, table) in sercos.zip(tables) {
        let table = table.get_ref();
        if let Some(path) = &table.startup_file {
            list(path, table.on_startup_difference.as_ref(), "sercos", &mut drive.startup);
        }
    }
    let can = config.can.iter_mut().flat_map(|bus| &mut bus.drives);
    let tables = south.can.iter().flat_map(|table| &table.get_ref().drive);
    for (drive, table) in can.zip(tables) {
        let table = table.get_ref();
        if let Some(path) = &table.startup_file {
            list(path, table.on_startup_difference.as_ref(), "canopen", &mut drive.startup);
        }
    }
    let devicenet = config.devicenet.iter_mut().flat_map(|network| &mut network.drives);
    let tables = south.devicenet.iter().flat_map(|table| &table.get_ref().drive);
    for (drive, table) in devicenet.zip(tables) {
        let table = table.get_ref();
        if let Some(path) = &table.startup_file {
            list(path, table.on_startup_difference.as_ref(), "devicenet", &mut drive.startup);
        }
    }
    good
}

/// Puts the entries of a file in front of those of the configuration, which take the place of those of the same parameter.
fn merge(startup: &mut Vec<StartupEntry>, mut entries: Vec<StartupEntry>) {
    for own in startup.drain(..) {
        match entries.iter_mut().find(|entry| entry.id == own.id) {
            Some(entry) => *entry = own,
            None => entries.push(own),
        }
    }
    *startup = entries;
}

/// Reads one file.
struct Loader<'l> {
    /// The configuration, and where it names the file.
    text: &'l Source,
    key: Range<usize>,
    /// The word for the bus of the drive.
    bus: &'static str,
    usual: OnDifference,
    findings: &'l mut Findings,
}

fn wrong(span: Range<usize>, key: &str, title: String, expected: String) -> Problem {
    Problem::new(code::STARTUP, span).key(key).title(title).expected(expected)
}

impl Loader<'_> {
    fn load(&mut self, path: &Path) -> Option<Vec<StartupEntry>> {
        if !path.is_file() {
            let problem = Problem::new(code::UNREADABLE, self.key.clone()).key("startup_file");
            let problem = problem.expected(format!("expected a file, looked for {}", path.display()));
            let help = "the path starts at the folder of the configuration; `axisbridge param backup` makes the file";
            self.findings.push(self.text, problem.help(help));
            return None;
        }
        let content = match read_file(path, BYTES_MAX) {
            Ok(content) => content,
            Err(found) => {
                self.findings.extend(found);
                return None;
            }
        };
        let source = Source::new(&path.display().to_string(), &content);
        let tree = tree(&content, &source, self.findings)?;
        let table: BackupTable = deserialize(tree, &source, self.findings)?;
        self.entries(&source, &table)
    }

    fn entries(&mut self, source: &Source, table: &BackupTable) -> Option<Vec<StartupEntry>> {
        let mut problems = Vec::new();
        if *table.format.get_ref() != i64::from(FORMAT) {
            let title = format!("a backup of format {}", table.format.get_ref());
            problems.push(wrong(table.format.span(), "format", title, format!("expected format {FORMAT}")));
        }
        if table.bus.get_ref() != self.bus {
            let title = format!("a backup of a drive on {}", table.bus.get_ref());
            let expected = format!("expected one of a drive on {}", self.bus);
            problems.push(wrong(table.bus.span(), "bus", title, expected));
        }
        let mut entries = Vec::with_capacity(table.parameter.len());
        for question in questions(self.bus).iter().filter(|question| question.of_type) {
            if let (Some(value), Some(id)) = (table.drive.0.get(question.key), Id::parse(question.id)) {
                entries.push(StartupEntry {
                    id,
                    value: StartupValue::Text(value.clone()),
                    data_type: None,
                    on_difference: OnDifference::Refuse,
                    from_file: true,
                });
            }
        }
        let of_type = entries.len();
        let mut places: Vec<Range<usize>> = Vec::new();
        for kept in &table.parameter {
            let id = Id::parse(kept.id.get_ref()).filter(|id| match self.bus {
                "sercos" => matches!(id, Id::Idn(_)),
                "canopen" => matches!(id, Id::Object(_)),
                _ => matches!(id, Id::Path { .. }),
            });
            let data = unhex(kept.data.get_ref());
            if id.is_none() {
                let title =
                    format!("`{}` is not the number of a parameter", kept.id.get_ref().escape_debug());
                let expected = format!("expected that of a drive on {}", self.bus);
                problems.push(wrong(kept.id.span(), "id", title, expected));
            }
            if data.is_none() {
                let title = format!("the data of {} are not bytes", kept.id.get_ref().escape_debug());
                let expected = "expected two hexadecimal digits for each byte".to_owned();
                problems.push(wrong(kept.data.span(), "data", title, expected));
            }
            let (Some(id), Some(data)) = (id, data) else { continue };
            // What makes the type of the drive is compared anyway.
            if entries[..of_type].iter().any(|entry| entry.id == id) {
                continue;
            }
            if let Some(first) = entries[of_type..].iter().position(|entry| entry.id == id) {
                let problem = Problem::new(code::TWICE, kept.id.span()).key("id");
                let problem = problem.title(format!("the parameter {id} is used twice"));
                let problem = problem.expected("expected each parameter once");
                problems.push(problem.related(places[first].clone(), "used here first"));
                continue;
            }
            places.push(kept.id.span());
            let value = StartupValue::Bytes(data);
            let on_difference = self.usual;
            entries.push(StartupEntry { id, value, data_type: None, on_difference, from_file: true });
        }
        let good = problems.is_empty();
        problems.into_iter().for_each(|problem| self.findings.push(source, problem));
        if let Some(first) = table.unread.first() {
            let named: Vec<_> =
                table.unread.iter().take(NAMED_MAX).map(|unread| unread.id.get_ref().as_str()).collect();
            let more = table.unread.len() - named.len();
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let title = format!(
                "not in the start-up list, because the backup has no value: {}{more}",
                named.join(", ")
            );
            self.findings.push(source, Problem::new(code::STARTUP_ODD, first.id.span()).title(title));
        }
        good.then_some(entries)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::backup::Identity;
    use crate::parameter::backup::tests::kept;

    /// Every key that `axisbridge param backup` writes is one that a list may have.
    #[test]
    fn what_a_backup_writes_is_a_list() {
        let drive = Identity([("device_id".to_owned(), "D-1".to_owned())].into());
        let backup =
            Backup { parameter: vec![kept()], ..Backup::new("turntable", "sercos", "S-0-0192", drive) };
        let content = backup.to_text().expect("a text");
        let (source, mut findings) = (Source::new("a.toml", &content), Findings::default());
        let read = tree(&content, &source, &mut findings)
            .and_then(|tree| deserialize::<BackupTable>(tree, &source, &mut findings));
        let mut loader = Loader {
            text: &source,
            key: 0..0,
            bus: "sercos",
            usual: OnDifference::Warn,
            findings: &mut findings,
        };
        let entries = read.and_then(|table| loader.entries(&source, &table));
        let entries = entries.unwrap_or_else(|| panic!("{:?}", findings.list()));
        let ids: Vec<String> = entries.iter().map(|entry| entry.id.to_string()).collect();
        assert_eq!(ids, ["S-0-1300.0.5", "S-0-0104"]);
        assert_eq!(entries[1].value, StartupValue::Bytes(vec![0x96, 0]));
        assert_eq!(entries[1].on_difference, OnDifference::Warn);
    }
}
