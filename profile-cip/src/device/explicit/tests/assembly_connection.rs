//! Connections to assemblies: who may open which, and what is refused with which status.

use core::net::{Ipv4Addr, SocketAddrV4};

use super::rig::*;
use crate::assembly::{Assemblies, DriveMode, Layout};
use crate::device::event::Event;
use crate::device::explicit::adapter::DEVICE_TIMEOUT;
use crate::device::motion_link::*;
use crate::device::objects::ac_dc_drive::{self, Place};
use crate::wire::cpf::ItemType;
use crate::wire::forward_open::{ForwardOpen, ForwardOpenReply, Transport, Trigger};
use crate::wire::network_parameters::{ConnectionType, NetworkParameters, Priority};
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
        (ForwardOpen { o_to_t: NetworkParameters { size: 38, ..multicast }, ..good }, vec![0x123]),
        (
            ForwardOpen { t_to_o: NetworkParameters { redundant_owner: true, ..multicast }, ..good },
            vec![0x125],
        ),
        (ForwardOpen { t_to_o: NetworkParameters { size: 41, ..multicast }, ..good }, vec![0x128, 42]),
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

/// A Forward_Open whose T->O direction is multicast.
fn multicast(serial: u16, path: &'static [u8]) -> ForwardOpen<'static> {
    let one = open(serial, path);
    let t_to_o = NetworkParameters { connection_type: ConnectionType::MULTICAST, ..one.t_to_o };
    ForwardOpen { t_to_o, ..one }
}

/// The reply's connection ID T->O, and the data of its socket address item T->O.
fn joined(rig: &mut Rig, client: Client, request: &ForwardOpen<'_>) -> (u32, OpenParameters, Vec<u8>) {
    rig.send_unconnected(client, &open_message(request));
    let open = rig.device_opens();
    let (answer, items) = rig.unconnected_reply(client);
    assert_eq!(answer.outcome(), (0, 0));
    let reply = ForwardOpenReply::parse(&answer.data).unwrap();
    assert_eq!(items.len(), 3, "{items:?}");
    assert_eq!(items[2].0, ItemType::SOCKADDR_T_TO_O);
    (reply.t_to_o_id, open, items[2].1.clone())
}

/// The device is 10.0.0.9 with a mask of 24 bits: its groups begin 8 times 32 behind 239.192.1.0.
const GROUP: [u8; 16] = [0, 2, 0x08, 0xAE, 239, 192, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];

#[test]
fn all_that_ask_for_multicast_consume_one_stream() {
    let mut rig = rig();
    let (plc, panel) = (rig.client(1), rig.client(2));
    let (id, open_owner, item) = joined(&mut rig, plc, &multicast(1, OWNER));
    assert_eq!(item, GROUP);
    assert_ne!(id, multicast(1, OWNER).t_to_o_id, "the device chooses it");
    assert_eq!(open_owner.t_to_o_id, id);
    let group = SocketAddrV4::new(Ipv4Addr::new(239, 192, 2, 0), 2222);
    assert_eq!((open_owner.group(), open_owner.t_to_o_destination), (Some(group), group));
    let text = rig.events()[0].to_string();
    assert!(text.ends_with(", multicast to 239.192.2.0"), "{text}");

    let (same, input, item) = joined(&mut rig, panel, &multicast(2, INPUT_ONLY));
    assert_eq!((same, item.as_slice()), (id, &GROUP[..]));
    let (same, listen, _) = joined(&mut rig, panel, &multicast(3, LISTEN_ONLY));
    assert_eq!(same, id);
    assert_eq!(listen.originator, Ipv4Addr::new(10, 0, 0, 2));
    // Point to point goes on beside it, at an interval of its own.
    let alone = opened(&mut rig, panel, &ForwardOpen { t_to_o_rpi_us: 8_000, ..open(4, INPUT_ONLY) });
    assert_eq!((alone.group(), *alone.t_to_o_destination.ip()), (None, Ipv4Addr::new(10, 0, 0, 2)));
    rig.events();

    let good = multicast(5, INPUT_ONLY);
    let t_to_o = |change: fn(&mut NetworkParameters)| {
        let mut parameters = good.t_to_o;
        change(&mut parameters);
        ForwardOpen { t_to_o: parameters, ..good }
    };
    for (open, extended) in [
        // O->T 2000 us is acceptable, T->O has to be 4000 us.
        (ForwardOpen { t_to_o_rpi_us: 8_000, ..good }, vec![0x112, 0x0400, 2_000, 0, 4_000, 0]),
        (t_to_o(|one| one.variable = true), vec![0x135]),
        (t_to_o(|one| one.priority = Priority::SCHEDULED), vec![0x136]),
        (t_to_o(|one| one.size = 44), vec![0x128, 42]),
    ] {
        let answer = rig.refused(panel, &open);
        assert_eq!((answer.status, answer.extended), (1, extended), "{open:?}");
    }
    // The owner goes, and the stream stays that of those that listen.
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: open_owner.o_to_t_id, silent_us: 40_000 });
    let (same, ..) = joined(&mut rig, plc, &multicast(6, OWNER));
    assert_eq!(same, id);
    // All of its connections go: the next one begins another stream, on its own terms.
    for serial in [2, 3, 6] {
        let client = if serial == 6 { plc } else { panel };
        rig.send_unconnected(client, &close_message(serial));
        rig.device_closes();
        assert_eq!(rig.unconnected_reply(client).0.outcome(), (0, 0));
    }
    assert_eq!(input.t_to_o_id, id);
    let (next, ..) =
        joined(&mut rig, panel, &ForwardOpen { t_to_o_rpi_us: 8_000, ..multicast(7, INPUT_ONLY) });
    assert_ne!(next, id);
}

