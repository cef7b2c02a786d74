//! Explicit requests, and the objects that every slave has.

use super::connection::{CONFIGURING, Connection, DEFERRED, ESTABLISHED, NON_EXISTENT, TIMED_OUT};
use super::settings::{BodyFormat, Profile};
use super::{DevicenetSlave, Drive};

pub use super::request::{ALLOCATE, GET, GET_LIST, RELEASE, RESET, Request, SET, SET_LIST};
use super::request::{path, word};

/// The codes of an error answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// The general status.
    pub general: u8,
    /// The additional code; FFh is none.
    pub additional: u8,
}

impl Refusal {
    /// The service is not there.
    pub const NO_SERVICE: Self = Self::new(0x08);
    /// The value is not possible.
    pub const BAD_VALUE: Self = Self::new(0x09);
    /// A list service with a bad attribute.
    pub const LIST: Self = Self::new(0x0A);
    /// The state does not allow it.
    pub const STATE: Self = Self::new(0x0C);
    /// The attribute can only be read.
    pub const READ_ONLY: Self = Self::new(0x0E);
    /// The data are too short.
    pub const SHORT: Self = Self::new(0x13);
    /// The attribute is not there.
    pub const NO_ATTRIBUTE: Self = Self::new(0x14);
    /// The data are too long.
    pub const LONG: Self = Self::new(0x15);
    /// The object is not there.
    pub const NO_OBJECT: Self = Self::new(0x16);

    /// A general status without an additional code.
    #[must_use]
    pub const fn new(general: u8) -> Self {
        Self { general, additional: 0xFF }
    }

    /// With an additional code.
    #[must_use]
    pub const fn with(general: u8, additional: u8) -> Self {
        Self { general, additional }
    }

    /// Checks the length of data.
    ///
    /// # Errors
    ///
    /// The data are too short or too long.
    pub fn length(data: &[u8], wanted: usize) -> Result<(), Self> {
        match data.len() {
            short if short < wanted => Err(Self::SHORT),
            long if long > wanted => Err(Self::LONG),
            _ => Ok(()),
        }
    }
}

/// The data of a good answer, or the codes of a bad one.
pub type Answer = Result<Vec<u8>, Refusal>;

/// An attribute that was set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SetRecord {
    /// The class.
    pub class: u16,
    /// The instance.
    pub instance: u16,
    /// The attribute.
    pub attribute: u16,
    /// The bytes.
    pub data: Vec<u8>,
}

/// A request that was refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedRecord {
    /// The service.
    pub service: u8,
    /// The class.
    pub class: u16,
    /// The instance.
    pub instance: u16,
    /// The attribute, if there was one.
    pub attribute: Option<u16>,
    /// The general status.
    pub general: u8,
    /// The additional code; FFh is none.
    pub additional: u8,
}

impl DevicenetSlave {
    /// Carries a request out and writes down what became of it.
    pub(super) fn serve(&mut self, master: u8, request: &Request) -> Answer {
        let answer = match request.class {
            0x01 => self.identity(request),
            0x02 => self.router(request),
            0x03 => self.devicenet(master, request),
            0x04 => self.assembly(request),
            0x05 => self.connections(request),
            class => self.drive_object(class, request),
        };
        if let Err(refusal) = answer {
            self.note_refused(request.service, request.class, request.instance, request.attribute, refusal);
        }
        answer
    }

    pub(super) fn note_refused(
        &mut self,
        service: u8,
        class: u16,
        instance: u16,
        attribute: Option<u16>,
        refusal: Refusal,
    ) {
        let Refusal { general, additional } = refusal;
        self.write_log(&format!(
            "service {service:02X}h of class {class:02X}h instance {instance} refused: {general:02X}h {additional:02X}h"
        ));
        self.refused.push(RefusedRecord { service, class, instance, attribute, general, additional });
    }

    /// The chosen refusal of a set.
    pub(super) fn chosen_refusal(&self, class: u16, attribute: u16) -> Option<Refusal> {
        let found =
            self.settings.refuse_sets.iter().find(|set| set.class == class && set.attribute == attribute);
        found.map(|set| Refusal::new(set.status))
    }

    pub(super) fn note_set(&mut self, class: u16, instance: u16, attribute: u16, data: &[u8]) {
        self.sets.push(SetRecord { class, instance, attribute, data: data.to_vec() });
    }

