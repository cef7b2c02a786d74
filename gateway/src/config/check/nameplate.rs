//! `motor` and `converter` of an `[[axis]]`.

use profile_generic::parameter::Parameter;
use profile_generic::ratio::Ratio;

use super::{Problems, value};
use crate::config::file::{AxisTable, ConverterTable, MotorTable};
use crate::config::{AxisKind, Nameplate};
use crate::finding::Spanned;
use crate::finding::registry as code;

/// A number of the file, what it is, the parameter, and generic units in one unit of the file.
type Row<'t> = (&'t Option<Spanned<f64>>, &'static str, Parameter, (i64, i64));

/// Revolutions per minute in nanounits a second, and metres a second in nanounits of a millimetre.
const SPEED: [(i64, i64); 2] = [(50_000_000, 3), (1_000_000_000_000, 1)];

/// Kilogram square metres in 1e-9, kilograms in 1e-6.
const INERTIA: [(i64, i64); 2] = [(1_000_000_000, 1), (1_000_000, 1)];

pub(super) fn check(problems: &mut Problems, table: &AxisTable, kind: Option<AxisKind>) -> Option<Nameplate> {
    let (no_motor, no_converter) = (MotorTable::default(), ConverterTable::default());
    let motor = table.motor.as_ref().unwrap_or(&no_motor);
    let converter = table.converter.as_ref().unwrap_or(&no_converter);
    let is_linear = usize::from(kind == Some(AxisKind::Linear));
    const MILLION: (i64, i64) = (1_000_000, 1);
    let rows: [Row<'_>; 14] = [
        (&motor.rated_torque, "the rated torque", Parameter::MOTOR_RATED_TORQUE, MILLION),
        (&motor.rated_current, "the rated current", Parameter::MOTOR_RATED_CURRENT, MILLION),
        (&motor.peak_current, "the peak current", Parameter::MOTOR_PEAK_CURRENT, MILLION),
        (&motor.rated_speed, "the rated speed", Parameter::MOTOR_RATED_VELOCITY, SPEED[is_linear]),
        (&motor.max_speed, "the highest speed", Parameter::MOTOR_MAX_VELOCITY, SPEED[is_linear]),
        (&motor.rated_voltage, "the rated voltage", Parameter::MOTOR_RATED_VOLTAGE, MILLION),
        (&motor.rated_power, "the rated power", Parameter::MOTOR_RATED_POWER, MILLION),
        (&motor.inertia, "the inertia", Parameter::MOTOR_INERTIA, INERTIA[is_linear]),
        (&motor.resistance, "the resistance", Parameter::MOTOR_RESISTANCE, MILLION),
        (&motor.inductance, "the inductance", Parameter::MOTOR_INDUCTANCE, (1_000_000_000, 1)),
        (
            &motor.max_winding_temperature,
            "the highest temperature",
            Parameter::MOTOR_MAX_TEMPERATURE,
            (1_000, 1),
        ),
        (&motor.overload_limit, "the overload limit", Parameter::MOTOR_OVERLOAD_LIMIT, (10_000, 1)),
        (&converter.bus_voltage, "the bus voltage", Parameter::BUS_NOMINAL_VOLTAGE, MILLION),
        (&converter.rated_current, "the rated current", Parameter::DRIVE_RATED_CURRENT, MILLION),
    ];
    let mut data = Vec::new();
    let mut is_good = true;
    for (number, what, parameter, (num, den)) in rows {
        match value::positive(problems, number, what, Ratio::new(num, den)) {
            Some(fine) => data.extend(fine.map(|fine| (parameter, fine))),
            None => is_good = false,
        }
    }
    match &motor.poles {
        Some(poles) if kind == Some(AxisKind::Linear) => {
            let title = "a linear motor has no number of poles";
            problems.report_as::<()>(code::CONTRADICTION, poles.span(), title, "expected no poles");
            is_good = false;
        }
        Some(poles) => match value::number::<u16>(problems, poles, "the number of poles", 2..=65_534) {
            Some(number) if number % 2 == 0 => data.push((Parameter::MOTOR_POLE_COUNT, i64::from(number))),
            Some(number) => {
                let title = format!("the number of poles is {number}");
                problems.report_as::<()>(code::OUT_OF_RANGE, poles.span(), title, "expected an even number");
                is_good = false;
            }
            None => is_good = false,
        },
        None => {}
    }
    data.sort_by_key(|(parameter, _)| *parameter);
    is_good.then_some(Nameplate(data))
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

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
        assert_eq!(
            read("millimetre", "motor = { rated_speed = 2.5, inertia = 3.0 }"),
            Ok(Nameplate(vec![
                (Parameter::MOTOR_RATED_VELOCITY, 2_500_000_000_000),
                (Parameter::MOTOR_INERTIA, 3_000_000),
            ]))
        );
        assert_eq!(read("revolution", ""), Ok(Nameplate(Vec::new())));
    }

    #[test]
    fn what_no_motor_has_is_refused() {
        for (unit, keys, expected) in [
            ("revolution", "motor = { rated_torque = 0.0 }", "the rated torque is 0"),
            ("revolution", "motor = { resistance = -1.0 }", "the resistance is -1"),
            ("revolution", "motor = { poles = 7 }", "the number of poles is 7"),
            ("millimetre", "motor = { poles = 8 }", "a linear motor has no number of poles"),
            ("revolution", "converter = { bus_voltage = 1e30 }", "the bus voltage"),
        ] {
            let error = read(unit, keys).expect_err(keys);
            assert!(error.iter().any(|error| error.contains(expected)), "{keys}: {error:?}");
        }
    }
}
