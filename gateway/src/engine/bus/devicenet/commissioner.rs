//! The start-up lists of the drives of a network. They allocate, and a drive can come while others move: they are gone through
//! alongside the cycle thread, one request to a drive at a time.

use profile_cip::devicenet::master::event::{ExplicitRequest, Outcome};

use super::super::commissioner::{CommissionerHandle, Done, Run, Work};
use super::direct::DirectAccess;
use crate::engine::bus::startup::{StartupAccess, StartupRun, When};
use crate::engine::direct::DirectFailure;
use crate::engine::notice::{Notice, axis_number};
use crate::parameter::id::Id;
use crate::parameter::startup::StartupEntry;

/// Messages under way in each direction: one or two of each of the 63 drives.
const QUEUE: usize = 128;

/// The list of one drive, on the way.
#[derive(Debug)]
pub struct ListWork {
    axis: u8,
    list: StartupRun,
    run: Run,
    /// What the drive was asked, and the most bytes of the answer.
    asked: Option<(DirectAccess, usize)>,
}

/// What the work on a drive has around it.
type Context = super::super::commissioner::Context<ListWork>;

/// Goes through the lists of a network.
pub type Commissioner = super::super::commissioner::Commissioner<ListWork>;

/// A commissioner for the drives of a network, each with the number of its axis and its list, and the cycle thread's end.
#[must_use]
pub fn commissioner<'l>(
    drives: impl IntoIterator<Item = (usize, &'l [StartupEntry])>,
) -> (Commissioner, CommissionerHandle<ListWork>) {
    let work = |(axis, list)| ListWork {
        axis: axis_number(axis),
        list: StartupRun::new(list),
        run: Run::default(),
        asked: None,
    };
    Commissioner::with_queue(QUEUE, (), drives.into_iter().map(work).collect())
}

impl Work for ListWork {
    /// To begin with the list.
    type Order = ();
    type Request = ExplicitRequest;
    type Outcome = Outcome;
    /// The list is through.
    type Made = ();
    type Shared = ();

    fn run(&self) -> Run {
        self.run
    }

    fn order(&mut self, run: Run, (): (), context: &mut Context) {
        self.run = run;
        self.list.restart();
        self.list.begin(When::Once);
        self.advance(context);
    }

    fn handle(&mut self, outcome: &Outcome, context: &mut Context) {
        let Some((access, room)) = self.asked.take() else { return };
        let mut data = Vec::with_capacity(room);
        let result = access.result(outcome, &mut data);
        self.list.take(result.map(|()| (None, data.as_slice())));
        self.advance(context);
    }

    fn give_up(&mut self) {
        self.list.give_up();
        self.asked = None;
    }
}

impl ListWork {
    /// Asks what is next.
    fn advance(&mut self, context: &mut Context) {
        let request = loop {
            let Some(access) = self.list.next() else { break None };
            match request(access) {
                Some((access, room, request)) => {
                    self.asked = Some((access, room));
                    break Some(request);
                }
                // No message carries it.
                None => self.list.take(Err(DirectFailure::Unsent)),
            }
        };
        let axis = self.axis;
        for report in self.list.take_reports() {
            context.out.push_back(Done::Told(Notice::Startup { axis, report }));
        }
        context.out.push_back(match (self.list.take_failure(), request) {
            (Some(failure), _) => Done::Failed(self.run, Notice::StartupFailed { axis, failure }),
            (None, Some(request)) => Done::Submit(self.run, request),
            (None, None) => Done::Made(self.run, ()),
        });
    }
}

