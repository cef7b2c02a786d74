//! The telegrams of the next cycle.

use core::ops::Range;

use profile_generic::time::SystemTime;

use super::event::SlaveId;
use super::isolation::Isolation;
use super::layout::CyclicLayout;
use super::network::Network;
use super::scan::{self, Scan};
use super::station::{End, Presence, Station};
use crate::wire::cp0::{self, AtRepr, MdtRepr, SequenceCounter};
use crate::wire::cp12;
use crate::wire::device_control::DeviceControl;
use crate::wire::extended::{EXTENDED_LEN, EXTENDED_OFFSET, Extended};
use crate::wire::header::{Channel, Kind, Phase, PhaseField, TELEGRAMS_MAX};
use crate::wire::hot_plug::HotPlug;
use crate::wire::layout::DEVICE_WORD_LEN;
use crate::wire::svc::SVC_LEN;
use profile_generic::wire::put_u16;

/// Telegram and offsets of a slave's service channel and device word.
#[derive(Clone, Copy)]
pub(super) struct Slot {
    pub svc: (u8, usize),
    pub device: (u8, usize),
}

/// Where a slave's part is in the telegrams of `kind`.
pub(super) fn slot(phase: Phase, layout: &CyclicLayout, index: usize, kind: Kind) -> Option<Slot> {
    if phase < Phase::CP3 {
        let place = cp12::place(SlaveId::from_index(index).topology_address())?;
        return Some(Slot { svc: (place.telegram, place.svc), device: (place.telegram, place.device) });
    }
    let places = layout.slaves.get(index)?.as_ref()?;
    let (svc, device) = match kind {
        Kind::Mdt => (places.svc_mdt, places.control),
        Kind::At => (places.svc_at, places.status),
    };
    let pair = |offset: crate::wire::layout::Offset| (offset.telegram, usize::from(offset.offset));
    Some(Slot { svc: pair(svc), device: pair(device) })
}

impl Network {
    /// Builds the telegrams of the next cycle; `switching` is the phase announced with CPS, `hot_plug` the fields of CP4.
    pub(super) fn build(
        &mut self,
        switching: Option<Phase>,
        scan: &Scan,
        hot_plug: Option<[HotPlug; 2]>,
        search: &Isolation,
    ) {
        let phase = self.stations.phase;
        // It is that of this cycle, also where it is not sent.
        let now = self.time.now.take();
        let header = PhaseField::new(switching.is_some(), self.cycle_count, switching.unwrap_or(phase));
        self.frames.begin(header);
        match phase {
            Phase::CP0 => self.build_scan(scan.start_two()),
            Phase::CP1 | Phase::CP2 => {
                let telegrams = usize::from(self.config.setup_telegrams());
                let lengths = core::array::from_fn(|number| if number < telegrams { cp12::LEN } else { 0 });
                self.build_telegrams([lengths; 2], None, None, search);
            }
            _ => {
                let used = self.config.system_time && switching.is_none();
                let extended = used.then(|| self.time.field(now, self.cycle_count));
                let lengths = [self.layout.mdt_len, self.layout.at_len].map(|len| len.map(usize::from));
                self.build_telegrams(lengths, extended, hot_plug, search);
            }
        }
        self.cycle_count = (self.cycle_count + 1) & 7;
        self.journal.statistics.cycles += 1;
    }

    fn build_scan(&mut self, start_two: u16) {
        let mdt = MdtRepr { version: self.config.communication_version(), ..MdtRepr::default() };
        let emit = |data: &mut [u8]| {
            // The length is the one of the telegram.
            let _ = mdt.emit(data);
        };
        self.frames.add(Kind::Mdt, 0, cp0::MDT_LEN, emit, |_| {});
        let empty = |data: &mut [u8]| {
            let _ = AtRepr::empty(SequenceCounter::START_PRIMARY).emit(data);
        };
        let counter = scan::secondary_counter(start_two);
        self.frames.add(Kind::At, 0, cp0::AT_LEN, empty, |data| put_u16(data, 0, counter.0));
    }

