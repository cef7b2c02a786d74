//! Identity, Message Router and Connection Manager, attribute by attribute.

use std::sync::Arc;

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::device::config::AdapterConfig;
use crate::device::event::{Event, ResetKind};
use crate::device::explicit::adapter::DEVICE_TIMEOUT;
use crate::device::motion_link::MotionReply;
use crate::device::objects::identity::{Health, ModuleState};
use crate::wire::status::Service;

#[test]
fn identity_attributes() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let attributes: [&[u8]; 9] = [
        &[0x34, 0x12],
        &[0x25, 0],
        &[7, 0],
        &[2, 3],
        &[0x30, 0],
        &[0xEF, 0xBE, 0xAD, 0xDE],
        b"\x0AAxisbridge",
        &[3],
        // The CRC of the settings.
        &[0xB1, 0xFB],
    ];
    for (number, value) in (1..).zip(attributes) {
        let answer = rig.get(client, PATH_IDENTITY, number);
        assert_eq!((answer.status, answer.data.as_slice()), (0, value), "attribute {number}");
    }
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, PATH_IDENTITY, &[]));
    assert_eq!((all.service, all.status, all.data), (1, 0, attributes.concat()));
    let class_all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, &[0x20, 1], &[]));
    assert_eq!((class_all.status, class_all.data), (0, vec![1, 0, 1, 0, 7, 0, 9, 0]));
    assert_eq!(rig.get(client, PATH_IDENTITY, 10).outcome(), (0x14, 0));
    assert_eq!(rig.get(client, &[0x20, 1, 0x24, 2], 1).outcome(), (0x05, 0));
    assert_eq!(rig.get(client, &[0x20, 0x99, 0x24, 1], 1).outcome(), (0x05, 0));
    let bare = rig.ask(client, &message(Service::GET_ATTRIBUTE_SINGLE, PATH_IDENTITY, &[]));
    assert_eq!(bare.outcome(), (0x04, 0), "an attribute must be named");
    let set = message(Service::SET_ATTRIBUTE_SINGLE, &[0x20, 1, 0x24, 1, 0x30, 1], &[1, 0]);
    assert_eq!(rig.ask(client, &set).outcome(), (0x0E, 0));
    let unknown = message(Service(0x4B), PATH_IDENTITY, &[]);
    assert_eq!(rig.ask(client, &unknown).outcome(), (0x08, 0));
}

#[test]
fn identity_list_says_what_it_lacks_and_gives_the_rest() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let request = message(Service::GET_ATTRIBUTE_LIST, PATH_IDENTITY, &[3, 0, 1, 0, 99, 0, 4, 0]);
    let answer = rig.ask(client, &request);
    assert_eq!(answer.outcome(), (0x0A, 0));
    assert_eq!(answer.data, [3, 0, 1, 0, 0, 0, 0x34, 0x12, 99, 0, 0x14, 0, 4, 0, 0, 0, 2, 3]);
    let class = message(Service::GET_ATTRIBUTE_LIST, &[0x20, 1, 0x24, 0], &[1, 0, 1, 0]);
    let answer = rig.ask(client, &class);
    assert_eq!((answer.status, answer.data), (0, vec![1, 0, 1, 0, 0, 0, 1, 0]));
}

#[test]
fn identity_status_follows_health_and_ownership() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let health = |state| Health { state, ..Health::default() };
    let open = rig.open_motion(client, 1);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x61, 0], "in run mode");
    rig.adapter.set_health(health(ModuleState::Standby));
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x71, 0], "in idle mode");
    assert_eq!(rig.get(client, PATH_IDENTITY, 8).data, [2]);
    rig.adapter.set_health(Health { minor_recoverable: true, configured: true, ..Health::default() });
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x65, 1]);
    rig.adapter.set_health(health(ModuleState::MajorRecoverableFault));
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x51, 4]);
    assert_eq!(rig.get(client, PATH_IDENTITY, 8).data, [4]);
    rig.adapter.set_health(Health::default());
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_100 });
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x20, 0], "an I/O connection is faulted");
    rig.open_motion(client, 2);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x61, 0]);
    rig.send_unconnected(client, &close_message(2));
    rig.device_closes();
    rig.received(client.slot);
    assert_eq!(rig.get(client, PATH_IDENTITY, 5).data, [0x30, 0], "none, and none was lost");
}

#[test]
fn the_consistency_value_changes_with_every_setting() {
    let consistency = |change: &dyn Fn(&mut AdapterConfig)| {
        let mut rig = Rig::with(change);
        let client = rig.client(1);
        rig.get(client, PATH_IDENTITY, 9).data
    };
    let values = [
        consistency(&|_| {}),
        consistency(&|config| config.identity.configuration = 1),
        consistency(&|config| config.qos.urgent = 54),
        consistency(&|config| config.qos.explicit = 26),
        consistency(&|config| config.interface.inactivity_timeout_s = 121),
    ];
    let mut distinct = values.to_vec();
    distinct.sort();
    distinct.dedup();
    assert_eq!(distinct.len(), values.len(), "{values:02x?}");
    assert_eq!(
        consistency(&|config| config.identity.serial_number = 5),
        values[0],
        "who it is does not count"
    );
}

