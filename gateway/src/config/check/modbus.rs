//! `[modbus]`.

use super::{Problems, value};
use crate::config::Modbus;
use crate::config::file::ModbusTable;

pub(super) fn check(problems: &mut Problems, table: &ModbusTable) -> Option<Modbus> {
    let listen = value::socket_address(problems, &table.listen);
    let clients_max =
        value::number_or(problems, &table.clients_max, "the number of Modbus clients", 1..=64, 8);
    Some(Modbus { listen: listen?, clients_max: clients_max? })
}

#[cfg(test)]
mod tests {
    use super::super::checked;
    use super::*;

    #[test]
    fn eight_clients_are_served_unless_told_otherwise() {
        let found = checked("listen = \"127.0.0.1:502\"", check).unwrap();
        assert_eq!((found.listen.port(), found.clients_max), (502, 8));
        let both =
            ["`x` is not an address with a port", "the number of Modbus clients is 65"].map(str::to_owned);
        assert_eq!(checked("listen = \"x\"\nclients_max = 65", check), Err(both.to_vec()));
    }
}
