//! The Axisbridge gateway.
