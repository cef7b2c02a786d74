//! Service data objects: both ends of a channel (CiA 301).
