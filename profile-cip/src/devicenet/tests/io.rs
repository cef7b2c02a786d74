//! Bit strobe, change of state and cyclic connections, with an application that has them all.

use profile_generic::can::bus::Effect;
use profile_generic::time::MonotonicTime;

use super::bench::Bench;
use super::rig::{MASTER, Net, Node, mac, refusals, slave_config};
use crate::device::event::ResetKind;
use crate::device::objects::identity::Health;
use crate::devicenet::connection::{Change, Connection, ConnectionKind, ConnectionSetup, ConnectionState};
use crate::devicenet::fragmentation::{Body, IoData};
use crate::devicenet::master::config::{IoConfig, SlaveConfig as Planned};
use crate::devicenet::slave::Slave;
use crate::devicenet::slave::application::{Application, ServiceError};
use crate::devicenet::slave::event::SlaveEvent;
use crate::devicenet::wire::{Identifier, MacId, Request};
use crate::wire::status::GeneralStatus;

/// Inputs and outputs, and nothing behind them.
#[derive(Debug, Default)]
pub struct Terminal {
    pub inputs: u8,
    pub changed: bool,
    /// What was consumed last, by instance number of the connection.
    pub consumed: Vec<(u8, Vec<u8>)>,
    pub states: Vec<(ConnectionKind, ConnectionState)>,
}

impl Application for Terminal {
    fn setup(&self, kind: ConnectionKind) -> Option<ConnectionSetup> {
        let sizes = |produced_size, consumed_size| {
            Some(ConnectionSetup { transport: 0x82, produced_size, consumed_size, supervised: false })
        };
        match kind {
            ConnectionKind::Explicit => None,
            ConnectionKind::Poll => sizes(12, 9),
            ConnectionKind::BitStrobe => sizes(2, 8),
            ConnectionKind::ChangeOfState => sizes(1, 0),
        }
    }

    fn paths(&self, _: ConnectionKind) -> (&[u8], &[u8]) {
        (&[], &[])
    }

    fn classes(&self) -> &[u16] {
        &[]
    }

    fn serve(
        &mut self,
        _: MonotonicTime,
        _: MacId,
        _: &Request<'_>,
        _: &mut Body,
    ) -> Result<(), ServiceError> {
        Err(GeneralStatus::OBJECT_DOES_NOT_EXIST.into())
    }

    fn consume(&mut self, _: MonotonicTime, kind: ConnectionKind, data: &[u8]) {
        self.consumed.push((kind.instance(), data.to_vec()));
    }

    fn produce(&mut self, _: MonotonicTime, kind: ConnectionKind, data: &mut IoData) {
        let len = self.setup(kind).map_or(0, |setup| setup.produced_size);
        data.extend(core::iter::repeat_n(self.inputs, usize::from(len)));
    }

    fn take_change(&mut self) -> bool {
        core::mem::take(&mut self.changed)
    }

    fn connection_changed(&mut self, _: MonotonicTime, connection: &Connection, change: Change, _: MacId) {
        self.states.push((connection.kind(), change.after));
    }

    fn handle_time(&mut self, _: MonotonicTime) {}

    fn wake_at(&self) -> Option<MonotonicTime> {
        None
    }

    fn health(&self) -> Health {
        Health::default()
    }

    fn permits_reset(&mut self, _: MonotonicTime) -> bool {
        true
    }

    fn reset(&mut self, _: ResetKind) {}
}

fn bench(choice: u8) -> Bench<Terminal> {
    let mut bench = Bench::with(slave_config(9), Terminal::default());
    assert_eq!(bench.send(0x44E, &[0x0A, 0x4B, 3, 1, choice, 0x0A]), [(0x44B, vec![0x0A, 0xCB, 0])]);
    bench
}

