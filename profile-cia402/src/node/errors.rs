//! Errors of a device: error register 1001h, history 1003h and EMCY messages with their inhibit time.

use arrayvec::ArrayVec;
use profile_generic::time::{DurationNs, MonotonicTime};

use super::dictionary::Dictionary;
use crate::drive::ErrorCode;
use crate::generated::objects;
use crate::wire::emcy::{Emcy, ErrorRegister};

/// Entries of the history.
pub const HISTORY_LEN: u8 = 8;

/// Errors that can be present at once; further ones are told, but not remembered as present.
const ACTIVE_MAX: usize = 32;

/// Messages that wait for their inhibit time; of further ones the oldest is lost, so that the last state is told.
const WAITING_MAX: usize = 16;

/// The errors.
#[derive(Debug, Clone, Default)]
pub(super) struct Errors {
    active: ArrayVec<(ErrorCode, u8), ACTIVE_MAX>,
    waiting: ArrayVec<Emcy, WAITING_MAX>,
    inhibited_until: MonotonicTime,
}

impl Errors {
    /// An error comes. One that is present already is not told again.
    pub fn raise(&mut self, code: ErrorCode, source: u8, dictionary: &mut Dictionary) {
        if self.active.contains(&(code, source)) {
            return;
        }
        let _ = self.active.try_push((code, source));
        remember(code, source, dictionary);
        self.tell(code, source, dictionary);
    }

    /// An error goes. One that is not present is none.
    pub fn clear(&mut self, code: ErrorCode, source: u8, dictionary: &mut Dictionary) {
        let before = self.active.len();
        self.active.retain(|known| *known != (code, source));
        if self.active.len() != before {
            self.tell(ErrorCode::NO_ERROR, source, dictionary);
        }
    }

    /// Forgets what belongs to the communication, which starts anew, and what was not told yet.
    pub fn restart(&mut self, dictionary: &mut Dictionary) {
        self.active.retain(|(code, _)| !code.is_communication());
        self.waiting.clear();
        dictionary.set(objects::ERROR_REGISTER, 0, i64::from(self.register()));
    }

    fn register(&self) -> u8 {
        self.active.iter().fold(0, |register, (code, _)| register | code.register())
    }

    fn tell(&mut self, code: ErrorCode, source: u8, dictionary: &mut Dictionary) {
        let register = self.register();
        dictionary.set(objects::ERROR_REGISTER, 0, i64::from(register));
        if self.waiting.is_full() {
            self.waiting.remove(0);
        }
        let register = ErrorRegister::from_bits_retain(register);
        self.waiting.push(Emcy { code, register, vendor: [source, 0, 0, 0, 0] });
    }

    /// The next message that may be sent now.
    pub fn poll(&mut self, now: MonotonicTime, dictionary: &Dictionary) -> Option<Emcy> {
        if self.waiting.is_empty() || now < self.inhibited_until {
            return None;
        }
        let inhibit = dictionary.number(objects::INHIBIT_TIME_EMCY, 0);
        self.inhibited_until = now + DurationNs::from_micros(100 * inhibit);
        Some(self.waiting.remove(0))
    }
}

/// Puts an error first in the history.
fn remember(code: ErrorCode, source: u8, dictionary: &mut Dictionary) {
    for sub in (2..=HISTORY_LEN).rev() {
        let older = dictionary.number(objects::PRE_DEFINED_ERROR_FIELD, sub - 1);
        dictionary.set(objects::PRE_DEFINED_ERROR_FIELD, sub, older);
    }
    dictionary.set(
        objects::PRE_DEFINED_ERROR_FIELD,
        1,
        i64::from(u32::from(source) << 16 | u32::from(code.0)),
    );
    let count = dictionary.number(objects::PRE_DEFINED_ERROR_FIELD, 0);
    dictionary.set(objects::PRE_DEFINED_ERROR_FIELD, 0, (count + 1).min(i64::from(HISTORY_LEN)));
}

/// Empties the history.
pub(super) fn forget(dictionary: &mut Dictionary) {
    for sub in 0..=HISTORY_LEN {
        dictionary.set(objects::PRE_DEFINED_ERROR_FIELD, sub, 0);
    }
}
