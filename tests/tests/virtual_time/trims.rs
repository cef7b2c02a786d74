//! Trims in the updates of the controller, from the cyclic write data to the drive and back.

use axisbridge_tests::rig::motion::{NANO, TURNTABLE, millis};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::condition::{Number, ValueCheck};
use profile_cip::controller::program::{CyclicAttribute, CyclicDirection};
use profile_cip::controller::{AttributeSet, AxisSet, Condition, Limits, Step};
use profile_cip::wire::motion::codes::ControlMode;
use profile_cip::wire::status::GeneralStatus;
use profile_generic::fault::FaultCause;
use profile_generic::mode::OperatingMode;
use profile_generic::program::Width;
use profile_sercos::wire::idn::Idn;

const POSITION_TRIM: u16 = 431;
const VELOCITY_TRIM: u16 = 451;
const ACCELERATION_TRIM: u16 = 481;
const TORQUE_TRIM: u16 = 491;

/// Counts, revolutions a second, percent.
type Values = (i32, f32, f32);

fn octets((position, velocity, torque): Values) -> [(u16, Vec<u8>); 3] {
    [
        (POSITION_TRIM, position.to_le_bytes().to_vec()),
        (VELOCITY_TRIM, velocity.to_le_bytes().to_vec()),
        (TORQUE_TRIM, torque.to_le_bytes().to_vec()),
    ]
}

/// All three trims in every update, and read in every answer.
fn lists(values: Values) -> Step {
    let list = |direction| {
        let attributes = octets(values).into_iter();
        let attributes =
            attributes.map(|(id, value)| CyclicAttribute { id, element_size: 4, value }).collect();
        Step::CyclicList { axis: 1, direction, attributes }
    };
    Step::Sequence(vec![list(CyclicDirection::Read), list(CyclicDirection::Write)])
}

fn write(values: Values) -> Step {
    Step::CyclicWrite { axis: 1, values: octets(values).to_vec() }
}

/// What counts of the trims.
fn counts((position, velocity, torque): Values) -> Step {
    let seen = |attribute, width, value| Step::Expect {
        condition: Condition::CyclicRead {
            axis: 1,
            attribute,
            check: ValueCheck { width, value, tolerance: 0.001 },
        },
        within: millis(100),
    };
    Step::Sequence(vec![
        seen(POSITION_TRIM, Width::I32, Number::Integer(position.into())),
        seen(VELOCITY_TRIM, Width::F32, Number::Float(velocity.into())),
        seen(TORQUE_TRIM, Width::F32, Number::Float(torque.into())),
    ])
}

fn dwell(seconds: f64) -> Step {
    Step::Dwell { seconds }
}

/// What the telegrams bring the drive beside its command values: S-0-0037 in 0.0001 1/min and S-0-0081 in 0.1 %.
fn added(rig: &Rig) -> (i64, i64) {
    let store = rig.line.slaves()[0].store();
    (store.number_of(Idn::standard(37)), store.number_of(Idn::standard(81)))
}

fn turntable() -> AxisSet {
    AxisSet::first(1)
}

/// Runs a program to the end of its step number `step`.
fn to_step(rig: &mut Rig, step: usize) {
    rig.run_until(millis(10_000), "a step of the program", |rig| rig.report().steps_finished > step);
}

/// The program runs to its end without a failure.
fn succeeds(rig: &mut Rig) {
    let report = rig.run(millis(5_000));
    assert_eq!(report.failure, None, "{}", rig.log());
}

fn ready(program: Vec<Step>) -> Rig {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(program);
    rig
}

#[test]
fn in_position_control_one_goes_into_the_command_and_two_to_the_loops_of_the_drive() {
    let mut rig = ready(vec![
        lists((0, 0.0, 0.0)),
        Step::Enable(turntable()),
        write((2_500, 0.0, 0.0)),
        counts((2_500, 0.0, 0.0)),
        dwell(0.3),
        write((0, 0.5, 12.5)),
        counts((0, 0.5, 12.5)),
        dwell(0.3),
        Step::Disable(turntable()),
        counts((0, 0.0, 0.0)),
        dwell(0.1),
    ]);
    to_step(&mut rig, 4);
    assert!((rig.position(0) - NANO / 400).abs() < NANO / 100_000, "{}", rig.position(0));
    assert_eq!(added(&rig), (0, 0), "the position has it already");
    to_step(&mut rig, 7);
    // 0.5 turns a second are 30 1/min.
    assert_eq!(added(&rig), (300_000, 125));
    // The drive adds the velocity behind its position loop of 50 1/s, which stands against it by a hundredth of a turn.
    assert!((rig.position(0) - NANO / 100).abs() < NANO / 1_000, "{}", rig.position(0));
    to_step(&mut rig, 10);
    assert_eq!(added(&rig), (0, 0), "without torque nothing is added");
    succeeds(&mut rig);
}

