//! Telegrams, commissioning and programs of the SERCOS side.

use super::*;
use profile_generic::image::CommandSet;

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
                Step::Read { idn, elements, refused } => {
                    let elements: String =
                        elements.iter().map(|element| format!(" {}", *element as u8)).collect();
                    writeln!(text, "  read    {idn} elements{elements} {refused:?}").unwrap();
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
    let idns = |list: &[Item]| list.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    assert_eq!(idns(&telegram.command), "S-0-0134 S-0-0047 S-0-0037 S-0-0081 S-0-0036 S-0-0080");
    assert_eq!(idns(&telegram.feedback), "S-0-0135 S-0-0051 S-0-0040 S-0-0084 S-0-0189");
    assert_eq!((telegram.command_bytes, telegram.feedback_bytes), (18, 16));
}

/// Each mode adds what lies inside of its own loop, and the telegram has what the drive takes.
#[test]
fn offsets_reach_the_drive_in_the_modes_that_add_them() {
    let mapping = shipped();
    let axis = rotary_axis(false);
    let carried = |facts: &DriveFacts| {
        let program = mapping.sercos_program(&axis, facts).unwrap();
        [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque]
            .map(|mode| program.carries(mode.into()))
    };
    let (velocity, torque) = (CommandSet::VELOCITY_OFFSET, CommandSet::TORQUE_OFFSET);
    let mut facts = obedient(mapping, &axis);
    let all = [CommandSet::POSITION | velocity | torque, CommandSet::VELOCITY | torque, CommandSet::TORQUE];
    assert_eq!(carried(&facts), all);
    facts.note_missing(Idn::standard(37));
    let without = [all[0].difference(velocity), all[1], all[2]];
    assert_eq!(carried(&facts), without, "no S-0-0037");
    // S-0-0188, what it consumes, has no S-0-0081.
    let list: Vec<u8> = [36_u32, 47, 80].iter().flat_map(|idn| idn.to_le_bytes()).collect();
    facts.note_data(Idn::standard(188), &list);
    assert_eq!(carried(&facts), [CommandSet::POSITION, CommandSet::VELOCITY, CommandSet::TORQUE]);
}

#[test]
fn what_the_drive_lacks_is_left_out_or_refused() {
    let mapping = shipped();
    let mut facts = DriveFacts::new();
    facts.note_missing(Idn::standard(84));
    let telegram = mapping.telegram(&rotary_axis(false), &facts).unwrap();
    assert_eq!((telegram.feedback.len(), telegram.feedback_bytes), (4, 14));
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
    assert_eq!(program.telegram.feedback_bytes, 18);
    assert_eq!(program.feedback.required_len(), 18);
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
    command.set(Signal::VelocityOffset, -1_000_000_000);
    command.set(Signal::TorqueOffset, 250_000);
    let mut telegram = [0xA5; 18];
    let mut report = ConversionReport::default();
    let word = program.encode(&command, Action::Enable, 0, 0, &mut telegram, &mut report);
    // 0xE000; -90 degrees within the modulo range of 512 turns: 1842300000; -600000 and 250 more; 15000000; -125.
    let expected = [
        0x00, 0xE0, 0x60, 0x44, 0xCF, 0x6D, 0x40, 0xD8, 0xF6, 0xFF, 0xFA, 0x00, 0xC0, 0xE1, 0xE4, 0x00, 0x83,
        0xFF,
    ];
    assert_eq!((word, telegram, report.is_clean()), (0xE000, expected, true));
    command.mode = OperatingMode::Torque;
    let word = program.encode(&command, Action::Halt, word, 0, &mut telegram, &mut report);
    assert_eq!(word, 0xC200, "halt, third mode");
    assert_eq!(program.encode(&command, Action::Disable, word, 0, &mut telegram, &mut report), 0x6200);
    assert_eq!(program.encode(&command, Action::TorqueOff, word, 0, &mut telegram, &mut report), 0x0200);
    assert_eq!(program.encode(&command, Action::None, 0xE200, 0, &mut telegram, &mut report), 0xE200);
    assert_eq!(program.encode(&command, Action::Reject, 0xE200, 0, &mut telegram, &mut report), 0xE200);
    assert_eq!(program.command_of(Action::ResetFault), Some(Idn::RESET_C1D.into()));
    assert_eq!(program.command_of(Action::Enable), None);
}