    fn identity(&mut self, request: &Request) -> Answer {
        match (request.instance, request.service, request.attribute) {
            (0, GET, Some(1)) => Ok(vec![1, 0]),
            (0, GET, _) => Err(Refusal::NO_ATTRIBUTE),
            (1, GET, Some(attribute)) => self.identity_value(attribute),
            (1, GET, None) => Err(Refusal::SHORT),
            (1, 0x01, _) => {
                let mut all = Vec::new();
                for attribute in 1..=7 {
                    all.extend(self.identity_value(attribute)?);
                }
                Ok(all)
            }
            (1, RESET, _) => match request.data.as_slice() {
                [] | [0 | 1] => {
                    self.restart_asked = true;
                    Ok(Vec::new())
                }
                _ => Err(Refusal::BAD_VALUE),
            },
            (1, SET, Some(1..=7)) => Err(Refusal::READ_ONLY),
            (1, SET, _) => Err(Refusal::NO_ATTRIBUTE),
            (0 | 1, ..) => Err(Refusal::NO_SERVICE),
            _ => Err(Refusal::NO_OBJECT),
        }
    }

    fn identity_value(&self, attribute: u16) -> Answer {
        let settings = &self.settings;
        Ok(match attribute {
            1 => settings.vendor.to_le_bytes().to_vec(),
            2 => settings.device_type.to_le_bytes().to_vec(),
            3 => settings.product_code.to_le_bytes().to_vec(),
            4 => vec![settings.revision.0, settings.revision.1],
            5 => {
                let fault = if self.faulted() { 0x0400 } else { 0 };
                (u16::from(self.master.is_some()) | fault).to_le_bytes().to_vec()
            }
            6 => settings.serial.to_le_bytes().to_vec(),
            7 => {
                let name: Vec<u8> = settings.product_name.bytes().take(32).collect();
                let mut short = vec![u8::try_from(name.len()).unwrap_or(0)];
                short.extend(name);
                short
            }
            _ => return Err(Refusal::NO_ATTRIBUTE),
        })
    }

    fn router(&mut self, request: &Request) -> Answer {
        match (request.instance, request.service, request.attribute) {
            (0, GET, Some(1)) => Ok(vec![1, 0]),
            (1, GET, Some(2)) => Ok(vec![1, 0]),
            (1, GET, Some(3)) => Ok(u16::from(self.explicit.exists()).to_le_bytes().to_vec()),
            (0 | 1, GET, _) => Err(Refusal::NO_ATTRIBUTE),
            (0 | 1, ..) => Err(Refusal::NO_SERVICE),
            _ => Err(Refusal::NO_OBJECT),
        }
    }

    fn devicenet(&mut self, master: u8, request: &Request) -> Answer {
        let choice = |at: usize| request.data.get(at).copied();
        match (request.instance, request.service, request.attribute) {
            (0, GET, Some(1)) => Ok(vec![2, 0]),
            (1, GET, Some(1)) => Ok(vec![self.settings.mac]),
            (1, GET, Some(2)) => Ok(vec![self.settings.baud]),
            (1, GET, Some(3 | 4)) => Ok(vec![0]),
            (1, GET, Some(5)) => Ok(vec![self.choice(), self.master.unwrap_or(0xFF)]),
            (1, ALLOCATE, _) => match (choice(0), choice(1)) {
                (Some(choice), Some(allocator)) => self.allocate(choice, allocator),
                _ => Err(Refusal::SHORT),
            },
            (1, RELEASE, _) => match choice(0) {
                Some(choice) => self.release(master, choice),
                None => Err(Refusal::SHORT),
            },
            (1, SET, Some(1 | 2)) => Err(Refusal::STATE),
            (1, SET, Some(3..=5)) => Err(Refusal::READ_ONLY),
            (0 | 1, GET | SET, _) => Err(Refusal::NO_ATTRIBUTE),
            (0 | 1, ..) => Err(Refusal::NO_SERVICE),
            _ => Err(Refusal::NO_OBJECT),
        }
    }

