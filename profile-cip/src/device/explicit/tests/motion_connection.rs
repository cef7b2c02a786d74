//! The motion connection: what is asked of the device, what is refused, and who may have it when.

use core::net::{Ipv4Addr, SocketAddrV4};

use profile_generic::time::DurationNs;

use super::rig::*;
use crate::device::event::Event;
use crate::device::explicit::adapter::DEVICE_TIMEOUT;
use crate::device::motion_link::*;
use crate::wire::cpf::ItemType;
use crate::wire::encapsulation::{Command, EncapsulationStatus};
use crate::wire::forward_open::{ConnectionFailure, ForwardOpen, ForwardOpenReply, Transport, Trigger};
use crate::wire::network_parameters::{ConnectionType, NetworkParameters};
use crate::wire::sockaddr::SockaddrInfo;

fn t_to_o_socket(address: [u8; 4], port: u16) -> Vec<u8> {
    let info = SockaddrInfo { address: SocketAddrV4::new(Ipv4Addr::from(address), port) };
    let mut bytes = vec![0; 16];
    info.emit(&mut bytes).unwrap();
    bytes
}

/// Sends a Forward_Open with socket address items.
fn send_with_socket(rig: &mut Rig, client: Client, open: &ForwardOpen<'_>, socket: &[u8]) {
    let message = open_message(open);
    let body = encapsulated(&[
        item(ItemType::NULL_ADDRESS, &[]),
        item(ItemType::UNCONNECTED_DATA, &message),
        item(ItemType::SOCKADDR_T_TO_O, socket),
    ]);
    rig.feed(client.slot, &packet(Command::SEND_RR_DATA, client.handle, &body));
}

#[test]
fn the_device_gets_what_was_asked_and_the_originator_what_was_given() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, &open_message(&motion_open(1)));
    let open = rig.device_opens();
    assert_eq!(
        open,
        OpenParameters {
            token: open.token,
            triad: triad(1),
            o_to_t_id: 0x7A00_0001,
            t_to_o_id: 0x5500_0001,
            originator: Ipv4Addr::new(10, 0, 0, 1),
            t_to_o_destination: SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), 2222),
            rpi_us: 2000,
            // Multiplier code 2 is 16 intervals.
            timeout_us: 32_000,
            o_to_t_size: 220,
            t_to_o_size: 230,
            o_to_t_variable: true,
            t_to_o_variable: true,
            t_to_o_dscp: 55,
            format_revision: 2,
            // Verify power ratings.
            configuration_bits: 1,
            assembly: None,
        }
    );
    let (answer, items) = rig.unconnected_reply(client);
    assert_eq!((answer.service, answer.outcome(), items.len()), (0x54, (0, 0), 2));
    assert_eq!(
        ForwardOpenReply::parse(&answer.data),
        Ok(ForwardOpenReply {
            o_to_t_id: 0x7A00_0001,
            t_to_o_id: 0x5500_0001,
            triad: triad(1),
            o_to_t_api_us: 2000,
            t_to_o_api_us: 2000,
            application_reply: &[],
        })
    );
    assert_eq!(rig.adapter.motion_connection(), Some(&open));
    assert_eq!(rig.events(), [Event::MotionOpened { triad: triad(1), originator: peer(1), rpi_us: 2000 }]);
}

