//! Programs that go well: where the axes get to, by which states, and how closely they follow.

use std::fmt::Write as _;

use axisbridge::simulate::program::{AxisPlan, standard};
use axisbridge_tests::rig::motion::{NANO, TURNTABLE, at_rest, millis};
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cip::controller::{AxisSet, Step};
use profile_cip::wire::class1::Class1Datagram;
use profile_cip::wire::motion::codes::AxisStateCode;
use profile_cip::wire::motion::{CommandFrame, CommandPosition};
use profile_generic::state::Report;

/// Units of a position in nanounits.
fn units(nano: i64) -> f64 {
    let millionths = i32::try_from(nano / 1_000).expect("a position of a few thousand units");
    f64::from(millionths) / 1e6
}

#[test]
fn the_program_of_the_demo_reaches_its_targets_by_the_states_of_the_standard() {
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 3.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 3.0)];
    let mut rig = Rig::ready(Settings::default());
    assert!(rig.elapsed() < millis(3_000), "the bus comes up in {}", rig.elapsed());
    rig.connect(standard(&plans, 3.0));
    let report = rig.run(millis(20_000));
    assert_eq!((report.failure, report.steps_finished), (None, 8), "{}", rig.log());
    assert!(report.synchronous);
    let losses = (report.lost_updates, report.late_updates, report.malformed, report.missed_cycles);
    assert_eq!(losses, (0, 0, 0, 0));
    let mut numbers = String::from("axis target reached following_error_max lost saturated faults\n");
    let mut states = String::new();
    for (place, plan) in plans.iter().enumerate() {
        let axis = &report.axes[place];
        assert_eq!(axis.commanded, Some(plan.target));
        // The drive itself, not what is said of it.
        let really = units(rig.position(place));
        assert!((really - plan.target).abs() <= plan.window, "axis {} stands at {really}", plan.axis);
        let reached = axis.reached.expect("it was Running");
        assert!((reached - really).abs() <= plan.window, "it says {reached} and stands at {really}");
        let counters = rig.engine.axes()[place].counters();
        assert!(counters.commands > 600, "{counters:?}");
        writeln!(
            numbers,
            "{} {:.6} {:.6} {:.6} {} {} {}",
            plan.axis,
            plan.target,
            reached,
            axis.following_error_max,
            counters.lost_telegrams,
            counters.saturated,
            counters.faults
        )
        .expect("a string takes everything");
        let number = u8::try_from(place).expect("two axes");
        let joined = |names: Vec<String>| names.join(" -> ");
        let generic = rig.states(number).iter().map(ToString::to_string).collect();
        let cip = rig.axis_states(number).iter().map(ToString::to_string).collect();
        let seen = axis.states.kept().iter().map(ToString::to_string).collect();
        for (name, list) in [("drive", generic), ("axis", cip), ("controller", seen)] {
            writeln!(states, "{} {name}: {}", plan.axis, joined(list)).expect("a string takes everything");
        }
    }
    // A servo lags; one that follows without any error was not led by set-points.
    assert!((0.000_1..0.002).contains(&report.axes[0].following_error_max), "{numbers}");
    assert!((0.001..0.05).contains(&report.axes[1].following_error_max), "{numbers}");
    insta::assert_snapshot!(format!("{numbers}\n{states}"));
}

#[test]
fn a_velocity_move_turns_at_the_velocity_that_was_asked_for() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::Jog { axis: 1, velocity: -4.0, acceleration: 40.0, jerk: 800.0, seconds: 2.0 },
        Step::Disable(AxisSet::one(1)),
    ]);
    rig.run_until(millis(5_000), "the velocity", |rig| rig.velocity(0) < -39 * NANO / 10);
    rig.run_for(millis(500));
    let (start, from) = (rig.now(), rig.position(0));
    rig.run_for(millis(1_000));
    let (span, way) = (rig.now().since(start), rig.position(0) - from);
    assert_eq!(span, millis(1_000));
    assert!((way + 4 * NANO).abs() < NANO / 1_000, "{way} nanorevolutions in a second at 4 to the left");
    let report = rig.run(millis(10_000));
    assert_eq!(report.failure, None, "{}", rig.log());
    // Only the axis that was asked to start has ever been switched on.
    assert_eq!((rig.watched[0].changes.len(), rig.watched[1].changes.len()), (2, 0));
    assert!(at_rest(&rig) && rig.torque_free());
}

