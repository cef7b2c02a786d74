//! The first contacts: what each controller did when it opened a connection, how it was answered, and how far it came.
//!
//! A start-up is recorded by itself, from the frames that the recorder sees, the events of the adapter and the notices of the
//! cycle. Connections and refused attempts have places of their own, and in each the peer with the most contacts makes room
//! first: neither a storm of refusals nor a peer that reconnects without end takes the place of another controller's contact.

mod files;
mod live;
mod record;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::net::Ipv4Addr;
use std::path::PathBuf;
use std::sync::Arc;

use profile_cip::device::event::Event;
use profile_cip::wire::ConnectionTriad;
use profile_cip::wire::status::{ConnectionStatus, GeneralStatus};
use profile_generic::state::DriveState;

pub use self::live::AttributeNames;
pub use self::record::{Contact, ContactEnd, Phase, PhaseReached, RefusedService};

use self::files::Files;
use self::live::Live;
use super::ring::{FrameRing, KeptFrame};
use crate::capture::Side;
use crate::decode::packet::{self, Packet};
use crate::engine::notice::Notice;
use crate::history::utc_nanos;
use crate::status::BoxStatus;
use crate::sys::clock::KernelTime;

/// Connections that are kept, and refused attempts; more where there are more devices.
const PLACES_MIN: usize = 10;

/// Different refusals of one peer that are kept.
const REFUSALS_OF_PEER_MAX: usize = 3;

/// Bytes of frames of a refused attempt: TCP segments of a session, a Forward_Open and its reply.
const REFUSED_LEN_MAX: usize = 16 * 1_024;

/// What ends a connection that was open when the gateway ended.
const UNSEEN: &str = "not seen: the gateway ended first";

/// Nanoseconds in a millisecond.
const MILLI: u64 = 1_000_000;

/// A device of the gateway, as far as contacts need it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ContactDevice {
    /// Its name.
    pub name: String,
    /// Where it listens.
    pub address: Ipv4Addr,
}

/// Something that the adapter of a device reports.
#[derive(Debug, Clone, Copy)]
pub(super) struct Happening {
    /// Place of the device in the configuration.
    pub device: usize,
    /// When.
    pub at: KernelTime,
    /// What.
    pub event: Event,
}

/// A contact with its frames.
#[derive(Debug, Default)]
struct Kept {
    contact: Contact,
    host: Option<Ipv4Addr>,
    frames: Vec<u8>,
    live: Option<Box<Live>>,
    /// The file of its frames, once they are there and no longer in memory.
    file: Option<PathBuf>,
    /// Something has changed that is not in the files.
    unsaved: bool,
}

/// The folder, what has changed with its frames, and the numbers of all that are kept.
pub(super) type Unsaved = (Files, Vec<(Contact, Vec<u8>)>, Vec<u64>);

/// All contacts.
#[derive(Debug)]
pub(super) struct Contacts {
    devices: Vec<ContactDevice>,
    /// Axes by name, and the device of each.
    axes: Vec<(String, usize)>,
    names: AttributeNames,
    places: usize,
    /// Bytes of frames for each contact.
    budget: usize,
    /// Oldest first.
    opened: VecDeque<Kept>,
    refused: VecDeque<Kept>,
    newest: u64,
    files: Option<Files>,
}

impl Contacts {
    /// No contacts, with room for frames of `memory` bytes; those of earlier runs come from `directory`.
    pub fn new(
        devices: Vec<ContactDevice>,
        axes: Vec<(String, usize)>,
        names: AttributeNames,
        memory: usize,
        directory: Option<PathBuf>,
    ) -> Self {
        let places = PLACES_MIN.max(devices.len());
        let (files, earlier) = directory.map(|path| Files::open(path, 2 * places)).unzip();
        let mut contacts = Self {
            devices,
            axes,
            names,
            places,
            budget: (memory / places).saturating_sub(REFUSED_LEN_MAX),
            opened: VecDeque::new(),
            refused: VecDeque::new(),
            newest: 0,
            files,
        };
        for (mut contact, file) in earlier.unwrap_or_default() {
            contact.end.get_or_insert_with(|| ContactEnd { after_ms: None, by: UNSEEN.to_owned() });
            contact.awaited.clear();
            contacts.newest = contacts.newest.max(contact.number);
            let host = contact.peer.parse().ok().map(|peer: std::net::SocketAddrV4| *peer.ip());
            let refused = contact.kind == REFUSED;
            contacts.keep(refused, Kept { contact, host, file, ..Kept::default() });
        }
        contacts
    }

