//! Recordings that are kept by themselves: at the fault of an axis, and when a bus is lost.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use profile_generic::fault::FaultCause;

use crate::engine::notice::Notice;
use crate::history::utc_nanos;
use crate::replace_file::replace_with;
use crate::status::{BoxState, BoxStatus};
use crate::sys::clock::KernelTime;

/// How long after the fault frames are taken.
const AFTER: u64 = 1_000_000_000;

/// Least time from one recording to the next: a fault that returns fills no disk.
const PAUSE: u64 = 30_000_000_000;

/// Recordings that are kept.
const FILES_MAX: usize = 10;

/// Files of the folder that are looked at.
const LISTED_MAX: usize = 1_000;

/// Why a recording is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Incident {
    at: KernelTime,
    /// The axis or bus.
    about: String,
    cause: Option<FaultCause>,
}

impl fmt::Display for Incident {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.cause {
            Some(cause) => write!(f, "the fault {cause} of axis {}", self.about),
            None => write!(f, "the loss of {}", self.about),
        }
    }
}

/// Decides when a recording is kept.
#[derive(Debug)]
pub(super) struct Automatic {
    axes: Vec<String>,
    /// Buses by name, and whether each was in cyclic operation.
    buses: Vec<(String, bool)>,
    files: Option<Files>,
    pending: Option<Incident>,
    /// Before this time no further one is kept.
    pause_until: KernelTime,
}

impl Automatic {
    pub fn new(axes: Vec<String>, buses: Vec<String>, folder: Option<PathBuf>) -> Self {
        let buses = buses.into_iter().map(|name| (name, false)).collect();
        let files = folder.map(|folder| Files { folder });
        Self { axes, buses, files, pending: None, pause_until: KernelTime(0) }
    }

    /// Takes what the cycle reports; the incident when a recording is going to be kept.
    pub fn note(&mut self, now: KernelTime, notice: &Notice) -> Option<Incident> {
        let Notice::Fault { axis, fault, .. } = notice else { return None };
        let about = self.axes.get(usize::from(*axis))?.clone();
        self.begin(Incident { at: now, about, cause: Some(fault.cause) })
    }

    /// Looks for buses that were lost; the incident when a recording is going to be kept.
    pub fn look(&mut self, now: KernelTime, status: &BoxStatus) -> Option<Incident> {
        let mut lost = None;
        for ((name, was_up), bus) in self.buses.iter_mut().zip(status.configured_buses()) {
            if std::mem::replace(was_up, bus.up) && !bus.up {
                lost = Some(name.clone());
            }
        }
        if status.state == BoxState::STOPPING {
            return None;
        }
        self.begin(Incident { at: now, about: lost?, cause: None })
    }

    fn begin(&mut self, incident: Incident) -> Option<Incident> {
        // The clock of the host may have been set back: the pause never lasts longer than it should.
        let paused = incident.at < self.pause_until && self.pause_until.0 - incident.at.0 <= PAUSE;
        if self.files.is_none() || paused {
            return None;
        }
        self.pause_until = KernelTime(incident.at.0.saturating_add(PAUSE));
        self.pending = Some(incident.clone());
        Some(incident)
    }

    /// Whether a recording is due.
    pub fn is_due(&self, now: KernelTime) -> bool {
        let due = |incident: &Incident| now < incident.at || now.0 - incident.at.0 >= AFTER;
        self.pending.as_ref().is_some_and(due)
    }

    /// The incident whose recording is due, and where it is kept.
    pub fn take_due(&mut self, now: KernelTime) -> Option<(Files, Incident)> {
        if !self.is_due(now) {
            return None;
        }
        self.files.clone().zip(self.pending.take())
    }
}

/// The folder of the recordings.
#[derive(Debug, Clone)]
pub(super) struct Files {
    folder: PathBuf,
}

impl Files {
    /// Writes a recording and removes the oldest ones beyond their number. It waits for the disk.
    pub fn write(&self, incident: &Incident, file: &[u8]) -> io::Result<PathBuf> {
        std::fs::create_dir_all(&self.folder)?;
        let path = self.folder.join(name(incident));
        replace_with(&path, file)?;
        // Names begin with the time. That of the recording itself says nothing of its age when the clock of the host is behind.
        let mut names = self.names();
        names.retain(|name| *name != path);
        names.sort();
        for old in &names[..names.len().saturating_sub(FILES_MAX - 1)] {
            let _ = std::fs::remove_file(old);
        }
        Ok(path)
    }

    fn names(&self) -> Vec<PathBuf> {
        let Ok(folder) = std::fs::read_dir(&self.folder) else { return Vec::new() };
        let is_ours = |path: &PathBuf| path.extension() == Some("pcapng".as_ref()) && begins_with_time(path);
        folder.flatten().take(LISTED_MAX).map(|entry| entry.path()).filter(is_ours).collect()
    }
}

