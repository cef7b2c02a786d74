//! The two Ethernet ports that masters and slaves have.

use core::fmt;

/// One of the two Ethernet ports of a station.
///
/// A master sends its primary (P) telegrams on port 1 and its secondary (S) telegrams on port 2. A slave takes
/// telegrams on either port; which one is nearer to the master's first port it learns from them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Port {
    /// Port 1.
    One,
    /// Port 2.
    Two,
}

impl Port {
    /// Both ports.
    pub const ALL: [Port; 2] = [Port::One, Port::Two];

    /// The other port.
    #[must_use]
    pub const fn other(self) -> Port {
        match self {
            Port::One => Port::Two,
            Port::Two => Port::One,
        }
    }

    pub(crate) const fn index(self) -> usize {
        match self {
            Port::One => 0,
            Port::Two => 1,
        }
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "port {}", self.index() + 1)
    }
}
