//! The whole chain with CANopen drives: a bus with arbitration and bit times between the box and simulated CiA 402 drives.

use axisbridge::simulate::program::{self, AxisPlan};
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{Rig, Settings};
use profile_cia402::node::drive::Axis;
use profile_generic::image::FeedbackSet;

/// Two devices with one axis each at 4 ms.
const BOX: &str = include_str!("can.toml");

fn settings() -> Settings {
    Settings { configuration: BOX.to_owned(), drives: Vec::new(), ..Settings::default() }
}

fn axis(rig: &Rig, device: usize) -> &Axis {
    &rig.can[0].bus.nodes().nth(device).expect("a device").application().axes()[0]
}

#[test]
fn two_axes_go_where_the_controller_sends_them() {
    let mut rig = Rig::ready(settings());
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 6.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 6.0)];
    rig.connect(program::standard(&plans, 6.0));
    let report = rig.run(millis(60_000));
    assert!(report.failure.is_none(), "{report:?}\n{}\n{}", rig.log(), rig.told());
    for (device, (plan, unit)) in plans.iter().zip([1.0, 5.0]).enumerate() {
        #[allow(clippy::cast_precision_loss)]
        let position = axis(&rig, device).actual().position.get() as f64 / 1e9 * unit;
        assert!((position - plan.target).abs() < plan.window, "{position} is not {}", plan.target);
    }
    rig.can[0].bus.bus_mut().judge();
    assert!(rig.torque_free());
}

/// A drive that sends no velocity: the box takes it from the position, and knows when the axis stands.
#[test]
fn the_velocity_of_a_drive_that_does_not_tell_it_follows_from_its_positions() {
    let mut settings = settings();
    let drive = "name = \"drive-a\"\nnode = 1\n";
    assert!(settings.configuration.contains(drive));
    settings.configuration =
        settings.configuration.replace(drive, &format!("{drive}actual_values = [\"torque\"]\n"));
    let mut rig = Rig::ready(settings);
    let told = |rig: &Rig| *rig.engine.axes()[0].feedback();
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 6.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 6.0)];
    rig.connect(program::standard(&plans, 6.0));
    rig.run_until(millis(20_000), "the turntable in motion", |rig| {
        axis(rig, 0).actual().velocity.get() > NANO
    });
    for _ in 0..50 {
        rig.run_for(millis(4));
        let (actual, told) = (axis(&rig, 0).actual().velocity.get(), told(&rig));
        assert!(told.present.contains(FeedbackSet::VELOCITY));
        // Three cycles of 4 ms old at most, of an axis that speeds up by some turns a second squared.
        assert!((told.velocity.get() - actual).abs() < NANO / 5, "{} is not {actual}", told.velocity.get());
    }
    let report = rig.run(millis(60_000));
    assert!(report.failure.is_none(), "{report:?}\n{}\n{}", rig.log(), rig.told());
    assert!(told(&rig).velocity.get().abs() < NANO / 1000, "it stands: {}", told(&rig).velocity.get());
    assert!(rig.torque_free());
}