#[test]
fn telegrams_of_the_drive_become_feedback() {
    let mapping = shipped();
    let axis = rotary_axis(true);
    let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
    let (mut cached, mut report) = (program.cached_status(), ConversionReport::default());
    let mut feedback =
        AxisFeedback { status: StatusBits::IN_POSITION | StatusBits::FAULT, ..AxisFeedback::default() };
    // In operation, following, second mode; 1843199999 counts, then 1: one step over the end of 512 turns and on.
    let mut telegram = [0x08, 0xC1, 0xFF, 0xFF, 0xDC, 0x6D, 0xFF, 0xFF, 0xFF, 0xFF, 0x7D, 0x00, 0, 0, 0, 0];
    assert_eq!(program.decode(&telegram, false, &mut feedback, &mut cached, &mut report), Some(0xC108));
    assert_eq!((feedback.report, feedback.mode), (Report::Operating, OperatingMode::Velocity));
    assert_eq!(
        feedback.status,
        StatusBits::IN_POSITION | StatusBits::ENABLED | StatusBits::POWER | StatusBits::TRACKING,
        "bits that other words carry stay, those of the status word follow it"
    );
    assert_eq!((feedback.position.0, feedback.torque), (511_999_999_722, Torque(125_000)));
    // 0.0001 1/min backward are -1666.67 nanounits a second.
    assert_eq!(feedback.velocity, Velocity(-1_667));
    telegram[2..6].copy_from_slice(&1_i32.to_le_bytes());
    program.decode(&telegram, false, &mut feedback, &mut cached, &mut report);
    assert_eq!((feedback.position.0, report.is_clean()), (512_000_000_278, true));
    assert_eq!(program.decode(&[0], false, &mut feedback, &mut cached, &mut report), None);
}

#[test]
fn status_words_say_what_the_drive_does() {
    let mapping = shipped();
    let axis = rotary_axis(true);
    let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
    let mut text = String::new();
    for word in (0..=0xFFFF_u32).filter(|word| word & !0xF018 == 0) {
        let status: Vec<_> = StatusBits::NAMED
            .iter()
            .filter(|(bit, _)| program.status_bits(word, &[]).contains(*bit))
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
    let words: Vec<_> = program.diagnostic_words(true).collect();
    assert_eq!(words, [11, 390].map(|block| Idn::standard(block).into()));
    assert_eq!(program.diagnostic_words(false).collect::<Vec<_>>(), [Idn::standard(12).into()]);
    let causes = |idn, word| program.faults(Idn::standard(idn).into(), word).collect::<Vec<_>>();
    assert_eq!(causes(11, 1 << 11), [(FaultCause::EXCESSIVE_POSITION_ERROR, Reaction::DecelerateAndDisable)]);
    let both = [
        (FaultCause::OVER_CURRENT, Reaction::CoastAndDisable),
        (FaultCause::UNDER_VOLTAGE, Reaction::CoastAndDisable),
    ];
    assert_eq!(causes(11, 1 << 9 | 1 << 7), both, "the row that explains the other stands first");
    assert_eq!(causes(11, 1 << 14), [], "reserved");
    assert_eq!(causes(12, 1 << 2), [(FaultCause::MOTOR_OVER_TEMPERATURE_USER_LIMIT, Reaction::Alarm)]);
    let number = |word| causes(390, word).iter().map(|(cause, _)| *cause).collect::<Vec<_>>();
    assert_eq!(number(0xC30F_4001), [FaultCause::COMMUNICATION_LOSS], "not drive specific as well");
    assert_eq!(number(0xC00A_0012), [], "class A: no error");
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
    program.encode(&command, Action::None, 0, 0, &mut telegram, &mut ConversionReport::default());
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
        (86, vec![0x42, 0x00]),
    ] {
        let mut facts = obedient(mapping, &axis);
        facts.note_data(Idn::standard(103), &0_u32.to_le_bytes());
        facts.note_data(Idn::standard(idn), &data);
        let error = mapping.sercos_program(&axis, &facts).unwrap_err();
        writeln!(text, "{idn:04} = {data:02X?}: {error}").unwrap();
    }
    let none = mapping.sercos_program(&axis, &DriveFacts::new()).unwrap_err();
    writeln!(text, "nothing read: {none}").unwrap();
    let unknown = SercosAxis {
        modes: [OperatingMode::Acceleration.into()].into_iter().collect(),
        ..rotary_axis(false)
    };
    writeln!(text, "{}", mapping.telegram(&unknown, &DriveFacts::new()).unwrap_err()).unwrap();
    let idle = SercosAxis { modes: [].into_iter().collect(), ..rotary_axis(false) };
    writeln!(text, "{}", mapping.telegram(&idle, &DriveFacts::new()).unwrap_err()).unwrap();
    insta::assert_snapshot!(text, @r"
    0076 = [00, 00]: S-0-0076: expected a scaling type that can be converted, got 0x0000
    0076 = [41, 00]: S-0-0123 is needed for the scaling and was not read from the drive
    0076 = [C2, 00]: S-0-0103: expected a number above 1, got 0
    0044 = [7F, 00]: S-0-0044: expected a scaling type that can be converted, got 0x007f
    0086 = [02, 00]: S-0-0086 = 0x0002: the drive gives torque in absolute units, and the axis has no rated torque
    0086 = [42, 00]: S-0-0122 is needed for the scaling and was not read from the drive
    nothing read: S-0-0076 is needed for the scaling and was not read from the drive
    no [[mode]] or [[procedure]] row for operating mode acceleration
    expected at least one operation mode, got none: the drive has none of those that the axis is configured for
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
    /// Generic to drive to generic loses at most one step of the coarser side, whatever the drive's
    /// resolution.
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
        program.encode(&command, Action::None, 0, 0, &mut telegram, &mut report);
        let mut feedback = AxisFeedback::default();
        program.decode(&telegram, false, &mut feedback, &mut program.cached_status(), &mut report);
        let count = 1_000_000_000_u64.div_ceil(u64::from(resolution)).max(1);
        let lost = feedback.position.0.abs_diff(position);
        // The fraction may lead one count over the range of 32 bits, where the drive's value is held.
        prop_assert!(lost <= count || report.saturated > 0 && lost <= 2 * count + 1_000, "{lost} of {count}");
    }
}

