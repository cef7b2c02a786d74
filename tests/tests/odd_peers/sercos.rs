//! SERCOS III slaves: other classes, fixed lists, orders, addresses, missing parameters, slow and long answers, odd units, and
//! slaves that fail on the way.

use std::cell::RefCell;
use std::rc::Rc;

use axisbridge::status::BoxState;
use axisbridge_peers::sercos_slave::{Connection, Idn, SercosSlave, Settings as Oddities, SvcError};
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{Rig, Settings};
use profile_cip::controller::{Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::codes::ControlMode;
use profile_sercos::checker::Offender;
use profile_sercos::checker::checked_bus::Tried;

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

[axis.limits]
following_error = 0.5

[south.sercos]
interface = "in-process"
cycle_time = "2 ms"
jitter = "100 us"

[[south.sercos.drive]]
name = "drive"
address = 1
"#;

const VELOCITY: &str = "modes = [\"velocity\"]";

const LIMITS: Limits = Limits { velocity: 1.0, acceleration: 4.0, jerk: 40.0 };

/// Lines that are about the slave.
const OF_SLAVE: [&str; 9] = [
    "SERCOS",
    "slave",
    "S-0-0127",
    "cannot be used",
    "Axis Fault",
    "was refused",
    "continues without writing",
    "does without",
    "has waited 10 s",
];

/// A box with the slave.
fn rig(oddities: Oddities, keys: &str) -> (Rig, Rc<RefCell<SercosSlave>>) {
    let slave = Rc::new(RefCell::new(SercosSlave::new(oddities)));
    let settings = Settings { configuration: format!("{HEAD}{keys}\n"), ..Settings::default() };
    (Rig::on_line(settings, vec![slave.clone()]), slave)
}

/// Goes on until the slave is up, or given up.
fn come_up(rig: &mut Rig) {
    let mut left = 60;
    while left > 0 && rig.status().state != BoxState::READY || left > 55 {
        rig.run_for(millis(500));
        left -= 1;
    }
}

fn wordy(rig: &Rig, slave: &SercosSlave) {
    if super::is_wordy() {
        println!("{:#?}", slave.log());
        for refused in slave.refused() {
            let way = if refused.write { "write" } else { "read" };
            println!(
                "{way} of {}.{} {:02x?}: {:04x}",
                refused.idn, refused.element, refused.bytes, refused.code
            );
        }
        for violation in rig.checked.checker.violations() {
            println!("the checker: {violation}");
        }
        println!("{}\n{}", rig.told(), rig.log());
        println!("position {} velocity {} phase {:?}", slave.position(), slave.velocity(), slave.phase());
    }
}

/// Drives the peer, and says what became of it. The peer may break the rules of the wire, the master may not.
fn run(oddities: Oddities, keys: &str, mode: ControlMode) -> Outcome {
    let (mut rig, slave) = rig(oddities, keys);
    rig.tolerating(
        |violation| violation.offender != Offender::Master,
        |rig| {
            come_up(rig);
            drive(rig, &slave, mode)
        },
    )
}

fn drive(rig: &mut Rig, slave: &RefCell<SercosSlave>, mode: ControlMode) -> Outcome {
    let scaling = slave.borrow_mut().settings_mut().scaling;
    // The axis goes the way of the position that the drive shows.
    let way = if scaling.position_polarity & 1 == 0 { 1.0 } else { -1.0 };
    let gear = way * f64::from(scaling.gear_input) / f64::from(scaling.gear_output);
    let start = slave.borrow().position();
    let velocity = mode == ControlMode::VELOCITY;
    let steps = match velocity {
        false => vec![
            Step::Enable(AXIS),
            Step::MoveRelative { axis: 1, distance: 1.0, limits: LIMITS },
            Step::Dwell { seconds: 1.0 },
        ],
        true => vec![
            Step::Enable(AXIS),
            Step::RunAt { axis: 1, velocity: 2.0, acceleration: 4.0, jerk: 400.0 },
            Step::Dwell { seconds: 2.0 },
        ],
    };
    let (mut was_enabled, mut fastest) = (false, 0.0_f64);
    let done = does(rig, mode, steps, 20_000, |_| {
        let slave = slave.borrow();
        was_enabled |= slave.enabled();
        if slave.velocity().abs() > fastest.abs() {
            fastest = slave.velocity();
        }
    });
    let slave = slave.borrow();
    wordy(rig, &slave);
    let went = match velocity {
        true => (fastest / gear - 2.0).abs() < 0.02,
        false => ((slave.position() - start) / gear - 1.0).abs() < 0.001,
    };
    Outcome { works: done && was_enabled && went, said: said(rig, &OF_SLAVE) }
}

fn fixed(command: &[u32], feedback: &[u32]) -> Oddities {
    let list = |idns: &[u32]| idns.iter().map(|idn| Idn::s(*idn)).collect();
    let connections = vec![
        Connection { list: list(command), ..Connection::default() },
        Connection { producer: true, list: list(feedback), ..Connection::default() },
    ];
    Oddities { connections, ..Oddities::fixcfg() }
}

fn without(idns: &[u32]) -> Oddities {
    Oddities { absent: idns.iter().map(|idn| Idn::s(*idn)).collect(), ..Oddities::default() }
}

fn busy(idn: Idn, cycles: u32) -> Oddities {
    Oddities { busy_on: vec![(idn, cycles)], ..Oddities::default() }
}

fn error(idn: u32, write: bool, code: u16) -> Oddities {
    let error = SvcError { idn: Idn::s(idn), element: 7, write, code };
    Oddities { svc_errors: vec![error], ..Oddities::default() }
}

fn with(change: impl FnOnce(&mut Oddities)) -> Oddities {
    let mut it = Oddities::default();
    change(&mut it);
    it
}

type Row = (&'static str, Oddities, &'static str, ControlMode);

fn outcomes(rows: Vec<Row>) -> Vec<(String, Outcome)> {
    let asked = rows.into_iter().filter(|(name, ..)| !super::left_out(name));
    asked.map(|(name, oddities, keys, mode)| (name.to_owned(), run(oddities, keys, mode))).collect()
}

#[test]
fn telegrams_and_classes() {
    const P: ControlMode = ControlMode::POSITION;
    const V: ControlMode = ControlMode::VELOCITY;
    let rows = vec![
        ("SCP_VarCFG", Oddities::default(), "", P),
        ("SCP_VarCFG, velocity", Oddities::default(), "", V),
        ("SCP_FixCFG, velocity", Oddities::fixcfg(), VELOCITY, V),
        ("SCP_FixCFG, velocity, nothing told", Oddities::fixcfg(), "", V),
        ("SCP_FixCFG, position", fixed(&[134, 47], &[135, 51]), "modes = [\"position\"]", P),
        (
            "SCP_FixCFG, position asked of a list for velocity",
            Oddities::fixcfg(),
            "modes = [\"position\"]",
            P,
        ),
        ("SCP_FixCFG, control word last", fixed(&[36, 134], &[40, 51, 135]), VELOCITY, V),
        ("SCP_FixCFG, producer first, a third connection", Oddities::odd_order(), VELOCITY, V),
        (
            "SCP_FixCFG, its setup fixed as well",
            Oddities { fixed_setup: true, ..Oddities::fixcfg() },
            VELOCITY,
            V,
        ),
        ("SCP_FixCFG, a torque command beside", fixed(&[134, 36, 80], &[135, 51, 40]), VELOCITY, V),
        (
            "SCP_FixCFG, both commands, both modes",
            fixed(&[134, 36, 47], &[135, 51, 40]),
            "modes = [\"velocity\", \"position\"]",
            V,
        ),
        ("SCP_FixCFG, without the control word", fixed(&[36], &[135, 51, 40]), VELOCITY, V),
        ("SCP_FixCFG, without the status word", fixed(&[134, 36], &[51, 40]), VELOCITY, V),
        ("SCP_FixCFG, without a position", fixed(&[134, 36], &[135, 40]), VELOCITY, V),
        ("SCP_FixCFG, a diagnosis in the feedback", fixed(&[134, 36], &[135, 390, 51, 40]), VELOCITY, V),
        ("SCP_FixCFG, an empty list", fixed(&[], &[135, 51]), VELOCITY, V),
        (
            "SCP_FixCFG, a length that contradicts the list",
            {
                let mut it = Oddities::fixcfg();
                it.connections[1].declared_length = Some(10);
                it
            },
            VELOCITY,
            V,
        ),
        ("classes unknown", with(|it| it.classes = vec![0x7701]), "", P),
        ("no classes", with(|it| it.classes = Vec::new()), "", P),
        ("both configuration classes", with(|it| it.classes = vec![0x0101, 0x0201, 0x0301]), "", P),
        ("one connection", with(|it| it.connections.truncate(1)), "", P),
        ("eight connections", with(|it| it.connections.resize(8, Connection::default())), "", P),
        ("does not tell what goes into telegrams", without(&[187, 188]), "", P),
        (
            "the same, and shows no torque there",
            Oddities {
                producible: Oddities::default()
                    .producible
                    .into_iter()
                    .filter(|idn| *idn != Idn::s(84))
                    .collect(),
                ..without(&[187, 188])
            },
            "",
            P,
        ),
        ("takes no velocity in a telegram", with(|it| it.consumable.retain(|idn| *idn != Idn::s(36))), "", P),
        ("takes no position in a telegram", with(|it| it.consumable.retain(|idn| *idn != Idn::s(47))), "", P),
        ("shows no velocity in a telegram", with(|it| it.producible.retain(|idn| *idn != Idn::s(40))), "", P),
        ("shows no torque in a telegram", with(|it| it.producible.retain(|idn| *idn != Idn::s(84))), "", P),
        ("shows no position in a telegram", with(|it| it.producible.retain(|idn| *idn != Idn::s(51))), "", P),
        ("address 77", with(|it| it.address = 77), "", P),
        ("address 0", with(|it| it.address = 0), "", P),
        ("no drive", with(|it| it.profile = 1), "", P),
    ];
    insta::assert_snapshot!(table(&outcomes(rows)));
}

#[test]
fn parameters_and_the_service_channel() {
    const P: ControlMode = ControlMode::POSITION;
    const V: ControlMode = ControlMode::VELOCITY;
    let rows = vec![
        ("a small drive, velocity only", Oddities::sparse(), "", V),
        ("a small drive, told", Oddities::sparse(), VELOCITY, V),
        ("a small drive, asked for position", Oddities::sparse(), "modes = [\"position\"]", P),
        ("velocity only", with(|it| (it.modes, it.selected_modes) = (vec![2], [2, 0, 0, 0])), "", V),
        (
            "modes not told, set to velocity",
            with(|it| {
                (it.modes, it.absent) = (vec![2], vec![Idn::s(292)]);
                it.selected_modes = [2, 0, 0, 0];
            }),
            "",
            V,
        ),
        (
            "modes not told, set to what it does not have",
            with(|it| (it.modes, it.absent) = (vec![2], vec![Idn::s(292)])),
            "",
            V,
        ),
        (
            "modes not told, set to nothing",
            with(|it| (it.absent, it.selected_modes) = (vec![Idn::s(292)], [0; 4])),
            "",
            P,
        ),
        (
            "no position mode of a number that is known",
            with(|it| (it.modes, it.selected_modes) = (vec![4, 2], [4, 2, 0, 0])),
            "",
            P,
        ),
        ("modes of SERCOS II's bits", with(|it| it.old_mode_bits = true), "", P),
        ("without class 1 diagnostic", without(&[11]), "", P),
        ("without a diagnostic number", without(&[390]), "", P),
        ("without the interface status", without(&[14]), "", P),
        ("without a modulo value", without(&[103]), "", P),
        ("without the scaling of torque", without(&[86, 93, 94]), "", P),
        ("without the scaling of position", without(&[76, 77, 78, 79]), "", P),
        ("without polarities", without(&[43, 55, 85]), "", P),
        ("without a gear", without(&[121, 122, 123]), "", P),
        ("without limits", without(&[38, 39, 49, 50, 91, 92, 138]), "", P),
        ("without a reset", without(&[99]), "", P),
        ("without names", without(&[17, 21, 22]), "", P),
        ("Latin-1, empty and long names", Oddities::odd_names(), "", P),
        ("a list of 10 000 entries", with(|it| it.long_list = 10_000), "", P),
        ("every step busy for 5 cycles", with(|it| it.busy_cycles = 5), "", P),
        ("every step busy for 60 cycles", with(|it| it.busy_cycles = 60), "", P),
        ("S-0-0079 busy for 3 000 cycles", busy(Idn::s(79), 3_000), "", P),
        ("S-0-0079 busy for good", busy(Idn::s(79), u32::MAX), "", P),
        ("handshake 6 cycles late", with(|it| it.handshake_delay = 6), "", P),
        ("S-0-0079 cannot be read now", error(79, false, 0x7009), "", P),
        ("S-0-0076 write protected", error(76, true, 0x7004), "", P),
        ("S-0-1002 out of range", error(1002, true, 0x7006), "", P),
        ("S-0-0032 out of range", error(32, true, 0x7008), "", P),
        ("scaling read only, its own", with(|it| it.scaling.read_only = true), "", P),
        (
            "scaling read only, a thousandth of a degree",
            with(|it| {
                (it.scaling.read_only, it.scaling.resolution) = (true, 360_000);
                (it.scaling.position_type, it.scaling.modulo) = (0x0A, 360_000);
            }),
            "",
            P,
        ),
        (
            "scaling read only, increments of 16 bits",
            with(|it| {
                (it.scaling.read_only, it.scaling.resolution) = (true, 65_536);
                (it.scaling.position_type, it.scaling.modulo) = (0x0A, 65_536);
            }),
            "",
            P,
        ),
        (
            "scaling read only, a preferred one that is not",
            with(|it| (it.scaling.read_only, it.scaling.resolution) = (true, 65_536)),
            "",
            P,
        ),
        (
            "scaling read only, at the load behind a gear of 5",
            with(|it| {
                (it.scaling.read_only, it.scaling.gear_input, it.scaling.gear_output) = (true, 5, 1);
                (it.scaling.position_type, it.scaling.velocity_type) = (0x42, 0x42);
                (it.scaling.acceleration_type, it.scaling.torque_type) = (0x42, 0x40);
            }),
            "",
            P,
        ),
        (
            "scaling read only, at the motor before a gear of 5",
            with(|it| {
                (it.scaling.read_only, it.scaling.gear_input, it.scaling.gear_output) = (true, 5, 1);
            }),
            "",
            P,
        ),
        (
            "scaling read only, no scaling at all",
            with(|it| {
                it.scaling.read_only = true;
                (it.scaling.position_type, it.scaling.velocity_type) = (0, 0);
                it.scaling.acceleration_type = 0;
            }),
            "",
            P,
        ),
        (
            "scaling read only, linear",
            with(|it| {
                it.scaling.read_only = true;
                (it.scaling.position_type, it.scaling.velocity_type, it.scaling.acceleration_type) =
                    (1, 1, 1);
            }),
            "",
            P,
        ),
        (
            "scaling read only, position reversed",
            with(|it| (it.scaling.read_only, it.scaling.position_polarity) = (true, 0x0F)),
            "",
            P,
        ),
        (
            "a position counted modulo a turn",
            with(|it| (it.scaling.read_only, it.scaling.position_type) = (true, 0x82)),
            "",
            P,
        ),
        ("at the end of the range", with(|it| it.start_position = 596.0), "", P),
    ];
    insta::assert_snapshot!(table(&outcomes(rows)));
}

#[test]
fn phases_and_states() {
    const P: ControlMode = ControlMode::POSITION;
    let commands = |idn, ms| Oddities { command_ms: vec![(Idn::s(idn), ms)], ..Oddities::default() };
    let failing = |idn| Oddities { failing_commands: vec![Idn::s(idn)], ..Oddities::default() };
    let rows = vec![
        ("S-0-0127 takes 3 s", commands(127, 3_000), "", P),
        ("S-0-0128 takes 20 s", commands(128, 20_000), "", P),
        ("S-0-0128 never ends", commands(128, u32::MAX), "", P),
        ("S-0-0127 fails with a list", with(|it| it.refuse_cp3 = vec![Idn::p(7), Idn::s(91)]), "", P),
        (
            "S-0-0127 fails with an empty list",
            with(|it| (it.refuse_cp3, it.empty_invalid_lists) = (vec![Idn::p(7)], true)),
            "",
            P,
        ),
        ("S-0-0128 fails with a list", with(|it| it.refuse_cp4 = vec![Idn::s(100)]), "", P),
        (
            "S-0-0128 fails, and is not busy",
            with(|it| (it.refuse_cp4, it.error_without_busy) = (vec![Idn::s(100)], true)),
            "",
            P,
        ),
        ("S-0-0127 fails without a reason", failing(127), "", P),
        ("ignores the switch to CP1", with(|it| it.ignore_switch_to = Some(1)), "", P),
        ("ignores the switch to CP2", with(|it| it.ignore_switch_to = Some(2)), "", P),
        ("ignores the switch to CP3", with(|it| it.ignore_switch_to = Some(3)), "", P),
        ("ignores the switch to CP4", with(|it| it.ignore_switch_to = Some(4)), "", P),
        ("needs a pause of 100 ms in a switch", with(|it| it.switch_pause_ms = 100), "", P),
        ("needs a pause of 1 s in a switch", with(|it| it.switch_pause_ms = 1_000), "", P),
        ("a shortest cycle of 4 ms", with(|it| it.shortest_cycle_ns = 4_000_000), "", P),
        ("t1 not below 400 us", with(|it| it.shortest_t1_ns = 400_000), "", P),
        ("does not acknowledge the version", with(|it| it.acknowledge_version = false), "", P),
        ("does not look at the CRC", with(|it| it.check_crc = false), "", P),
        ("new-data bit without a counter", with(|it| it.no_counter = true), "", P),
        ("service channel dead from the start", with(|it| it.stuck_handshake_from_ns = Some(0)), "", P),
        ("hung from the start", with(|it| it.hung_from_ns = Some(0)), "", P),
        ("topology never acknowledged", with(|it| it.stuck_topology = true), "", P),
        ("another interface status", with(|it| it.interface_status = Some(0x0100)), "", P),
        ("without mains", with(|it| it.mains = false), "", P),
        ("ready after 5 s", with(|it| it.ready_ms = 5_000), "", P),
        ("mains after 5 s", with(|it| it.mains_ms = 5_000), "", P),
        ("torque after 2 s", with(|it| it.power_up_ms = 2_000), "", P),
        ("follows after 1 s", with(|it| it.follow_ms = 1_000), "", P),
        ("torque goes after 800 ms", with(|it| it.off_ms = 800), "", P),
        ("turned on by an edge only", with(|it| it.enable_needs_edge = true), "", P),
        ("never says that it follows", with(|it| it.no_follow_bit = true), "", P),
        ("faulted from the start", with(|it| it.error_at = Some((0, 0x0080))), "", P),
        (
            "faulted from the start for good",
            with(|it| (it.error_at, it.lasting_errors) = (Some((0, 0x0080)), 0x0080)),
            "",
            P,
        ),
        ("a shaft that cannot turn", with(|it| it.blocked = true), "", P),
        ("half the velocity", with(|it| it.max_velocity = 0.5), "", P),
    ];
    insta::assert_snapshot!(table(&outcomes(rows)));
}

/// What a slave does wrong while its axis turns.
type Harm = fn(&mut SercosSlave, u64);

/// Lets the axis turn, does the harm, and says what the controller and the drive had of it.
fn harmed(oddities: Oddities, harm: Harm) -> String {
    let (mut rig, slave) = rig(oddities, "");
    rig.tolerating(
        |violation| violation.offender != Offender::Master,
        |rig| {
            come_up(rig);
            let steps = vec![
                Step::Enable(AXIS),
                Step::RunAt { axis: 1, velocity: 2.0, acceleration: 10.0, jerk: 1_000.0 },
                Step::Dwell { seconds: 60.0 },
            ];
            let mut config = rig.controller_config();
            config.axes[0].control_mode = ControlMode::VELOCITY;
            rig.connect_with(config, steps);
            rig.run_for(millis(2_500));
            let velocity = slave.borrow().velocity();
            assert!((velocity - 2.0).abs() < 0.01, "{velocity}\n{}", rig.told());
            let known = rig.notices.len();
            let (now, begin) = (rig.now().0, rig.now());
            harm(&mut slave.borrow_mut(), now);
            let mut left = None;
            while rig.now().since(begin) < millis(3_000) {
                rig.run_for(millis(1));
                if left.is_none() && rig.axis_states(0).last() != Some(&AxisState::Running) {
                    left = Some(rig.now().since(begin).0 / 1_000_000);
                }
            }
            let slave = slave.borrow();
            wordy(rig, &slave);
            let state = left.map_or("goes on".to_owned(), |ms| format!("no longer Running after {ms} ms"));
            let torque = if slave.enabled() { "with torque" } else { "without torque" };
            let turns = if slave.velocity().abs() < 0.01 { "stands" } else { "turns" };
            let mut text = format!("{state}; in the end the drive {turns} {torque}\n");
            for notice in rig.notices.iter().skip(known) {
                let line = notice.to_string();
                if OF_SLAVE.iter().any(|word| line.contains(word)) && !line.contains("is in state consuming")
                {
                    text.push_str(&format!("    {line}\n"));
                }
            }
            text
        },
    )
}

#[test]
fn slaves_that_fail_on_the_way() {
    let plain = Oddities::default;
    let rows: Vec<(&str, Oddities, Harm)> = vec![
        ("nothing", plain(), |_, _| {}),
        ("hung, frames pass", plain(), |it, now| it.settings_mut().hung_from_ns = Some(now)),
        ("dead, frames vanish", plain(), |it, now| it.settings_mut().dead_from_ns = Some(now)),
        ("service channel dead", plain(), |it, now| it.settings_mut().stuck_handshake_from_ns = Some(now)),
        ("its data stand still", plain(), |it, now| it.settings_mut().stuck_new_data_from_ns = Some(now)),
        ("over-current for one telegram", plain(), |it, now| {
            it.settings_mut().flash_error = Some((now, 0x0080))
        }),
        ("over-current", plain(), |it, _| it.raise(0x0080)),
        ("over-current without a number", Oddities { no_diagnostic_number: true, ..plain() }, |it, _| {
            it.raise(0x0080)
        }),
        ("a bit of S-0-0011 that nobody knows", plain(), |it, _| it.raise(0x4000)),
        ("the shaft is blocked", plain(), |it, _| it.settings_mut().blocked = true),
    ];
    let mut text = String::new();
    let mut count = 0;
    for (name, oddities, harm) in rows {
        if super::left_out(name) {
            continue;
        }
        text.push_str(&format!("{name}: {}", harmed(oddities, harm)));
        count += 1;
    }
    println!("{count} rows");
    insta::assert_snapshot!(text);
}
