//! The Axis Control / Axis Response handshake, clause 5-2.6.1.1 and Tables 5-2.105 to 5-2.109.
//!
//! ```text
//! controller  0   x   x   x   0   0        request; acknowledge when complete; both back to zero
//! device      0   0   0   x   x   0
//!
//! controller  x   x   y   y   0            pending request: y follows x without a zero between
//! device      0   x   0   y   y
//!
//! controller  x   127  0   y               cancel: acknowledged at once, x goes on until y
//! device      0   127  0   0
//! ```
//!
//! A request is a change of the code, never its level: a code that stays, or comes back after a lost update, starts
//! nothing twice.

use crate::wire::motion::codes::AxisControl;
use crate::wire::status::GeneralStatus;

/// The handshake of Axis Control and Axis Response of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisControlHandshake {
    /// Code of the last update.
    seen: AxisControl,
    /// Operation that goes on.
    executing: Option<AxisControl>,
    /// Whether its end is to be acknowledged: its code still stands.
    answering: bool,
    response: AxisControl,
    status: u8,
}

impl AxisControlHandshake {
    /// Takes the code of an update. Returns the operation to begin, if the code is a new request.
    pub fn request(&mut self, code: AxisControl) -> Option<AxisControl> {
        if code == self.seen {
            return None;
        }
        self.seen = code;
        self.answering = false;
        match code {
            AxisControl::NONE => {
                self.respond(AxisControl::NONE, GeneralStatus::SUCCESS);
                None
            }
            AxisControl::CANCEL => {
                self.respond(AxisControl::CANCEL, GeneralStatus::SUCCESS);
                None
            }
            _ => {
                self.respond(AxisControl::NONE, GeneralStatus::SUCCESS);
                self.executing = Some(code);
                self.answering = true;
                Some(code)
            }
        }
    }

    /// The operation in progress, cancelled or not.
    #[must_use]
    pub fn executing(&self) -> Option<AxisControl> {
        self.executing
    }

    /// Ends the operation in progress. It is acknowledged unless the controller has taken its code away.
    pub fn complete(&mut self, status: GeneralStatus) {
        if let Some(code) = self.executing.take()
            && self.answering
        {
            self.answering = false;
            self.respond(code, status);
        }
    }

    fn respond(&mut self, code: AxisControl, status: GeneralStatus) {
        self.response = code;
        self.status = status.0;
    }

    /// Axis Response and Response Status for the next update.
    #[must_use]
    pub fn response(&self) -> (AxisControl, u8) {
        (self.response, self.status)
    }

    /// Forgets everything: the connection is gone.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OK: GeneralStatus = GeneralStatus::SUCCESS;
    const NOTHING: (AxisControl, u8) = (AxisControl::NONE, 0);

    #[test]
    fn successful_and_unsuccessful_cycle() {
        // Tables 5-2.105 and 5-2.106.
        for status in [OK, GeneralStatus::OBJECT_STATE_CONFLICT] {
            let mut h = AxisControlHandshake::default();
            assert_eq!(h.request(AxisControl::ENABLE), Some(AxisControl::ENABLE));
            assert_eq!(h.response(), NOTHING);
            assert_eq!(h.request(AxisControl::ENABLE), None, "a standing request is not a new one");
            h.complete(status);
            assert_eq!(h.response(), (AxisControl::ENABLE, status.0));
            assert_eq!(h.request(AxisControl::ENABLE), None, "nor after its acknowledge");
            assert_eq!(h.executing(), None);
            assert_eq!(h.request(AxisControl::NONE), None);
            assert_eq!(h.response(), NOTHING);
            assert_eq!(h.request(AxisControl::ENABLE), Some(AxisControl::ENABLE));
        }
    }

    #[test]
    fn pending_cycle() {
        // Table 5-2.107.
        let mut h = AxisControlHandshake::default();
        h.request(AxisControl::FAULT_RESET);
        h.complete(OK);
        assert_eq!(h.response(), (AxisControl::FAULT_RESET, 0));
        assert_eq!(h.request(AxisControl::ENABLE), Some(AxisControl::ENABLE));
        assert_eq!(h.response(), NOTHING, "the old acknowledge does not stand beside a new request");
        h.complete(OK);
        assert_eq!(h.response(), (AxisControl::ENABLE, 0));
    }

    #[test]
    fn cancel_cycle() {
        // Table 5-2.108.
        let mut h = AxisControlHandshake::default();
        h.request(AxisControl::ENABLE);
        assert_eq!(h.request(AxisControl::CANCEL), None);
        assert_eq!(h.response(), (AxisControl::CANCEL, 0));
        assert_eq!(h.executing(), Some(AxisControl::ENABLE), "the operation goes on");
        h.request(AxisControl::NONE);
        assert_eq!(h.response(), NOTHING);
        h.complete(OK);
        assert_eq!(h.response(), NOTHING, "a cancelled operation is not acknowledged");
        assert_eq!(h.request(AxisControl::DISABLE), Some(AxisControl::DISABLE));
        h.complete(OK);
        assert_eq!(h.response(), (AxisControl::DISABLE, 0));
    }

    #[test]
    fn a_request_taken_away_is_not_acknowledged() {
        let mut h = AxisControlHandshake::default();
        h.request(AxisControl::ENABLE);
        h.request(AxisControl::NONE);
        assert_eq!(h.executing(), Some(AxisControl::ENABLE));
        h.complete(OK);
        assert_eq!(h.response(), NOTHING);
    }
}
