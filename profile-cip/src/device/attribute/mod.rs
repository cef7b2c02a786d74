//! The attributes of the Motion Device Axis Object: definitions, table, values, list services.
//!
//! Which attributes a device has, with type and access, is data that the device is built with
//! ([`AttributeDefinition`]). Only those the protocol itself needs are listed here ([`id`]); they are always there.
//! Lookup is a binary search in a sorted table; values of an instance are one run of octets. Nothing is allocated
//! after construction.

pub(super) mod class;
mod data_type;
mod definition;
mod engine;
mod entry;
pub(super) mod list_job;
mod store;
mod table;
#[cfg(test)]
mod tests;
pub mod worker;

pub use data_type::{DataType, SHORT_STRING_MAX};
pub use definition::{Access, AttributeDefinition, Backing, DefaultValue, ElementRule, Scope};
pub(crate) use engine::attributes;
pub use engine::{OBJECT_REVISION, id};
pub use entry::{Entry, Part};
pub use store::AttributeStore;
pub use table::{AttributeTable, TableError};