/// The request of an access, with the most bytes of its answer; `None` for what no drive on DeviceNet has or no message carries.
fn request(access: StartupAccess) -> Option<(DirectAccess, usize, ExplicitRequest)> {
    let (id, write, room, data) = match access {
        StartupAccess::Read(id, room) => (id, false, room, Vec::new()),
        StartupAccess::Write(id, _, bytes) => (id, true, 0, bytes),
    };
    let Id::Path { class, instance, attribute } = id else { return None };
    let access = DirectAccess { class, instance, attribute, write };
    Some((access, room, access.request(&data)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::Cia402Type;
    use crate::parameter::startup::{OnDifference, StartupValue};

    fn entry(id: &str, value: &str, data_type: Cia402Type) -> StartupEntry {
        StartupEntry {
            id: Id::parse(id).unwrap(),
            value: StartupValue::Text(value.to_owned()),
            data_type: Some(data_type),
            on_difference: OnDifference::Write,
            from_file: false,
        }
    }

    fn done(bytes: &[u8]) -> Outcome {
        Outcome::Done(bytes.iter().copied().collect())
    }

    /// The messages of a list to these answers, as text.
    fn messages(list: &[StartupEntry], answers: &[Outcome]) -> Vec<String> {
        let (mut commissioner, mut handle) = commissioner([(3, list)]);
        let run = Run::new(0, 1);
        assert!(handle.push(super::super::super::commissioner::Job::Order(run, ())));
        let mut all = Vec::new();
        let mut answers = answers.iter();
        loop {
            commissioner.poll();
            let mut told = Vec::new();
            let next = handle.pop(&mut |notice| told.push(notice.to_string()));
            all.append(&mut told);
            let Some((run, done)) = next else { return all };
            let submitted = matches!(done, Done::Submit(..));
            all.push(match done {
                Done::Submit(_, request) => format!("{} {:02x?}", request.service, &request.data[..]),
                Done::Made(..) => "through".to_owned(),
                Done::Failed(_, notice) => format!("failed: {notice}"),
                Done::Told(_) => String::new(),
            });
            if submitted {
                let Some(answer) = answers.next() else { return all };
                let job = super::super::super::commissioner::Job::Outcome(run, answer.clone());
                assert!(handle.push(job));
            }
        }
    }

    #[test]
    fn what_differs_is_written_read_back_and_looked_at_once_more() {
        let list = [entry("0x2A.1.22", "3", Cia402Type::I8)];
        let answers = [done(&[1]), done(&[]), done(&[3]), done(&[3])];
        let all = messages(&list, &answers);
        let shown: Vec<&str> = all.iter().map(String::as_str).collect();
        assert_eq!(shown.len(), 7, "{shown:?}");
        assert!(shown[1].ends_with("[16, 03]"), "attribute 22, the value: {shown:?}");
        assert_eq!(
            [shown[3], shown[5], shown[6]],
            [
                "start-up list: 42.1.22 was 1 and is set to 3",
                "start-up list: 1 entry holds, 1 of them written",
                "through"
            ],
            "{shown:?}"
        );
    }

    #[test]
    fn what_the_drive_refuses_ends_the_list_with_its_status() {
        let list = [entry("0x2A.1.22", "3", Cia402Type::I8)];
        let refused = Outcome::Refused {
            status: profile_cip::wire::status::GeneralStatus::ATTRIBUTE_NOT_SETTABLE,
            additional: 0xFF,
        };
        let all = messages(&list, &[done(&[1]), refused]);
        let last = all.last().unwrap();
        assert!(
            last.contains("writing 42.1.22 = 3 (it is 1): the drive refuses it with status 0x0e"),
            "{last}"
        );
    }

    #[test]
    fn a_value_that_no_message_carries_is_named() {
        let long = format!("hex:{}", "00".repeat(300));
        let list = [StartupEntry {
            data_type: None,
            value: StartupValue::Text(long),
            ..entry("0x42.1.504", "", Cia402Type::F32)
        }];
        let all = messages(&list, &[done(&[1, 0, 0xF8, 1, 0, 0, 7, 8])]);
        let last = all.last().unwrap();
        assert!(
            last.starts_with("failed: ") && last.contains("the access cannot be sent to the drive"),
            "{last}"
        );
    }
}
