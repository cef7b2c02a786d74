//! A parameter that only an overlay knows, from an attribute of the controller to drives and back, and by local control; and a
//! constant.

use axisbridge::engine::local::{ClientEnd, Failure, LocalNorth, Order, Request};
use axisbridge::engine::parameter::ParameterFailure;
use axisbridge::engine::registers::{RegisterEnd, RegisterFailure, RegisterNorth, RegisterRequest};
use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cia402::node::dictionary::{self, DataType};
use profile_cia402::wire::Mux;
use profile_cip::controller::Step;
use profile_cip::device::axis_state::AxisState;
use profile_generic::inhibit::Inhibits;
use profile_generic::parameter::Parameter;
use profile_generic::state::DriveState;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::wire::idn::Idn;

const OVERLAY: &str = include_str!("../../../examples/overlays/vendor-parameter.toml");
const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const OK: (u8, Vec<u8>) = (0, Vec::new());
const INVALID_VALUE: u8 = 0x09;
const NOT_SETTABLE: u8 = 0x0E;
const DEVICE_CONFLICT: u8 = 0x10;
const SHORT: u8 = 0x13;
const NOT_SUPPORTED: u8 = 0x14;
const LONG: u8 = 0x15;
const NOTCH: Option<u16> = Some(2001);
const FILTERS: Option<u16> = Some(2002);

/// P-0-0702 in a SERCOS drive: 2 bytes, unsigned decimal, one decimal place, with write protection as asked.
const NOTCH_IDN: &str = "P-0-0702";
const NOTCH_WRITABLE: u32 = 0x0111_0001;
const NOTCH_READ_ONLY: u32 = 0x7111_0001;

fn idn() -> Idn {
    NOTCH_IDN.parse().expect("an IDN")
}

fn hertz(value: f32) -> Vec<u8> {
    value.to_le_bytes().to_vec()
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

/// Drive 1 has its notch filter at 120 Hz, and takes 60 to 3000 Hz: less than the row at one end, more at the other.
fn on_sercos(attribute: Option<u32>) -> (Rig, Client) {
    let mut rig = Rig::new(Settings { overlays: vec![OVERLAY], ..Settings::default() });
    if let Some(attribute) = attribute {
        let notch = Definition::value(idn(), attribute, "Notch filter frequency", 1_200);
        let store = rig.line.slaves_mut()[0].store_mut();
        store.define(notch.unit("Hz").range(600, 30_000));
    }
    reached(rig)
}

#[test]
fn a_vendors_parameter_is_read_and_set_in_a_sercos_drive() {
    let (mut rig, client) = on_sercos(Some(NOTCH_WRITABLE));
    let held = |rig: &Rig| rig.line.slaves()[0].store().number_of(idn());
    let ask = |rig: &mut Rig, service, value: &[u8]| client.ask(rig, service, 1, NOTCH, value);
    assert_eq!(ask(&mut rig, GET, &[]), (0, hertz(120.0)));
    assert_eq!(ask(&mut rig, SET, &hertz(333.3)), OK);
    assert_eq!(held(&rig), 3_333, "one decimal place");
    assert_eq!(ask(&mut rig, GET, &[]), (0, hertz(333.3)));
    // The range of the row is the gateway's, and what is within it is up to the drive.
    for refused in [2_000.5, 49.9, f32::NAN, f32::INFINITY, 55.0] {
        assert_eq!(ask(&mut rig, SET, &hertz(refused)).0, INVALID_VALUE, "{refused}");
    }
    assert_eq!(ask(&mut rig, SET, &[0; 3]).0, SHORT);
    assert_eq!(ask(&mut rig, SET, &[0; 5]).0, LONG);
    assert_eq!(held(&rig), 3_333, "nothing of that reached the drive");
    assert_eq!(ask(&mut rig, SET, &hertz(60.0)), OK);
    assert_eq!(held(&rig), 600);
}

/// A drive that lacks it, or lets it only be read, never makes a set succeed.
#[test]
fn a_vendors_parameter_is_refused_where_the_drive_does_not_take_it() {
    let (mut rig, client) = on_sercos(None);
    assert_eq!(client.ask(&mut rig, GET, 1, NOTCH, &[]).0, NOT_SUPPORTED);
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(100.0)).0, NOT_SUPPORTED);
    let (mut rig, client) = on_sercos(Some(NOTCH_READ_ONLY));
    assert_eq!(client.ask(&mut rig, GET, 1, NOTCH, &[]), (0, hertz(120.0)));
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(100.0)).0, NOT_SETTABLE);
    assert_eq!(rig.line.slaves()[0].store().number_of(idn()), 1_200);
    // The second axis has another drive, without the filter.
    assert_eq!(client.ask(&mut rig, GET, 2, NOTCH, &[]).0, NOT_SUPPORTED);
}

