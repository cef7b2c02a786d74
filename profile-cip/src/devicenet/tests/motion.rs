//! CIP Motion over DeviceNet: the fixed format on the poll connection, services by explicit message.

use core::cell::RefCell;

use profile_generic::servo::ServoParameters;

use super::rig::{Net, Node, mac, motion, slave_config};
use crate::device::attribute::{Access, AttributeDefinition, DataType, DefaultValue, Scope};
use crate::device::axis::state::AxisState;
use crate::device::event::ResetKind;
use crate::devicenet::connection::ConnectionKind;
use crate::devicenet::master::event::{Event, ExplicitRequest, Outcome};
use crate::devicenet::master::motion::{MotionEnd, SetPoint, UpdateError, Watched};
use crate::devicenet::slave::Slave;
use crate::devicenet::slave::application::Application as _;
use crate::devicenet::slave::motion_drive::{MotionDrive, MotionDriveConfig};
use crate::wire::motion::codes::{AxisControl, AxisStateCode};

const POLL: ConnectionKind = ConnectionKind::Poll;

/// The controller of one drive.
struct Controller {
    end: MotionEnd,
    slave: u8,
    cycle: u64,
    errors: Vec<UpdateError>,
}

impl Controller {
    fn new(slave: u8, set_point: SetPoint, watched: Watched) -> Self {
        Self { end: MotionEnd::new(set_point, watched), slave, cycle: u64::MAX, errors: Vec::new() }
    }

    /// Once a cycle of the master: takes the answer, gives the next command.
    fn work(&mut self, net: &mut Net) {
        let slave = mac(self.slave);
        let cycle = net.master().statistics().cycles;
        if cycle == self.cycle {
            return;
        }
        // Late in the cycle, when the answer is there.
        let consumer = net.master().consumer(slave, POLL).unwrap();
        if !consumer.fresh && self.cycle != u64::MAX && cycle < self.cycle + 2 {
            return;
        }
        self.cycle = cycle;
        if consumer.fresh {
            let data = consumer.data.to_vec();
            if let Err(error) = self.end.handle(&data) {
                self.errors.push(error);
            }
        }
        let producer = net.master().producer(slave, POLL).unwrap();
        self.end.sent();
        self.end.emit(producer).unwrap();
        net.master().commit(slave, POLL);
    }
}

fn run(net: &mut Net, controllers: &[RefCell<Controller>], millis: i64) {
    let until = net.now + profile_generic::time::DurationNs::from_millis(millis);
    net.run_with(until, |net| {
        for controller in controllers {
            controller.borrow_mut().work(net);
        }
    });
}

/// A network of drives whose axes are Stopped.
fn stopped(drives: &[(u8, SetPoint, Watched)]) -> (Net, Vec<RefCell<Controller>>) {
    let mut net = Net::with(drives.iter().map(|(number, ..)| motion(*number)).collect());
    net.exchange();
    let controllers: Vec<_> = drives
        .iter()
        .map(|(number, set_point, watched)| RefCell::new(Controller::new(*number, *set_point, *watched)))
        .collect();
    run(&mut net, &controllers, 100);
    for (number, ..) in drives {
        let request = MotionEnd::configuration_complete().unwrap();
        net.master().submit(mac(*number), request).unwrap();
    }
    run(&mut net, &controllers, 100);
    for controller in &controllers {
        let state = controller.borrow().end.axis_state();
        assert_eq!(state, Some(AxisStateCode::STOPPED), "{}", net.text());
    }
    (net, controllers)
}

fn enable(net: &mut Net, controllers: &[RefCell<Controller>]) {
    for controller in controllers {
        controller.borrow_mut().end.request(AxisControl::ENABLE);
    }
    run(net, controllers, 150);
    for controller in controllers {
        let end = &mut controller.borrow_mut().end;
        assert_eq!(end.take_answer(AxisControl::ENABLE), Some(0));
        assert_eq!(end.axis_state(), Some(AxisStateCode::RUNNING));
    }
}

