//! The slave to the byte: frames of manuals, every service, everything it refuses.

use core::fmt::Write as _;

use super::bench::Bench;
use super::rig::{mac, ms, slave_config, speed_drive};
use crate::device::event::ResetKind;
use crate::devicenet::access::AccessState;
use crate::devicenet::connection::{ConnectionKind, ConnectionState};
use crate::devicenet::slave::SlaveConfig;
use crate::devicenet::slave::event::SlaveEvent;
use crate::devicenet::wire::BodyFormat;

const UNCONNECTED: u16 = 0x44E;
const REQUEST: u16 = 0x44C;
const RESPONSE: u16 = 0x44B;
const POLL: u16 = 0x44D;
const POLL_RESPONSE: u16 = 0x3C9;
const DUPLICATE: u16 = 0x44F;

/// ICP DAS CAN-8x24, 7.2.2, with slave 9 and master 10: what the manual shows going either way.
#[test]
fn the_frames_of_a_manual() {
    let config = SlaveConfig { rate_resolution_ms: 10, ..slave_config(9) };
    let mut bench = Bench::with(config, speed_drive(21));
    assert_eq!(bench.send(UNCONNECTED, &[0x0A, 0x4B, 3, 1, 3, 0x0A]), [(RESPONSE, vec![0x0A, 0xCB, 0])]);
    let rate = bench.send(REQUEST, &[0x0A, 0x10, 5, 2, 9, 0x0A, 0x0E]);
    assert_eq!(rate, [(RESPONSE, vec![0x0A, 0x90, 0x10, 0x0E])], "rounded up to 10 ms");
    let poll = bench.send(POLL, &[0x60, 0, 0, 0]);
    assert_eq!(poll, [(POLL_RESPONSE, vec![0x70, 3, 0, 0])], "ready, control and reference from the network");
    assert_eq!(
        bench.send(REQUEST, &[0x4A, 0x0E, 5, 2, 1]),
        [(RESPONSE, vec![0x4A, 0x8E, 3])],
        "XID comes back"
    );
    assert_eq!(bench.send(UNCONNECTED, &[0x0A, 0x4C, 3, 1, 3]), [(RESPONSE, vec![0x0A, 0xCC])]);
    assert_eq!(
        bench.refused(POLL, &[0x60, 0, 0, 0]),
        "poll command, MAC ID 9: there is no such connection now"
    );
}

#[test]
fn two_requests_before_going_on_line_and_nothing_is_answered_meanwhile() {
    let mut bench = Bench::new();
    bench.slave.start(bench.now);
    let check = vec![0, 0x23, 0x01, 9, 0, 0, 0xA0];
    assert_eq!(bench.wait(500), [(DUPLICATE, check.clone())]);
    assert_eq!(bench.refused(UNCONNECTED, &[0x0A, 0x4B, 3, 1, 3, 0x0A]), "the node is not on line");
    assert_eq!(bench.wait(1000), [(DUPLICATE, check)]);
    assert_eq!(bench.slave.access(), AccessState::Checking(2));
    assert_eq!(bench.wait(1000), []);
    assert_eq!(bench.events(), [SlaveEvent::Online]);
}

#[test]
fn a_duplicate_mac_id_takes_the_slave_off_the_network() {
    let mut bench = Bench::established();
    let other = [0, 0x99, 0, 1, 2, 3, 4];
    let answer = vec![0x80, 0x23, 0x01, 9, 0, 0, 0xA0];
    assert_eq!(bench.send(DUPLICATE, &other), [(DUPLICATE, answer)], "it defends its MAC ID");
    bench.events();
    let text = bench.refused(DUPLICATE, &[0x80, 0x99, 0, 1, 2, 3, 4]);
    assert_eq!(text, "duplicate MAC ID 9: vendor 0x0099, serial 0x04030201");
    let events = bench.events();
    assert!(events.contains(&SlaveEvent::DuplicateMac { mac: mac(9), vendor: 0x99, serial: 0x0403_0201 }));
    assert_eq!(bench.slave.connection(ConnectionKind::Poll).state(), ConnectionState::NON_EXISTENT);
    assert_eq!(bench.wait(20_000), [], "silent until it is reset");
    bench.slave.start(bench.now);
    assert_eq!(bench.wait(2100).len(), 2);
    assert_eq!(bench.slave.access(), AccessState::Online);
    let text = bench.refused(DUPLICATE, &[0; 6]);
    assert!(text.starts_with("duplicate MAC ID check, MAC ID 9: duplicate MAC ID check message"), "{text}");
}

