//! What people should know of a start-up list.

use std::fmt;

use crate::engine::direct::DirectFailure;
use crate::parameter::id::Id;
use crate::parameter::value::ValueError;

/// A parameter that is not what its list says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// The parameter.
    pub id: Id,
    /// The value of the list.
    pub expected: String,
    /// The value of the drive.
    pub found: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, expected, found } = self;
        write!(f, "{id} is {found}, expected {expected}")
    }
}

/// Something that has happened to an entry, and does not keep the drive from being used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StartupReport {
    /// The drive had another value, and has that of the list now: it was read back.
    Written {
        /// The parameter.
        id: Id,
        /// What it was.
        before: String,
        /// What it is.
        value: String,
    },
    /// The drive has another value, and is used nevertheless.
    Differs(Difference),
    /// An entry could not be compared, and the drive is used nevertheless.
    NotCompared(Id, Trouble),
    /// The list is through.
    Through {
        /// Entries whose value the drive has.
        equal: usize,
        /// Those of them that were written.
        written: usize,
    },
}

impl StartupReport {
    /// Whether somebody should look at it.
    #[must_use]
    pub const fn is_warning(&self) -> bool {
        matches!(self, Self::Differs(_) | Self::NotCompared(..))
    }
}

impl fmt::Display for StartupReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("start-up list: ")?;
        match self {
            Self::Written { id, before, value } => write!(f, "{id} was {before} and is set to {value}"),
            Self::Differs(difference) => {
                write!(f, "{difference}; the drive is used nevertheless (on_difference = \"warn\")")
            }
            Self::NotCompared(id, trouble) => {
                write!(
                    f,
                    "{id} is not compared: {trouble}; the drive is used nevertheless (on_difference = \"warn\")"
                )
            }
            Self::Through { equal, written } => {
                let s = if *equal == 1 { "entry holds" } else { "entries hold" };
                write!(f, "{equal} {s}, {written} of them written")
            }
        }
    }
}

/// Why an entry cannot be compared with the drive.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Trouble {
    /// The parameter could not be read.
    #[error("{0}")]
    Unread(DirectFailure),
    /// The value of the list cannot be that of the parameter.
    #[error("{0}")]
    Value(ValueError),
    /// The parameter is no value.
    #[error("it is a procedure command, which is executed and has no value")]
    Command,
    /// The drive has another type than the list says.
    #[error("the drive has {found} bytes, and the type `{kind}` has {expected}")]
    Length {
        /// The type of the list.
        kind: &'static str,
        /// Its bytes.
        expected: usize,
        /// The bytes of the drive.
        found: usize,
    },
}

/// What keeps the drive from being used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StartupTrouble {
    /// The drive has other values, and the list says that it is not used then.
    #[error("{} (on_difference = \"refuse\")", all(.0))]
    Refused(Vec<Difference>),
    /// An entry cannot be compared.
    #[error("{0}: {1}")]
    NotCompared(Id, Trouble),
    /// The drive has other values, and they cannot be written any more.
    #[error("{}", all(.0))]
    Protected(Vec<Protected>),
    /// The drive has not taken values.
    #[error("{}", all(.0))]
    NotTaken(Vec<NotTaken>),
    /// The drive has taken a value without an error, and has another one.
    #[error("the drive took {} = {} and has {} afterwards", .0.id, .0.expected, .0.found)]
    NotKept(Difference),
    /// A value was written, and it is not known whether the drive has it.
    #[error("{0} is written, and not read back: {1}")]
    NotReadBack(Id, DirectFailure),
    /// The drive had the value, and has another one since other entries were written.
    #[error("{0} after the other entries were written; before it was as expected")]
    Changed(Difference),
}

/// A value that is write protected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Protected {
    /// What it is and what it should be.
    pub difference: Difference,
    /// Whether it can be written in CP4, which is too late.
    pub until_cp4: bool,
}

impl fmt::Display for Protected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let when =
            if self.until_cp4 { "until CP4, where the axis may move" } else { "in every phase to come" };
        write!(f, "{}, and is write protected {when} (by its attribute)", self.difference)
    }
}

/// A value that the drive has not taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotTaken {
    /// What it is and what it should be.
    pub difference: Difference,
    /// What the drive says.
    pub failure: DirectFailure,
}

impl fmt::Display for NotTaken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { difference: Difference { id, expected, found }, failure } = self;
        write!(f, "writing {id} = {expected} (it is {found}): {failure}")
    }
}

/// Why a list is not through.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StartupFailure {
    /// Why.
    pub trouble: StartupTrouble,
    /// What was written before, and stays so.
    pub written: Vec<Id>,
}

impl fmt::Display for StartupFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.trouble)?;
        if !self.written.is_empty() {
            let ids: Vec<_> = self.written.iter().map(ToString::to_string).collect();
            write!(f, "; written before: {}", ids.join(", "))?;
        }
        Ok(())
    }
}

fn all(list: &[impl fmt::Display]) -> String {
    list.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