#[test]
fn paths_that_lead_to_the_motion_connection() {
    let block1 = [1, 0, 0, 0, 0, 0, 0, 0];
    let cases: &[(&str, &[u8])] = &[
        (
            "revision 1, nothing to verify",
            &[&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4], &block1[..]].concat(),
        ),
        ("with instance 0", &[&[0x20, 0x42, 0x24, 0, 0x2C, 0x51, 0x2C, 2, 0x80, 4], &block1[..]].concat()),
        (
            "consumed and produced",
            &[&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x2C, 2, 0x80, 4], &block1[..]].concat(),
        ),
        ("two full paths", &[&[0x20, 0x42, 0x2C, 0x51, 0x20, 0x42, 0x2C, 2, 0x80, 4], &block1[..]].concat()),
        (
            "exact key",
            &[
                &[0x34, 4, 0x34, 0x12, 0x25, 0, 7, 0, 2, 3, 0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4],
                &block1[..],
            ]
            .concat(),
        ),
        (
            "compatible key of an older minor revision",
            &[
                &[0x34, 4, 0x34, 0x12, 0x25, 0, 7, 0, 0x82, 1, 0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4],
                &block1[..],
            ]
            .concat(),
        ),
        (
            "production inhibit time",
            &[&[0x43, 2, 0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4], &block1[..]].concat(),
        ),
        (
            "revision 2, class ID",
            &[0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 4, 2, 1, 0, 0, 0x0D, 0x0C, 0x0B, 0x0A],
        ),
        (
            "revision 2, axis IDs, the second not to be checked",
            &[0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 8, 2, 1, 0, 0, 0, 0, 0, 0, 0x11, 0, 0, 0, 0, 0, 0, 0],
        ),
        (
            "revision 2, class and axis IDs",
            &[
                0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 8, 2, 1, 0, 0, 0x0D, 0x0C, 0x0B, 0x0A, 0x11, 0, 0, 0,
                0x22, 0, 0, 0,
            ],
        ),
        (
            "bits of later editions: networked safety",
            &[&[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4], &[1, 6, 0, 0, 0, 0, 0, 0][..]].concat(),
        ),
        (
            "wrong IDs that are not to be verified",
            &[0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 6, 2, 0, 0, 0, 9, 9, 9, 9, 9, 0, 0, 0],
        ),
    ];
    for (name, path) in cases {
        let mut rig = Rig::new();
        let client = rig.client(1);
        rig.send_unconnected(client, &open_message(&ForwardOpen { path, ..motion_open(1) }));
        let Some(MotionRequest::Open(open)) = rig.adapter.poll_motion() else { panic!("{name}") };
        // Behind the length in words and the revision of the block.
        let at = path.iter().rposition(|octet| *octet == 0x80).expect("a block") + 3;
        assert_eq!(open.configuration_bits, path[at], "{name}");
    }
}