#[test]
fn who_may_allocate_and_release() {
    let mut bench = Bench::allocated();
    let other = bench.send(UNCONNECTED, &[0x0B, 0x4B, 3, 1, 3, 0x0B]);
    assert_eq!(other, [(RESPONSE, vec![0x0B, 0x94, 0x0C, 0x01])], "another master");
    let release = bench.send(UNCONNECTED, &[0x0B, 0x4C, 3, 1, 3]);
    assert_eq!(release, [(RESPONSE, vec![0x0B, 0x94, 0x0C, 0x01])]);
    let again = bench.send(UNCONNECTED, &[0x0A, 0x4B, 3, 1, 3, 0x0A]);
    assert_eq!(again, [(RESPONSE, vec![0x0A, 0x94, 0x0B, 0x02])], "already");
    let service = bench.send(UNCONNECTED, &[0x0A, 0x0E, 1, 1, 1]);
    assert_eq!(service, [(RESPONSE, vec![0x0A, 0x94, 0x08, 0x03])], "not on the unconnected port");
    let class = bench.send(UNCONNECTED, &[0x0A, 0x4B, 4, 1, 3, 0x0A]);
    assert_eq!(class, [(RESPONSE, vec![0x0A, 0x94, 0x08, 0x03])]);
    assert_eq!(bench.explicit(&[0x0E, 3, 1, 5]), [0x8E, 3, 10], "allocation information");
    assert_eq!(bench.explicit(&[0x4C, 3, 1, 2]), [0xCC], "and over the explicit connection");
    assert_eq!(bench.explicit(&[0x0E, 3, 1, 5]), [0x8E, 1, 10]);
    assert_eq!(bench.explicit(&[0x4B, 3, 1, 2, 10]), [0xCB, 0]);
    assert_eq!(bench.explicit(&[0x4B, 3, 1, 4, 10]), [0x94, 2, 2], "it has no bit strobe");
    let shorter = bench.refused(UNCONNECTED, &[0x0A, 0x4B, 3]);
    assert!(shorter.ends_with("explicit request at byte 2: expected 1 bytes, found 0"), "{shorter}");
    let fragment = bench.refused(UNCONNECTED, &[0x8A, 0, 0x4B, 3, 1, 3, 0x0A]);
    assert!(fragment.contains("fragmentation of an unconnected request"), "{fragment}");
    assert!(bench.refused(UNCONNECTED, &[]).contains("expected 1 bytes, found 0"));
}

#[test]
fn a_slave_whose_connections_are_dead_is_free_for_another_master() {
    let mut bench = Bench::established();
    bench.send(POLL, &[0x60, 0, 0, 0]);
    bench.wait(200);
    assert_eq!(bench.slave.connection(ConnectionKind::Poll).state(), ConnectionState::TIMED_OUT);
    assert_eq!(bench.slave.master(), Some(mac(10)), "the explicit connection lives");
    bench.wait(10_000);
    let events: Vec<_> = bench.events().iter().map(ToString::to_string).collect();
    assert_eq!(events.last().map(String::as_str), Some("free for any master"), "{events:#?}");
    let other = bench.send(UNCONNECTED, &[0x0B, 0x4B, 3, 1, 3, 0x0B]);
    assert_eq!(other, [(RESPONSE, vec![0x0B, 0xCB, 0])]);
}

#[test]
fn a_watchdog_that_would_be_off_is_refused() {
    let mut bench = Bench::allocated();
    assert_eq!(bench.explicit(&[0x10, 5, 2, 9, 0, 0]), [0x94, 9, 0xFF]);
    assert_eq!(bench.explicit(&[0x0D, 5, 2]), [0x94, 0x0C, 0xFF], "Apply_Attributes before there is a rate");
    assert_eq!(bench.explicit(&[0x0E, 5, 2, 1]), [0x8E, 1], "configuring");
    assert_eq!(bench.explicit(&[0x10, 5, 2, 12, 2]), [0x94, 9, 0xFF], "auto reset would never end");
    assert_eq!(
        bench.explicit(&[0x10, 5, 1, 9, 0, 0]),
        [0x90, 0, 0],
        "the explicit connection may be without"
    );
}

