//! From power-up to Running and back: connection, configuration, synchronization, loss and return.

use super::*;
use crate::device::axis::drive_link::{DriveAction, Withheld};
use crate::device::axis::state::AxisState;
use crate::device::motion_link::{MotionReply, MotionRequest, OpenRefusal};
use crate::wire::motion::attribute_list::{AttributeSelector, ListWriter};
use crate::wire::motion::codes::{ClearingEvent, FaultType, NodeFault, NodeStatus, SyncStatus};

#[test]
fn a_whole_start_up() {
    let mut rig = Rig::new();
    assert_eq!(rig.state(0), AxisState::Initializing);
    assert_eq!(rig.command(0).action, DriveAction::None);
    rig.open();

    // Connecting: the initial packets of clause 7-1.1.
    rig.control = NodeControl::REMOTE_CONTROL;
    rig.sequence = 1;
    let initial = [1, 0, 6, 2, 0, 1, 0, 0, 0, 0];
    rig.send(&initial);
    assert!(rig.run_device());
    assert_eq!(rig.packet, [1, 0, 7, 2, 0, 1, 0, 0, 0, 0]);
    rig.now += PERIOD;
    rig.send(&initial);
    assert!(rig.run_device());
    assert_eq!(rig.packet, [1, 0, 7, 2, 0, 1, 0, 0, 0, 0], "a refresh has the same sequence count");
    assert_eq!(rig.device.counters().refreshes, 1);
    rig.now += PERIOD;

    // Configuration: class first, then the axes.
    rig.control |= NodeControl::DATA_VALID;
    let mut body = [0; 64];
    let mut list = ListWriter::new(&mut body).expect("room");
    list.value(&AttributeSelector::scalar(35, 4), &2_000_000_u32.to_le_bytes()).expect("room");
    list.value(&AttributeSelector::scalar(21, 1), &[6]).expect("room");
    let len = list.finish();
    rig.services[0] = Some((1, MotionService::SET_AXIS_ATTRIBUTES_LIST, body[..len].to_vec()));
    rig.cycle();
    let header = rig.header();
    assert_eq!((header.update_id, header.last_received_id, header.instance_count), (1, 1, 3));
    assert_eq!(header.node_status, NodeStatus::REMOTE_MODE | NodeStatus::DATA_VALID);
    assert_eq!(rig.response(0), Some((1, 0, vec![2, 0, 0, 0, 35, 0, 0, 0, 21, 0, 0, 0])));
    rig.services[0] = None;
    let mut list = ListWriter::new(&mut body).expect("room");
    list.value(&AttributeSelector::scalar(461, 4), &12.5_f32.to_le_bytes()).expect("room");
    let len = list.finish();
    for instance in 1..=2 {
        rig.services[instance] = Some((1, MotionService::SET_AXIS_ATTRIBUTES_LIST, body[..len].to_vec()));
    }
    rig.cycle();
    assert_eq!(rig.response(0), None);
    assert_eq!(rig.response(2), Some((1, 0, vec![1, 0, 0, 0, 0xCD, 1, 0, 0])));
    assert_eq!(rig.device.attribute(1, 461), Ok(&12.5_f32.to_le_bytes()[..]));

    // Synchronization.
    rig.services = vec![Some((2, MotionService::GROUP_SYNC, GRANDMASTER.to_vec())), None, None];
    rig.cycle();
    assert_eq!(rig.response(0), Some((2, 0, vec![SyncStatus::SYNCHRONIZED.0, 0, 0, 0])));
    rig.services[0] = None;
    rig.cycle();
    assert_eq!(rig.state(0), AxisState::Initializing);

    // Configuration Complete, then the bus, then Enable.
    rig.drives.iter_mut().for_each(|d| d.image.bus_up = false);
    rig.configure();
    rig.cycles(2);
    assert_eq!(rig.state(0), AxisState::PreCharge);
    assert_eq!(rig.command(0).action, DriveAction::PowerUp);
    rig.drives.iter_mut().for_each(|d| d.image.bus_up = true);
    rig.cycle();
    assert_eq!(rig.state(0), AxisState::Stopped);
    assert_eq!(rig.withheld(0), Some(Withheld::NotRunning));
    rig.request_all(AxisControl::ENABLE);
    let mut states = Vec::new();
    for _ in 0..4 {
        rig.cycle();
        states.push((rig.state(0), rig.actual(0).axis_response));
    }
    assert_eq!(
        states,
        [
            (AxisState::Starting, AxisControl::NONE),
            (AxisState::Running, AxisControl::ENABLE),
            (AxisState::Running, AxisControl::ENABLE),
            (AxisState::Running, AxisControl::ENABLE),
        ]
    );
    rig.request_all(AxisControl::NONE);
    rig.blocks[0].values.position = Some(CommandPosition::Float(1000.5));
    rig.cycle();
    assert_eq!(rig.actual(0).axis_response, AxisControl::NONE);
    assert_eq!(rig.follow(0).values.position, Some(CommandPosition::Float(1000.5)));
    let counters = rig.device.counters();
    assert_eq!((counters.malformed, counters.lost_updates, counters.late_updates), (0, 0, 0));
}

