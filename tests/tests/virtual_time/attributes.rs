//! Every attribute of an axis by explicit message: read, written well, written badly, and written while the axis runs.
//!
//! What is expected follows from the rows of the dictionary, not from the definitions that the device is built with.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use axisbridge::mapping::{Access, CipAttribute, CipType, Mapping, Served, SetKind};
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::{NANO, millis};
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cia402::node::dictionary::{DataType, Definition as Entry};
use profile_cia402::wire::Mux;
use profile_cip::controller::{AxisSet, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::wire::motion::id_list::IdList;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::wire::idn::Idn;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: u8 = 0;
const INVALID_VALUE: u8 = 0x09;
const STATE_CONFLICT: u8 = 0x0C;
const NOT_SETTABLE: u8 = 0x0E;
const DEVICE_CONFLICT: u8 = 0x10;
const SHORT: u8 = 0x13;
const NOT_SUPPORTED: u8 = 0x14;
const LONG: u8 = 0x15;

/// Kept where the drive never uses more, and refused otherwise.
const STOPPING_TORQUE: u16 = 611;

/// Positions of encoders, in their counts.
const ENCODERS: [u16; 2] = [1402, 1452];

fn octets(data_type: CipType) -> usize {
    data_type.width().map_or(1, |width| width.bytes())
}

/// A value that the attribute cannot have, in its first element; `None` where the dictionary forbids none.
fn bad_value(mapping: &Mapping, row: &CipAttribute, good: &[u8]) -> Option<Vec<u8>> {
    let mut value = good.to_vec();
    let first = value.get_mut(..octets(row.data_type))?;
    let cip = &mapping.dictionaries.cip;
    let sets = cip.enumerations().iter().chain(cip.bit_sets());
    let whole = sets.into_iter().find(|set| set.attributes.contains(&row.id) && set.element.is_empty());
    match (row.data_type, whole) {
        (CipType::Real, _) => first.copy_from_slice(&f32::NAN.to_le_bytes()),
        (CipType::Lreal, _) => first.copy_from_slice(&f64::INFINITY.to_le_bytes()),
        (CipType::Bool, _) => first[0] = 2,
        (_, Some(set)) if set.kind == SetKind::Codes => {
            let free =
                (0..=255_u8).find(|code| set.codes.iter().all(|known| known.code != u32::from(*code)))?;
            first.fill(0);
            first[0] = free;
        }
        (_, Some(set)) => {
            let bits = u32::try_from(8 * first.len()).expect("a few bits");
            let free = (0..bits).find(|bit| set.codes.iter().all(|known| known.code != *bit))?;
            first.fill(0);
            first[usize::try_from(free / 8).expect("small")] = 1 << (free % 8);
        }
        _ => return None,
    }
    Some(value)
}

fn rig_in(state: AxisState) -> (Rig, Client) {
    let mut rig = Rig::ready(Settings::default());
    let dwell = Step::Dwell { seconds: 1_000.0 };
    let program = match state {
        AxisState::Running => vec![Step::Enable(AxisSet::one(1)), dwell],
        _ => vec![dwell],
    };
    rig.connect(program);
    rig.run_until(millis(10_000), "the state", |rig| {
        rig.engine.devices()[0].axis_states().next().is_some_and(|(_, reached)| reached == state)
    });
    rig.run_for(millis(100));
    let client = Client::connect(&mut rig, CONTROLLER);
    (rig, client)
}

#[test]
fn every_attribute_answers_as_its_row_in_the_dictionary_says() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let served: BTreeMap<u16, Served> =
        mapping.cip.attributes.iter().map(|row| (row.attribute.id, row.served)).collect();
    let (mut rig, client) = rig_in(AxisState::Stopped);
    let (mut running, runner) = rig_in(AxisState::Running);
    let mut wrong = String::new();
    let mut counts = BTreeMap::<&str, usize>::new();
    for row in mapping.dictionaries.cip.attributes() {
        let id = row.id;
        let mut check = |what: &'static str, got: u8, expected: &[u8]| {
            *counts.entry(what).or_default() += 1;
            if !expected.contains(&got) {
                writeln!(wrong, "{id} {} {what}: 0x{got:02X}, expected {expected:02X?}", row.name)
                    .expect("a string takes everything");
            }
        };
        let (status, value) = client.ask(&mut rig, GET, 1, Some(id), &[]);
        let Some(served) = served.get(&id) else {
            check("get of one that is not served", status, &[NOT_SUPPORTED]);
            let (status, _) = client.ask(&mut rig, SET, 1, Some(id), &[0; 4]);
            check("set of one that is not served", status, &[NOT_SUPPORTED]);
            continue;
        };
        match served {
            // Nobody has said what a count of the encoder is.
            Served::Parameter { .. } if ENCODERS.contains(&id) => {
                check("get", status, &[DEVICE_CONFLICT, NOT_SUPPORTED]);
            }
            // The drive may lack the parameter, and a signal may have no value now.
            Served::Parameter { .. } => check("get", status, &[OK, NOT_SUPPORTED]),
            Served::Signal { .. } => check("get", status, &[OK, DEVICE_CONFLICT]),
            _ => check("get", status, &[OK]),
        }
        let size = octets(row.data_type) * usize::from(row.length.unwrap_or(1));
        let value = if status == OK { value } else { vec![0; size] };
        if row.data_type != CipType::ShortString {
            check(
                "octets",
                u8::try_from(value.len()).expect("at most 64"),
                &[u8::try_from(size).expect("64")],
            );
        }
        let mut set = |value: &[u8]| client.ask(&mut rig, SET, 1, Some(id), value).0;
        if row.access == Access::Get {
            check("set of one that can only be read", set(&value), &[NOT_SETTABLE]);
            check("set of one that can only be read", set(&value[..value.len() - 1]), &[NOT_SETTABLE]);
            continue;
        }
        if status == NOT_SUPPORTED {
            check("set of one that the drive lacks", set(&value), &[NOT_SUPPORTED]);
            continue;
        }
        if row.access == Access::SetCyclic {
            check("set of what the connection sets, to what it is", set(&value), &[OK]);
            let mut other = value.clone();
            other[0] ^= 1;
            check("set of what the connection sets", set(&other), &[NOT_SETTABLE]);
            continue;
        }
        if id == STOPPING_TORQUE {
            // Never set: 0, and no drive stops without torque.
            check("set of one that is compared", set(&value), &[INVALID_VALUE]);
            continue;
        }
        check("set", set(&value), &[OK]);
        check("set with an octet less", set(&value[..value.len() - 1]), &[SHORT]);
        check("set with an octet more", set(&[&value[..], &[0]].concat()), &[LONG]);
        if let Some(bad) = bad_value(&mapping, row, &value) {
            check("set to what it cannot be", set(&bad), &[INVALID_VALUE]);
        }
        let (_, again) = client.ask(&mut rig, GET, 1, Some(id), &[]);
        check("the value stays", u8::from(again != value), &[0]);
        let expected = if row.running { OK } else { STATE_CONFLICT };
        let (status, _) = runner.ask(&mut running, SET, 1, Some(id), &value);
        check("set in Running", status, &[expected]);
    }
    assert_eq!(wrong, "");
    let counts: String = counts.iter().map(|(what, count)| format!("{count} {what}\n")).collect();
    insta::assert_snapshot!(counts);
    assert_eq!(
        running.engine.devices()[0].axis_states().next().map(|(_, state)| state),
        Some(AxisState::Running),
        "nothing of it has disturbed the axis"
    );
}

