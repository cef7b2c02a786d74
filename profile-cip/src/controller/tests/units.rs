//! Units on the wire: positions in counts, velocities and accelerations in units.

use super::peer::Peer;
use super::rig::{COUNTS_PER_UNIT, Rig, config};
use crate::controller::{AxisSet, Limits, Step};
use crate::wire::motion::codes::{CommandDataSet, ControlMode};
use crate::wire::motion::{CommandPosition, CommandValues};

/// Update period of the rig in seconds.
const PERIOD: f64 = 0.002;

/// Runs one motion from rest; gives all the commands with their modes, and the device's updates as they came.
fn run(motion: Step) -> (Vec<(ControlMode, CommandValues)>, Vec<Vec<u8>>) {
    let mut config = config(1);
    config.axes[0].sets.command |= CommandDataSet::ACCELERATION;
    let mut rig = Rig::new(config, Peer::new(&[0.0]), vec![Step::Enable(AxisSet::one(1)), motion]);
    let report = rig.run(10);
    assert_eq!(report.failure, None, "{}", rig.log());
    let commands = &rig.peer.axes[0].commands;
    (commands.iter().map(|(_, block)| (block.control_mode, block.values)).collect(), rig.peer.updates)
}

/// Smallest and largest of the values.
fn range(values: impl Iterator<Item = f32>) -> [f32; 2] {
    values.fold([f32::MAX, f32::MIN], |[least, most], value| [least.min(value), most.max(value)])
}

fn assert_near(found: [f32; 2], expected: [f32; 2]) {
    for (found, expected) in found.into_iter().zip(expected) {
        assert!((found - expected).abs() < 0.001, "{found} against {expected}");
    }
}

#[test]
fn a_jog_sends_its_velocity_and_acceleration_in_units() {
    let jog = Step::Jog { axis: 1, velocity: 20.0, acceleration: 200.0, jerk: 5000.0, seconds: 0.3 };
    let (commands, updates) = run(jog);
    let jogging = || commands.iter().filter(|(mode, _)| *mode == ControlMode::VELOCITY).map(|c| c.1);
    assert!(jogging().all(|values| values.position.is_none()));
    assert_near(range(jogging().filter_map(|values| values.velocity)), [0.0, 20.0]);
    assert_near(range(jogging().filter_map(|values| values.acceleration)), [-200.0, 200.0]);
    // The whole of the cyclic block at constant velocity: velocity control on motor feedback, no request,
    // Configuration Complete, velocity and acceleration given, interpolation, REAL 20.0 and REAL 0.0.
    let block = [2, 2, 0, 1, 0b110, 0b11, 0b111, 2, 0, 0, 0xA0, 0x41, 0, 0, 0, 0];
    let cruising = updates.iter().filter(|update| update.ends_with(&block)).count();
    // 0.3 s less the ramp: 0.1 s at 200 units/s² and 0.04 s for its two jerks, at 2 ms a piece.
    assert!((79..=81).contains(&cruising), "{cruising}");
}

#[test]
fn a_position_move_feeds_velocity_and_acceleration_forward_in_units() {
    let limits = Limits { velocity: 20.0, acceleration: 200.0, jerk: 5000.0 };
    let (commands, _) = run(Step::MoveAbsolute { axis: 1, position: 10.0, limits });
    assert!(commands.iter().all(|(mode, _)| *mode == ControlMode::POSITION));
    let values: Vec<_> = commands.iter().map(|(_, values)| *values).collect();
    assert_near(range(values.iter().filter_map(|v| v.velocity)), [0.0, 20.0]);
    assert_near(range(values.iter().filter_map(|v| v.acceleration)), [-200.0, 200.0]);
    assert_eq!(values.last().unwrap().position, Some(CommandPosition::Float(10_000.0)));
    // The velocity is the slope of the position; the rest is what the jerk bends within two periods.
    let bend = limits.jerk * PERIOD * PERIOD / 6.0;
    for three in values.windows(3) {
        let [before, at, after] = [0, 1, 2].map(|n| three[n].position.unwrap().as_f64() / COUNTS_PER_UNIT);
        let slope = (after - before) / (2.0 * PERIOD);
        let velocity = f64::from(three[1].velocity.unwrap());
        assert!((slope - velocity).abs() <= bend * 1.01 + 1e-5, "{slope} against {velocity} at {at}");
    }
}
