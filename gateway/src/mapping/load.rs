//! Reading the table files, built in or from a folder, and reporting what is wrong with them.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use serde::de::DeserializeOwned;

use super::format::{
    CipAttributeFile, CipEnumerationFile, CipFaultFile, CipGenericFile, CipNetworkFile, CipServiceFile,
    GenericFile, GenericSercosFile, SercosBitFile, SercosCodeFile, SercosIdnFile, SercosTermFile,
};

/// The file format this build understands.
pub const FORMAT: u32 = 1;

/// The largest table file that is read: ten times the largest one shipped.
pub const MAX_FILE_BYTES: u64 = 2 * 1024 * 1024;

/// Where each file lies below the folder, and the text built into the binary.
const FILES: [(&str, &str); 13] = [
    ("dictionary/generic.toml", include_str!("../../../mappings/dictionary/generic.toml")),
    ("dictionary/cip-attributes.toml", include_str!("../../../mappings/dictionary/cip-attributes.toml")),
    ("dictionary/cip-enumerations.toml", include_str!("../../../mappings/dictionary/cip-enumerations.toml")),
    ("dictionary/cip-faults.toml", include_str!("../../../mappings/dictionary/cip-faults.toml")),
    ("dictionary/cip-services.toml", include_str!("../../../mappings/dictionary/cip-services.toml")),
    ("dictionary/cip-networks.toml", include_str!("../../../mappings/dictionary/cip-networks.toml")),
    ("dictionary/sercos-terms.toml", include_str!("../../../mappings/dictionary/sercos-terms.toml")),
    ("dictionary/sercos-idns.toml", include_str!("../../../mappings/dictionary/sercos-idns.toml")),
    (
        "dictionary/sercos-communication.toml",
        include_str!("../../../mappings/dictionary/sercos-communication.toml"),
    ),
    ("dictionary/sercos-bits.toml", include_str!("../../../mappings/dictionary/sercos-bits.toml")),
    ("dictionary/sercos-codes.toml", include_str!("../../../mappings/dictionary/sercos-codes.toml")),
    ("cip-generic.toml", include_str!("../../../mappings/cip-generic.toml")),
    ("generic-sercos.toml", include_str!("../../../mappings/generic-sercos.toml")),
];

/// The text of one table file and what it is called in messages.
#[derive(Debug, Clone)]
pub struct TableText {
    /// Path as shown in messages.
    pub path: String,
    /// The whole text.
    pub text: String,
}

/// The texts of all table files.
#[derive(Debug, Clone)]
pub struct TableTexts {
    /// Generic dictionary.
    pub generic: TableText,
    /// CIP Motion dictionary: attributes.
    pub cip_attributes: TableText,
    /// CIP Motion dictionary: codes and bits.
    pub cip_enumerations: TableText,
    /// CIP Motion dictionary: faults, alarms and inhibits.
    pub cip_faults: TableText,
    /// CIP Motion dictionary: services.
    pub cip_services: TableText,
    /// CIP Motion dictionary: networks.
    pub cip_networks: TableText,
    /// SERCOS dictionary: sources, units, function groups.
    pub sercos_terms: TableText,
    /// SERCOS dictionary: the drive profile.
    pub sercos_idns: TableText,
    /// SERCOS dictionary: IDNs of the communication.
    pub sercos_communication: TableText,
    /// SERCOS dictionary: bits.
    pub sercos_bits: TableText,
    /// SERCOS dictionary: codes.
    pub sercos_codes: TableText,
    /// CIP Motion to generic.
    pub cip_generic: TableText,
    /// Generic to SERCOS.
    pub generic_sercos: TableText,
}

/// A parsed file together with its text.
#[derive(Debug, Clone)]
pub struct Parsed<T> {
    /// The text, for messages.
    pub text: TableText,
    /// The rows.
    pub rows: T,
}

