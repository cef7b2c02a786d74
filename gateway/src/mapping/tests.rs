//! Tests over the shipped tables.

use super::*;

fn shipped() -> Mapping {
    match Mapping::embedded() {
        Ok(mapping) => mapping,
        Err(errors) => panic!("{errors}"),
    }
}

#[test]
fn the_shipped_tables_load_and_their_examples_come_out() {
    let examples = shipped().run_examples().unwrap_or_else(|failures| {
        panic!("{}", failures.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    });
    assert!(examples >= 30, "{examples}");
}