    /// Allocates what the choice byte asks for.
    fn allocate(&mut self, choice: u8, allocator: u8) -> Answer {
        if let Some((general, additional)) = self.settings.refuse_allocation {
            return Err(Refusal::with(general, additional));
        }
        if self.foreign || self.master.is_some_and(|master| master != allocator) {
            return Err(Refusal::with(0x0C, 0x01));
        }
        if allocator > 63 || choice == 0 || choice & 0x80 != 0 {
            return Err(Refusal::with(0x09, 0x02));
        }
        if choice & !self.settings.choices != 0 {
            return Err(Refusal::with(0x02, 0x02));
        }
        let explicit = choice & 0x01 != 0;
        let poll = choice & 0x02 != 0;
        if self.settings.io_needs_explicit && choice & 0x01 == 0 && !self.explicit.exists() {
            return Err(Refusal::with(0x09, 0x02));
        }
        let taken = |connection: &Connection| !matches!(connection.state, NON_EXISTENT | TIMED_OUT);
        if (explicit && taken(&self.explicit)) || (poll && taken(&self.poll)) {
            return Err(Refusal::with(0x0B, 0x02));
        }
        self.master = Some(allocator);
        if explicit {
            self.explicit = Connection::explicit(self.now_us);
            self.explicit_in = super::messages::ExplicitIn::default();
            self.explicit_out = None;
        }
        if poll {
            self.open_poll();
        }
        self.write_log(&format!("allocated to {allocator}, choice {choice:02X}h"));
        Ok(vec![match self.settings.body_format {
            BodyFormat::EightEight => 0,
            BodyFormat::EightSixteen => 1,
            BodyFormat::SixteenSixteen => 2,
            BodyFormat::SixteenEight => 3,
            BodyFormat::Path => 4,
        }])
    }

    /// Releases what the choice byte asks for.
    fn release(&mut self, master: u8, choice: u8) -> Answer {
        if self.foreign || self.master.is_some_and(|owner| owner != master) {
            return Err(Refusal::with(0x0C, 0x01));
        }
        if choice == 0 || choice & 0x80 != 0 {
            return Err(Refusal::with(0x09, 0x02));
        }
        if choice & !self.settings.choices != 0 {
            return Err(Refusal::with(0x02, 0x02));
        }
        let (explicit, poll) = (choice & 0x01 != 0, choice & 0x02 != 0);
        if (explicit && !self.explicit.exists()) || (poll && !self.poll.exists()) {
            return Err(Refusal::with(0x0B, 0x02));
        }
        if poll {
            self.close_poll();
        }
        if explicit || self.explicit.state == DEFERRED {
            self.explicit = Connection::none(1);
        }
        self.write_log(&format!("released, choice {choice:02X}h"));
        self.let_go();
        Ok(Vec::new())
    }

    fn assembly(&mut self, request: &Request) -> Answer {
        if self.settings.profile != Profile::Speed {
            return Err(Refusal::NO_OBJECT);
        }
        let Ok(instance) = u8::try_from(request.instance) else { return Err(Refusal::NO_OBJECT) };
        match (instance, request.service, request.attribute) {
            (0, GET, Some(1)) => return Ok(vec![2, 0]),
            (0, GET, _) => return Err(Refusal::NO_ATTRIBUTE),
            (0, ..) => return Err(Refusal::NO_SERVICE),
            _ => {}
        }
        if !self.settings.assemblies.contains(&instance) {
            return Err(Refusal::NO_OBJECT);
        }
        match (request.service, request.attribute) {
            (GET, Some(3)) => match &self.drive {
                Drive::Speed(drive) => drive.assembly(&self.settings, instance).ok_or(Refusal::NO_OBJECT),
                Drive::Motion(_) => Err(Refusal::NO_OBJECT),
            },
            (SET, Some(3)) => {
                if !matches!(instance, 20 | 21) {
                    return Err(Refusal::READ_ONLY);
                }
                if self.poll.state == ESTABLISHED {
                    return Err(Refusal::STATE);
                }
                Refusal::length(&request.data, 4)?;
                self.note_set(4, request.instance, 3, &request.data);
                if let Drive::Speed(drive) = &mut self.drive {
                    drive.consume(&self.settings, instance, &request.data);
                }
                Ok(Vec::new())
            }
            (GET | SET, _) => Err(Refusal::NO_ATTRIBUTE),
            _ => Err(Refusal::NO_SERVICE),
        }
    }

