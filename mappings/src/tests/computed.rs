//! Values that overlays compute from others: what they come to, how they are set, and what is wrong with them.

use profile_generic::ratio::{Ratio, Rounding};

use super::*;
use crate::check::texts;
use crate::computed::{
    Computation, Control, Fact, Known, Limit, NoValue, Operand, Operation, READS_MAX, Read, Row,
};
use profile_generic::mode::OperatingMode;

const EXAMPLE: &str = include_str!("../../../examples/overlays/computed.toml");

fn checked(text: &str) -> Vec<String> {
    let mut tables = TableTexts::embedded();
    tables.overlays = vec![Overlay::new("own.toml", text)];
    let found = texts(Some(tables), Findings::default()).findings.to_string();
    found
        .split("\n\n")
        .filter(|found| found.contains("own.toml") && !found.starts_with("note"))
        .map(str::to_owned)
        .collect()
}

fn computation(name: &str) -> Computation {
    let mut tables = TableTexts::embedded();
    tables.overlays = vec![Overlay::new("own.toml", EXAMPLE)];
    let mapping = Mapping::from_texts(&tables).unwrap_or_else(|findings| panic!("{findings}"));
    let generic = &mapping.dictionaries.generic;
    generic.computation(generic.parameter(name).unwrap().parameter).unwrap().clone()
}

fn known(values: &[i64]) -> Known {
    let mut known = Known::default();
    known.facts.iter_mut().zip(values).for_each(|(place, value)| *place = Fact::Value(*value));
    known
}

/// The example with one text in place of another has a finding that says all of `expected`.
#[track_caller]
fn wrong(good: &str, bad: &str, expected: &[&str]) {
    assert!(EXAMPLE.contains(good), "{good}");
    let found = checked(&EXAMPLE.replacen(good, bad, 1));
    assert!(
        found.iter().any(|found| expected.iter().all(|text| found.contains(text))),
        "{expected:?} not in\n{}",
        found.join("\n\n")
    );
}

/// The example with rows at its end.
#[track_caller]
fn wrong_rows(rows: &str, expected: &[&str]) {
    let found = checked(&format!("{EXAMPLE}\n{rows}"));
    assert!(
        found.iter().any(|found| expected.iter().all(|text| found.contains(text))),
        "{expected:?} not in\n{}",
        found.join("\n\n")
    );
}

fn parameter(number: u16, name: &str, access: &str, more: &str) -> String {
    format!(
        "[[generic.parameter]]\nnumber = {number}\nname = \"{name}\"\nquantity = \"none\"\ntype = \"integer\"\n\
         access = \"{access}\"\n{more}\n"
    )
}

#[test]
fn the_example_is_clean_and_its_values_are_right() {
    assert_eq!(checked(EXAMPLE), Vec::<String>::new());
    // 12.5 A at 560 V are 7 kW.
    let power = computation("dc_power");
    assert_eq!(power.value(&known(&[12_500_000, 560_000_000])), Ok(7_000_000));
    // 0.5 uA V is half a microwatt, 0.0005 mW: nothing. 1 mA at 0.5 V is 0.5 mW, which is 1.
    assert_eq!(power.value(&known(&[1, 500_000])), Ok(0));
    assert_eq!(power.value(&known(&[1_000, 500_000])), Ok(1));
    assert_eq!(power.value(&known(&[12_500_000])), Err(NoValue::Needs(1)));
    assert_eq!(power.solve(1, &known(&[1, 1])), Err(NoValue::ReadOnly));
    let reserve = computation("dc_current_reserve");
    assert_eq!(reserve.value(&known(&[52_500_000])), Ok(-12_500_000));
    let load = computation("dc_load");
    for (microamperes, percent) in
        [(0, 0), (12_500_000, 31), (12_600_000, 32), (102_000_000, 255), (6_553_500_000, 255)]
    {
        assert_eq!(load.value(&known(&[microamperes])), Ok(percent), "{microamperes}");
    }
    let gain = computation("gain_in_force");
    assert_eq!(gain.value(&known(&[0, 7])), Ok(7));
    assert_eq!(gain.value(&known(&[1, 7])), Err(NoValue::Needs(2)), "only what is selected is read");
    assert_eq!(gain.value(&known(&[1, 7, 9])), Ok(9));
    assert_eq!(gain.value(&known(&[2, 7, 9])), Err(NoValue::Operand(0)));
    assert_eq!(gain.solve(5, &known(&[0])), Ok((Parameter(0x8024), 5)));
    assert_eq!(gain.solve(5, &known(&[1])), Err(NoValue::Choice(1)));
    assert_eq!(gain.solve(5, &Known::default()), Err(NoValue::Needs(0)));
    let filter = computation("filter_time");
    let ticks = |time| filter.solve(time, &Known::default()).map(|(_, ticks)| ticks);
    // 2 ms are 32 ticks; 2.1 ms are 33.6.
    assert_eq!([ticks(2_000_000), ticks(2_100_000)], [Ok(32), Ok(34)]);
    assert_eq!([ticks(62_499), ticks(50_000_001)], [Err(NoValue::Beyond); 2]);
    assert_eq!([ticks(62_500), ticks(50_000_000)], [Ok(1), Ok(800)]);
}

