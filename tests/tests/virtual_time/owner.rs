//! Who may change an axis by explicit message, through the whole chain.

use std::collections::BTreeMap;
use std::net::Ipv4Addr;

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::controller::{AxisSet, Step};
use profile_cip::device::axis_state::AxisState;
use profile_cip::device::object_list::OBJECT_CLASSES;
use profile_cip::wire::motion::codes::AxisStateCode;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const MULTIPLE_SERVICE_PACKET: u8 = 0x0A;
const MESSAGE_ROUTER: [u8; 4] = [0x20, 0x02, 0x24, 0x01];
const PRIVILEGE_VIOLATION: u8 = 0x0F;

/// Position Lock Tolerance, which may be set while the axis is Running. Thousands of counts are whole counts of the drive.
const LOCK_TOLERANCE: u16 = 443;
const AXIS_STATE: u16 = 650;

fn set(client: Client, rig: &mut Rig, value: f32) -> u8 {
    client.ask(rig, SET, 1, Some(LOCK_TOLERANCE), &(value * 1_000.0).to_le_bytes()).0
}

fn value(client: Client, rig: &mut Rig) -> f32 {
    let (status, data) = client.ask(rig, GET, 1, Some(LOCK_TOLERANCE), &[]);
    assert_eq!(status, 0);
    f32::from_le_bytes(data.try_into().expect("a REAL")) / 1_000.0
}

/// A Get of the axis state and a Set of the tolerance in one packet; returns the statuses of both.
fn both_in_one(client: Client, rig: &mut Rig) -> [u8; 2] {
    let attribute = |service: u8, id: u16, data: &[u8]| {
        let [low, high] = id.to_le_bytes();
        [&[service, 4, 0x20, 0x42, 0x24, 1, 0x31, 0, low, high], data].concat()
    };
    let first = attribute(GET, AXIS_STATE, &[]);
    let second = attribute(SET, LOCK_TOLERANCE, &9_000.0_f32.to_le_bytes());
    let at = 6 + u8::try_from(first.len()).expect("short");
    let data = [&[2, 0, 6, 0, at, 0], &first[..], &second[..]].concat();
    let (_, reply) = client.request(rig, MULTIPLE_SERVICE_PACKET, &MESSAGE_ROUTER, &data);
    let status = |number: usize| {
        let offset = usize::from(u16::from_le_bytes([reply[2 + 2 * number], reply[3 + 2 * number]]));
        reply[offset + 2]
    };
    [status(0), status(1)]
}

#[test]
fn while_a_controller_has_the_axes_no_other_client_changes_them() {
    let mut rig = Rig::ready(Settings::default());
    let other = Client::connect(&mut rig, Ipv4Addr::new(10, 0, 0, 66));
    assert_eq!(set(other, &mut rig, 1.0), 0, "nobody's axes");
    assert_eq!(both_in_one(other, &mut rig), [0, 0]);

    rig.connect(vec![Step::Enable(AxisSet::one(1)), Step::Dwell { seconds: 100.0 }]);
    rig.run_until(millis(10_000), "the enable", |rig| rig.report().steps_finished == 1);
    let before = value(other, &mut rig);
    assert_eq!(set(other, &mut rig, 2.0), PRIVILEGE_VIOLATION);
    assert_eq!(both_in_one(other, &mut rig), [0, PRIVILEGE_VIOLATION]);
    let state = other.ask(&mut rig, GET, 1, Some(AXIS_STATE), &[]);
    assert_eq!(state, (0, vec![AxisStateCode::RUNNING.0]), "reading is free");
    assert!((value(other, &mut rig) - before).abs() < f32::EPSILON, "nothing was set");
    // Another session of the owner's address is the owner.
    let owner = Client::connect(&mut rig, CONTROLLER);
    assert_eq!(set(owner, &mut rig, 3.0), 0);
    assert!((value(other, &mut rig) - 3.0).abs() < f32::EPSILON);
    assert_eq!(rig.report().failure, None, "{}", rig.log());

    rig.kill_controller();
    rig.run_for(millis(2_000));
    assert_eq!(rig.axis_states(0).last(), Some(&AxisState::MajorFaulted));
    assert_eq!(set(other, &mut rig, 4.0), 0, "nobody's axes again");
}

/// Answers of one request: while nobody owns the device, of the owner, and of a stranger while it is owned.
type Answers = [u8; 3];

const STRANGER: Ipv4Addr = Ipv4Addr::new(10, 0, 0, 66);
const NOT_SETTABLE: u8 = 0x0E;
const SERVICE_NOT_SUPPORTED: u8 = 0x08;
const NOT_SUPPORTED: u8 = 0x14;
/// Highest attribute number that is tried, beyond that of every object.
const ATTRIBUTE_MAX: u16 = 1_050;

/// A box that nobody owns, and one whose controller has both axes enabled; a client of the owner's address and a stranger.
struct Boxes {
    free: (Rig, Client),
    owned: Rig,
    owner: Client,
    stranger: Client,
}

impl Boxes {
    fn new() -> Self {
        let mut free = Rig::ready(Settings::default());
        let anybody = Client::connect(&mut free, STRANGER);
        let mut owned = Rig::ready(Settings::default());
        owned.connect(vec![Step::Enable(AxisSet::first(2)), Step::Dwell { seconds: 100_000.0 }]);
        owned.run_until(millis(10_000), "the enable", |rig| rig.report().steps_finished == 1);
        let owner = Client::connect(&mut owned, CONTROLLER);
        let stranger = Client::connect(&mut owned, STRANGER);
        Self { free: (free, anybody), owned, owner, stranger }
    }

