//! Class codes of objects that other parts name.

/// Class code of the Message Router object.
pub const CLASS_MESSAGE_ROUTER: u16 = 0x02;
/// Class code of the Assembly object.
pub const CLASS_ASSEMBLY: u16 = 0x04;
/// Class code of the Connection Manager object.
pub const CLASS_CONNECTION_MANAGER: u16 = 0x06;
/// Class code of the AC/DC Drive object.
pub const CLASS_AC_DC_DRIVE: u16 = 0x2A;
/// Class code of the vendor object whose attributes are the parameters of a drive, at devices with assemblies.
pub const CLASS_AXIS_PARAMETER: u16 = 0x64;
/// Class code of the Motion Device Axis Object.
pub const CLASS_MOTION_DEVICE_AXIS: u16 = 0x42;
