//! The codes and bits of the CIP Motion dictionary, against figures typed from the standard, and against the wire
//! code of the profile crate.

use profile_cip::wire::motion::codes::{
    ActualDataSet, AlarmType, AxisControl, AxisIoStatus, AxisStateCode, AxisStatus, ClearingEvent,
    CommandDataSet, CommandTarget, ConnectionFormat, ControlMode, ControlStatus, EventChecking, EventType,
    FaultType, FeedbackSource, NodeAlarm, NodeControl, NodeFault, NodeStatus, StatusDataSet, SyncStatus,
    TestStatus, TimeDataSet,
};
use profile_cip::wire::status::GeneralStatus;

use super::*;

fn cip() -> &'static CipDictionary {
    &shipped().dictionaries.cip
}

/// The set with this name, of codes or of bits.
fn set(name: &str) -> &'static Enumeration {
    let found = cip().enumeration(name).or_else(|| cip().bits(name));
    found.unwrap_or_else(|| panic!("no set `{name}`"))
}

fn name_of(set_name: &str, code: u32) -> &'static str {
    let found = set(set_name).codes.iter().find(|known| known.code == code);
    found.map_or("", |known| known.name.as_str())
}

fn sets() -> impl Iterator<Item = &'static Enumeration> {
    cip().enumerations().iter().chain(cip().bit_sets())
}

/// Named rows of each set, counted in the tables of the standard.
const COUNTS: &[(&str, usize)] = &[
    ("Control Mode", 5),
    ("Control Method", 3),
    ("Motion Unit", 15),
    ("Motor Type", 5),
    ("Load Type", 4),
    ("Actuator Type", 5),
    ("Feedback Mode", 5),
    ("Feedback Type", 18),
    ("Event Checking", 26),
    ("Event Type", 17),
    ("Current Limit Source", 8),
    ("Stopping Action", 5),
    ("Axis State", 11),
    ("Axis Status", 25),
    ("Axis I/O Status", 10),
    ("Axis Control", 11),
    ("Axis Response", 11),
    ("Axis Safety State", 11),
    ("Axis Safety Status", 25),
    ("Axis Safety Faults", 12),
    ("Axis Exceptions", 58),
    ("Axis Exception Action", 5),
    ("Initialization Faults", 3),
    ("APR Faults", 7),
    ("Start Inhibits", 5),
    ("Axis Fault Type", 9),
    ("Axis Alarm Type", 5),
    ("Fault Clearing Event", 5),
    ("Axis Fault Action - Stop", 4),
    ("Axis Fault Action - State Change", 4),
    ("Node Fault Code", 10),
    ("Node Alarm Code", 7),
    ("Node Control", 4),
    ("Node Status", 4),
    ("Time Data Set", 4),
    ("Control Status", 4),
    ("Command Data Set", 6),
    ("Actual Data Set", 5),
    ("Status Data Set", 5),
    ("Registration Data Set", 4),
    ("Connection Type", 8),
    ("Sync Status", 4),
    ("Inertia Test Status", 9),
    ("Hookup Test Type", 4),
    ("Hookup Test Status", 7),
];

#[test]
fn sets_have_as_many_rows_as_the_tables() {
    for (name, count) in COUNTS {
        assert_eq!(set(name).codes.len(), *count, "{name}");
    }
    let rows: usize = sets().map(|set| set.codes.len()).sum();
    let holders = |set: &Enumeration| (set.attributes.len() + set.class_attributes.len()).max(1);
    let held: usize = sets().map(|set| set.codes.len() * holders(set)).sum();
    let ranges: usize = sets().map(|set| set.ranges.len()).sum();
    // A set that several attributes share, as the four feedback channels do, is written once.
    assert_eq!((sets().count(), rows, held, ranges), (129, 614, 860, 147));
}

