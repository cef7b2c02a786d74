//! Tests over the shipped tables and over tables that are broken on purpose.

use std::fmt::Write as _;
use std::sync::LazyLock;

use profile_cip::target::attribute::{AttributeTable as DeviceTable, Backing as DeviceBacking, Scope};
use profile_cip::target::drive_link::{DriveAction, DriveImage};
use profile_cip::wire::motion::{CommandPosition, CommandValues};
use profile_generic::fault::{Fault, FaultCause, Reaction};
use profile_generic::image::{AxisCommand, AxisFeedback, Signal, StatusBits};
use profile_generic::inhibit::Inhibits;
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::{CATALOGUE, Parameter};
use profile_generic::program::ConversionReport;
use profile_generic::quantity::{Position, Torque, Velocity};
use profile_generic::scaling::UnitKind;
use profile_generic::state::{Action, DriveState, Report, Request};
use profile_generic::time::SystemTime;
use profile_sercos::wire::attribute::Attribute;
use profile_sercos::wire::idn::Idn;
use proptest::prelude::*;

use super::*;

fn shipped() -> &'static Mapping {
    static SHIPPED: LazyLock<Mapping> = LazyLock::new(|| match Mapping::embedded() {
        Ok(mapping) => mapping,
        Err(errors) => panic!("{errors}"),
    });
    &SHIPPED
}

/// One turn of a million counts.
fn rotary_counts() -> CipScaling {
    CipScaling {
        kind: UnitKind::Rotary,
        nanounits_per_unit: 1_000_000_000,
        counts_per_unit: 1_000_000,
        inverted: false,
        unwind: None,
    }
}

fn rotary_axis(modulo: bool) -> SercosAxis {
    SercosAxis {
        units: AxisUnits { kind: UnitKind::Rotary, ..AxisUnits::default() },
        modes: [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque]
            .into_iter()
            .collect(),
        modulo,
        set_scaling: true,
        parameters: Vec::new(),
    }
}

/// What a drive tells that has taken every value of the plan for CP2.
fn obedient(mapping: &Mapping, axis: &SercosAxis) -> DriveFacts {
    let mut facts = DriveFacts::new();
    for step in mapping.commissioning(axis, 2, &DriveFacts::new()).unwrap().steps {
        if let Step::Write { idn, candidates, .. } = step {
            facts.note_data(idn, &candidates[0]);
        }
    }
    facts
}

mod shipped_tables {
    use super::*;

    #[test]
    fn load_and_their_examples_come_out() {
        let examples = shipped().run_examples().unwrap_or_else(|failures| {
            panic!("{}", failures.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
        });
        assert!(examples >= 30, "{examples}");
    }

    #[test]
    fn repeat_the_generic_catalogue_completely() {
        let dictionary = &shipped().dictionaries.generic;
        assert_eq!(dictionary.signals(), Signal::ALL);
        let listed: Vec<_> = dictionary.parameters().iter().map(|row| row.parameter).collect();
        let catalogue: Vec<_> = CATALOGUE.iter().map(|row| row.parameter).collect();
        assert_eq!(listed, catalogue);
    }

    /// Volume 9 has 377 instance attributes, "Feedback n" once each; four channels make 3 more of each of 23.
    #[test]
    fn list_every_attribute_of_the_axis_object() {
        let cip = &shipped().dictionaries.cip;
        assert_eq!(cip.class_attributes().len(), 24);
        let feedback = cip.attributes().iter().filter(|row| row.name.starts_with("Feedback 4 ")).count();
        assert_eq!(cip.attributes().len() - 3 * feedback, 377);
        assert_eq!(cip.attribute("Feedback 2 Unit").map(|row| row.id), Some(1461));
        assert_eq!(cip.attribute_by_id(672).and_then(|row| row.length), Some(64));
        // Table 5-2.110 names 55 attributes that may be set while running.
        assert_eq!(cip.attributes().iter().filter(|row| row.running).count(), 55);
    }

    #[test]
    fn leave_no_cause_inhibit_state_mode_or_reaction_without_a_row() {
        let mapping = shipped();
        let program = mapping.cip_program(&rotary_counts()).unwrap();
        for (cause, name) in FaultCause::NAMED {
            assert!(program.fault(*cause).is_some(), "{name}");
        }
        for (inhibit, name) in Inhibits::NAMED {
            assert_ne!(program.start_inhibits(*inhibit), (0, 0), "{name}");
        }
        for reaction in Reaction::ALL.iter().filter(|reaction| reaction.stops()) {
            assert_ne!(program.fault_action(*reaction), 0, "{reaction}");
        }
        assert_eq!((0..16).filter(|code| program.mode(*code).is_some()).count(), 5);
        for request in Request::ALL {
            let by_request =
                (0..=255).any(|code| program.request(code).and_then(|row| row.request) == Some(*request));
            let by_action =
                [DriveAction::PowerUp, DriveAction::Enable].map(|action| program.drive_request(action));
            let own = matches!(request, Request::Stop | Request::Test);
            assert!(by_request || by_action.contains(&Some(*request)) || own, "{request}");
        }
    }

    #[test]
    fn give_the_device_a_table_it_accepts() {
        let mapping = shipped();
        let axis = rotary_axis(true);
        let south = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
        let table = mapping.attribute_table(&rotary_counts()).unwrap();
        let definitions = table.definitions(&mapping.dictionaries.cip, Some(&south));
        DeviceTable::new(Scope::Instance, &definitions).unwrap();
        let backing = |id| definitions.iter().find(|row| row.id == id).map(|row| row.backing);
        assert_eq!(backing(504), Some(DeviceBacking::Drive), "Torque Limit - Positive");
        assert_eq!(backing(461), Some(DeviceBacking::Stored), "Kvp: no row on SERCOS");
        assert_eq!(
            backing(1319),
            Some(DeviceBacking::Stored),
            "rated current: the drive lets it be read only"
        );
        assert_eq!(backing(641), None, "Inverter Temperature: rejected where the drive lacks it");
        assert_eq!(backing(1310), None, "strings are left out");
    }
}

mod cip_program {
    use super::*;

