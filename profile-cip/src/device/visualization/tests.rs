use super::display::{Line, LineText, NodeCondition, Startup, line};
use super::*;
use crate::wire::motion::codes::{NodeAlarm, NodeFault};

fn axis(state: AxisState, bus_up: bool) -> AxisCondition {
    AxisCondition::new(ControlKind::Active, state, bus_up)
}

/// Table 9-1.2 as it is printed: axis state, bus, unrecoverable; Module Status; Axis Status plain, with a minor fault,
/// with an alarm.
const TABLE_9_1_2: &[(AxisState, bool, bool, &str, [&str; 3])] = &[
    (AxisState::SelfTest, false, false, "flashing red/green", ["flashing red/green"; 3]),
    (AxisState::Initializing, false, false, "flashing green", ["off"; 3]),
    (AxisState::Initializing, true, false, "flashing green", ["flashing green"; 3]),
    (AxisState::Shutdown, false, false, "flashing green", ["off"; 3]),
    (
        AxisState::Shutdown,
        true,
        false,
        "flashing green",
        ["flashing amber", "red-off-amber-off", "flashing amber"],
    ),
    (AxisState::PreCharge, false, false, "flashing green", ["off"; 3]),
    (
        AxisState::StartInhibited,
        true,
        false,
        "flashing green",
        ["flashing amber", "red-off-amber-off", "flashing amber"],
    ),
    (
        AxisState::Stopped,
        true,
        false,
        "solid green",
        ["flashing green", "red-off-green-off", "amber-off-green-off"],
    ),
    (AxisState::Stopping, true, false, "solid green", ["solid green", "red-green", "amber-green"]),
    (AxisState::Starting, true, false, "solid green", ["solid green", "red-green", "amber-green"]),
    (AxisState::Running, true, false, "solid green", ["solid green", "red-green", "amber-green"]),
    (AxisState::Testing, true, false, "solid green", ["solid green", "red-green", "amber-green"]),
    (AxisState::Aborting, true, false, "flashing red", ["flashing red"; 3]),
    (AxisState::MajorFaulted, true, false, "flashing red", ["flashing red"; 3]),
    (AxisState::Aborting, true, true, "solid red", ["solid red"; 3]),
    (AxisState::MajorFaulted, true, true, "solid red", ["solid red"; 3]),
];

#[test]
fn every_row_of_the_table_of_states_and_lamps() {
    for (state, bus_up, unrecoverable, module, [plain, minor, alarmed]) in TABLE_9_1_2 {
        let row = AxisCondition { unrecoverable: *unrecoverable, ..axis(*state, *bus_up) };
        let minor_fault = AxisCondition { minor_fault: true, ..row };
        let alarm = AxisCondition { alarm: Some((AlarmType::AXIS, 3)), ..row };
        let both = AxisCondition { minor_fault: true, ..alarm };
        for (what, condition, expected) in [
            ("plain", row, plain),
            ("minor fault", minor_fault, minor),
            ("alarm", alarm, alarmed),
            ("both", both, minor),
        ] {
            let case = format!("{state:?}, bus {bus_up}, {what}");
            assert_eq!(axis_status(&condition).name(), Some(*expected), "{case}");
            // Minor faults and alarms are not recognized by the Module Status LED.
            assert_eq!(module_status(module_state([&condition].into_iter())).name(), Some(*module), "{case}");
        }
    }
    assert_eq!(axis_status(&axis(AxisState::Off, false)), Indication::OFF);
    let covered = TABLE_9_1_2.iter().map(|row| row.0).collect::<Vec<_>>();
    for state in AxisState::ALL {
        assert!(state == AxisState::Off || covered.contains(&state), "{state:?} has no row");
    }
}

#[test]
fn the_worst_axis_speaks_for_the_device_in_the_order_of_the_standard() {
    let unrecoverable = AxisCondition { unrecoverable: true, ..axis(AxisState::MajorFaulted, true) };
    // Clause 9-1.1.1.6: from the weightiest.
    let order = [
        (unrecoverable, "solid red"),
        (axis(AxisState::Aborting, true), "flashing red"),
        (axis(AxisState::StartInhibited, true), "flashing green"),
        (axis(AxisState::Running, true), "solid green"),
    ];
    for (heavy, (axis, expected)) in order.iter().enumerate() {
        for (light, _) in &order[heavy..] {
            for pair in [[axis, light], [light, axis]] {
                assert_eq!(module_status(module_state(pair.into_iter())).name(), Some(*expected));
            }
        }
    }
}