#[test]
fn a_vendors_parameter_is_not_answered_without_its_drive() {
    let (mut rig, client) = on_sercos(Some(NOTCH_WRITABLE));
    rig.cable = false;
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(100.0)).0, DEVICE_CONFLICT);
    // The gateway has noticed by now.
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(100.0)).0, DEVICE_CONFLICT);
    assert_eq!(rig.line.slaves()[0].store().number_of(idn()), 1_200);
}

#[test]
fn a_vendors_parameter_is_read_and_set_in_a_canopen_drive() {
    let configuration = include_str!("can.toml").to_owned();
    let settings =
        Settings { configuration, drives: Vec::new(), overlays: vec![OVERLAY], ..Settings::default() };
    let mut rig = Rig::new(settings);
    let mut notch = dictionary::Definition::new("Notch filter frequency", DataType::U16, 120);
    (notch.low, notch.high) = (60, 1_500);
    let node = rig.can[0].bus.nodes_mut().next().expect("a device");
    node.dictionary_mut().add(Mux::new(0x2051, 0), notch);
    let (mut rig, client) = reached(rig);
    let held =
        |rig: &mut Rig| rig.can[0].bus.nodes_mut().next().expect("a device").dictionary().number(0x2051, 0);
    assert_eq!(client.ask(&mut rig, GET, 1, NOTCH, &[]), (0, hertz(120.0)));
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(444.0)), OK);
    assert_eq!(held(&mut rig), 444);
    // 1600 Hz is within the row, not within the drive.
    for refused in [2_001.0, 49.0, 1_600.0] {
        assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(refused)).0, INVALID_VALUE, "{refused}");
    }
    assert_eq!(held(&mut rig), 444);
    assert_eq!(client.ask(&mut rig, GET, 1, NOTCH, &[]), (0, hertz(444.0)));
}

#[test]
fn a_constant_is_set_only_to_what_it_is() {
    let (mut rig, client) = on_sercos(None);
    assert_eq!(client.ask(&mut rig, GET, 1, FILTERS, &[]), (0, vec![3]));
    assert_eq!(client.ask(&mut rig, SET, 1, FILTERS, &[3]), OK);
    for other in [0, 2, 4, 255] {
        assert_eq!(client.ask(&mut rig, SET, 1, FILTERS, &[other]).0, INVALID_VALUE, "{other}");
    }
    assert_eq!(client.ask(&mut rig, SET, 1, FILTERS, &[]).0, SHORT);
    assert_eq!(client.ask(&mut rig, GET, 1, FILTERS, &[]), (0, vec![3]));
}

/// The notch filter's frequency by its number.
const NOTCH_PARAMETER: Parameter = Parameter(0x8001);

/// Reads the notch filter's frequency of an axis as a client of local control, or writes it.
fn access(
    rig: &mut Rig,
    end: &mut ClientEnd,
    of: (u32, u8),
    wanted: Option<i64>,
) -> Result<Option<i64>, Failure> {
    access_of(rig, end, of, (NOTCH_PARAMETER, wanted))
}

/// Reads a parameter of an axis as a client of local control, or writes it.
fn access_of(
    rig: &mut Rig,
    end: &mut ClientEnd,
    (client, axis): (u32, u8),
    (parameter, wanted): (Parameter, Option<i64>),
) -> Result<Option<i64>, Failure> {
    let request = Request::Parameter { client, id: 7, axis, parameter, wanted };
    end.requests.push(request).expect("room");
    for _ in 0..5_000 {
        if let Ok(answer) = end.answers.pop() {
            assert_eq!((answer.client, answer.id), (client, 7));
            return answer.result;
        }
        rig.run_for(millis(1));
    }
    panic!("no answer: {}", rig.told());
}

