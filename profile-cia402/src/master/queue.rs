//! The application's requests to one device.

use arrayvec::ArrayVec;

use super::config::QUEUE_MAX;
use crate::sdo::request::{SdoFailure, SdoOutcome, SdoRequest};

/// Which of several waiting requests goes first. A running one is never interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Priority {
    /// In order of submission.
    #[default]
    Normal,
    /// Before all normal ones: what the cyclic plane waits for.
    Urgent,
}

#[derive(Debug)]
enum Content {
    Waiting(Priority, SdoRequest),
    Running,
    Done(SdoOutcome),
}

/// Requests in order of submission.
#[derive(Debug, Default)]
pub(super) struct Queue {
    places: ArrayVec<(u64, Content), QUEUE_MAX>,
    next: u64,
}

impl Queue {
    /// Takes a request; its serial number, or the request when there is no room.
    #[allow(clippy::result_large_err, reason = "the request goes back with the caller's buffer")]
    pub fn submit(&mut self, priority: Priority, request: SdoRequest) -> Result<u64, SdoRequest> {
        if self.places.is_full() {
            return Err(request);
        }
        let serial = self.next;
        self.next += 1;
        self.places.push((serial, Content::Waiting(priority, request)));
        Ok(serial)
    }

    /// The request that is to run, if none does.
    pub fn start(&mut self) -> Option<SdoRequest> {
        if self.places.iter().any(|(_, content)| matches!(content, Content::Running)) {
            return None;
        }
        let urgency = |content: &Content| match content {
            Content::Waiting(priority, _) => Some(*priority),
            _ => None,
        };
        let best = self.places.iter().filter_map(|(_, content)| urgency(content)).max()?;
        let place = self.places.iter_mut().find(|(_, content)| urgency(content) == Some(best))?;
        match core::mem::replace(&mut place.1, Content::Running) {
            Content::Waiting(_, request) => Some(request),
            _ => None,
        }
    }

    /// The running request has ended.
    pub fn finish(&mut self, outcome: SdoOutcome) {
        if let Some(place) = self.places.iter_mut().find(|(_, content)| matches!(content, Content::Running)) {
            place.1 = Content::Done(outcome);
        }
    }

    /// No waiting request can be carried any more.
    pub fn fail(&mut self, failure: SdoFailure) {
        for (_, content) in &mut self.places {
            if let Content::Waiting(_, request) = content {
                let SdoRequest { object, operation, .. } = *request;
                let data = core::mem::take(&mut request.data);
                *content = Content::Done(SdoOutcome { object, operation, result: Err(failure), data });
            }
        }
    }

    /// The first outcome.
    pub fn take_outcome(&mut self) -> Option<(u64, SdoOutcome)> {
        let place = self.places.iter().position(|(_, content)| matches!(content, Content::Done(_)))?;
        match self.places.remove(place) {
            (serial, Content::Done(outcome)) => Some((serial, outcome)),
            _ => None,
        }
    }

    /// Whether a request waits.
    pub fn is_waiting(&self) -> bool {
        self.places.iter().any(|(_, content)| matches!(content, Content::Waiting(..)))
    }

    /// Whether nothing waits or runs.
    pub fn is_idle(&self) -> bool {
        self.places.iter().all(|(_, content)| matches!(content, Content::Done(_)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sdo::request::SdoOperation;
    use crate::wire::Mux;

    fn request(index: u16) -> SdoRequest {
        SdoRequest::upload(Mux::new(index, 0))
    }

    fn outcome(index: u16) -> SdoOutcome {
        let object = Mux::new(index, 0);
        SdoOutcome { object, operation: SdoOperation::Upload, result: Ok(()), data: Default::default() }
    }

    #[test]
    fn urgent_requests_go_first_and_nothing_overtakes_a_running_one() {
        let mut queue = Queue::default();
        for (index, priority) in [(1, Priority::Normal), (2, Priority::Normal), (3, Priority::Urgent)] {
            queue.submit(priority, request(index)).unwrap();
        }
        assert_eq!(queue.start().unwrap().object.index, 3);
        queue.submit(Priority::Urgent, request(4)).unwrap();
        assert_eq!(queue.start(), None);
        queue.finish(outcome(3));
        assert_eq!(queue.start().unwrap().object.index, 4);
        queue.fail(SdoFailure::NodeLost);
        queue.finish(outcome(4));
        let ended: Vec<_> = core::iter::from_fn(|| queue.take_outcome()).collect();
        let ended: Vec<_> =
            ended.iter().map(|(serial, end)| (*serial, end.object.index, end.result.is_ok())).collect();
        assert_eq!(ended, [(0, 1, false), (1, 2, false), (2, 3, true), (3, 4, true)]);
        assert!(queue.is_idle());
    }

    #[test]
    fn a_full_queue_gives_the_request_back() {
        let mut queue = Queue::default();
        for _ in 0..QUEUE_MAX {
            queue.submit(Priority::Normal, request(1)).unwrap();
        }
        assert_eq!(queue.submit(Priority::Urgent, request(2)), Err(request(2)));
    }
}
