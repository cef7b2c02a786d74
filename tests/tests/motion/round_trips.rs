//! What a value loses on its way to a drive and back, and whether a position drifts.

use std::sync::LazyLock;

use axisbridge::config::Config;
use axisbridge::mapping::{CachedStatus, Cia402Axis, DriveProgram, Mapping, Object, ObjectFacts};
use axisbridge::translate::{Stage, StageAxis};
use axisbridge_tests::can_frames;
use profile_generic::image::{AxisCommand, AxisFeedback, Signal};
use profile_generic::mode::OperatingMode;
use profile_generic::program::{ConversionReport, Field};
use profile_generic::ratio::Ratio;
use profile_generic::state::Action;
use profile_generic::time::DurationNs;
use proptest::prelude::*;

/// Bytes for the values of any drive here.
const TELEGRAM: usize = 64;

/// Cycles that a position is followed.
const CYCLES: i128 = 1_000_000_000;

/// Single cycles of it that are run one by one; set to another number to run more.
const SINGLE: &str = "AXISBRIDGE_TEST_CYCLES";
const SINGLE_CYCLES: u64 = 200_000;

/// The status of a drive that operates in csp.
const OPERATING: u32 = 0x08_1037;

static MAPPING: LazyLock<Mapping> =
    LazyLock::new(|| Mapping::embedded().expect("the shipped tables are sound"));

/// Command and actual value that are the same in a drive without any error.
const PAIRS: [(Signal, Signal); 3] = [
    (Signal::PositionCommand, Signal::PositionActual),
    (Signal::VelocityCommand, Signal::VelocityActual),
    (Signal::TorqueCommand, Signal::TorqueActual),
];

/// A drive with this factor group: increments in turns of the encoder, turns of the motor for those of the load.
fn program(encoder: (u32, u32), gear: (u32, u32)) -> DriveProgram {
    let mut facts = ObjectFacts::new();
    let encoder = [(0x608F, 1, encoder.0), (0x608F, 2, encoder.1)];
    let factors = [(0x6091, 1, gear.0), (0x6091, 2, gear.1), (0x6096, 1, 1), (0x6096, 2, 1)];
    let objects = encoder.into_iter().chain(factors);
    for (index, sub, value) in objects {
        facts.note_data(Object { index, sub }, &value.to_le_bytes());
    }
    facts.note_missing(Object { index: 0x6092, sub: 1 });
    let modes = [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque];
    let axis = Cia402Axis {
        modes: modes.into_iter().map(Into::into).collect(),
        cycle: DurationNs::from_millis(2),
        ..Cia402Axis::default()
    };
    MAPPING.cia402_program(&axis, &facts).expect("the ratios fit 64 bits")
}

fn field<'f>(mut fields: impl Iterator<Item = &'f Field>, signal: Signal) -> &'f Field {
    fields.find(|field| field.signal == signal).expect("every mode has it")
}

/// What comes back of a command, and the count of the drive in generic units, rounded up.
fn there_and_back(program: &DriveProgram, to: Signal, from: Signal, generic: i64) -> Option<(i64, i64)> {
    let mut command = AxisCommand { mode: OperatingMode::Position, ..AxisCommand::default() };
    for (signal, _) in PAIRS {
        command.set(signal, 0);
    }
    command.set(to, generic);
    let (mut sent, mut came) = ([0; TELEGRAM], [0; TELEGRAM]);
    let mut report = ConversionReport::default();
    program.encode(&command, Action::Enable, 0, OPERATING, &mut sent, &mut report);
    if !report.is_clean() {
        return None;
    }
    let (command, actual) = (field(program.command.fields(), to), field(program.feedback.fields(), from));
    let len = command.width.bytes();
    assert_eq!(actual.width, command.width);
    let [out, back] = [command, actual].map(|field| usize::from(field.offset));
    came[back..back + len].copy_from_slice(&sent[out..out + len]);
    let mut feedback = AxisFeedback::default();
    let mut cached = program.cached_status();
    program.decode(&came, false, &mut feedback, &mut cached, &mut report)?;
    assert!(report.is_clean());
    Some((feedback.get(from)?, step(actual.conversion.ratio)))
}

