//! Status codes of explicit replies.

use profile_generic::open_code;

open_code! {
    /// General status of an explicit reply.
    pub struct GeneralStatus(u8) {
        /// Done.
        SUCCESS = 0x00 => "success",
        /// A connection related service failed; the extended status says why.
        CONNECTION_FAILURE = 0x01 => "connection failure",
        /// The object lacks what it needs to do this now.
        RESOURCE_UNAVAILABLE = 0x02 => "resource unavailable",
        /// A parameter has a value it cannot have.
        INVALID_PARAMETER_VALUE = 0x03 => "invalid parameter value",
        /// The path has a segment that is malformed or has no meaning here.
        PATH_SEGMENT_ERROR = 0x04 => "path segment error",
        /// The path leads to a class, instance or element that is not there.
        PATH_DESTINATION_UNKNOWN = 0x05 => "path destination unknown",
        /// Only a part of the data was transferred.
        PARTIAL_TRANSFER = 0x06 => "partial transfer",
        /// The messaging connection was lost.
        CONNECTION_LOST = 0x07 => "connection lost",
        /// The object does not have this service.
        SERVICE_NOT_SUPPORTED = 0x08 => "service not supported",
        /// The value of an attribute is not valid; for a Forward_Open an error in its data segment.
        INVALID_ATTRIBUTE_VALUE = 0x09 => "invalid attribute value",
        /// An attribute in a list has a non-zero status of its own.
        ATTRIBUTE_LIST_ERROR = 0x0A => "attribute list error",
        /// The object is already in the state asked for.
        ALREADY_IN_STATE = 0x0B => "already in requested state",
        /// The object cannot do this in its present state.
        OBJECT_STATE_CONFLICT = 0x0C => "object state conflict",
        /// The instance to be created exists.
        OBJECT_ALREADY_EXISTS = 0x0D => "object already exists",
        /// The attribute cannot be written.
        ATTRIBUTE_NOT_SETTABLE = 0x0E => "attribute not settable",
        /// The requester may not do this.
        PRIVILEGE_VIOLATION = 0x0F => "privilege violation",
        /// The device cannot do this in its present mode.
        DEVICE_STATE_CONFLICT = 0x10 => "device state conflict",
        /// The reply does not fit.
        REPLY_DATA_TOO_LARGE = 0x11 => "reply data too large",
        /// Fewer data than the service needs.
        NOT_ENOUGH_DATA = 0x13 => "not enough data",
        /// The attribute is not there.
        ATTRIBUTE_NOT_SUPPORTED = 0x14 => "attribute not supported",
        /// More data than the service takes.
        TOO_MUCH_DATA = 0x15 => "too much data",
        /// The instance is not there.
        OBJECT_DOES_NOT_EXIST = 0x16 => "object does not exist",
        /// The service could not be carried out, for a reason of the object's own.
        VENDOR_SPECIFIC = 0x1F => "vendor specific error",
        /// A parameter of the request is not valid.
        INVALID_PARAMETER = 0x20 => "invalid parameter",
        /// The embedded service of a Multiple_Service_Packet failed.
        EMBEDDED_SERVICE_ERROR = 0x1E => "embedded service error",
        /// The size byte of a path does not suit its content.
        PATH_SIZE_INVALID = 0x26 => "path size invalid",
        /// The electronic key of the path does not fit this device.
        KEY_FAILURE_IN_PATH = 0x25 => "key failure in path",
        /// The attribute cannot be read.
        ATTRIBUTE_NOT_GETTABLE = 0x2C => "attribute not gettable",
        /// The member of an attribute is not there.
        INVALID_MEMBER_ID = 0x28 => "invalid member",
    }
}

