//! Torque and force as a person writes them: a decimal number and a unit, such as `2.5 Nm`, `200 N`.

use profile_generic::scaling::UnitKind;

use crate::mapping::Rated;

/// What [`parse`] expects, for error messages.
pub(super) const EXPECTED: &str = "expected a number above 0 and a unit, such as \"2.5 Nm\" or \"200 N\"";

/// Digits behind the point that count: a millionth.
const DECIMALS: usize = 6;

/// Reads it exactly; `None` when it is none, is finer than a millionth, zero, or too large for 64 bits.
pub(super) fn parse(text: &str) -> Option<Rated> {
    let text = text.trim();
    let digits = text.find(|character: char| !character.is_ascii_digit() && character != '.')?;
    let (number, unit) = text.split_at(digits);
    let kind = match unit.trim_start() {
        "Nm" => UnitKind::Rotary,
        "N" => UnitKind::Linear,
        _ => return None,
    };
    let (whole, fraction) =
        number.split_once('.').map_or((number, "0"), |(whole, fraction)| (whole, fraction));
    let trimmed = fraction.trim_end_matches('0');
    let plain = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if fraction.is_empty() || trimmed.len() > DECIMALS || !plain(whole) || !plain(fraction) {
        return None;
    }
    let whole: i64 = whole.parse().ok()?;
    let fraction: i64 = format!("{trimmed:0<DECIMALS$}").parse().ok()?;
    let value = whole.checked_mul(1_000_000)?.checked_add(fraction)?;
    (value > 0).then_some(Rated { kind, value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torques_and_forces_are_read_exactly() {
        for (text, kind, value) in [
            ("2.5 Nm", UnitKind::Rotary, 2_500_000),
            ("200N", UnitKind::Linear, 200_000_000),
            (" 0.000001 Nm ", UnitKind::Rotary, 1),
            ("1.50 N", UnitKind::Linear, 1_500_000),
        ] {
            assert_eq!(parse(text), Some(Rated { kind, value }), "{text}");
        }
        for text in [
            "",
            "2.5",
            "Nm",
            "0 N",
            "-1 Nm",
            "2,5 Nm",
            "1. Nm",
            ".5 Nm",
            "1.0000001 N",
            "1.2.3 N",
            "1 kN",
            "9300000000000 N",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
