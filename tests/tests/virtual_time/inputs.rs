//! Inputs of drives, from the bus to Axis I/O Status, and what follows from limit switches.

use axisbridge::engine::axis::Limits;
use axisbridge_tests::rig::generic::GenericCan;
use axisbridge_tests::rig::motion::{NANO, TURNTABLE, millis};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cia402::node::dictionary::Group;
use profile_cia402::node::drive::Axis;
use profile_cip::controller::sets::DataSets;
use profile_cip::controller::{AttributeSet, AxisSet, Condition, Failure, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::drive_link::DriveImage;
use profile_cip::device::exception::ExceptionAction;
use profile_cip::wire::motion::attribute_list::{AttributeSelector, Range};
use profile_cip::wire::motion::codes::{AxisIoStatus, FaultType, StatusDataSet};
use profile_generic::capture::CaptureWindow;
use profile_generic::image::Signal;
use profile_generic::inhibit::Inhibits;
use profile_generic::mode::OperatingMode;
use profile_generic::quantity::Position;
use profile_generic::state::DriveState;

const TURNTABLE_ONLY: AxisSet = AxisSet::one(1);

/// Hardware Overtravel Input Checking.
const CHECKING: u16 = 737;

/// Bits of Axis Exceptions.
const POSITIVE: u8 = 50;
const NEGATIVE: u8 = 51;

const BOTH_OK: u32 = 0x30;

/// A turntable with limit switches one turn off either way, whose drive sends these values; `stops` is whether the drive does
/// something about them itself.
fn turntable(actual_values: &str, polarity: i64, stops: bool) -> Rig {
    let drive = "name = \"drive-a\"\nnode = 1\n";
    let configuration = include_str!("can.toml");
    assert!(configuration.contains(drive));
    let configuration = configuration.replace(drive, &format!("{drive}actual_values = [{actual_values}]\n"));
    let mut rig = Rig::new(Settings::without_line(configuration));
    let node = rig.can[0].bus.nodes_mut().next().expect("the turntable");
    node.dictionary_mut().set(0x607E, 0, polarity);
    node.dictionary_mut().store(Group::All);
    let axis = &mut node.application_mut().axes_mut()[0];
    axis.set_limit_switches(Position(-NANO), Position(NANO));
    axis.set_ignores_limit_switches(!stops);
    rig.until_ready();
    // The drive has to be heard.
    rig.run_for(millis(100));
    rig
}

const INPUTS: &str = "\"velocity\", \"torque\", \"inputs\"";

fn axis(rig: &Rig) -> &Axis {
    &rig.can[0].bus.nodes().next().expect("the turntable").application().axes()[0]
}

fn position(rig: &Rig) -> i64 {
    axis(rig).actual().position.get()
}

/// What the motion device knows of the drive.
fn image(rig: &Rig) -> &DriveImage {
    rig.engine.devices()[0].device().drive(0).expect("the turntable")
}

fn io_status(rig: &Rig) -> u32 {
    image(rig).io_status.bits()
}

/// Codes of the exceptions that the controller got.
fn codes(rig: &Rig) -> Vec<(FaultType, u8)> {
    rig.report().axes[0].faults.kept().iter().map(|fault| (fault.fault_type, fault.code)).collect()
}

fn checked() -> Step {
    Step::SetAttributes { axis: 1, attributes: vec![AttributeSet::usint(CHECKING, 1)] }
}

fn to(position: f64) -> Step {
    Step::MoveAbsolute { axis: 1, position, limits: TURNTABLE }
}

/// The controller is shown Axis I/O Status, and waits for these bits.
fn shown(on: AxisIoStatus) -> Step {
    let sets =
        DataSets { status: DataSets::default().status | StatusDataSet::IO_STATUS, ..DataSets::default() };
    Step::Sequence(vec![
        Step::DataSets { axis: 1, sets },
        Step::Expect { condition: Condition::IoStatus { axis: 1, bits: on, on: true }, within: millis(500) },
    ])
}

#[test]
fn a_limit_switch_stops_the_axis_and_lets_it_out_and_not_deeper() {
    for (polarity, sign, code, ok) in [
        (0x00, 1.0, POSITIVE, 0x20),
        (0x00, -1.0, NEGATIVE, 0x10),
        // The switch of the servo's way back is at the end of the way forward of the axis.
        (0xC0, 1.0, POSITIVE, 0x20),
        (0xC0, -1.0, NEGATIVE, 0x10),
    ] {
        let what = format!("607E {polarity:02X}, {sign}");
        let mut rig = turntable(INPUTS, polarity, false);
        assert_eq!(io_status(&rig), BOTH_OK, "{what}");
        let both = AxisIoStatus::POSITIVE_OVERTRAVEL_OK | AxisIoStatus::NEGATIVE_OVERTRAVEL_OK;
        rig.connect(vec![checked(), shown(both), Step::Enable(TURNTABLE_ONLY), to(sign * 3.0)]);
        let report = rig.run(millis(20_000));
        assert!(matches!(report.failure, Some(Failure::AxisNotRunning { axis: 1, .. })), "{what}: {report}");
        assert_eq!(codes(&rig), [(FaultType::AXIS, code)], "{what}");
        rig.run_for(millis(2_000));
        assert_eq!(rig.engine.axes()[0].state(), DriveState::Ready, "{what}: cleared by the Forward_Close");
        assert_eq!(io_status(&rig), ok, "{what}");
        let stopped = position(&rig).abs();
        assert!((NANO..3 * NANO / 2).contains(&stopped), "{what}: {stopped}");
        // Deeper is not permitted.
        let by = |position| Step::MoveRelative { axis: 1, distance: position, limits: TURNTABLE };
        let again =
            |step| vec![checked(), Step::FaultReset(TURNTABLE_ONLY), Step::Enable(TURNTABLE_ONLY), step];
        rig.connect(again(by(sign * 3.0)));
        let report = rig.run(millis(20_000));
        assert!(matches!(report.failure, Some(Failure::AxisNotRunning { axis: 1, .. })), "{what}: {report}");
        assert_eq!(codes(&rig), [(FaultType::AXIS, code)], "{what}");
        rig.run_for(millis(2_000));
        let deeper = position(&rig).abs();
        assert!(deeper - stopped < NANO / 10, "{what}: from {stopped} to {deeper}");
        // Out is.
        let mut out = again(Step::Dwell { seconds: 0.5 });
        out.extend([to(0.0), Step::WaitInWindow { axis: 1, window: 0.002, seconds: 2.0 }, shown(both)]);
        rig.connect(out);
        let report = rig.run(millis(20_000));
        assert!(report.failure.is_none(), "{what}: {report}\n{}", rig.log());
        assert_eq!((codes(&rig), io_status(&rig)), (vec![], BOTH_OK), "{what}");
    }
}

/// The drive tells switch and fault at once; the exception that says why comes first.
#[test]
fn a_drive_that_stops_by_itself_at_a_limit_switch_has_its_exception_too() {
    let mut rig = turntable(INPUTS, 0, true);
    rig.connect(vec![checked(), Step::Enable(TURNTABLE_ONLY), to(3.0)]);
    rig.run_until(millis(20_000), "the fault of the drive as well", |rig| {
        let drive = rig.can[0].bus.nodes().next().expect("the turntable");
        rig.engine.axes()[0].state() == DriveState::Faulted && drive.dictionary().number(0x603F, 0) == 0x8612
    });
    rig.run(millis(20_000));
    rig.run_for(millis(1_000));
    let kept = codes(&rig);
    assert!(kept.contains(&(FaultType::AXIS, POSITIVE)), "{kept:?}");
    rig.connect(vec![
        checked(),
        Step::FaultReset(TURNTABLE_ONLY),
        Step::Enable(TURNTABLE_ONLY),
        to(0.0),
        Step::WaitInWindow { axis: 1, window: 0.002, seconds: 2.0 },
    ]);
    let report = rig.run(millis(20_000));
    assert!(report.failure.is_none(), "{report}\n{}", rig.log());
}

#[test]
fn limit_switches_stop_nobody_unless_the_controller_wants_them_checked() {
    let mut rig = turntable(INPUTS, 0, false);
    let negative = AxisIoStatus::NEGATIVE_OVERTRAVEL_OK;
    rig.connect(vec![Step::Enable(TURNTABLE_ONLY), to(3.0), shown(negative), Step::Disable(TURNTABLE_ONLY)]);
    let report = rig.run(millis(20_000));
    assert!(report.failure.is_none(), "{report}\n{}", rig.log());
    assert_eq!((codes(&rig), io_status(&rig)), (vec![], 0x20));
    assert!((position(&rig) - 3 * NANO).abs() < NANO / 100);
}

#[test]
fn an_axis_whose_limit_switches_are_to_be_checked_and_are_not_told_is_inhibited() {
    let mut rig = turntable("\"velocity\", \"torque\"", 0, true);
    assert_eq!(io_status(&rig), 0, "neither bit: it is not known");
    rig.connect(vec![checked(), Step::Enable(TURNTABLE_ONLY)]);
    let report = rig.run(millis(10_000));
    assert!(report.failure.is_some(), "{report}");
    assert_eq!(rig.engine.axes()[0].feedback().inhibits, Inhibits::LIMIT_SWITCHES_NOT_TOLD);
    // Start Inhibits - Mfg, attribute 677.
    assert_eq!(image(&rig).start_inhibits_mfg, 1 << 13);
    let states = rig.axis_states(0);
    assert!(states.contains(&AxisState::StartInhibited), "{states:?}");
    assert!(!states.contains(&AxisState::Starting), "{states:?}");
    assert!(rig.torque_free());
    rig.connect(vec![
        Step::SetAttributes { axis: 1, attributes: vec![AttributeSet::usint(CHECKING, 0)] },
        Step::Enable(TURNTABLE_ONLY),
        to(0.5),
    ]);
    let report = rig.run(millis(10_000));
    assert!(report.failure.is_none(), "{report}\n{}", rig.log());
}

#[test]
fn what_a_limit_switch_leads_to_is_what_the_controller_says() {
    let ignore = |action: ExceptionAction| {
        let range = Range { start: u16::from(POSITIVE), count: 1 };
        let selector = AttributeSelector::array(672, 1, &[range]).expect("one dimension");
        let attributes = vec![AttributeSet { selector, value: vec![action.0], required: true }];
        Step::SetAttributes { axis: 1, attributes }
    };
    for action in [ExceptionAction::IGNORE, ExceptionAction::ALARM] {
        let mut rig = turntable(INPUTS, 0, false);
        rig.connect(vec![
            checked(),
            ignore(action),
            Step::Enable(TURNTABLE_ONLY),
            to(2.0),
            Step::Dwell { seconds: 0.3 },
            to(0.0),
            Step::Dwell { seconds: 0.3 },
            Step::Disable(TURNTABLE_ONLY),
        ]);
        let there = |rig: &Rig| {
            let words = rig.engine.devices()[0].device().fault_words(0).expect("an axis");
            words.exceptions[0] >> POSITIVE & 1 == 1
        };
        rig.run_until(millis(10_000), "the target", |rig| rig.report().steps_finished == 5);
        assert!(there(&rig), "{action}: it stands on the switch");
        let report = rig.run(millis(20_000));
        assert!(report.failure.is_none(), "{action}: {report}\n{}", rig.log());
        assert_eq!((codes(&rig), there(&rig)), (vec![], false), "{action}");
    }
}

#[test]
fn home_switches_of_either_bus_are_home_inputs() {
    let window = CaptureWindow { from: Position(-NANO / 10), to: Position(NANO / 10) };
    let mut rig = turntable(INPUTS, 0, true);
    let node = rig.can[0].bus.nodes_mut().next().expect("the turntable");
    node.application_mut().axes_mut()[0].servo_mut().set_home_switch(Some(window));
    rig.run_for(millis(50));
    assert_eq!(io_status(&rig), BOTH_OK | 0x02);
    rig.connect(vec![shown(AxisIoStatus::HOME_INPUT), Step::Enable(TURNTABLE_ONLY), to(0.5)]);
    assert!(rig.run(millis(10_000)).failure.is_none(), "{}", rig.log());
    assert_eq!(io_status(&rig), BOTH_OK);

    let mut rig = Rig::ready(Settings::default());
    assert_eq!(io_status(&rig), 0, "a SERCOS drive tells no limit switches");
    rig.drive_mut(0).servo_mut().set_home_switch(Some(window));
    rig.run_for(millis(50));
    assert_eq!(io_status(&rig), 0x02);
    rig.connect(vec![shown(AxisIoStatus::HOME_INPUT), Step::Enable(TURNTABLE_ONLY), to(0.5)]);
    assert!(rig.run(millis(10_000)).failure.is_none(), "{}", rig.log());
    assert_eq!(io_status(&rig), 0);
}

/// 60F4 in place of what the box works out.
#[test]
fn a_drive_tells_its_own_following_error() {
    let mut rig = GenericCan::ready(0, [OperatingMode::Position.into()], Limits::default(), |needs, _| {
        needs.left_out.retain(|signal| *signal != Signal::FollowingError);
    });
    rig.enable();
    rig.lead(2 * NANO, OperatingMode::Position.into());
    let mut largest = 0;
    for _ in 0..250 {
        let before = rig.number(0x60F4, 0);
        rig.step();
        let told = rig.feedback().get(Signal::FollowingError).expect("60F4");
        let counts = told * 65_536 / NANO;
        largest = largest.max(counts.abs());
        assert!((counts - before).abs() <= 400, "{counts} is not {before}");
    }
    assert!(largest > 20, "it lags: {largest}");
}
