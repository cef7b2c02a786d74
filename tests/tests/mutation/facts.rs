//! Whether the checks of the tables, or the frames that `check` sends through the gateway, notice a change of a table or of a
//! configuration by the mistakes that people make.
//!
//! A part of the changes is made by `cargo test`, and all of them by `cargo test -p axisbridge-tests --test mutation -- --ignored
//! --nocapture every_change`, which prints the tables of docs/evidence/mutation-tables.md. With `AXISBRIDGE_TEST_RESULTS` set, it
//! writes a line of each change into this file, with who notices it; with `AXISBRIDGE_TEST_CHANGES`, only the changes are made whose
//! names, or whose tables, stand in this file, which may be one of those.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex};

use axisbridge::config::Config;
use axisbridge::engine::build::{Host, build};
use axisbridge::finding::{Findings, Severity};
use axisbridge::mapping::{Mapping, check};
use axisbridge::translate::golden::{Facts, Failure};
use axisbridge::translate::{Behind, Stage};

use crate::kinds::{Kind, Mutant, config_mutants, mutants};
use crate::rows::FILES;

/// One of so many changes is tried by `cargo test`.
const SAMPLE: usize = 25;

/// A file that the results are written to, and one with the names of the changes that are made.
const RESULTS: &str = "AXISBRIDGE_TEST_RESULTS";
const CHANGES: &str = "AXISBRIDGE_TEST_CHANGES";

/// Characters of an address in memory, at least; the numbers of the engine are shown in decimal or are shorter.
const ADDRESS_LEN: usize = 12;

/// Who notices a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Noticed {
    /// Nothing is sent or reported otherwise: the tables mean the same (`Mapping::meaning` says why).
    Same,
    /// The checks of the tables.
    Check,
    /// A frame.
    Frame,
    /// Nobody, and nothing that a drive is sent can depend on it: the engine of the box is the same.
    Unsent,
    /// Nobody, and the drives are sent the same over a bus that is another one: its addresses or its bit rate.
    Moved,
    Nobody,
}

/// What is changed.
struct Case {
    /// Place in [`FILES`], or behind them the place of a configuration.
    file: usize,
    mutant: Mutant,
}

impl Case {
    /// File and line of the change, its kind, and what it is.
    fn name(&self) -> String {
        let Mutant { kind, line, what, .. } = &self.mutant;
        format!("{}:{line} [{kind}] {what}", file_name(self.file)).replace('\n', " ")
    }
}

/// The facts of the program, as they stand in their files now.
static FACTS: LazyLock<[Facts<'static>; 3]> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../gateway/src/translate/golden");
    let read = |name: &str| &*fs::read_to_string(folder.join(name)).expect("a file of facts").leak();
    let configs = Facts::shipped()[0].configs.iter().map(|(name, _)| (*name, read(name)));
    let configs = &*configs.collect::<Vec<(&'static str, &'static str)>>().leak();
    Facts::shipped().map(|facts| Facts { text: read(facts.name), configs, ..facts })
});

struct Judge {
    mapping: Mapping,
    /// What the shipped tables mean.
    tables: String,
    /// Errors and warnings of the shipped tables.
    findings: usize,
}

fn serious(findings: &Findings) -> usize {
    findings.count(Severity::Error) + findings.count(Severity::Warning)
}

impl Judge {
    fn new() -> Self {
        let mapping = Mapping::embedded().expect("the shipped tables");
        let mut findings = Findings::default();
        check::tables(&mapping, &mut findings);
        Self { tables: mapping.meaning(), mapping, findings: serious(&findings) }
    }

    fn noticed(&self, case: &Case) -> Noticed {
        match FILES.get(case.file) {
            Some((name, _)) => self.table(case.file, name, &case.mutant.text),
            None => self.config(case.file - FILES.len(), &case.mutant.text),
        }
    }

    fn table(&self, file: usize, name: &str, text: &str) -> Noticed {
        let Ok(mapping) = self.mapping.with_table(name, text) else { return Noticed::Check };
        let mut findings = Findings::default();
        mapping.run_examples(&mut findings);
        if findings.has_errors() {
            return Noticed::Check;
        }
        check::tables(&mapping, &mut findings);
        if serious(&findings) > self.findings {
            return Noticed::Check;
        }
        if mapping.meaning() == self.tables {
            return Noticed::Same;
        }
        // A table of one profile concerns the drives of that profile alone.
        let [sercos, cia402, devicenet] = *FACTS;
        let concerned = match file {
            0 => vec![sercos, cia402, devicenet],
            1 => vec![sercos],
            _ => vec![cia402],
        };
        let fails =
            |facts: &Facts<'_>| !facts.check(&mapping, 1).expect("the facts of the program").1.is_empty();
        if concerned.iter().any(fails) { Noticed::Frame } else { Noticed::Nobody }
    }