    /// Builds MDTs and ATs of these lengths.
    fn build_telegrams(
        &mut self,
        [mdt, at]: [[usize; TELEGRAMS_MAX]; 2],
        extended: Option<Extended>,
        hot_plug: Option<[HotPlug; 2]>,
        search: &Isolation,
    ) {
        let (layout, phase) = (&self.layout, self.stations.phase);
        let ring = self.redundancy.is_closed();
        let used = |lengths: [usize; TELEGRAMS_MAX]| (0u8..).zip(lengths).filter(|&(_, len)| len > 0);
        for (number, len) in used(mdt) {
            self.frames.add(Kind::Mdt, number, len, |_| {}, |_| {});
        }
        // Each slave is visited once, whatever the number of telegrams.
        let mut mdts = self.frames.mdts();
        if let (Some(extended), Some(data)) = (extended, &mut mdts[0]) {
            let field = data.get_mut(EXTENDED_OFFSET..EXTENDED_OFFSET + EXTENDED_LEN);
            let _ = field.map(|field| extended.emit(field));
        }
        for (index, station) in self.stations.iter_mut().enumerate() {
            if let Some(slot) = slot(phase, layout, index, Kind::Mdt) {
                fill_station(&mut mdts, slot, station, ring, station.is_addressed(phase));
            }
            if phase == Phase::CP4 && station.presence != Presence::Joining && station.is_addressed(phase) {
                fill_connections(&mut mdts, layout, index, station);
            }
        }
        if let (Some([primary, _]), Some(data)) = (hot_plug, &mut mdts[0]) {
            // MDT0 of CP4 begins with the field.
            let _ = primary.emit(data);
        }
        self.frames.copy_mdts();
        if let Some([_, secondary]) = hot_plug {
            self.frames.edit_mdt(Channel::Secondary, 0, |data| {
                let _ = secondary.emit(data);
            });
        }
        search.build_questions(self);
        for (number, len) in used(at) {
            self.frames.add(Kind::At, number, len, |_| {}, |_| {});
        }
    }

    /// Gives a slave another C-DEV in the MDTs of one channel.
    pub(super) fn write_control(&mut self, channel: Channel, index: usize, control: DeviceControl) {
        let Some(slot) = slot(self.stations.phase, &self.layout, index, Kind::Mdt) else { return };
        self.frames.edit_mdt(channel, slot.device.0, |data| {
            if data.len() >= slot.device.1 + DEVICE_WORD_LEN {
                put_u16(data, slot.device.1, control.bits());
            }
        });
    }
}

/// The system time as it is sent in the extended field.
#[derive(Debug, Default)]
pub(super) struct TimeField {
    /// At the start of the next cycle, where it is known.
    pub now: Option<SystemTime>,
    /// The time sent, latched for eight cycles.
    latched: Option<SystemTime>,
    /// Changes with each new time.
    toggle: bool,
}

impl TimeField {
    /// A cycle was built and not sent: that of this count is built once more, with another time if it begins the eight.
    pub fn take_back(&mut self, cycle_count: u8) {
        self.toggle ^= cycle_count == 0 && self.latched.is_some();
    }

    /// The extended field with the fragment of the system time that belongs to this cycle: seconds and nanoseconds
    /// in four halves, each sent in two cycles, latched for all eight. Without a time for the first of them all eight say that there
    /// is none.
    fn field(&mut self, now: Option<SystemTime>, cycle_count: u8) -> Extended {
        if cycle_count == 0 {
            self.latched = now;
            self.toggle ^= now.is_some();
        }
        let toggle = if self.toggle { Extended::TIME_TOGGLE } else { 0 };
        let Some(SystemTime(nanos)) = self.latched else {
            return Extended { word: toggle, time_fragment: 0 };
        };
        let seconds = u32::try_from(nanos / 1_000_000_000 % (1 << 32)).unwrap_or(u32::MAX);
        let nanos = u32::try_from(nanos % 1_000_000_000).unwrap_or(0);
        let word = if cycle_count < 4 { seconds } else { nanos };
        let [a, b, c, d] = word.to_le_bytes();
        let half = if cycle_count & 2 == 0 { [c, d] } else { [a, b] };
        Extended { word: Extended::TIME_VALID | toggle, time_fragment: u16::from_le_bytes(half) }
    }
}