#[test]
fn class_and_axes_may_be_configured_in_the_same_update() {
    // Clause 7-1.2: one instance at a time, several at once, and the first axes together with the class.
    let mut rig = Rig::new();
    rig.open();
    let list = |id: u16, value: &[u8]| {
        let mut body = [0; 64];
        let mut list = ListWriter::new(&mut body).expect("room");
        let size = u8::try_from(value.len()).expect("short");
        list.value(&AttributeSelector::scalar(id, size), value).expect("room");
        let len = list.finish();
        body[..len].to_vec()
    };
    let set = MotionService::SET_AXIS_ATTRIBUTES_LIST;
    rig.services = vec![
        Some((1, set, list(21, &[9]))),
        Some((1, set, list(461, &1.5_f32.to_le_bytes()))),
        Some((1, set, list(610, &[2]))),
    ];
    rig.cycle();
    assert_eq!(rig.header().instance_count, 3);
    for (instance, id) in [(0, 21_u16), (1, 461), (2, 610)] {
        let [low, high] = id.to_le_bytes();
        assert_eq!(rig.response(instance), Some((1, 0, vec![1, 0, 0, 0, low, high, 0, 0])), "{instance}");
    }
    assert_eq!(rig.device.engine.instances.high_limit(), 9);
    // The interpolator goes on for ten periods at most, so more would be a promise that nothing keeps.
    for (transaction, value, status) in [(2, 10, 0), (3, 11, 9), (4, 255, 9), (5, 0, 0)] {
        rig.services = vec![Some((transaction, set, list(21, &[value]))), None, None];
        rig.cycle();
        let answer = vec![1, 0, 0, 0, 21, 0, status, 0];
        // Attribute list error: there is one that was refused.
        let general = if status == 0 { 0 } else { 0x0A };
        assert_eq!(rig.response(0), Some((transaction, general, answer)), "{value}");
    }
    assert_eq!(rig.device.engine.instances.high_limit(), 0);
    assert_eq!(rig.device.attribute(0, 461), Ok(&1.5_f32.to_le_bytes()[..]));
    assert_eq!(rig.device.attribute(1, 610), Ok(&[2][..]));
    assert_ne!(rig.device.attribute(0, 610), Ok(&[2][..]), "of its own instance alone");
}

