//! Who may change an axis by explicit message, through the whole chain.

use std::net::Ipv4Addr;

use axisbridge_tests::rig::explicit::Client;
use axisbridge_tests::rig::motion::millis;
use axisbridge_tests::rig::{CONTROLLER, Rig, Settings};
use profile_cip::controller::{AxisSet, Step};
use profile_cip::target::axis_state::AxisState;
use profile_cip::wire::motion::codes::AxisStateCode;

const GET: u8 = 0x0E;
const SET: u8 = 0x10;
const MULTIPLE_SERVICE_PACKET: u8 = 0x0A;
const MESSAGE_ROUTER: [u8; 4] = [0x20, 0x02, 0x24, 0x01];
const PRIVILEGE_VIOLATION: u8 = 0x0F;

/// Ramp Velocity - Positive, which may be set while the axis is Running.
const RAMP_VELOCITY: u16 = 374;
const AXIS_STATE: u16 = 650;

fn set(client: Client, rig: &mut Rig, value: f32) -> u8 {
    client.ask(rig, SET, 1, Some(RAMP_VELOCITY), &value.to_le_bytes()).0
}

fn value(client: Client, rig: &mut Rig) -> f32 {
    let (status, data) = client.ask(rig, GET, 1, Some(RAMP_VELOCITY), &[]);
    assert_eq!(status, 0);
    f32::from_le_bytes(data.try_into().expect("a REAL"))
}

/// A Get of the axis state and a Set of the ramp in one packet; returns the statuses of both.
fn both_in_one(client: Client, rig: &mut Rig) -> [u8; 2] {
    let attribute = |service: u8, id: u16, data: &[u8]| {
        let [low, high] = id.to_le_bytes();
        [&[service, 4, 0x20, 0x42, 0x24, 1, 0x31, 0, low, high], data].concat()
    };
    let first = attribute(GET, AXIS_STATE, &[]);
    let second = attribute(SET, RAMP_VELOCITY, &9.0_f32.to_le_bytes());
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
