//! Another grandmaster: it differs from the one before in time and rate, and controller and gateway learn of it one Sync interval
//! apart. Nothing of that may show in the motion, which the motion checker judges: besides what the rates differ by, it allows
//! the microsecond in a millisecond at which clause 2-2.2 corrects a phase. The same while the gateway does not run for some cycles.

use std::fmt::Write as _;

use axisbridge_tests::rig::Rig;
use axisbridge_tests::rig::clocks::Clock;
use profile_cip::controller::{AttributeSet, Limits, Step};
use profile_cip::wire::motion::codes::NodeFault;
use profile_generic::time::DurationNs;
use profile_sercos::checker::checked_bus::Tried;
use profile_sercos::checker::{Rule, Violation};

use crate::chain::{Bus, Chain};
use crate::probe::Probe;
use crate::scenario::AXIS;

/// Two revolutions in a second for as long as a row of changes takes.
const LIMITS: Limits = Limits { velocity: 2.0, acceleration: 20.0, jerk: 400.0 };

/// CIP Sync sends a Sync every second.
const SYNC_INTERVAL: DurationNs = DurationNs::from_millis(1_000);

/// Behind the later of both: a phase of a millisecond is corrected by then.
const SETTLED: DurationNs = DurationNs::from_millis(1_600);

/// Step Threshold, class attribute 35.
const STEP_THRESHOLD: u16 = 35;

/// Who learns of the new master first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum First {
    Controller,
    Gateway,
}

/// The new master against the old one: microseconds ahead, parts per million faster.
fn changes() -> impl Iterator<Item = (i64, i64, First)> {
    [0, 100, 900, 1_100, 10_000].into_iter().flat_map(|micros| {
        let signs = [(micros, 200), (-micros, -200)];
        signs
            .into_iter()
            .flat_map(|(micros, ppm)| [First::Controller, First::Gateway].map(|first| (micros, ppm, first)))
    })
}

/// Changes to another master and back, each with its rows; what set-points are late by at the end of each.
fn table(bus: Bus, step_threshold: Option<u32>, rows: impl Iterator<Item = (i64, i64, First)>) -> String {
    let (mut rig, mut probe) = moving(bus, step_threshold);
    let mut text = String::new();
    for (micros, ppm, first) in rows {
        for back in [false, true] {
            let (micros, ppm) = if back { (-micros, 0) } else { (micros, ppm) };
            rig.motion_checker.restart_statistics();
            change(&mut rig, micros, ppm, first, None);
            let late = late(&mut rig, &mut probe);
            let statistics = rig.motion_checker.statistics(0);
            let deviation = statistics.percent(statistics.deviation);
            let first = format!("{first:?}").to_lowercase();
            writeln!(
                text,
                "{bus:<8} {micros:>+6} us {ppm:>+5} ppm, {first:<10} first: deviation {deviation:.2} %, late by {late:>5} us",
            )
            .expect("a string takes everything");
        }
    }
    assert_eq!(rig.engine.devices()[0].device().node_fault(), NodeFault::NONE);
    assert!(rig.engine.devices()[0].device().is_synchronous());
    text
}

/// An axis that moves at constant velocity, synchronously.
fn moving(bus: Bus, step_threshold: Option<u32>) -> (Rig, Probe) {
    let chain = Chain { bus, synchronous: true };
    let mut rig = chain.ready();
    let mut config = chain.controller(&rig);
    config.class_attributes.extend(step_threshold.map(|value| AttributeSet::udint(STEP_THRESHOLD, value)));
    let position = 2_000.0;
    rig.connect_with(
        config,
        vec![Step::Enable(AXIS), Step::MoveAbsolute { axis: 1, position, limits: LIMITS }],
    );
    rig.run_until(DurationNs::from_millis(8_000), "the axis enabled", |rig| rig.report().steps_finished == 1);
    rig.run_for(DurationNs::from_millis(400));
    let probe = Probe::new(&mut rig, bus, chain.cycle());
    (rig, probe)
}

/// The gateway does not run for so long, and has been standing for so long when it learns of another master.
#[derive(Debug, Clone, Copy)]
struct Pause {
    length: DurationNs,
    before: DurationNs,
}

