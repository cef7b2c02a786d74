//! The HTTP server: health, metrics, status, a page for people, and control of the axes for those who have the token.
//!
//! ```text
//! cycle thread --status--> View --Look--> /healthz /readyz /metrics /api/v1/status
//!    histories ------------/   \--------> /api/v1/faults /api/v1/log
//!                           |\--twice a second--> /events --> page in a browser
//!                            \--ten times a second--> Traces --> /api/v1/traces /api/v1/time
//!    Session of local control <---one at a time---> /api/v1/parameters /api/v1/parameter
//!    recording, contacts ---------------> /recording.pcapng /api/v1/contacts /contact.pcapng /bundle
//! ```
//!
//! The server has one thread of its own, below the priority of every other one, and takes only what the cycle thread
//! publishes anyway: requests, viewers and floods cost the cycle nothing. Parameters of drives are the exception: they take one access
//! at a time, as those of the Unix socket do. No request changes anything but those of [`control`], which are the
//! requests of the Unix socket ([`crate::local`]).

mod access;
mod api;
mod control;
mod downloads;
mod events;
mod files;
mod health;
mod limits;
mod login;
mod metrics;
mod page;
mod parameters;
mod routes;
mod server;
mod sheet;
#[cfg(test)]
mod tests;
pub mod tls;
mod traces;
mod view;

pub use access::{BadToken, SECRET_LEN_MIN, Token, UnfitSecret, hash, random_secret};
pub use api::openapi;
pub use downloads::ContactList;
pub use files::Files;
pub use health::Health;
pub use metrics::metrics;
pub use parameters::{ParameterAnswer, ParameterAnswers, ParameterList, ParameterRefusal, ParameterRow};
pub use server::{HttpServer, RunningServer};
pub use sheet::{AxisLimits, AxisSheet, MappedValue, Sheets};
pub use traces::{AxisTraces, PhaseTrace, TimeTraces};
pub use view::{FaultList, Fixed, LogLines, Look, Newest, View};
