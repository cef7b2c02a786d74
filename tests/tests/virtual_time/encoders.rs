//! Encoders as the controller sees them: counts of the encoder itself, its velocity and its acceleration, on each kind of bus.

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::controller::{AttributeSet, AxisSet, Step};
use profile_cip::device::axis_state::AxisState;
use profile_sercos::wire::idn::Idn;

use super::loops::near;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: u8 = 0;
const DEVICE_CONFLICT: u8 = 0x10;
const NOT_SUPPORTED: u8 = 0x14;

const TURNTABLE: u8 = 1;
const SLIDE: u8 = 2;

mod id {
    pub const POSITION: u16 = 1402;
    pub const VELOCITY: u16 = 1403;
    pub const ACCELERATION: u16 = 1404;
    pub const UNIT: u16 = 1411;
    pub const RESOLUTION: u16 = 1416;
    pub const INTERPOLATION: u16 = 1417;
    pub const VELOCITY_FILTER: u16 = 1434;
    pub const ACCELERATION_FILTER: u16 = 1435;
    pub const OF_2: u16 = 50;
}

/// Counts in a revolution that these tests set.
const RESOLUTION: u32 = 1_000;
const INTERPOLATION: u32 = 4;
const COUNTS: f64 = 4_000.0;

const REVOLUTION: u8 = 0;
const METRE: u8 = 1;

struct Bench {
    rig: Rig,
    client: Client,
}

impl Bench {
    /// A controller that carries out these steps, and has described encoder 1 of both axes.
    fn start(mut rig: Rig, program: Vec<Step>) -> Self {
        rig.connect(program);
        let client = Client::connect(&mut rig, CONTROLLER);
        let mut bench = Self { rig, client };
        for axis in [TURNTABLE, SLIDE] {
            bench.describe(axis, 0, REVOLUTION);
        }
        bench.describe(TURNTABLE, id::OF_2, REVOLUTION);
        bench
    }

    fn describe(&mut self, axis: u8, offset: u16, unit: u8) {
        assert_eq!(self.set(axis, id::UNIT + offset, &[unit]), OK);
        assert_eq!(self.set(axis, id::RESOLUTION + offset, &RESOLUTION.to_le_bytes()), OK);
        assert_eq!(self.set(axis, id::INTERPOLATION + offset, &INTERPOLATION.to_le_bytes()), OK);
    }

    fn set(&mut self, axis: u8, id: u16, value: &[u8]) -> u8 {
        self.client.ask(&mut self.rig, SET, axis, Some(id), value).0
    }

    fn set_real(&mut self, axis: u8, id: u16, value: f32) -> u8 {
        self.set(axis, id, &value.to_le_bytes())
    }

    fn bytes(&mut self, axis: u8, id: u16) -> Result<[u8; 4], u8> {
        let (status, value) = self.client.ask(&mut self.rig, GET, axis, Some(id), &[]);
        if status == OK { Ok(value.try_into().expect("4 bytes")) } else { Err(status) }
    }

    fn counts(&mut self, axis: u8, id: u16) -> Result<f64, u8> {
        self.bytes(axis, id).map(|bytes| f64::from(i32::from_le_bytes(bytes)))
    }

    fn real(&mut self, axis: u8, id: u16) -> Result<f64, u8> {
        self.bytes(axis, id).map(|bytes| f64::from(f32::from_le_bytes(bytes)))
    }

    /// What a SERCOS drive holds.
    fn idn(&self, axis: u8, number: u16) -> f64 {
        let store = self.rig.line.slaves()[usize::from(axis - 1)].store();
        f64::from(i32::try_from(store.number_of(Idn::standard(number))).expect("32 bits"))
    }

    /// What a CANopen drive holds.
    fn object(&mut self, axis: u8, index: u16) -> f64 {
        let node = self.rig.can[0].bus.nodes_mut().nth(usize::from(axis - 1)).expect("a device");
        f64::from(i32::try_from(node.dictionary().number(index, 0)).expect("32 bits"))
    }

    fn until_velocity(&mut self, axis: u8, nano: i64) {
        self.rig.run_until(millis(20_000), "the velocity", |rig| {
            rig.engine.axes()[usize::from(axis - 1)].feedback().velocity.get() > nano
        });
    }
}

fn jog(axis: u8, velocity: f64, acceleration: f64) -> Step {
    Step::Jog { axis, velocity, acceleration, jerk: acceleration * 20.0, seconds: 8.0 }
}