const NAMES: &[(&str, u32, &str)] = &[
    ("Control Mode", 4, "Torque Control"),
    ("Control Method", 1, "Frequency Control"),
    ("Motion Scaling Configuration", 1, "Drive Scaling"),
    ("Motion Unit", 2, "Feedback Rev"),
    ("Motion Unit", 14, "Load inch/s"),
    ("Motion Polarity", 1, "Inverted Polarity"),
    ("Cyclic Unwind Control", 1, "Cyclic Operation"),
    ("Command Target Update", 2, "Interpolate (+2 UP)"),
    ("Command Position Data Type", 1, "DINT"),
    ("Control Status", 3, "Converter Bus Unload"),
    ("Registration Data Set", 2, "Reg 2 Pos Window"),
    ("Home Data Set", 1, "Home Torque Time"),
    ("Watch Data Set", 0, "Watch 1 Position"),
    ("Motor Data Source", 2, "Motor NV"),
    ("Motor Type", 3, "Linear Permanent Magnet"),
    ("Motor Unit", 1, "Meter"),
    ("Load Type", 3, "Linear Actuator"),
    ("Actuator Type", 4, "Rack and Pinion"),
    ("Actuator Lead Unit", 0, "mm/Rev"),
    ("Actuator Diameter Unit", 1, "Inch"),
    ("Feedback Mode", 4, "Dual Feedback"),
    ("Feedback Master Select", 2, "Feedback 2"),
    ("Feedback Resolution Unit", 2, "Bits/Unit"),
    ("Feedback Type", 9, "Resolver"),
    ("Feedback Type", 14, "Integrated"),
    ("Feedback Type", 17, "BiSS Sine/Cosine"),
    ("Feedback Startup Method", 1, "Absolute"),
    ("Feedback Data Code", 1, "Gray"),
    ("Feedback LDT Type", 2, "Start/Stop Falling"),
    ("Event Checking", 10, "Reg 2 Pos Auto-rearm"),
    ("Event Checking", 15, "Watch Position 2 Rev"),
    ("Event Checking", 24, "Home Torque Threshold"),
    ("Event Type", 6, "Home Switch Positive Edge"),
    ("Event Type", 16, "Watch 2 Position Reverse"),
    ("Flying Start Method", 2, "Sweep Frequency"),
    ("Position Integrator Control", 1, "Auto-Preset"),
    ("Velocity Integrator Control", 0, "Integrator Hold Enable"),
    ("Current Limit Source", 5, "Shunt Regulator Limit"),
    ("Current Limit Source", 7, "Brake Test Limit"),
    ("Flux Up Control", 2, "Automatic Delay"),
    ("Commutation Startup Method", 3, "Self-Sense"),
    ("Commutation Alignment", 2, "Motor Offset"),
    ("Frequency Control Method", 0, "Basic Volts/Hertz"),
    ("Proving Configuration", 1, "Enabled"),
    ("Stopping Action", 2, "Ramped Decel & Disable"),
    ("Mechanical Brake Control", 1, "Brake Release"),
    ("Bus Configuration", 3, "Shared DC - Non-CIP Converter"),
    ("Bus Voltage Select", 1, "Low"),
    ("Power Loss Action", 1, "Coast Thru"),
    ("Shutdown Action", 1, "Drop DC Bus"),
    ("Converter Overload Protection Method", 1, "I2T Overload"),
    ("Inverter Overload Action", 1, "Current Foldback"),
    ("Duty Select", 2, "Light"),
    ("Axis State", 8, "Major Faulted"),
    ("Axis Status", 17, "Feedback Integrity"),
    ("Axis Status", 21, "AC Power Loss"),
    ("Axis I/O Status", 4, "Positive Overtravel OK Input"),
    ("Axis I/O Status", 9, "Motor Thermostat OK Input"),
    ("Axis Control", 9, "Change Command Position Reference Request"),
    ("Axis Response", 127, "Cancel Acknowledge"),
    ("Local Control", 1, "Conditionally Allowed"),
    ("Axis Safety State", 6, "Critical Fault"),
    ("Axis Safety State", 52, "Executing with Torque Permitted"),
    ("Axis Safety Status", 9, "Safe Operating Stop Active"),
    ("Axis Safety Status", 23, "Safe Limited Direction Status"),
    ("Axis Safety Status", 31, "Safety Output Connection Idle"),
    ("Axis Safety Faults", 7, "Safe Brake Fault"),
    ("Axis Safety Faults", 19, "Safe Limited Direction Fault"),
    ("Safe Torque Off Action", 1, "Current Decel & Disable"),
    ("Axis Exceptions", 9, "Motor Phase Loss"),
    ("Axis Exceptions", 25, "Converter Pre-Charge Failure"),
    ("Axis Exceptions", 31, "Bus Regulator Failure"),
    ("Axis Exceptions", 40, "Bus Power Sharing"),
    ("Axis Exceptions", 47, "Feedback Device Failure"),
    ("Axis Exceptions", 49, "Brake Slip"),
    ("Axis Exceptions", 54, "Excessive Position Error"),
    ("Axis Exceptions", 60, "Illegal Control Mode"),
    ("Axis Exceptions", 63, "External Exception Input"),
    ("Axis Exception Action", 255, "Unsupported"),
    ("Initialization Faults", 2, "Main Block Checksum Fault"),
    ("APR Faults", 5, "Scaling Configuration Changed"),
    ("Start Inhibits", 5, "Safe Torque Off Active"),
    ("Axis Fault Type", 5, "APR Fault"),
    ("Axis Alarm Type", 1, "Start Inhibit"),
    ("Fault Clearing Event", 4, "Connection Reset"),
    ("Axis Fault Action - Stop", 3, "Current Limited Stop"),
    ("Axis Fault Action - State Change", 1, "Hold"),
    ("Axis Alarm State", 1, "Alarm Bit On"),
    ("Node Fault Code", 6, "Control Connection Loss Fault"),
    ("Node Alarm Code", 3, "Clock Jitter Alarm"),
    ("Node Control", 2, "Controller Data Valid"),
    ("Node Status", 3, "Device Node Fault"),
    ("Time Data Set", 0, "Time Stamp"),
    ("Connection Type", 6, "Variable Controller-to-Device Connection"),
    ("Revision", 4, "Revision 4"),
    ("Device Type", 0x2F, "CIP Motion Encoder"),
    ("Connection Point", 0x51, "Configuration block, revision 1"),
    ("Sync Status", 3, "clock skew detected"),
    ("Motor Test Type", 2, "calculated"),
    ("Motor Test Data Set", 1, "vendor specific data"),
    ("Motor Test Status", 3, "test process timed-out"),
    ("Inertia Test Direction", 1, "reverse"),
    ("Inertia Test Status", 6, "test polarity incorrect"),
    ("Hookup Test Type", 2, "marker test"),
    ("Hookup Test Status", 6, "test failed no feedback 2"),
    ("Hookup Feedback Direction", 1, "Negative"),
    ("Hookup Commutation Polarity", 1, "Inverted"),
];

