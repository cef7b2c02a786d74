//! A machine's own rows, laid over the shipped tables row by row.
//!
//! An overlay is a file of its own. It has rows of any table, each under the table's name, in the form of the table:
//!
//! ```toml
//! format = 1
//! overlay = "drives of line 4"
//! base = ["drive-family.toml"]   # overlays that come before this one
//!
//! [[generic-sercos.parameter]]   # known by its parameter: the other keys stay as they were
//! parameter = "jerk_limit"
//! missing = "reject"
//! ```
//!
//! `drives = { vendor_id = 0x2BE, product_codes = [0x13F7], source = "..." }` in the head makes it the settings of a family of CiA 402 drives:
//! its rows count for drives that say in 1018 that they are of it, and for no others. Some families are shipped ([`FAMILIES`]).
//!
//! A row that has the same identity ([`sections`]) as one that is there changes the keys that it has; `remove = true` takes it
//! away, `remove = ["reaction"]` takes keys away; any other row is added: before those that are there where the first one that fits
//! counts, behind them with `last = true`.

mod families;
mod merge;
mod sections;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use toml::de::{DeTable, DeValue};

use super::load::{FILES, FORMAT, MAX_FILE_BYTES, TableTexts, table_name};
use crate::finding::registry as code;
use crate::finding::{Findings, Problem, Source, Spanned, closest, partial, read_file, tree};

pub(super) use families::{FAMILIES, ParsedFamily, parse as parse_families};
pub(super) use merge::{Hints, canonical, lay};
pub use sections::{Section, sections};

/// The most overlays: one for the family of drives, one for the drive, one for the machine are usual.
pub const OVERLAYS_MAX: usize = 64;

/// The text of an overlay and what it is called in messages.
#[derive(Debug, Clone)]
pub struct Overlay {
    /// Path as shown in messages.
    pub path: Arc<str>,
    /// The whole text.
    pub text: Arc<str>,
}

impl Overlay {
    /// An overlay that is no file.
    pub fn new(path: &str, text: &str) -> Self {
        Self { path: path.into(), text: text.into() }
    }
}

/// The head of an overlay; the tables are read row by row.
#[derive(Debug, Deserialize, schemars::JsonSchema)]
pub struct OverlayHead {
    /// Version of the file format.
    pub format: Spanned<u32>,
    /// What it is for, in words.
    pub overlay: Spanned<String>,
    /// Overlays that come before this one; the paths count from the folder of this file.
    #[serde(default)]
    pub base: Vec<Spanned<String>>,
    /// The CiA 402 drives that it is for. Default: all.
    pub drives: Option<Spanned<DrivesHead>>,
}

/// Drives that an overlay is for, by what they say of themselves.
#[derive(Debug, Clone, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DrivesHead {
    /// Vendor-ID (1018:1).
    pub vendor_id: u32,
    /// Product codes (1018:2). Default: all of the vendor.
    #[serde(default)]
    pub product_codes: Vec<u32>,
    /// Where this was read.
    pub source: String,
}

/// The keys of the head.
const HEAD: [&str; 4] = ["format", "overlay", "base", "drives"];

/// The table of which a family of drives can have rows of its own.
const OF_FAMILIES: &str = "generic-cia402";

/// An overlay as a tree.
pub(super) struct Layer<'t> {
    overlay: &'t Overlay,
    tree: DeTable<'t>,
    /// What it is for, in words.
    name: String,
    /// The drives that it is for; `None`: all.
    drives: Option<DrivesHead>,
}

impl<'t> Layer<'t> {
    /// Whether it has rows of a table.
    pub fn touches(&self, table: &str) -> bool {
        self.tree.contains_key(table)
    }

    /// Whether it is for all drives.
    pub fn is_general(&self) -> bool {
        self.drives.is_none()
    }

    /// Adds its text to a source, and returns where it begins there.
    pub fn add_to(&self, source: &mut Source) -> usize {
        source.push(Arc::clone(&self.overlay.path), Arc::clone(&self.overlay.text))
    }

