//! Settings of families of CiA 402 drives: overlays whose rows count for drives with a certain identity.

use super::{DrivesHead, Layer, OF_FAMILIES};
use crate::finding::Findings;
use crate::mapping::format::GenericCia402File;
use crate::mapping::load::{Parsed, TableText};
use crate::mapping::rows;

/// Where the overlays of the families that are shipped lie below the folder of the tables, and the texts built into the binary.
pub(in crate::mapping) const FAMILIES: [(&str, &str); 6] = [
    ("families/delta.toml", include_str!("../../../../mappings/families/delta.toml")),
    ("families/elmo.toml", include_str!("../../../../mappings/families/elmo.toml")),
    ("families/kollmorgen.toml", include_str!("../../../../mappings/families/kollmorgen.toml")),
    ("families/maxon.toml", include_str!("../../../../mappings/families/maxon.toml")),
    ("families/oriental.toml", include_str!("../../../../mappings/families/oriental.toml")),
    ("families/technosoft.toml", include_str!("../../../../mappings/families/technosoft.toml")),
];

/// The table of a family of drives.
#[derive(Debug)]
pub(in crate::mapping) struct ParsedFamily {
    /// What its overlays are for, in words.
    pub name: String,
    /// Vendor-ID.
    pub vendor: u32,
    /// Product codes; none: all that no other family of the vendor has.
    pub products: Vec<u32>,
    /// The table with their rows.
    pub table: Parsed<GenericCia402File>,
}

/// The tables of all families that the layers are for. A drive whose product code is named has the rows of that and those that
/// all drives of its vendor have.
pub(in crate::mapping) fn parse(
    table: &TableText,
    layers: &[Layer<'_>],
    findings: &mut Findings,
) -> Vec<ParsedFamily> {
    let heads = || layers.iter().filter_map(|layer| layer.drives.as_ref());
    let mut vendors: Vec<u32> = heads().map(|head| head.vendor_id).collect();
    vendors.sort_unstable();
    vendors.dedup();
    let mut families = Vec::new();
    for vendor in vendors {
        let of_vendor = heads().filter(|head| head.vendor_id == vendor);
        let mut products: Vec<_> =
            of_vendor.flat_map(|head| &head.product_codes).map(|code| Some(*code)).collect();
        products.sort_unstable();
        products.dedup();
        // Which layers each product has; products with the same ones are one family.
        let mut groups: Vec<(Vec<usize>, Vec<u32>)> = Vec::new();
        for product in products.into_iter().chain([None]) {
            let own: Vec<usize> =
                (0..layers.len()).filter(|at| includes(&layers[*at], vendor, product)).collect();
            match groups.iter_mut().find(|(known, _)| *known == own) {
                Some((_, codes)) => codes.extend(product),
                None => groups.push((own, product.into_iter().collect())),
            }
        }
        for (own, products) in groups {
            let names: Vec<_> = own
                .iter()
                .filter(|at| !layers[**at].is_general())
                .map(|at| layers[*at].name.as_str())
                .collect();
            if names.is_empty() {
                continue;
            }
            let own: Vec<_> = own.iter().map(|at| &layers[*at]).collect();
            let parsed = rows::parse(table, OF_FAMILIES, &own, findings);
            families.extend(parsed.map(|table| ParsedFamily {
                name: names.join(", "),
                vendor,
                products,
                table,
            }));
        }
    }
    families
}

/// Whether a layer counts for drives with this identity; `None` is a product code that nothing names.
fn includes(layer: &Layer<'_>, vendor: u32, product: Option<u32>) -> bool {
    layer.drives.as_ref().is_none_or(|DrivesHead { vendor_id, product_codes, .. }| {
        *vendor_id == vendor
            && (product_codes.is_empty() || product.is_some_and(|code| product_codes.contains(&code)))
    })
}
