//! The service channel of the motion I/O connection, clause 6-2.7.1.2.5.
//!
//! A job is a list of request bodies to one instance. One request is under way at a time; it stays in the
//! updates until the response with its transaction ID has come. The next one has the transaction ID
//! incremented.

use std::collections::VecDeque;

use super::config::{AttributeSet, MAX_AXES};
use super::event::AttributeValue;
use super::failure::Failure;
use super::program::CyclicDirection;
use super::session::Answer;
use crate::wire::Error;
use crate::wire::motion::attribute_list::{
    AttributeSelector, GetItem, GetResponse, HEAD_LEN, ListWriter, SetResponse,
};
use crate::wire::motion::codes::{MotionService, SyncStatus};
use crate::wire::motion::id_list::{IdList, IdStatusList};
use crate::wire::motion::{ServiceRequest, ServiceResponse};
use profile_generic::time::{DurationNs, MonotonicTime};

/// General status that says: look at the status of each attribute.
const ATTRIBUTE_LIST_ERROR: u8 = 0x0A;
/// Bytes of a status in a Set response and of an error in a Get response.
const STATUS_LEN: usize = 4;

/// Names a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Ticket(u64);

/// What came of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Outcome {
    /// All sets were answered; these attributes were refused with these general statuses.
    Set { refused: Vec<(u16, u8)> },
    /// The values read.
    Get { values: Vec<AttributeValue> },
    /// The answer to Group_Sync.
    Sync(SyncStatus),
    /// Block ID in force after Set_Cyclic_Write_List or Set_Cyclic_Read_List, and the attributes refused.
    List { block_id: u8, refused: Vec<(u16, u8)> },
    /// The answer to anything else, as it came.
    Raw { status: u8, data: Vec<u8> },
}

/// Room of one request and one response in the connection, in bytes of body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    pub request: usize,
    pub response: usize,
}

#[derive(Debug)]
struct Body {
    bytes: Vec<u8>,
    attributes: u16,
}

#[derive(Debug)]
struct Job {
    ticket: Ticket,
    instance: u8,
    service: MotionService,
    bodies: VecDeque<Body>,
    outcome: Outcome,
}

#[derive(Debug)]
struct UnderWay {
    since: MonotonicTime,
}

/// The service channel.
#[derive(Debug)]
pub(super) struct Services {
    jobs: VecDeque<Job>,
    under_way: Option<UnderWay>,
    transactions: [u8; MAX_AXES + 1],
    next_ticket: u64,
    done: Vec<(Ticket, Result<Outcome, Failure>)>,
    time_out: DurationNs,
}

impl Services {
    pub fn new(time_out: DurationNs) -> Self {
        Self {
            jobs: VecDeque::new(),
            under_way: None,
            transactions: [0; MAX_AXES + 1],
            next_ticket: 0,
            done: Vec::new(),
            time_out,
        }
    }

    /// Writes attributes, in as many requests as the room asks for.
    pub fn set(&mut self, instance: u8, sets: &[AttributeSet], room: Room) -> Result<Ticket, Failure> {
        let items: Vec<_> = sets
            .iter()
            .map(|set| {
                let needed = set.selector.head_len() + set.value.len().next_multiple_of(4);
                Item { id: set.selector.id, needed, answer: STATUS_LEN }
            })
            .collect();
        let bodies = split(instance, &items, room, |index, list| {
            list.value(&sets[index].selector, &sets[index].value)
        })?;
        let outcome = Outcome::Set { refused: Vec::new() };
        Ok(self.submit(instance, MotionService::SET_AXIS_ATTRIBUTES_LIST, bodies, outcome))
    }

    /// Reads attributes, in as many requests as the room asks for.
    pub fn get(
        &mut self,
        instance: u8,
        selectors: &[AttributeSelector],
        room: Room,
    ) -> Result<Ticket, Failure> {
        let items: Vec<_> = selectors
            .iter()
            .map(|selector| {
                let value = selector.value_len().unwrap_or(usize::MAX / 2).next_multiple_of(4);
                let answer = selector.head_len() + value;
                Item { id: selector.id, needed: selector.head_len(), answer }
            })
            .collect();
        let bodies = split(instance, &items, room, |index, list| list.select(&selectors[index]))?;
        let outcome = Outcome::Get { values: Vec::new() };
        Ok(self.submit(instance, MotionService::GET_AXIS_ATTRIBUTES_LIST, bodies, outcome))
    }

