//! The tables that a configuration names, whatever else is wrong with it.

use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source, Spanned};

/// A path as it is written, and where it leads.
type Found = (Spanned<String>, PathBuf);

/// The tables that a configuration names.
#[derive(Debug)]
pub struct Named {
    /// The text of the configuration, for messages.
    pub text: Source,
    folder: Option<Found>,
    overlays: Vec<Found>,
}

impl Named {
    /// What the text of a configuration names; paths count from `folder`.
    pub(super) fn of(folder: &Path, source: &str, name: &str) -> Self {
        let (tree, errors) = DeTable::parse_recoverable(source);
        let broken = |span: &std::ops::Range<usize>| {
            errors.iter().filter_map(toml::de::Error::span).any(|error| span.contains(&error.start))
        };
        let table = tree.get_ref().get("mappings").and_then(|table| table.get_ref().as_table());
        let value = |key: &str| table.and_then(|table| table.get(key));
        let found = |value: &toml::Spanned<DeValue<'_>>| {
            let path = value.get_ref().as_str().filter(|path| !path.is_empty() && !broken(&value.span()))?;
            Some((Spanned::new(value.span(), path.to_owned()), folder.join(path)))
        };
        let overlays = value("overlays").and_then(|list| list.get_ref().as_array());
        Self {
            text: Source::new(name, source),
            folder: value("dir").and_then(found),
            overlays: overlays.into_iter().flatten().filter_map(found).collect(),
        }
    }

    /// The folder of tables and the overlays that are there; the others are reported.
    pub fn there(&self, findings: &mut Findings) -> (Option<PathBuf>, Vec<PathBuf>) {
        let mut there = |(name, path): &Found, key: &str| {
            let is_there = path.exists();
            if !is_there {
                let problem = Problem::new(code::UNREADABLE, name.span()).key(key);
                let problem = problem.title(format!("`{}` is not there", name.get_ref()));
                let problem =
                    problem.expected(format!("expected a file or folder, looked for {}", path.display()));
                findings.push(&self.text, problem.help("the path starts at the folder of the configuration"));
            }
            is_there.then(|| path.clone())
        };
        let folder = self.folder.as_ref().and_then(|found| there(found, "dir"));
        (folder, self.overlays.iter().filter_map(|found| there(found, "overlays")).collect())
    }
}
