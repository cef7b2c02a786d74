//! The Forward_Open of a device with the fixed connection format.

use super::rig::*;
use crate::device::motion_link::MotionRequest;
use crate::wire::forward_open::ForwardOpen;
use crate::wire::motion::Format;
use crate::wire::network_parameters::{ConnectionType, NetworkParameters};

fn fixed(size: u16) -> NetworkParameters {
    NetworkParameters { variable: false, ..point_to_point(size) }
}

#[test]
fn a_fixed_device_takes_eighteen_octets_of_fixed_size_each_way_and_nothing_else() {
    let mut rig = Rig::with(|config| config.motion.format = Format::Fixed);
    let client = rig.client(1);
    let good = ForwardOpen { o_to_t: fixed(18), t_to_o: fixed(18), ..motion_open(1) };
    let multicast = NetworkParameters { connection_type: ConnectionType::MULTICAST, ..fixed(18) };
    // General status, then the extended status: what is wrong, and the size that would do.
    let cases: &[(&str, ForwardOpen<'_>, &[u16])] = &[
        ("variable format", motion_open(1), &[0x11F]),
        ("variable O->T", ForwardOpen { o_to_t: point_to_point(18), ..good }, &[0x11F]),
        ("variable T->O", ForwardOpen { t_to_o: point_to_point(18), ..good }, &[0x120]),
        ("O->T without sequence count", ForwardOpen { o_to_t: fixed(16), ..good }, &[0x127, 18]),
        ("T->O without sequence count", ForwardOpen { t_to_o: fixed(16), ..good }, &[0x128, 18]),
        ("O->T one less", ForwardOpen { o_to_t: fixed(17), ..good }, &[0x127, 18]),
        ("O->T one more", ForwardOpen { o_to_t: fixed(19), ..good }, &[0x127, 18]),
        ("T->O one less", ForwardOpen { t_to_o: fixed(17), ..good }, &[0x128, 18]),
        ("T->O one more", ForwardOpen { t_to_o: fixed(19), ..good }, &[0x128, 18]),
        ("with run/idle header", ForwardOpen { o_to_t: fixed(22), ..good }, &[0x127, 18]),
        ("O->T nothing", ForwardOpen { o_to_t: fixed(0), ..good }, &[0x127, 18]),
        ("O->T multicast", ForwardOpen { o_to_t: multicast, ..good }, &[0x123]),
        ("T->O multicast", ForwardOpen { t_to_o: multicast, ..good }, &[0x124]),
        (
            "too fast",
            ForwardOpen { o_to_t_rpi_us: 999, t_to_o_rpi_us: 999, ..good },
            &[0x111, 1000, 0, 1000, 0],
        ),
    ];
    for (name, open, extended) in cases {
        let answer = rig.refused(client, open);
        assert_eq!((answer.status, answer.extended.as_slice()), (1, *extended), "{name}");
    }
    let other_revision = [0x20, 0x42, 0x2C, 0x51, 0x2C, 3, 0x80, 4, 1, 0, 0, 0, 0, 0, 0, 0];
    let answer = rig.refused(client, &ForwardOpen { path: &other_revision, ..good });
    assert_eq!(answer.outcome(), (1, 0x12F), "the connection point is the revision, for both formats");

    rig.send_unconnected(client, &open_message(&good));
    let open = rig.device_opens();
    assert_eq!((open.o_to_t_size, open.t_to_o_size), (18, 18));
    assert!(!open.o_to_t_variable && !open.t_to_o_variable);
    assert_eq!(rig.unconnected_reply(client).0.outcome(), (0, 0));
}

#[test]
fn a_large_forward_open_of_the_fixed_format_is_as_good() {
    let mut rig = Rig::with(|config| config.motion.format = Format::Fixed);
    let client = rig.client(1);
    let good = ForwardOpen { large: true, o_to_t: fixed(18), t_to_o: fixed(18), ..motion_open(1) };
    rig.send_unconnected(client, &open_message(&good));
    assert!(matches!(rig.motion_request(), MotionRequest::Open(open) if open.o_to_t_size == 18));
}

#[test]
fn a_variable_device_refuses_the_fixed_format() {
    let mut rig = Rig::new();
    let client = rig.client(1);
    let open = ForwardOpen { o_to_t: fixed(18), t_to_o: fixed(18), ..motion_open(1) };
    let answer = rig.refused(client, &open);
    assert_eq!((answer.status, answer.extended.as_slice()), (1, &[0x11F][..]));
}
