//! What a request for a procedure command takes: accesses one after the other, and the reply.
//!
//! | request | accesses to a SERCOS drive |
//! |---|---|
//! | start | attribute, name, data status; a command that was left set is cancelled; set and start; data status |
//! | progress | data status |
//! | cancel | attribute, cancel, data status |
//!
//! Of a command that failed, the diagnostic number and message of the drive are read too. A CANopen device answers the one write
//! of a signature when it is done with it.

use profile_sercos::wire::attribute::Attribute;
use profile_sercos::wire::data_status::{CommandState, DataStatus};
use profile_sercos::wire::idn::Idn;
use profile_sercos::wire::procedure::ProcedureControl;
use profile_sercos::wire::svc::Element;
use serde::{Deserialize, Serialize};

use super::job::{Act, Ask, Context, RECOMMISSION, Step, error, is_over, room};
use super::parameter::{ELEMENT_MAX, TEXT};
use crate::engine::direct::{DirectAnswer, DirectFailure, Direction, Target};
use crate::local::protocol::printable;
use crate::mapping::Object;
use crate::parameter::command::{belongs_to_gateway, recommissions, signature};
use crate::parameter::id::Id;
use crate::parameter::known::Bus;
use crate::parameter::value::Kind;

/// Length of a signature, which is longer than the word that starts a procedure command.
const SIGNATURE_LEN: usize = 4;

/// How far a procedure command is, as its drive has answered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Not set, or cancelled.
    #[default]
    NotSet,
    /// Set, and not started.
    Set,
    /// The drive executes it.
    InProcess,
    /// It was interrupted.
    Interrupted,
    /// Executed without error.
    Done,
    /// Ended with an error.
    Failed,
    /// A data status without meaning.
    Undefined,
}

impl State {
    /// Whether the command has not ended yet.
    #[must_use]
    pub const fn is_open(self) -> bool {
        matches!(self, Self::Set | Self::InProcess)
    }

    /// For people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotSet => "not set",
            Self::Set => "set, not started",
            Self::InProcess => "in process",
            Self::Interrupted => "interrupted",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Undefined => "undefined",
        }
    }
}

impl From<CommandState> for State {
    fn from(state: CommandState) -> Self {
        match state {
            CommandState::Idle => Self::NotSet,
            CommandState::Set => Self::Set,
            CommandState::InProcess => Self::InProcess,
            CommandState::Interrupted => Self::Interrupted,
            CommandState::Done => Self::Done,
            CommandState::Failed => Self::Failed,
            CommandState::Undefined(_) => Self::Undefined,
        }
    }
}

/// A procedure command as its drive has it: the object in replies.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CommandReport {
    /// Its number.
    pub id: String,
    /// Its name, from the drive if that has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// How far it is.
    pub state: State,
    /// The data status of a SERCOS drive, `0x0007`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<String>,
    /// Diagnostic number of the drive (S-0-0390), when the command failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diagnostic: Option<String>,
    /// Its diagnostic message (S-0-0095).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Whether the drive has to be commissioned again before the axis can be enabled.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub recommission: bool,
}

/// What the drive was asked last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    Attribute,
    Name,
    /// The data status before the start.
    Before,
    /// To cancel what an earlier start has left.
    Clear,
    Start,
    Cancel,
    Status,
    Number,
    Message,
    /// To take the signature.
    Signature,
}

/// A request for a procedure command on its way through its accesses.
#[derive(Debug)]
pub struct CommandJob {
    id: Id,
    act: Act,
    asked: Asked,
    report: CommandReport,
}