#[test]
fn paths_and_blocks_that_are_refused() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let cases: &[(&str, &[u8], (u8, u16))] = &[
        ("vendor", &[0x34, 4, 1, 0, 0, 0, 0, 0, 0, 0, 0x20, 0x42], (1, 0x114)),
        ("product", &[0x34, 4, 0, 0, 0, 0, 8, 0, 0, 0, 0x20, 0x42], (1, 0x114)),
        ("type", &[0x34, 4, 0, 0, 2, 0, 0, 0, 0, 0, 0x20, 0x42], (1, 0x115)),
        ("revision", &[0x34, 4, 0, 0, 0, 0, 0, 0, 2, 2, 0x20, 0x42], (1, 0x116)),
        ("newer revision", &[0x34, 4, 0, 0, 0, 0, 0, 0, 0x82, 4, 0x20, 0x42], (1, 0x116)),
        ("no point", &[0x20, 0x42], (1, 0x12F)),
        ("only the configuration", &[0x20, 0x42, 0x2C, 0x51, 0x80, 4, 1, 0, 0, 0, 0, 0, 0, 0], (1, 0x12F)),
        ("only the data", &[0x20, 0x42, 0x2C, 2], (1, 0x12F)),
        (
            "format revision 1",
            &[0x20, 0x42, 0x2C, 0x51, 0x2C, 1, 0x80, 4, 1, 0, 0, 0, 0, 0, 0, 0],
            (1, 0x12F),
        ),
        (
            "format revision 4",
            &[0x20, 0x42, 0x2C, 0x51, 0x2C, 4, 0x80, 4, 1, 0, 0, 0, 0, 0, 0, 0],
            (1, 0x12F),
        ),
        (
            "configuration 0x53",
            &[0x20, 0x42, 0x2C, 0x53, 0x2C, 2, 0x80, 4, 3, 0, 0, 0, 0, 0, 0, 0],
            (1, 0x12F),
        ),
        (
            "two format revisions",
            &[0x20, 0x42, 0x2C, 0x51, 0x2C, 3, 0x2C, 2, 0x80, 4, 1, 0, 0, 0, 0, 0, 0, 0],
            (1, 0x12F),
        ),
        ("four points", &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x2C, 2, 0x2C, 2], (1, 0x12F)),
        ("an axis", &[0x20, 0x42, 0x24, 1, 0x2C, 0x51, 0x2C, 2], (1, 0x117)),
        ("assembly", &[0x20, 4, 0x24, 1, 0x2C, 0x51, 0x2C, 2], (1, 0x117)),
        ("attribute", &[0x20, 0x42, 0x30, 1], (1, 0x315)),
        ("slot", &[1, 0, 0x20, 0x42, 0x2C, 0x51, 0x2C, 2], (1, 0x311)),
        ("two data segments", &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 0, 0x80, 0], (1, 0x315)),
        ("no block", &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2], (1, 0x126)),
        (
            "revision 1 with axis IDs",
            &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 6, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            (1, 0x126),
        ),
        (
            "half an axis ID",
            &[0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 5, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            (1, 0x126),
        ),
        (
            "block revision against the point",
            &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4, 2, 0, 0, 0, 0, 0, 0, 0],
            (9, 0),
        ),
        ("class ID", &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4, 1, 1, 0, 0, 0x0D, 0x0C, 0x0B, 0x0B], (9, 4)),
        (
            "class ID 0 in revision 1",
            &[0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4, 1, 1, 0, 0, 0, 0, 0, 0],
            (9, 4),
        ),
        (
            "class ID in revision 2",
            &[0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 6, 2, 1, 0, 0, 1, 0, 0, 0, 0x11, 0, 0, 0],
            (9, 4),
        ),
        (
            "first axis ID",
            &[0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 8, 2, 1, 0, 0, 0, 0, 0, 0, 0x12, 0, 0, 0, 0x22, 0, 0, 0],
            (9, 5),
        ),
        (
            "second axis ID",
            &[0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 8, 2, 1, 0, 0, 0, 0, 0, 0, 0x11, 0, 0, 0, 0x21, 0, 0, 0],
            (9, 6),
        ),
        (
            "an axis too many",
            &[
                0x20, 0x42, 0x2C, 0x52, 0x2C, 2, 0x80, 10, 2, 1, 0, 0, 0, 0, 0, 0, 0x11, 0, 0, 0, 0x22, 0, 0,
                0, 1, 0, 0, 0,
            ],
            (9, 7),
        ),
    ];
    for (name, path, outcome) in cases {
        let answer = rig.refused(client, &ForwardOpen { path, ..motion_open(1) });
        assert_eq!(answer.outcome(), *outcome, "{name}");
        assert_eq!(ConnectionFailure::parse(&answer.data).unwrap().triad, triad(1), "{name}");
        let Some(Event::OpenRefused { general, extended, .. }) = rig.events().pop() else {
            panic!("{name}: no event")
        };
        assert_eq!((general, extended), *outcome, "{name}");
    }
    assert_eq!(rig.adapter.motion_connection(), None);
    let counters = rig.adapter.counters();
    assert_eq!(counters.open_other_rejects, u64::try_from(cases.len()).unwrap());
    assert_eq!(counters.open_refused(9, 4), 3);
}

