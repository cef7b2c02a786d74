//! What needs no socket: the adapter, the way to the motion device, and what is counted and told.

use std::net::SocketAddrV4;
use std::sync::Arc;

use profile_cip::device::adapter::{Adapter, DEVICE_TIMEOUT};
use profile_cip::device::event::Event;
use profile_cip::device::hosts::Hosts;
use profile_cip::device::motion_link::{AssemblyRole, MotionReply, MotionRequest, OpenParameters};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::link::AdapterEnd;
use super::statistics::Statistics;
use crate::capture::recorder::Tap;
use crate::line_limit::{LineKind, LineLimit, Peer};
use crate::sys::clock::realtime_now;
use crate::sys::gate::Admitted;

/// Longest answer to a datagram.
const ANSWER_LEN_MAX: usize = 256;

/// How often the motion device's replies are looked for while it owes one: the resolution of the runtime's
/// timers.
///
/// The cycle thread does not wake the server, because that would be a system call in its cycle, into a runtime
/// whose locks it would have to wait for. A reply is late by a millisecond, which no explicit message minds.
const POLL_AWAITING: DurationNs = DurationNs::from_millis(1);

/// How often they are looked for otherwise: the loss of a connection comes unasked.
const POLL_IDLE: DurationNs = DurationNs::from_millis(20);

pub(super) type OnEvent = Box<dyn FnMut(&Event) + Send>;
pub(super) type OnOpen = Box<dyn FnMut(&OpenParameters) + Send>;
pub(super) type OnAdmit = Box<dyn FnMut(Option<Admitted>) + Send>;

/// The adapter and all that it is connected to but the sockets.
pub(super) struct Core {
    pub adapter: Adapter,
    pub link: AdapterEnd,
    pub tap: Option<Tap>,
    pub on_event: Option<OnEvent>,
    pub on_open: Option<OnOpen>,
    pub on_admit: Option<OnAdmit>,
    /// Hosts beside the controllers of the device that are served.
    pub tools: Hosts,
    /// How many lines peers can have written.
    pub limit: Arc<LineLimit>,
    /// Whose datagrams are let through now.
    admitted: Option<Admitted>,
    /// Where answers to datagrams come from.
    address: SocketAddrV4,
    /// A request for which the queue to the motion device had no room.
    held: Option<MotionRequest>,
    /// Replies the motion device owes.
    owed: u64,
    /// Until when they are worth waiting for.
    owed_until: MonotonicTime,
    poll_at: MonotonicTime,
    pub statistics: Statistics,
}

impl Core {
    pub fn new(
        adapter: Adapter,
        link: AdapterEnd,
        tap: Option<Tap>,
        address: SocketAddrV4,
        now: MonotonicTime,
    ) -> Self {
        Self {
            adapter,
            link,
            tap,
            on_event: None,
            on_open: None,
            on_admit: None,
            tools: Hosts::EVERYBODY,
            limit: Arc::default(),
            admitted: None,
            address,
            held: None,
            owed: 0,
            owed_until: now,
            poll_at: now,
            statistics: Statistics::default(),
        }
    }

    /// Everything that can be done at this moment without a socket.
    pub fn step(&mut self, now: MonotonicTime) {
        while let Some(reply) = self.link.reply() {
            self.statistics.motion_replies += 1;
            self.owed = self.owed.saturating_sub(u64::from(answers(&reply)));
            self.adapter.complete(now, &reply);
        }
        if self.adapter.wake_at().is_some_and(|at| at <= now) {
            self.adapter.handle_time(now);
        }
        self.admit();
        self.send_requests(now);
        self.link.tell_connections(self.adapter.explicit_connections());
        while let Some(event) = self.adapter.poll_event() {
            self.note(now, &event);
        }
        let waiting = self.held.is_some() || (self.owed > 0 && now < self.owed_until);
        self.poll_at = now + if waiting { POLL_AWAITING } else { POLL_IDLE };
    }

