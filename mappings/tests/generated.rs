//! What is generated is as the tables have it.

#[path = "../examples/generate/plan.rs"]
mod plan;
#[path = "../examples/generate/render.rs"]
mod render;
#[path = "../examples/generate/rows_page.rs"]
mod rows_page;

use std::path::Path;

use mappings::finding::Findings;
use mappings::{Mapping, TableTexts};

#[test]
fn checked_in_files_are_those_of_the_tables() {
    let mut findings = Findings::default();
    let texts = TableTexts::embedded();
    let dictionaries =
        Mapping::dictionaries_of(&texts, &mut findings).expect("the shipped tables can be read");
    let mut files = render::files(&dictionaries, &texts.generic.text);
    assert_eq!(files.len(), plan::FILES.len() + 2);
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    files.push((rows_page::PATH, rows_page::page(&mapping, &texts)));
    let old = |(path, text): &(&str, String)| {
        let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
        std::fs::read_to_string(place).ok().as_deref() != Some(text.as_str())
    };
    let old: Vec<&str> = files.iter().filter(|file| old(file)).map(|(path, _)| *path).collect();
    assert!(
        old.is_empty(),
        "not as the tables have it: {old:?}; run `cargo run -p mappings --example generate`"
    );
}
