//! The codes and bits of CIP Motion attributes, of its connection and of its services.

use super::cip::CipDictionary;
use super::{Code, CodeRange, Enumeration, RangeKind, SetKind};
use crate::finding::registry as code;
use crate::format::{CipRangeRow, CipSetRow, DataSetRow, Name, Source};
use crate::resolver::Resolver;

/// A set that belongs to nothing is of no use to a reader.
const NO_HOLDER: &str = "expected `attributes`, `class_attributes` or `element`, got none of them";

/// Fields of the connection and of services that hold a code are octets.
const ELEMENT_BITS: u32 = 8;

/// Reads sets of codes and of bits into the dictionary, which has the attributes already.
pub(super) fn resolve_sets(
    enumerations: &[CipSetRow],
    bits: &[CipSetRow],
    dictionary: &mut CipDictionary,
    resolver: &mut Resolver<'_>,
) {
    for row in enumerations {
        if dictionary.enumeration(row.name.get_ref()).is_some() {
            resolver.error(code::TWICE, row.name.span(), "name", "the set is defined twice");
        }
        if let Some(width) = &row.width {
            resolver.error(
                code::CONTRADICTION,
                width.span(),
                "width",
                "expected none: only a set of bits has one",
            );
        }
        let set = resolve_set(row, SetKind::Codes, "code", dictionary, resolver);
        dictionary.enumerations.push(set);
    }
    for row in bits {
        if dictionary.bits(row.name.get_ref()).is_some() {
            resolver.error(code::TWICE, row.name.span(), "name", "the set is defined twice");
        }
        if let Some(field) = &row.field {
            resolver.error(
                code::CONTRADICTION,
                field.span(),
                "field",
                "expected none: a set of bits is the whole value",
            );
        }
        let Some(width) = row.width.as_ref().map(|width| *width.get_ref()) else {
            resolver.error(
                code::MISSING_KEY,
                row.name.span(),
                "width",
                "expected the bits of the value, got none",
            );
            continue;
        };
        let set = resolve_set(row, SetKind::Bits { width }, "bit", dictionary, resolver);
        dictionary.bits.push(set);
    }
}

fn resolve_set(
    row: &CipSetRow,
    kind: SetKind,
    key: &'static str,
    dictionary: &CipDictionary,
    resolver: &mut Resolver<'_>,
) -> Enumeration {
    let mut set = empty(&row.name, kind, &row.source);
    set.element = row.element.clone().unwrap_or_default();
    set.note = row.note.clone().unwrap_or_default();
    hold(&mut set, &row.name, [&row.attributes, &row.class_attributes], dictionary, resolver);
    let whole = value_bits(&set, dictionary);
    let beyond = match kind {
        SetKind::Codes => {
            let whole = whole.unwrap_or(ELEMENT_BITS);
            // A set with a field of an attribute and a whole octet elsewhere is as wide as the field.
            1_u64.checked_shl(field(&mut set, row, whole, resolver)).unwrap_or(u64::MAX)
        }
        SetKind::Bits { width } => {
            if let Some(whole) = whole.filter(|whole| *whole != width) {
                let message = format!("expected width {whole}, as its attribute has, got {width}");
                resolver.error(code::OUT_OF_RANGE, row.name.span(), "width", message);
            }
            u64::from(width)
        }
    };
    for code in &row.codes {
        let number = *code.code.get_ref();
        below(beyond, number, code.code.span(), key, resolver);
        set.codes.push(Code {
            code: number,
            name: code.name.get_ref().clone(),
            need: resolve_need(code.need.as_ref(), resolver),
            rule: code.rule.clone().unwrap_or_default(),
            note: code.note.clone().unwrap_or_default(),
            limits: limits(&code.limits, &set, dictionary, resolver),
        });
    }
    set.unique(row.codes.iter().map(|code| &code.name), resolver);
    ranges(&mut set, &row.ranges, beyond, resolver);
    set
}

/// Notes the field that holds the code; gives its bits.
fn field(set: &mut Enumeration, row: &CipSetRow, whole: u32, resolver: &mut Resolver<'_>) -> u32 {
    let Some(field) = &row.field else { return whole };
    let [first, last] = *field.get_ref();
    set.field = Some((first, last));
    if first > last || last >= whole {
        let message = format!("expected first and last bit below {whole}, got [{first}, {last}]");
        resolver.error(code::OUT_OF_RANGE, field.span(), "field", message);
        return whole;
    }
    last - first + 1
}