/// Drives of SERCOS and CANopen brake within their torque limits: a Stopping Torque below either of them would have no effect.
#[test]
fn stopping_torque_is_kept_where_the_drive_never_uses_more_and_refused_otherwise() {
    let can = Settings::without_line(include_str!("can.toml"));
    for (bus, settings) in [("SERCOS", Settings::default()), ("CANopen", can)] {
        let mut rig = Rig::ready(settings);
        rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
        rig.run_until(millis(10_000), "Stopped", |rig| {
            rig.engine.devices()[0].axis_states().next().is_some_and(|(_, state)| state == AxisState::Stopped)
        });
        let client = Client::connect(&mut rig, CONTROLLER);
        let (positive, negative) = (504, 505);
        let get = |rig: &mut Rig, id| {
            let (status, value) = client.ask(rig, GET, 1, Some(id), &[]);
            assert_eq!(status, OK, "{bus} {id}");
            f32::from_le_bytes(value.try_into().expect("a REAL"))
        };
        let set = |rig: &mut Rig, id, value: f32| client.ask(rig, SET, 1, Some(id), &value.to_le_bytes()).0;
        let limit = get(&mut rig, positive);
        assert_eq!(get(&mut rig, negative), -limit, "{bus}");
        assert!(limit >= 100.0, "{bus}: {limit}");
        assert_eq!(set(&mut rig, STOPPING_TORQUE, limit - 1.0), INVALID_VALUE, "{bus}: the drive uses more");
        assert_eq!(set(&mut rig, STOPPING_TORQUE, -limit), INVALID_VALUE, "{bus}: it has no sign");
        assert_eq!(get(&mut rig, STOPPING_TORQUE), 0.0, "{bus}: never set");
        assert_eq!(set(&mut rig, STOPPING_TORQUE, limit), OK, "{bus}");
        assert_eq!(get(&mut rig, STOPPING_TORQUE), limit, "{bus}");
        // Both directions count.
        assert_eq!(set(&mut rig, positive, 60.0), OK, "{bus}");
        assert_eq!(set(&mut rig, STOPPING_TORQUE, 60.0), INVALID_VALUE, "{bus}: the other direction");
        assert_eq!(set(&mut rig, negative, -60.0), OK, "{bus}");
        assert_eq!(set(&mut rig, STOPPING_TORQUE, 60.0), OK, "{bus}");
        // And stay below it.
        assert_eq!(set(&mut rig, positive, 61.0), INVALID_VALUE, "{bus}");
        assert_eq!(set(&mut rig, negative, -61.0), INVALID_VALUE, "{bus}");
        assert_eq!([positive, negative].map(|id| get(&mut rig, id)), [60.0, -60.0], "{bus}");
        assert_eq!(set(&mut rig, negative, -50.0), OK, "{bus}");
        assert_eq!(set(&mut rig, STOPPING_TORQUE, 55.0), INVALID_VALUE, "{bus}: the positive direction");
        assert_eq!(set(&mut rig, STOPPING_TORQUE, 61.0), OK, "{bus}");
        assert_eq!(set(&mut rig, positive, 61.0), OK, "{bus}");
    }
}

