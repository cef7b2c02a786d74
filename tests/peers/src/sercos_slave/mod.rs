//! A SERCOS III slave with a drive in it.
//!
//! A frame comes in at a port, the slave reads the MDTs, writes its fields into the ATs in place, and says by which port the
//! frame leaves. Nothing sleeps and nothing is random. What the standard's facts leave open is written as an assumption at the
//! head of the module that decides it.
//!
//! Assumptions of this module. An MDT or AT that comes a second time on the other channel in the same cycle is not worked on
//! again, but an AT is filled in both. Without the MST of a cycle nothing is put into its ATs. The topology address is that of
//! the P telegram where one comes, else that of the S telegram. A connection in error under an enabled drive raises C1D bit 12.
//! The slave does not take part in hot-plug; it reads the field and keeps it.

pub mod checks;
pub mod commands;
pub mod connections;
pub mod device;
pub mod drive;
pub mod idn;
pub mod parameters;
pub mod phases;
pub mod scaling;
pub mod service_channel;
pub mod settings;
pub mod telegram;
pub mod topology;

pub use connections::Consumer;
pub use device::{Refused, Write};
pub use idn::{Idn, Parameter};
pub use settings::{Connection, ScalingValues, Settings, SvcError};

use device::Device;
use phases::{Event, Phases};
use service_channel::{ServiceChannel, VALID};
use telegram::{
    Channel, DATA_START, FixedSlot, Header, HotPlug, Place, S_DEV_C1D, S_DEV_C2D, S_DEV_COMMAND,
    S_DEV_CONNECTION, S_DEV_PARAMETERIZATION, S_DEV_VALID, S_DEV_WARNING, get_u16, get_u32, put,
};
use topology::{Topology, Way};

/// A slave.
#[derive(Debug, Clone)]
pub struct SercosSlave {
    device: Device,
    svc: ServiceChannel,
    phases: Phases,
    topology: Topology,
    version: u32,
    address: [Option<u16>; 2],
    master_valid: bool,
    /// By number of the MDT: the channel and phase byte of the last one that was read.
    read: [Option<(Channel, u8)>; 4],
    mst: Option<u8>,
    last_mst: u64,
    hot_plug: Option<HotPlug>,
    bad_crc: u16,
}