    fn connections(&mut self, request: &Request) -> Answer {
        if request.instance == 0 {
            return match (request.service, request.attribute) {
                (GET, Some(1)) => Ok(vec![1, 0]),
                (GET, _) => Err(Refusal::NO_ATTRIBUTE),
                _ => Err(Refusal::NO_SERVICE),
            };
        }
        let poll = match request.instance {
            1 if self.explicit.exists() => false,
            2 if self.poll.exists() => true,
            _ => return Err(Refusal::NO_OBJECT),
        };
        let told = if poll {
            (self.settings.told_produced_size, self.settings.told_consumed_size)
        } else {
            (None, None)
        };
        let mac = self.settings.mac;
        let now_us = self.now_us;
        let connection = if poll { &mut self.poll } else { &mut self.explicit };
        match (request.service, request.attribute) {
            (GET, Some(attribute)) => connection.get(mac, attribute, told),
            (SET, Some(attribute)) => {
                connection.get(mac, attribute, told)?;
                if let Some(refusal) = self.chosen_refusal(5, attribute) {
                    return Err(refusal);
                }
                let answer = self.set_connection(poll, attribute, &request.data)?;
                self.note_set(5, request.instance, attribute, &request.data);
                Ok(answer)
            }
            (RESET, _) if connection.state == TIMED_OUT || connection.state == ESTABLISHED => {
                connection.state = ESTABLISHED;
                connection.arm(now_us, false);
                Ok(Vec::new())
            }
            (RESET, _) => Err(Refusal::STATE),
            (GET | SET, None) => Err(Refusal::SHORT),
            _ => Err(Refusal::NO_SERVICE),
        }
    }

    fn set_connection(&mut self, poll: bool, attribute: u16, data: &[u8]) -> Answer {
        let now_us = self.now_us;
        let step = self.settings.packet_rate_step_ms.max(1);
        let silent = self.settings.silent_packet_rate;
        match attribute {
            9 => {
                Refusal::length(data, 2)?;
                let asked = word(data, 0).unwrap_or(0);
                let connection = if poll { &mut self.poll } else { &mut self.explicit };
                if !matches!(connection.state, CONFIGURING | ESTABLISHED) {
                    return Err(Refusal::STATE);
                }
                let first = connection.state == CONFIGURING;
                connection.packet_rate = asked.div_ceil(step).saturating_mul(step);
                connection.state = ESTABLISHED;
                connection.arm(now_us, first);
                let rate = connection.packet_rate.to_le_bytes().to_vec();
                if first {
                    self.io_in.clear();
                    self.write_log("poll connection established");
                }
                Ok(if silent { Vec::new() } else { rate })
            }
            12 => {
                Refusal::length(data, 1)?;
                let action = data.first().copied().unwrap_or(0);
                let allowed = if poll { matches!(action, 0..=2) } else { matches!(action, 1 | 3) };
                if !allowed {
                    return Err(Refusal::BAD_VALUE);
                }
                let connection = if poll { &mut self.poll } else { &mut self.explicit };
                connection.watchdog_action = action;
                Ok(Vec::new())
            }
            17 | 18 => {
                Refusal::length(data, if attribute == 17 { 2 } else { 1 })?;
                let connection = if poll { &mut self.poll } else { &mut self.explicit };
                if attribute == 17 {
                    connection.inhibit = word(data, 0).unwrap_or(0);
                } else {
                    let value = data.first().copied().unwrap_or(0);
                    if value > 7 {
                        return Err(Refusal::BAD_VALUE);
                    }
                    connection.multiplier = value;
                }
                Ok(Vec::new())
            }
            14 | 16 if poll => self.set_path(attribute == 14, data),
            _ => Err(Refusal::READ_ONLY),
        }
    }

    /// Chooses another assembly for one direction of the poll connection.
    fn set_path(&mut self, produced: bool, data: &[u8]) -> Answer {
        if self.settings.fixed_paths {
            return Err(Refusal::READ_ONLY);
        }
        if self.poll.state != CONFIGURING {
            return Err(Refusal::STATE);
        }
        if self.settings.profile == Profile::Motion {
            let same = data == self.settings.motion_path;
            return if same { Ok(Vec::new()) } else { Err(Refusal::BAD_VALUE) };
        }
        let Some((4, instance, None | Some(3))) = path(data) else { return Err(Refusal::BAD_VALUE) };
        let instance = u8::try_from(instance).map_err(|_| Refusal::BAD_VALUE)?;
        let fits = if produced { matches!(instance, 70 | 71) } else { matches!(instance, 20 | 21) };
        if !fits || !self.settings.assemblies.contains(&instance) {
            return Err(Refusal::BAD_VALUE);
        }
        if produced {
            self.produced_assembly = instance;
            self.poll.produced_path = data.to_vec();
        } else {
            self.consumed_assembly = instance;
            self.poll.consumed_path = data.to_vec();
        }
        Ok(Vec::new())
    }
}
