//! The CIP Motion I/O connection of Volume 9 clause 6-2.7 and the service bodies of clauses 5-2.4 and 5-2.5.
//!
//! [`frame`] holds the entry points: [`CommandFrame`] (controller to device) and [`ActualFrame`] (device to
//! controller) of the variable formats, and [`fixed`] the two 16-octet formats. Everything is little-endian; blocks
//! are whole 32-bit words. Where Volume 9 contradicts itself the file that decides says so.
//!
//! `Display` of a frame is an engineer's tree of several lines.

pub mod actual;
pub mod attribute_list;
mod body;
pub mod codes;
pub mod cyclic;
pub mod event;
pub mod fixed;
mod flags;
pub mod frame;
pub mod header;
pub mod id_list;
mod instance;
pub mod read_write;
pub mod run_idle;
pub mod service;
pub mod test_service;
mod value;

pub use actual::{ActualBlock, ActualPosition, ActualValues, AlarmRecord, FaultRecord, StatusValues};
pub use cyclic::{CommandBlock, CommandPosition, CommandValues};
pub use event::{ActualEvents, CommandEvents, EventAck, EventNotification};
pub use fixed::Format;
pub use frame::{ActualFrame, ActualInstance, ActualWriter, CommandFrame, CommandInstance, CommandWriter};
pub use header::{
    ActualHeader, CommandHeader, FORMAT_REVISION, FORMAT_REVISION_RUN_IDLE, TimeDiagnostics,
    UpdateDiagnostics,
};
pub use read_write::{ReadBlock, WriteBlock};
pub use service::{ServiceRequest, ServiceResponse};

#[cfg(test)]
mod tests;
