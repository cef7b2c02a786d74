//! The files of the history: one JSON object a line, between a line that says what it is and one that says that it is whole.
//!
//! ```text
//! {"format":1,"file":"axisbridge fault history"}
//! {"number":1,"time":"2026-01-31T12:00:00.000000Z","axis":"turntable",...}
//! {"records":1,"crc32":"8c736521"}
//! ```

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use tracing::{info, warn};

use crate::replace_file::replace_file;

const FORMAT: u32 = 1;

/// What a file holds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind {
    /// Its name in the directory of the history.
    pub name: &'static str,
    /// What it is, as people read it.
    pub title: &'static str,
    /// What a line of it is.
    pub record: &'static str,
    /// Lines.
    pub records_max: usize,
}

/// Bytes of a file; a record has some hundred.
const LEN_MAX: u64 = 4 << 20;

/// Damaged files that are kept.
const ASIDE_MAX: u32 = 9;

#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    format: u32,
    file: String,
}

#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tail {
    records: usize,
    crc32: String,
}

/// What was found.
#[derive(Debug)]
pub(super) enum Found<T> {
    /// No file.
    Nothing,
    /// A whole one.
    Whole(Vec<T>),
    /// Something else.
    Damaged(String),
}

/// A file of this process, which is written again and again.
#[derive(Debug)]
pub(super) struct Kept {
    kind: Kind,
    path: PathBuf,
    /// The number of the changes that are in it.
    changes: u64,
    /// The last attempt to write it has failed.
    failed: bool,
}

impl Kept {
    /// Reads what earlier runs have written, and keeps the file. Whatever is wrong with it is logged, and it begins anew; `None` where it
    /// cannot be written.
    pub fn open<T: DeserializeOwned>(directory: &Path, kind: Kind) -> (Vec<T>, Option<Self>) {
        let path = directory.join(kind.name);
        let (shown, title) = (path.display(), kind.title);
        if let Err(error) = std::fs::create_dir_all(directory) {
            warn!(directory = %directory.display(), %error, "the directory of the {title} cannot be made: it is kept in memory only");
            return (Vec::new(), None);
        }
        let records = match read(&path, kind) {
            Ok(Found::Nothing) => Vec::new(),
            Ok(Found::Whole(records)) => records,
            Ok(Found::Damaged(what)) => match put_aside(&path) {
                Ok(aside) => {
                    warn!(
                        "the {title} {shown} is damaged: {what}; it is kept as {}, and a new one begins",
                        aside.display()
                    );
                    Vec::new()
                }
                Err(error) => {
                    warn!(
                        "the {title} {shown} is damaged: {what}; it cannot be put aside: {error}: it is kept in memory only"
                    );
                    return (Vec::new(), None);
                }
            },
            // It may be whole: it is not overwritten.
            Err(error) => {
                warn!("the {title} {shown} cannot be read: {error}: it is kept in memory only");
                return (Vec::new(), None);
            }
        };
        if !records.is_empty() {
            info!(records = records.len(), file = %shown, "{title}");
        }
        (records, Some(Self { kind, path, changes: 0, failed: false }))
    }

    /// The number of the changes that are in the file.
    pub const fn changes(&self) -> u64 {
        self.changes
    }

    /// Writes the file. It waits for the disk. A failure is logged once, until it works again.
    pub fn write(&mut self, changes: u64, text: io::Result<String>) {
        let (file, title) = (self.path.display().to_string(), self.kind.title);
        match text.and_then(|text| replace_file(&self.path, &text)) {
            Ok(()) => {
                self.changes = changes;
                if std::mem::take(&mut self.failed) {
                    info!(file, "the {title} is written again");
                }
            }
            Err(error) => {
                if !std::mem::replace(&mut self.failed, true) {
                    warn!(file, %error, "the {title} cannot be written; it is tried again");
                }
            }
        }
    }
}

fn head(kind: Kind) -> Head {
    Head { format: FORMAT, file: format!("axisbridge {}", kind.title) }
}

/// The text of a file.
pub(super) fn encode<'a, T: Serialize + 'a>(
    kind: Kind,
    records: impl Iterator<Item = &'a T>,
) -> io::Result<String> {
    let mut text = serde_json::to_string(&head(kind))?;
    text.push('\n');
    let mut count = 0;
    for record in records {
        text.push_str(&serde_json::to_string(record)?);
        text.push('\n');
        count += 1;
    }
    let tail = Tail { records: count, crc32: crc32(&text) };
    let _ = writeln!(text, "{}", serde_json::to_string(&tail)?);
    Ok(text)
}

