//! Constants, and parameters whose values are computed from others: from rows to computations.

use profile_generic::image::Signal;
use profile_generic::mode::OperatingMode;
use profile_generic::parameter::{Access, Parameter, ParameterType};
use profile_generic::quantity::Quantity;
use profile_generic::ratio::{Ratio, Rounding};

use super::{GenericDictionary, GenericParameter, quantity};
use crate::computed::{Computation, Limit, Operand, Operation, READS_MAX, ROWS_MAX, Read, Row};
use crate::finding::registry as code;
use crate::format::{ComputedRow, ConstantRow, GenericFile, Name};
use crate::generic_names::{operating_mode, signal};
use crate::resolver::Resolver;

/// The most operands of a sum, and the most choices of a selection.
const OPERANDS_MAX: usize = 32;

/// The most factors of a product: that many of 31 bits fit the arithmetic.
const FACTORS_MAX: usize = 4;

/// Revolutions of the motor in a unit of the axis, in 1e-15: up to a gear of 1000:1.
const MOTOR_TURNS: (i64, i64) = (1, 1_000_000_000_000_000_000);

/// Whether a value beyond an end of `limit` is held at it.
pub(crate) const AT_LIMIT: [(&str, bool); 2] = [("hold", true), ("none", false)];

/// How a result becomes a whole number.
pub(crate) const ROUNDINGS: [(&str, Rounding); 3] = [
    (Rounding::Nearest.name(), Rounding::Nearest),
    (Rounding::Floor.name(), Rounding::Floor),
    (Rounding::TowardZero.name(), Rounding::TowardZero),
];

/// A constant by name.
#[derive(Debug, Clone)]
struct Constant {
    name: String,
    quantity: Quantity,
    value: i64,
}

/// What an operand names.
#[derive(Debug, Clone, Copy)]
enum Named<'g> {
    Constant(Quantity, i64),
    /// A parameter, and whether it is 0 in a drive without it.
    Parameter(&'g GenericParameter, bool),
    /// A signal, and the parameter of its name that is read while it has no value.
    Signal(Signal, Option<Parameter>),
}

impl Named<'_> {
    fn quantity(&self) -> Quantity {
        match self {
            Self::Constant(quantity, _) => *quantity,
            Self::Parameter(parameter, _) => parameter.quantity,
            Self::Signal(signal, _) => signal.quantity(),
        }
    }
}

/// How a row computes, by the names that it uses.
#[derive(Debug, Clone)]
enum Ways<'g> {
    Sum(Vec<Named<'g>>, Vec<Named<'g>>),
    Product(Vec<Named<'g>>),
    Ratio([Named<'g>; 2]),
    Selection(Named<'g>, Vec<(i64, Named<'g>)>),
    /// What is limited; least, most, within; whether it is held.
    Limit(Named<'g>, [Vec<Named<'g>>; 3], bool),
}

/// A row with its names looked up.
#[derive(Debug)]
struct Looked<'g> {
    row: &'g ComputedRow,
    parameter: &'g GenericParameter,
    ways: Ways<'g>,
    factor: Ratio,
    rounding: Rounding,
    modes: Vec<OperatingMode>,
}

/// Everything that is computed, by the numbers of the parameters.
pub(super) fn resolve(
    resolver: &mut Resolver<'_>,
    rows: &GenericFile,
    dictionary: &GenericDictionary,
) -> Vec<Computation> {
    let constants = constants(resolver, &rows.constant, dictionary);
    let mut looked: Vec<Looked<'_>> = Vec::new();
    for row in &rows.computed {
        let mut reader = RowReader { resolver, dictionary, constants: &constants, row };
        let Some(found) = reader.read() else { continue };
        if looked.iter().any(|other| other.parameter.parameter == found.parameter.parameter) {
            resolver.error(code::TWICE, row.parameter.span(), "parameter", "the parameter is computed twice");
            continue;
        }
        looked.push(found);
    }
    let mut found = Vec::new();
    for at in 0..looked.len() {
        let mut builder = Builder { looked: &looked, reads: Vec::new(), rows: Vec::new() };
        match builder.row(at, &mut Vec::new()) {
            Ok(_) => found.extend(builder.finish(resolver, &looked[at])),
            Err(way) => {
                // Told once, at the first of its rows.
                if way.iter().min() == Some(&at) {
                    let name = |at: &usize| looked[*at].parameter.name.as_str();
                    let way: Vec<&str> = way.iter().chain(way.first()).map(name).collect();
                    let message = format!("this one needs itself: {}", way.join(" by "));
                    let span = looked[at].row.parameter.span();
                    resolver.error(code::COMPUTED_CYCLE, span, "parameter", message);
                }
            }
        }
    }
    found.sort_by_key(|computation| computation.rows.last().map(|row| row.parameter));
    found
}

