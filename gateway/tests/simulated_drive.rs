//! The simulated drive says of its IDNs what the dictionary says of them.

use axisbridge::mapping::{DriveFacts, Mapping};
use axisbridge::simulate::drives::{linear, rotary};
use profile_sercos::slave::drive::Drive;
use profile_sercos::slave::{Config, Slave};

#[test]
fn the_simulated_drive_is_as_the_dictionary_says() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let dictionary = &mapping.dictionaries.sercos;
    for servo in [rotary(), linear()] {
        let slave = Slave::new(&Config::default(), Drive::new(servo).unwrap());
        let mut facts = DriveFacts::new();
        let mut known = 0;
        for parameter in slave.store().iter() {
            facts.note_attribute(parameter.idn(), parameter.attribute());
            facts.note_unit(parameter.idn(), parameter.unit().as_bytes());
            known += usize::from(dictionary.idn(parameter.idn()).is_some());
        }
        let differences: Vec<String> =
            facts.differences(dictionary).iter().map(ToString::to_string).collect();
        assert!(known > 100, "only {known} of its IDNs have a row");
        assert_eq!(differences, Vec::<String>::new(), "{:?}", servo.kind);
    }
}
