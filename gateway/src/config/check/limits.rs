//! `limits` of an `[[axis]]`.

use profile_generic::quantity::{Acceleration, Position, Torque, Velocity};
use profile_generic::ratio::Ratio;

use super::value::NANO;
use super::{Problems, value};
use crate::config::Limits;
use crate::config::file::LimitsTable;
use crate::finding::registry as code;
use crate::finding::{Problem, Spanned};

/// Percent to parts per million.
const PERCENT_TO_PPM: Option<Ratio> = Ratio::new(10_000, 1);

pub(super) fn check(
    problems: &mut Problems,
    table: &LimitsTable,
    unwind: Option<&Spanned<i64>>,
) -> Option<Limits> {
    // Axis units to 1e-9 of them; percent to parts per million.
    let velocity = value::positive(problems, &table.velocity, "the velocity limit", NANO);
    let acceleration = value::positive(problems, &table.acceleration, "the acceleration limit", NANO);
    let torque = value::positive(problems, &table.torque_percent, "the torque limit", PERCENT_TO_PPM);
    let following_error =
        value::positive(problems, &table.following_error, "the following error limit", NANO);
    let position = position_range(problems, table, unwind);
    let (position_min, position_max) = position?;
    Some(Limits {
        position_min,
        position_max,
        velocity: velocity?.map(Velocity),
        acceleration: acceleration?.map(Acceleration),
        torque: torque?.map(Torque),
        following_error: following_error?.map(Position),
    })
}

fn position_range(
    problems: &mut Problems,
    table: &LimitsTable,
    unwind: Option<&Spanned<i64>>,
) -> Option<(Option<Position>, Option<Position>)> {
    let (min, max) = match (&table.position_min, &table.position_max) {
        (None, None) => return Some((None, None)),
        (Some(min), Some(max)) => (min, max),
        (Some(lone), None) | (None, Some(lone)) => {
            return problems.report_as(
                code::CONTRADICTION,
                lone.span(),
                "one position limit without the other",
                "expected both position_min and position_max, or neither",
            );
        }
    };
    if let Some(unwind) = unwind {
        let problem = Problem::new(code::CONTRADICTION, min.span());
        let problem = problem.title("an axis without ends has no position limits");
        let problem = problem.expected("expected no position_min and position_max");
        problems.push(problem.related(unwind.span(), "the axis starts anew after these counts"));
        return None;
    }
    let low = value::fine(problems, min, "the position limit", NANO)?;
    let high = value::fine(problems, max, "the position limit", NANO)?;
    if low >= high {
        return problems.report_as(
            code::CONTRADICTION,
            max.span(),
            format_args!("position_max {} is not above position_min {}", max.get_ref(), min.get_ref()),
            "expected more than position_min",
        );
    }
    Some((Some(Position(low)), Some(Position(high))))
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    #[test]
    fn limits_are_read_in_fine_units() {
        let text = "position_min = -1.5\nposition_max = 2.0\ntorque_percent = 150.0";
        let limits = checked(text, |problems, table| check(problems, table, None)).unwrap();
        let expected = Limits {
            position_min: Some(Position(-1_500_000_000)),
            position_max: Some(Position(2_000_000_000)),
            torque: Some(Torque(1_500_000)),
            ..Limits::default()
        };
        assert_eq!(limits, expected);
    }

    #[test]
    fn position_limits_come_in_pairs_in_order_and_not_on_a_modulo_axis() {
        let unwind = Spanned::new(0..1, 1000);
        let both = "position_min = 1.0\nposition_max = 2.0";
        for (text, unwind, title) in [
            ("position_min = 1.0", None, "one position limit without the other"),
            (both, Some(&unwind), "an axis without ends has no position limits"),
            ("position_min = 2.0\nposition_max = 2.0", None, "position_max 2 is not above position_min 2"),
            ("velocity = 0.0", None, "the velocity limit is 0"),
        ] {
            let found = checked(text, |problems, table| check(problems, table, unwind));
            assert_eq!(found, Err(vec![title.to_owned()]));
        }
    }
}
