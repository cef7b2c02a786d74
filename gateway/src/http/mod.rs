//! A read-only HTTP server: health, metrics, status, and a page for people.
//!
//! ```text
//! cycle thread --status--> View --Look--> /healthz /readyz /metrics /api/v1/status
//!    histories ------------/   \--------> /api/v1/faults /api/v1/log
//!                           |\--twice a second--> /events --> page in a browser
//!                            \--ten times a second--> Traces --> /api/v1/traces /api/v1/time
//!    recording, contacts ---------------> /recording.pcapng /api/v1/contacts /contact.pcapng /bundle
//! ```
//!
//! The server has one thread of its own, below the priority of every other one, and takes only what the cycle thread
//! publishes anyway: requests, viewers and floods cost the cycle nothing. No request changes anything.

mod api;
mod downloads;
mod events;
mod files;
mod health;
mod limits;
mod metrics;
mod page;
mod routes;
mod server;
mod sheet;
#[cfg(test)]
mod tests;
mod traces;
mod view;

pub use api::openapi;
pub use downloads::ContactList;
pub use files::Files;
pub use health::Health;
pub use metrics::metrics;
pub use server::{HttpServer, RunningServer};
pub use sheet::{AxisLimits, AxisSheet, MappedValue, Sheets};
pub use traces::{AxisTraces, PhaseTrace, TimeTraces};
pub use view::{FaultList, Fixed, LogLines, Look, Newest, View};
