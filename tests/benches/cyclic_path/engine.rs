//! Whole cycles of the engine with two axes in motion, in virtual time.

use std::time::{Duration, Instant};

use axisbridge_tests::rig::motion::{SLIDE_END, TURNTABLE_END, both, moves};
use axisbridge_tests::rig::{Rig, Settings};
use criterion::Criterion;
use profile_cip::controller::Step;
use profile_generic::time::DurationNs;

/// Moves there and back, of more than four seconds each: more cycles than a measurement takes.
const MOVES: usize = 2_000;

/// A rig whose axes go there and back.
#[must_use]
pub fn shuttle() -> Rig {
    let mut rig = Rig::ready(Settings::default());
    let there_and_back = [moves(TURNTABLE_END, SLIDE_END), moves(0.0, 0.0)];
    let program = std::iter::once(Step::Enable(both())).chain(there_and_back.into_iter().cycle().take(MOVES));
    rig.connect(program.collect());
    rig.run_until(DurationNs::from_secs(10), "motion", |rig| rig.velocity(0) > 0 && rig.velocity(1) > 0);
    rig
}

/// So many cycles; gives the time that the engine took of them.
fn engine_alone(rig: &mut Rig, count: u64) -> Duration {
    let timed = |cycle: &mut dyn FnMut()| {
        let start = Instant::now();
        cycle();
        start.elapsed()
    };
    (0..count).map(|_| rig.cycle_in(timed)).sum()
}

/// So many cycles; gives the time of engine, drives, network, explicit side and controller.
fn whole_chain(rig: &mut Rig, count: u64) -> Duration {
    let start = Instant::now();
    for _ in 0..count {
        rig.cycle_in(|cycle| cycle());
    }
    start.elapsed()
}

/// Benches of this module.
pub fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("engine_cycle_two_axes");
    group.sample_size(20);
    let mut rig = shuttle();
    group.bench_function("engine", |bencher| {
        bencher.iter_custom(|count| engine_alone(&mut rig, count));
    });
    group.bench_function("engine_drives_and_controller", |bencher| {
        bencher.iter_custom(|count| whole_chain(&mut rig, count));
    });
    group.finish();
    let report = rig.report();
    assert_eq!((report.failure, report.steps_finished < MOVES), (None, true), "the axes were in motion");
}
