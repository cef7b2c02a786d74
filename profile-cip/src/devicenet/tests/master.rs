//! The master against slaves and a bus that do not do as they should: it says who and what, and everybody else goes on.

use profile_generic::can::bus::{Effect, State};
use profile_generic::can::{Frame, Id};
use profile_generic::time::DurationNs;

use super::rig::{
    MASTER, Net, Node, mac, master_config, motion, motion_drive, refusals, slave_config, speed,
};
use crate::devicenet::access::AccessState;
use crate::devicenet::connection::{ConnectionKind, ConnectionState};
use crate::devicenet::master::Master;
use crate::devicenet::master::SubmitError;
use crate::devicenet::master::config::{
    ConfigError, DataRate, ExpectedIdentity, IoConfig, SlaveConfig as Planned,
};
use crate::devicenet::master::event::{Event, ExplicitRequest, Outcome};
use crate::devicenet::master::station::Phase;
use crate::devicenet::slave::{Slave, SlaveConfig};
use crate::devicenet::wire::{BodyFormat, Identifier};
use crate::wire::status::Service;

const POLL: ConnectionKind = ConnectionKind::Poll;

/// Two velocity drives, 9 (node 1) and 12 (node 2), exchanged with.
fn two() -> Net {
    let mut net = Net::with(vec![speed(9, 21), speed(12, 21)]);
    net.exchange();
    net.run_for(100);
    net
}

/// The drive with MAC ID 12 has been exchanged with all the time.
fn undisturbed(net: &mut Net) {
    assert_eq!(net.master().phase(mac(12)), Some(Phase::Exchange), "{}", net.text());
    assert!(
        !net.log.iter().any(|(_, who, text)| *who == 0
            && text.starts_with("slave 12:")
            && !text.ends_with("exchanging")),
        "{}",
        net.text()
    );
    assert_eq!(net.speed(2).connection(POLL).state(), ConnectionState::ESTABLISHED);
    let before = net.master().statistics().received;
    net.run_for(50);
    assert!(net.master().statistics().received >= before + 4);
    assert!(net.master().consumer(mac(12), POLL).unwrap().missed <= 1);
}

#[test]
fn configurations_that_cannot_be() {
    let slave = |number, one: IoConfig| {
        let mut slave = Planned::polled(mac(number), 0, 0, 100);
        slave.connections.clear();
        slave.connections.push(one);
        slave
    };
    let poll = |output, input, rate| IoConfig::poll(output, input, rate);
    let other = |kind, output, input| IoConfig { kind, ..poll(output, input, 100) };
    let with = |slaves: Vec<Planned>| {
        let mut config = master_config();
        config.slaves = slaves;
        config.check().map_err(|error| error.to_string())
    };
    assert_eq!(with(vec![Planned::polled(mac(9), 16, 16, 10)]), Ok(()));
    let refused = [
        (vec![slave(1, poll(4, 4, 10))], "MAC ID 1 is given twice"),
        (vec![slave(9, poll(4, 4, 10)), slave(9, poll(4, 4, 10))], "MAC ID 9 is given twice"),
        (
            vec![slave(9, poll(65, 4, 10))],
            "slave 9, poll connection: expected output of at most 64 bytes, got 65",
        ),
        (
            vec![slave(9, other(ConnectionKind::BitStrobe, 2, 1))],
            "slave 9, bit strobe connection: expected output of at most 1 bytes, got 2",
        ),
        (
            vec![slave(9, other(ConnectionKind::BitStrobe, 1, 9))],
            "slave 9, bit strobe connection: expected input of at most 8 bytes, got 9",
        ),
        (
            vec![slave(9, other(ConnectionKind::ChangeOfState, 1, 1))],
            "slave 9, change of state connection: expected output of at most 0 bytes, got 1",
        ),
        (
            vec![slave(9, other(ConnectionKind::Explicit, 1, 1))],
            "slave 9: the explicit connection needs no configuration",
        ),
        (
            vec![slave(9, poll(4, 4, 0))],
            "slave 9, poll connection: expected a packet rate of 1 ms or more, got 0",
        ),
        (
            vec![slave(9, poll(4, 4, 4))],
            "slave 9, poll connection: the watchdog of 16 ms is shorter than two polls, 10 ms apart",
        ),
    ];
    for (slaves, text) in refused {
        assert_eq!(with(slaves), Err(text.to_owned()));
    }
    assert_eq!(with(vec![Planned::explicit(mac(9))]), Ok(()));
    let mut twice = Planned::polled(mac(9), 4, 4, 10);
    twice.connections.push(poll(4, 4, 10));
    assert_eq!(with(vec![twice]), Err("slave 9: two of the kind poll connection".to_owned()));
    // 63 drives with 16 bytes each way do not fit 10 ms at 500 kbit/s; at 50 ms eight of them fit 125 kbit/s.
    let many =
        |count: u8| (0..count).map(|number| Planned::polled(mac(number + 2), 16, 16, 25)).collect::<Vec<_>>();
    assert!(
        with(many(60)).unwrap_err().starts_with("the I/O messages of a cycle take "),
        "{:?}",
        with(many(60))
    );
    let mut slow = master_config();
    (slow.rate, slow.cycle, slow.slaves) = (DataRate::Rate125, DurationNs::from_millis(50), many(8));
    assert_eq!(slow.check(), Ok(()));
    slow.slaves = many(12);
    assert!(matches!(slow.check(), Err(ConfigError::Load { .. })));
    slow.cycle = DurationNs::ZERO;
    assert_eq!(slow.check(), Err(ConfigError::Cycle(DurationNs::ZERO)));
}

