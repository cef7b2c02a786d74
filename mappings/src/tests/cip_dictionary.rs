//! The dictionary of the Motion Device Axis Object against the standard.

use std::collections::{BTreeMap, BTreeSet};

use profile_cip::device::axis_state::{AxisState, ControlKind};
use profile_cip::device::visualization::AxisCondition;
use profile_cip::device::visualization::display::{self, NodeCondition, Startup};
use profile_cip::wire::motion::codes::{AlarmType, FaultType, NodeAlarm, NodeFault};

use super::*;
use crate::{CipAttribute, CipType, DEVICE_FUNCTIONS, PolarityEffect};

fn cip() -> &'static CipDictionary {
    &shipped().dictionaries.cip
}

fn attribute(id: u16) -> &'static CipAttribute {
    cip().attribute_by_id(id).unwrap_or_else(|| panic!("attribute {id}"))
}

/// The tables of clause 5-2 print 377 instance attributes: 352 of their own and 25 "Feedback n" ones, which each of the
/// four feedback channels has.
#[test]
fn has_every_attribute_once_and_those_of_the_feedback_channels_four_times() {
    // One of a later edition.
    assert_eq!(cip().class_attributes().len(), 24 + 1);
    let of_channel = |channel| cip().attributes().iter().filter(|row| row.channel == channel).count();
    assert_eq!([None, Some(1), Some(2), Some(3), Some(4)].map(of_channel), [352, 25, 25, 25, 25]);
    assert_eq!((of_channel(None) + of_channel(Some(1)), cip().attributes().len()), (377, 452));
    for row in cip().attributes().iter().filter(|row| row.channel == Some(1)) {
        for channel in 2..=4 {
            let other = attribute(row.id + 50 * (channel - 1));
            let name = row.name.replacen("Feedback 1 ", &format!("Feedback {channel} "), 1);
            let expected = CipAttribute { id: other.id, name, channel: Some(channel), ..row.clone() };
            assert_eq!(*other, expected);
        }
    }
}

#[test]
fn has_no_number_and_no_name_twice_and_only_known_needs() {
    for (rows, needs) in [(cip().class_attributes(), 1), (cip().attributes(), DEVICE_FUNCTIONS.len())] {
        let ids: BTreeSet<u16> = rows.iter().map(|row| row.id).collect();
        let names: BTreeSet<&str> = rows.iter().map(|row| row.name.as_str()).collect();
        assert_eq!((ids.len(), names.len()), (rows.len(), rows.len()));
        for row in rows {
            assert!(row.need.len() == needs && row.need.chars().all(|need| "ROC-".contains(need)), "{row:?}");
            assert!(row.need.chars().any(|need| need != '-'), "{row:?}: nobody has it");
            assert!(CipType::NAMED.iter().any(|(_, known)| *known == row.data_type), "{row:?}");
            assert!(!row.clause.is_empty() && !row.group.is_empty(), "{row:?}");
        }
    }
}

#[test]
fn has_every_data_type_as_often_as_the_standard() {
    let mut types: BTreeMap<&str, usize> = BTreeMap::new();
    for row in cip().attributes() {
        *types.entry(row.data_type.name()).or_default() += 1;
    }
    insta::assert_debug_snapshot!(types);
}

/// Table 5-2.110 names 55 attributes that may be set while running.
#[test]
fn names_what_may_be_set_in_the_running_state() {
    let running: Vec<u16> = cip().attributes().iter().filter(|row| row.running).map(|row| row.id).collect();
    let expected: Vec<u16> = (370..=378)
        .chain(440..=447)
        .chain(460..=462)
        .chain(464..=474)
        .chain([485, 486, 496, 498, 499, 500])
        .chain(502..=511)
        .chain(553..=557)
        .chain([731, 734, 735])
        .collect();
    assert_eq!((running.len(), running), (55, expected));
    for row in cip().attributes().iter().filter(|row| row.running) {
        assert_eq!(row.access, Access::Set, "{}", row.name);
    }
}