#[test]
fn in_velocity_control_the_velocity_has_it_and_the_torque_is_added_by_the_drive() {
    let mut rig = ready(vec![
        Step::Mode { axis: 1, mode: ControlMode::VELOCITY },
        lists((0, 0.0, 0.0)),
        Step::Enable(turntable()),
        Step::RunAt { axis: 1, velocity: 2.0, acceleration: 50.0, jerk: 1_000.0 },
        write((777, 0.25, -5.0)),
        counts((0, 0.25, -5.0)),
        dwell(0.3),
        write((0, 0.0, 0.0)),
        Step::Stop { axis: 1, acceleration: 50.0, jerk: 1_000.0 },
        Step::Disable(turntable()),
    ]);
    to_step(&mut rig, 6);
    assert!((rig.velocity(0) - 9 * NANO / 4).abs() < NANO / 100, "{}", rig.velocity(0));
    assert_eq!(added(&rig), (0, -50));
    succeeds(&mut rig);
}

#[test]
fn in_torque_control_the_torque_has_it_and_nothing_counts_twice_in_between() {
    let mut rig = ready(vec![
        lists((0, 0.0, 4.0)),
        Step::Enable(turntable()),
        dwell(0.1),
        Step::Mode { axis: 1, mode: ControlMode::TORQUE },
        counts((0, 0.0, 4.0)),
        Step::Torque { axis: 1, torque: 6.0, rate: 1_000.0, velocity_limit: 20.0 },
        dwell(0.02),
        Step::Mode { axis: 1, mode: ControlMode::POSITION },
        dwell(0.1),
        Step::Disable(turntable()),
    ]);
    rig.drive_mut(0).set_mode_delay(millis(20));
    let mut most = 0;
    to_step(&mut rig, 2);
    while rig.report().steps_finished < 9 {
        rig.step();
        let torque_mode = rig.status().axes[0].mode == OperatingMode::Torque;
        let command = rig.line.slaves()[0].store().number_of(Idn::standard(80));
        most = most.max(added(&rig).1 + if torque_mode { command } else { 0 });
    }
    assert_eq!(most, 100, "6 % and 4 %");
    assert_eq!(added(&rig), (0, 40), "in position control again");
}

/// A trim that would throw the axis aside is no trim: the axis stops where it is.
#[test]
fn a_position_trim_further_than_the_axis_can_move_is_not_followed() {
    for (name, before, after) in [("while it stands", 0, 5_000_000), ("at the start", 5_000_000, 5_000_000)] {
        let mut settings = Settings::default();
        settings.configuration =
            settings.configuration.replace("following_error = 0.5", "velocity = 10.0\nfollowing_error = 0.5");
        let mut rig = Rig::ready(settings);
        rig.connect(vec![
            lists((before, 0.0, 0.0)),
            Step::Enable(turntable()),
            dwell(0.1),
            write((after, 0.0, 0.0)),
            dwell(0.3),
        ]);
        rig.run_until(millis(5_000), "the fault", |rig| {
            rig.engine.axes()[0].faults().any(|fault| fault.fault.cause == FaultCause::VELOCITY_COMMAND_LIMIT)
        });
        rig.run_for(millis(200));
        assert!(rig.position(0).abs() < NANO / 1_000, "{name}: moved to {}", rig.position(0));
        assert_eq!(added(&rig), (0, 0));
    }
}

/// Trims are of their connection, and of the updates that bring them.
#[test]
fn a_trim_ends_with_the_updates_that_bring_it() {
    let list = |attributes| Step::CyclicList { axis: 1, direction: CyclicDirection::Write, attributes };
    let program = || {
        vec![
            lists((0, 0.0, 10.0)),
            Step::Enable(turntable()),
            counts((0, 0.0, 10.0)),
            dwell(0.1),
            list(vec![]),
            counts((0, 0.0, 0.0)),
            dwell(0.1),
        ]
    };
    let mut rig = ready(program());
    to_step(&mut rig, 3);
    assert_eq!(added(&rig), (0, 100));
    to_step(&mut rig, 5);
    assert_eq!(added(&rig), (0, 0), "another list without it");
    succeeds(&mut rig);

    let mut rig = ready(program());
    to_step(&mut rig, 3);
    rig.kill_controller();
    rig.run_until(millis(2_000), "no torque", Rig::torque_free);
    assert_eq!(added(&rig), (0, 0), "the controller is gone");
    rig.run_for(millis(1_000));
    rig.connect(vec![Step::FaultReset(turntable()), Step::Enable(turntable()), dwell(0.2)]);
    to_step(&mut rig, 2);
    assert_eq!(added(&rig), (0, 0), "a connection begins without trims");
}

