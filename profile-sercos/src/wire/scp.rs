//! SERCOS communication profile (SCP) classes: the words of S-0-1000 and S-0-1000.0.1.
//!
//! High byte the class, low byte its version.

use core::fmt;

use profile_generic::open_code;

open_code! {
    /// An SCP class number. Numbers without a name are kept.
    pub struct ScpClass(u8) {
        /// Fixed configuration of connections.
        FIX_CFG = 0x01 => "SCP_FixCFG",
        /// Variable configuration of connections.
        VAR_CFG = 0x02 => "SCP_VarCFG",
        /// Synchronization.
        SYNC = 0x03 => "SCP_Sync",
        /// Connection watchdog.
        WATCHDOG = 0x04 => "SCP_WD",
        /// Diagnosis counters.
        DIAGNOSIS = 0x05 => "SCP_Diag",
        /// Real-time bits.
        REAL_TIME_BITS = 0x06 => "SCP_RTB",
        /// Hot-plug.
        HOT_PLUG = 0x07 => "SCP_HP",
        /// Messaging protocol.
        MESSAGING = 0x08 => "SCP_SMP",
        /// Multiplexing.
        MULTIPLEX = 0x09 => "SCP_Mux",
        /// Unified communication channel.
        NRT = 0x0A => "SCP_NRT",
        /// Signal words.
        SIGNAL = 0x0B => "SCP_Sig",
        /// List segments.
        LIST_SEGMENT = 0x0C => "SCP_ListSeg",
        /// S/IP server.
        SIP = 0x0D => "SCP_SIP",
        /// TFTP server.
        TFTP = 0x0E => "SCP_TFTP",
        /// Capability lists.
        CAPABILITY = 0x0F => "SCP_Cap",
        /// Extended multiplexing.
        EXTENDED_MULTIPLEX = 0x10 => "SCP_ExtMux",
        /// System time.
        SYSTEM_TIME = 0x13 => "SCP_SysTime",
        /// Unified communication channel without communication cycle.
        NRT_PC = 0x18 => "SCP_NRTPC",
        /// Cyclic communication.
        CYCLIC = 0x19 => "SCP_Cyc",
        /// Watchdog per connection.
        WATCHDOG_CONNECTION = 0x1A => "SCP_WDCon",
        /// Control by a software master.
        SOFTWARE_CONTROL = 0x1B => "SCP_SWC",
    }
}

/// One entry of the class list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ScpEntry {
    /// The class.
    pub class: ScpClass,
    /// Its version, counted from 1.
    pub version: u8,
}

impl ScpEntry {
    /// The entry in a list word.
    #[must_use]
    pub const fn from_word(word: u16) -> ScpEntry {
        let [version, class] = word.to_le_bytes();
        ScpEntry { class: ScpClass(class), version }
    }

    /// The list word of the entry.
    #[must_use]
    pub const fn to_word(self) -> u16 {
        u16::from_le_bytes([self.version, self.class.0])
    }
}

impl fmt::Display for ScpEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} V{}", self.class, self.version)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_recording() {
        // Startup recording, frames 2335 and 2359: 0x0201, 0x0301, 0x0A01.
        let texts = [0x0201, 0x0301, 0x0A01, 0x3002].map(|word| ScpEntry::from_word(word).to_string());
        assert_eq!(texts, ["SCP_VarCFG V1", "SCP_Sync V1", "SCP_NRT V1", "0x30 V2"]);
        for word in 0..=u16::MAX {
            assert_eq!(ScpEntry::from_word(word).to_word(), word);
        }
    }
}