#[test]
fn parameters_that_are_refused() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let good = motion_open(1);
    let of = |change: fn(&mut NetworkParameters)| {
        let mut parameters = good.o_to_t;
        change(&mut parameters);
        parameters
    };
    let multicast = of(|p| p.connection_type = ConnectionType::MULTICAST);
    let null = of(|p| p.connection_type = ConnectionType::NULL);
    let fixed = of(|p| p.variable = false);
    let redundant = of(|p| p.redundant_owner = true);
    let transport = |server, trigger, class| Transport { server, trigger, class };
    let cases: &[(&str, ForwardOpen<'_>, &[u16])] = &[
        ("class 0", ForwardOpen { transport: transport(false, Trigger::CYCLIC, 0), ..good }, &[0x11C]),
        ("class 3", ForwardOpen { transport: transport(true, Trigger::APPLICATION, 3), ..good }, &[0x11C]),
        (
            "trigger",
            ForwardOpen { transport: transport(false, Trigger::CHANGE_OF_STATE, 1), ..good },
            &[0x11D],
        ),
        ("server", ForwardOpen { transport: transport(true, Trigger::CYCLIC, 1), ..good }, &[0x11E]),
        ("multicast O->T", ForwardOpen { o_to_t: multicast, ..good }, &[0x123]),
        ("multicast T->O", ForwardOpen { t_to_o: multicast, ..good }, &[0x124]),
        ("listen only", ForwardOpen { o_to_t: null, ..good }, &[0x123]),
        ("no answer", ForwardOpen { t_to_o: null, ..good }, &[0x124]),
        ("redundant owner", ForwardOpen { o_to_t: redundant, ..good }, &[0x125]),
        ("fixed O->T", ForwardOpen { o_to_t: fixed, ..good }, &[0x11F]),
        ("fixed T->O", ForwardOpen { t_to_o: fixed, ..good }, &[0x120]),
        ("O->T too large", ForwardOpen { o_to_t: point_to_point(501), ..good }, &[0x127, 500]),
        ("T->O too large", ForwardOpen { large: true, t_to_o: point_to_point(601), ..good }, &[0x128, 600]),
        ("O->T too small", ForwardOpen { o_to_t: point_to_point(9), ..good }, &[0x127, 10]),
        ("T->O too small", ForwardOpen { t_to_o: point_to_point(0), ..good }, &[0x128, 10]),
        ("multiplier", ForwardOpen { timeout_multiplier: 8, ..good }, &[0x133]),
        // Acceptable intervals come along, O->T then T->O, low word first.
        (
            "too fast",
            ForwardOpen { o_to_t_rpi_us: 999, t_to_o_rpi_us: 999, ..good },
            &[0x111, 1000, 0, 1000, 0],
        ),
        (
            "too slow",
            ForwardOpen { o_to_t_rpi_us: 99_999, t_to_o_rpi_us: 99_999, ..good },
            &[0x111, 32_000, 0, 32_000, 0],
        ),
        (
            "off the grid",
            ForwardOpen { o_to_t_rpi_us: 2100, t_to_o_rpi_us: 2100, ..good },
            &[0x111, 2500, 0, 2500, 0],
        ),
        ("two paces", ForwardOpen { t_to_o_rpi_us: 4000, ..good }, &[0x111, 2000, 0, 2000, 0]),
    ];
    for (name, open, extended) in cases {
        let answer = rig.refused(client, open);
        assert_eq!((answer.status, answer.extended.as_slice()), (1, *extended), "{name}");
    }
    let answer = rig.refused(client, &ForwardOpen { o_to_t: point_to_point(501), ..good });
    assert_eq!(answer.service, 0x54);
    let said = rig.events().pop().map(|event| event.to_string());
    assert_eq!(
        said.as_deref(),
        Some(
            "connection 0x0001 of vendor 0x0001 serial 0x0000cafe of 10.0.0.1:50000 refused with \
             0x01/0x0127: expected 0x1f4, found 0x1f5"
        )
    );
    // The largest and the fastest of each are taken.
    let edge = ForwardOpen {
        large: true,
        o_to_t: point_to_point(500),
        t_to_o: point_to_point(600),
        o_to_t_rpi_us: 1000,
        t_to_o_rpi_us: 1000,
        ..good
    };
    rig.send_unconnected(client, &open_message(&edge));
    assert_eq!(rig.device_opens().t_to_o_size, 600);
}

#[test]
fn there_is_one_owner() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    rig.send_unconnected(a, &open_message(&motion_open(1)));
    let MotionRequest::Open(open) = rig.motion_request() else { panic!("open") };
    // From the first moment on, even before the device has agreed.
    assert_eq!(rig.refused(b, &motion_open(2)).outcome(), (1, 0x106));
    assert_eq!(rig.refused(b, &motion_open(1)).outcome(), (1, 0x100), "the same triad is a repetition");
    rig.complete(&MotionReply::Opened { token: open.token, outcome: Ok(()) });
    assert_eq!(rig.unconnected_reply(a).0.outcome(), (0, 0));
    assert_eq!(rig.refused(b, &motion_open(2)).outcome(), (1, 0x106));
    assert_eq!(rig.refused(a, &motion_open(2)).outcome(), (1, 0x106));
    assert_eq!(rig.refused(a, &motion_open(1)).outcome(), (1, 0x100));
    assert_eq!(rig.refused(a, &explicit_open(1)).outcome(), (1, 0x100));
    assert_eq!(rig.adapter.counters().open_refused(1, 0x106), 3);
}

