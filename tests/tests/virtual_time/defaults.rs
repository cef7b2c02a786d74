//! A connection begins with the defaults of all attributes (CIP Volume 9, 5-2.4): what a controller has changed in a drive does not
//! outlive its connection.

use std::collections::BTreeSet;

use axisbridge::mapping::{Access, Mapping, Truth};
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::controller::{AxisSet, ControllerConfig, Step};
use profile_cip::device::axis_state::AxisState;
use profile_generic::inhibit::Inhibits;
use profile_generic::state::Report;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::wire::idn::Idn;

use super::drive_parameters;
use super::settings::stopped;
use super::truths::{Bench, GET, OK, SET, another, changed, held, rehearse, truths};

const DEVICE_STATE_CONFLICT: u8 = 0x10;

/// The controller is gone, and another one connects that sets nothing.
fn reconnect(rig: &mut Rig) {
    rig.kill_controller();
    rig.run_until(millis(5_000), "the connection is lost", |rig| rig.status().connections == 0);
    rig.connect(vec![Step::Enable(AxisSet::first(1)), Step::Dwell { seconds: 100_000.0 }]);
    // No torque before the drive is as it was.
    rig.run_until(millis(20_000), "torque", |rig| rig.engine.axes()[0].may_have_torque());
}

/// Every attribute that a controller can change in a drive. On DeviceNet there is none.
#[test]
fn what_a_controller_has_changed_in_a_drive_ends_with_its_connection() {
    let mapping = Mapping::embedded().expect("the shipped tables are sound");
    for (bus, settings, least) in [
        ("SERCOS", Settings::default(), 12),
        ("CANopen", Settings::without_line(include_str!("can.toml")), 12),
    ] {
        let stage = rehearse(&mapping, &settings);
        let mut bench = Bench::start(bus, settings);
        let first = held(&bench.rig);
        let mut places = BTreeSet::new();
        let mut values = Vec::new();
        for row in truths(&stage).iter().filter(|row| row.truth != Truth::Absent && row.access == Access::Set)
        {
            let known = mapping.dictionaries.cip.attribute_by_id(row.id).expect("of the dictionary");
            let (_, value) = bench.ask(GET, row.id, &[]);
            let Some(other) = another(known, &value) else { continue };
            let (status, changed) = bench.set(row.id, &other);
            if status == OK && !changed.is_empty() {
                places.extend(changed);
                values.push((row.id, value));
            }
        }
        assert!(values.len() >= least, "{bus}: {} attributes, {places:?}", values.len());
        let mut left = changed(&first, &held(&bench.rig));
        left.retain(|place| places.contains(place));
        assert_eq!(left, places, "{bus}: the drive has what the controller has set");

        reconnect(&mut bench.rig);
        let mut left = changed(&first, &held(&bench.rig));
        left.retain(|place| places.contains(place));
        assert_eq!(left, BTreeSet::new(), "{bus}: the drive has what it had");
        for (id, value) in values {
            assert_eq!(bench.ask(GET, id, &[]), (OK, value), "{bus}: attribute {id}");
        }
    }
}

/// What a person has set at the drive meanwhile is the person's.
#[test]
fn what_somebody_else_has_set_meanwhile_stays() {
    let kpp = Idn::standard(104);
    let mut bench = drive_parameters::Bench::sercos(|_| {});
    let by_itself = drive_parameters::held(&bench, kpp);
    let connect = |rig: &mut Rig| {
        rig.connect(vec![Step::Dwell { seconds: 100_000.0 }]);
        rig.run_until(millis(20_000), "Stopped", |rig| {
            rig.engine.devices()[0].axis_states().all(|(_, state)| state == AxisState::Stopped)
        });
    };
    let set = |rig: &mut Rig, value: f32| {
        let client = Client::connect(rig, CONTROLLER);
        assert_eq!(client.ask(rig, SET, 1, Some(441), &value.to_le_bytes()).0, OK);
    };
    connect(&mut bench.rig);
    set(&mut bench.rig, 100.0);
    assert_eq!(drive_parameters::held(&bench, kpp), 600);
    bench.rig.kill_controller();
    bench.rig.run_until(millis(5_000), "the connection is lost", |rig| rig.status().connections == 0);
    assert_eq!(drive_parameters::held(&bench, kpp), 600, "nothing is done behind a connection");
    let reply = bench.say("write turntable S-0-0104 7.00");
    assert!(reply.starts_with("ok "), "{reply}");
    reconnect(&mut bench.rig);
    assert_eq!(drive_parameters::held(&bench, kpp), 700);
    // And is what the next connection gives back.
    set(&mut bench.rig, 100.0);
    reconnect(&mut bench.rig);
    assert_eq!(drive_parameters::held(&bench, kpp), 700);
    assert_eq!(by_itself, 300);
}

