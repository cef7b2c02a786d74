//! Golden frames that are part of the program: what a drive must be sent, and what must be reported, for whole tables.
//!
//! A fact comes from a standard or a manual and not from the tables: "one turn a second is 60 rpm". It is shown by a frame that goes
//! through the engine of the box in virtual time, on the bench on which `translate` works, with the tables that are to be checked. One
//! that fails says what was expected and what came, and which rows are responsible. [`parse`] describes the files.

mod parse;
mod play;

use crate::config::Config;
use crate::finding::Findings;
use crate::mapping::{Mapping, Origin};

/// The files of facts, by the profile of their drives, and the boxes that they name.
const FILES: [(&str, &str); 3] = [
    ("sercos.facts", include_str!("sercos.facts")),
    ("cia402.facts", include_str!("cia402.facts")),
    ("devicenet.facts", include_str!("devicenet.facts")),
];
const CONFIGS: [(&str, &str); 4] = [
    ("sercos.toml", include_str!("sercos.toml")),
    ("sercos-load.toml", include_str!("sercos-load.toml")),
    ("cia402.toml", include_str!("cia402.toml")),
    ("devicenet.toml", include_str!("devicenet.toml")),
];

/// A fact that does not hold with some tables.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    /// The fact.
    pub says: String,
    /// The group it belongs to.
    pub group: String,
    /// File and line of the fact.
    pub place: String,
    /// What was expected.
    pub expected: String,
    /// What came instead.
    pub found: String,
    /// A drive or a controller would do something else than it was told: the direction is wrong, or a state, or a request.
    pub dangerous: bool,
    /// The rows that are responsible, the nearest first.
    pub rows: Vec<Origin>,
}

/// The facts about the drives of one profile: a file of them, and the configurations of the boxes that it names.
#[derive(Debug, Clone, Copy)]
pub struct Facts<'t> {
    /// Name of the file.
    pub name: &'t str,
    /// The facts.
    pub text: &'t str,
    /// Configurations, each with its name.
    pub configs: &'t [(&'t str, &'t str)],
}

impl Facts<'static> {
    /// Those of the program: about SERCOS, CiA 402 and DeviceNet drives.
    #[must_use]
    pub fn shipped() -> [Self; 3] {
        FILES.map(|(name, text)| Facts { name, text, configs: &CONFIGS })
    }
}

impl Facts<'_> {
    fn boxes(&self) -> Result<Vec<parse::Place<'_>>, String> {
        parse::parse(self.text).map_err(|(line, message)| format!("{}:{line}: {message}", self.name))
    }

    /// Shows the facts with some tables, up to a number of failures. Returns how many facts there are, and the failures. A box in which
    /// the drives do not come to operation is one failure.
    ///
    /// # Errors
    /// A line of the file is none: what was expected there.
    pub fn check(&self, mapping: &Mapping, most: usize) -> Result<(usize, Vec<Failure>), String> {
        let mut failures = Vec::new();
        let boxes = self.boxes()?;
        let count = boxes.iter().flat_map(|place| &place.groups).map(|group| group.facts.len()).sum();
        for place in boxes {
            let config = self.configs.iter().find(|(name, _)| *name == place.config);
            let config = config.map_or("", |(_, text)| text);
            let played = Config::parse(config, place.config)
                .map_err(|findings: Findings| findings.to_string())
                .and_then(|config| play::play(&config, mapping, self.name, &place, most, &mut failures));
            if let Err(why) = played {
                failures.push(Failure {
                    says: format!("the drives of {} come to operation", place.config),
                    group: place.config.to_owned(),
                    place: self.name.to_owned(),
                    expected: "every drive is commissioned".to_owned(),
                    found: why,
                    dangerous: true,
                    rows: Vec::new(),
                });
            }
            if failures.len() >= most {
                break;
            }
        }
        Ok((count, failures))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_tables_keep_every_fact() {
        let mapping = Mapping::embedded().unwrap();
        let mut count = 0;
        for facts in Facts::shipped() {
            let (shown, failures) = facts.check(&mapping, usize::MAX).unwrap();
            count += shown;
            let line =
                |one: &Failure| format!("{}: expected {}, found {}", one.place, one.expected, one.found);
            let text: Vec<String> = failures.iter().map(line).collect();
            assert!(failures.is_empty(), "{}", text.join("\n"));
        }
        assert!(count >= 300, "{count} facts");
    }

    #[test]
    fn every_fact_has_a_name_of_its_own_in_its_group() {
        for facts in Facts::shipped() {
            for group in facts.boxes().unwrap().iter().flat_map(|place| &place.groups) {
                let mut names: Vec<&str> = group.facts.iter().map(|fact| fact.says).collect();
                names.sort_unstable();
                let twice = names.windows(2).find(|pair| pair[0] == pair[1]);
                assert_eq!(twice, None, "{}: {}", facts.name, group.title);
            }
        }
    }
}