#[test]
fn a_bit_strobe_has_one_bit_for_each_slave() {
    let mut bench = bench(0x05);
    bench.slave.application_mut().inputs = 0x5A;
    assert_eq!(
        bench.refused(0x450, &[0; 8]),
        "bit strobe command, MAC ID 10: there is no such connection now"
    );
    assert_eq!(bench.explicit(&[0x10, 5, 3, 9, 100, 0]), [0x90, 100, 0]);
    let answer = vec![(0x389, vec![0x5A, 0x5A])];
    assert_eq!(bench.send(0x450, &[0xFF, 0xFD, 0, 0, 0, 0, 0, 0]), answer);
    assert_eq!(bench.send(0x450, &[0, 0x02, 0, 0, 0, 0, 0, 0]), answer);
    assert_eq!(bench.send(0x450, &[]), answer, "without data: nobody is commanded");
    assert_eq!(bench.slave.application().consumed, [(3, vec![0]), (3, vec![1]), (3, vec![])]);
    let short = bench.refused(0x450, &[0; 7]);
    assert_eq!(short, "bit strobe command, MAC ID 10: expected 8 bytes, got 7");
    let other = bench.refused(0x448, &[0; 8]);
    assert_eq!(other, "bit strobe command, MAC ID 9 is not for this node", "of another master");
    bench.wait(400);
    assert_eq!(bench.slave.connection(ConnectionKind::BitStrobe).state(), ConnectionState::TIMED_OUT);
}

#[test]
fn a_change_of_state_is_sent_at_once_and_again_without_acknowledge() {
    let mut bench = bench(0x11);
    assert_eq!(bench.wait(100), [], "not before it is established");
    assert_eq!(bench.explicit(&[0x0E, 5, 4, 3]), [0x8E, 0x12]);
    let (mut outcome, message) = (bench.send(0x44C, &[0x0A, 0x10, 5, 4, 9, 0xE8, 3]), vec![(0x349, vec![0])]);
    outcome.retain(|(bits, _)| *bits != 0x44B);
    // The first message tells how it is.
    outcome.extend(bench.wait(1));
    assert_eq!(outcome, message);
    assert_eq!(bench.send(0x44A, &[]), []);
    assert_eq!(
        bench.refused(0x44A, &[]),
        "change of state or cyclic acknowledge, MAC ID 9: nothing was asked"
    );
    assert_eq!(bench.wait(500), []);
    bench.slave.application_mut().inputs = 7;
    bench.slave.application_mut().changed = true;
    assert_eq!(bench.wait(0), [(0x349, vec![7])]);
    bench.events();
    assert_eq!(bench.wait(15), []);
    assert_eq!(bench.wait(1), [(0x349, vec![7])], "not acknowledged: once more");
    assert_eq!(bench.wait(30), []);
    assert!(bench.events().contains(&SlaveEvent::NoAcknowledge));
    assert_eq!(bench.wait(1000).len(), 2, "and at the rate in any case, twice without acknowledge");
    // The inhibit time keeps changes apart.
    assert_eq!(bench.explicit(&[0x10, 5, 4, 17, 50, 0]), [0x90]);
    bench.wait(100);
    let mut sent = 0;
    for _ in 0..200 {
        bench.slave.application_mut().changed = true;
        let frames = bench.wait(1);
        sent += frames.len();
        for _ in frames {
            bench.send(0x44A, &[]);
        }
    }
    assert!((4..=5).contains(&sent), "{sent} in 200 ms");
}

#[test]
fn a_cyclic_connection_sends_at_its_rate_and_unacknowledged_if_asked() {
    let mut bench = bench(0x61);
    assert_eq!(bench.explicit(&[0x0E, 5, 4, 3]), [0x8E, 0x00]);
    assert_eq!(bench.explicit(&[0x0E, 5, 4, 5]), [0x8E, 0xFF, 0xFF], "it consumes nothing");
    bench.send(0x44C, &[0x0A, 0x10, 5, 4, 9, 20, 0]);
    bench.wait(1);
    bench.slave.application_mut().changed = true;
    assert_eq!(bench.wait(200).len(), 10, "changes do not count");
    assert!(!bench.events().contains(&SlaveEvent::NoAcknowledge));
}