fn row(operation: Operation, factor: (i64, i64), rounding: Rounding) -> Computation {
    let factor = Ratio::new(factor.0, factor.1).unwrap();
    let read = |number| Read {
        signal: None,
        parameter: Some(Parameter(number)),
        is_zero_if_missing: false,
        range: None,
    };
    let row = Row {
        parameter: Parameter(0x8000),
        operation,
        factor,
        rounding,
        range: None,
        saturates: false,
        modes: Vec::new(),
    };
    Computation { reads: vec![read(0x8001), read(0x8002)], rows: vec![row], written: Some(0) }
}

const A: Operand = Operand::Read(0);
const B: Operand = Operand::Read(1);

#[test]
fn results_are_rounded_once_as_the_row_says() {
    let ratio = |rounding| row(Operation::Ratio(A, B), (1, 1), rounding);
    let results = |dividend, divisor| {
        [Rounding::Nearest, Rounding::Floor, Rounding::TowardZero]
            .map(|rounding| ratio(rounding).value(&known(&[dividend, divisor])).unwrap())
    };
    assert_eq!(results(7, 2), [4, 3, 3]);
    assert_eq!(results(-7, 2), [-4, -4, -3]);
    assert_eq!(results(7, -2), [-4, -4, -3]);
    assert_eq!(results(5, 3), [2, 1, 1]);
    // A third of the sum, not the sum of thirds.
    let third = row(Operation::Sum(vec![A, B], vec![]), (1, 3), Rounding::Nearest);
    assert_eq!(third.value(&known(&[2, 2])), Ok(1));
    assert_eq!(third.value(&known(&[i64::MAX, i64::MAX])), Ok(6_148_914_691_236_517_205));
    assert_eq!(ratio(Rounding::Nearest).value(&known(&[1, 0])), Err(NoValue::Divisor));
}

#[test]
fn what_does_not_fit_is_refused_or_held_and_never_wraps() {
    let mut product = row(Operation::Product(vec![A, B]), (1, 1), Rounding::Nearest);
    assert_eq!(product.value(&known(&[i64::MAX, 2])), Err(NoValue::Beyond));
    assert_eq!(product.value(&known(&[i64::MIN, i64::MIN])), Err(NoValue::Beyond));
    product.rows[0].range = Some((-5, 9));
    assert_eq!(product.value(&known(&[3, 4])), Err(NoValue::Beyond));
    product.rows[0].saturates = true;
    assert_eq!(product.value(&known(&[3, 4])), Ok(9));
    assert_eq!(product.value(&known(&[3, -4])), Ok(-5));
    assert_eq!(product.value(&known(&[i64::MAX, i64::MIN])), Ok(-5));
    let sum = row(Operation::Sum(vec![A], vec![B]), (1, 1), Rounding::Nearest);
    assert_eq!(sum.value(&known(&[i64::MIN, 1])), Err(NoValue::Beyond));
    assert_eq!(sum.solve(i64::MAX, &known(&[0, i64::MAX])), Err(NoValue::Beyond));
}

