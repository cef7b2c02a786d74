//! When the box may be started anew.

use super::*;
use crate::target::motion_link::{MotionReply, MotionRequest, Token};

fn granted(rig: &mut Rig) -> bool {
    match rig.request(MotionRequest::PrepareReset(Token(9))) {
        Some(MotionReply::ResetPrepared { token: Token(9), granted }) => granted,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_device_without_controller_and_power_may_be_started_anew() {
    let mut rig = Rig::new();
    assert!(granted(&mut rig));
    rig.open();
    assert!(!granted(&mut rig), "a connection without data is one");
    rig.close();
    rig.silence();
    assert!(granted(&mut rig));
    let mut rig = Rig::stopped();
    assert!(!granted(&mut rig), "owned");
}

#[test]
fn a_device_whose_axes_come_to_a_stop_is_not_started_anew() {
    // Closed and lost in motion, with a drive that takes its time.
    for lost in [false, true] {
        let mut rig = Rig::running();
        rig.drives[1].stuck = true;
        if lost {
            rig.now += 17 * PERIOD;
            let (now, system) = (rig.now(), rig.system());
            rig.device.poll(now, system);
            assert!(matches!(rig.device.poll_reply(), Some(MotionReply::ConnectionLost { .. })));
        } else {
            rig.close();
        }
        rig.silence();
        rig.silence();
        assert!(!rig.drives[0].image.power_enabled && rig.drives[1].image.power_enabled);
        assert!(!granted(&mut rig), "lost {lost}: axis 2 is energized");
        rig.drives[1].stuck = false;
        rig.silence();
        rig.silence();
        assert!(granted(&mut rig), "lost {lost}: both are not");
    }
}
