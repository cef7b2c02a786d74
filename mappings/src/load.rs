//! Reading the table files: built in, from a folder in their place, and what is laid over them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::format::{
    Cia402CodeFile, Cia402ObjectFile, CipAttributeFile, CipEnumerationFile, CipFaultFile, CipGenericFile,
    CipNetworkFile, CipServiceFile, GenericCia402File, GenericFile, GenericSercosFile, SercosBitFile,
    SercosCodeFile, SercosIdnFile, SercosTermFile,
};
use super::overlay::{self, FAMILIES, Layer, Overlay, ParsedFamily};
use super::rows;
use crate::finding::registry as code;
use crate::finding::{Findings, Source, read_file};

/// The file format this build understands.
pub const FORMAT: u32 = 1;

/// How the paths of the tables in the binary begin in messages.
pub(crate) const SHIPPED: &str = "mappings/tables/";

/// The largest table file that is read: ten times the largest one shipped.
pub const MAX_FILE_BYTES: u64 = 2 * 1024 * 1024;

/// Declares the texts and the rows of all table files: field, rows and place below the folder of each.
macro_rules! table_files {
    ($( #[$doc:meta] $field:ident: $rows:ident = $path:literal; )*) => {
        /// Where each file lies below the folder, and the text built into the binary.
        pub(super) const FILES: [(&str, &str); COUNT] =
            [$( ($path, include_str!(concat!("../tables/", $path))) ),*];

        const COUNT: usize = [$( $path ),*].len();

        /// The texts of all table files, and what is laid over them.
        #[derive(Debug, Clone)]
        pub struct TableTexts {
            $( #[$doc] pub $field: TableText, )*
            /// Shipped settings of families of drives.
            pub families: Vec<Overlay>,
            /// What is laid over them, in this order.
            pub overlays: Vec<Overlay>,
        }

        /// All table files, parsed but not resolved.
        #[derive(Debug, Clone)]
        pub struct Tables {
            $( #[$doc] pub $field: Parsed<$rows>, )*
        }

        impl TableTexts {
            /// The texts in the order of [`FILES`], with those of the families in the binary.
            fn from_array([$( $field ),*]: [TableText; COUNT]) -> Self {
                let family = |(path, text): (&str, &str)| Overlay::new(&format!("{SHIPPED}{path}"), text);
                Self { $( $field, )* families: FAMILIES.map(family).to_vec(), overlays: Vec::new() }
            }

            fn as_array_mut(&mut self) -> [&mut TableText; COUNT] {
                [$( &mut self.$field ),*]
            }

            /// The rows of every file; `None` when one of them cannot be read into rows.
            fn rows(&self, layers: &[&Layer<'_>], findings: &mut Findings) -> Option<Tables> {
                $( let $field = rows::parse(&self.$field, table_name($path), layers, findings); )*
                Some(Tables { $( $field: $field? ),* })
            }
        }
    };
}

table_files! {
    /// Generic dictionary.
    generic: GenericFile = "dictionary/generic.toml";
    /// CIP Motion dictionary: attributes.
    cip_attributes: CipAttributeFile = "dictionary/cip-attributes.toml";
    /// CIP Motion dictionary: codes and bits.
    cip_enumerations: CipEnumerationFile = "dictionary/cip-enumerations.toml";
    /// CIP Motion dictionary: faults, alarms and inhibits.
    cip_faults: CipFaultFile = "dictionary/cip-faults.toml";
    /// CIP Motion dictionary: services.
    cip_services: CipServiceFile = "dictionary/cip-services.toml";
    /// CIP Motion dictionary: networks.
    cip_networks: CipNetworkFile = "dictionary/cip-networks.toml";
    /// SERCOS dictionary: sources, units, function groups.
    sercos_terms: SercosTermFile = "dictionary/sercos-terms.toml";
    /// SERCOS dictionary: the drive profile.
    sercos_idns: SercosIdnFile = "dictionary/sercos-idns.toml";
    /// SERCOS dictionary: IDNs of the communication.
    sercos_communication: SercosIdnFile = "dictionary/sercos-communication.toml";
    /// SERCOS dictionary: bits.
    sercos_bits: SercosBitFile = "dictionary/sercos-bits.toml";
    /// SERCOS dictionary: codes.
    sercos_codes: SercosCodeFile = "dictionary/sercos-codes.toml";
    /// CiA 402 dictionary: documents, units, objects.
    cia402_objects: Cia402ObjectFile = "dictionary/cia402-objects.toml";
    /// CiA 402 dictionary: codes, bits and states.
    cia402_codes: Cia402CodeFile = "dictionary/cia402-codes.toml";
    /// CIP Motion to generic.
    cip_generic: CipGenericFile = "cip-generic.toml";
    /// Generic to SERCOS.
    generic_sercos: GenericSercosFile = "generic-sercos.toml";
    /// Generic to CiA 402.
    generic_cia402: GenericCia402File = "generic-cia402.toml";
}

/// The name of a table: that of its file without folder and ending.
pub(super) fn table_name(path: &str) -> &str {
    let file = path.rsplit(['/', '\\']).next().unwrap_or(path);
    file.strip_suffix(".toml").unwrap_or(file)
}

/// The text of one table file and what it is called in messages.
#[derive(Debug, Clone)]
pub struct TableText {
    /// Path as shown in messages.
    pub path: String,
    /// The whole text.
    pub text: String,
}

/// A parsed file together with its text; what many mappings have in common is there once.
#[derive(Debug)]
pub struct Parsed<T> {
    /// The text, and that of what was laid over it, for messages.
    pub text: Arc<Source>,
    /// The rows.
    pub rows: Arc<T>,
}

impl<T> Parsed<T> {
    /// Rows and their text.
    pub(super) fn new(text: Source, rows: T) -> Self {
        Self { text: Arc::new(text), rows: Arc::new(rows) }
    }
}

impl<T> Clone for Parsed<T> {
    fn clone(&self) -> Self {
        Self { text: Arc::clone(&self.text), rows: Arc::clone(&self.rows) }
    }
}

impl TableTexts {
    /// The tables built into the binary.
    pub fn embedded() -> Self {
        Self::from_array(
            FILES.map(|(path, text)| TableText { path: format!("{SHIPPED}{path}"), text: text.to_owned() }),
        )
    }

    /// The tables in `folder`; a file that is not there is taken from the binary.
    ///
    /// # Errors
    /// The folder cannot be read, a file is too large or not UTF-8, or there is a `.toml` file that is none
    /// of these: a misspelt name would otherwise be ignored without a word.
    pub fn from_folder(folder: &Path) -> Result<Self, Findings> {
        let mut findings = Findings::default();
        for below in [PathBuf::new(), PathBuf::from("dictionary"), PathBuf::from("families")] {
            refuse_strangers(folder, &below, &mut findings);
        }
        let mut texts = Self::embedded();
        for ((path, _), table) in FILES.iter().zip(texts.as_array_mut()) {
            let path = folder.join(path);
            if path.exists() {
                match read_file(&path, MAX_FILE_BYTES) {
                    Ok(text) => *table = TableText { path: path.display().to_string(), text },
                    Err(found) => findings.extend(found),
                }
            }
        }
        for ((path, _), family) in FAMILIES.iter().zip(&mut texts.families) {
            let path = folder.join(path);
            if path.exists() {
                match read_file(&path, MAX_FILE_BYTES) {
                    Ok(text) => *family = Overlay::new(&path.display().to_string(), &text),
                    Err(found) => findings.extend(found),
                }
            }
        }
        findings.into_result(texts)
    }

    /// The tables in a folder, or those in the binary, and over them files or folders of files.
    ///
    /// # Errors
    /// What cannot be read.
    pub fn load(folder: Option<&Path>, overlays: &[PathBuf]) -> Result<Self, Findings> {
        let mut findings = Findings::default();
        let mut texts = match folder.map(Self::from_folder) {
            None => Self::embedded(),
            Some(Ok(texts)) => texts,
            Some(Err(found)) => {
                findings.extend(found);
                Self::embedded()
            }
        };
        for path in overlays {
            texts.lay_over(path, &mut findings);
        }
        findings.into_result(texts)
    }

    /// Whether a path is a folder with a file that replaces a table; else it is an overlay, or a folder of them.
    pub fn replaces(path: &Path) -> bool {
        path.is_dir() && FILES.iter().any(|(file, _)| path.join(file).exists())
    }

    /// Parses all files and lays over them what is to be laid over them; families of drives have tables of their own. Rows with
    /// unknown, missing or mistyped keys are found and left out, so that the others can still be looked at. `None` when a file is no
    /// TOML.
    pub(super) fn parse(&self, findings: &mut Findings) -> Option<(Tables, Vec<ParsedFamily>)> {
        let (shipped, own) =
            (overlay::layers(&self.families, findings), overlay::layers(&self.overlays, findings));
        let (layers, of_families): (Vec<_>, Vec<_>) = own.iter().partition(|layer| layer.is_general());
        let of_families: Vec<_> = shipped.iter().chain(of_families).collect();
        let tables = self.rows(&layers, findings)?;
        let mut found = Findings::default();
        let families = overlay::parse_families(&self.generic_cia402, &layers, &of_families, &mut found);
        extend_with_families(findings, found);
        Some((tables, families))
    }
}

/// Adds what was found in the tables of families. What an overlay for all drives makes of the shipped ones only follows from it.
pub(crate) fn extend_with_families(findings: &mut Findings, mut found: Findings) {
    if findings.has_errors() {
        found.retain(|finding| !finding.file.starts_with(SHIPPED));
    }
    findings.extend(found);
}

fn refuse_strangers(folder: &Path, below: &Path, findings: &mut Findings) {
    let place = folder.join(below);
    if !below.as_os_str().is_empty() && !place.exists() {
        return;
    }
    let entries = match place.read_dir() {
        Ok(entries) => entries,
        Err(error) => {
            return findings.push_file(code::UNREADABLE, &place, format!("expected a folder, got: {error}"));
        }
    };
    for entry in entries.flatten() {
        let path = below.join(entry.file_name());
        let is_table = path.extension().is_some_and(|extension| extension == "toml");
        let files = || FILES.iter().chain(&FAMILIES).map(|(known, _)| *known);
        if is_table && !files().any(|known| Path::new(known) == path) {
            let known: Vec<&str> = files().collect();
            let message = format!("expected one of {}, got `{}`", known.join(", "), path.display());
            findings.push_file(code::STRANGER, &folder.join(&path), message);
        }
    }
}
