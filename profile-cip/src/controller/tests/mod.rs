//! Whole runs of the controller in virtual time.

mod against_target;
mod failures;
mod peer;
mod rig;
mod runs;
mod session_table;
mod units;
