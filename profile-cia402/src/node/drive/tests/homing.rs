//! Every homing method, from every kind of place.

use std::fmt::Write as _;

use profile_generic::capture::CaptureWindow;
use profile_generic::quantity::Position;

use crate::drive::homing::{Method, Progress};
use crate::drive::{State, Statusword, index};
use crate::node::tests::Rig;

const TURN: i64 = 65_536;
/// In thousandths of a turn: the home switch, and the limit switches. Index pulses stand at whole turns.
const HOME: (i64, i64) = (2_300, 2_700);
const LIMITS: (i64, i64) = (-3_400, 6_600);

const THOUSANDTH: i64 = 1_000_000;

/// A drive in the mode homing at a place, in thousandths of a turn. For methods 3 to 6 the home switch is closed all the way
/// to the end.
fn rig(method: i8, place: i64, polarity: i64) -> Rig {
    let mut rig = Rig::new(1);
    let at = |thousandths: i64| Position(thousandths * THOUSANDTH);
    let home = match method {
        3 | 4 | 19 | 20 => (HOME.0, 20_000),
        5 | 6 | 21 | 22 => (-20_000, HOME.1),
        _ => HOME,
    };
    let axis = &mut rig.node.application_mut().axes_mut()[0];
    axis.servo_mut().set_home_switch(Some(CaptureWindow { from: at(home.0), to: at(home.1) }));
    axis.set_limit_switches(at(LIMITS.0), at(LIMITS.1));
    axis.servo_mut().set_position(at(place));
    rig.set(index::POLARITY, 0, polarity).expect("a polarity");
    rig.set(index::HOMING_METHOD, 0, i64::from(method)).expect("a method");
    rig.set(index::HOME_OFFSET, 0, 1_000).expect("an offset");
    rig.set(index::HOMING_SPEEDS, 1, 10 * TURN).expect("a speed");
    rig.set(index::HOMING_SPEEDS, 2, 2 * TURN).expect("a speed");
    rig.run(5);
    rig.enable(6);
    rig
}

fn progress(rig: &Rig) -> Option<Progress> {
    Progress::decode(rig.status(0))
}

/// Homes; the home position, in thousandths of a turn as they were before, or how it ended.
fn home(method: i8, place: i64, polarity: i64) -> String {
    let mut rig = rig(method, place, polarity);
    let before = rig.node.application().axes()[0].servo().position().0;
    assert_eq!(progress(&rig), Some(Progress::InterruptedOrNotStarted));
    rig.set(index::CONTROLWORD, 0, 0x1F).expect("a controlword");
    let mut moved = 0;
    let mut last = before;
    rig.run_until(20_000, |rig| {
        let here = rig.node.application().axes()[0].servo().position().0;
        if progress(rig) == Some(Progress::InProgress) {
            moved += here - last;
        }
        last = here;
        !matches!(progress(rig), Some(Progress::InProgress | Progress::FailedMoving))
    });
    match progress(&rig) {
        Some(Progress::Done) => {
            // Where the axis is now, by the new positions, and by the old ones.
            let sign = if polarity == 0 { 1 } else { -1 };
            let here = rig.node.application().axes()[0].servo().position().0;
            let offset = sign * (1_000 * 1_000_000_000 / TURN);
            let home = before + moved - (here - offset);
            format!("{}", (home + THOUSANDTH / 2).div_euclid(THOUSANDTH))
        }
        other => format!("{other:?}"),
    }
}

#[test]
fn every_method_finds_its_place_from_everywhere() {
    let mut text = String::new();
    let places = [-3_200, 0, 2_500, 4_100, 6_400];
    writeln!(text, "method   from {places:?}").unwrap();
    for method in Method::ALL {
        let found = places.map(|place| home(method, place, 0));
        writeln!(text, "{method:>6}   {}", found.join(", ")).unwrap();
    }
    insta::assert_snapshot!(text);
}

#[test]
fn inverted_positions_find_the_same_places() {
    for method in [1, 4, 8, 9, 12, 17, 24, 33] {
        let place = |polarity| home(method, 0, polarity).parse::<i64>().expect("a place");
        assert_eq!(place(0x80), place(0), "method {method}: polarity has no influence on homing");
    }
}

#[test]
fn bit_4_interrupts_and_begins_anew() {
    let mut rig = rig(23, 0, 0);
    rig.set(index::CONTROLWORD, 0, 0x1F).unwrap();
    rig.run(50);
    assert_eq!(progress(&rig), Some(Progress::InProgress));
    rig.set(index::CONTROLWORD, 0, 0x0F).unwrap();
    assert!(rig.run_until(1_000, |rig| progress(rig) == Some(Progress::InterruptedOrNotStarted)));
    rig.set(index::CONTROLWORD, 0, 0x1F).unwrap();
    assert!(rig.run_until(5_000, |rig| progress(rig) == Some(Progress::Done)));
}

#[test]
fn a_halt_holds_homing_and_lets_it_go_on() {
    let mut rig = rig(23, 0, 0);
    rig.set(index::CONTROLWORD, 0, 0x1F).unwrap();
    rig.run(50);
    rig.set(index::CONTROLWORD, 0, 0x11F).unwrap();
    rig.run(1_000);
    let speed = rig.node.dictionary().number(index::VELOCITY_ACTUAL, 0);
    assert!(speed.abs() < TURN / 50, "{speed}");
    rig.set(index::CONTROLWORD, 0, 0x1F).unwrap();
    assert!(rig.run_until(5_000, |rig| progress(rig) == Some(Progress::Done)));
}

#[test]
fn a_fault_ends_homing() {
    let mut rig = rig(23, 0, 0);
    rig.set(index::CONTROLWORD, 0, 0x1F).unwrap();
    rig.run(50);
    rig.set(0x2FFF, 1, 0x9000).unwrap();
    rig.run(500);
    assert_eq!(rig.state(), State::Fault);
    assert!(!rig.status(0).contains(Statusword::HOMING_ATTAINED));
}