open_code! {
    /// Extended status of the Connection Manager, beside general status 0x01.
    pub struct ConnectionStatus(u16) {
        /// The connection is in use, or this Forward_Open has been here before.
        IN_USE_OR_DUPLICATE = 0x0100 => "connection in use or duplicate Forward_Open",
        /// Transport class and trigger cannot go together here.
        TRANSPORT_NOT_SUPPORTED = 0x0103 => "transport class and trigger combination not supported",
        /// Another originator owns the output.
        OWNERSHIP_CONFLICT = 0x0106 => "ownership conflict",
        /// There is no such connection.
        NOT_FOUND = 0x0107 => "target connection not found",
        /// A network connection parameter is not valid.
        INVALID_NETWORK_PARAMETER = 0x0108 => "invalid network connection parameter",
        /// A connection size is not valid.
        INVALID_CONNECTION_SIZE = 0x0109 => "invalid connection size",
        /// The packet interval is not possible.
        RPI_NOT_SUPPORTED = 0x0111 => "RPI not supported",
        /// The packet intervals are not acceptable; acceptable ones follow.
        RPI_NOT_ACCEPTABLE = 0x0112 => "RPI values not acceptable",
        /// All connections are taken.
        OUT_OF_CONNECTIONS = 0x0113 => "out of connections",
        /// The electronic key names another vendor or product.
        VENDOR_OR_PRODUCT_MISMATCH = 0x0114 => "vendor ID or product code mismatch",
        /// The electronic key names another device type.
        DEVICE_TYPE_MISMATCH = 0x0115 => "device type mismatch",
        /// The electronic key names another revision.
        REVISION_MISMATCH = 0x0116 => "revision mismatch",
        /// The path to the produced or consumed data leads nowhere.
        INVALID_APPLICATION_PATH = 0x0117 => "invalid produced or consumed application path",
        /// The path to the configuration is not valid, or does not go with the rest.
        INVALID_CONFIGURATION_PATH = 0x0118 => "invalid or inconsistent configuration application path",
        /// There is no connection that a listen-only one could listen to.
        NON_LISTEN_ONLY_NOT_OPENED = 0x0119 => "non-listen-only connection not opened",
        /// The transport class is not supported.
        CLASS_NOT_SUPPORTED = 0x011C => "transport class not supported",
        /// The production trigger is not supported.
        TRIGGER_NOT_SUPPORTED = 0x011D => "production trigger not supported",
        /// The direction is not supported: the target has to be the server.
        DIRECTION_NOT_SUPPORTED = 0x011E => "direction not supported",
        /// Fixed or variable size is wrong, originator to target.
        INVALID_O_TO_T_FIXED_VARIABLE = 0x011F => "invalid O->T fixed or variable size",
        /// Fixed or variable size is wrong, target to originator.
        INVALID_T_TO_O_FIXED_VARIABLE = 0x0120 => "invalid T->O fixed or variable size",
        /// The priority is wrong, originator to target.
        INVALID_O_TO_T_PRIORITY = 0x0121 => "invalid O->T priority",
        /// The priority is wrong, target to originator.
        INVALID_T_TO_O_PRIORITY = 0x0122 => "invalid T->O priority",
        /// The connection type is wrong, originator to target.
        INVALID_O_TO_T_TYPE = 0x0123 => "invalid O->T connection type",
        /// The connection type is wrong, target to originator.
        INVALID_T_TO_O_TYPE = 0x0124 => "invalid T->O connection type",
        /// Redundant ownership is not supported.
        INVALID_REDUNDANT_OWNER = 0x0125 => "invalid O->T redundant owner flag",
        /// The configuration data have the wrong size.
        INVALID_CONFIGURATION_SIZE = 0x0126 => "invalid configuration size",
        /// The size is wrong, originator to target; the right one follows.
        INVALID_O_TO_T_SIZE = 0x0127 => "invalid O->T size",
        /// The size is wrong, target to originator; the right one follows.
        INVALID_T_TO_O_SIZE = 0x0128 => "invalid T->O size",
        /// The configuration path is not valid.
        INVALID_CONFIGURATION_APPLICATION_PATH = 0x0129 => "invalid configuration application path",
        /// The path to the consumed data is not valid.
        INVALID_CONSUMING_PATH = 0x012A => "invalid consuming application path",
        /// The path to the produced data is not valid.
        INVALID_PRODUCING_PATH = 0x012B => "invalid producing application path",
        /// The paths do not go together.
        INCONSISTENT_PATHS = 0x012F => "inconsistent application path combination",
        /// Null Forward_Open is not supported.
        NULL_NOT_SUPPORTED = 0x0132 => "null Forward_Open not supported",
        /// The time-out multiplier is not possible.
        MULTIPLIER_NOT_ACCEPTABLE = 0x0133 => "connection time-out multiplier not acceptable",
        /// Fixed or variable size, target to originator, is another one than that of the multicast stream.
        MISMATCHED_T_TO_O_FIXED_VARIABLE = 0x0135 => "mismatched T->O fixed or variable size",
        /// The priority, target to originator, is another one than that of the multicast stream.
        MISMATCHED_T_TO_O_PRIORITY = 0x0136 => "mismatched T->O priority",
        /// The connection has timed out.
        TIMED_OUT = 0x0203 => "connection timed out",
        /// The answer to an unconnected request came too late.
        UNCONNECTED_TIMED_OUT = 0x0204 => "unconnected request timed out",
        /// A parameter of an Unconnected_Send is wrong.
        UNCONNECTED_PARAMETER = 0x0205 => "parameter error in unconnected request",
        /// The port of a path is not there.
        PORT_NOT_AVAILABLE = 0x0311 => "port not available",
        /// The link address of a path is not there.
        LINK_ADDRESS_INVALID = 0x0312 => "link address not valid",
        /// A segment of a connection path is not valid.
        INVALID_SEGMENT = 0x0315 => "invalid segment in connection path",
        /// The path of a Forward_Close does not fit the connection.
        CLOSE_PATH_ERROR = 0x0316 => "error in Forward_Close connection path",
        /// A multicast address outside the subnet.
        MULTICAST_OFF_SUBNET = 0x0813 => "multicast address off subnet",
    }
}

