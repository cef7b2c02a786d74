//! Parameters of drives by the number that they have there: a line of local control, its accesses in the engine and on the bus, the
//! drive, and the reply.

use std::collections::BTreeMap;

use axisbridge::config::{Config, DevicenetKind};
use axisbridge::engine::axis::Owner;
use axisbridge::engine::direct::{DirectEnd, DirectNorth, DirectRequest};
use axisbridge::engine::local::{ClientEnd, LocalNorth, Order, Request};
use axisbridge::local::drive::job::{Context, Job, Step};
use axisbridge::local::protocol;
use axisbridge::parameter::known::Catalogue;
use axisbridge::simulate::devicenet_drive::DevicenetNode;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{BOX, Rig, Settings};
use profile_cia402::node::dictionary::{self, DataType};
use profile_cia402::wire::Mux;
use profile_cip::controller::{AxisSet, Limits, Step as Move};
use profile_cip::devicenet::slave::speed_drive::objects::Settings as SpeedSettings;
use profile_cip::devicenet::wire::speed::Assembly;
use profile_generic::cast::f64_from_i64;
use profile_generic::inhibit::Inhibits;
use profile_generic::state::DriveState;
use profile_sercos::slave::parameter::Definition;
use profile_sercos::wire::idn::Idn;

use super::beside::connect;
use super::devicenet::velocity_drive;
use super::startup_lists::{real, replace_devicenet_drive, replace_devicenet_drive_by};

/// The axes of all configurations.
const AXES: [&str; 2] = ["turntable", "slide"];

/// A box with local control, and a client.
pub(super) struct Bench {
    pub(super) rig: Rig,
    orders: ClientEnd,
    end: DirectEnd,
    catalogue: Catalogue,
    ids: u32,
}

impl Bench {
    /// On a rig whose drives are not up yet.
    fn new(mut rig: Rig, configuration: &str) -> Self {
        let (local, orders) = LocalNorth::new(rig.engine.axes().len());
        rig.engine.set_local(local);
        let (direct, end) = DirectNorth::new();
        rig.engine.set_direct(direct);
        rig.until_ready();
        rig.run_for(millis(200));
        let config = Config::parse(configuration, "box.toml").expect("a configuration");
        let catalogue = Catalogue::of(&config, rig.engine.mapping());
        Self { rig, orders, end, catalogue, ids: 0 }
    }

    pub(super) fn sercos(prepare: impl FnOnce(&mut Rig)) -> Self {
        let mut rig = Rig::new(Settings::default());
        prepare(&mut rig);
        Self::new(rig, BOX)
    }

    pub(super) fn canopen(more: &str, prepare: impl FnOnce(&mut Rig)) -> Self {
        let configuration = format!("{}{more}", include_str!("can.toml"));
        let settings = Settings::without_line(configuration.clone());
        let mut rig = Rig::new(settings);
        prepare(&mut rig);
        Self::new(rig, &configuration)
    }

    fn devicenet(configuration: &str) -> Self {
        Self::new(Rig::new(Settings::without_line(configuration.to_owned())), configuration)
    }

    /// The reply to a line.
    pub(super) fn say(&mut self, line: &str) -> String {
        self.say_while(line, |_, _| {})
    }

    /// The reply to a line; `ahead` is called ahead of each access, with its number.
    fn say_while(&mut self, line: &str, ahead: impl FnMut(&mut Rig, usize)) -> String {
        self.say_amid(line, ahead, |_| {})
    }

    /// The same; `amid` is called in each millisecond of an access.
    fn say_amid(
        &mut self,
        line: &str,
        mut ahead: impl FnMut(&mut Rig, usize),
        mut amid: impl FnMut(&mut Rig),
    ) -> String {
        let axes = AXES.map(str::to_owned);
        let request = protocol::parse(line, &axes, &[]).expect(line);
        let protocol::Request::Drive { axis, ask } = request else { panic!("{line}: {request:?}") };
        let context = Context {
            axis: AXES[axis],
            bus: self.catalogue.bus(axis),
            catalogue: &self.catalogue,
            parameters: &[],
        };
        let (mut job, mut step) = match Job::begin(ask, &context) {
            Ok(begun) => begun,
            Err(reply) => return reply,
        };
        for number in 0..20 {
            ahead(&mut self.rig, number);
            match step {
                Step::Reply(reply) => return reply,
                Step::Access(target, direction, data) => {
                    self.ids += 1;
                    let axis = u8::try_from(axis).expect("few axes");
                    let id = self.ids;
                    let request = DirectRequest { client: 3, id, axis, target, direction, data };
                    self.end.requests.push(request).expect("room");
                }
            }
            let answer = loop {
                if let Ok(answer) = self.end.answers.pop() {
                    break answer;
                }
                self.rig.run_for(millis(1));
                amid(&mut self.rig);
            };
            assert_eq!((answer.client, answer.id), (3, self.ids));
            step = job.take(answer, &context);
        }
        panic!("no end of {line}");
    }