/// Writes a slave's service channel and C-DEV into the MDT that has them. One that is not addressed is told nothing but
/// that its topology is to stay as it is.
fn fill_station(mdts: &mut Mdts<'_>, slot: Slot, station: &Station, ring: bool, addressed: bool) {
    if addressed && let Some(bytes) = part(mdts, slot.svc.0, slot.svc.1..slot.svc.1 + SVC_LEN) {
        let _ = station.channel.outgoing().emit(bytes);
    }
    if let Some(bytes) = part(mdts, slot.device.0, slot.device.1..slot.device.1 + DEVICE_WORD_LEN) {
        let mut control = station.link.command;
        control.set(DeviceControl::MASTER_VALID, addressed);
        control.set(DeviceControl::RING_CLOSED, ring && addressed);
        put_u16(bytes, 0, control.bits());
    }
}

/// Writes what a slave consumes.
fn fill_connections(mdts: &mut Mdts<'_>, layout: &CyclicLayout, index: usize, station: &mut Station) {
    let Some(Some(places)) = layout.slaves.get(index) else { return };
    for (connection, end) in station.connections.iter().zip(&mut station.ends) {
        let End::Producer(producer) = end else { continue };
        let place = places.connections.iter().find(|place| place.instance == connection.instance);
        let range = place.map(|place| (place.at.telegram, place.at.range(usize::from(place.len))));
        if let Some(bytes) = range.and_then(|(telegram, range)| part(mdts, telegram, range)) {
            producer.emit(bytes);
        }
    }
}

/// The data fields of the MDTs by number.
type Mdts<'a> = [Option<&'a mut [u8]>; TELEGRAMS_MAX];

/// A part of an MDT.
fn part<'a>(mdts: &'a mut Mdts<'_>, telegram: u8, range: Range<usize>) -> Option<&'a mut [u8]> {
    mdts.get_mut(usize::from(telegram))?.as_mut()?.get_mut(range)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn system_time_is_latched_for_eight_cycles_and_said_to_be_missing_where_it_is() {
        let mut time = TimeField::default();
        let mut round = |first: Option<u64>| {
            let mut fields = Vec::new();
            for cycle in 0..8 {
                // Those of the later cycles do not count.
                let now = if cycle == 0 { first.map(SystemTime) } else { Some(SystemTime(1)) };
                fields.push(time.field(now, cycle));
            }
            assert!(fields.iter().all(|field| field.word == fields[0].word));
            let halves: Vec<_> = fields.iter().map(|field| field.time_fragment).collect();
            (fields[0].word, halves)
        };
        let (valid, toggle) = (Extended::TIME_VALID, Extended::TIME_TOGGLE);
        let halves = vec![0x1234, 0x1234, 0x5678, 0x5678, 0x0ABC, 0x0ABC, 0xDEF0, 0xDEF0];
        assert_eq!(round(Some(0x1234_5678 * 1_000_000_000 + 0x0ABC_DEF0)), (valid | toggle, halves));
        assert_eq!(round(Some(0)), (valid, vec![0; 8]));
        assert_eq!(round(None), (0, vec![0; 8]));
        assert_eq!(round(Some(7)), (valid | toggle, vec![0, 0, 0, 0, 0, 0, 7, 7]));
        assert_eq!(round(None), (toggle, vec![0; 8]), "the toggle waits for the next time");
        // The first cycle of eight is built and not sent: its time was never on the wire.
        time.field(Some(SystemTime(7)), 0);
        time.take_back(0);
        assert_eq!(time.field(Some(SystemTime(8)), 0).word, valid);
        time.take_back(1);
        assert_eq!(time.field(None, 1).word, valid);
    }
}
