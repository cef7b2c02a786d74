//! Tables of motion: what the set-points on each bus are like while wake-ups, updates and clocks are not as they should be.
//!
//! Each test makes one table, a snapshot, and prints how many rows it has. A row is one disturbance in one chain (bus, and
//! operation with or without a shared clock); see [`scenario`] for what the axis does in it and for how to add one.

mod assembly;
mod chain;
mod clocks;
mod drive_faults;
mod grandmaster;
mod latency;
mod long_run;
mod modes;
mod phase_lock;
mod probe;
mod round_trips;
mod scenario;
mod table;
mod timing_model;
mod trouble;
mod updates;
mod wake_ups;
