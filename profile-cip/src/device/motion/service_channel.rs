//! The service channel of an instance, clauses 6-2.7.1.2.5 and 6-2.7.2.1.8.
//!
//! A request stays in the C-to-D updates until it is answered; the answer stays in the D-to-C updates until the request
//! is taken away or replaced. A transaction ID that was seen last is not executed again, however often it comes, also
//! with another body: what a request asks for is what it asked for when its ID was new. Another service code under the
//! same ID is another request; its answer names it. A request that is taken away while it is worked on goes on, and
//! its answer waits for its return until another request comes.

use arrayvec::ArrayVec;

use crate::device::attribute::list_job::BODY_MAX;
use crate::device::attribute::worker::AttributeWorker;
use crate::wire::motion::codes::MotionService;
use crate::wire::motion::{ServiceRequest, ServiceResponse};
use crate::wire::status::GeneralStatus;

/// State of the channel.
#[derive(Default)]
pub(crate) struct ServiceChannel {
    /// The last transaction, answered or not.
    transaction: Option<(u8, MotionService)>,
    /// The request stands in the last update.
    present: bool,
    answered: bool,
    status: u8,
    body: ArrayVec<u8, BODY_MAX>,
    /// Attribute service in progress.
    pub worker: AttributeWorker,
}

impl ServiceChannel {
    /// Takes the service block of an update, or its absence. Returns whether the request is new and has to be executed.
    pub fn handle(&mut self, request: Option<&ServiceRequest<'_>>) -> bool {
        self.present = request.is_some();
        let Some(request) = request else { return false };
        let transaction = Some((request.transaction_id, request.service));
        if self.transaction == transaction {
            return false;
        }
        self.transaction = transaction;
        self.answered = false;
        self.worker.abandon();
        true
    }

    /// Answers the transaction in progress.
    pub fn answer(&mut self, status: GeneralStatus, body: &[u8]) {
        self.answered = true;
        self.status = status.0;
        self.body.clear();
        if self.body.try_extend_from_slice(body).is_err() {
            self.status = GeneralStatus::REPLY_DATA_TOO_LARGE.0;
        }
    }

    /// Whether a transaction waits for its answer.
    pub fn is_busy(&self) -> bool {
        self.transaction.is_some() && !self.answered
    }

    /// The response for the next D-to-C update.
    pub fn response(&self) -> Option<ServiceResponse<'_>> {
        let (transaction_id, service) = self.transaction.filter(|_| self.present && self.answered)?;
        let (general_status, data) = (self.status, self.body.as_slice());
        Some(ServiceResponse { transaction_id, service, general_status, extended_status: 0, data })
    }

    /// Forgets everything: the connection is gone.
    pub fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(transaction_id: u8) -> ServiceRequest<'static> {
        ServiceRequest { transaction_id, service: MotionService::GROUP_SYNC, data: &[] }
    }

    #[test]
    fn a_transaction_is_executed_once_and_answered_while_it_stands() {
        let mut channel = ServiceChannel::default();
        assert!(channel.handle(Some(&request(1))));
        assert!(!channel.handle(Some(&request(1))), "still standing");
        assert_eq!(channel.response(), None);
        channel.answer(GeneralStatus::SUCCESS, &[5]);
        assert_eq!(channel.response().map(|r| (r.transaction_id, r.data)), Some((1, &[5][..])));
        assert!(!channel.handle(Some(&request(1))), "not again after the answer");
        assert!(!channel.handle(None));
        assert_eq!(channel.response(), None, "taken away");
        assert!(!channel.handle(Some(&request(1))), "nor when it comes back");
        assert_eq!(channel.response().map(|r| r.general_status), Some(0));
        assert!(channel.handle(Some(&request(2))), "the next one replaces it");
        assert_eq!((channel.response(), channel.is_busy()), (None, true));
        let other = ServiceRequest { service: MotionService::SET_CYCLIC_READ_LIST, ..request(2) };
        assert!(channel.handle(Some(&other)), "another service under the same ID");
        let changed = ServiceRequest { data: &[9, 9, 9, 9], ..other };
        assert!(!channel.handle(Some(&changed)), "another body under the same ID");
        assert!(!channel.handle(None));
        channel.answer(GeneralStatus::INVALID_PARAMETER, &[]);
        assert_eq!(channel.response(), None, "withdrawn while it was worked on");
        assert!(!channel.handle(Some(&other)));
        assert_eq!(channel.response().map(|r| (r.service, r.general_status)), Some((other.service, 0x20)));
        assert!(channel.handle(Some(&request(2))), "the service before, which was answered long ago");
        assert!(
            channel.handle(Some(&request(255))) && channel.handle(Some(&request(0))),
            "the count starts anew"
        );
        channel.reset();
        assert!(channel.handle(Some(&request(0))), "another connection starts anew");
    }
}
