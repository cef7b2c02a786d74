//! Every scaling type of the drive profile, against arithmetic of its own.

use super::*;

/// The load gear of these tests: turns of motor and load.
const GEAR: (i64, i64) = (5, 2);

/// Ways of the load in a turn, 0.0001 mm.
const FEED: i64 = 100_000;

/// What a drive holds.
#[derive(Debug, Clone, Copy)]
struct Scales {
    /// Scaling type.
    word: i64,
    factor: i64,
    exponent: i64,
    resolution: i64,
}

fn float(value: i64) -> f64 {
    profile_generic::ratio::Ratio::ONE.to_f64(value)
}

fn axis_of(kind: UnitKind) -> SercosAxis {
    let rated = Some(Rated { kind, value: 2_500_000 });
    SercosAxis { units: AxisUnits { kind, rated, ..AxisUnits::default() }, ..rotary_axis(false) }
}

/// IDNs of scaling type, factor, exponent and a value of each quantity.
const QUANTITIES: [(&str, [u16; 4]); 4] = [
    ("position", [76, 77, 78, 47]),
    ("velocity", [44, 45, 46, 36]),
    ("acceleration", [160, 161, 162, 138]),
    ("torque", [86, 93, 94, 80]),
];

fn facts_of(axis: &SercosAxis, quantity: usize, scales: Scales) -> DriveFacts {
    let mut facts = obedient(shipped(), axis);
    let [word, factor, exponent, _] = QUANTITIES[quantity].1;
    let mut note = |idn: u16, value: i64, len: usize| {
        facts.note_data(Idn::standard(idn), &value.to_le_bytes()[..len]);
    };
    note(word, scales.word, 2);
    note(factor, scales.factor, 2);
    note(exponent, scales.exponent, 2);
    note(79, scales.resolution, 4);
    note(121, GEAR.0, 4);
    note(122, GEAR.1, 4);
    note(123, FEED, 4);
    note(103, 3_600_000, 4);
    facts
}

/// Generic units in one count, in floating point; `None` where no type of the standard says so.
fn expected(kind: UnitKind, quantity: usize, scales: Scales) -> Option<f64> {
    let word = scales.word;
    let (method, parameter, inch, second, load) =
        (word & 7, word & 8 != 0, word & 16 != 0, word & 32 != 0, word & 64 != 0);
    let exact = float;
    let linear = match method {
        0 if quantity == 3 => return Some(1_000.0),
        1 => true,
        2 => false,
        _ => return None,
    };
    if quantity != 1 && second || (!linear && inch && quantity != 3) {
        return None;
    }
    let drives = exact(scales.factor) * 10_f64.powi(i32::try_from(scales.exponent).unwrap());
    // Preferential scalings that no source tells are read from the drive.
    let count = match (quantity, linear, inch, second) {
        _ if parameter => drives,
        (0, true, false, _) => 1e-7,
        (1, true, false, false) | (1, false, _, true) | (2, true, false, _) => 1e-6,
        (1, false, _, false) => 1e-4,
        (1, true, true, false) => 1e-5,
        (2, false, ..) => 1e-3,
        (3, true, false, _) => 1.0,
        (3, false, false, _) => 1e-2,
        _ => drives,
    };
    let motor_per_load = exact(GEAR.0) / exact(GEAR.1);
    if quantity == 3 {
        let unit = match (linear, inch) {
            (false, true) => 0.112_984_829_027_616_7,
            (true, true) => 4.448_221_615_260_5,
            _ => 1.0,
        };
        let at_motor = if load { unit / motor_per_load } else { unit };
        let rotary = kind == UnitKind::Rotary;
        // 2.5 newton or newton metre are the whole.
        return (rotary != linear).then_some(count * at_motor / 2.5 * 1e6);
    }
    // Nanounits of the shaft in the unit: a millimetre or a turn has 10^9.
    let unit = match (quantity, linear, inch) {
        (_, true, true) => 25.4e9,
        (_, true, false) => 1e12,
        (2, false, _) => 1e9 / std::f64::consts::TAU,
        _ => 1e9,
    };
    let unit = if quantity == 1 && !second { unit / 60.0 } else { unit };
    let count = match (quantity, linear) {
        (0, false) if parameter => 1.0 / exact(scales.resolution),
        (0, false) => 1.0 / 3_600_000.0,
        _ => count,
    };
    let at_load = if load { unit } else { unit / motor_per_load };
    let feed = exact(FEED) / 1e4;
    let at_axis = match (kind, linear) {
        (UnitKind::Linear, false) => at_load * feed,
        (UnitKind::Rotary, true) => at_load / feed,
        _ => at_load,
    };
    Some(count * at_axis)
}