#[test]
fn a_slave_that_is_not_there_is_told_once_and_taken_when_it_comes() {
    let mut net = Net::new();
    let mut config = master_config();
    config.slaves = vec![speed(9, 21).0, speed(12, 21).0];
    net.add(Node::Master(Master::new(config).unwrap()));
    net.add(Node::Dumb);
    net.add(speed(12, 21).1);
    net.run_for(12_000);
    let told = net.log.iter().filter(|(_, _, text)| text == "slave 9: no answer (allocate)").count();
    assert_eq!(told, 1, "{}", net.text());
    undisturbed(&mut net);
    net.add(speed(9, 21).1);
    net.exchange();
    undisturbed(&mut net);
}

#[test]
fn a_slave_that_another_master_has_is_left_alone_until_it_is_free() {
    let mut net = Net::with(vec![speed(9, 21), speed(12, 21)]);
    let now = net.now;
    net.master().stop(now);
    let mut config = master_config();
    (config.mac, config.serial, config.slaves) = (mac(2), 5, vec![speed(9, 21).0]);
    let other = net.add(Node::Master(Master::new(config).unwrap()));
    net.run_for(2100);
    assert_eq!(net.speed(1).master(), Some(mac(2)), "{}", net.text());
    let now = net.now;
    net.master().start(now);
    net.run_for(5000);
    let text = "slave 9: another master polls it: MAC ID 2";
    let told = net.log.iter().filter(|(_, who, said)| *who == 0 && said == text).count();
    assert_eq!(told, 1, "{}", net.text());
    assert!(!net.said(0, "slave 9: another master has it"), "it was not even asked for: {}", net.text());
    assert_eq!(net.speed(1).master(), Some(mac(2)));
    assert!(!net.said(1, "released"), "{}", net.text());
    undisturbed(&mut net);
    net.plug(other, false);
    // The slave keeps the other one's explicit connection for ten seconds.
    net.run_for(20_000);
    assert_eq!(net.speed(1).master(), Some(MASTER), "{}", net.text());
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange));
    undisturbed(&mut net);
}

/// Lets somebody poll a slave.
fn poll(net: &mut Net, from: usize, slave: u8) {
    net.inject(from, Identifier::PollCommand(mac(slave)), &[0; 4]);
}

#[test]
fn a_slave_that_somebody_polls_is_not_asked_for_before_he_has_ended() {
    let mut net = Net::new();
    let mut config = master_config();
    config.slaves = vec![speed(9, 21).0, speed(12, 21).0];
    net.add(Node::Master(Master::new(config).unwrap()));
    net.add(speed(9, 21).1);
    net.add(speed(12, 21).1);
    let other = net.add(Node::Dumb);
    // From the duplicate MAC ID check on, a poll every second.
    for _ in 0..8 {
        poll(&mut net, other, 9);
        net.run_for(1_000);
    }
    assert_eq!(net.speed(1).master(), None, "{}", net.text());
    let text = "slave 9: another master polls it, whose MAC ID is not known";
    assert_eq!(net.log.iter().filter(|(_, who, said)| *who == 0 && said == text).count(), 1);
    undisturbed(&mut net);
    net.run_for(500);
    assert_eq!(net.speed(1).master(), Some(MASTER), "{}", net.text());
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange));
}

