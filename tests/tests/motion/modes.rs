//! Changes of the operating mode, positions that wrap, and a connection that is opened again in the middle of a motion.

use axisbridge::mapping::Mapping;
use axisbridge::simulate::setup;
use profile_cip::controller::{ControllerConfig, Step};
use profile_cip::wire::motion::codes::ControlMode;

use crate::chain::Chain;
use crate::scenario::{AXIS, LIMITS, Moment, run_program};
use crate::table::Table;

/// What a row changes of the controller.
type Change = fn(&mut ControllerConfig);

fn mode(mode: ControlMode) -> Step {
    Step::Mode { axis: 1, mode }
}

fn turn(velocity: f64) -> Step {
    Step::RunAt { axis: 1, velocity, acceleration: LIMITS.acceleration, jerk: LIMITS.jerk }
}

/// Programs whose second step moves the axis.
fn programs() -> Vec<(&'static str, Vec<Step>)> {
    let jog = Step::Jog { axis: 1, velocity: 2.0, acceleration: 20.0, jerk: 400.0, seconds: 1.0 };
    let further = Step::MoveRelative { axis: 1, distance: 0.5, limits: LIMITS };
    let torque = Step::Torque { axis: 1, torque: 10.0, rate: 100.0, velocity_limit: 20.0 };
    let stop = Step::Stop { axis: 1, acceleration: LIMITS.acceleration, jerk: LIMITS.jerk };
    vec![
        ("position, velocity, position", vec![Step::Enable(AXIS), jog, further.clone(), Step::Disable(AXIS)]),
        (
            "torque to position on the move",
            vec![
                Step::Enable(AXIS),
                mode(ControlMode::TORQUE),
                torque,
                Step::Dwell { seconds: 0.1 },
                mode(ControlMode::POSITION),
                further,
                Step::Disable(AXIS),
            ],
        ),
        (
            "velocity to disable on the move",
            vec![
                Step::Enable(AXIS),
                mode(ControlMode::VELOCITY),
                turn(2.0),
                Step::Dwell { seconds: 0.5 },
                turn(-1.0),
                Step::Dwell { seconds: 0.2 },
                stop,
                Step::Disable(AXIS),
            ],
        ),
    ]
}

#[test]
fn mode_changes() {
    let mut table = Table::default();
    for chain in Chain::ALL {
        for (name, program) in programs() {
            table.add(chain, name, &run_program(chain, program, |_| {}, &|_, _| {}));
        }
    }
    insta::assert_snapshot!(table.finish());
}

#[test]
fn position_wraps() {
    let wraps: [(&str, Change); 2] = [
        ("position as DINT", |config| config.axes[0].sets.integer_position = true),
        ("cyclic axis of 0.25 revolutions", |config| {
            let mapping = Mapping::embedded().expect("the shipped tables are sound");
            setup::make_cyclic(&mapping, &mut config.axes[0], 250_000);
        }),
    ];
    let mut table = Table::default();
    for chain in Chain::ALL {
        for (name, change) in wraps {
            let program = crate::scenario::program();
            table.add(chain, name, &run_program(chain, program, change, &|_, _| {}));
        }
    }
    insta::assert_snapshot!(table.finish());
}

/// The controller is gone, and another one takes the axis over: it resets, enables, and moves on.
#[test]
fn reconnect() {
    let mut table = Table::default();
    for chain in Chain::ALL {
        let again = || {
            let reset = Step::FaultReset(AXIS);
            let by = Step::MoveRelative { axis: 1, distance: 0.5, limits: LIMITS };
            vec![reset, Step::Enable(AXIS), by, Step::Disable(AXIS)]
        };
        let outcome = run_program(chain, crate::scenario::program(), |_| {}, &|rig, moment| {
            if moment == Moment::Constant {
                rig.kill_controller();
                rig.run_for(chain.period() * 200);
                let config = chain.controller(rig);
                rig.connect_with(config, again());
            }
        });
        table.add(chain, "another controller", &outcome);
    }
    insta::assert_snapshot!(table.finish());
}
