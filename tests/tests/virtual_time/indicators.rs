//! What the indicators of the box show while a controller starts, moves, faults and leaves.

use axisbridge_tests::rig::motion::{NANO, SLIDE, both, millis};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::Step;
use profile_generic::fault::FaultCause;

/// What is shown for an axis and its device, as a person reads it.
fn shown(rig: &Rig, axis: usize) -> String {
    let axis = &rig.status().axes[axis];
    let indicators = axis.indicators;
    format!("{} | {} | {:?} | {}", axis.display(), indicators.axis, indicators.module, indicators.network)
}

#[test]
fn from_the_start_to_the_loss_of_the_controller() {
    let mut rig = Rig::ready(Settings::default());
    let mut lines = vec![shown(&rig, 0)];
    let mut note = |rig: &Rig| {
        let line = shown(rig, 0);
        if lines.last() != Some(&line) {
            lines.push(line);
        }
    };
    rig.connect(vec![
        Step::Enable(both()),
        Step::MoveAbsolute { axis: 2, position: 500.0, limits: SLIDE },
        Step::Dwell { seconds: 10.0 },
    ]);
    rig.run_until(millis(5_000), "the slide in motion", |rig| {
        note(rig);
        rig.velocity(1) > 199 * NANO
    });
    rig.drive_mut(0).raise_fault(FaultCause::OVER_CURRENT);
    let end = rig.elapsed() + millis(300);
    rig.run_until(millis(400), "the fault shown", |rig| {
        note(rig);
        rig.elapsed() >= end
    });
    assert_eq!(shown(&rig, 1).split(" | ").next(), Some("X2:RUNNING"), "the other axis runs on");
    rig.kill_controller();
    let end = rig.elapsed() + millis(1_000);
    rig.run_until(millis(1_100), "the loss shown", |rig| {
        note(rig);
        rig.elapsed() >= end
    });
    insta::assert_snapshot!(lines.join("\n"));
}
