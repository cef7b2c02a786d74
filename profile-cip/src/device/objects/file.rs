//! The File object (class 0x37): controllers and tools upload the electronic data sheet from it.
//!
//! There is one file, instance 0xC8, as the object reserves it for the sheet of the device. It is read only, and
//! nothing can be downloaded.
//!
//! ```text
//! Initiate_Upload 0x4B   longest transfer u8            -> file size u32, transfer size u8
//! Upload_Transfer 0x4F   transfer number u8             -> transfer number u8, packet type u8, data [, checksum u16]
//! ```
//!
//! Transfer numbers count from 0 and start over behind 255. The same number again gets the same block again; any other
//! than that and the next one is refused and the upload goes on. The last packet carries the checksum: what makes the
//! sum of all bytes zero in 16 bits.
//!
//! Each session uploads on its own, so a client that stops in the middle keeps nobody else from the file.

use arrayvec::ArrayVec;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::object::{Answer, Object};
use crate::device::config::IdentityConfig;
use crate::device::session_slot::{SESSIONS_MAX, SessionSlot};
use crate::wire::status::{GeneralStatus, Service};

/// Class code of the File object.
pub const CLASS_FILE: u16 = 0x37;

/// Instance of the electronic data sheet of this device.
pub const INSTANCE_EDS: u16 = 0xC8;

/// Begins an upload.
pub const INITIATE_UPLOAD: Service = Service(0x4B);
/// Asks for the next block of an upload.
pub const UPLOAD_TRANSFER: Service = Service(0x4F);

/// Bytes of a reply to Upload_Transfer besides its data: reply header, transfer number, packet type, checksum.
const REPLY_OVERHEAD: usize = 4 + 2 + 2;

/// How long an upload waits for its client.
pub const UPLOAD_TIMEOUT: DurationNs = DurationNs::from_secs(10);

/// Extended status: transfer number out of sequence.
const OUT_OF_SEQUENCE: u16 = 0x06;
/// Extended status: a transfer of no bytes.
const ZERO_SIZE: u16 = 0x08;

/// Packet types of a transfer.
const FIRST: u8 = 0;
const MIDDLE: u8 = 1;
const LAST: u8 = 2;
const FIRST_AND_LAST: u8 = 4;

/// States of the file (attribute 1), as far as a file that is read only has them.
const STATE_LOADED: u8 = 2;
const STATE_UPLOAD_INITIATED: u8 = 3;
const STATE_UPLOADING: u8 = 5;

/// The upload of one session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Upload {
    session: SessionSlot,
    /// Bytes of a block.
    size: u8,
    /// Blocks sent so far.
    sent: u32,
    deadline: MonotonicTime,
}

impl Upload {
    /// Whether the last block has been sent. It stays until its time is up, so that a lost reply can be asked for again.
    fn is_done(&self, file_len: usize) -> bool {
        self.sent > 0 && usize::from(self.size) * usize::try_from(self.sent).unwrap_or(usize::MAX) >= file_len
    }
}

/// The uploads under way.
#[derive(Debug, Default)]
pub(crate) struct Uploads(ArrayVec<Upload, SESSIONS_MAX>);

impl Uploads {
    /// Ends what a session had begun.
    pub fn close_session(&mut self, session: SessionSlot) {
        self.0.retain(|upload| upload.session != session);
    }

    /// Ends the uploads whose time is up.
    pub fn expire(&mut self, now: MonotonicTime) {
        self.0.retain(|upload| upload.deadline > now);
    }

    /// When the next one ends.
    pub fn wake_at(&self) -> Option<MonotonicTime> {
        self.0.iter().map(|upload| upload.deadline).min()
    }
}

/// Who asks, when, and how long the reply may be.
pub(crate) struct Asker {
    pub session: SessionSlot,
    pub now: MonotonicTime,
    pub reply_max: usize,
}

/// The object.
pub(crate) struct File<'a> {
    pub eds: &'a [u8],
    pub identity: &'a IdentityConfig,
    pub uploads: &'a mut Uploads,
}