    /// The facts are shown by the boxes of these configurations: another one shows others.
    fn config(&self, place: usize, text: &str) -> Noticed {
        let (name, shipped) = FACTS[0].configs[place];
        let (Ok(config), Ok(before)) = (Config::parse(text, name), Config::parse(shipped, name)) else {
            return Noticed::Check;
        };
        if format!("{config:?}") == format!("{before:?}") {
            return Noticed::Same;
        }
        let configs: Vec<_> = FACTS[0]
            .configs
            .iter()
            .map(|(known, other)| (*known, if *known == name { text } else { other }))
            .collect();
        let named = format!("config {name}\n");
        let fails = |facts: &Facts<'_>| {
            let changed = Facts { configs: &configs, ..*facts };
            !changed.check(&self.mapping, 1).expect("the facts of the program").1.is_empty()
        };
        if FACTS.iter().filter(|facts| facts.text.contains(&named)).any(fails) {
            return Noticed::Frame;
        }
        let sent = |config: &Config| Sent::of(config, &self.mapping);
        match (sent(&config), sent(&before)) {
            (Some(new), Some(old)) if new == old => Noticed::Unsent,
            (Some(new), Some(old)) if new.axes == old.axes => Noticed::Moved,
            _ => Noticed::Nobody,
        }
    }
}

/// Everything that telegrams to drives are made of. What the explicit side alone answers (identity, update periods that it accepts, the
/// sheet for the controller, numbers of instances) is not in it.
#[derive(PartialEq)]
struct Sent {
    /// The axes with their limits and reactions, the programs of their devices and of their drives, and what the drives are needed for.
    axes: String,
    /// The buses with their drives, addresses and cycles, and what commissions the drives.
    buses: String,
}

impl Sent {
    /// `None` of a configuration that makes no box, or of which the drives do not come to operation.
    fn of(config: &Config, mapping: &Mapping) -> Option<Self> {
        let built = build(config, mapping.clone(), Host { mac: [2, 0, 0, 0, 0, 1], incarnation: 1 }).ok()?;
        let engine = built.engine;
        let stage = Stage::rehearse(config, mapping.clone()).ok()?;
        let programs = stage.axes.iter().map(|axis| {
            let needs = match &axis.behind {
                Behind::Sercos(drive) => format!("{:?} {:?} {:?}", drive.silent, drive.needs, drive.facts),
                Behind::Can(drive) => format!("{:?}", drive.needs),
                Behind::Devicenet(drive) => format!("{:?}", drive.needs),
            };
            format!("{needs} {:?} {:?}", axis.north, axis.south)
        });
        let programs: Vec<String> = programs.collect();
        let axes = format!("{:?} {:?} {:?} {programs:?}", engine.axes(), engine.devices(), config.lead);
        let buses = format!("{:?} {:?}", engine.buses(), built.commissioners);
        Some(Self { axes: without_addresses(&axes), buses: without_addresses(&buses) })
    }
}

/// Without the addresses in memory at which queues lie: they are others each time.
fn without_addresses(text: &str) -> String {
    let mut known = String::with_capacity(text.len());
    for word in text.split_inclusive(|letter: char| !letter.is_ascii_alphanumeric()) {
        let is_address = word.len() >= ADDRESS_LEN && word.starts_with("0x");
        known.push_str(if is_address { "somewhere " } else { word });
    }
    known
}

/// All changes, in the order of the files.
fn cases() -> Vec<Case> {
    let tables = FILES
        .iter()
        .enumerate()
        .flat_map(|(file, (_, text))| mutants(text).into_iter().map(move |mutant| Case { file, mutant }));
    let configs = FACTS[0].configs.iter().enumerate().flat_map(|(place, (_, text))| {
        let file = FILES.len() + place;
        config_mutants(text).into_iter().map(move |mutant| Case { file, mutant })
    });
    tables.chain(configs).collect()
}

fn file_name(file: usize) -> &'static str {
    match FILES.get(file) {
        Some((name, _)) => name,
        None => FACTS[0].configs[file - FILES.len()].0,
    }
}

/// Judges cases on all processors.
fn judged(judge: &Judge, cases: &[&Case]) -> Vec<Noticed> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(vec![Noticed::Nobody; cases.len()]);
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(number) else { break };
                    let noticed = judge.noticed(case);
                    if matches!(noticed, Noticed::Nobody | Noticed::Unsent | Noticed::Moved) {
                        println!("{number} of {}: {noticed:?} {}", cases.len(), case.name());
                    }
                    results.lock().expect("no panic")[number] = noticed;
                }
            });
        }
    });
    results.into_inner().expect("no panic")
}

