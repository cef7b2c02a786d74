//! The attributes of the Motion Device Axis Object.

use std::collections::BTreeSet;
use std::ops::Range;

use profile_generic::program::Width;

use crate::finding::registry as code;
use crate::format::{AttributeRow, CipAttributeFile};
use crate::resolver::Resolver;

/// An elementary data type of CIP, as far as axis attributes use them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CipType {
    /// One byte, 0 or 1.
    Bool,
    /// Signed, 1 byte.
    Sint,
    /// Signed, 2 bytes.
    Int,
    /// Signed, 4 bytes.
    Dint,
    /// Signed, 8 bytes.
    Lint,
    /// Unsigned, 1 byte.
    Usint,
    /// Unsigned, 2 bytes.
    Uint,
    /// Unsigned, 4 bytes.
    Udint,
    /// Unsigned, 8 bytes.
    Ulint,
    /// Floating point, 4 bytes.
    Real,
    /// Floating point, 8 bytes.
    Lreal,
    /// 8 bits.
    Byte,
    /// 16 bits.
    Word,
    /// 32 bits.
    Dword,
    /// 64 bits.
    Lword,
    /// One length byte and that many characters.
    ShortString,
}

impl CipType {
    /// Every type with its name.
    pub const NAMED: &'static [(&'static str, Self)] = &[
        ("BOOL", Self::Bool),
        ("SINT", Self::Sint),
        ("INT", Self::Int),
        ("DINT", Self::Dint),
        ("LINT", Self::Lint),
        ("USINT", Self::Usint),
        ("UINT", Self::Uint),
        ("UDINT", Self::Udint),
        ("ULINT", Self::Ulint),
        ("REAL", Self::Real),
        ("LREAL", Self::Lreal),
        ("BYTE", Self::Byte),
        ("WORD", Self::Word),
        ("DWORD", Self::Dword),
        ("LWORD", Self::Lword),
        ("SHORT_STRING", Self::ShortString),
    ];

    /// How a number of this type lies in memory; `None` for strings.
    pub const fn width(self) -> Option<Width> {
        Some(match self {
            Self::Bool | Self::Usint | Self::Byte => Width::U8,
            Self::Sint => Width::I8,
            Self::Int => Width::I16,
            Self::Dint => Width::I32,
            Self::Lint => Width::I64,
            Self::Uint | Self::Word => Width::U16,
            Self::Udint | Self::Dword => Width::U32,
            Self::Ulint | Self::Lword => Width::U64,
            Self::Real => Width::F32,
            Self::Lreal => Width::F64,
            Self::ShortString => return None,
        })
    }

    /// Bits of a value of this type; `None` for strings.
    pub fn bits(self) -> Option<u32> {
        if self == Self::Bool { Some(1) } else { self.width().map(Width::bits) }
    }

    /// The name in the standard.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
    }
}

/// How an attribute may be accessed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// Read only.
    Get,
    /// Written by Set services.
    Set,
    /// Written by the connection, not by Set services (Set* in the standard).
    SetCyclic,
}

impl Access {
    /// Every rule with its word in the files.
    pub const NAMED: &'static [(&'static str, Self)] =
        &[("get", Self::Get), ("set", Self::Set), ("set_cyclic", Self::SetCyclic)];

    /// As the standard prints it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Get => "Get",
            Self::Set => "Set",
            Self::SetCyclic => "Set*",
        }
    }
}

/// What an inverted Motion Polarity does to an attribute (clause 5-2.3.2.1.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PolarityEffect {
    /// Nothing.
    None,
    /// It turns the sign.
    Sign,
    /// The value changes places with that of the attribute of this number.
    Swap(u16),
}

/// The device functions of the implementation table, in its order: bus power converter, encoder, frequency control,
/// position, velocity and torque loop.
pub const DEVICE_FUNCTIONS: [char; 6] = ['B', 'E', 'F', 'P', 'V', 'T'];

