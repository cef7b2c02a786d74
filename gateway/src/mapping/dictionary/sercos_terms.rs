//! What the rows of the SERCOS dictionary refer to: documents, units, scalings and function groups.

use crate::finding::Findings;
use crate::finding::registry as code;
use crate::mapping::format::{Name, SercosTermFile, Source};
use crate::mapping::load::Parsed;
use crate::mapping::resolver::Resolver;

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

/// A quantity whose unit the drive's scaling gives.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScaledQuantity {
    /// The quantity as rows name it.
    pub name: String,
    /// The IDN with the scaling type, as in `S-0-0076`.
    pub scaling_type: Name,
    /// IDNs with factor, exponent, resolution and range.
    pub parameters: Vec<Name>,
}

/// What rows refer to.
#[derive(Debug, Clone, Default)]
pub struct SercosTerms {
    /// Documents.
    pub documents: Vec<Document>,
    /// Units and what they mean.
    pub units: Vec<(String, String)>,
    /// Quantities whose unit the drive's scaling gives.
    pub scalings: Vec<ScaledQuantity>,
    /// Function groups and drive functions with their clause of IEC 61800-7-204.
    pub groups: Vec<(String, String)>,
}

impl SercosTerms {
    pub(super) fn resolve(file: &Parsed<SercosTermFile>, errors: &mut Findings) -> Self {
        let mut resolver = Resolver::new(&file.text, errors);
        let rows = &file.rows;
        resolver.head(&rows.format, "profile", &rows.profile, "sercos");
        let once = |resolver: &mut Resolver<'_>, key: &str, names: &mut dyn Iterator<Item = &Name>| {
            let mut known: Vec<&str> = Vec::new();
            for name in names {
                if known.contains(&name.get_ref().as_str()) {
                    resolver.error(
                        code::TWICE,
                        name.span(),
                        key,
                        format!("`{}` is there twice", name.get_ref()),
                    );
                }
                known.push(name.get_ref());
            }
        };
        once(&mut resolver, "key", &mut rows.source.iter().map(|row| &row.key));
        once(&mut resolver, "unit", &mut rows.unit.iter().map(|row| &row.unit));
        once(&mut resolver, "scaling", &mut rows.scaling.iter().map(|row| &row.scaling));
        once(&mut resolver, "group", &mut rows.group.iter().map(|row| &row.group));
        let documents = rows.source.iter().map(|row| Document {
            key: row.key.get_ref().clone(),
            family: row.family.clone(),
            title: row.title.clone(),
        });
        let scalings = rows.scaling.iter().map(|row| ScaledQuantity {
            name: row.scaling.get_ref().clone(),
            scaling_type: row.scaling_type.clone(),
            parameters: row.parameters.clone(),
        });
        Self {
            documents: documents.collect(),
            units: rows.unit.iter().map(|row| (row.unit.get_ref().clone(), row.meaning.clone())).collect(),
            scalings: scalings.collect(),
            groups: rows.group.iter().map(|row| (row.group.get_ref().clone(), row.clause.clone())).collect(),
        }
    }

    /// The unit that a row names.
    pub(super) fn unit(&self, name: &Name, resolver: &mut Resolver<'_>) -> Option<String> {
        one_of("unit", name, "a unit of sercos-terms.toml", self.units.iter().map(|(unit, _)| unit), resolver)
    }

    /// The quantity that a row names.
    pub(super) fn scaling(&self, name: &Name, resolver: &mut Resolver<'_>) -> Option<String> {
        let known = self.scalings.iter().map(|row| &row.name);
        one_of("scaling", name, "a scaling of sercos-terms.toml", known, resolver)
    }

    /// The function group that a row names.
    pub(super) fn group(&self, name: &Name, resolver: &mut Resolver<'_>) -> Option<String> {
        let known = self.groups.iter().map(|(group, _)| group);
        one_of("group", name, "a group of sercos-terms.toml", known, resolver)
    }

    /// The families of the documents whose keys a row names.
    pub(super) fn families(&self, source: &Source, key: &str, resolver: &mut Resolver<'_>) -> Vec<&str> {
        let mut families = Vec::new();
        for name in source.get_ref().split_whitespace() {
            match self.documents.iter().find(|document| document.key == name) {
                Some(document) if families.contains(&document.family.as_str()) => {}
                Some(document) => families.push(&document.family),
                None => {
                    let message = format!("expected keys of documents of sercos-terms.toml, got `{name}`");
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

    /// As [`SercosTerms::trust`], or `otherwise` when a row says neither.
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

fn one_of<'n>(
    key: &str,
    name: &Name,
    what: &str,
    known: impl Iterator<Item = &'n String> + Clone,
    resolver: &mut Resolver<'_>,
) -> Option<String> {
    let find = |text: &str| known.clone().find(|known| *known == text).cloned();
    resolver.name(key, name, what, find, known.clone().map(String::as_str))
}