/// All table files, parsed but not resolved.
#[derive(Debug, Clone)]
pub struct Tables {
    /// Generic dictionary.
    pub generic: Parsed<GenericFile>,
    /// CIP Motion dictionary: attributes.
    pub cip_attributes: Parsed<CipAttributeFile>,
    /// CIP Motion dictionary: codes and bits.
    pub cip_enumerations: Parsed<CipEnumerationFile>,
    /// CIP Motion dictionary: faults, alarms and inhibits.
    pub cip_faults: Parsed<CipFaultFile>,
    /// CIP Motion dictionary: services.
    pub cip_services: Parsed<CipServiceFile>,
    /// CIP Motion dictionary: networks.
    pub cip_networks: Parsed<CipNetworkFile>,
    /// SERCOS dictionary: sources, units, function groups.
    pub sercos_terms: Parsed<SercosTermFile>,
    /// SERCOS dictionary: the drive profile.
    pub sercos_idns: Parsed<SercosIdnFile>,
    /// SERCOS dictionary: IDNs of the communication.
    pub sercos_communication: Parsed<SercosIdnFile>,
    /// SERCOS dictionary: bits.
    pub sercos_bits: Parsed<SercosBitFile>,
    /// SERCOS dictionary: codes.
    pub sercos_codes: Parsed<SercosCodeFile>,
    /// CIP Motion to generic.
    pub cip_generic: Parsed<CipGenericFile>,
    /// Generic to SERCOS.
    pub generic_sercos: Parsed<GenericSercosFile>,
}

/// One thing that is wrong with a table file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableError {
    /// The file.
    pub file: String,
    /// Line, 1 first; 0 when the file could not be read at all.
    pub line: usize,
    /// Column in characters, 1 first.
    pub column: usize,
    /// The key whose value is wrong; empty when the text is no TOML.
    pub key: String,
    /// What was expected and what came.
    pub message: String,
    rendered: String,
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.rendered)
    }
}

/// Everything that is wrong with the table files.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TableErrors(pub Vec<TableError>);

impl fmt::Display for TableErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, error) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str("\n\n")?;
            }
            write!(f, "{error}")?;
        }
        Ok(())
    }
}

impl std::error::Error for TableErrors {}

impl TableErrors {
    /// `Ok` when nothing is wrong.
    pub(super) fn into_result<T>(self, value: T) -> Result<T, TableErrors> {
        if self.0.is_empty() { Ok(value) } else { Err(self) }
    }

    /// Notes that the value of `key`, which stands at `span`, is wrong.
    pub(super) fn push(
        &mut self,
        file: &TableText,
        span: Range<usize>,
        key: &str,
        message: impl Into<String>,
    ) {
        let message = message.into();
        let (line, column) = file.place(span.start);
        let title = if key.is_empty() { message.clone() } else { format!("`{key}`: {message}") };
        let end = file.text.len();
        let span = span.start.min(end)..span.end.min(end);
        let report = [Level::ERROR.primary_title(&title).element(
            Snippet::source(file.text.as_str())
                .path(&file.path)
                .annotation(AnnotationKind::Primary.span(span)),
        )];
        let rendered = Renderer::plain().decor_style(DecorStyle::Ascii).render(&report);
        self.0.push(TableError {
            file: file.path.clone(),
            line,
            column,
            key: key.to_owned(),
            message,
            rendered,
        });
    }

    fn unreadable(path: &Path, message: String) -> Self {
        let file = path.display().to_string();
        let rendered = format!("error: {message}\n --> {file}");
        TableErrors(vec![TableError { file, line: 0, column: 0, key: String::new(), message, rendered }])
    }
}

impl TableText {
    /// Line and column of a byte offset, both from 1; the column counts characters.
    pub fn place(&self, offset: usize) -> (usize, usize) {
        let before = self.text.get(..offset).unwrap_or(&self.text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }

    pub(super) fn parse<T: DeserializeOwned>(self, errors: &mut TableErrors) -> Option<Parsed<T>> {
        match toml::from_str::<T>(&self.text) {
            Ok(rows) => Some(Parsed { text: self, rows }),
            Err(error) => {
                let span = error.span().unwrap_or(0..0);
                errors.push(&self, span, "", error.message());
                None
            }
        }
    }
}

impl TableTexts {
    /// The tables built into the binary.
    pub fn embedded() -> Self {
        Self::from_array(
            FILES.map(|(path, text)| TableText { path: format!("mappings/{path}"), text: text.to_owned() }),
        )
    }

    /// The tables in `folder`; a file that is not there is taken from the binary.
    ///
    /// # Errors
    /// The folder cannot be read, a file is too large or not UTF-8, or there is a `.toml` file that is none
    /// of these: a misspelt name would otherwise be ignored without a word.
    pub fn from_folder(folder: &Path) -> Result<Self, TableErrors> {
        for below in [PathBuf::new(), PathBuf::from("dictionary")] {
            refuse_strangers(folder, &below)?;
        }
        let mut texts = Self::embedded();
        for ((path, _), table) in FILES.iter().zip(texts.as_array_mut()) {
            let path = folder.join(path);
            if path.exists() {
                *table = TableText { path: path.display().to_string(), text: read(&path)? };
            }
        }
        Ok(texts)
    }

