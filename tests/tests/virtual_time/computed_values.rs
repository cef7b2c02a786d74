//! Values that an overlay computes from what drives have, from an attribute of the controller to the operands and back.

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cia402::node::dictionary::{self, DataType};
use profile_cia402::wire::Mux;
use profile_cip::controller::Step;
use profile_cip::device::axis_state::AxisState;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::wire::idn::Idn;

const OVERLAY: &str = include_str!("../../../examples/overlays/computed.toml");
const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: (u8, Vec<u8>) = (0, Vec::new());
const INVALID_VALUE: u8 = 0x09;
const NOT_SETTABLE: u8 = 0x0E;
const DEVICE_CONFLICT: u8 = 0x10;
const NOT_SUPPORTED: u8 = 0x14;
const POWER: Option<u16> = Some(2011);
const RESERVE: Option<u16> = Some(2012);
const LOAD: Option<u16> = Some(2013);
const GAIN: Option<u16> = Some(2014);
const FILTER: Option<u16> = Some(2015);

/// Two bytes, unsigned, only to be read, with one decimal place or none; and to be written.
const READ_ONLY_TENTHS: u32 = 0x7111_0001;
const READ_ONLY: u32 = 0x7011_0001;
const WRITABLE: u32 = 0x0011_0001;

const CURRENT: &str = "P-0-0710";
const VOLTAGE: &str = "P-0-0711";
const GAIN_SET: &str = "P-0-0712";
const GAIN_A: &str = "P-0-0713";
const GAIN_B: &str = "P-0-0714";

fn idn(text: &str) -> Idn {
    text.parse().expect("an IDN")
}

fn real(value: f32) -> (u8, Vec<u8>) {
    (0, value.to_le_bytes().to_vec())
}

/// Runs until the controller has the axis, so that its attributes are served.
fn reached(mut rig: Rig) -> (Rig, Client) {
    rig.until_ready();
    rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
    rig.run_until(millis(60_000), "a stopped axis", |rig| {
        rig.engine.devices()[0].axis_states().next().is_some_and(|(_, state)| state == AxisState::Stopped)
    });
    rig.run_for(millis(100));
    let client = Client::connect(&mut rig, CONTROLLER);
    (rig, client)
}

/// Drive 1 has 12.5 A at 560 V, and gain set A with 300, B with 500.
fn on_sercos(without: &str) -> (Rig, Client) {
    let mut rig = Rig::new(Settings { overlays: vec![OVERLAY], ..Settings::default() });
    let store = rig.line.slaves_mut()[0].store_mut();
    for (name, attribute, value, unit) in [
        (CURRENT, READ_ONLY_TENTHS, 125, "A"),
        (VOLTAGE, READ_ONLY, 560, "V"),
        (GAIN_SET, READ_ONLY, 0, ""),
        (GAIN_A, WRITABLE, 300, ""),
        (GAIN_B, WRITABLE, 500, ""),
    ] {
        if name != without {
            store.define(Definition::value(idn(name), attribute, name, value).unit(unit));
        }
    }
    reached(rig)
}

fn put(rig: &mut Rig, name: &str, value: i64) {
    let store = rig.line.slaves_mut()[0].store_mut();
    let handle = store.find(idn(name)).expect("the drive has it");
    store.set_number(handle, value);
}

fn held(rig: &Rig, name: &str) -> i64 {
    rig.line.slaves()[0].store().number_of(idn(name))
}

#[test]
fn sums_products_and_ratios_of_idns_are_read_as_attributes() {
    let (mut rig, client) = on_sercos("");
    let get = |rig: &mut Rig, attribute| client.ask(rig, GET, 1, attribute, &[]);
    assert_eq!(get(&mut rig, POWER), real(7.0), "12.5 A at 560 V are 7 kW");
    assert_eq!(get(&mut rig, RESERVE), real(27.5), "of 40 A");
    assert_eq!(get(&mut rig, LOAD), (0, vec![31]), "31.25 %");
    // Nothing is kept: the next answer is of the next values.
    put(&mut rig, CURRENT, 126);
    put(&mut rig, VOLTAGE, 565);
    assert_eq!(get(&mut rig, POWER), real(7.119));
    assert_eq!(get(&mut rig, LOAD), (0, vec![32]), "31.5 % rounds up");
    // The row says that the load is held at 255 %.
    put(&mut rig, CURRENT, 65_535);
    assert_eq!(get(&mut rig, LOAD), (0, vec![255]));
    assert_eq!(get(&mut rig, RESERVE), real(-6_513.5));
    assert_eq!(client.ask(&mut rig, SET, 1, POWER, &1.0_f32.to_le_bytes()).0, NOT_SETTABLE);
}

