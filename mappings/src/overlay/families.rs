//! Settings of families of CiA 402 drives: overlays whose rows count for drives with a certain identity.

use std::collections::BTreeSet;

use super::{DrivesHead, Layer, OF_FAMILIES};
use crate::finding::{Findings, registry as code};
use crate::format::GenericCia402File;
use crate::load::{Parsed, TableText};
use crate::rows;

/// Where the overlays of the families that are shipped lie below the folder of the tables, and the texts built into the binary.
pub(crate) const FAMILIES: [(&str, &str); 6] = [
    ("families/delta.toml", include_str!("../../tables/families/delta.toml")),
    ("families/elmo.toml", include_str!("../../tables/families/elmo.toml")),
    ("families/kollmorgen.toml", include_str!("../../tables/families/kollmorgen.toml")),
    ("families/maxon.toml", include_str!("../../tables/families/maxon.toml")),
    ("families/oriental.toml", include_str!("../../tables/families/oriental.toml")),
    ("families/technosoft.toml", include_str!("../../tables/families/technosoft.toml")),
];

/// The table of a family of drives.
#[derive(Debug)]
pub(crate) struct ParsedFamily {
    /// What its overlays are for, in words.
    pub name: String,
    /// Vendor-ID.
    pub vendor: u32,
    /// Product codes; none: all that no other family of the vendor has.
    pub products: Vec<u32>,
    /// The table with their rows.
    pub table: Parsed<GenericCia402File>,
}

/// The tables of all families that overlays are for, with their rows over those for all drives. A drive whose product code is
/// named has the rows of that and those that all drives of its vendor have.
pub(crate) fn parse<'t>(
    table: &'t TableText,
    general: &[&Layer<'t>],
    of_families: &[&Layer<'t>],
    findings: &mut Findings,
) -> Vec<ParsedFamily> {
    let mut families = Vec::new();
    let Some((text, tree)) = rows::read(table, findings) else { return families };
    for (vendor, products, own) in groups(of_families) {
        let names: Vec<_> = own.iter().map(|layer| layer.name.as_str()).collect();
        let layers: Vec<_> = general.iter().copied().chain(own.iter().copied()).collect();
        let mut found = Findings::default();
        let parsed = rows::lay_over(text.clone(), tree.clone(), OF_FAMILIES, &layers, &mut found);
        if general.iter().any(|layer| layer.touches(OF_FAMILIES)) {
            // A family says nothing wrong where all drives are what it says already.
            let said = [code::OVERLAY_NO_EFFECT, code::OVERLAY_REMOVES_NOTHING];
            found.retain(|finding| !said.contains(&finding.code));
        }
        findings.extend(found);
        let name = names.join(", ");
        families.extend(parsed.map(|table| ParsedFamily { name, vendor, products, table }));
    }
    families
}

/// A family: vendor-ID, product codes, and the layers that count for it.
type Group<'l, 't> = (u32, Vec<u32>, Vec<&'l Layer<'t>>);

/// Which layers count for each product of each vendor; products with the same ones are one family.
fn groups<'l, 't>(layers: &[&'l Layer<'t>]) -> Vec<Group<'l, 't>> {
    let heads = || layers.iter().filter_map(|layer| layer.drives.as_ref());
    let vendors: BTreeSet<u32> = heads().map(|head| head.vendor_id).collect();
    let mut groups: Vec<Group<'l, 't>> = Vec::new();
    for vendor in vendors {
        let of_vendor = heads().filter(|head| head.vendor_id == vendor);
        let products: BTreeSet<u32> = of_vendor.flat_map(|head| &head.product_codes).copied().collect();
        for product in products.into_iter().map(Some).chain([None]) {
            let own: Vec<_> =
                layers.iter().copied().filter(|layer| includes(layer, vendor, product)).collect();
            let same = |(known, _, layers): &&mut Group<'_, '_>| {
                *known == vendor
                    && layers.len() == own.len()
                    && layers.iter().zip(&own).all(|(a, b)| std::ptr::eq(*a, *b))
            };
            match groups.iter_mut().find(same) {
                Some((_, codes, _)) => codes.extend(product),
                None if own.is_empty() => {}
                None => groups.push((vendor, product.into_iter().collect(), own)),
            }
        }
    }
    groups
}

/// Whether a layer counts for drives with this identity; `None` is a product code that nothing names.
fn includes(layer: &Layer<'_>, vendor: u32, product: Option<u32>) -> bool {
    layer.drives.as_ref().is_some_and(|DrivesHead { vendor_id, product_codes, .. }| {
        *vendor_id == vendor
            && (product_codes.is_empty() || product.is_some_and(|code| product_codes.contains(&code)))
    })
}
