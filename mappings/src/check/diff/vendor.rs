//! What parameters of vendors are: their own rows, and how their values are held at both ends. The tables of facts about the
//! standards do not change under a machine; these rows are the machine's own, and as dangerous as the rows of a mapping.

use std::ops::Range;

use super::{Aspect, Fact, Reader, text};
use crate::Mapping;
use crate::finding::Spanned;
use crate::format::Name;

/// How much access each word gives, from the least to the most.
const ACCESSES: [&str; 3] = ["read", "write_while_disabled", "write"];

/// What all rows say.
pub(super) fn facts(mapping: &Mapping) -> Vec<Fact<'_>> {
    let mut facts = own(mapping);
    facts.extend(attributes(mapping));
    facts.extend(idns(mapping));
    facts.extend(objects(mapping));
    facts
}

/// Whether a name is that of a vendor's parameter.
fn is_of_vendor(mapping: &Mapping, name: &Name) -> bool {
    let known = mapping.dictionaries.generic.parameter(name.get_ref());
    known.is_some_and(|row| row.parameter.is_of_vendor())
}

/// The rows of the generic dictionary.
fn own(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().generic;
    let mut reader = Reader::new(&file.text, "generic");
    for row in file.rows.parameter.iter().filter(|row| is_of_vendor(mapping, &row.name)) {
        let id = ("parameter", row.name.get_ref().as_str());
        reader.named(id, Aspect::Unit, &row.quantity);
        reader.named(id, Aspect::Type, &row.data_type);
        let rank = ACCESSES.iter().position(|word| word == row.access.get_ref()).unwrap_or_default();
        let fact = reader.say(id, Aspect::Access, row.access.get_ref(), row.access.span());
        fact.reach = i64::try_from(rank).ok().map(|rank| (0, rank));
        let place = row.range.as_ref().map_or(row.name.span(), Spanned::span);
        reader.range(id, row.range.as_ref().map(|range| *range.get_ref()), place);
    }
    for row in &file.rows.constant {
        let id = ("constant", row.name.get_ref().as_str());
        reader.named(id, Aspect::Unit, &row.quantity);
        reader.say(id, Aspect::Scale, row.value.get_ref().to_string(), row.value.span());
    }
    for row in &file.rows.computed {
        let id = ("computed", row.parameter.get_ref().as_str());
        reader.say(id, Aspect::Scale, row.words(), row.parameter.span());
        let writes = row.writes.as_ref();
        let says = writes.map_or_else(|| "read".to_owned(), |name| format!("writes {}", name.get_ref()));
        let span = writes.map_or(row.parameter.span(), Name::span);
        reader.say(id, Aspect::Binding, says, span);
    }
    reader.facts
}

/// The attributes of vendors' parameters.
fn attributes(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().cip_attributes;
    let bound = &mapping.tables().cip_generic.rows.attribute;
    let mut reader = Reader::new(&file.text, "cip-attributes");
    for row in &file.rows.attribute {
        let of = |known: &&crate::format::CipAttributeRow| known.attribute.get_ref() == row.name.get_ref();
        let parameter = bound.iter().find(of).and_then(|known| known.parameter.as_ref());
        if !parameter.is_some_and(|name| is_of_vendor(mapping, name)) {
            continue;
        }
        let id = ("attribute", row.name.get_ref().as_str());
        held(&mut reader, id, &row.data_type, row.unit.as_ref(), "");
        let rank = match (row.access.get_ref().as_str(), row.running) {
            ("get", _) => 0,
            (_, false) => 1,
            (_, true) => 2,
        };
        let running = if row.running { ", in Running too" } else { "" };
        let says = format!("{}{running}", row.access.get_ref());
        reader.say(id, Aspect::Access, says, row.access.span()).reach = Some((0, rank));
    }
    reader.facts
}

/// The IDNs of vendors' parameters.
fn idns(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().sercos_idns;
    let bound = &mapping.tables().generic_sercos.rows.parameter;
    let mut reader = Reader::new(&file.text, "sercos-idns");
    for row in &file.rows.idn {
        let is_bound = bound
            .iter()
            .any(|known| known.idn.get_ref() == row.idn.get_ref() && is_of_vendor(mapping, &known.parameter));
        let Some(format) = row.format.as_ref().filter(|_| is_bound) else { continue };
        let length = row.length.as_ref().map_or(0, |length| *length.get_ref());
        let decimals = row.decimals.as_ref().map_or(0, |decimals| *decimals.get_ref());
        let id = ("idn", row.idn.get_ref().as_str());
        let more = format!(", {length} bytes, {decimals} decimals");
        held(&mut reader, id, format, row.unit.as_ref(), &more);
    }
    reader.facts
}

/// The objects of vendors' parameters.
fn objects(mapping: &Mapping) -> Vec<Fact<'_>> {
    let file = &mapping.tables().cia402_objects;
    let bound = &mapping.tables().generic_cia402.rows.parameter;
    let mut reader = Reader::new(&file.text, "cia402-objects");
    for row in &file.rows.object {
        let index = format!("{:04X}:", row.index.get_ref());
        for known in bound.iter().filter(|known| is_of_vendor(mapping, &known.parameter)) {
            let object = known.object.get_ref();
            let Some(sub) = object.to_ascii_uppercase().strip_prefix(&index).map(str::to_owned) else {
                continue;
            };
            let sub = u8::from_str_radix(&sub, 16).ok();
            let sub = row.subs.iter().find(|known| Some(*known.sub.get_ref()) == sub);
            let data_type = sub.and_then(|sub| sub.data_type.as_ref()).or(row.data_type.as_ref());
            let unit = sub.and_then(|sub| sub.unit.as_ref()).or(row.unit.as_ref());
            if let Some(data_type) = data_type {
                held(&mut reader, ("object", object), data_type, unit, "");
            }
        }
    }
    reader.facts
}

/// How a value is held at one end.
fn held(reader: &mut Reader<'_>, id: (&'static str, &str), kind: &Name, unit: Option<&Name>, more: &str) {
    let span: Range<usize> = kind.span();
    reader.say(id, Aspect::Type, format!("{}{more}", kind.get_ref()), span);
    reader.say(id, Aspect::Unit, text(unit), unit.map_or(kind.span(), Name::span));
}
