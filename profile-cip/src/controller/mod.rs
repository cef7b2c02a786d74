//! The controller role of CIP Motion.
//!
//! [`Controller`] opens the session and the motion I/O connection to one device, configures the class and
//! the axes, synchronizes, carries out a program of [`Step`]s, and closes everything again. It shares the
//! wire code with the target role, not its state machines. It has no sockets and no clocks:
//!
//! - in: [`Controller::tcp_connected`], [`Controller::handle_stream`], [`Controller::handle_datagram`],
//!   [`Controller::handle_time`], [`Controller::tcp_closed`], [`Controller::finish`];
//! - out, to be drained after every input: [`Controller::poll_stream_transmit`],
//!   [`Controller::poll_datagram_transmit`], [`Controller::poll_event`],
//!   [`Controller::poll_stream_action`], which only programs that misbehave or reconnect need;
//! - [`Controller::wake_at`] says when [`Controller::handle_time`] is due. Datagrams that have come are to
//!   be handed in before it, so that a caller who was held up does not take its own delay for the device's
//!   silence.
//!
//! The start-up procedure stands in `phases.rs`, limits and units in [`config`] and [`program`], and the
//! figures of a run in [`report`].

mod axis;
mod axis_set;
mod carrier;
mod clock;
pub mod condition;
pub mod config;
mod cyclic_lists;
mod engine;
pub mod event;
mod events;
mod executor;
pub mod failure;
mod fault_reader;
mod following;
mod format;
pub(crate) mod handshake;
pub mod limits;
mod link;
pub mod misbehaviour;
mod node;
mod number;
mod phases;
mod plan_check;
pub mod program;
pub mod report;
mod services;
mod session;
pub mod sets;
pub mod statistics;
mod status;
#[cfg(test)]
mod tests;
pub mod trajectory;
mod update;

pub use condition::Condition;
pub use config::{AttributeSet, AxisSetup, ControllerConfig, Scaling, TimingModel};
pub use engine::{Controller, StreamAction};
pub use event::Event;
pub use failure::Failure;
pub use misbehaviour::Misbehaviour;
pub use program::{AxisSet, Step};
pub use report::Report;
pub use trajectory::Limits;

/// Longest C-to-D datagram in bytes: class 1 header and the largest connection.
pub const DATAGRAM_MAX: usize = crate::wire::class1::CLASS1_HEADER_LEN + config::CONNECTION_SIZE_MAX as usize;
