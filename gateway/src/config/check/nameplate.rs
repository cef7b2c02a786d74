//! `motor`, `converter`, `encoder` and `loops` of an `[[axis]]`.

use profile_generic::parameter::Parameter;
use profile_generic::ratio::{Ratio, Rounding, quotient};

use super::{Problems, value};
use crate::config::file::{AxisTable, ConverterTable, EncoderTable, LoopsTable, MotorTable};
use crate::config::{AxisKind, Nameplate};
use crate::finding::Spanned;
use crate::finding::registry as code;

/// Kinds of motor, by the codes of Motor Type (CIP Volume 9, Table 5-2.21).
pub(in crate::config) const MOTORS: [(&str, i64); 4] = [
    ("rotary-permanent-magnet", 1),
    ("rotary-induction", 2),
    ("linear-permanent-magnet", 3),
    ("linear-induction", 4),
];

/// Where a DC bus has its power from, by the codes of Bus Configuration (Table 5-2.56).
pub(in crate::config) const BUSES: [(&str, i64); 4] =
    [("standalone", 0), ("shared-ac-dc", 1), ("shared-dc", 2), ("shared-dc-non-cip-converter", 3)];

/// Mains, by the codes of Bus Voltage Select (Table 5-2.56).
pub(in crate::config) const MAINS: [(&str, i64); 2] = [("high", 0), ("low", 1)];

/// Interfaces of encoders, by the codes of Feedback n Type (Table 5-2.33). No axis has an LDT.
pub(in crate::config) const ENCODERS: [(&str, i64); 16] = [
    ("digital-aqb", 1),
    ("digital-aqb-uvw", 2),
    ("digital-parallel", 3),
    ("sine-cosine", 4),
    ("sine-cosine-uvw", 5),
    ("hiperface", 6),
    ("endat-sine-cosine", 7),
    ("endat-digital", 8),
    ("resolver", 9),
    ("ssi", 10),
    ("hiperface-dsl", 12),
    ("biss-digital", 13),
    ("integrated", 14),
    ("ssi-sine-cosine", 15),
    ("ssi-aqb", 16),
    ("biss-sine-cosine", 17),
];

/// Where an encoder counts from, by the codes of Feedback n Startup Method (Table 5-2.33).
pub(in crate::config) const STARTUPS: [(&str, i64); 2] = [("incremental", 0), ("absolute", 1)];

/// A key of the file, what it is, the parameter by the motor's being linear, and generic units in one unit of the file.
type Row<'t> = (&'t Option<Spanned<f64>>, &'static str, [Parameter; 2], [(i64, i64); 2]);

/// A word of the file, what it is, the words that there are, and the parameter.
type Word<'t> = (&'t Option<Spanned<String>>, &'static str, &'static [(&'static str, i64)], Parameter);

/// A number of the file and its key.
type Key<'t> = (&'t Option<Spanned<f64>>, &'static str);

/// Revolutions per minute in nanounits a second, and metres a second in nanounits of a millimetre.
const SPEED: [(i64, i64); 2] = [(50_000_000, 3), (1_000_000_000_000, 1)];

/// Kilogram square metres in 1e-9, kilograms in 1e-6.
const INERTIA: [(i64, i64); 2] = [(1_000_000_000, 1), (1_000_000, 1)];

/// What a time constant of warming is.
const THERMAL: &str = "the thermal time constant";

const MILLION: (i64, i64) = (1_000_000, 1);
const BILLION: (i64, i64) = (1_000_000_000, 1);

/// A number that motors of both kinds have.
const fn plain<'t>(
    number: &'t Option<Spanned<f64>>,
    what: &'static str,
    parameter: Parameter,
    unit: (i64, i64),
) -> Row<'t> {
    (number, what, [parameter; 2], [unit; 2])
}

/// What is known of the kind of a motor.
#[derive(Debug, Clone, Copy)]
struct Kind {
    code: Option<i64>,
    is_linear: bool,
}

