//! Local control in a scene: a client that gives one order after the other before the controller comes.
//!
//! ```text
//! enable turntable                  a line of the protocol of local control
//! move turntable 0.5 velocity=1     waits for the answer to the one before
//! wait 300 ms
//! leave                             the client disconnects
//! ```

use std::collections::VecDeque;

use profile_generic::time::{DurationNs, MonotonicTime};

use crate::config::{Config, duration};
use crate::engine::local::{Answer, ClientEnd, Order, Request};
use crate::local::protocol::{self, BadRequest};

/// The only client.
const CLIENT: u32 = 1;

/// What the client does next.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Step {
    Order { axis: usize, order: Order },
    Wait(DurationNs),
    Leave,
}

/// What a client does, in its order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Orders(VecDeque<(String, Step)>);

/// A line that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{line}: {error}")]
pub struct OrderError {
    /// Line, 1 first.
    pub line: usize,
    /// What is wrong with it.
    pub error: String,
}

impl Orders {
    /// Reads lines, each an order of the protocol, `wait TIME` or `leave`; `#` begins a comment.
    ///
    /// # Errors
    /// The first line that is none.
    pub fn parse(text: &str, config: &Config) -> Result<Self, OrderError> {
        let axes: Vec<String> = config.axes.iter().map(|axis| axis.name.clone()).collect();
        let mut steps = VecDeque::new();
        for (line, content) in (1..).zip(text.lines()) {
            let content = content.split('#').next().unwrap_or_default().trim();
            let step = match content.strip_prefix("wait ") {
                _ if content.is_empty() => continue,
                Some(time) => {
                    duration::parse(time).map(Step::Wait).ok_or_else(|| duration::EXPECTED.to_owned())
                }
                None if content == "leave" => Ok(Step::Leave),
                None => match protocol::parse(content, &axes, &[]) {
                    Ok(protocol::Request::Order { axis, order }) => Ok(Step::Order { axis, order }),
                    Ok(_) => Err("expected an order, `wait TIME` or `leave`".to_owned()),
                    Err(BadRequest::Word(word)) => {
                        Err(format!("unknown word `{word}`: expected an order, `wait TIME` or `leave`"))
                    }
                    Err(error) => Err(error.to_string()),
                },
            };
            steps.push_back((content.to_owned(), step.map_err(|error| OrderError { line, error })?));
        }
        Ok(Self(steps))
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// The client.
#[derive(Debug)]
pub(super) struct Client {
    end: ClientEnd,
    orders: Orders,
    /// The number of the order whose answer is awaited.
    awaited: Option<u32>,
    /// Nothing is done before.
    pause: MonotonicTime,
    orders_given: u32,
}

impl Client {
    pub fn new(end: ClientEnd, orders: Orders) -> Self {
        Self { end, orders, awaited: None, pause: MonotonicTime::ZERO, orders_given: 0 }
    }

    /// Whether everything was done, and answered.
    pub fn is_done(&self, now: MonotonicTime) -> bool {
        self.orders.is_empty() && self.awaited.is_none() && now >= self.pause
    }

    /// Takes answers, and does what comes next; each is told.
    pub fn poll(&mut self, now: MonotonicTime, say: &mut dyn FnMut(&str)) {
        while let Ok(Answer { id, result, .. }) = self.end.answers.pop() {
            self.awaited.take_if(|awaited| *awaited == id);
            match result {
                Ok(_) => say("local: done"),
                Err(failure) => say(&format!("local: {}: {failure}", failure.code())),
            }
        }
        while self.awaited.is_none() && now >= self.pause {
            let Some((text, step)) = self.orders.0.pop_front() else { break };
            say(&format!("local: {text}"));
            let request = match step {
                Step::Wait(time) => {
                    self.pause = now + time;
                    continue;
                }
                Step::Leave => Request::Gone { client: CLIENT },
                Step::Order { axis, order } => {
                    self.orders_given += 1;
                    self.awaited = Some(self.orders_given);
                    let axis = u8::try_from(axis).unwrap_or(u8::MAX);
                    Request::Order { client: CLIENT, id: self.orders_given, axis, order }
                }
            };
            // There is never more than one in the queue.
            let _ = self.end.requests.push(request);
        }
    }
}
