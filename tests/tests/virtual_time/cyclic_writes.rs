//! Gains and limits in the cyclic write data of the controller: from the updates to the drive, and its refusal back.

use axisbridge::mapping::{Access, Mapping, Truth};
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{TURNTABLE, millis};
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::controller::program::{CyclicAttribute, CyclicDirection};
use profile_cip::controller::{AxisSet, Condition, Limits, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::id_list::{IdList, IdStatusList};
use profile_sercos::wire::idn::Idn;

use super::truths;

const KPP: u16 = 441;
const ACCELERATION_LIMIT: u16 = 485;
const TORQUE_LIMIT: u16 = 504;

const SET_CYCLIC_WRITE_LIST: u8 = 0x4D;
const SET: u8 = 0x10;
const OK: u8 = 0;
const INVALID_VALUE: u8 = 0x09;
const NOT_SETTABLE: u8 = 0x0E;

fn values(values: &[(u16, f32)]) -> Vec<(u16, Vec<u8>)> {
    values.iter().map(|(id, value)| (*id, value.to_le_bytes().to_vec())).collect()
}

fn list(of: &[(u16, f32)]) -> Step {
    let attributes = values(of).into_iter();
    let attributes = attributes.map(|(id, value)| CyclicAttribute { id, element_size: 4, value }).collect();
    Step::CyclicList { axis: 1, direction: CyclicDirection::Write, attributes }
}

fn write(of: &[(u16, f32)]) -> Step {
    Step::CyclicWrite { axis: 1, values: values(of) }
}

fn status(status: u8) -> Step {
    Step::Expect { condition: Condition::CyclicWriteStatus { axis: 1, status }, within: millis(200) }
}

/// S-0-0082 in 0.1 % and S-0-0104 in 0.01 (m/min)/mm of the first drive.
fn held(rig: &Rig) -> (i64, i64) {
    let store = rig.line.slaves()[0].store();
    (store.number_of(Idn::standard(82)), store.number_of(Idn::standard(104)))
}

fn to_step(rig: &mut Rig, step: usize) {
    rig.run_until(millis(10_000), "a step of the program", |rig| rig.report().steps_finished > step);
}

/// While it moves: the drive has the values a few cycles behind the update that brings them, and its own ones again behind the connection.
#[test]
fn a_gain_and_a_limit_follow_the_updates_while_the_axis_moves() {
    let before = {
        let mut rig = Rig::ready(Settings::default());
        rig.run_for(millis(100));
        held(&rig)
    };
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        list(&[(TORQUE_LIMIT, 150.0), (KPP, 40.0)]),
        Step::Enable(AxisSet::first(1)),
        Step::MoveAbsolute { axis: 1, position: 1.0, limits: Limits { velocity: 2.0, ..TURNTABLE } },
        write(&[(TORQUE_LIMIT, 120.5)]),
        Step::Dwell { seconds: 0.05 },
        write(&[(TORQUE_LIMIT, 90.0), (KPP, 30.0)]),
        Step::MoveAbsolute { axis: 1, position: 0.0, limits: Limits { velocity: 2.0, ..TURNTABLE } },
        status(OK),
        Step::Disable(AxisSet::first(1)),
    ]);
    to_step(&mut rig, 2);
    let gain = held(&rig).1;
    assert_eq!(held(&rig).0, 1_500);
    assert_ne!(gain, before.1, "it has another gain than by itself");
    to_step(&mut rig, 4);
    assert_eq!(held(&rig), (1_205, gain));
    to_step(&mut rig, 5);
    // Two cycles of 2 ms and some of the service channel.
    rig.run_for(millis(40));
    assert_eq!(held(&rig), (900, gain * 3 / 4));
    let report = rig.run(millis(10_000));
    assert_eq!(report.failure, None, "{}", rig.log());
    rig.run_for(millis(2_000));
    assert_eq!(held(&rig), (900, gain * 3 / 4), "nobody has opened another connection");
    rig.connect(vec![Step::Dwell { seconds: 1.0 }]);
    rig.run_for(millis(1_000));
    assert_eq!(held(&rig), before, "the next controller finds what the drive has by itself");
}