#[test]
fn the_written_operand_is_solved_for() {
    let solve = |operation: Operation, written, wanted, values: &[i64]| {
        let mut made = row(operation, (2, 5), Rounding::Nearest);
        made.written = Some(written);
        made.solve(wanted, &known(values)).map(|(_, value)| value)
    };
    let sum = || Operation::Sum(vec![A], vec![B]);
    // (a - 10) * 2 / 5 = 4, (20 - b) * 2 / 5 = 4.
    assert_eq!(solve(sum(), 0, 4, &[0, 10]), Ok(20));
    assert_eq!(solve(sum(), 1, 4, &[20]), Ok(10));
    let product = || Operation::Product(vec![A, B]);
    assert_eq!(solve(product(), 0, 12, &[0, 3]), Ok(10));
    assert_eq!(solve(product(), 0, 12, &[0, 0]), Err(NoValue::Divisor));
    let ratio = || Operation::Ratio(A, B);
    assert_eq!(solve(ratio(), 0, 4, &[0, 3]), Ok(30));
    assert_eq!(solve(ratio(), 1, 4, &[30]), Ok(3));
    assert_eq!(solve(ratio(), 1, 0, &[30]), Err(NoValue::Divisor));
}

proptest! {
    /// What is written is read back, as near as the operand can be.
    #[test]
    fn what_is_set_is_read_back(
        a in -1_000_000_i64..1_000_000, b in 1_i64..10_000, num in 1_i64..100, den in 1_i64..100, kind in 0..3,
    ) {
        let operation = match kind {
            0 => Operation::Sum(vec![A, B], vec![]),
            1 => Operation::Product(vec![A, B]),
            _ => Operation::Ratio(A, B),
        };
        let made = row(operation, (num, den), Rounding::Nearest);
        let value = made.value(&known(&[a, b])).unwrap();
        let (_, solved) = made.solve(value, &known(&[0, b])).unwrap();
        let back = made.value(&known(&[solved, b])).unwrap();
        // One step of the operand is so much of the result.
        let step = match kind { 0 => num / den, 1 => num * b / den, _ => num / (den * b) };
        prop_assert!((back - value).abs() <= step / 2 + 1, "{back} for {value}");
    }
}

#[test]
fn one_operation_with_known_operands() {
    wrong("product = [\"dc_current\", \"dc_voltage\"]\n", "", &["expected one of sum, product, ratio"]);
    let two = "product = [\"dc_current\", \"dc_voltage\"]\nsum = [\"dc_power\"]";
    wrong("product = [\"dc_current\", \"dc_voltage\"]", two, &["AX0015", "expected one of sum"]);
    wrong(
        "\"dc_current\", \"dc_voltage\"]",
        "\"dc_curent\", \"dc_voltage\"]",
        &["AX0010", "did you mean `dc_current`?"],
    );
    wrong(
        "\"dc_current\", \"dc_voltage\"]",
        "\"motor_name\", \"dc_voltage\"]",
        &["AX0036", "motor_name is a text"],
    );
    wrong("by = \"gain_set\"\n", "", &["AX0007", "`by`"]);
    wrong("{ is = 1, take", "{ is = 0, take", &["AX0014", "0 selects something already"]);
    wrong(
        "parameter = \"dc_load\"\nratio",
        "parameter = \"jerk_limit\"\nratio",
        &["AX0010", "number from 0x8000"],
    );
    wrong("name = \"filter_tick\"", "name = \"filter_ticks\"", &["AX0014", "of this name is there already"]);
    wrong("rounding = \"nearest\"", "rounding = \"up\"", &["AX0012", "nearest, floor, toward_zero"]);
}

#[test]
fn units_agree_at_both_ends() {
    wrong(
        "quantity = \"power\"",
        "quantity = \"voltage\"",
        &["AX0030", "expected V, which measures voltage, got V A"],
    );
    wrong(
        "sum = [\"dc_current_rated\"]",
        "sum = [\"filter_tick\"]",
        &["AX0030", "expected current, as the result, got filter_tick, which is time"],
    );
    wrong("take = \"gain_b\"", "take = \"filter_tick\"", &["AX0030", "filter_tick, which is time"]);
    wrong("by = \"gain_set\"", "by = \"dc_current\"", &["AX0030", "a bare number to select by"]);
    let cold = EXAMPLE.replace("quantity = \"voltage\"", "quantity = \"temperature\"");
    assert!(checked(&cold).iter().any(|found| found.contains("degrees Celsius")), "{:?}", checked(&cold));
}

