//! Whether a device takes the PDOs that it is to be given, step by step as the master gives them.

use profile_cia402::eds::DeviceDescription;
use profile_cia402::eds::drive::{self, Direction};
use profile_cia402::master::config::{MappingPolicy, PdoConfig};
use profile_cia402::master::pdo_set::PdoSet;
use profile_cia402::wire::pdo::{SUB_COB_ID, SUB_EVENT_TIMER, SUB_TYPE, TransmissionType};
use profile_cia402::wire::{AbortCode, CobId, Mux, NodeId};

/// What a device makes of a PDO.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Trouble {
    /// The mapping, or the identifier, is not taken: the PDOs that the device has are used.
    Mapping(Refusal),
    /// The device is left out.
    Fatal(Refusal),
    /// The PDO is used otherwise.
    Other(Refusal),
}

/// What is refused, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The object that is written or read.
    pub object: Mux,
    /// In words.
    pub text: String,
}

/// What a device makes of its PDOs, in the order in which they are set up.
pub fn troubles(description: &DeviceDescription, node: NodeId, set: &PdoSet) -> Vec<Trouble> {
    let mut all = Vec::new();
    for direction in Direction::BOTH {
        for pdo in set.pdos(direction) {
            Walk { description, node, direction, pdo, all: &mut all }.walk();
        }
    }
    all
}

/// The transmission types of a PDO, the wanted one first.
fn types(pdo: &PdoConfig) -> impl Iterator<Item = TransmissionType> {
    core::iter::once(&pdo.transmission).chain(pdo.others).copied()
}

/// One PDO.
struct Walk<'a> {
    description: &'a DeviceDescription,
    node: NodeId,
    direction: Direction,
    pdo: &'a PdoConfig,
    all: &'a mut Vec<Trouble>,
}