#[test]
fn codes_have_the_names_of_the_standard() {
    for (set, code, name) in NAMES {
        assert_eq!(name_of(set, *code), *name, "{set} {code}");
    }
}

#[test]
fn codes_say_to_whom_they_matter() {
    let cases = [
        ("Control Mode", 2, Some('R'), "PV"),
        ("Control Mode", 3, Some('O'), ""),
        ("Control Method", 0, Some('R'), "N"),
        ("Feedback Mode", 4, Some('O'), "P"),
        ("Feedback Type", 0, Some('R'), ""),
        ("Feedback Type", 15, None, ""),
        ("Stopping Action", 2, Some('O'), "FV"),
        ("Axis Status", 8, Some('R'), "ED"),
        ("Axis Status", 10, Some('O'), "FPV"),
        ("Axis I/O Status", 4, Some('R'), "P"),
        ("Command Data Set", 3, Some('R'), "T"),
        ("Actual Data Set", 6, Some('R'), "E"),
        ("Axis Exception Action", 3, Some('R'), ""),
        ("Axis Exceptions", 22, None, "BD"),
        ("Axis Exceptions", 55, None, "PV"),
        ("Axis Exceptions", 56, None, "C"),
        ("Local Control", 0, Some('R'), ""),
    ];
    for (name, code, need, rule) in cases {
        let row = set(name).codes.iter().find(|row| row.code == code).unwrap();
        assert_eq!((row.need, row.rule.as_str()), (need, rule), "{name} {code}");
    }
    for set in sets() {
        for row in &set.codes {
            let known = row.rule == "All" || row.rule.chars().all(|letter| "BEFPVTNCD".contains(letter));
            assert!(known, "{} {}: {}", set.name, row.code, row.rule);
        }
    }
}

/// Attributes of the axis for which the standard has a table of values or bits.
const AXIS: &[u16] = &[
    40, 41, 42, 43, 45, 60, 61, 77, 79, 83, 89, 90, 91, 92, 94, 95, 96, 97, 380, 381, 446, 467, 522, 558,
    560, 563, 564, 570, 590, 610, 614, 622, 623, 624, 627, 629, 631, 632, 633, 634, 646, 647, 648, 650, 651,
    652, 653, 654, 655, 656, 657, 658, 659, 660, 661, 662, 664, 665, 666, 667, 668, 669, 672, 673, 674, 675,
    676, 677, 730, 731, 736, 737, 750, 756, 757, 760, 761, 762, 763, 764, 765, 1313, 1315, 1316, 1317, 1323,
    1370, 1373, 1375, 1377,
];

