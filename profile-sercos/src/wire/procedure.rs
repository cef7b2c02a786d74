//! Procedure commands: the control word written to element 7.
//!
//! Bit 0 sets the command, bit 1 starts it. 0x3 sets and starts, 0x1 interrupts a running command, 0x0 cancels.
//! The answer is the data status ([`super::data_status::DataStatus`]).

use crate::generated::bits::procedure_control;
use bitflags::bitflags;

bitflags! {
    /// Procedure command control word. Reserved bits are kept.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
    pub struct ProcedureControl: u16 {
        /// Set the command; 0 cancels it.
        const SET = procedure_control::SET;
        /// Start it; 0 interrupts it.
        const START = procedure_control::START;
        /// Reserved bits, transmitted as 0.
        const RESERVED = procedure_control::RESERVED;
    }
}

impl ProcedureControl {
    /// 0x3: set and start.
    pub const EXECUTE: ProcedureControl = ProcedureControl::SET.union(ProcedureControl::START);
    /// 0x1: interrupt.
    pub const INTERRUPT: ProcedureControl = ProcedureControl::SET;
    /// 0x0: cancel.
    pub const CANCEL: ProcedureControl = ProcedureControl::empty();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words() {
        // Startup recording, frames 1609 (set and start) and 1681 (cancel).
        assert_eq!(ProcedureControl::EXECUTE.bits(), 3);
        assert_eq!(ProcedureControl::CANCEL.bits(), 0);
        assert_eq!(ProcedureControl::INTERRUPT.bits(), 1);
        assert_eq!(ProcedureControl::from_bits_retain(0xFFFF).bits(), 0xFFFF);
    }
}
