//! Electronic data sheets and device configuration files (CiA 306).