impl Kind {
    /// Whether it may have permanent magnets, and whether it may be an induction motor.
    const fn may_be(self, induction: bool) -> bool {
        matches!((self.code, induction), (None, _) | (Some(1 | 3), false) | (Some(2 | 4), true))
    }
}

pub(super) fn check(problems: &mut Problems, table: &AxisTable, unit: Option<AxisKind>) -> Option<Nameplate> {
    let (no_motor, no_converter) = (MotorTable::default(), ConverterTable::default());
    let (no_encoder, no_loops) = (EncoderTable::default(), LoopsTable::default());
    let motor = table.motor.as_ref().unwrap_or(&no_motor);
    let converter = table.converter.as_ref().unwrap_or(&no_converter);
    let encoder = table.encoder.as_ref().unwrap_or(&no_encoder);
    let loops = table.loops.as_ref().unwrap_or(&no_loops);
    let before = problems.len();
    let kind = kind(problems, table, motor, unit);
    let mut data = Vec::new();
    let rows = motor_rows(motor).into_iter().chain(converter_rows(converter)).chain(loop_rows(loops));
    for (number, what, parameters, units) in rows {
        let at = usize::from(kind.is_linear);
        let (num, den) = units[at];
        if let Some(Some(fine)) = value::positive(problems, number, what, Ratio::new(num, den)) {
            data.push((parameters[at], fine));
        }
    }
    misfits(problems, motor, kind);
    poles(problems, motor, kind, &mut data);
    let words: [Word<'_>; 4] = [
        (&converter.bus, "source of a DC bus", &BUSES, Parameter::BUS_CONFIGURATION),
        (&converter.mains, "kind of mains", &MAINS, Parameter::MAINS_CLASS),
        (&encoder.kind, "type of encoder", &ENCODERS, Parameter::ENCODER_TYPE),
        (&encoder.startup, "start of an encoder", &STARTUPS, Parameter::ENCODER_STARTUP),
    ];
    for (word, what, known, parameter) in words {
        let code = word.as_ref().and_then(|word| value::word(problems, word, what, known));
        data.extend(code.map(|code| (parameter, code)));
    }
    let checks = converter.checks_enable_input.map(i64::from);
    data.extend(checks.map(|checks| (Parameter::ENABLE_INPUT_CHECKING, checks)));
    encoder_range(problems, encoder, kind, &mut data);
    loop_terms(problems, loops, &mut data);
    if let Some(code) = kind.code {
        data.push((Parameter::MOTOR_TYPE, code));
        data.push((Parameter::MOTOR_UNIT, i64::from(kind.is_linear)));
    }
    data.sort_by_key(|(parameter, _)| *parameter);
    (problems.len() == before).then_some(Nameplate(data))
}

/// The kind of the motor. One of an axis in millimetres may turn a screw, or be a linear motor.
fn kind(problems: &mut Problems, table: &AxisTable, motor: &MotorTable, unit: Option<AxisKind>) -> Kind {
    let code = motor.kind.as_ref().and_then(|word| value::word(problems, word, "type of motor", &MOTORS));
    let is_linear = matches!(code, Some(3 | 4));
    if unit == Some(AxisKind::Linear) && table.motor.is_some() && motor.kind.is_none() {
        let title = "the motor of an axis in millimetres may turn or not";
        let expected = "expected the `type` of its `motor`, such as \"rotary-permanent-magnet\"";
        problems.report_as::<()>(code::CONTRADICTION, table.unit.span(), title, expected);
    }
    Kind { code, is_linear }
}

