//! The two ports of a slave: which telegrams it takes in, and where they go.
//!
//! ```text
//!                  link lost on the P side           loopback, S telegrams are forwarded
//! fast forward ----------------------------------->  to the P side
//!      ^       ---- link lost on the S side -------> loopback, P telegrams are forwarded
//!      |                                             to the S side
//!      +---- C-DEV commands it and both links are there ----+
//! ```
//!
//! P telegrams come in on one port and S telegrams on the other, whatever the topology: the first telegram of CP0
//! says which. In loopback only the port away from the lost link is active; of what comes in on the other one the
//! slave reports the channel and does nothing else. In CP0 the topology follows the links, so that the scan finds
//! what there is; from CP1 on the slave stays in loopback until it is commanded otherwise. A command for
//! which a link is missing is acknowledged and not followed: S-DEV goes on showing what is.

use profile_generic::time::{DurationNs, MonotonicTime};

use super::{Forward, Port};
use crate::wire::device_control::{DeviceControl, Topology};
use crate::wire::device_status::{DeviceStatus, InactivePort};
use crate::wire::header::Channel;

/// Cycles for which a telegram on the inactive port is reported.
const HEARD_CYCLES: i64 = 2;

/// The ports of a slave.
#[derive(Debug)]
pub struct Ports {
    links: [bool; 2],
    /// Port on which P telegrams come in; S telegrams come in on the other one.
    primary: Option<Port>,
    topology: Topology,
    /// The topology follows the links: CP0.
    follows: bool,
    toggle: bool,
    /// Cycles which it takes to carry a topology command out.
    delay: u8,
    /// C-DEV of a command under way, and the cycles it still takes.
    pending: Option<(DeviceControl, u8)>,
    /// What came in last on the inactive port.
    heard: Option<(Channel, MonotonicTime)>,
}

impl Ports {
    /// Unconnected ports in NRT.
    pub(super) const fn new() -> Ports {
        Ports {
            links: [false; 2],
            primary: None,
            topology: Topology::StoreAndForward,
            follows: false,
            toggle: false,
            delay: 0,
            pending: None,
            heard: None,
        }
    }

    /// Sets the cycles which it takes to carry a topology command out; by default it is done before the telegram has passed.
    pub(super) fn set_delay(&mut self, cycles: u8) {
        self.delay = cycles;
    }

    /// How telegrams are passed on.
    #[must_use]
    pub fn topology(&self) -> Topology {
        self.topology
    }

    /// Whether a port has a link.
    #[must_use]
    pub fn has_link(&self, port: Port) -> bool {
        self.links[port.index()]
    }

    /// The port on which telegrams of a channel come in first; the other one sees the way back. `None` in NRT.
    #[must_use]
    pub fn entry(&self, channel: Channel) -> Option<Port> {
        match channel {
            Channel::Primary => self.primary,
            Channel::Secondary => self.primary.map(Port::other),
        }
    }

    /// The port at which the line ends; `None` in fast forward and in NRT.
    fn inactive(&self) -> Option<Port> {
        match self.topology {
            Topology::LoopbackForwardPrimary => self.primary.map(Port::other),
            Topology::LoopbackForwardSecondary => self.primary,
            Topology::FastForward | Topology::StoreAndForward => None,
        }
    }

    /// Whether telegrams that come in on this port are not for this slave.
    pub(super) fn is_inactive(&self, port: Port) -> bool {
        self.inactive() == Some(port)
    }

    /// A telegram has come in on the inactive port.
    pub(super) fn hear(&mut self, now: MonotonicTime, channel: Channel) {
        self.heard = Some((channel, now));
    }

    pub(super) fn set_link(&mut self, port: Port, up: bool) {
        self.links[port.index()] = up;
        if self.topology == Topology::StoreAndForward {
            return;
        }
        if !up {
            self.turn_round(port);
        } else if self.follows {
            self.follow();
        } else if let Some(active) = self.inactive().map(Port::other).filter(|&active| !self.has_link(active))
        {
            self.turn_round(active);
        }
    }

    /// Loopback on the side away from `lost`, unless that side is lost as well.
    fn turn_round(&mut self, lost: Port) {
        let Some(primary) = self.primary else { return };
        if self.has_link(lost.other()) {
            self.topology = if lost == primary {
                Topology::LoopbackForwardSecondary
            } else {
                Topology::LoopbackForwardPrimary
            };
        }
    }

    fn follow(&mut self) {
        self.topology = Topology::FastForward;
        for port in Port::ALL {
            if !self.has_link(port) {
                self.turn_round(port);
            }
        }
    }