#[test]
fn a_key_in_the_path_is_checked() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let ours = [&[0x34, 4, 0x34, 0x12, 0x25, 0, 7, 0, 2, 3][..], PATH_IDENTITY].concat();
    assert_eq!(rig.get(client, &ours, 1).outcome(), (0, 0));
    let other = [&[0x34, 4, 1, 0, 0, 0, 0, 0, 0, 0][..], PATH_IDENTITY].concat();
    assert_eq!(rig.get(client, &other, 1).outcome(), (0x25, 0));
}

#[test]
fn paths_that_name_no_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for path in [
        &[][..],
        &[0x24, 1],
        &[0x20, 1, 0x20, 1],
        &[0x20, 1, 0x24, 1, 0x24, 1],
        &[0x20, 1, 0x24, 1, 0x28, 1],
        &[0x20, 1, 0x24, 1, 0x2C, 1],
        &[1, 0, 0x20, 1, 0x24, 1],
        &[0x91, 2, b'a', b'b'],
        &[0x80, 1, 0, 0],
        &[0x22, 0, 1, 0, 1, 0, 0x24, 1],
    ] {
        let answer = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, path, &[]));
        assert_eq!(answer.outcome(), (0x04, 0), "{path:02x?}");
    }
    // Wider formats of the same numbers are the same object.
    let wide = [0x21, 0, 1, 0, 0x26, 0, 1, 0, 0, 0];
    assert_eq!(rig.get(client, &wide, 1).data, [0x34, 0x12]);
}

#[test]
fn reset_is_answered_and_told() {
    for (data, kind) in
        [(&[][..], ResetKind::PowerCycle), (&[0], ResetKind::PowerCycle), (&[1], ResetKind::FactoryDefaults)]
    {
        let mut rig = Rig::new();
        let client = rig.client(1);
        rig.send_unconnected(client, &message(Service::RESET, PATH_IDENTITY, data));
        assert_eq!(rig.events(), [], "not before the device has agreed");
        rig.device_prepares_reset(true);
        let (answer, _) = rig.unconnected_reply(client);
        assert_eq!((answer.service, answer.outcome(), answer.data.len()), (5, (0, 0), 0), "{data:?}");
        assert_eq!(rig.events(), [Event::Reset { kind, originator: peer(1) }]);
        // What was granted for axes at rest must not happen to axes that were enabled since.
        assert_eq!(rig.refused(client, &motion_open(1)).outcome(), (0x10, 0));
        let again = rig.ask(client, &message(Service::RESET, PATH_IDENTITY, &[]));
        assert_eq!(again.outcome(), (0x0B, 0));
        // The rest goes on until the restart.
        assert_eq!(rig.get(client, PATH_IDENTITY, 1).status, 0);
    }
}

#[test]
fn a_reset_of_no_kind_asks_nobody() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for (data, outcome) in [(&[2][..], 0x20), (&[255], 0x20), (&[0, 0], 0x15)] {
        let answer = rig.ask(client, &message(Service::RESET, PATH_IDENTITY, data));
        assert_eq!(answer.outcome(), (outcome, 0), "{data:?}");
    }
    assert_eq!(rig.adapter.poll_motion(), None);
    assert_eq!(rig.events(), []);
}

#[test]
fn a_reset_is_refused_while_a_controller_owns_the_axes_or_one_is_energized() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let reset = message(Service::RESET, PATH_IDENTITY, &[0]);
    let open = rig.open_motion(client, 1);
    rig.events();
    assert_eq!(rig.ask(client, &reset).outcome(), (0x10, 0), "owned");
    // The controller is gone, the axes are still coming to a stop.
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_100 });
    rig.events();
    rig.send_unconnected(client, &reset);
    rig.device_prepares_reset(false);
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0x10, 0));
    assert_eq!(rig.events(), []);
    // Nothing is left behind: the next owner may come, and a later reset is asked for anew.
    rig.open_motion(client, 2);
}

#[test]
fn nothing_is_opened_between_the_question_for_a_reset_and_its_answer() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    rig.send_unconnected(a, &message(Service::RESET, PATH_IDENTITY, &[0]));
    assert_eq!(rig.ask(b, &open_message(&motion_open(1))).outcome(), (0x10, 0));
    assert_eq!(
        rig.ask(b, &message(Service::RESET, PATH_IDENTITY, &[0])).outcome(),
        (0x10, 0),
        "one at a time"
    );
    // The one who asked does not wait for the answer; it counts all the same.
    rig.adapter.close(a.slot);
    rig.device_prepares_reset(true);
    assert!(matches!(rig.events().last(), Some(Event::Reset { .. })));
}

#[test]
fn a_reset_the_device_does_not_answer_is_given_up() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, &message(Service::RESET, PATH_IDENTITY, &[0]));
    let token = rig.motion_request().token();
    rig.pass(DEVICE_TIMEOUT);
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0x02, 0));
    let silent = Event::DeviceSilent { service: Service::RESET, waited_us: 3_000_000 };
    assert_eq!(rig.events(), [silent]);
    assert_eq!(silent.to_string(), "Reset: no answer of the motion device within 3000000 us");
    // Its late consent restarts nothing.
    rig.complete(&MotionReply::ResetPrepared { token, granted: true });
    assert_eq!(rig.events(), []);
    rig.open_motion(client, 1);
}