    #[test]
    fn takes_position_as_float_and_as_integer_across_the_wrap() {
        let program = shipped().cip_program(&rotary_counts()).unwrap();
        let mut trackers = program.trackers();
        let mut command = AxisCommand::default();
        let mut at = |position| {
            let values = CommandValues { position: Some(position), ..CommandValues::default() };
            let report = program.decode(&CyclicValues::from(&values), 0, &mut trackers, &mut command);
            (command.position.0, report.is_clean())
        };
        assert_eq!(at(CommandPosition::Integer(i32::MAX)), (2_147_483_647_000, true));
        assert_eq!(at(CommandPosition::Integer(i32::MIN)), (2_147_483_648_000, true));
        assert_eq!(at(CommandPosition::Float(-2_147_483_647.5)), (2_147_483_648_500, true));
        assert_eq!(at(CommandPosition::Float(2_147_483_647.25)), (2_147_483_647_250, true));
        assert_eq!(at(CommandPosition::Float(f64::NAN)), (2_147_483_647_250, false));
        assert_eq!(at(CommandPosition::Float(3e9)), (2_147_483_647_250, false), "beyond a DINT");
    }

    #[test]
    fn a_value_that_is_not_there_is_absent_and_an_element_without_a_row_is_reported() {
        let program = shipped().cip_program(&rotary_counts()).unwrap();
        let mut command = AxisCommand { velocity: Velocity(5), ..AxisCommand::default() };
        let values = CommandValues { torque: Some(-12.5), unwind_count: Some(1), ..CommandValues::default() };
        let report = program.decode(&CyclicValues::from(&values), 0, &mut program.trackers(), &mut command);
        assert_eq!(
            (command.get(Signal::TorqueCommand), command.get(Signal::VelocityCommand)),
            (Some(-125_000), None)
        );
        assert_eq!((report.unmapped, report.is_clean()), (1, false));
    }

    #[test]
    fn a_reference_shift_is_taken_off_in_counts() {
        let program = shipped().cip_program(&rotary_counts()).unwrap();
        let mut command = AxisCommand::default();
        let position = Some(CommandPosition::Float(1_500.5));
        let values = CommandValues { position, ..CommandValues::default() };
        program.decode(&CyclicValues::from(&values), 1_000, &mut program.trackers(), &mut command);
        assert_eq!(command.position, Position(500_500));
    }

    #[test]
    fn an_unwind_position_folds_actual_positions_and_unrolls_commands() {
        let scaling = CipScaling { unwind: Some(360_000), counts_per_unit: 360_000, ..rotary_counts() };
        let program = shipped().cip_program(&scaling).unwrap();
        let mut trackers = program.trackers();
        let mut command = AxisCommand::default();
        for (counts, turns) in [(350_000, 350_000), (10_000, 370_000), (350_000, 350_000)] {
            let position = Some(CommandPosition::Integer(counts));
            let values = CommandValues { position, ..CommandValues::default() };
            program.decode(&CyclicValues::from(&values), 0, &mut trackers, &mut command);
            let expected = turns * 1_000_000_000_i64 / 360_000;
            assert!(command.position.0.abs_diff(expected) <= 1, "{counts}");
        }
        let mut feedback = AxisFeedback::default();
        feedback.set(Signal::PositionActual, -1_000_000_000 / 4);
        let mut values = CyclicValues::default();
        program.encode(&feedback, 1, &mut values);
        assert_eq!(values.0[0], Some(CipValue::Dint(270_000)));
    }

