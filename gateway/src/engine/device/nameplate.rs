//! What the nameplate in the configuration says and the drive shows too: the drive counts, and a difference is reported, as one of both
//! is of another motor.

use arrayvec::ArrayVec;
use profile_generic::parameter::Parameter;

use crate::engine::access::{Access, AccessFailure, Data};
use crate::engine::axis::AxisChannel;
use crate::engine::notice::Notice;
use crate::mapping::{AttributeEntry, AttributeTable, Backing, DATA_MAX};

/// The part of a value by which drives round it.
const ROUNDED: i128 = 200;

/// The values that are still to be compared.
#[derive(Debug, Default)]
pub(super) struct NameplateCheck {
    left: ArrayVec<(Parameter, i64), DATA_MAX>,
    asked: Option<(Parameter, i64)>,
    /// The program of the drive that they are of.
    programs: u64,
}

impl NameplateCheck {
    /// Begins anew with another program of the drive, and asks it for the next value.
    pub fn advance(&mut self, axis: &AxisChannel, ask: impl FnOnce(&Access) -> bool) {
        let Some(program) = axis.south() else { return };
        if self.programs != axis.programs() {
            self.programs = axis.programs();
            let reads =
                |parameter| program.parameter(parameter).is_some_and(|held| held.from_drive.is_some());
            self.left = axis
                .data()
                .iter()
                .filter(|(parameter, _)| reads(*parameter))
                .copied()
                .take(DATA_MAX)
                .collect();
        }
        if self.asked.is_some() {
            return;
        }
        let Some((parameter, configured)) = self.left.last().copied() else { return };
        let Some(held) = program.parameter(parameter) else { return };
        if ask(&Access::read(held.item)) {
            self.left.pop();
            self.asked = Some((parameter, configured));
        }
    }

    /// Takes the answer of the drive. What it does not give is not compared.
    pub fn take(
        &mut self,
        result: Result<&Data, AccessFailure>,
        (axis, number): (&AxisChannel, u8),
        attributes: &AttributeTable,
        notice: &mut dyn FnMut(Notice),
    ) {
        let Some((parameter, configured)) = self.asked.take() else { return };
        let held = axis.south().and_then(|program| program.parameter(parameter));
        let Some(held) = result.ok().and_then(|data| held?.decode(data)) else { return };
        if agree(configured, held) {
            return;
        }
        let is = |entry: &&AttributeEntry| matches!(entry.backing, Backing::Parameter { parameter: own, .. } if own == parameter);
        let Some(entry) = attributes.entries().iter().find(is) else { return };
        let shown = |value| {
            let mut bytes = [0; 8];
            let (len, _) = entry.from_generic(value, &mut bytes).ok()?;
            entry.number(bytes.get(..len)?)
        };
        notice(Notice::OtherNameplate {
            axis: number,
            attribute: entry.id,
            configured: shown(configured),
            held: shown(held),
        });
    }
}

/// Whether two values are the same but for what a drive rounds.
fn agree(configured: i64, held: i64) -> bool {
    let (configured, held) = (i128::from(configured), i128::from(held));
    (configured - held).abs() * ROUNDED <= configured.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_agree_within_half_a_percent() {
        for (configured, held, expected) in [
            (1_000, 1_000, true),
            (1_000, 1_005, true),
            (1_000, 995, true),
            (1_000, 1_006, false),
            (1_000, 994, false),
            (0, 0, true),
            (0, 1, false),
            (-1_000, -1_004, true),
            (i64::MAX, i64::MIN, false),
        ] {
            assert_eq!(agree(configured, held), expected, "{configured} {held}");
        }
    }
}