impl File<'_> {
    /// Runs a service of the file itself; `None` if it is none.
    pub fn serve(&mut self, service: Service, asker: &Asker, data: &[u8]) -> Option<Answer> {
        let number = match data {
            _ if service != INITIATE_UPLOAD && service != UPLOAD_TRANSFER => return None,
            [] => return Some(Answer::status(GeneralStatus::NOT_ENOUGH_DATA)),
            [number] => *number,
            _ => return Some(Answer::status(GeneralStatus::TOO_MUCH_DATA)),
        };
        self.uploads.expire(asker.now);
        Some(if service == INITIATE_UPLOAD {
            self.initiate(asker, number)
        } else {
            self.transfer(asker, number)
        })
    }

    fn initiate(&mut self, asker: &Asker, longest: u8) -> Answer {
        if longest == 0 {
            return refusal(GeneralStatus::INVALID_PARAMETER, ZERO_SIZE);
        }
        let room = asker.reply_max.saturating_sub(REPLY_OVERHEAD);
        let size = u8::try_from(room).unwrap_or(u8::MAX).min(longest);
        if size == 0 {
            return Answer::status(GeneralStatus::REPLY_DATA_TOO_LARGE);
        }
        // A client that begins again has given up what it had begun.
        self.uploads.close_session(asker.session);
        let deadline = asker.now + UPLOAD_TIMEOUT;
        let upload = Upload { session: asker.session, size, sent: 0, deadline };
        if self.uploads.0.try_push(upload).is_err() {
            return Answer::status(GeneralStatus::RESOURCE_UNAVAILABLE);
        }
        let mut reply = file_len(self.eds).to_le_bytes().to_vec();
        reply.push(size);
        Answer::done(reply)
    }

    fn transfer(&mut self, asker: &Asker, number: u8) -> Answer {
        let file = self.eds;
        let Some(upload) = self.uploads.0.iter_mut().find(|upload| upload.session == asker.session) else {
            return refusal(GeneralStatus::OBJECT_STATE_CONFLICT, u16::from(STATE_LOADED));
        };
        let [next, ..] = upload.sent.to_le_bytes();
        let block = match upload.sent.checked_sub(1) {
            // Asked for again: its reply was lost.
            Some(last) if number == next.wrapping_sub(1) => last,
            _ if upload.is_done(file.len()) => {
                return refusal(GeneralStatus::OBJECT_STATE_CONFLICT, u16::from(STATE_LOADED));
            }
            _ if number == next => upload.sent,
            _ => return refusal(GeneralStatus::INVALID_PARAMETER, OUT_OF_SEQUENCE),
        };
        let size = usize::from(upload.size);
        let begin = (size * usize::try_from(block).unwrap_or(usize::MAX)).min(file.len());
        let end = (begin + size).min(file.len());
        if REPLY_OVERHEAD + (end - begin) > asker.reply_max {
            // The client asks over a smaller connection than it began with; over the other one it may go on.
            return Answer::status(GeneralStatus::REPLY_DATA_TOO_LARGE);
        }
        upload.sent = block + 1;
        upload.deadline = asker.now + UPLOAD_TIMEOUT;
        let packet = match (begin == 0, end == file.len()) {
            (true, false) => FIRST,
            (false, false) => MIDDLE,
            (false, true) => LAST,
            (true, true) => FIRST_AND_LAST,
        };
        let mut reply = vec![number, packet];
        reply.extend_from_slice(&file[begin..end]);
        if end == file.len() {
            reply.extend(checksum(file).to_le_bytes());
        }
        Answer::done(reply)
    }

    fn state(&self) -> u8 {
        let len = self.eds.len();
        let state = |upload: &Upload| match upload {
            Upload { sent: 0, .. } => STATE_UPLOAD_INITIATED,
            _ if upload.is_done(len) => STATE_LOADED,
            _ => STATE_UPLOADING,
        };
        self.uploads.0.iter().map(state).max().unwrap_or(STATE_LOADED)
    }
}

impl Object for File<'_> {
    const REVISION: u16 = 3;
    const INSTANCE: u16 = INSTANCE_EDS;
    const ALL: &'static [u16] = &[];
    const CLASS_ATTRIBUTE_MAX: u16 = 32;
    const ATTRIBUTE_MAX: u16 = 11;

    fn get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        match attribute {
            1 => out.push(self.state()),
            2 => string_i(INSTANCE_NAME, out),
            // Instance format version.
            3 => out.extend(1u16.to_le_bytes()),
            4 => string_i(FILE_NAME, out),
            5 => out.extend([self.identity.major, self.identity.minor]),
            6 => out.extend(file_len(self.eds).to_le_bytes()),
            7 => out.extend(checksum(self.eds).to_le_bytes()),
            // Invocation method: none, the file does nothing to the device.
            8 => out.push(255),
            // File save parameters: nothing is saved.
            9 => out.push(0),
            // Access: read only.
            10 => out.push(1),
            // Encoding: plain bytes.
            11 => out.push(0),
            _ => return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED),
        }
        Ok(())
    }

    fn class_get(&self, attribute: u16, out: &mut Vec<u8>) -> Result<(), GeneralStatus> {
        if attribute != 32 {
            return Err(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED);
        }
        // Directory: instance, its name, the name of its file.
        out.extend(INSTANCE_EDS.to_le_bytes());
        string_i(INSTANCE_NAME, out);
        string_i(FILE_NAME, out);
        Ok(())
    }
}

const INSTANCE_NAME: &str = "EDS and Icon Files";
const FILE_NAME: &str = "EDS.txt";

fn refusal(status: GeneralStatus, extended: u16) -> Answer {
    Answer { extended: ArrayVec::from_iter([extended]), ..Answer::status(status) }
}

fn file_len(file: &[u8]) -> u32 {
    u32::try_from(file.len()).unwrap_or(u32::MAX)
}

/// What makes the sum of all bytes zero in 16 bits.
fn checksum(file: &[u8]) -> u16 {
    file.iter().fold(0u16, |sum, byte| sum.wrapping_sub(u16::from(*byte)))
}

/// Appends a STRINGI of one English SHORT_STRING in ISO 8859-1.
fn string_i(text: &str, out: &mut Vec<u8>) {
    const SHORT_STRING: u8 = 0xDA;
    const ISO_8859_1: u16 = 4;
    out.push(1);
    out.extend(b"eng");
    out.push(SHORT_STRING);
    out.extend(ISO_8859_1.to_le_bytes());
    super::identity::short_string(text, out);
}
