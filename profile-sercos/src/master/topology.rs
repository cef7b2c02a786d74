//! Which way telegrams go round the network, and how an open ring is closed again.
//!
//! P telegrams leave on port 1 and S telegrams on port 2. On which port they come back says what the network is:
//!
//! | port 1 | port 2 | topology |
//! |---|---|---|
//! | P | - | line on port 1 |
//! | - | S | line on port 2 |
//! | P | S | broken ring: two lines |
//! | S | P | ring |
//! | P | P | ring without S channel; from a line on port 1: the line's end reaches port 2 |
//! | S | S | ring without P channel; from a line on port 2: the line's end reaches port 1 |
//!
//! What comes back on a port shows a topology at once; what only stays away is a lost telegram until it has stayed
//! away for some cycles.
//!
//! A slave that loses a link turns the telegrams round by itself. It stays so until the master commands fast
//! forward, and it reports what comes in on its inactive port:
//!
//! ```text
//!        both ends see the other line          long enough: fast forward is commanded
//! Idle ------------------------------> Settling -------------------------------------> Commanded
//!  ^ <---------- one does not -----------+                                              |    |
//!  |                                              done, and the topology is a ring      |    | not done, or
//!  +------------------------------------------------------------------------------------+    | slaves unseen
//!  |                                                                                         v
//!  +--- one end sees nothing, or after a while --- Refused <------- loopback is back --- Restoring
//! ```

use core::fmt;

use super::event::Port;
use crate::wire::header::Channel;

/// Cycles in a row for which telegrams stay away before that counts as another topology.
const AWAY_CYCLES: u8 = 3;

/// A way round the network: a channel, and the port at which its telegrams come back. In a line they come back to
/// the port they were sent from, in a ring to the other one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Route {
    /// P or S telegrams.
    pub channel: Channel,
    /// The port on which they come in.
    pub port: Port,
}

impl Route {
    /// P telegrams of a line on port 1, or up to where a ring is open.
    pub const PRIMARY_ONE: Route = Route { channel: Channel::Primary, port: Port::One };
    /// S telegrams of a line on port 2, or up to where a ring is open.
    pub const SECONDARY_TWO: Route = Route { channel: Channel::Secondary, port: Port::Two };
    /// P telegrams that have gone all the way round a ring.
    pub const PRIMARY_TWO: Route = Route { channel: Channel::Primary, port: Port::Two };
    /// S telegrams that have gone all the way round a ring.
    pub const SECONDARY_ONE: Route = Route { channel: Channel::Secondary, port: Port::One };
    /// All there are.
    pub const ALL: [Route; 4] =
        [Route::PRIMARY_ONE, Route::SECONDARY_TWO, Route::PRIMARY_TWO, Route::SECONDARY_ONE];

    /// Place in [`Route::ALL`].
    pub const fn index(self) -> usize {
        match (self.channel, self.port) {
            (Channel::Primary, Port::One) => 0,
            (Channel::Secondary, Port::Two) => 1,
            (Channel::Primary, Port::Two) => 2,
            (Channel::Secondary, Port::One) => 3,
        }
    }
}

/// Routes on which ATs have come back in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Seen(u8);

impl Seen {
    pub fn of(came: impl Fn(Route) -> bool) -> Seen {
        let bit = |route: Route| u8::from(came(route)) << route.index();
        Seen(Route::ALL.into_iter().map(bit).sum())
    }

    pub const fn contains(self, route: Route) -> bool {
        self.0 & 1 << route.index() != 0
    }
}

/// What the network is, from the master's ports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Topology {
    /// Nothing has come back yet.
    #[default]
    Absent,
    /// A line on port 1.
    LineOne,
    /// A line on port 2.
    LineTwo,
    /// A line on each port.
    BrokenRing,
    /// A closed ring: every telegram passes every slave on both channels.
    Ring,
    /// A ring in which the telegrams of one channel do not get round.
    DefectRing {
        /// The channel that does not.
        defective: Channel,
    },
}

/// What a cycle says about the topology.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Nothing new.
    Stay,
    /// It is another one.
    Now(Topology),
    /// It is another one if it goes on so.
    Later(Topology),
}