/// Whether a file may be one of these recordings.
fn begins_with_time(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.len() > 20 && name.as_bytes()[..8].iter().all(u8::is_ascii_digit) && name.as_bytes()[8] == b'T'
}

/// The name of a file: time and axis, `20260131T120000.123456Z-turntable.pcapng`.
fn name(Incident { at, about, .. }: &Incident) -> String {
    let time = utc_nanos(at.0).replace(['-', ':'], "");
    let plain = |letter: char| if letter.is_ascii_alphanumeric() { letter } else { '-' };
    let about: String = about.chars().map(plain).take(64).collect();
    format!("{time}-{about}.pcapng")
}

#[cfg(test)]
mod tests {
    use profile_generic::fault::Fault;
    use profile_generic::time::SystemTime;

    use super::*;
    use crate::status::tests::distinct;

    const SECOND: u64 = 1_000_000_000;

    fn automatic(folder: Option<PathBuf>) -> Automatic {
        let names = ["turntable", "slide"].map(str::to_owned).to_vec();
        Automatic::new(names, vec!["SERCOS".to_owned(), "CAN bus 1".to_owned()], folder)
    }

    fn fault(axis: u8) -> Notice {
        let fault = Fault::new(FaultCause::OVER_CURRENT, SystemTime(5));
        Notice::Fault { axis, fault, loss: None, trip: None, jump: None }
    }

    #[test]
    fn fault_is_due_a_second_later_and_others_wait_for_the_pause() {
        let mut automatic = automatic(Some(PathBuf::from("x")));
        let at = |seconds: u64| KernelTime(100_000 * SECOND + seconds * SECOND);
        let incident = automatic.note(at(0), &fault(1)).unwrap();
        assert_eq!(incident.to_string(), "the fault over_current of axis slide");
        assert!(!automatic.is_due(KernelTime(at(1).0 - 1)) && automatic.take_due(at(0)).is_none());
        // One more in the meantime is in the same recording.
        assert_eq!(automatic.note(at(1), &fault(0)), None);
        assert_eq!(automatic.take_due(at(1)).unwrap().1, incident);
        assert!(!automatic.is_due(at(9)));
        assert_eq!(automatic.note(at(29), &fault(0)), None);
        assert!(automatic.note(at(30), &fault(0)).is_some());
        // The clock is set back by an hour.
        let earlier = KernelTime(at(30).0 - 3_600 * SECOND);
        assert!(automatic.note(earlier, &fault(0)).is_some());
    }

    #[test]
    fn bus_that_was_up_and_is_not_is_an_incident_once() {
        let mut automatic = automatic(Some(PathBuf::from("x")));
        let mut status = distinct();
        status.bus_count = 2;
        status.buses[0].up = false;
        status.buses[1].up = true;
        assert_eq!(automatic.look(KernelTime(SECOND), &status), None, "a bus that comes up is none");
        status.buses[1].up = false;
        let incident = automatic.look(KernelTime(2 * SECOND), &status).unwrap();
        assert_eq!(incident.to_string(), "the loss of CAN bus 1");
        assert_eq!(automatic.look(KernelTime(99 * SECOND), &status), None);
        // The end of the gateway takes the buses down.
        status.buses[1].up = true;
        automatic.look(KernelTime(99 * SECOND), &status);
        (status.buses[1].up, status.state) = (false, BoxState::STOPPING);
        assert_eq!(automatic.look(KernelTime(99 * SECOND), &status), None);
    }

    #[test]
    fn nothing_is_kept_without_a_folder() {
        assert_eq!(automatic(None).note(KernelTime(SECOND), &fault(0)), None);
    }

    #[test]
    fn ten_recordings_are_kept_and_files_of_others_are_left_alone() {
        let folder = std::env::temp_dir().join(format!("axisbridge-automatic-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        let files = Files { folder: folder.clone() };
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("mine.pcapng"), "x").unwrap();
        for second in 0..13 {
            let at = KernelTime(1_769_860_800 * SECOND + second * SECOND);
            let incident = Incident { at, about: "turn table/1".to_owned(), cause: None };
            files.write(&incident, b"frames").unwrap();
        }
        let mut names: Vec<_> = std::fs::read_dir(&folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names.len(), 11, "{names:?}");
        assert_eq!(names[0], "20260131T120003.000000Z-turn-table-1.pcapng");
        assert_eq!(names[10], "mine.pcapng");
        // The clock of the host is behind: by its name the newest recording is the oldest one.
        let incident = Incident { at: KernelTime(1_000 * SECOND), about: "x".to_owned(), cause: None };
        let newest = files.write(&incident, b"newest").unwrap();
        assert_eq!(std::fs::read(&newest).ok().as_deref(), Some(&b"newest"[..]), "{}", newest.display());
        assert_eq!(files.names().len(), FILES_MAX);
        assert!(!folder.join("20260131T120003.000000Z-turn-table-1.pcapng").exists());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
