//! The session of a client: its requests, what it waits for, and the replies. How lines come and go is up to the server.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use profile_generic::time::DurationNs;
use tokio::sync::mpsc;
use tracing::info;

use super::drive::job::{Ask, Context, Job, Step};
use super::hub::{PENDING_MAX, Shared, ToClient, ToHub, Who};
use super::protocol::{self, BadRequest, FileRequest, NamedParameter};
use crate::bundle::Sources;
use crate::engine::direct::{DirectAnswer, DirectRequest};
use crate::engine::local::{Answer, ClientId, Order, Request};

/// Lines about orders that a client can have written at once.
const ORDER_LINES: u32 = 20;

/// After this time it can have another one.
const ORDER_LINE_PAUSE: Duration = Duration::from_secs(1);

/// What a line comes to.
#[derive(Debug, PartialEq, Eq)]
pub enum Taken {
    /// Its reply.
    Reply(String),
    /// The engine is asked; [`Session::reply`] has the reply.
    Asked,
    /// A file is to be sent.
    File(FileRequest),
}

/// A client of local control. When it is dropped, the axes of the client stop and lose their torque.
#[derive(Debug)]
pub struct Session {
    id: ClientId,
    who: Who,
    shared: Arc<Shared>,
    to_hub: mpsc::UnboundedSender<ToHub>,
    answers: mpsc::Receiver<ToClient>,
    pending: HashMap<u32, Accepted>,
    last: u32,
    /// The longest time for which an axis moves after a jog.
    jog_max: Option<DurationNs>,
    written: Written,
}

impl Drop for Session {
    fn drop(&mut self) {
        // The hub has gone only with the gateway, whose end stops the axes.
        let _ = self.to_hub.send(ToHub::Gone { client: self.id });
    }
}

impl Session {
    pub(super) fn new(
        id: ClientId,
        who: Who,
        shared: Arc<Shared>,
        to_hub: mpsc::UnboundedSender<ToHub>,
        answers: mpsc::Receiver<ToClient>,
    ) -> Self {
        let written = Written { free: ORDER_LINES, since: Instant::now(), left_out: 0, last: None };
        Self { id, who, shared, to_hub, answers, pending: HashMap::new(), last: 0, jog_max: None, written }
    }

    /// Its number.
    #[must_use]
    pub const fn id(&self) -> ClientId {
        self.id
    }

    /// Limits how long an axis moves after each jog.
    #[must_use]
    pub const fn limit_jogs(mut self, time: DurationNs) -> Self {
        self.jog_max = Some(time);
        self
    }

    /// Takes a line.
    pub fn take(&mut self, line: &Result<String, BadRequest>) -> Taken {
        match self.parse(line) {
            Ok(request) => self.begin_request(request, line.as_ref().map_or("-", String::as_str)),
            Err(reply) => Taken::Reply(reply),
        }
    }

    /// Takes a request that stood in this line.
    pub fn begin_request(&mut self, request: protocol::Request, line: &str) -> Taken {
        if let protocol::Request::File(wanted) = request {
            return Taken::File(wanted);
        }
        self.last = self.last.wrapping_add(1);
        match self.request(self.last, request, line) {
            Ok((accepted, message)) => {
                self.write_down(&accepted);
                self.pending.insert(self.last, accepted);
                // The hub has gone only with the gateway: there is no reply then.
                let _ = self.to_hub.send(message);
                Taken::Asked
            }
            Err(reply) => Taken::Reply(reply),
        }
    }

    /// Waits for the next reply; `None` when the client has been given up because it does not read its replies. Nothing is lost when the
    /// future is dropped.
    pub async fn reply(&mut self) -> Option<String> {
        loop {
            match self.answers.recv().await? {
                ToClient::Answer(answer) => {
                    if let Some(accepted) = self.pending.remove(&answer.id) {
                        return Some(self.answer(&accepted, &answer));
                    }
                }
                ToClient::Accessed(answer) => match self.accessed(answer) {
                    Ok(request) => _ = self.to_hub.send(ToHub::Access(request)),
                    Err(reply) => return Some(reply),
                },
            }
        }
    }

    /// What a line asks for; or the reply to it.
    ///
    /// # Errors
    /// The reply.
    pub fn parse(&self, line: &Result<String, BadRequest>) -> Result<protocol::Request, String> {
        let line = line.as_ref().map_err(|error| protocol::bad("-", error))?;
        let Shared { names, parameters, .. } = &*self.shared;
        protocol::parse(line, names, parameters).map_err(|error| protocol::bad(line, &error))
    }