#[test]
fn results_fit_with_every_value_that_drives_can_have() {
    wrong(
        "saturates = \"the panel shows one byte, and 255 % means far too much\"\n",
        "",
        &["AX0075", "`parameter`", "0 to 16384", "do not fit 0 to 255"],
    );
    wrong(
        "ratio = [\"dc_current\", \"dc_current_rated\"]",
        "ratio = [\"dc_current_rated\", \"dc_current\"]",
        &["AX0075", "the divisor can be 0"],
    );
    wrong(
        "range = [62_500, 50_000_000]",
        "range = [62_500, 49_999_999]",
        &["AX0075", "62500 to 50000000 ns"],
    );
    wrong("range = [0, 255]\n", "", &["AX0015", "at whose ends the value is held"]);
    let narrow =
        EXAMPLE.replace("name = \"DC Power\"\ntype = \"REAL\"", "name = \"DC Power\"\ntype = \"UINT\"");
    assert!(
        checked(&narrow).iter().any(|found| found.contains("do not fit a UINT")),
        "{:?}",
        checked(&narrow)
    );
}

#[test]
fn only_one_operand_of_ones_own_is_written() {
    wrong("writes = \"filter_ticks\"\n", "", &["AX0077", "expected `writes`"]);
    wrong("writes = \"filter_ticks\"", "writes = \"filter_tick\"", &["AX0077", "which a drive can take"]);
    wrong("writes = \"filter_ticks\"", "writes = \"gain_a\"", &["AX0077", "one of the operands"]);
    wrong(
        "[\"filter_ticks\", \"filter_tick\"]",
        "[\"filter_ticks\", \"filter_ticks\"]",
        &["AX0077", "there 2 times"],
    );
    wrong(
        "parameter = \"dc_power\"\n",
        "parameter = \"dc_power\"\nwrites = \"dc_current\"\n",
        &["AX0015", "dc_power is only read"],
    );
    wrong("writes = \"gain_a\"", "writes = \"gain_set\"", &["AX0077", "one of the operands"]);
    let disabled = EXAMPLE.replace(
        "name = \"filter_ticks\"\nquantity = \"none\"\ntype = \"integer\"\naccess = \"write\"",
        "name = \"filter_ticks\"\nquantity = \"none\"\ntype = \"integer\"\naccess = \"write_while_disabled\"",
    );
    let found = checked(&disabled);
    assert!(found.iter().any(|found| found.contains("AX0032") && found.contains("has torque")), "{found:?}");
}

#[test]
fn values_that_need_each_other_are_refused_once() {
    let rows = [
        parameter(0x8031, "one", "read", ""),
        parameter(0x8032, "two", "read", ""),
        "[[generic.computed]]\nparameter = \"one\"\nsum = [\"two\", \"gain_a\"]\nsource = \"x\"\n".to_owned(),
        "[[generic.computed]]\nparameter = \"two\"\nproduct = [\"one\", \"gain_b\"]\nsource = \"x\"\n"
            .to_owned(),
    ];
    let found = checked(&format!("{EXAMPLE}\n{}", rows.concat()));
    let cycles: Vec<_> = found.iter().filter(|found| found.contains("AX0076")).collect();
    assert_eq!(cycles.len(), 1, "{found:?}");
    assert!(cycles[0].contains("one by two by one"), "{cycles:?}");
}

#[test]
fn a_computed_value_is_in_no_drive_and_its_operands_are_in_one() {
    let row = "[[generic-sercos.parameter]]\nparameter = \"gain_in_force\"\nidn = \"P-0-0714\"\n\
               direction = \"both\"\nmissing = \"reject\"\nsource = \"x\"\n";
    wrong_rows(row, &["AX0015", "the value is computed"]);
    let start = EXAMPLE.find("[[generic-cia402.parameter]]").unwrap();
    let end = start + EXAMPLE[start..].find("# --- ").unwrap();
    let without = format!("{}{}", &EXAMPLE[..start], &EXAMPLE[end..]);
    let found = checked(&without);
    assert!(
        found.iter().any(|found| found.contains("AX0016") && found.contains("filter_ticks")),
        "{found:?}"
    );
    // A range of what is only read has to be of use.
    let useless = parameter(0x8031, "alone", "read", "range = [0, 5]");
    wrong_rows(&useless, &["AX0015", "no computed value uses"]);
}