#[test]
fn a_vendors_parameter_is_read_and_written_by_local_control() {
    let mut rig = Rig::new(Settings { overlays: vec![OVERLAY], ..Settings::default() });
    let notch = Definition::value(idn(), NOTCH_WRITABLE, "Notch filter frequency", 1_200);
    rig.line.slaves_mut()[0].store_mut().define(notch.unit("Hz").range(600, 15_000));
    let (local, mut end) = LocalNorth::new(rig.engine.axes().len());
    rig.engine.set_local(local);
    rig.until_ready();
    rig.run_for(millis(200));
    let held = |rig: &Rig| rig.line.slaves()[0].store().number_of(idn());
    let (me, other, second) = ((1, 0), (2, 0), (1, 1));
    assert_eq!(access(&mut rig, &mut end, me, None), Ok(Some(120_000)), "millihertz");
    assert_eq!(access(&mut rig, &mut end, me, Some(333_300)), Ok(Some(333_300)));
    assert_eq!(held(&rig), 3_333);
    // Beyond the row, and beyond the drive.
    for refused in [49_999, 2_000_001, i64::MIN, i64::MAX, 1_600_000] {
        let value = Err(Failure::Parameter(ParameterFailure::Value));
        assert_eq!(access(&mut rig, &mut end, me, Some(refused)), value, "{refused}");
    }
    // The second axis has another drive, without the filter.
    let absent = Err(Failure::Parameter(ParameterFailure::Absent));
    assert_eq!(access(&mut rig, &mut end, second, None), absent);
    assert_eq!(access(&mut rig, &mut end, (1, 9), None), Err(Failure::NoAxis));
    // Who has the axis decides what is written; everybody can read.
    end.requests.push(Request::Order { client: 2, id: 8, axis: 0, order: Order::Enable }).expect("room");
    rig.run_until(millis(5_000), "an enabled axis", |rig| {
        rig.engine.axes()[0].state() == DriveState::Operating
    });
    rig.run_for(millis(500));
    assert_eq!(end.answers.pop().map(|answer| answer.result), Ok(Ok(None)), "enabled");
    assert_eq!(access(&mut rig, &mut end, me, Some(100_000)), Err(Failure::Held));
    assert_eq!(access(&mut rig, &mut end, other, Some(200_000)), Ok(Some(200_000)));
    assert_eq!(access(&mut rig, &mut end, me, None), Ok(Some(200_000)));
    rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
    rig.run_until(millis(60_000), "a controller", |rig| rig.engine.axes()[0].has_controller());
    rig.run_for(millis(100));
    for client in [me, other] {
        assert_eq!(access(&mut rig, &mut end, client, Some(100_000)), Err(Failure::Controller));
    }
    assert_eq!(access(&mut rig, &mut end, me, None), Ok(Some(200_000)));
    assert_eq!(held(&rig), 2_000);
    rig.cable = false;
    assert_eq!(access(&mut rig, &mut end, me, None), Err(Failure::Parameter(ParameterFailure::Unanswered)));
}

/// Reads the notch filter's frequency of the first axis as a register, or writes it.
fn register(rig: &mut Rig, end: &mut RegisterEnd, wanted: Option<i64>) -> Result<i64, RegisterFailure> {
    register_of(rig, end, (NOTCH_PARAMETER, wanted))
}

/// Reads a parameter of the first axis as a register, or writes it.
fn register_of(
    rig: &mut Rig,
    end: &mut RegisterEnd,
    (parameter, wanted): (Parameter, Option<i64>),
) -> Result<i64, RegisterFailure> {
    let request = RegisterRequest { id: 3, axis: 0, parameter, wanted };
    end.requests.push(request).expect("room");
    for _ in 0..5_000 {
        if let Ok(answer) = end.answers.pop() {
            assert_eq!(answer.id, 3);
            return answer.result;
        }
        rig.run_for(millis(1));
    }
    panic!("no answer: {}", rig.told());
}

