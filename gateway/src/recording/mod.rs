//! The rolling recording: the last seconds of all sides in memory, and the first contacts of controllers.
//!
//! ```text
//! cycle thread, supervisor --queues--> recorder thread --lock--> ring of the last frames --> local socket, HTTP
//!                                                         \----> contacts                --> local socket, HTTP
//! events of the adapters, notices of the cycle, published status --/                     \-> files
//! ```
//!
//! The cycle thread pushes records into its queues and knows nothing of the rest. Whoever takes a recording copies the ring
//! under the lock and makes the file of the copy; the queues hold what the recorder thread cannot take meanwhile.

mod automatic;
pub mod contact;
mod ring;

use std::collections::VecDeque;
use std::fmt;
use std::io;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

use profile_cip::device::event::Event;
use profile_generic::time::DurationNs;
use tracing::{info, warn};

pub use self::contact::{AttributeNames, Contact, ContactDevice};

use self::automatic::Automatic;
use self::contact::{Contacts, Happening, Unsaved};
use self::ring::FrameRing;
use crate::capture::Side;
use crate::capture::recorder::{FrameSink, Interfaces};
use crate::engine::notice::Notice;
use crate::status::BoxStatus;
use crate::sys::clock::{KernelTime, realtime_now};

/// Part of the memory that is for frames of streams once more: those that opened the connections which stand.
const EXPLICIT_PART: usize = 32;

/// Events of the adapters that wait for the recorder thread; more are left out.
const INBOX_MAX: usize = 1_024;

/// Least time from one writing of the contacts to the next: a controller that is refused again and again wears no disk.
const SAVE_INTERVAL: Duration = Duration::from_secs(10);

/// Most records of the greatest length that the queue of a place where traffic is seen can hold: the recorder thread may be late by tens of
/// milliseconds.
pub const DEPTH: usize = 256;

/// Fewest records of a queue: a cycle of each bus and update, and the segments of an answer.
const DEPTH_MIN: usize = 64;

/// Records of the greatest length of all queues together, as long as each has its fewest: 1.6 MB.
const RECORDS_MAX: usize = 1_024;

/// Records of the greatest length that each of so many queues can hold.
#[must_use]
pub fn depth(queues: usize) -> usize {
    (RECORDS_MAX / queues.max(1)).clamp(DEPTH_MIN, DEPTH)
}

/// What a recording is made of.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The longest recording that can be taken.
    pub span: DurationNs,
    /// Bytes of memory for all frames: half for the ring, half for the contacts.
    pub memory: usize,
    /// Descriptions of the interfaces.
    pub interfaces: Interfaces,
    /// The devices in the order of the configuration.
    pub devices: Vec<ContactDevice>,
    /// The axes in the order of the configuration, by name, with the place of their device.
    pub axes: Vec<(String, usize)>,
    /// Names of attributes of the Motion Device Axis Object.
    pub attributes: AttributeNames,
    /// The buses in the order of the published status, by name.
    pub buses: Vec<String>,
    /// Where recordings of faults and contacts are kept; `None` keeps no recordings of faults, and contacts in memory.
    pub directory: Option<PathBuf>,
}

/// Why no recording can be had.
#[derive(Debug, thiserror::Error)]
pub enum TakeError {
    /// Another one is being made: one at a time bounds the memory.
    #[error("another recording is being made; try again")]
    Busy,
    /// There is no contact of this number.
    #[error("there is no contact {0}")]
    NoContact(u64),
    /// The file cannot be made, or that of the contact cannot be read.
    #[error("the recording cannot be made: {0}")]
    Io(#[from] io::Error),
}

/// The rolling recording of a gateway.
pub struct Recording {
    span: DurationNs,
    interfaces: Interfaces,
    state: Mutex<State>,
    inbox: Mutex<VecDeque<Happening>>,
    /// Held while a file is made.
    making: Mutex<()>,
}

impl fmt::Debug for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recording").field("span", &self.span).finish_non_exhaustive()
    }
}

/// What the recorder thread fills.
struct State {
    ring: FrameRing,
    /// Frames of streams, which are few and say what the cyclic ones mean.
    explicit: FrameRing,
    contacts: Contacts,
    automatic: Automatic,
    lost: u64,
    contacts_saved: Option<Instant>,
}

impl State {
    /// The contacts that have changed; the next ones have time until they are asked for.
    fn take_unsaved(&mut self) -> Option<Unsaved> {
        self.contacts_saved = Some(Instant::now());
        self.contacts.take_unsaved()
    }
}

impl Recording {
    /// An empty recording, whose memory is taken from the system now.
    #[must_use]
    pub fn new(plan: Plan) -> Arc<Self> {
        let Plan { span, memory, interfaces, devices, axes, attributes, buses, directory } = plan;
        let explicit = memory / EXPLICIT_PART;
        let names = axes.iter().map(|(name, _)| name.clone()).collect();
        let state = State {
            ring: FrameRing::new(memory / 2 - explicit),
            explicit: FrameRing::new(explicit),
            contacts: Contacts::new(
                devices,
                axes,
                attributes,
                memory / 2,
                directory.as_ref().map(|path| path.join("contacts")),
            ),
            automatic: Automatic::new(names, buses, directory.map(|path| path.join("recordings"))),
            lost: 0,
            contacts_saved: None,
        };
        Arc::new(Self {
            span,
            interfaces,
            state: Mutex::new(state),
            inbox: Mutex::default(),
            making: Mutex::default(),
        })
    }

    /// The end for the recorder thread.
    #[must_use]
    pub fn sink(self: &Arc<Self>) -> Box<dyn FrameSink> {
        Box::new(Sink(Arc::clone(self)))
    }