/// A value can be computed from another one that is.
#[test]
fn computed_values_are_operands_too() {
    let rows = [
        parameter(0x8031, "twice", "read", ""),
        "[[generic.computed]]\nparameter = \"twice\"\nsum = [\"gain_in_force\", \"gain_in_force\"]\nsource = \"x\"\n".to_owned(),
        "[[cip-attributes.attribute]]\nid = 2_031\nname = \"Twice\"\ntype = \"UINT\"\naccess = \"get\"\nneed = \"------\"\nsource = \"Line 5\"\n".to_owned(),
        "[[cip-generic.attribute]]\nattribute = \"Twice\"\nparameter = \"twice\"\nmissing = \"reject\"\nsource = \"Line 5\"\n".to_owned(),
    ];
    let text = format!("{EXAMPLE}\n{}", rows.concat());
    assert_eq!(checked(&text), Vec::<String>::new());
    let mut tables = TableTexts::embedded();
    tables.overlays = vec![Overlay::new("own.toml", &text)];
    let mapping = Mapping::from_texts(&tables).unwrap();
    let twice = mapping.dictionaries.generic.computation(Parameter(0x8031)).unwrap();
    assert_eq!((twice.reads.len(), twice.rows.len()), (3, 2));
    assert_eq!(twice.value(&known(&[0, 21])), Ok(42));
}

/// A row with a limit between 0 and 10, or the tighter one of both directions.
fn limited(holds: bool) -> Computation {
    let limit = Limit {
        value: A,
        least: vec![Operand::Constant(-20), B],
        most: vec![Operand::Constant(10)],
        within: vec![Operand::Constant(15)],
        holds,
    };
    row(Operation::Limit(limit), (1, 1), Rounding::Nearest)
}

#[test]
fn a_limit_holds_a_value_or_leaves_it_unknown() {
    let [held, open] = [limited(true), limited(false)];
    for (value, end, expected, is_between) in [
        (5, -18, 5, true),
        (10, -18, 10, false),
        (11, -18, 10, false),
        (-14, -18, -14, true),
        (-15, -18, -15, false),
        (-40, -18, -15, false),
        (-40, -3, -3, false),
    ] {
        assert_eq!(held.value(&known(&[value, end])), Ok(expected), "{value}");
        let open = open.value(&known(&[value, end]));
        assert_eq!(open, if is_between { Ok(value) } else { Err(NoValue::Limited) }, "{value}");
    }
    assert_eq!(held.value(&known(&[1, 11])), Err(NoValue::Beyond), "ends that contradict each other");
    assert_eq!(held.value(&known(&[1])), Err(NoValue::Needs(1)));
    // An end that the drive does not have does not count.
    let mut lacks = known(&[-40]);
    lacks.facts[1] = Fact::Absent;
    assert_eq!(held.value(&lacks), Ok(-15));
    assert_eq!(held.solve(1, &known(&[1, 1])), Err(NoValue::ReadOnly));
    let limit = |least, holds| Limit { value: A, least, most: vec![], within: vec![], holds };
    let without = |holds| row(Operation::Limit(limit(vec![B], holds)), (1, 1), Rounding::Nearest);
    assert_eq!(without(true).value(&known(&[70, 1])), Ok(70), "no upper end");
    assert_eq!(
        without(false).value(&known(&[70, 1])),
        Err(NoValue::Absent(0)),
        "nobody knows whether one acts"
    );
}

#[test]
fn a_row_of_some_modes_is_0_in_others_and_unknown_while_the_drive_moves_by_itself() {
    let mut made = row(Operation::Sum(vec![A], vec![]), (1, 1), Rounding::Nearest);
    made.rows[0].modes = vec![OperatingMode::Position];
    let value = |control, facts: Known| made.value(&Known { control, ..facts });
    assert_eq!(value(Control::Gateway(OperatingMode::Position), known(&[7])), Ok(7));
    assert_eq!(value(Control::Gateway(OperatingMode::Position), Known::default()), Err(NoValue::Needs(0)));
    for control in [Control::Gateway(OperatingMode::Velocity), Control::Off] {
        assert_eq!(value(control, Known::default()), Ok(0), "nothing is asked for: {control:?}");
    }
    assert_eq!(value(Control::Drive, known(&[7])), Err(NoValue::Mode));
}

