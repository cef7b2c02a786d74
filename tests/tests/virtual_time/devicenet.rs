//! The whole chain with DeviceNet: a network with arbitration and bit times between the box and simulated drives.

use axisbridge::simulate::program::{self, AxisPlan};
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{Rig, Settings};

/// Two CIP Motion drives at 10 ms and 500 kbit/s.
const BOX: &str = include_str!("devicenet.toml");

fn settings() -> Settings {
    Settings { configuration: BOX.to_owned(), drives: Vec::new(), ..Settings::default() }
}

/// Where the servo of a drive is, in turns of its motor.
fn turns(rig: &Rig, drive: usize) -> f64 {
    let node = rig.devicenet[0].nodes().nth(drive).expect("a drive");
    #[allow(clippy::cast_precision_loss)]
    let turns = node.actual().position.get() as f64 / 1e9;
    turns
}

#[test]
fn two_axes_go_where_the_controller_sends_them() {
    let mut rig = Rig::ready(settings());
    let plans = [AxisPlan::new(1, 2.0, 600.0, 0.002, 6.0), AxisPlan::new(2, 40.0, 700.0, 0.02, 6.0)];
    rig.connect(program::standard(&plans, 6.0));
    let report = rig.run(millis(60_000));
    assert!(report.failure.is_none(), "{report:?}\n{}\n{}", rig.log(), rig.told());
    for (drive, (plan, way)) in plans.iter().zip([1.0, 5.0]).enumerate() {
        let position = turns(&rig, drive) * way;
        assert!((position - plan.target).abs() < plan.window, "{position} is not {}", plan.target);
    }
    rig.devicenet[0].bus_mut().judge();
    assert!(rig.torque_free());
}