    /// The longest recording that can be taken.
    #[must_use]
    pub const fn span(&self) -> DurationNs {
        self.span
    }

    /// The frames of the last seconds as a pcapng file, at most [`Self::span`]. It takes milliseconds.
    ///
    /// # Errors
    /// [`TakeError::Busy`]; the others only without memory.
    pub fn take(&self, last: DurationNs) -> Result<Vec<u8>, TakeError> {
        let _making = self.begin()?;
        self.last(last)
    }

    /// All contacts, newest first.
    #[must_use]
    pub fn contacts(&self) -> Vec<Contact> {
        self.state().contacts.list()
    }

    /// The frames of a contact as a pcapng file.
    ///
    /// # Errors
    /// [`TakeError`].
    pub fn take_contact(&self, number: u64) -> Result<Vec<u8>, TakeError> {
        let _making = self.begin()?;
        let found = self.state().contacts.frames(number);
        match found.ok_or(TakeError::NoContact(number))? {
            (_, Some(file)) => Ok(std::fs::read(file)?),
            (frames, None) => Ok(ring::pcapng(&frames, KernelTime(0), &self.interfaces, 0)?),
        }
    }

    /// Takes what the adapter of a device reports; the device is its place in the configuration.
    pub fn note_event(&self, device: usize, event: &Event) {
        let mut inbox = lock(&self.inbox);
        if inbox.len() < INBOX_MAX {
            inbox.push_back(Happening { device, at: realtime_now(), event: *event });
        }
    }

    /// Takes what the cycle reports.
    pub fn note(&self, notice: &Notice) {
        let now = realtime_now();
        let mut state = self.state();
        state.contacts.note(now, notice);
        state.automatic.note(now, notice);
    }

    /// Looks at the published status: buses that were lost, and what contacts wait for.
    pub fn look(&self, status: &BoxStatus) {
        let mut state = self.state();
        state.contacts.look(status);
        state.automatic.look(realtime_now(), status);
    }

    /// Whether there is something to write now.
    #[must_use]
    pub fn is_unsaved(&self) -> bool {
        let state = self.state();
        let rested = state.contacts_saved.is_none_or(|at| at.elapsed() >= SAVE_INTERVAL);
        state.automatic.is_due(realtime_now()) || (rested && state.contacts.is_unsaved())
    }

    /// Writes the recording of a fault that is due, and contacts that have changed. It waits for the disk.
    pub fn save(&self) {
        self.save_until(realtime_now());
    }

    /// The gateway ends: what is due later is written now. It waits for the disk.
    pub fn close(&self) {
        self.state().contacts.close();
        self.save_until(KernelTime(u64::MAX));
    }

    fn save_until(&self, now: KernelTime) {
        let due = self.state().automatic.take_due(now);
        if let Some((files, incident)) = due {
            // It is not worth leaving out because somebody looks at a recording.
            let _making = lock(&self.making);
            let written = self.last(self.span).and_then(|file| Ok(files.write(&incident, &file)?));
            match written {
                Ok(path) => info!(file = %path.display(), "the recording of {incident} is kept"),
                Err(error) => warn!(%error, "the recording of {incident} cannot be written"),
            }
        }
        self.save_contacts();
    }

    fn save_contacts(&self) {
        let Some((files, changed, kept)) = self.state().take_unsaved() else { return };
        if changed.is_empty() {
            return;
        }
        for (contact, frames) in changed {
            // Without frames: those of an earlier run, whose file is there.
            let file = (!frames.is_empty())
                .then(|| ring::pcapng(&frames, KernelTime(0), &self.interfaces, contact.frames_left_out));
            let written = file.transpose().and_then(|file| files.write(&contact, file.as_deref()));
            if let Err(error) = written {
                warn!(%error, "the contact {} cannot be written", contact.number);
            }
        }
        files.retain(&kept);
    }

    fn last(&self, last: DurationNs) -> Result<Vec<u8>, TakeError> {
        let (copy, lost) = {
            let state = self.state();
            (state.ring.copy(), state.lost)
        };
        let newest = ring::frames(&copy).map(|frame| frame.at).max().unwrap_or(KernelTime(0));
        let span = u64::try_from(last.min(self.span).as_nanos()).unwrap_or(0);
        let since = KernelTime(newest.0.saturating_sub(span));
        Ok(ring::pcapng(&copy, since, &self.interfaces, lost)?)
    }

    fn begin(&self) -> Result<MutexGuard<'_, ()>, TakeError> {
        match self.making.try_lock() {
            Ok(guard) => Ok(guard),
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => Err(TakeError::Busy),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The end of the recorder thread.
struct Sink(Arc<Recording>);

impl FrameSink for Sink {
    fn round(&mut self, lost: u64) {
        let happenings = std::mem::take(&mut *lock(&self.0.inbox));
        let mut state = self.0.state();
        state.lost = lost;
        let State { contacts, explicit, .. } = &mut *state;
        happenings.iter().for_each(|happening| contacts.take(happening, explicit));
    }

    fn frame(&mut self, at: KernelTime, side: Side, frame: &[u8]) {
        let mut state = self.0.state();
        state.ring.push(at, side, frame);
        if side == Side::North && is_of_stream(frame) {
            state.explicit.push(at, side, frame);
        }
        state.contacts.frame(at, side, frame);
    }
}

/// Whether a frame that the recorder has made is one of a TCP stream.
fn is_of_stream(frame: &[u8]) -> bool {
    const PROTOCOL: usize = 14 + 9;
    const TCP: u8 = 6;
    frame.get(PROTOCOL) == Some(&TCP)
}

#[cfg(test)]
pub(crate) mod tests;