#[test]
fn what_a_drive_lacks_is_told_from_what_is_silent_and_what_is_0_for_certain() {
    let mut made = row(Operation::Product(vec![A, B]), (1, 1), Rounding::Nearest);
    let value =
        |made: &Computation, fact| made.value(&Known { facts: [fact; READS_MAX], ..Known::default() });
    assert_eq!(value(&made, Fact::Absent), Err(NoValue::Absent(0)));
    assert_eq!(value(&made, Fact::Silent), Err(NoValue::Silent(0)));
    // With a factor of 0 the others do not matter.
    made.reads[1].is_zero_if_missing = true;
    assert_eq!(value(&made, Fact::Absent), Ok(0));
    // The drive's own value counts where it has one; in a mode of other values the row is 0 all the same.
    let own = Operand::ReadOrRow(0, 0);
    let inner = row(Operation::Sum(vec![B], vec![]), (1, 1), Rounding::Nearest).rows.remove(0);
    let mut both = row(Operation::Sum(vec![own], vec![]), (1, 1), Rounding::Nearest);
    both.rows.insert(0, inner);
    assert_eq!(both.value(&known(&[3, 4])), Ok(3));
    let mut lacks = known(&[3, 4]);
    lacks.facts[0] = Fact::Absent;
    assert_eq!(both.value(&lacks), Ok(4));
    both.rows[0].modes = vec![OperatingMode::Velocity];
    assert_eq!(both.value(&known(&[3, 4])), Ok(0));
}

const LIMITED: &str = "limit = \"dc_current\"\nmost = [\"dc_current_rated\"]\n";

/// The reserve of the example as a limit.
#[track_caller]
fn wrong_limit(rows: &str, expected: &[&str]) {
    wrong("sum = [\"dc_current_rated\"]\nless = [\"dc_current\"]\n", rows, expected);
}

#[test]
fn signals_and_limits_are_checked() {
    let plain = "sum = [\"dc_current_rated\"]\nless = [\"dc_current\"]\n";
    let good = |rows: &str| {
        let found = checked(&EXAMPLE.replacen(plain, rows, 1));
        assert_eq!(found, Vec::<String>::new(), "{rows}");
    };
    good(LIMITED);
    good(
        "sum = [\"current_actual\"]\nless = [\"dc_current\"]\nsignals = [\"current_actual\"]\nmodes = [\"position\"]\n",
    );
    wrong_limit("limit = \"dc_current\"\n", &["AX0007", "`least`, `most` or `within`"]);
    wrong_limit(
        "limit = \"dc_current\"\nmost = [\"dc_voltage\"]\n",
        &["AX0030", "dc_voltage, which is voltage"],
    );
    wrong_limit("sum = [\"dc_current\"]\nmost = [\"dc_current_rated\"]\n", &["AX0015", "expected a `limit`"]);
    wrong_limit(&format!("{LIMITED}at_limit = \"stop\"\n"), &["AX0012", "hold, none"]);
    wrong_limit(&format!("{LIMITED}modes = [\"positon\"]\n"), &["AX0010", "did you mean `position`?"]);
    wrong_limit(
        "sum = [\"curent_actual\"]\nsignals = [\"curent_actual\"]\n",
        &["AX0010", "a signal of the generic model", "did you mean `current_actual`?"],
    );
    wrong_limit(
        "sum = [\"dc_current\"]\nsignals = [\"current_actual\"]\n",
        &["AX0015", "one of the operands of the row"],
    );
    wrong_limit(
        "sum = [\"velocity_actual\"]\nsignals = [\"velocity_actual\"]\n",
        &["AX0030", "velocity_actual, which is velocity"],
    );
    wrong_limit(
        "sum = [\"current_actual\"]\nsignals = [\"current_actual\"]\nzero_if_missing = [\"current_actual\"]\n",
        &["AX0015", "this one is a signal"],
    );
    // What a controller sets is kept somewhere.
    wrong(
        "parameter = \"dc_load\"\nratio",
        "parameter = \"torque_limit_positive\"\nratio",
        &["AX0010", "of the catalogue that is only read"],
    );
    // An attribute takes a parameter for its signal only where both measure the same.
    for (attribute, signal, rows, expected) in [
        ("Position Error", "following_error", "parameter = \"velocity_error\"", "turns that into velocity"),
        (
            "Torque Command",
            "torque_command",
            "parameter = \"motor_capacity\"",
            "measures torque, as torque_command",
        ),
        (
            "Position Error",
            "following_error",
            "parameter = \"following_error\"\nmissing = \"zero\"",
            "only read, and no `missing`",
        ),
    ] {
        let text = format!(
            "[[cip-generic.attribute]]\nattribute = \"{attribute}\"\nsignal = \"{signal}\"\n{rows}\nsource = \"x\"\n"
        );
        wrong_rows(&text, &[expected]);
    }
}

