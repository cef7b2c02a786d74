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
            Ok(_) => list.is_private(key, "token", path),
            Err(BadToken::Read(error)) => list.unread(key, "token", &error),
            Err(error) => list.push(code::HTTP_FILE, key, "token", "this is not the hash of a token", error),
        }
    }
    if let (Some(certificate), Some(key), Some(files)) = (&table.certificate, &table.key, &http.tls) {
        match tls::read(files) {
            Ok(_) => {}
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
        list.is_private(key, "key", &files.key);
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
    fn is_private(&mut self, place: &Spanned<String>, key: &str, path: &Path) {
        let mode = std::fs::metadata(path).map_or(0, |metadata| metadata.permissions().mode() & 0o777);
        if mode & OF_OTHERS != 0 {
            let why = format!("expected mode 0600, got {mode:04o}");
            self.push(code::HTTP_FILE_ODD, place, key, "every user of this host can read the file", why);
        }
    }
}
