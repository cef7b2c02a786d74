//! What clients of the socket ask of drives: the accesses that a request takes one after the other.

mod command;
pub mod job;
mod parameter;
pub mod reply;

pub use self::command::{CommandReport, State};
