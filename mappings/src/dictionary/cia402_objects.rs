//! Objects of CANopen devices with the drive profile CiA 402.

use std::ops::RangeInclusive;

use profile_generic::program::Width;

use super::cia402::Cia402Dictionary;
use super::documents::{Confidence, Trust, one_of};
use crate::finding::registry as code;
use crate::format::{Cia402ObjectRow, Cia402SubRow};
use crate::resolver::Resolver;

/// Declares an enumeration whose values have a word in the files.
macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($(#[$row:meta])* $value:ident = $word:literal),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$row])* $value),* }

        impl $name {
            /// Every value with its word in the files.
            pub const NAMED: &'static [(&'static str, Self)] = &[$(($word, Self::$value)),*];

            /// The word in the files.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$value => $word),* }
            }
        }
    };
}
pub(super) use words;

words! {
    /// What an object is made of.
    Cia402Kind {
        /// One value.
        Var = "var",
        /// Values of one type.
        Array = "array",
        /// Values of several types.
        Record = "record",
    }
}

words! {
    /// Data type of an object.
    Cia402Type {
        /// One bit, in a byte.
        Bool = "bool",
        /// 8 bits, signed.
        I8 = "i8",
        /// 16 bits, signed.
        I16 = "i16",
        /// 32 bits, signed.
        I32 = "i32",
        /// 64 bits, signed.
        I64 = "i64",
        /// 8 bits.
        U8 = "u8",
        /// 16 bits.
        U16 = "u16",
        /// 32 bits.
        U32 = "u32",
        /// 64 bits.
        U64 = "u64",
        /// 32 bits, floating point.
        F32 = "f32",
        /// 64 bits, floating point.
        F64 = "f64",
        /// Text.
        VisibleString = "visible_string",
        /// Bytes.
        OctetString = "octet_string",
        /// As many bytes as there are.
        Domain = "domain",
    }
}

impl Cia402Type {
    /// How a number of this type lies in an object; `None` for texts.
    pub const fn width(self) -> Option<Width> {
        Some(match self {
            Self::Bool | Self::U8 => Width::U8,
            Self::I8 => Width::I8,
            Self::I16 => Width::I16,
            Self::I32 => Width::I32,
            Self::I64 => Width::I64,
            Self::U16 => Width::U16,
            Self::U32 => Width::U32,
            Self::U64 => Width::U64,
            Self::F32 => Width::F32,
            Self::F64 => Width::F64,
            Self::VisibleString | Self::OctetString | Self::Domain => return None,
        })
    }

    /// Bits of a value; `None` when its length is its own.
    pub const fn bits(self) -> Option<u32> {
        match self {
            Self::Bool => Some(1),
            Self::I8 | Self::U8 => Some(8),
            Self::I16 | Self::U16 => Some(16),
            Self::I32 | Self::U32 | Self::F32 => Some(32),
            Self::I64 | Self::U64 | Self::F64 => Some(64),
            Self::VisibleString | Self::OctetString | Self::Domain => None,
        }
    }

    /// The whole numbers that it holds; `None` when it holds none.
    pub fn range(self) -> Option<RangeInclusive<i64>> {
        Some(match self {
            Self::Bool => 0..=1,
            Self::I8 => i8::MIN.into()..=i8::MAX.into(),
            Self::I16 => i16::MIN.into()..=i16::MAX.into(),
            Self::I32 => i32::MIN.into()..=i32::MAX.into(),
            Self::I64 => i64::MIN..=i64::MAX,
            Self::U8 => 0..=u8::MAX.into(),
            Self::U16 => 0..=u16::MAX.into(),
            Self::U32 => 0..=u32::MAX.into(),
            Self::U64 => 0..=i64::MAX,
            Self::F32 | Self::F64 | Self::VisibleString | Self::OctetString | Self::Domain => return None,
        })
    }
}

words! {
    /// What the master can do with an object.
    Cia402Access {
        /// Read it.
        Ro = "ro",
        /// Read and write it.
        Rw = "rw",
        /// Write it.
        Wo = "wo",
        /// Read it, and it stays the same.
        Const = "const",
    }
}

words! {
    /// What PDO can carry an object.
    Cia402Pdo {
        /// None.
        No = "no",
        /// One that the device receives.
        Rx = "rx",
        /// One that the device transmits.
        Tx = "tx",
        /// Either.
        Both = "both",
    }
}

