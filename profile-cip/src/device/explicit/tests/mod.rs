//! The adapter as its peers see it: bytes in, bytes out, in virtual time.

mod assembly_connection;
mod bad_input;
mod explicit_connections;
mod file_object;
mod fixed_format;
mod malformed;
mod motion_connection;
mod network_objects;
mod objects;
mod other_targets;
mod ownership;
mod rig;
mod routing;
mod sessions;
mod time_sync;
