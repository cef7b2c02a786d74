//! The Axis Control and Axis Response handshake of one axis, clause 5-2.6.1.1.
//!
//! | controller | Axis Control | Axis Response | device |
//! |---|---|---|---|
//! | asks | x | 0 | begins |
//! | | x | x with status | has done it, or says why not |
//! | takes the answer | 0 | x | |
//! | | 0 | 0 | is free for the next request |
//!
//! A request that lasts is given up by Cancel, which the device acknowledges at once (Table 5-2.108). This
//! code waits for the response to become 0 before it asks again, so that an old acknowledge is never taken
//! for a new one.

use crate::wire::motion::codes::AxisControl;

/// Where the exchange stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exchange {
    /// Nothing asked, nothing acknowledged.
    Idle,
    /// Asked, not acknowledged yet.
    Requested(AxisControl),
    /// Acknowledged; the device has not cleared its response yet.
    Clearing,
}

/// An acknowledged request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Acknowledge {
    /// What Axis Control asks for.
    pub request: AxisControl,
    /// Response Status; 0 is success.
    pub status: u8,
}

/// The handshake of one axis.
#[derive(Debug, Clone)]
pub(crate) struct Handshake {
    exchange: Exchange,
    next: Option<AxisControl>,
    response: AxisControl,
    acknowledge: Option<Acknowledge>,
}

impl Default for Handshake {
    fn default() -> Self {
        Self { exchange: Exchange::Idle, next: None, response: AxisControl::NONE, acknowledge: None }
    }
}

impl Handshake {
    /// Asks for `code` as soon as the exchange is free. An older answer is forgotten.
    pub fn request(&mut self, code: AxisControl) {
        self.acknowledge = None;
        self.next = Some(code);
        self.advance();
    }

    /// What waits for the exchange to be free is not wanted any more.
    pub fn withdraw(&mut self) {
        self.next = None;
    }

    /// Gives up the request under way, if there is one, so that another can be made.
    pub fn cancel(&mut self) {
        self.next = None;
        if let Exchange::Requested(code) = self.exchange
            && code != AxisControl::CANCEL
        {
            self.exchange = Exchange::Requested(AxisControl::CANCEL);
        }
    }

    /// Goes on from the acknowledged request to `code` without a zero between, Table 5-2.109.
    pub fn chain(&mut self, code: AxisControl) {
        self.acknowledge = None;
        self.next = None;
        self.exchange = Exchange::Requested(code);
    }

    /// Gives up the request under way and waits for the acknowledge of that.
    pub fn ask_cancel(&mut self) {
        self.next = None;
        self.acknowledge = None;
        self.exchange = Exchange::Requested(AxisControl::CANCEL);
    }

    /// The code to send.
    pub const fn code(&self) -> AxisControl {
        match self.exchange {
            Exchange::Requested(code) => code,
            Exchange::Idle | Exchange::Clearing => AxisControl::NONE,
        }
    }

    /// The Axis Response seen last.
    pub const fn response(&self) -> AxisControl {
        self.response
    }

    /// The answer to `request`, once.
    pub fn take(&mut self, request: AxisControl) -> Option<Acknowledge> {
        self.acknowledge.take_if(|acknowledge| acknowledge.request == request)
    }

    /// Takes the response of an update.
    pub fn handle(&mut self, response: AxisControl, status: u8) {
        self.response = response;
        match self.exchange {
            // What is chained begins while the acknowledge before it still stands; that one has another code.
            Exchange::Requested(request) if response == request => {
                self.acknowledge = Some(Acknowledge { request, status });
                self.exchange = Exchange::Clearing;
            }
            Exchange::Clearing if response == AxisControl::NONE => self.exchange = Exchange::Idle,
            _ => {}
        }
        self.advance();
    }