/// S-0-0051 in 0.0001 degrees and S-0-0053 in 0.0001 mm, S-0-0040 and S-0-0156 in 0.0001 1/min.
#[test]
fn encoders_of_a_sercos_drive_count_in_their_own_units() {
    let program =
        vec![Step::Enable(AxisSet::first(2)), jog(TURNTABLE, 2.0, 10.0), Step::Dwell { seconds: 100.0 }];
    let mut bench = Bench::start(Rig::ready(Settings::default()), program);
    bench.until_velocity(TURNTABLE, 199 * NANO / 100);
    bench.rig.run_for(millis(1_000));
    let before = bench.counts(TURNTABLE, id::POSITION).expect("a position");
    bench.rig.run_for(millis(500));
    let after = bench.counts(TURNTABLE, id::POSITION).expect("a position");
    // A turn in half a second, and the time of two accesses.
    assert!((after - before - COUNTS).abs() < COUNTS / 10.0, "{before} {after}");
    let held = bench.idn(TURNTABLE, 40) / 600_000.0;
    near("velocity", bench.real(TURNTABLE, id::VELOCITY), held, 0.01);
    near("acceleration", bench.real(TURNTABLE, id::ACCELERATION), 0.0, 0.5);
    // The drive folds its place after a turn; the controller sees all turns.
    let fraction = (after / COUNTS).rem_euclid(1.0);
    let held = bench.idn(TURNTABLE, 51) / 3_600_000.0;
    let apart = (fraction - held + 0.5).rem_euclid(1.0) - 0.5;
    assert!(apart.abs() < 0.05, "{fraction} {held}");

    // The encoder at the load turns as the load does.
    let load = bench.counts(TURNTABLE, id::POSITION + id::OF_2).expect("a position") / COUNTS;
    let held = bench.idn(TURNTABLE, 53) / 3_600_000.0;
    let apart = (load - held + 0.5).rem_euclid(1.0) - 0.5;
    assert!(apart.abs() < 0.05, "{load} {held}");
    near("velocity 2", bench.real(TURNTABLE, id::VELOCITY + id::OF_2), 2.0, 0.01);
    assert_eq!(bench.real(TURNTABLE, id::ACCELERATION + id::OF_2), Err(NOT_SUPPORTED));
}

/// A slide on a screw of 10 mm: the motor turns, and a scale of a metre in as many counts measures the slide.
#[test]
fn what_an_encoder_counts_in_is_what_the_controller_has_said_last() {
    let mut bench = Bench::start(Rig::ready(Settings::default()), vec![Step::Dwell { seconds: 100.0 }]);
    bench.rig.run_until(millis(20_000), "Stopped", |rig| {
        rig.engine.devices()[0].axis_states().all(|(_, state)| state == AxisState::Stopped)
    });
    bench.describe(SLIDE, id::OF_2, METRE);
    let millimetres = bench.idn(SLIDE, 53) / 10_000.0;
    let counts = (millimetres / 1_000.0 * COUNTS).floor();
    near("metres", bench.counts(SLIDE, id::POSITION + id::OF_2), counts, 1.0);
    let turns = bench.idn(SLIDE, 51) / 100_000.0;
    near("turns", bench.counts(SLIDE, id::POSITION), (turns * COUNTS).floor(), 1.0);
    // A scale does not turn, and an encoder whose counts nobody has described counts nothing.
    assert_eq!(bench.set(SLIDE, id::UNIT + id::OF_2, &[REVOLUTION]), OK);
    assert_eq!(bench.counts(SLIDE, id::POSITION + id::OF_2), Err(DEVICE_CONFLICT));
    assert_eq!(bench.set(SLIDE, id::INTERPOLATION, &[0; 4]), OK);
    assert_eq!(bench.counts(SLIDE, id::POSITION), Err(DEVICE_CONFLICT));
    near("velocity without counts", bench.real(SLIDE, id::VELOCITY), 0.0, 0.01);
}

