//! Lists of frames as text: one a line, in hexadecimal, with comments.
//!
//! ```text
//! # what follows a number sign is a comment
//! 06 02 10 00 ...                   a frame, a datagram or an update
//! at drive-a 08 c0 00 00 ...        what a SERCOS drive sent in a cycle, without C-CON
//! idn drive-a S-0-0011 04 00        element 7 of a parameter, as the drive gives it
//! can 183 27 16 08 00 ...           a CAN frame: a PDO or EMCY of a drive, SYNC
//! devicenet 42d 00 02 02 01 ...     a frame of DeviceNet: of a poll or its answer
//! object drive-c 603F:00 20 23      an object, as the drive gives it
//! set turntable 473 00 00 20 41     the controller sets an attribute
//! writes turntable 431 491          the attributes of the controller's cyclic write data
//! restart                           forgets what the frames before have reported
//! ```

use profile_generic::can::{Frame, Id};
use profile_sercos::wire::idn::Idn;

use crate::mapping::{Item, Object};

/// The longest frame.
const BYTES_MAX: usize = 1600;

/// What a line of a list means.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Line<'t> {
    /// A frame, a datagram or an update.
    Frame(Vec<u8>),
    /// Values of a drive.
    Actual {
        /// Name of the drive.
        drive: &'t str,
        /// What it sent, without C-CON.
        bytes: Vec<u8>,
    },
    /// A parameter of a drive.
    Held {
        /// Name of the drive.
        drive: &'t str,
        /// Which.
        item: Item,
        /// Element 7, or the value of the object.
        bytes: Vec<u8>,
    },
    /// A frame of CANopen.
    Can(Frame),
    /// A frame of DeviceNet.
    Devicenet(Frame),
    /// What the frames before have reported is forgotten.
    Restart,
    /// The list of an axis's cyclic write data.
    Writes {
        /// Name of the axis.
        axis: &'t str,
        /// Numbers of the attributes.
        attributes: Vec<u16>,
    },
    /// An attribute of an axis.
    Set {
        /// Name of the axis.
        axis: &'t str,
        /// Number of the attribute.
        attribute: u16,
        /// The value.
        bytes: Vec<u8>,
    },
}

/// What is wrong with a line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct LineError {
    /// Column in characters, 1 first.
    pub column: usize,
    /// What was expected and what came.
    pub message: String,
}

impl<'t> Line<'t> {
    /// Reads a line; `None` for one without a frame.
    ///
    /// # Errors
    /// Where it cannot be read, and why.
    pub fn parse(text: &'t str) -> Result<Option<Self>, LineError> {
        let code = text.split('#').next().unwrap_or_default();
        let mut words = Words { line: text, rest: code };
        let Some(first) = words.next() else { return Ok(None) };
        Ok(Some(match first {
            "at" => {
                let drive = words.expect("the name of a drive")?;
                Self::Actual { drive, bytes: words.bytes()? }
            }
            "idn" => {
                let drive = words.expect("the name of a drive")?;
                let word = words.expect("a parameter, as S-0-0011")?;
                let idn: Idn = word.parse().map_err(|_| words.error(word, "a parameter, as S-0-0011"))?;
                Self::Held { drive, item: idn.into(), bytes: words.bytes()? }
            }
            "object" => {
                let drive = words.expect("the name of a drive")?;
                let word = words.expect("an object, as 603F:00")?;
                let object = Object::parse(word).ok_or_else(|| words.error(word, "an object, as 603F:00"))?;
                Self::Held { drive, item: Item::Object(object), bytes: words.bytes()? }
            }
            "can" | "devicenet" => {
                let word = words.expect("an identifier, as 183")?;
                let wanted = "an identifier of 11 bits in hexadecimal, as 183";
                let id = u16::from_str_radix(word, 16).map_err(|_| words.error(word, wanted))?;
                let bytes = words.bytes()?;
                let frame = Frame::new(Id::Standard(id), &bytes);
                let frame =
                    frame.map_err(|_| words.error(word, "an identifier up to 7FF, and at most 8 bytes"))?;
                if first == "can" { Self::Can(frame) } else { Self::Devicenet(frame) }
            }
            "set" => {
                let axis = words.expect("the name of an axis")?;
                let word = words.expect("the number of an attribute")?;
                let attribute =
                    word.parse().map_err(|_| words.error(word, "the number of an attribute, 0 to 65535"))?;
                Self::Set { axis, attribute, bytes: words.bytes()? }
            }
            "writes" => {
                let axis = words.expect("the name of an axis")?;
                let mut attributes = Vec::new();
                while let Some(word) = words.next() {
                    let number = word.parse();
                    attributes.push(
                        number.map_err(|_| words.error(word, "the number of an attribute, 0 to 65535"))?,
                    );
                }
                Self::Writes { axis, attributes }
            }
            "restart" => match words.next() {
                None => Self::Restart,
                Some(word) => return Err(words.error(word, "the end of the line")),
            },
            _ => {
                words.rest = code;
                Self::Frame(words.bytes()?)
            }
        }))
    }
}