/// A list of all the attributes that exist, read in pieces that fit, with the same answers as one by one.
#[test]
fn lists_answer_attribute_by_attribute() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let (mut rig, client) = rig_in(AxisState::Stopped);
    for rows in mapping.dictionaries.cip.attributes().chunks(16) {
        let mut list = u16::try_from(rows.len()).expect("few").to_le_bytes().to_vec();
        list.extend([0, 0]);
        for row in rows {
            let size = u8::try_from(octets(row.data_type)).expect("small");
            list.extend(row.id.to_le_bytes());
            match row.length {
                None => list.extend([0, size]),
                Some(count) => {
                    list.extend([1, size, 0, 0]);
                    list.extend(count.to_le_bytes());
                }
            }
        }
        let (status, body) = client.ask(&mut rig, 0x4B, 1, None, &list);
        assert!(status == OK || status == 0x0A, "0x{status:02X}");
        let items = profile_cip::wire::motion::attribute_list::GetResponse::new(&body).expect("a list");
        let mut answered = 0;
        for (item, row) in items.zip(rows) {
            use profile_cip::wire::motion::attribute_list::GetItem;
            answered += 1;
            let (single, value) = client.ask(&mut rig, GET, 1, Some(row.id), &[]);
            match item.expect("an item") {
                GetItem::Value(selector, octets) => {
                    assert_eq!((selector.id, single), (row.id, OK));
                    assert_eq!(octets.len(), value.len(), "{}", row.name);
                }
                GetItem::Error(id, status) => assert_eq!((id, status), (row.id, single)),
            }
        }
        assert_eq!(answered, rows.len());
    }
}

