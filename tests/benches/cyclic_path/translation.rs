//! One axis of the engine: values of CIP Motion to the bytes of the drive's connection and back, whole and by its programs.

use std::f64::consts::TAU;
use std::hint::black_box;

use axisbridge::engine::axis::{AxisChannel, Limits, Updates};
use axisbridge::engine::cyclic::{Cycle, Received};
use axisbridge::engine::device::CipAxis;
use axisbridge::mapping::{CipProgram, CipTrackers, DriveProgram, Mapping};
use axisbridge_tests::can_frames;
use axisbridge_tests::rig::{Rig, Settings, UPDATE_PERIOD_US};
use criterion::Criterion;
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::drive_link::{
    AxisCommandImage, Command, DriveAction, DriveImage, SetPoints, Trims, Withheld,
};
use profile_cip::wire::motion::codes::{CommandTarget, ControlMode, FeedbackMode};
use profile_cip::wire::motion::{CommandPosition, CommandValues};
use profile_generic::fault::Reaction;
use profile_generic::image::{AxisCommand, StatusBits};
use profile_generic::interpolation::TargetUpdate;
use profile_generic::mode::OperatingMode;
use profile_generic::program::ConversionReport;
use profile_generic::state::{Action, DriveState, Report};
use profile_generic::time::{DurationNs, MonotonicTime, SystemTime};

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

/// One axis of the engine, in operation, and the programs that it runs.
pub struct Axis {
    channel: AxisChannel,
    cip: CipAxis,
    north: CipProgram,
    trackers: CipTrackers,
    south: DriveProgram,
    period: DurationNs,
    /// What the last update was decoded to.
    command: AxisCommand,
    /// What the device has to know of the drive, and what the axis has to do.
    image: DriveImage,
    order: AxisCommandImage,
    telegram: [u8; TELEGRAM_MAX],
    control: u32,
    status: u32,
    saturated: u32,
    now: MonotonicTime,
    swing: Vec<CommandValues>,
    next: usize,
}

impl Axis {
    /// The turntable of the rig on a SERCOS drive, with the programs that were compiled for it.
    #[must_use]
    pub fn turntable() -> Self {
        let rig = Rig::ready(Settings::default());
        let axis = &rig.engine.axes()[0];
        let north = rig.engine.cip_program(0).expect("an axis of a device").clone();
        Self::new(north, axis.south().expect("it is commissioned").clone())
    }

    /// The same on a CiA 402 drive.
    #[must_use]
    pub fn on_can() -> Self {
        let stage = can_frames::stage(Mapping::embedded().expect("the shipped tables")).expect("its drives");
        Self::new(stage.axes[0].north.clone(), stage.axes[0].south.clone())
    }

    /// Hands on what the motion device says.
    fn command_axis(&mut self, target: Option<MonotonicTime>) {
        let at = (self.now, SystemTime(self.now.0));
        self.cip.command(&mut self.channel, at, &self.order, target);
    }

