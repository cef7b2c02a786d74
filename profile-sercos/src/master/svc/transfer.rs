//! One request as a sequence of service channel steps.
//!
//! ```text
//! Status         open
//! Read, Write    open, [attribute], element in parts of four bytes; lists: open, [attribute], head, items
//! Length         open, head, close
//! Execute        open, write 0, open, write 3, open until the data status is not "in process"
//! Cancel         open, write 0, open
//! Command        as Execute, write 0, open
//! ```
//!
//! The attribute is read where the request does not know the shape of the element. Opening a data block again
//! closes the one before, so only a transfer that stops in the middle of an element ends with a close step.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::request::{Shape, SvcData, SvcFailure, SvcOperation, SvcReply, SvcRequest};
use crate::wire::attribute::Attribute;
use crate::wire::data_status::{CommandState, DataStatus};
use crate::wire::idn::Idn;
use crate::wire::procedure::ProcedureControl;
use crate::wire::svc::{Element, ListHead};
use crate::wire::svc_error::SvcError;

/// Bytes which one step can carry.
const STEP_LEN: usize = 4;

/// One step as the master puts it on the wire, but for the handshake bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Step {
    pub element: Element,
    pub write: bool,
    pub last: bool,
    pub info: u32,
}

/// Where the transfer is: the step that is on the wire now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Open,
    Attribute,
    /// A part of an element of fixed length, `done` bytes behind its start.
    Fixed,
    Head,
    /// A part of a list's items, `done` bytes behind their start.
    Items,
    Close,
    ClearOpen,
    Clear,
    StartOpen,
    Start,
    Poll,
    Cancel,
    Verify,
}

/// Whether the transfer goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flow {
    /// [`Transfer::step`] reports the next step.
    Next,
    /// The procedure command is still in process: the next step asks again, at any time.
    InProcess,
    /// This came out.
    Finished(Result<SvcReply, SvcFailure>),
}

/// The state of one request.
#[derive(Debug)]
pub(super) struct Transfer {
    idn: Idn,
    operation: SvcOperation,
    shape: Option<Shape>,
    stage: Stage,
    done: usize,
    reply: SvcReply,
    deadline: MonotonicTime,
    /// What to report once the data block is closed or the command cancelled.
    failure: Option<SvcFailure>,
}

impl Transfer {
    /// Starts a request. Data of read requests is discarded.
    pub fn new(request: &mut SvcRequest) -> Transfer {
        let stage = match request.operation {
            SvcOperation::Execute | SvcOperation::Cancel | SvcOperation::Command => Stage::ClearOpen,
            _ => Stage::Open,
        };
        if !matches!(request.operation, SvcOperation::Write(_)) {
            request.data.clear();
        }
        Transfer {
            idn: request.idn,
            operation: request.operation,
            shape: request.shape,
            stage,
            done: 0,
            reply: SvcReply::default(),
            deadline: MonotonicTime::MAX,
            failure: None,
        }
    }

    /// The data block.
    pub fn idn(&self) -> Idn {
        self.idn
    }

    /// The data status which the slave gave last.
    #[cfg(test)]
    pub fn status(&self) -> DataStatus {
        self.reply.status
    }

    /// The step for the wire.
    pub fn step(&self, data: &SvcData) -> Step {
        let element = self.element();
        let write = matches!(self.operation, SvcOperation::Write(_));
        let step = |element, write, last, info| Step { element, write, last, info };
        let control = |control: ProcedureControl| step(Element::Data, true, true, u32::from(control.bits()));
        match self.stage {
            Stage::Open | Stage::ClearOpen | Stage::StartOpen | Stage::Poll | Stage::Verify => {
                step(Element::Idn, true, true, self.idn.0)
            }
            Stage::Attribute => step(Element::Attribute, false, true, 0),
            Stage::Close => step(Element::Close, true, true, 0),
            Stage::Clear | Stage::Cancel => control(ProcedureControl::CANCEL),
            Stage::Start => control(ProcedureControl::EXECUTE),
            Stage::Head if write => {
                let current = u16::try_from(data.as_slice().len()).unwrap_or(u16::MAX);
                step(element, true, current == 0, ListHead { current, max: current }.to_info())
            }
            Stage::Head => step(element, false, false, 0),
            Stage::Fixed | Stage::Items => {
                let rest = self.total(data).saturating_sub(self.done);
                let info = if write { part(data.as_slice(), self.done) } else { 0 };
                step(element, write, rest <= STEP_LEN, info)
            }
        }
    }

