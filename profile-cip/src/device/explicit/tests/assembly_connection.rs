//! Connections to assemblies: who may open which, and what is refused with which status.

use super::rig::*;
use crate::assembly::{Assemblies, Layout};
use crate::device::event::Event;
use crate::device::explicit::adapter::DEVICE_TIMEOUT;
use crate::device::motion_link::*;
use crate::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use crate::wire::network_parameters::{ConnectionType, NetworkParameters};
use crate::wire::status::Service;

const OWNER: &[u8] = &[0x20, 4, 0x24, 151, 0x2C, 150, 0x2C, 100];
const INPUT_ONLY: &[u8] = &[0x20, 4, 0x2C, 151, 0x2C, 152, 0x2C, 100];
const LISTEN_ONLY: &[u8] = &[0x20, 4, 0x2C, 153, 0x2C, 100];

fn rig() -> Rig {
    Rig::with(|config| {
        config.assembly = Some(Assemblies::new(Layout::shipped("position").unwrap(), 2).unwrap())
    })
}

fn open(serial: u16, path: &'static [u8]) -> ForwardOpen<'static> {
    let o_to_t = if path[path.len() - 3] == 150 { 2 + 4 + 32 } else { 2 };
    ForwardOpen {
        o_to_t: NetworkParameters { variable: false, ..point_to_point(o_to_t) },
        t_to_o: NetworkParameters { variable: false, ..point_to_point(2 + 40) },
        o_to_t_rpi_us: 2_000,
        t_to_o_rpi_us: 4_000,
        path,
        ..motion_open(serial)
    }
}

fn opened(rig: &mut Rig, client: Client, request: &ForwardOpen<'_>) -> OpenParameters {
    rig.send_unconnected(client, &open_message(request));
    let open = rig.device_opens();
    let answer = rig.unconnected_reply(client).0;
    assert_eq!(answer.outcome(), (0, 0));
    let reply = ForwardOpenReply::parse(&answer.data).unwrap();
    assert_eq!((reply.o_to_t_api_us, reply.t_to_o_api_us), (request.o_to_t_rpi_us, request.t_to_o_rpi_us));
    assert_eq!(reply.o_to_t_id, open.o_to_t_id);
    open
}

#[test]
fn an_owner_and_listeners_are_connected_side_by_side() {
    let mut rig = rig();
    let (plc, panel) = (rig.client(1), rig.client(2));
    assert_eq!(
        rig.refused(panel, &open(9, LISTEN_ONLY)).outcome(),
        (1, 0x119),
        "there is nothing to listen to"
    );
    let owner = opened(&mut rig, plc, &open(1, OWNER));
    let role = |open: OpenParameters| open.assembly.map(|assembly| (assembly.role, assembly.t_to_o_rpi_us));
    assert_eq!(role(owner), Some((AssemblyRole::ExclusiveOwner, 4_000)));
    assert_eq!((owner.rpi_us, owner.timeout_us), (2_000, 32_000));
    let second = rig.refused(panel, &open(2, OWNER));
    assert_eq!(second.outcome(), (1, 0x106), "one owner");
    let input = opened(&mut rig, panel, &open(3, INPUT_ONLY));
    let listen = opened(&mut rig, panel, &open(4, LISTEN_ONLY));
    assert_eq!(role(input).unwrap().0, AssemblyRole::InputOnly);
    assert_eq!(role(listen).unwrap().0, AssemblyRole::ListenOnly);
    assert_eq!(rig.refused(panel, &open(3, INPUT_ONLY)).outcome(), (1, 0x100), "opened twice");
    rig.events();

    // The owner ends, by silence; the others stay.
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: owner.o_to_t_id, silent_us: 40_000 });
    assert_eq!(rig.adapter.motion_connection(), None);
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: listen.o_to_t_id, silent_us: 0 });
    let texts: Vec<_> = rig.events().iter().map(ToString::to_string).collect();
    assert!(texts[0].contains("exclusive owner") && texts[0].contains("timed out"), "{texts:?}");
    assert!(texts[1].contains("listen only") && texts[1].contains("ended with"), "{texts:?}");
    let again = opened(&mut rig, panel, &open(5, OWNER));
    assert_ne!(again.o_to_t_id, owner.o_to_t_id);

    // A listener closes.
    rig.send_unconnected(panel, &close_message(3));
    assert_eq!(rig.device_closes().o_to_t_id, input.o_to_t_id);
    assert_eq!(rig.unconnected_reply(panel).0.outcome(), (0, 0));
    rig.events();
    assert_eq!(rig.ask(panel, &close_message(3)).outcome(), (1, 0x107), "it is gone");
    rig.send_unconnected(panel, &close_message(5));
    rig.device_closes();
    assert_eq!(rig.unconnected_reply(panel).0.outcome(), (0, 0));
    let closed = Event::AssemblyClosed { role: AssemblyRole::ExclusiveOwner, triad: triad(5) };
    assert_eq!(rig.events(), [closed]);
}