words! {
    /// Whether a device must have an object.
    Cia402Category {
        /// It must.
        Mandatory = "mandatory",
        /// It may.
        Optional = "optional",
        /// It must under a condition, as when it has a mode.
        Conditional = "conditional",
    }
}

/// A value that an object has under a sub-index, or several that are alike.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cia402Sub {
    /// The sub-index, or the first one.
    pub sub: u8,
    /// The last one; the same when there is one.
    pub last: u8,
    /// Its name; that of the object when it is a variable.
    pub name: String,
    /// Data type; `None` when nobody says.
    pub data_type: Option<Cia402Type>,
    /// Access; `None` when nobody says.
    pub access: Option<Cia402Access>,
    /// Whether drives let it be mapped; `None` when nobody says.
    pub pdo: Option<Cia402Pdo>,
    /// Unit; empty when there is none or nobody says.
    pub unit: String,
    /// Value after a reset.
    pub default: Option<i64>,
    /// Whether the node-ID is added to the default.
    pub plus_node: bool,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// An object, or several that are alike.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cia402Object {
    /// The number, or the first one.
    pub index: u16,
    /// The last one; the same when there is one.
    pub last: u16,
    /// Its name; empty when only the number is known.
    pub name: String,
    /// What it is made of.
    pub kind: Cia402Kind,
    /// Whether a device must have it; `None` when nobody says.
    pub category: Option<Cia402Category>,
    /// Modes of operation whose set-points, limits or results it holds.
    pub modes: Vec<&'static str>,
    /// Its values: sub-index 0 alone when it is a variable.
    pub subs: Vec<Cia402Sub>,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

impl Cia402Object {
    /// The row of a sub-object; 0 is that of a variable.
    pub fn sub(&self, sub: u8) -> Option<&Cia402Sub> {
        self.subs.iter().find(|row| (row.sub..=row.last).contains(&sub))
    }
}

/// Reads the objects into the dictionary, which has documents and units already.
pub(super) fn resolve_objects(
    rows: &[Cia402ObjectRow],
    dictionary: &mut Cia402Dictionary,
    resolver: &mut Resolver<'_>,
) {
    let mut objects: Vec<Cia402Object> = Vec::with_capacity(rows.len());
    for row in rows {
        let Some(object) = resolve_object(row, dictionary, resolver) else { continue };
        if objects.iter().any(|known| object.index <= known.last && known.index <= object.last) {
            let message = format!("{:04X} is defined twice", object.index);
            resolver.error(code::TWICE, row.index.span(), "index", message);
        }
        objects.push(object);
    }
    objects.sort_by_key(|object| object.index);
    dictionary.objects = objects;
}

fn resolve_object(
    row: &Cia402ObjectRow,
    dictionary: &Cia402Dictionary,
    resolver: &mut Resolver<'_>,
) -> Option<Cia402Object> {
    let index = *row.index.get_ref();
    let last = row.to.as_ref().map_or(index, |to| *to.get_ref());
    if let Some(to) = row.to.as_ref().filter(|_| last <= index) {
        let message = format!("expected a number above {index:#06x}, got {last:#06x}");
        resolver.error(code::OUT_OF_RANGE, to.span(), "to", message);
        return None;
    }
    let kind = match &row.kind {
        Some(kind) => resolver.word("kind", kind, Cia402Kind::NAMED)?,
        None => Cia402Kind::Var,
    };
    let category = match &row.category {
        Some(category) => Some(resolver.word("category", category, Cia402Category::NAMED)?),
        None => None,
    };
    let trust = dictionary.documents.trust(&row.source, &row.confidence, resolver);
    let modes = Cia402Dictionary::modes(&row.modes, resolver);
    // What the object says holds for its sub-objects.
    let common = Cia402SubRow {
        sub: crate::finding::Spanned::new(row.index.span(), 0),
        to: None,
        name: row.name.clone(),
        data_type: row.data_type.clone(),
        access: row.access.clone(),
        pdo: row.pdo.clone(),
        unit: row.unit.clone(),
        default: row.default.clone(),
        plus_node: row.plus_node,
        note: None,
    };
    let common = resolve_sub(&common, None, dictionary, resolver)?;
    check_subs(row, kind, resolver);
    if trust.confidence == Confidence::Unknown && says_something(row) {
        let message = "expected nothing but the number where nothing is known";
        resolver.error(code::UNTRUSTED, row.confidence.span(), "confidence", message);
    }
    if row.name.is_empty() && trust.confidence != Confidence::Unknown {
        resolver.error(code::MISSING_KEY, row.index.span(), "name", "expected a name, got none");
    }
    let subs = match kind {
        Cia402Kind::Var => vec![common],
        Cia402Kind::Array | Cia402Kind::Record => {
            let subs = row.subs.iter();
            subs.filter_map(|sub| resolve_sub(sub, Some(&common), dictionary, resolver)).collect()
        }
    };
    Some(Cia402Object {
        index,
        last,
        name: row.name.clone(),
        kind,
        category,
        modes,
        subs,
        trust,
        note: row.note.clone().unwrap_or_default(),
    })
}

