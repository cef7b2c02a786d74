//! The token: a secret of which the gateway has only a hash, Argon2id (RFC 9106) in the PHC string format.

use std::io;
use std::path::Path;

use argon2::password_hash::{PasswordHash, PasswordHasher as _, PasswordVerifier as _, SaltString};
use argon2::{Algorithm, Argon2, Params, Version};
use rand::RngCore as _;
use rand::rngs::OsRng;

use super::hex;

/// Bytes of a secret that is made here: 160 bits.
const SECRET_LEN: usize = 20;

/// Fewest characters of a secret that a person chooses.
pub const SECRET_LEN_MIN: usize = 16;

/// Most characters of a secret: more does not fit a header line with room for others.
const SECRET_LEN_MAX: usize = 256;

/// Longest hash file, bytes.
const FILE_LEN_MAX: u64 = 4_096;

/// Bytes of the salt (RFC 9106 clause 3.1 recommends 16).
const SALT_LEN: usize = 16;

/// Memory of a verification, KiB: the second recommendation of OWASP is the least, and 64 MiB (RFC 9106 clause 4) the most, so that a file
/// cannot make the gateway take more.
const MEMORY_KIB: std::ops::RangeInclusive<u32> = 7_168..=65_536;

/// Most passes over the memory.
const PASSES_MAX: u32 = 10;

/// Most lanes.
const LANES_MAX: u32 = 4;

/// Why a file is no hash of a token.
#[derive(Debug, thiserror::Error)]
pub enum BadToken {
    /// It cannot be read.
    #[error("{0}")]
    Read(#[from] io::Error),
    /// It is not text, or too long.
    #[error("it is not the hash of a token: expected one line `$argon2id$v=19$...`")]
    Form,
    /// It is a hash of another kind.
    #[error("its algorithm is `{0}`: expected argon2id, version 19")]
    Algorithm(String),
    /// Memory, passes or lanes are out of range.
    #[error(
        "its cost m={memory},t={passes},p={lanes} is out of range: expected m={low} to {high}, t=1 to {PASSES_MAX}, p=1 to {LANES_MAX}",
        low = MEMORY_KIB.start(), high = MEMORY_KIB.end()
    )]
    Cost {
        /// KiB.
        memory: u32,
        /// Passes over the memory.
        passes: u32,
        /// Lanes.
        lanes: u32,
    },
}

/// Why a secret is not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum UnfitSecret {
    /// It is too short or too long.
    #[error("the secret has {0} characters: expected {SECRET_LEN_MIN} to {SECRET_LEN_MAX}")]
    Length(usize),
    /// It cannot stand in a header line.
    #[error("the secret has a space or a character that is not printable ASCII")]
    Character,
}

/// What a secret is compared with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// Reads the hash of a token from a file.
    ///
    /// # Errors
    /// The file cannot be read, or is no such hash.
    pub fn read(path: &Path) -> Result<Self, BadToken> {
        if std::fs::metadata(path)?.len() > FILE_LEN_MAX {
            return Err(BadToken::Form);
        }
        let bytes = std::fs::read(path)?;
        Self::parse(std::str::from_utf8(&bytes).map_err(|_| BadToken::Form)?)
    }

    /// Takes the hash of a token.
    ///
    /// # Errors
    /// It is no such hash.
    pub fn parse(text: &str) -> Result<Self, BadToken> {
        let text = text.trim_ascii();
        let hash = PasswordHash::new(text).map_err(|_| BadToken::Form)?;
        if hash.algorithm != Algorithm::Argon2id.ident() || hash.version != Some(Version::V0x13.into()) {
            return Err(BadToken::Algorithm(hash.algorithm.to_string()));
        }
        let params = Params::try_from(&hash).map_err(|_| BadToken::Form)?;
        let (memory, passes, lanes) = (params.m_cost(), params.t_cost(), params.p_cost());
        if !MEMORY_KIB.contains(&memory) || passes > PASSES_MAX || lanes > LANES_MAX {
            return Err(BadToken::Cost { memory, passes, lanes });
        }
        match (hash.salt, hash.hash) {
            (Some(_), Some(output)) if output.len() >= 32 => Ok(Self(text.to_owned())),
            _ => Err(BadToken::Form),
        }
    }

    /// Whether this is the secret. It takes tens of milliseconds and some tens of megabytes, whatever the secret.
    #[must_use]
    pub fn accepts(&self, secret: &str) -> bool {
        // Its form was checked when it was read.
        PasswordHash::new(&self.0)
            .is_ok_and(|hash| Argon2::default().verify_password(secret.as_bytes(), &hash).is_ok())
    }
}

