//! Files that are replaced as a whole.

use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

/// Writes a new file and puts it in the place of the old one, so that a loss of power leaves the old one or the new one.
pub(crate) fn replace_file(path: &Path, text: &str) -> io::Result<()> {
    replace_with(path, text.as_bytes())
}

/// The same with bytes.
pub(crate) fn replace_with(path: &Path, bytes: &[u8]) -> io::Result<()> {
    replace_on(&mut Host { is_private: false }, path, bytes)
}

/// The same with a file that only this user can read.
pub(crate) fn replace_private(path: &Path, text: &str) -> io::Result<()> {
    replace_on(&mut Host { is_private: true }, path, text.as_bytes())
}

/// Creates a file that only this user can read, and that was not there before.
pub(crate) fn create_private(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).create_new(true).mode(0o600).open(path)
}

/// The steps of a replacement, so that a test can cut the power between any two of them.
pub(crate) trait Medium {
    /// A file that is written.
    type File;

    /// Creates an empty file.
    fn create(&mut self, path: &Path) -> io::Result<Self::File>;

    /// Writes bytes, which a loss of power may take away again.
    fn write(&mut self, file: &mut Self::File, bytes: &[u8]) -> io::Result<()>;

    /// Makes what was written last.
    fn sync(&mut self, file: &mut Self::File) -> io::Result<()>;

    /// Gives a file another name, in the place of the file that has it.
    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()>;
}

/// Replaces a file on a medium.
pub(crate) fn replace_on(medium: &mut impl Medium, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let new = new_name(path);
    let mut file = medium.create(&new)?;
    medium.write(&mut file, bytes)?;
    // Before the name: otherwise the name could last and the bytes not.
    medium.sync(&mut file)?;
    medium.rename(&new, path)
}

/// The name of the new file until it is whole.
fn new_name(path: &Path) -> PathBuf {
    let mut new = path.as_os_str().to_owned();
    new.push(".new");
    PathBuf::from(new)
}

/// The file system of the host.
struct Host {
    is_private: bool,
}

impl Medium for Host {
    type File = File;

    fn create(&mut self, path: &Path) -> io::Result<File> {
        if !self.is_private {
            return File::create(path);
        }
        // What was left by a replacement that did not end may be for others to read.
        let _ = std::fs::remove_file(path);
        create_private(path)
    }

    fn write(&mut self, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        file.write_all(bytes)
    }

    fn sync(&mut self, file: &mut File) -> io::Result<()> {
        file.sync_all()
    }

    fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
        std::fs::rename(from, to)
    }
}

#[cfg(test)]
pub(crate) mod power_cut {
    //! The file system of the host, with a cut of the power after a number of steps. Every byte is a step.

    use super::*;

    /// A medium whose power is cut.
    pub(crate) struct PowerCut {
        /// Steps that are still done.
        pub steps: usize,
        /// What was not synchronized loses everything, otherwise nothing: the two ends of what can be left.
        pub loses: bool,
        /// Files that are not synchronized: under the name that they have now.
        unsynced: Vec<PathBuf>,
    }

    impl PowerCut {
        pub(crate) fn after(steps: usize, loses: bool) -> Self {
            Self { steps, loses, unsynced: Vec::new() }
        }

        fn step(&mut self) -> io::Result<()> {
            match self.steps.checked_sub(1) {
                Some(left) => {
                    self.steps = left;
                    Ok(())
                }
                None => {
                    if self.loses {
                        for path in self.unsynced.drain(..) {
                            File::options().write(true).open(path)?.set_len(0)?;
                        }
                    }
                    Err(io::Error::other("the power is cut"))
                }
            }
        }
    }

    impl Medium for PowerCut {
        type File = (File, PathBuf);

        fn create(&mut self, path: &Path) -> io::Result<Self::File> {
            self.step()?;
            self.unsynced.push(path.to_owned());
            Ok((File::create(path)?, path.to_owned()))
        }

        fn write(&mut self, (file, _): &mut Self::File, bytes: &[u8]) -> io::Result<()> {
            for byte in bytes {
                self.step()?;
                file.write_all(&[*byte])?;
            }
            Ok(())
        }

        fn sync(&mut self, (_, path): &mut Self::File) -> io::Result<()> {
            self.step()?;
            self.unsynced.retain(|unsynced| unsynced != path);
            Ok(())
        }

        fn rename(&mut self, from: &Path, to: &Path) -> io::Result<()> {
            self.step()?;
            for unsynced in self.unsynced.iter_mut().filter(|unsynced| *unsynced == from) {
                to.clone_into(unsynced);
            }
            std::fs::rename(from, to)?;
            // After the last step the power is cut, too.
            if self.steps == 0 && self.loses {
                self.unsynced
                    .drain(..)
                    .try_for_each(|path| File::options().write(true).open(path)?.set_len(0))?;
            }
            Ok(())
        }
    }
}