    pub(super) fn object(&mut self, line: &str) -> serde_json::Value {
        let reply = self.say(line);
        let start = reply.find('{').unwrap_or_else(|| panic!("{line} gives {reply}"));
        assert!(reply.starts_with("ok "), "{reply}");
        serde_json::from_str(&reply[start..]).expect("an object")
    }

    /// Enables the turntable as another client.
    pub(super) fn enable(&mut self) {
        self.orders
            .requests
            .push(Request::Order { client: 2, id: 8, axis: 0, order: Order::Enable })
            .expect("room");
        self.rig.run_until(millis(5_000), "an enabled axis", |rig| {
            rig.engine.axes()[0].state() == DriveState::Operating
        });
    }
}

pub(super) fn held(bench: &Bench, idn: Idn) -> i64 {
    bench.rig.line.slaves()[0].store().number_of(idn)
}

fn object_of(bench: &mut Bench, index: u16, sub: u8) -> i64 {
    bench.rig.can[0].bus.nodes_mut().next().expect("a device").dictionary().number(index, sub)
}

/// A gain of the vendor with everything that an IDN can have.
const GAIN: &str = "P-0-4000";

fn with_gain(rig: &mut Rig) {
    let gain = Definition::value(GAIN.parse().expect("an IDN"), 0x0221_0001, "Own gain", -125);
    rig.line.slaves_mut()[0].store_mut().define(gain.unit("A").range(-1_000, 1_000));
}

#[test]
fn the_elements_of_an_idn_are_shown_as_its_attribute_says() {
    let mut bench = Bench::sercos(with_gain);
    let shown = bench.say("read turntable P-0-4000");
    let expected = "ok read turntable {\"id\":\"P-0-4000\",\"name\":\"Own gain\",\"type\":\"2 byte signed, 2 decimals\",\
                    \"unit\":\"A\",\"minimum\":\"-10.00\",\"maximum\":\"10.00\",\"attribute\":\"0x02210001\",\
                    \"writable\":\"without torque\",\"value\":\"-1.25\",\"data\":\"83ff\"}\n";
    assert_eq!(shown, expected);
    let brief = bench.object("read turntable P-0-4000 brief");
    assert_eq!((&brief["name"], &brief["value"]), (&"Own gain".into(), &"-1.25".into()));
    assert_eq!((&brief["unit"], &brief["minimum"]), (&serde_json::Value::Null, &serde_json::Value::Null));
    // Longer than a request of the cycle: a list of hundreds of IDNs, and a text.
    let all = bench.object("read turntable S-0-0017");
    let value = all["value"].as_str().expect("text");
    assert!(value.split(',').count() > 100 && value.split(',').any(|idn| idn == "S-0-0134"), "{value}");
    assert_eq!(all["data"].as_str().map(str::len), Some(8 * value.split(',').count()));
    let reply = bench.say("read turntable P-0-0001");
    assert_eq!(
        reply,
        "error read turntable absent: P-0-0001: the drive refuses the IDN with 0x1001: IDN not available\n"
    );
    let other = "error read turntable no-parameter: 6081:00 is a number of CANopen drives: the drive of this axis is another one\n";
    assert_eq!(bench.say("read turntable 6081h"), other);
}