impl SercosSlave {
    /// A slave that has just been powered up: NRT.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            svc: ServiceChannel::new(settings.handshake_delay),
            topology: Topology::new(settings.neighbour),
            device: Device::new(settings),
            phases: Phases::default(),
            version: 0,
            address: [None; 2],
            master_valid: false,
            read: [None; 4],
            mst: None,
            last_mst: 0,
            hot_plug: None,
            bad_crc: 0,
        }
    }

    /// A frame comes in at port 1 or 2. The answer is the port by which it leaves; none: it does not.
    pub fn pass(&mut self, now_ns: u64, port: u8, frame: &mut [u8]) -> Option<u8> {
        if !(1..=2).contains(&port) {
            return None;
        }
        self.device.now = self.device.now.max(now_ns);
        if self.device.settings.dead_from_ns.is_some_and(|from| now_ns >= from) {
            return None;
        }
        let header = match telegram::header(frame, self.device.settings.check_crc) {
            Ok(header) => header,
            Err(reject) => return self.foreign(port, frame, reject),
        };
        let way = self.topology.arrive(port, header);
        let hung = self.device.settings.hung_from_ns.is_some_and(|from| now_ns >= from);
        if !hung {
            match way {
                Way::Out if header.at => self.at(header, frame),
                Way::Out => self.mdt(now_ns, header, frame),
                Way::Back => {
                    self.count(header, frame);
                }
                Way::Drop => {}
            }
        }
        self.topology.leave(port, header, way, self.phases.phase())
    }

    /// Another frame, or one with a wrong header: it is only forwarded.
    fn foreign(&mut self, port: u8, frame: &[u8], reject: telegram::Reject) -> Option<u8> {
        if reject == telegram::Reject::NotSercos {
            let next = topology::other(port);
            return self.neighbour(next).then_some(next);
        }
        self.bad_crc = self.bad_crc.saturating_add(1);
        self.device.table.set(Idn::s(1035), &[self.bad_crc.to_le_bytes(), [0, 0]].concat());
        let header = telegram::header(frame, false).ok()?;
        let way = self.topology.arrive(port, header);
        self.topology.leave(port, header, way, self.phases.phase())
    }

    fn neighbour(&self, port: u8) -> bool {
        let [one, two] = self.device.settings.neighbour;
        if port == 1 { one } else { two }
    }

    fn mdt(&mut self, now: u64, header: Header, frame: &[u8]) {
        let seen = (header.channel, header.phase_byte);
        let slot = usize::from(header.number & 3);
        let known = self.read.get(slot).copied().flatten();
        let twice =
            known.is_some_and(|(channel, byte)| channel != header.channel && byte == header.phase_byte);
        if twice && header.phase != 0 {
            self.read[slot] = None;
            return;
        }
        self.read[slot] = Some(seen);
        if header.number == 0 {
            self.new_cycle(now, header, frame);
        }
        let Some(phase) = self.phases.phase() else { return };
        if self.silent(header) || phase == 0 {
            return;
        }
        if phase < 3 {
            let Some(fixed) = self.slot() else { return };
            if fixed.telegram == header.number {
                self.device_control(get_u16(frame, fixed.dev));
                self.service(phase, frame, fixed.svc);
            }
            return;
        }
        let control = Place::from_offset_word(self.device.table.word(Idn::s(1009)));
        if control.telegram == header.number {
            self.device_control(get_u16(frame, control.index()));
        }
        let svc = Place::from_offset_word(self.device.table.word(Idn::s(1013)));
        if svc.telegram == header.number {
            self.service(phase, frame, svc.index());
        }
        if phase == 4 {
            self.device.connections.consume(header, frame, &mut self.device.table);
        }
        if header.number == 0 {
            self.hot_plug = HotPlug::read(frame).filter(|field| field.selection != 0).or(self.hot_plug);
        }
    }

    /// True while a switch is pending, or when the telegram is of another phase.
    fn silent(&self, header: Header) -> bool {
        let ignored = self.device.settings.ignore_switch_to == Some(header.phase);
        if header.cps && ignored {
            return false;
        }
        self.phases.pending().is_some() || header.cps || self.phases.phase() != Some(header.phase)
    }

    fn new_cycle(&mut self, now: u64, header: Header, frame: &[u8]) {
        self.lost(now);
        let before = self.phases.phase();
        (self.phases.ready_for_3, self.phases.ready_for_4) = (self.device.checked_3, self.device.checked_4);
        let event = self.phases.mst(now, header, &self.device.settings);
        self.event(event, before);
        self.warn();
        self.mst = Some(header.phase_byte);
        self.topology.new_cycle();
        let cycle = u64::from(self.device.table.unsigned(Idn::s(1002)).max(1));
        let gap = now.saturating_sub(self.last_mst);
        self.last_mst = now;
        match self.phases.phase() {
            Some(0) if !header.cps => {
                self.version = get_u32(frame, DATA_START).unwrap_or(0);
                self.topology.quiet_end = self.version & 1 << 22 != 0;
            }
            Some(4) if self.phases.pending().is_none() && !header.cps => {
                let cycles = u32::try_from((gap.saturating_add(cycle / 2) / cycle).max(1)).unwrap_or(1);
                let stuck = self.device.settings.stuck_new_data_from_ns.is_some_and(|from| now >= from);
                let no_counter = self.device.settings.no_counter;
                self.device.connections.new_cycle(cycles, stuck, no_counter);
                if self.device.connections.in_error() && self.device.drive.enabled() {
                    self.device.network_fault(phases::MDT_ERROR | 4);
                }
                self.flash(now);
                self.device.refresh();
            }
            _ => {}
        }
    }

    fn flash(&mut self, now: u64) {
        self.device.flash = 0;
        if let Some((from, bits)) = self.device.settings.flash_error
            && now >= from
        {
            self.device.settings.flash_error = None;
            self.device.flash = bits;
        }
    }

    fn event(&mut self, event: Event, before: Option<u8>) {
        match event {
            Event::None => {}
            Event::Pending(phase) => self.device.note(format!("switch to CP{phase} pending")),
            Event::Entered(phase) => {
                self.device.note(format!("CP{phase}"));
                self.topology.new_phase();
                self.master_valid = false;
                if phase == 0 {
                    self.topology.reset();
                    self.svc.reset();
                    self.address = [None; 2];
                } else {
                    self.svc.close();
                }
                self.device.entered(phase);
                self.device.warning = false;
                self.device.refresh();
            }
            Event::Fault(reason) => {
                self.device.phase = None;
                self.device.network_fault(reason);
                self.device.note(format!("NRT from {before:?}"));
                self.device.refresh();
            }
            Event::Silent => {
                self.device.phase = None;
                self.device.note(format!("NRT from {before:?} after a silence"));
                self.device.refresh();
            }
        }
    }

    /// Counts lost MST up to now.
    fn lost(&mut self, now: u64) {
        let before = self.phases.phase();
        let cycle = u64::from(self.device.table.unsigned(Idn::s(1002)));
        let allowed = self.device.table.unsigned(Idn::s(1003));
        let (more, event) = self.phases.tick(now, &self.device.settings, cycle, allowed);
        if more > 0 {
            let more = u16::try_from(more).unwrap_or(u16::MAX);
            let counted = self.device.table.word(Idn::s(1028)).saturating_add(more);
            self.device.table.set(Idn::s(1028), &counted.to_le_bytes());
        }
        self.warn();
        self.event(event, before);
    }

    /// More than half of the allowed MST are lost: a warning, until one comes.
    fn warn(&mut self) {
        let allowed = self.device.table.unsigned(Idn::s(1003));
        self.device.warning = self.phases.phase() >= Some(3) && self.phases.lost() > allowed / 2;
    }

    fn slot(&self) -> Option<FixedSlot> {
        self.address[0].or(self.address[1]).and_then(FixedSlot::new)
    }

    fn device_control(&mut self, word: Option<u16>) {
        let Some(word) = word else { return };
        self.device.table.set(Idn::s(1044), &word.to_le_bytes());
        self.master_valid |= word & telegram::C_DEV_MASTER_VALID != 0;
        self.topology.command(word, self.device.settings.stuck_topology);
    }

    fn service(&mut self, phase: u8, frame: &[u8], index: usize) {
        let (Some(control), Some(info)) = (get_u16(frame, index), get_u32(frame, index + 2)) else { return };
        let now = self.device.now;
        let stuck = self.device.settings.stuck_handshake_from_ns.is_some_and(|from| now >= from);
        self.svc.cycle(control, info.to_le_bytes(), phase >= 2, stuck, &mut self.device);
    }

    /// CP0: the counter of AT0 goes up by one.
    fn count(&mut self, header: Header, frame: &mut [u8]) -> u16 {
        if self.phases.phase() != Some(0) || self.silent(header) || !header.at || header.number != 0 {
            return 0;
        }
        let Some(counter) = get_u16(frame, DATA_START) else { return 0 };
        let next = counter & 0x8000 | (counter & 0x7FFF).wrapping_add(1) & 0x7FFF;
        put(frame, DATA_START, &next.to_le_bytes());
        counter & 0x01FF
    }

    fn at(&mut self, header: Header, frame: &mut [u8]) {
        let Some(phase) = self.phases.phase() else { return };
        if self.mst != Some(header.phase_byte) {
            return;
        }
        if phase == 0 {
            self.scan(header, frame);
            return;
        }
        if phase == 3 && self.phases.pending() == Some(4) {
            self.answer(header, frame, false);
            return;
        }
        if self.silent(header) {
            return;
        }
        if phase < 3 {
            let Some(fixed) = self.slot().filter(|slot| slot.telegram == header.number) else { return };
            if self.master_valid {
                self.put_service(frame, fixed.svc, true);
                self.put_status(frame, fixed.dev, true);
            }
            return;
        }
        self.answer(header, frame, true);
        let cp4 = phase == 4;
        self.device.connections.produce(header, frame, &mut self.device.table, cp4);
        if cp4 {
            self.device.connections.consume(header, frame, &mut self.device.table);
        }
    }

    /// CP0, on the way out: the own address goes to the word that the counter names.
    fn scan(&mut self, header: Header, frame: &mut [u8]) {
        let address = self.count(header, frame);
        if address == 0 || self.silent(header) {
            return;
        }
        self.address[header.channel.index()] = Some(address);
        let mut word = self.device.settings.address & 0x01FF;
        if self.version & 7 << 20 != 0 && self.device.settings.acknowledge_version {
            word |= 0x8000;
        }
        put(frame, DATA_START + 2 * usize::from(address), &word.to_le_bytes());
    }

    fn answer(&mut self, header: Header, frame: &mut [u8], valid: bool) {
        let svc = Place::from_offset_word(self.device.table.word(Idn::s(1014)));
        if svc.telegram == header.number {
            self.put_service(frame, svc.index(), valid);
        }
        let status = Place::from_offset_word(self.device.table.word(Idn::s(1011)));
        if status.telegram == header.number {
            self.put_status(frame, status.index(), valid);
        }
    }

    fn put_service(&self, frame: &mut [u8], index: usize, valid: bool) {
        let (mut status, info) = self.svc.answer();
        if !valid {
            status &= !VALID;
        }
        let [low, high] = status.to_le_bytes();
        put(frame, index, &[low, high, info[0], info[1], info[2], info[3]]);
    }

    fn put_status(&mut self, frame: &mut [u8], index: usize, valid: bool) {
        let mut word = self.device_status();
        if !valid {
            word &= !S_DEV_VALID;
        }
        self.device.table.set(Idn::s(1045), &word.to_le_bytes());
        put(frame, index, &word.to_le_bytes());
    }

    fn device_status(&self) -> u16 {
        let device = &self.device;
        let mut word = S_DEV_VALID | self.topology.status();
        for (set, bit) in [
            (device.warning, S_DEV_WARNING | S_DEV_C2D),
            (device.connections.in_error() && self.phases.phase() == Some(4), S_DEV_CONNECTION),
            (device.drive.errors | device.flash != 0, S_DEV_C1D),
            (device.commands.changed(), S_DEV_COMMAND),
            (device.parameterization, S_DEV_PARAMETERIZATION),
        ] {
            if set {
                word |= bit;
            }
        }
        word
    }

    /// Lets time pass: the drive moves, commands end, lost MST are counted.
    pub fn tick(&mut self, now_ns: u64) {
        self.device.now = self.device.now.max(now_ns);
        let now = self.device.now;
        self.lost(now);
        self.device.tick();
    }

    /// The communication phase; none in NRT.
    #[must_use]
    pub fn phase(&self) -> Option<u8> {
        self.phases.phase()
    }

    /// Where the motor stands, in revolutions, without polarity and modulo.
    #[must_use]
    pub fn position(&self) -> f64 {
        self.device.drive.position()
    }

    /// How fast the motor turns, in revolutions a second.
    #[must_use]
    pub fn velocity(&self) -> f64 {
        self.device.drive.velocity()
    }

    /// The torque in newton metres.
    #[must_use]
    pub fn torque(&self) -> f64 {
        self.device.drive.torque()
    }

    /// Is the torque on?
    #[must_use]
    pub fn enabled(&self) -> bool {
        self.device.drive.enabled()
    }

    /// Every parameter write that was accepted, in order.
    #[must_use]
    pub fn writes(&self) -> &[Write] {
        &self.device.writes
    }

    /// Every access that was refused, in order.
    #[must_use]
    pub fn refused(&self) -> &[Refused] {
        &self.device.refused
    }

    /// What has happened, in order.
    #[must_use]
    pub fn log(&self) -> &[String] {
        &self.device.log
    }

    /// The data of a parameter as they are now.
    #[must_use]
    pub fn data(&self, idn: Idn) -> Option<&[u8]> {
        self.device.table.get(idn).map(|parameter| parameter.data.as_slice())
    }

    /// The topology address that CP0 gave.
    #[must_use]
    pub fn topology_address(&self) -> Option<u16> {
        self.address[0].or(self.address[1])
    }

    /// The state of a consumer connection, by its instance.
    #[must_use]
    pub fn consumer(&self, instance: u32) -> Option<Consumer> {
        self.device.connections.state(instance)
    }

    /// The last hot-plug field that was not empty.
    #[must_use]
    pub fn hot_plug(&self) -> Option<HotPlug> {
        self.hot_plug
    }

    /// The port by which the last frame has left as well: a loop that forwards.
    #[must_use]
    pub fn copy_port(&self) -> Option<u8> {
        self.topology.copy()
    }

    /// Plugs or unplugs a neighbour.
    pub fn set_neighbour(&mut self, port: u8, up: bool) {
        if let Some(link) =
            usize::from(port).checked_sub(1).and_then(|i| self.device.settings.neighbour.get_mut(i))
        {
            *link = up;
            self.topology.set_link(port, up);
        }
    }

    /// Raises bits of S-0-0011.
    pub fn raise(&mut self, bits: u16) {
        self.device.drive.raise(bits);
        self.device.refresh();
    }

    /// The settings, to change them while the slave runs. Only what is looked at on the way takes effect.
    pub fn settings_mut(&mut self) -> &mut Settings {
        &mut self.device.settings
    }
}

#[cfg(test)]
mod rig;
#[cfg(test)]
mod tests;
