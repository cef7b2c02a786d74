//! The network's master (CiA 302).