/// Every mode of the tables, and the slots it is in behind seven others: what is written to the drive, which bits choose it
/// and show it, and what a command for it has to have.
#[test]
fn modes_and_slots() {
    let mapping = shipped();
    let rows = mapping.sercos.modes.iter().map(|rule| rule.selection);
    let all: Vec<_> = rows.chain(mapping.sercos.procedures.iter().map(|rule| rule.selection)).collect();
    let axis = SercosAxis { modes: all.iter().copied().collect(), ..rotary_axis(false) };
    let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
    let mut text = String::new();
    for selection in &all {
        write!(text, "{selection}: ").unwrap();
        match program.procedure(*selection) {
            Some(procedure) => {
                let commands: Vec<_> = procedure.commands().iter().map(ToString::to_string).collect();
                write!(text, "{}", commands.join(", ")).unwrap();
                if let Some(mode) = procedure.led_in {
                    write!(text, ", led in {mode}").unwrap();
                }
            }
            None => write!(text, "mode {}", program.control(Action::None, *selection, 0, 0) >> 8).unwrap(),
        }
        writeln!(text, ", needs {:?}", program.needs(*selection)).unwrap();
    }
    let telegram = &program.telegram.command;
    writeln!(text, "{}", telegram.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")).unwrap();
    for slots in 1..=8 {
        let mut modes = vec![ModeSelection::from(OperatingMode::Position); slots - 1];
        modes.push(ModeSelection::by_drive(OperatingMode::Position));
        let axis = SercosAxis { modes: modes.into_iter().collect(), ..rotary_axis(false) };
        let steps = mapping.commissioning(&axis, 2, &obedient(mapping, &axis)).unwrap().steps;
        let codes = |candidates: &[Vec<u8>]| candidates == [vec![0x1B, 0], vec![0x13, 0]];
        let written = steps.iter().find_map(|step| match step {
            Step::Write { idn, candidates, refused } if codes(candidates) => Some((*idn, *refused)),
            _ => None,
        });
        let (idn, refused) = written.unwrap();
        let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
        let selection = ModeSelection::by_drive(OperatingMode::Position);
        let word = program.control(Action::Enable, selection, 0x0100, 0);
        assert_eq!(program.mode(word), Some(selection), "the status word has the same bits");
        writeln!(text, "slot {}: {idn} {refused:?} {word:04X}", slots - 1).unwrap();
    }
    insta::assert_snapshot!(text);
    let nine = SercosAxis {
        modes: [ModeSelection::from(OperatingMode::Torque); 9].into_iter().collect(),
        ..rotary_axis(false)
    };
    assert_eq!(
        mapping.telegram(&nine, &DriveFacts::new()).unwrap_err().to_string(),
        "expected at most 8 operating modes, got 9"
    );
}

/// A mode that an axis can do without is left out when the drive refuses its codes, or lacks its target; a mode that it
/// needs is not.
#[test]
fn modes_that_the_drive_refuses() {
    let mapping = shipped();
    let target = ModeSelection::by_drive(OperatingMode::Position);
    let axis = SercosAxis {
        modes: [ModeSelection::from(OperatingMode::Position), target].into_iter().collect(),
        ..rotary_axis(false)
    };
    let has = |change: &dyn Fn(&mut DriveFacts)| {
        let mut facts = obedient(mapping, &axis);
        change(&mut facts);
        let program = mapping.sercos_program(&axis, &facts).unwrap();
        let carried = program.telegram.command.contains(&Idn::standard(258).into());
        assert_eq!(carried, program.has_mode(target), "its values are in the telegram when it is there");
        program.has_mode(target)
    };
    assert!(has(&|_| ()));
    assert!(!has(&|facts| facts.note_refused(Idn::standard(33))));
    assert!(!has(&|facts| facts.note_missing(Idn::standard(33))));
    assert!(!has(&|facts| facts.note_missing(Idn::standard(258))));
    assert!(has(&|facts| facts.note_missing(Idn::standard(359))), "the deceleration is no must");
    assert!(has(&|facts| {
        facts.note_refused(Idn::standard(33));
        facts.note_data(Idn::standard(33), &[0x13, 0]);
    }));
    // A drive led by the controller while it homes has to have the mode for it.
    let homing = ModeSelection::from(OperatingMode::Homing);
    let alone = SercosAxis {
        modes: [ModeSelection::from(OperatingMode::Torque), homing].into_iter().collect(),
        ..rotary_axis(false)
    };
    assert_eq!(
        mapping.sercos_program(&alone, &obedient(mapping, &alone)).unwrap_err().to_string(),
        "homing needs the operating mode position, which the axis does not have"
    );
}

/// Bits of class 3 count where the drive lets the word into its telegram.
#[test]
fn class_3_bits_become_status() {
    let mapping = shipped();
    let axis = rotary_axis(false);
    let mut facts = obedient(mapping, &axis);
    facts.note_data(Idn::standard(187), &[13, 0, 0, 0, 84, 0, 0, 0, 51, 0, 0, 0, 40, 0, 0, 0]);
    let program = mapping.sercos_program(&axis, &facts).unwrap();
    assert_eq!(program.telegram.feedback.last(), Some(&Idn::standard(13).into()));
    let (mut cached, mut report) = (program.cached_status(), ConversionReport::default());
    let mut feedback = AxisFeedback::default();
    let mut text = String::new();
    for bit in 0..16 {
        let mut telegram = [0; 14];
        telegram[12..].copy_from_slice(&(1_u16 << bit).to_le_bytes());
        program.decode(&telegram, false, &mut feedback, &mut cached, &mut report).unwrap();
        let names: Vec<_> = StatusBits::NAMED
            .iter()
            .filter(|(status, _)| feedback.status.contains(*status))
            .map(|(_, name)| *name)
            .collect();
        writeln!(text, "{bit:>2} {}", names.join(" ")).unwrap();
    }
    insta::assert_snapshot!(text);
    assert_eq!(
        mapping.telegram(&axis, &obedient(mapping, &axis)).unwrap().feedback.last(),
        Some(&Idn::standard(189).into())
    );
}

proptest! {
    /// Whatever is asked for, only the bits of the mode and of the three switches change, and the mode is the one chosen.
    #[test]
    fn control_words_hold_the_mode(word in any::<u16>().prop_map(u32::from), mode in 0..5_usize, action in 0..Action::ALL.len()) {
        let mapping = shipped();
        let modes = [
            ModeSelection::from(OperatingMode::Position),
            ModeSelection::from(OperatingMode::Velocity),
            ModeSelection::from(OperatingMode::Torque),
            ModeSelection::by_drive(OperatingMode::Position),
            ModeSelection::by_drive(OperatingMode::Homing),
        ];
        let axis = SercosAxis { modes: modes.into_iter().collect(), ..rotary_axis(false) };
        let program = mapping.sercos_program(&axis, &obedient(mapping, &axis)).unwrap();
        let after = program.control(Action::ALL[action], modes[mode], word, 0);
        prop_assert_eq!((after ^ word) & 0x18FF, 0);
        match program.procedure(modes[mode]) {
            Some(_) => prop_assert_eq!((after ^ word) & 0x0700, 0, "homing by the drive leaves the mode alone"),
            None => prop_assert_eq!(program.mode(after), Some(modes[mode])),
        }
    }
}

/// What an axis without `modes` does of a drive that lacks something, and why it does without the rest.
#[test]
fn modes_that_the_drive_does_not_have_are_left_out_with_the_reason() {
    let mapping = shipped();
    let axis = SercosAxis { any_mode: true, ..rotary_axis(false) };
    let position = Idn::standard(47).0.to_le_bytes();
    type Case<'a> = (&'a str, &'a dyn Fn(&mut DriveFacts));
    let cases: [Case<'_>; 8] = [
        ("all", &|_| {}),
        ("S-0-0292 is [2]", &|facts| facts.note_data(Idn::standard(292), &[2, 0])),
        ("no S-0-0292, S-0-0032 = 2", &|facts| {
            *facts = untold(&[(32, 2), (33, 0)]);
        }),
        ("no S-0-0292, nothing set", &|facts| *facts = untold(&[(32, 0)])),
        ("S-0-0034 refused", &|facts| facts.note_refused(Idn::standard(34))),
        ("no S-0-0080", &|facts| facts.note_missing(Idn::standard(80))),
        ("S-0-0188 is [S-0-0047]", &|facts| facts.note_data(Idn::standard(188), &position)),
        ("S-0-0086 = 0x0002", &|facts| facts.note_data(Idn::standard(86), &[2, 0])),
    ];
    let mut text = String::new();
    for (name, change) in cases {
        let mut facts = mapping.facts_of_obedient(&axis).unwrap();
        change(&mut facts);
        let program = mapping.sercos_program(&axis, &facts).unwrap();
        let all = [OperatingMode::Position, OperatingMode::Velocity, OperatingMode::Torque];
        let has: Vec<_> =
            all.iter().filter(|mode| program.has_mode(**mode)).map(ToString::to_string).collect();
        writeln!(text, "{name}: {}", has.join(", ")).unwrap();
        for (mode, why) in mapping.sercos_modes_left_out(&axis, &facts) {
            writeln!(text, "  {mode}: {why}").unwrap();
        }
    }
    insta::assert_snapshot!(text);
}

/// A drive that has no S-0-0292, is set to these modes and has told its scaling.
fn untold(slots: &[(u16, u16)]) -> DriveFacts {
    let mapping = shipped();
    let told = mapping.facts_of_obedient(&rotary_axis(false)).unwrap();
    let scaling = [76, 77, 78, 79, 44, 45, 46, 86, 93, 94, 121, 122, 43, 55, 85].map(Idn::standard);
    let mut facts = DriveFacts::new();
    for (idn, data) in scaling.iter().filter_map(|idn| Some((*idn, told.data(*idn)?))) {
        facts.note_data(idn, data);
    }
    facts.note_missing(Idn::standard(292));
    for (block, code) in slots {
        facts.note_data(Idn::standard(*block), &code.to_le_bytes());
    }
    facts
}

/// Before anything else the drive is asked for its modes, and one that does not list them for what it is set to. What it does
/// not give is not asked for again.
#[test]
fn a_drive_is_asked_for_its_modes_first() {
    let mapping = shipped();
    let axis = SercosAxis { any_mode: true, ..rotary_axis(false) };
    let asked = |facts: &DriveFacts| {
        let plan = mapping.commissioning(&axis, 2, facts).unwrap();
        let idns = plan.steps.iter().filter_map(|step| match step {
            Step::Read { idn, .. } => Some(idn.to_string()),
            _ => None,
        });
        (plan.more, idns.take(3).collect::<Vec<_>>())
    };
    let mut facts = DriveFacts::new();
    assert_eq!(asked(&facts), (true, vec!["S-0-0292".to_owned()]));
    facts.note_missing(Idn::standard(292));
    let (more, slots) = asked(&facts);
    assert!(more && slots == ["S-0-0032", "S-0-0033", "S-0-0034"], "{slots:?}");
    facts.note_data(Idn::standard(32), &[2, 0]);
    for block in [33, 34, 35, 284, 285, 286, 287] {
        facts.note_unread(Idn::standard(block));
    }
    assert!(!asked(&facts).0, "everything is told");
    let plan = mapping.commissioning(&axis, 2, &facts).unwrap();
    let written = plan.steps.iter().find_map(|step| match step {
        Step::Write { idn, candidates, .. } if *idn == Idn::standard(32) => Some(candidates.clone()),
        _ => None,
    });
    assert_eq!(written, Some(vec![vec![2, 0]]), "velocity takes the first place");
}

/// Values that an axis can do without stay out of the telegrams of a drive that has refused a list with them.
#[test]
fn a_bare_telegram_has_what_the_modes_need_and_nothing_else() {
    let mapping = shipped();
    let axis = SercosAxis { bare: true, ..rotary_axis(false) };
    let telegram = mapping.telegram(&axis, &obedient(mapping, &axis)).unwrap();
    let idns = |list: &[Item]| list.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    assert_eq!(idns(&telegram.command), "S-0-0134 S-0-0047 S-0-0036 S-0-0080");
    assert_eq!(idns(&telegram.feedback), "S-0-0135 S-0-0051 S-0-0040");
}