fn lsb(axis: &SercosAxis, facts: &DriveFacts, quantity: usize) -> Result<Lsb, SercosError> {
    let mapping = shipped();
    let idn = Idn::standard(QUANTITIES[quantity].1[3]);
    let of = [
        Signal::PositionCommand,
        Signal::VelocityCommand,
        Signal::AccelerationCommand,
        Signal::TorqueCommand,
    ];
    let dictionary = &mapping.dictionaries.sercos;
    crate::sercos::compile::unit_of(
        &mapping.sercos,
        dictionary,
        axis.units,
        facts,
        idn,
        of[quantity].quantity(),
    )
}

fn ratio_of(lsb: Lsb) -> f64 {
    float(lsb.generic.num()) / float(lsb.generic.den())
}

/// Every scaling word with every bit, for either kind of axis: each converts as the arithmetic says, or is refused with
/// its IDN and value.
#[test]
fn every_scaling_type_converts_or_is_refused() {
    let mut converted = [0; 4];
    for kind in [UnitKind::Rotary, UnitKind::Linear] {
        let axis = axis_of(kind);
        for (quantity, (name, idns)) in QUANTITIES.iter().enumerate() {
            for word in 0..0x100 {
                let preferential = Scales { word, factor: 1, exponent: 0, resolution: 3_600_000 };
                // With preferential types the drive shows what they fix.
                let fixed = |exponent| Scales { exponent, ..preferential };
                let scales = [-7, -6, -5, -4, -3, -2, 0].into_iter().map(fixed);
                let found = scales.clone().find_map(|scales| {
                    let facts = facts_of(&axis, quantity, scales);
                    lsb(&axis, &facts, quantity).ok().map(|lsb| (lsb, scales))
                });
                let wanted = expected(kind, quantity, preferential);
                assert_eq!(found.is_some(), wanted.is_some(), "{name} {kind} {word:#04x}");
                let Some((lsb, scales)) = found else {
                    let error = lsb(&axis, &facts_of(&axis, quantity, preferential), quantity).unwrap_err();
                    assert!(error.to_string().contains(&format!("S-0-{:04}", idns[0])), "{error}");
                    assert!(error.to_string().contains(&format!("{word:#06x}")), "{error}");
                    continue;
                };
                let wanted = expected(kind, quantity, scales).unwrap();
                let got = ratio_of(lsb);
                assert!(
                    ((got - wanted) / wanted).abs() < 1e-14,
                    "{name} {kind} {word:#04x}: {got}, not {wanted}"
                );
                let modulo = quantity == 0 && word & 0x80 != 0;
                assert_eq!(
                    lsb.modulo,
                    modulo.then_some((3_600_000, Idn::standard(103))),
                    "{name} {word:#04x}"
                );
                converted[quantity] += 1;
            }
        }
    }
    // Each for two shafts and with bit 7 free. Position: 2 rotational and 4 linear types for either axis; velocity twice
    // of them; acceleration like position; torque 4 for the axis of its kind, and percent whatever the other bits are.
    insta::assert_snapshot!(format!("{converted:?}"));
}