#[test]
fn an_idn_is_written_and_read_back_and_the_drives_own_words_are_in_a_refusal() {
    let mut bench = Bench::sercos(with_gain);
    let gain: Idn = GAIN.parse().expect("an IDN");
    let written = bench.object("write turntable P-0-4000 3.5");
    assert_eq!((&written["before"], &written["value"]), (&"-1.25".into(), &"3.50".into()));
    assert_eq!(held(&bench, gain), 350);
    for (line, reply) in [
        (
            "write turntable P-0-4000 10.01",
            "error write turntable value: P-0-4000: the drive refuses the operation data with 0x7007: operation data is above \
             the maximum\n",
        ),
        (
            "write turntable P-0-4000 hex:010203",
            "error write turntable value: P-0-4000: 3 bytes to write where 2 are needed\n",
        ),
        (
            "write turntable P-0-4000 1.255",
            "error write turntable value: `1.255` is not a number with at most 2 decimals\n",
        ),
        (
            "write turntable S-0-0148 3",
            "error write turntable command: S-0-0148 is a procedure command: it is executed, not written\n",
        ),
        (
            "write turntable S-0-0134 0",
            "error write turntable gateway: S-0-0134 is not written: the gateway commands the drive with it\n",
        ),
    ] {
        assert_eq!(bench.say(line), reply, "{line}");
    }
    // The scaling is write protected in CP4.
    let reply = bench.say("write turntable S-0-0079 360000");
    assert!(
        reply.starts_with(
            "error write turntable refused: S-0-0079: the drive refuses the operation data with 0x70"
        ),
        "{reply}"
    );
    assert_eq!(held(&bench, gain), 350, "nothing of that reached the drive");
}

#[test]
fn a_drive_that_accepts_a_value_and_does_not_keep_it_is_named_with_both() {
    let mut bench = Bench::sercos(with_gain);
    let gain: Idn = GAIN.parse().expect("an IDN");
    // The value as it is, the write, and then what the drive has made of it.
    let reply = bench.say_while("write turntable P-0-4000 3.5", |rig, number| {
        if number == 2 {
            rig.line.slaves_mut()[0].store_mut().set_number_of(gain, 349);
        }
    });
    assert_eq!(
        reply,
        "error write turntable not-kept: the drive took P-0-4000 = 3.50 and has 3.49 afterwards\n"
    );
    let mut bench = Bench::canopen("", |_| {});
    let reply = bench.say_while("write turntable 6081h 5", |rig, number| {
        if number == 2 {
            rig.can[0].bus.nodes_mut().next().expect("a device").dictionary_mut().set(0x6081, 0, 4);
        }
    });
    assert_eq!(reply, "error write turntable not-kept: the drive took 6081:00 = 5 and has 4 afterwards\n");
}

/// A list that gets longer or shorter while its parts are read, and a number that changes between its value and its limits.
#[test]
fn a_parameter_that_changes_while_it_is_read_is_an_error_or_one_of_both_values() {
    let mut bench = Bench::sercos(with_gain);
    let all = bench.say("list turntable");
    let count = all.lines().count();
    assert!(all.contains("ok list turntable ") && count > 50, "{all}");
    let store = bench.rig.line.slaves()[0].store();
    let whole = store.get(store.find(Idn::standard(17)).expect("the list")).data().to_vec();
    let mut cut = whole.clone();
    cut.truncate(whole.len() - 12);
    for (before, after) in [(&whole, &cut), (&cut, &whole)] {
        bench.rig.line.slaves_mut()[0].store_mut().set_data_of(Idn::standard(17), before);
        let mut passed = 0;
        let reply = bench.say_amid(
            "list turntable",
            |_, _| {},
            |rig| {
                passed += 1;
                if passed == 40 {
                    rig.line.slaves_mut()[0].store_mut().set_data_of(Idn::standard(17), after);
                }
            },
        );
        assert!(passed > 40, "it was read for {passed} ms");
        assert!(reply.starts_with("error list turntable refused: "), "{reply}");
    }
    assert_eq!(bench.say("list turntable"), all, "the next one is whole");
    // Value, name, unit, minimum and maximum are read one after the other.
    let gain: Idn = GAIN.parse().expect("an IDN");
    let mut reads = 0;
    let reply = bench.say_while("read turntable P-0-4000", |rig, number| {
        reads = reads.max(number);
        rig.line.slaves_mut()[0].store_mut().set_number_of(gain, if number == 0 { 350 } else { 349 });
    });
    assert!(reads >= 2 && reply.contains("\"value\":\"3.50\""), "the value that was read: {reply}");
    assert_eq!(bench.object("read turntable P-0-4000")["value"], "3.49");
}