    /// Its rows of a table.
    fn rows(&self, table: &str) -> Option<&toml::Spanned<DeValue<'t>>> {
        self.tree.get(table)
    }
}

/// The overlays as trees, heads checked.
pub(super) fn layers<'t>(overlays: &'t [Overlay], findings: &mut Findings) -> Vec<Layer<'t>> {
    overlays.iter().filter_map(|overlay| layer(overlay, findings)).collect()
}

fn layer<'t>(overlay: &'t Overlay, findings: &mut Findings) -> Option<Layer<'t>> {
    let source = Source::new(&overlay.path, &overlay.text);
    let tree = tree(&overlay.text, &source, findings)?;
    if let Some(problem) = other_kind(tree.get_ref()) {
        findings.push(&source, problem);
        return None;
    }
    let hint = |problem: &Problem| {
        let help = "begin the file with `format = 1` and `overlay = \"what it is for\"`";
        (problem.code == code::MISSING_KEY).then(|| problem.clone().help(help))
    };
    let head = partial(tree.clone(), &source, findings, &hint).filter(|head| head.faultless);
    let head: Option<OverlayHead> = head.map(|head| head.rows);
    if let Some(head) = &head
        && *head.format.get_ref() != FORMAT
    {
        let message = format!("expected format {FORMAT}, got {}", head.format.get_ref());
        findings.push(
            &source,
            Problem::new(code::WRONG_HEAD, head.format.span()).key("format").expected(message),
        );
    }
    let tree = tree.into_inner();
    let (name, drives) = head
        .map(|head| (head.overlay.into_inner(), head.drives.map(Spanned::into_inner)))
        .unwrap_or_default();
    let names: Vec<&str> = FILES.iter().map(|(path, _)| table_name(path)).collect();
    for key in tree.keys().filter(|key| !HEAD.contains(&key.get_ref().as_ref())) {
        let name = key.get_ref().as_ref();
        if !names.contains(&name) {
            let problem = Problem::new(code::UNKNOWN_TABLE, key.span()).key(name);
            let problem = problem.expected("expected rows of a table, such as [[generic-sercos.parameter]]");
            let help = match closest(name, names.iter().copied()) {
                Some(close) => format!("did you mean `{close}`?"),
                None => match tables_with(name, &names).as_slice() {
                    [] => format!("the tables are {}", names.join(", ")),
                    heads => format!("write the name of the table as well: {}", heads.join(" or ")),
                },
            };
            findings.push(&source, problem.help(help));
        } else if drives.is_some() && name != OF_FAMILIES {
            let problem = Problem::new(code::CONTRADICTION, key.span()).key(name);
            findings.push(
                &source,
                problem.expected(format!(
                    "expected rows of {OF_FAMILIES}: the other tables are the same for all drives"
                )),
            );
        }
    }
    Some(Layer { overlay, tree, name, drives })
}

/// The heads that a list has in the tables that have it.
fn tables_with(list: &str, names: &[&str]) -> Vec<String> {
    let has = |name: &&&str| sections(name).iter().any(|section| section.name == list);
    names.iter().filter(has).map(|name| format!("[[{name}.{list}]]")).collect()
}

/// What is wrong with a file of another kind that was named as an overlay.
fn other_kind(tree: &DeTable<'_>) -> Option<Problem> {
    const CONFIGURATION: [&str; 4] = ["box", "south", "device", "axis"];
    if tree.contains_key("overlay") {
        return None;
    }
    let (key, value) = tree
        .iter()
        .filter(|(key, _)| !HEAD.contains(&key.get_ref().as_ref()))
        .min_by_key(|(key, _)| key.span().start)?;
    let problem = |title: &str| {
        Problem::new(code::WRONG_HEAD, key.span())
            .title(title)
            .expected("expected the head `overlay = \"...\"`")
    };
    if ["mapping", "profile"].contains(&key.get_ref().as_ref()) && value.get_ref().as_str().is_some() {
        let help = "a table replaces a shipped one under the same file name, in a folder that `dir` of [mappings] or --mappings names";
        return Some(problem("this file is a table, not an overlay").help(help));
    }
    if CONFIGURATION.iter().filter(|key| tree.contains_key(**key)).count() > 1 {
        return Some(problem("this file is a configuration, not an overlay").help("name it with --config"));
    }
    if tree.contains_key("step") {
        return Some(
            problem("this file is a script, not an overlay").help("`axisbridge simulate` runs scripts"),
        );
    }
    None
}