#[test]
fn an_axis_without_control_counts_only_with_a_fault() {
    let feedback = |state| AxisCondition::new(ControlKind::FeedbackOnly, state, true);
    let standby = axis(AxisState::PreCharge, false);
    let running = axis(AxisState::Running, true);
    let of = |axes: &[AxisCondition]| module_state(axes.iter());
    assert_eq!(of(&[feedback(AxisState::StartInhibited), running]), ModuleState::Operational);
    assert_eq!(of(&[feedback(AxisState::Running), standby]), ModuleState::Standby);
    let faulted = AxisCondition { unrecoverable: true, ..feedback(AxisState::MajorFaulted) };
    assert_eq!(of(&[faulted, running]), ModuleState::MajorRecoverableFault);
    assert_eq!(of(&[feedback(AxisState::Running)]), ModuleState::Operational);
    assert_eq!(of(&[]), ModuleState::Standby);

    let node = NodeCondition { startup: Startup::Complete, ..NodeCondition::default() };
    assert_eq!(line(&node, &feedback(AxisState::Running)), Line::default());
    let alarmed = AxisCondition { alarm: Some((AlarmType::AXIS, 9)), ..feedback(AxisState::Running) };
    assert_eq!(line(&node, &alarmed).characters(Some(3)).as_str(), "X3:ALARM S09");
    let faulted = AxisCondition { fault: Some((FaultType::AXIS, 42)), ..feedback(AxisState::MajorFaulted) };
    assert_eq!(line(&node, &faulted).characters(Some(3)).as_str(), "X3:FLT S42");
}

#[test]
fn the_network_lamp_for_every_condition() {
    // self test, address, duplicate, connected, timed out: the first row that fits, an x is any.
    let rows: [([Option<bool>; 5], &str); 6] = [
        ([Some(true), None, None, None, None], "flashing red/green"),
        ([Some(false), Some(false), None, None, None], "off"),
        ([Some(false), Some(true), Some(true), None, None], "solid red"),
        ([Some(false), Some(true), Some(false), None, Some(true)], "flashing red"),
        ([Some(false), Some(true), Some(false), Some(true), Some(false)], "solid green"),
        ([Some(false), Some(true), Some(false), Some(false), Some(false)], "flashing green"),
    ];
    for bits in 0..32_u8 {
        let values: [bool; 5] = core::array::from_fn(|bit| bits >> bit & 1 != 0);
        let [self_test, address, duplicate, connected, timed_out] = values;
        let network = NetworkCondition { self_test, address, duplicate, connected, timed_out };
        let fits = |row: &&([Option<bool>; 5], &str)| {
            row.0.iter().zip(values).all(|(wanted, is)| wanted.is_none_or(|wanted| wanted == is))
        };
        let row = rows.iter().find(fits).unwrap();
        assert_eq!(network_status(&network).name(), Some(row.1), "{network:?}");
    }
}

/// Tables 9-1.3 to 9-1.5: a text, the display of one axis, the one of the second of several, and seven segments.
const STRINGS: &[(LineText, &str, &str, &str)] = &[
    (LineText::SELF_TEST, "SELF-TEST", "SELF-TEST", "8"),
    (LineText::STANDBY, "STANDBY", "STANDBY", "0"),
    (LineText::CONNECTING, "CONNECTING", "CONNECTING", "0"),
    (LineText::CONFIGURING, "CONFIGURING", "CONFIGURING", "1"),
    (LineText::SYNCING, "SYNCING", "SYNCING", "2"),
    (LineText::PRE_CHARGE, "PRE-CHARGE", "PRE-CHARGE", "3"),
    (LineText::SHUTDOWN, "SHUTDOWN", "X2:SHUTDOWN", "4"),
    (LineText::STOPPED, "STOPPED", "X2:STOPPED", "4"),
    (LineText::INHIBITED, "INHIBITED", "X2:INHIBITED", "4"),
    (LineText::STARTING, "STARTING", "X2:STARTING", "4"),
    (LineText::RUNNING, "RUNNING", "X2:RUNNING", "4"),
    (LineText::TESTING, "TESTING", "X2:TESTING", "4"),
    (LineText::STOPPING, "STOPPING", "X2:STOPPING", "4"),
    (LineText::ABORTING, "ABORTING", "X2:ABORTING", "4"),
    (LineText::INIT_FAULT, "INIT FLT S07", "X2:INIT FLT S07", "I07"),
    (LineText::INIT_FAULT_MFG, "INIT FLT M07", "X2:INIT FLT M07", "Ic07"),
    (LineText::FAULT, "FLT S07", "X2:FLT S07", "F07"),
    (LineText::FAULT_MFG, "FLT M07", "X2:FLT M07", "Fc07"),
    (LineText::ALARM, "ALARM S07", "X2:ALARM S07", "A07"),
    (LineText::ALARM_MFG, "ALARM M07", "X2:ALARM M07", "Ac07"),
    (LineText::INHIBIT, "INHIBIT S07", "X2:INHIBIT S07", "S07"),
    (LineText::INHIBIT_MFG, "INHIBIT M07", "X2:INHIBIT M07", "Sc07"),
    (LineText::SAFETY_FAULT, "SAFE FLT S07", "X2:SAFE FLT S07", "SF07"),
    (LineText::SAFETY_FAULT_MFG, "SAFE FLT M07", "X2:SAFE FLT M07", "SFc07"),
    (LineText::NODE_FAULT, "NODE FLT 07", "NODE FLT 07", "nF07"),
    (LineText::NODE_ALARM, "NODE ALARM 07", "NODE ALARM 07", "nA07"),
    (LineText::APR_FAULT, "APR FLT S07", "X2:APR FLT S07", "F07"),
    (LineText::APR_FAULT_MFG, "APR FLT M07", "X2:APR FLT M07", "Fc07"),
];