fn constants(
    resolver: &mut Resolver<'_>,
    rows: &[ConstantRow],
    dictionary: &GenericDictionary,
) -> Vec<Constant> {
    let mut constants: Vec<Constant> = Vec::new();
    for row in rows {
        let name = row.name.get_ref();
        super::generic::plain(resolver, &row.name);
        if dictionary.parameter(name).is_some() || constants.iter().any(|other| other.name == *name) {
            let message = "a parameter or a constant of this name is there already";
            resolver.error(code::TWICE, row.name.span(), "name", message);
        }
        let Some(quantity) = quantity(resolver, &row.quantity) else { continue };
        constants.push(Constant { name: name.clone(), quantity, value: *row.value.get_ref() });
    }
    constants
}

/// The ends of a limit, by their keys.
fn ends(row: &ComputedRow) -> [(&'static str, &[Name]); 3] {
    [("least", &row.least), ("most", &row.most), ("within", &row.within)]
}

struct RowReader<'r, 'f, 'g> {
    resolver: &'r mut Resolver<'f>,
    dictionary: &'g GenericDictionary,
    constants: &'g [Constant],
    row: &'g ComputedRow,
}

impl<'g> RowReader<'_, '_, 'g> {
    fn read(&mut self) -> Option<Looked<'g>> {
        let (dictionary, row) = (self.dictionary, self.row);
        let what =
            "a [[generic.parameter]] with a number from 0x8000, or one of the catalogue that is only read";
        // What a controller sets is kept somewhere: of the catalogue only what is read can be computed.
        let can_be = |parameter: &&GenericParameter| {
            parameter.parameter.is_of_vendor() || parameter.access == Access::Read
        };
        let find = |text: &str| dictionary.parameter(text).filter(can_be);
        let own = dictionary.parameters().iter().filter(can_be);
        let own = own.map(|parameter| parameter.name.as_str());
        let parameter = self.resolver.name("parameter", &row.parameter, what, find, own);
        let ways = self.ways(row);
        let factor = row.factor.as_ref().map_or(Some(Ratio::ONE), |row| self.resolver.ratio("factor", row));
        let rounding = row.rounding.as_ref();
        let rounding =
            rounding.map_or(Some(Rounding::Nearest), |name| self.resolver.word("rounding", name, &ROUNDINGS));
        let modes: Vec<_> = row.modes.iter().map(|name| operating_mode(self.resolver, name)).collect();
        let modes: Option<Vec<_>> = modes.into_iter().collect();
        self.marked();
        let (parameter, ways, modes) = (parameter?, ways?, modes?);
        let units = self.units(row, parameter, &ways);
        self.access(row, parameter);
        self.saturation(row, parameter);
        let factor = factor?.then(units?);
        if factor.is_none() {
            let message = "expected a factor that fits 64 bits together with the units";
            let span = row.factor.as_ref().map_or(row.parameter.span(), |factor| factor.span());
            self.resolver.error(code::OUT_OF_RANGE, span, "factor", message);
        }
        Some(Looked { row, parameter, ways, factor: factor?, rounding: rounding?, modes })
    }

    /// What `signals` and `zero_if_missing` name are operands.
    fn marked(&mut self) {
        let row = self.row;
        let is_operand =
            |name: &Name| row.operands().chain(&row.by).any(|operand| operand.get_ref() == name.get_ref());
        for (key, names) in [("signals", &row.signals), ("zero_if_missing", &row.zero_if_missing)] {
            for name in names.iter().filter(|name| !is_operand(name)) {
                self.contradiction(name, key, "expected one of the operands of the row");
            }
        }
        let both = |name: &&Name| row.signals.iter().any(|signal| signal.get_ref() == name.get_ref());
        for name in row.zero_if_missing.iter().filter(both) {
            self.contradiction(
                name,
                "zero_if_missing",
                "expected a parameter of the drive, this one is a signal",
            );
        }
    }

    fn contradiction(&mut self, name: &Name, key: &str, message: &str) {
        self.resolver.error(code::CONTRADICTION, name.span(), key, message);
    }

    /// The one operation of a row.
    fn ways(&mut self, row: &ComputedRow) -> Option<Ways<'g>> {
        let given = [
            !row.sum.is_empty(),
            !row.product.is_empty(),
            row.ratio.is_some(),
            !row.selection.is_empty(),
            row.limit.is_some(),
        ];
        if given.iter().filter(|given| **given).count() != 1 {
            let message = "expected one of sum, product, ratio, selection and limit";
            self.contradiction(&row.parameter, "parameter", message);
            return None;
        }
        self.strays(row);
        let holds =
            row.at_limit.as_ref().map_or(Some(true), |name| self.resolver.word("at_limit", name, &AT_LIMIT));
        self.operand_counts(row);
        if !row.sum.is_empty() {
            let plus = self.operands("sum", &row.sum);
            let less = self.operands("less", &row.less);
            return Some(Ways::Sum(plus?, less?));
        }
        if !row.product.is_empty() {
            return Some(Ways::Product(self.operands("product", &row.product)?));
        }
        if let Some([dividend, divisor]) = &row.ratio {
            let (dividend, divisor) = (self.operand("ratio", dividend), self.operand("ratio", divisor));
            return Some(Ways::Ratio([dividend?, divisor?]));
        }
        match &row.limit {
            Some(limited) => self.limit(row, limited, holds),
            None => self.selection(row),
        }
    }

    /// Keys that belong to another operation than that of the row.
    fn strays(&mut self, row: &ComputedRow) {
        if let Some(first) = row.less.first().filter(|_| row.sum.is_empty()) {
            self.contradiction(first, "less", "expected a `sum` from which this is taken away");
        }
        if let Some(by) = row.by.as_ref().filter(|_| row.selection.is_empty()) {
            self.contradiction(by, "by", "expected a `selection`");
        }
        for (key, names) in ends(row) {
            if let Some(first) = names.first().filter(|_| row.limit.is_none()) {
                self.contradiction(first, key, "expected a `limit`, which this is an end of");
            }
        }
    }

    fn operand_counts(&mut self, row: &ComputedRow) {
        let limits = [
            ("sum", row.sum.len() + row.less.len(), OPERANDS_MAX),
            ("product", row.product.len(), FACTORS_MAX),
            ("selection", row.selection.len(), OPERANDS_MAX),
            ("limit", row.least.len() + row.most.len() + row.within.len(), OPERANDS_MAX),
        ];
        for (key, count, limit) in limits.into_iter().filter(|(_, count, limit)| count > limit) {
            let message = format!("expected at most {limit} operands, got {count}");
            self.resolver.error(code::TOO_MANY, row.parameter.span(), key, message);
        }
    }

    /// A value between its ends; `holds` as [`AT_LIMIT`] has it.
    fn limit(&mut self, row: &ComputedRow, limited: &Name, holds: Option<bool>) -> Option<Ways<'g>> {
        let value = self.operand("limit", limited);
        let [least, most, within] = ends(row).map(|(key, names)| self.operands(key, names));
        if ends(row).iter().all(|(_, names)| names.is_empty()) {
            let message = "expected `least`, `most` or `within`, between which the value is";
            self.resolver.error(code::MISSING_KEY, limited.span(), "limit", message);
        }
        Some(Ways::Limit(value?, [least?, most?, within?], holds?))
    }

    fn selection(&mut self, row: &ComputedRow) -> Option<Ways<'g>> {
        let Some(by) = &row.by else {
            let message = "expected `by`, the parameter whose value selects";
            self.resolver.error(code::MISSING_KEY, row.parameter.span(), "by", message);
            return None;
        };
        let selector = self.operand("by", by);
        // 0 is 0 in every unit.
        let by_zero = row.selection.iter().all(|choice| *choice.is.get_ref() == 0);
        if let Some(selector) = selector.filter(|selector| selector.quantity() != Quantity::None && !by_zero)
        {
            let message = format!("expected a bare number to select by, got a {}", selector.quantity());
            self.resolver.error(code::UNIT, by.span(), "by", message);
        }
        let mut choices: Vec<(i64, Named<'g>)> = Vec::new();
        let mut all = true;
        for choice in &row.selection {
            let is = *choice.is.get_ref();
            if choices.iter().any(|(known, _)| *known == is) {
                let message = format!("{is} selects something already");
                self.resolver.error(code::TWICE, choice.is.span(), "is", message);
            }
            match self.operand("take", &choice.take) {
                Some(taken) => choices.push((is, taken)),
                None => all = false,
            }
        }
        Some(Ways::Selection(selector?, choices)).filter(|_| all)
    }

    fn operands(&mut self, key: &str, names: &[Name]) -> Option<Vec<Named<'g>>> {
        let found: Vec<_> = names.iter().map(|name| self.operand(key, name)).collect();
        found.into_iter().collect()
    }

    fn operand(&mut self, key: &str, name: &Name) -> Option<Named<'g>> {
        let (dictionary, constants, row) = (self.dictionary, self.constants, self.row);
        let is_in = |names: &[Name]| names.iter().any(|known| known.get_ref() == name.get_ref());
        if is_in(&row.signals) {
            let signal = signal(self.resolver, key, name)?;
            // An offset is what a controller adds; the parameter of that name is another thing.
            let parameter = dictionary.parameter(signal.name()).filter(|parameter| {
                parameter.kind == ParameterType::Integer
                    && parameter.quantity == signal.quantity()
                    && !Signal::OFFSETS.contains(&signal)
            });
            return Some(Named::Signal(signal, parameter.map(|parameter| parameter.parameter)));
        }
        let find = |text: &str| {
            let constant = constants.iter().find(|constant| constant.name == text);
            let constant = constant.map(|constant| Named::Constant(constant.quantity, constant.value));
            let parameter = dictionary.parameter(text);
            constant.or_else(|| parameter.map(|known| Named::Parameter(known, is_in(&row.zero_if_missing))))
        };
        let names = constants.iter().map(|constant| constant.name.as_str()).chain(dictionary.names());
        let found = self.resolver.name(key, name, "a parameter or a [[generic.constant]]", find, names)?;
        if let Named::Parameter(parameter, _) = found
            && parameter.kind != ParameterType::Integer
        {
            let message = format!("expected a whole number, {} is a {}", name.get_ref(), parameter.kind);
            self.resolver.error(code::WRONG_KIND, name.span(), key, message);
            return None;
        }
        Some(found)
    }

    /// What the units of the operands make of a result of 1, in the unit of the parameter.
    fn units(&mut self, row: &ComputedRow, parameter: &GenericParameter, ways: &Ways<'_>) -> Option<Ratio> {
        let wanted = parameter.quantity;
        let (over, under) = match ways {
            Ways::Sum(plus, less) => {
                let names = row.sum.iter().chain(&row.less);
                return self.same_unit(("sum", wanted), names.zip(plus.iter().chain(less)));
            }
            Ways::Selection(_, choices) => {
                let names = row.selection.iter().map(|choice| &choice.take);
                return self.same_unit(("take", wanted), names.zip(choices.iter().map(|(_, taken)| taken)));
            }
            Ways::Limit(value, ends, _) => {
                let names = row.limit.iter().chain(&row.least).chain(&row.most).chain(&row.within);
                let named = std::iter::once(value).chain(ends.iter().flatten());
                return self.same_unit(("limit", wanted), names.zip(named));
            }
            Ways::Product(factors) => (factors.as_slice(), &[][..]),
            Ways::Ratio([dividend, divisor]) => {
                (std::slice::from_ref(dividend), std::slice::from_ref(divisor))
            }
        };
        let (key, span) = match &row.ratio {
            Some([first, _]) => ("ratio", first.span()),
            None => ("product", row.product.first().map_or(row.parameter.span(), Name::span)),
        };
        let all = over.iter().chain(under).map(Named::quantity);
        if all.chain([wanted]).any(|quantity| quantity == Quantity::Temperature) {
            let message = "expected no temperature: degrees Celsius are counted from where water freezes";
            self.resolver.error(code::UNIT, span, key, message);
            return None;
        }
        let mut dimension = Dimension::default();
        for (named, sign) in over.iter().map(|named| (named, 1)).chain(under.iter().map(|named| (named, -1)))
        {
            dimension = dimension.with(Dimension::of(named.quantity()), sign);
        }
        let target = Dimension::of(wanted);
        if dimension.base != target.base {
            let message =
                format!("expected {}, which measures {wanted}, got {}", target.words(), dimension.words());
            let help = "a [[generic.constant]] can have a quantity; `factor` is a bare number";
            self.resolver.helped(code::UNIT, span, key, message, help);
            return None;
        }
        let decimals = dimension.decimals - target.decimals;
        let power = 10_i64.checked_pow(decimals.unsigned_abs());
        let ratio = power.and_then(|power| match decimals >= 0 {
            true => Ratio::new(power, 1),
            false => Ratio::new(1, power),
        });
        if ratio.is_none() {
            let message =
                format!("expected units that are less than 18 decimal places apart, got {decimals}");
            self.resolver.error(code::UNIT, span, key, message);
        }
        ratio
    }

    /// What is added or selected measures the same.
    fn same_unit<'n, 'o>(
        &mut self,
        (key, wanted): (&str, Quantity),
        operands: impl Iterator<Item = (&'n Name, &'o Named<'o>)>,
    ) -> Option<Ratio> {
        let mut same = Some(Ratio::ONE);
        for (name, named) in operands {
            if named.quantity() != wanted {
                let (name_of, got) = (name.get_ref(), named.quantity());
                let message = format!("expected {wanted}, as the result, got {name_of}, which is {got}");
                self.resolver.error(code::UNIT, name.span(), key, message);
                same = None;
            }
        }
        same
    }

    /// A parameter that can be set writes one operand; one that is read writes none.
    fn access(&mut self, row: &ComputedRow, parameter: &GenericParameter) {
        let name = &parameter.name;
        let Some(writes) = &row.writes else {
            if parameter.access != Access::Read {
                let message = format!(
                    "expected `writes`, the operand that is written when {name} is set, or `access = \"read\"`"
                );
                self.resolver.error(code::NOT_INVERTIBLE, row.parameter.span(), "parameter", message);
            }
            return;
        };
        if parameter.access == Access::Read {
            let message = format!("expected nothing that is written, as {name} is only read");
            return self.contradiction(writes, "writes", &message);
        }
        let is = |other: &&Name| other.get_ref() == writes.get_ref();
        let count = row.operands().filter(is).count();
        let selects = row.by.as_ref().is_some_and(|by| is(&by));
        let found = self.dictionary.parameter(writes.get_ref());
        let problem = match found {
            _ if count == 0 => Some((code::NOT_INVERTIBLE, "expected one of the operands".to_owned())),
            _ if selects => Some((
                code::NOT_INVERTIBLE,
                "expected an operand that does not select at the same time".to_owned(),
            )),
            _ if count > 1 && row.selection.is_empty() => Some((
                code::NOT_INVERTIBLE,
                format!(
                    "expected an operand that is there once, {} is there {count} times",
                    writes.get_ref()
                ),
            )),
            Some(operand) if !operand.parameter.is_of_vendor() => Some((
                code::NOT_INVERTIBLE,
                format!("expected a parameter of your own: {} is set by its own attribute", operand.name),
            )),
            Some(operand) => match (operand.access, parameter.access) {
                (Access::Read, _) => Some((
                    code::READ_ONLY,
                    format!("expected an operand that can be written, {} is only read", operand.name),
                )),
                (Access::WriteWhileDisabled, Access::Write) => Some((
                    code::READ_ONLY,
                    format!(
                        "{} is not to be written while the drive has torque: expected `access = \"write_while_disabled\"` of {name}",
                        operand.name
                    ),
                )),
                _ => None,
            },
            None => Some((code::NOT_INVERTIBLE, "expected a parameter, which a drive can take".to_owned())),
        };
        if let Some((code, message)) = problem {
            self.resolver.error(code, writes.span(), "writes", message);
        }
    }

    /// Where a value is held there is an end to hold it at, and a reason.
    fn saturation(&mut self, row: &ComputedRow, parameter: &GenericParameter) {
        let Some(reason) = &row.saturates else { return };
        if reason.get_ref().trim().is_empty() {
            let message = "expected the reason for which the value is held, got none";
            self.resolver.error(code::MISSING_KEY, reason.span(), "saturates", message);
        }
        if parameter.range.is_none() {
            let message =
                format!("expected a `range` of {}, at whose ends the value is held", parameter.name);
            self.resolver.error(code::CONTRADICTION, reason.span(), "saturates", message);
        }
    }
}

