//! Whole runs of the controller in virtual time.

mod abuse;
mod against_device;
mod failures;
mod features;
mod fixed;
mod peer;
mod rig;
mod runs;
mod session_table;
mod units;