#[test]
fn a_slave_that_somebody_else_polls_beside_its_master_is_left_to_him_once_its_axis_stands() {
    let mut net = two();
    let other = net.add(Node::Dumb);
    // One poll is a stray.
    for _ in 0..3 {
        poll(&mut net, other, 9);
        net.run_for(1_200);
    }
    assert!(!net.text().contains("another master") && !net.master().has_other_master(mac(9)));
    for _ in 0..3 {
        poll(&mut net, other, 9);
        net.run_for(100);
    }
    let text = "slave 9: another master polls it, whose MAC ID is not known";
    assert_eq!(net.log.iter().filter(|(_, _, said)| said == text).count(), 1);
    assert!(net.master().has_other_master(mac(9)) && !net.master().has_other_master(mac(12)));
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange), "the axis is stopped first");
    let now = net.now;
    net.master().give_way(now, mac(12));
    net.master().give_way(now, mac(9));
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Waiting));
    for _ in 0..30 {
        poll(&mut net, other, 9);
        net.run_for(100);
    }
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Waiting), "{}", net.text());
    undisturbed(&mut net);
    net.run_for(20_000);
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange), "{}", net.text());
    assert!(!net.master().has_other_master(mac(9)));
    undisturbed(&mut net);
}

#[test]
fn a_slave_that_is_another_device_than_expected() {
    let (mut planned, node) = speed(9, 21);
    planned.identity = ExpectedIdentity { product_code: Some(43), ..ExpectedIdentity::default() };
    let mut net = Net::with(vec![(planned, node), speed(12, 21)]);
    net.run_for(6000);
    assert!(net.said(0, "slave 9: product code: expected 0x002b, found 0x002a"), "{}", net.text());
    assert!(net.said(1, "free for any master"), "it is given back");
    assert_eq!(net.log.iter().filter(|(_, _, text)| text.starts_with("slave 9:")).count(), 1, "told once");
    undisturbed(&mut net);
}

#[test]
fn a_slave_whose_messages_have_another_length_than_expected() {
    let (mut planned, node) = speed(9, 21);
    planned.connections[0].input = 6;
    let mut net = Net::with(vec![(planned, node), speed(12, 21)]);
    net.run_for(6000);
    assert!(net.said(0, "slave 9: poll connection: expected 6 bytes produced, found 4"), "{}", net.text());
    undisturbed(&mut net);
}

#[test]
fn a_slave_that_has_not_what_is_wanted() {
    let (mut planned, node) = speed(9, 21);
    planned.connections[0] = IoConfig { kind: ConnectionKind::BitStrobe, ..IoConfig::poll(1, 4, 50) };
    let mut net = Net::with(vec![(planned, node), speed(12, 21)]);
    net.run_for(6000);
    assert!(
        net.said(0, "slave 9: refuses (allocate): resource unavailable, additional code 0x02"),
        "{}",
        net.text()
    );
    undisturbed(&mut net);
}

#[test]
fn a_slave_that_another_run_of_the_master_has_left_behind_is_given_back_and_taken_anew() {
    let mut net = two();
    // The master starts anew, and nothing has told the slaves.
    let now = net.now;
    net.master().start(now);
    net.run_for(2050);
    net.exchange();
    net.run_for(100);
    for node in [1, 2] {
        assert!(net.said(node, "released: explicit, poll"), "{}", net.text());
    }
    net.log.clear();
    undisturbed(&mut net);
}