#[test]
fn signals_of_a_cyclic_read_list_are_fresh_in_every_cycle_and_parameters_are_refused_by_name() {
    let mut rig = Rig::ready(Settings::default());
    rig.connect(vec![
        Step::Enable(AxisSet::one(1)),
        Step::Jog { axis: 1, velocity: 4.0, acceleration: 40.0, jerk: 800.0, seconds: 5.0 },
        Step::Disable(AxisSet::one(1)),
    ]);
    rig.run_until(millis(5_000), "motion", |rig| rig.velocity(0) > NANO);
    let client = Client::connect(&mut rig, CONTROLLER);
    let list = |ids: &[u16]| {
        let mut body = [0; 32];
        let len = IdList::emit(&mut body, ids).expect("room");
        body[..len].to_vec()
    };
    // Velocity Feedback and Axis State; then Torque Limit - Positive, which lives in the drive.
    let answer = client.ask(&mut rig, 0x4E, 1, None, &list(&[454, 650]));
    assert_eq!(answer, (OK, vec![2, 0, 1, 0, 0xC6, 1, 0, 0, 0x8A, 2, 0, 0]));
    let answer = client.ask(&mut rig, 0x4E, 1, None, &list(&[504]));
    assert_eq!(answer, (0x0A, vec![1, 0, 1, 0, 0xF8, 1, 0x2C, 0]), "the ID stays that of the list before");
    let velocity = |rig: &Rig| {
        let octets = rig.engine.devices()[0].device().attribute(0, 454).expect("it is there");
        f32::from_le_bytes(octets.try_into().expect("a REAL"))
    };
    rig.run_until(millis(2_000), "full speed", |rig| rig.velocity(0) > 39 * NANO / 10);
    rig.run_for(millis(100));
    assert!((velocity(&rig) - 4.0).abs() < 0.05, "{}", velocity(&rig));
    rig.run_until(millis(10_000), "rest", |rig| rig.velocity(0).abs() < NANO / 1_000);
    rig.run_for(millis(100));
    assert!(velocity(&rig).abs() < 0.01, "{}", velocity(&rig));
    // The two axes have lists of their own.
    assert_eq!(rig.engine.devices()[0].device().attribute(1, 454), Ok(&[0; 4][..]));
}

/// Motor data and the gear are the drive's own. A controller may set them to what the drive has: it is told if it has others.
#[test]
fn what_only_the_drive_can_change_is_confirmed_or_refused_with_both_values_in_the_log() {
    const RATED_CURRENT: u16 = 1319;
    const GEAR_INPUT: u16 = 1371;
    let (mut rig, client) = rig_in(AxisState::Stopped);
    let mut ask = |service, id, value: &[u8]| client.ask(&mut rig, service, 1, Some(id), value);
    let (status, gear) = ask(GET, GEAR_INPUT, &[]);
    assert_eq!((status, gear.as_slice()), (OK, &1_u32.to_le_bytes()[..]));
    assert_eq!(ask(SET, GEAR_INPUT, &gear).0, OK);
    assert_eq!(ask(SET, GEAR_INPUT, &10_u32.to_le_bytes()).0, INVALID_VALUE);
    assert_eq!(ask(GET, GEAR_INPUT, &[]).1, gear, "as it was");
    let (status, current) = ask(GET, RATED_CURRENT, &[]);
    assert_eq!(status, OK);
    let amperes = f32::from_le_bytes(current.try_into().expect("a REAL"));
    assert!(amperes > 1.0, "{amperes}");
    // A thousandth is what the unit of a drive may round; a hundredth is another motor.
    for (factor, expected) in [(1.0005, OK), (0.9995, OK), (1.01, INVALID_VALUE), (-1.0, INVALID_VALUE)] {
        let status = ask(SET, RATED_CURRENT, &(amperes * factor).to_le_bytes()).0;
        assert_eq!(status, expected, "{factor}");
    }
    let told = rig.told();
    let said = "attribute 1371 cannot be set to 10: the drive has 1, and only it can change that";
    assert!(told.contains(said), "{told}");
    assert_eq!(told.matches("attribute 1319 cannot be set to").count(), 2, "{told}");
}

