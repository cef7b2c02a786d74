//! The bytes of DeviceNet: one file per block, on CAN frames with identifiers of 11 bits and at most 8 bytes of data.

pub mod allocation;
pub mod duplicate_mac;
pub mod explicit;
pub mod fragment;
pub mod id;
pub mod speed;

pub use allocation::{Allocate, AllocationChoice};
pub use duplicate_mac::DuplicateMac;
pub use explicit::{BodyFormat, Header, Request, Response};
pub use fragment::{AcknowledgeStatus, Fragment, FragmentKind};
pub use id::{Identifier, MacId};
