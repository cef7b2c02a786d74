//! A box with as many axes as it may have, mixed over devices and buses.

use axisbridge::check::{Request, check};
use axisbridge::finding::Severity;
use axisbridge_tests::rig::many::{Crowd, Many, all};
use axisbridge_tests::rig::motion::millis;
use profile_cip::controller::{Limits, Step};
use profile_generic::cast::f64_from_i64;

/// 64 axes: each of four devices has half of its axes on SERCOS, three on each CAN bus and two on DeviceNet.
const MIXED: Crowd = Crowd { sercos: 32, can: &[12, 12], devicenet: &[8] };

/// Slow enough for a drive that gets a position every 20 ms.
const LIMITS: Limits = Limits { velocity: 1.0, acceleration: 4.0, jerk: 40.0 };

/// Where an axis of the box is sent, in turns; no two the same.
fn target(axis: usize) -> f64 {
    let number = f64::from(u8::try_from(axis).expect("few axes"));
    if axis.is_multiple_of(2) { 0.5 + number / 100.0 } else { -0.5 - number / 100.0 }
}

fn program(device: usize, axes: usize) -> Vec<Step> {
    let numbers = || (1..).zip((0..axes).map(|place| target(device * 16 + place)));
    let go = |(axis, position)| Step::MoveAbsolute { axis, position, limits: LIMITS };
    let wait = |(axis, _)| Step::WaitInWindow { axis, window: 0.002, seconds: 5.0 };
    vec![
        Step::Enable(all(axes)),
        Step::Together(numbers().map(go).collect()),
        Step::Together(numbers().map(wait).collect()),
        Step::Disable(all(axes)),
    ]
}

#[test]
fn sixty_four_axes_of_four_devices_on_mixed_buses_go_where_four_controllers_send_them() {
    let mut many = Many::ready(MIXED);
    assert_eq!((many.axis_count(), many.device_count()), (64, 4));
    many.connect(8_000, program);
    many.run_until(millis(60_000), "the end of every program", Many::is_closed);
    for (device, report) in many.reports().iter().enumerate() {
        assert_eq!(report.failure, None, "device {device}\n{}", many.told());
        assert_eq!(report.axes.len(), 16);
        for axis in &report.axes {
            assert_eq!((axis.faults.total, axis.alarms.total), (0, 0), "device {device}\n{}", many.told());
        }
    }
    let status = many.status();
    assert_eq!((status.axis_count, status.counters.lost_updates), (64, 0));
    for (axis, shown) in status.configured_axes().iter().enumerate() {
        let position = f64_from_i64(many.position(axis)) / 1e9;
        assert!((position - target(axis)).abs() < 0.002, "axis {axis}: {position} is not {}", target(axis));
        // What is published of the axis is of this axis and no other.
        let published = f64_from_i64(shown.position.get()) / 1e9;
        assert!((published - target(axis)).abs() < 0.002, "axis {axis}: {published} is not {}", target(axis));
        assert_eq!((usize::from(shown.device), usize::from(shown.instance)), (axis / 16, axis % 16 + 1));
        assert_eq!((shown.faults, shown.lost_telegrams), (0, 0), "axis {axis}\n{}", many.told());
    }
}

/// Clause 2-1.5: drives of a controller may have device update periods of their own. Two axes get the same commands, one on SERCOS at 2 ms and
/// one on CANopen at 8 ms. Each drive takes a set-point at its instant and is there a cycle later, so they are apart by the difference
/// of their cycles, always in the same way.
#[test]
fn drives_of_different_cycles_follow_one_curve_apart_by_the_difference_of_their_cycles() {
    for period_us in [4_000, 8_000] {
        let mut many = Many::ready(Crowd { sercos: 1, can: &[1], devicenet: &[] });
        assert_eq!(many.axis_count(), 2);
        many.connect(period_us, |_, axes| {
            let go = |axis| Step::MoveAbsolute { axis, position: 3.0, limits: LIMITS };
            vec![
                Step::Enable(all(axes)),
                Step::Together(vec![go(1), go(2)]),
                Step::Dwell { seconds: 1.0 },
                Step::Disable(all(axes)),
            ]
        });
        many.run_until(millis(30_000), "constant velocity", |many| many.position(0) > 1_000_000_000);
        let mut apart = Vec::new();
        many.run_until(millis(2_000), "the end of constant velocity", |many| {
            apart.push(many.position(0) - many.position(1));
            many.position(0) > 2_000_000_000
        });
        assert!(apart.len() > 500, "{period_us}: {}", apart.len());
        // At a turn a second: 6 ms. A drive is looked at up to one of its steps after it has moved: 2 ms and 1 ms.
        let out: Vec<_> = apart.iter().filter(|apart| !(5_000_000..=9_500_000).contains(*apart)).collect();
        assert!(out.is_empty(), "{period_us} us: {out:?}");
        many.run_until(millis(30_000), "the end", Many::is_closed);
        for report in many.reports() {
            assert_eq!((report.failure, report.lost_updates), (None, 0), "{}", many.told());
        }
    }
}

/// The titles of the errors that `check` finds in a configuration.
fn errors(name: &str, crowd: Crowd) -> Vec<String> {
    let path = std::env::temp_dir().join(format!("axisbridge-{name}-{}.toml", std::process::id()));
    std::fs::write(&path, crowd.configuration()).expect("a file for the configuration");
    let outcome = check(&Request { config: Some(&path), mappings: &[], frames: false });
    std::fs::remove_file(&path).expect("it was there");
    let errors =
        outcome.tables.findings.list().iter().filter(|found| found.code.severity() == Severity::Error);
    errors.map(|found| found.title.clone()).collect()
}

#[test]
fn a_can_bus_has_room_for_20_axes_at_8_ms_and_a_box_for_64_on_mixed_buses() {
    let bus = |can| Crowd { sercos: 0, can, devicenet: &[] };
    assert_eq!(errors("twenty", bus(&[20])), Vec::<String>::new());
    assert_eq!(errors("mixed", MIXED), Vec::<String>::new());
    assert_eq!(errors("forty", bus(&[40])), ["the cycle cannot hold the PDOs of 40 drives"]);
}
