//! CiA 402 drives: the families of the field as their manuals and EDS files have them, and drives with one thing odd.

use std::cell::RefCell;
use std::rc::Rc;

use axisbridge_peers::can_drive::CanDrive;
use axisbridge_peers::can_drive::settings::Settings as Oddities;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::{Limits, Step};
use profile_cip::wire::motion::codes::ControlMode;

use super::{AXIS, Outcome, does, said, table};

const HEAD: &str = r#"
[box]
name = "odd"

[[device]]
name = "front"
listen = "10.0.0.2"
axes = ["axis"]
update_period = { min = "4 ms", max = "32 ms" }

[device.identity]
vendor_id = 1
product_code = 1001
serial_number = 0x0041_4201
product_name = "Axisbridge odd"

[[axis]]
name = "axis"
instance = 1
drive = "drive"
unit = "revolution"
motion_resolution = 1_000_000

[[south.can]]
interface = "in-process"
cycle_time = "4 ms"

[[south.can.drive]]
name = "drive"
node = 3
"#;

const LIMITS: Limits = Limits { velocity: 1.0, acceleration: 4.0, jerk: 40.0 };

/// Drives the peer, and says what became of it.
fn run(oddities: Oddities, keys: &str, mode: ControlMode) -> Outcome {
    let turn = oddities.counts_per_turn;
    let drive = Rc::new(RefCell::new(CanDrive::new(oddities)));
    let settings =
        Settings { configuration: format!("{HEAD}{keys}\n"), drives: Vec::new(), ..Settings::default() };
    let mut rig = Rig::among(settings, vec![drive.clone()]);
    rig.run_for(millis(5_000));
    let start = drive.borrow().position();
    let velocity = mode == ControlMode::VELOCITY;
    let steps = match velocity {
        false => vec![
            Step::Enable(AXIS),
            Step::MoveAbsolute { axis: 1, position: 1.0, limits: LIMITS },
            Step::Dwell { seconds: 1.0 },
        ],
        true => vec![
            Step::Enable(AXIS),
            Step::RunAt { axis: 1, velocity: 2.0, acceleration: 4.0, jerk: 400.0 },
            Step::Dwell { seconds: 3.0 },
        ],
    };
    let (mut was_enabled, mut fastest) = (false, 0);
    let done = does(&mut rig, mode, steps, 30_000, |_| {
        let drive = drive.borrow();
        was_enabled |= drive.enabled();
        fastest = fastest.max(drive.velocity());
    });
    let drive = drive.borrow();
    if super::is_wordy() {
        println!("{:#?}", drive.log());
        println!(
            "start {start} position {} fastest {fastest} status {:04x}",
            drive.position(),
            drive.status()
        );
        println!("refused {:x?}", drive.refused());
        println!("{}\n{}", rig.told(), rig.log());
    }
    let turn = i64::from(turn);
    let went = match velocity {
        true => (fastest - 2 * turn).abs() < turn / 50,
        false => (drive.position() - turn).abs() < turn / 50,
    };
    let of_drive =
        ["node 3", "cannot be used", "Axis Fault", "was refused", "goes on without", "commissioning of"];
    Outcome { works: done && was_enabled && went, said: said(&rig, &of_drive) }
}

/// A drive of the standard, at node 3.
fn sound() -> Oddities {
    Oddities { node_id: 3, ..Oddities::default() }
}

#[test]
fn families() {
    type Row = (&'static str, fn() -> Oddities, &'static str, ControlMode);
    let rows: [Row; 11] = [
        ("the standard's", Oddities::default, "", ControlMode::POSITION),
        ("maxon EPOS4", Oddities::epos_like, "", ControlMode::POSITION),
        ("Oriental BLVD", Oddities::oriental_like, "", ControlMode::VELOCITY),
        ("Faulhaber CO", Oddities::faulhaber_like, "", ControlMode::VELOCITY),
        ("Faulhaber CF", Oddities::faulhaber_cf_like, "", ControlMode::VELOCITY),
        ("Kollmorgen AKD", Oddities::akd_like, "", ControlMode::POSITION),
        ("Technosoft iPOS", Oddities::ipos_like, "", ControlMode::POSITION),
        ("Kollmorgen RGM", Oddities::kollmorgen_rgm_like, "", ControlMode::POSITION),
        ("Eyou", Oddities::eyou_like, "", ControlMode::POSITION),
        ("ZeroErr eRob", Oddities::zeroerr_like, "", ControlMode::POSITION),
        ("Elmo Gold", Oddities::elmo_like, "", ControlMode::POSITION),
    ];
    let mut outcomes = Vec::new();
    for (name, family, keys, mode) in rows {
        if super::left_out(name) {
            continue;
        }
        outcomes.push((name.to_owned(), run(Oddities { node_id: 3, ..family() }, keys, mode)));
    }
    insta::assert_snapshot!(table(&outcomes));
}