/// The same for the first feedback channel; three more follow, each 50 higher.
const FEEDBACK: &[u16] = &[1410, 1411, 1412, 1413, 1414, 1415, 1421, 1426];

/// The same for instance 0.
const CLASS: &[u16] = &[1, 14, 15, 16, 17, 31];

#[test]
fn every_attribute_with_a_table_of_values_has_a_set_and_no_other_has() {
    let mut expected: Vec<u16> = AXIS.to_vec();
    for channel in 0..4 {
        expected.extend(FEEDBACK.iter().map(|id| id + 50 * channel));
    }
    let mut held: Vec<u16> = sets().flat_map(|set| set.attributes.iter().copied()).collect();
    held.sort_unstable();
    held.dedup();
    expected.sort_unstable();
    assert_eq!(held, expected);
    let mut held: Vec<u16> = sets().flat_map(|set| set.class_attributes.iter().copied()).collect();
    held.sort_unstable();
    held.dedup();
    assert_eq!(held, CLASS);
}

/// Sets for which the document leaves values unsaid, and how many.
const UNSAID: &[(&str, u64)] = &[
    ("Flying Start Method", 253),
    ("Bus Regulator Action", 1),
    ("Motor Overload Protection Method", 254),
    ("Inverter Overload Protection Method", 254),
    ("Converter Overload Protection Method", 254),
    ("Bus Regulator Overload Protection Method", 254),
    ("Motor Test Status", 251),
    ("Revision", 65_532),
    ("Device Type", 252),
    ("Format Revision", 254),
    ("Connection Point", 253),
    ("DeviceNet Body Format", 251),
    ("DeviceNet Fragment Status", 254),
    ("DeviceNet Connection State", 250),
    ("DeviceNet Watchdog Action", 252),
    ("DeviceNet Drive Assembly", 248),
    ("DeviceNet Drive State", 248),
    ("DeviceNet Speed Control", 3),
];

#[test]
fn every_value_is_named_or_in_a_range_unless_the_standard_leaves_it_out() {
    for set in sets() {
        let attributes = set.attributes.iter().filter_map(|id| cip().attribute_by_id(*id));
        let class_attributes = set.class_attributes.iter().filter_map(|id| cip().class_attribute_by_id(*id));
        let bits =
            attributes.chain(class_attributes).filter_map(|row| row.data_type.bits()).min().unwrap_or(8);
        let values = match (set.kind, set.field) {
            (SetKind::Bits { width }, _) => u64::from(width),
            (SetKind::Codes, Some((first, last))) => 1 << (last - first + 1),
            (SetKind::Codes, None) => 1 << bits,
        };
        let ranges: u64 = set.ranges.iter().map(|range| u64::from(range.last - range.first + 1)).sum();
        let unsaid = UNSAID.iter().find(|(name, _)| *name == set.name).map_or(0, |(_, count)| *count);
        let said = u64::try_from(set.codes.len()).unwrap() + ranges;
        assert_eq!(said + unsaid, values, "{}", set.name);
        assert!(!set.codes.is_empty() || !set.ranges.is_empty(), "{}", set.name);
    }
}

#[test]
fn ranges_are_of_their_kind() {
    let kind = |name: &str, code: u32| {
        let found = set(name).ranges.iter().find(|range| (range.first..=range.last).contains(&code));
        found.map(|range| (range.kind, range.name.as_str()))
    };
    assert_eq!(kind("Control Mode", 5), Some((RangeKind::Reserved, "")));
    assert_eq!(kind("Control Mode", 4), None);
    assert_eq!(kind("Feedback Mode", 8), Some((RangeKind::Vendor, "")));
    assert_eq!(kind("Axis Control", 126), Some((RangeKind::Reserved, "")));
    assert_eq!(kind("Axis Control", 128), Some((RangeKind::Vendor, "")));
    assert_eq!(kind("Axis Exceptions", 0), Some((RangeKind::Reserved, "")));
    assert_eq!(kind("Axis Exceptions - Mfg", 63), Some((RangeKind::Vendor, "")));
    assert_eq!(kind("Axis Safety State", 53), Some((RangeKind::Device, "")));
    assert_eq!(kind("Event Checking", 29), Some((RangeKind::Number, "Event Block Count")));
    assert_eq!(kind("Feedback Port Select", 7), Some((RangeKind::Number, "Feedback Port ID")));
}