#[test]
fn a_device_that_refuses_leaves_the_connection_free() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, &open_message(&motion_open(1)));
    let token = rig.motion_request().token();
    let refusal = OpenRefusal { general_status: 0x10, extended_status: 0x0042 };
    rig.complete(&MotionReply::Opened { token, outcome: Err(refusal) });
    let (answer, _) = rig.unconnected_reply(client);
    assert_eq!(answer.outcome(), (0x10, 0x42));
    assert_eq!(ConnectionFailure::parse(&answer.data).unwrap().triad, triad(1));
    assert_eq!(rig.adapter.counters().open_refused(0x10, 0x42), 1);
    rig.open_motion(client, 1);
}

#[test]
fn forward_close_waits_for_the_device() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    rig.open_motion(a, 1);
    assert_eq!(rig.ask(b, &close_message(1)).outcome(), (1, 0x107), "not from another address");
    assert_eq!(rig.ask(a, &close_message(2)).outcome(), (1, 0x107), "not by another triad");
    rig.send_unconnected(a, &close_message(1));
    let token = rig.motion_request().token();
    assert_eq!(rig.received(a.slot), []);
    assert_eq!(rig.refused(b, &motion_open(2)).outcome(), (1, 0x106), "not free yet");
    rig.complete(&MotionReply::Closed { token });
    assert_eq!(rig.unconnected_reply(a).0.outcome(), (0, 0));
    rig.open_motion(b, 2);
}

/// The table at [`crate::device::connection::manager`], walked.
#[test]
fn every_state_and_event() {
    use crate::device::connection::manager::Motion;
    const STATES: [&str; 4] = ["Closed", "Opening", "Open", "Closing"];
    const EVENTS: [&str; 8] = [
        "Forward_Open again",
        "Forward_Open of another",
        "Forward_Close",
        "device opened",
        "device refuses",
        "device closed",
        "connection lost",
        "device silent",
    ];
    let mut table = String::new();
    for state in STATES {
        for event in EVENTS {
            let mut rig = Rig::new();
            // One client gets the connection into its state, the other one raises the event.
            let (owner, other) = (rig.client(1), rig.client(1));
            let mut token = Token(u64::MAX);
            if state != "Closed" {
                rig.send_unconnected(owner, &open_message(&motion_open(1)));
                token = rig.motion_request().token();
            }
            if state == "Open" || state == "Closing" {
                rig.complete(&MotionReply::Opened { token, outcome: Ok(()) });
                rig.received(owner.slot);
            }
            if state == "Closing" {
                rig.send_unconnected(owner, &close_message(1));
                token = rig.motion_request().token();
            }
            rig.events();
            let o_to_t_id = rig.adapter.motion_connection().map_or(0, |open| open.o_to_t_id);
            let refused = Err(OpenRefusal { general_status: 0x10, extended_status: 0 });
            match event {
                "Forward_Open again" => rig.send_unconnected(other, &open_message(&motion_open(1))),
                "Forward_Open of another" => rig.send_unconnected(other, &open_message(&motion_open(2))),
                "Forward_Close" => rig.send_unconnected(other, &close_message(1)),
                "device silent" => rig.pass(DEVICE_TIMEOUT),
                _ => {
                    rig.complete(&match event {
                        "device opened" => MotionReply::Opened { token, outcome: Ok(()) },
                        "device refuses" => MotionReply::Opened { token, outcome: refused },
                        "device closed" => MotionReply::Closed { token },
                        _ => MotionReply::ConnectionLost { o_to_t_id, silent_us: 40_000 },
                    });
                }
            }
            let next = match rig.adapter.node.connections.motion {
                Motion::Closed => "Closed",
                Motion::Opening(..) => "Opening",
                Motion::Open(..) => "Open",
                Motion::Closing(..) => "Closing",
            };
            let mut said = Vec::new();
            if let Some(request) = rig.adapter.poll_motion() {
                let kind = if matches!(request, MotionRequest::Open(_)) { "open" } else { "close" };
                said.push(format!("asks the device to {kind}"));
            }
            for (who, client) in [("owner", owner), ("other", other)] {
                if !rig.received_is_empty(client) {
                    let (general, extended) = rig.unconnected_reply(client).0.outcome();
                    said.push(format!("answers {who} {general:#04x}/{extended:#06x}"));
                }
            }
            table += &format!("{state:<8} {event:<24} -> {next:<8} {}\n", said.join(", "));
        }
    }
    let table: Vec<_> = table.lines().map(str::trim_end).collect();
    insta::assert_snapshot!(table.join("\n"));
}

