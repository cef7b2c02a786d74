//! What passes between the explicit side ([`crate::device::explicit::adapter`]) and the motion device.
//!
//! The two run on different threads: the adapter beside the TCP sessions, the motion device in the cycle.
//! These values cross in bounded queues, so they own fixed storage and never touch the heap.
//!
//! ```text
//! Adapter --MotionRequest--> motion device        Adapter <--MotionReply-- motion device
//! ```
//!
//! Every request carries a [`Token`] and is answered exactly once with a reply of the same token. Besides
//! that the device reports on its own when the open connection has timed out.

use arrayvec::ArrayVec;
use core::net::{Ipv4Addr, SocketAddrV4};

use crate::assembly::layout::ASSEMBLY_LEN_MAX;
pub use crate::wire::ConnectionTriad;
use crate::wire::network_parameters::Priority;

/// Most bytes of service data in a handed-on explicit request, and in replies of axes: what an unconnected message
/// holds.
pub const EXPLICIT_DATA_MAX: usize = 504;

/// Most bytes of data in any reply: a whole assembly, which needs a large explicit connection.
pub const EXPLICIT_REPLY_MAX: usize = ASSEMBLY_LEN_MAX;

/// Most 16-bit words of extended status the device may add to a reply.
pub const EXTENDED_STATUS_MAX: usize = 4;

/// State of the device's clock, from its Time Sync object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SyncState {
    /// Clock identity of the grand master that the device follows, if it follows one.
    pub grandmaster: Option<[u8; 8]>,
    /// The clock is within the sync threshold.
    pub synchronized: bool,
    /// System Time Offset, ns: system time less local clock.
    pub offset: i64,
}

/// How good the synchronization of the device's clock is, as it measures it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SyncQuality {
    /// Variation of the System Time Offset about its mean, ns (class attribute 28); `u32::MAX` while none is measured.
    pub variance: u32,
    /// Boundary clocks between the grandmaster and this clock, and one more for this one.
    pub steps_removed: u16,
    /// Interval of Sync messages, as a power of two in seconds.
    pub log_sync_interval: i8,
}

impl Default for SyncQuality {
    fn default() -> Self {
        Self { variance: u32::MAX, steps_removed: 0, log_sync_interval: 0 }
    }
}

impl SyncQuality {
    /// Sync Update Delay, seconds (class attribute 30): how long a change of the grandmaster takes to come here.
    #[must_use]
    pub fn update_delay(&self) -> f32 {
        f32::from(self.steps_removed) * f32::from(self.log_sync_interval).exp2()
    }
}

/// Names one request until its reply; never used twice by one adapter run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Token(pub u64);

/// What the adapter asks of the motion device.
#[expect(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MotionRequest {
    /// Take up the motion I/O connection; answered with [`MotionReply::Opened`].
    Open(OpenParameters),
    /// Give the motion I/O connection up at the controller's wish (Forward_Close, Volume 9 clause 5-2.6:
    /// faults are cleared and the axes initialise); answered with [`MotionReply::Closed`].
    Close(CloseParameters),
    /// Run an explicit service of the Motion Device Axis Object; answered with [`MotionReply::Explicit`].
    Explicit(ExplicitRequest),
    /// Say whether the device may be started anew, which takes power and command away from every axis; answered with
    /// [`MotionReply::ResetPrepared`]. Nothing is opened behind it until the answer.
    PrepareReset(Token),
}

impl MotionRequest {
    /// The token its reply has to carry.
    pub const fn token(&self) -> Token {
        match self {
            Self::Open(open) => open.token,
            Self::Close(close) => close.token,
            Self::Explicit(explicit) => explicit.token,
            Self::PrepareReset(token) => *token,
        }
    }
}

/// A connection to the assemblies of a device, beside what it has in common with the motion connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AssemblyOpen {
    /// What the originator may do on it.
    pub role: AssemblyRole,
    /// Requested packet interval of the target-to-originator direction in microseconds; [`OpenParameters::rpi_us`] is that
    /// of the other one.
    pub t_to_o_rpi_us: u32,
    /// Priority of that direction.
    pub t_to_o_priority: Priority,
    /// That direction is a multicast stream, which all such connections of the device share.
    pub multicast: bool,
}

/// What an originator may do on a connection to assemblies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AssemblyRole {
    /// It owns the output assembly; there is one.
    ExclusiveOwner,
    /// It gets the input assembly, whether or not there is an owner.
    InputOnly,
    /// It gets the input assembly as long as another connection that is no listen-only one does.
    ListenOnly,
}

impl AssemblyRole {
    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::ExclusiveOwner => "exclusive owner",
            Self::InputOnly => "input only",
            Self::ListenOnly => "listen only",
        }
    }
}