#[test]
fn services_of_the_connection_object() {
    let mut bench = Bench::established();
    assert_eq!(bench.explicit(&[0x0E, 5, 0, 1]), [0x8E, 1, 0]);
    assert_eq!(bench.explicit(&[0x0E, 5, 0, 2]), [0x94, 0x14, 0xFF]);
    assert_eq!(bench.explicit(&[0x08, 5, 0]), [0x94, 0x08, 0xFF], "Create");
    assert_eq!(bench.explicit(&[0x0E, 5, 3, 1]), [0x94, 0x16, 0xFF], "bit strobe is not there");
    assert_eq!(bench.explicit(&[0x0E, 5, 9, 1]), [0x94, 0x16, 0xFF]);
    assert_eq!(bench.explicit(&[0x0E, 5, 2]), [0x94, 0x13, 0xFF]);
    assert_eq!(bench.explicit(&[0x0E, 5, 2, 1, 1]), [0x94, 0x15, 0xFF]);
    assert_eq!(bench.explicit(&[0x0E, 5, 2, 14]), [0x8E, 0x20, 4, 0x24, 71]);
    assert_eq!(bench.explicit(&[0x0E, 5, 2, 16]), [0x8E, 0x20, 4, 0x24, 21]);
    bench.send(POLL, &[0; 4]);
    bench.wait(200);
    assert_eq!(bench.explicit(&[0x0E, 5, 2, 1]), [0x8E, 4], "timed out");
    assert_eq!(bench.explicit(&[0x10, 5, 2, 9, 50, 0]), [0x94, 0x0C, 0xFF]);
    assert_eq!(bench.explicit(&[0x05, 5, 2, 0]), [0x94, 0x15, 0xFF]);
    assert_eq!(bench.explicit(&[0x05, 5, 2]), [0x85], "Reset");
    assert_eq!(bench.explicit(&[0x0E, 5, 2, 1]), [0x8E, 3]);
    assert_eq!(bench.explicit(&[0x09, 5, 2]), [0x89], "Delete");
    assert_eq!(bench.explicit(&[0x0E, 5, 2, 1]), [0x94, 0x16, 0xFF]);
}

/// Every attribute of every object.
#[test]
fn the_objects() {
    let mut bench = Bench::established();
    let mut text = String::new();
    let objects: [(u8, u8); 11] =
        [(1, 0), (1, 1), (2, 1), (3, 0), (3, 1), (4, 21), (4, 71), (4, 22), (0x28, 1), (0x29, 1), (0x2A, 1)];
    for (class, instance) in objects {
        writeln!(text, "class {class:02x} instance {instance}").unwrap();
        for attribute in 1..=30 {
            let mut sent = bench.send(REQUEST, &[0x0A, 0x0E, class, instance, attribute]);
            let (_, frame) = sent.pop().unwrap();
            let body = if frame[0] & 0x80 == 0 {
                frame[1..].to_vec()
            } else {
                // A response in fragments: ask again, with acknowledges.
                bench.explicit_long(&[0x0E, class, instance, attribute])
            };
            if body != [0x94, 0x14, 0xFF] {
                writeln!(text, "  {attribute:2} {body:02x?}").unwrap();
            }
        }
    }
    insta::assert_snapshot!(text);
    assert_eq!(bench.explicit(&[0x0E, 0x64, 1, 1]), [0x94, 0x16, 0xFF], "no such class");
    assert_eq!(bench.explicit(&[0x0E, 4, 5, 3]), [0x94, 0x16, 0xFF], "no such assembly");
    assert_eq!(bench.explicit(&[0x0E, 1, 2, 1]), [0x94, 0x16, 0xFF], "no such instance");
    assert_eq!(bench.explicit(&[0x33, 1, 1]), [0x94, 0x08, 0xFF], "no such service");
    assert_eq!(bench.explicit(&[0x0E, 1, 1]), [0x94, 0x13, 0xFF], "no attribute");
    assert_eq!(bench.explicit(&[0x10, 1, 1, 1, 0, 0]), [0x94, 0x0E, 0xFF]);
}

