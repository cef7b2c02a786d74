//! Error codes of the service channel: the info's low word when S-SVC has its error bit set.

use profile_generic::open_code;

open_code! {
    /// An error code of the service channel. Codes without a name are kept.
    pub struct SvcError(u16) {
        /// Service channel not open.
        NOT_OPEN = 0x0001 => "service channel not open",
        /// Invalid access to closing the service channel.
        CLOSE_ACCESS = 0x0009 => "invalid access to closing the service channel",
        /// IDN not available.
        NO_IDN = 0x1001 => "IDN not available",
        /// Invalid access to element 1.
        IDN_ACCESS = 0x1009 => "invalid access to element 1",
        /// Name not available.
        NO_NAME = 0x2001 => "name not available",
        /// Name transmission too short.
        NAME_SHORT = 0x2002 => "name transmission too short",
        /// Name transmission too long.
        NAME_LONG = 0x2003 => "name transmission too long",
        /// Name cannot be changed.
        NAME_READ_ONLY = 0x2004 => "name cannot be changed",
        /// Name is write protected at this time.
        NAME_PROTECTED = 0x2005 => "name is write protected at this time",
        /// Attribute transmission too short.
        ATTRIBUTE_SHORT = 0x3002 => "attribute transmission too short",
        /// Attribute transmission too long.
        ATTRIBUTE_LONG = 0x3003 => "attribute transmission too long",
        /// Attribute cannot be changed.
        ATTRIBUTE_READ_ONLY = 0x3004 => "attribute cannot be changed",
        /// Attribute is write protected at this time.
        ATTRIBUTE_PROTECTED = 0x3005 => "attribute is write protected at this time",
        /// Unit not available.
        NO_UNIT = 0x4001 => "unit not available",
        /// Unit transmission too short.
        UNIT_SHORT = 0x4002 => "unit transmission too short",
        /// Unit transmission too long.
        UNIT_LONG = 0x4003 => "unit transmission too long",
        /// Unit cannot be changed.
        UNIT_READ_ONLY = 0x4004 => "unit cannot be changed",
        /// Unit is write protected at this time.
        UNIT_PROTECTED = 0x4005 => "unit is write protected at this time",
        /// Minimum value not available.
        NO_MINIMUM = 0x5001 => "minimum value not available",
        /// Minimum value transmission too short.
        MINIMUM_SHORT = 0x5002 => "minimum value transmission too short",
        /// Minimum value transmission too long.
        MINIMUM_LONG = 0x5003 => "minimum value transmission too long",
        /// Minimum value cannot be changed.
        MINIMUM_READ_ONLY = 0x5004 => "minimum value cannot be changed",
        /// Minimum value is write protected at this time.
        MINIMUM_PROTECTED = 0x5005 => "minimum value is write protected at this time",
        /// Maximum value not available.
        NO_MAXIMUM = 0x6001 => "maximum value not available",
        /// Maximum value transmission too short.
        MAXIMUM_SHORT = 0x6002 => "maximum value transmission too short",
        /// Maximum value transmission too long.
        MAXIMUM_LONG = 0x6003 => "maximum value transmission too long",
        /// Maximum value cannot be changed.
        MAXIMUM_READ_ONLY = 0x6004 => "maximum value cannot be changed",
        /// Maximum value is write protected at this time.
        MAXIMUM_PROTECTED = 0x6005 => "maximum value is write protected at this time",
        /// Operation data transmission too short.
        DATA_SHORT = 0x7002 => "operation data transmission too short",
        /// Operation data transmission too long.
        DATA_LONG = 0x7003 => "operation data transmission too long",
        /// Operation data cannot be changed.
        DATA_READ_ONLY = 0x7004 => "operation data cannot be changed",
        /// Operation data is write protected at this time.
        DATA_PROTECTED = 0x7005 => "operation data is write protected at this time",
        /// Operation data is below the minimum.
        BELOW_MINIMUM = 0x7006 => "operation data is below the minimum",
        /// Operation data is above the maximum.
        ABOVE_MAXIMUM = 0x7007 => "operation data is above the maximum",
        /// Operation data is invalid.
        INVALID_DATA = 0x7008 => "operation data is invalid",
        /// Operation data is protected by a password.
        PASSWORD = 0x7009 => "operation data is protected by a password",
        /// Operation data is configured cyclically.
        CYCLIC = 0x700A => "operation data is configured cyclically",
        /// Invalid indirect addressing.
        INDIRECT = 0x700B => "invalid indirect addressing",
        /// Operation data is protected by other settings.
        OTHER_SETTINGS = 0x700C => "operation data is protected by other settings",
        /// Invalid floating point number.
        FLOAT = 0x700D => "invalid floating point number",
        /// Operation data is protected at parameterization level.
        PARAMETERIZATION_LEVEL = 0x700E => "operation data is protected at parameterization level",
        /// Operation data is protected at operating level.
        OPERATING_LEVEL = 0x700F => "operation data is protected at operating level",
        /// Procedure command already active.
        COMMAND_ACTIVE = 0x7010 => "procedure command already active",
        /// Procedure command cannot be interrupted.
        NOT_INTERRUPTIBLE = 0x7011 => "procedure command cannot be interrupted",
        /// Procedure command cannot be executed at this time.
        NOT_EXECUTABLE = 0x7012 => "procedure command cannot be executed at this time",
        /// Procedure command cannot be executed with these parameters.
        BAD_PARAMETERS = 0x7013 => "procedure command cannot be executed with these parameters",
        /// List segment: S-0-0394 is not valid.
        LIST_IDN = 0x7101 => "list segment: S-0-0394 is not valid",
        /// List segment: empty list is not permitted.
        LIST_EMPTY = 0x7102 => "list segment: empty list is not permitted",
        /// List segment: maximum length would be exceeded.
        LIST_LENGTH = 0x7103 => "list segment: maximum length would be exceeded",
        /// List segment: the list cannot be written.
        LIST_READ_ONLY = 0x7104 => "list segment: the list cannot be written",
        /// List segment: index or count is not valid.
        LIST_INDEX = 0x7105 => "list segment: index or count is not valid",
        /// List segment: no access through S-0-0397.
        LIST_ACCESS = 0x7106 => "list segment: no access through S-0-0397",
    }
}

impl SvcError {
    /// The error `x001`..`x005` of an element: `base` is one of the low digits 1..=5.
    #[must_use]
    pub const fn of_element(element: super::svc::Element, base: u8) -> SvcError {
        SvcError((element.number() as u16) << 12 | (base & 0xF) as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::super::svc::Element;
    use super::*;

    #[test]
    fn names() {
        assert_eq!(SvcError(0x7007).to_string(), "operation data is above the maximum");
        assert_eq!(SvcError(0x8000).to_string(), "0x8000");
        assert_eq!(SvcError::of_element(Element::Data, 4), SvcError::DATA_READ_ONLY);
        assert_eq!(SvcError::of_element(Element::Name, 1), SvcError::NO_NAME);
        assert_eq!(SvcError::of_element(Element::Idn, 1), SvcError::NO_IDN);
    }

    #[test]
    fn codes_ascend_and_unused_ones_have_no_name() {
        assert!(SvcError::NAMED.windows(2).all(|pair| pair[0].0 < pair[1].0));
        // Attribute and operation data always exist: 3001 and 7001 are not used.
        assert_eq!((SvcError(0x3001).name(), SvcError(0x7001).name()), (None, None));
    }
}
