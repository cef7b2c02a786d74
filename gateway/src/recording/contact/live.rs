//! A contact whose frames are still taken, or whose start-up is still watched.

use std::collections::BTreeMap;
use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;

use profile_cip::wire::ConnectionTriad;

use super::super::ring::{append, kept_len};
use super::MILLI;
use super::record::{Contact, Phase, PhaseReached, RefusedService};
use crate::capture::Side;
use crate::decode::dialogue::{Dialogue, Shown, carries_service};
use crate::decode::packet::Packet;
use crate::sys::clock::KernelTime;

/// How long the frames of a start-up are kept.
const FRAMES_FOR: u64 = 10_000 * MILLI;

/// For how long before the connection was opened they are kept: the session, and what the controller read.
const FRAMES_BEFORE: u64 = 10_000 * MILLI;

/// How long frames are taken after the end or the refusal, whose answer may come last.
const FRAMES_AFTER: u64 = 500 * MILLI;

/// Part of the room that cyclic updates leave to services and streams: one fourth.
const KEPT_FREE: usize = 4;

/// Different refusals in a contact.
const REFUSALS_MAX: usize = 64;

/// What is followed of a contact.
pub(super) struct Live {
    pub device: usize,
    pub triad: ConnectionTriad,
    address: Ipv4Addr,
    host: Ipv4Addr,
    opened: KernelTime,
    frames_until: KernelTime,
    /// The start-up is watched until an axis runs.
    watched: bool,
    /// A CIP Motion connection has all phases.
    motion: bool,
    ended: bool,
    /// The last time that was seen.
    now: KernelTime,
    dialogue: Dialogue,
    names: AttributeNames,
}

/// Names of attributes of the Motion Device Axis Object.
pub type AttributeNames = Arc<BTreeMap<u16, String>>;

impl fmt::Debug for Live {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Live")
            .field("triad", &self.triad)
            .field("opened", &self.opened)
            .finish_non_exhaustive()
    }
}

impl Live {
    pub fn new(
        device: usize,
        address: Ipv4Addr,
        host: Ipv4Addr,
        triad: ConnectionTriad,
        opened: KernelTime,
        motion: bool,
        names: AttributeNames,
    ) -> Self {
        Self {
            device,
            triad,
            address,
            host,
            opened,
            frames_until: KernelTime(opened.0.saturating_add(FRAMES_FOR)),
            watched: true,
            motion,
            ended: false,
            now: opened,
            dialogue: Dialogue::default(),
            names,
        }
    }

    /// One of a refused attempt: only its frames are wanted.
    pub fn refused(
        device: usize,
        address: Ipv4Addr,
        host: Ipv4Addr,
        triad: ConnectionTriad,
        at: KernelTime,
    ) -> Self {
        let mut live = Self::new(device, address, host, triad, at, false, AttributeNames::default());
        live.finish(at);
        live
    }

    /// Whether its start-up is still watched.
    pub const fn is_watched(&self) -> bool {
        self.watched
    }

    /// The connection has ended.
    pub fn finish(&mut self, at: KernelTime) {
        self.frames_until = self.frames_until.min(KernelTime(at.0.saturating_add(FRAMES_AFTER)));
        self.watched = false;
        self.ended = true;
    }

    /// Whether nothing more is wanted at this time.
    pub fn is_over(&mut self, at: KernelTime) -> bool {
        self.now = self.now.max(at);
        !self.watched && self.frames_until < at
    }

    /// Whether all frames that are wanted have come.
    pub fn frames_are_complete(&self) -> bool {
        self.ended || self.frames_until < self.now
    }

    pub fn after_ms(&self, at: KernelTime) -> u64 {
        at.0.saturating_sub(self.opened.0) / MILLI
    }

    /// The phase that comes next.
    pub fn next_phase(&self, contact: &Contact) -> Option<Phase> {
        let phases = if self.motion { &Phase::ALL[..] } else { &[Phase::FirstEnable] };
        phases.iter().copied().find(|phase| contact.phases.iter().all(|one| one.phase != *phase))
    }