/// Whether a row has a key that somebody must have read somewhere.
fn says_something(row: &Cia402ObjectRow) -> bool {
    row.data_type.is_some()
        || row.access.is_some()
        || row.pdo.is_some()
        || row.unit.is_some()
        || row.default.is_some()
        || row.category.is_some()
        || !row.subs.is_empty()
}

/// A variable has no sub-objects, anything else has; they rise.
fn check_subs(row: &Cia402ObjectRow, kind: Cia402Kind, resolver: &mut Resolver<'_>) {
    if (kind == Cia402Kind::Var) != row.subs.is_empty() {
        let message = if row.subs.is_empty() {
            "expected `subs` of an array or record, got none"
        } else {
            "expected `kind` of an object with `subs`, got none"
        };
        resolver.error(code::CONTRADICTION, row.index.span(), "subs", message);
    }
    let mut above = None;
    for sub in &row.subs {
        let (first, last) = sub_range(sub);
        if last < first || above.is_some_and(|above| first <= above) {
            let message = format!("expected sub-indexes that rise, got {first} to {last}");
            resolver.error(code::OVERLAP, sub.sub.span(), "sub", message);
        }
        above = Some(last);
    }
}

fn sub_range(row: &Cia402SubRow) -> (u8, u8) {
    let first = *row.sub.get_ref();
    (first, row.to.as_ref().map_or(first, |to| *to.get_ref()))
}

/// Reads a sub-object; what it does not say it has from `common`.
fn resolve_sub(
    row: &Cia402SubRow,
    common: Option<&Cia402Sub>,
    dictionary: &Cia402Dictionary,
    resolver: &mut Resolver<'_>,
) -> Option<Cia402Sub> {
    let (sub, last) = sub_range(row);
    let data_type = match &row.data_type {
        Some(name) => Some(resolver.word("type", name, Cia402Type::NAMED)?),
        None => common.and_then(|common| common.data_type),
    };
    let access = match &row.access {
        Some(name) => Some(resolver.word("access", name, Cia402Access::NAMED)?),
        None => common.and_then(|common| common.access),
    };
    let pdo = match &row.pdo {
        Some(name) => Some(resolver.word("pdo", name, Cia402Pdo::NAMED)?),
        None => common.and_then(|common| common.pdo),
    };
    let unit = match &row.unit {
        Some(name) => {
            let known = dictionary.units.iter().map(|(unit, _)| unit);
            one_of("unit", name, "a unit of cia402-objects.toml", known, resolver)?
        }
        None => common.map(|common| common.unit.clone()).unwrap_or_default(),
    };
    let writes = access.is_none_or(|access| matches!(access, Cia402Access::Rw | Cia402Access::Wo));
    if let Some(name) =
        row.pdo.as_ref().filter(|_| !writes && matches!(pdo, Some(Cia402Pdo::Rx | Cia402Pdo::Both)))
    {
        let message = "expected an object that can be written where an RPDO carries it";
        resolver.error(code::CONTRADICTION, name.span(), "pdo", message);
    }
    if let Some(default) = &row.default {
        let fits =
            data_type.and_then(Cia402Type::range).is_some_and(|range| range.contains(default.get_ref()));
        if !fits {
            let holder = data_type.map_or("an object without type", Cia402Type::name);
            let message = format!("expected a value that {holder} holds, got {}", default.get_ref());
            resolver.error(code::OUT_OF_RANGE, default.span(), "default", message);
        }
    } else if row.plus_node {
        let message = "expected `default` where the node-ID is added to it";
        resolver.error(code::CONTRADICTION, row.sub.span(), "plus_node", message);
    }
    Some(Cia402Sub {
        sub,
        last,
        name: row.name.clone(),
        data_type,
        access,
        pdo,
        unit,
        default: row.default.as_ref().map(|default| *default.get_ref()),
        plus_node: row.plus_node,
        note: row.note.clone().unwrap_or_default(),
    })
}