#[test]
fn closing_frees_the_connection_once_the_device_agrees() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    let open = rig.open_motion(a, 1);
    rig.events();
    rig.send_unconnected(a, &close_message(1));
    let close = rig.device_closes();
    assert_eq!((close.triad, close.o_to_t_id), (open.triad, open.o_to_t_id));
    let (answer, _) = rig.unconnected_reply(a);
    assert_eq!((answer.service, answer.outcome()), (0x4E, (0, 0)));
    assert_eq!(answer.data, [1, 0, 1, 0, 0xFE, 0xCA, 0, 0, 0, 0]);
    assert_eq!(rig.events(), [Event::MotionClosed { triad: triad(1) }]);
    assert_eq!(rig.ask(a, &close_message(1)).outcome(), (1, 0x107));
    let next = rig.open_motion(b, 2);
    assert_ne!(next.o_to_t_id, open.o_to_t_id, "connection IDs are not used again");
}

#[test]
fn a_vanished_owner_frees_the_connection_at_once() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    let open = rig.open_motion(a, 1);
    rig.events();
    // The session's end alone takes nothing: the connection lives from its own datagrams.
    rig.adapter.close(a.slot);
    assert_eq!(rig.refused(b, &motion_open(2)).outcome(), (1, 0x106));
    rig.events();
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id + 9, silent_us: 1 });
    assert!(rig.adapter.motion_connection().is_some(), "another connection's loss is not ours");
    assert_eq!(
        rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_050 }),
        None
    );
    assert_eq!(
        rig.events().iter().map(Event::to_string).collect::<Vec<_>>(),
        ["motion connection 0x0001 of vendor 0x0001 serial 0x0000cafe of 10.0.0.1:50000 timed out: \
             nothing O->T for 32050 us, expected within 32000 us, late by 50 us"]
    );
    assert_eq!(rig.adapter.counters().connection_timeouts, 1);
    rig.open_motion(b, 2);
}

#[test]
fn loss_and_close_may_cross() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let open = rig.open_motion(client, 1);
    rig.send_unconnected(client, &close_message(1));
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 40_000 });
    assert_eq!(rig.adapter.motion_connection(), None);
    rig.device_closes();
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0, 0));
    rig.open_motion(client, 1);
}

#[test]
fn a_device_that_does_not_answer_an_open_is_told_to_close() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.send_unconnected(client, &open_message(&motion_open(1)));
    let MotionRequest::Open(open) = rig.motion_request() else { panic!("open") };
    rig.pass(DEVICE_TIMEOUT);
    let (answer, _) = rig.unconnected_reply(client);
    assert_eq!(answer.outcome(), (0x02, 0));
    assert_eq!(rig.adapter.motion_connection(), None);
    let MotionRequest::Close(close) = rig.motion_request() else { panic!("close") };
    assert_eq!(close.o_to_t_id, open.o_to_t_id);
    // Both answers come late and change nothing.
    rig.complete(&MotionReply::Opened { token: open.token, outcome: Ok(()) });
    assert_eq!(rig.adapter.motion_connection(), None);
    rig.complete(&MotionReply::Closed { token: close.token });
    assert_eq!(rig.adapter.counters().replies_orphaned, 2);
    rig.open_motion(client, 1);
}

#[test]
fn a_device_that_does_not_answer_a_close_still_frees_the_connection() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    rig.open_motion(client, 1);
    rig.send_unconnected(client, &close_message(1));
    rig.motion_request();
    rig.pass(DEVICE_TIMEOUT);
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0x02, 0));
    rig.open_motion(client, 2);
}

#[test]
fn an_originator_that_leaves_while_opening_leaves_an_open_connection() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    rig.send_unconnected(a, &open_message(&motion_open(1)));
    rig.adapter.close(a.slot);
    let open = rig.device_opens();
    // The device watches it: without datagrams it is lost in time.
    assert_eq!(rig.adapter.motion_connection(), Some(&open));
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open.o_to_t_id, silent_us: 32_000 });
    rig.open_motion(b, 2);
}

