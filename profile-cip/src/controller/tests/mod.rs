//! Whole runs of the controller in virtual time.

mod failures;
mod peer;
mod rig;
mod runs;
mod session_table;
