//! A CANopen device with a simulated drive behind it.