    /// The stranger asks before the owner: what it changed the owner's answer would show.
    fn ask(&mut self, service: u8, path: &[u8], data: &[u8]) -> Answers {
        let nobody = self.free.1.request(&mut self.free.0, service, path, data).0;
        let foreign = self.stranger.request(&mut self.owned, service, path, data).0;
        let own = self.owner.request(&mut self.owned, service, path, data).0;
        [nobody, own, foreign]
    }
}

/// Path to an instance of a class, and to an attribute of it.
fn path_of(class: u16, instance: u16, attribute: Option<u16>) -> Vec<u8> {
    let [low, high] = instance.to_le_bytes();
    let mut path = vec![0x20, class.to_le_bytes()[0], 0x25, 0, low, high];
    if let Some(attribute) = attribute {
        path.extend([0x31, 0]);
        path.extend(attribute.to_le_bytes());
    }
    path
}

/// Numbers in a few words: `3, 5-9`; of services in hexadecimal.
fn ranges(numbers: &[u16], hexadecimal: bool) -> String {
    let number = |number: u16| if hexadecimal { format!("{number:02X}") } else { number.to_string() };
    let mut text = String::new();
    let mut rest = numbers.iter().copied().peekable();
    while let Some(first) = rest.next() {
        let mut last = first;
        while rest.next_if(|next| *next == last + 1).is_some() {
            last += 1;
        }
        let comma = if text.is_empty() { "" } else { ", " };
        let to = if last > first { format!("-{}", number(last)) } else { String::new() };
        text.push_str(&format!("{comma}{}{to}", number(first)));
    }
    text
}

/// Every attribute that can be set, each with its own value, and every service that may change something, of every object.
#[test]
fn every_change_of_every_object_for_nobody_the_owner_and_a_stranger() {
    let mut boxes = Boxes::new();
    let mut table = String::from("nobody owner stranger\n");
    let mut rows = |what: String, hexadecimal: bool, answers: BTreeMap<Answers, Vec<u16>>| {
        for ([nobody, own, foreign], numbers) in answers {
            assert_eq!(foreign, PRIVILEGE_VIOLATION, "{what} {numbers:?}");
            let line =
                format!("{nobody:02X} {own:02X} {foreign:02X}  {what}: {}\n", ranges(&numbers, hexadecimal));
            table.push_str(&line);
        }
    };
    for class in OBJECT_CLASSES {
        let instances = class.instance.map_or(vec![0, 1, 2], |instance| vec![0, instance]);
        for instance in instances {
            let mut settable: BTreeMap<Answers, Vec<u16>> = BTreeMap::new();
            for attribute in 1..=ATTRIBUTE_MAX {
                let path = path_of(class.class, instance, Some(attribute));
                let (rig, anybody) = &mut boxes.free;
                let (status, value) = anybody.request(rig, GET, &path, &[]);
                // What cannot be read may still be set; four zeros are the value of many types.
                let value = if status == 0 { value } else { vec![0; 4] };
                let status = anybody.request(rig, SET, &path, &value).0;
                if [NOT_SUPPORTED, NOT_SETTABLE, SERVICE_NOT_SUPPORTED].contains(&status) {
                    continue;
                }
                settable.entry(boxes.ask(SET, &path, &value)).or_default().push(attribute);
            }
            rows(format!("{:#04x}/{instance} {}, set attributes", class.class, class.name), false, settable);
            let mut services: BTreeMap<Answers, Vec<u16>> = BTreeMap::new();
            let reads = |service: u8| match (class.class, service) {
                (_, 0x01 | 0x03 | 0x0E) => true,
                // Forward_Open, Forward_Close and data of connections are for all, below. 0x52 is a request on its way.
                (0x06, 0x4E | 0x52 | 0x54 | 0x56 | 0x57 | 0x5B) => true,
                // The upload of the data sheet.
                (0x37, 0x4B | 0x4F) => true,
                // Get_Axis_Attributes_List and the data of tests.
                (0x42, 0x4B | 0x50 | 0x52 | 0x54) => true,
                // Parts of a Multiple_Service_Packet are judged one by one.
                (_, MULTIPLE_SERVICE_PACKET) => true,
                _ => false,
            };
            for service in (0..0x80).filter(|service| !reads(*service)) {
                // Reset of the device comes last.
                if (class.class, instance, service) != (1, 1, 0x05) {
                    let answers = boxes.ask(service, &path_of(class.class, instance, None), &[]);
                    services.entry(answers).or_default().push(u16::from(service));
                }
            }
            rows(format!("{:#04x}/{instance} {}, services", class.class, class.name), true, services);
        }
    }
    let reset = boxes.ask(0x05, &path_of(1, 1, None), &[0]);
    rows("0x01/1 Identity Object, reset of the device".to_owned(), true, BTreeMap::from([(reset, vec![5])]));
    assert_eq!(boxes.owned.report().failure, None, "{}", boxes.owned.log());
    for axis in 0..2 {
        assert_eq!(boxes.owned.axis_states(axis).last(), Some(&AxisState::Running), "{}", boxes.owned.told());
    }
    insta::assert_snapshot!(table);
}
