//! The files of the HTTP server: whether they are what the configuration takes them for, and who can read them.

use std::io;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use crate::config::Written;
use crate::config::file::HttpTable;
use crate::finding::registry::{self as code, Code};
use crate::finding::{Findings, Problem, Spanned};
use crate::http::{BadToken, Token, tls};

/// Bits of a mode that let every user read or write.
const OF_OTHERS: u32 = 0o006;

/// Looks at the files that `[http]` names.
pub(super) fn check(written: &Written, findings: &mut Findings) {
    let (Some(table), Some(http)) = (&written.file.http, &written.config.http) else { return };
    let mut list = List { written, findings };
    if let (Some(key), Some(path)) = (&table.token, &http.token) {
        match Token::read(path) {
            Ok(_) => list.is_private(key, ("token", "the hash of the token"), path),
            Err(BadToken::Read(error)) => list.unread(key, "token", &error),
            Err(error) => list.push(code::HTTP_FILE, key, "token", "this is not the hash of a token", error),
        }
    }
    if let (Some(certificate), Some(key), Some(files)) = (&table.certificate, &table.key, &http.tls) {
        match tls::read(files) {
            Ok(_) => list.is_private(key, ("key", "the private key"), &files.key),
            Err(tls::BadTls { file, why }) => {
                let (place, name, title) = match file {
                    tls::TlsFile::Certificate => {
                        (certificate, "certificate", "the certificate cannot be used")
                    }
                    tls::TlsFile::Key => (key, "key", "the private key cannot be used"),
                };
                match why {
                    tls::Why::Read(error) => list.unread(place, name, &error),
                    why => list.push(code::HTTP_FILE, place, name, title, why),
                }
            }
        }
    }
    if let Some(plain) = plain(table, http.listen.ip().to_canonical().is_loopback()) {
        let problem = Problem::new(code::HTTP_PLAIN, plain.span()).key("plain");
        let problem =
            problem.title(format!("the token crosses the network to {} without encryption", http.listen));
        list.findings.push(&written.text, problem.help("use `certificate` and `key`"));
    }
}

/// The key that lets the token cross the network without encryption, where that has an effect.
fn plain(table: &HttpTable, is_loopback: bool) -> Option<&Spanned<bool>> {
    let plain = table.plain.as_ref().filter(|plain| *plain.get_ref())?;
    (table.token.is_some() && table.certificate.is_none() && !is_loopback).then_some(plain)
}

struct List<'l> {
    written: &'l Written,
    findings: &'l mut Findings,
}

impl List<'_> {
    fn push(&mut self, code: Code, place: &Spanned<String>, key: &str, title: &str, why: impl ToString) {
        let problem = Problem::new(code, place.span()).key(key).title(title);
        self.findings.push(&self.written.text, problem.expected(why.to_string()));
    }

    /// A file that is not there or not for this user: the gateway runs elsewhere, or as another user.
    fn unread(&mut self, place: &Spanned<String>, key: &str, error: &io::Error) {
        let why = format!("the gateway does not start without it: {error}");
        self.push(code::HTTP_FILE_ODD, place, key, "the file cannot be read here", why);
    }

    /// A file that only its user and group can read.
    fn is_private(&mut self, place: &Spanned<String>, (key, what): (&str, &str), path: &Path) {
        let mode = std::fs::metadata(path).map_or(0, |metadata| metadata.permissions().mode() & 0o777);
        if mode & OF_OTHERS != 0 {
            let why = format!("expected mode 0600, got {mode:04o}");
            let title = format!("every user of this host can read {what}");
            self.push(code::HTTP_FILE_ODD, place, key, &title, why);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;
    use crate::check::{Request, check};
    use crate::http::hash;

    /// Codes and titles of what is found with these files, each with its mode.
    fn found(http: &str, files: &[(&str, &[u8], u32)]) -> Vec<String> {
        let folder =
            std::env::temp_dir().join(format!("axisbridge-check-http-{}-{}", std::process::id(), http.len()));
        std::fs::create_dir_all(&folder).unwrap();
        for (name, bytes, mode) in files {
            std::fs::write(folder.join(name), bytes).unwrap();
            std::fs::set_permissions(folder.join(name), std::fs::Permissions::from_mode(*mode)).unwrap();
        }
        let example = include_str!("../../../examples/two-axes-in-process.toml");
        let text = example.replacen("[[device]]", &format!("[http]\n{http}\n[[device]]"), 1);
        let config = folder.join("box.toml");
        std::fs::write(&config, text).unwrap();
        let outcome = check(&Request { config: Some(&config), mappings: &[], frames: false });
        std::fs::remove_dir_all(&folder).unwrap();
        let own = [code::HTTP_FILE, code::HTTP_FILE_ODD, code::HTTP_PLAIN];
        let list = outcome.tables.findings.list().iter().filter(|finding| own.contains(&finding.code));
        list.map(|finding| finding.to_string().lines().next().unwrap_or_default().to_owned()).collect()
    }

    #[test]
    fn good_private_files_are_silent_and_those_that_all_can_read_are_not() {
        let hash = hash("sixteen-letters!").unwrap();
        let certificate = include_bytes!("../../../tests/certificates/test-certificate.pem");
        let key = include_bytes!("../../../tests/certificates/test-key.pem");
        let all = "listen = \"192.0.2.1:80\"\ntoken = \"t\"\ncertificate = \"c\"\nkey = \"k\"";
        let files =
            |mode| [("t", hash.as_bytes(), mode), ("c", &certificate[..], 0o644), ("k", &key[..], mode)];
        assert_eq!(found(all, &files(0o640)), Vec::<String>::new());
        let said = |what: &str| format!("warning[AX0103]: every user of this host can read {what}");
        assert_eq!(found(all, &files(0o644)), [said("the hash of the token"), said("the private key")]);
        let other = include_bytes!("../../../tests/certificates/other-key.pem");
        let wrong = [("t", hash.as_bytes(), 0o600), ("c", &certificate[..], 0o644), ("k", &other[..], 0o600)];
        assert_eq!(found(all, &wrong), ["error[AX0102]: the private key cannot be used"]);
    }

    #[test]
    fn token_without_encryption_is_warned_of_where_it_crosses_a_network() {
        let hash = hash("sixteen-letters!").unwrap();
        let of = |listen: &str| {
            found(
                &format!("listen = \"{listen}\"\ntoken = \"t\"\nplain = true"),
                &[("t", hash.as_bytes(), 0o600)],
            )
        };
        assert_eq!(of("127.0.0.1:80"), Vec::<String>::new());
        let text = "warning[AX0104]: the token crosses the network to 192.0.2.1:80 without encryption";
        assert_eq!(of("192.0.2.1:80"), [text]);
    }
}
