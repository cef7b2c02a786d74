//! A programmable controller that moves axes through the assemblies of a device, over sockets.
//!
//! It connects as owner and carries out steps, from a [script] or from whoever starts it:
//!
//! | step | control word | until |
//! |---|---|---|
//! | enable | 0, then ENABLE | the axis is in operation |
//! | move | ENABLE, then START | the movement is done |
//! | velocity | ENABLE | the axis has the velocity |
//! | stop | STOP | it stands |
//! | fault reset | 0, then RESET | the fault is over |
//! | disable | 0 | the torque is off |
//!
//! Whatever goes wrong, it disables all axes in the end, and closes the connection. It ends the same way when it is asked to stop.

mod image;
mod line;
mod player;
mod profile;
pub mod script;
mod session;
mod step;

use std::io;
use std::net::Ipv4Addr;
use std::time::Duration;

use profile_cip::assembly::{Assemblies, Refusal};
use profile_cip::wire::status::{ConnectionStatus, Service};
use profile_generic::fault::FaultCause;
use thiserror::Error;

pub use self::image::Images;
pub use self::player::{AxisReport, Event, Failure, Outcome, run};
pub use self::step::{Condition, Movement, Planned, Step};

/// How long the axis may take to be enabled, and to lose its torque.
pub const HANDSHAKE: Duration = Duration::from_secs(10);

/// Whom the controller is connected to.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Address of the device.
    pub address: Ipv4Addr,
    /// Its assemblies.
    pub assemblies: Assemblies,
    /// Names of its axes, in the order of the assemblies.
    pub names: Vec<String>,
    /// Counts in a unit of each axis.
    pub counts: Vec<u32>,
    /// Interval of both directions.
    pub interval: Duration,
}

impl Plan {
    /// Name of an axis.
    #[must_use]
    pub fn name(&self, axis: usize) -> &str {
        self.names.get(axis).map_or("?", String::as_str)
    }
}

/// Why a step was not carried out.
#[derive(Debug, Error)]
pub enum PlcError {
    /// A socket failed.
    #[error("{what}: {source}")]
    Socket {
        /// What was being done.
        what: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// The device answered something else.
    #[error("{0}: the answer cannot be read")]
    Answer(&'static str),
    /// The device refused a service.
    #[error("{service} is refused with status {general:#04x}, extended {extended}")]
    Refused {
        /// The service.
        service: Service,
        /// General status.
        general: u8,
        /// First extended status.
        extended: ConnectionStatus,
    },
    /// The layout cannot carry the order.
    #[error("the layout of the device has no field `{0}` in the output or input")]
    Field(&'static str),
    /// The layout has another mode.
    #[error("the layout of the device has no mode {wanted}, only {found}")]
    Mode {
        /// The mode that is needed.
        wanted: u8,
        /// The one of the layout.
        found: u8,
    },
    /// The assemblies of the AC/DC drive profile have no such bit.
    #[error("the layout of the device is one of the AC/DC drive profile, which has neither STOP nor START")]
    Profile,
    /// A value does not fit its field.
    #[error("{value} does not fit the field `{field}`")]
    Value {
        /// The field.
        field: &'static str,
        /// The value.
        value: i64,
    },
    /// The axis refused an order.
    #[error("{name}: the axis refuses to {step}: {refusal}")]
    Order {
        /// Name of the axis.
        name: String,
        /// What was to be done.
        step: &'static str,
        /// Why not.
        refusal: Refusal,
    },
    /// The axis has a fault.
    #[error("{name}: the axis has a fault: {cause}")]
    Fault {
        /// Name of the axis.
        name: String,
        /// Its cause.
        cause: FaultCause,
    },
    /// It took too long.
    #[error("{name}: the axis did not {step} within {} s", limit.as_secs_f64())]
    Late {
        /// Name of the axis.
        name: String,
        /// What was to be done.
        step: &'static str,
        /// The time it had.
        limit: Duration,
    },
    /// Something that was expected did not come.
    #[error("{name}: expected {expected} within {} s, it has {found}", limit.as_secs_f64())]
    Unmet {
        /// Name of the axis.
        name: String,
        /// What was expected.
        expected: String,
        /// What the axis shows.
        found: String,
        /// The time it had.
        limit: Duration,
    },
    /// The device has been silent for longer than the time-out of the connection.
    #[error("the connection is lost: the device sent nothing for {} s", limit.as_secs_f64())]
    ConnectionLost {
        /// The time-out.
        limit: Duration,
    },
    /// The step needs a connection.
    #[error("there is no connection")]
    Unconnected,
    /// It was asked to stop.
    #[error("stopped before the end")]
    Stopped,
}

fn socket(what: &'static str) -> impl Fn(io::Error) -> PlcError {
    move |source| PlcError::Socket { what, source }
}

#[cfg(test)]
mod tests;
