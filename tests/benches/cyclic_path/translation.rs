//! One axis through both programs, as the cycle does it: values of CIP Motion to the bytes of the drive's connection
//! and back.

use std::f64::consts::TAU;
use std::hint::black_box;

use axisbridge::mapping::{CachedStatus, CipProgram, CipTrackers, CyclicValues, DriveProgram, Mapping, Told};
use axisbridge_tests::can_frames;
use axisbridge_tests::rig::{Rig, Settings, UPDATE_PERIOD_US};
use criterion::Criterion;
use profile_cip::device::drive_link::DriveImage;
use profile_cip::wire::motion::{CommandPosition, CommandValues};
use profile_generic::fault_set::FaultSet;
use profile_generic::image::{AxisCommand, AxisFeedback, Signal};
use profile_generic::interpolation::{
    FineInterpolator, InterpolatorConfig, Quality, SetPoints, TargetUpdate,
};
use profile_generic::mode::OperatingMode;
use profile_generic::program::ConversionReport;
use profile_generic::state::Action;
use profile_generic::time::{DurationNs, MonotonicTime};

/// Bytes set aside for the values of a connection.
const TELEGRAM_MAX: usize = 64;
/// Updates of one swing to and fro: four seconds.
const SWING: u16 = 1_000;
/// How far it goes to either side, in counts: one revolution.
const AMPLITUDE: f64 = 1_000_000.0;
/// When the first update counts; the instant does not matter.
const START: MonotonicTime = MonotonicTime(1_000_000_000_000);
/// The status of a CiA 402 drive that operates and follows in csp: mode of operation, statusword.
const CSP_OPERATING: u32 = 0x08_1037;
/// Cycle of the bus; an update lasts two of them.
const CYCLE: DurationNs = DurationNs::from_millis(2);

/// One axis with what the cycle keeps for it.
pub struct Axis {
    north: CipProgram,
    trackers: CipTrackers,
    south: DriveProgram,
    cached: CachedStatus,
    interpolator: FineInterpolator,
    period: DurationNs,
    command: AxisCommand,
    feedback: AxisFeedback,
    faults: FaultSet,
    told: Told,
    image: DriveImage,
    telegram: [u8; TELEGRAM_MAX],
    control: u32,
    status: u32,
    saturated: u32,
    target: MonotonicTime,
    swing: Vec<CommandValues>,
    next: usize,
}

impl Axis {
    /// The turntable of the rig on a SERCOS drive, with the programs that were compiled for it.
    #[must_use]
    pub fn turntable() -> Self {
        let rig = Rig::ready(Settings::default());
        let axis = &rig.engine.axes()[0];
        let south = axis.south().expect("it is commissioned").clone();
        Self::new(axis.north().clone(), south, *axis.feedback(), 0)
    }

    /// The same on a CiA 402 drive.
    #[must_use]
    pub fn on_can() -> Self {
        let stage = can_frames::stage(Mapping::embedded().expect("the shipped tables")).expect("its drives");
        let axis = &stage.axes[0];
        Self::new(axis.north.clone(), axis.south.clone(), AxisFeedback::default(), CSP_OPERATING)
    }

    fn new(north: CipProgram, south: DriveProgram, feedback: AxisFeedback, status: u32) -> Self {
        let period = DurationNs::from_micros(i64::from(UPDATE_PERIOD_US));
        let config =
            InterpolatorConfig { target_update: TargetUpdate::Interpolate, period, extrapolate_periods: 4 };
        let mut interpolator = FineInterpolator::new(config).expect("a sound configuration");
        interpolator.start(Some(feedback.position));
        let mut axis = Self {
            trackers: north.trackers(),
            north,
            cached: south.cached_status(),
            south,
            interpolator,
            period,
            command: AxisCommand { mode: OperatingMode::Position, ..AxisCommand::default() },
            feedback,
            faults: FaultSet::new(),
            told: Told::default(),
            image: DriveImage::default(),
            telegram: [0; TELEGRAM_MAX],
            control: 0,
            status,
            saturated: 0,
            target: START,
            swing: (0..SWING).map(values).collect(),
            next: 0,
        };
        // The first updates are a jump from rest.
        for _ in 0..SWING {
            axis.update();
        }
        axis.saturated = 0;
        axis
    }

    /// The values of an update become the generic command.
    pub fn decode(&mut self) {
        let values = CyclicValues::from(black_box(&self.swing[self.next]));
        let report = self.north.decode(&values, 0, &mut self.trackers, &mut self.command);
        assert!(report.is_clean());
    }