#[test]
fn a_vendors_parameter_is_read_and_written_as_a_register_while_nobody_has_the_axis() {
    let mut rig = Rig::new(Settings { overlays: vec![OVERLAY], ..Settings::default() });
    let notch = Definition::value(idn(), NOTCH_WRITABLE, "Notch filter frequency", 1_200);
    rig.line.slaves_mut()[0].store_mut().define(notch.unit("Hz").range(600, 30_000));
    let (registers, mut end) = RegisterNorth::new();
    rig.engine.set_registers(registers);
    let (local, mut client) = LocalNorth::new(rig.engine.axes().len());
    rig.engine.set_local(local);
    rig.until_ready();
    rig.run_for(millis(200));
    let held = |rig: &Rig| rig.line.slaves()[0].store().number_of(idn());
    assert_eq!(register(&mut rig, &mut end, None), Ok(120_000));
    assert_eq!(register(&mut rig, &mut end, Some(250_000)), Ok(250_000));
    assert_eq!(held(&rig), 2_500);
    // Beyond the row, and beyond the drive.
    for refused in [2_000_001, 49_999, 55_000] {
        let value = Err(RegisterFailure::Parameter(ParameterFailure::Value));
        assert_eq!(register(&mut rig, &mut end, Some(refused)), value, "{refused}");
    }
    let owned = Err(RegisterFailure::Owned);
    client.requests.push(Request::Order { client: 2, id: 8, axis: 0, order: Order::Enable }).expect("room");
    rig.run_until(millis(5_000), "an enabled axis", |rig| {
        rig.engine.axes()[0].state() == DriveState::Operating
    });
    assert_eq!(register(&mut rig, &mut end, Some(100_000)), owned);
    rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
    rig.run_until(millis(60_000), "a controller", |rig| rig.engine.axes()[0].has_controller());
    rig.run_for(millis(100));
    assert_eq!(register(&mut rig, &mut end, Some(100_000)), owned);
    assert_eq!(register(&mut rig, &mut end, None), Ok(250_000));
    assert_eq!(held(&rig), 2_500);
}

/// Ends the connection of the controller.
fn disconnect(rig: &mut Rig) {
    rig.kill_controller();
    rig.run_until(millis(5_000), "the connection is lost", |rig| rig.status().connections == 0);
}

/// What a person has set while no controller was connected is not taken back for what the drive had before a controller changed it.
#[test]
fn what_was_written_by_name_or_as_a_register_stays_when_a_controller_connects() {
    let can = Settings::without_line(include_str!("can.toml"));
    let mut seen = Vec::new();
    for (bus, settings) in [("SERCOS", Settings::default()), ("CANopen", can)] {
        for by_register in [false, true] {
            let mut rig = Rig::new(Settings { overlays: vec![OVERLAY], ..settings.clone() });
            if bus == "SERCOS" {
                let notch = Definition::value(idn(), NOTCH_WRITABLE, "Notch filter frequency", 1_200);
                rig.line.slaves_mut()[0].store_mut().define(notch.unit("Hz").range(600, 30_000));
            } else {
                let mut notch = dictionary::Definition::new("Notch filter frequency", DataType::U16, 120);
                (notch.low, notch.high) = (60, 1_500);
                let node = rig.can[0].bus.nodes_mut().next().expect("a device");
                node.dictionary_mut().add(Mux::new(0x2051, 0), notch);
            }
            let (local, mut names) = LocalNorth::new(rig.engine.axes().len());
            rig.engine.set_local(local);
            let (registers, mut numbers) = RegisterNorth::new();
            rig.engine.set_registers(registers);
            let (mut rig, client) = reached(rig);
            assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(333.0)), OK);
            disconnect(&mut rig);
            if by_register {
                assert_eq!(register(&mut rig, &mut numbers, Some(250_000)), Ok(250_000));
            } else {
                assert_eq!(access(&mut rig, &mut names, (1, 0), Some(250_000)), Ok(Some(250_000)));
            }
            rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
            rig.run_for(millis(5_000));
            seen.push((bus, by_register, access(&mut rig, &mut names, (1, 0), None)));
            // What a controller changes from then on ends with its connection.
            let client = Client::connect(&mut rig, CONTROLLER);
            assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(333.0)), OK);
            disconnect(&mut rig);
            rig.connect(vec![Step::Dwell { seconds: 1_000.0 }]);
            rig.run_for(millis(5_000));
            seen.push((bus, by_register, access(&mut rig, &mut names, (1, 0), None)));
        }
    }
    let kept = |bus, by_register| [(bus, by_register, Ok(Some(250_000))); 2];
    let expected = [("SERCOS", false), ("SERCOS", true), ("CANopen", false), ("CANopen", true)];
    assert_eq!(seen, expected.map(|(bus, by_register)| kept(bus, by_register)).concat());
}