    fn advance(&mut self) {
        if self.exchange == Exchange::Idle
            && self.response == AxisControl::NONE
            && let Some(code) = self.next.take()
        {
            self.exchange = Exchange::Requested(code);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_successful_cycle_of_table_5_2_105() {
        let mut h = Handshake::default();
        h.request(AxisControl::ENABLE);
        assert_eq!(h.code(), AxisControl::ENABLE);
        h.handle(AxisControl::NONE, 0);
        assert_eq!((h.code(), h.take(AxisControl::ENABLE)), (AxisControl::ENABLE, None));
        h.handle(AxisControl::ENABLE, 0);
        assert_eq!(h.code(), AxisControl::NONE);
        assert_eq!(h.take(AxisControl::DISABLE), None);
        let done = Acknowledge { request: AxisControl::ENABLE, status: 0 };
        assert_eq!((h.take(AxisControl::ENABLE), h.take(AxisControl::ENABLE)), (Some(done), None));
        h.handle(AxisControl::NONE, 0);
        h.request(AxisControl::ENABLE);
        assert_eq!(h.code(), AxisControl::ENABLE);
    }

    #[test]
    fn a_refusal_of_table_5_2_106_brings_its_status() {
        let mut h = Handshake::default();
        h.request(AxisControl::ENABLE);
        h.handle(AxisControl::ENABLE, 0x10);
        let refused = Acknowledge { request: AxisControl::ENABLE, status: 0x10 };
        assert_eq!((h.code(), h.take(AxisControl::ENABLE)), (AxisControl::NONE, Some(refused)));
    }

    #[test]
    fn the_same_request_again_waits_until_the_old_answer_is_gone() {
        let mut h = Handshake::default();
        h.request(AxisControl::FAULT_RESET);
        h.handle(AxisControl::FAULT_RESET, 0);
        h.request(AxisControl::FAULT_RESET);
        h.handle(AxisControl::FAULT_RESET, 0);
        assert_eq!((h.code(), h.take(AxisControl::FAULT_RESET)), (AxisControl::NONE, None));
        h.handle(AxisControl::NONE, 0);
        assert_eq!(h.code(), AxisControl::FAULT_RESET);
    }

    #[test]
    fn cancel_of_table_5_2_108_frees_the_way_for_disable() {
        let mut h = Handshake::default();
        h.request(AxisControl::ENABLE);
        h.cancel();
        assert_eq!(h.code(), AxisControl::CANCEL);
        h.request(AxisControl::DISABLE);
        assert_eq!(h.code(), AxisControl::CANCEL);
        h.handle(AxisControl::CANCEL, 0);
        assert_eq!(h.code(), AxisControl::NONE);
        h.handle(AxisControl::NONE, 0);
        assert_eq!(h.code(), AxisControl::DISABLE);
        h.handle(AxisControl::DISABLE, 0);
        assert!(h.take(AxisControl::DISABLE).is_some());
    }

    /// Every state of the exchange with every input: the code sent then, and the answer.
    #[test]
    fn the_whole_table() {
        use AxisControl as C;
        let idle = Handshake::default();
        let mut asked = idle.clone();
        asked.request(C::ENABLE);
        let mut cancelling = asked.clone();
        cancelling.cancel();
        let mut clearing = asked.clone();
        clearing.handle(C::ENABLE, 0);
        let mut waiting = clearing.clone();
        waiting.request(C::DISABLE);
        let states = [
            ("idle", idle),
            ("asked", asked),
            ("cancelling", cancelling),
            ("clearing", clearing),
            ("waiting", waiting),
        ];
        type Input = fn(&mut Handshake);
        let inputs: [(&str, Input); 6] = [
            ("request Disable", |h| h.request(C::DISABLE)),
            ("cancel", Handshake::cancel),
            ("response None", |h| h.handle(C::NONE, 0)),
            ("response Enable", |h| h.handle(C::ENABLE, 0)),
            ("response Enable refused", |h| h.handle(C::ENABLE, 0x0C)),
            ("response Cancel", |h| h.handle(C::CANCEL, 0)),
        ];
        let mut table = String::new();
        for (state, start) in &states {
            for (input, apply) in &inputs {
                let mut h = start.clone();
                apply(&mut h);
                let answer = h.acknowledge.map(|a| format!(", {} with {:#04x}", a.request, a.status));
                table += &format!("{state:10} | {input:23} | {}{}\n", h.code(), answer.unwrap_or_default());
            }
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn a_response_without_a_request_is_no_answer() {
        let mut h = Handshake::default();
        h.handle(AxisControl::ENABLE, 0);
        assert_eq!(h.take(AxisControl::ENABLE), None);
        h.request(AxisControl::DISABLE);
        assert_eq!(h.code(), AxisControl::NONE, "a response is still standing");
        h.handle(AxisControl::NONE, 0);
        assert_eq!(h.code(), AxisControl::DISABLE);
    }
}
