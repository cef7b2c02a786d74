//! The bytes of CANopen: one file per kind of frame.