/// The same parameter where drives have it as floating point numbers of 32 bits.
fn in_real32() -> &'static str {
    let sercos = ("length = 2\nformat = \"unsigned\"\ndecimals = 1", "length = 4\nformat = \"float\"");
    let can = ("type = \"u16\"", "type = \"f32\"");
    assert!(OVERLAY.contains(sercos.0) && OVERLAY.contains(can.0));
    Box::leak(OVERLAY.replacen(sercos.0, sercos.1, 1).replacen(can.0, can.1, 1).into_boxed_str())
}

/// A number as a drive keeps it in four bytes.
fn bits(value: f32) -> i64 {
    i64::from(value.to_bits())
}

#[test]
fn a_vendors_parameter_is_a_floating_point_number_in_a_sercos_drive() {
    let mut rig = Rig::new(Settings { overlays: vec![in_real32()], ..Settings::default() });
    // Four bytes, floating point.
    let notch = Definition::value(idn(), 0x0062_0001, "Notch filter frequency", bits(120.25));
    rig.line.slaves_mut()[0].store_mut().define(notch.unit("Hz"));
    let (mut rig, client) = reached(rig);
    let held = |rig: &Rig| rig.line.slaves()[0].store().number_of(idn());
    assert_eq!(client.ask(&mut rig, GET, 1, NOTCH, &[]), (0, hertz(120.25)));
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(333.3)), OK);
    assert_eq!(held(&rig), bits(333.3));
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(2_000.5)).0, INVALID_VALUE);
    // What is no number is not answered as one.
    for none in [f32::NAN, f32::INFINITY, 1e30] {
        let store = rig.line.slaves_mut()[0].store_mut();
        let handle = store.find(idn()).expect("the drive has it");
        store.set_number(handle, bits(none));
        assert_eq!(client.ask(&mut rig, GET, 1, NOTCH, &[]).0, DEVICE_CONFLICT, "{none}");
    }
}

#[test]
fn a_vendors_parameter_is_a_floating_point_number_in_a_canopen_drive() {
    let configuration = include_str!("can.toml").to_owned();
    let settings =
        Settings { configuration, drives: Vec::new(), overlays: vec![in_real32()], ..Settings::default() };
    let mut rig = Rig::new(settings);
    let notch = dictionary::Definition::new("Notch filter frequency", DataType::U32, bits(120.25));
    let node = rig.can[0].bus.nodes_mut().next().expect("a device");
    node.dictionary_mut().add(Mux::new(0x2051, 0), notch);
    let (mut rig, client) = reached(rig);
    let held =
        |rig: &mut Rig| rig.can[0].bus.nodes_mut().next().expect("a device").dictionary().number(0x2051, 0);
    assert_eq!(client.ask(&mut rig, GET, 1, NOTCH, &[]), (0, hertz(120.25)));
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(333.3)), OK);
    assert_eq!(held(&mut rig), bits(333.3));
    assert_eq!(client.ask(&mut rig, SET, 1, NOTCH, &hertz(49.9)).0, INVALID_VALUE);
    assert_eq!(held(&mut rig), bits(333.3));
}

/// Runs until there is an answer. The drive makes something else of the first value that it is given.
fn until_answered<T>(
    rig: &mut Rig,
    becomes: impl Fn(i64) -> i64,
    mut answer: impl FnMut() -> Option<T>,
) -> T {
    let number = |rig: &Rig| rig.line.slaves()[0].store().number_of(idn());
    let (before, mut is_done) = (number(rig), false);
    for _ in 0..5_000 {
        if let Some(answer) = answer() {
            return answer;
        }
        rig.run_for(millis(1));
        let now = number(rig);
        if now != before && !is_done {
            is_done = true;
            rig.line.slaves_mut()[0].store_mut().set_number_of(idn(), becomes(now));
        }
    }
    panic!("no answer: {}", rig.told());
}