#[test]
fn every_string_of_the_displays() {
    assert_eq!(STRINGS.len() + 1, LineText::NAMED.len(), "a text has no row");
    for (text, single, several, segments) in STRINGS {
        let shown = Line { text: *text, code: 7 };
        assert_eq!(shown.characters(None).as_str(), *single);
        assert_eq!(shown.characters(Some(2)).as_str(), *several);
        assert_eq!(shown.segments().as_str(), *segments);
        let longest = Line { text: *text, code: 255 }.characters(Some(255));
        assert!(longest.len() < display::LINE_MAX, "{longest}");
    }
    assert_eq!(Line::default().characters(Some(2)).as_str(), "");
}

#[test]
fn what_is_shown_first() {
    let complete = NodeCondition { startup: Startup::Complete, ..NodeCondition::default() };
    let text = |node: &NodeCondition, axis: &AxisCondition| line(node, axis).characters(None).to_string();

    // From top to bottom as in the module's table: each condition is added to those below it.
    let mut node = complete;
    let mut axis = axis(AxisState::Stopped, true);
    assert_eq!(text(&node, &axis), "STOPPED");
    axis.alarm = Some((AlarmType::AXIS_MFG, 1));
    assert_eq!(text(&node, &axis), "ALARM M01");
    axis.inhibit = Some((AlarmType::START_INHIBIT, 1));
    assert_eq!(text(&node, &axis), "ALARM M01", "an inhibit is shown only in Start Inhibited");
    axis.state = AxisState::StartInhibited;
    assert_eq!(text(&node, &axis), "INHIBIT S01");
    node.alarm = NodeAlarm(3);
    assert_eq!(text(&node, &axis), "NODE ALARM 03");
    node.startup = Startup::Syncing;
    assert_eq!(text(&node, &axis), "SYNCING");
    axis.fault = Some((FaultType::SAFETY, 63));
    assert_eq!(text(&node, &axis), "SAFE FLT S63");
    axis.state = AxisState::Aborting;
    assert_eq!(text(&node, &axis), "ABORTING");
    node.fault = NodeFault(1);
    assert_eq!(text(&node, &axis), "NODE FLT 01");
    axis.state = AxisState::SelfTest;
    assert_eq!(text(&node, &axis), "SELF-TEST");
}

#[test]
fn the_start_of_a_device_step_by_step() {
    let shown = |startup, state| {
        let node = NodeCondition { startup, ..NodeCondition::default() };
        line(&node, &axis(state, true)).characters(None).to_string()
    };
    for state in [AxisState::Initializing, AxisState::Stopped] {
        assert_eq!(shown(Startup::Standby, state), "STANDBY");
        assert_eq!(shown(Startup::Connecting, state), "CONNECTING");
    }
    assert_eq!(shown(Startup::Configuring, AxisState::Initializing), "CONFIGURING");
    // One axis is ready before the other.
    assert_eq!(shown(Startup::Configuring, AxisState::PreCharge), "PRE-CHARGE");
    for state in [AxisState::PreCharge, AxisState::Stopped, AxisState::StartInhibited, AxisState::Shutdown] {
        assert_eq!(shown(Startup::Syncing, state), "SYNCING");
    }
    // An axis may be enabled without synchronization, and then its state matters.
    for (state, text) in [
        (AxisState::Starting, "STARTING"),
        (AxisState::Running, "RUNNING"),
        (AxisState::Testing, "TESTING"),
        (AxisState::Stopping, "STOPPING"),
    ] {
        assert_eq!(shown(Startup::Syncing, state), text);
    }
    assert_eq!(shown(Startup::Complete, AxisState::Shutdown), "SHUTDOWN");
    assert_eq!(shown(Startup::Complete, AxisState::StartInhibited), "INHIBITED");
    assert_eq!(shown(Startup::Complete, AxisState::MajorFaulted), "FLT S00");
}
