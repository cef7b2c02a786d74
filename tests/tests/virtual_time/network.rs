//! What the network does to a motion: lost, late, doubled and overtaken updates.

use std::fmt::Write as _;

use axisbridge_tests::rig::motion::{NANO, arrival, both, millis, moves};
use axisbridge_tests::rig::motion_checker::violation::{Rule, Violation};
use axisbridge_tests::rig::network::Knobs;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::Step;
use profile_cip::device::axis_state::AxisState;
use profile_generic::time::DurationNs;

/// Where the short moves end.
const ENDS: (f64, f64) = (2.0, 60.0);

fn short_moves() -> Vec<Step> {
    vec![Step::Enable(both()), moves(ENDS.0, ENDS.1), arrival(), Step::Disable(both())]
}

#[test]
fn a_table_of_networks() {
    let mut table = String::from(
        "latency  loss  reordered | C-to-D lost late overtaken repeated | D-to-C lost late | following errors\n",
    );
    for latency in [100, 3_000, 6_000] {
        for loss in [0, 50, 200] {
            for reordering in [0, 50] {
                let knobs = Knobs {
                    latency: DurationNs::from_micros(latency),
                    loss,
                    duplication: reordering,
                    reordering,
                    ..Knobs::GOOD
                };
                let mut rig = Rig::ready(Settings { knobs, seed: 7, ..Settings::default() });
                if loss > 0 {
                    // Each gap is bridged by a curve that the one before has bent already.
                    let bent = |found: &Violation| matches!(found.rule, Rule::Velocity | Rule::Acceleration);
                    rig.motion_checker
                        .tolerate("losses one after the other while the axis accelerates", bent);
                }
                rig.connect(short_moves());
                let report = rig.run(millis(60_000));
                let counters = *rig.engine.devices()[0].device().counters();
                let (commands, _) = rig.network();
                if reordering == 0 {
                    // Nothing is lost that the network did not lose, and what it loses late in the run may
                    // go unseen.
                    assert!(counters.lost_updates <= commands.lost, "{counters:?} {commands:?}");
                }
                assert_eq!(report.failure, None, "{knobs:?}: {}", rig.log());
                let distance = [(0, 2 * NANO), (1, 60 * NANO)].map(|(at, end)| rig.position(at) - end);
                assert!(distance[0].abs() < NANO / 1_000 && distance[1].abs() < NANO / 50, "{distance:?}");
                assert!(rig.torque_free());
                let refused = [counters.malformed, counters.oversize, counters.not_finite];
                assert_eq!(refused, [0; 3], "a bad network makes no bad updates");
                writeln!(
                    table,
                    "{latency:4} us {:3} % {:3} %    | {:6} {:6} {:6} {:6}        | {:6} {:6}     | {:.4} {:.4}",
                    loss / 10,
                    reordering / 10,
                    counters.lost_updates,
                    counters.late_updates,
                    counters.out_of_order,
                    counters.refreshes + counters.repeated,
                    report.lost_updates,
                    report.late_updates,
                    report.axes[0].following_error_max,
                    report.axes[1].following_error_max
                )
                .expect("a string takes everything");
            }
        }
    }
    insta::assert_snapshot!(table);
}

#[test]
fn a_hopeless_network_ends_in_a_stop() {
    for seed in 1..=4 {
        let mut rig = Rig::ready(Settings { seed, ..Settings::default() });
        rig.connect(vec![Step::Enable(both()), moves(20.0, 900.0), Step::Disable(both())]);
        rig.run_until(millis(5_000), "the motion", |rig| rig.report().steps_finished == 1);
        rig.knobs = Knobs { loss: 850, reordering: 100, ..Knobs::GOOD };
        let mut fastest = [0, 0];
        let stopped = rig.run_until(millis(10_000), "the stop", |rig| {
            fastest = [0, 1].map(|place| fastest[place].max(rig.velocity(place).abs()));
            rig.torque_free()
        });
        // Six updates out of seven are lost: it does not take long until too many are missing in a row.
        assert!(stopped < millis(1_500), "seed {seed}: {stopped}");
        assert!(fastest[0] < 6 * NANO && fastest[1] < 240 * NANO, "seed {seed}: {fastest:?}");
        rig.run_for(millis(20));
        assert!((0..2).all(|axis| rig.axis_states(axis).contains(&AxisState::MajorFaulted)), "seed {seed}");
    }
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let run = |seed| {
        let knobs = Knobs { loss: 100, duplication: 50, reordering: 100, ..Knobs::GOOD };
        let mut rig = Rig::ready(Settings { knobs, seed, ..Settings::default() });
        rig.connect(short_moves());
        rig.run_for(millis(800));
        (rig.position(0), rig.position(1), *rig.engine.devices()[0].device().counters(), rig.network())
    };
    let first = run(11);
    assert_eq!(run(11), first);
    assert_ne!(run(12), first);
}