    /// Takes a frame if it is one of this contact; whether its files have to be written again.
    pub fn frame(
        &mut self,
        contact: &mut Contact,
        frames: &mut Vec<u8>,
        (at, frame): (KernelTime, &[u8]),
        packet: &Packet<'_>,
        budget: usize,
    ) -> bool {
        if !self.is_of(packet) || at.0.saturating_add(FRAMES_BEFORE) < self.opened.0 {
            return false;
        }
        let mut appended = false;
        if at <= self.frames_until {
            let cyclic = matches!(packet, Packet::Udp { payload, .. } if !carries_service(payload));
            let room = if cyclic { budget - budget / KEPT_FREE } else { budget };
            if frames.len() + kept_len(frame) <= room {
                append(frames, at, Side::North, frame);
                contact.frames += 1;
                appended = true;
            } else {
                contact.frames_left_out += 1;
            }
        }
        if self.ended {
            return appended;
        }
        let Self { dialogue, opened, watched, names, .. } = self;
        let after_ms = at.0.saturating_sub(opened.0) / MILLI;
        let mut changed = false;
        dialogue.packet(packet, |shown| changed |= take(contact, after_ms, watched, shown, names));
        changed
    }

    /// Notes a refusal.
    pub fn refused_request(&self, contact: &mut Contact, at: KernelTime, service: String, reason: String) {
        refuse(contact, self.after_ms(at), service, reason);
    }

    /// An axis of the device runs.
    pub fn runs(&mut self, contact: &mut Contact, at: KernelTime) {
        let after_ms = self.after_ms(at);
        reach(contact, after_ms, &mut self.watched, Phase::FirstEnable);
    }

    fn is_of(&self, packet: &Packet<'_>) -> bool {
        let ends = |from: &SocketAddrV4, to: &SocketAddrV4| {
            let ends = (*from.ip(), *to.ip());
            // Cyclic data to controllers can be multicast.
            ends == (self.host, self.address)
                || ends == (self.address, self.host)
                || (ends.0 == self.address && ends.1.is_multicast())
        };
        match packet {
            Packet::Udp { from, to, .. } => ends(from, to),
            Packet::Tcp(segment) => ends(&segment.from, &segment.to),
            _ => false,
        }
    }
}

/// Takes what a frame shows; whether the contact has changed.
fn take(
    contact: &mut Contact,
    after_ms: u64,
    watched: &mut bool,
    shown: Shown,
    names: &AttributeNames,
) -> bool {
    let phase = match shown {
        Shown::Answer { mut service, attribute, refusal: Some(reason), .. } => {
            if let Some(id) = attribute {
                service.push_str(&format!(", attribute {id}"));
                if let Some(name) = names.get(&id) {
                    service.push_str(&format!(" ({name})"));
                }
            }
            refuse(contact, after_ms, service, reason);
            return true;
        }
        Shown::Answer { configures: true, .. } => Phase::Configuration,
        Shown::Answer { .. } => return false,
        Shown::GroupSync => Phase::GroupSync,
        Shown::Synchronous => Phase::Synchronous,
        Shown::Running => Phase::FirstEnable,
    };
    reach(contact, after_ms, watched, phase)
}

fn reach(contact: &mut Contact, after_ms: u64, watched: &mut bool, phase: Phase) -> bool {
    if contact.phases.iter().any(|one| one.phase == phase) {
        return false;
    }
    contact.phases.push(PhaseReached { phase, after_ms });
    if phase == Phase::FirstEnable {
        *watched = false;
        contact.awaited.clear();
    }
    true
}

fn refuse(contact: &mut Contact, after_ms: u64, service: String, reason: String) {
    let alike = |known: &&mut RefusedService| known.service == service && known.reason == reason;
    if let Some(known) = contact.refused.iter_mut().find(alike) {
        known.count = known.count.saturating_add(1);
    } else if contact.refused.len() < REFUSALS_MAX {
        contact.refused.push(RefusedService { after_ms, service, reason, count: 1 });
    } else {
        contact.refused_left_out = contact.refused_left_out.saturating_add(1);
    }
}