/// A Set service changes no trim, a drive without the IDN shows that its trim does not count, and the acceleration has none.
#[test]
fn what_cannot_be_added_is_refused_or_reads_zero() {
    let attributes = vec![AttributeSet::real(TORQUE_TRIM, 1.0)];
    let mut rig = ready(vec![Step::SetAttributes { axis: 1, attributes }]);
    rig.run(millis(5_000));
    assert!(rig.log().contains("attribute not settable"), "{}", rig.log());
    let list = |id| Step::CyclicList {
        axis: 1,
        direction: CyclicDirection::Write,
        attributes: vec![CyclicAttribute { id, element_size: 4, value: vec![0; 4] }],
    };
    let mut rig = ready(vec![list(ACCELERATION_TRIM)]);
    rig.run(millis(5_000));
    let unsupported = GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.to_string();
    assert!(rig.log().contains(&unsupported), "{}", rig.log());

    let mut rig = Rig::new(Settings::default());
    rig.line.slaves_mut()[0].store_mut().remove(Idn::standard(37));
    rig.run_until(millis(20_000), "the bus in CP4", |rig| rig.status().phase == 4);
    rig.connect(vec![
        lists((0, 0.5, 2.0)),
        Step::Enable(turntable()),
        counts((0, 0.0, 2.0)),
        dwell(0.1),
        Step::Disable(turntable()),
    ]);
    succeeds(&mut rig);
}

/// 60B1 in counts a second and 60B2 in 0.1 %; a trim that is not sent to the drive has no effect, and reads as that.
#[test]
fn a_canopen_drive_adds_the_offsets_that_its_configuration_names() {
    for (offsets, velocity, torque) in
        [("\"velocity\", \"torque\"", 0.5, 12.5), ("\"torque\"", 0.0, 12.5), ("", 0.0, 0.0)]
    {
        let drive = "name = \"drive-a\"\nnode = 1\n";
        let configuration = include_str!("can.toml");
        assert!(configuration.contains(drive));
        let configuration = configuration.replace(drive, &format!("{drive}offsets = [{offsets}]\n"));
        let mut rig = Rig::ready(Settings::without_line(configuration));
        rig.connect(vec![
            lists((0, 0.0, 0.0)),
            Step::Enable(turntable()),
            write((2_500, 0.5, 12.5)),
            counts((2_500, velocity, torque)),
            dwell(0.3),
            Step::Disable(turntable()),
            counts((0, 0.0, 0.0)),
            dwell(0.1),
        ]);
        let sent = |rig: &Rig| {
            let node = rig.can[0].bus.nodes().next().expect("the turntable");
            [0x60B1, 0x60B2].map(|index| node.dictionary().number(index, 0))
        };
        to_step(&mut rig, 4);
        let wanted = [if velocity > 0.0 { 65_536 / 2 } else { 0 }, if torque > 0.0 { 125 } else { 0 }];
        assert_eq!(sent(&rig), wanted, "{offsets}");
        to_step(&mut rig, 7);
        assert_eq!(sent(&rig), [0, 0], "without torque nothing is added");
        succeeds(&mut rig);
    }
}

/// Kvff (440) is S-0-0296 of a lag-less drive: the part of the velocity that its position loop need not make from an error.
#[test]
fn velocity_feed_forward_takes_the_following_error_away() {
    for (gain, written, expected) in [(0.0, 0, NANO / 25), (50.0, 5_000, NANO / 50), (100.0, 10_000, 0)] {
        let mut rig = ready(vec![
            Step::SetAttributes { axis: 1, attributes: vec![AttributeSet::real(440, gain)] },
            Step::Enable(turntable()),
            Step::MoveAbsolute { axis: 1, position: 3.0, limits: Limits { velocity: 2.0, ..TURNTABLE } },
            Step::Disable(turntable()),
        ]);
        rig.run_until(millis(5_000), "the velocity", |rig| rig.velocity(0) > 199 * NANO / 100);
        rig.run_for(millis(500));
        assert_eq!(rig.line.slaves()[0].store().number_of(Idn::standard(296)), written);
        let error = rig.drive(0).actual().following_error.0;
        assert!(rig.velocity(0) > 199 * NANO / 100, "still on its way");
        assert!((error - expected).abs() < NANO / 500, "{gain} %: {error}");
        succeeds(&mut rig);
    }
}
