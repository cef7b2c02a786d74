//! The diagnostics bundle: all that somebody needs who is not at the machine, in one archive.
//!
//! | file | content |
//! |---|---|
//! | `version.txt` | program and host |
//! | `status.json` | as `axisbridge status --json` |
//! | `faults.json` | the history of faults |
//! | `log.jsonl` | the last lines of the log |
//! | `contacts.json`, `contact-N.pcapng` | the first contacts and their frames |
//! | `configuration.toml`, `check.txt` | keys and values of the file without comments and secrets, and what its check found |
//! | `doctor.txt` | kernel and clock of the host |
//! | `recording.pcapng` | the last seconds of all sides |
//! | `left-out.txt` | what could not be had, and why |

mod tar;

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::SystemTime;

use serde_json::json;

use self::tar::Archive;
use crate::config::Config;
use crate::doctor;
use crate::history::{Histories, LINES_MAX, LogQuery};
use crate::latest::Reader;
use crate::local::installation::Installation;
use crate::local::overview::Overview;
use crate::recording::{Recording, TakeError};
use crate::status::BoxStatus;
use crate::status::pulse::{Pulse, silence};
use crate::time::source::TimeView;

/// The folder in the archive.
const FOLDER: &str = "axisbridge-bundle";

/// Keys whose values are secrets.
const SECRETS: [&str; 5] = ["password", "passwd", "secret", "token", "private"];

/// The files that a gateway was started with.
#[derive(Debug, Clone, Default)]
pub struct Files {
    /// The text of the configuration.
    pub configuration: String,
    /// What its check found.
    pub findings: String,
}

impl Files {
    /// The configuration for all who see the page: its keys and values, without secrets and without comments, where people write what
    /// is not for everybody. `None` for what is no TOML.
    #[must_use]
    pub fn shown(&self) -> Option<String> {
        let table: toml::Table = toml::from_str(&without_secrets(&self.configuration)).ok()?;
        toml::to_string(&table).ok().filter(|text| !text.is_empty())
    }
}

/// A running gateway, as those see it that show it and make bundles of it.
#[derive(Debug)]
pub struct Sources {
    /// The configuration.
    pub config: Config,
    /// Its files.
    pub files: Files,
    /// The parts of the gateway by name.
    pub installation: Installation,
    /// The published status.
    pub status: Reader<BoxStatus>,
    /// Since when it is the same.
    pub pulse: Pulse,
    /// System time.
    pub time: TimeView,
    /// What has happened.
    pub histories: Histories,
    /// The rolling recording; `None` without one.
    pub recording: Option<Arc<Recording>>,
}

impl Sources {
    /// The whole gateway at this moment.
    #[must_use]
    pub fn overview(&self) -> Overview {
        let status = self.status.read();
        let silent = silence(&status, self.pulse.age(&status));
        Overview { silent, ..Overview::of(&self.installation, &status, &self.time.read()) }
    }

    /// The archive. It takes tens of milliseconds.
    ///
    /// # Errors
    /// [`TakeError::Busy`]: another recording is being made.
    pub fn bundle(&self) -> Result<Vec<u8>, TakeError> {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let mut archive = Archive::new(now.as_secs());
        let mut left_out = String::new();
        let mut file = |name: &str, content: &[u8]| archive.file(&format!("{FOLDER}/{name}"), content);
        // First of all: it alone can be refused.
        match self.recording.as_ref().map(|recording| recording.take(recording.span())) {
            Some(Ok(frames)) => file("recording.pcapng", &frames),
            Some(Err(TakeError::Busy)) => return Err(TakeError::Busy),
            Some(Err(error)) => _ = writeln!(left_out, "recording.pcapng: {error}"),
            None => left_out.push_str("recording.pcapng, contacts: `[recording]` has `seconds = 0`\n"),
        }
        file("version.txt", version().as_bytes());
        let overview = self.overview();
        // The objects have texts, numbers and lists, and nothing that JSON does not know.
        let pretty = |value: &serde_json::Value| serde_json::to_string_pretty(value).unwrap_or_default();
        file("status.json", pretty(&json!(overview)).as_bytes());
        file("faults.json", pretty(&json!(self.histories.faults.list(None))).as_bytes());
        file("log.jsonl", self.log().as_bytes());
        file("configuration.toml", self.files.shown().unwrap_or_default().as_bytes());
        file("check.txt", self.files.findings.as_bytes());
        file("doctor.txt", doctor::text(&doctor::look(&self.config)).as_bytes());
        if let Some(recording) = &self.recording {
            let contacts = recording.contacts();
            file("contacts.json", pretty(&json!(contacts)).as_bytes());
            for contact in contacts {
                match recording.take_contact(contact.number) {
                    Ok(frames) => file(&format!("contact-{}.pcapng", contact.number), &frames),
                    Err(error) => _ = writeln!(left_out, "contact-{}.pcapng: {error}", contact.number),
                }
            }
        }
        if !left_out.is_empty() {
            file("left-out.txt", left_out.as_bytes());
        }
        Ok(archive.finish())
    }

    /// The log, one object a line.
    fn log(&self) -> String {
        let all = LogQuery { lines: LINES_MAX, ..LogQuery::default() };
        let mut text = String::new();
        for event in self.histories.events.select(&all).events {
            let _ = writeln!(text, "{}", serde_json::to_string(&*event).unwrap_or_default());
        }
        text
    }
}

