//! CiA 402 drives: the families of the field as their manuals and EDS files have them, and drives with one thing odd.

use std::cell::RefCell;
use std::rc::Rc;

use axisbridge::status::BoxState;
use axisbridge_peers::can_drive::CanDrive;
use axisbridge_peers::can_drive::settings::{Settings as Oddities, VoltageBit};
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::{Condition, Limits, Step};
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
fn run(mut oddities: Oddities, keys: &str, mode: ControlMode) -> Outcome {
    // The peer counts encoder increments whatever its feed constant says.
    oddities.missing.push((0x6092, None));
    let turn = oddities.counts_per_turn;
    let drive = Rc::new(RefCell::new(CanDrive::new(oddities)));
    let settings = Settings::without_line(format!("{HEAD}{keys}\n"));
    let mut rig = Rig::among(settings, vec![drive.clone()]);
    let mut left = 90;
    while left > 0 && rig.status().state != BoxState::READY || left > 85 {
        rig.run_for(millis(1_000));
        left -= 1;
    }
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
            // What the controller sees is what the drive does.
            Step::Expect {
                condition: Condition::Velocity { axis: 1, velocity: 2.0, tolerance: 0.1 },
                within: millis(3_000),
            },
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
    let of_drive = [
        "node 3",
        "cannot be used",
        "Axis Fault",
        "was refused",
        "continues without",
        "commissioning of",
        "has waited 10 s",
    ];
    Outcome { works: done && was_enabled && went, said: said(&rig, &of_drive) }
}

/// A drive that counts in rpm and does not say it.
fn oriental_without_unit() -> Oddities {
    let mut it = Oddities::oriental_like();
    it.missing.push((0x60A9, None));
    it
}

/// The same, and nobody knows who made it.
fn of_an_unknown_maker() -> Oddities {
    Oddities { vendor: 0x7FFF, ..oriental_without_unit() }
}

/// A drive that is ready without its DC link, and says so by bit 4.
fn akd_without_mains() -> Oddities {
    Oddities { voltage_bit: VoltageBit::Zero, ..Oddities::akd_like() }
}

/// A drive of the standard, at node 3.
fn sound() -> Oddities {
    Oddities { node_id: 3, ..Oddities::default() }
}

