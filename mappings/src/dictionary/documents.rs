//! The documents that rows were read in, and how far to trust what was read.

use crate::finding::registry as code;
use crate::format::{Name, Source, SourceRow};
use crate::resolver::Resolver;

/// How far a row can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Confidence {
    /// Read in two or more vendor families.
    High,
    /// Read in one.
    Medium,
    /// Derived, or contradictory.
    Low,
    /// Nothing is known but number and name.
    Unknown,
}

impl Confidence {
    /// Every mark with its word in the files.
    pub const NAMED: &'static [(&'static str, Self)] =
        &[("high", Self::High), ("medium", Self::Medium), ("low", Self::Low), ("unknown", Self::Unknown)];

    /// The word in the files.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
    }
}

/// Where a row was read and how far to trust it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trust {
    /// Keys of the documents.
    pub source: String,
    /// How far to trust it.
    pub confidence: Confidence,
}

/// A document.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Document {
    /// The key by which rows name it.
    pub key: String,
    /// Whom it comes from: documents of one family are one witness.
    pub family: String,
    /// What it is.
    pub title: String,
}

/// The documents of a profile.
#[derive(Debug, Clone, Default)]
pub struct Documents {
    list: Vec<Document>,
    /// The file that lists them, for messages.
    file: &'static str,
}

impl Documents {
    pub(super) fn resolve(rows: &[SourceRow], file: &'static str, resolver: &mut Resolver<'_>) -> Self {
        once(resolver, "key", rows.iter().map(|row| &row.key));
        let list = rows.iter().map(|row| Document {
            key: row.key.get_ref().clone(),
            family: row.family.clone(),
            title: row.title.clone(),
        });
        Self { list: list.collect(), file }
    }

    /// All of them.
    pub fn list(&self) -> &[Document] {
        &self.list
    }

    /// The families of the documents whose keys a row names.
    pub(super) fn families(&self, source: &Source, key: &str, resolver: &mut Resolver<'_>) -> Vec<&str> {
        let mut families = Vec::new();
        for name in source.get_ref().split_whitespace() {
            match self.list.iter().find(|document| document.key == name) {
                Some(document) if families.contains(&document.family.as_str()) => {}
                Some(document) => families.push(&document.family),
                None => {
                    let message = format!("expected keys of documents of {}, got `{name}`", self.file);
                    resolver.error(code::UNTRUSTED, source.span(), key, message);
                }
            }
        }
        if source.get_ref().trim().is_empty() {
            resolver.error(code::UNTRUSTED, source.span(), key, "expected at least one key of a document");
        }
        families
    }

    /// Source and confidence of a row: `high` takes documents of two families.
    pub(super) fn trust(&self, source: &Source, confidence: &Name, resolver: &mut Resolver<'_>) -> Trust {
        let families = self.families(source, "source", resolver);
        let mark = resolver.word("confidence", confidence, Confidence::NAMED);
        if mark == Some(Confidence::High) && families.len() < 2 {
            let message =
                format!("expected documents of two families for `high`, got `{}`", source.get_ref());
            resolver.error(code::UNTRUSTED, confidence.span(), "confidence", message);
        }
        Trust { source: source.get_ref().clone(), confidence: mark.unwrap_or(Confidence::Low) }
    }

    /// As [`Documents::trust`], or `otherwise` when a row says neither.
    pub(super) fn trust_or(
        &self,
        own: (Option<&Source>, Option<&Name>),
        otherwise: &Trust,
        resolver: &mut Resolver<'_>,
    ) -> Trust {
        match own {
            (Some(source), Some(confidence)) => self.trust(source, confidence, resolver),
            (None, None) => otherwise.clone(),
            (Some(name), None) | (None, Some(name)) => {
                resolver.error(
                    code::UNTRUSTED,
                    name.span(),
                    "source",
                    "expected both `source` and `confidence`, or neither",
                );
                otherwise.clone()
            }
        }
    }
}

/// Notes each name that is there a second time.
pub(super) fn once<'n>(resolver: &mut Resolver<'_>, key: &str, names: impl Iterator<Item = &'n Name>) {
    let mut known: Vec<&str> = Vec::new();
    for name in names {
        if known.contains(&name.get_ref().as_str()) {
            resolver.error(code::TWICE, name.span(), key, format!("`{}` is defined twice", name.get_ref()));
        }
        known.push(name.get_ref());
    }
}

/// One of the names that a file lists.
pub(super) fn one_of<'n>(
    key: &str,
    name: &Name,
    what: &str,
    known: impl Iterator<Item = &'n String> + Clone,
    resolver: &mut Resolver<'_>,
) -> Option<String> {
    let find = |text: &str| known.clone().find(|known| *known == text).cloned();
    resolver.name(key, name, what, find, known.clone().map(String::as_str))
}
