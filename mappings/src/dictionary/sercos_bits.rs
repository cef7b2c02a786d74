//! Words of SERCOS whose bits have a meaning.

use profile_sercos::wire::idn::Idn;

use super::documents::Trust;
use super::sercos::SercosDictionary;
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{FieldRow, PatternRow, SercosBitFile, ValueRow, WordRow};
use crate::load::Parsed;
use crate::resolver::Resolver;

/// In which SERCOS a word has these bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layout {
    /// In all.
    All,
    /// In SERCOS I and II.
    Sercos12,
    /// In SERCOS III.
    Sercos3,
}

impl Layout {
    /// Every layout with its word in the files.
    pub const NAMED: &'static [(&'static str, Self)] =
        &[("all", Self::All), ("I/II", Self::Sercos12), ("III", Self::Sercos3)];

    /// The word in the files.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
    }

    /// Whether a word can have both layouts at the same time.
    const fn meets(self, other: Self) -> bool {
        matches!((self, other), (Self::All, _) | (_, Self::All))
            || matches!((self, other), (Self::Sercos12, Self::Sercos12) | (Self::Sercos3, Self::Sercos3))
    }
}

/// A named value of a field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldValue {
    /// The value.
    pub value: u32,
    /// Its name.
    pub name: String,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

/// A field of a word.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name; `None` for reserved bits.
    pub name: Option<String>,
    /// First and last bit of each piece, the most significant first.
    pub parts: Vec<(u32, u32)>,
    /// Named values.
    pub values: Vec<FieldValue>,
    /// The set of codes that names its values; mostly empty.
    pub codes: String,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

impl Field {
    /// The bits as people write them, as in `15-14` or `11,9-8`.
    pub fn bits(&self) -> String {
        bits_text(&self.parts)
    }

    /// How many bits it has.
    fn width(&self) -> u32 {
        self.parts.iter().map(|(low, high)| high - low + 1).sum()
    }
}

/// Bits as people write them.
fn bits_text(parts: &[(u32, u32)]) -> String {
    let text = |(low, high): &(u32, u32)| match low == high {
        true => low.to_string(),
        false => format!("{high}-{low}"),
    };
    parts.iter().map(text).collect::<Vec<_>>().join(",")
}

/// A value that several fields have together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// First and last bit.
    pub bits: (u32, u32),
    /// The value of these bits, and its name.
    pub value: FieldValue,
}

impl Pattern {
    /// The bits as people write them.
    pub fn bits(&self) -> String {
        bits_text(&[self.bits])
    }
}

/// A word with named fields.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// Name of the word.
    pub name: String,
    /// IDNs that hold it.
    pub idns: Vec<Idn>,
    /// What holds it beside or instead of an IDN, in words; mostly empty.
    pub element: String,
    /// In which SERCOS it has these bits.
    pub layout: Layout,
    /// Bits of the word.
    pub width: u32,
    /// Its fields.
    pub fields: Vec<Field>,
    /// Values that several fields have together.
    pub patterns: Vec<Pattern>,
    /// Where it was read and how far to trust it.
    pub trust: Trust,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

impl Word {
    /// First and last bit of the field with this name; `None` also for one in several pieces.
    pub fn field(&self, name: &str) -> Option<(u32, u32)> {
        let found = self.fields.iter().find(|field| field.name.as_deref() == Some(name))?;
        if let [bits] = found.parts.as_slice() { Some(*bits) } else { None }
    }

    /// The named values of the field with this name.
    pub fn values(&self, name: &str) -> &[FieldValue] {
        let found = self.fields.iter().find(|field| field.name.as_deref() == Some(name));
        found.map_or(&[], |field| field.values.as_slice())
    }

    /// The names of all fields.
    pub fn field_names(&self) -> impl Iterator<Item = &str> + Clone {
        self.fields.iter().filter_map(|field| field.name.as_deref())
    }
}