#[test]
fn an_object_of_unknown_type_is_shown_as_bytes_and_written_with_its_type() {
    let mut bench = Bench::canopen("", |rig| {
        let node = rig.can[0].bus.nodes_mut().next().expect("a device");
        node.dictionary_mut().add(Mux::new(0x2100, 0), dictionary::Definition::new("Own", DataType::I16, -2));
    });
    let own = bench.object("read turntable 2100h");
    assert_eq!((&own["value"], &own["type"]), (&"hex:feff".into(), &serde_json::Value::Null));
    let reply = bench.say("write turntable 2100h 9");
    assert!(
        reply.starts_with(
            "error write turntable value: the type of the parameter is not known: write it as u16:9"
        ),
        "{reply}"
    );
    let written = bench.object("write turntable 2100h i16:-9");
    assert_eq!((&written["value"], &written["before"]), (&"hex:f7ff".into(), &"hex:feff".into()));
    assert_eq!(object_of(&mut bench, 0x2100, 0), -9);
}

#[test]
fn objects_are_read_and_written_by_the_types_of_the_dictionary() {
    let mut bench = Bench::canopen("", |_| {});
    let velocity = bench.object("read turntable 6081h");
    assert_eq!((&velocity["name"], &velocity["type"]), (&"Profile velocity".into(), &"u32".into()));
    let before = object_of(&mut bench, 0x6081, 0);
    assert_eq!(velocity["value"], before.to_string());
    let written = bench.object("write turntable 0x6081.0 12345");
    assert_eq!((&written["before"], &written["value"]), (&before.to_string().into(), &"12345".into()));
    assert_eq!(written["data"], "39300000");
    assert_eq!(object_of(&mut bench, 0x6081, 0), 12_345);
    for (line, reply) in [
        (
            "read turntable 2ABCh",
            "error read turntable absent: 2ABC:00: the drive refuses it with 0x06020000: object does not exist\n",
        ),
        (
            "write turntable 6081h -1",
            "error write turntable value: `-1` is not a number from 0 to 4294967295\n",
        ),
        (
            "write turntable 6041h 0",
            "error write turntable read-only: 6041:00: the drive refuses it with 0x06010002: attempt to write a read-only object\n",
        ),
        (
            "write turntable 6040h 15",
            "error write turntable gateway: 6040:00 is not written: the gateway commands the drive with it\n",
        ),
        (
            "write turntable 1A00h.1 0",
            "error write turntable gateway: 1A00:01 is not written: the gateway sets it for its communication with the drive\n",
        ),
    ] {
        assert_eq!(bench.say(line), reply, "{line}");
    }
    let name = bench.object("read turntable 1008h");
    assert_eq!(name["type"], "visible_string");
    assert!(name["value"].as_str().is_some_and(|name| name.starts_with("Axisbridge")), "{name}");
}

#[test]
fn nothing_is_written_while_somebody_controls_the_axis_and_everything_is_read() {
    let mut bench = Bench::sercos(with_gain);
    let gain: Idn = GAIN.parse().expect("an IDN");
    bench.enable();
    let reply = bench.say("write turntable P-0-4000 1");
    assert_eq!(reply, "error write turntable held: P-0-4000: a client of local control has this axis\n");
    assert_eq!(bench.object("read turntable P-0-4000")["value"], "-1.25");
    // The other axis is another drive.
    assert_eq!(bench.object("write slide S-0-0104 2.5")["value"], "2.50");
    bench.rig.connect(vec![Move::Dwell { seconds: 1_000.0 }]);
    bench.rig.run_until(millis(60_000), "a controller", |rig| rig.engine.axes()[0].has_controller());
    bench.rig.run_for(millis(100));
    let reply = bench.say("write turntable P-0-4000 1");
    assert_eq!(
        reply,
        "error write turntable controller: P-0-4000: a controller is connected to the device of this axis\n"
    );
    assert_eq!(bench.object("read turntable P-0-4000")["value"], "-1.25");
    assert_eq!(held(&bench, gain), -125);
    bench.rig.cable = false;
    let reply = bench.say("read turntable P-0-4000");
    assert!(reply.starts_with("error read turntable unanswered: P-0-4000: "), "{reply}");
}