    #[test]
    fn fills_the_image_of_the_device() {
        let program = shipped().cip_program(&rotary_counts()).unwrap();
        let mut feedback = AxisFeedback {
            state: DriveState::Operating,
            mode: OperatingMode::Position,
            status: StatusBits::ENABLED | StatusBits::POWER | StatusBits::TRACKING,
            inhibits: Inhibits::HARDWARE_ENABLE | Inhibits::NO_DRIVE,
            at: SystemTime(42),
            ..AxisFeedback::default()
        };
        feedback.set(Signal::PositionActual, 3_000_000_000_000);
        feedback.set(Signal::VelocityActual, -500_000_000);
        let mut image = DriveImage { action_id: 7, ..DriveImage::default() };
        let report = program.drive_image(&feedback, &mut image);
        assert_eq!((image.position, image.action_id, report.missing), (3_000_000_000, 7, 1));
        assert_eq!((image.velocity.to_bits(), image.captured_at), ((-0.5_f32).to_bits(), 42));
        assert!(image.bus_up && image.start_complete && !image.stop_complete);
        // Bits 2, 3, 5, 17 and 22 (Table 5-2.60).
        assert_eq!(image.axis_status.bits(), 0x0042_002C);
        assert_eq!((image.start_inhibits, image.start_inhibits_mfg), (1 << 1, 1 << 5));
        assert_eq!((image.fault, image.alarm), (None, None));
    }

    #[test]
    fn reports_faults_and_alarms_by_type_and_code() {
        let program = shipped().cip_program(&rotary_counts()).unwrap();
        let report = |cause, reaction| {
            let fault = Fault::new(cause, SystemTime(0)).with_vendor_code(0x0203).with_reaction(reaction);
            let mut image = DriveImage::default();
            program.drive_image(&AxisFeedback { fault: Some(fault), ..AxisFeedback::default() }, &mut image);
            let fault =
                image.fault.map(|fault| (fault.fault_type.0, fault.code, fault.sub_code, fault.action));
            (fault, image.alarm.map(|alarm| (alarm.alarm_type.0, alarm.code)))
        };
        // Excessive Position Error is bit 54; a current limited stop (3) and disable (2).
        let cause = FaultCause::EXCESSIVE_POSITION_ERROR;
        assert_eq!(report(cause, Reaction::DecelerateAndDisable), (Some((3, 54, 3, 0x23)), None));
        assert_eq!(report(cause, Reaction::Alarm), (None, Some((3, 54))));
        assert_eq!(report(cause, Reaction::Ignore), (None, None));
        assert_eq!(
            report(FaultCause::DRIVE_SPECIFIC, Reaction::CoastAndDisable),
            (Some((4, 1, 3, 0x24)), None)
        );
        assert_eq!(report(FaultCause::MEMORY, Reaction::Shutdown), (Some((1, 3, 3, 0x34)), None));
        assert_eq!(program.fault(FaultCause::CONNECTION_CLOSED), Some(CipFault::Node(6)));
    }