    /// Asks whether the device is synchronized to this grand master.
    pub fn group_sync(&mut self, grand_master: [u8; 8]) -> Ticket {
        let body = Body { bytes: grand_master.to_vec(), attributes: 0 };
        let outcome = Outcome::Sync(SyncStatus::NOT_SYNCHRONIZED);
        self.submit(0, MotionService::GROUP_SYNC, VecDeque::from([body]), outcome)
    }

    /// Agrees on the attributes of a cyclic list.
    pub fn cyclic_list(
        &mut self,
        instance: u8,
        direction: CyclicDirection,
        ids: &[u16],
        room: Room,
    ) -> Result<Ticket, Failure> {
        let service = match direction {
            CyclicDirection::Write => MotionService::SET_CYCLIC_WRITE_LIST,
            CyclicDirection::Read => MotionService::SET_CYCLIC_READ_LIST,
        };
        let mut bytes = vec![0; room.request.min(HEAD_LEN + ids.len().next_multiple_of(2) * 2)];
        let length = IdList::emit(&mut bytes, ids).map_err(|error| Failure::ServiceMalformed {
            instance,
            service,
            error,
        })?;
        bytes.truncate(length);
        let attributes = u16::try_from(ids.len()).unwrap_or(u16::MAX);
        let outcome = Outcome::List { block_id: 0, refused: Vec::new() };
        Ok(self.submit(instance, service, VecDeque::from([Body { bytes, attributes }]), outcome))
    }

    /// Makes any request; the answer is not looked into.
    pub fn raw(
        &mut self,
        instance: u8,
        service: MotionService,
        data: &[u8],
        room: Room,
    ) -> Result<Ticket, Failure> {
        if data.len() > room.request {
            return Err(Failure::ServiceTooLong { instance, service, room: room.request });
        }
        let body = Body { bytes: data.to_vec(), attributes: 0 };
        let outcome = Outcome::Raw { status: 0, data: Vec::new() };
        Ok(self.submit(instance, service, VecDeque::from([body]), outcome))
    }

    fn submit(
        &mut self,
        instance: u8,
        service: MotionService,
        bodies: VecDeque<Body>,
        outcome: Outcome,
    ) -> Ticket {
        self.next_ticket += 1;
        let ticket = Ticket(self.next_ticket);
        if bodies.is_empty() {
            self.done.push((ticket, Ok(outcome)));
        } else {
            self.jobs.push_back(Job { ticket, instance, service, bodies, outcome });
        }
        ticket
    }

    /// The result of a job, once it is there.
    pub fn take(&mut self, ticket: Ticket) -> Option<Result<Outcome, Failure>> {
        let at = self.done.iter().position(|(done, _)| *done == ticket)?;
        Some(self.done.swap_remove(at).1)
    }

    /// Drops what has not been asked yet and what is under way.
    pub fn clear(&mut self) {
        self.jobs.clear();
        self.under_way = None;
    }

    /// Begins the next request if none is under way, and gives up one that lasts too long.
    pub fn advance(&mut self, now: MonotonicTime) {
        match &self.under_way {
            Some(request) if now - request.since > self.time_out => {
                let waited = now - request.since;
                self.finish(|job| {
                    Err(Failure::ServiceTimeOut { instance: job.instance, service: job.service, waited })
                });
            }
            Some(_) => {}
            None => {
                if let Some(job) = self.jobs.front() {
                    let transaction = &mut self.transactions[usize::from(job.instance)];
                    *transaction = transaction.wrapping_add(1);
                    self.under_way = Some(UnderWay { since: now });
                }
            }
        }
    }

