//! Writes the Rust constants of the profile crates from the tables of this crate.
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
    for (path, text) in render::files(&dictionaries, &texts.generic.text) {
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
        if let Err(error) = std::fs::write(&place, text) {
            eprintln!("error: {}: {error}", place.display());
            return ExitCode::FAILURE;
        }
        println!("{path}");
    }
    ExitCode::SUCCESS
}