/// Tables 5-2.14 and 5-2.15 print 83 attributes: the sign of 71, of which each feedback channel has three, and six pairs
/// of limits.
#[test]
fn knows_what_motion_polarity_affects() {
    let rows = cip().attributes();
    let sign: Vec<_> = rows.iter().filter(|row| row.polarity == PolarityEffect::Sign).collect();
    assert_eq!(sign.iter().filter(|row| row.channel.is_none_or(|channel| channel == 1)).count(), 71);
    assert_eq!(sign.len(), 80);
    let swaps: Vec<(u16, u16)> = rows
        .iter()
        .filter_map(|row| match row.polarity {
            PolarityEffect::Swap(with) => Some((row.id, with)),
            _ => None,
        })
        .collect();
    let pairs = [(374, 375), (376, 377), (448, 449), (473, 474), (485, 486), (504, 505)];
    let expected: Vec<_> = pairs.iter().flat_map(|(one, other)| [(*one, *other), (*other, *one)]).collect();
    assert_eq!(swaps, expected);
    for id in [62, 70, 360, 370, 434, 454, 483, 494, 521, 523, 543, 565, 600, 603, 1402, 1453, 1554] {
        assert_eq!(attribute(id).polarity, PolarityEffect::Sign, "{id}");
    }
    for id in
        [66, 78, 373, 435, 443, 522, 604, 1405, 1416].into_iter().filter_map(|id| cip().attribute_by_id(id))
    {
        assert_eq!(id.polarity, PolarityEffect::None, "{}", id.name);
    }
}