/// Joins rows to computations of parameters that drives have.
struct Builder<'a, 'g> {
    looked: &'a [Looked<'g>],
    reads: Vec<Read>,
    rows: Vec<(usize, Row)>,
}

impl Builder<'_, '_> {
    /// Adds a row and all that it needs; its place. The error is the way from a row back to itself.
    fn row(&mut self, at: usize, way: &mut Vec<usize>) -> Result<usize, Vec<usize>> {
        if let Some(known) = self.rows.iter().position(|(known, _)| *known == at) {
            return Ok(known);
        }
        if let Some(start) = way.iter().position(|known| *known == at) {
            return Err(way[start..].to_vec());
        }
        way.push(at);
        let looked = self.looked;
        let Looked { parameter, ways, factor, rounding, row, modes } = &looked[at];
        let operation = match ways {
            Ways::Sum(plus, less) => Operation::Sum(self.operands(plus, way)?, self.operands(less, way)?),
            Ways::Product(factors) => Operation::Product(self.operands(factors, way)?),
            Ways::Ratio([dividend, divisor]) => {
                Operation::Ratio(self.operand(dividend, way)?, self.operand(divisor, way)?)
            }
            Ways::Limit(value, [least, most, within], holds) => Operation::Limit(Limit {
                value: self.operand(value, way)?,
                least: self.operands(least, way)?,
                most: self.operands(most, way)?,
                within: self.operands(within, way)?,
                holds: *holds,
            }),
            Ways::Selection(by, choices) => {
                let by = self.operand(by, way)?;
                let mut taken = Vec::with_capacity(choices.len());
                for (is, choice) in choices {
                    taken.push((*is, self.operand(choice, way)?));
                }
                Operation::Selection(by, taken)
            }
        };
        way.pop();
        let row = Row {
            parameter: parameter.parameter,
            operation,
            factor: *factor,
            rounding: *rounding,
            range: parameter.range,
            saturates: row.saturates.is_some(),
            modes: modes.clone(),
        };
        self.rows.push((at, row));
        Ok(self.rows.len() - 1)
    }