#[test]
fn a_controlled_stop_ends_a_move_with_the_torque_on() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::Together(vec![
            Step::MoveAbsolute { axis: 1, position: 50.0, limits: TURNTABLE },
            Step::Sequence(vec![
                Step::Dwell { seconds: 1.0 },
                Step::Stop { axis: 1, acceleration: 50.0, jerk: 1_000.0 },
            ]),
        ]),
        Step::WaitInWindow { axis: 1, window: 0.001, seconds: 1.0 },
        Step::Dwell { seconds: 0.5 },
        Step::Disable(AxisSet::one(1)),
    ]);
    rig.run_until(millis(10_000), "the stop", |rig| rig.report().steps_finished == 3);
    rig.run_for(millis(100));
    assert!(rig.velocity(0).abs() < NANO / 1_000, "it stands");
    assert_eq!(rig.drive(0).actual().report, Report::Operating, "with torque");
    assert_eq!(rig.report().axes[0].state, Some(AxisStateCode::RUNNING));
    let report = rig.run(millis(5_000));
    assert_eq!(report.failure, None, "{}", rig.log());
    let (commanded, really) = (report.axes[0].commanded.expect("a command"), units(rig.position(0)));
    // A second at five revolutions per second, less the speeding up, plus the slowing down: far from 50.
    assert!((4.5..5.5).contains(&commanded), "{commanded}");
    assert!((commanded - really).abs() < 0.001, "{commanded} {really}");
}

#[test]
fn turning_on_beyond_32_bits_of_counts_leads_to_no_jump() {
    // 200 revolutions are 3.2 thousand million counts: Command Position and Actual Position have rolled over.
    let configuration = BOX.replace("motion_resolution = 1_000_000", "motion_resolution = 16_000_000");
    let mut rig = Rig::ready(Settings { configuration, ..Settings::default() });
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::Jog { axis: 1, velocity: 40.0, acceleration: 400.0, jerk: 8_000.0, seconds: 5.0 },
        Step::Dwell { seconds: 0.2 },
        Step::MoveRelative { axis: 1, distance: 1.25, limits: TURNTABLE },
        Step::Dwell { seconds: 0.2 },
        Step::Disable(AxisSet::one(1)),
    ]);
    rig.run_until(millis(20_000), "the end of the jog", |rig| rig.report().steps_finished == 3);
    let start = rig.position(0);
    assert!(start > 190 * NANO, "{start}");
    let mut fastest = 0;
    rig.run_until(millis(5_000), "the end of the move", |rig| {
        fastest = fastest.max(rig.velocity(0).abs());
        rig.report().steps_finished == 5
    });
    let way = rig.position(0) - start;
    // The move begins where the jog came to rest, to within the standstill of the controller.
    assert!((way - 5 * NANO / 4).abs() < 5_000, "{way}");
    assert!(fastest < 51 * NANO / 10, "{fastest}");
    let report = rig.run(millis(5_000));
    assert_eq!(report.failure, None, "{}", rig.log());
}

/// Where the LREAL Command Position of axis 1 stands in a datagram.
pub fn command_position(datagram: &[u8]) -> Option<usize> {
    /// Headers of an instance and of its cyclic block.
    const HEADERS: usize = 8 + 8;
    let data = Class1Datagram::parse(datagram).ok()?.data;
    let frame = CommandFrame::parse(data).ok()?;
    let mut at = datagram.len() - data.len() + frame.header().buffer_len();
    for instance in frame.instances() {
        let position = instance.cyclic.as_ref().and_then(|block| block.values.position);
        if instance.number == 1
            && position.is_some_and(|position| matches!(position, CommandPosition::Float(_)))
        {
            return Some(at + HEADERS);
        }
        at += instance.buffer_len();
    }
    None
}
