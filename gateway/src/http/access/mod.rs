//! Who may control axes over HTTP: the token, the sessions that it opens, and what keeps others from trying.
//!
//! ```text
//! POST /api/v1/session --Origin--> Attempts --Token (Argon2id)--> Sessions --key--> the client
//! ```
//!
//! A client shows the token once and gets the key of a session. The key is in no cookie: a browser sends it only where the page says so, so
//! another site cannot use it.

mod attempts;
mod origin;
mod sessions;
mod token;

pub use attempts::Attempts;
pub use origin::same_origin;
pub use sessions::{IDLE, Lease, Sessions};
#[cfg(test)]
pub use token::tests::SECRET;
pub use token::{BadToken, SECRET_LEN_MIN, Token, UnfitSecret, hash, random_secret};

use std::fmt::Write as _;

/// Bytes as lower-case hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(2 * bytes.len()), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