    /// The generic command becomes bytes for the drive.
    pub fn encode(&mut self) {
        let mut report = ConversionReport::default();
        self.control = self.south.encode(
            black_box(&self.command),
            Action::Enable,
            self.control,
            self.status,
            &mut self.telegram,
            &mut report,
        );
        self.saturated += report.saturated;
        black_box(&mut self.telegram);
    }

    /// One update and the two cycles of the bus that it lasts.
    pub fn update(&mut self) {
        self.next = (self.next + 1) % self.swing.len();
        self.target = self.target + self.period;
        self.decode();
        self.interpolator.update(self.target, &SetPoints::from(&self.command)).expect("it is newer");
        for cycle in [0, 1] {
            let now = self.target - self.period * 2 + CYCLE * cycle;
            let fine = self.interpolator.at(now);
            assert_ne!(fine.quality, Quality::Lost);
            let points = fine.set_points;
            let all = SetPoints {
                velocity: Some(points.velocity.unwrap_or_default()),
                acceleration: Some(points.acceleration.unwrap_or_default()),
                torque: Some(points.torque.unwrap_or_default()),
                ..points
            };
            all.write_to(&mut self.command);
            for offset in Signal::OFFSETS {
                self.command.set(offset, 0);
            }
            self.encode();
        }
    }

    /// What a cycle of the bus does for an axis: the drive's bytes to the generic feedback and its state, the generic command and
    /// what the state asks for to bytes.
    pub fn step(&mut self, telegram: &[u8]) {
        let mut report = ConversionReport::default();
        let told = self.south.decode(telegram, false, &mut self.feedback, &mut self.cached, &mut report);
        assert!(told.is_some());
        self.encode();
    }

    /// Bytes of the drive become the generic feedback, and that what the device has to know of it.
    pub fn feedback(&mut self, telegram: &[u8]) {
        let mut report = ConversionReport::default();
        let word = self.south.decode(telegram, false, &mut self.feedback, &mut self.cached, &mut report);
        assert!(word.is_some());
        self.north.drive_image(&self.feedback, &self.faults, &mut self.told, &mut self.image);
        black_box(&mut self.image);
    }
}

/// An update of the swing.
fn values(number: u16) -> CommandValues {
    let angle = TAU * f64::from(number) / f64::from(SWING);
    CommandValues {
        position: Some(CommandPosition::Float(AMPLITUDE * angle.sin())),
        velocity: Some(1.5),
        acceleration: Some(0.0),
        ..CommandValues::default()
    }
}

/// The TPDOs of a drive that operates in csp.
#[must_use]
pub fn csp_telegram() -> [u8; TELEGRAM_MAX] {
    let mut telegram = [0; TELEGRAM_MAX];
    telegram[..3].copy_from_slice(&CSP_OPERATING.to_le_bytes()[..3]);
    telegram
}

/// The same of a drive that shows something else in every cycle: that it is at its target, and that it is not.
#[must_use]
pub fn changing_telegrams() -> [[u8; TELEGRAM_MAX]; 2] {
    let mut telegrams = [csp_telegram(); 2];
    telegrams[1][1] |= 0x04;
    telegrams
}

/// Benches of this module.
pub fn bench(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("translation");
    let mut axis = Axis::turntable();
    group.bench_function("values_to_generic", |bencher| bencher.iter(|| axis.decode()));
    group.bench_function("generic_to_mdt_bytes", |bencher| bencher.iter(|| axis.encode()));
    group.bench_function("update_and_its_two_cycles", |bencher| bencher.iter(|| axis.update()));
    assert_eq!(axis.saturated, 0, "nothing was clamped");
    let telegram = [0; TELEGRAM_MAX];
    group.bench_function("at_bytes_to_values", |bencher| {
        bencher.iter(|| axis.feedback(black_box(&telegram)));
    });
    let mut axis = Axis::on_can();
    group.bench_function("generic_to_rpdo_bytes", |bencher| bencher.iter(|| axis.encode()));
    group.bench_function("update_and_its_two_cycles_on_can", |bencher| bencher.iter(|| axis.update()));
    assert_eq!(axis.saturated, 0, "nothing was clamped");
    let telegram = csp_telegram();
    group
        .bench_function("tpdos_in_and_rpdos_out", |bencher| bencher.iter(|| axis.step(black_box(&telegram))));
    let mut telegrams = changing_telegrams();
    group.bench_function("new_state_in_and_rpdos_out", |bencher| {
        bencher.iter(|| {
            axis.step(black_box(&telegrams[0]));
            telegrams.swap(0, 1);
        });
    });
    group.bench_function("tpdo_bytes_to_values", |bencher| {
        bencher.iter(|| axis.feedback(black_box(&telegram)));
    });
    group.finish();
}