    fn new(north: CipProgram, south: DriveProgram) -> Self {
        let period = DurationNs::from_micros(i64::from(UPDATE_PERIOD_US));
        let mut channel = AxisChannel::new(Limits::default(), Reaction::DecelerateAndDisable, true);
        channel.set_count(north.count());
        channel.set_south(south.clone());
        channel.keep_updates(Updates { period, may_miss: 4, first: TargetUpdate::Interpolate });
        let order = AxisCommandImage {
            state: AxisState::Running,
            action: DriveAction::Enable,
            action_id: 1,
            reset_id: 0,
            abort: None,
            command: Command::Withheld(Withheld::NoSetPoint),
            test: None,
        };
        let mut telegram = [0; TELEGRAM_MAX];
        let mut axis = Self {
            channel,
            cip: CipAxis::new(north.clone()),
            trackers: north.trackers(),
            north,
            south,
            period,
            command: AxisCommand { mode: OperatingMode::Position, ..AxisCommand::default() },
            image: DriveImage::default(),
            order,
            telegram,
            control: 0,
            status: 0,
            saturated: 0,
            now: START,
            swing: (0..SWING).map(values).collect(),
            next: 0,
        };
        // The drive is ready, is enabled, and follows.
        for report in [Report::Ready, Report::Operating] {
            let shown = axis.south.write_status(
                report,
                OperatingMode::Position.into(),
                StatusBits::empty(),
                &mut telegram,
            );
            assert!(shown, "{report} can be shown");
            axis.step(&telegram);
            axis.command_axis(None);
        }
        axis.status = axis.south.status(&telegram).expect("it is long enough");
        assert_eq!(axis.channel.state(), DriveState::Operating);
        // The first updates are a jump from rest.
        for _ in 0..SWING {
            axis.update();
        }
        assert_eq!(axis.channel.fault(), None);
        axis.saturated = 0;
        axis.hold();
        axis
    }

    /// No more updates come, and the axis stays where it is.
    pub fn hold(&mut self) {
        self.order.command = Command::Withheld(Withheld::NoSetPoint);
        self.command_axis(None);
    }

    /// The values of an update become the generic command.
    pub fn decode(&mut self) {
        let values = black_box(&self.swing[self.next]);
        let report = self.north.decode(values, 0, &mut self.trackers, &mut self.command);
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
        let sequence = match self.order.command {
            Command::Follow(points) => points.sequence.wrapping_add(1),
            Command::Withheld(_) => 0,
        };
        self.order.command = Command::Follow(SetPoints {
            control_mode: ControlMode::POSITION,
            feedback_mode: FeedbackMode(2),
            values: self.swing[self.next],
            trims: Trims::default(),
            target: CommandTarget::INTERPOLATE,
            time_stamp: None,
            target_time: None,
            paced_at: self.now,
            position_reference: 0,
            sequence,
            age_updates: 0,
        });
        let target = self.now + self.period * 2;
        self.command_axis(Some(target));
        for _ in 0..2 {
            self.cycle();
        }
    }

    /// The telegram of a cycle of the bus.
    fn cycle(&mut self) {
        self.now = self.now + CYCLE;
        let cycle = Cycle { acts_at: self.now + CYCLE, span: CYCLE, ahead: CYCLE, late: DurationNs::ZERO };
        let system = SystemTime(self.now.0);
        assert!(self.channel.to_drive(self.now, system, &cycle, Some(&mut self.telegram)));
        black_box(&mut self.telegram);
    }

    /// What a cycle of the bus does for an axis: the drive's bytes to the generic feedback and its state, the generic command and
    /// what the state asks for to bytes.
    pub fn step(&mut self, telegram: &[u8]) {
        self.hear(telegram);
        self.cycle();
    }

    /// Bytes of the drive become the generic feedback, and that what the device has to know of it.
    pub fn feedback(&mut self, telegram: &[u8]) {
        self.hear(telegram);
        self.cip.fill(&self.channel, &mut self.image);
        black_box(&mut self.image);
    }

    fn hear(&mut self, telegram: &[u8]) {
        let received = Received { data: telegram, fresh: true, at: None, alive: true };
        self.channel.from_drive(self.now, SystemTime(self.now.0), self.now, Some(received));
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
    axis.hold();
    let telegram = [0; TELEGRAM_MAX];
    group.bench_function("at_bytes_to_values", |bencher| {
        bencher.iter(|| axis.feedback(black_box(&telegram)));
    });
    let mut axis = Axis::on_can();
    group.bench_function("generic_to_rpdo_bytes", |bencher| bencher.iter(|| axis.encode()));
    group.bench_function("update_and_its_two_cycles_on_can", |bencher| bencher.iter(|| axis.update()));
    assert_eq!(axis.saturated, 0, "nothing was clamped");
    axis.hold();
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
