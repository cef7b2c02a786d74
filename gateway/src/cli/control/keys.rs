//! Keys of a terminal in raw mode.

/// What a key means while an axis is jogged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// Right arrow, `+`, `l`: jog forward.
    Forward,
    /// Left arrow, `-`, `h`: jog backward.
    Backward,
    /// `q`, Ctrl-C, Ctrl-D: the end.
    Quit,
    /// Every other key: brake.
    Stop,
}

/// The keys of what was read at once. A sequence that is cut off at the end counts as [`Key::Stop`].
pub fn keys(bytes: &[u8]) -> Vec<Key> {
    let mut keys = Vec::new();
    let mut rest = bytes;
    while let [first, after @ ..] = rest {
        let (key, next) = match (first, after) {
            (0x1B, [b'[' | b'O', b'C', next @ ..]) => (Key::Forward, next),
            (0x1B, [b'[' | b'O', b'D', next @ ..]) => (Key::Backward, next),
            // Another sequence: up to its last byte, which is a letter or a tilde.
            (0x1B, [b'[' | b'O', next @ ..]) => {
                let end = next.iter().position(|byte| (0x40..0x7F).contains(byte));
                (Key::Stop, end.map_or(&[][..], |end| &next[end + 1..]))
            }
            (b'+' | b'l', next) => (Key::Forward, next),
            (b'-' | b'h', next) => (Key::Backward, next),
            (b'q' | 3 | 4, next) => (Key::Quit, next),
            (_, next) => (Key::Stop, next),
        };
        keys.push(key);
        rest = next;
    }
    keys
}

#[cfg(test)]
mod tests {
    use super::Key::{Backward, Forward, Quit, Stop};
    use super::*;

    #[test]
    fn arrows_and_letters_jog_and_every_other_key_brakes() {
        assert_eq!(keys(b"\x1b[C\x1b[C\x1bOC+l"), [Forward; 5]);
        assert_eq!(keys(b"\x1b[D\x1bOD-h"), [Backward; 4]);
        assert_eq!(keys(b"q\x03\x04"), [Quit; 3]);
        assert_eq!(keys(b" \x1b[A\x1b[15~x"), [Stop; 4]);
        assert_eq!(keys(b"\x1b[1;5C+"), [Stop, Forward], "with Ctrl it is another key");
    }

    #[test]
    fn what_is_cut_off_brakes() {
        for bytes in [&b"\x1b"[..], b"\x1b[", b"\x1b[1;", b"\x1bO", "ä".as_bytes()] {
            assert!(keys(bytes).iter().all(|key| *key == Stop), "{bytes:?}");
            assert!(!keys(bytes).is_empty());
        }
        assert_eq!(keys(b""), []);
    }
}