/// What is computed by the shipped tables needs no other value that needs it.
#[test]
fn shipped_values_that_need_each_other_are_refused() {
    let text = "format = 1\noverlay = \"x\"\n\n[[generic.computed]]\nparameter = \"velocity_demand\"\n\
                sum = [\"velocity_error\"]\nsource = \"x\"\n";
    let found = checked(text);
    assert!(found.iter().any(|found| found.contains("AX0076")), "{found:?}");
}

/// The rows of the loops with numbers that were worked out by hand: 50 1/s times 0.02 turns, and half of 2 turns a second.
#[test]
fn shipped_rows_of_the_loops_come_out() {
    let mapping = shipped();
    let generic = &mapping.dictionaries.generic;
    let control = Control::Gateway(OperatingMode::Position);
    let value = |name: &str, given: &[(&str, i64)]| {
        let computation = generic.computation(generic.parameter(name).unwrap().parameter).unwrap();
        let mut known = Known { control, ..Known::default() };
        for (fact, read) in known.facts.iter_mut().zip(&computation.reads) {
            let name = match read.signal {
                Some(signal) => signal.name(),
                None => generic.by_number(read.parameter.unwrap()).unwrap().name.as_str(),
            };
            let found = given.iter().find(|(known, _)| *known == name);
            *fact = found.map_or(Fact::Absent, |(_, value)| Fact::Value(*value));
        }
        computation.value(&known)
    };
    let given = [
        ("position_loop_gain", 50_000_000),
        ("following_error", 20_000_000),
        ("velocity_feed_forward_gain", 500_000),
        ("velocity_command", 2_000_000_000),
        ("velocity_offset", 10_000_000),
        ("velocity_actual", 1_900_000_000),
        ("velocity_limit_bipolar", 2_005_000_000),
    ];
    assert_eq!(value("position_loop_output", &given), Ok(1_000_000_000));
    assert_eq!(value("velocity_feed_forward", &given), Ok(1_000_000_000));
    assert_eq!(value("velocity_reference", &given), Ok(2_005_000_000), "at the limit of the drive");
    assert_eq!(value("velocity_reference", &given[..6]), Ok(2_010_000_000));
    assert_eq!(value("velocity_error", &given), Ok(105_000_000));
    assert_eq!(value("velocity_feed_forward", &given[3..]), Err(NoValue::Absent(0)));
    assert_eq!(value("acceleration_feed_forward", &[]), Ok(0), "no such gain, and no acceleration set-point");
    assert_eq!(value("position_integrator_output", &[]), Ok(0));
    assert_eq!(
        value("position_integrator_output", &[("position_integral_gain", 3)]),
        Err(NoValue::Choice(3)),
        "the drive does not show the state of its integrator"
    );
    // A quarter of 2 Nm at 10 turns of the motor a second, 2.5 of the load: 31.416 W.
    let power = [
        ("torque_actual", 250_000),
        ("motor_rated_torque", 2_000_000),
        ("velocity_actual", 2_500_000_000),
        ("motor_turns_per_unit", 4_000_000_000_000_000),
    ];
    assert_eq!(value("output_power", &power), Ok(31_416));
    // A quarter of 3 A, backwards.
    let current = [("torque_actual", -250_000), ("motor_rated_current", 3_000_000)];
    assert_eq!(value("current_actual", &current), Ok(-750_000));
}