    /// CP0 begins with a telegram of `channel` on `port`.
    pub(super) fn start(&mut self, port: Port, channel: Channel) {
        self.primary = Some(match channel {
            Channel::Primary => port,
            Channel::Secondary => port.other(),
        });
        self.heard = None;
        self.toggle = false;
        self.follows = true;
        self.follow();
    }

    /// Hot plug: the slave becomes the end of the line whose telegrams of `channel` come in on `port`.
    pub(super) fn join(&mut self, port: Port, channel: Channel) {
        self.start(port, channel);
        self.follows = false;
        self.topology = Topology::loopback(channel);
    }

    /// CP0 is over: the topology is the one of the scan until a link is lost or C-DEV commands another one.
    pub(super) fn hold(&mut self) {
        self.follows = false;
    }

    /// NRT: frames are passed on as by a switch. A slave that ends a line and leaves while the telegrams go on,
    /// `heard`, turns them round as before: the slaves in front of it would be cut off.
    pub(super) fn stop(&mut self, heard: bool) {
        self.follows = false;
        self.toggle = false;
        if !heard || self.inactive().is_none() {
            *self = Ports { links: self.links, delay: self.delay, ..Ports::new() };
        }
    }

    /// Whether telegrams are turned round here.
    pub(super) fn is_end(&self) -> bool {
        self.inactive().is_some()
    }

    /// The handshake bit starts anew with each phase.
    pub(super) fn reset_toggle(&mut self) {
        self.toggle = false;
    }

    /// C-DEV of this cycle. A word without Master valid is no command.
    pub(super) fn command(&mut self, control: DeviceControl) {
        let toggle = control.contains(DeviceControl::TOPOLOGY_CHANGE);
        let meant = control.contains(DeviceControl::MASTER_VALID) && toggle != self.toggle;
        if !meant || self.follows || self.topology == Topology::StoreAndForward {
            self.pending = None;
            return;
        }
        let left = match self.pending {
            Some((same, left)) if same == control => left,
            _ => self.delay,
        };
        self.pending = left.checked_sub(1).map(|left| (control, left));
        if left > 0 {
            return;
        }
        self.toggle = toggle;
        let [primary, secondary] = [Channel::Primary, Channel::Secondary]
            .map(|channel| self.entry(channel).is_some_and(|port| self.has_link(port)));
        let possible = match control.topology() {
            Topology::FastForward => primary && secondary,
            Topology::LoopbackForwardPrimary => primary,
            Topology::LoopbackForwardSecondary => secondary,
            Topology::StoreAndForward => false,
        };
        if possible {
            self.topology = control.topology();
        }
        self.heard = None;
    }

    /// Topology, handshake and inactive port in S-DEV.
    pub(super) fn status(&self, mst: MonotonicTime, cycle: DurationNs) -> DeviceStatus {
        let mut status = DeviceStatus::empty().with_topology(self.topology);
        status.set(DeviceStatus::TOPOLOGY_CHANGE, self.toggle);
        let Some(inactive) = self.inactive() else { return status };
        let heard = self.heard.filter(|&(_, at)| mst.since(at) <= cycle * HEARD_CYCLES);
        status.with_inactive_port(match heard {
            _ if !self.has_link(inactive) => InactivePort::NoLink,
            None => InactivePort::Link,
            Some((channel, _)) => InactivePort::hearing(channel),
        })
    }

    /// Where a frame of the unified communication channel goes.
    pub(super) fn pass(&self, port: Port) -> Forward {
        if self.has_link(port.other()) { Forward::Through } else { Forward::Nowhere }
    }

