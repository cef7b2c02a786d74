//! Explicit requests that wait for their turn, and the one that is worked on.

use core::net::Ipv4Addr;

use arrayvec::ArrayVec;

use crate::device::attribute::worker::AttributeWorker;
use crate::device::motion_link::{ExplicitRequest, Token};

/// Explicit requests that may wait.
const WAITING_MAX: usize = 8;

/// The request in progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::device) struct Current {
    pub token: Token,
    pub instance: usize,
    /// Who asked.
    pub originator: Ipv4Addr,
    /// It does more than read.
    pub changes: bool,
}

/// The queue.
#[derive(Default)]
pub(in crate::device) struct ExplicitQueue {
    waiting: ArrayVec<ExplicitRequest, WAITING_MAX>,
    /// The request in progress.
    pub current: Option<Current>,
    /// The attribute service of the request in progress.
    pub worker: AttributeWorker,
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