/// The words of a line.
struct Words<'t> {
    line: &'t str,
    rest: &'t str,
}

impl<'t> Words<'t> {
    fn next(&mut self) -> Option<&'t str> {
        self.rest = self.rest.trim_start();
        let end = self.rest.find(char::is_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    fn expect(&mut self, what: &str) -> Result<&'t str, LineError> {
        self.next().ok_or_else(|| {
            let column = self.line.split('#').next().unwrap_or_default().trim_end().chars().count() + 1;
            LineError { column, message: format!("expected {what}, got the end of the line") }
        })
    }

    fn error(&self, word: &str, what: &str) -> LineError {
        // The word is a part of the line.
        let at = (word.as_ptr() as usize).saturating_sub(self.line.as_ptr() as usize);
        let column = self.line.get(..at).map_or(1, |before| before.chars().count() + 1);
        LineError { column, message: format!("expected {what}, got `{word}`") }
    }

    /// The rest of the line: pairs of hexadecimal digits, with or without blanks between them.
    fn bytes(&mut self) -> Result<Vec<u8>, LineError> {
        let mut bytes = Vec::new();
        while let Some(word) = self.next() {
            let digits = word.strip_prefix("0x").unwrap_or(word);
            let whole = digits.len() % 2 == 0 && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
            if !whole {
                return Err(self.error(word, "pairs of hexadecimal digits"));
            }
            if bytes.len() + digits.len() / 2 > BYTES_MAX {
                return Err(self.error(word, "at most 1600 bytes"));
            }
            let pairs = (0..digits.len()).step_by(2).filter_map(|at| digits.get(at..at + 2));
            bytes.extend(pairs.filter_map(|pair| u8::from_str_radix(pair, 16).ok()));
        }
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_kind_of_line() {
        let parse = |text| Line::parse(text).unwrap();
        assert_eq!(parse("  # nothing"), None);
        assert_eq!(parse("06 02 1000 # a frame"), Some(Line::Frame(vec![6, 2, 0x10, 0])));
        assert_eq!(parse("at d 08c0"), Some(Line::Actual { drive: "d", bytes: vec![8, 0xC0] }));
        let idn = Idn::standard(11);
        let held = |item, bytes| Some(Line::Held { drive: "d", item, bytes });
        assert_eq!(parse("idn d S-0-0011 04 00"), held(idn.into(), vec![4, 0]));
        assert_eq!(parse("object d 603F:00 20 23 # I2t"), held(Item::object(0x603F, 0), vec![0x20, 0x23]));
        let frame = Frame::new(Id::Standard(0x183), &[0x27, 6, 8]).unwrap();
        assert_eq!(parse("can 183 2706 08"), Some(Line::Can(frame)));
        assert_eq!(parse("devicenet 183 2706 08"), Some(Line::Devicenet(frame)));
        let set = Line::Set { axis: "a", attribute: 473, bytes: vec![0, 0, 0x20, 0x41] };
        assert_eq!(parse("set a 473 0x00002041"), Some(set));
        assert_eq!(
            parse("writes a 431 491 # two"),
            Some(Line::Writes { axis: "a", attributes: vec![431, 491] })
        );
        assert_eq!(parse("writes a"), Some(Line::Writes { axis: "a", attributes: vec![] }));
        assert_eq!(parse("restart # anew"), Some(Line::Restart));
    }

    #[test]
    fn errors_have_their_column() {
        let cases = [
            ("06 0g", 4, "expected pairs of hexadecimal digits, got `0g`"),
            ("at", 3, "expected the name of a drive, got the end of the line"),
            ("idn d 11 00", 7, "expected a parameter, as S-0-0011, got `11`"),
            ("object d 603F 00", 10, "expected an object, as 603F:00, got `603F`"),
            ("can 18g 00", 5, "expected an identifier of 11 bits in hexadecimal, as 183, got `18g`"),
            ("can 800 00", 5, "expected an identifier up to 7FF, and at most 8 bytes, got `800`"),
            (
                "can 183 000102030405060708",
                5,
                "expected an identifier up to 7FF, and at most 8 bytes, got `183`",
            ),
            ("set a 65536 00", 7, "expected the number of an attribute, 0 to 65535, got `65536`"),
            ("writes a 431 x", 14, "expected the number of an attribute, 0 to 65535, got `x`"),
            ("writes", 7, "expected the name of an axis, got the end of the line"),
            ("restart now", 9, "expected the end of the line, got `now`"),
            ("06 021", 4, "expected pairs of hexadecimal digits, got `021`"),
        ];
        for (text, column, message) in cases {
            let error = Line::parse(text).unwrap_err();
            assert_eq!((error.column, error.message.as_str()), (column, message), "{text}");
        }
        let long = "00 ".repeat(1601);
        assert_eq!(Line::parse(&long).unwrap_err().column, 4801);
    }

    proptest! {
        #[test]
        fn any_text_is_survived(text in ".{0,80}") {
            let _ = Line::parse(&text);
        }
    }
}
