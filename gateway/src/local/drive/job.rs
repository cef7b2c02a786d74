//! A request of a client for the drive of an axis: accesses one after the other, and the reply.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::command::CommandJob;
use super::parameter::ParameterJob;
use crate::engine::direct::{DATA_MAX, DirectAnswer, DirectFailure, Direction, Target};
use crate::local::protocol::{NamedParameter, printable};
use crate::parameter::id::Id;
use crate::parameter::known::{Bus, Catalogue};

/// What a client asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ask {
    /// The value of a parameter and what the drive says about it.
    Read {
        /// The parameter.
        id: Id,
        /// Only value and name.
        brief: bool,
    },
    /// Another value of a parameter.
    Write {
        /// The parameter.
        id: Id,
        /// The value, as [`crate::parameter::value`] reads it.
        text: String,
    },
    /// The parameters that are known.
    List {
        /// Which of them.
        of: Listing,
    },
    /// A procedure command.
    Command {
        /// The command.
        id: Id,
        /// What is done with it.
        act: Act,
    },
}

/// Which parameters a list has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Listing {
    /// All that are known.
    All,
    /// Those of a backup.
    Backup,
    /// Procedure commands only.
    Commands,
}

/// What is done with a procedure command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// It is set and started.
    Start,
    /// The drive is asked how far it is.
    Progress,
    /// It is cancelled.
    Cancel,
}

impl Act {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Start, Self::Progress, Self::Cancel];

    /// The word of the request.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Progress => "progress",
            Self::Cancel => "cancel",
        }
    }
}

impl Ask {
    /// The word of the request.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Read { .. } => "read",
            Self::Write { .. } => "write",
            Self::List { .. } => "list",
            Self::Command { .. } => "command",
        }
    }

    /// The parameter, if it is one.
    #[must_use]
    pub const fn id(&self) -> Option<Id> {
        match self {
            Self::Read { id, .. } | Self::Write { id, .. } | Self::Command { id, .. } => Some(*id),
            Self::List { .. } => None,
        }
    }
}

/// A parameter as its drive has it: the object in replies.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterReport {
    /// Its number.
    pub id: String,
    /// Its name, from the drive if that has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The type of its value; not there when nobody says.
    #[serde(default, skip_serializing_if = "Option::is_none", rename = "type")]
    pub kind: Option<String>,
    /// Its unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Least value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minimum: Option<String>,
    /// Greatest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maximum: Option<String>,
    /// The attribute of an IDN, `0x01110001`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attribute: Option<String>,
    /// What can be done with an object, as far as anybody says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub access: Option<String>,
    /// When it can be written while the gateway runs: `without torque`, or why not; not there when nobody says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub writable: Option<String>,
    /// The value.
    pub value: String,
    /// What it was before a write.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before: Option<String>,
    /// Whether the drive has to be commissioned again before the axis can be enabled.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub recommission: bool,
    /// The bytes of the value in the order of the drive, two hexadecimal digits each; empty for a parameter by its name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub data: String,
}

/// What comes next.
#[derive(Debug, PartialEq, Eq)]
pub enum Step {
    /// The drive is asked this; the buffer is written, or the place for what is read.
    Access(Target, Direction, Vec<u8>),
    /// It is over: the reply.
    Reply(String),
}

/// What a job needs to know.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a> {
    /// The name of the axis.
    pub axis: &'a str,
    /// The drive of the axis.
    pub bus: &'a Bus,
    /// All drives.
    pub catalogue: &'a Catalogue,
    /// Parameters that have names of their own.
    pub parameters: &'a [NamedParameter],
}

/// A request of a client on its way through its accesses.
#[derive(Debug)]
pub enum Job {
    /// For parameters.
    Parameter(Box<ParameterJob>),
    /// For a procedure command.
    Command(CommandJob),
}

impl Job {
    /// The parameter that is written, if it is that.
    #[must_use]
    pub const fn written(&self) -> Option<Id> {
        match self {
            Self::Parameter(job) => job.written(),
            Self::Command(_) => None,
        }
    }

    /// Begins with a request: the job and its first access.
    ///
    /// # Errors
    /// The reply, if the drive need not be asked.
    pub fn begin(ask: Ask, context: &Context<'_>) -> Result<(Self, Step), String> {
        if let Some(id) = ask.id().filter(|id| !context.bus.has(*id)) {
            let text =
                format!("{id} is a number of {} drives: the drive of this axis is another one", id.bus());
            return Err(error(&ask, context, "no-parameter", &text));
        }
        match ask {
            Ask::Command { id, act } => {
                CommandJob::begin(id, act, context).map(|(job, step)| (Self::Command(job), step))
            }
            ask => {
                ParameterJob::begin(ask, context).map(|(job, step)| (Self::Parameter(Box::new(job)), step))
            }
        }
    }

    /// Takes the answer of the drive.
    pub fn take(&mut self, answer: DirectAnswer, context: &Context<'_>) -> Step {
        match self {
            Self::Parameter(job) => job.take(answer, context),
            Self::Command(job) => job.take(answer, context),
        }
    }
}

/// What the text of a failure ends with when the drive may mean something else by its values afterwards.
pub const RECOMMISSION: &str = "; the axis cannot be enabled before its drive was commissioned again";

/// A buffer to read into.
pub(super) fn room(len: usize) -> Vec<u8> {
    Vec::with_capacity(len)
}

/// Whether there is nothing more to be had from the drive.
pub(super) fn is_over(failure: &DirectFailure) -> bool {
    matches!(failure.code(), "unanswered" | "ending" | "busy")
}

/// Reads as much as there is.
pub(super) fn read(target: Target) -> Step {
    Step::Access(target, Direction::Read, room(DATA_MAX))
}

/// The reply of a failure.
pub(super) fn error(ask: &Ask, context: &Context<'_>, code: &str, text: &str) -> String {
    // Texts of drives may have anything in them; a reply is one line.
    let text = printable(text);
    format!("error {} {} {code}: {text}\n", ask.word(), context.axis)
}
