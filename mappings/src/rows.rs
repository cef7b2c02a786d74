//! From the text of a table file to its rows.

use serde::de::DeserializeOwned;

use super::groups;
use super::load::{Parsed, TableText};
use super::overlay::{self, Layer};
use crate::finding::{Findings, Source, deserialize, tree};

/// The rows of a table with what is laid over it; `None` when something is wrong with them.
pub(super) fn parse<T: DeserializeOwned>(
    table: &TableText,
    name: &str,
    layers: &[&Layer],
    findings: &mut Findings,
) -> Option<Parsed<T>> {
    let mut text = Source::new(&table.path, &table.text);
    let mut tree = tree(&table.text, &text, findings)?;
    groups::spread(tree.get_mut());
    let bases: Vec<usize> = layers.iter().map(|layer| layer.add_to(&mut text)).collect();
    for (layer, base) in layers.iter().zip(bases).filter(|(layer, _)| layer.touches(name)) {
        overlay::lay(layer, base, name, tree.get_mut(), &text, findings);
    }
    let rows = deserialize(tree, &text, findings)?;
    Some(Parsed::new(text, rows))
}
