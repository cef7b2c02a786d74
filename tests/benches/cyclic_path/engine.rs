//! Whole cycles of the engine with axes in motion, in virtual time.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use axisbridge::capture::Side;
use axisbridge::capture::recorder::{FrameSink, Recorder};
use axisbridge::sys::clock::KernelTime;
use axisbridge_tests::rig::many::{Crowd, Many, all};
use axisbridge_tests::rig::motion::{SLIDE_END, TURNTABLE, TURNTABLE_END, both, moves};
use axisbridge_tests::rig::{Rig, Settings, UPDATE_PERIOD_US};
use criterion::{BenchmarkId, Criterion, Throughput};
use profile_cip::controller::Step;
use profile_generic::time::DurationNs;

/// Moves there and back, of more than four seconds each: more cycles than a measurement takes.
const MOVES: usize = 2_000;

/// How many axes are measured, each a drive on one SERCOS line, in devices of up to 16.
pub const AXES: [usize; 5] = [1, 2, 4, 16, 64];

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

/// A rig of so many turntables on a SERCOS line, all of which go there and back.
#[must_use]
pub fn crowd(axes: usize) -> Many {
    let mut many = Many::ready(Crowd::line(axes));
    many.connect(UPDATE_PERIOD_US, |_, axes| {
        let go = |position: f64| {
            let axis = |axis| Step::MoveAbsolute { axis, position, limits: TURNTABLE };
            Step::Together((1..).take(axes).map(axis).collect())
        };
        let there_and_back = [go(TURNTABLE_END), go(0.0)].into_iter().cycle().take(MOVES);
        std::iter::once(Step::Enable(all(axes))).chain(there_and_back).collect()
    });
    many.run_until(DurationNs::from_secs(30), "motion", |many| {
        (0..many.axis_count()).all(|axis| many.velocity(axis) > 0)
    });
    many
}

/// A rolling recording of what a gateway receives and sends, as `[recording]` has it by default.
pub struct Rolling {
    recorder: Recorder,
    frames: Arc<AtomicU64>,
    lost: Arc<AtomicU64>,
}

/// Counts the frames of the recorder thread.
struct Counter {
    frames: Arc<AtomicU64>,
    lost: Arc<AtomicU64>,
}

impl FrameSink for Counter {
    fn round(&mut self, lost: u64) {
        self.lost.store(lost, Ordering::Relaxed);
    }

    fn frame(&mut self, _: KernelTime, _: Side, _: &[u8]) {
        self.frames.fetch_add(1, Ordering::Relaxed);
    }
}

/// Lets a recorder thread take what the ports of a rig see.
#[must_use]
pub fn record(many: &mut Many) -> Rolling {
    let (frames, lost) = (Arc::<AtomicU64>::default(), Arc::<AtomicU64>::default());
    let sink = Box::new(Counter { frames: Arc::clone(&frames), lost: Arc::clone(&lost) });
    // The benchmark runs thousands of cycles in the time of a few: queues with room for what the recorder thread has not taken yet.
    let (recorder, taps) = Recorder::start_with(None, Some(sink), 4_096, many.taps()).expect("a thread");
    many.record(taps);
    Rolling { recorder, frames, lost }
}

/// Ends a recording, which has taken every frame: what is dropped costs the cycle less.
pub fn assert_complete(Rolling { recorder, frames, lost }: Rolling) {
    recorder.finish().expect("there is no file");
    let counted = [frames, lost].map(|counter| counter.load(Ordering::Relaxed));
    assert!(counted[0] > 0 && counted[1] == 0, "frames and lost ones: {counted:?}");
}

/// Runs a call and gives the time that it took.
fn timed(call: &mut dyn FnMut()) -> Duration {
    let start = Instant::now();
    call();
    start.elapsed()
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
    two_axes(criterion);
    by_axes(criterion, false);
    by_axes(criterion, true);
}

fn two_axes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("engine_cycle_two_axes");
    group.sample_size(20);
    let mut rig = shuttle();
    group.bench_function("engine", |bencher| {
        bencher.iter_custom(|count| (0..count).map(|_| rig.cycle_in(timed)).sum());
    });
    group.bench_function("engine_drives_and_controller", |bencher| {
        bencher.iter_custom(|count| whole_chain(&mut rig, count));
    });
    group.finish();
    let report = rig.report();
    assert_eq!((report.failure, report.steps_finished < MOVES), (None, true), "the axes were in motion");
}

/// The engine alone, by the number of its axes: the simulated drives, the network and the controllers are not counted.
fn by_axes(criterion: &mut Criterion, recorded: bool) {
    let mut group =
        criterion.benchmark_group(if recorded { "engine_cycle_recorded" } else { "engine_cycle" });
    group.sample_size(20);
    for axes in AXES {
        let mut many = crowd(axes);
        let recording = recorded.then(|| record(&mut many));
        group.throughput(Throughput::Elements(u64::try_from(axes).unwrap_or(u64::MAX)));
        group.bench_function(BenchmarkId::from_parameter(axes), |bencher| {
            bencher.iter_custom(|count| (0..count).map(|_| many.cycle_in(timed)).sum());
        });
        for report in many.reports() {
            assert_eq!(
                (report.failure, report.steps_finished < MOVES),
                (None, true),
                "in motion all the time"
            );
        }
        recording.into_iter().for_each(assert_complete);
    }
    group.finish();
}
