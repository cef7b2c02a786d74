//! What the indicators show from the opened connection to Running, with faults, alarms and the loss of the connection.

use super::*;
use crate::device::motion_link::MotionReply;
use crate::device::objects::identity::ModuleState;
use crate::device::visualization::Indication;
use crate::wire::motion::attribute_list::{AttributeSelector, ListWriter};
use crate::wire::motion::codes::FaultType;

/// Display of both axes, Axis Status LED of the first, state of the device.
fn shown(rig: &Rig) -> (String, String, Indication, ModuleState) {
    let display = |axis: usize| {
        let instance = u8::try_from(axis + 1).expect("fits");
        rig.device.display_line(axis).characters(Some(instance)).to_string()
    };
    (display(0), display(1), rig.device.axis_indication(0), rig.device.module_state())
}

fn both(text: &str, indication: Indication, state: ModuleState) -> (String, String, Indication, ModuleState) {
    let of = |instance| if text.starts_with(':') { format!("X{instance}{text}") } else { text.to_owned() };
    (of(1), of(2), indication, state)
}

#[test]
fn from_standby_to_running() {
    let mut rig = Rig::new();
    rig.drives.iter_mut().for_each(|d| d.image.bus_up = false);
    assert_eq!(shown(&rig), both("STANDBY", Indication::OFF, ModuleState::Standby));
    rig.open();
    rig.cycle();
    assert_eq!(shown(&rig), both("CONNECTING", Indication::OFF, ModuleState::Standby));

    let mut body = [0; 64];
    let mut list = ListWriter::new(&mut body).expect("room");
    list.value(&AttributeSelector::scalar(35, 4), &2_000_000_u32.to_le_bytes()).expect("room");
    let len = list.finish();
    rig.services[0] = Some((1, MotionService::SET_AXIS_ATTRIBUTES_LIST, body[..len].to_vec()));
    rig.cycle();
    assert_eq!(shown(&rig), both("CONFIGURING", Indication::OFF, ModuleState::Standby));
    rig.services[0] = None;
    rig.cycle();
    rig.configure();
    rig.cycles(2);
    assert_eq!(shown(&rig), both("SYNCING", Indication::OFF, ModuleState::Standby));

    rig.services[0] = Some((2, MotionService::GROUP_SYNC, [9; 8].to_vec()));
    rig.cycle();
    assert_eq!(shown(&rig).0, "SYNCING", "another grand master");
    rig.services[0] = Some((3, MotionService::GROUP_SYNC, GRANDMASTER.to_vec()));
    rig.cycle();
    assert_eq!(shown(&rig), both("PRE-CHARGE", Indication::OFF, ModuleState::Standby));
    rig.services[0] = None;

    rig.drives.iter_mut().for_each(|d| d.image.bus_up = true);
    rig.cycle();
    assert_eq!(shown(&rig), both(":STOPPED", Indication::FLASHING_GREEN, ModuleState::Operational));
    rig.request_all(AxisControl::ENABLE);
    rig.cycles(4);
    assert_eq!(shown(&rig), both(":RUNNING", Indication::SOLID_GREEN, ModuleState::Operational));
    rig.request_all(AxisControl::NONE);
    rig.cycle();

    rig.close();
    assert_eq!(shown(&rig).0, "STANDBY");
}

#[test]
fn faults_of_one_axis_and_of_the_node() {
    let mut rig = Rig::running();
    let fault =
        DriveCondition { fault_type: FaultType::AXIS, code: 4, action: 0x24, ..DriveCondition::default() };
    let minor = DriveCondition { least: ExceptionAction::MINOR_FAULT, ..fault };
    rig.drives[1].image.conditions =
        DriveConditions::of(&[DriveCondition { least: ExceptionAction::MAJOR_FAULT, ..fault }]);
    rig.cycle();
    assert_eq!(rig.device.display_line(1).characters(None).as_str(), "ABORTING");
    rig.cycles(6);
    let (first, second, indication, state) = shown(&rig);
    assert_eq!((second.as_str(), state), ("X2:FLT S04", ModuleState::MajorRecoverableFault));
    assert_ne!(first, second);
    assert_eq!(indication, Indication::SOLID_GREEN, "the other axis runs on");
    assert_eq!(rig.device.axis_indication(1), Indication::FLASHING_RED);
    assert_eq!(rig.device.axis_indication(2), Indication::OFF);

    let mut rig = Rig::running();
    rig.drives[0].image.conditions = DriveConditions::of(&[minor]);
    rig.cycles(2);
    let (first, _, indication, state) = shown(&rig);
    let expected = ("X1:FLT S04", Indication::RED_GREEN, ModuleState::Operational);
    assert_eq!((first.as_str(), indication, state), expected, "a minor fault shows at the axis alone");

    rig.now += 20 * PERIOD;
    rig.run_device();
    assert!(rig.device.is_connection_lost());
    let (first, second, indication, state) = shown(&rig);
    assert_eq!((first.as_str(), second.as_str()), ("NODE FLT 06", "NODE FLT 06"));
    assert_eq!((indication, state), (Indication::FLASHING_RED, ModuleState::MajorRecoverableFault));
    assert!(matches!(rig.device.poll_reply(), Some(MotionReply::ConnectionLost { .. })));
    rig.open();
    assert!(!rig.device.is_connection_lost());
}