#[test]
fn poll_responses_of_a_wrong_length_are_not_looked_at() {
    let mut net = two();
    net.plug(1, false);
    let dumb = net.add(Node::Dumb);
    for len in [1, 2, 3, 5, 8] {
        net.inject(dumb, Identifier::PollResponse(mac(9)), &[0xFF; 8][..len]);
        net.run_for(2);
        assert_eq!(net.master().consumer(mac(9), POLL).unwrap().data, [], "{len}");
    }
    let said = refusals(&net, 0);
    assert_eq!(said.len(), 5, "{said:#?}");
    assert!(said[0].contains("poll response, MAC ID 9: expected 4 bytes, got 1"), "{said:#?}");
    assert!(said[4].contains("the message has more than 4 bytes"), "{said:#?}");
    net.run_for(50);
    assert!(net.said(0, "slave 9: poll connection: 3 answers in a row are missing"), "{}", net.text());
    net.bus.pardon();
    undisturbed(&mut net);
}

#[test]
fn fragments_of_a_poll_response_out_of_order_are_dropped() {
    let mut net = Net::with(vec![motion(9), speed(12, 21)]);
    net.exchange();
    net.run_for(100);
    let master = net.station(0);
    commit_and_run(&mut net, 30);
    // The second of three fragments is lost, once: the message is dropped, the next one counts.
    net.disturb(Effect::Lose, |one| {
        one.to(master).id(Identifier::PollResponse(mac(9)).can()).skip(1).count(1)
    });
    commit_and_run(&mut net, 30);
    let said = refusals(&net, 0);
    assert!(
        said.iter().any(|text| text.contains("poll response, MAC ID 9: expected fragment 1, got 2")),
        "{said:#?}"
    );
    commit_and_run(&mut net, 30);
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange), "one missing answer is borne");
    assert_eq!(net.master().consumer(mac(9), POLL).unwrap().missed, 0);
    // A fragment that comes twice: the same.
    net.disturb(Effect::Double, |one| {
        one.to(master).id(Identifier::PollResponse(mac(9)).can()).skip(1).count(1)
    });
    commit_and_run(&mut net, 60);
    assert!(
        refusals(&net, 0).iter().any(|text| text.contains("expected fragment 2, got 1")),
        "{}",
        net.text()
    );
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange));
    undisturbed(&mut net);
}

/// Commands for the motion drive with MAC ID 9, so that it has something to answer.
fn commit_and_run(net: &mut Net, millis: i64) {
    use crate::devicenet::master::motion::{MotionEnd, SetPoint, Watched};
    let mut end = MotionEnd::new(SetPoint::Velocity(0.0), Watched::Velocity);
    let (mut cycle, until) = (0, net.now + DurationNs::from_millis(millis));
    net.run_with(until, |net| {
        let now = net.master().statistics().cycles;
        if now != cycle {
            cycle = now;
            end.sent();
            end.emit(net.master().producer(mac(9), POLL).unwrap()).unwrap();
            net.master().commit(mac(9), POLL);
        }
    });
}

#[test]
fn fragments_of_a_poll_command_out_of_order_command_nothing() {
    let mut net = Net::with(vec![motion(9), speed(12, 21)]);
    net.exchange();
    commit_and_run(&mut net, 50);
    let slave = net.station(1);
    net.disturb(Effect::Lose, |one| one.to(slave).id(Identifier::PollCommand(mac(9)).can()).skip(1).count(1));
    commit_and_run(&mut net, 30);
    let said = refusals(&net, 1);
    assert!(
        said.iter().any(|text| text.contains("poll command, MAC ID 9: expected fragment 1, got 2")),
        "{said:#?}"
    );
    assert_eq!(net.motion(1).application().device().counters().malformed, 0);
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange));
    undisturbed(&mut net);
}

#[test]
fn messages_that_nobody_asked_for() {
    let mut net = two();
    let dumb = net.add(Node::Dumb);
    net.inject(dumb, Identifier::ExplicitResponse(mac(9)), &[0x01, 0x8E, 1, 2]);
    net.inject(dumb, Identifier::ExplicitResponse(mac(9)), &[0x41, 0x8E, 1, 2]);
    net.inject(dumb, Identifier::ExplicitResponse(mac(9)), &[]);
    net.inject(dumb, Identifier::ExplicitResponse(mac(9)), &[0x81, 0xC0, 0]);
    net.inject(dumb, Identifier::BitStrobeResponse(mac(9)), &[1]);
    net.inject(dumb, Identifier::ChangeOfState(mac(9)), &[1]);
    // Not for this master, and nobody's business.
    net.inject(dumb, Identifier::ExplicitResponse(mac(9)), &[0x05, 0x8E, 1, 2]);
    net.inject(dumb, Identifier::PollResponse(mac(50)), &[1, 2]);
    net.inject(dumb, Identifier::Group3 { message: 1, source: mac(50) }, &[1, 2]);
    net.run_for(20);
    let said = refusals(&net, 0);
    assert_eq!(said.len(), 6, "{said:#?}");
    assert_eq!(said.iter().filter(|text| text.ends_with("nothing was asked")).count(), 3, "{said:#?}");
    assert_eq!(
        said.iter().filter(|text| text.ends_with("there is no such connection now")).count(),
        2,
        "{said:#?}"
    );
    net.bus.pardon();
    undisturbed(&mut net);
}