    /// Makes a file; otherwise the reply that says why there is none.
    pub(super) async fn file(&self, wanted: FileRequest) -> Result<Vec<u8>, String> {
        let sources = Arc::clone(&self.shared.sources);
        // It takes tens of milliseconds, and waits for the disk.
        let made = tokio::task::spawn_blocking(move || make(&sources, wanted)).await;
        let made = made.unwrap_or_else(|_| Err("it could not be made".to_owned()));
        made.map_err(|text| format!("error {} - recording: {text}\n", wanted.word()))
    }

    /// Writes down who has given which order, or written which parameter. A jog that goes on is one order.
    fn write_down(&mut self, accepted: &Accepted) {
        let (order, parameter) = match &accepted.what {
            What::Order(order) => (order.name(), None),
            What::Parameter(named, Some(_)) => ("write", Some(named.name.clone())),
            What::Drive(job) => match job.written() {
                Some(id) => ("write", Some(id.to_string())),
                None => return,
            },
            What::Parameter(_, None) => return,
        };
        let axis = accepted.axis;
        let Some(left_out) = self.written.admits(Instant::now(), (axis, order)) else { return };
        let axis = self.shared.names.get(axis).map_or("-", String::as_str);
        let (client, from) = (self.id, self.who);
        // A field without a value is not in the line.
        let left_out = Some(left_out).filter(|left_out| *left_out > 0);
        info!(axis, parameter, client, %from, left_out, "local control: {order}");
    }

    /// What a request asks the engine for, under the number `id`; or the reply to it.
    fn request(&self, id: u32, request: protocol::Request, line: &str) -> Result<(Accepted, ToHub), String> {
        let Shared { names, parameters, .. } = &*self.shared;
        let number = |axis: usize| u8::try_from(axis).unwrap_or(u8::MAX);
        let client = self.id;
        match request {
            protocol::Request::Box => Err(self.shared.overview()),
            protocol::Request::Axes => Err(protocol::list(names, |axis| self.shared.state(axis))),
            protocol::Request::Status { axis } => {
                Err(protocol::done("status", &names[axis], &self.shared.state(axis)))
            }
            protocol::Request::Parameters => Err(protocol::parameter_list(parameters)),
            protocol::Request::Log(query) => Err(self.shared.log(&query)),
            protocol::Request::Faults { axis } => Err(self.shared.faults(axis)),
            protocol::Request::Attributes { axis } => Err(self.shared.attributes.reply(axis, &names[axis])),
            protocol::Request::Contacts => Err(self.shared.contacts()),
            // Its reply is not a text.
            protocol::Request::File(_) => Err(String::new()),
            _ if self.pending.len() >= PENDING_MAX => Err(protocol::bad(line, &BadRequest::TooMany)),
            protocol::Request::Order { axis, mut order } => {
                if let (Order::Jog(jog), Some(most)) = (&mut order, self.jog_max) {
                    jog.time = jog.time.min(most);
                }
                let request = Request::Order { client, id, axis: number(axis), order };
                Ok((Accepted { axis, what: What::Order(order) }, ToHub::Ask(request)))
            }
            protocol::Request::Parameter { axis, parameter, wanted } => {
                let named = parameters[parameter].clone();
                let parameter = named.parameter;
                let request = Request::Parameter { client, id, axis: number(axis), parameter, wanted };
                Ok((Accepted { axis, what: What::Parameter(named, wanted) }, ToHub::Ask(request)))
            }
            protocol::Request::Drive { axis, ask } => self.begin(id, axis, ask),
        }
    }

    /// Begins with a request for parameters of a drive; or the reply to it.
    fn begin(&self, id: u32, axis: usize, ask: Ask) -> Result<(Accepted, ToHub), String> {
        let (job, step) = self.with_context(axis, |context| Job::begin(ask, context))?;
        match step {
            Step::Access(..) => {
                let request = self.access(id, axis, step)?;
                Ok((Accepted { axis, what: What::Drive(Box::new(job)) }, ToHub::Access(request)))
            }
            Step::Reply(reply) => Err(reply),
        }
    }

    /// Goes on with a request when its drive has answered: the next access, or the reply.
    fn accessed(&mut self, answer: DirectAnswer) -> Result<DirectRequest, String> {
        let id = answer.id;
        let Some(Accepted { axis, what: What::Drive(mut job) }) = self.pending.remove(&id) else {
            return Err(String::new());
        };
        let step = self.with_context(axis, |context| job.take(answer, context));
        let next = self.access(id, axis, step);
        if next.is_ok() {
            self.pending.insert(id, Accepted { axis, what: What::Drive(job) });
        }
        next
    }