    #[test]
    fn scaling_attributes_make_a_scaling_or_say_why_not() {
        let mapping = shipped();
        let cip = &mapping.cip;
        let from = |values: &[(u16, i64)]| {
            let get = |id| values.iter().find(|(known, _)| *known == id).map_or(0, |(_, value)| *value);
            CipScaling::from_attributes(cip, get)
        };
        // Drive Scaling, Load inch, 20000 counts, inverted, unwind after 40000 counts.
        let inch = from(&[(45, 1), (77, 7), (78, 20_000), (79, 1), (83, 1), (84, 40_000)]).unwrap();
        assert_eq!((inch.kind, inch.inverted, inch.unwind), (UnitKind::Linear, true, Some(40_000)));
        assert_eq!(inch.nanounits_per_count().to_string(), "-1270000/1");
        // Control Scaling: feedback counts, here of a 2500 line encoder with quadrature.
        let turn = from(&[(1416, 2_500), (1417, 4)]).unwrap();
        assert_eq!(
            (turn.counts_per_unit, turn.nanounits_per_count().to_string().as_str()),
            (10_000, "100000/1")
        );
        let errors: Vec<String> = [
            &[(45, 1), (77, 99), (78, 1)][..],
            &[(45, 1), (77, 0), (78, -5)],
            &[(45, 1), (77, 0), (78, 5), (83, 1), (84, 1)],
            &[(1416, 2_500)],
        ]
        .map(|values| from(values).unwrap_err().to_string())
        .into();
        insta::assert_snapshot!(errors.join("\n"), @r"
        attribute 77: expected the code of a displacement unit, got 99
        attribute 78: expected a number above 0, got -5
        attribute 84: expected 2 counts to 2^31 - 1, got 1
        attribute 1417: expected a number above 0, got 0
        ");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        /// Counts to nanounits and back lose nothing as long as a count is at least a nanounit.
        #[test]
        fn counts_come_back(counts in any::<i32>(), resolution in 1_i64..1_000_000_000, inverted: bool) {
            let scaling = CipScaling { counts_per_unit: resolution, inverted, ..rotary_counts() };
            let program = shipped().cip_program(&scaling).unwrap();
            let values = CommandValues { position: Some(CommandPosition::Integer(counts)), ..CommandValues::default() };
            let mut command = AxisCommand::default();
            let report = program.decode(&CyclicValues::from(&values), 0, &mut program.trackers(), &mut command);
            prop_assert!(report.is_clean());
            let mut feedback = AxisFeedback::default();
            feedback.set(Signal::PositionActual, command.position.0);
            let mut back = CyclicValues::default();
            program.encode(&feedback, 1, &mut back);
            prop_assert_eq!(back.0[0], Some(CipValue::Dint(counts)));
        }
    }
}

mod sercos_program {
    use super::*;

    #[test]
    fn commissioning_of_a_rotary_modulo_axis() {
        let mapping = shipped();
        let axis = SercosAxis {
            parameters: vec![
                (Parameter::TORQUE_LIMIT_NEGATIVE, -1_500_000),
                (Parameter::IN_POSITION_WINDOW, 1_000_000),
            ],
            ..rotary_axis(true)
        };
        let facts = obedient(mapping, &axis);
        let mut text = String::new();
        for phase in 2..=4 {
            writeln!(text, "CP{phase}").unwrap();
            for step in mapping.commissioning(&axis, phase, &facts).unwrap().steps {
                match step {
                    Step::Write { idn, candidates, refused } => {
                        writeln!(text, "  write   {idn} {candidates:02X?} {refused:?}").unwrap();
                    }
                    Step::Read { idn, attribute, data, refused } => {
                        let attribute = if attribute { " attribute" } else { "" };
                        let data = if data { " data" } else { "" };
                        writeln!(text, "  read    {idn}{attribute}{data} {refused:?}").unwrap();
                    }
                    Step::Command { idn, refused } => writeln!(text, "  command {idn} {refused:?}").unwrap(),
                }
            }
        }
        insta::assert_snapshot!(text);
    }

    #[test]
    fn telegrams_carry_the_values_of_every_mode_once() {
        let mapping = shipped();
        let telegram = mapping.telegram(&rotary_axis(false), &DriveFacts::new()).unwrap();
        let idns = |list: &[Idn]| list.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        assert_eq!(idns(&telegram.command), "S-0-0134 S-0-0047 S-0-0036 S-0-0080");
        assert_eq!(idns(&telegram.feedback), "S-0-0135 S-0-0051 S-0-0040 S-0-0084");
        assert_eq!((telegram.command_bytes, telegram.feedback_bytes), (12, 12));
    }

    #[test]
    fn what_the_drive_lacks_is_left_out_or_refused() {
        let mapping = shipped();
        let mut facts = DriveFacts::new();
        facts.note_missing(Idn::standard(84));
        let telegram = mapping.telegram(&rotary_axis(false), &facts).unwrap();
        assert_eq!((telegram.feedback.len(), telegram.feedback_bytes), (3, 10));
        facts.note_missing(Idn::standard(47));
        let error = mapping.telegram(&rotary_axis(false), &facts).unwrap_err();
        assert_eq!(error.to_string(), "the drive has no S-0-0047, which carries position_command");
    }

    #[test]
    fn the_drives_own_length_counts_more_than_the_dictionarys() {
        let mapping = shipped();
        let axis = rotary_axis(false);
        let mut facts = obedient(mapping, &axis);
        facts.note_attribute(Idn::standard(84), Attribute(0x7122_0001));
        let program = mapping.sercos_program(&axis, &facts).unwrap();
        assert_eq!(program.telegram.feedback_bytes, 14);
        assert_eq!(program.feedback.required_len(), 14);
    }