fn motor_rows(motor: &MotorTable) -> [Row<'_>; 21] {
    let speeds = [Parameter::MOTOR_RATED_VELOCITY, Parameter::MOTOR_LINEAR_RATED_VELOCITY];
    let highest = [Parameter::MOTOR_MAX_VELOCITY, Parameter::MOTOR_LINEAR_MAX_VELOCITY];
    let torques = [Parameter::MOTOR_RATED_TORQUE, Parameter::MOTOR_RATED_FORCE];
    let masses = [Parameter::MOTOR_INERTIA, Parameter::MOTOR_MASS];
    let constants = [Parameter::MOTOR_TORQUE_CONSTANT, Parameter::MOTOR_FORCE_CONSTANT];
    let voltages = [Parameter::MOTOR_VOLTAGE_CONSTANT, Parameter::MOTOR_LINEAR_VOLTAGE_CONSTANT];
    [
        (&motor.rated_torque, "the rated torque", torques, [MILLION; 2]),
        plain(&motor.rated_current, "the rated current", Parameter::MOTOR_RATED_CURRENT, MILLION),
        plain(&motor.peak_current, "the peak current", Parameter::MOTOR_PEAK_CURRENT, MILLION),
        (&motor.rated_speed, "the rated speed", speeds, SPEED),
        (&motor.max_speed, "the highest speed", highest, SPEED),
        plain(&motor.rated_voltage, "the rated voltage", Parameter::MOTOR_RATED_VOLTAGE, MILLION),
        plain(&motor.rated_power, "the rated power", Parameter::MOTOR_RATED_POWER, MILLION),
        (&motor.inertia, "the inertia", masses, INERTIA),
        plain(&motor.resistance, "the resistance", Parameter::MOTOR_RESISTANCE, MILLION),
        plain(&motor.inductance, "the inductance", Parameter::MOTOR_INDUCTANCE, BILLION),
        plain(
            &motor.max_winding_temperature,
            "the highest temperature",
            Parameter::MOTOR_MAX_TEMPERATURE,
            (1_000, 1),
        ),
        plain(&motor.overload_limit, "the overload limit", Parameter::MOTOR_OVERLOAD_LIMIT, (10_000, 1)),
        (&motor.torque_constant, "the torque constant", constants, [MILLION; 2]),
        (&motor.voltage_constant, "the voltage constant", voltages, [MILLION; 2]),
        plain(&motor.pole_pitch, "the pole pitch", Parameter::MOTOR_POLE_PITCH, MILLION),
        plain(&motor.thermal_time_constant, THERMAL, Parameter::MOTOR_THERMAL_TIME, BILLION),
        plain(&motor.q_inductance, "the inductance", Parameter::MOTOR_Q_INDUCTANCE, BILLION),
        plain(&motor.d_inductance, "the inductance", Parameter::MOTOR_D_INDUCTANCE, BILLION),
        plain(&motor.rated_frequency, "the rated frequency", Parameter::MOTOR_RATED_FREQUENCY, (1_000, 1)),
        plain(&motor.flux_current, "the magnetising current", Parameter::MOTOR_FLUX_CURRENT, MILLION),
        plain(
            &motor.stator_resistance,
            "the resistance of the stator",
            Parameter::MOTOR_STATOR_RESISTANCE,
            MILLION,
        ),
    ]
}

fn converter_rows(converter: &ConverterTable) -> [Row<'_>; 5] {
    [
        plain(&converter.bus_voltage, "the bus voltage", Parameter::BUS_NOMINAL_VOLTAGE, MILLION),
        plain(&converter.rated_current, "the rated current", Parameter::DRIVE_RATED_CURRENT, MILLION),
        plain(&converter.rated_voltage, "the rated voltage", Parameter::DRIVE_RATED_VOLTAGE, MILLION),
        plain(&converter.thermal_time_constant, THERMAL, Parameter::DRIVE_THERMAL_TIME, BILLION),
        plain(&converter.rated_power, "the rated power", Parameter::DRIVE_RATED_POWER, MILLION),
    ]
}

/// Gains that each such loop has.
fn loop_rows(loops: &LoopsTable) -> [Row<'_>; 2] {
    [
        plain(&loops.position_gain, "the gain of the position loop", Parameter::POSITION_LOOP_GAIN, MILLION),
        plain(&loops.velocity_gain, "the gain of the velocity loop", Parameter::VELOCITY_LOOP_GAIN, MILLION),
    ]
}