/// Program and host.
fn version() -> String {
    let kernel = std::fs::read_to_string("/proc/version").unwrap_or_default();
    format!("axisbridge {}\n{}\n{kernel}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH)
}

/// The text of a configuration in which the values of keys that name a secret are left out: from the key to the next line that
/// begins a key or a table.
fn without_secrets(text: &str) -> String {
    let mut out = String::new();
    let mut secret = false;
    for line in text.lines() {
        let key = line.split_once('=').map(|(key, _)| key.trim());
        let is_key = key.is_some_and(|key| {
            !key.is_empty() && key.chars().all(|one| one.is_ascii_alphanumeric() || "_-.\"' ".contains(one))
        });
        if is_key || line.trim_start().starts_with(['[', '#']) {
            secret = false;
        }
        // Also in an inline table, and in a comment.
        let lower = line.to_ascii_lowercase();
        let names = SECRETS.iter().any(|word| lower.contains(word));
        if names && line.contains('=') {
            secret = true;
            let key = line.split_once('=').map_or("", |(key, _)| key.trim_end());
            let _ = writeln!(out, "{key} = \"(left out)\"");
        } else if !secret {
            let _ = writeln!(out, "{line}");
        }
    }
    out
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::latest::latest;
    use crate::local::installation::tests::installation;
    use crate::recording::tests::recording;
    use crate::status::tests::distinct;
    use crate::time::status::tests::synchronized;

    /// Of a gateway that does not change.
    pub(crate) fn sources() -> Sources {
        let text = include_str!("../../../examples/two-axes-in-process.toml");
        let config = Config::parse(text, "two-axes-in-process.toml").unwrap();
        let (publisher, status) = latest(distinct());
        drop(publisher);
        Sources {
            config,
            files: Files { configuration: text.to_owned(), findings: String::new() },
            installation: installation(),
            status,
            pulse: Pulse::default(),
            time: TimeView::of(synchronized()),
            histories: Histories::default(),
            recording: Some(recording(None)),
        }
    }

    #[test]
    fn bundle_has_each_of_its_files() {
        let archive = sources().bundle().unwrap();
        let text = String::from_utf8_lossy(&archive);
        for name in [
            "recording.pcapng",
            "version.txt",
            "status.json",
            "faults.json",
            "log.jsonl",
            "configuration.toml",
            "check.txt",
            "doctor.txt",
            "contacts.json",
        ] {
            assert!(text.contains(&format!("axisbridge-bundle/{name}\0")), "{name}");
        }
        assert!(text.contains("listen = \"127.0.0.2\"") && text.contains("this host"));
        assert!(!text.contains("left-out.txt"));
        let without = Sources { recording: None, ..sources() };
        let text = String::from_utf8_lossy(&without.bundle().unwrap()).into_owned();
        assert!(text.contains("left-out.txt") && !text.contains("contacts.json"));
    }

    #[test]
    fn shown_configuration_keeps_its_meaning_and_loses_comments_and_secrets() {
        let files = |text: &str| Files { configuration: text.to_owned(), findings: String::new() };
        let text =
            "# ask Ann, password swordfish\n[box]\nname = \"cell # 4\" # behind the press\ntoken = \"abc\"\n";
        let expected = "[box]\nname = \"cell # 4\"\ntoken = \"(left out)\"\n";
        assert_eq!(files(text).shown().as_deref(), Some(expected));
        assert_eq!((files("[box\n").shown(), files("").shown()), (None, None));
        let example = include_str!("../../../examples/two-axes-in-process.toml");
        let plain = files(example).shown().unwrap();
        assert!(example.contains("\n# ") && !plain.lines().any(|line| line.starts_with('#')), "{plain}");
        assert_eq!(Config::parse(&plain, "").unwrap(), Config::parse(example, "").unwrap());
    }

    #[test]
    fn secrets_stay_out_and_everything_else_is_in() {
        let text = "[box]\nname = \"press\"\n\n[http]\nlisten = \"127.0.0.1:80\"\nadmin_Token = \"abc\"\n\
                    password = \"\"\"\nline one\nline two\"\"\"\nuse = { secret_key = \"x\" }\n[log]\nlevel = \"info\"\n\
                    # token = \"old\"\n";
        let expected = "[box]\nname = \"press\"\n\n[http]\nlisten = \"127.0.0.1:80\"\nadmin_Token = \"(left out)\"\n\
                        password = \"(left out)\"\nuse = \"(left out)\"\n[log]\nlevel = \"info\"\n# token = \"(left out)\"\n";
        assert_eq!(without_secrets(text), expected);
    }

    #[test]
    fn gateway_whose_cycle_thread_stands_is_not_healthy() {
        let mut status = distinct();
        status.buses[1].up = true;
        status.axes[1] = status.axes[0];
        let (publisher, status) = latest(status);
        let sources = Sources { status, ..sources() };
        assert!(sources.overview().is_healthy());
        std::thread::sleep(std::time::Duration::from_millis(1_100));
        assert!(!sources.overview().is_healthy(), "nothing was published for a second");
        drop(publisher);
    }
}
