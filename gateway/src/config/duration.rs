//! Times as a person writes them: a decimal number and a unit, such as `2 ms`, `31.25 us`, `1 s`.

use profile_generic::time::DurationNs;

/// What [`parse`] expects, for error messages.
pub(crate) const EXPECTED: &str = "a number and a unit, such as \"2 ms\" (units: ns, us, ms, s)";

/// Reads a time exactly; `None` when it is not one, is finer than a nanosecond or too long for 64 bits.
pub(crate) fn parse(text: &str) -> Option<DurationNs> {
    let text = text.trim();
    let digits = text.find(|character: char| !character.is_ascii_digit() && character != '.')?;
    let (number, unit) = text.split_at(digits);
    // Nanoseconds in the unit, and how many decimals it can have.
    let (scale, decimals) = match unit.trim_start() {
        "ns" => (1, 0),
        "us" | "µs" => (1_000, 3),
        "ms" => (1_000_000, 6),
        "s" => (1_000_000_000, 9),
        _ => return None,
    };
    let (whole, fraction) = number.split_once('.').map_or((number, None), |(a, b)| (a, Some(b)));
    let whole: i64 = whole.parse().ok()?;
    let mut total = whole.checked_mul(scale)?;
    if let Some(fraction) = fraction {
        let fraction_trimmed = fraction.trim_end_matches('0');
        if fraction.is_empty() || fraction_trimmed.len() > decimals {
            return None;
        }
        let mut place = scale;
        for digit in fraction_trimmed.bytes() {
            place /= 10;
            let digit = digit.checked_sub(b'0').filter(|digit| *digit <= 9)?;
            total = total.checked_add(i64::from(digit) * place)?;
        }
    }
    Some(DurationNs(total))
}

/// Writes a time in the largest unit that needs no decimals.
pub(crate) fn show(time: DurationNs) -> String {
    let nanoseconds = time.0;
    for (scale, unit) in [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")] {
        if nanoseconds != 0 && nanoseconds % scale == 0 {
            return format!("{} {unit}", nanoseconds / scale);
        }
    }
    format!("{nanoseconds} ns")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_exactly() {
        for (text, nanoseconds) in [
            ("2 ms", 2_000_000),
            ("2ms", 2_000_000),
            (" 31.25 us ", 31_250),
            ("31250 ns", 31_250),
            ("0.000000001 s", 1),
            ("1.50 s", 1_500_000_000),
            ("1.0 ns", 1),
            ("250 µs", 250_000),
            ("9223372036854775807 ns", i64::MAX),
            ("0 s", 0),
        ] {
            assert_eq!(parse(text), Some(DurationNs(nanoseconds)), "{text}");
        }
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in [
            "",
            "2",
            "ms",
            "2 min",
            "-2 ms",
            "2,5 ms",
            "1.5 ns",
            "0.0000000001 s",
            "2. ms",
            ".5 ms",
            "1.2.3 s",
            "2 ms x",
            "9223372036854775808 ns",
            "9223372037 s",
            "1e3 us",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    #[test]
    fn times_are_shown_in_the_largest_whole_unit() {
        for text in ["2 ms", "31250 ns", "250 us", "1 s", "0 ns"] {
            assert_eq!(show(parse(text).unwrap()), text);
        }
    }
}
