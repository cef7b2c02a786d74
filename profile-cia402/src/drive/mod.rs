//! Words, states and modes of CiA 402, for both roles.