#[test]
fn frames_that_are_none_of_devicenet() {
    let mut net = two();
    let now = net.now;
    let frames = [
        Frame::new(Id::Extended(0x44B), &[0; 8]).unwrap(),
        Frame::remote(Id::Standard(0x44B), 8).unwrap(),
        Frame::fd(Id::Standard(0x44B), &[0; 8], false).unwrap(),
        Frame::new(Id::Standard(0x7FF), &[0; 8]).unwrap(),
    ];
    for frame in frames {
        assert!(net.master().handle_frame(now, &frame).is_err());
        assert!(net.speed(1).handle_frame(now, &frame).is_err());
    }
    undisturbed(&mut net);
}

#[test]
fn an_explicit_answer_that_is_lost_is_asked_for_once_more_and_then_given_up() {
    let mut net = two();
    net.run_for(100);
    let response = Identifier::ExplicitResponse(mac(9)).can();
    let master = net.station(0);
    net.disturb(Effect::Lose, |one| one.to(master).id(response).count(1));
    let first = net.master().submit(mac(9), ExplicitRequest::get(1, 1, 1)).unwrap();
    net.run_for(4000);
    let outcome = |net: &Net, ticket| {
        net.events.iter().find_map(|event| match event {
            Event::Explicit { ticket: of, outcome } if *of == ticket => Some(outcome.clone()),
            _ => None,
        })
    };
    assert_eq!(
        outcome(&net, first),
        Some(Outcome::Done([0x23, 0x01].into_iter().collect())),
        "{}",
        net.text()
    );
    net.disturb(Effect::Lose, |one| one.to(master).id(response).count(2));
    let second = net.master().submit(mac(9), ExplicitRequest::get(1, 1, 1)).unwrap();
    let third = net.master().submit(mac(9), ExplicitRequest::get(1, 1, 2)).unwrap();
    net.run_for(8000);
    assert_eq!(outcome(&net, second), Some(Outcome::NoAnswer));
    assert_eq!(
        outcome(&net, third),
        Some(Outcome::Done([0x25, 0x00].into_iter().collect())),
        "and the next is asked"
    );
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange), "the I/O has not noticed");
    undisturbed(&mut net);
}

/// Without I/O connections a slave is asked, and nothing of it is polled. It stays allocated while nobody asks, and is given back.
#[test]
fn a_slave_without_io_connections_is_asked_and_given_back() {
    let slave = Node::Motion(Slave::new(slave_config(9), motion_drive()));
    let mut net = Net::with(vec![(Planned::explicit(mac(9)), slave)]);
    net.trace = Some(Vec::new());
    net.run_for(15_000);
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange), "{}", net.text());
    let explicit = net.motion(1).connection(ConnectionKind::Explicit).state();
    assert_eq!(explicit, ConnectionState::ESTABLISHED);
    assert_eq!(net.motion(1).connection(POLL).state(), ConnectionState::NON_EXISTENT);
    let ticket = net.master().submit(mac(9), ExplicitRequest::get(1, 1, 1)).unwrap();
    net.run_for(100);
    let vendor = Outcome::Done([0x23, 0x01].into_iter().collect());
    assert!(net.events.contains(&Event::Explicit { ticket, outcome: vendor }), "{}", net.text());
    let now = net.now;
    net.master().stop(now);
    net.run_for(100);
    assert_eq!(net.motion(1).master(), None, "{}", net.text());
    let poll = Identifier::PollCommand(mac(9)).can();
    assert!(net.trace.unwrap().iter().all(|(_, frame)| frame.id() != poll));
}