#[test]
fn what_can_be_set_and_what_not() {
    let mut bench = Bench::allocated();
    let mut set = |class: u8, attribute: u8, value: &[u8]| {
        let body = bench.explicit(&[&[0x10, class, 1, attribute][..], value].concat());
        if body[0] == 0x94 { body[1] } else { 0 }
    };
    let cases: [(u8, u8, &[u8], u8); 24] = [
        (3, 2, &[1], 0),
        (3, 2, &[3], 9),
        (3, 3, &[1], 0),
        (3, 3, &[2], 9),
        (3, 4, &[0], 0),
        (3, 5, &[0], 0x0E),
        (3, 1, &[64], 9),
        (3, 9, &[1], 0x14),
        (0x29, 3, &[1], 0x0E),
        (0x29, 4, &[1], 0x0E),
        (0x29, 5, &[0], 0),
        (0x29, 5, &[2], 9),
        (0x29, 16, &[0], 0),
        (0x29, 16, &[1], 9),
        (0x29, 12, &[1], 0),
        (0x29, 99, &[1], 0x14),
        (0x2A, 6, &[3], 0),
        (0x2A, 6, &[5], 9),
        (0x2A, 19, &[0, 0], 9),
        (0x2A, 21, &[0xFF, 0xFF], 9),
        (0x2A, 20, &[0xFF, 0x7F], 9),
        (0x2A, 22, &[8], 9),
        (0x2A, 7, &[0, 0], 0x0E),
        (0x2A, 18, &[1], 0x13),
    ];
    for (class, attribute, value, status) in cases {
        assert_eq!(
            set(class, attribute, value),
            status,
            "class {class:02x} attribute {attribute} = {value:02x?}"
        );
    }
    assert!(bench.events().contains(&SlaveEvent::RateChanged(1)));
}

#[test]
fn another_mac_id_counts_behind_the_answer_and_after_a_new_check() {
    let mut bench = Bench::allocated();
    assert_eq!(bench.explicit(&[0x10, 5, 2, 9, 50, 0]), [0x90, 50, 0]);
    assert_eq!(bench.explicit(&[0x10, 3, 1, 1, 20]), [0x94, 0x0C, 0xFF], "not while something hangs on it");
    assert_eq!(bench.explicit(&[0x4C, 3, 1, 2]), [0xCC]);
    let mut sent = bench.send(REQUEST, &[0x0A, 0x10, 3, 1, 1, 20]);
    sent.extend(bench.wait(2100));
    let check = (0x400 | 20 << 3 | 7, vec![0, 0x23, 0x01, 9, 0, 0, 0xA0]);
    assert_eq!(sent, [(RESPONSE, vec![0x0A, 0x90]), check.clone(), check]);
    let allocated = bench.send(0x400 | 20 << 3 | 6, &[0x0A, 0x4B, 3, 1, 1, 0x0A]);
    assert_eq!(allocated, [(0x400 | 20 << 3 | 3, vec![0x0A, 0xCB, 0])]);
}

#[test]
fn the_identity_object_resets_the_node_unless_the_drive_runs() {
    let mut bench = Bench::established();
    bench.send(POLL, &[0x60, 0, 0, 0]);
    bench.wait(5);
    bench.send(POLL, &[0x61, 0, 0, 1]);
    bench.wait(5);
    assert_eq!(bench.explicit(&[0x05, 1, 1]), [0x94, 0x10, 0xFF], "it runs");
    bench.send(POLL, &[]);
    bench.wait(20);
    assert_eq!(bench.explicit(&[0x05, 1, 1, 7]), [0x94, 0x20, 0xFF]);
    let mut sent = bench.send(REQUEST, &[0x0A, 0x05, 1, 1, 1]);
    assert!(bench.events().contains(&SlaveEvent::Reset(ResetKind::FactoryDefaults)));
    sent.extend(bench.wait(2100));
    assert_eq!(sent.len(), 3, "the answer, and the check anew: {sent:02x?}");
    assert_eq!(bench.slave.master(), None);
}

#[test]
fn poll_messages_of_a_wrong_length_command_nothing() {
    let mut bench = Bench::established();
    bench.send(POLL, &[0x60, 0, 0, 0]);
    for len in [1, 2, 3, 5, 8] {
        let text = bench.refused(POLL, &[0xFF; 8][..len]);
        let expected =
            if len > 4 { "more than 4 bytes".to_owned() } else { format!("expected 4 bytes, got {len}") };
        assert!(text.contains(&expected), "{text}");
    }
    bench.wait(190);
    assert_eq!(bench.slave.connection(ConnectionKind::Poll).state(), ConnectionState::ESTABLISHED);
    assert_eq!(bench.slave.application().state().to_string(), "ready");
    bench.wait(20);
    let state = bench.slave.connection(ConnectionKind::Poll).state();
    assert_eq!(state, ConnectionState::TIMED_OUT, "and do not keep the connection alive");
}

