#![doc = include_str!("../README.md")]
//!
//! # The model
//!
//! The generic power drive system (PDS) interface of IEC 61800-7-1.
//!
//! Nothing crosses from one drive profile to another except through the types of this crate. It depends on no
//! other part of Axisbridge, opens no socket and reads no clock.
//!
//! # What this is drawn from
//!
//! The text of IEC 61800-7-1 itself was not available. What is known of it is what the two CIP parts of the
//! series repeat: clause 3 of IEC 61800-7-202 and clause 3 of IEC 61800-7-302 define, with reference to IEC
//! 61800-7-1, the terms functional element, command, status, set-point, actual value, parameter, input and
//! output data, and operating mode, and 61800-7-202 names the functional elements communication, device
//! control and basic drive. The names in this crate are those terms. What fills them is our own, drawn as
//! follows:
//!
//! | part | drawn from |
//! |---|---|
//! | [`functional_element`], the division into modules | clause 3 of IEC 61800-7-202 and 61800-7-302 |
//! | [`state`], precedence after a fault reset | CIP Volume 9, 5-2.6.1, table 5-2.97, generalised |
//! | [`fault`], [`inhibit`] | CIP Volume 9, tables 5-2.65, 5-2.72 and 5-2.74, and what other profiles raise |
//! | [`interpolation`] | CIP Volume 9, 5-2.6.5.2 and table 6-2.24 |
//! | [`sequence`] | CIP Volume 9, 5-2.3.9.1 |
//! | [`mode`] | IEC 61800-7-202, 4.2 |
//! | [`capture`] | CIP Volume 9, the events of the Motion Device Axis Object |
//! | [`hookup`] | CIP Volume 9, the motor and feedback test of 5-2.5.1.9; how it moves is our own |
//! | [`can`] | ISO 11898-1; no part of the drive model |
//! | [`quantity`], [`ratio`], [`scaling`], [`program`], [`parameter`], [`servo`] | our own design |
//!
//! # Functional elements and their modules
//!
//! | functional element | modules |
//! |---|---|
//! | device identification | [`parameter`] (group 0x01xx) |
//! | communication | [`time`], [`interpolation`], [`program`] |
//! | device control | [`mode`], requests and reports in [`state`] |
//! | basic drive | [`state`], [`sequence`], [`image`], [`fault`], [`inhibit`], [`scaling`], [`quantity`], [`ratio`] |
//! | application functions | [`capture`], [`hookup`] |
//!
//! And the terms of the interface: commands are [`state::Request`]s, status is [`image::StatusBits`] and
//! [`state::DriveState`], set-points stand in [`image::AxisCommand`], actual values in
//! [`image::AxisFeedback`], parameters in [`parameter`], operating modes in [`mode`]; I/O data is what a
//! [`program`] encodes and decodes. [`servo`] is a simulated axis for the other side of all this.
//!
//! # Numbers
//!
//! Every quantity is an integer in a fixed unit, every conversion a ratio of integers, rounded once and in a
//! stated way; what does not fit is clamped and reported. Floating point and integers meet in [`cast`] only.

#![forbid(unsafe_code)]

pub mod can;
pub mod capture;
pub mod cast;
pub mod code;
pub mod fault;
pub mod fault_set;
pub mod functional_element;
mod generated;
pub mod hookup;
pub mod image;
pub mod inhibit;
pub mod interpolation;
pub mod mode;
pub mod parameter;
pub mod program;
pub mod quantity;
pub mod ratio;
pub mod scaling;
pub mod sequence;
pub mod servo;
pub mod state;
pub mod time;
pub mod time_base;
pub mod wire;