    /// When [`Core::step`] has something to do at the latest.
    pub fn wake_at(&self) -> MonotonicTime {
        self.adapter.wake_at().map_or(self.poll_at, |at| at.min(self.poll_at))
    }

    /// Has the I/O socket let through what belongs to the motion connection, from before the motion device is asked to take
    /// it until it has ended.
    fn admit(&mut self) {
        let admitted = self.adapter.motion_connection().map(|open| Admitted {
            address: open.originator,
            port: self.link.owner_port(open.o_to_t_id),
            connection_id: open.o_to_t_id,
        });
        if admitted != self.admitted {
            self.admitted = admitted;
            if let Some(on_admit) = &mut self.on_admit {
                on_admit(admitted);
            }
        }
    }

    /// Hands the adapter's requests to the motion device, as far as there is room.
    fn send_requests(&mut self, now: MonotonicTime) {
        let mut was_held = self.held.is_some();
        while let Some(request) = self.held.take().or_else(|| self.adapter.poll_motion()) {
            if let (MotionRequest::Open(open), Some(on_open)) = (&request, &mut self.on_open) {
                on_open(open);
            }
            if let Err(request) = self.link.request(request) {
                self.statistics.motion_requests_held += u64::from(!was_held);
                self.held = Some(request);
                return;
            }
            was_held = false;
            self.statistics.motion_requests += 1;
            self.owed += 1;
            self.owed_until = now + DEVICE_TIMEOUT;
        }
    }

    /// Whether this host is served at all.
    pub fn admits(&self, peer: SocketAddrV4) -> bool {
        let host = *peer.ip();
        self.tools.has_v4(host) || self.adapter.config().controllers.has_v4(host)
    }

    /// The answer to a datagram; none to a host that is not served.
    pub fn datagram(
        &mut self,
        from: SocketAddrV4,
        to: SocketAddrV4,
        bytes: &[u8],
    ) -> Option<([u8; ANSWER_LEN_MAX], usize)> {
        self.statistics.datagrams += 1;
        if let Some(tap) = &mut self.tap {
            tap.datagram(realtime_now(), from, to, 0, bytes);
        }
        if !self.admits(from) {
            return None;
        }
        let mut answer = [0; ANSWER_LEN_MAX];
        let len = self.adapter.handle_datagram(bytes, &mut answer)?;
        if let Some(tap) = &mut self.tap {
            let tos = self.adapter.config().qos.explicit << 2;
            tap.datagram(realtime_now(), self.address, from, tos, &answer[..len]);
        }
        Some((answer, len))
    }

    fn note(&mut self, now: MonotonicTime, event: &Event) {
        let statistics = &mut self.statistics;
        statistics.events += 1;
        match event {
            Event::MotionOpened { .. } => statistics.motion_opened += 1,
            Event::MotionClosed { .. } => statistics.motion_closed += 1,
            Event::MotionLost { .. } => statistics.motion_lost += 1,
            _ => {}
        }
        if limited(event).is_none_or(|(kind, peer)| self.limit.admits(now, kind, peer)) {
            match event {
                Event::MotionLost { .. }
                | Event::ExplicitLost { .. }
                | Event::SessionLost { .. }
                | Event::DeviceSilent { .. }
                | Event::OpenRefused { .. }
                | Event::Reset { .. } => {
                    tracing::warn!("{event}");
                }
                _ => tracing::info!("{event}"),
            }
        }
        if let Some(on_event) = &mut self.on_event {
            on_event(event);
        }
    }
}

