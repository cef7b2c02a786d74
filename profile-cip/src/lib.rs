//! EtherNet/IP, CIP and CIP Motion: wire formats, target and controller roles.
