//! TLS (RFC 8446 and 5246): the certificate of the server and its key.

use std::fmt;
use std::io;
use std::path::Path;
use std::sync::Arc;

use rustls::ServerConfig;
use rustls::crypto::ring;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};

use crate::config::TlsFiles;

/// Longest file, bytes.
const FILE_LEN_MAX: u64 = 1 << 20;

/// The protocol after the handshake (RFC 7301).
const HTTP_1_1: &[u8] = b"http/1.1";

/// Which file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TlsFile {
    /// That of the certificate.
    Certificate,
    /// That of the private key.
    Key,
}

impl fmt::Display for TlsFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Certificate => "the certificate",
            Self::Key => "the private key",
        })
    }
}

/// Why there is no TLS with these files.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {why}")]
pub struct BadTls {
    /// The file.
    pub file: TlsFile,
    /// What is wrong with it.
    pub why: Why,
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum Why {
    /// It cannot be read.
    #[error("{0}")]
    Read(io::Error),
    /// It is longer than 1 MiB.
    #[error("the file is longer than 1 MiB")]
    TooLong,
    /// What is wanted is not in it.
    #[error("expected `-----BEGIN {0}-----`: {1}")]
    Pem(&'static str, String),
    /// The library refuses it.
    #[error("{0}")]
    Refused(rustls::Error),
}

/// Reads the files.
///
/// # Errors
/// A file cannot be read, is something else, or the two do not belong together.
pub fn read(files: &TlsFiles) -> Result<Arc<ServerConfig>, BadTls> {
    let of = |file| move |why| BadTls { file, why };
    let (certificate, key) = (of(TlsFile::Certificate), of(TlsFile::Key));
    let pem = bytes(&files.certificate).map_err(certificate)?;
    let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&pem).collect();
    let chain = chain.map_err(|error| error.to_string()).and_then(|chain| match chain.is_empty() {
        true => Err("there is none".to_owned()),
        false => Ok(chain),
    });
    let chain = chain.map_err(|error| certificate(Why::Pem("CERTIFICATE", error)))?;
    let pem = bytes(&files.key).map_err(key)?;
    let private = PrivateKeyDer::from_pem_slice(&pem);
    let private = private.map_err(|error| key(Why::Pem("PRIVATE KEY", error.to_string())))?;
    let provider = Arc::new(ring::default_provider());
    let loaded = provider.key_provider.load_private_key(private.clone_key());
    loaded.map_err(|error| key(Why::Refused(error)))?;
    let builder = ServerConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    let builder = builder.map_err(|error| certificate(Why::Refused(error)))?.with_no_client_auth();
    let mut config = builder.with_single_cert(chain, private).map_err(|error| match error {
        error @ rustls::Error::InconsistentKeys(_) => key(Why::Refused(error)),
        error => certificate(Why::Refused(error)),
    })?;
    config.alpn_protocols = vec![HTTP_1_1.to_vec()];
    Ok(Arc::new(config))
}

fn bytes(path: &Path) -> Result<Vec<u8>, Why> {
    let length = std::fs::metadata(path).map_err(Why::Read)?.len();
    if length > FILE_LEN_MAX {
        return Err(Why::TooLong);
    }
    std::fs::read(path).map_err(Why::Read)
}

#[cfg(test)]
pub(super) mod tests {
    use std::path::PathBuf;

    use super::*;

    /// A file of the tests.
    fn file(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/certificates").join(name)
    }

    /// A certificate for localhost and its key.
    pub fn files() -> TlsFiles {
        TlsFiles { certificate: file("test-certificate.pem"), key: file("test-key.pem") }
    }

    #[test]
    fn certificate_and_key_that_belong_together_are_taken() {
        let config = read(&files()).unwrap();
        assert_eq!(config.alpn_protocols, [b"http/1.1"]);
    }

    #[test]
    fn what_is_wrong_is_said_of_the_file_in_which_it_is() {
        let said = |certificate: &str, key: &str| {
            let files = TlsFiles { certificate: file(certificate), key: file(key) };
            read(&files).map(drop).unwrap_err().to_string()
        };
        assert_eq!(said("none", "test-key.pem"), "the certificate: No such file or directory (os error 2)");
        assert_eq!(
            said("test-certificate.pem", "none"),
            "the private key: No such file or directory (os error 2)"
        );
        let of_key = said("test-key.pem", "test-key.pem");
        assert_eq!(of_key, "the certificate: expected `-----BEGIN CERTIFICATE-----`: there is none");
        let of_certificate = said("test-certificate.pem", "test-certificate.pem");
        assert!(
            of_certificate.starts_with("the private key: expected `-----BEGIN PRIVATE KEY-----`: "),
            "{of_certificate}"
        );
        let other = said("test-certificate.pem", "other-key.pem");
        assert!(other.starts_with("the private key: ") && other.contains("KeyMismatch"), "{other}");
    }
}