    /// All contacts, newest first.
    pub fn list(&self) -> Vec<Contact> {
        let mut contacts: Vec<Contact> = self.all().map(|kept| kept.contact.clone()).collect();
        contacts.sort_by_key(|contact| std::cmp::Reverse(contact.number));
        contacts
    }

    /// The frames of a contact, and the file of them where they are no longer in memory.
    pub fn frames(&self, number: u64) -> Option<(Vec<u8>, Option<PathBuf>)> {
        let kept = self.all().find(|kept| kept.contact.number == number)?;
        Some((kept.frames.clone(), kept.file.clone()))
    }

    /// Takes what an adapter reports; `explicit` has the last frames of streams.
    pub fn take(&mut self, happening: &Happening, explicit: &FrameRing) {
        let Happening { device, at, event } = *happening;
        match event {
            Event::MotionOpened { triad, originator, .. } => {
                self.open(happening, "motion", triad, *originator.ip(), originator.port(), explicit);
            }
            Event::AssemblyOpened { role, triad, originator, .. } => {
                self.open(happening, role.name(), triad, *originator.ip(), originator.port(), explicit);
            }
            Event::MotionClosed { triad }
            | Event::MotionLost { triad, .. }
            | Event::AssemblyClosed { triad, .. }
            | Event::AssemblyLost { triad, .. } => {
                let meant = |kept: &&mut Kept| {
                    kept.live.as_ref().is_some_and(|live| live.device == device && live.triad == triad)
                };
                if let Some(kept) = self.opened.iter_mut().rev().find(meant) {
                    kept.end(Some(at), event.to_string());
                }
            }
            Event::OpenRefused { triad, originator, general, extended, .. } => {
                let reason = refusal(general, extended, &event);
                self.refuse(happening, triad, originator, reason, explicit);
            }
            _ => {}
        }
    }

    /// Takes what the cycle reports: requests that it refused, and an axis that runs.
    pub fn note(&mut self, now: KernelTime, notice: &Notice) {
        let place = notice.axis().map(usize::from);
        let Some((name, device)) = place.and_then(|place| self.axes.get(place)).cloned() else { return };
        let runs = matches!(notice, Notice::State { to: DriveState::Operating, .. });
        let what = match notice {
            Notice::State { .. } if runs => "",
            Notice::Refused { .. } => "axis control request",
            Notice::NotEqual { .. } | Notice::NotKept { .. } | Notice::DriveRefuses { .. } => "attribute",
            Notice::Scaling { .. } => "scaling attributes",
            _ => return,
        };
        for kept in &mut self.opened {
            let Kept { contact, live: Some(live), .. } = kept else { continue };
            if live.device != device || !live.is_watched() {
                continue;
            }
            if runs {
                live.runs(contact, now);
            } else {
                live.refused_request(contact, now, format!("{what} of axis {name}"), notice.to_string());
            }
            kept.unsaved = true;
        }
    }

    /// Looks at the published status: what is awaited now.
    pub fn look(&mut self, status: &BoxStatus) {
        let axes = &self.axes;
        for kept in &mut self.opened {
            let Kept { contact, live: Some(live), .. } = kept else { continue };
            let mut awaited = Vec::new();
            if live.is_watched() {
                awaited.extend(live.next_phase(contact).map(|phase| phase.awaited().to_owned()));
                for ((name, device), axis) in axes.iter().zip(status.configured_axes()) {
                    if *device != live.device {
                        continue;
                    }
                    awaited.extend(axis.wait.map(|wait| format!("axis {name} {wait}")));
                    awaited.extend(axis.fault.map(|fault| format!("axis {name} has the fault {fault}")));
                }
            }
            contact.awaited = awaited;
        }
    }

