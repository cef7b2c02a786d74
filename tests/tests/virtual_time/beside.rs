//! What the tests of CAN buses share: something is wrong with the drive of the turntable, or with everybody, and the slide goes on
//! beside it, on a long way at constant speed, unless it is told otherwise.

use axisbridge_tests::rig::Rig;
use axisbridge_tests::rig::motion::{NANO, millis};
use profile_cip::controller::Step;
use profile_cip::wire::motion::codes::ControlMode;

/// How a test sees its bus.
pub struct Beside {
    /// The velocity of the servo of a drive, in nanoturns a second.
    pub velocity: fn(&Rig, usize) -> i64,
    /// Where it is, in nanoturns.
    pub position: fn(&Rig, usize) -> i64,
    /// The turntable is at its speed.
    pub turns: fn(&Rig) -> bool,
    /// The slide is at its speed.
    pub slides: fn(&Rig) -> bool,
}

/// Connects a controller with the turntable in velocity control.
pub fn connect(rig: &mut Rig, program: Vec<Step>) {
    let mut config = rig.controller_config();
    config.axes[0].control_mode = ControlMode::VELOCITY;
    rig.connect_with(config, program);
}

impl Beside {
    /// Goes on until `done` while the slide goes on.
    #[track_caller]
    pub fn go(&self, rig: &mut Rig, limit: i64, what: &str, mut done: impl FnMut(&Rig) -> bool) {
        rig.run_until(millis(limit), what, |rig| {
            assert!((self.slides)(rig), "the slide runs at {}\n{}", (self.velocity)(rig, 1), rig.told());
            done(rig)
        });
    }

    /// The same for so many milliseconds.
    #[track_caller]
    pub fn go_for(&self, rig: &mut Rig, span: i64) {
        let end = rig.now() + millis(span);
        self.go(rig, span + 1_000, "the end of the time", |rig| rig.now() >= end);
    }

    /// The turntable comes to rest within so many milliseconds and stays where it is.
    #[track_caller]
    pub fn stops_within(&self, rig: &mut Rig, limit: i64) {
        self.go(rig, limit, "rest", |rig| (self.velocity)(rig, 0).abs() < NANO / 100);
        self.go_for(rig, 50);
        let stands = (self.position)(rig, 0);
        self.go_for(rig, 300);
        let moved = (self.position)(rig, 0) - stands;
        assert!(moved.abs() < NANO / 1_000, "it moved by {moved} afterwards\n{}", rig.told());
    }

    /// The turntable turns again, to the end of the program; nothing was wrong with the slide, nor with anybody on the bus.
    #[track_caller]
    pub fn runs_again(&self, rig: &mut Rig) {
        self.go(rig, 30_000, "the turntable turns again", |rig| {
            rig.engine.axes()[0].fault().is_none() && (self.turns)(rig)
        });
        self.go_for(rig, 200);
        let report = rig.run(millis(30_000));
        assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
        assert_eq!((report.axes[1].faults.total, report.axes[1].alarms.total), (0, 0), "{}", rig.told());
        assert_eq!(rig.engine.axes()[1].counters().faults, 0);
        assert!(rig.torque_free());
    }
}