/// What the line of an event counts as; `None` for one that is always written: what changes the gateway is.
fn limited(event: &Event) -> Option<(LineKind, Peer)> {
    Some(match event {
        Event::OpenRefused { originator, .. } => (LineKind::Open, host(*originator)),
        Event::ExplicitLost { originator: peer, .. } | Event::SessionLost { peer, .. } => {
            (LineKind::Lost, host(*peer))
        }
        Event::DeviceSilent { .. } => (LineKind::Silent, Peer::Unknown),
        // Of an owner each matters; anybody may only listen.
        Event::AssemblyOpened { role, .. }
        | Event::AssemblyClosed { role, .. }
        | Event::AssemblyLost { role, .. }
            if *role == AssemblyRole::ExclusiveOwner =>
        {
            return None;
        }
        Event::AssemblyOpened { originator, .. } => (LineKind::Open, host(*originator)),
        Event::AssemblyLost { originator, .. } => (LineKind::Lost, host(*originator)),
        Event::AssemblyClosed { .. } => (LineKind::Lost, Peer::Unknown),
        // As fast as the motion device takes them, and each matters.
        Event::MotionOpened { .. }
        | Event::MotionClosed { .. }
        | Event::MotionLost { .. }
        | Event::Reset { .. }
        | Event::QosChanged(_)
        | Event::InactivityTimeoutChanged { .. }
        | Event::TimeSyncSet(_) => return None,
    })
}

/// A peer, whatever port it comes from.
pub(super) fn host(address: SocketAddrV4) -> Peer {
    Peer::Host((*address.ip()).into())
}

/// Whether a message of the motion device is the answer to a request.
const fn answers(reply: &MotionReply) -> bool {
    !matches!(reply, MotionReply::ConnectionLost { .. })
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use profile_cip::device::motion_link::ConnectionTriad;

    use super::*;
    use crate::history::lines_of;
    use crate::north::{motion_link, test_adapter_config};

    fn core(limit: &Arc<LineLimit>) -> Core {
        let adapter = Adapter::new(test_adapter_config(Ipv4Addr::LOCALHOST)).unwrap();
        let (link, _device) = motion_link();
        let address = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 44_818);
        let core = Core::new(adapter, link, None, address, MonotonicTime::ZERO);
        Core { limit: Arc::clone(limit), ..core }
    }

    fn refused(number: u16) -> Event {
        let originator = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 7), number);
        let triad = ConnectionTriad { connection_serial: number, originator_vendor: 1, originator_serial: 2 };
        Event::OpenRefused { triad, originator, general: 1, extended: 0x0106, found: None, expected: None }
    }

    #[test]
    fn ten_thousand_refused_forward_opens_in_a_minute_are_few_lines_with_their_count() {
        let limit = Arc::new(LineLimit::default());
        let mut core = core(&limit);
        let at = |number: u16| MonotonicTime::ZERO + DurationNs::from_millis(i64::from(number) * 5);
        let lines = lines_of(|| {
            for number in 0..10_000 {
                core.note(at(number), &refused(number));
                limit.report(at(number), &[]);
            }
            limit.report(at(15_000), &[]);
        });
        assert_eq!(core.statistics.events, 10_000);
        let texts: Vec<&str> = lines.iter().map(|line| line.text.as_str()).collect();
        assert_eq!(lines.len(), 5, "{texts:?}");
        assert!(
            texts[..4].iter().all(|text| text.contains("192.0.2.7") && text.contains("0x0106")),
            "{texts:?}"
        );
        let count = "Forward_Open refused: more such lines were left out in the last minute peer=192.0.2.7 count=9996";
        assert_eq!((texts[4], lines[4].level.as_str()), (count, "warn"));
    }

    #[test]
    fn what_changes_the_gateway_is_always_written() {
        let mut core = core(&Arc::default());
        let lines = lines_of(|| {
            for seconds in 0..50 {
                core.note(MonotonicTime::ZERO, &Event::InactivityTimeoutChanged { seconds });
            }
        });
        assert_eq!(lines.len(), 50);
        assert_eq!(
            (lines[49].kind.as_str(), lines[49].text.as_str()),
            ("ethernet-ip", "session inactivity time-out 49 s")
        );
    }
}