/// Terms that a loop need not have: they may be 0.
fn loop_terms(problems: &mut Problems, loops: &LoopsTable, data: &mut Vec<(Parameter, i64)>) {
    let terms = [
        (
            &loops.position_integral_gain,
            "the integral gain of the position loop",
            Parameter::POSITION_INTEGRAL_GAIN,
            MILLION,
        ),
        (
            &loops.velocity_feed_forward,
            "the feedforward of the velocity",
            Parameter::VELOCITY_FEED_FORWARD_GAIN,
            (10_000, 1),
        ),
    ];
    for (number, what, parameter, (num, den)) in terms {
        let fine = value::not_negative(problems, number, what, Ratio::new(num, den));
        data.extend(fine.flatten().map(|fine| (parameter, fine)));
    }
    let what = "the integral gain of the velocity loop";
    let gain = &loops.velocity_integral_gain;
    let Some(Some(nano)) = value::not_negative(problems, gain, what, value::NANO) else { return };
    // The generic model has the time constant, which is one over the gain; 0 is none in both.
    match integral_time(nano) {
        Some(time) => data.push((Parameter::VELOCITY_INTEGRAL_TIME, time)),
        None => {
            let Some(gain) = gain else { return };
            let title = format!("{what} is {}", gain.get_ref());
            let expected = "expected a time constant, one over it, of at least 1 ns";
            problems.report_as::<()>(code::OUT_OF_RANGE, gain.span(), title, expected);
        }
    }
}

/// Time constant in ns of an integral gain in 1e-9 rad/s. `None` for one below half a nanosecond.
fn integral_time(gain: i64) -> Option<i64> {
    const NANO_OF_NANO: i128 = 1_000_000_000_000_000_000;
    if gain == 0 {
        return Some(0);
    }
    let time = quotient(NANO_OF_NANO, gain.into(), Rounding::Nearest)?;
    (time.value > 0).then_some(time.value)
}