#[test]
fn the_connection_belongs_to_one_owner_and_needs_good_parameters() {
    let mut rig = Rig::new();
    rig.open();
    let mut refused = |change: &dyn Fn(&mut OpenParameters)| {
        let mut parameters = rig.open_parameters();
        change(&mut parameters);
        match rig.request(MotionRequest::Open(parameters)) {
            Some(MotionReply::Opened { outcome: Err(OpenRefusal { extended_status, .. }), .. }) => {
                extended_status
            }
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(&|_| ()), 0x0106);
    rig.close();
    let mut refused = |change: &dyn Fn(&mut OpenParameters)| {
        let mut parameters = rig.open_parameters();
        change(&mut parameters);
        match rig.request(MotionRequest::Open(parameters)) {
            Some(MotionReply::Opened { outcome: Err(OpenRefusal { extended_status, .. }), .. }) => {
                extended_status
            }
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(&|p| p.format_revision = 4), 0x012F);
    assert_eq!(refused(&|p| p.rpi_us = 0), 0x0111);
}

#[test]
fn close_while_running_stops_and_initializes_without_fault() {
    let mut rig = Rig::running();
    rig.close();
    assert_eq!(rig.state(0), AxisState::Initializing);
    assert_eq!(rig.device.node_fault(), NodeFault::NONE);
    assert_eq!(rig.command(0).action, DriveAction::Disable, "a stop first, not a coast");
    assert_eq!(rig.withheld(0), Some(Withheld::NotConnected));
    for _ in 0..3 {
        assert!(!rig.run_device(), "nothing is sent without a connection");
        rig.now += PERIOD;
    }
    assert_eq!(rig.command(0).action, DriveAction::None);
    assert_eq!(rig.device.attribute(0, 461), Ok(&0.0_f32.to_le_bytes()[..]));
}

/// A controller may need longer to its first update than the time-out of the connection, which is 32 ms here.
#[test]
fn first_update_has_ten_seconds() {
    let mut rig = Rig::new();
    rig.configure();
    rig.open();
    let opened = rig.now;
    while rig.now <= opened + 10_000_000_000 {
        assert!(rig.device.connection().is_some(), "{} ns", rig.now - opened);
        rig.silence();
        let command = (rig.command(0).action, rig.withheld(0));
        assert_eq!(command, (DriveAction::None, Some(Withheld::LocalControl)), "nothing moves meanwhile");
        assert_eq!(rig.state(0), AxisState::Initializing);
    }
    rig.run_device();
    assert_eq!(rig.device.connection(), None);
    let Some(MotionReply::ConnectionLost { silent_us, .. }) = rig.device.poll_reply() else {
        panic!("it stays")
    };
    assert_eq!(silent_us, (rig.now - opened) / 1_000);

    rig.open();
    let opened = rig.now;
    while rig.now < opened + 9_990_000_000 {
        rig.silence();
    }
    let packet = rig.command_packet();
    rig.send(&packet);
    let heard = rig.now;
    while rig.now <= heard + 32_000_000 {
        assert!(rig.device.connection().is_some(), "{} ns", rig.now - heard);
        rig.silence();
    }
    rig.run_device();
    assert_eq!(rig.device.connection(), None, "from the first update on the time-out counts");
}

#[test]
fn loss_faults_every_axis_and_nothing_starts_again_by_itself() {
    let mut rig = Rig::running();
    let mut reply = None;
    for _ in 0..20 {
        rig.silence();
        reply = reply.or(rig.device.poll_reply());
    }
    let Some(MotionReply::ConnectionLost { o_to_t_id: 11, silent_us }) = reply else { panic!("{reply:?}") };
    assert!(silent_us > 32_000, "{silent_us}");
    assert_eq!(rig.device.counters().connection_losses, 1);
    assert_eq!(rig.state(0), AxisState::MajorFaulted);
    assert_eq!(rig.command(0).action, DriveAction::Abort);

    // The controller comes back with its Enable still standing and Configuration Complete still set.
    rig.request_all(AxisControl::ENABLE);
    rig.packet.clear();
    rig.open();
    assert_eq!(rig.device.node_fault(), NodeFault::NONE, "a new connection ends the fault");
    rig.cycles(20);
    assert_eq!(rig.state(0), AxisState::Stopped);
    let response = rig.actual(0);
    assert_eq!((response.axis_response, response.response_status), (AxisControl::ENABLE, 0x0C));
    // The log begins with the reset by the connection.
    rig.request_all(AxisControl::NONE);
    rig.cycle();
    rig.request_all(AxisControl::ENABLE);
    rig.cycles(3);
    assert_eq!(rig.state(0), AxisState::Running, "a new request starts it");
}

#[test]
fn an_axis_that_still_moves_is_not_initialized_again() {
    let mut rig = Rig::running();
    rig.drives[0].stuck = true;
    rig.close();
    rig.packet.clear();
    rig.open();
    rig.cycles(5);
    assert_eq!((rig.state(0), rig.state(1)), (AxisState::Initializing, AxisState::Stopped));
    assert_eq!(rig.command(0).action, DriveAction::Disable);
    rig.drives[0].stuck = false;
    rig.cycles(3);
    assert_eq!(rig.state(0), AxisState::Stopped);
}

#[test]
fn the_first_fault_record_tells_of_the_connection_reset() {
    let mut rig = Rig::new();
    rig.open();
    rig.cycle();
    let record = rig.actual(0).status.fault.expect("a record");
    assert_eq!((record.fault_type, record.code), (FaultType::CLEARED, ClearingEvent::CONNECTION_RESET.0));
    rig.cycles(2);
    assert_eq!(rig.actual(0).status.fault, None, "sent until it has arrived");
    assert_eq!(rig.actual(0).status.axis_status, None, "nothing has changed since");
}