#[test]
fn a_silent_device_and_a_vanished_originator_block_nothing() {
    let mut rig = Rig::new();
    let (a, b) = (rig.client(1), rig.client(2));
    rig.send_unconnected(a, &open_message(&motion_open(1)));
    rig.motion_request();
    rig.adapter.close(a.slot);
    assert_eq!(rig.adapter.wake_at(), Some(rig.now + DEVICE_TIMEOUT));
    rig.pass(DEVICE_TIMEOUT);
    assert!(matches!(rig.motion_request(), MotionRequest::Close(_)));
    rig.open_motion(b, 2);
}

#[test]
fn a_null_forward_open_checks_without_opening() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let null = NetworkParameters { connection_type: ConnectionType::NULL, ..point_to_point(0) };
    let check = ForwardOpen { o_to_t: null, t_to_o: null, ..motion_open(1) };
    assert_eq!(rig.ask(client, &open_message(&check)).outcome(), (0, 0));
    assert_eq!(rig.adapter.poll_motion(), None);
    assert_eq!(rig.adapter.motion_connection(), None);
    let open = rig.open_motion(client, 1);
    let answer = rig.ask(client, &open_message(&check));
    let reply = ForwardOpenReply::parse(&answer.data).unwrap();
    assert_eq!((reply.o_to_t_id, reply.t_to_o_id), (open.o_to_t_id, open.t_to_o_id));
    let wrong = [0x20, 0x42, 0x2C, 0x51, 0x2C, 2, 0x80, 4, 1, 1, 0, 0, 1, 0, 0, 0];
    assert_eq!(rig.refused(client, &ForwardOpen { path: &wrong, ..check }).outcome(), (9, 4));
}

#[test]
fn a_socket_address_changes_the_port_and_nothing_else() {
    for (address, port, expected) in [
        ([0, 0, 0, 0], 5000, 5000),
        ([10, 0, 0, 1], 2223, 2223),
        ([10, 0, 0, 77], 6000, 6000),
        ([0; 4], 0, 2222),
    ] {
        let mut rig = Rig::new();
        let client = rig.client(1);
        send_with_socket(&mut rig, client, &motion_open(1), &t_to_o_socket(address, port));
        let open = rig.device_opens();
        // Datagrams go to the peer itself, whatever address it names.
        assert_eq!(open.t_to_o_destination, SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), expected));
    }
    let mut rig = Rig::new();
    let client = rig.client(1);
    send_with_socket(&mut rig, client, &motion_open(1), &t_to_o_socket([239, 192, 1, 1], 2222));
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (1, 0x813));
    for bad in [&[0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], &[0, 2, 0, 0], &[]] {
        send_with_socket(&mut rig, client, &motion_open(1), bad);
        let reply = rig.the_one(client.slot);
        assert_eq!(reply.header.status, EncapsulationStatus::INCORRECT_DATA, "{bad:?}");
    }
    assert_eq!(rig.adapter.poll_motion(), None);
}

#[test]
fn another_io_port_is_told_in_the_reply() {
    let mut rig = Rig::with(|config| config.interface.io_port = 2300);
    let client = rig.client(1);
    rig.send_unconnected(client, &open_message(&motion_open(1)));
    rig.device_opens();
    let (answer, items) = rig.unconnected_reply(client);
    assert_eq!(answer.outcome(), (0, 0));
    assert_eq!(items.len(), 3);
    assert_eq!(items[2].0, ItemType::SOCKADDR_O_TO_T);
    let socket = SockaddrInfo::parse(&items[2].1).unwrap();
    assert_eq!(socket.address, SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 9), 2300));
    // Only there: not with a refusal, not with other replies.
    rig.send_unconnected(client, &open_message(&motion_open(2)));
    assert_eq!(rig.unconnected_reply(client).1.len(), 2);
    rig.pass(DurationNs::from_millis(1));
}

#[test]
fn events_nobody_fetches_do_not_pile_up() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    for _ in 0..100 {
        rig.refused(client, &ForwardOpen { path: &[], ..motion_open(1) });
    }
    assert_eq!(rig.adapter.counters().events_lost, 36);
    assert_eq!(rig.events().len(), 64);
}
