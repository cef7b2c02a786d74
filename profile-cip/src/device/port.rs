//! The Ethernet port as the host reports it.

/// What kind of port it is (attribute 7).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InterfaceType {
    /// The host does not say.
    #[default]
    Unknown,
    /// Inside the host, as the loopback interface is.
    Internal,
    /// Copper.
    TwistedPair,
    /// Fibre.
    OpticalFiber,
}

/// State of the port, from the host; it may change at any time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LinkState {
    /// The link is up.
    pub up: bool,
    /// The host has switched the port on.
    pub enabled: bool,
    /// Speed in Mbit/s; 0 without a link or where the host does not know it.
    pub speed_mbit: u32,
    /// Full duplex.
    pub full_duplex: bool,
    /// What has gone through the port.
    pub counters: Option<InterfaceCounters>,
    /// What went wrong on the medium.
    pub media: Option<MediaCounters>,
}

/// Traffic of the port since the host started (attribute 4). The attribute has 32 bits and starts over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InterfaceCounters {
    /// Bytes received.
    pub in_octets: u64,
    /// Unicast packets received; with broadcasts where the host does not count them apart.
    pub in_unicast: u64,
    /// Multicast packets received.
    pub in_multicast: u64,
    /// Packets received and dropped for want of room.
    pub in_discards: u64,
    /// Packets received with errors.
    pub in_errors: u64,
    /// Packets received of a protocol nobody takes.
    pub in_unknown_protocols: u64,
    /// Bytes sent.
    pub out_octets: u64,
    /// Packets sent; with multicasts where the host does not count them apart.
    pub out_unicast: u64,
    /// Multicast packets sent.
    pub out_multicast: u64,
    /// Packets dropped instead of sent.
    pub out_discards: u64,
    /// Packets that could not be sent.
    pub out_errors: u64,
}

/// Errors of the medium since the host started (attribute 5). The attribute has 32 bits and starts over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MediaCounters {
    /// Frames that were no whole number of octets.
    pub alignment_errors: u64,
    /// Frames with a wrong check sequence.
    pub fcs_errors: u64,
    /// Frames sent after one collision.
    pub single_collisions: u64,
    /// Frames sent after several collisions.
    pub multiple_collisions: u64,
    /// SQE test errors.
    pub sqe_test_errors: u64,
    /// Frames whose first attempt was delayed by a busy medium.
    pub deferred: u64,
    /// Collisions later than one slot time.
    pub late_collisions: u64,
    /// Frames given up after too many collisions.
    pub excessive_collisions: u64,
    /// Frames the port itself failed to send.
    pub mac_transmit_errors: u64,
    /// Carrier lost while sending.
    pub carrier_sense_errors: u64,
    /// Frames longer than permitted.
    pub frames_too_long: u64,
    /// Frames the port itself failed to receive.
    pub mac_receive_errors: u64,
}
