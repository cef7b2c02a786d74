//! Attributes of a script: names of the dictionary, values as an engineer writes them.

use profile_cip::controller::condition::{Number, ValueCheck};
use profile_cip::wire::motion::attribute_list::{AttributeSelector, Range};
use profile_generic::program::Width;
use toml::de::DeValue;

use super::reader::{Keys, Problems, Value, folded, number, whole, wrong};
use crate::mapping::{CipDictionary, CipType, SetKind};

/// An attribute that a step speaks of.
#[derive(Debug, Clone)]
pub(super) struct Attribute {
    pub id: u16,
    pub name: String,
    pub data_type: CipType,
    /// Elements of an array.
    pub length: Option<u16>,
}

impl Attribute {
    pub fn width(&self) -> Option<Width> {
        self.data_type.width()
    }

    fn element_size(&self) -> u8 {
        self.width().and_then(|width| u8::try_from(width.bytes()).ok()).unwrap_or(1)
    }

    /// How a list service selects it; strings are read by their longest form.
    pub fn selector(&self) -> AttributeSelector {
        let whole = self.length.and_then(|count| {
            AttributeSelector::array(self.id, self.element_size(), &[Range { start: 0, count }])
        });
        whole.unwrap_or_else(|| AttributeSelector::scalar(self.id, self.element_size()))
    }
}

/// The attribute that a value names: by its name, or by its number, for which the dictionary or `type` has the type.
pub(super) fn attribute(
    value: &Value<'_>,
    data_type: Option<CipType>,
    class: bool,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<Attribute> {
    let rows = if class { dictionary.class_attributes() } else { dictionary.attributes() };
    let known = match value.get_ref() {
        DeValue::String(name) => {
            let found = rows.iter().find(|row| folded(&row.name) == folded(name));
            if found.is_none() && data_type.is_none() {
                let near = nearest(name, rows.iter().map(|row| row.name.as_str()));
                let what = if class { "class" } else { "axis" };
                return problems.report(
                    value.span(),
                    format_args!("`{name}` is no attribute of the {what}"),
                    near.map_or("expected a name of the standard".to_owned(), |near| {
                        format!("did you mean \"{near}\"?")
                    }),
                );
            }
            found
        }
        DeValue::Integer(_) => {
            let number = whole(value);
            rows.iter().find(|row| number == Some(i128::from(row.id)))
        }
        _ => return wrong(value, "attribute", "the name or the number of an attribute", problems),
    };
    if let Some(row) = known {
        let data_type = data_type.unwrap_or(row.data_type);
        return Some(Attribute { id: row.id, name: row.name.clone(), data_type, length: row.length });
    }
    let id = whole(value).and_then(|number| u16::try_from(number).ok());
    match (id, data_type) {
        (Some(id), Some(data_type)) => {
            Some(Attribute { id, name: format!("attribute {id}"), data_type, length: None })
        }
        (Some(id), None) => problems.report(
            value.span(),
            format_args!("attribute {id} is not in the dictionary"),
            "expected `type` as well, such as type = \"UINT\"",
        ),
        (None, _) => wrong(value, "attribute", "the number of an attribute, 0 to 65535", problems),
    }
}

/// The key `type`.
#[expect(clippy::option_option, reason = "absent is not wrong")]
pub(super) fn data_type(keys: &mut Keys<'_, '_>) -> Option<Option<CipType>> {
    match keys.find("type") {
        Some(value) => super::reader::word_of(value, "type", CipType::NAMED, keys.problems).map(Some),
        None => Some(None),
    }
}

/// The name most like this one, if any is.
pub(in crate::simulate) fn nearest<'n>(name: &str, known: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    let distance = |other: &str| distance(&folded(name), &folded(other));
    known
        .map(|other| (distance(other), other))
        .min()
        .filter(|(d, _)| *d <= name.len() / 3 + 1)
        .map(|(_, n)| n)
}

/// Letters to be changed, added or left away.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = core::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.iter().enumerate() {
            let change = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = change.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// A value in wire order.