/// Number, name, access, type, need of B E F P V T, condition, unit, clause and table: typed from the printed tables.
type Printed =
    (u16, &'static str, &'static str, &'static str, &'static str, &'static str, &'static str, &'static str);

#[rustfmt::skip]
const PRINTED: &[Printed] = &[
    (40, "Control Mode", "Set*", "USINT", "RRRRRR", "", "", "5-2.3.1 Table 5-2.9"),
    (44, "Feedback Unit Ratio", "Set", "REAL", "---OO-", "E", "Feedback 1 Units per Feedback 2 Units", "5-2.3.5 Table 5-2.33"),
    (66, "Registration 1 Positive Edge Time", "Get", "LINT", "-O-OOO", "E", "Nanoseconds", "5-2.3.6 Table 5-2.35"),
    (70, "Home Event Position", "Get", "DINT", "-R-ROO", "E", "Position Control Units", "5-2.3.6 Table 5-2.35"),
    (72, "Watch 1 Event Time", "Get", "LINT", "-R-ROO", "E; Drive Scaling only", "Nanoseconds", "5-2.3.6 Table 5-2.35"),
    (78, "Motion Resolution", "Set", "DINT", "-RRRRR", "Drive Scaling only", "Motion Counts / Motion Unit", "5-2.3.2 Table 5-2.12"),
    (84, "Cyclic Unwind Position", "Set", "DINT", "-R-RRR", "Drive Scaling only; E", "Motion Counts / Unwind Cycle", "5-2.3.2 Table 5-2.12"),
    (92, "Command Control", "Set*", "BYTE", "--ORRR", "", "", "5-2.3.3 Table 5-2.16"),
    (93, "Command Target Time", "Get", "LINT", "--OROO", "", "Nanoseconds", "5-2.3.3 Table 5-2.16"),
    (361, "Controller Position Command - Float", "Set*", "LREAL", "---O--", "R without 360", "Position Control Units", "5-2.3.7 Table 5-2.38"),
    (362, "Controller Velocity Command", "Set*", "REAL", "---OR-", "", "Velocity Control Units / Sec", "5-2.3.7 Table 5-2.38"),
    (364, "Controller Torque Command", "Set*", "REAL", "-----R", "", "% Motor Rated", "5-2.3.7 Table 5-2.38"),
    (378, "Ramp Jerk Control", "Set", "REAL", "--O-O-", "", "%", "5-2.3.7 Table 5-2.39"),
    (381, "Flying Start Method", "Set", "USINT", "--O-O-", "", "", "5-2.3.7 Table 5-2.39"),
    (431, "Position Trim", "Set*", "DINT", "---R--", "", "Position Control Units", "5-2.3.8.1 Table 5-2.40"),
    (441, "Kpp", "Set", "REAL", "---R--", "", "Radians/Sec", "5-2.3.8.1 Table 5-2.41"),
    (446, "Position Integrator Control", "Set", "BYTE", "---R--", "", "", "5-2.3.8.1 Table 5-2.41"),
    (454, "Velocity Feedback", "Get", "REAL", "-RRRRR", "", "Velocity Control Units / Sec", "5-2.3.8.2 Table 5-2.42"),
    (464, "Kdr", "Set", "REAL", "--OOO-", "", "Velocity Control Units / Sec / % Rated", "5-2.3.8.2 Table 5-2.43"),
    (472, "Velocity Standstill Window", "Set", "REAL", "-RRRRR", "", "Velocity Control Units / Sec", "5-2.3.8.2 Table 5-2.43"),
    (483, "Acceleration Feedback", "Get", "REAL", "-R-RRR", "", "Accel Control Units / Sec²", "5-2.3.8.3 Table 5-2.44"),
    (496, "Kj", "Set", "REAL", "---RRO", "", "% Motor Rated / (Motor Units / Sec²)", "5-2.3.8.4 Table 5-2.47"),
    (509, "Overtorque Limit Time", "Set", "REAL", "--OOOO", "", "Sec", "5-2.3.8.4 Table 5-2.47"),
    (522, "Current Limit Source", "Get", "USINT", "--OOOO", "", "", "5-2.3.8.5 Table 5-2.48"),
    (523, "Motor Electrical Angle", "Get", "REAL", "---RRR", "PM Motors only", "Degrees", "5-2.3.8.5 Table 5-2.48"),
    (561, "Commutation Offset", "Set", "REAL", "---RRR", "PM Motors only", "Electrical Degrees", "5-2.3.8.5 Table 5-2.49"),
    (565, "Slip Compensation", "Get", "REAL", "--R---", "", "RPM", "5-2.3.8.6 Table 5-2.50"),
    (570, "Frequency Control Method", "Set", "SINT", "--R---", "", "", "5-2.3.8.6 Table 5-2.51"),
    (600, "Output Frequency", "Get", "REAL", "--ROOO", "", "Hertz", "5-2.3.8.7 Table 5-2.52"),
    (605, "Converter Output Current", "Get", "REAL", "O-OOOO", "", "Amps", "5-2.3.8.7 Table 5-2.52"),
    (610, "Stopping Action", "Set", "USINT", "--RRRR", "", "", "5-2.3.9 Table 5-2.53"),
    (613, "Resistive Brake Contact Delay", "Set", "REAL", "--OOOO", "PM Motors only", "Sec", "5-2.3.9 Table 5-2.53"),
    (614, "Mechanical Brake Control", "Set", "USINT", "--OOOO", "", "", "5-2.3.9 Table 5-2.53"),
    (620, "DC Bus Voltage", "Get", "REAL", "R-RRRR", "", "Volts", "5-2.3.10 Table 5-2.56"),
    (634, "Bus Regulator Overload Protection Method", "Get", "USINT", "O-OOOO", "", "", "5-2.3.11 Table 5-2.57"),
    (643, "Feedback 1 Temperature", "Get", "REAL", "-OOOOO", "E", "°C", "5-2.3.11 Table 5-2.57"),
    (651, "Axis Status", "Get", "DWORD", "RRRRRR", "", "", "5-2.3.12 Table 5-2.59"),
    (655, "Axis Exceptions", "Get", "LWORD", "RRRRRR", "", "", "5-2.3.13 Table 5-2.64"),
    (663, "Axis Fault Time Stamp", "Get", "LINT", "RRRRRR", "", "Nanoseconds", "5-2.3.14 Table 5-2.66"),
    (672, "Axis Exception Action", "Set", "USINT", "RRRRRR", "", "", "5-2.3.16 Table 5-2.69"),
    (676, "Start Inhibits", "Get", "WORD", "R-RRRR", "", "", "5-2.3.18 Table 5-2.73"),
    (706, "Feedback Noise User Limit", "Set", "UDINT", "-OOOOO", "E", "Noise Counts", "5-2.3.15 Table 5-2.68"),
    (711, "Cumulative Run Time", "Get", "REAL", "O-OOOO", "", "Hours", "5-2.3.20 Table 5-2.77"),
    (725, "Drive Power Structure Axis ID", "Get", "UDINT", "--OOOO", "", "ID#", "5-2.3.21 Table 5-2.78"),
    (730, "Digital Inputs", "Get", "DWORD", "O-OOOO", "", "", "5-2.3.22 Table 5-2.79"),
    (750, "Local Control", "Set", "USINT", "OOOOOO", "", "", "5-2.3.23 Table 5-2.80"),
    (756, "APR Faults", "Get", "WORD", "-O-OOO", "E; Drive Scaling only", "", "5-2.3.19 Table 5-2.75"),
    (765, "Safe Torque Off Action", "Set", "USINT", "--OOOO", "Safety Only", "", "5-2.3.24 Table 5-2.81"),
    (1310, "Motor Catalog Number", "Get", "SHORT_STRING", "--OOOO", "", "", "5-2.3.4.1 Table 5-2.20"),
    (1320, "Motor Rated Peak Current", "Set", "REAL", "--CCCC", "R-PM; O-IM", "Amps (RMS)", "5-2.3.4.1 Table 5-2.21"),
    (1321, "Motor Rated Output Power", "Set", "REAL", "--CCCC", "R-IM; O-PM", "Kilowatts", "5-2.3.4.1 Table 5-2.21"),
    (1328, "PM Motor Inductance", "Set", "REAL", "--RRRR", "SPM Motor only", "Henries", "5-2.3.4.2 Table 5-2.22"),
    (1329, "Rotary Motor Poles", "Set", "UINT", "--RRRR", "Rotary Motor only", "", "5-2.3.4.3 Table 5-2.23"),
    (1334, "Linear Motor Pole Pitch", "Set", "REAL", "--RRRR", "Linear Motor only", "Meters", "5-2.3.4.4 Table 5-2.24"),
    (1339, "PM Motor Rated Torque", "Set", "REAL", "--OOOO", "Rotary PM Motor only", "N*m", "5-2.3.4.5 Table 5-2.25"),
    (1343, "PM Motor Force Constant", "Set", "REAL", "--OOOO", "Linear PM Motor only", "N/Amp (RMS)", "5-2.3.4.6 Table 5-2.26"),
    (1352, "Induction Motor Rated Slip Speed", "Set", "REAL", "--OOOO", "Induction Motor only", "RPM", "5-2.3.4.7 Table 5-2.27"),
    (1371, "Transmission Ratio Input", "Set", "DINT", "-OOOOO", "Drive Scaling only", "Input Shaft Revs", "5-2.3.4.8 Table 5-2.28"),
    (1400, "Feedback 1 Catalog Number", "Get", "SHORT_STRING", "-O-OOO", "E", "", "5-2.3.5 Table 5-2.31"),
    (1453, "Feedback 2 Velocity", "Get", "REAL", "-R-RRR", "E", "Feedback n Units / Sec", "5-2.3.5 Table 5-2.32"),
    (1516, "Feedback 3 Cycle Resolution", "Set", "UDINT", "-R-RRR", "E; Not LT", "", "5-2.3.5 Table 5-2.33"),
    (1585, "Feedback 4 Accel Filter Bandwidth", "Set", "REAL", "-O-OOO", "E", "Radians/Sec", "5-2.3.5 Table 5-2.33"),
];

#[test]
fn says_what_the_printed_tables_say() {
    for (id, name, access, data_type, need, condition, unit, place) in PRINTED {
        let row = attribute(*id);
        let place_of = format!("{} {}", row.clause, row.source);
        let got = (row.name.as_str(), row.access.name(), row.data_type.name(), row.need.as_str());
        assert_eq!(got, (*name, *access, *data_type, *need), "{id}");
        assert_eq!(
            (row.condition.as_str(), row.unit.as_str(), place_of.as_str()),
            (*condition, *unit, *place),
            "{id}"
        );
    }
}

#[test]
fn says_defaults_and_ranges_where_the_standard_does() {
    let rows = cip().attributes();
    let stated = |row: &&CipAttribute| row.channel.is_none_or(|channel| channel == 1);
    let defaults: Vec<_> =
        rows.iter().filter(stated).filter_map(|row| Some((row.id, row.default?))).collect();
    assert_eq!(defaults, [(43, 1), (629, 0), (1410, 0), (1412, 0)]);
    let step = cip().class_attributes().iter().find(|row| row.id == 35).unwrap();
    assert_eq!(
        (step.name.as_str(), step.default, step.need.as_str()),
        ("Step Threshold", Some(1_000_000), "C")
    );
    let ranges: Vec<_> = rows
        .iter()
        .filter(stated)
        .filter(|row| row.min.is_some() || row.max.is_some())
        .map(|row| (row.id, row.min, row.max))
        .collect();
    let boolean = |id| (id, Some(0), Some(1));
    assert_eq!(
        ranges,
        [
            boolean(83),
            (374, Some(0), None),
            (375, None, Some(0)),
            (376, Some(0), None),
            (377, Some(0), None),
            (378, Some(0), Some(100)),
            boolean(380),
            (504, Some(0), None),
            (505, None, Some(0)),
            boolean(736),
            boolean(737),
            boolean(1323),
            (1412, Some(0), Some(255)),
        ]
    );
    assert_eq!(attribute(1310).range, "up to 32 characters");
    assert_eq!(attribute(444).range, "");
}

/// Attributes about which the two documents disagree, about which one contradicts itself, or whose text is damaged.
#[rustfmt::skip]
const DOUBTFUL: &[u16] = &[
    // The documents disagree.
    381, 605, 606, 617, 631, 632, 633, 765, 634, 521, 522, 612, 624, 625, 637, 700, 701, 702, 703, 709, 714, 715, 638,
    723, 724, 471, 1413, 651, 653, 655, 756, 629, 760, 761, 763, 603, 681, 695, 1321, 650, 610, 95,
    // A document contradicts itself.
    42, 90, 454, 362, 485, 486, 623, 659, 660, 676, 677, 73, 1348, 1351, 1374, 1375, 643, 644, 690, 691, 692, 706, 707,
    708, 96, 97, 731, 734, 735, 92, 43, 570, 1313, 1315, 564, 668, 60, 61, 661, 672, 673, 41, 434, 432, 558, 620,
    // The text is damaged.
    66, 446, 500, 496, 539, 540, 559, 647, 91, 94, 646, 648, 565,
];

#[test]
fn has_a_note_wherever_the_documents_leave_a_doubt() {
    for id in DOUBTFUL {
        assert!(!attribute(*id).note.is_empty(), "{id} {}", attribute(*id).name);
    }
    let class = |id: u16| cip().class_attributes().iter().find(|row| row.id == id).unwrap();
    for id in [1, 15, 29, 31, 33, 35] {
        assert!(!class(id).note.is_empty(), "class {id}");
    }
    let noted = cip().attributes().iter().filter(|row| !row.note.is_empty() && row.channel.is_none()).count();
    assert!(noted < 150, "{noted}: a note on everything says nothing");
}

#[test]
fn every_set_of_codes_belongs_to_an_attribute_or_says_to_what() {
    for set in cip().enumerations().iter().chain(cip().bit_sets()) {
        let held = set.attributes.iter().all(|id| cip().attribute_by_id(*id).is_some());
        let held_by_class =
            set.class_attributes.iter().all(|id| cip().class_attributes().iter().any(|row| row.id == *id));
        assert!(held && held_by_class, "{}", set.name);
        let nothing = set.attributes.is_empty() && set.class_attributes.is_empty();
        assert!(!nothing || !set.element.is_empty(), "{}", set.name);
    }
}

/// Tables 9-1.3 and 9-1.4: the display of the device shows what the dictionary says of each type of fault and alarm.
#[test]
fn the_display_shows_what_the_dictionary_says() {
    const CODE: u8 = 7;
    let mut told = 0;
    for record in cip().fault_records() {
        let mut node = NodeCondition { startup: Startup::Complete, ..NodeCondition::default() };
        let mut axis = AxisCondition::new(ControlKind::Active, AxisState::Running, true);
        match (record.fault_type, record.alarm_type) {
            (Some(fault), _) => axis.fault = Some((FaultType(fault), CODE)),
            (None, Some(alarm @ 1..=2)) => {
                axis.state = AxisState::StartInhibited;
                axis.inhibit = Some((AlarmType(alarm), CODE));
            }
            (None, Some(alarm)) => axis.alarm = Some((AlarmType(alarm), CODE)),
            (None, None) if record.display.contains("FLT") => node.fault = NodeFault(CODE),
            (None, None) => node.alarm = NodeAlarm(CODE),
        }
        let line = display::line(&node, &axis);
        if record.display.is_empty() {
            // The standard has none; the text is ours.
            assert!(line.characters(None).starts_with("APR FLT "), "{}", record.conditions);
            continue;
        }
        told += 1;
        assert_eq!(
            line.characters(None).as_str(),
            record.display.replace("##", "07"),
            "{}",
            record.conditions
        );
        assert_eq!(
            line.segments().as_str(),
            record.seven_segment.replace("##", "07"),
            "{}",
            record.conditions
        );
    }
    assert_eq!(told, 12, "the coded rows of the tables");
}

/// Tables 5-2.82 and 5-2.85.
#[test]
fn has_every_service() {
    let got: Vec<_> = cip()
        .services()
        .iter()
        .map(|row| (row.code, row.name.as_str(), row.class, row.instance.as_str(), row.service_data_block))
        .collect();
    let expected = [
        (0x03, "Get_Attributes_List", 'R', "RRRRRR", false),
        (0x04, "Set_Attributes_List", 'R', "RRRRRR", false),
        (0x0E, "Get_Attribute_Single", 'R', "RRRRRR", false),
        (0x10, "Set_Attribute_Single", 'R', "RRRRRR", false),
        (0x1C, "Group_Sync", 'C', "------", false),
        (0x4B, "Get_Axis_Attributes_List", '-', "RRRRRR", true),
        (0x4C, "Set_Axis_Attributes_List", '-', "RRRRRR", true),
        (0x4D, "Set_Cyclic_Write_List", '-', "RRRRRR", true),
        (0x4E, "Set_Cyclic_Read_List", '-', "RRRRRR", true),
        (0x4F, "Run_Motor_Test", '-', "--OOOO", true),
        (0x50, "Get_Motor_Test_Data", '-', "--OOOO", true),
        (0x51, "Run_Inertia_Test", '-', "---RRR", true),
        (0x52, "Get_Inertia_Test_Data", '-', "---RRR", true),
        (0x53, "Run_Hookup_Test", '-', "RRRRRR", true),
        (0x54, "Get_Hookup_Test_Data", '-', "RRRRRR", true),
    ];
    assert_eq!(got, expected);
    for row in cip().services() {
        assert!(row.explicit && !row.clause.is_empty(), "{}", row.name);
        // Only tests depend on the state.
        assert_eq!(row.states.is_empty(), !row.name.starts_with("Run_"), "{}", row.name);
    }
    // What the documents leave in doubt.
    for code in [0x1C, 0x4C, 0x4D, 0x4E, 0x50] {
        let row = cip().services().iter().find(|row| row.code == code).unwrap();
        assert!(!row.note.is_empty(), "{}", row.name);
    }
}
