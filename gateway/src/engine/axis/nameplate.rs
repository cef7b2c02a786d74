//! What the nameplate in the configuration says and the drive shows too: the drive counts, and a difference is reported, as one of both
//! is of another motor.

use arrayvec::ArrayVec;
use profile_generic::parameter::Parameter;

use crate::mapping::{DATA_MAX, DriveProgram, Item};

/// The part of a value by which drives round it.
const ROUNDED: i128 = 200;

/// A value of the nameplate, in its generic unit.
type Value = (Parameter, i64);

/// A value of which nameplate and drive say different things.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::engine) struct Difference {
    /// The value.
    pub parameter: Parameter,
    /// What the nameplate says.
    pub configured: i64,
    /// What the drive shows.
    pub held: i64,
}

/// The values that are still to be compared.
#[derive(Debug, Default)]
pub(super) struct NameplateCheck {
    left: ArrayVec<Value, DATA_MAX>,
    asked: Option<Value>,
}

impl NameplateCheck {
    /// Begins anew with the values that another program of the drive shows.
    pub fn begin(&mut self, nameplate: &[Value], program: &DriveProgram) {
        let reads = |parameter| program.parameter(parameter).is_some_and(|held| held.from_drive.is_some());
        let shown = nameplate.iter().filter(|(parameter, _)| reads(*parameter));
        self.left = shown.copied().take(DATA_MAX).collect();
        self.asked = None;
    }

    /// What the drive should be asked for now.
    pub fn wanted(&self, program: &DriveProgram) -> Option<Item> {
        let (parameter, _) = self.left.last().filter(|_| self.asked.is_none())?;
        program.parameter(*parameter).map(|held| held.item)
    }

    /// What was wanted is on its way.
    pub fn ask(&mut self) {
        self.asked = self.left.pop();
    }

    /// Takes the answer of the drive. What it does not give is not compared.
    pub fn take(
        &mut self,
        item: Item,
        data: Option<&[u8]>,
        program: Option<&DriveProgram>,
    ) -> Option<Difference> {
        let (parameter, configured) = self.asked.take()?;
        let held = program?.parameter(parameter).filter(|held| held.item == item)?.decode(data?)?;
        (!agree(configured, held)).then_some(Difference { parameter, configured, held })
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