#[test]
fn the_xid_of_every_request_is_another_than_that_of_the_one_before() {
    let mut net = two();
    net.run_for(100);
    net.trace = Some(Vec::new());
    for _ in 0..4 {
        net.master().submit(mac(9), ExplicitRequest::get(1, 1, 1)).unwrap();
    }
    net.run_for(50);
    let asked = Identifier::ExplicitRequest(mac(9)).can();
    let trace = net.trace.take().unwrap();
    let headers: Vec<u8> =
        trace.iter().filter(|(_, frame)| frame.id() == asked).map(|(_, frame)| frame.data()[0]).collect();
    assert_eq!(headers.len(), 4);
    assert!(headers.windows(2).all(|pair| pair[0] ^ pair[1] == 0x40), "{headers:02x?}");
}

#[test]
fn explicit_answers_that_cannot_be_read() {
    let mut net = two();
    net.run_for(100);
    let response = Identifier::ExplicitResponse(mac(9));
    // The slave's own answers are lost, and somebody says something else in its name.
    let (station, dumb) = (net.station(1), net.add(Node::Dumb));
    let mut said = Vec::new();
    for body in [&[0x94, 8][..], &[0x0E, 1], &[0x90, 1], &[]] {
        net.disturb(Effect::Lose, |one| one.from(station).id(response.can()));
        net.log.clear();
        net.master().submit(mac(9), ExplicitRequest::get(1, 1, 1)).unwrap();
        net.run_for(3);
        // One of them is the XID of the request.
        for header in [0x01, 0x41] {
            net.inject(dumb, response, &[&[header], body].concat());
        }
        net.run_for(3);
        let ends =
            net.log.iter().filter(|(_, _, text)| text.starts_with("slave 9: the answer cannot be read"));
        said.extend(ends.map(|(_, _, text)| text.clone()));
        net.bus.calm();
        net.run_for(10);
    }
    insta::assert_snapshot!(said.join("\n"));
    net.bus.pardon();
    net.log.clear();
    undisturbed(&mut net);
}

#[test]
fn a_request_in_fragments_whose_acknowledge_is_lost() {
    let mut net = two();
    let long = || ExplicitRequest::new(Service::GET_ATTRIBUTE_LIST, 1, 1, &[3, 0, 1, 0, 2, 0, 3, 0]).unwrap();
    let master = net.station(0);
    for lost in 0..6 {
        let response = Identifier::ExplicitResponse(mac(9)).can();
        net.disturb(Effect::Lose, |one| one.to(master).id(response).skip(lost).count(1));
        net.events.clear();
        net.master().submit(mac(9), long()).unwrap();
        net.run_for(6000);
        net.bus.calm();
        let done = net.events.iter().any(|event| {
            matches!(event, Event::Explicit { outcome: Outcome::Done(data), .. } if data.len() == 2 + 3 * 6)
        });
        assert!(done, "response frame {lost} lost\n{}", net.text());
    }
    undisturbed(&mut net);
}

#[test]
fn a_request_whose_fragments_nobody_acknowledges_is_given_up() {
    let mut net = two();
    let long = ExplicitRequest::new(Service::GET_ATTRIBUTE_LIST, 1, 1, &[3, 0, 1, 0, 2, 0, 3, 0]).unwrap();
    let master = net.station(0);
    net.disturb(Effect::Lose, |one| one.to(master).id(Identifier::ExplicitResponse(mac(9)).can()).count(2));
    net.master().submit(mac(9), long).unwrap();
    net.run_for(3000);
    assert!(net.said(0, "slave 9: not taken: fragment 0 was not acknowledged"), "{}", net.text());
    undisturbed(&mut net);
}

#[test]
fn requests_that_are_not_taken() {
    let mut net = two();
    let get = || ExplicitRequest::get(1, 1, 1);
    assert_eq!(net.master().submit(mac(40), get()), Err(SubmitError::NoSlave));
    for _ in 0..4 {
        net.master().submit(mac(9), get()).unwrap();
    }
    assert_eq!(net.master().submit(mac(9), get()), Err(SubmitError::Full));
    net.plug(1, false);
    net.run_for(200);
    assert_eq!(net.master().submit(mac(9), get()), Err(SubmitError::NotExchanging));
    let lost = net.log.iter().filter(|(_, _, text)| text == "slave 9: the slave was lost").count();
    assert_eq!(lost, 4, "every request has an end: {}", net.text());
    assert!(!net.master().commit(mac(9), POLL), "and no command is kept for later");
    assert!(ExplicitRequest::new(Service(1), 1, 1, &[0; 508]).is_none());
    undisturbed(&mut net);
}