#[test]
fn a_multicast_does_not_leave_the_subnet() {
    let mut rig = Rig::with(|config| {
        config.assembly = Some(Assemblies::new(Layout::shipped("position").unwrap(), 2).unwrap());
        config.interface.netmask = Ipv4Addr::new(255, 255, 255, 248);
    });
    let (near, far) = (rig.client(8 + 6), rig.client(1));
    assert_eq!(rig.refused(far, &multicast(1, INPUT_ONLY)).outcome(), (1, 0x0813));
    // Host 1 of the subnet has the first groups.
    let (_, stream, _) = joined(&mut rig, near, &multicast(2, INPUT_ONLY));
    assert_eq!(*stream.t_to_o_destination.ip(), Ipv4Addr::new(239, 192, 1, 0));
    opened(&mut rig, far, &open(3, INPUT_ONLY));
}

/// Sizes and numbers are answered at once, data by the motion device, and nothing can be set.
#[test]
fn the_assembly_object_has_data_and_sizes_that_cannot_be_set() {
    const GET: Service = Service::GET_ATTRIBUTE_SINGLE;
    const SET: Service = Service::SET_ATTRIBUTE_SINGLE;
    let mut rig = rig();
    let client = rig.client(1);
    let path = |instance: u8, attribute: u8| [0x20, 4, 0x24, instance, 0x30, attribute];
    for (instance, attribute, value) in [
        (0, 1, 2_u16),
        (0, 2, 153),
        (0, 3, 5),
        (0, 6, 7),
        (0, 7, 4),
        (150, 4, 32),
        (100, 4, 40),
        (151, 4, 0),
        (152, 4, 0),
        (153, 4, 0),
    ] {
        let answer = rig.ask(client, &message(GET, &path(instance, attribute), &[]));
        assert_eq!((answer.status, answer.data), (0, value.to_le_bytes().to_vec()), "{instance} {attribute}");
    }
    for instance in [150, 100, 151] {
        rig.send_unconnected(client, &message(GET, &path(instance, 3), &[]));
        let Some(MotionRequest::Explicit(asked)) = rig.adapter.poll_motion() else { panic!("it asks") };
        assert_eq!((asked.path.class, asked.path.instance), (4, u32::from(instance)));
        let mut reply = ExplicitReply::status(asked.token, 0);
        reply.data.try_extend_from_slice(&[instance; 20]).unwrap();
        rig.complete(&MotionReply::Explicit(reply));
        let answer = rig.unconnected_reply(client).0;
        assert_eq!((answer.status, answer.data), (0, vec![instance; 20]));
    }
    for (service, path, data, status, what) in [
        (SET, path(150, 3), &[0; 32][..], 0x0E, "only a connection moves axes"),
        (SET, path(100, 3), &[0; 40], 0x0E, "the input is the device's"),
        (SET, path(151, 3), &[], 0x0E, "the configuration has no data"),
        (SET, path(150, 4), &[0; 2], 0x0E, "sizes are those of the layout"),
        (SET, path(0, 1), &[0; 2], 0x0E, "so is the class"),
        (SET, path(150, 9), &[], 0x14, "no such attribute"),
        (GET, path(150, 1), &[], 0x14, "no list of members"),
        (GET, path(150, 2), &[], 0x14, "no list of members"),
        (GET, path(0, 4), &[], 0x14, "no such class attribute"),
        (GET, path(149, 3), &[], 0x05, "no such assembly"),
        (GET, path(100, 3), &[0], 0x15, "a read has no data"),
        (Service::GET_ATTRIBUTES_ALL, path(100, 3), &[], 0x08, "no other service"),
    ] {
        let answer = rig.ask(client, &message(service, &path, data));
        assert_eq!(answer.status, status, "{what}");
    }
    let answer = rig.ask(client, &message(GET, &[0x20, 4, 0x24, 100], &[]));
    assert_eq!(answer.status, 4, "which attribute?");
    let answer = rig.ask(client, &message(GET, &[0x20, 4, 0x24, 100, 0x28, 1, 0x30, 3], &[]));
    assert_eq!(answer.status, 4, "members are no objects");
    assert_eq!(rig.adapter.poll_motion(), None, "none of them reaches the axes");
    let classes = rig.ask(client, &message(GET, &[0x20, 2, 0x24, 1, 0x30, 1], &[])).data;
    let classes: Vec<_> =
        classes[2..].chunks(2).map(|class| u16::from_le_bytes([class[0], class[1]])).collect();
    assert!(classes.is_sorted() && classes.contains(&4) && classes.contains(&0x64), "{classes:x?}");

    // Another address reads too while there is an owner.
    opened(&mut rig, client, &open(1, OWNER));
    let panel = rig.client(2);
    assert_eq!(rig.ask(panel, &message(GET, &path(100, 4), &[])).data, [40, 0]);
    assert_eq!(rig.ask(panel, &message(SET, &path(150, 3), &[0; 32])).status, 0x0F);
    assert_eq!(rig.ask(client, &message(SET, &path(150, 3), &[0; 32])).status, 0x0E);
}

