//! Reading the table files: built in, from a folder in their place, and what is laid over them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::format::{
    Cia402CodeFile, Cia402ObjectFile, CipAttributeFile, CipEnumerationFile, CipFaultFile, CipGenericFile,
    CipNetworkFile, CipServiceFile, GenericCia402File, GenericFile, GenericSercosFile, SercosBitFile,
    SercosCodeFile, SercosIdnFile, SercosTermFile,
};
use super::overlay::{self, FAMILIES, Overlay, ParsedFamily};
use super::rows;
use crate::finding::registry as code;
use crate::finding::{Findings, Source, read_file};

/// The file format this build understands.
pub const FORMAT: u32 = 1;

/// The largest table file that is read: ten times the largest one shipped.
pub const MAX_FILE_BYTES: u64 = 2 * 1024 * 1024;

/// Where each file lies below the folder, and the text built into the binary.
pub(super) const FILES: [(&str, &str); 16] = [
    ("dictionary/generic.toml", include_str!("../tables/dictionary/generic.toml")),
    ("dictionary/cip-attributes.toml", include_str!("../tables/dictionary/cip-attributes.toml")),
    ("dictionary/cip-enumerations.toml", include_str!("../tables/dictionary/cip-enumerations.toml")),
    ("dictionary/cip-faults.toml", include_str!("../tables/dictionary/cip-faults.toml")),
    ("dictionary/cip-services.toml", include_str!("../tables/dictionary/cip-services.toml")),
    ("dictionary/cip-networks.toml", include_str!("../tables/dictionary/cip-networks.toml")),
    ("dictionary/sercos-terms.toml", include_str!("../tables/dictionary/sercos-terms.toml")),
    ("dictionary/sercos-idns.toml", include_str!("../tables/dictionary/sercos-idns.toml")),
    ("dictionary/sercos-communication.toml", include_str!("../tables/dictionary/sercos-communication.toml")),
    ("dictionary/sercos-bits.toml", include_str!("../tables/dictionary/sercos-bits.toml")),
    ("dictionary/sercos-codes.toml", include_str!("../tables/dictionary/sercos-codes.toml")),
    ("dictionary/cia402-objects.toml", include_str!("../tables/dictionary/cia402-objects.toml")),
    ("dictionary/cia402-codes.toml", include_str!("../tables/dictionary/cia402-codes.toml")),
    ("cip-generic.toml", include_str!("../tables/cip-generic.toml")),
    ("generic-sercos.toml", include_str!("../tables/generic-sercos.toml")),
    ("generic-cia402.toml", include_str!("../tables/generic-cia402.toml")),
];

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

/// The texts of all table files, and what is laid over them.
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
    /// CiA 402 dictionary: documents, units, objects.
    pub cia402_objects: TableText,
    /// CiA 402 dictionary: codes, bits and states.
    pub cia402_codes: TableText,
    /// CIP Motion to generic.
    pub cip_generic: TableText,
    /// Generic to SERCOS.
    pub generic_sercos: TableText,
    /// Generic to CiA 402.
    pub generic_cia402: TableText,
    /// Shipped settings of families of drives.
    pub families: Vec<Overlay>,
    /// What is laid over them, in this order.
    pub overlays: Vec<Overlay>,
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
    /// CiA 402 dictionary: documents, units, objects.
    pub cia402_objects: Parsed<Cia402ObjectFile>,
    /// CiA 402 dictionary: codes, bits and states.
    pub cia402_codes: Parsed<Cia402CodeFile>,
    /// CIP Motion to generic.
    pub cip_generic: Parsed<CipGenericFile>,
    /// Generic to SERCOS.
    pub generic_sercos: Parsed<GenericSercosFile>,
    /// Generic to CiA 402.
    pub generic_cia402: Parsed<GenericCia402File>,
}

impl TableTexts {
    /// The tables built into the binary.
    pub fn embedded() -> Self {
        Self::from_array(
            FILES.map(|(path, text)| TableText {
                path: format!("mappings/tables/{path}"),
                text: text.to_owned(),
            }),
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
            cia402_objects,
            cia402_codes,
            cip_generic,
            generic_sercos,
            generic_cia402,
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
            cia402_objects,
            cia402_codes,
            cip_generic,
            generic_sercos,
            generic_cia402,
            families: FAMILIES
                .map(|(path, text)| Overlay::new(&format!("mappings/tables/{path}"), text))
                .to_vec(),
            overlays: Vec::new(),
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
            cia402_objects,
            cia402_codes,
            cip_generic,
            generic_sercos,
            generic_cia402,
            families: _,
            overlays: _,
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
            cia402_objects,
            cia402_codes,
            cip_generic,
            generic_sercos,
            generic_cia402,
        ]
    }

    /// Parses all files and lays over them what is to be laid over them; families of drives have tables of their own.
    /// `None` with errors: every file that is no TOML,
    /// or has unknown, missing or mistyped keys, with the place.
    pub(super) fn parse(&self, findings: &mut Findings) -> Option<(Tables, Vec<ParsedFamily>)> {
        let (shipped, own) =
            (overlay::layers(&self.families, findings), overlay::layers(&self.overlays, findings));
        let (layers, of_families): (Vec<_>, Vec<_>) = own.iter().partition(|layer| layer.is_general());
        let of_families: Vec<_> = shipped.iter().chain(of_families).collect();
        let generic = rows::parse(&self.generic, "generic", &layers, findings);
        let cip_attributes = rows::parse(&self.cip_attributes, "cip-attributes", &layers, findings);
        let cip_enumerations = rows::parse(&self.cip_enumerations, "cip-enumerations", &layers, findings);
        let cip_faults = rows::parse(&self.cip_faults, "cip-faults", &layers, findings);
        let cip_services = rows::parse(&self.cip_services, "cip-services", &layers, findings);
        let cip_networks = rows::parse(&self.cip_networks, "cip-networks", &layers, findings);
        let sercos_terms = rows::parse(&self.sercos_terms, "sercos-terms", &layers, findings);
        let sercos_idns = rows::parse(&self.sercos_idns, "sercos-idns", &layers, findings);
        let sercos_communication =
            rows::parse(&self.sercos_communication, "sercos-communication", &layers, findings);
        let sercos_bits = rows::parse(&self.sercos_bits, "sercos-bits", &layers, findings);
        let sercos_codes = rows::parse(&self.sercos_codes, "sercos-codes", &layers, findings);
        let cia402_objects = rows::parse(&self.cia402_objects, "cia402-objects", &layers, findings);
        let cia402_codes = rows::parse(&self.cia402_codes, "cia402-codes", &layers, findings);
        let cip_generic = rows::parse(&self.cip_generic, "cip-generic", &layers, findings);
        let generic_sercos = rows::parse(&self.generic_sercos, "generic-sercos", &layers, findings);
        let generic_cia402 = rows::parse(&self.generic_cia402, "generic-cia402", &layers, findings);
        if findings.has_errors() {
            return None;
        }
        let families = overlay::parse_families(&self.generic_cia402, &layers, &of_families, findings);
        let tables = Tables {
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
            cia402_objects: cia402_objects?,
            cia402_codes: cia402_codes?,
            cip_generic: cip_generic?,
            generic_sercos: generic_sercos?,
            generic_cia402: generic_cia402?,
        };
        Some((tables, families))
    }
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
