//! The stream of events behind the page: one event is made for all viewers, twice a second.

use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::body::{Body, Bytes, HttpBody};
use hyper::body::Frame;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, watch};
use tokio::time::MissedTickBehavior;

use super::traces::PERIOD;
use super::view::{Look, View};

/// Samples for the charts from one event to the next: events come twice a second.
const SAMPLES_PER_EVENT: u32 = 5;

/// When a browser connects again after the stream has ended, in the words of the stream.
const RETRY: &str = "retry: 2000\n";

/// The source of all streams.
#[derive(Debug)]
pub struct Events {
    view: Arc<View>,
    latest: watch::Sender<Bytes>,
    places: Arc<Semaphore>,
}

impl Events {
    /// Streams for at most so many viewers.
    pub fn new(view: Arc<View>, viewers_max: usize) -> Self {
        let (latest, _) = watch::channel(Bytes::new());
        Self { view, latest, places: Arc::new(Semaphore::new(viewers_max)) }
    }

    /// Takes the samples for the charts, and makes the events. It looks at the gateway also while nobody views it, so that a silent cycle thread is noticed in time.
    pub async fn run(&self) {
        let mut interval = tokio::time::interval(PERIOD);
        interval.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut samples = 0_u32;
        loop {
            interval.tick().await;
            self.view.sample();
            samples = samples.wrapping_add(1);
            if !samples.is_multiple_of(SAMPLES_PER_EVENT) {
                continue;
            }
            let look = self.view.look();
            if self.latest.receiver_count() > 0 {
                self.latest.send_replace(event("", &look));
            }
        }
    }

    /// A stream for one more viewer, which begins with the state now; `None` when there are too many.
    pub fn stream(&self) -> Option<Body> {
        let place = Arc::clone(&self.places).try_acquire_owned().ok()?;
        let (sender, receiver) = mpsc::channel(1);
        // The channel has room for the first event.
        let _ = sender.try_send(event(RETRY, &self.view.look()));
        tokio::spawn(forward(self.latest.subscribe(), sender));
        Some(Body::new(Stream { receiver, _place: place }))
    }
}

/// Passes the events on. A viewer that is slow misses some and gets the latest one next.
async fn forward(mut latest: watch::Receiver<Bytes>, viewer: mpsc::Sender<Bytes>) {
    loop {
        let changed = tokio::select! {
            changed = latest.changed() => changed,
            () = viewer.closed() => return,
        };
        let event = latest.borrow_and_update().clone();
        if changed.is_err() || viewer.send(event).await.is_err() {
            return;
        }
    }
}

/// An event `status` with a look as one line of JSON.
fn event(head: &str, look: &Look) -> Bytes {
    // The object has texts, numbers and lists, and nothing that JSON does not know.
    let json = serde_json::to_string(look).unwrap_or_default();
    Bytes::from(format!("{head}event: status\ndata: {json}\n\n"))
}

/// The events of one viewer, as the body of an answer.
struct Stream {
    receiver: mpsc::Receiver<Bytes>,
    _place: OwnedSemaphorePermit,
}

impl HttpBody for Stream {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        self.receiver.poll_recv(context).map(|event| event.map(|event| Ok(Frame::data(event))))
    }
}