impl Walk<'_> {
    fn walk(&mut self) {
        let object = self.parameter(SUB_COB_ID);
        if let Err(code) = self.description.look_up(object) {
            let text = format!("the device has no {}: {object}: {code}", self.name());
            return self.all.push(Trouble::Fatal(Refusal { object, text }));
        }
        let said = self.number(object).map(CobId);
        let wanted = self.pdo.id(self.direction, self.node).map_or(CobId(1 << 31), CobId::new);
        let wanted = wanted.with_bit_30(said.is_some_and(CobId::bit_30));
        if self.pdo.policy == MappingPolicy::Keep {
            let same = said.is_none_or(|said| said.is_valid() && said.id() == wanted.id());
            if let Err(code) = self.takes(object, &wanted.0.to_le_bytes())
                && !same
            {
                let text = format!(
                    "{} is switched off or has another identifier, and {object}: {code}",
                    self.name()
                );
                self.all.push(Trouble::Fatal(Refusal { object, text }));
            }
        } else {
            self.mapping(wanted);
        }
        let transmission = self.transmission();
        self.event_timer(transmission);
    }

    /// COB-ID and mapping as they are written.
    fn mapping(&mut self, cob_id: CobId) {
        let object = self.parameter(SUB_COB_ID);
        for word in [cob_id.with_valid(false), cob_id.with_valid(true)] {
            if let Err(code) = self.takes(object, &word.0.to_le_bytes()) {
                return self.refuse(object, "its identifier cannot be written", code);
            }
        }
        let count = self.direction.mapping_object(self.pdo.number, 0);
        if self.description.device.granularity == Some(0) {
            return self.refuse(count, "its mapping is fixed (Granularity=0)", AbortCode::READ_ONLY);
        }
        if let Err(code) = self.takes(count, &[0]) {
            return self.refuse(count, "its mapping cannot be written", code);
        }
        for (sub, entry) in (1..=u8::MAX).zip(&self.pdo.mapping) {
            let object = self.direction.mapping_object(self.pdo.number, sub);
            let mapped = drive::MappingEntry::of_word(entry.0);
            let taken = self.takes(object, &entry.0.to_le_bytes());
            if let Err(code) = taken {
                self.refuse(object, &format!("it has no entry {sub} for {}", entry.mux()), code);
            } else if let Err(code) = self.description.maps(self.direction, mapped) {
                self.refuse(
                    entry.mux(),
                    &format!("it cannot carry {} of {} bits", entry.mux(), entry.bits()),
                    code,
                );
            }
        }
        let entries = u8::try_from(self.pdo.mapping.len()).unwrap_or(u8::MAX);
        if let Err(code) = self.takes(count, &[entries]) {
            self.refuse(count, &format!("it has no room for {entries} entries"), code);
        }
    }

    fn refuse(&mut self, object: Mux, what: &str, code: AbortCode) {
        let text = format!("{}: {what}: {code}", self.name());
        self.all.push(Trouble::Mapping(Refusal { object, text }));
    }

    /// The transmission type that the PDO would be used with.
    fn transmission(&mut self) -> TransmissionType {
        let wanted = self.pdo.transmission;
        match self.written_type() {
            Ok(kind) => {
                if kind != wanted {
                    self.other_type(kind);
                }
                kind
            }
            Err(code) => self.kept_type(code),
        }
    }

    /// The first of the types that the device takes; else why it does not take the wanted one.
    fn written_type(&self) -> Result<TransmissionType, AbortCode> {
        let object = self.parameter(SUB_TYPE);
        let mut first = None;
        for kind in types(self.pdo) {
            match self.takes(object, &[kind.0]) {
                Ok(()) => return Ok(kind),
                Err(code) => {
                    first = first.or(Some(code));
                    if matches!(code, AbortCode::READ_ONLY | AbortCode::ACCESS) {
                        break;
                    }
                }
            }
        }
        // There is at least the wanted one.
        first.map_or(Ok(self.pdo.transmission), Err)
    }

    /// The type that the device has and keeps, where it does.
    fn kept_type(&mut self, code: AbortCode) -> TransmissionType {
        let (object, wanted) = (self.parameter(SUB_TYPE), self.pdo.transmission);
        let strict = self.pdo.policy == MappingPolicy::Exact && self.pdo.others.is_empty();
        let exists = self.description.look_up(object).is_ok();
        let found = self.number(object).and_then(|word| u8::try_from(word).ok()).map(TransmissionType);
        match found {
            // The file does not say what it has.
            None if exists && !strict => wanted,
            Some(found) if !strict && self.does(found) => {
                if found != wanted {
                    self.other_type(found);
                }
                found
            }
            _ => {
                let kinds: Vec<_> = types(self.pdo).map(|kind| kind.0.to_string()).collect();
                let has = found.map_or_else(String::new, |found| format!(", and it has {}", found.0));
                let text = format!(
                    "{} cannot have the transmission type {}: {object}: {code}{has}",
                    self.name(),
                    kinds.join(" or ")
                );
                self.all.push(Trouble::Fatal(Refusal { object, text }));
                wanted
            }
        }
    }

    /// Whether a type does as well as one of those of the PDO.
    fn does(&self, found: TransmissionType) -> bool {
        let receives = |kind: TransmissionType| {
            self.direction == Direction::Receive && kind.is_synchronous() && !kind.is_remote()
        };
        let as_well = |kind| kind == found || receives(kind) && receives(found);
        found == self.pdo.transmission || !self.pdo.others.is_empty() && types(self.pdo).any(as_well)
    }

    fn other_type(&mut self, kind: TransmissionType) {
        let (object, wanted) = (self.parameter(SUB_TYPE), self.pdo.transmission.0);
        let text = format!("{} cannot have the transmission type {wanted}: {} is used", self.name(), kind.0);
        self.all.push(Trouble::Other(Refusal { object, text }));
    }

    /// A TPDO that is sent on event needs its timer.
    fn event_timer(&mut self, transmission: TransmissionType) {
        let transmits = self.direction == Direction::Transmit;
        let time = if transmits && !transmission.is_event_driven() { 0 } else { self.pdo.event_timer_ms };
        let object = self.parameter(SUB_EVENT_TIMER);
        if time > 0
            && let Err(code) = self.takes(object, &time.to_le_bytes())
        {
            let text = format!("{} cannot be sent every {time} ms: {object}: {code}", self.name());
            self.all.push(Trouble::Fatal(Refusal { object, text }));
        }
    }

    /// `RPDO 1`.
    fn name(&self) -> String {
        format!("{} {}", self.direction, self.pdo.number)
    }

    fn parameter(&self, sub: u8) -> Mux {
        self.direction.communication_object(self.pdo.number, sub)
    }

    fn takes(&self, object: Mux, bytes: &[u8]) -> Result<(), AbortCode> {
        self.description.takes(object, bytes, self.node.get())
    }

    fn number(&self, object: Mux) -> Option<u32> {
        self.description.number(object.index, object.sub, self.node.get())
    }
}
