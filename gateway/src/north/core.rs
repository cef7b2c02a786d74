//! What needs no socket: the adapter, the way to the motion device, and what is counted and told.

use std::net::SocketAddrV4;

use profile_cip::device::adapter::{Adapter, DEVICE_TIMEOUT};
use profile_cip::device::event::Event;
use profile_cip::device::motion_link::{MotionReply, MotionRequest, OpenParameters};
use profile_generic::time::{DurationNs, MonotonicTime};

use super::link::AdapterEnd;
use super::statistics::Statistics;
use crate::capture::recorder::Tap;
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
            self.note(&event);
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

    /// The answer to a datagram.
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
        let mut answer = [0; ANSWER_LEN_MAX];
        let len = self.adapter.handle_datagram(bytes, &mut answer)?;
        if let Some(tap) = &mut self.tap {
            let tos = self.adapter.config().qos.explicit << 2;
            tap.datagram(realtime_now(), self.address, from, tos, &answer[..len]);
        }
        Some((answer, len))
    }

    fn note(&mut self, event: &Event) {
        let statistics = &mut self.statistics;
        statistics.events += 1;
        match event {
            Event::MotionOpened { .. } => statistics.motion_opened += 1,
            Event::MotionClosed { .. } => statistics.motion_closed += 1,
            Event::MotionLost { .. } => statistics.motion_lost += 1,
            _ => {}
        }
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
        if let Some(on_event) = &mut self.on_event {
            on_event(event);
        }
    }
}

/// Whether a message of the motion device is the answer to a request.
const fn answers(reply: &MotionReply) -> bool {
    !matches!(reply, MotionReply::ConnectionLost { .. })
}