/// A controller that vanished has left the axis to nobody, and its drive holds the axis in its place.
#[test]
fn nothing_is_written_while_a_drive_holds_an_axis_with_torque_that_nobody_controls() {
    let configuration =
        BOX.replace("instance = ", "on_command_loss = \"current-decel-and-hold\"\ninstance = ");
    let settings = Settings { configuration: configuration.clone(), ..Settings::default() };
    let mut bench = Bench::new(Rig::new(settings), &configuration);
    let gain = "S-0-0104";
    let before = bench.object(&format!("read turntable {gain}"))["value"].clone();
    bench.rig.connect(vec![Move::Enable(AxisSet::one(1)), Move::Dwell { seconds: 1_000.0 }]);
    bench.rig.run_until(millis(60_000), "torque", |rig| rig.engine.axes()[0].may_have_torque());
    bench.rig.run_for(millis(500));
    bench.rig.kill_controller();
    bench.rig.run_for(millis(3_000));
    let axis = &bench.rig.engine.axes()[0];
    assert_eq!((axis.has_controller(), axis.owner(), axis.may_have_torque()), (false, Owner::Nobody, true));
    let reply = bench.say(&format!("write turntable {gain} 2.5"));
    let expected =
        "error write turntable torque: S-0-0104: parameters are not written while the drive has torque\n";
    assert_eq!(reply, expected);
    assert_eq!(bench.object(&format!("read turntable {gain}"))["value"], before);
    assert_eq!(bench.object(&format!("write slide {gain} 2.5"))["value"], "2.50", "a drive without torque");
}

/// Both axes of a CANopen device have one drive: whoever controls one of them keeps the parameters of both.
#[test]
fn nothing_is_written_while_somebody_controls_the_other_axis_of_the_same_device() {
    let configuration = include_str!("can.toml").replace("node = 2", "node = 1\naxis = 1");
    let settings = Settings::without_line(configuration.clone());
    let mut bench = Bench::new(Rig::new(settings), &configuration);
    assert_eq!(bench.object("write slide 6881h 500")["value"], "500", "nobody controls either");
    bench.enable();
    for line in ["write slide 6881h 600", "write turntable 6081h 600"] {
        let reply = bench.say(line);
        assert!(reply.contains(" held: "), "{line}: {reply}");
    }
    assert_eq!(bench.object("read slide 6881h")["value"], "500");
}

#[test]
fn an_axis_whose_drive_was_rescaled_is_not_enabled_before_the_drive_was_commissioned_again() {
    let mut bench = Bench::canopen("", |_| {});
    let written = bench.object("write turntable 6091h.1 2");
    assert_eq!((&written["value"], &written["recommission"]), (&"2".into(), &true.into()));
    let inhibits = |bench: &Bench| bench.rig.engine.axes()[0].feedback().inhibits;
    bench.rig.run_for(millis(100));
    assert!(inhibits(&bench).contains(Inhibits::TRANSFER_ACTIVE));
    assert!(
        !bench.rig.engine.axes()[1].feedback().inhibits.contains(Inhibits::TRANSFER_ACTIVE),
        "another device"
    );
    bench
        .orders
        .requests
        .push(Request::Order { client: 2, id: 8, axis: 0, order: Order::Enable })
        .expect("room");
    for _ in 0..3_000 {
        bench.rig.run_for(millis(1));
        assert!(!bench.rig.engine.axes()[0].may_have_torque());
    }
    // The device is switched off and on: it is commissioned again, with the scaling that it has now.
    let now = bench.rig.clock().get();
    bench.rig.can[0].bus.nodes_mut().next().expect("a device").power_cycle(now);
    bench.rig.run_until(millis(20_000), "the drive", |rig| {
        !rig.engine.axes()[0].feedback().inhibits.contains(Inhibits::TRANSFER_ACTIVE)
            && rig.engine.axes()[0].south().is_some()
    });
}