/// The AC/DC Drive object is there with the assemblies of its profile only; what they carry, the motion device answers.
#[test]
fn the_drive_object_is_there_with_the_assemblies_of_its_profile() {
    const GET: Service = Service::GET_ATTRIBUTE_SINGLE;
    const SET: Service = Service::SET_ATTRIBUTE_SINGLE;
    let path = |instance: u8, attribute: u8| [0x20, 0x2A, 0x24, instance, 0x30, attribute];
    let classes = |rig: &mut Rig, client| {
        let data = rig.ask(client, &message(GET, &[0x20, 2, 0x24, 1, 0x30, 1], &[])).data;
        data[2..].chunks(2).map(|class| u16::from_le_bytes([class[0], class[1]])).collect::<Vec<_>>()
    };
    let mut plain = rig();
    let client = plain.client(1);
    assert_eq!(plain.ask(client, &message(GET, &path(1, 6), &[])).status, 5);
    assert!(!classes(&mut plain, client).contains(&0x2A));
    let of = |name: &str| {
        let layout = Layout::shipped(name).unwrap().with_torque(DriveMode::Torque, -3);
        Rig::with(|config| config.assembly = Some(Assemblies::new(layout, 1).unwrap()))
    };
    for (name, mode, torque) in
        [("speed", 2, None), ("speed-torque", 3, Some(0xFD)), ("speed-torque-basic", 3, Some(0xFD))]
    {
        let mut rig = of(name);
        let client = rig.client(1);
        let found = classes(&mut rig, client);
        assert!(found.is_sorted() && found.contains(&0x2A), "{found:x?}");
        for (instance, attribute, value) in [
            (0, 1, vec![1, 0]),
            (0, 2, vec![1, 0]),
            (0, 3, vec![1, 0]),
            (0, 6, vec![7, 0]),
            (0, 7, vec![24, 0]),
            (1, 6, vec![mode]),
            (1, 22, vec![0]),
        ] {
            let answer = rig.ask(client, &message(GET, &path(instance, attribute), &[]));
            assert_eq!((answer.status, answer.data), (0, value), "{name} {instance} {attribute}");
        }
        let answer = rig.ask(client, &message(GET, &path(1, 24), &[]));
        assert_eq!((answer.status == 0).then_some(answer.data), torque.map(|scale| vec![scale]), "{name}");
        for (attribute, there) in [(7, true), (8, true), (11, torque.is_some()), (12, torque.is_some())] {
            if !there {
                assert_eq!(rig.ask(client, &message(GET, &path(1, attribute), &[])).status, 0x14);
                continue;
            }
            rig.send_unconnected(client, &message(GET, &path(1, attribute), &[]));
            let Some(MotionRequest::Explicit(asked)) = rig.adapter.poll_motion() else { panic!("it asks") };
            let place = ac_dc_drive::place(&asked.path).unwrap();
            let expected = match attribute {
                7 => Place { output: false, offset: 2 },
                8 => Place { output: true, offset: 2 },
                11 => Place { output: false, offset: 4 },
                _ => Place { output: true, offset: 4 },
            };
            assert_eq!(place, expected);
            let mut reply = ExplicitReply::status(asked.token, 0);
            reply.data.try_extend_from_slice(&[attribute, 0]).unwrap();
            rig.complete(&MotionReply::Explicit(reply));
            assert_eq!(rig.unconnected_reply(client).0.data, [attribute, 0]);
        }
        for (service, path, data, status, what) in [
            (SET, path(1, 6), &[2][..], 0x0E, "the mode is configured"),
            (SET, path(1, 8), &[0, 0], 0x0E, "references come on the connection"),
            (GET, path(1, 9), &[], 0x14, "no such attribute"),
            (GET, path(0, 4), &[], 0x14, "no such class attribute"),
            (GET, path(2, 6), &[], 0x05, "no such instance"),
            (GET, path(1, 7), &[0], 0x15, "a read has no data"),
            (Service::GET_ATTRIBUTES_ALL, path(1, 6), &[], 0x08, "no other service"),
        ] {
            assert_eq!(rig.ask(client, &message(service, &path, data)).status, status, "{what}");
        }
        assert_eq!(rig.adapter.poll_motion(), None, "none of them reaches the axis");
    }
}