#[test]
fn a_drive_that_keeps_another_value_is_found_out_by_local_control_and_registers() {
    let mut rig = Rig::new(Settings { overlays: vec![OVERLAY], ..Settings::default() });
    let notch = Definition::value(idn(), NOTCH_WRITABLE, "Notch filter frequency", 1_200);
    rig.line.slaves_mut()[0].store_mut().define(notch.unit("Hz").range(600, 15_000));
    let (registers, mut register) = RegisterNorth::new();
    rig.engine.set_registers(registers);
    let (local, mut client) = LocalNorth::new(rig.engine.axes().len());
    rig.engine.set_local(local);
    rig.until_ready();
    rig.run_for(millis(200));
    // Half of the value; then one step of 1400, which a drive may round.
    for (wanted, becomes, is_kept) in [(200_000, 1_000, false), (140_000, 1_399, true)] {
        let request = RegisterRequest { id: 3, axis: 0, parameter: NOTCH_PARAMETER, wanted: Some(wanted) };
        register.requests.push(request).expect("room");
        let answer = until_answered(&mut rig, |_| becomes, || register.answers.pop().ok());
        let not_kept = RegisterFailure::Parameter(ParameterFailure::NotKept);
        assert_eq!(answer.result, if is_kept { Ok(wanted) } else { Err(not_kept) });
        // Another value than the one that it has now.
        let wanted = wanted + 20_000;
        let parameter = NOTCH_PARAMETER;
        let request = Request::Parameter { client: 1, id: 7, axis: 0, parameter, wanted: Some(wanted) };
        client.requests.push(request).expect("room");
        let becomes = if is_kept { 1_599 } else { 1_000 };
        let answer = until_answered(&mut rig, |_| becomes, || client.answers.pop().ok());
        let not_kept = Failure::Parameter(ParameterFailure::NotKept);
        assert_eq!(answer.result, if is_kept { Ok(Some(wanted)) } else { Err(not_kept) });
    }
}

/// A parameter of the drive that decides what its positions mean, which no table writes.
const FEED_OVERLAY: &str = r#"
format = 1
overlay = "feed of line 4"

[[generic.parameter]]
number = 0x8003
name = "feed_turns"
quantity = "none"
type = "integer"
access = "write_while_disabled"
range = [1, 100]
about = "Shaft revolutions of the feed."

[[cip-attributes.clauses]]
source = "Maker"
clause = "1"
title = "Attributes of the drives of line 4"

[[cip-attributes.attribute]]
id = 2_003
name = "Feed Turns"
type = "UDINT"
access = "set"
need = "------"
source = "Maker"

[[cip-generic.attribute]]
attribute = "Feed Turns"
parameter = "feed_turns"
missing = "reject"
source = "Maker"

[[generic-cia402.parameter]]
parameter = "feed_turns"
object = "6092:02"
direction = "both"
missing = "reject"
source = "manual of the drive"
"#;
const FEED: Parameter = Parameter(0x8003);
const FEED_ATTRIBUTE: Option<u16> = Some(2003);

/// The clients of local control and of registers on a rig of CANopen drives. The first takes up to 5 shaft revolutions.
fn with_feed(configuration: &str) -> (Rig, ClientEnd, RegisterEnd) {
    let settings =
        Settings { overlays: vec![FEED_OVERLAY], ..Settings::without_line(configuration.to_owned()) };
    let mut rig = Rig::new(settings);
    let dictionary = rig.can[0].bus.nodes_mut().next().expect("a device").dictionary_mut();
    let turns = dictionary.find(Mux::new(0x6092, 2)).expect("the device has it");
    let definition = dictionary::Definition::new("Shaft revolutions", DataType::U32, 1);
    dictionary.redefine(turns, definition.range(1, 5));
    let (local, names) = LocalNorth::new(rig.engine.axes().len());
    rig.engine.set_local(local);
    let (registers, numbers) = RegisterNorth::new();
    rig.engine.set_registers(registers);
    (rig, names, numbers)
}

/// Which axes cannot be enabled because the scaling of their drives was changed.
fn rescaled(rig: &mut Rig) -> Vec<bool> {
    rig.run_for(millis(100));
    let inhibits = rig.engine.axes().iter().map(|axis| axis.feedback().inhibits);
    inhibits.map(|inhibits| inhibits.contains(Inhibits::TRANSFER_ACTIVE)).collect()
}

