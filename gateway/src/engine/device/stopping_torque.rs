//! Stopping Torque (attribute 611): the most torque that a Current Decel stop may use (CIP Volume 9, 5-2.3.9).
//!
//! Drives of SERCOS and CANopen brake by themselves, within their own torque limits, and have no other limit for a stop. A value is therefore
//! compared with those limits, as the drive has them at that moment: it is kept where neither is above it, so that no stop uses more, and
//! refused otherwise. A torque limit that is set later must not be above it either.
//!
//! A drive whose limits the gateway does not know (DeviceNet) is refused: what it stops with nobody could say.

use arrayvec::ArrayVec;
use profile_cip::device::attribute_worker::AttributeAccess;
use profile_cip::wire::status::GeneralStatus;
use profile_generic::parameter::Parameter;

use super::refusal::refusal;
use crate::engine::access::Access;
use crate::engine::axis::AxisChannel;
use crate::engine::bus::{Answer, Buses, Purpose};
use crate::mapping::{AttributeEntry, AttributeTable, Backing};

/// The limits of both directions.
const LIMITS: [Parameter; 2] = [Parameter::TORQUE_LIMIT_POSITIVE, Parameter::TORQUE_LIMIT_NEGATIVE];

/// A comparison under way.
#[derive(Debug, Clone)]
pub(super) struct Comparison {
    pub ticket: u32,
    pub attribute: u16,
    pub bytes: ArrayVec<u8, 8>,
    /// The value in the generic unit.
    torque: u64,
    /// Answers of the drive that are missing.
    missing: usize,
    verdict: Result<(), GeneralStatus>,
}

impl Comparison {
    /// Asks the drive for its torque limits.
    pub fn begin(
        access: &AttributeAccess,
        bytes: &[u8],
        entry: &AttributeEntry,
        (device, number): (u8, usize),
        axis: &AxisChannel,
        buses: &mut Buses,
    ) -> Result<Self, GeneralStatus> {
        let generic = entry.to_generic(bytes).map_err(|_| GeneralStatus::INVALID_ATTRIBUTE_VALUE)?;
        let torque = u64::try_from(generic).map_err(|_| GeneralStatus::INVALID_ATTRIBUTE_VALUE)?;
        let bytes = ArrayVec::try_from(bytes).map_err(|_| GeneralStatus::TOO_MUCH_DATA)?;
        let program = axis.south().ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)?;
        let mut requests = ArrayVec::<Access, 2>::new();
        for limit in LIMITS {
            // What a drive stops with that has no limit, nobody knows.
            let held = program.parameter(limit).ok_or(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED)?;
            requests.push(Access::read(held.item));
        }
        let (ticket, attribute) = (access.ticket, access.id);
        let purpose = Purpose::Attribute { ticket, device, attribute, write: true };
        let missing = requests.iter().take_while(|request| buses.access(number, request, purpose)).count();
        let busy = Err(GeneralStatus::RESOURCE_UNAVAILABLE);
        if missing == 0 {
            busy?;
        }
        // Where only one could be asked, its answer ends the comparison.
        let verdict = if missing == requests.len() { Ok(()) } else { busy };
        Ok(Self { ticket, attribute, bytes, torque, missing, verdict })
    }

    /// Takes an answer of the drive; the result, when it is the last one.
    pub fn take(&mut self, answer: &Answer, axis: &AxisChannel) -> Option<Result<(), GeneralStatus>> {
        self.missing = self.missing.saturating_sub(1);
        let limit = match &answer.result {
            Err(failure) => Err(refusal(*failure)),
            Ok((data, _)) => {
                let held = LIMITS.iter().filter_map(|limit| axis.south()?.parameter(*limit));
                let held = held.into_iter().find(|held| held.item == answer.item);
                held.and_then(|held| held.decode(data)).ok_or(GeneralStatus::DEVICE_STATE_CONFLICT)
            }
        };
        let judged = limit.and_then(|limit| {
            let kept = limit.unsigned_abs() <= self.torque;
            kept.then_some(()).ok_or(GeneralStatus::INVALID_ATTRIBUTE_VALUE)
        });
        self.verdict = self.verdict.and(judged);
        (self.missing == 0).then_some(self.verdict)
    }
}

/// Whether a torque limit that is to be written is above the Stopping Torque that was accepted.
pub(super) fn exceeds(
    parameter: Parameter,
    value: i64,
    attributes: &AttributeTable,
    get: impl Fn(u16) -> Option<i64>,
    axis: &AxisChannel,
) -> bool {
    let in_drive =
        axis.south().is_some_and(|program| program.parameter(Parameter::STOPPING_TORQUE).is_some());
    if in_drive || !LIMITS.contains(&parameter) {
        return false;
    }
    let stopping = attributes.entries().iter().find(|entry| is_stopping_torque(entry));
    let accepted = stopping.and_then(|entry| get(entry.id)).filter(|accepted| *accepted > 0);
    accepted.is_some_and(|accepted| value.unsigned_abs() > accepted.unsigned_abs())
}

/// Whether this is the attribute.
pub(super) fn is_stopping_torque(entry: &AttributeEntry) -> bool {
    matches!(entry.backing, Backing::Parameter { parameter: Parameter::STOPPING_TORQUE, .. })
}