#[test]
fn axis_whose_drive_refuses_another_scaling_stays_ready() {
    const FACTOR: Idn = Idn::VELOCITY_DATA_SCALING_FACTOR;
    let mut sercos = Bench::sercos(|rig| {
        let store = rig.line.slaves_mut()[0].store_mut();
        // Write protected in CP4.
        store.define(Definition::value(FACTOR, 0x4001_0001, "Velocity data scaling factor", 1));
    });
    let inhibits = |bench: &Bench| bench.rig.engine.axes()[0].feedback().inhibits;
    let reply = sercos.say("write turntable S-0-0077 5");
    let refused = "error write turntable refused: S-0-0077: the drive refuses the operation data with 0x7005: operation data is \
                   write protected at this time\n";
    assert_eq!(reply, refused);
    sercos.rig.run_for(millis(100));
    assert!(!inhibits(&sercos).contains(Inhibits::TRANSFER_ACTIVE));
    let mut canopen = Bench::canopen("", |_| {});
    for line in ["write turntable 6091h.9 2", "command turntable 1011:09 start"] {
        let reply = canopen.say(line);
        assert!(reply.starts_with("error ") && !reply.contains("commissioned again"), "{reply}");
        canopen.rig.run_for(millis(100));
        assert!(!inhibits(&canopen).contains(Inhibits::TRANSFER_ACTIVE), "{line}");
    }
    // A refusal does not undo what was changed before it.
    canopen.object("write turntable 6091h.1 2");
    let reply = canopen.say("command turntable 1011:09 start");
    assert!(reply.starts_with("error "), "{reply}");
    canopen.rig.run_for(millis(100));
    assert!(inhibits(&canopen).contains(Inhibits::TRANSFER_ACTIVE));
}

#[test]
fn lists_say_where_they_are_from() {
    let mut bench = Bench::sercos(with_gain);
    let list = bench.say("list turntable backup");
    let last = list.lines().last().unwrap_or_default();
    let count = list.lines().count() - 1;
    assert_eq!(last, format!("ok list turntable {count} bus=sercos source=S-0-0192"));
    assert!(list.contains("parameter S-0-0104 name=Position loop K"), "{list}");
    assert!(!list.contains("parameter S-0-0134"), "{list}");
    let all = bench.say("list turntable");
    assert!(
        all.contains("parameter S-0-0134 name=") && all.ends_with("bus=sercos source=S-0-0017\n"),
        "{all}"
    );
    let mut bench = Bench::canopen("", |_| {});
    let list = bench.say("list slide backup");
    assert!(
        list.contains("parameter 6081:00 access=rw type=u32 unit=velocity name=Profile velocity\n")
            || list.contains("parameter 6081:00 access=rw type=u32 name=Profile velocity\n"),
        "{list}"
    );
    assert!(list.ends_with(" bus=canopen source=dictionary\n") && !list.contains("6040:00"), "{list}");
}

/// Values of the drive of the turntable by their numbers, as hexadecimal bytes; and how many of the list it does not have.
fn backup(bench: &mut Bench) -> (BTreeMap<String, String>, usize) {
    let list = bench.say("list turntable backup");
    let (mut values, mut absent) = (BTreeMap::new(), 0);
    for line in list.lines().filter_map(|line| line.strip_prefix("parameter ")) {
        let id = line.split(' ').next().expect("a number");
        let reply = bench.say(&format!("read turntable {id} brief"));
        if reply.starts_with("error read turntable absent: ") {
            absent += 1;
            continue;
        }
        let object: serde_json::Value =
            serde_json::from_str(&reply[reply.find('{').unwrap_or_else(|| panic!("{reply}"))..])
                .expect("an object");
        values.insert(id.to_owned(), object["data"].as_str().expect("bytes").to_owned());
    }
    (values, absent)
}