/// Reads the words into the dictionary, which has IDNs and codes already.
pub(super) fn resolve_words(
    file: &Parsed<SercosBitFile>,
    dictionary: &mut SercosDictionary,
    errors: &mut Findings,
) {
    let mut resolver = Resolver::new(&file.text, errors);
    let rows = &file.rows;
    resolver.head(&rows.format, "profile", &rows.profile, "sercos");
    for row in &rows.word {
        if dictionary.word(row.name.get_ref()).is_some() {
            resolver.error(code::TWICE, row.name.span(), "name", "the word is defined twice");
        }
        if let Some(word) = resolve_word(row, dictionary, &mut resolver) {
            dictionary.words.push(word);
        }
    }
}

fn resolve_word(row: &WordRow, dictionary: &SercosDictionary, resolver: &mut Resolver<'_>) -> Option<Word> {
    let layout = resolver.word("layout", &row.layout, Layout::NAMED)?;
    let width = *row.width.get_ref();
    if ![8, 16, 32].contains(&width) {
        resolver.error(
            code::OUT_OF_RANGE,
            row.width.span(),
            "width",
            format!("expected 8, 16 or 32, got {width}"),
        );
        return None;
    }
    let trust = dictionary.terms.documents.trust(&row.source, &row.confidence, resolver);
    let mut idns = Vec::with_capacity(row.idns.len());
    for name in &row.idns {
        let Some(idn) = dictionary.idn_or_error("idns", name, resolver) else { continue };
        let bits = idn.length.map(|length| u32::from(length) * 8);
        // A layout of the other SERCOS may have another width.
        if bits.is_some_and(|bits| bits != width && layout != Layout::Sercos12) {
            let message = format!("expected the width of {}, got {width}", idn.number());
            resolver.error(code::OUT_OF_RANGE, row.width.span(), "width", message);
        }
        let taken =
            dictionary.words.iter().find(|word| word.idns.contains(&idn.idn) && word.layout.meets(layout));
        if let Some(taken) = taken {
            let message = format!("{} is the word `{}` already", idn.number(), taken.name);
            resolver.error(code::TWICE, name.span(), "idns", message);
        }
        idns.push(idn.idn);
    }
    if row.idns.is_empty() && row.element.is_none() {
        resolver.error(
            code::CONTRADICTION,
            row.name.span(),
            "name",
            "expected `idns` or `element`, got neither",
        );
    }
    let mut word = Word {
        name: row.name.get_ref().clone(),
        idns,
        element: row.element.clone().unwrap_or_default(),
        layout,
        width,
        fields: Vec::with_capacity(row.fields.len()),
        patterns: Vec::with_capacity(row.patterns.len()),
        trust,
        note: row.note.clone().unwrap_or_default(),
    };
    for field in &row.fields {
        if let Some(field) = resolve_field(field, row, &word, dictionary, resolver) {
            word.fields.push(field);
        }
    }
    for pattern in &row.patterns {
        if let Some(pattern) = resolve_pattern(pattern, &word, dictionary, resolver) {
            word.patterns.push(pattern);
        }
    }
    Some(word)
}