    /// Where a SERCOS telegram goes that came in on `port`; without a channel it is broken. `forwards`: the end of a
    /// line sends telegrams on.
    pub(super) fn forward(&self, port: Port, channel: Option<Channel>, forwards: bool) -> Forward {
        let (Some(inactive), loopback) = (self.inactive(), self.topology) else { return self.pass(port) };
        if inactive == port {
            return Forward::Nowhere;
        }
        let forwarded = match loopback {
            Topology::LoopbackForwardPrimary => Channel::Primary,
            _ => Channel::Secondary,
        };
        // Also without a link: of a cable's two wires the other one may be whole.
        if forwards && channel == Some(forwarded) { Forward::BackAndThrough } else { Forward::Back }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    fn ports(links: [bool; 2], topology: Topology) -> Ports {
        Ports { links, primary: Some(Port::One), topology, ..Ports::new() }
    }

    fn command(topology: Topology) -> DeviceControl {
        (DeviceControl::MASTER_VALID | DeviceControl::TOPOLOGY_CHANGE).with_topology(topology)
    }

    /// Port 1 is the P side.
    #[test]
    fn whole_table() {
        use Topology::*;
        type Act = fn(&mut Ports);
        let events: [(&str, Act); 10] = [
            ("P side lost", |p| p.set_link(Port::One, false)),
            ("S side lost", |p| p.set_link(Port::Two, false)),
            ("P side back", |p| p.set_link(Port::One, true)),
            ("S side back", |p| p.set_link(Port::Two, true)),
            ("command fast forward", |p| p.command(command(FastForward))),
            ("command loopback P", |p| p.command(command(LoopbackForwardPrimary))),
            ("command loopback S", |p| p.command(command(LoopbackForwardSecondary))),
            ("CP0 by P on port 1", |p| p.start(Port::One, Channel::Primary)),
            ("NRT, telegrams stop", |p| p.stop(false)),
            ("NRT, telegrams go on", |p| p.stop(true)),
        ];
        let mut table = String::new();
        for topology in [StoreAndForward, FastForward, LoopbackForwardPrimary, LoopbackForwardSecondary] {
            for links in [[true, true], [true, false], [false, true]] {
                let link = |up: bool| if up { "link" } else { "none" };
                writeln!(table, "{topology}, P side {}, S side {}", link(links[0]), link(links[1])).unwrap();
                for (name, event) in &events {
                    let mut ports = ports(links, topology);
                    if topology == StoreAndForward {
                        ports.stop(false);
                    }
                    event(&mut ports);
                    writeln!(table, "    {name:<22} {}", ports.topology()).unwrap();
                }
            }
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn where_telegrams_go() {
        use Topology::*;
        let mut table = String::new();
        for topology in [StoreAndForward, FastForward, LoopbackForwardPrimary, LoopbackForwardSecondary] {
            for links in [[true, true], [true, false], [false, true]] {
                let ports = ports(links, topology);
                for port in Port::ALL.into_iter().filter(|port| links[port.index()]) {
                    write!(table, "{topology}, links {links:?}, from {port}:").unwrap();
                    for channel in [Some(Channel::Primary), Some(Channel::Secondary), None] {
                        write!(table, " {:?}", ports.forward(port, channel, true)).unwrap();
                    }
                    writeln!(
                        table,
                        ", not at the end {:?}",
                        ports.forward(port, Some(Channel::Primary), false)
                    )
                    .unwrap();
                }
            }
        }
        insta::assert_snapshot!(table);
    }

    #[test]
    fn the_first_telegram_says_which_side_is_which() {
        let entry = |port, channel| {
            let mut ports = ports([true; 2], Topology::StoreAndForward);
            ports.start(port, channel);
            [Channel::Primary, Channel::Secondary].map(|channel| ports.entry(channel).unwrap())
        };
        assert_eq!(entry(Port::One, Channel::Primary), [Port::One, Port::Two]);
        assert_eq!(entry(Port::Two, Channel::Secondary), [Port::One, Port::Two]);
        assert_eq!(entry(Port::Two, Channel::Primary), [Port::Two, Port::One]);
        assert_eq!(Ports::new().entry(Channel::Primary), None);
    }

    #[test]
    fn the_inactive_port_is_reported_for_two_cycles() {
        let cycle = DurationNs::from_millis(1);
        let at = |ms: u64| MonotonicTime(1_000_000 * ms);
        let mut ports = ports([true, false], Topology::LoopbackForwardPrimary);
        let shown = |ports: &Ports, ms| ports.status(at(ms), cycle).inactive_port();
        ports.hear(at(10), Channel::Secondary);
        assert_eq!(shown(&ports, 10), InactivePort::NoLink);
        ports.set_link(Port::Two, true);
        assert_eq!(ports.topology(), Topology::LoopbackForwardPrimary, "it waits for the command");
        assert_eq!(
            [10, 12, 13].map(|ms| shown(&ports, ms)),
            [InactivePort::SecondaryTelegram, InactivePort::SecondaryTelegram, InactivePort::Link]
        );
        ports.hear(at(14), Channel::Primary);
        assert_eq!(shown(&ports, 14), InactivePort::PrimaryTelegram);
        ports.command(command(Topology::FastForward));
        assert_eq!(ports.status(at(14), cycle), DeviceStatus::TOPOLOGY_CHANGE);
    }
}
