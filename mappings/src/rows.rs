//! From the text of a table file to its rows.

use serde::de::DeserializeOwned;

use super::groups;
use super::load::{Parsed, TableText};
use super::overlay::{self, Layer};
use super::twice;
use crate::finding::{Findings, Problem, Source, partial, registry as code, tree};

/// The rows of a table with what is laid over it, without those with which something is wrong; `None` when none can be read.
pub(super) fn parse<T: DeserializeOwned>(
    table: &TableText,
    name: &str,
    layers: &[&Layer],
    findings: &mut Findings,
) -> Option<Parsed<T>> {
    let (text, tree) = read(table, findings)?;
    lay_over(text, tree, name, layers, findings)
}

/// The tree of a table, every row by itself.
pub(super) fn read<'t>(table: &'t TableText, findings: &mut Findings) -> Option<(Source, Tree<'t>)> {
    let text = Source::new(&table.path, &table.text);
    let mut tree = tree(&table.text, &text, findings)?;
    groups::spread(tree.get_mut());
    Some((text, tree))
}

/// A table before it is read into rows.
pub(super) type Tree<'t> = toml::Spanned<toml::de::DeTable<'t>>;

/// The rows of a tree with what is laid over it, without those with which something is wrong; `None` when none can be read.
pub(super) fn lay_over<'t, T: DeserializeOwned>(
    mut text: Source,
    mut tree: Tree<'t>,
    name: &str,
    layers: &[&Layer<'t>],
    findings: &mut Findings,
) -> Option<Parsed<T>> {
    let bases: Vec<usize> = layers.iter().map(|layer| layer.add_to(&mut text)).collect();
    let mut hints = overlay::Hints::new();
    for (layer, base) in layers.iter().zip(bases).filter(|(layer, _)| layer.touches(name)) {
        let laid = overlay::lay(layer, base, name, tree.get_mut(), &text, findings);
        hints.extend(laid.hints);
        text.lose(laid.losses);
    }
    twice::leave_out(name, tree.get_mut(), &text, findings);
    let hint = |problem: &Problem| {
        let known = hints.iter().find(|(row, _)| *row == problem.span);
        known.filter(|_| problem.code == code::MISSING_KEY).map(|(_, hint)| hint.about(problem))
    };
    let read = partial(tree, &text, findings, &hint)?;
    Some(Parsed::new(text, read.rows))
}