/// The motion I/O connection as the Forward_Open asked for it; every value has been checked and accepted.
///
/// O->T is the controller-to-device direction, T->O the device-to-controller direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpenParameters {
    /// Names this request.
    pub token: Token,
    /// The connection's triad.
    pub triad: ConnectionTriad,
    /// Connection ID in the controller-to-device datagrams; chosen by this device, unique in its run.
    pub o_to_t_id: u32,
    /// Connection ID to put into the device-to-controller datagrams; chosen by the controller, of a multicast stream by this
    /// device.
    pub t_to_o_id: u32,
    /// Address controller-to-device datagrams come from; others are not of this connection.
    pub originator: Ipv4Addr,
    /// Where device-to-controller datagrams go: to the originator, or to a multicast group.
    pub t_to_o_destination: SocketAddrV4,
    /// Requested packet interval of both directions in microseconds, which is the Controller Update Period
    /// (Volume 9 clause 7-1.1: the actual interval equals the requested one).
    pub rpi_us: u32,
    /// Silence in the controller-to-device direction that ends the connection, in microseconds: the interval
    /// times the time-out multiplier.
    pub timeout_us: u64,
    /// Largest controller-to-device connection data in bytes, the 2-byte sequence count included.
    pub o_to_t_size: u16,
    /// Largest device-to-controller connection data in bytes, the 2-byte sequence count included.
    pub t_to_o_size: u16,
    /// Whether controller-to-device data may be shorter than `o_to_t_size`.
    pub o_to_t_variable: bool,
    /// Whether device-to-controller data may be shorter than `t_to_o_size`.
    pub t_to_o_variable: bool,
    /// Code point that marks device-to-controller datagrams, 0..=63: the QoS object's for the priority of this
    /// direction.
    pub t_to_o_dscp: u8,
    /// Format revision of the connection data (the I/O connection point of the path); 0 with assemblies.
    pub format_revision: u8,
    /// Bits of the configuration block of the path (class attribute 36); 0 with assemblies.
    pub configuration_bits: u8,
    /// A connection to assemblies in place of the motion connection.
    pub assembly: Option<AssemblyOpen>,
}

impl OpenParameters {
    /// Group and port of the multicast stream that this connection consumes, if it does.
    #[must_use]
    pub fn group(&self) -> Option<SocketAddrV4> {
        self.assembly.filter(|assembly| assembly.multicast).map(|_| self.t_to_o_destination)
    }
}

/// Which connection ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CloseParameters {
    /// Names this request.
    pub token: Token,
    /// The connection's triad.
    pub triad: ConnectionTriad,
    /// The controller-to-device connection ID given at [`OpenParameters::o_to_t_id`].
    pub o_to_t_id: u32,
}

/// The object and attribute an explicit request is aimed at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ObjectPath {
    /// Class code.
    pub class: u16,
    /// Instance number; 0 is the class itself.
    pub instance: u32,
    /// Attribute number where the path names one.
    pub attribute: Option<u16>,
    /// Member (array element) where the path names one.
    pub member: Option<u32>,
    /// Connection point where the path names one.
    pub connection_point: Option<u16>,
}

/// An explicit service request to the Motion Device Axis Object, or to the parameters of a drive at a device with assemblies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExplicitRequest {
    /// Names this request.
    pub token: Token,
    /// Who asks.
    pub originator: Ipv4Addr,
    /// Service code, 0..=0x7F.
    pub service: u8,
    /// What it is aimed at.
    pub path: ObjectPath,
    /// The service data behind the path.
    pub data: ArrayVec<u8, EXPLICIT_DATA_MAX>,
}

/// What the motion device tells the adapter.
#[expect(clippy::large_enum_variant, reason = "queue slots have one size, and boxing would allocate")]
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MotionReply {
    /// Answer to [`MotionRequest::Open`].
    Opened {
        /// Token of the request.
        token: Token,
        /// Success, or why the device cannot take the connection now.
        outcome: Result<(), OpenRefusal>,
    },
    /// Answer to [`MotionRequest::Close`]; also given when the device no longer had that connection.
    Closed {
        /// Token of the request.
        token: Token,
    },
    /// Answer to [`MotionRequest::Explicit`].
    Explicit(ExplicitReply),
    /// Answer to [`MotionRequest::PrepareReset`].
    ResetPrepared {
        /// Token of the request.
        token: Token,
        /// No connection is open and no axis is energized.
        granted: bool,
    },
    /// The connection ended without a Forward_Close: the controller was silent for too long. The connection
    /// is free for the next owner from here on.
    ConnectionLost {
        /// Which connection.
        o_to_t_id: u32,
        /// Silence since the last controller-to-device datagram in microseconds.
        silent_us: u64,
    },
}

/// Why the device refuses a connection that the adapter had accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpenRefusal {
    /// General status for the Forward_Open reply, not zero.
    pub general_status: u8,
    /// First extended status word.
    pub extended_status: u16,
}

/// The answer to an explicit request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExplicitReply {
    /// Token of the request.
    pub token: Token,
    /// General status; zero is success.
    pub general_status: u8,
    /// Extended status words, usually none.
    pub extended_status: ArrayVec<u16, EXTENDED_STATUS_MAX>,
    /// Reply data of the service.
    pub data: ArrayVec<u8, EXPLICIT_REPLY_MAX>,
}

impl ExplicitReply {
    /// A reply without data: success (0) or a refusal.
    pub fn status(token: Token, general_status: u8) -> Self {
        Self { token, general_status, extended_status: ArrayVec::new(), data: ArrayVec::new() }
    }
}