    /// What a step asks of the engine, or the reply that it is.
    fn access(&self, id: u32, axis: usize, step: Step) -> Result<DirectRequest, String> {
        match step {
            Step::Access(target, direction, data) => {
                let axis = u8::try_from(axis).unwrap_or(u8::MAX);
                Ok(DirectRequest { client: self.id, id, axis, target, direction, data })
            }
            Step::Reply(reply) => Err(reply),
        }
    }

    /// Calls with what is known of the drive of an axis.
    fn with_context<T>(&self, axis: usize, with: impl FnOnce(&Context<'_>) -> T) -> T {
        let Shared { names, parameters, catalogue, .. } = &*self.shared;
        let axis_name = names.get(axis).map_or("-", String::as_str);
        with(&Context { axis: axis_name, bus: catalogue.bus(axis), catalogue, parameters })
    }

    fn answer(&self, Accepted { axis, what }: &Accepted, answer: &Answer) -> String {
        let name = self.shared.names.get(*axis).map_or("-", String::as_str);
        let word = match what {
            What::Order(order) => order.name(),
            What::Parameter(_, None) => "read",
            What::Parameter(_, Some(_)) => "write",
            // Its accesses are answered by themselves.
            What::Drive(_) => return String::new(),
        };
        match (&answer.result, what) {
            (Ok(Some(value)), What::Parameter(named, _)) => protocol::accessed(word, name, named, *value),
            (Ok(_), _) => protocol::done(word, name, &self.shared.state(*axis)),
            (Err(failure), _) => protocol::failed(word, name, failure),
        }
    }
}

/// Makes a file; otherwise why there is none.
fn make(sources: &Sources, wanted: FileRequest) -> Result<Vec<u8>, String> {
    let recording = || {
        let off = "nothing is recorded: `[recording]` has `seconds = 0`";
        sources.recording.as_ref().ok_or_else(|| off.to_owned())
    };
    let made = match wanted {
        FileRequest::Recording(last) => {
            let recording = recording()?;
            recording.take(last.unwrap_or_else(|| recording.span()))
        }
        FileRequest::Contact(number) => recording()?.take_contact(number),
        FileRequest::Bundle => sources.bundle(),
    };
    made.map_err(|error| error.to_string())
}

/// A request that goes to the engine.
#[derive(Debug)]
struct Accepted {
    axis: usize,
    what: What,
}

/// What is asked of an axis or its drive.
#[derive(Debug)]
enum What {
    Order(Order),
    Parameter(NamedParameter, Option<i64>),
    /// A request for parameters by the numbers of the drive.
    Drive(Box<Job>),
}

/// Which lines about orders were written.
#[derive(Debug)]
struct Written {
    /// Lines that can be written at once.
    free: u32,
    /// Since when that is so.
    since: Instant,
    left_out: u32,
    /// Axis and order of the last line.
    last: Option<(usize, &'static str)>,
}

impl Written {
    /// Whether a line about an order is to be written, and how many were left out before it.
    fn admits(&mut self, now: Instant, order: (usize, &'static str)) -> Option<u32> {
        if order.1 == "jog" && self.last == Some(order) {
            return None;
        }
        self.last = Some(order);
        let earned = now.duration_since(self.since).as_secs() / ORDER_LINE_PAUSE.as_secs();
        if earned > 0 {
            self.since = now;
            self.free = self.free.saturating_add(u32::try_from(earned).unwrap_or(u32::MAX)).min(ORDER_LINES);
        }
        match self.free.checked_sub(1) {
            Some(free) => {
                self.free = free;
                Some(std::mem::take(&mut self.left_out))
            }
            None => {
                self.left_out += 1;
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_order_is_written_down_but_a_jog_that_goes_on_and_a_flood() {
        let now = Instant::now();
        let mut written = Written { free: ORDER_LINES, since: now, left_out: 0, last: None };
        assert_eq!(written.admits(now, (0, "jog")), Some(0));
        assert_eq!(written.admits(now, (0, "jog")), None, "it goes on");
        assert_eq!(written.admits(now, (1, "jog")), Some(0), "another axis");
        assert_eq!(written.admits(now, (0, "stop")), Some(0));
        assert_eq!(written.admits(now, (0, "stop")), Some(0));
        let flood = (0..100).filter(|_| written.admits(now, (0, "enable")).is_some()).count();
        assert_eq!(flood, 16);
        assert_eq!(written.admits(now + ORDER_LINE_PAUSE, (0, "disable")), Some(84));
        assert_eq!(written.admits(now + ORDER_LINE_PAUSE, (0, "disable")), None);
    }
}