#[test]
fn a_selection_is_read_and_set_where_its_operand_is_selected() {
    let (mut rig, client) = on_sercos("");
    let ask = |rig: &mut Rig, service, value: &[u8]| client.ask(rig, service, 1, GAIN, value);
    assert_eq!(ask(&mut rig, GET, &[]), (0, vec![0x2C, 0x01]));
    assert_eq!(ask(&mut rig, SET, &[0x90, 0x01]), OK);
    assert_eq!((held(&rig, GAIN_A), held(&rig, GAIN_B)), (400, 500));
    assert_eq!(ask(&mut rig, SET, &[0xE9, 0x03]).0, INVALID_VALUE, "1001");
    put(&mut rig, GAIN_SET, 1);
    assert_eq!(ask(&mut rig, GET, &[]), (0, vec![0xF4, 0x01]));
    assert_eq!(ask(&mut rig, SET, &[0x90, 0x01]).0, DEVICE_CONFLICT, "gain B is in force");
    assert_eq!((held(&rig, GAIN_A), held(&rig, GAIN_B)), (400, 500));
    // A set that the row does not know.
    put(&mut rig, GAIN_SET, 2);
    assert_eq!(ask(&mut rig, GET, &[]).0, DEVICE_CONFLICT);
}

#[test]
fn a_computed_value_is_refused_without_its_operands_or_its_drive() {
    let (mut rig, client) = on_sercos(VOLTAGE);
    assert_eq!(client.ask(&mut rig, GET, 1, POWER, &[]).0, NOT_SUPPORTED);
    assert_eq!(client.ask(&mut rig, GET, 1, RESERVE, &[]), real(27.5));
    // The second axis has another drive, with none of it.
    assert_eq!(client.ask(&mut rig, GET, 2, RESERVE, &[]).0, NOT_SUPPORTED);
    rig.cable = false;
    assert_eq!(client.ask(&mut rig, GET, 1, RESERVE, &[]).0, DEVICE_CONFLICT);
    assert_eq!(client.ask(&mut rig, SET, 1, GAIN, &[1, 0]).0, DEVICE_CONFLICT);
    assert_eq!(held(&rig, GAIN_A), 300);
}

#[test]
fn an_object_is_written_as_an_attribute_over_a_constant() {
    let configuration = include_str!("can.toml").to_owned();
    let settings =
        Settings { configuration, drives: Vec::new(), overlays: vec![OVERLAY], ..Settings::default() };
    let mut rig = Rig::new(settings);
    let mut ticks = dictionary::Definition::new("Filter time in ticks", DataType::U16, 16);
    (ticks.low, ticks.high) = (1, 700);
    let node = rig.can[0].bus.nodes_mut().next().expect("a device");
    node.dictionary_mut().add(Mux::new(0x2060, 0), ticks);
    let (mut rig, client) = reached(rig);
    let held =
        |rig: &mut Rig| rig.can[0].bus.nodes_mut().next().expect("a device").dictionary().number(0x2060, 0);
    let set = |rig: &mut Rig, seconds: f32| client.ask(rig, SET, 1, FILTER, &seconds.to_le_bytes());
    assert_eq!(client.ask(&mut rig, GET, 1, FILTER, &[]), real(0.001), "16 ticks of 62.5 us");
    assert_eq!(set(&mut rig, 0.002), OK);
    assert_eq!(held(&mut rig), 32);
    assert_eq!(set(&mut rig, 0.0021), OK, "33.6 ticks");
    assert_eq!(held(&mut rig), 34);
    assert_eq!(client.ask(&mut rig, GET, 1, FILTER, &[]), real(0.002_125));
    // Beyond the row, and beyond the drive: 720 ticks.
    for refused in [0.0, -0.001, 0.0501, f32::NAN, 0.045] {
        assert_eq!(set(&mut rig, refused).0, INVALID_VALUE, "{refused}");
    }
    assert_eq!(held(&mut rig), 34);
}