impl CommandJob {
    /// Begins with a request: the job and its first access.
    ///
    /// # Errors
    /// The reply, if the drive need not be asked.
    pub fn begin(id: Id, act: Act, context: &Context<'_>) -> Result<(Self, Step), String> {
        let report = CommandReport { id: id.to_string(), ..CommandReport::default() };
        let mut job = Self { id, act, asked: Asked::Attribute, report };
        let fail = |code, text: &str| Err(error(&Ask::Command { id, act }, context, code, text));
        if let Some(why) = belongs_to_gateway(id) {
            return fail("gateway", &format!("{id} is not executed: {why}"));
        }
        let step = match (id, act) {
            (Id::Idn(idn), Act::Progress) => job.status(idn, Asked::Status),
            (Id::Idn(idn), _) => job.element(idn, Element::Attribute, Asked::Attribute),
            (Id::Object(object), Act::Start) => match signature(object) {
                Some(signature) => job.write_signature(object, signature, context),
                None => {
                    return fail(
                        "not-command",
                        &format!(
                            "{id} is no command: expected 1010:01 (store parameters) or 1011:01 (restore defaults), or another \
                             sub-index of them from 1 to 127"
                        ),
                    );
                }
            },
            (Id::Object(_), Act::Progress | Act::Cancel) => {
                return fail("not-command", &format!("{id} ends with its answer: it cannot be cancelled"));
            }
            (Id::Path { .. }, _) => {
                return fail("not-command", "drives on DeviceNet have no procedure commands");
            }
        };
        Ok((job, step))
    }

    /// Takes the answer of the drive.
    pub fn take(&mut self, answer: DirectAnswer, context: &Context<'_>) -> Step {
        let DirectAnswer { result, data, .. } = answer;
        let Id::Idn(idn) = self.id else { return self.executed(result.err(), context) };
        let data = match result {
            Ok(_) => data,
            // A drive need not have these.
            Err(failure) if self.is_extra() && !is_over(&failure) => Vec::new(),
            Err(failure) => return self.failed(&failure, context),
        };
        match self.asked {
            Asked::Attribute => {
                let attribute =
                    data.try_into().map_or(Attribute(0), |word| Attribute(u32::from_le_bytes(word)));
                match self.act {
                    _ if !attribute.is_command() => {
                        let text =
                            format!("{idn} is no procedure command: it is a parameter, which is written");
                        self.fail("not-command", &text, context)
                    }
                    Act::Cancel => self.control(idn, ProcedureControl::CANCEL, Asked::Cancel),
                    Act::Start | Act::Progress => self.element(idn, Element::Name, Asked::Name),
                }
            }
            Asked::Name => {
                let of_tables = || context.catalogue.idn_name(idn).map(str::to_owned);
                self.report.name = text(&data).or_else(of_tables);
                self.status(idn, Asked::Before)
            }
            Asked::Before => match State::from(status(&data).command_state()) {
                State::InProcess => {
                    let text = format!("{idn} is in process already: cancel it, or wait for its end");
                    self.fail("in-process", &text, context)
                }
                State::NotSet => self.start(idn),
                _ => self.control(idn, ProcedureControl::CANCEL, Asked::Clear),
            },
            Asked::Clear => self.start(idn),
            Asked::Start | Asked::Cancel => self.status(idn, Asked::Status),
            Asked::Status => {
                let status = status(&data);
                self.report.state = status.command_state().into();
                self.report.status = Some(format!("{:#06x}", status.bits()));
                self.report.recommission = self.act == Act::Start && recommissions(self.id);
                match self.report.state {
                    State::Failed => self.element(Idn::DIAGNOSTIC_NUMBER, Element::Data, Asked::Number),
                    _ => self.reply(context),
                }
            }
            Asked::Number => {
                let digits: String = data.iter().rev().map(|byte| format!("{byte:02x}")).collect();
                self.report.diagnostic =
                    Some(digits).filter(|digits| !digits.is_empty()).map(|digits| format!("0x{digits}"));
                self.element(Idn::DIAGNOSTIC_MESSAGE, Element::Data, Asked::Message)
            }
            Asked::Message => {
                self.report.message = text(&data);
                self.reply(context)
            }
            // Of a CANopen device only.
            Asked::Signature => self.reply(context),
        }
    }

    /// Whether the drive need not have what it was asked for.
    const fn is_extra(&self) -> bool {
        matches!(self.asked, Asked::Name | Asked::Number | Asked::Message)
    }

