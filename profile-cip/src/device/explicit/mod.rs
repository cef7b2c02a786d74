//! The explicit side: encapsulation sessions over TCP and UDP, and the requests that come over them.
//!
//! ```text
//! adapter --> session    one TCP stream: bytes in, packets out
//!    |    --> exchange   one encapsulation packet: session handling, unconnected and connected messages
//!    |    --> list       ListServices, ListIdentity, ListInterfaces
//!    '------> node       one request to an object --> objects, forward_open, forward_close, reset
//! ```

pub mod adapter;
mod exchange;
mod forward_close;
mod forward_open;
mod list;
mod node;
mod ownership;
mod reset;
mod session;
#[cfg(test)]
mod tests;