impl TableTexts {
    /// Lays a file, or the files of a folder in the order of their names, over the tables; what they build on comes first. What
    /// cannot be read, or builds on itself, is a finding.
    pub fn lay_over(&mut self, path: &Path, findings: &mut Findings) {
        let files = if path.is_dir() { files_of(path, findings) } else { vec![path.to_owned()] };
        let mut reader = Reader { overlays: &mut self.overlays, findings, above: Vec::new() };
        for file in files {
            reader.read(&file, None);
        }
    }
}

/// The overlays of a folder, in the order of their names. One without any is as wrong as a file that is not there.
fn files_of(folder: &Path, findings: &mut Findings) -> Vec<PathBuf> {
    let entries: Result<Vec<_>, _> = folder.read_dir().and_then(Iterator::collect);
    let entries = match entries {
        Ok(entries) => entries,
        Err(error) => {
            findings.push_file(code::UNREADABLE, folder, format!("expected a folder, got: {error}"));
            return Vec::new();
        }
    };
    let mut files: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    if files.is_empty() {
        let message = "expected overlays in the folder, files whose names end in .toml";
        findings.push_file(code::UNREADABLE, folder, message);
    }
    files
}

/// Reads overlays with what they build on.
struct Reader<'a> {
    overlays: &'a mut Vec<Overlay>,
    findings: &'a mut Findings,
    /// The overlays that build on the one that is read, by their real paths.
    above: Vec<PathBuf>,
}

impl Reader<'_> {
    /// Reads a file, once; `asked` is where another one names it.
    fn read(&mut self, path: &Path, asked: Option<(&Source, &Spanned<String>)>) {
        let shown = path.display().to_string();
        let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if self.above.contains(&real) {
            if let Some((source, name)) = asked {
                let way: Vec<String> = self
                    .above
                    .iter()
                    .chain([&real])
                    .filter_map(|path| path.file_name())
                    .map(|name| name.to_string_lossy().into_owned())
                    .collect();
                let problem = Problem::new(code::OVERLAY_CYCLE, name.span()).key("base");
                let problem = problem.expected(format!("this one builds on itself: {}", way.join(" on ")));
                self.findings.push(source, problem);
            }
            return;
        }
        if self.overlays.iter().any(|known| *known.path == *shown) {
            return;
        }
        if self.overlays.len() >= OVERLAYS_MAX {
            return self.findings.push_file(
                code::TOO_MANY,
                path,
                format!("expected at most {OVERLAYS_MAX} overlays"),
            );
        }
        let text = match read_file(path, MAX_FILE_BYTES) {
            Ok(text) => text,
            Err(found) => {
                // What another overlay names is reported where it is named.
                match asked {
                    Some((source, name)) => {
                        let problem = Problem::new(code::UNREADABLE, name.span()).key("base");
                        let why =
                            found.list().first().map(|finding| finding.expected.clone()).unwrap_or_default();
                        let help = "the path starts at the folder of this overlay";
                        self.findings.push(source, problem.expected(why).help(help));
                    }
                    None => self.findings.extend(found),
                }
                return;
            }
        };
        let source = Source::new(&shown, &text);
        // A head that is wrong is told when the overlay is laid over.
        let head = toml::from_str::<OverlayHead>(&text).ok();
        self.above.push(real);
        for name in head.iter().flat_map(|head| &head.base) {
            let folder = path.parent().unwrap_or(Path::new(""));
            self.read(&folder.join(name.get_ref()), Some((&source, name)));
        }
        self.above.pop();
        self.overlays.push(Overlay { path: shown.into(), text: text.into() });
    }
}
