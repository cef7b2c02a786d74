//! Everything that the shipped tables say: what changes here changed in a row.

use axisbridge::config::Config;
use axisbridge::mapping::Mapping;
use axisbridge::translate::Stage;
use axisbridge_tests::tables;

#[test]
fn what_the_shipped_tables_say() {
    let config =
        Config::parse(include_str!("../frames/config.toml"), "config.toml").expect("a configuration");
    let mapping = Mapping::embedded().expect("the shipped tables");
    let stage = Stage::rehearse(&config, mapping).expect("its drives");
    insta::assert_snapshot!(tables::listing(&stage.mapping, &stage));
}
