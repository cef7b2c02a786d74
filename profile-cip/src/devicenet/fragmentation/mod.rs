//! The fragmentation protocols: acknowledged for explicit messages, unacknowledged for I/O messages.
//!
//! ```text
//! explicit  sender    first 0        middle 1       last 2
//!           receiver         ack 0          ack 1          ack 2
//! I/O       sender    first 0 middle 1 last 2
//! ```
//!
//! | a receiver of explicit fragments gets | it |
//! |---|---|
//! | first, count 0 | starts anew and acknowledges |
//! | the next count | appends and acknowledges |
//! | the count it has acknowledged last | acknowledges again: its acknowledge was lost |
//! | any other count | drops the message |
//! | more than it can keep | drops the message and acknowledges "too much data" |
//!
//! A sender waits one second for an acknowledge, sends the fragment once more, waits another second and gives up. An
//! acknowledge of another count than that of the fragment that is out ends the message; one of the fragment before, which
//! a repetition brings about, is passed over.

use arrayvec::ArrayVec;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::wire::explicit::FRAGMENT_MAX;
use super::wire::fragment::ONLY;
use super::wire::{AcknowledgeStatus, Fragment, FragmentKind};

/// Longest explicit message body that is sent or kept, bytes.
pub const EXPLICIT_MAX: usize = 512;

/// Longest I/O message that is sent or kept, bytes.
pub const IO_MAX: usize = 64;

/// Bytes of an I/O message in one fragment.
pub const IO_FRAGMENT_MAX: usize = 7;

/// Longest I/O message that goes in one frame without fragmentation byte, bytes.
pub const IO_UNFRAGMENTED_MAX: usize = 8;

/// Time to wait for the acknowledge of a fragment.
pub const ACKNOWLEDGE_TIMEOUT: DurationNs = DurationNs::from_secs(1);

/// Body of an explicit message.
pub type Body = ArrayVec<u8, EXPLICIT_MAX>;

/// Why a message was given up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum FragmentError {
    /// A fragment has not the count that was expected, or is none of a message that has begun.
    #[error("expected fragment {expected}, got {found}")]
    Count {
        /// The count expected.
        expected: u8,
        /// The count that came.
        found: u8,
    },
    /// A middle or last fragment came, and no message has begun.
    #[error("fragment {found} of a message whose beginning is missing")]
    NoBeginning {
        /// The count that came.
        found: u8,
    },
    /// The message is longer than can be kept.
    #[error("the message has more than {max} bytes")]
    TooLong {
        /// Bytes that can be kept.
        max: usize,
    },
    /// An acknowledge came that nothing was sent for.
    #[error("acknowledge {found} of nothing")]
    Unasked {
        /// The count that came.
        found: u8,
    },
    /// The other side cannot take a message of this length.
    #[error("the receiver has no room for the message")]
    Refused,
    /// The acknowledge has a status that is not known.
    #[error("the receiver refuses a fragment with status {0}")]
    Status(u8),
    /// A fragment was sent twice and not acknowledged.
    #[error("fragment {count} was not acknowledged")]
    NoAcknowledge {
        /// Its count.
        count: u8,
    },
    /// The frame has no byte for what has to be in it.
    #[error("a fragment without its fragmentation byte or data")]
    Short,
}

/// A fragment to be sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its fragmentation byte.
    pub fragment: Fragment,
    /// Its data.
    pub data: ArrayVec<u8, IO_UNFRAGMENTED_MAX>,
}

fn part(fragment: Fragment, data: &[u8]) -> Part {
    Part { fragment, data: data.iter().copied().take(IO_UNFRAGMENTED_MAX).collect() }
}

/// Sends one explicit message in fragments.
#[derive(Debug, Clone, Default)]
pub struct ExplicitSender {
    body: Body,
    /// Offset and count of the fragment that is out or due.
    offset: usize,
    count: u8,
    active: bool,
    /// The fragment has to be sent.
    due: bool,
    repeated: bool,
    deadline: MonotonicTime,
}

impl ExplicitSender {
    /// Begins a message that is longer than [`super::wire::explicit::UNFRAGMENTED_MAX`]; one that is under way is given up.
    pub fn start(&mut self, body: &[u8]) {
        self.body = body.iter().copied().take(EXPLICIT_MAX).collect();
        self.offset = 0;
        self.count = 0;
        self.active = true;
        self.due = true;
        self.repeated = false;
    }

    /// Gives the message up.
    pub fn abandon(&mut self) {
        self.active = false;
    }