    /// Takes the slave's answer to the step on the wire.
    // Flat: one arm per stage.
    pub fn advance(
        &mut self,
        now: MonotonicTime,
        command_timeout: DurationNs,
        answer: Result<u32, SvcError>,
        data: &mut SvcData,
    ) -> Flow {
        let info = match answer {
            Ok(info) => info,
            // The reason to close or cancel was met before: it is the one to report.
            Err(code) => {
                let refused = SvcFailure::Refused { element: self.step(data).element, code };
                return Flow::Finished(Err(self.failure.unwrap_or(refused)));
            }
        };
        match self.stage {
            Stage::Open => {
                self.reply.status = status(info);
                if self.operation == SvcOperation::Status { self.finish() } else { self.access(data) }
            }
            Stage::Attribute => {
                let attribute = Attribute(info);
                self.reply.attribute = Some(attribute);
                let list = attribute.is_list() && self.element() == Element::Data;
                let fixed = Shape::Fixed(attribute.item_length().bytes());
                self.shape = Some(if list { Shape::List } else { fixed });
                self.access(data)
            }
            Stage::Fixed | Stage::Items => {
                let rest = self.total(data).saturating_sub(self.done);
                let len = rest.min(STEP_LEN);
                if matches!(self.operation, SvcOperation::Read(_)) {
                    data.append(&info.to_le_bytes()[..len]);
                }
                self.done += len;
                if rest <= STEP_LEN { self.finish() } else { Flow::Next }
            }
            Stage::Head => self.after_head(info, data),
            Stage::Close => self.finish(),
            Stage::ClearOpen => {
                self.reply.status = status(info);
                let cancel = self.operation == SvcOperation::Cancel;
                self.go(if cancel { Stage::Cancel } else { Stage::Clear })
            }
            Stage::Clear => self.go(Stage::StartOpen),
            Stage::StartOpen => self.go(Stage::Start),
            Stage::Start => {
                self.deadline = now + command_timeout;
                self.go(Stage::Poll)
            }
            Stage::Poll => self.after_poll(now, status(info)),
            Stage::Cancel => self.go(Stage::Verify),
            Stage::Verify => {
                if self.operation == SvcOperation::Cancel {
                    self.reply.status = status(info);
                }
                self.finish()
            }
        }
    }

    fn go(&mut self, stage: Stage) -> Flow {
        self.stage = stage;
        Flow::Next
    }

    fn finish(&self) -> Flow {
        Flow::Finished(match self.failure {
            Some(failure) => Err(failure),
            None => Ok(self.reply),
        })
    }

    fn element(&self) -> Element {
        match self.operation {
            SvcOperation::Read(element) | SvcOperation::Write(element) | SvcOperation::Length(element) => {
                element
            }
            _ => Element::Data,
        }
    }

    /// Bytes of the whole element, a list's head not counted.
    fn total(&self, data: &SvcData) -> usize {
        match (self.stage, self.operation) {
            (_, SvcOperation::Write(_)) => data.as_slice().len(),
            (Stage::Items, _) => usize::from(self.reply.head.unwrap_or_default().current),
            _ => match self.shape {
                Some(Shape::Fixed(len)) => usize::from(len),
                _ => STEP_LEN,
            },
        }
    }

