//! The fault history of a gateway: in memory, and in a file where there is a directory for it.

use std::path::Path;
use std::sync::{Mutex, MutexGuard};
use std::time::SystemTime;

use super::book::{Book, RECORDS_MAX};
use super::file::{self, Kept, Kind};
use super::record::FaultRecord;
use super::{lock, utc};
use crate::engine::notice::Notice;
use crate::local::installation::Installation;
use crate::status::BoxStatus;

/// Its file.
pub(super) const KIND: Kind =
    Kind { name: "faults.jsonl", title: "fault history", record: "a fault", records_max: RECORDS_MAX };

/// The faults of the axes of a gateway, those of earlier runs included where they are kept in a file.
#[derive(Debug, Default)]
pub struct FaultHistory {
    book: Mutex<Book>,
    file: Option<Mutex<Kept>>,
}

impl FaultHistory {
    /// Reads the history of earlier runs. Whatever is wrong with its file is logged, and the history begins anew.
    #[must_use]
    pub fn open(directory: &Path) -> Self {
        let (records, kept) = Kept::open(directory, KIND);
        Self { book: Mutex::new(Book::of(records)), file: kept.map(Mutex::new) }
    }

    /// Takes what the cycle reports.
    pub fn note(&self, notice: &Notice, names: &Installation) {
        self.book().note(notice, names, &utc(SystemTime::now()));
    }

    /// Looks at the published status, for faults that have ended.
    pub fn look(&self, status: &BoxStatus) {
        self.book().look(status, &utc(SystemTime::now()));
    }

    /// The gateway ends: what is present will not be seen to end. It waits for the disk.
    pub fn close(&self) {
        self.book().close();
        self.save();
    }

    /// The faults, newest first; of one axis, or of all.
    #[must_use]
    pub fn list(&self, axis: Option<&str>) -> Vec<FaultRecord> {
        let book = self.book();
        book.records().filter(|record| axis.is_none_or(|axis| record.axis == axis)).cloned().collect()
    }

    /// How often something has changed.
    #[must_use]
    pub fn changes(&self) -> u64 {
        self.book().changes()
    }

    /// Whether something has changed that is not in the file.
    #[must_use]
    pub fn is_unsaved(&self) -> bool {
        let changes = self.book().changes();
        self.file.as_ref().is_some_and(|kept| lock(kept).changes() != changes)
    }

    /// Writes the file if something has changed. It waits for the disk. A failure is logged once, until it works again.
    pub fn save(&self) {
        let Some(kept) = &self.file else { return };
        let mut kept = lock(kept);
        let (changes, text) = {
            let book = self.book();
            if book.changes() == kept.changes() {
                return;
            }
            let mut records: Vec<_> = book.records().collect();
            records.reverse();
            (book.changes(), file::encode(KIND, records.into_iter()))
        };
        kept.write(changes, text);
    }

    fn book(&self) -> MutexGuard<'_, Book> {
        lock(&self.book)
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use profile_generic::fault::{Fault, FaultCause};
    use profile_generic::time::SystemTime as CipTime;

    use super::*;
    use crate::local::installation::tests::installation;

    fn folder(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("axisbridge-faults-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        path
    }

    fn fault(axis: u8) -> Notice {
        let fault = Fault::new(FaultCause::OVER_CURRENT, CipTime(5));
        Notice::Fault { axis, fault, loss: None, trip: None, jump: None }
    }

    #[test]
    fn faults_outlive_the_process_in_a_directory_that_is_made() {
        let directory = folder("outlive").join("below");
        let history = FaultHistory::open(&directory);
        assert!(history.list(None).is_empty() && !history.is_unsaved());
        history.note(&fault(0), &installation());
        history.note(&fault(1), &installation());
        assert!(history.is_unsaved());
        history.save();
        assert!(!history.is_unsaved());
        history.note(&fault(1), &installation());
        let later = FaultHistory::open(&directory);
        let axes: Vec<_> = later.list(None).iter().map(|record| record.axis.clone()).collect();
        assert_eq!(axes, ["slide", "turntable"], "newest first");
        assert_eq!(later.list(Some("slide")).len(), 1);
        assert!(later.list(None).iter().all(|record| !record.is_present()));
        let end = |history: &FaultHistory| history.list(None)[0].end.clone().map(|end| (end.time, end.by));
        assert_eq!(end(&history), None);
        history.close();
        assert_eq!(end(&history), end(&later), "an orderly end is as one that nobody has seen");
        assert!(!history.is_unsaved());
        std::fs::remove_dir_all(directory.parent().unwrap()).unwrap();
    }

    #[test]
    fn damaged_file_is_put_aside_and_the_next_one_is_whole() {
        let directory = folder("damaged");
        std::fs::create_dir_all(&directory).unwrap();
        std::fs::write(directory.join(KIND.name), "half a").unwrap();
        let history = FaultHistory::open(&directory);
        assert!(history.list(None).is_empty());
        let aside = directory.join("faults.jsonl.damaged-1");
        assert_eq!(std::fs::read_to_string(&aside).unwrap(), "half a");
        history.note(&fault(0), &installation());
        history.save();
        assert_eq!(FaultHistory::open(&directory).list(None).len(), 1);
        assert!(aside.exists());
        std::fs::remove_dir_all(&directory).unwrap();
    }

    #[test]
    fn without_a_usable_directory_faults_are_in_memory() {
        let file = folder("file");
        std::fs::write(&file, "kept").unwrap();
        let history = FaultHistory::open(&file);
        history.note(&fault(0), &installation());
        history.save();
        assert_eq!((history.list(None).len(), history.is_unsaved()), (1, false));
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
        std::fs::remove_file(&file).unwrap();
    }

    #[test]
    fn failed_write_is_tried_again() {
        let directory = folder("again");
        let history = FaultHistory::open(&directory);
        history.note(&fault(0), &installation());
        std::fs::remove_dir_all(&directory).unwrap();
        history.save();
        assert!(history.is_unsaved());
        std::fs::create_dir_all(&directory).unwrap();
        history.save();
        assert!(!history.is_unsaved());
        assert_eq!(FaultHistory::open(&directory).list(None).len(), 1);
        std::fs::remove_dir_all(&directory).unwrap();
    }
}
