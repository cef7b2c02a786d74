//! Node guarding, for masters that ask instead of listening: objects 100Ch and 100Dh.
//!
//! The master asks by a remote frame with the identifier of error control; the answer is the state with a bit that alternates, from 0
//! after each reset of the communication. Where 100Ch and 100Dh are not 0, the device misses the master when no request comes
//! within their product: from the first request on, so that a network without guarding never has that error. While a heartbeat is
//! produced (1017h) there is no guarding.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::dictionary::Dictionary;
use crate::generated::objects::{GUARD_TIME, LIFE_TIME_FACTOR, PRODUCER_HEARTBEAT_TIME};
use crate::wire::error_control::Heartbeat;
use crate::wire::nmt::NmtState;

/// The device's end.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Guarding {
    toggle: bool,
    /// The last request.
    asked: Option<MonotonicTime>,
    lost: bool,
}

impl Guarding {
    /// A request: the answer, if there is one, and whether the master was lost before.
    pub fn request(
        &mut self,
        now: MonotonicTime,
        state: NmtState,
        dictionary: &Dictionary,
    ) -> Option<(Heartbeat, bool)> {
        if dictionary.number(PRODUCER_HEARTBEAT_TIME, 0) != 0 {
            return None;
        }
        let answer = Heartbeat { state, toggle: self.toggle };
        self.toggle = !self.toggle;
        self.asked = Some(now);
        Some((answer, core::mem::take(&mut self.lost)))
    }

    /// Whether the requests stay away, told once.
    pub fn misses(&mut self, now: MonotonicTime, dictionary: &Dictionary) -> bool {
        let life_time = dictionary.number(GUARD_TIME, 0) * dictionary.number(LIFE_TIME_FACTOR, 0);
        let heartbeat = dictionary.number(PRODUCER_HEARTBEAT_TIME, 0) != 0;
        let Some(asked) = self.asked.filter(|_| life_time > 0 && !heartbeat) else { return false };
        if now.since(asked) < DurationNs::from_millis(life_time) {
            return false;
        }
        (self.asked, self.lost) = (None, true);
        true
    }
}