/// Reads a file.
///
/// # Errors
/// It is there and cannot be read.
pub(super) fn read<T: DeserializeOwned>(path: &Path, kind: Kind) -> io::Result<Found<T>> {
    let length = match std::fs::metadata(path) {
        Ok(metadata) => metadata.len(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Found::Nothing),
        Err(error) => return Err(error),
    };
    if length > LEN_MAX {
        return Ok(Found::Damaged(format!("it has {length} bytes, expected at most {LEN_MAX}")));
    }
    let bytes = std::fs::read(path)?;
    Ok(match std::str::from_utf8(&bytes) {
        Ok(text) => decode(text, kind).map_or_else(Found::Damaged, Found::Whole),
        Err(error) => Found::Damaged(format!("byte {} is not UTF-8 text", error.valid_up_to())),
    })
}

/// The records of a text, or what is wrong with it.
fn decode<T: DeserializeOwned>(text: &str, kind: Kind) -> Result<Vec<T>, String> {
    let Kind { title, record: what, records_max, .. } = kind;
    let whole = text.strip_suffix('\n').ok_or("its last line has no end: it was cut")?;
    let at = whole.rfind('\n').ok_or("it has one line only: it was cut")? + 1;
    let (covered, last) = (&text[..at], &whole[at..]);
    let number = covered.lines().count() + 1;
    let tail: Tail = serde_json::from_str(last)
        .map_err(|error| format!("line {number}: expected the number of records and their CRC: {error}"))?;
    let found = crc32(covered);
    if found != tail.crc32 {
        return Err(format!("line {number}: expected CRC {found}, found {}", tail.crc32));
    }
    let mut lines = covered.lines();
    let found: Head = serde_json::from_str(lines.next().unwrap_or_default())
        .map_err(|error| format!("line 1: expected the head of the {title}: {error}"))?;
    let expected = head(kind);
    if found != expected {
        return Err(format!("line 1: expected {expected:?}, found {found:?}"));
    }
    let mut records = Vec::new();
    for (line, text) in (2..).zip(lines) {
        let record = serde_json::from_str(text);
        records.push(record.map_err(|error| format!("line {line}: expected {what}: {error}"))?);
    }
    if records.len() != tail.records || records.len() > records_max {
        let count = records.len();
        return Err(format!(
            "line {number}: it says {} records, at most {records_max}, found {count}",
            tail.records
        ));
    }
    Ok(records)
}

/// Gives a damaged file another name, so that a new one can be written and the damaged one be looked at.
fn put_aside(path: &Path) -> io::Result<PathBuf> {
    let name = |number: u32| {
        let mut name = path.as_os_str().to_owned();
        name.push(format!(".damaged-{number}"));
        PathBuf::from(name)
    };
    let free = (1..ASIDE_MAX).map(name).find(|name| !name.exists());
    let aside = free.unwrap_or_else(|| name(ASIDE_MAX));
    std::fs::rename(path, &aside)?;
    Ok(aside)
}