/// One attribute; "Feedback n" attributes are there once per channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CipAttribute {
    /// Attribute number.
    pub id: u16,
    /// Name in the standard.
    pub name: String,
    /// The feedback channel, 1 first, of an attribute that each channel has.
    pub channel: Option<u16>,
    /// Type of the value or of an array's elements.
    pub data_type: CipType,
    /// Elements of an array, 0 when there may be any number; `None` for a single value.
    pub length: Option<u16>,
    /// Access.
    pub access: Access,
    /// Whether it may be set in the Running state (Table 5-2.110).
    pub running: bool,
    /// Need for the [`DEVICE_FUNCTIONS`], in their order: `R`, `O`, `C` or `-`; one letter for a class attribute.
    pub need: String,
    /// When the need applies; empty when always.
    pub condition: String,
    /// Unit; empty when there is none.
    pub unit: String,
    /// Value at power-up where the standard states one; it is 0 otherwise.
    pub default: Option<i64>,
    /// Least value, where the standard states one.
    pub min: Option<i64>,
    /// Greatest value, where the standard states one.
    pub max: Option<i64>,
    /// What the standard says about the range in words; mostly empty.
    pub range: String,
    /// What an inverted Motion Polarity does to it.
    pub polarity: PolarityEffect,
    /// Anything worth knowing, above all where documents disagree; mostly empty.
    pub note: String,
    /// Table of the standard.
    pub source: String,
    /// Clause in which the table stands.
    pub clause: String,
    /// What the table lists.
    pub group: String,
}

/// An attribute and the place of its row.
type Placed = (Range<usize>, CipAttribute);

/// The attributes of instance 0, by number.
pub(super) fn resolve_class_attributes(
    file: &CipAttributeFile,
    resolver: &mut Resolver<'_>,
) -> Vec<CipAttribute> {
    resolve_rows(file, &file.class_attribute, 1, resolver)
}

/// The attributes of an axis, by number; those of the feedback channels once per channel.
pub(super) fn resolve_instance_attributes(
    file: &CipAttributeFile,
    resolver: &mut Resolver<'_>,
) -> Vec<CipAttribute> {
    let mut attributes = resolve_rows(file, &file.attribute, DEVICE_FUNCTIONS.len(), resolver);
    for row in &file.attribute {
        let Some(other) = &row.swaps_with else { continue };
        let known = attributes.iter().map(|attribute| attribute.name.as_str());
        let find = |name: &str| attributes.iter().find(|attribute| attribute.name == name);
        let Some(with) = resolver.name("swaps_with", other, "an attribute of the axis object", find, known)
        else {
            continue;
        };
        let (id, with) = (*row.id.get_ref(), with.id);
        let back = file.attribute.iter().find(|row| *row.id.get_ref() == with);
        let back = back.and_then(|row| row.swaps_with.as_ref());
        if row.polarity.is_some()
            || back.is_none_or(|back| back.get_ref() != row.name.get_ref())
            || id == with
        {
            let message =
                format!("expected an attribute that swaps with this one and has no `polarity`, got {with}");
            resolver.error(code::CONTRADICTION, other.span(), "swaps_with", message);
        }
        if let Some(attribute) = attributes.iter_mut().find(|attribute| attribute.id == id) {
            attribute.polarity = PolarityEffect::Swap(with);
        }
    }
    attributes
}

fn resolve_rows(
    file: &CipAttributeFile,
    rows: &[AttributeRow],
    needs: usize,
    resolver: &mut Resolver<'_>,
) -> Vec<CipAttribute> {
    let mut attributes: Vec<Placed> = Vec::with_capacity(rows.len());
    for row in rows {
        let Some(attribute) = resolve_row(file, row, needs, resolver) else { continue };
        if row.per_channel {
            push_channels(file, row, &attribute, &mut attributes, resolver);
        } else {
            attributes.push((row.id.span(), attribute));
        }
    }
    attributes.sort_by_key(|(_, attribute)| attribute.id);
    for pair in attributes.windows(2) {
        if pair[0].1.id == pair[1].1.id {
            let message = format!("attribute {} is defined twice", pair[1].1.id);
            resolver.error(code::TWICE, pair[1].0.clone(), "id", message);
        }
    }
    let mut names = BTreeSet::new();
    for (span, attribute) in &attributes {
        if !names.insert(attribute.name.as_str()) {
            resolver.error(
                code::TWICE,
                span.clone(),
                "name",
                format!("`{}` is defined twice", attribute.name),
            );
        }
    }
    attributes.into_iter().map(|(_, attribute)| attribute).collect()
}

