//! The codes and bits of CIP Motion attributes.

use super::cip::CipDictionary;
use super::{Code, Enumeration, SetKind};
use crate::mapping::format::{CipBitsRow, CipEnumerationFile, CipEnumerationRow, Name};
use crate::mapping::load::{Parsed, TableErrors};
use crate::mapping::resolver::Resolver;

/// A set that belongs to nothing is of no use to a reader.
const NO_HOLDER: &str = "expected `attributes`, `class_attributes` or `element`, got none of them";

/// Sets of codes and sets of bits. `attributes` has the attributes already.
pub(super) fn resolve_sets(
    file: &Parsed<CipEnumerationFile>,
    attributes: &CipDictionary,
    errors: &mut TableErrors,
) -> (Vec<Enumeration>, Vec<Enumeration>) {
    let mut resolver = Resolver::new(&file.text, errors);
    resolver.head(&file.rows.format, "profile", &file.rows.profile, "cip-motion");
    let codes: Vec<_> =
        file.rows.enumeration.iter().map(|row| resolve_codes(row, attributes, &mut resolver)).collect();
    let bits: Vec<_> =
        file.rows.bits.iter().map(|row| resolve_bits(row, attributes, &mut resolver)).collect();
    let names = file.rows.enumeration.iter().map(|row| &row.name);
    unique_names(names, &mut resolver);
    unique_names(file.rows.bits.iter().map(|row| &row.name), &mut resolver);
    (codes, bits)
}

fn unique_names<'a>(names: impl Iterator<Item = &'a Name>, resolver: &mut Resolver<'_>) {
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        if seen.contains(&name.get_ref().as_str()) {
            resolver.error(name.span(), "name", "the set is there twice");
        }
        seen.push(name.get_ref());
    }
}

fn resolve_codes(
    row: &CipEnumerationRow,
    attributes: &CipDictionary,
    resolver: &mut Resolver<'_>,
) -> Enumeration {
    let mut set = Enumeration {
        name: row.name.get_ref().clone(),
        kind: SetKind::Codes,
        attributes: ids(&row.attributes, |name| {
            attributes.attribute_or_error("attributes", name, resolver).map(|row| row.id)
        }),
        class_attributes: ids(&row.class_attributes, |name| {
            attributes.class_attribute_or_error("class_attributes", name, resolver).map(|row| row.id)
        }),
        element: row.element.clone().unwrap_or_default(),
        source: row.source.get_ref().clone(),
        note: row.note.clone().unwrap_or_default(),
        codes: Vec::with_capacity(row.codes.len()),
    };
    if row.attributes.is_empty() && row.class_attributes.is_empty() && row.element.is_none() {
        resolver.error(row.name.span(), "name", NO_HOLDER);
    }
    for code in &row.codes {
        let need = resolve_need(code.need.as_ref(), resolver);
        let code = Code {
            code: *code.code.get_ref(),
            name: code.name.get_ref().clone(),
            need,
            rule: code.rule.clone().unwrap_or_default(),
            note: code.note.clone().unwrap_or_default(),
        };
        set.codes.push(code);
    }
    set.unique(row.codes.iter().map(|code| &code.name), resolver);
    set
}

fn resolve_bits(row: &CipBitsRow, attributes: &CipDictionary, resolver: &mut Resolver<'_>) -> Enumeration {
    let mut set = Enumeration {
        name: row.name.get_ref().clone(),
        kind: SetKind::Bits { width: row.width },
        attributes: ids(&row.attributes, |name| {
            attributes.attribute_or_error("attributes", name, resolver).map(|row| row.id)
        }),
        class_attributes: ids(&row.class_attributes, |name| {
            attributes.class_attribute_or_error("class_attributes", name, resolver).map(|row| row.id)
        }),
        element: row.element.clone().unwrap_or_default(),
        source: row.source.get_ref().clone(),
        note: row.note.clone().unwrap_or_default(),
        codes: Vec::with_capacity(row.bits.len()),
    };
    if row.attributes.is_empty() && row.class_attributes.is_empty() && row.element.is_none() {
        resolver.error(row.name.span(), "name", NO_HOLDER);
    }
    for bit in &row.bits {
        let number = *bit.bit.get_ref();
        if number >= row.width {
            let message = format!("expected a bit below {}, got {number}", row.width);
            resolver.error(bit.bit.span(), "bit", message);
        }
        let need = resolve_need(bit.need.as_ref(), resolver);
        let code = Code {
            code: number,
            name: bit.name.get_ref().clone(),
            need,
            rule: bit.rule.clone().unwrap_or_default(),
            note: bit.note.clone().unwrap_or_default(),
        };
        set.codes.push(code);
    }
    set.unique(row.bits.iter().map(|bit| &bit.name), resolver);
    set
}

fn ids(names: &[Name], find: impl FnMut(&Name) -> Option<u16>) -> Vec<u16> {
    names.iter().filter_map(find).collect()
}

fn resolve_need(need: Option<&Name>, resolver: &mut Resolver<'_>) -> Option<char> {
    const NEEDS: [(&str, char); 4] = [("R", 'R'), ("O", 'O'), ("C", 'C'), ("-", '-')];
    resolver.word("need", need?, &NEEDS)
}