/// One count in generic units, rounded up.
fn step(ratio: Ratio) -> i64 {
    let whole = ratio.to_f64(1).abs().ceil();
    profile_generic::cast::i64_from_f64(whole)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// A value loses at most one unit of the coarser side: of the drive's count and the generic unit.
    #[test]
    fn signals_of_cia_402_drives_lose_at_most_one_count(
        encoder in (1_u32..1 << 28, 1_u32..64), gear in (1_u32..1_000, 1_u32..1_000),
        generic in any::<i64>(), shift in 0_u32..60, which in 0..PAIRS.len(),
    ) {
        let program = program(encoder, gear);
        let (to, from) = PAIRS[which];
        let generic = generic >> shift;
        if let Some((back, lsb)) = there_and_back(&program, to, from, generic) {
            let lost = i128::from(back) - i128::from(generic);
            prop_assert!(lost.abs() <= i128::from(lsb.max(1)), "{to} {generic} came back as {back}, one count is {lsb}");
        }
    }

    #[test]
    fn parameters_of_cia_402_drives_lose_at_most_one_count(
        encoder in (1_u32..1 << 28, 1_u32..64), gear in (1_u32..1_000, 1_u32..1_000),
        generic in any::<i64>(), shift in 0_u32..60,
    ) {
        let generic = generic >> shift;
        for entry in program(encoder, gear).parameters() {
            let Some((bytes, len, false)) = entry.encode(generic) else { continue };
            let Some(from) = entry.from_drive else { continue };
            let back = entry.decode(&bytes[..len]).expect("it can be read");
            let lsb = step(from.ratio).max(1);
            let lost = i128::from(back) - i128::from(generic);
            prop_assert!(lost.abs() <= i128::from(lsb), "{}: {generic} came back as {back}, one count is {lsb}", entry.parameter);
        }
    }
}

/// Something was converted at all: a property that is true of nothing says nothing.
#[test]
fn every_signal_and_most_parameters_go_there_and_back() {
    let program = program((1 << 20, 1), (10, 3));
    for (to, from) in PAIRS {
        let (back, lsb) = there_and_back(&program, to, from, 1_234_567).expect("in range");
        assert!(back != 0 && (back - 1_234_567).abs() <= lsb, "{to}: {back}, {lsb}");
    }
    let both =
        program.parameters().iter().filter(|entry| entry.to_drive.is_some() && entry.from_drive.is_some());
    let names: Vec<_> = both.map(|entry| entry.parameter.to_string()).collect();
    assert!(names.iter().any(|name| name == "acceleration_limit") && names.len() >= 15, "{names:?}");
}

/// A position as the box follows it: the drive's counter, 32 bits that wrap, to the generic model.
struct Followed<'s> {
    axis: &'s StageAxis,
    field: Field,
    cached: CachedStatus,
    feedback: AxisFeedback,
    telegram: [u8; TELEGRAM],
    total: i128,
}

impl<'s> Followed<'s> {
    fn new(axis: &'s StageAxis) -> Self {
        let field = *field(axis.south.feedback.fields(), Signal::PositionActual);
        let mut followed = Self {
            axis,
            field,
            cached: axis.south.cached_status(),
            feedback: AxisFeedback::default(),
            telegram: [0; TELEGRAM],
            total: 0,
        };
        followed.go(0);
        followed
    }

    /// The drive goes on by so many counts within a cycle.
    fn go(&mut self, counts: i128) {
        self.total += counts;
        let modulus = i128::from(self.field.modulo.expect("the counter wraps"));
        let raw = self.total.rem_euclid(modulus);
        // With its sign, where the counter has one.
        let raw = if self.field.width.range().0 < 0 && raw >= modulus / 2 { raw - modulus } else { raw };
        let at = usize::from(self.field.offset);
        let bytes = i64::try_from(raw).expect("a counter").to_le_bytes();
        let len = self.field.width.bytes();
        self.telegram[at..at + len].copy_from_slice(&bytes[..len]);
        let mut report = ConversionReport::default();
        let south = &self.axis.south;
        south
            .decode(&self.telegram, false, &mut self.feedback, &mut self.cached, &mut report)
            .expect("it is long enough");
        assert!(report.is_clean(), "{} after {} counts", self.axis.name, self.total);
    }