#[test]
fn a_poll_of_nine_bytes_in_two_fragments_and_twelve_back() {
    let mut bench = bench(0x03);
    bench.explicit(&[0x10, 5, 2, 9, 100, 0]);
    assert_eq!(bench.send(0x44D, &[0x00, 1, 2, 3, 4, 5, 6, 7]), []);
    let back = bench.send(0x44D, &[0x81, 8, 9]);
    assert_eq!(back, [(0x3C9, vec![0, 0, 0, 0, 0, 0, 0, 0]), (0x3C9, vec![0x81, 0, 0, 0, 0, 0])]);
    assert_eq!(bench.slave.application().consumed, [(2, vec![1, 2, 3, 4, 5, 6, 7, 8, 9])]);
    let long = bench.send(0x44D, &[0x00, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(long, []);
    assert!(bench.refused(0x44D, &[0x81, 8, 9, 10]).contains("the message has more than 9 bytes"));
    bench.send(0x44D, &[0x00, 1, 2, 3, 4, 5, 6, 7]);
    assert!(bench.refused(0x44D, &[0x81, 8]).contains("expected 9 bytes, got 8"));
    assert_eq!(bench.slave.application().consumed.len(), 1);
}

fn planned(number: u8) -> Planned {
    let mut planned = Planned::polled(mac(number), 9, 12, 100);
    planned.connections.push(IoConfig { kind: ConnectionKind::BitStrobe, ..IoConfig::poll(1, 2, 100) });
    planned.connections.push(IoConfig { kind: ConnectionKind::ChangeOfState, ..IoConfig::poll(0, 1, 500) });
    planned
}

#[test]
fn a_master_with_all_three_connections_of_two_slaves() {
    let mut net = Net::with(vec![
        (planned(9), Node::Terminal(Slave::new(slave_config(9), Terminal::default()))),
        (planned(63), Node::Terminal(Slave::new(slave_config(63), Terminal::default()))),
    ]);
    net.exchange();
    net.terminal(1).application_mut().inputs = 3;
    net.terminal(2).application_mut().inputs = 4;
    net.run_for(50);
    for (slave, node, value) in [(9, 1, 3_u8), (63, 2, 4)] {
        let slave = mac(slave);
        for (kind, len) in [(ConnectionKind::Poll, 12), (ConnectionKind::BitStrobe, 2)] {
            assert_eq!(net.master().consumer(slave, kind).unwrap().data, vec![value; len], "{kind}");
        }
        net.terminal(node).application_mut().changed = true;
        net.run_for(5);
        let consumer = net.master().consumer(slave, ConnectionKind::ChangeOfState).unwrap();
        assert_eq!(consumer.data, [value]);
        let consumed = &net.terminal(node).application().consumed;
        let polled = consumed.iter().rev().find(|(instance, _)| *instance == 2).unwrap();
        assert_eq!(polled.1, [], "nothing was committed");
    }
    // One slave's bit and the other's not.
    net.master().producer(mac(63), ConnectionKind::BitStrobe).unwrap()[0] = 1;
    net.master().commit(mac(63), ConnectionKind::BitStrobe);
    net.run_for(10);
    let of = |net: &mut Net, node: usize| {
        let consumed = &net.terminal(node).application().consumed;
        let last = consumed.iter().rev().find(|(instance, _)| *instance == 3);
        last.map(|(_, data)| data.clone()).unwrap()
    };
    assert_eq!((of(&mut net, 1), of(&mut net, 2)), (vec![0], vec![1]));
    net.run_for(2000);
    assert!(!net.said(1, "not acknowledged"), "{}", net.text());
    assert_eq!(net.master().statistics().missed, 0);
    net.bus.judge();
}

#[test]
fn a_bit_strobe_response_of_a_wrong_length_and_one_that_stays_away() {
    let mut net = Net::with(vec![
        (planned(9), Node::Terminal(Slave::new(slave_config(9), Terminal::default()))),
        (planned(63), Node::Terminal(Slave::new(slave_config(63), Terminal::default()))),
    ]);
    net.exchange();
    let dumb = net.add(Node::Dumb);
    net.inject(dumb, Identifier::BitStrobeResponse(mac(9)), &[1]);
    net.run_for(2);
    let said = refusals(&net, 0);
    assert_eq!(said, ["frame refused: bit strobe response, MAC ID 9: expected 2 bytes, got 1"]);
    let master = net.station(0);
    net.disturb(Effect::Lose, |one| one.to(master).id(Identifier::BitStrobeResponse(mac(9)).can()));
    net.run_for(50);
    assert!(net.said(0, "slave 9: bit strobe connection: 3 answers in a row are missing"), "{}", net.text());
    assert!(!net.said(0, "slave 63: bit"));
    assert_eq!(net.terminal(2).master(), Some(MASTER));
}
