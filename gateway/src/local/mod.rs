//! Local control over a Unix socket: the text protocol and its server. What the orders do is in [`crate::engine::local`].

pub mod advice;
pub mod attributes;
pub mod drive;
pub mod installation;
pub mod overview;
pub mod protocol;
mod server;

pub use self::server::{LocalServer, Shared, SocketFile};
