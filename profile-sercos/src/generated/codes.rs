//! Codes of SERCOS.
//!
//! Generated from `mappings/tables/dictionary/sercos-codes.toml`: change the table, not this file, and run
//! `cargo run -p mappings --example generate`.

use profile_generic::open_code;

open_code! {
    /// An error code of the service channel. Codes without a name are kept.
    pub struct SvcError(u16) {
        /// service channel not open.
        NOT_OPEN = 0x0001 => "service channel not open",
        /// invalid access to closing the service channel.
        CLOSE_ACCESS = 0x0009 => "invalid access to closing the service channel",
        /// IDN not available.
        NO_IDN = 0x1001 => "IDN not available",
        /// invalid access to element 1.
        IDN_ACCESS = 0x1009 => "invalid access to element 1",
        /// name not available.
        NO_NAME = 0x2001 => "name not available",
        /// name transmission too short.
        NAME_SHORT = 0x2002 => "name transmission too short",
        /// name transmission too long.
        NAME_TRANSMISSION_TOO_LONG = 0x2003 => "name transmission too long",
        /// name cannot be changed.
        NAME_READ_ONLY = 0x2004 => "name cannot be changed",
        /// name is write protected at this time.
        NAME_IS_WRITE_PROTECTED_AT_THIS_TIME = 0x2005 => "name is write protected at this time",
        /// attribute transmission too short.
        ATTRIBUTE_TRANSMISSION_TOO_SHORT = 0x3002 => "attribute transmission too short",
        /// attribute transmission too long.
        ATTRIBUTE_TRANSMISSION_TOO_LONG = 0x3003 => "attribute transmission too long",
        /// attribute cannot be changed.
        ATTRIBUTE_READ_ONLY = 0x3004 => "attribute cannot be changed",
        /// attribute is write protected at this time.
        ATTRIBUTE_IS_WRITE_PROTECTED_AT_THIS_TIME = 0x3005 => "attribute is write protected at this time",
        /// unit not available.
        NO_UNIT = 0x4001 => "unit not available",
        /// unit transmission too short.
        UNIT_TRANSMISSION_TOO_SHORT = 0x4002 => "unit transmission too short",
        /// unit transmission too long.
        UNIT_TRANSMISSION_TOO_LONG = 0x4003 => "unit transmission too long",
        /// unit cannot be changed.
        UNIT_CANNOT_BE_CHANGED = 0x4004 => "unit cannot be changed",
        /// unit is write protected at this time.
        UNIT_IS_WRITE_PROTECTED_AT_THIS_TIME = 0x4005 => "unit is write protected at this time",
        /// minimum value not available.
        NO_MINIMUM = 0x5001 => "minimum value not available",
        /// minimum value transmission too short.
        MINIMUM_VALUE_TRANSMISSION_TOO_SHORT = 0x5002 => "minimum value transmission too short",
        /// minimum value transmission too long.
        MINIMUM_VALUE_TRANSMISSION_TOO_LONG = 0x5003 => "minimum value transmission too long",
        /// minimum value cannot be changed.
        MINIMUM_VALUE_CANNOT_BE_CHANGED = 0x5004 => "minimum value cannot be changed",
        /// minimum value is write protected at this time.
        MINIMUM_VALUE_IS_WRITE_PROTECTED_AT_THIS_TIME = 0x5005 => "minimum value is write protected at this time",
        /// maximum value not available.
        NO_MAXIMUM = 0x6001 => "maximum value not available",
        /// maximum value transmission too short.
        MAXIMUM_VALUE_TRANSMISSION_TOO_SHORT = 0x6002 => "maximum value transmission too short",
        /// maximum value transmission too long.
        MAXIMUM_VALUE_TRANSMISSION_TOO_LONG = 0x6003 => "maximum value transmission too long",
        /// maximum value cannot be changed.
        MAXIMUM_READ_ONLY = 0x6004 => "maximum value cannot be changed",
        /// maximum value is write protected at this time.
        MAXIMUM_VALUE_IS_WRITE_PROTECTED_AT_THIS_TIME = 0x6005 => "maximum value is write protected at this time",
        /// operation data transmission too short.
        DATA_SHORT = 0x7002 => "operation data transmission too short",
        /// operation data transmission too long.
        DATA_LONG = 0x7003 => "operation data transmission too long",
        /// operation data cannot be changed.
        DATA_READ_ONLY = 0x7004 => "operation data cannot be changed",
        /// operation data is write protected at this time.
        DATA_PROTECTED = 0x7005 => "operation data is write protected at this time",
        /// operation data is below the minimum.
        BELOW_MINIMUM = 0x7006 => "operation data is below the minimum",
        /// operation data is above the maximum.
        ABOVE_MAXIMUM = 0x7007 => "operation data is above the maximum",
        /// operation data is invalid.
        INVALID_DATA = 0x7008 => "operation data is invalid",
        /// operation data is protected by a password.
        OPERATION_DATA_IS_PROTECTED_BY_A_PASSWORD = 0x7009 => "operation data is protected by a password",
        /// operation data is configured cyclically.
        CYCLIC = 0x700A => "operation data is configured cyclically",
        /// invalid indirect addressing.
        INVALID_INDIRECT_ADDRESSING = 0x700B => "invalid indirect addressing",
        /// operation data is protected by other settings.
        OTHER_SETTINGS = 0x700C => "operation data is protected by other settings",
        /// invalid floating point number.
        INVALID_FLOATING_POINT_NUMBER = 0x700D => "invalid floating point number",
        /// operation data is protected at parameterization level.
        OPERATION_DATA_IS_PROTECTED_AT_PARAMETERIZATION_LEVEL = 0x700E => "operation data is protected at parameterization level",
        /// operation data is protected at operating level.
        OPERATION_DATA_IS_PROTECTED_AT_OPERATING_LEVEL = 0x700F => "operation data is protected at operating level",
        /// procedure command already active.
        PROCEDURE_COMMAND_ALREADY_ACTIVE = 0x7010 => "procedure command already active",
        /// procedure command cannot be interrupted.
        PROCEDURE_COMMAND_CANNOT_BE_INTERRUPTED = 0x7011 => "procedure command cannot be interrupted",
        /// procedure command cannot be executed at this time.
        NOT_EXECUTABLE = 0x7012 => "procedure command cannot be executed at this time",
        /// procedure command cannot be executed with these parameters.
        PROCEDURE_COMMAND_CANNOT_BE_EXECUTED_WITH_THESE_PARAMETERS = 0x7013 => "procedure command cannot be executed with these parameters",
        /// list segment: S-0-0394 is not valid.
        LIST_SEGMENT_S_0_0394_IS_NOT_VALID = 0x7101 => "list segment: S-0-0394 is not valid",
        /// list segment: empty list is not permitted.
        LIST_SEGMENT_EMPTY_LIST_IS_NOT_PERMITTED = 0x7102 => "list segment: empty list is not permitted",
        /// list segment: maximum length would be exceeded.
        LIST_SEGMENT_MAXIMUM_LENGTH_WOULD_BE_EXCEEDED = 0x7103 => "list segment: maximum length would be exceeded",
        /// list segment: the list cannot be written.
        LIST_SEGMENT_THE_LIST_CANNOT_BE_WRITTEN = 0x7104 => "list segment: the list cannot be written",
        /// list segment: index or count is not valid.
        LIST_SEGMENT_INDEX_OR_COUNT_IS_NOT_VALID = 0x7105 => "list segment: index or count is not valid",
        /// list segment: no access through S-0-0397.
        LIST_SEGMENT_NO_ACCESS_THROUGH_S_0_0397 = 0x7106 => "list segment: no access through S-0-0397",
    }
}