/// The gear of the drive is taken back: 5 turns of the motor for 2 of the load.
#[test]
fn encoder_of_a_canopen_drive_turns_with_the_motor() {
    let mut rig = Rig::new(Settings::without_line(include_str!("can.toml")));
    let node = rig.can[0].bus.nodes_mut().next().expect("a device");
    node.dictionary_mut().set(0x6091, 1, 5);
    node.dictionary_mut().set(0x6091, 2, 2);
    rig.until_ready();
    let program =
        vec![Step::Enable(AxisSet::first(1)), jog(TURNTABLE, 2.0, 10.0), Step::Dwell { seconds: 100.0 }];
    let mut bench = Bench::start(rig, program);
    bench.until_velocity(TURNTABLE, 199 * NANO / 100);
    bench.rig.run_for(millis(1_000));
    let position = |bench: &Bench| {
        let nano = bench.rig.engine.axes()[0].feedback().position.get();
        f64::from(i32::try_from(nano / 1_000).expect("32 bits")) / 1e6
    };
    let (least, found) = (position(&bench), bench.counts(TURNTABLE, id::POSITION));
    let most = position(&bench);
    let expected = (least + most) / 2.0 * 2.5 * COUNTS;
    near("position", found, expected, (most - least) * 2.5 * COUNTS + 2.0);
    near("velocity", bench.real(TURNTABLE, id::VELOCITY), 5.0, 0.05);
    let held = bench.object(TURNTABLE, 0x606C);
    assert!(held > 0.0);
    // 60E4h and 60E5h are those of the load.
    let load = bench.counts(TURNTABLE, id::POSITION + id::OF_2);
    near("position 2", load, position(&bench) * COUNTS, COUNTS / 10.0);
    near("velocity 2", bench.real(TURNTABLE, id::VELOCITY + id::OF_2), 2.0, 0.02);
    assert_eq!(bench.real(TURNTABLE, id::VELOCITY_FILTER), Err(NOT_SUPPORTED));
}

/// The acceleration follows from the velocities of the last cycles; its filter lets it follow slowly.
#[test]
fn acceleration_filter_slows_what_is_computed() {
    for (name, configuration) in [("SERCOS", None), ("CiA 402", Some(include_str!("can.toml")))] {
        let [plain, filtered] = [0.0, 5.0].map(|bandwidth| {
            let settings = configuration.map_or_else(Settings::default, Settings::without_line);
            let filter = AttributeSet::real(id::ACCELERATION_FILTER, bandwidth);
            let program = vec![
                Step::SetAttributes { axis: TURNTABLE, attributes: vec![filter] },
                Step::Enable(AxisSet::first(1)),
                // A second and a half to its speed.
                jog(TURNTABLE, 3.0, 2.0),
                Step::Dwell { seconds: 100.0 },
            ];
            let mut bench = Bench::start(Rig::ready(settings), program);
            bench.until_velocity(TURNTABLE, NANO / 4);
            near("filter", bench.real(TURNTABLE, id::ACCELERATION_FILTER), bandwidth.into(), 0.001);
            let found = bench.real(TURNTABLE, id::ACCELERATION).expect("an acceleration");
            // The same in the units of the loops.
            near("acceleration feedback", bench.real(TURNTABLE, 483), found, 0.5);
            found
        });
        assert!((plain - 2.0).abs() < 0.4, "{name}: {plain}");
        // An eighth of a second after its begin, at a time constant of a fifth.
        assert!((0.2..1.6).contains(&filtered), "{name}: {filtered}");
    }
}

/// S-0-0392 in microseconds: 1000 rad/s are 1 ms.
#[test]
fn velocity_filter_is_that_of_a_sercos_drive() {
    let mut bench = Bench::start(Rig::ready(Settings::default()), vec![Step::Dwell { seconds: 100.0 }]);
    bench.rig.run_for(millis(2_000));
    assert_eq!(bench.set_real(TURNTABLE, id::VELOCITY_FILTER, 1_000.0), OK);
    assert_eq!(bench.idn(TURNTABLE, 392), 1_000.0);
    near("filter", bench.real(TURNTABLE, id::VELOCITY_FILTER), 1_000.0, 0.01);
    assert_eq!(bench.set_real(TURNTABLE, id::VELOCITY_FILTER, 0.0), OK);
    assert_eq!(bench.idn(TURNTABLE, 392), 0.0);
}

/// Gear and feed of a DeviceNet drive are not known.
#[test]
fn encoder_of_a_devicenet_drive_is_not_guessed() {
    let settings = Settings::without_line(include_str!("devicenet.toml"));
    let mut rig = Rig::ready(settings);
    rig.connect(vec![Step::Dwell { seconds: 100.0 }]);
    let client = Client::connect(&mut rig, CONTROLLER);
    let mut bench = Bench { rig, client };
    bench.rig.run_for(millis(2_000));
    for id in [id::POSITION, id::VELOCITY, id::ACCELERATION, id::POSITION + id::OF_2] {
        assert_eq!(bench.bytes(TURNTABLE, id), Err(NOT_SUPPORTED), "{id}");
    }
}
