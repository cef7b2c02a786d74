//! The commissioning of a device as the gateway does it, with answers from a data sheet.
//!
//! The commissioner is the one of the box. What its requests lead to is what the file says: objects that are not there, accesses
//! and limits. A value that the file does not give is not made up, except for factors of the scaling, without which nothing
//! else could be checked.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use profile_cia402::drive::index;
use profile_cia402::eds::DeviceDescription;
use profile_cia402::master::config::MasterConfig;
use profile_cia402::master::pdo_set::PdoSet;
use profile_cia402::sdo::request::{SdoData, SdoFailure, SdoOperation, SdoOutcome, SdoRequest};
use profile_cia402::wire::{AbortCode, Mux, NodeId};

use crate::engine::bus::can::commissioner::{AxisSetup, Made, Order, commissioner};
use crate::engine::bus::commissioner::{Done, Job, Run};
use crate::engine::notice::Notice;
use crate::mapping::{DriveIdentity, DriveProgram, Mapping};

/// Objects by which a count is known, on the first axis.
const SCALING: [u16; 6] = [
    index::VL_DIMENSION_FACTOR,
    index::ENCODER_RESOLUTION,
    index::GEAR_RATIO,
    index::FEED_CONSTANT,
    index::VELOCITY_FACTOR,
    index::ACCELERATION_FACTOR,
];

/// Unit of velocities (60A9), and revolutions per minute in it.
const VELOCITY_UNIT: u16 = 0x60A9;
const RPM: u32 = 0x00B4_4700;

/// How a commissioning ended.
#[derive(Debug)]
pub enum End {
    /// With these PDOs, and the programs of the axes in their order.
    Made(PdoSet, Vec<Arc<DriveProgram>>),
    /// The device is left out.
    Failed(Box<Notice>),
}

/// A commissioning by a data sheet.
#[derive(Debug)]
pub struct Rehearsal {
    /// How it ended; `None` where it came to no end.
    pub end: Option<End>,
    /// What the gateway would log.
    pub notices: Vec<Notice>,
    /// Objects of the scaling whose values the file does not give.
    pub unscaled: BTreeSet<Mux>,
}

/// Commissions a device with these axes. With `keeps`, its PDOs are used as they are.
pub fn rehearse(
    mapping: &Mapping,
    master: &MasterConfig,
    node: NodeId,
    axes: Vec<AxisSetup>,
    description: &DeviceDescription,
    keeps: bool,
) -> Rehearsal {
    let (mut commissioner, mut handle) = commissioner(mapping.clone(), master.clone(), [(node, axes)]);
    let mut device = Answers {
        description,
        node: node.get(),
        written: BTreeMap::new(),
        modes: BTreeMap::new(),
        unscaled: BTreeSet::new(),
    };
    let number = |sub| description.number(index::IDENTITY, sub, device.node);
    let identity = DriveIdentity { vendor: number(1), product: number(2) };
    let run = Run::new(0, 1);
    let mut notices = Vec::new();
    let mut programs = Vec::new();
    let mut end = None;
    // An empty queue has room for two.
    handle.push(Job::Order(run, Order::Keep(keeps)));
    handle.push(Job::Order(run, Order::Begin(identity)));
    while end.is_none() {
        commissioner.poll();
        let mut is_over = true;
        while let Some((run, done)) = handle.pop(&mut |notice| notices.push(notice)) {
            is_over = false;
            match done {
                Done::Submit(_, request) => {
                    handle.push(Job::Outcome(run, device.answer(request)));
                }
                Done::Made(_, Made::Program(_, program, _)) => programs.push(program),
                Done::Made(_, Made::Pdos(set)) => end = Some(End::Made(set, std::mem::take(&mut programs))),
                Done::Failed(_, notice) => end = Some(End::Failed(Box::new(notice))),
                Done::Told(notice) => notices.push(notice),
            }
        }
        if is_over {
            break;
        }
    }
    Rehearsal { end, notices, unscaled: device.unscaled }
}

/// A device that answers by its data sheet.
struct Answers<'a> {
    description: &'a DeviceDescription,
    node: u8,
    written: BTreeMap<Mux, Vec<u8>>,
    /// What 6060 of each axis was given, by the number of its 6061.
    modes: BTreeMap<u16, Vec<u8>>,
    unscaled: BTreeSet<Mux>,
}

impl Answers<'_> {
    fn answer(&mut self, request: SdoRequest) -> SdoOutcome {
        let SdoRequest { object, operation, data, .. } = request;
        let (result, data) = match operation {
            SdoOperation::Upload => match self.read(object) {
                Ok(bytes) => (Ok(()), SdoData::inline(&bytes).unwrap_or(SdoData::Buffer(bytes))),
                Err(code) => (Err(SdoFailure::Refused(code)), data),
            },
            SdoOperation::Download => {
                (self.write(object, data.as_slice()).map_err(SdoFailure::Refused), data)
            }
        };
        SdoOutcome { object, operation, result, data }
    }

    fn read(&mut self, object: Mux) -> Result<Vec<u8>, AbortCode> {
        let said = self.description.reads(object, self.node)?;
        if let Some(bytes) = self.written.get(&object).or_else(|| self.modes.get(&object.index)) {
            return Ok(bytes.clone());
        }
        let index = index::on_first_axis(object.index);
        let is_factor = SCALING.contains(&index) && object.sub > 0;
        // A factor of 0 is one that the file does not say.
        if let Some(bytes) = said.filter(|bytes| !is_factor || bytes.iter().any(|byte| *byte != 0)) {
            return Ok(bytes);
        }
        let size = self.description.look_up(object)?.data_type.bits().map_or(0, |bits| usize::from(bits / 8));
        let number = match index {
            VELOCITY_UNIT => RPM,
            _ if is_factor => 1,
            _ => return Err(AbortCode::NO_DATA),
        };
        self.unscaled.insert(object);
        Ok(number.to_le_bytes().into_iter().chain(std::iter::repeat(0)).take(size).collect())
    }

    fn write(&mut self, object: Mux, bytes: &[u8]) -> Result<(), AbortCode> {
        self.description.takes(object, bytes, self.node)?;
        self.written.insert(object, bytes.to_vec());
        if index::on_first_axis(object.index) == index::MODE {
            self.modes.insert(object.index + (index::MODE_DISPLAY - index::MODE), bytes.to_vec());
        }
        Ok(())
    }
}
