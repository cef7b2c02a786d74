//! The master against the crate's slave role, each with its own state machines.

use super::*;
use crate::master::config::Connections;
use crate::slave::application::{Cycle, Diagnosis, Order, Progress};
use crate::slave::configuration::Invalid;
use crate::slave::parameter::{Cyclic, Definition, Store};
use crate::slave::{self, Application, Slave};
use crate::wire::svc_error::SvcError;

/// A profile with a velocity that follows its command value, and a parameter that CP4 needs.
#[derive(Debug, Default)]
struct Mirror {
    /// The parameters of the profile are not acceptable for this phase.
    refuses: Option<Phase>,
}

const COMMAND: Idn = Idn::standard(36);
const FEEDBACK: Idn = Idn::standard(40);
const MODE: Idn = Idn::standard(32);

impl Application for Mirror {
    fn define(&mut self, store: &mut Store) {
        let signed = 0x0022_0001;
        store.define(Definition::value(COMMAND, signed, "velocity command value", 0).cyclic(Cyclic::Command));
        store.define(
            Definition::value(FEEDBACK, signed, "velocity feedback value", 0).cyclic(Cyclic::Feedback),
        );
        store.define(Definition::value(MODE, 0x4001_0001, "primary operation mode", 0).range(0, 10).busy(5));
    }

    fn refresh(&mut self, _: Idn, _: &mut Store) {}

    fn check(&self, _: Idn, _: &[u8], _: &Store) -> Result<(), SvcError> {
        Ok(())
    }

    fn written(&mut self, _: Idn, _: &mut Store) {}

    fn order(&mut self, _: Idn, _: Order, _: &mut Store) -> Result<Progress, SvcError> {
        Ok(Progress::Done)
    }

    fn progress(&mut self, _: Idn, _: &mut Store) -> Progress {
        Progress::Done
    }

    fn check_phase(&self, phase: Phase, _: &Store, invalid: &mut Invalid) {
        if self.refuses == Some(phase) {
            invalid.push(MODE);
        }
    }

    fn cycle(&mut self, cycle: Cycle, store: &mut Store) {
        let (Some(command), Some(feedback)) = (store.find(COMMAND), store.find(FEEDBACK)) else { return };
        let value = if cycle.connected { store.number(command) } else { 0 };
        store.set_number(feedback, value);
    }

    fn diagnosis(&self) -> Diagnosis {
        Diagnosis::default()
    }

    fn reset(&mut self, _: &mut Store) -> bool {
        true
    }
}

struct FullRig {
    now: MonotonicTime,
    master: Master,
    line: slave::Line<Mirror>,
    log: Vec<Event>,
    auto_proceed: bool,
}

impl FullRig {
    fn new(count: u16) -> FullRig {
        let connections: Connections = [
            ConnectionConfig::new(0, false, &[COMMAND]).unwrap(),
            ConnectionConfig::new(1, true, &[FEEDBACK]).unwrap(),
        ]
        .into_iter()
        .collect();
        let slaves = (1..=count).map(|address| SlaveConfig { address, connections: connections.clone() });
        let config = MasterConfig { slaves: slaves.collect(), ..config(&[]) };
        let slave = |address| {
            let config = slave::Config { address, ..slave::Config::default() };
            Slave::new(&config, Mirror::default())
        };
        FullRig {
            now: MonotonicTime::ZERO,
            master: Master::new(config).unwrap(),
            line: slave::Line::new((1..=count).map(slave).collect()),
            log: Vec::new(),
            auto_proceed: true,
        }
    }

    fn step(&mut self) {
        self.now = self.now.max(self.master.wake_at().unwrap());
        self.line.handle_time(self.now);
        let mut out = Vec::new();
        while let Some(Output::Transmit { frame, .. }) = self.master.poll(self.now) {
            out.push(frame.to_vec());
        }
        for mut frame in out {
            if self.line.handle_frame(self.now, &mut frame) {
                self.master.handle_frame(self.now, Port::One, &frame).unwrap();
            }
        }
        while let Some(event) = self.master.poll_event() {
            if self.auto_proceed && matches!(event, Event::AwaitingApplication { .. }) {
                self.master.proceed().unwrap();
            }
            self.log.push(event);
        }
    }

    fn run_until(&mut self, done: impl Fn(&FullRig) -> bool) {
        for _ in 0..20_000 {
            if done(self) {
                return;
            }
            self.step();
        }
        let reports: Vec<_> = self.master.report(SlaveId(0)).iter().map(ToString::to_string).collect();
        panic!("never: {:?} at {}, {:#?}\n{reports:#?}", self.master.state(), self.now, self.log);
    }

    fn state(&mut self, state: State) {
        self.run_until(|rig| rig.master.state() == state);
    }
}

#[test]
fn one_two_and_sixteen_slaves_reach_cp4_and_exchange_values() {
    for count in [1, 2, 16] {
        let mut rig = FullRig::new(count);
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
    let mut rig = FullRig::new(3);
    rig.master.set_target_phase(Phase::CP4);
    rig.state(State::Cp4);
    rig.line.cut_behind(1);
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
        let mut rig = FullRig::new(2);
        rig.line.slaves_mut()[1].application_mut().refuses = Some(phase);
        rig.master.set_target_phase(Phase::CP4);
        let failed = Event::CheckFailed { slave: SlaveId(1), phase: refused };
        rig.run_until(|rig| rig.log.contains(&failed));
        rig.auto_proceed = false;
        rig.state(state);
        assert_eq!(rig.master.invalid_parameters(SlaveId(1)), [MODE]);
        rig.line.slaves_mut()[1].application_mut().refuses = None;
        rig.auto_proceed = true;
        let _ = rig.master.proceed();
        rig.state(State::Cp4);
    }
}

#[test]
fn elements_and_refusals_come_as_the_slave_says() {
    let mut rig = FullRig::new(1);
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