    fn finish(&mut self, result: impl FnOnce(&mut Job) -> Result<(), Failure>) {
        self.under_way = None;
        if let Some(mut job) = self.jobs.pop_front() {
            let result = result(&mut job);
            self.done.push((job.ticket, result.map(|()| job.outcome)));
        }
    }

    /// The request to put into the next update, and the instance it is for.
    pub fn request(&self) -> Option<(u8, ServiceRequest<'_>)> {
        self.under_way.as_ref()?;
        let job = self.jobs.front()?;
        let transaction_id = self.transactions[usize::from(job.instance)];
        let data = &job.bodies.front()?.bytes;
        Some((job.instance, ServiceRequest { transaction_id, service: job.service, data }))
    }

    /// Takes what came of the request with this transaction ID, made as an explicit message.
    pub fn handle_answer(
        &mut self,
        now: MonotonicTime,
        (instance, transaction_id): (u8, u8),
        answer: Result<Answer, Failure>,
    ) {
        match answer {
            Ok(answer) => {
                let response = ServiceResponse {
                    transaction_id,
                    service: MotionService(answer.service),
                    general_status: answer.status,
                    extended_status: 0,
                    data: &answer.data,
                };
                self.handle(now, instance, &response);
            }
            Err(failure) => {
                let asked = self.request().map(|(asked, request)| (asked, request.transaction_id));
                if asked == Some((instance, transaction_id)) {
                    self.finish(|_| Err(failure));
                    self.advance(now);
                }
            }
        }
    }

    /// Takes a response; one that answers nothing under way is a repetition and does not count.
    pub fn handle(&mut self, now: MonotonicTime, instance: u8, response: &ServiceResponse<'_>) {
        let Some((asked, request)) = self.request() else { return };
        if asked != instance
            || response.transaction_id != request.transaction_id
            || response.service != request.service
        {
            return;
        }
        let Some(job) = self.jobs.front_mut() else { return };
        let Some(body) = job.bodies.pop_front() else { return };
        self.under_way = None;
        let taken = job.take_response(&body, response);
        if taken.is_err() || job.bodies.is_empty() {
            self.finish(|_| taken);
        }
        self.advance(now);
    }
}

impl Job {
    // Flat: one arm per kind of service.
    fn take_response(&mut self, body: &Body, response: &ServiceResponse<'_>) -> Result<(), Failure> {
        let (instance, service) = (self.instance, self.service);
        let malformed = |error| Failure::ServiceMalformed { instance, service, error };
        let status = response.general_status;
        if let Outcome::Raw { status: told, data } = &mut self.outcome {
            *told = status;
            *data = response.data.to_vec();
            return Ok(());
        }
        if status != 0 && status != ATTRIBUTE_LIST_ERROR {
            return Err(Failure::ServiceRefused { instance, service, status });
        }
        match &mut self.outcome {
            Outcome::Set { refused } => {
                let list = SetResponse::new(response.data).map_err(malformed)?;
                same_count(body.attributes, list.left()).map_err(malformed)?;
                for item in list {
                    let item = item.map_err(malformed)?;
                    if item.status != 0 {
                        refused.push((item.id, item.status));
                    }
                }
            }
            Outcome::Get { values } => {
                let list = GetResponse::new(response.data).map_err(malformed)?;
                same_count(body.attributes, list.left()).map_err(malformed)?;
                for item in list {
                    values.push(match item.map_err(malformed)? {
                        GetItem::Value(selector, value) => {
                            AttributeValue { id: selector.id, value: Ok(value.to_vec()) }
                        }
                        GetItem::Error(id, status) => AttributeValue { id, value: Err(status) },
                    });
                }
            }
            Outcome::Sync(sync) => {
                if status != 0 {
                    return Err(Failure::ServiceRefused { instance, service, status });
                }
                let Some(code) = response.data.first() else {
                    let (needed, available) = (1, 0);
                    return Err(malformed(Error::truncated("sync status", 0, needed, available)));
                };
                *sync = SyncStatus(*code);
            }
            Outcome::List { block_id, refused } => {
                let list = IdStatusList::parse(response.data).map_err(malformed)?;
                let answered = u16::try_from(list.iter().count()).unwrap_or(u16::MAX);
                same_count(body.attributes, answered).map_err(malformed)?;
                *block_id = list.block_id;
                refused
                    .extend(list.iter().filter(|item| item.status != 0).map(|item| (item.id, item.status)));
            }
            Outcome::Raw { .. } => {}
        }
        Ok(())
    }
}