open_code! {
    /// Service code of an explicit request; the reply has bit 7 set.
    pub struct Service(u8) {
        /// All attributes in the object's fixed order.
        GET_ATTRIBUTES_ALL = 0x01 => "Get_Attributes_All",
        /// Writes all settable attributes.
        SET_ATTRIBUTES_ALL = 0x02 => "Set_Attributes_All",
        /// Some attributes by number.
        GET_ATTRIBUTE_LIST = 0x03 => "Get_Attribute_List",
        /// Writes some attributes by number.
        SET_ATTRIBUTE_LIST = 0x04 => "Set_Attribute_List",
        /// Restarts the object.
        RESET = 0x05 => "Reset",
        /// Several services in one message.
        MULTIPLE_SERVICE_PACKET = 0x0A => "Multiple_Service_Packet",
        /// One attribute.
        GET_ATTRIBUTE_SINGLE = 0x0E => "Get_Attribute_Single",
        /// Writes one attribute.
        SET_ATTRIBUTE_SINGLE = 0x10 => "Set_Attribute_Single",
        /// Tells the device which clock is the master (Motion Device Axis Object).
        GROUP_SYNC = 0x1C => "Group_Sync",
        /// Ends a connection (Connection Manager).
        FORWARD_CLOSE = 0x4E => "Forward_Close",
        /// Carries a request along a route (Connection Manager).
        UNCONNECTED_SEND = 0x52 => "Unconnected_Send",
        /// Opens a connection (Connection Manager).
        FORWARD_OPEN = 0x54 => "Forward_Open",
        /// Data of a connection by its number (Connection Manager).
        GET_CONNECTION_DATA = 0x56 => "Get_Connection_Data",
        /// Data of a connection by its triad (Connection Manager).
        SEARCH_CONNECTION_DATA = 0x57 => "Search_Connection_Data",
        /// Opens a connection of more than 511 bytes (Connection Manager).
        LARGE_FORWARD_OPEN = 0x5B => "Large_Forward_Open",
    }
}

/// Bit 7 of the service code, which marks a reply.
pub const REPLY_BIT: u8 = 0x80;

/// General status for data with a wrong number of bytes; `None` where the bytes say something wrong.
pub(crate) fn length_status(error: &super::Error) -> Option<GeneralStatus> {
    match error {
        error if error.is_too_short() => Some(GeneralStatus::NOT_ENOUGH_DATA),
        error if error.is_too_long() => Some(GeneralStatus::TOO_MUCH_DATA),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_name_themselves() {
        assert_eq!(GeneralStatus(0x15).to_string(), "too much data");
        assert_eq!(ConnectionStatus(0x0106), ConnectionStatus::OWNERSHIP_CONFLICT);
        assert_eq!(Service(0x5B).to_string(), "Large_Forward_Open");
        assert_eq!(ConnectionStatus(0x0999).name(), None);
    }
}