/// The two tables of survivors, by kind and by file.
fn report(cases: &[&Case], results: &[Noticed]) -> String {
    let mut text = String::new();
    let files = 0..FILES.len() + FACTS[0].configs.len();
    for (title, survives) in [
        (
            "Survivors of `check` alone",
            &[Noticed::Frame, Noticed::Unsent, Noticed::Moved, Noticed::Nobody][..],
        ),
        ("Survivors of `check` and the frames", &[Noticed::Unsent, Noticed::Moved, Noticed::Nobody][..]),
        ("Of these, changes of what a drive is sent, or may be", &[Noticed::Nobody][..]),
    ] {
        let _ = writeln!(text, "## {title}\n");
        let names: Vec<&str> = files.clone().map(file_name).collect();
        let _ = writeln!(text, "| kind | changes | equivalent | {} | survivors |", names.join(" | "));
        let _ = writeln!(text, "|---|---|---|{}---|", "---|".repeat(names.len()));
        let mut sums: BTreeMap<usize, usize> = BTreeMap::new();
        let (mut changes, mut same) = (0, 0);
        for kind in Kind::ALL {
            let own = || cases.iter().zip(results).filter(|(case, _)| case.mutant.kind == kind);
            let equivalent = own().filter(|(_, noticed)| **noticed == Noticed::Same).count();
            let of = |file| {
                own().filter(|(case, noticed)| case.file == file && survives.contains(noticed)).count()
            };
            let counts: Vec<usize> = files.clone().map(of).collect();
            files.clone().zip(&counts).for_each(|(file, count)| *sums.entry(file).or_default() += count);
            (changes, same) = (changes + own().count(), same + equivalent);
            let cells: Vec<String> = counts.iter().map(ToString::to_string).collect();
            let sum: usize = counts.iter().sum();
            let _ = writeln!(
                text,
                "| {kind} | {} | {equivalent} | {} | {sum} |",
                own().count(),
                cells.join(" | ")
            );
        }
        let cells: Vec<String> = sums.values().map(ToString::to_string).collect();
        let sum: usize = sums.values().sum();
        let _ = writeln!(text, "| all | {changes} | {same} | {} | {sum} |\n", cells.join(" | "));
    }
    text
}

/// The changes that somebody, or nobody, has noticed.
fn named(cases: &[&Case], results: &[Noticed], wanted: Noticed) -> Vec<String> {
    let own = cases.iter().zip(results).filter(|(_, noticed)| **noticed == wanted);
    own.map(|(case, _)| case.name()).collect()
}

fn print(cases: &[&Case], results: &[Noticed]) {
    println!("{}", report(cases, results));
    println!(
        "The drives are sent the same at another address:\n{}\n",
        named(cases, results, Noticed::Moved).join("\n")
    );
    println!(
        "Nothing that a drive is sent depends on these:\n{}\n",
        named(cases, results, Noticed::Unsent).join("\n")
    );
    println!("Nobody notices these:\n{}", named(cases, results, Noticed::Nobody).join("\n"));
}

/// Otherwise every change would be noticed by a frame.
#[test]
fn the_shipped_tables_keep_every_fact() {
    let mapping = Mapping::embedded().expect("the shipped tables");
    let mut text = Vec::new();
    for facts in *FACTS {
        let (_, failures) = facts.check(&mapping, usize::MAX).expect("the facts of the program");
        let line = |one: &Failure| {
            format!("{} {}: expected {}, found {}", one.place, one.says, one.expected, one.found)
        };
        text.extend(failures.iter().map(line));
    }
    assert!(text.is_empty(), "{}", text.join("\n"));
}

#[test]
fn no_change_of_what_a_drive_is_sent_survives_in_the_sample() {
    let all = cases();
    assert!(all.len() >= 2000, "{} changes", all.len());
    let sample: Vec<&Case> = all.iter().step_by(SAMPLE).collect();
    let results = judged(&Judge::new(), &sample);
    print(&sample, &results);
    let count = |wanted| results.iter().filter(|noticed| **noticed == wanted).count();
    assert!(count(Noticed::Frame) > 0 && count(Noticed::Check) > 0);
    let left = named(&sample, &results, Noticed::Nobody);
    assert!(left.is_empty(), "nobody notices:\n{}", left.join("\n"));
}

#[test]
#[ignore = "takes minutes; prints the tables of docs/evidence/mutation-tables.md"]
fn every_change() {
    let all = cases();
    let wanted = std::env::var(CHANGES).ok().map(|path| fs::read_to_string(path).expect("a list of changes"));
    // What stands before the name is who has noticed it.
    let wanted: Option<BTreeSet<&str>> = wanted
        .as_deref()
        .map(|text| text.lines().map(|line| line.split_once('\t').map_or(line, |(_, name)| name)).collect());
    let is_wanted = |case: &&Case| {
        let names = |wanted: &BTreeSet<&str>| {
            wanted.contains(file_name(case.file)) || wanted.contains(case.name().as_str())
        };
        wanted.as_ref().is_none_or(names)
    };
    let all: Vec<&Case> = all.iter().filter(is_wanted).collect();
    let results = judged(&Judge::new(), &all);
    print(&all, &results);
    if let Ok(path) = std::env::var(RESULTS) {
        let line = |(case, noticed): (&&Case, &Noticed)| format!("{noticed:?}\t{}\n", case.name());
        let text: String = all.iter().zip(&results).map(line).collect();
        fs::write(path, text).expect("the results");
    }
}