#[test]
fn what_the_drive_refuses_is_in_the_status_of_the_updates_until_there_is_another_value() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        list(&[(TORQUE_LIMIT, 150.0), (ACCELERATION_LIMIT, 100.0)]),
        status(OK),
        // Finite, and beyond what S-0-0082 can hold.
        write(&[(TORQUE_LIMIT, 1.0e9)]),
        status(INVALID_VALUE),
        Step::Dwell { seconds: 0.5 },
        status(INVALID_VALUE),
        write(&[(TORQUE_LIMIT, 100.0)]),
        status(OK),
        Step::Dwell { seconds: 0.1 },
        status(OK),
    ]);
    to_step(&mut rig, 5);
    assert_eq!(held(&rig).0, 1_500, "as it was");
    let report = rig.run(millis(5_000));
    assert_eq!(report.failure, None, "{}", rig.log());
    assert_eq!(held(&rig).0, 1_000);
}

/// A restarted drive has what it has by itself. It is commissioned anew, and then has what the updates bring.
#[test]
fn a_drive_that_has_restarted_has_the_values_of_the_updates_again() {
    let mut rig = Rig::ready(Settings::without_line(include_str!("can.toml").to_owned()));
    let held = |rig: &Rig| rig.can[0].bus.nodes().next().expect("a drive").dictionary().number(0x60E0, 0);
    let by_itself = held(&rig);
    let turntable = AxisSet::first(1);
    rig.connect(vec![
        list(&[(TORQUE_LIMIT, 90.0)]),
        Step::Enable(turntable),
        Step::Dwell { seconds: 3.0 },
        status(OK),
        Step::FaultReset(turntable),
        Step::Enable(turntable),
        Step::Dwell { seconds: 0.2 },
        status(OK),
        Step::Disable(turntable),
    ]);
    to_step(&mut rig, 1);
    rig.run_for(millis(200));
    assert_eq!(held(&rig), 900);
    assert_ne!(by_itself, 900);
    let now = rig.now();
    rig.can[0].bus.nodes_mut().next().expect("a drive").power_cycle(now);
    assert_eq!(held(&rig), by_itself, "nothing of it is kept");
    let report = rig.run(millis(20_000));
    assert_eq!(report.failure, None, "{}\n{}", rig.log(), rig.told());
    assert_eq!(held(&rig), 900);
}

/// A service may set what the list has as well: the updates bring it back.
#[test]
fn the_updates_win_against_a_service() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![list(&[(TORQUE_LIMIT, 150.0)]), Step::Dwell { seconds: 10.0 }]);
    to_step(&mut rig, 0);
    rig.run_for(millis(100));
    let client = Client::connect(&mut rig, CONTROLLER);
    let (answer, _) = client.ask(&mut rig, SET, 1, Some(TORQUE_LIMIT), &80_f32.to_le_bytes());
    assert_eq!(answer, OK);
    rig.run_for(millis(100));
    assert_eq!(held(&rig).0, 1_500);
}

/// Each settable attribute, one by one: a list has what the table of truths says that somebody has, and nothing else.
#[test]
fn a_write_list_has_what_the_drive_has() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    for settings in [
        Settings::default(),
        Settings::without_line(include_str!("can.toml").to_owned()),
        Settings::without_line(include_str!("devicenet.toml").to_owned()),
    ] {
        let stage = truths::rehearse(&mapping, &settings);
        let mut rig = Rig::ready(settings);
        rig.connect(vec![Step::Dwell { seconds: 100_000.0 }]);
        rig.run_until(millis(20_000), "Stopped", |rig| {
            rig.engine.devices()[0].axis_states().next().is_some_and(|(_, state)| state == AxisState::Stopped)
        });
        let client = Client::connect(&mut rig, CONTROLLER);
        let (mut taken, mut refused) = (0, 0);
        for row in truths::truths(&stage) {
            let known = mapping.dictionaries.cip.attribute_by_id(row.id).expect("of the dictionary");
            if row.access != Access::Set || known.length.is_some() || known.data_type.width().is_none() {
                continue;
            }
            let mut body = [0; 16];
            let len = IdList::emit(&mut body, &[row.id]).expect("room");
            let (_, answer) = client.ask(&mut rig, SET_CYCLIC_WRITE_LIST, 1, None, &body[..len]);
            let answer = IdStatusList::parse(&answer).expect("a list");
            let answer = answer.iter().next().expect("the attribute").status;
            let what = format!("{} {} is {} by {}", row.id, row.name, row.truth, row.by);
            if row.truth == Truth::Absent {
                // No row of the tables, or none of this drive.
                assert!(answer == NOT_SETTABLE || answer == 0x14, "{what}: 0x{answer:02X}");
                refused += 1;
            } else {
                assert_eq!(answer, OK, "{what}");
                taken += 1;
            }
        }
        assert!(taken > 50 && refused > 50, "{taken} {refused}");
    }
}
