//! Frames that nobody would send, in numbers: nobody panics, nobody moves, and a network that is left alone afterwards works.

use profile_generic::can::{Frame, Id};
use profile_generic::time::DurationNs;
use proptest::prelude::*;

use super::rig::{Net, Node, mac, motion, motion_drive, ms, slave_config, speed, speed_drive};
use crate::devicenet::connection::ConnectionKind;
use crate::devicenet::master::Master;
use crate::devicenet::master::station::Phase;
use crate::devicenet::slave::{Slave, SlaveConfig};
use crate::devicenet::wire::Identifier;

fn frame() -> impl Strategy<Value = (u16, Vec<u8>)> {
    // Mostly identifiers that somebody listens to.
    let known = prop_oneof![
        Just(Identifier::ExplicitRequest(mac(9))),
        Just(Identifier::UnconnectedRequest(mac(9))),
        Just(Identifier::PollCommand(mac(9))),
        Just(Identifier::ExplicitResponse(mac(9))),
        Just(Identifier::PollResponse(mac(9))),
        Just(Identifier::DuplicateMacCheck(mac(40))),
    ]
    .prop_map(Identifier::bits);
    let identifier = prop_oneof![4 => known, 1 => 0_u16..0x800];
    // Bytes that mean something at their places are frequent.
    let byte = prop_oneof![
        any::<u8>(),
        Just(0x01_u8),
        Just(0x0A),
        Just(0x4B),
        Just(0x4C),
        Just(0x0E),
        Just(0x10),
        Just(0x81),
        Just(3),
        Just(5)
    ];
    (identifier, prop::collection::vec(byte, 0..=8))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_slave_bears_any_frames(frames in prop::collection::vec(frame(), 1..120)) {
        let mut slave = Slave::new(slave_config(9), speed_drive(21));
        slave.start(ms(0));
        let mut now = 0;
        for millis in 0..2100 {
            now = millis;
            while slave.poll(ms(now)).is_some() {}
        }
        for (bits, data) in frames {
            now += 1;
            let _ = slave.handle_frame(ms(now), &Frame::new(Id::Standard(bits), &data).unwrap());
            let mut sent = 0;
            while slave.poll(ms(now)).is_some() {
                sent += 1;
                prop_assert!(sent < 100);
            }
            while slave.poll_event().is_some() {}
        }
        // Whatever was said, the watchdogs end it.
        for _ in 0..40 {
            now += 1000;
            while slave.poll(ms(now)).is_some() {}
        }
        prop_assert_eq!(slave.application().actual().velocity.0, 0);
    }

    #[test]
    fn a_master_bears_any_frames(frames in prop::collection::vec(frame(), 1..120)) {
        let mut config = super::rig::master_config();
        config.slaves = vec![speed(9, 21).0, motion(12).0];
        let mut master = Master::new(config).unwrap();
        master.start(ms(0));
        let mut now = 0;
        for (bits, data) in frames {
            now += 40;
            let _ = master.handle_frame(ms(now), &Frame::new(Id::Standard(bits), &data).unwrap());
            let mut sent = 0;
            while master.poll(ms(now)).is_some() {
                sent += 1;
                prop_assert!(sent < 100);
            }
            while master.poll_event().is_some() {}
            let _ = master.consumer(mac(9), ConnectionKind::Poll).map(|consumer| consumer.data.len());
        }
    }
}

#[test]
fn a_network_recovers_from_a_babbling_node() {
    let config = |number| SlaveConfig { bus_off_reset: true, ..slave_config(number) };
    let slaves = vec![
        (speed(9, 21).0, Node::Speed(Slave::new(config(9), speed_drive(21)))),
        (motion(12).0, Node::Motion(Slave::new(config(12), motion_drive()))),
    ];
    let mut net = Net::configured(|config| config.bus_off_reset = true, slaves);
    // Who is driven off the bus comes back.
    net.bus.set_restart(Some(DurationNs::from_millis(100)));
    net.exchange();
    let dumb = net.add(Node::Dumb);
    let mut state = 12_345_u32;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.to_be_bytes()
    };
    let mut said = 0;
    for _ in 0..2000 {
        let [a, b, len, c] = random();
        let identifier = match a % 6 {
            0 => Identifier::PollResponse(mac(9)),
            1 => Identifier::ExplicitResponse(mac(12)),
            2 => Identifier::PollCommand(mac(12)),
            3 => Identifier::ExplicitRequest(mac(9)),
            4 => Identifier::UnconnectedRequest(mac(9)),
            _ => Identifier::ChangeOfState(mac(9)),
        };
        let data = [b, c, a, b, c, a, b, c];
        let frame = Frame::new(identifier.can(), &data[..usize::from(len % 9)]).unwrap();
        let (now, station) = (net.now, net.station(dumb));
        // It talks in the name of others, so that it collides with them and goes off the bus now and then.
        said += u32::from(net.bus.send(now, station, &frame).is_ok());
        net.run_for(1);
    }
    assert!(said > 500, "{said}");
    assert_eq!(net.speed(1).application().actual().velocity.0, 0, "nothing moves");
    assert_eq!(net.motion(2).application().actual().velocity.0, 0);
    net.run_for(25_000);
    net.exchange();
    net.run_for(100);
    for slave in [9, 12] {
        assert_eq!(net.master().phase(mac(slave)), Some(Phase::Exchange));
    }
}
