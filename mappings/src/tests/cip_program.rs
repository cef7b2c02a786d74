//! Programs of the CIP side.

use super::*;
use crate::device_link::elements;

#[test]
fn takes_position_as_float_and_as_integer_across_the_wrap() {
    let program = shipped().cip_program(&rotary_counts()).unwrap();
    let mut trackers = program.trackers();
    let mut command = AxisCommand::default();
    let mut at = |position| {
        let values = CommandValues { position: Some(position), ..CommandValues::default() };
        let report = program.decode(&values, 0, &mut trackers, &mut command);
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
    let values = CommandValues { torque: Some(-12.5), ..CommandValues::default() };
    let values = elements(&values).chain([(4, CipValue::Dint(1))]);
    let report = program.decode_elements(values, None, 0, &mut program.trackers(), &mut command);
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
    program.decode(&values, 1_000, &mut program.trackers(), &mut command);
    assert_eq!(command.position, Position(500_500));
}

#[test]
fn an_unwind_position_unrolls_commands_and_is_left_to_the_device_for_actual_positions() {
    let scaling = CipScaling { unwind: Some(360_000), counts_per_unit: 360_000, ..rotary_counts() };
    let program = shipped().cip_program(&scaling).unwrap();
    let mut trackers = program.trackers();
    let mut command = AxisCommand::default();
    for (counts, turns) in [(350_000, 350_000), (10_000, 370_000), (350_000, 350_000)] {
        let position = Some(CommandPosition::Integer(counts));
        let values = CommandValues { position, ..CommandValues::default() };
        program.decode(&values, 0, &mut trackers, &mut command);
        let expected = turns * 1_000_000_000_i64 / 360_000;
        assert!(command.position.0.abs_diff(expected) <= 1, "{counts}");
    }
    let mut feedback = AxisFeedback::default();
    feedback.set(Signal::PositionActual, -1_000_000_000 / 4);
    let mut image = DriveImage::default();
    program.drive_image(&feedback, &FaultSet::new(), &mut Told::default(), &mut image);
    assert_eq!((image.position, image.unwind), (-90_000, Some(360_000)));
}

#[test]
fn fills_the_image_of_the_device() {
    let program = shipped().cip_program(&rotary_counts()).unwrap();
    let mut feedback = AxisFeedback {
        state: DriveState::Operating,
        mode: OperatingMode::Position,
        status: StatusBits::ENABLED | StatusBits::POWER | StatusBits::TRACKING,
        inhibits: Inhibits::HARDWARE_ENABLE | Inhibits::NO_DRIVE,
        at: MonotonicTime(42),
        ..AxisFeedback::default()
    };
    feedback.set(Signal::PositionActual, 3_000_000_000_000);
    feedback.set(Signal::VelocityActual, -500_000_000);
    let mut image = DriveImage { action_id: 7, ..DriveImage::default() };
    let report = program.drive_image(&feedback, &FaultSet::new(), &mut Told::default(), &mut image);
    assert_eq!((image.position, image.action_id, report.missing), (3_000_000_000, 7, 1));
    // Its stamp is in system time, which the device's side of the engine makes of it.
    assert_eq!((image.velocity, image.captured_at, image.position_rate), (Some(-0.5), 0, -500_000));
    assert!(image.bus_up && image.start_complete && !image.stop_complete);
    // Bits 2, 3, 5 and 22 (Table 5-2.60).
    assert_eq!(image.axis_status.bits(), 0x0040_002C);
    assert_eq!((image.start_inhibits, image.start_inhibits_mfg), (1 << 1, 1 << 5));
    assert!(image.conditions.as_slice().is_empty());
    assert!(image.io_status.is_empty());
    // The drive is gone: it stands where it was seen last, and nothing is said of how it moves.
    feedback.present = profile_generic::image::FeedbackSet::empty();
    program.drive_image(&feedback, &FaultSet::new(), &mut Told::default(), &mut image);
    assert_eq!((image.position, image.position_rate, image.velocity), (3_000_000_000, 0, None));
}

#[test]
fn switches_become_axis_io_status_while_the_drive_is_heard() {
    use profile_generic::fault::FaultCause;
    let tells = StatusBits::LIMIT_SWITCHES;
    let [forward, back] = [StatusBits::POSITIVE_LIMIT_SWITCH, StatusBits::NEGATIVE_LIMIT_SWITCH];
    // Bits 1, 4 and 5 (Table 5-2.63); those of a controller that has inverted the direction behind them.
    let cases = [
        (StatusBits::empty(), [0, 0]),
        (StatusBits::HOME_SWITCH, [0x02, 0x02]),
        (tells, [0x30, 0x30]),
        (tells | forward, [0x20, 0x10]),
        (tells | back, [0x10, 0x20]),
        (tells | forward | back | StatusBits::HOME_SWITCH, [0x02, 0x02]),
    ];
    for (place, inverted) in [false, true].into_iter().enumerate() {
        let scaling = CipScaling { inverted, ..rotary_counts() };
        let program = shipped().cip_program(&scaling).unwrap();
        for (status, expected) in cases {
            let feedback = AxisFeedback { status, ..AxisFeedback::default() };
            for online in [false, true] {
                let mut image = DriveImage { online, ..DriveImage::default() };
                program.drive_image(&feedback, &FaultSet::new(), &mut Told::default(), &mut image);
                let expected = if online { expected[place] } else { 0 };
                assert_eq!(image.io_status.bits(), expected, "{status:?}, inverted {inverted}, {online}");
            }
        }
        // Bits 50 to 53 (Table 5-2.65).
        let causes = [
            FaultCause::HARDWARE_OVERTRAVEL_POSITIVE,
            FaultCause::HARDWARE_OVERTRAVEL_NEGATIVE,
            FaultCause::SOFTWARE_OVERTRAVEL_POSITIVE,
            FaultCause::SOFTWARE_OVERTRAVEL_NEGATIVE,
        ];
        let codes = causes.map(|cause| match program.fault(cause) {
            Some(CipFault::Axis { code, .. }) => code,
            other => panic!("{other:?}"),
        });
        assert_eq!(codes, if inverted { [51, 50, 53, 52] } else { [50, 51, 52, 53] });
    }
}

#[test]
fn reports_conditions_by_type_and_code() {
    let program = shipped().cip_program(&rotary_counts()).unwrap();
    let report = |cause, reaction, origin| {
        let fault = Fault::new(cause, SystemTime(17)).with_vendor_code(0x0203).with_reaction(reaction);
        let mut faults = FaultSet::new();
        faults.raise(fault, origin);
        let mut image = DriveImage::default();
        program.drive_image(&AxisFeedback::default(), &faults, &mut Told::default(), &mut image);
        let conditions = image.conditions.as_slice().iter();
        let as_numbers = |c: &DriveCondition| (c.fault_type.0, c.code, c.sub_code, c.action, c.least.0);
        conditions.map(as_numbers).collect::<Vec<_>>()
    };
    // Excessive Position Error is bit 54; a current limited stop (3) and disable (2).
    let cause = FaultCause::EXCESSIVE_POSITION_ERROR;
    let decelerate = Reaction::DecelerateAndDisable;
    assert_eq!(report(cause, decelerate, Origin::Watch), [(3, 54, 3, 0x23, 0)], "the box can do anything");
    assert_eq!(report(cause, decelerate, Origin::Drive), [(3, 54, 3, 0x23, 3)], "the drive is off already");
    let warning = FaultCause::MOTOR_OVERLOAD_USER_LIMIT;
    assert_eq!(report(warning, Reaction::Alarm, Origin::Warning), [(3, 8, 3, 0x23, 0)]);
    let specific = FaultCause::DRIVE_SPECIFIC;
    assert_eq!(report(specific, Reaction::CoastAndDisable, Origin::Drive), [(4, 1, 3, 0x24, 3)]);
    assert_eq!(report(FaultCause::MEMORY, Reaction::Shutdown, Origin::Event), [(1, 3, 3, 0x34, 3)]);
    assert_eq!(
        report(FaultCause::COMMAND_LOST, decelerate, Origin::Event),
        [],
        "told as a fault of the node"
    );
    assert_eq!(program.fault(FaultCause::CONNECTION_CLOSED), Some(CipFault::Node(6)));
}

#[test]
fn a_fault_action_finds_the_mildest_reaction_that_gives_up_as_much() {
    let program = shipped().cip_program(&rotary_counts()).unwrap();
    for (action, reaction) in [
        (0x13, Reaction::HoldPosition),
        (0x22, Reaction::DecelerateAndDisable),
        (0x23, Reaction::DecelerateAndDisable),
        (0x14, Reaction::CoastAndDisable),
        (0x24, Reaction::CoastAndDisable),
        (0x33, Reaction::Shutdown),
        (0xFF, Reaction::Shutdown),
    ] {
        assert_eq!(program.reaction(action), reaction, "{action:#04x}");
    }
    assert_eq!(program.cause(3, 54), Some(FaultCause::EXCESSIVE_POSITION_ERROR));
    assert_eq!(program.cause(3, 26), None);
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
    assert_eq!((turn.counts_per_unit, turn.nanounits_per_count().to_string().as_str()), (10_000, "100000/1"));
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
        let position = Some(CommandPosition::Integer(counts));
        let values = CommandValues { position, ..CommandValues::default() };
        let mut command = AxisCommand::default();
        let report = program.decode(&values, 0, &mut program.trackers(), &mut command);
        prop_assert!(report.is_clean());
        let mut feedback = AxisFeedback::default();
        feedback.set(Signal::PositionActual, command.position.0);
        let mut image = DriveImage::default();
        program.drive_image(&feedback, &FaultSet::new(), &mut Told::default(), &mut image);
        prop_assert_eq!(image.position, i64::from(counts));
    }
}