    /// Whether a message is under way.
    #[must_use]
    pub const fn is_active(&self) -> bool {
        self.active
    }

    /// The fragment that is to be sent now. It counts as sent at `now`.
    pub fn poll(&mut self, now: MonotonicTime) -> Option<Part> {
        if !self.active || !self.due {
            return None;
        }
        self.due = false;
        self.deadline = now + ACKNOWLEDGE_TIMEOUT;
        let rest = self.body.get(self.offset..).unwrap_or_default();
        let kind = match (self.offset, rest.len() > FRAGMENT_MAX) {
            (_, false) => FragmentKind::Last,
            (0, true) => FragmentKind::First,
            (_, true) => FragmentKind::Middle,
        };
        Some(part(Fragment { kind, count: self.count }, &rest[..rest.len().min(FRAGMENT_MAX)]))
    }

    /// Takes an acknowledge. `Ok(true)`: the whole message has arrived.
    ///
    /// # Errors
    /// The message is given up.
    pub fn handle(&mut self, count: u8, status: AcknowledgeStatus) -> Result<bool, FragmentError> {
        if !self.active || self.due {
            return Err(FragmentError::Unasked { found: count });
        }
        if self.count == Fragment::next(count) && self.offset > 0 && status == AcknowledgeStatus::SUCCESS {
            return Ok(false);
        }
        self.active = false;
        if count != self.count {
            return Err(FragmentError::Count { expected: self.count, found: count });
        }
        match status {
            AcknowledgeStatus::SUCCESS => {}
            AcknowledgeStatus::TOO_MUCH_DATA => return Err(FragmentError::Refused),
            other => return Err(FragmentError::Status(other.0)),
        }
        self.offset += FRAGMENT_MAX;
        if self.offset >= self.body.len() {
            return Ok(true);
        }
        self.count = Fragment::next(self.count);
        self.active = true;
        self.due = true;
        self.repeated = false;
        Ok(false)
    }

    /// Lets time pass: repeats the fragment that is out, or gives the message up.
    ///
    /// # Errors
    /// It was repeated already.
    pub fn handle_time(&mut self, now: MonotonicTime) -> Result<(), FragmentError> {
        if !self.active || self.due || now < self.deadline {
            return Ok(());
        }
        if self.repeated {
            self.active = false;
            return Err(FragmentError::NoAcknowledge { count: self.count });
        }
        self.repeated = true;
        self.due = true;
        Ok(())
    }

    /// When [`Self::handle_time`] has something to do.
    #[must_use]
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        (self.active && !self.due).then_some(self.deadline)
    }
}

/// What a receiver of explicit fragments has to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Received {
    /// Send this acknowledge.
    pub acknowledge: Option<(u8, AcknowledgeStatus)>,
    /// The message is whole: [`ExplicitReceiver::body`].
    pub complete: bool,
    /// The message was dropped.
    pub error: Option<FragmentError>,
}

impl Received {
    const fn taken(count: u8, complete: bool) -> Self {
        Self { acknowledge: Some((count, AcknowledgeStatus::SUCCESS)), complete, error: None }
    }

    const fn dropped(error: FragmentError) -> Self {
        Self { acknowledge: None, complete: false, error: Some(error) }
    }
}

/// Puts explicit messages together.
#[derive(Debug, Clone, Default)]
pub struct ExplicitReceiver {
    body: Body,
    /// Count acknowledged last, and whether the message goes on behind it.
    last: Option<(u8, bool)>,
}

impl ExplicitReceiver {
    /// The message put together last.
    #[must_use]
    pub fn body(&self) -> &[u8] {
        &self.body
    }

    /// Forgets what has begun.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// Takes a fragment, which is no acknowledge.
    pub fn handle(&mut self, fragment: Fragment, data: &[u8]) -> Received {
        let count = fragment.count;
        // A first fragment starts anew, so that its repetition needs no care.
        let again = fragment.kind != FragmentKind::First && self.last.is_some_and(|(last, _)| last == count);
        if again {
            return Received::taken(count, false);
        }
        match (fragment.kind, self.last) {
            (FragmentKind::First, _) if count == 0 => self.body.clear(),
            (FragmentKind::First, _) => {
                self.reset();
                return Received::dropped(FragmentError::Count { expected: 0, found: count });
            }
            (_, Some((last, true))) if count == Fragment::next(last) => {}
            (_, Some((last, true))) => {
                self.reset();
                let expected = Fragment::next(last);
                return Received::dropped(FragmentError::Count { expected, found: count });
            }
            _ => {
                self.reset();
                return Received::dropped(FragmentError::NoBeginning { found: count });
            }
        }
        if self.body.try_extend_from_slice(data).is_err() {
            self.reset();
            return Received {
                acknowledge: Some((count, AcknowledgeStatus::TOO_MUCH_DATA)),
                complete: false,
                error: Some(FragmentError::TooLong { max: EXPLICIT_MAX }),
            };
        }
        let complete = fragment.kind == FragmentKind::Last;
        self.last = Some((count, !complete));
        Received::taken(count, complete)
    }
}

