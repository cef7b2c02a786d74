//! A read-only HTTP server: health, metrics, status, and a page for people.
//!
//! ```text
//! cycle thread --status--> View --Look--> /healthz /readyz /metrics /api/v1/status
//!    histories ------------/   \--------> /api/v1/faults /api/v1/log
//!    recording, contacts ---------------> /recording.pcapng /api/v1/contacts /contact.pcapng /bundle
//!                            \--twice a second--> /events --> page in a browser
//! ```
//!
//! The server has one thread of its own, below the priority of every other one, and takes only what the cycle thread
//! publishes anyway: requests, viewers and floods cost the cycle nothing. No request changes anything.

mod api;
mod downloads;
mod events;
mod health;
mod limits;
mod metrics;
mod page;
mod routes;
mod server;
#[cfg(test)]
mod tests;
mod view;

pub use api::openapi;
pub use downloads::ContactList;
pub use health::Health;
pub use metrics::metrics;
pub use server::{HttpServer, RunningServer};
pub use view::{FaultList, LogLines, Look, Newest, View};