fn same_count(asked: u16, answered: u16) -> Result<(), Error> {
    if asked == answered {
        return Ok(());
    }
    let (found, expected) = (u32::from(answered), u32::from(asked));
    Err(Error::invalid("number of attributes", 0, expected, found))
}

/// What an attribute takes in a request and in its response.
struct Item {
    id: u16,
    needed: usize,
    answer: usize,
}

/// Fills bodies one after the other so that each request and each response keeps to its room.
fn split(
    instance: u8,
    items: &[Item],
    room: Room,
    write: impl Fn(usize, &mut ListWriter<'_>) -> Result<(), Error>,
) -> Result<VecDeque<Body>, Failure> {
    let mut bodies = VecDeque::new();
    let mut start = 0;
    while start < items.len() {
        let (mut request, mut response, mut end) = (HEAD_LEN, HEAD_LEN, start);
        while let Some(item) = items.get(end) {
            let (more, answer) = (request.saturating_add(item.needed), response.saturating_add(item.answer));
            if more > room.request || answer > room.response {
                break;
            }
            (request, response, end) = (more, answer, end + 1);
        }
        if end == start {
            let room = room.request.min(room.response);
            return Err(Failure::AttributeTooLong { instance, attribute: items[start].id, room });
        }
        let mut bytes = vec![0; request];
        let service = MotionService::SET_AXIS_ATTRIBUTES_LIST;
        let malformed = |error| Failure::ServiceMalformed { instance, service, error };
        let mut list = ListWriter::new(&mut bytes).map_err(malformed)?;
        for index in start..end {
            write(index, &mut list).map_err(malformed)?;
        }
        let written = list.finish();
        bytes.truncate(written);
        let attributes = u16::try_from(end - start).unwrap_or(u16::MAX);
        bodies.push_back(Body { bytes, attributes });
        start = end;
    }
    Ok(bodies)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::motion::attribute_list::SetStatus;

    const ROOM: Room = Room { request: 400, response: 400 };
    const NOW: MonotonicTime = MonotonicTime(0);

    fn services() -> Services {
        Services::new(DurationNs::from_secs(1))
    }

    /// Answers the request under way with `data` and these changes to the right head.
    fn answer(services: &mut Services, status: u8, data: &[u8], id_step: u8, instance_step: u8) {
        services.advance(NOW);
        let (instance, request) = services.request().unwrap();
        let response = ServiceResponse {
            transaction_id: request.transaction_id.wrapping_add(id_step),
            service: request.service,
            general_status: status,
            extended_status: 0,
            data,
        };
        services.handle(NOW, instance + instance_step, &response);
    }

    fn statuses(rows: &[(u16, u8)]) -> Vec<u8> {
        let mut body = vec![0; 4 + 4 * rows.len()];
        let mut list = ListWriter::new(&mut body).unwrap();
        for &(id, status) in rows {
            list.status(SetStatus { id, status, index: 0 }).unwrap();
        }
        let _ = list.finish();
        body
    }

    #[test]
    fn a_response_counts_only_for_its_request() {
        let mut s = services();
        let ticket = s.set(1, &[AttributeSet::usint(610, 1)], ROOM).unwrap();
        let good = statuses(&[(610, 0)]);
        answer(&mut s, 0, &good, 1, 0);
        answer(&mut s, 0, &good, 255, 0);
        answer(&mut s, 0, &good, 0, 1);
        assert_eq!(s.take(ticket), None);
        answer(&mut s, 0, &good, 0, 0);
        assert_eq!(s.take(ticket), Some(Ok(Outcome::Set { refused: vec![] })));
        assert_eq!(s.take(ticket), None);
        assert!(s.request().is_none());
    }

    #[test]
    fn transactions_count_per_instance() {
        let mut s = services();
        let mut ids = Vec::new();
        for instance in [1, 2, 1, 0, 2] {
            s.set(instance, &[AttributeSet::usint(610, 1)], ROOM).unwrap();
            s.advance(NOW);
            ids.push((instance, s.request().unwrap().1.transaction_id));
            answer(&mut s, 0, &statuses(&[(610, 0)]), 0, 0);
        }
        assert_eq!(ids, [(1, 1), (2, 1), (1, 2), (0, 1), (2, 2)]);
    }

    #[test]
    fn answers_that_do_not_fit_fail_the_job() {
        let fail = |status: u8, data: &[u8]| {
            let mut s = services();
            let sets = [AttributeSet::usint(610, 1), AttributeSet::usint(611, 1)];
            let ticket = s.set(3, &sets, ROOM).unwrap();
            answer(&mut s, status, data, 0, 0);
            s.take(ticket).unwrap().unwrap_err().to_string()
        };
        assert_eq!(
            fail(0x08, &[]),
            "axis 3: Set_Axis_Attributes_List refused with status 0x08 (service not supported)"
        );
        assert_eq!(
            fail(0, &statuses(&[(610, 0)])),
            "axis 3: answer to Set_Axis_Attributes_List: number of attributes at byte 0: \
             expected 0x2, found 0x1"
        );
        let cut = &statuses(&[(610, 0), (611, 0)])[..8];
        assert!(
            fail(0, cut).ends_with("attribute list at byte 8: expected 2 bytes, found 0"),
            "{}",
            fail(0, cut)
        );
        assert!(
            fail(0, &[]).starts_with("axis 3: answer to Set_Axis_Attributes_List: attribute list at byte 0")
        );
    }

    #[test]
    fn silence_fails_the_job_and_frees_the_channel() {
        let mut s = services();
        let first = s.group_sync([0; 8]);
        let second = s.group_sync([0; 8]);
        s.advance(NOW);
        s.advance(MonotonicTime(1_000_000_001));
        let expected = "the class: Group_Sync not answered within 1.000000001 s";
        assert_eq!(s.take(first).unwrap().unwrap_err().to_string(), expected);
        s.advance(MonotonicTime(1_000_000_002));
        assert_eq!(s.request().unwrap().1.transaction_id, 2);
        answer(&mut s, 0, &[3, 0, 0, 0], 0, 0);
        assert_eq!(s.take(second), Some(Ok(Outcome::Sync(SyncStatus::CLOCK_SKEW))));
    }

    #[test]
    fn lists_are_split_by_request_and_by_response() {
        let mut s = services();
        let sets: Vec<_> = (1..=10).map(|id| AttributeSet::udint(id, 0)).collect();
        // Head 4, attribute head and value 8: three to a request.
        s.set(1, &sets, Room { request: 31, response: 400 }).unwrap();
        let counts: Vec<_> = s.jobs[0].bodies.iter().map(|b| (b.attributes, b.bytes.len())).collect();
        assert_eq!(counts, [(3, 28), (3, 28), (3, 28), (1, 12)]);
        // Reading, the response is what is long: head 4, attribute head and value 8.
        let selectors: Vec<_> = (1..=4).map(|id| AttributeSelector::scalar(id, 4)).collect();
        s.get(1, &selectors, Room { request: 400, response: 20 }).unwrap();
        assert_eq!(s.jobs[1].bodies.iter().map(|b| b.attributes).collect::<Vec<_>>(), [2, 2]);
        let long = [AttributeSet::bytes(7, &[0; 200])];
        let error = s.set(2, &long, Room { request: 100, response: 100 }).unwrap_err();
        assert_eq!(
            error.to_string(),
            "axis 2: attribute 7 does not fit the 100 bytes that the connection leaves"
        );
        let nothing = s.set(1, &[], ROOM).unwrap();
        assert_eq!(s.take(nothing), Some(Ok(Outcome::Set { refused: vec![] })));
    }
}
