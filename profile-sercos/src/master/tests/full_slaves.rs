//! The master against the crate's slave role, each with its own state machines.

use super::*;
use crate::checker::light::{COMMAND, FEEDBACK, MODE, Mirror};
use crate::master::config::Connections;
use crate::master::event::Invalid;
use crate::slave::{self, Network, Slave};

pub(super) type FullRig = VirtualBus<Network<Mirror>>;

/// A velocity command and a velocity feedback.
pub(super) fn configured(address: u16) -> SlaveConfig {
    // The slaves bear it when a test does not send values for a while.
    let command =
        ConnectionConfig { allowed_losses: 60_000, ..ConnectionConfig::new(0, false, &[COMMAND]).unwrap() };
    let connections: Connections =
        [command, ConnectionConfig::new(1, true, &[FEEDBACK]).unwrap()].into_iter().collect();
    SlaveConfig { address, connections, hot_plug: None }
}

pub(super) fn mirror(address: u16) -> Slave<Mirror> {
    let config = slave::Config { address, ..slave::Config::default() };
    Slave::new(&config, Mirror::default())
}

pub(super) fn full_rig(count: u16) -> FullRig {
    let config = MasterConfig { slaves: (1..=count).map(configured).collect(), ..config(&[]) };
    VirtualBus::new(config, Network::line((1..=count).map(mirror).collect())).unwrap()
}

#[test]
fn one_two_and_sixteen_slaves_reach_cp4_and_exchange_values() {
    for count in [1, 2, 16] {
        let mut rig = full_rig(count);
        rig.master.set_target_phase(Phase::CP4);
        rig.state(State::Cp4);
        for cycle in 0..20i32 {
            for index in 0..count {
                let value = (cycle * 100 + i32::from(index)).to_le_bytes();
                rig.master.producer(SlaveId(index), 0).unwrap().copy_from_slice(&value);
                assert!(rig.master.commit(SlaveId(index), 0));
            }
            rig.step();
        }
        for index in 0..count {
            let consumer = rig.master.consumer(SlaveId(index), 1).unwrap();
            assert_eq!((consumer.state, consumer.fresh), (ConsumerState::Consuming, true), "{index}");
            let value = i32::from_le_bytes(consumer.data.try_into().unwrap());
            // Command values of one cycle are feedback values at most one cycle later.
            assert!((1800..=1915).contains(&value), "slave {index}: {value}");
            assert_eq!(value % 100, i32::from(index));
        }
        assert!(!rig.log.iter().any(|event| matches!(event, Event::StepFailed { .. })), "{:?}", rig.log);
        assert!(Refusal::ALL.iter().all(|&reason| rig.master.statistics().refused(reason) == 0));
        // And down again, and up.
        rig.master.set_target_phase(Phase::CP0);
        rig.state(State::Cp0);
        rig.master.set_target_phase(Phase::CP4);
        rig.state(State::Cp4);
    }
}

#[test]
fn a_cable_cut_in_cp4_leaves_the_slaves_before_it_running() {
    let mut rig = full_rig(3);
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Cp4);
    rig.line.cut(1);
    for _ in 0..30 {
        rig.step();
    }
    let presence: Vec<_> = rig.master.slaves().map(|slave| slave.presence).collect();
    assert_eq!(presence, [Presence::Active, Presence::Lost, Presence::Lost]);
    assert_eq!(rig.master.consumer(SlaveId(0), 1).unwrap().state, ConsumerState::Consuming);
    assert_eq!(rig.master.consumer(SlaveId(2), 1).unwrap().state, ConsumerState::Error);
}

#[test]
fn checks_of_the_slave_are_shown_by_name() {
    for (phase, refused, state) in
        [(Phase::CP3, Phase::CP2, State::Await2), (Phase::CP4, Phase::CP3, State::Await3)]
    {
        let mut rig = full_rig(2);
        rig.line.slaves_mut()[1].application_mut().refuses = Some(phase);
        rig.master.set_target_phase(Phase::CP4);
        let invalid = Invalid::from_iter([MODE]);
        let failed = Event::CheckFailed { slave: SlaveId(1), phase: refused, invalid };
        rig.run_until("there", |rig| rig.log.contains(&failed));
        rig.auto_proceed = false;
        rig.state(state);
        rig.line.slaves_mut()[1].application_mut().refuses = None;
        rig.auto_proceed = true;
        let _ = rig.master.proceed();
        rig.state(State::Cp4);
    }
}

#[test]
fn elements_and_refusals_come_as_the_slave_says() {
    let mut rig = full_rig(1);
    rig.auto_proceed = false;
    rig.master.set_target_phase(Phase::CP2);
    rig.state(State::Await2);
    // Names, units and limits come over the service channel as they are.
    let read = |element| SvcRequest::new(MODE, crate::master::svc::request::SvcOperation::Read(element));
    let name = rig.master.svc_submit(SlaveId(0), read(crate::wire::svc::Element::Name)).unwrap();
    let maximum = rig.master.svc_submit(SlaveId(0), read(crate::wire::svc::Element::Maximum)).unwrap();
    let data = crate::master::svc::request::SvcData::inline(&11u16.to_le_bytes()).unwrap();
    let above = rig.master.svc_submit(SlaveId(0), SvcRequest::write(MODE, data)).unwrap();
    let absent = rig.master.svc_submit(SlaveId(0), SvcRequest::read(Idn::product(4000))).unwrap();
    for _ in 0..100 {
        rig.step();
    }
    let outcome = |wanted| {
        rig.log
            .iter()
            .find_map(|event| match event {
                Event::Svc { ticket, outcome } if *ticket == wanted => Some(outcome),
                _ => None,
            })
            .unwrap()
    };
    assert_eq!(outcome(name).data.as_slice(), b"primary operation mode");
    assert_eq!(outcome(maximum).data.unsigned(), Some(10));
    assert_eq!(outcome(above).to_string(), "S-0-0032: operation data: operation data is above the maximum");
    assert!(outcome(absent).result.unwrap_err().is_absent());
}