    #[test]
    fn commands_and_actions_become_a_telegram() {
        let mapping = shipped();
        let axis = rotary_axis(true);
        let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
        let mut command = AxisCommand { mode: OperatingMode::Position, ..AxisCommand::default() };
        command.set(Signal::PositionCommand, -250_000_000);
        command.set(Signal::VelocityCommand, 25_000_000_000);
        command.set(Signal::TorqueCommand, -125_000);
        let mut telegram = [0xA5; 12];
        let mut report = ConversionReport::default();
        let word = program.encode(&command, Action::Enable, 0, &mut telegram, &mut report);
        // 0xE000; -90 degrees are 270 within the modulo range: 2700000; 15000000; -125.
        let expected = [0x00, 0xE0, 0xE0, 0x32, 0x29, 0x00, 0xC0, 0xE1, 0xE4, 0x00, 0x83, 0xFF];
        assert_eq!((word, telegram, report.is_clean()), (0xE000, expected, true));
        command.mode = OperatingMode::Torque;
        let word = program.encode(&command, Action::Halt, word, &mut telegram, &mut report);
        assert_eq!(word, 0xC200, "halt, third mode");
        assert_eq!(program.encode(&command, Action::Disable, word, &mut telegram, &mut report), 0x6200);
        assert_eq!(program.encode(&command, Action::TorqueOff, word, &mut telegram, &mut report), 0x0200);
        assert_eq!(program.encode(&command, Action::None, 0xE200, &mut telegram, &mut report), 0xE200);
        assert_eq!(program.encode(&command, Action::Reject, 0xE200, &mut telegram, &mut report), 0xE200);
        assert_eq!(program.command_of(Action::ResetFault), Some(Idn::RESET_C1D));
        assert_eq!(program.command_of(Action::Enable), None);
    }

    #[test]
    fn telegrams_of_the_drive_become_feedback() {
        let mapping = shipped();
        let axis = rotary_axis(true);
        let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
        let (mut trackers, mut report) = (program.feedback.trackers(), ConversionReport::default());
        let mut feedback =
            AxisFeedback { status: StatusBits::IN_POSITION | StatusBits::FAULT, ..AxisFeedback::default() };
        // In operation, following, second mode; 3599999 counts, then 1: one step over the end of the turn and on.
        let mut telegram = [0x08, 0xC1, 0x7F, 0xEE, 0x36, 0x00, 0xFF, 0xFF, 0xFF, 0xFF, 0x7D, 0x00];
        assert_eq!(program.decode(&telegram, &mut feedback, &mut trackers, &mut report), Some(0xC108));
        assert_eq!((feedback.report, feedback.mode), (Report::Operating, OperatingMode::Velocity));
        assert_eq!(
            feedback.status,
            StatusBits::IN_POSITION | StatusBits::ENABLED | StatusBits::POWER | StatusBits::TRACKING,
            "bits that other words carry stay, those of the status word follow it"
        );
        assert_eq!((feedback.position.0, feedback.torque), (999_999_722, Torque(125_000)));
        // 0.0001 1/min backward are -1666.67 nanounits a second.
        assert_eq!(feedback.velocity, Velocity(-1_667));
        telegram[2..6].copy_from_slice(&1_i32.to_le_bytes());
        program.decode(&telegram, &mut feedback, &mut trackers, &mut report);
        assert_eq!((feedback.position.0, report.is_clean()), (1_000_000_278, true));
        assert_eq!(program.decode(&[0], &mut feedback, &mut trackers, &mut report), None);
    }

    #[test]
    fn status_words_say_what_the_drive_does() {
        let mapping = shipped();
        let axis = rotary_axis(true);
        let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
        let mut text = String::new();
        for word in (0..=0xFFFF_u16).filter(|word| word & !0xF018 == 0) {
            let status: Vec<_> = StatusBits::NAMED
                .iter()
                .filter(|(bit, _)| program.status_bits(word).contains(*bit))
                .map(|(_, name)| *name)
                .collect();
            writeln!(text, "{word:04X} {:<15}{}", program.report(word).name(), status.join(" ")).unwrap();
        }
        insta::assert_snapshot!(text);
        assert_eq!(program.mode(0xC300), None, "fourth slot, three modes");
    }

