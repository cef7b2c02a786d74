//! The adapter as its peers see it: bytes in, bytes out, in virtual time.

mod bad_input;
mod explicit_connections;
mod motion_connection;
mod objects;
mod rig;
mod routing;
mod sessions;