/// The attribute of each feedback channel.
fn push_channels(
    file: &CipAttributeFile,
    row: &AttributeRow,
    first: &CipAttribute,
    attributes: &mut Vec<Placed>,
    resolver: &mut Resolver<'_>,
) {
    if !first.name.contains(" n ") {
        resolver.error(code::MISSING_KEY, row.name.span(), "name", "expected `n` for the channel, got none");
        return;
    }
    let channels = file.feedback_channels;
    for channel in 0..channels.count {
        let id = channels.step.checked_mul(channel).and_then(|above| first.id.checked_add(above));
        let Some(id) = id else {
            let message = format!("expected a number that leaves room for {} channels", channels.count);
            resolver.error(code::OUT_OF_RANGE, row.id.span(), "id", message);
            return;
        };
        let number = channel.saturating_add(1);
        let name = first.name.replacen(" n ", &format!(" {number} "), 1);
        attributes.push((row.id.span(), CipAttribute { id, name, channel: Some(number), ..first.clone() }));
    }
}

fn resolve_row(
    file: &CipAttributeFile,
    row: &AttributeRow,
    needs: usize,
    resolver: &mut Resolver<'_>,
) -> Option<CipAttribute> {
    const POLARITIES: [(&str, PolarityEffect); 1] = [("sign", PolarityEffect::Sign)];
    let data_type = resolver.word("type", &row.data_type, CipType::NAMED);
    let access = resolver.word("access", &row.access, Access::NAMED);
    let need = row.need.get_ref();
    if need.chars().count() != needs || !need.chars().all(|letter| "ROC-".contains(letter)) {
        let message = format!("expected {needs} letters of R, O, C and -, got `{need}`");
        resolver.error(code::OUT_OF_RANGE, row.need.span(), "need", message);
    }
    let polarity = match &row.polarity {
        Some(name) => resolver.word("polarity", name, &POLARITIES),
        None => Some(PolarityEffect::None),
    };
    if let (Some(min), Some(max)) = (&row.min, &row.max)
        && min.get_ref() > max.get_ref()
    {
        let message = format!("expected at least {}, got {}", min.get_ref(), max.get_ref());
        resolver.error(code::OUT_OF_RANGE, max.span(), "max", message);
    }
    let find = |source: &str| file.clauses.iter().find(|clause| clause.source == source);
    let known = file.clauses.iter().map(|clause| clause.source.as_str());
    let clause = resolver.name("source", &row.source, "a source that `clauses` has", find, known);
    let (data_type, access, polarity, clause) = (data_type?, access?, polarity?, clause?);
    Some(CipAttribute {
        id: *row.id.get_ref(),
        name: row.name.get_ref().clone(),
        channel: None,
        data_type,
        length: row.length,
        access,
        running: row.running,
        need: need.clone(),
        condition: row.condition.clone().unwrap_or_default(),
        unit: row.unit.as_ref().map(|unit| unit.get_ref().clone()).unwrap_or_default(),
        default: row.default,
        min: row.min.as_ref().map(|min| *min.get_ref()),
        max: row.max.as_ref().map(|max| *max.get_ref()),
        range: row.range.clone().unwrap_or_default(),
        polarity,
        note: row.note.clone().unwrap_or_default(),
        source: row.source.get_ref().clone(),
        clause: clause.clause.clone(),
        group: clause.title.clone(),
    })
}
