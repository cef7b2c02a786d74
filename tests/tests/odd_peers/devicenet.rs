//! DeviceNet slaves of both profiles.

use std::cell::RefCell;
use std::rc::Rc;

use axisbridge_peers::devicenet_slave::DevicenetSlave;
use axisbridge_peers::devicenet_slave::settings::{RefusedSet, Settings as Oddities, UpdateId};
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
update_period = { min = "20 ms", max = "40 ms" }

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

[[south.devicenet]]
interface = "in-process"
bit_rate = 500_000
cycle_time = "10 ms"
mac_id = 1

[[south.devicenet.drive]]
name = "drive"
mac_id = 5
"#;

const LIMITS: Limits = Limits { velocity: 1.0, acceleration: 4.0, jerk: 40.0 };

/// Drives the peer, and says what became of it.
fn run(oddities: Oddities, keys: &str, speed: bool) -> Outcome {
    let slave = Rc::new(RefCell::new(DevicenetSlave::new(oddities)));
    let settings = Settings::without_line(format!("{HEAD}{keys}\n"));
    let mut rig = Rig::among(settings, vec![slave.clone()]);
    rig.run_for(axisbridge_tests::rig::motion::millis(6_000));
    let steps = match speed {
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
    let (mut was_enabled, mut fastest) = (false, 0.0_f64);
    let mode = if speed { ControlMode::VELOCITY } else { ControlMode::POSITION };
    let done = does(&mut rig, mode, steps, 20_000, |_| {
        let slave = slave.borrow();
        was_enabled |= slave.enabled();
        fastest = fastest.max(slave.velocity());
    });
    let slave = slave.borrow();
    if super::is_wordy() {
        println!("{:#?}\nposition {} fastest {fastest}", slave.log(), slave.position());
        println!("{}\n{}", rig.told(), rig.log());
    }
    let went = match speed {
        true => (fastest - 120.0).abs() < 2.0,
        false => (slave.position() - 65_536.0).abs() < 200.0,
    };
    let of_drive = [
        "DeviceNet 1: slave",
        "DeviceNet 1: frame",
        "cannot be used",
        "are ignored",
        "Axis Fault",
        "was refused",
    ];
    Outcome { works: done && was_enabled && went, said: said(&rig, &of_drive) }
}

/// A CIP Motion drive with 65536 counts in a revolution.
fn motion() -> Oddities {
    Oddities { mac: 5, counts_per_unit: 65_536, ..Oddities::motion() }
}

fn speed() -> Oddities {
    Oddities { mac: 5, ..Oddities::speed() }
}

#[test]
fn motion_drives() {
    type Row = (&'static str, fn(&mut Oddities));
    let rows: [Row; 22] = [
        ("as it should be", |_| {}),
        ("another device type", |it| it.device_type = 2),
        ("refuses to be allocated", |it| it.refuse_allocation = Some((0x02, 0x02))),
        ("allocated to another master", |it| it.foreign_master = Some(9)),
        ("allocated to another master for 3 s", |it| {
            (it.foreign_master, it.foreign_master_ms) = (Some(9), 3_000)
        }),
        ("comes on line without asking", |it| it.skips_dup_check = true),
        ("wants the explicit connection first", |it| it.io_needs_explicit = true),
        ("slow explicit answers", |it| it.explicit_delay_ms = 150),
        ("every fifth explicit request unanswered", |it| it.explicit_missing_every = 5),
        ("another service in its answers", |it| it.wrong_service = true),
        ("its own MAC ID in its answers", |it| it.wrong_mac = true),
        ("packet rates in steps of 25 ms", |it| it.packet_rate_step_ms = 25),
        ("packet rate not told", |it| it.silent_packet_rate = true),
        ("answers polls 4 ms late", |it| it.poll_delay_ms = 4),
        ("every seventh poll unanswered", |it| it.poll_missing_every = 7),
        ("poll answers too short", |it| it.poll_short_by = 2),
        ("poll answers too long", |it| it.poll_long_by = 2),
        ("update ID not echoed", |it| it.update_id = UpdateId::Fixed(3)),
        ("another format revision", |it| it.format_revision = 7),
        ("velocity control only", |it| it.control_modes = 1 << 2),
        ("acceleration limit cannot be set", |it| {
            it.refuse_sets = vec![RefusedSet { class: 0x42, attribute: 485, status: 0x0E }];
        }),
        ("restarts every 4 s", |it| it.restart_every_ms = 4_000),
    ];
    let mut outcomes = Vec::new();
    for (name, change) in rows {
        if super::left_out(name) {
            continue;
        }
        let mut oddities = motion();
        change(&mut oddities);
        outcomes.push((name.to_owned(), run(oddities, "resolution = 65_536\n", false)));
    }
    insta::assert_snapshot!(table(&outcomes));
}

#[test]
fn speed_drives() {
    type Row = (&'static str, &'static str, fn(&mut Oddities));
    let rows: [Row; 12] = [
        ("as it should be", "", |_| {}),
        ("basic assemblies only, asked for", "assembly = 20", |it| it.assemblies = vec![20, 70]),
        ("basic assemblies only", "", |it| it.assemblies = vec![20, 70]),
        ("fixed paths of other assemblies", "", |it| {
            (it.fixed_paths, it.consumed_assembly, it.produced_assembly) = (true, 20, 70);
        }),
        ("fixed paths of what is wanted", "", |it| {
            (it.fixed_paths, it.consumed_assembly, it.produced_assembly) = (true, 21, 71);
        }),
        ("tells another size", "", |it| it.told_produced_size = Some(6)),
        ("another SpeedScale", "", |it| it.speed_scale = 2),
        ("another SpeedScale, told", "speed_scale = 2", |it| it.speed_scale = 2),
        ("never at reference", "", |it| it.never_at_reference = true),
        ("never ready", "", |it| it.never_ready = true),
        ("in local control for good", "", |it| it.local_control = true),
        ("actual speed without a sign", "", |it| it.unsigned_speed = true),
    ];
    let mut outcomes = Vec::new();
    for (name, keys, change) in rows {
        if super::left_out(name) {
            continue;
        }
        let mut oddities = speed();
        change(&mut oddities);
        outcomes.push((name.to_owned(), run(oddities, &format!("kind = \"ac-dc\"\n{keys}"), true)));
    }
    insta::assert_snapshot!(table(&outcomes));
}
