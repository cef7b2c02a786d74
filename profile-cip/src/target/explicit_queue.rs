//! Explicit requests that wait for their turn, and the one that is worked on.

use arrayvec::ArrayVec;
use profile_generic::time::SystemTime;

use super::attribute_worker::AttributeWorker;
use super::motion_link::{ExplicitRequest, Token};

/// Explicit requests that may wait.
const WAITING_MAX: usize = 8;

/// The queue.
#[derive(Default)]
pub(super) struct ExplicitQueue {
    waiting: ArrayVec<ExplicitRequest, WAITING_MAX>,
    /// Token and instance of the request in progress.
    pub current: Option<(Token, usize)>,
    /// The attribute service of the request in progress.
    pub worker: AttributeWorker,
    /// System time at which the requests were looked at last.
    pub system_time: Option<SystemTime>,
}

impl ExplicitQueue {
    /// Adds a request, or gives it back if the queue is full.
    #[expect(clippy::result_large_err, reason = "the request is moved once more, not boxed")]
    pub fn push(&mut self, request: ExplicitRequest) -> Result<(), ExplicitRequest> {
        self.waiting.try_push(request).map_err(|error| error.element())
    }

    /// Takes the oldest request.
    pub fn pop(&mut self) -> Option<ExplicitRequest> {
        (!self.waiting.is_empty()).then(|| self.waiting.remove(0))
    }
}