impl Topology {
    /// All topologies.
    pub const ALL: [Topology; 7] = [
        Topology::Absent,
        Topology::LineOne,
        Topology::LineTwo,
        Topology::BrokenRing,
        Topology::Ring,
        Topology::DefectRing { defective: Channel::Primary },
        Topology::DefectRing { defective: Channel::Secondary },
    ];

    /// The routes on which every telegram of their channel comes back.
    pub(super) const fn routes(self) -> &'static [Route] {
        match self {
            Topology::Absent => &[],
            Topology::LineOne => &[Route::PRIMARY_ONE],
            Topology::LineTwo => &[Route::SECONDARY_TWO],
            Topology::BrokenRing => &[Route::PRIMARY_ONE, Route::SECONDARY_TWO],
            Topology::Ring => &[Route::PRIMARY_TWO, Route::SECONDARY_ONE],
            Topology::DefectRing { defective: Channel::Secondary } => &[Route::PRIMARY_TWO],
            Topology::DefectRing { defective: Channel::Primary } => &[Route::SECONDARY_ONE],
        }
    }

    /// Whether telegrams can come in on this route. While a ring is being closed all can.
    pub(super) fn admits(self, route: Route, closing: bool) -> bool {
        match self {
            _ if closing => true,
            Topology::Absent | Topology::Ring | Topology::DefectRing { .. } => true,
            Topology::LineOne => route != Route::SECONDARY_ONE,
            Topology::LineTwo => route != Route::PRIMARY_TWO,
            Topology::BrokenRing => matches!(route, Route::PRIMARY_ONE | Route::SECONDARY_TWO),
        }
    }

    /// Whether the cables make a ring, whatever the slaves do with the telegrams.
    #[must_use]
    pub const fn is_ring(self) -> bool {
        matches!(self, Topology::Ring | Topology::DefectRing { .. })
    }

    /// What a cycle says in which ATs came back as in `seen`.
    // Flat: the table above, one arm per row.
    pub(super) fn judge(self, seen: Seen) -> Verdict {
        use Topology as T;
        let defect = |defective| T::DefectRing { defective };
        let [p1, s2, p2, s1] = Route::ALL.map(|route| seen.contains(route));
        let (shown, positive) = match (p1, s2, p2, s1) {
            (true, true, _, _) => (T::BrokenRing, true),
            (false, false, true, true) => (T::Ring, true),
            (true, false, true, false) if self == T::LineOne => (T::LineOne, true),
            (false, true, false, true) if self == T::LineTwo => (T::LineTwo, true),
            (true, false, true, false) => (defect(Channel::Secondary), true),
            (false, true, false, true) => (defect(Channel::Primary), true),
            (true, false, false, false) => (T::LineOne, false),
            (false, true, false, false) => (T::LineTwo, false),
            (false, false, true, false) => (defect(Channel::Secondary), false),
            (false, false, false, true) => (defect(Channel::Primary), false),
            // The cycle in which something changes, or nothing at all.
            _ => return Verdict::Stay,
        };
        if shown == self {
            Verdict::Stay
        } else if positive || self == T::Absent {
            Verdict::Now(shown)
        } else {
            Verdict::Later(shown)
        }
    }
}

impl fmt::Display for Topology {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Topology::Absent => "no telegrams come back",
            Topology::LineOne => "line on port 1",
            Topology::LineTwo => "line on port 2",
            Topology::BrokenRing => "broken ring, a line on each port",
            Topology::Ring => "ring",
            Topology::DefectRing { defective: Channel::Primary } => "ring without P channel",
            Topology::DefectRing { defective: Channel::Secondary } => "ring without S channel",
        })
    }
}

/// The topology as it is watched from cycle to cycle.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Watch {
    pub topology: Topology,
    /// Another one, and the cycles in a row that spoke for it.
    later: (Topology, u8),
}

impl Watch {
    pub const fn new(topology: Topology) -> Watch {
        Watch { topology, later: (Topology::Absent, 0) }
    }

    /// Takes a cycle; gives the topology when it is another one.
    pub fn update(&mut self, seen: Seen) -> Option<Topology> {
        let found = match self.topology.judge(seen) {
            Verdict::Stay => {
                self.later.1 = 0;
                return None;
            }
            Verdict::Now(found) => found,
            Verdict::Later(found) => {
                let cycles = if self.later.0 == found { self.later.1 + 1 } else { 1 };
                self.later = (found, cycles);
                if cycles < AWAY_CYCLES {
                    return None;
                }
                found
            }
        };
        *self = Watch::new(found);
        Some(found)
    }
}

