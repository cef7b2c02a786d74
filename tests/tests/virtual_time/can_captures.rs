//! Touch probes of CiA 402 drives as captures of the generic model, by SDO and in PDOs.

use axisbridge::engine::axis::Limits;
use axisbridge::mapping::CaptureMode;
use axisbridge_tests::rig::generic::GenericCan;
use profile_generic::capture::{
    CaptureEdge, CaptureKind, CaptureResult, CaptureSet, CaptureSource, CaptureStatus,
};
use profile_generic::mode::{ModeSelection, OperatingMode};

const NANO: i64 = 1_000_000_000;
const ONE_UP: CaptureKind = CaptureKind::new(CaptureSource::Registration1, CaptureEdge::Positive);
const ONE_DOWN: CaptureKind = CaptureKind::new(CaptureSource::Registration1, CaptureEdge::Negative);
const TWO_UP: CaptureKind = CaptureKind::new(CaptureSource::Registration2, CaptureEdge::Positive);
const TWO_DOWN: CaptureKind = CaptureKind::new(CaptureSource::Registration2, CaptureEdge::Negative);
const FUNCTION: u16 = 0x60B8;
const STATUS: u16 = 0x60B9;

/// An axis that runs at one turn a second.
fn running(captures: CaptureMode) -> GenericCan {
    let mode = ModeSelection::from(OperatingMode::Position);
    let mut rig = GenericCan::ready(0, [mode], Limits::default(), |needs, _| needs.captures = captures);
    rig.enable();
    rig.lead(NANO, mode);
    rig.run_for(500);
    rig
}

/// Goes on for so many milliseconds while these are wanted; what was captured.
fn want(rig: &mut GenericCan, millis: i64, kinds: &[CaptureKind]) -> Vec<CaptureResult> {
    let wanted: CaptureSet = kinds.iter().copied().collect();
    let end = rig.now() + profile_generic::time::DurationNs::from_millis(millis);
    let mut results = Vec::new();
    while rig.now() < end {
        rig.step();
        let axis = &mut rig.engine.axes_mut()[0];
        while let Some(result) = axis.poll_capture() {
            results.push(result);
        }
        axis.want_captures(wanted);
    }
    results
}

/// Switches the input of a probe, from 1; where the axis is then.
fn switch(rig: &mut GenericCan, probe: usize, active: bool) -> i64 {
    let here = rig.position();
    rig.drive_mut().servo_mut().set_registration(probe, active);
    here
}

fn kind(result: &CaptureResult) -> CaptureKind {
    CaptureKind::new(result.source, result.edge)
}

fn near(result: &CaptureResult, kinds: CaptureKind, place: i64) {
    assert_eq!((kind(result), result.status), (kinds, CaptureStatus::Captured));
    // A turn a second, and a millisecond of the servo.
    assert!((result.position.get() - place).abs() < NANO / 400, "{} of {place}", result.position);
}

#[test]
fn probe_1_catches_a_rising_edge_and_probe_2_a_falling_one() {
    for captures in [CaptureMode::ServiceChannel, CaptureMode::Cyclic] {
        let mut rig = running(captures);
        let kinds = [ONE_UP, TWO_DOWN];
        switch(&mut rig, 2, true);
        assert_eq!(want(&mut rig, 200, &kinds), [], "{captures:?}: nothing has come");
        // Enable and rising edge of probe 1, enable and falling edge of probe 2.
        assert_eq!(rig.number(FUNCTION, 0), 0x2111, "{captures:?}");
        assert_eq!(rig.number(STATUS, 0), 0x0101, "{captures:?}");
        let rose = switch(&mut rig, 1, true);
        let caught = want(&mut rig, 200, &kinds);
        assert_eq!(caught.len(), 1, "{captures:?}: {caught:?}");
        near(&caught[0], ONE_UP, rose);
        assert_eq!(want(&mut rig, 100, &kinds[1..]), []);
        assert_eq!(rig.number(FUNCTION, 0), 0x2100, "{captures:?}: nobody wants probe 1 any more");
        let fell = switch(&mut rig, 2, false);
        let caught = want(&mut rig, 200, &kinds[1..]);
        assert_eq!(caught.len(), 1, "{captures:?}: {caught:?}");
        near(&caught[0], TWO_DOWN, fell);
        assert_eq!(want(&mut rig, 100, &[]), []);
        assert_eq!((rig.number(FUNCTION, 0), rig.number(STATUS, 0)), (0, 0), "{captures:?}");
    }
}

#[test]
fn both_edges_of_both_probes_are_caught_again_and_again() {
    for captures in [CaptureMode::ServiceChannel, CaptureMode::Cyclic] {
        let mut rig = running(captures);
        let kinds = [ONE_UP, ONE_DOWN, TWO_UP, TWO_DOWN];
        assert_eq!(want(&mut rig, 200, &kinds), []);
        assert_eq!(rig.number(FUNCTION, 0), 0x3131, "{captures:?}");
        for _ in 0..3 {
            for (probe, active, expected) in
                [(1, true, ONE_UP), (2, true, TWO_UP), (1, false, ONE_DOWN), (2, false, TWO_DOWN)]
            {
                let place = switch(&mut rig, probe, active);
                let caught = want(&mut rig, 300, &kinds);
                assert_eq!(caught.len(), 1, "{captures:?} {expected:?}: {caught:?}");
                near(&caught[0], expected, place);
            }
        }
    }
}

#[test]
fn the_home_switch_is_seen_from_one_cycle_to_the_next() {
    let mut rig = running(CaptureMode::Cyclic);
    let home = CaptureKind::new(CaptureSource::HomeSwitch, CaptureEdge::Positive);
    let window = profile_generic::capture::CaptureWindow {
        from: profile_generic::quantity::Position(rig.position() + NANO / 4),
        to: profile_generic::quantity::Position(rig.position() + NANO / 2),
    };
    rig.drive_mut().servo_mut().set_home_switch(Some(window));
    let caught = want(&mut rig, 500, &[home]);
    assert_eq!(caught.len(), 1, "{caught:?}");
    assert_eq!(kind(&caught[0]), home);
    let late = caught[0].position.get() - window.from.get();
    // Two cycles of 4 ms at a turn a second.
    assert!((0..=9 * NANO / 1_000).contains(&late), "{late}");
}

/// A probe that works for one edge is let go and begins anew when the other one is wanted as well.
#[test]
fn an_edge_that_is_wanted_later_is_caught_too() {
    for captures in [CaptureMode::ServiceChannel, CaptureMode::Cyclic] {
        let mut rig = running(captures);
        assert_eq!(want(&mut rig, 200, &[ONE_UP]), []);
        assert_eq!(rig.number(FUNCTION, 0), 0x0011, "{captures:?}");
        let kinds = [ONE_UP, ONE_DOWN];
        assert_eq!(want(&mut rig, 200, &kinds), []);
        assert_eq!(rig.number(FUNCTION, 0), 0x0031, "{captures:?}");
    }
}
