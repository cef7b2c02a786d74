//! Compiled programs: what a mapping table becomes before the cycle starts.
//!
//! Everything here is flat, `Copy` and free of names: the cycle looks nothing up. A [`Field`] moves one
//! signal between a process image and a place in a telegram; a [`Conversion`] does the arithmetic; the tables
//! in [`pattern`] turn status words into reports and actions into control words. All telegrams are little
//! endian, as CIP, SERCOS and CANopen are.

pub mod conversion;
pub mod field;
pub mod pattern;

pub use crate::ratio::Outcome;
pub use conversion::Conversion;
pub use field::{
    CommandProgram, ConversionReport, FeedbackProgram, Field, FieldError, MAX_FIELDS, Program, Trackers,
    Width,
};
pub use pattern::{ActionTable, BitPattern, MAX_STATE_ROWS, StateTable};
