//! `[modbus]`.

use super::{Problems, hosts, value};
use crate::config::file::{AxisTable, ModbusTable};
use crate::config::{Modbus, ModbusParameter};
use crate::finding::Spanned;
use crate::modbus::map::{Kind, MAP_LEN};

/// How a value can lie in registers.
pub(in crate::config) const REGISTER_KINDS: [(&str, Kind); 4] =
    [("u16", Kind::U16), ("i32", Kind::I32), ("u32", Kind::U32), ("i64", Kind::I64)];

/// The most parameters.
const PARAMETERS_MAX: usize = 256;

/// Where the longest value can begin at most.
const REGISTER_MAX: i64 = 65_532;

pub(super) fn check(
    problems: &mut Problems,
    table: &ModbusTable,
    axes: &[Spanned<AxisTable>],
) -> Option<Modbus> {
    let listen = value::socket_address(problems, &table.listen);
    let clients = hosts::check(problems, table.clients.as_ref(), "clients", false);
    let clients_max =
        value::number_or(problems, &table.clients_max, "the number of Modbus clients", 1..=64, 8);
    problems.count(&table.parameter, "parameters", PARAMETERS_MAX);
    let parameters = parameters(problems, table, axes);
    Some(Modbus { listen: listen?, clients: clients?, clients_max: clients_max?, parameters: parameters? })
}

fn parameters(
    problems: &mut Problems,
    table: &ModbusTable,
    axes: &[Spanned<AxisTable>],
) -> Option<Vec<ModbusParameter>> {
    let names = || axes.iter().map(|axis| axis.get_ref().name.get_ref());
    let mut found: Vec<Option<ModbusParameter>> = Vec::new();
    for (place, row) in table.parameter.iter().map(Spanned::get_ref).enumerate() {
        let register =
            value::number(problems, &row.register, "the register", i64::from(MAP_LEN)..=REGISTER_MAX);
        let kind = value::word_or(problems, row.kind.as_ref(), "type", &REGISTER_KINDS, Kind::I32);
        let axis = names().position(|name| name == row.axis.get_ref());
        if axis.is_none() {
            problems.unknown("axis", &row.axis, names());
        }
        let (Some(register), Some(kind), Some(axis)) = (register, kind, axis) else {
            found.push(None);
            continue;
        };
        let (parameter, write) = (row.parameter.get_ref().clone(), row.write);
        let new = ModbusParameter { register, kind, axis, parameter, write };
        let meets = |known: &Option<ModbusParameter>| {
            known.as_ref().is_some_and(|known| {
                known.register < new.register + new.kind.registers()
                    && new.register < known.register + known.kind.registers()
            })
        };
        if let Some(at) = found[..place].iter().position(meets) {
            let first = table.parameter[at].get_ref().register.span();
            problems.duplicate(&format!("the register {register}"), first, row.register.span());
        }
        found.push(Some(new));
    }
    found.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    fn without_axes(problems: &mut Problems, table: &ModbusTable) -> Option<Modbus> {
        check(problems, table, &[])
    }

    #[test]
    fn eight_clients_are_served_unless_told_otherwise() {
        let found = checked("listen = \"127.0.0.1:502\"", without_axes).unwrap();
        assert_eq!((found.listen.port(), found.clients_max), (502, 8));
        let both =
            ["`x` is not an address with a port", "the number of Modbus clients is 65"].map(str::to_owned);
        assert_eq!(checked("listen = \"x\"\nclients_max = 65", without_axes), Err(both.to_vec()));
    }

    #[test]
    fn parameters_have_registers_of_their_own_behind_the_map() {
        let table = "listen = \"127.0.0.1:502\"\n\n[[parameter]]\nregister = 4159\naxis = \"x\"\nparameter = \"a\"\ntype = \"f32\"\n";
        let wrong = ["the register is 4159", "unknown type `f32`", "there is no axis `x`"];
        assert_eq!(checked(table, without_axes), Err(wrong.map(str::to_owned).to_vec()));
    }
}
