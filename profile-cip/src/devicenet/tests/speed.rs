//! The AC/DC drive profile: a velocity drive and its end at the master.

use super::bench::Bench;
use super::rig::{Net, mac, motion, slave_config, speed, speed_drive};
use crate::devicenet::connection::ConnectionKind;
use crate::devicenet::master::speed::{SpeedEnd, SpeedError};
use crate::devicenet::wire::speed::{Assembly, SpeedActual, SpeedStatus, SupervisorState};
use profile_generic::fault::FaultCause;
use profile_generic::time::DurationNs;

const POLL: ConnectionKind = ConnectionKind::Poll;

/// Runs the network with a command of `end` to node 1, slave 9, in every cycle.
fn run(net: &mut Net, end: &mut SpeedEnd, millis: i64) {
    let until = net.now + DurationNs::from_millis(millis);
    let mut cycle = 0;
    net.run_with(until, |net| {
        let now = net.master().statistics().cycles;
        if now == cycle {
            return;
        }
        cycle = now;
        let data = net.master().consumer(mac(9), POLL).unwrap().data.to_vec();
        if !data.is_empty() {
            end.handle(&data).unwrap();
        }
        end.emit(net.master().producer(mac(9), POLL).unwrap()).unwrap();
        net.master().commit(mac(9), POLL);
    });
}

fn started(output: u8) -> (Net, SpeedEnd) {
    let mut net = Net::with(vec![speed(9, output)]);
    net.exchange();
    let mut end = SpeedEnd::new(Assembly(output)).unwrap();
    run(&mut net, &mut end, 50);
    (net, end)
}

fn rpm(net: &mut Net) -> i64 {
    net.speed(1).application().actual().velocity.0 * 60 / 1_000_000_000
}

#[test]
fn forward_reverse_and_stop_along_the_ramp() {
    let (mut net, mut end) = started(21);
    assert_eq!(end.state(), Some(SupervisorState::READY));
    end.run(1500).unwrap();
    run(&mut net, &mut end, 130);
    let half = rpm(&mut net);
    assert!((500..1000).contains(&half), "3000 rpm in 500 ms: {half}");
    run(&mut net, &mut end, 400);
    let actual = *end.actual().unwrap();
    assert!((actual.speed - 1500).abs() < 10, "{actual}");
    let running = SpeedStatus::RUNNING_FORWARD | SpeedStatus::AT_REFERENCE | SpeedStatus::READY;
    assert!(actual.status.contains(running), "{actual}");
    end.run(-600).unwrap();
    run(&mut net, &mut end, 800);
    let actual = *end.actual().unwrap();
    assert!((actual.speed + 600).abs() < 10, "{actual}");
    assert!(
        actual.status.contains(SpeedStatus::RUNNING_REVERSE)
            && !actual.status.contains(SpeedStatus::RUNNING_FORWARD)
    );
    end.stop();
    run(&mut net, &mut end, 50);
    assert_eq!(end.state(), Some(SupervisorState::STOPPING));
    run(&mut net, &mut end, 300);
    assert_eq!((end.state(), rpm(&mut net)), (Some(SupervisorState::READY), 0));
}

#[test]
fn speeds_beyond_the_limits_are_held_at_them() {
    let (mut net, mut end) = started(21);
    end.run(i16::MIN).unwrap();
    run(&mut net, &mut end, 1000);
    assert!((rpm(&mut net) + 3000).abs() < 10, "{}", rpm(&mut net));
}

#[test]
fn the_basic_assembly_and_what_it_cannot_say() {
    let (mut net, mut end) = started(20);
    assert_eq!(end.run(-5), Err(SpeedError::NoReverse(Assembly(20))));
    end.run(300).unwrap();
    run(&mut net, &mut end, 300);
    assert!((rpm(&mut net) - 300).abs() < 5);
    assert_eq!(end.state(), None);
    assert!(matches!(SpeedEnd::new(Assembly(71)), Err(SpeedError::Assembly(_))));
}

#[test]
fn torque_control_with_assembly_23() {
    let (mut net, mut end) = started(23);
    let set = |attribute, value: &[u8]| {
        crate::devicenet::master::event::ExplicitRequest::set(0x2A, 1, attribute, value).unwrap()
    };
    net.master().submit(mac(9), set(6, &[3])).unwrap();
    net.master().submit(mac(9), set(24, &[4])).unwrap();
    run(&mut net, &mut end, 100);
    // 3/16 Nm of a motor of 1 Nm.
    end.set_torque(3);
    end.run(0).unwrap();
    run(&mut net, &mut end, 100);
    let torque = net.speed(1).application().actual().torque.0;
    assert!((torque - 187_500).abs() < 15_000, "{torque}");
    assert_eq!(end.actual().unwrap().torque, 3);
}