#[test]
fn what_does_not_fit_is_refused_with_what_would() {
    let mut rig = rig();
    let client = rig.client(1);
    let good = open(1, OWNER);
    let sized = |o_to_t: u16, t_to_o: u16| ForwardOpen {
        o_to_t: NetworkParameters { size: o_to_t, ..good.o_to_t },
        t_to_o: NetworkParameters { size: t_to_o, ..good.t_to_o },
        ..good
    };
    let multicast = NetworkParameters { connection_type: ConnectionType::MULTICAST, ..good.t_to_o };
    let class3 = Transport { server: true, trigger: Trigger::APPLICATION, class: 3 };
    let change = Transport { server: false, trigger: Trigger::CHANGE_OF_STATE, class: 1 };
    for (open, extended) in [
        (sized(37, 42), vec![0x127, 38]),
        (sized(34, 42), vec![0x127, 38]),
        (sized(38, 41), vec![0x128, 42]),
        (ForwardOpen { t_to_o: multicast, ..good }, vec![0x124]),
        (ForwardOpen { transport: class3, ..good }, vec![0x11C]),
        (ForwardOpen { transport: change, ..good }, vec![0x11D]),
        (ForwardOpen { o_to_t_rpi_us: 999, ..good }, vec![0x111, 1000, 0, 4000, 0]),
        (ForwardOpen { t_to_o_rpi_us: 40_000, ..good }, vec![0x111, 2000, 0, 32_000, 0]),
        (ForwardOpen { timeout_multiplier: 8, ..good }, vec![0x133]),
        (ForwardOpen { path: &[0x20, 4, 0x24, 151, 0x2C, 149, 0x2C, 100], ..good }, vec![0x12A]),
        (ForwardOpen { path: &[0x20, 4, 0x24, 151, 0x2C, 150, 0x2C, 101], ..good }, vec![0x12B]),
        (ForwardOpen { path: &[0x20, 4, 0x24, 1, 0x2C, 150, 0x2C, 100], ..good }, vec![0x129]),
        (ForwardOpen { path: &[0x20, 4, 0x24, 151, 0x2C, 150], ..good }, vec![0x12F]),
        (ForwardOpen { path: &[0x20, 4, 0x2C, 150, 0x2C, 100, 0x80, 1, 0, 0], ..good }, vec![0x126]),
        (ForwardOpen { path: PATH_MOTION, ..good }, vec![0x117]),
        (ForwardOpen { o_to_t: point_to_point(3), ..open(1, INPUT_ONLY) }, vec![0x127, 2]),
    ] {
        let answer = rig.refused(client, &open);
        assert_eq!((answer.status, answer.extended), (1, extended), "{open:?}");
    }
    assert_eq!(
        rig.ask(client, &message(Service::GET_ATTRIBUTE_SINGLE, &[0x20, 0x42, 0x24, 0, 0x30, 1], &[])).status,
        5
    );
    for path in [&[0x20, 4, 0x2C, 150, 0x2C, 100][..], &[0x20, 4, 0x2C, 151, 0x2C, 150, 0x2C, 100, 0x80, 0]] {
        let message = open_message(&ForwardOpen { path, ..good });
        rig.send_unconnected(client, &message);
        rig.device_opens();
        assert_eq!(rig.unconnected_reply(client).0.outcome(), (0, 0));
        rig.send_unconnected(client, &close_message(1));
        rig.device_closes();
        assert_eq!(rig.unconnected_reply(client).0.outcome(), (0, 0));
    }
}

#[test]
fn a_motion_device_has_no_assemblies() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    assert_eq!(rig.refused(client, &open(1, OWNER)).outcome(), (1, 0x117));
}

#[test]
fn listeners_are_few_and_given_up_with_a_silent_device() {
    let mut rig = rig();
    let client = rig.client(1);
    for serial in 0..8 {
        opened(&mut rig, client, &open(serial, INPUT_ONLY));
    }
    assert_eq!(rig.refused(client, &open(8, INPUT_ONLY)).outcome(), (1, 0x113));
    opened(&mut rig, client, &open(9, OWNER));
    rig.send_unconnected(client, &close_message(0));
    let MotionRequest::Close(_) = rig.motion_request() else { panic!("a close request") };
    rig.pass(DEVICE_TIMEOUT);
    assert_eq!(rig.unconnected_reply(client).0.status, 2, "the device did not answer");
    opened(&mut rig, client, &open(10, INPUT_ONLY));
}