#[test]
fn rows_that_the_documents_lost_or_dispute_carry_a_note() {
    let noted = [
        ("Axis Safety Status", [17, 18, 19, 20, 21, 22].as_slice()),
        ("Axis Exceptions", &[54, 55, 56, 57]),
        ("Axis Status", &[7, 9, 10, 11, 12, 13, 15, 16, 22, 23, 24]),
        ("Feedback Type", &[7, 8, 13, 15, 16, 17]),
        ("Bus Regulator Action", &[0, 1]),
        ("Time Data Set", &[0, 1]),
        ("APR Faults", &[7]),
        ("Axis I/O Status", &[9]),
        ("Registration Data Set", &[2, 3]),
    ];
    for (name, codes) in noted {
        for code in codes {
            let row = set(name).codes.iter().find(|row| row.code == *code).unwrap();
            assert!(!row.note.is_empty(), "{name} {code}");
        }
    }
    assert!(set("Inverter Overload Action").source.contains("IEC 61800-7-202"));
    assert!(!set("Inverter Overload Action").note.is_empty());
}

#[test]
fn conditions_know_the_attributes_that_limit_them() {
    let limits = |name: &str, code: u32| {
        let row = set(name).codes.iter().find(|row| row.code == code).unwrap();
        row.limits.clone()
    };
    let cases: [(u32, &[u16]); 12] = [
        (1, &[]),
        (3, &[678, 679]),
        (4, &[695]),
        (9, &[694]),
        (16, &[693]),
        (17, &[709]),
        (33, &[689]),
        (36, &[704]),
        (37, &[628, 630]),
        (46, &[708]),
        (54, &[444, 445]),
        (57, &[510, 511]),
    ];
    for (code, ids) in cases {
        assert_eq!(limits("Axis Exceptions", code), ids, "{code}");
    }
    assert_eq!(limits("Node Fault Code", 1), [21]);
    assert_eq!(limits("Node Alarm Code", 1), [22]);
    // Tables 5-2.67 and 5-2.68: every limit belongs to an exception.
    let exceptions = set("Axis Exceptions");
    for id in 678..=709 {
        assert!(exceptions.codes.iter().any(|row| row.limits.contains(&id)), "{id}");
    }
}

#[test]
fn every_type_of_fault_and_alarm_says_what_it_means() {
    let records = cip().fault_records();
    for code in &set("Axis Fault Type").codes {
        let found = records.iter().filter(|row| row.fault_type.map(u32::from) == Some(code.code)).count();
        assert_eq!(found, usize::from(code.code != 0), "{}", code.name);
    }
    for code in &set("Axis Alarm Type").codes {
        let found = records.iter().filter(|row| row.alarm_type.map(u32::from) == Some(code.code)).count();
        assert_eq!(found, usize::from(code.code != 0), "{}", code.name);
    }
    let by_conditions = |name: &str| records.iter().find(|row| row.conditions == name).unwrap();
    let initialization = by_conditions("Initialization Faults");
    assert_eq!(initialization.cleared_by, [Clearing::DeviceReset], "not recoverable");
    assert!(by_conditions("APR Faults").cleared_by.contains(&Clearing::FaultReset), "recoverable");
    assert_eq!(by_conditions("Node Alarm Code").cleared_by, [Clearing::TimeOut]);
    assert_eq!(by_conditions("Axis Exceptions").seven_segment, "F##");
    assert_eq!(by_conditions("Axis Safety Faults").display, "SAFE FLT S##");
    // Nothing that is latched goes by itself, and what is not latched needs no reset.
    for record in records {
        let itself = [Clearing::ConditionGone, Clearing::TimeOut];
        assert!(!record.cleared_by.is_empty(), "{}", record.conditions);
        for way in &record.cleared_by {
            assert_ne!(itself.contains(way), record.latched, "{} {way:?}", record.conditions);
        }
    }
}

#[test]
fn exception_actions_and_status_codes_are_as_told() {
    let actions = cip().exception_actions();
    let codes: Vec<_> = actions.iter().map(|row| (row.code, row.alarms, row.faults, row.stops)).collect();
    let expected = [
        (0, false, false, false),
        (1, true, false, false),
        (2, false, true, false),
        (3, false, true, true),
        (255, false, false, false),
    ];
    assert_eq!(codes, expected);
    let codes: Vec<_> = cip().status_codes().iter().map(|row| (row.general, row.extended)).collect();
    let expected = [(0, None), (9, None), (10, None), (0x14, None), (9, Some(4)), (9, Some(5))];
    assert_eq!(codes, expected);
}