    /// The data block is open: to the element, by way of the attribute where the shape is not known.
    fn access(&mut self, data: &SvcData) -> Flow {
        let shape = match self.element() {
            Element::Close | Element::Idn => return self.finish(),
            Element::Name | Element::Unit => Shape::List,
            Element::Attribute => Shape::Fixed(4),
            Element::Minimum | Element::Maximum | Element::Data => match self.shape {
                Some(shape) => shape,
                None => return self.go(Stage::Attribute),
            },
        };
        self.shape = Some(shape);
        let write = matches!(self.operation, SvcOperation::Write(_));
        let given = data.as_slice().len();
        match (shape, self.operation) {
            (Shape::Fixed(len), _) if write && given != usize::from(len) => {
                let expected = usize::from(len);
                Flow::Finished(Err(SvcFailure::Length { expected, given }))
            }
            (Shape::List, _) if write && given > usize::from(u16::MAX) => {
                let expected = usize::from(u16::MAX);
                Flow::Finished(Err(SvcFailure::Length { expected, given }))
            }
            // A scalar has no head; its length is the answer.
            (Shape::Fixed(len), SvcOperation::Length(_)) => {
                self.reply.head = Some(ListHead { current: u16::from(len), max: u16::from(len) });
                self.finish()
            }
            (Shape::Fixed(_), _) => self.go(Stage::Fixed),
            (Shape::List, _) => self.go(Stage::Head),
        }
    }

    fn after_head(&mut self, info: u32, data: &SvcData) -> Flow {
        if matches!(self.operation, SvcOperation::Write(_)) {
            return if data.as_slice().is_empty() { self.finish() } else { self.go(Stage::Items) };
        }
        let head = ListHead::from_info(info);
        self.reply.head = Some(head);
        let capacity = data.capacity();
        if matches!(self.operation, SvcOperation::Length(_)) || head.current == 0 {
            return self.go(Stage::Close);
        }
        if usize::from(head.current) > capacity {
            self.failure = Some(SvcFailure::TooLong { length: head.current, capacity });
            return self.go(Stage::Close);
        }
        self.go(Stage::Items)
    }

    fn after_poll(&mut self, now: MonotonicTime, status: DataStatus) -> Flow {
        self.reply.status = status;
        self.failure = match status.command_state() {
            CommandState::Done => None,
            CommandState::Failed | CommandState::Interrupted => Some(SvcFailure::CommandFailed(status)),
            _ if now >= self.deadline => Some(SvcFailure::CommandTimeout(status)),
            _ => return Flow::InProcess,
        };
        if self.operation == SvcOperation::Command { self.go(Stage::Cancel) } else { self.finish() }
    }
}

fn status(info: u32) -> DataStatus {
    let bytes = info.to_le_bytes();
    DataStatus::from_bits_retain(u16::from_le_bytes([bytes[0], bytes[1]]))
}

