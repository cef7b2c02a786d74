//! The whole chain with CANopen drives: a bus with arbitration and bit times between the box and simulated CiA 402 drives.

use axisbridge::simulate::program::{self, AxisPlan};
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cia402::node::drive::Axis;

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