/// A drive that is not heard for a moment keeps what the controller has set, and gives it back all the same.
#[test]
fn what_a_controller_has_changed_ends_with_its_connection_also_after_a_silence() {
    let kpp = Idn::standard(104);
    let (mut rig, client) = stopped(Rig::ready(Settings::default()));
    let held = |rig: &Rig| rig.line.slaves()[0].store().number_of(kpp);
    assert_eq!(client.ask(&mut rig, SET, 1, Some(441), &100.0_f32.to_le_bytes()).0, OK);
    assert_eq!(held(&rig), 600, "300 before");
    rig.line.set_mute(0, true);
    rig.run_until(millis(100), "the silence", |rig| rig.engine.axes()[0].feedback().report == Report::Silent);
    rig.line.set_mute(0, false);
    rig.run_until(millis(1_000), "the drive", |rig| rig.engine.axes()[0].feedback().report != Report::Silent);
    rig.kill_controller();
    rig.run_until(millis(5_000), "the connection is lost", |rig| rig.status().connections == 0);
    rig.connect(vec![Step::Dwell { seconds: 100_000.0 }]);
    rig.run_for(millis(5_000));
    assert_eq!(held(&rig), 300, "{}", rig.told());
}

/// What a drive had goes back when it is heard. Until then a controller configures the other axes, and this one cannot be switched on.
#[test]
fn a_drive_that_is_not_heard_keeps_no_other_axis_waiting() {
    let kpp = Idn::standard(104);
    let (mut rig, client) = stopped(Rig::ready(Settings::default()));
    let held = |rig: &Rig, drive: usize| rig.line.slaves()[drive].store().number_of(kpp);
    for axis in [1, 2] {
        assert_eq!(client.ask(&mut rig, SET, axis, Some(441), &100.0_f32.to_le_bytes()).0, OK);
    }
    assert_eq!((held(&rig, 0), held(&rig, 1)), (600, 600), "300 before");
    rig.kill_controller();
    rig.run_until(millis(5_000), "the connection is lost", |rig| rig.status().connections == 0);
    rig.line.set_mute(0, true);
    rig.run_until(millis(100), "the silence", |rig| rig.engine.axes()[0].feedback().report == Report::Silent);
    assert!(rig.engine.axes()[0].south().is_some(), "it is not commissioned anew");
    let config = ControllerConfig { late: AxisSet::one(1), ..rig.controller_config() };
    rig.connect_with(config, vec![Step::Enable(AxisSet::one(2)), Step::Dwell { seconds: 100_000.0 }]);
    rig.run_until(millis(5_000), "torque", |rig| rig.engine.axes()[1].may_have_torque());
    assert_eq!((held(&rig, 0), held(&rig, 1)), (600, 300), "{}", rig.told());
    let client = Client::connect(&mut rig, CONTROLLER);
    assert_eq!(client.ask(&mut rig, SET, 2, Some(441), &50.0_f32.to_le_bytes()).0, OK);
    assert_eq!(held(&rig, 1), 300);
    assert_eq!(client.ask(&mut rig, SET, 1, Some(441), &50.0_f32.to_le_bytes()).0, DEVICE_STATE_CONFLICT);
    assert!(rig.status().axes[0].inhibits.contains(Inhibits::CONFIGURATION_INCOMPLETE));
    rig.line.set_mute(0, false);
    rig.run_for(millis(2_000));
    assert_eq!(held(&rig, 0), 300, "{}", rig.told());
    assert!(!rig.status().axes[0].inhibits.contains(Inhibits::CONFIGURATION_INCOMPLETE));
    assert_eq!(client.ask(&mut rig, SET, 1, Some(441), &100.0_f32.to_le_bytes()).0, OK);
    assert_eq!(held(&rig, 0), 600);
}

/// A drive that does not take back what it had keeps what the controller has set, and the log says so.
#[test]
fn what_a_drive_does_not_take_back_is_in_the_log() {
    let kpp = Idn::standard(104);
    let (mut rig, client) = stopped(Rig::ready(Settings::default()));
    let held = |rig: &Rig| rig.line.slaves()[0].store().number_of(kpp);
    assert_eq!(client.ask(&mut rig, SET, 1, Some(441), &100.0_f32.to_le_bytes()).0, OK);
    assert_eq!(held(&rig), 600, "300 before");
    // From now on it takes nothing below what it has.
    let narrow = Definition::value(kpp, 0x0211_0001, "Position loop Kv-factor", 600).unit("1000/min");
    rig.line.slaves_mut()[0].store_mut().define(narrow.range(600, 65_535));
    reconnect(&mut rig);
    assert_eq!(held(&rig), 600);
    let said = "S-0-0104 keeps what the last controller has set, instead of what the drive had before: the drive refuses it";
    assert!(rig.told().contains(said), "{}", rig.told());
}