/// Up to four bytes from `offset` on, filled up with zeros.
fn part(bytes: &[u8], offset: usize) -> u32 {
    let rest = bytes.get(offset..).unwrap_or_default();
    let mut info = [0; STEP_LEN];
    for (to, from) in info.iter_mut().zip(rest) {
        *to = *from;
    }
    u32::from_le_bytes(info)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::svc::SvcControl;

    const TIMEOUT: DurationNs = DurationNs::from_secs(1);

    /// Runs a request against scripted answers; the steps as text, and what came out.
    fn run(
        mut request: SvcRequest,
        answers: &[Result<u32, u16>],
    ) -> (Vec<String>, Option<Result<SvcReply, SvcFailure>>, SvcData) {
        let mut transfer = Transfer::new(&mut request);
        let mut steps = Vec::new();
        for (index, answer) in answers.iter().enumerate() {
            let step = transfer.step(&request.data);
            let word = SvcControl::new(false, step.element, step.write, step.last);
            steps.push(format!("{:04x} {:08x}", word.0, step.info));
            let now = MonotonicTime(u64::try_from(index).unwrap() * 300_000_000);
            match transfer.advance(now, TIMEOUT, answer.map_err(SvcError), &mut request.data) {
                Flow::Next | Flow::InProcess => {}
                Flow::Finished(result) => {
                    assert_eq!(index + 1, answers.len(), "answers left over");
                    return (steps, Some(result), request.data);
                }
            }
        }
        (steps, None, request.data)
    }

    #[test]
    fn list_read_as_recorded() {
        // Startup recording, frames 2281 to 2353: S-0-1000 read with its head, six bytes.
        let request = SvcRequest::read(Idn::SCP_CLASSES).with_shape(Shape::List);
        let (steps, result, data) = run(request, &[Ok(0), Ok(0x0040_0006), Ok(0x0301_0201), Ok(0x0000_0A01)]);
        assert_eq!(steps, ["000e 000003e8", "0038 00000000", "0038 00000000", "003c 00000000"]);
        let reply = result.unwrap().unwrap();
        assert_eq!(reply.head, Some(ListHead { current: 6, max: 64 }));
        assert_eq!(data.words().collect::<Vec<_>>(), [0x0201, 0x0301, 0x0A01]);
    }

    #[test]
    fn list_length_as_recorded() {
        // Startup recording, frames 2569 to 2617: S-0-1051, head only, then close.
        let request = SvcRequest::new(Idn::CONNECTION_IMAGE, SvcOperation::Length(Element::Data))
            .with_shape(Shape::List);
        let (steps, result, _) = run(request, &[Ok(0), Ok(0x0040_0004), Ok(0)]);
        assert_eq!(steps, ["000e 0000041b", "0038 00000000", "0006 00000000"]);
        assert_eq!(result.unwrap().unwrap().head, Some(ListHead { current: 4, max: 64 }));
    }

    #[test]
    fn list_write_as_recorded() {
        // Startup recording, frames 4369 to 4425: S-0-1017 with t6 and t7.
        let bytes = [0xF8, 0xF2, 0, 0, 0xE4, 0x28, 0x98, 0];
        let request =
            SvcRequest::write(Idn::UC_TIMES, SvcData::inline(&bytes).unwrap()).with_shape(Shape::List);
        let (steps, result, _) = run(request, &[Ok(0), Ok(0), Ok(0), Ok(0)]);
        assert_eq!(steps, ["000e 000003f9", "003a 00080008", "003a 0000f2f8", "003e 009828e4"]);
        assert_eq!(result, Some(Ok(SvcReply::default())));
    }

    #[test]
    fn unknown_shape_reads_the_attribute_as_recorded() {
        // Startup recording, frames 1401 to 1455: S-0-1302.0.1 is two bytes, value 2.
        let (steps, result, data) = run(SvcRequest::read(Idn::FSP_TYPE), &[Ok(0), Ok(0x0001_0001), Ok(2)]);
        assert_eq!(steps, ["000e 00010516", "001c 00000000", "003c 00000000"]);
        assert_eq!(result.unwrap().unwrap().attribute, Some(Attribute(0x0001_0001)));
        assert_eq!(data.unsigned(), Some(2));
        assert_eq!(data.as_slice().len(), 2);
    }

    #[test]
    fn command_as_recorded() {
        // Startup recording, frames 4769 to 4943: S-0-0127. The reference opens once more before it cancels.
        let answers = [Ok(0), Ok(0), Ok(0), Ok(0), Ok(7), Ok(3), Ok(0), Ok(0)];
        let (steps, result, _) = run(SvcRequest::command(Idn::CP3_CHECK), &answers);
        let open = "000e 0000007f";
        let (clear, start) = ("003e 00000000", "003e 00000003");
        assert_eq!(steps, [open, clear, open, start, open, open, clear, open]);
        assert_eq!(result.unwrap().unwrap().status.command_state(), CommandState::Done);
    }

    #[test]
    fn failed_and_late_commands_are_cancelled() {
        let answers = [Ok(0), Ok(0), Ok(0), Ok(0), Ok(0xF), Ok(0), Ok(0)];
        let (steps, result, _) = run(SvcRequest::command(Idn::CP3_CHECK), &answers);
        assert_eq!(steps[5..], ["003e 00000000", "000e 0000007f"]);
        assert_eq!(result, Some(Err(SvcFailure::CommandFailed(DataStatus::from_bits_retain(0xF)))));
        // Steps are 300 ms apart and the command may take 1 s from its start.
        let answers = [Ok(0), Ok(0), Ok(0), Ok(0), Ok(7), Ok(7), Ok(7), Ok(7), Ok(0), Ok(0)];
        let (_, result, _) = run(SvcRequest::command(Idn::CP3_CHECK), &answers);
        assert_eq!(result, Some(Err(SvcFailure::CommandTimeout(DataStatus::from_bits_retain(7)))));
        // Execute leaves the command set.
        let execute = SvcRequest::new(Idn::CP3_CHECK, SvcOperation::Execute);
        let (steps, result, _) = run(execute, &[Ok(0), Ok(0), Ok(0), Ok(0), Ok(3)]);
        assert_eq!((steps.len(), result.unwrap().is_ok()), (5, true));
    }

    #[test]
    fn eight_bytes_take_two_steps() {
        let (steps, result, data) =
            run(SvcRequest::read(Idn(1)).with_shape(Shape::Fixed(8)), &[Ok(0), Ok(0x0403_0201), Ok(5)]);
        assert_eq!(steps[1..], ["0038 00000000", "003c 00000000"]);
        assert!(result.unwrap().is_ok());
        assert_eq!(data.unsigned(), Some(0x0000_0005_0403_0201));
        let data = SvcData::inline(&[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
        let (steps, _, _) =
            run(SvcRequest::write(Idn(1), data).with_shape(Shape::Fixed(8)), &[Ok(0), Ok(0), Ok(0)]);
        assert_eq!(steps[1..], ["003a 04030201", "003e 08070605"]);
    }

    #[test]
    fn what_does_not_fit_is_said() {
        let read = SvcRequest::read(Idn::SCP_CLASSES).with_shape(Shape::List);
        let (steps, result, data) = run(read, &[Ok(0), Ok(0x00FF_00FF), Ok(0)]);
        assert_eq!(steps[2], "0006 00000000");
        assert_eq!(result, Some(Err(SvcFailure::TooLong { length: 255, capacity: 64 })));
        assert!(data.as_slice().is_empty());
        let write = SvcRequest::write(Idn::CYCLE_TIME, SvcData::inline(&[1, 2]).unwrap());
        let (_, result, _) = run(write, &[Ok(0), Ok(0x0022_0001)]);
        assert_eq!(result, Some(Err(SvcFailure::Length { expected: 4, given: 2 })));
    }

    #[test]
    fn refusal_names_the_element() {
        let (_, result, _) = run(SvcRequest::read(Idn(5)), &[Err(0x1001)]);
        let refused = |element, code| Some(Err(SvcFailure::Refused { element, code: SvcError(code) }));
        assert_eq!(result, refused(Element::Idn, 0x1001));
        let write = SvcRequest::write(Idn(5), SvcData::inline(&[0; 4]).unwrap()).with_shape(Shape::Fixed(4));
        let (_, result, _) = run(write, &[Ok(0), Err(0x7004)]);
        assert_eq!(result, refused(Element::Data, 0x7004));
        // A refused close does not hide why the transfer was closed.
        let read = SvcRequest::read(Idn::SCP_CLASSES).with_shape(Shape::List);
        let (_, result, _) = run(read, &[Ok(0), Ok(0x00FF_00FF), Err(0x0009)]);
        assert_eq!(result, Some(Err(SvcFailure::TooLong { length: 255, capacity: 64 })));
    }

    #[test]
    fn empty_lists() {
        let (steps, result, _) =
            run(SvcRequest::read(Idn(5)).with_shape(Shape::List), &[Ok(0), Ok(0x0040_0000), Ok(0)]);
        assert_eq!((steps.len(), result.unwrap().is_ok()), (3, true));
        let write = SvcRequest::write(Idn(5), SvcData::default()).with_shape(Shape::List);
        let (steps, result, _) = run(write, &[Ok(0), Ok(0)]);
        assert_eq!(steps, ["000e 00000005", "003e 00000000"]);
        assert!(result.unwrap().is_ok());
    }
}