#[test]
fn a_request_that_does_not_fit_the_slaves_format_ends_at_once() {
    let mut net = two();
    net.master().submit(mac(9), ExplicitRequest::get(0x342, 1, 1)).unwrap();
    net.run_for(10);
    assert!(
        net.said(0, "class in this message body format: expected at most 255, found 834"),
        "{}",
        net.text()
    );
    undisturbed(&mut net);
}

#[test]
fn a_slave_of_another_format_is_spoken_to_in_it() {
    let config = SlaveConfig { body_format: BodyFormat::CLASS_8_INSTANCE_16, ..slave_config(9) };
    let slave = Node::Motion(Slave::new(config, motion_drive()));
    let mut net = Net::with(vec![(Planned::polled(mac(9), 16, 16, 10), slave)]);
    // Allocation goes in 8/8, and a slave that insists on something else even there is told of.
    net.run_for(4000);
    assert!(
        net.said(1, "frame refused") || net.master().phase(mac(9)) == Some(Phase::Exchange),
        "{}",
        net.text()
    );
}

#[test]
fn an_explicit_connection_that_has_gone_is_allocated_again_while_the_io_goes_on() {
    let mut net = two();
    let asked = net.speed(1).config().mac;
    // No explicit request arrives for eleven seconds: the slave's explicit connection deletes itself.
    net.disturb(Effect::Lose, |one| one.id(Identifier::ExplicitRequest(asked).can()));
    net.disturb(Effect::Lose, |one| one.id(Identifier::UnconnectedRequest(asked).can()));
    net.run_for(12_000);
    assert!(net.said(1, "explicit connection: established -> non-existent"), "{}", net.text());
    assert_eq!(net.speed(1).connection(POLL).state(), ConnectionState::ESTABLISHED);
    net.bus.calm();
    net.run_for(8000);
    assert!(net.said(1, "explicit connection: non-existent -> established"), "{}", net.text());
    let ticket = net.master().submit(mac(9), ExplicitRequest::get(1, 1, 1)).unwrap();
    net.run_for(50);
    assert!(net.events.iter().any(
        |event| matches!(event, Event::Explicit { ticket: of, outcome: Outcome::Done(_) } if *of == ticket)
    ));
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange));
    assert!(!net.said(0, "slave 9: poll"), "{}", net.text());
    undisturbed(&mut net);
}

#[test]
fn the_explicit_connections_live_as_long_as_the_exchange() {
    let mut net = two();
    net.run_for(60_000);
    for node in [1, 2] {
        assert_eq!(
            net.speed(node).connection(ConnectionKind::Explicit).state(),
            ConnectionState::ESTABLISHED
        );
    }
    assert_eq!(net.master().facts(mac(9)).unwrap().status, Some(0x61), "owned, an I/O connection runs");
    assert_eq!(net.master().statistics().missed, 0);
    assert_eq!(net.master().statistics().losses, 0);
    net.bus.judge();
}

#[test]
fn a_slave_that_starts_anew_is_noticed_at_once() {
    let mut net = two();
    let now = net.now;
    net.speed(1).start(now);
    net.run_for(3);
    assert!(net.said(0, "slave 9: it has started anew"), "{}", net.text());
    net.run_for(100);
    undisturbed(&mut net);
    net.exchange();
    undisturbed(&mut net);
}

#[test]
fn another_node_that_wants_a_slaves_mac_id_is_told_of_and_gets_it_not() {
    let mut net = two();
    let mut config = slave_config(9);
    config.identity.serial_number = 5;
    let intruder = net.add(Node::Motion(Slave::new(config, motion_drive())));
    net.run_for(100);
    assert!(
        net.said(0, "slave 9: another node wants its MAC ID: vendor 0x0123, serial 0x00000005"),
        "{}",
        net.text()
    );
    assert_eq!(net.motion(intruder).access(), AccessState::Faulted);
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Exchange));
    net.run_for(3000);
    assert_eq!(net.speed(1).access(), AccessState::Online);
    net.bus.judge();
    undisturbed(&mut net);
}