#[test]
fn a_fault_of_the_drive_is_told_and_reset_and_run_has_to_be_asked_anew() {
    let (mut net, mut end) = started(21);
    end.run(1000).unwrap();
    run(&mut net, &mut end, 500);
    net.speed(1).application_mut().servo_mut().raise_fault(FaultCause::OVER_CURRENT);
    run(&mut net, &mut end, 300);
    assert!(end.is_faulted());
    assert_eq!(end.state(), Some(SupervisorState::FAULTED));
    let request = crate::devicenet::master::event::ExplicitRequest::get(0x29, 1, 13);
    net.master().submit(mac(9), request).unwrap();
    run(&mut net, &mut end, 50);
    assert!(net.said(0, "done, data [10, 23]"), "{}", net.text());
    // The cause is still there: no reset helps.
    end.reset_fault();
    run(&mut net, &mut end, 100);
    assert!(end.is_faulted());
    net.speed(1).application_mut().servo_mut().clear_fault(FaultCause::OVER_CURRENT);
    end.reset_fault();
    run(&mut net, &mut end, 100);
    assert_eq!((end.is_faulted(), end.state()), (false, Some(SupervisorState::READY)));
    assert_eq!(rpm(&mut net), 0);
    end.run(500).unwrap();
    run(&mut net, &mut end, 300);
    assert!((rpm(&mut net) - 500).abs() < 10);
}

#[test]
fn a_lost_network_stops_the_drive_with_a_fault() {
    let (mut net, mut end) = started(21);
    end.run(1500).unwrap();
    run(&mut net, &mut end, 500);
    net.plug(0, false);
    net.run_for(210);
    assert_eq!(net.speed(1).application().state(), SupervisorState::FAULT_STOP);
    let early = rpm(&mut net);
    assert!(early > 100, "it slows down along the ramp: {early}");
    net.run_for(400);
    assert_eq!((net.speed(1).application().state(), rpm(&mut net)), (SupervisorState::FAULTED, 0));
    net.plug(0, true);
    net.exchange();
    end.restart();
    run(&mut net, &mut end, 100);
    assert!(end.is_faulted(), "{}", net.text());
    end.run(1000).unwrap();
    run(&mut net, &mut end, 300);
    assert_eq!(rpm(&mut net), 0, "a fault is not passed over");
    end.reset_fault();
    run(&mut net, &mut end, 100);
    end.run(1000).unwrap();
    run(&mut net, &mut end, 500);
    assert!((rpm(&mut net) - 1000).abs() < 10);
}

#[test]
fn a_master_that_commits_nothing_is_idle_and_the_drive_stops() {
    let (mut net, mut end) = started(21);
    end.run(1500).unwrap();
    run(&mut net, &mut end, 500);
    net.run_for(30);
    assert_eq!(net.speed(1).application().state(), SupervisorState::STOPPING, "{}", net.text());
    net.run_for(600);
    assert_eq!((net.speed(1).application().state(), rpm(&mut net)), (SupervisorState::READY, 0));
    assert!(!end.is_faulted());
}

#[test]
fn run_that_stood_before_starts_nothing() {
    let mut bench = Bench::with(slave_config(9), speed_drive(21));
    bench.slave.application_mut().set_power(false);
    bench.send(0x44E, &[0x0A, 0x4B, 3, 1, 3, 0x0A]);
    bench.explicit(&[0x10, 5, 2, 9, 50, 0]);
    let poll = |bench: &mut Bench<_>, bits: u8| -> SupervisorState {
        for _ in 0..4 {
            bench.send(0x44D, &[bits, 0, 0x2C, 1]);
            bench.wait(10);
        }
        let sent = bench.send(0x44D, &[bits, 0, 0x2C, 1]);
        SpeedActual::parse(Assembly(71), &sent[0].1).unwrap().state
    };
    assert_eq!(poll(&mut bench, 0x61), SupervisorState::NOT_READY);
    bench.slave.application_mut().set_power(true);
    bench.wait(100);
    assert_eq!(poll(&mut bench, 0x61), SupervisorState::READY, "power comes while run stands");
    assert_eq!(poll(&mut bench, 0x63), SupervisorState::READY, "both directions are none");
    assert_eq!(poll(&mut bench, 0x41), SupervisorState::READY, "not from the network");
    assert_eq!(poll(&mut bench, 0x61), SupervisorState::ENABLED);
    assert_eq!(poll(&mut bench, 0x21), SupervisorState::ENABLED, "without reference from the network");
    bench.wait(1000);
    assert_eq!(bench.slave.application().actual().velocity.0, 0, "it stands");
}

#[test]
fn a_velocity_drive_beside_a_motion_drive() {
    let mut net = Net::with(vec![speed(9, 21), motion(5)]);
    net.exchange();
    let mut end = SpeedEnd::new(Assembly(21)).unwrap();
    run(&mut net, &mut end, 50);
    end.run(700).unwrap();
    run(&mut net, &mut end, 500);
    assert!((rpm(&mut net) - 700).abs() < 10);
    net.bus.judge();
}