/// The bits of a data set, beside what its elements carry.
pub(super) fn resolve_data_set_bits(
    row: &DataSetRow,
    dictionary: &CipDictionary,
    resolver: &mut Resolver<'_>,
) -> Enumeration {
    let mut set = empty(&row.name, SetKind::Bits { width: ELEMENT_BITS }, &row.source);
    set.attributes
        .extend(dictionary.attribute_or_error("attribute", &row.attribute, resolver).map(|row| row.id));
    for element in &row.elements {
        let bit = u32::from(*element.bit.get_ref());
        below(u64::from(ELEMENT_BITS), bit, element.bit.span(), "bit", resolver);
        set.codes.push(Code {
            code: bit,
            name: element.name.get_ref().clone(),
            need: resolve_need(element.need.as_ref(), resolver),
            rule: element.rule.clone().unwrap_or_default(),
            note: element.note.clone().unwrap_or_default(),
            limits: Vec::new(),
        });
    }
    set.unique(row.elements.iter().map(|element| &element.name), resolver);
    ranges(&mut set, &row.ranges, u64::from(ELEMENT_BITS), resolver);
    set
}

fn empty(name: &Name, kind: SetKind, source: &Source) -> Enumeration {
    Enumeration {
        name: name.get_ref().clone(),
        kind,
        attributes: Vec::new(),
        class_attributes: Vec::new(),
        element: String::new(),
        source: source.get_ref().clone(),
        note: String::new(),
        field: None,
        codes: Vec::new(),
        ranges: Vec::new(),
    }
}

/// Notes the attributes and attributes of instance 0 that hold such a value.
fn hold(
    set: &mut Enumeration,
    name: &Name,
    [attributes, class_attributes]: [&[Name]; 2],
    dictionary: &CipDictionary,
    resolver: &mut Resolver<'_>,
) {
    for name in attributes {
        let found = dictionary.attribute_or_error("attributes", name, resolver);
        set.attributes.extend(found.map(|row| row.id));
    }
    for name in class_attributes {
        let found = dictionary.class_attribute_or_error("class_attributes", name, resolver);
        set.class_attributes.extend(found.map(|row| row.id));
    }
    if attributes.is_empty() && class_attributes.is_empty() && set.element.is_empty() {
        resolver.error(code::CONTRADICTION, name.span(), "name", NO_HOLDER);
    }
}

/// Bits of the smallest attribute that holds such a value; `None` when no attribute does.
fn value_bits(set: &Enumeration, dictionary: &CipDictionary) -> Option<u32> {
    let of_axis = set.attributes.iter().filter_map(|id| dictionary.attribute_by_id(*id));
    let of_class = set.class_attributes.iter().filter_map(|id| dictionary.class_attribute_by_id(*id));
    of_axis.chain(of_class).filter_map(|row| row.data_type.bits()).min()
}

fn limits(
    names: &[Name],
    set: &Enumeration,
    dictionary: &CipDictionary,
    resolver: &mut Resolver<'_>,
) -> Vec<u16> {
    let of_class = !set.class_attributes.is_empty();
    let mut ids = Vec::with_capacity(names.len());
    for name in names {
        let found = if of_class {
            dictionary.class_attribute_or_error("limits", name, resolver)
        } else {
            dictionary.attribute_or_error("limits", name, resolver)
        };
        ids.extend(found.map(|row| row.id));
    }
    ids
}

/// Reads the ranges: within the value, clear of the named codes and of each other.
fn ranges(set: &mut Enumeration, rows: &[CipRangeRow], beyond: u64, resolver: &mut Resolver<'_>) {
    for row in rows {
        let (first, last) = (*row.from.get_ref(), *row.to.get_ref());
        below(beyond, last, row.to.span(), "to", resolver);
        if first > last {
            resolver.error(
                code::OUT_OF_RANGE,
                row.from.span(),
                "from",
                format!("expected at most {last}, got {first}"),
            );
            continue;
        }
        let named = set.codes.iter().any(|code| (first..=last).contains(&code.code));
        let taken = set.ranges.iter().any(|other| first <= other.last && other.first <= last);
        if named || taken {
            resolver.error(
                code::OVERLAP,
                row.from.span(),
                "from",
                "the range takes in a code that is there already",
            );
        }
        let Some(kind) = resolver.word("kind", &row.kind, RangeKind::NAMED) else { continue };
        set.ranges.push(CodeRange {
            first,
            last,
            kind,
            name: row.name.clone().unwrap_or_default(),
            need: resolve_need(row.need.as_ref(), resolver),
            note: row.note.clone().unwrap_or_default(),
        });
    }
}

fn below(beyond: u64, number: u32, span: std::ops::Range<usize>, key: &str, resolver: &mut Resolver<'_>) {
    if u64::from(number) >= beyond {
        resolver.error(
            code::OUT_OF_RANGE,
            span,
            key,
            format!("expected a number below {beyond}, got {number}"),
        );
    }
}

fn resolve_need(need: Option<&Name>, resolver: &mut Resolver<'_>) -> Option<char> {
    const NEEDS: [(&str, char); 4] = [("R", 'R'), ("O", 'O'), ("C", 'C'), ("-", '-')];
    resolver.word("need", need?, &NEEDS)
}