#[test]
fn the_masters_mac_id_is_taken_by_somebody_who_was_there_first() {
    let mut net = Net::new();
    net.add(Node::Dumb);
    let mut config = slave_config(1);
    config.identity.serial_number = 5;
    net.add(Node::Motion(Slave::new(config, motion_drive())));
    net.run_for(2500);
    let now = net.now;
    let mut master = Master::new(master_config()).unwrap();
    master.start(now);
    let request = master.poll(now).unwrap();
    net.motion(1).handle_frame(now, &request).unwrap();
    let answer = net.motion(1).poll(now).unwrap();
    let refusal = master.handle_frame(now, &answer).unwrap_err().to_string();
    assert_eq!(refusal, "duplicate MAC ID 1: vendor 0x0123, serial 0x00000005");
    assert_eq!(master.access(), AccessState::Faulted);
    assert_eq!(master.poll_event(), Some(Event::DuplicateMac { mac: MASTER, vendor: 0x0123, serial: 5 }));
    assert_eq!((master.poll(now), master.wake_at()), (None, None), "it says nothing any more");
    master.start(now);
    assert!(master.poll(now).is_some(), "until it is started again");
}

#[test]
fn two_segments_that_are_joined_show_the_duplicate_and_every_drive_stops() {
    let mut net = two();
    let dumb = net.add(Node::Dumb);
    net.inject(dumb, Identifier::DuplicateMacCheck(MASTER), &[0x80, 1, 0, 2, 0, 0, 0]);
    net.run_for(1);
    assert_eq!(net.master().access(), AccessState::Faulted, "{}", net.text());
    for (slave, node) in [(9, 1), (12, 2)] {
        assert_eq!(net.master().phase(mac(slave)), Some(Phase::Waiting));
        assert!(net.said(0, &format!("slave {slave}: the master has left the network")));
        assert_eq!(net.speed(node).connection(POLL).state(), ConnectionState::ESTABLISHED);
    }
    net.run_for(250);
    for node in [1, 2] {
        assert_eq!(net.speed(node).connection(POLL).state(), ConnectionState::TIMED_OUT);
    }
}

#[test]
fn a_slave_that_goes_bus_off() {
    let mut net = two();
    let (now, station) = (net.now, net.station(1));
    net.bus.take_off(now, station);
    net.run_for(100);
    assert_eq!(net.bus.state(station), State::BusOff);
    assert!(net.said(0, "slave 9: poll connection: 3 answers in a row are missing"), "{}", net.text());
    undisturbed(&mut net);
}

#[test]
fn a_master_that_goes_bus_off_begins_anew_if_it_may() {
    let mut net = Net::configured(|config| config.bus_off_reset = true, vec![speed(9, 21), speed(12, 21)]);
    net.bus.set_restart(Some(DurationNs::from_millis(100)));
    net.exchange();
    let (now, station) = (net.now, net.station(0));
    net.bus.take_off(now, station);
    net.run_for(10);
    assert!(net.said(0, "bus off"));
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Waiting));
    net.run_for(500);
    net.exchange();
    net.log.clear();
    undisturbed(&mut net);
}

#[test]
fn a_noisy_bus_costs_time_and_nothing_else() {
    let mut net = two();
    for skip in [3, 17, 40, 90, 91, 92, 150] {
        net.disturb(Effect::Spoil, |one| one.skip(skip).count(1));
    }
    net.run_for(1000);
    assert!(net.bus.traffic().errors >= 7);
    let losses = net.master().statistics().losses;
    assert_eq!(losses, 0, "{}", net.text());
    undisturbed(&mut net);
}

#[test]
fn giving_back_frees_the_slaves_and_starting_takes_them_again() {
    let mut net = two();
    let now = net.now;
    net.master().stop(now);
    net.run_for(50);
    for (slave, node) in [(9, 1), (12, 2)] {
        assert!(net.said(0, &format!("slave {slave}: given back: explicit, poll")), "{}", net.text());
        assert!(net.said(node, "free for any master"));
    }
    net.run_for(3000);
    assert_eq!(net.master().phase(mac(9)), Some(Phase::Waiting));
    let now = net.now;
    net.master().start(now);
    net.run_for(2100);
    net.exchange();
}