    /// Takes a frame.
    pub fn frame(&mut self, at: KernelTime, side: Side, frame: &[u8]) {
        let live = |kept: &Kept| kept.live.is_some();
        if side != Side::North || !(self.opened.iter().any(live) || self.refused.iter().any(live)) {
            return;
        }
        let packet = packet::parse(frame);
        let budget = self.budget;
        let limits = [(&mut self.opened, budget), (&mut self.refused, REFUSED_LEN_MAX)];
        for (contacts, budget) in limits {
            contacts.iter_mut().for_each(|kept| kept.frame(at, frame, &packet, budget));
        }
    }

    /// Whether something has changed that is not in the files.
    pub fn is_unsaved(&self) -> bool {
        self.files.is_some() && self.all().any(Kept::is_worth_saving)
    }

    /// What is to be written, and the numbers of the contacts that are still kept.
    pub fn take_unsaved(&mut self) -> Option<Unsaved> {
        let files = self.files.clone()?;
        let mut changed = Vec::new();
        for kept in self.opened.iter_mut().chain(&mut self.refused) {
            if kept.is_worth_saving() {
                kept.unsaved = false;
                changed.push((kept.contact.clone(), kept.frames.clone()));
            }
        }
        let numbers = self.all().map(|kept| kept.contact.number).collect();
        Some((files, changed, numbers))
    }

    /// The gateway ends: nobody will see how the connections end.
    pub fn close(&mut self) {
        for kept in &mut self.opened {
            kept.end(None, UNSEEN.to_owned());
        }
    }

    fn all(&self) -> impl Iterator<Item = &Kept> {
        self.opened.iter().chain(&self.refused)
    }

    /// Begins a contact.
    fn open(
        &mut self,
        happening: &Happening,
        kind: &str,
        triad: ConnectionTriad,
        host: Ipv4Addr,
        port: u16,
        explicit: &FrameRing,
    ) {
        let Happening { device, at, event } = *happening;
        let Some(named) = self.devices.get(device).cloned() else { return };
        let live =
            Live::new(device, named.address, host, triad, at, kind == "motion", Arc::clone(&self.names));
        let mut contact = self.contact(at, &named.name, kind, event.to_string());
        contact.peer = std::net::SocketAddrV4::new(host, port).to_string();
        contact.phases.push(PhaseReached { phase: Phase::ForwardOpen, after_ms: 0 });
        let budget = self.budget;
        self.begin(
            false,
            Kept { contact, host: Some(host), live: Some(Box::new(live)), ..Kept::default() },
            budget,
            explicit,
        );
    }

    /// Begins a contact that was refused, or counts it as one more of its kind.
    fn refuse(
        &mut self,
        happening: &Happening,
        triad: ConnectionTriad,
        originator: std::net::SocketAddrV4,
        reason: String,
        explicit: &FrameRing,
    ) {
        let Happening { device, at, .. } = *happening;
        let Some(named) = self.devices.get(device).cloned() else { return };
        let (host, time) = (*originator.ip(), utc_of(at));
        let alike = |kept: &&mut Kept| {
            let refused = kept.contact.refused.first().is_some_and(|refused| refused.reason == reason);
            kept.host == Some(host) && kept.contact.device == named.name && refused
        };
        if let Some(known) = self.refused.iter_mut().find(alike) {
            known.contact.attempts = known.contact.attempts.saturating_add(1);
            known.contact.last = time;
            known.contact.refused[0].count = known.contact.attempts;
            known.unsaved = true;
            return;
        }
        let mut contact = self.contact(at, &named.name, REFUSED, triad.to_string());
        contact.peer = originator.to_string();
        contact.refused.push(RefusedService {
            after_ms: 0,
            service: "Forward_Open".to_owned(),
            reason,
            count: 1,
        });
        contact.end = Some(ContactEnd { after_ms: Some(0), by: "refused".to_owned() });
        let live = Live::refused(device, named.address, host, triad, at);
        let kept = Kept { contact, host: Some(host), live: Some(Box::new(live)), ..Kept::default() };
        self.begin(true, kept, REFUSED_LEN_MAX, explicit);
    }

    fn contact(&mut self, at: KernelTime, device: &str, kind: &str, connection: String) -> Contact {
        self.newest += 1;
        let time = utc_of(at);
        Contact {
            number: self.newest,
            last: time.clone(),
            time,
            device: device.to_owned(),
            kind: kind.to_owned(),
            connection,
            attempts: 1,
            ..Contact::default()
        }
    }

