//! Writes archives in the format of POSIX `ustar`: for each file a block of 512 bytes with its name, then its bytes.
//!
//! | offset | size | field |
//! |---|---|---|
//! | 0 | 100 | name |
//! | 100 | 8 | mode, octal |
//! | 108 | 8, 8 | owner and group, octal |
//! | 124 | 12 | bytes of the file, octal |
//! | 136 | 12 | time, seconds since 1970, octal |
//! | 148 | 8 | sum of the bytes of the block, with blanks in its own place, octal |
//! | 156 | 1 | type, `0` for a file |
//! | 257 | 8 | `ustar`, zero, version `00` |

const BLOCK: usize = 512;
const NAME_MAX: usize = 100;

/// An archive that is being written.
#[derive(Debug)]
pub(super) struct Archive {
    bytes: Vec<u8>,
    seconds: u64,
}

impl Archive {
    /// An empty archive; its files are from this time, seconds since 1970.
    pub fn new(seconds: u64) -> Self {
        Self { bytes: Vec::new(), seconds }
    }

    /// Adds a file. A name is cut to 100 bytes.
    pub fn file(&mut self, name: &str, content: &[u8]) {
        let mut head = [0; BLOCK];
        let mut put = |at: usize, text: &[u8]| head[at..at + text.len()].copy_from_slice(text);
        put(0, &name.as_bytes()[..name.len().min(NAME_MAX)]);
        put(100, b"0000644\0");
        put(108, b"0000000\0");
        put(116, b"0000000\0");
        put(124, format!("{:011o}\0", content.len()).as_bytes());
        put(136, format!("{:011o}\0", self.seconds).as_bytes());
        put(148, b"        ");
        put(156, b"0");
        put(257, b"ustar\x0000");
        let sum: u32 = head.iter().map(|byte| u32::from(*byte)).sum();
        head[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
        self.bytes.extend(head);
        self.bytes.extend(content);
        self.bytes.resize(self.bytes.len().next_multiple_of(BLOCK), 0);
    }

    /// Ends the archive with two empty blocks.
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.resize(self.bytes.len() + 2 * BLOCK, 0);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    fn tar_of_the_host_lists_and_extracts_the_files() {
        let mut archive = Archive::new(1_769_860_800);
        archive.file("bundle/a.txt", b"hello");
        archive.file("bundle/empty", b"");
        archive.file("bundle/block", &[7; BLOCK]);
        let bytes = archive.finish();
        assert_eq!(bytes.len(), (2 + 1 + 2 + 2) * BLOCK);
        let tar = |words: &[&str]| {
            let mut child = Command::new("tar")
                .args(words)
                .env("TZ", "UTC")
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .expect("tar is there");
            child.stdin.take().unwrap().write_all(&bytes).unwrap();
            let output = child.wait_with_output().unwrap();
            assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
            output.stdout
        };
        let list = String::from_utf8(tar(&["-tvf", "-"])).unwrap();
        let lines: Vec<Vec<&str>> = list.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[0], ["-rw-r--r--", "0/0", "5", "2026-01-31", "12:00", "bundle/a.txt"]);
        assert_eq!((lines[1][2], lines[2][2], lines.len()), ("0", "512", 3));
        assert_eq!(
            tar(&["-xOf", "-", "bundle/a.txt", "bundle/block"]),
            [&b"hello"[..], &[7; BLOCK]].concat()
        );
    }
}