/// How far the closing of a ring is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(super) enum Closing {
    /// There is nothing to close, or it cannot be closed.
    #[default]
    Idle,
    /// Every end sees the other line's telegrams.
    Settling,
    /// The ends are commanded to fast forward.
    Commanded,
    /// That failed: the ends are commanded back to loopback.
    Restoring,
    /// It is not tried again for a while.
    Refused,
}

/// What a cycle says about the closing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum ClosingEvent {
    /// Every end sees the other line's telegrams.
    Closable,
    /// Not every end does.
    Open,
    /// The ends have done what they were commanded.
    Done,
    /// They have not in time.
    Failed,
    /// The time of this state is over.
    Elapsed,
}

impl Closing {
    /// The state after `event`.
    pub const fn next(self, event: ClosingEvent) -> Closing {
        use Closing as C;
        use ClosingEvent as E;
        match (self, event) {
            (C::Idle, E::Closable) => C::Settling,
            (C::Settling, E::Open) => C::Idle,
            (C::Settling, E::Elapsed) => C::Commanded,
            (C::Commanded, E::Done) => C::Idle,
            (C::Commanded, E::Failed | E::Elapsed) => C::Restoring,
            (C::Restoring, E::Done | E::Failed | E::Elapsed) => C::Refused,
            (C::Refused, E::Open | E::Elapsed) => C::Idle,
            (state, _) => state,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    #[test]
    fn whole_table() {
        let mut table = String::from("P on 1, S on 2, P on 2, S on 1\n");
        for topology in Topology::ALL {
            writeln!(table, "{topology}").unwrap();
            for bits in 0..16 {
                let seen = Seen(bits);
                let shown = Route::ALL.map(|route| if seen.contains(route) { 'x' } else { '.' });
                let verdict = match topology.judge(seen) {
                    Verdict::Stay => continue,
                    Verdict::Now(next) => format!("at once {next}"),
                    Verdict::Later(next) => format!("later   {next}"),
                };
                writeln!(table, "    {} {verdict}", shown.into_iter().collect::<String>()).unwrap();
            }
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn closing_table() {
        use Closing::*;
        use ClosingEvent::*;
        let mut table = String::new();
        for state in [Idle, Settling, Commanded, Restoring, Refused] {
            for event in [Closable, Open, Done, Failed, Elapsed] {
                writeln!(
                    table,
                    "{:<10}{:<9}{:?}",
                    format!("{state:?}"),
                    format!("{event:?}"),
                    state.next(event)
                )
                .unwrap();
            }
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn one_lost_telegram_is_no_other_topology() {
        let seen = |routes: &[Route]| Seen::of(|route| routes.contains(&route));
        let mut watch = Watch::new(Topology::Ring);
        let lost = seen(&[Route::PRIMARY_TWO]);
        assert_eq!([(); 2].map(|()| watch.update(lost)), [None, None]);
        assert_eq!(watch.update(seen(&[Route::PRIMARY_TWO, Route::SECONDARY_ONE])), None);
        let defect = Topology::DefectRing { defective: Channel::Secondary };
        assert_eq!([(); 3].map(|()| watch.update(lost)), [None, None, Some(defect)]);
        let broken = seen(&[Route::PRIMARY_ONE, Route::SECONDARY_TWO]);
        assert_eq!(watch.update(broken), Some(Topology::BrokenRing));
        assert_eq!(watch.update(Seen::default()), None);
    }

    #[test]
    fn routes_that_a_topology_does_not_admit() {
        let refused = |topology: Topology| {
            Route::ALL.into_iter().filter(|&route| !topology.admits(route, false)).collect::<Vec<_>>()
        };
        assert_eq!(refused(Topology::LineOne), [Route::SECONDARY_ONE]);
        assert_eq!(refused(Topology::LineTwo), [Route::PRIMARY_TWO]);
        assert_eq!(refused(Topology::BrokenRing), [Route::PRIMARY_TWO, Route::SECONDARY_ONE]);
        assert!(refused(Topology::Ring).is_empty());
        for topology in Topology::ALL {
            for route in topology.routes() {
                assert!(topology.admits(*route, false));
            }
            assert!(Route::ALL.into_iter().all(|route| topology.admits(route, true)));
        }
    }
}