    #[test]
    fn diagnostic_words_tell_causes() {
        let mapping = shipped();
        let axis = rotary_axis(true);
        let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
        let words: Vec<_> = program.diagnostic_words().collect();
        assert_eq!(words, [Idn::standard(11), Idn::standard(12), Idn::standard(390)]);
        let cause =
            |idn, word| program.fault(Idn::standard(idn), word).map(|(cause, reaction)| (cause, reaction));
        assert_eq!(
            cause(11, 1 << 11),
            Some((FaultCause::EXCESSIVE_POSITION_ERROR, Reaction::DecelerateAndDisable))
        );
        assert_eq!(cause(11, 1 << 9 | 1 << 7), Some((FaultCause::OVER_CURRENT, Reaction::CoastAndDisable)));
        assert_eq!(cause(11, 1 << 14), None, "reserved");
        let warning = Some((FaultCause::MOTOR_OVER_TEMPERATURE_USER_LIMIT, Reaction::Alarm));
        assert_eq!(cause(12, 1 << 2), warning);
        assert_eq!(cause(390, 0xC30F_4001).map(|(cause, _)| cause), Some(FaultCause::COMMUNICATION_LOSS));
        assert_eq!(cause(390, 0xC00A_0012), None, "class A: no error");
    }

    #[test]
    fn values_of_the_motor_shaft_go_through_the_gear() {
        let mapping = shipped();
        let axis = rotary_axis(false);
        let mut facts = obedient(mapping, &axis);
        // Rotary, preferential, motor shaft; 5 turns of the motor are 2 of the load.
        facts.note_data(Idn::standard(76), &0x0002_u16.to_le_bytes());
        let error = mapping.sercos_program(&axis, &facts).unwrap_err();
        assert_eq!(error.to_string(), "S-0-0121 is needed for the scaling and was not read from the drive");
        facts.note_data(Idn::standard(121), &5_u32.to_le_bytes());
        facts.note_data(Idn::standard(122), &2_u32.to_le_bytes());
        let program = mapping.sercos_program(&axis, &facts).unwrap();
        let mut command = AxisCommand::default();
        command.set(Signal::PositionCommand, 2_000_000_000);
        let mut telegram = [0; 12];
        program.encode(&command, Action::None, 0, &mut telegram, &mut ConversionReport::default());
        assert_eq!(telegram[2..6], (5 * 3_600_000_i32).to_le_bytes());
    }

    #[test]
    fn scalings_that_cannot_be_used_say_why() {
        let mapping = shipped();
        let axis = rotary_axis(false);
        let mut text = String::new();
        for (idn, data) in [
            (76, vec![0x00, 0x00]),
            (76, vec![0x41, 0x00]),
            (76, vec![0xC2, 0x00]),
            (44, vec![0x7F, 0x00]),
            (86, vec![0x02, 0x00]),
        ] {
            let mut facts = obedient(mapping, &axis);
            facts.note_data(Idn::standard(103), &0_u32.to_le_bytes());
            facts.note_data(Idn::standard(idn), &data);
            let error = mapping.sercos_program(&axis, &facts).unwrap_err();
            writeln!(text, "{idn:04} = {data:02X?}: {error}").unwrap();
        }
        let none = mapping.sercos_program(&axis, &DriveFacts::new()).unwrap_err();
        writeln!(text, "nothing read: {none}").unwrap();
        let homing =
            SercosAxis { modes: [OperatingMode::Homing].into_iter().collect(), ..rotary_axis(false) };
        writeln!(text, "{}", mapping.telegram(&homing, &DriveFacts::new()).unwrap_err()).unwrap();
        let idle = SercosAxis { modes: [].into_iter().collect(), ..rotary_axis(false) };
        writeln!(text, "{}", mapping.telegram(&idle, &DriveFacts::new()).unwrap_err()).unwrap();
        insta::assert_snapshot!(text, @r"
        0076 = [00, 00]: S-0-0076: expected a scaling type of a rotary axis, got 0x0000
        0076 = [41, 00]: S-0-0076: expected a scaling type of a rotary axis, got 0x0041
        0076 = [C2, 00]: S-0-0103: expected a number above 1, got 0
        0044 = [7F, 00]: S-0-0044: expected a scaling type of a rotary axis, got 0x007f
        0086 = [02, 00]: S-0-0086: the drive gives torque in absolute units, and the axis has no rated torque
        nothing read: S-0-0076 is needed for the scaling and was not read from the drive
        no [[mode]] row for operating mode homing
        expected at least one operating mode, got none
        ");
    }

    #[test]
    fn parameters_know_their_place_and_their_direction() {
        let mapping = shipped();
        let axis = rotary_axis(true);
        let mut facts = obedient(mapping, &axis);
        let program = mapping.sercos_program(&axis, &facts).unwrap();
        let limit = program.parameter(Parameter::TORQUE_LIMIT_NEGATIVE).unwrap();
        assert_eq!(limit.encode(-1_500_000), Some(([0xDC, 0x05, 0, 0, 0, 0, 0, 0], 2, false)));
        assert_eq!(limit.decode(&[0xDC, 0x05]), Some(-1_500_000));
        assert_eq!(
            limit.encode(-70_000_000).map(|(_, _, clamped)| clamped),
            Some(true),
            "7000 % in 16 bits of 0.1 %"
        );
        assert_eq!(limit.decode(&[0xDC, 0x05, 0, 0]), None);
        let current = program.parameter(Parameter::MOTOR_RATED_CURRENT).unwrap();
        assert_eq!((current.encode(1), current.decode(&2_500_u32.to_le_bytes())), (None, Some(2_500_000)));
        assert_eq!(program.parameter(Parameter::VELOCITY_LIMIT_POSITIVE), None, "nobody knows its length");
        facts.note_attribute(Idn::standard(38), Attribute(0x0322_0001));
        let program = mapping.sercos_program(&axis, &facts).unwrap();
        assert!(program.parameter(Parameter::VELOCITY_LIMIT_POSITIVE).is_some());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        /// Generic to drive to generic loses at most one step of the coarser side, whatever the drive's resolution.
        #[test]
        fn positions_come_back_within_one_count(
            counts in -(1_i64 << 31) + 1..1 << 31, fraction in 0_i64..1_000, resolution in 1_u32..1 << 30,
        ) {
            let position = counts.saturating_mul(1_000_000_000) / i64::from(resolution) + fraction;
            let mapping = shipped();
            let axis = rotary_axis(false);
            let mut facts = obedient(mapping, &axis);
            facts.note_data(Idn::standard(76), &0x004A_u16.to_le_bytes());
            facts.note_data(Idn::standard(79), &resolution.to_le_bytes());
            let program = mapping.sercos_program(&axis, &facts).unwrap();
            let mut command = AxisCommand::default();
            command.set(Signal::PositionCommand, position);
            let (mut telegram, mut report) = ([0; 12], ConversionReport::default());
            program.encode(&command, Action::None, 0, &mut telegram, &mut report);
            let mut feedback = AxisFeedback::default();
            program.decode(&telegram, &mut feedback, &mut program.feedback.trackers(), &mut report);
            let count = 1_000_000_000_u64.div_ceil(u64::from(resolution)).max(1);
            let lost = feedback.position.0.abs_diff(position);
            // The fraction may lead one count over the range of 32 bits, where the drive's value is held.
            prop_assert!(lost <= count || report.saturated > 0 && lost <= 2 * count + 1_000, "{lost} of {count}");
        }
    }
}

mod broken_tables {
    use super::*;

