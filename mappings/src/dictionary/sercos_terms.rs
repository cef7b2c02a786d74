//! What the rows of the SERCOS dictionary refer to: documents, units, scalings and function groups.

use super::documents::{Documents, once, one_of};
use crate::finding::Findings;
use crate::format::{Name, SercosTermFile};
use crate::load::Parsed;
use crate::resolver::Resolver;

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
    pub documents: Documents,
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
        let documents = Documents::resolve(&rows.source, "sercos-terms.toml", &mut resolver);
        once(&mut resolver, "unit", rows.unit.iter().map(|row| &row.unit));
        once(&mut resolver, "scaling", rows.scaling.iter().map(|row| &row.scaling));
        once(&mut resolver, "group", rows.group.iter().map(|row| &row.group));
        let scalings = rows.scaling.iter().map(|row| ScaledQuantity {
            name: row.scaling.get_ref().clone(),
            scaling_type: row.scaling_type.clone(),
            parameters: row.parameters.clone(),
        });
        Self {
            documents,
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
}
