//! Sets of codes of SERCOS.

use profile_sercos::wire::idn::Idn;

use super::documents::Trust;
use super::sercos::SercosDictionary;
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{SercosCodeFile, SercosCodesRow, SercosRangeRow};
use crate::load::Parsed;
use crate::resolver::Resolver;

/// One named code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedCode {
    /// The code.
    pub code: u32,
    /// Its name.
    pub name: String,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// What codes without a name of their own are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum GroupKind {
    /// A source names only what they have in common.
    Group,
    /// Of a maker.
    Vendor,
}

impl GroupKind {
    /// Every kind with its word in the files.
    pub const NAMED: &'static [(&'static str, Self)] = &[("group", Self::Group), ("vendor", Self::Vendor)];

    /// The word in the files.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
    }
}

/// Codes without a name of their own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodeGroup {
    /// The first of them.
    pub first: u32,
    /// The last of them.
    pub last: u32,
    /// What they are.
    pub kind: GroupKind,
    /// What they have in common.
    pub name: String,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// Named codes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodeSet {
    /// Name of the set.
    pub name: String,
    /// IDNs that hold such a code.
    pub idns: Vec<Idn>,
    /// What holds it beside or instead of an IDN, in words; mostly empty.
    pub element: String,
    /// First and last bit of the code where it is a part of the value.
    pub field: Option<(u32, u32)>,
    /// The codes.
    pub codes: Vec<NamedCode>,
    /// Codes without a name of their own.
    pub groups: Vec<CodeGroup>,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// Reads the sets of codes into the dictionary, which has the IDNs already.
pub(super) fn resolve_codes(
    file: &Parsed<SercosCodeFile>,
    dictionary: &mut SercosDictionary,
    errors: &mut Findings,
) {
    let mut resolver = Resolver::new(&file.text, errors);
    let rows = &file.rows;
    resolver.head(&rows.format, "profile", &rows.profile, "sercos");
    for row in &rows.enumeration {
        if dictionary.codes(row.name.get_ref()).is_some() {
            resolver.error(code::TWICE, row.name.span(), "name", "the set is defined twice");
        }
        let set = resolve_set(row, dictionary, &mut resolver);
        dictionary.code_sets.push(set);
    }
}

fn resolve_set(row: &SercosCodesRow, dictionary: &SercosDictionary, resolver: &mut Resolver<'_>) -> CodeSet {
    let rows = row.idns.iter().filter_map(|name| dictionary.idn_or_error("idns", name, resolver));
    let holders: Vec<_> = rows.collect();
    if row.idns.is_empty() && row.element.is_none() {
        resolver.error(
            code::CONTRADICTION,
            row.name.span(),
            "name",
            "expected `idns` or `element`, got neither",
        );
    }
    let bits = holders.iter().filter_map(|idn| idn.length).map(|length| u32::from(length) * 8).min();
    // What is told in words may be wider than the IDN.
    let whole = bits.filter(|_| row.element.is_none()).unwrap_or(u32::BITS).min(u32::BITS);
    let mut width = whole;
    if let Some(field) = &row.field {
        let [first, last] = *field.get_ref();
        if first > last || last >= whole {
            let message = format!("expected first and last bit below {whole}, got [{first}, {last}]");
            resolver.error(code::OUT_OF_RANGE, field.span(), "field", message);
        } else {
            width = last - first + 1;
        }
    }
    let mut set = CodeSet {
        name: row.name.get_ref().clone(),
        idns: holders.iter().map(|row| row.idn).collect(),
        element: row.element.clone().unwrap_or_default(),
        field: row.field.as_ref().map(|field| field.get_ref()).map(|[first, last]| (*first, *last)),
        codes: Vec::with_capacity(row.codes.len()),
        groups: Vec::with_capacity(row.ranges.len()),
        trust: dictionary.terms.documents.trust(&row.source, &row.confidence, resolver),
        note: row.note.clone().unwrap_or_default(),
    };
    for code in &row.codes {
        let number = *code.code.get_ref();
        fits(&code.code, "code", width, resolver);
        if set.codes.iter().any(|known| known.code == number) {
            resolver.error(code::TWICE, code.code.span(), "code", "the code is defined twice");
        }
        if set.codes.iter().any(|known| known.name == *code.name.get_ref()) {
            resolver.error(code::TWICE, code.name.span(), "name", "the name is defined twice");
        }
        let own = (code.source.as_ref(), code.confidence.as_ref());
        set.codes.push(NamedCode {
            code: number,
            name: code.name.get_ref().clone(),
            trust: dictionary.terms.documents.trust_or(own, &set.trust, resolver),
            note: code.note.clone().unwrap_or_default(),
        });
    }
    for range in &row.ranges {
        let group = resolve_group(range, width, &set, dictionary, resolver);
        set.groups.extend(group);
    }
    set
}

fn resolve_group(
    row: &SercosRangeRow,
    width: u32,
    set: &CodeSet,
    dictionary: &SercosDictionary,
    resolver: &mut Resolver<'_>,
) -> Option<CodeGroup> {
    let (first, last) = (*row.from.get_ref(), *row.to.get_ref());
    fits(&row.to, "to", width, resolver);
    if first > last {
        resolver.error(
            code::OUT_OF_RANGE,
            row.from.span(),
            "from",
            format!("expected at most {last}, got {first}"),
        );
        return None;
    }
    let named = set.codes.iter().any(|code| (first..=last).contains(&code.code));
    let taken = set.groups.iter().any(|other| first <= other.last && other.first <= last);
    if named || taken {
        resolver.error(
            code::OVERLAP,
            row.from.span(),
            "from",
            "the range takes in a code that is there already",
        );
    }
    let kind = resolver.word("kind", &row.kind, GroupKind::NAMED)?;
    let own = (row.source.as_ref(), row.confidence.as_ref());
    Some(CodeGroup {
        first,
        last,
        kind,
        name: row.name.clone(),
        trust: dictionary.terms.documents.trust_or(own, &set.trust, resolver),
        note: row.note.clone().unwrap_or_default(),
    })
}

fn fits(number: &crate::finding::Spanned<u32>, key: &str, width: u32, resolver: &mut Resolver<'_>) {
    if width < u32::BITS && number.get_ref() >> width != 0 {
        let message = format!("expected a code of {width} bits, got {:#X}", number.get_ref());
        resolver.error(code::OUT_OF_RANGE, number.span(), key, message.replace("0X", "0x"));
    }
}