/// A drive is backed up and lost. Another one in its place has other values; they are restored, seen in the drive, and the axis moves.
#[test]
fn a_devicenet_drive_is_backed_up_lost_replaced_restored_compared_and_moved() {
    let mut bench = Bench::devicenet(include_str!("devicenet.toml"));
    for (id, value) in [("66.1.441", "75.5"), ("0x42.1.461", "300"), ("66.1.1315", "2")] {
        let object = bench.object(&format!("write turntable {id} {value}"));
        assert_eq!(object["value"], value, "{object}");
    }
    let object = bench.object("read turntable 66.1.441");
    let told = ["name", "type", "unit", "access", "value"].map(|key| object[key].as_str().expect(key));
    assert_eq!(told, ["Kpp", "f32", "Radians/Sec", "Set", "75.5"], "{object}");
    assert_eq!(bench.object("read turntable 1.1.7")["value"], "simulated drive");
    let (kept, absent) = backup(&mut bench);
    assert_eq!((kept.len(), absent), (20, 238));
    assert_eq!(kept["66.1.441"], "00009742");
    // States, commands and data sets are not parameters.
    for id in ["66.1.40", "66.1.89", "66.1.90", "66.1.650"] {
        assert!(
            !kept.contains_key(id) && bench.say(&format!("read turntable {id} brief")).starts_with("ok"),
            "{id}"
        );
    }

    replace_devicenet_drive(&mut bench.rig);
    assert_eq!((real(&bench.rig, 441), real(&bench.rig, 461)), (50.0, 250.0), "as it comes from its maker");
    bench.rig.run_until(millis(20_000), "the new drive", |rig| rig.engine.axes()[0].south().is_some());
    let (found, _) = backup(&mut bench);
    let differ: Vec<_> = kept.iter().filter(|(id, data)| found[*id] != **data).collect();
    let ids: Vec<_> = differ.iter().map(|(id, _)| id.as_str()).collect();
    assert_eq!(ids, ["66.1.1315", "66.1.441", "66.1.461"]);
    for (id, data) in differ {
        let reply = bench.say(&format!("write turntable {id} hex:{data}"));
        assert!(reply.starts_with("ok write turntable "), "{reply}");
    }
    assert_eq!((real(&bench.rig, 441), real(&bench.rig, 461)), (75.5, 300.0), "{}", bench.rig.told());
    assert_eq!(backup(&mut bench).0, kept);
    let command = "write turntable 66.1.362 1";
    let refused =
        "error write turntable gateway: 66.1.362 is not written: the gateway commands the drive with it\n";
    assert_eq!(bench.say(command), refused);

    let start = turns(&bench.rig);
    let limits = Limits { velocity: 1.0, acceleration: 5.0, jerk: 50.0 };
    let turntable = AxisSet::one(1);
    bench.rig.connect(vec![
        Move::FaultReset(turntable),
        Move::Enable(turntable),
        Move::MoveRelative { axis: 1, distance: 0.5, limits },
        Move::Dwell { seconds: 0.5 },
        Move::Disable(turntable),
    ]);
    let report = bench.rig.run(millis(30_000));
    assert!(report.failure.is_none(), "{:?} {}", report.failure, bench.rig.told());
    let went = turns(&bench.rig) - start;
    assert!((went - 0.5).abs() < 0.002, "{went} {}", bench.rig.told());
    assert_eq!((real(&bench.rig, 441), real(&bench.rig, 461)), (75.5, 300.0), "after all that as well");
    // Its encoder is what it is.
    bench.rig.run_for(millis(500));
    let encoder = "write turntable 66.1.1416 4096";
    let refused = "error write turntable value: 66.1.1416: the drive refuses it with status 0x09: ";
    assert!(bench.say(encoder).starts_with(refused), "{}", bench.say(encoder));
}

/// The settings of the first drive, an AC/DC drive.
fn settings_of(rig: &Rig) -> SpeedSettings {
    let Some(DevicenetNode::Speed(slave)) = rig.devicenet[0].bus.nodes().next() else {
        panic!("a velocity drive")
    };
    *slave.application().settings()
}

