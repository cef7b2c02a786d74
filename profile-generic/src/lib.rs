//! The generic power drive system interface of IEC 61800-7-1.