fn crc32(text: &str) -> String {
    format!("{:08x}", crc32fast::hash(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::faults::KIND;
    use crate::history::{FaultEnd, FaultRecord};
    use crate::replace_file::power_cut::PowerCut;
    use crate::replace_file::{replace_file, replace_on};

    fn found(path: &Path) -> Found<FaultRecord> {
        read(path, KIND).unwrap()
    }

    /// A folder that is removed with the test.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("axisbridge-history-{}-{name}", std::process::id()));
            let _ = std::fs::remove_dir_all(&path);
            std::fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn file(&self) -> PathBuf {
            self.0.join(KIND.name)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    fn records(count: u64) -> Vec<FaultRecord> {
        let record = |number| FaultRecord {
            number,
            axis: "turntable".to_owned(),
            drive_says: Some("\"\u{fc}berstrom\"\n".to_owned()),
            end: (number % 2 == 0).then(|| FaultEnd { time: None, by: "Fault Reset".to_owned() }),
            ..FaultRecord::default()
        };
        (1..=count).map(record).collect()
    }

    fn text(records: &[FaultRecord]) -> String {
        encode(KIND, records.iter()).unwrap()
    }

    fn whole(path: &Path) -> Vec<FaultRecord> {
        match found(path) {
            Found::Whole(records) => records,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let folder = Folder::new("again");
        assert!(matches!(found(&folder.file()), Found::Nothing));
        for count in [0, 1, 3] {
            replace_file(&folder.file(), &text(&records(count))).unwrap();
            assert_eq!(whole(&folder.file()), records(count));
        }
    }

    #[test]
    fn power_cut_after_any_step_leaves_the_whole_old_or_the_whole_new_history() {
        let folder = Folder::new("cut");
        let (old, new) = (records(2), records(3));
        let bytes = text(&new).into_bytes();
        // Create, each byte, synchronize, rename; and one cut that comes too late.
        let steps = bytes.len() + 3;
        for loses in [false, true] {
            let mut seen = [0, 0];
            for step in 0..=steps {
                std::fs::write(folder.file(), text(&old)).unwrap();
                let done = replace_on(&mut PowerCut::after(step, loses), &folder.file(), &bytes);
                assert_eq!(done.is_ok(), step == steps, "step {step}");
                let found = whole(&folder.file());
                assert!(found == old || found == new, "step {step}: {found:?}");
                assert_eq!(found == new, step == steps, "step {step}");
                seen[usize::from(found == new)] += 1;
                // What the cut has left behind disturbs nobody.
                replace_file(&folder.file(), &text(&records(1))).unwrap();
                assert_eq!(whole(&folder.file()), records(1));
            }
            assert_eq!(seen, [steps, 1]);
        }
        // The first history of all: none, or the whole one.
        for step in 0..=steps {
            let _ = std::fs::remove_file(folder.file());
            let done = replace_on(&mut PowerCut::after(step, true), &folder.file(), &bytes);
            match found(&folder.file()) {
                Found::Nothing => assert!(done.is_err()),
                Found::Whole(found) => assert_eq!((found, done.is_ok()), (new.clone(), true)),
                Found::Damaged(what) => panic!("step {step}: {what}"),
            }
        }
    }

    #[test]
    fn file_that_is_cut_or_changed_anywhere_is_damaged() {
        let folder = Folder::new("damaged");
        let good = text(&records(2)).into_bytes();
        for end in 0..good.len() {
            std::fs::write(folder.file(), &good[..end]).unwrap();
            assert!(matches!(found(&folder.file()), Found::Damaged(_)), "cut at {end}");
        }
        for at in 0..good.len() {
            let mut bytes = good.clone();
            bytes[at] ^= 1;
            std::fs::write(folder.file(), &bytes).unwrap();
            assert!(matches!(found(&folder.file()), Found::Damaged(_)), "changed at {at}");
        }
    }

    #[test]
    fn damage_is_named_with_line_and_expectation() {
        let sealed = |lines: &str, records: usize| {
            let tail = Tail { records, crc32: crc32(lines) };
            format!("{lines}{}\n", serde_json::to_string(&tail).unwrap())
        };
        let head = "{\"format\":1,\"file\":\"axisbridge fault history\"}\n";
        for (text, what) in [
            (String::new(), "its last line has no end"),
            ("{}\n".to_owned(), "one line only"),
            ("{}\n{}\n".to_owned(), "line 2: expected the number of records and their CRC: missing field"),
            (sealed("{\"format\":2,\"file\":\"x\"}\n", 0), "line 1: expected Head { format: 1, "),
            (sealed(&format!("{head}{{\"number\":-1}}\n"), 1), "line 2: expected a fault: invalid value"),
            (sealed(head, 7), "line 2: it says 7 records, at most 1000, found 0"),
        ] {
            let error = decode::<FaultRecord>(&text, KIND).unwrap_err();
            assert!(error.contains(what), "{error}");
        }
    }

    #[test]
    fn damaged_files_are_put_aside_and_the_last_name_is_used_again() {
        let folder = Folder::new("aside");
        for number in 1..=11_u32 {
            std::fs::write(folder.file(), number.to_string()).unwrap();
            let aside = put_aside(&folder.file()).unwrap();
            assert!(aside.to_string_lossy().ends_with(&format!(".damaged-{}", number.min(9))), "{aside:?}");
            assert_eq!(std::fs::read_to_string(aside).unwrap(), number.to_string());
            assert!(!folder.file().exists());
        }
    }
}