    /// Gives a new contact what the streams of its peer had before, and a place.
    fn begin(&mut self, refused: bool, mut kept: Kept, budget: usize, explicit: &FrameRing) {
        kept.unsaved = true;
        kept.frames.reserve_exact(budget);
        for KeptFrame { at, data, .. } in super::ring::frames(&explicit.copy()) {
            kept.frame(at, data, &packet::parse(data), budget);
        }
        self.keep(refused, kept);
    }

    fn keep(&mut self, refused: bool, kept: Kept) {
        let places = self.places;
        let contacts = if refused { &mut self.refused } else { &mut self.opened };
        let host = kept.host;
        contacts.push_back(kept);
        let of_host = contacts.iter().filter(|known| known.host == host).count();
        if refused
            && of_host > REFUSALS_OF_PEER_MAX
            && let Some(oldest) = contacts.iter().position(|known| known.host == host)
        {
            contacts.remove(oldest);
        }
        if contacts.len() > places {
            let place = place_to_free(contacts);
            contacts.remove(place);
        }
    }
}

/// What a refused contact has as its kind.
const REFUSED: &str = "refused";

/// The contact that makes room: the oldest of the peer that has the most, but not its last one that came to synchronous
/// operation, and not the newest of all.
fn place_to_free(contacts: &VecDeque<Kept>) -> usize {
    let count = |host: Option<Ipv4Addr>| contacts.iter().filter(|kept| kept.host == host).count();
    // Of peers with as many, the one whose oldest contact is the oldest.
    let most = contacts.iter().map(|kept| count(kept.host)).max().unwrap_or(0);
    let host = contacts.iter().find(|kept| count(kept.host) == most).and_then(|kept| kept.host);
    let is_good = |kept: &Kept| kept.contact.phases.iter().any(|one| one.phase == Phase::Synchronous);
    let last_good = contacts.iter().rposition(|kept| kept.host == host && is_good(kept));
    let newest = contacts.len().saturating_sub(1);
    let free = |place: &usize| contacts[*place].host == host && Some(*place) != last_good && *place != newest;
    (0..contacts.len()).find(free).unwrap_or(0)
}

/// The reason of a refused Forward_Open in words.
fn refusal(general: u8, extended: u16, event: &Event) -> String {
    let name = ConnectionStatus(extended).name().map(|name| format!(", {extended:#06x} ({name})"));
    let mut text =
        format!("{}{}", GeneralStatus(general), name.unwrap_or_else(|| format!(", {extended:#06x}")));
    if let Event::OpenRefused { expected, found, .. } = event {
        match (expected, found) {
            (Some(expected), Some(found)) => {
                text.push_str(&format!(": expected {expected:#x}, found {found:#x}"));
            }
            (None, Some(found)) => text.push_str(&format!(": found {found:#x}")),
            _ => {}
        }
    }
    text
}

impl Kept {
    /// Takes a frame if it is one of this contact.
    fn frame(&mut self, at: KernelTime, frame: &[u8], packet: &Packet<'_>, budget: usize) {
        let Self { contact, frames, live: Some(live), unsaved, .. } = self else { return };
        if live.is_over(at) {
            if contact.end.is_some() {
                self.live = None;
            }
            return;
        }
        *unsaved |= live.frame(contact, frames, (at, frame), packet, budget);
    }

    fn end(&mut self, at: Option<KernelTime>, by: String) {
        let Self { contact, live: Some(live), .. } = self else { return };
        if contact.end.is_some() {
            return;
        }
        contact.end = Some(ContactEnd { after_ms: at.map(|at| live.after_ms(at)), by });
        contact.awaited.clear();
        // A reply that is on its way still belongs to it.
        live.finish(at.unwrap_or(KernelTime(0)));
        self.unsaved = true;
    }

    /// Whether the files lack something that is not going to change in a moment.
    fn is_worth_saving(&self) -> bool {
        self.unsaved && self.live.as_ref().is_none_or(|live| live.frames_are_complete())
    }
}

fn utc_of(at: KernelTime) -> String {
    utc_nanos(at.0)
}