#[test]
fn families() {
    type Row = (&'static str, fn() -> Oddities, &'static str, ControlMode);
    let rows: [Row; 18] = [
        ("the standard's", Oddities::default, "", ControlMode::POSITION),
        ("maxon EPOS4", Oddities::epos_like, "", ControlMode::POSITION),
        ("Oriental BLVD", Oddities::oriental_like, "", ControlMode::VELOCITY),
        ("Oriental BLVD without 60A9", oriental_without_unit, "", ControlMode::VELOCITY),
        ("of a maker that nobody knows, the same", of_an_unknown_maker, "", ControlMode::VELOCITY),
        ("the same, told", of_an_unknown_maker, "counts = { velocity = 60 }", ControlMode::VELOCITY),
        ("Faulhaber CO", Oddities::faulhaber_like, "", ControlMode::VELOCITY),
        ("Faulhaber CF", Oddities::faulhaber_cf_like, "", ControlMode::VELOCITY),
        ("Kollmorgen AKD", Oddities::akd_like, "", ControlMode::POSITION),
        ("Kollmorgen AKD without mains", akd_without_mains, "", ControlMode::POSITION),
        ("Technosoft iPOS", Oddities::ipos_like, "", ControlMode::POSITION),
        ("Technosoft iPOS in velocity control", Oddities::ipos_like, "", ControlMode::VELOCITY),
        // 10 000 counts in a turn, 65.536 for each of them in a second.
        ("the same, told", Oddities::ipos_like, "counts = { velocity = 655_360 }", ControlMode::VELOCITY),
        ("Kollmorgen RGM", Oddities::kollmorgen_rgm_like, "", ControlMode::POSITION),
        ("Eyou", Oddities::eyou_like, "", ControlMode::POSITION),
        (
            "Eyou, told",
            Oddities::eyou_like,
            "[[south.can.device]]\nnode = 3\ndevice_type = \"any\"",
            ControlMode::POSITION,
        ),
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

#[test]
fn drives_with_one_thing_odd() {
    use axisbridge_peers::can_drive::settings::{
        Block, CyclicBit, Events, Period, RemoteBit, ShortPdo, VoltageBit,
    };
    type Row = (&'static str, fn(&mut Oddities), &'static str);
    const DEVICE: &str = "[[south.can.device]]\nnode = 3\n";
    let rows: [Row; 47] = [
        ("6502 is not there", |it| it.missing.push((0x6502, None)), ""),
        ("6502 is 0", |it| it.modes_shown = Some(0), ""),
        (
            "6502 tells csp, and it is not there",
            |it| (it.modes, it.modes_shown) = (vec![1, 3, 7], Some(0xFF)),
            "",
        ),
        (
            "the same, told",
            |it| (it.modes, it.modes_shown) = (vec![1, 3, 7], Some(0xFF)),
            "drive_modes = [\"ip\", \"pv\"]",
        ),
        ("modes take 3 s", |it| (it.mode_delay_ms, it.mode_meanwhile) = (3_000, Some(-1)), ""),
        ("6060 cannot be changed while it is enabled", |it| it.mode_refused_enabled = true, ""),
        ("6060 = 0 clears the mode", |it| it.mode_zero_clears = true, ""),
        ("cannot be enabled while 6060 = 0", |it| it.enable_needs_mode = true, ""),
        ("60C2 is not there", |it| it.period = Period::Absent, ""),
        ("60C2 cannot be written", |it| it.period = Period::ReadOnly(1, -3), ""),
        ("60C2 keeps another value", |it| it.period = Period::Sticks(1, -3), ""),
        ("SYNC period 1006 has to be right", |it| it.sync_needs_period = true, ""),
        ("200 SYNCs before it follows", |it| it.sync_warmup = 200, ""),
        ("bit 4 is always 0", |it| it.voltage_bit = VoltageBit::Zero, ""),
        ("bit 4 with the stage on", |it| it.voltage_bit = VoltageBit::Enabled, ""),
        ("bit 9 is always 0", |it| it.remote_bit = RemoteBit::Zero, ""),
        ("bits 7 and 12 are always 1", |it| it.bits_always = 1 << 7 | 1 << 12, ""),
        ("bit 12 is never 1", |it| it.never_follows = true, ""),
        ("bit 12 is never 1, and is to be looked at", |it| it.never_follows = true, "acknowledges = true"),
        ("bit 10 toggles in csp", |it| it.cyclic_bit_10 = CyclicBit::Toggle, ""),
        ("bits 8, 14 and 15 are noise", |it| (it.noise, it.noise_ms) = (1 << 8 | 3 << 14, 7), ""),
        ("bit 6 is 1 in Not ready", |it| (it.not_ready_bit_6, it.not_ready_ms) = (true, 2_000), ""),
        ("each transition takes 300 ms", |it| it.transition_ms = 300, ""),
        ("torque takes 2 s", |it| it.enable_ms = 2_000, ""),
        ("two controlwords in 1 ms are one", |it| it.control_gap_us = 1_000, ""),
        ("without mains", |it| (it.needs_mains, it.mains_wait_ms) = (true, Some(3_000)), ""),
        ("RPDO types 0, 254 and 255", |it| it.rpdo_types = vec![(0, 0), (254, 255)], ""),
        ("RPDO type 255 only", |it| it.rpdo_types = vec![(255, 255)], ""),
        ("TPDO type 255 only", |it| it.tpdo_types = vec![(255, 255)], ""),
        ("TPDO types 252 and 253 only", |it| it.tpdo_types = vec![(252, 253)], ""),
        (
            "asynchronous TPDOs by the timer only",
            |it| (it.tpdo_types, it.events) = (vec![(255, 255)], Events::TimerOnly),
            "",
        ),
        ("mapping fixed at what is needed least", |it| it.mapping_fixed = true, ""),
        (
            "mapping fixed, position only",
            |it| it.mapping_fixed = true,
            "modes = [\"position\"]\nactual_values = []",
        ),
        ("identifiers cannot be changed", |it| it.cob_id_fixed = true, ""),
        ("bit 30 cannot be cleared", |it| it.bit_30_fixed = true, ""),
        ("four entries in a PDO", |it| it.max_entries = 4, ""),
        ("two entries in a PDO", |it| it.max_entries = 2, ""),
        ("a short PDO is a fault", |it| it.short_pdo = ShortPdo::Fault, ""),
        ("nobody tells what velocities are", |it| it.missing.extend([(0x60A9, None), (0x6096, None)]), ""),
        ("6077 is not there", |it| it.missing.push((0x6077, None)), ""),
        ("boots in 4 s", |it| it.boot_ms = 4_000, ""),
        ("no boot-up message", |it| it.silent_boot = true, ""),
        ("restarts every 3 s", |it| it.restarts_every_ms = Some(3_000), ""),
        ("SDO answers after 300 ms", |it| it.sdo_delay_ms = 300, ""),
        ("every tenth SDO request is lost", |it| it.sdo_drops_every = 10, ""),
        ("block transfers get no answer", |it| it.block = Block::Silent, ""),
        ("no heartbeat, guarding only", |it| it.guarding_only = true, "GUARD"),
    ];
    let mut outcomes = Vec::new();
    for (name, change, keys) in rows {
        if super::left_out(name) {
            continue;
        }
        let mut oddities = sound();
        change(&mut oddities);
        let guarded = format!("{DEVICE}guarding = \"50 ms\"");
        let keys = if keys == "GUARD" { guarded.as_str() } else { keys };
        outcomes.push((name.to_owned(), run(oddities, keys, ControlMode::POSITION)));
    }
    insta::assert_snapshot!(table(&outcomes));
}