open_code! {
    /// An SCP class number. Numbers without a name are kept.
    pub struct ScpClass(u8) {
        /// SCP_FixCFG.
        FIX_CFG = 0x01 => "SCP_FixCFG",
        /// SCP_VarCFG.
        VAR_CFG = 0x02 => "SCP_VarCFG",
        /// SCP_Sync.
        SYNC = 0x03 => "SCP_Sync",
        /// SCP_WD.
        WATCHDOG = 0x04 => "SCP_WD",
        /// SCP_Diag.
        DIAGNOSIS = 0x05 => "SCP_Diag",
        /// SCP_RTB.
        SCP_RTB = 0x06 => "SCP_RTB",
        /// SCP_HP.
        HOT_PLUG = 0x07 => "SCP_HP",
        /// SCP_SMP.
        SCP_SMP = 0x08 => "SCP_SMP",
        /// SCP_Mux.
        SCP_MUX = 0x09 => "SCP_Mux",
        /// SCP_NRT.
        NRT = 0x0A => "SCP_NRT",
        /// SCP_Sig.
        SCP_SIG = 0x0B => "SCP_Sig",
        /// SCP_ListSeg.
        SCP_LISTSEG = 0x0C => "SCP_ListSeg",
        /// SCP_SIP.
        SCP_SIP = 0x0D => "SCP_SIP",
        /// SCP_TFTP.
        SCP_TFTP = 0x0E => "SCP_TFTP",
        /// SCP_Cap.
        SCP_CAP = 0x0F => "SCP_Cap",
        /// SCP_ExtMux.
        SCP_EXTMUX = 0x10 => "SCP_ExtMux",
        /// SCP_SysTime.
        SCP_SYSTIME = 0x13 => "SCP_SysTime",
        /// SCP_NRTPC.
        SCP_NRTPC = 0x18 => "SCP_NRTPC",
        /// SCP_Cyc.
        CYCLIC = 0x19 => "SCP_Cyc",
        /// SCP_WDCon.
        WATCHDOG_CONNECTION = 0x1A => "SCP_WDCon",
        /// SCP_SWC.
        SOFTWARE_CONTROL = 0x1B => "SCP_SWC",
    }
}