/// Get_Connection_Data and the Connection Entry List have the owner and those that listen, each with its number and intervals.
#[test]
fn connections_that_listen_are_listed_beside_the_owner() {
    let mut rig = rig();
    let (plc, panel) = (rig.client(1), rig.client(2));
    let get = |number: u8| message(Service::GET_CONNECTION_DATA, PATH_MANAGER, &[number, 0]);
    let search = |serial: u8| {
        message(Service::SEARCH_CONNECTION_DATA, PATH_MANAGER, &[serial, 0, 1, 0, 0xFE, 0xCA, 0, 0])
    };
    assert_eq!(rig.get(plc, PATH_MANAGER, 9).data, [41, 0, 0, 0, 0, 0, 0, 0]);
    let owner = opened(&mut rig, plc, &open(1, OWNER));
    let input = opened(&mut rig, panel, &open(2, INPUT_ONLY));
    let listen = opened(&mut rig, panel, &open(3, LISTEN_ONLY));
    assert_eq!(rig.get(plc, PATH_MANAGER, 9).data, [41, 0, 1, 0, 0, 0, 0b0000_0110, 0], "0, 33 and 34");
    let data = rig.ask(panel, &get(34)).data;
    let (o_to_t, t_to_o) = (listen.o_to_t_id.to_le_bytes(), listen.t_to_o_id.to_le_bytes());
    assert_eq!(data[..4], [34, 0, 3, 0], "established");
    assert_eq!((&data[16..20], &data[36..40]), (&o_to_t[..], &t_to_o[..]));
    // 2000 us one way, 4000 us the other.
    assert_eq!((&data[28..32], &data[48..52]), (&[0xD0, 7, 0, 0][..], &[0xA0, 0x0F, 0, 0][..]));
    assert_eq!(rig.ask(panel, &search(3)).data, data);
    assert_eq!(rig.ask(plc, &get(34)).data[16..20], [0; 4], "whose connection it is not gets no ID");
    assert_eq!(rig.ask(plc, &search(1)).data[..2], [0, 0]);
    assert_eq!(rig.ask(plc, &get(0)).data[16..20], owner.o_to_t_id.to_le_bytes());
    assert_eq!(rig.ask(plc, &get(35)).status, 5);
    // A number that is free is given again, and the others stay.
    rig.complete(&MotionReply::ConnectionLost { o_to_t_id: input.o_to_t_id, silent_us: 0 });
    assert_eq!(rig.ask(panel, &get(33)).status, 5);
    assert_eq!(rig.ask(panel, &search(3)).data[..2], [34, 0]);
    opened(&mut rig, panel, &open(4, INPUT_ONLY));
    assert_eq!(rig.ask(panel, &search(4)).data[..2], [33, 0]);
}

