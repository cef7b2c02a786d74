//! What is odd about a recording: gaps, time that goes back, interfaces and gateways that do not belong to it.

use std::collections::{HashMap, HashSet};
use std::net::Ipv4Addr;

use profile_cip::wire::class1::Class1Datagram;

use crate::capture::Side;
use crate::capture::reader::Frame;

/// A silence of all interfaces that is worth a note: many times the longest cycle.
const SILENCE: u64 = 1_000_000_000;

/// Frames of different interfaces may be recorded in another order than they came.
const DISORDER: u64 = 20_000_000;

/// A jump of the sequence count beyond this is no loss but another beginning.
const LOST_MAX: u16 = 1000;

/// Connections of which the sequence count is followed.
const CONNECTIONS_MAX: usize = 64;

#[derive(Debug, Default)]
pub(super) struct Oddities {
    /// Latest time of a frame.
    latest: Option<u64>,
    /// Interfaces that are left out.
    left_out: HashSet<u32>,
    /// Devices that are left out.
    strangers: HashSet<Ipv4Addr>,
    /// The device that stands for the first of the configuration.
    first_device: Option<Ipv4Addr>,
    /// The section whose interfaces these are.
    section: u64,
    /// Interface of each side of the gateway.
    own: HashMap<usize, u32>,
    /// Sequence counts by connection and ends.
    counts: HashMap<(u32, Ipv4Addr, Ipv4Addr), u16>,
}

impl Oddities {
    /// What is to be said of the time of a frame.
    pub fn of(&mut self, frame: &Frame<'_>) -> Option<String> {
        let at = frame.at?.0;
        let latest = self.latest.replace(at)?;
        if at.saturating_add(DISORDER) < latest {
            return Some(format!("time goes back by {} s", seconds(latest - at)));
        }
        self.latest = Some(at.max(latest));
        (at > latest.saturating_add(SILENCE))
            .then(|| format!("nothing was recorded for {} s", seconds(at - latest)))
    }

    /// Forgets the interfaces of the section before: their numbers begin anew.
    pub fn enter(&mut self, frame: &Frame<'_>) {
        if std::mem::replace(&mut self.section, frame.section) != frame.section {
            self.own.clear();
            self.left_out.clear();
        }
    }

    /// Whether a frame is of a second gateway in the same section; the first one of an interface says so.
    pub fn other_gateway(&mut self, frame: &Frame<'_>) -> Option<Option<String>> {
        let side = frame.interface_name.and_then(Side::of_name)?;
        let own = *self.own.entry(side.index()).or_insert(frame.interface);
        (own != frame.interface).then(|| {
            self.left_out(frame, || {
                let name = side.name();
                format!(
                    "interface {} is `{name}` of another gateway: all its frames are left out",
                    frame.interface
                )
            })
        })
    }

    /// Why the frames of an interface are left out, at the first of them.
    pub fn left_out(&mut self, frame: &Frame<'_>, why: impl FnOnce() -> String) -> Option<String> {
        self.left_out.insert(frame.interface).then(why)
    }

    /// The same for a device.
    pub fn left_out_of(&mut self, device: Ipv4Addr, why: impl FnOnce() -> String) -> Option<String> {
        self.strangers.insert(device).then(why)
    }

    /// A device of the configuration is in the recording: no other one stands for it.
    pub fn is_there(&mut self, device: Ipv4Addr) {
        self.first_device = Some(device);
    }

    /// The device whose updates have come, or that stands for one of the configuration.
    pub const fn first_device(&self) -> Option<Ipv4Addr> {
        self.first_device
    }

    /// Whether a device that the configuration does not have is the first such one.
    pub fn stands_for_the_first(&mut self, device: Ipv4Addr) -> bool {
        *self.first_device.get_or_insert(device) == device
    }

    /// What is to be said of the sequence count of an update.
    pub fn sequence(
        &mut self,
        datagram: &Class1Datagram<'_>,
        (from, to): (Ipv4Addr, Ipv4Addr),
    ) -> Option<String> {
        if self.counts.len() >= CONNECTIONS_MAX {
            self.counts.clear();
        }
        let before = self.counts.insert((datagram.connection_id, from, to), datagram.sequence_count)?;
        let lost = datagram.sequence_count.wrapping_sub(before).checked_sub(2)? + 1;
        (lost <= LOST_MAX).then(|| format!("{lost} updates {from} -> {to} are missing before this one"))
    }
}

/// Nanoseconds as seconds with three decimals.
fn seconds(nanoseconds: u64) -> String {
    format!("{}.{:03}", nanoseconds / 1_000_000_000, nanoseconds / 1_000_000 % 1000)
}