/// A new secret of 160 random bits, in hexadecimal digits.
#[must_use]
pub fn random_secret() -> String {
    let mut bytes = [0; SECRET_LEN];
    OsRng.fill_bytes(&mut bytes);
    hex(&bytes)
}

/// The hash of a secret, for the file.
///
/// # Errors
/// The secret is too short or long, or cannot stand in a header line.
pub fn hash(secret: &str) -> Result<String, UnfitSecret> {
    let length = secret.chars().count();
    if !secret.bytes().all(|byte| byte.is_ascii_graphic()) {
        return Err(UnfitSecret::Character);
    }
    if !(SECRET_LEN_MIN..=SECRET_LEN_MAX).contains(&length) {
        return Err(UnfitSecret::Length(length));
    }
    let mut salt = [0; SALT_LEN];
    OsRng.fill_bytes(&mut salt);
    let salt = SaltString::encode_b64(&salt).map_err(|_| UnfitSecret::Character)?;
    let argon = Argon2::new(Algorithm::Argon2id, Version::V0x13, Params::default());
    // Length and salt are in the range of the algorithm.
    let hash = argon.hash_password(secret.as_bytes(), &salt).map_err(|_| UnfitSecret::Length(length))?;
    Ok(hash.to_string())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The secret of [`HASH`].
    pub const SECRET: &str = "sixteen-letters!";

    #[test]
    fn secret_is_accepted_by_its_hash_and_no_other() {
        let text = hash(SECRET).unwrap();
        assert!(text.starts_with("$argon2id$v=19$m=19456,t=2,p=1$"), "{text}");
        let token = Token::parse(&format!("{text}\n")).unwrap();
        assert!(token.accepts(SECRET));
        for wrong in ["", "sixteen-letters", "sixteen-letters!!", "Sixteen-letters!", text.as_str()] {
            assert!(!token.accepts(wrong), "{wrong}");
        }
        assert_ne!(text, hash(SECRET).unwrap(), "each hash has a salt of its own");
    }

    #[test]
    fn random_secrets_have_160_bits_and_differ() {
        let [one, other] = [(); 2].map(|()| random_secret());
        assert_ne!(one, other);
        assert!(one.len() == 40 && one.bytes().all(|byte| byte.is_ascii_hexdigit()), "{one}");
        assert!(hash(&one).is_ok());
    }

    #[test]
    fn secrets_that_are_short_or_do_not_fit_a_header_are_refused() {
        assert_eq!(hash("fifteen-letters"), Err(UnfitSecret::Length(15)));
        assert_eq!(hash(&"x".repeat(257)), Err(UnfitSecret::Length(257)));
        for text in ["sixteen letters!", "sixteen-letters!\n", "sechzehn-zeichenä"] {
            assert_eq!(hash(text), Err(UnfitSecret::Character), "{text:?}");
        }
    }

    #[test]
    fn what_is_no_hash_or_one_of_another_cost_is_refused() {
        let salt_and_hash = "c29tZXNhbHRzb21lc2FsdA$MTIzNDU2Nzg5MDEyMzQ1Njc4OTAxMjM0NTY3ODkwMTI";
        let of = |head: &str| match Token::parse(&format!("{head}${salt_and_hash}")) {
            Ok(_) => "good".to_owned(),
            Err(error) => error.to_string(),
        };
        assert_eq!(of("$argon2id$v=19$m=19456,t=2,p=1"), "good");
        assert!(of("$argon2i$v=19$m=19456,t=2,p=1").starts_with("its algorithm is `argon2i`"));
        assert!(of("$argon2id$v=16$m=19456,t=2,p=1").starts_with("its algorithm is `argon2id`"));
        for cost in ["m=4194304,t=2,p=1", "m=1024,t=2,p=1", "m=19456,t=11,p=1", "m=19456,t=2,p=5"] {
            let said = of(&format!("$argon2id$v=19${cost}"));
            assert!(said.starts_with(&format!("its cost {cost} is out of range")), "{said}");
        }
        for text in [
            "",
            "password",
            "$argon2id$v=19$m=19456,t=2,p=1",
            "$argon2id$v=19$m=19456,t=2,p=1$c29tZXNhbHRzb21lc2FsdA$MTIz",
        ] {
            assert!(matches!(Token::parse(text), Err(BadToken::Form)), "{text}");
        }
    }
}
