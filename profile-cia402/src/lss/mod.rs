//! Layer setting services (CiA 305).
