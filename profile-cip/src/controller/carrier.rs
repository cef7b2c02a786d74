//! Services of the fixed connection format: the requests of the service channel as explicit messages, clause 6-2.7.3.
//!
//! Service code and body are the same; the instance stands in the path. One is under way at a time, and a message of the
//! program may go between two of them.

use super::engine::Controller;
use super::failure::Failure;
use super::program::ExplicitMessage;
use super::session::{Answer, Asker, MOTION_DEVICE_AXIS};
use crate::wire::motion::Format;
use profile_generic::time::MonotonicTime;

impl Controller {
    /// Sends the service under way, once.
    pub(super) fn carry_services(&mut self, now: MonotonicTime) {
        if self.config.format != Format::Fixed {
            return;
        }
        let Some((instance, request)) = self.services.request() else {
            self.carried = None;
            return;
        };
        let id = (instance, request.transaction_id);
        if self.carried == Some(id) {
            return;
        }
        let message = ExplicitMessage {
            service: request.service.0,
            class: MOTION_DEVICE_AXIS,
            instance: u16::from(instance),
            attribute: None,
            data: request.data.to_vec(),
        };
        if self.session.message(now, Asker::Services(id.0, id.1), &message) {
            self.carried = Some(id);
        }
    }

    /// Takes the answer to a message, regardless of which request it belongs to.
    pub(super) fn take_answer(&mut self, now: MonotonicTime, asker: Asker, answer: Result<Answer, Failure>) {
        match asker {
            Asker::Program => self.answer = Some(answer),
            Asker::Services(instance, transaction) => {
                self.services.handle_answer(now, (instance, transaction), answer);
            }
        }
    }
}
