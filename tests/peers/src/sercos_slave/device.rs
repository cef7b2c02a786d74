//! The device behind the service channel: what is read and written there, what commands do, and the diagnostics.
//!
//! Assumptions. An element that is there cannot be written, but for the data: error x004h. A write to a parameter that a
//! consumer connection carries is error 700Ah in CP4. A list with numbers that a connection cannot carry, or a setup with the
//! wrong direction for a fixed connection, is error 7008h. S-0-0216 copies S-0-0217 to S-0-0254 and changes nothing else.
//! S-0-0262 does nothing. S-0-0390 on an error is C00F00xxh, xx the number of the lowest bit of S-0-0011.

use super::checks;
use super::commands::Commands;
use super::connections::{self, Connections};
use super::drive::Drive;
use super::idn::{Idn, Parameter, Table};
use super::parameters;
use super::service_channel::{Element, Store, code};
use super::settings::Settings;

/// The most entries a log keeps.
const LOG_MOST: usize = 20_000;

/// A parameter write that was accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Write {
    /// The number as text: "S-0-0036" or "S-0-1050.1.6".
    pub idn: String,
    /// The element, 7 for the data.
    pub element: u8,
    /// The bytes; a list without its head.
    pub bytes: Vec<u8>,
}

/// An access that was refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// The number as text.
    pub idn: String,
    /// The element; 1 is the opening.
    pub element: u8,
    /// True for a write or an opening.
    pub write: bool,
    /// The bytes that were to be written.
    pub bytes: Vec<u8>,
    /// The error code.
    pub code: u16,
}

/// Parameters, commands, connections and the drive.
#[derive(Debug, Clone)]
pub struct Device {
    /// The settings.
    pub settings: Settings,
    /// The parameters.
    pub table: Table,
    /// The procedure commands.
    pub commands: Commands,
    /// The connections as they run.
    pub connections: Connections,
    /// The drive.
    pub drive: Drive,
    /// The phase; none in NRT.
    pub phase: Option<u8>,
    /// The last time that was told.
    pub now: u64,
    /// S-0-0127 was carried out.
    pub checked_3: bool,
    /// S-0-0128 was carried out.
    pub checked_4: bool,
    /// S-0-0014.
    pub interface: u16,
    /// More than half of the allowed MST are lost.
    pub warning: bool,
    /// The parameterization level is active.
    pub parameterization: bool,
    /// Bits of S-0-0011 in this cycle only.
    pub flash: u16,
    /// Accepted writes.
    pub writes: Vec<Write>,
    /// Refused accesses.
    pub refused: Vec<Refused>,
    /// What has happened.
    pub log: Vec<String>,
    check: Option<(u32, bool)>,
}