#[test]
fn a_drive_is_taken_configured_enabled_and_moved_in_position_control() {
    let (mut net, controllers) = stopped(&[(5, SetPoint::Position(0), Watched::Position)]);
    enable(&mut net, &controllers);
    let target = 1 << 20;
    for step in 1..=100 {
        controllers[0].borrow_mut().end.set(SetPoint::Position(target / 100 * step)).unwrap();
        run(&mut net, &controllers, 10);
    }
    run(&mut net, &controllers, 200);
    let end = controllers[0].borrow().end.clone();
    let position = end.position().unwrap();
    assert!((position - target / 100 * 100).abs() < 2000, "{position}");
    let servo = net.motion(1).application().servo().position().0;
    assert!((servo - 1_000_000_000).abs() < 2_000_000, "one turn: {servo}");
    controllers[0].borrow_mut().end.request(AxisControl::DISABLE);
    run(&mut net, &controllers, 100);
    assert_eq!(controllers[0].borrow().end.axis_state(), Some(AxisStateCode::STOPPED));
    assert_eq!(controllers[0].borrow().errors, []);
    assert_eq!(net.master().statistics().missed, 0);
    net.bus.judge();
    insta::assert_snapshot!(net.text());
}

#[test]
fn velocity_and_torque_control() {
    let (mut net, controllers) = stopped(&[(5, SetPoint::Velocity(0.0), Watched::Velocity)]);
    enable(&mut net, &controllers);
    controllers[0].borrow_mut().end.set(SetPoint::Velocity(10.0)).unwrap();
    run(&mut net, &controllers, 500);
    let velocity = controllers[0].borrow().end.velocity().unwrap();
    assert!((velocity - 10.0).abs() < 0.1, "{velocity}");
    controllers[0].borrow_mut().end.set(SetPoint::Torque(20.0)).unwrap();
    run(&mut net, &controllers, 100);
    let torque = net.motion(1).application().actual().torque.0;
    assert!((torque - 200_000).abs() < 20_000, "{torque}");
    let faster = controllers[0].borrow().end.velocity().unwrap();
    assert!(faster > 10.5, "{faster}");
    assert_eq!(
        controllers[0].borrow_mut().end.set(SetPoint::Velocity(f32::NAN)),
        Err(UpdateError::NotFinite)
    );
}

#[test]
fn attributes_travel_in_fragments() {
    let (mut net, controllers) = stopped(&[(5, SetPoint::Position(0), Watched::Position)]);
    // Get_Attribute_List of four attributes, among them one that is not there: 10 bytes of data and 4 of them back.
    let mut data = vec![4, 0];
    for id in [40_u16, 89, 650, 9999] {
        data.extend(id.to_le_bytes());
    }
    let request =
        ExplicitRequest::new(crate::wire::status::Service::GET_ATTRIBUTE_LIST, 0x42, 1, &data).unwrap();
    let ticket = net.master().submit(mac(5), request).unwrap();
    run(&mut net, &controllers, 100);
    let answer = net.events.iter().find_map(|event| match event {
        Event::Explicit { ticket: of, outcome } if *of == ticket => Some(outcome.clone()),
        _ => None,
    });
    let Some(Outcome::Done(data)) = answer else { panic!("{answer:?}") };
    assert_eq!(data[..2], [4, 0]);
    assert_eq!(data[2..7], [40, 0, 0, 0, 1], "position control");
    assert_eq!(data[7..12], [89, 0, 0, 0, 1], "configuration complete");
    assert_eq!(data[12..17], [0x8A, 2, 0, 0, 2], "Stopped");
    assert_eq!(data[17..19], [0x0F, 0x27]);
}

/// The drive's memory: a gain that a service has set is there after the connection was closed, opened, lost, and after a Reset of type 0.
#[test]
fn what_a_service_sets_outlives_connections_and_a_reset_of_type_0() {
    let gain = AttributeDefinition {
        default: DefaultValue::Real(50.0),
        ..AttributeDefinition::new(Scope::Instance, 441, DataType::Real, Access::Set, "Kpp")
    };
    // A value that nobody sets is not remembered.
    let load = AttributeDefinition::new(Scope::Instance, 635, DataType::Real, Access::Get, "Motor Capacity");
    let config = MotionDriveConfig {
        attributes: vec![gain, load],
        faults: Vec::new(),
        servo: ServoParameters::default(),
    };
    let slave = Slave::new(slave_config(5), MotionDrive::new(config).unwrap());
    let mut net = Net::with(vec![(motion(5).0, Node::Motion(slave))]);
    net.exchange();
    let controllers = [RefCell::new(Controller::new(5, SetPoint::Position(0), Watched::Position))];
    run(&mut net, &controllers, 100);
    let value = |net: &mut Net, id| {
        let device = net.motion(1).application().device();
        f32::from_le_bytes(device.attribute(0, id).unwrap().try_into().unwrap())
    };
    assert_eq!(value(&mut net, 441), 50.0, "as it comes from its maker");
    let set = [&[1, 0, 0xB9, 1][..], &75.5_f32.to_le_bytes()].concat();
    let request =
        ExplicitRequest::new(crate::wire::status::Service::SET_ATTRIBUTE_LIST, 0x42, 1, &set).unwrap();
    net.master().submit(mac(5), request).unwrap();
    net.motion(1).application_mut().device_mut().put_attribute(0, 635, &9.0_f32.to_le_bytes()).unwrap();
    run(&mut net, &controllers, 100);
    assert_eq!((value(&mut net, 441), value(&mut net, 635)), (75.5, 9.0));
    let now = net.now;
    net.master().stop(now);
    net.run_for(100);
    assert!(net.motion(1).application().device().connection().is_none(), "{}", net.text());
    assert_eq!((value(&mut net, 441), value(&mut net, 635)), (75.5, 0.0), "closed");
    net.motion(1).application_mut().reset(ResetKind::PowerCycle);
    assert_eq!(value(&mut net, 441), 75.5, "a Reset of type 0");
    net.motion(1).application_mut().reset(ResetKind::FactoryDefaults);
    assert_eq!(value(&mut net, 441), 50.0, "and of type 1");
}