#[test]
fn explicit_messages_that_are_none() {
    let mut bench = Bench::allocated();
    assert!(bench.refused(REQUEST, &[]).contains("found 0"));
    assert!(bench.refused(REQUEST, &[0x0A]).contains("explicit request at byte 0"));
    assert!(bench.refused(REQUEST, &[0x0A, 0x0E, 1]).contains("explicit request at byte 2"));
    assert!(bench.refused(REQUEST, &[0x0A, 0x8E, 1, 1, 1]).contains("service of a request"), "a response");
    assert!(
        bench.refused(REQUEST, &[0x0B, 0x0E, 1, 1, 1]).contains("expected MAC ID 10"),
        "of somebody else"
    );
    assert!(bench.refused(REQUEST, &[0x8A]).contains("found 0"));
    assert!(bench.refused(REQUEST, &[0x8A, 0xC0]).contains("found 0"), "an acknowledge without status");
    assert!(bench.refused(REQUEST, &[0x8A, 0xC0, 0]).contains("acknowledge 0 of nothing"));
    let orphan = bench.refused(REQUEST, &[0x8A, 0x41, 1, 2, 3]);
    assert!(orphan.contains("fragment 1 of a message whose beginning is missing"), "{orphan}");
    assert_eq!(bench.send(REQUEST, &[0x8A, 0x00, 0x10, 5, 1, 9, 1, 2]), [(RESPONSE, vec![0x8A, 0xC0, 0])]);
    assert!(bench.refused(REQUEST, &[0x8A, 0x83, 1]).contains("expected fragment 1, got 3"));
    assert!(bench.refused(REQUEST, &[0x8A, 0x81, 1]).contains("beginning is missing"), "it was dropped");
    assert_eq!(bench.explicit(&[0x0E, 3, 1, 1]), [0x8E, 9], "and everything works");
}

#[test]
fn a_request_and_a_response_in_fragments() {
    let mut bench = Bench::allocated();
    // Get_Attribute_List of the Identity object: vendor, type, code, name.
    let body = [0x03, 1, 1, 4, 0, 1, 0, 2, 0, 3, 0, 7, 0];
    assert_eq!(bench.send(REQUEST, &[&[0x8A, 0x00], &body[..6]].concat()), [(RESPONSE, vec![0x8A, 0xC0, 0])]);
    assert_eq!(
        bench.send(REQUEST, &[&[0x8A, 0x41], &body[6..12]].concat()),
        [(RESPONSE, vec![0x8A, 0xC1, 0])]
    );
    let sent = bench.send(REQUEST, &[&[0x8A, 0x82], &body[12..]].concat());
    assert_eq!(sent[0], (RESPONSE, vec![0x8A, 0xC2, 0]));
    assert_eq!(sent[1], (RESPONSE, vec![0x8A, 0x00, 0x83, 4, 0, 1, 0, 0]));
    // The acknowledge stays away: the fragment comes once more, and then the response is given up.
    assert_eq!(bench.wait(999), []);
    assert_eq!(bench.wait(1), [sent[1].clone()]);
    assert_eq!(bench.wait(2000), []);
    assert!(bench.events().contains(&SlaveEvent::ResponseLost));
    let all = bench.explicit_long(&[0x0E, 1, 1, 7]);
    assert_eq!(all[..2], [0x8E, 16]);
    assert_eq!(&all[2..], b"Axisbridge drive");
}

#[test]
fn another_message_body_format() {
    let config = SlaveConfig { body_format: BodyFormat::CLASS_16_INSTANCE_16, ..slave_config(9) };
    let mut bench = Bench::with(config, speed_drive(21));
    let sent = bench.send(UNCONNECTED, &[0x0A, 0x4B, 3, 1, 1, 0x0A]);
    assert_eq!(sent, [(RESPONSE, vec![0x0A, 0xCB, 2])], "the answer says which");
    assert_eq!(bench.explicit(&[0x0E, 3, 0, 1, 0, 1]), [0x8E, 9]);
}

#[test]
fn bus_off_is_held_or_reset_as_the_attribute_says() {
    let mut bench = Bench::established();
    bench.slave.handle_bus_off(bench.now);
    assert_eq!((bench.slave.access(), bench.wait(5000)), (AccessState::Faulted, vec![]));
    let config = SlaveConfig { bus_off_reset: true, ..slave_config(9) };
    let mut bench = Bench::with(config, speed_drive(21));
    bench.slave.handle_bus_off(bench.now);
    assert_eq!(bench.wait(2100).len(), 2, "the check anew");
    assert_eq!(bench.slave.access(), AccessState::Online);
    assert_eq!(
        bench.slave.wake_at().map(|at| at <= bench.now + profile_generic::time::DurationNs::from_millis(1)),
        Some(true)
    );
    assert!(ms(0) < bench.now);
}
