//! The adapter as its peers see it: bytes in, bytes out, in virtual time.

mod bad_input;
mod explicit_connections;
mod file_object;
mod motion_connection;
mod objects;
mod rig;
mod routing;
mod sessions;
