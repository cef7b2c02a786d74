//! The fuzz targets on stable Rust: every seed of `fuzz/corpus`, and mutations of each that are the same in every run.
//!
//! `fuzz/README.md` says how to run the targets under libFuzzer, which finds more.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};

use allocation_counter::measure;
use axisbridge_tests::fuzz::{TARGETS, Target};

/// Seeds of a target, and bytes of a seed: the corpus is there to be looked at.
const SEEDS_MAX: usize = 20;
const SEED_LEN_MAX: usize = 2_048;

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz")
}

/// Names in a folder, without their endings.
fn names(folder: &str) -> BTreeSet<String> {
    let entries = fs::read_dir(project().join(folder)).expect("the folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned()).collect()
}

/// The seeds of a target in the order of their names.
fn seeds(target: &Target) -> Vec<(String, Vec<u8>)> {
    let folder = project().join("corpus").join(target.name);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let read = |path: PathBuf| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        (name, fs::read(path).expect("a seed"))
    };
    paths.into_iter().map(read).collect()
}

/// Numbers that are the same in every run.
struct Dice(u64);

impl Dice {
    fn of(name: &str) -> Self {
        Self(
            name.bytes().fold(0x9E37_79B9_7F4A_7C15, |sum, byte| {
                (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
            }),
        )
    }

    /// A number below `end`, which is above zero.
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        let end = u64::try_from(end).expect("a length");
        usize::try_from((self.0 >> 16) % end).expect("it is below a length")
    }

    fn byte(&mut self) -> u8 {
        u8::try_from(self.below(256)).expect("below 256")
    }

    /// A part of the bytes.
    fn part<'b>(&mut self, bytes: &'b [u8]) -> &'b [u8] {
        let start = self.below(bytes.len() + 1);
        let len = self.below((bytes.len() - start).min(64) + 1);
        &bytes[start..start + len]
    }
}

/// Values at the edges of something.
const EDGES: [u8; 8] = [0, 1, 0x7F, 0x80, 0xC0, 0xFE, 0xFF, b'"'];

/// One to four changes of a seed, with parts of another one.
fn mutate(dice: &mut Dice, seed: &[u8], other: &[u8]) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=dice.below(4) {
        let at = dice.below(bytes.len() + 1);
        match dice.below(8) {
            0 | 1 if at < bytes.len() => bytes[at] ^= 1 << dice.below(8),
            2 if at < bytes.len() => bytes[at] = EDGES[dice.below(EDGES.len())],
            3 if at < bytes.len() => bytes[at] = dice.byte(),
            4 => bytes.truncate(at),
            5 => {
                let part = dice.part(other);
                bytes.splice(at..at, part.iter().copied());
            }
            6 => {
                let len = dice.part(&bytes[at..]).len();
                bytes.drain(at..at + len);
            }
            _ => {
                let part = dice.part(other);
                let end = (at + part.len()).min(bytes.len());
                bytes.splice(at..end, part.iter().copied());
            }
        }
    }
    bytes.truncate(SEED_LEN_MAX);
    bytes
}

/// Runs a target; with what it was when it fails.
fn run(target: &Target, what: &str, data: &[u8]) {
    let mut held = 0;
    let caught = catch_unwind(AssertUnwindSafe(|| held = measure(|| (target.run)(data)).bytes_max));
    let hex = data.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    });
    if let Err(panic) = caught {
        eprintln!("{}: {what}: {hex}", target.name);
        resume_unwind(panic);
    }
    assert!(held <= target.heap_max, "{}: {what}: {held} bytes on the heap: {hex}", target.name);
}

/// The targets whose names begin so.
fn replay(prefix: &str) {
    for target in TARGETS.iter().filter(|target| group(target) == prefix) {
        let seeds = seeds(target);
        // What is compiled once in a process does not count.
        (target.run)(&[]);
        for (name, seed) in &seeds {
            run(target, name, seed);
        }
        let mut dice = Dice::of(target.name);
        for number in 0..target.mutations {
            let (name, seed) = &seeds[dice.below(seeds.len())];
            let (_, other) = &seeds[dice.below(seeds.len())];
            let data = mutate(&mut dice, seed, other);
            run(target, &format!("mutation {number}, of {name}"), &data);
        }
    }
}

/// The protocol of a target; the readers of files belong together.
fn group(target: &Target) -> &'static str {
    let protocols = ["cip", "motion", "sercos", "canopen", "devicenet"];
    let first = target.name.split('_').next();
    protocols.into_iter().find(|protocol| first == Some(protocol)).unwrap_or("files")
}

#[test]
fn cip_targets_bear_their_seeds_and_mutations_of_them() {
    replay("cip");
}

#[test]
fn cip_motion_targets_bear_their_seeds_and_mutations_of_them() {
    replay("motion");
}

#[test]
fn sercos_targets_bear_their_seeds_and_mutations_of_them() {
    replay("sercos");
}

#[test]
fn canopen_targets_bear_their_seeds_and_mutations_of_them() {
    replay("canopen");
}

#[test]
fn devicenet_targets_bear_their_seeds_and_mutations_of_them() {
    replay("devicenet");
}

#[test]
fn readers_of_files_bear_their_seeds_and_mutations_of_them() {
    replay("files");
}

#[test]
fn every_target_has_a_binary_and_a_few_small_seeds() {
    let targets: BTreeSet<String> = TARGETS.iter().map(|target| target.name.to_owned()).collect();
    assert_eq!(targets.len(), TARGETS.len(), "names are names of one target");
    assert_eq!(names("fuzz_targets"), targets);
    assert_eq!(names("corpus"), targets);
    let manifest = fs::read_to_string(project().join("Cargo.toml")).expect("the manifest");
    let manifest: toml::Table = manifest.parse().expect("TOML");
    let bins: BTreeSet<_> = manifest["bin"]
        .as_array()
        .expect("binaries")
        .iter()
        .map(|bin| bin["name"].as_str().expect("a name").to_owned())
        .collect();
    assert_eq!(bins, targets);
    for target in TARGETS {
        let seeds = seeds(target);
        assert!((1..=SEEDS_MAX).contains(&seeds.len()), "{}: {} seeds", target.name, seeds.len());
        for (name, seed) in seeds {
            assert!(seed.len() <= SEED_LEN_MAX, "{}/{name}: {} bytes", target.name, seed.len());
        }
        let binary = project().join("fuzz_targets").join(target.name).with_extension("rs");
        let text = fs::read_to_string(binary).expect("the binary");
        assert!(text.contains(&format!("run(\"{}\", data)", target.name)), "{}: {text}", target.name);
    }
}
