//! What the adapter tells the application, for its log and its duties.

use crate::device::config::QosConfig;
use crate::device::motion_link::{AssemblyRole, ConnectionTriad};
use crate::device::objects::time_sync::TimeSyncSetting;
use crate::wire::status::Service;
use core::fmt;
use core::net::{Ipv4Addr, SocketAddrV4};

/// Kind of an Identity object reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResetKind {
    /// Type 0: as if the power had been cycled.
    PowerCycle,
    /// Type 1: back to the values of the factory, then as type 0.
    FactoryDefaults,
}

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// The motion connection is open.
    MotionOpened {
        /// The connection, by the numbers of its Forward_Open.
        triad: ConnectionTriad,
        /// Whose.
        originator: SocketAddrV4,
        /// Packet interval of both directions in microseconds.
        rpi_us: u32,
    },
    /// The motion connection was closed by its originator.
    MotionClosed {
        /// The connection, by the numbers of its Forward_Open.
        triad: ConnectionTriad,
    },
    /// The motion connection timed out: no controller-to-device datagram for too long.
    MotionLost {
        /// The connection, by the numbers of its Forward_Open.
        triad: ConnectionTriad,
        /// Whose.
        originator: SocketAddrV4,
        /// Silence in microseconds.
        silent_us: u64,
        /// Permitted silence in microseconds.
        timeout_us: u64,
    },
    /// A connection to assemblies is open.
    AssemblyOpened {
        /// What its originator may do.
        role: AssemblyRole,
        /// The connection, by the numbers of its Forward_Open.
        triad: ConnectionTriad,
        /// Whose.
        originator: SocketAddrV4,
        /// Packet intervals in microseconds, O->T and T->O.
        intervals_us: (u32, u32),
        /// Multicast group of the data T->O, unless they go to the originator alone.
        group: Option<Ipv4Addr>,
    },
    /// A connection to assemblies was closed by its originator.
    AssemblyClosed {
        /// What its originator could do.
        role: AssemblyRole,
        /// The connection, by the numbers of its Forward_Open.
        triad: ConnectionTriad,
    },
    /// A connection to assemblies timed out, or a listen-only one has nothing to listen to any more.
    AssemblyLost {
        /// What its originator could do.
        role: AssemblyRole,
        /// The connection, by the numbers of its Forward_Open.
        triad: ConnectionTriad,
        /// Whose.
        originator: SocketAddrV4,
        /// Silence in microseconds.
        silent_us: u64,
        /// Permitted silence in microseconds.
        timeout_us: u64,
    },
    /// A Forward_Open was refused.
    OpenRefused {
        /// Which one; zeros if the request was too short to tell.
        triad: ConnectionTriad,
        /// Whose.
        originator: SocketAddrV4,
        /// General status of the refusal.
        general: u8,
        /// Extended status of the refusal.
        extended: u16,
        /// The value found, where the refusal is about one.
        found: Option<u32>,
        /// The value that would be taken, where the refusal is about one.
        expected: Option<u32>,
    },
    /// An explicit connection timed out: no request for too long.
    ExplicitLost {
        /// The connection, by the numbers of its Forward_Open.
        triad: ConnectionTriad,
        /// Whose.
        originator: SocketAddrV4,
        /// Silence in microseconds.
        silent_us: u64,
        /// Permitted silence in microseconds.
        timeout_us: u64,
    },
    /// A stream was closed for silence: no whole packet for too long.
    SessionLost {
        /// Whose.
        peer: SocketAddrV4,
        /// Whether a session was registered on it.
        registered: bool,
        /// Silence in microseconds.
        silent_us: u64,
        /// Permitted silence in microseconds.
        timeout_us: u64,
    },
    /// The motion device has not answered a request; the requester was told that it is not available.
    DeviceSilent {
        /// Service of the request.
        service: Service,
        /// How long its answer was waited for, in microseconds.
        waited_us: u64,
    },
    /// The Identity object was reset; the reply is on its way. The application restarts the device.
    Reset {
        /// How.
        kind: ResetKind,
        /// By whom.
        originator: SocketAddrV4,
    },
    /// DSCP values were changed. The application keeps them and uses them after its next start.
    QosChanged(QosConfig),
    /// The inactivity time-out of sessions was changed. The application keeps it.
    InactivityTimeoutChanged {
        /// New value in seconds, 0 is never.
        seconds: u16,
    },
    /// The Time Sync object was written. The application does it.
    TimeSyncSet(TimeSyncSetting),
}

