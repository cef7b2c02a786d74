//! Parameters and procedure commands of SERCOS.

use profile_sercos::wire::attribute::{Attribute, Format};
use profile_sercos::wire::idn::Idn;

use super::documents::Confidence;
use super::sercos_terms::SercosTerms;
use crate::finding::Findings;
use crate::finding::registry as code;
use crate::format::{IdnRow, Name, SercosIdnFile};
use crate::load::Parsed;
use crate::resolver::Resolver;

/// How the value of an IDN is displayed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum IdnFormat {
    /// Bits.
    Binary,
    /// Unsigned.
    Unsigned,
    /// Signed.
    Signed,
    /// Hexadecimal.
    Hexadecimal,
    /// Text.
    Text,
    /// IDNs.
    Idn,
    /// Floating point, of 4 or 8 bytes.
    Float,
}

impl IdnFormat {
    /// Every format with its word in the files.
    pub const NAMED: &'static [(&'static str, Self)] = &[
        ("binary", Self::Binary),
        ("unsigned", Self::Unsigned),
        ("signed", Self::Signed),
        ("hexadecimal", Self::Hexadecimal),
        ("text", Self::Text),
        ("idn", Self::Idn),
        ("float", Self::Float),
    ];

    /// The word in the files.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(_, known)| *known == self).map_or("", |(name, _)| name)
    }

    /// The format of element 3 that it stands for.
    pub const fn of_attribute(self) -> Format {
        match self {
            Self::Binary => Format::Binary,
            Self::Unsigned => Format::Unsigned,
            Self::Signed => Format::Signed,
            Self::Hexadecimal => Format::Hexadecimal,
            Self::Text => Format::Text,
            Self::Idn => Format::Idn,
            Self::Float => Format::Float,
        }
    }
}

/// What one unit in the last place of an IDN is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IdnUnit {
    /// No unit.
    None,
    /// 10^-decimals of a fixed unit.
    Fixed {
        /// The unit.
        unit: String,
        /// Digits behind the decimal point.
        decimals: u8,
    },
    /// What the drive's scaling parameters for this quantity say.
    Scaled(String),
}

/// Which list an IDN stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum IdnPart {
    /// IEC 61800-7-204: the drive profile.
    Profile,
    /// Elsewhere: communication and generic device profile.
    Communication,
}

/// One IDN.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SercosIdn {
    /// The number; structure instance 0 when the row stands for every instance.
    pub idn: Idn,
    /// Whether the row stands for every structure instance.
    pub every_instance: bool,
    /// The list it stands in.
    pub part: IdnPart,
    /// Its name; empty when only the number is known.
    pub name: String,
    /// Clause of IEC 61800-7-204; empty when that does not list it.
    pub clause: String,
    /// Function group or drive function, by the name; mostly empty.
    pub group: String,
    /// Bytes of the value or of a list item as the documents have it; `None` when only the drive knows.
    pub length: Option<u8>,
    /// Whether it is a list.
    pub list: bool,
    /// Display format.
    pub format: Option<IdnFormat>,
    /// Whether it is a procedure command.
    pub command: bool,
    /// Unit.
    pub unit: IdnUnit,
    /// Digits behind the decimal point, as drives show it.
    pub decimals: Option<u8>,
    /// Communication phases in which it can be written; `None` when not known.
    pub write: Option<Vec<u8>>,
    /// Keys of the documents that have it in the AT; empty when none does.
    pub in_at: String,
    /// Keys of the documents that have it in the MDT; empty when none does.
    pub in_mdt: String,
    /// Element 3 of a live drive.
    pub attribute: Option<u32>,
    /// What one source shows, in its own scaling; mostly empty.
    pub range: String,
    /// Keys of the documents it was read in.
    pub source: String,
    /// How far to trust it.
    pub confidence: Confidence,
    /// Anything worth knowing; mostly empty.
    pub note: String,
}