/// The program of an axis was made of the scaling that its drive had when it was commissioned.
#[test]
fn axis_whose_scaling_was_written_by_name_or_as_a_register_is_not_enabled() {
    for by_register in [false, true] {
        let (mut rig, mut names, mut numbers) = with_feed(include_str!("can.toml"));
        rig.until_ready();
        rig.run_for(millis(200));
        let mut write = |rig: &mut Rig, names: &mut ClientEnd, value| {
            if by_register {
                let written = register_of(rig, &mut numbers, (FEED, Some(value)));
                return written.map_err(|failure| format!("{failure}"));
            }
            let written = access_of(rig, names, (1, 0), (FEED, Some(value)));
            written.map(Option::unwrap_or_default).map_err(|failure| format!("{failure}"))
        };
        // Beyond the row, and beyond the drive: the scaling is what it was.
        for refused in [101, 7] {
            assert!(write(&mut rig, &mut names, refused).is_err(), "{refused}");
            assert_eq!(rescaled(&mut rig), [false, false], "{refused}");
        }
        assert_eq!(write(&mut rig, &mut names, 2), Ok(2));
        assert_eq!(rescaled(&mut rig), [true, false], "the other axis has another device");
        // What is refused later undoes nothing.
        assert!(write(&mut rig, &mut names, 7).is_err());
        assert_eq!(rescaled(&mut rig), [true, false]);
        names
            .requests
            .push(Request::Order { client: 1, id: 8, axis: 0, order: Order::Enable })
            .expect("room");
        for _ in 0..3_000 {
            rig.run_for(millis(1));
            assert!(!rig.engine.axes()[0].may_have_torque());
        }
        // Commissioned again, with the scaling that it has now.
        let now = rig.clock().get();
        rig.can[0].bus.nodes_mut().next().expect("a device").power_cycle(now);
        rig.run_until(millis(20_000), "the drive", |rig| {
            let axis = &rig.engine.axes()[0];
            !axis.feedback().inhibits.contains(Inhibits::TRANSFER_ACTIVE) && axis.south().is_some()
        });
    }
}

/// Both axes of a CANopen device have one drive: whoever controls one of them keeps the parameters of both.
#[test]
fn nothing_is_written_by_name_or_as_a_register_while_another_axis_of_the_device_is_controlled() {
    let configuration = include_str!("can.toml").replace("node = 2", "node = 1\naxis = 1");
    let (mut rig, mut names, mut numbers) = with_feed(&configuration);
    rig.until_ready();
    rig.run_for(millis(200));
    names.requests.push(Request::Order { client: 2, id: 8, axis: 1, order: Order::Enable }).expect("room");
    rig.run_until(millis(5_000), "an enabled axis", |rig| {
        rig.engine.axes()[1].state() == DriveState::Operating
    });
    rig.run_for(millis(500));
    assert_eq!(names.answers.pop().map(|answer| answer.result), Ok(Ok(None)), "enabled");
    let owned = Err(RegisterFailure::Owned);
    assert_eq!(register_of(&mut rig, &mut numbers, (FEED, Some(2))), owned);
    // Not even by the client that has the other axis: that axis has torque.
    for client in [1, 2] {
        assert!(access_of(&mut rig, &mut names, (client, 0), (FEED, Some(2))).is_err(), "client {client}");
    }
    assert_eq!(register_of(&mut rig, &mut numbers, (FEED, None)), Ok(1), "reading disturbs nobody");
    assert_eq!(rescaled(&mut rig), [false, false]);
}

#[test]
fn axis_whose_scaling_a_controller_has_set_is_not_enabled() {
    let (rig, _names, _numbers) = with_feed(include_str!("can.toml"));
    let (mut rig, client) = reached(rig);
    assert_eq!(client.ask(&mut rig, SET, 1, FEED_ATTRIBUTE, &7_u32.to_le_bytes()).0, INVALID_VALUE);
    assert_eq!(rescaled(&mut rig), [false, false]);
    assert_eq!(client.ask(&mut rig, SET, 1, FEED_ATTRIBUTE, &2_u32.to_le_bytes()), OK);
    assert_eq!(rescaled(&mut rig), [true, false]);
}