    fn operands(&mut self, named: &[Named<'_>], way: &mut Vec<usize>) -> Result<Vec<Operand>, Vec<usize>> {
        named.iter().map(|named| self.operand(named, way)).collect()
    }

    fn operand(&mut self, named: &Named<'_>, way: &mut Vec<usize>) -> Result<Operand, Vec<usize>> {
        let (parameter, is_zero_if_missing) = match named {
            Named::Constant(_, value) => return Ok(Operand::Constant(*value)),
            Named::Signal(signal, parameter) => {
                let (signal, parameter) = (Some(*signal), *parameter);
                return Ok(Operand::Read(self.read(Read {
                    signal,
                    parameter,
                    is_zero_if_missing: false,
                    range: None,
                })));
            }
            Named::Parameter(parameter, is_zero_if_missing) => (*parameter, *is_zero_if_missing),
        };
        let number = parameter.parameter;
        let turns = Some(MOTOR_TURNS).filter(|_| number == Parameter::MOTOR_TURNS_PER_UNIT);
        let range = parameter.range.or(turns);
        let read = Read { signal: None, parameter: Some(number), is_zero_if_missing, range };
        let is = |other: &Looked<'_>| other.parameter.parameter == number;
        if let Some(at) = self.looked.iter().position(is) {
            let row = self.row(at, way)?;
            // No drive has a vendor's parameter that is computed; one of the catalogue is computed for drives without it.
            return Ok(if number.is_of_vendor() {
                Operand::Row(row)
            } else {
                Operand::ReadOrRow(self.read(read), row)
            });
        }
        Ok(Operand::Read(self.read(read)))
    }

    /// The place of something that is not computed.
    fn read(&mut self, read: Read) -> usize {
        let known = self.reads.iter().position(|known| *known == read);
        known.unwrap_or_else(|| {
            self.reads.push(read);
            self.reads.len() - 1
        })
    }

    /// The computation of the row that was added last.
    fn finish(self, resolver: &mut Resolver<'_>, looked: &Looked<'_>) -> Option<Computation> {
        let (reads, rows) = (self.reads, self.rows);
        let limits =
            [("parameters and signals", reads.len(), READS_MAX), ("computed values", rows.len(), ROWS_MAX)];
        for (what, count, limit) in limits {
            if count > limit {
                let message = format!("expected at most {limit} {what} behind one value, got {count}");
                resolver.error(code::TOO_MANY, looked.row.parameter.span(), "parameter", message);
                return None;
            }
        }
        let writes = looked.row.writes.as_ref();
        let written = writes.and_then(|name| {
            let is = |read: &Read| self_is(looked, name, read);
            reads.iter().position(is)
        });
        if let Some(name) = writes.filter(|_| written.is_none() && !resolver.has_errors()) {
            let message =
                format!("expected a parameter that drives have, {} is computed itself", name.get_ref());
            resolver.error(code::NOT_INVERTIBLE, name.span(), "writes", message);
        }
        Some(Computation { reads, rows: rows.into_iter().map(|(_, row)| row).collect(), written })
    }
}

/// Whether a read is that of the operand with this name.
fn self_is(looked: &Looked<'_>, name: &Name, read: &Read) -> bool {
    let named: Vec<&Named<'_>> = match &looked.ways {
        Ways::Sum(plus, less) => plus.iter().chain(less).collect(),
        Ways::Product(factors) => factors.iter().collect(),
        Ways::Ratio(both) => both.iter().collect(),
        Ways::Selection(_, choices) => choices.iter().map(|(_, taken)| taken).collect(),
        // Nothing is written for a limit.
        Ways::Limit(..) => Vec::new(),
    };
    named.into_iter().any(|named| match named {
        Named::Parameter(parameter, _) => {
            parameter.name == *name.get_ref() && Some(parameter.parameter) == read.parameter
        }
        Named::Constant(..) | Named::Signal(..) => false,
    })
}

