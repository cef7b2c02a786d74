//! A CANopen drive of CiA 402.