#[test]
fn message_router_object() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let classes = rig.get(client, PATH_ROUTER, 1);
    assert_eq!(classes.data, [8, 0, 1, 0, 2, 0, 6, 0, 0x42, 0, 0x43, 0, 0x48, 0, 0xF5, 0, 0xF6, 0]);
    assert_eq!(rig.get(client, PATH_ROUTER, 2).data, [33, 0]);
    rig.open_motion(client, 1);
    rig.open_explicit(client, 2);
    assert_eq!(rig.get(client, PATH_ROUTER, 3).data, [2, 0]);
    let mut rig = Rig::with(|config| config.eds = Arc::from(&b"[File]"[..]));
    let client = rig.client(1);
    let classes = rig.get(client, PATH_ROUTER, 1);
    assert_eq!(classes.data, [9, 0, 1, 0, 2, 0, 6, 0, 0x37, 0, 0x42, 0, 0x43, 0, 0x48, 0, 0xF5, 0, 0xF6, 0]);
}

#[test]
fn connection_manager_counts() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.open_explicit(client, 1);
    rig.refused(client, &explicit_open(1));
    rig.ask(client, &open_message(&explicit_open(2))[..20]);
    assert_eq!(rig.ask(client, &close_message(9)).outcome(), (1, 0x107));
    rig.pass(DurationNs::from_secs(17));
    let all = rig.ask(client, &message(Service::GET_ATTRIBUTES_ALL, PATH_MANAGER, &[]));
    // Requests, format, resource and other rejects of opens; requests, format and other rejects of closes;
    // time-outs.
    let counts = [3, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1, 0, 1, 0];
    // And of 33 connections none is open.
    assert_eq!(all.data, [&counts[..], &[33, 0, 0, 0, 0, 0, 0]].concat());
}

#[test]
fn connection_data_by_number_and_by_triad() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let get = |number: u16| message(Service::GET_CONNECTION_DATA, PATH_MANAGER, &number.to_le_bytes());
    let search = |serial: u8| {
        message(Service::SEARCH_CONNECTION_DATA, PATH_MANAGER, &[serial, 0, 1, 0, 0xFE, 0xCA, 0, 0])
    };
    for request in [get(0), get(1), get(33), get(0xFFFF), search(1)] {
        assert_eq!(rig.ask(client, &request).outcome(), (0x05, 0), "none is open");
    }
    rig.send_unconnected(client, &open_message(&motion_open(1)));
    let other = rig.client(2);
    assert_eq!(rig.ask(other, &get(0)).data[..4], [0, 0, 1, 0], "configuring");
    let open = rig.device_opens();
    rig.received(client.slot);
    let data = rig.ask(client, &get(0)).data;
    let (o_to_t, t_to_o) = (open.o_to_t_id.to_le_bytes(), open.t_to_o_id.to_le_bytes());
    // Number 0, established, ports 50000 and 2222, triad, IDs, multiplier code 2, 2000 us.
    let head = [0, 0, 3, 0, 0x50, 0xC3, 0xAE, 8, 1, 0, 1, 0, 0xFE, 0xCA, 0, 0];
    let tail = [2, 0, 0, 0, 0xD0, 7, 0, 0, 0xD0, 7, 0, 0];
    let expected = [&head[..], &o_to_t, &o_to_t, &tail, &t_to_o, &t_to_o, &tail].concat();
    assert_eq!(data, expected);
    assert_eq!(rig.ask(client, &search(1)).data, expected);
    rig.open_explicit(client, 2);
    rig.open_explicit(client, 3);
    assert_eq!(rig.get(client, PATH_MANAGER, 9).data, [33, 0, 0b0000_0111, 0, 0, 0, 0]);
    assert_eq!(rig.ask(client, &close_message(2)).status, 0);
    // Numbers stay with their connections, and a free one is given again.
    assert_eq!(rig.get(client, PATH_MANAGER, 9).data, [33, 0, 0b0000_0101, 0, 0, 0, 0]);
    let third = rig.ask(client, &get(2)).data;
    assert_eq!((&third[..10], third.len()), (&[2, 0, 3, 0, 0x50, 0xC3, 0x12, 0xAF, 3, 0][..], 56));
    assert_eq!(third[24..36], [2, 0, 0, 0, 0x40, 0x42, 0x0F, 0, 0x40, 0x42, 0x0F, 0], "multiplier code, 1 s");
    assert_eq!(rig.ask(client, &search(2)).outcome(), (0x05, 0));
    rig.open_explicit(client, 4);
    assert_eq!(rig.ask(client, &search(4)).data[..4], [1, 0, 3, 0]);
    rig.send_unconnected(client, &close_message(1));
    assert_eq!(rig.ask(other, &get(0)).data[..4], [0, 0, 6, 0], "closing");
    rig.device_closes();
}