/// Another master takes over. One side learns of it with the next Sync, the other with the one after.
fn change(rig: &mut Rig, micros: i64, ppm: i64, first: First, pause: Option<Pause>) {
    let mut master = rig.controller_clock.clone();
    master.step(rig.now(), DurationNs::from_micros(micros));
    master.drift(rig.now(), ppm * 1_000);
    let follow = |rig: &mut Rig, whose: First, master: &Clock| {
        if let Some(Pause { length, before }) = pause {
            rig.wake_ups.pause(rig.now() + length);
            rig.run_for(before);
        }
        let now = rig.now();
        match whose {
            First::Controller => rig.controller_clock.follow(now, master),
            First::Gateway => rig.gateway_clock.follow(now, master),
        }
    };
    let second = if first == First::Controller { First::Gateway } else { First::Controller };
    follow(rig, first, &master);
    rig.run_for(SYNC_INTERVAL);
    follow(rig, second, &master);
    rig.run_for(SETTLED);
}

/// By how many microseconds the drive is later than the controller wants: its position at an instant of its grid against the one
/// that the controller has sent for it.
fn late(rig: &mut Rig, probe: &mut Probe) -> i64 {
    probe.restart();
    probe.run_for(rig, DurationNs::from_millis(100));
    let taken = probe.taken.iter().rev().find_map(|taken| Some((taken.at, probe.stamp_of(taken.position)?)));
    let (at, stamp) = taken.expect("set-points of known updates");
    // Stamps are of the controller's system time.
    let stamp = stamp - rig.controller_clock.offset(rig.now());
    let period = Chain { bus: Bus::Sercos, synchronous: true }.period();
    let late = at.since(stamp) - period * 2;
    (late.as_nanos() + if late.as_nanos() < 0 { -500 } else { 500 }) / 1_000
}

#[test]
fn a_change_of_grandmaster_moves_no_axis() {
    let mut text = table(Bus::Sercos, None, changes());
    text += &table(Bus::Canopen, None, changes().filter(|(_, ppm, _)| *ppm > 0));
    insta::assert_snapshot!(text);
}

/// A controller that sets the Step Threshold to its update period, as clause 2-2.1 has it.
#[test]
fn with_the_update_period_as_step_threshold_the_phase_of_both_is_the_same_in_the_end() {
    insta::assert_snapshot!(table(Bus::Sercos, Some(8_000_000), changes().filter(|(_, ppm, _)| *ppm > 0)));
}

/// The gateway stands while its time changes: what has come meanwhile was stamped before and behind the change, and is read with the
/// new time. SERCOS, whose drives wait for ten milliseconds here.
#[test]
fn a_pause_of_the_gateway_at_a_change_of_grandmaster_moves_no_axis() {
    let micros = DurationNs::from_micros;
    let pauses = [4_000, 9_000].map(micros).into_iter().flat_map(|length| {
        let before = [0, 100, 1_900, 3_900].map(micros);
        before.into_iter().map(move |before| Pause { length, before })
    });
    let (mut rig, mut probe) = moving(Bus::Sercos, None);
    // An engine that does not run sends no MST; what it had built before is counted and never sent.
    let missed = |violation: &Violation| {
        matches!(
            violation.rule,
            Rule::MstInterval { .. } | Rule::CycleCounter { .. } | Rule::Production { .. }
        )
    };
    rig.tolerating(missed, |rig| {
        let at_first = late(rig, &mut probe);
        for pause in pauses {
            for (change_by, ppm) in [(47, 40), (900, 40), (4_500, 40)] {
                for first in [First::Controller, First::Gateway] {
                    change(rig, change_by, ppm, first, Some(pause));
                    change(rig, -change_by, 0, first, Some(pause));
                    let late = late(rig, &mut probe);
                    assert!((late - at_first).abs() <= 1, "{pause:?}, {change_by} us, {first:?}: {late} us");
                }
            }
        }
    });
    assert_eq!(rig.engine.devices()[0].device().node_fault(), NodeFault::NONE);
    assert!(rig.engine.devices()[0].device().is_synchronous());
}