/// 255 in an array of actions leaves that exception as it is, as controllers write it that change one of them. An array with a value that an
/// exception cannot have changes none.
#[test]
fn an_action_of_255_leaves_an_exception_as_it_is() {
    const ACTION: u16 = 672;
    const ACTION_MFG: u16 = 673;
    /// Motor Overspeed User Limit, which Axisbridge watches itself; Bus Undervoltage, for which the drive switches itself off.
    const OVERSPEED: usize = 4;
    const UNDERVOLTAGE: usize = 33;
    let (mut rig, client) = rig_in(AxisState::Stopped);
    let mut ask = |service, id, value: &[u8]| client.ask(&mut rig, service, 1, Some(id), value);
    for id in [ACTION, ACTION_MFG] {
        let (_, before) = ask(GET, id, &[]);
        assert!(before.len() == 64 && before.iter().any(|action| *action != 255), "{id}: {before:?}");
        assert_eq!(ask(SET, id, &[255; 64]).0, OK, "{id}");
        assert_eq!(ask(GET, id, &[]), (OK, before), "{id}: nothing has changed");
    }
    let (_, before) = ask(GET, ACTION, &[]);
    let mut actions = [255; 64];
    actions[OVERSPEED] = 1;
    assert_eq!(ask(SET, ACTION, &actions).0, OK);
    let mut expected = before;
    assert_ne!(expected[OVERSPEED], 1);
    expected[OVERSPEED] = 1;
    assert_eq!(ask(GET, ACTION, &[]), (OK, expected.clone()), "one of them");
    (actions[OVERSPEED], actions[UNDERVOLTAGE]) = (2, 0);
    assert_eq!(ask(SET, ACTION, &actions).0, INVALID_VALUE);
    assert_eq!(ask(GET, ACTION, &[]), (OK, expected), "one bad member");
}

/// What the first drive has as its window of the position error.
fn window(rig: &mut Rig) -> i64 {
    match rig.can.first_mut() {
        Some(wire) => wire.bus.nodes_mut().next().expect("a drive").dictionary().number(0x6065, 0),
        None => rig.line.slaves()[0].store().number_of(Idn::standard(159)),
    }
}

/// Sets it from inside, past the gateway.
fn set_window(rig: &mut Rig, value: i64) {
    match rig.can.first_mut() {
        Some(wire) => {
            wire.bus.nodes_mut().next().expect("a drive").dictionary_mut().set(0x6065, 0, value);
        }
        None => rig.line.slaves_mut()[0].store_mut().set_number_of(Idn::standard(159), value),
    }
}

/// A set succeeds when the drive has the value afterwards, in whole steps of its unit, and not because it has taken it.
#[test]
fn a_drive_that_takes_a_value_and_keeps_another_is_found_out() {
    const POSITION_ERROR_TOLERANCE: u16 = 444;
    let canopen = Settings::without_line(include_str!("can.toml").to_owned());
    for (bus, settings) in [("SERCOS", Settings::default()), ("CANopen", canopen)] {
        let (mut rig, client) = super::settings::stopped(Rig::ready(settings));
        // The drive makes something else of what it is given, once.
        let set = |rig: &mut Rig, value: f32, becomes: &dyn Fn(i64) -> i64| {
            let (before, mut is_done) = (window(rig), false);
            client.set_while(rig, (1, POSITION_ERROR_TOLERANCE), &value.to_le_bytes(), |rig| {
                let now = window(rig);
                if now != before && !is_done {
                    is_done = true;
                    set_window(rig, becomes(now));
                }
            })
        };
        assert_eq!(set(&mut rig, 250_000.0, &|given| given), OK, "{bus}: it keeps it");
        assert_eq!(set(&mut rig, 200_000.0, &|given| given / 2), INVALID_VALUE, "{bus}");
        let (status, value) = client.ask(&mut rig, GET, 1, Some(POSITION_ERROR_TOLERANCE), &[]);
        let held = f32::from_le_bytes(value.try_into().expect("a REAL"));
        assert!(status == OK && (held - 100_000.0).abs() < 100.0, "{bus}: the drive has half of it, {held}");
        let said = format!("attribute 444 was set to 200000, and the drive has {held} afterwards");
        assert!(rig.told().contains(&said), "{bus}: {said} {}", rig.told());
        // What differs by less than a thousandth is what a drive rounds.
        assert_eq!(set(&mut rig, 300_000.0, &|given| given - 1), OK, "{bus}");
    }
}