impl SercosIdn {
    /// Bytes of the value or of a list item on SERCOS III, where an IDN has four bytes; the manuals of SERCOS I/II drives
    /// that most rows were read in show the two that it has there.
    pub fn length_on_sercos_3(&self) -> Option<u8> {
        const IDN_BYTES: u8 = 4;
        if self.format == Some(IdnFormat::Idn) { Some(IDN_BYTES) } else { self.length }
    }

    /// The number as the file has it.
    pub fn number(&self) -> String {
        let text = self.idn.to_string();
        if !self.every_instance {
            return text;
        }
        match text.rsplit_once('.') {
            Some((front, element)) => format!("{}.x.{element}", front.trim_end_matches(".0")),
            None => text,
        }
    }

    /// Whether more is known than number and name.
    pub fn is_known(&self) -> bool {
        self.confidence != Confidence::Unknown
    }
}

/// An IDN as rows name it, and whether it stands for every structure instance.
pub(super) fn parse_idn(key: &str, name: &Name, resolver: &mut Resolver<'_>) -> Option<(Idn, bool)> {
    let text = name.get_ref();
    let every = text.contains(".x.");
    match text.replacen(".x.", ".0.", 1).parse() {
        Ok(idn) => Some((idn, every)),
        Err(error) => {
            resolver.error(
                code::BAD_IDN,
                name.span(),
                key,
                format!("expected an IDN, got `{text}`: {error}"),
            );
            None
        }
    }
}

/// Reads one list behind those that are there already.
pub(super) fn resolve_idns(
    file: &Parsed<SercosIdnFile>,
    part: IdnPart,
    terms: &SercosTerms,
    idns: &mut Vec<SercosIdn>,
    errors: &mut Findings,
) {
    let mut resolver = Resolver::new(&file.text, errors);
    let rows = &file.rows;
    resolver.head(&rows.format, "profile", &rows.profile, "sercos");
    for row in &rows.idn {
        let Some(idn) = resolve_idn(row, part, terms, &mut resolver) else { continue };
        if idns.iter().any(|known| known.idn == idn.idn) {
            resolver.error(code::TWICE, row.idn.span(), "idn", format!("{} is defined twice", idn.number()));
        }
        idns.push(idn);
    }
}

fn resolve_idn(
    row: &IdnRow,
    part: IdnPart,
    terms: &SercosTerms,
    resolver: &mut Resolver<'_>,
) -> Option<SercosIdn> {
    let (idn, every_instance) = parse_idn("idn", &row.idn, resolver)?;
    if part == IdnPart::Profile && row.clause.is_none() {
        resolver.error(
            code::MISSING_KEY,
            row.idn.span(),
            "clause",
            "expected the clause of IEC 61800-7-204, got none",
        );
    }
    let trust = terms.documents.trust(&row.source, &row.confidence, resolver);
    let format = match &row.format {
        Some(name) => Some(resolver.word("format", name, IdnFormat::NAMED)?),
        None => None,
    };
    if let Some(length) = &row.length
        && ![1, 2, 4, 8].contains(length.get_ref())
    {
        resolver.error(
            code::OUT_OF_RANGE,
            length.span(),
            "length",
            format!("expected 1, 2, 4 or 8, got {}", length.get_ref()),
        );
        return None;
    }
    check_write(row, resolver);
    check_attribute(row, format, resolver);
    let shown = row.attribute.as_ref().map(|attribute| Attribute(*attribute.get_ref()).decimals());
    let decimals = row.decimals.as_ref().map(|decimals| *decimals.get_ref()).or(shown);
    let unit = match (&row.scaling, &row.unit) {
        (Some(scaling), None) => IdnUnit::Scaled(terms.scaling(scaling, resolver)?),
        (None, Some(unit)) => {
            IdnUnit::Fixed { unit: terms.unit(unit, resolver)?, decimals: decimals.unwrap_or(0) }
        }
        (None, None) => IdnUnit::None,
        (Some(_), Some(unit)) => {
            resolver.error(
                code::CONTRADICTION,
                unit.span(),
                "unit",
                "expected `scaling` or `unit`, got both",
            );
            return None;
        }
    };
    let group = row.group.as_ref().and_then(|group| terms.group(group, resolver));
    let [in_at, in_mdt] = cyclic(row, terms, resolver);
    if trust.confidence == Confidence::Unknown && says_something(row) {
        let message = "expected nothing but number, name and `command` where nothing is known";
        resolver.error(code::UNTRUSTED, row.confidence.span(), "confidence", message);
    }
    Some(SercosIdn {
        idn,
        every_instance,
        part,
        name: row.name.clone().unwrap_or_default(),
        clause: row.clause.clone().unwrap_or_default(),
        group: group.unwrap_or_default(),
        length: row.length.as_ref().map(|length| *length.get_ref()),
        list: row.list,
        format,
        command: row.command,
        unit,
        decimals,
        write: row.write.as_ref().map(|write| write.get_ref().clone()),
        in_at,
        in_mdt,
        attribute: row.attribute.as_ref().map(|attribute| *attribute.get_ref()),
        range: row.range.clone().unwrap_or_default(),
        source: trust.source,
        confidence: trust.confidence,
        note: row.note.clone().unwrap_or_default(),
    })
}