/// What a quantity is made of, and how many decimal places its unit is below that. Turns and millimetres are no radians and
/// metres: a power is not a torque times a velocity here. A newton metre is a volt ampere second.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Dimension {
    /// Powers of the base units, in the order of [`BASE`].
    base: [i8; BASE.len()],
    /// The power of ten of the unit.
    decimals: i32,
}

/// What everything is made of.
const BASE: [&str; 5] = ["axis units", "s", "V", "A", "kgm2"];

impl Dimension {
    /// Of a quantity; that of a temperature, which nothing is multiplied with, is of no use.
    // Flat: a table.
    const fn of(quantity: Quantity) -> Self {
        let (base, decimals) = match quantity {
            Quantity::None | Quantity::Temperature => ([0, 0, 0, 0, 0], 0),
            Quantity::Torque | Quantity::Fraction => ([0, 0, 0, 0, 0], -6),
            Quantity::Position => ([1, 0, 0, 0, 0], -9),
            Quantity::Velocity => ([1, -1, 0, 0, 0], -9),
            Quantity::Acceleration => ([1, -2, 0, 0, 0], -9),
            Quantity::Jerk => ([1, -3, 0, 0, 0], -9),
            Quantity::TorqueAbsolute => ([0, 1, 1, 1, 0], -6),
            Quantity::Current => ([0, 0, 0, 1, 0], -6),
            Quantity::Voltage => ([0, 0, 1, 0, 0], -6),
            Quantity::Power => ([0, 0, 1, 1, 0], -3),
            Quantity::Time => ([0, 1, 0, 0, 0], -9),
            Quantity::Frequency => ([0, -1, 0, 0, 0], -3),
            Quantity::Inertia => ([0, 0, 0, 0, 1], -9),
            Quantity::Resistance => ([0, 0, 1, -1, 0], -6),
            Quantity::Inductance => ([0, 1, 1, -1, 0], -9),
            Quantity::Gain => ([0, -1, 0, 0, 0], -6),
        };
        Self { base, decimals }
    }

    /// Multiplied with another one, or divided by it.
    fn with(mut self, other: Self, sign: i8) -> Self {
        for (power, more) in self.base.iter_mut().zip(other.base) {
            *power += more * sign;
        }
        self.decimals += other.decimals * i32::from(sign);
        self
    }

    /// In words, such as `V A`.
    fn words(&self) -> String {
        let powers = BASE.iter().zip(self.base).filter(|(_, power)| *power != 0);
        let units: Vec<String> = powers
            .map(|(unit, power)| if power == 1 { (*unit).to_owned() } else { format!("{unit}^{power}") })
            .collect();
        if units.is_empty() { "a bare number".to_owned() } else { units.join(" ") }
    }
}
