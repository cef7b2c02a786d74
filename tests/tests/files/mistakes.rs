//! Mistakes that people make, each in correct files, and what `check` says to each: `tests/mistakes/`.
//!
//! `texts.md` is written from here and is there to be read: does each text say where the mistake is, what is wrong, and what to
//! write instead, and nothing else? `INSTA_UPDATE=always` writes it again.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use axisbridge::check::{Request, check};
use axisbridge::finding::{Finding, Findings};
use serde::Deserialize;

/// A recording that begins as it should and has nothing in it.
const RECORDING: &[u8] = &[
    0x0A, 0x0D, 0x0D, 0x0A, 0x1C, 0, 0, 0, 0x4D, 0x3C, 0x2B, 0x1A, 1, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,
    0xFF, 0xFF, 0xFF, 0x1C, 0, 0, 0,
];

/// `mistakes.toml`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Mistakes {
    mistake: Vec<Mistake>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Mistake {
    name: String,
    r#in: String,
    from: Option<String>,
    to: Option<String>,
    /// The name under which a shipped table is copied, where it is another one.
    r#as: Option<String>,
    /// The file that is given as configuration, where it is another one.
    config: Option<String>,
    #[serde(default)]
    also: Vec<Edit>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Edit {
    r#in: String,
    from: Option<String>,
    to: String,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("mistakes")
}

fn mistakes() -> Vec<Mistake> {
    let text = fs::read_to_string(folder().join("mistakes.toml")).unwrap();
    toml::from_str::<Mistakes>(&text).unwrap().mistake
}

/// An empty folder of this test.
fn place(name: &str) -> PathBuf {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mistakes").join(name);
    let _ = fs::remove_dir_all(&place);
    fs::create_dir_all(&place).unwrap();
    for file in ["box.toml", "can.toml", "overlay.toml"] {
        fs::copy(folder().join("base").join(file), place.join(file)).unwrap();
    }
    fs::write(place.join("trace.pcapng"), RECORDING).unwrap();
    place
}

/// A file of a folder; a shipped table is copied there first.
fn file(place: &Path, name: &str, copied_as: Option<&str>) -> PathBuf {
    let own = place.join(name);
    if own.exists() {
        return own;
    }
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../mappings/tables");
    let below = ["", "dictionary"].into_iter().find(|below| shipped.join(below).join(name).exists());
    let below = below.unwrap_or_else(|| panic!("no table {name}"));
    let copy = place.join("tables").join(below).join(copied_as.unwrap_or(name));
    fs::create_dir_all(copy.parent().unwrap()).unwrap();
    fs::copy(shipped.join(below).join(name), &copy).unwrap();
    copy
}

fn edit(path: &Path, from: Option<&str>, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    let text = match from {
        Some(from) => {
            assert!(text.contains(from), "{}: {from}", path.display());
            text.replacen(from, to, 1)
        }
        None => text + to,
    };
    fs::write(path, text).unwrap();
}

fn found(place: &Path, config: &str) -> Findings {
    let tables = place.join("tables");
    let mappings: Vec<PathBuf> = Some(tables).filter(|tables| tables.exists()).into_iter().collect();
    check(&Request { config: Some(&place.join(config)), mappings: &mappings, frames: false }).tables.findings
}

/// What is said to a mistake.
struct Said {
    name: String,
    text: String,
    /// Whether a finding neither says what was expected nor what to do.
    silent: bool,
}

/// What is said to each of them; two tests look at it.
static SAID: LazyLock<Vec<Said>> = LazyLock::new(|| mistakes().into_iter().map(made).collect());

fn made(mistake: Mistake) -> Said {
    let place = place("one");
    let path = file(&place, &mistake.r#in, mistake.r#as.as_deref());
    if let Some(to) = &mistake.to {
        edit(&path, mistake.from.as_deref(), to);
    }
    for also in &mistake.also {
        edit(&file(&place, &also.r#in, None), also.from.as_deref(), &also.to);
    }
    let usual = if mistake.r#in == "can.toml" { "can.toml" } else { "box.toml" };
    let findings = found(&place, mistake.config.as_deref().unwrap_or(usual));
    let text = findings.shown(false, Finding::asks).replace(&format!("{}/", place.display()), "");
    let mut asking = findings.list().iter().filter(|finding| finding.asks());
    let silent = asking.any(|finding| finding.expected.is_empty() && finding.help.is_empty());
    Said { name: mistake.name, text, silent }
}

#[test]
fn the_files_without_a_mistake_are_good() {
    let place = place("base");
    for config in ["box.toml", "can.toml"] {
        let findings = found(&place, config);
        let asks: Vec<String> =
            findings.list().iter().filter(|found| found.asks()).map(ToString::to_string).collect();
        assert_eq!(asks.join("\n"), "", "{config}");
    }
}

#[test]
fn every_mistake_has_the_text_that_is_written_down() {
    assert!(SAID.len() >= 100, "{} mistakes", SAID.len());
    let mut page = String::from(
        "# Mistakes and what `axisbridge check` says to them\n\nWritten by `tests/tests/files/mistakes.rs` from `mistakes.toml`, to be read: does each text say what is\nwrong, where, and what to write instead?\n",
    );
    for Said { name, text, .. } in SAID.iter() {
        let upper = name[..1].to_uppercase() + &name[1..];
        write!(page, "\n## {upper}\n\n```text\n{}\n```\n", text.trim_end()).unwrap();
    }
    let path = folder().join("texts.md");
    if std::env::var_os("INSTA_UPDATE").is_some_and(|value| value == "always") {
        fs::write(&path, &page).unwrap();
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    let differs = written.lines().zip(page.lines()).find(|(old, new)| old != new);
    assert!(written == page, "texts.md differs first at {differs:?}; INSTA_UPDATE=always writes it");
}

#[test]
fn one_mistake_is_one_finding_that_says_what_to_do() {
    // These are two mistakes or more.
    let several = [
        "one in the configuration, one in the overlay, one in a table",
        "a key in the configuration, a key in the overlay, a word in a table",
        "a bracket in the configuration, a bracket in the overlay",
        "limits as keys of the axis",
        // No program can be made for the axis either.
        "an axis that turns gets the scaling of one that moves as well",
    ];
    let mut bad = Vec::new();
    for Said { name, text, silent } in SAID.iter() {
        let places = text.matches(" --> ").count();
        let wanted = if several.contains(&name.as_str()) { 2..=3 } else { 1..=1 };
        if !wanted.contains(&places) || *silent {
            bad.push(format!("{name}: {places} findings"));
        }
    }
    assert_eq!(bad, Vec::<String>::new());
}
