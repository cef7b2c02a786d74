//! System time: where it comes from, and whether it is everybody's time.
//!
//! | file | what it holds |
//! |---|---|
//! | [`source`] | the sources, one of which runs, and what they tell |
//! | [`ptp`] | the embedded follower of PTP |
//! | [`daemon`] | the time of `ptp4l` on this host |
//! | [`line`] | the line from the monotonic clock to the master's |
//! | [`judge`] | whether time is synchronized |
//! | [`status`], [`feed`] | what is told to people and tools, and to the cycle |
//! | [`object`] | what the Time Sync object shows |

pub mod daemon;
pub mod feed;
pub mod judge;
pub mod line;
pub mod object;
pub mod ptp;
pub mod source;
pub mod status;