#[test]
fn three_drives_and_one_that_fails() {
    let velocity = |number| (number, SetPoint::Velocity(0.0), Watched::Velocity);
    let (mut net, controllers) = stopped(&[velocity(5), velocity(9), velocity(63)]);
    enable(&mut net, &controllers);
    for controller in &controllers {
        controller.borrow_mut().end.set(SetPoint::Velocity(1.0)).unwrap();
    }
    run(&mut net, &controllers, 300);
    net.plug(2, false);
    run(&mut net, &controllers, 300);
    assert!(net.said(0, "slave 9: poll connection: 3 answers in a row are missing"), "{}", net.text());
    // It has stopped on its own, with the fault of a lost connection; the others have noticed nothing.
    assert!(net.said(2, "poll connection: established -> timed out"), "{}", net.text());
    assert_eq!(net.motion(2).application().axis_state(), AxisState::MajorFaulted);
    assert_eq!(net.motion(2).application().servo().position(), {
        run(&mut net, &controllers, 50);
        net.motion(2).application().servo().position()
    });
    for number in [0, 2] {
        assert_eq!(controllers[number].borrow().end.axis_state(), Some(AxisStateCode::RUNNING));
        assert_eq!(controllers[number].borrow().errors, []);
    }
    // It comes back, and moves only when it is asked anew.
    net.plug(2, true);
    run(&mut net, &controllers, 4000);
    assert!(
        net.log.iter().filter(|(_, _, text)| text == "slave 9: exchanging").count() == 2,
        "{}",
        net.text()
    );
    assert_ne!(net.motion(2).application().axis_state(), AxisState::Running);
    assert_eq!(net.motion(1).application().axis_state(), AxisState::Running);
    insta::assert_snapshot!(net.text());
}

#[test]
fn a_slave_that_is_given_back_while_its_axis_runs_has_no_torque_and_no_fault() {
    let (mut net, controllers) = stopped(&[(5, SetPoint::Velocity(0.0), Watched::Velocity)]);
    enable(&mut net, &controllers);
    controllers[0].borrow_mut().end.set(SetPoint::Velocity(1.0)).unwrap();
    run(&mut net, &controllers, 200);
    let now = net.now;
    net.master().stop(now);
    net.run_for(5);
    assert_eq!(net.motion(1).application().axis_state(), AxisState::Initializing, "{}", net.text());
    net.run_for(300);
    assert_eq!(net.motion(1).application().axis_state(), AxisState::Initializing, "nobody has lost anything");
    assert_eq!(net.motion(1).application().actual().torque.0, 0);
}

#[test]
fn another_rate_is_another_connection() {
    let (mut net, controllers) = stopped(&[(5, SetPoint::Velocity(0.0), Watched::Velocity)]);
    enable(&mut net, &controllers);
    let rate = ExplicitRequest::set(5, 2, 9, &[20, 0]).unwrap();
    net.master().submit(mac(5), rate).unwrap();
    run(&mut net, &controllers, 100);
    let drive = net.motion(1).application();
    assert_eq!(drive.device().connection().map(|connection| connection.rpi_us), Some(20_000));
    assert_eq!(drive.axis_state(), AxisState::Initializing, "and the axis begins anew");
    assert_eq!(drive.actual().velocity.0, 0);
}
