//! Whether the checks of the tables, or the frames that `check` sends through the gateway, notice a change of a table or of a
//! configuration by the mistakes that people make.
//!
//! A part of the changes is made by `cargo test`, and all of them by `cargo test -p axisbridge-tests --test mutation -- --ignored
//! --nocapture every_change`, which prints the tables of docs/evidence/mutation-tables.md.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use axisbridge::finding::{Findings, Severity};
use axisbridge::mapping::{Mapping, check};
use axisbridge::translate::golden::Facts;

use crate::kinds::{Kind, Mutant, config_mutants, mutants};
use crate::rows::FILES;

/// One of so many changes is tried by `cargo test`.
const SAMPLE: usize = 25;

/// Who notices a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Noticed {
    /// Nothing is sent or reported otherwise: the tables mean the same (`Mapping::meaning` says why).
    Same,
    /// The checks of the tables.
    Check,
    /// A frame.
    Frame,
    Nobody,
}

/// What is changed.
struct Case {
    /// Place in [`FILES`], or behind them the place of a configuration.
    file: usize,
    mutant: Mutant,
}

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
        let [sercos, cia402, devicenet] = Facts::shipped();
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
        let facts = Facts::shipped()[place];
        let (name, shipped) = facts.configs[place];
        let (Ok(config), Ok(before)) =
            (axisbridge::config::Config::parse(text, name), axisbridge::config::Config::parse(shipped, name))
        else {
            return Noticed::Check;
        };
        if format!("{config:?}") == format!("{before:?}") {
            return Noticed::Same;
        }
        let changed = Facts { configs: &[(name, text)], ..facts };
        if changed.check(&self.mapping, 1).expect("the facts of the program").1.is_empty() {
            Noticed::Nobody
        } else {
            Noticed::Frame
        }
    }
}

/// All changes, in the order of the files.
fn cases() -> Vec<Case> {
    let tables = FILES
        .iter()
        .enumerate()
        .flat_map(|(file, (_, text))| mutants(text).into_iter().map(move |mutant| Case { file, mutant }));
    let configs = Facts::shipped()[0].configs.iter().enumerate().flat_map(|(place, (_, text))| {
        let file = FILES.len() + place;
        config_mutants(text).into_iter().map(move |mutant| Case { file, mutant })
    });
    tables.chain(configs).collect()
}

fn file_name(file: usize) -> &'static str {
    match FILES.get(file) {
        Some((name, _)) => name,
        None => Facts::shipped()[0].configs[file - FILES.len()].0,
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
    let files = 0..FILES.len() + Facts::shipped()[0].configs.len();
    for (title, survives) in [
        ("Survivors of `check` alone", &[Noticed::Frame, Noticed::Nobody][..]),
        ("Survivors of `check` and the frames", &[Noticed::Nobody][..]),
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

fn survivors(cases: &[&Case], results: &[Noticed]) -> Vec<String> {
    let own = cases.iter().zip(results).filter(|(_, noticed)| **noticed == Noticed::Nobody);
    own.map(|(case, _)| format!("{} [{}] {}", file_name(case.file), case.mutant.kind, case.mutant.what))
        .collect()
}

#[test]
fn no_more_changes_of_the_sample_survive_than_before() {
    let all = cases();
    assert!(all.len() >= 2000, "{} changes", all.len());
    let sample: Vec<&Case> = all.iter().step_by(SAMPLE).collect();
    let results = judged(&Judge::new(), &sample);
    let count = |wanted| results.iter().filter(|noticed| **noticed == wanted).count();
    let changed = sample.len() - count(Noticed::Same);
    let left = count(Noticed::Nobody);
    println!("{}", report(&sample, &results));
    println!("{}", survivors(&sample, &results).join("\n"));
    assert!(count(Noticed::Frame) > 0 && count(Noticed::Check) > 0);
    assert!(left * 100 <= changed * SURVIVORS_PERCENT, "{left} of {changed} survive");
}

/// How many in a hundred changes of the sample nobody notices now. The aim is none that changes what a drive is sent; this bound may
/// only fall (docs/evidence/mutation-tables.md).
const SURVIVORS_PERCENT: usize = 3;

#[test]
#[ignore = "takes minutes; prints the tables of docs/evidence/mutation-tables.md"]
fn every_change() {
    let all = cases();
    let all: Vec<&Case> = all.iter().collect();
    let results = judged(&Judge::new(), &all);
    println!("{}", report(&all, &results));
    println!("{}", survivors(&all, &results).join("\n"));
}