/// What a motor of another kind has.
fn misfits(problems: &mut Problems, motor: &MotorTable, kind: Kind) {
    let of_magnets = [
        (&motor.torque_constant, "torque_constant"),
        (&motor.voltage_constant, "voltage_constant"),
        (&motor.q_inductance, "q_inductance"),
        (&motor.d_inductance, "d_inductance"),
    ];
    let of_induction = [
        (&motor.rated_frequency, "rated_frequency"),
        (&motor.flux_current, "flux_current"),
        (&motor.stator_resistance, "stator_resistance"),
    ];
    let of_linear = [(&motor.pole_pitch, "pole_pitch")];
    let groups: [(&[Key<'_>], bool, &str); 3] = [
        (&of_magnets, kind.may_be(false), "a motor with permanent magnets"),
        (&of_induction, kind.may_be(true), "an induction motor"),
        (&of_linear, kind.is_linear, "a linear motor"),
    ];
    for (keys, fits, whose) in groups {
        for (value, key) in keys.iter().filter(|_| !fits) {
            let Some(value) = value else { continue };
            let title = format!("only {whose} has a {key}");
            problems.report_as::<()>(code::CONTRADICTION, value.span(), title, format!("expected no {key}"));
        }
    }
}

fn poles(problems: &mut Problems, motor: &MotorTable, kind: Kind, data: &mut Vec<(Parameter, i64)>) {
    let Some(poles) = &motor.poles else { return };
    if kind.is_linear {
        let title = "a linear motor has no number of poles";
        problems.report_as::<()>(code::CONTRADICTION, poles.span(), title, "expected a pole_pitch");
        return;
    }
    match value::number::<u16>(problems, poles, "the number of poles", 2..=65_534) {
        Some(number) if number % 2 == 0 => data.push((Parameter::MOTOR_POLE_COUNT, i64::from(number))),
        Some(number) => {
            let title = format!("the number of poles is {number}");
            problems.report_as::<()>(code::OUT_OF_RANGE, poles.span(), title, "expected an even number");
        }
        None => {}
    }
}

/// What an absolute encoder tells apart: turns, or a length.
fn encoder_range(
    problems: &mut Problems,
    encoder: &EncoderTable,
    kind: Kind,
    data: &mut Vec<(Parameter, i64)>,
) {
    let is_absolute = encoder.startup.as_ref().is_none_or(|startup| startup.get_ref() == "absolute");
    let turns = encoder.turns.as_ref().map(Spanned::span);
    let length = encoder.length.as_ref().map(Spanned::span);
    let keys = [(turns, "turns", !kind.is_linear), (length, "length", kind.is_linear)];
    for (span, key, fits) in keys {
        let Some(span) = span.filter(|_| !fits || !is_absolute) else { continue };
        let whose = if fits { "an absolute encoder" } else { "the encoder of the other kind of motor" };
        let title = format!("only {whose} has {key}");
        problems.report_as::<()>(code::CONTRADICTION, span, title, format!("expected no {key}"));
    }
    let turns = encoder.turns.as_ref();
    let turns = turns.and_then(|turns| {
        value::number::<u32>(problems, turns, "the number of turns", 1..=i64::from(u32::MAX))
    });
    data.extend(turns.map(|turns| (Parameter::ENCODER_TURNS, i64::from(turns))));
    let length = value::positive(problems, &encoder.length, "the length", value::NANO);
    data.extend(length.flatten().map(|length| (Parameter::ENCODER_LENGTH, length)));
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;
    use crate::mapping::own_values::OF_CONFIGURATION;

    fn read(unit: &str, keys: &str) -> Result<Nameplate, Vec<String>> {
        let text = format!("name = \"a\"\ninstance = 1\ndrive = \"d\"\nunit = \"{unit}\"\n{keys}");
        let kind = if unit == "revolution" { AxisKind::Rotary } else { AxisKind::Linear };
        checked(&text, |problems, table| check(problems, table, Some(kind)))
    }

    #[test]
    fn data_are_read_in_generic_units() {
        let keys = "motor = { rated_torque = 2.4, rated_current = 3.5, rated_speed = 3000.0, poles = 8, resistance = 1.25, \
                    inductance = 0.008, rated_power = 0.75, inertia = 0.00012 }\nconverter = { bus_voltage = 325.0 }";
        assert_eq!(
            read("revolution", keys),
            Ok(Nameplate(vec![
                (Parameter::MOTOR_RATED_TORQUE, 2_400_000),
                (Parameter::MOTOR_RATED_CURRENT, 3_500_000),
                (Parameter::MOTOR_RATED_VELOCITY, 50_000_000_000),
                (Parameter::MOTOR_RATED_POWER, 750_000),
                (Parameter::MOTOR_POLE_COUNT, 8),
                (Parameter::MOTOR_INERTIA, 120_000),
                (Parameter::MOTOR_RESISTANCE, 1_250_000),
                (Parameter::MOTOR_INDUCTANCE, 8_000_000),
                (Parameter::BUS_NOMINAL_VOLTAGE, 325_000_000),
            ]))
        );
        let linear = "motor = { type = \"linear-permanent-magnet\", rated_speed = 2.5, inertia = 3.0, pole_pitch = 24.0, rated_torque = 200.0, \
                      torque_constant = 60.5 }\nencoder = { type = \"endat-digital\", startup = \"absolute\", length = 1500.0 }";
        assert_eq!(
            read("millimetre", linear),
            Ok(Nameplate(vec![
                (Parameter::MOTOR_TYPE, 3),
                (Parameter::MOTOR_UNIT, 1),
                (Parameter::MOTOR_POLE_PITCH, 24_000_000),
                (Parameter::MOTOR_LINEAR_RATED_VELOCITY, 2_500_000_000_000),
                (Parameter::MOTOR_MASS, 3_000_000),
                (Parameter::MOTOR_RATED_FORCE, 200_000_000),
                (Parameter::MOTOR_FORCE_CONSTANT, 60_500_000),
                (Parameter::ENCODER_TYPE, 8),
                (Parameter::ENCODER_STARTUP, 1),
                (Parameter::ENCODER_LENGTH, 1_500_000_000_000),
            ]))
        );
        let screw = "motor = { type = \"rotary-induction\", rated_speed = 3000.0, rated_frequency = 50.0, flux_current = 1.5, \
                     stator_resistance = 2.25 }\nconverter = { bus = \"shared-dc\", mains = \"low\", checks_enable_input = true, \
                     rated_voltage = 230.0, rated_power = 1.5 }\nencoder = { startup = \"absolute\", turns = 4096 }";
        assert_eq!(
            read("millimetre", screw),
            Ok(Nameplate(vec![
                (Parameter::MOTOR_RATED_VELOCITY, 50_000_000_000),
                (Parameter::MOTOR_TYPE, 2),
                (Parameter::MOTOR_UNIT, 0),
                (Parameter::MOTOR_RATED_FREQUENCY, 50_000),
                (Parameter::MOTOR_FLUX_CURRENT, 1_500_000),
                (Parameter::MOTOR_STATOR_RESISTANCE, 2_250_000),
                (Parameter::ENCODER_STARTUP, 1),
                (Parameter::ENCODER_TURNS, 4096),
                (Parameter::DRIVE_RATED_VOLTAGE, 230_000_000),
                (Parameter::DRIVE_RATED_POWER, 1_500_000),
                (Parameter::BUS_CONFIGURATION, 2),
                (Parameter::MAINS_CLASS, 1),
                (Parameter::ENABLE_INPUT_CHECKING, 1),
            ])),
            "a motor that turns a screw is none in millimetres"
        );
        let loops = "loops = { position_gain = 50.0, position_integral_gain = 0.0, velocity_gain = 400.5, \
                     velocity_integral_gain = 80.0, velocity_feed_forward = 99.5 }";
        assert_eq!(
            read("revolution", loops),
            Ok(Nameplate(vec![
                (Parameter::POSITION_LOOP_GAIN, 50_000_000),
                (Parameter::POSITION_INTEGRAL_GAIN, 0),
                (Parameter::VELOCITY_LOOP_GAIN, 400_500_000),
                (Parameter::VELOCITY_INTEGRAL_TIME, 12_500_000),
                (Parameter::VELOCITY_FEED_FORWARD_GAIN, 995_000),
            ]))
        );
        let none = "loops = { velocity_integral_gain = 0.0 }";
        let none = read("revolution", none);
        assert_eq!(none, Ok(Nameplate(vec![(Parameter::VELOCITY_INTEGRAL_TIME, 0)])), "0 is none");
        assert_eq!(read("revolution", ""), Ok(Nameplate(Vec::new())));
    }

    #[test]
    fn what_no_motor_has_is_refused() {
        for (unit, keys, expected) in [
            ("revolution", "motor = { rated_torque = 0.0 }", "the rated torque is 0"),
            ("revolution", "motor = { resistance = -1.0 }", "the resistance is -1"),
            ("revolution", "motor = { poles = 7 }", "the number of poles is 7"),
            (
                "millimetre",
                "motor = { type = \"linear-induction\", poles = 8 }",
                "a linear motor has no number of poles",
            ),
            (
                "millimetre",
                "motor = { rated_speed = 2.5 }",
                "the motor of an axis in millimetres may turn or not",
            ),
            ("revolution", "motor = { type = \"steam\" }", "unknown type of motor `steam`"),
            ("revolution", "motor = { pole_pitch = 24.0 }", "only a linear motor has a pole_pitch"),
            (
                "revolution",
                "motor = { type = \"rotary-induction\", voltage_constant = 60.0 }",
                "only a motor with permanent magnets has a voltage_constant",
            ),
            (
                "revolution",
                "motor = { type = \"rotary-permanent-magnet\", flux_current = 1.0 }",
                "only an induction motor has a flux_current",
            ),
            (
                "revolution",
                "encoder = { length = 10.0 }",
                "only the encoder of the other kind of motor has length",
            ),
            (
                "revolution",
                "encoder = { startup = \"incremental\", turns = 4096 }",
                "only an absolute encoder has turns",
            ),
            ("revolution", "encoder = { turns = 0 }", "the number of turns is 0"),
            ("revolution", "encoder = { type = \"ldt\" }", "unknown type of encoder `ldt`"),
            ("revolution", "converter = { mains = \"230\" }", "unknown kind of mains `230`"),
            ("revolution", "converter = { bus_voltage = 1e30 }", "the bus voltage"),
            ("revolution", "loops = { position_gain = 0.0 }", "the gain of the position loop is 0"),
            ("revolution", "loops = { velocity_gain = -1.0 }", "the gain of the velocity loop is -1"),
            (
                "revolution",
                "loops = { position_integral_gain = -0.5 }",
                "the integral gain of the position loop is -0.5",
            ),
            (
                "revolution",
                "loops = { velocity_feed_forward = -1.0 }",
                "the feedforward of the velocity is -1",
            ),
            ("revolution", "loops = { velocity_feed_forward = nan }", "the feedforward of the velocity"),
            (
                "revolution",
                "loops = { velocity_integral_gain = 1e-12 }",
                "the integral gain of the velocity loop is 0.000000000001",
            ),
            (
                "revolution",
                "loops = { velocity_integral_gain = 3e9 }",
                "the integral gain of the velocity loop is 3000000000",
            ),
        ] {
            let error = read(unit, keys).expect_err(keys);
            assert!(error.iter().any(|error| error.contains(expected)), "{keys}: {error:?}");
        }
    }

    /// What the tables take to be of a nameplate is what its keys say.
    #[test]
    fn the_keys_are_the_parameters_that_the_tables_expect() {
        let both = "rated_torque = 1.0, rated_current = 1.0, peak_current = 1.0, rated_speed = 1.0, max_speed = 1.0, rated_voltage = 1.0, \
                    rated_power = 1.0, inertia = 1.0, resistance = 1.0, inductance = 1.0, max_winding_temperature = 1.0, \
                    overload_limit = 1.0, thermal_time_constant = 1.0";
        let magnets = "torque_constant = 1.0, voltage_constant = 1.0, q_inductance = 1.0, d_inductance = 1.0";
        let converter = "converter = { bus_voltage = 1.0, rated_current = 1.0, rated_voltage = 1.0, rated_power = 1.0, \
                         thermal_time_constant = 1.0, bus = \"standalone\", mains = \"high\", checks_enable_input = false }";
        let loops = "loops = { position_gain = 1.0, position_integral_gain = 1.0, velocity_gain = 1.0, \
                     velocity_integral_gain = 1.0, velocity_feed_forward = 1.0 }";
        let mut found = std::collections::BTreeSet::new();
        for (kind, keys, encoder) in [
            ("rotary-permanent-magnet", format!("{both}, {magnets}, poles = 8"), "turns = 4096"),
            ("linear-permanent-magnet", format!("{both}, {magnets}, pole_pitch = 1.0"), "length = 1.0"),
            (
                "rotary-induction",
                "rated_frequency = 1.0, flux_current = 1.0, stator_resistance = 1.0".to_owned(),
                "turns = 1",
            ),
        ] {
            let keys = format!(
                "motor = {{ type = \"{kind}\", {keys} }}\n{converter}\n\
                 encoder = {{ type = \"resolver\", startup = \"absolute\", {encoder} }}\n{loops}"
            );
            found
                .extend(read("millimetre", &keys).expect(kind).0.into_iter().map(|(parameter, _)| parameter));
        }
        assert_eq!(found, OF_CONFIGURATION.into_iter().collect());
    }
}
