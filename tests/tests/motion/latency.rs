//! Latency in cycles: how long a set-point and a position need through the gateway, measured on what travels on both sides of it.
//!
//! | column | from | to |
//! |---|---|---|
//! | south | time stamp of the update | instant of the grid at which the drive takes its position |
//! | sent | start of the controller's update cycle | the gateway sends its update for it (negative: before) |
//! | north | the drive's sampling of the position | the controller has it |
//! | stated | time stamp of the gateway's update | the controller has it |
//!
//! Each is the largest of a motion at constant velocity. The network takes no time here, and the controller works at the start of its
//! cycles.

use std::fmt::Write as _;

use axisbridge::engine::phase_lock::LockState;
use axisbridge_tests::rig::network::Knobs;
use profile_cip::controller::{Limits, Step};
use profile_cip::wire::motion::codes::CommandTarget;
use profile_generic::cast::f64_from_i64;
use profile_generic::time::DurationNs;

use crate::chain::{Bus, Chain};
use crate::probe::Probe;
use crate::scenario::AXIS;

const LIMITS: Limits = Limits { velocity: 2.0, acceleration: 20.0, jerk: 400.0 };

/// Until the velocity is constant, behind everything that leads to it.
const SETTLED: DurationNs = DurationNs::from_millis(500);

/// Controller Update Period and cycle of the bus, in milliseconds.
const RATIOS: [(&str, [(i64, i64); 2]); 7] = [
    ("1:1", [(1, 1), (2, 2)]),
    ("2:1", [(2, 1), (4, 2)]),
    ("4:1", [(4, 1), (8, 2)]),
    ("8:1", [(8, 1), (16, 2)]),
    ("3:2", [(3, 2), (6, 4)]),
    ("1:2", [(2, 4), (4, 8)]),
    ("1:4", [(1, 4), (2, 8)]),
];

/// Largest latencies.
struct Latencies {
    south: DurationNs,
    sent: DurationNs,
    north: DurationNs,
    /// An asynchronous update has no time stamp.
    stated: Option<DurationNs>,
}

fn measure(bus: Bus, period: DurationNs, cycle: DurationNs, target: Option<CommandTarget>) -> Latencies {
    let mut rig = bus.ready(cycle, period, "");
    rig.knobs = Knobs { latency: DurationNs::ZERO, ..Knobs::GOOD };
    // It judges nothing here: at ratios below two the acceleration is one of extrapolation.
    rig.motion_checker.record();
    let mut config = Chain { bus, synchronous: target.is_some() }.controller(&rig);
    config.rpi_us = u32::try_from(period.as_nanos() / 1_000).expect("some milliseconds");
    config.command_target = target.unwrap_or(config.command_target);
    let position = 10.0;
    rig.connect_with(
        config,
        vec![
            // Until the bus is on the controller's grid.
            Step::Dwell { seconds: 2.0 },
            Step::Enable(AXIS),
            Step::MoveAbsolute { axis: 1, position, limits: LIMITS },
        ],
    );
    rig.run_until(DurationNs::from_millis(8_000), "the axis enabled", |rig| rig.report().steps_finished == 2);
    assert_eq!(rig.status().phase_lock.state, LockState::Locked, "{bus}: {}", rig.told());
    let mut probe = Probe::new(&mut rig, bus, cycle);
    probe.run_for(&mut rig, SETTLED);
    let begin = rig.now();
    probe.run_for(&mut rig, DurationNs::from_millis(400));
    let taken = probe.taken.iter().filter(|taken| taken.at >= begin);
    let south = taken.filter_map(|taken| Some(taken.at.since(probe.stamp_of(taken.position)?)));
    let reported: Vec<_> = probe.reported().into_iter().filter(|row| row.sent >= begin).collect();
    let start = probe.commanded()[0].stamp;
    let sent = reported.iter().map(|row| {
        let into = row.sent.since(start).0.rem_euclid(period.0);
        // In synchronous operation it belongs to the cycle that begins next.
        DurationNs(if row.synchronous && into > 0 { into - period.0 } else { into })
    });
    let north = reported.iter().filter_map(|row| Some(row.sent.since(probe.when_at(row.position)?)));
    let stated = reported.iter().filter_map(|row| Some(row.sent.since(row.stamp?)));
    Latencies {
        south: south.max().expect("set-points"),
        sent: sent.max().expect("updates"),
        north: north.max().expect("positions"),
        stated: stated.max(),
    }
}

#[test]
fn latency_of_each_ratio_of_periods() {
    let mut text = String::new();
    let head = ["south", "in periods", "sent", "north", "in cycles", "stated"];
    let [a, b, c, d, e, f] = head;
    writeln!(text, "bus      ratio  period  cycle  target       {a:>9} {b:>11} {c:>9} {d:>9} {e:>10} {f:>9}")
        .expect("a string takes everything");
    for (place, bus) in [Bus::Sercos, Bus::Canopen].into_iter().enumerate() {
        for (ratio, periods) in RATIOS {
            let (period, cycle) = periods[place];
            let (period, cycle) = (DurationNs::from_millis(period), DurationNs::from_millis(cycle));
            let targets = [
                (Some(CommandTarget::INTERPOLATE), "interpolate"),
                (Some(CommandTarget::EXTRAPOLATE), "extrapolate"),
                (None, "async"),
            ];
            for (target, name) in targets {
                let found = measure(bus, period, cycle, target);
                let parts = |span: DurationNs, of: DurationNs| f64_from_i64(span.0) / f64_from_i64(of.0);
                let micros = |span: DurationNs| format!("{:.0} us", f64_from_i64(span.0) / 1e3);
                writeln!(
                    text,
                    "{bus:<8} {ratio:<5} {:>4} ms {:>3} ms  {name:<11} {:>10} {:>11.2} {:>9} {:>9} {:>10.2} {:>9}",
                    period.0 / 1_000_000,
                    cycle.0 / 1_000_000,
                    micros(found.south),
                    parts(found.south, period),
                    micros(found.sent),
                    micros(found.north),
                    parts(found.north, cycle),
                    found.stated.map_or("-".to_owned(), micros),
                )
                .expect("a string takes everything");
            }
        }
    }
    insta::assert_snapshot!(text);
}
