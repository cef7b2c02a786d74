//! Motions that several tests run.

use profile_cip::controller::{AxisSet, Limits, Step};
use profile_generic::time::DurationNs;

use super::{Rig, Settings};

/// Limits of the turntable's moves: revolutions.
pub const TURNTABLE: Limits = Limits { velocity: 5.0, acceleration: 50.0, jerk: 1_000.0 };

/// Limits of the slide's moves: millimetres.
pub const SLIDE: Limits = Limits { velocity: 200.0, acceleration: 2_000.0, jerk: 40_000.0 };

/// Where the long move of the turntable ends.
pub const TURNTABLE_END: f64 = 20.0;

/// Where the long move of the slide ends.
pub const SLIDE_END: f64 = 900.0;

/// Nanounits in a unit.
pub const NANO: i64 = 1_000_000_000;

/// Both axes.
#[must_use]
pub fn both() -> AxisSet {
    AxisSet::first(2)
}

/// A time in milliseconds.
#[must_use]
pub const fn millis(count: i64) -> DurationNs {
    DurationNs::from_millis(count)
}

/// Moves both axes at the same time, from rest to rest.
#[must_use]
pub fn moves(turntable: f64, slide: f64) -> Step {
    Step::Together(vec![
        Step::MoveAbsolute { axis: 1, position: turntable, limits: TURNTABLE },
        Step::MoveAbsolute { axis: 2, position: slide, limits: SLIDE },
    ])
}

/// Waits until both axes stand where they were sent.
#[must_use]
pub fn arrival() -> Step {
    Step::Together(vec![
        Step::WaitInWindow { axis: 1, window: 0.001, seconds: 1.0 },
        Step::WaitInWindow { axis: 2, window: 0.02, seconds: 1.0 },
    ])
}

/// Enables both axes, moves them for more than four seconds, and disables them.
#[must_use]
pub fn long_moves() -> Vec<Step> {
    vec![Step::Enable(both()), moves(TURNTABLE_END, SLIDE_END), arrival(), Step::Disable(both())]
}

/// A rig whose axes are both in the middle of [`long_moves`], at full speed.
#[must_use]
pub fn in_motion(settings: Settings) -> Rig {
    let mut rig = Rig::ready(settings);
    rig.connect(long_moves());
    rig.run_until(millis(5_000), "full speed", at_full_speed);
    rig
}

/// Whether both axes run at the speed of [`long_moves`].
#[must_use]
pub fn at_full_speed(rig: &Rig) -> bool {
    rig.velocity(0) > 49 * NANO / 10 && rig.velocity(1) > 199 * NANO
}

/// Whether no axis moves faster than its standstill window.
#[must_use]
pub fn at_rest(rig: &Rig) -> bool {
    rig.velocity(0).abs() < NANO / 100 && rig.velocity(1).abs() < NANO
}