impl fmt::Display for Event {
    // Flat: one arm per event.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::MotionOpened { triad, originator, rpi_us } => {
                write!(f, "motion {triad} opened by {originator}, interval {rpi_us} us")
            }
            Self::MotionClosed { triad } => write!(f, "motion {triad} closed by its originator"),
            Self::MotionLost { triad, originator, silent_us, timeout_us } => {
                write!(f, "motion {triad} of {originator} timed out: ")?;
                silence(f, silent_us, timeout_us)
            }
            Self::AssemblyOpened { role, triad, originator, intervals_us: (o_to_t, t_to_o), group } => {
                let role = role.name();
                write!(f, "{role} {triad} opened by {originator}, intervals {o_to_t} us and {t_to_o} us")?;
                match group {
                    Some(group) => write!(f, ", multicast to {group}"),
                    None => Ok(()),
                }
            }
            Self::AssemblyClosed { role, triad } => {
                write!(f, "{} {triad} closed by its originator", role.name())
            }
            Self::AssemblyLost { role, triad, originator, silent_us, timeout_us }
                if silent_us > timeout_us =>
            {
                write!(f, "{} {triad} of {originator} timed out: ", role.name())?;
                silence(f, silent_us, timeout_us)
            }
            Self::AssemblyLost { role, triad, originator, .. } => {
                write!(f, "{} {triad} of {originator} ended with the last connection of others", role.name())
            }
            Self::OpenRefused { triad, originator, general, extended, found, expected } => {
                write!(f, "{triad} of {originator} refused with {general:#04x}/{extended:#06x}")?;
                match (expected, found) {
                    (Some(expected), Some(found)) => write!(f, ": expected {expected:#x}, found {found:#x}"),
                    (_, Some(found)) => write!(f, ": found {found:#x}"),
                    _ => Ok(()),
                }
            }
            Self::ExplicitLost { triad, originator, silent_us, timeout_us } => {
                write!(f, "explicit {triad} of {originator} timed out: ")?;
                silence(f, silent_us, timeout_us)
            }
            Self::SessionLost { peer, registered, silent_us, timeout_us } => {
                let what = if registered { "session" } else { "stream without a session" };
                write!(f, "{what} of {peer} timed out: ")?;
                silence(f, silent_us, timeout_us)
            }
            Self::DeviceSilent { service, waited_us } => {
                write!(f, "{service}: no answer of the motion device within {waited_us} us")
            }
            Self::Reset { kind, originator } => write!(f, "reset ({kind:?}) asked for by {originator}"),
            Self::QosChanged(qos) => write!(f, "DSCP values for the next start: {qos:?}"),
            Self::InactivityTimeoutChanged { seconds } => {
                write!(f, "session inactivity time-out {seconds} s")
            }
            Self::TimeSyncSet(TimeSyncSetting::MaxOffset) => {
                f.write_str("Time Sync: the largest offset from the master begins anew")
            }
            Self::TimeSyncSet(TimeSyncSetting::Domain(domain)) => write!(f, "Time Sync: PTP domain {domain}"),
        }
    }
}

/// In which direction, for how long, and how late.
fn silence(f: &mut fmt::Formatter<'_>, silent_us: u64, timeout_us: u64) -> fmt::Result {
    let late_us = silent_us.saturating_sub(timeout_us);
    write!(f, "nothing O->T for {silent_us} us, expected within {timeout_us} us, late by {late_us} us")
}