    /// The texts in the order of [`FILES`].
    fn from_array(texts: [TableText; FILES.len()]) -> Self {
        let [
            generic,
            cip_attributes,
            cip_enumerations,
            cip_faults,
            cip_services,
            cip_networks,
            sercos_terms,
            sercos_idns,
            sercos_communication,
            sercos_bits,
            sercos_codes,
            cip_generic,
            generic_sercos,
        ] = texts;
        Self {
            generic,
            cip_attributes,
            cip_enumerations,
            cip_faults,
            cip_services,
            cip_networks,
            sercos_terms,
            sercos_idns,
            sercos_communication,
            sercos_bits,
            sercos_codes,
            cip_generic,
            generic_sercos,
        }
    }

    fn as_array_mut(&mut self) -> [&mut TableText; FILES.len()] {
        let Self {
            generic,
            cip_attributes,
            cip_enumerations,
            cip_faults,
            cip_services,
            cip_networks,
            sercos_terms,
            sercos_idns,
            sercos_communication,
            sercos_bits,
            sercos_codes,
            cip_generic,
            generic_sercos,
        } = self;
        [
            generic,
            cip_attributes,
            cip_enumerations,
            cip_faults,
            cip_services,
            cip_networks,
            sercos_terms,
            sercos_idns,
            sercos_communication,
            sercos_bits,
            sercos_codes,
            cip_generic,
            generic_sercos,
        ]
    }

    /// Parses all files.
    ///
    /// # Errors
    /// Every file that is no TOML, or has unknown, missing or mistyped keys, with the place.
    pub fn parse(self) -> Result<Tables, TableErrors> {
        let mut errors = TableErrors::default();
        let generic = self.generic.parse(&mut errors);
        let cip_attributes = self.cip_attributes.parse(&mut errors);
        let cip_enumerations = self.cip_enumerations.parse(&mut errors);
        let cip_faults = self.cip_faults.parse(&mut errors);
        let cip_services = self.cip_services.parse(&mut errors);
        let cip_networks = self.cip_networks.parse(&mut errors);
        let sercos_terms = self.sercos_terms.parse(&mut errors);
        let sercos_idns = self.sercos_idns.parse(&mut errors);
        let sercos_communication = self.sercos_communication.parse(&mut errors);
        let sercos_bits = self.sercos_bits.parse(&mut errors);
        let sercos_codes = self.sercos_codes.parse(&mut errors);
        let cip_generic = self.cip_generic.parse(&mut errors);
        let generic_sercos = self.generic_sercos.parse(&mut errors);
        let tables = || {
            Some(Tables {
                generic: generic?,
                cip_attributes: cip_attributes?,
                cip_enumerations: cip_enumerations?,
                cip_faults: cip_faults?,
                cip_services: cip_services?,
                cip_networks: cip_networks?,
                sercos_terms: sercos_terms?,
                sercos_idns: sercos_idns?,
                sercos_communication: sercos_communication?,
                sercos_bits: sercos_bits?,
                sercos_codes: sercos_codes?,
                cip_generic: cip_generic?,
                generic_sercos: generic_sercos?,
            })
        };
        tables().ok_or(errors)
    }
}

fn refuse_strangers(folder: &Path, below: &Path) -> Result<(), TableErrors> {
    let place = folder.join(below);
    if !below.as_os_str().is_empty() && !place.exists() {
        return Ok(());
    }
    let unreadable = |error: std::io::Error| TableErrors::unreadable(&place, format!("cannot read: {error}"));
    for entry in place.read_dir().map_err(unreadable)? {
        let name = entry.map_err(unreadable)?.file_name();
        let path = below.join(&name);
        let is_table = path.extension().is_some_and(|extension| extension == "toml");
        if is_table && !FILES.iter().any(|(known, _)| Path::new(known) == path) {
            let known: Vec<&str> = FILES.iter().map(|(known, _)| *known).collect();
            let message = format!("expected one of {}, got `{}`", known.join(", "), path.display());
            return Err(TableErrors::unreadable(&folder.join(&path), message));
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<String, TableErrors> {
    let size = path.metadata().map_err(|e| TableErrors::unreadable(path, format!("cannot read: {e}")))?.len();
    if size > MAX_FILE_BYTES {
        let message = format!("expected at most {MAX_FILE_BYTES} bytes, got {size}");
        return Err(TableErrors::unreadable(path, message));
    }
    std::fs::read_to_string(path).map_err(|e| TableErrors::unreadable(path, format!("cannot read: {e}")))
}