fn resolve_field(
    row: &FieldRow,
    word_row: &WordRow,
    word: &Word,
    dictionary: &SercosDictionary,
    resolver: &mut Resolver<'_>,
) -> Option<Field> {
    let (key, span, parts) = match (&row.bits, &row.parts) {
        (Some(bits), None) => ("bits", bits.span(), vec![*bits.get_ref()]),
        (None, Some(parts)) => ("parts", parts.span(), parts.get_ref().clone()),
        (Some(bits), Some(_)) => {
            resolver.error(code::CONTRADICTION, bits.span(), "bits", "expected `bits` or `parts`, got both");
            return None;
        }
        (None, None) => {
            let span = row.name.as_ref().unwrap_or(&word_row.name).span();
            resolver.error(code::CONTRADICTION, span, "bits", "expected `bits` or `parts`, got neither");
            return None;
        }
    };
    if parts.is_empty() || parts.iter().any(|[low, high]| low > high || *high >= word.width) {
        let parts: Vec<String> = parts.iter().map(|[low, high]| format!("[{low}, {high}]")).collect();
        let message = format!("expected first and last bit below {}, got {}", word.width, parts.join(", "));
        resolver.error(code::OUT_OF_RANGE, span, key, message);
        return None;
    }
    let parts: Vec<(u32, u32)> = parts.into_iter().map(|[low, high]| (low, high)).collect();
    let overlap = |a: &(u32, u32), b: &(u32, u32)| a.0 <= b.1 && b.0 <= a.1;
    let within =
        parts.iter().enumerate().any(|(at, part)| parts[..at].iter().any(|known| overlap(part, known)));
    let other = word
        .fields
        .iter()
        .find(|field| field.parts.iter().any(|known| parts.iter().any(|part| overlap(part, known))));
    if within || other.is_some() {
        let what = match other.and_then(|field| field.name.as_deref()) {
            Some(name) => format!("the bits overlap those of `{name}`"),
            None => "the bits overlap others".to_owned(),
        };
        resolver.error(code::OVERLAP, span.clone(), key, what);
    }
    match &row.name {
        Some(name) if row.reserved => {
            resolver.error(code::CONTRADICTION, name.span(), "name", "expected no name for reserved bits");
        }
        Some(name) if word.field_names().any(|known| known == name.get_ref()) => {
            resolver.error(code::TWICE, name.span(), "name", "the field is defined twice");
        }
        None if !row.reserved => {
            resolver.error(code::CONTRADICTION, span, key, "expected a name, or `reserved = true`")
        }
        _ => {}
    }
    let codes = match &row.codes {
        Some(name) => dictionary.codes_or_error("codes", name, resolver)?.name.clone(),
        None => String::new(),
    };
    let own = (row.source.as_ref(), row.confidence.as_ref());
    let mut field = Field {
        name: row.name.as_ref().map(|name| name.get_ref().clone()),
        parts,
        values: Vec::with_capacity(row.values.len()),
        codes,
        trust: dictionary.terms.documents.trust_or(own, &word.trust, resolver),
        note: row.note.clone().unwrap_or_default(),
    };
    for value in &row.values {
        if field.values.iter().any(|known| known.value == *value.value.get_ref()) {
            resolver.error(code::TWICE, value.value.span(), "value", "the value is defined twice");
        }
        let value = resolve_value(value, &field, dictionary, resolver);
        field.values.push(value);
    }
    Some(field)
}

fn resolve_value(
    row: &ValueRow,
    field: &Field,
    dictionary: &SercosDictionary,
    resolver: &mut Resolver<'_>,
) -> FieldValue {
    let own = (row.source.as_ref(), row.confidence.as_ref());
    fits(&row.value, field.width(), resolver);
    FieldValue {
        value: *row.value.get_ref(),
        name: row.name.clone(),
        trust: dictionary.terms.documents.trust_or(own, &field.trust, resolver),
        note: row.note.clone().unwrap_or_default(),
    }
}

fn resolve_pattern(
    row: &PatternRow,
    word: &Word,
    dictionary: &SercosDictionary,
    resolver: &mut Resolver<'_>,
) -> Option<Pattern> {
    let [low, high] = *row.bits.get_ref();
    if low > high || high >= word.width {
        let message = format!("expected first and last bit below {}, got [{low}, {high}]", word.width);
        resolver.error(code::OUT_OF_RANGE, row.bits.span(), "bits", message);
        return None;
    }
    let value = *row.value.get_ref();
    fits(&row.value, high - low + 1, resolver);
    if word.patterns.iter().any(|known| known.bits == (low, high) && known.value.value == value) {
        resolver.error(code::TWICE, row.value.span(), "value", "the value is defined twice");
    }
    let own = (row.source.as_ref(), row.confidence.as_ref());
    let value = FieldValue {
        value,
        name: row.name.clone(),
        trust: dictionary.terms.documents.trust_or(own, &word.trust, resolver),
        note: row.note.clone().unwrap_or_default(),
    };
    Some(Pattern { bits: (low, high), value })
}

fn fits(value: &crate::finding::Spanned<u32>, width: u32, resolver: &mut Resolver<'_>) {
    if width < u32::BITS && value.get_ref() >> width != 0 {
        let message = format!("expected a value of {width} bits, got {}", value.get_ref());
        resolver.error(code::FIELD_VALUE, value.span(), "value", message);
    }
}
