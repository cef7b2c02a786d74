//! Contacts on disk: two files each, `000007.json` and `000007.pcapng`, in a folder of their own.

use std::io;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tracing::warn;

use super::Contact;
use crate::replace_file::{replace_file, replace_with};

const FORMAT: u32 = 1;

/// Bytes of a description; a real one has a few thousand.
const LEN_MAX: u64 = 256 * 1_024;

/// Files of the folder that are looked at.
const FILES_MAX: usize = 1_000;

/// A description in its file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Described {
    format: u32,
    contact: Contact,
}

/// The folder.
#[derive(Debug, Clone)]
pub(in crate::recording) struct Files {
    folder: PathBuf,
}

impl Files {
    /// The folder, which is made if it is not there, and the newest contacts in it, oldest first, each with the file of its
    /// frames. What cannot be read is logged.
    pub fn open(folder: PathBuf, most: usize) -> (Self, Vec<(Contact, Option<PathBuf>)>) {
        let files = Self { folder };
        let shown = files.folder.display();
        if let Err(error) = std::fs::create_dir_all(&files.folder) {
            warn!(%error, "the folder {shown} of the contacts cannot be made");
        }
        let mut contacts = Vec::new();
        for number in files.numbers() {
            match files.read(number) {
                Ok(contact) => {
                    let frames = files.path(number, "pcapng");
                    contacts.push((contact, frames.exists().then_some(frames)));
                }
                Err(error) => warn!(%error, "the contact {number} in {shown} cannot be read"),
            }
        }
        contacts.sort_by_key(|(contact, _)| contact.number);
        contacts.drain(..contacts.len().saturating_sub(most));
        (files, contacts)
    }

    /// Writes a contact, and its frames where there are any. It waits for the disk.
    pub fn write(&self, contact: &Contact, frames: Option<&[u8]>) -> io::Result<()> {
        let described = Described { format: FORMAT, contact: contact.clone() };
        if let Some(frames) = frames {
            replace_with(&self.path(contact.number, "pcapng"), frames)?;
        }
        replace_file(&self.path(contact.number, "json"), &serde_json::to_string(&described)?)
    }

    /// Removes the files of all contacts but these.
    pub fn retain(&self, numbers: &[u64]) {
        for number in self.numbers().into_iter().filter(|number| !numbers.contains(number)) {
            for kind in ["pcapng", "json"] {
                let _ = std::fs::remove_file(self.path(number, kind));
            }
        }
    }

    fn read(&self, number: u64) -> Result<Contact, String> {
        let path = self.path(number, "json");
        let len = std::fs::metadata(&path).map_err(|error| error.to_string())?.len();
        if len > LEN_MAX {
            return Err(format!("it has {len} bytes, expected at most {LEN_MAX}"));
        }
        let text = std::fs::read_to_string(&path).map_err(|error| error.to_string())?;
        let described: Described = serde_json::from_str(&text).map_err(|error| error.to_string())?;
        if (described.format, described.contact.number) != (FORMAT, number) {
            let Described { format, contact } = described;
            return Err(format!(
                "expected format {FORMAT}, number {number}, found {format}, {}",
                contact.number
            ));
        }
        Ok(described.contact)
    }

    /// The contacts that have a description.
    fn numbers(&self) -> Vec<u64> {
        let Ok(folder) = std::fs::read_dir(&self.folder) else { return Vec::new() };
        let number =
            |entry: std::fs::DirEntry| entry.file_name().to_str()?.strip_suffix(".json")?.parse().ok();
        folder.flatten().take(FILES_MAX).filter_map(number).collect()
    }

    fn path(&self, number: u64, kind: &str) -> PathBuf {
        self.folder.join(format!("{number:06}.{kind}"))
    }
}
