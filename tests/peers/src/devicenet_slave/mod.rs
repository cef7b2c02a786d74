//! A DeviceNet slave with a drive in it.