/// The same of a drive of the AC/DC drive profile. It is slower to gain speed by what was restored.
#[test]
fn an_ac_drive_is_backed_up_lost_replaced_restored_compared_and_turned() {
    let mut bench = Bench::devicenet(&velocity_drive(21));
    let made = settings_of(&bench.rig);
    for (id, value) in [
        ("0x28.1.6", "48"),
        ("0x28.1.15", "1450"),
        ("42.1.18", "4000"),
        ("42.1.20", "60"),
        ("42.1.21", "1800"),
        ("42.1.24", "3"),
    ] {
        let object = bench.object(&format!("write turntable {id} {value}"));
        assert_eq!(object["value"], value, "{object}");
    }
    let object = bench.object("read turntable 42.1.18");
    let told = ["name", "type", "unit", "access", "value"].map(|key| object[key].as_str().expect(key));
    assert_eq!(told, ["AccelTime", "u16", "ms / 2^TimeScale", "Set", "4000"], "{object}");
    let (kept, absent) = backup(&mut bench);
    let ids: Vec<_> = kept.keys().map(String::as_str).collect();
    let expected = [
        "40.1.15", "40.1.3", "40.1.6", "40.1.7", "41.1.16", "42.1.18", "42.1.19", "42.1.20", "42.1.21",
        "42.1.22", "42.1.24", "42.1.6",
    ];
    assert_eq!((ids.as_slice(), absent), (expected.as_slice(), 16));
    // Commands and states are read and not kept, and nobody but the gateway commands.
    for id in ["41.1.3", "41.1.5", "41.1.6", "42.1.4", "42.1.7", "42.1.8"] {
        assert!(bench.say(&format!("read turntable {id} brief")).starts_with("ok"), "{id}");
    }
    for id in ["41.1.3", "41.1.12", "42.1.8"] {
        let refused = format!(
            "error write turntable gateway: {id} is not written: the gateway commands the drive with it\n"
        );
        assert_eq!(bench.say(&format!("write turntable {id} 1")), refused);
    }
    let before = settings_of(&bench.rig);

    replace_devicenet_drive_by(&mut bench.rig, &DevicenetKind::Speed { assembly: Assembly(21), scale: 0 });
    assert_eq!(settings_of(&bench.rig), made, "as it comes from its maker");
    bench.rig.run_until(millis(20_000), "the new drive", |rig| rig.engine.axes()[0].south().is_some());
    let (found, _) = backup(&mut bench);
    let differ: Vec<_> = kept.iter().filter(|(id, data)| found[*id] != **data).collect();
    let ids: Vec<_> = differ.iter().map(|(id, _)| id.as_str()).collect();
    assert_eq!(ids, ["40.1.15", "40.1.6", "42.1.18", "42.1.20", "42.1.21", "42.1.24"]);
    for (id, data) in differ {
        let reply = bench.say(&format!("write turntable {id} hex:{data}"));
        assert!(reply.starts_with("ok write turntable "), "{reply}");
    }
    assert_eq!(settings_of(&bench.rig), before, "{}", bench.rig.told());
    assert_eq!(backup(&mut bench).0, kept);
    // What the drive does not take is not kept.
    let refused = "error write turntable value: 42.1.19: the drive refuses it with status 0x09: ";
    assert!(bench.say("write turntable 42.1.19 0").starts_with(refused));

    // 1800 rpm in 4 s: 7.5 revolutions a second for each second.
    let turntable = AxisSet::one(1);
    connect(
        &mut bench.rig,
        vec![
            Move::FaultReset(turntable),
            Move::Enable(turntable),
            Move::RunAt { axis: 1, velocity: 15.0, acceleration: 1_000.0, jerk: 100_000.0 },
            Move::Dwell { seconds: 4.0 },
            Move::Disable(turntable),
        ],
    );
    let speed = |rig: &Rig| rig.devicenet[0].bus.nodes().next().expect("a drive").actual().velocity.get();
    bench.rig.run_until(millis(20_000), "a revolution a second", |rig| speed(rig) > 1_000_000_000);
    bench.rig.run_for(millis(1_000));
    let gained = f64_from_i64(speed(&bench.rig)) / 1e9;
    assert!((gained - 8.5).abs() < 0.3, "{gained} {}", bench.rig.told());
    // While it turns nothing is written.
    let refused = bench.say("write turntable 42.1.18 500");
    assert!(refused.starts_with("error write turntable "), "{refused}");
    let report = bench.rig.run(millis(30_000));
    assert!(report.failure.is_none(), "{:?} {}", report.failure, bench.rig.told());
    assert_eq!(settings_of(&bench.rig), before, "after all that as well");
}

/// Turns of the motor of the first drive on DeviceNet.
fn turns(rig: &Rig) -> f64 {
    let drive = rig.devicenet[0].bus.nodes().next().expect("a drive");
    f64_from_i64(drive.actual().position.get()) / 1e9
}