    /// Where it is by exact arithmetic, without a counter.
    fn exact(&self) -> i128 {
        let ratio = self.field.conversion.ratio;
        let (num, den) = (i128::from(ratio.num()), i128::from(ratio.den()));
        let twice = 2 * self.total * num;
        // To the nearest, halves away from zero.
        (twice.abs() + den).div_euclid(2 * den) * twice.signum()
    }

    fn check(&self) {
        assert_eq!(
            i128::from(self.feedback.position.0),
            self.exact(),
            "{} after {} counts",
            self.axis.name,
            self.total
        );
    }
}

fn axes() -> Vec<StageAxis> {
    let config =
        Config::parse(include_str!("../../frames/config.toml"), "config.toml").expect("a configuration");
    let sercos = Stage::rehearse(&config, MAPPING.clone()).expect("its drives");
    let can = can_frames::stage(MAPPING.clone()).expect("its drives");
    let wraps = |axis: &StageAxis| {
        axis.south
            .feedback
            .fields()
            .any(|field| field.signal == Signal::PositionActual && field.modulo.is_some())
    };
    sercos.axes.into_iter().chain(can.axes).filter(wraps).collect()
}

/// Whatever the position, many small steps come to the same as one large one: what is followed depends on nothing but the sum.
#[test]
fn many_steps_are_one() {
    for axis in &axes() {
        let modulus = i128::from(Followed::new(axis).field.modulo.expect("it wraps"));
        for (start, step, count) in
            [(0, 7, 100), (modulus / 2 - 50, 3, 1_000), (modulus - 1, -1, 10), (-modulus / 3, -1_001, 500)]
        {
            let (mut one, mut many) = (Followed::new(axis), Followed::new(axis));
            for followed in [&mut one, &mut many] {
                followed.go(start / 4);
                (0..3).for_each(|_| followed.go(start / 4));
            }
            one.go(step * count);
            (0..count).for_each(|_| many.go(step));
            assert_eq!(
                (one.total, one.feedback.position),
                (many.total, many.feedback.position),
                "{}",
                axis.name
            );
            assert_eq!(one.cached, many.cached, "{}: nothing else is kept", axis.name);
            one.check();
        }
    }
}

/// A thousand million cycles to one side, in steps as large as the counter allows, each of which stands for many cycles (see
/// above), and back to the place where it began.
#[test]
fn a_position_does_not_drift_in_a_thousand_million_cycles() {
    let axes = axes();
    assert!(axes.len() >= 4, "drives of both profiles: {}", axes.len());
    for axis in &axes {
        let mut followed = Followed::new(axis);
        let modulus = i128::from(followed.field.modulo.expect("it wraps"));
        let in_a_cycle = 1_009;
        let whole = CYCLES * in_a_cycle;
        // The image has 64 bits: so far as it can hold.
        let ratio = followed.field.conversion.ratio;
        let most = i128::from(i64::MAX) * i128::from(ratio.den()) / i128::from(ratio.num()) / 2;
        assert!(whole < most, "{}: 10^9 cycles fit the image", axis.name);
        let jump = (modulus / 2 - 1) / in_a_cycle * in_a_cycle;
        let mut cycles = 0;
        for direction in [1, -1, -1, 1] {
            let mut left = whole;
            while left > 0 {
                let step = jump.min(left);
                followed.go(direction * step);
                followed.check();
                left -= step;
                cycles += step / in_a_cycle;
            }
            assert_eq!(followed.total % whole, 0);
        }
        assert_eq!((followed.total, followed.feedback.position.0), (0, 0), "{}", axis.name);
        assert_eq!(cycles, 4 * CYCLES);
    }
}

/// The same cycle by cycle, as many as there is time for.
#[test]
fn a_position_does_not_drift_cycle_by_cycle() {
    let cycles = std::env::var(SINGLE).ok().and_then(|text| text.parse().ok()).unwrap_or(SINGLE_CYCLES);
    for axis in &axes() {
        let mut followed = Followed::new(axis);
        let modulus = i128::from(followed.field.modulo.expect("it wraps"));
        // The counter wraps about every seven cycles, never at the same place.
        let step = modulus / 7 + 11;
        for cycle in 0..cycles {
            followed.go(if cycle % 1_000 < 500 { step } else { 1 - step });
        }
        followed.check();
        println!("{}: {cycles} cycles, {} counts", axis.name, followed.total);
    }
}