/// An assembly may be longer than an unconnected message.
#[test]
fn a_long_assembly_is_read_over_a_large_connection() {
    let mut rig = Rig::with(|config| {
        config.assembly = Some(Assemblies::new(Layout::shipped("mixed").unwrap(), 16).unwrap())
    });
    let client = rig.client(1);
    let size = usize::from(rig.adapter.config().assembly.as_ref().unwrap().t_to_o_size()) - 2;
    assert_eq!(size, 16 * 40);
    let get = message(Service::GET_ATTRIBUTE_SINGLE, &[0x20, 4, 0x24, 100, 0x30, 3], &[]);
    let data: Vec<u8> = (0..size).map(|place| place.to_le_bytes()[0]).collect();
    let large = ForwardOpen {
        large: true,
        o_to_t: point_to_point(1_000),
        t_to_o: point_to_point(1_000),
        ..explicit_open(1)
    };
    let large = ForwardOpenReply::parse(&rig.ask(client, &open_message(&large)).data).unwrap().o_to_t_id;
    rig.send_connected(client, large, 1, &get);
    rig.device_answers(&data);
    let answer = rig.connected_reply(client).2;
    assert_eq!((answer.status, answer.data), (0, data.clone()));
    let small = rig.open_explicit(client, 2);
    rig.send_connected(client, small, 1, &get);
    rig.device_answers(&data);
    assert_eq!(rig.connected_reply(client).2.outcome(), (0x11, 0));
    rig.send_unconnected(client, &get);
    rig.device_answers(&data);
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0x11, 0));
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