impl Device {
    /// A device at power-up.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let table = parameters::table(&settings);
        Self {
            drive: Drive::new(&table, &settings),
            commands: Commands::new(&settings),
            connections: Connections::default(),
            table,
            settings,
            phase: None,
            now: 0,
            checked_3: false,
            checked_4: false,
            interface: 0,
            warning: false,
            parameterization: false,
            flash: 0,
            writes: Vec::new(),
            refused: Vec::new(),
            log: Vec::new(),
            check: None,
        }
    }

    /// Notes a line.
    pub fn note(&mut self, text: String) {
        if self.log.len() < LOG_MOST {
            self.log.push(format!("{} us: {text}", self.now / 1000));
        }
    }

    /// The network has failed: C1D bit 12, and the reason in S-0-0014.
    pub fn network_fault(&mut self, reason: u16) {
        self.interface = reason;
        self.drive.raise(super::drive::C1D_COMMUNICATION);
        self.note(format!("communication fault, S-0-0014 = {reason:04X}h"));
    }

    /// Lets time pass.
    pub fn tick(&mut self) {
        if let Some((at, bits)) = self.settings.error_at
            && self.now >= at
        {
            self.settings.error_at = None;
            self.drive.raise(bits);
        }
        for idn in self.commands.due(self.now) {
            self.execute(idn);
        }
        let cp4 = self.phase == Some(4);
        self.drive.tick(self.now, &mut self.table, &self.settings, cp4);
        if let Some(well) = self.drive.homed()
            && self.commands.status(Idn::s(148)) == super::commands::RUNNING
        {
            let well = well && !self.settings.failing_commands.contains(&Idn::s(148));
            self.commands.finish(Idn::s(148), well);
            self.table.set(Idn::s(403), &[u8::from(well), 0]);
        }
        if self.drive.no_mode {
            self.interface |= super::phases::NO_MODE;
        }
        self.refresh();
    }

    /// Brings the diagnostics up to date.
    pub fn refresh(&mut self) {
        let bits = self.drive.errors | self.flash;
        self.table.set(Idn::s(11), &bits.to_le_bytes());
        let interface = self.settings.interface_status.unwrap_or(self.interface);
        self.table.set(Idn::s(14), &interface.to_le_bytes());
        let homed = self.table.word(Idn::s(403)) & 1;
        let status = self.drive.status(&self.settings, self.flash) | homed << 5;
        self.table.set(Idn::s(135), &status.to_le_bytes());
        let (number, text) = self.diagnosis(bits);
        self.table.set(Idn::s(390), &number.to_le_bytes());
        self.table.set(Idn::s(95), text.as_bytes());
    }

    fn diagnosis(&self, bits: u16) -> (u32, &'static str) {
        if bits != 0 && !self.settings.no_diagnostic_number {
            let own = self.settings.diagnostic_number.unwrap_or(0xC00F_0000 | bits.trailing_zeros());
            return (own, "class 1 diagnostic");
        }
        if self.warning {
            return (0xC30E_4001, "MST lost");
        }
        if let Some((_, failed)) = self.check {
            return if failed {
                (0xC30C_0101, "invalid parameter")
            } else {
                (0xC30C_0100, "transition check")
            };
        }
        match self.phase {
            None => (0xC30A_0008, "NRT"),
            Some(4) => (0xC30A_0040, "CP4"),
            Some(0) => (0xC30A_0000, "CP0"),
            Some(1) => (0xC30A_0001, "CP1"),
            Some(2) => (0xC30A_0002, "CP2"),
            Some(_) => (0xC30A_0003, "CP3"),
        }
    }

    /// A phase has begun.
    pub fn entered(&mut self, phase: u8) {
        self.phase = Some(phase);
        match phase {
            0 => {
                self.commands.clear();
                self.check = None;
                self.table.set(Idn::s(1044), &[0, 0]);
            }
            2 => {
                self.checked_3 = false;
                // What was written in an earlier start does not count.
                for block in [1002, 1003, 1009, 1010, 1011, 1012, 1013, 1014] {
                    self.invalidate(Idn::s(block));
                }
                for number in 0..u32::try_from(self.settings.connections.len().min(255)).unwrap_or(0) {
                    self.invalidate(Idn::se(1050, number, 3));
                }
            }
            3 => {
                self.checked_4 = false;
                self.connections = Connections::new(&self.table, &self.settings);
                self.drive.configure(&self.table, &self.settings);
            }
            _ => {}
        }
    }

    fn invalidate(&mut self, idn: Idn) {
        if let Some(parameter) = self.table.get_mut(idn) {
            parameter.valid = false;
        }
    }

    /// Carries a command out.
    fn execute(&mut self, idn: Idn) {
        let failing = self.settings.failing_commands.contains(&idn);
        let well = match idn.block() {
            127 => self.transition(21, failing),
            128 => self.transition(22, failing),
            99 => {
                let clean = !failing && self.drive.reset(self.settings.lasting_errors);
                if clean {
                    self.interface = 0;
                }
                clean
            }
            191 => {
                if !failing {
                    self.table.set(Idn::s(403), &[0, 0]);
                }
                !failing
            }
            216 => {
                let wanted = self.table.word(Idn::s(217));
                if !failing {
                    self.table.set(Idn::s(254), &wanted.to_le_bytes());
                }
                !failing
            }
            420 | 422 => {
                if !failing {
                    self.parameterization = idn.block() == 420;
                }
                !failing
            }
            _ => !failing,
        };
        self.commands.finish(idn, well);
        self.note(format!("{idn} {}", if well { "done" } else { "failed" }));
    }

    fn transition(&mut self, list: u32, failing: bool) -> bool {
        let wrong = if list == 21 {
            checks::cp3(&self.table, &self.settings)
        } else {
            checks::cp4(&self.table, &self.settings)
        };
        let well = wrong.is_empty() && !failing;
        let shown: &[Idn] = if self.settings.empty_invalid_lists { &[] } else { &wrong };
        self.table.set_idns(Idn::s(list), shown);
        self.check = Some((list, !well));
        if list == 21 {
            self.checked_3 = well;
        } else {
            self.checked_4 = well;
        }
        if !well {
            let names: Vec<String> = wrong.iter().map(ToString::to_string).collect();
            self.note(format!("invalid for CP{}: {}", list - 18, names.join(" ")));
        }
        well
    }

    fn start_command(&mut self, idn: Idn, control: u16) {
        let ms = self.settings.command_ms.iter().find(|(i, _)| *i == idn).map_or(0, |(_, ms)| *ms);
        let homing = idn == Idn::s(148);
        let until = (!homing).then(|| self.now.saturating_add(u64::from(ms) * 1_000_000));
        let started = self.commands.write(idn, control, until);
        if control & 3 == 0 {
            if homing {
                self.drive.end_homing();
            }
            if matches!(idn.block(), 127 | 128) {
                self.check = None;
            }
        }
        if !started {
            return;
        }
        if homing {
            if self.drive.home(&self.table) {
                self.table.set(Idn::s(403), &[0, 0]);
            } else {
                self.commands.finish(idn, false);
            }
        } else if ms == 0 {
            self.execute(idn);
        } else if idn.block() == 127 {
            self.check = Some((21, false));
        }
    }

    fn refuse(&mut self, idn: Idn, element: u8, write: bool, bytes: &[u8], code: u16) -> u16 {
        if self.refused.len() < LOG_MOST {
            let idn = idn.to_string();
            self.refused.push(Refused { idn, element, write, bytes: bytes.to_vec(), code });
        }
        code
    }

    fn odd(&self, idn: Idn, element: u8, write: bool) -> Option<u16> {
        let found = self
            .settings
            .svc_errors
            .iter()
            .find(|e| e.idn == idn && e.element == element && e.write == write);
        found.map(|e| e.code)
    }

    fn try_write(&mut self, idn: Idn, element: u8, data: &[u8]) -> Result<Vec<u8>, u16> {
        if let Some(code) = self.odd(idn, element, true) {
            return Err(code);
        }
        let parameter = self.table.get(idn).ok_or(0x1001u16)?;
        if element != 7 {
            let there = match element {
                2 => parameter.name.is_some(),
                4 => parameter.unit.is_some(),
                5 => parameter.min.is_some(),
                6 => parameter.max.is_some(),
                _ => true,
            };
            return Err(code(element, if there { 4 } else { 1 }));
        }
        parameter.may_write(self.phase.unwrap_or(0)).map_err(|low| code(7, low))?;
        if self.phase == Some(4) && self.connections.writes(idn) {
            return Err(0x700A);
        }
        let width = parameter.width();
        let data = if !parameter.is_list() && width < 4 && data.len() == 4 { &data[..width] } else { data };
        parameter.check(data)?;
        self.check_connection(idn, data)?;
        Ok(data.to_vec())
    }

    fn check_connection(&self, idn: Idn, data: &[u8]) -> Result<(), u16> {
        if idn.block() != 1050 {
            return Ok(());
        }
        let number = usize::try_from(idn.instance()).unwrap_or(usize::MAX);
        let Some(connection) = self.settings.connections.get(number) else { return Ok(()) };
        match idn.element() {
            1 => {
                let setup = super::telegram::get_u16(data, 0).unwrap_or(0);
                let producer = setup & 0x4000 != 0;
                if setup & 0x8000 != 0 && self.settings.is_fixed() && producer != connection.producer {
                    return Err(0x7008);
                }
            }
            6 => {
                let producer = self.table.word(Idn::se(1050, idn.instance(), 1)) & 0x4000 != 0;
                let known = if producer { &self.settings.producible } else { &self.settings.consumable };
                for quad in data.chunks_exact(4) {
                    let item = Idn(super::telegram::get_u32(quad, 0).unwrap_or(u32::MAX));
                    if !known.contains(&item) || self.table.get(item).is_none() {
                        return Err(0x7008);
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn after_write(&mut self, idn: Idn, data: &[u8]) {
        let control = super::telegram::get_u16(data, 0).unwrap_or(0);
        if self.table.get(idn).is_some_and(Parameter::is_command) {
            self.start_command(idn, control);
            return;
        }
        match idn.block() {
            1040 => {
                self.settings.address = control;
                self.table.set(Idn::s(1046), data);
            }
            1027 if idn.element() == 1 => self.table.set(Idn::se(1027, 0, 2), data),
            1050 if idn.element() == 6 => {
                let list = self.table.idns(idn);
                let length = connections::length(|i| self.table.get(i).map_or(0, Parameter::width), &list);
                let number = usize::try_from(idn.instance()).unwrap_or(usize::MAX);
                let declared = self.settings.connections.get(number).and_then(|c| c.declared_length);
                let length = declared.unwrap_or(length);
                self.table.set(Idn::se(1050, idn.instance(), 5), &length.to_le_bytes());
            }
            1050 if idn.element() == 1 => {
                let count = u32::try_from(self.settings.connections.len().min(255)).unwrap_or(0);
                let image: Vec<u8> =
                    (0..count).flat_map(|n| self.table.word(Idn::se(1050, n, 1)).to_le_bytes()).collect();
                self.table.set(Idn::s(1051), &image);
            }
            _ => self.drive.configure(&self.table, &self.settings),
        }
    }
}

impl Store for Device {
    fn open(&mut self, idn: Idn) -> Result<u16, u16> {
        if let Some(code) = self.odd(idn, 1, true) {
            return Err(self.refuse(idn, 1, true, &[], code));
        }
        let Some(parameter) = self.table.get(idn) else {
            return Err(self.refuse(idn, 1, true, &[], 0x1001));
        };
        if parameter.is_command() {
            return Ok(self.commands.status(idn));
        }
        Ok(if parameter.valid { 0 } else { 0x0100 })
    }

    fn read(&mut self, idn: Idn, element: u8) -> Result<Element, u16> {
        let parameter = self.table.get(idn).ok_or(0x1001u16)?;
        let text = |bytes: &Vec<u8>| {
            let capacity = u16::try_from(bytes.len()).unwrap_or(u16::MAX);
            Element { data: bytes.clone(), capacity, list: true }
        };
        let fixed = |bytes: &[u8]| Element { data: bytes.to_vec(), capacity: 0, list: false };
        let found = match element {
            2 => parameter.name.as_ref().map(text),
            3 => Some(fixed(&parameter.attribute.to_le_bytes())),
            4 => parameter.unit.as_ref().map(text),
            5 => parameter.min.as_deref().map(fixed),
            6 => parameter.max.as_deref().map(fixed),
            _ => Some(Element {
                data: parameter.data.clone(),
                capacity: parameter.capacity,
                list: parameter.is_list(),
            }),
        };
        let answer = match self.odd(idn, element, false) {
            Some(code) => Err(code),
            None => found.ok_or(code(element, 1)),
        };
        answer.map_err(|code| self.refuse(idn, element, false, &[], code))
    }

    fn write(&mut self, idn: Idn, element: u8, data: &[u8]) -> Result<(), u16> {
        match self.try_write(idn, element, data) {
            Ok(bytes) => {
                self.table.set(idn, &bytes);
                if self.writes.len() < LOG_MOST {
                    self.writes.push(Write { idn: idn.to_string(), element, bytes: bytes.clone() });
                }
                self.after_write(idn, &bytes);
                Ok(())
            }
            Err(code) => Err(self.refuse(idn, element, true, data, code)),
        }
    }

    fn is_list(&self, idn: Idn, element: u8) -> bool {
        match element {
            2 | 4 => true,
            7 => self.table.get(idn).is_some_and(Parameter::is_list),
            _ => false,
        }
    }

    fn busy_cycles(&self, idn: Idn) -> u32 {
        let own = self.settings.busy_on.iter().find(|(i, _)| *i == idn).map_or(0, |(_, n)| *n);
        self.settings.busy_cycles.saturating_add(own)
    }
}
