//! A SERCOS III slave with a drive in it.