    fn element(&mut self, idn: Idn, element: Element, asked: Asked) -> Step {
        self.asked = asked;
        Step::Access(Target::Element(idn, element), Direction::Read, room(ELEMENT_MAX))
    }

    fn status(&mut self, idn: Idn, asked: Asked) -> Step {
        self.asked = asked;
        Step::Access(Target::Status(idn), Direction::Read, room(ELEMENT_MAX))
    }

    fn start(&mut self, idn: Idn) -> Step {
        self.control(idn, ProcedureControl::EXECUTE, Asked::Start)
    }

    fn control(&mut self, idn: Idn, control: ProcedureControl, asked: Asked) -> Step {
        self.asked = asked;
        let rescales = asked == Asked::Start && recommissions(self.id);
        let word = control.bits().to_le_bytes().to_vec();
        Step::Access(Target::Element(idn, Element::Data), Direction::Write { rescales }, word)
    }

    fn write_signature(
        &mut self,
        object: Object,
        signature: [u8; SIGNATURE_LEN],
        context: &Context<'_>,
    ) -> Step {
        self.asked = Asked::Signature;
        self.report.name = match context.bus {
            Bus::Can { .. } => context.bus.object(object).map(|known| known.name.clone()),
            Bus::Sercos | Bus::Devicenet { .. } => None,
        }
        .filter(|name| !name.is_empty());
        let rescales = recommissions(self.id);
        Step::Access(Target::Object(object), Direction::Write { rescales }, signature.to_vec())
    }

    /// A CANopen device has answered its signature.
    fn executed(&mut self, failure: Option<DirectFailure>, context: &Context<'_>) -> Step {
        if let Some(failure) = failure {
            return self.failed(&failure, context);
        }
        self.report.state = State::Done;
        self.report.recommission = recommissions(self.id);
        self.reply(context)
    }

    /// The reply of success.
    fn reply(&self, context: &Context<'_>) -> Step {
        // The object has texts only, and nothing that JSON does not know.
        let json = serde_json::to_string(&self.report).unwrap_or_default();
        Step::Reply(format!("ok command {} {json}\n", context.axis))
    }

    /// The reply of a failure, and what is known of the command.
    fn failed(&self, failure: &DirectFailure, context: &Context<'_>) -> Step {
        let id = self.id;
        let is_open = failure.code() == "unanswered" && *failure != DirectFailure::NoDrive;
        let mut text = match (self.asked, self.act) {
            (Asked::Start | Asked::Signature, _) if is_open => {
                format!("{id}: it is not known whether the drive executes it: {failure}")
            }
            (Asked::Cancel, _) if is_open => {
                format!("{id}: it is not known whether the drive has cancelled it: {failure}")
            }
            (Asked::Status, Act::Start) => {
                format!("{id}: started, and its progress is not known: {failure}")
            }
            _ => format!("{id}: {failure}"),
        };
        let is_started = match self.asked {
            Asked::Start | Asked::Signature => failure.may_have_written(SIGNATURE_LEN),
            Asked::Status | Asked::Number | Asked::Message => self.act == Act::Start,
            Asked::Attribute | Asked::Name | Asked::Before | Asked::Clear | Asked::Cancel => false,
        };
        if is_started && recommissions(id) {
            text += RECOMMISSION;
        }
        self.fail(failure.code(), &text, context)
    }

    fn fail(&self, code: &str, text: &str, context: &Context<'_>) -> Step {
        Step::Reply(error(&Ask::Command { id: self.id, act: self.act }, context, code, text))
    }
}

/// A text of a drive; `None` when there is nothing in it.
fn text(data: &[u8]) -> Option<String> {
    Some(printable(&Kind::Sercos(TEXT).decode(data))).filter(|text| !text.is_empty())
}

/// The data status of an answer.
fn status(data: &[u8]) -> DataStatus {
    let word = data.try_into().map_or(0, u16::from_le_bytes);
    DataStatus::from_bits_retain(word)
}
