//! What each axis has done in its life: in memory, and in a file where there is a directory for it. A run of the gateway begins with what
//! the one before has counted.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;

use profile_generic::time::DurationNs;
use serde::{Deserialize, Serialize};

use super::file::{self, Kept, Kind};
use super::lock;
use crate::engine::axis::Totals;
use crate::local::installation::Installation;
use crate::status::BoxStatus;

/// Its file. Axes that are not configured any more stay in it: a configuration may come back.
const KIND: Kind = Kind {
    name: "counters.jsonl",
    title: "counter history",
    record: "the counters of an axis",
    records_max: 1_000,
};

/// What an axis has done, as a line of the file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    /// Name of the axis.
    axis: String,
    /// Time in operation, nanoseconds.
    run_time_ns: i64,
    /// Revolutions of the motor, 1e-6.
    motor_turns_e6: i64,
    /// Work of the motor, 1e-6 of its rated torque times a revolution.
    motor_work_e6: i64,
}

/// What the axes of a gateway have done, in earlier runs as well.
#[derive(Debug, Default)]
pub struct CounterHistory {
    book: Mutex<Book>,
    file: Option<Mutex<Kept>>,
}

#[derive(Debug, Default)]
struct Book {
    of: BTreeMap<String, Totals>,
    /// Counts changes.
    changes: u64,
}

impl CounterHistory {
    /// Reads what earlier runs have counted. Whatever is wrong with the file is logged, and counting begins anew.
    #[must_use]
    pub fn open(directory: &Path) -> Self {
        let (lines, kept) = Kept::open::<Line>(directory, KIND);
        let of = lines.into_iter().map(|line| {
            let totals = Totals {
                run_time: DurationNs(line.run_time_ns),
                motor_turns: line.motor_turns_e6,
                motor_work: line.motor_work_e6,
            };
            (line.axis, totals)
        });
        Self { book: Mutex::new(Book { of: of.collect(), changes: 0 }), file: kept.map(Mutex::new) }
    }

    /// What an axis has done up to now.
    #[must_use]
    pub fn of(&self, axis: &str) -> Totals {
        lock(&self.book).of.get(axis).copied().unwrap_or_default()
    }

    /// Takes what the gateway has published. Before the first cycle that is nothing.
    pub fn look(&self, status: &BoxStatus, names: &Installation) {
        let mut book = lock(&self.book);
        for (named, axis) in names.axes.iter().zip(status.configured_axes()) {
            if axis.totals == Totals::default() || book.of.get(&named.name) == Some(&axis.totals) {
                continue;
            }
            if book.of.len() < KIND.records_max || book.of.contains_key(&named.name) {
                book.of.insert(named.name.clone(), axis.totals);
                book.changes += 1;
            }
        }
    }

    /// Whether something has changed that is not in the file.
    #[must_use]
    pub fn is_unsaved(&self) -> bool {
        let changes = lock(&self.book).changes;
        self.file.as_ref().is_some_and(|kept| lock(kept).changes() != changes)
    }

    /// Writes the file if something has changed. It waits for the disk. A failure is logged once, until it works again.
    pub fn save(&self) {
        let Some(kept) = &self.file else { return };
        let mut kept = lock(kept);
        let (changes, lines) = {
            let book = lock(&self.book);
            if book.changes == kept.changes() {
                return;
            }
            let line = |(axis, totals): (&String, &Totals)| Line {
                axis: axis.clone(),
                run_time_ns: totals.run_time.0,
                motor_turns_e6: totals.motor_turns,
                motor_work_e6: totals.motor_work,
            };
            (book.changes, book.of.iter().map(line).collect::<Vec<_>>())
        };
        kept.write(changes, file::encode(KIND, lines.iter()));
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::local::installation::tests::installation;
    use crate::replace_file::power_cut::PowerCut;
    use crate::replace_file::replace_on;
    use crate::status::tests::distinct;

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("axisbridge-counters-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        path
    }

    fn totals(seconds: i64) -> Totals {
        Totals { run_time: DurationNs::from_secs(seconds), motor_turns: i64::MAX, motor_work: -5 }
    }

    fn counted(seconds: i64) -> BoxStatus {
        let mut status = distinct();
        status.axes[0].totals = totals(seconds);
        status
    }

    #[test]
    fn counters_outlive_the_process_and_axes_that_are_not_configured() {
        let directory = folder("outlive").join("below");
        let history = CounterHistory::open(&directory);
        assert_eq!((history.of("turntable"), history.is_unsaved()), (Totals::default(), false));
        history.look(&counted(3_600), &installation());
        assert!(history.is_unsaved());
        history.save();
        assert!(!history.is_unsaved());
        history.look(&counted(3_600), &installation());
        assert!(!history.is_unsaved(), "nothing has changed");
        history.look(&counted(3_601), &installation());
        let later = CounterHistory::open(&directory);
        assert_eq!(later.of("turntable"), totals(3_600));
        assert_eq!(later.of("slide"), Totals::default(), "it has done nothing");
        let mut other = installation();
        other.axes[0].name = "saw".to_owned();
        later.look(&counted(2), &other);
        later.save();
        let latest = CounterHistory::open(&directory);
        assert_eq!((latest.of("turntable"), latest.of("saw")), (totals(3_600), totals(2)));
        later.look(&BoxStatus::STARTING, &other);
        assert_eq!(later.of("saw"), totals(2), "the first cycle is still to come");
        std::fs::remove_dir_all(directory.parent().unwrap()).unwrap();
    }

    #[test]
    fn power_cut_after_any_step_leaves_the_whole_old_or_the_whole_new_counters() {
        let directory = folder("cut");
        let path = directory.join(KIND.name);
        let text = |seconds| {
            let history = CounterHistory::open(&directory);
            history.look(&counted(seconds), &installation());
            history.save();
            std::fs::read_to_string(&path).unwrap()
        };
        let (old, new) = (text(100), text(200));
        let steps = new.len() + 3;
        for loses in [false, true] {
            for step in 0..=steps {
                std::fs::write(&path, &old).unwrap();
                let done = replace_on(&mut PowerCut::after(step, loses), &path, new.as_bytes());
                assert_eq!(done.is_ok(), step == steps, "step {step}");
                let found = CounterHistory::open(&directory).of("turntable");
                assert_eq!(found, totals(if done.is_ok() { 200 } else { 100 }), "step {step}");
            }
        }
        std::fs::remove_dir_all(&directory).unwrap();
    }

    #[test]
    fn damaged_counters_are_put_aside_and_begin_anew() {
        let directory = folder("damaged");
        std::fs::create_dir_all(&directory).unwrap();
        let path = directory.join(KIND.name);
        std::fs::write(&path, "{\"format\":1,\"file\":\"axisbridge fault history\"}\n{}\n").unwrap();
        let lines = crate::history::lines_of(|| {
            let history = CounterHistory::open(&directory);
            assert_eq!(history.of("turntable"), Totals::default());
            history.look(&counted(1), &installation());
            history.save();
        });
        assert!(lines.iter().any(|line| line.text.contains("the counter history")), "{lines:?}");
        assert!(directory.join("counters.jsonl.damaged-1").exists());
        assert_eq!(CounterHistory::open(&directory).of("turntable"), totals(1));
        std::fs::remove_dir_all(&directory).unwrap();
    }
}