/// Data of an I/O message, whole.
pub type IoData = ArrayVec<u8, IO_MAX>;

/// The frames of an I/O message: each the data field of one.
#[derive(Debug, Clone)]
pub struct IoFrames<'a> {
    data: &'a [u8],
    /// Offset of the next fragment; `None` behind the last.
    next: Option<usize>,
    count: u8,
    fragmented: bool,
}

impl<'a> IoFrames<'a> {
    /// The frames of `data` on a connection of `size` bytes. Above 8 bytes a connection is fragmented, whatever the length of
    /// a message; a message without data has none to fragment.
    #[must_use]
    pub const fn new(size: usize, data: &'a [u8]) -> Self {
        Self { data, next: Some(0), count: 0, fragmented: size > IO_UNFRAGMENTED_MAX && !data.is_empty() }
    }
}

impl Iterator for IoFrames<'_> {
    type Item = ArrayVec<u8, IO_UNFRAGMENTED_MAX>;

    fn next(&mut self) -> Option<Self::Item> {
        let offset = self.next?;
        let rest = self.data.get(offset..).unwrap_or_default();
        let mut frame = ArrayVec::new();
        if !self.fragmented {
            self.next = None;
            frame.extend(rest.iter().copied().take(IO_UNFRAGMENTED_MAX));
            return Some(frame);
        }
        let last = rest.len() <= IO_FRAGMENT_MAX;
        let fragment = match (offset, last) {
            (0, true) => Fragment { kind: FragmentKind::First, count: ONLY },
            (0, false) => Fragment { kind: FragmentKind::First, count: 0 },
            (_, true) => Fragment { kind: FragmentKind::Last, count: self.count },
            (_, false) => Fragment { kind: FragmentKind::Middle, count: self.count },
        };
        self.next = if last { None } else { Some(offset + IO_FRAGMENT_MAX) };
        self.count = Fragment::next(self.count);
        frame.push(fragment.byte());
        frame.extend(rest.iter().copied().take(IO_FRAGMENT_MAX));
        Some(frame)
    }
}

/// Puts I/O messages together.
#[derive(Debug, Clone, Default)]
pub struct IoReceiver {
    data: IoData,
    expected: Option<u8>,
}

impl IoReceiver {
    /// The message put together last.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// Forgets what has begun.
    pub fn reset(&mut self) {
        self.expected = None;
    }

    /// Takes a frame of a connection of `size` bytes. `Ok(true)`: the message is whole.
    ///
    /// # Errors
    /// The message is dropped.
    pub fn handle(&mut self, size: usize, frame: &[u8]) -> Result<bool, FragmentError> {
        let max = size.min(IO_MAX);
        let Some((byte, data)) = frame.split_first().filter(|_| size > IO_UNFRAGMENTED_MAX) else {
            self.expected = None;
            self.data.clear();
            let fits = frame.len() <= max && self.data.try_extend_from_slice(frame).is_ok();
            return if fits { Ok(true) } else { Err(FragmentError::TooLong { max }) };
        };
        let fragment = Fragment::parse(*byte);
        let found = fragment.count;
        match (fragment.kind, self.expected.take()) {
            (FragmentKind::First, _) if found == 0 || found == ONLY => self.data.clear(),
            (FragmentKind::First, _) => return Err(FragmentError::Count { expected: 0, found }),
            (FragmentKind::Acknowledge, _) => return Err(FragmentError::Unasked { found }),
            (_, Some(expected)) if expected == found => {}
            (_, Some(expected)) => return Err(FragmentError::Count { expected, found }),
            (_, None) => return Err(FragmentError::NoBeginning { found }),
        }
        if self.data.len() + data.len() > max || self.data.try_extend_from_slice(data).is_err() {
            return Err(FragmentError::TooLong { max });
        }
        let only = fragment.kind == FragmentKind::First && found == ONLY;
        if only || fragment.kind == FragmentKind::Last {
            return Ok(true);
        }
        self.expected = Some(Fragment::next(found));
        Ok(false)
    }
}

#[cfg(test)]
mod tests;
