//! Every request of Axis Control in every state: Tables 5-2.101 to 5-2.104 as one table.

use std::fmt::Write as _;

use super::*;

/// A rig whose first axis is in `state`.
fn rig_in(state: AxisState) -> Rig {
    let mut rig = match state {
        AxisState::Initializing => {
            let mut rig = Rig::new();
            rig.open();
            rig.cycles(2);
            rig
        }
        AxisState::Running | AxisState::Stopping | AxisState::Aborting | AxisState::MajorFaulted => {
            Rig::running()
        }
        _ => Rig::stopped(),
    };
    let drive = &mut rig.drives[0];
    match state {
        AxisState::PreCharge => drive.image.bus_up = false,
        AxisState::StartInhibited => drive.image.start_inhibits = 1 << 5,
        AxisState::Starting => {
            drive.stuck = true;
            rig.blocks[0].axis_control = AxisControl::ENABLE;
        }
        AxisState::Stopping => {
            drive.stuck = true;
            rig.blocks[0].axis_control = AxisControl::DISABLE;
        }
        AxisState::Aborting => {
            drive.stuck = true;
            rig.raise(0, 54, 0x22);
        }
        AxisState::MajorFaulted => rig.raise(0, 54, 0x22),
        AxisState::Shutdown => rig.blocks[0].axis_control = AxisControl::SHUTDOWN,
        _ => {}
    }
    rig.cycles(4);
    rig.drives[0].image.conditions = DriveConditions::default();
    rig.blocks[0].axis_control = AxisControl::NONE;
    rig.cycles(2);
    assert_eq!(rig.state(0), state);
    rig
}

#[test]
fn every_request_in_every_state() {
    let requests: Vec<AxisControl> = (1..=10).chain([126, 127, 128, 255]).map(AxisControl).collect();
    let states = [
        AxisState::Initializing,
        AxisState::PreCharge,
        AxisState::Stopped,
        AxisState::Starting,
        AxisState::Running,
        AxisState::Stopping,
        AxisState::Aborting,
        AxisState::MajorFaulted,
        AxisState::StartInhibited,
        AxisState::Shutdown,
    ];
    let mut table = String::new();
    for state in states {
        for request in &requests {
            let mut rig = rig_in(state);
            rig.blocks[0].values.position_displacement = Some(5);
            rig.blocks[0].axis_control = *request;
            rig.cycle();
            // The drive obeys from the second cycle on, unless it is one that never ends what it begins.
            rig.cycles(4);
            let actual = rig.actual(0);
            let answer = match (actual.axis_response, actual.response_status) {
                (AxisControl::NONE, 0) => "goes on".to_owned(),
                (response, 0) => {
                    assert_eq!(response, *request);
                    "done".to_owned()
                }
                (response, status) => {
                    assert_eq!(response, *request);
                    format!("error 0x{status:02X}")
                }
            };
            let (state, request, end) = (state.to_string(), request.to_string(), rig.state(0).to_string());
            writeln!(table, "{state:<16}{request:<38}{end:<16}{answer}").expect("a string");
        }
    }
    insta::assert_snapshot!(table);
}

/// A code without a request gives nothing that the controller could take for an answer, in no state.
#[test]
fn no_request_is_no_answer() {
    let mut rig = Rig::running();
    rig.blocks[0].axis_control = AxisControl::NONE;
    rig.cycles(5);
    assert_eq!((rig.actual(0).axis_response, rig.actual(0).response_status), (AxisControl::NONE, 0));
}
