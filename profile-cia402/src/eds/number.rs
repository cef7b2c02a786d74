//! Whole numbers as data sheets write them.

use core::fmt;

/// A whole number, to which the node-ID may have to be added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Number {
    pub value: i128,
    pub plus_node: bool,
    /// Whether it is written as a bit pattern: hexadecimal or octal.
    pub pattern: bool,
}

/// What a whole number looks like.
pub(super) const EXPECTED: &str = "a number (0x hexadecimal, 0 octal, decimal)";

/// Why a text is no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NotANumber;

impl fmt::Display for NotANumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(EXPECTED)
    }
}

/// Reads `0x1F`, `31`, `-5`, `037`, `$NODEID`, `$NODEID+0x200`, `0x200 + $NODEID`.
pub(super) fn parse(text: &str) -> Result<Number, NotANumber> {
    let mut sum: Option<Number> = None;
    for part in text.split('+') {
        let part = part.trim();
        let next = if part.eq_ignore_ascii_case("$NODEID") {
            Number { value: 0, plus_node: true, pattern: true }
        } else {
            let (value, pattern) = plain(part)?;
            Number { value, plus_node: false, pattern }
        };
        sum = Some(match sum {
            None => next,
            Some(before) if before.plus_node != next.plus_node => {
                Number { value: before.value + next.value, plus_node: true, pattern: true }
            }
            // Two numbers, or the node-ID twice.
            Some(_) => return Err(NotANumber),
        });
    }
    sum.ok_or(NotANumber)
}

/// Reads a number without the node-ID.
pub(super) fn plain(text: &str) -> Result<(i128, bool), NotANumber> {
    let (negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text),
    };
    let (radix, digits) = match digits.as_bytes() {
        [b'0', b'x' | b'X', ..] => (16, &digits[2..]),
        [b'0', _, ..] => (8, &digits[1..]),
        _ => (10, digits),
    };
    // Neither a second sign nor more digits than a value of 64 bits can have.
    let plausible = digits.bytes().all(|byte| byte.is_ascii_hexdigit()) && digits.len() <= 24;
    if !plausible {
        return Err(NotANumber);
    }
    let value = i128::from_str_radix(digits, radix).map_err(|_| NotANumber)?;
    Ok((if negative { -value } else { value }, radix != 10))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_every_base_and_order() {
        let read = |text| parse(text).map(|number| (number.value, number.plus_node));
        for (text, value, plus_node) in [
            ("0", 0, false),
            ("00", 0, false),
            ("31", 31, false),
            ("0x1F", 31, false),
            ("0X1f", 31, false),
            ("037", 31, false),
            ("-5", -5, false),
            ("-0x5", -5, false),
            ("0xFFFFFFFFFFFFFFFF", i128::from(u64::MAX), false),
            ("18446744073709551615", i128::from(u64::MAX), false),
            ("$NODEID", 0, true),
            ("$nodeid+0x200", 0x200, true),
            ("$NODEID + 0x200", 0x200, true),
            ("0x200+$NODEID", 0x200, true),
            ("512 + $NodeId", 512, true),
        ] {
            assert_eq!(read(text), Ok((value, plus_node)), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_is_none() {
        for text in [
            "",
            " ",
            "-",
            "0x",
            "0xG",
            "08",
            "1.5",
            "12h",
            "--1",
            "+1",
            "1+",
            "0x-1",
            "$NODE",
            "$NODEID+",
            "$NODEID+$NODEID",
            "1+2",
            "0x1+0x2+$NODEID",
            "1 2",
            "99999999999999999999999999999999",
            "ä",
        ] {
            assert_eq!(parse(text), Err(NotANumber), "{text}");
        }
    }
}
