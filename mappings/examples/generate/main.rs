//! Writes what is generated from the tables of this crate: the Rust constants of the profile crates, and the page of all kinds of rows.
//!
//! Run it after a change of a dictionary in `mappings/tables/dictionary`:
//!
//! ```text
//! cargo run -p mappings --example generate
//! ```
//!
//! The files are checked in, because the profile crates do not depend on this one. `mappings/tests/generated.rs` fails while
//! one of them is not what this program would write.

mod plan;
mod render;
mod rows_page;

use std::path::Path;
use std::process::ExitCode;

use mappings::finding::Findings;
use mappings::{Mapping, TableTexts};

fn main() -> ExitCode {
    // A new parameter is not known before its constant is there.
    let mut findings = Findings::default();
    let texts = TableTexts::embedded();
    let Some(dictionaries) = Mapping::dictionaries_of(&texts, &mut findings) else {
        eprintln!("{findings}");
        return ExitCode::FAILURE;
    };
    let mut files = render::files(&dictionaries, &texts.generic.text);
    // A page of tables that do not resolve yet stays as it is.
    if let Some(mapping) = Mapping::resolve(&texts, &mut findings) {
        files.push((rows_page::PATH, rows_page::page(&mapping, &texts)));
    }
    for (path, text) in files {
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
        if let Err(error) = std::fs::write(&place, text) {
            eprintln!("error: {}: {error}", place.display());
            return ExitCode::FAILURE;
        }
        println!("{path}");
    }
    ExitCode::SUCCESS
}
