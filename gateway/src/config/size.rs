//! Sizes as a person writes them: a whole number and a unit, such as `16 MB`.

/// What [`parse`] expects, for error messages.
pub(crate) const EXPECTED: &str = "a whole number and a unit, such as \"16 MB\" (units: kB, MB, GB)";

/// Reads a number of bytes; `None` when it is none, or too large.
pub(crate) fn parse(text: &str) -> Option<usize> {
    let text = text.trim();
    let digits = text.find(|character: char| !character.is_ascii_digit())?;
    let (number, unit) = text.split_at(digits);
    let scale: usize = match unit.trim_start() {
        "kB" => 1_000,
        "MB" => 1_000_000,
        "GB" => 1_000_000_000,
        _ => return None,
    };
    number.parse::<usize>().ok()?.checked_mul(scale)
}

/// Writes a size in the largest unit that needs no decimals.
pub(crate) fn show(bytes: usize) -> String {
    for (scale, unit) in [(1_000_000_000, "GB"), (1_000_000, "MB")] {
        if bytes != 0 && bytes.is_multiple_of(scale) {
            return format!("{} {unit}", bytes / scale);
        }
    }
    format!("{} kB", bytes / 1_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_shown() {
        for (text, bytes) in
            [("16 MB", 16_000_000), ("2MB", 2_000_000), (" 1 GB ", 1_000_000_000), ("7 kB", 7_000)]
        {
            assert_eq!(parse(text), Some(bytes), "{text}");
            assert_eq!(parse(&show(bytes)), Some(bytes));
        }
        for text in [
            "",
            "16",
            "MB",
            "1.5 MB",
            "-1 MB",
            "16 MiB",
            "16 mb",
            "99999999999999999999 kB",
            "18446744073709551615 GB",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