/// That named values of the wire code are those of a set; `left_out` are in the set alone.
fn same(name: &str, wire: &[(u32, &str)], left_out: &[u32]) {
    let of_set: Vec<_> = set(name)
        .codes
        .iter()
        .filter(|row| !left_out.contains(&row.code))
        .map(|row| (row.code, row.name.as_str()))
        .collect();
    assert_eq!(wire, of_set, "{name}");
    assert_eq!(set(name).codes.len(), of_set.len() + left_out.len(), "{name}: left out but not there");
}

macro_rules! codes_of {
    ($code:ident) => {
        $code::NAMED.iter().map(|(code, name)| (u32::from(code.0), *name)).collect::<Vec<_>>()
    };
}

macro_rules! bits_of {
    ($flags:ident) => {
        $flags::NAMED.iter().map(|(flag, name)| (flag.bits().trailing_zeros(), *name)).collect::<Vec<_>>()
    };
}

#[test]
fn codes_on_the_wire_are_those_of_the_dictionary() {
    // Connections between peers are not of this product.
    same("Connection Type", &codes_of!(ConnectionFormat), &[0, 1, 4, 5]);
    same("Control Mode", &codes_of!(ControlMode), &[]);
    same("Feedback Mode", &codes_of!(FeedbackSource), &[]);
    same("Command Target Update", &codes_of!(CommandTarget), &[]);
    same("Axis State", &codes_of!(AxisStateCode), &[]);
    same("Axis Fault Type", &codes_of!(FaultType), &[]);
    same("Fault Clearing Event", &codes_of!(ClearingEvent), &[]);
    same("Axis Alarm Type", &codes_of!(AlarmType), &[]);
    same("Node Fault Code", &codes_of!(NodeFault), &[]);
    same("Node Alarm Code", &codes_of!(NodeAlarm), &[]);
    same("Event Type", &codes_of!(EventType), &[]);
    same("Sync Status", &codes_of!(SyncStatus), &[]);
    // One type for the status of three tests: the values from 5 on differ.
    same("Motor Test Status", &codes_of!(TestStatus), &[]);
    same("Inertia Test Status", &codes_of!(TestStatus), &[5, 6, 7, 8]);
    same("Hookup Test Status", &codes_of!(TestStatus), &[5, 6]);
    // One type for request and acknowledge.
    for (name, zero, suffix) in
        [("Axis Control", "No Request", " Request"), ("Axis Response", "No Acknowledge", " Acknowledge")]
    {
        assert_eq!(set(name).codes.len(), AxisControl::NAMED.len());
        for (code, wire) in AxisControl::NAMED {
            let expected = if code.0 == 0 { zero.to_owned() } else { format!("{wire}{suffix}") };
            assert_eq!(name_of(name, u32::from(code.0)), expected);
        }
    }
}

#[test]
fn bits_on_the_wire_are_those_of_the_dictionary() {
    same("Node Control", &bits_of!(NodeControl), &[]);
    same("Node Status", &bits_of!(NodeStatus), &[]);
    same("Time Data Set", &bits_of!(TimeDataSet), &[]);
    same("Control Status", &bits_of!(ControlStatus), &[]);
    same("Command Data Set", &bits_of!(CommandDataSet), &[]);
    same("Actual Data Set", &bits_of!(ActualDataSet), &[]);
    same("Axis Status", &bits_of!(AxisStatus), &[]);
    same("Axis I/O Status", &bits_of!(AxisIoStatus), &[]);
    // The extended format bit is made by the codec.
    same("Event Checking", &bits_of!(EventChecking), &[31]);
    // The bits of the maker have names on the wire only.
    let (standard, vendor): (Vec<_>, Vec<_>) =
        bits_of!(StatusDataSet).into_iter().partition(|(bit, _)| *bit < 6);
    same("Status Data Set", &standard, &[]);
    for (bit, name) in vendor {
        let ranges = &set("Status Data Set").ranges;
        let range = ranges.iter().find(|range| (range.first..=range.last).contains(&bit));
        assert_eq!(range.map(|range| range.kind), Some(RangeKind::Vendor), "{name}");
    }
}

#[test]
fn status_codes_on_the_wire_are_those_of_the_dictionary() {
    for row in cip().status_codes().iter().filter(|row| row.extended.is_none()) {
        let wire = GeneralStatus(row.general).name().unwrap_or_default();
        assert_eq!(wire, row.name.to_lowercase(), "{:#04x}", row.general);
    }
}