/// Narrows what the first drive takes, after it has said otherwise.
fn narrow(rig: &mut Rig) {
    if let Some(wire) = rig.can.first_mut() {
        let dictionary = wire.bus.nodes_mut().next().expect("a drive").dictionary_mut();
        let handle = dictionary.find(Mux::new(0x6065, 0)).expect("the object");
        return dictionary.redefine(handle, Entry::new("Window", DataType::U32, 50).range(0, 100));
    }
    let window = Definition::value(Idn::standard(159), 0x0422_0001, "Monitoring window", 50).range(0, 100);
    rig.line.slaves_mut()[0].store_mut().define(window);
}

/// The log has what the drive itself says of a value that it does not take.
#[test]
fn the_log_has_the_drives_own_words_of_a_refusal() {
    const POSITION_ERROR_TOLERANCE: u16 = 444;
    let canopen = Settings::without_line(include_str!("can.toml").to_owned());
    for (bus, settings, said) in
        [("SERCOS", Settings::default(), "S-0-0159: "), ("CANopen", canopen, "6065:00: ")]
    {
        let (mut rig, client) = super::settings::stopped(Rig::ready(settings));
        narrow(&mut rig);
        let (status, _) =
            client.ask(&mut rig, SET, 1, Some(POSITION_ERROR_TOLERANCE), &123_000_f32.to_le_bytes());
        assert_eq!(status, INVALID_VALUE, "{bus}");
        let told = rig.told();
        let line = told.lines().find(|line| line.contains("attribute 444 is not set to 123000: "));
        let line = line.unwrap_or_else(|| panic!("{bus}: {told}"));
        assert!(
            line.contains(said)
                && (line.contains("0x7007") || line.contains("0609 0031") || line.contains("06090031")),
            "{bus}: {line}"
        );
    }
}

/// What Axisbridge does in one way only can be set to that way.
#[test]
fn what_is_always_so_can_be_set_to_nothing_else() {
    let (mut rig, client) = rig_in(AxisState::Stopped);
    let mut set = |id, value: &[u8]| client.ask(&mut rig, SET, 1, Some(id), value).0;
    for (id, name, always, other) in [
        (41, "Control Method: PI Vector", 2, 1),
        (446, "Position Integrator Control", 0, 1),
        (467, "Velocity Integrator Control", 0, 1),
        (560, "Commutation Startup Method: From Feedback Type", 0, 1),
        (1317, "Motor Polarity: Normal", 0, 1),
        (1414, "Feedback 1 Polarity: Normal", 0, 1),
    ] {
        assert_eq!((set(id, &[always]), set(id, &[other])), (OK, INVALID_VALUE), "{name}");
    }
}

/// A box on the clock of its host measures no variation: the rows of it are not there, instead of a number that nobody has measured.
#[test]
fn every_attribute_of_the_class_says_what_is_so() {
    let (mut rig, client) = rig_in(AxisState::Stopped);
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    let mut table = String::new();
    for row in mapping.dictionaries.cip.class_attributes() {
        let (status, value) = client.ask(&mut rig, GET, 0, Some(row.id), &[]);
        let shown = match (status, row.id) {
            (OK, 19 | 20) => format!("{} octets of time", value.len()),
            (OK, 4) => {
                let ids: Vec<u16> =
                    value.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
                assert_eq!(usize::from(ids[0]), ids.len() - 1);
                // What a drive lacks is in the list of the class, and refused for the axis.
                for row in mapping.dictionaries.cip.attributes() {
                    let answers = client.ask(&mut rig, GET, 1, Some(row.id), &[]).0 == OK;
                    let optional = !row.need.chars().skip(3).any(|need| need == 'R');
                    let listed = ids[1..].contains(&row.id);
                    assert!(!listed || optional, "{} is required", row.id);
                    assert!(listed || !(answers && optional), "{} answers", row.id);
                }
                format!("{} attributes", ids[0])
            }
            (OK, _) => value.iter().map(|octet| format!("{octet:02x}")).collect(),
            _ => format!("status 0x{status:02X}"),
        };
        let (set, _) = client.ask(&mut rig, SET, 0, Some(row.id), &value);
        writeln!(table, "{:>2} {:<37} {shown}; set: 0x{set:02X}", row.id, row.name).expect("a string");
    }
    insta::assert_snapshot!(table);
}
