//! Local control over a Unix socket: the text protocol and its server. What the orders do is in [`crate::engine::local`].

pub mod advice;
pub mod attributes;
pub mod drive;
mod hub;
pub mod installation;
pub mod overview;
pub mod protocol;
mod server;
mod session;

pub use self::hub::{Door, Hub, Shared, Who};
#[cfg(test)]
pub(crate) use self::server::tests as server_tests;
pub use self::server::{LocalServer, SocketFile};
pub use self::session::{Session, Taken};