/// Whether a row has a key that somebody must have read somewhere.
fn says_something(row: &IdnRow) -> bool {
    row.length.is_some()
        || row.list
        || row.format.is_some()
        || row.scaling.is_some()
        || row.unit.is_some()
        || row.decimals.is_some()
        || row.write.is_some()
        || row.cyclic.is_some()
        || row.attribute.is_some()
        || row.range.is_some()
}

fn check_write(row: &IdnRow, resolver: &mut Resolver<'_>) {
    let Some(write) = &row.write else { return };
    let phases = write.get_ref();
    let rising = phases.windows(2).all(|pair| pair[0] < pair[1]);
    if !rising || phases.iter().any(|phase| !(2..=4).contains(phase)) {
        let message = format!("expected phases 2 to 4 in rising order, got {phases:?}");
        resolver.error(code::OUT_OF_RANGE, write.span(), "write", message);
    }
}

/// A row says what element 3 of the live drive says.
fn check_attribute(row: &IdnRow, format: Option<IdnFormat>, resolver: &mut Resolver<'_>) {
    let Some(word) = &row.attribute else { return };
    let attribute = Attribute(*word.get_ref());
    let length = row.length.as_ref().map(|length| *length.get_ref());
    let decimals = row.decimals.as_ref().map_or(0, |decimals| *decimals.get_ref());
    let same = length == Some(attribute.item_length().bytes())
        && row.list == attribute.is_list()
        && row.command == attribute.is_command()
        && format.map(IdnFormat::of_attribute) == Some(attribute.format())
        && decimals == attribute.decimals()
        && row.write.as_ref().is_none_or(|write| can_write(attribute, write.get_ref()));
    if !same {
        let message = format!("expected what the row says, got {:#010X}: {attribute}", attribute.0);
        resolver.error(code::CONTRADICTS_ATTRIBUTE, word.span(), "attribute", message.replace("0X", "0x"));
    }
}

/// Whether the phases are among those of the attribute, and are none only when the attribute has none.
fn can_write(attribute: Attribute, phases: &[u8]) -> bool {
    let open = (2..=4).filter(|phase| !attribute.write_protected(*phase)).count();
    phases.iter().all(|phase| !attribute.write_protected(*phase)) && (open == 0 || !phases.is_empty())
}

fn cyclic(row: &IdnRow, terms: &SercosTerms, resolver: &mut Resolver<'_>) -> [String; 2] {
    let Some(cyclic) = &row.cyclic else { return [String::new(), String::new()] };
    let keys = cyclic.get_ref();
    if keys.at.is_none() && keys.mdt.is_none() {
        resolver.error(
            code::CONTRADICTION,
            cyclic.span(),
            "cyclic",
            "expected `at`, `mdt` or both, got neither",
        );
    }
    [("at", &keys.at), ("mdt", &keys.mdt)].map(|(key, source)| match source {
        Some(source) => {
            let _ = terms.documents.families(source, key, resolver);
            source.get_ref().clone()
        }
        None => String::new(),
    })
}