pub(super) fn encode(
    value: &Value<'_>,
    attribute: &Attribute,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<Vec<u8>> {
    let Some(width) = attribute.width() else {
        let DeValue::String(text) = value.get_ref() else {
            return wrong(value, "value", "a string", problems);
        };
        let Ok(length) = u8::try_from(text.len()) else {
            return problems.report(value.span(), "the string is too long", "expected at most 255 bytes");
        };
        let mut bytes = vec![length];
        bytes.extend_from_slice(text.as_bytes());
        return Some(bytes);
    };
    match (attribute.length, value.get_ref()) {
        (Some(length), DeValue::Array(items)) => {
            if items.iter().count() != usize::from(length) {
                return problems.report(
                    value.span(),
                    format_args!("{} has {length} elements", attribute.name),
                    format_args!("expected a list of {length} values"),
                );
            }
            let parts: Vec<Option<Vec<u8>>> =
                items.iter().map(|item| scalar(item, attribute, width, dictionary, problems)).collect();
            Some(parts.into_iter().collect::<Option<Vec<_>>>()?.concat())
        }
        (Some(length), _) => wrong(value, "value", format_args!("a list of {length} values"), problems),
        (None, _) => scalar(value, attribute, width, dictionary, problems),
    }
}

fn scalar(
    value: &Value<'_>,
    attribute: &Attribute,
    width: Width,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<Vec<u8>> {
    Some(match numeric(value, attribute, width, dictionary, problems)? {
        Number::Integer(number) => number.to_le_bytes()[..width.bytes()].to_vec(),
        Number::Float(number) if width == Width::F32 => {
            #[expect(clippy::cast_possible_truncation, reason = "REAL is what the attribute has")]
            let real = number as f32;
            real.to_le_bytes().to_vec()
        }
        Number::Float(number) => number.to_le_bytes().to_vec(),
    })
}

/// A number in the range of its type; names of codes and bits count as numbers.
fn numeric(
    value: &Value<'_>,
    attribute: &Attribute,
    width: Width,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<Number> {
    let type_name = attribute.data_type.name();
    if matches!(width, Width::F32 | Width::F64) {
        return match number(value) {
            Some(number) => Some(Number::Float(number)),
            None => {
                wrong(value, "value", format_args!("a number, {} is a {type_name}", attribute.name), problems)
            }
        };
    }
    let number = match value.get_ref() {
        DeValue::Boolean(on) => i128::from(*on),
        DeValue::String(name) => named(value, name, attribute, dictionary, problems)?,
        _ => match whole(value) {
            Some(number) => number,
            None => {
                let expected = format!("a whole number, {} is a {type_name}", attribute.name);
                return wrong(value, "value", expected, problems);
            }
        },
    };
    let bits = u32::try_from(width.bytes() * 8).unwrap_or(64);
    let signed = matches!(width, Width::I8 | Width::I16 | Width::I32 | Width::I64);
    let (low, high) = if signed {
        (-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1)
    } else {
        (0, (1_i128 << bits) - 1)
    };
    if !(low..=high).contains(&number) {
        return problems.report(
            value.span(),
            format_args!("{number} does not fit {}", attribute.name),
            format_args!("expected a {type_name}, {low} to {high}"),
        );
    }
    let [bytes @ .., _, _, _, _, _, _, _, _] = number.to_le_bytes();
    Some(Number::Integer(i64::from_le_bytes(bytes)))
}

/// The number of a code by its name.
fn named(
    value: &Value<'_>,
    name: &str,
    attribute: &Attribute,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<i128> {
    let sets: Vec<_> = dictionary
        .enumerations()
        .iter()
        .filter(|set| set.kind == SetKind::Codes && set.attributes.contains(&attribute.id))
        .collect();
    let found = sets.iter().flat_map(|set| &set.codes).find(|code| folded(&code.name) == folded(name));
    if let Some(code) = found {
        return Some(i128::from(code.code));
    }
    let names: Vec<_> =
        sets.iter().flat_map(|set| &set.codes).map(|code| format!("\"{}\"", code.name)).collect();
    let expected = if names.is_empty() {
        format!("expected a number, {} has no names", attribute.name)
    } else {
        format!("expected a number or one of {}", names.join(", "))
    };
    problems.report(value.span(), format_args!("`{name}` is no {}", attribute.name), expected)
}

/// A value to compare with.
pub(super) fn check(
    value: &Value<'_>,
    tolerance: f64,
    attribute: &Attribute,
    dictionary: &CipDictionary,
    problems: &Problems,
) -> Option<ValueCheck> {
    let Some(width) = attribute.width().filter(|_| attribute.length.is_none()) else {
        return problems.report(
            value.span(),
            format_args!("{} is no single number", attribute.name),
            "expected an attribute that is one",
        );
    };
    let value = numeric(value, attribute, width, dictionary, problems)?;
    // A REAL is compared as a REAL, so that 0.1 is 0.1.
    #[expect(clippy::cast_possible_truncation, reason = "the nearest REAL")]
    let value = match value {
        Number::Float(number) if width == Width::F32 => Number::Float(f64::from(number as f32)),
        other => other,
    };
    Some(ValueCheck { width, value, tolerance })
}

/// The value of an attribute for people.
pub(super) fn show(bytes: &[u8], attribute: Option<&Attribute>) -> String {
    let Some(attribute) = attribute else { return format!("{bytes:02X?}") };
    match attribute.width() {
        Some(width) if width.bytes() > 0 && bytes.len().is_multiple_of(width.bytes()) => {
            let numbers: Option<Vec<_>> =
                bytes.chunks(width.bytes()).map(|part| Number::read(width, part)).collect();
            match numbers.as_deref() {
                Some([one]) => one.to_string(),
                Some(many) => {
                    format!("[{}]", many.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "))
                }
                None => format!("{bytes:02X?}"),
            }
        }
        None => match bytes.split_first() {
            Some((length, text)) => {
                let end = text.len().min(usize::from(*length));
                format!("{:?}", String::from_utf8_lossy(&text[..end]))
            }
            None => "nothing".to_owned(),
        },
        Some(_) => format!("{bytes:02X?}"),
    }
}