#[test]
fn a_preferential_scaling_that_shows_other_factors_is_refused() {
    let axis = axis_of(UnitKind::Rotary);
    let mut text = String::new();
    for (quantity, word, exponent, resolution) in
        [(0, 0x42, 0, 1_000_000), (0, 0x41, -6, 1), (1, 0x42, -6, 1), (2, 0x42, -2, 1), (3, 0x02, -1, 1)]
    {
        let facts = facts_of(&axis, quantity, Scales { word, factor: 1, exponent, resolution });
        writeln!(text, "{}", lsb(&axis, &facts, quantity).unwrap_err()).unwrap();
    }
    insta::assert_snapshot!(text, @r"
    S-0-0079: expected 3600000, which the scaling type S-0-0076 = 0x0042 fixes, got 1000000
    S-0-0078: expected -7, which the scaling type S-0-0076 = 0x0041 fixes, got -6
    S-0-0046: expected -4, which the scaling type S-0-0044 = 0x0042 fixes, got -6
    S-0-0162: expected -3, which the scaling type S-0-0160 = 0x0042 fixes, got -2
    S-0-0094: expected -2, which the scaling type S-0-0086 = 0x0002 fixes, got -1
    ");
}

/// The feed constant by the unit of the drive's element 4: 10 mm whoever says it.
#[test]
fn the_feed_constant_is_read_in_the_drives_own_unit() {
    let axis = axis_of(UnitKind::Linear);
    let turn = Scales { word: 0x42, factor: 1, exponent: 0, resolution: 3_600_000 };
    for (unit, attribute, value) in [
        ("mm/Rev", 0x4422_0001, 100_000),
        ("mm/U", 0x4122_0001, 100),
        ("\u{b5}m", 0x4012_0001, 10_000),
        ("um/Rev", 0x4012_0001, 10_000),
    ] {
        let mut facts = facts_of(&axis, 0, turn);
        let latin: Vec<u8> = unit.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect();
        facts.note_attribute(Idn::standard(123), Attribute(attribute));
        facts.note_unit(Idn::standard(123), &latin);
        facts.note_data(Idn::standard(123), &i32::to_le_bytes(value));
        let found = lsb(&axis, &facts, 0).unwrap().generic;
        assert_eq!((found.num(), found.den()), (25_000, 9), "{unit}: 10 mm in 3600000 counts");
    }
    let mut facts = facts_of(&axis, 0, turn);
    facts.note_unit(Idn::standard(123), b"furlong");
    let error = lsb(&axis, &facts, 0).unwrap_err();
    assert_eq!(error.to_string(), "S-0-0123: expected a unit of none in element 4, got `furlong`");
}

#[test]
fn what_a_drive_says_otherwise_than_the_dictionary_is_told() {
    let mut facts = DriveFacts::new();
    facts.note_attribute(Idn::standard(47), Attribute(0x0422_0001));
    facts.note_attribute(Idn::standard(84), Attribute(0x7122_0001));
    facts.note_attribute(Idn::standard(82), Attribute(0x0121_0001));
    facts.note_attribute(Idn::standard(104), Attribute(0x0312_0001));
    facts.note_unit(Idn::standard(104), b"1/s");
    facts.note_attribute(Idn::standard(292), Attribute(0x7031_0001));
    facts.note_attribute(Idn::standard(99), Attribute(0x0001_0001));
    // Nobody knows what it is by the dictionary, so nothing differs.
    facts.note_attribute(Idn::standard(384), Attribute(0x7121_0001));
    let text: String =
        facts.differences(&shipped().dictionaries.sercos).iter().map(|row| format!("{row}\n")).collect();
    insta::assert_snapshot!(text);
}

/// Bits of S-0-0055, 0043 and 0085, each way: a value that goes to the drive and comes back has the sign of the axis.
#[test]
fn polarities_count_once() {
    let mapping = shipped();
    let axis = rotary_axis(false);
    let rows = [
        (Signal::PositionCommand, 55, 0, 2),
        (Signal::VelocityCommand, 43, 0, 12),
        (Signal::TorqueCommand, 85, 0, 16),
    ];
    let actuals = [(55, 2), (43, 2), (85, 2)];
    for bits in 0..64_u32 {
        let bit = |place: u32| bits >> place & 1;
        let mut facts = obedient(mapping, &axis);
        for (place, idn) in [55_u16, 43, 85].into_iter().enumerate() {
            let place = u32::try_from(place).unwrap();
            let word = bit(place) | bit(place + 3) << 2;
            facts.note_data(Idn::standard(idn), &word.to_le_bytes()[..2]);
        }
        let program = mapping.sercos_program(&axis, &facts).unwrap();
        let mut command = AxisCommand::default();
        for (signal, value) in
            rows.map(|(signal, ..)| signal).into_iter().zip([1_000_000_000, 1_000_000_000, 100_000])
        {
            command.set(signal, value);
        }
        let (mut telegram, mut report) = ([0; 18], ConversionReport::default());
        program.encode(&command, Action::None, 0, 0, &mut telegram, &mut report);
        for (place, (signal, _, _, offset)) in rows.into_iter().enumerate() {
            let sent = telegram[offset..offset + 2].to_vec();
            let negative = telegram[offset + if place == 2 { 1 } else { 3 }] & 0x80 != 0;
            let place = u32::try_from(place).unwrap();
            // The drive inverts by the bit of the command; the axis goes by the bit of the actual position.
            assert_eq!(negative, bit(place) != bit(3), "{signal} {bits:#b} {sent:?}");
        }
        // The drive moves forward inside: what it sends is inverted by the bits of the actual values.
        let mut sent = vec![0x08, 0xC0];
        for (place, (_, _)) in actuals.into_iter().enumerate() {
            let sign = if bit(u32::try_from(place).unwrap() + 3) == 1 { -1_i32 } else { 1 };
            let bytes = (sign * 1_000).to_le_bytes();
            sent.extend_from_slice(if place == 2 { &bytes[..2] } else { &bytes });
        }
        let mut feedback = AxisFeedback::default();
        program.decode(&sent, false, &mut feedback, &mut program.cached_status(), &mut report);
        let forward = if bit(3) == 1 { -1 } else { 1 };
        let signs = [feedback.position.0.signum(), feedback.velocity.0.signum(), feedback.torque.0.signum()];
        assert_eq!(signs, [forward; 3], "{bits:#b}");
        assert!(report.is_clean() || report.saturated == 0);
    }
    let mut facts = obedient(mapping, &axis);
    facts.note_missing(Idn::standard(43));
    assert!(mapping.sercos_program(&axis, &facts).is_ok(), "a drive without polarity");
}

#[test]
fn a_polarity_that_was_not_read_is_no_polarity() {
    let mapping = shipped();
    let axis = rotary_axis(false);
    let mut facts = DriveFacts::new();
    for idn in [76, 44, 160, 86] {
        let value: u16 = if idn == 86 { 0 } else { 0x42 };
        facts.note_data(Idn::standard(idn), &value.to_le_bytes());
    }
    let error = mapping.sercos_program(&axis, &facts).unwrap_err();
    assert_eq!(error.to_string(), "S-0-0055 is needed for the scaling and was not read from the drive");
}

#[test]
fn limits_of_the_drive_hold_commands_and_refuse_parameters() {
    let mapping = shipped();
    let mut axis = rotary_axis(false);
    let mut facts = obedient(mapping, &axis);
    for (idn, minimum, maximum) in [(36, -20_000_000_i32, 20_000_000_i32), (47, 0, 0), (82, 1, 3_000)] {
        let len = if idn == 82 { 2 } else { 4 };
        facts.note_limit(Idn::standard(idn), false, &minimum.to_le_bytes()[..len]);
        facts.note_limit(Idn::standard(idn), true, &maximum.to_le_bytes()[..len]);
    }
    let program = mapping.sercos_program(&axis, &facts).unwrap();
    let mut command = AxisCommand::default();
    command.set(Signal::PositionCommand, 5_000_000_000);
    command.set(Signal::VelocityCommand, 50_000_000_000);
    let (mut telegram, mut report) = ([0; 18], ConversionReport::default());
    program.encode(&command, Action::None, 0, 0, &mut telegram, &mut report);
    assert_eq!(report.saturated, 1, "the velocity; limits without room between them are none");
    assert_eq!(telegram[2..6], 18_000_000_i32.to_le_bytes());
    assert_eq!(telegram[12..16], 20_000_000_i32.to_le_bytes());
    let limit = program.parameter(Parameter::TORQUE_LIMIT_POSITIVE).unwrap();
    assert_eq!(limit.encode(3_000_000), Some(([0xB8, 0x0B, 0, 0, 0, 0, 0, 0], 2, false)));
    assert_eq!(limit.encode(3_001_000).map(|(.., clamped)| clamped), Some(true));
    axis.parameters = vec![(Parameter::TORQUE_LIMIT_POSITIVE, 5_000_000)];
    let error = mapping.commissioning(&axis, 3, &facts).unwrap_err();
    assert_eq!(error.to_string(), "S-0-0082: expected 1 to 3000 by elements 5 and 6 of the drive, got 5000");
}

#[test]
fn modulo_positions_know_their_longest_step() {
    let mapping = shipped();
    let axis = rotary_axis(true);
    let facts = obedient(mapping, &axis);
    let program = mapping.sercos_program(&axis, &facts).unwrap();
    // Half of 512 turns less one count of 1/3600000 turn.
    assert_eq!(program.position_step(), Some(255_999_999_722));
    assert_eq!(
        mapping
            .sercos_program(
                &rotary_axis(false),
                &facts_of(&axis, 0, Scales { word: 0x42, factor: 1, exponent: -7, resolution: 3_600_000 })
            )
            .unwrap()
            .position_step(),
        None
    );
    for (range, divider, what) in [
        (1, None, "S-0-0103: expected a number above 1, got 1"),
        (
            3_600_000,
            Some(2_u16),
            "S-0-0294: expected 1, because no source says how it changes the range, got 2",
        ),
        (
            i64::from(u32::MAX),
            None,
            "S-0-0103: expected a range whose end fits the length of the position, got 4294967295",
        ),
    ] {
        let mut facts = obedient(mapping, &axis);
        facts.note_attribute(Idn::standard(103), Attribute(0x4412_0001));
        facts.note_data(Idn::standard(103), &range.to_le_bytes()[..4]);
        if let Some(divider) = divider {
            facts.note_data(Idn::standard(294), &divider.to_le_bytes());
        }
        assert_eq!(mapping.sercos_program(&axis, &facts).unwrap_err().to_string(), what);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]
    /// Whatever the scaling type and its factors: a value goes to the drive and comes back within half a count, or the
    /// report says that it was held.
    #[test]
    fn values_of_every_type_come_back_within_half_a_count(
        linear_axis: bool, quantity in 0..4_usize, word in 0..0x80_i64, factor in 1..0x1_0000_i64,
        exponent in -9..4_i64, resolution in 1..=i64::from(u32::MAX), value: i64,
    ) {
        let kind = if linear_axis { UnitKind::Linear } else { UnitKind::Rotary };
        let axis = axis_of(kind);
        let scales = Scales { word: word | if word & 7 == 0 { 0 } else { 8 }, factor, exponent, resolution };
        let Ok(unit) = lsb(&axis, &facts_of(&axis, quantity, scales), quantity) else { return Ok(()) };
        let size = ratio_of(unit);
        let wanted = expected(kind, quantity, scales).unwrap();
        prop_assert!(((size - wanted) / wanted).abs() < 1e-14, "{} for {}", size, wanted);
        let width = if quantity == 3 { profile_generic::program::Width::I16 } else { profile_generic::program::Width::I32 };
        let there = profile_generic::program::Conversion::new(unit.generic.inverse().unwrap())
            .within(width.range().0, width.range().1);
        let counts = there.convert(value);
        let back = unit.generic.convert(counts.value, profile_generic::ratio::Rounding::Nearest);
        let fits = float(value) / size;
        let (low, high) = (float(width.range().0), float(width.range().1));
        if counts.saturated {
            prop_assert!(fits < low - 0.49 || fits > high + 0.49, "{} fits", fits);
            prop_assert!(counts.value == width.range().0 || counts.value == width.range().1);
        } else if !back.saturated {
            let lost = (float(back.value) - float(value)).abs();
            prop_assert!(lost <= size / 2.0 + 0.5 + float(value).abs() * 1e-15, "{} of {}", lost, size);
        }
    }

    /// Modulo: the way from any position to any other comes out whole, over as many wraps as it takes.
    #[test]
    fn modulo_positions_unroll_without_drift(
        range in 2_000..i64::from(i32::MAX), steps in proptest::collection::vec(-0.49..0.49_f64, 1..60),
    ) {
        let mapping = shipped();
        let axis = rotary_axis(true);
        let mut facts = obedient(mapping, &axis);
        facts.note_data(Idn::standard(103), &range.to_le_bytes()[..4]);
        let program = mapping.sercos_program(&axis, &facts).unwrap();
        let (mut cached, mut report) = (program.cached_status(), ConversionReport::default());
        let (mut command, mut feedback) = (AxisCommand::default(), AxisFeedback::default());
        // The drive's counts, whole.
        let mut position = 0_i64;
        for step in std::iter::once(0.0).chain(steps) {
            #[expect(clippy::cast_possible_truncation, reason = "below half of 2^31")]
            let step = (step * float(range)) as i64;
            position += step;
            command.set(Signal::PositionCommand, position * 2_500 / 9);
            let mut telegram = [0; 12];
            program.encode(&command, Action::None, 0, 0, &mut telegram, &mut report);
            let sent = i64::from(i32::from_le_bytes(telegram[2..6].try_into().unwrap()));
            prop_assert!((0..range).contains(&sent), "{} of {}", sent, range);
            program.decode(&telegram, false, &mut feedback, &mut cached, &mut report);
            let lost = feedback.position.0.abs_diff(command.position.0);
            prop_assert!(lost <= 278, "{} nanoturns at {}", lost, position);
            prop_assert!(step * 2_500 / 9 <= program.position_step().unwrap());
        }
        prop_assert_eq!(report.saturated, 0);
    }
}