    fn broken(change: impl Fn(&mut TableTexts)) -> String {
        let mut texts = TableTexts::embedded();
        change(&mut texts);
        match Mapping::from_texts(texts) {
            Ok(_) => "nothing found".to_owned(),
            Err(errors) => errors.to_string(),
        }
    }

    fn replace(table: &mut TableText, from: &str, to: &str) {
        assert!(table.text.contains(from), "{from:?} is not in {}", table.path);
        table.text = table.text.replacen(from, to, 1);
    }

    /// What to break, in which file, from what, to what.
    type Case = (&'static str, fn(&mut TableTexts) -> &mut TableText, &'static str, &'static str);

    const CASES: &[Case] = &[
        ("no TOML", |t| &mut t.cip_generic, "[scaling]", "[scaling"),
        ("unknown key", |t| &mut t.cip_generic, "wraps = true", "wrap = true"),
        ("wrong type", |t| &mut t.sercos, "length = 2,", "length = \"two\","),
        ("unknown signal", |t| &mut t.cip_generic, "\"position_command\"", "\"position_comand\""),
        (
            "unknown IDN",
            |t| &mut t.generic_sercos,
            "idn = \"S-0-0047\"\ndirection",
            "idn = \"S-0-4047\"\ndirection",
        ),
        ("no IDN", |t| &mut t.generic_sercos, "idn = \"S-0-0047\"\ndirection", "idn = \"S-47\"\ndirection"),
        ("unknown attribute", |t| &mut t.cip_generic, "attribute = \"Kpp\"", "attribute = \"Kpq\""),
        ("unit does not convert", |t| &mut t.cip_generic, "\"position_loop_gain\"", "\"power_loss_time\""),
        (
            "unknown exception",
            |t| &mut t.cip_generic,
            "exception = \"Brake Slip\"",
            "exception = \"Brake Slap\"",
        ),
        (
            "two answers",
            |t| &mut t.cip_generic,
            "exception = \"Brake Slip\"",
            "exception = \"Brake Slip\"\nmanufacturer = 9",
        ),
        ("manufacturer bit 0", |t| &mut t.cip_generic, "manufacturer = 1\n", "manufacturer = 0\n"),
        ("field value too large", |t| &mut t.generic_sercos, "\"Drive on\", is = 0", "\"Drive on\", is = 2"),
        ("unknown field", |t| &mut t.generic_sercos, "field = \"Drive on\"", "field = \"Drive off\""),
        (
            "wrong direction",
            |t| &mut t.generic_sercos,
            "direction = \"to_drive\"",
            "direction = \"from_drive\"",
        ),
        (
            "read only",
            |t| &mut t.generic_sercos,
            "idn = \"S-0-0111\"\ndirection = \"from_drive\"",
            "idn = \"S-0-0112\"\ndirection = \"both\"",
        ),
        ("phase", |t| &mut t.generic_sercos, "phase = 2\ndo = \"write\"", "phase = 4\ndo = \"write\""),
        (
            "ratio",
            |t| &mut t.generic_sercos,
            "generic_per_unit = [1_000, 1]",
            "generic_per_unit = [1_000, 0]",
        ),
        ("state twice", |t| &mut t.cip_generic, "state = \"shutdown\"", "state = \"faulted\""),
        ("attribute twice", |t| &mut t.cip, "{ id = 41,", "{ id = 40,"),
        (
            "catalogue",
            |t| &mut t.generic,
            "quantity = \"torque\", access = \"command\"",
            "quantity = \"time\", access = \"command\"",
        ),
        ("format", |t| &mut t.sercos, "format = 1", "format = 2"),
    ];

    #[test]
    fn are_refused_with_place_key_and_what_was_expected() {
        let mut text = String::new();
        for (what, table, from, to) in CASES {
            let errors = broken(|texts| replace(table(texts), from, to));
            assert_ne!(errors, "nothing found", "{what}");
            writeln!(text, "## {what}\n{errors}\n").unwrap();
        }
        insta::assert_snapshot!(text);
    }

    #[test]
    fn errors_carry_their_place_as_numbers() {
        let mut texts = TableTexts::embedded();
        replace(&mut texts.cip_generic, "signal = \"position_command\"", "signal = \"position_comand\"");
        let line =
            texts.cip_generic.text.lines().position(|line| line.contains("position_comand")).unwrap() + 1;
        let errors = Mapping::from_texts(texts).unwrap_err();
        let [error] = errors.0.as_slice() else { panic!("{errors}") };
        assert_eq!((error.line, error.column, error.key.as_str()), (line, 10, "signal"));
        assert_eq!(error.file, "mappings/cip-generic.toml");
    }

    /// The examples are worth their place: a row that is changed is found out.
    #[test]
    fn a_changed_ratio_makes_an_example_fail() {
        let changes: &[(fn(&mut TableTexts) -> &mut TableText, &str, &str)] = &[
            (
                |t| &mut t.cip_generic,
                "quantity = \"torque\"\ngeneric_per_unit = [10_000, 1]",
                "quantity = \"torque\"\ngeneric_per_unit = [1_000, 1]",
            ),
            (|t| &mut t.cip_generic, "nanounits = 25_400_000_000", "nanounits = 25_000_000_000"),
            (|t| &mut t.generic_sercos, "divisor = 3_600_000 }", "divisor = 360_000 }"),
            (|t| &mut t.generic_sercos, "factor = [-1, 1]\n", ""),
        ];
        for (table, from, to) in changes {
            let mut texts = TableTexts::embedded();
            let before = texts.cip_generic.text.matches(from).count()
                + texts.generic_sercos.text.matches(from).count();
            for _ in 0..before {
                replace(table(&mut texts), from, to);
            }
            let failures = Mapping::from_texts(texts).unwrap().run_examples().unwrap_err();
            assert!(!failures.is_empty(), "{from}");
        }
    }

    #[test]
    fn a_folder_replaces_files_and_may_hold_no_others() {
        let folder = std::env::temp_dir().join(format!("axisbridge-mapping-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("dictionary")).unwrap();
        let mut texts = TableTexts::embedded();
        replace(&mut texts.sercos, "name = \"Position command value\"", "name = \"Position set-point\"");
        std::fs::write(folder.join("dictionary/sercos.toml"), &texts.sercos.text).unwrap();
        let mapping = Mapping::from_folder(&folder).unwrap();
        let name = mapping.dictionaries.sercos.idn(Idn::standard(47)).map(|row| row.name.clone());
        assert_eq!(name.as_deref(), Some("Position set-point"));
        std::fs::write(folder.join("cip_generic.toml"), "").unwrap();
        let errors = Mapping::from_folder(&folder).unwrap_err();
        assert!(errors.0[0].message.contains("got `cip_generic.toml`"), "{errors}");
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(Mapping::from_folder(&folder).unwrap_err().0[0].message.starts_with("cannot read"));
    }
}
